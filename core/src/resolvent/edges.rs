//! Cells between edges, and where edges belong: at jumps, and close together where functions change fast.

use alloc::vec;
use alloc::vec::Vec;

use super::Regular;
use crate::galerkin::{Cells, MOST_DIMENSIONS};
use crate::{Located, Real, Space};

/// Points of an axis at which K(x, x) and F are looked at, in one dimension and on each of three lines in more.
const POINTS: [usize; 2] = [1 << 13, 1 << 10];
/// Points of an axis at which K(x, y) is looked at from a fixed y, and to a fixed x.
const CROSS_POINTS: usize = 1 << 8;
/// Lines of an axis in more than one dimension, and points from which K is looked at: a jump is one where two of them have it.
const LINES: u32 = 3;
/// The part of the variation, or of the largest value, that a jump has at least.
const LEAST_JUMP: f64 = 1.0 / 64.0;
/// The part of the largest value below which a variation is none.
const LEAST_VARIATION: f64 = 0.01;
/// How far apart two places are that are one.
const SAME: f64 = 1e-9;
/// The most cells before any is asked for, by the dimension.
const MOST_CELLS: [usize; MOST_DIMENSIONS] = [64, 8, 4, 3, 2, 2];

/// The steps between points of an axis: fractions of √2, √3, √5, √7, √11 and √13.
const STEPS: [f64; MOST_DIMENSIONS] = [
    0.414_213_562,
    0.732_050_808,
    0.236_067_977,
    0.645_751_311,
    0.316_624_790,
    0.605_551_275,
];

/// The point x_a = frac((k + ½) α_a) of a Kronecker sequence, whose first points are spread over [0, 1]^d for every d up to 6.
///
/// ```
/// use fredholm_core::resolvent::kronecker_point;
///
/// assert!((kronecker_point(2)[0] - 0.035_533_905).abs() < 1e-9);
/// ```
#[must_use]
pub fn kronecker_point(number: u32) -> [f64; MOST_DIMENSIONS] {
    STEPS.map(|step| {
        let at = (f64::from(number) + 0.5) * step;
        at - f64::from(at as u32)
    })
}

/// Equation whose cells are cut between edges on every axis: the image of one cube [0, 1]^d, or each of several.
///
/// ```
/// use fredholm_core::galerkin::Cells;
/// use fredholm_core::resolvent::{Grid, Regular, edges};
/// use fredholm_core::{Located, Space};
///
/// /// u(x) = ∫₀² K(x,y) u(y) dy + 1 with K = 1/2, and 3 where both are below 0.3.
/// struct Step;
///
/// impl Space for Step {
///     type Scalar = f64;
///     type Point = f64;
/// }
/// impl Cells for Step {
///     const DIMENSION: usize = 1;
///     fn cells(&self) -> usize { 1 }
///     fn locate(&self, _: &f64) -> usize { 0 }
///     fn measure(&self, _: usize) -> f64 { 2.0 }
///     fn point(&self, _: usize, t: &[f64]) -> f64 { 2.0 * t[0] }
///     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) { t[0] = 0.5 * x.point }
///     fn at(&self, x: &[f64]) -> Option<f64> { x.first().copied() }
/// }
/// impl Regular for Step {
///     fn kernel(&self, x: &f64, y: &f64) -> f64 { if *x < 0.3 && *y < 0.3 { 3.0 } else { 0.5 } }
///     fn source(&self, _: &f64) -> f64 { 1.0 }
/// }
///
/// let base = edges(&Step);
/// assert!((base[0][0] - 0.15).abs() < 1e-12, "the jump's parameter");
/// let cells = Grid::new(Step, &base, 4);
/// assert_eq!(cells.cells(), 4);
/// assert_eq!(cells.locate(&0.31), cells.locate(&0.29) + 1);
/// ```
#[derive(Clone, Debug)]
pub struct Grid<E> {
    equation: E,
    /// The edges of every axis, 0 and 1 among them.
    axes: Vec<Vec<f64>>,
}

