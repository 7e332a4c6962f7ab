//! Form factors that others computed or derived, with differences and seconds, on one thread.
//!
//! ```text
//! cargo run --release -p fredholm-factors --example catalogue
//! ```

use core::f64::consts::{PI, TAU};
use std::time::Instant;

use fredholm_factors::Sights;
use fredholm_scene::{Enclosure, Material, Polygon, Scene, Surface, shapes};

type Surfaces = Vec<Vec<Polygon>>;

/// What is asked for behind obstacles.
const ERROR: f64 = 1e-12;

/// A_0 F_0J of the first polygon with every surface.
fn from_first(surfaces: &Surfaces, enclosure: Enclosure) -> Vec<f64> {
    let black = [Material::BLACK];
    let all: Vec<Surface<'_>> = surfaces
        .iter()
        .map(|polygons| Surface {
            polygons,
            materials: &black,
        })
        .collect();
    let scene = Scene::new::<f64>(&all, enclosure).unwrap_or_else(|error| panic!("{error}"));
    let sights = Sights::new(&scene, ERROR).unwrap_or_else(|error| panic!("{error}"));
    let mut sums = vec![0.0; surfaces.len()];
    for (other, exchange) in sights.row(0).entries {
        if let Some(place) = scene.place(other as usize) {
            sums[place.surface] += exchange;
        }
    }
    sums
}

fn square(z: f64, side: f64, up: bool) -> Polygon {
    let p = Polygon::Quad([
        [0.0, 0.0, z],
        [side, 0.0, z],
        [side, side, z],
        [0.0, side, z],
    ]);
    if up { p } else { shapes::reversed(&p) }
}

fn circle(radius: f64, z: f64, n: usize) -> Vec<[f64; 3]> {
    let angles = (0..n).map(|k| TAU * k as f64 / n as f64);
    angles
        .map(|a| [radius * a.cos(), radius * a.sin(), z])
        .collect()
}

/// The side of a cylinder of height 1, seen from outside.
fn cylinder(radius: f64, n: usize) -> Vec<Polygon> {
    let [low, high] = [-0.5, 0.5].map(|z| circle(radius, z, n));
    let side = |k: usize| Polygon::Quad([low[k], low[(k + 1) % n], high[(k + 1) % n], high[k]]);
    (0..n).map(side).collect()
}

/// A sphere of 2n × n patches, seen from outside.
fn sphere(radius: f64, n: usize) -> Vec<Polygon> {
    let ring = |k: usize| {
        let a = PI * k as f64 / n as f64;
        circle(radius * a.sin(), radius * a.cos(), 2 * n)
    };
    let [top, bottom] = [[0.0, 0.0, radius], [0.0, 0.0, -radius]];
    let mut all = Vec::new();
    for k in 0..n {
        let (upper, lower) = (ring(k), ring(k + 1));
        for i in 0..2 * n {
            let j = (i + 1) % (2 * n);
            if k == 0 {
                all.push(Polygon::Triangle([top, lower[i], lower[j]]));
            } else if k + 1 == n {
                all.push(Polygon::Triangle([upper[i], bottom, upper[j]]));
            } else {
                all.push(Polygon::Triangle([upper[i], lower[i], lower[j]]));
                all.push(Polygon::Triangle([upper[i], lower[j], upper[j]]));
            }
        }
    }
    all
}

fn inside(polygons: Vec<Polygon>) -> Vec<Polygon> {
    polygons.iter().map(shapes::reversed).collect()
}

/// The limit of values at n, 2n, 4n … whose difference from it is a series in n⁻².
fn limit(mut row: Vec<f64>) -> f64 {
    let mut power = 1.0;
    while row.len() > 1 {
        power *= 4.0;
        let pairs = row.windows(2);
        row = pairs
            .map(|w| (power * w[1] - w[0]) / (power - 1.0))
            .collect();
    }
    row[0]
}

/// From one side of the inner cylinder of n, as all are alike, per area of the side: to the outer one, and past its ends
/// to a sphere of radius 3; and the area of all sides.
fn cylinders(n: usize) -> [f64; 3] {
    let inner = cylinder(0.125, n);
    let outer = cylinder(0.25, n);
    let all = vec![inner, inside(outer.clone()), outer, inside(sphere(3.0, 3))];
    let sums = from_first(&all, Enclosure::Open);
    let side = 0.25 * (PI / n as f64).sin();
    [sums[1] / side, sums[3] / side, side * n as f64]
}

fn main() {
    let print = |case: &str, exact: f64, work: &dyn Fn() -> f64| {
        let start = Instant::now();
        let found = work();
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{case:<66} {found:.15} {:8.1e} {seconds:9.4} s",
            found - exact
        );
    };
    let pair = |a: Polygon, b: Polygon| from_first(&vec![vec![a], vec![b]], Enclosure::Open)[1];
    let (low, high) = (square(0.0, 1.0, true), square(1.0, 1.0, false));
    let wall = Polygon::Quad([[0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]);
    print(
        "C-11, parallel unit squares at distance 1",
        0.199_824_895_698_387,
        &|| pair(low, high),
    );
    print(
        "C-14, perpendicular unit squares",
        0.200_043_776_075_403,
        &|| pair(low, wall),
    );
    print(
        "C-11 behind a square half-way, 3/4 of it",
        0.149_868_671_773_790,
        &|| {
            let plate = |up| vec![square(0.5, 0.5, up)];
            from_first(
                &vec![vec![low], vec![high], plate(true), plate(false)],
                Enclosure::Open,
            )[1]
        },
    );
    print(
        "C-41, discs of radius 1 at distance 1, from 8 to 128 corners",
        0.381_966_011_250_105,
        &|| {
            let value = |n: usize| {
                // A wedge of the lower one: all are alike.
                let (rim, above) = (circle(1.0, 0.0, n), circle(1.0, 1.0, n));
                let wedge = Polygon::Triangle([[0.0; 3], rim[0], rim[1]]);
                let all = vec![vec![wedge], inside(shapes::fan(&above))];
                from_first(&all, Enclosure::Open)[1] / (0.5 * (TAU / n as f64).sin())
            };
            limit([8, 16, 32, 64, 128].map(value).to_vec())
        },
    );
    print(
        "cylinders 1/8 in 1/4, height 1, inner to outer, 16 to 256 sides",
        0.910_868_433_007_748,
        &|| limit([16, 32, 64, 128, 256].map(|n| cylinders(n)[0]).to_vec()),
    );
    print(
        "sphere of radius 3 behind it, from the inner cylinder",
        0.089_131_566_992_252,
        &|| limit([16, 32, 64, 128, 256].map(|n| cylinders(n)[1]).to_vec()),
    );
    print(
        "and back, from the sphere",
        6.189_692_152_239_722e-4,
        &|| {
            let value = |n: usize| {
                let [_, f, area] = cylinders(n);
                f * area / (36.0 * PI)
            };
            limit([16, 32, 64, 128, 256].map(value).to_vec())
        },
    );
    print(
        "concentric spheres of radii 1 and 3, inner to outer",
        1.0,
        &|| {
            let all = vec![sphere(1.0, 6), inside(sphere(3.0, 6))];
            let own = from_first(&all, Enclosure::Closed)[1];
            let Some(Polygon::Triangle([a, b, c])) = all[0].first() else {
                return f64::NAN;
            };
            let side = |p: [f64; 3], q: [f64; 3]| [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
            let (u, v) = (side(*a, *b), side(*a, *c));
            let double = [
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            ];
            own / (0.5 * double.iter().map(|x| x * x).sum::<f64>().sqrt())
        },
    );
}
