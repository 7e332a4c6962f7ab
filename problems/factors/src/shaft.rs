//! What may be between two polygons.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_surfaces::space::{Vector, along, cross, dot, norm, ring, scale, sub, unit};
use fredholm_surfaces::{Bounds, Branch, hull, join};

use crate::clear::{PARALLEL, Sheet};
use crate::occluders::{Occluder, Occluders};

/// The convex hull of two polygons as half-spaces (Haines and Wallace 1991): light between them
/// stays in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shaft {
    /// Unit normals outwards, and points.
    planes: Vec<(Vector<f64>, Vector<f64>)>,
    bounds: Bounds<3>,
    /// What is nearer than this to a plane is on it.
    slack: f64,
}

/// What hides two polygons from each other.
#[derive(Clone, Debug)]
pub(crate) enum Between<'o> {
    /// One polygon hides all.
    Hidden,
    /// These may hide something.
    Some(Vec<&'o Occluder>),
}

/// What one polygon hides of two others from each other.
pub(crate) enum Hides {
    Nothing,
    Some,
    All,
}

impl Shaft {
    /// Makes it that of two polygons in front of each other.
    pub(crate) fn enclose(&mut self, a: Sheet<'_>, b: Sheet<'_>, slack: f64) {
        self.slack = slack;
        self.bounds = if b.far {
            open(hull(a.points), b.points)
        } else {
            join(hull(a.points), hull(b.points))
        };
        self.planes.clear();
        if b.far {
            self.cone(a, b);
        }
        for (own, other) in [(a, b), (b, a)] {
            if own.far {
                continue;
            }
            if let Some(&point) = own.points.first() {
                self.planes.push((own.normal.map(|x| -x), point));
            }
            for [from, to] in ring(own.points) {
                // The plane through the edge that leans outwards as far as the other polygon asks.
                let out = cross(sub(to, from), own.normal);
                let length = norm(out);
                if length == 0.0 {
                    continue;
                }
                let out = scale(out, 1.0 / length);
                let mut normal = out;
                for &p in other.points {
                    let aim = other.aim(from, p);
                    if dot(normal, aim) > if other.far { PARALLEL } else { slack } {
                        let (aside, up) = (dot(out, aim), Real::max(dot(own.normal, aim), 0.0));
                        normal = unit(from_fn(|k| up * out[k] - aside * own.normal[k]));
                    }
                }
                self.planes.push((normal, from));
            }
        }
    }

    /// The planes through a polygon and two neighbouring directions of a cone.
    fn cone(&mut self, a: Sheet<'_>, cone: Sheet<'_>) {
        for [from, to] in ring(cone.points) {
            let out = cross(from, to);
            let length = norm(out);
            if length > PARALLEL {
                let out = scale(out, 1.0 / length);
                let furthest = a.points.iter().copied();
                let furthest = furthest.max_by(|&p, &q| dot(out, p).total_cmp(&dot(out, q)));
                self.planes.extend(furthest.map(|point| (out, point)));
            }
        }
    }

    /// What is nearer than this to a plane is on it.
    pub(crate) const fn slack(&self) -> f64 {
        self.slack
    }

    /// Whether a box is off the shaft.
    fn misses(&self, node: &Branch<3>) -> bool {
        let ([low, high], [from, to]) = (self.bounds, node.bounds);
        if (0..3).any(|k| from[k] > high[k] || to[k] < low[k]) {
            return true;
        }
        self.planes.iter().any(|(normal, point)| {
            let nearest = from_fn(|k| if normal[k] > 0.0 { from[k] } else { to[k] });
            dot(*normal, sub(nearest, *point)) > 0.0
        })
    }

    /// Whether a polygon has no part inside of the shaft, as far as planes tell.
    pub(crate) fn excludes(&self, polygon: &[Vector<f64>]) -> bool {
        let outside = |normal: Vector<f64>, point: Vector<f64>| {
            let mut points = polygon.iter();
            points.all(|&p| dot(normal, sub(p, point)) >= -self.slack)
        };
        self.planes.iter().any(|&(n, p)| outside(n, p))
    }

    /// The part of a segment that is in the shaft, as fractions of the segment.
    pub(crate) fn part(&self, [from, to]: [Vector<f64>; 2]) -> Option<[f64; 2]> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for &(normal, point) in &self.planes {
            let low = dot(normal, sub(from, point)) - self.slack;
            let high = dot(normal, sub(to, point)) - self.slack;
            if low > 0.0 && high > 0.0 {
                return None;
            }
            let t = low / (low - high);
            if low > 0.0 {
                enter = Real::max(enter, t);
            } else if high > 0.0 {
                leave = leave.min(t);
            }
        }
        (enter < leave).then_some([enter, leave])
    }

    /// What may hide something of two polygons from each other. With `fronts` only what the first one sees from the front counts.
    pub(crate) fn between<'o>(
        &self,
        occluders: &'o Occluders,
        (a, b): (Sheet<'_>, Sheet<'_>),
        fronts: bool,
    ) -> Between<'o> {
        let mut found = Vec::new();
        for occluder in occluders.but(|node| self.misses(node)) {
            match self.of_one(occluder, a, b, fronts) {
                Hides::Nothing => {}
                Hides::Some => found.push(occluder),
                Hides::All => return Between::Hidden,
            }
        }
        Between::Some(found)
    }

    /// What an occluder hides of two polygons from each other.
    pub(crate) fn of_one(&self, o: &Occluder, a: Sheet<'_>, b: Sheet<'_>, fronts: bool) -> Hides {
        let sides = |s: Sheet<'_>| {
            let (mut above, mut below) = (false, false);
            for &p in s.points {
                let (height, slack) = if s.far {
                    (dot(o.normal, p), PARALLEL)
                } else {
                    (o.height(p), self.slack)
                };
                above |= height > slack;
                below |= height < -slack;
            }
            (above, below)
        };
        let ((above, below), (over, under)) = (sides(a), sides(b));
        // Both on one side of its plane, or, to be seen from the front, none in front of it.
        let pass = !((above && under) || (below && over));
        if pass || (fronts && !(above && under)) || self.excludes(&o.points) {
            return Hides::Nothing;
        }
        let across = (!below && !over) || (!above && !under);
        if across && self.covers(o, a, b) {
            Hides::All
        } else {
            Hides::Some
        }
    }

    /// Whether a polygon between two others is met by all lines between their vertices.
    fn covers(&self, o: &Occluder, a: Sheet<'_>, b: Sheet<'_>) -> bool {
        a.points.iter().all(|&p| {
            b.points.iter().all(|&q| {
                let aim = b.aim(p, q);
                let from = o.height(p);
                let fall = if b.far {
                    -dot(o.normal, q)
                } else {
                    from - o.height(q)
                };
                let at = if fall == 0.0 && (from == 0.0 || !b.far) {
                    p
                } else {
                    along(p, from / fall, aim)
                };
                ring(&o.points).all(|[c, d]| {
                    let edge = sub(d, c);
                    let inward = cross(o.normal, edge);
                    dot(inward, sub(at, c)) >= -self.slack * norm(edge)
                })
            })
        })
    }
}

/// A box without ends on the sides to which directions point.
fn open([mut low, mut high]: Bounds<3>, directions: &[Vector<f64>]) -> Bounds<3> {
    for d in directions {
        for k in 0..3 {
            if d[k] < 0.0 {
                low[k] = f64::NEG_INFINITY;
            }
            if d[k] > 0.0 {
                high[k] = f64::INFINITY;
            }
        }
    }
    [low, high]
}
