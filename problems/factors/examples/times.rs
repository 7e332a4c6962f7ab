//! Seconds of form factors: `times cube M E` for the unit cube of 6 M² squares with a centred block of 6 (M/2)², `times
//! canyon N E T` for a street canyon whose squares are 1/N of a storey wide, on T threads; E is the error behind obstacles.
//! `times obj N` prints the canyon as an OBJ file: groups `ground` and `building1` to `building14`.
//!
//! ```text
//! cargo run --release -p fredholm-factors --features measure --example times -- cube 8 1e-9
//! ```

use core::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use fredholm_factors::{Factors, Row, Sights, scene_factors};
use fredholm_scene::{Enclosure, Material, Polygon, Scene, Surface, shapes};

/// Every quadrilateral of a shape in n × n.
fn meshed(shape: &shapes::Shape, n: usize) -> Vec<Vec<Polygon>> {
    let cut = |p: &Polygon| match p {
        Polygon::Quad(corners) => shapes::grid(*corners, n),
        Polygon::Triangle(_) => vec![*p],
    };
    let surfaces = shape.surfaces.iter();
    surfaces.map(|s| s.iter().flat_map(cut).collect()).collect()
}

fn scene(surfaces: &[Vec<Polygon>], enclosure: Enclosure) -> Scene {
    let black = [Material::BLACK];
    let all: Vec<Surface<'_>> = surfaces
        .iter()
        .map(|polygons| Surface {
            polygons,
            materials: &black,
        })
        .collect();
    let start = Instant::now();
    let scene = Scene::new::<f64>(&all, enclosure).unwrap_or_else(|error| panic!("{error}"));
    println!(
        "{} polygons, checked in {:.3} s",
        scene.faces().len(),
        start.elapsed().as_secs_f64()
    );
    scene
}

fn cube(m: usize, error: f64, finer: f64) {
    let mut all = meshed(&shapes::room([0.0; 3], [1.0; 3]), m);
    all.extend(meshed(&shapes::block([0.25; 3], [0.75; 3]), m / 2));
    let scene = scene(&all, Enclosure::Closed);
    let start = Instant::now();
    let f = scene_factors(&scene, error).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let off = f
        .row_sums()
        .iter()
        .map(|s| (s - 1.0).abs())
        .fold(0.0, f64::max);
    println!(
        "{seconds:.3} s, {} pairs, {} in part, row sums off by {off:.1e}, estimated error {:.1e}",
        f.pairs(),
        f.partial(),
        f.error()
    );
    if finer > 0.0 {
        let best = scene_factors(&scene, finer).unwrap();
        let mut worst: f64 = 0.0;
        for i in 0..scene.faces().len() {
            for &(j, exchange) in best.row(i) {
                let j = j as usize;
                let smaller = f.areas()[i].min(f.areas()[j]);
                worst = worst.max((exchange - f.exchange_area(i, j)).abs() / smaller);
            }
        }
        println!("largest difference from error {finer:e}: {worst:.1e} in F");
    }
}

