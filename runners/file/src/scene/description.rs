//! Scenes in TOML: `[problem]` with `kind = "scene"`.

use core::array::from_fn;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

use fredholm_scene::{Polygon, shapes};
use toml::de::{DeTable, DeValue};

use super::material::Given;
use super::weld::Outline;
use super::{
    MAX_BYTES, MAX_POLYGONS, SceneFile, SceneSurface, light, parse_outlines, sky, symmetry, vacuum,
};
use crate::channels::names_or_bands;
use crate::load;
use crate::place::{InputError, Place, Placed, Source};
use crate::section::{Field, Section, nearest};
use crate::validate::{UNPRINTABLE, is_printable};

/// The kinds of problems that are scenes: of light or heat, and of molecules.
pub(crate) const KINDS: [&str; 2] = ["scene", VACUUM];
/// The kind of scenes of molecules.
const VACUUM: &str = "vacuum";

/// Whether the text of a problem file describes a scene, by the kind of its `[problem]`.
#[must_use]
pub fn is_description(text: &str) -> bool {
    let Ok(tree) = DeTable::parse(text) else {
        return false;
    };
    let problem = tree.get_ref().get("problem").map(|value| value.get_ref());
    let kind = problem.and_then(|problem| problem.as_table()?.get("kind"));
    kind.is_some_and(
        |kind| matches!(kind.get_ref(), DeValue::String(word) if KINDS.contains(&word.as_ref())),
    )
}

/// Where polygons of this file go.
pub(super) struct Reader<'s> {
    pub(super) source: &'s Source,
    pub(super) scene: SceneFile,
    known: HashMap<String, usize>,
    /// The number of channels, once it is known.
    pub(super) channels: Option<usize>,
    /// What surfaces of these names do with molecules.
    of_gas: Vec<(String, vacuum::Words)>,
}

/// Reads the description of a scene with the name `name` and the content `text`.
///
/// # Errors
/// What is wrong, with its place.
pub fn parse_description(name: &str, text: &str) -> Result<SceneFile, InputError> {
    let source = Source {
        name: name.to_owned(),
        text: text.to_owned(),
    };
    let tree = DeTable::parse(text).map_err(|error| {
        let span = error.span().unwrap_or(0..0);
        source.error(span, format_args!("not valid TOML: {}", error.message()))
    })?;
    let mut root = Section::new(&source, "at the top level", 0..0, tree.into_inner());
    let mut problem = root.required("problem")?.section("in `[problem]`")?;
    // What is solved and how is nothing to form factors.
    for other in ["galerkin", "walk"] {
        let _ = root.optional(other);
    }
    let has_targets = root.optional("target").is_some();
    root.finish()?;
    let kind = problem.required("kind")?;
    let word = kind.text()?;
    if !KINDS.contains(&word) {
        return Err(kind.error("this is no scene: `kind` must be \"scene\" or \"vacuum\""));
    }
    let scene = of_problem(&source, problem, word == VACUUM)?;
    scene.refuse_nothing(&source)?;
    Ok(SceneFile {
        has_targets,
        ..scene
    })
}

