//! The equation on [0, 1]^D, its chain and its partition.

use core::fmt;

use fredholm_core::galerkin::{Basis, PairIntegral, Partition, TransitionMoments};
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

use crate::mesh::Mesh;
use crate::{CellIntegral, CubeError, Function, IntegralKernel};

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
#[derive(Clone, Copy)]
pub struct Cube<F, const D: usize, K, S> {
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
impl<F: Real, const D: usize, K, S> fmt::Debug for Cube<F, D, K, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cube")
            .field("mesh", &self.mesh)
            .field("absorption", &self.absorption)
            .finish_non_exhaustive()
    }
}

impl<F: Real, const D: usize, K, S> Cube<F, D, K, S>
where
    K: IntegralKernel<F, D>,
    S: Function<F, D>,
{
    /// The equation with this kernel and source, `per_axis` cells per axis, and absorption
    /// probability q0.
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
            places.map(|i| F::from_u32(i) / self.per_axis),
            places.map(|i| (F::from_u32(i) + F::one()) / self.per_axis),
        )
    }

    pub(crate) const fn mesh(&self) -> Mesh<D> {
        self.mesh
    }
}

impl<F: Real, const D: usize, K, S> StateSpace for Cube<F, D, K, S> {
    type Scalar = F;
    type Point = [F; D];
}

impl<F: Real, const D: usize, K, S> Sampler for Cube<F, D, K, S> {
    #[inline]
    fn absorption(&self, _: &[F; D]) -> F {
        self.absorption
    }

    #[inline]
    fn step<U: Uniforms<F>>(&self, _: &[F; D], uniforms: &mut U) -> Option<[F; D]> {
        Some(core::array::from_fn(|_| uniforms.uniform()))
    }
}

impl<F: Real, const D: usize, K, S> TransitionDensity for Cube<F, D, K, S> {
    fn density(&self, _: &[F; D], _: &[F; D]) -> F {
        self.survival
    }
}

impl<F: Real, const D: usize, K: IntegralKernel<F, D>, S> Kernel for Cube<F, D, K, S> {
    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        self.kernel.kernel(x, y) * self.per_survival
    }
}

impl<F: Real, const D: usize, K, S: Function<F, D>> Source for Cube<F, D, K, S> {
    #[inline]
    fn source(&self, x: &[F; D]) -> F {
        self.source.value(x)
    }
}

impl<F: Real, const D: usize, K, S> Partition for Cube<F, D, K, S> {
    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    /// Cells are half open; the end 1 of an axis belongs to its last cell.
    #[inline]
    fn locate(&self, x: &[F; D]) -> usize {
        let m = self.mesh.per_axis();
        let cell = x.iter().fold(0, |cell, &x| {
            cell * m + (x * self.per_axis).to_u32().min(m - 1)
        });
        cell as usize
    }
}

impl<F: Real, const D: usize, K, S> Basis for Cube<F, D, K, S> {
    #[inline]
    fn basis(&self, _: &Located<[F; D]>) -> [F; 1] {
        [F::one()]
    }
}

impl<F: Real, const D: usize, K, S> TransitionMoments for Cube<F, D, K, S> {
    /// (1 − q0)/n.
    #[inline]
    fn moments(&self, _: &Located<[F; D]>, _: usize) -> [[F; 1]; 1] {
        [[self.mass]]
    }
}

impl<F: Real, const D: usize, K, S> PairIntegral for Cube<F, D, K, S>
where
    K: CellIntegral<F, D>,
    S: Function<F, D>,
{
    #[inline]
    fn pair_integral(&self, x: &Located<[F; D]>, j: usize) -> [F; 1] {
        let (low, high) = self.cell_box(j);
        [self.kernel.integral(&x.point, &low, &high)]
    }
}
