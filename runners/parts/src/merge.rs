//! Parts merged in batch order, whatever order they come in: the bits of one run.

use core::ops::Range;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use fredholm::answer::{Answer, Of};
use fredholm::{Goal, Model};
use fredholm_core::{Batch, RunOptions, Schedule, Statistics, StopReason, Tail, Tolerance};
use fredholm_rayon::{Outcome, stop};

use crate::content::{Content, Record, Seconds};
use crate::error::PartError;
use crate::identity::{Header, JobRecord};
use crate::share::Share;

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
    /// Parts that are not there as a whole.
    pub behind: Vec<Behind>,
    /// Seconds of all parts together.
    pub seconds: Seconds,
    /// The number of parts.
    pub parts: usize,
}

/// A part of which batches are missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Behind {
    /// Which part it is.
    pub share: Share,
    /// The file, if there is one.
    pub path: Option<PathBuf>,
}

/// What is known of a file before its batches are merged.
struct Part {
    path: PathBuf,
    share: Option<Share>,
    first: u64,
}

/// Merges parts of one run, in any order, and each as often as it comes. Only one file is in memory at a time, and batches
/// that wait for others before them.
///
/// # Errors
/// [`PartError`]: a file is no part, is damaged, or belongs to other walks than the first one.
pub fn merge(paths: &[PathBuf], tolerance: Option<Tolerance>) -> Result<Merged, PartError> {
    let Surveyed {
        header,
        job,
        mut parts,
        seconds,
    } = survey(paths)?;
    parts.sort_by_key(|part| part.first);
    let tolerance = tolerance.or(job.settings.tolerance);
    let mut fold = Fold::new(&parts, job, tolerance)?;
    for part in &parts {
        let content = read(&part.path)?;
        let run = content.as_ref().and_then(|content| content.runs.last());
        for record in run.iter().flat_map(|run| &run.records) {
            fold.add(&part.path, record)?;
        }
    }
    Ok(fold.finish(header, &parts, tolerance, seconds))
}

/// What all parts have in common, and where each of them begins.
struct Surveyed {
    header: Header,
    job: JobRecord,
    parts: Vec<Part>,
    seconds: Seconds,
}

/// Looks at all parts, and refuses those that are of other walks than the first.
fn survey(paths: &[PathBuf]) -> Result<Surveyed, PartError> {
    let first = paths.first().map_or(Path::new("no part"), PathBuf::as_path);
    let mut all: Option<(Header, Option<JobRecord>)> = None;
    let mut parts = Vec::new();
    let mut seconds = Seconds::default();
    for path in paths {
        // What was begun only has nothing to merge.
        let Some(mut content) = read(path)? else {
            continue;
        };
        seconds.set_up += content.seconds.set_up;
        seconds.walks += content.seconds.walks;
        let run = content.runs.pop();
        let batches = run.iter().flat_map(|run| &run.records);
        parts.push(Part {
            path: path.clone(),
            share: content.share,
            first: batches.map(|record| record.batch).min().unwrap_or(u64::MAX),
        });
        let job = run.map(|run| run.job);
        match &mut all {
            None => all = Some((content.header, job)),
            Some((header, known)) => {
                refuse_other(path, first, header.difference(&content.header))?;
                join(path, first, known, job)?;
            }
        }
    }
    match all {
        Some((header, Some(job))) => Ok(Surveyed {
            header,
            job,
            parts,
            seconds,
        }),
        _ => Err(PartError::refused(
            first,
            "no part has begun to walk: give their commands again",
        )),
    }
}

/// Joins the job of a part with that of those before, the larger number of walks of both.
fn join(
    path: &Path,
    first: &Path,
    known: &mut Option<JobRecord>,
    job: Option<JobRecord>,
) -> Result<(), PartError> {
    match (known, job) {
        (Some(known), Some(job)) => {
            refuse_other(path, first, known.difference(&job))?;
            if job.walks() > known.walks() {
                *known = job;
            }
        }
        (known, job) => *known = known.take().or(job),
    }
    Ok(())
}

/// The content of a part; `None`: not even its beginning was written.
fn read(path: &Path) -> Result<Option<Content>, PartError> {
    let bytes = fs::read(path)
        .map_err(|error| PartError::refused(path, format_args!("cannot read it: {error}")))?;
    Content::begun(path, &bytes)
}

