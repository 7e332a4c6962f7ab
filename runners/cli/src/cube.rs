//! A cube from its file to statistics: formulas, set-up, targets, walks.

use core::fmt;
use std::sync::OnceLock;
use std::time::Instant;

use fredholm_core::galerkin::{
    self, AllPointwise, Coefficients, Dense, GalerkinError, GalerkinMatrix, OffDiagonal, PairKind,
    PairTable, Partition, Piecewise, Rounded, Solution, Solve, Sweeps, gauss_seidel, rounded,
};
use fredholm_core::variance::{self, Density, Level, Setting, Terms};
use fredholm_core::{At, Functional, Located, Neighbour, NoNeighbour, Real, Source, Uniforms};
use fredholm_cube::{
    CellIntegral, Cube, CubeError, CubeLevel, Function, IntegralKernel, KernelFactors, Mean,
    Product, ProductTables, Rule, Weighted, absolute_radius, empty_table, functions, table_bytes,
};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_rayon::{Plan, RunError, Target, fill_rows, run};

use crate::diagnose::{Begin, Diagnosis, Request, Subject};
use crate::export;
use crate::failure::Failure;
use crate::file::{self, KernelText, Pairs, Placed, ProblemFile, Scalar, What};
use crate::formula::{self, Formula};
use crate::problem::{
    Answer, Asked, Cost, Known, NO_SOLVE, PointwisePairs, Problem, Solved, WalkCost, Where, asked,
    floors, infinite_variance,
};
use crate::progress::{Progress, begin_walking};
use crate::rates::Deterministic;
use crate::solve::plan;
use crate::theory::{self, AnyPairs, PairCounts};

/// The relative residual at which the iteration for v stops. An unconverged solution costs variance and
/// nothing else.
const TOLERANCE: f64 = 1e-14;
/// The most sweeps.
const SWEEPS: u32 = 1000;
/// Seconds of a function on a cell at a point, or of a product of two.
const VALUE: f64 = 1e-9;
/// Numbers of a table that caches hold.
const CACHED: f64 = 1e5;
/// The most unknowns of a level of `rates` at degrees above 0.
const LEVEL: usize = 1300;
/// The most nodes of a diagnosis, whose work grows with their square: a minute or so.
const MOST_NODES: usize = 20_000;
/// About so many unknowns in all where the file does not say.
const DEFAULT_UNKNOWNS: f64 = 1000.0;

/// The first value of a formula that was not finite.
type Watch = OnceLock<String>;

/// The formulas of a file in one scalar.
#[derive(Debug)]
pub(crate) struct Formulas<F: 'static> {
    /// K, or its factors.
    kernel: Vec<Formula<'static, F>>,
    product: bool,
    /// ∫₀^y K, or of its factors.
    integral: Vec<Formula<'static, F>>,
    source: Formula<'static, F>,
    solution: Option<Formula<'static, F>>,
    watch: Watch,
}

impl<F: Real> Formulas<F> {
    pub(crate) fn new(cube: &file::Cube) -> Result<Self, Failure> {
        let one = |text: &Placed<String>| {
            // Validation has checked it.
            Formula::kept(&text.value).map_err(|error| Failure::input(error.message))
        };
        let list = |text: &KernelText| match text {
            KernelText::General(text) => Ok(vec![one(text)?]),
            KernelText::Factors(texts) => texts.value.iter().map(one).collect(),
        };
        Ok(Self {
            kernel: list(&cube.kernel)?,
            product: matches!(cube.kernel, KernelText::Factors(_)),
            integral: cube.integral.as_ref().map_or(Ok(Vec::new()), list)?,
            source: one(&cube.source)?,
            solution: cube.solution.as_ref().map(one).transpose()?,
            watch: Watch::new(),
        })
    }

    fn kernel(&self) -> FileKernel<'_, F> {
        FileKernel(self)
    }

    fn function<'a>(&'a self, name: &'a str, formula: Formula<'static, F>) -> FileFunction<'a, F> {
        FileFunction {
            name,
            formula,
            watch: &self.watch,
        }
    }

    /// The equation on [0, 1]^D with m = `per_axis`.
    fn cube<const D: usize>(
        &self,
        per_axis: usize,
        absorption: f64,
    ) -> Result<Cube<F, D, FileKernel<'_, F>, FileFunction<'_, F>>, Failure> {
        let source = self.function("source", self.source);
        Cube::new(self.kernel(), source, per_axis, absorption).map_err(Failure::input)
    }
}

/// The kernel of a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileKernel<'a, F: 'static>(&'a Formulas<F>);

/// A value, watched.
#[inline]
fn finite<F: Real>(watch: &Watch, value: F, what: impl FnOnce() -> String) -> F {
    if !value.is_finite() {
        watch.get_or_init(what);
    }
    value
}

/// "0.5" or "[0.5, 0.25]".
fn point<F: fmt::Display>(x: &[F]) -> String {
    let texts: Vec<String> = x.iter().map(F::to_string).collect();
    match texts.as_slice() {
        [one] => one.clone(),
        _ => format!("[{}]", texts.join(", ")),
    }
}

impl<F: Real, const D: usize> IntegralKernel<F, D> for FileKernel<'_, F> {
    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        if self.0.product {
            let factor = |a: usize| self.factor(a, x[a], y[a]);
            return (0..D).map(factor).fold(F::one(), |k, factor| k * factor);
        }
        let Some(formula) = self.0.kernel.first() else {
            return F::NAN;
        };
        let value = formula.value(x, y);
        finite(&self.0.watch, value, || {
            format!("`kernel` is {value} at x = {}, y = {}", point(x), point(y))
        })
    }
}

impl<F: Real> KernelFactors<F> for FileKernel<'_, F> {
    #[inline]
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let Some(formula) = self.0.kernel.get(axis) else {
            return F::NAN;
        };
        let value = formula.value(&[x], &[y]);
        finite(&self.0.watch, value, || {
            format!("`kernel_factors[{axis}]` is {value} at x = {x}, y = {y}")
        })
    }
}

impl<F: Real, const D: usize> CellIntegral<F, D> for FileKernel<'_, F> {
    #[inline]
    fn integral(&self, x: &[F; D], low: &[F; D], high: &[F; D]) -> F {
        let axes = self
            .0
            .integral
            .iter()
            .zip(x.iter().zip(low.iter().zip(high)));
        axes.fold(F::one(), |product, (formula, (&x, (&low, &high)))| {
            let at = |y: F| {
                let value = formula.value(&[x], &[y]);
                finite(&self.0.watch, value, || {
                    format!("`kernel_integral` is {value} at x = {x}, y = {y}")
                })
            };
            product * (at(high) - at(low))
        })
    }
}

/// A function of a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileFunction<'a, F: 'static> {
    name: &'a str,
    formula: Formula<'static, F>,
    watch: &'a Watch,
}

impl<F: Real, const D: usize> Function<F, D> for FileFunction<'_, F> {
    #[inline]
    fn value(&self, x: &[F; D]) -> F {
        let value = self.formula.value(x, &[]);
        finite(self.watch, value, || {
            format!("`{}` is {value} at x = {}", self.name, point(x))
        })
    }
}

/// Galerkin coefficients in f64: one type for both and for all degrees, as every type has neighbour equations of its
/// own, which take their time to compile.
#[derive(Debug)]
pub(crate) enum Table<const D: usize> {
    /// Of any kernel: (n·B)² entries.
    Dense {
        entries: Vec<f64>,
        cells: usize,
        functions: usize,
    },
    /// Of a product.
    Product(ProductTables<f64, D>),
}

