//! The neighbour equations of a problem, each checked as it is handed in.

mod chains;

use fredholm_core::galerkin::{
    Coefficients, GalerkinMatrix, PairIntegral, Pairs, Partition, Piecewise,
};
use fredholm_core::{
    DEFAULT_GENERATOR, DefaultGenerator, Estimate, Estimator, Form, Kernel, Length, Neighbour,
    NoNeighbour, Real, STEP_LIMIT, Statistics, Task, TransitionDensity, rounding_floor,
};
use rand::rngs::{ChaCha8Rng, Xoshiro256PlusPlus};

use crate::check::{self, Among};
use crate::description::{
    Description, PointOf, ScalarOf, StepDescription, StepPointOf, StepScalarOf, scalar_name,
};
use crate::galerkin::System;
use crate::outcome::{Outcome, Worst};
use crate::report::Report;
use crate::runners::{Any, Case, Generator, Walkable, runners};

/// A walk that takes so long is no walk of a test's.
const LENGTH: Length = Length {
    survivals: 0,
    step_limit: STEP_LIMIT / 10,
};

/// A described problem that offers neighbour equations to the kit.
pub trait Neighbours<const B: usize = 1>: Description<B> {
    /// Hands in every neighbour equation of the problem: each choice of pairs, its own coefficients
    /// and solution.
    fn offers(&self, offers: &mut Offers<'_, Self, B>);
}

/// An equation of steps that offers neighbour equations to the kit.
pub trait StepNeighbours<const B: usize = 1>: StepDescription<B> {
    /// Hands in every neighbour equation of the problem, by [`Offers::neighbour_by_steps`].
    fn offers(&self, offers: &mut Offers<'_, Self, B>);
}

/// Where a described problem hands in its neighbour equations; each is checked as it comes.
#[derive(Debug)]
pub struct Offers<'a, D: StepDescription<B>, const B: usize = 1> {
    description: &'a D,
    seed: u64,
    points: Among<StepPointOf<D, B>>,
    exact: Option<f64>,
    /// A bound of ∫|K(x,y)|dμ(y) below 1.
    norm: f64,
    /// The kit's own Galerkin system: an equation of steps has none.
    system: Option<System<StepScalarOf<D, B>>>,
    covered: bool,
    /// What every runner finds without a neighbour equation, by estimator and generator.
    alone: Vec<Alone>,
    report: Report,
}

/// Statistics of an estimator and of a generator, without a neighbour equation.
#[derive(Clone, Debug)]
struct Alone {
    estimator: Estimator,
    generator: &'static str,
    statistics: Statistics,
}

const ESTIMATORS: [Estimator; 2] = [Estimator::Absorption, Estimator::Collision];

/// The equation of a described problem and its chain.
type AnyEquation<'a, D, const B: usize> =
    dyn Walkable<Scalar = StepScalarOf<D, B>, Point = StepPointOf<D, B>> + Sync + 'a;
/// A neighbour equation of a described problem.
type AnyNeighbour<'a, D, const B: usize> =
    dyn Neighbour<Scalar = StepScalarOf<D, B>, Point = StepPointOf<D, B>> + Sync + 'a;

/// What walks from random points of a described problem depend on.
type Walking<'a, D, const B: usize> =
    Case<'a, Any<'a, AnyEquation<'a, D, B>>, AnyNeighbour<'a, D, B>, Among<StepPointOf<D, B>>>;

impl<'a, D: Description<B>, const B: usize> Offers<'a, D, B> {
    /// Nothing is handed in yet. What is found is added to `report`.
    pub(crate) fn new(
        description: &'a D,
        seed: u64,
        system: System<ScalarOf<D, B>>,
        report: Report,
    ) -> Self {
        let points = check::random_points(description, seed);
        // A floor needs a number below 1.
        let norm = Some(norm(description, &points)).filter(|norm| *norm < 1.0);
        let norm = norm.unwrap_or(system.radius_bound);
        Self::among(description, seed, (points, norm), Some(system), report)
    }

    /// A choice of pairs that are in S or left out. The kit makes its own coefficients for them,
    /// and spoils them: the neighbour equation holds for any.
    ///
    /// # Panics
    /// If there is a pointwise pair: see [`pointwise_pairs`](Self::pointwise_pairs).
    pub fn pairs<S: Pairs + Copy + Sync>(&mut self, name: &str, pairs: S) {
        self.check_pairs(name, &pairs);
        let tables = self.system().tables.clone();
        let g = tables.source::<S, B>(&pairs);
        self.piecewise(name, &tables.coefficients(), pairs, &tables.v, &g);
    }

