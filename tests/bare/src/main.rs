//! Solves a circle and a room, from the tables to the estimate, in f32 and f64, however walks end, with both kinds of
//! neighbour equations, without std, allocator or panic.
//!
//! The panic handler calls a function that does not exist: the program links only where the
//! optimiser has proved that nothing can panic. Without std there is no allocator either, and no
//! second panic handler.

#![no_std]
#![no_main]

mod room;

use fredholm_circle::{
    BorrowedTables, Cell, Circle, Constants, Harmonic, MeanOver, Moment, Residual, Slot, slots,
};
use fredholm_core::galerkin::{
    Basis, Cells, Dense, DiagonalRule, PairKind, Piecewise, StoppingRule, TransitionMoments,
    gauss_seidel, max_row_sum, neighbour_source,
};
use fredholm_core::{
    Absorption, At, Batch, Chain, Equation, Estimator, Form, Functional, Goal, Goals, Job, Located,
    NeighbourOf, Real, Space, Statistics, Uniforms, WalkOptions,
};

#[cfg(feature = "alloc")]
extern crate alloc;

unsafe extern "C" {
    /// Nowhere defined.
    fn fredholm_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: the call is never linked.
    unsafe { fredholm_can_panic() }
}

const CELLS: usize = 100;

/// Walks by roulette, and as in the paper by both estimators.
fn all_options(seed: u64) -> [WalkOptions; 3] {
    let constant = |estimator| Absorption::Constant {
        probability: 0.2,
        estimator,
    };
    [
        (Absorption::Roulette, Form::Residual),
        (constant(Estimator::Absorption), Form::Product),
        (constant(Estimator::Collision), Form::Product),
    ]
    .map(|(absorption, form)| WalkOptions {
        seed,
        absorption,
        form,
        ..WalkOptions::default()
    })
}

/// The statistics of a goal without (v, Φ), in two batches that are run in pieces.
fn walks<E, N, T>(
    equation: &E,
    neighbour: &N,
    functional: T,
    options: WalkOptions,
) -> Option<Statistics>
where
    E: Equation<Value = <E as Space>::Scalar> + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    let goals = [Goal::new(functional, None)];
    let job: Goals<'_, _, _, _> = Goals::new(equation, neighbour, &goals, options);
    let mut all = Statistics::default();
    for index in 0..2 {
        let mut batches = [Batch::new(index, 1000, 2000)];
        job.run(0, &mut batches, 300).ok()?;
        job.run(0, &mut batches, u64::MAX).ok()?;
        all.merge(&batches[0].statistics());
    }
    Some(all)
}

/// Whether the estimate of a circle is near the solution, so that nothing is optimised away.
fn is_near(statistics: &Statistics) -> bool {
    (4.0..7.0).contains(&statistics.preconditioned().estimate)
}

/// What a device would keep: whether all estimates are near the solution; `None` where an input is refused.
fn solve<F: Real>(reflectance: &[f64], seed: u64) -> Option<bool> {
    let mut cells = [Cell::<F>::default(); CELLS];
    let mut slots = [Slot::<F>::default(); slots(CELLS)];
    let mut constants = Constants::default();
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    let tables = BorrowedTables::fill(reflectance, &mut cells, &mut slots, &mut constants).ok()?;
    let circle = Circle::new(tables, light).ok()?;
    let system = circle.system::<1>();
    let (mut source, mut v, mut g) = ([F::zero(); CELLS], [F::zero(); CELLS], [F::zero(); CELLS]);
    system.source_means(&mut source).ok()?;
    max_row_sum(&system).ok()?;
    gauss_seidel(&system, &source, &mut v, &mut [], StoppingRule::Fixed(20)).ok()?;
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    neighbour_source(&system, &pairs, &v, &mut g).ok()?;
    let mut sums = [Moment::default(); CELLS];
    system.moments(&v, &mut sums).ok()?;

    let piecewise =
        Piecewise::<_, _, _, _, _, 1>::with_pointwise(&circle, &system, pairs, &v, &g).ok()?;
    let residual = Residual::<_, 1>::new(circle.tables(), &v, &sums).ok()?;
    let (point, mean) = (At(circle.point(0.3)), MeanOver::new(0.0, 1.0).ok()?);
    let mut all = true;
    for options in all_options(seed) {
        all &= is_near(&walks(&circle, &piecewise, point, options)?)
            & is_near(&walks(&circle, &residual, point, options)?)
            & is_near(&walks(&circle, &piecewise, mean, options)?);
    }
    Some(all)
}

