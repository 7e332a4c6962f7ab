//! Form factors against published numbers, and against each other.

use core::f64::consts::TAU;

use fredholm_factors::{Factors, FactorsError, Sights, scene_factors};
use fredholm_scene::{Polygon, Scene, shapes};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

#[path = "../../../scene/tests/all/common/mod.rs"]
mod common;
mod family;
mod sky;
use common::{
    Surfaces, bodies, circle, closed, is_long, map, meshed, mirrored, open, prism, rotation,
    sphere, triangulated,
};

/// Howell's C-11: parallel unit squares at distance 1; to all digits from its closed form,
/// 2/π (ln(2/√3) + 2√2 atan(1/√2) − π/2).
const C_11: f64 = 0.199_824_895_698_387;
/// Howell's C-14: perpendicular unit squares with a common edge.
const C_14: f64 = 0.200_043_776_075_403;
/// Howell's C-41: coaxial discs of radius 1 at distance 1, (3 − √5)/2.
const C_41: f64 = 0.381_966_011_250_105;
/// Coaxial cylinders of radii 0.125 and 0.25 and height 1, inner to outer (Howell's C-92).
const CYLINDERS: f64 = 0.910_868_433_007_748;

/// A_i F_iJ of the first `faces` faces with every surface.
fn first_rows(scene: &Scene, faces: usize, error: f64) -> Vec<f64> {
    let sights = Sights::new(scene, error).unwrap();
    let mut sums = vec![0.0; scene.surfaces()];
    for (other, exchange) in (0..faces).flat_map(|face| sights.row(face).entries) {
        sums[scene.place(other as usize).unwrap().surface] += exchange;
    }
    sums
}

/// A_I F_IJ of the first surface with every surface.
fn first_row(scene: &Scene, error: f64) -> Vec<f64> {
    first_rows(scene, scene.faces_of(0).unwrap().len(), error)
}

/// The largest difference of a row's sum from 1.
fn off(f: &Factors) -> f64 {
    let sums = f.row_sums();
    sums.iter().map(|s| (s - 1.0).abs()).fold(0.0, f64::max)
}

/// The limit of values at n, 2n, 4n … whose error is a series in n⁻².
fn limit(values: &[f64]) -> f64 {
    let mut row = values.to_vec();
    let mut power = 1.0;
    while row.len() > 1 {
        power *= 4.0;
        let pairs = row.windows(2);
        row = pairs
            .map(|w| (power * w[1] - w[0]) / (power - 1.0))
            .collect();
    }
    row[0]
}

fn square(z: f64, side: f64, up: bool) -> Polygon {
    let low = [[0.0, 0.0, z], [side, 0.0, z]];
    let p = Polygon::Quad([low[0], low[1], [side, side, z], [0.0, side, z]]);
    if up { p } else { shapes::reversed(&p) }
}

