//! The seams of the core, on the toy problem: no other crate is involved.

use core::num::NonZeroU32;

use fredholm_core::galerkin::{Cells as _, GalerkinError, Piecewise, max_row_sum};
use fredholm_core::sampled::ScoreVariance;
use fredholm_core::{
    At, Batch, Equation as _, Functional, Goal, Goals, Job, Located, Neighbour, NoDraws,
    NoNeighbour, Real, Space, Statistics, Uniforms, WalkOptions,
};
use fredholm_tests::all_ways;
use fredholm_tests::check::{long, means, run};
use fredholm_tests::galerkin::Tables;
use fredholm_tests::toy::{ALL, ALL_POINTWISE, Bands, MIXED, Mean, POINTWISE_DIAGONAL, Toy};

const CELLS: usize = 8;

fn walks() -> u64 {
    if long() { 200_000 } else { 10_000 }
}

/// As a user sets it up, with coefficients that are wrong by `spoil` in alternating directions.
fn tables<F: Real, const B: usize>(spoil: f64) -> Tables<F> {
    let (mut matrix, mut right) = Toy::<f64>::new(CELLS).galerkin::<B>();
    for (e, entry) in matrix.iter_mut().chain(&mut right).enumerate() {
        *entry *= 1.0 + if e % 2 == 0 { spoil } else { -spoil };
    }
    Tables::new::<B>(&matrix, &right).unwrap()
}

#[test]
fn without_pointwise_pairs_the_source_is_a_table() {
    let toy = Toy::<f64>::new(CELLS);
    let tables = tables::<f64, 2>(0.0);
    let (coefficients, g) = (tables.coefficients(), tables.source(&ALL));
    let new = |pairs| Piecewise::<_, _, _, _, _, 2>::new(&toy, &coefficients, pairs, &tables.v, &g);
    assert!(new(ALL).is_ok());
    // With a table alone a pointwise pair would be a silent bias.
    assert_eq!(new(MIXED).unwrap_err(), GalerkinError::Pointwise { row: 0 });
}

/// The statistics of a functional on the toy, with this neighbour equation or with none.
fn walked<F: Real, const B: usize, T: Functional<Toy<F>> + Sync>(
    pairs: Option<Bands>,
    spoil: f64,
    functional: T,
    options: WalkOptions,
    walks: u64,
) -> Statistics {
    let toy = Toy::<F>::new(CELLS);
    let goals = [Goal::new(functional, None)];
    let Some(pairs) = pairs else {
        return run(
            &Goals::new(&toy, &NoNeighbour::new(&toy), &goals, options),
            walks,
        )[0];
    };
    let tables = tables::<F, B>(spoil);
    let (coefficients, g) = (tables.coefficients(), tables.source(&pairs));
    let neighbour =
        Piecewise::<_, _, _, _, _, B>::with_pointwise(&toy, &coefficients, pairs, &tables.v, &g);
    run(
        &Goals::new(&toy, &neighbour.unwrap(), &goals, options),
        walks,
    )[0]
}

/// Means at a point and over X with weights φ that vary, (v,Φ) walk by walk, however walks end.
/// Returns the standard deviation of ζ for the mean over X with collision.
fn mean_test<F: Real, const B: usize>(pairs: Bands, spoil: f64) -> f64 {
    let x0 = F::from_f64(0.3);
    let floor = 40.0 * F::EPSILON.to_f64();
    let mut std_dev = 0.0;
    for (way, options) in all_ways(1).into_iter().enumerate() {
        let point = walked::<F, B, _>(Some(pairs), spoil, At(x0), options, walks());
        let mean = walked::<F, B, _>(Some(pairs), spoil, Mean, options, walks());
        let exact = Toy::exact(x0).to_f64();
        for (statistics, exact) in [(point, exact), (mean, 7.0 / 6.0)] {
            means(&statistics, Some(exact), floor)
                .ok()
                .unwrap_or_else(|e| panic!("{options:?}, B = {B}, {pairs:?}, {spoil}: {e}"));
        }
        if way == 1 {
            std_dev = mean.preconditioned().std_dev.unwrap();
        }
    }
    std_dev
}

