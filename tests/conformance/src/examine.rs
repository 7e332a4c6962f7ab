//! All checks of a problem in one call, and their table.

use core::fmt;

use fredholm_core::galerkin::{
    Coefficients, GalerkinMatrix, PairIntegral, Pairs, Partition, Piecewise,
};
use fredholm_core::{
    DEFAULT_GENERATOR, DefaultGenerator, Estimate, Estimator, Kernel, Neighbour, NoNeighbour, Real,
    STEP_LIMIT, StateSpace, Statistics, Task, TransitionDensity, rounding_floor,
};
use rand::rngs::{ChaCha8Rng, Xoshiro256PlusPlus};

use crate::check::{self, Among, Trace};
use crate::description::{Description, PointOf, ScalarOf};
use crate::galerkin::System;
use crate::outcome::{Outcome, Worst};
use crate::runners::{Any, Case, Generator, Walkable, runners};

mod chains;

/// Every check, in the order of the table: what to mend first stands first.
pub const CHECKS: [&str; 25] = [
    "cells",
    "steps' cells",
    "measures",
    "uniform points",
    "basis",
    "density",
    "moments",
    "masses",
    "chi-squared",
    "distribution",
    "preserved density",
    "suffix starts",
    "solution",
    "constant",
    "coefficients",
    "source means",
    "Galerkin solution",
    "pair lists",
    "collapse",
    "pair integrals",
    "neighbour equation",
    "means",
    "runners",
    "statistics",
    "coverage",
];

/// The check that compares the reports of two scalars.
pub const SCALARS: &str = "f32 and f64";

/// What a check found, and of what.
#[derive(Clone, Debug)]
pub struct Row {
    /// The name of the check, one of [`CHECKS`] or [`SCALARS`].
    pub check: &'static str,
    /// The scalar and, where it matters, the neighbour equation.
    pub subject: String,
    /// The worst comparison of the check.
    pub outcome: Outcome,
}

/// What all checks of a problem found. It is displayed as a table (check, verdict, distance,
/// allowed).
#[derive(Clone, Debug, Default)]
pub struct Report {
    rows: Vec<Row>,
    traces: Vec<Trace>,
    plain: u64,
    preconditioned: u64,
}

impl Report {
    /// Adds what a check found.
    pub fn push(&mut self, check: &'static str, subject: impl Into<String>, outcome: Outcome) {
        self.rows.push(Row {
            check,
            subject: subject.into(),
            outcome,
        });
    }

    /// All rows.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// What failed.
    pub fn failures(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| !row.outcome.passed())
    }

    /// The row of a check that is nearest to failing or furthest beyond. `None`: the problem offers
    /// nothing to check.
    #[must_use]
    pub fn worst(&self, check: &str) -> Option<&Row> {
        let rows = self.rows.iter().filter(|row| row.check == check);
        let badness = |row: &Row| {
            let outcome = &row.outcome;
            if outcome.passed() {
                outcome.distance / outcome.allowed.max(f64::MIN_POSITIVE)
            } else {
                f64::INFINITY
            }
        };
        rows.max_by(|a, b| badness(a).total_cmp(&badness(b)))
    }

    /// How many cases of scalar, estimator and generator walked without a neighbour equation, and how many of
    /// scalar, neighbour equation, estimator and generator with one; each by every runner.
    #[must_use]
    pub const fn cases(&self) -> [u64; 2] {
        [self.plain, self.preconditioned]
    }

    /// Adds the rows and cases of another report; its walks are forgotten.
    pub fn extend(&mut self, other: Self) {
        self.rows.extend(other.rows);
        self.plain += other.plain;
        self.preconditioned += other.preconditioned;
    }

    /// Nothing, unless a check failed.
    ///
    /// # Panics
    /// With the table and every failure.
    pub fn assert_passed(&self, problem: &str) {
        let failures: Vec<String> = self
            .failures()
            .map(|row| format!("{} [{}]: {}", row.check, row.subject, row.outcome))
            .collect();
        assert!(
            failures.is_empty(),
            "{problem}\n{self}\n{}",
            failures.join("\n")
        );
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:20} {:11} {:>10} {:>8}  unit",
            "check", "verdict", "distance", "allowed"
        )?;
        for check in CHECKS.into_iter().chain([SCALARS]) {
            let Some(Row { outcome, .. }) = self.worst(check) else {
                writeln!(f, "{check:20} not offered")?;
                continue;
            };
            let verdict = if outcome.passed() { "passed" } else { "FAILED" };
            let (distance, allowed) = (outcome.distance, outcome.allowed);
            writeln!(
                f,
                "{check:20} {verdict:11} {distance:10.3e} {allowed:8}  {}",
                outcome.unit
            )?;
        }
        Ok(())
    }
}

