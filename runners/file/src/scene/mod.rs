//! Scenes in space from files: OBJ, STL, PLY, View3D decks, and TOML, which may name the others.
//!
//! A mesh is a list of surfaces by name, each of polygons. What has more than four vertices, or four that are not in a
//! plane, is cut into triangles.

mod description;
mod light;
mod material;
mod obj;
mod outline;
mod ply;
mod sky;
mod stl;
mod symmetry;
mod vs3;

use core::fmt::Display;
use std::collections::HashSet;
use std::path::Path;

use fredholm_scene::{Beam, Enclosure, Material, Polygon, Scene, SceneError, Surface};

pub(crate) use description::of_problem;
pub use description::{is_description, parse_description};
pub use sky::SkyBands;

pub use crate::section::nearest;

use crate::words::{Words, Wrong, lines};
use crate::{InputError, Source, load};

/// A commented description of a scene, as `fredholm init scene` prints it.
pub const TEMPLATE: &str = include_str!("../../templates/scene.toml");

/// The most bytes of a mesh file.
const MAX_BYTES: u64 = 1 << 30;
/// The most polygons of a scene.
const MAX_POLYGONS: usize = 20_000_000;
/// The most vertices of one polygon: cutting it into triangles takes time in proportion to their square.
const MAX_VERTICES: usize = 1000;

/// The content of a scene file.
#[derive(Clone, Debug, Default)]
pub struct SceneFile {
    /// The surfaces, in the order of the file.
    pub surfaces: Vec<SceneSurface>,
    /// Whether light may leave.
    pub open: bool,
    /// The sky of an open scene, if the file has one.
    pub sky: Option<SkyBands>,
    /// Light that no surface emits.
    pub lights: Vec<Beam<f64>>,
    /// The names of the channels; none if there is one.
    pub channels: Vec<String>,
    /// Whether the channels are bands of heat, in W/m².
    pub in_bands: bool,
    /// Whether temperatures or net fluxes are given in one channel: u is in W/m² then.
    pub heat: bool,
    /// Whether emissions are in lumens per square metre.
    pub is_photometric: bool,
    /// Whether the net fluxes of all surfaces are left out although there are temperatures.
    pub without_fluxes: bool,
    /// Whether it is a file that asks for more than form factors.
    pub has_targets: bool,
    /// Remarks on what was changed while reading, for people.
    pub remarks: Vec<String>,
    /// The files that polygons stand in.
    names: Vec<String>,
}

/// A surface of a scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSurface {
    /// The name of the surface in results.
    pub name: String,
    /// The polygons of the surface.
    pub polygons: Vec<Polygon>,
    /// The material of all of them; where there are channels, the largest reflectance and emission.
    pub material: Material,
    /// The material in every channel; empty if there is one channel.
    pub colours: Vec<Material>,
    /// The emissivity, if the net flux is given and this is known.
    pub emissivity: Option<f64>,
    /// Where each polygon stands: a file, and a line or another number of it.
    places: Vec<(u32, u32)>,
}

impl SceneSurface {
    /// A surface without polygons yet, black.
    fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            polygons: Vec::new(),
            material: Material::BLACK,
            colours: Vec::new(),
            emissivity: None,
            places: Vec::new(),
        }
    }
}

impl SceneFile {
    /// The scene, for walks in `F`.
    ///
    /// # Errors
    /// What is wrong with it, with file and line, and the names of surfaces.
    pub fn scene<F: fredholm_core::Real>(&self) -> Result<Scene, InputError> {
        let materials: Vec<[Material; 1]> = self.surfaces.iter().map(|s| [s.material]).collect();
        let surfaces: Vec<Surface<'_>> = self
            .surfaces
            .iter()
            .zip(&materials)
            .map(|(surface, material)| Surface {
                polygons: &surface.polygons,
                materials: material,
            })
            .collect();
        let enclosure = if self.open {
            Enclosure::Open
        } else {
            Enclosure::Closed
        };
        Scene::new::<F>(&surfaces, enclosure)
            .and_then(|scene| scene.with_beams(self.lights.clone()))
            .and_then(|scene| {
                let light = self.sky.as_ref().map(SkyBands::light).transpose()?;
                match light.flatten() {
                    Some(light) => scene.with_sky(light),
                    None => Ok(scene),
                }
            })
            .map_err(|error| self.explain(&error))
    }

