//! `fredholm render`: a picture of a room with its light, or of a scene as a camera sees it.

mod output;
mod profile;
mod view;

use core::ops::Range;
use std::io::Write;
use std::path::Path;

use fredholm::channels::columns;
use fredholm::numbers::short;
use fredholm::room::{Field, FieldRequest, RoomModel, Spot, Stretch};
use fredholm::{Error, Goal, Model as _, Pairs, Partitioned, SolveObserver as _, WalkOptions};
use fredholm_file::Resolution;
use fredholm_plot::{Canvas, Panel, Piece, RoomPicture, Scale, Wall, WallDensity, panel_width};
use fredholm_room::{Enclosure, STEFAN_BOLTZMANN, Scene};

use output::{Noise, Summary, table};

use crate::args::RenderArgs;
use crate::failure::{Ended, Failure, say};
use crate::progress::{Progress, Signals};
use crate::solve::{self, Problem};
use crate::threads::with_threads;
use fredholm_parts::output::Output;

/// Walks for a pixel, and for a point of a profile, where nothing else is asked.
const PIXEL_WALKS: u64 = 4;
const PROFILE_WALKS: u64 = 1000;
/// Walks of a whole function, for all pixels together.
const WHOLE_WALKS: u64 = 8192;

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

/// Runs `render`.
pub(crate) fn render(args: &RenderArgs, signals: &Signals) -> Result<Ended, Failure> {
    let format = Format::of(&args.out)?;
    if format == Format::Csv && (args.side_by_side || args.log || args.range.is_some()) {
        return Err(Failure::input(
            "`--log`, `--range` and `--side-by-side` are for pictures: write a .png or .svg",
        ));
    }
    if let Some([low, _]) = args.range.filter(|[low, _]| args.log && *low <= 0.0) {
        return Err(Failure::input(format_args!(
            "`--range`: with `--log` colours must begin above 0, not at {low}"
        )));
    }
    let file = solve::read(&args.file, |_| ())?;
    file.refuse_adjoint()?;
    let problem = Problem::new(file, None)?;
    view::refuse(args, &problem.resolved.model)?;
    let settings = &problem.resolved.settings;
    let cells = solve::cut(&problem.file, problem.model(), settings, &problem.goals)?;
    let walk = settings.walk_options();
    cells
        .check_variance(&walk)
        .map_err(Failure::of(&problem.file))?;
    let output = Output::open("--out", &args.out)?;
    let errors = match &args.errors {
        Some(path) => Some((Format::of(path)?, Output::open("--out", path)?)),
        None => None,
    };
    if matches!(errors, Some((Format::Csv, _))) {
        return Err(Failure::input(
            "`--errors` is a picture: write a .png or .svg",
        ));
    }
    let errors_format = errors.as_ref().map(|(format, _)| *format);
    let work = || match &problem.resolved.model {
        Resolution::Room(room) => {
            Picturing::new(args, &problem, &**room, signals, errors_format).content(&*cells, format)
        }
        Resolution::Scene(scene) => {
            let picturing = Picturing::new(args, &problem, &**scene, signals, errors_format);
            view::content(&picturing, &*cells, format)
        }
        Resolution::Other(_) => Err(Failure::input("pictures are of rooms and scenes").into()),
    };
    let (content, error_map, text) = match with_threads(args.common.threads, work)? {
        Ok(done) => done,
        Err(Cut::Interrupted) => {
            say("warning: interrupted; no picture was written");
            return Ok(Ended::Interrupted);
        }
        Err(Cut::Failed(failure)) => return Err(failure),
    };
    output.finish(content)?;
    if let Some((_, output)) = errors {
        output.finish(error_map)?;
    }
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(Ended::Done)
}

/// Why there is no picture.
#[derive(Debug)]
enum Cut {
    /// Ctrl-C.
    Interrupted,
    /// Something failed.
    Failed(Failure),
}

impl From<Failure> for Cut {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// What a picture is made of.
struct Picturing<'a, M> {
    args: &'a RenderArgs,
    problem: &'a Problem,
    model: &'a M,
    signals: &'a Signals,
    /// The format of the picture of the standard errors.
    errors: Option<Format>,
}

/// What goes into the file, what goes into that of the errors, and what is said of them.
type Content = (Vec<u8>, Vec<u8>, String);

impl<'a, M> Picturing<'a, M> {
    const fn new(
        args: &'a RenderArgs,
        problem: &'a Problem,
        model: &'a M,
        signals: &'a Signals,
        errors: Option<Format>,
    ) -> Self {
        Self {
            args,
            problem,
            model,
            signals,
            errors,
        }
    }