/// What the coefficients of either kind answer. The length of a table was its own making.
macro_rules! either {
    ($table:expr, $coefficients:ident => $then:expr, $otherwise:expr) => {
        match $table {
            Table::Dense {
                entries,
                cells,
                functions,
            } => match Dense::new(entries, *cells, *functions) {
                Some(dense) => {
                    let $coefficients = &dense;
                    $then
                }
                None => $otherwise,
            },
            Table::Product($coefficients) => $then,
        }
    };
}

impl<const D: usize, const B: usize> Coefficients<B> for Table<D> {
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[f64; B]) -> [f64; B] {
        either!(self, table => table.left_times_block(i, j, left), [f64::NAN; B])
    }
}

impl<const D: usize> GalerkinMatrix for Table<D> {
    type Scalar = f64;

    fn cells(&self) -> usize {
        match self {
            Self::Dense { cells, .. } => *cells,
            Self::Product(tables) => tables.cells(),
        }
    }

    fn functions(&self) -> usize {
        match self {
            Self::Dense { functions, .. } => *functions,
            Self::Product(tables) => tables.functions(),
        }
    }

    fn entry(&self, row: [usize; 2], column: [usize; 2]) -> f64 {
        either!(self, table => table.entry(row, column), f64::NAN)
    }

    fn block(&self, i: usize, j: usize, out: &mut [f64]) {
        either!(self, table => table.block(i, j, out), out.fill(f64::NAN));
    }

    fn row_sum(&self, i: usize) -> f64 {
        either!(self, table => table.row_sum(i), f64::NAN)
    }

    fn rows_times(&self, i: usize, v: &[f64], out: &mut [f64]) {
        either!(self, table => table.rows_times(i, v, out), out.fill(f64::NAN));
    }

    fn apply(&self, v: &[f64], out: &mut [f64]) {
        either!(self, table => table.apply(v, out), out.fill(f64::NAN));
    }

    fn apply_absolute(&self, w: &[f64], out: &mut [f64]) {
        either!(self, table => table.apply_absolute(w, out), out.fill(f64::NAN));
    }

    fn sweep(&self, source: &[f64], v: &mut [f64], scratch: &mut [f64]) -> f64 {
        either!(self, table => table.sweep(source, v, scratch), f64::NAN)
    }
}

/// What is computed before the walks, in f64.
#[derive(Debug)]
pub(crate) struct Setup<const D: usize> {
    pub(crate) table: Table<D>,
    pub(crate) solution: Solution,
}

impl<const D: usize> Setup<D> {
    /// The spectral radius of T_h²p with all pairs in S, estimated.
    fn neighbour_second_moment(
        &self,
        formulas: &Formulas<f64>,
        per_axis: usize,
        absorption: f64,
    ) -> Result<f64, Failure> {
        let cube = formulas.cube::<D>(per_axis, absorption)?;
        match &self.table {
            table @ Table::Dense { .. } => cube.neighbour_radius(table),
            Table::Product(tables) => tables.neighbour_radius(absorption),
        }
        .map_err(|error| explained(error, &formulas.watch))
    }
}

/// Sets up on all threads.
pub(crate) fn set_up<const D: usize, const B: usize>(
    formulas: &Formulas<f64>,
    per_axis: usize,
    rule: Rule,
    absorption: f64,
) -> Result<Setup<D>, Failure> {
    let explain = |error| explained(error, &formulas.watch);
    let cube = formulas
        .cube::<D>(per_axis, absorption)?
        .with_functions::<B>();
    let source = *cube.right_hand_side();
    let table = if formulas.product {
        let product =
            Cube::<f64, D, _, _>::new(Product(formulas.kernel()), source, per_axis, absorption);
        let tables = product.and_then(|cube| ProductTables::new(&cube.with_functions::<B>(), rule));
        Table::Product(tables.map_err(explain)?)
    } else {
        let unknowns = cube.cells() * B;
        let mut entries = empty_table(unknowns).map_err(explain)?;
        let fill: &Fill<'_> = &|i, rows| cube.fill_row(rule, i, rows);
        fill_rows(&mut entries, unknowns * B, fill).map_err(explain)?;
        Table::Dense {
            entries,
            cells: cube.cells(),
            functions: B,
        }
    };
    let solution = cube
        .solve(&table, rule, TOLERANCE, SWEEPS)
        .map_err(explain)?;
    Ok(Setup { table, solution })
}

/// Fills the rows of a cell: one type for every shape.
type Fill<'a> = dyn Fn(usize, &mut [f64]) -> Result<(), CubeError> + Sync + 'a;

/// An error of the set-up, with what was not finite where that is the reason.
fn explained(error: CubeError, watch: &Watch) -> Failure {
    match error {
        CubeError::Kernel { .. } | CubeError::Source { .. } => match watch.get() {
            Some(what) => Failure::input(format_args!("{what}: a finite number is needed there")),
            None => Failure::input(error),
        },
        CubeError::Galerkin(GalerkinError::Radius) => Failure::input(
            "the walks of the neighbour equation have no mean: the absolute values of the Galerkin \
             coefficients have an estimated spectral radius of 1 or more, and it must be below 1; if that \
             of |K| is below 1, use more `cells` or `points`, otherwise a smaller kernel is needed",
        ),
        _ => Failure::input(error),
    }
}

/// The mean of a function, where two quadrature rules agree on it.
fn integral<const D: usize>(
    watch: &Watch,
    function: impl Fn(&[f64; D]) -> f64,
) -> Result<Option<f64>, Failure> {
    let nothing = |_: &[f64; D], _: &[f64; D]| 0.0;
    let rule = Rule::new(5).map_err(Failure::run)?;
    let mean = |per_axis: usize| {
        let cube = Cube::new(nothing, |_: &[f64; D]| 0.0, per_axis, 0.5).map_err(Failure::run)?;
        let mut means = vec![0.0; cube.cells()];
        cube.means(&function, rule, &mut means)
            .map_err(|error| explained(error, watch))?;
        Ok::<f64, Failure>(means.iter().sum::<f64>() / means.len() as f64)
    };
    let cells = match D {
        1 => [200, 300],
        2 => [12, 18],
        3 => [4, 6],
        4 => [2, 3],
        _ => [1, 2],
    };
    let [coarse, fine] = cells.map(mean);
    let (coarse, fine) = (coarse?, fine?);
    let agree = (coarse - fine).abs() <= 1e-12 * fine.abs().max(1e-300);
    Ok(agree.then_some(fine))
}

