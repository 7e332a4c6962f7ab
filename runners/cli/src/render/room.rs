//! A room with its light and shadows.

use core::ops::Range;

use fredholm::channels::columns;
use fredholm::numbers::short;
use fredholm::room::{Field, FieldRequest, RoomModel, Stretch};
use fredholm::{Goal, Model as _, Pairs, Partitioned, SolveObserver as _, WalkOptions};
use fredholm_plot::{Canvas, Overlay, Panel, Picture, Piece, Scale, Wall, panel_width};
use fredholm_room::{Enclosure, STEFAN_BOLTZMANN, Scene};

use super::output::{Results, Seen, pixels, root_mean_square};
use super::{Content, Cut, Format, Picturing};
use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::solve::Problem;
use crate::table;

/// Walks for a pixel where nothing else is asked.
const WALKS: u64 = 4;

/// What is found at the places of a request, and in the same time by plain walks.
pub(super) fn field(
    picturing: &Picturing<'_>,
    room: &RoomModel,
    request: &FieldRequest<'_>,
    progress: &Progress<'_>,
) -> Result<(Field, Option<Field>), Cut> {
    let cut = picturing.problem.resolved.settings.discretisation();
    let walking = || progress.walking();
    let fields = if picturing.args.global {
        let field = room.whole_field(&cut, request, progress, &walking);
        field.map(|field| (field, None))
    } else {
        room.field(&cut, request, progress, &walking)
    };
    progress.done();
    fields.map_err(|error| picturing.cut(error))
}

/// The pieces of walls as stretches of them.
pub(super) fn stretches(pieces: &[Piece]) -> Vec<Stretch> {
    let stretch = |piece: &Piece| Stretch {
        wall: piece.wall,
        middle: piece.middle(),
        weight: piece.pixels,
    };
    pieces.iter().map(stretch).collect()
}

/// The picture or its numbers, that of the errors, and what is said of them.
pub(super) fn content(
    picturing: &Picturing<'_>,
    room: &RoomModel,
    cells: &dyn Partitioned<'_>,
) -> Result<Content, Cut> {
    let args = picturing.args;
    let is_heat = room.surfaces().heat;
    if args.radiant_temperature && !is_heat {
        let message = "`--radiant-temperature` is for rooms by temperature";
        return Err(Failure::input(message).into());
    }
    // Of heat the scale has temperatures beside radiosities.
    let heat = is_heat && !args.radiant_temperature;
    let is_table = picturing.format == Format::Csv;
    let canvas = canvas(args, room.scene(), heat, is_table)?;
    let (pieces, positions) = (canvas.pieces(), canvas.middles());
    let weights: u64 = pieces.iter().map(|piece| piece.pixels).sum();
    let walk = WalkOptions {
        // No rare large scores, which would be dots. Colours have rays alone.
        pairs: Pairs::Pointwise,
        ..picturing.walk(WALKS)
    };
    let progress = picturing.progress(&walk, positions.len() as u64 + weights);
    let request = FieldRequest {
        positions: &positions,
        stretches: &stretches(&pieces),
        walk: &walk,
        beside: super::beside(args),
    };
    let (mut field, mut plain) = field(picturing, room, &request, &progress)?;
    if args.radiant_temperature {
        field = field.temperatures();
        plain = plain.map(|plain| plain.temperatures());
    }
    let name = match args.radiant_temperature {
        true => "mean_radiant_temperature",
        false => "seen",
    };
    let inside = positions.iter().enumerate();
    let inside = inside.filter(|(number, _)| !field.air[*number].value.is_nan());
    let rows = inside.map(|(number, position)| (*position, field.numbers(number)));
    let csv = is_table.then(|| pixels(["x", "y"], columns(room.channels(), name), rows));
    let csv = csv.transpose()?;
    let seen = |field: Field| Seen {
        blank: f64::NAN,
        light: field.colours(room).filter(|_| !args.log),
        walks: field.walks,
        seconds: field.seconds,
        pixels: field.air,
        walls: field.walls,
    };
    let (seen, plain) = (seen(field), plain.map(seen));
    let scale = scale(&seen, args);
    let (names, marks) = (names(room), marks(picturing, room));
    let legend = match room.channels().last() {
        Some(sum) => sum,
        _ if heat => "W/m²",
        _ if args.radiant_temperature => "K",
        _ => "u",
    };
    let overlay = Overlay {
        pieces: &pieces,
        unit: Some(if is_heat { "m" } else { "" }),
        names: &names,
        marks: &marks,
        ..Overlay::bare(&canvas)
    };
    let results = Results {
        picture: Picture {
            overlay: Some(overlay),
            stefan_boltzmann: heat.then_some(STEFAN_BOLTZMANN),
            captions: captions(&seen, &scale, args, heat),
            width: (!is_table).then_some(usize::from(args.width)),
            ..Picture::new(canvas.size(), scale, legend)
        },
        seen,
        plain,
        cells: cells.unknowns() / (picturing.problem.resolved.settings.discretisation().degree + 1),
        table: csv,
    };
    Ok(results.content(args)?)
}

