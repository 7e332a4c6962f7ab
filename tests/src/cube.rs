//! What the checks need to know of the cube.

use fredholm_core::galerkin::{
    AllPointwise, Cells, Dense, DiagonalRule, GalerkinMatrix, PairKind, Pairs, Piecewise,
    PointwiseSource, Rounded, Solution, SourceTable, rounded,
};
use fredholm_core::{
    Equation, Functional, Goal, Goals, Located, NeighbourOf, Real, Statistics, WalkOptions,
};
use fredholm_cube::{
    Cube, CubeRule, KernelFactors, KernelFn, KernelIntegral, Product, ProductTables, ScalarField,
};
use model::{Model, ModelKernel};

use crate::check;
use crate::description::Description;
use crate::examine::examine_both;
use crate::offers::{Neighbours, Offers};
use crate::quadrature::{gauss_legendre, split, tensor};
use crate::report::Report;

pub mod model;

/// All pairs in S.
pub const ALL: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Galerkin,
};
/// The diagonal pointwise.
pub const POINTWISE: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Pointwise,
};
/// The diagonal left out.
pub const OUTSIDE: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Dropped,
};

/// Every model problem, with walks of finite variance in one dimension, also at q0 = 0.2.
#[must_use]
pub fn models() -> [Model; 10] {
    [
        model::quadratic(0.6),
        model::rational(0.9),
        model::quartic(2.5, 0.5),
        model::distance(1, 0.75),
        model::green(1.5, 0.25),
        model::cosine(1.0),
        model::steep(0.5),
        model::quadratic(-0.7),
        model::distance(3, -0.4),
        model::cubic(0.45),
    ]
}

/// Walks of one functional, with (v, Φ) if it is known.
///
/// # Panics
/// If a walk scores a value that is not finite.
pub fn walked<F, E, N, T>(
    (equation, neighbour): (&E, &N),
    functional: T,
    control_mean: Option<f64>,
    options: WalkOptions,
    walks: u64,
) -> Statistics
where
    F: Real,
    E: Equation<Scalar = F, Value = F> + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    let goals = [Goal::new(functional, control_mean)];
    let job = Goals::new(equation, neighbour, &goals, options);
    check::run(&job, walks).remove(0)
}

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

impl<F: Real, const D: usize> ScalarField<F, D> for Ramp {
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

/// The Galerkin solution with these coefficients.
///
/// # Panics
/// If there is none.
pub fn solved<const D: usize>(
    rule: &CubeRule<D>,
    matrix: &dyn GalerkinMatrix<Scalar = f64>,
    source: &dyn ScalarField<f64, D>,
) -> Solution {
    Solution::new(matrix, rule.means(source).unwrap(), 1e-15, 1000).unwrap()
}

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
    K: KernelFn<f64, D> + KernelFn<F, D> + Copy,
    S: ScalarField<f64, D> + ScalarField<F, D> + Copy,
    P: Pairs,
{
    let cube = Cube::<F, D, K, S>::new(kernel, source, cells).unwrap();
    let rule = CubeRule::new(&cube, 0, 2).unwrap();
    let mut entries = rule.table(&kernel).unwrap();
    for (e, k) in entries.iter_mut().enumerate() {
        *k *= 1.0 + if e % 2 == 0 { spoil } else { -spoil };
    }
    let n = cube.cells();
    let dense = Dense::new(&entries, n, 1).unwrap();
    let solution = solved(&rule, &dense, &source);
    let v = solution.rounded::<F>().unwrap();
    let g = solution.source::<F>(&dense, &pairs).unwrap();
    let narrow = rounded::<F>(&entries).unwrap();
    then(&cube, &Dense::new(&narrow, n, 1).unwrap(), &v, &g)
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
    K: KernelFn<f64, D> + KernelFn<F, D> + Copy,
    S: ScalarField<f64, D> + ScalarField<F, D> + Copy,
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
    K: KernelFn<f64, D> + KernelIntegral<F, D> + Copy,
    S: ScalarField<f64, D> + ScalarField<F, D> + Copy,
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
        &Smooth<'_, F, D, Product<T>, S, ProductTables<Vec<F>, D>, P>,
        &[F],
    ) -> R,
) -> R
where
    T: KernelFactors<f64> + KernelFactors<F> + Copy,
    S: ScalarField<f64, D> + ScalarField<F, D> + Copy,
    P: Pairs + Copy,
{
    let cube = Cube::<F, D, _, _>::new(Product(factors), source, cells).unwrap();
    let rule = CubeRule::new(&cube, 0, 2).unwrap();
    let tables = rule.product_tables(&factors).unwrap();
    let solution = solved(&rule, &tables, &source);
    let v = solution.rounded::<F>().unwrap();
    let g = solution.source::<F>(&tables, &pairs).unwrap();
    let narrow = tables.rounded::<F>().unwrap();
    let neighbour = Piecewise::new(&cube, &narrow, pairs, &v, &g).unwrap();
    then(&cube, &neighbour, &v)
}

