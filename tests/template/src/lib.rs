//! My equation: u(x) = ∫₀¹ ½ x y u(y) dy + x on [0, 1], whose solution is u(x) = 6x/5.
//!
//! A crate to copy and fill in. What to replace is marked with *yours*; the guide is the README of
//! `fredholm-conformance`.

#![no_std]
#![warn(missing_docs)]

use fredholm_core::galerkin::{Basis, Cells, PairIntegral, TransitionMoments};
use fredholm_core::global::Stationary;
use fredholm_core::resolvent::Regular;
use fredholm_core::{Chain, Density, Equation, Located, Real, Space, Uniforms};

/// The equation, and n equal cells of [0, 1].
///
/// Yours: what the equation depends on. Whatever does not change from step to step is computed in
/// `new`.
#[derive(Clone, Copy, Debug)]
pub struct MyEquation<F> {
    cells: u32,
    /// n.
    per_cell: F,
}

/// Why there is no such equation. Yours: one variant for every condition that an input can violate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MyError {
    /// There must be a cell, and 2²⁴ at most.
    Cells,
}

impl core::fmt::Display for MyError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Cells => f.write_str("the number of cells must be from 1 to 2^24"),
        }
    }
}

impl core::error::Error for MyError {}

impl<F: Real> MyEquation<F> {
    /// With n = `cells` cells.
    ///
    /// # Errors
    /// [`MyError`].
    pub fn new(cells: u32) -> Result<Self, MyError> {
        if cells == 0 || cells > 1 << 24 {
            return Err(MyError::Cells);
        }
        let per_cell = F::from_u32(cells);
        Ok(Self { cells, per_cell })
    }

    /// The middle of cell `j`.
    fn middle(&self, j: usize) -> F {
        (F::from_u32(j as u32) + F::from_f64(0.5)) / self.per_cell
    }
}

// ---- The space, K and F: enough for resolvent walks, whatever the norm of K.

/// Yours: the points. A `Copy` type of your own may carry what a step knew of the point.
impl<F: Real> Space for MyEquation<F> {
    type Scalar = F;
    type Point = F;
}

/// Yours: the cells, as images of [0, 1]^d.
impl<F: Real> Cells for MyEquation<F> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.cells as usize
    }

    fn locate(&self, x: &F) -> usize {
        // A coordinate of 1, or one that rounding made 1, belongs to the last cell.
        (*x * self.per_cell).to_u32().min(self.cells - 1) as usize
    }

    fn measure(&self, _: usize) -> f64 {
        1.0 / f64::from(self.cells)
    }

    fn point(&self, cell: usize, t: &[f64]) -> F {
        F::from_f64((cell as f64 + t[0]) / f64::from(self.cells))
    }

    fn parameters(&self, x: &Located<F>, t: &mut [F]) {
        t.fill(x.point * self.per_cell - F::from_u32(x.cell as u32));
    }

    fn at(&self, coordinates: &[f64]) -> Option<F> {
        match *coordinates {
            [x] if (0.0..=1.0).contains(&x) => Some(F::from_f64(x)),
            _ => None,
        }
    }
}

/// Yours: K and F.
impl<F: Real> Regular for MyEquation<F> {
    fn kernel(&self, x: &F, y: &F) -> F {
        F::from_f64(0.5) * *x * *y
    }

    fn source(&self, x: &F) -> F {
        *x
    }
}

// ---- Delete the rest, unless you have a chain of your own: walks of a chain ask for no kernel, go on in any dimension, and run on devices.

// ---- The equation and its chain: enough for plain Monte Carlo.

/// Yours: a density p from which you can draw, as like |K| as possible.
impl<F: Real> Chain for MyEquation<F> {
    fn step<U: Uniforms<F>>(&self, _: &F, uniforms: &mut U) -> Option<F> {
        Some(uniforms.uniform())
    }
}

/// Yours: p(x, y), with ∫ p(x, y) dμ(y) = 1. Walks do not need it, the checks do.
impl<F: Real> Density for MyEquation<F> {
    fn density(&self, _: &F, _: &F) -> F {
        F::one()
    }
}

/// Yours: k = K/p, and F. Several channels that share the chain are `Channels`.
impl<F: Real> Equation for MyEquation<F> {
    type Value = F;

    fn kernel(&self, x: &F, y: &F) -> F {
        F::from_f64(0.5) * *x * *y
    }

    fn source<U: Uniforms<F>>(&self, x: &F, _: &mut U) -> F {
        *x
    }
}

// ---- The neighbour equation: cells, and exact integrals of p over them.

/// As it is: polynomials in the parameters. `Basis<2>` adds those of degree 1.
impl<F: Real> Basis for MyEquation<F> {}

/// Yours, or delete it: starts whose density the chain preserves, so that a global estimate scores in every state.
impl<F: Real> Stationary for MyEquation<F> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> F {
        uniforms.uniform()
    }

    fn start_density(&self, _: &F) -> f64 {
        1.0
    }

    fn is_preserved(&self) -> bool {
        true
    }
}

/// Yours: p_j(x) = ∫_Xj p(x, y) dμ(y), exact, and accurate relative to its own size.
impl<F: Real> TransitionMoments for MyEquation<F> {
    fn moments(&self, _: &Located<F>, _: usize) -> [[F; 1]; 1] {
        [[F::one() / self.per_cell]]
    }
}

/// Yours, or delete it: ∫_Xj K(x, y) dμ(y), exact, for pairs on which h = k.
impl<F: Real> PairIntegral for MyEquation<F> {
    fn pair_integral(&self, x: &Located<F>, j: usize) -> [F; 1] {
        [F::from_f64(0.5) * x.point * self.middle(j) / self.per_cell]
    }
}
