//! The numbers of a picture, as text.

use fredholm::numbers::short;
use fredholm::room::{Field, Spot};
use serde::Serialize;

use super::root_mean_square;
use crate::failure::Failure;

/// What `render --json` prints. Names are a promise; fields may be added.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    /// Pixels over the room and next to it.
    pub(super) width: usize,
    pub(super) height: usize,
    /// In a picture, the place of the first of them: pixels from its left and its upper edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) origin: Option<[usize; 2]>,
    /// In a picture of a room, the numbers at the ends of its colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) scale: Option<[f64; 2]>,
    /// Whether all pixels are from one set of walks, by the whole function.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub(super) whole: bool,
    /// Whether it is what a camera sees.
    #[serde(skip)]
    pub(super) is_view: bool,
    /// Those within the room, or which see a surface.
    pub(super) inside: usize,
    pub(super) cells: usize,
    /// Of what is seen.
    pub(super) least: f64,
    pub(super) largest: f64,
    pub(super) preconditioned: Noise,
    /// With `--side-by-side`.
    pub(super) plain: Option<Noise>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Noise {
    /// For a pixel, or of a whole function for all of them.
    pub(super) walks: u64,
    /// Root mean square over pixels of the standard error; `null` for one walk.
    pub(super) std_error: Option<f64>,
    pub(super) seconds: f64,
}

impl Noise {
    pub(super) fn of(field: &Field) -> Self {
        Self::new(&field.air, field.walks, field.seconds)
    }

    pub(super) fn new(spots: &[Spot], walks: u64, seconds: f64) -> Self {
        Self {
            walks,
            std_error: root_mean_square(spots.iter().map(|spot| spot.error)),
            seconds,
        }
    }
}

/// The numbers of pixels: two of their places, and those of these names.
pub(super) fn table(
    places: [&str; 2],
    names: Vec<String>,
    rows: impl Iterator<Item = ([f64; 2], Vec<f64>)>,
) -> Result<Vec<u8>, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = places.map(str::to_owned).into_iter().chain(names);
    writer.write_record(head).map_err(Failure::run)?;
    for (place, numbers) in rows {
        let numbers = place.into_iter().chain(numbers);
        writer
            .write_record(numbers.map(number_or_nothing))
            .map_err(Failure::run)?;
    }
    writer.into_inner().map_err(Failure::run)
}

/// An empty field for what is not known.
pub(super) fn number_or_nothing(value: f64) -> String {
    if value.is_nan() {
        String::new()
    } else {
        format!("{value}")
    }
}

impl Summary {
    pub(super) fn text(&self, json: bool) -> Result<String, Failure> {
        if json {
            let mut text = serde_json::to_string_pretty(self).map_err(Failure::run)?;
            text.push('\n');
            return Ok(text);
        }
        let [within, seen] = match self.is_view {
            true => ["that see something", "seen"],
            false => ["within the room", "seen between the walls"],
        };
        let mut text = format!(
            "{} x {} pixels, {} {within}; {} cells\n{seen}: {} to {}\n",
            self.width,
            self.height,
            self.inside,
            self.cells,
            short(self.least),
            short(self.largest)
        );
        let (name, each) = match self.whole {
            true => ("whole function", "for all of it"),
            false => ("preconditioned", "a pixel"),
        };
        let all = [(name, Some(self.preconditioned)), ("plain", self.plain)];
        for (name, noise) in all {
            let Some(noise) = noise else { continue };
            text.push_str(&format!(
                "{name}: {} walk{} {each}, RMS standard error {}, {:.1} s\n",
                noise.walks,
                if noise.walks == 1 { "" } else { "s" },
                noise.std_error.map_or("unknown".to_owned(), short),
                noise.seconds
            ));
        }
        Ok(text)
    }
}
