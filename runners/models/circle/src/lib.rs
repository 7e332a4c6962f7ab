//! Flatland radiosity on the unit circle, with sizes chosen at run time.

mod export;
mod jobs;
mod light;
mod system;
mod whole;

use core::f64::consts::TAU;

use fredholm_circle::{
    ArcLight, Arcs, Circle, DirectLight, LaneReal, MeanOver, Tables,
    neighbour_second_moment_radius, second_moment_radius,
};
use fredholm_core::galerkin::{DiagonalRule, PairKind};
use fredholm_core::{Form, Job, NoNeighbour, Real, Sobol};

pub use fredholm_circle::Harmonic;

use fredholm_model::cost::{Cost, WalkCost};
use fredholm_model::{About, Prepared, Request, Then};
use fredholm_model::{
    Discretisation, Error, Goal, LastSteps, Model, Pairs, Partitioned, Region, SavedSystem, Scalar,
    Sequence, Subject, System, WalkOptions, in_scalar,
};
use jobs::{with_job, with_same_kernel};
use light::{DARK, Light};
use system::{Boxed, CircleSystem};

/// The relative residual at which the Gauss–Seidel iteration stops. An unconverged solution costs
/// variance and nothing else.
const TOLERANCE: f64 = 1e-14;
/// StoppingRule enough for reflectances up to 0.99.
const SWEEPS: u32 = 1000;
/// Cells enough to estimate a spectral radius.
const COARSE: usize = 200;
/// Cells where nothing is said of them: the first number from here on that fits the arcs.
const DEFAULT_CELLS: usize = 100;
/// Seconds of the set-up for a cell, on the machine that this and what follows was measured on.
const CELL: f64 = 0.8e-6;
/// Seconds of the set-up for a function on a cell besides the constant one.
const FUNCTION: f64 = 0.7e-6;
/// Seconds of what an arc gives to a point directly.
const LIGHT: f64 = 8e-9;
/// Seconds of plain walks.
const PLAIN: WalkCost = WalkCost {
    start: 15e-9,
    step: 15e-9,
    score: 15e-9,
    pair: 0.0,
    hidden_pair: 0.0,
};

/// An expression in which the number of functions per cell of a degree is a constant of this name.
macro_rules! of_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            1 => crate::of_degree!(2 as $name => $then),
            2 => crate::of_degree!(3 as $name => $then),
            3 => crate::of_degree!(4 as $name => $then),
            // `check` lets nothing above 4 pass, and 0 has its own way.
            _ => crate::of_degree!(5 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}
pub(crate) use of_degree;

/// The emission of a circle.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Emission {
    /// The emission for which a constant and a wave are the solution (Heinrich 1995, (57)–(58)).
    Harmonic(Harmonic),
    /// Constant on each of so many equal arcs of [0, 2π).
    Arcs(Vec<f64>),
}

/// The equation of light on the unit circle (Heinrich 1995, section 5).
///
/// ```
/// use fredholm::circle::Emission;
/// use fredholm::{CircleModel, Solver};
///
/// // Reflectance ½, a lamp on the upper half: the mean of u is ½/(1 − ½).
/// let u = CircleModel::new(vec![0.5], Emission::Arcs(vec![1.0, 0.0]));
/// let report = Solver::new(&u).mean().at(1.0).solve_to(1e-4)?;
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 1.0).abs() < 5e-4);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CircleModel {
    reflectance: Vec<f64>,
    emission: Emission,
    /// The number of cells is a multiple of this.
    unit: usize,
    /// The arcs to which last steps lead.
    lights: Vec<ArcLight>,
    last_steps: LastSteps,
}

impl CircleModel {
    /// A circle with `reflectance` on equal arcs of [0, 2π).
    #[must_use]
    pub fn new(reflectance: Vec<f64>, emission: Emission) -> Self {
        let arcs = reflectance.len();
        let unit = match &emission {
            Emission::Harmonic(_) => arcs,
            Emission::Arcs(values) => common_multiple(arcs, values.len()),
        };
        let (lights, last_steps) = light::lights(&emission, &reflectance);
        Self {
            reflectance,
            emission,
            unit,
            lights,
            last_steps,
        }
    }

    /// Cells of which there must be a multiple, so that every arc is some of them.
    #[must_use]
    pub const fn unit(&self) -> usize {
        self.unit
    }
}

/// The least common multiple; at most `usize::MAX`.
#[must_use]
pub fn common_multiple(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    (a / x.max(1)).saturating_mul(b)
}

