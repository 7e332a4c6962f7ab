//! Rays per second on one thread in rooms of 100 to 100,000 walls, beside the ray casting of
//! parry2d on the same walls and rays; the time to build and validate a room; and a state of a walk
//! by degree.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fredholm_core::{
    Batch, Chain, DefaultGenerator, Goal, Goals, Job, RngUniforms, Uniforms, WalkOptions, WalkSeeds,
};
use fredholm_room::{Grading, MeanOver, Mesh, Tables};
use fredholm_tests::room::{Drawing, Setup, Way, crowd, furnished, polygon};
use parry2d_f64::math::Vector;
use parry2d_f64::query::{Ray, RayCast};
use parry2d_f64::shape::Polyline;

const RAYS: usize = 10_000;

/// What a walk casts: wall, origin, direction.
fn rays(tables: &Tables<f64>) -> Vec<(u32, [f64; 2], [f64; 2])> {
    let room = tables.room();
    let mut uniforms = RngUniforms(WalkSeeds::<DefaultGenerator>::new(1, 0).generator(0));
    let mut x = room.on_wall(0, 0.4).unwrap();
    (0..RAYS)
        .map(|_| {
            let from = x;
            x = room.step(&x, &mut uniforms).unwrap();
            let _: f64 = uniforms.uniform();
            let [a, b] = [from, x].map(|p| p.position());
            let d = [b[0] - a[0], b[1] - a[1]];
            let length = d[0].hypot(d[1]);
            (from.wall() as u32, a, d.map(|d| d / length))
        })
        .collect()
}

fn casting(c: &mut Criterion, name: &str, drawing: impl Fn(usize) -> Drawing) {
    let mut group = c.benchmark_group(format!("{name}, a ray"));
    for n in [100, 1000, 10_000, 100_000] {
        let scene = drawing(n).scene::<f64>().unwrap();
        let mesh = Mesh::new::<f64>(&scene, 1, Grading::default()).unwrap();
        let tables = Tables::<f64>::new(&scene, &mesh);
        let geometry = tables.geometry();
        let rays = rays(&tables);
        let walls = geometry.walls();
        let ends = walls.iter().flat_map(|w| w.ends);
        let vertices: Vec<Vector> = ends.map(|[x, y]| Vector::new(x, y)).collect();
        let edges = (0..walls.len() as u32)
            .map(|w| [2 * w, 2 * w + 1])
            .collect();
        let polyline = Polyline::new(vertices, Some(edges));
        // The same walls are met at the same distances. A wall is not left out there, so that rays
        // start a little off it.
        const OFF: f64 = 1e-9;
        let others: Vec<Ray> = rays
            .iter()
            .map(|&(_, [x, y], [dx, dy])| {
                let from = Vector::new(x + OFF * dx, y + OFF * dy);
                Ray::new(from, Vector::new(dx, dy))
            })
            .collect();
        for (&(wall, from, d), ray) in rays.iter().zip(&others) {
            let ours = geometry.cast(wall, from, d).unwrap().distance;
            if let Some(theirs) = polyline.cast_local_ray(ray, 10.0, true) {
                assert!((ours - theirs).abs() < 1e-6, "{ours} {theirs}");
            }
        }
        group.throughput(Throughput::Elements(RAYS as u64));
        group.bench_function(BenchmarkId::new("fredholm", n), |b| {
            b.iter(|| {
                let hits = rays
                    .iter()
                    .map(|&(wall, from, d)| geometry.cast(wall, from, d));
                hits.map(|hit| hit.map_or(0.0, |hit| hit.distance))
                    .sum::<f64>()
            });
        });
        group.bench_function(BenchmarkId::new("parry2d", n), |b| {
            b.iter(|| {
                let hits = others
                    .iter()
                    .map(|ray| polyline.cast_local_ray(ray, 10.0, true));
                hits.map(Option::unwrap_or_default).sum::<f64>()
            });
        });
    }
    group.finish();
}

fn benches(c: &mut Criterion) {
    casting(c, "obstacles", crowd);
    casting(c, "polygon", |n| polygon(n, 0.5, f64::cos));
    let mut group = c.benchmark_group("a room is built and validated");
    group.sample_size(10);
    for n in [10_000, 100_000] {
        let drawing = crowd(n);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter(|| drawing.scene::<f64>().unwrap());
        });
    }
    group.finish();
}

/// A state of the furnished room by degree, 1,000 unknowns, with a ray a score and with an exact G.
fn degrees(c: &mut Criterion) {
    fn at<const B: usize>(c: &mut Criterion) {
        let grading = Grading::of_degree(B - 1);
        let setup = Setup::<B>::of_degree::<f64>(&furnished(), 1000 / B, grading).unwrap();
        let mut group = c.benchmark_group("furnished room, a state by degree");
        group.sample_size(10);
        for way in [Way::Rays, Way::Exact] {
            setup.with::<f64, _>(way, |room, neighbour, v| {
                let mean = MeanOver::everything(room);
                let value = mean.of(v);
                let goals = [Goal::new(mean, Some(value))];
                let job = Goals::new(room, neighbour, &goals, WalkOptions::default());
                let run = || {
                    let mut batch = Batch::new(0, 10_000, 10_000);
                    job.run(0, core::slice::from_mut(&mut batch), u64::MAX)
                        .unwrap();
                    *batch.statistics()
                };
                group.throughput(Throughput::Elements(run().states()));
                let name = format!("{way:?}, degree");
                group.bench_function(BenchmarkId::new(name, B - 1), |b| b.iter(run));
            });
        }
        group.finish();
    }
    at::<1>(c);
    at::<2>(c);
    at::<3>(c);
    at::<4>(c);
    at::<5>(c);
}

criterion_group!(all, degrees, benches);
criterion_main!(all);
