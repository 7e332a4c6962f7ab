//! Form factors against published numbers, and against each other.

use core::f64::consts::TAU;

use fredholm_factors::{Factors, FactorsError, Sights, scene_factors};
use fredholm_scene::{Enclosure, Polygon, Scene, shapes};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

#[path = "../../scene/tests/common/mod.rs"]
mod common;
use common::{Surfaces, map, meshed, prism, rotation, scene_of, sphere, triangulated};

/// Howell's C-11: parallel unit squares at distance 1; to all digits from its closed form,
/// 2/π (ln(2/√3) + 2√2 atan(1/√2) − π/2).
const C_11: f64 = 0.199_824_895_698_387;
/// Howell's C-14: perpendicular unit squares with a common edge.
const C_14: f64 = 0.200_043_776_075_403;
/// Howell's C-41: coaxial discs of radius 1 at distance 1, (3 − √5)/2.
const C_41: f64 = 0.381_966_011_250_105;
/// Coaxial cylinders of radii 0.125 and 0.25 and height 1, inner to outer (Howell's C-92).
const CYLINDERS: f64 = 0.910_868_433_007_748;

fn closed(surfaces: &Surfaces) -> Scene {
    scene_of::<f64>(surfaces, Enclosure::Closed).unwrap()
}

fn open(surfaces: &Surfaces) -> Scene {
    scene_of::<f64>(surfaces, Enclosure::Open).unwrap()
}

/// A_I F_IJ of the first surface with every surface.
fn first_row(scene: &Scene, error: f64) -> Vec<f64> {
    let sights = Sights::new(scene, error).unwrap();
    let mut sums = vec![0.0; scene.surfaces()];
    for face in scene.faces_of(0).unwrap() {
        for (other, exchange) in sights.row(face).entries {
            sums[scene.place(other as usize).unwrap().surface] += exchange;
        }
    }
    sums
}

/// The limit of values at n, 2n, 4n … whose error is a series in n⁻².
fn limit(values: &[f64]) -> f64 {
    let mut row = values.to_vec();
    let mut power = 1.0;
    while row.len() > 1 {
        power *= 4.0;
        row = row
            .windows(2)
            .map(|w| (power * w[1] - w[0]) / (power - 1.0))
            .collect();
    }
    row[0]
}

fn square(z: f64, side: f64, up: bool) -> Polygon {
    let p = Polygon::Quad([
        [0.0, 0.0, z],
        [side, 0.0, z],
        [side, side, z],
        [0.0, side, z],
    ]);
    if up { p } else { shapes::reversed(&p) }
}

#[test]
fn squares_of_the_catalogue() {
    let two = open(&vec![
        vec![square(0.0, 1.0, true)],
        vec![square(1.0, 1.0, false)],
    ]);
    let f = scene_factors(&two, 1e-9).unwrap();
    assert!((f.factor(0, 1) - C_11).abs() < 1e-15, "{}", f.factor(0, 1));
    assert_eq!((f.pairs(), f.partial()), (1, 0));
    let wall = Polygon::Quad([
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 1.0],
        [0.0, 0.0, 1.0],
    ]);
    let two = open(&vec![vec![square(0.0, 1.0, true)], vec![wall]]);
    let f = scene_factors(&two, 1e-9).unwrap();
    assert!((f.factor(0, 1) - C_14).abs() < 1e-15, "{}", f.factor(0, 1));
    // The same in triangles and in pieces: edges in common, vertices in common, skew edges.
    for n in [1, 2, 5] {
        for triangles in [false, true] {
            let mut s = meshed(
                &vec![
                    vec![square(0.0, 1.0, true)],
                    vec![wall],
                    vec![square(1.0, 1.0, false)],
                ],
                n,
            );
            if triangles {
                s = triangulated(&s);
            }
            let sums = first_row(&open(&s), 1e-9);
            for (sum, exact) in sums[1..].iter().zip([C_14, C_11]) {
                // What is allowed with nothing between: 1e-4 of the error.
                assert!((sum - exact).abs() < 1e-13, "{n} {triangles} {sum} {exact}");
            }
        }
    }
}

