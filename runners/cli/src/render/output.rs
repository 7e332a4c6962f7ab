//! What was found for a picture: as colours, as a table, and in words.

use fredholm::numbers::short;
use fredholm::room::Spot;
use fredholm_plot::{Figure, Panel, Picture, Scale, Shades};
use serde::Serialize;

use super::{Content, Drawn};
use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::table;

/// Pixels, and of rooms pieces of walls.
pub(super) struct Seen {
    pub(super) pixels: Vec<Spot>,
    pub(super) walls: Vec<Spot>,
    /// What is shown in the place of pixels that see nothing.
    pub(super) blank: f64,
    /// Red, green and blue of both.
    pub(super) light: Option<[[Vec<f64>; 3]; 2]>,
    /// Walks for a pixel, or of a global estimate for all of them.
    pub(super) walks: u64,
    pub(super) seconds: f64,
}

impl Seen {
    /// What pixels show.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> + Clone {
        self.pixels.iter().map(|spot| match spot.value.is_nan() {
            true => self.blank,
            false => spot.value,
        })
    }

    fn noise(&self) -> Noise {
        Noise {
            walks: self.walks,
            std_error: root_mean_square(&self.pixels),
            seconds: self.seconds,
        }
    }

    fn panel(&self, heading: Option<String>) -> Panel {
        let [pixels, walls] = [0, 1].map(|k| self.light.as_ref().map(|light| light[k].clone()));
        Panel {
            heading,
            pixels: Shades {
                values: self.values().collect(),
                light: pixels,
            },
            walls: Shades {
                values: self.walls.iter().map(|spot| spot.value).collect(),
                light: walls,
            },
        }
    }

    fn heading(&self, name: &str) -> String {
        format!(
            "{name}: {} a pixel, {:.1} s",
            counted(self.walks, "walk"),
            self.seconds
        )
    }

    /// The same picture of the standard errors.
    fn errors(&self, picture: &Picture<'_>, is_whole: bool) -> Result<Figure, Failure> {
        let errors = |spots: &[Spot]| -> Vec<f64> { spots.iter().map(|spot| spot.error).collect() };
        let (pixels, walls) = (errors(&self.pixels), errors(&self.walls));
        let each = if is_whole { "for all of it" } else { "a pixel" };
        let walks = self.walks;
        let picture = Picture {
            scale: Scale::new(pixels.iter().copied(), walls.iter().copied(), true),
            legend: "error",
            stefan_boltzmann: None,
            captions: vec![format!(
                "Standard errors of the picture, from {walks} walks {each}."
            )],
            ..picture.clone()
        };
        let panel = Panel {
            heading: None,
            pixels: pixels.into(),
            walls: walls.into(),
        };
        picture.draw(&[panel]).map_err(Failure::run)
    }
}

/// So many things of this name.
fn counted(count: u64, name: &str) -> String {
    format!("{count} {name}{}", if count == 1 { "" } else { "s" })
}

