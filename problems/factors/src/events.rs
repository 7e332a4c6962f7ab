//! Where the view past an edge changes its shape.
//!
//! As y moves along an edge, what of P sees Q past it is bounded by shadows of other edges, cast from y. It changes its
//! shape where a shadow's edge meets a vertex, which is where the plane through y and an edge meets the vertex of another
//! (linear in y), and where three shadows' edges meet in a point, which is where the planes through y and three edges have
//! a line in common: the determinant of their normals is quadratic in y, because its cubic part vanishes. Between these
//! places the integrand is analytic. With Q at infinity some lines are arcs, whose ends are directions, or y is a direction
//! itself, and shadows are those of parallel light: the degrees are the same.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_surfaces::space::{Vector, along, cross, dot, norm, ring, sub, unit};

use crate::clear::PARALLEL;
use crate::silhouette::{Edge, INNER, View};

/// The number of P as a sheet; those after it are lines in P.
const OUTER: usize = usize::MAX / 2;

/// By how much of its length a line may miss an edge that it is said to meet. What is too much adds a place.
const MISS: f64 = 1e-7;

/// The most lines of which threes are looked at: they are as many as its cube.
const LINES: usize = 160;

/// An edge that casts a shadow, and the plane through it and y.
#[derive(Clone, Copy, Debug)]
struct Line {
    ends: [Vector<f64>; 2],
    /// Whether its ends are directions.
    far: bool,
    sheet: usize,
    /// The sheet on the other side of the same line, if there is one, or this one.
    twin: usize,
    /// The normals with y at the beginning, in the middle and at the end of the edge.
    normals: [Vector<f64>; 3],
}

impl Line {
    fn new(ends: [Vector<f64>; 2], sheet: usize, edge: &Edge) -> Self {
        Self::of(ends, false, sheet, edge)
    }

    fn of(ends: [Vector<f64>; 2], far: bool, sheet: usize, edge: &Edge) -> Self {
        let mut line = Self {
            ends,
            far,
            sheet,
            twin: sheet,
            normals: [[0.0; 3]; 3],
        };
        line.normals = [0.0, 0.5, 1.0].map(|t| line.normal(edge.at(t), edge.far));
        line
    }

    /// Whether both are lines of one sheet, which meet at its vertices only.
    const fn adjoins(&self, other: &Self) -> bool {
        self.sheet == other.sheet
            || self.sheet == other.twin
            || self.twin == other.sheet
            || self.twin == other.twin
    }

    /// The normal of the plane through the line and y, which is perhaps a direction.
    fn normal(&self, y: Vector<f64>, is_direction: bool) -> Vector<f64> {
        let [a, b] = self.ends;
        if self.far {
            cross(a, b)
        } else if is_direction {
            cross(sub(b, a), y)
        } else {
            cross(sub(a, y), sub(b, a))
        }
    }

    /// How far a point is above the plane through the line and y, times the length of the normal.
    fn height(&self, normal: Vector<f64>, y: Vector<f64>, far: bool, point: Vector<f64>) -> f64 {
        dot(normal, sub(point, if far { self.ends[0] } else { y }))
    }

    /// Whether the line through y in this direction, which is in the plane of both, meets the edge.
    fn met(&self, y: Vector<f64>, direction: Vector<f64>) -> bool {
        let [a, b] = self.ends;
        if self.far {
            let normal = cross(a, b);
            let depths = [cross(a, direction), cross(direction, b)].map(|m| dot(m, normal));
            let slack = -MISS * norm(direction) * dot(normal, normal);
            return depths.iter().all(|&d| d >= slack) || depths.iter().all(|&d| d <= -slack);
        }
        let across = cross(sub(b, a), direction);
        let square = dot(across, across);
        let t = dot(cross(sub(y, a), direction), across) / square;
        (-MISS..=1.0 + MISS).contains(&t)
    }

    /// The heights of the ends of another line above the plane, with y at the beginning and at the end.
    fn heights(&self, other: &Self, edge: &Edge) -> [[f64; 2]; 2] {
        let (first, last) = (edge.at(0.0), edge.at(1.0));
        other.ends.map(|w| {
            if other.far {
                return [dot(self.normals[0], w), dot(self.normals[2], w)];
            }
            [
                self.height(self.normals[0], first, edge.far, w),
                self.height(self.normals[2], last, edge.far, w),
            ]
        })
    }
}

