//! Channels as files have them: their names, and one number for all of them or one for each.

use fredholm::channels::{Bands, ChannelNames, check_names};
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

/// Reads `wavelengths`.
fn read_bands(field: &Field<'_, '_>) -> Result<Bands, InputError> {
    let edges: Vec<f64> = field.numbers()?.value.iter().map(|x| x.value).collect();
    let is_wrong_count = !(1..MOST_CHANNELS).contains(&edges.len());
    let bands = Bands::new(edges).ok_or_else(|| {
        field.error(
            "wavelengths are in micrometres, more than 0 and in ascending order: where a band ends and the next begins",
        )
    })?;
    if is_wrong_count {
        return Err(field.error(format_args!(
            "there are 2 to {MOST_CHANNELS} bands, with a wavelength between each and the next"
        )));
    }
    Ok(bands)
}

/// Reads the names of channels, or the wavelengths of bands.
pub(crate) fn names_or_bands(
    channels: Option<&Field<'_, '_>>,
    wavelengths: Option<&Field<'_, '_>>,
) -> Result<(Vec<String>, Option<Bands>), InputError> {
    match (channels, wavelengths) {
        (Some(_), Some(field)) => Err(field.error(
            "bands are channels: give either the names of `channels` or the `wavelengths` of bands",
        )),
        (Some(field), None) => Ok((read_names(field)?, None)),
        (None, Some(field)) => {
            let bands = read_bands(field)?;
            Ok((bands.names(), Some(bands)))
        }
        (None, None) => Ok((Vec::new(), None)),
    }
}

/// The names of channels, or bands.
pub(crate) fn channel_names(names: &[String], bands: Option<&Bands>) -> ChannelNames {
    match bands {
        Some(bands) => ChannelNames::of_heat(bands.clone()),
        None => ChannelNames::new(names.to_vec()),
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
