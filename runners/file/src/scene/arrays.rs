//! Scenes from arrays: vertices, and faces by their numbers.

use fredholm_scene::Material;

use super::{Known, Origin, SceneFile, SceneSurface};
use crate::InputError;

/// A surface of faces in arrays: name and material.
#[derive(Clone, Debug, PartialEq)]
pub struct ArraySurface {
    /// The name in results.
    pub name: String,
    /// The material of all of its faces.
    pub material: Material,
    /// The emissivity, if the net flux is given and this is known.
    pub emissivity: Option<f64>,
    /// ρ_s, the part of what arrives that leaves as from a mirror.
    pub specular: f64,
    /// α, the part of sunlight that is absorbed, if it is given.
    pub absorptance: Option<f64>,
    /// What is said of the material.
    pub known: Known,
    /// Whether it is seen from both sides: its backs are another surface, "name (back)".
    pub two_sided: bool,
}

/// Faces in arrays: their vertices by number, and the surface of each.
///
/// ```
/// use fredholm_file::scene::{ArraySurface, Known, SceneArrays, SceneFile};
/// use fredholm_scene::Material;
///
/// let material = Material { reflectance: 0.5, emission: 1.0 };
/// let plate = ArraySurface { name: "plate".to_owned(), material, emissivity: None, specular: 0.0, absorptance: None, known: Known::Material, two_sided: true };
/// let arrays = SceneArrays {
///     vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
///     corners: vec![0, 1, 2],
///     counts: vec![3],
///     surface_of: vec![0],
///     surfaces: vec![plate],
///     is_heat: false,
/// };
/// let mut scene = SceneFile::default();
/// scene.open = true;
/// scene.add_arrays(&arrays)?;
/// assert_eq!(scene.surfaces[1].name, "plate (back)");
/// assert_eq!(scene.number_of_face(0, 0), Some(0));
/// assert!(scene.scene::<f64>().is_ok());
/// # Ok::<(), fredholm_file::InputError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneArrays {
    /// The coordinates of all vertices.
    pub vertices: Vec<[f64; 3]>,
    /// The numbers of the vertices of all faces, one face after the other, counter-clockwise seen from the active side.
    pub corners: Vec<usize>,
    /// The number of vertices of each face.
    pub counts: Vec<usize>,
    /// The number of the surface of each face.
    pub surface_of: Vec<usize>,
    /// The surfaces.
    pub surfaces: Vec<ArraySurface>,
    /// Whether u is in W/m².
    pub is_heat: bool,
}

impl SceneFile {
    /// Adds the surfaces of arrays; what has more than four vertices, or four that are not in a plane, is cut into triangles.
    ///
    /// # Errors
    /// What is wrong, with the number of the face.
    pub fn add_arrays(&mut self, arrays: &SceneArrays) -> Result<(), InputError> {
        self.names.push(Origin::Array("faces"));
        let file = (self.names.len() - 1) as u32;
        let first = self.surfaces.len();
        for own in &arrays.surfaces {
            self.surfaces.push(SceneSurface {
                material: own.material,
                emissivity: own.emissivity,
                specular: own.specular,
                absorptance: own.absorptance,
                known: own.known,
                ..SceneSurface::new(own.name.clone())
            });
        }
        let (mut from, mut points) = (0, Vec::new());
        let faces = arrays.counts.iter().zip(&arrays.surface_of);
        for (number, (&count, &surface)) in (0..).zip(faces) {
            let wrong = |message: &dyn core::fmt::Display| {
                InputError::new(format_args!("faces[{number}]: {message}"))
            };
            let corners = arrays.corners.get(from..from + count).unwrap_or(&[]);
            from += count;
            points.clear();
            for corner in corners {
                let point = arrays.vertices.get(*corner).ok_or_else(|| {
                    let known = arrays.vertices.len();
                    wrong(&format_args!(
                        "there is no vertex {corner}: there are {known}"
                    ))
                })?;
                points.push(*point);
            }
            let added = self.add(first + surface, &points, (file, number));
            added.map_err(|message| wrong(&message))?;
        }
        for (at, own) in (first..).zip(&arrays.surfaces) {
            if own.two_sided {
                self.add_back(at);
            }
        }
        self.heat |= arrays.is_heat;
        self.is_empty_at = self.is_empty_at.take().filter(|_| self.surfaces.is_empty());
        Ok(())
    }

    /// The number of the face of arrays, or the line of the file, of which a polygon of a surface is a part.
    #[must_use]
    pub fn number_of_face(&self, surface: usize, polygon: usize) -> Option<u32> {
        let place = self.surfaces.get(surface)?.places.get(polygon)?;
        Some(place.1)
    }
}
