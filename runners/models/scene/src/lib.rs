#![doc = include_str!("../README.md")]

mod adjoint;
mod camera;
mod examine;
mod export;
mod faces;
mod global;
mod heat;
mod notes;
mod partition;
mod places;
mod radius;
mod system;
mod times;
mod view;
mod walks;

use fredholm_core::Statistics;
use fredholm_model::heat::{RadiativeExchange, check_asked};
use fredholm_model::{
    About, Derived, Discretisation, Error, Goal, LastSteps, Model, Pairs, Partitioned, Quantity,
    Region, Scalar, Subject, SurfaceQuantities, WholeValues, in_scalar,
};
use fredholm_scene::{ColourTables, Surface};

use adjoint::Adjoint;
pub use camera::Camera;
pub use faces::{FaceValues, FacesRequest};
pub use fredholm_model::Beside;
use fredholm_model::channels::ColouredPart;
pub use fredholm_model::channels::Colours;
pub use fredholm_scene::{Beam, Enclosure, Material, Polygon, Scene, SkyLight, shapes};
pub use notes::notes;
use partition::ScenePartition;
use places::Place;
pub use times::{AtTimes, GoalAtTimes, SunAndSky, TimesRequest};
pub use view::{View, ViewRequest};

/// An expression in which the number of functions per cell of a degree is a constant of this name.
macro_rules! of_degree {
    ($degree:expr, $name:ident => $then:expr) => {
        match $degree {
            0 => {
                const $name: usize = 1;
                $then
            }
            1 => {
                const $name: usize = 3;
                $then
            }
            // The model lets nothing above 2 pass.
            _ => {
                const $name: usize = 6;
                $then
            }
        }
    };
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
/// use fredholm::{Scalar, SceneModel, Solver};
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
/// let solver = Solver::new(&cube).mean().cells(24).degree(1);
/// let report = solver.walks(20_000).solve()?;
/// let mean = &report.goals[0].preconditioned;
/// assert!((mean.estimate.unwrap() - 1.0 / 3.0).abs() < 5.0 * mean.std_error.unwrap());
/// assert!(mean.std_error < report.goals[0].plain.std_error);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneModel {
    names: Vec<String>,
    scene: Scene,
    light: Light,
    /// The receivers of the model of the way back.
    adjoint: Option<Adjoint>,
}

/// What u is.
#[derive(Clone, Debug)]
enum Light {
    /// Without a unit.
    Grey,
    /// In lumens per square metre.
    Photometric,
    Heat(Temperatures),
    Colours(Colours),
    /// In millibar.
    Gas(Vacuum),
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

/// A gas so thin that its molecules meet surfaces and not each other, and leave them evenly and diffusely, as light does.
///
/// A molecule stays where it arrives with the probability s, the sticking factor, and leaves again with ρ = 1 − s. Of the throughput q per area
/// in mbar l/(s m²) and the mean speed v = √(8RT/(πM)) of the molecules one has the pressure 4q/(1000 v) in mbar, whose equation is that of
/// light: u = F + ρ H, where F is the outgassing and H the pressure.
///
/// ```
/// use fredholm::scene::{Enclosure, Material, NamedSurface, Vacuum, shapes};
/// use fredholm::{Scalar, SceneModel, Solver};
///
/// // Nitrogen at 20 °C: a square metre that takes every molecule pumps 117,700 litres a second.
/// let gas = Vacuum::new(28.014, 293.15);
/// assert!((gas.speed_of(1.0) / 117_700.0 - 1.0).abs() < 1e-3);
///
/// // Walls that take a tenth of what arrives, and give 6 mbar l/s in all: 10 q/(v/4) everywhere.
/// let material = Material { reflectance: 0.9, emission: 6.0 / gas.speed_of(6.0) };
/// let polygons = shapes::room([0.0; 3], [1.0; 3]).surfaces.into_iter().flatten().collect();
/// let walls = NamedSurface { name: "walls".to_owned(), polygons, material };
/// let box_of_gas = SceneModel::new(vec![walls], Enclosure::Closed, Scalar::F64)?.with_vacuum(gas)?;
/// let report = Solver::new(&box_of_gas).mean().cells(6).degree(0).walks(1000).solve()?;
/// let pressure = report.goals[0].irradiance.as_ref().unwrap();
/// assert!((pressure.estimate.unwrap() / (10.0 * material.emission) - 1.0).abs() < 1e-6);
/// assert_eq!(pressure.unit, Some("mbar"));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vacuum {
    /// The mean speed of the molecules in m/s.
    pub mean_speed: f64,
    /// Whether the net throughputs of all surfaces are wanted.
    pub throughputs: bool,
    /// The number of the surface by which all molecules enter, of [transmissions](fredholm_model::GlobalQuantity::Transmission).
    pub inlet: Option<usize>,
}