/// A cube with B functions on a cell.
pub type Graded<F, const D: usize, T, S, const B: usize> = Cube<F, D, Product<T>, S, B>;

/// A neighbour equation with B functions on a cell, and coefficients in f64.
pub type GradedNeighbour<'a, F, const D: usize, T, S, C, const B: usize> = Piecewise<
    'a,
    F,
    Graded<F, D, T, S, B>,
    Rounded<'a, C, F>,
    DiagonalRule,
    SourceTable<'a, F, Graded<F, D, T, S, B>, B>,
    B,
>;

/// A product kernel with B functions on a cell, all pairs in S, by one-dimensional tables: the cube, the
/// neighbour equation, and v in the walk's scalar.
///
/// # Panics
/// If there is no such cube.
pub fn with_degree<F: Real, const D: usize, T, S, R, const B: usize>(
    (factors, source): (T, S),
    cells: usize,
    then: impl FnOnce(
        &Graded<F, D, T, S, B>,
        &GradedNeighbour<'_, F, D, T, S, ProductTables<Vec<f64>, D>, B>,
        &[F],
    ) -> R,
) -> R
where
    T: KernelFactors<f64> + KernelFactors<F> + Copy,
    S: ScalarField<f64, D> + ScalarField<F, D> + Copy,
{
    let cube = Cube::<F, D, _, _>::new(Product(factors), source, cells).unwrap();
    let cube = cube.with_functions::<B>();
    let rule = CubeRule::new(&cube, cube.degree(), cube.degree() + 1).unwrap();
    let tables = rule.product_tables(&factors).unwrap();
    let solution = solved(&rule, &tables, &source);
    let v = solution.rounded::<F>().unwrap();
    let g = solution.source::<F>(&tables, &ALL).unwrap();
    let narrow = Rounded::new(&tables);
    let neighbour = Piecewise::new(&cube, &narrow, ALL, &v, &g).unwrap();
    then(&cube, &neighbour, &v)
}

/// F = 1 − ∫ K(x,y) dy, so that u = 1.
#[derive(Clone, Copy, Debug)]
pub struct Furnace(pub Product<ModelKernel>);

impl<F: Real, const D: usize> ScalarField<F, D> for Furnace {
    fn value(&self, x: &[F; D]) -> F {
        F::one() - self.0.integral(x, &[F::zero(); D], &[F::one(); D])
    }
}

/// F = 1 − ∫ K(x,y) dy and the model's besides, so that u is 1 more than the model's.
#[derive(Clone, Copy, Debug)]
pub struct Raised(pub Model);

impl<F: Real, const D: usize> ScalarField<F, D> for Raised {
    fn value(&self, x: &[F; D]) -> F {
        let one: F = ScalarField::value(&Furnace(self.0.kernel), x);
        one + ScalarField::value(&self.0.source, x)
    }
}

/// What solves a model problem.
#[derive(Clone, Copy, PartialEq)]
enum Solved {
    /// The model's u.
    Own,
    /// 1.
    One,
    /// u + 1.
    Raised,
}

/// A model problem on the cube as the kit sees it, with B functions on a cell.
struct Described<F, const D: usize, S, const B: usize = 1> {
    cube: Cube<F, D, Product<ModelKernel>, S, B>,
    model: Model,
    solution: Solved,
    rule: Vec<(f64, f64)>,
}

impl<F: Real, const D: usize, S: ScalarField<F, D> + Copy, const B: usize> Described<F, D, S, B> {
    /// The model's kernel with this source, `cells` cells per axis. `points` Gauss points per axis
    /// give the integrals over a cell to rounding.
    fn new(model: Model, source: S, solution: Solved, cells: usize, points: usize) -> Self {
        let cube = Cube::new(model.kernel, source, cells).unwrap();
        Self {
            cube: cube.with_functions(),
            model,
            solution,
            rule: gauss_legendre(points),
        }
    }

    fn contains(&self, cell: usize, x: &[F; D]) -> bool {
        let (low, high) = self.cube.cell_box(cell);
        // x m is wrong by ε m, an edge by ε.
        let edge = F::from_f64(2.0) * F::EPSILON;
        (0..D).all(|a| low[a] - edge <= x[a] && x[a] <= high[a] + edge)
    }

