//! Scattering on the unit sphere, with sizes chosen at run time.

use core::f64::consts::PI;
use fredholm_core::array::Each;

use fredholm_core::galerkin::{
    DiagonalRule, GalerkinMatrix, PairKind, Piecewise, Rounded, Solution,
};
use fredholm_core::{At, Functional, Goals, Job, Neighbour, NoNeighbour, Real, Uniforms};
use fredholm_embedded::TableBuilder;
use fredholm_sphere::{Mean, MeanTable, Point, Sphere, SphereQuadrature, point};
use fredholm_variance::{Density, MeanCoefficients, Quadrature, Start as Begin, VarianceSetup};

use fredholm_model::Examined;
use fredholm_model::cost::{Cost, PointwisePairs, WalkCost};
use fredholm_model::{About, Prepared, Request, Then};
use fredholm_model::{
    Discretisation, Error, Goal, Model, Pairs, Partitioned, Region, SavedSystem, Scalar, Subject,
    System, WalkOptions, WholeSystem, in_scalar,
};

mod whole;

pub use fredholm_sphere::Parameters;
use whole::SphereWhole;

/// The relative residual at which the Gauss–Seidel iteration stops.
const TOLERANCE: f64 = 1e-14;
/// StoppingRule enough for albedos up to 0.99.
const SWEEPS: u32 = 4000;
/// Cells where nothing is said of them: 10 bands of 20 sectors.
const DEFAULT_CELLS: usize = 200;
/// The most cells for which there are tables.
const MOST_CELLS: usize = 1 << 24;
/// Seconds of the set-up for a kernel evaluation, on the machine that this and what follows was measured on.
const EVALUATION: f64 = 3e-9;
/// Seconds of the set-up for a pair of cells.
const PAIR: f64 = 20e-9;
/// The part of it that is left where the system is solved.
const SOURCE_PAIR: f64 = 5e-9;
/// Seconds of plain walks.
const PLAIN: WalkCost = WalkCost {
    start: 60e-9,
    step: 100e-9,
    score: 10e-9,
    pair: 0.0,
    hidden_pair: 0.0,
};
/// Seconds of walks that follow a neighbour equation.
const WALK: WalkCost = WalkCost {
    start: 100e-9,
    step: 250e-9,
    score: 20e-9,
    pair: 0.0,
    hidden_pair: 0.0,
};

/// Scattering on the unit sphere by the phase function of Henyey and Greenstein.
///
/// ```
/// use fredholm::sphere::Parameters;
/// use fredholm::{Solver, SphereModel};
///
/// let u = SphereModel::new(Parameters {
///     albedo: 0.6,
///     asymmetry: 0.3,
///     emission: [1.0, 0.2, 0.1, 0.5],
///     absorption: 0.4,
///     forward: 0.2,
/// });
/// let report = Solver::new(&u).at([1.0, 0.5]).solve_to(1e-2)?;
/// let goal = &report.goals[0];
/// assert!((goal.preconditioned.estimate.unwrap() - goal.exact.unwrap()).abs() < 0.05);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SphereModel {
    parameters: Parameters,
}

impl SphereModel {
    /// The equation of these parameters; their absorption is not used, as walks have their own.
    #[must_use]
    pub const fn new(parameters: Parameters) -> Self {
        Self { parameters }
    }
}

/// The numbers of bands and sectors of so many cells: the two factors that are nearest to twice as many sectors as bands.
fn shape(cells: usize) -> [usize; 2] {
    let ratio = |bands: usize| {
        let wanted = (2 * bands * bands) as f64 / cells as f64;
        wanted.max(1.0 / wanted)
    };
    let bands = (1..=cells.isqrt()).filter(|bands| cells.is_multiple_of(*bands));
    let bands = bands.min_by(|a, b| ratio(*a).total_cmp(&ratio(*b)));
    let bands = bands.unwrap_or(1);
    [bands, cells / bands]
}

impl SphereModel {
    /// Refuses a region that it does not have.
    fn check_region(region: &Region) -> Result<(), Error> {
        let message = match region {
            Region::Whole => return Ok(()),
            Region::Point(angles) => match angles.as_slice() {
                [colatitude, azimuth]
                    if (0.0..=PI).contains(colatitude) && (-PI..=2.0 * PI).contains(azimuth) =>
                {
                    return Ok(());
                }
                [_, _] => {
                    "colatitudes are from 0, the north pole, to pi, and azimuths from -pi to 2 pi"
                }
                _ => "a point of a sphere has two angles, a colatitude and an azimuth",
            },
            _ => "a sphere has points and the mean over all of it",
        };
        Err(Error::Region {
            message: message.to_owned(),
        })
    }
}

