//! What equations in several channels have in common: names, weighted sums, targets, and what is refused.

use fredholm_core::{Estimate, MOST_CHANNELS, Statistics, Value};
use fredholm_room::Material;

use crate::Wanted;
pub use crate::bands::Bands;
pub use crate::channel_models::ChannelModels;
pub use crate::colours::{ColouredPart, Colours};
use crate::heat::{ARRIVES, RadiativeExchange};
use crate::{BLANK, Derived, Error, Goal, Heat, Model, Region, Request, Spot, Subject};

/// The weights of red, green and blue in luminance (ITU-R BT.709, the primaries of sRGB).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// The names of channels, such as colours or bands of wavelengths, and the weights of a sum of them.
///
/// Red, green and blue have their luminance as a weighted sum, 0.2126 R + 0.7152 G + 0.0722 B; other channels have their sum.
///
/// ```
/// use fredholm_model::channels::ChannelNames;
///
/// let bands = ChannelNames::new(["near", "far"].map(str::to_owned).to_vec());
/// assert_eq!(bands.shared(), ["near", "far", "sum"]);
/// assert_eq!(bands.with_sum([1.0, 3.0]), [1.0, 3.0, 4.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelNames {
    /// The names of the channels, and that of the sum.
    names: Vec<String>,
    weights: Vec<f64>,
    bands: Option<Bands>,
}

impl ChannelNames {
    /// Channels of these names.
    #[must_use]
    pub fn new(channels: Vec<String>) -> Self {
        let is_rgb = is_rgb(&channels);
        let weights = match is_rgb {
            true => LUMINANCE.to_vec(),
            false => vec![1.0; channels.len()],
        };
        let sum = if is_rgb { "luminance" } else { "sum" };
        let mut names = channels;
        names.push(sum.to_owned());
        Self {
            names,
            weights,
            bands: None,
        }
    }

    /// Bands of heat: u is in W/m².
    #[must_use]
    pub fn of_heat(bands: Bands) -> Self {
        Self {
            bands: Some(bands.clone()),
            ..Self::new(bands.names())
        }
    }

    /// The bands of heat, if the channels are such.
    #[must_use]
    pub const fn bands(&self) -> Option<&Bands> {
        self.bands.as_ref()
    }

