#![doc = include_str!("../README.md")]

mod examine;
mod export;
mod field;
mod global;
mod heat;
mod leaks;
mod light;
mod means;
mod notes;
mod partition;
mod starts;
mod surfaces;
mod system;

use fredholm_room::{Grading, Mesh, Scene, Seen, Tables};

pub use field::{Field, FieldRequest, Stretch};
pub use fredholm_model::channels::Colours;
pub use fredholm_model::{Beside, Spot};
pub use fredholm_room::{Material, Outside};
pub use surfaces::Surfaces;

use fredholm_core::Statistics;
use fredholm_model::channels::{self, ColouredPart};
use fredholm_model::heat::{RadiativeExchange, check_asked};
use fredholm_model::memory::refuse_beyond_memory;
use fredholm_model::{About, Quantity, SurfaceQuantities, WholeValues};
use fredholm_model::{
    Derived, Discretisation, Error, Goal, LastSteps, Model, Pairs, Partitioned, Region, Scalar,
    Subject, in_scalar,
};
use light::Lights;
use partition::memory;

/// About so many cells where nothing is said of them.
const DEFAULT_CELLS: usize = 500;

/// An expression in which the number of functions per cell of a degree is a constant of this name.
macro_rules! of_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            0 => crate::of_degree!(1 as $name => $then),
            1 => crate::of_degree!(2 as $name => $then),
            2 => crate::of_degree!(3 as $name => $then),
            3 => crate::of_degree!(4 as $name => $then),
            // The model lets nothing above 4 pass.
            _ => crate::of_degree!(5 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}
pub(crate) use of_degree;

/// The equation of light or heat in a room.
///
/// ```
/// use fredholm::room::{Material, Surfaces};
/// use fredholm::{RoomModel, Scalar, Solver};
///
/// let floor = Material { reflectance: 0.5, emission: 1.0 };
/// let walls = Material { reflectance: 0.5, emission: 0.0 };
/// let square = Surfaces::default()
///     .with("floor", &[[0.0, 0.0], [1.0, 0.0]], floor)
///     .with("walls", &[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], walls);
/// let room = RoomModel::new(square, Scalar::F64)?;
/// let report = Solver::new(&room).mean().on("walls", 0.5).solve_to(1e-3)?;
/// // What the floor emits is what all absorb: 1 = ½ · 4 · the mean of u.
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 0.5).abs() < 5e-3);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug)]
pub struct RoomModel {
    surfaces: Surfaces,
    scene: Scene,
    lights: Lights,
    colours: Option<Colours>,
}

impl RoomModel {
    pub(crate) fn surface_quantities(&self) -> SurfaceQuantities {
        let of = (self.colours.as_ref(), Vec::new());
        SurfaceQuantities::new(self, &|surface| self.part(surface), of)
    }

    /// A room for walks in this scalar.
    ///
    /// # Errors
    /// [`Error::Scene`].
    pub fn new(surfaces: Surfaces, scalar: Scalar) -> Result<Self, Error> {
        let scene = in_scalar!(scalar, F => surfaces.scene::<F>()?);
        Ok(Self {
            lights: Lights::new(&scene),
            surfaces,
            scene,
            colours: None,
        })
    }

    /// The room in several channels, in each of which its surfaces have materials of their own: those of the room are then
    /// [the largest](Colours::largest) of them.
    ///
    /// # Errors
    /// [`Error::Option`]: the room has other surfaces or materials than these; it is one of temperatures; or the channels
    /// are none, or more than a walk serves.
    pub fn with_colours(self, colours: Colours) -> Result<Self, Error> {
        let parts = |(surface, own): (usize, &Vec<Material>)| {
            let of = move |(part, &largest)| ColouredPart {
                surface,
                part,
                largest,
            };
            own.iter().enumerate().map(of).collect::<Vec<_>>()
        };
        let materials = self.surfaces.materials.iter().enumerate();
        colours.check(&self.surfaces.names, materials.flat_map(parts))?;
        if self.surfaces.heat {
            return channels::refuse_heat();
        }
        Ok(Self {
            colours: Some(colours),
            ..self
        })
    }

    /// The materials of its channels, if it has several.
    #[must_use]
    pub const fn colours(&self) -> Option<&Colours> {
        self.colours.as_ref()
    }

    /// The weights of a sum of all channels, which is asked for beside them; none, of one channel.
    fn weights(&self) -> &[f64] {
        self.colours()
            .map_or(&[], |colours| colours.names.weights())
    }

