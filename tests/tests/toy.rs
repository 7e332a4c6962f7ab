//! The seams of the core, on the toy problem: no other crate is involved.

use fredholm_core::galerkin::{
    Dense, GalerkinError, PairKind, Piecewise, PointwiseSource, Sweeps, contraction, gauss_seidel,
    neighbour_source,
};
use fredholm_core::{
    At, DefaultGenerator, Estimator, Functional, NoNeighbour, Real, STEP_LIMIT, Stream, Task,
};
use fredholm_tests::check::{means, neighbour_equation, run};
use fredholm_tests::toy::{Bands, Mean, Toy};

const CELLS: usize = 8;
const WALKS: u64 = 200_000;
const FRACTIONS: [f64; 4] = [0.001, 0.3, 0.5, 0.97];

const PAPER: Bands = Bands {
    diagonal: PairKind::Galerkin,
    above: PairKind::Galerkin,
    rest: PairKind::Galerkin,
};
const POINTWISE_DIAGONAL: Bands = Bands {
    diagonal: PairKind::Pointwise,
    ..PAPER
};
const MIXED: Bands = Bands {
    diagonal: PairKind::Pointwise,
    above: PairKind::None,
    rest: PairKind::Galerkin,
};
const ALL_POINTWISE: Bands = Bands {
    diagonal: PairKind::Pointwise,
    above: PairKind::Pointwise,
    rest: PairKind::Pointwise,
};

/// A neighbour equation's tables: coefficients, v and G.
struct Tables<F> {
    matrix: Vec<F>,
    v: Vec<F>,
    g: Vec<F>,
}

/// As a user sets it up: everything in f64, v rounded before G is computed from it.
fn tables<F: Real, const B: usize>(pairs: Bands, spoil: f64) -> Result<Tables<F>, GalerkinError> {
    let toy = Toy::<f64>::new(CELLS);
    let (mut matrix, mut right) = toy.galerkin::<B>();
    for (e, entry) in matrix.iter_mut().chain(&mut right).enumerate() {
        *entry *= 1.0 + if e % 2 == 0 { spoil } else { -spoil };
    }
    let matrix: Vec<F> = matrix.into_iter().map(F::from_f64).collect();
    let wide: Vec<f64> = matrix.iter().map(|k| k.to_f64()).collect();
    let coefficients = toy.coefficients::<B>(&wide);
    if B == 1 {
        contraction::<_, B>(&coefficients)?;
    }
    let mut v = vec![0.0; CELLS * B];
    let sweeps = Sweeps::UntilResidual {
        residual: 1e-15,
        at_most: 1000,
    };
    gauss_seidel::<_, B>(&coefficients, &right, &mut v, sweeps)?;
    let v: Vec<F> = v.into_iter().map(F::from_f64).collect();
    let wide: Vec<f64> = v.iter().map(|v| v.to_f64()).collect();
    let mut g = vec![0.0; CELLS * B];
    neighbour_source::<_, _, B>(&coefficients, &pairs, &wide, &mut g)?;
    Ok(Tables {
        matrix,
        v,
        g: g.into_iter().map(F::from_f64).collect(),
    })
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
    let tables = tables::<F, B>(pairs, spoil).unwrap();
    let coefficients = toy.coefficients::<B>(&tables.matrix);
    let neighbour =
        Piecewise::with_pointwise(&toy, &coefficients, pairs, &tables.v, &tables.g).unwrap();
    then(&toy, &neighbour)
}

fn holds<F: Real, const B: usize>(pairs: Bands, spoil: f64) {
    with_neighbour::<F, B, _>(pairs, spoil, |toy, neighbour| {
        neighbour_equation(toy, neighbour, &FRACTIONS, 16.0).unwrap_or_else(|e| panic!("{e}"));
    });
}

#[test]
fn the_neighbour_equation_holds_pointwise() {
    for pairs in [PAPER, POINTWISE_DIAGONAL, MIXED, ALL_POINTWISE] {
        for spoil in [0.0, 0.05] {
            holds::<f64, 1>(pairs, spoil);
            holds::<f32, 1>(pairs, spoil);
            holds::<f64, 2>(pairs, spoil);
            holds::<f32, 2>(pairs, spoil);
        }
    }
}

