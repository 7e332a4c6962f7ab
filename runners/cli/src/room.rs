//! A room from its file to statistics: scene, set-up, targets, walks, irradiance and net flux.

mod corners;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use fredholm_core::galerkin::{self, Dense, PairTable, Piecewise, Rounded, Solution};
use fredholm_core::variance::{self, Density, Level, Setting, Terms};
use fredholm_core::{At, Estimate, Functional, Neighbour, NoNeighbour, Real, Uniforms};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_rayon::{Plan, Target, run};
use fredholm_room::{
    Cells, Choice, Enclosure, Grading, Irradiance, Material, Matrix, MeanOver, Mesh, Place, Point,
    Polynomials, R_MIN, Room, RoomError, RoomLevel, RoomPairs, Scene, Surface, Tables, View, Views,
    neighbour_second_moment_radius, r_min, second_moment_radius,
};

use crate::deck::{self, Deck};
use crate::diagnose::{Begin, Diagnosis, Request, Subject};
use crate::export;
use crate::failure::Failure;
use crate::file::{
    self, Galerkin, Numbers, Pairs, Placed, ProblemFile, Scalar, What, unknown_surface,
};
use crate::problem::{
    Answer, Asked, Besides, Cost, Known, PointwisePairs, Problem, Solved, WalkCost, Where, asked,
    floors, infinite_variance,
};
use crate::progress::{Progress, begin_walking};
use crate::solve::{plan, refuse_memory};
use crate::theory::{self, AnyPairs, PairCounts};

/// The relative residual at which the Gauss–Seidel iteration stops.
const TOLERANCE: f64 = 1e-14;
/// The most sweeps.
const SWEEPS: u32 = 10_000;
/// About so many cells where the file does not say.
const DEFAULT_CELLS: usize = 500;
/// Seconds of a pair of the set-up, and of every degree of it; on the machine that this and what follows was
/// measured on.
const PAIR: f64 = 80e-9;
const MOMENTS: f64 = 340e-9;
/// Seconds of a row's cells close by, of every degree.
const CLOSE: f64 = 15e-6;
/// Seconds of a coefficient in G.
const SOURCE: f64 = 3e-9;
/// Walks: a start, a ray for every level of the hierarchy over the walls, and a score without pairs.
const START: f64 = 25e-9;
const RAY: f64 = 38e-9;
const SCORE: f64 = 5e-9;
/// Where pairs are in S: h on a ray, what a degree adds, and a score.
const IN_S: f64 = 10e-9;
const IN_S_DEGREE: f64 = 140e-9;
const IN_S_SCORE: f64 = 100e-9;
/// A pointwise pair in a score; one that is partly hidden, of any degree, for every level of the hierarchy.
const PAIR_OF_CONSTANTS: f64 = 20e-9;
const PAIR_OF_POLYNOMIALS: f64 = 36e-9;
const PAIR_DEGREE: f64 = 10e-9;
const HIDDEN_PAIR: f64 = 60e-9;
/// What cells close by take besides in a score where all pairs are pointwise.
const NEAR: f64 = 460e-9;
const NEAR_DEGREE: f64 = 180e-9;
/// Cells enough to estimate a spectral radius, and the fewest that it takes: on 50 it is within 0.4 %
/// of what it is on 400 in the rooms of `examples/`.
const COARSE: usize = 100;
const COARSEST: usize = 50;

/// An expression in which the number of functions per cell of a degree is a constant of this name.
macro_rules! of_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            0 => $crate::room::of_degree!(1 as $name => $then),
            1 => $crate::room::of_degree!(2 as $name => $then),
            2 => $crate::room::of_degree!(3 as $name => $then),
            3 => $crate::room::of_degree!(4 as $name => $then),
            // Validation lets nothing above 4 pass.
            _ => $crate::room::of_degree!(5 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}
pub(crate) use of_degree;

/// The surfaces of a file or a deck, as the library takes them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfaces {
    pub(crate) names: Vec<String>,
    pub(crate) points: Vec<Vec<[f64; 2]>>,
    pub(crate) materials: Vec<Vec<Material>>,
    /// Whether temperatures are given: results are W/m² then.
    pub(crate) heat: bool,
    /// Whether a deck says that it is no enclosure.
    pub(crate) open: bool,
}

impl Surfaces {
    /// Those of a file, with its deck.
    pub(crate) fn new(file: &ProblemFile, room: &file::Room) -> Result<Self, Failure> {
        match &room.deck {
            Some(path) => Self::of_deck(file, room, path),
            None => Self::of_file(room),
        }
    }

    fn of_file(room: &file::Room) -> Result<Self, Failure> {
        let mut all = Self::default();
        for surface in &room.surfaces {
            let points = surface.points.iter().flat_map(|points| &points.value);
            all.names.push(surface.name.value.clone());
            all.points.push(points.map(|point| point.value).collect());
            all.materials.push(materials(&surface.material, 0.0));
            all.heat |= matches!(surface.material, file::Material::Grey(..));
        }
        Ok(all)
    }

    fn of_deck(
        file: &ProblemFile,
        room: &file::Room,
        path: &Placed<String>,
    ) -> Result<Self, Failure> {
        let whole = file.beside(Path::new(&path.value));
        let deck = deck::read(&whole).map_err(|failure| match failure {
            Failure::Input(message) => file.error(&path.place, message).into(),
            other => other,
        })?;
        let mut all = Self::plain(&deck);
        for surface in &room.surfaces {
            let Some(i) = all
                .names
                .iter()
                .position(|name| *name == surface.name.value)
            else {
                return Err(unknown_surface(file, &surface.name, &all.names).into());
            };
            let own = all.materials[i].first().map_or(0.0, |m| m.reflectance);
            all.materials[i] = materials(&surface.material, own);
            all.heat |= matches!(surface.material, file::Material::Grey(..));
        }
        Ok(all)
    }

    /// Those of a deck, which says nothing of temperatures: nothing emits.
    pub(crate) fn plain(deck: &Deck) -> Self {
        let mut all = Self {
            open: deck.open,
            ..Self::default()
        };
        for surface in &deck.surfaces {
            all.names.push(surface.name.clone());
            all.points.push(surface.ends.to_vec());
            all.materials.push(vec![Material {
                reflectance: 1.0 - surface.emissivity,
                emission: 0.0,
            }]);
        }
        all
    }

