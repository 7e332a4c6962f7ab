//! Rays per second on one thread among 10³ to 10⁶ triangles, beside parry3d and bvh on the same triangles and rays, all in
//! f64; and the time to build and validate a scene.

use core::f64::consts::TAU;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fredholm_scene::{Enclosure, Geometry, Material, Polygon, Scene, Surface, shapes};
use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::TriMesh;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

const RAYS: usize = 10_000;

/// A unit cube with 64 balls of 4n(n − 1) triangles.
fn balls(n: usize) -> Scene {
    let mut all = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    for k in 0..64 {
        let centre = [k % 4, k / 4 % 4, k / 16].map(|i| 0.125 + 0.25 * f64::from(i));
        let at = |i: usize, j: usize| {
            let (phi, theta) = (
                TAU * (i % (2 * n)) as f64 / (2 * n) as f64,
                TAU * j as f64 / (2 * n) as f64,
            );
            let s = if j == 0 || j == n { 0.0 } else { theta.sin() };
            let d = [s * phi.cos(), s * phi.sin(), theta.cos()];
            core::array::from_fn(|a| centre[a] + 0.09 * d[a])
        };
        let mut ball = Vec::new();
        for j in 0..n {
            for i in 0..2 * n {
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                if j + 1 < n {
                    ball.push(Polygon::Triangle([a, b, c]));
                }
                if j > 0 {
                    ball.push(Polygon::Triangle([a, c, d]));
                }
            }
        }
        all.push(ball);
    }
    let black = [Material::BLACK];
    let surfaces: Vec<Surface<'_>> = all
        .iter()
        .map(|polygons| Surface {
            polygons,
            materials: &black,
        })
        .collect();
    Scene::new::<f64>(&surfaces, Enclosure::Closed).unwrap()
}

/// What a walk casts by the cosine law: face, origin, direction.
fn rays(geometry: &Geometry<'_, f64>) -> Vec<(u32, [f64; 3], [f64; 3])> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut face, mut from) = (0, [0.3, 0.4, 0.0]);
    (0..RAYS)
        .map(|_| {
            let n = geometry.faces()[face as usize].normal;
            let (u, v): (f64, f64) = (rng.random(), TAU * rng.random::<f64>());
            // A normal and a point of the unit sphere have the cosine law together (Lambert).
            let z = 2.0 * u - 1.0;
            let r = (1.0 - z * z).sqrt();
            let d = [n[0] + r * v.cos(), n[1] + r * v.sin(), n[2] + z];
            let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            let ray = (face, from, d.map(|x| x / length));
            let hit = geometry.cast(ray.0, ray.1, ray.2).unwrap();
            (face, from) = (hit.face, hit.point);
            ray
        })
        .collect()
}

/// A triangle as the crate bvh sees it.
struct Own {
    corners: [Point3<f64>; 3],
    node: usize,
}

impl Bounded<f64, 3> for Own {
    fn aabb(&self) -> Aabb<f64, 3> {
        let [a, b, c] = &self.corners;
        Aabb::empty().grow(a).grow(b).grow(c)
    }
}

impl BHShape<f64, 3> for Own {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

fn casting(c: &mut Criterion) {
    let mut group = c.benchmark_group("balls in a cube, a ray");
    for n in [3, 20, 64] {
        let scene = balls(n);
        let geometry = scene.geometry();
        let rays = rays(&geometry);
        let triangles = geometry.triangles();
        let corner = |t: usize, k: usize| triangles[t].axes.map(|axis| axis[k]);
        let corners = (0..triangles.len()).flat_map(|t| [0, 1, 2].map(|k| corner(t, k)));
        let vertices: Vec<Vector> = corners.map(|[x, y, z]| Vector::new(x, y, z)).collect();
        let count = triangles.len() as u32;
        let indices = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = TriMesh::new(vertices, indices).unwrap();
        let mut own: Vec<Own> = (0..triangles.len())
            .map(|t| Own {
                corners: [0, 1, 2].map(|k| Point3::from(corner(t, k))),
                node: 0,
            })
            .collect();
        let tree = Bvh::build(&mut own);
        // A face is not left out there, so that rays start a little off it.
        const OFF: f64 = 1e-9;
        let off = |from: [f64; 3], d: [f64; 3]| -> [f64; 3] {
            core::array::from_fn(|k| from[k] + OFF * d[k])
        };
        let with_parry: Vec<Ray> = rays
            .iter()
            .map(|&(_, from, d)| {
                let [x, y, z] = off(from, d);
                Ray::new(Vector::new(x, y, z), Vector::new(d[0], d[1], d[2]))
            })
            .collect();
        let with_bvh: Vec<bvh::ray::Ray<f64, 3>> = rays
            .iter()
            .map(|&(_, from, d)| bvh::ray::Ray::new(Point3::from(off(from, d)), Vector3::from(d)))
            .collect();
        let by_bvh = |ray: &bvh::ray::Ray<f64, 3>| {
            let mut best = f64::INFINITY;
            for shape in tree.nearest_traverse_iterator(ray, &own) {
                let [a, b, c] = &shape.corners;
                best = best.min(ray.intersects_triangle(a, b, c).distance);
                // Boxes come by distance; those behind the best could be left out if their distance were told.
            }
            best
        };
        // The same triangles are met at the same distances.
        for (k, &(face, from, d)) in rays.iter().enumerate() {
            let ours = geometry.cast(face, from, d).unwrap().distance;
            if let Some(theirs) = mesh.cast_local_ray(&with_parry[k], 10.0, true) {
                assert!(
                    (ours - theirs).abs() < 1e-6 || theirs < 1e-6,
                    "{ours} {theirs}"
                );
            }
        }
        group.throughput(Throughput::Elements(RAYS as u64));
        group.bench_function(BenchmarkId::new("fredholm", count), |b| {
            b.iter(|| {
                let hits = rays
                    .iter()
                    .map(|&(face, from, d)| geometry.cast(face, from, d));
                hits.map(|hit| hit.map_or(0.0, |hit| hit.distance))
                    .sum::<f64>()
            });
        });
        group.bench_function(BenchmarkId::new("parry3d", count), |b| {
            b.iter(|| {
                let hits = with_parry
                    .iter()
                    .map(|ray| mesh.cast_local_ray(ray, 10.0, true));
                hits.map(Option::unwrap_or_default).sum::<f64>()
            });
        });
        group.bench_function(BenchmarkId::new("bvh", count), |b| {
            b.iter(|| with_bvh.iter().map(by_bvh).sum::<f64>());
        });
    }
    group.finish();
    let mut group = c.benchmark_group("a scene is built and validated");
    group.sample_size(10);
    for n in [20, 64] {
        group.bench_function(BenchmarkId::from_parameter(n), |b| b.iter(|| balls(n)));
    }
    group.finish();
}

criterion_group!(all, casting);
criterion_main!(all);
