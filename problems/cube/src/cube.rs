//! The equation on [0, 1]^D, its chain and its cells.

use core::fmt;
use fredholm_core::array::{Each, from_fn};

use fredholm_core::galerkin::{Basis, Cells, PairIntegral, TransitionMoments};
use fredholm_core::global::Stationary;
use fredholm_core::{Chain, Density, Equation, Lights, Located, Real, Space, Uniforms};

use crate::functions::{Functions, polynomials};
use crate::mesh::Mesh;
use crate::{CubeError, KernelFn, KernelIntegral, ScalarField};

/// The model problem of Heinrich and Mathé 1993 on X = [0, 1]^D:
///
/// ```text
/// u(x) = ∫ K(x,y) u(y) dy + F(x)
/// ```
///
/// with the chain p(x,y) ≡ 1: a walk jumps to a uniform point, and k = K.
///
/// Its cells are n = m^D equal cubes, into which a step leads with the probability 1/n whatever x is.
///
/// On every cell stand B functions ψ_0 … ψ_(B−1): the products of normalised Legendre polynomials of
/// the cell's coordinates whose degrees sum to p or less, in lexicographic order of these
/// degrees, the last axis running fastest. B = C(p + D, D), [`functions`](fredholm_core::galerkin::functions); B = 1 are
/// the piecewise constants, and [`with_functions`](Self::with_functions) chooses others. The transition
/// moments are 1/n times the identity.
///
/// A [`LastStep`](fredholm_core::LastStep) goes to a uniform point as well, and scores K(x,y) F(y): where F jumps and K
/// does not, u − F is smooth, and a piecewise polynomial follows it.
#[derive(Clone, Copy)]
pub struct Cube<F, const D: usize, K, S, const B: usize = 1> {
    kernel: K,
    source: S,
    mesh: Mesh<D>,
    /// m.
    per_axis: F,
    /// 1/n.
    mass: F,
}

// By hand: closures have no `Debug`.
impl<F: Real, const D: usize, K, S, const B: usize> fmt::Debug for Cube<F, D, K, S, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cube")
            .field("mesh", &self.mesh)
            .field("degree", &self.degree())
            .finish_non_exhaustive()
    }
}

impl<F: Real, const D: usize, K: KernelFn<F, D>, S: ScalarField<F, D>> Cube<F, D, K, S> {
    /// The equation with this kernel and source, `per_axis` cells per axis with piecewise constants.
    ///
    /// # Errors
    /// [`CubeError::Cells`].
    pub fn new(kernel: K, source: S, per_axis: usize) -> Result<Self, CubeError> {
        let mesh = Mesh::new(per_axis)?;
        let m = F::from_u32(mesh.per_axis());
        if m.to_f64() != f64::from(mesh.per_axis()) {
            return Err(CubeError::Cells);
        }
        Ok(Self {
            kernel,
            source,
            mesh,
            per_axis: m,
            mass: F::from_f64(1.0 / mesh.cells() as f64),
        })
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Cube<F, D, K, S, B> {
    /// This equation on these cells, with `N` functions on each: [`functions`](fredholm_core::galerkin::functions)(D, p) of
    /// them for the total degree p.
    ///
    /// ```
    /// use fredholm_core::galerkin::functions;
    /// use fredholm_cube::Cube;
    ///
    /// let kernel = |x: &[f64; 2], y: &[f64; 2]| 0.5 * x[0] * y[1];
    /// let cube = Cube::new(kernel, |x: &[f64; 2]| x[0], 8)?;
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
    /// # let cube = Cube::new(kernel, |x: &[f64; 2]| x[0], 8).unwrap();
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
}

impl<F: Real, const D: usize, K, S, const B: usize> Space for Cube<F, D, K, S, B> {
    type Scalar = F;
    type Point = [F; D];
}

impl<F: Real, const D: usize, K, S, const B: usize> Chain for Cube<F, D, K, S, B> {
    #[inline]
    fn step<U: Uniforms<F>>(&self, _: &[F; D], uniforms: &mut U) -> Option<[F; D]> {
        Some(from_fn(|_| uniforms.uniform()))
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Density for Cube<F, D, K, S, B> {
    fn density(&self, _: &[F; D], _: &[F; D]) -> F {
        F::one()
    }
}

/// Uniform starts, as every state is uniform.
impl<F: Real, const D: usize, K, S, const B: usize> Stationary for Cube<F, D, K, S, B> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> [F; D] {
        from_fn(|_| uniforms.uniform())
    }

    #[inline]
    fn start_density(&self, _: &[F; D]) -> f64 {
        1.0
    }

    fn is_preserved(&self) -> bool {
        true
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Equation for Cube<F, D, K, S, B>
where
    K: KernelFn<F, D>,
    S: ScalarField<F, D>,
{
    type Value = F;

    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        self.kernel.kernel(x, y)
    }

    #[inline]
    fn source<U: Uniforms<F>>(&self, x: &[F; D], _: &mut U) -> F {
        self.source.value(x)
    }
}

/// All of F, from uniform points.
impl<F: Real, const D: usize, K, S, const B: usize> Lights for Cube<F, D, K, S, B>
where
    K: KernelFn<F, D>,
    S: ScalarField<F, D>,
{
    #[inline]
    fn light<U: Uniforms<F>>(&self, x: &[F; D], uniforms: &mut U) -> F {
        let y = from_fn(|_| uniforms.uniform());
        self.kernel.kernel(x, &y) * self.source.value(&y)
    }

    #[inline]
    fn known(&self, x: &[F; D]) -> F {
        self.source.value(x)
    }

    #[inline(always)]
    fn rest(&self, _: &[F; D]) -> F {
        F::zero()
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Cells for Cube<F, D, K, S, B> {
    const DIMENSION: usize = D;

    fn cells(&self) -> usize {
        self.mesh.cells()
    }

    #[inline]
    fn locate(&self, x: &[F; D]) -> usize {
        self.mesh.locate(x, self.per_axis)
    }

    fn measure(&self, _: usize) -> f64 {
        1.0 / self.mesh.cells() as f64
    }

    fn point(&self, cell: usize, t: &[f64]) -> [F; D] {
        let t = t.first_chunk().unwrap_or(&[f64::NAN; D]);
        self.mesh.point(cell, t).each(F::from_f64)
    }

    #[inline]
    fn parameters(&self, x: &Located<[F; D]>, t: &mut [F]) {
        for (t, own) in t.iter_mut().zip(self.mesh.local(x)) {
            *t = own;
        }
    }

    fn at(&self, coordinates: &[f64]) -> Option<[F; D]> {
        let x: &[f64; D] = coordinates.try_into().ok()?;
        let is_inside = x.iter().all(|x| (0.0..=1.0).contains(x));
        is_inside.then(|| x.each(F::from_f64))
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> Basis<B> for Cube<F, D, K, S, B> {
    /// The products of the core, with degrees that the compiler knows.
    #[inline]
    fn basis(&self, x: &Located<[F; D]>) -> [F; B] {
        polynomials(&self.mesh.local(x))
    }
}

impl<F: Real, const D: usize, K, S, const B: usize> TransitionMoments<B> for Cube<F, D, K, S, B> {
    /// 1/n times the identity.
    #[inline]
    fn moments(&self, _: &Located<[F; D]>, _: usize) -> [[F; B]; B] {
        from_fn(|a| from_fn(|b| if a == b { self.mass } else { F::zero() }))
    }

    #[inline]
    fn solve_moments(&self, _: &Located<[F; D]>, _: usize, right: [F; B]) -> [F; B] {
        right.each(|right| right / self.mass)
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
