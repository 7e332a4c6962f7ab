//! Equations that are given by kernel and source alone.

use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::global::Stationary;
use fredholm_core::resolvent::{Grid, Regular};
use fredholm_core::{Chain, Density, Equation, Located, Space, Uniforms};

use super::cells::{MOST_DIMENSIONS, Shares};
use super::{CustomModel, Error};

/// Numbers of cells of an axis to choose from, by the dimension.
const LEVELS: [&[usize]; MOST_DIMENSIONS] = [
    &[
        1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 1024,
    ],
    &[1, 2, 3, 4, 6, 8, 12, 16, 24, 32],
    &[1, 2, 3, 4, 5, 6, 8, 10],
    &[1, 2, 3, 4, 5],
    &[1, 2, 3, 4],
    &[1, 2, 3],
];

/// The numbers of cells of an axis of grids in so many dimensions.
pub(crate) const fn grid_levels(dimension: usize) -> &'static [usize] {
    LEVELS[dimension - 1]
}

/// Equation of a kernel and a source whose chain jumps to a uniform point, whatever x is: k = K μ(X).
///
/// ```
/// use fredholm::{CustomModel, Uniformly};
/// use fredholm_core::resolvent::{Grid, Regular};
///
/// /// The model of any equation that is given by kernel and source.
/// fn model<E>(equation: E) -> CustomModel<Uniformly<Grid<E>>>
/// where
///     E: Regular<Scalar = f64, Point: Send + Sync> + Clone + Send + Sync + 'static,
/// {
///     CustomModel::from_kernel(equation)
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Uniformly<E> {
    equation: E,
    shares: Shares,
}

impl<E: Cells> Uniformly<E> {
    /// The equation with this chain.
    pub(super) fn new(equation: E) -> Self {
        Self {
            shares: Shares::new(&equation),
            equation,
        }
    }
}

impl<E: Space> Space for Uniformly<E> {
    type Scalar = E::Scalar;
    type Point = E::Point;
}

impl<E: Cells> Chain for Uniformly<E> {
    #[inline]
    fn step<U: Uniforms<E::Scalar>>(&self, _: &E::Point, uniforms: &mut U) -> Option<E::Point> {
        Some(self.shares.draw(&self.equation, uniforms))
    }
}

impl<E: Cells> Density for Uniformly<E> {
    #[inline]
    fn density(&self, _: &E::Point, _: &E::Point) -> E::Scalar {
        fredholm_core::Real::from_f64(1.0 / self.shares.measure)
    }
}

impl<E: Regular> Equation for Uniformly<E> {
    type Value = E::Scalar;

    #[inline]
    fn kernel(&self, x: &E::Point, y: &E::Point) -> E::Scalar {
        let measure: E::Scalar = fredholm_core::Real::from_f64(self.shares.measure);
        self.equation.kernel(x, y) * measure
    }

    #[inline]
    fn source<U: Uniforms<E::Scalar>>(&self, x: &E::Point, _: &mut U) -> E::Scalar {
        self.equation.source(x)
    }
}

/// Every state is uniform, whatever the start.
impl<E: Regular> Stationary for Uniformly<E> {
    #[inline]
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> E::Point {
        self.shares.draw(&self.equation, uniforms)
    }

    #[inline]
    fn start_density(&self, _: &E::Point) -> f64 {
        1.0 / self.shares.measure
    }

    fn is_preserved(&self) -> bool {
        true
    }
}

impl<E: Cells> Cells for Uniformly<E> {
    const DIMENSION: usize = E::DIMENSION;

    fn cells(&self) -> usize {
        self.equation.cells()
    }

    #[inline]
    fn locate(&self, x: &E::Point) -> usize {
        self.equation.locate(x)
    }

    fn measure(&self, cell: usize) -> f64 {
        self.equation.measure(cell)
    }

    #[inline]
    fn point(&self, cell: usize, t: &[f64]) -> E::Point {
        self.equation.point(cell, t)
    }

    #[inline]
    fn parameters(&self, x: &Located<E::Point>, t: &mut [E::Scalar]) {
        self.equation.parameters(x, t);
    }

    fn at(&self, coordinates: &[f64]) -> Option<E::Point> {
        self.equation.at(coordinates)
    }

    #[inline]
    fn copies(&self) -> usize {
        self.equation.copies()
    }
}

impl<E: Cells, const B: usize> Basis<B> for Uniformly<E> {}

impl<E: Cells, const B: usize> TransitionMoments<B> for Uniformly<E> {
    /// The cell's share of the space times the identity.
    fn moments(&self, _: &Located<E::Point>, j: usize) -> [[E::Scalar; B]; B] {
        let share = self.equation.measure(j) / self.shares.measure;
        let entry = |is_own| if is_own { share } else { 0.0 };
        core::array::from_fn(|a| {
            core::array::from_fn(|b| fredholm_core::Real::from_f64(entry(a == b)))
        })
    }
}

impl<E> CustomModel<Uniformly<Grid<E>>>
where
    E: Regular<Point: Send + Sync> + Clone + Send + Sync + 'static,
{
    /// Model of an equation by its kernel and its source, on a space that is the image of one cube, or of a few: in one cell for each, which the model cuts.
    ///
    /// No chain is asked for, and no norm: resolvent walks solve it up to four dimensions. With more, or where its chain is asked for, walks
    /// jump to uniform points.
    ///
    /// ```
    /// use fredholm::{CustomModel, Solver};
    /// use fredholm_core::galerkin::Cells;
    /// use fredholm_core::resolvent::Regular;
    /// use fredholm_core::{Located, Space};
    ///
    /// /// u(x) = ∫ 3 u(y) dy + x on [0, 2]: u = x − 6/5.
    /// #[derive(Clone)]
    /// struct Mine;
    ///
    /// impl Space for Mine {
    ///     type Scalar = f64;
    ///     type Point = f64;
    /// }
    /// impl Cells for Mine {
    ///     const DIMENSION: usize = 1;
    ///     fn cells(&self) -> usize { 1 }
    ///     fn locate(&self, _: &f64) -> usize { 0 }
    ///     fn measure(&self, _: usize) -> f64 { 2.0 }
    ///     fn point(&self, _: usize, t: &[f64]) -> f64 { 2.0 * t[0] }
    ///     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) { t[0] = 0.5 * x.point }
    ///     fn at(&self, x: &[f64]) -> Option<f64> { x.first().copied().filter(|x| (0.0..=2.0).contains(x)) }
    /// }
    /// impl Regular for Mine {
    ///     fn kernel(&self, _: &f64, _: &f64) -> f64 { 3.0 }
    ///     fn source(&self, x: &f64) -> f64 { *x }
    /// }
    ///
    /// let u = CustomModel::from_kernel(Mine);
    /// let report = Solver::new(&u).at(0.5).solve_to(1e-9)?;
    /// assert!((report.goals[0].preconditioned.estimate.unwrap() + 0.7).abs() < 1e-8);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn from_kernel(equation: E) -> Self {
        let build = move |cells: usize| -> Result<_, Error> {
            Ok(Uniformly::new(Grid::new(equation.clone(), &[], cells)))
        };
        let model = Self::with_own_starts(build).with_levels(grid_levels(E::DIMENSION));
        // Degrees 1 and 2.
        match E::DIMENSION {
            1 => model.with_functions::<2>().with_functions::<3>(),
            2 => model.with_functions::<3>().with_functions::<6>(),
            3 => model.with_functions::<4>().with_functions::<10>(),
            _ => model,
        }
    }
}
