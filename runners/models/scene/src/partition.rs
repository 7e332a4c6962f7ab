//! Cells of a scene, before anything is solved.

use std::sync::Arc;

use fredholm_core::galerkin::{Convergence, GalerkinError};
use fredholm_core::sampled::{CellSteps, SampledSetup, SampledSolution, SetupOptions};
use fredholm_core::{LastStep, NoNeighbour, Real, WithKnown};
use fredholm_model::cost::{Cost, PointwisePairs, WalkCost};
use fredholm_model::{
    Discretisation, Error, Goal, Pairs, Partitioned, Prepared, Request, SavedSystem, Scalar,
    Subject, System, Then, WalkOptions, in_scalar,
};
use fredholm_rayon::fill_rows;
use fredholm_scene::{Cells, LastStepWork, Radiosity, Scene, Tables};

use crate::of_degree;
use crate::radius::{radius, second_moment_radius};
use crate::system::{SceneSystem, with_job};
use crate::{Colours, SceneModel};

/// About so many cells where nothing is said of them.
const DEFAULT_CELLS: usize = 500;
/// Rays of a set-up in all, divided among the cells: seconds of work and a few hundred megabytes at most.
const RAYS: usize = 1 << 22;
/// Rays of a cell at least, for a fit that is worth its name, and at most, beyond which it hardly gets better.
const RAYS_OF_CELL: [usize; 2] = [256, 4096];
/// Rays to each light from each cell, to know what share of it the cell sees.
const SHARE_RAYS: u32 = 64;
/// Seconds of a ray in a set-up, on the machine that this and what follows was measured on.
pub(crate) const RAY: f64 = 0.7e-6;
/// Seconds of the form factor of a light that shines towards a point: in a last step for each of them.
const LIGHT: f64 = 0.35e-6;
/// Seconds of plain walks, but for lights and for further rays to them.
const PLAIN: WalkCost = WalkCost {
    start: 0.3e-6,
    step: 0.3e-6,
    score: 0.25e-6,
    pair: 0.0,
    hidden_pair: 0.0,
};
/// Seconds of walks that follow a neighbour equation, but for the same.
const WALK: WalkCost = WalkCost {
    score: 1.85e-6,
    ..PLAIN
};

/// The cells of a scene in f64, and what of each light each of them sees.
#[derive(Debug)]
pub(crate) struct Cut {
    tables: Tables<f64>,
    cells: Cells<f64>,
    pub(crate) shares: Vec<u8>,
    last_step: LastStepWork,
    /// The number of cells that was asked for: in another scalar they are made by it again.
    wanted: usize,
    pub(crate) degree: usize,
    pub(crate) scalar: Scalar,
}

impl Cut {
    /// The number of cells.
    pub(crate) const fn number(&self) -> usize {
        self.cells.number()
    }

    pub(crate) fn radiosity(&self, absorption: f64) -> Result<Radiosity<'_, f64>, Error> {
        let radiosity = Radiosity::new(self.tables.geometry(), &self.cells, absorption)?;
        Ok(radiosity.with_visible_shares(&self.shares)?)
    }
}

/// The tables of walks in a scalar.
pub(crate) struct WalkTables<F> {
    tables: Tables<F>,
    pub(crate) cells: Cells<F>,
}

impl<F: Real> WalkTables<F> {
    pub(crate) fn new(scene: &Scene, cut: &Cut) -> Result<Self, Error> {
        Ok(Self {
            tables: Tables::new(scene),
            cells: Cells::new(scene, cut.wanted)?,
        })
    }

    pub(crate) fn radiosity<'a>(
        &'a self,
        cut: &'a Cut,
        absorption: f64,
    ) -> Result<Radiosity<'a, F>, Error> {
        let radiosity = Radiosity::new(self.tables.geometry(), &self.cells, absorption)?;
        Ok(radiosity.with_visible_shares(&cut.shares)?)
    }
}

/// The set-up from rays, of B functions on a cell.
type Setup<'a, S, const B: usize> =
    SampledSetup<'a, Radiosity<'a, f64>, S, 2, B, Radiosity<'a, f64>>;

/// A scene and its cells.
#[derive(Debug)]
pub(crate) struct ScenePartition<'m> {
    pub(crate) model: &'m SceneModel,
    pub(crate) cut: Arc<Cut>,
}