/// The root mean square of the errors that are numbers.
pub(super) fn root_mean_square(spots: &[Spot]) -> Option<f64> {
    let errors = spots.iter().map(|spot| spot.error);
    let (count, sum) = errors
        .filter(|error| error.is_finite())
        .fold((0_u64, 0.0), |(n, sum), x| (n + 1, sum + x * x));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// What `render --json` prints. Names are a promise; fields may be added.
#[derive(Debug, Serialize)]
struct Summary {
    /// Pixels over the room and next to it.
    width: usize,
    height: usize,
    /// In a picture of a room, the place of the first of them: pixels from its left and its upper edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<[usize; 2]>,
    /// In a picture of a room, the numbers at the ends of its colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<[f64; 2]>,
    /// Whether all pixels are from one set of walks, by the global estimate.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    whole: bool,
    /// Those within the room, or which see a surface.
    inside: usize,
    cells: usize,
    /// Of what is seen.
    least: f64,
    largest: f64,
    preconditioned: Noise,
    /// With `--side-by-side`.
    plain: Option<Noise>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Noise {
    /// For a pixel, or of a global estimate for all of them.
    walks: u64,
    /// Root mean square over pixels of the standard error; `null` for one walk.
    std_error: Option<f64>,
    seconds: f64,
}

impl Summary {
    fn text(&self, words: [&str; 2]) -> String {
        let [within, seen] = words;
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
            true => ("global estimate", "for all of it"),
            false => ("preconditioned", "a pixel"),
        };
        let all = [(name, Some(self.preconditioned)), ("plain", self.plain)];
        for (name, noise) in all {
            let Some(noise) = noise else { continue };
            text += &format!(
                "{name}: {} {each}, RMS standard error {}, {:.1} s\n",
                counted(noise.walks, "walk"),
                noise.std_error.map_or("unknown".to_owned(), short),
                noise.seconds
            );
        }
        text
    }
}

/// What is seen with and without a control variate, as a picture or a table.
pub(super) struct Results<'a> {
    pub(super) seen: Seen,
    pub(super) plain: Option<Seen>,
    pub(super) picture: Picture<'a>,
    /// The number of cells of the neighbour equation.
    pub(super) cells: usize,
    /// The table; `None` for a picture.
    pub(super) table: Option<Vec<u8>>,
}

impl Results<'_> {
    /// What goes into the files, and what is said of them.
    pub(super) fn content(self, args: &RenderArgs) -> Result<Content, Failure> {
        let (seen, is_table) = (&self.seen, self.table.is_some());
        let drawn = match self.table {
            Some(table) => Drawn::Table(table),
            None => {
                let mut panels = Vec::new();
                panels.extend(
                    (self.plain.iter()).map(|plain| plain.panel(Some(plain.heading("plain")))),
                );
                let heading = self.plain.as_ref().map(|_| seen.heading("preconditioned"));
                panels.push(seen.panel(heading));
                Drawn::Figure(Box::new(self.picture.draw(&panels).map_err(Failure::run)?))
            }
        };
        let is_room = self.picture.overlay.is_some();
        let scale = self.picture.scale;
        let values = || seen.values();
        let summary = Summary {
            width: self.picture.size[0],
            height: self.picture.size[1],
            origin: match &drawn {
                Drawn::Figure(figure) if is_room => figure.origin(),
                _ => None,
            },
            scale: (is_room && !is_table).then_some([scale.low(), scale.high()]),
            whole: args.global,
            inside: (seen.pixels.iter())
                .filter(|spot| !spot.value.is_nan())
                .count(),
            cells: self.cells,
            least: values().fold(f64::INFINITY, f64::min),
            largest: values().fold(f64::NEG_INFINITY, f64::max),
            preconditioned: seen.noise(),
            plain: self.plain.as_ref().map(Seen::noise),
        };
        let words = match is_room {
            true => ["within the room", "seen between the walls"],
            false => ["that see something", "seen"],
        };
        let errors = args.errors.as_ref();
        let errors = errors.map(|_| seen.errors(&self.picture, args.global));
        Ok(Content {
            drawn,
            errors: errors.transpose()?,
            text: match args.common.json {
                true => table::json(&summary)?,
                false => summary.text(words),
            },
        })
    }
}

/// The numbers of pixels: two of their places, and those of these names.
pub(super) fn pixels(
    places: [&str; 2],
    names: Vec<String>,
    rows: impl Iterator<Item = ([f64; 2], Vec<f64>)>,
) -> Result<Vec<u8>, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = places.map(str::to_owned).into_iter().chain(names);
    writer.write_record(head).map_err(Failure::run)?;
    for (place, numbers) in rows {
        let numbers = place.into_iter().chain(numbers);
        let record = numbers.map(number_or_nothing);
        writer.write_record(record).map_err(Failure::run)?;
    }
    writer.into_inner().map_err(Failure::run)
}

/// An empty field for what is not known.
pub(super) fn number_or_nothing(value: f64) -> String {
    match value.is_nan() {
        true => String::new(),
        false => format!("{value}"),
    }
}
