//! Functions that are called with blocks of points, though set-ups and walks ask for one value at a time.
//!
//! Where walks of a cube go does not depend on K or F. So a batch of walks is run to see which values it asks for, the
//! functions are called once with all of them, and the batch is run again with the values. What asks otherwise the second
//! time, as an adaptive rule does, is recorded again from there on. Set-ups keep what they found, so that one is rehearsed on
//! a copy of the equation. The values, and so the bits, are those of calls one by one.

use core::cell::RefCell;
use std::sync::Arc;

use fredholm::cost::{Cost, PointwisePairs};
use fredholm::model::{About, Examined, Prepared, Request, Then};
use fredholm::resolvent::{ResolventFound, ResolventQuestion};
use fredholm::{
    CubeModel, Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, System, WalkOptions,
};
use fredholm_core::{Batch, Job, NotFinite};
use fredholm_model::Deterministic;

use crate::functions::Caller;

/// Runs of one piece of work. An adaptive rule takes one for each of its levels; what takes more calls one by one.
const RUNS: usize = 32;

thread_local! {
    /// The tape of the work that this thread does.
    static TAPE: RefCell<Option<Tape>> = const { RefCell::new(None) };
}

/// The places at which a function is asked for values, in their order, and the values so far.
#[derive(Debug, Default)]
pub(crate) struct Track {
    dimension: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    values: Vec<f64>,
    /// The number of the next place in this run.
    next: usize,
    /// Whether what is not known is left to the one who asks. Otherwise it is 0, and recorded.
    is_known: bool,
}

impl Track {
    fn new(dimension: usize) -> Self {
        Self {
            dimension,
            ..Self::default()
        }
    }

    /// The value at (x, y), or 0 until it is known; `None`: somebody else must know it.
    fn value(&mut self, x: &[f64], y: &[f64]) -> Option<f64> {
        let at = self.next;
        if let Some(&value) = self.values.get(at) {
            let place = at * x.len()..(at + 1) * x.len();
            if self.x[place.clone()] == *x && (y.is_empty() || self.y[place] == *y) {
                self.next += 1;
                return Some(value);
            }
        }
        if self.is_known {
            return None;
        }
        // If the work asks otherwise than before, it does so from here on.
        if at < self.values.len() {
            self.values.truncate(at);
            self.x.truncate(at * x.len());
            self.y.truncate(at * y.len());
        }
        self.next += 1;
        self.x.extend_from_slice(x);
        self.y.extend_from_slice(y);
        Some(0.0)
    }

    /// The places without a value, if there are some.
    pub(crate) fn asked(&self) -> Option<[&[f64]; 2]> {
        let known = self.values.len() * self.dimension;
        let x = self.x.get(known..).filter(|x| !x.is_empty())?;
        Some([x, self.y.get(known..).unwrap_or_default()])
    }

    /// Adds the values of what was asked.
    pub(crate) fn fill(&mut self, values: &[f64]) {
        self.values.extend_from_slice(values);
    }
}

/// The values that a piece of work asks for.
#[derive(Debug)]
pub(crate) struct Tape {
    pub(crate) kernel: Track,
    pub(crate) source: Track,
}

impl Tape {
    fn new(dimension: usize) -> Self {
        Self {
            kernel: Track::new(dimension),
            source: Track::new(dimension),
        }
    }

    fn rewind(&mut self) {
        self.kernel.next = 0;
        self.source.next = 0;
    }

    /// The tape for the work itself, after rehearsals.
    fn known(mut self) -> Self {
        self.rewind();
        self.kernel.is_known = true;
        self.source.is_known = true;
        self
    }

    fn is_open(&self) -> bool {
        self.kernel.asked().is_some() || self.source.asked().is_some()
    }
}

/// Work with functions that are called in blocks.
#[derive(Debug)]
pub(crate) struct Blocks {
    caller: Arc<Caller>,
    /// The interval of every axis; none: [0, 1].
    domain: Vec<[f64; 2]>,
    /// One thread, on which set-ups ask in the same order every time.
    alone: rayon::ThreadPool,
}

impl Blocks {
    /// # Errors
    /// There are no threads.
    pub(crate) fn new(
        caller: Arc<Caller>,
        domain: Vec<[f64; 2]>,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        Ok(Self {
            caller,
            domain,
            alone,
        })
    }

    /// K(x, y) by the tape of this thread, if that has one.
    pub(crate) fn kernel(x: &[f64], y: &[f64]) -> Option<f64> {
        TAPE.with_borrow_mut(|tape| tape.as_mut()?.kernel.value(x, y))
    }

    /// F(x) by the tape of this thread, if that has one.
    pub(crate) fn source(x: &[f64]) -> Option<f64> {
        TAPE.with_borrow_mut(|tape| tape.as_mut()?.source.value(x, &[]))
    }

    /// The equation, of which nothing is known.
    fn fresh(&self) -> CubeModel {
        let model = self.caller.model();
        if self.domain.is_empty() {
            model
        } else {
            model.on(self.domain.clone())
        }
    }

    /// The tape with all that a piece of work asks for, which is done again and again until nothing is missing; and what it
    /// came to last.
    fn recorded<T>(&self, work: impl Fn() -> T) -> (Tape, Option<T>) {
        let mut tape = Tape::new(self.caller.dimension());
        for _ in 0..RUNS {
            tape.rewind();
            TAPE.set(Some(tape));
            let done = work();
            tape = TAPE
                .take()
                .unwrap_or_else(|| Tape::new(self.caller.dimension()));
            if !tape.is_open() {
                return (tape, Some(done));
            }
            self.caller.fill(&mut tape);
        }
        (tape, None)
    }

