//! What scenes are refused, and why; and that no input makes the checks panic or hang.

use fredholm_room::{
    Enclosure, Grading, Material, Matrix, Mesh, Place, RoomError, Scene, Surface, Tables,
};
use fredholm_tests::room::{Drawing, block, facet, l_room, scenes, square};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const GREY: Material = Material {
    reflectance: 0.5,
    emission: 1.0,
};

fn place(surface: usize, vertex: usize) -> Place {
    Place { surface, vertex }
}

fn refused(drawing: &Drawing) -> RoomError {
    drawing.scene::<f64>().expect_err(drawing.name)
}

/// The unit square as one outline.
fn outline() -> Drawing {
    Drawing::new("outline").closed(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 0.5, 1.0)
}

#[test]
fn scenes_that_are_good() {
    for drawing in scenes() {
        drawing.scene::<f64>().unwrap();
        drawing.scene::<f32>().unwrap();
    }
    // A wall that ends on another is a vertex of it: three pieces of the floor, one of the baffle.
    let scene = outline()
        .baffle([0.25, 0.0], [0.25, 0.5], 0.5)
        .baffle([0.75, 0.0], [0.75, 0.5], 0.5)
        .scene::<f64>()
        .unwrap();
    assert_eq!(scene.walls_of(0).unwrap(), 0..6);
    assert_eq!(scene.place(2), Some(place(0, 0)));
    assert_eq!(scene.place(3), Some(place(0, 1)));
    assert_eq!(scene.along(0, 0.125).unwrap(), (1, 0.5));
    assert_eq!(scene.along(0, 1.0).unwrap(), (5, 1.0));
    assert_eq!(scene.along(0, 1.1), Err(RoomError::Fraction));
    assert_eq!(scene.along(9, 0.1), Err(RoomError::Surface { surface: 9 }));
    // Vertices that rounding keeps apart are one.
    let third = 1.0 / 3.0;
    let scene = outline()
        .baffle([third * 0.3, 0.0 + 1e-15], [0.3 * third + 1e-16, 0.5], 0.5)
        .scene::<f64>()
        .unwrap();
    assert_eq!(scene.walls_of(0).unwrap().len(), 5);
}

#[test]
fn numbers_that_are_none() {
    assert_eq!(
        Scene::new::<f64>(&[], Enclosure::Closed).unwrap_err(),
        RoomError::Empty
    );
    for x in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e101] {
        let drawing = outline().line(&[[0.2, 0.2], [x, 0.4]], 0.5, 1.0);
        assert_eq!(refused(&drawing), RoomError::Coordinate(place(1, 1)));
    }
    let tiny = Drawing::new("tiny").line(&[[0.0, 0.0], [1e-101, 0.0]], 0.5, 0.0);
    assert_eq!(refused(&tiny), RoomError::Coordinate(place(0, 0)));
    for reflectance in [-0.1, 1.0 + f64::EPSILON, 2.0, f64::NAN] {
        let drawing = square().line(&[[0.2, 0.2], [0.4, 0.4]], reflectance, 1.0);
        assert_eq!(refused(&drawing), RoomError::Reflectance(place(4, 0)));
    }
    // Below 1 in f64 and not in f32.
    let bright = outline().with(|_| Material {
        reflectance: 1.0 - 1e-12,
        emission: 0.0,
    });
    assert!(bright.scene::<f64>().is_ok());
    assert_eq!(
        bright.scene::<f32>().unwrap_err(),
        RoomError::NothingAbsorbs(place(0, 0))
    );
    for (emissivity, temperature, error) in [
        (0.0, 300.0, RoomError::NothingAbsorbs(place(0, 0))),
        (-0.1, 300.0, RoomError::Reflectance(place(0, 0))),
        (1.1, 300.0, RoomError::Reflectance(place(0, 0))),
        (f64::NAN, 300.0, RoomError::Reflectance(place(0, 0))),
        (0.5, -1.0, RoomError::Emission(place(0, 0))),
        (0.5, f64::NAN, RoomError::Emission(place(0, 0))),
        (0.5, 1e80, RoomError::Emission(place(0, 0))),
    ] {
        let drawing = outline().with(|_| Material::grey(emissivity, temperature));
        assert_eq!(refused(&drawing), error);
    }
}