impl Model for SphereModel {
    fn about(&self) -> About {
        About {
            kind: "sphere",
            dimension: None,
            most_degree: 0,
            less_memory: ": use fewer cells",
            takes_any_cells: true,
            counts_evaluations: true,
        }
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        goals
            .iter()
            .try_for_each(|goal| Self::check_region(&goal.region))
    }

    fn place(&self, region: &Region) -> Option<[f64; 3]> {
        match region {
            Region::Point(angles) => place(angles).ok(),
            _ => None,
        }
    }

    fn has_whole(&self) -> bool {
        true
    }

    /// On a spiral from pole to pole, by the golden angle.
    fn spread(&self, points: f64) -> Vec<Region> {
        let golden = PI * (3.0 - f64::sqrt(5.0));
        let count = points.max(1.0) as usize;
        let at = |i: usize| {
            let height = 1.0 - (2 * i + 1) as f64 / count as f64;
            Region::Point(vec![height.acos(), (i as f64 * golden) % (2.0 * PI)])
        };
        (0..count).map(at).collect()
    }

    /// Along the meridian of azimuth 0, from the north pole to the south pole.
    fn grid(&self, points: usize, _: Option<usize>) -> Vec<Region> {
        let last = points.saturating_sub(1).max(1) as f64;
        (0..points)
            .map(|i| Region::Point(vec![PI * i as f64 / last, 0.0]))
            .collect()
    }

    fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
        Ok(match region {
            Region::Point(angles) => Some(self.parameters.solution(&place(angles)?)),
            Region::Whole => Some(self.parameters.mean()),
            _ => None,
        })
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        pairs.refuse_rays()?;
        let refuse = |subject, message: &str| {
            let message = message.to_owned();
            Err(Error::Option { subject, message })
        };
        if discretisation.degree > 0 {
            return refuse(
                Subject::Degree,
                "on a sphere functions are constant on cells: use `degree = 0`",
            );
        }
        if matches!(pairs, Pairs::Pointwise | Pairs::Theory) {
            return refuse(
                Subject::Pairs,
                "pointwise pairs need the exact integrals of the kernel over cells, which a sphere does not have: \
                 use \"default\", all pairs in S",
            );
        }
        Ok(())
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let cells = discretisation.cells.unwrap_or(DEFAULT_CELLS);
        if !(1..=MOST_CELLS).contains(&cells) {
            return Err(Error::Option {
                subject: Subject::Cells,
                message: format!("a sphere has from 1 to {MOST_CELLS} cells"),
            });
        }
        let [bands, sectors] = shape(cells);
        Ok(Box::new(SpherePartition {
            parameters: self.parameters,
            bands: bands as u32,
            sectors: sectors as u32,
            scalar: discretisation.scalar,
        }))
    }

    fn levels(&self, _: &Discretisation) -> Vec<usize> {
        let bands = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];
        bands.map(|bands| 2 * bands * bands).to_vec()
    }

    /// The sphere has two dimensions.
    fn smooth_order(&self, degree: usize) -> f64 {
        (degree + 1) as f64 / 2.0
    }
}

/// The point of a colatitude and an azimuth.
fn place<F: Real>(angles: &[f64]) -> Result<Point<F>, Error> {
    match *angles {
        // In f64, as a rounded angle moves a point further than a rounded coordinate.
        [colatitude, azimuth] => Ok(point(colatitude, azimuth).each(F::from_f64)),
        _ => Err(Error::Internal(
            "a point of a sphere has a colatitude and an azimuth",
        )),
    }
}

/// A sphere and its cells, before anything is computed.
#[derive(Clone, Copy, Debug)]
struct SpherePartition {
    parameters: Parameters,
    bands: u32,
    sectors: u32,
    scalar: Scalar,
}

impl SpherePartition {
    fn sphere<F: Real>(&self, absorption: f64) -> Result<Sphere<F>, Error> {
        let parameters = Parameters {
            absorption,
            ..self.parameters
        };
        Ok(Sphere::new(self.bands, self.sectors, &parameters)?)
    }

    fn entries(&self) -> f64 {
        MeanTable::evaluations(self.bands, self.sectors)
    }

