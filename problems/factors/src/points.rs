//! What two polygons exchange that see each other in part, as a sum over points of one of them.
//!
//! From a point the visible part of the other polygon is cut out by planes, and its form factor is a sum over edges. The mean over
//! points is taken triangle by triangle: what may hide something is looked for again for each, by its own shaft, so that a triangle
//! that sees all has a closed form, and one that sees nothing has none. What is left is cut where it is most uncertain. A few points
//! reach an error of a hundredth; each digit more takes ten times as many, and contours are soon cheaper.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Ordering;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_scene::form_factor_from_origin;
use fredholm_surfaces::space::{Vector, along, centroid, cross, dot, norm, ring, sub};

use crate::bodies::Body;
use crate::clear::{self, Amount, Sheet};
use crate::clip::Rest;
use crate::clip::keep;
use crate::occluders::{Occluder, Occluders};
use crate::rules::{Rules, area, radius};
use crate::shaft::{Hides, Shaft};

/// The places of the three points of a triangle, as shares of its corners: a rule of degree 2. A fourth is in the middle.
const INNER: [f64; 3] = [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0];

/// Three more points, near the corners, where these four all see all that they could, or nothing.
const CORNERS: [f64; 3] = [1.0 - 2.0 * ASIDE, ASIDE, ASIDE];
const ASIDE: f64 = 1.0 / 24.0;

/// The share of a polygon that a triangle may miss whose points all see all that they could, or nothing: of the first triangles a strip
/// along an edge, next to the points near its ends. Of all its quarters such a strip is in half.
const MISSED: f64 = 2.0 * ASIDE;

/// Shadows by a cone of directions have no sharp edges at this many widths of a cell, in the cone's sine, and further off.
const SHARP: f64 = 1.0;

/// The share of what a cell may miss of a cone of directions within which a point sees all, or nothing.
const SMOOTH: f64 = 0.02;

/// The share of a triangle that is nearer to its corners than the four points are.
const OUTSIDE: f64 = 0.25;

/// What each of four quarters is off by, in what they changed together: all of them half of it where a shadow's edge is sharp, a quarter where
/// it is not, and an eighth where there is none.
const CHANGED: f64 = 0.25;

/// What quarters are off by at least, in what a rule of a lower degree says and in the error of the whole: they may have changed little by chance.
const LEAST: [f64; 2] = [1.0 / 8.0, 1.0 / 64.0];

/// The most faces of a body one of which may hide all.
const FEW: usize = 12;

/// The share of what a point could see below which it sees nothing: of some hundred cones, each rounded.
const ROUNDING: f64 = 1e-12;

/// Standard deviations of a sum of errors whose signs are open.
const DEVIATIONS: f64 = 3.0;

/// A triangle of the first polygon.
#[derive(Clone, Debug)]
struct Cell {
    corners: [Vector<f64>; 3],
    /// The numbers of what may hide something from it.
    screens: Vec<u32>,
    value: f64,
    /// What the rule is off by, to either side.
    error: f64,
    /// What no point of it may have seen.
    unseen: f64,
    /// The share of it that its points may not see.
    missed: f64,
}

impl Cell {
    fn uncertainty(&self) -> f64 {
        self.error + self.unseen
    }
}

/// What the triangles are uncertain by.
#[derive(Clone, Copy, Debug, Default)]
struct Uncertainty {
    sum: f64,
    squares: f64,
    unseen: f64,
}

impl Uncertainty {
    fn add(&mut self, cell: &Cell, sign: f64) {
        // Differences leave rounding.
        self.sum = Real::max(self.sum + sign * cell.error, 0.0);
        self.squares = Real::max(self.squares + sign * cell.error * cell.error, 0.0);
        self.unseen = Real::max(self.unseen + sign * cell.unseen, 0.0);
    }

    /// Errors of rules have either sign, and what was not seen has one.
    fn total(&self) -> f64 {
        self.unseen + self.sum.min(DEVIATIONS * Real::sqrt(self.squares))
    }
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Cell {}
impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cell {
    fn cmp(&self, other: &Self) -> Ordering {
        self.uncertainty().total_cmp(&other.uncertainty())
    }
}

/// A pair, and what is between.
#[derive(Debug)]
pub(crate) struct Points<'a> {
    outer: Sheet<'a>,
    /// The area of the outer one.
    area: f64,
    inner: Sheet<'a>,
    /// What may hide something.
    screens: Vec<Screen<'a>>,
    /// A ball around each: the middle and the radius.
    balls: Vec<(Vector<f64>, f64)>,
    /// Whether only what the first polygon of the scene's order sees from the front hides, and whether that is the outer one.
    fronts: Option<bool>,
    occluders: &'a Occluders,
    rules: &'a Rules,
}

