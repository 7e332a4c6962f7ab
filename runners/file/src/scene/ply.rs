//! PLY, as text and as bytes of either order: vertices and faces.
//!
//! The element `vertex` has properties `x`, `y`, `z`, the element `face` a list `vertex_indices` or `vertex_index`; all
//! other properties and elements are skipped.

use super::{MAX_POLYGONS, SceneFile, SceneSurface, nowhere};
use crate::InputError;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coding {
    Text,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

#[derive(Debug)]
struct Property {
    name: String,
    /// The type of the length, for a list.
    count: Option<Kind>,
    kind: Kind,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// What is left of the numbers.
struct Body<'b> {
    coding: Coding,
    bytes: &'b [u8],
    at: usize,
}

impl Body<'_> {
    /// The next number.
    fn number(&mut self, kind: Kind) -> Result<f64, String> {
        if self.coding == Coding::Text {
            let rest = self.bytes.get(self.at..).unwrap_or(&[]);
            let skipped = rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
            let rest = rest.get(skipped..).unwrap_or(&[]);
            let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
            let word = rest.get(..length).unwrap_or(&[]);
            self.at += skipped + length;
            if word.is_empty() {
                return Err("the file is cut short".to_owned());
            }
            let text = core::str::from_utf8(word).unwrap_or("?");
            return text
                .parse()
                .map_err(|_| format!("{text:?} is not a number"));
        }
        let size = kind.size();
        let own = self.bytes.get(self.at..self.at + size);
        let own = own.ok_or_else(|| "the file is cut short".to_owned())?;
        self.at += size;
        let mut bytes = [0; 8];
        // In the order of a little-endian number.
        for (k, byte) in own.iter().enumerate() {
            let place = if self.coding == Coding::Big {
                size - 1 - k
            } else {
                k
            };
            bytes[place] = *byte;
        }
        let raw = u64::from_le_bytes(bytes);
        Ok(match kind {
            Kind::I8 => f64::from(raw as u8 as i8),
            Kind::U8 => f64::from(raw as u8),
            Kind::I16 => f64::from(raw as u16 as i16),
            Kind::U16 => f64::from(raw as u16),
            Kind::I32 => f64::from(raw as u32 as i32),
            Kind::U32 => f64::from(raw as u32),
            Kind::F32 => f64::from(f32::from_bits(raw as u32)),
            Kind::F64 => f64::from_bits(raw),
        })
    }

    /// The next number, which must be a whole one from 0.
    fn index(&mut self, kind: Kind) -> Result<usize, String> {
        let x = self.number(kind)?;
        if x >= 0.0 && x <= f64::from(u32::MAX) && x.fract() == 0.0 {
            Ok(x as usize)
        } else {
            Err(format!("{x} is not a number of things"))
        }
    }
}

pub(super) fn read(
    scene: &mut SceneFile,
    file: u32,
    name: &str,
    bytes: &[u8],
) -> Result<(), InputError> {
    let (coding, elements, at) = header(bytes)
        .map_err(|(line, message)| InputError::new(format_args!("{name}:{line}: {message}")))?;
    let mut body = Body { coding, bytes, at };
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    scene.surfaces.push(SceneSurface::new("surface"));
    for element in &elements {
        for number in 0..element.count {
            let fail = |message: String| {
                nowhere(
                    name,
                    format_args!("{} {number}: {message}", element.name.escape_debug()),
                )
            };
            // What has no properties has no bytes either: a count of them costs nothing to claim.
            if element.properties.is_empty() {
                break;
            }
            let item = item(element, &mut body).map_err(fail)?;
            match element.name.as_str() {
                "vertex" => match item.point {
                    [Some(x), Some(y), Some(z)] if [x, y, z].iter().all(|c| c.is_finite()) => {
                        vertices.push([x, y, z]);
                    }
                    [Some(_), Some(_), Some(_)] => {
                        return Err(fail("a coordinate is no finite number".to_owned()));
                    }
                    _ => return Err(fail("a vertex has properties x, y and z".to_owned())),
                },
                "face" => {
                    let corners = item
                        .corners
                        .ok_or_else(|| fail("a face has a list vertex_indices".to_owned()))?;
                    let points = corners.iter().map(|&v| vertices.get(v).copied());
                    let points: Option<Vec<[f64; 3]>> = points.collect();
                    let points = points.ok_or_else(|| {
                        fail(format!(
                            "there are only {} vertices, from 0",
                            vertices.len()
                        ))
                    })?;
                    if number >= MAX_POLYGONS {
                        return Err(fail(format!("more than {MAX_POLYGONS} faces")));
                    }
                    scene.add(0, &points, (file, number as u32)).map_err(fail)?;
                }
                _ => {}
            }
        }
    }
    Ok(())
}