#[test]
fn discs() {
    let value = |n: usize| {
        let rim = |z: f64| -> Vec<[f64; 3]> {
            (0..n)
                .map(|k| TAU * k as f64 / n as f64)
                .map(|a| [a.cos(), a.sin(), z])
                .collect()
        };
        let lower = shapes::fan(&rim(0.0));
        let upper = shapes::fan(&rim(1.0))
            .iter()
            .map(shapes::reversed)
            .collect();
        let scene = open(&vec![lower, upper]);
        first_row(&scene, 1e-9)[1] / scene.area(0).unwrap()
    };
    let values: Vec<f64> = [8, 16, 32, 64].map(value).to_vec();
    assert!((values[3] - C_41).abs() < 1e-3);
    // The series in n⁻² leaves n⁻⁸ of the coarsest: 6e-8, and less from the finer ones.
    assert!(
        (limit(&values) - C_41).abs() < 1e-9,
        "{values:?} {}",
        limit(&values)
    );
}

/// An inner and an outer cylinder with n sides, both seen from between, and the outer one from
/// outside, in a sphere.
fn cylinders(n: usize) -> Surfaces {
    let side = |radius: f64, inside: bool| -> Vec<Polygon> {
        let rim: Vec<[f64; 2]> = (0..n)
            .map(|k| TAU * k as f64 / n as f64)
            .map(|a| [radius * a.cos(), radius * a.sin()])
            .collect();
        prism(&rim, -0.5, 0.5, inside)
            .into_iter()
            .take(n)
            .flatten()
            .collect()
    };
    let sphere = sphere(3, 3.0, true).remove(0);
    vec![
        side(0.125, false),
        side(0.25, true),
        side(0.25, false),
        sphere,
    ]
}

/// What does not meet the outer cylinder leaves at its ends, to the sphere: the blocked case of
/// OpenViewFactor, 0.0891315669922522 and, from the sphere, 6.189692152239722e-4.
#[test]
fn cylinders_of_which_one_hides_the_other() {
    let (mut to_outer, mut to_sphere) = (Vec::new(), Vec::new());
    for n in [8, 16, 32] {
        let scene = open(&cylinders(n));
        // By symmetry one side of the inner cylinder is like all.
        let sights = Sights::new(&scene, 1e-9).unwrap();
        let mut sums = [0.0; 4];
        for (other, exchange) in sights.row(0).entries {
            sums[scene.place(other as usize).unwrap().surface] += exchange;
        }
        let f = sums.map(|sum| sum / scene.faces()[0].area);
        assert!((f[1] + f[3] - 1.0).abs() < 1e-8, "{n} {f:?}");
        assert_eq!((f[0], f[2]), (0.0, 0.0));
        to_outer.push(f[1]);
        to_sphere.push(f[3]);
    }
    // Errors of the series: n⁻⁶ of the coarsest.
    assert!(
        (limit(&to_outer) - CYLINDERS).abs() < 1e-5,
        "{}",
        limit(&to_outer)
    );
    assert!((limit(&to_sphere) - (1.0 - CYLINDERS)).abs() < 1e-5);
}

#[test]
fn all_that_leaves_a_convex_body_meets_what_is_around_it() {
    let finer = usize::from(is_long());
    let mut both = sphere(3 + finer, 1.0, false);
    both.extend(sphere(4 + finer, 3.0, true));
    let scene = closed(&both);
    let f = scene_factors(&scene, 1e-8).unwrap();
    for (i, sum) in f.row_sums().iter().enumerate() {
        assert!((sum - 1.0).abs() < 3e-8, "{i} {sum}");
    }
    let sums = first_row(&scene, 1e-8);
    assert_eq!(sums[0], 0.0);
    assert!((sums[1] / scene.area(0).unwrap() - 1.0).abs() < 1e-8);
}

/// A ray passes the plane half-way at the mid-point of its ends, and x ↦ 1 − x on both squares shows
/// that the quarter that is covered takes a quarter.
#[test]
fn an_obstacle_half_way_takes_its_share() {
    let plate = [square(0.5, 0.5, true), square(0.5, 0.5, false)];
    for n in [1, 3] {
        let s = vec![
            vec![square(0.0, 1.0, true)],
            vec![square(1.0, 1.0, false)],
            vec![plate[0]],
            vec![plate[1]],
        ];
        let scene = open(&meshed(&s, n));
        let sums = first_row(&scene, 1e-10);
        assert!(
            (sums[1] - 0.75 * C_11).abs() < 2e-10,
            "{n} {} {}",
            sums[1],
            0.75 * C_11
        );
    }
}

