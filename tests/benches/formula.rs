//! What a formula costs: the same kernels in Rust, evaluated at the same points.

use core::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use fredholm_core::Real;
use fredholm_file::formula::Formula;

type Kernel = fn(&[f64; 3], &[f64; 3]) -> f64;

/// Names, formulas, and the same in Rust.
const KERNELS: [(&str, &str, Kernel); 3] = [
    ("rational", "0.5 / (1 + (x1 - y1)^2)", |x, y| {
        0.5 / (1.0 + (x[0] - y[0]) * (x[0] - y[0]))
    }),
    (
        "gauss",
        "0.5 * exp(-(x1 - y1)^2 - (x2 - y2)^2 - (x3 - y3)^2)",
        |x, y| {
            let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
            0.5 * Real::exp(-square)
        },
    ),
    (
        "green",
        "x1 < y1 ? -x1 * (1 - y1) : -y1 * (1 - x1)",
        |x, y| {
            if x[0] < y[0] {
                -x[0] * (1.0 - y[0])
            } else {
                -y[0] * (1.0 - x[0])
            }
        },
    ),
];

fn kernels(c: &mut Criterion) {
    let mut group = c.benchmark_group("a kernel");
    let points: Vec<[f64; 3]> = (0..1000)
        .map(|i| [0.618, 0.414, 0.732].map(|step| (f64::from(i) * step).fract()))
        .collect();
    for (name, text, rust) in KERNELS {
        let formula = Formula::<f64>::new(text, &[]).unwrap();
        for pair in points.windows(2) {
            let (a, b) = (formula.value(&pair[0], &pair[1]), rust(&pair[0], &pair[1]));
            assert!((a - b).abs() <= 1e-15, "{name}: {a} {b}");
        }
        let sum = |kernel: &dyn Fn(&[f64; 3], &[f64; 3]) -> f64| -> f64 {
            points.windows(2).map(|p| kernel(&p[0], &p[1])).sum()
        };
        group.throughput(criterion::Throughput::Elements(points.len() as u64 - 1));
        group.bench_function(BenchmarkId::new("formula", name), |b| {
            b.iter(|| black_box(sum(&|x, y| formula.value(x, y))));
        });
        group.bench_function(BenchmarkId::new("rust", name), |b| {
            b.iter(|| black_box(sum(&|x, y| rust(x, y))));
        });
    }
    group.finish();
}

criterion_group!(benches, kernels);
criterion_main!(benches);