#[test]
fn every_part_of_a_room_absorbs() {
    let all_flux = |drawing: Drawing| drawing.with(|_| Material::flux(0.0));
    let none = |surface| Some(RoomError::NothingAbsorbs(place(surface, 0)));
    let found = |drawing: &Drawing| drawing.scene::<f64>().err();
    assert_eq!(found(&all_flux(l_room())), none(0));
    // One wall is enough, an obstacle's too.
    let except = |drawing: &Drawing, one: usize| {
        let drawing = drawing.clone();
        drawing.with(|s| Material::grey(if s == one { 0.1 } else { 0.0 }, 300.0))
    };
    for one in 0..4 {
        assert_eq!(found(&except(&square(), one)), None);
    }
    assert_eq!(found(&except(&block(), 5)), None);
    // Both sides of a screen are in the one room.
    let screen = square().baffle([0.2, 0.2], [0.4, 0.7], 0.5);
    assert_eq!(found(&except(&screen, 4)), None);
    assert_eq!(found(&except(&screen, 5)), None);
    // A wall across it makes two rooms: surfaces 0 and 2 are in both.
    let two = square().baffle([0.4, 0.0], [0.4, 1.0], 0.5);
    assert_eq!(found(&except(&two, 0)), None);
    assert_eq!(found(&except(&two, 1)), none(0));
    assert_eq!(found(&except(&two, 3)), none(0));
    // A room within an obstacle sees nothing of what is around.
    let inner = [[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6], [0.4, 0.4]];
    let nested = block().line(&inner, 0.5, 0.0);
    assert_eq!(
        found(&nested.clone().with(|_| Material::grey(0.5, 1.0))),
        None
    );
    assert_eq!(found(&except(&nested, 0)), none(8));
    assert_eq!(found(&except(&nested, 8)), none(0));
    // Where light leaves, that is enough.
    let mut open = all_flux(square());
    open.open = true;
    assert_eq!(found(&open), None);
}

#[test]
fn polylines_that_are_none() {
    let line = |points: &[[f64; 2]]| outline().line(points, 0.5, 1.0);
    assert_eq!(refused(&line(&[])), RoomError::Vertices { surface: 1 });
    assert_eq!(
        refused(&line(&[[0.5, 0.5]])),
        RoomError::Vertices { surface: 1 }
    );
    let points = [[0.2, 0.2], [0.3, 0.2], [0.3, 0.2], [0.3, 0.3]];
    assert_eq!(refused(&line(&points)), RoomError::ZeroLength(place(1, 1)));
    let near = [[0.2, 0.2], [0.2 + 1e-14, 0.2]];
    assert_eq!(refused(&line(&near)), RoomError::ZeroLength(place(1, 0)));
    for count in [0, 2, 5] {
        let mut drawing = outline();
        drawing.surfaces[0].1 = vec![GREY; count];
        assert_eq!(refused(&drawing), RoomError::Materials { surface: 0 });
    }
    let mut drawing = outline();
    drawing.surfaces[0].1 = vec![GREY; 4];
    assert!(drawing.scene::<f64>().is_ok());
}

