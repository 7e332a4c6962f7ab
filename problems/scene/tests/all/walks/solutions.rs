//! Solutions in closed form, and what must not change them.

use super::*;
use crate::common::{map, meshed, rotation, sphere, triangulated};

/// Estimates of the means over some surfaces with polynomials of degree 1: plain and preconditioned, however walks end.
fn means<F: Real>(scene: &Scene, surfaces: &[usize]) -> Vec<Vec<Estimate>> {
    let (place, wide) = (Place::<F>::new(scene, 40), Place::new(scene, 40));
    let (radiosity, wide) = (place.radiosity(), wide.radiosity());
    let own = tables::<F, _, _, 3>(&wide, &wide, 256);
    let neighbour = own
        .neighbour::<_, _, 2, 3>(&radiosity, &radiosity, TWO)
        .unwrap();
    let over = |&surface: &usize| {
        let place = Place::<F>::over(scene, 40, surface);
        let mean = place.mean();
        let all = ENDS.map(|absorption| walk(&radiosity, &neighbour, &mean, absorption, 4000));
        all.iter()
            .flat_map(|all| [all.plain(), all.preconditioned()])
            .collect()
    };
    surfaces.iter().map(over).collect()
}

/// The eighths of a sphere by latitude and side, of any mesh of 4k rings.
fn eighths(n: usize) -> Surfaces {
    let mut zones: Surfaces = vec![Vec::new(); 8];
    for polygon in sphere(n, 1.0, true).swap_remove(0) {
        let Polygon::Triangle(corners) = polygon else {
            unreachable!("spheres are of triangles");
        };
        let [x, y, z]: [f64; 3] =
            core::array::from_fn(|k| corners.iter().map(|corner| corner[k]).sum::<f64>());
        let polar = x.hypot(y).atan2(z);
        let ring = (polar / core::f64::consts::FRAC_PI_4) as usize;
        zones[2 * ring + usize::from(y < 0.0)].push(polygon);
    }
    zones
}

/// Within a sphere the kernel is a constant, so that u = F + ρ F̄/(1 − ρ̄) for any ρ and F, where bars are means over the sphere. A
/// mesh of 2n × n patches is off by a multiple of n⁻², which two meshes tell.
#[test]
fn a_sphere_from_inside() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let materials: [Material; 8] = core::array::from_fn(|_| Material {
        reflectance: 0.8 * rng.random::<f64>(),
        emission: rng.random(),
    });
    let share = |zone: usize| {
        let end = |ring: usize| (ring as f64 * core::f64::consts::FRAC_PI_4).cos();
        (end(zone / 2) - end(zone / 2 + 1)) / 4.0
    };
    let mean = |of: fn(&Material) -> f64| -> f64 {
        (0..8).map(|zone| share(zone) * of(&materials[zone])).sum()
    };
    let arriving = mean(|m| m.emission) / (1.0 - mean(|m| m.reflectance));
    let [coarse, fine] = [4, 8].map(|n| scene::<f64>(&eighths(n), |zone| materials[zone]));
    let zones: Vec<usize> = (0..8).collect();
    let [coarse, fine] = [&coarse, &fine].map(|scene| means::<f64>(scene, &zones));
    for (zone, own) in materials.iter().enumerate() {
        let exact = own.emission + own.reflectance * arriving;
        for (coarse, fine) in coarse[zone].iter().zip(&fine[zone]) {
            let limit = (4.0 * fine.estimate - coarse.estimate) / 3.0;
            let error = (4.0 * fine.std_error.unwrap()).hypot(coarse.std_error.unwrap()) / 3.0;
            let z = (limit - exact) / error;
            assert!(
                z.abs() < STANDARD_ERRORS,
                "{zone}: {limit} ± {error} for {exact}"
            );
        }
    }
}

/// A scene that is turned, mirrored, larger, smaller or cut otherwise has the same u.
#[test]
fn the_same_scene_otherwise() {
    fn check_in<F: Real>() {
        let (_, surfaces) = closed_scenes().swap_remove(1);
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let materials: Vec<Material> = surfaces
            .iter()
            .map(|_| Material {
                reflectance: 0.8 * rng.random::<f64>(),
                emission: rng.random(),
            })
            .collect();
        let turn = rotation(&mut rng);
        let mut mirrored = map(&surfaces, |[x, y, z]| [-x, y, z]);
        for polygon in mirrored.iter_mut().flatten() {
            *polygon = shapes::reversed(polygon);
        }
        let others = [
            ("turned", map(&surfaces, |p| turn(p).map(|c| c + 0.5))),
            ("mirrored", mirrored),
            ("larger", map(&surfaces, |p| p.map(|c| 1e3 * c))),
            ("smaller", map(&surfaces, |p| p.map(|c| 1e-3 * c))),
            ("triangles", triangulated(&surfaces)),
            ("squares", meshed(&surfaces, 2)),
        ];
        let of = |surfaces: &Surfaces| {
            let scene = scene::<F>(surfaces, |surface| materials[surface]);
            means::<F>(&scene, &[0, 2]).concat()
        };
        let original = of(&surfaces);
        for (name, other) in &others {
            for (a, b) in original.iter().zip(of(other)) {
                let error = a.std_error.unwrap().hypot(b.std_error.unwrap());
                let z = (a.estimate - b.estimate) / error;
                assert!(z.abs() < STANDARD_ERRORS, "{name}: {a:?} and {b:?}");
            }
        }
    }
    check_in::<f64>();
    check_in::<f32>();
}
