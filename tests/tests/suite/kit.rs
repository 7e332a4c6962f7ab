//! Every check can fail: for each there is a problem that is broken on purpose and that it must
//! catch, for one of three base seeds by day. `cargo test -p fredholm-tests --test suite kit -- --nocapture` prints the
//! table.

use core::sync::atomic::{AtomicU64, Ordering};

use fredholm_core::galerkin::{
    Basis, Cells, Dense, DiagonalRule, PairIntegral, PairKind, Pairs, Piecewise, StoppingRule,
    TransitionMoments, gauss_seidel,
};
use fredholm_core::global::Stationary;
use fredholm_core::{
    Absorption, Chain, Density, Equation, Estimator, Goal, Goals, Located, Neighbour, NoNeighbour,
    Real, Space, Statistics, Uniforms, Value, WalkOptions,
};
use fredholm_tests::check::{self, Among, SEEDS, seeds};
use fredholm_tests::galerkin::Tables;
use fredholm_tests::report::{CHECKS, SCALARS};
use fredholm_tests::scene;
use fredholm_tests::toy::{Coloured, Toy};
use fredholm_tests::{
    Description, Neighbours, Offers, Report, examine, examine_both, examine_masses, examine_steps,
    on_all_cores,
};

mod corner;
mod steps;
use corner::Corner;

/// What is broken, the check that must catch it, and what the kit finds with a seed.
type Entry = (&'static str, &'static str, fn(u64) -> Report);

/// **The list**.
#[rustfmt::skip]
const BROKEN: &[Entry] = &[
    ("left edges found in the cell before", "cells", |seed| with(Fault::Edge, seed)),
    ("one point in 100 found in the cell before", "steps' cells", |seed| with(Fault::Locate, seed)),
    ("the measure of a cell 0.1 % too large", "measures", |seed| with(Fault::Measure, seed)),
    ("points crowd at one end of a cell", "uniform points", |seed| with(Fault::Crowd, seed)),
    ("the parameters of points 0.1 % too large", "parameters", |seed| with(Fault::Parameter, seed)),
    ("basis 1 % too large", "basis", |seed| with(Fault::Basis, seed)),
    ("density 1 % too large", "density", |seed| with(Fault::Density, seed)),
    ("p_j 0.1 % too large", "moments", |seed| with(Fault::Mass, seed)),
    ("p_j as a difference that cancels", "masses", cancelling_masses),
    ("a wrong branch once in 50 steps", "chi-squared", |seed| with(Fault::Branch, seed)),
    ("1 step in 100 leaves, untold", "chi-squared", |seed| with(Fault::Leaves, seed)),
    ("steps lead to middles of cells", "distribution", |seed| with(Fault::Middle, seed)),
    ("a chain whose states crowd, told to preserve what is uniform", "preserved density", |seed| chain(Toy::new(CELLS), 1.0, seed)),
    ("the states of that chain, taken for starts", "suffix starts", |seed| chain(Toy::new(CELLS), 1.0, seed)),
    ("an open chain, told to preserve what is uniform", "preserved density", |seed| chain(Toy::new(CELLS).uniform().leaving(0.01), 1.0, seed)),
    ("starts crowd at one end", "suffix starts", |seed| chain(Toy::new(CELLS).uniform(), 1.02, seed)),
    ("F 0.1 % too large", "solution", |seed| with(Fault::Source, seed)),
    ("F of the third channel 0.1 % too large", "solution", |seed| coloured(Fault::LastChannel, seed)),
    ("k 0.1 % too large, u = 1", "constant", |seed| with(Fault::Kernel, seed)),
    ("one K'_ij 1 % too large", "coefficients", |seed| with(Fault::Coefficient, seed)),
    ("one F'_i 1 % too large", "source means", |seed| with(Fault::SourceMean, seed)),
    ("v after one sweep", "Galerkin solution", |seed| with(Fault::Solution, seed)),
    ("a list that lacks a pointwise pair", "pair lists", |seed| with(Fault::List, seed)),
    ("a pair in S whose mass vanishes at an end", "collapse", |seed| examine(&Corner, seed)),
    ("pair integrals 0.1 % too large", "pair integrals", |seed| with(Fault::Integral, seed)),
    ("S drops G's correction", "neighbour equation", |seed| with(Fault::Correction, seed)),
    ("the integral of a control of steps 5 % too large", "neighbour equation", |seed| with(Fault::StepIntegral, seed)),
    ("the same in three channels", "neighbour equation", |seed| coloured(Fault::StepIntegral, seed)),
    ("the probability of a step's event 5 % too large", "neighbour equation", |seed| with(Fault::EventProbability, seed)),
    ("in a scene, the integral of a control of rays 5 % too large", "neighbour equation", |seed| scene::broken(Some(scene::Fault::Integral), seed)),
    ("in a scene, the probability of meeting a face 5 % too large", "neighbour equation", |seed| scene::broken(Some(scene::Fault::EventProbability), seed)),
    ("h 5 % too large", "means", |seed| with(Fault::NeighbourKernel, seed)),
    ("F is not a number here and there", "neighbour equation", |seed| with(Fault::Hole, seed)),
    ("k is told to be 0 where it is not", "means", |seed| with(Fault::Size, seed)),
    ("k = 1, walks without end", "means", |seed| examine_steps(&Broken::<f64>::new(Fault::Endless, CELLS), seed)),
    ("every 1000th step depends on how many there were", "runners", |seed| with(Fault::Remembers, seed)),
    ("a merge that loses a batch", "statistics", lost_batch),
    ("a standard error 1 % too small", "statistics", small_error_bar),
    ("error bars 20 % too small", "coverage", small_intervals),
    ("F of f32 10^-4 too large", SCALARS, wrong_in_f32),
];

