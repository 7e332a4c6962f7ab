//! Solutions in files of arrays: NumPy's archives, and meshes with values as `meshio`, `PyVista` and this program write
//! them. What comes of each is a table, whose columns have names.

use std::collections::BTreeMap;
use std::io::{Cursor, Read as _};
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use roxmltree::{Document, Node};
use serde_json::Value;

use crate::failure::Failure;
use crate::file;

/// The most bytes of an array: a few letters of a compressed file may ask for all of the memory.
const MOST: u64 = 1 << 32;

/// Half of the last digit of a number in single precision, over the number.
const SINGLE: f64 = 0.5 * f32::EPSILON as f64;

/// An array, in the order of the last index.
struct Array {
    shape: Vec<usize>,
    content: Content,
}

/// What an array holds.
enum Content {
    Numbers(Numbers),
    Texts(Vec<String>),
}

/// Numbers, and whether they were rounded to single precision.
struct Numbers {
    all: Vec<f64>,
    are_single: bool,
}

/// A table: CSV with a head and all digits, and by how much single precision may have moved its values.
pub(super) struct Table {
    pub(super) text: String,
    pub(super) rounding: f64,
}

/// Whether a file of this name has arrays.
pub(super) fn is_read(path: &Path) -> bool {
    matches!(ending(path).as_str(), "npz" | "vtu" | "glb")
}

fn ending(path: &Path) -> String {
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.unwrap_or_default().to_ascii_lowercase()
}

/// The values of a file, of points with so many coordinates.
pub(super) fn table(path: &Path, dimension: usize) -> Result<Table, Failure> {
    let bytes = file::load(path, file::MAX_BYTES)?;
    let columns = match ending(path).as_str() {
        "npz" => archive(&bytes).and_then(|arrays| of_archive(&arrays)),
        "glb" => coloured_mesh(&bytes, dimension),
        _ => mesh(&bytes, dimension),
    };
    let columns = columns.map_err(|why| wrong(path, &why))?;
    let rows = columns.first().map_or(0, |own| own.fields.len());
    let line =
        |of: &dyn Fn(&Column) -> String| columns.iter().map(of).collect::<Vec<_>>().join(",");
    let head = line(&|own| own.name.clone());
    let rows = (0..rows).map(|k| line(&|own| own.fields[k].clone()));
    Ok(Table {
        text: core::iter::once(head)
            .chain(rows)
            .collect::<Vec<_>>()
            .join("\n"),
        rounding: columns.iter().map(|own| own.rounding).fold(0.0, f64::max),
    })
}

/// The matrix of an archive: all of it, or what is not 0 as SciPy writes it.
pub(super) fn matrix(path: &Path, n: usize) -> Result<Vec<Vec<f64>>, Failure> {
    let bytes = file::load(path, file::MAX_BYTES)?;
    let arrays = archive(&bytes).map_err(|why| wrong(path, &why))?;
    let whole = |array: &Array| match &array.content {
        Content::Numbers(own) => own.all.iter().map(|x| *x as usize).collect(),
        Content::Texts(_) => Vec::new(),
    };
    let square = arrays.values().find(|array| array.shape == [n, n]);
    if let Some(Array {
        content: Content::Numbers(own),
        ..
    }) = square
    {
        return Ok(own
            .all
            .chunks_exact(n.max(1))
            .map(<[f64]>::to_vec)
            .collect());
    }
    let sparse = ["indptr", "indices", "data"].map(|name| arrays.get(name));
    let refuse = || {
        let why = format!(
            "an array of {n} rows and {n} columns is wanted, or `indptr`, `indices` and `data` of a sparse one by rows"
        );
        wrong(path, &why)
    };
    let [Some(starts), Some(columns), Some(data)] = sparse else {
        return Err(refuse());
    };
    let (starts, columns) = (whole(starts), whole(columns));
    let Content::Numbers(data) = &data.content else {
        return Err(refuse());
    };
    let data = &data.all;
    let mut rows = vec![vec![0.0; n]; n];
    if starts.len() != n + 1 {
        return Err(refuse());
    }
    for (row, ends) in rows.iter_mut().zip(starts.windows(2)) {
        let own = columns
            .get(ends[0]..ends[1])
            .zip(data.get(ends[0]..ends[1]));
        let (columns, data) = own.ok_or_else(refuse)?;
        for (&column, &factor) in columns.iter().zip(data) {
            *row.get_mut(column).ok_or_else(refuse)? += factor;
        }
    }
    Ok(rows)
}