/// An expression in which the dimension is a constant of this name.
macro_rules! in_dimension {
    ($d:expr, $name:ident => $then:expr) => {
        match $d {
            1 => in_dimension!(1 as $name => $then),
            2 => in_dimension!(2 as $name => $then),
            3 => in_dimension!(3 as $name => $then),
            4 => in_dimension!(4 as $name => $then),
            5 => in_dimension!(5 as $name => $then),
            // Validation lets nothing above 6 pass.
            _ => in_dimension!(6 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}

/// An expression in which the dimension and the number of functions on a cell are constants of these names.
/// Validation lets no other degrees pass.
macro_rules! in_shape {
    ($d:expr, $degree:expr, $dimension:ident, $functions:ident => $then:expr) => {
        match $d {
            1 => in_shape!(1, $degree, [1 2 3 4], $dimension, $functions => $then),
            2 => in_shape!(2, $degree, [1 2 3 4], $dimension, $functions => $then),
            3 => in_shape!(3, $degree, [1 2 3 4], $dimension, $functions => $then),
            4 => in_shape!(4, $degree, [1 2], $dimension, $functions => $then),
            5 => in_shape!(5, $degree, [1 2], $dimension, $functions => $then),
            _ => in_shape!(6, $degree, [1 2], $dimension, $functions => $then),
        }
    };
    ($d:literal, $degree:expr, [$($p:literal)*], $dimension:ident, $functions:ident => $then:expr) => {{
        const $dimension: usize = $d;
        match $degree {
            $($p => {
                const $functions: usize = functions($d, $p);
                $then
            })*
            _ => {
                const $functions: usize = 1;
                $then
            }
        }
    }};
}

/// A cube of a file.
#[derive(Clone, Debug)]
pub(crate) struct CubeFile<'f> {
    file: &'f ProblemFile,
    cube: &'f file::Cube,
    /// m.
    per_axis: usize,
    asked: Vec<Asked>,
}

impl<'f> CubeFile<'f> {
    /// The cube of this file.
    pub(crate) fn new(file: &'f ProblemFile, cube: &'f file::Cube) -> Result<Self, Failure> {
        let dimension = cube.dimension.value as u32;
        let functions = functions(cube.dimension.value, file.galerkin.degree.value) as f64;
        let default = (DEFAULT_UNKNOWNS / functions)
            .powf(1.0 / f64::from(dimension))
            .floor();
        let cells = file.galerkin.cells.as_ref();
        let per_axis = cells.map_or(default.max(2.0) as usize, |cells| cells.value);
        if let Some(cells) = cells
            && per_axis
                .checked_pow(dimension)
                .is_none_or(|n| n > file::MAX_CELLS)
        {
            let message = format!(
                "{per_axis} cells per axis are too many in {dimension} dimensions: at most {} cells in \
                 all",
                file::MAX_CELLS
            );
            return Err(file.refuse(cells, message).into());
        }
        let asked = asked(file, |what| match what {
            What::At(at) => vec![Where::Point(at.value.iter().map(|x| x.value).collect())],
            What::OverAll => vec![Where::All],
            What::Weight(text) => vec![Where::Weight(text.value.clone())],
            What::Grid(points, _) => {
                let last = points.value.saturating_sub(1).max(1) as f64;
                (0..points.value)
                    .map(|i| Where::Point(vec![i as f64 / last]))
                    .collect()
            }
            // Validation has refused it.
            What::Over(..) | What::On(..) | What::OverSurface(_) => Vec::new(),
        })?;
        Ok(Self {
            file,
            cube,
            per_axis,
            asked,
        })
    }

    /// p.
    fn degree(&self) -> usize {
        self.file.galerkin.degree.value
    }

    /// B, the number of functions on a cell.
    fn functions(&self) -> usize {
        functions(self.cube.dimension.value, self.degree())
    }

    /// n.
    fn all_cells(&self) -> usize {
        self.per_axis
            .saturating_pow(self.cube.dimension.value as u32)
    }

    /// Quadrature points of a cell and axis: one more than the degree is enough.
    fn points(&self) -> usize {
        let points = self.file.galerkin.points.as_ref();
        points.map_or(self.degree() + 1, |points| points.value)
    }

    fn rule(&self) -> Result<Rule, Failure> {
        Rule::new(self.points()).map_err(Failure::input)
    }

    /// The spectral radius of T_k²p, estimated on a coarse partition. That of T_h²p is looked at when K' is
    /// known: it is smaller if K' is exact.
    fn second_moment_in<const D: usize>(&self) -> Result<f64, Failure> {
        let formulas = Formulas::<f64>::new(self.cube)?;
        let kernel = formulas.kernel();
        let explain = |error| explained(error, &formulas.watch);
        let dark = |_: &[f64; D]| 0.0;
        let absorption = self.absorption();
        if formulas.product {
            let square = |a: usize, x: f64, y: f64| {
                let factor = kernel.factor(a, x, y);
                factor * factor
            };
            // Tables of axes alone are made: the number of cells does not matter as long as it is one.
            let per_axis = [200, 200, 200, 200, 80, 40][D - 1];
            let radius = Cube::<f64, D, _, _>::new(Product(square), dark, per_axis, absorption)
                .and_then(|cube| ProductTables::new(&cube, Rule::new(2)?))
                .and_then(|tables| tables.absolute_radius())
                .map_err(explain)?;
            return Ok(radius / (1.0 - absorption));
        }
        let (per_axis, points) = [(200, 2), (14, 2), (6, 2), (4, 1), (3, 1), (2, 1)][D - 1];
        let square = |x: &[f64; D], y: &[f64; D]| {
            let k = kernel.kernel(x, y);
            k * k
        };
        let cube = Cube::new(square, dark, per_axis, absorption).map_err(explain)?;
        let rule = Rule::new(points).map_err(explain)?;
        let n = cube.cells();
        let mut entries = empty_table(n).map_err(explain)?;
        fill_rows(&mut entries, n, |i, row| cube.fill_row(rule, i, row)).map_err(explain)?;
        let dense =
            Dense::new(&entries, n, 1).ok_or_else(|| Failure::run("a table has a wrong size"))?;
        let radius = absolute_radius(&dense).map_err(explain)?;
        Ok(radius / (1.0 - absorption))
    }

    /// Sets up, and refuses walks whose error bars would mean nothing.
    fn set_up<const D: usize, const B: usize>(
        &self,
        formulas: &Formulas<f64>,
    ) -> Result<Setup<D>, Failure> {
        let setup = self.system::<D, B>(formulas)?;
        self.refuse_infinite_neighbour(formulas, &setup)?;
        Ok(setup)
    }

    fn system<const D: usize, const B: usize>(
        &self,
        formulas: &Formulas<f64>,
    ) -> Result<Setup<D>, Failure> {
        if self.cube.integral.is_some() {
            self.check_integral::<D>(formulas)?;
        }
        set_up::<D, B>(formulas, self.per_axis, self.rule()?, self.absorption())
    }

    /// Gives the spectral radius of T_h²p, where it is looked at.
    fn refuse_infinite_neighbour<const D: usize>(
        &self,
        formulas: &Formulas<f64>,
        setup: &Setup<D>,
    ) -> Result<Option<f64>, Failure> {
        // With all pairs pointwise h is k, which has been looked at.
        if self.file.walk.allow_infinite_variance || self.pairs().is_none() {
            return Ok(None);
        }
        let radius = setup.neighbour_second_moment(formulas, self.per_axis, self.absorption())?;
        if radius < 1.0 {
            return Ok(Some(radius));
        }
        let message = format!(
            "the variance of the neighbour equation's walks is infinite: their operator, of the Galerkin \
             coefficients of {} `cells` an axis by {} `points`, has an estimated spectral radius of {}, \
             and it must be below 1; use more cells or points, or a smaller `absorption` (or \
             --allow-infinite-variance: error bars then mean nothing)",
            self.per_axis,
            self.points(),
            crate::numbers::short(radius)
        );
        Err(match &self.file.galerkin.cells {
            Some(cells) => self.file.refuse(cells, message).into(),
            None => Failure::input(message),
        })
    }

    fn answer_in<F: Real, const D: usize, const B: usize>(
        &self,
        setup: &Setup<D>,
        kinds: &impl Kinds<F, D, B>,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let start = Instant::now();
        let wide = Formulas::<f64>::new(self.cube)?;
        let second_moment = self.refuse_infinite_neighbour(&wide, setup)?;
        let formulas = Formulas::<F>::new(self.cube)?;
        let cube = formulas
            .cube::<D>(self.per_axis, self.absorption())?
            .with_functions::<B>();
        let v = setup.solution.rounded::<F>().map_err(Failure::run)?;
        let means = self.weight_means(&wide, &cube)?;
        let known = Deterministics {
            wide: &wide,
            formulas: &formulas,
            v: &v,
            mean: Mean::of_blocks::<F, B>(&v),
            weighted: self.weighted(&formulas, &cube, &means, &v)?,
            contraction: setup.solution.contraction,
            solve: setup.solution.solve,
            second_moment,
        };
        let mut answer = None;
        kinds.then(&cube, setup, &v, &mut |neighbour| {
            let walked = self.walk_with(&known, neighbour, plan, progress)?;
            answer = Some(Answer {
                setup_seconds: start.elapsed().as_secs_f64() - walked.walk_seconds,
                ..walked
            });
            Ok(())
        })?;
        answer.ok_or_else(|| Failure::run("no neighbour equation was made"))
    }

    fn answer_pointwise<F: Real, const D: usize>(
        &self,
        setup: &Setup<D>,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let start = Instant::now();
        let pairs = self.pointwise::<D>(setup)?;
        let seconds = start.elapsed().as_secs_f64();
        let mut answer = self.answer_in::<F, D, 1>(setup, &pairs, plan, progress)?;
        if let Pointwise::Table(table) = &pairs {
            answer.setup_seconds += seconds;
            answer.pair_counts = Some(PairCounts::of(table));
        }
        Ok(answer)
    }

    fn diagnose_in<const D: usize, const B: usize>(
        &self,
        setup: &Setup<D>,
        kinds: &impl Kinds<f64, D, B>,
        request: &Request<'_>,
    ) -> Result<Diagnosis, Failure> {
        let formulas = Formulas::<f64>::new(self.cube)?;
        let cube = formulas
            .cube::<D>(self.per_axis, self.absorption())?
            .with_functions::<B>();
        let v = setup.solution.rounded::<f64>().map_err(Failure::run)?;
        let means = self.weight_means(&formulas, &cube)?;
        let weighted = self.weighted(&formulas, &cube, &means, &v)?;
        // Of piecewise constants alone: there the first function of a cell is all of it.
        let coefficients = match &setup.table {
            Table::Dense { entries, cells, .. } if B == 1 => Dense::new(entries, *cells, 1),
            _ => None,
        };
        let pairs = kinds.pairs(cube.cells())?;
        let mut diagnosis = None;
        kinds.then(&cube, setup, &v, &mut |neighbour| {
            diagnosis = Some(self.examine(
                &formulas,
                (neighbour, pairs),
                &weighted,
                coefficients,
                request,
            )?);
            Ok(())
        })?;
        diagnosis.ok_or_else(|| Failure::run("no neighbour equation was made"))
    }

    fn examine<const D: usize>(
        &self,
        formulas: &Formulas<f64>,
        (neighbour, pairs): (&Boxed<'_, f64, D>, AnyPairs<'_>),
        weighted: &[WeightedStart<'_, f64, D>],
        coefficients: Option<Dense<'_, f64>>,
        request: &Request<'_>,
    ) -> Result<Diagnosis, Failure> {
        let points = (self.degree() + 2).saturating_pow(D as u32);
        let nodes = self.all_cells().saturating_mul(points);
        if nodes > MOST_NODES {
            return Err(Failure::input(format_args!(
                "a diagnosis on {} cells takes integrals in {nodes} points, and more than {MOST_NODES} take too long: \
                 use fewer cells (`--cells`), which shows the same at a coarser level",
                self.all_cells()
            )));
        }
        let cube = formulas.cube::<D>(self.per_axis, self.absorption())?;
        let level = CubeLevel::new(&cube, request.nodes, self.degree()).map_err(Failure::run)?;
        let examined = self.with_starts(neighbour, weighted, |targets| {
            request.examine(&Subject {
                setting: Setting {
                    equation: &cube,
                    neighbour,
                    pairs,
                    level: &level,
                },
                coefficients: coefficients.as_ref(),
                hides: None,
                draw: None,
                targets,
                place: &|site| {
                    let mut places = Vec::new();
                    level.nodes(site, |x, _| {
                        if places.is_empty() {
                            places = x.map(|x| quarter(x, D)).to_vec();
                        }
                    });
                    places.join(" × ")
                },
            })
        });
        match formulas.watch.get() {
            Some(what) => Err(Failure::input(format_args!(
                "{what}: a finite number is needed there"
            ))),
            None => examined,
        }
    }

    /// With where the walks of all targets start.
    fn with_starts<R, const D: usize>(
        &self,
        neighbour: &Boxed<'_, f64, D>,
        weighted: &[WeightedStart<'_, f64, D>],
        then: impl FnOnce(&[Begin<'_, [f64; D]>]) -> R,
    ) -> R {
        let mean = |_: &[f64; D]| Density::uniform(1.0);
        let weights: Vec<_> = weighted
            .iter()
            .map(|weighted| {
                move |x: &[f64; D]| {
                    let phi = weighted.weight.value(x);
                    let x = neighbour.locate(*x);
                    let value = (weighted.neighbour_value)(&x, phi, neighbour.value(&x));
                    Density {
                        functional: phi,
                        square: phi * phi,
                        initial: 1.0,
                        fluctuation: value - weighted.of_means,
                    }
                }
            })
            .collect();
        let mut weights = weights.iter();
        let mut targets: Vec<Begin<'_, [f64; D]>> = Vec::new();
        for asked in &self.asked {
            let start = match &asked.place {
                Where::Point(x) => variance::Start::At(coordinates(x)),
                Where::Weight(_) => match weights.next() {
                    Some(weight) => variance::Start::Density(weight),
                    None => continue,
                },
                _ => variance::Start::Density(&mean),
            };
            targets.push(Begin {
                name: &asked.name,
                start,
            });
        }
        then(&targets)
    }

    /// With the pairs that the file asks for.
    fn diagnose_with(&self, request: &Request<'_>) -> Result<Diagnosis, Failure> {
        let d = self.cube.dimension.value;
        match self.pairs() {
            // Validation has refused these at degrees above 0.
            None => in_dimension!(d, D => self.diagnose_pointwise::<D>(request)),
            Some(pairs) if pairs.diagonal == PairKind::Pointwise => {
                in_dimension!(d, D => self.diagnose_pointwise::<D>(request))
            }
            Some(pairs) => in_shape!(d, self.degree(), D, B => {
                let setup = self.set_up::<D, B>(&Formulas::new(self.cube)?)?;
                self.diagnose_in::<D, B>(&setup, &Smooth(pairs), request)
            }),
        }
    }

    fn diagnose_pointwise<const D: usize>(
        &self,
        request: &Request<'_>,
    ) -> Result<Diagnosis, Failure> {
        let setup = self.set_up::<D, 1>(&Formulas::new(self.cube)?)?;
        self.diagnose_in::<D, 1>(&setup, &self.pointwise(&setup)?, request)
    }

    /// With the pairs that the file asks for.
    fn answer_with<F: Real>(
        &self,
        solved: &Solved,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let d = self.cube.dimension.value;
        let mut answer = match self.pairs() {
            // Validation has refused these at degrees above 0.
            None => in_dimension!(d, D => {
                self.answer_pointwise::<F, D>(solved.system()?, plan, progress)
            }),
            Some(pairs) if pairs.diagonal == PairKind::Pointwise => in_dimension!(d, D => {
                self.answer_pointwise::<F, D>(solved.system()?, plan, progress)
            }),
            Some(pairs) => in_shape!(d, self.degree(), D, B => {
                self.answer_in::<F, D, B>(solved.system()?, &Smooth(pairs), plan, progress)
            }),
        }?;
        answer.setup_seconds += solved.seconds;
        Ok(answer)
    }

    /// The pairs of piecewise constants where some are pointwise.
    fn pointwise<const D: usize>(&self, setup: &Setup<D>) -> Result<Pointwise, Failure> {
        Ok(match (self.file.galerkin.pairs.value, self.pairs()) {
            (Pairs::Theory, _) => Pointwise::Table(self.theory(setup)?),
            (_, Some(pairs)) => Pointwise::Diagonal(pairs),
            (_, None) => Pointwise::All,
        })
    }

    /// The kinds of all pairs, for what is asked for.
    fn theory<const D: usize>(&self, setup: &Setup<D>) -> Result<Vec<u8>, Failure> {
        let cells = self.all_cells();
        let nodes = theory::nodes(self.file, cells, 2_usize.saturating_pow(D as u32))?;
        let formulas = Formulas::<f64>::new(self.cube)?;
        let cube = formulas.cube::<D>(self.per_axis, self.absorption())?;
        let v = setup.solution.rounded::<f64>().map_err(Failure::run)?;
        let means = self.weight_means(&formulas, &cube)?;
        let weighted = self.weighted(&formulas, &cube, &means, &v)?;
        let level = CubeLevel::new(&cube, nodes, 0).map_err(Failure::run)?;
        let estimator = plan(self.file, None).estimator;
        let mut chosen = None;
        let galerkin = PairKind::Galerkin;
        let in_s = Pointwise::Diagonal(OffDiagonal { diagonal: galerkin });
        in_s.then(&cube, setup, &v, &mut |galerkin| {
            let terms = Terms {
                cells,
                galerkin,
                possible: &|_, _| level.possible(true),
            };
            let default = OffDiagonal {
                diagonal: PairKind::Pointwise,
            };
            chosen = Some(self.with_starts(galerkin, &weighted, |targets| {
                theory::choose(theory::table_of(&default, cells), |table, last| {
                    let kinds = Pointwise::Table(table.to_vec());
                    let pairs = Kinds::<f64, D, 1>::pairs(&kinds, cells)?;
                    let mut looked = None;
                    kinds.then(&cube, setup, &v, &mut |neighbour| {
                        let setting = Setting {
                            equation: &cube,
                            neighbour,
                            pairs,
                            level: &level,
                        };
                        looked = Some(theory::look(&setting, estimator, targets, &terms, last)?);
                        Ok(())
                    })?;
                    looked.ok_or_else(|| Failure::run("no neighbour equation was made"))
                })
            })?);
            Ok(())
        })
        .map_err(|failure| match formulas.watch.get() {
            Some(what) => Failure::input(format_args!("{what}: a finite number is needed there")),
            None => failure,
        })?;
        chosen.ok_or_else(|| Failure::run("no neighbour equation was made"))
    }

    /// `None`: all pairs are pointwise.
    fn pairs(&self) -> Option<OffDiagonal> {
        let diagonal = match self.file.galerkin.pairs.value {
            Pairs::Pointwise => return None,
            Pairs::Default | Pairs::Theory if self.cube.integral.is_some() => PairKind::Pointwise,
            _ => PairKind::Galerkin,
        };
        Some(OffDiagonal { diagonal })
    }

    fn tables_in<F: Real + Number, const D: usize, const B: usize>(
        &self,
    ) -> Result<TableBuilder, Failure> {
        let wide = Formulas::<f64>::new(self.cube)?;
        let setup = self.set_up::<D, B>(&wide)?;
        let v = setup.solution.rounded::<F>().map_err(Failure::run)?;
        let g = match self.pairs() {
            Some(pairs) => setup.solution.source(&setup.table, &pairs),
            None => setup.solution.source(&setup.table, &AllPointwise),
        };
        let cube = wide.cube::<D>(self.per_axis, self.absorption())?;
        Ok(export::cube(
            &cube.with_functions::<B>(),
            self.absorption(),
            &setup.table,
            self.pairs(),
            [&v, &g.map_err(Failure::run)?],
        ))
    }

    /// Walks with this neighbour equation; the time of the set-up is left open.
    fn walk_with<F: Real, const D: usize>(
        &self,
        known: &Deterministics<'_, F, D>,
        neighbour: &Boxed<'_, F, D>,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let formulas = known.formulas;
        let cube = formulas.cube::<D>(self.per_axis, self.absorption())?;
        let mut weighted = known.weighted.iter();
        let (mut starts, mut values) = (Vec::new(), Vec::new());
        for asked in &self.asked {
            let (functional, galerkin) = match &asked.place {
                Where::Point(x) => {
                    let x = coordinates(x);
                    let value = neighbour.value(&neighbour.locate(x)).to_f64();
                    (Start::Point(At(x)), value)
                }
                Where::Weight(_) => {
                    let weighted = weighted.next();
                    let weighted = weighted.ok_or_else(|| Failure::run("a weight has no means"))?;
                    let value = weighted.of_means;
                    (Start::Weighted(weighted), value)
                }
                _ => (Start::Mean, known.mean),
            };
            values.push(Known {
                exact: exact::<D>(known.wide, &asked.place)?,
                galerkin,
            });
            starts.push(Target {
                neighbour_value: match &functional {
                    Start::Weighted(_) => None,
                    _ => Some(galerkin),
                },
                functional,
            });
        }
        begin_walking();
        let start = Instant::now();
        let outcome = run(&cube, neighbour, &starts, plan, progress)
            .map_err(|error| not_finite(error, &formulas.watch))?;
        Ok(Answer {
            known: values,
            floors: floors(known.v, known.contraction, &outcome),
            outcome,
            solve: known.solve,
            setup_seconds: 0.0,
            pair_counts: None,
            walk_seconds: start.elapsed().as_secs_f64(),
            pointwise: self.pointwise_pairs()?,
            second_moment: known.second_moment,
            others: Vec::new(),
            besides: Vec::new(),
            fluxes: Vec::new(),
        })
    }

    /// Plain walks. Their neighbour equation 0 = 0 is called as all others are, so that no walk needs code of
    /// its own.
    fn plain_in<F: Real, const D: usize>(
        &self,
        plan: &Plan,
        progress: &Progress,
    ) -> Result<Answer, Failure> {
        let wide = Formulas::<f64>::new(self.cube)?;
        let formulas = Formulas::<F>::new(self.cube)?;
        let mut weighted = Vec::new();
        for text in self.weight_texts() {
            weighted.push(WeightedStart {
                weight: formulas.function("weight", kept(text)?),
                of_means: 0.0,
                neighbour_value: Box::new(|_, _, _| 0.0),
            });
        }
        let known = Deterministics {
            wide: &wide,
            formulas: &formulas,
            v: &[],
            mean: 0.0,
            weighted,
            contraction: 0.0,
            solve: NO_SOLVE,
            second_moment: None,
        };
        let none: &Boxed<'_, F, D> = &NoNeighbour::<FileCube<'_, F, D>>::new();
        self.walk_with(&known, none, plan, progress)
    }

    /// The weights that are asked for.
    fn weight_texts(&self) -> Vec<&str> {
        let texts = self.asked.iter().filter_map(|asked| match &asked.place {
            Where::Weight(text) => Some(text.as_str()),
            _ => None,
        });
        texts.collect()
    }

    /// Numbers near the means over the cells of every weight times the functions there.
    fn weight_means<F: Real, const D: usize, const B: usize>(
        &self,
        wide: &Formulas<f64>,
        cube: &FileCube<'_, F, D, B>,
    ) -> Result<Vec<Vec<F>>, Failure> {
        let same = wide.cube::<D>(self.per_axis, self.absorption())?;
        let same = same.with_functions::<B>();
        let mut all = Vec::new();
        for text in self.weight_texts() {
            let weight = wide.function("weight", kept(text)?);
            let mut means = vec![0.0; cube.cells() * B];
            same.means(&weight, self.rule()?, &mut means)
                .map_err(|error| explained(error, &wide.watch))?;
            all.push(rounded(&means).map_err(Failure::run)?);
        }
        Ok(all)
    }

    /// The weighted means that are asked for.
    fn weighted<'a, F: Real, const D: usize, const B: usize>(
        &self,
        formulas: &'a Formulas<F>,
        cube: &FileCube<'a, F, D, B>,
        means: &'a [Vec<F>],
        v: &[F],
    ) -> Result<Vec<WeightedStart<'a, F, D>>, Failure> {
        let mut all = Vec::new();
        for (text, means) in self.weight_texts().into_iter().zip(means) {
            let weight = formulas.function("weight", kept(text)?);
            let weighted = Weighted::new(cube, weight, means, v).map_err(Failure::run)?;
            all.push(WeightedStart {
                weight,
                of_means: weighted.of_means(),
                neighbour_value: Box::new(move |x0, phi, v| {
                    Functional::<FileCube<'_, F, D, B>>::neighbour_value(&weighted, x0, phi, v)
                }),
            });
        }
        Ok(all)
    }

    /// Refuses a `kernel_integral` that is not the integral of the kernel: it would be a bias that no error
    /// bar shows. Composite Gauss rules of 200 × 5 points on intervals without x = y.
    fn check_integral<const D: usize>(&self, formulas: &Formulas<f64>) -> Result<(), Failure> {
        const TICKS: [f64; 6] = [0.0, 0.21, 0.4, 0.62, 0.8, 1.0];
        let rule = Rule::new(5).map_err(Failure::run)?;
        let unit = Cube::<f64, 1, _, _>::new(
            |_: &[f64; 1], _: &[f64; 1]| 0.0,
            |_: &[f64; 1]| 0.0,
            200,
            0.5,
        )
        .map_err(Failure::run)?;
        for (axis, primitive) in formulas.integral.iter().enumerate() {
            let Some(kernel) = formulas.kernel.get(axis) else {
                continue;
            };
            for x in [0.1, 0.3, 0.5, 0.7, 0.9] {
                let intervals = TICKS.windows(2).map(|ends| (ends[0], ends[1]));
                for (low, high) in intervals.filter(|&(low, high)| x < low || high < x) {
                    let found = primitive.value(&[x], &[high]) - primitive.value(&[x], &[low]);
                    let mut means = vec![0.0; 200];
                    let at = |t: &[f64; 1]| kernel.value(&[x], &[low + (high - low) * t[0]]);
                    unit.means(&at, rule, &mut means)
                        .map_err(|error| explained(error, &formulas.watch))?;
                    let width = high - low;
                    let expected = width * means.iter().sum::<f64>() / 200.0;
                    let size = width * means.iter().map(|k| k.abs()).sum::<f64>() / 200.0;
                    if !((found - expected).abs() <= 1e-3 * size + 1e-12) {
                        return Err(self.wrong_integral(axis, x, [low, high], [expected, found]));
                    }
                }
            }
        }
        Ok(())
    }

    fn wrong_integral(&self, axis: usize, x: f64, ends: [f64; 2], values: [f64; 2]) -> Failure {
        let [low, high] = ends;
        let [expected, found] = values;
        let message = format!(
            "this is not the integral of the kernel over y: at x = {x}, from y = {low} to {high}, it gives \
             {found:.6} where the kernel's integral is {expected:.6}"
        );
        let place = match &self.cube.integral {
            Some(KernelText::General(text)) => &text.place,
            Some(KernelText::Factors(texts)) => match texts.value.get(axis) {
                Some(text) => &text.place,
                None => &texts.place,
            },
            None => &self.cube.dimension.place,
        };
        self.file.error(place, message).into()
    }

    /// Composite Gauss–Nyström: u_i = Σ_j w_j K(x_i, x_j) u_j + F(x_i) on the points of a Gauss rule in every
    /// cell, and the mean Σ w_i u_i.
    fn nystrom_in<const D: usize>(&self) -> Result<Vec<Deterministic>, Failure> {
        const MOST: usize = 1300;
        // Cells and points an axis.
        let rules = (1..=5).map(|points| (1_usize, points));
        let rules = rules.chain(
            [2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 100, 150, 200, 260].map(|cells| (cells, 5)),
        );
        let formulas = Formulas::<f64>::new(self.cube)?;
        let explain = |error| explained(error, &formulas.watch);
        let mut solutions = Vec::new();
        for (cells, points) in rules {
            let nodes = (cells * points).saturating_pow(D as u32);
            if nodes > MOST {
                break;
            }
            let cube = formulas.cube::<D>(cells, self.absorption())?;
            let rule = Rule::new(points).map_err(explain)?;
            let at: Vec<([f64; D], f64)> = (0..cube.cells())
                .flat_map(|cell| cube.points(rule, cell))
                .map(|(x, weight)| (x, weight / cube.cells() as f64))
                .collect();
            let kernel = formulas.kernel();
            let mut entries = empty_table(nodes).map_err(explain)?;
            fill_rows(&mut entries, nodes, |i, row| {
                for (out, (y, weight)) in row.iter_mut().zip(&at) {
                    *out = weight * kernel.kernel(&at[i].0, y);
                }
                Ok::<_, CubeError>(())
            })
            .map_err(explain)?;
            let source: Vec<f64> = at.iter().map(|(x, _)| cube.source(x)).collect();
            if let Some(what) = formulas.watch.get() {
                return Err(Failure::input(format_args!("Gauss-Nyström: {what}")));
            }
            let dense = Dense::new(&entries, nodes, 1)
                .ok_or_else(|| Failure::run("a table has a wrong size"))?;
            let mut u = source.clone();
            let sweeps = Sweeps::UntilResidual {
                residual: TOLERANCE * source.iter().fold(0.0, |m: f64, f| m.max(f.abs())),
                at_most: SWEEPS,
            };
            gauss_seidel(&dense, &source, &mut u, &mut [0.0; 2], sweeps).map_err(Failure::run)?;
            solutions.push(Deterministic {
                nodes,
                evaluations: match &self.cube.kernel {
                    KernelText::General(_) => (nodes as f64).powi(2),
                    KernelText::Factors(_) => ((cells * points) as f64).powi(2),
                },
                mean: at.iter().zip(&u).map(|((_, weight), u)| weight * u).sum(),
                error: None,
            });
        }
        Ok(solutions)
    }

    /// Seconds of an evaluation of the kernel.
    fn kernel_seconds(&self) -> f64 {
        seconds(&self.cube.kernel)
    }

    /// Seconds of an evaluation of its integral.
    fn integral_seconds(&self) -> f64 {
        self.cube.integral.as_ref().map_or(0.0, seconds)
    }
}

/// Seconds of the value of a kernel or of its integral.
fn seconds(text: &KernelText) -> f64 {
    match text {
        KernelText::General(text) => formula::seconds(&text.value),
        KernelText::Factors(texts) => {
            let texts = texts.value.iter();
            texts.map(|text| formula::seconds(&text.value)).sum()
        }
    }
}

/// The part of an axis in which a place lies: an eighth in one dimension, a quarter in two and half of it in more.
fn quarter(x: f64, dimension: usize) -> String {
    let parts = match dimension {
        1 => 8.0,
        2 => 4.0,
        _ => 2.0,
    };
    let part = (x * parts).floor().min(parts - 1.0);
    format!("[{}, {}]", part / parts, (part + 1.0) / parts)
}

/// A formula that validation has checked.
fn kept<F: Real>(text: &str) -> Result<Formula<'static, F>, Failure> {
    Formula::kept(text).map_err(|error| Failure::input(error.message))
}

/// The equation of a file.
pub(crate) type FileCube<'a, F, const D: usize, const B: usize = 1> =
    Cube<F, D, FileKernel<'a, F>, FileFunction<'a, F>, B>;

/// A neighbour equation of any kind and degree: one type of walk for all.
type Boxed<'a, F, const D: usize> = dyn Neighbour<Scalar = F, Point = [F; D]> + Sync + 'a;

/// How a neighbour equation with B functions on a cell is made.
trait Kinds<F: Real, const D: usize, const B: usize> {
    /// Makes it, and uses it.
    fn then(
        &self,
        cube: &FileCube<'_, F, D, B>,
        setup: &Setup<D>,
        v: &[F],
        use_it: &mut Use<'_, F, D>,
    ) -> Result<(), Failure>;

    /// Its pairs, of so many cells.
    fn pairs(&self, cells: usize) -> Result<AnyPairs<'_>, Failure>;
}

/// What is done with a neighbour equation.
type Use<'a, F, const D: usize> = dyn FnMut(&Boxed<'_, F, D>) -> Result<(), Failure> + 'a;

/// Without pointwise pairs.
struct Smooth(OffDiagonal);

/// With pointwise pairs, of piecewise constants.
enum Pointwise {
    /// All of them.
    All,
    /// The diagonal.
    Diagonal(OffDiagonal),
    /// Each for itself.
    Table(Vec<u8>),
}

impl<F: Real, const D: usize, const B: usize> Kinds<F, D, B> for Smooth {
    fn then(
        &self,
        cube: &FileCube<'_, F, D, B>,
        Setup {
            table, solution, ..
        }: &Setup<D>,
        v: &[F],
        use_it: &mut Use<'_, F, D>,
    ) -> Result<(), Failure> {
        let (narrow, pairs) = (Rounded::new(table), self.0);
        let g = solution.source(table, &pairs).map_err(Failure::run)?;
        use_it(&Piecewise::new(cube, &narrow, pairs, v, &g).map_err(Failure::run)?)
    }

    fn pairs(&self, _: usize) -> Result<AnyPairs<'_>, Failure> {
        Ok(AnyPairs::Diagonal(self.0))
    }
}

impl<F: Real, const D: usize> Kinds<F, D, 1> for Pointwise {
    fn then(
        &self,
        cube: &FileCube<'_, F, D>,
        setup: &Setup<D>,
        v: &[F],
        use_it: &mut Use<'_, F, D>,
    ) -> Result<(), Failure> {
        match self {
            Self::All => with_pairs(AllPointwise, cube, setup, v, use_it),
            Self::Diagonal(pairs) => with_pairs(*pairs, cube, setup, v, use_it),
            Self::Table(table) => {
                let pairs = PairTable::new(table, cube.cells()).map_err(Failure::run)?;
                with_pairs(pairs, cube, setup, v, use_it)
            }
        }
    }

    fn pairs(&self, cells: usize) -> Result<AnyPairs<'_>, Failure> {
        Ok(match self {
            // None is left out.
            Self::All => AnyPairs::Diagonal(OffDiagonal {
                diagonal: PairKind::Pointwise,
            }),
            Self::Diagonal(pairs) => AnyPairs::Diagonal(*pairs),
            Self::Table(table) => {
                AnyPairs::Table(PairTable::new(table, cells).map_err(Failure::run)?)
            }
        })
    }
}

