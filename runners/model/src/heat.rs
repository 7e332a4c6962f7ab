//! Irradiances, net fluxes and temperatures: what light and heat between surfaces say besides u.

use fredholm_core::{Estimate, Statistics, Tolerance};
use fredholm_room::Material;
pub use fredholm_room::STEFAN_BOLTZMANN;

use crate::channels::Colours;
use crate::{Derived, Error, Flux, GlobalQuantity, Goal, Heat, Region, Subject};

/// The second radiation constant hc/k in µm K, exact since the SI of 2019 (CODATA 2018).
const SECOND_RADIATION: f64 = 14_387.768_775;

/// The part of the heat of a black body that has a shorter wavelength, from the wavelength λ in micrometres and the temperature T in
/// kelvin.
///
/// With x = hc/(kλT),
///
/// ```text
/// 15/π⁴ ∫_x^∞ t³/(eᵗ − 1) dt = 15/π⁴ Σ_n e^(−nx) (x³/n + 3x²/n² + 6x/n³ + 6/n⁴)
/// ```
///
/// (Chang and Rhee 1984).
///
/// ```
/// use fredholm_model::heat::part_below;
///
/// // λT = 2000 and 5000 µm K: the tables of Siegel and Howell, Thermal Radiation Heat Transfer, whose constants are older.
/// assert!((part_below(2.0, 1000.0) - 0.066_728).abs() < 3e-6);
/// assert!((part_below(5.0, 1000.0) - 0.633_747).abs() < 3e-5);
/// assert_eq!(part_below(5.0, 0.0), 0.0);
/// ```
#[must_use]
pub fn part_below(wavelength: f64, temperature: f64) -> f64 {
    let product = wavelength * temperature;
    if product <= 0.0 {
        return 0.0;
    }
    let x = SECOND_RADIATION / product;
    let term = |n: u32| {
        let n = f64::from(n);
        let factor = x * (x * (x / n + 3.0 / (n * n)) + 6.0 / (n * n * n)) + 6.0 / (n * n * n * n);
        libm::exp(-n * x) * factor
    };
    // A term behind the thirty thousandth is less than 10⁻¹⁷.
    let sum: f64 = (1..30_000).map(term).take_while(|&term| term > 1e-18).sum();
    15.0 / core::f64::consts::PI.powi(4) * sum
}

/// The derivative of [`part_below`] by the temperature, per kelvin: 15/π⁴ x³/(eˣ − 1) x/T, with the x there.
pub(crate) fn slope_below(wavelength: f64, temperature: f64) -> f64 {
    let x = SECOND_RADIATION / (wavelength * temperature);
    if !x.is_finite() {
        return 0.0;
    }
    // Where eˣ is infinite, this is 0.
    let density = x * x * x / libm::expm1(x);
    15.0 / core::f64::consts::PI.powi(4) * density * x / temperature
}

/// The material of what has u = H: where all that leaves arrives.
pub(crate) const ARRIVES: Material = Material::flux(0.0);

/// What differences of shares are off by.
const ROUNDING: f64 = 1e-12;

/// A wall or a face of a surface.
///
/// ```
/// use fredholm_model::heat::Element;
/// use fredholm_room::Material;
///
/// let heater = Element { surface: 3, part: 0, material: Material::flux(20.0), emissivity: Some(0.9), share: 1.0, absorptance: None, size: 1.5 };
/// assert_eq!(heater.flux(), 30.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// The number of its surface.
    pub surface: usize,
    /// The number of the part of the surface that has one material.
    pub part: usize,
    /// The material: of a mirror in part what it is over the share below.
    pub material: Material,
    /// The emissivity, if the net flux is given and it is known; of a mirror in part over the share below, too.
    pub emissivity: Option<f64>,
    /// 1 − ρ_s, the share of what arrives that is not reflected as by a mirror.
    pub share: f64,
    /// α, the part of sunlight that is absorbed, if that is told apart from heat.
    pub absorptance: Option<f64>,
    /// The length or the area.
    pub size: f64,
}

