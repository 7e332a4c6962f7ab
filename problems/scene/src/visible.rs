//! What a point sees of a polygon behind others, by convex clipping of directions.

use alloc::vec::Vec;

use fredholm_core::array::from_fn;

use crate::clip::ring;
use crate::lambert::from_origin;
use crate::vector::{Vector, cross, dot};

/// Convex cones of directions.
#[derive(Debug, Default)]
struct Cones {
    points: Vec<Vector<f64>>,
    ends: Vec<usize>,
}

impl Cones {
    fn clear(&mut self) {
        self.points.clear();
        self.ends.clear();
    }

    fn push(&mut self, cone: &[Vector<f64>]) {
        if cone.len() >= 3 {
            self.points.extend_from_slice(cone);
            self.ends.push(self.points.len());
        }
    }

    fn each(&self) -> impl Iterator<Item = &[Vector<f64>]> {
        let mut from = 0;
        self.ends.iter().filter_map(move |&to| {
            let cone = self.points.get(from..to)?;
            from = to;
            Some(cone)
        })
    }
}

/// Buffers, kept from point to point.
#[derive(Debug, Default)]
pub(crate) struct Clipper {
    from: Cones,
    to: Cones,
    own: Vec<Vector<f64>>,
    inside: Vec<Vector<f64>>,
    outside: Vec<Vector<f64>>,
}

impl Clipper {
    /// The form factor from the origin to the part of a convex polygon, or cone of directions, that no screen hides. All
    /// of them are above the origin's horizon, and the screens are before the polygon; those with a height of the origin
    /// above their plane that is 0 hide nothing.
    pub(crate) fn factor<'s>(
        &mut self,
        normal: Vector<f64>,
        polygon: &[Vector<f64>],
        screens: impl Iterator<Item = (&'s [Vector<f64>], f64)>,
    ) -> f64 {
        let Self {
            from,
            to,
            own,
            inside,
            outside,
        } = self;
        from.clear();
        from.push(polygon);
        for (screen, height) in screens {
            // Outwards if it is seen from its front.
            let halves: Vec<Vector<f64>> = ring(screen)
                .map(|[a, b]| cross(a, b).map(|x| if height < 0.0 { -x } else { x }))
                .collect();
            if height == 0.0 {
                continue;
            }
            to.clear();
            for cone in from.each() {
                let misses = |m: &Vector<f64>| cone.iter().all(|&p| dot(*m, p) >= 0.0);
                if halves.iter().any(misses) {
                    to.push(cone);
                    continue;
                }
                own.clear();
                own.extend_from_slice(cone);
                for &m in &halves {
                    cut(own, m, inside, outside);
                    to.push(outside);
                    core::mem::swap(own, inside);
                }
            }
            core::mem::swap(from, to);
        }
        from.each().map(|cone| from_origin(normal, cone)).sum()
    }
}

/// Cuts a convex cone by a plane through the origin, whose normal is outwards.
fn cut(
    cone: &[Vector<f64>],
    normal: Vector<f64>,
    inside: &mut Vec<Vector<f64>>,
    outside: &mut Vec<Vector<f64>>,
) {
    inside.clear();
    outside.clear();
    let Some(&last) = cone.last() else { return };
    let (mut before, mut low) = (last, dot(normal, last));
    for &p in cone {
        let high = dot(normal, p);
        if (low < 0.0 && high > 0.0) || (low > 0.0 && high < 0.0) {
            let t = low / (low - high);
            let both: Vector<f64> = from_fn(|k| before[k] + t * (p[k] - before[k]));
            inside.push(both);
            outside.push(both);
        }
        if high <= 0.0 {
            inside.push(p);
        }
        if high >= 0.0 {
            outside.push(p);
        }
        (before, low) = (p, high);
    }
    for part in [inside, outside] {
        if part.len() < 3 {
            part.clear();
        }
    }
}