    /// Offers pairs as [`pairs`](Self::pairs) does, with pairs of any kind, for a problem that has the exact integrals
    /// of pointwise ones.
    pub fn pointwise_pairs<S: Pairs + Copy + Sync>(&mut self, name: &str, pairs: S)
    where
        D::Equation: PairIntegral<B>,
    {
        self.check_pairs(name, &pairs);
        let integrals = check::pair_integrals(self.description, self.seed);
        self.push("pair integrals", name, integrals);
        let tables = self.system().tables.clone();
        let g = tables.source::<S, B>(&pairs);
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
        D::Equation: PairIntegral<B>,
        C: Coefficients<B, Scalar = ScalarOf<D, B>> + Sync,
    {
        let equation = self.description.equation();
        let neighbour =
            Piecewise::<_, _, _, _, _, B>::with_pointwise(equation, coefficients, pairs, v, g)
                .unwrap_or_else(|e| panic!("{name}: {e}"));
        self.neighbour(name, &neighbour);
    }

    /// Any neighbour equation.
    pub fn neighbour<N>(&mut self, name: &str, neighbour: &N)
    where
        N: Neighbour<Scalar = ScalarOf<D, B>, Point = PointOf<D, B>> + Sync,
    {
        self.any_neighbour(name, neighbour);
    }

    /// One type for all of them: a problem with many choices compiles in a fraction of the time.
    fn any_neighbour(&mut self, name: &str, neighbour: &AnyNeighbour<'_, D, B>) {
        let outcome = check::neighbour_equation(self.description, neighbour, self.seed);
        self.checked(name, outcome, neighbour);
    }

    /// The problem's own coefficients, which claim to be the integrals within `relative` of a row's
    /// size; 0 claims that they are exact.
    pub fn coefficients<F: Real>(
        &mut self,
        name: &str,
        coefficients: &dyn GalerkinMatrix<Scalar = F>,
        relative: f64,
    ) {
        let outcome = check::coefficients(
            self.description,
            &self.system().matrix,
            coefficients,
            relative,
        );
        self.push("coefficients", name, outcome);
    }

    /// The problem's own F'_ia, within `relative` of the largest; 0 claims that they are exact.
    pub fn source_means(&mut self, name: &str, means: &[f64], relative: f64) {
        let outcome = check::source_means(self.description, means, relative);
        self.push("source means", name, outcome);
    }

    /// The problem's own Galerkin solution, within `relative` of its largest entry of the one with
    /// exact coefficients.
    pub fn galerkin_solution(&mut self, name: &str, v: &[f64], relative: f64) {
        let outcome = check::vectors_agree::<D, B>("v", &self.system().exact, v, relative);
        self.push("Galerkin solution", name, outcome);
    }

    /// The kit's own Galerkin system.
    fn system(&self) -> &System<ScalarOf<D, B>> {
        let system = self.system.as_ref();
        system.expect("the system with which offers of a description begin")
    }

    fn check_pairs<S: Pairs>(&mut self, name: &str, pairs: &S) {
        let cells = self.description.equation().cells();
        self.push("pair lists", name, check::pair_lists(pairs, cells));
        if let Some(outcome) = check::collapse(self.description, pairs, self.seed) {
            self.push("collapse", name, outcome);
        }
    }
}

impl<'a, D: StepDescription<B>, const B: usize> Offers<'a, D, B> {
    /// Offers of an equation of steps: nothing is handed in yet.
    pub(crate) fn by_steps(description: &'a D, seed: u64, report: Report) -> Self {
        let points = check::random_points(description, seed);
        // A floor needs a number below 1.
        let norm = check::norm_by_steps(description, &points, seed).min(0.999);
        Self::among(description, seed, (points, norm), None, report)
    }

    fn among(
        description: &'a D,
        seed: u64,
        (points, norm): (Vec<StepPointOf<D, B>>, f64),
        system: Option<System<StepScalarOf<D, B>>>,
        report: Report,
    ) -> Self {
        let exact = points.iter().map(|x| description.solution(x));
        let exact: Option<Vec<f64>> = exact.collect();
        Self {
            description,
            seed,
            exact: exact.map(|values| values.iter().sum::<f64>() / values.len() as f64),
            norm,
            points: Among(points),
            system,
            covered: false,
            alone: Vec::new(),
            report,
        }
    }