#[test]
fn means_are_exact_for_every_degree_pairs_and_quality() {
    for pairs in [ALL, POINTWISE_DIAGONAL, MIXED] {
        let constant = mean_test::<f64, 1>(pairs, 0.0);
        let linear = mean_test::<f64, 2>(pairs, 0.0);
        // A mean over X in collision: φ varies, so (v,Φ) walk by walk dominates in both.
        assert!(linear < constant, "{pairs:?}: {linear} {constant}");
        // Spoiled coefficients cost variance, not correctness.
        assert!(mean_test::<f64, 1>(pairs, 0.05) > constant);
        mean_test::<f32, 1>(pairs, 0.05);
        mean_test::<f32, 2>(pairs, 0.0);
    }
    mean_test::<f64, 1>(ALL_POINTWISE, 0.0);
}

#[test]
fn spoiled_row_sums_of_one_are_refused() {
    // Row sums of K are below 0.73: with 5 % on top still a contraction, with 100 % none.
    let toy = Toy::<f64>::new(CELLS);
    let (mut matrix, _) = toy.galerkin::<1>();
    matrix.iter_mut().for_each(|k| *k *= 1.05);
    assert!(max_row_sum(&toy.coefficients::<1>(&matrix)).is_ok());
    matrix.iter_mut().for_each(|k| *k *= 2.0);
    let error = max_row_sum(&toy.coefficients::<1>(&matrix)).unwrap_err();
    assert!(matches!(error, GalerkinError::RowSum { .. }), "{error}");
}

#[test]
fn plain_results_have_the_same_bits_with_and_without_a_neighbour() {
    for options in all_ways(1) {
        let with = walked::<f64, 2, _>(Some(MIXED), 0.0, Mean, options, 10_000);
        let without = walked::<f64, 2, _>(None, 0.0, Mean, options, 10_000);
        assert_eq!(with.plain(), without.plain());
        assert_eq!(without.plain(), without.preconditioned());
    }
}

#[test]
fn a_batch_stopped_anywhere_goes_on_with_the_same_bits() {
    let toy = Toy::<f64>::new(CELLS);
    let (none, goals) = (NoNeighbour::new(&toy), [Goal::new(Mean, None)]);
    let job: Goals<'_, _, _, _> = Goals::new(&toy, &none, &goals, WalkOptions::default());
    let run = |batch: &mut [Batch; 1], at_most| job.run(0, batch, at_most).unwrap();
    let mut whole = [Batch::new(2, 100, 250)];
    run(&mut whole, u64::MAX);
    assert!(whole[0].is_done());
    assert_eq!(whole[0].statistics().walks(), 50);
    let mut parts = [Batch::new(2, 100, 250)];
    for at_most in [0, 1, 7, 30, 1, 11] {
        run(&mut parts, at_most);
    }
    assert_eq!(whole, parts);
    // Also after having been saved and read again.
    let mut saved = [Batch::new(2, 100, 250)];
    run(&mut saved, 20);
    let text = serde_json::to_string(&saved).unwrap();
    let mut saved: [Batch; 1] = serde_json::from_str(&text).unwrap();
    run(&mut saved, u64::MAX);
    assert_eq!(whole, saved);
}

/// A neighbour equation with v = 0 whose G is F and noise.
struct Noisy<'a>(&'a Toy<f64>);

impl Space for Noisy<'_> {
    type Scalar = f64;
    type Point = f64;
}

impl Neighbour for Noisy<'_> {
    type Value = f64;
    fn locate(&self, point: f64) -> Located<f64> {
        let cell = self.0.locate(&point);
        Located { point, cell }
    }
    fn kernel(&self, _: &Located<f64>, _: &Located<f64>, k: &f64) -> f64 {
        *k
    }
    fn source(&self, x: &Located<f64>, draws: &mut dyn Uniforms<f64>) -> f64 {
        self.0.source(&x.point, &mut NoDraws) + draws.uniform() - 0.5
    }
    fn value(&self, _: &Located<f64>) -> f64 {
        0.0
    }
}

/// Of n cells nobody can tell a residual below step/s√n, the standard error of its estimate from scores of s steps, whatever that
/// estimate is: a score has no more than √(3 s √n) steps, and a tenth for the uncertainty of both.
#[test]
fn few_cells_ask_for_few_steps() {
    let four = NonZeroU32::MIN.saturating_add(3);
    for cells in (20..400).step_by(7) {
        let toy = Toy::<f64>::new(cells);
        let found = ScoreVariance::estimate(&toy, &Noisy(&toy), four);
        let steps = f64::from(found.best_steps(3.0).get());
        let most = (3.0 * 4.0 * (cells as f64).sqrt()).sqrt();
        assert!(
            1.0 < steps && steps < 1.1 * most + 0.5,
            "{cells}: {found:?}"
        );
    }
}
