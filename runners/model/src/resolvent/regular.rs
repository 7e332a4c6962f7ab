//! Equations by kernel and source, of a type that is known at run time only, and what is asked of them.

use std::sync::Arc;

use fredholm_core::galerkin::{Cells, MOST_DIMENSIONS};
use fredholm_core::resolvent::Regular;
use fredholm_core::{Density, Equation, Located, NoDraws, Space};

use crate::{Error, Region};

/// The most coordinates that a point keeps; of more it keeps its parameters.
const MOST_COORDINATES: usize = 8;

/// A weight w, for ∫ w u dμ.
pub type PointWeight<'a, P> = Box<dyn Fn(&P) -> f64 + Sync + 'a>;

/// A functional that is asked for.
pub(super) enum Functional<'a> {
    /// The value at a point.
    Point(AnyPoint),
    /// The mean over the whole space.
    Mean,
    /// ∫ w u dμ.
    Weight(PointWeight<'a, AnyPoint>),
}

/// Point of an [`AnyRegular`]. That of its own type is made anew wherever it has a value: the same one, bit for bit.
#[derive(Clone, Copy, Debug)]
pub enum AnyPoint {
    /// The point of a cell at these parameters.
    Cell {
        /// The number of the cell.
        cell: usize,
        /// The parameters, and zeros.
        t: [f64; MOST_DIMENSIONS],
    },
    /// The point with these coordinates.
    Coordinates {
        /// The coordinates, and zeros.
        all: [f64; MOST_COORDINATES],
        /// Their number.
        count: usize,
    },
}

/// Equation of a chain by its kernel K = k p and its source, whatever its type: set-ups and walks are compiled once for all of them.
///
/// ```
/// use fredholm_core::galerkin::Cells;
/// use fredholm_core::resolvent::Regular;
/// use fredholm_core::{Density, Equation, Located, Space, Uniforms};
/// use fredholm_model::resolvent::AnyRegular;
/// # use fredholm_core::Chain;
///
/// /// u(x) = ∫₀² 3 x u(y) dy + 1, whose chain jumps to uniform points: p = 1/2, k = 6 x.
/// struct Mine;
///
/// impl Density for Mine {
///     fn density(&self, _: &f64, _: &f64) -> f64 { 0.5 }
/// }
/// impl Equation for Mine {
///     type Value = f64;
///     fn kernel(&self, x: &f64, _: &f64) -> f64 { 6.0 * x }
///     fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 { 1.0 }
/// }
/// # impl Space for Mine {
/// #     type Scalar = f64;
/// #     type Point = f64;
/// # }
/// # impl Chain for Mine {
/// #     fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> { Some(2.0 * uniforms.uniform()) }
/// # }
/// # impl Cells for Mine {
/// #     const DIMENSION: usize = 1;
/// #     fn cells(&self) -> usize { 1 }
/// #     fn locate(&self, _: &f64) -> usize { 0 }
/// #     fn measure(&self, _: usize) -> f64 { 2.0 }
/// #     fn point(&self, _: usize, t: &[f64]) -> f64 { 2.0 * t[0] }
/// #     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) { t[0] = 0.5 * x.point }
/// #     fn at(&self, x: &[f64]) -> Option<f64> { x.first().copied() }
/// # }
/// let any = AnyRegular::new(Mine, |_| unreachable!("no weight is asked for"));
/// // The point of parameter 1/2, and that of coordinate 2.
/// let (x, y) = (any.point(0, &[0.5]), any.at(&[2.0]).unwrap());
/// assert_eq!((any.kernel(&x, &y), any.kernel(&y, &x)), (3.0, 6.0));
/// ```
#[derive(Clone)]
pub struct AnyRegular<'k> {
    typed: Arc<dyn Typed + 'k>,
    dimension: usize,
}

impl core::fmt::Debug for AnyRegular<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("AnyRegular")
            .field("dimension", &self.dimension)
            .finish_non_exhaustive()
    }
}

impl<'k> AnyRegular<'k> {
    /// An equation, with the weights of regions that are neither points nor all of the space.
    pub fn new<E>(
        equation: E,
        weights: impl Fn(&Region) -> Result<PointWeight<'k, E::Point>, Error> + Send + Sync + 'k,
    ) -> Self
    where
        E: Cells<Scalar = f64> + Density + Equation<Value = f64> + Send + Sync + 'k,
    {
        let weights = Box::new(weights);
        Self {
            typed: Arc::new(WithWeights { equation, weights }),
            dimension: E::DIMENSION,
        }
    }

    /// What a region asks for.
    pub(super) fn functional(&self, region: &Region) -> Result<Functional<'_>, Error> {
        Ok(match region {
            Region::Whole => Functional::Mean,
            Region::Point(coordinates) => Functional::Point(self.at(coordinates).ok_or_else(|| {
                Error::Region {
                    message: format!(
                        "the equation has no point with the coordinates {coordinates:?}: see its `Cells::at`"
                    ),
                }
            })?),
            _ => Functional::Weight(self.typed.weight(region)?),
        })
    }
}

