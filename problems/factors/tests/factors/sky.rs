//! What is seen of a sky, against closed forms, and against what is seen of everything else.

use core::f64::consts::TAU;

use fredholm_factors::{FactorsError, Sights, Sky, SkyFactors, scene_factors};
use fredholm_scene::{Polygon, Scene, SceneError, shapes};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::common::{
    Surfaces, bodies, closed, is_long, map, meshed, open, prism, rotation, triangulated,
};

fn bands() -> Sky {
    Sky::bands(&[0.0, 20.0, 50.0, 80.0, 90.0], &[12, 8, 4, 1]).unwrap()
}

fn ground(low: [f64; 2], high: [f64; 2]) -> Polygon {
    let [x, y] = [[low[0], high[0]], [low[1], high[1]]];
    Polygon::Quad([(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| [x[i], y[j], 0.0]))
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
    let row_of = |polygon| {
        let scene = open(&vec![vec![polygon]]);
        Sights::new(&scene, 1e-9).unwrap().sky(0, &sky).unwrap()
    };
    let row = row_of(ground([0.0, 0.0], [2.0, 1.0]));
    // Cuts of 12 and of 8 sectors and those at 15° are all at multiples of 15°.
    let half = 7.5_f64.to_radians();
    for (patch, exchange) in sky.patches().iter().zip(&row.exchange) {
        let pieces = (patch.azimuths[1] - patch.azimuths[0]) / 15.0;
        let [low, high] = patch.altitudes;
        let upper = if high == 90.0 {
            2.0 * half / TAU
        } else {
            below(high, half)
        };
        let exact = pieces * (upper - below(low, half));
        let off = (exchange / 2.0 - exact).abs();
        assert!(off < 1e-15, "{patch:?} {exchange} {exact}");
    }
    assert_eq!((row.exchange[25], row.error), (0.0, 0.0));
    // A wall that looks to the east, the axis x, sees one half of sky and ground each.
    let wall = Polygon::Quad([[0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]);
    let f = row_of(wall).exchange;
    assert!((f[25] - 0.5).abs() < 1e-15);
    // Patches from north to south over east, and none of the west.
    let [east, west] = [&f[..6], &f[6..12]];
    assert!(east.iter().all(|&f| f > 0.0) && west.iter().all(|&f| f == 0.0));
    assert!((0..3).all(|k| (f[k] - f[5 - k]).abs() < 1e-15), "{f:?}");
}

/// All that leaves the floor of a box without a lid for the sky passes where the lid would be.
#[test]
fn an_open_box_sees_of_the_sky_what_it_would_see_of_a_lid() {
    let angles = (0..7).map(|k| TAU * f64::from(k) / 7.0);
    let outline = angles.map(|a| [a.cos() - 0.2 * (2.0 * a).sin(), 1.4 * a.sin()]);
    let outline: Vec<[f64; 2]> = outline.collect();
    for (shape, lid) in [
        (shapes::room([0.0; 3], [1.0, 0.7, 2.0]).surfaces, 1),
        (prism(&outline, 0.0, 1.3, true), 8),
    ] {
        let whole = closed(&shape);
        let inner = scene_factors(&whole, 1e-9).unwrap();
        let inner = inner.of_surfaces(&whole).unwrap();
        let mut rest = shape.clone();
        rest.remove(lid);
        for surfaces in [rest.clone(), meshed(&rest, 2), triangulated(&rest)] {
            let (f, _) = to_sky(&open(&surfaces), &bands(), 1e-9);
            for surface in 0..rest.len() {
                let exact = inner.factor(surface + usize::from(surface >= lid), lid);
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
    let groups = (0..faces).map(|i| scene.place(i).unwrap().surface);
    let groups: Vec<usize> = groups.collect();
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
    let all = if rng.random_bool(0.3) {
        standing(rng)
    } else {
        let mut all = meshed(&vec![vec![ground([0.0, 0.0], [2.0, 1.2])]], 2);
        let count = rng.random_range(1..=3);
        all.extend(bodies(rng, count, 0.6));
        all
    };
    if rng.random() {
        map(&all, rotation(rng))
    } else {
        all
    }
}

/// What leaves a face arrives at another, in the sky or on the ground, whatever hides what; patches of a finer sky add up
/// to those of a coarser one; and a scene that is turned by a quarter sees the patches turned. 60 scenes with
/// FREDHOLM_LONG, else 2.
#[test]
fn rows_of_open_scenes_close_with_the_sky() {
    let error = 1e-9;
    let [coarse, fine] = [
        (&[0.0, 30.0, 90.0][..], &[4, 4][..]),
        (&[0.0, 10.0, 30.0, 60.0, 90.0][..], &[8, 12, 4, 8][..]),
    ]
    .map(|(altitudes, sectors)| Sky::bands(altitudes, sectors).unwrap());
    let (mut worst, mut apart) = (0.0_f64, 0.0_f64);
    for seed in 0..if is_long() { 60 } else { 2 } {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let base = random_scene(&mut rng);
        let scene = open(&base);
        let [(f, off_f), (g, off_g)] = [&coarse, &fine].map(|sky| to_sky(&scene, sky, error));
        // Nine sums of pieces, and some tens of factors.
        assert!(
            off_f.max(off_g) < 10.0 * error,
            "{seed}: {off_f:e} {off_g:e}"
        );
        worst = worst.max(off_f).max(off_g);
        let turned = map(&base, |p| [p[1], -p[0], p[2]]);
        let (h, _) = to_sky(&open(&turned), &coarse, error);
        for (k, patch) in coarse.patches().iter().enumerate() {
            // Corners of both skies on the circle at 30° are the same.
            let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
            let contains = |[a, b]: [f64; 2], own| (a..b).contains(&middle(own));
            let parts = fine.patches().iter().enumerate().filter(|(_, own)| {
                contains(patch.azimuths, own.azimuths) && contains(patch.altitudes, own.altitudes)
            });
            for surface in 0..scene.surfaces() {
                let own = f.factor(surface, k);
                let sum: f64 = parts.clone().map(|p| g.factor(surface, p.0)).sum();
                assert!((sum - own).abs() < 4.0 * error, "{seed} {surface} {k}");
                // From north to east by one sector.
                let other = h.factor(surface, k / 4 * 4 + (k + 1) % 4);
                assert!((other - own).abs() < 2.0 * error, "{seed} {surface} {k}");
                apart = apart.max((sum - own).abs()).max((other - own).abs());
            }
        }
    }
    println!("largest difference of sums from 1 {worst:e}, of sums of patches {apart:e}");
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
    let rows = script.chunks(f.len()).zip(outside.chunks(26));
    for ((inner, outer), emissivity) in rows.zip(&emissivities) {
        let sum: f64 = inner.iter().chain(outer).sum();
        assert!((sum - emissivity).abs() < 1e-8, "{sum} {emissivity}");
    }
    let other = SkyFactors::of_groups(all.areas(), &[], &[], 1);
    assert!(matches!(other, Err(FactorsError::Length { .. })));
    let faces = 0..scene.faces().len();
    let rows: Vec<_> = faces.map(|i| sights.sky(i, &sky).unwrap()).collect();
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
    let closed = closed(&cube);
    let sights = Sights::new(&closed, 1e-9).unwrap();
    assert_eq!(sights.sky(0, &Sky::uniform()), Err(FactorsError::NoSky));
    let scene = open(&cube);
    let sights = Sights::new(&scene, 1e-9).unwrap();
    let none = FactorsError::Face { face: 6 };
    assert_eq!(sights.sky(6, &Sky::uniform()), Err(none));
    // A room without an opening sees none of it.
    let row = sights.sky(0, &bands()).unwrap();
    assert!(row.exchange.iter().all(|&x| x == 0.0), "{row:?}");
}

/// Ground of 3 × 3 unit squares without that in the middle, from 1 to 2.
fn ground_with_a_hole() -> Vec<Polygon> {
    let squares = (0..9).filter(|&k| k != 4).map(|k| {
        let low = [f64::from(k / 3), f64::from(k % 3)];
        ground(low, low.map(|x| x + 1.0))
    });
    squares.collect()
}

/// A block on the hole, without a bottom.
fn block_on_the_hole() -> Surfaces {
    let block = shapes::block([1.0, 1.0, 0.0], [2.0, 2.0, 1.0]).surfaces;
    block.into_iter().skip(1).collect()
}

#[test]
fn ground_hides_what_it_would_without_the_hole_under_a_building() {
    let mut surfaces = block_on_the_hole();
    surfaces.push(ground_with_a_hole());
    let scene = open(&surfaces);
    let sights = Sights::new(&scene, 1e-9).unwrap();
    assert_eq!(sights.occluders(), 6);
    let f = scene_factors(&scene, 1e-9).unwrap();
    for (face, sum) in f.row_sums().iter().enumerate() {
        let row = sights.sky(face, &bands()).unwrap();
        let area = scene.faces()[face].area;
        let all = sum + row.exchange.iter().sum::<f64>() / area;
        assert!((all - 1.0).abs() < 1e-9, "{face}: {all}");
    }
}

#[test]
fn a_hole_with_somebody_in_the_building_is_open() {
    let high = [1.4, 1.6].map(|x| [x, x, 0.5]);
    let lamp = shapes::reversed(&Polygon::Quad([
        high[0],
        [1.6, 1.4, 0.5],
        high[1],
        [1.4, 1.6, 0.5],
    ]));
    let mut surfaces = vec![vec![lamp]];
    surfaces.extend(block_on_the_hole());
    surfaces.push(ground_with_a_hole());
    let scene = open(&surfaces);
    let sights = Sights::new(&scene, 1e-9).unwrap();
    assert!(sights.occluders() > 8);
    let below = sights.sky(0, &Sky::uniform()).unwrap().exchange[1];
    let alone = open(&vec![vec![lamp], vec![ground([1.0; 2], [2.0; 2])]]);
    let through = scene_factors(&alone, 1e-9).unwrap().exchange_area(0, 1);
    assert!((below - through).abs() < 1e-9, "{below} {through}");
}

#[test]
fn a_pit_is_open() {
    let pit = shapes::room([1.0, 1.0, -1.0], [2.0, 2.0, 0.0]).surfaces;
    // Its floor comes first, then its ceiling, which is none of a pit.
    let mut surfaces: Surfaces = pit;
    surfaces.remove(1);
    surfaces.push(ground_with_a_hole());
    let scene = open(&surfaces);
    let sights = Sights::new(&scene, 1e-9).unwrap();
    let seen = sights.sky(0, &Sky::uniform()).unwrap().exchange[0];
    assert!((seen - crate::C_11).abs() < 1e-9, "{seen}");
}
