//! Holes of planes over which something stands: who looks from outside sees no more than if they were filled.
//!
//! Ground is cut out under a building, and what passes through that hole would have to come out of the building. So where the faces
//! that begin at the rim of a hole close over it, with their backs to it, the ground hides what it would without the hole.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

use fredholm_scene::Scene;
use fredholm_surfaces::hull;
use fredholm_surfaces::space::{Vector, centroid, cross, dot, ring, sub};

/// The faces of a scene by their edges, and in the order of their middles along x.
#[derive(Debug)]
pub(crate) struct Covers<'a> {
    scene: &'a Scene,
    /// `None`: more than one face has the edge in this direction.
    faces: BTreeMap<[u32; 2], Option<u32>>,
    middles: Vec<(Vector<f64>, u32)>,
    /// What is nearer than this to a plane is in it.
    slack: f64,
}

impl<'a> Covers<'a> {
    pub(crate) fn new(scene: &'a Scene, slack: f64) -> Self {
        let mut faces = BTreeMap::new();
        let mut middles = Vec::with_capacity(scene.faces().len());
        for (number, face) in (0..).zip(scene.faces()) {
            for edge in ring(scene.outline(number as usize)) {
                let own = faces.entry(edge);
                own.and_modify(|own| *own = None).or_insert(Some(number));
            }
            middles.push((centroid(face.polygon()), number));
        }
        middles.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        Self {
            scene,
            faces,
            middles,
            slack,
        }
    }

    /// Whether something stands on a hole of a plane's faces and hides it from all that is outside. The vertices around the hole are in
    /// the order of these faces, whose numbers are ascending.
    pub(crate) fn is_covered(&self, hole: &[u32], plane: &[u32], normal: Vector<f64>) -> bool {
        let is_own = |face: u32| plane.binary_search(&face).is_ok();
        let Some(cover) = self.beyond_rim(hole, is_own) else {
            return false;
        };
        let Some(&first) = hole.first() else {
            return false;
        };
        let foot = self.scene.vertex(first);
        // Six times the volume: pyramids from a point of the plane, which is positive where backs are inside.
        let (mut volume, mut corners) = (0.0, Vec::new());
        for face in cover
            .iter()
            .filter_map(|&f| self.scene.faces().get(f as usize))
        {
            let [a, b, c, d] = face.corners.map(|p| sub(p, foot));
            volume += dot(a, cross(b, c)) + dot(a, cross(c, d));
            corners.extend_from_slice(face.polygon());
        }
        let mut heights = corners.iter().map(|&p| dot(normal, sub(p, foot)));
        let is_before = heights.all(|height| height >= -self.slack);
        // What is inside sees the hole.
        let mut inside = self.middles_in(hull(&corners));
        is_before && volume > 0.0 && inside.all(|f| cover.contains(&f) || is_own(f))
    }

    /// The faces beyond the rim of a hole and all that go on from these; `None` if they end somewhere, or reach the faces around the hole.
    fn beyond_rim(&self, hole: &[u32], is_own: impl Fn(u32) -> bool) -> Option<BTreeSet<u32>> {
        let rim: BTreeSet<[u32; 2]> = ring(hole).map(|[a, b]| [b, a]).collect();
        let mut cover = BTreeSet::new();
        let mut next: Vec<[u32; 2]> = rim.iter().copied().collect();
        while let Some(edge) = next.pop() {
            let face = (*self.faces.get(&edge)?)?;
            if is_own(face) {
                return None;
            }
            if cover.insert(face) {
                let edges = ring(self.scene.outline(face as usize));
                let beyond = edges.filter(|edge| !rim.contains(edge));
                next.extend(beyond.map(|[a, b]| [b, a]));
            }
        }
        Some(cover)
    }

    /// The faces whose middles are in a box.
    fn middles_in(&self, [low, high]: [Vector<f64>; 2]) -> impl Iterator<Item = u32> {
        let from = self.middles.partition_point(|own| own.0[0] < low[0]);
        let along = self.middles.iter().skip(from);
        let along = along.take_while(move |own| own.0[0] <= high[0]);
        let inside =
            along.filter(move |own| (1..3).all(|k| (low[k]..=high[k]).contains(&own.0[k])));
        inside.map(|own| own.1)
    }
}