/// Runs every check that applies to a problem. `seed` decides at which points and by which walks.
#[must_use]
pub fn examine<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let scalar = scalar_name::<D, B>();
    let mut report = Report::default();
    report.push("cells", scalar, check::cells(description, seed));
    report.push(
        "steps' cells",
        scalar,
        check::sampler_points(description, seed),
    );
    for (name, outcome) in [
        ("measures", check::measures(description, seed)),
        ("uniform points", check::uniform_points(description, seed)),
    ] {
        if let Some(outcome) = outcome {
            report.push(name, scalar, outcome);
        }
    }
    report.push("basis", scalar, check::basis(description, seed));
    report.push("density", scalar, check::density(description, seed));
    report.push("moments", scalar, check::moments(description, seed));
    for (name, outcome) in [
        ("masses", check::masses(description, seed)),
        ("chi-squared", check::sampler(description, seed)),
        ("distribution", check::distribution(description, seed)),
        ("solution", check::solution(description, seed)),
    ] {
        if let Some(outcome) = outcome {
            report.push(name, scalar, outcome);
        }
    }
    let system = match System::<ScalarOf<D, B>>::new(description) {
        Ok(system) => system,
        Err(error) => {
            let outcome = Outcome::refused(format!("the Galerkin system: {error}"));
            report.push("neighbour equation", scalar, outcome);
            return report;
        }
    };
    let constant = check::constant(description, &system.exact, system.radius_bound);
    if let Some(outcome) = constant {
        report.push("constant", scalar, outcome);
    }
    let points = check::random_points(description, seed);
    let exact = points.iter().map(|x| description.solution(x));
    let exact: Option<Vec<f64>> = exact.collect();
    let mut offers = Offers {
        description,
        seed,
        exact: exact.map(|values| values.iter().sum::<f64>() / values.len() as f64),
        // A floor needs a number below 1.
        norm: Some(norm(description, &points))
            .filter(|norm| *norm < 1.0)
            .unwrap_or(system.radius_bound),
        points: Among(points),
        system,
        covered: false,
        alone: Vec::new(),
        report,
    };
    offers.plain();
    description.offers(&mut offers);
    offers.report
}

/// Report as of [`examine`], but only what asks for no table of all pairs of cells: where cells are found,
/// and the accuracy of masses relative to their own size. For very many cells.
#[must_use]
pub fn examine_masses<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let scalar = scalar_name::<D, B>();
    let mut report = Report::default();
    report.push("cells", scalar, check::cells(description, seed));
    report.push(
        "steps' cells",
        scalar,
        check::sampler_points(description, seed),
    );
    if let Some(outcome) = check::masses(description, seed) {
        report.push("masses", scalar, outcome);
    }
    report
}

