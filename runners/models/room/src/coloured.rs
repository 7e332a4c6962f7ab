//! A solved room in several channels, and its walks.

use std::sync::OnceLock;

use fredholm_core::channels::{
    ChannelFunctional, ChannelGoal, ChannelGoals, ChannelNeighbours, MOST_CHANNELS,
};
use fredholm_core::galerkin::{Convergence, Solution};
use fredholm_core::{At, Functional, NoNeighbour, Real, Uniforms};
use fredholm_embedded::TableBuilder;
use fredholm_model::channels::refuse_device_tables;
use fredholm_model::cost::PointwisePairs;
use fredholm_model::numbers::largest;
use fredholm_model::{
    Error, Examined, NO_ITERATION, Pairs, Partitioned as _, Prepared, Region, Request, Subject,
    System, Then, WalkOptions, in_scalar,
};
use fredholm_rayon::fill_rows;
use fredholm_room::{
    CellChannelRays, ChannelRaySetup, ChannelRayTables, CoarseChannels, ColouredRoom, DirectLight,
    Matrix, Point, Room, RoomError, Shadows, Tables, VisibilityTable, WallColours,
};

use crate::colours::{Colours, WallTables};
use crate::partition::{FEW, RoomPartition, SWEEPS, TOLERANCE, is_from_few};
use crate::starts::{PANEL, Start};
use crate::{RoomModel, of_degree};

/// Neighbour equations of all channels, of any degree.
pub(crate) type ManyBoxed<'a, F> = dyn ChannelNeighbours<Scalar = F, Point = Point<F>> + Sync + 'a;

/// v of every channel: for every cell, and there for every channel, B numbers.
#[derive(Debug)]
struct Values {
    v: Vec<f64>,
    channels: usize,
    functions: usize,
}

impl Values {
    /// v_ia of every channel as walks have it, one after the other.
    fn by_channels<F: Real>(&self) -> Vec<Vec<F>> {
        let of = |channel: usize| {
            let own = self.v.chunks_exact(self.functions);
            let own = own.skip(channel).step_by(self.channels).flatten();
            own.map(|&v| F::from_f64(v)).collect()
        };
        (0..self.channels).map(of).collect()
    }
}

/// v of every channel, and its tables of rays.
#[derive(Debug)]
struct Rays {
    values: Values,
    tables: ChannelRayTables<f64>,
}

/// The solutions of a room in every channel.
#[derive(Debug)]
pub(crate) struct ColouredSystem<'m> {
    pub(crate) cut: RoomPartition<'m>,
    pub(crate) colours: &'m Colours,
    walls: WallTables<f64>,
    /// What cells see of each other, if v came from that.
    matrix: Option<Matrix<'static>>,
    values: Values,
    convergence: Convergence<f64>,
    radius_bound: f64,
    /// Rays without a last step to the light, and with one, each made at the first call.
    rays: [OnceLock<Rays>; 2],
    /// What lights give to walls in every channel.
    direct: OnceLock<Vec<DirectLight>>,
}

