//! What takes the number of functions on a cell as a constant.

use std::borrow::Cow;

use fredholm_core::Real;
use fredholm_core::galerkin::{DiagonalRule, PairKind, Piecewise, Rounded, Solution};
use fredholm_cube::{CellFunctions, ExactSource};

use super::CubePartition;
use super::exact::Moments;
use super::functions::Watched;
use super::system::{Boxed, Kinds, Use};
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

/// Functions on a cell for walks in both scalars, and for set-ups.
pub(super) trait AnyDegree<const D: usize>: Degree<f32, D> + Degree<f64, D> {
    /// The functions, their number known at run time.
    fn functions(&self) -> CellFunctions<D>;
}

/// What a neighbour equation is made of, besides its pairs.
pub(super) struct Of<'a, F, const D: usize> {
    pub(super) cut: &'a CubePartition<'a>,
    pub(super) values: &'a Watched<'a, F>,
    pub(super) absorption: f64,
    pub(super) table: &'a Table<'a, D>,
    pub(super) solution: &'a Solution,
    /// The moments of F, if the source is F itself.
    pub(super) moments: Option<&'a Moments>,
    pub(super) v: &'a [F],
}

/// Piecewise constants, with pairs of any kind.
#[derive(Debug)]
pub(super) struct Constants;

/// Polynomials of B functions on a cell, without pointwise pairs.
#[derive(Debug)]
pub(super) struct Smooth<const B: usize>;

impl<const D: usize, const B: usize> AnyDegree<D> for Smooth<B> {
    fn functions(&self) -> CellFunctions<D> {
        CellFunctions::new::<B>()
    }
}

impl<const D: usize> AnyDegree<D> for Constants {
    fn functions(&self) -> CellFunctions<D> {
        CellFunctions::new::<1>()
    }
}

impl<F: Real, const D: usize, const B: usize> Degree<F, D> for Smooth<B> {
    fn with_neighbour(
        &self,
        of: &Of<'_, F, D>,
        kinds: &Kinds,
        then: &mut Use<'_, F, D>,
    ) -> Result<(), Error> {
        let vectors = Vectors::new(of, kinds)?;
        let cube = of.values.cube::<D>(of.cut.per_axis, of.absorption)?;
        let cube = cube.with_functions::<B>();
        let narrow = Rounded::new(of.table);
        let Vectors { pairs, v, g } = &vectors;
        of.hand_on(&Piecewise::new(&cube, &narrow, *pairs, v, g)?, then)
    }
}

/// The pairs of a neighbour equation without pointwise ones, and its v and G: w and R if the source is F itself.
struct Vectors<'a, F: Real> {
    pairs: DiagonalRule,
    v: Cow<'a, [F]>,
    g: Vec<F>,
}

impl<'a, F: Real> Vectors<'a, F> {
    fn new<const D: usize>(of: &Of<'a, F, D>, kinds: &Kinds) -> Result<Self, Error> {
        let Kinds::Diagonal(pairs) = *kinds else {
            return Err(Error::Internal(
                "pointwise pairs are of piecewise constants",
            ));
        };
        let (v, g) = match of.moments {
            None => (of.v.into(), of.solution.source(of.table, &pairs)?),
            Some(moments) => {
                let [w, r] = exact::<F, D>(of.table, of.solution, moments, &pairs)?;
                (w.into(), r)
            }
        };
        Ok(Self { pairs, v, g })
    }
}

impl<F: Real, const D: usize> Of<'_, F, D> {
    /// Hands on a neighbour equation, with the source F itself if that is asked for.
    fn hand_on(&self, neighbour: &Boxed<'_, F, D>, then: &mut Use<'_, F, D>) -> Result<(), Error> {
        if self.moments.is_none() {
            return then(neighbour);
        }
        let cube = self.values.cube::<D>(self.cut.per_axis, self.absorption)?;
        then(&ExactSource {
            rest: neighbour,
            source: cube.right_hand_side(),
        })
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
        let pairs = kinds.any(of.cut.all_cells())?;
        let cube = of.values.cube::<D>(of.cut.per_axis, of.absorption)?;
        let narrow = Rounded::new(of.table);
        let g = of.solution.source(of.table, &pairs)?;
        then(&Piecewise::with_pointwise(&cube, &narrow, pairs, of.v, &g)?)
    }
}

/// w = V − F″ in the scalar of walks, and R = G_V − F″ for the V that is F″ + w then.
fn exact<F: Real, const D: usize>(
    table: &Table<'_, D>,
    solution: &Solution,
    moments: &Moments,
    pairs: &DiagonalRule,
) -> Result<[Vec<F>; 2], Error> {
    let rest = |of: &[f64]| -> Vec<F> { moments.rest(of).map(F::from_f64).collect() };
    let w = rest(&solution.v);
    let through = w.iter().zip(&moments.means);
    let through = Solution {
        v: through.map(|(w, mean)| w.to_f64() + mean).collect(),
        ..solution.clone()
    };
    let r = rest(&through.source::<f64>(table, pairs)?);
    Ok([w, r])
}
