//! The cube, d = 3, m = 10 (n = 1000), Gaussian kernel: set-up of a table and of a product, and visited
//! states per second on all threads, beside the loop that one writes first; and what a state costs by degree.

use core::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fredholm_core::galerkin::{
    Cells, Coefficients, Dense, DiagonalRule, PairKind, Piecewise, Solution, buffer, functions,
};
use fredholm_core::{
    Absorption, Estimator, Form, Goal, Goals, Neighbour, Real, RngUniforms, RunOptions, Uniforms,
    WalkOptions, WalkSeeds,
};
use fredholm_cube::{Cube, CubeRule, KernelFactors, Mean, ScalarField};
use fredholm_rayon::{fill_rows, run};

const PER_AXIS: usize = 10;
const CELLS: usize = 1000;
const ABSORPTION: f64 = 0.2;
const WALKS: u64 = 400_000;
const ALL: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Galerkin,
};

/// Walks of the paper.
fn options() -> WalkOptions {
    WalkOptions {
        absorption: Absorption::Constant {
            probability: ABSORPTION,
            estimator: Estimator::Absorption,
        },
        form: Form::Product,
        ..WalkOptions::default()
    }
}

/// ½ exp(−|x − y|²) as a product.
#[derive(Clone, Copy, Debug)]
struct Factors;

impl KernelFactors<f64> for Factors {
    fn factor(&self, axis: usize, x: f64, y: f64) -> f64 {
        let scale = if axis == 0 { 0.5 } else { 1.0 };
        scale * Real::exp(-(x - y) * (x - y))
    }
}

/// The same as one formula: one exponential instead of three.
fn gauss(x: &[f64; 3], y: &[f64; 3]) -> f64 {
    let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
    0.5 * Real::exp(-square)
}

fn source(x: &[f64; 3]) -> f64 {
    1.0 + x[0]
}

type Kernel = fn(&[f64; 3], &[f64; 3]) -> f64;
type Source = fn(&[f64; 3]) -> f64;

fn table(rule: &CubeRule<3>) -> Vec<f64> {
    let mut entries = buffer(CELLS * CELLS).unwrap();
    fill_rows(&mut entries, CELLS, |i, row| rule.fill_row(&gauss, i, row)).unwrap();
    entries
}

/// The Galerkin solution with these coefficients.
fn solution<const D: usize>(
    rule: &CubeRule<D>,
    matrix: &dyn fredholm_core::galerkin::GalerkinMatrix<Scalar = f64>,
    source: &dyn ScalarField<f64, D>,
) -> Solution {
    Solution::new(matrix, rule.means(source).unwrap(), 1e-14, 1000).unwrap()
}

/// Points per axis of the rules that are timed; 1 is what piecewise constants need.
fn set_up(c: &mut Criterion) {
    let mut group = c.benchmark_group("cube, set-up");
    group.sample_size(10);
    for points in [1, 2] {
        let cube = Cube::<f64, 3, _, _>::new(gauss, source, PER_AXIS).unwrap();
        group.bench_function(BenchmarkId::new("general", points), |b| {
            b.iter(|| {
                let rule = CubeRule::new(&cube, 0, points).unwrap();
                let entries = table(&rule);
                let dense = Dense::new(&entries, CELLS, 1).unwrap();
                let solution = solution(&rule, &dense, &source);
                solution.source::<f64>(&dense, &ALL).unwrap()
            });
        });
        group.bench_function(BenchmarkId::new("product", points), |b| {
            b.iter(|| {
                let rule = CubeRule::new(&cube, 0, points).unwrap();
                let tables = rule.product_tables(&Factors).unwrap();
                let solution = solution(&rule, &tables, &source);
                solution.source::<f64>(&tables, &ALL).unwrap()
            });
        });
    }
    group.finish();
}

/// v and G with these coefficients.
fn solved<C: Coefficients<Scalar = f64>>(
    rule: &CubeRule<3>,
    coefficients: &C,
) -> (Vec<f64>, Vec<f64>) {
    let solution = solution(rule, coefficients, &source);
    let g = solution.source::<f64>(coefficients, &ALL).unwrap();
    (solution.v, g)
}

/// Walks for the mean: the estimate, and the states that they visited.
fn engine<C: Coefficients<Scalar = f64> + Sync>(
    cube: &Cube<f64, 3, Kernel, Source>,
    coefficients: &C,
    (v, g): &(Vec<f64>, Vec<f64>),
) -> (f64, u64) {
    let neighbour = Piecewise::new(cube, coefficients, ALL, v, g).unwrap();
    let goals = [Goal::new(Mean, Some(Mean::of(v, 1)))];
    let job = Goals::new(cube, &neighbour, &goals, options());
    let outcome = run(&job, &RunOptions::new(WALKS), None, &()).unwrap();
    let statistics = &outcome.statistics[0];
    (statistics.preconditioned().estimate, statistics.states())
}