fn wrong(path: &Path, why: &str) -> Failure {
    Failure::input(format_args!("{}: {why}", path.display()))
}

/// A column of a table.
struct Column {
    name: String,
    fields: Vec<String>,
    rounding: f64,
}

impl Column {
    fn of_coordinates(name: &str, all: &[f64]) -> Self {
        // What has no number is left out of a table.
        let text = |x: &f64| {
            if x.is_nan() {
                String::new()
            } else {
                format!("{x:?}")
            }
        };
        Self {
            name: name.to_owned(),
            fields: all.iter().map(text).collect(),
            rounding: 0.0,
        }
    }

    fn of_values(name: &str, own: &Numbers) -> Self {
        let largest = own.all.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        Self {
            rounding: if own.are_single {
                largest * SINGLE
            } else {
                0.0
            },
            ..Self::of_coordinates(name, &own.all)
        }
    }
}

/// The names of so many coordinates.
fn axes(count: usize) -> Vec<String> {
    match count {
        0..=3 => ["x", "y", "z"][..count]
            .iter()
            .map(|&x| x.to_owned())
            .collect(),
        _ => (1..=count).map(|k| format!("x{k}")).collect(),
    }
}

/// The columns of points and values. Points are the rows of a matrix `at` or `points`, or have an array for every coordinate; rows without
/// coordinates have the names of targets or surfaces. Where values have several axes, coordinates belong to these.
fn of_archive(arrays: &BTreeMap<String, Array>) -> Result<Vec<Column>, String> {
    let numbers = |name: &str| match arrays.get(name) {
        Some(Array {
            shape,
            content: Content::Numbers(own),
        }) => Some((shape.as_slice(), own.all.as_slice())),
        _ => None,
    };
    let texts = ["name", "surface"]
        .into_iter()
        .find_map(|name| match &arrays.get(name)?.content {
            Content::Texts(all) => Some((name, all)),
            Content::Numbers(_) => None,
        });
    let mut columns = Vec::new();
    if let Some((name, all)) = texts {
        columns.push(Column {
            name: name.to_owned(),
            fields: all.iter().map(|own| format!("{own:?}")).collect(),
            rounding: 0.0,
        });
    }
    if let Some((&[_, width], all)) = numbers("at").or_else(|| numbers("points")) {
        for (k, name) in axes(width).iter().enumerate() {
            let own: Vec<f64> = all.iter().skip(k).step_by(width).copied().collect();
            columns.push(Column::of_coordinates(name, &own));
        }
    } else if columns.is_empty() {
        let all = [axes(3), axes(6)].concat();
        let own = all.iter().filter_map(|name| Some((name, numbers(name)?.1)));
        let own: Vec<(&String, &[f64])> = own.collect();
        let lengths: Vec<usize> = own.iter().map(|(_, all)| all.len()).collect();
        let is_grid = own.len() > 1 && arrays.values().any(|array| array.shape == lengths);
        let rows: usize = lengths.iter().product();
        let mut every = rows;
        for (name, all) in own {
            every /= all.len().max(1);
            let of_grid = || (0..rows).map(|k| all[k / every % all.len()]).collect();
            let all = if is_grid { of_grid() } else { all.to_vec() };
            columns.push(Column::of_coordinates(name, &all));
        }
    }
    let rows = columns.first().map_or(0, |own| own.fields.len());
    let odd = columns.iter().find(|own| own.fields.len() != rows);
    if let Some(Column { name, .. }) = odd {
        return Err(format!(
            "`{name}` has not as many numbers as the other coordinates"
        ));
    }
    let is_value = |name: &str| !columns.iter().any(|known| known.name == name);
    let values = arrays
        .iter()
        .filter_map(|(name, array)| match &array.content {
            Content::Numbers(own) if own.all.len() == rows && is_value(name) => {
                Some(Column::of_values(name, own))
            }
            _ => None,
        });
    let values: Vec<Column> = values.collect();
    if rows == 0 || values.is_empty() {
        let known: Vec<&str> = arrays.keys().map(String::as_str).collect();
        return Err(format!(
            "points are wanted, in `at` or in `x`, `y` and so on, and as many values; there are {}",
            known.join(", ")
        ));
    }
    columns.extend(alone(values));
    Ok(columns)
}

