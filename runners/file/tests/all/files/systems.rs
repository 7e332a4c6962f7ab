//! Files of systems.

use fredholm::{Region, Solver};

use super::solved::{agrees, exact};
use super::*;

/// The example of the manual.
const SCATTERING: &str = include_str!("../../../../../examples/scattering.toml");

/// A system of two.
fn system(first: &str, second: &str, target: &str) -> String {
    format!(
        "[problem]\nkind = 'system'\ndimension = 1\n\n[[problem.equation]]\n{first}\nsource = '1'\n\
         [[problem.equation]]\n{second}\nsource = 'x'\n[[target]]\nname = 'a'\n{target}\n"
    )
}

const KERNEL: &str = "kernel = ['0', '2']";

#[test]
fn what_systems_refuse() {
    let target = "component = 1\nat = 0.5";
    let good_one = good(&system(KERNEL, KERNEL, target));
    assert_eq!(
        good_one.targets[0].component.as_ref().map(|own| own.value),
        Some(1)
    );
    let of = |first: &str| system(first, KERNEL, target);
    let asked = |target: &str| system(KERNEL, KERNEL, target);
    fails(&of("kernel = «['0']»"), &["must have 2 formulas", "not 1"]);
    fails(&of("kernel = «'0'»"), &["an array of strings"]);
    fails(&of("kernel = ['0', '2 «z»']"), &["unknown name `z`"]);
    let one = of("kernel = ['0', '2']\nsolution = 'x'").replace("source = 'x'", "source = «'x'»");
    fails(&one, &["a `solution` is missing"]);
    let none = asked("at = 0.5").replace("'a'", "«'a'»");
    fails(&none, &["needs its `component`", "from 1 to 2"]);
    fails(&asked("component = «3»\nat = 0.5"), &["from 1 to 2"]);
    fails(&asked("component = 1\nat = «1.5»"), &["from 0 to 1"]);
    fails(&asked("component = 1\nat = «[0, 0]»"), &["1 coordinate"]);
    fails(
        &asked("component = 1\nover = «'floor'»"),
        &["part of a system", "`weight`"],
    );
    fails(
        &asked("component = 1\ngrid = «[5, 5]»"),
        &["must have 1 numbers of points"],
    );
    fails(
        &asked("component = 1\nweight = '«y»'"),
        &["unknown name `y`"],
    );
    let text = asked(target);
    let bad = |from: &str, to: &str, words: &str| fails(&text.replacen(from, to, 1), &[words]);
    bad("dimension = 1", "dimension = «4»", "from 1 to 3");
    let single = "[walk]\nscalar = «'f32'»\n[[target]]";
    bad("[[target]]", single, "in f64");
    let none = "[problem]\nkind = 'system'\ndimension = 1\nequation = «[]»\n[[target]]\nname = 'a'\nat = 0";
    fails(none, &["from 1 to 64 equations"]);
    // And what others do not have.
    let cube = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = '1'\nsource = '1'\n[[target]]\nname = 'a'\ncomponent = «1»\nat = 0";
    fails(cube, &["`component` belongs to systems"]);
}