    fn plain_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let sphere = self.sphere::<F>(request.walk.absorption)?;
        let zeros = vec![0.0; request.goals.len()];
        let none = NoNeighbour::<Sphere<F>>::new();
        with_job(&sphere, &none, request, &zeros, &mut |job| {
            then(&Prepared::plain(job, &zeros))
        })
    }
}

/// The pairs of cells: those of the diagonal in S or left out, all others in S.
const fn kinds(pairs: Pairs) -> DiagonalRule {
    let diagonal = match pairs {
        Pairs::Paper => PairKind::Dropped,
        _ => PairKind::Galerkin,
    };
    DiagonalRule { diagonal }
}

impl<'m> Partitioned<'m> for SpherePartition {
    fn cells(&self) -> usize {
        self.bands as usize * self.sectors as usize
    }

    fn unknowns(&self) -> usize {
        self.cells()
    }

    fn cells_text(&self) -> String {
        let [bands, sectors] = [self.bands, self.sectors];
        format!("{} ({bands} bands of {sectors} sectors)", self.cells())
    }

    fn memory(&self, goals: &[Goal], _: Pairs) -> usize {
        let scalar = in_scalar!(self.scalar, F => size_of::<F>());
        // A number for two bands and the difference of two sectors; F', v and G, and their copies for walks.
        let table = self.cells().saturating_mul(8 * self.bands as usize);
        let vectors = self.cells().saturating_mul(5 * 8 + 2 * scalar);
        table
            .saturating_add(vectors)
            .saturating_add(goals.len().saturating_mul(1024))
    }

    fn cost(&self, _: Pairs) -> Cost {
        let cells = self.cells() as f64;
        Cost {
            setup: EVALUATION * self.entries() + PAIR * cells * cells,
            source: SOURCE_PAIR * cells * cells,
            kept: 0.0,
            moments: 0.0,
            moments_power: 0.0,
            walk: WALK,
            plain: PLAIN,
            light: 0.0,
        }
    }

    fn evaluations(&self, _: u32) -> f64 {
        self.entries()
    }

    fn plain_radius(&self, absorption: f64) -> Result<f64, Error> {
        Ok(self.sphere::<f64>(absorption)?.second_moment_radius()?)
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        let absorption = walk.absorption;
        // h is a mean of k over cells, or 0.
        fredholm_model::finite::check_plain(
            "(4πK)²/((1 − absorption)(1 + forward x·y))",
            absorption,
            || self.plain_radius(absorption),
        )
    }

    fn solve(&self, absorption: f64) -> Result<Box<dyn System + 'm>, Error> {
        let sphere = self.sphere::<f64>(absorption)?;
        let table = MeanTable::new(&sphere)?;
        let solution = sphere.solve(&table, TOLERANCE, SWEEPS)?;
        Ok(Box::new(SphereSystem {
            cut: *self,
            table,
            solution,
        }))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let bands = self.bands as usize;
        let solution = saved.fitting(self.cells(), Some(bands * self.cells()), Some(0))?;
        // No absorption matters to the table.
        let sphere = self.sphere::<f64>(0.5)?;
        Ok(Box::new(SphereSystem {
            cut: *self,
            table: MeanTable::from_entries(&sphere, saved.coefficients.into_owned())?,
            solution,
        }))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.scalar, F => self.plain_in::<F>(request, then))
    }
}

/// The coefficients, and the Galerkin solution.
#[derive(Debug)]
pub(crate) struct SphereSystem {
    cut: SpherePartition,
    table: MeanTable,
    solution: Solution,
}

impl SphereSystem {
    fn job_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let sphere = self.cut.sphere::<F>(request.walk.absorption)?;
        let pairs = kinds(request.walk.pairs);
        let vectors = self.solution.for_walks::<F, _>(&self.table, pairs)?;
        let table = Rounded::<_, F>::new(&self.table);
        let neighbour: Piecewise<'_, F, _, _, _, _> = vectors.piecewise(&sphere, &table)?;
        let v = |goal: &Goal| match &goal.region {
            Region::Point(angles) => {
                Ok(neighbour.value(&neighbour.locate(place(angles)?)).to_f64())
            }
            _ => Ok(Mean::of(vectors.v())),
        };
        let galerkin = request.goals.iter().map(v);
        let galerkin = galerkin.collect::<Result<Vec<f64>, Error>>()?;
        with_job(&sphere, &neighbour, request, &galerkin, &mut |job| {
            then(&Prepared {
                job,
                galerkin: &galerkin,
                largest: fredholm_model::numbers::largest(vectors.v()),
                radius_bound: self.solution.radius_bound,
                convergence: self.solution.convergence,
                pointwise: PointwisePairs::default(),
                neighbour_second_moment_radius: None,
                pair_counts: None,
            })
        })
    }
}