/// Values that have no others beside them are those that are meant.
fn alone(mut values: Vec<Column>) -> Vec<Column> {
    if let [own] = values.as_mut_slice() {
        "value".clone_into(&mut own.name);
    }
    values
}

/// All arrays of an `.npz` file.
fn archive(bytes: &[u8]) -> Result<BTreeMap<String, Array>, String> {
    let refuse = |error: zip::result::ZipError| format!("it is no archive of arrays: {error}");
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(refuse)?;
    let mut arrays = BTreeMap::new();
    for number in 0..archive.len() {
        let part = archive.by_index(number).map_err(refuse)?;
        let name = part.name().trim_end_matches(".npy").to_owned();
        let mut content = Vec::new();
        let read = part.take(MOST).read_to_end(&mut content);
        read.map_err(|error| format!("{name}: {error}"))?;
        if let Some(array) = array(&content).map_err(|why| format!("{name}: {why}"))? {
            arrays.insert(name, array);
        }
    }
    Ok(arrays)
}

/// An array in NumPy's format, versions 1 to 3; nothing if it holds neither numbers nor texts.
fn array(file: &[u8]) -> Result<Option<Array>, &'static str> {
    let broken = "it is no array of NumPy, or ends too early";
    let rest = file.strip_prefix(b"\x93NUMPY").ok_or(broken)?;
    let (length, from) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 4),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 6),
        _ => return Err(broken),
    };
    let head = rest.get(from..from + length).ok_or(broken)?;
    let head = core::str::from_utf8(head).map_err(|_| broken)?;
    let bytes = &rest[from + length..];
    let after = |key: &str| {
        Some(
            head.split_once(&format!("'{key}'"))?
                .1
                .split_once(':')?
                .1
                .trim_start(),
        )
    };
    let kind = after("descr").and_then(|rest| rest.strip_prefix('\'')?.split('\'').next());
    let shape = after("shape").and_then(|rest| rest.strip_prefix('(')?.split(')').next());
    let shape = shape.ok_or(broken)?.split(',').map(str::trim);
    let shape = shape
        .filter(|n| !n.is_empty())
        .map(|n| n.parse::<usize>().map_err(|_| broken));
    let shape = shape.collect::<Result<Vec<_>, _>>()?;
    let Some(kind) = kind else { return Ok(None) };
    let count = shape.iter().try_fold(1_usize, |all, n| all.checked_mul(*n));
    let content = match kind.split_at_checked(2) {
        Some(("<U", letters)) => letters
            .parse()
            .ok()
            .map(|n| Content::Texts(utf32(bytes, n))),
        Some(("|S", letters)) => letters
            .parse()
            .ok()
            .map(|n| Content::Texts(latin(bytes, n))),
        _ => numbers(bytes, kind).map(Content::Numbers),
    };
    let Some(content) = content else {
        return Ok(None);
    };
    let found = match &content {
        Content::Numbers(own) => own.all.len(),
        Content::Texts(all) => all.len(),
    };
    if Some(found) != count {
        return Err(broken);
    }
    if shape.len() > 1 && after("fortran_order").is_some_and(|own| own.starts_with("True")) {
        return Err("its first index runs first: write it with `numpy.ascontiguousarray`");
    }
    Ok(Some(Array { shape, content }))
}