const CELLS: usize = 10;

const fn diagonal(diagonal: PairKind) -> DiagonalRule {
    DiagonalRule { diagonal }
}
const ALL: DiagonalRule = diagonal(PairKind::Galerkin);
const OUTSIDE: DiagonalRule = diagonal(PairKind::Dropped);
const POINTWISE: DiagonalRule = diagonal(PairKind::Pointwise);

/// What is wrong with a toy problem.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    Edge,
    Locate,
    Measure,
    Crowd,
    Parameter,
    Basis,
    Density,
    Mass,
    Cancels,
    Branch,
    Leaves,
    Middle,
    Source,
    LastChannel,
    Kernel,
    Coefficient,
    SourceMean,
    Solution,
    List,
    Integral,
    Correction,
    NeighbourKernel,
    StepIntegral,
    EventProbability,
    Narrow,
    Hole,
    Size,
    Endless,
    Remembers,
}

fn with(fault: Fault, seed: u64) -> Report {
    examine(&Broken::<f64>::new(fault, CELLS), seed)
}

fn coloured(fault: Fault, seed: u64) -> Report {
    examine(&Broken::of(Coloured::<f64>::coloured(CELLS), fault), seed)
}

fn cancelling_masses(seed: u64) -> Report {
    examine_masses(&Broken::<f64>::new(Fault::Cancels, 100_000), seed)
}

fn wrong_in_f32(seed: u64) -> Report {
    let narrow = Broken::<f32>::new(Fault::Narrow, CELLS);
    let wide = Broken::<f64>::new(Fault::Narrow, CELLS);
    examine_both::<_, _, 1>(&narrow, &wide, seed)
}

/// Starts that are powers of uniform numbers, told to be uniform, and preserved.
struct Claimed {
    power: f64,
}

impl Stationary<Toy<f64>> for Claimed {
    fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
        uniforms.uniform().powf(self.power)
    }
    fn start_density(&self, _: &f64) -> f64 {
        1.0
    }
    fn is_preserved(&self) -> bool {
        true
    }
}