impl<E: Regular> Grid<E> {
    /// An equation in so many cells on every axis of each of its own. Inner edges of an axis that are given are edges of cells, if cells are as
    /// many: half of what are more lie as they would without, the others serve all alike.
    #[must_use]
    pub fn new(equation: E, edges: &[Vec<f64>], cells: usize) -> Self {
        let none = Vec::new();
        let axes =
            (0..equation.dimension()).map(|axis| cut(edges.get(axis).unwrap_or(&none), cells));
        Self {
            axes: axes.collect(),
            equation,
        }
    }

    /// The equation.
    pub const fn equation(&self) -> &E {
        &self.equation
    }

    /// The number of cells in each of the equation's own.
    fn each(&self) -> usize {
        self.axes.iter().map(|edges| edges.len() - 1).product()
    }

    /// Fills the parameters of the equation's own cell that belong to those of one within it.
    #[inline]
    fn whole(&self, mut cell: usize, t: &[f64], out: &mut [f64; MOST_DIMENSIONS]) {
        for ((edges, t), out) in self.axes.iter().zip(t).zip(out) {
            let own = cell % (edges.len() - 1);
            cell /= edges.len() - 1;
            if let Some([low, high]) = edges.get(own..own + 2) {
                *out = low + t * (high - low);
            }
        }
    }

    /// The parameters of a point in the equation's own cell of this number.
    fn parameters_of(&self, x: &E::Point, cell: usize) -> [E::Scalar; MOST_DIMENSIONS] {
        let mut t = [E::Scalar::from_f64(0.0); MOST_DIMENSIONS];
        let own = t.get_mut(..self.axes.len()).unwrap_or(&mut []);
        self.equation.parameters(&Located { point: *x, cell }, own);
        t
    }
}

/// The edges of so many cells, those that are given among them.
fn cut(inner: &[f64], cells: usize) -> Vec<f64> {
    let inner = if inner.len() < cells { inner } else { &[] };
    let mut ends = vec![0.0];
    ends.extend_from_slice(inner);
    ends.push(1.0);
    let base = ends.len() - 1;
    let more = (cells.max(1) - base) as f64;
    let (mut edges, mut up_to, mut before) = (vec![0.0], 0.0, 0_usize);
    for own in ends.windows(2) {
        let &[low, high] = own else { continue };
        up_to += 0.5 * (high - low) + 0.5 / base as f64;
        // Rounded sums are those of all: together they are as many as they should be.
        let all = (up_to * more + 0.5) as usize;
        let count = 1 + all - before;
        before = all;
        let part = (1..=count).map(|k| match k == count {
            true => high,
            false => low + (high - low) * k as f64 / count as f64,
        });
        edges.extend(part);
    }
    edges
}

impl<E: Space> Space for Grid<E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: Regular> Cells for Grid<E> {
    const DIMENSION: usize = E::DIMENSION;

    fn cells(&self) -> usize {
        self.each() * self.equation.cells()
    }

    fn locate(&self, x: &E::Point) -> usize {
        let own = self.equation.locate(x);
        let t = self.parameters_of(x, own);
        let (mut cell, mut all) = (own * self.each(), 1);
        for (edges, t) in self.axes.iter().zip(t) {
            let below = edges.partition_point(|&edge| edge <= t.to_f64());
            cell += all * below.clamp(1, edges.len() - 1).saturating_sub(1);
            all *= edges.len() - 1;
        }
        cell
    }

    fn measure(&self, mut cell: usize) -> f64 {
        let (mut share, whole) = (1.0, cell / self.each());
        for edges in &self.axes {
            let own = cell % (edges.len() - 1);
            cell /= edges.len() - 1;
            if let Some([low, high]) = edges.get(own..own + 2) {
                share *= high - low;
            }
        }
        share * self.equation.measure(whole)
    }

