//! An equation on an interval with several degrees and pointwise pairs, beside the same as a cube of closures.

use core::convert::Infallible;

use fredholm::{CubeModel, CustomModel, Estimator, Method, Pairs, Solver};
use fredholm_core::Located;
use fredholm_core::galerkin::{Cells, PairIntegral};

use crate::common::{Line, is_long};

/// u(x) = ½ ∫₀¹ exp(−xy) u(y) dy + 1 + x.
fn laplace(cells: usize) -> Result<Line, Infallible> {
    Ok(Line::new(|x, y| 0.5 * (-x * y).exp(), |x| 1.0 + x, cells))
}

/// Of the kernel of `laplace`.
impl PairIntegral for Line {
    fn pair_integral(&self, x: &Located<f64>, j: usize) -> [f64; 1] {
        let width = self.measure(j);
        let middle = (j as f64 + 0.5) * width;
        let z = 0.5 * x.point * width;
        let mean = if z == 0.0 { 1.0 } else { z.sinh() / z };
        [0.5 * width * (-x.point * middle).exp() * mean]
    }
}

/// Points of a diagnosis, whose work grows with their square: a quarter is enough for a kernel that is so smooth.
fn nodes() -> usize {
    if is_long() { 2000 } else { 500 }
}

fn cube() -> CubeModel {
    CubeModel::from_fn::<1>(|x, y| 0.5 * (-x[0] * y[0]).exp(), |x| 1.0 + x[0])
}

#[test]
fn every_degree_is_that_of_the_cube() {
    let (cube, custom) = (
        cube(),
        CustomModel::from_cells(laplace)
            .with_functions::<2>()
            .with_functions::<3>(),
    );
    for degree in [0, 1, 2] {
        let asked = |model| {
            Solver::new(model)
                .method(Method::Walks)
                .at(0.3)
                .mean()
                .cells(8)
                .degree(degree)
                .walks(50_000)
        };
        let predicted = asked(&custom).diagnose_in(nodes()).unwrap();
        let [cube, custom] =
            [asked(&cube), asked(&custom)].map(|solver| solver.solve().unwrap().goals);
        for ((cube, custom), predicted) in cube.iter().zip(&custom).zip(&predicted.targets) {
            // The same Galerkin system, and walks of the same kind.
            assert!((cube.galerkin - custom.galerkin).abs() < 1e-13);
            let [a, b] = [cube, custom].map(|goal| goal.preconditioned);
            let bar = a.std_error.unwrap().hypot(b.std_error.unwrap());
            assert!((a.estimate.unwrap() - b.estimate.unwrap()).abs() < 4.0 * bar);
            for other in [a.std_dev, predicted.preconditioned] {
                let ratio = other.unwrap() / b.std_dev.unwrap();
                assert!((ratio - 1.0).abs() < 0.03, "degree {degree}: {ratio}");
            }
        }
    }
}

#[test]
fn the_choice_takes_a_high_degree_for_a_small_error() {
    let custom = CustomModel::from_cells(laplace)
        .by_its_chain()
        .with_functions::<2>()
        .with_functions::<3>();
    let report = Solver::new(&custom).mean().at(0.3).solve_to(1e-8).unwrap();
    assert_eq!(report.degree, 2);
    let exact = Solver::new(&cube()).mean().at(0.3).solve_to(1e-9).unwrap();
    for (goal, exact) in report.goals.iter().zip(&exact.goals) {
        let error = goal.preconditioned.estimate.unwrap() - exact.preconditioned.estimate.unwrap();
        assert!(error.abs() < 5e-8, "{error}");
    }
}

#[test]
fn pointwise_pairs_leave_less_variance() {
    let custom = CustomModel::from_cells(laplace).with_pair_integrals::<1>();
    let with = |pairs| {
        let solver = Solver::new(&custom).at(0.3).mean().cells(8).pairs(pairs);
        let solver = solver.absorption(0.2).estimator(Estimator::Absorption);
        let report = solver.clone().walks(50_000).solve().unwrap();
        let deviations: Vec<f64> = report
            .goals
            .iter()
            .map(|goal| goal.preconditioned.std_dev.unwrap())
            .collect();
        let predicted = solver.diagnose_in(nodes()).unwrap();
        for (predicted, measured) in predicted.targets.iter().zip(&deviations) {
            let ratio = predicted.preconditioned.unwrap() / measured;
            assert!((ratio - 1.0).abs() < 0.03, "{pairs:?}: {ratio}");
        }
        deviations
    };
    let [all, diagonal, none] = [Pairs::Pointwise, Pairs::Default, Pairs::Paper].map(with);
    assert!(
        all[0] < diagonal[0] && diagonal[0] < none[0],
        "{all:?} {diagonal:?} {none:?}"
    );
}
