//! Surfaces that reflect a part of what arrives as mirrors do.

use super::*;

/// û = 1 in any closed scene where every surface emits what it absorbs, however much of the rest is mirrored.
#[test]
fn furnaces_have_mirrors() {
    fn check_in<F: Real, const B: usize>(which: usize) {
        let mut rng = ChaCha8Rng::seed_from_u64(100 + which as u64);
        let (name, surfaces) = closed_scenes().swap_remove(which);
        let mut share = |most: f64| -> Vec<f64> {
            surfaces
                .iter()
                .map(|_| most * rng.random::<f64>())
                .collect()
        };
        let (specular, absorbed) = (share(0.8), share(0.9));
        let scene = scene::<F>(&surfaces, |s| Material {
            reflectance: (1.0 - specular[s]) * absorbed[s],
            emission: (1.0 - specular[s]) * (1.0 - absorbed[s]),
        });
        check_constant::<F, B>(&name, &scene.with_specular(&specular).unwrap(), 1.0);
    }
    // The fifth has needles that are none in f32.
    for (number, which) in [0, 1, 2, 3, 5, 6].into_iter().enumerate() {
        if by_turns(number, 0) {
            check_in::<f64, 3>(which);
        }
        if by_turns(number, 1) {
            check_in::<f32, 6>(which);
        }
        if by_turns(number, 2) {
            check_in::<f64, 1>(which);
        }
    }
}

/// In a black box with two mirrors at a corner a point sees the lamp, and its images behind the first mirror, behind the second and behind both.
#[test]
fn mirrors_show_images() {
    let surfaces = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let at = |axis: usize| {
        let is_it = |s: &usize| {
            let points = surfaces[*s].iter().flat_map(Polygon::points);
            points.into_iter().all(|point| point[axis] == 1.0)
        };
        (0..surfaces.len()).find(is_it).unwrap()
    };
    let [east, north, ceiling] = [0, 1, 2].map(at);
    let (emission, [r, s]) = (2.0, [0.7, 0.4]);
    let lit = scene::<f64>(&surfaces, |surface| Material {
        reflectance: 0.0,
        emission: if surface == ceiling { emission } else { 0.0 },
    });
    let mut specular = vec![0.0; surfaces.len()];
    (specular[east], specular[north]) = (r, s);
    let lit = lit.with_specular(&specular).unwrap();
    let place = Place::<f64>::new(&lit, 60);
    let radiosity = place.radiosity();
    let last = LastStep(&radiosity);
    let own = tables::<f64, _, _, 3>(&last, &radiosity, 512);
    let neighbour = own.neighbour::<_, _, 2, 3>(&last, &radiosity, TWO).unwrap();
    let square = |[x, y]: [f64; 2]| {
        [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(|[a, b]| [x + a, y + b, 1.0])
    };
    for [x, y] in [[0.3, 0.6], [0.9, 0.8], [0.5, 0.1]] {
        let position = [x, y, 0.0];
        let sees = |corner| form_factor_of_point(position, [0.0, 0.0, 1.0], &square(corner));
        let images = [
            ([0.0, 0.0], 1.0),
            ([1.0, 0.0], r),
            ([0.0, 1.0], s),
            ([1.0, 1.0], r * s),
        ];
        let exact = emission
            * images
                .iter()
                .map(|&(corner, share)| share * sees(corner))
                .sum::<f64>();
        let floor = radiosity.geometry().face_at(position).unwrap();
        let point = radiosity.at(floor, position).unwrap();
        let found = walk(
            &last,
            &neighbour,
            &Irradiance(At(point)),
            Absorption::Roulette,
            40_000,
        );
        check_both("images", &found, exact, 1e-9);
        assert!(
            found.preconditioned().std_error.unwrap() < 0.01 * exact,
            "{found:?}"
        );
        let facing = Facing::new([x, y, 1e-9], [0.0, 0.0, 1.0]).unwrap();
        let found = walk(&last, &neighbour, &facing, Absorption::Roulette, 40_000);
        check_both("facing", &found, exact, 1e-6);
    }
}

/// What the sun gives to mirrors no walk finds: both together are refused, in either order.
#[test]
fn what_walks_do_not_find_in_mirrors_is_refused() {
    let scene = scene::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces, |_| GREY);
    let lamp = Beam::Point {
        at: [0.5; 3],
        intensity: 1.0,
    };
    let specular = [0.1, 0.0, 0.0, 0.0, 0.0, 0.5];
    let mirrored = scene.clone().with_specular(&specular).unwrap();
    let both = [
        mirrored.with_beams(vec![lamp]),
        (scene.clone().with_beams(vec![lamp])).and_then(|lit| lit.with_specular(&specular)),
    ];
    for refused in both {
        assert_eq!(refused.unwrap_err(), SceneError::MirroredBeam);
    }
    let too_much = scene.clone().with_specular(&[0.6; 6]);
    assert!(matches!(too_much, Err(SceneError::Specular(_))));
    // All that is not mirrored is reflected.
    let white = scene.with_specular(&[0.5; 6]);
    assert_eq!(white.unwrap_err(), SceneError::NothingAbsorbs);
}