/// The fractions of an edge, ascending from 0 to 1, between which the integrand is analytic, if all were looked for.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    pub(crate) at: Vec<f64>,
    /// Whether places are known where three lines meet: these are kinks, which a rule's points do not tell of.
    pub(crate) is_whole: bool,
}

/// Where the integrand along an edge has kinks.
pub(crate) fn places(view: &View, edge: &Edge) -> Places {
    let mut places = Vec::from([0.0, 1.0]);
    let lines = lines(view, edge);
    for screen in edge.others.iter().filter_map(|&k| view.sheets.get(k)) {
        let [low, high] = [0.0, 1.0].map(|t| screen.rise(edge, t));
        if (low > 0.0) != (high > 0.0) {
            places.push(low / (low - high));
        }
    }
    for a in &lines {
        for b in lines.iter().filter(|b| !b.adjoins(a)) {
            for (k, [low, high]) in a.heights(b, edge).into_iter().enumerate() {
                if (low > 0.0) == (high > 0.0) {
                    continue;
                }
                let t = low / (low - high);
                let (y, end) = (edge.at(t), b.ends[k]);
                let line = match (edge.far, b.far) {
                    (true, _) => (end, y),
                    (_, true) => (y, end),
                    _ => (y, sub(end, y)),
                };
                if is_seen(view, edge, line, &[a, b]) {
                    places.push(t);
                }
            }
        }
    }
    let is_whole = lines.len() <= LINES;
    if is_whole {
        threes(view, edge, &lines, &mut places);
    }
    places.retain(|t| (0.0..=1.0).contains(t));
    places.sort_unstable_by(f64::total_cmp);
    places.dedup_by(|b, a| *b - *a <= 1e-10);
    if let Some(last) = places.last_mut() {
        *last = 1.0;
    }
    Places {
        at: places,
        is_whole,
    }
}

/// The edges that may cast shadows past this one.
fn lines(view: &View, edge: &Edge) -> Vec<Line> {
    let mut all: Vec<Line> = Vec::new();
    all.extend(ring(&view.outer).map(|ends| Line::new(ends, OUTER, edge)));
    for (number, sheet) in view.sheets.iter().enumerate() {
        let is_far_off =
            number != INNER && !edge.touches(number) && edge.others.binary_search(&number).is_err();
        if is_far_off {
            continue;
        }
        if !edge.touches(number) {
            let far = view.far && number == INNER;
            let own = sheet.between();
            all.extend(own.map(|(ends, _)| Line::of(ends, far, number, edge)));
        } else if number != INNER {
            // The part of P in its plane.
            let heights = |p: Vector<f64>| sheet.height(p);
            let mut ends = ring(&view.outer).filter_map(|[a, b]| {
                let (low, high) = (heights(a), heights(b));
                ((low > 0.0) != (high > 0.0)).then(|| along(a, low / (low - high), sub(b, a)))
            });
            if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
                all.push(Line::new([a, b], OUTER + 1 + number, edge));
            }
        }
    }
    join(view, edge, &mut all);
    // Those on one line with the edge are no lines past it; and what lines meet meets P and Q, too.
    let length = norm(edge.span);
    let [first, last] = [edge.at(0.0), edge.at(1.0)];
    let crosses = |line: &Line, points: &[Vector<f64>], far: bool| {
        let (mut above, mut below) = (false, false);
        for (y, normal) in [(first, line.normals[0]), (last, line.normals[2])] {
            let slack = MISS * norm(normal);
            for &p in points {
                let height = if far {
                    dot(normal, p)
                } else {
                    line.height(normal, y, edge.far, p)
                };
                above |= height >= -slack;
                below |= height <= slack;
            }
        }
        above && below
    };
    let inner = view.sheets.first().filter(|_| !edge.touches(INNER));
    all.retain(|line| {
        line.normals.iter().any(|&n| norm(n) > view.slack * length)
            && crosses(line, &view.outer, false)
            && inner.is_none_or(|q| crosses(line, &q.points, view.far))
    });
    all
}