fn with_pairs<F: Real, const D: usize>(
    pairs: impl galerkin::Pairs + Copy + Sync,
    cube: &FileCube<'_, F, D>,
    setup: &Setup<D>,
    v: &[F],
    use_it: &mut Use<'_, F, D>,
) -> Result<(), Failure> {
    let (table, narrow) = (&setup.table, Rounded::new(&setup.table));
    let g = setup.solution.source(table, &pairs).map_err(Failure::run)?;
    use_it(&Piecewise::with_pointwise(cube, &narrow, pairs, v, &g).map_err(Failure::run)?)
}

/// What walks need of the set-up, whatever the degree.
struct Deterministics<'a, F: 'static, const D: usize> {
    wide: &'a Formulas<f64>,
    formulas: &'a Formulas<F>,
    v: &'a [F],
    /// The mean of v.
    mean: f64,
    weighted: Vec<WeightedStart<'a, F, D>>,
    contraction: f64,
    solve: Solve<f64>,
    second_moment: Option<f64>,
}

/// Where the walks of a target start.
enum Start<'a, F: 'static, const D: usize> {
    Point(At<[F; D]>),
    Mean,
    Weighted(&'a WeightedStart<'a, F, D>),
}

/// What a functional scores of v at a start, from φ(x0) and v(x0).
type Score<'a, F, const D: usize> = dyn Fn(&Located<[F; D]>, F, F) -> f64 + Sync + 'a;