impl Vacuum {
    /// A gas of this molar mass M in g/mol, at this temperature T in kelvin.
    #[must_use]
    pub fn new(molar_mass: f64, temperature: f64) -> Self {
        // The molar gas constant in J/(mol K), exact since the SI of 2019.
        const GAS: f64 = 8.314_462_618_153_24;
        let square = 8.0 * GAS * temperature / (core::f64::consts::PI * 1e-3 * molar_mass);
        Self {
            mean_speed: square.sqrt(),
            throughputs: true,
            inlet: None,
        }
    }

    /// What an area in m² that takes every molecule pumps, A v/4, in l/s: the conductance of an opening, too.
    #[must_use]
    pub fn speed_of(&self, area: f64) -> f64 {
        250.0 * self.mean_speed * area
    }
}

impl SceneModel {
    /// What walks tell derivatives by; besides surfaces the sky comes first, and then all beams.
    pub(crate) fn surface_quantities(&self) -> SurfaceQuantities {
        let sky = self.scene.sky().map(|_| "sky".to_owned());
        let beams = (1..=self.scene.beams().len()).map(|number| format!("light {number}"));
        let lights = sky.into_iter().chain(beams).collect();
        SurfaceQuantities::new(
            self,
            &|surface| self.part(surface),
            (self.colours(), lights),
        )
    }

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
            light: Light::Grey,
            adjoint: None,
        }
    }

    /// The scene in which sunlight is told apart from heat, with the part of it that each surface absorbs: see [`Scene::with_absorptances`].
    ///
    /// # Errors
    /// [`Error::Space`].
    pub fn with_absorptances(self, absorptances: &[f64], of_sky: bool) -> Result<Self, Error> {
        let scene = self.scene.with_absorptances(absorptances, of_sky)?;
        Ok(Self { scene, ..self })
    }

    /// The scene that repeats without end along the axes whose period is above 0: see [`Scene::with_period`].
    ///
    /// # Errors
    /// [`Error::Space`].
    pub fn with_period(self, lengths: [f64; 3]) -> Result<Self, Error> {
        let scene = self.scene.with_period(lengths)?;
        Ok(Self { scene, ..self })
    }

    /// The scene as one of heat: u is in W/m², no longer in photometric units, and results are net fluxes and temperatures, too.
    #[must_use]
    pub fn with_heat(self, of_heat: Temperatures) -> Self {
        let light = Light::Heat(of_heat);
        Self { light, ..self }
    }

    /// The scene in several channels, in each of which its surfaces have materials of their own: those of the scene are then
    /// [the largest](Colours::largest) of them.
    ///
    /// # Errors
    /// [`Error::Option`]: the scene has other surfaces or materials than these; it is one of temperatures or in photometric units; or
    /// the channels are none, or more than a walk serves.
    pub fn with_colours(self, colours: Colours) -> Result<Self, Error> {
        let colours = less_mirrors(colours, &self.scene)?;
        let faces = self.scene.faces().iter().enumerate();
        let parts = faces.filter_map(|(face, own)| {
            Some(ColouredPart {
                surface: self.scene.place(face)?.surface,
                part: 0,
                largest: own.material(),
            })
        });
        colours.check(&self.names, parts)?;
        if self.heat().is_some() {
            return fredholm_model::channels::refuse_heat();
        }
        self.with_light(Light::Colours(colours))
    }

    /// The scene with emissions in lumens per square metre: u has this unit, too, and irradiances are illuminances in lux.
    ///
    /// ```
    /// use fredholm::channels::ChannelNames;
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
    /// let names = ChannelNames::new(vec!["a".to_owned(), "b".to_owned()]);
    /// let two = Colours { names, materials: vec![vec![vec![material; 2]]] };
    /// assert!(cube.with_colours(two).is_err());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Option`]: it is one of temperatures, or has several channels.
    pub fn with_photometry(self) -> Result<Self, Error> {
        self.with_light(Light::Photometric)
    }

    /// The scene as one of molecules that meet surfaces and no other molecules: u and irradiances are in millibar, and results are the net
    /// throughputs of all surfaces in mbar l/s, too.
    ///
    /// # Errors
    /// [`Error::Option`]: it is one of temperatures, in photometric units, or has several channels.
    pub fn with_vacuum(self, vacuum: Vacuum) -> Result<Self, Error> {
        self.with_light(Light::Gas(vacuum))
    }

    /// The scene whose surfaces reflect a part of what arrives as mirrors do, besides what they reflect diffusely, with the specular
    /// reflectance ρ_s of each: see [`Scene::with_specular`]. What leaves these depends on the direction, and results are what arrives there, net
    /// fluxes and temperatures.
    ///
    /// # Errors
    /// [`Error::Space`]: a reflectance is none, or there is light that mirrors may show and walks do not find; [`Error::Option`]: the scene has
    /// bands of heat.
    ///
    /// ```
    /// use fredholm::scene::{Enclosure, Material, NamedSurface, shapes};
    /// use fredholm::{GlobalQuantity, Region, Scalar, SceneModel, Solver};
    ///
    /// // Walls that emit 1, absorb a half and mirror a third: 2 arrives everywhere.
    /// let material = Material { reflectance: 1.0 / 6.0, emission: 1.0 };
    /// let polygons = shapes::room([0.0; 3], [1.0; 3]).surfaces.into_iter().flatten().collect();
    /// let walls = NamedSurface { name: "walls".to_owned(), polygons, material };
    /// let cube = SceneModel::new(vec![walls], Enclosure::Closed, Scalar::F64)?.with_specular(&[1.0 / 3.0])?;
    /// let arriving = GlobalQuantity::Irradiance.of(Region::Part(0));
    /// let report = Solver::new(&cube).goal("walls", arriving).cells(6).degree(0).walks(1000).solve()?;
    /// let found = report.goals[0].irradiance.as_ref().unwrap();
    /// assert!((found.estimate.unwrap() - 2.0).abs() < 5.0 * found.std_error.unwrap() + 1e-9);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn with_specular(self, specular: &[f64]) -> Result<Self, Error> {
        let scene = self.scene.with_specular(specular)?;
        let mut own = Self { scene, ..self };
        if let Light::Colours(colours) = own.light {
            own.light = Light::Colours(less_mirrors(colours, &own.scene)?);
        }
        Ok(own)
    }

    fn with_light(self, light: Light) -> Result<Self, Error> {
        match self.light {
            Light::Grey => Ok(Self { light, ..self }),
            _ => Err(Error::Option {
                subject: Subject::Problem,
                message: "photometric units and gases are of one channel: leave them out, or temperatures and channels"
                    .to_owned(),
            }),
        }
    }

    /// Whether the scene has the place of a region.
    ///
    /// # Errors
    /// [`Error::Region`]: it has none.
    pub fn check_place(&self, region: &Region) -> Result<(), Error> {
        Place::new(&self.scene, region).map(|_| ())
    }

    fn heat(&self) -> Option<&Temperatures> {
        match &self.light {
            Light::Heat(heat) => Some(heat),
            _ => None,
        }
    }

    /// The materials of its channels, if it has several.
    #[must_use]
    pub const fn colours(&self) -> Option<&Colours> {
        match &self.light {
            Light::Colours(colours) => Some(colours),
            _ => None,
        }
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

    /// The scene that walks go through: of the way back that in which receivers send out light.
    fn walked(&self) -> &Scene {
        self.adjoint
            .as_ref()
            .map_or(&self.scene, |adjoint| &adjoint.scene)
    }

    /// Whether faces see no surface; where nothing else shines they receive nothing.
    fn is_dark(&self, faces: &[u32]) -> bool {
        let mut all = faces.iter();
        !faces.is_empty() && all.all(|&face| self.scene.sees_nothing(face as usize))
    }

    /// The channels of walks, if they have several.
    fn face_channels(&self) -> Option<ColourTables<f64>> {
        let own = || {
            let faces = 0..self.scene.faces().len();
            let places = faces.filter_map(|face| self.scene.place(face));
            let colours = self.colours()?;
            Some(colours.tables(places.map(|place| (place.surface, 0))))
        };
        self.adjoint
            .as_ref()
            .map_or_else(own, |adjoint| Some(adjoint.channels.clone()))
    }

    /// The weights of a sum of all channels, which is asked for beside them; none: of one channel, and of receivers.
    fn weights(&self) -> &[f64] {
        self.colours()
            .map_or(&[], |colours| colours.names.weights())
    }
}

