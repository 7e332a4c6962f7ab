//! The numbers: typed in from where they were published or derived, none computed by this project's
//! libraries, and the problem files that ask for them.

use core::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, LN_2, PI, TAU};

use super::{Chapter, Check, Factors, Known, Size, Walks};

/// One unit of the last digit of numbers with twelve decimals, of which it is not known whether they
/// were rounded or cut.
const LAST_DIGIT: f64 = 1e-12;

/// Everything that is compared, in the order of the page.
pub(super) fn chapters() -> Vec<Chapter> {
    vec![
        Chapter {
            source: "Heinrich 1995, section 5, (57) and (58): F such that u = C + D sin(l s)",
            checks: harmonics(),
        },
        Chapter {
            source: "Eigenvalues 1/(1 - 4 k^2) of the circle's kernel: u as a Fourier series",
            checks: vec![lamp()],
        },
        Chapter {
            source: "Atkinson and Shampine 2008 (ACM TOMS 35, algorithm 876), and tensor products",
            checks: models(),
        },
        Chapter {
            source: "Form factors of fully visible surfaces: crossed strings (Hottel 1954); Howell's catalogue",
            checks: strings(),
        },
        Chapter {
            source: "Form factors past corners and obstacles: independent computations to ten or twelve digits",
            checks: obstacles(),
        },
        Chapter {
            source: "FACET (UCID-19887, Lawrence Livermore 1983), a View2D deck",
            checks: vec![facet()],
        },
        Chapter {
            source: "Light in rooms: graded Nystrom solutions (square, polygons), the furnace u = 1",
            checks: rooms(),
        },
        Chapter {
            source: "Heinrich 1995, section 5, the table (its random choices are not printed)",
            checks: vec![Check::Experiment(EXPERIMENT.to_vec())],
        },
        Chapter {
            source: "Heinrich and Mathe 1993: standard deviation ~ n^(-1/d), error ~ cost^(-1/(2d) - 1/2)",
            checks: (1..=3).map(Check::Exponents).collect(),
        },
    ]
}

/// A target, its words in a file, and its value.
fn known(name: &str, place: &str, expected: f64) -> Known {
    Known {
        name: name.to_owned(),
        place: place.to_owned(),
        expected,
    }
}

/// Walks on the problem with these sections before its targets.
fn walks(name: &str, file: &str, targets: Vec<Known>) -> Check {
    Check::Walks(Walks {
        name: name.to_owned(),
        file: file.to_owned(),
        targets,
    })
}

fn harmonics() -> Vec<Check> {
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
fn lamp() -> Check {
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
fn models() -> Vec<Check> {
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
                    0.9_f64.powi(10),
                ),
                known("mean", "over = 'all'", 3.0_f64.powi(-5)),
            ],
        ),
    ]
}

/// A surface of a problem file.
fn surface(name: &str, points: &[[f64; 2]], reflectance: f64, emission: f64) -> String {
    format!(
        "[[problem.surface]]\nname = '{name}'\npoints = {points:?}\n\
         reflectance = {reflectance:?}\nemission = {emission:?}\n"
    )
}

/// The polygon with these vertices, anticlockwise: a surface for each side, named as given.
fn outline(vertices: &[[f64; 2]], names: &[&str]) -> String {
    let ends = vertices.iter().zip(vertices.iter().cycle().skip(1));
    let sides = ends.zip(names);
    let sides = sides.map(|((&a, &b), name)| surface(name, &[a, b], 0.5, 0.0));
    format!("[problem]\nkind = 'room'\n{}", sides.collect::<String>())
}

/// Form factors from one surface of a problem file.
fn factors(name: &str, file: String, from: &str, to: &[(&str, f64)]) -> Check {
    factors_within(LAST_DIGIT, name, file, from, to)
}

fn factors_within(
    precision: f64,
    name: &str,
    file: String,
    from: &str,
    to: &[(&str, f64)],
) -> Check {
    Check::Factors(Factors {
        name: name.to_owned(),
        deck: false,
        // A file needs a target; form factors do not.
        text: format!("{file}[[target]]\nname = 'mean'\nover = 'all'\n"),
        pairs: to
            .iter()
            .map(|&(to, value)| (from.to_owned(), to.to_owned(), value))
            .collect(),
        precision,
    })
}