/// What of an item is read.
#[derive(Default)]
struct Item {
    point: [Option<f64>; 3],
    corners: Option<Vec<usize>>,
}

fn item(element: &Element, body: &mut Body<'_>) -> Result<Item, String> {
    let mut own = Item::default();
    for property in &element.properties {
        if let Some(count) = property.count {
            let count = body.index(count)?;
            let wanted = matches!(property.name.as_str(), "vertex_indices" | "vertex_index");
            let mut corners = Vec::new();
            for _ in 0..count {
                if wanted {
                    corners.push(body.index(property.kind)?);
                } else {
                    body.number(property.kind)?;
                }
            }
            if wanted {
                own.corners = Some(corners);
            }
        } else {
            let value = body.number(property.kind)?;
            match property.name.as_str() {
                "x" => own.point[0] = Some(value),
                "y" => own.point[1] = Some(value),
                "z" => own.point[2] = Some(value),
                _ => {}
            }
        }
    }
    Ok(own)
}

/// The elements, and where the numbers begin; or the line and what is wrong with it.
fn header(bytes: &[u8]) -> Result<(Coding, Vec<Element>, usize), (usize, String)> {
    let mut coding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    for number in 1..10_000 {
        let rest = bytes.get(at..).unwrap_or(&[]);
        let Some(length) = rest.iter().position(|&b| b == b'\n') else {
            return Err((
                number,
                "the header of a PLY file ends with `end_header`".to_owned(),
            ));
        };
        at += length + 1;
        let line = String::from_utf8_lossy(rest.get(..length).unwrap_or(&[])).into_owned();
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong = |message: &str| Err((number, message.to_owned()));
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            _ if number == 1 => return wrong("a PLY file begins with `ply`"),
            [] | ["comment" | "obj_info", ..] => {}
            ["format", "ascii", "1.0"] => coding = Some(Coding::Text),
            ["format", "binary_little_endian", "1.0"] => coding = Some(Coding::Little),
            ["format", "binary_big_endian", "1.0"] => coding = Some(Coding::Big),
            ["element", name, count] => match count.parse() {
                Ok(count) => elements.push(Element {
                    name: (*name).to_owned(),
                    count,
                    properties: Vec::new(),
                }),
                Err(_) => return wrong("an element has a name and a number"),
            },
            ["property", rest @ ..] => {
                let property = match rest {
                    ["list", count, kind, name] => Kind::of(count)
                        .zip(Kind::of(kind))
                        .map(|(count, kind)| (Some(count), kind, name)),
                    [kind, name] => Kind::of(kind).map(|kind| (None, kind, name)),
                    _ => None,
                };
                let (Some((count, kind, name)), Some(element)) = (property, elements.last_mut())
                else {
                    return wrong(
                        "a property is `property TYPE NAME` or `property list TYPE TYPE NAME`, of an element",
                    );
                };
                element.properties.push(Property {
                    name: (*name).to_owned(),
                    count,
                    kind,
                });
            }
            ["end_header"] => {
                let coding = coding.ok_or((number, "the header has no `format`".to_owned()))?;
                return Ok((coding, elements, at));
            }
            _ => return wrong("this is no line of a PLY header"),
        }
    }
    Err((10_000, "the header is too long".to_owned()))
}
