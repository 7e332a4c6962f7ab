//! A solved room.

use std::borrow::Cow;
use std::sync::OnceLock;

use fredholm_core::galerkin::Solution;
use fredholm_core::{LastStep, Neighbour, NoNeighbour, Real, Value, WideOf};
use fredholm_embedded::TableBuilder;
use fredholm_model::cost::PointwisePairs;
use fredholm_model::numbers::largest;
use fredholm_model::{
    Error, Examined, GlobalSystem, Pairs, Prepared, Request, SavedSystem, Subject, System, Then,
    WalkOptions, in_scalar,
};
use fredholm_rayon::fill_rows;
use fredholm_room::{
    CellRays, CoarseSolution, ExactNeighbour, Point, RaySetup, RayTables, RoomEquation, Shadows,
    VisibilityTable, side_by_side, subtract_lights,
};

use crate::global::RoomGlobal;
use crate::partition::{FEW, RoomPartition, SWEEPS, TOLERANCE, is_from_few};
use crate::{of_degree, with_equation};

/// A neighbour equation of any degree: one type of walk for all.
pub(crate) type AnyNeighbour<'a, F, V> =
    dyn Neighbour<Scalar = F, Point = Point<F>, Value = V> + Sync + 'a;

/// What walks follow.
pub(crate) struct Follow<'w, F, V> {
    pub(crate) neighbour: &'w AnyNeighbour<'w, F, V>,
    /// The polynomials of v, B numbers of every channel, cell by cell; `None`: walks are plain.
    pub(crate) v: Option<&'w [F]>,
    /// Functions on a cell.
    pub(crate) functions: usize,
    /// Whether v has T_K F_s besides its polynomials.
    pub(crate) has_light: bool,
}

/// What is done with it.
pub(crate) type Use<'a, F, V> = dyn FnMut(&Follow<'_, F, V>) -> Result<(), Error> + 'a;

/// What is done with plain walks.
pub(crate) fn plain<F: Real, E: RoomEquation<F>>(
    equation: &E,
    then: &mut Use<'_, F, E::Value>,
) -> Result<(), Error> {
    then(&Follow {
        neighbour: &NoNeighbour::<LastStep<'_, E>>::new(&LastStep(equation)),
        v: None,
        functions: 1,
        has_light: false,
    })
}

impl<F: Real, V: Value<F>> Follow<'_, F, V> {
    /// A functional of the polynomials, channel by channel; 0 of plain walks.
    pub(crate) fn of_channels(&self, channels: usize, of: &dyn Fn(&[F]) -> f64) -> V::Wide {
        V::Wide::from_fn(channels, |channel| {
            let Some(v) = self.v else { return 0.0 };
            let cells = v.chunks_exact(self.functions);
            let own: Vec<F> = cells
                .skip(channel)
                .step_by(channels)
                .flatten()
                .copied()
                .collect();
            of(&own)
        })
    }
}

/// v of a neighbour equation of rays, and its tables.
#[derive(Debug)]
struct Rays {
    v: Vec<f64>,
    tables: RayTables<f64>,
}

/// v of a room.
#[derive(Debug)]
pub(crate) struct RoomSystem<'m> {
    pub(crate) cut: RoomPartition<'m>,
    /// v ≈ u, and how it was found: B numbers of every channel, cell by cell.
    pub(crate) solution: Solution,
    /// What cells see of each other, if v came from that.
    views: Cow<'m, [u8]>,
    /// Rays without a last step to the light, and with one, each made at the first call.
    rays: [OnceLock<Rays>; 2],
}

