//! Scenes for the tests.
#![allow(dead_code, reason = "every test file uses a part of it")]

use core::f64::consts::TAU;

use fredholm_core::Real;
use fredholm_scene::{Enclosure, Material, Polygon, Scene, SceneError, Surface, shapes};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

pub(crate) type V = [f64; 3];
pub(crate) type Surfaces = Vec<Vec<Polygon>>;

pub(crate) fn scene_of<F: Real>(
    surfaces: &Surfaces,
    enclosure: Enclosure,
) -> Result<Scene, SceneError> {
    let black = [Material::BLACK];
    let all: Vec<Surface<'_>> = surfaces
        .iter()
        .map(|polygons| Surface {
            polygons,
            materials: &black,
        })
        .collect();
    Scene::new::<F>(&all, enclosure)
}

pub(crate) fn map(surfaces: &Surfaces, f: impl Fn(V) -> V) -> Surfaces {
    let polygon = |p: &Polygon| match p {
        Polygon::Triangle(p) => Polygon::Triangle(p.map(&f)),
        Polygon::Quad(p) => Polygon::Quad(p.map(&f)),
    };
    surfaces
        .iter()
        .map(|s| s.iter().map(polygon).collect())
        .collect()
}

/// A proper rotation.
pub(crate) fn rotation(rng: &mut ChaCha8Rng) -> impl Fn(V) -> V + use<> {
    // A random unit quaternion (Shoemake 1992).
    let (u, v, w): (f64, f64, f64) = (rng.random(), rng.random(), rng.random());
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    let (x, y) = (a * (TAU * v).sin(), a * (TAU * v).cos());
    let (z, s) = (b * (TAU * w).sin(), b * (TAU * w).cos());
    let m = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * s),
            2.0 * (x * z + y * s),
        ],
        [
            2.0 * (x * y + z * s),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * s),
        ],
        [
            2.0 * (x * z - y * s),
            2.0 * (y * z + x * s),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    move |p| m.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2])
}

pub(crate) fn triangulated(surfaces: &Surfaces) -> Surfaces {
    let cut = |p: &Polygon| match *p {
        Polygon::Triangle(_) => vec![*p],
        Polygon::Quad([a, b, c, d]) => {
            vec![Polygon::Triangle([a, b, c]), Polygon::Triangle([a, c, d])]
        }
    };
    surfaces
        .iter()
        .map(|s| s.iter().flat_map(cut).collect())
        .collect()
}

/// Every quadrilateral of a shape in n × n.
pub(crate) fn meshed(surfaces: &Surfaces, n: usize) -> Surfaces {
    let cut = |p: &Polygon| match *p {
        Polygon::Quad(corners) => shapes::grid(corners, n),
        Polygon::Triangle(_) => vec![*p],
    };
    surfaces
        .iter()
        .map(|s| s.iter().flat_map(cut).collect())
        .collect()
}

/// A sphere of 2n × n patches seen from inside, with poles of high degree.
pub(crate) fn sphere(n: usize, radius: f64, inside: bool) -> Surfaces {
    let at = |i: usize, j: usize| -> V {
        let i = i % (2 * n);
        let (phi, theta) = (
            TAU * i as f64 / (2 * n) as f64,
            TAU * j as f64 / (2 * n) as f64,
        );
        let s = if j == 0 || j == n { 0.0 } else { theta.sin() };
        let z = if 2 * j == n { 0.0 } else { theta.cos() };
        [radius * s * phi.cos(), radius * s * phi.sin(), radius * z]
    };
    let mut all = Vec::new();
    for j in 0..n {
        for i in 0..2 * n {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            // Seen from outside counter-clockwise.
            for t in [[a, b, c], [a, c, d]] {
                if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                    let p = Polygon::Triangle(t);
                    all.push(if inside { shapes::reversed(&p) } else { p });
                }
            }
        }
    }
    vec![all]
}