    /// The scene for walks in `F`, with errors that name surfaces.
    pub(crate) fn scene<F: Real>(&self, open: bool) -> Result<Scene, RoomError> {
        let surfaces = self.points.iter().zip(&self.materials);
        let surfaces: Vec<Surface<'_>> = surfaces
            .map(|(points, materials)| Surface { points, materials })
            .collect();
        let enclosure = if open {
            Enclosure::Open
        } else {
            Enclosure::Closed
        };
        Scene::new::<F>(&surfaces, enclosure)
    }

    /// "surface "floor", vertex 2".
    fn place(&self, place: Place) -> String {
        let name = self.names.get(place.surface).map_or("?", String::as_str);
        format!("surface {name:?}, vertex {}", place.vertex + 1)
    }

    /// What is wrong with a scene, with the names of its surfaces, and where.
    pub(crate) fn explain(&self, error: RoomError) -> (String, Option<Place>) {
        let at = |place: Place, what: &str| (format!("{}: {what}", self.place(place)), Some(place));
        match error {
            RoomError::Vertices { surface } => at(
                Place { surface, vertex: 0 },
                "a surface needs at least two vertices",
            ),
            RoomError::Materials { surface } => at(
                Place { surface, vertex: 0 },
                "give one number for the surface, or one for each of its segments",
            ),
            RoomError::Coordinate(place) => at(
                place,
                "coordinates must be finite, and the scene between 1e-6 and 1e12 wide in f32",
            ),
            RoomError::Reflectance(place) => at(place, "the reflectance must be in [0, 1)"),
            RoomError::Emission(place) => at(place, "the emission must be finite"),
            RoomError::ZeroLength(place) => {
                at(place, "the segment to the next vertex has no length")
            }
            RoomError::Crossing { first, second } => (
                format!(
                    "the segment from {} crosses that from {}: split them where they meet",
                    self.place(second),
                    self.place(first)
                ),
                Some(second),
            ),
            RoomError::Overlap { first, second } => (
                format!(
                    "the segments from {} and from {} lie on each other and face the same side; a \
                     thin baffle is two surfaces that face opposite sides",
                    self.place(second),
                    self.place(first)
                ),
                Some(second),
            ),
            RoomError::Open {
                at: place,
                from: [x, y],
                direction: [dx, dy],
            } => at(
                place,
                &format!(
                    "the room is not closed here: light leaves, or meets a wall from behind, from \
                     ({x:.4}, {y:.4}) in direction ({dx:.3}, {dy:.3}); close the gap, turn surfaces \
                     whose active side is not on the left, or say `open = true`"
                ),
            ),
            other => (other.to_string(), None),
        }
    }
}

/// The materials of a surface; `own` is its reflectance where nothing is said of it.
fn materials(material: &file::Material, own: f64) -> Vec<Material> {
    let list = |numbers: &Numbers, default: f64| -> Vec<f64> {
        numbers.as_ref().map_or(vec![default], |numbers| {
            numbers.value.iter().map(|number| number.value).collect()
        })
    };
    let (first, second, make): (_, _, fn(f64, f64) -> Material) = match material {
        file::Material::Light(reflectance, emission) => (
            list(reflectance, own),
            list(emission, 0.0),
            |reflectance, emission| Material {
                reflectance,
                emission,
            },
        ),
        file::Material::Grey(emissivity, temperature) => (
            list(emissivity, 1.0 - own),
            list(temperature, 0.0),
            Material::grey,
        ),
    };
    // A list of another length than the other's stays one: the scene refuses it.
    let at = |list: &[f64], i: usize| match list {
        [one] => *one,
        many => many.get(i).copied().unwrap_or(f64::NAN),
    };
    (0..first.len().max(second.len()))
        .map(|i| make(at(&first, i), at(&second, i)))
        .collect()
}

/// The scene of the surfaces of a file.
pub(crate) fn scene(
    file: &ProblemFile,
    room: &file::Room,
    surfaces: &Surfaces,
) -> Result<Scene, Failure> {
    let open = room.open.value || surfaces.open;
    let scene = match file.walk.scalar.value {
        Scalar::F32 => surfaces.scene::<f32>(open),
        Scalar::F64 => surfaces.scene::<f64>(open),
    };
    scene.map_err(|error| refused(file, room, surfaces, error))
}

/// A room of a file.
#[derive(Clone, Debug)]
pub(crate) struct RoomFile<'f> {
    file: &'f ProblemFile,
    surfaces: Surfaces,
    scene: Scene,
    mesh: Mesh,
    cells: usize,
    asked: Vec<Asked>,
    /// Whether u is all that is wanted: no irradiance, no net flux.
    only_u: bool,
}

impl<'f> RoomFile<'f> {
    /// The room of this file.
    pub(crate) fn new(file: &'f ProblemFile, room: &'f file::Room) -> Result<Self, Failure> {
        let surfaces = Surfaces::new(file, room)?;
        let cells = file.galerkin.cells.as_ref();
        let cells = cells.map_or(DEFAULT_CELLS, |cells| cells.value);
        // Every segment is one cell at least. Whether there is room for them is asked before a
        // scene is made of them, which may take long: see the crate's README.
        let segments = surfaces.points.iter().map(|p| p.len().saturating_sub(1));
        let least = cells.max(segments.sum());
        refuse_memory(file, least, memory(least, file.galerkin.degree.value))?;
        let scene = scene(file, room, &surfaces)?;
        let mesh = mesh(file, &scene, cells)?;
        let find = |name: &Placed<String>| {
            let found = surfaces.names.iter().position(|known| *known == name.value);
            found.ok_or_else(|| unknown_surface(file, name, &surfaces.names))
        };
        let mut unknown = None;
        let asked = asked(file, |what| match targets(what, find) {
            Ok(places) => places,
            Err(error) => {
                unknown.get_or_insert(error);
                Vec::new()
            }
        })?;
        match unknown {
            Some(error) => Err(error.into()),
            None => Ok(Self {
                file,
                surfaces,
                scene,
                mesh,
                cells,
                asked,
                only_u: false,
            }),
        }
    }