    #[inline]
    fn point(&self, cell: usize, t: &[f64]) -> E::Point {
        let mut all = [0.0; MOST_DIMENSIONS];
        self.whole(cell, t, &mut all);
        let own = all.get(..self.axes.len()).unwrap_or(&[]);
        self.equation.point(cell / self.each(), own)
    }

    fn parameters(&self, x: &Located<E::Point>, t: &mut [E::Scalar]) {
        let whole = self.parameters_of(&x.point, x.cell / self.each());
        let mut cell = x.cell;
        for ((edges, t), whole) in self.axes.iter().zip(t).zip(whole) {
            let own = cell % (edges.len() - 1);
            cell /= edges.len() - 1;
            if let Some([low, high]) = edges.get(own..own + 2) {
                let within = (whole.to_f64() - low) / (high - low);
                *t = E::Scalar::from_f64(within.clamp(0.0, 1.0));
            }
        }
    }

    fn at(&self, coordinates: &[f64]) -> Option<E::Point> {
        self.equation.at(coordinates)
    }

    #[inline]
    fn copies(&self) -> usize {
        self.equation.copies()
    }
}

impl<E: Regular> Regular for Grid<E> {
    #[inline]
    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        self.equation.kernel(x, y)
    }

    #[inline]
    fn source(&self, x: &E::Point) -> E::Scalar {
        self.equation.source(x)
    }

    #[inline]
    fn dimension(&self) -> usize {
        self.axes.len()
    }
}

/// Jump of a function on a line.
#[derive(Clone, Copy, Debug)]
struct Jump {
    place: f64,
    height: f64,
    /// The number of the line.
    line: u32,
}

/// What is found on a line along an axis.
#[derive(Default)]
struct Found {
    /// Places of jumps with their heights over the largest value.
    jumps: Vec<Jump>,
    /// Ends of intervals within which the function changes as much as it may.
    ends: Vec<f64>,
}

/// The inner edges that all cells of an equation should have on every axis, as parameters in (0, 1), rising: those of its only cell, or of a few.
///
/// Functions of one parameter are looked at, for each pair of cells: K(x, y) at equal parameters and F along the axis, and K from and to some
/// points. An edge stands where the first or F jumps, and where K jumps from two points at the same place; an interval is halved if more
/// than ⁴√s of the variation of these is in a half, whose share of the axis is s: all there is beside a singularity, and nothing where functions
/// change evenly.
#[must_use]
pub fn edges<E: Regular>(equation: &E) -> Vec<Vec<f64>> {
    (0..equation.dimension())
        .map(|axis| of_axis(equation, axis))
        .collect()
}

/// The edges of one axis.
fn of_axis<E: Regular>(equation: &E, axis: usize) -> Vec<f64> {
    let cells = equation.cells();
    let mut all = Found::default();
    for i in 0..cells {
        for j in 0..cells {
            let own = of_pair(equation, axis, [i, j]);
            all.jumps.extend(own.jumps);
            all.ends.extend(own.ends);
        }
    }
    let most = MOST_CELLS
        .get(equation.dimension() - 1)
        .copied()
        .unwrap_or(1)
        - 1;
    chosen(highest(all.jumps, |_| true), all.ends, most)
}