impl<'m> ScenePartition<'m> {
    pub(crate) fn new(
        model: &'m SceneModel,
        discretisation: &Discretisation,
    ) -> Result<Self, Error> {
        let scene = model.scene();
        let wanted = discretisation.cells.unwrap_or(DEFAULT_CELLS);
        let mut cut = Cut {
            tables: Tables::new(scene),
            cells: Cells::new(scene, wanted)?,
            shares: Vec::new(),
            last_step: LastStepWork {
                lights: 0.0,
                rays: 0.0,
            },
            wanted,
            degree: discretisation.degree,
            scalar: discretisation.scalar,
        };
        // q0 makes no difference to what is seen.
        let radiosity = Radiosity::new(cut.tables.geometry(), &cut.cells, 0.5)?;
        let shares = radiosity.visible_shares(SHARE_RAYS);
        cut.last_step = radiosity.with_visible_shares(&shares)?.last_step_work();
        cut.shares = shares;
        Ok(Self {
            model,
            cut: Arc::new(cut),
        })
    }

    /// Rays from every cell.
    fn rays(&self) -> usize {
        let [least, most] = RAYS_OF_CELL;
        (RAYS / self.cut.cells.number()).clamp(least, most)
    }

    /// Bytes of v and c of a channel.
    pub(crate) fn channel_memory(&self) -> usize {
        let own = self.functions() * 4 * 8 + self.rays() / 4 * 16;
        self.cut.number().saturating_mul(own)
    }

    fn functions(&self) -> usize {
        of_degree!(self.cut.degree, B => B)
    }

    /// The set-up of v and c.
    fn setup<'a, const B: usize>(
        &self,
        last: &'a LastStep<'a, Radiosity<'a, f64>>,
    ) -> Setup<'a, LastStep<'a, Radiosity<'a, f64>>, B> {
        self.setup_of(last.0, last)
    }

    /// The set-up of v and c of an equation with this source.
    pub(crate) fn setup_of<'a, S, const B: usize>(
        &self,
        radiosity: &'a Radiosity<'a, f64>,
        source: &'a S,
    ) -> Setup<'a, S, B> {
        SampledSetup {
            problem: radiosity,
            source,
            events: radiosity,
            options: SetupOptions {
                samples: self.rays(),
                ..SetupOptions::default()
            },
        }
    }

    /// v and c, cell by cell on all threads.
    fn solve_in<const B: usize>(&self, absorption: f64) -> Result<SampledSolution, Error> {
        let radiosity = self.cut.radiosity(absorption)?;
        let last = LastStep(&radiosity);
        let setup = self.setup::<B>(&last);
        let mut steps: Vec<Option<CellSteps<B>>> = vec![None; self.cut.cells.number()];
        fill_rows(&mut steps, 1, |cell, row| {
            row.fill(Some(setup.steps(cell)?));
            Ok::<(), GalerkinError>(())
        })?;
        let steps: Vec<CellSteps<B>> = steps.into_iter().flatten().collect();
        let solved: (Vec<f64>, Convergence<f64>) = setup.solve(&steps)?;
        let mut control: Vec<Vec<f64>> = vec![Vec::new(); steps.len()];
        fill_rows(&mut control, 1, |cell, row| {
            if let (Some(own), Some(steps)) = (row.first_mut(), steps.get(cell)) {
                *own = setup.control(cell, steps, &solved.0)?;
            }
            Ok::<(), GalerkinError>(())
        })?;
        Ok(setup.solution(solved, control.concat()))
    }

    pub(crate) fn system(&self, absorption: f64) -> Result<SceneSystem<'m>, Error> {
        let solution = of_degree!(self.cut.degree, B => self.solve_in::<B>(absorption)?);
        Ok(SceneSystem {
            model: self.model,
            cut: Arc::clone(&self.cut),
            solution,
            radius_bound: radius(self.model.scene())?,
        })
    }

    fn plain_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let tables = WalkTables::<F>::new(self.model.scene(), &self.cut)?;
        let radiosity = tables.radiosity(&self.cut, request.walk.absorption)?;
        let last = LastStep(&radiosity);
        let zeros = vec![0.0; request.goals.len()];
        let none = NoNeighbour::<WithKnown<'_, LastStep<'_, Radiosity<'_, F>>>>::new();
        let places = self.model.places(request)?;
        with_job(
            (self.model, &places),
            (&radiosity, &last, &none),
            request,
            // Walks that follow no neighbour equation have 0 in place of v.
            &vec![Some(0.0); places.len()],
            &mut |job| then(&Prepared::plain(job, &zeros)),
        )
    }
}