impl CircleModel {
    /// Refuses a region that it does not have.
    fn check_region(region: &Region) -> Result<(), Error> {
        let message = match *region {
            Region::Whole => return Ok(()),
            Region::Angle(angle) if (0.0..TAU).contains(&angle) => return Ok(()),
            Region::Arc(from, to) if 0.0 <= from && from < to && to <= TAU => return Ok(()),
            Region::Angle(_) => format!("an angle must be at least 0 and less than 2 pi = {TAU}"),
            Region::Arc(..) => {
                format!("an arc is from an angle to a larger one, both from 0 to 2 pi = {TAU}")
            }
            _ => {
                "a circle has points, each one angle, arcs, and the mean over all of it".to_owned()
            }
        };
        Err(Error::Region { message })
    }
}

impl Model for CircleModel {
    fn about(&self) -> About {
        About {
            kind: "circle",
            dimension: None,
            most_degree: 4,
            less_memory: ": use fewer cells",
            takes_any_cells: false,
            counts_evaluations: true,
        }
    }

    fn place(&self, region: &Region) -> Option<[f64; 3]> {
        match region {
            Region::Angle(s) => Some([s.cos(), s.sin(), 0.0]),
            _ => None,
        }
    }

    fn point(&self, coordinates: &[f64]) -> Region {
        match *coordinates {
            [angle] => Region::Angle(angle),
            _ => Region::Point(coordinates.to_vec()),
        }
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        goals
            .iter()
            .try_for_each(|goal| Self::check_region(&goal.region))
    }

    fn grid(&self, points: usize, _: Option<usize>) -> Vec<Region> {
        (0..points)
            .map(|i| Region::Angle(TAU * i as f64 / points as f64))
            .collect()
    }

    fn whole(&self) -> Region {
        Region::Arc(0.0, TAU)
    }

    fn most_lift(&self) -> usize {
        4
    }

    fn has_sequences(&self) -> bool {
        true
    }

    fn last_steps(&self) -> LastSteps {
        self.last_steps
    }

    fn has_whole(&self) -> bool {
        true
    }

    /// All pointwise: walks are shorter, go side by side, and vary less: with 100 cells of degree 0 the largest error bar is 15 %
    /// smaller and with the collision estimator 32 %, in half of the time.
    fn whole_pairs(&self) -> Pairs {
        Pairs::Pointwise
    }

    fn exact(&self, region: &Region) -> Result<Option<f64>, Error> {
        Ok(match (&self.emission, region) {
            (Emission::Harmonic(light), Region::Angle(s)) => Some(light.solution(*s)),
            (Emission::Harmonic(light), Region::Arc(from, to)) => Some(light.mean(*from, *to)),
            _ => None,
        })
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        pairs.refuse_rays()?;
        if discretisation.degree > 0 && pairs == Pairs::Paper {
            // A sample without a step within a cell looks as if there were no variance left.
            let message = "\"paper\" leaves steps within a cell out: with a `degree` above 0 they are what is \
                           left of the variance, and so rare that error bars would miss them; use \
                           \"default\"";
            return Err(Error::Option {
                subject: Subject::Pairs,
                message: message.to_owned(),
            });
        }
        Ok(())
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let default = || DEFAULT_CELLS.next_multiple_of(self.unit);
        Ok(Box::new(CirclePartition {
            model: self,
            cells: discretisation.cells.unwrap_or_else(default),
            degree: discretisation.degree,
            scalar: discretisation.scalar,
        }))
    }

    fn levels(&self, _: &Discretisation) -> Vec<usize> {
        let levels = (3..=10).map(|k| (1_usize << k).next_multiple_of(self.unit));
        let mut levels: Vec<usize> = levels.collect();
        levels.dedup();
        levels
    }
}

/// A circle and its partition, before anything is computed.
#[derive(Clone, Copy, Debug)]
struct CirclePartition<'m> {
    model: &'m CircleModel,
    /// n.
    cells: usize,
    /// The degree of the polynomials on a cell.
    degree: usize,
    scalar: Scalar,
}