    /// The error with the place in its file, and the names of the surfaces that it numbers.
    fn explain(&self, error: &SceneError) -> InputError {
        let (first, second) = match *error {
            SceneError::Coordinate(at)
            | SceneError::Reflectance(at)
            | SceneError::Emission(at)
            | SceneError::Degenerate(at)
            | SceneError::NotConvex(at)
            | SceneError::NotPlanar { at, .. }
            | SceneError::TJunction { at, .. }
            | SceneError::Open { at, .. } => (Some(at), None),
            SceneError::Duplicate { first, second }
            | SceneError::Overlap { first, second }
            | SceneError::Flipped { first, second, .. } => (Some(second), Some(first)),
            SceneError::Crossing { first, second, .. } => (Some(first), Some(second)),
            _ => (None, None),
        };
        let describe = |at: fredholm_scene::Place| {
            let surface = self.surfaces.get(at.surface)?;
            let &(file, line) = surface.places.get(at.polygon)?;
            let file = self.names.get(file as usize)?;
            Some((format!("{file}:{line}"), at.surface, &surface.name))
        };
        let places: Vec<_> = [first, second]
            .into_iter()
            .flatten()
            .filter_map(describe)
            .collect();
        let Some((place, ..)) = places.first() else {
            let name = self.names.first().map_or("", String::as_str);
            return InputError::new(format_args!("{name}: {error}"));
        };
        let known: Vec<String> = places
            .iter()
            .map(|(place, number, name)| format!("surface {number} is {name:?}, {place}"))
            .collect();
        InputError::new(format_args!("{place}: {error} ({})", known.join("; ")))
    }

    /// The place of a file in the list.
    fn file(&mut self, name: &str) -> u32 {
        self.names.push(name.to_owned());
        (self.names.len() - 1) as u32
    }

    /// Adds a polygon with any number of vertices to a surface.
    fn add(
        &mut self,
        surface: usize,
        points: &[[f64; 3]],
        place: (u32, u32),
    ) -> Result<(), String> {
        let Some(surface) = self.surfaces.get_mut(surface) else {
            return Err("there is no such surface".to_owned());
        };
        if points.len() < 3 {
            return Err("a polygon has at least three vertices".to_owned());
        }
        if points.len() > MAX_VERTICES {
            return Err(format!("a polygon has at most {MAX_VERTICES} vertices"));
        }
        outline::cut(points, &mut |polygon| {
            surface.polygons.push(polygon);
            surface.places.push(place);
        })
    }
}

/// Gives a number to surfaces whose names others have already.
fn distinguish(surfaces: &mut [SceneSurface]) {
    let mut known: HashSet<String> = surfaces.iter().map(|s| s.name.clone()).collect();
    let mut seen: HashSet<String> = HashSet::new();
    for surface in surfaces {
        if seen.insert(surface.name.clone()) {
            continue;
        }
        let free = (2..)
            .map(|k| format!("{} {k}", surface.name))
            .find(|name| !known.contains(name));
        if let Some(name) = free {
            known.insert(name.clone());
            seen.insert(name.clone());
            surface.name = name;
        }
    }
}

/// The kinds of meshes.
enum Format {
    Obj,
    Stl,
    Ply,
    Vs3,
}

/// The format of a file by the end of its name.
fn format_of(path: &Path) -> Option<Format> {
    let end = path.extension()?.to_str()?.to_ascii_lowercase();
    match end.as_str() {
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        "ply" => Some(Format::Ply),
        "vs3" => Some(Format::Vs3),
        _ => None,
    }
}

/// Whether files of this name are meshes or decks of scenes in space.
#[must_use]
pub fn is_mesh(path: &Path) -> bool {
    format_of(path).is_some()
}

/// Reads a mesh or deck, whose name's end says the format.
///
/// # Errors
/// What cannot be read, or is wrong, with its place.
pub fn read(path: &Path) -> Result<SceneFile, InputError> {
    parse_mesh(&path.display().to_string(), load(path, MAX_BYTES)?)
}

/// Reads the mesh or deck of this name, whose end says the format.
///
/// # Errors
/// What is wrong, with its place.
pub fn parse_mesh(name: &str, bytes: Vec<u8>) -> Result<SceneFile, InputError> {
    let Some(format) = format_of(Path::new(name)) else {
        return Err(InputError::new(format_args!(
            "{name}: a mesh is an .obj, .stl, .ply or .vs3 file"
        )));
    };
    let mut scene = SceneFile::default();
    let file = scene.file(name);
    match format {
        Format::Stl => stl::read(&mut scene, file, name, &bytes)?,
        Format::Ply => ply::read(&mut scene, file, name, &bytes)?,
        _ => {
            // Names and comments may be in any encoding; numbers are not.
            let text = String::from_utf8_lossy(&bytes).into_owned();
            let source = Source {
                name: name.to_owned(),
                text,
            };
            let read = match format {
                Format::Obj => obj::read(&mut scene, file, &source.text),
                _ => vs3::read(&mut scene, file, &source.text),
            };
            read.map_err(|wrong| wrong.at(&source))?;
        }
    }
    scene
        .surfaces
        .retain(|surface| !surface.polygons.is_empty());
    distinguish(&mut scene.surfaces);
    if scene.surfaces.is_empty() {
        return Err(InputError::new(format_args!("{name}: there are no faces")));
    }
    Ok(scene)
}

/// An error of a file without lines, or one that no line shows.
fn nowhere(name: &str, message: impl Display) -> InputError {
    InputError::new(format_args!("{name}: {message}"))
}

#[cfg(test)]
mod tests;
