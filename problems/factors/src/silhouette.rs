//! What is seen past an edge.
//!
//! A polygon P and a polygon Q that other polygons hide from it in part exchange
//!
//! ```text
//! A_P F_PQ = 1/(2π) Σ_e ∫_e t_e · ∮_{∂X_e(y)} ln |x − y| dx dy,
//! ```
//!
//! where e are the edges of Q and of what hides it, t_e are unit tangents, and X_e(y) is the part of P from which the
//! line through y on e has visible Q on one side of the edge only. For Lambert's sum over the outline of what x sees is a
//! sum over points y of edges, and by Stokes' theorem its integral over x goes along the outline of X_e(y). That is made
//! of convex polygons by half-planes, and an edge of it has a closed form: one integral along e remains.
//!
//! If Q is at infinity, a cone of directions, a point of its edges is a direction ω, an edge is an arc, and the inner integral
//! becomes that of its limit: −n·(ω × t) times the area of X_e(ω), which shadows by parallel light cut out.
//!
//! Coordinates are those of P's plane, which is z = 0, with P's active side above it, in units of the pair's size.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_surfaces::space::{
    Vector, along, centroid, cross, dot, least_axis, norm, ring, scale, sub, unit,
};

use crate::bodies::Body;
use crate::clear::{PARALLEL, Sheet};
use crate::clip::{Pieces, Rest, cut};
use crate::flat::{Half, Point, area, around, at, half};
use crate::occluders::Occluders;
use crate::rules::{double_area, radius};
use crate::shaft::Shaft;

/// The number of the sheet that is Q.
pub(crate) const INNER: usize = 0;

/// A sine of the angle between an edge and the normal of P below which the edge adds nothing.
const UPRIGHT: f64 = 1e-15;

/// A convex polygon that hides, or Q. Its vertices are counter-clockwise seen from the side of the normal.
#[derive(Clone, Debug)]
pub(crate) struct Screen {
    pub(crate) points: Vec<Vector<f64>>,
    normal: Vector<f64>,
    /// The part of each edge that is between P and Q, as fractions of the edge.
    parts: Vec<Option<[f64; 2]>>,
    /// The number of the view's body of which it is a face.
    body: Option<usize>,
}

impl Screen {
    /// The edges that are between P and Q at least in part.
    pub(crate) fn between(&self) -> impl Iterator<Item = ([Vector<f64>; 2], [f64; 2])> {
        let all = ring(&self.points).zip(&self.parts);
        all.filter_map(|(ends, part)| Some((ends, (*part)?)))
    }

    pub(crate) fn height(&self, point: Vector<f64>) -> f64 {
        let first = self.points.first().copied().unwrap_or_default();
        dot(self.normal, sub(point, first))
    }

    /// The height of a point of an edge above the plane; of one at infinity the sine of its direction's angle with it.
    pub(crate) fn rise(&self, edge: &Edge, t: f64) -> f64 {
        if edge.far {
            dot(self.normal, edge.at(t))
        } else {
            self.height(edge.at(t))
        }
    }

    /// Where the polygon is, seen from its front, on a part of an edge: none if it is not in the polygon.
    fn side(&self, ends: [Vector<f64>; 2], slack: f64) -> Option<Side> {
        if ends.iter().any(|&p| self.height(p).abs() > slack) {
            return None;
        }
        let mut side = Side::Both;
        for [a, b] in ring(&self.points) {
            let along = unit(sub(b, a));
            let depths = ends.map(|p| dot(self.normal, cross(along, sub(p, a))));
            if depths.iter().any(|&d| d < -slack) {
                return None;
            }
            if depths.iter().all(|&d| d <= slack) {
                let same = dot(along, sub(ends[1], ends[0])) > 0.0;
                side = if same { Side::Left } else { Side::Right };
            }
        }
        Some(side)
    }

