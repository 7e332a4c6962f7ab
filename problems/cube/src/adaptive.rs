//! Adaptive quadrature: intervals are cut in two until rules know what they integrate, for jumps and kinks that nobody has named.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::legendre;

use crate::functions::{Axis, PER_AXIS};

/// The part of a cell's integral of |f| up to which the rule of an interval and those of its two parts agree: sums are rounded to a
/// thousandth of it, and values of a kernel to less.
const AGREE: f64 = 1e-12;
/// Where an interval is cut, as a share of its length. In the middle rules of an even number of points would agree by chance: half of the
/// weights lie on either side of a jump there, and so does one of both parts. Of rules of 2 to 20 points a jump leaves at least 4·10⁻⁴ of
/// itself between the whole and its parts, wherever it is between their first and last points.
const CUT: f64 = 0.44;
/// Cuts of a cell, at most: what is left, 0.56⁴⁸ of it, holds a jump of the size of f to [`AGREE`].
const MOST: u32 = 48;
/// The cuts from which on a cell has a jump or a kink: smooth functions are resolved before.
const ROUGH: u32 = 12;
/// Intervals of a cell, at most: eight jumps have as many. What is as rough everywhere has no end.
const INTERVALS: usize = 16 * MOST as usize;
/// The part of their range by which f at the end of an interval may be off the last point within. It is 0.05 of a line and five points, and
/// 0.37 of two.
const OFF: f64 = 0.5;
/// How far beyond the last point the end is, in intervals, about: a jump there is seen by no point.
const BEYOND: f64 = 0.05;

/// An interval in the coordinate t of its cell, and what its rule says.
#[derive(Clone, Copy)]
struct Part {
    ends: [f64; 2],
    /// How many cuts made it.
    cuts: u32,
    /// The means over the cell of f times the polynomials where t is in the interval.
    sums: Axis,
    /// The integral of |f| over it.
    size: f64,
    /// What a jump beyond the last points may be worth.
    off: f64,
}

/// The integrals over parts of a cell, with t from −1 to 1, of f times each of so many polynomials of t, with respect to dt/2, and whether
/// f has a jump or a kink there. The rule's points are in [−1, 1], and its weights sum to 2.
pub(crate) fn integrals(
    f: &dyn Fn(f64) -> f64,
    parts: &[[f64; 2]],
    functions: usize,
    rule: &[(f64, f64)],
) -> (Axis, bool) {
    let part = |&ends: &[f64; 2], cuts| Part::new(f, ends, cuts, functions, rule);
    let mut open: Vec<Part> = parts.iter().map(|ends| part(ends, 0)).collect();
    let size: f64 = open.iter().map(|part| part.size).sum();
    let (mut all, mut is_rough, mut count) = ([0.0; PER_AXIS], false, open.len());
    while let Some(whole) = open.pop() {
        let [from, to] = whole.ends;
        let (cut, cuts) = (from + CUT * (to - from), whole.cuts + 1);
        let [left, right] = [[from, cut], [cut, to]].map(|ends| part(&ends, cuts));
        let sums = left.sums.iter().zip(&right.sums);
        let off = whole.sums.iter().zip(sums);
        let off = off.map(|(whole, (left, right))| Real::abs(whole - (left + right)));
        let off = off.fold(whole.off, f64::max);
        // f may be 0 at all points but for the last ones.
        let size = size.max(left.size + right.size);
        if off <= AGREE * size || cuts > MOST || count > INTERVALS {
            for part in [left, right] {
                let sums = all.iter_mut().zip(part.sums);
                sums.for_each(|(all, sum)| *all += sum);
            }
        } else {
            is_rough |= cuts > ROUGH;
            count += 2;
            open.extend([left, right]);
        }
    }
    (all, is_rough)
}

impl Part {
    fn new(
        f: &dyn Fn(f64) -> f64,
        ends: [f64; 2],
        cuts: u32,
        functions: usize,
        rule: &[(f64, f64)],
    ) -> Self {
        let [from, to] = ends;
        let half = 0.5 * (to - from);
        let (mut sums, mut size): (Axis, _) = ([0.0; PER_AXIS], 0.0);
        let mut last: Option<[f64; 2]> = None;
        let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
        for (node, weight) in rule {
            let t = from + half * (1.0 + node);
            let value = f(t);
            let share = 0.5 * half * weight * value;
            let psi: Axis = legendre(t);
            let own = sums.iter_mut().zip(psi).take(functions);
            own.for_each(|(sum, psi)| *sum += share * psi);
            size += Real::abs(share);
            (least, most) = (least.min(value), most.max(value));
            last = Some(last.map_or([value; 2], |[first, _]| [first, value]));
        }
        // f at an end itself may be that of either side.
        let at_ends = [from, to].map(|end| f(end + AGREE * (0.5 * (from + to) - end)));
        let off = at_ends.iter().zip(last.unwrap_or(at_ends));
        let off = off.map(|(end, point)| Real::abs(end - point) - OFF * (most - least));
        Self {
            ends,
            cuts,
            sums,
            size,
            off: BEYOND * half * off.fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Real, integrals};
    use fredholm_variance::gauss;

    /// A window whose rules of four points agree by chance where intervals are cut in their middles.
    #[test]
    fn rules_of_any_number_of_points_find_jumps() {
        for points in 4..=12 {
            let rule = gauss(points).unwrap();
            for k in 0..200 {
                let from = -0.98 + 0.009 * f64::from(k);
                let window = |t: f64| f64::from(u8::from(t > from && t < from + 0.137));
                let ([mean, ..], is_rough) = integrals(&window, &[[-1.0, 1.0]], 1, &rule);
                // What is narrower than the distance of points may be seen by none.
                if is_rough {
                    assert!(
                        (mean - 0.5 * 0.137).abs() < 1e-11,
                        "{points} {from}: {mean}"
                    );
                } else {
                    assert_eq!(mean, 0.0, "{points} {from}");
                }
            }
        }
    }

    #[test]
    fn jumps_and_kinks_are_found_and_smooth_functions_are_not_rough() {
        let rule = gauss(5).unwrap();
        let of = |f: &dyn Fn(f64) -> f64| integrals(f, &[[-1.0, 1.0]], 5, &rule);
        // 2 up to a jump, which no point may be beyond, and 0 from there on.
        for jump in [-1.0, -0.3, 0.0, 0.123_456, 0.999_9, 1.0] {
            let ([mean, ..], is_rough) = of(&|t| if t < jump { 2.0 } else { 0.0 });
            assert!((mean - (jump + 1.0)).abs() < 1e-11, "{jump}: {mean}");
            assert_eq!(is_rough, jump.abs() < 1.0, "{jump}");
        }
        let ([mean, first, ..], is_rough) = of(&|t| (t - 0.3).abs());
        // (1.3² + 0.7²)/4 and √3 ∫ t |t − 0.3| dt/2.
        assert!((mean - 0.545).abs() < 1e-11 && is_rough, "{mean}");
        let moment = (0.3_f64.powi(3) / 3.0 - 0.3) * 0.5 * 3.0_f64.sqrt();
        assert!((first - moment).abs() < 1e-11, "{first} {moment}");
        for width in [0.1, 1.0] {
            let (_, is_rough) = of(&|t| Real::exp(-(t / width) * (t / width)));
            assert!(!is_rough, "{width}");
        }
    }
}
