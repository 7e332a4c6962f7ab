//! A toy equation on [0, 1] that uses every seam of the core: absorption that varies, a density
//! that is not constant, sources and kernels that are not either, any small degree, every kind of
//! pair, walks that leave the space, and a known solution.
//!
//! q(x) = (2 + x)/10, p(x,y) = (1 − ℓ)(1 − q(x))(1 + x(y − ½)) where a step leaves with probability
//! ℓ, k(x,y) = (3 + xy)/5, u(x) = 1 + x − x² or 1. Everything is a polynomial, so that four Gauss
//! points give every integral exactly.

use fredholm_core::galerkin::{
    Basis, Dense, PairIntegral, PairKind, Pairs, Partition, TransitionMoments,
};
use fredholm_core::{
    Functional, Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

use crate::description::Description;
use crate::offers::{Neighbours, Offers};
use crate::quadrature::gauss_legendre;

/// The toy equation with n equal cells.
#[derive(Clone, Debug)]
pub struct Toy<F> {
    cells: usize,
    rule: Vec<(F, F)>,
    leaving: F,
    constant: bool,
}

impl<F: Real> Toy<F> {
    /// With `cells` equal cells.
    #[must_use]
    pub fn new(cells: usize) -> Self {
        let rule = gauss_legendre(4);
        let rule = rule.iter().map(|&(t, w)| (F::from_f64(t), F::from_f64(w)));
        Self {
            cells,
            rule: rule.collect(),
            leaving: F::zero(),
            constant: false,
        }
    }

    /// The same with steps that leave the space with probability `leaving`.
    #[must_use]
    pub fn leaving(self, leaving: f64) -> Self {
        let leaving = F::from_f64(leaving);
        Self { leaving, ..self }
    }

    /// The same with the solution 1.
    #[must_use]
    pub fn constant(self) -> Self {
        Self {
            constant: true,
            ..self
        }
    }

    fn solution_at(&self, x: F) -> F {
        if self.constant {
            F::one()
        } else {
            Self::exact(x)
        }
    }

    /// The solution 1 + x − x².
    #[must_use]
    pub fn exact(x: F) -> F {
        F::one() + x - x * x
    }

    fn kernel_times_density(&self, x: F, y: F) -> F {
        self.kernel(&x, &y) * self.density(&x, &y)
    }

    /// The Gauss points of cell `j` with weights that sum to its length.
    fn points(&self, j: usize) -> impl Iterator<Item = (F, F)> {
        let length = F::one() / F::from_f64(self.cells as f64);
        let left = F::from_f64(j as f64) * length;
        self.rule
            .iter()
            .map(move |&(t, w)| (left + t * length, w * length))
    }

    fn basis_at<const B: usize>(&self, x: F, cell: usize) -> [F; B] {
        // Legendre polynomials of degree 0 and 1, normalised: 1 and √3 t, t ∈ [−1, 1].
        let n = F::from_f64(self.cells as f64);
        let t = F::from_f64(2.0) * (x * n - F::from_f64(cell as f64)) - F::one();
        core::array::from_fn(|b| match b {
            0 => F::one(),
            1 => F::from_f64(3.0).sqrt() * t,
            _ => F::NAN,
        })
    }

    /// The Galerkin matrix (39) and right-hand side (40), exact.
    #[must_use]
    pub fn galerkin<const B: usize>(&self) -> (Vec<F>, Vec<F>) {
        let unknowns = self.cells * B;
        let mut matrix = vec![F::zero(); unknowns * unknowns];
        let mut right = vec![F::zero(); unknowns];
        let n = F::from_f64(self.cells as f64);
        for i in 0..self.cells {
            for (x, weight) in self.points(i) {
                let weight = weight * n;
                let psi: [F; B] = self.basis_at(x, i);
                for (a, &psi) in psi.iter().enumerate() {
                    right[i * B + a] += weight * psi * self.source(&x);
                    for j in 0..self.cells {
                        let at = Located { point: x, cell: i };
                        let integral: [F; B] = self.pair_integral(&at, j);
                        for (b, &k) in integral.iter().enumerate() {
                            matrix[(i * B + a) * unknowns + j * B + b] += weight * psi * k;
                        }
                    }
                }
            }
        }
        (matrix, right)
    }

    /// The table as coefficients.
    ///
    /// # Panics
    /// If the table is not a square of cells·B rows.
    #[must_use]
    pub fn coefficients<'a, const B: usize>(&self, matrix: &'a [F]) -> Dense<'a, F> {
        Dense::new(matrix, self.cells, B).expect("a square table")
    }
}

