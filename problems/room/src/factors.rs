//! What walls exchange, exact with occlusion.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use crate::geometry::Backs;
use crate::outside::Outside;
use crate::scene::Scene;
use crate::shadows::{kinks, used};
use crate::vector::{Vector, along, cross, dot, norm, sub};
use crate::{Geometry, Wall};

/// What bounds a visible interval of directions: a vertex, or the wall's own plane.
const HORIZON: u32 = u32::MAX;

/// A wall that is seen between two vertices, from right to left.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Glimpse {
    wall: u32,
    right: u32,
    left: u32,
}

/// Calls `each` with one of some walls, what it sees, and a part of ∫ F_y→w dy over the former: the length times the
/// form factor, which is the same from either side. A wall that is seen in several pieces comes several times. What is seen is the
/// number of a wall or, with as many as there are walls added, that of a part of the sky in [`Scene::outside`].
///
/// Exact up to rounding, with occlusion. Between two neighbouring places where vertices of the
/// scene are in line, a point sees the same walls between the same vertices V, and the integral
/// over the point of the sine of the angle at which it sees V is a difference of distances: crossed
/// strings (Hottel 1954) whose ends are vertices. The places come from the lines through all pairs
/// of vertices in sight of each other; where the ends of an interval disagree about what is seen,
/// it is halved.
///
/// O(W²) for each wall of W and each such place on it.
pub fn exchanges(scene: &Scene, walls: &[u32], mut each: impl FnMut(u32, u32, f64)) {
    let used = used(scene);
    let far: Vec<_> = scene
        .outside
        .iter()
        .flat_map(Outside::ends)
        .copied()
        .collect();
    let places = kinks(scene);
    let observed = scene.geometry();
    for &w in walls {
        let (Some(wall), Some(places)) = (scene.walls.get(w as usize), places.get(w as usize))
        else {
            continue;
        };
        let mut observer = Observer {
            scene,
            geometry: scene.geometry(),
            used: &used,
            far: &far,
            number: w,
            wall,
            directions: Vec::new(),
        };
        let ends = core::iter::once(&0.0).chain(places);
        for (&from, &to) in ends.zip(places.iter().chain([&wall.length])) {
            let mut halvings = HALVINGS;
            observer.integrate([from, to], &mut halvings, &mut |seen, exchange| {
                let sky = (seen as usize).checked_sub(scene.walls.len());
                let seen = match sky {
                    Some(number) => (scene.own + number) as u32,
                    None => observed.original(seen),
                };
                each(w, seen, exchange);
            });
        }
    }
}

/// A wall from whose points one looks.
struct Observer<'a> {
    scene: &'a Scene,
    geometry: Geometry<'a, f64>,
    used: &'a [u32],
    /// The ends of parts of the sky.
    far: &'a [Vector<f64>],
    number: u32,
    wall: &'a Wall<f64>,
    /// Kept from place to place: unit vectors to vertices.
    directions: Vec<(Rank, u32, Vector<f64>)>,
}

/// How many times an interval may be halved: enough to find a dozen places that the lines did not
/// give, to rounding.
const HALVINGS: u32 = 600;

/// Where a direction stands from right to left: exact near the horizon, too.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rank {
    left: bool,
    share: f64,
}

impl Rank {
    /// The sight of a direction with these components along the wall and away from it.
    fn new(tangent: f64, normal: f64) -> Self {
        let share = normal / (normal + tangent.abs());
        let left = tangent < 0.0;
        Self {
            left,
            share: if left { -share } else { share },
        }
    }

    fn compare(&self, other: &Self) -> core::cmp::Ordering {
        let shares = self.share.total_cmp(&other.share);
        self.left.cmp(&other.left).then(shares)
    }
}

