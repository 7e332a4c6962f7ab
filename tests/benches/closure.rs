//! Nanoseconds per state on one thread of a kernel as a closure, walked as `Solver` walks it, beside the same kernel by
//! the trait of `fredholm-cube`.

use core::hint::black_box;
use std::time::Instant;

use fredholm::model::Request;
use fredholm::{CubeModel, Goal, Model, Partitioned, Region, Settings, System};
use fredholm_core::galerkin::{Cells, Dense, DiagonalRule, PairKind, Piecewise, Solution};
use fredholm_core::{Form, Goals, Job, Real, RunOptions, WalkOptions};
use fredholm_cube::{Cube, CubeRule, KernelFn, Mean, ScalarField};
use fredholm_rayon::run;

const WALKS: u64 = 20_000;
/// Runs of each way.
const ROUNDS: usize = 300;

/// ½ exp(−|x − y|²).
#[derive(Clone, Copy)]
struct Gauss;

/// ½/(1 + (x₁ − y₁)²): as cheap as kernels get.
#[derive(Clone, Copy)]
struct Rational;

/// 1 + x₁.
#[derive(Clone, Copy)]
struct Rising;

impl<const D: usize> KernelFn<f64, D> for Gauss {
    #[inline]
    fn kernel(&self, x: &[f64; D], y: &[f64; D]) -> f64 {
        let square: f64 = x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum();
        0.5 * Real::exp(-square)
    }
}

impl<const D: usize> KernelFn<f64, D> for Rational {
    #[inline]
    fn kernel(&self, x: &[f64; D], y: &[f64; D]) -> f64 {
        0.5 / (1.0 + (x[0] - y[0]) * (x[0] - y[0]))
    }
}

impl<const D: usize> ScalarField<f64, D> for Rising {
    #[inline]
    fn value(&self, x: &[f64; D]) -> f64 {
        1.0 + x[0]
    }
}

/// The estimate of a job of one goal, and the states that its walks visit.
fn walked(job: &dyn Job) -> (f64, u64) {
    let outcome = run(job, &RunOptions::new(WALKS), None, &()).unwrap();
    let statistics = &outcome.statistics[0];
    (statistics.preconditioned().estimate, statistics.states())
}

/// Hands out the job of the mean, by the trait.
fn by_trait<K, const D: usize>(
    kernel: K,
    per_axis: usize,
    form: Form,
    then: &mut dyn FnMut(&dyn Job),
) where
    K: KernelFn<f64, D> + Copy + Sync,
{
    let cube = Cube::<f64, D, _, _>::new(kernel, Rising, per_axis).unwrap();
    let rule = CubeRule::new(&cube, 0, 1).unwrap();
    let entries = rule.table(&kernel).unwrap();
    let dense = Dense::new(&entries, cube.cells(), 1).unwrap();
    let solution = Solution::new(&dense, rule.means(&Rising).unwrap(), 1e-14, 1000).unwrap();
    let all = DiagonalRule {
        diagonal: PairKind::Galerkin,
    };
    let vectors = solution.for_walks::<f64, _>(&dense, all).unwrap();
    let neighbour: Piecewise<'_, _, _, _, _, _, 1> = vectors.piecewise(&cube, &dense).unwrap();
    let goals = [fredholm_core::Goal::new(
        Mean,
        Some(Mean::of(vectors.v(), 1)),
    )];
    let walk = WalkOptions {
        form,
        ..WalkOptions::default()
    };
    then(&Goals::new(&cube, &neighbour, &goals, walk));
}

/// Hands out the same job, by a closure.
fn by_closure(model: &CubeModel, per_axis: usize, form: Form, then: &mut dyn FnMut(&dyn Job)) {
    let settings = Settings {
        cells: Some(per_axis),
        form: Some(form),
        ..Settings::default()
    };
    let goals = [Goal::new("mean", Region::Whole)];
    let request = Request {
        goals: &goals,
        walk: &settings.walk_options(),
        only_u: true,
    };
    let cells: Box<dyn Partitioned<'_>> = model.partition(&settings.discretisation()).unwrap();
    let system: Box<dyn System> = cells.solve().unwrap();
    let done = system.job(&request, &mut |prepared| {
        then(prepared.job);
        Ok(())
    });
    done.unwrap();
}

/// Prints nanoseconds per state of both ways and their ratio: the least of many runs in turn, as what else a machine does
/// moves its clock by more than what is to be seen.
fn side_by_side<K, const D: usize>(name: &str, kernel: K, per_axis: usize)
where
    K: KernelFn<f64, D> + Copy + Send + Sync + 'static,
{
    let model = CubeModel::from_fn::<D>(
        move |x, y| kernel.kernel(x, y),
        |x| ScalarField::<f64, D>::value(&Rising, x),
    );
    for form in [Form::Product, Form::Residual] {
        by_trait::<K, D>(kernel, per_axis, form, &mut |by_trait| {
            by_closure(&model, per_axis, form, &mut |by_closure| {
                // The same walks, to the bit.
                assert_eq!(walked(by_trait), walked(by_closure));
                let mut least = [f64::INFINITY; 2];
                for _ in 0..ROUNDS {
                    for (least, job) in least.iter_mut().zip([by_trait, by_closure]) {
                        let start = Instant::now();
                        let (_, states) = black_box(walked(black_box(job)));
                        *least = least.min(start.elapsed().as_secs_f64() * 1e9 / states as f64);
                    }
                }
                let [by_trait, by_closure] = least;
                let ratio = by_closure / by_trait;
                println!(
                    "{name}, d = {D}, {form:?}: {by_trait:.2} ns by trait, {by_closure:.2} ns as a closure, ratio {ratio:.3}"
                );
            });
        });
    }
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.unwrap().install(|| {
        side_by_side::<_, 1>("rational", Rational, 50);
        side_by_side::<_, 3>("rational", Rational, 5);
        side_by_side::<_, 1>("gauss", Gauss, 50);
        side_by_side::<_, 3>("gauss", Gauss, 5);
    });
}