/// A [`Weighted`] of any degree.
struct WeightedStart<'a, F: 'static, const D: usize> {
    weight: FileFunction<'a, F>,
    of_means: f64,
    neighbour_value: Box<Score<'a, F, D>>,
}

impl<'k, F: Real, const D: usize> Functional<FileCube<'k, F, D>> for Start<'_, F, D> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> ([F; D], F) {
        match self {
            Self::Point(At(x)) => (*x, F::one()),
            Self::Mean => Functional::<FileCube<'k, F, D>>::start(&Mean, uniforms),
            Self::Weighted(weighted) => {
                let (x, _) = Functional::<FileCube<'k, F, D>>::start(&Mean, uniforms);
                (x, weighted.weight.value(&x))
            }
        }
    }

    fn neighbour_value(&self, x0: &Located<[F; D]>, phi: F, v: F) -> f64 {
        match self {
            Self::Weighted(weighted) => (weighted.neighbour_value)(x0, phi, v),
            // These are known.
            Self::Point(_) | Self::Mean => (phi * v).to_f64(),
        }
    }
}

/// A point of the file.
fn coordinates<F: Real, const D: usize>(x: &[f64]) -> [F; D] {
    core::array::from_fn(|a| F::from_f64(x.get(a).copied().unwrap_or(0.0)))
}

