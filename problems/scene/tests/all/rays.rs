//! Rays: none leaves a closed scene, whatever it aims at.

use core::f64::consts::TAU;

use fredholm_core::galerkin::Cells as _;
use fredholm_core::sampled::{SampledStep, StepEvents};
use fredholm_core::{Equation, LastStep, Real, Uniforms};
use fredholm_scene::{
    Beam, Cells, Enclosure, Face, Geometry, Material, Polygon, Radiosity, Tables, shapes,
};
use fredholm_surfaces::space::{cross, dot, least_axis, sub, unit};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::common::{V, closed, closed_scenes, scene_of, scene_with, sphere};

/// The point at these coordinates from a vertex along the edges to two others.
fn within(a: V, b: V, c: V, s: f64, t: f64) -> V {
    core::array::from_fn(|i| a[i] + s * (b[i] - a[i]) + t * (c[i] - a[i]))
}

/// The vertices of a face from any one on.
fn corners<F: Real>(rng: &mut ChaCha8Rng, face: &Face<F>) -> Vec<V> {
    let mut p: Vec<V> = face.polygon().iter().map(|p| p.map(F::to_f64)).collect();
    let first = rng.random_range(0..p.len());
    p.rotate_left(first);
    p
}

/// A point of a face: inside, or on an edge, or a vertex.
fn origin<F: Real>(rng: &mut ChaCha8Rng, face: &Face<F>) -> V {
    let p = corners(rng, face);
    let (mut s, mut t): (f64, f64) = (rng.random(), rng.random());
    if s + t > 1.0 {
        (s, t) = (1.0 - s, 1.0 - t);
    }
    match rng.random_range(0..8) {
        0 => t = 0.0,
        1 => (s, t) = (0.0, 0.0),
        2 => t *= 1e-15,
        _ => {}
    }
    within(p[0], p[1], p[2], s, t)
}

/// A direction to the active side: to a vertex, or to an edge, or by the cosine law.
fn aimed<F: Real>(rng: &mut ChaCha8Rng, geometry: &Geometry<'_, F>, face: u32, from: V) -> V {
    let n = geometry.faces()[face as usize].normal.map(F::to_f64);
    if rng.random_range(0..2) == 0 {
        let other = rng.random_range(0..geometry.faces().len());
        let p = corners(rng, &geometry.faces()[other]);
        let t: f64 = if rng.random() { 0.0 } else { rng.random() };
        let d = sub(within(p[0], p[1], p[0], t, 0.0), from);
        // Within rounding of the plane there is nothing to meet.
        if dot(n, d) > 1e-5 * dot(d, d).sqrt() {
            return unit(d);
        }
    }
    by_cosine(rng, n)
}

/// A direction to the side of a normal by the cosine law.
fn by_cosine(rng: &mut ChaCha8Rng, n: V) -> V {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    let x = unit(cross(n, least_axis(n)));
    let y = cross(n, x);
    let (r, phi) = (u.sqrt(), TAU * v);
    let up = (1.0 - u).sqrt();
    unit(core::array::from_fn(|i| {
        r * (phi.cos() * x[i] + phi.sin() * y[i]) + up * n[i]
    }))
}

/// The number of rays that leave.
fn escapes<F: Real>(geometry: &Geometry<'_, F>, rays: usize, seed: u64) -> usize {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut out = 0;
    for _ in 0..rays {
        let face = rng.random_range(0..geometry.faces().len() as u32);
        let from = origin(&mut rng, &geometry.faces()[face as usize]);
        let to = aimed(&mut rng, geometry, face, from);
        let hit = geometry.cast(face, from.map(F::from_f64), to.map(F::from_f64));
        if hit.is_none() {
            println!("from {face} {from:?} to {to:?}");
            out += 1;
        }
    }
    out
}

/// 30 scenes; with FREDHOLM_LONG in the environment 10⁹ rays, or as many as it says if more than 1.
#[test]
fn no_ray_leaves_a_closed_scene() {
    let total: usize = match std::env::var("FREDHOLM_LONG") {
        Ok(text) => text
            .parse()
            .ok()
            .filter(|&n| n > 1)
            .unwrap_or(1_000_000_000),
        Err(_) => 1_000_000,
    };
    let scenes = closed_scenes();
    assert_eq!(scenes.len(), 30);
    let mut cast = 0;
    for (seed, (name, surfaces)) in scenes.iter().enumerate() {
        let rays = total / (2 * scenes.len());
        let scene = scene_of::<f64>(surfaces, Enclosure::Closed);
        let scene = scene.unwrap_or_else(|e| panic!("{name}: {e}"));
        let out = escapes(&scene.geometry(), rays, seed as u64);
        assert_eq!(out, 0, "{name}: {out} of {rays} rays in f64 leave");
        cast += rays;
        // What is too thin for f32 is refused there.
        if let Ok(scene) = scene_of::<f32>(surfaces, Enclosure::Closed) {
            let tables = Tables::<f32>::new(&scene);
            let out = escapes(&tables.geometry(), rays, seed as u64);
            assert_eq!(out, 0, "{name}: {out} of {rays} rays in f32 leave");
            cast += rays;
        }
    }
    println!("{cast} rays, none of which left");
}