    fn answer_in<F: Real, const B: usize>(
        &self,
        system: &Arc<System>,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let start = Instant::now();
        let setup = self.set_up_of::<F, B>(Arc::clone(system), self.pairs())?;
        let room = setup.room()?;
        let polynomials = Polynomials::new(&room);
        let dense = setup.coefficients();
        let coefficients = Rounded::new(&dense);
        // One type of walk for all degrees.
        let neighbour = setup.neighbour(&polynomials, &coefficients)?;
        let neighbour: &Boxed<'_, F> = &*neighbour;
        let (tables, solution, v) = (&setup.tables, &system.solution, &setup.v);
        let setup_seconds = start.elapsed().as_secs_f64();

        let solution_there = Solutions {
            mean: &|mean| mean.of(v),
            irradiance: &|x| polynomials.irradiance_of(x, v),
        };
        let lengths = tables.lengths();
        let walked = self.walk_with(&room, lengths, neighbour, &solution_there, plan, progress)?;
        Ok(Answer {
            floors: floors(v, solution.contraction, &walked.outcome),
            pointwise: setup.pointwise()?,
            pair_counts: setup.kinds.as_deref().map(PairCounts::of),
            solve: solution.solve,
            setup_seconds,
            ..walked
        })
    }

    /// Walks; floors and the set-up are left open.
    fn walk_with<'a, F: Real>(
        &self,
        room: &Room<'a, F>,
        lengths: &'a [f64],
        neighbour: &Boxed<'_, F>,
        solutions: &Solutions<'_, 'a, F>,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let mut starts = Vec::new();
        let mut known = Vec::new();
        let places = self.places();
        for place in &places {
            let start = self.start(room, lengths, place)?;
            let galerkin = match &start {
                Start::Point(At(x)) => neighbour.value(&neighbour.locate(*x)).to_f64(),
                Start::Mean(mean) => (solutions.mean)(mean),
                Start::Light(_) | Start::LightMean(_) => f64::NAN,
            };
            known.push(Known {
                exact: None,
                galerkin,
            });
            starts.push(Target {
                functional: start,
                neighbour_value: Some(galerkin),
            });
        }
        // Where irradiance does not follow from u it takes walks of its own.
        let mut own = Vec::new();
        for (number, place) in places.iter().enumerate() {
            if self.is_looked_at_apart(place) {
                let target = match self.start(room, lengths, place)? {
                    Start::Point(at) => Target {
                        neighbour_value: Some((solutions.irradiance)(&at.0)),
                        functional: Start::Light(Irradiance { room, of: at }),
                    },
                    Start::Mean(mean) => Target {
                        neighbour_value: None,
                        functional: Start::LightMean(Irradiance { room, of: mean }),
                    },
                    other => Target {
                        functional: other,
                        neighbour_value: None,
                    },
                };
                own.push(number);
                starts.push(target);
            }
        }
        begin_walking();
        let start = Instant::now();
        let mut outcome = run(room, neighbour, &starts, plan, progress).map_err(Failure::run)?;
        let walk_seconds = start.elapsed();
        let irradiance = outcome.statistics.split_off(places.len());
        let of = |(number, place): (usize, &Where)| {
            let h = match own.iter().position(|&own| own == number) {
                Some(own) => irradiance.get(own).map(|s| s.preconditioned()),
                None => {
                    let u = outcome.statistics.get(number)?.preconditioned();
                    self.through_u(place).map(|through| through.of(u))
                }
            };
            Some(self.besides(place, h))
        };
        let mut besides: Vec<Besides> = places.iter().enumerate().filter_map(of).collect();
        let fluxes = besides.split_off(self.asked.len().min(besides.len()));
        let mut others = outcome.statistics.split_off(self.asked.len());
        others.extend(irradiance);
        known.truncate(self.asked.len());
        let names = self.surfaces.names.iter().cloned();
        let fluxes = names.zip(fluxes.into_iter().map(|besides| besides.net_flux));
        Ok(Answer {
            others,
            besides,
            fluxes: fluxes.collect(),
            ..Answer::plain::<F>(known, outcome, walk_seconds)
        })
    }

    fn plain_in<F: Real>(&self, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        let tables = Tables::<F>::new(&self.scene, &self.mesh);
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let absorption = self.file.walk.absorption.value;
        let room = Room::new(geometry, cells, Views::none(), absorption).map_err(Failure::input)?;
        let none: &Boxed<'_, F> = &NoNeighbour::<Room<'_, F>>::new();
        let dark = Solutions {
            mean: &|_| 0.0,
            irradiance: &|_| 0.0,
        };
        self.walk_with(&room, tables.lengths(), none, &dark, plan, progress)
    }

    fn tables_in<F: Real + Number, const B: usize>(&self) -> Result<TableBuilder, Failure> {
        let setup = self.set_up::<F, B>(self.pairs())?;
        export::room(&setup, &self.scene)
    }

    /// The tables and the neighbour equation of this room, with these pairs.
    pub(crate) fn set_up<F: Real, const B: usize>(
        &self,
        pairs: Pairs,
    ) -> Result<SetUp<F, B>, Failure> {
        self.set_up_of(Arc::new(self.system::<B>()?), pairs)
    }

    /// The coefficients of this room, and the solution.
    fn system<const B: usize>(&self) -> Result<System, Failure> {
        let (scene, mesh) = (&self.scene, &self.mesh);
        let matrix = Matrix::with_functions(scene, mesh, r_min(B - 1), B).map_err(Failure::run)?;
        let solution = matrix
            .solve(scene, mesh, TOLERANCE, SWEEPS)
            .map_err(Failure::run)?;
        Ok(System { matrix, solution })
    }

    fn set_up_of<F: Real, const B: usize>(
        &self,
        system: Arc<System>,
        pairs: Pairs,
    ) -> Result<SetUp<F, B>, Failure> {
        let choice = choice(pairs);
        let System { matrix, solution } = &*system;
        let v = solution.rounded::<F>().map_err(Failure::run)?;
        let kinds = match pairs {
            Pairs::Theory => Some(self.theory::<B>(matrix, solution)?),
            _ => None,
        };
        let dense = matrix.coefficients();
        let g = match &kinds {
            Some(table) => {
                let pairs = PairTable::new(table, self.mesh.len()).map_err(Failure::run)?;
                solution.source(&dense, &pairs)
            }
            None => {
                let views = matrix.views();
                solution.source(&dense, &RoomPairs { views, choice })
            }
        };
        let g = g.map_err(Failure::run)?;
        Ok(SetUp {
            tables: Tables::new(&self.scene, &self.mesh),
            absorption: self.file.walk.absorption.value,
            choice,
            kinds,
            v,
            g,
            system,
        })
    }

    /// ∫ F².
    fn square_of_source(&self) -> f64 {
        let walls = self.scene.geometry().walls().iter();
        walls.map(|wall| wall.length * wall.emission.powi(2)).sum()
    }

    /// The kinds of all pairs, for the means and points that are asked for.
    fn theory<const B: usize>(
        &self,
        matrix: &Matrix,
        solution: &Solution,
    ) -> Result<Vec<u8>, Failure> {
        let cells = self.mesh.len();
        // As many Gauss points as `RoomLevel` takes on a cell: two more than the degree.
        let nodes = theory::nodes(self.file, cells, B + 1)?;
        let tables = Tables::<f64>::new(&self.scene, &self.mesh);
        let (geometry, views) = (tables.geometry(), matrix.views());
        let absorption = self.file.walk.absorption.value;
        let room =
            Room::new(geometry, tables.cells(), views, absorption).map_err(Failure::input)?;
        let polynomials = Polynomials::<f64, B>::new(&room);
        let dense = matrix.coefficients();
        let coefficients = Rounded::<_, f64>::new(&dense);
        let v = solution.rounded::<f64>().map_err(Failure::run)?;
        let level = RoomLevel::new(&room, nodes, B - 1).map_err(Failure::run)?;
        let default = RoomPairs {
            views,
            choice: Choice::Default,
        };
        let g = solution.source::<f64>(&dense, &default);
        let g = g.map_err(Failure::run)?;
        let galerkin = Piecewise::with_pointwise(&polynomials, &coefficients, default, &v, &g);
        let galerkin: &Boxed<'_, f64> = &galerkin.map_err(Failure::run)?;
        let terms = Terms {
            cells,
            galerkin,
            possible: &|i, j| level.possible(i, j),
        };
        let estimator = plan(self.file, None).estimator;
        self.with_starts(&room, |targets| {
            theory::choose(theory::table_of(&default, cells), |table, last| {
                let pairs = PairTable::new(table, cells).map_err(Failure::run)?;
                let g = solution.source::<f64>(&dense, &pairs);
                let g = g.map_err(Failure::run)?;
                let neighbour =
                    Piecewise::with_pointwise(&polynomials, &coefficients, pairs, &v, &g);
                let neighbour: &Boxed<'_, f64> = &neighbour.map_err(Failure::run)?;
                let setting = Setting {
                    equation: &room,
                    neighbour,
                    pairs: AnyPairs::Table(pairs),
                    level: &level,
                };
                theory::look(&setting, estimator, targets, &terms, last)
            })
        })
    }

    /// Sets up, and predicts.
    fn diagnose_in<const B: usize>(&self, request: &Request<'_>) -> Result<Diagnosis, Failure> {
        let setup = self.set_up::<f64, B>(self.pairs())?;
        let room = setup.room()?;
        let polynomials = Polynomials::new(&room);
        let dense = setup.coefficients();
        let coefficients = Rounded::new(&dense);
        let neighbour = setup.neighbour(&polynomials, &coefficients)?;
        // Of piecewise constants: the first function of a cell is all of it.
        let coefficients = (B == 1).then_some(&dense);
        self.examine(&room, &*neighbour, setup.pairs()?, coefficients, request)
    }

    fn examine(
        &self,
        room: &Room<'_, f64>,
        neighbour: &Boxed<'_, f64>,
        pairs: AnyPairs<'_>,
        coefficients: Option<&Dense<'_, f64>>,
        request: &Request<'_>,
    ) -> Result<Diagnosis, Failure> {
        let degree = self.degree();
        let level = RoomLevel::new(room, request.nodes, degree).map_err(Failure::run)?;
        let place = |site: usize| {
            let mut wall = 0;
            level.nodes(site, |x, _| wall = x.wall());
            let surface = self.scene.place(wall).map(|place| place.surface);
            surface
                .and_then(|surface| self.surface(surface))
                .map_or_else(|| format!("wall {wall}"), str::to_owned)
        };
        let draw = |shares: &[f64]| self.draw_shares(&level, shares);
        self.with_starts(room, |targets| {
            request.examine(&Subject {
                draw: Some(&draw),
                hides: Some(&|from, into| self.hides(&level, from, into)),
                setting: Setting {
                    equation: room,
                    neighbour,
                    pairs,
                    level: &level,
                },
                coefficients: coefficients.filter(|_| self.mesh.len() <= level.sites()),
                targets,
                place: &place,
            })
        })
    }

    /// With where the walks of all targets start.
    fn with_starts<R>(
        &self,
        room: &Room<'_, f64>,
        then: impl FnOnce(&[Begin<'_, Point<f64>>]) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let mut densities = Vec::new();
        for asked in &self.asked {
            let walls = self.walls(&asked.place)?;
            let own = self.scene.geometry();
            let own = own.walls().get(walls.clone()).unwrap_or(&[]);
            let length = own.iter().map(|wall| wall.length).sum();
            densities.push(move |x: &Point<f64>| {
                if walls.contains(&x.wall()) {
                    Density::uniform(length)
                } else {
                    Density::nothing()
                }
            });
        }
        let mut targets = Vec::new();
        for (asked, density) in self.asked.iter().zip(&densities) {
            let start = match &asked.place {
                Where::On(surface, t) => {
                    let (wall, fraction) = self.scene.along(*surface, *t).map_err(Failure::run)?;
                    variance::Start::At(room.point(wall, fraction).map_err(Failure::run)?)
                }
                _ => variance::Start::Density(density),
            };
            targets.push(Begin {
                name: &asked.name,
                start,
            });
        }
        then(&targets)
    }

    /// The surface that a ray between two sites meets before the other, if one does.
    fn hides(&self, level: &RoomLevel<'_, '_>, from: usize, into: usize) -> Option<String> {
        let [mut starts, mut ends] = [Vec::new(), Vec::new()];
        level.nodes(from, |x, _| starts.push(x));
        level.nodes(into, |y, _| ends.push(y));
        let rays = starts.iter().flat_map(|x| ends.iter().map(move |y| (x, y)));
        let between = |(x, y): (&Point<f64>, &Point<f64>)| {
            let ([a, b], [c, d]) = (x.position(), y.position());
            let distance = (c - a).hypot(d - b);
            let direction = [(c - a) / distance, (d - b) / distance];
            let wall = u32::try_from(x.wall()).ok()?;
            let hit = self.scene.geometry().cast(wall, x.position(), direction)?;
            (hit.wall as usize != y.wall() && hit.distance < distance).then_some(hit.wall)
        };
        let wall = rays.into_iter().find_map(between)?;
        let place = self.scene.place(wall as usize)?;
        self.surface(place.surface).map(|name| format!("{name:?}"))
    }

    /// The walls, coloured by the share of each site in the variance over its share of all length.
    fn draw_shares(&self, level: &RoomLevel<'_, '_>, shares: &[f64]) -> Result<String, Failure> {
        let mut pieces = Vec::new();
        let (mut before, mut length) = (0, 0.0);
        let mut along = 0.0;
        let mut all = 0.0;
        for site in 0..level.sites() {
            let (mut wall, mut own) = (0, 0.0);
            level.nodes(site, |x, weight| {
                wall = x.wall();
                own += weight;
            });
            if site == 0 || wall != before {
                length = self
                    .scene
                    .geometry()
                    .walls()
                    .get(wall)
                    .map_or(f64::NAN, |w| w.length);
                along = 0.0;
            }
            before = wall;
            pieces.push((wall, along / length, (along + own) / length, own));
            along += own;
            all += own;
        }
        let shares = pieces
            .iter()
            .zip(shares)
            .map(|(&(wall, from, to, own), share)| (wall, [from, to.min(1.0)], share * all / own));
        crate::render::shares(&self.scene, &shares.collect::<Vec<_>>())
    }

    /// The pairs of the file.
    pub(crate) const fn pairs(&self) -> Pairs {
        self.file.galerkin.pairs.value
    }

    /// The degree of the polynomials on a cell.
    pub(crate) const fn degree(&self) -> usize {
        self.file.galerkin.degree.value
    }

    /// The number of cells that there are.
    pub(crate) fn cells_in_all(&self) -> usize {
        self.mesh.len()
    }

    /// The estimated spectral radius of T_h²p, on few cells: more only bring h nearer to k.
    fn neighbour_second_moment<const B: usize>(
        &self,
        solved: Option<&Solved>,
    ) -> Result<f64, Failure> {
        // From the theory fewer are in S than by default.
        let choice = choice(self.pairs());
        if choice == Choice::Pointwise {
            // h = k.
            return Ok(0.0);
        }
        if let Some(solved) = solved.filter(|_| self.cells <= COARSE) {
            let system = solved.system::<Arc<System>>()?;
            return self.neighbour_second_moment_of::<B>(&self.mesh, &system.matrix, choice);
        }
        let mesh = mesh(self.file, &self.scene, self.cells.min(COARSE))?;
        let matrix =
            Matrix::with_functions(&self.scene, &mesh, r_min(B - 1), B).map_err(Failure::run)?;
        self.neighbour_second_moment_of::<B>(&mesh, &matrix, choice)
    }

    fn neighbour_second_moment_of<const B: usize>(
        &self,
        mesh: &Mesh,
        matrix: &Matrix,
        choice: Choice,
    ) -> Result<f64, Failure> {
        let tables = Tables::new(&self.scene, mesh);
        let (geometry, cells, views) = (tables.geometry(), tables.cells(), matrix.views());
        let absorption = self.file.walk.absorption.value;
        let room = Room::new(geometry, cells, views, absorption).map_err(Failure::input)?;
        let polynomials = Polynomials::<_, B>::new(&room);
        let pairs = RoomPairs { views, choice };
        neighbour_second_moment_radius(&polynomials, matrix, pairs).map_err(Failure::run)
    }

    /// Refuses walks whose error bars would mean nothing, with the solved system if there is one.
    fn refuse_infinite(&self, solved: Option<&Solved>) -> Result<(), Failure> {
        let absorption = self.file.walk.absorption.value;
        let materials = self.surfaces.materials.iter().flatten();
        let largest = materials.fold(0.0, |m: f64, material| m.max(material.reflectance));
        if !(largest * largest / (1.0 - absorption) < 1.0) {
            let radius = self.second_moment()?;
            if !(radius < 1.0) {
                let what = "reflectance²/(1 − absorption)";
                return Err(infinite_variance(self.file, what, radius));
            }
        }
        let degree = self.degree();
        if degree == 0 {
            // h is a mean of k over cells.
            return Ok(());
        }
        let radius = of_degree!(degree, B => self.neighbour_second_moment::<B>(solved))?;
        if radius < 1.0 {
            return Ok(());
        }
        let what = format!(
            "h² of degree {degree} on {} cells (more may help)",
            self.cells
        );
        Err(infinite_variance(self.file, what, radius))
    }

    /// Its surfaces, and its scene.
    pub(crate) const fn parts(&self) -> (&Surfaces, &Scene) {
        (&self.surfaces, &self.scene)
    }

    /// Few cells, on which estimates take milliseconds.
    fn coarse_mesh(&self) -> Result<Mesh, Failure> {
        mesh(self.file, &self.scene, self.cells.clamp(COARSEST, COARSE))
    }

    /// What is asked for and, with temperatures, every surface: for its net flux.
    fn places(&self) -> Vec<Where> {
        let mut places: Vec<Where> = self.asked.iter().map(|asked| asked.place.clone()).collect();
        if self.surfaces.heat && !self.only_u {
            places.extend((0..self.surfaces.names.len()).map(Where::Surface));
        }
        places
    }

    /// Where the walks of a target start.
    fn start<'r, 'a, F: Real>(
        &self,
        room: &'r Room<'a, F>,
        lengths: &'a [f64],
        place: &Where,
    ) -> Result<Start<'r, 'a, F>, Failure> {
        Ok(match place {
            Where::On(surface, t) => {
                let (wall, fraction) = self.scene.along(*surface, *t).map_err(Failure::run)?;
                Start::Point(At(room.point(wall, fraction).map_err(Failure::run)?))
            }
            place => {
                let walls = self.walls(place)?;
                Start::Mean(MeanOver::new(room, lengths, walls).map_err(Failure::run)?)
            }
        })
    }

    /// The walls of a mean.
    fn walls(&self, place: &Where) -> Result<core::ops::Range<usize>, Failure> {
        match place {
            Where::Surface(surface) => self.scene.walls_of(*surface).map_err(Failure::run),
            _ => {
                let last = self.scene.walls_of(self.scene.surfaces() - 1);
                Ok(0..last.map_err(Failure::run)?.end)
            }
        }
    }

    /// The one material of a place, if it has one.
    fn material(&self, place: &Where) -> Option<Material> {
        let of = |surface: usize| self.surfaces.materials.get(surface);
        match place {
            Where::On(surface, t) => {
                let (wall, _) = self.scene.along(*surface, *t).ok()?;
                let vertex = self.scene.place(wall)?.vertex;
                let own = of(*surface)?;
                own.get(vertex).or(own.first()).copied()
            }
            Where::Surface(surface) => match of(*surface)?.as_slice() {
                [first, rest @ ..] if rest.iter().all(|other| other == first) => Some(*first),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whether its irradiance takes walks of its own.
    fn is_looked_at_apart(&self, place: &Where) -> bool {
        !self.only_u && self.through_u(place).is_none()
    }

    /// How the irradiance of a place follows from u there, if it does.
    fn through_u(&self, place: &Where) -> Option<ThroughU> {
        match place {
            // All light that leaves walls of a closed room arrives at walls.
            Where::All if self.scene.enclosure() == Enclosure::Closed => Some(ThroughU {
                emission: 0.0,
                reflectance: 1.0,
            }),
            place => self
                .material(place)
                .filter(|material| material.reflectance > 0.0)
                .map(|material| ThroughU {
                    emission: material.emission,
                    reflectance: material.reflectance,
                }),
        }
    }

    /// Irradiance, and with temperatures the net flux out of a wall: of a surface in W per metre of
    /// depth, at a point in W/m².
    fn besides(&self, place: &Where, irradiance: Option<Estimate>) -> Besides {
        let net_flux = irradiance.filter(|_| self.surfaces.heat).and_then(|h| {
            let material = self.material(place)?;
            let length = match place {
                Where::Surface(surface) => self.scene.length(*surface).ok()?,
                _ => 1.0,
            };
            let scale = |x: Option<f64>| x.map(|x| (1.0 - material.reflectance) * length * x);
            Some(Estimate {
                estimate: length * material.net_flux(h.estimate),
                std_error: scale(h.std_error),
                std_dev: scale(h.std_dev),
            })
        });
        Besides {
            irradiance,
            net_flux,
        }
    }
}

/// What v gives where walks start.
struct Solutions<'s, 'a, F> {
    /// Its mean.
    mean: &'s dyn Fn(&MeanOver<'_, 'a, F>) -> f64,
    /// The irradiance that it makes.
    irradiance: &'s dyn Fn(&Point<F>) -> f64,
}

/// A neighbour equation of any degree.
pub(crate) type Boxed<'a, F> = dyn Neighbour<Scalar = F, Point = Point<F>> + Sync + 'a;

/// The coefficients of a room, and the Galerkin solution.
#[derive(Debug)]
pub(crate) struct System {
    pub(crate) matrix: Matrix,
    solution: Solution,
}

/// What walks in a room need.
#[derive(Debug)]
pub(crate) struct SetUp<F, const B: usize = 1> {
    pub(crate) tables: Tables<F>,
    pub(crate) absorption: f64,
    pub(crate) system: Arc<System>,
    pub(crate) choice: Choice,
    /// The kinds of all pairs, where they are chosen one by one.
    kinds: Option<Vec<u8>>,
    /// The Galerkin solution.
    pub(crate) v: Vec<F>,
    pub(crate) g: Vec<F>,
}

impl<F: Real, const B: usize> SetUp<F, B> {
    /// The room.
    pub(crate) fn room(&self) -> Result<Room<'_, F>, Failure> {
        let (geometry, cells) = (self.tables.geometry(), self.tables.cells());
        Room::new(geometry, cells, self.system.matrix.views(), self.absorption)
            .map_err(Failure::input)
    }

    /// Pointwise pairs of a row.
    fn pointwise(&self) -> Result<PointwisePairs, Failure> {
        let (views, cells) = (self.system.matrix.views(), self.tables.cells());
        Ok(match self.pairs()? {
            AnyPairs::Table(pairs) => pointwise_pairs(&cells, views, &pairs),
            _ => pointwise_pairs(&cells, views, &self.by_views()),
        })
    }

    /// K'.
    pub(crate) fn coefficients(&self) -> Dense<'_, f64> {
        self.system.matrix.coefficients()
    }

    /// The neighbour equation that v solves exactly.
    pub(crate) fn neighbour<'s>(
        &'s self,
        polynomials: &'s Polynomials<'s, 's, F, B>,
        coefficients: &'s Rounded<'s, Dense<'s, f64>, F>,
    ) -> Result<Box<Boxed<'s, F>>, Failure> {
        let (v, g) = (&self.v, &self.g);
        Ok(match self.pairs()? {
            AnyPairs::Table(pairs) => Box::new(
                Piecewise::with_pointwise(polynomials, coefficients, pairs, v, g)
                    .map_err(Failure::run)?,
            ),
            _ => Box::new(
                Piecewise::with_pointwise(polynomials, coefficients, self.by_views(), v, g)
                    .map_err(Failure::run)?,
            ),
        })
    }

    fn by_views(&self) -> RoomPairs<'_> {
        RoomPairs {
            views: self.system.matrix.views(),
            choice: self.choice,
        }
    }

    /// The kinds of pairs.
    fn pairs(&self) -> Result<AnyPairs<'_>, Failure> {
        Ok(match &self.kinds {
            Some(table) => {
                let cells = self.tables.cells().len();
                AnyPairs::Table(PairTable::new(table, cells).map_err(Failure::run)?)
            }
            None => AnyPairs::Views(self.by_views()),
        })
    }
}

