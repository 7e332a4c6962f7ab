//! What the checks need to know of the cube.

use fredholm_core::Real;
use fredholm_core::galerkin::{
    Coefficients, Dense, Pairs, Piecewise, PointwiseSource, SourceTable,
};
use fredholm_cube::{
    CellIntegral, Cube, Function, IntegralKernel, KernelFactors, Product, ProductTables, Rule,
    Solution, rounded, table,
};

use crate::quadrature::{Quadrature, gauss_legendre};

/// The absorption probability q0 of the tests.
pub const ABSORPTION: f64 = 0.2;

/// ½ exp(−|x − y|²): smooth, and a product.
#[derive(Clone, Copy, Debug)]
pub struct Gauss;

impl<F: Real> KernelFactors<F> for Gauss {
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let scale = if axis == 0 {
            F::from_f64(0.5)
        } else {
            F::one()
        };
        scale * (-(x - y) * (x - y)).exp()
    }
}

/// F = 1 + Σ_a x_a.
#[derive(Clone, Copy, Debug)]
pub struct Ramp;

impl<F: Real, const D: usize> Function<F, D> for Ramp {
    fn value(&self, x: &[F; D]) -> F {
        x.iter().fold(F::one(), |sum, &x| sum + x)
    }
}

/// A neighbour equation whose source is a table.
pub type Smooth<'a, F, const D: usize, K, S, C, P> =
    Piecewise<'a, F, Cube<F, D, K, S>, C, P, SourceTable<'a, F, Cube<F, D, K, S>>>;

/// A neighbour equation with pointwise pairs.
pub type Pointwise<'a, F, const D: usize, K, S, P> = Piecewise<
    'a,
    F,
    Cube<F, D, K, S>,
    Dense<'a, F>,
    P,
    PointwiseSource<'a, F, Cube<F, D, K, S>, P>,
>;

