//! The content of a file of batches.

use std::path::Path;

use fredholm::execute::SetUp;
use fredholm_core::{Batch, Statistics};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::PartError;
use crate::frames::{self, Frame, Kind, MAGIC};
use crate::identity::{Header, JobRecord};
use crate::share::Share;

/// Characters of [`MAGIC`] before the version.
const NAMED: usize = 14;
/// The most goals of a job besides those that were asked for: surfaces of a room.
const MOST_OTHERS: usize = 1 << 20;
/// The most runs of a file: a choice gives up few.
const MOST_RUNS: usize = 100;

/// All walks of a batch of one goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// The number of the file's job whose walks they are, from 0.
    pub job: u32,
    /// The number of the goal, from 0.
    pub goal: u32,
    /// The number of the batch, from 0.
    pub batch: u64,
    /// Their statistics.
    pub statistics: Statistics,
}

impl Record {
    /// The length of [`to_bytes`](Self::to_bytes).
    pub const BYTES: usize = 24 + Statistics::BYTES;

    /// The record in 120 bytes: as little-endian numbers job and goal, the batch, the standard error of (v, Φ) in single precision, the
    /// number of replicates, and [`Statistics::to_bytes`].
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let fields = [
            &self.job.to_le_bytes()[..],
            &self.goal.to_le_bytes(),
            &self.batch.to_le_bytes(),
            &(self.statistics.control_error() as f32).to_le_bytes(),
            &self.statistics.replicates().to_le_bytes(),
            &self.statistics.to_bytes(),
        ];
        for (to, from) in bytes.iter_mut().zip(fields.into_iter().flatten()) {
            *to = *from;
        }
        bytes
    }

    /// The record that [`to_bytes`](Self::to_bytes) wrote. `None`: there are not as many bytes, or the numbers of walks
    /// contradict each other.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; Self::BYTES] = bytes.try_into().ok()?;
        let (job, rest) = bytes.split_first_chunk()?;
        let (goal, rest) = rest.split_first_chunk()?;
        let (batch, rest) = rest.split_first_chunk()?;
        let (error, rest) = rest.split_first_chunk()?;
        let (replicates, rest) = rest.split_first_chunk()?;
        let statistics = Statistics::from_bytes(rest.first_chunk()?)?;
        // A batch of these walks alone carries the error of (v, Φ).
        let mut walks = Batch::resume(0, statistics.walks(), statistics.walks(), statistics)?;
        let error = f64::from(f32::from_le_bytes(*error));
        if !(error >= 0.0) {
            return None;
        }
        walks.set_control_error(error);
        walks.set_replicates(u32::from_le_bytes(*replicates));
        Some(Self {
            job: u32::from_le_bytes(*job),
            goal: u32::from_le_bytes(*goal),
            batch: u64::from_le_bytes(*batch),
            statistics: *walks.statistics(),
        })
    }
}

/// Seconds that a part took, as far as it told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Seconds of the set-up.
    pub set_up: f64,
    /// Seconds of the walks.
    pub walks: f64,
}

/// Walks of one job: of settings that were given or chosen.
#[derive(Clone, Debug)]
pub struct Run {
    /// The job, with the largest number of walks that it was asked for.
    pub job: JobRecord,
    /// The number of a job of the file that is this one.
    pub number: u32,
    /// The batches, in the order in which they were done.
    pub records: Vec<Record>,
}

/// The content of a file: a problem, and the batches of its runs. The last run is the one that counts: others were given up
/// for it.
#[derive(Clone, Debug)]
pub struct Content {
    /// The problem.
    pub header: Header,
    /// Which batches it has, if it is a part of a run.
    pub share: Option<Share>,
    /// The runs.
    pub runs: Vec<Run>,
    /// The run of every job that was written: a job that is asked for more walks is of the same run.
    pub jobs: Vec<usize>,
    /// Seconds.
    pub seconds: Seconds,
    /// Bytes of the file that were read; what follows was never finished.
    pub length: usize,
}

impl Content {
    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// [`PartError`]: it is no part, or of another version, or damaged.
    pub fn read(path: &Path, bytes: &[u8]) -> Result<Self, PartError> {
        let refuse = |message: &str| PartError::refused(path, message);
        let found = Self::begun(path, bytes)?;
        found.ok_or_else(|| refuse("nothing of it was written whole: give its command again"))
    }

