//! A solved room.

use std::borrow::Cow;
use std::sync::OnceLock;

use fredholm_core::galerkin::{Cells as _, Dense, PairTable, Solution, second_moment_radius};
use fredholm_core::{
    Equation as _, LastStep, Lights as _, MOST_CHANNELS, Neighbour, NoNeighbour, Real, Value,
};
use fredholm_embedded::TableBuilder;
use fredholm_model::cost::PointwisePairs;
use fredholm_model::finite::refuse;
use fredholm_model::numbers::largest;
use fredholm_model::{
    Error, Examined, GlobalSystem, Pairs, Prepared, Request, SavedSystem, Subject, System, Then,
    WalkOptions, in_channels, in_scalar,
};
use fredholm_rayon::fill_rows;
use fredholm_room::{
    CellRays, CoarseSolution, ExactNeighbour, Grey, Matrix, Point, RayNeighbour, RaySetup,
    RayTables, Room, RowFill, Tint, paper_pairs, subtract_lights,
};

use crate::of_degree;
use crate::partition::{RoomPartition, few};

/// Places of a cell in which h is largest.
const ENDS: [f64; 3] = [1e-6, 0.5, 1.0 - 1e-6];

/// A neighbour equation of any degree: one type of walk for all.
pub(crate) type AnyNeighbour<'a, F, V> =
    dyn Neighbour<Scalar = F, Point = Point<F>, Value = V> + Sync + 'a;

/// What walks follow.
pub(crate) struct Follow<'w, F, V> {
    pub(crate) neighbour: Box<AnyNeighbour<'w, F, V>>,
    /// The polynomials of v, B numbers of every channel, cell by cell; `None`: walks are plain.
    pub(crate) v: Option<&'w [F]>,
    /// Functions on a cell.
    pub(crate) functions: usize,
    /// Whether v has T_K F_s besides its polynomials.
    pub(crate) has_light: bool,
}

/// What plain walks follow.
pub(crate) fn plain<'w, F: Real, C: Tint<F>>(
    equation: &'w Room<'_, F, C>,
) -> Follow<'w, F, C::Value> {
    Follow {
        neighbour: Box::new(NoNeighbour::new(&LastStep(equation))),
        v: None,
        functions: 1,
        has_light: false,
    }
}

/// v in the scalar of walks and, unless all pairs are pointwise, the tables of rays.
pub(crate) struct Vectors<F> {
    v: Vec<F>,
    rays: Option<RayTables<F>>,
    degree: usize,
}

impl<F: Real> Vectors<F> {
    /// What walks of an equation follow.
    pub(crate) fn follow<'w, C: Tint<F>>(
        &'w self,
        equation: &'w Room<'_, F, C>,
    ) -> Result<Follow<'w, F, C::Value>, Error> {
        of_degree!(self.degree, B => Ok(Follow {
            neighbour: match &self.rays {
                None => Box::new(ExactNeighbour::<_, F, B>::new(equation, &self.v)?),
                Some(rays) => Box::new(RayNeighbour::<_, F, B>::new(equation, &self.v, rays.control())?),
            },
            v: Some(&self.v),
            functions: B,
            has_light: self.rays.is_some() && !equation.lights().is_empty(),
        }))
    }
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

/// K' and the kinds of all pairs in the method of the paper, and the spectral radius of T_h²p.
#[derive(Debug)]
struct Paper {
    matrix: Matrix,
    kinds: Vec<u8>,
    radius: f64,
}

/// v of a room.
#[derive(Debug)]
pub(crate) struct RoomSystem<'m> {
    pub(crate) cut: RoomPartition<'m>,
    /// v ≈ u, and how it was found: B numbers of every channel, cell by cell.
    pub(crate) solution: Solution,
    /// Rays without a last step to the light, and with one, each made at the first call.
    rays: [OnceLock<Rays>; 2],
    /// What the method of the paper takes, made at the first call.
    paper: OnceLock<Paper>,
}

/// Fills the rows of a matrix on the threads of the current rayon pool.
fn on_all_cores(entries: &mut [f64], width: usize, fill: RowFill<'_>) -> Result<(), Error> {
    fill_rows(entries, width, |cell, rows| Ok(fill(cell, rows)?))
}