    /// Where an edge may begin or end to touch the polygon, as fractions of the edge.
    fn breaks(&self, [from, to]: [Vector<f64>; 2], slack: f64, breaks: &mut Vec<f64>) {
        let heights = [from, to].map(|p| self.height(p));
        if heights.iter().all(|&h| h > slack) || heights.iter().all(|&h| h < -slack) {
            return;
        }
        let span = sub(to, from);
        let square = dot(span, span);
        let mut add = |t: f64, near: Vector<f64>| {
            let at = along(from, t, span);
            if t > 0.0 && t < 1.0 && norm(sub(at, near)) <= slack {
                breaks.push(t);
            }
        };
        for [a, b] in ring(&self.points) {
            add(dot(sub(a, from), span) / square, a);
            let inward = cross(self.normal, sub(b, a));
            let (low, high) = (dot(inward, sub(from, a)), dot(inward, sub(to, a)));
            if (low > 0.0) != (high > 0.0) {
                let t = low / (low - high);
                let at = along(from, t, span);
                add(t, along(at, -self.height(at), self.normal));
            }
        }
    }
}

/// A polygon that hides, and the number of the body that hides with it, if all of that does.
#[derive(Clone, Debug)]
pub(crate) struct Hiding {
    pub(crate) points: Vec<Vector<f64>>,
    pub(crate) body: Option<u32>,
}

/// On which sides of an edge a polygon is that has the edge, as seen from the polygon's front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Both,
}

/// A polygon that has an edge, on its outline or inside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub(crate) sheet: usize,
    side: Side,
}

/// A part of an edge, and all polygons that have it.
#[derive(Clone, Debug)]
pub(crate) struct Edge {
    pub(crate) from: Vector<f64>,
    pub(crate) span: Vector<f64>,
    pub(crate) touches: Vec<Touch>,
    /// The numbers of the other sheets that may hide something past the edge, in ascending order.
    pub(crate) others: Vec<usize>,
    /// The occluders that are taken one by one, and the bodies that the rest are faces of.
    alone: Vec<usize>,
    bodies: Vec<usize>,
    /// Whether it is one of Q's.
    pub(crate) inner: bool,
    /// Whether it is at infinity: its points are directions.
    pub(crate) far: bool,
}

impl Edge {
    pub(crate) fn at(&self, t: f64) -> Vector<f64> {
        along(self.from, t, self.span)
    }

    pub(crate) fn touches(&self, sheet: usize) -> bool {
        self.touches.iter().any(|touch| touch.sheet == sheet)
    }
}

/// Buffers, kept from point to point.
#[derive(Clone, Debug, Default)]
struct Buffers {
    /// Whether what touches the edge hides the left and the right of each.
    sectors: [Pieces<2, [bool; 2]>; 2],
    rest: Rest<2>,
    halves: Vec<Half>,
    seen: Vec<bool>,
    own: Vec<Point>,
    inside: Vec<Point>,
    outside: Vec<Point>,
}

/// P, Q, and what is between them.
#[derive(Clone, Debug)]
pub(crate) struct View {
    pub(crate) outer: Vec<Vector<f64>>,
    /// Q, and what may hide it.
    pub(crate) sheets: Vec<Screen>,
    /// Convex bodies of which some of these are faces.
    bodies: Vec<Body>,
    /// Whether Q is at infinity: its vertices are directions.
    pub(crate) far: bool,
    /// Whether only what is seen from the front hides.
    pub(crate) fronts: bool,
    /// What is nearer than this to a plane is in it.
    pub(crate) slack: f64,
    /// The length of the unit.
    pub(crate) unit: f64,
    buffers: Buffers,
}