#[test]
fn squares_of_the_catalogue() {
    let [low, high] = [square(0.0, 1.0, true), square(1.0, 1.0, false)];
    let wall = Polygon::Quad([[0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]);
    for (other, exact) in [(high, C_11), (wall, C_14)] {
        let f = scene_factors(&open(&vec![vec![low], vec![other]]), 1e-9).unwrap();
        assert!((f.factor(0, 1) - exact).abs() < 1e-15, "{}", f.factor(0, 1));
        assert_eq!((f.pairs(), f.partial()), (1, 0));
    }
    // The same in triangles and in pieces: edges in common, vertices in common, skew edges.
    for n in [1, 2, 5] {
        let pieces = meshed(&vec![vec![low], vec![wall], vec![high]], n);
        for s in [triangulated(&pieces), pieces] {
            let sums = first_row(&open(&s), 1e-9);
            for (sum, exact) in sums[1..].iter().zip([C_14, C_11]) {
                // What is allowed with nothing between: 1e-4 of the error.
                assert!((sum - exact).abs() < 1e-13, "{n} {sum} {exact}");
            }
        }
    }
    // A ray passes the plane half-way at the mid-point of its ends, and x ↦ 1 − x on both squares shows that the quarter that is
    // covered takes a quarter.
    let plates = [true, false].map(|up| vec![square(0.5, 0.5, up)]);
    for n in [1, 3] {
        let s = [vec![vec![low], vec![high]], plates.to_vec()].concat();
        let sums = first_row(&open(&meshed(&s, n)), 1e-10);
        assert!((sums[1] - 0.75 * C_11).abs() < 2e-10, "{n} {}", sums[1]);
    }
}

/// Numbers of sides that double, to so many with FREDHOLM_LONG in the environment, else to fewer.
fn sides(from: usize, long: u32, short: u32) -> Vec<usize> {
    let count = if is_long() { long } else { short };
    (0..count).map(|k| from << k).collect()
}

/// Whether the limit of values with ever more sides is what is known, to one of two errors.
fn check_limit(case: &str, values: &[f64], exact: f64, long: f64, short: f64) {
    let off = limit(values) - exact;
    println!("{case:<66} {:.15} {off:8.1e}", limit(values));
    let allowed = if is_long() { long } else { short };
    assert!(off.abs() < allowed, "{case}: {values:?}");
}

#[test]
fn discs_of_the_catalogue() {
    let value = |n: usize| {
        // A wedge of the lower one: all are alike.
        let [lower, upper] = [0.0, 1.0].map(|z| -> Vec<[f64; 3]> {
            circle(n, 1.0).into_iter().map(|[x, y]| [x, y, z]).collect()
        });
        let wedge = vec![Polygon::Triangle([[0.0; 3], lower[0], lower[1]])];
        let upper = shapes::fan(&upper).iter().map(shapes::reversed).collect();
        let scene = open(&vec![wedge, upper]);
        first_row(&scene, 1e-12)[1] / scene.area(0).unwrap()
    };
    let values: Vec<f64> = sides(8, 5, 4).into_iter().map(value).collect();
    assert!((values[3] - C_41).abs() < 1e-3);
    // The series in n⁻² leaves n⁻⁸ of the coarsest: 6e-8, and less from the finer ones.
    check_limit("C-41, discs", &values, C_41, 1e-11, 1e-9);
}

/// What does not meet the outer one of two cylinders leaves at its ends, to a sphere: the blocked case of
/// OpenViewFactor, 0.0891315669922522 and, from the sphere, 6.189692152239722e-4.
#[test]
fn cylinders_of_the_catalogue_of_which_one_hides_the_other() {
    let (mut outer, mut ends, mut back) = (Vec::new(), Vec::new(), Vec::new());
    let error = if is_long() { 1e-12 } else { 1e-9 };
    for n in sides(if is_long() { 16 } else { 8 }, 5, 3) {
        let side = |radius: f64, inside: bool| -> Vec<Polygon> {
            let sides = prism(&circle(n, radius), -0.5, 0.5, inside);
            sides.into_iter().take(n).flatten().collect()
        };
        // Both seen from between, and the outer one from outside.
        let cylinders = [(0.125, false), (0.25, true), (0.25, false)];
        let mut all: Surfaces = cylinders
            .map(|(radius, inside)| side(radius, inside))
            .to_vec();
        all.extend(sphere(3, 3.0, true));
        let scene = open(&all);
        // By symmetry one side of the inner cylinder is like all.
        let sums = first_rows(&scene, 1, error);
        let f: Vec<f64> = sums.iter().map(|s| s / scene.faces()[0].area).collect();
        assert!((f[1] + f[3] - 1.0).abs() < 10.0 * error, "{n} {f:?}");
        assert_eq!((f[0], f[2]), (0.0, 0.0));
        outer.push(f[1]);
        ends.push(f[3]);
        back.push(f[3] * scene.area(0).unwrap() / (9.0 * 2.0 * TAU));
    }
    // Errors of the series: n⁻⁶ of the coarsest.
    check_limit("cylinders, inner to outer", &outer, CYLINDERS, 1e-10, 1e-5);
    check_limit(
        "cylinders, past the ends",
        &ends,
        1.0 - CYLINDERS,
        1e-10,
        1e-5,
    );
    check_limit("and back", &back, 6.189_692_152_239_722e-4, 1e-12, 1e-8);
}

#[test]
fn all_that_leaves_a_convex_body_meets_what_is_around_it() {
    let finer = usize::from(is_long());
    let both = [sphere(3 + finer, 1.0, false), sphere(4 + finer, 3.0, true)];
    let scene = closed(&both.concat());
    assert!(off(&scene_factors(&scene, 1e-8).unwrap()) < 3e-8);
    let sums = first_row(&scene, 1e-8);
    assert_eq!(sums[0], 0.0);
    assert!((sums[1] / scene.area(0).unwrap() - 1.0).abs() < 1e-8);
}

/// A_I F_IJ between surfaces.
fn between(scene: &Scene, f: &Factors) -> Vec<f64> {
    let groups = f.of_surfaces(scene).unwrap();
    let n = groups.len();
    let pairs = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    pairs
        .map(|(i, j)| groups.factor(i, j) * groups.areas()[i])
        .collect()
}

#[test]
fn a_cube_with_a_block() {
    let mut all = Vec::new();
    for m in [2, 4] {
        let mut both = meshed(&shapes::room([0.0; 3], [1.0; 3]).surfaces, m);
        both.extend(meshed(&shapes::block([0.25; 3], [0.75; 3]).surfaces, m / 2));
        let scene = closed(&both);
        for error in [1e-6, 1e-9] {
            let f = scene_factors(&scene, error).unwrap();
            // Every row has some hundred entries.
            assert!(f.error() <= error && off(&f) < 3.0 * error, "{error}");
            all.push((error, between(&scene, &f)));
        }
    }
    // The surfaces of both meshes are the same.
    let (_, best) = &all[3];
    for (error, sums) in &all {
        for (sum, exact) in sums.iter().zip(best) {
            assert!((sum - exact).abs() < 3.0 * error, "{error} {sum} {exact}");
        }
    }
}

/// 100 scenes with FREDHOLM_LONG in the environment, else one.
#[test]
fn scenes_that_are_turned_mirrored_scaled_and_cut_otherwise_have_the_same_factors() {
    // A quarter of a surface is off by this for each quarter that it sees, so that 16 pairs are off by 4 times this.
    let (count, error, agree) = (if is_long() { 100 } else { 1 }, 1e-10, 1e-9);
    let (mut worst, mut rows) = (0.0_f64, 0.0_f64);
    for seed in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut base = shapes::room([0.0; 3], [1.6, 1.2, 1.0]).surfaces;
        let bodies_in_it = rng.random_range(1..=3);
        base.extend(bodies(&mut rng, bodies_in_it, 0.5));
        let turn = rotation(&mut rng);
        let same: [(&str, f64, Surfaces); 6] = [
            ("turned", 1.0, map(&base, turn)),
            ("mirrored", 1.0, mirrored(&base)),
            ("larger", 1e3, map(&base, |p| p.map(|x| 1e3 * x))),
            ("smaller", 1e-3, map(&base, |p| p.map(|x| 1e-3 * x))),
            ("triangles", 1.0, triangulated(&base)),
            ("pieces", 1.0, meshed(&base, 2)),
        ];
        let of = |s: &Surfaces| {
            let scene = closed(s);
            let f = scene_factors(&scene, error).unwrap();
            assert!(f.error() <= error, "{seed}: {:e}", f.error());
            (between(&scene, &f), off(&f), scene)
        };
        let (own, row, scene) = of(&base);
        assert!(row < agree, "{seed}: {row:e}");
        rows = rows.max(row);
        for (name, size, other) in &same {
            for (k, (a, b)) in own.iter().zip(&of(other).0).enumerate() {
                let area = scene.area(k / scene.surfaces()).unwrap();
                let off = (a - b / (size * size)).abs() / area;
                worst = worst.max(off);
                assert!(off < agree, "{seed} {name} {k}: {off:e}");
            }
        }
    }
    println!("largest difference {worst:e} in F, of row sums from 1 {rows:e}");
}

