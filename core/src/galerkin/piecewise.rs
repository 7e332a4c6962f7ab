//! The neighbour equation of a piecewise polynomial Galerkin solution.

use num_traits::zero;

use super::{
    Basis, Coefficients, GalerkinError, PairIntegral, PairKind, Pairs, TransitionMoments, small,
};
use crate::{Equation, Located, Neighbour, Real, Space, Uniforms};

/// The source G of a neighbour equation, a function of the point and its cell.
pub trait NeighbourSource: Space {
    /// G(x), or a random number with this mean: see [`Neighbour::source`].
    fn source(
        &self,
        x: &Located<Self::Point>,
        draws: &mut dyn Uniforms<Self::Scalar>,
    ) -> Self::Scalar;
}

/// G(x) = Σ_a G_ia ψ_ia(x) for x ∈ X_i: the source of (48), where there are no pointwise pairs.
#[derive(Clone, Copy, Debug)]
pub struct SourceTable<'a, F, P, const B: usize = 1> {
    problem: &'a P,
    values: &'a [F],
}

/// G(x) = Σ_a G_ia ψ_ia(x) − Σ_{j ∈ P(i)} Σ_b v_jb ∫_Xj K(x,y) ψ_jb(y) dμ(y) for x ∈ X_i, where
/// P(i) are the pointwise pairs of row i.
#[derive(Clone, Copy, Debug)]
pub struct PointwiseSource<'a, F, P, S, const B: usize = 1> {
    table: SourceTable<'a, F, P, B>,
    pairs: S,
    solution: &'a [F],
}

/// The neighbour equation that a Galerkin solution of B unknowns per cell solves exactly: one
/// struct for every degree, whose first case B = 1 is (44)–(50) of Heinrich 1995.
///
/// Made of the problem (cells, basis, exact moments), the coefficients K', the pairs, the solution
/// v, and the source G that [`neighbour_source`](super::neighbour_source) gives for all of them.
#[derive(Clone, Copy, Debug)]
pub struct Piecewise<'a, F, P, C, S, G, const B: usize = 1> {
    problem: &'a P,
    coefficients: &'a C,
    pairs: S,
    solution: &'a [F],
    source: G,
}

impl<'a, F, P, C, S, const B: usize> Piecewise<'a, F, P, C, S, SourceTable<'a, F, P, B>, B>
where
    F: Real,
    P: TransitionMoments<B> + Space<Scalar = F>,
    C: Coefficients<B, Scalar = F>,
    S: Pairs,
{
    /// A neighbour equation with pairs that are in S or left out. `solution` is v and `source` is G, both of n·B
    /// entries.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: coefficients or a vector have another size than the partition;
    /// [`GalerkinError::Functions`].
    /// [`GalerkinError::Pointwise`]: there is a pointwise pair, so that G is no table; see
    /// [`with_pointwise`](Piecewise::with_pointwise).
    pub fn new(
        problem: &'a P,
        coefficients: &'a C,
        pairs: S,
        solution: &'a [F],
        source: &'a [F],
    ) -> Result<Self, GalerkinError> {
        let cells = problem.cells();
        sizes(coefficients).check([cells, B], [solution.len(), source.len()])?;
        no_pointwise(&pairs, cells)?;
        Ok(Self {
            problem,
            coefficients,
            pairs,
            solution,
            source: SourceTable {
                problem,
                values: source,
            },
        })
    }
}

impl<'a, F, P, C, S, const B: usize> Piecewise<'a, F, P, C, S, PointwiseSource<'a, F, P, S, B>, B>
where
    F: Real,
    P: TransitionMoments<B> + PairIntegral<B> + Equation<Scalar = F, Value = F>,
    C: Coefficients<B, Scalar = F>,
    S: Pairs + Copy,
{
    /// A neighbour equation with pairs of any kind, for a problem that has the exact integrals of pointwise ones.
    /// `solution` is v and `source` is G over S, both of n·B entries.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: coefficients or a vector have another size than the partition;
    /// [`GalerkinError::Functions`].
    pub fn with_pointwise(
        problem: &'a P,
        coefficients: &'a C,
        pairs: S,
        solution: &'a [F],
        source: &'a [F],
    ) -> Result<Self, GalerkinError> {
        let expected = [problem.cells(), B];
        sizes(coefficients).check(expected, [solution.len(), source.len()])?;
        Ok(Self {
            problem,
            coefficients,
            pairs,
            solution,
            source: PointwiseSource {
                table: SourceTable {
                    problem,
                    values: source,
                },
                pairs,
                solution,
            },
        })
    }
}

impl<'a, F, P, C, S, G, const B: usize> Piecewise<'a, F, P, C, S, G, B> {
    /// The problem, the coefficients, the pairs and the solution v that it is made of.
    pub const fn parts(&self) -> (&'a P, &'a C, &S, &'a [F]) {
        (self.problem, self.coefficients, &self.pairs, self.solution)
    }
}

