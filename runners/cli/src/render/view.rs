//! A scene as a camera sees it.

use fredholm::channels::{colours, columns, numbers};
use fredholm::scene::{Camera, SceneModel, View, ViewRequest};
use fredholm::{Model, Partitioned, SolveObserver as _};
use fredholm_plot::{Picture, Scale};
use fredholm_scene::STEFAN_BOLTZMANN;

use super::output::{Results, Seen, pixels};
use super::{Content, Cut, Format, Picturing};

/// Walks for a pixel where nothing else is asked.
const WALKS: u64 = 16;

/// The picture or its numbers, that of the errors, and what is said of them.
pub(super) fn content(
    picturing: &Picturing<'_>,
    scene: &SceneModel,
    cells: &dyn Partitioned<'_>,
) -> Result<Content, Cut> {
    let args = picturing.args;
    let width = usize::from(args.width);
    let height = args.height.map_or(width * 3 / 4, usize::from);
    let outside = Camera::outside(scene.scene(), [width, height]);
    let camera = Camera {
        from: args.from.unwrap_or(outside.from),
        towards: args.towards.unwrap_or(outside.towards),
        angle: args.angle.unwrap_or(outside.angle),
        ..outside
    };
    let walk = picturing.walk(WALKS);
    let request = ViewRequest {
        camera: &camera,
        walk: &walk,
        beside: super::beside(args),
    };
    let progress = picturing.progress(&walk, (width * height) as u64);
    let cut = picturing.problem.resolved.settings.discretisation();
    let views = scene.view(&cut, &request, &progress, &|| progress.walking());
    progress.done();
    let (view, plain) = views.map_err(|error| picturing.cut(error))?;
    // Of every pixel from the upper left.
    let row = |number| {
        let place = [number % width, number / width].map(|place| place as f64);
        (place, numbers(&view.channels, &view.pixels, number))
    };
    let rows = (0..view.pixels.len()).map(row);
    let is_table = picturing.format == Format::Csv;
    let table =
        is_table.then(|| pixels(["column", "row"], columns(scene.channels(), "seen"), rows));
    let unit = scene.about().unit;
    let heat = unit == Some("W/m2");
    let seen = |view: View| {
        let light = colours(scene.channels(), &view.channels).filter(|_| !args.log);
        Seen {
            // In greys nothing is as dark as no light.
            blank: if heat || args.log { f64::NAN } else { 0.0 },
            light: light.map(|pixels| [pixels, Default::default()]),
            walks: view.walks,
            seconds: view.seconds,
            pixels: view.pixels,
            walls: Vec::new(),
        }
    };
    let table = table.transpose()?;
    let seen_plain = plain.map(seen);
    let seen = seen(view);
    let values: Vec<f64> = seen.values().collect();
    let scale = Scale::of_view(&values, args.range, heat, args.log);
    let legend = match (scene.channels().last(), unit) {
        (Some(sum), _) => sum,
        (None, Some("W/m2")) => "W/m²",
        (None, Some("lm/m2")) => "lm/m²",
        (None, _) => "u",
    };
    let results = Results {
        seen,
        plain: seen_plain,
        picture: Picture {
            stefan_boltzmann: heat.then_some(STEFAN_BOLTZMANN),
            ..Picture::new([width, height], scale, legend)
        },
        cells: cells.cells(),
        table,
    };
    Ok(results.content(args)?)
}