/// What the checks of chains say of a toy with these starts.
fn chain(toy: Toy<f64>, power: f64, seed: u64) -> Report {
    let (mut report, starts) = (Report::default(), Claimed { power });
    let preserved = check::preserved::<_, _, 1>(&toy, &starts, seed);
    report.push("preserved density", "chain", preserved);
    let states = check::states::<_, _, 1>(&toy, &starts, seed);
    report.push("suffix starts", "chain", states);
    report
}

/// A toy problem with one fault; everything else is the toy's.
struct Broken<F, V = F> {
    toy: Toy<F, V>,
    fault: Fault,
    steps: AtomicU64,
}

impl<F: Real> Broken<F> {
    fn new(fault: Fault, cells: usize) -> Self {
        let toy = Toy::new(cells);
        let is_constant = fault == Fault::Kernel;
        Self::of(if is_constant { toy.constant() } else { toy }, fault)
    }
}

impl<F: Real, V: Value<F>> Broken<F, V> {
    fn of(toy: Toy<F, V>, fault: Fault) -> Self {
        Self {
            toy,
            fault,
            steps: AtomicU64::new(0),
        }
    }

    /// `factor` where this is the fault, else 1.
    fn factor(&self, fault: Fault, factor: f64) -> F {
        F::from_f64(if self.fault == fault { factor } else { 1.0 })
    }

    /// x n.
    fn scaled(&self, x: F) -> f64 {
        x.to_f64() * self.toy.cells() as f64
    }
}

/// Here and there: where the digits of x from the seventh on are below this.
fn digits<F: Real>(x: F, below: f64) -> bool {
    (x.to_f64() * 1e6).fract() < below
}

impl<F: Real, V: Value<F>> Space for Broken<F, V> {
    type Scalar = F;
    type Point = F;
}
impl<F: Real, V: Value<F>> Chain for Broken<F, V> {
    fn step<U: Uniforms<F>>(&self, x: &F, uniforms: &mut U) -> Option<F> {
        let y = self.toy.step(x, uniforms)?;
        match self.fault {
            Fault::Branch if digits(y, 0.02) => Some(y * F::from_f64(0.5)),
            Fault::Leaves if digits(y, 0.01) => None,
            Fault::Remembers if self.steps.fetch_add(1, Ordering::Relaxed) % 1000 == 999 => {
                Some(F::one() - y)
            }
            Fault::Middle => {
                let middle = self.scaled(y).floor() + 0.5;
                Some(F::from_f64(middle / self.toy.cells() as f64))
            }
            _ => Some(y),
        }
    }
}
impl<F: Real, V: Value<F>> Density for Broken<F, V> {
    fn density(&self, x: &F, y: &F) -> F {
        self.factor(Fault::Density, 1.01) * self.toy.density(x, y)
    }
}
impl<F: Real, V: Value<F>> Equation for Broken<F, V> {
    type Value = V;

