//! Owned tables of cells.

use alloc::vec::Vec;

use fredholm_core::array::from_fn;
use fredholm_core::{Real, SourcePart, best_lights};

use crate::Scene;
use crate::SceneError;
use crate::beam::Beam;
use crate::cells::{CellTables, FacePatch, Side};
use crate::geometry::Face;
use crate::skylight::SkyBand;
use crate::vector::{Vector, cross, dot, norm, scale, sub, unit};

/// The cells of all faces of a scene, and frames for directions, in the walk's scalar.
#[derive(Clone, Debug)]
pub struct Cells<F> {
    patches: Vec<FacePatch<F>>,
    sides: Vec<Side<F>>,
    lights: Vec<u32>,
    beams: Vec<Beam<F>>,
    sky_bands: Vec<SkyBand<F>>,
    sky_emissions: Vec<F>,
    cells: u32,
}

/// Most cells of a scene.
const MOST: usize = 1 << 28;

impl<F: Real> Cells<F> {
    /// About so many cells, of about one size; at least one for every face, two for a quadrilateral that is no
    /// parallelogram.
    ///
    /// # Errors
    /// [`SceneError::Cells`]: more than 2²⁸.
    ///
    /// ```
    /// use fredholm_scene::{Cells, Enclosure, Scene, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// assert_eq!(Cells::<f64>::new(&scene, 100)?.number(), 96);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    pub fn new(scene: &Scene, cells: usize) -> Result<Self, SceneError> {
        if cells > MOST {
            return Err(SceneError::Cells);
        }
        let faces = scene.faces();
        let area: f64 = faces.iter().map(|face| face.area).sum();
        let sizes = |size: f64| faces.iter().map(|face| count(face, size)).sum::<f64>();
        // The size at which the number is not exceeded for the first time; at this one it is.
        let equal = Real::sqrt(area / cells.max(1) as f64);
        let (mut low, mut high) = (0.25 * equal, equal);
        while sizes(high) > cells as f64 && high < 1e3 * Real::sqrt(area) {
            high *= 2.0;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if sizes(middle) > cells as f64 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Self::of_size(scene, high)
    }

    /// Cells whose edges are at most about so long.
    ///
    /// # Errors
    /// [`SceneError::Cells`]: more than 2²⁸.
    fn of_size(scene: &Scene, size: f64) -> Result<Self, SceneError> {
        let sky = scene.sky().into_iter();
        let emissions = sky.clone().flat_map(|sky| &sky.emissions);
        let band = |band: &SkyBand<f64>| SkyBand {
            sines: band.sines.map(F::from_f64),
            sectors: band.sectors,
            first: band.first,
        };
        let mut all = Self {
            patches: Vec::new(),
            sides: Vec::new(),
            lights: Vec::new(),
            beams: scene.beams().iter().filter_map(Beam::rounded).collect(),
            sky_bands: sky.flat_map(|sky| &sky.bands).map(band).collect(),
            sky_emissions: emissions.map(|&l| F::from_f64(l)).collect(),
            cells: 0,
        };
        let wanted: f64 = scene.faces().iter().map(|face| count(face, size)).sum();
        // Written so that NaN fails.
        if !(wanted <= MOST as f64) {
            return Err(SceneError::Cells);
        }
        // In mirrors and in other periods lights are seen that no last step leads to.
        if scene.is_straight() {
            all.lights = lights(scene.faces());
        }
        let mut rest: Vec<f64> = scene.faces().iter().map(|face| face.emission).collect();
        for &light in &all.lights {
            if let Some(emission) = rest.get_mut(light as usize) {
                *emission = 0.0;
            }
        }
        for (face, emission) in scene.faces().iter().zip(rest) {
            let first = all.patches.len() as u32;
            for shape in shapes(face) {
                let patch = patch(&shape, size, all.cells);
                all.cells += patch.cells();
                all.patches.push(rounded(&patch));
            }
            let along = unit(sub(face.corners[1], face.corners[0]));
            let tangents = [along, cross(face.normal, along)];
            all.sides.push(Side {
                tangents: tangents.map(|t| t.map(F::from_f64)),
                patch: first,
                patches: all.patches.len() as u32 - first,
                emission: F::from_f64(emission),
            });
        }
        Ok(all)
    }