/// H = (u − F)/ρ.
struct ThroughU {
    emission: f64,
    reflectance: f64,
}

impl ThroughU {
    fn of(&self, u: Estimate) -> Estimate {
        let scale = |x: Option<f64>| x.map(|x| x / self.reflectance);
        Estimate {
            estimate: (u.estimate - self.emission) / self.reflectance,
            std_error: scale(u.std_error),
            std_dev: scale(u.std_dev),
        }
    }
}

/// What the pairs of a file do with views; from the theory they start as the default.
const fn choice(pairs: Pairs) -> Choice {
    match pairs {
        Pairs::Paper => Choice::Paper,
        Pairs::Default | Pairs::Theory => Choice::Default,
        Pairs::Pointwise => Choice::Pointwise,
    }
}

/// Pointwise pairs of a row, in the mean over the walls' length: walks seldom meet the small cells in corners.
fn pointwise_pairs<F: Real>(
    cells: &Cells<'_, F>,
    views: Views<'_>,
    pairs: &impl galerkin::Pairs,
) -> PointwisePairs {
    let (mut seen, mut hidden, mut all) = (0.0, 0.0, 0.0);
    for i in 0..cells.len() {
        let length = cells.length(i).to_f64();
        all += length;
        for j in pairs.pointwise(i, cells.len()) {
            let sum = match views.view(i, j) {
                View::Partly => &mut hidden,
                _ => &mut seen,
            };
            *sum += length;
        }
    }
    PointwisePairs {
        seen: seen / all,
        hidden: hidden / all,
    }
}

