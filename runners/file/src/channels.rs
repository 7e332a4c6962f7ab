//! Channels as files have them: their names, and one number for all of them or one for each.

use fredholm::channels::check_names;
use fredholm::heat::part_below;
use fredholm_core::MOST_CHANNELS;

use crate::place::{InputError, Placed};
use crate::section::Field;

/// What is said where temperatures stand beside channels.
pub(crate) const HEAT: &str = "temperatures and net fluxes have one channel: leave out `channels` and lists of \
                               reflectances and emissions, or the temperatures";
/// What is said of a negative emission.
pub(crate) const NEGATIVE: &str = "with colours an emission must be 0 or more";

/// Lists of numbers, one for all segments of a surface or one for each: one number, or one for every channel. Absent where a deck
/// or a default gives it.
pub type Lists = Option<Placed<Vec<Vec<Placed<f64>>>>>;

/// The names of the channels.
pub(crate) fn read_names(field: &Field<'_, '_>) -> Result<Vec<String>, InputError> {
    let names = field.strings()?;
    let all: Vec<String> = names.value.iter().map(|name| name.value.clone()).collect();
    check_names(&all).map_err(|error| field.error(error))?;
    Ok(all)
}

/// Bands of wavelengths, between which surfaces with temperatures send out different parts of their heat.
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    /// Where a band ends and the next one begins, in micrometres, in ascending order.
    edges: Vec<f64>,
}

impl Bands {
    /// Reads `wavelengths`.
    pub(crate) fn read(field: &Field<'_, '_>) -> Result<Self, InputError> {
        let edges: Vec<f64> = field.numbers()?.value.iter().map(|x| x.value).collect();
        let ascend = edges.windows(2).all(|pair| matches!(pair, [a, b] if a < b));
        let positive = edges.iter().all(|edge| *edge > 0.0 && edge.is_finite());
        if !ascend || !positive {
            return Err(field.error(
                "wavelengths are in micrometres, more than 0 and in ascending order: where a band ends and the next begins",
            ));
        }
        if !(1..MOST_CHANNELS).contains(&edges.len()) {
            return Err(field.error(format_args!(
                "there are 2 to {MOST_CHANNELS} bands, with a wavelength between each and the next"
            )));
        }
        Ok(Self { edges })
    }

    /// Reads the names of channels, or the wavelengths of bands.
    pub(crate) fn or_names(
        channels: Option<&Field<'_, '_>>,
        wavelengths: Option<&Field<'_, '_>>,
    ) -> Result<(Vec<String>, Option<Self>), InputError> {
        match (channels, wavelengths) {
            (Some(_), Some(field)) => Err(field.error(
                "bands are channels: give either the names of `channels` or the `wavelengths` of bands",
            )),
            (Some(field), None) => Ok((read_names(field)?, None)),
            (None, Some(field)) => {
                let bands = Self::read(field)?;
                Ok((bands.names(), Some(bands)))
            }
            (None, None) => Ok((Vec::new(), None)),
        }
    }

    /// The names of the bands.
    pub(crate) fn names(&self) -> Vec<String> {
        let (first, last) = (self.edges.first(), self.edges.last());
        let below = first.map(|edge| format!("below {edge} um"));
        let between = self.edges.windows(2);
        let between = between.map(|pair| match pair {
            [from, to] => format!("{from} to {to} um"),
            _ => String::new(),
        });
        let above = last.map(|edge| format!("above {edge} um"));
        below.into_iter().chain(between).chain(above).collect()
    }

    /// The parts of the heat of a black body of this temperature in kelvin that are in each band.
    pub(crate) fn parts(&self, temperature: f64) -> Vec<f64> {
        let below = self.edges.iter().map(|edge| part_below(*edge, temperature));
        let ends: Vec<f64> = below.chain([1.0]).collect();
        let starts = [0.0].iter().chain(&ends);
        ends.iter()
            .zip(starts)
            .map(|(end, start)| end - start)
            .collect()
    }
}

/// What is said of light beside bands.
pub(crate) const LIGHT_IN_BANDS: &str = "with `wavelengths` surfaces have `emissivity` and `temperature`, no `reflectance` and `emission`";
/// What is said of a net flux beside bands.
pub(crate) const FLUX_IN_BANDS: &str =
    "a net flux does not say in which band it leaves: with `wavelengths` give the `temperature`";

/// The names of channels that have none: colours, or numbers.
pub(crate) fn default_names(count: usize) -> Vec<String> {
    match count {
        3 => ["red", "green", "blue"].map(str::to_owned).to_vec(),
        count => (1..=count).map(|number| number.to_string()).collect(),
    }
}

/// The error for a list of neither one number nor one for each channel.
pub(crate) fn wrong_count(field: &Field<'_, '_>, channels: usize, found: usize) -> InputError {
    field.error(format_args!(
        "`{}` has one number, or one for each of the channels, of which there are {}, not {found}",
        field.name,
        channels.clamp(1, MOST_CHANNELS)
    ))
}

/// The number of a channel, if one number is that of all; 0 if there is none.
pub(crate) fn of_channel(list: &[f64], channel: usize) -> f64 {
    match list {
        [] => 0.0,
        [one] => *one,
        many => many.get(channel).copied().unwrap_or(f64::NAN),
    }
}

/// Reads a number, a list with one for each channel, or an array of such lists or numbers, one for each segment of a surface.
pub(crate) fn read_lists(
    field: &Field<'_, '_>,
    channels: usize,
) -> Result<Placed<Vec<Vec<Placed<f64>>>>, InputError> {
    let list = |field: &Field<'_, '_>| {
        let numbers = field.numbers()?.value;
        if numbers.len() == 1 || numbers.len() == channels {
            Ok(numbers)
        } else {
            Err(wrong_count(field, channels, numbers.len()))
        }
    };
    field.one_or_more(list)
}

/// Refuses lists of lists where no channels are named.
pub(crate) fn refuse_lists(field: &Field<'_, '_>) -> Result<(), InputError> {
    match field.is_nested() {
        true => Err(field.error(
            "a list for every segment has the numbers of its channels: name them, \
             `channels = [\"red\", \"green\", \"blue\"]`, in `[problem]`",
        )),
        false => Ok(()),
    }
}
