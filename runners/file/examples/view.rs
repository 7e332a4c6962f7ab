//! The error of a picture of a scene file against a long run, beside that of plain walks in the same time.
//!
//! `cargo run --profile dist -p fredholm-file --features measure --example view -- FILE.toml WIDTH LONG X,Y,Z X,Y,Z ANGLE`: WIDTH pixels along
//! both sides, LONG walks a pixel for the long run, and the camera's place, the point in the middle and its angle.

use fredholm::scene::{Beside, Camera, View, ViewRequest};
use fredholm::{Observer, WalkOptions};
use fredholm_file::Resolution;

/// Nobody watches.
struct Nobody;
impl Observer for Nobody {}

type Failed = Box<dyn core::error::Error>;

fn position(text: &str) -> Result<[f64; 3], Failed> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    numbers?.try_into().map_err(|_| "three coordinates".into())
}

/// Root mean square and median of the differences of all pixels.
fn off(view: &View, long: &View) -> [f64; 2] {
    let pairs = view.pixels.iter().zip(&long.pixels);
    let mut all: Vec<f64> = pairs
        .map(|(a, b)| (a.value - b.value).abs())
        .filter(|x| !x.is_nan())
        .collect();
    all.sort_unstable_by(f64::total_cmp);
    let square: f64 = all.iter().map(|x| x * x).sum();
    [(square / all.len() as f64).sqrt(), all[all.len() / 2]]
}

fn main() -> Result<(), Failed> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [file, width, long, from, towards, angle] = args.as_slice() else {
        return Err("FILE.toml WIDTH LONG X,Y,Z X,Y,Z ANGLE".into());
    };
    let resolved = fredholm_file::read(file, &std::fs::read_to_string(file)?)?.resolve()?;
    let Resolution::Scene(scene) = &resolved.model else {
        return Err("this is no scene".into());
    };
    let width = width.parse()?;
    let camera = Camera {
        from: position(from)?,
        towards: position(towards)?,
        angle: angle.parse()?,
        size: [width, width],
    };
    let cut = resolved.settings.discretisation();
    let views = |seed, walks, beside| {
        let walk = WalkOptions {
            seed,
            walks,
            ..resolved.settings.walk_options()
        };
        let request = ViewRequest {
            camera: &camera,
            walk: &walk,
            beside,
        };
        scene.view(&cut, &request, &Nobody, &|| ())
    };
    let (long, _) = views(2, long.parse()?, Beside::Nothing)?;
    let (own, plain) = views(1, 16, Beside::PlainAsLong)?;
    for (name, view) in [("preconditioned", Some(&own)), ("plain", plain.as_ref())] {
        let Some(view) = view else { continue };
        let [square, median] = off(view, &long);
        println!(
            "{name:15} {} walks a pixel, {:.1} s: RMS error {square:.5}, median {median:.5}",
            view.walks, view.seconds
        );
    }
    Ok(())
}
