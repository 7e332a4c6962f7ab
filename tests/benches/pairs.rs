//! The price of a pointwise pair: an exact integral over a cell, beside a visited state of a walk without such pairs.
//! The constants by which `pairs = "theory"` reckons are ratios of these.

use core::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use fredholm_circle::{Harmonic, MeanOver};
use fredholm_core::galerkin::PairIntegral;
use fredholm_core::{
    Batch, Equation, Estimator, Form, Functional, Length, Located, Neighbour, NeighbourOf, Task,
};
use fredholm_cube::{Mean, model};
use fredholm_room::{Choice, Grading, Visibility};
use fredholm_tests::circle::{IN_S, LIGHT, RHO, with_polynomials};
use fredholm_tests::cube::{ALL, with_smooth};
use fredholm_tests::room::{Setup, furnished};

/// A state of a walk.
fn states<E, N, T>(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, of: (&E, &N, &T, f64))
where
    E: Equation<Scalar = f64>,
    N: NeighbourOf<E>,
    T: Functional<E>,
{
    let (equation, neighbour, functional, value) = of;
    let task = Task {
        equation,
        neighbour,
        functional,
        control_mean: Some(value),
        estimator: Estimator::Absorption,
        form: Form::Product,
        seeds: <fredholm_core::WalkSeeds>::new(1, 0),
        length: Length::default(),
    };
    let run = || {
        let mut batch = Batch::new(0, 10_000, 10_000);
        batch.run(&task, u64::MAX).unwrap();
        *batch.statistics()
    };
    group.throughput(Throughput::Elements(run().states()));
    group.bench_function(format!("a state, {name}"), |b| b.iter(run));
}

/// An integral over a cell.
fn integrals<P: PairIntegral<B>, const B: usize>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    problem: &P,
    pairs: &[(Located<P::Point>, usize)],
) {
    group.throughput(Throughput::Elements(pairs.len() as u64));
    group.bench_function(format!("an integral, {name}"), |b| {
        b.iter(|| {
            for (x, j) in pairs {
                black_box(problem.pair_integral(x, *j));
            }
        });
    });
}

fn circles(c: &mut Criterion) {
    fn at<const B: usize>(c: &mut Criterion) {
        let mut group = c.benchmark_group("circle");
        group.sample_size(10);
        let degree = format!("degree {}", B - 1);
        with_polynomials::<f64, Harmonic, _, _, B>(
            &RHO,
            100,
            LIGHT,
            IN_S,
            |circle, neighbour, v| {
                let all = MeanOver::new(circle, 0.0, core::f64::consts::TAU).unwrap();
                states(&mut group, &degree, (circle, neighbour, &all, all.of(v)));
                let polynomials = circle.with_functions::<B>();
                let pairs: Vec<_> = (0..100)
                    .flat_map(|i| {
                        let x = neighbour.locate(circle.point(0.0628 * (f64::from(i) + 0.3)));
                        (0..100).map(move |j| (x, j))
                    })
                    .collect();
                integrals(&mut group, &degree, &polynomials, &pairs);
            },
        );
        group.finish();
    }
    at::<1>(c);
    at::<2>(c);
    at::<3>(c);
    at::<4>(c);
    at::<5>(c);
}

fn cubes(c: &mut Criterion) {
    fn at<const D: usize>(c: &mut Criterion, cells: usize) {
        let mut group = c.benchmark_group("cube");
        group.sample_size(10);
        let model = model::distance(1, 1.0);
        let name = format!("dimension {D}");
        let equation = (model.kernel, model.source);
        with_smooth::<f64, D, _, _, _, _>(equation, cells, ALL, 0.0, |cube, neighbour, v| {
            states(&mut group, &name, (cube, neighbour, &Mean, Mean::of(v)));
            let n = v.len();
            let pairs: Vec<_> = (0..20)
                .flat_map(|i| {
                    let x = neighbour.locate([(f64::from(i) + 0.3) / 20.0; D]);
                    (0..n).map(move |j| (x, j))
                })
                .collect();
            integrals(&mut group, &name, cube, &pairs);
        });
        group.finish();
    }
    at::<1>(c, 100);
    at::<2>(c, 10);
    at::<3>(c, 5);
}

fn rooms(c: &mut Criterion) {
    fn at<const B: usize>(c: &mut Criterion) {
        let mut group = c.benchmark_group("furnished room");
        group.sample_size(10);
        let degree = format!("degree {}", B - 1);
        let grading = Grading::of_pairs(B - 1);
        let setup = Setup::<B>::of_degree::<f64>(&furnished(), 400, grading).unwrap();
        setup.with_polynomials::<f64, _>(Choice::Paper, |polynomials, neighbour, v, lengths| {
            let room = polynomials.room();
            let mean = fredholm_room::MeanOver::new(room, lengths, 0..lengths.len() - 1).unwrap();
            states(&mut group, &degree, (room, neighbour, &mean, mean.of(v)));
            let n = room.table().len();
            for (name, wanted) in [
                ("partly seen", [Visibility::Partial; 2]),
                ("wholly seen", [Visibility::Full, Visibility::FullBounded]),
            ] {
                let mut pairs = Vec::new();
                for i in 0..n {
                    let x = neighbour.locate(room.inside(i, 0.3).unwrap());
                    let seen = (0..n).filter(|&j| wanted.contains(&room.views().visibility(i, j)));
                    pairs.extend(seen.map(|j| (x, j)));
                }
                println!("{name}, {degree}: {} of {} pairs", pairs.len(), n * n);
                integrals(
                    &mut group,
                    &format!("{name}, {degree}"),
                    polynomials,
                    &pairs,
                );
            }
        });
        group.finish();
    }
    at::<1>(c);
    at::<2>(c);
    at::<3>(c);
    at::<4>(c);
    at::<5>(c);
}

criterion_group!(all, circles, cubes, rooms);
criterion_main!(all);