fn refuse_other(path: &Path, first: &Path, what: Option<String>) -> Result<(), PartError> {
    what.map_or(Ok(()), |what| {
        let first = first.display();
        let message = format!("it is a part of other walks than {first}: {what} (here: {first})");
        Err(PartError::refused(path, message))
    })
}

/// One goal, merged up to its first gap.
struct Front {
    statistics: Statistics,
    tail: Tail,
    /// The batch that comes next.
    next: u64,
    schedule: Schedule,
    stop: Option<StopReason>,
}

/// Batches on their way into the fronts of all goals.
struct Fold {
    job: JobRecord,
    options: RunOptions,
    fronts: Vec<Front>,
    waiting: BTreeMap<(usize, u64), Statistics>,
}

impl Fold {
    fn new(
        parts: &[Part],
        job: JobRecord,
        tolerance: Option<Tolerance>,
    ) -> Result<Self, PartError> {
        let mut options = RunOptions::new(job.walks());
        options.batch = job.settings.walk_options().batch;
        options.tolerance = tolerance;
        let schedule = Schedule::new(options).map_err(|error| {
            let path = parts.first().map_or(Path::new(""), |part| &part.path);
            PartError::refused(path, error)
        })?;
        let front = || Front {
            statistics: Statistics::default(),
            tail: Tail::default(),
            next: 0,
            schedule,
            stop: None,
        };
        Ok(Self {
            options,
            fronts: (0..job.set_up.goals).map(|_| front()).collect(),
            job,
            waiting: BTreeMap::new(),
        })
    }

    /// Adds a batch, and all that waited for it.
    fn add(&mut self, path: &Path, record: &Record) -> Result<(), PartError> {
        let Record {
            goal,
            batch,
            statistics,
            ..
        } = *record;
        let goal = goal as usize;
        let RunOptions {
            walks, batch: size, ..
        } = self.options;
        let Some(filled) = Batch::resume(batch, size, walks, statistics) else {
            return Err(PartError::refused(
                path,
                format_args!(
                    "batch {batch} has {} walks, more than it can have",
                    statistics.walks()
                ),
            ));
        };
        let Some(front) = self.fronts.get(goal) else {
            return Err(PartError::refused(
                path,
                format_args!("there is no goal {goal}"),
            ));
        };
        // The last batch of a run may be short, and is whole in a longer one.
        if !filled.is_done() || statistics.walks() == 0 || batch < front.next {
            return Ok(());
        }
        match self.waiting.insert((goal, batch), statistics) {
            Some(before) if before.to_bytes() != statistics.to_bytes() => {
                return Err(PartError::refused(
                    path,
                    format_args!(
                        "batch {batch} of goal {goal} has another result than in a file before: the programs that made \
                         them differ"
                    ),
                ));
            }
            _ => {}
        }
        let shared = self.job.set_up.shared.max(1);
        let first = goal - goal % shared;
        self.merge_next(first..(first + shared).min(self.fronts.len()));
        Ok(())
    }

    /// Merges the next batches of goals that share their walks while all of these have them.
    fn merge_next(&mut self, sharing: Range<usize>) {
        let (set_up, scalar) = (&self.job.set_up, self.job.settings.scalar);
        let Some(fronts) = self.fronts.get_mut(sharing.clone()) else {
            return;
        };
        while let Some(next) = fronts.first().map(|front| front.next)
            && sharing
                .clone()
                .all(|goal| self.waiting.contains_key(&(goal, next)))
        {
            let goals = sharing.clone().zip(&mut *fronts);
            let reasons = goals.map(|(goal, front)| {
                let batch = self.waiting.remove(&(goal, next)).unwrap_or_default();
                front.merge(&batch, |statistics| set_up.floor(scalar, statistics))
            });
            // They stop with the last of them, and no one before.
            let reasons: Vec<Option<StopReason>> = reasons.collect();
            if reasons.iter().all(Option::is_some) {
                for (front, reason) in fronts.iter_mut().zip(reasons) {
                    front.stop = front.stop.or(reason);
                }
            } else {
                fronts.iter_mut().for_each(Front::go_on);
            }
        }
    }

