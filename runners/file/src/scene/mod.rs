//! Scenes in space from files: OBJ, STL, PLY, View3D decks, models of EnergyPlus, and TOML, which may name the others.
//!
//! A mesh is a list of surfaces by name, each of polygons. What has more than four vertices, or four that are not in a
//! plane, is cut into triangles.

mod arrays;
mod description;
mod epjson;
pub(crate) mod light;
mod material;
// A page reads no files of its own.
#[cfg(feature = "parts")]
mod molflow;
mod obj;
mod outline;
mod ply;
pub(crate) mod sky;
mod stl;
mod symmetry;
mod times;
mod vacuum;
mod vs3;
mod weld;

use core::fmt::Display;
use core::ops::Range;
use std::collections::HashSet;
use std::path::Path;

use fredholm::channels::Bands;
use fredholm::scene::Vacuum;
use fredholm_scene::{Beam, Enclosure, Material, Polygon, Scene, SceneError, Surface, shapes};

pub use arrays::{ArraySurface, SceneArrays};
pub(crate) use description::of_problem;
pub use description::{is_description, metres, parse_description};
pub use material::less_specular;
pub use sky::SkyBands;

/// Why there are no bands of light from outside.
pub(crate) const NO_BANDS: &str = "the light of a sky and of lamps does not say in which bands it is: leave it out, or `wavelengths`";

pub use times::Times;

pub use crate::section::nearest;

use crate::words::{Words, Wrong, joined, lines};
use crate::{InputError, Source, load};
use weld::Outline;

/// A commented description of a scene, as `fredholm init scene` prints it.
pub const TEMPLATE: &str = include_str!("../../templates/scene.toml");

/// The height of the highest building in metres, Burj Khalifa.
const HIGHEST: f64 = 828.0;
/// The most names in a remark.
const MOST_NAMES: usize = 8;
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
    /// The period along every axis, 0 along those on which nothing repeats.
    pub period: [f64; 3],
    /// Light that no surface emits.
    pub lights: Vec<Beam<f64>>,
    /// The names of the channels; none if there is one.
    pub channels: Vec<String>,
    /// The bands of heat, in W/m², if the channels are such.
    pub bands: Option<Bands>,
    /// Whether temperatures or net fluxes are given in one channel: u is in W/m² then.
    pub heat: bool,
    /// The gas, if it is a scene of molecules: emissions are in millibar.
    pub gas: Option<Vacuum>,
    /// Whether emissions are in lumens per square metre.
    pub is_photometric: bool,
    /// Whether the net fluxes of all surfaces are left out although there are temperatures.
    pub without_fluxes: bool,
    /// Whether it is a file that asks for more than form factors.
    pub has_targets: bool,
    /// Remarks on what was changed while reading, for people.
    pub remarks: Vec<String>,
    /// The distance below which vertices are one, if it is given: polygons are cut when all of them are known.
    weld: Option<f64>,
    /// How far vertices have moved by that, at most.
    moved: f64,
    /// The polygons that are not cut yet.
    outlines: Vec<Outline>,
    /// What surfaces of a mesh do with molecules, by their names.
    of_gas: Vec<(String, vacuum::Words)>,
    /// Surfaces of a mesh that have backs.
    two_sided: Vec<usize>,
    /// The files that polygons stand in.
    names: Vec<Origin>,
    /// Where the file should have surfaces and has none, until arrays give some.
    is_empty_at: Option<Range<usize>>,
}

/// What polygons come from, in which each has a number.
#[derive(Clone, Debug)]
enum Origin {
    /// A file of lines.
    Lines(String),
    /// A file of objects, and their names.
    Objects(String, Vec<String>),
    /// An array of this name, from 0.
    Array(&'static str),
}

impl Origin {
    fn place(&self, number: u32) -> String {
        match self {
            Self::Lines(name) => format!("{name}:{number}"),
            Self::Objects(name, all) => {
                let own = all.get(number as usize).map_or("", String::as_str);
                format!("{name}: {own:?}")
            }
            Self::Array(name) => format!("{name}[{number}]"),
        }
    }

