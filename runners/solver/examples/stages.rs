//! Prints the error of v and √Var against stages in place of a matrix, with processor seconds and memory, on Linux.
//!
//! ```text
//! cargo run --profile dist -p fredholm --example stages -- CELLS STAGES
//! ```
//!
//! CELLS of an axis in three dimensions, so that 46 are 97,336 in all; for every number of stages up to STAGES.

use fredholm::{CubeModel, Solver};

/// A number of /proc/self/status in MB; 0 where nobody tells.
fn megabytes(key: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(key));
    let number = line.and_then(|line| {
        line.trim_start_matches(':')
            .split_whitespace()
            .next()?
            .parse()
            .ok()
    });
    number.unwrap_or(0.0) / 1024.0
}

/// K = ½ exp(−|x − y|²) and the solution 1 + |x|², with F = u − T_K u by products of one-dimensional integrals.
fn cube() -> CubeModel {
    let rule = fredholm_variance::gauss(12).expect("a rule");
    let integral = move |power: i32, x: f64| {
        let at = |y: f64| y.powi(power) * (-(x - y).powi(2)).exp();
        let terms = rule.iter().map(|(t, w)| 0.5 * w * at(0.5 * (1.0 + t)));
        terms.sum::<f64>()
    };
    let u = |x: &[f64]| 1.0 + x.iter().map(|x| x * x).sum::<f64>();
    let kernel = |x: &[f64; 3], y: &[f64; 3]| {
        let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
        0.5 * (-square).exp()
    };
    let source = move |x: &[f64; 3]| {
        let [zeroth, second] = [0, 2].map(|power| x.map(|x| integral(power, x)));
        let all: f64 = zeroth.iter().product();
        let squares: f64 = (0..3).map(|a| all / zeroth[a] * second[a]).sum();
        u(x) - 0.5 * (all + squares)
    };
    CubeModel::from_fn::<3>(kernel, source).with_solution(u)
}

fn main() {
    let mut numbers = std::env::args()
        .skip(1)
        .map(|text| text.parse::<u32>().expect("a number"));
    let (cells, most) = (numbers.next().unwrap_or(10), numbers.next().unwrap_or(3));
    println!("stages   error of v in the mean, in a middle   std_dev of both   set-up s   most MB");
    for stages in 1..=most {
        let model = cube().with_stages(stages);
        let middle = (f64::from(cells / 2) + 0.5) / f64::from(cells);
        let solver = Solver::new(&model)
            .mean()
            .at([middle; 3])
            .cells(cells as usize);
        let report = solver.walks(20_000).solve().expect("a result");
        let [mean, point] = &report.goals[..] else {
            return;
        };
        let exact = [2.0, 1.0 + 3.0 * middle * middle];
        let off = [mean.galerkin - exact[0], point.galerkin - exact[1]];
        let deviation = [mean, point].map(|goal| goal.preconditioned.std_dev.unwrap_or(f64::NAN));
        println!(
            "{stages:6}   {:10.2e} {:10.2e}   {:10.2e} {:10.2e}   {:8.2}   {:8.1}",
            off[0],
            off[1],
            deviation[0],
            deviation[1],
            report.setup_seconds,
            megabytes("VmHWM")
        );
    }
}