impl View {
    /// The pair with screens, whose vertices are counter-clockwise seen from the side from which they hide, if they do
    /// so from one.
    pub(crate) fn new(
        (outer, inner): (Sheet<'_>, Sheet<'_>),
        screens: &[Hiding],
        fronts: bool,
        shaft: &Shaft,
        size: f64,
        occluders: &Occluders,
    ) -> Self {
        let origin = centroid(outer.points);
        let z = outer.normal;
        let x = unit(cross(least_axis(z), z));
        let y = cross(z, x);
        let turned = |p: Vector<f64>| [dot(x, p), dot(y, p), dot(z, p)];
        let slack = 4.0 * shaft.slack() / size;
        let width = radius(outer.points, origin) / size;
        // What is in P's plane is at 0: the plane is off as many times more as it is further away than P is wide.
        let place = |p: &Vector<f64>| {
            let mut p = turned(sub(*p, origin)).map(|x| x / size);
            if p[2].abs() <= slack * (1.0 + norm(p) / width) {
                p[2] = 0.0;
            }
            p
        };
        let list =
            |points: &[Vector<f64>]| -> Vec<Vector<f64>> { points.iter().map(place).collect() };
        let mut numbers: Vec<u32> = screens.iter().filter_map(|own| own.body).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let bodies = numbers.iter().filter_map(|&body| occluders.body(body));
        let screen = |points: &[Vector<f64>], body: Option<u32>| {
            let own = list(points);
            Screen {
                normal: unit(double_area(&own)),
                points: own,
                parts: ring(points).map(|ends| shaft.part(ends)).collect(),
                body: body.and_then(|own| numbers.binary_search(&own).ok()),
            }
        };
        let first = if inner.far {
            Screen {
                points: inner.points.iter().map(|&p| turned(p)).collect(),
                normal: [0.0; 3],
                parts: inner.points.iter().map(|_| Some([0.0, 1.0])).collect(),
                body: None,
            }
        } else {
            screen(inner.points, None)
        };
        // What lies in P's plane hides nothing.
        let screens = screens.iter().map(|own| screen(&own.points, own.body));
        let screens = screens.filter(|own| own.points.iter().any(|p| p[2] != 0.0));
        Self {
            outer: list(outer.points),
            sheets: core::iter::once(first).chain(screens).collect(),
            bodies: bodies
                .map(|own| own.placed(place, turned, shaft.slack()))
                .collect(),
            far: inner.far,
            fronts,
            slack,
            unit: size,
            buffers: Buffers::default(),
        }
    }

    /// How far along its line y is from where the integral over one of P's own edges is singular, in the complex plane.
    ///
    /// That is at the ends of the edge, and where both lines are nearest to each other: h / sin α above or below the
    /// real line, where h is their distance and α their angle. Parallel edges have the ends only.
    pub(crate) fn distance(&self, edge: &Edge, y: Vector<f64>) -> f64 {
        let mut least = f64::INFINITY;
        if edge.far {
            return least;
        }
        let own = unit(edge.span);
        for [a, b] in ring(&self.outer) {
            let (span, aim) = (sub(b, a), sub(y, a));
            let length = norm(span);
            let other = scale(span, 1.0 / length);
            least = least.min(norm(aim)).min(norm(sub(y, b)));
            let normal = cross(own, other);
            let square = dot(normal, normal);
            let cosine = dot(own, other);
            let (ahead, across) = (dot(own, aim), dot(other, aim));
            let on_other = (across - cosine * ahead) / square;
            if on_other > 0.0 && on_other < length {
                let along = (cosine * across - ahead) / square;
                let aside = dot(normal, aim) / square;
                least = least.min(Real::sqrt(along * along + aside * aside));
            }
        }
        least
    }

    /// All edges of Q and of what hides it, each line once, cut where what touches it changes.
    pub(crate) fn edges(&self) -> Vec<Edge> {
        let mut all = Vec::new();
        for (own, sheet) in self.sheets.iter().enumerate() {
            for (ends, part) in sheet.between() {
                let inner = own == INNER;
                if inner && self.far {
                    all.extend(arc(ends));
                    continue;
                }
                // Nobody in P sees Q beyond an edge in P's plane.
                let low = ends[0][2] <= self.slack && ends[1][2] <= self.slack;
                let span = sub(ends[1], ends[0]);
                let flat = Real::sqrt(span[0] * span[0] + span[1] * span[1]);
                if (low && !inner) || flat <= UPRIGHT * norm(span) {
                    continue;
                }
                let part = if inner { [0.0, 1.0] } else { part };
                self.cut_edge(own, part.map(|t| along(ends[0], t, span)), &mut all);
            }
        }
        all.retain_mut(|edge| self.look_past(edge));
        all
    }