/// The materials of every channel over the share of what arrives that mirrors leave.
fn less_mirrors(mut colours: Colours, scene: &Scene) -> Result<Colours, Error> {
    if !scene.has_mirrors() {
        return Ok(colours);
    }
    if colours.names.bands().is_some() {
        return Err(Error::Option {
            subject: Subject::Problem,
            message: "mirrors are of light, or of heat in one band: leave `specular` out, or `wavelengths`"
                .to_owned(),
        });
    }
    for (surface, materials) in colours.materials.iter_mut().enumerate() {
        let face = scene.faces_of(surface).map_or(0, |faces| faces.start);
        let share = 1.0 - scene.specular(face);
        for material in materials.iter_mut().flatten() {
            material.reflectance = f64::min(material.reflectance / share, 1.0);
            material.emission /= share;
        }
    }
    Ok(colours)
}

impl Model for SceneModel {
    fn about(&self) -> About {
        let unit = match &self.light {
            Light::Grey => None,
            Light::Photometric => Some("lm/m2"),
            Light::Heat(_) => Some("W/m2"),
            Light::Colours(colours) => colours.names.unit(),
            Light::Gas(_) => Some("mbar"),
        };
        About {
            most_degree: MOST_DEGREE,
            takes_any_cells: true,
            whole: match (self.colours(), &self.adjoint) {
                (None, None) => WholeValues::Means,
                _ => WholeValues::None,
            },
            unit,
            irradiance_unit: match self.light {
                Light::Photometric => Some("lx"),
                _ => unit,
            },
            flux_unit: match self.light {
                Light::Gas(_) => "mbar l/s",
                _ => "W",
            },
            has_adjoint: true,
            is_adjoint: self.adjoint.is_some(),
            last_steps: LastSteps::Always,
            // h = k on all of them.
            pairs_to_choose: &[Pairs::Default],
            ..About::of_kind("scene")
        }
    }