    /// The unit of u, if there is one.
    #[must_use]
    pub const fn unit(&self) -> Option<&'static str> {
        match self.bands {
            Some(_) => Some("W/m2"),
            None => None,
        }
    }

    /// The names of what shares the walks of a target: the channels, and last their sum.
    #[must_use]
    pub fn shared(&self) -> &[String] {
        &self.names
    }

    /// The number of channels, without the sum.
    #[must_use]
    pub const fn channels(&self) -> usize {
        self.weights.len()
    }

    /// The weights of the sum.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The numbers of all channels, and last their weighted sum.
    #[must_use]
    pub fn with_sum(&self, channels: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut all: Vec<f64> = channels.into_iter().collect();
        let terms = all.iter().zip(&self.weights);
        all.push(terms.map(|(own, weight)| own * weight).sum());
        all
    }

    /// The goals of every target, which are those of all channels and of their sum.
    ///
    /// # Errors
    /// [`Error::Internal`]: a target has others.
    pub fn targets<'g>(
        &self,
        goals: &'g [Goal],
    ) -> Result<impl Iterator<Item = &'g Goal> + Clone + use<'g>, Error> {
        let shared = self.names.len();
        let targets = goals.chunks(shared);
        let is_whole = |goals: &[Goal]| {
            let channels = goals.iter().map(|goal| goal.channel);
            channels.eq((0..shared).map(Some))
        };
        if targets.clone().all(is_whole) {
            Ok(targets.filter_map(<[Goal]>::first))
        } else {
            Err(Error::Internal("a target without all its channels"))
        }
    }

    /// Irradiances of every goal in its channel, and net fluxes of heat, from the statistics of u and the one material of a region in
    /// every channel. Those of the sum follow where all channels have one reflectance.
    pub(crate) fn derived(
        &self,
        goals: &[Goal],
        statistics: &[Statistics],
        materials: &dyn Fn(&Region) -> Option<Vec<Material>>,
    ) -> Derived {
        let shared = self.names.len();
        let mut heat = Vec::with_capacity(goals.len());
        // The goals of a target are those of all its channels.
        for (goals, statistics) in goals.chunks(shared).zip(statistics.chunks(shared)) {
            let materials = goals.first().and_then(|goal| materials(&goal.region));
            for (goal, statistics) in goals.iter().zip(statistics) {
                let u = statistics.preconditioned();
                let own = materials.as_ref().zip(goal.channel);
                let own = own.and_then(|(own, channel)| self.heat(own, channel, u));
                heat.push(own.unwrap_or_default());
            }
        }
        Derived {
            heat,
            fluxes: Vec::new(),
        }
    }

    /// What follows from u of a channel, or of the sum.
    fn heat(&self, materials: &[Material], channel: usize, u: Estimate) -> Option<Heat> {
        let own = match materials.get(channel) {
            Some(own) => *own,
            None => self.sum_of(materials)?,
        };
        if own.reflectance <= 0.0 {
            return None;
        }
        let irradiance = own.irradiance_of(u);
        Some(Heat {
            irradiance: Some(irradiance),
            net_flux: (self.bands.is_some() && own != ARRIVES).then(|| own.net_flux_of(irradiance)),
            ..Heat::default()
        })
    }

    /// The material of the sum, if all channels have one reflectance.
    fn sum_of(&self, materials: &[Material]) -> Option<Material> {
        let reflectance = materials.first()?.reflectance;
        let emissions = materials.iter().map(|own| own.emission);
        let emission = *self.with_sum(emissions).last()?;
        let mut all = materials.iter();
        all.all(|own| own.reflectance == reflectance)
            .then_some(Material {
                reflectance,
                emission,
            })
    }

    /// Refuses materials, a reflectance and an emission for each channel, of which one is wrong.
    ///
    /// # Errors
    /// [`Error::Option`], with the words for what has them.
    pub fn check(&self, what: &str, materials: &[Material]) -> Result<(), Error> {
        let channels = self.channels();
        check_names(self.names.get(..channels).unwrap_or_default())?;
        if materials.len() != channels {
            return refuse(format!(
                "{what} has {} materials, and there are {channels} channels",
                materials.len()
            ));
        }
        let is_good = |own: &Material| {
            (0.0..=1.0).contains(&own.reflectance)
                && own.emission >= 0.0
                && own.emission.is_finite()
        };
        if !materials.iter().all(is_good) {
            return refuse(format!(
                "{what}: in every channel a reflectance must be from 0 to 1, and an emission 0 or more"
            ));
        }
        Ok(())
    }
}

/// The numbers of all channels, and last their weighted sum, if there are weights.
#[must_use]
pub fn with_sum(value: &impl Value<f64>, weights: &[f64]) -> Vec<f64> {
    let own = (0..value.channels()).map(|c| value.get(c));
    let terms = own.clone().zip(weights);
    let sum = terms.map(|(own, weight)| own * weight).sum();
    own.chain((!weights.is_empty()).then_some(sum)).collect()
}

/// The regions in which walks of a request start: those of its goals, of which a target has one for every channel, and in one channel
/// also those of surfaces whose net fluxes take walks.
///
/// # Errors
/// [`Error::Internal`]: a target has not a goal for every channel.
pub fn regions(
    surfaces: &dyn RadiativeExchange,
    colours: Option<&Colours>,
    request: &Request<'_>,
) -> Result<Vec<Region>, Error> {
    let Some(colours) = colours else {
        return Ok(surfaces.regions(request.goals, request.wanted == Wanted::U));
    };
    let targets = colours.names.targets(request.goals)?;
    Ok(targets.map(|goal| goal.region.clone()).collect())
}