impl Element {
    /// How many times the irradiance by sunlight counts in a quantity besides what heat makes of it: α/ε − 1 in the σT⁴ of what has no
    /// temperature given, and ε − α in the net flux out of what has one. 0 where sunlight is not told apart.
    ///
    /// ```
    /// use fredholm_model::GlobalQuantity;
    /// use fredholm_model::heat::Element;
    /// use fredholm_room::Material;
    ///
    /// let plate = Element {
    ///     surface: 0, part: 0, material: Material::flux(0.0), emissivity: Some(0.8), share: 1.0, absorptance: Some(0.2), size: 1.0,
    /// };
    /// assert_eq!(plate.sunlight(GlobalQuantity::Temperature), 0.2 / 0.8 - 1.0);
    /// ```
    #[must_use]
    pub fn sunlight(&self, quantity: GlobalQuantity) -> f64 {
        let (Some(absorbed), reflectance) = (self.absorptance, self.material.reflectance) else {
            return 0.0;
        };
        let more = 1.0 - reflectance - absorbed;
        match quantity {
            GlobalQuantity::Temperature => absorbed / self.emissivity.unwrap_or(f64::NAN) - 1.0,
            // What absorbs as much of both is so but for rounding.
            GlobalQuantity::NetFlux if reflectance < 1.0 && more.abs() > ROUNDING => more,
            _ => 0.0,
        }
    }

    /// Whether what leaves it follows from sunlight besides all that arrives.
    #[must_use]
    pub fn knows_sunlight(&self) -> bool {
        self.sunlight(GlobalQuantity::NetFlux) != 0.0
    }

    /// The net flux out of all of it where that is given.
    #[must_use]
    pub fn flux(&self) -> f64 {
        self.size * self.share * self.material.emission
    }
}

/// What all of some things have in common.
fn common<T: PartialEq>(mut all: impl Iterator<Item = T>) -> Option<T> {
    let first = all.next()?;
    all.all(|other| other == first).then_some(first)
}

/// Whether sunlight is told apart on a region.
fn is_sunlit(surfaces: &(impl RadiativeExchange + ?Sized), region: &Region) -> bool {
    (surfaces.elements(region).iter()).any(|own| own.absorptance.is_some())
}

/// The share 1 − ρ_s that a region has in common, if it has one.
fn share_of(surfaces: &(impl RadiativeExchange + ?Sized), region: &Region) -> Option<f64> {
    common(surfaces.elements(region).iter().map(|own| own.share))
}

/// 1/ε − 1 of walls or faces from which the net flux is given, if ε is known and the same.
fn hidden_by_flux(all: &[Element]) -> Option<f64> {
    Some(1.0 / common(all.iter().map(|own| own.emissivity))?? - 1.0)
}

/// The temperature in kelvin of which σT⁴ is estimated, with the error bar of the delta method, ΔT = T Δx/4x; `None` where that is not
/// above 0.
///
/// T bends over x = σT⁴, so that the mean of T is too low by 3 ΔT²/2T: by a tenth of the error bar where that is a fifteenth of T.
///
/// ```
/// use fredholm_core::Estimate;
/// use fredholm_model::heat::{STEFAN_BOLTZMANN, temperature_of};
///
/// let x = STEFAN_BOLTZMANN * 300_f64.powi(4);
/// let found = temperature_of(Estimate { estimate: x, std_error: Some(0.01 * x), std_dev: None }).unwrap();
/// assert!((found.estimate - 300.0).abs() < 1e-9);
/// assert!((found.std_error.unwrap() - 0.75).abs() < 1e-9);
/// ```
#[must_use]
pub fn temperature_of(x: Estimate) -> Option<Estimate> {
    let mean = Some(x.estimate).filter(|&mean| mean > 0.0)?;
    let temperature = (mean / STEFAN_BOLTZMANN).powf(0.25);
    Some(x.derived(temperature, |error| 0.25 * temperature / mean * error))
}

/// The tolerance of walks for σT⁴ that leaves this standard error in kelvin.
#[must_use]
pub fn in_kelvin(bound: f64) -> Tolerance {
    // Roots have the same bits everywhere.
    Tolerance::FourthRoot(bound * STEFAN_BOLTZMANN.sqrt().sqrt())
}

