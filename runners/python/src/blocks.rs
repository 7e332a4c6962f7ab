//! Functions that are called with blocks of points, though set-ups and walks ask for one value at a time.
//!
//! A piece of work is run to see which values it asks for, the functions are called once with all of them, and the piece is run again
//! with the values. What asks for others the second time, as an adaptive rule does or a walk that goes on, is recorded again. Set-ups of
//! chains keep what they found, so that one is rehearsed on a copy of the equation. The values, and so the bits, are those of calls one by
//! one.

use core::cell::{Cell, RefCell};
use core::hash::{BuildHasherDefault, Hasher};
use core::ops::Range;
use std::collections::HashMap;
use std::sync::Arc;

use fredholm::cost::{Cost, PointwisePairs};
use fredholm::model::{About, Examined, Prepared, Request, Then};
use fredholm::resolvent::{ResolventFound, ResolventQuestion};
use fredholm::{
    CubeModel, Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, System, WalkOptions,
};
use fredholm_core::{Batch, Job, NotFinite};
use fredholm_model::{Deterministic, GlobalSystem};
use fredholm_rayon::{Gather, is_complete, leave_out, with_gather};

use crate::functions::Caller;

/// Values that are asked for together, about: further pieces wait for those.
const TOGETHER: usize = 1 << 16;
/// Runs of a piece. Those that ask for few values are worth it some times, until it turns out what is asked for next; what goes on like that, as
/// the search for the place of a jump does, calls one by one.
const RUNS: usize = 32;
const FEW: usize = 16;
const MOST_SHORT: usize = 6;

thread_local! {
    /// The tape of the work that this thread does.
    static TAPE: RefCell<Option<Tape>> = const { RefCell::new(None) };
}

/// Hashes a number that is a hash already.
#[derive(Default)]
struct AsIs(u64);

impl Hasher for AsIs {
    fn write(&mut self, _: &[u8]) {}