/// Reads the rest of `[problem]`, whose `kind` is known: a scene, or one of molecules.
pub(crate) fn of_problem(
    source: &Source,
    mut problem: Section<'_, '_>,
    is_vacuum: bool,
) -> Result<SceneFile, InputError> {
    let gas = is_vacuum.then(|| vacuum::read(&mut problem)).transpose()?;
    let open = problem.read("open", Field::boolean)?;
    let mesh = problem.optional("mesh");
    let inward = problem.optional("inward");
    let mut placing = Placing::read(&mut problem)?;
    if let Some(key) = &inward {
        placing.inside_out = key.boolean()?.value;
    }
    if let (None, Some(key)) = (&mesh, inward.as_ref().or(placing.key.as_ref())) {
        return Err(key.unsuited(
            "this places the `mesh` of `[problem]`, and there is none: put it into each `[[problem.surface]]`",
        ));
    }
    let weld = problem.optional("weld").as_ref().map(length).transpose()?;
    let planes = symmetry::read(&mut problem)?;
    let period = period(&mut problem, open.as_ref())?;
    let sky = sky::read(&mut problem, open.as_ref(), false)?;
    let net_fluxes = problem.read("net_fluxes", Field::boolean)?;
    let photometric = problem.read("photometric", Field::boolean)?;
    let lights = light::read(&mut problem)?;
    let channels = problem.optional("channels");
    let wavelengths = problem.optional("wavelengths");
    let (names, bands) = names_or_bands(channels.as_ref(), wavelengths.as_ref())?;
    let surfaces = problem.optional("surface");
    problem.finish()?;
    let mut reader = Reader {
        source,
        scene: SceneFile {
            open: sky.is_some() || period != [0.0; 3] || open.is_some_and(|open| open.value),
            period,
            heat: sky.as_ref().is_some_and(|sky| sky.is_heat),
            sky,
            lights,
            without_fluxes: net_fluxes.is_some_and(|wanted| !wanted.value),
            channels: names,
            bands,
            is_photometric: photometric.as_ref().is_some_and(|wanted| wanted.value),
            weld,
            gas,
            ..SceneFile::default()
        },
        known: HashMap::new(),
        channels: None,
        of_gas: Vec::new(),
    };
    if !reader.scene.channels.is_empty() {
        reader.channels = Some(reader.scene.channels.len());
    }
    if let Some(field) = wavelengths.as_ref() {
        reader.refuse_light_in_bands(field)?;
    }
    reader.scene.file(&source.name);
    if let Some(mesh) = mesh {
        reader.mesh(&mesh, &placing)?;
    }
    if let Some(field) = surfaces {
        field.tables("in `[[problem.surface]]`", |own| reader.surface(own))?;
    }
    reader.scene.finish(&source.name)?;
    if reader.scene.surfaces.is_empty() {
        reader.scene.is_empty_at = Some(problem.span.clone());
    }
    if let Some(plane) = planes.first().filter(|_| !reader.scene.lights.is_empty()) {
        return Err(plane.refuse_lights());
    }
    symmetry::complete(&mut reader.scene, &planes)?;
    vacuum::finish(&mut reader.scene, &reader.of_gas, source)?;
    reader.finish_channels(channels.as_ref())?;
    if let Some(wanted) = photometric.filter(|wanted| wanted.value)
        && (reader.scene.heat || !reader.scene.channels.is_empty())
    {
        return Err(reader.error(
            &wanted.place,
            "photometric units are of light in one channel: leave `photometric` out, or temperatures and channels",
        ));
    }
    Ok(reader.scene)
}

/// Where a mesh or a surface is put: scaled, then turned about the axes x, y and z, then moved; and perhaps turned inside out.
struct Placing<'s, 'i> {
    scale: f64,
    turn: [[f64; 3]; 3],
    shift: [f64; 3],
    inside_out: bool,
    /// The first key of it.
    key: Option<Field<'s, 'i>>,
}

impl<'s, 'i> Placing<'s, 'i> {
    fn read(section: &mut Section<'s, 'i>) -> Result<Self, InputError> {
        let scale = section.optional("scale");
        let rotate = section.optional("rotate");
        let translate = section.optional("translate");
        let scale_key = scale;
        let scale = match &scale_key {
            Some(field) => {
                let scale = field.number()?.value;
                if !(scale > 0.0 && scale.is_finite()) {
                    return Err(field.error("`scale` must be more than 0"));
                }
                scale
            }
            None => 1.0,
        };
        let three = |field: &Option<Field<'_, '_>>| match field {
            Some(field) => triple(field).map(|triple| triple.value),
            None => Ok([0.0; 3]),
        };
        let angles = three(&rotate)?;
        let mut turn = from_fn(|i| from_fn(|j| f64::from(u8::from(i == j))));
        for (axis, degrees) in angles.into_iter().enumerate() {
            turn = product(rotation(axis, degrees), turn);
        }
        Ok(Self {
            scale,
            turn,
            shift: three(&translate)?,
            inside_out: false,
            key: scale_key.or(rotate).or(translate),
        })
    }

    fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        from_fn(|i| {
            let turned: f64 = (0..3).map(|j| self.turn[i][j] * p[j]).sum();
            self.scale * turned + self.shift[i]
        })
    }

    /// A polygon that is not cut yet where it is put.
    fn moved(&self, mut outline: Outline) -> Outline {
        let holes = outline.holes.iter_mut().flatten();
        let points = outline.points.iter_mut().chain(holes);
        points.for_each(|p| *p = self.apply(*p));
        if self.inside_out {
            outline.points.reverse();
            outline.holes.iter_mut().for_each(|hole| hole.reverse());
        }
        outline
    }

    fn is_none(&self) -> bool {
        self.scale == 1.0 && self.shift == [0.0; 3] && (0..3).all(|i| self.turn[i][i] == 1.0)
    }
}