/// Rows close to rounding, what is exact hardly moves, and reciprocity stays.
#[test]
fn rows_close() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let scene = closed(&voxels(&mut rng, 3, 0.35));
    let best = scene_factors(&scene, 1e-11).unwrap();
    let mut rough = scene_factors(&scene, 1e-2).unwrap();
    let before = off(&rough);
    assert_eq!(rough.close(), Ok(before));
    assert!(before > 1e-6, "{before:e}: nothing to close");
    // Sums of sixty numbers.
    assert!(off(&rough) < 60.0 * f64::EPSILON);
    for (i, j) in (0..rough.areas().len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let change = (rough.factor(i, j) - best.factor(i, j)).abs();
        assert!(change < 2e-2, "{i} {j} {change:e}");
    }
    let plate = vec![vec![square(0.0, 1.0, true)], vec![square(1.0, 1.0, false)]];
    let refused = scene_factors(&open(&plate), 1e-9).unwrap().close();
    assert_eq!(refused, Err(FactorsError::Leaves));
}

#[test]
fn what_is_no_error_and_no_group_is_refused() {
    let cube = closed(&shapes::room([0.0; 3], [1.0; 3]).surfaces);
    for error in [0.0, -1.0, 1e-14, 0.2, f64::NAN] {
        assert_eq!(scene_factors(&cube, error), Err(FactorsError::Tolerance));
    }
    let length = |expected, found| FactorsError::Length { expected, found };
    assert_eq!(Factors::new(&cube, vec![]), Err(length(6, 0)));
    let f = scene_factors(&cube, 1e-9).unwrap();
    assert_eq!(f.of_groups(&[0; 5], 1), Err(length(6, 5)));
    assert_eq!(
        f.of_groups(&[2; 6], 2),
        Err(FactorsError::Group { group: 2 })
    );
    let groups = f.of_surfaces(&cube).unwrap();
    assert_eq!(groups.script_f(&[0.5]), Err(length(6, 1)));
    for wrong in [-0.1, 1.1, f64::NAN] {
        let refused = groups.script_f(&[0.5, wrong, 0.5, 0.5, 0.5, 0.5]);
        assert_eq!(refused, Err(FactorsError::Emissivity { group: 1 }));
    }
    let refused = groups.script_f(&[0.0; 6]);
    assert!(matches!(refused, Err(FactorsError::Emissivity { .. })));
}

