//! Channels as files have them: their names, and one number for all of them or one for each.

use fredholm_core::channels::MOST_CHANNELS;
use toml::de::DeValue;

use crate::place::{InputError, Place, Placed};
use crate::section::Field;
use crate::validate::is_printable;

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
    if !(1..=MOST_CHANNELS).contains(&all.len()) {
        return Err(field.error(format_args!("there are 1 to {MOST_CHANNELS} channels")));
    }
    for (number, name) in names.value.iter().enumerate() {
        let is_taken = all.iter().take(number).any(|other| *other == name.value);
        if is_taken || name.value.trim().is_empty() || !is_printable(&name.value) {
            let message = "the names of channels must differ, and be printable";
            return Err(at(field, &name.place, message));
        }
    }
    Ok(all)
}

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
    let lists = match &field.value {
        DeValue::Array(array) if array.iter().any(|item| item.get_ref().is_array()) => {
            let items = array.iter().enumerate();
            let lists = items.map(|(index, item)| list(&field.element(index, item)));
            lists.collect::<Result<_, _>>()?
        }
        _ => vec![list(field)?],
    };
    Ok(Placed::file(field.span.clone(), lists))
}

/// Refuses lists of lists where no channels are named.
pub(crate) fn refuse_lists(field: &Field<'_, '_>) -> Result<(), InputError> {
    match &field.value {
        DeValue::Array(array) if array.iter().any(|item| item.get_ref().is_array()) => Err(field
            .error(
                "a list for every segment has the numbers of its channels: name them, \
                 `channels = [\"red\", \"green\", \"blue\"]`, in `[problem]`",
            )),
        _ => Ok(()),
    }
}

fn at(field: &Field<'_, '_>, place: &Place, message: &str) -> InputError {
    match place {
        Place::File(span) => field.source.error(span.clone(), message),
        _ => field.error(message),
    }
}