#[test]
fn walls_that_cross_or_lie_on_each_other() {
    let crossed = outline()
        .baffle([0.2, 0.2], [0.8, 0.8], 0.5)
        .baffle([0.2, 0.8], [0.8, 0.2], 0.5);
    let RoomError::Crossing { first, second } = refused(&crossed) else {
        panic!("no crossing")
    };
    assert!(first.surface < second.surface && second.surface >= 3 && first.surface >= 1);
    // A bow tie.
    let tie =
        Drawing::new("tie").closed(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], 0.5, 1.0);
    assert_eq!(
        refused(&tie),
        RoomError::Crossing {
            first: place(0, 0),
            second: place(0, 2)
        }
    );
    let twice = outline().line(&[[1.0, 0.0], [1.0, 0.5]], 0.5, 1.0);
    assert_eq!(
        refused(&twice),
        RoomError::Overlap {
            first: place(0, 1),
            second: place(1, 0)
        }
    );
}

/// The way out is one: from a wall, and nothing or a back is in the way.
fn check_way_out(drawing: &Drawing, expected: &[usize]) {
    let error = refused(drawing);
    let RoomError::Open {
        at,
        from,
        direction,
    } = error
    else {
        panic!("{}: {error}", drawing.name)
    };
    assert!(expected.contains(&at.surface), "{}: {error}", drawing.name);
    assert!(direction.iter().any(|d| *d != 0.0), "{error}");
    // By the plainest arithmetic.
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let (mut nearest, mut front) = (f64::INFINITY, false);
    for (points, _) in &drawing.surfaces {
        for pair in points.windows(2) {
            let e = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
            let o = [pair[0][0] - from[0], pair[0][1] - from[1]];
            let det = cross(direction, e);
            let (s, t) = (cross(o, e) / det, cross(o, direction) / det);
            if s > 1e-9 && (0.0..=1.0).contains(&t) && s < nearest - 1e-9 {
                (nearest, front) = (s, det > 0.0);
            } else if (s - nearest).abs() < 1e-9 && (0.0..=1.0).contains(&t) {
                front |= det > 0.0;
            }
        }
    }
    assert!(!front, "{}: {error}, {nearest}", drawing.name);
}

#[test]
fn rooms_that_are_open() {
    // Without its right wall.
    let mut open = square().named("three walls");
    open.surfaces.remove(1);
    check_way_out(&open, &[0, 1]);
    // A gap of 10⁻⁶.
    let mut gap = square().named("gap");
    gap.surfaces[1].0[1][1] -= 1e-6;
    check_way_out(&gap, &[1, 2]);
    // A wall the wrong way round.
    let mut turned = square().named("turned");
    turned.surfaces[2].0.reverse();
    check_way_out(&turned, &[1, 2, 3]);
    // All of them: seen from outside.
    let mut inside_out = l_room().named("inside out");
    inside_out.surfaces.iter_mut().for_each(|s| s.0.reverse());
    check_way_out(&inside_out, &[0, 1, 2, 3, 4, 5]);
    // A baffle that has one side only.
    let one = square()
        .line(&[[0.3, 0.3], [0.6, 0.7]], 0.5, 0.0)
        .named("one side");
    check_way_out(&one, &[4]);
    // An obstacle that is active inside.
    let points = [[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]];
    check_way_out(&square().closed(&points, 0.5, 0.0).named("hollow"), &[4]);
    // The same as a room in a wall.
    let mut around = points.to_vec();
    around.reverse();
    let room = square().closed(&points, 0.5, 0.0).closed(&around, 0.5, 0.0);
    room.scene::<f64>().unwrap();
    // An obstacle outside.
    let far = points.map(|[x, y]| [x + 5.0, y]);
    let mut far = far.to_vec();
    far.reverse();
    check_way_out(&square().closed(&far, 0.5, 0.0).named("outside"), &[4]);
    // All are right where they are said to be open.
    for drawing in [open, gap, turned, inside_out, one] {
        let drawing = Drawing {
            open: true,
            ..drawing
        };
        drawing.scene::<f64>().unwrap();
    }
}