/// How the file cuts walls.
fn grading(file: &ProblemFile) -> Grading {
    let Galerkin {
        grading,
        shadow_cuts,
        degree,
        ..
    } = &file.galerkin;
    let default = Grading::of_degree(degree.value);
    Grading {
        exponent: grading.as_ref().map_or(default.exponent, |g| g.value),
        shadows: shadow_cuts.as_ref().map_or(default.shadows, |s| s.value),
    }
}

/// The cells of a scene.
fn mesh(file: &ProblemFile, scene: &Scene, cells: usize) -> Result<Mesh, Failure> {
    let grading = grading(file);
    match file.walk.scalar.value {
        Scalar::F32 => Mesh::new::<f32>(scene, cells, grading),
        Scalar::F64 => Mesh::new::<f64>(scene, cells, grading),
    }
    .map_err(Failure::input)
}

/// Bytes of the tables of n cells.
const fn memory(n: usize, degree: usize) -> usize {
    let functions = degree + 1;
    let pair = 1 + 8 * functions * functions;
    let table = n.saturating_mul(n).saturating_mul(pair);
    table.saturating_add(n.saturating_mul(200 + 8 * 8 * functions))
}

/// The places of a target; `find` gives the number of a surface.
fn targets<E>(
    what: &What,
    find: impl Fn(&Placed<String>) -> Result<usize, E>,
) -> Result<Vec<Where>, E> {
    Ok(match what {
        What::On(surface, t) => vec![Where::On(find(surface)?, t.value)],
        What::OverSurface(surface) => vec![Where::Surface(find(surface)?)],
        What::OverAll => vec![Where::All],
        What::Grid(points, Some(surface)) => {
            let surface = find(surface)?;
            // The middles of equal parts: in a corner two surfaces meet.
            let at = |i| (i as f64 + 0.5) / points.value as f64;
            (0..points.value)
                .map(|i| Where::On(surface, at(i)))
                .collect()
        }
        // Validation has refused them.
        What::At(_) | What::Over(..) | What::Weight(_) | What::Grid(_, None) => Vec::new(),
    })
}

