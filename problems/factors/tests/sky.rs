//! What is seen of a sky, against closed forms, and against what is seen of everything else.

use core::f64::consts::TAU;

use fredholm_factors::{FactorsError, Patch, Sights, Sky, SkyFactors, scene_factors};
use fredholm_scene::{Enclosure, Polygon, Scene, SceneError, shapes};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

#[path = "../../scene/tests/common/mod.rs"]
mod common;
use common::{Surfaces, map, meshed, prism, rotation, scene_of, triangulated};

fn open(surfaces: &Surfaces) -> Scene {
    scene_of::<f64>(surfaces, Enclosure::Open).unwrap()
}

fn bands() -> Sky {
    Sky::bands(&[0.0, 20.0, 50.0, 80.0, 90.0], &[12, 8, 4, 1]).unwrap()
}

fn ground(low: [f64; 2], high: [f64; 2]) -> Polygon {
    Polygon::Quad([
        [low[0], low[1], 0.0],
        [high[0], low[1], 0.0],
        [high[0], high[1], 0.0],
        [low[0], high[1], 0.0],
    ])
}

/// Of a patch between azimuths 2a apart and below an arc whose ends have the altitude β a horizontal plane sees
/// ∫ sin²β'(u) du/2π over u from −a to a, where tan β' = k cos u and k = tan β/cos a: the antiderivative of sin² is
/// u − atan(tan u/√(1 + k²))/√(1 + k²).
fn below(altitude: f64, half: f64) -> f64 {
    let k = altitude.to_radians().tan() / half.cos();
    let root = (1.0 + k * k).sqrt();
    2.0 * (half - (half.tan() / root).atan() / root) / TAU
}

