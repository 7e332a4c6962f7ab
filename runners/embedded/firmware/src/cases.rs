//! What is run on the device and on the workstation, by the same code: circles, cubes, rooms and
//! scenes,
//! f32 and f64, several degrees, tables of every form, both estimators.

mod circle_table;
mod room_table;
mod scene_cases;
mod scene_table;

use fredholm_circle::{Cell, Cells, Circle, Harmonic, MeanOver, Moment, Residual, Slot, slots};
use fredholm_core::galerkin::{
    Coefficients, Dense, DiagonalRule, PairKind, Piecewise, Rounded, StoppingRule, gauss_seidel,
    max_row_sum, neighbour_source,
};
use fredholm_core::{
    At, DefaultGenerator, Equation, Estimator, Form, Functional, Length, Neighbour, NeighbourOf,
    Real, RunOptions, StateSpace, Statistics, Task, Tolerance, WalkSeeds,
};
use fredholm_cube::{
    Cube, FactorTables, KernelFactors, KernelFn, Mean, Product, ScalarField, functions,
};
use fredholm_embedded::zerocopy::{FromBytes, Immutable};
use fredholm_embedded::{Aligned, Driver, Table};
use fredholm_room::{RayNeighbour, Room};
use room_table::RoomTable;

/// Constants that `fredholm export -o FILE.rs` wrote.
mod circle_f64 {
    include!("../tables/circle_f64.rs");
}
mod circle_cubic_f32 {
    include!("../tables/circle_cubic_f32.rs");
}
mod cube_f32 {
    include!("../tables/cube_f32.rs");
}
mod cube_quadratic_f64 {
    include!("../tables/cube_quadratic_f64.rs");
}
mod product_f64 {
    include!("../tables/product_f64.rs");
}
mod product_cubic_f32 {
    include!("../tables/product_cubic_f32.rs");
}
mod room_f32 {
    include!("../tables/room_f32.rs");
}
mod room_quadratic_f32 {
    include!("../tables/room_quadratic_f32.rs");
}
/// Tables that `fredholm export -o FILE.bin` wrote.
static CIRCLE_F32: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/circle_f32.bin"));
static CIRCLE_QUARTIC_F64: &Aligned<[u8]> =
    &Aligned(*include_bytes!("../tables/circle_quartic_f64.bin"));
static CUBE_F64: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/cube_f64.bin"));
static CUBE_QUADRATIC_F32: &Aligned<[u8]> =
    &Aligned(*include_bytes!("../tables/cube_quadratic_f32.bin"));
static PRODUCT_F32: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/product_f32.bin"));
static PRODUCT_CUBIC_F64: &Aligned<[u8]> =
    &Aligned(*include_bytes!("../tables/product_cubic_f64.bin"));
static ROOM_F64: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/room_f64.bin"));
static ROOM_RAYS_F32: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/room_rays_f32.bin"));
static ROOM_CUBIC_F64: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/room_cubic_f64.bin"));

/// The seed of all cases.
pub const SEED: u64 = 7;

/// The draws of goal number `goal`.
pub fn seeds(goal: u64) -> WalkSeeds<DefaultGenerator> {
    WalkSeeds::new(SEED, goal)
}

/// Where its walks start.
pub trait Start<E: StateSpace>: Functional<E> + Copy + Sync {}
impl<E: StateSpace, T: Functional<E> + Copy + Sync> Start<E> for T {}

/// A case.
pub type Case<'a, E, N, T> = Task<'a, E, N, T, DefaultGenerator>;

/// Who runs a case.
pub trait Runner {
    /// Runs the case with the seeds of goal `goal`.
    fn run<E: Equation + Sync, N: NeighbourOf<E> + Sync, T: Start<E>>(
        &mut self,
        name: &str,
        case: Case<'_, E, N, T>,
        goal: u64,
        options: RunOptions,
    );
}

