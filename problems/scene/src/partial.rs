//! What two polygons exchange that see each other in part.
//!
//! The part of one polygon that a point of the other does not see changes its shape where an edge of
//! what is between appears to pass a vertex: on the lines through the shadows of the occluders'
//! edges, cast by the polygon's vertices, and the images of the polygon's edges through the
//! occluders' vertices. Within the cells of these lines it is an analytic function, for which few
//! Gauss points suffice. Where three edges appear to meet in a point it has kinks on curves, too;
//! there cells are halved until the error is small.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Ordering;

use fredholm_core::Real;
use fredholm_core::array::from_fn;

use crate::clear::{self, Sheet};
use crate::clip::{below, cut, halves, keep, ring, within};
use crate::lambert::from_origin;
use crate::occluders::{Occluder, Occluders};
use crate::rules::{Rules, area, radius};
use crate::vector::{Vector, centroid, cross, dot, norm, sub};

/// The most cells into which one polygon is cut along lines.
const CELLS: usize = 4096;

/// The most points of one pair.
const POINTS: usize = 400_000;

/// Where screens mix, parts are this share of the pair's size to begin with.
const WIDEST: f64 = 0.1;

/// An amount and what it may be wrong by.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Amount {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

/// A part of the outer polygon, and what is hidden from it by the screens of a set.
#[derive(Debug)]
struct Part {
    points: Vec<Vector<f64>>,
    own: Amount,
    set: usize,
}

/// By error.
impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.own.error.total_cmp(&other.own.error)
    }
}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

/// An occluder between two polygons.
#[derive(Clone, Debug)]
struct Screen {
    points: Vec<Vector<f64>>,
    normal: Vector<f64>,
    /// The number of the occluder.
    number: u32,
}

impl Screen {
    fn height(&self, point: Vector<f64>) -> f64 {
        let first = self.points.first().copied().unwrap_or_default();
        dot(self.normal, sub(point, first))
    }
}

/// Buffers for polygons, kept from point to point.
#[derive(Clone, Debug, Default)]
struct Buffers {
    inner: Vec<Vector<f64>>,
    own: Vec<Vector<f64>>,
    rest: Vec<Vector<f64>>,
    out: Vec<Vector<f64>>,
    screen: Vec<Vector<f64>>,
    /// The pieces that nothing hides yet: their vertices, and where each ends.
    pieces: [(Vec<Vector<f64>>, Vec<usize>); 2],
}

/// Two polygons, what is between them, and how much is computed.
pub(crate) struct Partial<'a> {
    outer: Sheet<'a>,
    inner: Sheet<'a>,
    screens: Vec<Screen>,
    /// Whether only what is seen from the front hides.
    fronts: bool,
    rules: &'a Rules,
    /// The error that is allowed, per area of the outer polygon.
    density: f64,
    slack: f64,
    /// No point of the polygons is further than this from another.
    size: f64,
    /// The largest radius of a part on which screens may mix, to begin with.
    widest: f64,
    points: usize,
    /// The number of vertices in the last view, and whether another one had another number.
    views: Option<(usize, bool)>,
    /// The most that was hidden from a point.
    most: f64,
    buffers: Buffers,
}

/// A_1 F_12 of two polygons with these occluders between them, to `error`.
pub(crate) fn exchange(
    (a, b): (Sheet<'_>, Sheet<'_>),
    (occluders, found): (&Occluders, &[u32]),
    fronts: bool,
    error: f64,
    slack: f64,
    rules: &Rules,
) -> Amount {
    // What is seen from the front is said of the first.
    let size = |s: Sheet<'_>| radius(s.points, centroid(s.points));
    let swap = size(b) < size(a);
    let (outer, inner) = if swap { (b, a) } else { (a, b) };
    let mut pair = Partial {
        outer,
        inner,
        screens: Vec::new(),
        fronts,
        rules,
        density: error / area(outer.points),
        slack,
        size: size(a) + size(b) + norm(sub(centroid(a.points), centroid(b.points))),
        widest: 0.0,
        points: 0,
        views: None,
        most: 0.0,
        buffers: Buffers::default(),
    };
    pair.widest = WIDEST * pair.size;
    for &number in found {
        if let Some(occluder) = occluders.all.get(number as usize) {
            let sign = if swap { -1.0 } else { 1.0 };
            pair.add(occluder, number, sign);
        }
    }
    pair.exchange(occluders)
}