#[test]
fn meshes_and_matrices_that_are_none() {
    let scene = square().scene::<f64>().unwrap();
    let mesh = |cells, exponent| {
        let grading = Grading {
            exponent,
            shadows: false,
        };
        Mesh::new::<f64>(&scene, cells, grading)
    };
    assert_eq!(mesh(0, 3.0).unwrap_err(), RoomError::Cells);
    assert_eq!(mesh(usize::MAX, 3.0).unwrap_err(), RoomError::Cells);
    for exponent in [0.9, f64::NAN, 11.0] {
        assert_eq!(mesh(9, exponent).unwrap_err(), RoomError::Grading);
    }
    let mesh = mesh(9, 3.0).unwrap();
    let tables = Tables::<f64>::new(&scene, &mesh);
    let matrix = Matrix::new::<1>(&tables.room()).unwrap();
    let other = Mesh::new::<f64>(&scene, 20, Grading::default()).unwrap();
    let other = Tables::<f64>::new(&scene, &other);
    let refused = matrix.solve(&other.room());
    assert!(matches!(refused, Err(RoomError::Length { .. })));
}

/// Cells are graded as they should be, and cut at shadows where that is asked for.
#[test]
fn cells_lie_where_they_should() {
    let scene = l_room().scene::<f64>().unwrap();
    let cubic = Grading {
        exponent: 3.0,
        shadows: false,
    };
    let mesh = Mesh::new::<f64>(&scene, 120, cubic).unwrap();
    let cells = mesh.cells();
    assert!((110..=130).contains(&mesh.len()), "{}", mesh.len());
    let ends = |wall: u32| -> Vec<f64> {
        let mut sum = 0.0;
        cells
            .range(wall)
            .map(|c| {
                sum += cells.length(c);
                sum
            })
            .collect()
    };
    // The floor has corners at both ends: its first half is (i/15)³ of 1.5.
    let floor = ends(0);
    assert_eq!(floor.len(), 30);
    for (i, end) in floor.iter().take(15).enumerate() {
        let expected = 1.5 * ((i + 1) as f64 / 15.0).powi(3);
        assert!((end - expected).abs() < 1e-14, "{i}: {end} {expected}");
    }
    // The inner horizontal wall sees a corner at its first end and a convex edge at its second.
    let inner = ends(2);
    assert_eq!(inner.len(), 20);
    for (i, end) in inner.iter().enumerate() {
        let expected = 2.0 * ((i + 1) as f64 / 20.0).powi(3);
        assert!((end - expected).abs() < 1e-14, "{i}: {end} {expected}");
    }
    // Edges of shadows: the inner vertex throws that of the lamp's far end, the floor's, on the
    // left wall.
    let shadows = Grading {
        exponent: 1.0,
        shadows: true,
    };
    let plain = Mesh::new::<f64>(&scene, 12, shadows).unwrap();
    let equal = Grading {
        shadows: false,
        ..shadows
    };
    assert_eq!(
        plain.len(),
        Mesh::new::<f64>(&scene, 12, equal).unwrap().len() + 1
    );
    // 0, 1, 1.5, 2 and 3 are the ends of its cells.
    let second = plain.cells().range(5).start + 1;
    assert!((plain.cells().length(second) - 0.5).abs() < 1e-14);
    // In the block's square the ends of the right wall throw four, past three corners of the block;
    // the block's own right side shines as well, and its ends throw four along the block's sides.
    let scene = block().scene::<f64>().unwrap();
    let cut = Mesh::new::<f64>(&scene, 8, shadows).unwrap();
    let walls: Vec<usize> = (0..8).map(|w| cut.cells().range(w).len()).collect();
    assert_eq!(walls, [3, 1, 3, 5, 1, 1, 1, 1]);
    for (c, end) in [(0, 2.0 / 3.0), (1, 1.0 / 12.0), (2, 0.25)] {
        assert!((cut.cells().length(c) - end).abs() < 1e-14);
    }
    facet().scene::<f64>().unwrap();
}

