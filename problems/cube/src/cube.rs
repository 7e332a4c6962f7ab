//! The equation on [0, 1]^D, its chain and its partition.

use core::fmt;
use fredholm_core::array::{Each, from_fn};

use fredholm_core::galerkin::{Basis, PairIntegral, Partition, TransitionMoments};
use fredholm_core::whole::Starts;
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

use crate::functions::Functions;
use crate::mesh::Mesh;
use crate::{CubeError, KernelFn, KernelIntegral, ScalarField};

/// The model problem of Heinrich and Mathé 1993 on X = [0, 1]^D:
///
/// ```text
/// u(x) = ∫ K(x,y) u(y) dy + F(x)
/// ```
///
/// with the chain p(x,y) ≡ 1 − q0, q ≡ q0: a walk jumps to a uniform point or is absorbed. Hence
/// k = K/(1 − q0), and f = F/q0.
///
/// It is its own partition into n = m^D equal cells, on which p_j(x) = (1 − q0)/n whatever x is.
///
/// On every cell stand B functions ψ_0 … ψ_(B−1): the products of normalised Legendre polynomials of
/// the cell's coordinates t_a ∈ [−1, 1] whose degrees sum to p or less, in lexicographic order of these
/// degrees, the last axis running fastest. B = C(p + D, D), [`functions`](crate::functions); B = 1 are
/// the piecewise constants, and [`with_functions`](Self::with_functions) chooses others. The transition
/// moments are (1 − q0)/n times the identity.
#[derive(Clone, Copy)]
pub struct Cube<F, const D: usize, K, S, const B: usize = 1> {
    kernel: K,
    source: S,
    mesh: Mesh<D>,
    /// m.
    per_axis: F,
    absorption: F,
    /// 1/(1 − q0).
    per_survival: F,
    /// 1 − q0.
    survival: F,
    /// (1 − q0)/n.
    mass: F,
}

// By hand: closures have no `Debug`.
impl<F: Real, const D: usize, K, S, const B: usize> fmt::Debug for Cube<F, D, K, S, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cube")
            .field("mesh", &self.mesh)
            .field("degree", &self.degree())
            .field("absorption", &self.absorption)
            .finish_non_exhaustive()
    }
}

