//! Light of the sky against exact answers.

use fredholm_core::{Chain as _, Density as _, NoDraws};
use fredholm_factors::Sky;
use fredholm_scene::SkyLight;

use super::*;

/// A scene under a sky, with a material for every surface.
fn open<F: Real>(
    surfaces: &Surfaces,
    material: impl Fn(usize) -> Material,
    sky: SkyLight,
) -> Scene {
    let scene = scene_with::<F>(surfaces, material, Enclosure::Open);
    scene.unwrap().with_sky(sky).unwrap()
}

/// A court: the room without its ceiling, from which light leaves upwards alone.
pub(crate) fn court() -> Surfaces {
    let mut court = shapes::room([0.0; 3], [1.0, 1.0, 0.6]).surfaces;
    court.remove(1);
    court
}

/// F = (1 − ρ) L under a sky of L gives u = L, whatever the patches are.
#[test]
fn a_court_is_a_furnace() {
    fn check_in<F: Real, const B: usize>(sky: SkyLight) {
        let light = sky.emissions()[0];
        let rho = [0.8, 0.3, 0.5, 0.0, 0.9];
        let material = |s: usize| Material {
            reflectance: rho[s],
            emission: (1.0 - rho[s]) * light,
        };
        let scene = open::<F>(&court(), material, sky);
        check_constant::<F, B>("court", &scene, light);
    }
    let patches = || SkyLight::bands(&[0.0, 12.0, 50.0, 90.0], &[7, 4, 1], vec![3.0; 12]).unwrap();
    check_in::<f64, 1>(patches());
    check_in::<f64, 3>(patches());
    check_in::<f64, 3>(SkyLight::uniform(2.0).unwrap());
    check_in::<f32, 6>(patches());
}

/// A plate that sees nothing but the sky: of the band between two altitudes it sees the difference of the squares of their
/// sines, a part of it for each sector. The same for a meter above it; in the mean over all directions half of them are sky.
#[test]
fn patches_have_their_shares() {
    let plate: Surfaces = vec![shapes::room([0.0; 3], [1.0; 3]).surfaces.swap_remove(0)];
    let (low, high) = (0.25, 0.75);
    // The band from 30 to 90 degrees in three sectors, below it in two.
    let sky = SkyLight::bands(&[0.0, 30.0, 90.0], &[2, 3], vec![8.0, 0.0, 0.0, 6.0, 0.0]).unwrap();
    let scene = open::<f64>(&plate, |_| GREY, sky);
    let place = Place::<f64>::new(&scene, 4);
    assert_eq!(place.cells.number(), 4 + 5);
    let radiosity = place.radiosity();
    let from_above = 8.0 * low / 2.0 + 6.0 * high / 3.0;
    let x = At(radiosity.at(0, [0.3, 0.6, 0.0]).unwrap());
    let meter = Facing::new([0.4, 0.4, 0.2], [0.0, 0.0, 2.0]).unwrap();
    let air = Air {
        position: [0.5, 0.5, 0.5],
    };
    let last = LastStep(&radiosity);
    let own = tables::<f64, _, _, 3>(&last, &radiosity, 256);
    let one = NonZeroU32::MIN;
    let neighbour = own.neighbour::<_, _, 2, 3>(&last, &radiosity, one).unwrap();
    // Half a sphere has 1/4 of all directions below 30 degrees.
    let in_air = 8.0 / 4.0 / 2.0 + 6.0 / 4.0 / 3.0;
    // The plate, a square seen from half its width above its middle, fills a sixth of the sphere, and reflects a half.
    let below = 0.5 * from_above / 6.0;
    for absorption in ENDS {
        let u = walk(&last, &neighbour, &x, absorption, 20_000);
        check_both("u", &u, 0.5 * from_above, 1e-9);
        let at_plate = walk(&last, &neighbour, &Irradiance(x), absorption, 20_000);
        check_both("irradiance", &at_plate, from_above, 1e-9);
        let at_meter = walk(&last, &neighbour, &meter, absorption, 20_000);
        check_both("meter", &at_meter, from_above, 1e-9);
        let around = walk(&last, &neighbour, &air, absorption, 40_000);
        check_both("air", &around, in_air + below, 1e-9);
    }
}