    /// Walks for each place, or of a whole function.
    fn walks(&self, each: u64) -> u64 {
        let default = if self.args.whole { WHOLE_WALKS } else { each };
        self.args.walks.unwrap_or(default)
    }

    /// The progress of that many walks for each of so many places.
    fn progress(&self, walks: u64, places: u64) -> Progress<'_> {
        let places = if self.args.whole { 1 } else { places };
        Progress::new(walks.saturating_mul(places), self.signals)
    }

    fn walk(&self) -> WalkOptions {
        self.problem.resolved.settings.walk_options()
    }

    /// What was wrong, unless it was interrupted.
    fn cut(&self, error: Error) -> Cut {
        match error {
            Error::Cancelled => Cut::Interrupted,
            error => Cut::Failed(Failure::of(&self.problem.file)(error)),
        }
    }
}

impl Picturing<'_, RoomModel> {
    fn field(
        &self,
        request: &FieldRequest<'_>,
        progress: &Progress<'_>,
    ) -> Result<(Field, Option<Field>), Cut> {
        let cut = self.problem.resolved.settings.discretisation();
        let walking = || progress.walking();
        let fields = if self.args.whole {
            let field = self.model.whole_field(&cut, request, progress, &walking);
            field.map(|field| (field, None))
        } else {
            self.model.field(&cut, request, progress, &walking)
        };
        fields.map_err(|error| self.cut(error))
    }

    fn content(&self, cells: &dyn Partitioned<'_>, format: Format) -> Result<Content, Cut> {
        if self.args.profile {
            profile::content(self, cells, format)
        } else {
            picture(self, cells, format)
        }
    }
}

/// The piece of a wall as a stretch of it.
fn stretch(piece: &Piece) -> Stretch {
    Stretch {
        wall: piece.wall,
        middle: piece.middle(),
        weight: piece.pixels,
    }
}

/// The root mean square of those that are numbers.
fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values
        .filter(|value| value.is_finite())
        .fold((0_u64, 0.0), |(n, sum), x| (n + 1, sum + x * x));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

fn picture(
    picturing: &Picturing<'_, RoomModel>,
    cells: &dyn Partitioned<'_>,
    format: Format,
) -> Result<Content, Cut> {
    let args = picturing.args;
    let (surfaces, scene) = (picturing.model.surfaces(), picturing.model.scene());
    let settings = &picturing.problem.resolved.settings;
    if args.radiant_temperature && !surfaces.heat {
        let message = "`--radiant-temperature` is for rooms by temperature";
        return Err(Failure::input(message).into());
    }
    // Of heat the scale has temperatures beside radiosities.
    let heat = surfaces.heat && !args.radiant_temperature;
    let canvas = canvas(args, scene, heat, format)?;
    let pieces = canvas.pieces();
    let walks = picturing.walks(PIXEL_WALKS);
    let weights: u64 = pieces.iter().map(|piece| piece.pixels).sum();
    let pixels = canvas.width() * canvas.height();
    let progress = picturing.progress(walks, pixels as u64 + weights);
    let positions: Vec<[f64; 2]> = (0..pixels).map(|number| canvas.middle(number)).collect();
    let stretches: Vec<Stretch> = pieces.iter().map(stretch).collect();
    let walk = WalkOptions {
        walks,
        // No rare large scores, which would be dots. Colours have rays alone.
        pairs: Pairs::Pointwise,
        ..picturing.walk()
    };
    let request = FieldRequest {
        positions: &positions,
        stretches: &stretches,
        walk: &walk,
        goals: &[],
        beside_plain: args.side_by_side,
    };
    let fields = picturing.field(&request, &progress);
    progress.done();
    let (mut field, mut plain) = fields?;
    if args.radiant_temperature {
        field = field.temperatures();
        plain = plain.map(|plain| plain.temperatures());
    }
    let seen = || field.air.iter().map(|spot| spot.value);
    let mut summary = Summary {
        width: canvas.width(),
        height: canvas.height(),
        origin: None,
        scale: None,
        whole: args.whole,
        is_view: false,
        inside: seen().filter(|value| !value.is_nan()).count(),
        cells: cells.unknowns() / (settings.discretisation().degree + 1),
        least: seen().fold(f64::INFINITY, f64::min),
        largest: seen().fold(f64::NEG_INFINITY, f64::max),
        preconditioned: Noise::of(&field),
        plain: plain.as_ref().map(Noise::of),
    };
    if format == Format::Csv {
        let text = summary.text(args.common.json)?;
        let name = if args.radiant_temperature {
            "mean_radiant_temperature"
        } else {
            "seen"
        };
        let inside = (0..pixels).filter(|&number| !field.air[number].value.is_nan());
        let rows = inside.map(|number| (canvas.middle(number), field.numbers(number)));
        let names = columns(picturing.model.channels(), name);
        return Ok((table(["x", "y"], names, rows)?, Vec::new(), text));
    }
    let shown = Shown::of(&field, picturing);
    let of_walls = shown.walls.iter().copied();
    let given = args
        .range
        .and_then(|[low, high]| Scale::between(low, high, args.log));
    // Ten errors, so that most of the colours are no noise.
    let noise = 10.0 * summary.preconditioned.std_error.unwrap_or(0.0);
    let own = || Scale::within(seen(), noise).filter(|_| !args.log);
    let scale = match shown.colours {
        Some(_) => Scale::of_view(&shown.air, args.range, false, false),
        None => given
            .or_else(own)
            .unwrap_or_else(|| Scale::new(seen(), of_walls, args.log)),
    };
    let picture = RoomPicture {
        canvas: &canvas,
        pieces: &pieces,
        scale,
        legend: match picturing.model.channels().last() {
            Some(sum) => sum,
            _ if heat => "W/m²",
            _ if args.radiant_temperature => "K",
            _ => "u",
        },
        stefan_boltzmann: heat.then_some(STEFAN_BOLTZMANN),
        captions: captions(&field, &scale, args, [heat, shown.colours.is_some()]),
        width: Some(usize::from(args.width)),
        unit: Some(if surfaces.heat { "m" } else { "" }),
        names: &names(picturing.model),
        marks: &marks(picturing),
    };
    let heading = |name: &str, field: &Field| {
        let plural = if field.walks == 1 { "" } else { "s" };
        format!(
            "{name}: {} walk{plural} a pixel, {:.1} s",
            field.walks, field.seconds
        )
    };
    let mut panels = Vec::new();
    let beside = plain
        .as_ref()
        .map(|plain| (Shown::of(plain, picturing), plain));
    if let Some((shown, plain)) = &beside {
        panels.push(shown.panel(Some(heading("plain", plain))));
    }
    panels.push(shown.panel(beside.as_ref().map(|_| heading("preconditioned", &field))));
    summary.origin = Some(picture.origin(args.side_by_side));
    summary.scale = Some([scale.low(), scale.high()]);
    let text = summary.text(args.common.json)?;
    let errors = match picturing.errors {
        Some(format) => error_map(&picture, &field, args.whole, format)?,
        None => Vec::new(),
    };
    Ok((drawn(&picture, &panels, format)?, errors, text))
}