/// The error of a scene, at its place in the file.
fn refused(
    file: &ProblemFile,
    room: &file::Room,
    surfaces: &Surfaces,
    error: RoomError,
) -> Failure {
    let (message, place) = surfaces.explain(error);
    let found = place.and_then(|place| {
        let surface = room.surfaces.get(place.surface)?;
        let points = surface.points.as_ref()?;
        Some(
            points
                .value
                .get(place.vertex)
                .map_or(&points.place, |point| &point.place),
        )
    });
    match found {
        Some(place) => file.error(place, message).into(),
        None => file.error(&room.place, message).into(),
    }
}

/// Where the walks of a target start.
enum Start<'r, 'a, F> {
    Point(At<Point<F>>),
    Mean(MeanOver<'r, 'a, F>),
    Light(Irradiance<'r, 'a, F, At<Point<F>>>),
    LightMean(Irradiance<'r, 'a, F, MeanOver<'r, 'a, F>>),
}

impl<'a, F: Real> Functional<Room<'a, F>> for Start<'_, 'a, F> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        match self {
            Self::Point(At(x)) => (*x, F::one()),
            Self::Mean(mean) => mean.start(uniforms),
            Self::Light(light) => light.start(uniforms),
            Self::LightMean(light) => light.start(uniforms),
        }
    }
}

