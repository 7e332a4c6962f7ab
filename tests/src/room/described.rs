//! The description of a room, for the kit.

use fredholm_core::galerkin::{AllPointwise, PairTable};
use fredholm_core::{Density, Located, Real};
use fredholm_room::{Grading, Point, Room, Tables, Wall, paper_pairs};

use super::vector::{Vector, cross, dist, dot, sub, wide};
use super::{Drawing, Setup, Way};
use crate::description::Description;
use crate::examine::examine_both;
use crate::offers::{Neighbours, Offers};
use crate::quadrature::{gauss_legendre, split};
use crate::report::Report;

/// A room as the kit sees it.
#[derive(Clone, Debug)]
pub struct Described<'a, F> {
    room: Room<'a, F>,
    setup: &'a Setup,
    drawing: &'a Drawing,
    claim: f64,
    rule: Vec<(f64, f64)>,
    /// The largest coordinate.
    size: f64,
    /// Whether nothing is in the way of anything: no vertex is behind any wall.
    clear: bool,
}

/// Describes the room of a drawing with about so many cells. `claim` is what its coefficients claim
/// to be right to, of the size of a row.
///
/// # Panics
/// If there is no such room.
pub fn described<F: Real, R>(
    drawing: &Drawing,
    cells: usize,
    claim: f64,
    then: impl FnOnce(&Described<'_, F>) -> R,
) -> R {
    let setup = Setup::new::<F>(drawing, cells, Grading::default()).unwrap();
    let tables = Tables::<F>::new(&setup.scene, &setup.mesh);
    let room = tables.room();
    let points = drawing.surfaces.iter().flat_map(|(points, _)| points);
    let walls = room.geometry().walls().iter();
    let vertices = walls.clone().flat_map(|wall| wall.ends);
    let convex = walls.clone().all(|wall| {
        let [a, b] = wall.ends.map(wide);
        let height = |v: [F; 2]| cross(sub(b, a), sub(wide(v), a));
        vertices.clone().all(|v| height(v) >= 0.0)
    });
    then(&Described {
        room,
        setup: &setup,
        drawing,
        claim,
        rule: gauss_legendre(12),
        size: points.flatten().fold(0.0, |m, c| m.max(c.abs())),
        clear: convex,
    })
}

/// Everything about a room, in f32 and f64.
#[must_use]
pub fn examined(drawing: &Drawing, cells: usize, claim: f64, seed: u64) -> Report {
    described::<f32, _>(drawing, cells, claim, |narrow| {
        described::<f64, _>(drawing, cells, claim, |wide| {
            examine_both(narrow, wide, seed)
        })
    })
}

/// A cell as a point sees it.
struct Seen {
    ends: [Vector; 2],
    length: f64,
    /// Where shadows may end, as fractions of the cell, and how far away the vertex is.
    shadows: Vec<(f64, f64)>,
    /// Where the horizon of the point is.
    horizon: Option<f64>,
}

impl<F: Real> Described<'_, F> {
    fn wall(&self, wall: usize) -> &Wall<F> {
        &self.room.geometry().walls()[wall]
    }

    fn wall_of(&self, cell: usize) -> usize {
        self.room.partition().wall(cell).expect("a cell")
    }

    fn inside(&self, cell: usize, t: f64) -> Point<F> {
        self.room.inside(cell, F::from_f64(t)).expect("a cell")
    }

    fn ends(&self, cell: usize) -> [Vector; 2] {
        [0.0, 1.0].map(|t| wide(self.inside(cell, t).position()))
    }

    /// The distance of `y` from the line of a wall, in f64.
    fn height(&self, wall: usize, y: Vector) -> f64 {
        let [a, b] = self.wall(wall).ends.map(wide);
        let span = sub(b, a);
        cross(span, sub(y, a)) / dot(span, span).sqrt()
    }

    fn seen(&self, x: &Point<F>, cell: usize) -> Seen {
        let ends = self.ends(cell);
        let (at, span) = (wide(x.position()), sub(ends[1], ends[0]));
        let inside = |t: &f64| *t > 0.0 && *t < 1.0;
        // Beyond every vertex that is nearer: a + t span on the line from x through it.
        let walls = self.room.geometry().walls().iter();
        let vertices = walls.flat_map(|wall| wall.ends.map(wide));
        let shadows = vertices.filter_map(|vertex| {
            let ray = sub(vertex, at);
            let t = cross(sub(at, ends[0]), ray) / cross(span, ray);
            let y = [ends[0][0] + t * span[0], ends[0][1] + t * span[1]];
            let (to, near) = (dot(sub(y, at), ray), dot(ray, ray));
            (inside(&t) && to > near && near > 0.0).then(|| (t, near.sqrt()))
        });
        let [a, b] = ends.map(|end| self.height(x.wall(), end));
        Seen {
            ends,
            length: self.room.partition().length(cell).to_f64(),
            shadows: shadows.collect(),
            horizon: Some(a / (a - b)).filter(inside),
        }
    }

    /// ½(sin b − sin a) of the directions from `x` to two points, both turned into the half plane
    /// before its wall: the form factor to what is between them, seen from its active side, where
    /// nothing is in the way.
    fn form_factor(&self, x: &Point<F>, to: [Vector; 2]) -> f64 {
        let [first, last] = self.wall(x.wall()).ends.map(wide);
        let at = wide(x.position());
        let tangent = sub(last, first);
        let sine = |end: Vector| {
            let d = sub(end, at);
            if d == [0.0; 2] {
                // The corner that x is in: what is there fills the angle up to the horizon.
                return if end == last { 1.0 } else { -1.0 };
            }
            let along = dot(tangent, d);
            if cross(tangent, d) <= 0.0 {
                return along.signum();
            }
            along / (dot(tangent, tangent) * dot(d, d)).sqrt()
        };
        // Seen from before it, a wall goes from right to left: against the direction of sin φ.
        (0.5 * (sine(to[0]) - sine(to[1]))).max(0.0)
    }
}