/// The tolerance of the walks of goals of which this error is asked for: of temperatures it is in kelvin, and that of σT⁴ follows.
///
/// ```
/// use fredholm_core::Tolerance;
/// use fredholm_model::heat::tolerance_of;
/// use fredholm_model::{GlobalQuantity, Goal, Region};
///
/// let air = Region::Point(vec![1.0, 1.0]);
/// let [u, t] = [GlobalQuantity::U, GlobalQuantity::Temperature].map(|of| Goal::new("air", of.of(air.clone())));
/// let asked = Some(Tolerance::Absolute(0.1));
/// assert!(matches!(tolerance_of(asked, &[t.clone()]), Ok(Some(Tolerance::FourthRoot(_)))));
/// assert!(tolerance_of(asked, &[t, u]).is_err());
/// ```
///
/// # Errors
/// [`Error::Option`]: some goals ask for temperatures and others do not, or the error is relative.
pub fn tolerance_of(asked: Option<Tolerance>, goals: &[Goal]) -> Result<Option<Tolerance>, Error> {
    let is_temperature = |goal: &Goal| goal.region.asked().0 == GlobalQuantity::Temperature;
    let refuse = |message: &str| {
        Err(Error::Option {
            subject: Subject::Tolerance,
            message: message.to_owned(),
        })
    };
    match asked {
        Some(asked) if goals.iter().any(is_temperature) => match asked {
            Tolerance::Relative(_) => {
                refuse("the error of a temperature is one in kelvin: leave `relative` out")
            }
            _ if !goals.iter().all(is_temperature) => refuse(
                "some targets ask for a temperature, whose error is in kelvin, and others do not: let all ask for temperatures, give `walks` in its place, or solve twice",
            ),
            Tolerance::Absolute(bound) => Ok(Some(in_kelvin(bound))),
            own @ Tolerance::FourthRoot(_) => Ok(Some(own)),
        },
        asked => Ok(asked),
    }
}

/// How walks tell what a region asks for: a number times what they estimate, and another number.
///
/// ```
/// use fredholm_model::heat::Asked;
///
/// // u itself.
/// assert_eq!((Asked::U.factor, Asked::U.constant), (1.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// Whether walks are of the irradiance, and not of u.
    pub is_arriving: bool,
    /// What the estimate is multiplied by; 0 if nothing is left to walks.
    pub factor: f64,
    /// What is added, in the unit of u.
    pub constant: f64,
    /// How many times the irradiance by sunlight is added: see [`Element::sunlight`].
    pub sunlight: f64,
}

impl Asked {
    /// u itself.
    pub const U: Self = Self {
        is_arriving: false,
        factor: 1.0,
        constant: 0.0,
        sunlight: 0.0,
    };

    /// What is asked for, times a number.
    #[must_use]
    pub fn times(self, share: f64) -> Self {
        Self {
            factor: share * self.factor,
            constant: share * self.constant,
            ..self
        }
    }

    /// How walks tell a quantity where there is one material, or several (`None`). `through` is the material by which the irradiance follows
    /// from u, H = (u − F)/ρ, if it shall.
    ///
    /// ```
    /// use fredholm_model::GlobalQuantity;
    /// use fredholm_model::heat::Asked;
    /// use fredholm_room::Material;
    ///
    /// // Of a black wall u says nothing; what it loses is F − H.
    /// let black = Material { reflectance: 0.0, emission: 5.0 };
    /// let loss = Asked::new(GlobalQuantity::NetFlux, Some(black), None);
    /// assert_eq!(loss, Asked { is_arriving: true, factor: -1.0, constant: 5.0, ..Asked::U });
    /// ```
    #[must_use]
    pub fn new(
        quantity: GlobalQuantity,
        material: Option<Material>,
        through: Option<Material>,
    ) -> Self {
        match (quantity, through, material) {
            (GlobalQuantity::U | GlobalQuantity::Temperature, ..) => Self::U,
            (GlobalQuantity::Irradiance, Some(own), _) => Self {
                factor: 1.0 / own.reflectance,
                constant: -own.emission / own.reflectance,
                ..Self::U
            },
            (GlobalQuantity::NetFlux, Some(_), Some(own)) if own.reflectance > 0.0 => Self {
                factor: (own.reflectance - 1.0) / own.reflectance,
                constant: own.emission / own.reflectance,
                ..Self::U
            },
            (GlobalQuantity::NetFlux, _, Some(own)) => Self {
                is_arriving: true,
                factor: own.reflectance - 1.0,
                constant: own.emission,
                ..Self::U
            },
            _ => Self {
                is_arriving: true,
                ..Self::U
            },
        }
    }
}