    /// What was found.
    pub(crate) fn into_report(self) -> Report {
        self.report
    }

    /// Any neighbour equation of an equation of steps. Integrals over steps are means over draws.
    pub fn neighbour_by_steps<N>(&mut self, name: &str, neighbour: &N)
    where
        N: Neighbour<Scalar = StepScalarOf<D, B>, Point = StepPointOf<D, B>> + Sync,
    {
        let outcome = check::neighbour_equation_by_steps(self.description, neighbour, self.seed);
        self.checked(name, outcome, neighbour);
    }

    /// Adds what was found of a neighbour equation, and walks by it.
    fn checked(&mut self, name: &str, outcome: Outcome, neighbour: &AnyNeighbour<'_, D, B>) {
        self.push("neighbour equation", name, outcome);
        for estimator in ESTIMATORS {
            self.walks(name, neighbour, estimator);
        }
    }

    fn push(&mut self, check: &'static str, name: &str, outcome: Outcome) {
        let subject = format!("{}, {name}", scalar_name::<D, B>());
        self.report.push(check, subject, outcome);
    }

    /// Plain Monte Carlo, without any neighbour equation.
    pub(crate) fn plain(&mut self) {
        let points = self.points.clone();
        let neighbour = NoNeighbour::<D::Equation>::new();
        let equation = Any(self.description.equation() as &AnyEquation<'_, D, B>);
        for estimator in ESTIMATORS {
            let case = Case {
                equation: &equation,
                neighbour: &neighbour as &AnyNeighbour<'_, D, B>,
                functional: &points,
                control_mean: 0.0,
                estimator,
                form: Form::Product,
                length: LENGTH,
            };
            let name = &format!("plain, {estimator:?}");
            // The means are those beside the first neighbour equation.
            let whole = check::walk_all(&case.task::<DefaultGenerator>(self.seed), 1000);
            if whole.is_err() {
                return;
            }
            self.alone::<DefaultGenerator>(name, case);
            self.alone::<Xoshiro256PlusPlus>(name, case);
            self.alone::<ChaCha8Rng>(name, case);
        }
    }

    fn alone<G: Generator>(&mut self, name: &str, case: Walking<'_, D, B>) {
        let (outcome, statistics) = runners::<_, _, _, G>(case, self.seed);
        self.push("runners", &format!("{name}, {}", G::NAME), outcome);
        self.report.plain += 1;
        self.alone.push(Alone {
            estimator: case.estimator,
            generator: G::NAME,
            statistics,
        });
    }

    /// The means of a generator's walks, and the bits of all runners, of which those of the plain estimate are the
    /// same without the neighbour equation. Returns whether every walk ended.
    fn generator<G: Generator>(&mut self, name: &str, case: Walking<'_, D, B>, floor: f64) -> bool {
        let name = &format!("{name}, {}", G::NAME);
        let walks = check::walks(G::NAME == DEFAULT_GENERATOR);
        let all = match check::walk_all(&case.task::<G>(self.seed), walks) {
            Ok(all) => all,
            Err(outcome) => {
                self.push("means", name, outcome);
                return false;
            }
        };
        self.push("means", name, check::means(&all, self.exact, floor));
        let (outcome, statistics) = runners::<_, _, _, G>(case, self.seed);
        self.push("runners", name, outcome);
        self.report.preconditioned += 1;
        let mut worst = Worst::new("estimates with other bits", 0.0);
        let alone = self
            .alone
            .iter()
            .filter(|alone| (alone.estimator, alone.generator) == (case.estimator, G::NAME));
        for alone in alone {
            let [expected, found] = [&alone.statistics, &statistics].map(Statistics::plain);
            let other = f64::from(u8::from(expected != found));
            worst.add(expected.estimate, found.estimate, other, || {
                "the plain estimate beside this neighbour equation".into()
            });
        }
        self.push("runners", name, worst.outcome());
        true
    }

    /// The means of walks in the residual form, and the bits of all runners. These scores ask for v on the way, too.
    fn residual(&mut self, name: &str, case: Walking<'_, D, B>, floor: f64) {
        let name = &format!("{name}, residual form");
        let case = Case {
            form: Form::Residual,
            ..case
        };
        let walks = check::walks(false);
        let means = match check::walk_all(&case.task::<DefaultGenerator>(self.seed), walks) {
            Ok(all) => check::means(&all, self.exact, floor),
            Err(outcome) => outcome,
        };
        self.push("means", name, means);
        let (outcome, _) = runners::<_, _, _, DefaultGenerator>(case, self.seed);
        self.push("runners", name, outcome);
    }

    fn walks(&mut self, name: &str, neighbour: &AnyNeighbour<'_, D, B>, estimator: Estimator) {
        const REPLAYED: u64 = 2000;
        const COVERAGE: u64 = 400;
        let points = self.points.clone();
        let values = points
            .0
            .iter()
            .map(|&x| neighbour.value(&neighbour.locate(x)).to_f64());
        let values: Vec<f64> = values.collect();
        let value = values.iter().sum::<f64>() / values.len() as f64;
        let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let size = self.exact.map_or(largest, |u| u.abs().max(largest));
        let floor = rounding_floor::<StepScalarOf<D, B>>(largest, size, self.norm);
        let equation = Any(self.description.equation() as &AnyEquation<'_, D, B>);
        let case = Case {
            equation: &equation,
            neighbour,
            functional: &points,
            control_mean: value,
            estimator,
            form: Form::Product,
            length: LENGTH,
        };
        let task = |seed| case.task::<DefaultGenerator>(seed);
        let name = &format!("{name}, {estimator:?}");
        if !self.generator::<DefaultGenerator>(name, case, floor) {
            return;
        }
        self.generator::<Xoshiro256PlusPlus>(name, case, floor);
        self.generator::<ChaCha8Rng>(name, case, floor);
        self.residual(name, case, floor);
        let trace = check::trace(name.clone(), &task(self.seed), REPLAYED, floor);
        // In batches of a third, so that there is something to merge.
        let in_thirds = |task: &Task<'_, _, _, _, _>, walks: u64| {
            let mut all = Statistics::default();
            for index in 0..3 {
                let mut batch = fredholm_core::Batch::new(index, walks.div_ceil(3), walks);
                batch.run(task, u64::MAX).expect("finite scores");
                all.merge(batch.statistics());
            }
            all
        };
        let statistics = check::statistics(&task(self.seed), REPLAYED, in_thirds);
        let all = check::run(&task(self.seed), REPLAYED);
        let bars = [all.plain(), all.control(), all.preconditioned()]
            .map(|estimate| check::error_bar(&estimate, REPLAYED));
        self.push("statistics", name, statistics);
        for bar in bars {
            self.push("statistics", name, bar);
        }
        // One neighbour equation is enough for the error bars.
        if !self.covered {
            let seeds = check::COVERAGE_SEEDS;
            let runs = (0..seeds).map(|s| check::run(&task(self.seed + 1000 * s), COVERAGE));
            let runs: Vec<Statistics> = runs.collect();
            let covers = |exact: f64, of: fn(&Statistics) -> Estimate| {
                check::coverage(exact, |run| {
                    let estimate = of(&runs[run as usize]);
                    (estimate.estimate, estimate.std_error.unwrap_or(f64::NAN))
                })
            };
            let outcomes = match self.exact {
                Some(u) => vec![
                    covers(u, Statistics::plain),
                    covers(u, Statistics::preconditioned),
                ],
                None => vec![covers(0.0, Statistics::control)],
            };
            for outcome in outcomes {
                self.push("coverage", name, outcome);
            }
        }
        self.covered = true;
        self.report.traces.push(trace);
    }
}

/// The largest ∫|K(x,y)|dμ(y) at these points.
fn norm<D: Description<B>, const B: usize>(description: &D, points: &[PointOf<D, B>]) -> f64 {
    let equation = description.equation();
    let at = |x: &PointOf<D, B>| {
        let cells = 0..equation.cells();
        let nodes = cells.flat_map(|j| description.nodes(x, j));
        nodes
            .map(|(y, weight)| {
                let k = Kernel::kernel(equation, x, &y).to_f64().abs();
                weight * k * equation.density(x, &y).to_f64()
            })
            .sum::<f64>()
    };
    points.iter().map(at).fold(0.0, f64::max)
}
