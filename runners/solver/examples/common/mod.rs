//! What examples measure with, and equations with known solutions.

#![allow(dead_code, reason = "no example needs all of it")]

use fredholm::CubeModel;

/// Seconds of processor time of this process so far; 0 where nobody tells. Linux counts in hundredths.
pub(crate) fn seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Behind the name, which is in parentheses, these are the 12th and the 13th.
    let fields = text.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    ticks
        .filter_map(|ticks| ticks.parse::<f64>().ok())
        .sum::<f64>()
        / 100.0
}

/// The time of work that is short, by as often as makes it long.
pub(crate) fn time<R>(mut work: impl FnMut() -> R) -> (f64, R) {
    let start = seconds();
    let mut times = 0.0;
    loop {
        let result = work();
        times += 1.0;
        let took = seconds() - start;
        if took > 1.0 || times > 1e4 {
            return (took / times, result);
        }
    }
}

pub(crate) fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    f64::sqrt(sum / count)
}

/// K = ½ exp(−|x − y|²) and the solution 1 + Σ x_a², with F = u − T_K u by products of one-dimensional integrals.
pub(crate) fn gauss<const D: usize>() -> CubeModel {
    // ∫ y^k exp(−(x − y)²) dy over [0, 1] for k = 0 and 2, by 12 Gauss points: to 10⁻¹⁵.
    let rule = fredholm_variance::gauss(12).expect("a rule");
    let moment = move |x: f64, power: i32| {
        let at = |y: f64| y.powi(power) * (-(x - y).powi(2)).exp();
        rule.iter()
            .map(|(t, w)| 0.5 * w * at(0.5 * (1.0 + t)))
            .sum::<f64>()
    };
    let solution = |x: &[f64]| 1.0 + x.iter().map(|x| x * x).sum::<f64>();
    CubeModel::from_fn::<D>(
        |x, y| {
            let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
            0.5 * (-square).exp()
        },
        move |x| {
            let zeroth = x.map(|x| moment(x, 0));
            let all: f64 = zeroth.iter().product();
            let with_square = (0..D).map(|a| all / zeroth[a] * moment(x[a], 2));
            solution(x) - 0.5 * (all + with_square.sum::<f64>())
        },
    )
    .with_solution(solution)
}

/// K = ½ exp(−|x − y|) and the solution 1 + x.
pub(crate) fn kink() -> CubeModel {
    CubeModel::from_fn::<1>(
        |x, y| 0.5 * (-(x[0] - y[0]).abs()).exp(),
        |x| 1.5 * (x[0] - 1.0).exp(),
    )
    .with_solution(|x| 1.0 + x[0])
}

/// K = ½ exp(−Σ |x_a − y_a|) and F = 1 + |x|².
pub(crate) fn kinks<const D: usize>() -> CubeModel {
    CubeModel::from_fn::<D>(
        |x, y| {
            let distance: f64 = x.iter().zip(y).map(|(x, y)| (x - y).abs()).sum();
            0.5 * (-distance).exp()
        },
        |x| 1.0 + x.iter().map(|x| x * x).sum::<f64>(),
    )
}
