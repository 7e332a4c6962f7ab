//! Tensor Gauss–Legendre rules.

use crate::CubeError;
use fredholm_core::array::Each;

/// The Gauss–Legendre rule of 1 to 5 points per axis, exact for polynomials of degree 2g − 1 in each
/// variable.
///
/// K' and F' by quadrature are approximations, which cost variance and no correctness. With functions of
/// degree p the variance is that of a main part of order p + 1: for smooth kernels p + 1 points give away
/// little; for piecewise constants that is one point, the middle of a cell. With fewer than p + 1 points
/// some function vanishes at all of them and does nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Nodes in [−1, 1] and weights that sum to 2.
    nodes: &'static [(f64, f64)],
}

impl Rule {
    /// The rule of g = `points` points per axis.
    ///
    /// # Errors
    /// [`CubeError::Points`] unless it has 1 to 5.
    pub const fn new(points: usize) -> Result<Self, CubeError> {
        let nodes: &'static [(f64, f64)] = match points {
            1 => &ONE,
            2 => &TWO,
            3 => &THREE,
            4 => &FOUR,
            5 => &FIVE,
            _ => return Err(CubeError::Points),
        };
        Ok(Self { nodes })
    }

    /// The number g of points per axis.
    #[must_use]
    pub const fn points(&self) -> usize {
        self.nodes.len()
    }

    /// Points in the cell at `places` of m = `per_axis` cells an axis, and weights that sum to 1.
    pub(crate) fn in_cell<const D: usize>(&self, places: [u32; D], per_axis: u32) -> Points<D> {
        Points {
            nodes: self.nodes,
            // (i + (1 + t)/2)/m
            scale: 0.5 / f64::from(per_axis),
            middle: places.each(|i| (f64::from(i) + 0.5) / f64::from(per_axis)),
            next: Some([0; D]),
        }
    }
}

/// A point of a tensor rule in a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node<const D: usize> {
    /// Where it lies in [0, 1]^D.
    pub(crate) point: [f64; D],
    /// Where it lies in the cell, in [−1, 1]^D.
    pub(crate) local: [f64; D],
    /// Weights sum to 1.
    pub(crate) weight: f64,
}

/// The points of a tensor rule in one cell, the last axis running fastest.
#[derive(Clone, Debug)]
pub(crate) struct Points<const D: usize> {
    nodes: &'static [(f64, f64)],
    scale: f64,
    middle: [f64; D],
    next: Option<[usize; D]>,
}

impl<const D: usize> Iterator for Points<D> {
    type Item = Node<D>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let mut at = self.next?;
        let mut point = self.middle;
        let mut local = [0.0; D];
        let mut weight = 1.0;
        for ((x, t), &i) in point.iter_mut().zip(&mut local).zip(&at) {
            let &(node, w) = self.nodes.get(i)?;
            *x += self.scale * node;
            *t = node;
            weight *= 0.5 * w;
        }
        self.next = None;
        for i in at.iter_mut().rev() {
            *i += 1;
            if *i < self.nodes.len() {
                self.next = Some(at);
                break;
            }
            *i = 0;
        }
        Some(Node {
            point,
            local,
            weight,
        })
    }
}

// Abramowitz and Stegun 1964, table 25.4, to the digits of f64.
const ONE: [(f64, f64); 1] = [(0.0, 2.0)];
const TWO: [(f64, f64); 2] = [
    (-0.577_350_269_189_625_8, 1.0),
    (0.577_350_269_189_625_8, 1.0),
];
const THREE: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
    (0.0, 0.888_888_888_888_889),
    (0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
];
const FOUR: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_86),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_86),
];
const FIVE: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];
