//! A problem that counts what walks ask of it.

use core::fmt;
use core::sync::atomic::{AtomicU64, Ordering::Relaxed};

use fredholm_core::galerkin::{
    Basis, Cells, Coefficients, GalerkinMatrix, PairIntegral, TransitionMoments,
};
use fredholm_core::{Chain, Equation, Located, Neighbour, Space, Uniforms};

/// How often something was evaluated.
#[derive(Debug, Default)]
pub struct Counts {
    uniforms: AtomicU64,
    steps: AtomicU64,
    kernels: AtomicU64,
    sources: AtomicU64,
    located: AtomicU64,
    neighbour_kernels: AtomicU64,
    neighbour_sources: AtomicU64,
    coefficients: AtomicU64,
    moments: AtomicU64,
    bases: AtomicU64,
    integrals: AtomicU64,
}

/// The names of the columns of [`Counts`].
pub const COLUMNS: [&str; 11] = [
    "uniforms", "steps", "k", "F", "locate", "h", "G", "K'_ij", "M_j", "psi", "int K",
];

impl Counts {
    /// Nothing was counted.
    pub fn reset(&self) {
        self.all().iter().for_each(|count| count.store(0, Relaxed));
    }

    const fn all(&self) -> [&AtomicU64; COLUMNS.len()] {
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

fn count(of: &AtomicU64) {
    of.fetch_add(1, Relaxed);
}

impl fmt::Display for Counts {
    /// Uniform numbers, steps, k, F, located points, h, G, blocks of K', transition moments, bases, integrals of K.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for count in self.all() {
            write!(f, " {:>8}", count.load(Relaxed))?;
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

impl<P: Space> Space for Counted<'_, P> {
    type Scalar = P::Scalar;
    type Point = P::Point;
}

impl<P: Chain> Chain for Counted<'_, P> {
    fn step<U: Uniforms<P::Scalar>>(&self, x: &P::Point, uniforms: &mut U) -> Option<P::Point> {
        count(&self.counts.steps);
        let mut uniforms = CountedUniforms {
            inner: uniforms,
            counts: self.counts,
        };
        self.inner.step(x, &mut uniforms)
    }
}

impl<P: Equation> Equation for Counted<'_, P> {
    type Value = P::Value;

    fn kernel(&self, x: &P::Point, y: &P::Point) -> P::Value {
        count(&self.counts.kernels);
        self.inner.kernel(x, y)
    }
    fn source<U: Uniforms<P::Scalar>>(&self, x: &P::Point, uniforms: &mut U) -> P::Value {
        count(&self.counts.sources);
        self.inner.source(x, uniforms)
    }
    fn channels(&self) -> usize {
        self.inner.channels()
    }
    fn size(&self, x: &P::Point) -> P::Scalar {
        self.inner.size(x)
    }
}

impl<P: Cells> Cells for Counted<'_, P> {
    const DIMENSION: usize = P::DIMENSION;

    fn cells(&self) -> usize {
        self.inner.cells()
    }
    fn locate(&self, x: &P::Point) -> usize {
        count(&self.counts.located);
        self.inner.locate(x)
    }
    fn measure(&self, cell: usize) -> f64 {
        self.inner.measure(cell)
    }
    fn point(&self, cell: usize, t: &[f64]) -> P::Point {
        self.inner.point(cell, t)
    }
    fn parameters(&self, x: &Located<P::Point>, t: &mut [P::Scalar]) {
        self.inner.parameters(x, t);
    }
    fn at(&self, coordinates: &[f64]) -> Option<P::Point> {
        self.inner.at(coordinates)
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
    fn pair_integral(&self, x: &Located<P::Point>, j: usize) -> [P::Value; B] {
        count(&self.counts.integrals);
        self.inner.pair_integral(x, j)
    }
}

impl<C: GalerkinMatrix> GalerkinMatrix for Counted<'_, C> {
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

impl<C: Coefficients<B>, const B: usize> Coefficients<B> for Counted<'_, C> {
    fn left_times_block(&self, i: usize, j: usize, left: &[C::Scalar; B]) -> [C::Scalar; B] {
        count(&self.counts.coefficients);
        self.inner.left_times_block(i, j, left)
    }
}

impl<N: Neighbour> Neighbour for Counted<'_, N> {
    type Value = N::Value;

    fn locate(&self, x: N::Point) -> Located<N::Point> {
        self.inner.locate(x)
    }
    fn kernel(&self, x: &Located<N::Point>, y: &Located<N::Point>, k: &N::Value) -> N::Value {
        count(&self.counts.neighbour_kernels);
        self.inner.kernel(x, y, k)
    }
    fn source(&self, x: &Located<N::Point>, draws: &mut dyn Uniforms<N::Scalar>) -> N::Value {
        count(&self.counts.neighbour_sources);
        self.inner.source(x, draws)
    }
    fn value(&self, x: &Located<N::Point>) -> N::Value {
        self.inner.value(x)
    }
    fn is_pointwise(&self) -> bool {
        self.inner.is_pointwise()
    }
}