/// Two opposite walls of a cube exchange heat directly and by way of four adiabatic ones: with F to each other and 1 − F to those, half
/// of which comes back to each, 𝓕 = (F + (1 − F)/2) = ½ (1 + F) between black ones (Hottel's reradiating walls).
#[test]
fn adiabatic_walls_radiate_again() {
    let cube = closed(&shapes::room([0.0; 3], [1.0; 3]).surfaces);
    let groups = scene_factors(&cube, 1e-9).unwrap();
    let groups = groups.of_surfaces(&cube).unwrap();
    let script = groups.script_f(&[1.0, 1.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    assert!(
        (script[1] - 0.5 * (1.0 + C_11)).abs() < 1e-14,
        "{}",
        script[1]
    );
    assert!((script[0] + script[1] - 1.0).abs() < 1e-14);
    assert!(script[12..].iter().all(|f| *f == 0.0));
}

/// Blocks of a grid of uneven steps, some solid, others air: every face between the two is seen from the air.
fn voxels(rng: &mut ChaCha8Rng, n: usize, solid: f64) -> Surfaces {
    let mut steps = || {
        let mut at = 0.0;
        let step = |_| {
            at += rng.random_range(0.5..1.5);
            at
        };
        (0..=n).map(step).collect::<Vec<f64>>()
    };
    let axes = [steps(), steps(), steps()];
    let full: Vec<bool> = (0..n * n * n).map(|_| rng.random_bool(solid)).collect();
    let is_solid = |p: [usize; 3]| {
        let inside = p.iter().all(|&k| (1..=n).contains(&k));
        !inside || full[(p[0] - 1) + n * ((p[1] - 1) + n * (p[2] - 1))]
    };
    let mut faces = Vec::new();
    for place in 0..3 * (n + 1) * (n + 1) * (n + 1) {
        let (cell, axis) = (place / 3, place % 3);
        let low = [1, n + 1, (n + 1) * (n + 1)].map(|step| cell / step % (n + 1));
        let mut next = low;
        next[axis] += 1;
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let (behind, ahead) = (is_solid(low), is_solid(next));
        if behind == ahead || low[u] == 0 || low[v] == 0 {
            continue;
        }
        let corner = |a: usize, b: usize| {
            let mut p = [0.0; 3];
            p[axis] = axes[axis][low[axis]];
            p[u] = axes[u][low[u] - 1 + a];
            p[v] = axes[v][low[v] - 1 + b];
            p
        };
        // Its active side is ahead if what is behind is solid.
        let quad = Polygon::Quad([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
        let turned = shapes::reversed(&quad);
        faces.push(vec![if behind { quad } else { turned }]);
    }
    faces
}

/// A room that is a million times as long as it is wide: closed forms for edges of one length would lose all digits.
#[test]
fn a_long_corridor() {
    for length in [1e3, 1e6] {
        let corridor = closed(&shapes::room([0.0; 3], [length, 1.0, 1.0]).surfaces);
        let f = scene_factors(&corridor, 1e-9).unwrap();
        // An edge's length times the rounding of the other's, per area 1 of an end.
        assert!(f.error() < 16.0 * length * f64::EPSILON, "{:e}", f.error());
        assert!(off(&f) < f.error());
        // From an end to a side: nearly a quarter.
        assert!((f.factor(4, 0) - 0.25).abs() < 1.0 / length);
    }
}

/// Two boxes beside each other in the middle of a room that is up to 10⁸ times as wide: what walls see of them behind each
/// other, turned any way; by day one of three turns. Rounding moves a face's edges by a unit of the room's width, and is in the stated error.
#[test]
fn small_boxes_in_a_large_room() {
    let error = 1e-10;
    let sizes = [1e-3, 1e-5, 1e-6, 1e-8].into_iter().enumerate();
    let all = sizes.flat_map(|(number, size)| [0, 1, 2].map(|seed| (number, size, seed)));
    for (number, size, seed) in all {
        if !is_long() && number % 3 != seed as usize {
            continue;
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut at = || rng.random_range(0.3..0.7);
        let corner: [f64; 3] = [at(), at(), at()];
        let step = rng.random_range(1.1..2.0);
        let mut own = Vec::new();
        for k in [0.0, 1.0] {
            let low = [corner[0] + k * step * size, corner[1], corner[2]];
            let deep = rng.random_range(0.2..1.0);
            let high = [low[0] + size, low[1] + size * deep, low[2] + size];
            own.extend(shapes::block(low, high).surfaces);
        }
        if seed == 0 {
            own = triangulated(&own);
        }
        let all = [shapes::room([0.0; 3], [1.0; 3]).surfaces, own].concat();
        let f = scene_factors(&closed(&map(&all, rotation(&mut rng))), error).unwrap();
        // A row has the walls and up to six faces of the other box.
        let allowed = 12.0 * f.error().min(error + 16.0 * f64::EPSILON / (12.0 * size));
        assert!(
            off(&f) < allowed,
            "{size:e} {seed} {:e} {:e}",
            off(&f),
            f.error()
        );
    }
}

/// A cube of which one vertex is far up: what faces see of each other next to the ends of edges that are twenty thousand
/// times as long, behind others. Found by spoiling a file.
#[test]
fn a_tower() {
    let corner = |k: usize| match k {
        4 => [0.0, 0.0, 19_991.0],
        _ => [(k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64],
    };
    let quad = |k: [usize; 4]| vec![Polygon::Quad(k.map(corner))];
    // The lid is bent.
    let lid = [[4, 6, 5], [6, 7, 5]].map(|p| Polygon::Triangle(p.map(corner)));
    let sides = [
        [0, 1, 3, 2],
        [0, 4, 5, 1],
        [1, 5, 7, 3],
        [3, 7, 6, 2],
        [2, 6, 4, 0],
    ];
    let mut tower: Surfaces = sides.map(quad).to_vec();
    tower.push(lid.to_vec());
    let errors = if is_long() {
        &[1e-3, 1e-6][..]
    } else {
        &[1e-3]
    };
    for &error in errors {
        let f = scene_factors(&closed(&tower), error).unwrap();
        assert!(off(&f) < 10.0 * error, "{error:e}: {}", off(&f));
    }
}

/// Edges on edges, faces in one plane, bodies that touch along an edge only, and rooms that are no longer convex: what
/// leaves every face arrives, whichever way the scene is turned and cut. 40 scenes with FREDHOLM_LONG, else 2.
#[test]
fn rows_of_blocks_that_touch_each_other_close() {
    let error = 1e-9;
    let mut worst = 0.0_f64;
    // Blocks of seed 15 have edges in common with polygons that a body hides.
    for seed in if is_long() { 0..40 } else { 14..16 } {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let base = voxels(&mut rng, 3, 0.35);
        let turned = map(&base, rotation(&mut rng));
        let scenes = [&base, &turned, &triangulated(&turned)].map(closed);
        let [plain, turned, triangles] =
            scenes.each_ref().map(|s| scene_factors(s, error).unwrap());
        let others = between(&scenes[1], &turned);
        for (a, b) in between(&scenes[0], &plain).iter().zip(&others) {
            // No face is smaller than ¼, and both may be off.
            assert!((a - b).abs() < 2.0 * error, "{seed} {a} {b}");
        }
        // Backs hide as fronts do, and nobody sees them.
        let open = scene_factors(&open(&base), error).unwrap();
        for (i, j) in (0..open.areas().len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let off = (plain.factor(i, j) - open.factor(i, j)).abs();
            assert!(off < 2.0 * error, "{seed} {i} {j} {off:e}");
        }
        for f in [plain, turned, triangles] {
            // A hundred entries are off by less than the error each, to either side.
            assert!(
                f.error() <= error && off(&f) < 3.0 * error,
                "{seed} {}",
                off(&f)
            );
            worst = worst.max(off(&f));
        }
    }
    println!("largest difference of a row's sum from 1: {worst:e}");
}

/// A short edge on a long one says little of its direction where vertices were rounded.
#[test]
fn a_short_edge_on_a_long_one_has_the_direction_of_that() {
    let side = 2e-3;
    let wall = Polygon::Quad([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]]);
    let turn = rotation(&mut ChaCha8Rng::seed_from_u64(241));
    for at in [0.05, 0.4, 0.9] {
        let tile = [
            [at, 0.0, 0.0],
            [at, side, 0.0],
            [at + side, side, 0.0],
            [at + side, 0.0, 0.0],
        ];
        let both = [Polygon::Quad(tile), wall].map(|p| vec![shapes::reversed(&p)]);
        let both = triangulated(&both.to_vec());
        let rounded = map(&both, |p| turn(p).map(|x| (x * 1e6).round() / 1e6));
        let [clean, off] = [both, rounded].map(|surfaces| {
            let scene = open(&surfaces);
            let f = scene_factors(&scene, 1e-5).unwrap();
            (f.of_surfaces(&scene).unwrap().factor(0, 1), f.error())
        });
        println!("{at} {clean:?} {off:?}");
        assert!((off.0 - clean.0).abs() < off.1, "{at}: {clean:?} {off:?}");
        assert!(off.1 < 0.01);
    }
}
