//! Piecewise polynomials of any degree on the walls.

use fredholm_core::array::Each;
use fredholm_core::galerkin::{
    Basis, CellMap, PairIntegral, Partition, TransitionMoments, legendre,
};
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};
use num_traits::{one, zero};

use crate::moments::Rules;
use crate::{Point, Room};

/// A room with B = degree + 1 Legendre polynomials on every cell, at most 5, normalised: in the
/// coordinate t ∈ [−1, 1] of a cell, ψ_b = √(2b + 1) P_b(t).
///
/// It is the same equation and chain as its [`Room`], and gives a neighbour equation of the degree
/// through [`Piecewise`](fredholm_core::galerkin::Piecewise) and a [`Matrix`](crate::Matrix) with
/// as many functions. For B = 1 it has the room's bits.
///
/// **Moments.** With d the length of the perpendicular from x to the line of cell j and s the place
/// along it, counted from the foot,
///
/// ```text
/// M_j(x)_bc = (1 − q0) ½ ∫ ψ_b ψ_c h(s) d (s² + d²)^(−3/2) ds
/// ```
///
/// over what x sees of the cell, its visible intervals, exactly; h(s) is the height of y above the
/// wall of x. The density has one sign, so that nothing cancels, as it would in the closed form
/// with its powers of tan for small, distant or near cells. It is integrated by Gauss points whose
/// number follows from the ellipse (Bernstein 1912) around the cell in which it is analytic, up to
/// s = ±id: 4 to 16 leave an error below rounding. A cell that is too near, by about 1.2 of its
/// lengths, is cut at ±d, and what is farther from the foot in halves of halves, first. Of 80,000
/// random cells of all sizes, near, far and in corners, the largest error is 9 ε of the mass (times
/// ψ_b(1) ψ_c(1)) up to degree 3 and 16 ε at degree 4 in f64, 6 ε in f32. Where x is a corner
/// itself, all of the mass is at the cell's end there.
///
/// A room with a neighbour equation of degree 3 is in the crate's README.
#[derive(Clone, Copy, Debug)]
pub struct PolynomialRoom<'r, 'a, F, const B: usize> {
    room: &'r Room<'a, F>,
    rules: Rules<F, B>,
}

impl<'a, F: Real> Room<'a, F> {
    /// This room with B functions on every cell, the polynomials of degree B − 1.
    #[must_use]
    pub fn with_functions<const B: usize>(&self) -> PolynomialRoom<'_, 'a, F, B> {
        PolynomialRoom::new(self)
    }
}

impl<'r, 'a, F: Real, const B: usize> PolynomialRoom<'r, 'a, F, B> {
    fn new(room: &'r Room<'a, F>) -> Self {
        Self {
            room,
            rules: Rules::new(),
        }
    }

    /// The room.
    #[must_use]
    pub const fn room(&self) -> &'r Room<'a, F> {
        self.room
    }

    /// ∫ ψ_b cos θ_x cos θ_y/(2r) dy over what `x` sees of cell `j`, for all b; the first is the
    /// [form factor](Room::form_factor).
    #[inline]
    #[must_use]
    pub fn form_factors(&self, x: &Point<F>, j: usize) -> [F; B] {
        let mut sums = [zero(); B];
        self.room.measure(&self.rules, x, j, |share, psi| {
            for (sum, &psi) in sums.iter_mut().zip(psi) {
                *sum += share * psi;
            }
        });
        sums
    }

    /// (v, Φ) of the irradiance at a point: v times form factors, over all cells.
    #[must_use]
    pub fn irradiance_of(&self, x: &Point<F>, v: &[F]) -> f64 {
        let cells = v.chunks_exact(B).enumerate();
        let terms = cells.map(|(j, v)| {
            let factors = self.form_factors(x, j);
            let products = v.iter().zip(factors);
            products.map(|(v, f)| v.to_f64() * f.to_f64()).sum::<f64>()
        });
        terms.sum()
    }
}

impl<F: Real, const B: usize> StateSpace for PolynomialRoom<'_, '_, F, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, const B: usize> Sampler for PolynomialRoom<'_, '_, F, B> {
    #[inline]
    fn absorption(&self, x: &Point<F>) -> F {
        self.room.absorption(x)
    }

    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.room.step(x, uniforms)
    }
}

impl<F: Real, const B: usize> TransitionDensity for PolynomialRoom<'_, '_, F, B> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.room.density(x, y)
    }
}

impl<F: Real, const B: usize> Kernel for PolynomialRoom<'_, '_, F, B> {
    #[inline]
    fn kernel(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.room.kernel(x, y)
    }
}

impl<F: Real, const B: usize> Source for PolynomialRoom<'_, '_, F, B> {
    #[inline]
    fn source(&self, x: &Point<F>) -> F {
        self.room.source(x)
    }
}

impl<F: Real, const B: usize> Partition for PolynomialRoom<'_, '_, F, B> {
    fn cells(&self) -> usize {
        self.room.cells()
    }

    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        self.room.locate(x)
    }
}

impl<F: Real, const B: usize> Basis<B> for PolynomialRoom<'_, '_, F, B> {
    #[inline]
    fn basis(&self, x: &Located<Point<F>>) -> [F; B] {
        if B == 1 {
            return [one(); B];
        }
        legendre(self.room.coordinate(&x.point, x.cell))
    }
}

impl<F: Real, const B: usize> TransitionMoments<B> for PolynomialRoom<'_, '_, F, B> {
    #[inline]
    fn moments(&self, x: &Located<Point<F>>, j: usize) -> [[F; B]; B] {
        let mut sums = [[zero(); B]; B];
        self.room.measure(&self.rules, &x.point, j, |share, psi| {
            add(&mut sums, share, psi);
        });
        let survival = self.room.survival();
        sums.each(|row| row.each(|sum| survival * sum))
    }
}

/// Adds `share` ψ_b ψ_c.
#[inline]
pub(crate) fn add<F: Real, const B: usize>(sums: &mut [[F; B]; B], share: F, psi: &[F; B]) {
    for (row, &left) in sums.iter_mut().zip(psi) {
        let left = share * left;
        for (sum, &right) in row.iter_mut().zip(psi) {
            *sum += left * right;
        }
    }
}

impl<F: Real, const B: usize> PairIntegral<B> for PolynomialRoom<'_, '_, F, B> {
    #[inline]
    fn pair_integral(&self, x: &Located<Point<F>>, j: usize) -> [F; B] {
        let reflectance = self.room.reflectance(&x.point);
        self.form_factors(&x.point, j).each(|f| reflectance * f)
    }
}

impl<F: Real, const B: usize> CellMap for PolynomialRoom<'_, '_, F, B> {
    const DIMENSION: usize = 1;

    fn measure(&self, cell: usize) -> f64 {
        self.room.table().length(cell).to_f64()
    }

    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        let t = t.first().copied().unwrap_or(f64::NAN);
        let point = self.room.inside(cell, F::from_f64(t));
        point.unwrap_or_else(|| self.room.point_at(usize::MAX, zero()))
    }

    /// The point of a wall at a fraction of it: the coordinates are the wall's number and the fraction.
    fn at(&self, coordinates: &[f64]) -> Option<Point<F>> {
        match *coordinates {
            [wall, fraction] if wall >= 0.0 && wall as usize as f64 == wall => {
                self.room.point(wall as usize, fraction).ok()
            }
            _ => None,
        }
    }
}
