//! What is run on the device and on the workstation, by the same code: a circle that the device solves by itself, a circle and a
//! scene from tables, f32 and f64, however walks end.

mod circle;
mod scene;

use fredholm_circle::{BorrowedTables, Cell, Circle, Constants, Harmonic, MeanOver, Slot, slots};
use fredholm_core::galerkin::{
    DiagonalRule, PairKind, Piecewise, StoppingRule, gauss_seidel, max_row_sum, neighbour_source,
};
use fredholm_core::{
    Absorption, At, Equation, Estimator, Form, Functional, Goal, Goals, LastStep, Neighbour,
    NeighbourOf, Real, RunOptions, Space, Statistics, Tolerance, WalkOptions,
};
use fredholm_embedded::zerocopy::{FromBytes, Immutable};
use fredholm_embedded::{Aligned, Driver, Tables};

/// Tables that a workstation wrote: `FREDHOLM_WRITE=1 cargo test -p fredholm-tests --test suite device`.
static CIRCLE_F32: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/circle_f32.bin"));
static SCENE_F32: &Aligned<[u8]> = &Aligned(*include_bytes!("../tables/scene_f32.bin"));

/// The job of a case, of one goal and one channel.
pub type Case<'a, E, N, T> = Goals<'a, E, N, T>;

/// Who runs a case.
pub trait Runner {
    /// Runs the case.
    fn run<E, N, T>(&mut self, name: &str, case: &Case<'_, E, N, T>, options: RunOptions)
    where
        E: Equation<Value = <E as Space>::Scalar> + Sync,
        N: NeighbourOf<E> + Sync,
        T: Functional<E> + Sync;
}

/// Runs a case to its end by [`Driver`], so many walks at a time, and calls `after` after each poll.
/// `None`: the options were refused, or a walk was not finite.
pub fn drive<E, N, T>(
    case: &Case<'_, E, N, T>,
    options: RunOptions,
    walks: u64,
    mut after: impl FnMut(),
) -> Option<Statistics>
where
    E: Equation<Value = <E as Space>::Scalar> + Sync,
    N: NeighbourOf<E> + Sync + ?Sized,
    T: Functional<E> + Sync,
{
    let mut driver = Driver::<_, 1>::new(case, 0, options).ok()?;
    loop {
        let stop = driver.poll(case, walks).ok()?.stop;
        after();
        if stop.is_some() {
            let [statistics] = driver.statistics();
            return Some(statistics);
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
    circle_of_tables(runner)?;
    scene_of_tables(runner)
}

/// Runs a goal by roulette, and as in the paper by both estimators.
fn each<E, N, T>(
    runner: &mut impl Runner,
    name: &str,
    equation: &E,
    neighbour: &N,
    goal: Goal<T, f64>,
    options: RunOptions,
) where
    E: Equation<Value = <E as Space>::Scalar> + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    let constant = |estimator| Absorption::Constant {
        probability: 0.2,
        estimator,
    };
    let goals = [goal];
    for (absorption, form) in [
        (Absorption::Roulette, Form::Residual),
        (constant(Estimator::Absorption), Form::Product),
        (constant(Estimator::Collision), Form::Product),
    ] {
        let walks = WalkOptions {
            seed: 7,
            absorption,
            form,
            ..WalkOptions::default()
        };
        runner.run(
            name,
            &Goals::new(equation, neighbour, &goals, walks),
            options,
        );
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
    constants: Constants<F>,
    source: [F; CELLS],
    v: [F; CELLS],
    g: [F; CELLS],
}

impl<F: Real> Default for Buffers<F> {
    fn default() -> Self {
        Self {
            cells: [Cell::default(); CELLS],
            slots: [Slot::default(); slots(CELLS)],
            constants: Constants::default(),
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
        constants,
        source,
        v,
        g,
    } = buffers;
    let tables = BorrowedTables::fill(&[0.3, 0.7], cells, slots, constants).ok()?;
    let circle = Circle::new(tables, LIGHT).ok()?;
    let system = circle.system::<1>();
    system.source_means(source).ok()?;
    max_row_sum(&system).ok()?;
    gauss_seidel(&system, source, v, &mut [], StoppingRule::Fixed(20)).ok()?;
    let pairs = DIAGONAL_POINTWISE;
    neighbour_source(&system, &pairs, v, g).ok()?;
    let neighbour =
        Piecewise::<_, _, _, _, _, 1>::with_pointwise(&circle, &system, pairs, v, g).ok()?;
    let x0 = circle.point(0.3);
    let v0 = neighbour.value(&neighbour.locate(x0)).to_f64();
    let goal = Goal::new(At(x0), Some(v0));
    let options = until(Tolerance::Absolute(6e-3));
    each(runner, name, &circle, &neighbour, goal, options);
    Some(())
}

/// The Galerkin neighbour equation of a circle from tables: the mean over [1, 4], of known (v, Φ).
fn circle_of_tables(runner: &mut impl Runner) -> Option<()> {
    let tables = Tables::read(&CIRCLE_F32.0, "circle").ok()?;
    let circle = circle::circle::<f32>(&tables)?;
    let system = circle.system::<1>();
    let (v, g) = (tables.get("v").ok()?, tables.get("source").ok()?);
    let pairs = DIAGONAL_POINTWISE;
    let neighbour =
        Piecewise::<_, _, _, _, _, 1>::with_pointwise(&circle, &system, pairs, v, g).ok()?;
    let mean = MeanOver::new(1.0, 4.0).ok()?;
    let goal = Goal::new(mean, Some(mean.of(v.len(), v)));
    each(runner, "circle/table", &circle, &neighbour, goal, options());
    Some(())
}

/// The neighbour equation from steps of a scene from tables: u in a point of the floor until an error is reached, and the mean over
/// the walls, of walks with a last step to the light.
fn scene_of_tables(runner: &mut impl Runner) -> Option<()> {
    let tables = Tables::read(&SCENE_F32.0, "scene").ok()?;
    of_scene::<f32, 1>(&tables, runner)
}

fn of_scene<F, const B: usize>(tables: &Tables<'_>, runner: &mut impl Runner) -> Option<()>
where
    F: Real + FromBytes + Immutable,
{
    const FLOOR: u32 = 0;
    const WALLS: usize = 2;
    let radiosity = scene::radiosity::<F>(tables)?;
    let neighbour = scene::neighbour::<F, B>(tables, &radiosity)?;
    let last = LastStep(&radiosity);
    let point = radiosity.at(FLOOR, [0.3, 0.6, 0.0]).ok()?;
    let v0 = neighbour.value(&neighbour.locate(point)).to_f64();
    let few = |options: RunOptions| RunOptions {
        walks: options.walks / 8,
        batch: options.batch / 8,
        ..options
    };
    let relative = few(until(Tolerance::Relative(1e-3)));
    let goal = Goal::new(At(point), Some(v0));
    each(runner, "scene/point", &last, &neighbour, goal, relative);
    let mean = scene::mean_over(tables, &radiosity, WALLS)?;
    let goal = Goal {
        known: mean.known(&radiosity),
        ..Goal::new(mean, None)
    };
    each(
        runner,
        "scene/walls",
        &last,
        &neighbour,
        goal,
        few(options()),
    );
    Some(())
}