    /// Finds what may hide something past an edge. Whether something of P is past it at all: past the edge between two faces of a
    /// body only from where one of them is seen from the front.
    fn look_past(&self, edge: &mut Edge) -> bool {
        let y = edge.at(0.5);
        let (mut inside, mut outside) = (Vec::new(), Vec::new());
        let whole: Vec<Point> = self.outer.iter().map(|p| [p[0], p[1]]).collect();
        let mut regions = Vec::from([(whole, [false; 2])]);
        for touch in edge.touches.iter().filter(|touch| touch.sheet != INNER) {
            let Some(sheet) = self.sheets.get(touch.sheet) else {
                continue;
            };
            let [left, right] = [touch.side != Side::Right, touch.side != Side::Left];
            let behind = !self.fronts;
            let n = sheet.normal;
            let mut next = Vec::new();
            for (region, hidden) in regions.drain(..) {
                let above = |p: Point| n[0] * (p[0] - y[0]) + n[1] * (p[1] - y[1]) - n[2] * y[2];
                cut(&region, above, &mut inside, &mut outside);
                let sides = [
                    (&mut inside, [hidden[0] | left, hidden[1] | right]),
                    (
                        &mut outside,
                        [hidden[0] | (behind & right), hidden[1] | (behind & left)],
                    ),
                ];
                for (part, hidden) in sides {
                    if part.len() >= 3 {
                        next.push((core::mem::take(part), hidden));
                    }
                }
            }
            regions = next;
        }
        // Of Q's own edges that is needed which is hidden.
        if !edge.inner {
            let q = edge.touches.iter().find(|touch| touch.sheet == INNER);
            let q = q.map_or(Side::Both, |touch| touch.side);
            regions.retain(|(_, hidden)| {
                (!hidden[0] && q != Side::Right) != (!hidden[1] && q != Side::Left)
            });
        }
        let ends = [edge.at(0.0), edge.at(1.0)];
        let points = || {
            regions
                .iter()
                .flat_map(|(region, _)| region.iter().copied())
        };
        let misses = |screen: &Screen, sign: f64| {
            // What is beside the plane through an edge of the screen and any y is beside it for y at both ends: linear in y.
            ring(&screen.points).any(|[a, b]| {
                ends.iter().all(|&y| {
                    points().all(|p| {
                        let x = [p[0], p[1], 0.0];
                        let normal = if edge.far {
                            cross(sub(b, a), y)
                        } else {
                            cross(sub(a, x), sub(b, a))
                        };
                        let from = if edge.far { sub(x, a) } else { sub(x, y) };
                        sign * dot(normal, from) <= 0.0
                    })
                })
            })
        };
        let is_low = |p: &Vector<f64>| p[2] <= self.slack;
        let signs: &[f64] = if self.fronts { &[1.0] } else { &[1.0, -1.0] };
        let body_of = |number: usize| self.sheets.get(number).and_then(|own| own.body);
        let touched = edge.touches.iter().filter_map(|own| body_of(own.sheet));
        let touched: Vec<usize> = touched.collect();
        // Past an edge of a body it hides nothing more.
        let own = touched
            .iter()
            .copied()
            .find(|body| touched.iter().filter(|other| *other == body).count() > 1);
        edge.others = (1..self.sheets.len())
            .filter(|&number| {
                let is_other = !edge.touches(number) && (own.is_none() || body_of(number) != own);
                let lies = edge.far || ends.iter().any(is_low);
                self.sheets.get(number).is_some_and(|screen| {
                    let is_flat = lies && screen.points.iter().any(is_low);
                    is_other && (is_flat || !signs.iter().all(|&sign| misses(screen, sign)))
                })
            })
            .collect();
        // A point of a body sees no outline of it.
        let is_on = |body: &usize| {
            let is_near = |y: &Vector<f64>, own: &Body| own.distance(*y) <= self.slack;
            let own = self.bodies.get(*body).filter(|_| !edge.far);
            own.is_some_and(|own| ends.iter().all(|y| is_near(y, own)))
        };
        for &number in &edge.others {
            match body_of(number).filter(|body| !touched.contains(body) && !is_on(body)) {
                Some(body) => edge.bodies.push(body),
                None => edge.alone.push(number),
            }
        }
        edge.bodies.sort_unstable();
        edge.bodies.dedup();
        !regions.is_empty()
    }