impl Partial<'_> {
    /// Adds the part of an occluder that is in front of both polygons. The sign is that of the side
    /// from which it hides.
    fn add(&mut self, occluder: &Occluder, number: u32, sign: f64) {
        let buffers = &mut self.buffers;
        for (to, sheet) in [(true, self.outer), (false, self.inner)] {
            let first = sheet.points.first().copied().unwrap_or_default();
            let height = |p: Vector<f64>| dot(sheet.normal, sub(p, first));
            if to {
                keep(&occluder.points, &height, self.slack, &mut buffers.own);
            } else {
                keep(&buffers.own, &height, self.slack, &mut buffers.rest);
            }
        }
        let size = radius(
            &buffers.rest,
            buffers.rest.first().copied().unwrap_or_default(),
        );
        if buffers.rest.len() >= 3 && area(&buffers.rest) > self.slack * size {
            self.screens.push(Screen {
                points: buffers.rest.clone(),
                normal: occluder.normal.map(|x| sign * x),
                number,
            });
        }
    }

    fn exchange(&mut self, occluders: &Occluders) -> Amount {
        let tolerance = 1e-9 * radius(self.outer.points, centroid(self.outer.points));
        let (cells, whole) = self.cells(tolerance);
        let mut sum = Amount::default();
        let mut parts = BinaryHeap::new();
        let mut sets = Vec::new();
        for cell in &cells {
            let mut active = Vec::new();
            self.activate(cell, whole, &mut active);
            let outer = Sheet {
                points: cell,
                normal: self.outer.normal,
            };
            // What it would be if nothing were between, less what is hidden.
            let mixed = !whole || self.may_mix(&active, occluders);
            if active.is_empty() {
                sum.value += clear::exchange(outer, self.inner, 0.0, self.rules);
            } else if mixed || !self.sees_nothing(cell, &active) {
                sum.value += clear::exchange(outer, self.inner, 0.0, self.rules);
                self.divide(cell, (&active, mixed), &mut |points, own| {
                    parts.push(Part {
                        points,
                        own,
                        set: sets.len(),
                    });
                });
                sets.push((active, mixed));
            }
        }
        self.refine(&mut parts, &sets);
        for part in parts {
            sum.value -= part.own.value;
            sum.error += part.own.error;
        }
        sum.value = Real::max(sum.value, 0.0);
        sum
    }

    /// Whether two of these screens are not of one convex body, and have no vertex in common: then
    /// three edges may appear to meet in a point, and what is hidden is no analytic function on the
    /// cells.
    fn may_mix(&self, active: &[usize], occluders: &Occluders) -> bool {
        let occluder = |s: &usize| {
            let screen = self.screens.get(*s)?;
            occluders.all.get(screen.number as usize)
        };
        let apart = |s: &usize, t: &usize| {
            let (Some(a), Some(b)) = (occluder(s), occluder(t)) else {
                return true;
            };
            a.body != b.body && !a.vertices.iter().any(|v| b.vertices.contains(v))
        };
        let mut own = active.iter().enumerate();
        own.any(|(k, s)| active.iter().skip(k + 1).any(|t| apart(s, t)))
    }

    /// Hands out a cell as triangles and quadrilaterals, small ones if they are mixed, with what is
    /// hidden from each.
    fn divide(
        &mut self,
        cell: &[Vector<f64>],
        (active, mixed): (&[usize], bool),
        each: &mut dyn FnMut(Vec<Vector<f64>>, Amount),
    ) {
        let mut open = Vec::new();
        if cell.len() <= 4 {
            open.push(cell.to_vec());
        } else {
            let pairs = cell.windows(2).skip(1);
            open.extend(pairs.map(|pair| Vec::from([cell[0], pair[0], pair[1]])));
        }
        while let Some(part) = open.pop() {
            let wide = radius(&part, centroid(&part)) > self.widest;
            if mixed && wide && open.len() < CELLS {
                open.extend(halves(&part));
            } else {
                let own = self.integral(&part, active, mixed);
                each(part, own);
            }
        }
    }

    /// Halves the parts of the largest error until all of them together are good enough.
    fn refine(&mut self, parts: &mut BinaryHeap<Part>, sets: &[(Vec<usize>, bool)]) {
        let allowed = self.density * area(self.outer.points);
        let mut error: f64 = parts.iter().map(|part| part.own.error).sum();
        while error > allowed && self.points < POINTS {
            let Some(worst) = parts.pop() else { break };
            error -= worst.own.error;
            let Some((active, mixed)) = sets.get(worst.set) else {
                break;
            };
            for points in halves(&worst.points) {
                let own = self.integral(&points, active, *mixed);
                error += own.error;
                parts.push(Part {
                    points,
                    own,
                    set: worst.set,
                });
            }
        }
    }

    /// The polygon cut along the lines at which the view changes, and whether all of them were cut.
    fn cells(&self, tolerance: f64) -> (Vec<Vec<Vector<f64>>>, bool) {
        let mut cells = Vec::from([self.outer.points.to_vec()]);
        let mut whole = true;
        self.for_each_line(&mut |segment| {
            let normal = self.outer.normal;
            let across = cross(normal, sub(segment[1], segment[0]));
            let length = norm(across);
            if !(length > 0.0) || !length.is_finite() {
                return;
            }
            let mut k = 0;
            while k < cells.len() {
                let cell = &cells[k];
                let height = |p: Vector<f64>| dot(across, sub(p, segment[0])) / length;
                let above = cell.iter().any(|&p| height(p) > tolerance);
                let below = cell.iter().any(|&p| height(p) < -tolerance);
                if above && below && within(segment, cell, normal, tolerance).is_some() {
                    if cells.len() >= CELLS {
                        whole = false;
                        return;
                    }
                    let (mut first, mut second) = (Vec::new(), Vec::new());
                    keep(cell, &height, 0.01 * tolerance, &mut first);
                    keep(cell, &|p| -height(p), 0.01 * tolerance, &mut second);
                    cells[k] = first;
                    // It comes last, and this line does not cut it again.
                    cells.push(second);
                }
                k += 1;
            }
        });
        cells.retain(|cell| cell.len() >= 3);
        (cells, whole)
    }

    /// Calls `cut` with segments in the plane of the outer polygon on which the view changes.
    fn for_each_line(&self, cut: &mut dyn FnMut([Vector<f64>; 2])) {
        let base = self.outer.points.first().copied().unwrap_or_default();
        let normal = self.outer.normal;
        let rise = |p: Vector<f64>| dot(normal, sub(p, base));
        // Where the line from v through w meets the plane.
        let meet = |v: Vector<f64>, w: Vector<f64>| {
            let (high, low) = (rise(v), rise(w));
            let t = high / (high - low);
            from_fn(|k| v[k] + t * (w[k] - v[k]))
        };
        for screen in &self.screens {
            // Its own plane: there it is seen from the edge.
            let edges = ring(self.outer.points);
            let mut ends = edges.filter_map(|[a, b]| {
                let (from, to) = (screen.height(a), screen.height(b));
                let t = from / (from - to);
                ((from > 0.0) != (to > 0.0)).then(|| from_fn(|k| a[k] + t * (b[k] - a[k])))
            });
            if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
                cut([a, b]);
            }
            for [w, x] in ring(&screen.points) {
                for &v in self.inner.points {
                    // The part of the edge that is below the vertex.
                    let top = rise(v) * (1.0 - 1e-6);
                    if let Some([w, x]) = below([w, x], [rise(w), rise(x)], top) {
                        cut([meet(v, w), meet(v, x)]);
                    }
                }
            }
            for &w in &screen.points {
                if rise(w).abs() <= self.slack {
                    // Both were cut by this plane: the line is in it.
                    for &v in self.inner.points {
                        if rise(v).abs() <= self.slack {
                            let far = 4.0 * self.size / norm(sub(w, v));
                            cut([w, from_fn(|k| w[k] + far * (w[k] - v[k]))]);
                        }
                    }
                }
                for [v, u] in ring(self.inner.points) {
                    let least = -rise(w) * (1.0 + 1e-6);
                    let ends = below([v, u], [-rise(v), -rise(u)], least);
                    if let Some([v, u]) = ends
                        && rise(v) > 0.0
                        && rise(u) > 0.0
                    {
                        cut([meet(v, w), meet(u, w)]);
                    }
                }
            }
        }
    }

    /// The screens that hide something from a cell: from its middle, or from close to its vertices.
    /// All, if the cell is cut by lines still.
    fn activate(&mut self, cell: &[Vector<f64>], whole: bool, active: &mut Vec<usize>) {
        active.clear();
        active.extend(0..self.screens.len());
        if !whole {
            return;
        }
        let middle = centroid(cell);
        active.retain(|&s| {
            let near = |p: &Vector<f64>| from_fn(|k| middle[k] + 0.999 * (p[k] - middle[k]));
            let samples = core::iter::once(middle).chain(cell.iter().map(near));
            let mut samples = samples.filter(|&x| self.hides(x, s));
            samples.next().is_some()
        });
    }

    /// Whether a screen alone hides something from a point.
    fn hides(&mut self, x: Vector<f64>, screen: usize) -> bool {
        self.look(x);
        if !self.prepare(x, screen) {
            return false;
        }
        let Buffers {
            inner,
            own,
            rest,
            out,
            screen,
            ..
        } = &mut self.buffers;
        own.clear();
        own.extend_from_slice(inner);
        for [w, v] in ring(screen) {
            cut(own, cross(w, v), out, rest);
            core::mem::swap(own, rest);
        }
        own.len() >= 3 && from_origin(self.outer.normal, own) > 1e-15
    }

    /// The inner polygon as the point sees it.
    fn look(&mut self, x: Vector<f64>) {
        self.buffers.inner.clear();
        let relative = self.inner.points.iter().map(|&p| sub(p, x));
        self.buffers.inner.extend(relative);
    }

    /// The screen as the point sees it, in the sense of rotation in which its inside is below the
    /// planes through its edges. False if it hides nothing.
    fn prepare(&mut self, x: Vector<f64>, screen: usize) -> bool {
        let Some(screen) = self.screens.get(screen) else {
            return false;
        };
        let height = screen.height(x);
        if height == 0.0 || (self.fronts && height < 0.0) {
            return false;
        }
        let own = &mut self.buffers.screen;
        own.clear();
        own.extend(screen.points.iter().map(|&p| sub(p, x)));
        let [a, b, c] = [own[0], own[1], own[2]];
        // A clipped outline may begin with three vertices that are almost on a line.
        let turn = if own.len() == 3 {
            dot(a, cross(b, c))
        } else {
            let double = crate::rules::double_area(own);
            dot(double, a)
        };
        if turn > 0.0 {
            own.reverse();
        }
        true
    }

    /// The form factor from a point to what the active screens hide.
    fn hidden(&mut self, x: Vector<f64>, active: &[usize]) -> f64 {
        self.points += 1;
        self.look(x);
        let normal = self.outer.normal;
        let (vertices, ends) = &mut self.buffers.pieces[0];
        vertices.clear();
        vertices.extend_from_slice(&self.buffers.inner);
        ends.clear();
        ends.push(vertices.len());
        let (mut sum, mut view) = (0.0, 0);
        for (k, &s) in active.iter().enumerate() {
            if !self.prepare(x, s) {
                continue;
            }
            let last = k + 1 == active.len();
            let Buffers {
                own,
                rest,
                out,
                screen,
                pieces: [from, to],
                ..
            } = &mut self.buffers;
            to.0.clear();
            to.1.clear();
            let mut start = 0;
            for &end in &from.1 {
                own.clear();
                own.extend_from_slice(from.0.get(start..end).unwrap_or(&[]));
                start = end;
                for [w, v] in ring(screen) {
                    cut(own, cross(w, v), out, rest);
                    if !last && !out.is_empty() {
                        to.0.extend_from_slice(out);
                        to.1.push(to.0.len());
                    }
                    core::mem::swap(own, rest);
                    if own.is_empty() {
                        break;
                    }
                }
                sum += from_origin(normal, own);
                view = 31 * (view % 0x0100_0000) + own.len();
            }
            core::mem::swap(from, to);
        }
        self.views = Some(match self.views {
            Some((first, other)) => (first, other || first != view),
            None => (view, false),
        });
        self.most = Real::max(self.most, sum);
        sum
    }

    /// Whether nine points of a cell see nothing of the inner polygon.
    fn sees_nothing(&mut self, cell: &[Vector<f64>], active: &[usize]) -> bool {
        let mut places = Vec::with_capacity(16);
        self.rules.polygon(3, cell, &mut |x, _| places.push(x));
        places.iter().all(|&x| {
            let hidden = self.hidden(x, active);
            from_origin(self.outer.normal, &self.buffers.inner) - hidden <= 1e-15
        })
    }

    /// The integral of what is hidden over a part of a cell.
    fn integral(&mut self, part: &[Vector<f64>], active: &[usize], mixed: bool) -> Amount {
        let size = area(part);
        let allowed = Real::max(self.density * size, 1e-18);
        self.views = None;
        self.most = 0.0;
        let mut before = self.rule(3, part, active);
        let mut change = (before - self.rule(2, part, active)).abs();
        if mixed {
            let middle = centroid(part);
            for &p in part {
                self.hidden(from_fn(|k| middle[k] + 0.999 * (p[k] - middle[k])), active);
            }
        }
        let mut error = 0.0;
        for points in [5, 8] {
            let value = self.rule(points, part, active);
            let last = (value - before).abs();
            // Where the function is analytic the changes fall ever faster; at a kink they do not.
            let ratio = last / change;
            error = if ratio < 0.05 {
                2.0 * last * ratio
            } else {
                4.0 * last
            };
            if mixed && matches!(self.views, Some((_, true))) {
                // The second derivative jumps on a curve, which the points may miss.
                let width = radius(part, part[0]) / self.size;
                error = Real::max(4.0 * last, 0.005 * size * self.most * width * width);
            }
            (before, change) = (value, last);
            // More points do not help if they gain too little.
            if !(error > allowed) || last == 0.0 || error > 1e3 * allowed {
                break;
            }
        }
        Amount {
            value: before,
            error: if error > 0.0 { error } else { 0.0 },
        }
    }

    fn rule(&mut self, points: usize, part: &[Vector<f64>], active: &[usize]) -> f64 {
        let mut sum = 0.0;
        let rules = self.rules;
        rules.polygon(points, part, &mut |x, weight| {
            sum += weight * self.hidden(x, active);
        });
        sum
    }
}
