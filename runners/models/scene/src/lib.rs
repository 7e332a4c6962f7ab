//! Light and heat between polygons in space, with sizes chosen at run time.

mod adjoint;
mod camera;
mod channels;
mod coloured;
mod colours;
mod examine;
mod export;
mod heat;
mod partition;
mod pixel;
mod radius;
mod regions;
mod system;
mod view;
mod whole;

use core::fmt;

use fredholm_core::{Estimator, Statistics};
use fredholm_model::heat::RadiativeExchange;
use fredholm_model::{
    About, Derived, Discretisation, Error, Goal, LastSteps, Model, Pairs, Partitioned, Region,
    Scalar, Subject, in_scalar,
};
use fredholm_scene::Surface;

pub use camera::Camera;
pub use colours::Colours;
pub use fredholm_scene::{Beam, Enclosure, Material, Polygon, Scene, SkyLight, shapes};
use partition::ScenePartition;
pub use view::{View, ViewRequest};

/// An expression in which the number of functions per cell of a degree is a constant of this name.
macro_rules! of_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            0 => crate::of_degree!(1 as $name => $then),
            1 => crate::of_degree!(3 as $name => $then),
            // The model lets nothing above 2 pass.
            _ => crate::of_degree!(6 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}
pub(crate) use of_degree;

/// The largest degree of polynomials on a cell.
const MOST_DEGREE: usize = 2;

/// Surfaces of a scene by name, each with its polygons and one material.
///
/// ```
/// use fredholm::scene::{Material, NamedSurface, shapes};
///
/// let floor = NamedSurface {
///     name: "floor".to_owned(),
///     polygons: shapes::room([0.0; 3], [1.0; 3]).surfaces.swap_remove(0),
///     material: Material { reflectance: 0.5, emission: 0.0 },
/// };
/// assert_eq!(floor.polygons.len(), 1);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSurface {
    /// The name in results.
    pub name: String,
    /// The polygons, counter-clockwise seen from the active side.
    pub polygons: Vec<Polygon>,
    /// Reflectance and emission of all of them.
    pub material: Material,
}

/// The equation of light or heat between polygons in space.
///
/// Walks estimate u − F with a last step to the light in every state, by the neighbour equation of v ≈ u − F that follows
/// from rays alone: see `fredholm_core::sampled`.
///
/// ```
/// use fredholm::scene::{Enclosure, Material, NamedSurface, shapes};
/// use fredholm::{Estimator, Scalar, SceneModel, Solver};
///
/// // A cube with a lamp for a ceiling: what it emits is what all absorb, 1 = ½ · 6 · the mean of u.
/// let names = ["floor", "ceiling", "front", "back", "left", "right"];
/// let room = shapes::room([0.0; 3], [1.0; 3]).surfaces.into_iter().zip(names);
/// let surfaces = room.map(|(polygons, name)| NamedSurface {
///     name: name.to_owned(),
///     polygons,
///     material: Material { reflectance: 0.5, emission: f64::from(u8::from(name == "ceiling")) },
/// });
/// let cube = SceneModel::new(surfaces.collect(), Enclosure::Closed, Scalar::F64)?;
/// let solver = Solver::new(&cube).mean().cells(24).degree(1).estimator(Estimator::Collision);
/// let report = solver.walks(20_000).solve()?;
/// let mean = &report.goals[0].preconditioned;
/// assert!((mean.estimate.unwrap() - 1.0 / 3.0).abs() < 5.0 * mean.std_error.unwrap());
/// assert!(mean.std_error < report.goals[0].plain.std_error);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone)]
pub struct SceneModel {
    names: Vec<String>,
    scene: Scene,
    heat: Option<Temperatures>,
    colours: Option<Colours>,
    is_photometric: bool,
}

/// What a scene of temperatures and net fluxes has besides its materials.
///
/// ```
/// use fredholm::scene::Temperatures;
///
/// // Of two surfaces, from the second of which the net flux is given.
/// let of_heat = Temperatures { emissivities: vec![None, Some(0.9)], net_fluxes: true };
/// assert_eq!(of_heat.emissivities.len(), 2);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Temperatures {
    /// The emissivity of every surface from which the net flux is given, if it is known: it tells the temperature there, and
    /// nothing else.
    pub emissivities: Vec<Option<f64>>,
    /// Whether the net fluxes of all surfaces are wanted.
    pub net_fluxes: bool,
}

impl fmt::Debug for SceneModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SceneModel")
            .field("names", &self.names)
            .field("faces", &self.scene.faces().len())
            .finish_non_exhaustive()
    }
}

