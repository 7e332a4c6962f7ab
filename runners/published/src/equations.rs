//! Published solutions of equations on the circle and on cubes.

use core::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, LN_2, PI};

use crate::Check;
use crate::chapters::{known, walks};

pub(crate) fn harmonics() -> Vec<Check> {
    let arcs = "[problem]\nkind = 'circle'\n\
                reflectance = [0.3, 0.7, 0.0, 0.55, 0.74, 0.1, 0.62, 0.25, 0.48, 0.4]\n";
    let paper = |s: f64| 5.0 + (5.0 * s).sin();
    let other = |s: f64| 2.0 - 1.5 * (3.0 * s).sin();
    let light = "emission = { constant = 5.0, amplitude = 1.0, frequency = 5 }\n";
    let dimmer = "emission = { constant = 2.0, amplitude = -1.5, frequency = 3 }\n";
    vec![
        walks(
            "C = 5, D = 1, l = 5, paper's pairs",
            &format!(
                "{arcs}{light}[galerkin]\ncells = 1000\ndegree = 0\npairs = 'paper'\n\
                 [walk]\nwalks = 100000\nseed = 1\n"
            ),
            vec![
                known("u(0.3)", "at = 0.3", paper(0.3)),
                known("u(2)", "at = 2.0", paper(2.0)),
                known("u(4.4)", "at = 4.4", paper(4.4)),
                known("mean", "over = 'all'", 5.0),
            ],
        ),
        walks(
            "the same, degree 4",
            &format!(
                "{arcs}{light}[galerkin]\ncells = 200\ndegree = 4\npairs = 'default'\n\
                 [walk]\nwalks = 100000\nseed = 2\n"
            ),
            vec![
                known("u(0.3)", "at = 0.3", paper(0.3)),
                known("mean", "over = 'all'", 5.0),
            ],
        ),
        walks(
            "C = 2, D = -1.5, l = 3, collision",
            &format!(
                "{arcs}{dimmer}[galerkin]\ncells = 200\ndegree = 2\npairs = 'default'\n\
                 [walk]\nwalks = 100000\nseed = 3\nestimator = 'collision'\n"
            ),
            vec![
                known("u(0.3)", "at = 0.3", other(0.3)),
                known("u(2)", "at = 2.0", other(2.0)),
                // The integral of sin 3s from 1 to 4 is (cos 3 - cos 12)/3.
                known(
                    "mean over [1, 4]",
                    "over = [1.0, 4.0]",
                    2.0 + 1.5 * (12_f64.cos() - 3_f64.cos()) / 9.0,
                ),
            ],
        ),
        walks(
            "furnace, F = 1 - rho",
            "[problem]\nkind = 'circle'\nreflectance = [0.3, 0.7, 0.0, 0.9]\n\
             emission = [0.7, 0.3, 1.0, 0.1]\n\
             [galerkin]\ncells = 200\ndegree = 0\npairs = 'default'\n\
             [walk]\nwalks = 100000\nabsorption = 0.1\nseed = 4\n",
            vec![
                known("u(5)", "at = 5.0", 1.0),
                known("mean", "over = 'all'", 1.0),
            ],
        ),
    ]
}

/// rho = 1/2, and F = 1 on the first quarter of the circle. F has the mean 1/4 and the coefficients
/// sin(k pi/4)/(k pi) e^(-ik pi/4); those of u are 1/(1 - rho/(1 - 4 k^2)) times as large, and
/// u - F has terms that fall like k^-3.
pub(crate) fn lamp() -> Check {
    const TERMS: i32 = 20_000;
    let ratio = |k: i32| {
        let eigenvalue = 1.0 / (1.0 - 4.0 * f64::from(k) * f64::from(k));
        0.5 * eigenvalue / (1.0 - 0.5 * eigenvalue)
    };
    let at = |s: f64| {
        let terms = (1..=TERMS).rev().map(|k| {
            let k_real = f64::from(k);
            let size = (k_real * 0.5 * FRAC_PI_2).sin() / (k_real * PI);
            2.0 * size * ratio(k) * (k_real * (s - 0.5 * FRAC_PI_2)).cos()
        });
        let own = if s < FRAC_PI_2 { 1.0 } else { 0.0 };
        own + 0.25 * ratio(0) + terms.sum::<f64>()
    };
    walks(
        "a lamp on a quarter of the circle",
        "[problem]\nkind = 'circle'\nreflectance = [0.5]\nemission = [1.0, 0.0, 0.0, 0.0]\n\
         [galerkin]\ncells = 100\ndegree = 1\npairs = 'default'\n\
         [walk]\nwalks = 100000\nseed = 5\n",
        vec![
            known("u(0.5)", "at = 0.5", at(0.5)),
            known("u(2)", "at = 2.0", at(2.0)),
            known("u(4)", "at = 4.0", at(4.0)),
            known("mean", "over = 'all'", 0.5),
        ],
    )
}

