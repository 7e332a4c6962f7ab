//! Neighbour equations whose source is F itself: unbiased, with the error of the moments of F in the error bar.

use fredholm::{CubeModel, Error, Pairs, Scalar, Settings, SolveError, Solver};

/// m = ∫ y₂ u = 0.343/6 + ⅜ m of the equation below.
const MEAN: f64 = 0.343 / 6.0 / (1.0 - 0.375);
/// u at (0.2, …), at (0.9, …), its mean, and ∫ x₁ u.
const EXACT: [f64; 4] = [
    1.0 + 0.6 * MEAN,
    0.95 * MEAN,
    0.245 + 0.75 * MEAN,
    0.343 / 6.0 + 2.5 / 6.0 * MEAN,
];

/// K = ½ (1 + x₁) y₂ in d ≥ 2 dimensions and F = [x₁ + x₂ < 0.7]: u = F + ½ (1 + x₁) m.
fn separable<const D: usize>() -> CubeModel {
    let jump = |x: &[f64]| f64::from(u8::from(x[0] + x[1] < 0.7));
    CubeModel::from_fn::<D>(|x, y| 0.5 * (1.0 + x[0]) * y[1], move |x| jump(x))
}

fn asked<const D: usize>(model: &CubeModel) -> Solver<'_> {
    let solver = Solver::new(model).at([0.2; D]).at([0.9; D]).mean();
    solver.weight("x", |x| x[0]).degree(1).exact_source(true)
}

/// With degree 1, K is a polynomial on cells and h = k: walks tell u but for the error of the moments, which is all of the
/// error bar, and that holds over seeds.
#[test]
fn the_error_of_the_moments_is_the_error_bar() {
    fn check<const D: usize>(cells: usize, scalar: Scalar) {
        const SEEDS: u64 = 24;
        let model = separable::<D>();
        let mut squares = [0.0; 4];
        for seed in 1..=SEEDS {
            let solver = asked::<D>(&model).cells(cells).scalar(scalar).seed(seed);
            let report = solver.walks(64).solve().unwrap();
            assert!(report.exact_source);
            let goals = report.goals.iter().zip(EXACT);
            for (square, (goal, exact)) in squares.iter_mut().zip(goals) {
                let found = goal.preconditioned;
                let (bar, error) = (found.std_error.unwrap(), found.estimate.unwrap() - exact);
                let control = goal.control_error.unwrap();
                // But for rounding, which F32 has.
                let rounding = 2.0 * goal.rounding_floor;
                assert!(
                    (bar - control).abs() <= 1e-3 * control + rounding,
                    "{goal:?}"
                );
                *square += (((error.abs() - rounding).max(0.0)) / bar).powi(2);
                if scalar == Scalar::F64 {
                    assert!(bar > 10.0 * rounding, "{goal:?}");
                }
            }
        }
        // χ² of 24 degrees of freedom, if a bar of 16 replicates is exact, has the standard deviation √(2/24) about 1; that
        // of bars adds √(2/16)/√24 and their bias 1/7. Five of them and more: [0.2, 2.7].
        for square in squares {
            let mean = square / SEEDS as f64;
            assert!(mean < 2.7, "{D} {cells}: {mean}");
            assert!(mean > 0.2 || scalar == Scalar::F32, "{D} {cells}: {mean}");
        }
    }
    check::<2>(1, Scalar::F64);
    check::<2>(4, Scalar::F64);
    check::<3>(3, Scalar::F64);
    check::<2>(3, Scalar::F32);
}

/// Walks of few cells, whose kernel differs from h, have the mean that they must have: that of plain walks, and of all cells.
#[test]
fn a_jump_costs_no_variance() {
    let gauss = |x: &[f64; 3], y: &[f64; 3]| {
        let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
        0.5 * (-square).exp()
    };
    let jump = |x: &[f64; 3]| f64::from(u8::from(x[0] + x[1] < 0.7));
    let model = CubeModel::from_fn::<3>(gauss, jump);
    let solver = Solver::new(&model).at([0.2, 0.3, 0.4]).mean();
    let solver = solver.cells(2).degree(2).walks(20_000);
    let [before, after] =
        [false, true].map(|exact| solver.clone().exact_source(exact).solve().unwrap());
    for (before, after) in before.goals.iter().zip(&after.goals) {
        let [old, new] = [before, after].map(|goal| goal.preconditioned);
        let [a, b] = [old, new].map(|of| of.std_error.unwrap());
        assert!(a > 20.0 * b, "{a} {b}");
        let difference = (old.estimate.unwrap() - new.estimate.unwrap()).abs();
        // Once in two million runs.
        assert!(difference < 5.0 * a.hypot(b), "{difference} {a} {b}");
        // The same walks.
        assert_eq!(before.plain.estimate, after.plain.estimate);
    }
}

/// A source that is a polynomial on cells has exact moments.
#[test]
fn a_smooth_source_has_no_error_of_its_own() {
    let model = CubeModel::from_fn::<2>(|x, y| 0.5 * x[0] * y[1], |x| x[0] - x[1]);
    let solver = Solver::new(&model).mean().cells(2).degree(1).walks(1000);
    let report = solver.exact_source(true).solve().unwrap();
    let error = report.goals[0].control_error.unwrap_or(0.0);
    assert!(error < 1e-15, "{error}");
}

#[test]
fn an_exact_source_is_chosen_for_a_jump() {
    let model = separable::<2>();
    let report = Solver::new(&model).at([0.2, 0.2]).mean().solve_to(1e-5);
    let report = report.unwrap();
    assert!(report.exact_source, "{report}");
    for (goal, exact) in report.goals.iter().zip([EXACT[0], EXACT[2]]) {
        let bar = goal.preconditioned.std_error.unwrap();
        let error = goal.preconditioned.estimate.unwrap() - exact;
        assert!(bar <= 1e-5 && error.abs() < 5.0 * bar, "{report}");
    }
    // Jumps in one dimension are found to the last bit.
    let step = CubeModel::from_fn::<1>(
        |x, y| 0.5 * (x[0] * y[0]).exp(),
        |x| f64::from(u8::from(x[0] < 0.37)),
    );
    let report = Solver::new(&step).mean().solve_to(1e-8).unwrap();
    assert!(report.exact_source, "{report}");
}

#[test]
fn what_has_no_exact_source_says_so() {
    let model = separable::<2>().with_integral(|_, _, _| 0.0);
    for pairs in [Pairs::Pointwise, Pairs::Theory] {
        let solver = asked::<2>(&model).degree(0).cells(2).pairs(pairs);
        let refused = solver.solve();
        assert!(matches!(
            refused,
            Err(SolveError::Failed(Error::Option { .. }))
        ));
    }
    assert!(Settings::default().discretisation().exact_source.is_none());
}