#[test]
fn a_ray_meets_what_a_loop_over_all_faces_meets() {
    for (seed, (name, surfaces)) in closed_scenes().iter().enumerate() {
        let scene = closed(surfaces);
        let geometry = scene.geometry();
        let mut rng = ChaCha8Rng::seed_from_u64(100 + seed as u64);
        for _ in 0..200 {
            let face = rng.random_range(0..geometry.faces().len() as u32);
            let own = &geometry.faces()[face as usize];
            let p = own.polygon();
            let from = within(p[0], p[1], p[2], 0.27, 0.42);
            let to = by_cosine(&mut rng, own.normal);
            let hit = geometry.cast(face, from, to).unwrap();
            let distance = |f: &Face<f64>| {
                let t = dot(f.normal, sub(f.corners[0], from)) / dot(f.normal, to);
                let at: V = core::array::from_fn(|i| from[i] + t * to[i]);
                let p = f.polygon();
                let inside = (0..p.len()).all(|k| {
                    let (a, b) = (sub(p[k], at), sub(p[(k + 1) % p.len()], at));
                    dot(cross(a, b), f.normal) >= -1e-13
                });
                (inside && t > 1e-13).then_some(t)
            };
            let faces = geometry.faces().iter().zip(0..);
            let nearest = faces
                .filter(|(f, g)| *g != face && f.plane != own.plane && dot(f.normal, to) < 0.0)
                .filter_map(|(f, _)| distance(f))
                .fold(f64::INFINITY, f64::min);
            let off = (hit.distance - nearest).abs();
            assert!(off <= 1e-6 * (1.0 + nearest), "{name}: {hit:?} {nearest}");
        }
    }
}

/// A square of this height between two diagonal corners, seen from above or below.
fn plate(z: f64, low: f64, high: f64, up: bool) -> Vec<Polygon> {
    let [a, b] = [low, high];
    let p = Polygon::Quad([[a, a, z], [b, a, z], [b, b, z], [a, b, z]]);
    vec![if up { p } else { shapes::reversed(&p) }]
}

#[test]
fn backs_stop_light_in_open_scenes_only() {
    let plates = [(0.0, true), (0.5, true), (1.0, false)];
    let plates = plates.map(|(z, up)| plate(z, 0.0, 1.0, up)).to_vec();
    let scene = scene_of::<f64>(&plates, Enclosure::Open).unwrap();
    let cast = |face, z| scene.geometry().cast(face, [0.3, 0.3, z], [0.0, 0.0, 1.0]);
    assert_eq!(cast(0, 0.0), None);
    let hit = cast(1, 0.5).unwrap();
    let expected = (2, 0.5, [0.3, 0.3, 1.0]);
    assert_eq!((hit.face, hit.distance, hit.point), expected);
    assert_eq!(cast(7, 0.5), None);
}

#[test]
fn tables_that_do_not_belong_together_are_refused() {
    let scene = closed(&shapes::room([0.0; 3], [1.0; 3]).surfaces);
    let g = scene.geometry();
    let (faces, triangles, nodes) = (g.faces(), g.triangles(), g.nodes());
    let mut circle = nodes.to_vec();
    circle[0].first = 0;
    assert!(Geometry::new(faces, triangles, nodes, false).is_ok());
    assert!(Geometry::new(&faces[1..], triangles, nodes, false).is_err());
    assert!(Geometry::new(faces, &triangles[1..], nodes, false).is_err());
    assert!(Geometry::new(faces, triangles, &nodes[1..], false).is_err());
    assert!(Geometry::new(faces, triangles, &circle, false).is_err());
}

/// Faces that are one plane within the smallest distance of f32, near a pole, are a shallow bowl: a ray along one of them
/// goes below the next, which is left out with the plane.
#[test]
fn a_ray_along_a_shallow_bowl_meets_it() {
    let scene = scene_of::<f32>(&sphere(60, 1.0, true), Enclosure::Closed).unwrap();
    let tables = Tables::<f32>::new(&scene);
    let from = [-0.051_227_81, -0.005_384_26, -0.998_651_15];
    let to = [-0.201_585_45, 0.979_463, 0.003_934_607_6];
    let faces = tables.geometry().faces();
    assert_eq!(faces[14101].plane, faces[14100].plane);
    let hit = tables.geometry().cast(14101, from, to).unwrap();
    // What is met next to the pole is less than the ring's width away.
    assert!(
        !hit.back && hit.face != 14101 && hit.distance < 0.2,
        "{hit:?}"
    );
}

