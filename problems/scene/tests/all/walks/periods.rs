//! Scenes that repeat without end.

use fredholm_scene::SkyLight;

use super::*;

fn quad(corners: [[f64; 3]; 4]) -> Vec<Polygon> {
    vec![Polygon::Quad(corners)]
}

/// What arrives at a point of a face, by walks that follow the neighbour equation of few cells.
fn arriving(scene: &Scene, face: u32, position: [f64; 3], walks: u64) -> Statistics {
    let place = Place::<f64>::new(scene, 40);
    let radiosity = place.radiosity();
    let last = LastStep(&radiosity);
    let own = tables::<f64, _, _, 3>(&last, &radiosity, 512);
    let neighbour = own.neighbour::<_, _, 2, 3>(&last, &radiosity, TWO).unwrap();
    let point = radiosity.at(face, position).unwrap();
    walk(
        &last,
        &neighbour,
        &Irradiance(At(point)),
        Absorption::Roulette,
        walks,
    )
}

/// Rows of modules of length 1, tilted by 30°, 2 apart: the lower end sees this part of the sky (closed form in two dimensions).
#[test]
fn modules_see_the_sky() {
    let (sine, cosine) = (0.5, 0.75_f64.sqrt());
    let front = quad([
        [0.0, 0.0, 0.0],
        [cosine, 0.0, sine],
        [cosine, 1.0, sine],
        [0.0, 1.0, 0.0],
    ]);
    let back = vec![shapes::reversed(&front[0])];
    let scene =
        scene_with::<f64>(&vec![front, back], |_| Material::BLACK, Enclosure::Open).unwrap();
    let sky = scene.with_sky(SkyLight::uniform(1.0).unwrap()).unwrap();
    let row = sky.with_period([2.0, 1.0, 0.0]).unwrap();
    let up = row
        .faces()
        .iter()
        .position(|face| face.normal[2] > 0.0)
        .unwrap();
    let found = arriving(&row, up as u32, [0.0, 0.5, 0.0], 40_000);
    check_both("modules", &found, 0.795_345_247_3, 1e-6);
    assert!(found.preconditioned().std_error.unwrap() < 4e-3);
}