impl<'m> Partitioned<'m> for ScenePartition<'m> {
    fn cells(&self) -> usize {
        self.cut.cells.number()
    }

    fn unknowns(&self) -> usize {
        self.cells().saturating_mul(self.functions())
    }

    fn memory(&self, goals: &[Goal], _: Pairs) -> usize {
        let (functions, rays) = (self.functions(), self.rays());
        // Of every ray its cell and values, and at most as many blocks of a row; of c a quarter of the rays' number.
        let ray = 4 + 4 * functions;
        let block = 8 + 8 * functions * functions;
        let events = SetupOptions::default().events * (1 + functions) * 16;
        let row = rays * ray + rays.min(self.cells()) * block + rays / 4 * 16 + events;
        let channels = self.model.colours().map_or(0, Colours::channels);
        let vectors = functions * 4 * 8;
        self.cells()
            .saturating_mul(row + vectors)
            .saturating_add(self.channel_memory().saturating_mul(channels))
            .saturating_add(goals.len().saturating_mul(1024))
    }

    fn cost(&self, _: Pairs) -> Cost {
        let LastStepWork { lights, rays } = self.cut.last_step;
        let (number, lights) = (lights, LIGHT * lights);
        // The first ray is one of the score.
        let further = RAY * (rays - 1.0).max(0.0);
        let with_lights = |cost: WalkCost| WalkCost {
            score: cost.score + lights + further,
            ..cost
        };
        // A ray, one to a light, and the two fits; and what share of every light is seen.
        let shares = f64::from(SHARE_RAYS) * number * (RAY + LIGHT);
        let of_cell = self.rays() as f64 * (3.0 * RAY + lights + further) + shares;
        let cost = Cost {
            setup: self.cells() as f64 * of_cell,
            source: 0.0,
            kept: 0.0,
            moments: 0.0,
            moments_power: 0.0,
            walk: with_lights(WALK),
            plain: with_lights(PLAIN),
            light: 0.0,
        };
        match self.model.colours() {
            Some(colours) => cost.shared(colours.shared_names().len(), colours.channels()),
            None => cost,
        }
    }

    fn evaluations(&self, _: u32) -> f64 {
        (self.cells() * self.rays()) as f64
    }

    fn plain_radius(&self, absorption: f64) -> Result<f64, Error> {
        second_moment_radius(self.model.scene(), absorption)
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        let absorption = walk.absorption;
        // h = k.
        fredholm_model::finite::check_plain("reflectance²/(1 − absorption)", absorption, || {
            self.plain_radius(absorption)
        })
    }

    fn check_examination(&self) -> Result<(), Error> {
        match self.model.colours() {
            Some(_) => Err(no_prediction()),
            None => Ok(()),
        }
    }

    fn solve(&self, absorption: f64) -> Result<Box<dyn System + 'm>, Error> {
        if let Some(colours) = self.model.colours() {
            return Ok(Box::new(self.coloured_system(colours, absorption)?));
        }
        Ok(Box::new(self.system(absorption)?))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let solution = of_degree!(self.cut.degree, B => {
            // No absorption matters to the numbers of boxes and functions.
            let radiosity = self.cut.radiosity(0.5)?;
            let last = LastStep(&radiosity);
            let setup = self.setup::<B>(&last);
            let coefficients = self.cells() * setup.coefficients();
            let solution = saved.fitting(self.unknowns(), Some(coefficients), Some(0))?;
            setup.solution(
                (solution.v, solution.convergence),
                saved.coefficients.into_owned(),
            )
        });
        Ok(Box::new(SceneSystem {
            model: self.model,
            cut: Arc::clone(&self.cut),
            solution,
            radius_bound: radius(self.model.scene())?,
        }))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        match self.model.colours() {
            Some(colours) => {
                in_scalar!(self.cut.scalar, F => self.plain_colours::<F>(colours, request, then))
            }
            None => in_scalar!(self.cut.scalar, F => self.plain_in::<F>(request, then)),
        }
    }
}

/// What is said where variances would be predicted.
pub(crate) fn no_prediction() -> Error {
    Error::Option {
        subject: Subject::Problem,
        message: "variances of walks in several channels, or on the way back, are not predicted: give `cells` and `walks`, or an \
                  error"
            .to_owned(),
    }
}

/// No pair is pointwise by itself: all have h = k.
pub(crate) const NO_PAIRS: PointwisePairs = PointwisePairs {
    seen: 0.0,
    hidden: 0.0,
};
