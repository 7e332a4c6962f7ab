//! Nanoseconds per state on one thread: the generic engine beside a hand-specialised loop of the
//! same arithmetic and the loop one writes first.

mod loops;

use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use fredholm_core::{At, Batch, Estimator, Goal, Goals, Job};
use fredholm_tests::circle::{DEFAULT, LIGHT, RHO, with_polynomials};
use fredholm_tests::paper;
use loops::{Setup, Specialised};

const WALKS: u64 = 20_000;

fn circle(c: &mut Criterion) {
    let mut group = c.benchmark_group("circle, a state");
    for n in [100, 1000] {
        let setup = Setup::new(n);
        let specialised = Specialised::new(&setup);
        let dense = setup.dense();
        let (mean, variance, states) = setup.straightforward(&dense, WALKS);
        let statistics = setup.engine(WALKS);
        // The three estimate the same: the first lines of a comparison.
        let std_error = (variance / WALKS as f64).sqrt();
        for other in [
            specialised.run(WALKS).0,
            statistics.preconditioned().estimate,
        ] {
            assert!((mean - other).abs() < 1e-3 * std_error, "{mean} {other}");
        }
        assert_eq!(states, statistics.states());
        group.throughput(Throughput::Elements(states));
        group.bench_function(BenchmarkId::new("engine", n), |b| {
            b.iter(|| setup.engine(WALKS));
        });
        group.bench_function(BenchmarkId::new("specialised", n), |b| {
            b.iter(|| specialised.run(WALKS));
        });
        group.bench_function(BenchmarkId::new("straightforward", n), |b| {
            b.iter(|| setup.straightforward(&dense, WALKS));
        });
    }
    group.finish();
}

/// A state by degree, with 1,000 unknowns in all.
fn degrees(c: &mut Criterion) {
    fn of_degree<const B: usize>(group: &mut BenchmarkGroup<'_, WallTime>) {
        let cells = 1000 / B / 5 * 5;
        with_polynomials::<f64, _, _, _, B>(&RHO, cells, LIGHT, DEFAULT, |circle, neighbour, _| {
            let goals = [Goal::new(At(circle.point(0.3)), Some(0.0))];
            let job = Goals::new(circle, neighbour, &goals, paper(Estimator::Absorption, 1));
            let run = || {
                let mut batches = [Batch::new(0, WALKS, WALKS)];
                job.run(0, &mut batches, u64::MAX).unwrap();
                batches[0].statistics()
            };
            group.throughput(Throughput::Elements(run().states()));
            group.bench_function(BenchmarkId::new("degree", B - 1), |b| b.iter(run));
        });
    }
    let mut group = c.benchmark_group("circle, a state by degree");
    // Piecewise constants through the code of all degrees; the engine above is their own.
    of_degree::<1>(&mut group);
    of_degree::<2>(&mut group);
    of_degree::<3>(&mut group);
    of_degree::<4>(&mut group);
    of_degree::<5>(&mut group);
    group.finish();
}

criterion_group!(benches, circle, degrees);
criterion_main!(benches);
