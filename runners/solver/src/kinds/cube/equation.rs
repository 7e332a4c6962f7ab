//! The equation of a cube, and its polynomials.

use std::sync::Arc;

use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Basis, Cells, Coefficients, Rounded, TransitionMoments};
use fredholm_core::global::Stationary;
use fredholm_core::{Chain, Density, Equation, Located, Real, Space, Uniforms};
use fredholm_cube::{Cube, CubeRule, KernelFactors, ProductTables, polynomials};

use super::values::{Kernel, Source, Values};
use crate::custom::{Closed, Degree, IN_S, Kinds, Nodes, Of, OnCells, Smooth, Use, grid_levels};
use crate::{CustomModel, Error, Subject};

/// The equation on [0, 1]^D of functions that are chosen at run time.
pub(super) struct CubeEquation<F, const D: usize> {
    cube: Cube<F, D, Kernel<F>, Source<F>>,
    /// 1/n.
    mass: F,
}

impl<F: Real, const D: usize> CubeEquation<F, D> {
    /// The equation with so many cells of an axis.
    pub(super) fn new(values: &Arc<Values<F>>, per_axis: usize) -> Result<Self, Error> {
        let (kernel, source) = (Kernel(values.clone()), Source(values.clone()));
        match Cube::new(kernel, source, per_axis) {
            Ok(cube) if cube.cells() <= MOST_CELLS => Ok(Self {
                mass: F::from_f64(cube.measure(0)),
                cube,
            }),
            _ => Err(Error::Option {
                subject: Subject::Cells,
                message: format!(
                    "{per_axis} cells per axis in {D} dimensions: at least 1 is needed, and at most {MOST_CELLS} in all"
                ),
            }),
        }
    }
}

impl<F: Real, const D: usize> Space for CubeEquation<F, D> {
    type Scalar = F;
    type Point = [F; D];
}

impl<F: Real, const D: usize> Chain for CubeEquation<F, D> {
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &[F; D], uniforms: &mut U) -> Option<[F; D]> {
        self.cube.step(x, uniforms)
    }
}

impl<F: Real, const D: usize> Density for CubeEquation<F, D> {
    #[inline]
    fn density(&self, x: &[F; D], y: &[F; D]) -> F {
        self.cube.density(x, y)
    }
}

impl<F: Real, const D: usize> Equation for CubeEquation<F, D> {
    type Value = F;

    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        self.cube.kernel(x, y)
    }

    #[inline]
    fn source<U: Uniforms<F>>(&self, x: &[F; D], uniforms: &mut U) -> F {
        self.cube.source(x, uniforms)
    }
}

impl<F: Real, const D: usize> Stationary for CubeEquation<F, D> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> [F; D] {
        self.cube.start(uniforms)
    }

    #[inline]
    fn start_density(&self, x: &[F; D]) -> f64 {
        self.cube.start_density(x)
    }

    fn is_preserved(&self) -> bool {
        self.cube.is_preserved()
    }
}

impl<F: Real, const D: usize> Cells for CubeEquation<F, D> {
    const DIMENSION: usize = D;

    fn cells(&self) -> usize {
        self.cube.cells()
    }

    #[inline]
    fn locate(&self, x: &[F; D]) -> usize {
        self.cube.locate(x)
    }

    fn measure(&self, cell: usize) -> f64 {
        self.cube.measure(cell)
    }

    #[inline]
    fn point(&self, cell: usize, t: &[f64]) -> [F; D] {
        self.cube.point(cell, t)
    }

    #[inline]
    fn parameters(&self, x: &Located<[F; D]>, t: &mut [F]) {
        self.cube.parameters(x, t);
    }

    /// Coordinates are those of the domain.
    fn at(&self, coordinates: &[f64]) -> Option<[F; D]> {
        let domain = &self.cube.integral_kernel().0.domain;
        self.cube.at(&domain.unit::<D>(coordinates)?)
    }
}

impl<F: Real, const D: usize, const B: usize> Basis<B> for CubeEquation<F, D> {
    #[inline]
    fn basis(&self, x: &Located<[F; D]>) -> [F; B] {
        let mut t = [F::zero(); D];
        self.cube.parameters(x, &mut t);
        polynomials(&t)
    }
}

impl<F: Real, const D: usize, const B: usize> TransitionMoments<B> for CubeEquation<F, D> {
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

/// Polynomials of B functions on a cell with a kernel that is a product, whose coefficients are those of its factors.
struct OfProduct<const D: usize, const B: usize>;

/// The most cells in all.
const MOST_CELLS: usize = 100_000_000;

/// The factors of a kernel in double precision.
struct Wide<'a, F>(&'a Kernel<F>);