/// A turn by degrees about an axis; quarters are exact.
fn rotation(axis: usize, degrees: f64) -> [[f64; 3]; 3] {
    let (sine, cosine) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => (libm::sin(other.to_radians()), libm::cos(other.to_radians())),
    };
    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut m = [[0.0; 3]; 3];
    m[axis][axis] = 1.0;
    m[j][j] = cosine;
    m[j][k] = -sine;
    m[k][j] = sine;
    m[k][k] = cosine;
    m
}

fn product(a: [[f64; 3]; 3], b: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    from_fn(|i| from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

impl Reader<'_> {
    /// All surfaces of a mesh, or of several.
    fn mesh(&mut self, field: &Field<'_, '_>, placing: &Placing<'_, '_>) -> Result<(), InputError> {
        let paths = match &field.value {
            DeValue::Array(_) => field.strings()?.value,
            _ => Vec::from([field.string()?]),
        };
        for path in &paths {
            let mut mesh = self.load(path)?;
            let first = self.scene.surfaces.len();
            self.of_gas.append(&mut mesh.of_gas);
            self.scene
                .two_sided
                .extend(mesh.two_sided.iter().map(|own| first + own));
            self.scene
                .outlines
                .extend(mesh.outlines.into_iter().map(|own| Outline {
                    surface: first + own.surface,
                    ..placing.moved(own)
                }));
            for surface in mesh.surfaces {
                if self.known.contains_key(&surface.name) {
                    let message =
                        format!("a second surface named {:?}, of this mesh", surface.name);
                    return Err(self.error(&path.place, message));
                }
                self.known
                    .insert(surface.name.clone(), self.scene.surfaces.len());
                self.scene.surfaces.push(moved(surface, placing));
            }
        }
        Ok(())
    }

    /// A mesh, with the places of its polygons in this scene's list of files.
    fn load(&mut self, path: &Placed<String>) -> Result<SceneFile, InputError> {
        let whole = beside(&self.source.name, &path.value);
        if !super::is_mesh(&whole) {
            return Err(self.error(
                &path.place,
                "a mesh is an .obj, .stl, .ply, .vs3 or .epJSON file, or Molflow's .geo",
            ));
        }
        let name = whole.display().to_string();
        let mesh = load(&whole, MAX_BYTES);
        let mesh = mesh.and_then(|bytes| parse_outlines(&name, bytes, self.scene.weld));
        let mut mesh = mesh.map_err(|error| self.error(&path.place, error))?;
        self.scene.remarks.append(&mut mesh.remarks);
        let file = self.scene.file(&name);
        for outline in &mut mesh.outlines {
            outline.place.0 = file;
        }
        for surface in &mut mesh.surfaces {
            for place in &mut surface.places {
                place.0 = file;
            }
        }
        Ok(mesh)
    }

    pub(super) fn error(&self, place: &Place, message: impl core::fmt::Display) -> InputError {
        match place {
            Place::File(span) => self.source.error(span.clone(), message),
            _ => InputError::new(message),
        }
    }

    /// One `[[problem.surface]]`.
    fn surface(&mut self, mut section: Section<'_, '_>) -> Result<(), InputError> {
        let name = section.required("name")?.string()?;
        let read = self.named(&name, section);
        read.map_err(|error| error.of_surface(&name.value))
    }

    /// What is said of the surface of this name.
    fn named(
        &mut self,
        name: &Placed<String>,
        mut section: Section<'_, '_>,
    ) -> Result<(), InputError> {
        let shapes: Vec<Field<'_, '_>> = ["polygon", "polygons", "box", "mesh"]
            .into_iter()
            .filter_map(|key| section.optional(key))
            .collect();
        let holes = section.optional("holes");
        let inward_key = section.optional("inward");
        let inward = inward_key.as_ref().map(Field::boolean).transpose()?;
        let two_sided = section.read("two_sided", Field::boolean)?;
        let mut placing = Placing::read(&mut section)?;
        let material = match self.scene.gas {
            Some(_) => {
                let words = vacuum::Words::read(&mut section)?;
                self.of_gas
                    .extend(words.map(|words| (name.value.clone(), words)));
                None
            }
            None => self.material(&mut section)?,
        };
        section.finish()?;
        if name.value.trim().is_empty() || name.value == "all" {
            return Err(self.error(
                &name.place,
                "the name of a surface must not be empty, nor \"all\"",
            ));
        }
        if !is_printable(&name.value) {
            return Err(self.error(&name.place, UNPRINTABLE));
        }
        let shape = match shapes.as_slice() {
            [] => return self.change(name, material),
            [shape] => shape,
            [_, second, ..] => {
                return Err(second.error("give one of `polygon`, `polygons`, `box`, `mesh`"));
            }
        };
        if let Some(key) = inward_key.filter(|_| !matches!(shape.name.as_str(), "box" | "mesh")) {
            return Err(key.unsuited("`inward` turns a `box` or a `mesh` inside out"));
        }
        if let Some(key) = holes.as_ref().filter(|_| shape.name != "polygon") {
            return Err(key.unsuited("`holes` are cut out of a `polygon`"));
        }
        if self.known.contains_key(&name.value) {
            let message = format!("a second surface named {:?}", name.value);
            return Err(self.error(&name.place, message));
        }
        let mut own = SceneSurface::new(name.value.clone());
        if let Some(given) = material {
            self.scene.heat |= given.is_heat;
            own.give(&given);
        }
        let at = self.scene.surfaces.len();
        self.known.insert(name.value.clone(), at);
        self.scene.surfaces.push(own);
        let inward = inward.is_some_and(|inward| inward.value);
        placing.inside_out = inward && shape.name == "mesh";
        let first = self.scene.outlines.len();
        self.shape((shape, holes.as_ref()), at, inward)?;
        if let Some(surface) = self.scene.surfaces.get_mut(at) {
            *surface = moved(surface.clone(), &placing);
        }
        for outline in self.scene.outlines.get_mut(first..).unwrap_or_default() {
            *outline = placing.moved(outline.clone());
        }
        if two_sided.is_some_and(|two| two.value) {
            let back = self.scene.add_back(at);
            if (self.known)
                .insert(back.clone(), self.scene.surfaces.len() - 1)
                .is_some()
            {
                let message = format!("a second surface named {back:?}");
                return Err(self.error(&name.place, message));
            }
        }
        if self.scene.polygons() > MAX_POLYGONS {
            return Err(self.error(
                &name.place,
                format_args!("more than {MAX_POLYGONS} polygons"),
            ));
        }
        Ok(())
    }

    /// The polygons of a surface.
    fn shape(
        &mut self,
        (field, holes): (&Field<'_, '_>, Option<&Field<'_, '_>>),
        at: usize,
        inward: bool,
    ) -> Result<(), InputError> {
        let place = |field: &Field<'_, '_>| (0, field.source.locate(field.span.start).line as u32);
        let mut add = |field: &Field<'_, '_>, points: &[[f64; 3]]| {
            let added = self.scene.add(at, points, place(field));
            added.map_err(|message| field.error(message))
        };
        match field.name.as_str() {
            "polygon" => {
                let points = polygon(field)?;
                let mut cut_out = Vec::new();
                if let Some(holes) = holes {
                    for hole in holes.items("a list of polygons")? {
                        cut_out.push(polygon(&hole)?);
                    }
                }
                let added = self.scene.add_without(at, (&points, cut_out), place(field));
                added.map_err(|message| field.error(message))
            }
            "polygons" => {
                let mut items = field.items("a list of polygons")?;
                items.try_for_each(|item| add(&item, &polygon(&item)?))
            }
            "box" => {
                let corners = polygon_of(field, 2, "two corners [x, y, z]")?;
                let [low, high] = [corners[0], corners[1]];
                if (0..3).any(|k| !(low[k] < high[k])) {
                    return Err(field
                        .error("a box has two corners, the lower one first in every coordinate"));
                }
                let shape = if inward {
                    shapes::room(low, high)
                } else {
                    shapes::block(low, high)
                };
                let mut polygons = shape.surfaces.iter().flatten();
                polygons.try_for_each(|polygon| add(field, polygon.points()))
            }
            _ => {
                let path = field.string()?;
                let mesh = self.load(&path)?;
                if !mesh.of_gas.is_empty() {
                    let message = "a geometry of Molflow has surfaces of its own: give it as the `mesh` of `[problem]`";
                    return Err(field.error(message));
                }
                let outlines = mesh.outlines.into_iter();
                self.scene
                    .outlines
                    .extend(outlines.map(|own| Outline { surface: at, ..own }));
                if let Some(surface) = self.scene.surfaces.get_mut(at) {
                    for part in mesh.surfaces {
                        surface.polygons.extend(part.polygons);
                        surface.places.extend(part.places);
                    }
                }
                Ok(())
            }
        }
    }

    /// The material of a surface of the mesh.
    fn change(&mut self, name: &Placed<String>, material: Option<Given>) -> Result<(), InputError> {
        let found = self
            .known
            .get(&name.value)
            .and_then(|&at| self.scene.surfaces.get_mut(at));
        if let Some(surface) = found {
            if let Some(given) = material {
                self.scene.heat |= given.is_heat;
                surface.give(&given);
            }
            return Ok(());
        }
        let names: Vec<&String> = self.known.keys().collect();
        let near = nearest(&name.value, &names);
        let near = near.map_or(String::new(), |near| format!("; did you mean {near:?}?"));
        let message = format!(
            "this surface has no `polygon`, `polygons`, `box` or `mesh`, and no mesh above has one of this name{near}"
        );
        Err(self.error(&name.place, message))
    }
}

/// The path of a file that stands in another.
fn beside(name: &str, path: &str) -> PathBuf {
    let folder = Path::new(name).parent();
    folder.map_or_else(|| PathBuf::from(path), |folder| folder.join(path))
}

/// The surface where it is put.
fn moved(mut surface: SceneSurface, placing: &Placing<'_, '_>) -> SceneSurface {
    if !placing.is_none() {
        for polygon in &mut surface.polygons {
            *polygon = match polygon {
                Polygon::Triangle(p) => Polygon::Triangle(p.map(|p| placing.apply(p))),
                Polygon::Quad(p) => Polygon::Quad(p.map(|p| placing.apply(p))),
            };
        }
    }
    if placing.inside_out {
        let polygons = surface.polygons.iter_mut();
        polygons.for_each(|polygon| *polygon = shapes::reversed(polygon));
    }
    surface
}

/// A length in the scene's unit, which is a metre where it is text with a unit: "1 mm".
fn length(field: &Field<'_, '_>) -> Result<f64, InputError> {
    let metres = match &field.value {
        DeValue::String(text) => metres(text),
        _ => Some(field.number()?.value),
    };
    let metres = metres.filter(|metres| *metres > 0.0 && metres.is_finite());
    metres.ok_or_else(|| {
        field.error(
            "a length is a number more than 0, or text such as \"1 mm\", \"0.5 cm\" or \"2 m\"",
        )
    })
}

/// The metres of a text such as "1 mm".
#[must_use]
pub fn metres(text: &str) -> Option<f64> {
    let text = text.trim();
    let units = [
        ("um", 1e-6),
        ("µm", 1e-6),
        ("mm", 1e-3),
        ("cm", 1e-2),
        ("m", 1.0),
    ];
    let (number, unit) = (units.iter())
        .find_map(|(name, unit)| Some((text.strip_suffix(name)?, *unit)))
        .unwrap_or((text, 1.0));
    Some(number.trim_end().parse::<f64>().ok()? * unit)
}

/// What `period` says, `{ x = 6, y = 4 }`: 0 along other axes.
fn period(
    section: &mut Section<'_, '_>,
    open: Option<&Placed<bool>>,
) -> Result<[f64; 3], InputError> {
    let mut lengths = [0.0; 3];
    let Some(field) = section.optional("period") else {
        return Ok(lengths);
    };
    if open.is_some_and(|open| !open.value) {
        return Err(
            field.unsuited("a scene with a period is open: leave `period` or `open = false` out")
        );
    }
    let mut own = field.section("in `period`")?;
    for (length, name) in lengths.iter_mut().zip(["x", "y", "z"]) {
        if let Some(field) = own.optional(name) {
            *length = field.number()?.value;
            if !(*length > 0.0 && length.is_finite()) {
                return Err(field.error("a period must be a finite number more than 0"));
            }
        }
    }
    own.finish()?;
    if lengths == [0.0; 3] {
        return Err(own.error("a period is along an axis: `period = { x = 6 }`"));
    }
    Ok(lengths)
}

/// Three numbers.
pub(super) fn triple(field: &Field<'_, '_>) -> Result<Placed<[f64; 3]>, InputError> {
    let numbers = field.elements("three numbers [x, y, z]", Field::number)?;
    match numbers.value.as_slice() {
        [x, y, z] => Ok(Placed::file(
            field.span.clone(),
            [x.value, y.value, z.value],
        )),
        _ => Err(field.error("three numbers are needed: [x, y, z]")),
    }
}

/// The vertices of a polygon.
fn polygon(field: &Field<'_, '_>) -> Result<Vec<[f64; 3]>, InputError> {
    polygon_of(field, 3, "a list of at least three points [x, y, z]")
}

/// At least so many points.
fn polygon_of(
    field: &Field<'_, '_>,
    least: usize,
    what: &str,
) -> Result<Vec<[f64; 3]>, InputError> {
    let points = field.elements(what, |item| Ok(triple(item)?.value))?.value;
    if points.len() < least || (least == 2 && points.len() > 2) {
        return Err(field.mistyped(what));
    }
    Ok(points)
}