fn drawn(
    picture: &RoomPicture<'_>,
    panels: &[Panel<'_>],
    format: Format,
) -> Result<Vec<u8>, Failure> {
    match format {
        Format::Svg => Ok(picture.svg(panels).map_err(Failure::run)?.into_bytes()),
        _ => picture.png(panels).map_err(Failure::run),
    }
}

/// The same picture of the standard errors.
fn error_map(
    picture: &RoomPicture<'_>,
    field: &Field,
    is_whole: bool,
    format: Format,
) -> Result<Vec<u8>, Failure> {
    let errors = |spots: &[Spot]| spots.iter().map(|spot| spot.error).collect();
    let shown = Shown {
        air: errors(&field.air),
        walls: errors(&field.walls),
        colours: None,
    };
    let picture = RoomPicture {
        scale: Scale::new(shown.air.iter().copied(), shown.walls.iter().copied(), true),
        legend: "error",
        stefan_boltzmann: None,
        captions: vec![error_caption(field.walks, is_whole)],
        ..picture.clone()
    };
    drawn(&picture, &[shown.panel(None)], format)
}

/// What a picture of standard errors shows.
fn error_caption(walks: u64, is_whole: bool) -> String {
    let each = if is_whole { "for all of it" } else { "a pixel" };
    format!("Standard errors of the picture, from {walks} walks {each}.")
}

/// The pixels: of a picture as wide as asked for, or over the room where their numbers are wanted.
fn canvas(args: &RenderArgs, scene: &Scene, heat: bool, format: Format) -> Result<Canvas, Failure> {
    let (walls, width) = (walls(scene), usize::from(args.width));
    // Light leaves an open room, and some of it is shown.
    let around = |across: usize| match scene.enclosure() {
        Enclosure::Closed => 2,
        Enclosure::Open => across / 12 + 2,
    };
    let thickness = |across: usize| (across as f64 / 130.0).max(3.0);
    if format == Format::Csv {
        return Canvas::new(&walls, width, around(width), thickness(width)).map_err(Failure::run);
    }
    let panels = if args.side_by_side { 2 } else { 1 };
    let own = |width: usize| panel_width(&walls, width, panels, heat);
    let Some(across) = own(width) else {
        let least = (width..).find(|&width| own(width).is_some());
        return Err(Failure::input(format_args!(
            "`--width {width}`: with its axes and colours this picture is at least {} pixels wide",
            least.unwrap_or(usize::MAX)
        )));
    };
    Canvas::fitting(&walls, across, around(across), thickness(across)).map_err(Failure::run)
}

/// The names of surfaces, and their walls.
fn names(room: &RoomModel) -> Vec<(String, Range<usize>)> {
    let all = room.surfaces().names.iter().enumerate();
    all.map(|(surface, name)| {
        let walls = room.scene().walls_of(surface).unwrap_or(0..0);
        (name.clone(), walls)
    })
    .collect()
}

/// The places of targets with their names; points of one target among others have none.
fn marks(picturing: &Picturing<'_, RoomModel>) -> Vec<(String, [f64; 2])> {
    let Problem { file, goals, .. } = picturing.problem;
    let goals = goals.iter().filter(|_| picturing.args.targets);
    let mark = |goal: &Goal| {
        let name = goal.target(picturing.model)?;
        let is_alone = file.targets.iter().any(|of| of.name.value == name);
        let place = picturing.model.in_drawing(&goal.region)?;
        Some((
            if is_alone {
                name.to_owned()
            } else {
                String::new()
            },
            place,
        ))
    };
    goals.filter_map(mark).collect()
}

/// What a picture shows of a field.
struct Shown {
    air: Vec<f64>,
    walls: Vec<f64>,
    /// Red, green and blue of both.
    colours: Option<[[Vec<f64>; 3]; 2]>,
}

impl Shown {
    fn of(field: &Field, picturing: &Picturing<'_, RoomModel>) -> Self {
        let values = |spots: &[Spot]| spots.iter().map(|spot| spot.value).collect();
        let colours = field.colours(picturing.model);
        Self {
            air: values(&field.air),
            walls: values(&field.walls),
            colours: colours.filter(|_| !picturing.args.log),
        }
    }

    fn panel(&self, heading: Option<String>) -> Panel<'_> {
        Panel {
            heading,
            air: &self.air,
            walls: &self.walls,
            colours: self.colours.as_ref(),
        }
    }
}