impl System for SphereSystem {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cut.check_variance(walk)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => self.job_in::<F>(request, then))
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let sphere = self.cut.sphere::<f64>(request.walk.absorption)?;
        let pairs = kinds(request.walk.pairs);
        let vectors = self.solution.for_walks::<f64, _>(&self.table, pairs)?;
        let neighbour = vectors.piecewise(&sphere, &self.table)?;
        let quadrature = SphereQuadrature::new(&sphere, nodes)?;
        let everywhere = |_: &Point<f64>| Density::uniform(4.0 * PI);
        let start = |goal: &Goal| match &goal.region {
            Region::Point(angles) => Ok(Begin::At(place(angles)?)),
            _ => Ok(Begin::Density(&everywhere)),
        };
        let starts = request.goals.iter().map(start);
        let starts = starts.collect::<Result<Vec<Begin<'_, Point<f64>>>, Error>>()?;
        let coefficients = MeanCoefficients {
            cells: self.cut.cells(),
            mean: &|i, j| self.table.mean(i, j),
        };
        let setting = VarianceSetup {
            equation: &sphere,
            neighbour: &neighbour,
            pairs,
            quadrature: &quadrature,
            galerkin: None,
        };
        then(&Examined {
            model: &setting.with_starts(&starts)?,
            coefficients: (self.cut.cells() <= quadrature.sites()).then_some(coefficients),
            hides: None,
            pieces: None,
            goals: request.goals,
            known: &[],
            place: &|site| zone(quadrature.middle(site)),
        })
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        Some(SavedSystem::new(&self.solution, self.table.entries()))
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn WholeSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        Ok(Box::new(SphereWhole::new(*self)))
    }

    fn tables(&self, _: Pairs, _: f64) -> Result<TableBuilder, Error> {
        Err(Error::Option {
            subject: Subject::Problem,
            message: "there are no device tables of spheres".to_owned(),
        })
    }
}

/// A quarter of the height and a quarter turn.
fn zone([height, azimuth]: [f64; 2]) -> String {
    let quarter = (2.0 * (height + 1.0)).floor().clamp(0.0, 3.0);
    let turn = (2.0 * azimuth / PI).floor().clamp(-2.0, 1.0);
    let [low, high] = [quarter, quarter + 1.0].map(|edge| 0.5 * edge - 1.0);
    let [from, to] = [turn, turn + 1.0].map(|edge| 0.5 * PI * edge);
    format!("height {low:.1} to {high:.1}, azimuth {from:.2} to {to:.2}")
}

/// Prepares the walks of all goals, (v, Φ) of which is known.
fn with_job<F: Real, N>(
    sphere: &Sphere<F>,
    neighbour: &N,
    request: &Request<'_>,
    galerkin: &[f64],
    then: &mut dyn FnMut(&dyn Job) -> Result<(), Error>,
) -> Result<(), Error>
where
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync,
{
    let goal = |(goal, &galerkin): (&Goal, &f64)| {
        let functional = match &goal.region {
            Region::Point(angles) => Start::Point(At(place(angles)?)),
            Region::Whole => Start::Mean,
            _ => return Err(Error::Internal("a sphere has points and a mean")),
        };
        Ok(fredholm_core::Goal {
            functional,
            control_mean: Some(galerkin),
        })
    };
    let goals = request.goals.iter().zip(galerkin).map(goal);
    let goals = goals.collect::<Result<Vec<_>, Error>>()?;
    let options = request.walk.for_core();
    then(&Goals::new(sphere, neighbour, &goals, options))
}

/// Where walks start.
enum Start<F> {
    Point(At<Point<F>>),
    Mean,
}

impl<F: Real> Functional<Sphere<F>> for Start<F> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        match self {
            Self::Point(At(x)) => (*x, F::one()),
            Self::Mean => Mean.start(uniforms),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::shape;

    #[test]
    fn cells_are_about_twice_as_many_sectors_as_bands() {
        assert_eq!(shape(200), [10, 20]);
        assert_eq!(shape(2), [1, 2]);
        assert_eq!(shape(1), [1, 1]);
        assert_eq!(shape(18), [3, 6]);
        assert_eq!(shape(97), [1, 97]);
        assert_eq!(shape(5000), [50, 100]);
    }
}