impl<'m> RoomPartition<'m> {
    /// v of every channel.
    pub(crate) fn system(&self) -> Result<RoomSystem<'m>, Error> {
        let scene = &self.model.scene;
        let few = few(self.unknowns_of_channel());
        let few = match self.model.wall_colours() {
            None => CoarseSolution::with_rows(scene, few, &Grey, on_all_cores)?,
            Some(colours) => {
                let tint = colours.tint::<MOST_CHANNELS>();
                CoarseSolution::with_rows(scene, few, &tint, on_all_cores)?
            }
        };
        let tables = self.tables::<f64>();
        let mut v = vec![0.0; self.unknowns_of_channel() * self.channels()];
        in_channels!(tables.tables.room(), &tables.colours, equation => {
            of_degree!(self.cut.degree, B => fill_rows(&mut v, B * self.channels(), |cell, row| {
                few.step::<_, B>(equation, cell, row);
                Ok::<(), Error>(())
            })?);
        });
        let solutions = few.solutions();
        let convergence = solutions.iter().map(|own| own.convergence);
        let worst = convergence.max_by_key(|convergence| convergence.sweeps);
        let bounds = solutions.iter().map(|own| own.radius_bound);
        let solution = Solution {
            v,
            convergence: worst.unwrap_or(fredholm_model::NO_ITERATION),
            radius_bound: bounds.fold(0.0, f64::max),
        };
        Ok(self.with_solution(solution))
    }

    pub(crate) fn with_solution(&self, solution: Solution) -> RoomSystem<'m> {
        RoomSystem {
            cut: self.clone(),
            solution,
            rays: [OnceLock::new(), OnceLock::new()],
            paper: OnceLock::new(),
        }
    }
}

