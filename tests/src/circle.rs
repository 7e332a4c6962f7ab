//! What the checks need to know of the circle.

use core::f64::consts::TAU;

use fredholm_circle::{Circle, Emission, Harmonic, Point, Residual, Solution, Tables};
use fredholm_core::Real;
use fredholm_core::galerkin::{
    OffDiagonal, PairKind, Pairs, Partition, Piecewise, PointwiseSource,
};

use crate::quadrature::{Quadrature, gauss_legendre};

/// Reflectances of five arcs, one of them black.
pub const RHO: [f64; 5] = [0.3, 0.7, 0.0, 0.55, 0.74];
/// The paper's light.
pub const LIGHT: Harmonic = Harmonic {
    constant: 5.0,
    amplitude: 1.0,
    frequency: 5,
};
/// The paper's pairs: the diagonal left out.
pub const PAPER: OffDiagonal = OffDiagonal {
    diagonal: PairKind::None,
};
/// The program's default: the diagonal pointwise.
pub const DEFAULT: OffDiagonal = OffDiagonal {
    diagonal: PairKind::Pointwise,
};
/// All pairs in S.
pub const IN_S: OffDiagonal = OffDiagonal {
    diagonal: PairKind::Galerkin,
};

/// The generic neighbour equation on a circle.
pub type OnCircle<'a, F, E, S> = Piecewise<
    'a,
    F,
    Circle<'a, F, E>,
    Circle<'a, F, E>,
    S,
    PointwiseSource<'a, F, Circle<'a, F, E>, S>,
>;

/// Makes the generic neighbour equation with these pairs, q0 = 0.2, as a user makes it: everything in
/// f64 first.
///
/// # Panics
/// If there is no such circle.
pub fn with_piecewise<F: Real, E: Emission<F> + Emission<f64> + Copy, S: Pairs + Copy, R>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    pairs: S,
    then: impl FnOnce(&Circle<'_, F, E>, &OnCircle<'_, F, E, S>, &[F]) -> R,
) -> R {
    let wide_tables = Tables::<f64>::new(reflectance, cells).unwrap();
    let wide = Circle::new(wide_tables.cells(), emission, 0.2).unwrap();
    let solution = Solution::new(&wide, 1e-15, 1000).unwrap();
    let (v, g) = (solution.rounded(), solution.source(&wide, &pairs).unwrap());
    let tables = Tables::new(reflectance, cells).unwrap();
    let circle = Circle::new(tables.cells(), emission, 0.2).unwrap();
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, &v, &g).unwrap();
    then(&circle, &neighbour, &v)
}

/// As [`with_piecewise`], with all pairs pointwise.
///
/// # Panics
/// If there is no such circle.
pub fn with_residual<F: Real, E: Emission<F> + Emission<f64> + Copy, R>(
    reflectance: &[f64],
    cells: usize,
    emission: E,
    then: impl FnOnce(&Circle<'_, F, E>, &Residual<'_, '_, F, E>, &[F]) -> R,
) -> R {
    let wide_tables = Tables::<f64>::new(reflectance, cells).unwrap();
    let wide = Circle::new(wide_tables.cells(), emission, 0.2).unwrap();
    let solution = Solution::new(&wide, 1e-15, 1000).unwrap();
    let (v, moments) = (solution.rounded(), solution.moments(&wide.table()).unwrap());
    let tables = Tables::new(reflectance, cells).unwrap();
    let circle = Circle::new(tables.cells(), emission, 0.2).unwrap();
    let residual = Residual::new(&circle, &v, &moments).unwrap();
    then(&circle, &residual, &v)
}

impl<F: Real, E: Emission<F>> Quadrature for Circle<'_, F, E> {
    fn nodes(&self, x: &Point<F>, j: usize) -> Vec<(Point<F>, f64)> {
        let width = TAU / self.cells() as f64;
        let (left, right) = (j as f64 * width, (j + 1) as f64 * width);
        // p(x, ·) has a kink at x.
        let kink = x.angle().to_f64().clamp(left, right);
        let rule = gauss_legendre(16);
        let part = |from: f64, to: f64| {
            rule.iter()
                .filter(move |_| from < to)
                .map(move |&(t, w)| (self.point(from + t * (to - from)), w * (to - from)))
        };
        part(left, kink).chain(part(kink, right)).collect()
    }

    fn inside(&self, j: usize, t: f64) -> Point<F> {
        self.point(TAU * ((j as f64 + t) / self.cells() as f64))
    }
}
