//! The problems for which cells and walks are chosen.

/// A problem whose one target has a known answer.
pub(super) struct Problem {
    pub(super) name: &'static str,
    pub(super) text: &'static str,
    pub(super) exact: f64,
}

pub(super) const PROBLEMS: [Problem; 6] = [
    Problem {
        name: "circle",
        text: r#"
problem = { kind = "circle", reflectance = [0.3, 0.7, 0.0, 0.55, 0.74, 0.1, 0.62, 0.25, 0.48, 0.4], emission = { constant = 5.0, amplitude = 1.0, frequency = 5 } }
target = [{ name = "point", at = 0.3 }]
"#,
        // Heinrich 1995, (58): 5 + sin(5 · 0.3).
        exact: 5.997_494_986_604_054,
    },
    // The models are K(s,t) = 1/(1+2s+t), x(t) = t of Atkinson and Shampine (ACM TOMS 876), and tensor products
    // of it.
    Problem {
        name: "cube, d = 1",
        text: r#"
problem = { kind = "cube", dimension = 1, kernel = "1 / (1 + 2*x + y)", source = "x - 1 + (1 + 2*x) * ln((2 + 2*x) / (1 + 2*x))" }
target = [{ name = "point", at = 0.3 }]
"#,
        exact: 0.3,
    },
    Problem {
        name: "cube, d = 2",
        text: r#"
problem = { kind = "cube", dimension = 2, kernel = "1 / ((1 + 2*x1 + y1) * (1 + 2*x2 + y2))", source = "x1*x2 - (1 - (1 + 2*x1) * ln((2 + 2*x1) / (1 + 2*x1))) * (1 - (1 + 2*x2) * ln((2 + 2*x2) / (1 + 2*x2)))" }
target = [{ name = "mean", over = "all" }]
"#,
        exact: 0.25,
    },
    Problem {
        name: "cube, d = 3",
        text: r#"
problem = { kind = "cube", dimension = 3, kernel_factors = ["1 / (1 + 2*x + y)", "1 / (1 + 2*x + y)", "1 / (1 + 2*x + y)"], source = "x1*x2*x3 - (1 - (1 + 2*x1) * ln((2 + 2*x1) / (1 + 2*x1))) * (1 - (1 + 2*x2) * ln((2 + 2*x2) / (1 + 2*x2))) * (1 - (1 + 2*x3) * ln((2 + 2*x3) / (1 + 2*x3)))" }
target = [{ name = "point", at = [0.3, 0.6, 0.2] }]
"#,
        exact: 0.036,
    },
    Problem {
        name: "room",
        text: r#"
problem.kind = "room"
problem.surface = [{ name = "bottom", points = [[0, 0], [1, 0]], reflectance = 0.3 }, { name = "right", points = [[1, 0], [1, 1]], reflectance = 0.6, emission = 1 }, { name = "top", points = [[1, 1], [0, 1]], reflectance = 0.7 }, { name = "left", points = [[0, 1], [0, 0]], reflectance = 0.5 }]
target = [{ name = "point", at = { surface = "bottom", t = 0.37 } }]
"#,
        // Graded Nyström, two independent computations.
        exact: 0.160_505_386_056,
    },
    // Two rooms and a doorway with a sill and a thin lintel; the lamp is the left wall of the left one, and the target
    // lies behind the sill.
    Problem {
        name: "doorway",
        text: r#"
problem.kind = "room"
problem.surface = [{ name = "floor", points = [[0, 0], [1.9, 0]], reflectance = 0.6 }, { name = "sill", points = [[1.9, 0], [1.9, 0.7], [2.1, 0.7], [2.1, 0]], reflectance = 0.5 }, { name = "right room", points = [[2.1, 0], [4, 0], [4, 2], [0, 2]], reflectance = 0.6 }, { name = "lamp", points = [[0, 2], [0, 0]], reflectance = 0.4, emission = 1 }, { name = "lintel, left", points = [[2, 2], [2, 1.2]], reflectance = 0.5 }, { name = "lintel, right", points = [[2, 1.2], [2, 2]], reflectance = 0.5 }]
target = [{ name = "point", at = { surface = "right room", t = 0.02 } }]
"#,
        // Two runs with all pairs pointwise: 0.028_036_134 ± 1.4e-8 of a million walks (200 cells of degree 3, absorption
        // estimator), 0.028_036_101 ± 3.9e-8 of 400,000 (100 of degree 2, collision estimator).
        exact: 0.028_036_13,
    },
];
