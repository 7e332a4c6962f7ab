//! What a user is told of a scene before its results.

use fredholm_scene::{Covered, Rounding, Scene};

/// The most covered surfaces that are told one by one.
const MOST: usize = 5;

/// A line for every surface that others cover, or for some and the number of the others, one for coordinates that were rounded, and one
/// for what meets backs.
#[must_use]
pub fn notes(names: &[String], scene: &Scene) -> Vec<String> {
    let name = |surface: usize| names.get(surface).map_or("?", String::as_str);
    let line = |part: &Covered| {
        // Nobody means the last digits of a sum.
        let area = (1e6 * part.area).round() / 1e6;
        format!(
            "{:?} is covered by {:?} on an area of {area}, which leaves the scene",
            name(part.surface),
            name(part.by)
        )
    };
    let mut notes: Vec<String> = scene.covered().iter().take(MOST).map(line).collect();
    if scene.covered().len() > MOST {
        let rest = scene.covered().get(MOST..).unwrap_or(&[]);
        let area: f64 = rest.iter().map(|part| part.area).sum();
        notes.push(format!(
            "{} more pairs of surfaces cover each other, on an area of {}",
            rest.len(),
            (1e6 * area).round() / 1e6
        ));
    }
    if scene.shift() != [0.0; 3] {
        let [x, y, z] = scene.shift();
        notes.push(format!(
            "single precision has too few places so far from the origin: walks are in the scene moved by ({x}, {y}, {z}), and results where it was"
        ));
    }
    let precision = scene.precision();
    if precision.rounding != Rounding::Double {
        notes.push(format!(
            "coordinates have {}: neighbouring polygons within {:.1e} of a plane are in one plane",
            precision.rounding,
            scene.flatness()
        ));
    }
    let lost = scene.light_on_backs();
    if lost > 0.0 {
        notes.push(format!(
            "{} % of the light of surfaces, if each were as bright, meets backs of polygons and ends there",
            (1e4 * lost).round() / 1e2
        ));
    }
    notes
}

/// The error for a surface of which nothing is left.
pub(crate) fn without_faces(name: &str) -> String {
    format!("surface {name:?} is covered wholly by others, so that nothing of it is in the scene")
}