impl<'m> CirclePartition<'m> {
    fn light(&self, last_step: bool) -> Result<Light<'m>, Error> {
        Ok(match &self.model.emission {
            Emission::Harmonic(light) => Light::Harmonic(*light),
            Emission::Arcs(values) => {
                let arcs = Arcs::new(values, self.cells)?;
                if last_step {
                    Light::Direct(DirectLight::new(arcs, &self.model.lights))
                } else {
                    Light::Arcs(arcs)
                }
            }
        })
    }

    /// F_s of every cell: that of the lights, if last steps lead to them.
    fn emission_of_lights(&self, last_step: bool) -> Vec<f64> {
        let mut emission = vec![0.0; self.cells];
        if let (Emission::Arcs(values), true) = (&self.model.emission, last_step) {
            let cells = self.cells / values.len();
            for light in &self.model.lights {
                let from = light.arc() * cells;
                let own = emission.get_mut(from..from + cells);
                own.unwrap_or_default().fill(light.emission());
            }
        }
        emission
    }

    fn circle<'t, F: Real>(
        &self,
        tables: &'t Tables<F>,
        (absorption, last_step): (f64, bool),
    ) -> Result<Circle<'t, F, Light<'m>>, Error> {
        Ok(Circle::new(
            tables.cells(),
            self.light(last_step)?,
            absorption,
        )?)
    }

    fn tables<F: Real>(&self) -> Result<Tables<F>, Error> {
        Ok(Tables::new(&self.model.reflectance, self.cells)?)
    }

    /// A circle without light on some two hundred cells, or fewer.
    fn coarse(&self, most: usize) -> Result<Tables<f64>, Error> {
        let arcs = self.model.reflectance.len();
        let cells = most.min(COARSE.next_multiple_of(arcs));
        Ok(Tables::new(&self.model.reflectance, cells)?)
    }

    /// The estimated spectral radius of T_h²p: no less than that of T_k²p by which it is multiplied where
    /// cells are too few for the degree.
    fn neighbour_second_moment_radius<const B: usize>(
        &self,
        pairs: Pairs,
        absorption: f64,
    ) -> Result<f64, Error> {
        let Some(diagonal) = diagonal(pairs) else {
            // h = k.
            return Ok(0.0);
        };
        // More cells only bring h nearer to k.
        let tables = self.coarse(self.cells)?;
        let circle = Circle::new(tables.cells(), DARK, absorption)?;
        let polynomials = circle.with_functions::<B>();
        Ok(neighbour_second_moment_radius(
            &polynomials,
            &DiagonalRule { diagonal },
        )?)
    }

    /// (F_s, Φ) of each goal: what is known besides what walks estimate.
    fn known<F: Real>(
        &self,
        circle: &Circle<'_, F, Light<'_>>,
        request: &Request<'_>,
    ) -> Result<Vec<f64>, Error> {
        let emission = self.emission_of_lights(request.walk.last_step);
        let in_scalar: Vec<F> = emission.iter().map(|&f| F::from_f64(f)).collect();
        let of = |goal: &Goal| match goal.region {
            Region::Angle(s) => Ok(emission
                .get(circle.point(s).cell())
                .copied()
                .unwrap_or(f64::NAN)),
            Region::Arc(from, to) => Ok(MeanOver::new(circle, from, to)?.of(&in_scalar)),
            _ => Err(Error::Internal("a circle has angles and arcs")),
        };
        request.goals.iter().map(of).collect()
    }

    /// Bytes of the tables in one scalar.
    fn table_bytes<F: Real>(&self) -> usize {
        let size = size_of::<F>();
        let functions = self.degree + 1;
        // Tables of 9 numbers a cell in f64 for the set-up, with F', v, G and a copy of v; then the
        // walk's own with v and G or two moments.
        let setup = 9 * 8 + functions * (4 * 8 + 2 * size) + size;
        let walk = 9 * size + functions * 2 * size + size + 8;
        self.cells.saturating_mul(setup.max(walk))
    }

    fn plain_in<F: LaneReal>(
        &self,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let tables = self.tables::<F>()?;
        let walk = request.walk;
        let circle = self.circle(&tables, (walk.absorption, walk.last_step))?;
        let known = self.known(&circle, request)?;
        let none = NoNeighbour::<Circle<'_, F, Light<'_>>>::new();
        let goals = &known.iter().map(|&known| (known, 0.0)).collect::<Vec<_>>();
        let mut walk = |job: &dyn Job| then(&Prepared::plain(job, &known));
        match request.walk.sequence {
            Sequence::Random => {
                // v and G are 0, so that h does not matter.
                with_same_kernel(&circle, &none, request, goals, &mut walk)
            }
            Sequence::Sobol => {
                let none: &Boxed<'_, F> = &none;
                with_job::<Sobol, _, _, _>(&circle, none, request, goals, &mut walk)
            }
        }
    }
}