impl<F: Real> StateSpace for Toy<F> {
    type Scalar = F;
    type Point = F;
}

impl<F: Real> Sampler for Toy<F> {
    fn absorption(&self, x: &F) -> F {
        F::from_f64(0.1) * (F::from_f64(2.0) + *x)
    }

    fn step<U: Uniforms<F>>(&self, x: &F, uniforms: &mut U) -> Option<F> {
        let xi: F = uniforms.uniform();
        if xi < self.leaving {
            return None;
        }
        // y + x(y² − y)/2 = ξ, solved without cancellation for small x.
        let xi = (xi - self.leaving) / (F::one() - self.leaving);
        let half = *x * F::from_f64(0.5);
        let b = F::one() - half;
        let root = (b * b + F::from_f64(4.0) * half * xi).sqrt();
        Some(F::from_f64(2.0) * xi / (b + root))
    }
}

impl<F: Real> TransitionDensity for Toy<F> {
    fn density(&self, x: &F, y: &F) -> F {
        let staying = (F::one() - self.leaving) * (F::one() - self.absorption(x));
        staying * (F::one() + *x * (*y - F::from_f64(0.5)))
    }
}

impl<F: Real> Kernel for Toy<F> {
    fn kernel(&self, x: &F, y: &F) -> F {
        F::from_f64(0.2) * (F::from_f64(3.0) + *x * *y)
    }
}

impl<F: Real> Source for Toy<F> {
    fn source(&self, x: &F) -> F {
        // F = u − T_K u; four Gauss points on [0, 1] are exact for degree 7.
        let integral = self.rule.iter().fold(F::zero(), |sum, &(y, w)| {
            sum + w * self.kernel_times_density(*x, y) * self.solution_at(y)
        });
        self.solution_at(*x) - integral
    }
}

impl<F: Real> Partition for Toy<F> {
    fn cells(&self) -> usize {
        self.cells
    }
    fn locate(&self, x: &F) -> usize {
        ((*x * F::from_f64(self.cells as f64)).to_u32() as usize).min(self.cells - 1)
    }
}

impl<F: Real, const B: usize> Basis<B> for Toy<F> {
    fn basis(&self, x: &Located<F>) -> [F; B] {
        self.basis_at(x.point, x.cell)
    }
}

impl<F: Real, const B: usize> TransitionMoments<B> for Toy<F> {
    fn moments(&self, x: &Located<F>, j: usize) -> [[F; B]; B] {
        let mut moments = [[F::zero(); B]; B];
        for (y, weight) in self.points(j) {
            let psi: [F; B] = self.basis_at(y, j);
            let mass = weight * self.density(&x.point, &y);
            for (row, &b) in moments.iter_mut().zip(&psi) {
                for (m, &c) in row.iter_mut().zip(&psi) {
                    *m += mass * b * c;
                }
            }
        }
        moments
    }
}

impl<F: Real, const B: usize> PairIntegral<B> for Toy<F> {
    fn pair_integral(&self, x: &Located<F>, j: usize) -> [F; B] {
        let mut integral = [F::zero(); B];
        for (y, weight) in self.points(j) {
            let psi: [F; B] = self.basis_at(y, j);
            let k = weight * self.kernel_times_density(x.point, y);
            for (sum, &psi) in integral.iter_mut().zip(&psi) {
                *sum += k * psi;
            }
        }
        integral
    }
}

impl<F: Real, const B: usize> Description<B> for Toy<F> {
    type Equation = Self;
    const DIMENSION: usize = 1;

