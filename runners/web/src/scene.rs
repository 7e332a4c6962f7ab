//! Scenes in space: their faces, and form factors of one of them.

use std::path::Path;

use fredholm_factors::Sights;
use fredholm_file::scene::{SceneFile, is_mesh, parse_description, read};
use serde_json::json;
use wasm_bindgen::prelude::*;

use crate::{json_of, text_of, wrong};

fn file(name: &str) -> Result<SceneFile, JsError> {
    if is_mesh(Path::new(name)) {
        let mut mesh = read(Path::new(name)).map_err(wrong)?;
        // A mesh says nothing of that, and is looked at alone.
        mesh.open = true;
        return Ok(mesh);
    }
    parse_description(name, &text_of(name)?).map_err(wrong)
}

/// The names of a scene's surfaces, reflectance and emission of each, and of every face the number of its surface and its corners.
///
/// # Errors
/// What the program would say.
#[wasm_bindgen]
pub fn faces(name: &str) -> Result<String, JsError> {
    let file = file(name)?;
    let scene = file.scene::<f64>().map_err(wrong)?;
    let names: Vec<&str> = file.surfaces.iter().map(|s| s.name.as_str()).collect();
    let faces = scene.faces().iter().enumerate();
    let faces = faces.map(|(number, face)| {
        let surface = scene.place(number).map(|place| place.surface);
        json!({ "surface": surface, "corners": face.polygon() })
    });
    let materials = file.surfaces.iter().map(|s| s.material);
    let materials = materials.map(|material| [material.reflectance, material.emission]);
    json_of(&json!({
        "names": names,
        "materials": materials.collect::<Vec<_>>(),
        "faces": faces.collect::<Vec<_>>(),
    }))
}

/// The form factors from a face to all faces, to this error behind obstacles.
///
/// # Errors
/// What the program would say.
#[wasm_bindgen]
pub fn factors(name: &str, face: usize, error: f64) -> Result<Vec<f64>, JsError> {
    let scene = file(name)?.scene::<f64>().map_err(wrong)?;
    let sights = Sights::new(&scene, error).map_err(wrong)?;
    let own = scene.faces().get(face);
    let own = own.ok_or_else(|| wrong(format_args!("there is no face {face}")))?;
    let mut factors = vec![0.0; scene.faces().len()];
    for (to, exchange) in sights.whole_row(face).entries {
        factors[to as usize] = exchange / own.area;
    }
    Ok(factors)
}