/// u(x) = x + ∫₀¹ ½ x y u(y) dy = 6x/5 with piecewise linear functions on two cells, so that the B×B
/// systems of a higher degree are linked, too.
struct Linear;

impl Space for Linear {
    type Scalar = f64;
    type Point = f64;
}
impl Chain for Linear {
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}
impl Equation for Linear {
    type Value = f64;
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        0.5 * x * y
    }
    fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
        *x
    }
}
impl Cells for Linear {
    const DIMENSION: usize = 1;
    fn cells(&self) -> usize {
        2
    }
    fn locate(&self, x: &f64) -> usize {
        usize::from(*x >= 0.5)
    }
    fn measure(&self, _: usize) -> f64 {
        0.5
    }
    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        0.5 * (cell as f64 + t.first().copied().unwrap_or(f64::NAN))
    }
    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        t.fill(2.0 * x.point - x.cell as f64);
    }
    fn at(&self, x: &[f64]) -> Option<f64> {
        x.first().copied()
    }
}
impl Basis<2> for Linear {}
impl TransitionMoments<2> for Linear {
    fn moments(&self, _: &Located<f64>, _: usize) -> [[f64; 2]; 2] {
        [[0.5, 0.0], [0.0, 0.5]]
    }
}

/// Whether u(0.7) is 0.84.
fn linear(seed: u64) -> Option<bool> {
    // x and y in the basis: their coefficients on the two cells, so that K' is exact.
    let slope = 0.25 / 1.732_050_807_568_877_2;
    let x = [0.25, slope, 0.75, slope];
    let mut table = [0.0; 16];
    for (row, left) in table.chunks_exact_mut(4).zip(x) {
        for (k, right) in row.iter_mut().zip(x) {
            *k = 0.5 * left * right * 0.5;
        }
    }
    let coefficients = Dense::new(&table, 2, 2)?;
    let pairs = DiagonalRule {
        diagonal: PairKind::Galerkin,
    };
    let (mut v, mut g, mut scratch) = (x, [0.0; 4], [0.0; 6]);
    let sweeps = StoppingRule::Fixed(5);
    gauss_seidel(&coefficients, &x, &mut v, &mut scratch, sweeps).ok()?;
    neighbour_source(&coefficients, &pairs, &v, &mut g).ok()?;
    let neighbour =
        Piecewise::<_, _, _, _, _, 2>::new(&Linear, &coefficients, pairs, &v, &g).ok()?;
    let [roulette, ..] = all_options(seed);
    let estimate = walks(&Linear, &neighbour, At(0.7), roulette)?.preconditioned();
    Some((estimate.estimate - 0.84).abs() < 1e-3)
}

/// Status 0 if all estimates are near the solution.
#[unsafe(no_mangle)]
extern "C" fn main(arguments: i32, _: *const *const u8) -> i32 {
    // Unknown to the compiler.
    let seed = arguments as u64;
    let reflectance = [0.3, 0.25 * f64::from(arguments)];
    #[cfg(feature = "panic")]
    assert!(seed < 10);
    #[cfg(feature = "alloc")]
    let seed = seed + alloc::vec![seed; arguments as usize].len() as u64;
    let all = [
        solve::<f64>(&reflectance, seed),
        solve::<f32>(&reflectance, seed),
        linear(seed),
        room::solve::<f64>(reflectance[1], seed),
        room::solve::<f32>(reflectance[1], seed),
    ];
    i32::from(!all.iter().all(|near| *near == Some(true)))
}