/// (u, Φ), where the solution is known and a mean of it could be computed.
fn exact<const D: usize>(formulas: &Formulas<f64>, place: &Where) -> Result<Option<f64>, Failure> {
    let Some(u) = formulas.solution else {
        return Ok(None);
    };
    // The formulas' own has what was not finite before the walks, which is nothing.
    let watch = Watch::new();
    let watched = |name, formula| FileFunction {
        name,
        formula,
        watch: &watch,
    };
    let u = watched("solution", u);
    let value = match place {
        Where::Point(x) => Some(u.value(&coordinates::<f64, D>(x))),
        Where::All => integral::<D>(&watch, |x| u.value(x))?,
        Where::Weight(text) => {
            let weight = watched("weight", kept(text)?);
            integral::<D>(&watch, |x| u.value(x) * weight.value(x))?
        }
        _ => None,
    };
    match watch.get() {
        Some(what) => Err(Failure::input(format_args!(
            "{what}: a finite number is needed there"
        ))),
        None => Ok(value),
    }
}

/// An error of the walks, with what was not finite where that is the reason.
fn not_finite(error: RunError, watch: &Watch) -> Failure {
    match (error, watch.get()) {
        (RunError::NotFinite { .. }, Some(what)) => {
            Failure::input(format_args!("{what}: a finite number is needed there"))
        }
        (error, _) => Failure::run(error),
    }
}