/// What goes from surface to surface.
///
/// ```
/// use fredholm_model::heat::Carried;
///
/// assert!(Carried::Heat.is_heat());
/// assert_eq!(Carried::Gas { scale: 250.0, inlet: None }.flux_scale(), 250.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Carried {
    /// Light.
    Light,
    /// Heat: temperatures or net fluxes are given, and u is in W/m².
    Heat,
    /// Molecules.
    Gas {
        /// The net throughput that a surface of size 1 gives for a net flux of 1 in the unit of u.
        scale: f64,
        /// The surface by which all of them enter, if there is one.
        inlet: Option<usize>,
    },
}

impl Carried {
    /// Whether it is heat.
    #[must_use]
    pub const fn is_heat(self) -> bool {
        matches!(self, Self::Heat)
    }

    /// The net flux out of a surface of size 1 that is 1 in the unit of u, in the unit of net fluxes.
    #[must_use]
    pub const fn flux_scale(self) -> f64 {
        match self {
            Self::Gas { scale, .. } => scale,
            _ => 1.0,
        }
    }
}

/// Radiative exchange between surfaces: what of a kind tells its irradiances, net fluxes and temperatures. What follows from
/// that is provided.
pub trait RadiativeExchange {
    /// What goes from surface to surface.
    fn carried(&self) -> Carried;

    /// Whether all light that leaves surfaces arrives at surfaces.
    fn is_closed(&self) -> bool;

    /// Whether a region is a point between the surfaces, or what faces in a direction there.
    fn is_in_air(&self, region: &Region) -> bool;

    /// The walls or faces of a region.
    fn elements(&self, region: &Region) -> Vec<Element>;

    /// The names of all surfaces, if their net fluxes are results.
    fn flux_names(&self) -> &[String];

    /// The one material of a region, if it has one.
    fn material(&self, region: &Region) -> Option<Material> {
        common(self.elements(region).iter().map(|own| own.material))
    }

    /// The surfaces whose net fluxes are results: all of which something is there.
    fn flux_surfaces(&self) -> Vec<usize> {
        let all = 0..self.flux_names().len();
        all.filter(|&surface| !self.elements(&Region::Part(surface)).is_empty())
            .collect()
    }

    /// Whether the net flux is given from all of a surface.
    fn is_flux_given(&self, surface: usize) -> bool {
        let own = self.elements(&Region::Part(surface));
        own.iter().all(|own| own.material.reflectance >= 1.0)
    }

    /// The regions of the goals, then every surface whose net flux takes walks.
    fn regions(&self, goals: &[Goal], only_u: bool) -> Vec<Region> {
        let mut regions: Vec<Region> = goals.iter().map(|goal| goal.region.clone()).collect();
        if !only_u {
            let surfaces = self.flux_surfaces().into_iter();
            let walked = surfaces.filter(|&surface| !self.is_flux_given(surface));
            regions.extend(walked.map(Region::Part));
        }
        regions
    }

    /// Whether the irradiance of a region takes walks of its own. What is asked for itself follows from nothing else.
    fn takes_walks(&self, region: &Region, only_u: bool) -> bool {
        // In the air there is no surface on which light falls.
        let is_u = region.asked().0 == GlobalQuantity::U;
        is_u && !only_u && !self.is_in_air(region) && self.through_radiosity(region).is_none()
    }

    /// The number of functionals that a job has besides its goals.
    fn besides(&self, goals: &[Goal]) -> usize {
        let regions = self.regions(goals, false);
        let own = regions
            .iter()
            .filter(|region| self.takes_walks(region, false));
        regions.len() - goals.len() + own.count()
    }

