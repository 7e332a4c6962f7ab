//! Solves a circle and a room, from the tables to the estimate, in f32 and f64, with both estimators
//! and both kinds of neighbour equations, without std, allocator or panic.
//!
//! The panic handler calls a function that does not exist: the program links only where the
//! optimiser has proved that nothing can panic. Without std there is no allocator either, and no
//! second panic handler.

#![no_std]
#![no_main]

mod room;

use fredholm_circle::{
    Cell, Cells, Circle, Harmonic, MeanOver, Moment, Residual, Slot, moments, slots,
};
use fredholm_core::galerkin::{
    Basis, Dense, DiagonalRule, PairKind, Partition, Piecewise, StoppingRule, TransitionMoments,
    gauss_seidel, max_row_sum, neighbour_source,
};
use fredholm_core::{
    At, Batch, Estimator, Form, Kernel, Length, Located, Neighbour, Real, Sampler, Source,
    StateSpace, Statistics, Task, Uniforms, WalkSeeds,
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

/// What a device would keep: `None` where an input is refused.
fn solve<F: Real>(reflectance: &[f64], absorption: f64, seed: u64) -> Option<[Statistics; 4]> {
    let mut cells = [Cell::<F>::default(); CELLS];
    let mut slots = [Slot::<F>::default(); slots(CELLS)];
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    let cells = Cells::fill(reflectance, &mut cells, &mut slots).ok()?;
    let circle = Circle::new(cells, light, absorption).ok()?;
    let (mut source, mut v, mut g) = ([F::zero(); CELLS], [F::zero(); CELLS], [F::zero(); CELLS]);
    circle.source_means(&mut source).ok()?;
    max_row_sum(&circle).ok()?;
    gauss_seidel(&circle, &source, &mut v, &mut [], StoppingRule::Fixed(20)).ok()?;
    let pairs = DiagonalRule {
        diagonal: PairKind::Pointwise,
    };
    neighbour_source(&circle, &pairs, &v, &mut g).ok()?;
    let mut sums = [Moment::default(); CELLS];
    moments(&circle, &v, &mut sums).ok()?;

    let piecewise = Piecewise::with_pointwise(&circle, &circle, pairs, &v, &g).ok()?;
    let residual = Residual::new(&circle, &v, &sums).ok()?;
    Some([
        walks(&circle, &piecewise, Estimator::Absorption, seed)?,
        walks(&circle, &piecewise, Estimator::Collision, seed)?,
        walks(&circle, &residual, Estimator::Absorption, seed)?,
        walks(&circle, &residual, Estimator::Collision, seed)?,
    ])
}

fn walks<F: Real, N>(
    circle: &Circle<'_, F, Harmonic>,
    neighbour: &N,
    estimator: Estimator,
    seed: u64,
) -> Option<Statistics>
where
    N: Neighbour<Scalar = F, Point = fredholm_circle::Point<F>>,
{
    let mut all = Statistics::default();
    let point = Task {
        equation: circle,
        neighbour,
        functional: &At(circle.point(0.3)),
        control_mean: None,
        estimator,
        form: Form::Product,
        seeds: <WalkSeeds>::new(seed, 0),
        length: Length::default(),
    };
    let mean = Task {
        functional: &MeanOver::new(circle, 0.0, 1.0).ok()?,
        equation: circle,
        neighbour,
        control_mean: None,
        estimator,
        form: Form::Product,
        seeds: <WalkSeeds>::new(seed, 1),
        length: Length::default(),
    };
    for index in 0..2 {
        let mut batch = Batch::new(index, 1000, 2000);
        batch.run(&point, 500).ok()?;
        batch.run(&mean, 500).ok()?;
        all.merge(batch.statistics());
    }
    Some(all)
}

/// u(x) = x + ∫₀¹ ½ x y u(y) dy = 6x/5 with piecewise linear functions on two cells, so that the B×B
/// systems of a higher degree are linked, too.
struct Linear;

impl StateSpace for Linear {
    type Scalar = f64;
    type Point = f64;
}
impl Sampler for Linear {
    fn absorption(&self, _: &f64) -> f64 {
        0.2
    }
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}
impl Kernel for Linear {
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        0.625 * x * y
    }
}
impl Source for Linear {
    fn source(&self, x: &f64) -> f64 {
        *x
    }
}
impl Partition for Linear {
    fn cells(&self) -> usize {
        2
    }
    fn locate(&self, x: &f64) -> usize {
        usize::from(*x >= 0.5)
    }
}
impl Basis<2> for Linear {
    fn basis(&self, x: &Located<f64>) -> [f64; 2] {
        // 1 and √3 t, t ∈ [−1, 1].
        let t = 4.0 * x.point - if x.cell == 0 { 1.0 } else { 3.0 };
        [1.0, 1.732_050_807_568_877_2 * t]
    }
}
impl TransitionMoments<2> for Linear {
    fn moments(&self, _: &Located<f64>, _: usize) -> [[f64; 2]; 2] {
        [[0.4, 0.0], [0.0, 0.4]]
    }
}
/// Of u(0.7) = 0.84.
fn linear(seed: u64) -> Option<Statistics> {
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
    let (mut v, mut g) = (x, [0.0; 4]);
    gauss_seidel(
        &coefficients,
        &x,
        &mut v,
        &mut [0.0; 6],
        StoppingRule::Fixed(5),
    )
    .ok()?;
    neighbour_source(&coefficients, &pairs, &v, &mut g).ok()?;
    let neighbour =
        Piecewise::<_, _, _, _, _, 2>::new(&Linear, &coefficients, pairs, &v, &g).ok()?;
    let task = Task {
        equation: &Linear,
        neighbour: &neighbour,
        functional: &At(0.7),
        control_mean: None,
        estimator: Estimator::Collision,
        form: Form::Product,
        seeds: <WalkSeeds>::new(seed, 0),
        length: Length::default(),
    };
    let mut batch = Batch::new(0, 1000, 1000);
    batch.run(&task, u64::MAX).ok()?;
    Some(*batch.statistics())
}

/// Whether the estimate is near the solution, so that nothing is optimised away.
fn near(statistics: Option<[Statistics; 4]>) -> bool {
    statistics.is_some_and(|all| {
        all.iter()
            .all(|s| (4.0..7.0).contains(&s.preconditioned().estimate))
    })
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
    let wide = near(solve::<f64>(&reflectance, 0.2, seed));
    let narrow = near(solve::<f32>(&reflectance, 0.2, seed));
    let exact = linear(seed).is_some_and(|s| (s.preconditioned().estimate - 0.84).abs() < 1e-3);
    let rooms = room::near(room::solve::<f64>(reflectance[1], seed))
        && room::near(room::solve::<f32>(reflectance[1], seed));
    i32::from(!(wide && narrow && exact && rooms))
}