fn utf32(bytes: &[u8], letters: usize) -> Vec<String> {
    let text = |own: &[u8]| {
        let (codes, _) = own.as_chunks::<4>();
        let codes = codes.iter().map(|code| u32::from_le_bytes(*code));
        codes
            .take_while(|code| *code > 0)
            .filter_map(char::from_u32)
            .collect()
    };
    bytes
        .chunks_exact(letters.saturating_mul(4).max(1))
        .map(text)
        .collect()
}

fn latin(bytes: &[u8], letters: usize) -> Vec<String> {
    let text = |own: &[u8]| {
        own.iter()
            .take_while(|b| **b > 0)
            .map(|&b| char::from(b))
            .collect()
    };
    bytes.chunks_exact(letters.max(1)).map(text).collect()
}

/// Numbers of a type that NumPy writes so, or VTK by another name.
fn numbers(bytes: &[u8], kind: &str) -> Option<Numbers> {
    fn all<const N: usize>(bytes: &[u8], number: fn([u8; N]) -> f64) -> Vec<f64> {
        let (numbers, _) = bytes.as_chunks::<N>();
        numbers.iter().map(|own| number(*own)).collect()
    }
    let are_single = matches!(kind, "<f4" | ">f4" | "Float32");
    let all = match kind {
        "<f8" | "Float64" => all(bytes, f64::from_le_bytes),
        ">f8" => all(bytes, f64::from_be_bytes),
        "<f4" | "Float32" => all(bytes, |own| f32::from_le_bytes(own).into()),
        ">f4" => all(bytes, |own| f32::from_be_bytes(own).into()),
        "<i8" | "Int64" => all(bytes, |own| i64::from_le_bytes(own) as f64),
        "<u8" | "UInt64" => all(bytes, |own| u64::from_le_bytes(own) as f64),
        "<i4" | "Int32" => all(bytes, |own| i32::from_le_bytes(own).into()),
        "<u4" | "UInt32" => all(bytes, |own| u32::from_le_bytes(own).into()),
        "<i2" | "Int16" => all(bytes, |own| i16::from_le_bytes(own).into()),
        "<u2" | "UInt16" => all(bytes, |own| u16::from_le_bytes(own).into()),
        "|i1" | "Int8" => all(bytes, |own| i8::from_le_bytes(own).into()),
        "|u1" | "UInt8" => all(bytes, |[own]| own.into()),
        _ => return None,
    };
    Some(Numbers { all, are_single })
}

