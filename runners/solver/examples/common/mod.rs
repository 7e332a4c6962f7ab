//! What examples measure with, and equations with known solutions.

use fredholm::circle::{Emission, Harmonic};
use fredholm::room::{Material, Surfaces};
use fredholm::{CircleModel, CubeModel};

/// Seconds of processor time of this process's threads so far; 0 where nobody tells.
pub(crate) fn seconds() -> f64 {
    let all = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let of_threads = all.flatten().filter_map(|thread| {
        let told = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        told.split(' ').next()?.parse::<f64>().ok()
    });
    1e-9 * of_threads.sum::<f64>()
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

/// A circle with five reflectances and the light 5 + sin 5θ.
pub(crate) fn arcs() -> CircleModel {
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    CircleModel::new(vec![0.3, 0.7, 0.0, 0.55, 0.74], Emission::Harmonic(light))
}

/// A lit wall opposite to three that reflect half of the light.
pub(crate) fn square() -> Surfaces {
    let half = Material {
        reflectance: 0.5,
        emission: 0.0,
    };
    let lit = Material {
        emission: 1.0,
        ..half
    };
    Surfaces::default()
        .with("lit", &[[0.0, 1.0], [0.0, 0.0]], lit)
        .with(
            "others",
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            half,
        )
}

/// Two rooms with a door between them, a lamp in the left one.
pub(crate) fn doorway() -> Surfaces {
    let material = |reflectance, emission| Material {
        reflectance,
        emission,
    };
    Surfaces::default()
        .with("floor, left", &[[0.0, 0.0], [1.9, 0.0]], material(0.6, 0.0))
        .with(
            "sill",
            &[[1.9, 0.0], [1.9, 0.7], [2.1, 0.7], [2.1, 0.0]],
            material(0.5, 0.0),
        )
        .with(
            "right",
            &[[2.1, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]],
            material(0.6, 0.0),
        )
        .with("lamp", &[[0.0, 2.0], [0.0, 0.0]], material(0.4, 1.0))
}

/// The square with a box in it.
pub(crate) fn boxed() -> Surfaces {
    let dark = Material {
        reflectance: 0.2,
        emission: 0.0,
    };
    let around = [[0.4, 0.3], [0.4, 0.6], [0.6, 0.6], [0.6, 0.3], [0.4, 0.3]];
    square().with("box", &around, dark)
}