    fn cut_edge(&self, own: usize, ends: [Vector<f64>; 2], all: &mut Vec<Edge>) {
        let is_near = |k: usize| k != own && !(self.far && k == INNER);
        let others = || (0..).zip(&self.sheets).filter(move |(k, _)| is_near(*k));
        let span = sub(ends[1], ends[0]);
        // What is nearer to each other than the smallest distance is one; no part of the edge is left out.
        let apart = self.slack / norm(span);
        if !(apart < 1.0) {
            return;
        }
        let mut breaks = Vec::new();
        others().for_each(|(_, other)| other.breaks(ends, self.slack, &mut breaks));
        breaks.retain(|t| (apart..1.0 - apart).contains(t));
        breaks.sort_unstable_by(f64::total_cmp);
        breaks.dedup_by(|b, a| *b - *a <= apart);
        breaks.insert(0, 0.0);
        breaks.push(1.0);
        for part in breaks.windows(2) {
            let at = |t: f64| along(ends[0], t, span);
            let own_ends = [at(part[0]), at(part[1])];
            let mut touches = Vec::from([Touch {
                sheet: own,
                side: Side::Left,
            }]);
            let mut first = true;
            for (sheet, other) in others() {
                if let Some(side) = other.side(own_ends, self.slack) {
                    first &= sheet > own || side == Side::Both;
                    touches.push(Touch { sheet, side });
                } else if sheet == INNER {
                    // In its plane, but not in it: Q is seen from its edge.
                    first &= own_ends.iter().any(|&p| other.height(p).abs() > self.slack);
                }
            }
            if first {
                all.push(Edge {
                    from: at(part[0]),
                    span: scale(span, part[1] - part[0]),
                    touches,
                    others: Vec::new(),
                    alone: Vec::new(),
                    bodies: Vec::new(),
                    inner: own == INNER,
                    far: false,
                });
            }
        }
    }

    /// The integrand at the fraction t of an edge, per length of the edge: of Q's edges what is hidden, less than 0.
    pub(crate) fn value(&mut self, edge: &Edge, t: f64) -> f64 {
        let y = edge.at(t);
        let length = norm(edge.span);
        let mut buffers = core::mem::take(&mut self.buffers);
        if edge.far {
            let all: Vec<Point> = self.outer.iter().map(|p| [p[0], p[1]]).collect();
            let hidden = self.hide(&all, edge, y, &mut buffers, area);
            self.buffers = buffers;
            // The angle that belongs to a part of the chord.
            return hidden * cross(edge.from, edge.span)[2] / (dot(y, y) * length);
        }
        let direction = [edge.span[0] / length, edge.span[1] / length];
        let around = |part: &[Point]| around(part, y[2], direction);
        self.divide(edge, y, &mut buffers);
        let sectors = core::mem::take(&mut buffers.sectors[0]);
        let mut sum = 0.0;
        for (sector, hidden) in sectors.each() {
            if edge.inner {
                let part = if hidden[0] {
                    around(sector)
                } else {
                    self.hide(sector, edge, y, &mut buffers, around)
                };
                sum -= part;
                continue;
            }
            // Where there is Q on both sides of the edge, or on one.
            let q = edge.touches.iter().find(|touch| touch.sheet == INNER);
            let q = q.map_or(Side::Both, |touch| touch.side);
            let left = !hidden[0] && q != Side::Right;
            let right = !hidden[1] && q != Side::Left;
            if left == right {
                continue;
            }
            let whole = around(sector);
            let part = whole - self.hide(sector, edge, y, &mut buffers, around);
            sum += if left { part } else { -part };
        }
        buffers.sectors[0] = sectors;
        self.buffers = buffers;
        sum
    }

    /// What of P has Q behind y, in sectors by the planes of what touches the edge.
    fn divide(&self, edge: &Edge, y: Vector<f64>, buffers: &mut Buffers) {
        let Buffers {
            sectors: [from, to],
            inside,
            outside,
            own,
            ..
        } = buffers;
        from.clear();
        own.clear();
        own.extend(self.outer.iter().map(|p| [p[0] - y[0], p[1] - y[1]]));
        if !edge.touches(INNER)
            && let Some(inner) = self.sheets.first()
        {
            for [a, b] in ring(&inner.points) {
                let half = if self.far {
                    let m = cross(a, b);
                    [m[0], m[1], -m[2] * y[2]]
                } else {
                    half(a, b, y)
                };
                cut(own, |p| at(half, p), inside, outside);
                core::mem::swap(own, inside);
            }
        }
        if own.len() < 3 {
            return;
        }
        from.push(own, [false; 2]);
        for touch in edge.touches.iter().filter(|touch| touch.sheet != INNER) {
            let Some(sheet) = self.sheets.get(touch.sheet) else {
                continue;
            };
            let n = sheet.normal;
            to.clear();
            for (piece, hidden) in from.each() {
                let above = [n[0], n[1], -n[2] * y[2]];
                cut(piece, |p| at(above, p), inside, outside);
                let [left, right] = [touch.side != Side::Right, touch.side != Side::Left];
                to.push(inside, [hidden[0] | left, hidden[1] | right]);
                let behind = !self.fronts;
                to.push(
                    outside,
                    [hidden[0] | (behind & right), hidden[1] | (behind & left)],
                );
            }
            core::mem::swap(from, to);
        }
    }

