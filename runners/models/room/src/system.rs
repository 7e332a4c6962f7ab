//! A solved room: walks and predictions of every degree.

use std::borrow::Cow;
use std::sync::OnceLock;

use fredholm_core::galerkin::{Dense, PairTable, Piecewise, Rounded, Solution};
use fredholm_core::{Neighbour, Real};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_room::{
    Choice, Matrix, Point, RayTables, Room, RoomPairs, RoomQuadrature, Tables, VisibilityTable,
};
use fredholm_variance::{Density, PairCosts, Quadrature, Start as Begin, VarianceSetup};

use super::light::LitRays;
use super::partition::{RoomPartition, choice, pointwise_pairs};
use super::starts::{PANEL, Solutions, in_view, seen, with_job};
use super::{export, of_degree};
use fredholm_model::cost::PointwisePairs;
use fredholm_model::pairs::{self, AnyPairs, PairCounts};
use fredholm_model::{Error, Pairs, Region};
use fredholm_model::{Prepared, Request, Then, WithStarts};

/// The coefficients of a room, and the Galerkin solution.
#[derive(Debug)]
pub(super) struct RoomSystem<'m> {
    pub(super) cut: RoomPartition<'m>,
    /// The coefficients of all pairs that v came from, if there are some.
    pub(super) given: Option<Matrix<'m>>,
    /// Coefficients that are made when pairs are asked for.
    pub(super) made: OnceLock<Matrix<'static>>,
    pub(super) solution: Solution,
    /// What cells see, for walks whose G takes a ray: the same for all walks.
    pub(super) rays: OnceLock<RayTables<f64>>,
    /// Rays of walks whose last step leads to the light.
    pub(super) lit: OnceLock<LitRays>,
}

/// A neighbour equation of any degree.
pub(super) type Boxed<'a, F> = dyn Neighbour<Scalar = F, Point = Point<F>> + Sync + 'a;

/// What walks in a room need.
#[derive(Debug)]
pub(super) struct Setup<'s, F> {
    pub(super) system: &'s RoomSystem<'s>,
    pub(super) tables: Tables<F>,
    pub(super) absorption: f64,
    /// The walls to which last steps lead.
    pub(super) lights: &'s [u32],
    pub(super) choice: Choice,
    /// The kinds of all pairs, where they are chosen one by one.
    pub(super) kinds: Option<Vec<u8>>,
    /// What cells see, where G takes a ray in place of pairs.
    pub(super) rays: Option<RayTables<F>>,
    /// The Galerkin solution.
    pub(super) v: Vec<F>,
    pub(super) g: Vec<F>,
}

/// The density with which walks start.
type StartDensity<'a> = dyn Fn(&Point<f64>) -> Density + Sync + 'a;

/// What is done with a neighbour equation, and with the irradiance that v makes at a point.
pub(super) type Use<'a, F> =
    dyn FnMut(&Boxed<'_, F>, &dyn Fn(&Point<F>) -> f64) -> Result<(), Error> + 'a;

impl<'m> RoomSystem<'m> {
    /// The coefficients of all pairs, made at the first call.
    pub(super) fn matrix(&self) -> Result<&Matrix<'m>, Error> {
        if let Some(matrix) = self.known_matrix() {
            return Ok(matrix);
        }
        let matrix = self.cut.matrix()?;
        Ok(self.made.get_or_init(|| matrix))
    }

    fn known_matrix(&self) -> Option<&Matrix<'m>> {
        self.given
            .as_ref()
            .or_else(|| self.made.get().map(|made| made as &Matrix<'m>))
    }

    /// What cells see of each other, if anyone has asked for pairs.
    pub(super) fn views(&self) -> VisibilityTable<'_> {
        let matrix = self.known_matrix();
        matrix.map_or(VisibilityTable::none(), Matrix::views)
    }
}

