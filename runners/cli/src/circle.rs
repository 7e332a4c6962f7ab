//! A circle from its file to statistics: set-up, targets, walks.

use core::f64::consts::TAU;
use core::fmt::Display;
use std::time::Instant;

use fredholm_circle::{
    Arcs, Circle, CircleLevel, Emission, Harmonic, MeanOver, Moment, Point, Polynomials, Residual,
    Tables, neighbour_second_moment_radius, residual_moments, second_moment_radius,
};
use fredholm_core::galerkin::{
    Basis, GalerkinMatrix, OffDiagonal, PairKind, PairTable, Piecewise, Solution, Solve,
};
use fredholm_core::variance::{self, Density, Level, Setting, Terms};
use fredholm_core::{At, Functional, Located, Neighbour, NoNeighbour, Real, Uniforms};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_rayon::{Observer, Outcome, Plan, RunError, Target, run};

use crate::diagnose::{Begin, Diagnosis, Request, Subject};
use crate::export;
use crate::failure::Failure;
use crate::file::{self, Galerkin, Pairs, Placed, ProblemFile, Scalar, What};
use crate::problem::{
    Answer, Asked, Cost, Known, PointwisePairs, Problem, Solved, WalkCost, Where, asked, floors,
    infinite_variance,
};
use crate::progress::{Progress, begin_walking};
use crate::solve::plan;
use crate::theory::{self, AnyPairs, PairCounts};

/// The relative residual at which the Gauss–Seidel iteration stops. An unconverged solution costs
/// variance and nothing else.
const TOLERANCE: f64 = 1e-14;
/// Sweeps enough for reflectances up to 0.99.
const SWEEPS: u32 = 1000;

/// Cells enough to estimate a spectral radius.
const COARSE: usize = 200;

/// No light.
const DARK: Light<'static> = Light::Harmonic(Harmonic {
    constant: 0.0,
    amplitude: 0.0,
    frequency: 1,
});

/// The light of a file.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Light<'a> {
    /// The emission (57), whose solution is known.
    Harmonic(Harmonic),
    /// Piecewise constant.
    Arcs(Arcs<'a>),
}

impl<F: Real> Emission<F> for Light<'_> {
    #[inline]
    fn emission(&self, x: &Point<F>, reflectance: F) -> F {
        match self {
            Self::Harmonic(light) => light.emission(x, reflectance),
            Self::Arcs(light) => light.emission(x, reflectance),
        }
    }

    fn cell_mean(&self, i: usize, cells: usize, reflectance: f64) -> f64 {
        match self {
            Self::Harmonic(light) => Emission::<F>::cell_mean(light, i, cells, reflectance),
            Self::Arcs(light) => Emission::<F>::cell_mean(light, i, cells, reflectance),
        }
    }

    fn validate(&self, cells: usize) -> Result<(), fredholm_circle::CircleError> {
        match self {
            Self::Harmonic(light) => Emission::<F>::validate(light, cells),
            Self::Arcs(light) => Emission::<F>::validate(light, cells),
        }
    }
}

/// A circle and its partition, before anything is computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene<'a> {
    /// ρ on equal arcs.
    pub(crate) reflectance: &'a [f64],
    /// F.
    pub(crate) light: Light<'a>,
    /// n.
    pub(crate) cells: usize,
    /// q0.
    pub(crate) absorption: f64,
    /// Which pairs the neighbour equation treats how.
    pub(crate) pairs: Pairs,
    /// The degree of the polynomials on a cell.
    pub(crate) degree: usize,
}

/// An expression in which the number of functions per cell of a degree is a constant of this name.
macro_rules! of_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            1 => of_degree!(2 as $name => $then),
            2 => of_degree!(3 as $name => $then),
            3 => of_degree!(4 as $name => $then),
            // Validation lets nothing above 4 pass, and 0 has its own way.
            _ => of_degree!(5 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Question {
    /// u at an angle.
    At(f64),
    /// The mean of u over an interval of angles.
    Over(f64, f64),
}

/// The tables of a scene: all that is computed before the walks.
#[derive(Debug)]
pub(crate) struct Setup<'a, F> {
    pub(crate) scene: Scene<'a>,
    pub(crate) tables: Tables<F>,
    pub(crate) v: Vec<F>,
    pub(crate) source: NeighbourSource<F>,
    /// How the Gauss–Seidel iteration went.
    pub(crate) solve: Solve<f64>,
    /// max ρ.
    pub(crate) contraction: f64,
    /// Seconds that it took.
    pub(crate) seconds: f64,
}

