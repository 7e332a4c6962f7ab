//! Standard error × √seconds of equations of any norm, by resolvent walks and by walks of the chain, each within two seconds.
//!
//! `RAYON_NUM_THREADS=1 cargo run --profile dist -p fredholm --features measure --example any_equation`

use core::f64::consts::PI;
use core::time::Duration;

use fredholm::{CubeModel, Method, Report, SolveError, Solver};

/// Seconds of a row.
const LIMIT: Duration = Duration::from_secs(2);

/// Kernel and source in so many dimensions, on an interval of this length for every axis.
fn of<const D: usize>(
    length: f64,
    kernel: impl Fn(&[f64; D], &[f64; D]) -> f64 + Send + Sync + 'static,
) -> CubeModel {
    CubeModel::from_fn::<D>(kernel, |x| 1.0 + x[0]).on([[0.0, length]; D])
}

fn square<const D: usize>(x: &[f64; D], y: &[f64; D]) -> f64 {
    x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum()
}

fn distance<const D: usize>(x: &[f64; D], y: &[f64; D]) -> f64 {
    x.iter().zip(y).map(|(x, y)| (x - y).abs()).sum()
}

fn gauss<const D: usize>(scale: f64) -> CubeModel {
    of::<D>(1.0, move |x, y| scale * (-square(x, y)).exp())
}

fn kink<const D: usize>(scale: f64) -> CubeModel {
    of::<D>(1.0, move |x, y| scale * (-distance(x, y)).exp())
}

fn jump<const D: usize>(scale: f64) -> CubeModel {
    of::<D>(1.0, move |x, y| {
        let is_near = x.iter().zip(y).all(|(x, y)| (x - y).abs() < 0.3);
        if is_near { scale } else { 0.0 }
    })
}

/// Love's equation on [−1, 1], shifted to [0, 2].
fn love(a: f64, scale: f64) -> CubeModel {
    of::<1>(2.0, move |x, y| scale * a / PI / (a * a + square(x, y)))
}

fn green(scale: f64) -> CubeModel {
    of::<1>(1.0, move |[x], [y]| scale * x.min(*y) * (1.0 - x.max(*y)))
}

fn volterra(scale: f64) -> CubeModel {
    of::<1>(
        1.0,
        move |[x], [y]| {
            if y < x { scale * (y - x).exp() } else { 0.0 }
        },
    )
}

/// λ exp(−(x − y)²) with λ next to the reciprocal of its largest eigenvalue, 0.84953607.
fn near_eigenvalue(gap: f64) -> CubeModel {
    gauss::<1>((1.0 - gap) / 0.849_536_07)
}

/// Standard errors times the root of the seconds of walks, and of all seconds.
fn costs(solved: Result<Report, SolveError>) -> String {
    let report = match solved {
        Ok(report) => report,
        Err(SolveError::NotReached(report)) => *report,
        Err(error) => {
            let text = error.to_string();
            return text.chars().take(60).collect();
        }
    };
    let of = |seconds: f64| {
        let each = report
            .goals
            .iter()
            .map(|goal| format!("{:.1e}", goal.std_error() * seconds.sqrt()));
        each.collect::<Vec<_>>().join(" / ")
    };
    format!(
        "{} ({} with the set-up; {} cells, degree {})",
        of(report.walk_seconds),
        of(report.walk_seconds + report.setup_seconds),
        report.cells,
        report.degree
    )
}

fn main() {
    let rows: Vec<(&str, CubeModel)> = vec![
        ("1/2 Gauss", gauss::<1>(0.5)),
        ("2 Gauss", gauss::<1>(2.0)),
        ("Love, a = 0.1", love(0.1, 1.0)),
        ("Love, a = 0.1, times 1.5", love(0.1, 1.5)),
        ("Love, a = 0.01", love(0.01, 1.0)),
        (
            "0.4 exp(-|x - y|), [0, 20]",
            of::<1>(20.0, |x, y| 0.4 * (-distance(x, y)).exp()),
        ),
        ("1/2 exp(-|x - y|)", kink::<1>(0.5)),
        ("Green x 5", green(5.0)),
        ("Green x 15", green(15.0)),
        ("Green x 50", green(50.0)),
        ("Volterra 3", volterra(3.0)),
        ("Volterra 10", volterra(10.0)),
        ("1.2 where |x - y| < 0.3", jump::<1>(1.2)),
        (
            "5 cos 40xy",
            of::<1>(1.0, |[x], [y]| 5.0 * (40.0 * x * y).cos()),
        ),
        (
            "-0.3 ln |x - y|",
            of::<1>(1.0, |[x], [y]| -0.3 * (x - y).abs().ln()),
        ),
        ("near an eigenvalue, 1e-3", near_eigenvalue(1e-3)),
        ("near an eigenvalue, 1e-6", near_eigenvalue(1e-6)),
        ("d = 2, 1/2 Gauss", gauss::<2>(0.5)),
        ("d = 2, 3 Gauss", gauss::<2>(3.0)),
        ("d = 2, kink", kink::<2>(0.5)),
        ("d = 2, jump", jump::<2>(0.8)),
        ("d = 3, 1/2 Gauss", gauss::<3>(0.5)),
        ("d = 3, 4 Gauss", gauss::<3>(4.0)),
        ("d = 3, kink", kink::<3>(0.5)),
        ("d = 3, jump", jump::<3>(0.8)),
        ("d = 4, 1/2 Gauss", gauss::<4>(0.5)),
        ("d = 4, 5 Gauss", gauss::<4>(5.0)),
        ("d = 6, 1/2 Gauss", gauss::<6>(0.5)),
        ("d = 6, 5 Gauss", gauss::<6>(5.0)),
    ];
    for (name, model) in rows {
        let dimension = fredholm::Model::about(&model).dimension.unwrap_or(1);
        let at = vec![0.3; dimension];
        let solver = Solver::new(&model).at(at.as_slice()).mean();
        let solver = solver.time_limit(LIMIT);
        println!("{name}");
        for method in [Method::Resolvent, Method::Walks] {
            let solved = solver.clone().method(method).walks(1 << 32).solve();
            println!(
                "    {:<10} {}",
                fredholm::Choices::word(method),
                costs(solved)
            );
        }
    }
}
