//! What scenes are refused, and why, and where.

use fredholm_scene::{Enclosure, Material, Place, Polygon, Scene, SceneError, Surface, shapes};

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use crate::common::{
    self, Surfaces, V, closed, closed_scenes, map, meshed, scene_of, sphere, triangulated,
};

fn cube() -> Surfaces {
    shapes::room([0.0; 3], [1.0; 3]).surfaces
}

fn place(surface: usize, polygon: usize) -> Place {
    Place { surface, polygon }
}

fn refused(surfaces: &Surfaces) -> SceneError {
    scene_of::<f64>(surfaces, Enclosure::Closed).unwrap_err()
}

fn polygon(points: &[V]) -> Vec<Polygon> {
    vec![match *points {
        [a, b, c] => Polygon::Triangle([a, b, c]),
        [a, b, c, d] => Polygon::Quad([a, b, c, d]),
        _ => unreachable!("three or four points"),
    }]
}

/// Another polygon in a cube, as surface 6.
fn with(points: &[V]) -> Surfaces {
    [cube(), vec![polygon(points)]].concat()
}

/// A rectangle between two corners of equal z.
fn level(low: [f64; 2], high: [f64; 2], z: f64) -> [V; 4] {
    [
        [low[0], low[1], z],
        [high[0], low[1], z],
        [high[0], high[1], z],
        [low[0], high[1], z],
    ]
}

/// The message says the polygon, the direction leads out, and from a point of a polygon.
fn leaves(surfaces: &Surfaces) -> Place {
    let error = refused(surfaces);
    let SceneError::Open {
        at,
        from,
        direction,
        ..
    } = error
    else {
        panic!("{error}");
    };
    let text = error.to_string();
    assert!(text.contains("not closed at surface") && text.contains("in direction"));
    let open = common::open(surfaces);
    let dot = |a: V, b: V| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let own = open.faces().iter().zip(0..).find(|(f, _)| {
        let to = core::array::from_fn(|k| from[k] - f.corners[0][k]);
        dot(f.normal, to).abs() < 1e-9 && dot(f.normal, direction) > 0.0
    });
    let (_, face) = own.expect("the ray starts at a polygon");
    let length = dot(direction, direction).sqrt();
    let direction = direction.map(|x| x / length);
    assert_eq!(open.geometry().cast(face, from, direction), None, "{error}");
    at
}