impl<F: Real, const D: usize, K, S> Cube<F, D, K, S>
where
    K: KernelFn<F, D>,
    S: ScalarField<F, D>,
{
    /// The equation with this kernel and source, `per_axis` cells per axis with piecewise constants, and
    /// absorption probability q0.
    ///
    /// # Errors
    /// [`CubeError::Absorption`] for q0 outside (0, 1), [`CubeError::Cells`].
    pub fn new(kernel: K, source: S, per_axis: usize, absorption: f64) -> Result<Self, CubeError> {
        let q = F::from_f64(absorption);
        if !(q > F::zero() && q < F::one()) {
            return Err(CubeError::Absorption);
        }
        let mesh = Mesh::new(per_axis)?;
        let m = F::from_u32(mesh.per_axis());
        if m.to_f64() != f64::from(mesh.per_axis()) {
            return Err(CubeError::Cells);
        }
        let survival = F::one() - q;
        Ok(Self {
            kernel,
            source,
            mesh,
            per_axis: m,
            absorption: q,
            per_survival: F::one() / survival,
            survival,
            mass: F::from_f64(survival.to_f64() / mesh.cells() as f64),
        })
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Cube<F, D, K, S, B> {
    /// This equation on these cells, with `N` functions on each: [`functions`](crate::functions)(D, p) of
    /// them for the total degree p.
    ///
    /// ```
    /// use fredholm_cube::{Cube, functions};
    ///
    /// let kernel = |x: &[f64; 2], y: &[f64; 2]| 0.5 * x[0] * y[1];
    /// let cube = Cube::new(kernel, |x: &[f64; 2]| x[0], 8, 0.2)?;
    /// let cubic = cube.with_functions::<{ functions(2, 3) }>();
    /// assert_eq!(cubic.degree(), 3);
    /// # Ok::<(), fredholm_cube::CubeError>(())
    /// ```
    ///
    /// Another number of functions is refused by the compiler:
    ///
    /// ```compile_fail
    /// # use fredholm_cube::Cube;
    /// # let kernel = |x: &[f64; 2], y: &[f64; 2]| 0.5 * x[0] * y[1];
    /// # let cube = Cube::new(kernel, |x: &[f64; 2]| x[0], 8, 0.2).unwrap();
    /// let neither = cube.with_functions::<5>();
    /// ```
    #[must_use]
    pub fn with_functions<const N: usize>(self) -> Cube<F, D, K, S, N> {
        const { assert!(Functions::<D, N>::DEGREES.len() == N) }
        Cube {
            kernel: self.kernel,
            source: self.source,
            mesh: self.mesh,
            per_axis: self.per_axis,
            absorption: self.absorption,
            per_survival: self.per_survival,
            survival: self.survival,
            mass: self.mass,
        }
    }

    /// The total degree p of the functions on a cell.
    #[must_use]
    pub const fn degree(&self) -> usize {
        Functions::<D, B>::DEGREE
    }

    /// The kernel K.
    #[must_use]
    pub const fn integral_kernel(&self) -> &K {
        &self.kernel
    }

    /// The source F.
    #[must_use]
    pub const fn right_hand_side(&self) -> &S {
        &self.source
    }

    /// The number m of cells per axis.
    #[must_use]
    pub const fn per_axis(&self) -> usize {
        self.mesh.per_axis() as usize
    }

    /// Cell `cell` as the box low_a ≤ x_a ≤ high_a: (low, high).
    #[must_use]
    pub fn cell_box(&self, cell: usize) -> ([F; D], [F; D]) {
        let places = self.mesh.places(cell);
        (
            places.each(|i| F::from_u32(i) / self.per_axis),
            places.each(|i| (F::from_u32(i) + F::one()) / self.per_axis),
        )
    }

    pub(crate) const fn mesh(&self) -> Mesh<D> {
        self.mesh
    }

    /// 1 − q0.
    #[cfg(feature = "alloc")]
    pub(crate) fn survival(&self) -> f64 {
        self.survival.to_f64()
    }

    /// (1 − q0)/n.
    #[cfg(feature = "alloc")]
    pub(crate) fn mass(&self) -> f64 {
        self.mass.to_f64()
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> StateSpace for Cube<F, D, K, S, B> {
    type Scalar = F;
    type Point = [F; D];
}

impl<F: Real, const D: usize, K, S, const B: usize> Sampler for Cube<F, D, K, S, B> {
    #[inline]
    fn absorption(&self, _: &[F; D]) -> F {
        self.absorption
    }

    #[inline]
    fn step<U: Uniforms<F>>(&self, _: &[F; D], uniforms: &mut U) -> Option<[F; D]> {
        Some(from_fn(|_| uniforms.uniform()))
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> TransitionDensity for Cube<F, D, K, S, B> {
    fn density(&self, _: &[F; D], _: &[F; D]) -> F {
        self.survival
    }
}

/// Uniform starts, as every state is uniform.
impl<F: Real, const D: usize, K, S, const B: usize> Starts for Cube<F, D, K, S, B> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> [F; D] {
        from_fn(|_| uniforms.uniform())
    }

    #[inline]
    fn start_density(&self, _: &[F; D]) -> f64 {
        1.0
    }

    fn survival(&self) -> Option<f64> {
        Some(self.survival.to_f64())
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Kernel for Cube<F, D, K, S, B>
where
    K: KernelFn<F, D>,
{
    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        self.kernel.kernel(x, y) * self.per_survival
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Source for Cube<F, D, K, S, B>
where
    S: ScalarField<F, D>,
{
    #[inline]
    fn source(&self, x: &[F; D]) -> F {
        self.source.value(x)
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Partition for Cube<F, D, K, S, B> {
    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    #[inline]
    fn locate(&self, x: &[F; D]) -> usize {
        self.mesh.locate(x, self.per_axis)
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Basis<B> for Cube<F, D, K, S, B> {
    #[inline]
    fn basis(&self, x: &Located<[F; D]>) -> [F; B] {
        Functions::in_cell(&self.mesh, x)
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> TransitionMoments<B> for Cube<F, D, K, S, B> {
    /// (1 − q0)/n times the identity.
    #[inline]
    fn moments(&self, _: &Located<[F; D]>, _: usize) -> [[F; B]; B] {
        let mut moments = [[F::zero(); B]; B];
        for (b, row) in moments.iter_mut().enumerate() {
            if let Some(entry) = row.get_mut(b) {
                *entry = self.mass;
            }
        }
        moments
    }

    #[inline]
    fn solve_moments(&self, _: &Located<[F; D]>, _: usize, mut right: [F; B]) -> [F; B] {
        for right in &mut right {
            *right /= self.mass;
        }
        right
    }
}

/// Integrals for piecewise constants: pointwise pairs of higher degree would need first moments of the kernel.
impl<F: Real, const D: usize, K, S> PairIntegral for Cube<F, D, K, S>
where
    K: KernelIntegral<F, D>,
    S: ScalarField<F, D>,
{
    #[inline]
    fn pair_integral(&self, x: &Located<[F; D]>, j: usize) -> [F; 1] {
        let (low, high) = self.cell_box(j);
        [self.kernel.integral(&x.point, &low, &high)]
    }
}