/// ∫_Xj h(x,y)² p(x,y) dμ(y) for (i, j) ∈ S, x ∈ X_i, exactly: r·c with M_j(x) c = r and
/// r_b = Σ_a K'_(ia)(jb) ψ_ia(x), since h(x,·) = Σ_c c_c ψ_jc there.
#[inline]
pub fn second_moment<P, C, const B: usize>(
    problem: &P,
    coefficients: &C,
    x: &Located<P::Point>,
    j: usize,
) -> P::Scalar
where
    P: TransitionMoments<B>,
    C: Coefficients<B, Scalar = P::Scalar>,
{
    let right = coefficients.left_times_block(x.cell, j, &problem.basis(x));
    small::dot(&right, &problem.solve_moments(x, j, right))
}

/// The cells and functions of coefficients.
struct Sizes([usize; 2]);

fn sizes<const B: usize>(coefficients: &impl Coefficients<B>) -> Sizes {
    Sizes([coefficients.cells(), coefficients.functions()])
}

impl Sizes {
    /// Compares them, and the lengths of v and G, with the cells and functions of a partition.
    fn check(self, [cells, expected]: [usize; 2], [v, g]: [usize; 2]) -> Result<(), GalerkinError> {
        let Self([rows, found]) = self;
        if found != expected {
            return Err(GalerkinError::Functions { expected, found });
        }
        let expected = cells * found;
        for found in [rows * found, v, g] {
            if found != expected {
                return Err(GalerkinError::Length { expected, found });
            }
        }
        Ok(())
    }
}

/// Refuses pointwise pairs.
fn no_pointwise(pairs: &impl Pairs, cells: usize) -> Result<(), GalerkinError> {
    for row in 0..cells {
        if pairs.pointwise(row, cells).next().is_some() {
            return Err(GalerkinError::Pointwise { row });
        }
    }
    Ok(())
}

impl<F: Real, P: Space<Scalar = F>, const B: usize> Space for SourceTable<'_, F, P, B> {
    type Scalar = F;
    type Point = P::Point;
}

impl<F: Real, P: Basis<B> + Space<Scalar = F>, const B: usize> NeighbourSource
    for SourceTable<'_, F, P, B>
{
    #[inline]
    fn source(&self, x: &Located<P::Point>, _: &mut dyn Uniforms<F>) -> F {
        small::dot(&small::block(self.values, x.cell), &self.problem.basis(x))
    }
}

impl<F: Real, P: Space<Scalar = F>, S, const B: usize> Space for PointwiseSource<'_, F, P, S, B> {
    type Scalar = F;
    type Point = P::Point;
}

impl<F, P, S, const B: usize> NeighbourSource for PointwiseSource<'_, F, P, S, B>
where
    F: Real,
    P: PairIntegral<B> + Equation<Scalar = F, Value = F>,
    S: Pairs,
{
    #[inline]
    fn source(&self, x: &Located<P::Point>, draws: &mut dyn Uniforms<F>) -> F {
        let problem = self.table.problem;
        let mut g = self.table.source(x, draws);
        for j in self.pairs.pointwise(x.cell, problem.cells()) {
            let v = small::block(self.solution, j);
            g -= small::dot(&v, &problem.pair_integral(x, j));
        }
        g
    }
}

impl<F: Real, P: Space<Scalar = F>, C, S, G, const B: usize> Space
    for Piecewise<'_, F, P, C, S, G, B>
{
    type Scalar = F;
    type Point = P::Point;
}

impl<F, P, C, S, G, const B: usize> Neighbour for Piecewise<'_, F, P, C, S, G, B>
where
    F: Real,
    P: TransitionMoments<B> + Space<Scalar = F>,
    C: Coefficients<B, Scalar = F>,
    S: Pairs,
    G: NeighbourSource<Scalar = F, Point = P::Point>,
{
    type Value = F;

    #[inline]
    fn locate(&self, x: P::Point) -> Located<P::Point> {
        Located {
            point: x,
            cell: self.problem.locate(&x),
        }
    }

    #[inline]
    fn kernel(&self, x: &Located<P::Point>, y: &Located<P::Point>, k: &F) -> F {
        match self.pairs.kind(x.cell, y.cell) {
            PairKind::Galerkin => {
                let left = self.problem.basis(x);
                let right = self.coefficients.left_times_block(x.cell, y.cell, &left);
                let c = self.problem.solve_moments(x, y.cell, right);
                small::dot(&c, &self.problem.basis(y))
            }
            PairKind::Pointwise => *k,
            PairKind::Dropped => zero(),
        }
    }

    #[inline]
    fn source(&self, x: &Located<P::Point>, draws: &mut dyn Uniforms<F>) -> F {
        self.source.source(x, draws)
    }

    #[inline]
    fn value(&self, x: &Located<P::Point>) -> F {
        small::dot(&small::block(self.solution, x.cell), &self.problem.basis(x))
    }
}
