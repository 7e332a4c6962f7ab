//! Parts merged in batch order, whatever order they come in: the bits of one run.

use core::ops::Range;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use fredholm::answer::{Answer, Of};
use fredholm::{Goal, Model, Observer};
use fredholm_core::{Batch, Job, NotFinite, RunOptions, Statistics, StopReason, Tolerance};
use fredholm_rayon::{BatchStore, Crew, Finished, Outcome, Piece, Runner, Work};

use super::error::FileError;
use super::identity::{Header, JobRecord};
use super::part::{Batches, Part, Seconds};
use super::share::Share;

/// The most gaps and parts that are named.
const NAMED: usize = 20;
/// How many times as many walks as are told to be enough are proposed: the deviation is an estimate, too.
const MORE: f64 = 1.1;
/// More walks than anybody runs.
const MOST: f64 = 1e17;

/// Parts, merged as far as they go without a gap.
#[derive(Clone, Debug)]
pub struct Merged {
    /// The problem.
    pub header: Header,
    /// The walks, with the largest number that a part was asked for.
    pub job: JobRecord,
    /// The statistics of every goal, over its walks 0, 1, 2, … up to the first gap or the tolerance, and why they ended:
    /// cancelled, if batches are missing.
    pub outcome: Outcome,
    /// The tolerance that was looked at.
    pub tolerance: Option<Tolerance>,
    /// The batches that some goal needs and no part has.
    pub missing: Vec<Range<u64>>,
    /// The parts that should have had some of these, as far as other parts tell.
    pub behind: Vec<Share>,
    /// Seconds of all parts together.
    pub seconds: Seconds,
}

/// Merges parts of one run, in any order, and each as often as it comes.
///
/// # Errors
/// [`FileError`]: a file is no part, is damaged, or belongs to other walks than the first one.
pub fn merge(paths: &[PathBuf], tolerance: Option<Tolerance>) -> Result<Merged, FileError> {
    let first = paths.first().map_or(Path::new("no part"), PathBuf::as_path);
    let mut known: Option<(Header, JobRecord)> = None;
    let mut batches = Batches::new();
    let mut shares = BTreeSet::new();
    let mut seconds = Seconds::default();
    for path in paths {
        let bytes = fs::read(path).map_err(|error| FileError::not_opened(path, error))?;
        let mut part = Part::read(path, &bytes)?;
        // What was begun only has nothing to merge.
        let Some(run) = part.runs.pop() else {
            continue;
        };
        match &mut known {
            None => known = Some((part.header, run.job)),
            Some((header, job)) => {
                let what = header.difference(&part.header);
                if let Some(what) = what.or_else(|| job.difference(&run.job)) {
                    let first = first.display();
                    let message =
                        format!("it is a part of other walks than {first}: {what} (here: {first})");
                    return Err(FileError::refused(path, message));
                }
                if run.job.walks() > job.walks() {
                    *job = run.job;
                }
            }
        }
        add(path, &mut batches, run.batches)?;
        shares.extend(part.share);
        seconds.set_up += part.seconds.set_up;
        seconds.walks += part.seconds.walks;
    }
    let Some((header, job)) = known else {
        let message = "no part has begun to walk: give their commands again";
        return Err(FileError::refused(first, message));
    };
    let tolerance = match tolerance {
        None => job.settings.tolerance,
        asked => crate::read(&header.name, &header.text)
            .and_then(|file| file.tolerance(asked))
            .map_err(|error| FileError::refused(first, error))?,
    };
    let mut options = RunOptions::new(job.walks());
    options.batch = job.settings.batch();
    options.tolerance = tolerance;
    let kept = Kept {
        job: &job,
        batches: &batches,
        active: Mutex::default(),
    };
    let runner = Runner {
        crew: &kept,
        store: &kept,
        ..Runner::new(options)
    };
    let outcome = runner.run(&kept, &kept);
    let outcome = outcome.map_err(|error| FileError::refused(first, error))?;
    let missing = match outcome.stop {
        StopReason::Cancelled => kept.missing(options.batches()),
        _ => Vec::new(),
    };
    Ok(Merged {
        behind: behind(&shares, &missing, &options),
        header,
        outcome,
        tolerance,
        missing,
        seconds,
        job,
    })
}

/// Adds the batches of a file to those before. The last batch of a run may be short, and is whole in a longer one.
fn add(path: &Path, all: &mut Batches, more: Batches) -> Result<(), FileError> {
    for (key, statistics) in more {
        let known = all.entry(key).or_insert(statistics);
        if known.walks() < statistics.walks() {
            *known = statistics;
        } else if known.walks() == statistics.walks() && *known != statistics {
            let (batch, goal) = key;
            let message = format!(
                "batch {batch} of goal {goal} has another result than in a file before: the programs that made them differ"
            );
            return Err(FileError::refused(path, message));
        }
    }
    Ok(())
}

/// Walks that are all known, or not there: a runner merges them without running any.
struct Kept<'a> {
    job: &'a JobRecord,
    batches: &'a Batches,
    /// The goals of the last stage.
    active: Mutex<BTreeSet<usize>>,
}