impl<'m> RoomPartition<'m> {
    /// v of every channel.
    pub(crate) fn system(&self) -> Result<RoomSystem<'m>, Error> {
        let scene = &self.model.scene;
        let walls = self.model.wall_colours();
        let colours = walls.as_ref().map(|walls| walls.colours()).transpose()?;
        let (solutions, v, views) = if is_from_few(self.unknowns_of_channel(), self.cut.degree) {
            let unknowns = self.unknowns_of_channel().min(FEW);
            let few = match &colours {
                None => CoarseSolution::new(scene, unknowns)?,
                Some(colours) => CoarseSolution::of_channels(scene, unknowns, colours)?,
            };
            let tables = self.tables::<f64>();
            let mut v = vec![0.0; self.unknowns_of_channel() * self.channels()];
            with_equation!(tables, VisibilityTable::none(), &[], equation => {
                of_degree!(self.cut.degree, B => fill_rows(&mut v, B * self.channels(), |cell, row| {
                    few.step::<_, B>(equation, cell, row);
                    Ok::<(), Error>(())
                })?);
            });
            (few.solutions().to_vec(), v, Vec::new())
        } else {
            let matrix = self.matrix()?;
            let solutions = match &colours {
                None => vec![matrix.solve(scene, &self.mesh, TOLERANCE, SWEEPS)?],
                Some(colours) => {
                    matrix.solve_channels(scene, &self.mesh, colours, TOLERANCE, SWEEPS)?
                }
            };
            let v = side_by_side(&solutions, self.functions());
            (solutions, v, matrix.views().table().to_vec())
        };
        let convergence = solutions.iter().map(|own| own.convergence);
        let worst = convergence.max_by_key(|convergence| convergence.sweeps);
        let bounds = solutions.iter().map(|own| own.radius_bound);
        let solution = Solution {
            v,
            convergence: worst.unwrap_or(fredholm_model::NO_ITERATION),
            radius_bound: bounds.fold(0.0, f64::max),
        };
        Ok(self.with_solution(solution, views.into()))
    }

    pub(crate) fn with_solution(&self, solution: Solution, views: Cow<'m, [u8]>) -> RoomSystem<'m> {
        RoomSystem {
            cut: self.clone(),
            solution,
            views,
            rays: [OnceLock::new(), OnceLock::new()],
        }
    }
}

