//! Scenes for the tests.
#![allow(dead_code, reason = "every test file uses a part of it")]

use core::f64::consts::TAU;

use fredholm_core::Real;
use fredholm_scene::{Enclosure, Material, Polygon, Scene, SceneError, Surface, shapes};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

pub(crate) type V = [f64; 3];
pub(crate) type Surfaces = Vec<Vec<Polygon>>;

pub(crate) fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

/// A scene, with a material for every surface.
pub(crate) fn scene_with<F: Real>(
    surfaces: &Surfaces,
    material: impl Fn(usize) -> Material,
    enclosure: Enclosure,
) -> Result<Scene, SceneError> {
    let materials: Vec<[Material; 1]> = (0..surfaces.len()).map(|s| [material(s)]).collect();
    let all = surfaces.iter().zip(&materials);
    let all = all.map(|(polygons, materials)| Surface {
        polygons,
        materials,
    });
    Scene::new::<F>(&all.collect::<Vec<_>>(), enclosure)
}

/// A black scene.
pub(crate) fn scene_of<F: Real>(
    surfaces: &Surfaces,
    enclosure: Enclosure,
) -> Result<Scene, SceneError> {
    scene_with::<F>(surfaces, |_| Material::BLACK, enclosure)
}

pub(crate) fn closed(surfaces: &Surfaces) -> Scene {
    scene_of::<f64>(surfaces, Enclosure::Closed).unwrap()
}

pub(crate) fn open(surfaces: &Surfaces) -> Scene {
    scene_of::<f64>(surfaces, Enclosure::Open).unwrap()
}

/// Every polygon as others.
fn each(surfaces: &Surfaces, f: impl Fn(&Polygon) -> Vec<Polygon>) -> Surfaces {
    let surface = |s: &Vec<Polygon>| s.iter().flat_map(&f).collect();
    surfaces.iter().map(surface).collect()
}

pub(crate) fn map(surfaces: &Surfaces, f: impl Fn(V) -> V) -> Surfaces {
    each(surfaces, |p| match p {
        Polygon::Triangle(p) => vec![Polygon::Triangle(p.map(&f))],
        Polygon::Quad(p) => vec![Polygon::Quad(p.map(&f))],
    })
}

pub(crate) fn mirrored(surfaces: &Surfaces) -> Surfaces {
    let other = map(surfaces, |[x, y, z]| [-x, y, z]);
    each(&other, |p| vec![shapes::reversed(p)])
}

pub(crate) fn triangulated(surfaces: &Surfaces) -> Surfaces {
    each(surfaces, |p| match *p {
        Polygon::Triangle(_) => vec![*p],
        Polygon::Quad([a, b, c, d]) => [[a, b, c], [a, c, d]].map(Polygon::Triangle).to_vec(),
    })
}