    fn notes(&self) -> Vec<String> {
        notes(&self.names, &self.scene)
    }

    fn part(&self, number: usize) -> Option<&str> {
        self.names.get(number).map(String::as_str)
    }

    fn channels(&self) -> &[String] {
        self.colours().map_or(&[], |colours| colours.names.shared())
    }

    /// The channels; of the way back as many as there are receivers.
    fn shared(&self) -> usize {
        let receivers = self.adjoint.as_ref().map(|adjoint| adjoint.known.len());
        receivers.unwrap_or_else(|| self.channels().len().max(1))
    }

    fn adjoint(&self, goals: &[Goal]) -> Result<Box<dyn Model + '_>, Error> {
        Ok(Box::new(Self {
            adjoint: Some(Adjoint::new(self, goals)?),
            ..self.clone()
        }))
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        let check = |goal: &Goal| {
            check_asked(self, &goal.region, self.colours().is_some())?;
            if let Region::Part(part) = goal.region.place()
                && self
                    .scene
                    .faces_of(*part)
                    .is_ok_and(|faces| faces.is_empty())
            {
                let message = notes::without_faces(self.part(*part).unwrap_or("?"));
                return Err(Error::Region { message });
            }
            self.check_place(&goal.region)
        };
        goals.iter().try_for_each(check)
    }

    /// There is no line through a scene that anybody would mean.
    fn grid(&self, _: usize, _: Option<usize>) -> Vec<Region> {
        Vec::new()
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        let refuse = |subject, message: String| Err(Error::Option { subject, message });
        if discretisation.degree > MOST_DEGREE {
            let message = format!("in a scene functions on a cell have degree 0 to {MOST_DEGREE}");
            return refuse(Subject::Degree, message);
        }
        if matches!(pairs, Pairs::Paper | Pairs::Rays) {
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

    fn derive(&self, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        match self.colours() {
            Some(colours) => self.derived_in(colours, goals, statistics),
            None => self.derived(goals, statistics),
        }
    }

    /// The surfaces between which light or heat goes, of a scene with one channel: of several all follows from u.
    fn quantities(&self) -> Vec<Quantity> {
        match self.scene.has_sunlight() {
            true => Vec::new(),
            false => self.surface_quantities().quantities,
        }
    }

    fn exchange(&self) -> Option<&dyn RadiativeExchange> {
        self.colours().is_none().then_some(self)
    }

    /// Surfaces have two dimensions.
    fn smooth_order(&self, degree: usize) -> f64 {
        (degree + 1) as f64 / 2.0
    }
}
