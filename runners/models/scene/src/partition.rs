//! Cells of a scene, before anything is solved.

use std::sync::Arc;

use fredholm_core::galerkin::functions;
use fredholm_core::{LastStep, Real};
use fredholm_model::cost::{Cost, WalkCost};
use fredholm_model::{
    Discretisation, Error, Goal, Pairs, Partitioned, Request, SavedSystem, Scalar, Subject, System,
    Then, WalkOptions, in_channels, in_scalar,
};
use fredholm_scene::{Cells, ColourTables, Radiosity, Scene, Tables};

use crate::SceneModel;
use crate::of_degree;
use crate::radius::{check_variance, radius};
use crate::system::{SceneSystem, events};

/// About so many cells where nothing is said of them.
const DEFAULT_CELLS: usize = 500;
/// Rays of a set-up in all, divided among the cells: seconds of work and a few hundred megabytes at most.
const RAYS: usize = 1 << 22;
/// Rays of a cell at least, for a fit that is worth its name, and at most, beyond which it hardly gets better.
const RAYS_OF_CELL: [usize; 2] = [256, 4096];
/// Rays to each light from each cell, to know what share of it the cell sees.
const SHARE_RAYS: u32 = 64;
/// Rays to a light of which a cell sees a part.
const PARTIAL: f64 = 4.0;
/// Seconds of a ray in a set-up, on the machine that this and what follows was measured on.
const RAY: f64 = 0.7e-6;
/// Seconds of the form factor of a light: in a last step for each of them.
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

/// The equation of walks: that of a scene with a last step to the light.
pub(crate) type Walked<'a, F, C> = LastStep<'a, Radiosity<'a, F, C>>;

/// The tables of walks in a scalar.
#[derive(Debug)]
pub(crate) struct WalkTables<F> {
    tables: Tables<F>,
    pub(crate) cells: Cells<F>,
    /// What of each light each cell sees.
    pub(crate) shares: Arc<[u8]>,
    pub(crate) channels: Option<ColourTables<F>>,
}

impl<F: Real> WalkTables<F> {
    /// The equation of one channel, from which [`in_channels`] makes that of all.
    pub(crate) fn radiosity(&self) -> Result<Radiosity<'_, F>, Error> {
        let radiosity = Radiosity::new(self.tables.geometry(), &self.cells)?;
        Ok(radiosity.with_visible_shares(&self.shares)?)
    }
}

/// A cell of a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceCell {
    pub(crate) face: u32,
    pub(crate) area: f64,
}

/// The scene that walks go through, in cells.
#[derive(Debug)]
pub(crate) struct Cut<'m> {
    pub(crate) model: &'m SceneModel,
    /// The tables in f64.
    pub(crate) wide: WalkTables<f64>,
    /// The number of cells that was asked for: in another scalar they are made by it again.
    wanted: usize,
    pub(crate) degree: usize,
    pub(crate) scalar: Scalar,
    /// The cells of faces; those of the sky come behind them.
    pub(crate) faces: Vec<FaceCell>,
}

impl<'m> Cut<'m> {
    /// The number of cells, of which every patch of the sky is one.
    pub(crate) const fn cells(&self) -> usize {
        self.wide.cells.number()
    }

    pub(crate) const fn functions(&self) -> usize {
        functions(2, self.degree)
    }

    /// The number of channels.
    pub(crate) fn channels(&self) -> usize {
        let own = self.wide.channels.as_ref();
        own.map_or(1, |channels| channels.channels)
    }

    /// The tables of walks in a scalar.
    pub(crate) fn tables<F: Real>(&self) -> Result<WalkTables<F>, Error> {
        let scene = self.model.walked();
        Ok(WalkTables {
            tables: Tables::new(scene),
            cells: Cells::new(scene, self.wanted)?,
            shares: Arc::clone(&self.wide.shares),
            channels: self.wide.channels.as_ref().map(ColourTables::rounded),
        })
    }

    /// Rays from every cell.
    pub(crate) fn rays(&self) -> usize {
        let [least, most] = RAYS_OF_CELL;
        (RAYS / self.cells()).clamp(least, most)
    }
}

/// The number of rays that a step takes: one goes on from a mirror with the probability ρ_s. Of the mean ρ_s by area, 1/(1 − ρ_s).
fn rays_of_a_step(scene: &Scene) -> f64 {
    let faces = scene.faces().iter().enumerate();
    let (mut mirrored, mut area) = (0.0, 0.0);
    for (number, face) in faces {
        mirrored += face.area * scene.specular(number);
        area += face.area;
    }
    area / (area - mirrored)
}

/// A scene and its cells.
#[derive(Debug)]
pub(crate) struct ScenePartition<'m>(pub(crate) Arc<Cut<'m>>);