    /// The batches that a goal needs and nobody has.
    fn gaps(&self, goal: usize, front: &Front) -> Vec<Range<u64>> {
        let end = self.options.batches();
        let mut gaps = Vec::new();
        let mut next = front.next;
        for &(_, batch) in self
            .waiting
            .range((goal, next)..(goal, end))
            .map(|(key, _)| key)
        {
            if batch > next {
                gaps.push(next..batch);
            }
            next = batch + 1;
        }
        if next < end {
            gaps.push(next..end);
        }
        gaps
    }

    /// The batches that some goal needs and nobody has, in order.
    fn missing(&self) -> Vec<Range<u64>> {
        let open = self
            .fronts
            .iter()
            .enumerate()
            .filter(|(_, front)| front.stop.is_none());
        let mut gaps: Vec<_> = open
            .flat_map(|(goal, front)| self.gaps(goal, front))
            .collect();
        gaps.sort_unstable_by_key(|gap| gap.start);
        let mut missing: Vec<Range<u64>> = Vec::new();
        for gap in gaps {
            match missing.last_mut() {
                Some(last) if gap.start <= last.end => last.end = last.end.max(gap.end),
                _ => missing.push(gap),
            }
        }
        missing
    }

    fn finish(
        self,
        header: Header,
        parts: &[Part],
        tolerance: Option<Tolerance>,
        seconds: Seconds,
    ) -> Merged {
        let missing = self.missing();
        let reasons = self.fronts.iter().map(|front| front.stop);
        let stop = reasons
            .map(|stop| stop.unwrap_or(StopReason::Cancelled))
            .max();
        Merged {
            header,
            behind: behind(parts, &missing, &self.options),
            missing,
            outcome: Outcome {
                statistics: self.fronts.iter().map(|front| front.statistics).collect(),
                tails: self.fronts.iter().map(|front| front.tail).collect(),
                stop: stop.unwrap_or(StopReason::Done),
            },
            job: self.job,
            tolerance,
            seconds,
            parts: parts.len(),
        }
    }
}

/// The shares, of the kinds that there are, which have some of the missing batches.
fn behind(parts: &[Part], missing: &[Range<u64>], options: &RunOptions) -> Vec<Behind> {
    let mut kinds: Vec<(u64, u64)> = Vec::new();
    for share in parts.iter().filter_map(|part| part.share) {
        if !kinds.contains(&(share.of, share.after)) {
            kinds.push((share.of, share.after));
        }
    }
    let all = kinds
        .iter()
        .flat_map(|&(of, after)| (1..=of).map(move |part| Share { part, of, after }));
    let lacks = |share: &Share| {
        let Range { start, end } = share.batches(options);
        missing.iter().any(|gap| gap.start < end && start < gap.end)
    };
    let path = |share: &Share| {
        let found = parts.iter().find(|part| part.share == Some(*share));
        found.map(|part| part.path.clone())
    };
    let behind = |share: Share| Behind {
        path: path(&share),
        share,
    };
    all.filter(lacks).map(behind).collect()
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
            let of_walks = tolerance.error(statistics).powi(2) - statistics.control_error().powi(2);
            deviation.powi(2) / of_walks.max(0.0)
        });
        let most = MORE * needed.fold(0.0, f64::max);
        let batch = self.job.settings.batch();
        (most < MOST).then(|| {
            (most as u64)
                .max(self.job.walks() + batch)
                .next_multiple_of(batch)
        })
    }
}

/// How many times as many walks as are told to be enough are proposed: the deviation is an estimate, too.
const MORE: f64 = 1.1;
/// More walks than anybody runs.
const MOST: f64 = 1e17;

impl Front {
    /// Merges the next batch, unless the goal has stopped before it, and says why it would stop now.
    fn merge(
        &mut self,
        batch: &Statistics,
        floor: impl Fn(&Statistics) -> f64,
    ) -> Option<StopReason> {
        self.next += 1;
        if self.stop.is_some() {
            return self.stop;
        }
        self.statistics.merge(batch);
        self.tail.add(batch);
        self.schedule.end_batch();
        if !self.schedule.stage().is_empty() {
            return None;
        }
        let floor = floor(&self.statistics);
        stop(&self.schedule, &self.statistics, &self.tail, Some(floor))
    }

    /// Begins the next stage, if this one is over and the goal has not stopped.
    fn go_on(&mut self) {
        if self.stop.is_none() && self.schedule.stage().is_empty() {
            self.schedule.begin_stage();
        }
    }
}
