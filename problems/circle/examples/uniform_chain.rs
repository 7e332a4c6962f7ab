//! What a chain with uniform steps would gain on the circle: standard error × √(processor time) of the chain of the paper, whose steps have
//! the density |sin((t − s)/2)|/4, and of one whose states are independent and uniform, with k = K/p. Walks are pseudo-random or draw from a
//! Sobol' sequence with survivals; all pairs are pointwise, so that h = k on both chains and G is the same. Walks of points and means are
//! those of the library, eight side by side on the chain of the paper; of a whole function both go one by one.
//!
//! `cargo run --profile dist -p fredholm-circle --all-features --example uniform_chain`, with the walks of a replicate, unless they are 4096, and then
//! `collision` for that estimator.

use fredholm_circle::{
    Circle, CircleScores, Harmonic, Moment, Point, PolynomialCircle, Residual, SideBySide, Tables,
    moments, residual_moments,
};
use fredholm_core::whole::{
    Replicate, ReplicateCounts, Scores, Starts, WholeJob, WholeTask, over_replicates,
};
use fredholm_core::{
    Batch, Estimator, Functional, Goal, Goals, Job, Kernel, Located, Neighbour, Sampler, Sobol,
    Source, StateSpace, Statistics, Uniforms, WalkOptions,
};

const REPLICATES: u64 = 32;
const DEGREES: [&str; 3] = ["0, 100 cells", "1, 100 cells", "3, 50 cells"];

type Light = Circle<'static, f64, Harmonic>;

/// The equation of a circle with uniform steps.
#[derive(Clone, Copy)]
struct UniformSteps<'a>(&'a Light);

impl StateSpace for UniformSteps<'_> {
    type Scalar = f64;
    type Point = Point<f64>;
}

impl Sampler for UniformSteps<'_> {
    fn absorption(&self, x: &Point<f64>) -> f64 {
        self.0.absorption(x)
    }
    fn step<U: Uniforms<f64>>(&self, _: &Point<f64>, uniforms: &mut U) -> Option<Point<f64>> {
        Some(self.0.start(uniforms))
    }
}

impl Kernel for UniformSteps<'_> {
    /// K/p with p = (1 − q)/2π.
    fn kernel(&self, x: &Point<f64>, y: &Point<f64>) -> f64 {
        let ((a, b), (c, d)) = (x.half_angle(), y.half_angle());
        0.5 * core::f64::consts::PI * (d * a - c * b).abs() * self.0.kernel(x, y)
    }
}

impl Source for UniformSteps<'_> {
    fn source(&self, x: &Point<f64>) -> f64 {
        self.0.source(x)
    }
}

impl Starts for UniformSteps<'_> {
    fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> Point<f64> {
        self.0.start(uniforms)
    }
    fn start_density(&self, x: &Point<f64>) -> f64 {
        self.0.start_density(x)
    }
    fn survival(&self) -> Option<f64> {
        self.0.survival()
    }
}

/// A point, or the mean.
#[derive(Clone, Copy)]
enum Target<'a> {
    Point(Point<f64>),
    Mean(&'a Light),
}

impl<E: StateSpace<Scalar = f64, Point = Point<f64>>> Functional<E> for Target<'_> {
    fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> (Point<f64>, f64) {
        match self {
            Self::Point(x) => (*x, 1.0),
            Self::Mean(circle) => (circle.start(uniforms), 1.0),
        }
    }
}

/// Nanoseconds of the processor so far; 0 where nobody tells.
fn nanoseconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let first = text.split_whitespace().next();
    first.and_then(|number| number.parse().ok()).unwrap_or(0.0)
}

/// Standard error × √seconds of one goal.
fn work(job: &dyn Job, walks: u64) -> f64 {
    let (start, mut all) = (nanoseconds(), Statistics::default());
    for index in 0..REPLICATES {
        let mut batch = Batch::new(index, walks, walks * REPLICATES);
        job.run(0, &mut batch, walks).expect("finite scores");
        all.merge(batch.statistics());
    }
    let seconds = 1e-9 * (nanoseconds() - start);
    all.preconditioned().std_error.unwrap_or(f64::NAN) * seconds.sqrt()
}

