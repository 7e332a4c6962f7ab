//! STL, as text and as bytes: triangles, each with its own vertices.
//!
//! A file is of bytes if it is as long as its number of triangles says, whatever it begins with: many such files begin
//! with `solid`. Normals are not read; the order of vertices says the active side.

use super::{MAX_POLYGONS, SceneFile, SceneSurface, Wrong, lines, nowhere};
use crate::{InputError, Source};

/// The bytes before the triangles, and of each.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

pub(super) fn read(
    scene: &mut SceneFile,
    file: u32,
    name: &str,
    bytes: &[u8],
) -> Result<(), InputError> {
    let count = bytes
        .get(80..HEADER)
        .and_then(|b| <[u8; 4]>::try_from(b).ok());
    let count = count.map(|b| u32::from_le_bytes(b) as usize);
    let is_binary = count.is_some_and(|n| {
        n.checked_mul(TRIANGLE).and_then(|n| n.checked_add(HEADER)) == Some(bytes.len())
    });
    if is_binary {
        return binary(scene, file, name, bytes);
    }
    let is_text = !bytes.contains(&0)
        && bytes
            .trim_ascii_start()
            .get(..5)
            .is_some_and(|b| b.eq_ignore_ascii_case(b"solid"));
    if !is_text {
        let message = match count {
            Some(count) => format!(
                "this STL file says that it has {count} triangles, {} bytes, and has {} bytes",
                count.saturating_mul(TRIANGLE).saturating_add(HEADER),
                bytes.len()
            ),
            None => format!(
                "an STL file of bytes has at least {HEADER} of them, one of text begins with `solid`"
            ),
        };
        return Err(nowhere(name, message));
    }
    let source = Source {
        name: name.to_owned(),
        text: String::from_utf8_lossy(bytes).into_owned(),
    };
    text(scene, file, &source.text).map_err(|wrong| wrong.at(&source))
}

fn binary(scene: &mut SceneFile, file: u32, name: &str, bytes: &[u8]) -> Result<(), InputError> {
    let triangles = bytes.get(HEADER..).unwrap_or(&[]).chunks_exact(TRIANGLE);
    if triangles.len() > MAX_POLYGONS {
        return Err(nowhere(
            name,
            format_args!("more than {MAX_POLYGONS} triangles"),
        ));
    }
    scene.surfaces.push(SceneSurface::new("solid"));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (number, triangle) in (1..).zip(triangles) {
        let mut points = [[0.0; 3]; 3];
        let numbers = triangle.get(12..48).unwrap_or(&[]).chunks_exact(4);
        let places = points.iter_mut().flatten();
        for (place, bytes) in places.zip(numbers) {
            *place = f64::from(f32::from_le_bytes(bytes.try_into().unwrap_or([0; 4])));
        }
        if !points.iter().flatten().all(|x| x.is_finite()) {
            return Err(nowhere(
                name,
                format_args!("triangle {number} has a coordinate that is no finite number"),
            ));
        }
        for (k, x) in points.iter().flat_map(|p| p.iter().enumerate()) {
            (low[k], high[k]) = (low[k].min(*x), high[k].max(*x));
        }
        let added = scene.add(0, &points, (file, number));
        added.map_err(|message| nowhere(name, format_args!("triangle {number}: {message}")))?;
    }
    scene.remarks.extend(coarse(low, high));
    Ok(())
}

/// The share of a mesh's width from which on steps of its coordinates are told.
const COARSE: f64 = 1e-5;

/// A remark on single precision far from the origin: what is small there has few places that its vertices may be in.
fn coarse(low: [f64; 3], high: [f64; 3]) -> Option<String> {
    let width = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let (furthest, axis) = (0..3)
        .map(|k| (low[k].abs().max(high[k].abs()), ["x", "y", "z"][k]))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let step = f64::from((furthest as f32).next_up()) - f64::from(furthest as f32);
    (step > COARSE * width).then(|| {
        format!(
            "coordinates are in single precision, whose step at {axis} = {furthest} is {step}: vertices are off by up to half of it, \
             and the mesh is {width:.3} wide; export it near the origin, or in a format of text"
        )
    })
}

/// `solid NAME`, `facet normal x y z`, `outer loop`, three times `vertex x y z`, `endloop`, `endfacet`, `endsolid`.
fn text(scene: &mut SceneFile, file: u32, text: &str) -> Result<(), Wrong> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let (mut count, mut inside) = (0_usize, false);
    for mut words in lines(text, &[]) {
        let key = words.next();
        match key.to_ascii_lowercase().as_str() {
            "solid" => {
                let name = words.name();
                let name = if name.is_empty() {
                    "solid".to_owned()
                } else {
                    name
                };
                scene.surfaces.push(SceneSurface::new(name));
                inside = true;
            }
            "facet" => points.clear(),
            "outer" | "endloop" => {}
            "vertex" => {
                points.push(words.point()?);
                if points.len() > 3 {
                    return Err(words.wrong(key, "a facet of an STL file has three vertices"));
                }
            }
            "endfacet" => {
                count += 1;
                if !inside || count > MAX_POLYGONS {
                    return Err(words.wrong(
                        key,
                        format_args!("a facet outside of a `solid`, or more than {MAX_POLYGONS}"),
                    ));
                }
                let last = scene.surfaces.len() - 1;
                let added = scene.add(last, &points, (file, words.line));
                added.map_err(|message| words.wrong(key, message))?;
                points.clear();
            }
            "endsolid" => inside = false,
            _ => return Err(words.wrong(key, format_args!("unknown key {key:?} of an STL file"))),
        }
    }
    if inside {
        let message = "the file is cut short: `endsolid` is missing after this line";
        return Err(Wrong::cut_short(text, message));
    }
    Ok(())
}
