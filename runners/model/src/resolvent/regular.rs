//! Equations by kernel and source, and what is asked of them.

use fredholm_core::galerkin::Cells;
use fredholm_core::resolvent::Regular;
use fredholm_core::{Density, Equation, Located, Space};

use crate::{Error, Region};

/// The equation of a chain as one of kernel and source, K = k p.
#[derive(Clone, Copy, Debug)]
pub struct ByDensity<E>(pub E);

impl<E: Space> Space for ByDensity<E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: Cells> Cells for ByDensity<E> {
    const DIMENSION: usize = E::DIMENSION;

    fn cells(&self) -> usize {
        self.0.cells()
    }

    fn locate(&self, x: &E::Point) -> usize {
        self.0.locate(x)
    }

    fn measure(&self, cell: usize) -> f64 {
        self.0.measure(cell)
    }

    #[inline]
    fn point(&self, cell: usize, t: &[f64]) -> E::Point {
        self.0.point(cell, t)
    }

    fn parameters(&self, x: &Located<E::Point>, t: &mut [E::Scalar]) {
        self.0.parameters(x, t);
    }

    fn at(&self, coordinates: &[f64]) -> Option<E::Point> {
        self.0.at(coordinates)
    }

    #[inline]
    fn copies(&self) -> usize {
        self.0.copies()
    }
}

impl<E> Regular for ByDensity<E>
where
    E: Cells + Density + Equation<Value = <E as Space>::Scalar>,
{
    #[inline]
    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        self.0.kernel(x, y) * self.0.density(x, y)
    }

    #[inline]
    fn source(&self, x: &E::Point) -> E::Scalar {
        self.0.source(x, &mut fredholm_core::NoDraws)
    }
}

/// A functional in points of the equation.
pub enum Functional<'a, P> {
    /// The value at a point.
    Point(P),
    /// The mean over the whole space.
    Mean,
    /// ∫ w u dμ.
    Weight(Box<dyn Fn(&P) -> f64 + Sync + 'a>),
}

impl<P> core::fmt::Debug for Functional<'_, P> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Point(_) => "Point",
            Self::Mean => "Mean",
            Self::Weight(_) => "Weight",
        })
    }
}

/// A kind of equation that resolvent walks solve.
pub trait RegularKind<E: Regular>: Sync {
    /// What a region asks for.
    ///
    /// # Errors
    /// [`Error::Region`].
    fn functional<'s>(
        &'s self,
        equation: &E,
        region: &Region,
    ) -> Result<Functional<'s, E::Point>, Error>;
}