#[test]
fn without_pointwise_pairs_the_source_is_a_table() {
    let toy = Toy::<f64>::new(CELLS);
    let tables = tables::<f64, 2>(PAPER, 0.0).unwrap();
    let coefficients = toy.coefficients::<2>(&tables.matrix);
    let new = |pairs| {
        Piecewise::<_, _, _, _, _, 2>::new(&toy, &coefficients, pairs, &tables.v, &tables.g)
    };
    neighbour_equation(&toy, &new(PAPER).unwrap(), &FRACTIONS, 16.0).unwrap();
    // With a table alone a pointwise pair would be a silent bias.
    assert_eq!(new(MIXED).unwrap_err(), GalerkinError::Pointwise { row: 0 });
}

#[test]
fn the_check_sees_a_source_that_belongs_to_other_pairs() {
    let toy = Toy::<f64>::new(CELLS);
    let tables = tables::<f64, 1>(PAPER, 0.0).unwrap();
    let coefficients = toy.coefficients::<1>(&tables.matrix);
    let neighbour = Piecewise::<_, _, _, _, _, 1>::with_pointwise(
        &toy,
        &coefficients,
        MIXED,
        &tables.v,
        &tables.g,
    )
    .unwrap();
    let failure = neighbour_equation(&toy, &neighbour, &FRACTIONS, 16.0).unwrap_err();
    assert!(failure.distance > 1e12, "{failure}");
}

/// Means at a point and over X, both estimators. All tests of this file together make 192
/// comparisons: if all is well, one of them exceeds 4.5 standard errors with probability 0.0013.
/// Returns the standard deviation of ζ for the mean over X with collision.
fn mean_test<F: Real, const B: usize>(pairs: Bands, spoil: f64) -> f64 {
    with_neighbour::<F, B, _>(pairs, spoil, |toy, neighbour| {
        let x0 = F::from_f64(0.3);
        let floor = 40.0 * F::EPSILON.to_f64();
        let mut std_dev = 0.0;
        for estimator in [Estimator::Absorption, Estimator::Collision] {
            let mut stream = 0;
            let mut check = |statistics: &dyn Fn(Stream) -> fredholm_core::Statistics,
                             exact: f64| {
                stream += 1;
                let statistics = statistics(Stream::new(1, stream));
                means(&statistics, exact, 4.5, floor).unwrap_or_else(|e| {
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
    stream: Stream,
) -> Task<'a, Toy<F>, N, T, DefaultGenerator> {
    Task {
        equation,
        neighbour,
        functional,
        neighbour_value: None,
        estimator,
        stream,
        step_limit: STEP_LIMIT,
    }
}

#[test]
fn means_are_exact_for_every_degree_pairs_and_quality() {
    for pairs in [PAPER, POINTWISE_DIAGONAL, MIXED] {
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
    assert!(tables::<f64, 1>(PAPER, 0.05).is_ok());
    let toy = Toy::<f64>::new(CELLS);
    let (mut matrix, _) = toy.galerkin::<1>();
    matrix.iter_mut().for_each(|k| *k *= 2.0);
    let error = contraction::<_, 1>(&toy.coefficients::<1>(&matrix)).unwrap_err();
    assert!(matches!(error, GalerkinError::RowSum { .. }), "{error}");
}

#[test]
fn plain_results_have_the_same_bits_with_and_without_a_neighbour() {
    with_neighbour::<f64, 2, _>(MIXED, 0.0, |toy, neighbour| {
        let none = NoNeighbour::<Toy<f64>>::new();
        for estimator in [Estimator::Absorption, Estimator::Collision] {
            let stream = Stream::new(3, 1);
            let with = run(&task(toy, neighbour, &Mean, estimator, stream), 10_000);
            let without = run(&task(toy, &none, &Mean, estimator, stream), 10_000);
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
            Stream::new(1, 0),
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
