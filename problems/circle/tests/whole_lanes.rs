//! Walks of a whole function side by side have the bits of walks one by one.
#![cfg(all(feature = "alloc", feature = "lanes"))]

use fredholm_circle::{
    Arcs, Circle, CircleScores, Emission, Harmonic, Residual, Tables, WholeSideBySide,
    residual_moments,
};
use fredholm_core::whole::{Replicate, ReplicateCounts, Starts, WholeJob, WholeTask};
use fredholm_core::{Estimator, Real, Uniforms, WalkOptions};

/// Sums and counts of one replicate, run in pieces of which some are smaller than a block.
fn sums(job: &dyn WholeJob) -> (Vec<u64>, ReplicateCounts) {
    let mut sums = vec![0.0; job.unknowns()];
    let mut replicate = Replicate::new(3, 7, ReplicateCounts::default(), &mut sums);
    for piece in [1, 9, 900, 290] {
        job.run(&mut replicate, piece).unwrap();
    }
    let counts = *replicate.counts();
    assert_eq!(counts.walks, 1200);
    (sums.into_iter().map(f64::to_bits).collect(), counts)
}

fn compare<const B: usize>(
    cells: usize,
    emission: impl Emission<f64> + Copy + Sync,
    absorption: f64,
) {
    let tables = Tables::new(&[0.3, 0.0, 0.7], cells).unwrap();
    let circle = Circle::new(tables.cells(), emission, absorption).unwrap();
    let solution = circle.solve(1e-12, 1000).unwrap();
    let moments = residual_moments(&circle, &solution).unwrap();
    let neighbour: Residual<'_, _, _> = Residual::new(&circle, &solution.v, &moments).unwrap();
    let polynomials = circle.with_functions::<B>();
    let scores = CircleScores(&polynomials);
    // Any function will do.
    let known: Vec<f64> = (0..cells * B).map(|c| 1.0 / (c as f64 + 2.0)).collect();
    for estimator in [Estimator::Absorption, Estimator::Collision] {
        for (step_limit, survivals) in [(3, 0), (40, 0), (1_000_000, 0), (1_000_000, 2)] {
            let options = WalkOptions {
                seed: 7,
                estimator,
                step_limit,
                survivals,
                ..WalkOptions::default()
            };
            let task = WholeTask::new(&circle, &circle, &neighbour, &scores as _, options);
            for known in [&[][..], &known] {
                let task = task.with_known(known);
                let lanes = WholeSideBySide::with_same_kernel(&task, &polynomials);
                let (alone, beside) = (sums(&task), sums(&lanes));
                assert_eq!((task.known(), lanes.known()), (known, known));
                assert_eq!(
                    alone, beside,
                    "{cells} cells, {B} functions, {absorption}, {options:?}"
                );
                assert!(alone.1.states > 1200 && alone.1.scored > 50);
            }
        }
    }
}

#[test]
fn sums_have_the_bits_of_walks_one_by_one() {
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    // Cells too large for a series, walks longer than what is kept, and as many functions as there are.
    compare::<3>(6, light, 0.2);
    compare::<2>(9, light, 0.03);
    compare::<3>(90, light, 0.2);
    compare::<4>(300, Arcs::new(&[1.0, 0.0, 2.0], 300).unwrap(), 0.5);
    compare::<7>(30, light, 0.3);
}

/// A number that is drawn again and again.
struct Drawn(f64);

impl<F: Real> Uniforms<F> for Drawn {
    fn uniform(&mut self) -> F {
        F::from_f64(self.0)
    }
}

/// A start is at the share of the circle that it draws, to rounding.
#[test]
fn starts_are_uniform() {
    let tables = Tables::new(&[0.5], 10).unwrap();
    let circle = Circle::new(tables.cells(), Arcs::new(&[1.0], 10).unwrap(), 0.2).unwrap();
    for i in 0..1000 {
        let xi = f64::from(i) / 1000.0;
        let (cos, sin): (f64, f64) = circle.start(&mut Drawn(xi)).half_angle();
        let half = core::f64::consts::PI * xi;
        let off = (cos - half.cos()).abs().max((sin - half.sin()).abs());
        assert!(off < 4e-16, "{xi}: {off:e}");
    }
}