impl<'a, F: Real> Description for Described<'a, F> {
    type Equation = Room<'a, F>;

    fn equation(&self) -> &Self::Equation {
        &self.room
    }

    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        let [a, b] = self.ends(cell);
        let (span, to) = (sub(b, a), sub(wide(x.position()), a));
        let t = (dot(to, span) / dot(span, span)).clamp(0.0, 1.0);
        let off = sub(to, [t * span[0], t * span[1]]);
        // Ends and points are stored to ε of their coordinates.
        let edge = 16.0 * F::EPSILON.to_f64() * self.size;
        x.wall() == self.wall_of(cell) && dot(off, off).sqrt() <= edge
    }

    /// Split where the edge of a shadow may fall, at the horizon, and, where x is near, at one,
    /// two, four … times its distance from the foot of its perpendicular: the integrand's poles are
    /// at that distance.
    fn nodes(&self, x: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        let seen = self.seen(x, cell);
        let mut cuts: Vec<f64> = seen.shadows.iter().map(|(t, _)| *t).collect();
        cuts.extend(seen.horizon);
        if x.wall() == self.wall_of(cell) {
            // Beyond x itself sin φ has the other sign.
            let [from, to] = [0.0, 1.0].map(|t| self.inside(cell, t).along().to_f64());
            cuts.push((x.along().to_f64() - from) / (to - from));
        } else {
            let (span, to) = (
                sub(seen.ends[1], seen.ends[0]),
                sub(wide(x.position()), seen.ends[0]),
            );
            let square = dot(span, span);
            let foot = dot(to, span) / square;
            // No nearer than the rounding of points.
            let height = (cross(span, to) / square).abs().max(1e-9);
            let steps = core::iter::successors(Some(height), |step| Some(2.0 * step));
            let steps = steps.take_while(|step| *step < foot.abs() + 1.0);
            cuts.push(foot);
            cuts.extend(steps.flat_map(|step| [foot - step, foot + step]));
        }
        let nodes = split(&self.rule, 0.0, 1.0, &cuts).into_iter();
        nodes
            .map(|(t, weight)| (self.inside(cell, t), weight * seen.length))
            .collect()
    }

    /// Of p = h_x h_y/(2r³), h_x the height of x above the wall of y and h_y that of y
    /// above the wall of x: where x and y move by δ = ε × the size of the scene, p changes by at
    /// most p δ(1/h_x + 1/h_y + 3/r). In a corner h_x is small.
    ///
    /// Where the edge of a shadow is thrown on y by a vertex at the distance s, the edge moves by δ
    /// r/s across the ray, and what x sees by the angle, δ/s, times ½ cos φ = h_y/2r.
    fn sensitivity(&self, x: &Point<F>, cell: usize) -> f64 {
        let wall = self.wall_of(cell);
        let above = self.height(wall, wide(x.position()));
        if x.wall() == wall || above <= 0.0 {
            return 0.0;
        }
        let at = wide(x.position());
        let mut sum = 0.0;
        for (y, weight) in self.nodes(x, cell) {
            let to = wide(y.position());
            let (up, r) = (self.height(x.wall(), to), dist(at, to));
            if up > 0.0 {
                let p = self.room.density(x, &y).to_f64();
                sum += weight * p * (1.0 / above + 1.0 / up + 3.0 / r);
            }
        }
        let seen = self.seen(x, cell);
        let shadows = seen.shadows.iter().map(|&(t, s)| {
            let y = wide(self.inside(cell, t).position());
            0.5 * self.height(x.wall(), y).max(0.0) / (s * dist(at, y))
        });
        self.size * (sum + shadows.sum::<f64>())
    }

    /// What is left of the sky, where nothing is in the way.
    fn leaving(&self, x: &Point<F>) -> f64 {
        if !self.drawing.open {
            return 0.0;
        }
        assert!(self.clear, "an open scene with shadows");
        let walls = self.room.geometry().walls();
        let others = walls.iter().enumerate().filter(|&(w, _)| w != x.wall());
        let factors = others.map(|(_, wall)| self.form_factor(x, wall.ends.map(wide)));
        1.0 - factors.sum::<f64>()
    }

    fn solution(&self, _: &Point<F>) -> Option<f64> {
        self.constant()
    }

    fn constant(&self) -> Option<f64> {
        let mut materials = self.drawing.surfaces.iter().flat_map(|(_, m)| m);
        let glows = materials.all(|m| m.emission == 1.0 - m.reflectance);
        (glows && !self.drawing.open).then_some(1.0)
    }

    /// By the cosine law: sin φ is uniform in (−1, 1).
    fn cumulative(&self, x: &Point<F>, y: &Point<F>) -> Option<f64> {
        let [a, b] = self.wall(x.wall()).ends.map(wide);
        let (tangent, to) = (sub(b, a), sub(wide(y.position()), wide(x.position())));
        let sine = dot(tangent, to) / (dot(tangent, tangent) * dot(to, to)).sqrt();
        (!self.drawing.open).then_some(0.5 + 0.5 * sine)
    }

    /// In f32, by f64, where nothing is in the way.
    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        if F::EPSILON.to_f64() < 1e-10 || !self.clear {
            return None;
        }
        // In the line of the cell, and not in the corner where it ends, x sees its edge.
        let (at, ends) = (wide(x.point.position()), self.ends(cell));
        let aside = self.height(self.wall_of(cell), at) <= 0.0 && !ends.contains(&at);
        if aside || x.point.wall() == self.wall_of(cell) {
            return Some(0.0);
        }
        Some(self.form_factor(&x.point, ends))
    }
}

impl<F: Real> Neighbours for Described<'_, F> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        let wide = Tables::<f64>::new(&self.setup.scene, &self.setup.mesh);
        let kinds = paper_pairs(&self.setup.scene, &wide.room()).unwrap();
        offers.starts(&self.room);
        let paper = PairTable::new(&kinds, self.setup.mesh.len()).unwrap();
        offers.pairs("the paper's", paper);
        offers.pointwise_pairs("all pointwise", AllPointwise);
        let claim = self.claim;
        offers.coefficients("own", &self.setup.matrix.coefficients(), claim);
        // In f64 whatever F is: with nodes in f32 there is nothing to compare it with.
        if F::EPSILON.to_f64() < 1e-10 {
            let v = &self.setup.solution;
            offers.galerkin_solution("own", &v.v, claim / (1.0 - v.radius_bound));
        }
        for way in [Way::Paper, Way::Rays] {
            self.setup.with::<F, _>(way, |_, neighbour, _| {
                offers.any_neighbour(&format!("own, {way:?}"), neighbour);
            });
        }
    }
}