/// The tables of the coefficients, and the Galerkin solution of B functions per cell.
#[derive(Debug)]
struct System {
    tables: Tables<f64>,
    solution: Solution,
}

/// G as the neighbour equation of these pairs has it.
#[derive(Debug)]
pub(crate) enum NeighbourSource<F> {
    /// G over S.
    Table(OffDiagonal, Vec<F>),
    /// The kinds of all pairs, and G over S.
    Kinds(Vec<u8>, Vec<F>),
    /// All pairs are pointwise.
    ClosedForm(Vec<Moment<F>>),
}

impl<'a, F: Real> Setup<'a, F> {
    /// Solves the Galerkin system of the scene in f64 and rounds what the walks need.
    pub(crate) fn new(scene: Scene<'a>) -> Result<Self, Failure> {
        Self::of(scene, &scene.solve()?, None)
    }

    /// Of a solved system, with these kinds of all pairs if there are some.
    fn of(scene: Scene<'a>, solved: &Solved, kinds: Option<&[u8]>) -> Result<Self, Failure> {
        let start = Instant::now();
        let mut setup = match scene.degree {
            0 => {
                let System { tables, solution } = solved.system::<System>()?;
                let circle = scene.circle(tables)?;
                let residual = || residual_moments(&circle, solution).map_err(Failure::run);
                Self::of_solution(scene, kinds, &circle, solution, residual)?
            }
            degree => of_degree!(degree, B => {
                let System { tables, solution } = solved.system::<System>()?;
                let circle = scene.circle(tables)?;
                let polynomials = Polynomials::<_, _, B>::new(&circle);
                let residual = || residual_moments(&polynomials, solution).map_err(Failure::run);
                Self::of_solution(scene, kinds, &polynomials, solution, residual)?
            }),
        };
        setup.seconds = solved.seconds + start.elapsed().as_secs_f64();
        Ok(setup)
    }

    fn of_solution(
        scene: Scene<'a>,
        kinds: Option<&[u8]>,
        coefficients: &dyn GalerkinMatrix<Scalar = f64>,
        solution: &Solution,
        residual: impl FnOnce() -> Result<Vec<Moment<F>>, Failure>,
    ) -> Result<Self, Failure> {
        let source = match (kinds, scene.diagonal()) {
            (Some(table), _) => {
                let pairs = PairTable::new(table, scene.cells).map_err(Failure::run)?;
                let g = solution.source(coefficients, &pairs);
                NeighbourSource::Kinds(table.to_vec(), g.map_err(Failure::run)?)
            }
            (None, Some(diagonal)) => {
                let pairs = OffDiagonal { diagonal };
                let g = solution.source(coefficients, &pairs);
                NeighbourSource::Table(pairs, g.map_err(Failure::run)?)
            }
            (None, None) => NeighbourSource::ClosedForm(residual()?),
        };
        Ok(Self {
            scene,
            tables: Tables::new(scene.reflectance, scene.cells).map_err(Failure::input)?,
            v: solution.rounded().map_err(Failure::run)?,
            source,
            solve: solution.solve,
            contraction: solution.contraction,
            seconds: 0.0,
        })
    }

    /// The deterministic part of the answers.
    pub(crate) fn known(&self, questions: &[Question]) -> Result<Vec<Known>, Failure> {
        let circle = self.scene.circle(&self.tables)?;
        questions
            .iter()
            .map(|question| self.known_of(&circle, question))
            .collect()
    }

    fn known_of(
        &self,
        circle: &Circle<'_, F, Light<'_>>,
        question: &Question,
    ) -> Result<Known, Failure> {
        let galerkin = match *question {
            Question::At(s) if self.scene.degree > 0 => {
                of_degree!(self.scene.degree, B => self.value::<B>(circle, s))
            }
            Question::At(s) => {
                let cell = circle.point(s).cell();
                self.v.get(cell).map_or(f64::NAN, |v| v.to_f64())
            }
            Question::Over(from, to) => {
                let mean = MeanOver::new(circle, from, to).map_err(Failure::input)?;
                mean.of(&self.v)
            }
        };
        Ok(Known {
            exact: self.scene.exact(question),
            galerkin,
        })
    }