impl RoomSystem<'_> {
    /// Tables, v and G, with these kinds of all pairs if there are some.
    pub(super) fn set_up<F: Real>(
        &self,
        pairs: Pairs,
        kinds: Option<Vec<u8>>,
        (absorption, last_step): (f64, bool),
    ) -> Result<Setup<'_, F>, Error> {
        let choice = choice(pairs);
        let lights = self.cut.model.lights(last_step);
        let is_lit = !lights.is_empty();
        let lit = match pairs {
            Pairs::Rays if is_lit => Some(self.lit_rays()?),
            _ => None,
        };
        let solution = match lit {
            _ if !is_lit => Cow::Borrowed(&self.solution),
            lit => Cow::Owned(Solution {
                v: lit.map_or_else(|| self.less_emission(lights), |lit| lit.v.clone()),
                ..self.solution
            }),
        };
        let g = match &kinds {
            _ if pairs == Pairs::Rays => Vec::new(),
            Some(table) => {
                let pairs = PairTable::new(table, self.cut.mesh.len())?;
                solution.source(&self.matrix()?.coefficients(), &pairs)?
            }
            None => {
                let (dense, views) = (self.matrix()?.coefficients(), self.views());
                solution.source(&dense, &RoomPairs { views, choice })?
            }
        };
        Ok(Setup {
            tables: Tables::new(&self.cut.model.scene, &self.cut.mesh),
            absorption,
            lights,
            choice,
            kinds,
            rays: match (pairs, lit) {
                (_, Some(lit)) => Some(lit.tables.rounded()?),
                (Pairs::Rays, None) => Some(self.rays()?.rounded()?),
                _ => None,
            },
            v: solution.rounded()?,
            g,
            system: self,
        })
    }

    /// What cells see, made at the first call.
    fn rays(&self) -> Result<&RayTables<f64>, Error> {
        if let Some(rays) = self.rays.get() {
            return Ok(rays);
        }
        let tables = Tables::<f64>::new(&self.cut.model.scene, &self.cut.mesh);
        let rays = self.ray_tables(&self.any_room(&tables, &[])?, &self.solution.v)?;
        Ok(self.rays.get_or_init(|| rays))
    }

    /// Sets up with the pairs that are asked for, one by one if they come from the theory.
    pub(super) fn set_up_for<F: Real>(&self, request: &Request<'_>) -> Result<Setup<'_, F>, Error> {
        let kinds = match request.walk.pairs {
            Pairs::Theory => Some(self.theory(request)?),
            _ => None,
        };
        let walk = (request.walk.absorption, request.walk.last_step);
        self.set_up(request.walk.pairs, kinds, walk)
    }

    /// The kinds of all pairs, for the means and points that are asked for.
    fn theory(&self, request: &Request<'_>) -> Result<Vec<u8>, Error> {
        let (cells, degree) = (self.cut.mesh.len(), self.cut.cut.degree);
        // As many Gauss points as `RoomQuadrature` takes on a cell: two more than the degree.
        let nodes = pairs::nodes(cells, degree + 2)?;
        let walk = (request.walk.absorption, request.walk.last_step);
        let setup = self.set_up::<f64>(Pairs::Default, None, walk)?;
        let room = setup.room()?;
        let quadrature = RoomQuadrature::new(&room, nodes, degree)?;
        let default = setup.by_views();
        let terms = PairCosts {
            cells,
            allowed: &|i, j| quadrature.allowed_kinds(i, j),
        };
        let mut chosen = None;
        setup.with_neighbour(&room, &mut |galerkin, _| {
            self.with_starts(request, &room, None, &mut |starts| {
                let found = pairs::choose(pairs::table_of(&default, cells), |table, last| {
                    let kinds = Some(table.to_vec());
                    let setup = self.set_up::<f64>(Pairs::Default, kinds, walk)?;
                    let mut evaluated = None;
                    setup.with_neighbour(&room, &mut |neighbour, _| {
                        let setting = VarianceSetup {
                            equation: &room,
                            neighbour,
                            pairs: setup.pairs()?,
                            quadrature: &quadrature,
                            galerkin: Some(galerkin),
                        };
                        let model = setting.with_starts(starts)?;
                        let scores = (request.walk.estimator, request.walk.form);
                        let goals = starts.len();
                        evaluated = Some(pairs::evaluate(&model, scores, goals, &terms, last)?);
                        Ok(())
                    })?;
                    evaluated.ok_or(Error::Internal("no pairs were looked at"))
                })?;
                chosen = Some(found);
                Ok(())
            })
        })?;
        chosen.ok_or(Error::Internal("no pairs were chosen"))
    }

    pub(super) fn job_in<F: Real>(
        &self,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let setup = self.set_up_for::<F>(request)?;
        let room = setup.room()?;
        let pointwise = setup.pointwise()?;
        setup.with_neighbour(&room, &mut |neighbour, irradiance| {
            let solutions = Solutions {
                mean: &|mean| mean.of(&setup.v),
                air: &|seen| seen.of(&setup.v)[0],
                irradiance,
                have_light: setup.has_light(),
            };
            with_job(
                self.cut.model,
                &room,
                setup.tables.lengths(),
                neighbour,
                &solutions,
                request,
                &mut |job, galerkin| {
                    then(&Prepared {
                        job,
                        galerkin,
                        largest: fredholm_model::numbers::largest(&setup.v),
                        radius_bound: self.solution.radius_bound,
                        convergence: self.solution.convergence,
                        pointwise,
                        neighbour_second_moment_radius: None,
                        pair_counts: setup.kinds.as_deref().map(PairCounts::of),
                    })
                },
            )
        })
    }

    /// Calls `then` with the starts of the walks of all goals, as an analysis sees it. `drawn` is a neighbour equation whose
    /// (v, Φ) in the air is a number of every walk.
    pub(super) fn with_starts(
        &self,
        request: &Request<'_>,
        room: &Room<'_, f64>,
        drawn: Option<&Boxed<'_, f64>>,
        then: &mut WithStarts<'_, Point<f64>>,
    ) -> Result<(), Error> {
        let model = self.cut.model;
        let mut densities: Vec<Box<StartDensity<'_>>> = Vec::new();
        for goal in request.goals {
            if let Region::Point(x) = &goal.region {
                let seen = seen(room, x);
                let shares = seen.visible_shares();
                let value = move |y: &Point<f64>| drawn.map_or(0.0, |v| v.value(&v.locate(*y)));
                let mut mean = 0.0;
                if drawn.is_some() {
                    seen.points(PANEL, |y, weight| mean += weight * value(&y));
                }
                let density = move |y: &Point<f64>| Density {
                    fluctuation: value(y) - mean,
                    known: 0.0,
                    ..in_view(seen.density(y, &shares))
                };
                densities.push(Box::new(density));
                continue;
            }
            let walls = model.walls(&goal.region)?;
            let own = model.scene.geometry();
            let own = walls
                .iter()
                .flat_map(|walls| own.walls().get(walls.clone()));
            let length = own.flatten().map(|wall| wall.length).sum();
            densities.push(Box::new(move |x: &Point<f64>| {
                if walls.iter().any(|walls| walls.contains(&x.wall())) {
                    Density::uniform(length)
                } else {
                    Density::nothing()
                }
            }));
        }
        let mut starts: Vec<Begin<'_, Point<f64>>> = Vec::new();
        for (goal, density) in request.goals.iter().zip(&densities) {
            starts.push(match &goal.region {
                Region::On(surface, t) => {
                    let (wall, fraction) = model.scene.along(*surface, *t)?;
                    Begin::At(room.point(wall, fraction)?)
                }
                _ => Begin::Density(&**density),
            });
        }
        then(&starts)
    }

    /// The surface that a ray between two sites meets before the other, if one does.
    pub(super) fn hides(
        &self,
        quadrature: &RoomQuadrature<'_, '_>,
        from: usize,
        into: usize,
    ) -> Option<String> {
        let [mut starts, mut ends] = [Vec::new(), Vec::new()];
        quadrature.nodes(from, |x, _| starts.push(x));
        quadrature.nodes(into, |y, _| ends.push(y));
        let rays = starts.iter().flat_map(|x| ends.iter().map(move |y| (x, y)));
        let scene = &self.cut.model.scene;
        let between = |(x, y): (&Point<f64>, &Point<f64>)| {
            let ([a, b], [c, d]) = (x.position(), y.position());
            let distance = (c - a).hypot(d - b);
            let direction = [(c - a) / distance, (d - b) / distance];
            let wall = u32::try_from(x.wall()).ok()?;
            let hit = scene.geometry().cast(wall, x.position(), direction)?;
            (hit.wall as usize != y.wall() && hit.distance < distance).then_some(hit.wall)
        };
        let wall = rays.into_iter().find_map(between)?;
        let place = scene.place(wall as usize)?;
        let name = self.cut.model.surfaces.names.get(place.surface);
        name.map(|name| format!("{name:?}"))
    }

    /// The place of every site: its wall, where on it in fractions of it, and its length.
    pub(super) fn pieces(
        &self,
        quadrature: &RoomQuadrature<'_, '_>,
    ) -> Vec<(usize, [f64; 2], f64)> {
        let geometry = self.cut.model.scene.geometry();
        let mut pieces = Vec::new();
        let (mut before, mut length, mut along) = (0, 0.0, 0.0);
        for site in 0..quadrature.sites() {
            let (mut wall, mut own) = (0, 0.0);
            quadrature.nodes(site, |x, weight| {
                wall = x.wall();
                own += weight;
            });
            if site == 0 || wall != before {
                length = geometry.walls().get(wall).map_or(f64::NAN, |w| w.length);
                along = 0.0;
            }
            before = wall;
            let to = (along + own) / length;
            pieces.push((wall, [along / length, f64::min(to, 1.0)], own));
            along += own;
        }
        pieces
    }

    pub(super) fn tables_in<F: Real + Number>(
        &self,
        pairs: Pairs,
        absorption: f64,
    ) -> Result<TableBuilder, Error> {
        let setup = self.set_up::<F>(pairs, None, (absorption, false))?;
        export::room(&setup, &self.cut.model.scene)
    }
}