    /// How the irradiance of a region follows from u there, if it does: H = (u − F)/ρ.
    fn through_radiosity(&self, region: &Region) -> Option<Material> {
        match region {
            // All light that leaves surfaces of a closed room arrives at surfaces.
            Region::Whole if self.is_closed() => Some(ARRIVES),
            // It is asked for itself.
            Region::Facing { .. } => Some(ARRIVES),
            region if self.elements(region).iter().any(Element::knows_sunlight) => None,
            region => self
                .material(region)
                .filter(|material| material.reflectance > 0.0),
        }
    }

    /// Irradiances and net fluxes from the statistics of all walks: those of the regions, then those of irradiances that
    /// take walks of their own.
    fn derived(&self, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        let regions = self.regions(goals, false);
        if statistics.len() < regions.len() {
            // Nothing but u was asked for.
            return Derived::default();
        }
        let (radiosities, own) = statistics.split_at(regions.len());
        let mut own = own.iter();
        let (mut heat, mut walked_fluxes) = (Vec::new(), Vec::new());
        for (i, (region, u)) in regions.iter().zip(radiosities).enumerate() {
            // What is asked for itself tells everything.
            let is_asked = region.asked().0 != GlobalQuantity::U;
            let through = self.through_radiosity(region).filter(|_| !is_asked);
            let walked = match through {
                Some(_) => Some(u),
                None if is_asked || self.is_in_air(region) => None,
                None => own.next(),
            };
            let estimate = walked.map(Statistics::preconditioned);
            let irradiance = match through {
                Some(through) => estimate.map(|u| through.irradiance_of(u)),
                None => estimate,
            };
            if i < goals.len() {
                heat.push(self.heat_of(region, u.preconditioned(), irradiance));
            } else {
                walked_fluxes.push((walked.map_or(0, Statistics::walks), irradiance));
            }
        }
        let mut walked_fluxes = walked_fluxes.into_iter();
        let fluxes = self.flux_surfaces().into_iter().map(|surface| {
            let region = Region::Part(surface);
            let (own, is_given) = (self.elements(&region), self.is_flux_given(surface));
            let (walks, irradiance) = match is_given {
                true => (0, None),
                false => walked_fluxes.next().unwrap_or((0, None)),
            };
            let name = self.flux_names().get(surface);
            Flux {
                name: name.cloned().unwrap_or_default(),
                walks,
                net_flux: if is_given {
                    Some(Estimate {
                        estimate: self.carried().flux_scale()
                            * own.iter().map(Element::flux).sum::<f64>(),
                        std_error: Some(0.0),
                        std_dev: Some(0.0),
                    })
                } else {
                    // The flux of its length or area.
                    let size: f64 = own.iter().map(|own| own.size).sum();
                    self.net_flux(&region, irradiance, self.carried().flux_scale() * size)
                },
                is_given,
            }
        });
        let fluxes = fluxes.collect();
        Derived { heat, fluxes }
    }

    /// Irradiances, and net fluxes of bands of heat, from the statistics of u in several channels.
    fn derived_in(&self, colours: &Colours, goals: &[Goal], statistics: &[Statistics]) -> Derived {
        let materials = |region: &Region| match region {
            Region::Facing { .. } | Region::Irradiance(_) => {
                Some(vec![ARRIVES; colours.names.channels()])
            }
            Region::Whole if self.is_closed() => Some(vec![ARRIVES; colours.names.channels()]),
            region => {
                let own = self.elements(region).into_iter();
                let parts = own.map(|own| colours.of_part(own.surface, own.part));
                Some(common(parts)??.to_vec())
            }
        };
        colours.names.derived(goals, statistics, &materials)
    }

