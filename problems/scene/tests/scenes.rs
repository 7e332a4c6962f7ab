//! What scenes are refused, and why, and where.

use fredholm_scene::{Enclosure, Material, Place, Polygon, Scene, SceneError, Surface, shapes};

mod common;
use common::{Surfaces, closed_scenes, meshed, scene_of, sphere, triangulated};

const GREY: Material = Material {
    reflectance: 0.5,
    emission: 1.0,
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

/// Another polygon in a cube, as surface 6.
fn with(points: &[[f64; 3]]) -> Surfaces {
    let mut all = cube();
    all.push(vec![match *points {
        [a, b, c] => Polygon::Triangle([a, b, c]),
        [a, b, c, d] => Polygon::Quad([a, b, c, d]),
        _ => unreachable!("three or four points"),
    }]);
    all
}

/// The message says the polygon, the direction leads out, and from a point of a polygon.
fn leaves(surfaces: &Surfaces) -> Place {
    let error = refused(surfaces);
    let SceneError::Open {
        at,
        from,
        direction,
    } = error
    else {
        panic!("{error}");
    };
    let open = scene_of::<f64>(surfaces, Enclosure::Open).unwrap();
    let own = open.faces().iter().zip(0..).find(|(f, _)| {
        let to: f64 = (0..3)
            .map(|k| f.normal[k] * (from[k] - f.corners[0][k]))
            .sum();
        let up: f64 = (0..3).map(|k| f.normal[k] * direction[k]).sum();
        to.abs() < 1e-9 && up > 0.0
    });
    let (_, face) = own.expect("the ray starts at a polygon");
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    let hit = open
        .geometry()
        .cast(face, from, direction.map(|x| x / length));
    assert_eq!(hit, None, "{error}");
    at
}

#[test]
fn scenes_that_are_good() {
    for (name, surfaces) in closed_scenes() {
        for result in [
            scene_of::<f64>(&surfaces, Enclosure::Closed),
            scene_of::<f64>(&triangulated(&surfaces), Enclosure::Closed),
            scene_of::<f64>(&meshed(&surfaces, 2), Enclosure::Closed),
        ] {
            result.unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
    // Vertices that rounding keeps apart are one.
    let third = 1.0 / 3.0;
    let turned = common::map(&cube(), |p| p.map(|x| (x + third) * 3.0 - 1.0));
    assert!(scene_of::<f64>(&turned, Enclosure::Closed).is_ok());
    let scene = scene_of::<f64>(&cube(), Enclosure::Closed).unwrap();
    assert_eq!(scene.faces_of(2).unwrap(), 2..3);
    assert_eq!(scene.place(4), Some(place(4, 0)));
    assert_eq!(scene.area(5), Ok(1.0));
    assert_eq!(scene.area(6), Err(SceneError::Surface { surface: 6 }));
}

#[test]
fn numbers_that_are_none() {
    let empty = Scene::new::<f64>(&[], Enclosure::Closed).unwrap_err();
    assert_eq!(empty, SceneError::Empty);
    let mut nothing = cube();
    nothing.push(vec![]);
    assert_eq!(refused(&nothing), SceneError::Polygons { surface: 6 });
    for x in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e61] {
        let wrong = with(&[[0.2, 0.2, 0.5], [0.4, 0.2, 0.5], [0.2, x, 0.5]]);
        assert_eq!(refused(&wrong), SceneError::Coordinate(place(6, 0)));
    }
    let tiny = common::map(&cube(), |p| p.map(|x| 1e-61 * x));
    assert_eq!(refused(&tiny), SceneError::Coordinate(place(0, 0)));
    let polygons = cube();
    for (material, error) in [
        (
            Material {
                reflectance: 1.0 + f64::EPSILON,
                ..GREY
            },
            SceneError::Reflectance(place(0, 0)),
        ),
        (
            Material {
                reflectance: -0.1,
                ..GREY
            },
            SceneError::Reflectance(place(0, 0)),
        ),
        (
            Material {
                reflectance: f64::NAN,
                ..GREY
            },
            SceneError::Reflectance(place(0, 0)),
        ),
        (
            Material::grey(-0.1, 300.0),
            SceneError::Reflectance(place(0, 0)),
        ),
        (
            Material::grey(1.1, 300.0),
            SceneError::Reflectance(place(0, 0)),
        ),
        (
            Material {
                emission: f64::NAN,
                ..GREY
            },
            SceneError::Emission(place(0, 0)),
        ),
        (
            Material {
                emission: f64::INFINITY,
                ..GREY
            },
            SceneError::Emission(place(0, 0)),
        ),
        (Material::grey(0.5, -1.0), SceneError::Emission(place(0, 0))),
    ] {
        let surface = Surface {
            polygons: &polygons[0],
            materials: &[material],
        };
        assert_eq!(
            Scene::new::<f64>(&[surface], Enclosure::Open).unwrap_err(),
            error
        );
    }
    // Insulated surfaces reflect all; where all do, and nothing leaves, there is no steady state.
    let insulated = |enclosure| {
        let surfaces = polygons.iter().map(|polygons| Surface {
            polygons,
            materials: &[const { Material::flux(0.0) }],
        });
        Scene::new::<f64>(&surfaces.collect::<Vec<_>>(), enclosure)
    };
    assert!(insulated(Enclosure::Open).is_ok());
    assert_eq!(
        insulated(Enclosure::Closed).unwrap_err(),
        SceneError::NothingAbsorbs
    );
    let surface = Surface {
        polygons: &polygons[0],
        materials: &[GREY, GREY],
    };
    let error = Scene::new::<f64>(&[surface], Enclosure::Open).unwrap_err();
    assert_eq!(error, SceneError::Materials { surface: 0 });
}

#[test]
fn polygons_that_are_none() {
    let degenerate = SceneError::Degenerate(place(6, 0));
    // Two vertices in one place, on a line, thinner than rounding, all in one place.
    for points in [
        [[0.2, 0.2, 0.5], [0.4, 0.2, 0.5], [0.4, 0.2, 0.5]],
        [[0.2, 0.2, 0.5], [0.4, 0.2, 0.5], [0.6, 0.2, 0.5]],
        [[0.2, 0.2, 0.5], [0.4, 0.2, 0.5], [0.3, 0.2 + 1e-13, 0.5]],
        [[0.2, 0.2, 0.5]; 3],
    ] {
        assert_eq!(refused(&with(&points)), degenerate);
    }
    let repeated = [
        [0.2, 0.2, 0.5],
        [0.4, 0.2, 0.5],
        [0.4, 0.4, 0.5],
        [0.4, 0.4, 0.5],
    ];
    assert_eq!(refused(&with(&repeated)), degenerate);
    let bent = [
        [0.2, 0.2, 0.5],
        [0.4, 0.2, 0.5],
        [0.4, 0.4, 0.6],
        [0.2, 0.4, 0.5],
    ];
    let SceneError::NotPlanar { at, by } = refused(&with(&bent)) else {
        panic!("a bent quadrilateral");
    };
    assert_eq!(at, place(6, 0));
    assert!((0.01..0.1).contains(&by), "{by}");
    // Concave, and crossed.
    let concave = [
        [0.2, 0.2, 0.5],
        [0.4, 0.2, 0.5],
        [0.25, 0.25, 0.5],
        [0.2, 0.4, 0.5],
    ];
    assert_eq!(refused(&with(&concave)), SceneError::NotConvex(place(6, 0)));
    let crossed = [
        [0.2, 0.2, 0.5],
        [0.4, 0.4, 0.5],
        [0.4, 0.2, 0.5],
        [0.2, 0.4, 0.5],
    ];
    assert_eq!(refused(&with(&crossed)), SceneError::NotConvex(place(6, 0)));
    // Thin, and thick enough in f64.
    let needle = with(&[[0.2, 0.2, 0.5], [0.8, 0.2, 0.5], [0.5, 0.2 + 1e-10, 0.5]]);
    assert!(scene_of::<f64>(&needle, Enclosure::Open).is_ok());
    let error = scene_of::<f32>(&needle, Enclosure::Open).unwrap_err();
    assert_eq!(error, degenerate);
}

#[test]
fn polygons_on_each_other() {
    let mut twice = cube();
    twice.push(twice[1].clone());
    let both = (place(1, 0), place(6, 0));
    assert_eq!(
        refused(&twice),
        SceneError::Duplicate {
            first: both.0,
            second: both.1
        }
    );
    // Begun at another vertex, and within rounding.
    let Polygon::Quad([a, b, c, d]) = twice[1][0] else {
        panic!("a quadrilateral")
    };
    let near = d.map(|x| x + 1e-14);
    twice[6] = vec![Polygon::Quad([c, near, a, b])];
    assert_eq!(
        refused(&twice),
        SceneError::Duplicate {
            first: both.0,
            second: both.1
        }
    );
    // A part of the ceiling, facing as it does.
    let over = with(&[[0.2, 0.2, 1.0], [0.2, 0.4, 1.0], [0.4, 0.2, 1.0]]);
    assert_eq!(
        refused(&over),
        SceneError::Overlap {
            first: both.0,
            second: both.1
        }
    );
    // One goes through the other: in its middle, or through a wall.
    let plate = |low: f64, high: f64| {
        with(&[
            [0.5, 0.2, low],
            [0.5, 0.4, low],
            [0.5, 0.4, high],
            [0.5, 0.2, high],
        ])
    };
    let SceneError::Crossing { first, second, at } = refused(&plate(0.5, 1.5)) else {
        panic!("a plate through the ceiling");
    };
    assert_eq!((first, second, at[2]), (place(6, 0), place(1, 0), 1.0));
    let mut crossed = plate(0.2, 0.8);
    crossed.push(vec![Polygon::Quad([
        [0.2, 0.3, 0.5],
        [0.8, 0.3, 0.5],
        [0.8, 0.35, 0.5],
        [0.2, 0.35, 0.5],
    ])]);
    let error = scene_of::<f64>(&crossed, Enclosure::Open).unwrap_err();
    assert!(matches!(error, SceneError::Crossing { .. }), "{error}");
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
    let mut short = cube();
    short[1] = vec![Polygon::Quad([
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.99, 1.0, 1.0],
        [0.99, 0.0, 1.0],
    ])];
    leaves(&short);
    let mut moved = cube();
    moved[1] = vec![Polygon::Quad([
        [0.0, 0.0, 1.001],
        [0.0, 1.0, 1.001],
        [1.0, 1.0, 1.001],
        [1.0, 0.0, 1.001],
    ])];
    leaves(&moved);
    let mut ball = sphere(8, 1.0, true);
    ball[0].remove(50);
    leaves(&ball);
}

#[test]
fn scenes_that_are_seen_from_behind() {
    // One face turned, all turned, a plate with one side, a block turned inside out, two rooms in each other.
    let mut flipped = cube();
    flipped[2][0] = shapes::reversed(&flipped[2][0]);
    let SceneError::Flipped { first, second, .. } = refused(&flipped) else {
        panic!("a face that is turned");
    };
    assert!(first == place(2, 0) || second == place(2, 0));
    leaves(&shapes::block([0.0; 3], [1.0; 3]).surfaces);
    let plate = with(&[
        [0.2, 0.2, 0.5],
        [0.4, 0.2, 0.5],
        [0.4, 0.4, 0.5],
        [0.2, 0.4, 0.5],
    ]);
    assert_eq!(leaves(&plate), place(6, 0));
    let mut inside = cube();
    inside.extend(shapes::room([0.2; 3], [0.4; 3]).surfaces);
    leaves(&inside);
    // A block that stands on a floor which is not cut out.
    let mut standing = cube();
    standing.extend(
        shapes::block([0.2, 0.2, 0.0], [0.4; 3])
            .surfaces
            .split_off(1),
    );
    leaves(&standing);
}

#[test]
fn a_vertex_close_to_an_edge_leaves_a_gap() {
    let part = |x: f64, y: f64| {
        let mut all = cube();
        // The floor in three triangles, of which the vertex should be on the edge y = 0.
        let v = [x, y, 0.0];
        let [a, b, c, d] = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        all[0] = [[a, v, d], [v, c, d], [v, b, c]]
            .map(Polygon::Triangle)
            .to_vec();
        all
    };
    assert!(scene_of::<f64>(&part(0.4, 0.0), Enclosure::Closed).is_ok());
    assert!(scene_of::<f64>(&part(0.4, 1e-14), Enclosure::Closed).is_ok());
    let error = refused(&part(0.4, 1e-6));
    let SceneError::TJunction {
        vertex, distance, ..
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!(vertex, [0.4, 1e-6, 0.0]);
    assert!((distance - 1e-6).abs() < 1e-12);
}

#[test]
fn every_error_says_what_and_where() {
    let mut open = cube();
    open.remove(1);
    let text = refused(&open).to_string();
    assert!(text.contains("not closed at surface"), "{text}");
    assert!(text.contains("in direction"), "{text}");
    let twice = SceneError::Duplicate {
        first: place(1, 0),
        second: place(6, 2),
    };
    assert_eq!(
        twice.to_string(),
        "surface 6, polygon 2 is surface 1, polygon 0 once more: remove one of them"
    );
}