/// What may hide something.
#[derive(Debug)]
enum Screen<'a> {
    /// A polygon, and the part of it that is in front of the inner one.
    Face(&'a Occluder, Vec<Vector<f64>>),
    /// A body that is wholly in front of the inner polygon.
    Body(&'a Body),
}

/// Buffers, kept from pair to pair.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buffers {
    rest: Rest<3>,
    halves: Vec<Vector<f64>>,
    polygon: Vec<Vector<f64>>,
    seen: Vec<bool>,
    /// Which screens hide something from the points of a cell.
    has_met: Vec<bool>,
    shaft: Shaft,
}

/// What points see of a polygon, and what they would see if nothing were between.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    part: f64,
    all: f64,
}

impl Seen {
    fn share(self) -> f64 {
        if self.all > 0.0 {
            self.part / self.all
        } else {
            0.0
        }
    }
}

impl<'a> Points<'a> {
    /// The outer polygon, over which points are, and the inner one, with what may be between.
    pub(crate) fn new(
        (outer, inner): (Sheet<'a>, Sheet<'a>),
        found: &[&'a Occluder],
        fronts: Option<bool>,
        occluders: &'a Occluders,
        rules: &'a Rules,
        slack: f64,
    ) -> Self {
        let mut bodies: Vec<u32> = found.iter().filter_map(|own| own.body).collect();
        bodies.sort_unstable();
        bodies.dedup();
        let height = |p: Vector<f64>| {
            let first = inner.points.first().copied().unwrap_or_default();
            dot(inner.normal, sub(p, first))
        };
        // One that reaches behind the inner polygon, or in which the outer one may be, is taken face by face.
        bodies.retain(|&body| {
            occluders
                .body(body)
                .is_some_and(|own| own.is_apart(outer.points, slack) && own.is_before(inner, slack))
        });
        let is_whole = |own: &Occluder| {
            own.body
                .is_some_and(|body| bodies.binary_search(&body).is_ok())
        };
        let mut screens: Vec<Screen<'a>> = Vec::with_capacity(found.len());
        for &own in found.iter().filter(|own| !is_whole(own)) {
            let points = if inner.far {
                own.points.clone()
            } else {
                keep(&own.points, height, slack)
            };
            if points.len() >= 3 {
                screens.push(Screen::Face(own, points));
            }
        }
        screens.extend(
            bodies
                .iter()
                .filter_map(|&body| occluders.body(body))
                .map(Screen::Body),
        );
        // What hides much comes first: then little is left for the rest.
        let from = centroid(outer.points);
        let ball = |own: &Screen<'_>| {
            let points: &[Vector<f64>] = match own {
                Screen::Face(_, points) => points,
                Screen::Body(body) => &body.points,
            };
            let middle = centroid(points);
            (middle, radius(points, middle))
        };
        let mut placed: Vec<_> = screens.into_iter().map(|own| (ball(&own), own)).collect();
        let size = |(middle, radius): (Vector<f64>, f64)| radius / norm(sub(middle, from));
        placed.sort_by(|a, b| size(b.0).total_cmp(&size(a.0)));
        let (balls, screens) = placed.into_iter().unzip();
        Self {
            outer,
            area: area(outer.points),
            inner,
            screens,
            balls,
            fronts,
            occluders,
            rules,
        }
    }

    /// The number of polygons and bodies that may hide something.
    pub(crate) const fn screens(&self) -> usize {
        self.screens.len()
    }

    /// A_1 F_12, to `error` in the unit of area, or by about so many points, with what it may be off by. `None` if that is more than
    /// the error and `is_given_up`.
    pub(crate) fn exchange(
        &self,
        error: f64,
        most: usize,
        is_given_up: bool,
        slack: f64,
        buffers: &mut Buffers,
    ) -> Option<Amount> {
        let mut heap = BinaryHeap::new();
        let (mut off, mut points) = (Uncertainty::default(), 0);
        let (first, rest) = self.outer.points.split_first()?;
        let whole = Cell {
            corners: [*first; 3],
            screens: (0..self.screens.len() as u32).collect(),
            value: 0.0,
            error: f64::INFINITY,
            unseen: 0.0,
            missed: 2.0 * MISSED,
        };
        for pair in rest.windows(2) {
            let corners = [*first, pair[0], pair[1]];
            let cell = self.cell(corners, &whole, error, slack, buffers);
            points += 4;
            off.add(&cell, 1.0);
            heap.push(cell);
        }
        while off.total() > error {
            // The error falls faster than one over the number of points, but not always.
            let ratio = off.total() / error;
            let needed = points as f64 * Real::sqrt(ratio * Real::sqrt(ratio));
            if is_given_up && needed > most as f64 {
                return None;
            }
            if points >= most {
                break;
            }
            let cell = heap.pop()?;
            off.add(&cell, -1.0);
            let [a, b, c] = cell.corners;
            let [x, y, z] = [[b, c], [c, a], [a, b]].map(|[p, q]| along(p, 0.5, sub(q, p)));
            let quarters = [[a, z, y], [z, b, x], [y, x, c], [x, y, z]];
            let mut quarters =
                quarters.map(|corners| self.cell(corners, &cell, error, slack, buffers));
            points += 4 * quarters.len();
            let sum: f64 = quarters.iter().map(|own| own.value).sum();
            let changed = CHANGED * (sum - cell.value).abs();
            for own in &mut quarters {
                let least = Real::max(LEAST[0] * own.error, LEAST[1] * cell.error);
                own.error = own.error.min(Real::max(changed, least));
                off.add(own, 1.0);
            }
            heap.extend(quarters);
        }
        // Summed again, without what differences have lost.
        let value = heap.iter().map(|cell| cell.value).sum();
        Some(Amount {
            value,
            error: off.total(),
        })
    }