/// What each target of a system may be, on a half line, by either method: u = 1/(1 + x)² from v, and v = e^-x from u.
#[test]
fn targets_are_those_of_a_cube() {
    let text = "[problem]\nkind = 'system'\ndimension = 1\ndomain = [[0, inf]]\n\
                [[problem.equation]]\nkernel = ['0', 'exp(-y)/(1+x)^2']\nsource = '0.5/(1+x)^2'\nsolution = '1/(1+x)^2'\n\
                [[problem.equation]]\nkernel = ['0.3*exp(-x - y)*(1+y)^2', '0']\nsource = '0.7*exp(-x)'\nsolution = 'exp(-x)'\n\
                [[target]]\nname = 'a'\ncomponent = 1\nat = 0.5\n[[target]]\nname = 'b'\ncomponent = 2\nweight = 'exp(-x)'\n\
                [[target]]\nname = 'c'\ncomponent = 1\nweight = 'exp(-x)*(1+x)^2'\n";
    let known = [1.0 / 2.25, 0.5, 1.0];
    agrees(text, &known, 1e-7);
    agrees(&format!("{text}[walk]\nmethod = 'walks'\n"), &known, 1e-3);
    let mean = text.replacen("at = 0.5", "over = 'all'", 1);
    let resolved = good(&mean).resolve().unwrap();
    let refused = Solver::new(resolved.model.model())
        .goal("mean", Region::Part(0))
        .solve();
    let refused = refused.unwrap_err().to_string();
    assert!(
        refused.contains("an infinite domain has no mean"),
        "{refused}"
    );
    fails(
        &text.replacen("at = 0.5", "grid = «3»", 1),
        &["no equally spaced points"],
    );
    let line = text.replacen("[0, inf]", "[0, 1]", 1);
    let resolved = good(&line.replacen("at = 0.5", "grid = 2", 1))
        .resolve()
        .unwrap();
    let goals = fredholm::goals(resolved.model.model(), &resolved.targets).unwrap();
    let names: Vec<&str> = goals.iter().map(|goal| goal.name.as_str()).collect();
    assert_eq!(names, ["a[0]", "a[1]", "b", "c"]);
    let square = "[problem]\nkind = 'system'\ndimension = 2\ndomain = [[0, 2], [1, 2]]\n\
                  [[problem.equation]]\nkernel = ['0.25']\nsource = 'x1 + x2'\n\
                  [[target]]\nname = 'g'\ncomponent = 1\ngrid = [3, 2]\n";
    let resolved = good(square).resolve().unwrap();
    let goals = fredholm::goals(resolved.model.model(), &resolved.targets).unwrap();
    let points = goals.iter().map(|goal| goal.region.clone());
    let at = |x1: f64, x2: f64| Region::Point(vec![x1, x2, 1.0]);
    let expected = [
        at(0.0, 1.0),
        at(0.0, 2.0),
        at(1.0, 1.0),
        at(1.0, 2.0),
        at(2.0, 1.0),
        at(2.0, 2.0),
    ];
    assert_eq!(points.collect::<Vec<_>>(), expected);
}

/// A system of two by kernels that no walk of a chain takes (norms 2), with a kernel that jumps, on [1, 3].
#[test]
fn solutions_are_found() {
    // Made from u_1 = x and u_2 = x².
    let text = "[problem]\nkind = 'system'\ndimension = 1\ndomain = [[1, 3]]\n\
                [[problem.equation]]\nkernel = ['x*y', 'y < 2 ? 3 : 0']\nsource = 'x - x*26/3 - 7'\nsolution = 'x'\n\
                [[problem.equation]]\nkernel = ['y > x ? 2 : 0', '1']\nsource = 'x^2 - (9 - x^2) - 26/3'\nsolution = 'x^2'\n\
                [[target]]\nname = 'a'\ncomponent = 1\nat = 1.25\n[[target]]\nname = 'b'\ncomponent = 2\nat = 3\n";
    agrees(text, &[1.25, 9.0], 1e-4);
    let known: Vec<f64> = exact(SCATTERING);
    agrees(SCATTERING, &known, 1e-6);
}

#[test]
fn the_transmission_of_a_barrier_is_that_of_a_textbook() {
    let resolved = good(SCATTERING).resolve().unwrap();
    let model = resolved.model.model();
    let report = Solver::new(model)
        .goal("re", Region::Point(vec![1.0, 1.0]))
        .goal("im", Region::Point(vec![1.0, 2.0]))
        .solve_to(1e-8)
        .unwrap();
    let square = |goal: usize| report.goals[goal].preconditioned.estimate.unwrap().powi(2);
    let (k, v, q): (f64, f64, f64) = (2.0, 5.0, 1.0);
    let expected = 1.0 / (1.0 + (v * q.sinh() / (2.0 * k * q)).powi(2));
    let found = square(0) + square(1);
    assert!((found - expected).abs() < 5e-8, "{found} {expected}");
}

#[test]
fn what_is_no_number_is_shown_at_its_kernel() {
    let text = system(
        "kernel = ['0', '1/(x - 2*x)']",
        KERNEL,
        "component = 1\nat = 0.5",
    );
    let file = good(&text.replace("source = 'x'", "source = 'sqrt(x - 0.5)'"));
    let resolved = file.resolve().unwrap();
    let error = Solver::new(resolved.model.model())
        .goal("a", Region::Point(vec![0.5, 1.0]))
        .solve();
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("`source` of equation 2 is NaN at x = 0."),
        "{error}"
    );
    let refused = Solver::new(resolved.model.model())
        .mean()
        .solve()
        .unwrap_err();
    assert!(
        refused.to_string().contains("means of components"),
        "{refused}"
    );
}
