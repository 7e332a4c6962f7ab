//! My equation is chosen for, walked, diagnosed and swept as every other.

use fredholm::{CustomModel, Pairs, Scalar, Solver};
use fredholm_my_equation::MyEquation;

mod program {
    include!("../examples/solve.rs");

    #[test]
    fn the_smallest_program_runs() {
        main().unwrap();
    }
}

#[test]
fn the_smallest_program_is_small() {
    let text = include_str!("../examples/solve.rs");
    let lines = text.lines().filter(|line| !line.is_empty());
    assert!(lines.count() <= 10);
    let uses = text.lines().filter(|line| line.starts_with("use "));
    let names = uses.map(|line| line.split(',').count()).sum::<usize>();
    assert!(names <= 4, "{names}");
}

fn model() -> CustomModel<MyEquation<f64>> {
    let single = CustomModel::from_cells(|cells| MyEquation::<f32>::new(cells as u32));
    CustomModel::from_cells(|cells| MyEquation::<f64>::new(cells as u32))
        .with_pair_integrals::<1>()
        .with_f32(single.with_pair_integrals::<1>())
        .with_solution(|x| 1.2 * x)
}

#[test]
fn an_error_is_reached_in_both_scalars() {
    let model = model();
    for scalar in [Scalar::F32, Scalar::F64] {
        let solver = Solver::new(&model).at(0.5).mean().scalar(scalar);
        let report = solver.solve_to(1e-4).unwrap();
        for goal in &report.goals {
            let bar = goal.preconditioned.std_error.unwrap();
            assert!(bar <= 1e-4 && goal.z.unwrap().abs() < 4.5, "{goal:?}");
        }
    }
}

#[test]
fn the_whole_function_has_a_band() {
    let model = model();
    let starts = model.with_starts();
    let whole = Solver::new(&starts)
        .cells(10)
        .walks(50_000)
        .whole()
        .unwrap();
    assert!(whole.summary().largest_std_error.unwrap() < 1e-3);
    for (region, value) in whole.grid(20).unwrap() {
        let exact = fredholm::Model::exact(&starts, &region).unwrap().unwrap();
        assert!(
            (value.estimate - exact).abs() <= value.band.unwrap() + 1e-15,
            "{region:?} {value:?}"
        );
    }
}

#[test]
fn what_is_predicted_is_measured() {
    let model = model();
    for pairs in [Pairs::Paper, Pairs::Default, Pairs::Pointwise] {
        let solver = Solver::new(&model).at(0.3).mean().cells(10).pairs(pairs);
        let report = solver.clone().walks(1 << 17).solve().unwrap();
        // As a quarter of what is asked for unasked suffices for one dimension.
        let diagnosis = solver.diagnose_in(500).unwrap();
        for (goal, predicted) in report.goals.iter().zip(&diagnosis.targets) {
            for (measured, predicted) in [
                (goal.plain, predicted.plain),
                (goal.preconditioned, predicted.preconditioned),
            ] {
                let ratio = predicted.unwrap() / measured.std_dev.unwrap();
                assert!((ratio - 1.0).abs() < 0.02, "{pairs:?}: {ratio}");
            }
        }
    }
}

#[test]
fn the_deviation_falls_as_theory_says() {
    let model = model();
    let rates = Solver::new(&model)
        .pairs(Pairs::Paper)
        .sweep(&[8, 16, 32, 64], 20_000);
    let fits = rates.unwrap().fits;
    assert_eq!(fits.std_dev_theory, -1.0);
    assert!((fits.std_dev.unwrap() + 1.0).abs() < 0.1, "{fits:?}");
}
