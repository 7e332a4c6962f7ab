//! Wavefront OBJ: vertices and faces of groups, with names of materials.
//!
//! `v x y z`, `f 1 2 3` or `f 1/2/3 …`, numbers below 0 from the end; `g` or `o` begins a group, `usemtl` names a
//! material, `#` begins a comment, `\` at the end goes on in the next line; normals, textures, smoothing, lines and
//! points are no part of a scene. A surface is a group, or a material, or, if a group has several, both.

use std::collections::HashMap;

use super::{MAX_POLYGONS, SceneFile, SceneSurface, Words, Wrong, lines};

/// Keys that say nothing about geometry.
const IGNORED: [&str; 19] = [
    "vn",
    "vt",
    "vp",
    "s",
    "l",
    "p",
    "mtllib",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "cstype",
    "deg",
    "surf",
    "parm",
    "end",
];

pub(super) fn read(scene: &mut SceneFile, file: u32, text: &str) -> Result<(), Wrong> {
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let (mut group, mut material) = (String::new(), String::new());
    // Group and material of every surface.
    let mut keys: Vec<(String, String)> = Vec::new();
    let mut known: HashMap<(String, String), usize> = HashMap::new();
    let mut current: Option<usize> = None;
    let mut points = Vec::new();
    let mut count = 0_usize;
    for mut words in lines(text, &['#']) {
        let key = words.next();
        match key {
            "v" => vertices.push(words.point()?),
            "g" | "o" => {
                group = words.name();
                current = None;
            }
            "usemtl" => {
                material = words.name();
                current = None;
            }
            "f" => {
                count += 1;
                if count > MAX_POLYGONS {
                    return Err(words.wrong(key, format_args!("more than {MAX_POLYGONS} faces")));
                }
                points.clear();
                corners(&mut words, &vertices, &mut points)?;
                let surface = *current.get_or_insert_with(|| {
                    let key = (group.clone(), material.clone());
                    *known.entry(key.clone()).or_insert_with(|| {
                        keys.push(key);
                        scene.surfaces.push(SceneSurface::new(""));
                        keys.len() - 1
                    })
                });
                let added = scene.add(surface, &points, (file, words.line));
                added.map_err(|message| words.wrong(key, message))?;
            }
            _ if IGNORED.contains(&key) => {}
            _ => {
                let message = format_args!(
                    "unknown key {key:?} of an OBJ file; `v`, `f`, `g`, `o`, `usemtl` are read"
                );
                return Err(words.wrong(key, message));
            }
        }
    }
    for (surface, (group, material)) in scene.surfaces.iter_mut().zip(&keys) {
        let others = |of: &(String, String)| of.0 == *group && of.1 != *material;
        surface.name = match (group.is_empty(), material.is_empty()) {
            (true, true) => "surface".to_owned(),
            (true, false) => material.clone(),
            (false, true) => group.clone(),
            (false, false) if keys.iter().any(others) => format!("{group}/{material}"),
            (false, false) => group.clone(),
        };
    }
    Ok(())
}

/// The vertices of a face.
fn corners(
    words: &mut Words<'_>,
    vertices: &[[f64; 3]],
    points: &mut Vec<[f64; 3]>,
) -> Result<(), Wrong> {
    loop {
        let word = words.next();
        if word.is_empty() {
            return Ok(());
        }
        let number = word.split('/').next().unwrap_or(word);
        let parsed: Result<i64, _> = number.parse();
        let at = match parsed {
            Ok(n) if n > 0 => usize::try_from(n - 1).ok(),
            Ok(n) if n < 0 => usize::try_from(n.unsigned_abs())
                .ok()
                .and_then(|n| vertices.len().checked_sub(n)),
            _ => {
                return Err(words.wrong(
                    word,
                    format_args!(
                        "{word:?} is not the number of a vertex, from 1, or from -1 backwards"
                    ),
                ));
            }
        };
        let Some(&point) = at.and_then(|at| vertices.get(at)) else {
            let message = format_args!(
                "there is no vertex {number}: {} stand above this line",
                vertices.len()
            );
            return Err(words.wrong(word, message));
        };
        points.push(point);
    }
}