impl RoomSystem<'_> {
    /// What cells see of each other, if that is known.
    pub(crate) fn views(&self) -> Result<VisibilityTable<'_>, Error> {
        Ok(VisibilityTable::new(&self.views, self.cut.mesh.len())?)
    }

    /// v and the tables of rays, with or without a last step to the light, made at the first call.
    fn rays(&self, last_step: bool) -> Result<&Rays, Error> {
        let kept = &self.rays[usize::from(last_step)];
        if let Some(rays) = kept.get() {
            return Ok(rays);
        }
        let (cut, model) = (&self.cut, self.cut.model);
        let lights = model.lights(last_step);
        let (tables, shadows) = (cut.tables::<f64>(), Shadows::new(&model.scene));
        let mut v = self.solution.v.clone();
        let mut cells = vec![CellRays::default(); cut.mesh.len()];
        with_equation!(tables, self.views()?, lights, equation => of_degree!(cut.cut.degree, B => {
            if !lights.is_empty() {
                fill_rows(&mut v, B * cut.channels(), |cell, row| {
                    subtract_lights::<_, B>(equation, cell, row);
                    Ok::<(), Error>(())
                })?;
            }
            let setup = RaySetup::<_, B>::new(equation, &v)?.with_shadows(&shadows);
            fill_rows(&mut cells, 1, |cell, row| {
                row.fill(setup.cell(cell));
                Ok::<(), Error>(())
            })?;
        }));
        let tables = RayTables::new(cells)?;
        Ok(kept.get_or_init(|| Rays { v, tables }))
    }

    /// v in the scalar of walks, and the tables of rays, without a last step.
    pub(crate) fn ray_tables<F: Real>(&self) -> Result<(Vec<F>, RayTables<F>), Error> {
        let Rays { v, tables } = self.rays(false)?;
        let v = fredholm_core::galerkin::rounded(v)?;
        Ok((v, tables.rounded()?))
    }

    /// Hands out the neighbour equation of a room with the lights of these walks.
    pub(crate) fn with_neighbour<F: Real, E: RoomEquation<F> + Sync>(
        &self,
        equation: &E,
        walk: &WalkOptions,
        then: &mut Use<'_, F, E::Value>,
    ) -> Result<(), Error> {
        let rounded = fredholm_core::galerkin::rounded::<F>;
        let functions = self.cut.functions();
        of_degree!(self.cut.cut.degree, B => match walk.pairs {
            Pairs::Pointwise => {
                let mut v = self.solution.v.clone();
                self.subtract_emission(equation, &mut v);
                let v = rounded(&v)?;
                then(&Follow {
                    neighbour: &ExactNeighbour::<_, F, B>::new(equation, &v)?,
                    v: Some(&v),
                    functions,
                    has_light: false,
                })
            }
            _ => {
                let Rays { v, tables } = self.rays(walk.last_step)?;
                let (v, tables) = (rounded(v)?, tables.rounded::<F>()?);
                then(&Follow {
                    neighbour: &tables.neighbour::<_, B>(equation, &v)?,
                    v: Some(&v),
                    functions,
                    has_light: !equation.room().lights().is_empty(),
                })
            }
        })
    }

    /// Takes the emission of lights, constant on cells, from v: what is left is that of w = u − F_s.
    fn subtract_emission<F: Real, E: RoomEquation<F>>(&self, equation: &E, v: &mut [f64]) {
        let (room, channels) = (equation.room(), equation.channels());
        let own = v.chunks_exact_mut(channels * self.cut.functions());
        for (cell, v) in own.enumerate() {
            let Some(x) = room.inside(cell, F::from_f64(0.5)) else {
                continue;
            };
            let known = equation.known(&x).wide();
            let first = v.iter_mut().step_by(self.cut.functions());
            for (channel, first) in first.enumerate() {
                *first -= known.get(channel);
            }
        }
    }

    fn job_in<F: Real, E: RoomEquation<F> + Sync>(
        &self,
        equation: &E,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error>
    where
        WideOf<E>: Sync,
    {
        self.with_neighbour(equation, request.walk, &mut |follow| {
            let model = self.cut.model;
            model.with_job(equation, follow, request, &mut |job, galerkin| {
                then(&Prepared {
                    job,
                    galerkin,
                    largest: largest(follow.v.unwrap_or_default()),
                    radius_bound: self.solution.radius_bound,
                    convergence: self.solution.convergence,
                    pointwise: self.cut.all_pairs(request.walk.pairs),
                    neighbour_second_moment_radius: None,
                })
            })
        })
    }

    /// Refuses what there is of one channel alone.
    fn check_one_channel(&self, what: &str) -> Result<(), Error> {
        if self.cut.model.colours().is_none() {
            return Ok(());
        }
        Err(Error::Option {
            subject: Subject::Problem,
            message: format!(
                "there are no {what} of a room in several channels: leave `channels` out, with one reflectance and emission for \
                 each surface"
            ),
        })
    }
}

impl System for RoomSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cut.refuse_infinite(walk)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let lights = self.cut.model.lights(request.walk.last_step);
        in_scalar!(self.cut.cut.scalar, F => {
            let tables = self.cut.tables::<F>();
            with_equation!(tables, self.views()?, lights, equation => {
                self.job_in(equation, request, then)
            })
        })
    }

    fn examine(
        &self,
        request: &Request<'_>,
        nodes: usize,
        then: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        self.check_one_channel("predictions of variances")?;
        self.examine_walks(request, nodes, then)
    }

    fn tables(&self, _: Pairs) -> Result<TableBuilder, Error> {
        self.check_one_channel("device tables")?;
        in_scalar!(self.cut.cut.scalar, F => crate::export::room::<F>(self))
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        Some(SavedSystem {
            solution: Cow::Borrowed(&self.solution),
            coefficients: Cow::Borrowed(&[]),
            views: Cow::Borrowed(&self.views),
        })
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn GlobalSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        self.check_one_channel("global estimates")?;
        Ok(Box::new(RoomGlobal::new(*self)))
    }
}

impl RoomPartition<'_> {
    /// The pairs of a score: all if they are pointwise, and none of a ray.
    pub(crate) fn all_pairs(&self, pairs: Pairs) -> PointwisePairs {
        let seen = match pairs {
            Pairs::Pointwise => self.mesh.len() as f64,
            _ => 0.0,
        };
        PointwisePairs { seen, hidden: 0.0 }
    }
}