/// Coordinates that meet, touch, repeat and overflow.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => (0..6_i32).prop_map(f64::from),
        2 => (0..6_i32).prop_map(|x| f64::from(x) / 3.0),
        2 => -1.0..6.0_f64,
        1 => prop_oneof![
            Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(1e-300), Just(5e-324),
            Just(1e99), Just(-0.0), Just(1.0 + 1e-13), Just(1.0 + 1e-12),
        ],
    ]
}

fn surfaces() -> impl Strategy<Value = Vec<Vec<[f64; 2]>>> {
    let point = [coordinate(), coordinate()];
    prop::collection::vec(prop::collection::vec(point, 0..8), 0..12)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: if fredholm_tests::check::long() { 400 } else { 40 },
        rng_seed: RngSeed::Fixed(1),
        ..Default::default()
    })]

    /// Whatever is drawn, a scene or an error comes, and the scene solves.
    #[test]
    fn nothing_panics_or_hangs(surfaces in surfaces(), open in any::<bool>()) {
        let material = [GREY];
        let surfaces: Vec<Surface<'_>> = surfaces
            .iter()
            .map(|points| Surface { points, materials: &material })
            .collect();
        let enclosure = if open { Enclosure::Open } else { Enclosure::Closed };
        match Scene::new::<f64>(&surfaces, enclosure) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok(scene) => {
                let grading = Grading { exponent: 2.0, shadows: true };
                let mesh = Mesh::new::<f64>(&scene, 30, grading).unwrap();
                let tables = Tables::<f64>::new(&scene, &mesh);
                let room = tables.room();
                let solution = Matrix::new::<1>(&room).unwrap().solve(&room).unwrap();
                prop_assert!(solution.v.iter().all(|v| v.is_finite()));
                let factors = fredholm_factors::room_factors(&scene).unwrap();
                prop_assert!(factors.iter().all(|f| (-1e-9..1.0 + 1e-9).contains(f)));
            }
        }
        drop(Scene::new::<f32>(&surfaces, enclosure));
    }

    /// A square that is cut into pieces at random stays closed, and its rows sum to 1.
    #[test]
    fn a_square_in_pieces_is_closed(
        cuts in prop::collection::vec(0.001..0.999_f64, 0..20),
        angle in 0.0..6.3_f64,
        offset in -100.0..100.0_f64,
    ) {
        let mut cuts = cuts;
        cuts.extend([0.0, 1.0]);
        cuts.sort_by(f64::total_cmp);
        let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let (sin, cos) = angle.sin_cos();
        let turn = |[x, y]: [f64; 2]| [cos * x - sin * y + offset, sin * x + cos * y];
        let mut drawing = Drawing::new("pieces");
        for side in corner.windows(2) {
            let at = |t: f64| {
                turn([0, 1].map(|k| side[0][k] + t * (side[1][k] - side[0][k])))
            };
            for pair in cuts.windows(2) {
                if pair[1] - pair[0] > 1e-9 {
                    drawing = drawing.line(&[at(pair[0]), at(pair[1])], 0.5, 1.0);
                }
            }
        }
        if let Ok(scene) = drawing.scene::<f64>() {
            // Corners are rounded to ε of up to 102 at both ends of a piece, which turns it by this much.
            let pieces = cuts.windows(2).map(|pair| pair[1] - pair[0]);
            let shortest = pieces.filter(|&length| length > 1e-9).fold(1.0, f64::min);
            let bound = 1e-11 + 2.0 * 102.0 * f64::EPSILON / shortest;
            let factors = fredholm_factors::room_factors(&scene).unwrap();
            for row in factors.chunks(scene.surfaces()) {
                let off = row.iter().sum::<f64>() - 1.0;
                prop_assert!(off.abs() < bound, "{off:e} of {bound:e}");
            }
        } else {
            // Only a cut that was left out, nearer than 10⁻⁹ to its neighbour, opens it.
            prop_assert!(cuts.windows(2).any(|pair| pair[1] - pair[0] <= 1e-9));
        }
    }
}