impl Problem for CubeFile<'_> {
    fn kind(&self) -> &'static str {
        "cube"
    }

    fn dimension(&self) -> Option<usize> {
        Some(self.cube.dimension.value)
    }

    fn cells(&self) -> usize {
        self.per_axis
    }

    fn unknowns(&self) -> usize {
        self.all_cells().saturating_mul(self.functions())
    }

    fn asked(&self) -> &[Asked] {
        &self.asked
    }

    fn memory(&self) -> usize {
        let n = self.unknowns();
        let table = match &self.cube.kernel {
            KernelText::General(_) => table_bytes(n).unwrap_or(usize::MAX),
            KernelText::Factors(factors) => {
                let width = self.per_axis.saturating_mul(self.degree() + 1);
                let tables = width
                    .saturating_mul(width)
                    .saturating_mul(factors.value.len());
                // All products of polynomials along the axes, while K'v is computed.
                let tensor = width.saturating_pow(factors.value.len() as u32);
                tables.saturating_add(tensor).saturating_mul(8)
            }
        };
        let weights = self
            .asked
            .iter()
            .filter(|asked| matches!(asked.place, Where::Weight(_)));
        // F', v, G, their copies and the iteration's own vectors.
        let vectors = n.saturating_mul(8 * (8 + weights.count()));
        let targets = self.asked.len().saturating_mul(1024);
        let nodes = 2_usize.saturating_pow(self.cube.dimension.value as u32);
        let theory = theory::memory(self.file, self.all_cells(), nodes);
        table
            .saturating_add(vectors)
            .saturating_add(targets)
            .saturating_add(theory)
    }

    fn cost(&self) -> Cost {
        let d = self.cube.dimension.value;
        let seconds = self.kernel_seconds();
        let points = self.points().pow(d as u32) as f64;
        let (n, b) = (self.all_cells() as f64, self.functions() as f64);
        let values = if self.degree() == 0 { 0.0 } else { VALUE * b };
        let (setup, source) = match &self.cube.kernel {
            KernelText::General(_) => {
                let integrals = points * points * (seconds + values) + points * VALUE * b * b;
                (n * n * (integrals + 20e-9 * b * b), 3e-9 * (n * b).powi(2))
            }
            KernelText::Factors(_) => {
                let (m, functions) = (self.per_axis as f64, (self.degree() + 1) as f64);
                let axes = m * m * (self.points().pow(2) as f64) * (seconds + values);
                let sweeps = n * functions.powi(d as i32) * m * functions * d as f64;
                (axes + 12e-9 * sweeps, 0.7e-9 * sweeps)
            }
        };
        let (d, b) = (d as f64, if self.degree() == 0 { 0.0 } else { b });
        let (axis, contraction) = match &self.cube.kernel {
            KernelText::General(_) if n * n * b * b > CACHED => (10e-9, 1.5e-9 * b * b),
            KernelText::General(_) => (10e-9, 0.3e-9 * b * b),
            KernelText::Factors(_) => (17e-9, 10e-9 * d * b + 0.35e-9 * b * b),
        };
        let step = axis * d + seconds;
        let plain = WalkCost {
            start: step,
            step,
            score: 10e-9 + formula::seconds(&self.cube.source.value),
            pair: 0.0,
            hidden_pair: 0.0,
        };
        Cost {
            setup,
            source,
            walk: WalkCost {
                start: step + contraction,
                step: step + contraction,
                pair: 2.0 * self.integral_seconds(),
                ..plain
            },
            plain,
        }
    }

    fn pointwise_pairs(&self) -> Result<PointwisePairs, Failure> {
        let seen = match self.pairs() {
            None => self.all_cells() as f64,
            Some(pairs) => f64::from(u8::from(pairs.diagonal == PairKind::Pointwise)),
        };
        Ok(PointwisePairs { seen, hidden: 0.0 })
    }

    fn refuse_infinite_variance(&self) -> Result<(), Failure> {
        let radius = Problem::second_moment(self)?;
        if radius < 1.0 {
            return Ok(());
        }
        Err(infinite_variance(self.file, "K²/(1 − absorption)", radius))
    }

    fn second_moment(&self) -> Result<f64, Failure> {
        let d = self.cube.dimension.value;
        in_dimension!(d, D => self.second_moment_in::<D>())
    }

    fn absorption(&self) -> f64 {
        self.file.walk.absorption.value
    }

    fn mean_on(&self, cells: usize) -> Result<Box<dyn Problem + '_>, Failure> {
        Ok(Box::new(Self {
            per_axis: cells,
            asked: vec![Asked {
                name: "mean".to_owned(),
                place: Where::All,
            }],
            ..self.clone()
        }))
    }

    fn levels(&self) -> Vec<usize> {
        let levels: &[usize] = match self.cube.dimension.value {
            _ if self.degree() > 0 => &[1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128, 256, 512],
            1 => &[4, 8, 16, 32, 64, 128, 256, 512, 1024],
            2 => &[2, 4, 8, 12, 16, 24, 32],
            3 => &[2, 3, 4, 5, 6, 8, 10],
            4 => &[2, 3, 4, 5],
            5 => &[2, 3, 4],
            _ => &[2, 3],
        };
        let most = if self.degree() > 0 { LEVEL } else { usize::MAX };
        let d = self.cube.dimension.value as u32;
        let unknowns = |m: usize| m.saturating_pow(d).saturating_mul(self.functions());
        let levels = levels.iter().copied();
        levels.filter(|&m| unknowns(m) <= most).collect()
    }

    /// Of a product, its factors one by one count as one evaluation.
    fn evaluations(&self, _: u32) -> f64 {
        let points = self.points() as f64;
        let d = self.cube.dimension.value as i32;
        match &self.cube.kernel {
            KernelText::General(_) => (self.all_cells() as f64 * points.powi(d)).powi(2),
            KernelText::Factors(_) => (self.per_axis as f64 * points).powi(2),
        }
    }

    fn counts_evaluations(&self) -> bool {
        true
    }

    fn nystrom(&self) -> Result<Vec<Deterministic>, Failure> {
        let d = self.cube.dimension.value;
        in_dimension!(d, D => self.nystrom_in::<D>())
    }

    fn diagnose(&self, request: &Request<'_>) -> Result<Diagnosis, Failure> {
        self.diagnose_with(request)
    }

    fn tables(&self) -> Result<TableBuilder, Failure> {
        let d = self.cube.dimension.value;
        match self.file.walk.scalar.value {
            Scalar::F32 => in_shape!(d, self.degree(), D, B => self.tables_in::<f32, D, B>()),
            Scalar::F64 => in_shape!(d, self.degree(), D, B => self.tables_in::<f64, D, B>()),
        }
    }

    fn plain(&self, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        let d = self.cube.dimension.value;
        match self.file.walk.scalar.value {
            Scalar::F32 => in_dimension!(d, D => self.plain_in::<f32, D>(plan, progress)),
            Scalar::F64 => in_dimension!(d, D => self.plain_in::<f64, D>(plan, progress)),
        }
    }

    fn solve(&self) -> Result<Solved, Failure> {
        let (d, degree) = (self.cube.dimension.value, self.degree());
        let formulas = Formulas::new(self.cube)?;
        in_shape!(d, degree, D, B => Solved::new(|| self.system::<D, B>(&formulas)))
    }

    fn walk(&self, solved: &Solved, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        match self.file.walk.scalar.value {
            Scalar::F32 => self.answer_with::<f32>(solved, plan, progress),
            Scalar::F64 => self.answer_with::<f64>(solved, plan, progress),
        }
    }
}
