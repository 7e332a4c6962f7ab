//! Nanoseconds per state on one thread: the generic engine beside a hand-specialised loop of the
//! same arithmetic and the loop one writes first.

mod loops;

use criterion::measurement::WallTime;
use criterion::{
    BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use fredholm_core::{At, Batch, Estimator, Form, Length, Task, WalkSeeds};
use fredholm_tests::circle::{DEFAULT, LIGHT, with_polynomials};
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
        assert_eq!(setup.lanes(WALKS), statistics);
        group.bench_function(BenchmarkId::new("lanes", n), |b| {
            b.iter(|| setup.lanes(WALKS));
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
        let rho = [0.3, 0.7, 0.0, 0.55, 0.74];
        with_polynomials::<f64, _, _, _, B>(
            &rho,
            1000 / B / 5 * 5,
            LIGHT,
            DEFAULT,
            |circle, n, _| {
                let task = Task {
                    equation: circle,
                    neighbour: n,
                    functional: &At(circle.point(0.3)),
                    control_mean: Some(0.0),
                    estimator: Estimator::Absorption,
                    form: Form::Product,
                    seeds: <WalkSeeds>::new(1, 0),
                    length: Length::default(),
                };
                let run = || {
                    let mut batch = Batch::new(0, WALKS, WALKS);
                    batch.run(&task, u64::MAX).unwrap();
                    *batch.statistics()
                };
                group.throughput(Throughput::Elements(run().states()));
                group.bench_function(BenchmarkId::new("degree", B - 1), |b| b.iter(run));
            },
        );
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