/// The columns of an unstructured grid: its points and their values, or, if these have none, the centres of cells and the values of cells.
fn mesh(bytes: &[u8], dimension: usize) -> Result<Vec<Column>, String> {
    let text = core::str::from_utf8(bytes).map_err(|_| {
        "its data are raw bytes behind the text: write it with `meshio`, or as text".to_owned()
    })?;
    let document = Document::parse(text).map_err(|error| error.to_string())?;
    let root = document.root_element();
    let find = |name: &str| root.descendants().find(|node| node.has_tag_name(name));
    let reader = MeshReader {
        root,
        appended: find("AppendedData"),
    };
    let arrays = |name: &str| {
        let all = find(name).into_iter().flat_map(|node| node.children());
        let all = all.filter(|node| node.has_tag_name("DataArray"));
        all.map(|node| {
            Ok((
                node.attribute("Name").unwrap_or_default().to_owned(),
                reader.array(node)?,
            ))
        })
        .collect::<Result<Vec<(String, Numbers)>, String>>()
    };
    let points = arrays("Points")?;
    let [(_, points)] = points.as_slice() else {
        return Err("it has no points: an unstructured grid of VTK's is wanted".to_owned());
    };
    let (points, _) = points.all.as_chunks::<3>();
    let scalars = |name: &str, count: usize| {
        let all = arrays(name)?.into_iter();
        Ok::<_, String>(
            all.filter(|(_, own)| own.all.len() == count)
                .collect::<Vec<_>>(),
        )
    };
    let of_points = scalars("PointData", points.len())?;
    let (places, values) = if of_points.is_empty() {
        let cells = arrays("Cells")?;
        let own = |name: &str| {
            cells
                .iter()
                .find(|(known, _)| known == name)
                .map(|(_, own)| &own.all)
        };
        let (corners, ends) = own("connectivity")
            .zip(own("offsets"))
            .ok_or("its cells have no corners")?;
        let mut from = 0;
        let centre = ends.iter().map(|end| {
            let own = corners
                .get(from..*end as usize)
                .filter(|own| !own.is_empty())?;
            from = *end as usize;
            let own = own.iter().map(|k| points.get(*k as usize));
            let own = own.collect::<Option<Vec<_>>>()?;
            Some([0, 1, 2].map(|k| own.iter().map(|x| x[k]).sum::<f64>() / own.len() as f64))
        });
        let centres = centre.collect::<Option<Vec<_>>>();
        (
            centres.ok_or("a cell has no such corner")?,
            scalars("CellData", ends.len())?,
        )
    } else {
        (points.to_vec(), of_points)
    };
    of_places(&places, &values, dimension)
}

/// A mesh of this program's for viewers of glTF, whose numbers stand beside its colours. Its places have single precision: they are what their
/// shortest decimals say, as a file of theirs would.
fn coloured_mesh(bytes: &[u8], dimension: usize) -> Result<Vec<Column>, String> {
    let broken = || "it is no glTF with numbers, as `--out FILE.glb` writes it".to_owned();
    let chunk = |from: usize| {
        let length = bytes.get(from..from + 4)?.try_into().ok()?;
        let length = u32::from_le_bytes(length) as usize;
        bytes.get(from + 8..)?.get(..length)
    };
    let json = chunk(12).ok_or_else(broken)?;
    let body = chunk(20 + json.len()).ok_or_else(broken)?;
    let json: Value = serde_json::from_slice(json).map_err(|_| broken())?;
    let whole = |own: &Value| own.as_u64().map(|n| n as usize);
    let floats = |accessor: &Value| -> Option<Vec<f32>> {
        let view = whole(&json["accessors"][whole(accessor)?]["bufferView"])?;
        let view = &json["bufferViews"][view];
        let own = body.get(whole(&view["byteOffset"])?..)?;
        let (own, _) = own.get(..whole(&view["byteLength"])?)?.as_chunks::<4>();
        Some(own.iter().map(|own| f32::from_le_bytes(*own)).collect())
    };
    let mesh = &json["meshes"][0]["primitives"][0];
    let attributes = mesh["attributes"].as_object().ok_or_else(broken)?;
    let places = attributes.get("POSITION").and_then(floats);
    let places = places.ok_or_else(broken)?;
    let (places, _) = places.as_chunks::<3>();
    let decimal = |x: f32| format!("{x:?}").parse().unwrap_or(f64::NAN);
    let mut places: Vec<[f64; 3]> = places.iter().map(|x| x.map(decimal)).collect();
    let named = attributes.iter().filter_map(|(name, accessor)| {
        let own = floats(accessor).filter(|own| own.len() == places.len())?;
        Some((name.strip_prefix('_')?.to_owned(), own))
    });
    let mut values: Vec<(String, Numbers)> = named
        .map(|(name, own)| {
            let numbers = Numbers {
                all: own.into_iter().map(f64::from).collect(),
                are_single: true,
            };
            (name, numbers)
        })
        .collect();
    if mesh["extras"]["values"] == "cells" {
        let corners = floats(&mesh["indices"]).ok_or_else(broken)?;
        let corners: Vec<usize> = corners.iter().map(|x| x.to_bits() as usize).collect();
        let (triangles, _) = corners.as_chunks::<3>();
        // The triangles of a cell have its first corner, and no two cells share a vertex.
        let cells = triangles.chunk_by(|a, b| a[0] == b[0]);
        let ends = |own: &[[usize; 3]]| {
            let all = || own.iter().flatten().copied();
            all().min().unwrap_or(0)..=all().max().unwrap_or(0)
        };
        let cells: Vec<_> = cells.map(ends).collect();
        let of_cells = |own: &dyn Fn(core::ops::RangeInclusive<usize>) -> Option<f64>| {
            let all = cells.iter().map(|cell| own(cell.clone()));
            all.collect::<Option<Vec<f64>>>().ok_or_else(broken)
        };
        for (_, own) in &mut values {
            own.all = of_cells(&|cell| own.all.get(*cell.start()).copied())?;
        }
        let axes = [0, 1, 2].map(|k| {
            of_cells(&|cell| {
                let own = places.get(cell)?;
                Some(own.iter().map(|x| x[k]).sum::<f64>() / own.len() as f64)
            })
        });
        let [x, y, z] = axes;
        let (x, y, z) = (x?, y?, z?);
        places = (0..x.len()).map(|k| [x[k], y[k], z[k]]).collect();
    }
    of_places(&places, &values, dimension)
}