/// Runs a case to its end by [`Driver`], so many walks at a time, and calls `after` after each poll.
/// `None`: the options were refused, or a walk was not finite.
pub fn drive<E: Equation + Sync, N: NeighbourOf<E> + Sync + ?Sized, T: Start<E>>(
    case: Case<'_, E, N, T>,
    options: RunOptions,
    walks: u64,
    mut after: impl FnMut(),
) -> Option<Statistics> {
    let mut driver = Driver::new(case, options).ok()?;
    loop {
        let stop = driver.poll(walks).ok()?.stop;
        after();
        if stop.is_some() {
            return Some(driver.statistics());
        }
    }
}

/// 1000 walks in batches of 128, the last of which is not whole.
fn options() -> RunOptions {
    RunOptions {
        walks: 1000,
        batch: 128,
        tolerance: None,
    }
}

/// As [`options`] with four times the walks, but stops after a whole stage at the tolerance.
fn until(tolerance: Tolerance) -> RunOptions {
    RunOptions {
        walks: 4000,
        tolerance: Some(tolerance),
        ..options()
    }
}

/// All cases. `None`: a table or a problem was refused.
pub fn all(runner: &mut impl Runner) -> Option<()> {
    own_solve("circle/own", &mut Buffers::<f32>::default(), runner)?;
    own_solve("circle/own", &mut Buffers::<f64>::default(), runner)?;
    circle_of_bytes(runner)?;
    circle_of_constants(runner)?;
    cubic_circle(runner)?;
    quartic_circle(runner)?;
    cubes(runner)?;
    cubes_of_degree(runner)?;
    rooms(runner)?;
    rooms_of_degree(runner)?;
    room_of_rays(runner)?;
    scene_cases::scenes(runner)
}

fn both<E: Equation + Sync, N: NeighbourOf<E> + Sync, T: Start<E>>(
    runner: &mut impl Runner,
    name: &str,
    (equation, neighbour): (&E, &N),
    (functional, control_mean, goal): (&T, Option<f64>, u64),
    options: RunOptions,
) {
    for estimator in [Estimator::Absorption, Estimator::Collision] {
        let case = Task {
            equation,
            neighbour,
            functional,
            control_mean,
            estimator,
            form: Form::Product,
            seeds: seeds(goal),
            length: Length::default(),
        };
        runner.run(name, case, goal, options);
    }
}

/// Of a circle: the default.
const DIAGONAL_POINTWISE: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Pointwise,
};

const LIGHT: Harmonic = Harmonic {
    constant: 5.0,
    amplitude: 1.0,
    frequency: 5,
};
const CELLS: usize = 40;

/// What a device needs to solve a circle by itself.
struct Buffers<F> {
    cells: [Cell<F>; CELLS],
    slots: [Slot<F>; slots(CELLS)],
    source: [F; CELLS],
    v: [F; CELLS],
    g: [F; CELLS],
}

impl<F: Real> Default for Buffers<F> {
    fn default() -> Self {
        Self {
            cells: [Cell::default(); CELLS],
            slots: [Slot::default(); slots(CELLS)],
            source: [F::zero(); CELLS],
            v: [F::zero(); CELLS],
            g: [F::zero(); CELLS],
        }
    }
}

/// The Galerkin solve on the device itself, in the caller's buffers; u(0.3), until an error is
/// reached.
fn own_solve<F: Real>(
    name: &str,
    buffers: &mut Buffers<F>,
    runner: &mut impl Runner,
) -> Option<()> {
    let Buffers {
        cells,
        slots,
        source,
        v,
        g,
    } = buffers;
    let cells = Cells::fill(&[0.3, 0.7], cells, slots).ok()?;
    let circle = Circle::new(cells, LIGHT, 0.2).ok()?;
    circle.source_means(source).ok()?;
    max_row_sum(&circle).ok()?;
    gauss_seidel(&circle, source, v, &mut [], StoppingRule::Fixed(20)).ok()?;
    let pairs = DIAGONAL_POINTWISE;
    neighbour_source(&circle, &pairs, v, g).ok()?;
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, g).ok()?;
    let x0 = circle.point(0.3);
    let v0 = neighbour.value(&neighbour.locate(x0)).to_f64();
    let start = (&At(x0), Some(v0), 0);
    let options = until(Tolerance::Absolute(6e-3));
    both(runner, name, (&circle, &neighbour), start, options);
    Some(())
}

