//! A circle from its file to statistics: set-up, targets, walks.

use std::time::Instant;

use fredholm_circle::{
    Arcs, Circle, Emission, Harmonic, MeanOver, Moment, Point, Residual, Solution, Tables,
    second_moment_radius,
};
use fredholm_core::galerkin::{OffDiagonal, PairKind, Piecewise, Solve};
use fredholm_core::{At, Functional, Neighbour, Real, Uniforms};
use fredholm_rayon::{Observer, Outcome, Plan, RunError, Target, run};

use crate::failure::Failure;
use crate::file::{self, Pairs};
use crate::progress::begin_walking;

/// The relative residual at which the Gauss–Seidel iteration stops. An unconverged solution costs
/// variance and nothing else.
const TOLERANCE: f64 = 1e-14;
/// Sweeps enough for reflectances up to 0.99.
const SWEEPS: u32 = 1000;

/// Cells enough to estimate a spectral radius.
const COARSE: usize = 200;

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
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Question {
    /// u at an angle.
    At(f64),
    /// The mean of u over an interval of angles.
    Over(f64, f64),
}

/// An answer's deterministic part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// (u, Φ), where it is known.
    pub(crate) exact: Option<f64>,
    /// (v, Φ).
    pub(crate) galerkin: f64,
}

/// The tables of a scene: all that is computed before the walks.
#[derive(Debug)]
pub(crate) struct Setup<'a, F> {
    scene: Scene<'a>,
    tables: Tables<F>,
    v: Vec<F>,
    source: NeighbourSource<F>,
    /// How the Gauss–Seidel iteration went.
    pub(crate) solve: Solve<f64>,
    /// max ρ.
    pub(crate) contraction: f64,
    /// Seconds that it took.
    pub(crate) seconds: f64,
}

/// G as the neighbour equation of these pairs has it.
#[derive(Debug)]
enum NeighbourSource<F> {
    Table(OffDiagonal, Vec<F>),
    ClosedForm(Vec<Moment<F>>),
}

impl<'a, F: Real> Setup<'a, F> {
    /// Solves the Galerkin system of the scene in f64 and rounds what the walks need.
    pub(crate) fn new(scene: Scene<'a>) -> Result<Self, Failure> {
        let start = Instant::now();
        let (solution, v, source) = {
            let tables =
                Tables::<f64>::new(scene.reflectance, scene.cells).map_err(Failure::input)?;
            let circle = scene.circle(&tables)?;
            let solution = Solution::new(&circle, TOLERANCE, SWEEPS).map_err(Failure::run)?;
            let table = |diagonal| {
                let pairs = OffDiagonal { diagonal };
                let g = solution.source(&circle, &pairs).map_err(Failure::run)?;
                Ok::<_, Failure>(NeighbourSource::Table(pairs, g))
            };
            let source = match scene.pairs {
                Pairs::Paper => table(PairKind::None)?,
                Pairs::Default => table(PairKind::Pointwise)?,
                Pairs::Pointwise => {
                    let moments = solution.moments(&circle.table()).map_err(Failure::run)?;
                    NeighbourSource::ClosedForm(moments)
                }
            };
            let v = solution.rounded();
            (solution, v, source)
        };
        Ok(Self {
            scene,
            tables: Tables::new(scene.reflectance, scene.cells).map_err(Failure::input)?,
            v,
            source,
            solve: solution.solve,
            contraction: solution.contraction,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    /// max |v|.
    pub(crate) fn largest(&self) -> f64 {
        self.v.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()))
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
        let exact = match self.scene.light {
            Light::Harmonic(light) => Some(match *question {
                Question::At(s) => light.solution(s),
                Question::Over(from, to) => light.mean(from, to),
            }),
            Light::Arcs(_) => None,
        };
        let galerkin = match *question {
            Question::At(s) => {
                let cell = circle.point(s).cell();
                self.v.get(cell).map_or(f64::NAN, |v| v.to_f64())
            }
            Question::Over(from, to) => {
                let mean = MeanOver::new(circle, from, to).map_err(Failure::input)?;
                mean.of(&self.v)
            }
        };
        Ok(Known { exact, galerkin })
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
        match &self.source {
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

impl<'a> Scene<'a> {
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
        let dark = Light::Harmonic(Harmonic {
            constant: 0.0,
            amplitude: 0.0,
            frequency: 1,
        });
        let circle = Circle::new(tables.cells(), dark, self.absorption).map_err(Failure::input)?;
        Ok(second_moment_radius(&circle))
    }

    /// Bytes of the tables at their largest.
    pub(crate) fn memory<F: Real>(&self) -> usize {
        let size = size_of::<F>();
        // Tables of 9 numbers a cell in f64 for the set-up, with F', v, G and a copy of v; then the
        // walk's own with v and G or two moments.
        let setup = 9 * 8 + 4 * 8 + 3 * size;
        let walk = 9 * size + 3 * size + 8;
        self.cells.saturating_mul(setup.max(walk))
    }
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
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync,
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

/// The light of a file, for a circle with so many cells.
pub(crate) fn light<'a>(
    emission: &file::Emission,
    values: &'a [f64],
    cells: usize,
) -> Result<Light<'a>, Failure> {
    match emission {
        file::Emission::Harmonic {
            constant,
            amplitude,
            frequency,
        } => Ok(Light::Harmonic(Harmonic {
            constant: constant.value,
            amplitude: amplitude.value,
            frequency: frequency.value,
        })),
        file::Emission::Arcs(_) => Arcs::new(values, cells)
            .map(Light::Arcs)
            .map_err(Failure::input),
    }
}