    fn kernel(&self, x: &F, y: &F) -> V {
        if self.fault == Fault::Endless {
            return V::splat(self.channels(), F::one());
        }
        let k = self.toy.kernel(x, y);
        k.scaled(self.factor(Fault::Kernel, 1.001))
    }
    fn source<U: Uniforms<F>>(&self, x: &F, uniforms: &mut U) -> V {
        let source = self.toy.source(x, uniforms);
        if self.fault == Fault::Hole && digits(*x, 0.1) {
            return source.scaled(F::NAN);
        }
        let is_narrow = F::EPSILON.to_f64() > 1e-10;
        let narrow = self.factor(Fault::Narrow, if is_narrow { 1.0001 } else { 1.0 });
        let last = source.channels() - 1;
        V::from_fn(source.channels(), |c| {
            let own = self.factor(Fault::LastChannel, if c == last { 1.001 } else { 1.0 });
            source.get(c) * own * narrow * self.factor(Fault::Source, 1.001)
        })
    }
    fn channels(&self) -> usize {
        self.toy.channels()
    }
    fn size(&self, x: &F) -> F {
        match self.fault {
            Fault::Size if digits(*x, 0.1) => F::zero(),
            Fault::Endless => F::one(),
            _ => self.toy.size(x),
        }
    }
}
impl<F: Real, V: Value<F>> Cells for Broken<F, V> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.toy.cells()
    }
    fn locate(&self, x: &F) -> usize {
        let cell = self.toy.locate(x);
        let wrong = match self.fault {
            Fault::Edge => self.scaled(*x).fract() < 0.005,
            Fault::Locate => digits(*x, 0.01) && self.scaled(*x).fract() > 0.01,
            _ => false,
        };
        cell.saturating_sub(usize::from(wrong))
    }
    fn measure(&self, cell: usize) -> f64 {
        self.factor(Fault::Measure, 1.001).to_f64() * self.toy.measure(cell)
    }
    fn point(&self, cell: usize, t: &[f64]) -> F {
        match self.fault {
            Fault::Crowd => self.toy.point(cell, &[t[0] * t[0]]),
            _ => self.toy.point(cell, t),
        }
    }
    fn parameters(&self, x: &Located<F>, t: &mut [F]) {
        self.toy.parameters(x, t);
        t[0] = match self.fault {
            Fault::Crowd => t[0].sqrt(),
            _ => t[0] * self.factor(Fault::Parameter, 1.001),
        };
    }
    fn at(&self, x: &[f64]) -> Option<F> {
        self.toy.at(x)
    }
}
impl<F: Real, V: Value<F>> Basis for Broken<F, V> {
    fn basis(&self, _: &Located<F>) -> [F; 1] {
        [self.factor(Fault::Basis, 1.01)]
    }
}
impl<F: Real, V: Value<F>> TransitionMoments for Broken<F, V> {
    fn moments(&self, x: &Located<F>, j: usize) -> [[F; 1]; 1] {
        if self.fault == Fault::Cancels {
            // The distribution function at both ends of the cell.
            let (n, at) = (self.toy.cells() as f64, x.point.to_f64());
            let below = |y: f64| y + 0.5 * at * (y * y - y);
            return [[F::from_f64(below((j + 1) as f64 / n) - below(j as f64 / n))]];
        }
        let [[mass]] = self.toy.moments(x, j);
        [[self.factor(Fault::Mass, 1.001) * mass]]
    }
}
impl<F: Real> PairIntegral for Broken<F> {
    fn pair_integral(&self, x: &Located<F>, j: usize) -> [F; 1] {
        let [integral] = self.toy.pair_integral(x, j);
        [self.factor(Fault::Integral, 1.001) * integral]
    }
}

impl<F: Real, V: Value<F>> Description for Broken<F, V> {
    type Equation = Self;

    fn equation(&self) -> &Self {
        self
    }
    fn contains(&self, cell: usize, x: &F) -> bool {
        Description::<1>::contains(&self.toy, cell, x)
    }
    fn nodes(&self, x: &F, j: usize) -> Vec<(F, f64)> {
        Description::<1>::nodes(&self.toy, x, j)
    }
    fn solution(&self, x: &F) -> Option<V::Wide> {
        let is_known = self.fault != Fault::Endless;
        Description::<1>::solution(&self.toy, x).filter(|_| is_known)
    }
    fn constant(&self) -> Option<V::Wide> {
        Description::<1>::constant(&self.toy)
    }
    fn cumulative(&self, x: &F, y: &F) -> Option<f64> {
        Description::<1>::cumulative(&self.toy, x, y)
    }
    fn mass(&self, x: &Located<F>, j: usize) -> Option<f64> {
        Description::<1>::mass(&self.toy, x, j)
    }
}

