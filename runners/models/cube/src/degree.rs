//! What takes the number of functions on a cell as a constant.

use fredholm_core::Real;
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise, Rounded, Solution};

use super::CubePartition;
use super::functions::Watched;
use super::system::{Kinds, Use};
use super::table::Table;
use fredholm_model::Error;

/// Functions on a cell of a cube, whose number the steps of walks take as a constant. It is object safe, so that all
/// else is compiled once for all degrees.
pub(super) trait Degree<F, const D: usize>: Sync {
    /// Hands out the neighbour equation with these pairs.
    fn with_neighbour(
        &self,
        of: &Of<'_, F, D>,
        kinds: &Kinds,
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error>;
}

/// Functions on a cell for walks in both scalars.
pub(super) trait AnyDegree<const D: usize>: Degree<f32, D> + Degree<f64, D> {}

impl<T: Degree<f32, D> + Degree<f64, D>, const D: usize> AnyDegree<D> for T {}

/// What a neighbour equation is made of, besides its pairs.
pub(super) struct Of<'a, F, const D: usize> {
    pub(super) cut: &'a CubePartition<'a>,
    pub(super) values: &'a Watched<'a, F>,
    pub(super) table: &'a Table<'a, D>,
    pub(super) solution: &'a Solution,
    pub(super) v: &'a [F],
}

/// Piecewise constants, with pairs of any kind.
#[derive(Debug)]
pub(super) struct Constants;

/// Polynomials of B functions on a cell, without pointwise pairs.
#[derive(Debug)]
pub(super) struct Smooth<const B: usize>;

impl<F: Real, const D: usize, const B: usize> Degree<F, D> for Smooth<B> {
    fn with_neighbour(
        &self,
        of: &Of<'_, F, D>,
        kinds: &Kinds,
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        let Kinds::Diagonal(pairs) = *kinds else {
            return Err(Error::Internal(
                "pointwise pairs are of piecewise constants",
            ));
        };
        let cube = of.values.cube::<D>(of.cut.per_axis)?;
        let (cube, narrow) = (cube.with_functions::<B>(), Rounded::new(of.table));
        let g = of.solution.source(of.table, &pairs)?;
        then(&Piecewise::new(&cube, &narrow, pairs, of.v, &g)?)
    }
}

impl<F: Real, const D: usize> Degree<F, D> for Constants {
    fn with_neighbour(
        &self,
        of: &Of<'_, F, D>,
        kinds: &Kinds,
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        if let Kinds::Diagonal(DiagonalRule {
            diagonal: PairKind::Galerkin,
        }) = kinds
        {
            return Smooth::<1>.with_neighbour(of, kinds, then);
        }
        let pairs = kinds.any();
        let (cube, narrow) = (
            of.values.cube::<D>(of.cut.per_axis)?,
            Rounded::new(of.table),
        );
        let g = of.solution.source(of.table, &pairs)?;
        then(&Piecewise::with_pointwise(&cube, &narrow, pairs, of.v, &g)?)
    }
}