    /// The tables, borrowed: what [`Radiosity::of_tables`] takes, for instance on a device.
    ///
    /// ```
    /// use fredholm_scene::{Cells, Enclosure, Radiosity, Scene, Tables, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// let (tables, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 24)?);
    /// let of_cells = cells.tables();
    /// assert_eq!([of_cells.sides.len(), of_cells.patches.len(), of_cells.lights.len()], [6, 6, 0]);
    /// assert!(Radiosity::of_tables(tables.geometry(), of_cells).is_ok());
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    ///
    /// [`Radiosity::of_tables`]: crate::Radiosity::of_tables
    #[must_use]
    pub fn tables(&self) -> CellTables<'_, F> {
        CellTables {
            sides: &self.sides,
            patches: &self.patches,
            lights: &self.lights,
            beams: &self.beams,
            sky_bands: &self.sky_bands,
            sky_emissions: &self.sky_emissions,
        }
    }

    /// The number of cells, of which every patch of the sky is one.
    #[must_use]
    pub const fn number(&self) -> usize {
        self.cells as usize + self.sky_emissions.len()
    }
}

/// Time that a light takes in a last step, over the time of a step: what of it is above the horizon, and Lambert's sum.
const TIME_OF_LIGHT: f64 = 0.1;

/// The faces to which the last step leads. What emits besides is scored where walks meet it.
fn lights(faces: &[Face<f64>]) -> Vec<u32> {
    let part = |face: &Face<f64>| SourcePart {
        measure: face.area,
        source: face.emission,
        reflectance: face.reflectance,
    };
    let parts: Vec<SourcePart> = faces.iter().map(part).collect();
    best_lights(&parts, TIME_OF_LIGHT)
}

/// The origin and the spans of a patch, and whether it is a triangle.
struct Shape {
    origin: Vector<f64>,
    spans: [Vector<f64>; 2],
    is_triangle: bool,
}

/// The patches of a face.
fn shapes(face: &Face<f64>) -> impl Iterator<Item = Shape> {
    let [a, b, c, d] = face.corners;
    let from = |origin, p, q, is_triangle| Shape {
        origin,
        spans: [sub(p, origin), sub(q, origin)],
        is_triangle,
    };
    // A parallelogram's diagonals halve each other, but for rounding of the corners.
    let apart = norm(sub(sub(a, b), sub(d, c)));
    let [first, second] = if face.count == 3 {
        [Some(from(a, b, c, true)), None]
    } else if apart <= 1e-9 * norm(sub(a, c)) {
        [Some(from(a, b, d, false)), None]
    } else {
        // The first coordinate of the first one tells on which side of the diagonal a point is.
        [Some(from(a, b, c, true)), Some(from(a, c, d, true))]
    };
    first.into_iter().chain(second)
}

/// The intervals along both spans.
fn intervals(shape: &Shape, size: f64) -> [f64; 2] {
    // Not one more for the sake of rounding.
    let along = |length: f64| {
        let wanted = length / size * (1.0 - 1e-9);
        let whole = f64::from(wanted.to_u32());
        Real::max(if whole < wanted { whole + 1.0 } else { whole }, 1.0)
    };
    let [p, q] = shape.spans.map(norm);
    if shape.is_triangle {
        let third = norm(sub(shape.spans[0], shape.spans[1]));
        // Two triangles are as large as a square.
        let m = along(Real::max(Real::max(p, q), third) / core::f64::consts::SQRT_2);
        [m, m]
    } else {
        [along(p), along(q)]
    }
}

/// The number of cells of a face.
fn count(face: &Face<f64>, size: f64) -> f64 {
    shapes(face)
        .map(|shape| {
            let [m, n] = intervals(&shape, size);
            m * n
        })
        .sum()
}

fn patch(shape: &Shape, size: f64, first: u32) -> FacePatch<f64> {
    let [p, q] = shape.spans;
    let normal = cross(p, q);
    let square = dot(normal, normal);
    FacePatch {
        origin: shape.origin,
        spans: shape.spans,
        duals: [
            scale(cross(q, normal), 1.0 / square),
            scale(cross(normal, p), 1.0 / square),
        ],
        intervals: intervals(shape, size).map(|m| m as u32),
        first,
        triangle: u32::from(shape.is_triangle),
    }
}

fn rounded<F: Real>(patch: &FacePatch<f64>) -> FacePatch<F> {
    let vector = |p: Vector<f64>| from_fn(|k| F::from_f64(p[k]));
    FacePatch {
        origin: vector(patch.origin),
        spans: patch.spans.map(vector),
        duals: patch.duals.map(vector),
        intervals: patch.intervals,
        first: patch.first,
        triangle: patch.triangle,
    }
}