    /// v at an angle, of B functions per cell.
    fn value<const B: usize>(&self, circle: &Circle<'_, F, Light<'_>>, s: f64) -> f64 {
        let point = circle.point(s);
        let cell = point.cell();
        let psi: [F; B] = Polynomials::new(circle).basis(&Located { point, cell });
        let v = self.v.iter().skip(cell * B);
        let sum = v.zip(psi).fold(F::zero(), |sum, (&v, psi)| sum + v * psi);
        sum.to_f64()
    }

    /// With the neighbour equation in f64 as one type for all degrees and pairs.
    fn boxed<R>(
        &self,
        circle: &Circle<'_, F, Light<'_>>,
        then: impl FnOnce(&Boxed<'_, F>) -> R,
    ) -> Result<R, Failure> {
        if self.scene.degree > 0 {
            return of_degree!(self.scene.degree, B => {
                let polynomials = Polynomials::<_, _, B>::new(circle);
                Ok(then(&*self.neighbour_of_degree(&polynomials)?))
            });
        }
        Ok(match &self.source {
            NeighbourSource::Table(pairs, g) => then(
                &Piecewise::with_pointwise(circle, circle, *pairs, &self.v, g)
                    .map_err(Failure::run)?,
            ),
            NeighbourSource::Kinds(table, g) => {
                let pairs = PairTable::new(table, self.scene.cells).map_err(Failure::run)?;
                then(
                    &Piecewise::with_pointwise(circle, circle, pairs, &self.v, g)
                        .map_err(Failure::run)?,
                )
            }
            NeighbourSource::ClosedForm(moments) => {
                then(&Residual::new(circle, &self.v, moments).map_err(Failure::run)?)
            }
        })
    }

    /// The kinds of pairs; with all pairs pointwise none is left out.
    fn pairs(&self) -> Result<AnyPairs<'_>, Failure> {
        Ok(match &self.source {
            NeighbourSource::Table(pairs, _) => AnyPairs::Diagonal(*pairs),
            NeighbourSource::Kinds(table, _) => {
                AnyPairs::Table(PairTable::new(table, self.scene.cells).map_err(Failure::run)?)
            }
            NeighbourSource::ClosedForm(_) => AnyPairs::Diagonal(OffDiagonal {
                diagonal: PairKind::Pointwise,
            }),
        })
    }

    /// Walks.
    pub(crate) fn run(
        &self,
        questions: &[Question],
        known: &[Known],
        plan: &Plan,
        observer: &impl Observer,
    ) -> Result<Outcome, Failure> {
        let circle = self.scene.circle(&self.tables)?;
        let degree = self.scene.degree;
        match &self.source {
            _ if degree > 0 => self.boxed(&circle, |neighbour| {
                walk(&circle, neighbour, questions, known, plan, observer)
            })?,
            NeighbourSource::Kinds(..) => self.boxed(&circle, |neighbour| {
                walk(&circle, neighbour, questions, known, plan, observer)
            })?,
            NeighbourSource::Table(pairs, g) => {
                let neighbour = Piecewise::with_pointwise(&circle, &circle, *pairs, &self.v, g)
                    .map_err(Failure::run)?;
                walk(&circle, &neighbour, questions, known, plan, observer)
            }
            NeighbourSource::ClosedForm(moments) => {
                let neighbour = Residual::new(&circle, &self.v, moments).map_err(Failure::run)?;
                walk(&circle, &neighbour, questions, known, plan, observer)
            }
        }
    }
}

/// A neighbour equation of any kind: one type of walk for all degrees.
type Boxed<'a, F> = dyn Neighbour<Scalar = F, Point = Point<F>> + Sync + 'a;

