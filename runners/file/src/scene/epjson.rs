//! Models of EnergyPlus (`.epJSON`): the zones, seen from inside.
//!
//! `BuildingSurface:Detailed` and its kin have the vertices of walls, floors and ceilings, in the order and from the side that
//! `GlobalGeometryRules` says; `FenestrationSurface:Detailed` those of windows and doors, which are cut out of their surface. Relative coordinates
//! are those of the zone. Emissivities are those of the innermost layers of constructions. What is outside of zones, such as shading, is left out.

use std::collections::HashMap;

use fredholm_scene::Material;
use serde_json::{Map, Value};

use super::{Known, Origin, SceneFile, SceneSurface, nearest, nowhere};
use crate::InputError;

type Point = [f64; 3];
type Objects = Map<String, Value>;

/// The types of surfaces of zones.
const SURFACES: [&str; 4] = [
    "BuildingSurface:Detailed",
    "Wall:Detailed",
    "RoofCeiling:Detailed",
    "Floor:Detailed",
];
/// The type of windows and doors.
const WINDOWS: &str = "FenestrationSurface:Detailed";
/// The most vertices that EnergyPlus gives a window.
const MOST_OF_WINDOW: usize = 4;
/// The emissivities of EnergyPlus where a material says nothing.
const OPAQUE: f64 = 0.9;
const GLASS: f64 = 0.84;

/// A surface or a window.
struct Face<'j> {
    name: &'j str,
    object: &'j Value,
    points: Vec<Point>,
    holes: Vec<usize>,
}

/// What a model says.
struct Model<'j> {
    root: &'j Objects,
    /// Whether vertices go anticlockwise seen from outside.
    is_anticlockwise: bool,
    is_relative: bool,
}

/// A text of an object, in lower case: EnergyPlus does not tell cases apart.
fn word(object: &Value, key: &str) -> Option<String> {
    Some(object.get(key)?.as_str()?.to_lowercase())
}

fn number(object: &Value, key: &str) -> f64 {
    object.get(key).and_then(Value::as_f64).unwrap_or(0.0)
}

pub(super) fn read(
    scene: &mut SceneFile,
    file: u32,
    name: &str,
    bytes: &[u8],
) -> Result<(), InputError> {
    let root: Value = serde_json::from_slice(bytes)
        .map_err(|error| nowhere(name, format_args!("not valid JSON: {error}")))?;
    let Some(root) = root.as_object() else {
        return Err(nowhere(
            name,
            "an epJSON file is an object of types of objects",
        ));
    };
    let rules = root
        .get("GlobalGeometryRules")
        .and_then(|own| own.as_object()?.values().next());
    let rule = |key| rules.and_then(|rules| word(rules, key));
    let model = Model {
        root,
        is_anticlockwise: rule("vertex_entry_direction").is_none_or(|way| way != "clockwise"),
        is_relative: rule("coordinate_system").is_some_and(|system| system == "relative"),
    };
    let mut faces = Vec::new();
    let mut numbers: HashMap<String, usize> = HashMap::new();
    for (own, object) in SURFACES.iter().flat_map(|kind| model.of(kind)) {
        let points = listed(object).map_err(|wrong| {
            let message = format_args!(
                "{own:?}: {wrong}: `vertices` must be a list of objects with the numbers `vertex_x_coordinate` and so on"
            );
            nowhere(name, message)
        })?;
        let zone = word(object, "zone_name");
        let points = points.into_iter().map(|p| model.placed(p, zone.as_deref()));
        numbers.insert(own.to_lowercase(), faces.len());
        faces.push(Face {
            name: own,
            object,
            points: points.collect(),
            holes: Vec::new(),
        });
    }
    for (own, object) in model.of(WINDOWS) {
        let base = word(object, "building_surface_name");
        let Some(&base) = base.as_ref().and_then(|base| numbers.get(base)) else {
            let known: Vec<&str> = faces.iter().map(|face| face.name).collect();
            let near = base.as_ref().and_then(|base| nearest(base, &known));
            let near = near.map_or(String::new(), |near| format!("; did you mean {near:?}?"));
            let message = format_args!(
                "{own:?}: its `building_surface_name`, {:?}, is that of no surface{near}",
                base.unwrap_or_default()
            );
            return Err(nowhere(name, message));
        };
        let zone = word(faces[base].object, "zone_name");
        let points = numbered(object)
            .into_iter()
            .map(|p| model.placed(p, zone.as_deref()));
        let (number, points) = (faces.len(), points.collect::<Vec<_>>());
        if points.len() < 3 {
            let message = format_args!(
                "{own:?}: a window has at least three vertices, `vertex_1_x_coordinate` and so on, and this one has {}",
                points.len()
            );
            return Err(nowhere(name, message));
        }
        faces[base].holes.push(number);
        faces.push(Face {
            name: own,
            object,
            points,
            holes: Vec::new(),
        });
    }
    if model.is_anticlockwise {
        faces.iter_mut().for_each(|face| face.points.reverse());
    }
    if let Some(own) = scene.names.get_mut(file as usize) {
        let names = faces.iter().map(|face| face.name.to_owned());
        *own = Origin::Objects(name.to_owned(), names.collect());
    }
    for (number, face) in (0..).zip(&faces) {
        let mut surface = SceneSurface::new(face.name);
        surface.material = Material::grey(model.emissivity(face.object), 0.0);
        surface.known = Known::Emissivity;
        scene.surfaces.push(surface);
        let holes = face.holes.iter().map(|&hole| faces[hole].points.clone());
        let shape = (face.points.as_slice(), holes.collect());
        let added = scene.add_without(scene.surfaces.len() - 1, shape, (file, number));
        added.map_err(|message| {
            let holes = face
                .holes
                .iter()
                .map(|&hole| format!("{:?}", faces[hole].name));
            let cut = match holes.collect::<Vec<_>>() {
                none if none.is_empty() => String::new(),
                all => format!(" (of which is cut out {})", all.join(", ")),
            };
            nowhere(name, format_args!("{:?}: {message}{cut}", face.name))
        })?;
    }
    let outside = model
        .root
        .iter()
        .filter(|(kind, _)| kind.starts_with("Shading:"));
    let outside: usize = outside
        .filter_map(|(_, own)| Some(own.as_object()?.len()))
        .sum();
    if outside > 0 {
        scene.remarks.push(format!(
            "{outside} shading surfaces are outside of the zones, and left out"
        ));
    }
    Ok(())
}