fn strings() -> Vec<Check> {
    let box_of = |width: f64, height: f64| {
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        outline(&corners, &["floor", "right", "top", "left"])
    };
    let opposite = |h: f64| (1.0 + h * h).sqrt() - h;
    let corner = |h: f64| 0.5 * (1.0 + h - (1.0 + h * h).sqrt());
    let wedge = |degrees: f64| {
        let angle = degrees.to_radians();
        let far = [angle.cos(), angle.sin()];
        let file = outline(&[[0.0, 0.0], [1.0, 0.0], far], &["plate", "rest", "other"]);
        let name = format!("wedge of {degrees} degrees, 1 - sin(a/2)");
        factors(
            &name,
            file,
            "plate",
            &[("other", 1.0 - (0.5 * angle).sin())],
        )
    };
    vec![
        factors(
            "rectangle 2 x 1",
            box_of(2.0, 1.0),
            "floor",
            &[("right", 0.190_983_005_625), ("top", 0.618_033_988_750)],
        ),
        factors(
            "plates, distance/width = 3",
            box_of(1.0, 3.0),
            "floor",
            &[("top", opposite(3.0))],
        ),
        factors(
            "plates, distance/width = 0.01",
            box_of(100.0, 1.0),
            "floor",
            &[("top", opposite(0.01))],
        ),
        factors(
            "right angle, other/one = 2.5",
            box_of(1.0, 2.5),
            "floor",
            &[("left", corner(2.5))],
        ),
        wedge(30.0),
        wedge(60.0),
        wedge(120.0),
    ]
}

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
const L: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [3.0, 0.0],
    [3.0, 1.0],
    [1.0, 1.0],
    [1.0, 3.0],
    [0.0, 3.0],
];
/// The block's sides, clockwise: the outside is active.
const BLOCK: [(&str, [[f64; 2]; 2]); 4] = [
    ("block bottom", [[0.75, 0.25], [0.25, 0.25]]),
    ("block left", [[0.25, 0.25], [0.25, 0.75]]),
    ("block top", [[0.25, 0.75], [0.75, 0.75]]),
    ("block right", [[0.75, 0.75], [0.75, 0.25]]),
];

fn obstacles() -> Vec<Check> {
    let names = [
        "bottom",
        "right",
        "inner floor",
        "inner wall",
        "top",
        "left",
    ];
    let block = BLOCK.map(|(name, ends)| surface(name, &ends, 0.5, 0.0));
    let block = outline(&SQUARE, &["bottom", "right", "top", "left"]) + &block.concat();
    vec![
        factors(
            "L-shaped room",
            outline(&L, &names),
            "bottom",
            &[
                ("right", 0.139_620_389_972),
                ("inner floor", 0.497_355_345_883),
                ("inner wall", 0.041_989_317_034),
                ("top", 0.066_390_939_611),
                ("left", 0.254_644_007_500),
            ],
        ),
        // Crossed strings between the bottom and the side of the block that faces it.
        factors(
            "block in a square, facing side",
            block.clone(),
            "bottom",
            &[("block bottom", 0.625_f64.sqrt() - 0.125_f64.sqrt())],
        ),
        // The given value of that factor, ...454, is 5e-12 above the closed form, ...449; and so the
        // others are believed to ten digits.
        factors_within(
            1e-11,
            "block in a square",
            block,
            "bottom",
            &[
                ("top", 0.081_138_830_084),
                ("right", 0.209_430_584_956),
                ("left", 0.209_430_584_956),
                ("block bottom", 0.437_016_024_454),
                ("block left", 0.031_491_987_775),
                ("block right", 0.031_491_987_775),
                ("block top", 0.0),
            ],
        ),
    ]
}

/// Vertices and surfaces of FACET.
const FACET: &str = "\
T FACET
C 1 0 1e-9 10 0 0
G 2
V  1       0.00  0.0
V  2       0.00  0.5
V  3       0.40  0.5
V  4       0.00  1.0
V  5       1.00  1.0
V  6       1.00  0.5
V  7       0.60  0.5
V  8       1.00  0.0
V  9       0.65  0.0
V 10       0.35  0.0
S  1        2  1   0   0   0   0.9   S1
S  2        3  2   0   0   0   0.9   S2
S  3        2  3   0   0   0   0.9   S3
S  4        4  2   0   0   0   0.9   S4
S  5        5  4   0   0   0   0.9   S5
S  6        6  5   0   0   0   0.9   S6
S  7        7  6   0   0   0   0.9   S7
S  8        6  7   0   0   0   0.9   S8
S  9        8  6   0   0   0   0.9   S9
S 10        9  8   0   0   0   0.9   S10
S 11       10  9   0   0   0   0.9   S11
S 12        1 10   0   0   0   0.9   S12
End of data
";