/// Makes one of two lines that sheets have in common, and none where the shadows of both are side by side: then the shadow of both
/// together does not end there.
fn join(view: &View, edge: &Edge, lines: &mut Vec<Line>) {
    let is_other = |sheet: usize| edge.others.binary_search(&sheet).is_ok();
    let is_near = |p: Vector<f64>, q: Vector<f64>| norm(sub(p, q)) <= view.slack;
    let mut k = 0;
    while let Some(own) = lines.get(k).copied() {
        k += 1;
        if !is_other(own.sheet) {
            continue;
        }
        let [a, b] = own.ends;
        let rest = lines.iter().enumerate().skip(k);
        let mut twins = rest.filter(|(_, line)| {
            is_other(line.sheet) && is_near(line.ends[0], b) && is_near(line.ends[1], a)
        });
        let (Some((at, twin)), None) = (twins.next(), twins.next()) else {
            continue;
        };
        let number = twin.sheet;
        let heights = |sheet: usize| {
            let sheet = view.sheets.get(sheet);
            [0.0, 1.0].map(|t| sheet.map_or(0.0, |own| own.rise(edge, t)))
        };
        let ([p, q], [r, s]) = (heights(own.sheet), heights(number));
        let is_above = [p, q, r, s].iter().all(|&h| h > view.slack);
        let is_below = [p, q, r, s].iter().all(|&h| h < -view.slack);
        lines.remove(at);
        k -= 1;
        if is_above || is_below {
            lines.remove(k);
        } else if let Some(own) = lines.get_mut(k) {
            own.twin = number;
            k += 1;
        }
    }
}

/// Places where three lines appear to meet in a point.
fn threes(view: &View, edge: &Edge, lines: &[Line], places: &mut Vec<f64>) {
    // Whether one line may appear to cross another: not if both ends are on one side of the plane all along.
    let cross_over = |a: &Line, b: &Line| {
        let [p, q] = a.heights(b, edge);
        let all = [p[0], p[1], q[0], q[1]];
        !(all.iter().all(|&h| h > 0.0) || all.iter().all(|&h| h < 0.0))
    };
    // After each line those that it crosses.
    let crossed: Vec<Vec<usize>> = (lines.iter().enumerate())
        .map(|(k, a)| {
            let rest = lines.iter().enumerate().skip(k + 1);
            let rest = rest.filter(|(_, b)| !a.adjoins(b) && cross_over(a, b) && cross_over(b, a));
            rest.map(|(l, _)| l).collect()
        })
        .collect();
    for (a, own) in lines.iter().zip(&crossed) {
        for &l in own {
            let (Some(b), Some(others)) = (lines.get(l), crossed.get(l)) else {
                continue;
            };
            let directions: [Vector<f64>; 3] = from_fn(|i| cross(a.normals[i], b.normals[i]));
            let both = others.iter().filter(|m| own.binary_search(m).is_ok());
            for c in both.filter_map(|&m| lines.get(m)) {
                let values: [f64; 3] = if edge.far {
                    [0.0, 0.5, 1.0].map(|t| concurrence([a, b, c], edge.at(t)))
                } else {
                    from_fn(|i| dot(directions[i], c.normals[i]))
                };
                for t in roots(values) {
                    let y = edge.at(t);
                    let line = if edge.far {
                        (meeting([a, b, c], y), y)
                    } else {
                        (y, common([a, b, c], y))
                    };
                    if is_seen(view, edge, line, &[a, b, c]) {
                        places.push(t);
                    }
                }
            }
        }
    }
}

/// The direction of the line that the planes through y and three lines have in common. Two of them may be one.
fn common(lines: [&Line; 3], y: Vector<f64>) -> Vector<f64> {
    let normals = lines.map(|line| unit(line.normal(y, false)));
    let all: [Vector<f64>; 3] = from_fn(|k| cross(normals[k], normals[(k + 1) % 3]));
    let mut best = all[0];
    for direction in all {
        if norm(direction) > norm(best) {
            best = direction;
        }
    }
    best
}