impl<F: Real> Setup<'_, F> {
    /// The room.
    pub(super) fn room(&self) -> Result<Room<'_, F>, Error> {
        let (geometry, cells) = (self.tables.geometry(), self.tables.cells());
        let room = Room::new(geometry, cells, self.system.views(), self.absorption)?;
        Ok(room.with_lights(self.lights)?)
    }

    /// Whether the neighbour equation has what lights give to walls besides its polynomials.
    pub(super) const fn has_light(&self) -> bool {
        self.rays.is_some() && !self.lights.is_empty()
    }

    /// Pointwise pairs of a row.
    fn pointwise(&self) -> Result<PointwisePairs, Error> {
        let (views, cells) = (self.system.views(), self.tables.cells());
        if self.rays.is_some() {
            return Ok(PointwisePairs::default());
        }
        Ok(match self.pairs()? {
            AnyPairs::Table(pairs) => pointwise_pairs(&cells, views, &pairs),
            _ => pointwise_pairs(&cells, views, &self.by_views()),
        })
    }

    /// Calls `then` with the neighbour equation that v solves exactly: one type of walk for all degrees.
    pub(super) fn with_neighbour(
        &self,
        room: &Room<'_, F>,
        then: &mut Use<'_, F>,
    ) -> Result<(), Error> {
        of_degree!(self.system.cut.cut.degree, B => self.with_functions::<B>(room, then))
    }

    fn with_functions<const B: usize>(
        &self,
        room: &Room<'_, F>,
        then: &mut Use<'_, F>,
    ) -> Result<(), Error> {
        let polynomials = room.with_functions::<B>();
        let (v, g) = (&self.v, &self.g);
        let irradiance = |x: &Point<F>| polynomials.irradiance_of(x, v);
        if let Some(rays) = &self.rays {
            return then(&rays.neighbour(&polynomials, v)?, &irradiance);
        }
        let dense: Dense<'_, f64> = self.system.matrix()?.coefficients();
        let coefficients = Rounded::new(&dense);
        match self.pairs()? {
            AnyPairs::Table(pairs) => then(
                &Piecewise::with_pointwise(&polynomials, &coefficients, pairs, v, g)?,
                &irradiance,
            ),
            _ => then(
                &Piecewise::with_pointwise(&polynomials, &coefficients, self.by_views(), v, g)?,
                &irradiance,
            ),
        }
    }

    fn by_views(&self) -> RoomPairs<'_> {
        RoomPairs {
            views: self.system.views(),
            choice: self.choice,
        }
    }

    /// The kinds of pairs.
    pub(super) fn pairs(&self) -> Result<AnyPairs<'_>, Error> {
        Ok(match &self.kinds {
            Some(table) => AnyPairs::Table(PairTable::new(table, self.tables.cells().len())?),
            None => AnyPairs::Views(self.by_views()),
        })
    }
}
