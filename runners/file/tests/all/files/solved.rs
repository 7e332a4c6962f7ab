//! Files with known solutions, solved: domains without ends, special functions, parameters.

use fredholm::{Ask, Solver};

use super::*;

/// There are fewer than 200 comparisons: one is beyond this by chance in 10,000 sets of seeds, or in 50 with error bars of as few degrees of
/// freedom as these may have.
const STANDARD_ERRORS: f64 = 4.9;

/// The known values of all targets; NaN where there is none.
pub(super) fn exact(text: &str) -> Vec<f64> {
    let resolved = good(text).resolve().unwrap();
    let model = resolved.model.model();
    let goals = fredholm::goals(model, &resolved.targets).unwrap();
    let values = goals.iter().map(|goal| model.exact(&goal.region).unwrap());
    values.map(|value| value.unwrap_or(f64::NAN)).collect()
}

/// Solves a file with two seeds, or with five if there is `FREDHOLM_LONG`, and compares with what is known of its targets.
pub(super) fn agrees(text: &str, known: &[f64], error: f64) {
    let resolved = good(text).resolve().unwrap();
    let mut compared = 0;
    let seeds = if crate::is_long() { 5 } else { 2 };
    for seed in 1..=seeds {
        let mut solver = Solver::new(resolved.model.model()).seed(seed);
        for target in &resolved.targets {
            let Ask::One(region) = &target.ask else {
                panic!("{target:?}");
            };
            solver = solver.goal(&target.name, region.clone());
        }
        let report = solver.solve_to(error).unwrap();
        assert_eq!(report.goals.len(), known.len());
        for (goal, known) in report
            .goals
            .iter()
            .zip(known)
            .filter(|(_, known)| !known.is_nan())
        {
            let std_error = goal.preconditioned.std_error.unwrap();
            assert!(std_error <= error, "{goal:?}");
            let off = goal.preconditioned.estimate.unwrap() - known;
            // Rounding, and the digits that are known of the values.
            let allowed = STANDARD_ERRORS * std_error + 1e-13 + 1e-10 * f64::from(error > 1e-7);
            assert!(off.abs() < allowed, "seed {seed}, {known}: {goal:?}");
            compared += 1;
        }
    }
    assert!(compared >= 2 * seeds, "{compared}");
}

fn on_line(domain: &str, kernel: &str, source: &str, targets: [&str; 2]) -> String {
    let problem =
        format!("dimension = 1\ndomain = [{domain}]\nkernel = '{kernel}'\nsource = '{source}'");
    let [first, second] = targets;
    format!(
        "[problem]\nkind = 'cube'\n{problem}\n[[target]]\nname = 'a'\n{first}\n[[target]]\nname = 'b'\n{second}\n"
    )
}

/// u(x) = e^−x + λ e^−x ∫ e^−y u(y) dy on the half line is e^−x/(1 − λ/2); the mirror image of it; Lorentzians and Gaussians on the line; and a
/// product of a Gaussian and a linear kernel.
#[test]
fn domains_without_ends() {
    let third = 4.0 / 3.0 * f64::exp(-1.0);
    let half = on_line(
        "[0, inf]",
        "0.5*exp(-x - y)",
        "exp(-x)",
        ["at = 1", "weight = 'exp(-x)'"],
    );
    agrees(&half, &[third, 2.0 / 3.0], 1e-9);
    let mirrored = on_line(
        "[-inf, 0]",
        "0.5*exp(x + y)",
        "exp(x)",
        ["at = -1", "weight = 'exp(x)'"],
    );
    agrees(&mirrored, &[third, 2.0 / 3.0], 1e-9);
    let shifted = on_line(
        "[3, inf]",
        "0.5*exp(6 - x - y)",
        "exp(3 - x)",
        ["at = 4", "weight = 'exp(3 - x)'"],
    );
    agrees(&shifted, &[third, 2.0 / 3.0], 1e-9);
    // 1 + (1 + x/(1 + x²)) c with c = ½(1 + c).
    let lorentz = "0.5/pi/(1 + y²) * (1 + x/(1 + x²))";
    let line = on_line(
        "[-inf, inf]",
        lorentz,
        "1",
        ["at = 5", "weight = '0.5/pi/(1 + x^2)'"],
    );
    agrees(&line, &[2.0 + 5.0 / 26.0, 1.0], 1e-8);
    // 1 + 2 e^(−x²) c/√π with c = ∫ e^(−y²) u = √π + 2c/√2: far beyond a norm of 1.
    let gauss = on_line(
        "[-inf, inf]",
        "2/sqrt(pi)*exp(-x² - y²)",
        "1",
        ["at = 0.5", "weight = 'exp(-x^2)'"],
    );
    let c = f64::sqrt(core::f64::consts::PI) / (1.0 - f64::sqrt(2.0));
    let root = f64::sqrt(core::f64::consts::PI);
    agrees(&gauss, &[1.0 + 2.0 * f64::exp(-0.25) * c / root, c], 1e-8);
    // e^(−x²) g(y) with g = −5/4 − 15/8 y.
    let plane = "[problem]\nkind = 'cube'\ndimension = 2\ndomain = [[-inf, inf], [0, 2]]\n\
                 kernel_factors = ['exp(-x² - y²)/sqrt(pi/2)', '0.3*(x + y)']\nsource = 'exp(-x1²)'\n\
                 [[target]]\nname = 'a'\nat = [0, 1]\n[[target]]\nname = 'b'\nweight = 'exp(-x1²)'\n";
    agrees(plane, &[-3.125, -6.25 * f64::sqrt(0.5) * root], 1e-3);
}

/// A grey slab between black plates: its flux (two resolutions of a Nyström scheme) and the symmetry of its middle.
#[test]
fn a_grey_slab_has_its_flux() {
    for (tau, flux, error) in [(1.0, 0.553_405_993, 1e-5), (0.1, 0.915_702_873_8, 1e-5)] {
        let targets = ["weight = '2*E2(x)'", "at = 'middle'"];
        let text = on_line("[0, 'tau']", "0.5*E1(|x - y|)", "0.5*E2(x)", targets);
        let at = format!("at = {}", 0.5 * tau);
        let text =
            text.replace("at = 'middle'", &at) + &format!("[problem.parameters]\ntau = {tau}\n");
        agrees(&text, &[1.0 - flux, 0.5], error);
    }
}
