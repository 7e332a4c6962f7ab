//! What lines between points of two polygons say of their form factor.
//!
//! Most pairs of a large scene see nothing of each other, or exchange so little that it is below what it may be wrong by. A few lines between
//! random points of both tell: if nothing passes, no more is visible than three of so many lines, in 19 of 20 cases (the rule of three), and
//! that may be below the error. And a form factor that is below the error though nothing were between needs no outline of shadows: the share
//! of the lines that pass says which part of it is left, without bias. There are as many that what they are off by in the sum of a row is
//! below the error, too, as most pairs see all of each other, or nothing, and then all lines say so.

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_scene::Geometry;
use fredholm_surfaces::space::{Vector, along, cross, dot, norm, sub};

use crate::clear::Sheet;

/// The share of the error up to which a form factor is small.
const SMALL: f64 = 0.25;

/// The least and the greatest number of lines.
const FEW: f64 = 4.0;
const MANY: f64 = 16.0;

/// Lines of a pair are this many times its form factor in the square of the error: of a row's sum a fifth is of pairs that see each other in
/// part, and the variance of a line is ¼ at most.
const LINES: f64 = 0.05;

/// Powers of a number that spread points over a cube of four dimensions evenly: x⁵ = x + 1 (Roberts 2018).
const STEPS: [f64; 4] = [
    0.856_674_883_854_502_9,
    0.733_891_856_627_125_9,
    0.628_706_721_165_635_4,
    0.538_597_257_223_612_6,
];

/// If no line of so many passes, at most this number of as many others would: in 19 of 20 cases.
const NONE: f64 = 3.0;

/// The most lines that are to show that nothing passes, and the share of the error that what passes may be: many pairs make a row.
const MOST: f64 = 48.0;
const PART: f64 = 0.5;

/// The largest form factor of which lines may tell, without anything between, if this is the error.
pub(crate) fn largest(error: f64) -> f64 {
    PART * MOST / NONE * error
}

/// What is left of a form factor that is `factor` without anything between, for two faces, by their numbers and their parts in front of each other:
/// as a share, and the share that it may be wrong by. None if lines do not tell.
pub(crate) fn left(
    geometry: &Geometry<'_, f64>,
    numbers: [usize; 2],
    sheets: [Sheet<'_>; 2],
    factor: f64,
    error: f64,
) -> Option<[f64; 2]> {
    let is_small = factor <= (SMALL * error).min(MANY / LINES * error * error);
    let count = if is_small {
        (LINES * factor / (error * error)).clamp(FEW, MANY)
    } else {
        // A little more, as their number is a whole one.
        (NONE * factor / (PART * error) + 1.0).clamp(FEW, MOST)
    } as u32;
    let mut shift = shifts(numbers);
    let mut seen = 0;
    for _ in 0..count {
        for (x, step) in shift.iter_mut().zip(STEPS) {
            *x += step;
            if *x >= 1.0 {
                *x -= 1.0;
            }
        }
        let [s, t, u, v] = shift;
        let from = point(sheets[0].points, s, t);
        let aim = sub(point(sheets[1].points, u, v), from);
        let direction = aim.map(|x| x / norm(aim));
        let hit = geometry.meet(numbers[0] as u32, from, direction);
        if hit.is_some_and(|hit| hit.face as usize == numbers[1] && !hit.back) {
            seen += 1;
            if !is_small {
                return None;
            }
        }
    }
    let count = f64::from(count);
    Some(if is_small {
        [f64::from(seen) / count, 1.0]
    } else {
        [0.0, NONE / count]
    })
}

/// Four numbers in [0, 1) of a pair, by a mixing function (Steele, Lea and Flood 2014).
fn shifts(numbers: [usize; 2]) -> [f64; 4] {
    let mut state = ((numbers[0] as u64) << 32) ^ numbers[1] as u64;
    from_fn(|_| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    })
}

/// A point of a convex polygon, evenly for even s and t in [0, 1).
fn point(polygon: &[Vector<f64>], s: f64, t: f64) -> Vector<f64> {
    let [a, rest @ ..] = polygon else {
        return [f64::NAN; 3];
    };
    let spans = |pair: &[Vector<f64>]| [sub(pair[0], *a), sub(pair[1], *a)];
    let double = |[u, v]: [Vector<f64>; 2]| {
        let turn = cross(u, v);
        Real::sqrt(dot(turn, turn))
    };
    let all: f64 = rest.windows(2).map(|pair| double(spans(pair))).sum();
    let (mut rest_of, mut last) = (s * all, *a);
    for pair in rest.windows(2) {
        let [u, v] = spans(pair);
        let own = double([u, v]);
        if rest_of < own {
            let root = Real::sqrt(rest_of / own);
            return along(along(*a, root * (1.0 - t), u), root * t, v);
        }
        rest_of -= own;
        last = pair[1];
    }
    last
}