/// Every quadrilateral of a shape in n × n.
pub(crate) fn meshed(surfaces: &Surfaces, n: usize) -> Surfaces {
    each(surfaces, |p| match *p {
        Polygon::Quad(corners) => shapes::grid(corners, n),
        Polygon::Triangle(_) => vec![*p],
    })
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

/// Points of a circle.
pub(crate) fn circle(n: usize, radius: f64) -> Vec<[f64; 2]> {
    let angles = (0..n).map(|k| TAU * k as f64 / n as f64);
    angles
        .map(|a| [radius * a.cos(), radius * a.sin()])
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
    for (i, j) in (0..2 * n * n).map(|k| (k % (2 * n), k / (2 * n))) {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        // Seen from outside counter-clockwise.
        for t in [[a, b, c], [a, c, d]] {
            if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                let p = Polygon::Triangle(t);
                all.push(if inside { shapes::reversed(&p) } else { p });
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
    let side = |k| Polygon::Quad([at(k, low), at(k + 1, low), at(k + 1, high), at(k, high)]);
    let floor = |k| Polygon::Triangle([hub(low), at(k + 1, low), at(k, low)]);
    let ceiling = |k| Polygon::Triangle([hub(high), at(k, high), at(k + 1, high)]);
    let mut sides: Surfaces = (0..n).map(|k| vec![side(k)]).collect();
    sides.push((0..n).map(floor).collect());
    sides.push((0..n).map(ceiling).collect());
    if inside {
        sides = each(&sides, |p| vec![shapes::reversed(p)]);
    }
    sides
}

/// A room whose floor is fanned into needles from a point near an edge.
fn needles(n: usize) -> Surfaces {
    let mut room = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let hub = [0.5, 1e-6, 0.0];
    let mut rim: Vec<V> = (0..n).map(|k| [k as f64 / n as f64, 0.0, 0.0]).collect();
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
    let mut add = |name: &str, surfaces| all.push((name.to_owned(), surfaces));
    let room = || shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let block = shapes::block([0.25; 3], [0.75; 3]);
    let blocked = shapes::room([0.0; 3], [1.0; 3]).and(block).surfaces;
    add("cube", room());
    add("cube with a block", blocked.clone());
    add("triangles", triangulated(&blocked));
    add("meshed", meshed(&blocked, 5));
    add("needles", needles(50));
    let mut split = room();
    split[0] = meshed(&vec![split[0].clone()], 3).remove(0);
    add("T-junctions", split);
    let plate = Polygon::Quad([
        [0.3, 0.2, 0.0],
        [0.3, 0.7, 0.0],
        [0.3, 0.7, 0.6],
        [0.3, 0.2, 0.6],
    ]);
    let back = vec![shapes::reversed(&plate)];
    let baffle = |front: Surfaces| [room(), front, vec![back.clone()]].concat();
    add("baffle", baffle(vec![vec![plate]]));
    let front = triangulated(&vec![vec![plate]]);
    add("baffle, other triangles", baffle(front));
    for n in [6, 20, 60] {
        add(&format!("sphere {n}"), sphere(n, 1.0, true));
    }
    let shell = [sphere(12, 3.0, true), sphere(9, 1.0, false)].concat();
    add("spheres", shell);
    for n in [3, 5, 7, 64] {
        let mut outline = circle(n, 1.0);
        if n == 7 {
            for inner in outline.iter_mut().step_by(2) {
                *inner = inner.map(|x| 0.6 * x);
            }
        }
        add(&format!("prism {n}"), prism(&outline, -0.3, 1.1, true));
    }
    for (k, (name, surfaces)) in all.clone().iter().enumerate().take(14) {
        let turn = rotation(&mut rng);
        let (size, far) = ([1.0, 1e3, 1e-3][k % 3], [0.0, 7.0, 0.1][k % 3]);
        // Quadrilaterals that are turned and moved are planar to rounding only.
        let moved = map(surfaces, |p| turn(p).map(|x| size * (x + far)));
        all.push((format!("{name}, moved"), moved));
    }
    all
}

/// Boxes and prisms beside each other along x, none of which touches another, between 0.1 and 1 in y and z.
pub(crate) fn bodies(rng: &mut ChaCha8Rng, count: u32, spacing: f64) -> Surfaces {
    let mut all = Vec::new();
    for k in 0..count {
        let base = rng.random_range(0.1..0.4);
        let corner = [
            0.1 + spacing * f64::from(k),
            rng.random_range(0.1..0.6),
            base,
        ];
        let top = base + rng.random_range(0.2..0.5);
        if rng.random() {
            let high = [
                corner[0] + rng.random_range(0.15..0.4),
                corner[1] + 0.35,
                top,
            ];
            all.extend(shapes::block(corner, high).surfaces);
        } else {
            let n = rng.random_range(3..6);
            let turn: f64 = rng.random_range(0.0..TAU);
            let rim = (0..n).map(|k| turn + TAU * f64::from(k) / f64::from(n));
            let rim = rim.map(|a| {
                [
                    corner[0] + 0.2 + 0.2 * a.cos(),
                    corner[1] + 0.2 + 0.2 * a.sin(),
                ]
            });
            all.extend(prism(&rim.collect::<Vec<_>>(), base, top, false));
        }
    }
    all
}