/// What is found on one axis of K from one cell to another, and of F if they are one.
fn of_pair<E: Regular>(equation: &E, axis: usize, [i, j]: [usize; 2]) -> Found {
    let is_line = equation.dimension() == 1;
    let lines = if is_line { 1 } else { LINES };
    let points = POINTS[usize::from(!is_line)];
    let (mut jumps, mut ends) = (Vec::new(), Vec::new());
    let mut note = |found: Found, line: u32| {
        jumps.extend(found.jumps.into_iter().map(|jump| Jump { line, ..jump }));
        ends.extend(found.ends);
    };
    for line in 0..lines {
        let other = kronecker_point(line + 1);
        let at = |cell: usize, t: f64| place(equation, cell, &other, axis, t);
        let diagonal = |t: f64| equation.kernel(&at(i, t), &at(j, t)).to_f64();
        // Where K(x, x) is infinite all that is known of it is beside.
        let beside = |t: f64| equation.kernel(&at(i, t), &at(j, t + SAME)).to_f64();
        match (0..LINES).all(|k| diagonal(0.1 + 0.3 * f64::from(k)).is_finite()) {
            true => note(along(&diagonal, points), line),
            false => note(along(&beside, points), line),
        }
        if i == j {
            let source = |t: f64| equation.source(&at(i, t)).to_f64();
            note(along(&source, points), line);
        }
    }
    for line in 0..LINES {
        let fixed = kronecker_point(line + 1);
        let fixed = |cell| equation.point(cell, fixed.get(..equation.dimension()).unwrap_or(&[]));
        let [from, to] = [fixed(i), fixed(j)];
        let other = kronecker_point(line + LINES + 1);
        let at = |cell: usize, t: f64| place(equation, cell, &other, axis, t);
        let of_jumps = |found: Found| Found {
            ends: Vec::new(),
            ..found
        };
        let right = |t: f64| equation.kernel(&from, &at(j, t)).to_f64();
        let left = |t: f64| equation.kernel(&at(i, t), &to).to_f64();
        note(of_jumps(along(&right, CROSS_POINTS)), line + LINES);
        note(of_jumps(along(&left, CROSS_POINTS)), line + LINES);
    }
    // Where there is one line only, all that jumps on it does so everywhere.
    let is_everywhere = |same: &[Jump]| {
        let first = same.first().map_or(0, |jump| jump.line);
        is_line && same.iter().any(|jump| jump.line == 0)
            || same.iter().any(|jump| jump.line != first)
    };
    Found {
        jumps: highest(jumps, is_everywhere),
        ends,
    }
}

/// The highest jump of each place, of those places that count.
fn highest(mut jumps: Vec<Jump>, counts: impl Fn(&[Jump]) -> bool) -> Vec<Jump> {
    jumps.sort_unstable_by(|a, b| a.place.total_cmp(&b.place));
    let is_same = |a: &Jump, b: &Jump| b.place - a.place <= SAME;
    let highest = |same: &[Jump]| {
        let by_height = |a: &&Jump, b: &&Jump| a.height.total_cmp(&b.height);
        same.iter().max_by(by_height).copied()
    };
    let places = jumps.chunk_by(is_same).filter(|same| counts(same));
    places.filter_map(highest).collect()
}

/// The point of a cell at the parameter t of an axis, and at others on the others.
fn place<E: Regular>(
    equation: &E,
    cell: usize,
    others: &[f64; MOST_DIMENSIONS],
    axis: usize,
    t: f64,
) -> E::Point {
    let mut all = *others;
    if let Some(own) = all.get_mut(axis) {
        *own = t.clamp(0.0, 1.0);
    }
    equation.point(cell, all.get(..equation.dimension()).unwrap_or(&[]))
}

/// Jumps of a function on [0, 1], and intervals that have their share of its variation.
fn along(function: &dyn Fn(f64) -> f64, points: usize) -> Found {
    let at = |k: usize| (k as f64 + 0.5) / points as f64;
    let values: Vec<f64> = (0..points).map(|k| function(at(k))).collect();
    let mut found = Found::default();
    let largest = values.iter().map(|x| x.abs()).fold(0.0, f64::max);
    // Written so that NaN ends it, too.
    if !(largest > 0.0 && largest.is_finite()) || values.iter().any(|x| x.is_nan()) {
        return found;
    }
    let mut steps: Vec<f64> = values
        .windows(2)
        .map(|pair| match *pair {
            [a, b] => (b - a).abs(),
            _ => 0.0,
        })
        .collect();
    let variation = |steps: &[f64]| steps.iter().sum::<f64>().max(LEAST_VARIATION * largest);
    let least = LEAST_JUMP * variation(&steps);
    for (k, step) in steps.iter_mut().enumerate() {
        if *step >= least
            && let Some(place) = jump(function, [at(k), at(k + 1)])
        {
            found.jumps.push(Jump {
                place,
                height: *step / largest,
                line: 0,
            });
            *step = 0.0;
        }
    }
    let all = variation(&steps);
    // Sums up to every step: those of an interval are differences.
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    sums.extend(steps.iter().map(|step| {
        sum += step;
        sum
    }));
    let has_much = |low: usize, high: usize| {
        let of = |k: usize| sums.get(k.min(points - 1)).copied().unwrap_or(0.0);
        let share = (high - low) as f64 / points as f64;
        of(high) - of(low) > Real::sqrt(Real::sqrt(share)) * all
    };
    halve([0, points], &has_much, &mut |end| {
        found.ends.push(end as f64 / points as f64);
    });
    found
}