/// The kind of the diagonal's pairs; `None`: all pairs are pointwise.
const fn diagonal(pairs: Pairs) -> Option<PairKind> {
    match pairs {
        Pairs::Paper => Some(PairKind::Dropped),
        // From the theory the diagonal is pointwise too where that matters.
        Pairs::Default | Pairs::Theory => Some(PairKind::Pointwise),
        // Rays are refused.
        Pairs::Pointwise | Pairs::Rays => None,
    }
}

impl<'m> Partitioned<'m> for CirclePartition<'m> {
    fn cells(&self) -> usize {
        self.cells
    }

    fn unknowns(&self) -> usize {
        self.cells.saturating_mul(self.degree + 1)
    }

    fn memory(&self, goals: &[Goal], pairs: Pairs) -> usize {
        // Neither light nor anything else of the scene counts.
        let tables = in_scalar!(self.scalar, F => self.table_bytes::<F>());
        tables
            .saturating_add(goals.len().saturating_mul(1024))
            .saturating_add(fredholm_model::pairs::memory(
                pairs,
                self.cells,
                self.degree + 2,
            ))
    }

    fn cost(&self, pairs: Pairs) -> Cost {
        let degree = self.degree as f64;
        // Tables of constants are faster than functions; all pairs pointwise have closed forms.
        let nanoseconds = match (pairs, self.degree) {
            (Pairs::Pointwise, _) => [17.0, 24.0 + 12.0 * degree],
            (_, 0) => [20.0, 20.0],
            _ => [33.0 + 17.0 * degree, 32.0 + 13.0 * degree],
        };
        let [state, score] = nanoseconds.map(|time| 1e-9 * time);
        Cost {
            setup: self.cells as f64 * (CELL + degree * FUNCTION),
            source: 0.0,
            kept: 0.0,
            moments: 0.0,
            moments_power: 0.0,
            walk: WalkCost {
                start: state,
                step: state,
                score,
                ..PLAIN
            },
            plain: PLAIN,
            light: LIGHT * self.model.lights.len() as f64,
        }
    }

    /// Coefficients are closed forms: each sweep evaluates one for a cell.
    fn evaluations(&self, sweeps: u32) -> f64 {
        self.cells as f64 * f64::from(sweeps)
    }

    fn plain_radius(&self, absorption: f64) -> Result<f64, Error> {
        let reflectance = self.model.reflectance.iter().copied();
        let largest = reflectance.fold(0.0, f64::max);
        let bound = largest * largest / (1.0 - absorption);
        if bound < 1.0 {
            return Ok(bound);
        }
        // k is constant on arcs: a coarse partition of them shows what a fine one would.
        let tables = self.coarse(usize::MAX)?;
        let circle = Circle::new(tables.cells(), DARK, absorption)?;
        Ok(second_moment_radius(&circle))
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        let (pairs, absorption) = (walk.pairs, walk.absorption);
        fredholm_model::finite::check_plain(
            "reflectance²/(1 − absorption)",
            absorption,
            || self.plain_radius(absorption),
        )?;
        if walk.form == Form::Residual {
            return Ok(());
        }
        // At degree 0 h is a mean of k over cells.
        fredholm_model::finite::check_neighbour(
            self.degree,
            self.cells,
            absorption,
            || of_degree!(self.degree, B => self.neighbour_second_moment_radius::<B>(pairs, absorption)),
        )
    }

    fn solve(&self, absorption: f64) -> Result<Box<dyn System + 'm>, Error> {
        let tables = self.tables::<f64>()?;
        let circle = self.circle(&tables, (absorption, false))?;
        let solution = match self.degree {
            0 => circle.solve(TOLERANCE, SWEEPS)?,
            degree => of_degree!(degree, B => {
                circle.with_functions::<B>().solve(TOLERANCE, SWEEPS)?
            }),
        };
        Ok(Box::new(CircleSystem {
            cut: *self,
            tables,
            solution,
            lifted: false,
        }))
    }

    /// The coefficients are closed forms, of tables that are made quickly.
    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        Ok(Box::new(CircleSystem {
            cut: *self,
            tables: self.tables::<f64>()?,
            solution: saved.fitting(self.unknowns(), Some(0), Some(0))?,
            lifted: false,
        }))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.scalar, F => self.plain_in::<F>(request, then))
    }
}