    fn equation(&self) -> &Self {
        self
    }
    fn point(&self, cell: usize, t: &[f64]) -> F {
        F::from_f64((cell as f64 + t[0]) / self.cells as f64)
    }
    fn contains(&self, cell: usize, x: &F) -> bool {
        let n = self.cells as f64;
        let (left, right) = (cell as f64 / n, (cell + 1) as f64 / n);
        let edge = 2.0 * F::EPSILON.to_f64();
        (left - edge..=right + edge).contains(&x.to_f64())
    }
    fn nodes(&self, _: &F, j: usize) -> Vec<(F, f64)> {
        self.points(j).map(|(y, w)| (y, w.to_f64())).collect()
    }
    fn leaving(&self, _: &F) -> f64 {
        self.leaving.to_f64()
    }
    fn solution(&self, x: &F) -> Option<f64> {
        Some(self.solution_at(*x).to_f64())
    }
    fn constant(&self) -> Option<f64> {
        self.constant.then_some(1.0)
    }
    fn cumulative(&self, x: &F, y: &F) -> Option<f64> {
        let (x, y) = (x.to_f64(), y.to_f64());
        Some(y + 0.5 * x * (y * y - y))
    }
    fn mass(&self, x: &Located<F>, j: usize) -> Option<f64> {
        let (n, at) = (self.cells as f64, x.point.to_f64());
        let staying = (1.0 - self.leaving.to_f64()) * (0.8 - 0.1 * at);
        Some(staying * (1.0 + at * ((j as f64 + 0.5) / n - 0.5)) / n)
    }
}

impl<F: Real, const B: usize> Neighbours<B> for Toy<F> {
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        offers.pairs("all in S", ALL);
        offers.pointwise_pairs("diagonal pointwise", POINTWISE_DIAGONAL);
        offers.pointwise_pairs("pairs of all kinds", MIXED);
        offers.pointwise_pairs("all pointwise", ALL_POINTWISE);
        let (matrix, right) = self.galerkin::<B>();
        offers.coefficients("own", &self.coefficients::<B>(&matrix), 0.0);
        let right: Vec<f64> = right.into_iter().map(Real::to_f64).collect();
        offers.source_means("own", &right, 0.0);
    }
}

/// (u, Φ) with Φ = 1: the mean of u over [0, 1], from starts with density p0(x) = ½ + x, so that
/// φ = 1/(½ + x) varies. The exact value is 7/6.
#[derive(Clone, Copy, Debug)]
pub struct Mean;

impl<F: Real> Functional<Toy<F>> for Mean {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (F, F) {
        let half = F::from_f64(0.5);
        let xi: F = uniforms.uniform();
        // ½x + ½x² = ξ
        let x = (F::from_f64(0.25) + xi + xi).sqrt() - half;
        (x, F::one() / (half + x))
    }
}

/// Pairs of every kind: those on the diagonal, those just above it, and the rest.
#[derive(Clone, Copy, Debug)]
pub struct Bands {
    /// (i, i).
    pub diagonal: PairKind,
    /// (i, i + 1).
    pub above: PairKind,
    /// All others.
    pub rest: PairKind,
}

/// All pairs in S.
pub const ALL: Bands = Bands {
    diagonal: PairKind::Galerkin,
    above: PairKind::Galerkin,
    rest: PairKind::Galerkin,
};
/// All but the diagonal in S.
pub const POINTWISE_DIAGONAL: Bands = Bands {
    diagonal: PairKind::Pointwise,
    ..ALL
};
/// Pairs of every kind.
pub const MIXED: Bands = Bands {
    diagonal: PairKind::Pointwise,
    above: PairKind::Dropped,
    rest: PairKind::Galerkin,
};
/// No pair in S.
pub const ALL_POINTWISE: Bands = Bands {
    diagonal: PairKind::Pointwise,
    above: PairKind::Pointwise,
    rest: PairKind::Pointwise,
};

impl Pairs for Bands {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        if i == j {
            self.diagonal
        } else if i + 1 == j {
            self.above
        } else {
            self.rest
        }
    }
}