    /// What follows from u of a region, or from what else is asked for there, and from its irradiance, which follows from u where it is not
    /// given.
    fn heat_of(&self, region: &Region, u: Estimate, irradiance: Option<Estimate>) -> Heat {
        let (quantity, place) = region.asked();
        if quantity != GlobalQuantity::U {
            return heat_of_asked(self, quantity, place, u);
        }
        let is_warm = |_: &Estimate| self.carried().is_heat();
        let in_air = self.is_in_air(region).then(|| temperature_of(u));
        let through = || Some(self.through_radiosity(region)?.irradiance_of(u));
        let irradiance = irradiance.or_else(through);
        if is_sunlit(self, region) {
            // Net fluxes and temperatures depend on how much of it is sunlight.
            return Heat {
                irradiance,
                ..Heat::default()
            };
        }
        Heat {
            irradiance,
            net_flux: self.net_flux(region, irradiance.filter(|_| self.carried().is_heat()), 1.0),
            is_flux_given: self.carried().is_heat() && self.is_reflecting(region),
            temperature: self.surface_temperature(region, u),
            hidden_by_flux: hidden_by_flux(&self.elements(region)),
            radiant_temperature: in_air.flatten().filter(is_warm),
        }
    }

    /// Whether a region reflects all: whether its net flux is given.
    fn is_reflecting(&self, region: &Region) -> bool {
        let material = self.material(region);
        material.is_some_and(|material| material.reflectance >= 1.0)
    }

    /// The temperature in kelvin of surfaces from which the net flux q is given: εσT⁴ = u − (1 − ε)H = εu + (1 − ε)q.
    fn surface_temperature(&self, region: &Region, u: Estimate) -> Option<Estimate> {
        let estimate = u.estimate + self.hidden(region)?;
        temperature_of(Estimate { estimate, ..u }).filter(|_| self.carried().is_heat())
    }

    /// By how much the σT⁴ of surfaces from which the net flux q is given is above u, q (1 − ε)/ε; `None` if their temperature does not follow
    /// from u.
    fn hidden(&self, region: &Region) -> Option<f64> {
        let q = self.material(region)?.emission;
        match (self.is_reflecting(region), q == 0.0) {
            (false, _) => None,
            (true, true) => Some(0.0),
            (true, false) => Some(q * hidden_by_flux(&self.elements(region))?),
        }
    }

    /// The net flux out of this length or area of a region.
    fn net_flux(
        &self,
        region: &Region,
        irradiance: Option<Estimate>,
        size: f64,
    ) -> Option<Estimate> {
        let own = self.material(region)?.net_flux_of(irradiance?);
        let size = size * share_of(self, region)?;
        Some(own.derived(size * own.estimate, |x| size * x))
    }
}

/// How walks tell what a region asks for. Irradiances follow from u where that tells them, as its walks vary less: H = (u − F)/ρ; but
/// not if `is_alone`, for derivatives, since ρ and F change.
#[must_use]
pub fn asked(surfaces: &dyn RadiativeExchange, region: &Region, is_alone: bool) -> Asked {
    let (quantity, place) = region.asked();
    if quantity == GlobalQuantity::Temperature {
        return Asked {
            constant: surfaces.hidden(place).unwrap_or(0.0),
            sunlight: sunlight_in(surfaces, quantity, place),
            ..Asked::U
        };
    }
    // What a light meter sees is its irradiance.
    let is_meter = matches!(place, Region::Facing { .. });
    let through = surfaces.through_radiosity(place);
    let through = through.filter(|_| is_meter || !is_alone);
    let asked = Asked::new(quantity, surfaces.material(place), through);
    match quantity {
        GlobalQuantity::NetFlux => Asked {
            sunlight: sunlight_in(surfaces, quantity, place),
            ..asked.times(share_of(surfaces, place).unwrap_or(f64::NAN))
        },
        GlobalQuantity::Transmission => {
            let [given, _] = inlet(surfaces).unwrap_or_default();
            let size: f64 = surfaces.elements(place).iter().map(|own| own.size).sum();
            Asked {
                factor: size / given,
                ..asked
            }
        }
        _ => asked,
    }
}

/// How many times the irradiance by sunlight counts in a quantity of a region.
fn sunlight_in(surfaces: &dyn RadiativeExchange, quantity: GlobalQuantity, place: &Region) -> f64 {
    let elements = surfaces.elements(place);
    elements.first().map_or(0.0, |own| own.sunlight(quantity))
}