    /// A part of another cell.
    fn cell(
        &self,
        corners: [Vector<f64>; 3],
        whole: &Cell,
        error: f64,
        slack: f64,
        buffers: &mut Buffers,
    ) -> Cell {
        let missed = 0.5 * whole.missed;
        let mut cell = Cell {
            corners,
            screens: Vec::new(),
            value: 0.0,
            error: 0.0,
            unseen: 0.0,
            missed,
        };
        let is_first = whole.error == f64::INFINITY;
        let own = Sheet {
            points: &corners,
            ..self.outer
        };
        if is_first && self.outer.points.len() == 3 {
            cell.screens.extend_from_slice(&whole.screens);
        } else {
            buffers.shaft.enclose(own, self.inner, slack);
            for &number in &whole.screens {
                match self.hides(number, own, &buffers.shaft) {
                    Hides::Nothing => {}
                    Hides::Some => cell.screens.push(number),
                    Hides::All => {
                        return Cell {
                            screens: Vec::new(),
                            ..cell
                        };
                    }
                }
            }
        }
        let clear = clear::exchange(own, self.inner, 1e-3 * error / self.area, self.rules);
        if cell.screens.is_empty() {
            cell.value = clear.value;
            return cell;
        }
        let [a, b, c] = INNER;
        let places = [[a, b, c], [b, a, c], [b, c, a]];
        let (mut sum, mut shares) = (Seen::default(), [0.0; 3]);
        buffers.has_met.clear();
        buffers.has_met.resize(self.screens.len(), false);
        let middle = self.seen(centroid(&corners), &cell.screens, buffers);
        // All see nothing, or all that they could, but for what a cell may miss.
        let near = if self.inner.far {
            SMOOTH * missed
        } else {
            missed
        };
        let is_near = |seen: Seen, share: f64| (seen.share() - share).abs() <= near;
        let (mut is_dark, mut is_bright) = (is_near(middle, 0.0), is_near(middle, 1.0));
        for (own, weights) in shares.iter_mut().zip(places) {
            let at = from_fn(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum());
            let seen = self.seen(at, &cell.screens, buffers);
            is_dark &= is_near(seen, 0.0);
            is_bright &= is_near(seen, 1.0);
            sum.part += seen.part;
            sum.all += seen.all;
            *own = seen.share();
        }
        // What would be seen with nothing between is known: the points say which share of it is.
        let share = sum.share();
        cell.value = clear.value * share;
        // The middle may be right by chance: a quarter of a cell has no less than a sixteenth of its error, as where all is smooth.
        let least = if is_first {
            let squares = shares.map(|own| (own - share) * (own - share));
            clear.value * Real::sqrt(squares.iter().sum::<f64>() / 6.0)
        } else {
            LEAST[1] * whole.error
        };
        cell.error = Real::max(clear.value * (share - middle.share()).abs(), least);
        // Shadows by a cone are blurred, but for those of what is near: which points have to meet.
        let mut sharp = Vec::new();
        if self.inner.far {
            sharp = self.sharp(&corners, &cell.screens);
            is_bright |= sharp.iter().any(|&own| !buffers.has_met[own as usize]);
        }
        if is_dark || is_bright {
            let [a, b, c] = CORNERS;
            for weights in [[a, b, c], [b, a, c], [b, c, a]] {
                let at = from_fn(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum());
                let seen = self.seen(at, &cell.screens, buffers);
                is_dark &= is_near(seen, 0.0);
                is_bright &= is_near(seen, 1.0) || (self.inner.far && !sharp.is_empty());
                let apart = (seen.share() - share).abs();
                cell.error = Real::max(cell.error, OUTSIDE * clear.value * apart);
            }
        }
        // Points that do not know where most of it comes from may miss that, or all be on one side of a shadow's edge.
        let size = area(&corners);
        let off = (clear.value - size / 3.0 * sum.all).abs();
        cell.unseen = off.min(clear.value);
        if is_dark || is_bright {
            cell.unseen = Real::max(cell.unseen, clear.value * missed);
        }
        cell
    }

