//! What is computed before walks has the same bits, whatever is known at compile time.

use fredholm_circle::{Circle, Harmonic, OwnedTables};
use fredholm_core::Real;
use fredholm_core::galerkin::{
    Cells, Dense, DiagonalRule, GalerkinMatrix, PairKind, Solution, functions, second_moment_radius,
};
use fredholm_cube::{Cube, CubeRule};
use fredholm_room::{Enclosure, Grading, Material, Matrix, Mesh, Scene, Surface, min_mass_ratio};

/// FNV-1a of the bits.
fn hash(numbers: impl IntoIterator<Item = f64>) -> u64 {
    let bytes = numbers.into_iter().flat_map(|x| x.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// v, G in both scalars with this kind of diagonal, the bound of the radius and the last residual.
fn of_solution(
    solution: &Solution,
    matrix: &dyn GalerkinMatrix<Scalar = f64>,
    diagonal: PairKind,
) -> u64 {
    let pairs = DiagonalRule { diagonal };
    let wide = solution.for_walks::<f64, _>(matrix, pairs).unwrap();
    let narrow = solution.for_walks::<f32, _>(matrix, pairs).unwrap();
    let narrow = narrow.source().iter().copied().map(f64::from);
    let numbers = wide.v().iter().chain(wide.source()).copied().chain(narrow);
    hash(numbers.chain([solution.radius_bound, solution.convergence.residual]))
}

fn circle<const B: usize>() -> u64 {
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    let tables = OwnedTables::<f64>::new(&[0.3, 0.7], 50).unwrap();
    let circle = Circle::new(tables, light).unwrap();
    let system = circle.system::<B>();
    let solution = system.solve(1e-13, 1000).unwrap();
    of_solution(&solution, &system, PairKind::Dropped)
}

#[test]
fn circles_never_change_a_bit() {
    let found = [circle::<1>(), circle::<3>(), circle::<5>()];
    let expected = [
        0x1004_b63e_d7d2_8995,
        0x9139_e04b_3123_2a48,
        0x12a6_6fd5_54f6_90a7,
    ];
    assert_eq!(found, expected, "{found:#x?}");
}

/// Of a table, its solution, the same with product tables, and the radius of h²p.
fn cube<const D: usize, const B: usize>(cells: usize, degree: usize) -> [u64; 5] {
    let kernel = |x: &[f64; D], y: &[f64; D]| {
        let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
        0.5 * Real::exp(-square)
    };
    let factor = |axis: usize, x: f64, y: f64| {
        let scale = if axis == 0 { 0.5 } else { 1.0 };
        scale * Real::exp(-(x - y) * (x - y))
    };
    let source = |x: &[f64; D]| 1.0 + x[0];
    let cube = Cube::<f64, D, _, _>::new(kernel, source, cells).unwrap();
    let cube = cube.with_functions::<B>();
    let rule = CubeRule::new(&cube, degree, (degree + 1).min(5)).unwrap();
    let entries = rule.table(&kernel).unwrap();
    let dense = Dense::new(&entries, cells.pow(D as u32), B).unwrap();
    let means = rule.means(cube.right_hand_side()).unwrap();
    let by_table = Solution::new(&dense, means.clone(), 1e-13, 1000).unwrap();
    let tables = rule.product_tables(&factor).unwrap();
    let by_axes = Solution::new(&tables, means, 1e-13, 1000).unwrap();
    let pairs = DiagonalRule {
        diagonal: PairKind::Galerkin,
    };
    let middle = |cell| [cube.point(cell, &[0.5; D])];
    let radius = second_moment_radius::<_, _, _, B>(&cube, &dense, &pairs, middle, |_, _| 0.0);
    [
        hash(entries.iter().copied()),
        of_solution(&by_table, &dense, PairKind::Dropped),
        of_solution(&by_axes, &tables, PairKind::Dropped),
        hash(tables.entries().iter().copied()),
        hash(radius),
    ]
}

#[test]
fn cubes_never_change_a_bit() {
    let found = [
        cube::<1, 1>(20, 0),
        cube::<1, 5>(6, 4),
        cube::<1, 7>(4, 6),
        cube::<2, { functions(2, 3) }>(3, 3),
        cube::<3, { functions(3, 2) }>(2, 2),
    ];
    let expected = [
        [
            0x751f_0328_a410_6819,
            0x5c0d_1eb2_5ba9_ef09,
            0x4e0b_ac98_1583_6485,
            0x751f_0328_a410_6819,
            0x9806_d6f2_0494_1340,
        ],
        [
            0x5a54_f3f2_cb41_5788,
            0x0edb_10e8_0237_052d,
            0x3f16_bab8_0578_a463,
            0x5a54_f3f2_cb41_5788,
            0xa675_bf0f_d47e_b4d2,
        ],
        [
            0x9dc6_0c1f_54ed_8f56,
            0x4aa0_6cc7_3ada_6799,
            0x8e84_bccb_400e_5d0c,
            0x9dc6_0c1f_54ed_8f56,
            0x3838_2709_3733_aa68,
        ],
        [
            0x66e8_370f_6daa_dede,
            0xbf8c_06c7_f088_e343,
            0x4809_5971_3733_eacd,
            0x7d12_6978_1f3a_21a9,
            0x5503_0a4a_eee6_ad8b,
        ],
        [
            0xe37d_1348_0293_846e,
            0xfd93_94c2_7e97_35c9,
            0xfd7c_5365_39cb_a137,
            0x7463_c97a_f12b_3fdc,
            0x2f22_36c5_f575_6c8f,
        ],
    ];
    assert_eq!(found, expected, "{found:#x?}");
}

/// Of views and coefficients, and of the solution.
fn room<const B: usize>() -> [u64; 2] {
    let grey = [Material {
        reflectance: 0.5,
        emission: 0.0,
    }];
    let lamp = [Material {
        reflectance: 0.1,
        emission: 1.0,
    }];
    let surface = |points, materials| Surface { points, materials };
    let surfaces = [
        surface(&[[0.0, 0.0], [1.0, 0.0]][..], &grey[..]),
        surface(&[[1.0, 0.0], [1.0, 1.0]], &lamp),
        surface(&[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], &grey),
        surface(&[[0.6, 0.2], [0.5, 0.8]], &grey),
        surface(&[[0.5, 0.8], [0.6, 0.2]], &grey),
    ];
    let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed).unwrap();
    let mesh = Mesh::new::<f64>(&scene, 60, Grading::of_pairs(B - 1)).unwrap();
    let matrix = Matrix::with_functions(&scene, &mesh, min_mass_ratio(B - 1), B).unwrap();
    let solution = matrix.solve(&scene, &mesh, 1e-13, 1000).unwrap();
    let views = matrix.views().table().iter().map(|&view| f64::from(view));
    [
        hash(views.chain(matrix.entries().iter().copied())),
        of_solution(&solution, &matrix.coefficients(), PairKind::Pointwise),
    ]
}

#[test]
fn rooms_never_change_a_bit() {
    let found = [room::<1>(), room::<2>(), room::<3>(), room::<5>()];
    let expected = [
        [0x9959_9e5a_46f4_0ba1, 0x4cef_bb96_7242_b44a],
        [0xffa8_316f_e9fb_f7a3, 0x42fa_91c1_5998_111c],
        [0x450d_bfb6_fb0c_e1c6, 0x39fe_4ea0_cd3e_9f11],
        [0x257c_8c39_7ef0_01bb, 0x5b31_a3b1_f9d6_0b4b],
    ];
    assert_eq!(found, expected, "{found:#x?}");
}
