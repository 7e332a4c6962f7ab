//! View3D decks (`.vs3`): vertices and surfaces with three or four vertices, one a line.
//!
//! `V id x y z`; `S id v1 v2 v3 v4 base cmb emit name`, counter-clockwise seen from its active side, v4 = 0 for a
//! triangle; `O id v1 v2 v3 v4 0 0 emit name` an obstruction, which is not reported; `T` a title, `C encl=1 …` control,
//! `F 3` the format; `!` and `/` begin a comment; `End of data` ends it (Walton, NISTIR 6925, 2002).

use std::collections::HashMap;

use fredholm_scene::Material;

use super::{MAX_POLYGONS, SceneFile, SceneSurface, Words, Wrong, lines};
use crate::deck::CUT_SHORT;

pub(super) fn read(scene: &mut SceneFile, file: u32, text: &str) -> Result<(), Wrong> {
    let mut vertices: HashMap<u64, [f64; 3]> = HashMap::new();
    // The surface of the scene for every number of the deck.
    let mut numbers: HashMap<u64, usize> = HashMap::new();
    let mut names: HashMap<String, u32> = HashMap::new();
    let mut count = 0_usize;
    scene.open = true;
    for mut words in lines(text, &['!', '/']) {
        let key = words.next();
        match key.to_ascii_uppercase().as_str() {
            "T" => {}
            "C" => control(&mut words, scene),
            "F" | "G" => {
                let word = words.word("the format")?;
                if !matches!(word, "3" | "3a" | "3A") {
                    return Err(words.wrong(word, "only decks in three dimensions are read: `F 3`"));
                }
            }
            "V" => {
                let id: u64 = words.parsed("the number of a vertex")?;
                let point = words.point()?;
                if vertices.insert(id, point).is_some() {
                    return Err(words.wrong(key, format_args!("a second vertex {id}")));
                }
            }
            "S" | "O" => {
                count += 1;
                if count > MAX_POLYGONS {
                    return Err(words.wrong(key, format_args!("more than {MAX_POLYGONS} surfaces")));
                }
                surface(
                    &mut words,
                    key,
                    (scene, file),
                    &vertices,
                    &mut numbers,
                    &mut names,
                )?;
            }
            "END" => return Ok(()),
            _ => {
                let message = format_args!(
                    "unknown key {key:?}; known: T, C, F, V, S, O, `End of data`, and `!` or `/` for comments"
                );
                return Err(words.wrong(key, message));
            }
        }
    }
    Err(Wrong::cut_short(text, CUT_SHORT))
}

/// `C encl=1 list=3 …`: only whether it is an enclosure concerns the geometry.
fn control(words: &mut Words<'_>, scene: &mut SceneFile) {
    loop {
        let word = words.next();
        if word.is_empty() {
            return;
        }
        if let Some(value) = word.strip_prefix("encl=") {
            scene.open = value == "0";
        }
    }
}

/// The rest of an `S` or `O` line.
fn surface(
    words: &mut Words<'_>,
    key: &str,
    (scene, file): (&mut SceneFile, u32),
    vertices: &HashMap<u64, [f64; 3]>,
    numbers: &mut HashMap<u64, usize>,
    names: &mut HashMap<String, u32>,
) -> Result<(), Wrong> {
    let id: u64 = words.parsed("the number of a surface")?;
    if numbers.contains_key(&id) {
        return Err(words.wrong(key, format_args!("a second surface {id}")));
    }
    let mut points = Vec::with_capacity(4);
    for k in 0..4 {
        let word = words.word("the number of a vertex")?;
        let vertex: u64 = word.parse().map_err(|_| {
            words.wrong(word, format_args!("{word:?} is not the number of a vertex"))
        })?;
        match vertices.get(&vertex) {
            Some(&point) => points.push(point),
            None if vertex == 0 && k == 3 => {}
            None => {
                return Err(words.wrong(
                    word,
                    format_args!("there is no vertex {vertex} above this line"),
                ));
            }
        }
    }
    let base = words.word("the number `base`")?;
    if base != "0" {
        return Err(words.wrong(
            base,
            "subsurfaces (`base`) are not supported: cut the base surface out",
        ));
    }
    let combine = words.word("the number `cmb`")?;
    let combined: u64 = combine.parse().map_err(|_| {
        words.wrong(
            combine,
            format_args!("{combine:?} is not the number of a surface"),
        )
    })?;
    let emissivity = words.emissivity()?;
    let name = words.name_of(id);
    let at = if combined == 0 {
        if let Some(first) = names.insert(name.clone(), words.line) {
            let message =
                format_args!("a second surface named {name:?}; the first is on line {first}");
            return Err(words.wrong(key, message));
        }
        let mut own = SceneSurface::new(name);
        own.material = Material::grey(emissivity, 0.0);
        scene.surfaces.push(own);
        scene.surfaces.len() - 1
    } else {
        let found = numbers.get(&combined).copied();
        found.ok_or_else(|| {
            words.wrong(
                combine,
                format_args!("there is no surface {combined} above this line to combine with"),
            )
        })?
    };
    numbers.insert(id, at);
    let added = scene.add(at, &points, (file, words.line));
    added.map_err(|message| words.wrong(key, message))
}