#[test]
fn a_plane_without_obstacles_sees_the_cosine_of_every_patch() {
    let sky = bands();
    let scene = open(&vec![vec![ground([0.0, 0.0], [2.0, 1.0])]]);
    let row = Sights::new(&scene, 1e-9).unwrap().sky(0, &sky).unwrap();
    // Cuts of 12 and of 8 sectors and those at 15° are all at multiples of 15°.
    let half = 7.5_f64.to_radians();
    for (patch, exchange) in sky.patches().iter().zip(&row.exchange) {
        let [from, to] = patch.azimuths;
        let pieces = (to - from) / 15.0;
        let [low, high] = patch.altitudes;
        let upper = if high == 90.0 {
            2.0 * half / TAU
        } else {
            below(high, half)
        };
        let exact = pieces * (upper - below(low, half));
        assert!(
            (exchange / 2.0 - exact).abs() < 1e-15,
            "{patch:?} {exchange} {exact}"
        );
        // The middle is in the patch.
        let z = patch.middle()[2].asin().to_degrees();
        assert!(low <= z && z <= high + 1e-12);
    }
    assert_eq!(row.exchange[25], 0.0);
    assert_eq!(row.error, 0.0);
    // A wall that looks to the east, the axis x, sees one half of sky and ground each.
    let wall = Polygon::Quad([[0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]);
    let scene = open(&vec![vec![wall]]);
    let f = Sights::new(&scene, 1e-9)
        .unwrap()
        .sky(0, &sky)
        .unwrap()
        .exchange;
    assert!((f[25] - 0.5).abs() < 1e-15);
    // Patches from north to south over east, and none of the west.
    assert!(
        f[..6].iter().all(|&f| f > 0.0) && f[6..12].iter().all(|&f| f == 0.0),
        "{f:?}"
    );
    for k in 0..3 {
        assert!((f[k] - f[5 - k]).abs() < 1e-15);
    }
}

/// All that leaves the floor of a box without a lid for the sky passes where the lid would be.
#[test]
fn an_open_box_sees_of_the_sky_what_it_would_see_of_a_lid() {
    let outline: Vec<[f64; 2]> = (0..7)
        .map(|k| TAU * f64::from(k) / 7.0)
        .map(|a| [a.cos() - 0.2 * (2.0 * a).sin(), 1.4 * a.sin()])
        .collect();
    for shape in [
        shapes::room([0.0; 3], [1.0, 0.7, 2.0]).surfaces,
        prism(&outline, 0.0, 1.3, true),
    ] {
        let lid = if shape.len() == 6 { 1 } else { 8 };
        let whole = scene_of::<f64>(&shape, Enclosure::Closed).unwrap();
        let inner = scene_factors(&whole, 1e-9)
            .unwrap()
            .of_surfaces(&whole)
            .unwrap();
        let mut rest = shape.clone();
        rest.remove(lid);
        for surfaces in [rest.clone(), meshed(&rest, 2), triangulated(&rest)] {
            let scene = open(&surfaces);
            let (f, _) = to_sky(&scene, &bands(), 1e-9);
            for surface in 0..rest.len() {
                let from = if surface < lid { surface } else { surface + 1 };
                let exact = inner.factor(from, lid);
                let sum: f64 = (0..25).map(|k| f.factor(surface, k)).sum();
                assert!((sum - exact).abs() < 1e-9, "{surface} {sum} {exact}");
                assert!(f.factor(surface, 25).abs() < 1e-12);
            }
        }
    }
}

/// Factors of surfaces, and the largest difference of a face's sum of everything from 1.
fn to_sky(scene: &Scene, sky: &Sky, error: f64) -> (SkyFactors, f64) {
    let sights = Sights::new(scene, error).unwrap();
    let faces = scene.faces().len();
    let rows: Vec<_> = (0..faces).map(|i| sights.sky(i, sky).unwrap()).collect();
    let all = scene_factors(scene, error).unwrap();
    let mut worst = 0.0_f64;
    for ((row, sum), area) in rows.iter().zip(all.row_sums()).zip(all.areas()) {
        assert!(row.error <= error, "{:e}", row.error);
        let sky: f64 = row.exchange.iter().sum();
        worst = worst.max((sum + sky / area - 1.0).abs());
    }
    let groups: Vec<usize> = (0..faces)
        .map(|i| scene.place(i).unwrap().surface)
        .collect();
    let f = SkyFactors::of_groups(all.areas(), &rows, &groups, scene.surfaces()).unwrap();
    (f, worst)
}

/// A box that stands on a ground, which goes around it.
fn standing(rng: &mut ChaCha8Rng) -> Surfaces {
    let low: [f64; 2] = [rng.random_range(0.2..0.7), rng.random_range(0.2..0.4)];
    let high: [f64; 2] = [low[0] + rng.random_range(0.2..0.9), low[1] + 0.5];
    let mut all = vec![
        vec![ground([0.0, 0.0], [2.0, low[1]])],
        vec![ground([0.0, high[1]], [2.0, 1.2])],
        vec![ground([0.0, low[1]], [low[0], high[1]])],
        vec![ground([high[0], low[1]], [2.0, high[1]])],
    ];
    let block = shapes::block([low[0], low[1], 0.0], [high[0], high[1], 0.8]);
    all.extend(block.surfaces.into_iter().skip(1));
    all
}

/// A ground with one box on it, or with boxes and prisms above it; half of them are turned any way.
fn random_scene(rng: &mut ChaCha8Rng) -> Surfaces {
    let mut all = meshed(&vec![vec![ground([0.0, 0.0], [2.0, 1.2])]], 2);
    for k in 0..rng.random_range(1..=3) {
        let low = 0.1 + 0.6 * f64::from(k);
        let base = rng.random_range(0.1..0.4);
        let corner: [f64; 3] = [low, rng.random_range(0.1..0.6), base];
        let top = base + rng.random_range(0.2..0.9);
        if rng.random() {
            all.extend(shapes::block(corner, [low + 0.4, corner[1] + 0.35, top]).surfaces);
        } else {
            let n = rng.random_range(3..6);
            let turn: f64 = rng.random_range(0.0..TAU);
            let rim: Vec<[f64; 2]> = (0..n)
                .map(|k| turn + TAU * f64::from(k) / f64::from(n))
                .map(|a| [low + 0.2 + 0.2 * a.cos(), corner[1] + 0.2 + 0.2 * a.sin()])
                .collect();
            all.extend(prism(&rim, base, top, false));
        }
    }
    if rng.random_bool(0.3) {
        all = standing(rng);
    }
    if rng.random() {
        map(&all, rotation(rng))
    } else {
        all
    }
}

/// What leaves a face arrives at another, in the sky or on the ground, whatever hides what; patches of a finer sky add up
/// to those of a coarser one; and a scene that is turned by a quarter sees the patches turned. 60 scenes with
/// FREDHOLM_LONG, else 4.
#[test]
fn rows_of_open_scenes_close_with_the_sky() {
    let count = if std::env::var_os("FREDHOLM_LONG").is_some() {
        60
    } else {
        4
    };
    let error = 1e-9;
    let [coarse, fine] = [
        (&[0.0, 30.0, 90.0][..], &[4, 4][..]),
        (&[0.0, 10.0, 30.0, 60.0, 90.0][..], &[8, 12, 4, 8][..]),
    ]
    .map(|(altitudes, sectors)| Sky::bands(altitudes, sectors).unwrap());
    let (mut worst, mut apart) = (0.0_f64, 0.0_f64);
    for seed in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let base = random_scene(&mut rng);
        let scene = open(&base);
        let (f, off) = to_sky(&scene, &coarse, error);
        // Nine sums of pieces, and some tens of factors.
        assert!(off < 10.0 * error, "{seed}: {off:e}");
        worst = worst.max(off);
        let (g, off) = to_sky(&scene, &fine, error);
        assert!(off < 10.0 * error, "{seed}: {off:e}");
        worst = worst.max(off);
        let turned = map(&base, |p| [p[1], -p[0], p[2]]);
        let (h, _) = to_sky(&open(&turned), &coarse, error);
        for surface in 0..scene.surfaces() {
            for (k, patch) in coarse.patches().iter().enumerate() {
                // Corners of both skies on the circle at 30° are the same.
                let inside = |own: &&(usize, &Patch)| {
                    let p = own.1;
                    let middle = 0.5 * (p.azimuths[0] + p.azimuths[1]);
                    let height = 0.5 * (p.altitudes[0] + p.altitudes[1]);
                    (patch.azimuths[0]..patch.azimuths[1]).contains(&middle)
                        && (patch.altitudes[0]..patch.altitudes[1]).contains(&height)
                };
                let parts: Vec<_> = fine.patches().iter().enumerate().collect();
                let sum: f64 = parts
                    .iter()
                    .filter(inside)
                    .map(|p| g.factor(surface, p.0))
                    .sum();
                let own = f.factor(surface, k);
                apart = apart.max((sum - own).abs());
                assert!(
                    (sum - own).abs() < 4.0 * error,
                    "{seed} {surface} {k}: {sum} {own}"
                );
                // From north to east by one sector.
                let next = k / 4 * 4 + (k + 1) % 4;
                let other = h.factor(surface, next);
                apart = apart.max((other - own).abs());
                assert!(
                    (other - own).abs() < 2.0 * error,
                    "{seed} {surface} {k}: {other} {own}"
                );
            }
        }
    }
    println!("largest difference of sums from 1 {worst:e}, of sums of patches {apart:e}");
}

