//! My equation: u(x) = ∫₀¹ ½ x y u(y) dy + x on [0, 1], whose solution is u(x) = 6x/5.
//!
//! A crate to copy and fill in. What to replace is marked with *yours*; the guide is the README of
//! `fredholm-conformance`.

#![no_std]
#![warn(missing_docs)]

use fredholm_core::galerkin::{Basis, CellMap, PairIntegral, Partition, TransitionMoments};
use fredholm_core::whole::Starts;
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

/// The equation, its chain and n equal cells of [0, 1].
///
/// Yours: what the equation depends on. Whatever does not change from step to step is computed in
/// `new`.
#[derive(Clone, Copy, Debug)]
pub struct MyEquation<F> {
    cells: u32,
    /// n.
    per_cell: F,
    /// q.
    absorption: F,
}

/// Why there is no such equation. Yours: one variant for every condition that an input can violate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MyError {
    /// There must be a cell, and 2²⁴ at most.
    Cells,
    /// q must lie in (0, 1).
    Absorption,
}

impl core::fmt::Display for MyError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Cells => "the number of cells must be from 1 to 2^24",
            Self::Absorption => "the absorption probability must lie between 0 and 1",
        })
    }
}

impl core::error::Error for MyError {}

impl<F: Real> MyEquation<F> {
    /// With n = `cells` cells and absorption probability q = `absorption`.
    ///
    /// # Errors
    /// [`MyError`].
    pub fn new(cells: u32, absorption: f64) -> Result<Self, MyError> {
        if cells == 0 || cells > 1 << 24 {
            return Err(MyError::Cells);
        }
        // Written so that NaN fails, and in the scalar of the walk: 1 − 10⁻¹² is 1 in f32.
        let q = F::from_f64(absorption);
        if !(q > F::zero() && q < F::one()) {
            return Err(MyError::Absorption);
        }
        Ok(Self {
            cells,
            per_cell: F::from_u32(cells),
            absorption: q,
        })
    }

    /// 1 − q, the density p of every step.
    fn lives(&self) -> F {
        F::one() - self.absorption
    }

    /// The middle of cell `j`.
    fn middle(&self, j: usize) -> F {
        (F::from_u32(j as u32) + F::from_f64(0.5)) / self.per_cell
    }
}

// ---- The equation and its chain: enough for plain Monte Carlo.

/// Yours: the points. A `Copy` type of your own may carry what a step knew of the point.
impl<F: Real> StateSpace for MyEquation<F> {
    type Scalar = F;
    type Point = F;
}

/// Yours: a density p from which you can draw, as like |K| as possible.
impl<F: Real> Sampler for MyEquation<F> {
    fn absorption(&self, _: &F) -> F {
        self.absorption
    }

    fn step<U: Uniforms<F>>(&self, _: &F, uniforms: &mut U) -> Option<F> {
        Some(uniforms.uniform())
    }
}

/// Yours: p(x, y), with ∫ p(x, y) dμ(y) = 1 − q(x). Walks do not need it, the checks do.
impl<F: Real> TransitionDensity for MyEquation<F> {
    fn density(&self, _: &F, _: &F) -> F {
        self.lives()
    }
}

/// Yours: k = K/p.
impl<F: Real> Kernel for MyEquation<F> {
    fn kernel(&self, x: &F, y: &F) -> F {
        F::from_f64(0.5) * *x * *y / self.lives()
    }
}

/// Yours: F.
impl<F: Real> Source for MyEquation<F> {
    fn source(&self, x: &F) -> F {
        *x
    }
}

// ---- The neighbour equation: cells, and exact integrals of p over them.

/// Yours: the cells.
impl<F: Real> Partition for MyEquation<F> {
    fn cells(&self) -> usize {
        self.cells as usize
    }

    fn locate(&self, x: &F) -> usize {
        // A coordinate of 1, or one that rounding made 1, belongs to the last cell.
        (*x * self.per_cell).to_u32().min(self.cells - 1) as usize
    }
}

/// Yours: where the cells are.
impl<F: Real> CellMap for MyEquation<F> {
    const DIMENSION: usize = 1;

    fn measure(&self, _: usize) -> f64 {
        1.0 / f64::from(self.cells)
    }

    fn point(&self, cell: usize, t: &[f64]) -> F {
        F::from_f64((cell as f64 + t[0]) / f64::from(self.cells))
    }

    fn at(&self, coordinates: &[f64]) -> Option<F> {
        match *coordinates {
            [x] if (0.0..=1.0).contains(&x) => Some(F::from_f64(x)),
            _ => None,
        }
    }

    /// Yours, or delete it: the inverse of `point`, with which there is a whole function.
    fn parameters(&self, x: &Located<F>, t: &mut [f64]) -> bool {
        t.fill(x.point.to_f64() * f64::from(self.cells) - x.cell as f64);
        true
    }
}

/// Yours, or delete it: starts whose density the chain preserves, so that a whole function scores in every state.
impl<F: Real> Starts for MyEquation<F> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> F {
        uniforms.uniform()
    }

    fn start_density(&self, _: &F) -> f64 {
        1.0
    }

    fn survival(&self) -> Option<f64> {
        Some(self.lives().to_f64())
    }
}

/// As it is for piecewise constants.
impl<F: Real> Basis for MyEquation<F> {
    fn basis(&self, _: &Located<F>) -> [F; 1] {
        [F::one()]
    }
}

/// Yours: p_j(x) = ∫_Xj p(x, y) dμ(y), exact, and accurate relative to its own size.
impl<F: Real> TransitionMoments for MyEquation<F> {
    fn moments(&self, _: &Located<F>, _: usize) -> [[F; 1]; 1] {
        [[self.lives() / self.per_cell]]
    }
}

/// Yours, or delete it: ∫_Xj K(x, y) dμ(y), exact, for pairs on which h = k.
impl<F: Real> PairIntegral for MyEquation<F> {
    fn pair_integral(&self, x: &Located<F>, j: usize) -> [F; 1] {
        [F::from_f64(0.5) * x.point * self.middle(j) / self.per_cell]
    }
}
