//! The surfaces of a room, with their names.

use std::collections::BTreeMap;

use fredholm_core::Real;
use fredholm_room::{Enclosure, Material, Place, RoomError, Scene, Surface};

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
        let surfaces = self.points.iter().zip(&self.materials);
        let surfaces: Vec<Surface<'_>> = surfaces
            .map(|(points, materials)| Surface { points, materials })
            .collect();
        let enclosure = if self.open {
            Enclosure::Open
        } else {
            Enclosure::Closed
        };
        Scene::new::<F>(&surfaces, enclosure).map_err(|error| {
            let (message, place) = self.explain(error, F::EPSILON.to_f64() > 1e-10);
            Error::Scene { message, place }
        })
    }

    /// The point and direction in which light leaves a room that should be closed.
    #[must_use]
    pub fn leaving_ray(&self) -> Option<[[f64; 2]; 2]> {
        let surfaces = self.points.iter().zip(&self.materials);
        let surfaces: Vec<Surface<'_>> = surfaces
            .map(|(points, materials)| Surface { points, materials })
            .collect();
        match Scene::new::<f64>(&surfaces, Enclosure::Closed) {
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
    fn explain(&self, error: RoomError, single: bool) -> (String, Option<Place>) {
        let at = |place: Place, what: &str| (format!("{}: {what}", self.place(place)), Some(place));
        match error {
            RoomError::Vertices { surface } => at(
                Place { surface, vertex: 0 },
                "a surface needs at least two vertices",
            ),
            RoomError::Materials { surface } => at(
                Place { surface, vertex: 0 },
                "give one number for the surface, or one for each of its segments; numbers of several channels, such as \
                 colours, need their names, `channels`, in `[problem]`",
            ),
            RoomError::Coordinate(place) => at(
                place,
                if single {
                    "coordinates must be finite, and the scene between 1e-6 and 1e12 wide in f32"
                } else {
                    "coordinates must be finite, and the scene between 1e-100 and 1e100 wide"
                },
            ),
            RoomError::Reflectance(place) => at(place, "the reflectance must be in [0, 1]"),
            RoomError::NothingAbsorbs(place) => at(
                place,
                if self.heat {
                    "no wall of this part of the room has a temperature: if all net fluxes are given there is no steady \
                     state, or more than one; give one surface at least a `temperature`"
                } else {
                    "no wall of this part of the room absorbs: at least one needs a reflectance below 1"
                },
            ),
            RoomError::Emission(place) => at(place, "the emission must be finite"),
            RoomError::ZeroLength(place) => {
                at(place, "the segment to the next vertex has no length")
            }
            RoomError::Crossing { first, second } => (
                format!(
                    "the segment from {} crosses that from {}: split them where they meet",
                    self.place(second),
                    self.place(first)
                ),
                Some(second),
            ),
            RoomError::Overlap { first, second } => (
                format!(
                    "the segments from {} and from {} lie on each other and face the same side; a \
                     thin baffle is two surfaces that face opposite sides",
                    self.place(second),
                    self.place(first)
                ),
                Some(second),
            ),
            RoomError::Open {
                at: place,
                from,
                direction,
            } => {
                let way_out = self.gap().unwrap_or_else(|| {
                    "close the gap, or turn surfaces whose active side is not on the left"
                        .to_owned()
                });
                let open = match self.is_deck {
                    true => "set `encl` to 0 in line C of the deck",
                    false => "say `open = true`",
                };
                let message = format!(
                    "the room is not closed here: light leaves, or meets a wall from behind, from {} in \
                     direction {}; {way_out}; if light may leave, {open}",
                    leaks::point(from),
                    leaks::direction(direction)
                );
                at(place, &message)
            }
            other => (other.to_string(), None),
        }
    }

    /// The emissivity of a segment from which the net flux is given, if it is known.
    pub(super) fn emissivity(&self, place: Place) -> Option<f64> {
        let own = self.emissivities.get(&place.surface)?;
        own.get(place.vertex).or(own.first()).copied()
    }

    /// Whether the net flux is given from all of a surface.
    pub(super) fn is_flux_given(&self, surface: usize) -> bool {
        let own = self.materials.get(surface);
        own.is_some_and(|own| own.iter().all(|material| material.reflectance >= 1.0))
    }

    /// The one material of a surface, if it has one.
    pub(super) fn material(&self, surface: usize) -> Option<Material> {
        match self.materials.get(surface)?.as_slice() {
            [first, rest @ ..] if rest.iter().all(|other| other == first) => Some(*first),
            _ => None,
        }
    }
}