/// A prism over a star-shaped outline, seen from inside or outside; caps are fans around a middle.
pub(crate) fn prism(outline: &[[f64; 2]], low: f64, high: f64, inside: bool) -> Surfaces {
    let n = outline.len();
    let at = |k: usize, z: f64| [outline[k % n][0], outline[k % n][1], z];
    let sum = outline
        .iter()
        .fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
    let hub = |z: f64| [sum[0] / n as f64, sum[1] / n as f64, z];
    let mut sides = Vec::new();
    let mut caps = [Vec::new(), Vec::new()];
    for k in 0..n {
        sides.push(vec![Polygon::Quad([
            at(k, low),
            at(k + 1, low),
            at(k + 1, high),
            at(k, high),
        ])]);
        caps[0].push(Polygon::Triangle([hub(low), at(k + 1, low), at(k, low)]));
        caps[1].push(Polygon::Triangle([hub(high), at(k, high), at(k + 1, high)]));
    }
    sides.extend(caps);
    if inside {
        for p in sides.iter_mut().flatten() {
            *p = shapes::reversed(p);
        }
    }
    sides
}

/// A room whose floor is fanned into needles from a point near an edge.
fn needles(n: usize) -> Surfaces {
    let mut room = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let hub = [0.5, 1e-6, 0.0];
    let mut rim: Vec<V> = Vec::new();
    for k in 0..n {
        rim.push([k as f64 / n as f64, 0.0, 0.0]);
    }
    rim.extend([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    room[0] = (0..rim.len())
        .map(|k| Polygon::Triangle([hub, rim[k], rim[(k + 1) % rim.len()]]))
        .collect();
    room
}

/// Thirty closed scenes: rooms, obstacles, spheres, prisms, thin plates, needles, T-junctions.
pub(crate) fn closed_scenes() -> Vec<(String, Surfaces)> {
    let mut rng = ChaCha8Rng::seed_from_u64(26);
    let mut all: Vec<(String, Surfaces)> = Vec::new();
    let room = || shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let blocked = || {
        let block = shapes::block([0.25; 3], [0.75; 3]);
        shapes::room([0.0; 3], [1.0; 3]).and(block).surfaces
    };
    all.push(("cube".into(), room()));
    all.push(("cube with a block".into(), blocked()));
    all.push(("triangles".into(), triangulated(&blocked())));
    all.push(("meshed".into(), meshed(&blocked(), 5)));
    all.push(("needles".into(), needles(50)));
    let mut split = room();
    split[0] = meshed(&vec![split[0].clone()], 3).remove(0);
    all.push(("T-junctions".into(), split.clone()));
    let plate = Polygon::Quad([
        [0.3, 0.2, 0.0],
        [0.3, 0.7, 0.0],
        [0.3, 0.7, 0.6],
        [0.3, 0.2, 0.6],
    ]);
    let mut baffle = room();
    baffle.extend([vec![plate], vec![shapes::reversed(&plate)]]);
    all.push(("baffle".into(), baffle.clone()));
    all.push(("baffle, other triangles".into(), {
        let mut s = room();
        s.extend(triangulated(&vec![vec![plate]]));
        s.push(vec![shapes::reversed(&plate)]);
        s
    }));
    for n in [6, 20, 60] {
        all.push((format!("sphere {n}"), sphere(n, 1.0, true)));
    }
    let mut shell = sphere(12, 3.0, true);
    shell.extend(sphere(9, 1.0, false));
    all.push(("spheres".into(), shell));
    for n in [3, 5, 7, 64] {
        let outline: Vec<[f64; 2]> = (0..n)
            .map(|k| {
                let (r, phi) = (
                    if n == 7 {
                        0.6 + 0.4 * f64::from(k % 2)
                    } else {
                        1.0
                    },
                    TAU * f64::from(k) / f64::from(n),
                );
                [r * phi.cos(), r * phi.sin()]
            })
            .collect();
        all.push((format!("prism {n}"), prism(&outline, -0.3, 1.1, true)));
    }
    let base: Vec<(String, Surfaces)> = all.clone();
    for (k, (name, surfaces)) in base.iter().enumerate().take(14) {
        let turn = rotation(&mut rng);
        let (size, far) = ([1.0, 1e3, 1e-3][k % 3], [0.0, 7.0, 0.1][k % 3]);
        // Quadrilaterals that are turned and moved are planar to rounding only.
        let moved = map(surfaces, |p| turn(p).map(|x| size * (x + far)));
        all.push((format!("{name}, moved"), moved));
    }
    all
}