fn facet() -> Check {
    let row = |from: &str, to: &[(usize, f64)]| {
        let pair = |&(to, value): &(usize, f64)| (from.to_owned(), format!("S{to}"), value);
        to.iter().map(pair).collect::<Vec<_>>()
    };
    let first = row(
        "S1",
        &[
            (2, 0.259_687_576_257),
            (3, 0.0),
            (4, 0.0),
            (5, 0.007_123_828_961),
            (6, 0.052_163_627_192),
            (7, 0.0),
            (8, 0.062_990_978_841),
            (9, 0.236_067_977_500),
            (10, 0.052_026_984_593),
            (11, 0.090_266_807_444),
            (12, 0.239_672_219_213),
        ],
    );
    let fifth = row(
        "S5",
        &[
            (1, 0.003_561_914_480),
            (3, 0.238_660_722_451),
            (4, 0.190_983_005_625),
            (6, 0.190_983_005_625),
            (7, 0.238_660_722_451),
            (9, 0.003_561_914_480),
            (10, 0.038_532_750_784),
            (11, 0.056_523_213_319),
            (12, 0.038_532_750_784),
        ],
    );
    Check::Factors(Factors {
        name: "FACET".to_owned(),
        deck: true,
        text: FACET.to_owned(),
        pairs: [first, fifth].concat(),
        precision: LAST_DIGIT,
    })
}

/// Sections after a room's surfaces.
fn room_walks(cells: usize, pairs: &str, walks: u32, seed: u32) -> String {
    format!(
        "[galerkin]\ncells = {cells}\ndegree = 0\npairs = '{pairs}'\ngrading = 3.0\n\
         [walk]\nwalks = {walks}\nseed = {seed}\n"
    )
}

fn rooms() -> Vec<Check> {
    let sides = [
        ("bottom", 0.3, 0.0),
        ("right", 0.6, 1.0),
        ("top", 0.7, 0.0),
        ("left", 0.5, 0.0),
    ];
    let square = |material: &dyn Fn(f64, f64) -> f64| -> String {
        let ends = SQUARE.into_iter().zip(SQUARE.into_iter().cycle().skip(1));
        let walls = ends.zip(sides);
        let walls: String = walls
            .map(|((a, b), (name, rho, f))| surface(name, &[a, b], rho, material(rho, f)))
            .collect();
        format!("[problem]\nkind = 'room'\n{walls}")
    };
    let lit = square(&|_, f| f);
    let block: String = BLOCK
        .iter()
        .map(|(name, ends)| surface(name, ends, 0.8, 0.2))
        .collect();
    let glowing = square(&|rho, _| 1.0 - rho) + &block;
    let point = |pairs: &str, seed: u32| {
        walks(
            &format!("unit square, rho = .3 .6 .7 .5, {pairs} pairs"),
            &(lit.clone() + &room_walks(400, pairs, 100_000, seed)),
            vec![known(
                "u(0.37, 0)",
                "at = { surface = 'bottom', t = 0.37 }",
                0.160_505_386_056,
            )],
        )
    };
    let mut all = vec![
        point("default", 8),
        point("paper", 12),
        walks(
            "furnace with a block, F = 1 - rho",
            &(glowing + &room_walks(400, "default", 100_000, 9)),
            vec![
                known("u on the right", "at = { surface = 'right', t = 0.2 }", 1.0),
                known("mean of block top", "over = 'block top'", 1.0),
                known("mean", "over = 'all'", 1.0),
            ],
        ),
    ];
    // u - 6/7 at the middle of a side of the inscribed polygon, with rho = 1/2 and F on a side the
    // cosine of the angle of its middle: from a Nystrom scheme on one side, all sides being turns of
    // it, that the tests carry out again.
    let polygons = [
        (45, -5.0994e-4),
        (90, -1.281_81e-4),
        (180, -3.2098e-5),
        (360, -8.0284e-6),
    ];
    all.extend(polygons.map(|(n, difference)| {
        walks(
            &format!("regular {n}-gon, F = cos"),
            &(polygon(n) + &room_walks(1800, "default", 1_000_000, 100 + n)),
            vec![known(
                "u at the middle of a side",
                "at = { surface = 'side 0', t = 0.5 }",
                6.0 / 7.0 + difference,
            )],
        )
    }));
    all
}

/// The regular polygon of n sides in the unit circle.
fn polygon(n: u32) -> String {
    let angle = |k: f64| TAU * k / f64::from(n);
    let vertex = |k: u32| {
        let angle = angle(f64::from(k % n) - 0.5);
        [angle.cos(), angle.sin()]
    };
    let sides: String = (0..n)
        .map(|k| {
            let emission = angle(f64::from(k)).cos();
            surface(
                &format!("side {k}"),
                &[vertex(k), vertex(k + 1)],
                0.5,
                emission,
            )
        })
        .collect();
    format!("[problem]\nkind = 'room'\n{sides}")
}

/// n and the printed √Var^mc and √Var^pmc of most walks.
const EXPERIMENT: [Size; 3] = [
    Size {
        cells: 10,
        plain: 7.67,
        preconditioned: 0.693,
    },
    Size {
        cells: 100,
        plain: 7.67,
        preconditioned: 0.0980,
    },
    Size {
        cells: 1000,
        plain: 7.68,
        preconditioned: 0.008_80,
    },
];
