//! Walks whose batches are kept in a file, of a whole run or of a part.

use core::sync::atomic::{AtomicBool, Ordering};
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use fredholm::execute::{Execute, Walking};
use fredholm::{Error, Observer};
use fredholm_core::{Statistics, Tolerance};
use fredholm_rayon::{BatchStore, Crew, Outcome, Runner, Tail, Threads};

use crate::content::{Record, Run, Seconds};
use crate::error::PartError;
use crate::file::PartFile;
use crate::identity::{Header, JobRecord};
use crate::share::Share;

/// Runs walks and keeps every batch in a file that is done; batches that are there already are not run again. So a run that
/// was killed goes on, and ends with the bits of one that never was.
///
/// ```
/// use fredholm::{CubeModel, Solver};
/// use fredholm_parts::{Header, Keeper};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let problem = vec![("problem".to_owned(), "½ x y, x".to_owned())];
/// let header = Header::new(problem, String::new(), String::new(), String::new());
/// let path = std::env::temp_dir().join(format!("fredholm-doc-{}.part", std::process::id()));
/// let solve = |walks| {
///     let keeper = Keeper::open(&path, &header, None).unwrap();
///     Solver::new(&u).mean().cells(4).walks(walks).execute(&keeper).solve().unwrap()
/// };
/// solve(10_000);
/// // Two of five batches are there.
/// let report = solve(20_000);
/// let alone = Solver::new(&u).mean().cells(4).walks(20_000).solve().unwrap();
/// assert_eq!(report.goals[0].preconditioned, alone.goals[0].preconditioned);
/// # std::fs::remove_file(&path).unwrap();
/// ```
pub struct Keeper<'a> {
    file: PartFile,
    share: Option<Share>,
    crew: &'a dyn Crew,
    /// The runs that the file has, and how many of them were met.
    known: Mutex<(Vec<Run>, usize)>,
}

impl core::fmt::Debug for Keeper<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Keeper")
            .field("file", &self.file)
            .field("share", &self.share)
            .finish_non_exhaustive()
    }
}

impl<'a> Keeper<'a> {
    /// A keeper that goes on with a file, or begins it. With a share, only the batches of that are run.
    ///
    /// # Errors
    /// [`PartError`]: see [`PartFile::open`].
    pub fn open(path: &Path, header: &Header, share: Option<Share>) -> Result<Self, PartError> {
        let (file, runs) = PartFile::open(path, header, share)?;
        Ok(Self {
            file,
            share,
            crew: &Threads,
            known: Mutex::new((runs, 0)),
        })
    }

    /// This keeper with another crew in place of the threads of the current rayon pool.
    #[must_use]
    pub fn with_crew(self, crew: &'a dyn Crew) -> Self {
        Self { crew, ..self }
    }

    /// The batches of a job that the file has, and the number of the job for others.
    fn begin(&self, job: &JobRecord) -> Result<Kept<'_>, Error> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let (runs, met) = &mut *known;
        let run = runs.get(*met);
        *met += 1;
        let (batches, number) = match run {
            None => (HashMap::new(), None),
            Some(run) => {
                if let Some(what) = job.difference(&run.job) {
                    return Err(Error::Kept {
                        message: format!(
                            "the file of `--save` has other walks: {what}; give another file"
                        ),
                        is_input: true,
                    });
                }
                let key = |record: &Record| (record.goal as usize, record.batch);
                let batches = run
                    .records
                    .iter()
                    .map(|record| (key(record), record.statistics));
                let is_asked = job.walks() <= run.job.walks();
                (batches.collect(), is_asked.then_some(run.number))
            }
        };
        let number = number.map_or_else(|| self.file.begin_job(job), Ok)?;
        Ok(Kept {
            file: &self.file,
            batches,
            job: number,
            failed: AtomicBool::new(false),
        })
    }
}

/// Whoever else has to agree before walks begin: gets whether they go on with what the file has.
pub type Ready<'a> = dyn Fn(Result<(), &Error>) -> Result<(), Error> + 'a;

impl Keeper<'_> {
    /// Runs the walks once it is known whether they go on with what the file has, and `ready` agrees.
    ///
    /// # Errors
    /// [`Error`], or what `ready` says.
    pub fn run_when(
        &self,
        walking: &Walking<'_>,
        watch: &dyn Observer,
        ready: &Ready<'_>,
    ) -> Result<Outcome, Error> {
        let start = Instant::now();
        let kept = self.begin(&JobRecord::new(walking));
        let is_ready = ready(kept.as_ref().map(|_| ()));
        let kept = kept?;
        is_ready?;
        let runner = Runner {
            crew: self.crew,
            store: &kept,
            ..walking.runner()
        };
        let watch = Ends {
            watch,
            failed: &kept.failed,
        };
        let outcome = match self.share {
            None => runner.run(walking.job, &watch)?,
            Some(share) => {
                let batches = share.batches(&runner.options);
                runner.run_batches(walking.job, batches, &watch)?
            }
        };
        if let Some(error) = self.file.failure() {
            return Err(error.into());
        }
        self.file.finish(Seconds {
            set_up: walking.set_up.seconds,
            walks: start.elapsed().as_secs_f64(),
        })?;
        Ok(outcome)
    }
}

impl Execute for Keeper<'_> {
    fn run(&self, walking: &Walking<'_>, watch: &dyn Observer) -> Result<Outcome, Error> {
        self.run_when(walking, watch, &|_| Ok(()))
    }

    /// A part walks on whatever error it reaches: only merged parts tell which is reached.
    fn tolerance(&self, asked: Option<Tolerance>) -> Option<Tolerance> {
        asked.filter(|_| self.share.is_none())
    }
}

/// The batches of one job.
struct Kept<'a> {
    file: &'a PartFile,
    batches: HashMap<(usize, u64), Statistics>,
    job: u32,
    failed: AtomicBool,
}

impl BatchStore for Kept<'_> {
    fn known(&self, goal: usize, batch: u64) -> Option<Statistics> {
        self.batches.get(&(goal, batch)).copied()
    }

    fn keep(&self, goal: usize, batch: u64, statistics: &Statistics) {
        self.file.append(&Record {
            job: self.job,
            goal: goal as u32,
            batch,
            statistics: *statistics,
        });
        if self.file.failure().is_some() {
            self.failed.store(true, Ordering::Relaxed);
        }
    }
}

/// An observer whose run ends if a batch cannot be kept.
struct Ends<'a> {
    watch: &'a dyn Observer,
    failed: &'a AtomicBool,
}

impl Observer for Ends<'_> {
    fn walked(&self, walks: u64) {
        self.watch.walked(walks);
    }

    fn merged(&self, statistics: &[Statistics]) {
        self.watch.merged(statistics);
    }

    fn merged_with_tails(&self, statistics: &[Statistics], tails: &[Tail]) {
        self.watch.merged_with_tails(statistics, tails);
    }

    fn rounding_floor(&self, statistics: &Statistics) -> Option<f64> {
        self.watch.rounding_floor(statistics)
    }

    fn cancelled(&self) -> bool {
        self.failed.load(Ordering::Relaxed) || self.watch.cancelled()
    }
}