/// Everything from a compact table: its mean over [1, 4], of known (v, Φ).
fn circle_of_bytes(runner: &mut impl Runner) -> Option<()> {
    let table = Table::read(&CIRCLE_F32.0, "circle").ok()?;
    let circle = circle_table::circle::<f32>(&table)?;
    if (table.one::<u32>("degree"), table.one::<u32>("pairs")) != (Ok(0), Ok(1)) {
        return None;
    }
    let (v, g) = (table.slice("v").ok()?, table.slice("source").ok()?);
    let pairs = DIAGONAL_POINTWISE;
    let neighbour = Piecewise::with_pointwise(&circle, &circle, pairs, v, g).ok()?;
    let mean = MeanOver::new(&circle, 1.0, 4.0).ok()?;
    let start = (&mean, Some(mean.of(v)), 1);
    let all = (&circle, &neighbour);
    both(runner, "circle/bytes", all, start, options());
    Some(())
}

/// All pairs pointwise, from constants in Rust; (v, Φ) walk by walk.
fn circle_of_constants(runner: &mut impl Runner) -> Option<()> {
    use circle_f64::{CELLS, CIRCLE, DEGREE, HARMONIC, MOMENTS, PAIRS, SLOTS, V};
    let moments: &[Moment<f64>] = &MOMENTS;
    let light = circle_table::harmonic(&HARMONIC)?;
    if (DEGREE, PAIRS) != ([0], [3]) {
        return None;
    }
    let cells = Cells::new(&CELLS, &SLOTS).ok()?;
    let circle = Circle::with_constants(cells, light, CIRCLE[0]).ok()?;
    let neighbour = Residual::new(&circle, &V, moments).ok()?;
    let mean = MeanOver::new(&circle, 1.0, 4.0).ok()?;
    let start = (&mean, None, 2);
    let all = (&circle, &neighbour);
    both(runner, "circle/constants", all, start, options());
    Some(())
}

/// Cubic polynomials, the diagonal pointwise, from constants in Rust: u(0.3).
fn cubic_circle(runner: &mut impl Runner) -> Option<()> {
    use circle_cubic_f32::{CELLS, CIRCLE, DEGREE, HARMONIC, PAIRS, SLOTS, SOURCE, V};
    let light = circle_table::harmonic(&HARMONIC)?;
    if (DEGREE, PAIRS) != ([3], [1]) {
        return None;
    }
    let cells = Cells::<f32>::new(&CELLS, &SLOTS).ok()?;
    let circle = Circle::with_constants(cells, light, CIRCLE[0]).ok()?;
    let cubic = circle.with_functions::<4>();
    let pairs = DIAGONAL_POINTWISE;
    let neighbour = Piecewise::with_pointwise(&cubic, &cubic, pairs, &V, &SOURCE).ok()?;
    let x0 = circle.point(0.3);
    let v0 = neighbour.value(&neighbour.locate(x0)).to_f64();
    let start = (&At(x0), Some(v0), 7);
    both(
        runner,
        "circle/cubic",
        (&circle, &neighbour),
        start,
        options(),
    );
    Some(())
}

/// Quartic polynomials, all pairs pointwise, from a compact table: the mean over [1, 4].
fn quartic_circle(runner: &mut impl Runner) -> Option<()> {
    let table = Table::read(&CIRCLE_QUARTIC_F64.0, "circle").ok()?;
    let circle = circle_table::circle::<f64>(&table)?;
    if (table.one::<u32>("degree"), table.one::<u32>("pairs")) != (Ok(4), Ok(3)) {
        return None;
    }
    let (v, moments) = (table.slice("v").ok()?, table.slice("moments").ok()?);
    let quartic = circle.with_functions::<5>();
    let neighbour = Residual::new(&quartic, v, moments).ok()?;
    let mean = MeanOver::new(&circle, 1.0, 4.0).ok()?;
    let start = (&mean, Some(mean.of(v)), 8);
    let all = (&circle, &neighbour);
    both(runner, "circle/quartic", all, start, options());
    Some(())
}

/// K(x,y) = ½ exp(−|x − y|²), which the tables' files have as formulas.
#[derive(Clone, Copy, Debug)]
struct Gauss;

