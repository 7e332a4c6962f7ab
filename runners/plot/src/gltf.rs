//! Meshes with colours, as viewers of glTF 2.0 show them.
//!
//! The crates for glTF describe all of its JSON, and take the compiler as long as the rest of this one; what is written here is one
//! object of that.

use serde_json::{Value, json};

use crate::mesh::{Cell, Mesh};
use crate::{Error, Scale};

/// The numbers that glTF has from OpenGL: of types, and of what a part of the buffer is for.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

impl Mesh {
    /// The bytes of a `.glb` file, binary glTF 2.0: triangles and quadrilaterals in the colours of the first quantity, of points if
    /// there is one, or else of cells. z points upwards.
    ///
    /// Colours go from a fiftieth of the numbers to all but a fiftieth: a lamp may be brighter than all else. What has no number is
    /// black. The numbers themselves are attributes of vertices, each by its name behind `_`, in single precision; `extras.values` of the
    /// primitive says whether they are of `points` or of `cells`. No two cells share a vertex.
    ///
    /// ```
    /// use fredholm_plot::{Cell, Mesh, Quantity};
    ///
    /// let mesh = Mesh {
    ///     points: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    ///     cells: vec![Cell::Triangle([0, 1, 2])],
    ///     on_points: vec![Quantity { name: "u".to_owned(), numbers: vec![0.5, 1.0, 2.0] }],
    ///     on_cells: Vec::new(),
    /// };
    /// assert_eq!(&mesh.glb()?[..4], b"glTF");
    /// # Ok::<(), fredholm_plot::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: no cell has an area. [`Error::NoSuchPoint`], [`Error::WrongLength`], [`Error::TooLarge`]: more than
    /// four gigabytes.
    pub fn glb(&self) -> Result<Vec<u8>, Error> {
        self.check()?;
        let (of_points, of_cells) = (self.on_points.first(), self.on_cells.first());
        let numbers = of_points
            .or(of_cells)
            .map_or(&[][..], |own| &own.numbers[..]);
        let scale = Scale::within(numbers.iter().copied(), 0.0);
        let shown = match of_points {
            Some(_) => &self.on_points,
            None => &self.on_cells,
        };
        let mut values: Vec<Vec<f32>> = vec![Vec::new(); shown.len()];
        let (mut places, mut colours, mut corners) = (Vec::new(), Vec::new(), Vec::new());
        for (number, cell) in self.cells.iter().enumerate() {
            if !matches!(cell, Cell::Triangle(_) | Cell::Quad(_)) {
                continue;
            }
            let first = places.len() as u32;
            for &corner in cell.corners() {
                let of = if of_points.is_some() { corner } else { number };
                places.push(self.points[corner].map(|x| x as f32));
                colours.push(linear(scale, numbers.get(of).copied()));
                for (values, own) in values.iter_mut().zip(shown) {
                    values.push(own.numbers.get(of).map_or(f32::NAN, |x| *x as f32));
                }
            }
            // The triangles that go around the cell.
            for k in 2..cell.corners().len() as u32 {
                corners.extend([first, first + k - 1, first + k]);
            }
        }
        if corners.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let floats = |all: &[[f32; 3]]| -> Vec<u8> {
            let all = all.iter().flatten();
            all.flat_map(|x| x.to_le_bytes()).collect()
        };
        let indices = corners.iter().flat_map(|i| i.to_le_bytes()).collect();
        let mut parts = vec![floats(&places), floats(&colours), indices];
        for values in &values {
            parts.push(values.iter().flat_map(|x| x.to_le_bytes()).collect());
        }
        let names: Vec<&str> = shown.iter().map(|own| &*own.name).collect();
        let lengths: Vec<usize> = parts.iter().map(Vec::len).collect();
        let mut json = description(&places, &lengths, (&names, of_points.is_some())).to_string();
        // Chunks are multiples of four bytes.
        while !json.len().is_multiple_of(4) {
            json.push(' ');
        }
        let body = parts.concat();
        let word = |n: usize| u32::try_from(n).map_err(|_| Error::TooLarge);
        let mut file = b"glTF".to_vec();
        for n in [2, 28 + json.len() + body.len(), json.len()] {
            file.extend(word(n)?.to_le_bytes());
        }
        file.extend(b"JSON");
        file.extend(json.into_bytes());
        file.extend(word(body.len())?.to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(body);
        Ok(file)
    }
}

/// The colour of a number in linear light, as glTF has colours of vertices.
fn linear(scale: Option<Scale>, number: Option<f64>) -> [f32; 3] {
    let Some(number) = number.filter(|number| !number.is_nan()) else {
        return [0.0; 3];
    };
    // One number has one colour.
    let colour = scale.map_or([188; 3], |scale| scale.colour(number));
    colour.map(|level| {
        let encoded = f32::from(level) / 255.0;
        // IEC 61966-2-1, sRGB.
        if encoded <= 0.040_45 {
            encoded / 12.92
        } else {
            ((encoded + 0.055) / 1.055).powf(2.4)
        }
    })
}

/// What a viewer reads first: the parts of the buffer, which are the places and colours of vertices, the corners of triangles and the numbers of
/// these names, and have these lengths in bytes.
fn description(
    vertices: &[[f32; 3]],
    lengths: &[usize],
    (names, are_of_points): (&[&str], bool),
) -> Value {
    let end = |pick: fn(f32, f32) -> f32| {
        let all = vertices.iter().copied();
        all.reduce(|a, b| [0, 1, 2].map(|k| pick(a[k], b[k])))
    };
    let triples = |view: usize| json!({"bufferView": view, "componentType": FLOAT, "type": "VEC3", "count": vertices.len()});
    let mut positions = triples(0);
    positions["min"] = json!(end(f32::min));
    positions["max"] = json!(end(f32::max));
    let mut views: Vec<Value> = Vec::new();
    let mut end_of_views = 0;
    for (number, &length) in lengths.iter().enumerate() {
        let target = match number {
            2 => ELEMENT_ARRAY_BUFFER,
            _ => ARRAY_BUFFER,
        };
        views.push(json!({"buffer": 0, "byteOffset": end_of_views, "byteLength": length, "target": target}));
        end_of_views += length;
    }
    let scalars = |view: usize, of: u32, bytes: usize| json!({"bufferView": view, "componentType": of, "type": "SCALAR", "count": bytes / 4});
    let corners = lengths.get(2).map_or(0, |bytes| *bytes);
    let mut accessors = vec![positions, triples(1), scalars(2, UNSIGNED_INT, corners)];
    let mut attributes = json!({"POSITION": 0, "COLOR_0": 1});
    for (number, name) in (3..).zip(names) {
        accessors.push(scalars(number, FLOAT, 4 * vertices.len()));
        attributes[format!("_{name}")] = json!(number);
    }
    let turn = core::f64::consts::FRAC_1_SQRT_2;
    json!({
        "asset": {"version": "2.0", "generator": "fredholm"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        // From z to y, which points upwards in glTF.
        "nodes": [{"mesh": 0, "rotation": [-turn, 0, 0, turn]}],
        "meshes": [{"primitives": [{
            "attributes": attributes,
            "indices": 2,
            "material": 0,
            "extras": {"values": if are_of_points { "points" } else { "cells" }},
        }]}],
        "materials": [{"doubleSided": true, "extensions": {"KHR_materials_unlit": {}}}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": end_of_views}],
    })
}

#[cfg(test)]
mod tests {
    use crate::{Cell, Error, Mesh, Quantity};

    /// The chunks of a file, by the format's lengths.
    fn chunks(file: &[u8]) -> (String, Vec<u8>) {
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(
            (&file[..4], word(4), word(8)),
            (&b"glTF"[..], 2, file.len())
        );
        let json = word(12);
        assert_eq!((&file[16..20], json % 4), (&b"JSON"[..], 0));
        let body = 20 + json;
        assert_eq!(
            (&file[body + 4..body + 8], word(body)),
            (&b"BIN\0"[..], file.len() - body - 8)
        );
        let text = String::from_utf8(file[20..body].to_vec()).unwrap();
        (text, file[body + 8..].to_vec())
    }

    /// A triangle and a square beside it, in two colours of their own.
    #[test]
    fn cells_have_the_colours_of_their_numbers() {
        let mesh = Mesh {
            points: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
                .map(|[x, y]| [x, y, 2.0])
                .to_vec(),
            cells: vec![Cell::Triangle([0, 1, 2]), Cell::Quad([0, 1, 3, 2])],
            on_points: Vec::new(),
            on_cells: vec![Quantity {
                name: "u".to_owned(),
                numbers: vec![1.0, 3.0],
            }],
        };
        let (json, body) = chunks(&mesh.glb().unwrap());
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let accessors = &json["accessors"];
        assert_eq!(accessors[0]["count"], 7);
        assert_eq!(accessors[0]["min"], serde_json::json!([0.0, 0.0, 2.0]));
        assert_eq!(accessors[0]["max"], serde_json::json!([1.0, 1.0, 2.0]));
        assert_eq!(accessors[2]["count"], 9);
        let floats: Vec<f32> = body[..2 * 7 * 12]
            .chunks_exact(4)
            .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
            .collect();
        assert_eq!(floats[..6], [0.0, 0.0, 2.0, 1.0, 0.0, 2.0]);
        let colours: Vec<&[f32]> = floats[21..].chunks_exact(3).collect();
        assert!(colours[..3].iter().all(|colour| *colour == colours[0]));
        assert!(colours[3..].iter().all(|colour| *colour == colours[6]));
        assert!(colours[0].iter().sum::<f32>() < 0.1 && colours[6].iter().sum::<f32>() > 1.0);
        let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
        assert_eq!(
            (&attributes["_u"], &accessors[3]["count"]),
            (&3.into(), &7.into())
        );
        let (indices, values) = body[2 * 7 * 12..].split_at(9 * 4);
        let values: Vec<f32> = values
            .chunks_exact(4)
            .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
            .collect();
        assert_eq!(values, [1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 3.0]);
        let corners: Vec<u32> = indices
            .chunks_exact(4)
            .map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap()))
            .collect();
        assert_eq!(corners, [0, 1, 2, 3, 4, 5, 3, 5, 6]);
        let unsuited = Mesh {
            cells: vec![Cell::Line([0, 1])],
            ..mesh.clone()
        };
        let wrong = Error::unless_equal("cells", 1, 2).unwrap_err();
        assert_eq!(unsuited.glb(), Err(wrong));
        let flat = Mesh {
            on_cells: Vec::new(),
            ..unsuited
        };
        assert_eq!(flat.glb(), Err(Error::NothingToDraw));
    }
}