#[test]
fn scenes_that_are_good() {
    for (name, surfaces) in closed_scenes() {
        for surfaces in [triangulated(&surfaces), meshed(&surfaces, 2), surfaces] {
            let result = scene_of::<f64>(&surfaces, Enclosure::Closed);
            result.unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
    // Vertices that rounding keeps apart are one.
    closed(&map(&cube(), |p| p.map(|x| (x + 1.0 / 3.0) * 3.0 - 1.0)));
    let scene = closed(&cube());
    assert_eq!(scene.faces_of(2).unwrap(), 2..3);
    assert_eq!(scene.place(4), Some(place(4, 0)));
    assert_eq!(scene.area(5), Ok(1.0));
    assert_eq!(scene.area(6), Err(SceneError::Surface { surface: 6 }));
}

#[test]
fn numbers_that_are_none() {
    let empty = Scene::new::<f64>(&[], Enclosure::Closed).unwrap_err();
    assert_eq!(empty, SceneError::Empty);
    let nothing = [cube(), vec![vec![]]].concat();
    assert_eq!(refused(&nothing), SceneError::Polygons { surface: 6 });
    for x in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e61] {
        let wrong = with(&[[0.2, 0.2, 0.5], [0.4, 0.2, 0.5], [0.2, x, 0.5]]);
        assert_eq!(refused(&wrong), SceneError::Coordinate(place(6, 0)));
    }
    let tiny = map(&cube(), |p| p.map(|x| 1e-61 * x));
    assert_eq!(refused(&tiny), SceneError::Coordinate(place(0, 0)));
    let polygons = cube();
    let of = |materials: &[Material]| {
        let polygons = &polygons[0];
        let surface = Surface {
            polygons,
            materials,
        };
        Scene::new::<f64>(&[surface], Enclosure::Open).unwrap_err()
    };
    let grey = |reflectance, emission| Material {
        reflectance,
        emission,
    };
    for material in [
        grey(1.0 + f64::EPSILON, 1.0),
        grey(-0.1, 1.0),
        grey(f64::NAN, 1.0),
        Material::grey(-0.1, 300.0),
        Material::grey(1.1, 300.0),
    ] {
        assert_eq!(of(&[material]), SceneError::Reflectance(place(0, 0)));
    }
    for material in [
        grey(0.5, f64::NAN),
        grey(0.5, f64::INFINITY),
        Material::grey(0.5, -1.0),
    ] {
        assert_eq!(of(&[material]), SceneError::Emission(place(0, 0)));
    }
    let two = [grey(0.5, 1.0); 2];
    assert_eq!(of(&two), SceneError::Materials { surface: 0 });
    // Insulated surfaces reflect all; where all do, and nothing leaves, there is no steady state.
    let insulated = |enclosure| {
        common::scene_with::<f64>(&polygons, |_| Material::flux(0.0), enclosure).map(|_| ())
    };
    assert_eq!(insulated(Enclosure::Open), Ok(()));
    let none = Err(SceneError::NothingAbsorbs);
    assert_eq!(insulated(Enclosure::Closed), none);
}

#[test]
fn polygons_that_are_none() {
    let [a, b] = [[0.2, 0.2, 0.5], [0.4, 0.2, 0.5]];
    let far = [0.4, 0.4, 0.5];
    // Two vertices in one place, on a line, thinner than rounding, all in one place, and again two.
    let degenerate: [&[V]; 5] = [
        &[a, b, b],
        &[a, b, [0.6, 0.2, 0.5]],
        &[a, b, [0.3, 0.2 + 1e-13, 0.5]],
        &[a; 3],
        &[a, b, far, far],
    ];
    for points in degenerate {
        let error = refused(&with(points));
        assert_eq!(error, SceneError::Degenerate(place(6, 0)));
    }
    // Concave, and crossed.
    let side = [0.2, 0.4, 0.5];
    for points in [[a, b, [0.25, 0.25, 0.5], side], [a, far, b, side]] {
        let error = refused(&with(&points));
        assert_eq!(error, SceneError::NotConvex(place(6, 0)));
    }
    let bent = refused(&with(&[a, b, [0.4, 0.4, 0.6], side]));
    let SceneError::NotPlanar { at, by } = bent else {
        panic!("{bent}");
    };
    assert!(at == place(6, 0) && (0.01..0.1).contains(&by), "{by}");
    // Thin, and thick enough in f64.
    let needle = with(&[a, [0.8, 0.2, 0.5], [0.5, 0.2 + 1e-10, 0.5]]);
    common::open(&needle);
    let error = scene_of::<f32>(&needle, Enclosure::Open).unwrap_err();
    assert_eq!(error, SceneError::Degenerate(place(6, 0)));
}

#[test]
fn polygons_on_each_other() {
    let (first, second) = (place(1, 0), place(6, 0));
    let ceiling = cube()[1].clone();
    let Polygon::Quad([a, b, c, d]) = ceiling[0] else {
        panic!("a quadrilateral")
    };
    // The same, and begun at another vertex, within rounding.
    let near = d.map(|x| x + 1e-14);
    for points in [[a, b, c, d], [c, near, a, b]] {
        let error = refused(&with(&points));
        assert_eq!(error, SceneError::Duplicate { first, second });
    }
    let twice = SceneError::Duplicate {
        first,
        second: place(6, 2),
    };
    assert_eq!(
        twice.to_string(),
        "surface 6, polygon 2 is surface 1, polygon 0 once more: remove one of them"
    );
    // A part of the ceiling, facing as it does, and a little more.
    let over = with(&[[0.2, 0.2, 1.0], [0.2, 0.4, 1.0], [1.4, 0.2, 1.0]]);
    assert_eq!(refused(&over), SceneError::Overlap { first, second });
    // One goes through the other: through a wall, or in its middle.
    let plate = |low: f64, high: f64| {
        with(&[
            [0.5, 0.2, low],
            [0.5, 0.4, low],
            [0.5, 0.4, high],
            [0.5, 0.2, high],
        ])
    };
    let through = refused(&plate(0.5, 1.5));
    let SceneError::Crossing { at, .. } = through else {
        panic!("{through}");
    };
    let (first, second) = (second, first);
    assert_eq!(through, SceneError::Crossing { first, second, at });
    assert_eq!(at[2], 1.0);
    let other = vec![polygon(&level([0.2, 0.3], [0.8, 0.35], 0.5))];
    let crossed = [plate(0.2, 0.8), other].concat();
    // In an open scene both are cut where they meet: in halves, one of which is cut again.
    let scene = common::open(&crossed);
    assert_eq!(scene.covered(), []);
    assert!(scene.faces().len() > 8);
    for (surface, area) in [(6, 0.2 * 0.6), (7, 0.6 * 0.05)] {
        assert!((scene.area(surface).unwrap() - area).abs() < 1e-15);
    }
}

/// What nobody sees of a box of 4 × 3 × 2.5 as people draw it, in area: nothing of this is refused, whichever way it is turned.
#[test]
fn what_is_drawn_on_top_of_each_other_leaves() {
    let room = shapes::room([0.0; 3], [4.0, 3.0, 2.5]).surfaces;
    let cupboard = |low: f64| shapes::block([1.0, 1.0, low], [2.0, 2.0, 1.0]).surfaces;
    let (whole, reaching) = (cupboard(0.0).concat(), cupboard(-0.01).concat());
    let deep = shapes::room([0.0, 0.0, -0.3], [4.0, 3.0, 2.5]).surfaces;
    let floor = vec![room[0].clone()];
    let skirts = [floor, deep[1..].to_vec()].concat();
    let window = polygon(&[
        [1.0, 0.0, 1.0],
        [1.0, 0.0, 2.0],
        [2.0, 0.0, 2.0],
        [2.0, 0.0, 1.0],
    ]);
    let sum = |low: f64| 1.0 + 4.0 * (1.0 - low);
    let cases: [(&str, Surfaces, &[f64]); 6] = [
        (
            "a cupboard without its bottom",
            [room.clone(), vec![whole[1..].to_vec()]].concat(),
            &[11.0, sum(0.0)],
        ),
        (
            "with its bottom",
            [room.clone(), vec![whole]].concat(),
            &[11.0, sum(0.0)],
        ),
        (
            "which reaches into the floor",
            [room.clone(), vec![reaching]].concat(),
            &[11.0, sum(0.0)],
        ),
        ("walls that go below the floor", skirts, &[12.0]),
        (
            "a window on a wall",
            [room.clone(), vec![window.clone()]].concat(),
            &[12.0, 1.0],
        ),
        (
            "a window on a wall of triangles",
            [triangulated(&meshed(&room, 3)), vec![window]].concat(),
            &[12.0, 1.0],
        ),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(54);
    for (name, surfaces, areas) in &cases {
        let turn = common::rotation(&mut rng);
        for turned in [
            surfaces.clone(),
            triangulated(surfaces),
            map(surfaces, &turn),
        ] {
            let scene = scene_of::<f64>(&turned, Enclosure::Closed);
            let scene = scene.unwrap_or_else(|error| panic!("{name}: {error}"));
            for (surface, area) in [0, 6].into_iter().zip(*areas) {
                let own = scene.area(surface).unwrap();
                assert!((own - area).abs() < 1e-12, "{name}: {surface}: {own}");
            }
            let given: f64 = common::open(&room).faces().iter().map(|f| f.area).sum();
            let left: f64 = scene.covered().iter().map(|own| own.area).sum();
            assert!(left > 0.0 && left < given, "{name}: {left}");
        }
    }
}

/// Nine bricks in a row and on each other, and two that reach into each other, in open scenes: what is inside leaves, and a tent of thin
/// plates stays.
#[test]
fn what_touches_in_open_scenes_leaves() {
    let brick = |x: usize, y: usize| {
        let low = [x as f64, 0.0, y as f64];
        shapes::block(low, low.map(|c| c + 1.0)).surfaces.concat()
    };
    let bricks: Surfaces = (0..9).map(|k| brick(k % 3, k / 3)).collect();
    let scene = common::open(&bricks);
    let left: f64 = (0..9).map(|k| scene.area(k).unwrap()).sum();
    assert!((left - 30.0).abs() < 1e-12, "{left}");
    let both = [[0.0; 3], [0.5, 0.25, 0.25]].map(|low: V| {
        let high = core::array::from_fn(|k| if k == 0 { low[0] + 1.0 } else { 1.0 - low[k] });
        shapes::block(low, high).surfaces.concat()
    });
    let scene = common::open(&both.to_vec());
    // The second is half in the first: a quarter of a side is covered, and what goes through it.
    assert!((scene.area(0).unwrap() - 5.75).abs() < 1e-12);
    assert!((scene.area(1).unwrap() - 1.25).abs() < 1e-12);
    let inside = shapes::room([0.0; 3], [1.0; 3]).surfaces.concat();
    let outside = shapes::block([0.0; 3], [1.0; 3]).surfaces.concat();
    let tent = vec![inside[1..].to_vec(), outside[1..].to_vec()];
    let ground = vec![polygon(&level([-1.0; 2], [2.0; 2], 0.0))];
    let scene = common::open(&[tent, ground].concat());
    assert_eq!(scene.covered(), []);
}

#[test]
fn scenes_with_a_gap() {
    for missing in 0..6 {
        let mut open = cube();
        open.remove(missing);
        leaves(&open);
    }
    // A triangle of a mesh; a wall that stops short; one moved outwards.
    let mut mesh = triangulated(&meshed(&cube(), 4));
    mesh[3].remove(7);
    assert_eq!(leaves(&mesh).surface, 3);
    for mut points in [
        level([0.0; 2], [0.99, 1.0], 1.0),
        level([0.0; 2], [1.0; 2], 1.001),
    ] {
        points.reverse();
        let mut wrong = cube();
        wrong[1] = polygon(&points);
        leaves(&wrong);
    }
    let mut ball = sphere(8, 1.0, true);
    ball[0].remove(50);
    leaves(&ball);
}

/// The size of what is to be closed: behind a window before its wall, below a wall that ends above the floor, and a large
/// one where a ceiling is missing.
#[test]
fn gaps_have_a_size() {
    let gap = |surfaces: &Surfaces| {
        let error = refused(surfaces);
        let SceneError::Open { gap, .. } = error else {
            panic!("{error}");
        };
        let text = error.to_string();
        assert_eq!(text.contains("close the gap of"), gap.is_some(), "{text}");
        gap
    };
    for size in [1e-3, 1e-6, 0.1] {
        let window = with(&[
            [0.2, size, 0.2],
            [0.2, size, 0.6],
            [0.6, size, 0.6],
            [0.6, size, 0.2],
        ]);
        let mut lifted = cube();
        lifted[0] = polygon(&level([0.0; 2], [1.0; 2], -size));
        for surfaces in [window, lifted] {
            let found = gap(&surfaces).unwrap();
            assert!((found - size).abs() < 1e-12, "{found}");
        }
    }
    let mut roofless = cube();
    roofless.remove(1);
    assert!(gap(&roofless).is_none_or(|gap| gap > 0.4));
}

#[test]
fn scenes_that_are_seen_from_behind() {
    // One face turned, all turned, a plate with one side, two rooms in each other.
    let mut flipped = cube();
    flipped[2][0] = shapes::reversed(&flipped[2][0]);
    let error = refused(&flipped);
    let SceneError::Flipped { first, second, .. } = error else {
        panic!("{error}");
    };
    assert!([first, second].contains(&place(2, 0)));
    leaves(&shapes::block([0.0; 3], [1.0; 3]).surfaces);
    let plate = with(&level([0.2, 0.2], [0.4, 0.4], 0.5));
    assert_eq!(leaves(&plate), place(6, 0));
    leaves(&[cube(), shapes::room([0.2; 3], [0.4; 3]).surfaces].concat());
    // A block with a side too few.
    let block = shapes::block([0.2, 0.2, 0.0], [0.4; 3]);
    leaves(&[cube(), block.surfaces[2..].to_vec()].concat());
}

#[test]
fn a_vertex_close_to_an_edge_leaves_a_gap() {
    // The floor in three triangles, of which the vertex should be on the edge y = 0.
    let part = |y: f64| {
        let mut all = cube();
        let ([a, b, c, d], v) = (level([0.0; 2], [1.0; 2], 0.0), [0.4, y, 0.0]);
        let parts = [[a, v, d], [v, c, d], [v, b, c]];
        all[0] = parts.map(Polygon::Triangle).to_vec();
        all
    };
    for y in [0.0, 1e-14] {
        closed(&part(y));
    }
    let error = refused(&part(1e-6));
    let SceneError::TJunction {
        vertex, distance, ..
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!(vertex, [0.4, 1e-6, 0.0]);
    assert!((distance - 1e-6).abs() < 1e-12);
}