/// [`examine`] of a problem in f32 and in f64, and whether their walks agree.
#[must_use]
pub fn examine_both<N, W, const B: usize>(narrow: &N, wide: &W, seed: u64) -> Report
where
    N: Description<B, Equation: StateSpace<Scalar = f32>>,
    W: Description<B, Equation: StateSpace<Scalar = f64>>,
{
    let (mut report, other) = (examine(wide, seed), examine(narrow, seed));
    let pairs = other.traces.iter().zip(&report.traces);
    let agreement: Vec<_> = pairs
        .filter(|(narrow, wide)| narrow.name == wide.name)
        .map(|(narrow, wide)| (narrow.name.clone(), check::scalars(narrow, wide)))
        .collect();
    for (name, outcome) in agreement {
        report.push(SCALARS, name, outcome);
    }
    report.extend(other);
    report
}

fn scalar_name<D: Description<B>, const B: usize>() -> &'static str {
    // The two scalars that there are.
    if ScalarOf::<D, B>::EPSILON.to_f64() > 1e-10 {
        "f32"
    } else {
        "f64"
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

/// Where a description hands in its neighbour equations; each is checked as it comes.
#[derive(Debug)]
pub struct Offers<'a, D: Description<B>, const B: usize = 1> {
    description: &'a D,
    seed: u64,
    points: Among<PointOf<D, B>>,
    exact: Option<f64>,
    norm: f64,
    system: System<ScalarOf<D, B>>,
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
    dyn Walkable<Scalar = ScalarOf<D, B>, Point = PointOf<D, B>> + Sync + 'a;
/// A neighbour equation of a described problem.
type AnyNeighbour<'a, D, const B: usize> =
    dyn Neighbour<Scalar = ScalarOf<D, B>, Point = PointOf<D, B>> + Sync + 'a;

/// What walks from random points of a described problem depend on.
type Walking<'a, D, const B: usize> =
    Case<'a, Any<'a, AnyEquation<'a, D, B>>, AnyNeighbour<'a, D, B>, Among<PointOf<D, B>>>;

impl<D: Description<B>, const B: usize> Offers<'_, D, B> {
    /// A choice of pairs that are in S or left out. The kit makes its own coefficients for them,
    /// and spoils them: the neighbour equation holds for any.
    ///
    /// # Panics
    /// If there is a pointwise pair: see [`pointwise_pairs`](Self::pointwise_pairs).
    pub fn pairs<S: Pairs + Copy + Sync>(&mut self, name: &str, pairs: S) {
        self.check_pairs(name, &pairs);
        let tables = self.system.tables.clone();
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
        let tables = self.system.tables.clone();
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
        self.push("neighbour equation", name, outcome);
        for estimator in ESTIMATORS {
            self.walks(name, neighbour, estimator);
        }
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
            &self.system.matrix,
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
        let outcome = check::vectors_agree::<D, B>("v", &self.system.exact, v, relative);
        self.push("Galerkin solution", name, outcome);
    }

    fn push(&mut self, check: &'static str, name: &str, outcome: Outcome) {
        let subject = format!("{}, {name}", scalar_name::<D, B>());
        self.report.push(check, subject, outcome);
    }

    fn check_pairs<S: Pairs>(&mut self, name: &str, pairs: &S) {
        let cells = self.description.equation().cells();
        self.push("pair lists", name, check::pair_lists(pairs, cells));
        if let Some(outcome) = check::collapse(self.description, pairs, self.seed) {
            self.push("collapse", name, outcome);
        }
    }

    /// Plain Monte Carlo, without any neighbour equation.
    fn plain(&mut self) {
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
                step_limit: STEP_LIMIT / 10,
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
        let floor = rounding_floor::<ScalarOf<D, B>>(largest, size, self.norm);
        let equation = Any(self.description.equation() as &AnyEquation<'_, D, B>);
        let case = Case {
            equation: &equation,
            neighbour,
            functional: &points,
            control_mean: value,
            estimator,
            step_limit: STEP_LIMIT / 10,
        };
        let task = |seed| case.task::<DefaultGenerator>(seed);
        let name = &format!("{name}, {estimator:?}");
        if !self.generator::<DefaultGenerator>(name, case, floor) {
            return;
        }
        self.generator::<Xoshiro256PlusPlus>(name, case, floor);
        self.generator::<ChaCha8Rng>(name, case, floor);
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
