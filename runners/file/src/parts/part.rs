//! The content of a part of a run.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use fredholm_core::Statistics;
use serde::{Deserialize, Serialize};

use super::container::Kind;
use super::error::FileError;
use super::identity::{Header, JobRecord};
use super::share::Share;

pub(crate) const KIND: Kind = Kind {
    magic: b"fredholm part 2        \n",
    named: 14,
    name: "part of a run",
    help: "make it again",
};

/// The most goals of a job besides those that were asked for: surfaces of a room.
const MOST_OTHERS: usize = 1 << 20;

/// The statistics of all walks of a batch of a goal, by the numbers of both, from 0.
pub type Batches = BTreeMap<(u64, u64), Statistics>;

/// Seconds that a part took, as far as it told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Seconds of the set-up.
    pub set_up: f64,
    /// Seconds of the walks.
    pub walks: f64,
}

/// Walks of one job: of settings that were given or chosen.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Run {
    /// The job, with the largest number of walks that it was asked for.
    pub job: JobRecord,
    /// The batches that are done.
    #[serde(skip)]
    pub batches: Batches,
}

/// The content of a file: a problem, and the batches of its runs. The last run is the one that counts: others were given up
/// for it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Part {
    /// The problem.
    pub header: Header,
    /// Which batches it has, if it is not a whole run.
    pub share: Option<Share>,
    /// The runs.
    pub runs: Vec<Run>,
    /// Seconds.
    pub seconds: Seconds,
}

impl Part {
    /// A part without any walks.
    #[must_use]
    pub fn new(header: Header, share: Option<Share>) -> Self {
        Self {
            header,
            share,
            runs: Vec::new(),
            seconds: Seconds::default(),
        }
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// [`FileError`]: it is no part, of another version, cut off or damaged.
    pub fn read(path: &Path, bytes: &[u8]) -> Result<Self, FileError> {
        let contradiction =
            || FileError::refused(path, "its batches contradict each other: make it again");
        let (mut part, body) = KIND.read::<Self>(path, bytes)?;
        let batches: Vec<Batches> =
            postcard::from_bytes(&bytes[body]).map_err(|_| contradiction())?;
        if batches.len() != part.runs.len() {
            return Err(contradiction());
        }
        for (run, batches) in part.runs.iter_mut().zip(batches) {
            run.batches = batches;
            if !run.is_possible() {
                return Err(contradiction());
            }
        }
        Ok(part)
    }

    /// Writes what [`read`](Self::read) reads.
    ///
    /// # Errors
    /// Of the writer.
    pub fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        let batches: Vec<&Batches> = self.runs.iter().map(|run| &run.batches).collect();
        let body = postcard::to_allocvec(&batches).map_err(io::Error::other)?;
        KIND.write(self, &[&body], to)
    }
}

impl Run {
    fn is_possible(&self) -> bool {
        let set_up = &self.job.set_up;
        let others = set_up.own_goals().checked_sub(set_up.galerkin.len());
        let mut batches = self.batches.iter();
        others.is_some_and(|others| others <= MOST_OTHERS)
            && batches.all(|((_, goal), statistics)| {
                let bytes = statistics.to_bytes();
                *goal < set_up.goals as u64 && Statistics::from_bytes(&bytes).is_some()
            })
    }
}