    /// Refuses the tables of so many cells, or of as many as there are segments, that do not fit into memory: asked
    /// before a scene is made of them, which may take long.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn refuse_beyond_memory(
        surfaces: &Surfaces,
        discretisation: &Discretisation,
    ) -> Result<(), Error> {
        // Every segment is one cell at least.
        let segments = surfaces.points.iter().map(|p| p.len().saturating_sub(1));
        let cells = discretisation.cells.unwrap_or(DEFAULT_CELLS);
        let walls = segments.sum();
        refuse_tables([cells.max(walls), walls], discretisation.degree)
    }

    /// The surfaces.
    #[must_use]
    pub const fn surfaces(&self) -> &Surfaces {
        &self.surfaces
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether points are between the walls: not behind them nor within an obstacle.
    ///
    /// # Errors
    /// [`Error::Room`].
    pub fn are_inside(&self, positions: &[[f64; 2]]) -> Result<Vec<bool>, Error> {
        if positions.is_empty() {
            return Ok(Vec::new());
        }
        let mesh = Mesh::new::<f64>(&self.scene, 1, Grading::default())?;
        let tables = Tables::<f64>::new(&self.scene, &mesh);
        let room = &tables.room();
        let (ones, closed) = (vec![1.0; mesh.len()], !self.surfaces.open);
        let sees = |&position: &[f64; 2]| {
            let Some(position) = self.scene.folded(position) else {
                return false;
            };
            let [_, share] = Seen { room, position }.of(&ones);
            field::is_inside(share, closed, f64::EPSILON)
        };
        Ok(positions.iter().map(sees).collect())
    }

    /// A place in the period of which there are copies on both sides.
    pub(crate) fn folded(&self, position: [f64; 2]) -> [f64; 2] {
        self.scene.folded(position).unwrap_or([f64::NAN; 2])
    }

    /// Refuses a region that it does not have, but for points in the air.
    fn check_region(&self, region: &Region) -> Result<(), Error> {
        let is_part = |part: &usize| *part < self.surfaces.names.len();
        let parts = match region {
            Region::Part(part) | Region::On(part, _) => core::slice::from_ref(part),
            Region::Parts(parts) => parts,
            _ => &[],
        };
        if let Some(&part) = parts
            .iter()
            .find(|part| is_part(part) && !self.has_walls(**part))
        {
            let message = self.surfaces.without_walls(part);
            return Err(Error::Region { message });
        }
        let message = match region {
            Region::Whole => return Ok(()),
            Region::Part(part) if is_part(part) => return Ok(()),
            Region::Parts(parts) if !parts.is_empty() && parts.iter().all(is_part) => return Ok(()),
            Region::On(part, t) if is_part(part) && (0.0..=1.0).contains(t) => return Ok(()),
            Region::On(..) => "a place on a surface is a share of its length, from 0 to 1",
            Region::Point(_) => "a point in the air has two coordinates",
            _ => "a room has points in the air, places on surfaces, and means over surfaces",
        };
        Err(Error::Region {
            message: message.to_owned(),
        })
    }

    /// Whether a surface is there, and not all covered by others.
    fn has_walls(&self, surface: usize) -> bool {
        let walls = self.scene.walls_of(surface);
        walls.is_ok_and(|walls| !walls.is_empty())
    }

    fn mesh(&self, cut: &Discretisation, cells: usize) -> Result<Mesh, Error> {
        // A mesh of more cells than there is memory for takes long by itself.
        refuse_tables([cells, self.scene.geometry().walls().len()], cut.degree)?;
        let grading = grading(cut);
        Ok(in_scalar!(cut.scalar, F => Mesh::new::<F>(&self.scene, cells, grading)?))
    }

    /// The walls of a mean, of every surface a range.
    fn walls(&self, region: &Region) -> Result<Vec<core::ops::Range<usize>>, Error> {
        let of = |surface: &usize| Ok::<_, Error>(self.scene.walls_of(*surface)?);
        match region {
            Region::Part(surface) => Ok(vec![of(surface)?]),
            Region::Parts(surfaces) => surfaces.iter().map(of).collect(),
            _ => {
                let all = 0..of(&(self.scene.surfaces() - 1))?.end;
                Ok(vec![all])
            }
        }
    }
}

/// What needs less memory.
const ADVICE: &str = ": use fewer cells";

/// Refuses the tables of so many cells of so many walls that do not fit into memory.
fn refuse_tables([cells, walls]: [usize; 2], degree: usize) -> Result<(), Error> {
    let needed = memory([cells, walls], degree);
    refuse_beyond_memory(|| format!("{cells} unknowns"), needed, ADVICE)
}

/// How walls are cut.
fn grading(cut: &Discretisation) -> Grading {
    let default = Grading::of_degree(cut.degree);
    Grading {
        exponent: cut.grading.unwrap_or(default.exponent),
        shadows: cut.shadow_cuts.unwrap_or(default.shadows),
    }
}