impl<F: Real> KernelFactors<f64> for Wide<'_, F> {
    fn factor(&self, axis: usize, x: f64, y: f64) -> f64 {
        let [x, y] = [x, y].map(F::from_f64);
        self.0.factor(axis, x, y).to_f64()
    }
}

impl<const D: usize, const B: usize> OfProduct<D, B> {
    const DEGREE: usize = fredholm_core::galerkin::degree_of(D, B);

    fn tables(per_axis: usize, entries: &[f64]) -> Result<ProductTables<&[f64], D>, Error> {
        Ok(ProductTables::new(per_axis, Self::DEGREE, entries)?)
    }
}

impl<F: Real, const D: usize, const B: usize> Degree<CubeEquation<F, D>> for OfProduct<D, B>
where
    for<'e> ProductTables<&'e [f64], D>: Coefficients<B, Scalar = f64>,
{
    fn functions(&self) -> usize {
        B
    }

    fn stored(&self, cells: usize) -> Option<usize> {
        let width = per_axis(cells, D).checked_mul(Self::DEGREE + 1)?;
        width.checked_mul(width)?.checked_mul(D)
    }

    fn evaluations(&self, cells: usize, points: f64) -> f64 {
        // A value of the kernel is one of each factor.
        let of_axis = per_axis(cells, D) as f64 * points.powf(1.0 / D as f64);
        of_axis.powi(2)
    }

    fn entries(&self, cube: &CubeEquation<F, D>, points: usize) -> Result<Vec<f64>, Error> {
        let nothing = |_: &[f64; D], _: &[f64; D]| 0.0;
        let mesh = Cube::<f64, D, _, _>::new(nothing, |_: &[f64; D]| 0.0, cube.cube.per_axis())?;
        let rule = CubeRule::new(&mesh, Self::DEGREE, points)?;
        let tables = rule.product_tables(&Wide(cube.cube.integral_kernel()))?;
        Ok(tables.entries().to_vec())
    }

    fn matrix<'e>(
        &self,
        cube: &'e CubeEquation<F, D>,
        entries: &'e [f64],
    ) -> Result<Closed<'e>, Error> {
        Ok(Box::new(Self::tables(cube.cube.per_axis(), entries)?))
    }

    fn on_cells(&self) -> &dyn OnCells<CubeEquation<F, D>> {
        &Smooth::<B>
    }

    fn with_neighbour(
        &self,
        of: &Of<'_, CubeEquation<F, D>>,
        _: Kinds,
        then: &mut Use<'_, CubeEquation<F, D>>,
    ) -> Result<(), Error> {
        let tables = Self::tables(of.equation.cube.per_axis(), of.entries)?;
        let vectors = of.solution.for_walks(&tables, IN_S)?;
        let rounded = Rounded::new(&tables);
        let neighbour: fredholm_core::galerkin::Piecewise<'_, _, _, _, _, _, B> =
            vectors.piecewise(of.equation, &rounded)?;
        then(&neighbour, vectors.v())
    }

    fn neighbour_radius(
        &self,
        of: &Of<'_, CubeEquation<F, D>>,
        nodes: &Nodes<[F; D]>,
        kinds: Kinds,
    ) -> Result<f64, Error> {
        let tables = Self::tables(of.equation.cube.per_axis(), of.entries)?;
        crate::custom::squared_radius::<_, _, B>(of.equation, &tables, nodes, &kinds.any(IN_S))
    }
}

/// m of m^d cells.
fn per_axis(cells: usize, dimension: usize) -> usize {
    (cells as f64).powf(1.0 / dimension as f64).round() as usize
}

/// Adds the degree with B functions on a cell, by factors where the kernel is a product.
pub(super) fn with<F: Real, const D: usize, const B: usize>(
    model: CustomModel<CubeEquation<F, D>>,
    is_product: bool,
) -> CustomModel<CubeEquation<F, D>> {
    // In one dimension every kernel is its only factor.
    match is_product && const { D > 1 } {
        true => model.with_degree(OfProduct::<D, B>),
        false => model.with_degree(Smooth::<B>),
    }
}

/// The equation of values on a cube of D dimensions, without any degree.
pub(super) fn base<F: Real, const D: usize>(
    values: &Arc<Values<F>>,
) -> CustomModel<CubeEquation<F, D>> {
    let own = values.clone();
    CustomModel::with_own_starts(move |per_axis| CubeEquation::new(&own, per_axis))
        .without_degrees()
        .with_levels(grid_levels(D))
}

/// An expression with the equation on a cube, with all its degrees.
macro_rules! with_degrees {
    ($d:literal, $values:expr, [$($p:literal)*]) => {{
        let values = $values;
        let model = base::<_, $d>(values);
        $(let model = with::<_, $d, { fredholm_core::galerkin::functions($d, $p) }>(model, values.is_product);)*
        model
    }};
}
pub(super) use with_degrees;
