//! What is computed before walks has the same bits, whatever is known at compile time.

use fredholm_circle::{Circle, Harmonic, OwnedTables};
use fredholm_core::Real;
use fredholm_core::galerkin::{
    Cells, Dense, DiagonalRule, GalerkinMatrix, PairKind, Solution, functions, second_moment_radius,
};
use fredholm_cube::{Cube, CubeRule};
use fredholm_room::{Enclosure, Grading, Material, Matrix, Mesh, Scene, Surface, Tables};

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
        0xbfda_d045_e7b7_4e05,
        0x73b6_7844_276c_a328,
        0xbf0c_040e_6a5c_d063,
    ];
    assert_eq!(found, expected, "{found:#x?}");
}

/// Of a table, its solution, the same with product tables, and the radius of h²p.
fn cube<const D: usize, const B: usize>(cells: usize, degree: usize) -> u64 {
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
    let numbers = entries.iter().chain(tables.entries()).copied();
    hash(numbers.chain(radius))
        ^ of_solution(&by_table, &dense, PairKind::Dropped)
        ^ of_solution(&by_axes, &tables, PairKind::Galerkin)
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
        0x5c3e_9071_9101_b598,
        0x22ce_5bec_7b93_d3a0,
        0x92b1_891e_3fda_a925,
        0x42e4_089f_1e92_4dbd,
        0x20dc_2f1e_347d_83a5,
    ];
    assert_eq!(found, expected, "{found:#x?}");
}

/// Of coefficients, and of the solution.
fn room<const B: usize>() -> u64 {
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
    let mesh = Mesh::new::<f64>(&scene, 60, Grading::of_degree(B - 1)).unwrap();
    let tables = Tables::<f64>::new(&scene, &mesh);
    let room = tables.room();
    let matrix = Matrix::new::<B>(&room).unwrap();
    let solution = matrix.solve(&room).unwrap();
    hash(matrix.entries().iter().copied())
        ^ of_solution(&solution, &matrix.coefficients(), PairKind::Pointwise)
}

#[test]
fn rooms_never_change_a_bit() {
    let found = [room::<1>(), room::<2>(), room::<3>(), room::<5>()];
    let expected = [
        0xfc75_8159_8bd0_aaf6,
        0x73a4_0409_e756_e8fc,
        0x4dcb_37b6_e8e0_baa7,
        0x723a_e819_f7a1_0764,
    ];
    assert_eq!(found, expected, "{found:#x?}");
}
