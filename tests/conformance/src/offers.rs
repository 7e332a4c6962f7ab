//! The neighbour equations of a problem, each checked as it is handed in.

use fredholm_core::galerkin::{
    Cells, Coefficients, GalerkinMatrix, PairIntegral, Pairs, Piecewise, TransitionMoments,
};
use fredholm_core::global::Stationary;
use fredholm_core::{
    Absorption, Density, Equation, Estimate, Estimator, Form, Goal, Goals, Independent, Job,
    Neighbour, NeighbourOf, NoNeighbour, Real, STEP_LIMIT, Statistics, Value, WalkOptions, WideOf,
    rounding_floor,
};
use rand::rngs::Xoshiro256PlusPlus;

use crate::check::{self, Among};
use crate::description::{Description, PointOf, ScalarOf, ValueOf, scalar_name};
use crate::galerkin::System;
use crate::outcome::{Outcome, Worst};
use crate::report::Report;
use crate::runners::{Any, Generator, Walkable, in_batches, runners};

/// A described problem that offers neighbour equations to the kit.
pub trait Neighbours<const B: usize = 1>: Description<B> {
    /// Hands in every neighbour equation of the problem: each choice of pairs, its own coefficients
    /// and solution; of an equation of steps by [`Offers::neighbour_by_steps`].
    fn offers(&self, offers: &mut Offers<'_, Self, B>);
}

/// Where a described problem hands in its neighbour equations; each is checked as it comes.
#[derive(Debug)]
pub struct Offers<'a, D: Description<B>, const B: usize = 1> {
    description: &'a D,
    seed: u64,
    points: Vec<PointOf<D, B>>,
    /// The mean of u over these points.
    exact: Option<WideOf<D::Equation>>,
    /// A bound of ∫|K(x,y)|dμ(y) below 1.
    norm: f64,
    /// The kit's own Galerkin systems: an equation of steps has none.
    system: Option<System<ScalarOf<D, B>>>,
    covered: bool,
    report: Report,
}

/// Options of walks, with this q0 where absorption is constant: those that are looked at closely, each with others that are looked at
/// briefly.
fn modes(probability: f64, seed: u64) -> [[WalkOptions; 2]; 2] {
    let constant = |estimator| Absorption::Constant {
        probability,
        estimator,
    };
    let mode = |absorption, form| WalkOptions {
        seed,
        absorption,
        form,
        // A walk that takes so long is no walk of a test's.
        step_limit: STEP_LIMIT / 10,
        ..WalkOptions::default()
    };
    [
        [
            mode(Absorption::Roulette, Form::Residual),
            mode(Absorption::Roulette, Form::Product),
        ],
        [
            mode(constant(Estimator::Absorption), Form::Product),
            mode(constant(Estimator::Collision), Form::Residual),
        ],
    ]
}

/// What such walks are called in tables.
fn named(
    name: &str,
    WalkOptions {
        absorption, form, ..
    }: &WalkOptions,
) -> String {
    match absorption {
        Absorption::Roulette => format!("{name}, roulette, {form:?}"),
        Absorption::Constant { estimator, .. } => format!("{name}, {estimator:?}, {form:?}"),
    }
}

/// The equation of a described problem and its chain.
type AnyEquation<'a, D, const B: usize> =
    dyn Walkable<Scalar = ScalarOf<D, B>, Point = PointOf<D, B>, Value = ValueOf<D, B>> + Sync + 'a;
/// A neighbour equation of a described problem.
type AnyNeighbour<'a, D, const B: usize> = dyn Neighbour<Scalar = ScalarOf<D, B>, Point = PointOf<D, B>, Value = ValueOf<D, B>>
    + Sync
    + 'a;
/// Walks from random points of a described problem.
type Walking<'a, D, const B: usize, G = Independent> =
    Goals<'a, Any<'a, AnyEquation<'a, D, B>>, AnyNeighbour<'a, D, B>, Among<'a, PointOf<D, B>>, G>;

