//! The surfaces of a room, with their names.

use core::fmt;
use std::collections::BTreeMap;

use fredholm_core::Real;
use fredholm_room::{Enclosure, Material, Outside, Place, RoomError, Scene, Surface};

use super::leaks;
use fredholm_model::Error;

/// The surfaces of a room, as the scene takes them, and their names.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    /// The names of the surfaces in targets and results.
    pub names: Vec<String>,
    /// The vertices of each, its active side on the left.
    pub points: Vec<Vec<[f64; 2]>>,
    /// The materials of each: one, or one for every segment.
    pub materials: Vec<Vec<Material>>,
    /// The emissivities of surfaces from which the net flux is given, by their numbers: one, or one for every segment. They
    /// tell the temperatures of such surfaces, and nothing else.
    pub emissivities: BTreeMap<usize, Vec<f64>>,
    /// Whether temperatures or net fluxes are given: results are in W/m² then.
    pub heat: bool,
    /// Whether light that leaves is absorbed.
    pub open: bool,
    /// The light that comes into an open room from outside.
    pub outside: Vec<Outside<f64>>,
    /// The period with which an open room repeats to the right and to the left without end.
    pub period: Option<f64>,
    /// Whether the net fluxes of all surfaces are left out although there are temperatures.
    pub without_fluxes: bool,
    /// Whether they are those of a View2D deck alone.
    pub is_deck: bool,
}

impl Surfaces {
    /// Adds a surface of one material along these vertices, its active side on the left.
    #[must_use]
    pub fn with(mut self, name: &str, points: &[[f64; 2]], material: Material) -> Self {
        self.names.push(name.to_owned());
        self.points.push(points.to_vec());
        self.materials.push(vec![material]);
        self
    }

    /// The scene for walks in `F`.
    ///
    /// # Errors
    /// [`Error::Scene`], which names surfaces.
    pub fn scene<F: Real>(&self) -> Result<Scene, Error> {
        let enclosure = if self.open {
            Enclosure::Open
        } else {
            Enclosure::Closed
        };
        self.checked::<F>(enclosure).map_err(|error| {
            let (message, place) = self.explain(error);
            Error::Scene { message, place }
        })
    }

    fn checked<F: Real>(&self, enclosure: Enclosure) -> Result<Scene, RoomError> {
        let surfaces = self.points.iter().zip(&self.materials);
        let surfaces = surfaces.map(|(points, materials)| Surface { points, materials });
        let surfaces: Vec<_> = surfaces.collect();
        let scene = match self.period {
            Some(period) => Scene::periodic::<F>(&surfaces, period)?,
            None => Scene::new::<F>(&surfaces, enclosure)?,
        };
        scene.with_outside(self.outside.clone())
    }

    /// The point and direction in which light leaves a room that should be closed.
    #[must_use]
    pub fn leaving_ray(&self) -> Option<[[f64; 2]; 2]> {
        let walls = Self {
            outside: Vec::new(),
            period: None,
            ..self.clone()
        };
        match walls.checked::<f64>(Enclosure::Closed) {
            Err(RoomError::Open {
                from, direction, ..
            }) => Some([from, direction]),
            _ => None,
        }
    }

    /// The vertices of the parts of every surface that others do not cover, in the order of the surface; of a scene that is
    /// refused, all of it.
    #[must_use]
    pub fn parts_in_room(&self) -> Vec<Vec<Vec<[f64; 2]>>> {
        let scene = self.scene::<f64>().ok();
        let covered = scene.as_ref().map_or(&[][..], Scene::covered);
        let of = |(surface, points): (usize, &Vec<[f64; 2]>)| {
            let mut parts = Vec::new();
            let mut part: Vec<[f64; 2]> = points.first().copied().into_iter().collect();
            for (vertex, end) in points.iter().skip(1).enumerate() {
                let place = Place { surface, vertex };
                for hidden in covered.iter().filter(|hidden| hidden.place == place) {
                    let [from, to] = hidden.ends;
                    if part.last() != Some(&from) {
                        part.push(from);
                    }
                    parts.push(core::mem::replace(&mut part, vec![to]));
                }
                if part.last() != Some(end) {
                    part.push(*end);
                }
            }
            parts.push(part);
            parts.retain(|part| part.len() > 1);
            parts
        };
        self.points.iter().enumerate().map(of).collect()
    }

    /// "surface "floor", vertex 2".
    fn place(&self, place: Place) -> String {
        let name = self.names.get(place.surface).map_or("?", String::as_str);
        format!("surface {name:?}, vertex {}", place.vertex + 1)
    }

    /// What is wrong with a scene, with the names of its surfaces, and where.
    fn explain(&self, error: RoomError) -> (String, Option<Place>) {
        let place = error.place();
        let (at, from, direction) = match error {
            RoomError::Open {
                at,
                from,
                direction,
            } => (at, from, direction),
            RoomError::NothingAbsorbs(at) if self.heat => {
                let message = format!(
                    "{}: no wall of this part of the room has a temperature: if all net fluxes are given there is no steady state, or more \
                     than one; give one surface at least a `temperature`",
                    self.place(at)
                );
                return (message, place);
            }
            error => return (Named(&error, &|place| self.place(place)).to_string(), place),
        };
        let way_out = self.gap().unwrap_or_else(|| {
            "close the gap, or turn surfaces whose active side is not on the left".to_owned()
        });
        let open = match self.is_deck {
            true => "set `encl` to 0 in line C of the deck",
            false => "say `open = true`",
        };
        let message = format!(
            "{}: the room is not closed here: light leaves, or meets a wall from behind, from {} in direction {}; {way_out}; if light may \
             leave, {open}",
            self.place(at),
            leaks::point(from),
            leaks::direction(direction)
        );
        (message, place)
    }

    /// The emissivity of a segment from which the net flux is given, if it is known.
    pub(super) fn emissivity(&self, place: Place) -> Option<f64> {
        let own = self.emissivities.get(&place.surface)?;
        own.get(place.vertex).or(own.first()).copied()
    }
}

/// An error with the names of places.
struct Named<'a>(&'a RoomError, &'a dyn Fn(Place) -> String);

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.describe(f, self.1)
    }
}
