//! The pairs of cells of the method of the paper.

use alloc::vec::Vec;
use fredholm_core::array::Each;
use fredholm_core::galerkin::{Cells, PairKind};

use crate::geometry::{Node, Segment, Wall};
use crate::vector::{Vector, cross, sub};
use crate::visible::{Part, twins};
use crate::{Room, RoomError, Scene};

/// The smallest ratio r_ij = inf p_j/p_j in the middle, of a pair in S.
const MIN_MASS_RATIO: f64 = 0.25;

/// The kinds of all pairs of cells for the method of Heinrich 1995: in S those that see each other wholly, with p_j(x) ≥ ¼ of what it is in the
/// middle of the cell of x, and h = 0 on all others. What a `PairTable` of `fredholm-core` borrows, n² bytes.
///
/// "Sees each other wholly" alone would not do: at a corner p_j(x) → 0 and the variance is infinite, logarithmically, so that no
/// short run shows it.
///
/// # Errors
/// [`RoomError::Memory`].
pub fn paper_pairs(scene: &Scene, room: &Room<'_, f64>) -> Result<Vec<u8>, RoomError> {
    let n = room.cells();
    let size = n.checked_mul(n).ok_or(RoomError::Memory { bytes: None })?;
    let mut kinds = fredholm_core::galerkin::buffer(size)?;
    kinds.fill(PairKind::Dropped as u8);
    let cells = room.partition();
    // Within a cell that sees another wholly p_j has one maximum, so its infimum is at an end; at a corner it is a limit.
    let is_even = |i: usize, j: usize| {
        let p = [0.5, 1e-6, 1.0 - 1e-6].map(|t| {
            let x = room.inside(i, t);
            x.map_or(f64::NAN, |x| room.form_factor(&x, j))
        });
        p[0] > 0.0 && p[1].min(p[2]) >= MIN_MASS_RATIO * p[0]
    };
    for i in 0..n {
        for j in 0..i {
            let (Some(own), Some(other)) = (cells.part(i), cells.part(j)) else {
                continue;
            };
            if sees_wholly(scene, [&own, &other]) {
                for [i, j] in [[i, j], [j, i]] {
                    if is_even(i, j) {
                        kinds[i * n + j] = PairKind::Galerkin as u8;
                    }
                }
            }
        }
    }
    Ok(kinds)
}

/// Whether all of one cell sees all of another: each is in front of the other's wall, and no wall is in the convex hull of both.
fn sees_wholly(scene: &Scene, [x, y]: [&Part<f64>; 2]) -> bool {
    let geometry = scene.geometry();
    let (Some(a), Some(b)) = (geometry.wall(x.wall), geometry.wall(y.wall)) else {
        return false;
    };
    let is_before = |wall: &Wall<f64>, ends: [Vector<f64>; 2]| {
        let [low, high] = ends.each(|end| wall.height(end));
        low.min(high) >= -scene.smallest && low.max(high) > scene.smallest
    };
    if twins(a.vertices, b.vertices) || !is_before(a, y.ends) || !is_before(b, x.ends) {
        return false;
    }
    let hull = [x.ends[0], x.ends[1], y.ends[0], y.ends[1]];
    let [low, high] = fredholm_surfaces::hull(&hull);
    let off = |node: &Node<f64>| {
        (0..2).any(|k| {
            node.centre[k] + node.half[k] < low[k] || node.centre[k] - node.half[k] > high[k]
        })
    };
    let mut is_free = true;
    geometry.visit(off, |segment: &Segment<f64>| {
        let is_own = [a, b]
            .iter()
            .any(|wall| twins(segment.vertices, wall.vertices));
        is_free &= is_own || is_outside(&hull, segment.ends);
    });
    is_free
}

/// Whether a segment is outside a convex polygon that goes round to the left, touching it perhaps: convex sets with disjoint interiors
/// are separated by the line of one of their sides.
fn is_outside(hull: &[Vector<f64>; 4], [p, q]: [Vector<f64>; 2]) -> bool {
    let line = sub(q, p);
    let turns = hull.each(|corner| cross(line, sub(corner, p)));
    let is_beyond = |k: usize| {
        let (from, to) = (hull[k], hull[(k + 1) % 4]);
        let side = sub(to, from);
        // A side without length separates nothing.
        side != [0.0; 2] && [p, q].iter().all(|&end| cross(side, sub(end, from)) <= 0.0)
    };
    (0..4).any(is_beyond)
        || turns.iter().all(|&turn| turn >= 0.0)
        || turns.iter().all(|&turn| turn <= 0.0)
}