fn cube_with_block(m: usize) -> Surfaces {
    let mut all = meshed(&shapes::room([0.0; 3], [1.0; 3]).surfaces, m);
    all.extend(meshed(&shapes::block([0.25; 3], [0.75; 3]).surfaces, m / 2));
    all
}

/// A_I F_IJ between surfaces.
fn between(scene: &Scene, f: &Factors) -> Vec<f64> {
    let n = scene.surfaces();
    let mut sums = vec![0.0; n * n];
    for i in 0..scene.faces().len() {
        for &(j, exchange) in f.row(i) {
            let [a, b] = [i, j as usize].map(|k| scene.place(k).unwrap().surface);
            sums[a * n + b] += exchange;
            sums[b * n + a] += exchange;
        }
    }
    sums
}

#[test]
fn a_cube_with_a_block() {
    let errors = [1e-6, 1e-9];
    let scenes = [2, 4].map(|m| closed(&cube_with_block(m)));
    let mut all = Vec::new();
    for scene in &scenes {
        for error in errors {
            let f = scene_factors(scene, error).unwrap();
            assert!(f.error() <= error);
            // Every row has some hundred entries.
            for sum in f.row_sums() {
                assert!((sum - 1.0).abs() < 3.0 * error, "{error} {sum}");
            }
            all.push((error, between(scene, &f)));
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

/// Boxes and prisms in a box, none of which touches another.
fn random_scene(rng: &mut ChaCha8Rng, most: u32) -> Surfaces {
    let length = 0.1 + 0.5 * f64::from(most);
    let mut all = shapes::room([0.0; 3], [length, 1.2, 0.9]).surfaces;
    let count = rng.random_range(1..=most);
    for k in 0..count {
        let low = 0.1 + 0.5 * f64::from(k);
        let size: f64 = rng.random_range(0.15..0.35);
        let base = rng.random_range(0.1..0.3);
        let corner: [f64; 3] = [low, rng.random_range(0.1..0.7), base];
        if rng.random() {
            let high = [
                corner[0] + size,
                corner[1] + 0.3,
                base + rng.random_range(0.2..0.5),
            ];
            all.extend(shapes::block(corner, high).surfaces);
        } else {
            let n = rng.random_range(3..6);
            let turn: f64 = rng.random_range(0.0..TAU);
            let rim: Vec<[f64; 2]> = (0..n)
                .map(|k| turn + TAU * f64::from(k) / f64::from(n))
                .map(|a| {
                    [
                        corner[0] + 0.17 + 0.17 * a.cos(),
                        corner[1] + 0.2 + 0.2 * a.sin(),
                    ]
                })
                .collect();
            let body = prism(&rim, base, base + 0.4, false);
            all.extend(body);
        }
    }
    all
}

fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

/// 100 scenes with FREDHOLM_LONG in the environment, else 2.
#[test]
fn scenes_that_are_turned_mirrored_scaled_and_cut_otherwise_have_the_same_factors() {
    // A quarter of a surface is off by this for each quarter that it sees, so that 16 pairs are off by 4 times this.
    let (count, error, most) = (if is_long() { 100 } else { 2 }, 1e-10, 3);
    let agree = 1e-9;
    let (mut worst, mut open, mut estimates) = (0.0_f64, 0.0_f64, 0.0_f64);
    for seed in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let base = random_scene(&mut rng, most);
        let turn = rotation(&mut rng);
        let mirrored: Surfaces = map(&base, |p| [-p[0], p[1], p[2]])
            .iter()
            .map(|s| s.iter().map(shapes::reversed).collect())
            .collect();
        let same: [(&str, f64, Surfaces); 6] = [
            ("turned", 1.0, map(&base, turn)),
            ("mirrored", 1.0, mirrored),
            ("larger", 1e3, map(&base, |p| p.map(|x| 1e3 * x))),
            ("smaller", 1e-3, map(&base, |p| p.map(|x| 1e-3 * x))),
            ("triangles", 1.0, triangulated(&base)),
            ("pieces", 1.0, meshed(&base, 2)),
        ];
        let sums = |s: &Surfaces| {
            let scene = closed(s);
            let f = scene_factors(&scene, error).unwrap();
            let areas: Vec<f64> = (0..scene.surfaces())
                .map(|s| scene.area(s).unwrap())
                .collect();
            let worst = f
                .row_sums()
                .iter()
                .map(|s| (s - 1.0).abs())
                .fold(0.0, f64::max);
            (between(&scene, &f), areas, f.error(), worst)
        };
        let (own, areas, estimate, row) = sums(&base);
        assert!(
            row < agree && estimate <= error,
            "{seed}: {row:e} {estimate:e}"
        );
        open = open.max(row);
        estimates = estimates.max(estimate);
        for (name, size, other) in &same {
            let (others, _, estimate, _) = sums(other);
            assert!(estimate <= error, "{seed} {name}: {estimate:e}");
            for (k, (a, b)) in own.iter().zip(&others).enumerate() {
                let off = (a - b / (size * size)).abs() / areas[k / areas.len()];
                worst = worst.max(off);
                assert!(off < agree, "{seed} {name} {k}: {off:e}");
            }
        }
    }
    println!(
        "largest difference {worst:e} in F, of row sums from 1 {open:e}, estimate {estimates:e}"
    );
}

/// Rows close to rounding, what is exact hardly moves, and reciprocity stays.
#[test]
fn rows_close() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let scene = closed(&voxels(&mut rng, 3, 0.35));
    let best = scene_factors(&scene, 1e-11).unwrap();
    let mut rough = scene_factors(&scene, 1e-2).unwrap();
    let before = rough.row_sums();
    let off = before.iter().map(|s| (s - 1.0).abs()).fold(0.0, f64::max);
    assert_eq!(rough.close(), Ok(off));
    assert!(off > 1e-6, "{off:e}: nothing to close");
    for (i, sum) in rough.row_sums().iter().enumerate() {
        // Sums of sixty numbers.
        assert!((sum - 1.0).abs() < 60.0 * f64::EPSILON, "{i} {sum}");
        for j in 0..i {
            let change = (rough.factor(i, j) - best.factor(i, j)).abs();
            assert!(change < 2e-2, "{i} {j} {change:e}");
        }
    }
    let plate = vec![vec![square(0.0, 1.0, true)], vec![square(1.0, 1.0, false)]];
    let refused = scene_factors(&open(&plate), 1e-9).unwrap().close();
    assert_eq!(refused, Err(FactorsError::Leaves));
}

#[test]
fn an_error_that_is_none_is_refused() {
    let cube = closed(&shapes::room([0.0; 3], [1.0; 3]).surfaces);
    for error in [0.0, -1.0, 1e-14, 0.2, f64::NAN] {
        assert_eq!(scene_factors(&cube, error), Err(FactorsError::Tolerance));
    }
    let rows = vec![];
    assert_eq!(
        Factors::new(&cube, rows),
        Err(FactorsError::Length {
            expected: 6,
            found: 0
        })
    );
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
    for cell in 0..(n + 1) * (n + 1) * (n + 1) {
        let low = [
            cell % (n + 1),
            cell / (n + 1) % (n + 1),
            cell / (n + 1) / (n + 1),
        ];
        for axis in 0..3 {
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
            faces.push(vec![if behind {
                quad
            } else {
                shapes::reversed(&quad)
            }]);
        }
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
        for (i, sum) in f.row_sums().iter().enumerate() {
            assert!((sum - 1.0).abs() < f.error(), "{i} {sum}");
        }
        // From an end to a side: nearly a quarter.
        assert!(
            (f.factor(4, 0) - 0.25).abs() < 1.0 / length,
            "{}",
            f.factor(4, 0)
        );
    }
}

/// Two boxes beside each other in the middle of a room that is up to 10⁸ times as wide: what walls see of them behind each
/// other, turned any way. Rounding moves a face's edges by a unit of the room's width, and is in the stated error.
#[test]
fn small_boxes_in_a_large_room() {
    let error = 1e-10;
    for size in [1e-3, 1e-5, 1e-6, 1e-8] {
        for seed in 0..3 {
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
            let mut all = shapes::room([0.0; 3], [1.0; 3]).surfaces;
            all.extend(own);
            let f = scene_factors(&closed(&map(&all, rotation(&mut rng))), error).unwrap();
            let rounding = 16.0 * f64::EPSILON / size;
            for (i, sum) in f.row_sums().iter().enumerate() {
                let off = (sum - 1.0).abs();
                // A row has the walls and up to six faces of the other box.
                assert!(off < 12.0 * error + rounding, "{size:e} {seed} {i} {off:e}");
                assert!(
                    off < 12.0 * f.error(),
                    "{size:e} {seed} {i} {off:e} {:e}",
                    f.error()
                );
            }
        }
    }
}

/// A cube of which one vertex is far up: what faces see of each other next to the ends of edges that are twenty thousand
/// times as long, behind others. Found by spoiling a file.
#[test]
fn a_tower() {
    let corner = |k: usize| [(k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64];
    let at = |k: usize| {
        if k == 4 {
            [0.0, 0.0, 19_991.0]
        } else {
            corner(k)
        }
    };
    let quad = |k: [usize; 4]| vec![Polygon::Quad(k.map(at))];
    // The lid is bent.
    let halves = |[a, b, c, d]: [usize; 4]| {
        let parts = [[a, b, d], [b, c, d]];
        parts.map(|p| Polygon::Triangle(p.map(at))).to_vec()
    };
    let tower = vec![
        quad([0, 1, 3, 2]),
        halves([4, 6, 7, 5]),
        quad([0, 4, 5, 1]),
        quad([1, 5, 7, 3]),
        quad([3, 7, 6, 2]),
        quad([2, 6, 4, 0]),
    ];
    for error in [1e-3, 1e-6] {
        for (i, sum) in scene_factors(&closed(&tower), error)
            .unwrap()
            .row_sums()
            .iter()
            .enumerate()
        {
            assert!((sum - 1.0).abs() < 10.0 * error, "{error:e}: {i} {sum}");
        }
    }
}

/// Edges on edges, faces in one plane, bodies that touch along an edge only, and rooms that are no longer convex: what
/// leaves every face arrives, whichever way the scene is turned and cut. 40 scenes with FREDHOLM_LONG, else 4.
#[test]
fn rows_of_blocks_that_touch_each_other_close() {
    let error = 1e-9;
    let count = if is_long() { 40 } else { 4 };
    let mut worst = 0.0_f64;
    for seed in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let base = voxels(&mut rng, 3, 0.35);
        let turn = rotation(&mut rng);
        let turned = map(&base, turn);
        let scenes = [&base, &turned, &triangulated(&turned)].map(closed);
        let [plain, turned, triangles] =
            scenes.each_ref().map(|s| scene_factors(s, error).unwrap());
        let [own, others] =
            [(&scenes[0], &plain), (&scenes[1], &turned)].map(|(s, f)| between(s, f));
        for (a, b) in own.iter().zip(&others) {
            // No face is smaller than ¼, and both may be off.
            assert!((a - b).abs() < 2.0 * error, "{seed} {a} {b}");
        }
        // Backs hide as fronts do, and nobody sees them.
        let open = scene_factors(&open(&base), error).unwrap();
        for i in 0..open.areas().len() {
            for j in 0..i {
                let off = (plain.factor(i, j) - open.factor(i, j)).abs();
                assert!(off < 2.0 * error, "{seed} {i} {j} {off:e}");
            }
        }
        for f in [plain, turned, triangles] {
            assert!(f.error() <= error, "{seed} {}", f.error());
            for (i, sum) in f.row_sums().iter().enumerate() {
                worst = worst.max((sum - 1.0).abs());
                // A hundred entries are off by less than the error each, to either side.
                assert!((sum - 1.0).abs() < 3.0 * error, "{seed} {i} {sum}");
            }
        }
    }
    println!("largest difference of a row's sum from 1: {worst:e}");
}