    fn name(&self) -> &str {
        match self {
            Self::Lines(name) | Self::Objects(name, _) => name,
            Self::Array(name) => name,
        }
    }
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
    /// ρ_s, the part of what arrives that leaves as from a mirror.
    pub specular: f64,
    /// α, the part of sunlight that is absorbed, if it is given.
    pub absorptance: Option<f64>,
    /// Whether it hides others and is not reported: an obstruction of a View3D deck.
    pub is_obstruction: bool,
    /// What is said of its material.
    pub known: Known,
    /// The surface whose backs these are.
    back_of: Option<usize>,
    /// Where each polygon stands: a file, and a line or another number of it.
    places: Vec<(u32, u32)>,
}

/// What is said of the material of a surface.
///
/// ```
/// use fredholm_file::scene::Known;
///
/// assert_eq!(Known::default(), Known::Nothing);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Known {
    /// Nothing: it is black, and dark or at 0 K.
    #[default]
    Nothing,
    /// An emissivity, and neither a temperature nor a net flux: this serves form factors.
    Emissivity,
    /// All that its light or heat takes.
    Material,
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
            specular: 0.0,
            absorptance: None,
            is_obstruction: false,
            known: Known::Nothing,
            back_of: None,
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
        let specular: Vec<f64> = self.surfaces.iter().map(|own| own.specular).collect();
        let scene = self.scene_of::<F>(|own| own.material)?;
        let scene = scene.with_specular(&specular);
        let scene = scene.map_err(|error| self.explain(&error))?;
        let Some(absorptances) = self.absorptances()? else {
            return Ok(scene);
        };
        let of_sky = self.sky.as_ref().is_some_and(|sky| !sky.is_heat);
        let scene = scene.with_absorptances(&absorptances, of_sky);
        scene.map_err(|error| self.explain(&error))
    }

    /// The part of sunlight that every surface absorbs, if one tells it apart from heat: of others as much as of heat.
    fn absorptances(&self) -> Result<Option<Vec<f64>>, InputError> {
        if self.surfaces.iter().all(|own| own.absorptance.is_none()) {
            return Ok(None);
        }
        let of_heat = |own: &SceneSurface| match own.material.reflectance < 1.0 {
            true => Some(1.0 - own.material.reflectance),
            false => own.emissivity,
        };
        let all = self.surfaces.iter().map(|own| {
            let known = own.absorptance.or_else(|| of_heat(own));
            known.ok_or_else(|| {
                InputError::new(format_args!(
                    "{}: surface {:?}: where one surface has an `absorptance` this one needs it, too, or an `emissivity`: what it does with sunlight",
                    self.names.first().map_or("", Origin::name),
                    own.name
                ))
            })
        });
        all.collect::<Result<_, _>>().map(Some)
    }

    /// The scene with black surfaces, for what asks for places alone.
    ///
    /// # Errors
    /// As [`Self::scene`].
    pub fn geometry(&self) -> Result<Scene, InputError> {
        self.scene_of::<f64>(|_| Material::BLACK)
    }

    fn scene_of<F: fredholm_core::Real>(
        &self,
        material: fn(&SceneSurface) -> Material,
    ) -> Result<Scene, InputError> {
        let materials = self.surfaces.iter().map(|own| [material(own)]);
        let materials: Vec<[Material; 1]> = materials.collect();
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
        Scene::within::<F>(&surfaces, enclosure, self.moved)
            .and_then(|scene| scene.with_beams(self.lights.clone()))
            .and_then(|scene| match self.period {
                [0.0, 0.0, 0.0] => Ok(scene),
                period => scene.with_period(period),
            })
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
            | SceneError::Specular(at)
            | SceneError::Absorptance(at)
            | SceneError::Degenerate(at)
            | SceneError::NotConvex(at)
            | SceneError::NotPlanar { at, .. }
            | SceneError::TJunction { at, .. } => (Some(at), None),
            SceneError::Open { at, to, .. } => (Some(at), to),
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
            Some((file.place(line), at.surface, &surface.name))
        };
        let places: Vec<_> = [first, second]
            .into_iter()
            .flatten()
            .filter_map(describe)
            .collect();
        let Some((place, ..)) = places.first() else {
            let name = self.names.first().map_or("", Origin::name);
            return InputError::new(format_args!("{name}: {error}"));
        };
        let known: Vec<String> = places
            .iter()
            .map(|(place, number, name)| format!("surface {number} is {name:?}, {place}"))
            .collect();
        let hint = match error {
            SceneError::Degenerate(_) | SceneError::TJunction { .. } | SceneError::Open { .. } => {
                "; `weld = \"1 mm\"` joins vertices that are nearer to each other, and leaves out what is thinner"
            }
            _ => "",
        };
        InputError::new(format_args!(
            "{place}: {error} ({}){hint}",
            known.join("; ")
        ))
    }

    /// Which polygon of its file each polygon of a surface is a part of, from 0: meshes have some with more vertices than four, or off a plane.
    #[must_use]
    pub fn drawn(&self, surface: usize) -> Vec<usize> {
        let places = self
            .surfaces
            .get(surface)
            .map_or(&[][..], |own| &own.places);
        let is_mesh = |file: u32| {
            let origin = self.names.get(file as usize);
            origin.is_some_and(|own| is_mesh(Path::new(own.name())))
        };
        let mut numbers = vec![0; places.len().min(1)];
        for pair in places.windows(2) {
            let is_part = pair[0] == pair[1] && is_mesh(pair[1].0);
            numbers.push(numbers.last().copied().unwrap_or(0) + usize::from(!is_part));
        }
        numbers
    }

    /// The place of a file in the list.
    fn file(&mut self, name: &str) -> u32 {
        self.names.push(Origin::Lines(name.to_owned()));
        (self.names.len() - 1) as u32
    }

    /// A remark on surfaces of whose material nothing is said, which are black.
    #[must_use]
    pub fn without_material(&self) -> Option<String> {
        let names = self.listed(&|own| own.known == Known::Nothing)?;
        Some(format!(
            "nothing is said of the material of {names}: black, and dark or at 0 K"
        ))
    }

    /// What is missing for heat: surfaces of which an emissivity is given have neither a temperature nor a net flux.
    #[must_use]
    pub fn without_temperature(&self) -> Option<String> {
        let names = self.listed(&|own| own.known == Known::Emissivity)?;
        Some(format!(
            "an emissivity is given of {names}, and no `temperature` or `net_flux`"
        ))
    }

    /// The names of the surfaces that are mirrors in part, in a sentence.
    #[must_use]
    pub fn mirrors(&self) -> Option<String> {
        self.listed(&|own| own.specular > 0.0)
    }

    /// The names of such surfaces in a sentence, if there are any: the first ones, and how many more.
    fn listed(&self, is_such: &dyn Fn(&SceneSurface) -> bool) -> Option<String> {
        let own = self.surfaces.iter().filter(|own| is_such(own));
        let names: Vec<String> = own.map(|own| format!("{:?}", own.name)).collect();
        let (first, rest) = names.split_at(names.len().min(MOST_NAMES));
        let more = match rest.len() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        (!first.is_empty()).then(|| first.join(", ") + &more)
    }

    /// A question where every side of the box around all is longer than the highest building is high, and would be that of a room or a building in
    /// millimetres. Nothing follows from it.
    #[must_use]
    pub fn in_millimetres(&self) -> Option<String> {
        let polygons = || self.surfaces.iter().flat_map(|own| &own.polygons);
        let sides = [0, 1, 2].map(|k| {
            let all = || polygons().flat_map(Polygon::points).map(|p| p[k]);
            let (low, high) = (all().reduce(f64::min), all().reduce(f64::max));
            high.zip(low).map_or(0.0, |(high, low)| high - low)
        });
        let [x, y, z] = sides.map(|side| (1e3 * side).round() / 1e3);
        let may_be = |side: &f64| (HIGHEST..=1e3 * HIGHEST).contains(side);
        sides.iter().all(may_be).then(|| {
            format!(
                "the scene is {x} x {y} x {z}: is this in millimetres? Form factors are the same; for areas, fluxes and lamps in metres \
                 put it into metres, by `scale = 0.001` beside `mesh` in a problem file"
            )
        })
    }

    /// Refuses a file without surfaces.
    pub(crate) fn refuse_nothing(&self, source: &Source) -> Result<(), InputError> {
        let message = "a scene needs surfaces: `[[problem.surface]]`, or a `mesh`";
        match &self.is_empty_at {
            Some(place) => Err(source.error(place.clone(), message)),
            None => Ok(()),
        }
    }

    /// Adds the polygons of a surface seen from the other side, as a surface of their own, whose name this is.
    fn add_back(&mut self, surface: usize) -> String {
        let Some(mut back) = self.surfaces.get(surface).cloned() else {
            return String::new();
        };
        back.name.push_str(" (back)");
        back.back_of = Some(surface);
        let name = back.name.clone();
        self.surfaces.push(back);
        self.fill_back(self.surfaces.len() - 1);
        name
    }

    /// Gives a surface of backs the polygons that it has the backs of.
    fn fill_back(&mut self, at: usize) {
        let front = self.surfaces.get(at).and_then(|back| back.back_of);
        let Some(front) = front.and_then(|front| self.surfaces.get(front)) else {
            return;
        };
        let polygons = front.polygons.iter().map(shapes::reversed).collect();
        let places = front.places.clone();
        if let Some(back) = self.surfaces.get_mut(at) {
            (back.polygons, back.places) = (polygons, places);
        }
    }

    /// Adds a polygon with any number of vertices to a surface.
    fn add(
        &mut self,
        surface: usize,
        points: &[[f64; 3]],
        place: (u32, u32),
    ) -> Result<(), String> {
        self.add_without(surface, (points, Vec::new()), place)
    }

    /// Adds a polygon less some holes.
    fn add_without(
        &mut self,
        surface: usize,
        (points, holes): (&[[f64; 3]], Vec<Vec<[f64; 3]>>),
        place: (u32, u32),
    ) -> Result<(), String> {
        if surface >= self.surfaces.len() {
            return Err("there is no such surface".to_owned());
        }
        if points.len() < 3 || holes.iter().any(|hole| hole.len() < 3) {
            return Err("a polygon has at least three vertices".to_owned());
        }
        if points.len() + holes.iter().map(Vec::len).sum::<usize>() > MAX_VERTICES {
            return Err(format!("a polygon has at most {MAX_VERTICES} vertices"));
        }
        if self.weld.is_none() {
            return self.cut(surface, points, &holes, place, 0.0);
        }
        let points = points.to_vec();
        self.outlines.push(Outline {
            surface,
            points,
            holes,
            place,
        });
        Ok(())
    }

    /// Adds a polygon less some holes, cut into triangles and quadrilaterals; its vertices and holes may be off its plane by this.
    fn cut(
        &mut self,
        surface: usize,
        points: &[[f64; 3]],
        holes: &[Vec<[f64; 3]>],
        place: (u32, u32),
        off: f64,
    ) -> Result<(), String> {
        let Some(surface) = self.surfaces.get_mut(surface) else {
            return Err("there is no such surface".to_owned());
        };
        let whole = match holes.is_empty() {
            true => Vec::new(),
            false => outline::without(points, holes, off)?,
        };
        let points = if whole.is_empty() { points } else { &whole };
        outline::cut(points, off, &mut |polygon| {
            surface.polygons.push(polygon);
            surface.places.push(place);
        })
    }

    fn place_of(&self, (file, number): (u32, u32)) -> String {
        let origin = self.names.get(file as usize);
        origin.map_or_else(String::new, |origin| origin.place(number))
    }

    /// The number of polygons so far, cut or not.
    fn polygons(&self) -> usize {
        let cut: usize = self.surfaces.iter().map(|own| own.polygons.len()).sum();
        cut + self.outlines.len()
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
    EpJson,
    #[cfg(feature = "parts")]
    Molflow,
}