/// The mean over points of a face is what the face sees.
#[test]
fn points_see_what_faces_see() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let scene = open(&random_scene(&mut rng));
    let sights = Sights::new(&scene, 1e-9).unwrap();
    let sky = bands();
    const N: usize = 24;
    for face in 0..scene.faces().len() {
        let own = &scene.faces()[face];
        let row = sights.sky(face, &sky).unwrap();
        let mut means = vec![0.0; 26];
        let p = own.polygon();
        if p.len() != 4 {
            continue;
        }
        for i in 0..N * N {
            let (s, t) = ((i % N) as f64 + 0.5, (i / N) as f64 + 0.5);
            let (s, t) = (s / N as f64, t / N as f64);
            let at: [f64; 3] = core::array::from_fn(|k| {
                p[0][k] + s * (p[1][k] - p[0][k]) + t * (p[3][k] - p[0][k])
            });
            let f = sights.sky_of_point(face, at, &sky).unwrap();
            assert!(f.iter().all(|&f| (-1e-15..=1.0).contains(&f)));
            means
                .iter_mut()
                .zip(f)
                .for_each(|(m, f)| *m += f / (N * N) as f64);
        }
        for (k, (mean, exchange)) in means.iter().zip(&row.exchange).enumerate() {
            // The midpoint rule at kinks, each of a point's factors below 0.1.
            let f = exchange / own.area;
            assert!((mean - f).abs() < 5e-4, "{face} {k}: {mean} {f}");
        }
    }
}