    fn nodes(&self, x: &[F; D], cell: usize) -> Vec<([F; D], f64)> {
        // In parts of a cell, as a width that is the difference of two ends has lost digits.
        let (low, _) = self.cube.cell_box(cell);
        let width = 1.0 / self.cube.per_axis() as f64;
        let axes = core::array::from_fn(|a| {
            let low = low[a].to_f64();
            let kink = [(x[a].to_f64() - low) / width];
            let kinks = &kink[..usize::from(self.model.has_kink())];
            let part = split(&self.rule, 0.0, 1.0, kinks).into_iter();
            part.map(|(t, w)| (low + t * width, w * width)).collect()
        });
        let nodes = tensor::<D>(&axes).into_iter();
        nodes.map(|(y, w)| (y.map(F::from_f64), w)).collect()
    }

    fn solution(&self, x: &[F; D]) -> f64 {
        let u = || -> f64 { ScalarField::value(&self.model.solution, &x.map(Real::to_f64)) };
        match self.solution {
            Solved::Own => u(),
            Solved::One => 1.0,
            Solved::Raised => 1.0 + u(),
        }
    }

    fn constant(&self) -> Option<f64> {
        (self.solution == Solved::One).then_some(1.0)
    }
}

/// A model problem with B functions on a cell, and claims of its coefficients within `relative`.
struct AtDegree<F, const D: usize, S, const B: usize> {
    of: Described<F, D, S, B>,
    relative: f64,
}

impl<F: Real, const D: usize, S: ScalarField<F, D> + Copy, const B: usize> AtDegree<F, D, S, B> {
    fn new(of: Described<F, D, S, B>, relative: f64) -> Self {
        // The kit's own integrals have points stored to ε, so that t is known to 2mε, and the derivative of
        // √(2p + 1) P_p is p (p + 1)/2 times its root at most.
        let (m, p) = (of.cube.per_axis() as f64, of.cube.degree() as f64);
        let moved = 2.0 * m * F::EPSILON.to_f64() * (2.0 * p + 1.0).sqrt() * p * (p + 1.0) / 2.0;
        let relative = relative.max(moved);
        Self { of, relative }
    }
}

/// The description of a cube, whatever is offered.
macro_rules! description {
    ($kind:ident<$($functions:ident)?>, $self:ident => $described:expr) => {
        impl<F: Real, const D: usize, S, $(const $functions: usize)?> Description<$($functions)?>
            for $kind<F, D, S, $($functions)?>
        where
            S: ScalarField<F, D> + ScalarField<f64, D> + Copy + Sync,
        {
            type Equation = Cube<F, D, Product<ModelKernel>, S, $($functions)?>;

            fn equation(&$self) -> &Self::Equation {
                &$described.cube
            }

            fn contains(&$self, cell: usize, x: &[F; D]) -> bool {
                $described.contains(cell, x)
            }

            fn nodes(&$self, x: &[F; D], cell: usize) -> Vec<([F; D], f64)> {
                $described.nodes(x, cell)
            }

            fn solution(&$self, x: &[F; D]) -> Option<f64> {
                Some($described.solution(x))
            }

            fn constant(&$self) -> Option<f64> {
                $described.constant()
            }

            /// Of the first coordinate.
            fn cumulative(&$self, _: &[F; D], y: &[F; D]) -> Option<f64> {
                Some(y[0].to_f64())
            }

            fn mass(&$self, _: &Located<[F; D]>, _: usize) -> Option<f64> {
                Some(1.0 / $described.cube.cells() as f64)
            }
        }
    };
}
description!(Described<>, self => self);
description!(AtDegree<B>, self => self.of);

/// Everything about a model problem in D dimensions with B functions on a cell, in f32 and f64.
#[must_use]
pub fn examined_at<const D: usize, const B: usize>(
    model: Model,
    cells: usize,
    points: usize,
    relative: f64,
    seed: u64,
) -> Report {
    let of = (model, model.source, Solved::Own, cells, points);
    at_degree::<_, D, B>(of, relative, seed)
}

/// The same with the source for which the solution is 1 more.
#[must_use]
pub fn examined_raised_at<const D: usize, const B: usize>(
    model: Model,
    cells: usize,
    points: usize,
    relative: f64,
    seed: u64,
) -> Report {
    let of = (model, Raised(model), Solved::Raised, cells, points);
    at_degree::<_, D, B>(of, relative, seed)
}

/// Of the arguments of [`Described::new`].
fn at_degree<S, const D: usize, const B: usize>(
    (model, source, solution, cells, points): (Model, S, Solved, usize, usize),
    relative: f64,
    seed: u64,
) -> Report
where
    S: ScalarField<f32, D> + ScalarField<f64, D> + Copy + Sync,
{
    let narrow = Described::<f32, D, _, B>::new(model, source, solution, cells, points);
    let wide = Described::<f64, D, _, B>::new(model, source, solution, cells, points);
    examine_both(
        &AtDegree::new(narrow, relative),
        &AtDegree::new(wide, relative),
        seed,
    )
}