impl<F: Real> Setup<'_, F> {
    fn neighbour_of_degree<'s, const B: usize>(
        &'s self,
        polynomials: &'s Polynomials<'s, 's, F, Light<'s>, B>,
    ) -> Result<Box<Boxed<'s, F>>, Failure> {
        Ok(match &self.source {
            NeighbourSource::Table(pairs, g) => Box::new(
                Piecewise::with_pointwise(polynomials, polynomials, *pairs, &self.v, g)
                    .map_err(Failure::run)?,
            ),
            NeighbourSource::Kinds(table, g) => {
                let pairs = PairTable::new(table, self.scene.cells).map_err(Failure::run)?;
                Box::new(
                    Piecewise::with_pointwise(polynomials, polynomials, pairs, &self.v, g)
                        .map_err(Failure::run)?,
                )
            }
            NeighbourSource::ClosedForm(moments) => {
                Box::new(Residual::new(polynomials, &self.v, moments).map_err(Failure::run)?)
            }
        })
    }
}

impl<'a> Scene<'a> {
    /// Solves its Galerkin system: a [`System`] of as many functions on a cell as the degree has.
    fn solve(&self) -> Result<Solved, Failure> {
        match self.degree {
            0 => Solved::new(|| self.system(|circle| circle.solve(TOLERANCE, SWEEPS))),
            degree => of_degree!(degree, B => Solved::new(|| self.system(|circle| {
                Polynomials::<_, _, B>::new(circle).solve(TOLERANCE, SWEEPS)
            }))),
        }
    }

    fn system<E: Display>(
        &self,
        solve: impl FnOnce(&Circle<'_, f64, Light<'a>>) -> Result<Solution, E>,
    ) -> Result<System, Failure> {
        let tables = Tables::new(self.reflectance, self.cells).map_err(Failure::input)?;
        let solution = solve(&self.circle(&tables)?).map_err(Failure::run)?;
        Ok(System { tables, solution })
    }

    /// (u, Φ), where it is known.
    fn exact(&self, question: &Question) -> Option<f64> {
        match self.light {
            Light::Harmonic(light) => Some(match *question {
                Question::At(s) => light.solution(s),
                Question::Over(from, to) => light.mean(from, to),
            }),
            Light::Arcs(_) => None,
        }
    }

    /// The kind of the diagonal's pairs; `None`: all pairs are pointwise.
    fn diagonal(&self) -> Option<PairKind> {
        match self.pairs {
            Pairs::Paper => Some(PairKind::None),
            // From the theory the diagonal is pointwise too where that matters.
            Pairs::Default | Pairs::Theory => Some(PairKind::Pointwise),
            Pairs::Pointwise => None,
        }
    }

    /// The estimated spectral radius of T_h²p: no less than that of T_k²p by which it is multiplied where
    /// cells are too few for the degree.
    fn neighbour_second_moment<const B: usize>(&self) -> Result<f64, Failure> {
        let Some(diagonal) = self.diagonal() else {
            // h = k.
            return Ok(0.0);
        };
        // More cells only bring h nearer to k.
        let arcs = self.reflectance.len();
        let cells = self.cells.min(COARSE.next_multiple_of(arcs));
        let tables = Tables::<f64>::new(self.reflectance, cells).map_err(Failure::input)?;
        let circle = Circle::new(tables.cells(), DARK, self.absorption).map_err(Failure::input)?;
        let polynomials = Polynomials::<_, _, B>::new(&circle);
        neighbour_second_moment_radius(&polynomials, &OffDiagonal { diagonal })
            .map_err(Failure::run)
    }

    fn circle<'t, F: Real>(
        &self,
        tables: &'t Tables<F>,
    ) -> Result<Circle<'t, F, Light<'a>>, Failure> {
        Circle::new(tables.cells(), self.light, self.absorption).map_err(Failure::input)
    }

    /// The estimated spectral radius of T_k²p: walks have an infinite variance unless it is below 1.
    pub(crate) fn second_moment(&self) -> Result<f64, Failure> {
        let largest = self.reflectance.iter().copied().fold(0.0, f64::max);
        let bound = largest * largest / (1.0 - self.absorption);
        if bound < 1.0 {
            return Ok(bound);
        }
        // k is constant on arcs: a coarse partition of them shows what a fine one would.
        let arcs = self.reflectance.len();
        let tables = Tables::<f64>::new(self.reflectance, COARSE.next_multiple_of(arcs))
            .map_err(Failure::input)?;
        let circle = Circle::new(tables.cells(), DARK, self.absorption).map_err(Failure::input)?;
        Ok(second_moment_radius(&circle))
    }
}

