//! Walks whose batches are kept in a file, of a whole run or of a part.

use core::time::Duration;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use fredholm::execute::{Execute, Walking};
use fredholm::{Error, Observer};
use fredholm_core::{Statistics, Tolerance};
use fredholm_rayon::{BatchStore, Crew, Outcome, Runner, Threads};

use super::error::FileError;
use super::identity::{Header, JobRecord, digest};
use super::output::Output;
use super::part::{Part, Run, Seconds};
use super::share::Share;

/// The option of the file.
const OPTION: &str = "--save";
/// The least time between two writes.
const PAUSE: Duration = Duration::from_millis(50);
/// How many times as long as a write took walks go on before the next one.
const RATIO: u32 = 20;

/// Runs walks, all or a share of them, and keeps every batch that is done in a file, if there is one; batches that are there
/// already are not run again. So a run that was killed goes on, and ends with the bits of one that never was.
///
/// The file is written as a whole, under another name which then becomes its own: twenty times a second, or more seldom if that
/// takes more than a twentieth of the time. A lock of the operating system keeps others from it.
pub struct Keeper<'a> {
    header: Header,
    share: Option<Share>,
    crew: &'a dyn Crew,
    file: Option<Mutex<PartFile>>,
}

impl core::fmt::Debug for Keeper<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Keeper")
            .field("share", &self.share)
            .field("file", &self.file)
            .finish_non_exhaustive()
    }
}

impl<'a> Keeper<'a> {
    /// A keeper that goes on with a file, or begins it. Without a file it keeps nothing: for a process whose batches another one
    /// keeps.
    ///
    /// # Errors
    /// [`FileError`]: another process holds the file, it is of another problem or share, is no part, or cannot be written.
    pub fn open(
        path: Option<&Path>,
        header: &Header,
        share: Option<Share>,
    ) -> Result<Self, FileError> {
        let file = path.map(|path| PartFile::open(path, header, share));
        Ok(Self {
            header: header.clone(),
            share,
            crew: &Threads,
            file: file.transpose()?.map(Mutex::new),
        })
    }

    /// This keeper with another crew in place of the threads of the current rayon pool.
    #[must_use]
    pub fn with_crew(self, crew: &'a dyn Crew) -> Self {
        Self { crew, ..self }
    }
}

impl Execute for Keeper<'_> {
    fn run(&self, walking: &Walking<'_>, watch: &dyn Observer) -> Result<Outcome, Error> {
        let start = Instant::now();
        let job = JobRecord::new(walking);
        let kept = match &self.file {
            Some(file) => Some(KeptRun {
                number: locked(file).begin(&job)?,
                file,
            }),
            None => None,
        };
        let all = [&self.header.problem[..], &job.named()].concat();
        let agreed = self.crew.agree(digest(&all));
        agreed.map_err(|message| Error::Kept {
            message,
            is_input: false,
        })?;
        let runner = Runner {
            crew: self.crew,
            store: kept.as_ref().map_or(&(), |kept| kept as &dyn BatchStore),
            ..walking.runner()
        };
        let outcome = match self.share {
            None => runner.run(walking.job, watch)?,
            Some(share) => {
                let batches = share.batches(&runner.options);
                runner.run_batches(walking.job, batches, watch)?
            }
        };
        if let Some(file) = &self.file {
            locked(file).end(Seconds {
                set_up: walking.set_up.seconds,
                walks: start.elapsed().as_secs_f64(),
            })?;
        }
        Ok(outcome)
    }

    fn goes_on_with(&self) -> Option<u64> {
        let kept = self.file.as_ref().and_then(|file| {
            let file = locked(file);
            file.part.runs.first()?.job.choice.as_ref()?.walks
        });
        let after = self.share.map(|share| share.after);
        kept.or(after.filter(|after| *after > 0))
    }

    fn tells_all(&self) -> bool {
        self.share.is_none()
    }

    /// A part walks on whatever error it reaches: only merged parts tell which is reached.
    fn tolerance(&self, asked: Option<Tolerance>) -> Option<Tolerance> {
        asked.filter(|_| self.share.is_none())
    }
}

/// What a lock guards: a thread that panicked has ended the walks already.
fn locked(file: &Mutex<PartFile>) -> MutexGuard<'_, PartFile> {
    file.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The batches of one run.
