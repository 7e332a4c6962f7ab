//! A scene as a camera sees it.

use fredholm::SolveObserver as _;
use fredholm::scene::{Camera, SceneModel, View, ViewRequest};
use fredholm::{Model, Partitioned};
use fredholm_file::Resolution;
use fredholm_plot::{Scale, ViewPanel, ViewPicture};
use fredholm_scene::STEFAN_BOLTZMANN;

use super::output::{Noise, Summary, table};
use super::{Content, Cut, Format, Picturing, error_caption};
use crate::args::RenderArgs;
use crate::failure::Failure;

/// Walks for a pixel where nothing else is asked.
const WALKS: u64 = 16;

/// Refuses options of the other kind, and models of which there are no pictures.
pub(super) fn refuse(args: &RenderArgs, model: &Resolution) -> Result<(), Failure> {
    let of_scenes = args.height.is_some() || args.angle.is_some();
    let message = match model {
        Resolution::Room(_) if of_scenes || args.from.or(args.towards).is_some() => {
            "`--height`, `--from`, `--towards` and `--angle` are for cameras: a room in the plane is seen from above"
        }
        Resolution::Scene(_)
            if args.whole || args.profile || args.targets || args.radiant_temperature =>
        {
            "`--whole`, `--profile`, `--targets` and `--radiant-temperature` are for rooms in the plane: `kind = \"room\"`"
        }
        Resolution::Room(room) if args.profile && room.colours().is_some() => {
            "`--profile` has one channel: ask for targets along a surface, a `grid`, which have all"
        }
        Resolution::Other(_) => {
            "pictures are of rooms and scenes; the profile of a circle or of a cube is a target with a `grid`, and \
             `solve --out` draws it"
        }
        _ => return Ok(()),
    };
    Err(Failure::input(format_args!(
        "{}: {message}",
        args.file.display()
    )))
}

/// The picture or its numbers, that of the errors, and what is said of them.
pub(super) fn content(
    picturing: &Picturing<'_, SceneModel>,
    cells: &dyn Partitioned<'_>,
    format: Format,
) -> Result<Content, Cut> {
    let (args, scene) = (picturing.args, picturing.model);
    let width = usize::from(args.width);
    let height = args.height.map_or(width * 3 / 4, usize::from);
    let outside = Camera::outside(scene.scene(), [width, height]);
    let camera = Camera {
        from: args.from.unwrap_or(outside.from),
        towards: args.towards.unwrap_or(outside.towards),
        angle: args.angle.unwrap_or(outside.angle),
        ..outside
    };
    let mut walk = picturing.walk();
    walk.walks = picturing.walks(WALKS);
    let request = ViewRequest {
        camera: &camera,
        walk: &walk,
        beside_plain: args.side_by_side,
    };
    let unit = scene.unit();
    let heat = unit == Some("W/m2");
    let progress = picturing.progress(walk.walks, (width * height) as u64);
    let cut = picturing.problem.resolved.settings.discretisation();
    let views = scene.view(&cut, &request, &progress, &|| progress.walking());
    progress.done();
    let (view, plain) = views.map_err(|error| picturing.cut(error))?;
    // In greys nothing is as dark as no light.
    let blank = if heat || args.log { f64::NAN } else { 0.0 };
    let shown = |value: f64| if value.is_nan() { blank } else { value };
    let values = |view: &View| view.pixels.iter().map(|spot| shown(spot.value)).collect();
    let (seen, beside): (Vec<f64>, Option<Vec<f64>>) = (values(&view), plain.as_ref().map(values));
    let colours = |view: &View| view.colours(scene).filter(|_| !args.log);
    let [of_seen, of_plain] = [colours(&view), plain.as_ref().and_then(colours)];
    let noise = |view: &View| Noise::new(&view.pixels, view.walks, view.seconds);
    let summary = Summary {
        width,
        height,
        origin: None,
        scale: None,
        whole: false,
        is_view: true,
        inside: view
            .pixels
            .iter()
            .filter(|spot| !spot.value.is_nan())
            .count(),
        cells: cells.cells(),
        least: seen.iter().copied().fold(f64::INFINITY, f64::min),
        largest: seen.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        preconditioned: noise(&view),
        plain: plain.as_ref().map(noise),
    };
    let text = summary.text(args.common.json)?;
    if format == Format::Csv {
        // Of every pixel from the upper left.
        let row = |number| {
            let place = [number % width, number / width].map(|place| place as f64);
            (place, view.numbers(number))
        };
        let rows = (0..view.pixels.len()).map(row);
        let content = table(["column", "row"], View::names(scene), rows)?;
        return Ok((content, Vec::new(), text));
    }
    let picture = ViewPicture {
        size: [width, height],
        scale: Scale::of_view(&seen, args.range, heat, args.log),
        legend: match (scene.channels().last(), unit) {
            (Some(sum), _) => sum,
            (None, Some("W/m2")) => "W/m²",
            (None, Some("lm/m2")) => "lm/m²",
            (None, _) => "u",
        },
        stefan_boltzmann: heat.then_some(STEFAN_BOLTZMANN),
        captions: Vec::new(),
    };
    let heading = |name: &str, view: &View| {
        beside.as_ref().map(|_| {
            let plural = if view.walks == 1 { "" } else { "s" };
            let seconds = view.seconds;
            format!(
                "{name}: {} walk{plural} a pixel, {seconds:.1} s",
                view.walks
            )
        })
    };
    let mut panels = Vec::new();
    if let (Some(values), Some(plain)) = (&beside, &plain) {
        let heading = heading("plain", plain);
        panels.push(ViewPanel {
            heading,
            values,
            colours: of_plain.as_ref(),
        });
    }
    panels.push(ViewPanel {
        heading: heading("preconditioned", &view),
        values: &seen,
        colours: of_seen.as_ref(),
    });
    let errors = match picturing.errors {
        Some(format) => error_map(&picture, &view, format)?,
        None => Vec::new(),
    };
    Ok((drawn(&picture, &panels, format)?, errors, text))
}

fn drawn(
    picture: &ViewPicture<'_>,
    panels: &[ViewPanel<'_>],
    format: Format,
) -> Result<Vec<u8>, Failure> {
    match format {
        Format::Svg => Ok(picture.svg(panels).map_err(Failure::run)?.into_bytes()),
        _ => picture.png(panels).map_err(Failure::run),
    }
}

/// The same picture of the standard errors.
fn error_map(picture: &ViewPicture<'_>, view: &View, format: Format) -> Result<Vec<u8>, Failure> {
    let errors: Vec<f64> = view.pixels.iter().map(|spot| spot.error).collect();
    let picture = ViewPicture {
        scale: Scale::new(errors.iter().copied(), [].into_iter(), true),
        legend: "error",
        stefan_boltzmann: None,
        captions: vec![error_caption(view.walks, false)],
        ..picture.clone()
    };
    let panel = ViewPanel {
        heading: None,
        values: &errors,
        colours: None,
    };
    drawn(&picture, &[panel], format)
}