impl Problem for RoomFile<'_> {
    fn kind(&self) -> &'static str {
        "room"
    }

    fn cells(&self) -> usize {
        self.cells
    }

    fn unknowns(&self) -> usize {
        self.mesh.len().saturating_mul(self.degree() + 1)
    }

    fn cells_text(&self) -> String {
        format!("{} asked for, {} in all", self.cells, self.mesh.len())
    }

    fn asked(&self) -> &[Asked] {
        &self.asked
    }

    fn surface(&self, number: usize) -> Option<&str> {
        self.surfaces.names.get(number).map(String::as_str)
    }

    fn memory(&self) -> usize {
        let theory = theory::memory(self.file, self.mesh.len(), self.degree() + 2);
        memory(self.mesh.len(), self.degree()).saturating_add(theory)
    }

    fn cost(&self) -> Cost {
        let n = self.mesh.len() as f64;
        let degree = self.degree() as f64;
        let depth = (self.scene.geometry().walls().len().max(4) as f64).log2();
        let ray = RAY * depth;
        let plain = WalkCost {
            start: START,
            step: ray,
            score: SCORE,
            pair: 0.0,
            hidden_pair: 0.0,
        };
        let pair = match self.degree() {
            0 => PAIR_OF_CONSTANTS,
            _ => PAIR_OF_POLYNOMIALS + degree * PAIR_DEGREE,
        };
        let pointwise = WalkCost {
            pair,
            hidden_pair: HIDDEN_PAIR * depth,
            ..plain
        };
        let walk = match (choice(self.pairs()), self.degree()) {
            (Choice::Pointwise, 0) => pointwise,
            (Choice::Pointwise, _) => WalkCost {
                score: SCORE + NEAR + degree * NEAR_DEGREE,
                ..pointwise
            },
            _ => WalkCost {
                step: ray + IN_S + degree * IN_S_DEGREE,
                score: SCORE + IN_S_SCORE,
                ..pointwise
            },
        };
        Cost {
            setup: n * n * (PAIR + degree * MOMENTS) + n * degree * CLOSE,
            source: SOURCE * (n * (degree + 1.0)).powi(2),
            walk,
            plain,
        }
    }

    fn pointwise_pairs(&self) -> Result<PointwisePairs, Failure> {
        let coarse = self.coarse_mesh()?;
        let matrix = Matrix::new(&self.scene, &coarse, r_min(self.degree()));
        let matrix = matrix.map_err(Failure::run)?;
        let (views, chosen) = (matrix.views(), self.pairs());
        let choice = choice(chosen);
        let pairs = pointwise_pairs(&coarse.cells(), views, &RoomPairs { views, choice });
        Ok(pairs.on(chosen, self.mesh.len() as f64 / coarse.len() as f64))
    }

    fn starts(&self) -> usize {
        let places = self.places();
        let apart = places.iter().filter(|place| self.is_looked_at_apart(place));
        places.len() + apart.count()
    }

    fn refuse_infinite_variance(&self) -> Result<(), Failure> {
        self.refuse_infinite(None)
    }

    fn refuse_infinite_variance_of(&self, solved: &Solved) -> Result<(), Failure> {
        self.refuse_infinite(Some(solved))
    }

    fn second_moment(&self) -> Result<f64, Failure> {
        let coarse = self.coarse_mesh()?;
        let matrix = Matrix::new(&self.scene, &coarse, R_MIN).map_err(Failure::run)?;
        let absorption = self.file.walk.absorption.value;
        second_moment_radius(&self.scene, &coarse, &matrix, absorption).map_err(Failure::run)
    }

    fn absorption(&self) -> f64 {
        self.file.walk.absorption.value
    }

    fn mean_on(&self, cells: usize) -> Result<Box<dyn Problem + '_>, Failure> {
        Ok(Box::new(Self {
            file: self.file,
            surfaces: self.surfaces.clone(),
            scene: self.scene.clone(),
            mesh: mesh(self.file, &self.scene, cells)?,
            cells,
            asked: vec![Asked {
                name: "mean".to_owned(),
                place: Where::All,
            }],
            only_u: true,
        }))
    }

    fn levels(&self) -> Vec<usize> {
        let walls = self.scene.walls_of(self.scene.surfaces() - 1);
        let least = walls.map_or(1, |walls| walls.end);
        let levels = [100, 200, 400, 800, 1600];
        // As many unknowns as take seconds.
        let most = 3200 / (self.degree() + 1);
        levels
            .into_iter()
            .filter(|&cells| cells > 2 * least && cells <= most)
            .collect()
    }

    fn coarse(&self) -> Vec<usize> {
        // With more walls than a sweep goes to, every wall is a cell.
        let first = self.levels().first().copied();
        let first = first.unwrap_or(4 * self.scene.geometry().walls().len());
        vec![first / 4, first / 2]
    }

    /// Pairs next to a corner, which look alike at every size, hold cells of grading g at g/2.
    fn order(&self, degree: usize) -> f64 {
        let own = self.smooth_order(degree);
        match choice(self.pairs()) {
            Choice::Default => own.min(0.5 * grading(self.file).exponent),
            _ => own,
        }
    }

    /// Every pair costs about one evaluation.
    fn evaluations(&self, _: u32) -> f64 {
        (self.mesh.len() as f64).powi(2)
    }

    fn diagnose(&self, request: &Request<'_>) -> Result<Diagnosis, Failure> {
        of_degree!(self.degree(), B => self.diagnose_in::<B>(request))
    }

    fn plain(&self, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        match self.file.walk.scalar.value {
            Scalar::F32 => self.plain_in::<f32>(plan, progress),
            Scalar::F64 => self.plain_in::<f64>(plan, progress),
        }
    }

    fn tables(&self) -> Result<TableBuilder, Failure> {
        of_degree!(self.degree(), B => match self.file.walk.scalar.value {
            Scalar::F32 => self.tables_in::<f32, B>(),
            Scalar::F64 => self.tables_in::<f64, B>(),
        })
    }

    fn solve(&self) -> Result<Solved, Failure> {
        of_degree!(self.degree(), B => Solved::new(|| Ok(Arc::new(self.system::<B>()?))))
    }

    fn mean_square_of_source(&self) -> f64 {
        let walls = self.scene.geometry().walls().iter();
        let length: f64 = walls.map(|wall| wall.length).sum();
        self.square_of_source() / length
    }

    fn rare_variance(&self, solved: Option<&Solved>) -> Result<f64, Failure> {
        let squares = self.square_of_source();
        let choice = choice(self.pairs());
        if choice == Choice::Pointwise || squares == 0.0 {
            return Ok(0.0);
        }
        let rare = of_degree!(self.degree(), B => {
            let system = solved.map(|solved| solved.system::<Arc<System>>()).transpose()?;
            let matrix = system.map(|system| &system.matrix);
            corners::rare::<B>(&self.scene, &self.mesh, choice, matrix)
        })?;
        Ok(rare / squares)
    }

    fn walk(&self, solved: &Solved, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        let mut answer = of_degree!(self.degree(), B => {
            let system = solved.system::<Arc<System>>()?;
            match self.file.walk.scalar.value {
                Scalar::F32 => self.answer_in::<f32, B>(system, plan, progress),
                Scalar::F64 => self.answer_in::<f64, B>(system, plan, progress),
            }
        })?;
        answer.setup_seconds += solved.seconds;
        Ok(answer)
    }
}