impl Kept<'_> {
    /// The batches up to this one that a goal lacks which has not stopped.
    fn missing(&self, end: u64) -> Vec<Range<u64>> {
        let active = self.active.lock().unwrap_or_else(PoisonError::into_inner);
        let has = |goal: usize, batch: u64| self.batches.contains_key(&(batch, goal as u64));
        let mut missing: Vec<Range<u64>> = Vec::new();
        for batch in (0..end).filter(|&batch| !active.iter().all(|&goal| has(goal, batch))) {
            match missing.last_mut() {
                Some(last) if last.end == batch => last.end += 1,
                _ => missing.push(batch..batch + 1),
            }
        }
        missing
    }
}

impl Job for Kept<'_> {
    fn goals(&self) -> usize {
        self.job.set_up.goals
    }

    fn shared(&self) -> usize {
        self.job.set_up.shared.max(1)
    }

    fn decisive(&self) -> usize {
        self.shared() / (1 + self.job.set_up.quantities)
    }

    fn run(&self, _: usize, _: &mut [Batch], _: u64) -> Result<(), NotFinite> {
        Ok(())
    }
}

impl BatchStore for Kept<'_> {
    fn known(&self, goal: usize, batch: u64) -> Option<Statistics> {
        self.batches.get(&(batch, goal as u64)).copied()
    }
}

impl Crew for Kept<'_> {
    fn stage(&self, known: Vec<Finished>, work: &Work<'_>) -> Vec<Finished> {
        let open = work.pieces.iter().copied();
        let pieces = known.iter().map(|finished| finished.piece).chain(open);
        let goals = pieces.map(|Piece { goal, .. }| goal).collect();
        *self.active.lock().unwrap_or_else(PoisonError::into_inner) = goals;
        known
    }
}

impl Observer for Kept<'_> {
    fn rounding_floor(&self, statistics: &Statistics) -> Option<f64> {
        let scalar = self.job.settings.scalar;
        Some(self.job.set_up.floor(scalar, statistics))
    }
}

/// The shares, of the kinds that there are, which have some of the missing batches.
fn behind(shares: &BTreeSet<Share>, missing: &[Range<u64>], options: &RunOptions) -> Vec<Share> {
    // One of each number of parts and of walks before them.
    let kinds: BTreeMap<_, _> = shares.iter().map(|s| ((s.of, s.after), *s)).collect();
    let all = kinds
        .into_values()
        .flat_map(|share| (1..=share.of).map(move |part| Share { part, ..share }));
    let lacks = |share: &Share| {
        let Range { start, end } = share.batches(options);
        missing.iter().any(|gap| gap.start < end && start < gap.end)
    };
    all.filter(lacks).take(NAMED).collect()
}

impl Merged {
    /// The answer of the merged walks, as of a run that nobody divided.
    #[must_use]
    pub fn answer(&self, model: &dyn Model, goals: &[Goal]) -> Answer {
        let of = Of {
            model,
            goals,
            scalar: self.job.settings.scalar,
            tolerance: self.tolerance,
        };
        let mut set_up = self.job.set_up.clone();
        set_up.seconds = self.seconds.set_up;
        if self.job.plain {
            set_up.galerkin.fill(f64::NAN);
        }
        Answer::new(&of, &set_up, self.outcome.clone(), self.seconds.walks)
    }

    /// The batches that are missing, and the parts that should have them, in words; `None`: none is missing.
    #[must_use]
    pub fn missing_text(&self) -> Option<String> {
        if self.missing.is_empty() {
            return None;
        }
        let one = |range: &Range<u64>| match range.end - range.start {
            1 => format!("{}", range.start + 1),
            _ => format!("{} to {}", range.start + 1, range.end),
        };
        let mut missing: Vec<String> = self.missing.iter().take(NAMED).map(one).collect();
        if self.missing.len() > NAMED {
            missing.push("…".to_owned());
        }
        let missing = missing.join(", ");
        let all = self.job.walks().div_ceil(self.job.settings.batch().max(1));
        let parts: Vec<String> = self.behind.iter().map(Share::to_string).collect();
        let parts = match parts.is_empty() {
            true => String::new(),
            false => format!(", of parts {}", parts.join(", ")),
        };
        Some(format!("batches {missing} of {all} are missing{parts}"))
    }

    /// The number of walks of each goal that its tolerance takes by the deviation so far, and a tenth more; `None`: there
    /// is no tolerance, or it is reached, or no number is enough.
    #[must_use]
    pub fn needed(&self) -> Option<u64> {
        let tolerance = self
            .tolerance
            .filter(|_| self.outcome.stop != StopReason::Done)?;
        let asked = self.outcome.statistics.iter();
        let needed = asked.map(|statistics| {
            let deviation = statistics.preconditioned().std_dev.unwrap_or(f64::INFINITY);
            let of_walks = tolerance.error(statistics).powi(2);
            deviation.powi(2) / of_walks
        });
        let most = MORE * needed.fold(0.0, f64::max);
        let batch = self.job.settings.batch();
        let least = self.job.walks() + batch;
        (most < MOST).then(|| (most as u64).max(least).next_multiple_of(batch))
    }
}