    fn write_u128(&mut self, number: u128) {
        self.0 = number as u64;
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// Places at which a function is asked for values, in the order in which it is, and the values so far.
#[derive(Debug, Default)]
pub(crate) struct Track {
    dimension: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    values: Vec<f64>,
    /// The number of the place that this run asks for next, if it asks as the one before did.
    next: usize,
    /// The numbers of the first so many places, once a run asks otherwise: by 128 bits, so that no two places are ever one.
    numbers: HashMap<u128, usize, BuildHasherDefault<AsIs>>,
    numbered: usize,
}

/// 128 bits of a place.
fn key(x: &[f64], y: &[f64]) -> u128 {
    let mut halves = [0x243f_6a88_85a3_08d3_u64, 0x1319_8a2e_0370_7344];
    for coordinate in x.iter().chain(y) {
        // 0 and -0 are one place.
        let bits = (coordinate + 0.0).to_bits();
        let odd = [0x9e37_79b9_7f4a_7c15_u64, 0xbf58_476d_1ce4_e5b9];
        for (half, odd) in halves.iter_mut().zip(odd) {
            let product = u128::from(*half ^ bits) * u128::from(odd);
            *half = (product as u64 ^ (product >> 64) as u64).wrapping_add(odd);
            *half = (*half ^ *half >> 29).wrapping_mul(0x94d0_49bb_1331_11eb);
        }
    }
    u128::from(halves[0]) << 64 | u128::from(halves[1])
}

impl Track {
    fn new(dimension: usize) -> Self {
        Self {
            dimension,
            ..Self::default()
        }
    }

    /// The number of places.
    fn places(&self) -> usize {
        self.x.len() / self.dimension
    }

    fn is_at(&self, number: usize, x: &[f64], y: &[f64]) -> bool {
        let place = number * x.len()..(number + 1) * x.len();
        self.x.get(place.clone()) == Some(x) && (y.is_empty() || self.y.get(place) == Some(y))
    }

    /// The number of a place that an earlier run asked for.
    fn find(&mut self, x: &[f64], y: &[f64]) -> Option<usize> {
        if self.is_at(self.next, x, y) {
            return Some(self.next);
        }
        for number in self.numbered..self.places() {
            let place = number * self.dimension..(number + 1) * self.dimension;
            let other = self.y.get(place.clone()).unwrap_or(&[]);
            self.numbers.insert(key(&self.x[place], other), number);
        }
        self.numbered = self.places();
        self.numbers.get(&key(x, y)).copied()
    }

    /// The value at (x, y), or `unknown` until it is known; `None`: somebody else must know it.
    fn value(&mut self, x: &[f64], y: &[f64], (run, unknown): (Run, f64)) -> Option<f64> {
        let left_out = || {
            leave_out();
            unknown
        };
        let found = match run {
            // All places are new, but for those that are there twice.
            Run::First => None,
            _ => self.find(x, y),
        };
        if let Some(number) = found {
            self.next = number + 1;
            return Some(self.values.get(number).copied().unwrap_or_else(left_out));
        }
        if matches!(run, Run::Known) {
            return None;
        }
        self.x.extend_from_slice(x);
        self.y.extend_from_slice(y);
        Some(left_out())
    }

    /// The places without a value, if there are some.
    pub(crate) fn asked(&self) -> Option<[&[f64]; 2]> {
        let known = self.values.len() * self.dimension;
        let x = self.x.get(known..).filter(|x| !x.is_empty())?;
        Some([x, self.y.get(known..).unwrap_or_default()])
    }

    fn open(&self) -> usize {
        self.places() - self.values.len()
    }

    /// Adds the values of what was asked.
    pub(crate) fn fill(&mut self, values: &[f64]) {
        self.values.extend_from_slice(values);
    }
}

/// What a run of work is for.
#[derive(Clone, Copy, Debug)]
enum Run {
    /// To see what it asks for.
    First,
    /// To see what it asks for besides.
    Further,
    /// What is not known is left to the one who asks.
    Known,
}

/// The values that a piece of work asks for.
#[derive(Debug)]
pub(crate) struct Tape {
    pub(crate) kernel: Track,
    pub(crate) source: Track,
    run: Run,
    /// What stands for a value that is not known yet.
    unknown: f64,
}

impl Tape {
    fn new(dimension: usize, unknown: f64) -> Self {
        Self {
            kernel: Track::new(dimension),
            source: Track::new(dimension),
            run: Run::First,
            unknown,
        }
    }

    /// The tape for another run.
    fn rewound(mut self, run: Run) -> Self {
        self.kernel.next = 0;
        self.source.next = 0;
        self.run = run;
        self
    }

    fn open(&self) -> usize {
        self.kernel.open() + self.source.open()
    }
}

/// The number of values that this thread's tape asks for.
fn open() -> usize {
    TAPE.with_borrow(|tape| tape.as_ref().map_or(0, Tape::open))
}

/// Whether this thread does again what it has done before.
pub(crate) fn is_repeated() -> bool {
    TAPE.with_borrow(|tape| {
        tape.as_ref()
            .is_some_and(|tape| !matches!(tape.run, Run::First))
    })
}

/// K(x, y) by the tape of this thread, if that has one.
pub(crate) fn kernel(x: &[f64], y: &[f64]) -> Option<f64> {
    TAPE.with_borrow_mut(|tape| {
        let tape = tape.as_mut()?;
        tape.kernel.value(x, y, (tape.run, tape.unknown))
    })
}

/// F(x) by the tape of this thread, if that has one.
pub(crate) fn source(x: &[f64]) -> Option<f64> {
    TAPE.with_borrow_mut(|tape| {
        let tape = tape.as_mut()?;
        tape.source.value(x, &[], (tape.run, tape.unknown))
    })
}

/// Calls functions with all points that work asks for.
#[derive(Debug)]
pub(crate) struct InBlocks(pub(crate) Arc<Caller>);

impl InBlocks {
    /// Does pieces of work until nothing is missing of them, and returns all that they have asked for. What is not known yet is `unknown`
    /// meanwhile.
    fn some(
        &self,
        pieces: impl Iterator<Item = usize>,
        unknown: f64,
        work: &dyn Fn(usize),
    ) -> Tape {
        let new = || Tape::new(self.0.dimension(), unknown);
        let on = |tape: Tape, pieces: &mut dyn Iterator<Item = usize>| {
            TAPE.set(Some(tape));
            let asking: Vec<usize> = pieces
                .filter(|number| !is_complete(|| work(*number)))
                .collect();
            (TAPE.take().unwrap_or_else(new), asking)
        };
        let mut pieces = pieces;
        let (mut tape, mut asking) = on(new(), &mut pieces);
        let mut short = 0;
        for _ in 0..RUNS {
            let asked = tape.open();
            self.0.fill(&mut tape);
            short += usize::from(asked < FEW);
            if asked == 0 || short > MOST_SHORT {
                break;
            }
            (tape, asking) = on(tape.rewound(Run::Further), &mut asking.into_iter());
        }
        on(tape.rewound(Run::Known), &mut asking.into_iter()).0
    }

    /// Does walks of a chain, which keep nothing of what they find.
    fn walks<T>(&self, work: impl Fn() -> T) -> T {
        let done = RefCell::new(None);
        self.some(0..1, 0.0, &|_| {
            done.replace(Some(work()));
        });
        done.into_inner().unwrap_or_else(work)
    }
}

impl Gather for InBlocks {
    fn gather(&self, pieces: Range<usize>, work: &dyn Fn(usize)) {
        let mut rest = pieces;
        while !rest.is_empty() {
            let begun = Cell::new(rest.start);
            // Pieces are begun as long as all together ask for few values.
            let some = rest.clone().take_while(|_| open() < TOGETHER);
            let some = some.inspect(|number| begun.set(number + 1));
            self.some(some, f64::NAN, work);
            rest.start = begun.get();
        }
    }
}

/// Work with functions that are called in blocks.
#[derive(Debug)]
pub(crate) struct Blocks {
    calls: Arc<InBlocks>,
    /// The interval of every axis; none: [0, 1].
    domain: Vec<[f64; 2]>,
    /// Coordinates on every axis where cells end.
    edges: Vec<Vec<f64>>,
    /// One thread, on which set-ups ask for what their rehearsals asked for.
    alone: rayon::ThreadPool,
}

impl Blocks {
    /// # Errors
    /// There are no threads.
    pub(crate) fn new(
        caller: Arc<Caller>,
        domain: Vec<[f64; 2]>,
        edges: Vec<Vec<f64>>,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        Ok(Self {
            calls: Arc::new(InBlocks(caller)),
            domain,
            edges,
            alone,
        })
    }

    /// The equation, of which nothing is known.
    fn fresh(&self) -> CubeModel {
        self.calls.0.model(&self.domain, &self.edges)
    }

    /// Does a piece of a set-up, which may keep what it finds: it is rehearsed with these cells of another copy.
    fn set_up<T: Send>(
        &self,
        cut: &Discretisation,
        rehearsal: impl Fn(&dyn Partitioned<'_>) + Sync,
        work: impl FnOnce() -> T + Send,
    ) -> T {
        self.alone.install(|| {
            let tape = self.calls.some(0..1, 0.0, &|_| {
                // What cannot be cut is refused by the work itself.
                if let Ok(cells) = self.fresh().partition(cut) {
                    rehearsal(&*cells);
                }
            });
            TAPE.set(Some(tape.rewound(Run::Known)));
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

    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventFound<'_>, Error> {
        with_gather(self.blocks.calls.clone(), || {
            self.model.by_resolvent(question)
        })
    }

    fn spread(&self, points: f64) -> Vec<Region> {
        self.model.spread(points)
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

    fn examined_points(&self) -> Result<usize, Error> {
        self.cells.examined_points()
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

    /// Of a chain: functions are called for one point at a time.
    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn GlobalSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        self.system.whole()
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
        let (ended, outcome) = self.blocks.calls.walks(|| {
            let mut batches = begin.clone();
            let outcome = self.job.run(first, &mut batches, at_most);
            (batches, outcome)
        });
        batches.copy_from_slice(&ended);
        outcome
    }
}