struct Zeros;
impl Uniforms<f64> for Zeros {
    fn uniform(&mut self) -> f64 {
        0.0
    }
}

/// Sunlight and a lamp on a floor that sees nothing else but a black plate: u is known, and 0 in the shadow. The plate's lower
/// side is dark, as what shines from above meets its back.
#[test]
fn beams_cast_shadows() {
    let surfaces = vec![
        plate(0.0, 0.0, 4.0, true),
        plate(1.0, 1.0, 2.0, true),
        plate(1.0, 1.0, 2.0, false),
    ];
    let material = |s: usize| Material {
        reflectance: [0.5, 0.0, 0.0][s],
        emission: 0.0,
    };
    let scene = scene_with::<f64>(&surfaces, material, Enclosure::Open).unwrap();
    // Of length 3 before it is made 1: the sun's cosine on the floor is ⅔, and its shadow is one half to the left.
    let sun = Beam::Parallel {
        towards: [1.0, 2.0, 2.0],
        irradiance: 900.0,
    };
    let lamp = Beam::Point {
        at: [1.5, 1.5, 3.0],
        intensity: 270.0,
    };
    let scene = scene.with_beams(vec![sun, lamp]).unwrap();
    let (geometry, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 20).unwrap());
    let radiosity = Radiosity::new(geometry.geometry(), &cells).unwrap();
    let of_lamp = |x: f64, y: f64| {
        let square = (x - 1.5) * (x - 1.5) + (y - 1.5) * (y - 1.5) + 9.0;
        0.5 * 270.0 * 3.0 / square.powf(1.5)
    };
    let cases = [
        // Beyond both shadows; in the sun's, from (½, 0) to (1½, 1); in the lamp's, from ¾ to 2¼.
        ([3.5, 0.5], 300.0 + of_lamp(3.5, 0.5)),
        ([0.6, 0.1], of_lamp(0.6, 0.1)),
        ([2.0, 2.0], 300.0),
        ([1.0, 0.9], 0.0),
    ];
    for ([x, y], expected) in cases {
        let x = radiosity.at(0, [x, y, 0.0]).unwrap();
        // No number is drawn: there is no light that emits.
        let known = LastStep(&radiosity).source(&x, &mut Zeros);
        for source in [radiosity.source(&x, &mut Zeros), known] {
            assert!(
                (source - expected).abs() <= 1e-9 * expected,
                "{source} for {expected}"
            );
        }
    }
    let below = radiosity.point(radiosity.cells() - 1, &[0.5, 0.5]);
    assert_eq!((below.face, radiosity.source(&below, &mut Zeros)), (2, 0.0));
}

/// Rays cross faces as often as their events' probabilities say: behind obstacles, below the horizon in part, and beside them.
#[test]
fn faces_are_crossed_as_often_as_form_factors_say() {
    fn check<F: Real>(rng: &mut ChaCha8Rng) {
        const RAYS: u32 = 400;
        let (mut worst, mut both) = (0.0_f64, 0);
        for (_, surfaces) in closed_scenes().into_iter().step_by(7) {
            let scene = scene_of::<F>(&surfaces, Enclosure::Closed).unwrap();
            let (tables, cells) = (Tables::<F>::new(&scene), Cells::new(&scene, 40).unwrap());
            let radiosity = Radiosity::new(tables.geometry(), &cells).unwrap();
            for _ in 0..120 {
                let (cell, face) = (
                    rng.random_range(0..radiosity.cells()),
                    rng.random_range(0..scene.faces().len() as u32),
                );
                let mut x = radiosity.point(cell, &[rng.random(), rng.random()]);
                if rng.random() {
                    // At a vertex, on the edges of other faces.
                    let own = &tables.geometry().faces()[x.face as usize];
                    let corner = own.corners[rng.random_range(0..4)].map(F::to_f64);
                    x = radiosity.at(x.face, corner).unwrap();
                }
                let p = radiosity.probability(&x, face).to_f64();
                let crossed: u32 = (0..RAYS)
                    .map(|_| {
                        let omega = [rng.random(), rng.random()].map(F::from_f64);
                        let step = SampledStep {
                            from: &x,
                            omega: &omega,
                            to: None,
                        };
                        radiosity.occurring(&step, &[face])
                    })
                    .sum();
                let (n, crossed) = (f64::from(RAYS), f64::from(crossed));
                // Bernstein's bound: Poisson's tail where p is small.
                let z = (crossed - n * p).abs() / (n * p * (1.0 - p) + 3.0).max(0.0).sqrt();
                worst = worst.max(z);
                both += usize::from(p > 0.01);
            }
        }
        // Of 1,200 events in all.
        assert!(worst < 4.9 && both > 60, "{worst}, {both} of a size");
    }
    let mut rng = ChaCha8Rng::seed_from_u64(27);
    check::<f64>(&mut rng);
    check::<f32>(&mut rng);
}