impl<F: Real> KernelFactors<F> for Gauss {
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let scale = if axis == 0 { 0.5 } else { 1.0 };
        F::from_f64(scale) * (-(x - y) * (x - y)).exp()
    }
}

impl<F: Real> KernelFn<F, 2> for Gauss {
    fn kernel(&self, x: &[F; 2], y: &[F; 2]) -> F {
        let (a, b) = (x[0] - y[0], x[1] - y[1]);
        F::from_f64(0.5) * (-(a * a + b * b)).exp()
    }
}

/// F(x) = 1 + x₁ + x₂.
#[derive(Clone, Copy, Debug)]
struct Ramp;

impl<F: Real> ScalarField<F, 2> for Ramp {
    fn value(&self, x: &[F; 2]) -> F {
        F::one() + x[0] + x[1]
    }
}

fn cubes(runner: &mut impl Runner) -> Option<()> {
    // A dense table as constants in f32, and as bytes in f64.
    {
        use cube_f32::{ABSORB, AXES, COEFFS, DEGREE, PAIRS, SOURCE, V};
        let head = Head::of_constants([&AXES, &DEGREE, &PAIRS], ABSORB);
        let dense = Dense::new(&COEFFS[..], V.len(), 1)?;
        let (name, vectors) = ("cube/dense", [&V[..], &SOURCE]);
        cube::<f32, _, _, 1>(name, Gauss, head, &dense, vectors, runner)?;
    }
    {
        let table = Table::read(&CUBE_F64.0, "cube").ok()?;
        let (head, vectors) = (Head::read(&table)?, vectors::<f64>(&table)?);
        let dense = Dense::new(table.slice("coeffs").ok()?, vectors[0].len(), 1)?;
        cube::<f64, _, _, 1>("cube/dense", Gauss, head, &dense, vectors, runner)?;
    }
    // Tables of the factors: as bytes, and as constants. They are f64, and products are rounded.
    {
        let table = Table::read(&PRODUCT_F32.0, "cube").ok()?;
        let (head, vectors) = (Head::read(&table)?, vectors::<f32>(&table)?);
        let factors = factors::<1>(&head, table.slice("factors").ok()?)?;
        let (name, rounded) = ("cube/product", Rounded::new(&factors));
        cube::<f32, _, _, 1>(name, Product(Gauss), head, &rounded, vectors, runner)?;
    }
    {
        use product_f64::{ABSORB, AXES, DEGREE, FACTORS, PAIRS, SOURCE, V};
        let head = Head::of_constants([&AXES, &DEGREE, &PAIRS], ABSORB);
        let factors = factors::<1>(&head, &FACTORS)?;
        let (name, vectors) = ("cube/product", [&V[..], &SOURCE]);
        cube::<f64, _, _, 1>(name, Product(Gauss), head, &factors, vectors, runner)?;
    }
    Some(())
}

/// The same of degree 2 and 3: tables are f64, and what is contracted is rounded.
fn cubes_of_degree(runner: &mut impl Runner) -> Option<()> {
    const QUADRATIC: usize = functions(2, 2);
    const CUBIC: usize = functions(2, 3);
    {
        let table = Table::read(&CUBE_QUADRATIC_F32.0, "cube").ok()?;
        let (head, vectors) = (Head::read(&table)?, vectors::<f32>(&table)?);
        let cells = vectors[0].len() / QUADRATIC;
        let dense = Dense::new(table.slice("coeffs").ok()?, cells, QUADRATIC)?;
        let (name, rounded) = ("cube/quadratic", Rounded::new(&dense));
        cube::<f32, _, _, QUADRATIC>(name, Gauss, head, &rounded, vectors, runner)?;
    }
    {
        use cube_quadratic_f64::{ABSORB, AXES, COEFFS, DEGREE, PAIRS, SOURCE, V};
        let head = Head::of_constants([&AXES, &DEGREE, &PAIRS], ABSORB);
        let dense = Dense::new(&COEFFS[..], V.len() / QUADRATIC, QUADRATIC)?;
        let (name, vectors) = ("cube/quadratic", [&V[..], &SOURCE]);
        cube::<f64, _, _, QUADRATIC>(name, Gauss, head, &dense, vectors, runner)?;
    }
    {
        use product_cubic_f32::{ABSORB, AXES, DEGREE, FACTORS, PAIRS, SOURCE, V};
        let head = Head::of_constants([&AXES, &DEGREE, &PAIRS], ABSORB);
        let factors = factors::<CUBIC>(&head, &FACTORS)?;
        let (name, rounded, vectors) = ("cube/cubic", Rounded::new(&factors), [&V[..], &SOURCE]);
        cube::<f32, _, _, CUBIC>(name, Product(Gauss), head, &rounded, vectors, runner)?;
    }
    {
        let table = Table::read(&PRODUCT_CUBIC_F64.0, "cube").ok()?;
        let (head, vectors) = (Head::read(&table)?, vectors::<f64>(&table)?);
        let factors = factors::<CUBIC>(&head, table.slice("factors").ok()?)?;
        let name = "cube/cubic";
        cube::<f64, _, _, CUBIC>(name, Product(Gauss), head, &factors, vectors, runner)?;
    }
    Some(())
}

