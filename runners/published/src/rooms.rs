//! Published form factors of rooms, and the light in them.

use core::f64::consts::TAU;

use crate::chapters::{known, walks};
use crate::{Check, Factors};

/// One unit of the last digit of numbers with twelve decimals, of which it is not known whether they
/// were rounded or cut.
const LAST_DIGIT: f64 = 1e-12;

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

pub(crate) fn strings() -> Vec<Check> {
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

pub(crate) fn obstacles() -> Vec<Check> {
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

pub(crate) fn facet() -> Check {
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

pub(crate) fn rooms() -> Vec<Check> {
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