/// The format of a file by the end of its name.
fn format_of(path: &Path) -> Option<Format> {
    let end = path.extension()?.to_str()?.to_ascii_lowercase();
    match end.as_str() {
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        "ply" => Some(Format::Ply),
        "vs3" => Some(Format::Vs3),
        "epjson" => Some(Format::EpJson),
        #[cfg(feature = "parts")]
        "geo" => Some(Format::Molflow),
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
    read_welded(path, None)
}

/// Reads a mesh or deck, and welds its vertices: those nearer to each other than a distance are one, if it is given.
///
/// # Errors
/// What cannot be read, or is wrong, with its place.
pub fn read_welded(path: &Path, weld: Option<f64>) -> Result<SceneFile, InputError> {
    let name = path.display().to_string();
    let mut scene = parse_outlines(&name, load(path, MAX_BYTES)?, weld)?;
    scene.finish(&name)?;
    Ok(scene)
}

/// Reads the mesh or deck of this name, whose end says the format.
///
/// # Errors
/// What is wrong, with its place.
pub fn parse_mesh(name: &str, bytes: Vec<u8>) -> Result<SceneFile, InputError> {
    let mut scene = parse_outlines(name, bytes, None)?;
    scene.finish(name)?;
    Ok(scene)
}

/// The surfaces of a mesh or deck; what is to be welded is not cut yet.
fn parse_outlines(name: &str, bytes: Vec<u8>, weld: Option<f64>) -> Result<SceneFile, InputError> {
    let Some(format) = format_of(Path::new(name)) else {
        return Err(InputError::new(format_args!(
            "{name}: a mesh is an .obj, .stl, .ply, .vs3 or .epJSON file, or Molflow's .geo"
        )));
    };
    let mut scene = SceneFile {
        weld,
        ..SceneFile::default()
    };
    let file = scene.file(name);
    match format {
        Format::Stl => stl::read(&mut scene, file, name, &bytes)?,
        Format::Ply => ply::read(&mut scene, file, name, &bytes)?,
        Format::EpJson => epjson::read(&mut scene, file, name, &bytes)?,
        _ => {
            // Names and comments may be in any encoding; numbers are not.
            let text = String::from_utf8_lossy(&bytes).into_owned();
            let read = match format {
                Format::Obj => obj::read(&mut scene, file, &joined(&text)),
                #[cfg(feature = "parts")]
                Format::Molflow => molflow::read(&mut scene, file, &text),
                _ => vs3::read(&mut scene, file, &text),
            };
            let source = Source {
                name: name.to_owned(),
                text,
            };
            read.map_err(|wrong| wrong.at(&source))?;
        }
    }
    let mut used = vec![false; scene.surfaces.len()];
    for outline in &scene.outlines {
        used[outline.surface] = true;
    }
    // Groups of OBJ files without faces.
    let is_used = |(at, own): (usize, &SceneSurface)| used[at] || !own.polygons.is_empty();
    let kept: Vec<bool> = scene.surfaces.iter().enumerate().map(is_used).collect();
    let numbers: Vec<usize> = kept
        .iter()
        .scan(0, |next, &kept| {
            let own = *next;
            *next += usize::from(kept);
            Some(own)
        })
        .collect();
    let mut kept = kept.into_iter();
    scene.surfaces.retain(|_| kept.next() == Some(true));
    for outline in &mut scene.outlines {
        outline.surface = numbers[outline.surface];
    }
    distinguish(&mut scene.surfaces);
    if scene.surfaces.is_empty() {
        return Err(InputError::new(format_args!("{name}: there are no faces")));
    }
    Ok(scene)
}

impl SceneFile {
    /// Welds and cuts what is left to be.
    fn finish(&mut self, name: &str) -> Result<(), InputError> {
        for surface in core::mem::take(&mut self.two_sided) {
            self.add_back(surface);
        }
        let Some(near) = self.weld.take() else {
            return Ok(());
        };
        self.weld(near)?;
        match self.surfaces.iter().all(|own| own.polygons.is_empty()) {
            true => Err(InputError::new(format_args!(
                "{name}: no polygon is wider than the weld, {near}"
            ))),
            false => Ok(()),
        }
    }
}

/// An error of a file without lines, or one that no line shows.
fn nowhere(name: &str, message: impl Display) -> InputError {
    InputError::new(format_args!("{name}: {message}"))
}

#[cfg(test)]
mod tests;
