//! A problem that counts what walks ask of it.

use core::cell::Cell;
use core::fmt;

use fredholm_core::galerkin::{
    Basis, Coefficients, GalerkinMatrix, PairIntegral, Partition, TransitionMoments,
};
use fredholm_core::{Kernel, Located, Neighbour, Sampler, Source, StateSpace, Uniforms};

/// How often something was evaluated.
#[derive(Clone, Debug, Default)]
pub struct Counts {
    uniforms: Cell<u64>,
    steps: Cell<u64>,
    kernels: Cell<u64>,
    sources: Cell<u64>,
    located: Cell<u64>,
    neighbour_kernels: Cell<u64>,
    neighbour_sources: Cell<u64>,
    coefficients: Cell<u64>,
    moments: Cell<u64>,
    bases: Cell<u64>,
    integrals: Cell<u64>,
}

/// The names of the columns of [`Counts`].
pub const COLUMNS: [&str; 11] = [
    "uniforms", "steps", "k", "F", "locate", "h", "G", "K'_ij", "M_j", "psi", "int K",
];

impl Counts {
    /// Nothing was counted.
    pub fn reset(&self) {
        self.all().iter().for_each(|cell| cell.set(0));
    }

    const fn all(&self) -> [&Cell<u64>; COLUMNS.len()] {
        [
            &self.uniforms,
            &self.steps,
            &self.kernels,
            &self.sources,
            &self.located,
            &self.neighbour_kernels,
            &self.neighbour_sources,
            &self.coefficients,
            &self.moments,
            &self.bases,
            &self.integrals,
        ]
    }
}

fn count(cell: &Cell<u64>) {
    cell.set(cell.get() + 1);
}

impl fmt::Display for Counts {
    /// Uniform numbers, steps, k, F, located points, h, G, blocks of K', transition moments, bases, integrals of K.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for cell in self.all() {
            write!(f, " {:>8}", cell.get())?;
        }
        Ok(())
    }
}

/// An equation, the cells of a problem, its coefficients or a neighbour equation, with a count of everything.
#[derive(Debug)]
pub struct Counted<'a, P> {
    inner: &'a P,
    counts: &'a Counts,
}

impl<'a, P> Counted<'a, P> {
    /// The same as `inner`, counted in `counts`.
    #[must_use]
    pub const fn new(inner: &'a P, counts: &'a Counts) -> Self {
        Self { inner, counts }
    }
}

/// Uniform numbers, counted.
struct CountedUniforms<'a, U> {
    inner: &'a mut U,
    counts: &'a Counts,
}

impl<F, U: Uniforms<F>> Uniforms<F> for CountedUniforms<'_, U> {
    fn uniform(&mut self) -> F {
        count(&self.counts.uniforms);
        self.inner.uniform()
    }
}

impl<P: StateSpace> StateSpace for Counted<'_, P> {
    type Scalar = P::Scalar;
    type Point = P::Point;
}

impl<P: Sampler> Sampler for Counted<'_, P> {
    fn absorption(&self, x: &P::Point) -> P::Scalar {
        self.inner.absorption(x)
    }
    fn step<U: Uniforms<P::Scalar>>(&self, x: &P::Point, uniforms: &mut U) -> Option<P::Point> {
        count(&self.counts.steps);
        let mut uniforms = CountedUniforms {
            inner: uniforms,
            counts: self.counts,
        };
        self.inner.step(x, &mut uniforms)
    }
}

impl<P: Kernel> Kernel for Counted<'_, P> {
    fn kernel(&self, x: &P::Point, y: &P::Point) -> P::Scalar {
        count(&self.counts.kernels);
        self.inner.kernel(x, y)
    }
}

impl<P: Source> Source for Counted<'_, P> {
    fn source(&self, x: &P::Point) -> P::Scalar {
        count(&self.counts.sources);
        self.inner.source(x)
    }
}

impl<P: Partition> Partition for Counted<'_, P> {
    fn cells(&self) -> usize {
        self.inner.cells()
    }
    fn locate(&self, x: &P::Point) -> usize {
        count(&self.counts.located);
        self.inner.locate(x)
    }
}

impl<P: Basis<B>, const B: usize> Basis<B> for Counted<'_, P> {
    fn basis(&self, x: &Located<P::Point>) -> [P::Scalar; B] {
        count(&self.counts.bases);
        self.inner.basis(x)
    }
}

impl<P: TransitionMoments<B>, const B: usize> TransitionMoments<B> for Counted<'_, P> {
    fn moments(&self, x: &Located<P::Point>, j: usize) -> [[P::Scalar; B]; B] {
        count(&self.counts.moments);
        self.inner.moments(x, j)
    }
    fn solve_moments(
        &self,
        x: &Located<P::Point>,
        j: usize,
        right: [P::Scalar; B],
    ) -> [P::Scalar; B] {
        count(&self.counts.moments);
        self.inner.solve_moments(x, j, right)
    }
}

impl<P: PairIntegral<B>, const B: usize> PairIntegral<B> for Counted<'_, P> {
    fn pair_integral(&self, x: &Located<P::Point>, j: usize) -> [P::Scalar; B] {
        count(&self.counts.integrals);
        self.inner.pair_integral(x, j)
    }
}

/// Coefficients, counted.
#[derive(Debug)]
pub struct CountedCoefficients<'a, C> {
    inner: &'a C,
    counts: &'a Counts,
}

impl<'a, C> CountedCoefficients<'a, C> {
    /// The same as `inner`, counted in `counts`.
    #[must_use]
    pub const fn new(inner: &'a C, counts: &'a Counts) -> Self {
        Self { inner, counts }
    }
}

impl<C: GalerkinMatrix> GalerkinMatrix for CountedCoefficients<'_, C> {
    type Scalar = C::Scalar;

    fn cells(&self) -> usize {
        self.inner.cells()
    }
    fn functions(&self) -> usize {
        self.inner.functions()
    }
    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> C::Scalar {
        self.inner.entry(row, column)
    }
}

impl<C: Coefficients<B>, const B: usize> Coefficients<B> for CountedCoefficients<'_, C> {
    fn left_times_block(&self, i: usize, j: usize, left: &[C::Scalar; B]) -> [C::Scalar; B] {
        count(&self.counts.coefficients);
        self.inner.left_times_block(i, j, left)
    }
}

/// A neighbour equation, counted.
#[derive(Debug)]
pub struct CountedNeighbour<'a, N> {
    inner: &'a N,
    counts: &'a Counts,
}

impl<'a, N> CountedNeighbour<'a, N> {
    /// The same as `inner`, counted in `counts`.
    #[must_use]
    pub const fn new(inner: &'a N, counts: &'a Counts) -> Self {
        Self { inner, counts }
    }
}

impl<N: StateSpace> StateSpace for CountedNeighbour<'_, N> {
    type Scalar = N::Scalar;
    type Point = N::Point;
}

impl<N: Neighbour> Neighbour for CountedNeighbour<'_, N> {
    fn locate(&self, x: N::Point) -> Located<N::Point> {
        self.inner.locate(x)
    }
    fn kernel(&self, x: &Located<N::Point>, y: &Located<N::Point>, k: N::Scalar) -> N::Scalar {
        count(&self.counts.neighbour_kernels);
        self.inner.kernel(x, y, k)
    }
    fn source(&self, x: &Located<N::Point>, draws: &mut dyn Uniforms<N::Scalar>) -> N::Scalar {
        count(&self.counts.neighbour_sources);
        self.inner.source(x, draws)
    }
    fn value(&self, x: &Located<N::Point>) -> N::Scalar {
        self.inner.value(x)
    }
}