/// What enters by the inlet of a vacuum, a size times the unit of u, and the size of the inlet.
fn inlet(surfaces: &(impl RadiativeExchange + ?Sized)) -> Option<[f64; 2]> {
    let Carried::Gas {
        inlet: Some(inlet), ..
    } = surfaces.carried()
    else {
        return None;
    };
    let own = surfaces.elements(&Region::Part(inlet));
    let given = own.iter().map(Element::flux).sum();
    let size = own.iter().map(|own| own.size).sum();
    Some([given, size])
}

/// Refuses an irradiance where no light falls, and a net flux where there are no temperatures, or several materials.
///
/// # Errors
/// [`Error::Region`].
pub fn check_asked(
    surfaces: &dyn RadiativeExchange,
    region: &Region,
    has_channels: bool,
) -> Result<(), Error> {
    let (quantity, place) = region.asked();
    let is_flux = quantity == GlobalQuantity::NetFlux;
    let is_transmission = quantity == GlobalQuantity::Transmission;
    let is_black = |own: Material| own.reflectance == 0.0;
    let is_mirror = || surfaces.elements(place).iter().any(|own| own.share != 1.0);
    let message = match quantity {
        GlobalQuantity::U if is_mirror() => {
            "what leaves a mirror depends on the direction: `ask = \"irradiance\"`, or of heat \"net_flux\" or \"temperature\""
        }
        GlobalQuantity::U => return Ok(()),
        _ if place.asked().0 != GlobalQuantity::U => "one quantity is asked for at a time",
        GlobalQuantity::Temperature => match no_temperature(surfaces, place, has_channels) {
            Some(message) => message,
            None => return Ok(()),
        },
        _ if is_transmission && inlet(surfaces).is_none_or(|[given, _]| !(given > 0.0)) => {
            "a transmission is of molecules which enter a vacuum by a surface: `kind = \"vacuum\"`, and `from = …`"
        }
        _ if is_transmission && !surfaces.material(place).is_some_and(is_black) => {
            "a transmission is to surfaces at which every molecule stays"
        }
        GlobalQuantity::Irradiance if matches!(place, Region::Facing { .. }) => return Ok(()),
        _ if surfaces.is_in_air(place) => {
            "no light falls on a point between the surfaces, and nothing leaves it: give a point of a surface, \
             or in a scene what faces in a direction, `at = { point = …, facing = … }`"
        }
        _ if is_flux && has_channels => {
            "net fluxes of bands follow from u of every band: leave `ask` out"
        }
        _ if is_flux && !surfaces.carried().is_heat() => {
            "a net flux is one of heat, and this is light: `ask = \"irradiance\"`"
        }
        _ if is_flux && has_several(surfaces, place) => {
            "these surfaces have several materials: ask for the net flux out of each"
        }
        _ => return Ok(()),
    };
    Err(Error::Region {
        message: message.to_owned(),
    })
}

/// Whether a place has several materials.
fn has_several(surfaces: &dyn RadiativeExchange, place: &Region) -> bool {
    let elements = surfaces.elements(place);
    let materials = (elements.iter()).map(|own| (own.material, own.share, own.absorptance));
    common(materials).is_none()
}

/// Why a place has no temperature that walks tell, if it has none.
fn no_temperature(
    surfaces: &dyn RadiativeExchange,
    place: &Region,
    has_channels: bool,
) -> Option<&'static str> {
    let elements = surfaces.elements(place);
    if has_channels {
        Some("temperatures follow from u of all bands: leave `ask` out")
    } else if !surfaces.carried().is_heat() {
        Some(
            "a temperature is one of heat: give surfaces an `emissivity` and a `temperature`, or leave `ask` out",
        )
    } else if surfaces.is_in_air(place) {
        None
    } else if elements.iter().any(|own| own.material.reflectance < 1.0) {
        Some(
            "the temperature is given there: ask for that of surfaces from which the `net_flux` is given, or of a point between surfaces",
        )
    } else if has_several(surfaces, place) {
        Some("these surfaces have several materials: ask for the temperature of each")
    } else if is_sunlit(surfaces, place) && elements.iter().any(|own| own.emissivity.is_none()) {
        Some("the temperature follows from the `absorptance` and the `emissivity`: give both")
    } else if surfaces.hidden(place).is_none() {
        Some(
            "the temperature follows from the `net_flux` and the `emissivity`: give that, the same all over",
        )
    } else {
        None
    }
}