impl Space for AnyRegular<'_> {
    type Scalar = f64;
    type Point = AnyPoint;
}

impl Cells for AnyRegular<'_> {
    const DIMENSION: usize = MOST_DIMENSIONS;

    fn cells(&self) -> usize {
        self.typed.cells()
    }

    fn locate(&self, x: &AnyPoint) -> usize {
        self.typed.locate(x)
    }

    fn measure(&self, cell: usize) -> f64 {
        self.typed.measure(cell)
    }

    #[inline]
    fn point(&self, cell: usize, own: &[f64]) -> AnyPoint {
        let mut t = [0.0; MOST_DIMENSIONS];
        t.iter_mut().zip(own).for_each(|(t, own)| *t = *own);
        AnyPoint::Cell { cell, t }
    }

    fn parameters(&self, x: &Located<AnyPoint>, t: &mut [f64]) {
        self.typed.parameters(x, t);
    }

    fn at(&self, coordinates: &[f64]) -> Option<AnyPoint> {
        self.typed.at(coordinates)
    }

    fn copies(&self) -> usize {
        self.typed.copies()
    }
}

impl Regular for AnyRegular<'_> {
    #[inline]
    fn kernel(&self, x: &AnyPoint, y: &AnyPoint) -> f64 {
        self.typed.kernel(x, y)
    }

    #[inline]
    fn source(&self, x: &AnyPoint) -> f64 {
        self.typed.source(x)
    }

    #[inline]
    fn dimension(&self) -> usize {
        self.dimension
    }
}

/// What only the type of an equation knows.
trait Typed: Send + Sync {
    fn cells(&self) -> usize;
    fn copies(&self) -> usize;
    fn locate(&self, x: &AnyPoint) -> usize;
    fn measure(&self, cell: usize) -> f64;
    fn parameters(&self, x: &Located<AnyPoint>, t: &mut [f64]);
    fn at(&self, coordinates: &[f64]) -> Option<AnyPoint>;
    fn kernel(&self, x: &AnyPoint, y: &AnyPoint) -> f64;
    fn source(&self, x: &AnyPoint) -> f64;
    fn weight(&self, region: &Region) -> Result<PointWeight<'_, AnyPoint>, Error>;
}

/// The weights of regions.
type Weights<'k, P> = dyn Fn(&Region) -> Result<PointWeight<'k, P>, Error> + Send + Sync + 'k;

struct WithWeights<'k, E: Space> {
    equation: E,
    weights: Box<Weights<'k, E::Point>>,
}

impl<E: Cells<Scalar = f64>> WithWeights<'_, E> {
    #[inline]
    fn own(&self, x: &AnyPoint) -> E::Point {
        let middle = [0.5; MOST_DIMENSIONS];
        let (cell, t) = match x {
            AnyPoint::Cell { cell, t } => (*cell, t),
            AnyPoint::Coordinates { all, count } => {
                if let Some(own) = self.equation.at(all.get(..*count).unwrap_or(all)) {
                    return own;
                }
                // No such point is ever made.
                (0, &middle)
            }
        };
        self.equation
            .point(cell, t.get(..E::DIMENSION).unwrap_or(t))
    }
}

impl<E> Typed for WithWeights<'_, E>
where
    E: Cells<Scalar = f64> + Density + Equation<Value = f64> + Send + Sync,
{
    fn cells(&self) -> usize {
        self.equation.cells()
    }

    fn copies(&self) -> usize {
        self.equation.copies()
    }

    fn locate(&self, x: &AnyPoint) -> usize {
        self.equation.locate(&self.own(x))
    }

    fn measure(&self, cell: usize) -> f64 {
        self.equation.measure(cell)
    }

    fn parameters(&self, x: &Located<AnyPoint>, t: &mut [f64]) {
        let (point, cell) = (self.own(&x.point), x.cell);
        self.equation.parameters(&Located { point, cell }, t);
    }

    fn at(&self, coordinates: &[f64]) -> Option<AnyPoint> {
        let point = self.equation.at(coordinates)?;
        let mut all = [0.0; MOST_COORDINATES];
        let count = coordinates.len();
        if let Some(own) = all.get_mut(..count) {
            own.copy_from_slice(coordinates);
            return Some(AnyPoint::Coordinates { all, count });
        }
        let cell = self.equation.locate(&point);
        let mut t = [0.0; MOST_DIMENSIONS];
        let own = t.get_mut(..E::DIMENSION)?;
        self.equation.parameters(&Located { point, cell }, own);
        Some(AnyPoint::Cell { cell, t })
    }

    fn kernel(&self, x: &AnyPoint, y: &AnyPoint) -> f64 {
        let [x, y] = [x, y].map(|x| self.own(x));
        self.equation.kernel(&x, &y) * self.equation.density(&x, &y)
    }

    fn source(&self, x: &AnyPoint) -> f64 {
        self.equation.source(&self.own(x), &mut NoDraws)
    }

    fn weight(&self, region: &Region) -> Result<PointWeight<'_, AnyPoint>, Error> {
        let weight = (self.weights)(region)?;
        Ok(Box::new(move |x| weight(&self.own(x))))
    }
}