    /// The measure of what is hidden from a sector.
    fn hide(
        &self,
        sector: &[Point],
        edge: &Edge,
        y: Vector<f64>,
        buffers: &mut Buffers,
        measure: impl Fn(&[Point]) -> f64,
    ) -> f64 {
        let Buffers {
            rest, halves, seen, ..
        } = buffers;
        rest.begin(sector);
        let mut sum = 0.0;
        let mut take = |halves: &[Half], signs: &[f64]| {
            for sign in signs {
                rest.take(
                    halves,
                    |half, p| sign * at(half, p),
                    |half| Real::sqrt(half[0] * half[0] + half[1] * half[1]),
                    |taken| {
                        sum += measure(taken);
                    },
                );
            }
        };
        let half = |ends, normal, height| match edge.far {
            true => self.far_half(normal, ends, y),
            false => self.half(normal, ends, y, height),
        };
        let slack = if edge.far { PARALLEL } else { self.slack };
        for body in edge.bodies.iter().filter_map(|&own| self.bodies.get(own)) {
            // What is hidden is behind all faces that y sees, or that light in its direction leaves by.
            let height = |normal, point| {
                if edge.far {
                    dot(normal, y)
                } else {
                    dot(normal, sub(y, point))
                }
            };
            halves.clear();
            let outline = body.outline(|normal, point| height(normal, point) > slack, seen);
            halves.extend(
                outline.map(|rim| half(rim.ends, rim.normal, height(rim.normal, rim.point))),
            );
            if !halves.is_empty() {
                take(halves, &[1.0, -1.0]);
            }
        }
        for &number in &edge.alone {
            let Some(screen) = self.sheets.get(number) else {
                continue;
            };
            let height = if edge.far {
                dot(screen.normal, y)
            } else {
                screen.height(y)
            };
            if height.abs() <= slack {
                continue;
            }
            halves.clear();
            halves.extend(ring(&screen.points).map(|ends| half(ends, screen.normal, height)));
            let signs: &[f64] = if self.fronts { &[1.0] } else { &[1.0, -1.0] };
            take(halves, signs);
        }
        sum
    }

    /// The half-plane of an edge of a screen. If the edge and y are in P's plane it is what is beyond the screen.
    fn half(&self, n: Vector<f64>, [a, b]: [Vector<f64>; 2], y: Vector<f64>, height: f64) -> Half {
        if y[2] <= self.slack && a[2] <= self.slack && b[2] <= self.slack {
            return [n[0], n[1], height - n[2] * y[2]];
        }
        half(a, b, y)
    }

    /// The half-plane of the points in P's plane from which the line in direction ω passes an edge of a screen on its left.
    fn far_half(&self, n: Vector<f64>, [a, b]: [Vector<f64>; 2], w: Vector<f64>) -> Half {
        let low = w[2] <= PARALLEL && a[2] <= self.slack && b[2] <= self.slack;
        let m = if low { n } else { cross(sub(b, a), w) };
        [m[0], m[1], -dot(m, a)]
    }
}

/// An edge of Q at infinity, from which P is seen.
fn arc([from, to]: [Vector<f64>; 2]) -> Option<Edge> {
    let touch = Touch {
        sheet: INNER,
        side: Side::Left,
    };
    (cross(from, to)[2].abs() > UPRIGHT).then(|| Edge {
        from,
        span: sub(to, from),
        touches: Vec::from([touch]),
        others: Vec::new(),
        alone: Vec::new(),
        bodies: Vec::new(),
        inner: true,
        far: true,
    })
}