/// What is 0 if shadows of three lines in the direction ω meet in a point, quadratic in ω: Σ c₁ ω·(e₂ × e₃) over the turns of
/// three, where e are the lines' spans, and n·x = c, n = e × ω, are the planes through them.
fn concurrence(lines: [&Line; 3], w: Vector<f64>) -> f64 {
    let spans = lines.map(|line| sub(line.ends[1], line.ends[0]));
    let at = |k: usize| {
        let height = dot(cross(spans[k], w), lines[k].ends[0]);
        height * dot(w, cross(spans[(k + 1) % 3], spans[(k + 2) % 3]))
    };
    at(0) + at(1) + at(2)
}

/// The point of P's plane where shadows of three lines in the direction ω meet: of those two that are furthest from parallel.
fn meeting(lines: [&Line; 3], w: Vector<f64>) -> Vector<f64> {
    let traces = lines.map(|line| {
        let n = unit(line.normal(w, true));
        [n[0], n[1], -dot(n, line.ends[0])]
    });
    let mut best = [0.0; 3];
    for k in 0..3 {
        let point = cross(traces[k], traces[(k + 1) % 3]);
        if point[2].abs() > best[2].abs() {
            best = point;
        }
    }
    [best[0] / best[2], best[1] / best[2], 0.0]
}

/// The zeros in (0, 1) of the quadratic function with these values at 0, ½ and 1.
fn roots([first, middle, last]: [f64; 3]) -> impl Iterator<Item = f64> {
    // c + b t + a t².
    let (c, b) = (first, 4.0 * middle - 3.0 * first - last);
    let a = 2.0 * (first + last) - 4.0 * middle;
    let inner = b * b - 4.0 * a * c;
    let root = if inner >= 0.0 {
        Real::sqrt(inner)
    } else {
        f64::NAN
    };
    let q = -0.5 * (b + if b < 0.0 { -root } else { root });
    [q / a, c / q].into_iter().filter(|t| *t > 0.0 && *t < 1.0)
}

/// Whether the line through y on the edge goes from P to Q past these lines, with nothing between. If the edge is at infinity
/// the line has its direction, and y is any point of the line.
fn is_seen(
    view: &View,
    edge: &Edge,
    (y, direction): (Vector<f64>, Vector<f64>),
    lines: &[&Line],
) -> bool {
    if !lines.iter().all(|line| line.met(y, direction)) {
        return false;
    }
    let among = |sheet: usize| {
        let mut own = lines.iter();
        own.any(|line| line.sheet == sheet || line.twin == sheet)
    };
    let low = if edge.far {
        direction[2].abs() <= PARALLEL
    } else {
        y[2] <= view.slack
    };
    if low {
        return true;
    }
    // From P upwards.
    let up = if direction[2] < 0.0 {
        direction.map(|x| -x)
    } else {
        direction
    };
    let t = y[2] / up[2];
    let foot = along(y, -t, up);
    let inside = ring(&view.outer).all(|[a, b]| {
        let (span, aim) = (sub(b, a), sub(foot, a));
        span[0] * aim[1] - span[1] * aim[0] >= -MISS
    });
    // Written so that NaN fails.
    if !inside {
        return false;
    }
    // How far inside of an edge of a sheet the line passes, seen from its front.
    let depth = |[a, b]: [Vector<f64>; 2], far: bool| {
        let normal = if far {
            cross(a, b)
        } else {
            cross(sub(a, y), sub(b, y))
        };
        -dot(normal, up)
    };
    let others = core::iter::once(&INNER).chain(&edge.others);
    let mut sheets = others.filter_map(|&number| Some((number, view.sheets.get(number)?)));
    sheets.all(|(number, sheet)| {
        if among(number) || edge.touches(number) {
            return true;
        }
        if number == INNER {
            return ring(&sheet.points).all(|ends| depth(ends, view.far) >= -MISS);
        }
        let is_beside =
            |sign: f64| ring(&sheet.points).any(|ends| sign * depth(ends, false) <= MISS);
        is_beside(1.0) && (view.fronts || is_beside(-1.0))
    })
}