/// Bytes of the tables of so many cells of a degree, at their largest.
fn memory<F: Real>(cells: usize, degree: usize) -> usize {
    let size = size_of::<F>();
    let functions = degree + 1;
    // Tables of 9 numbers a cell in f64 for the set-up, with F', v, G and a copy of v; then the
    // walk's own with v and G or two moments.
    let setup = 9 * 8 + functions * (4 * 8 + 2 * size) + size;
    let walk = 9 * size + functions * 2 * size + size + 8;
    cells.saturating_mul(setup.max(walk))
}

fn walk<'c, F: Real, E: Emission<F> + Sync, N>(
    circle: &Circle<'c, F, E>,
    neighbour: &N,
    questions: &[Question],
    known: &[Known],
    plan: &Plan,
    observer: &impl Observer,
) -> Result<Outcome, Failure>
where
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync + ?Sized,
{
    let mut targets = Vec::with_capacity(questions.len());
    for (question, known) in questions.iter().zip(known) {
        let functional = match *question {
            Question::At(s) => Start::Point(At(circle.point(s))),
            Question::Over(from, to) => {
                Start::Mean(MeanOver::new(circle, from, to).map_err(Failure::input)?)
            }
        };
        targets.push(Target {
            functional,
            neighbour_value: Some(known.galerkin),
        });
    }
    begin_walking();
    run(circle, neighbour, &targets, plan, observer).map_err(|error| match error {
        RunError::NotFinite { .. } => Failure::run(error),
        _ => Failure::input(error),
    })
}

/// Where walks start.
enum Start<'a, 'c, F, E> {
    Point(At<Point<F>>),
    Mean(MeanOver<'a, 'c, F, E>),
}

impl<F: Real, E: Emission<F>> Functional<Circle<'_, F, E>> for Start<'_, '_, F, E> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        match self {
            Self::Point(At(x)) => (*x, F::one()),
            Self::Mean(mean) => mean.start(uniforms),
        }
    }
}

/// The mean over an arc, by the nodes in it.
fn uniform_on<L: Level<Point = Point<f64>>>(
    place: &Where,
    level: &L,
) -> impl Fn(&Point<f64>) -> Density + use<L> {
    let (from, to) = match *place {
        Where::Arc(from, to) => (from, to),
        _ => (0.0, TAU),
    };
    let inside = move |x: &Point<f64>| (from..=to).contains(&x.angle());
    let mut measure = 0.0;
    for site in 0..level.sites() {
        level.nodes(site, |x, weight| {
            measure += if inside(&x) { weight } else { 0.0 }
        });
    }
    move |x| {
        if inside(x) {
            Density::uniform(measure)
        } else {
            Density::nothing()
        }
    }
}

/// Cells where the file has none: the first number from here on that fits the arcs.
const DEFAULT_CELLS: usize = 100;
/// Seconds of the set-up for a cell, and for every function on it besides the constant one; on the machine
/// that this and what follows was measured on.
const CELL: f64 = 0.8e-6;
const FUNCTION: f64 = 0.7e-6;
/// Plain walks.
const PLAIN: WalkCost = WalkCost {
    start: 15e-9,
    step: 15e-9,
    score: 15e-9,
    pair: 0.0,
    hidden_pair: 0.0,
};

/// A circle of a file.
#[derive(Clone, Debug)]
pub(crate) struct CircleFile<'f> {
    file: &'f ProblemFile,
    circle: &'f file::Circle,
    reflectance: Vec<f64>,
    emission: Vec<f64>,
    /// The number of cells is a multiple of this.
    unit: usize,
    cells: usize,
    asked: Vec<Asked>,
}