/// Plates that repeat are without end: u is constant on each, and no light leaves.
#[test]
fn plates_are_without_end() {
    let low = quad([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let high = quad([
        [0.0, 0.0, 0.3],
        [0.0, 1.0, 0.3],
        [1.0, 1.0, 0.3],
        [1.0, 0.0, 0.3],
    ]);
    let materials = [(0.5, 1.0), (0.8, 0.25)].map(|(reflectance, emission)| Material {
        reflectance,
        emission,
    });
    let both = vec![low, high];
    fn check_in<F: Real>(both: &Surfaces, materials: [Material; 2]) {
        let scene = scene_with::<F>(both, |s| materials[s], Enclosure::Open).unwrap();
        let scene = scene.with_period([1.0, 1.0, 0.0]).unwrap();
        let [[r, f], [s, g]] = materials.map(|own| [own.reflectance, own.emission]);
        for (surface, exact) in [(f + r * g) / (1.0 - r * s), (g + s * f) / (1.0 - r * s)]
            .into_iter()
            .enumerate()
        {
            let (place, wide) = (
                Place::<F>::over(&scene, 30, surface),
                Place::new(&scene, 30),
            );
            let expected = Expected {
                what: "plates",
                mean: place.mean(),
                weights: &[],
                values: &[exact],
            };
            check_all::<F, _, _, 3>(&expected, &place.radiosity(), &wide.radiosity());
        }
    }
    check_in::<f64>(&both, materials);
    check_in::<f32>(&both, materials);
}

/// Two periods of a scene are a scene with twice the period: a street with a house in the sun, under a sky.
#[test]
fn two_periods_are_one_of_twice_the_length() {
    let ground = |x: f64| {
        quad([
            [x, 0.0, 0.0],
            [x + 3.0, 0.0, 0.0],
            [x + 3.0, 2.0, 0.0],
            [x, 2.0, 0.0],
        ])
    };
    let house = |x: f64| {
        shapes::block([x + 1.0, 0.4, 0.0], [x + 1.8, 1.1, 1.2])
            .surfaces
            .concat()
    };
    let made = |copies: usize| {
        let at = (0..copies).map(|i| 3.0 * i as f64);
        let surfaces: Surfaces = at.flat_map(|x| [ground(x), house(x)]).collect();
        let material = |surface: usize| Material {
            reflectance: [0.3, 0.6][surface % 2],
            emission: 0.0,
        };
        let scene = scene_with::<f64>(&surfaces, material, Enclosure::Open).unwrap();
        let sun = Beam::Parallel {
            towards: [1.0, 0.5, 0.7],
            irradiance: 3.0,
        };
        let lit = scene
            .with_sky(SkyLight::uniform(1.0).unwrap())
            .unwrap()
            .with_beams(vec![sun])
            .unwrap();
        lit.with_period([3.0 * copies as f64, 2.0, 0.0]).unwrap()
    };
    let (one, two) = (made(1), made(2));
    for position in [[0.2, 1.7, 0.0], [2.9, 0.2, 0.0], [1.3, 1.5, 0.0]] {
        let face = |scene: &Scene| scene.geometry().face_at(position).unwrap();
        let [a, b] = [&one, &two]
            .map(|scene| arriving(scene, face(scene), position, 20_000).preconditioned());
        let error = a.std_error.unwrap().hypot(b.std_error.unwrap());
        assert!(
            (a.estimate - b.estimate).abs() < STANDARD_ERRORS * error,
            "{a:?} {b:?}"
        );
        assert!(error < 0.02 * a.estimate, "{a:?}");
    }
}

/// A wall of height 1 every two metres, and a sun at 45 degrees: half of the ground lies in the shadow.
#[test]
fn shadows_fall_into_the_next_period() {
    let ground = quad([[0.0; 3], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let wall = quad([
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.0, 1.0, 0.0],
    ]);
    let back = vec![shapes::reversed(&wall[0])];
    let all = vec![ground, wall, back];
    let scene = scene_with::<f64>(&all, |_| Material::BLACK, Enclosure::Open).unwrap();
    let row = scene.with_period([2.0, 1.0, 0.0]).unwrap();
    let place = Place::<f64>::new(&row, 10);
    let radiosity = place.radiosity();
    let half = 0.5_f64.sqrt();
    for [x, towards, lit] in [
        [0.5, 1.0, 1.0],
        [1.5, 1.0, 0.0],
        [0.5, -1.0, 0.0],
        [1.5, -1.0, 1.0],
    ] {
        let x = radiosity.at(0, [x, 0.3, 0.0]).unwrap();
        let found = radiosity.of_sun(&x, [half * towards, 0.0, half]);
        assert!((found - lit * half).abs() < 1e-12, "{x:?} {found}");
    }
}

#[test]
fn what_does_not_repeat_is_refused() {
    let plate = quad([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let open = scene_with::<f64>(&vec![plate], |_| GREY, Enclosure::Open).unwrap();
    let closed = scene::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces, |_| GREY);
    let wrong = [
        closed.with_period([1.0, 0.0, 0.0]),
        open.clone().with_period([0.0; 3]),
        open.clone().with_period([0.9, 0.0, 0.0]),
        open.clone().with_period([-1.0, 0.0, 0.0]),
        open.clone().with_period([f64::NAN, 2.0, 0.0]),
        open.clone().with_period([f64::INFINITY, 2.0, 0.0]),
    ];
    assert!(
        wrong
            .iter()
            .all(|refused| matches!(refused, Err(SceneError::Period)))
    );
    let lamp = Beam::Point {
        at: [0.5; 3],
        intensity: 1.0,
    };
    let row = open.clone().with_period([1.0, 0.0, 0.0]).unwrap();
    assert_eq!(
        row.with_beams(vec![lamp]).unwrap_err(),
        SceneError::RepeatedLamp
    );
    let lit = open.with_beams(vec![lamp]).unwrap();
    assert_eq!(
        lit.with_period([1.0, 0.0, 0.0]).unwrap_err(),
        SceneError::RepeatedLamp
    );
}
