//! What ends on the backs of polygons.

use alloc::vec::Vec;

use fredholm_core::{DefaultGenerator, RngUniforms, WalkSeeds};
use fredholm_surfaces::Enclosure;

use crate::means::{Mean, Ray, areas};
use crate::scene::Scene;

/// The number of rays that tell the share of light that meets backs.
const RAYS: u32 = 8192;

impl Scene {
    /// The share of light from all faces, as bright each and diffuse, that meets the back of a polygon of an open scene, dimensionless: what
    /// 8,192 rays tell, always the same. A back has no material, and what meets it is lost: a mesh that is inside out has most of its
    /// light there, and solids have none. In a closed scene nothing meets a back.
    ///
    /// ```
    /// use fredholm_scene::{Enclosure, Material, Polygon, Scene, Surface, shapes};
    ///
    /// let open = |polygons: &[Polygon]| {
    ///     let surface = Surface { polygons, materials: &[Material::BLACK] };
    ///     Scene::new::<f64>(&[surface], Enclosure::Open)
    /// };
    /// let block = shapes::block([0.0; 3], [1.0; 3]).surfaces.concat();
    /// assert_eq!(open(&block)?.light_on_backs(), 0.0);
    /// // A plate above another one that looks up: nearly a fifth of what leaves that meets the other's back (C-11).
    /// let lid = |z: f64| Polygon::Quad([[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]]);
    /// let share = open(&[lid(0.0), lid(1.0)])?.light_on_backs();
    /// assert!((share - 0.5 * 0.1998).abs() < 0.01);
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[must_use]
    pub fn light_on_backs(&self) -> f64 {
        if self.enclosure() == Enclosure::Closed {
            return 0.0;
        }
        let geometry = self.geometry();
        let faces: Vec<u32> = (0..self.faces().len() as u32).collect();
        let ends = areas(geometry, &faces).unwrap_or_default();
        let Ok(all) = Mean::new(geometry, &faces, &ends) else {
            return 0.0;
        };
        let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(1, 0).generator(0));
        let mut lost = 0_u32;
        for _ in 0..RAYS {
            let Ray { from, direction } = all.ray(&mut draws);
            let hit = geometry.meet(from.face, from.position, direction);
            lost += u32::from(hit.is_some_and(|hit| hit.back));
        }
        f64::from(lost) / f64::from(RAYS)
    }
}