/// The loop that one writes first: one thread, a table, sums.
fn straightforward(entries: &[f64], v: &[f64], g: &[f64]) -> (f64, u64) {
    let locate = |x: &[f64; 3]| {
        x.iter()
            .fold(0, |cell, x| cell * PER_AXIS + ((x * 10.0) as usize).min(9))
    };
    let value = v.iter().sum::<f64>() / CELLS as f64;
    let (mut sum, mut visited) = (0.0, 0);
    let seeds = <WalkSeeds>::new(1, 0);
    for walk in 0..WALKS {
        let mut draws = RngUniforms(seeds.generator(walk));
        let mut x: [f64; 3] = core::array::from_fn(|_| Uniforms::<f64>::uniform(&mut draws));
        let (mut k, mut h) = (1.0, 1.0);
        loop {
            visited += 1;
            let i = locate(&x);
            if Uniforms::<f64>::uniform(&mut draws) < ABSORPTION {
                sum += (k * source(&x) - h * g[i]) / ABSORPTION;
                break;
            }
            let y: [f64; 3] = core::array::from_fn(|_| Uniforms::<f64>::uniform(&mut draws));
            let j = locate(&y);
            k *= gauss(&x, &y) / (1.0 - ABSORPTION);
            h *= entries[i * CELLS + j] * CELLS as f64 / (1.0 - ABSORPTION);
            x = y;
        }
    }
    (value + sum / WALKS as f64, visited)
}

fn walks(c: &mut Criterion) {
    let mut group = c.benchmark_group("cube, a state");
    group.sample_size(10);
    let cube = Cube::<f64, 3, Kernel, Source>::new(gauss, source, PER_AXIS).unwrap();
    let rule = CubeRule::new(&cube, 0, 1).unwrap();
    let entries = table(&rule);
    let dense = Dense::new(&entries, CELLS, 1).unwrap();
    let tables = rule.product_tables(&Factors).unwrap();
    assert_eq!(cube.cells(), CELLS);
    let by_table = solved(&rule, &dense);
    let by_product = solved(&rule, &tables);
    let (estimate, visited) = engine(&cube, &dense, &by_table);
    // All estimate the same, and draw the same numbers.
    let first = straightforward(&entries, &by_table.0, &by_table.1);
    assert!((first.0 - estimate).abs() < 1e-9 && first.1 == visited);
    group.throughput(Throughput::Elements(visited));
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.unwrap();
        group.bench_function(BenchmarkId::new("table", threads), |b| {
            b.iter(|| pool.install(|| engine(&cube, &dense, &by_table)));
        });
        group.bench_function(BenchmarkId::new("product tables", threads), |b| {
            b.iter(|| pool.install(|| engine(&cube, &tables, &by_product)));
        });
    }
    group.bench_function("straightforward, one thread", |b| {
        b.iter(|| straightforward(black_box(&entries), &by_table.0, &by_table.1));
    });
    group.finish();
}

/// One thread, d = 2 and 3, about as many unknowns at every degree.
fn degrees(c: &mut Criterion) {
    fn at<const D: usize, const B: usize>(c: &mut Criterion, per_axis: usize) {
        let kernel = |x: &[f64; D], y: &[f64; D]| {
            let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
            0.5 * Real::exp(-square)
        };
        let factors = |axis: usize, x: f64, y: f64| {
            let scale = if axis == 0 { 0.5 } else { 1.0 };
            scale * Real::exp(-(x - y) * (x - y))
        };
        let source = |x: &[f64; D]| 1.0 + x[0];
        let cube = Cube::new(kernel, source, per_axis).unwrap();
        let cube = cube.with_functions::<B>();
        let rule = CubeRule::new(&cube, cube.degree(), cube.degree() + 1).unwrap();
        let tables = rule.product_tables(&factors).unwrap();
        let solution = solution(&rule, &tables, &source);
        let g = solution.source::<f64>(&tables, &ALL).unwrap();
        let entries = rule.table(&kernel).unwrap();
        let dense = Dense::new(&entries, cube.cells(), B).unwrap();
        let by_table = Piecewise::new(&cube, &dense, ALL, &solution.v, &g).unwrap();
        let by_axes = Piecewise::new(&cube, &tables, ALL, &solution.v, &g).unwrap();
        let goals = [Goal::new(Mean, Some(Mean::of(&solution.v, B)))];
        let states =
            |neighbour: &(dyn Neighbour<Scalar = f64, Point = [f64; D], Value = f64> + Sync)| {
                let job = Goals::new(&cube, neighbour, &goals, options());
                let outcome = run(&job, &RunOptions::new(10_000), None, &()).unwrap();
                outcome.statistics[0].states()
            };
        let mut group = c.benchmark_group(format!("cube, d = {D}, a state by degree"));
        group.sample_size(10);
        group.throughput(Throughput::Elements(states(&by_table)));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.unwrap();
        let name = format!("{}, {} unknowns", cube.degree(), solution.v.len());
        group.bench_function(BenchmarkId::new("table", &name), |b| {
            b.iter(|| pool.install(|| states(&by_table)));
        });
        group.bench_function(BenchmarkId::new("product tables", &name), |b| {
            b.iter(|| pool.install(|| states(&by_axes)));
        });
        group.finish();
    }
    at::<2, { functions(2, 0) }>(c, 31);
    at::<2, { functions(2, 1) }>(c, 18);
    at::<2, { functions(2, 2) }>(c, 12);
    at::<2, { functions(2, 3) }>(c, 10);
    at::<2, { functions(2, 4) }>(c, 8);
    at::<3, { functions(3, 0) }>(c, 10);
    at::<3, { functions(3, 1) }>(c, 6);
    at::<3, { functions(3, 2) }>(c, 4);
    at::<3, { functions(3, 3) }>(c, 4);
    at::<3, { functions(3, 4) }>(c, 3);
}

criterion_group!(benches, set_up, walks, degrees);
criterion_main!(benches);
