//! No ray leaves a closed room; rays end where the nearest wall is.

use fredholm_core::{Chain, DefaultGenerator, Real, RngUniforms, Uniforms, WalkSeeds};
use fredholm_room::{Enclosure, Grading, Material, Mesh, Scene, Surface, Tables};
use fredholm_tests::room::{Drawing, crowd, scenes, square};

/// Turned, shrunk and moved far away: no vertex that lies on a wall does so exactly.
fn moved(drawing: &Drawing, angle: f64, scale: f64, offset: [f64; 2]) -> Drawing {
    let mut drawing = drawing.clone();
    let (sin, cos) = angle.sin_cos();
    for (points, _) in &mut drawing.surfaces {
        for p in points {
            *p = [
                scale * (cos * p[0] - sin * p[1]) + offset[0],
                scale * (sin * p[0] + cos * p[1]) + offset[1],
            ];
        }
    }
    drawing
}

/// A star of thin baffles and a comb of teeth: many acute corners and walls that meet.
fn spiky() -> Drawing {
    let mut drawing = square();
    for k in 0..7 {
        let angle = 0.3 + k as f64;
        let tip = [0.5 + 0.2 * angle.cos(), 0.5 + 0.2 * angle.sin()];
        drawing = drawing.baffle([0.5, 0.5], tip, 0.5);
    }
    for k in 1..9 {
        let x = 0.1 * f64::from(k) + 1.0 / 3.0e3;
        drawing = drawing.baffle([x, 0.0], [x + 0.03, 0.2], 0.5);
        drawing = drawing.baffle([1.0, x], [0.97, x - 0.07], 0.5);
    }
    drawing.named("spiky")
}

fn tables<F: Real>(drawing: &Drawing) -> Tables<F> {
    let scene = drawing
        .scene::<F>()
        .unwrap_or_else(|e| panic!("{}: {e}", drawing.name));
    let mesh = Mesh::new::<F>(&scene, 1, Grading::default()).unwrap();
    Tables::new(&scene, &mesh)
}

/// Walks without absorption, and rays from the ends of walls, from points near them and towards
/// vertices. Returns how many.
fn rays<F: Real>(drawing: &Drawing, steps: u64) -> u64 {
    let tables = tables::<F>(drawing);
    let room = tables.room();
    let walls = room.geometry().walls();
    let mut uniforms = RngUniforms(WalkSeeds::<DefaultGenerator>::new(1, 0).generator(0));
    let lost = |what: &str, x: [F; 2]| -> ! {
        panic!("{}, {what}: a ray from {x:?} is lost", drawing.name)
    };
    let mut x = room.on_wall(0, 0.4).unwrap();
    for _ in 0..steps {
        let from = x.position();
        x = room
            .step(&x, &mut uniforms)
            .unwrap_or_else(|| lost("a walk", from));
    }
    let mut count = steps;
    while count < 2 * steps {
        for w in 0..walls.len() {
            let t: F = uniforms.uniform();
            let near = t.to_f64().powi(12);
            for t in [0.0, 1.0, 0.5, near, 1.0 - near, t.to_f64()] {
                let x = room.on_wall(w, t).unwrap();
                room.step(&x, &mut uniforms)
                    .unwrap_or_else(|| lost("from an end", x.position()));
                // Towards a vertex in front of the wall.
                let xi: F = uniforms.uniform();
                let target = (xi * F::from_u32(walls.len() as u32)).to_u32();
                let to = walls[target as usize].ends[0];
                let d = [0, 1].map(|k| to[k] - x.position()[k]);
                let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
                let [tx, ty] = walls[w].tangent;
                let height = tx * d[1] - ty * d[0];
                if height > F::from_f64(1e-3) {
                    let d = d.map(|d| d / length);
                    room.geometry()
                        .cast(w as u32, x.position(), d)
                        .unwrap_or_else(|| lost("towards a vertex", x.position()));
                    count += 1;
                }
                count += 1;
            }
        }
    }
    count
}