/// The columns of places and their values.
fn of_places(
    places: &[[f64; 3]],
    values: &[(String, Numbers)],
    dimension: usize,
) -> Result<Vec<Column>, String> {
    if values.is_empty() {
        return Err("neither its points nor its cells have values".to_owned());
    }
    if let Some(off) = places
        .iter()
        .flat_map(|x| &x[dimension.min(3)..])
        .find(|x| **x != 0.0)
    {
        return Err(format!(
            "the space has {dimension} coordinates, and another one is {off} here, not 0"
        ));
    }
    let mut columns = Vec::new();
    for (k, name) in axes(dimension.min(3)).into_iter().enumerate() {
        let own: Vec<f64> = places.iter().map(|x| x[k]).collect();
        columns.push(Column::of_coordinates(&name, &own));
    }
    let values = values
        .iter()
        .map(|(name, own)| Column::of_values(name, own));
    columns.extend(alone(values.collect()));
    Ok(columns)
}

/// Who reads the arrays of a grid, as VTK's file formats say.
struct MeshReader<'a> {
    root: Node<'a, 'a>,
    appended: Option<Node<'a, 'a>>,
}

impl MeshReader<'_> {
    fn array(&self, node: Node<'_, '_>) -> Result<Numbers, String> {
        let kind = node.attribute("type").unwrap_or_default();
        let text = node.text().unwrap_or_default();
        let of = |what: &str| {
            format!(
                "array {:?}: {what}",
                node.attribute("Name").unwrap_or_default()
            )
        };
        match node.attribute("format").unwrap_or("ascii") {
            "ascii" => {
                let all = text.split_whitespace().map(|word| word.parse());
                let all = all.collect::<Result<_, _>>();
                Ok(Numbers {
                    all: all.map_err(|_| of("it is no array of numbers"))?,
                    are_single: kind == "Float32",
                })
            }
            "binary" => {
                let bytes = self
                    .decoded(text.trim())
                    .ok_or_else(|| of("it is broken"))?;
                numbers(&bytes, kind).ok_or_else(|| of("its type is not known"))
            }
            _ => {
                let offset = node
                    .attribute("offset")
                    .and_then(|own| own.parse::<usize>().ok());
                let text = self
                    .appended
                    .filter(|own| own.attribute("encoding") == Some("base64"));
                let text = text.and_then(|own| own.text()?.trim().strip_prefix('_'));
                let own = text
                    .zip(offset)
                    .and_then(|(text, offset)| text.get(offset..));
                let bytes = own
                    .and_then(|own| self.decoded(own))
                    .ok_or_else(|| of("it is broken"))?;
                numbers(&bytes, kind).ok_or_else(|| of("its type is not known"))
            }
        }
    }

    /// What stands in letters: its length and it, or the number and lengths of compressed blocks and these, in letters of their own.
    fn decoded(&self, text: &str) -> Option<Vec<u8>> {
        if self.root.attribute("byte_order") == Some("BigEndian") {
            return None;
        }
        let width = if self.root.attribute("header_type") == Some("UInt64") {
            8
        } else {
            4
        };
        let letters = |bytes: usize| bytes.div_ceil(3) * 4;
        // Letters are more than bytes: no length that is meant is larger.
        let length = |all: u64| usize::try_from(all).ok().filter(|n| *n < text.len());
        let head = |count: usize| {
            let all = STANDARD.decode(text.get(..letters(count * width))?).ok()?;
            let word = |own: &[u8]| {
                own.iter()
                    .rev()
                    .fold(0_u64, |all, b| all << 8 | u64::from(*b))
            };
            Some(all.chunks_exact(width).map(word).collect::<Vec<u64>>())
        };
        let first = *head(1)?.first()?;
        match self.root.attribute("compressor") {
            None => {
                let all = text.get(..letters(width + length(first)?))?;
                Some(STANDARD.decode(all).ok()?.split_off(width))
            }
            Some("vtkZLibDataCompressor") => {
                let blocks = length(first)?;
                let lengths = head(3 + blocks)?.split_off(3);
                let from = letters((3 + blocks) * width);
                let all = lengths
                    .iter()
                    .try_fold(0_u64, |all, own| all.checked_add(*own));
                let packed = text.get(from..from + letters(length(all?)?))?;
                let packed = STANDARD.decode(packed).ok()?;
                let (mut rest, mut bytes) = (packed.as_slice(), Vec::new());
                for length in lengths {
                    let (own, more) = rest.split_at_checked(length as usize)?;
                    ZlibDecoder::new(own)
                        .take(MOST)
                        .read_to_end(&mut bytes)
                        .ok()?;
                    rest = more;
                }
                Some(bytes)
            }
            Some(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use fredholm_file::npz::Archive;
    use fredholm_plot::{Cell, Mesh, Quantity};

    use super::{archive, mesh, of_archive};

    /// Whatever bytes and letters are broken, a file is read or refused.
    #[test]
    fn broken_files_are_refused() {
        let mut written = Archive::default();
        let values = [0.0, 0.5, 1.0, 2.0];
        written.numbers("x", &[4], values.iter()).unwrap();
        written.numbers("u", &[4], values.iter()).unwrap();
        let names = values.map(|x| x.to_string());
        written.texts("name", &names).unwrap();
        let drawn = Mesh {
            points: values.map(|x| [x, 0.0, 0.0]).to_vec(),
            cells: vec![Cell::Line([0, 1]), Cell::Line([2, 3])],
            on_points: Vec::new(),
            on_cells: vec![Quantity {
                name: "u".to_owned(),
                numbers: vec![1.0, 2.0],
            }],
        };
        let npz = |bytes: &[u8]| {
            archive(bytes)
                .and_then(|arrays| of_archive(&arrays))
                .is_ok()
        };
        let vtu = |bytes: &[u8]| mesh(bytes, 1).is_ok();
        let files = [
            (written.finish().unwrap(), &npz as &dyn Fn(&[u8]) -> bool),
            (drawn.vtu().unwrap().into_bytes(), &vtu),
        ];
        let mut state = 1_u64;
        let mut draw = |below: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as usize % below
        };
        for (file, is_read) in files {
            assert!(is_read(&file));
            let mut refused = 0;
            for _ in 0..2000 {
                let mut broken = file.clone();
                for _ in 0..=draw(3) {
                    let at = draw(broken.len());
                    broken[at] = draw(128) as u8;
                }
                broken.truncate(file.len() - draw(2) * draw(file.len()));
                refused += usize::from(!is_read(&broken));
            }
            assert!(refused > 500, "{refused}");
        }
    }
}