/// Refuses names of channels that are none, too many, blank, not printable, or the same.
///
/// # Errors
/// [`Error::Option`].
pub fn check_names(names: &[String]) -> Result<(), Error> {
    if !(1..=MOST_CHANNELS).contains(&names.len()) {
        let count = names.len();
        return refuse(format!(
            "there are 1 to {MOST_CHANNELS} channels, not {count}"
        ));
    }
    let is_wrong = |(number, name): &(usize, &String)| {
        let is_taken = names[..*number].contains(name);
        is_taken || name.trim().is_empty() || name.contains(char::is_control)
    };
    match names.iter().enumerate().find(is_wrong) {
        None => Ok(()),
        Some((_, name)) => refuse(format!(
            "the names of channels must differ, and be printable: {name:?}"
        )),
    }
}

fn is_rgb(channels: &[String]) -> bool {
    channels == ["red", "green", "blue"]
}

fn refuse<T>(message: String) -> Result<T, Error> {
    Err(Error::Option {
        subject: Subject::Problem,
        message,
    })
}

/// Refuses materials of a model that are not the largest of its channels.
///
/// # Errors
/// [`Error::Option`].
pub fn refuse_other_materials<T>() -> Result<T, Error> {
    refuse(
        "the surfaces of a model with colours must have the largest reflectance and emission of all channels"
            .to_owned(),
    )
}

/// Refuses colours beside temperatures.
///
/// # Errors
/// [`Error::Option`].
pub fn refuse_heat<T>() -> Result<T, Error> {
    refuse("surfaces have temperatures or colours, not both".to_owned())
}

/// Refuses tables for devices.
///
/// # Errors
/// [`Error::Option`].
pub fn refuse_device_tables<T>() -> Result<T, Error> {
    refuse("there are no device tables of several channels: leave `channels` and lists of reflectances and emissions out".to_owned())
}

/// Refuses the global estimate of a model with channels.
///
/// # Errors
/// [`Error::Option`].
pub fn refuse_whole(model: &dyn Model) -> Result<(), Error> {
    if model.channels().is_empty() {
        return Ok(());
    }
    refuse(
        "the global estimate from one set of walks has one channel: ask for targets without it, whose walks serve all \
         channels"
            .to_owned(),
    )
}

/// The names of the numbers of a spot in a table: values and standard errors, of all channels of these names if there are some.
#[must_use]
pub fn columns(channels: &[String], alone: &str) -> Vec<String> {
    let of = |name: &String| [name.clone(), format!("{name}_std_error")];
    match channels {
        [] => [alone, "std_error"].map(str::to_owned).to_vec(),
        channels => channels.iter().flat_map(of).collect(),
    }
}

/// The value and the standard error of a spot by its number, in every channel and then for their sum; NaN where there is no such
/// spot.
#[must_use]
pub fn numbers(channels: &[Vec<Spot>], sum: &[Spot], spot: usize) -> Vec<f64> {
    let all = channels.iter().map(Vec::as_slice).chain([sum]);
    let own = all.map(|spots| spots.get(spot).copied().unwrap_or(BLANK));
    own.flat_map(|spot| [spot.value, spot.error]).collect()
}

/// Red, green and blue of all spots, if these are the names of the channels, of which the last is their sum.
#[must_use]
pub fn colours(names: &[String], channels: &[Vec<Spot>]) -> Option<[Vec<f64>; 3]> {
    let (_, names) = names.split_last()?;
    let [red, green, blue] = channels else {
        return None;
    };
    let values = |spots: &Vec<Spot>| spots.iter().map(|spot| spot.value).collect();
    is_rgb(names).then(|| [red, green, blue].map(values))
}

/// The value of an expression for an equation in one channel, or in the colours of [`ColourTables`](fredholm_room::ColourTables) if there are
/// some: of one type each for one channel, for up to four, of which red, green and blue are three, and for many.
#[macro_export]
macro_rules! in_channels {
    ($equation:expr, $colours:expr, $name:ident => $then:expr) => {{
        let equation = $equation;
        match $colours {
            None => {
                let $name = &equation;
                $then
            }
            Some(colours) if colours.channels <= 4 => {
                let $name = &equation.with_colours(colours.tint::<4>())?;
                $then
            }
            Some(colours) => {
                let colours = colours.tint::<{ fredholm_core::MOST_CHANNELS }>();
                let $name = &equation.with_colours(colours)?;
                $then
            }
        }
    }};
}