/// Two rows of seven buildings of different heights along a street, of triangles.
fn canyon(n: usize) -> Vec<Vec<Polygon>> {
    const STOREY: f64 = 3.0;
    let step = STOREY / n as f64;
    let height = |side: usize, k: usize| 3 + (5 * k + 3 * side) % 4;
    // In storeys: 3 along the street and 4 deep, 1 between buildings; the street is 4 wide.
    let (long, deep) = (7 * 4 + 1, 4 + 2 * 5);
    let building = |x: usize, y: usize| {
        let side = match y {
            1..=4 => 0,
            9..=12 => 1,
            _ => return None,
        };
        (!x.is_multiple_of(4) && x < 7 * 4 + 1).then_some((side, x / 4))
    };
    let mut ground = Vec::new();
    for x in 0..long * n {
        for y in 0..deep * n {
            if building(x / n, y / n).is_none() {
                let at = |x: usize, y: usize| [x as f64 * step, y as f64 * step, 0.0];
                ground.push(Polygon::Quad([
                    at(x, y),
                    at(x + 1, y),
                    at(x + 1, y + 1),
                    at(x, y + 1),
                ]));
            }
        }
    }
    let mut all = vec![ground];
    for side in 0..2 {
        for k in 0..7 {
            let low = [(4 * k + 1) as f64, (1 + 8 * side) as f64, 0.0].map(|x| x * STOREY);
            let size = [3, 4, height(side, k)];
            let high = core::array::from_fn(|a| low[a] + STOREY * size[a] as f64);
            let mut own = Vec::new();
            // Not the floor.
            for (s, surface) in shapes::block(low, high).surfaces.iter().enumerate().skip(1) {
                let axis = [2, 2, 1, 1, 0, 0][s];
                let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
                let Polygon::Quad([a, ..]) = surface[0] else {
                    continue;
                };
                let (nu, nv) = (size[u] * n, size[v] * n);
                let flip = if s % 2 == 0 { [1, 0] } else { [0, 1] };
                let mut from = low;
                from[axis] = a[axis];
                for i in 0..nu {
                    for j in 0..nv {
                        let at = |i: usize, j: usize| {
                            let mut p = from;
                            p[u] += i as f64 * step;
                            p[v] += j as f64 * step;
                            p
                        };
                        let quad =
                            Polygon::Quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                        own.push(if flip == [1, 0] {
                            shapes::reversed(&quad)
                        } else {
                            quad
                        });
                    }
                }
            }
            all.push(own);
        }
    }
    let halves = |p: &Polygon| match *p {
        Polygon::Quad([a, b, c, d]) => [Polygon::Triangle([a, b, c]), Polygon::Triangle([a, c, d])],
        Polygon::Triangle(_) => [*p; 2],
    };
    all.iter()
        .map(|s| s.iter().flat_map(halves).collect())
        .collect()
}

fn street(n: usize, error: f64, threads: usize, every: usize) {
    let scene = scene(&canyon(n), Enclosure::Open);
    let start = Instant::now();
    let sights = Sights::new(&scene, error).unwrap();
    let faces = scene.faces().len();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut own: Vec<(usize, Row)> = Vec::new();
        loop {
            let face = next.fetch_add(every, Ordering::Relaxed);
            if face >= faces {
                return own;
            }
            own.push((face, sights.row(face)));
        }
    };
    let mut rows = vec![Row::default(); faces];
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        for (face, row) in all.into_iter().flat_map(|t| t.join().unwrap_or_default()) {
            rows[face] = row;
        }
    });
    let f = Factors::new(&scene, rows).unwrap();
    println!(
        "{:.1} s on {threads} threads, {} pairs, {} in part, {} polygons that may hide, {:.2} GB, estimated error {:.1e}",
        start.elapsed().as_secs_f64(),
        f.pairs(),
        f.partial(),
        sights.occluders(),
        f.pairs() as f64 * 16e-9,
        f.error()
    );
}

/// The canyon as an OBJ file.
fn obj(n: usize) {
    let mut vertices = 0;
    for (number, polygons) in canyon(n).iter().enumerate() {
        match number {
            0 => println!("g ground"),
            _ => println!("g building{number}"),
        }
        for polygon in polygons {
            let corners = polygon.points();
            for [x, y, z] in corners {
                println!("v {x} {y} {z}");
            }
            let numbers: Vec<String> = (1..=corners.len())
                .map(|k| (vertices + k).to_string())
                .collect();
            println!("f {}", numbers.join(" "));
            vertices += corners.len();
        }
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    let number = |text: &str| text.parse::<f64>().unwrap_or(f64::NAN);
    match words.as_slice() {
        ["cube", m, error] => cube(number(m) as usize, number(error), 0.0),
        // The largest difference from a smaller error.
        ["cube", m, error, finer] => cube(number(m) as usize, number(error), number(finer)),
        ["canyon", n, error, threads] => street(
            number(n) as usize,
            number(error),
            number(threads) as usize,
            1,
        ),
        ["obj", n] => obj(number(n) as usize),
        // Every so many-th row only, for a forecast.
        ["canyon", n, error, threads, every] => {
            street(
                number(n) as usize,
                number(error),
                number(threads) as usize,
                number(every) as usize,
            );
        }
        _ => println!("times cube M E [FINER] | times canyon N E T [EVERY] | times obj N"),
    }
}
