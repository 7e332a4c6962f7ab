//! Seconds of form factors: `times cube M E` for the unit cube of 6 M² squares with a centred block of 6 (M/2)², `times
//! canyon N E T` for a street canyon whose squares are 1/N of a storey wide, on T threads; E is the error behind obstacles.
//! `times obj N` prints the canyon as an OBJ file: groups `ground` and `building1` to `building14`.
//!
//! ```text
//! cargo run --release -p fredholm-factors --features measure --example times -- cube 8 1e-9
//! ```

use core::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use fredholm_factors::{Factors, Row, Sights, Sky, scene_factors};
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

/// A flat disc of n triangles that is turned, with coordinates in single precision.
fn disc(n: usize) -> Vec<Vec<Polygon>> {
    let at = |k: usize| {
        let angle = core::f64::consts::TAU * k as f64 / n as f64;
        rounded(turned([angle.cos(), angle.sin(), 0.0]))
    };
    let hub = rounded(turned([0.0; 3]));
    let wedge = |k| Polygon::Triangle([hub, at(k), at((k + 1) % n)]);
    vec![(0..n).map(wedge).collect()]
}

fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (c, s) = (0.8, 0.6);
    let [y, z] = [c * y - s * z, s * y + c * z];
    [c * x - s * z + 0.1, y + 0.2, s * x + c * z + 0.3]
}

fn rounded(p: [f64; 3]) -> [f64; 3] {
    p.map(|x| f64::from(x as f32))
}

/// An empty cube that is turned, every wall in 2 n² triangles, in single precision.
fn walls(n: usize) -> Vec<Vec<Polygon>> {
    let room = meshed(&shapes::room([0.0; 3], [1.0; 3]), n);
    let halves = |p: &Polygon| {
        let points: Vec<[f64; 3]> = p.points().iter().map(|&p| rounded(turned(p))).collect();
        // Four vertices that were rounded are not in a plane.
        let corners = |k: usize| Polygon::Triangle([points[0], points[k], points[k + 1]]);
        (1..points.len() - 1).map(corners).collect::<Vec<_>>()
    };
    room.iter()
        .map(|s| s.iter().flat_map(halves).collect())
        .collect()
}

/// A number in [0, 1) that looks random.
fn noise(i: usize, j: usize) -> f64 {
    let x = (i as f64 * 12.9898 + j as f64 * 78.233).sin() * 43758.5453;
    x - x.floor()
}

/// Rough ground of 2 n² triangles, heights within a tenth of its width.
fn terrain(n: usize) -> Vec<Vec<Polygon>> {
    let step = 1.0 / n as f64;
    let height = |i: usize, j: usize| 0.2 * noise(i, j) - 0.1;
    let at = |i: usize, j: usize| [i as f64 * step, j as f64 * step, height(i, j)];
    let cell = |k: usize| {
        let (i, j) = (k / n, k % n);
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [Polygon::Triangle([a, b, c]), Polygon::Triangle([a, c, d])]
    };
    vec![(0..n * n).flat_map(cell).collect()]
}

/// A ball of 4 n (n - 1) triangles between two squares.
fn ball(n: usize) -> Vec<Vec<Polygon>> {
    let at = |i: usize, j: usize| {
        let step = core::f64::consts::PI / n as f64;
        let (phi, theta) = (step * (i % (2 * n)) as f64, step * j as f64);
        let s = if j == n { 0.0 } else { theta.sin() };
        [0.3 * s * phi.cos(), 0.3 * s * phi.sin(), 0.3 * theta.cos()]
    };
    let mut own = Vec::new();
    for (i, j) in (0..2 * n * n).map(|k| (k % (2 * n), k / (2 * n))) {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        if j + 1 < n {
            own.push(Polygon::Triangle([a, b, c]));
        }
        if j > 0 {
            own.push(Polygon::Triangle([a, c, d]));
        }
    }
    let square = |z: f64| {
        [
            [-0.5, -0.5, z],
            [0.5, -0.5, z],
            [0.5, 0.5, z],
            [-0.5, 0.5, z],
        ]
    };
    let low = Polygon::Quad(square(-0.5));
    let high = shapes::reversed(&Polygon::Quad(square(0.5)));
    vec![vec![low], vec![high], own]
}

/// n × n buildings of 6 to 30 m on a grid, the ground cut round them.
fn city(n: usize) -> Vec<Vec<Polygon>> {
    let mut ground = Vec::new();
    let mut all = Vec::new();
    let edge = |k: usize| 22.0 * (k / 2) as f64 + if k % 2 == 1 { 12.0 } else { 0.0 };
    for (i, j) in (0..(2 * n + 1) * (2 * n + 1)).map(|k| (k / (2 * n + 1), k % (2 * n + 1))) {
        let low = [edge(i), edge(j), 0.0];
        let high = [edge(i + 1), edge(j + 1), 6.0 + 24.0 * noise(i, j)];
        if i % 2 == 1 && j % 2 == 1 {
            let block = shapes::block(low, high).surfaces;
            all.push(block.into_iter().skip(1).flatten().collect());
        } else {
            ground.push(Polygon::Quad([
                low,
                [high[0], low[1], 0.0],
                [high[0], high[1], 0.0],
                [low[0], high[1], 0.0],
            ]));
        }
    }
    all.push(ground);
    all
}