/// The arrays of one or two numbers in a cube's table.
struct Head<'a> {
    /// Dimension, and cells an axis.
    axes: &'a [u32],
    degree: &'a [u32],
    pairs: &'a [u32],
    /// q0.
    absorption: f64,
}

impl<'a> Head<'a> {
    fn of_constants([axes, degree, pairs]: [&'a [u32]; 3], [absorption]: [f64; 1]) -> Self {
        Self {
            axes,
            degree,
            pairs,
            absorption,
        }
    }

    fn read(table: &Table<'a>) -> Option<Self> {
        Some(Self {
            axes: table.slice("axes").ok()?,
            degree: table.slice("degree").ok()?,
            pairs: table.slice("pairs").ok()?,
            absorption: table.one("absorb").ok()?,
        })
    }

    /// Cells an axis, if this is the equation in two dimensions with all pairs in S.
    fn per_axis(&self) -> Option<usize> {
        match (self.axes, self.pairs) {
            ([2, per_axis], [0]) => Some(*per_axis as usize),
            _ => None,
        }
    }
}

/// v and G.
fn vectors<'a, F: FromBytes + Immutable>(table: &Table<'a>) -> Option<[&'a [F]; 2]> {
    Some([table.slice("v").ok()?, table.slice("source").ok()?])
}

fn factors<'a, const B: usize>(
    head: &Head<'_>,
    entries: &'a [f64],
) -> Option<FactorTables<'a, f64, 2, B>> {
    FactorTables::of_functions(head.per_axis()?, entries).ok()
}

/// u(0.3, 0.6), and the mean of u until a relative error is reached.
fn cube<F: Real, K, C, const B: usize>(
    name: &str,
    kernel: K,
    head: Head<'_>,
    coefficients: &C,
    [v, g]: [&[F]; 2],
    runner: &mut impl Runner,
) -> Option<()>
where
    K: KernelFn<F, 2> + Sync,
    C: Coefficients<B, Scalar = F> + Sync,
{
    let cube = Cube::<F, 2, _, _>::new(kernel, Ramp, head.per_axis()?, head.absorption).ok()?;
    let cube = cube.with_functions::<B>();
    if head.degree != [cube.degree() as u32] {
        return None;
    }
    let pairs = DiagonalRule {
        diagonal: PairKind::Galerkin,
    };
    let neighbour = Piecewise::new(&cube, coefficients, pairs, v, g).ok()?;
    let x0 = [F::from_f64(0.3), F::from_f64(0.6)];
    let v0 = neighbour.value(&neighbour.locate(x0)).to_f64();
    let all = (&cube, &neighbour);
    both(runner, name, all, (&At(x0), Some(v0), 3), options());
    let relative = until(Tolerance::Relative(2e-3));
    let mean = (&Mean, Some(Mean::of_blocks::<F, B>(v)), 4);
    both(runner, name, all, mean, relative);
    Some(())
}