impl<'f> CircleFile<'f> {
    /// The circle of this file.
    pub(crate) fn new(file: &'f ProblemFile, circle: &'f file::Circle) -> Result<Self, Failure> {
        let Galerkin { degree, pairs, .. } = &file.galerkin;
        if degree.value > 0 && pairs.value == Pairs::Paper {
            // A sample without a step within a cell looks as if there were no variance left.
            let message = "\"paper\" leaves steps within a cell out: with a `degree` above 0 they are what is \
                           left of the variance, and so rare that error bars would miss them; use \
                           \"default\"";
            return Err(file.refuse(pairs, message).into());
        }
        let values = |array: &[Placed<f64>]| array.iter().map(|value| value.value).collect();
        let arcs = circle.reflectance.value.len();
        let (emission, unit) = match &circle.emission {
            file::Emission::Harmonic { .. } => (Vec::new(), arcs),
            file::Emission::Arcs(array) => {
                let unit = file::common_multiple(arcs, array.value.len());
                (values(&array.value), unit)
            }
        };
        let asked = asked(file, |what| match what {
            What::At(at) => at.value.iter().map(|at| Where::Angle(at.value)).collect(),
            What::OverAll => vec![Where::Arc(0.0, TAU)],
            What::Over(from, to) => vec![Where::Arc(from.value, to.value)],
            What::Grid(points, _) => (0..points.value)
                .map(|i| Where::Angle(TAU * i as f64 / points.value as f64))
                .collect(),
            // Validation has refused it.
            What::Weight(_) | What::On(..) | What::OverSurface(_) => Vec::new(),
        })?;
        Ok(Self {
            file,
            circle,
            reflectance: values(&circle.reflectance.value),
            emission,
            unit,
            cells: match &file.galerkin.cells {
                Some(cells) => cells.value,
                None => DEFAULT_CELLS.next_multiple_of(unit),
            },
            asked,
        })
    }

    fn degree(&self) -> usize {
        self.file.galerkin.degree.value
    }