impl<F: Real, const D: usize, S, const B: usize> Neighbours<B> for AtDegree<F, D, S, B>
where
    S: ScalarField<F, D> + ScalarField<f64, D> + Copy + Sync,
{
    /// Pointwise pairs are offered for piecewise constants alone.
    fn offers(&self, offers: &mut Offers<'_, Self, B>) {
        let (kernel, cube) = (self.of.model.kernel, &self.of.cube);
        let source = *cube.right_hand_side();
        offers.pairs("all in S", ALL);
        // Blocks of many functions take their time, and so do tables by quadrature in 2 D dimensions.
        let quick = B < 20 && D < 5;
        if B < 20 {
            offers.pairs("diagonal outside", OUTSIDE);
        }
        if quick {
            let rule = CubeRule::new(cube, cube.degree(), cube.degree() + 1).unwrap();
            let entries = rule.table(&kernel).unwrap();
            let dense = Dense::new(&entries, cube.cells(), B).unwrap();
            let solution = solved(&rule, &dense, &source);
            let (v, g) = (
                solution.rounded::<F>().unwrap(),
                solution.source::<F>(&dense, &ALL).unwrap(),
            );
            offers.piecewise("own table", &Rounded::new(&dense), ALL, &v, &g);
        }
        let cells = cube.per_axis();
        with_degree::<F, D, _, _, _, B>((kernel.0, source), cells, |_, neighbour, _| {
            offers.neighbour("own product tables", neighbour);
        });
        let rule = CubeRule::new(cube, cube.degree(), 5).unwrap();
        let tables = rule.product_tables(&kernel.0).unwrap();
        offers.coefficients("product tables", &tables, self.relative);
        if quick {
            let entries = rule.table(&kernel).unwrap();
            let dense = Dense::new(&entries, cube.cells(), B).unwrap();
            offers.coefficients("table", &dense, self.relative);
        }
        offers.source_means("own", &rule.means(&source).unwrap(), self.relative);
        let solution = solved(&rule, &tables, &source);
        offers.galerkin_solution("own", &solution.v, self.relative);
    }
}

/// Everything about a model problem in D dimensions, in f32 and f64.
#[must_use]
pub fn examined<const D: usize>(model: Model, cells: usize, points: usize, seed: u64) -> Report {
    flat::<_, D>((model, model.source, Solved::Own, cells, points), seed)
}

/// The same with the source for which the solution is 1.
#[must_use]
pub fn examined_furnace<const D: usize>(
    model: Model,
    cells: usize,
    points: usize,
    seed: u64,
) -> Report {
    let source = Furnace(model.kernel);
    flat::<_, D>((model, source, Solved::One, cells, points), seed)
}

/// The same with the source for which the solution is 1 more.
#[must_use]
pub fn examined_raised<const D: usize>(
    model: Model,
    cells: usize,
    points: usize,
    seed: u64,
) -> Report {
    let source = Raised(model);
    flat::<_, D>((model, source, Solved::Raised, cells, points), seed)
}

/// Of the arguments of [`Described::new`].
fn flat<S, const D: usize>(
    (model, source, solution, cells, points): (Model, S, Solved, usize, usize),
    seed: u64,
) -> Report
where
    S: ScalarField<f32, D> + ScalarField<f64, D> + Copy + Sync,
{
    examine_both(
        &Described::<f32, D, _>::new(model, source, solution, cells, points),
        &Described::<f64, D, _>::new(model, source, solution, cells, points),
        seed,
    )
}

impl<F: Real, const D: usize, S> Neighbours for Described<F, D, S>
where
    S: ScalarField<F, D> + ScalarField<f64, D> + Copy + Sync,
{
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        let equation = (self.model.kernel, *self.cube.right_hand_side());
        let cells = self.cube.per_axis();
        offers.starts(&self.cube);
        offers.pairs("all in S", ALL);
        offers.pairs("diagonal outside", OUTSIDE);
        offers.pointwise_pairs("diagonal pointwise", POINTWISE);
        offers.pointwise_pairs("all pointwise", AllPointwise);
        with_table(equation, cells, ALL, 0.0, |_, dense, v, g| {
            offers.piecewise("own table", dense, ALL, v, g);
        });
        with_product::<F, D, _, _, _, _>(
            (self.model.kernel.0, equation.1),
            cells,
            ALL,
            |_, neighbour, _| offers.neighbour("own product tables", neighbour),
        );
        // Five points see no kink and integrate the smooth factors of the models well.
        let relative = if self.model.has_kink() { 0.1 } else { 1e-7 };
        let rule = CubeRule::new(&self.cube, 0, 5).unwrap();
        let tables = rule.product_tables(&equation.0.0).unwrap();
        offers.coefficients("product tables", &tables, relative);
        offers.source_means("own", &rule.means(&equation.1).unwrap(), relative);
        let solution = solved(&rule, &tables, &equation.1);
        offers.galerkin_solution("own", &solution.v, relative);
    }
}