impl Observer<'_> {
    /// The length times the form factor of the part of the wall between two distances, to every
    /// wall.
    fn integrate(
        &mut self,
        [from, to]: [f64; 2],
        halvings: &mut u32,
        add: &mut impl FnMut(u32, f64),
    ) {
        if !(to - from > 1e-15 * self.wall.length) {
            return;
        }
        // Nowhere near a place of symmetry, where vertices may be in line that hide nothing.
        let at = |t: f64| from + t * (to - from);
        let glimpses = self.look(at(0.091_3));
        if *halvings > 0 && glimpses != self.look(at(0.893_7)) {
            *halvings -= 1;
            self.integrate([from, at(0.5)], halvings, add);
            self.integrate([at(0.5), to], halvings, add);
            return;
        }
        let ends = [from, to].each(|s| along(self.wall.ends[0], s, self.wall.tangent));
        for glimpse in glimpses {
            let right = self.sines(glimpse.right, ends, to - from);
            let left = self.sines(glimpse.left, ends, from - to);
            add(glimpse.wall, 0.5 * (right - left));
        }
    }

    /// ∫ sin φ over the points between `ends`, φ the angle at which they see a vertex or a far direction; `horizon` is
    /// that of the horizon.
    fn sines(&self, vertex: u32, ends: [Vector<f64>; 2], horizon: f64) -> f64 {
        let number = vertex as usize;
        if let Some(&v) = self.scene.vertices.get(number) {
            return norm(sub(v, ends[0])) - norm(sub(v, ends[1]));
        }
        let far = number.checked_sub(self.scene.vertices.len());
        let far = far.and_then(|far| self.far.get(far));
        // Of a direction all points see it at one angle.
        far.map_or(horizon, |&d| dot(self.wall.tangent, d) * horizon.abs())
    }

    /// The number of the part of the sky in a direction, behind those of walls.
    fn sky(&self, direction: Vector<f64>) -> Option<u32> {
        let mut outside = self.scene.outside.iter();
        let number = outside.position(|own| match own {
            Outside::Sky {
                between: [right, left],
                ..
            } => cross(*right, direction) >= 0.0 && cross(direction, *left) > 0.0,
            Outside::Sun { .. } => false,
        });
        number.map(|number| (self.scene.walls.len() + number) as u32)
    }

    /// What the point at this distance sees, from right to left.
    fn look(&mut self, place: f64) -> Vec<Glimpse> {
        let origin = along(self.wall.ends[0], place, self.wall.tangent);
        let [tx, ty] = self.wall.tangent;
        let normal = self.wall.normal();
        self.directions.clear();
        self.directions
            .push((Rank::new(1.0, 0.0), HORIZON, [tx, ty]));
        for &vertex in self.used {
            let at = self.scene.vertices.get(vertex as usize);
            let to = at.map_or([0.0; 2], |&v| sub(v, origin));
            let length = norm(to);
            if dot(normal, to) > self.scene.smallest && length > 0.0 {
                let rank = Rank::new(dot(self.wall.tangent, to), dot(normal, to));
                let unit = [to[0] / length, to[1] / length];
                self.directions.push((rank, vertex, unit));
            }
        }
        for (number, &to) in (self.scene.vertices.len() as u32..).zip(self.far) {
            if dot(normal, to) > 0.0 {
                let rank = Rank::new(dot(self.wall.tangent, to), dot(normal, to));
                self.directions.push((rank, number, to));
            }
        }
        self.directions
            .push((Rank::new(-1.0, -0.0), HORIZON, [-tx, -ty]));
        self.directions
            .sort_by(|a, b| a.0.compare(&b.0).then(a.1.cmp(&b.1)));
        let mut glimpses: Vec<Glimpse> = Vec::new();
        for pair in self.directions.windows(2) {
            let [(_, right, a), (_, left, b)] = [pair[0], pair[1]];
            let sum = [a[0] + b[0], a[1] + b[1]];
            // From horizon to horizon the sum is nothing.
            let middle = if cross(a, b) > 1e-12 || dot(a, b) > 0.0 {
                sum
            } else {
                normal
            };
            let length = norm(middle);
            let direction = [middle[0] / length, middle[1] / length];
            let hit =
                self.geometry
                    .nearest(self.wall, self.number, origin, direction, Backs::Block);
            let wall = match hit {
                None => self.sky(direction),
                // What meets a back has left.
                Some(hit) => (!hit.back).then_some(hit.wall),
            };
            let Some(wall) = wall else { continue };
            match glimpses.last_mut() {
                Some(last) if last.wall == wall && last.left == right => last.left = left,
                _ => glimpses.push(Glimpse { wall, right, left }),
            }
        }
        glimpses
    }
}
