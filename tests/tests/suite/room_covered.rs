//! Obstacles that stand on walls: what they cover is left out.

use fredholm_core::{RngUniforms, Uniforms, WalkSeeds};
use fredholm_factors::room_factors;
use fredholm_room::{RoomError, Scene, Wall};
use fredholm_tests::room::Drawing;

type Point = [f64; 2];

/// A room of 5 by 4 whose walls are surfaces 0 to 3.
fn room() -> Drawing {
    let corners = [[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
    let walls = corners.windows(2);
    walls.fold(Drawing::new("room"), |room, wall| room.line(wall, 0.5, 1.0))
}

/// The walls of a scene, in an order of their own.
fn walls(scene: &Scene) -> Vec<[Point; 2]> {
    let ends = |wall: &Wall<f64>| wall.ends;
    let mut all: Vec<_> = scene.geometry().walls().iter().map(ends).collect();
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    all
}

/// Asserts that a drawing comes to the walls of another, and that so many parts are covered, by these surfaces.
fn assert_same(drawing: &Drawing, by_hand: &Drawing, covered: &[[usize; 2]]) {
    for open in [false, true] {
        let own = |drawing: &Drawing| {
            let mut drawing = drawing.clone();
            drawing.open = open;
            drawing.scene::<f64>().unwrap()
        };
        let (scene, expected) = (own(drawing), own(by_hand));
        assert_eq!(walls(&scene), walls(&expected), "open: {open}");
        let parts = scene.covered().iter();
        let parts: Vec<_> = parts.map(|part| [part.place.surface, part.by]).collect();
        assert_eq!(parts, covered, "open: {open}");
        assert_eq!(expected.covered(), []);
    }
}

/// A box on the floor: its feet, and its sides.
fn feet(from: f64, to: f64, height: f64) -> Vec<Point> {
    vec![[from, 0.0], [from, height], [to, height], [to, 0.0]]
}

#[test]
fn a_box_on_the_floor() {
    let points = feet(1.0, 2.0, 1.0);
    let by_hand = |points: &[Point]| {
        let mut room = room();
        room.surfaces[0].0 = vec![[0.0, 0.0], [1.0, 0.0]];
        room.line(&[[2.0, 0.0], [5.0, 0.0]], 0.5, 1.0)
            .line(points, 0.7, 0.0)
    };
    let open = room().line(&points, 0.7, 0.0);
    assert_same(&open, &by_hand(&points), &[[0, 4]]);
    let closed = room().closed(&points, 0.7, 0.0);
    assert_same(&closed, &by_hand(&points), &[[0, 4], [4, 0]]);
    let scene = closed.scene::<f64>().unwrap();
    let part = scene.covered()[0];
    assert_eq!(part.ends, [[1.0, 0.0], [2.0, 0.0]]);
    assert_eq!((scene.length(0), scene.length(4)), (Ok(4.0), Ok(3.0)));
    // Places along the floor do not count what is covered.
    assert_eq!(scene.along(0, 0.5), Ok((1, 1.0 / 3.0)));
    // On two pieces of floor, at whose joint it stands, and next to another box.
    let mut two = closed.clone();
    two.surfaces[0].0 = vec![[0.0, 0.0], [1.5, 0.0], [5.0, 0.0]];
    assert_same(&two, &by_hand(&points), &[[0, 4], [0, 4], [4, 0], [4, 0]]);
    let mut next = by_hand(&points);
    next.surfaces[4].0[0] = [3.0, 0.0];
    next.surfaces[5].0 = feet(1.0, 2.0, 1.0)[..3].to_vec();
    let next = next.line(&[[2.0, 1.0], [2.0, 2.0], [3.0, 2.0], [3.0, 0.0]], 0.7, 0.0);
    let pair = room()
        .closed(&points, 0.7, 0.0)
        .closed(&feet(2.0, 3.0, 2.0), 0.7, 0.0);
    let covered = [[0, 4], [0, 5], [4, 5], [4, 0], [5, 4], [5, 0]];
    assert_same(&pair, &next, &covered);
}

#[test]
fn boxes_in_corners_and_on_each_other() {
    // Clockwise, and closed: on two walls.
    let corner = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let mut by_hand = room();
    by_hand.surfaces[0].0[0] = [1.0, 0.0];
    by_hand.surfaces[3].0[1] = [0.0, 1.0];
    let by_hand = by_hand.line(&corner[1..], 0.7, 0.0);
    let drawing = room().closed(&corner, 0.7, 0.0);
    assert_same(&drawing, &by_hand, &[[0, 4], [3, 4], [4, 3], [4, 0]]);
    // Only what is seen of it.
    let drawing = room().line(&corner[1..], 0.7, 0.0);
    assert_same(&drawing, &by_hand, &[[0, 4], [3, 4]]);
    // A smaller one on top of it, in the same corner, and one whose feet are on it.
    let top = [[0.0, 1.0], [0.0, 1.5], [0.5, 1.5], [0.5, 1.0]];
    let drawing = drawing.line(&top, 0.7, 0.0);
    let mut stacked = by_hand.clone();
    stacked.surfaces[3].0[1] = [0.0, 1.5];
    stacked.surfaces[4].0 = vec![[0.5, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let stacked = stacked.line(&top[1..], 0.7, 0.0);
    let scene = drawing.scene::<f64>().unwrap();
    assert_eq!(walls(&scene), walls(&stacked.scene::<f64>().unwrap()));
}

#[test]
fn a_cupboard_as_long_as_the_wall() {
    // It covers the floor, and a part of the walls at its ends.
    let cupboard = [[0.0, 0.0], [0.0, 1.0], [5.0, 1.0], [5.0, 0.0]];
    let drawing = room().closed(&cupboard, 0.7, 0.0);
    let scene = drawing.scene::<f64>().unwrap();
    let found = walls(&scene);
    assert_eq!(found.len(), 4);
    assert!(found.contains(&[[0.0, 1.0], [5.0, 1.0]]));
    assert_eq!(scene.walls_of(0), Ok(0..0));
    // And not −0, the sum of nothing.
    assert_eq!(scene.length(0).map(f64::to_bits), Ok(0));
    assert_eq!(scene.along(0, 0.5), Err(RoomError::Surface { surface: 0 }));
    let table = room_factors(&scene).unwrap();
    for (s, row) in table.chunks_exact(5).enumerate() {
        let sum: f64 = row.iter().sum();
        let expected = if s == 0 { 0.0 } else { 1.0 };
        assert!((sum - expected).abs() < 1e-12, "{s}: {row:?}");
    }
    // Feet at the ends of a piece of floor.
    let mut pieces = room();
    pieces.surfaces[0].0 = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [5.0, 0.0]];
    let scene = pieces
        .line(&feet(1.0, 2.0, 1.0), 0.7, 0.0)
        .scene::<f64>()
        .unwrap();
    assert_eq!(scene.covered().len(), 1);
    assert_eq!(scene.length(0), Ok(4.0));
}

#[test]
fn mistakes_are_no_obstacles() {
    let refused = |drawing: &Drawing| {
        let error = drawing.scene::<f64>().unwrap_err();
        assert!(matches!(error, RoomError::Open { .. }), "{error}");
    };
    // Walls whose active side is outside.
    for wall in 0..4 {
        let mut drawing = room();
        drawing.surfaces[wall].0.reverse();
        refused(&drawing);
        drawing.surfaces[(wall + 1) % 4].0.reverse();
        refused(&drawing);
    }
    let mut triangle = Drawing::new("triangle")
        .line(&[[0.0, 0.0], [1.0, 0.0]], 0.5, 1.0)
        .line(&[[0.0, 1.0], [1.0, 0.0]], 0.5, 1.0)
        .line(&[[0.0, 0.0], [0.0, 1.0]], 0.5, 1.0);
    refused(&triangle);
    triangle.open = true;
    assert_eq!(triangle.scene::<f64>().unwrap().covered(), []);
    // A screen across the room with one side.
    refused(&room().line(&[[2.0, 0.0], [2.0, 4.0]], 0.5, 1.0));
    // A box whose active side is inside.
    let mut points = feet(1.0, 2.0, 1.0);
    points.reverse();
    refused(&room().line(&points, 0.5, 1.0));
    // A gap.
    let mut gap = room().closed(&feet(1.0, 2.0, 1.0), 0.5, 1.0);
    gap.surfaces[2].0[1] = [0.001, 4.0];
    refused(&gap);
    // Thin walls are none, whatever stands on them: the room behind keeps its side.
    let drawing = room().baffle([0.0, 2.0], [5.0, 2.0], 0.5).line(
        &[[1.0, 2.0], [1.0, 3.0], [2.0, 3.0], [2.0, 2.0]],
        0.5,
        1.0,
    );
    let scene = drawing.scene::<f64>().unwrap();
    let covered: Vec<_> = scene
        .covered()
        .iter()
        .map(|part| part.place.surface)
        .collect();
    assert_eq!(covered, [4]);
    assert_eq!((scene.length(4), scene.length(5)), (Ok(4.0), Ok(5.0)));
}

#[test]
fn boxes_on_walls_in_any_direction() {
    let mut draws = RngUniforms(<WalkSeeds>::new(7, 0).generator(0));
    let mut uniform = move || Uniforms::<f64>::uniform(&mut draws);
    for round in 0..200 {
        // A polygon inscribed in a circle, anywhere and of any size.
        let sides = 3 + (uniform() * 6.0) as usize;
        let (start, size) = (uniform(), 10.0_f64.powf(6.0 * uniform() - 3.0));
        let centre = [uniform(), uniform()].map(|x| 20.0 * size * (x - 0.5));
        let corner = |k: usize| {
            let angle = core::f64::consts::TAU * (start + (k % sides) as f64 / sides as f64);
            [
                centre[0] + size * angle.cos(),
                centre[1] + size * angle.sin(),
            ]
        };
        let mut drawing = Drawing::new("polygon");
        for k in 0..sides {
            drawing = drawing.line(&[corner(k), corner(k + 1)], 0.5, 1.0);
        }
        // Boxes on half of the walls, some two next to each other, too flat to meet those of others.
        let (mut length, mut boxes, mut expected) = (0.0, 0, 0);
        for k in 0..sides {
            let [[ax, ay], [bx, by]] = [corner(k), corner(k + 1)];
            let side = (bx - ax).hypot(by - ay);
            length += side;
            let at = |t: f64, h: f64| {
                [
                    ax + t * (bx - ax) - h * (by - ay),
                    ay + t * (by - ay) + h * (bx - ax),
                ]
            };
            let (mut from, to) = (0.3 + 0.1 * uniform(), 0.5 + 0.2 * uniform());
            let middle = 0.5 * (from + to);
            for end in [middle, to] {
                if uniform() < 0.5 {
                    let height = 0.02 + 0.08 * uniform();
                    let points = [
                        at(from, 0.0),
                        at(from, height),
                        at(end, height),
                        at(end, 0.0),
                    ];
                    let is_closed = uniform() < 0.5;
                    drawing = if is_closed {
                        drawing.closed(&points, 0.7, 0.0)
                    } else {
                        drawing.line(&points, 0.7, 0.0)
                    };
                    boxes += 1;
                    expected += 1 + usize::from(is_closed);
                    length += 2.0 * height * side;
                }
                from = end;
            }
        }
        let scene = drawing.scene::<f64>();
        let scene = scene.unwrap_or_else(|error| panic!("{round}: {error}\n{drawing:?}"));
        let surfaces = scene.surfaces();
        assert!(scene.covered().len() >= expected, "{round}: {boxes} boxes");
        // Boxes side by side cover each other, by twice the height of the lower one.
        let all: f64 = (0..surfaces).map(|s| scene.length(s).unwrap()).sum();
        assert!(all <= length * (1.0 + 1e-9), "{round}: {all} of {length}");
        let table = room_factors(&scene).unwrap();
        for row in table.chunks_exact(surfaces) {
            let sum: f64 = row.iter().sum();
            assert!((sum - 1.0).abs() < 1e-9, "{round}: {row:?}");
        }
        assert!(drawing.scene::<f32>().is_ok(), "{round}, in f32");
    }
}