/// The colours: as asked for, or of what is seen.
fn scale(seen: &Seen, args: &RenderArgs) -> Scale {
    if seen.light.is_some() {
        let values: Vec<f64> = seen.values().collect();
        return Scale::of_view(&values, args.range, false, false);
    }
    let given = args
        .range
        .and_then(|[low, high]| Scale::between(low, high, args.log));
    // Ten errors, so that most of the colours are no noise.
    let noise = 10.0 * root_mean_square(&seen.pixels).unwrap_or(0.0);
    let own = || Scale::within(seen.values(), noise).filter(|_| !args.log);
    let walls = seen.walls.iter().map(|spot| spot.value);
    given
        .or_else(own)
        .unwrap_or_else(|| Scale::new(seen.values(), walls, args.log))
}

/// The pixels: of a picture as wide as asked for, or over the room where their numbers are wanted.
fn canvas(args: &RenderArgs, scene: &Scene, heat: bool, is_table: bool) -> Result<Canvas, Failure> {
    let (walls, width) = (walls(scene), usize::from(args.width));
    // Light leaves an open room, and some of it is shown.
    let around = |across: usize| match scene.enclosure() {
        Enclosure::Closed => 2,
        Enclosure::Open => across / 12 + 2,
    };
    let thickness = |across: usize| (across as f64 / 130.0).max(3.0);
    if is_table {
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
fn marks(picturing: &Picturing<'_>, room: &RoomModel) -> Vec<(String, [f64; 2])> {
    let Problem { file, goals, .. } = picturing.problem;
    let goals = goals.iter().filter(|_| picturing.args.targets);
    let mark = |goal: &Goal| {
        let name = goal.target(room)?;
        let is_alone = file.targets.iter().any(|of| of.name.value == name);
        let place = room.in_drawing(&goal.region)?;
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
    const ACROSS: usize = 700;
    let walls = walls(room.scene());
    let canvas = Canvas::new(&walls, ACROSS, 2, ACROSS as f64 / 50.0).map_err(Failure::run)?;
    let piece = |&(wall, [from, to], _): &(usize, [f64; 2], f64)| Piece {
        wall,
        from,
        to,
        pixels: 1,
    };
    let pieces: Vec<Piece> = values.iter().map(piece).collect();
    let mut density: Vec<f64> = values.iter().map(|&(.., value)| value).collect();
    let mut sorted = density.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    // A few short cells in corners would leave all others in the dark.
    if let Some(&most) = sorted.get(sorted.len() * 199 / 200) {
        density
            .iter_mut()
            .for_each(|value| *value = value.min(most));
    }
    let of_walls = || density.iter().copied();
    let scale = Scale::new(of_walls(), of_walls(), true);
    let caption = "Where the variance of preconditioned walks comes from: the share of each place, by steps that \
                   start there and by the difference of the sources, over its share of all walls (1: the mean).";
    let picture = Picture {
        overlay: Some(Overlay {
            pieces: &pieces,
            unit: Some(""),
            names: &names(room),
            ..Overlay::bare(&canvas)
        }),
        captions: vec![caption.to_owned()],
        ..Picture::new(canvas.size(), scale, "density")
    };
    let [width, height] = canvas.size();
    let panel = Panel {
        pixels: vec![f64::NAN; width * height].into(),
        walls: density.into(),
        ..Panel::default()
    };
    table::drawn(picture.draw(&[panel]))
}

/// What the colours mean.
fn captions(seen: &Seen, scale: &Scale, args: &RenderArgs, heat: bool) -> Vec<String> {
    let (of_walls, unit) = match (heat, args.radiant_temperature) {
        _ if seen.light.is_some() => (
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
    let walls = || seen.walls.iter().map(|spot| spot.value);
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