/// A million rays; with FREDHOLM_LONG in the environment a hundred million, or as many as it says.
#[test]
fn no_ray_leaves_a_closed_room() {
    let total: u64 = match std::env::var("FREDHOLM_LONG") {
        Ok(long) => long.parse().unwrap_or(0).max(100_000_000),
        Err(_) => 1_000_000,
    };
    let mut drawings = Vec::new();
    for drawing in scenes().into_iter().chain([spiky()]) {
        drawings.push(moved(&drawing, 1.0, 1.0 / 3.0, [10.0 / 3.0, -7.7]));
        drawings.push(moved(&drawing, 0.123, 1e-3, [0.0, 0.1]));
        drawings.push(drawing);
    }
    let share = total / (4 * drawings.len() as u64);
    let mut count = 0;
    for drawing in &drawings {
        count += rays::<f64>(drawing, share) + rays::<f32>(drawing, share);
    }
    println!("{count} rays, none lost");
    assert!(count >= total);
}

/// The nearest active side, by asking every wall with the plainest arithmetic.
#[test]
fn the_hierarchy_finds_what_a_search_of_all_walls_finds() {
    for drawing in scenes().into_iter().chain([spiky(), crowd(3000)]) {
        let tables = tables::<f64>(&drawing);
        let geometry = tables.geometry();
        let room = tables.room();
        let mut uniforms = RngUniforms(WalkSeeds::<DefaultGenerator>::new(2, 0).generator(0));
        let mut draw = || -> f64 { uniforms.uniform() };
        for _ in 0..3_000 {
            let w = (draw() * geometry.walls().len() as f64) as usize;
            let x = room.on_wall(w, draw()).unwrap().position();
            let wall = geometry.walls()[w];
            let angle = core::f64::consts::PI * draw();
            let (sin, cos) = angle.sin_cos();
            let [tx, ty] = wall.tangent;
            let d = [cos * tx - sin * ty, cos * ty + sin * tx];
            let mut best = (f64::INFINITY, usize::MAX);
            for (other, wall) in geometry.walls().iter().enumerate() {
                let [a, b] = wall.ends;
                let e = [b[0] - a[0], b[1] - a[1]];
                let o = [a[0] - x[0], a[1] - x[1]];
                // x + s d = a + t e.
                let det = d[0] * e[1] - d[1] * e[0];
                let s = (o[0] * e[1] - o[1] * e[0]) / det;
                let t = (o[0] * d[1] - o[1] * d[0]) / det;
                if other != w && det > 0.0 && s > 1e-12 && (0.0..=1.0).contains(&t) && s < best.0 {
                    best = (s, other);
                }
            }
            let hit = geometry.cast(w as u32, x, d).expect("a closed room");
            assert!(
                (hit.distance - best.0).abs() < 1e-9,
                "{}: {hit:?} {best:?}",
                drawing.name
            );
        }
    }
}

#[test]
fn light_leaves_an_open_room_and_stops_at_backs() {
    let material = [Material {
        reflectance: 0.5,
        emission: 1.0,
    }];
    let surface = |points| Surface {
        points,
        materials: &material,
    };
    // A floor, above it a short ceiling seen from its front, and beside that one seen from behind.
    let scene = Scene::new::<f64>(
        &[
            surface(&[[0.0, 0.0], [3.0, 0.0]]),
            surface(&[[1.0, 1.0], [0.0, 1.0]]),
            surface(&[[2.0, 1.0], [3.0, 1.0]]),
        ],
        Enclosure::Open,
    )
    .unwrap();
    let mesh = Mesh::new::<f64>(&scene, 9, Grading::default()).unwrap();
    let tables = Tables::<f64>::new(&scene, &mesh);
    let up = |x: f64| tables.geometry().cast(0, [x, 0.0], [0.0, 1.0]);
    assert_eq!(up(0.5).map(|hit| hit.wall), Some(1));
    assert_eq!(up(1.5), None);
    assert_eq!(up(2.5), None);
}