/// Seconds of a family, and what rows come to.
fn grow(kind: &str, n: usize, error: f64, sky: bool) {
    let (surfaces, enclosure) = match kind {
        "disc" => (disc(n), Enclosure::Open),
        "box" => (walls(n), Enclosure::Closed),
        "terrain" => (terrain(n), Enclosure::Open),
        "ball" => (ball(n), Enclosure::Open),
        _ => (city(n), Enclosure::Open),
    };
    let scene = scene(&surfaces, enclosure);
    let start = Instant::now();
    let sights = Sights::new(&scene, error).unwrap();
    let rows = (0..scene.faces().len()).map(|face| sights.row(face));
    let f = Factors::new(&scene, rows.collect()).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let uniform = Sky::uniform();
    let of_sky: Vec<_> = (0..scene.faces().len())
        .filter(|_| sky)
        .map(|face| sights.sky(face, &uniform).unwrap())
        .collect();
    let sums = f.row_sums();
    let mut mean = sums.iter().sum::<f64>() / sums.len() as f64;
    let mut off = sums.iter().map(|s| (s - 1.0).abs()).fold(0.0, f64::max);
    if sky {
        let outside = of_sky.iter().map(|row| row.exchange.iter().sum::<f64>());
        let sums: Vec<f64> = outside
            .zip(scene.faces())
            .zip(&sums)
            .map(|((out, face), sum)| sum + out / face.area)
            .collect();
        mean = sums.iter().sum::<f64>() / sums.len() as f64;
        off = sums.iter().map(|s| (s - 1.0).abs()).fold(0.0, f64::max);
    }
    println!(
        "{kind} {} polygons, {} hide, error {error:.0e}: {seconds:.3} s, {:.3} s with sky; {} pairs, {} in part, \
         estimated {:.1e}, mean sum {mean:.12}, off {off:.1e}, first {:.12}",
        scene.faces().len(),
        sights.occluders(),
        start.elapsed().as_secs_f64(),
        f.pairs(),
        f.partial(),
        f.error(),
        f.factor(0, 1),
    );
}

/// The polygons of an OBJ file of vertices and faces.
fn read(path: &str) -> Vec<Vec<Polygon>> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut all = Vec::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["v", x, y, z] => vertices.push([x, y, z].map(|w| w.parse().unwrap_or(f64::NAN))),
            ["f", numbers @ ..] => {
                let number = |w: &&str| w.parse::<usize>().unwrap_or(0);
                let corners: Vec<[f64; 3]> =
                    numbers.iter().map(|w| vertices[number(w) - 1]).collect();
                all.push(match *corners.as_slice() {
                    [a, b, c, d] => Polygon::Quad([a, b, c, d]),
                    [a, b, c] => Polygon::Triangle([a, b, c]),
                    _ => panic!("{path}: three or four vertices"),
                });
            }
            _ => {}
        }
    }
    vec![all]
}

/// Seconds of a mesh.
fn file(path: &str, error: f64) {
    let surfaces = read(path);
    let scene = scene(&surfaces, Enclosure::Open);
    let start = Instant::now();
    let f = scene_factors(&scene, error).unwrap();
    let sums = f.row_sums();
    println!(
        "{path}, error {error:.0e}: {:.3} s; {} pairs, {} in part, estimated {:.1e}, sums {:.12} to {:.12}, mean {:.12}, first {:.12}",
        start.elapsed().as_secs_f64(),
        f.pairs(),
        f.partial(),
        f.error(),
        sums.iter().copied().fold(f64::INFINITY, f64::min),
        sums.iter().copied().fold(0.0, f64::max),
        sums.iter().sum::<f64>() / sums.len() as f64,
        f.factor(0, 1),
    );
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
        ["file", path, error] => file(path, number(error)),
        ["grow", kind, n, error] => grow(kind, number(n) as usize, number(error), false),
        ["grow", kind, n, error, "sky"] => grow(kind, number(n) as usize, number(error), true),
        // Every so many-th row only, for a forecast.
        ["canyon", n, error, threads, every] => {
            street(
                number(n) as usize,
                number(error),
                number(threads) as usize,
                number(every) as usize,
            );
        }
        _ => println!(
            "times cube M E [FINER] | times canyon N E T [EVERY] | times obj N | times file FILE.obj E | times grow \
             disc|box|terrain|ball|city N E [sky]"
        ),
    }
}
