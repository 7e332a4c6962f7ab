//! A solved scene.

use core::num::NonZeroU32;
use std::borrow::Cow;
use std::sync::Arc;

use fredholm_core::galerkin::{GalerkinError, Solution};
use fredholm_core::sampled::{
    CellSteps, Sampled, SampledSetup, SampledSolution, SampledTables, ScoreVariance, SetupOptions,
};
use fredholm_core::{LastStep, Neighbour, NoNeighbour, Real};
use fredholm_embedded::TableBuilder;
use fredholm_model::channels::refuse_device_tables;
use fredholm_model::{
    Error, Examined, GlobalSystem, Pairs, Request, SavedSystem, Subject, System, Then, WalkOptions,
    in_channels, in_scalar,
};
use fredholm_rayon::fill_rows;
use fredholm_scene::{Point, Tint};

use crate::of_degree;
use crate::partition::{Cut, Walked};
use crate::radius::{check_variance, radius};

/// Rays of a score by which the best number of rays is found.
const TRIAL: NonZeroU32 = NonZeroU32::MIN.saturating_add(3);
/// What the rest of a walk takes, in rays of its scores: its own rays, those to lights, and the form factors of c's events.
const REST: f64 = 3.0;

/// A neighbour equation of any degree: one type of walk for all.
pub(crate) type AnyNeighbour<'a, F, V> =
    dyn Neighbour<Scalar = F, Point = Point<F>, Value = V> + Sync + 'a;

/// The neighbour equation from rays of B functions on a cell, with faces that they cross as events.
type FromRays<'a, F, C, const B: usize> = Sampled<'a, Walked<'a, F, C>, 2, B, Walked<'a, F, C>>;

/// The set-up of v and c from rays.
type Setup<'a, C, const B: usize> = SampledSetup<'a, Walked<'a, f64, C>, 2, B, Walked<'a, f64, C>>;

/// The neighbour equation with a number of rays a score.
fn from_rays<'a, F: Real, C: Tint<F>, const B: usize>(
    tables: &'a SampledTables<F>,
    equation: &'a Walked<'a, F, C>,
    rays: NonZeroU32,
) -> Result<FromRays<'a, F, C, B>, Error> {
    let neighbour = tables.neighbour(equation, equation, rays);
    neighbour.map_err(|_| Error::Internal("tables of other cells"))
}

/// The number of rays a score with the least product of variance and time.
pub(crate) fn best_rays<F: Real, C: Tint<F>, const B: usize>(
    tables: &SampledTables<F>,
    equation: &Walked<'_, F, C>,
) -> Result<NonZeroU32, Error> {
    let trial = from_rays::<F, C, B>(tables, equation, TRIAL)?;
    Ok(ScoreVariance::estimate(equation, &trial, TRIAL).best_steps(REST))
}

/// The most events of a cell.
pub(crate) fn events() -> usize {
    SetupOptions::default().events
}

impl Cut<'_> {
    /// The neighbour equation of these tables, or of none.
    pub(crate) fn neighbour<'a, F: Real, C: Tint<F>>(
        &self,
        tables: Option<&'a SampledTables<F>>,
        equation: &'a Walked<'a, F, C>,
    ) -> Result<Box<AnyNeighbour<'a, F, C::Value>>, Error> {
        let Some(tables) = tables else {
            return Ok(Box::new(NoNeighbour::new(equation)));
        };
        Ok(of_degree!(self.degree, B => {
            let rays = best_rays::<F, C, B>(tables, equation)?;
            Box::new(from_rays::<F, C, B>(tables, equation, rays)?)
        }))
    }

    pub(crate) fn setup<'a, C: Tint<f64>, const B: usize>(
        &self,
        equation: &'a Walked<'a, f64, C>,
    ) -> Setup<'a, C, B> {
        SampledSetup {
            equation,
            events: equation,
            options: SetupOptions {
                samples: self.rays(),
                ..SetupOptions::default()
            },
        }
    }

    /// v and c of all channels, cell by cell on all threads.
    pub(crate) fn solve<C: Tint<f64>, const B: usize>(
        &self,
        equation: &Walked<'_, f64, C>,
    ) -> Result<SampledSolution, Error> {
        let setup = self.setup::<C, B>(equation);
        let mut steps: Vec<Option<CellSteps<B>>> = vec![None; self.cells()];
        fill_rows(&mut steps, 1, |cell, row| {
            row.fill(Some(setup.steps(cell)?));
            Ok::<(), GalerkinError>(())
        })?;
        let steps: Vec<CellSteps<B>> = steps.into_iter().flatten().collect();
        let solved = setup.solve(&steps)?;
        let mut control: Vec<Vec<f64>> = vec![Vec::new(); steps.len()];
        fill_rows(&mut control, 1, |cell, row| {
            row.fill(setup.control(cell, &steps[cell], &solved)?);
            Ok::<(), GalerkinError>(())
        })?;
        Ok(setup.solution(&solved, control.concat())?)
    }
}

/// v and c of a scene.
pub(crate) struct SceneSystem<'m> {
    pub(crate) cut: Arc<Cut<'m>>,
    pub(crate) solution: SampledSolution,
    /// The largest ρ if it is below 1; otherwise the spectral radius of T_K as rays from few cells have it.
    pub(crate) radius_bound: f64,
}

impl<'m> SceneSystem<'m> {
    pub(crate) fn new(cut: &Arc<Cut<'m>>, solution: SampledSolution) -> Result<Self, Error> {
        Ok(Self {
            cut: Arc::clone(cut),
            solution,
            radius_bound: radius(&cut.model.scene, 1, 1.0)?,
        })
    }
}

impl System for SceneSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        check_variance(&self.cut.model.scene, walk.absorption)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => {
            let tables = self.cut.tables::<F>()?;
            in_channels!(tables.radiosity()?, &tables.channels, radiosity => {
                self.cut.job(&LastStep(radiosity), Some(self), request, then)
            })
        })
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn GlobalSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        match self.cut.model.scene.has_sunlight() {
            true => Err(Error::Option {
                subject: Subject::Problem,
                message: "where sunlight is told apart from heat there is no global estimate: leave `global` out"
                    .to_owned(),
            }),
            false => Ok(self),
        }
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.examine_drawn(request, nodes, then)
    }

    /// None of the way back: its receivers are no part of the scene.
    fn saved(&self) -> Option<SavedSystem<'_>> {
        self.cut.model.adjoint.is_none().then(|| SavedSystem {
            solution: Cow::Owned(Solution {
                v: self.solution.v().to_vec(),
                convergence: self.solution.convergence(),
                radius_bound: self.radius_bound,
            }),
            coefficients: Cow::Borrowed(self.solution.control()),
        })
    }

    fn tables(&self, _: Pairs) -> Result<TableBuilder, Error> {
        if self.cut.wide.channels.is_some() {
            return refuse_device_tables();
        }
        in_scalar!(self.cut.scalar, F => crate::export::scene::<F>(self))
    }
}