impl SceneModel {
    /// A scene for walks in this scalar.
    ///
    /// # Errors
    /// [`Error::Space`].
    pub fn new(
        surfaces: Vec<NamedSurface>,
        enclosure: Enclosure,
        scalar: Scalar,
    ) -> Result<Self, Error> {
        let materials: Vec<[Material; 1]> = surfaces.iter().map(|s| [s.material]).collect();
        let all: Vec<Surface<'_>> = surfaces
            .iter()
            .zip(&materials)
            .map(|(surface, materials)| Surface {
                polygons: &surface.polygons,
                materials,
            })
            .collect();
        let scene = in_scalar!(scalar, F => Scene::new::<F>(&all, enclosure)?);
        let names = surfaces.into_iter().map(|surface| surface.name).collect();
        Ok(Self::of_scene(names, scene))
    }

    /// A scene that was made for the scalar of the walks, and the names of its surfaces.
    #[must_use]
    pub const fn of_scene(names: Vec<String>, scene: Scene) -> Self {
        Self {
            names,
            scene,
            heat: None,
            colours: None,
            is_photometric: false,
        }
    }

    /// The scene as one of heat: u is in W/m², no longer in photometric units, and results are net fluxes and temperatures, too.
    #[must_use]
    pub fn with_heat(self, of_heat: Temperatures) -> Self {
        Self {
            heat: Some(of_heat),
            is_photometric: false,
            ..self
        }
    }

    /// The scene in several channels, in each of which its surfaces have materials of their own: those of the scene are then
    /// [the largest](Colours::largest) of them.
    ///
    /// # Errors
    /// [`Error::Option`]: the scene has other surfaces or materials than these; it is one of temperatures or in photometric units; or
    /// the channels are none, or more than a walk serves.
    pub fn with_colours(self, colours: Colours) -> Result<Self, Error> {
        colours.check(&self.scene)?;
        if self.heat.is_some() {
            return fredholm_model::channels::refuse_heat();
        }
        if self.is_photometric {
            return refuse_photometry();
        }
        Ok(Self {
            colours: Some(colours),
            ..self
        })
    }

    /// The scene with emissions in lumens per square metre: u has this unit, too, and irradiances are illuminances in lux.
    ///
    /// ```
    /// use fredholm::scene::{Colours, Enclosure, Material, NamedSurface, shapes};
    /// use fredholm::{Scalar, SceneModel, Solver};
    ///
    /// // Walls of 50 lm/m² that reflect half of what arrives, 100 lx everywhere.
    /// let material = Material { reflectance: 0.5, emission: 50.0 };
    /// let polygons = shapes::room([0.0; 3], [1.0; 3]).surfaces.into_iter().flatten().collect();
    /// let walls = NamedSurface { name: "walls".to_owned(), polygons, material };
    /// let cube = SceneModel::new(vec![walls], Enclosure::Closed, Scalar::F64)?.with_photometry()?;
    /// let report = Solver::new(&cube).mean().cells(6).degree(0).walks(1000).solve()?;
    /// let arriving = report.goals[0].irradiance.as_ref().unwrap();
    /// assert!((arriving.estimate.unwrap() - 100.0).abs() < 5.0 * arriving.std_error.unwrap() + 1e-9);
    /// assert_eq!((report.goals[0].plain.unit, arriving.unit), (Some("lm/m2"), Some("lx")));
    ///
    /// let two = Colours::new(vec!["a".to_owned(), "b".to_owned()], vec![vec![material; 2]]);
    /// assert!(cube.with_colours(two).is_err());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Option`]: it is one of temperatures, or has several channels.
    pub fn with_photometry(self) -> Result<Self, Error> {
        if self.heat.is_some() || self.colours.is_some() {
            return refuse_photometry();
        }
        Ok(Self {
            is_photometric: true,
            ..self
        })
    }

    /// The scene with light that no surface emits.
    ///
    /// # Errors
    /// [`Error::Space`].
    pub fn with_beams(self, beams: Vec<Beam<f64>>) -> Result<Self, Error> {
        let scene = self.scene.with_beams(beams)?;
        Ok(Self { scene, ..self })
    }

    /// The scene with light of the sky.
    ///
    /// # Errors
    /// [`Error::Space`]: it is closed.
    pub fn with_sky(self, sky: SkyLight) -> Result<Self, Error> {
        let scene = self.scene.with_sky(sky)?;
        Ok(Self { scene, ..self })
    }