// Methods say what they ask of an equation, and not the block: then the compiler names the trait that is missing.
impl<'a, D: Description<B>, const B: usize> Offers<'a, D, B> {
    /// Nothing is handed in yet. What is found is added to `report`.
    pub(crate) fn new(
        description: &'a D,
        seed: u64,
        system: System<ScalarOf<D, B>>,
        report: Report,
    ) -> Self
    where
        D::Equation: Density,
    {
        let points = check::random_points(description, seed);
        // A floor needs a number below 1.
        let bounds = system.exact.iter().map(|exact| exact.radius_bound);
        let largest = bounds.fold(0.0, f64::max);
        let norm = norm(description, &points);
        let norm = if norm < 1.0 { norm } else { largest };
        Self::among(description, seed, points, norm, Some(system), report)
    }

    /// Any neighbour equation.
    pub fn neighbour<N: NeighbourOf<D::Equation> + Sync>(&mut self, name: &str, neighbour: &N)
    where
        D::Equation: Density,
    {
        self.any_neighbour(name, neighbour);
    }

    /// Checks a neighbour equation as [`neighbour`](Self::neighbour) does, with one type for all of them: a problem with many choices compiles in
    /// a fraction of the time.
    pub fn any_neighbour(&mut self, name: &str, neighbour: &AnyNeighbour<'_, D, B>)
    where
        D::Equation: Density,
    {
        let outcome = check::neighbour_equation(self.description, neighbour, self.seed);
        self.checked(name, outcome, neighbour);
    }

    /// The problem's own coefficients of its first channel, which claim to be the integrals within `relative` of a row's
    /// size; 0 claims that they are exact.
    pub fn coefficients<F: Real>(
        &mut self,
        name: &str,
        coefficients: &dyn GalerkinMatrix<Scalar = F>,
        relative: f64,
    ) {
        let expected = &self.system().exact[0].matrix;
        let outcome = check::coefficients(self.description, expected, coefficients, relative);
        self.push("coefficients", name, outcome);
    }

    /// The problem's own F'_ia of its first channel, within `relative` of the largest; 0 claims that they are exact.
    pub fn source_means(&mut self, name: &str, means: &[f64], relative: f64) {
        let outcome = check::source_means(self.description, means, relative);
        self.push("source means", name, outcome);
    }

    /// The problem's own Galerkin solution of its first channel, within `relative` of its largest entry of the one with
    /// exact coefficients.
    pub fn galerkin_solution(&mut self, name: &str, v: &[f64], relative: f64) {
        let outcome = check::vectors_agree::<D, B>("v", &self.system().exact[0].v, v, relative);
        self.push("Galerkin solution", name, outcome);
    }

    /// Offers starts of a known density, and the chain as one that preserves it if they say so: most often the equation
    /// itself.
    pub fn starts<C: Stationary<D::Equation>>(&mut self, chain: &C)
    where
        D::Equation: Density,
    {
        let preserved = check::preserved(self.description, chain, self.seed);
        self.push("preserved density", "chain", preserved);
        let states = check::states(self.description, chain, self.seed);
        self.push("suffix starts", "chain", states);
    }

    /// The kit's own Galerkin systems.
    fn system(&self) -> &System<ScalarOf<D, B>> {
        let system = self.system.as_ref();
        system.expect("the systems with which offers of a description begin")
    }

    fn check_pairs<S: Pairs>(&mut self, name: &str, pairs: &S)
    where
        D::Equation: TransitionMoments<B>,
    {
        let cells = self.description.equation().cells();
        self.push("pair lists", name, check::pair_lists(pairs, cells));
        if let Some(outcome) = check::collapse(self.description, pairs, self.seed) {
            self.push("collapse", name, outcome);
        }
    }

    /// A choice of pairs that are in S or left out. The kit makes its own coefficients for them,
    /// and spoils them: the neighbour equation holds for any.
    ///
    /// # Panics
    /// If there is a pointwise pair: see [`pointwise_pairs`](Self::pointwise_pairs).
    pub fn pairs<S: Pairs + Copy + Sync>(&mut self, name: &str, pairs: S)
    where
        D::Equation: Density + TransitionMoments<B> + Equation<Value = ScalarOf<D, B>>,
    {
        self.check_pairs(name, &pairs);
        let tables = self.system().tables.clone();
        let g = tables.source(&pairs);
        self.piecewise(name, &tables.coefficients(), pairs, &tables.v, &g);
    }

    /// Offers pairs as [`pairs`](Self::pairs) does, with pairs of any kind, for a problem that has the exact integrals
    /// of pointwise ones.
    pub fn pointwise_pairs<S: Pairs + Copy + Sync>(&mut self, name: &str, pairs: S)
    where
        D::Equation: Density + TransitionMoments<B> + PairIntegral<B>,
        D::Equation: Equation<Value = ScalarOf<D, B>>,
    {
        self.check_pairs(name, &pairs);
        let integrals = check::pair_integrals(self.description, self.seed);
        self.push("pair integrals", name, integrals);
        let tables = self.system().tables.clone();
        let g = tables.source(&pairs);
        self.pointwise_piecewise(name, &tables.coefficients(), pairs, &tables.v, &g);
    }

    /// A neighbour equation from the problem's own coefficients, v and G, without pointwise pairs.
    ///
    /// # Panics
    /// If sizes differ, or there is a pointwise pair.
    pub fn piecewise<C, S: Pairs + Copy + Sync>(
        &mut self,
        name: &str,
        coefficients: &C,
        pairs: S,
        v: &[ScalarOf<D, B>],
        g: &[ScalarOf<D, B>],
    ) where
        D::Equation: Density + TransitionMoments<B> + Equation<Value = ScalarOf<D, B>>,
        C: Coefficients<B, Scalar = ScalarOf<D, B>> + Sync,
    {
        let equation = self.description.equation();
        let neighbour = Piecewise::<_, _, _, _, _, B>::new(equation, coefficients, pairs, v, g)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        self.neighbour(name, &neighbour);
    }

    /// Offers a neighbour equation as [`piecewise`](Self::piecewise) does, with pairs of any kind.
    ///
    /// # Panics
    /// If sizes differ.
    pub fn pointwise_piecewise<C, S: Pairs + Copy + Sync>(
        &mut self,
        name: &str,
        coefficients: &C,
        pairs: S,
        v: &[ScalarOf<D, B>],
        g: &[ScalarOf<D, B>],
    ) where
        D::Equation: Density + TransitionMoments<B> + PairIntegral<B>,
        D::Equation: Equation<Value = ScalarOf<D, B>>,
        C: Coefficients<B, Scalar = ScalarOf<D, B>> + Sync,
    {
        let equation = self.description.equation();
        let neighbour =
            Piecewise::<_, _, _, _, _, B>::with_pointwise(equation, coefficients, pairs, v, g)
                .unwrap_or_else(|e| panic!("{name}: {e}"));
        self.neighbour(name, &neighbour);
    }

    /// Offers of an equation of steps: nothing is handed in yet.
    pub(crate) fn by_steps(description: &'a D, seed: u64, report: Report) -> Self {
        let points = check::random_points(description, seed);
        // A floor needs a number below 1.
        let norm = check::norm_by_steps(description, &points, seed).min(0.999);
        Self::among(description, seed, points, norm, None, report)
    }

    fn among(
        description: &'a D,
        seed: u64,
        points: Vec<PointOf<D, B>>,
        norm: f64,
        system: Option<System<ScalarOf<D, B>>>,
        report: Report,
    ) -> Self {
        let solutions = points.iter().map(|x| description.solution(x));
        let solutions: Option<Vec<_>> = solutions.collect();
        Self {
            description,
            seed,
            exact: solutions.and_then(|all| mean(&all)),
            norm,
            points,
            system,
            covered: false,
            report,
        }
    }

    /// What was found.
    pub(crate) fn into_report(self) -> Report {
        self.report
    }

    /// Any neighbour equation of an equation of steps. Integrals over steps are means over draws.
    pub fn neighbour_by_steps<N: NeighbourOf<D::Equation> + Sync>(
        &mut self,
        name: &str,
        neighbour: &N,
    ) {
        let outcome = check::neighbour_equation_by_steps(self.description, neighbour, self.seed);
        self.checked(name, outcome, neighbour);
    }

    /// Adds what was found of a neighbour equation, and walks by it.
    fn checked(&mut self, name: &str, outcome: Outcome, neighbour: &AnyNeighbour<'_, D, B>) {
        self.push("neighbour equation", name, outcome);
        for [closely, briefly] in modes(self.description.absorption(), self.seed) {
            self.walks(name, neighbour, closely, briefly);
        }
    }

    fn push(&mut self, check: &'static str, name: &str, outcome: Outcome) {
        let subject = format!("{}, {name}", scalar_name::<D, B>());
        self.report.push(check, subject, outcome);
    }

    /// Plain Monte Carlo, without any neighbour equation.
    pub(crate) fn plain(&mut self) {
        let (points, description) = (self.points.clone(), self.description);
        let neighbour = NoNeighbour::new(description.equation());
        let equation = Any(description.equation() as &AnyEquation<'_, D, B>);
        let nothing = WideOf::<D::Equation>::splat(self.channels(), 0.0);
        let goals = [Goal {
            functional: Among(&points),
            control_mean: Some(nothing),
            known: nothing,
        }];
        let modes = modes(description.absorption(), self.seed);
        // The forms are one.
        for &options in modes.as_flattened().iter().skip(1) {
            let neighbour = &neighbour as &AnyNeighbour<'_, D, B>;
            let job: Walking<'_, D, B> = Goals::new(&equation, neighbour, &goals, options);
            // The means are those beside the first neighbour equation.
            if check::walk_all(&job, 1000).is_err() {
                return;
            }
            self.alone(job);
            self.alone(job.with_generator::<Xoshiro256PlusPlus>());
        }
    }

    fn alone<G: Generator>(&mut self, job: Walking<'_, D, B, G>) {
        let name = format!("{}, {}", named("plain", &job.options), G::NAME);
        self.push("runners", &name, runners(&job));
        self.report.plain += 1;
    }

    /// The means of a generator's walks, and the bits of all runners, of which those of the plain estimate are the
    /// same without the neighbour equation. Returns whether every walk ended.
    fn generator<G: Generator>(
        &mut self,
        name: &str,
        job: Walking<'_, D, B, G>,
        walks: u64,
        floors: &[f64],
    ) -> bool {
        let name = &format!("{name}, {}", G::NAME);
        if !self.means(name, &job, walks, floors) {
            return false;
        }
        self.push("runners", name, runners(&job));
        self.report.preconditioned += 1;
        let none = NoNeighbour::new(self.description.equation());
        let none = &none as &AnyNeighbour<'_, D, B>;
        let alone: Walking<'_, D, B> = Goals::new(job.equation, none, job.goals, job.options);
        let alone = in_batches(&alone.with_generators(job.generators));
        let mut worst = Worst::new("estimates with other bits", 0.0);
        for (alone, beside) in alone.iter().zip(in_batches(&job)) {
            let (expected, found) = (alone.plain(), beside.plain());
            let other = f64::from(u8::from(expected != found));
            worst.add(expected.estimate, found.estimate, other, || {
                "the plain estimate beside this neighbour equation".into()
            });
        }
        self.push("runners", name, worst.outcome());
        true
    }

    /// The means of all channels. Returns whether every walk ended.
    fn means(&mut self, name: &str, job: &dyn Job, walks: u64, floors: &[f64]) -> bool {
        let all = match check::walk_all(job, walks) {
            Ok(all) => all,
            Err(outcome) => {
                self.push("means", name, outcome);
                return false;
            }
        };
        for (channel, (statistics, &floor)) in all.iter().zip(floors).enumerate() {
            let exact = self.exact.as_ref().map(|exact| exact.get(channel));
            self.push("means", name, check::means(statistics, exact, floor));
        }
        true
    }

    fn walks(
        &mut self,
        name: &str,
        neighbour: &AnyNeighbour<'_, D, B>,
        closely: WalkOptions,
        briefly: WalkOptions,
    ) {
        const REPLAYED: u64 = 2000;
        const COVERAGE: u64 = 400;
        let (points, description) = (self.points.clone(), self.description);
        let values = points
            .iter()
            .map(|&x| neighbour.value(&neighbour.locate(x)).wide());
        let values: Vec<WideOf<D::Equation>> = values.collect();
        let floors = &self.floors(&values);
        let equation = Any(description.equation() as &AnyEquation<'_, D, B>);
        let goals = [Goal {
            functional: Among(&points),
            control_mean: mean(&values),
            known: WideOf::<D::Equation>::splat(floors.len(), 0.0),
        }];
        let job =
            |options| -> Walking<'_, D, B> { Goals::new(&equation, neighbour, &goals, options) };
        let [full, brief] = [&closely, &briefly].map(|options| named(name, options));
        let [many, few] = [true, false].map(check::walks);
        let main = job(closely);
        if !self.generator(&full, main, many, floors) {
            return;
        }
        let xoshiro = main.with_generator::<Xoshiro256PlusPlus>();
        self.generator(&full, xoshiro, few, floors);
        self.generator(&brief, job(briefly), few, floors);
        // In batches of a third, so that there is something to merge.
        let in_thirds =
            |job: &dyn Job, walks: u64| check::run_in_batches(job, walks, walks.div_ceil(3));
        let statistics = check::statistics(&main, REPLAYED, in_thirds);
        self.push("statistics", &full, statistics);
        for all in check::run(&main, REPLAYED) {
            for estimate in [all.plain(), all.control(), all.preconditioned()] {
                self.push("statistics", &full, check::error_bar(&estimate, REPLAYED));
            }
        }
        // One neighbour equation is enough for the error bars.
        if !self.covered {
            let options = (0..check::COVERAGE_SEEDS).map(|s| WalkOptions {
                seed: self.seed + 1000 * s,
                ..closely
            });
            let runs: Vec<_> = options
                .map(|options| check::run(&job(options), COVERAGE))
                .collect();
            self.coverage(&full, &runs);
        }
        self.covered = true;
        let trace = check::trace(full, &main, REPLAYED, floors[0]);
        self.report.traces.push(trace);
    }

    fn channels(&self) -> usize {
        Equation::channels(self.description.equation())
    }

    /// What rounding leaves of each channel's mean, from v in all points.
    fn floors(&self, values: &[WideOf<D::Equation>]) -> Vec<f64> {
        let floor = |channel: usize| {
            let sizes = values.iter().map(|v| v.get(channel).abs());
            let largest = sizes.fold(0.0, f64::max);
            let exact = self.exact.as_ref().map(|exact| exact.get(channel).abs());
            let size = exact.map_or(largest, |u| u.max(largest));
            rounding_floor::<ScalarOf<D, B>>(largest, size, self.norm)
        };
        (0..self.channels()).map(floor).collect()
    }

    /// Whether error bars of the first channel cover.
    fn coverage(&mut self, name: &str, runs: &[Vec<Statistics>]) {
        let covers = |exact: f64, of: fn(&Statistics) -> Estimate| {
            check::coverage(exact, |run| {
                let estimate = of(&runs[run as usize][0]);
                (estimate.estimate, estimate.std_error.unwrap_or(f64::NAN))
            })
        };
        let outcomes = match &self.exact {
            Some(u) => vec![
                covers(u.get(0), Statistics::plain),
                covers(u.get(0), Statistics::preconditioned),
            ],
            None => vec![covers(0.0, Statistics::control)],
        };
        for outcome in outcomes {
            self.push("coverage", name, outcome);
        }
    }
}

/// The mean of values, channel by channel.
fn mean<V: Value<f64>>(values: &[V]) -> Option<V> {
    let channels = values.first()?.channels();
    let sum = |channel| values.iter().map(|value| value.get(channel)).sum::<f64>();
    Some(V::from_fn(channels, |c| sum(c) / values.len() as f64))
}

/// The largest ∫|K(x,y)|dμ(y) at these points, of all channels.
fn norm<D, const B: usize>(description: &D, points: &[PointOf<D, B>]) -> f64
where
    D: Description<B, Equation: Density>,
{
    let equation = description.equation();
    let at = |x: &PointOf<D, B>| {
        let cells = 0..equation.cells();
        let nodes = cells.flat_map(|j| description.nodes(x, j));
        let sizes = nodes.map(|(y, weight)| {
            let k = Equation::kernel(equation, x, &y).largest().to_f64();
            weight * k * equation.density(x, &y).to_f64()
        });
        sizes.sum::<f64>()
    };
    points.iter().map(at).fold(0.0, f64::max)
}