impl Model for RoomModel {
    fn about(&self) -> About {
        let heat = self.surfaces.heat.then_some("W/m2");
        let unit = heat.or_else(|| self.colours.as_ref()?.names.unit());
        About {
            most_degree: 4,
            less_memory: ADVICE,
            takes_any_cells: true,
            whole: match self.colours {
                None => WholeValues::Points,
                Some(_) => WholeValues::None,
            },
            unit,
            irradiance_unit: unit,
            last_steps: LastSteps::Open {
                pay: self.lights.pay,
            },
            // Rays, and what is nearest to them.
            pairs_to_choose: &[Pairs::Rays, Pairs::Pointwise],
            // With an exact G: where few walks start, in corners, what a ray leaves would be the largest error of all.
            whole_pairs: Pairs::Pointwise,
            ..About::of_kind("room")
        }
    }

    fn part(&self, number: usize) -> Option<&str> {
        self.surfaces.names.get(number).map(String::as_str)
    }

    fn channels(&self) -> &[String] {
        self.colours.as_ref().map_or(&[], |own| own.names.shared())
    }

    fn position(&self, region: &Region) -> Option<Vec<f64>> {
        let Region::On(surface, t) = *region else {
            return None;
        };
        let (wall, fraction) = self.scene.along(surface, t).ok()?;
        let [a, b] = self.scene.geometry().walls().get(wall)?.ends;
        let between = |k: usize| (1.0 - fraction) * a[k] + fraction * b[k];
        Some(vec![between(0), between(1)])
    }

    fn notes(&self) -> Vec<String> {
        self.surfaces.notes(&self.scene)
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        let mut in_air = Vec::new();
        for goal in goals {
            check_asked(self, &goal.region, self.colours().is_some())?;
            if let Region::Point(x) = goal.region.place()
                && let [x, y] = *x.as_slice()
            {
                in_air.push([x, y]);
            } else {
                self.check_region(goal.region.place())?;
            }
        }
        // All at once, as every look takes a mesh.
        let inside = self.are_inside(&in_air)?;
        match in_air.iter().zip(inside).find(|(_, inside)| !inside) {
            None => Ok(()),
            Some(([x, y], _)) => Err(Error::Region {
                message: format!("the point [{x}, {y}] is not between the walls"),
            }),
        }
    }

    fn grid(&self, points: usize, part: Option<usize>) -> Vec<Region> {
        // The middles of equal parts: in a corner two surfaces meet.
        let at = |i| (i as f64 + 0.5) / points as f64;
        let part = part.unwrap_or(0);
        (0..points).map(|i| Region::On(part, at(i))).collect()
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        let is_periodic = self.surfaces.period.is_some();
        if pairs != Pairs::Paper
            || discretisation.degree == 0 && self.colours.is_none() && !is_periodic
        {
            return Ok(());
        }
        Err(Error::Option {
            subject: Subject::Pairs,
            message: "the paper's pairs of cells are of functions that are constant on cells, in one channel, without a period: leave \
                      `pairs` and `method` out, or `degree`, `channels` and `period`"
                .to_owned(),
        })
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        Ok(Box::new(self.cut(discretisation)?))
    }

    fn levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        let walls = self.scene.walls_of(self.scene.surfaces() - 1);
        let least = walls.map_or(1, |walls| walls.end);
        let levels = [100, 200, 400, 800, 1600];
        // As many unknowns as take seconds.
        let most = 3200 / (discretisation.degree + 1);
        levels
            .into_iter()
            .filter(|&cells| cells > 2 * least && cells <= most)
            .collect()
    }

    fn coarse_levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        // With more walls than a sweep goes to, every wall is a cell.
        let first = self.levels(discretisation).first().copied();
        let first = first.unwrap_or(4 * self.scene.geometry().walls().len());
        vec![first / 4, first / 2]
    }

    /// The middles of equal parts of all surfaces, of each about as many as its share of the length, and one at least.
    fn spread(&self, points: f64) -> Vec<Region> {
        let surfaces = 0..self.surfaces.names.len();
        let there = surfaces.filter(|&surface| self.has_walls(surface));
        let length = |surface| self.scene.length(surface).unwrap_or(0.0);
        let there: Vec<(usize, f64)> = there.map(|surface| (surface, length(surface))).collect();
        let all: f64 = there.iter().map(|(_, length)| length).sum();
        let own = |(surface, length): (usize, f64)| {
            let share = (points * length / all).round().max(1.0);
            self.grid(share as usize, Some(surface))
        };
        there.into_iter().flat_map(own).collect()
    }

    fn is_in_space(&self, region: &Region) -> bool {
        matches!(region, Region::On(..))
    }

    fn derive(&self, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        match &self.colours {
            Some(colours) => self.derived_in(colours, goals, statistics),
            None => self.derived(goals, statistics),
        }
    }

    /// None of several channels, of which all follows from u.
    fn quantities(&self) -> Vec<Quantity> {
        self.surface_quantities().quantities
    }

    fn exchange(&self) -> Option<&dyn RadiativeExchange> {
        self.colours.is_none().then_some(self)
    }
}