/// The arrays of a room as constants of a module.
macro_rules! room_of_constants {
    ($module:ident) => {
        RoomTable {
            absorb: $module::ABSORB[0],
            open: $module::OPEN[0],
            walls: &$module::WALLS,
            strips: &$module::STRIPS,
            nodes: &$module::NODES,
            edges: &$module::EDGES,
            cells: &$module::CELLS,
            first: &$module::FIRST,
            lengths: &$module::LENGTHS,
            surfaces: &$module::SURFACES,
            views: &$module::VIEWS,
            degree: $module::DEGREE[0],
            coeffs: &$module::COEFFS,
            v: &$module::V,
            source: &$module::SOURCE,
            pairs: $module::PAIRS[0],
        }
    };
}

/// The same room as constants in f32, and as bytes in f64.
fn rooms(runner: &mut impl Runner) -> Option<()> {
    let constants = room_of_constants!(room_f32);
    constant_room::<f32>(&constants, runner)?;
    let table = Table::read(&ROOM_F64.0, "room").ok()?;
    constant_room(&RoomTable::<f64>::read(&table)?, runner)
}

/// A smaller room of degree 2 and 3: coefficients are f64, and what is contracted is rounded.
fn rooms_of_degree(runner: &mut impl Runner) -> Option<()> {
    let constants = room_of_constants!(room_quadratic_f32);
    polynomial_room::<f32, 3>("room/quadratic", &constants, runner)?;
    let table = Table::read(&ROOM_CUBIC_F64.0, "room").ok()?;
    polynomial_room::<f64, 4>("room/cubic", &RoomTable::read(&table)?, runner)
}

/// The room without pairs.
fn room_of_rays(runner: &mut impl Runner) -> Option<()> {
    let bytes = Table::read(&ROOM_RAYS_F32.0, "room").ok()?;
    let table = RoomTable::<f32>::read(&bytes)?;
    let (room, control) = (table.room()?, room_table::rays(&bytes)?);
    let polynomials = room.with_functions::<2>();
    let neighbour = RayNeighbour::new(&polynomials, table.v, control).ok()?;
    room_starts("room/rays", &table, (&room, &neighbour), runner)
}

fn constant_room<F: Real>(table: &RoomTable<'_, F>, runner: &mut impl Runner) -> Option<()> {
    let (room, pairs) = (table.room()?, table.pairs()?);
    let dense = table.coefficients::<1>()?;
    let (v, g) = (table.v, table.source);
    let neighbour = Piecewise::with_pointwise(&room, &dense, pairs, v, g).ok()?;
    room_starts("room", table, (&room, &neighbour), runner)
}

fn polynomial_room<F: Real, const B: usize>(
    name: &str,
    table: &RoomTable<'_, F, f64>,
    runner: &mut impl Runner,
) -> Option<()> {
    let (room, pairs) = (table.room()?, table.pairs()?);
    let polynomials = room.with_functions::<B>();
    let dense = table.coefficients::<B>()?;
    let rounded = Rounded::new(&dense);
    let (v, g) = (table.v, table.source);
    let neighbour = Piecewise::with_pointwise(&polynomials, &rounded, pairs, v, g).ok()?;
    room_starts(name, table, (&room, &neighbour), runner)
}

/// u on the floor, in the shade of a block where there is one, until an error is reached, and the
/// mean over the left side of the baffle.
fn room_starts<'a, F: Real, C, N: NeighbourOf<Room<'a, F>> + Sync>(
    name: &str,
    table: &RoomTable<'a, F, C>,
    all: (&Room<'a, F>, &N),
    runner: &mut impl Runner,
) -> Option<()> {
    const FLOOR: usize = 0;
    const BAFFLE: usize = 4;
    let (room, neighbour) = all;
    let x0 = table.point(room, FLOOR, 0.3)?;
    let v0 = neighbour.value(&neighbour.locate(x0)).to_f64();
    // A walk takes a hundred times that of a circle: a quarter of the walks.
    let few = |options: RunOptions| RunOptions {
        walks: options.walks / 4,
        batch: options.batch / 4,
        ..options
    };
    let absolute = few(until(Tolerance::Absolute(2.6e-3)));
    both(runner, name, all, (&At(x0), Some(v0), 5), absolute);
    let mean = table.mean_over(room, BAFFLE)?;
    let start = (&mean, Some(mean.of(table.v)), 6);
    both(runner, name, all, start, few(options()));
    Some(())
}
