//! Nanoseconds per state on one thread: the generic engine beside a hand-specialised loop of the
//! same arithmetic and the loop one writes first.

mod loops;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
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

criterion_group!(benches, circle);
criterion_main!(benches);