    fn scene(&self) -> Result<Scene<'_>, Failure> {
        let light = match &self.circle.emission {
            file::Emission::Harmonic {
                constant,
                amplitude,
                frequency,
            } => Light::Harmonic(Harmonic {
                constant: constant.value,
                amplitude: amplitude.value,
                frequency: frequency.value,
            }),
            file::Emission::Arcs(_) => {
                Light::Arcs(Arcs::new(&self.emission, self.cells).map_err(Failure::input)?)
            }
        };
        Ok(Scene {
            reflectance: &self.reflectance,
            light,
            cells: self.cells,
            absorption: self.file.walk.absorption.value,
            pairs: self.file.galerkin.pairs.value,
            degree: self.degree(),
        })
    }

    /// Sets up, with the kinds of pairs one by one if they are wanted.
    fn set_up<F: Real>(&self, solved: &Solved) -> Result<Setup<'_, F>, Failure> {
        let scene = self.scene()?;
        if scene.pairs != Pairs::Theory {
            return Setup::of(scene, solved, None);
        }
        let start = Instant::now();
        let kinds = self.theory(scene, solved)?;
        let mut setup = Setup::of(scene, solved, Some(&kinds))?;
        setup.seconds = solved.seconds + start.elapsed().as_secs_f64();
        Ok(setup)
    }

    /// The kinds of all pairs, for what is asked for.
    fn theory(&self, scene: Scene<'_>, solved: &Solved) -> Result<Vec<u8>, Failure> {
        let (cells, degree) = (scene.cells, scene.degree);
        let nodes = theory::nodes(self.file, cells, degree + 2)?;
        let of = |diagonal| theory::table_of(&OffDiagonal { diagonal }, cells);
        let in_s = of(PairKind::Galerkin);
        let setup = Setup::<f64>::of(scene, solved, Some(&in_s))?;
        let circle = scene.circle(&setup.tables)?;
        let level = CircleLevel::new(&circle, nodes, degree).map_err(Failure::run)?;
        let estimator = plan(self.file, None).estimator;
        setup.boxed(&circle, |galerkin| {
            let terms = Terms {
                cells,
                galerkin,
                possible: &|_, _| level.possible(),
            };
            self.with_starts(&circle, &level, |targets| {
                theory::choose(of(PairKind::Pointwise), |table, last| {
                    let setup = Setup::<f64>::of(scene, solved, Some(table))?;
                    let pairs = setup.pairs()?;
                    setup.boxed(&circle, |neighbour| {
                        let setting = Setting {
                            equation: &circle,
                            neighbour,
                            pairs,
                            level: &level,
                        };
                        theory::look(&setting, estimator, targets, &terms, last)
                    })?
                })
            })
        })?
    }

    /// With where the walks of all targets start.
    fn with_starts<R>(
        &self,
        circle: &Circle<'_, f64, Light<'_>>,
        level: &CircleLevel<'_, '_, Light<'_>>,
        then: impl FnOnce(&[Begin<'_, Point<f64>>]) -> R,
    ) -> R {
        let densities: Vec<_> = self
            .asked
            .iter()
            .map(|asked| uniform_on(&asked.place, level))
            .collect();
        let targets: Vec<Begin<'_, Point<f64>>> = self
            .asked
            .iter()
            .zip(&densities)
            .map(|(asked, density)| Begin {
                name: &asked.name,
                start: match asked.place {
                    Where::Angle(s) => variance::Start::At(circle.point(s)),
                    _ => variance::Start::Density(density),
                },
            })
            .collect();
        then(&targets)
    }

    fn tables_in<F: Real + Number>(&self) -> Result<TableBuilder, Failure> {
        let setup = Setup::<F>::new(self.scene()?)?;
        let constants = setup.scene.circle(&setup.tables)?.constants();
        Ok(export::circle(&setup, constants))
    }

    fn plain_in<F: Real>(&self, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        let scene = self.scene()?;
        let tables = Tables::<F>::new(scene.reflectance, scene.cells).map_err(Failure::input)?;
        let circle = scene.circle(&tables)?;
        let questions = self.questions();
        let of = |question: &Question| Known {
            exact: scene.exact(question),
            galerkin: 0.0,
        };
        let known: Vec<Known> = questions.iter().map(of).collect();
        let none = NoNeighbour::<Circle<'_, F, Light<'_>>>::new();
        let start = Instant::now();
        let outcome = walk(&circle, &none, &questions, &known, plan, progress)?;
        Ok(Answer::plain::<F>(known, outcome, start.elapsed()))
    }

    fn questions(&self) -> Vec<Question> {
        let of = |asked: &Asked| match asked.place {
            Where::Angle(s) => Some(Question::At(s)),
            Where::Arc(from, to) => Some(Question::Over(from, to)),
            _ => None,
        };
        self.asked.iter().filter_map(of).collect()
    }

    fn answer_in<F: Real>(
        &self,
        solved: &Solved,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let setup = self.set_up::<F>(solved)?;
        let questions = self.questions();
        let known = setup.known(&questions)?;
        let start = Instant::now();
        let outcome = setup.run(&questions, &known, plan, progress)?;
        Ok(Answer {
            known,
            floors: floors(&setup.v, setup.contraction, &outcome),
            outcome,
            solve: setup.solve,
            setup_seconds: setup.seconds,
            walk_seconds: start.elapsed().as_secs_f64(),
            // Their closed forms are a part of a score.
            pointwise: PointwisePairs::default(),
            second_moment: None,
            others: Vec::new(),
            pair_counts: match &setup.source {
                NeighbourSource::Kinds(table, _) => Some(PairCounts::of(table)),
                _ => None,
            },
            besides: Vec::new(),
            fluxes: Vec::new(),
        })
    }
}

impl Problem for CircleFile<'_> {
    fn kind(&self) -> &'static str {
        "circle"
    }

    fn cells(&self) -> usize {
        self.cells
    }

    fn unknowns(&self) -> usize {
        self.cells.saturating_mul(self.degree() + 1)
    }

    fn asked(&self) -> &[Asked] {
        &self.asked
    }

    fn memory(&self) -> usize {
        // Neither light nor anything else of the scene counts.
        let tables = match self.file.walk.scalar.value {
            Scalar::F32 => memory::<f32>(self.cells, self.degree()),
            Scalar::F64 => memory::<f64>(self.cells, self.degree()),
        };
        let theory = theory::memory(self.file, self.cells, self.degree() + 2);
        tables
            .saturating_add(self.asked.len().saturating_mul(1024))
            .saturating_add(theory)
    }

    fn cost(&self) -> Cost {
        let degree = self.degree() as f64;
        // Tables of constants are faster than functions; all pairs pointwise have closed forms.
        let nanoseconds = match (self.file.galerkin.pairs.value, self.degree()) {
            (Pairs::Pointwise, _) => [17.0, 24.0 + 12.0 * degree],
            (_, 0) => [20.0, 20.0],
            _ => [33.0 + 17.0 * degree, 32.0 + 13.0 * degree],
        };
        let [state, score] = nanoseconds.map(|time| 1e-9 * time);
        Cost {
            setup: self.cells as f64 * (CELL + degree * FUNCTION),
            source: 0.0,
            walk: WalkCost {
                start: state,
                step: state,
                score,
                ..PLAIN
            },
            plain: PLAIN,
        }
    }

    fn refuse_infinite_variance(&self) -> Result<(), Failure> {
        let scene = self.scene()?;
        let radius = scene.second_moment()?;
        if !(radius < 1.0) {
            let what = "reflectance²/(1 − absorption)";
            return Err(infinite_variance(self.file, what, radius));
        }
        if scene.degree == 0 {
            // h is a mean of k over cells.
            return Ok(());
        }
        let radius = of_degree!(scene.degree, B => scene.neighbour_second_moment::<B>())?;
        if radius < 1.0 {
            return Ok(());
        }
        let degree = scene.degree;
        let what = format!(
            "h² of degree {degree} on {} cells (more may help)",
            self.cells
        );
        Err(infinite_variance(self.file, what, radius))
    }

    fn second_moment(&self) -> Result<f64, Failure> {
        self.scene()?.second_moment()
    }

    fn absorption(&self) -> f64 {
        self.file.walk.absorption.value
    }

    fn mean_on(&self, cells: usize) -> Result<Box<dyn Problem + '_>, Failure> {
        Ok(Box::new(Self {
            cells,
            asked: vec![Asked {
                name: "mean".to_owned(),
                place: Where::Arc(0.0, TAU),
            }],
            ..self.clone()
        }))
    }

    fn levels(&self) -> Vec<usize> {
        let levels = (3..=10).map(|k| (1_usize << k).next_multiple_of(self.unit));
        let mut levels: Vec<usize> = levels.collect();
        levels.dedup();
        levels
    }

    fn counts_evaluations(&self) -> bool {
        true
    }

    /// Coefficients are closed forms: each sweep evaluates one for a cell.
    fn evaluations(&self, sweeps: u32) -> f64 {
        self.cells as f64 * f64::from(sweeps)
    }

    fn diagnose(&self, request: &Request<'_>) -> Result<Diagnosis, Failure> {
        let setup = self.set_up::<f64>(&self.solve()?)?;
        let circle = setup.scene.circle(&setup.tables)?;
        let level =
            CircleLevel::new(&circle, request.nodes, self.degree()).map_err(Failure::run)?;
        let sites = level.sites() as f64;
        let pairs = setup.pairs()?;
        setup.boxed(&circle, |neighbour| {
            self.with_starts(&circle, &level, |targets| {
                request.examine(&Subject {
                    setting: Setting {
                        equation: &circle,
                        neighbour,
                        pairs,
                        level: &level,
                    },
                    coefficients: (self.degree() == 0 && self.cells <= level.sites())
                        .then_some(&circle),
                    hides: None,
                    draw: None,
                    targets,
                    place: &|site| {
                        // A sixteenth of the circle.
                        let part = (16.0 * (site as f64 + 0.5) / sites).floor();
                        let [from, to] = [part, part + 1.0].map(|part| TAU * part / 16.0);
                        format!("[{from:.2}, {to:.2}]")
                    },
                })
            })
        })?
    }

    fn tables(&self) -> Result<TableBuilder, Failure> {
        Ok(match self.file.walk.scalar.value {
            Scalar::F32 => self.tables_in::<f32>()?,
            Scalar::F64 => self.tables_in::<f64>()?,
        })
    }

    fn plain(&self, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        match self.file.walk.scalar.value {
            Scalar::F32 => self.plain_in::<f32>(plan, progress),
            Scalar::F64 => self.plain_in::<f64>(plan, progress),
        }
    }

    fn solve(&self) -> Result<Solved, Failure> {
        self.scene()?.solve()
    }

    fn walk(&self, solved: &Solved, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        match self.file.walk.scalar.value {
            Scalar::F32 => self.answer_in::<f32>(solved, plan, progress),
            Scalar::F64 => self.answer_in::<f64>(solved, plan, progress),
        }
    }
}
