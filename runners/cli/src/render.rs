//! `fredholm render`: a picture of a room with its light.

mod field;
mod picture;
mod profile;
mod raster;
mod scale;
mod strips;

use std::io::Write;
use std::path::Path;

use fredholm_core::Real;
use fredholm_room::{Enclosure, Scene};
use serde::Serialize;

use crate::args::RenderArgs;
use crate::failure::{Ended, Failure, say};
use crate::file::{self, Pairs, ProblemFile, Scalar};
use crate::numbers::short;
use crate::output::Output;
use crate::problem::Problem;
use crate::progress::Progress;
use crate::room::{RoomFile, of_degree};
use crate::solve;
use crate::threads::with_threads;
use field::{Cut, Field, Grid, Piece, Spot, Wanted};
use picture::{Panel, Picture};
use scale::Scale;

/// Walks for a pixel, and for a point of a profile, where nothing else is asked.
const PIXEL_WALKS: u64 = 4;
const PROFILE_WALKS: u64 = 1000;
/// The length of a piece of wall in pixels.
const PIECE: f64 = 3.0;

/// The formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Svg,
    Csv,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        let known = [("png", Self::Png), ("svg", Self::Svg), ("csv", Self::Csv)];
        let extension = path.extension().unwrap_or_default();
        let found = known
            .iter()
            .find(|(name, _)| extension.eq_ignore_ascii_case(name));
        found.map(|&(_, format)| format).ok_or_else(|| {
            Failure::input(format_args!(
                "`--out {}`: the name must end in .png or .svg for a picture, or in .csv for its \
                 numbers",
                path.display()
            ))
        })
    }
}