/// The walls as they are drawn.
fn walls(scene: &Scene) -> Vec<Wall> {
    let of = |wall: &fredholm_room::Wall<f64>| Wall {
        vertices: wall.vertices,
        ends: wall.ends,
    };
    scene.geometry().walls().iter().map(of).collect()
}

/// A room whose walls have the colour of a density: pieces by wall, place in fractions of it, and value.
pub(crate) fn shares(
    room: &RoomModel,
    values: &[(usize, [f64; 2], f64)],
) -> Result<String, Failure> {
    let density = WallDensity {
        walls: &walls(room.scene()),
        values,
        names: &names(room),
        caption: "Where the variance of preconditioned walks comes from: the share of each place, by steps that \
            start there and by the difference of the sources, over its share of all walls (1: the mean).",
    };
    density.svg().map_err(Failure::run)
}

/// What the colours mean.
fn captions(
    field: &Field,
    scale: &Scale,
    args: &RenderArgs,
    [heat, in_colours]: [bool; 2],
) -> Vec<String> {
    let (of_walls, unit) = match (heat, args.radiant_temperature) {
        _ if in_colours => (
            " in the colour of its light (sRGB), as bright as the scale says, and no brighter than its end",
            "",
        ),
        (true, _) => (
            ", left scale and lines: temperature of a black body with this radiosity",
            " W/m²",
        ),
        (_, true) => ("", " K"),
        _ => (", in the unit of the emission", ""),
    };
    let mut captions = vec![if args.radiant_temperature {
        "Walls: temperature of a black body with their radiosity. Between them: mean radiant temperature.".to_owned()
    } else {
        format!(
            "Walls: radiosity u{of_walls}. Between them: mean radiosity in view, (1/2π) ∫ u dω over all \
             directions; the fluence is π times that."
        )
    }];
    let walls = || field.walls.iter().map(|spot| spot.value);
    let (least, largest) = (
        short(walls().fold(f64::INFINITY, f64::min)),
        short(walls().fold(f64::NEG_INFINITY, f64::max)),
    );
    let [low, high] = [scale.low(), scale.high()];
    if args.range.is_some() {
        captions.push(format!(
            "The scale is from {} to {}{unit}, as asked for; what is beyond has the colours of its ends.",
            short(low),
            short(high)
        ));
    } else if walls().any(|u| u < low || u > high) {
        captions.push(format!(
            "The scale is that of most of what is seen between the walls; walls go from {least} to {largest}{unit}."
        ));
    }
    captions
}