impl<'m> ScenePartition<'m> {
    pub(crate) fn new(
        model: &'m SceneModel,
        discretisation: &Discretisation,
    ) -> Result<Self, Error> {
        let scene = model.walked();
        let wanted = discretisation.cells.unwrap_or(DEFAULT_CELLS);
        let (tables, cells) = (Tables::new(scene), Cells::new(scene, wanted)?);
        let radiosity = Radiosity::new(tables.geometry(), &cells)?;
        let shares = radiosity.visible_shares(SHARE_RAYS).into();
        let faces = (0..cells.number()).map_while(|cell| {
            let (face, _) = radiosity.corners(cell)?;
            let area = fredholm_core::galerkin::Cells::measure(&radiosity, cell);
            Some(FaceCell { face, area })
        });
        let faces = faces.collect();
        let channels = model.face_channels();
        Ok(Self(Arc::new(Cut {
            model,
            wide: WalkTables {
                tables,
                cells,
                shares,
                channels,
            },
            wanted,
            degree: discretisation.degree,
            scalar: discretisation.scalar,
            faces,
        })))
    }

    pub(crate) fn system(&self) -> Result<SceneSystem<'m>, Error> {
        let cut = &self.0;
        let solution = in_channels!(cut.wide.radiosity()?, &cut.wide.channels, radiosity => {
            of_degree!(cut.degree, B => cut.solve::<_, B>(&LastStep(radiosity))?)
        });
        SceneSystem::new(cut, solution)
    }
}

impl<'m> Partitioned<'m> for ScenePartition<'m> {
    fn cells(&self) -> usize {
        self.0.cells()
    }

    fn unknowns(&self) -> usize {
        self.cells().saturating_mul(self.0.functions())
    }

    fn memory(&self, goals: &[Goal], _: Pairs) -> usize {
        let (functions, rays) = (self.0.functions(), self.0.rays());
        // Of every ray its cell and values, and at most as many blocks of a row; of c a quarter of the rays' number.
        let ray = 4 + 4 * functions;
        let block = 8 + 8 * functions * functions;
        let row = rays * ray + rays.min(self.cells()) * block;
        let of_channel = functions * 4 * 8 + rays / 4 * 16 + events() * (1 + functions) * 16;
        self.cells()
            .saturating_mul(row.saturating_add(of_channel.saturating_mul(self.0.channels())))
            .saturating_add(goals.len().saturating_mul(1024))
    }

    fn cost(&self, _: Pairs) -> Cost {
        let (model, shares) = (self.0.model, &*self.0.wide.shares);
        let number = self.0.wide.cells.tables().lights.len() as f64;
        let lights = LIGHT * number;
        // The first ray is one of the score.
        let partial = shares.iter().filter(|share| !matches!(share, 0 | 255));
        let further = (PARTIAL - 1.0) * RAY * partial.count() as f64 / shares.len().max(1) as f64;
        let rays = rays_of_a_step(&model.scene);
        let with_lights = |cost: WalkCost| WalkCost {
            step: rays * cost.step,
            score: rays * cost.score + lights + further,
            ..cost
        };
        // A ray, one to a light, and the two fits; and what share of every light is seen.
        let of_shares = f64::from(SHARE_RAYS) * number * (RAY + LIGHT);
        let of_cell = self.0.rays() as f64 * (3.0 * rays * RAY + lights + further) + of_shares;
        let mut cost = Cost {
            setup: self.cells() as f64 * of_cell,
            source: 0.0,
            kept: 0.0,
            walk: with_lights(WALK),
            plain: with_lights(PLAIN),
            light: 0.0,
        };
        match (&model.adjoint, model.colours()) {
            (Some(adjoint), _) => {
                // What a source gives to receivers directly is a score, and its first ray a step.
                let first = cost.plain.score + cost.plain.step;
                cost.plain.start += first;
                cost.walk.start += first + adjoint.looks * RAY;
                cost.shared(adjoint.goals.len(), self.0.channels())
            }
            (None, Some(colours)) => cost.shared(colours.names.shared().len(), self.0.channels()),
            (None, None) => cost,
        }
    }

    fn evaluations(&self, _: u32) -> f64 {
        (self.cells() * self.0.rays()) as f64
    }

    fn plain_radius(&self) -> Result<f64, Error> {
        radius(&self.0.model.scene, 2, 1.0)
    }

    /// h = k.
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        check_variance(&self.0.model.scene, walk.absorption)
    }

    fn examined_points(&self) -> Result<usize, Error> {
        if self.0.wide.channels.is_none() {
            return Ok(0);
        }
        Err(Error::Option {
            subject: Subject::Problem,
            message: "variances of walks in several channels, or on the way back, are not predicted: give `cells` and \
                      `walks`, or an error"
                .to_owned(),
        })
    }

    fn solve(&self) -> Result<Box<dyn System + 'm>, Error> {
        Ok(Box::new(self.system()?))
    }

    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let cut = &self.0;
        let unknowns = self.unknowns().saturating_mul(cut.channels());
        let solution = in_channels!(cut.wide.radiosity()?, &cut.wide.channels, radiosity => {
            of_degree!(cut.degree, B => {
                let equation = LastStep(radiosity);
                let setup = cut.setup::<_, B>(&equation);
                let coefficients = self.cells().saturating_mul(setup.coefficients());
                let solution = saved.fitting(unknowns, Some(coefficients))?;
                setup.restore(solution.v, saved.coefficients.into_owned(), solution.convergence)?
            })
        });
        Ok(Box::new(SceneSystem::new(cut, solution)?))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.0.scalar, F => {
            let tables = self.0.tables::<F>()?;
            in_channels!(tables.radiosity()?, &tables.channels, radiosity => {
                self.0.job(&LastStep(radiosity), None, request, then)
            })
        })
    }
}