impl<'m> RoomPartition<'m> {
    pub(crate) fn coloured_system(
        &self,
        colours: &'m Colours,
    ) -> Result<ColouredSystem<'m>, Error> {
        let tables = colours.of_walls(self.model.scene());
        let (channels, functions) = (colours.names().channels(), self.cut.degree + 1);
        let mut v = vec![0.0; self.mesh.len() * functions * channels];
        let (matrix, solutions) = if is_from_few(self.unknowns(), self.cut.degree) {
            (None, self.step_in_channels(tables.colours()?, &mut v)?)
        } else {
            let matrix = self.matrix()?;
            let (scene, mesh) = (self.model.scene(), &self.mesh);
            let all = matrix.solve_channels(scene, mesh, &tables.colours()?, TOLERANCE, SWEEPS)?;
            for (channel, own) in all.iter().enumerate() {
                let to = v.chunks_exact_mut(functions);
                let to = to.skip(channel).step_by(channels);
                for (to, own) in to.zip(own.v.chunks_exact(functions)) {
                    to.copy_from_slice(own);
                }
            }
            (Some(matrix), all)
        };
        let convergence = solutions.iter().map(|own| own.convergence);
        let worst = convergence.max_by_key(|convergence| convergence.sweeps);
        let bounds = solutions.iter().map(|own| own.radius_bound);
        Ok(ColouredSystem {
            cut: self.clone(),
            colours,
            walls: tables,
            matrix,
            values: Values {
                v,
                channels,
                functions,
            },
            convergence: worst.unwrap_or(NO_ITERATION),
            radius_bound: bounds.fold(0.0, f64::max),
            rays: [OnceLock::new(), OnceLock::new()],
            direct: OnceLock::new(),
        })
    }

    /// Writes v of every channel by one step from solutions on few cells, and returns these.
    fn step_in_channels(
        &self,
        colours: WallColours<'_, f64>,
        v: &mut [f64],
    ) -> Result<Vec<Solution>, Error> {
        let scene = self.model.scene();
        let few = CoarseChannels::new(scene, self.unknowns().min(FEW), &colours)?;
        let on_few = few.room()?;
        let step = few.step(&on_few, colours);
        let tables = Tables::<f64>::new(scene, &self.mesh);
        // q0 makes no difference to v.
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(geometry, cells, VisibilityTable::none(), 0.5)?;
        of_degree!(self.cut.degree, B => {
            let polynomials = room.with_functions::<B>();
            fill_rows(v, B * colours.channels(), |cell, row| {
                step.on(&polynomials, cell, row);
                Ok::<(), Error>(())
            })?;
        });
        Ok(few.solutions().to_vec())
    }

    pub(crate) fn plain_colours<F: Real>(
        &self,
        colours: &Colours,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let walls = colours.of_walls(self.model.scene());
        let rounded = walls.rounded::<F>();
        let tables = Tables::<F>::new(self.model.scene(), &self.mesh);
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let absorption = request.walk.absorption;
        let lights = self.model.lights(request.walk.last_step);
        let room = Room::new(geometry, cells, VisibilityTable::none(), absorption)?;
        let room = room.with_lights(lights)?;
        let direct = match lights {
            [] => Vec::new(),
            lights => DirectLight::of_channels(self.model.scene(), lights, &walls.colours()?)?,
        };
        let walks = ColouredWalks {
            model: self.model,
            colours,
            coloured: &ColouredRoom::new(&room, rounded.colours()?)?,
            neighbours: &NoNeighbour::<ColouredRoom<'_, '_, F>>::new(),
            lengths: tables.lengths(),
            v: None,
            direct: &direct,
        };
        walks.with_job(request, &mut |job, galerkin| {
            then(&Prepared::plain(job, galerkin))
        })
    }
}

/// A functional of walks in a room, whose starts know nothing besides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InChannels<T>(pub(crate) T);

impl<'r, 'a, F, T> ChannelFunctional<ColouredRoom<'r, 'a, F>> for InChannels<T>
where
    F: Real,
    T: Functional<Room<'a, F>>,
{
    #[inline]
    fn start<U: Uniforms<F>>(
        &self,
        _: &ColouredRoom<'r, 'a, F>,
        uniforms: &mut U,
        known: &mut [F],
    ) -> (Point<F>, F) {
        known.fill(F::zero());
        self.0.start(uniforms)
    }
}

/// A function that is called with a job and (v, Φ) of its goals.
type WithJob<'a> = dyn FnMut(&dyn fredholm_core::Job, &[f64]) -> Result<(), Error> + 'a;

/// What numbers of all channels are, and what is known of them besides.
struct Known {
    /// (v_c, Φ), without what is known.
    means: Vec<f64>,
    /// Whether they are exact.
    are_exact: bool,
    /// (F_s,c, Φ).
    known: Vec<f64>,
}

/// Walks of all channels.
pub(crate) struct ColouredWalks<'w, 'r, 'a, F> {
    pub(crate) model: &'w RoomModel,
    pub(crate) colours: &'w Colours,
    pub(crate) coloured: &'w ColouredRoom<'r, 'a, F>,
    pub(crate) neighbours: &'w ManyBoxed<'w, F>,
    pub(crate) lengths: &'a [f64],
    /// v of every channel on the cells; `None`: walks are plain.
    pub(crate) v: Option<&'w [Vec<F>]>,
    /// What lights give to walls in every channel; none without a last step to the light.
    pub(crate) direct: &'w [DirectLight],
}

impl<'a, F: Real> ColouredWalks<'_, '_, 'a, F> {
    /// Prepares the walks of all goals, of which those of one target follow each other.
    fn with_job(&self, request: &Request<'_>, then: &mut WithJob<'_>) -> Result<(), Error> {
        let names = self.colours.names();
        let room = self.coloured.room();
        let (mut starts, mut all, mut galerkin) = (Vec::new(), Vec::new(), Vec::new());
        for goal in names.targets(request.goals)? {
            let start = self.model.start(room, self.lengths, &goal.region)?;
            let known = self.known(&start, &goal.region)?;
            let sums = known.means.iter().zip(&known.known);
            galerkin.extend(names.with_sum(sums.map(|(v, known)| v + known)));
            starts.push(start);
            all.push(known);
        }
        let goals: Vec<_> = starts
            .into_iter()
            .zip(&all)
            .map(|(start, known)| ChannelGoal {
                functional: InChannels(start),
                control_means: known.are_exact.then_some(&*known.means),
                known: &known.known,
            })
            .collect();
        let job = ChannelGoals {
            equations: self.coloured,
            neighbours: self.neighbours,
            goals: &goals,
            weights: names.weights(),
            options: request.walk.for_core(),
        };
        then(&job, &galerkin)
    }