/// lambda x(s) - int K(s,t) x(t) dt = lambda x - Kx, divided by lambda.
pub(crate) fn models() -> Vec<Check> {
    let one = |name: &str, problem: &str, targets| {
        walks(
            name,
            &format!(
                "[problem]\nkind = 'cube'\ndimension = 1\n{problem}\n\
                 [galerkin]\ncells = 100\ndegree = 0\n[walk]\nwalks = 200000\nseed = 6\n"
            ),
            targets,
        )
    };
    let more = |name: &str, dimension: usize, cells: usize, problem: &str, targets| {
        walks(
            name,
            &format!(
                "[problem]\nkind = 'cube'\ndimension = {dimension}\n{problem}\n\
                 [galerkin]\ncells = {cells}\ndegree = 0\n[walk]\nwalks = 200000\nseed = 7\n"
            ),
            targets,
        )
    };
    vec![
        one(
            "s t^2, lambda = 0.6, x = t^2",
            "kernel = 'x * y^2 / 0.6'\nsource = 'x^2 - x / 5 / 0.6'",
            vec![
                known("u(0.9)", "at = 0.9", 0.81),
                known("mean", "over = 'all'", 1.0 / 3.0),
            ],
        ),
        one(
            "1/(1 + 2 s + t), lambda = 0.9, x = t",
            "kernel = '1 / (1 + 2 * x + y) / 0.9'\n\
             source = 'x - (1 - (1 + 2 * x) * ln((2 + 2 * x) / (1 + 2 * x))) / 0.9'",
            vec![
                known("u(0.3)", "at = 0.3", 0.3),
                known("mean", "over = 'all'", 0.5),
                known("weight 1/(1 + s)", "weight = '1 / (1 + x)'", 1.0 - LN_2),
            ],
        ),
        one(
            "s^3 t^4, lambda = 0.5, x = t^0.5",
            "kernel = 'x^3 * y^4 / 0.5'\nsource = 'sqrt(x) - x^3 / 5.5 / 0.5'",
            vec![
                known("u(0.5)", "at = 0.5", FRAC_1_SQRT_2),
                known("mean", "over = 'all'", 2.0 / 3.0),
            ],
        ),
        one(
            "|s - t|, lambda = 1, x = t, diagonal pointwise",
            "kernel = 'abs(x - y)'\nkernel_integral = '(y - x) * abs(y - x) / 2'\n\
             source = '-(2 * x^3 - 9 * x + 2) / 6'",
            vec![
                known("u(0.3)", "at = 0.3", 0.3),
                known("mean", "over = 'all'", 0.5),
            ],
        ),
        one(
            "Green's function, lambda = 0.5, x = t (1 - t)",
            "kernel = '(x < y ? -x * (1 - y) : -y * (1 - x)) / 0.5'\n\
             source = 'x * (1 - x) - (x^3 / 3 * (1 / 2 - x / 4) - x / 12) / 0.5'",
            vec![
                known("u(0.3)", "at = 0.3", 0.21),
                known("mean", "over = 'all'", 1.0 / 6.0),
            ],
        ),
        more(
            "1/(1 + 2 s + t) in d = 2, lambda = 0.6",
            2,
            16,
            "kernel = '1 / (1 + 2 * x1 + y1) / (1 + 2 * x2 + y2) / 0.6'\n\
             source = 'x1 * x2 - (1 - (1 + 2 * x1) * ln((2 + 2 * x1) / (1 + 2 * x1))) * \
                       (1 - (1 + 2 * x2) * ln((2 + 2 * x2) / (1 + 2 * x2))) / 0.6'",
            vec![
                known("u(0.3, 0.6)", "at = [0.3, 0.6]", 0.18),
                known("mean", "over = 'all'", 0.25),
            ],
        ),
        more(
            "|s - t| in d = 3, lambda = 0.2",
            3,
            6,
            "kernel = 'abs(x1 - y1) * abs(x2 - y2) * abs(x3 - y3) / 0.2'\n\
             source = 'x1 * x2 * x3 - (x1^3 / 3 - x1 / 2 + 1 / 3) * (x2^3 / 3 - x2 / 2 + 1 / 3) * \
                       (x3^3 / 3 - x3 / 2 + 1 / 3) / 0.2'",
            vec![
                known("u(0.3, 0.6, 0.9)", "at = [0.3, 0.6, 0.9]", 0.162),
                known("mean", "over = 'all'", 0.125),
            ],
        ),
        more(
            "s t^2 in d = 5 as a product, lambda = 0.1",
            5,
            3,
            "kernel_factors = ['x * y^2 / 0.1', 'x * y^2', 'x * y^2', 'x * y^2', 'x * y^2']\n\
             source = '(x1 * x2 * x3 * x4 * x5)^2 - x1 * x2 * x3 * x4 * x5 / 3125 / 0.1'",
            vec![
                known(
                    "u(0.9, ..., 0.9)",
                    "at = [0.9, 0.9, 0.9, 0.9, 0.9]",
                    // 0.9^10.
                    0.348_678_440_1,
                ),
                known("mean", "over = 'all'", 1.0 / 243.0),
            ],
        ),
    ]
}