impl<'j> Model<'j> {
    /// The objects of a type, by name.
    fn of(&self, kind: &str) -> impl Iterator<Item = (&'j str, &'j Value)> + use<'j> {
        let all = self.root.get(kind).and_then(Value::as_object);
        all.into_iter()
            .flatten()
            .map(|(name, own)| (name.as_str(), own))
    }

    /// The object of a type and a name, which may be written in any case.
    fn find(&self, kind: &str, name: &str) -> Option<&'j Value> {
        self.of(kind)
            .find(|(own, _)| own.to_lowercase() == name)
            .map(|(_, own)| own)
    }

    /// A vertex in the building: of a zone's relative coordinates.
    fn placed(&self, p: Point, zone: Option<&str>) -> Point {
        let zone = zone
            .filter(|_| self.is_relative)
            .and_then(|zone| self.find("Zone", zone));
        let Some(zone) = zone else {
            return p;
        };
        // Clockwise from north.
        let turn = -number(zone, "direction_of_relative_north").to_radians();
        let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
        [
            number(zone, "x_origin") + cosine * p[0] - sine * p[1],
            number(zone, "y_origin") + sine * p[0] + cosine * p[1],
            number(zone, "z_origin") + p[2],
        ]
    }

    /// The emissivity of the innermost layer of an object's construction.
    fn emissivity(&self, object: &Value) -> f64 {
        let construction = word(object, "construction_name");
        let construction = construction.and_then(|name| self.find("Construction", &name));
        let Some(construction) = construction else {
            return OPAQUE;
        };
        let inner = (2..=10)
            .rev()
            .find_map(|layer| word(construction, &format!("layer_{layer}")));
        let Some(inner) = inner.or_else(|| word(construction, "outside_layer")) else {
            return OPAQUE;
        };
        let given = |kind: &str, key: &str, default: f64| {
            let own = self.find(kind, &inner)?;
            Some(own.get(key).and_then(Value::as_f64).unwrap_or(default))
        };
        let emissivity = given("Material", "thermal_absorptance", OPAQUE)
            .or_else(|| given("Material:NoMass", "thermal_absorptance", OPAQUE))
            .or_else(|| {
                given(
                    "WindowMaterial:Glazing",
                    "back_side_infrared_hemispherical_emissivity",
                    GLASS,
                )
            });
        emissivity
            .filter(|own| *own > 0.0 && *own <= 1.0)
            .unwrap_or(OPAQUE)
    }
}

/// The vertices of a surface, or what is missing.
fn listed(object: &Value) -> Result<Vec<Point>, String> {
    let all = object.get("vertices").and_then(Value::as_array);
    let all = all.ok_or_else(|| "there are no vertices".to_owned())?;
    let keys = [
        "vertex_x_coordinate",
        "vertex_y_coordinate",
        "vertex_z_coordinate",
    ];
    let point = |own: &Value| {
        let [x, y, z] = keys.map(|key| own.get(key).and_then(Value::as_f64));
        Some([x?, y?, z?])
    };
    let known = |(number, own)| point(own).ok_or_else(|| format!("vertex {number} has no place"));
    (1..).zip(all).map(known).collect::<Result<_, String>>()
}

/// The vertices of a window, which have numbers.
fn numbered(object: &Value) -> Vec<Point> {
    let point = |vertex: usize| {
        let [x, y, z] = ["x", "y", "z"].map(|axis| {
            let key = format!("vertex_{vertex}_{axis}_coordinate");
            object.get(&key).and_then(Value::as_f64)
        });
        Some([x?, y?, z?])
    };
    (1..=MOST_OF_WINDOW).map_while(point).collect()
}