/// What follows from another quantity of a region than u.
fn heat_of_asked(
    surfaces: &(impl RadiativeExchange + ?Sized),
    quantity: GlobalQuantity,
    place: &Region,
    found: Estimate,
) -> Heat {
    if is_sunlit(surfaces, place) {
        let none = Heat::default();
        return match quantity {
            GlobalQuantity::Temperature => Heat {
                temperature: temperature_of(found),
                ..none
            },
            GlobalQuantity::NetFlux => Heat {
                net_flux: Some(found),
                is_flux_given: surfaces.is_reflecting(place),
                ..none
            },
            _ => Heat {
                irradiance: Some(found),
                ..none
            },
        };
    }
    let material = surfaces.material(place);
    let irradiance = match (quantity, material) {
        (GlobalQuantity::Temperature, _) => {
            let u = found.estimate - surfaces.hidden(place).unwrap_or(0.0);
            return surfaces.heat_of(
                place,
                Estimate {
                    estimate: u,
                    ..found
                },
                None,
            );
        }
        (GlobalQuantity::Transmission, _) => {
            // That of the inlet's opening, times this.
            let [_, size] = inlet(surfaces).unwrap_or_default();
            let opening = size * surfaces.carried().flux_scale();
            let conductance = found.derived(opening * found.estimate, |error| opening * error);
            return Heat {
                net_flux: Some(conductance),
                ..Heat::default()
            };
        }
        (GlobalQuantity::NetFlux, Some(own)) if own.reflectance < 1.0 => {
            let (absorbed, share) = (1.0 - own.reflectance, share_of(surfaces, place));
            let share = share.unwrap_or(f64::NAN);
            let arriving = (own.emission - found.estimate / share) / absorbed;
            found.derived(arriving, |error| error / (share * absorbed))
        }
        (GlobalQuantity::NetFlux, _) => {
            return Heat {
                net_flux: Some(found),
                is_flux_given: surfaces.is_reflecting(place),
                ..Heat::default()
            };
        }
        _ => found,
    };
    // u = F + ρH where there is one material; what else is asked for looks at no u.
    let u = match material {
        Some(own) if !surfaces.is_in_air(place) => {
            let u = own.emission + own.reflectance * irradiance.estimate;
            irradiance.derived(u, |error| own.reflectance * error)
        }
        _ => irradiance,
    };
    surfaces.heat_of(place, u, Some(irradiance))
}

/// Which goals are certain: u = F where nothing is reflected, a net flux that is given, and u = 0 in a channel in which no surface emits.
///
/// `colours` are `None` in one channel, and where lamps, the sun or a sky shine in all of them.
#[must_use]
pub fn certain(
    surfaces: &dyn RadiativeExchange,
    colours: Option<&Colours>,
    goals: &[Goal],
) -> Vec<bool> {
    let is_certain = |goal: &Goal| {
        let (quantity, place) = goal.region.asked();
        let material = surfaces.material(place);
        let knows_sunlight = |place| surfaces.elements(place).iter().any(Element::knows_sunlight);
        let is_known = |own: Material| match quantity {
            GlobalQuantity::U => own.reflectance == 0.0 && !knows_sunlight(place),
            GlobalQuantity::Irradiance
            | GlobalQuantity::Temperature
            | GlobalQuantity::Transmission => false,
            GlobalQuantity::NetFlux => own.reflectance >= 1.0,
        };
        let is_dark = |colours: &Colours| goal.channel.is_some_and(|own| colours.is_dark(own));
        material.is_some_and(is_known) || colours.is_some_and(is_dark)
    };
    goals.iter().map(is_certain).collect()
}

/// Refuses goals that ask for something other than u, of which variances are predicted.
///
/// # Errors
/// [`Error::Region`].
pub fn only_radiosities(goals: &[Goal]) -> Result<(), Error> {
    let is_u = |goal: &Goal| goal.region.asked().0 == GlobalQuantity::U;
    match goals.iter().all(is_u) {
        true => Ok(()),
        false => Err(Error::Region {
            message: "variances are predicted of walks for u: leave `ask` out".to_owned(),
        }),
    }
}