struct KeptRun<'a> {
    file: &'a Mutex<PartFile>,
    number: usize,
}

impl BatchStore for KeptRun<'_> {
    fn known(&self, goal: usize, batch: u64) -> Option<Statistics> {
        let file = locked(self.file);
        let run = file.part.runs.get(self.number)?;
        run.batches.get(&(batch, goal as u64)).copied()
    }

    fn keep(&self, goal: usize, batch: u64, statistics: &Statistics) {
        let mut file = locked(self.file);
        if let Some(run) = file.part.runs.get_mut(self.number) {
            run.batches.insert((batch, goal as u64), *statistics);
        }
        if file.failure.is_none() && file.written.elapsed() >= file.pause {
            file.failure = file.write().err();
        }
    }

    fn is_broken(&self) -> bool {
        locked(self.file).failure.is_some()
    }
}

/// A file that this process holds, and nobody else.
#[derive(Debug)]
struct PartFile {
    path: PathBuf,
    part: Part,
    /// How many runs have begun.
    begun: usize,
    /// The file, which is locked.
    _held: File,
    written: Instant,
    pause: Duration,
    failure: Option<FileError>,
}

impl PartFile {
    fn open(path: &Path, header: &Header, share: Option<Share>) -> Result<Self, FileError> {
        let cannot = |error: io::Error| FileError::not_opened(path, error);
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let mut held = options.open(path).map_err(cannot)?;
        held.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => FileError::refused(
                path,
                "another process is writing it: wait for that one, or give another file",
            ),
            TryLockError::Error(error) => cannot(error),
        })?;
        let mut bytes = Vec::new();
        held.read_to_end(&mut bytes).map_err(cannot)?;
        let part = if bytes.is_empty() {
            Part::new(header.clone(), share)
        } else {
            let part = Part::read(path, &bytes)?;
            check(path, &part, header, share)?;
            part
        };
        let mut file = Self {
            path: path.to_owned(),
            part,
            begun: 0,
            _held: held,
            written: Instant::now(),
            pause: PAUSE,
            failure: None,
        };
        file.write()?;
        Ok(file)
    }

    /// The number of a run, which is the next one of the file, or new.
    fn begin(&mut self, job: &JobRecord) -> Result<usize, Error> {
        let number = self.begun;
        self.begun += 1;
        let Some(run) = self.part.runs.get_mut(number) else {
            self.part.runs.push(Run {
                job: job.clone(),
                batches: Default::default(),
            });
            return Ok(number);
        };
        if let Some(what) = job.difference(&run.job) {
            let message = format!("it has other walks: {what}; give another file to `{OPTION}`");
            return Err(FileError::refused(&self.path, message).into());
        }
        if job.walks() > run.job.walks() {
            run.job = job.clone();
        }
        Ok(number)
    }

    fn end(&mut self, seconds: Seconds) -> Result<(), FileError> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        self.part.seconds.set_up += seconds.set_up;
        self.part.seconds.walks += seconds.walks;
        self.write()
    }

    /// Replaces the file by all that is known.
    fn write(&mut self) -> Result<(), FileError> {
        let start = Instant::now();
        let output = Output::open(OPTION, &self.path)?;
        let held = output.locked().finish_with(|to| self.part.write(to));
        self._held = held.map_err(|error| FileError {
            message: format!(
                "{}; it keeps what it had before: make room, and give the same command again",
                error.message
            ),
            ..error
        })?;
        self.written = Instant::now();
        self.pause = PAUSE.max(RATIO * start.elapsed());
        Ok(())
    }
}

/// Refuses a file of another problem or share.
fn check(path: &Path, part: &Part, header: &Header, share: Option<Share>) -> Result<(), FileError> {
    let message = if let Some(what) = header.difference(&part.header) {
        format!("it is of another problem: {what}")
    } else if part.share != share {
        let name = |share: Option<Share>| match share {
            None => "a whole run".to_owned(),
            Some(share) if share.after > 0 => format!("part {share} behind {} walks", share.after),
            Some(share) => format!("part {share}"),
        };
        format!("it is {}, and not {}", name(part.share), name(share))
    } else {
        return Ok(());
    };
    let message = format!("{message}; give another file to `{OPTION}`");
    Err(FileError::refused(path, message))
}