    /// What shadows may have sharp edges of on a cell.
    fn sharp(&self, corners: &[Vector<f64>; 3], screens: &[u32]) -> Vec<u32> {
        let middle = centroid(corners);
        let cone = radius(self.inner.points, centroid(self.inner.points));
        let reach = SHARP * radius(corners, middle) / cone;
        let is_near = |own: &u32| {
            let own = *own as usize;
            let (at, radius) = self.balls.get(own).copied().unwrap_or_default();
            let apart = match self.screens.get(own) {
                Some(Screen::Face(occluder, _)) => occluder.distance(middle),
                Some(Screen::Body(body)) => body.distance(middle),
                None => f64::INFINITY,
            };
            Real::max(apart, norm(sub(at, middle)) - radius) <= reach
        };
        screens.iter().copied().filter(is_near).collect()
    }

    /// What a screen hides of the inner polygon from a part of the outer one, by the shaft of both.
    fn hides(&self, number: u32, own: Sheet<'_>, shaft: &Shaft) -> Hides {
        let (a, b, fronts) = match self.fronts {
            Some(false) => (self.inner, own, true),
            of => (own, self.inner, of.is_some()),
        };
        match self.screens.get(number as usize) {
            Some(Screen::Face(occluder, _)) => shaft.of_one(occluder, a, b, fronts),
            Some(Screen::Body(body)) if shaft.excludes(&body.points) => Hides::Nothing,
            Some(Screen::Body(body)) if body.faces.len() <= FEW => {
                let faces = body.faces.iter().filter_map(|&f| self.occluders.get(f));
                let is_all = |face| matches!(shaft.of_one(face, a, b, fronts), Hides::All);
                if faces.into_iter().any(is_all) {
                    Hides::All
                } else {
                    Hides::Some
                }
            }
            Some(Screen::Body(_)) => Hides::Some,
            None => Hides::Nothing,
        }
    }

    /// The form factor from a point of the outer polygon to what it sees of the inner one.
    fn seen(&self, x: Vector<f64>, screens: &[u32], buffers: &mut Buffers) -> Seen {
        let Buffers {
            rest,
            halves,
            polygon,
            seen,
            has_met,
            ..
        } = buffers;
        polygon.clear();
        polygon.extend(self.inner.points.iter().map(|&p| self.inner.aim(x, p)));
        let all = Real::max(form_factor_from_origin(self.outer.normal, polygon), 0.0);
        rest.begin(polygon);
        let mut is_whole = true;
        for &number in screens {
            match self.screens.get(number as usize) {
                Some(Screen::Body(body)) => {
                    let is_front = |normal, at| dot(normal, sub(x, at)) > 0.0;
                    halves.clear();
                    let outline = body.outline(is_front, seen);
                    halves.extend(outline.map(|rim| {
                        let [a, b] = rim.ends;
                        cross(sub(a, x), sub(b, a)).map(|c| -c)
                    }));
                }
                Some(Screen::Face(occluder, points)) => {
                    let height = occluder.height(x);
                    let is_seen = match self.fronts {
                        None => height != 0.0,
                        Some(true) => height > 0.0,
                        Some(false) => height < 0.0,
                    };
                    if !is_seen {
                        continue;
                    }
                    // Inwards, if it is seen from its back.
                    let sign = if height < 0.0 { 1.0 } else { -1.0 };
                    halves.clear();
                    halves.extend(ring(points).map(|[a, b]| {
                        let normal = cross(sub(a, x), sub(b, a));
                        normal.map(|c| sign * c)
                    }));
                }
                None => continue,
            }
            if halves.is_empty() {
                continue;
            }
            rest.take(halves, dot, norm, |_| {
                is_whole = false;
                if let Some(has_met) = has_met.get_mut(number as usize) {
                    *has_met = true;
                }
            });
            if rest.is_empty() {
                return Seen { part: 0.0, all };
            }
        }
        if is_whole {
            return Seen { part: all, all };
        }
        let sum: f64 = rest
            .each()
            .map(|cone| form_factor_from_origin(self.outer.normal, cone))
            .sum();
        // Differences of cones leave rounding.
        let part = if sum <= ROUNDING * all {
            0.0
        } else if sum >= (1.0 - ROUNDING) * all {
            all
        } else {
            sum
        };
        Seen { part, all }
    }
}