    /// The materials of its channels, if it has several.
    #[must_use]
    pub const fn colours(&self) -> Option<&Colours> {
        self.colours.as_ref()
    }

    /// The names of the surfaces.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }
}

fn refuse_photometry() -> Result<SceneModel, Error> {
    Err(Error::Option {
        subject: Subject::Problem,
        message: "photometric units are of light in one channel: leave them out, or temperatures and channels"
            .to_owned(),
    })
}

impl Model for SceneModel {
    fn about(&self) -> About {
        About {
            kind: "scene",
            dimension: None,
            most_degree: MOST_DEGREE,
            less_memory: ": use fewer cells",
            takes_any_cells: true,
            counts_evaluations: false,
        }
    }

    /// The collision estimator, whose scores in all states lower the variance by more than their rays take time.
    fn estimator(&self) -> Estimator {
        Estimator::Collision
    }

    /// h = k on all of them.
    fn has_pairs(&self) -> bool {
        false
    }

    fn last_steps(&self) -> LastSteps {
        LastSteps::Always
    }

    fn part(&self, number: usize) -> Option<&str> {
        self.names.get(number).map(String::as_str)
    }

    fn unit(&self) -> Option<&'static str> {
        let heat = self.heat.as_ref().map(|_| "W/m2");
        heat.or_else(|| self.colours.as_ref()?.names().unit())
            .or(self.is_photometric.then_some("lm/m2"))
    }

    fn irradiance_unit(&self) -> Option<&'static str> {
        if self.is_photometric {
            Some("lx")
        } else {
            self.unit()
        }
    }

    fn flux_unit(&self) -> &'static str {
        "W"
    }

    fn channels(&self) -> &[String] {
        self.colours.as_ref().map_or(&[], Colours::shared_names)
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        goals.iter().try_for_each(|goal| {
            match regions::Place::new(&self.scene, &goal.region)? {
                regions::Place::Facing(..) if self.colours.is_some() => Err(Error::Region {
                    message: "what faces in a direction in the air has one channel so far: ask for a point, without \
                              a direction, or for one channel alone"
                        .to_owned(),
                }),
                _ => Ok(()),
            }
        })
    }

    /// There is no line through a scene that anybody would mean.
    fn grid(&self, _: usize, _: Option<usize>) -> Vec<Region> {
        Vec::new()
    }

    fn has_whole(&self) -> bool {
        self.colours.is_none()
    }

    fn whole_has_points(&self) -> bool {
        false
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        let refuse = |subject, message: String| Err(Error::Option { subject, message });
        if discretisation.degree > MOST_DEGREE {
            let message = format!("in a scene functions on a cell have degree 0 to {MOST_DEGREE}");
            return refuse(Subject::Degree, message);
        }
        if matches!(pairs, Pairs::Paper | Pairs::Theory | Pairs::Rays) {
            let message = "the neighbour equation of a scene comes from rays alone, with h = k for all pairs of cells: \
                           leave `pairs` out";
            return refuse(Subject::Pairs, message.to_owned());
        }
        Ok(())
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        Ok(Box::new(ScenePartition::new(self, discretisation)?))
    }

    fn levels(&self, _: &Discretisation) -> Vec<usize> {
        let least = self.scene.faces().len();
        let levels = [12, 30, 60, 120, 240, 480].into_iter();
        let mut levels: Vec<usize> = levels.filter(|cells| *cells >= least).collect();
        if levels.is_empty() {
            // Every face is a cell.
            levels.push(least);
        }
        levels
    }

    fn position(&self, region: &Region) -> Option<Vec<f64>> {
        match region {
            Region::Spot(_, at) | Region::Facing { at, .. } => Some(at.to_vec()),
            _ => None,
        }
    }

    fn is_in_space(&self, region: &Region) -> bool {
        matches!(region, Region::Spot(..) | Region::Point(_)) && !self.is_in_air(region)
    }

    fn adjoint(&self, goals: &[Goal]) -> Result<Box<dyn Model + '_>, Error> {
        Ok(Box::new(adjoint::BackModel::new(self, goals)?))
    }

    fn derive(&self, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        match &self.colours {
            Some(colours) => self.of_channels(colours, goals, statistics),
            None => self.derived(goals, statistics),
        }
    }

    /// The surfaces between which light or heat goes, of a scene with one channel: of several all follows from u.
    fn exchange(&self) -> Option<&dyn RadiativeExchange> {
        self.colours.is_none().then_some(self)
    }

    /// Surfaces have two dimensions.
    fn smooth_order(&self, degree: usize) -> f64 {
        (degree + 1) as f64 / 2.0
    }
}