impl RoomSystem<'_> {
    /// v and the tables of rays, with or without a last step to the light, made at the first call.
    fn rays(&self, last_step: bool) -> Result<&Rays, Error> {
        let kept = &self.rays[usize::from(last_step)];
        if let Some(rays) = kept.get() {
            return Ok(rays);
        }
        let (cut, model) = (&self.cut, self.cut.model);
        let lights = model.lights(last_step);
        let tables = cut.tables::<f64>();
        let mut v = self.solution.v.clone();
        let mut cells = vec![CellRays::default(); cut.mesh.len()];
        let room = tables.tables.room().with_lights(lights)?;
        in_channels!(room, &tables.colours, equation => of_degree!(cut.cut.degree, B => {
            if !lights.is_empty() {
                fill_rows(&mut v, B * cut.channels(), |cell, row| {
                    subtract_lights::<_, B>(equation, cell, row);
                    Ok::<(), Error>(())
                })?;
            }
            let setup = RaySetup::<_, B>::new(equation, &v)?.with_shadows(&model.scene);
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

    fn paper(&self) -> Result<&Paper, Error> {
        if let Some(paper) = self.paper.get() {
            return Ok(paper);
        }
        let tables = self.cut.tables::<f64>();
        let room = tables.tables.room();
        let matrix = Matrix::with_rows::<1, _>(&room, on_all_cores)?;
        let kinds = paper_pairs(&self.cut.model.scene, &room)?;
        let points = |cell| ENDS.into_iter().filter_map(move |t| room.inside(cell, t));
        let radius = second_moment_radius::<_, _, _, 1>(
            &room,
            &matrix.coefficients(),
            &PairTable::new(&kinds, room.cells())?,
            points,
            |_, _| 0.0,
        )?;
        let paper = Paper {
            matrix,
            kinds,
            radius,
        };
        Ok(self.paper.get_or_init(|| paper))
    }

    /// Hands out what walks in one channel without a last step follow, by pairs of cells if the paper's are asked for.
    pub(crate) fn with_any_neighbour<F: Real>(
        &self,
        room: &Room<'_, F>,
        walk: &WalkOptions,
        then: impl FnOnce(&Follow<'_, F, F>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if walk.pairs != Pairs::Paper {
            return then(&self.vectors(room, walk)?.follow(room)?);
        }
        let Paper { matrix, kinds, .. } = self.paper()?;
        let pairs = PairTable::new(kinds, matrix.cells())?;
        let vectors = self
            .solution
            .for_walks::<F, _>(&matrix.coefficients(), pairs)?;
        let entries = fredholm_core::galerkin::rounded::<F>(matrix.entries())?;
        let dense = Dense::new(&entries, matrix.cells(), 1);
        let dense = dense.ok_or(Error::Internal("a table has a wrong size"))?;
        then(&Follow {
            neighbour: Box::new(vectors.piecewise::<_, _, 1>(room, &dense)?),
            v: Some(vectors.v()),
            functions: 1,
            has_light: false,
        })
    }

    /// The vectors of walks of a room with their lights.
    pub(crate) fn vectors<F: Real, C: Tint<F>>(
        &self,
        equation: &Room<'_, F, C>,
        walk: &WalkOptions,
    ) -> Result<Vectors<F>, Error> {
        let rounded = fredholm_core::galerkin::rounded::<F>;
        let (v, rays) = match walk.pairs {
            Pairs::Paper => {
                return Err(Error::Option {
                    subject: Subject::Pairs,
                    message: "the paper's pairs of cells serve walks in one channel, without a last step, a picture or a prediction: leave \
                              `method` and `pairs` out"
                        .to_owned(),
                });
            }
            Pairs::Pointwise => {
                let mut v = self.solution.v.clone();
                self.subtract_emission(equation, &mut v);
                (rounded(&v)?, None)
            }
            _ => {
                let Rays { v, tables } = self.rays(walk.last_step)?;
                (rounded(v)?, Some(tables.rounded()?))
            }
        };
        Ok(Vectors {
            v,
            rays,
            degree: self.cut.cut.degree,
        })
    }

    /// Takes the emission of lights, constant on cells, from v: what is left is that of w = u − F_s.
    fn subtract_emission<F: Real, C: Tint<F>>(&self, equation: &Room<'_, F, C>, v: &mut [f64]) {
        let channels = equation.channels();
        let own = v.chunks_exact_mut(channels * self.cut.functions());
        for (cell, v) in own.enumerate() {
            let Some(x) = equation.inside(cell, F::from_f64(0.5)) else {
                continue;
            };
            let known = equation.known(&x).wide();
            let first = v.iter_mut().step_by(self.cut.functions());
            for (channel, first) in first.enumerate() {
                *first -= known.get(channel);
            }
        }
    }

    fn hand_on<F: Real, C: Tint<F>>(
        &self,
        equation: &Room<'_, F, C>,
        follow: &Follow<'_, F, C::Value>,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let walk = request.walk;
        let radius = match walk.pairs {
            Pairs::Paper if !walk.allow_infinite_variance => Some(self.paper()?.radius),
            _ => None,
        };
        if let Some(radius) = radius {
            let of = || format!("h² on {} cells", self.cut.mesh.len());
            refuse(of, walk.absorption, radius)?;
        }
        let model = self.cut.model;
        model.with_job(equation, follow, request, &mut |job, galerkin| {
            then(&Prepared {
                job,
                galerkin,
                largest: largest(follow.v.unwrap_or_default()),
                radius_bound: self.solution.radius_bound,
                convergence: self.solution.convergence,
                pointwise: self.cut.all_pairs(walk.pairs),
                neighbour_second_moment_radius: radius,
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
        let (walk, model) = (request.walk, self.cut.model);
        in_scalar!(self.cut.cut.scalar, F => {
            let tables = self.cut.tables::<F>();
            if walk.pairs == Pairs::Paper && model.colours().is_none() && !walk.last_step {
                let room = &tables.tables.room();
                return self.with_any_neighbour(room, walk, |follow| {
                    self.hand_on(room, follow, request, then)
                });
            }
            let room = tables.tables.room().with_lights(model.lights(walk.last_step))?;
            in_channels!(room, &tables.colours, equation => {
                let vectors = self.vectors(equation, walk)?;
                self.hand_on(equation, &vectors.follow(equation)?, request, then)
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
        let surfaces = &self.cut.model.surfaces;
        if !surfaces.outside.is_empty() || surfaces.period.is_some() {
            return Err(Error::Option {
                subject: Subject::Problem,
                message: "device tables have no light from outside and no period: leave `sky`, `light` and `period` out"
                    .to_owned(),
            });
        }
        in_scalar!(self.cut.cut.scalar, F => crate::export::room::<F>(self))
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        Some(SavedSystem {
            solution: Cow::Borrowed(&self.solution),
            coefficients: Cow::Borrowed(&[]),
        })
    }

    fn whole<'s>(self: Box<Self>) -> Result<Box<dyn GlobalSystem<'s> + 's>, Error>
    where
        Self: 's,
    {
        self.check_one_channel("global estimates")?;
        Ok(self)
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