/// Every point of the sky lies where it is located, and steps lead there as often as their density says.
#[test]
fn cells_of_the_sky() {
    let sky = SkyLight::bands(&[0.0, 20.0, 90.0], &[5, 2], (0..7).map(f64::from).collect());
    let scene = open::<f64>(&court(), |_| GREY, sky.unwrap());
    let place = Place::<f64>::new(&scene, 20);
    let radiosity = place.radiosity();
    let narrow = Place::<f32>::new(&scene, 20);
    let faces = radiosity.cells() - 7;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    // North, over east: as those of form factors.
    let of_factors = Sky::bands(&[0.0, 20.0, 90.0], &[5, 2]).unwrap();
    let bounds = of_factors.patches();
    for (patch, bounds) in bounds.iter().enumerate() {
        // The last sector ends where the first one begins, but for rounding.
        let (cell, narrow) = (faces + patch, narrow.radiosity());
        let point = narrow.point(cell, &[0.5, 1.0]);
        let mut end = [0.0; 2];
        narrow.parameters(&Located { point, cell }, &mut end);
        assert!((end[1] - 1.0).abs() < 1e-5, "{end:?}");
        for _ in 0..200 {
            let t = [rng.random::<f64>(), rng.random::<f64>()];
            let x = radiosity.point(faces + patch, &t);
            assert_eq!(radiosity.locate(&x), faces + patch);
            // Nothing comes back from there.
            assert!(radiosity.size(&x) == 0.0 && radiosity.step(&x, &mut NoDraws).is_none());
            assert_eq!(radiosity.rest(&x), patch as f64);
            let at = Located {
                point: x,
                cell: faces + patch,
            };
            let mut found = [0.0; 2];
            radiosity.parameters(&at, &mut found);
            let [_, b, c]: [f64; 3] = radiosity.basis(&at);
            let of = |t: f64| 3.0_f64.sqrt() * (2.0 * t - 1.0);
            for (found, expected) in found
                .into_iter()
                .chain([b, c])
                .zip(t.into_iter().chain(t.map(of)))
            {
                assert!((found - expected).abs() < 1e-9, "{t:?}");
            }
            // From the middle of the floor the sky is seen where the walls end.
            let floor = radiosity.at(0, [0.5, 0.5, 0.0]).unwrap();
            let d = x.position;
            let turn = d[0].atan2(d[1]).to_degrees().rem_euclid(360.0);
            let [altitudes, azimuths] = [bounds.altitudes, bounds.azimuths];
            assert!((altitudes[0]..=altitudes[1]).contains(&d[2].asin().to_degrees()));
            assert!(
                (azimuths[0]..=azimuths[1]).contains(&turn),
                "{turn} {azimuths:?}"
            );
            let wall = 0.5 / d[0].abs().max(d[1].abs());
            let density = radiosity.density(&floor, &x);
            let expected = if wall * d[2] > 0.6 {
                d[2] / core::f64::consts::PI
            } else {
                0.0
            };
            assert!((density - expected).abs() < 1e-12, "{d:?}");
            assert_eq!(radiosity.kernel(&floor, &x), 0.5);
        }
    }
}

/// The back of a shade hides the sky, and gives nothing.
#[test]
fn a_shade_hides_the_sky() {
    let room = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let mut shade = room[0].clone();
    for polygon in &mut shade {
        let Polygon::Quad(corners) = polygon else {
            panic!("a floor is a quadrilateral")
        };
        for corner in corners {
            corner[2] = 0.4;
        }
    }
    let sky = SkyLight::uniform(2.0).unwrap();
    let scene = open::<f64>(&vec![room[0].clone(), shade], |_| GREY, sky);
    let place = Place::<f64>::new(&scene, 8);
    let radiosity = place.radiosity();
    let x = [0.3, 0.6, 0.0];
    let start = At(radiosity.at(0, x).unwrap());
    let mut above: Vec<[f64; 3]> = scene.faces()[1].polygon().to_vec();
    above.reverse();
    let hidden = form_factor_of_point(x, [0.0, 0.0, 1.0], &above);
    let expected = 0.5 * 2.0 * (1.0 - hidden);
    let last = LastStep(&radiosity);
    let own = tables::<f64, _, _, 3>(&last, &radiosity, 256);
    let one = NonZeroU32::MIN;
    let neighbour = own.neighbour::<_, _, 2, 3>(&last, &radiosity, one).unwrap();
    for absorption in ENDS {
        let u = walk(&last, &neighbour, &start, absorption, 20_000);
        check_both("shade", &u, expected, 1e-9);
    }
}

/// What gives no light, or not to all patches, is no sky.
#[test]
fn refused_skies() {
    assert!(matches!(
        SkyLight::uniform(f64::NAN),
        Err(SceneError::SkyLight { patch: 0 })
    ));
    let few = SkyLight::bands(&[0.0, 90.0], &[4], vec![1.0; 3]);
    assert!(matches!(
        few,
        Err(SceneError::Length {
            expected: 4,
            found: 3
        })
    ));
    let gap = SkyLight::bands(&[0.0, 80.0], &[1], vec![1.0]);
    assert!(matches!(gap, Err(SceneError::Sky)));
}
