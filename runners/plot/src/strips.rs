//! Walls as strips on their active side, mitred where they meet.

use crate::Wall;

type Vector = [f64; 2];

/// A wall in pixels, y downwards.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strip {
    /// The first vertex of the wall, and the unit vectors along it and to its active side.
    origin: Vector,
    tangent: Vector,
    normal: Vector,
    length: f64,
    thickness: f64,
    /// How much shorter the inner edge is at the two ends; negative: longer.
    cut: [f64; 2],
}

/// The strips of walls that are drawn by `place`.
pub(crate) fn strips(
    walls: &[Wall],
    thickness: f64,
    place: impl Fn(Vector) -> Vector,
) -> Vec<Strip> {
    let strip = |wall: &Wall| {
        let [a, b] = wall.ends.map(&place);
        let span = [b[0] - a[0], b[1] - a[1]];
        let length = span[0].hypot(span[1]);
        let tangent = span.map(|x| x / length);
        Strip {
            origin: a,
            tangent,
            // To the left, where y is downwards.
            normal: [tangent[1], -tangent[0]],
            length,
            thickness,
            cut: [0.0; 2],
        }
    };
    let mut all: Vec<Strip> = walls.iter().map(strip).collect();
    let first = walls.iter().enumerate();
    let mut leaving: Vec<_> = first.map(|(i, wall)| (wall.vertices[0], i)).collect();
    leaving.sort_unstable();
    for (i, wall) in walls.iter().enumerate() {
        let vertex = wall.vertices[1];
        let from = leaving.partition_point(|&(v, _)| v < vertex);
        let here = leaving[from..].iter().take_while(|&&(v, _)| v == vertex);
        // The outline goes on where it turns to the left most; a twin on the back is no turn.
        let others = here.filter(|&&(_, j)| walls[j].vertices[1] != wall.vertices[0]);
        let turns = others.map(|&(_, j)| {
            let sine = dot(all[i].normal, all[j].tangent);
            let cosine = dot(all[i].tangent, all[j].tangent);
            (sine.atan2(cosine), j)
        });
        if let Some((turn, next)) = turns.max_by(|a, b| a.0.total_cmp(&b.0)) {
            // A spike at a sharp edge ends soon; in a sharp corner strips overlap.
            let cut = (thickness * (0.5 * turn).tan()).clamp(-1.5 * thickness, 3.0 * thickness);
            all[i].cut[1] = cut;
            all[next].cut[0] = cut;
        }
    }
    all
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Strip {
    /// The unit vector to the active side, y downwards.
    pub(crate) const fn normal(&self) -> [f64; 2] {
        self.normal
    }

    /// In pixels.
    pub(crate) const fn length(&self) -> f64 {
        self.length
    }

    /// The corners of a piece between two fractions: two on the wall, two off it.
    pub(crate) fn corners(&self, from: f64, to: f64) -> [Vector; 4] {
        let inner = |fraction: f64| {
            let [low, high] = [self.cut[0], self.length - self.cut[1]];
            if fraction <= 0.0 && low < 0.0 {
                low
            } else if fraction >= 1.0 && high > self.length {
                high
            } else if low > high {
                0.5 * (low + high)
            } else {
                (fraction * self.length).clamp(low, high)
            }
        };
        let at = |along: f64, off: f64| {
            core::array::from_fn(|k| {
                self.origin[k] + along * self.tangent[k] + off * self.normal[k]
            })
        };
        [
            at(from * self.length, 0.0),
            at(to * self.length, 0.0),
            at(inner(to), self.thickness),
            at(inner(from), self.thickness),
        ]
    }
}