/// Solves on `cells` cells an axis with a table, all in f64 first. `spoil` is a relative error of
/// alternating sign in every coefficient.
///
/// # Panics
/// If there is no such cube.
pub fn with_table<F: Real, const D: usize, K, S, P, R>(
    (kernel, source): (K, S),
    cells: usize,
    pairs: P,
    spoil: f64,
    then: impl FnOnce(&Cube<F, D, K, S>, &Dense<'_, F>, &[F], &[F]) -> R,
) -> R
where
    K: IntegralKernel<f64, D> + IntegralKernel<F, D> + Copy,
    S: Function<f64, D> + Function<F, D> + Copy,
    P: Pairs,
{
    let rule = Rule::new(2).unwrap();
    let wide = Cube::<f64, D, K, S>::new(kernel, source, cells, ABSORPTION).unwrap();
    let mut entries = table(&wide, rule).unwrap();
    for (e, k) in entries.iter_mut().enumerate() {
        *k *= 1.0 + if e % 2 == 0 { spoil } else { -spoil };
    }
    let n = cells.pow(D as u32);
    let dense = Dense::new(&entries, n).unwrap();
    let solution = Solution::new(&wide, &dense, rule, 1e-15, 1000).unwrap();
    let v = solution.rounded::<F>().unwrap();
    let g = solution.source::<F, _, _>(&dense, &pairs).unwrap();
    let narrow = rounded::<F>(&entries).unwrap();
    let cube = Cube::new(kernel, source, cells, ABSORPTION).unwrap();
    then(&cube, &Dense::new(&narrow, n).unwrap(), &v, &g)
}

/// As [`with_table`], with all pairs of `pairs` in S or outside.
///
/// # Panics
/// If there is no such cube.
pub fn with_smooth<F: Real, const D: usize, K, S, P, R>(
    equation: (K, S),
    cells: usize,
    pairs: P,
    spoil: f64,
    then: impl FnOnce(&Cube<F, D, K, S>, &Smooth<'_, F, D, K, S, Dense<'_, F>, P>, &[F]) -> R,
) -> R
where
    K: IntegralKernel<f64, D> + IntegralKernel<F, D> + Copy,
    S: Function<f64, D> + Function<F, D> + Copy,
    P: Pairs + Copy,
{
    with_table(equation, cells, pairs, spoil, |cube, dense, v, g| {
        let neighbour = Piecewise::new(cube, dense, pairs, v, g).unwrap();
        then(cube, &neighbour, v)
    })
}

/// As [`with_table`], with pairs of any kind.
///
/// # Panics
/// If there is no such cube.
pub fn with_pointwise<F: Real, const D: usize, K, S, P, R>(
    equation: (K, S),
    cells: usize,
    pairs: P,
    spoil: f64,
    then: impl FnOnce(&Cube<F, D, K, S>, &Pointwise<'_, F, D, K, S, P>, &[F]) -> R,
) -> R
where
    K: IntegralKernel<f64, D> + CellIntegral<F, D> + Copy,
    S: Function<f64, D> + Function<F, D> + Copy,
    P: Pairs + Copy,
{
    with_table(equation, cells, pairs, spoil, |cube, dense, v, g| {
        let neighbour = Piecewise::with_pointwise(cube, dense, pairs, v, g).unwrap();
        then(cube, &neighbour, v)
    })
}

/// A product kernel by one-dimensional tables, all pairs in S.
///
/// # Panics
/// If there is no such cube.
pub fn with_product<F: Real, const D: usize, T, S, P, R>(
    (factors, source): (T, S),
    cells: usize,
    pairs: P,
    then: impl FnOnce(
        &Cube<F, D, Product<T>, S>,
        &Smooth<'_, F, D, Product<T>, S, ProductTables<F, D>, P>,
        &[F],
    ) -> R,
) -> R
where
    T: KernelFactors<f64> + KernelFactors<F> + Copy,
    S: Function<f64, D> + Function<F, D> + Copy,
    P: Pairs + Copy,
{
    let rule = Rule::new(2).unwrap();
    let kernel = Product(factors);
    let wide = Cube::<f64, D, _, _>::new(kernel, source, cells, ABSORPTION).unwrap();
    let tables = ProductTables::new(&wide, rule).unwrap();
    let solution = Solution::new(&wide, &tables, rule, 1e-15, 1000).unwrap();
    let v = solution.rounded::<F>().unwrap();
    let g = solution.source::<F, _, _>(&tables, &pairs).unwrap();
    let narrow = tables.rounded::<F>().unwrap();
    let cube = Cube::new(kernel, source, cells, ABSORPTION).unwrap();
    assert_eq!(narrow.cells(), v.len());
    let neighbour = Piecewise::new(&cube, &narrow, pairs, &v, &g).unwrap();
    then(&cube, &neighbour, &v)
}

impl<F, const D: usize, K, S> Quadrature for Cube<F, D, K, S>
where
    F: Real,
    K: IntegralKernel<F, D>,
    S: Function<F, D>,
{
    fn nodes(&self, x: &[F; D], j: usize) -> Vec<([F; D], f64)> {
        let (low, high) = self.cell_box(j);
        // Fewer points where there are more axes: the tests use small cells there.
        let rule = gauss_legendre(match D {
            1 => 16,
            2 => 12,
            _ => 8,
        });
        // K(x, ·) may have a kink where a coordinate is that of x.
        let mut nodes = vec![([F::zero(); D], 1.0)];
        for a in 0..D {
            let [from, to] = [low[a], high[a]].map(Real::to_f64);
            let kink = x[a].to_f64().max(from).min(to);
            let mut more = Vec::new();
            for (left, right) in [(from, kink), (kink, to)] {
                for &(t, w) in rule.iter().filter(|_| left < right) {
                    for &(mut y, weight) in &nodes {
                        y[a] = F::from_f64(left + t * (right - left));
                        more.push((y, weight * w * (right - left)));
                    }
                }
            }
            nodes = more;
        }
        nodes
    }

    fn inside(&self, j: usize, t: f64) -> [F; D] {
        let (low, high) = self.cell_box(j);
        // Not on a diagonal of the cell.
        core::array::from_fn(|a| {
            let t = t.powi(a as i32 + 1);
            F::from_f64(low[a].to_f64() + t * (high[a].to_f64() - low[a].to_f64()))
        })
    }
}