    /// What is known of a start in every channel.
    fn known(&self, start: &Start<'_, 'a, F>, region: &Region) -> Result<Known, Error> {
        let channels = self.colours.names().channels();
        let is_lit = !self.direct.is_empty();
        let walls = || Ok::<_, Error>(self.model.walls(region)?.into_iter().flatten());
        let mut known = vec![0.0; channels];
        let mut are_exact = true;
        match start {
            Start::Point(At(x)) => known = self.emission_of_light(x.wall()),
            Start::Air(seen) => known = self.light_at(seen),
            _ => {
                for (to, direct) in known.iter_mut().zip(self.direct) {
                    *to = direct.emission(walls()?);
                }
            }
        }
        let means = match (self.v, start) {
            (None, _) => vec![0.0; channels],
            (Some(_), Start::Point(At(x))) => self.values(*x),
            (Some(v), Start::Air(seen)) => {
                are_exact = !is_lit;
                let mut means: Vec<f64> = v.iter().map(|v| seen.of(v)[0]).collect();
                if is_lit {
                    let mut light = vec![F::zero(); channels];
                    seen.points(PANEL, |x, weight| {
                        self.coloured.reflected_light(&x, &mut light);
                        for (mean, light) in means.iter_mut().zip(&light) {
                            *mean += weight * light.to_f64();
                        }
                    });
                }
                means
            }
            (Some(v), Start::Mean(mean)) => {
                let mut means: Vec<f64> = v.iter().map(|v| mean.of(v)).collect();
                for (mean, direct) in means.iter_mut().zip(self.direct) {
                    *mean += direct.reflected(walls()?);
                }
                means
            }
            (Some(_), _) => return Err(Error::Internal("an irradiance in several channels")),
        };
        Ok(Known {
            means,
            are_exact,
            known,
        })
    }

    /// v_c of a point in every channel.
    pub(crate) fn values(&self, x: Point<F>) -> Vec<f64> {
        let at = self.neighbours.locate(x);
        self.in_channels(&mut |to| self.neighbours.values(&at, to))
    }

    /// F_s,c of a wall in every channel.
    pub(crate) fn emission_of_light(&self, wall: usize) -> Vec<f64> {
        self.in_channels(&mut |to| self.coloured.emission_of_light(wall, to))
    }

    /// (F_s,c, Φ) of a point between the walls.
    pub(crate) fn light_at(&self, seen: &fredholm_room::Seen<'_, 'a, F>) -> Vec<f64> {
        let room = self.coloured.room();
        let mut sums = vec![0.0; self.colours.names().channels()];
        if room.lights().is_empty() {
            return sums;
        }
        let colours = self.coloured.colours();
        let per_turn = 1.0 / core::f64::consts::TAU;
        seen.cells(|cell, angle| {
            let wall = room.table().wall(cell).unwrap_or(usize::MAX);
            if room.emission_of_light(wall) != F::zero() {
                for (sum, emission) in sums.iter_mut().zip(colours.emissions(wall)) {
                    *sum += per_turn * angle.to_f64() * emission.to_f64();
                }
            }
        });
        sums
    }

    fn in_channels(&self, write: &mut dyn FnMut(&mut [F])) -> Vec<f64> {
        let mut own = [F::zero(); MOST_CHANNELS];
        let channels = self.colours.names().channels();
        let own = own.get_mut(..channels).unwrap_or_default();
        write(own);
        own.iter().map(|own| own.to_f64()).collect()
    }
}

/// What is done with the walks of all channels, and with plain ones.
pub(crate) type UseWalks<'u, F> = dyn for<'w, 'r, 'a> FnMut(
        &ColouredWalks<'w, 'r, 'a, F>,
        &ColouredWalks<'w, 'r, 'a, F>,
    ) -> Result<(), Error>
    + 'u;