/// What `render --json` prints. Names are a promise; fields may be added.
#[derive(Debug, Serialize)]
struct Summary {
    /// Pixels.
    width: usize,
    height: usize,
    /// Those within the room.
    inside: usize,
    cells: usize,
    /// Of what is seen between the walls.
    least: f64,
    largest: f64,
    preconditioned: Noise,
    /// With `--side-by-side`.
    plain: Option<Noise>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Noise {
    /// For a pixel.
    walks: u64,
    /// Root mean square over pixels of the standard error; `null` for one walk.
    std_error: Option<f64>,
    seconds: f64,
}

impl Noise {
    fn of(field: &Field) -> Self {
        Self {
            walks: field.walks,
            std_error: field.noise(),
            seconds: field.seconds,
        }
    }
}

/// Runs `render`.
pub(crate) fn render(args: &RenderArgs) -> Result<Ended, Failure> {
    let format = Format::of(&args.out)?;
    if format == Format::Csv && (args.side_by_side || args.log) {
        return Err(Failure::input(
            "`--log` and `--side-by-side` are for pictures: write a .png or .svg",
        ));
    }
    let file = solve::read(&args.file, |_| ())?;
    let file::Problem::Room(room) = &file.problem else {
        return Err(Failure::input(format_args!(
            "{}: pictures are of rooms: `kind = \"room\"`; the profile of a circle or of a cube is \
             a target with a `grid`, and `solve --out` draws it",
            args.file.display()
        )));
    };
    let room = RoomFile::new(&file, room)?;
    room.refuse_infinite_variance()?;
    solve::refuse_beyond_memory(&file, &room)?;
    let output = Output::open(&args.out)?;
    let work = || match file.walk.scalar.value {
        Scalar::F32 => content::<f32>(args, &file, &room, format),
        Scalar::F64 => content::<f64>(args, &file, &room, format),
    };
    let (content, text) = match with_threads(args.common.threads, work)? {
        Ok(done) => done,
        Err(Cut::Interrupted) => {
            say("warning: interrupted; no picture was written");
            return Ok(Ended::Interrupted);
        }
        Err(Cut::Failed(failure)) => return Err(failure),
    };
    output.finish(content)?;
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(Ended::Done)
}

/// What goes into the file, and what is said of it.
fn content<F: Real>(
    args: &RenderArgs,
    file: &ProblemFile,
    room: &RoomFile<'_>,
    format: Format,
) -> Result<(Vec<u8>, String), Cut> {
    if args.profile {
        profile::content::<F>(args, file, room, format)
    } else {
        picture::<F>(args, file, room, format)
    }
}

fn picture<F: Real>(
    args: &RenderArgs,
    file: &ProblemFile,
    room: &RoomFile<'_>,
    format: Format,
) -> Result<(Vec<u8>, String), Cut> {
    let (surfaces, scene) = room.parts();
    let across = usize::from(args.width);
    let thickness = (across as f64 / 130.0).max(3.0);
    // Light leaves an open room, and some of it is shown.
    let around = match scene.enclosure() {
        Enclosure::Closed => 2,
        Enclosure::Open => across / 12 + 2,
    };
    let grid = Grid::new(scene, across, around);
    let geometry = scene.geometry();
    let strips = strips::strips(geometry.walls(), thickness, |at| grid.place(at));
    let pieces = pieces(&strips, thickness);
    let walks = args.walks.unwrap_or(PIXEL_WALKS);
    let weights: u64 = pieces.iter().map(|piece| piece.weight).sum();
    let pixels = grid.width * grid.height;
    let progress = Progress::new(walks.saturating_mul(pixels as u64 + weights));
    let plan = solve::plan(file, None);
    let wanted = Wanted {
        scene,
        grid: Some(grid),
        pieces: &pieces,
        walks,
        seed: plan.seed,
        estimator: plan.estimator,
        progress: &progress,
    };
    let fields = of_degree!(room.degree(), B => field::estimate::<F, B>(
        &wanted,
        || room.set_up(Pairs::Pointwise),
        args.side_by_side,
    ));
    progress.done();
    let (field, plain) = fields?;
    let seen = || field.air.iter().map(|spot| spot.value);
    let summary = Summary {
        width: grid.width,
        height: grid.height,
        inside: seen().filter(|value| !value.is_nan()).count(),
        cells: room.cells_in_all(),
        least: seen().fold(f64::INFINITY, f64::min),
        largest: seen().fold(f64::NEG_INFINITY, f64::max),
        preconditioned: Noise::of(&field),
        plain: plain.as_ref().map(Noise::of),
    };
    let text = summary.text(args.common.json)?;
    if format == Format::Csv {
        return Ok((csv(&grid, &field.air)?, text));
    }
    let walls = || field.walls.iter().map(|spot| spot.value);
    let scale = Scale::new(seen(), walls(), args.log);
    let picture = Picture {
        grid,
        pieces: &pieces,
        strips: &strips,
        scale,
        legend: if surfaces.heat { "W/m²" } else { "u" },
        heat: surfaces.heat,
        captions: captions(&field, &scale, surfaces.heat),
    };
    let heading = |name: &str, field: &Field| {
        let plural = if field.walks == 1 { "" } else { "s" };
        format!(
            "{name}: {} walk{plural} a pixel, {:.1} s",
            field.walks, field.seconds
        )
    };
    let mut panels = Vec::new();
    if let Some(plain) = &plain {
        panels.push(Panel {
            heading: Some(heading("plain", plain)),
            field: plain,
        });
    }
    panels.push(Panel {
        heading: plain.as_ref().map(|_| heading("preconditioned", &field)),
        field: &field,
    });
    let (images, scene) = picture.draw(&panels);
    let content = match format {
        Format::Svg => raster::svg(&images, scene)?.into_bytes(),
        _ => raster::png(&images, scene)?,
    };
    Ok((content, text))
}

/// A room whose walls have the colour of a density: pieces by wall, place in fractions of it, and value.
pub(crate) fn shares(scene: &Scene, values: &[(usize, [f64; 2], f64)]) -> Result<String, Failure> {
    const ACROSS: usize = 700;
    let grid = Grid::new(scene, ACROSS, 2);
    let walls = scene.geometry();
    let strips = strips::strips(walls.walls(), ACROSS as f64 / 50.0, |at| grid.place(at));
    let of = |&(wall, [from, to], _): &(usize, [f64; 2], f64)| Piece {
        wall,
        from,
        to,
        weight: 1,
    };
    let pieces: Vec<Piece> = values.iter().map(of).collect();
    // A few short cells in corners would leave all others in the dark.
    let mut sorted: Vec<f64> = values.iter().map(|&(.., value)| value).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let most = sorted.get(sorted.len() * 199 / 200).copied().unwrap_or(1.0);
    let density = || values.iter().map(|&(.., value)| value.min(most));
    let scale = Scale::new(density(), density(), true);
    let field = Field::of_walls(density(), grid.width * grid.height);
    let picture = Picture {
        grid,
        pieces: &pieces,
        strips: &strips,
        scale,
        legend: "density",
        heat: false,
        captions: vec![
            "Where the variance of preconditioned walks comes from: the share of each place, by steps that \
             start there and by the difference of the sources, over its share of all walls (1: the mean)."
                .to_owned(),
        ],
    };
    let panel = Panel {
        heading: None,
        field: &field,
    };
    let (images, scene) = picture.draw(&[panel]);
    raster::svg(&images, scene)
}

/// The walls in pieces of some pixels; each has the walks of the pixels that it covers.
fn pieces(strips: &[strips::Strip], thickness: f64) -> Vec<Piece> {
    let of = |(wall, strip): (usize, &strips::Strip)| {
        let count = (strip.length() / PIECE).ceil().max(1.0) as u32;
        let weight = (thickness * strip.length() / f64::from(count))
            .round()
            .max(1.0) as u64;
        (0..count).map(move |k| Piece {
            wall,
            from: f64::from(k) / f64::from(count),
            to: f64::from(k + 1) / f64::from(count),
            weight,
        })
    };
    strips.iter().enumerate().flat_map(of).collect()
}

/// What the colours mean.
fn captions(field: &Field, scale: &Scale, heat: bool) -> Vec<String> {
    let unit = if heat { " W/m²" } else { "" };
    let mut captions = vec![format!(
        "Walls: radiosity u{}. Between them: mean radiosity in view, (1/2π) ∫ u dω over all \
         directions; the fluence is π times that.",
        if heat {
            "; a black body at the kelvins beside it sends out as much"
        } else {
            ", in the unit of the emission"
        }
    )];
    let largest = field.walls.iter().map(|spot| spot.value);
    let largest = largest.fold(f64::NEG_INFINITY, f64::max);
    if largest > scale.high() {
        captions.push(format!(
            "The scale ends at what is brightest between the walls; walls go up to {}{unit}.",
            short(largest)
        ));
    }
    captions
}

/// What every pixel of the room sees.
fn csv(grid: &Grid, air: &[Spot]) -> Result<Vec<u8>, Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(["x", "y", "seen", "std_error"])
        .map_err(Failure::run)?;
    for (number, spot) in air.iter().enumerate() {
        if spot.value.is_nan() {
            continue;
        }
        let [x, y] = grid.middle(number % grid.width, number / grid.width);
        writer
            .write_record([x, y, spot.value, spot.error].map(number_or_nothing))
            .map_err(Failure::run)?;
    }
    writer.into_inner().map_err(Failure::run)
}

/// An empty field for what is not known.
fn number_or_nothing(value: f64) -> String {
    if value.is_nan() {
        String::new()
    } else {
        format!("{value}")
    }
}

impl Summary {
    fn text(&self, json: bool) -> Result<String, Failure> {
        if json {
            let mut text = serde_json::to_string_pretty(self).map_err(Failure::run)?;
            text.push('\n');
            return Ok(text);
        }
        let mut text = format!(
            "{} x {} pixels, {} within the room; {} cells\nseen between the walls: {} to {}\n",
            self.width,
            self.height,
            self.inside,
            self.cells,
            short(self.least),
            short(self.largest)
        );
        let all = [
            ("preconditioned", Some(self.preconditioned)),
            ("plain", self.plain),
        ];
        for (name, noise) in all {
            let Some(noise) = noise else { continue };
            text.push_str(&format!(
                "{name}: {} walks a pixel, standard error {} in the root mean square, {:.1} s\n",
                noise.walks,
                noise.std_error.map_or("unknown".to_owned(), short),
                noise.seconds
            ));
        }
        Ok(text)
    }
}