/// From the middle of a basin with many sides one sees cos² of the altitude of its rim.
#[test]
fn a_basin() {
    let n = 200;
    let rim: Vec<[f64; 2]> = (0..n)
        .map(|k| TAU * f64::from(k) / f64::from(n))
        .map(|a| [a.cos(), a.sin()])
        .collect();
    let mut basin = prism(&rim, 0.0, 0.8, true);
    basin.truncate(n as usize + 1);
    let scene = open(&basin);
    let floor = scene.faces_of(n as usize).unwrap().start;
    let sights = Sights::new(&scene, 1e-9).unwrap();
    let f = sights
        .sky_of_point(floor, [0.0; 3], &Sky::uniform())
        .unwrap();
    // A circle of the same area, but for n⁻⁴.
    let r = (n as f64 / TAU * (TAU / n as f64).sin()).sqrt();
    let exact = r * r / (r * r + 0.64);
    assert!((f[0] - exact).abs() < 1e-6, "{} {exact}", f[0]);
    assert_eq!(f[1], 0.0);
}

/// What leaves grey surfaces and is not absorbed arrives at the sky or below.
#[test]
fn exchange_factors_close_with_the_sky() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let scene = open(&standing(&mut rng));
    let sights = Sights::new(&scene, 1e-9).unwrap();
    let sky = bands();
    let all = scene_factors(&scene, 1e-9).unwrap();
    let f = all.of_surfaces(&scene).unwrap();
    let (of_sky, _) = to_sky(&scene, &sky, 1e-9);
    let emissivities: Vec<f64> = (0..f.len()).map(|_| rng.random_range(0.1..1.0)).collect();
    let script = f.script_f(&emissivities).unwrap();
    let outside = f.script_sky(&emissivities, &of_sky).unwrap();
    assert_eq!(outside.len(), 26 * f.len());
    for (i, emissivity) in emissivities.iter().enumerate() {
        let inner: f64 = script[f.len() * i..f.len() * (i + 1)].iter().sum();
        let outer: f64 = outside[26 * i..26 * (i + 1)].iter().sum();
        assert!(
            (inner + outer - emissivity).abs() < 1e-8,
            "{inner} {outer} {emissivity}"
        );
    }
    let other = SkyFactors::of_groups(all.areas(), &[], &[], 1);
    assert!(matches!(other, Err(FactorsError::Length { .. })));
    let rows: Vec<_> = (0..scene.faces().len())
        .map(|i| sights.sky(i, &sky).unwrap())
        .collect();
    let one = SkyFactors::of_groups(all.areas(), &rows, &vec![0; rows.len()], 1).unwrap();
    assert!((0..27).all(|k| one.factor(0, k).is_nan() == (k == 26)));
    let refused = f.script_sky(&emissivities, &one);
    let (expected, found) = (f.len(), 1);
    assert_eq!(refused, Err(FactorsError::Length { expected, found }));
}

#[test]
fn what_is_no_sky_is_refused() {
    let none: [(&[f64], &[u32]); 8] = [
        (&[0.0, 90.0], &[0]),
        (&[0.0, 90.0], &[1, 1]),
        (&[0.0, 90.0], &[]),
        (&[10.0, 90.0], &[1]),
        (&[0.0, 50.0, 40.0, 90.0], &[1, 1, 1]),
        (&[0.0, f64::NAN, 90.0], &[1, 1]),
        (&[], &[]),
        (&[0.0, 90.0], &[u32::MAX]),
    ];
    for (altitudes, sectors) in none {
        assert_eq!(Sky::bands(altitudes, sectors), Err(SceneError::Sky));
    }
    let cube = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let closed = scene_of::<f64>(&cube, Enclosure::Closed).unwrap();
    let sights = Sights::new(&closed, 1e-9).unwrap();
    assert_eq!(sights.sky(0, &Sky::uniform()), Err(FactorsError::NoSky));
    let scene = open(&cube);
    let sights = Sights::new(&scene, 1e-9).unwrap();
    assert_eq!(
        sights.sky(6, &Sky::uniform()),
        Err(FactorsError::Face { face: 6 })
    );
    assert_eq!(
        sights.sky_of_point(6, [0.0; 3], &Sky::uniform()),
        Err(FactorsError::Face { face: 6 })
    );
    // A room without an opening sees none of it.
    let row = sights.sky(0, &bands()).unwrap();
    assert!(row.exchange.iter().all(|&x| x == 0.0), "{row:?}");
}