/// Notes the middle of every interval of which one half has much, down to halves of two steps.
fn halve(
    [low, high]: [usize; 2],
    has_much: &dyn Fn(usize, usize) -> bool,
    note: &mut dyn FnMut(usize),
) {
    let middle = usize::midpoint(low, high);
    if high - low >= 4 && (has_much(low, middle) || has_much(middle, high)) {
        note(middle);
        halve([low, middle], has_much, note);
        halve([middle, high], has_much, note);
    }
}

/// The place between two at which a function jumps, if most of what it changes between them is changed there.
fn jump(function: &dyn Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> Option<f64> {
    let [mut left, mut right] = [function(low), function(high)];
    let all = (right - left).abs();
    loop {
        let middle = f64::midpoint(low, high);
        if !(low < middle && middle < high) {
            break;
        }
        let value = function(middle);
        if !value.is_finite() {
            return Some(middle);
        }
        match (value - left).abs() >= (right - value).abs() {
            true => (high, right) = (middle, value),
            false => (low, left) = (middle, value),
        }
        if (right - left).abs() < 0.5 * all {
            return None;
        }
    }
    Some(high)
}

/// The edges that are kept: jumps, the highest first, and then halvings, the widest first.
fn chosen(mut jumps: Vec<Jump>, ends: Vec<f64>, most: usize) -> Vec<f64> {
    jumps.sort_unstable_by(|a, b| b.height.total_cmp(&a.height));
    let mut edges: Vec<f64> = jumps.iter().map(|jump| jump.place).take(most).collect();
    // An end k 2^−l is one of intervals of the length 2^−l.
    let length = |end: f64| {
        let mut length = 0.5;
        while ((end / length) as u32).is_multiple_of(2) {
            length *= 0.5;
        }
        length
    };
    let mut ends: Vec<[f64; 2]> = ends.into_iter().map(|end| [end, length(end)]).collect();
    ends.sort_unstable_by(|a, b| b[1].total_cmp(&a[1]).then(a[0].total_cmp(&b[0])));
    ends.dedup();
    for [end, length] in ends {
        // Not where a jump is as near as the next end.
        let is_free = edges
            .iter()
            .all(|&edge: &f64| (edge - end).abs() >= 0.5 * length);
        if is_free && edges.len() < most {
            edges.push(end);
        }
    }
    edges.retain(|edge| (SAME..1.0 - SAME).contains(edge));
    edges.sort_unstable_by(f64::total_cmp);
    edges
}

#[cfg(test)]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;

    use super::{Grid, edges};
    use crate::galerkin::Cells;
    use crate::resolvent::Regular;
    use crate::{Located, Space};

    /// An equation on [0, 1]^2 of one cell, with this kernel and source.
    #[derive(Clone, Copy, Debug)]
    struct Square {
        kernel: fn(&[f64; 2], &[f64; 2]) -> f64,
        source: fn(&[f64; 2]) -> f64,
    }

    impl Space for Square {
        type Scalar = f64;
        type Point = [f64; 2];
    }

    impl Cells for Square {
        const DIMENSION: usize = 2;

        fn cells(&self) -> usize {
            1
        }

        fn locate(&self, _: &[f64; 2]) -> usize {
            0
        }

        fn measure(&self, _: usize) -> f64 {
            1.0
        }

        fn point(&self, _: usize, t: &[f64]) -> [f64; 2] {
            [t[0], t[1]]
        }

        fn parameters(&self, x: &Located<[f64; 2]>, t: &mut [f64]) {
            t.copy_from_slice(&x.point);
        }

        fn at(&self, x: &[f64]) -> Option<[f64; 2]> {
            x.try_into().ok()
        }
    }

    impl Regular for Square {
        fn kernel(&self, x: &[f64; 2], y: &[f64; 2]) -> f64 {
            (self.kernel)(x, y)
        }

        fn source(&self, x: &[f64; 2]) -> f64 {
            (self.source)(x)
        }
    }

    fn near(x: f64, y: f64) -> f64 {
        1.0 / (1.0 + (x - y) * (x - y))
    }

    #[test]
    fn cells_are_a_partition() {
        let equation = Square {
            kernel: |x, y| near(x[0], y[0]),
            source: |_| 1.0,
        };
        let inner = [vec![0.125, 0.7], vec![0.01]];
        for cells in 3..9 {
            let grid = Grid::new(equation, &inner, cells);
            assert_eq!(grid.cells(), cells * cells);
            let mut all = 0.0;
            for cell in 0..grid.cells() {
                all += grid.measure(cell);
                let point = grid.point(cell, &[0.25, 0.5]);
                assert_eq!(grid.locate(&point), cell);
                let mut t = [0.0; 2];
                grid.parameters(&Located { point, cell }, &mut t);
                assert!((t[0] - 0.25).abs() < 1e-12 && (t[1] - 0.5).abs() < 1e-12);
                let ends = [[0.0; 2], [1.0; 2]].map(|t| grid.point(cell, &t));
                let is_cut = |axis: usize, at: f64| ends[0][axis] < at && at < ends[1][axis];
                assert!(!is_cut(0, 0.125) && !is_cut(0, 0.7) && !is_cut(1, 0.01));
            }
            assert!((all - 1.0).abs() < 1e-12, "{all}");
        }
        // An axis with fewer cells than its edges would make is cut as if there were none.
        let two = Grid::new(equation, &inner, 2);
        assert_eq!(two.point(3, &[0.0; 2]), [0.5, 0.01]);
    }

    #[test]
    fn jumps_at_one_place_are_edges_and_others_are_not() {
        let found = edges(&Square {
            kernel: |x, y| near(x[0], y[0]) * if y[1] < 0.3 { 1.0 } else { 2.0 },
            source: |x| if x[0] < 0.6 { 0.0 } else { 1.0 },
        });
        assert_eq!([found[0].len(), found[1].len()], [1; 2], "{found:?}");
        assert!((found[0][0] - 0.6).abs() < 1e-12 && (found[1][0] - 0.3).abs() < 1e-12);
        // A jump along x = y, and one on a circle, are at no place of an axis.
        let none = edges(&Square {
            kernel: |x, y| if x[0] < y[0] { 1.0 } else { 0.5 },
            source: |x| if x[0].hypot(x[1]) < 0.6 { 1.0 } else { 2.0 },
        });
        assert!(none.iter().all(Vec::is_empty), "{none:?}");
        // Nor is there one where nothing changes fast, or nothing at all.
        let smooth = edges(&Square {
            kernel: |x, y| near(x[0], y[0]) * near(x[1], y[1]),
            source: |x| x[0] + x[1] * x[1],
        });
        assert!(smooth.iter().all(Vec::is_empty), "{smooth:?}");
    }

    #[test]
    fn cells_are_dense_beside_a_singularity() {
        let found = edges(&Square {
            kernel: |_, y| 1.0 / f64::sqrt(y[0]),
            source: |_| 1.0,
        });
        assert!(found[1].is_empty(), "{found:?}");
        assert_eq!(
            found[0].first(),
            Some(&f64::powi(0.5, found[0].len() as i32))
        );
        assert!(found[0].len() >= 5, "{found:?}");
    }
}