/// Root mean square of the standard error over points × √seconds of the walks of a whole function.
fn whole_work<const B: usize>(
    job: &dyn WholeJob,
    polynomials: &PolynomialCircle<'_, 'static, f64, Harmonic, B>,
    (cells, walks): (usize, u64),
) -> f64 {
    let start = nanoseconds();
    let replicate = |r| {
        let (mut sums, mut out) = (vec![0.0; job.unknowns()], vec![0.0; job.unknowns()]);
        let mut replicate = Replicate::new(r, REPLICATES, ReplicateCounts::default(), &mut sums);
        job.run(&mut replicate, walks).expect("finite scores");
        let measure = core::f64::consts::TAU / cells as f64;
        job.normalisation()
            .fill(&sums, walks, |_| measure, &mut out);
        out
    };
    let rows: Vec<Vec<f64>> = (0..REPLICATES).map(replicate).collect();
    let seconds = 1e-9 * (nanoseconds() - start);
    let images = rows.iter().map(|row| {
        let mut own = vec![Moment::default(); cells];
        moments(polynomials, row, &mut own).expect("moments");
        let image = Residual::new(polynomials, row, &own).expect("an image");
        let at = |i: u32| {
            let point = polynomials.circle().point(0.0628 * f64::from(i));
            image.reflected(&Located {
                cell: point.cell(),
                point,
            })
        };
        (0..100).map(at).collect::<Vec<f64>>()
    });
    let images: Vec<Vec<f64>> = images.collect();
    let squares = (0..100).map(|i| {
        let values: Vec<f64> = images.iter().map(|image| image[i]).collect();
        over_replicates(&values).std_error.powi(2)
    });
    (squares.sum::<f64>() / 100.0 * seconds).sqrt()
}

/// The rows of a degree: B functions for v, S for scores.
fn rows<const B: usize, const S: usize>(
    name: &str,
    cells: usize,
    (walks, estimator): (u64, Estimator),
) {
    let tables: &'static Tables<f64> = Box::leak(Box::new(
        Tables::new(&[0.3, 0.7, 0.0, 0.55, 0.74], cells).expect("tables"),
    ));
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    let circle: Light = Circle::new(tables.cells(), light, 0.2).expect("a circle");
    let polynomials = circle.with_functions::<B>();
    let solution = polynomials.solve(1e-15, 1000).expect("a solution");
    let of_v = residual_moments(&polynomials, &solution).expect("moments");
    let neighbour = Residual::new(&polynomials, &solution.v, &of_v).expect("a neighbour");
    let finer = circle.with_functions::<S>();
    let scores = CircleScores(&finer);
    let scores: &(dyn Scores<Point<f64>> + Sync) = &scores;
    let uniform = UniformSteps(&circle);
    let x = circle.point(1.0);
    let mean = solution.v.iter().step_by(B).sum::<f64>() / cells as f64;
    let at = neighbour.value(&Located {
        cell: x.cell(),
        point: x,
    });
    println!("degree {name}: point, mean, whole function");
    for (draws, survivals) in [
        ("random", 0),
        ("sequence", 2),
        ("sequence", 4),
        ("sequence", 8),
    ] {
        let options = WalkOptions {
            survivals,
            estimator,
            ..WalkOptions::default()
        };
        print!("  {draws:<8}, {survivals} survivals:");
        let mut line = [[0.0; 3]; 2];
        for (number, (target, value)) in [(Target::Point(x), at), (Target::Mean(&circle), mean)]
            .into_iter()
            .enumerate()
        {
            let goals = [Goal {
                functional: target,
                control_mean: Some(value),
            }];
            let own = Goals::new(&circle, &neighbour, &goals, options);
            let other = Goals::new(&uniform, &neighbour, &goals, options);
            let [a, b] = if survivals == 0 {
                [work(&SideBySide::new(own), walks), work(&other, walks)]
            } else {
                [
                    work(&own.with_generator::<Sobol>(), walks),
                    work(&other.with_generator::<Sobol>(), walks),
                ]
            };
            (line[0][number], line[1][number]) = (a, b);
        }
        let own: WholeTask<'_, _, _, _, _> =
            WholeTask::new(&circle, &circle, &neighbour, scores, options);
        let other: WholeTask<'_, _, _, _, _> =
            WholeTask::new(&uniform, &uniform, &neighbour, scores, options);
        [line[0][2], line[1][2]] = if survivals == 0 {
            [
                whole_work(&own, &finer, (cells, walks)),
                whole_work(&other, &finer, (cells, walks)),
            ]
        } else {
            [
                whole_work(&own.with_generator::<Sobol>(), &finer, (cells, walks)),
                whole_work(&other.with_generator::<Sobol>(), &finer, (cells, walks)),
            ]
        };
        for (chain, values) in ["own", "uniform"].into_iter().zip(line) {
            print!(" {chain}");
            for value in values {
                print!(" {value:.1e}");
            }
        }
        println!();
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let walks = arguments
        .next()
        .map_or(4096, |walks| walks.parse().expect("a number of walks"));
    let estimator = match arguments.next().as_deref() {
        Some("collision") => Estimator::Collision,
        _ => Estimator::Absorption,
    };
    println!(
        "standard error × √(seconds of the walks), {REPLICATES} replicates of {walks} walks, {estimator:?}"
    );
    rows::<1, 3>(DEGREES[0], 100, (walks, estimator));
    rows::<2, 4>(DEGREES[1], 100, (walks, estimator));
    rows::<4, 6>(DEGREES[2], 50, (walks, estimator));
}