    /// Reads the bytes of a file. `None`: not even its beginning was written whole.
    ///
    /// # Errors
    /// [`PartError`].
    pub fn begun(path: &Path, bytes: &[u8]) -> Result<Option<Self>, PartError> {
        let refuse = |message: String| PartError::refused(path, message);
        check_magic(path, bytes)?;
        let damaged = |at: usize| {
            refuse(format!(
                "it is damaged at byte {at}, and good batches follow: a byte was lost or changed; make it again"
            ))
        };
        let frames = frames::read(bytes).map_err(damaged)?;
        let mut all = frames.all.iter();
        let header = match all.next() {
            None => return Ok(None),
            Some(Frame {
                kind: Kind::Header,
                payload,
            }) => json(path, payload)?,
            Some(_) => return Err(refuse("its header is missing".to_owned())),
        };
        let mut content = Self {
            header,
            share: None,
            runs: Vec::new(),
            jobs: Vec::new(),
            seconds: Seconds::default(),
            length: frames.end,
        };
        for frame in all {
            content.add(path, frame)?;
        }
        Ok(Some(content))
    }

    fn add(&mut self, path: &Path, frame: &Frame<'_>) -> Result<(), PartError> {
        let contradiction =
            || PartError::refused(path, "its records contradict each other: make it again");
        match frame.kind {
            Kind::Header => return Err(contradiction()),
            Kind::Share => {
                let share: Share = json(path, frame.payload)?;
                self.share = Some(share.checked().map_err(|_| contradiction())?);
            }
            Kind::Seconds => {
                let more: Seconds = json(path, frame.payload)?;
                self.seconds.set_up += more.set_up;
                self.seconds.walks += more.walks;
            }
            Kind::Job => {
                let job: JobRecord = json(path, frame.payload)?;
                let SetUp {
                    goals, galerkin, ..
                } = &job.set_up;
                if *goals < galerkin.len() || goals - galerkin.len() > MOST_OTHERS {
                    return Err(contradiction());
                }
                self.add_job(job);
                if self.runs.len() > MOST_RUNS {
                    return Err(contradiction());
                }
            }
            Kind::Batch => {
                let record = Record::from_bytes(frame.payload).ok_or_else(contradiction)?;
                let number = self.jobs.get(record.job as usize);
                let run = number.and_then(|&number| self.runs.get_mut(number));
                let run = run.filter(|run| (record.goal as usize) < run.job.set_up.goals);
                run.ok_or_else(contradiction)?.records.push(record);
            }
        }
        Ok(())
    }

    /// Adds a job: the same walks, more of them, or others.
    fn add_job(&mut self, job: JobRecord) {
        let number = self.jobs.len() as u32;
        let mut runs = self.runs.iter_mut().enumerate();
        match runs.find(|(_, run)| run.job.difference(&job).is_none()) {
            Some((place, run)) => {
                if job.walks() >= run.job.walks() {
                    (run.job, run.number) = (job, number);
                }
                self.jobs.push(place);
            }
            None => {
                self.jobs.push(self.runs.len());
                self.runs.push(Run {
                    job,
                    number,
                    records: Vec::new(),
                });
            }
        }
    }
}

/// Refuses what does not begin as a part does; of a file that ends before, what there is.
fn check_magic(path: &Path, bytes: &[u8]) -> Result<(), PartError> {
    let there = bytes.len().min(MAGIC.len());
    if bytes[..there] == MAGIC[..there] {
        return Ok(());
    }
    let is_named = there == MAGIC.len() && bytes[..NAMED] == MAGIC[..NAMED];
    Err(PartError::refused(
        path,
        if is_named {
            "it is a part of another version of the format: merge it with the program that wrote it"
        } else {
            "this is no part of a run: its first bytes are others"
        },
    ))
}

fn json<T: DeserializeOwned>(path: &Path, payload: &[u8]) -> Result<T, PartError> {
    serde_json::from_slice(payload).map_err(|error| {
        PartError::refused(
            path,
            format_args!("it was written by another version of the program, which this one does not read: {error}"),
        )
    })
}