    /// Does a piece of work on this thread, which keeps nothing of what it finds.
    fn gather<T>(&self, work: impl Fn() -> T) -> T {
        let (_, done) = self.recorded(&work);
        done.unwrap_or_else(work)
    }

    /// Does a piece of a set-up, which may keep what it finds: it is rehearsed with these cells of another copy.
    fn set_up<T: Send>(
        &self,
        cut: &Discretisation,
        rehearsal: impl Fn(&dyn Partitioned<'_>) + Sync,
        work: impl FnOnce() -> T + Send,
    ) -> T {
        self.alone.install(|| {
            let (tape, _) = self.recorded(|| {
                // What cannot be cut is refused by the work itself.
                if let Ok(cells) = self.fresh().partition(cut) {
                    rehearsal(&*cells);
                }
            });
            TAPE.set(Some(tape.known()));
            let done = work();
            TAPE.set(None);
            done
        })
    }
}

/// A cube whose functions are called in blocks.
#[derive(Debug)]
pub(crate) struct BlockModel {
    model: CubeModel,
    blocks: Blocks,
}

impl BlockModel {
    pub(crate) fn new(blocks: Blocks) -> Self {
        Self {
            model: blocks.fresh(),
            blocks,
        }
    }
}

struct BlockCells<'m> {
    cells: Box<dyn Partitioned<'m> + 'm>,
    cut: Discretisation,
    blocks: &'m Blocks,
}

struct BlockSystem<'m> {
    system: Box<dyn System + 'm>,
    blocks: &'m Blocks,
}

struct BlockJob<'a> {
    job: &'a dyn Job,
    blocks: &'a Blocks,
}

impl Model for BlockModel {
    fn about(&self) -> About {
        self.model.about()
    }

    fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
        self.model.exact(region)
    }

    fn nystrom(&self) -> Result<Vec<Deterministic>, Error> {
        self.model.nystrom()
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        self.model.check_goals(goals)
    }

    /// On one thread: rounds follow from the values of those before.
    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventFound<'_>, Error> {
        let blocks = &self.blocks;
        let answer = || self.model.by_resolvent(question);
        blocks.alone.install(|| blocks.gather(answer))
    }

    fn explain(&self, error: Error) -> Error {
        self.model.explain(error)
    }

    fn grid(&self, points: usize, part: Option<usize>) -> Vec<Region> {
        self.model.grid(points, part)
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        self.model.check(discretisation, pairs)
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        Ok(Box::new(BlockCells {
            cells: self.model.partition(discretisation)?,
            cut: *discretisation,
            blocks: &self.blocks,
        }))
    }

    fn levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        self.model.levels(discretisation)
    }

    fn coarse_levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        self.model.coarse_levels(discretisation)
    }

    fn order(&self, discretisation: &Discretisation, pairs: Pairs) -> f64 {
        self.model.order(discretisation, pairs)
    }

    fn smooth_order(&self, degree: usize) -> f64 {
        self.model.smooth_order(degree)
    }
}

impl<'m> Partitioned<'m> for BlockCells<'m> {
    fn cells(&self) -> usize {
        self.cells.cells()
    }

    fn unknowns(&self) -> usize {
        self.cells.unknowns()
    }

    fn cells_text(&self) -> String {
        self.cells.cells_text()
    }

    fn memory(&self, goals: &[Goal], pairs: Pairs) -> usize {
        self.cells.memory(goals, pairs)
    }

    fn cost(&self, pairs: Pairs) -> Cost {
        self.cells.cost(pairs)
    }

    fn pointwise_pairs(&self, pairs: Pairs) -> Result<PointwisePairs, Error> {
        self.cells.pointwise_pairs(pairs)
    }

    fn evaluations(&self, sweeps: u32) -> f64 {
        self.cells.evaluations(sweeps)
    }

    fn plain_radius(&self) -> Result<f64, Error> {
        self.blocks.set_up(
            &self.cut,
            |cells| drop(cells.plain_radius()),
            || self.cells.plain_radius(),
        )
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.blocks.set_up(
            &self.cut,
            |cells| drop(cells.check_variance(walk)),
            || self.cells.check_variance(walk),
        )
    }

    fn check_examination(&self) -> Result<(), Error> {
        self.cells.check_examination()
    }

    fn solve(&self) -> Result<Box<dyn System + 'm>, Error> {
        let system = self.blocks.set_up(
            &self.cut,
            |cells| drop(cells.solve()),
            || self.cells.solve(),
        )?;
        let blocks = self.blocks;
        Ok(Box::new(BlockSystem { system, blocks }))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let blocks = self.blocks;
        self.cells.plain_job(request, &mut |prepared| {
            let job = prepared.job;
            then(&Prepared {
                job: &BlockJob { job, blocks },
                ..*prepared
            })
        })
    }
}

impl System for BlockSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.system.check_variance(walk)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let blocks = self.blocks;
        self.system.job(request, &mut |prepared| {
            let job = prepared.job;
            then(&Prepared {
                job: &BlockJob { job, blocks },
                ..*prepared
            })
        })
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.system.examine(request, nodes, then)
    }

    fn tables(&self, pairs: Pairs) -> Result<fredholm_embedded::TableBuilder, Error> {
        self.system.tables(pairs)
    }
}

impl Job for BlockJob<'_> {
    fn goals(&self) -> usize {
        self.job.goals()
    }

    fn shared(&self) -> usize {
        self.job.shared()
    }

    fn run(&self, first: usize, batches: &mut [Batch], at_most: u64) -> Result<(), NotFinite> {
        let begin = batches.to_vec();
        let (ended, outcome) = self.blocks.gather(|| {
            let mut batches = begin.clone();
            let outcome = self.job.run(first, &mut batches, at_most);
            (batches, outcome)
        });
        batches.copy_from_slice(&ended);
        outcome
    }
}