impl ColouredSystem<'_> {
    /// What cells see of each other, if that is known.
    fn views(&self) -> VisibilityTable<'_> {
        self.matrix
            .as_ref()
            .map_or(VisibilityTable::none(), Matrix::views)
    }

    /// v and the tables of rays, with or without a last step to the light, made at the first call.
    fn rays(&self, last_step: bool) -> Result<&Rays, Error> {
        let kept = &self.rays[usize::from(last_step)];
        if let Some(rays) = kept.get() {
            return Ok(rays);
        }
        let (scene, lights) = (self.cut.model.scene(), self.cut.model.lights(last_step));
        let tables = Tables::<f64>::new(scene, &self.cut.mesh);
        // q0 makes no difference to what is seen.
        let room = Room::new(tables.geometry(), tables.cells(), self.views(), 0.5)?;
        let room = room.with_lights(lights)?;
        let coloured = ColouredRoom::new(&room, self.walls.colours()?)?;
        let Values {
            channels,
            functions,
            ..
        } = self.values;
        let mut v = self.values.v.clone();
        let mut cells = vec![CellChannelRays::default(); self.cut.mesh.len()];
        let shadows = Shadows::new(scene);
        of_degree!(self.cut.cut.degree, B => {
            if !lights.is_empty() {
                let polynomials = room.with_functions::<B>();
                fill_rows(&mut v, B * channels, |cell, row| {
                    let wall = room.table().wall(cell).unwrap_or(usize::MAX);
                    let mut emission = vec![0.0; channels];
                    coloured.emission_of_light(wall, &mut emission);
                    for (first, emission) in row.iter_mut().step_by(B).zip(emission) {
                        *first -= emission;
                    }
                    polynomials.subtract_light(&coloured, cell, row);
                    Ok::<(), Error>(())
                })?;
            }
            let setup = ChannelRaySetup::<B>::new(&coloured, &v)?.with_shadows(&shadows);
            fill_rows(&mut cells, 1, |cell, row| {
                row.fill(setup.cell(cell)?);
                Ok::<(), RoomError>(())
            })?;
        });
        let tables = ChannelRayTables::new(cells, channels)?;
        let values = Values {
            v,
            channels,
            functions,
        };
        Ok(kept.get_or_init(|| Rays { values, tables }))
    }

    /// What lights give to walls in every channel, computed at the first call; nothing without a last step to them.
    fn direct(&self, last_step: bool) -> Result<&[DirectLight], Error> {
        let lights = self.cut.model.lights(last_step);
        if lights.is_empty() {
            return Ok(&[]);
        }
        if let Some(direct) = self.direct.get() {
            return Ok(direct);
        }
        let scene = self.cut.model.scene();
        let direct = DirectLight::of_channels(scene, lights, &self.walls.colours()?)?;
        Ok(self.direct.get_or_init(|| direct))
    }

    /// Hands out the walks of all channels, and plain ones.
    pub(crate) fn with_walks<F: Real>(
        &self,
        walk: &WalkOptions,
        then: &mut UseWalks<'_, F>,
    ) -> Result<(), Error> {
        let model = self.cut.model;
        let rays = self.rays(walk.last_step)?;
        let tables = Tables::<F>::new(model.scene(), &self.cut.mesh);
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(geometry, cells, self.views(), walk.absorption)?;
        let room = room.with_lights(model.lights(walk.last_step))?;
        let walls = self.walls.rounded::<F>();
        let coloured = &ColouredRoom::new(&room, walls.colours()?)?;
        let v: Vec<F> = rays.values.v.iter().map(|&v| F::from_f64(v)).collect();
        let by_channels = rays.values.by_channels::<F>();
        let of_channels = rays.tables.rounded::<F>()?;
        let plain = ColouredWalks {
            model,
            colours: self.colours,
            coloured,
            neighbours: &NoNeighbour::<ColouredRoom<'_, '_, F>>::new(),
            lengths: tables.lengths(),
            v: None,
            direct: self.direct(walk.last_step)?,
        };
        of_degree!(self.cut.cut.degree, B => {
            let walks = ColouredWalks {
                neighbours: &of_channels.neighbours::<B>(coloured, &v)?,
                v: Some(&by_channels),
                ..plain
            };
            then(&walks, &plain)
        })
    }

    fn job_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let most = largest(&self.values.v);
        self.with_walks::<F>(request.walk, &mut |walks, _| {
            walks.with_job(request, &mut |job, galerkin| {
                then(&Prepared {
                    job,
                    galerkin,
                    largest: most,
                    radius_bound: self.radius_bound,
                    convergence: self.convergence,
                    pointwise: PointwisePairs::default(),
                    neighbour_second_moment_radius: None,
                    pair_counts: None,
                })
            })
        })
    }
}

impl System for ColouredSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cut.refuse_infinite(walk, None)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.cut.scalar, F => self.job_in::<F>(request, then))
    }

    fn examine(
        &self,
        _: &Request<'_>,
        _: usize,
        _: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        Err(Error::Option {
            subject: Subject::Problem,
            message: "variances of a room are predicted for one channel: leave `channels` out, with one reflectance and \
                      emission for each surface"
                .to_owned(),
        })
    }

    fn tables(&self, _: Pairs, _: f64) -> Result<TableBuilder, Error> {
        refuse_device_tables()
    }
}
