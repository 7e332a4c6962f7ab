//! The seams of the core, on the toy problem: no other crate is involved.

use fredholm_core::galerkin::{Dense, GalerkinError, Piecewise, PointwiseSource, max_row_sum};
use fredholm_core::{
    At, DefaultGenerator, Estimator, Form, Functional, Length, NoNeighbour, Real, Task, WalkSeeds,
};
use fredholm_tests::check::means;
use fredholm_tests::galerkin::Tables;
use fredholm_tests::run;
use fredholm_tests::toy::{ALL, ALL_POINTWISE, Bands, MIXED, Mean, POINTWISE_DIAGONAL, Toy};

const CELLS: usize = 8;
const WALKS: u64 = 200_000;

/// As a user sets it up, with coefficients that are wrong by `spoil` in alternating directions.
fn tables<F: Real, const B: usize>(spoil: f64) -> Tables<F> {
    let (mut matrix, mut right) = Toy::<f64>::new(CELLS).galerkin::<B>();
    for (e, entry) in matrix.iter_mut().chain(&mut right).enumerate() {
        *entry *= 1.0 + if e % 2 == 0 { spoil } else { -spoil };
    }
    Tables::new::<B>(&matrix, &right).unwrap()
}

/// The neighbour equation on the toy problem.
type OnToy<'a, F, const B: usize> =
    Piecewise<'a, F, Toy<F>, Dense<'a, F>, Bands, PointwiseSource<'a, F, Toy<F>, Bands, B>, B>;

fn with_neighbour<F: Real, const B: usize, R>(
    pairs: Bands,
    spoil: f64,
    then: impl FnOnce(&Toy<F>, &OnToy<'_, F, B>) -> R,
) -> R {
    let toy = Toy::<F>::new(CELLS);
    let tables = tables::<F, B>(spoil);
    let (coefficients, g) = (tables.coefficients(), tables.source::<_, B>(&pairs));
    let neighbour = Piecewise::with_pointwise(&toy, &coefficients, pairs, &tables.v, &g).unwrap();
    then(&toy, &neighbour)
}

#[test]
fn without_pointwise_pairs_the_source_is_a_table() {
    let toy = Toy::<f64>::new(CELLS);
    let tables = tables::<f64, 2>(0.0);
    let (coefficients, g) = (tables.coefficients(), tables.source::<_, 2>(&ALL));
    let new = |pairs| Piecewise::<_, _, _, _, _, 2>::new(&toy, &coefficients, pairs, &tables.v, &g);
    assert!(new(ALL).is_ok());
    // With a table alone a pointwise pair would be a silent bias.
    assert_eq!(new(MIXED).unwrap_err(), GalerkinError::Pointwise { row: 0 });
}

/// Means at a point and over X with weights φ that vary, (v,Φ) walk by walk, both estimators.
/// Returns the standard deviation of ζ for the mean over X with collision.
fn mean_test<F: Real, const B: usize>(pairs: Bands, spoil: f64) -> f64 {
    with_neighbour::<F, B, _>(pairs, spoil, |toy, neighbour| {
        let x0 = F::from_f64(0.3);
        let floor = 40.0 * F::EPSILON.to_f64();
        let mut std_dev = 0.0;
        for estimator in [Estimator::Absorption, Estimator::Collision] {
            let mut number = 0;
            let mut check = |statistics: &dyn Fn(WalkSeeds) -> fredholm_core::Statistics,
                             exact: f64| {
                number += 1;
                let statistics = statistics(WalkSeeds::new(1, number));
                means(&statistics, Some(exact), floor)
                    .ok()
                    .unwrap_or_else(|e| {
                        panic!("{estimator:?}, B = {B}, {pairs:?}, spoiled by {spoil}: {e}")
                    });
                std_dev = statistics.preconditioned().std_dev.unwrap();
            };
            let exact = Toy::exact(x0).to_f64();
            check(
                &|s| run(&task(toy, neighbour, &At(x0), estimator, s), WALKS),
                exact,
            );
            check(
                &|s| run(&task(toy, neighbour, &Mean, estimator, s), WALKS),
                7.0 / 6.0,
            );
        }
        std_dev
    })
}

fn task<'a, F: Real, N, T: Functional<Toy<F>>>(
    equation: &'a Toy<F>,
    neighbour: &'a N,
    functional: &'a T,
    estimator: Estimator,
    seeds: WalkSeeds,
) -> Task<'a, Toy<F>, N, T, DefaultGenerator> {
    Task {
        equation,
        neighbour,
        functional,
        control_mean: None,
        estimator,
        form: Form::Product,
        seeds,
        length: Length::default(),
    }
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
    // Row sums of K are below 0.62: with 5 % on top still a contraction, with 100 % none.
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
    with_neighbour::<f64, 2, _>(MIXED, 0.0, |toy, neighbour| {
        let none = NoNeighbour::<Toy<f64>>::new();
        for estimator in [Estimator::Absorption, Estimator::Collision] {
            let seeds = WalkSeeds::new(3, 1);
            let with = run(&task(toy, neighbour, &Mean, estimator, seeds), 10_000);
            let without = run(&task(toy, &none, &Mean, estimator, seeds), 10_000);
            assert_eq!(with.plain(), without.plain());
            assert_eq!(without.plain(), without.preconditioned());
        }
    });
}

#[test]
fn a_batch_stopped_anywhere_goes_on_with_the_same_bits() {
    with_neighbour::<f64, 1, _>(MIXED, 0.0, |toy, neighbour| {
        let task = task(
            toy,
            neighbour,
            &Mean,
            Estimator::Absorption,
            WalkSeeds::new(1, 0),
        );
        let mut whole = fredholm_core::Batch::new(2, 100, 250);
        whole.run(&task, u64::MAX).unwrap();
        assert!(whole.is_done());
        assert_eq!(whole.statistics().walks(), 50);
        let mut parts = fredholm_core::Batch::new(2, 100, 250);
        for at_most in [0, 1, 7, 30, 1, 11] {
            parts.run(&task, at_most).unwrap();
        }
        assert_eq!(whole, parts);
        // Also after having been saved and read again.
        let mut saved = fredholm_core::Batch::new(2, 100, 250);
        saved.run(&task, 20).unwrap();
        let text = serde_json::to_string(&saved).unwrap();
        let mut saved: fredholm_core::Batch = serde_json::from_str(&text).unwrap();
        saved.run(&task, u64::MAX).unwrap();
        assert_eq!(whole, saved);
    });
}