impl<F: Real> Neighbours for Broken<F> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        if self.fault == Fault::Endless {
            let none = NoNeighbour::new(self);
            return offers.neighbour_by_steps("none", &none);
        }
        if self.fault == Fault::List {
            offers.pointwise_pairs("a list too short", TooShort);
        } else {
            offers.pointwise_pairs("diagonal pointwise", POINTWISE);
        }
        let (mut matrix, right) = self.toy.galerkin::<1>();
        let mut right: Vec<f64> = right.into_iter().map(Real::to_f64).collect();
        let wide: Vec<f64> = matrix.iter().map(|k| k.to_f64()).collect();
        let tables = Tables::<F>::new::<1>(&wide, &right).unwrap();
        // The toy's own v and coefficients are those of a problem that is right.
        if self.fault == Fault::None {
            let v: Vec<f64> = tables.v.iter().map(|v| v.to_f64()).collect();
            offers.galerkin_solution("own", &v, 0.0);
        } else if self.fault == Fault::Solution {
            let dense = Dense::new(&wide, CELLS, 1).unwrap();
            let mut v = right.clone();
            let once = StoppingRule::Fixed(1);
            gauss_seidel(&dense, &right, &mut v, &mut [0.0; 2], once).unwrap();
            offers.galerkin_solution("own", &v, 0.0);
        }
        // The source belongs to other pairs than the walk.
        let is_wrong = self.fault == Fault::Correction;
        let g = tables.source(if is_wrong { &ALL } else { &OUTSIDE });
        let coefficients = tables.coefficients();
        let equation = Piecewise::new(self, &coefficients, OUTSIDE, &tables.v, &g).unwrap();
        let large = LargeKernel {
            inner: &equation,
            factor: self.factor(Fault::NeighbourKernel, 1.05),
        };
        offers.neighbour("diagonal outside", &large);
        self.offer_steps(offers, &tables.v);
        if self.fault == Fault::Coefficient {
            matrix[CELLS + 2] *= F::from_f64(1.01);
        }
        if self.fault == Fault::SourceMean {
            right[3] *= 1.01;
        }
        if matches!(
            self.fault,
            Fault::None | Fault::Coefficient | Fault::SourceMean
        ) {
            offers.coefficients("own", &self.toy.coefficients::<1>(&matrix), 0.0);
            offers.source_means("own", &right, 0.0);
        }
    }
}

/// The diagonal pointwise, and a list that leaves one of it out.
#[derive(Clone, Copy)]
struct TooShort;

impl Pairs for TooShort {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        POINTWISE.kind(i, j)
    }
    fn pointwise(&self, i: usize, _: usize) -> impl Iterator<Item = usize> {
        (i != 3).then_some(i).into_iter()
    }
}

/// A neighbour equation with a factor before its kernel.
struct LargeKernel<'a, N: Space> {
    inner: &'a N,
    factor: N::Scalar,
}

impl<N: Space> Space for LargeKernel<'_, N> {
    type Scalar = N::Scalar;
    type Point = N::Point;
}
impl<N: Neighbour> Neighbour for LargeKernel<'_, N> {
    type Value = N::Value;

    fn locate(&self, x: N::Point) -> Located<N::Point> {
        self.inner.locate(x)
    }
    fn kernel(&self, x: &Located<N::Point>, y: &Located<N::Point>, k: &N::Value) -> N::Value {
        self.inner.kernel(x, y, k).scaled(self.factor)
    }
    fn source(&self, x: &Located<N::Point>, draws: &mut dyn Uniforms<N::Scalar>) -> N::Value {
        self.inner.source(x, draws)
    }
    fn value(&self, x: &Located<N::Point>) -> N::Value {
        self.inner.value(x)
    }
}

/// Walks of the toy from one point, without a neighbour equation.
struct Walks {
    toy: Toy<f64>,
    none: NoNeighbour<Toy<f64>>,
    goals: [Goal<Among<'static, f64>, f64>; 1],
}

type ToyWalks<'a> = Goals<'a, Toy<f64>, NoNeighbour<Toy<f64>>, Among<'static, f64>>;

impl Walks {
    fn new() -> Self {
        let toy = Toy::new(CELLS);
        Self {
            none: NoNeighbour::new(&toy),
            toy,
            goals: [Goal::new(Among(&[0.3]), Some(0.0))],
        }
    }

    fn job(&self, seed: u64) -> ToyWalks<'_> {
        let options = WalkOptions {
            seed,
            absorption: Absorption::Constant {
                probability: 0.2,
                estimator: Estimator::Absorption,
            },
            ..WalkOptions::default()
        };
        Goals::new(&self.toy, &self.none, &self.goals, options)
    }
}

/// The first 3,000 walks, in batches of 1,000; the second is forgotten.
fn lost_batch(seed: u64) -> Report {
    let mut report = Report::default();
    let outcome = check::statistics(&Walks::new().job(seed), 3000, |job, walks| {
        let mut all = Statistics::default();
        for index in [0, 2] {
            let mut batch = [fredholm_core::Batch::new(index, 1000, walks)];
            job.run(0, &mut batch, u64::MAX).unwrap();
            all.merge(&batch[0].statistics());
        }
        vec![all]
    });
    report.push("statistics", "a merge", outcome);
    report
}

fn small_error_bar(seed: u64) -> Report {
    let mut report = Report::default();
    let mut estimate = check::run(&Walks::new().job(seed), 1000)[0].plain();
    estimate.std_error = estimate.std_error.map(|bar| 0.99 * bar);
    report.push(
        "statistics",
        "an estimate",
        check::error_bar(&estimate, 1000),
    );
    report
}

fn small_intervals(seed: u64) -> Report {
    let mut report = Report::default();
    let walks = Walks::new();
    let outcome = check::coverage(Toy::exact(0.3), |other| {
        let estimate = check::run(&walks.job(seed + 1000 * other), 400)[0].plain();
        (estimate.estimate, 0.8 * estimate.std_error.unwrap())
    });
    report.push("coverage", "an estimate", outcome);
    report
}

#[test]
fn what_is_not_broken_passes() {
    for &seed in seeds() {
        with(Fault::None, seed).assert_passed("the toy under the broken ones");
        coloured(Fault::None, seed).assert_passed("the channels under the broken ones");
        scene::broken(None, seed).assert_passed("the scene under the broken ones");
    }
    let mut right = Report::default();
    let outcome = check::statistics(&Walks::new().job(1), 3000, check::run);
    right.push("statistics", "a right merge", outcome);
    right.assert_passed("the walks under the broken ones");
}

/// With one seed by day, and with three if there is `FREDHOLM_LONG`.
#[test]
fn every_broken_problem_is_caught_by_its_check() {
    let columns: Vec<&str> = CHECKS.into_iter().chain([SCALARS]).collect();
    for check in &columns {
        let caught = BROKEN.iter().any(|(_, by, _)| by == check);
        assert!(caught, "no problem is broken for the check '{check}'");
    }
    let reports: Vec<Vec<Report>> = on_all_cores(BROKEN.len(), &|number| {
        let (_, _, examine) = &BROKEN[number];
        seeds().iter().map(|&seed| examine(seed)).collect()
    });
    println!("X: caught by the check it is broken for; x: by another; .: passed; blank: not run");
    for (number, check) in columns.iter().enumerate() {
        println!("{}{check}", "| ".repeat(number));
    }
    for ((name, _, _), reports) in BROKEN.iter().zip(&reports) {
        let cell = |check: &&str| match reports[0].worst(check) {
            None => ' ',
            Some(row) if row.outcome.passed() => '.',
            Some(_) if BROKEN.iter().any(|(n, by, _)| n == name && by == check) => 'X',
            Some(_) => 'x',
        };
        let line: Vec<String> = columns
            .iter()
            .map(|check| cell(check).to_string())
            .collect();
        println!("{} {name}", line.join(" "));
    }
    println!();
    for ((name, by, _), reports) in BROKEN.iter().zip(&reports) {
        for (report, &seed) in reports.iter().zip(seeds()) {
            let row = report
                .worst(by)
                .unwrap_or_else(|| panic!("{name}: '{by}' has not run"));
            assert!(
                !row.outcome.passed(),
                "{name}, seed {seed}: not caught by '{by}'\n{report}"
            );
            if seed == SEEDS[0] {
                println!("{name}\n    {by}: {}", row.outcome);
            }
        }
    }
}
