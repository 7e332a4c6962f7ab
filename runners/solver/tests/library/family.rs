//! A random family of equations of any norm whose solutions are known, in one to four dimensions: smooth kernels, kinks, jumps, Volterra,
//! waves, needles; domains of length 0.1 to 100. All end with an error bar that is right, or with a reason that is true.
//!
//! Kernel and solution are products over axes, K = c Π k_a(x_a, y_a) and u = Π w_a(x_a), so that F = u − c Π ∫ k_a w_a takes integrals of one
//! variable alone: Gauss rules between all places where anything is not smooth.

use core::fmt;
use core::ops::Range;
use core::time::Duration;
use std::time::Instant;

use fredholm::{CubeModel, Method, Report, SolveError, Solver};
use fredholm_core::{DefaultGenerator, RngUniforms, Uniforms, WalkSeeds};

use crate::common::is_long;

/// Nodes and weights of the Gauss rule of ten points on [−1, 1], half of them: from Abramowitz and Stegun, table 25.4.
const GAUSS: [[f64; 2]; 5] = [
    [0.148_874_338_981_631_22, 0.295_524_224_714_752_87],
    [0.433_395_394_129_247_2, 0.269_266_719_309_996_35],
    [0.679_409_568_299_024_4, 0.219_086_362_515_982_04],
    [0.865_063_366_688_984_5, 0.149_451_349_150_580_6],
    [0.973_906_528_517_171_7, 0.066_671_344_308_688_14],
];
/// Intervals of the rule between two places where something is not smooth.
const PARTS: usize = 12;

/// What a member may take, and what it may take to show whether more time finds cells that serve, where all fit in a minute.
const LIMIT: Duration = Duration::from_secs(5);
const LONGER: Duration = Duration::from_secs(120);

/// Draws of a member.
struct Draws(RngUniforms<DefaultGenerator>);

impl Draws {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        let share: f64 = self.0.uniform();
        low + share * (high - low)
    }

    /// One of so many numbers.
    fn below(&mut self, count: usize) -> usize {
        self.between(0.0, count as f64) as usize
    }

    /// A number of a magnitude between these powers of 10.
    fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(self.between(low, high))
    }

    /// A number between −1 and 1, or 0 but for this share of all draws.
    fn some(&mut self, share: f64) -> f64 {
        let value = self.between(-1.0, 1.0);
        if self.between(0.0, 1.0) < share {
            value
        } else {
            0.0
        }
    }
}

/// One axis of a kernel, in lengths of the interval.
#[derive(Clone, Copy, Debug)]
enum Factor {
    Gaussian(f64),
    Exponential(f64),
    Rational(f64),
    Wave(f64),
    Least,
    Band(f64),
    /// k is 0 for y > x.
    Volterra(f64),
    /// A jump at a fixed place of x and of y.
    Step(f64),
}

impl Factor {
    fn new(draws: &mut Draws, dimension: usize) -> Self {
        let width = draws.magnitude(-1.3, 0.3);
        // In more dimensions than one there is no Volterra kernel of one axis that people ask about.
        match draws.below(if dimension == 1 { 8 } else { 7 }) {
            0 => Self::Gaussian(width),
            1 => Self::Exponential(width),
            2 => Self::Rational(width),
            3 => Self::Wave(0.5 / width),
            4 => Self::Least,
            5 => Self::Band(width.min(0.9)),
            6 => Self::Step(draws.between(0.2, 0.8)),
            _ => Self::Volterra(width),
        }
    }

    fn value(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Gaussian(w) => (-((x - y) / w).powi(2)).exp(),
            Self::Exponential(w) => (-(x - y).abs() / w).exp(),
            Self::Rational(w) => 1.0 / (1.0 + ((x - y) / w).powi(2)),
            Self::Wave(w) => (6.0 * w * (x - y)).cos(),
            Self::Least => x.min(y) * (1.0 - x.max(y)),
            Self::Band(w) => f64::from((x - y).abs() < w),
            Self::Volterra(w) => f64::from(y < x) * (-(x - y) / w).exp(),
            Self::Step(s) => f64::from(u8::from(x > s) + 2 * u8::from(y > s)) + 0.5,
        }
    }

    /// Where it is not smooth in y.
    fn breaks(self, x: f64) -> Vec<f64> {
        match self {
            Self::Exponential(_) | Self::Least | Self::Volterra(_) => vec![x],
            Self::Band(w) => vec![x - w, x + w],
            Self::Step(s) => vec![s],
            _ => Vec::new(),
        }
    }
}

/// One axis of a solution: 1 + a sin(ωx + φ) + b|x − s| + c [x > s].
#[derive(Clone, Copy, Debug)]
struct Shape {
    wave: [f64; 3],
    kink: [f64; 3],
}

impl Shape {
    fn new(draws: &mut Draws) -> Self {
        Self {
            wave: [
                draws.between(-1.0, 1.0),
                draws.between(0.5, 15.0),
                draws.between(0.0, 6.0),
            ],
            kink: [draws.some(0.3), draws.some(0.2), draws.between(0.1, 0.9)],
        }
    }

    fn value(&self, x: f64) -> f64 {
        let ([a, omega, phi], [kink, jump, at]) = (self.wave, self.kink);
        let jump = if x > at { jump } else { 0.0 };
        1.5 + a * (omega * x + phi).sin() + kink * (x - at).abs() + jump
    }
}

/// ∫₀¹ f between these places.
fn integral(f: impl Fn(f64) -> f64, breaks: &[f64]) -> f64 {
    let inner = breaks.iter().copied().filter(|at| (0.0..1.0).contains(at));
    let mut ends: Vec<f64> = inner.chain([0.0, 1.0]).collect();
    ends.sort_by(f64::total_cmp);
    let mut sum = 0.0;
    for own in ends.windows(2) {
        let half = 0.5 * (own[1] - own[0]) / PARTS as f64;
        for part in 0..PARTS {
            let middle = own[0] + half * (2 * part + 1) as f64;
            for [node, weight] in GAUSS {
                sum += half * weight * (f(middle - half * node) + f(middle + half * node));
            }
        }
    }
    sum
}

/// Equation of the family, on [0, length]^d.
#[derive(Clone, Debug)]
struct Member {
    factors: Vec<Factor>,
    shapes: Vec<Shape>,
    length: f64,
    scale: f64,
    at: Vec<f64>,
    error: f64,
}

impl Member {
    fn new(number: u64) -> Self {
        let seeds = WalkSeeds::<DefaultGenerator>::new(number, 0);
        let draws = &mut Draws(RngUniforms(seeds.generator(0)));
        let dimension = [1, 1, 1, 2, 2, 3, 4][draws.below(7)];
        let factors: Vec<Factor> = (0..dimension)
            .map(|_| Factor::new(draws, dimension))
            .collect();
        let shapes = (0..dimension).map(|_| Shape::new(draws)).collect();
        let length = draws.magnitude(-1.0, if dimension == 1 { 2.0 } else { 1.0 });
        // The largest ∫|k| of an axis is near that of its middle.
        let own = |factor: &Factor| integral(|y| factor.value(0.51, y).abs(), &factor.breaks(0.51));
        let norm: f64 = factors.iter().map(own).product();
        let wanted = draws.magnitude(-1.0, 1.7);
        let sign = if draws.some(0.6) > 0.0 { -1.0 } else { 1.0 };
        Self {
            scale: sign * wanted / norm / length.powi(dimension as i32),
            at: (0..dimension).map(|_| draws.between(0.0, 1.0)).collect(),
            error: [1e-5, 1e-4, 1e-3, 1e-2][dimension - 1],
            factors,
            shapes,
            length,
        }
    }

    fn solution(&self, t: &[f64]) -> f64 {
        self.shapes
            .iter()
            .zip(t)
            .map(|(shape, t)| shape.value(*t))
            .product()
    }

    fn model<const D: usize>(&self) -> CubeModel {
        let (own, of_source) = (self.clone(), self.clone());
        let length = self.length;
        let kernel = move |x: &[f64; D], y: &[f64; D]| {
            let axes = own.factors.iter().zip(x.iter().zip(y));
            let product = axes.map(|(factor, (x, y))| factor.value(x / length, y / length));
            own.scale * product.product::<f64>()
        };
        let source = move |x: &[f64; D]| {
            let own = &of_source;
            let t = x.map(|x| x / length);
            let axes = own.factors.iter().zip(&own.shapes).zip(t);
            let integrals = axes.map(|((factor, shape), t)| {
                let breaks = [factor.breaks(t), vec![shape.kink[2]]].concat();
                length * integral(|y| factor.value(t, y) * shape.value(y), &breaks)
            });
            own.solution(&t) - own.scale * integrals.product::<f64>()
        };
        CubeModel::from_fn::<D>(kernel, source).on(vec![[0.0, length]; D])
    }

    fn of_dimension(&self) -> CubeModel {
        match self.factors.len() {
            1 => self.model::<1>(),
            2 => self.model::<2>(),
            3 => self.model::<3>(),
            _ => self.model::<4>(),
        }
    }

    /// What is asked, with these cells and degree or chosen ones, and the seconds that it took.
    fn asked(
        &self,
        model: &CubeModel,
        setting: Option<[usize; 2]>,
        (limit, seed): (Duration, u64),
    ) -> (Result<Report, SolveError>, f64) {
        let at: Vec<f64> = self.at.iter().map(|t| t * self.length).collect();
        let solver = Solver::new(model)
            .at(at.as_slice())
            .mean()
            .seed(seed)
            .time_limit(limit);
        let solver = match setting {
            Some([cells, degree]) => {
                let solver = solver.method(Method::Resolvent);
                solver.cells(cells).degree(degree)
            }
            None => solver,
        };
        let begun = Instant::now();
        let solved = solver.solve_to_relative(self.error);
        (solved, begun.elapsed().as_secs_f64())
    }

    /// The least seconds of a ladder of fixed settings that reach the error.
    fn best_of_ladder(&self, limit: Duration) -> Option<f64> {
        let (model, d) = (self.of_dimension(), self.factors.len());
        let mut best: Option<f64> = None;
        for degree in [0, 1, 2, 4] {
            let own: usize =
                (1..=d).map(|k| degree + k).product::<usize>() / (1..=d).product::<usize>();
            for cells in [1, 2, 4, 8, 16, 32, 64, 128, 256, 512_usize] {
                if cells.pow(d as u32) * own > 2000 {
                    break;
                }
                let most =
                    best.map_or(limit, |best| limit.min(Duration::from_secs_f64(2.0 * best)));
                if let (Ok(_), seconds) = self.asked(&model, Some([cells, degree]), (most, 1)) {
                    best = Some(best.map_or(seconds, |best| best.min(seconds)));
                }
            }
        }
        best
    }

    fn solve(&self, limit: Duration, seed: u64) -> Outcome {
        let model = self.of_dimension();
        let (solved, seconds) = self.asked(&model, None, (limit, seed));
        let (report, is_reached) = match solved {
            Ok(report) => (report, true),
            Err(SolveError::NotReached(report)) => (*report, false),
            Err(error) => {
                return Outcome::Refused {
                    why: error.to_string(),
                    seconds,
                };
            }
        };
        let means = self
            .shapes
            .iter()
            .map(|shape| integral(|x| shape.value(x), &[shape.kink[2]]));
        let exact = [self.solution(&self.at), means.product()];
        let off = [0, 1].map(|goal| {
            let found = &report[goal];
            let [low, high] = found.interval();
            // F itself is known up to rounding of its integrals alone.
            let rounding = (1e-13 * exact[goal].abs()).max(found.rounding_floor);
            (found.value() - exact[goal]) / (0.5 * (high - low) + rounding)
        });
        Outcome::Solved {
            off,
            is_reached,
            seconds,
        }
    }
}

/// How a member ends.
enum Outcome {
    Solved {
        /// Errors of a point and the mean in halves of intervals of 95 %: where degrees of freedom are few, these are wide.
        off: [f64; 2],
        is_reached: bool,
        seconds: f64,
    },
    Refused {
        why: String,
        seconds: f64,
    },
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Solved {
                off: [point, mean],
                is_reached,
                seconds,
            } => {
                let end = if *is_reached {
                    ""
                } else {
                    ", error not reached"
                };
                write!(
                    f,
                    "off by {point:.2} and {mean:.2} of an interval in {seconds:.2} s{end}"
                )
            }
            Self::Refused { why, seconds } => write!(f, "{why} (in {seconds:.2} s)"),
        }
    }
}

/// The members that are looked at, four by day: `FREDHOLM_FAMILY="400+100"` has others, `FREDHOLM_LONG` the first 400, and looks again at
/// those that are refused for want of time. None was looked at while the method was made. `FREDHOLM_LADDER` has times of fixed settings beside those of the choice.
fn members() -> Vec<u64> {
    let of = |text: String| -> Option<Range<u64>> {
        let (first, count) = text.split_once('+')?;
        let first: u64 = first.parse().ok()?;
        Some(first..first + count.parse::<u64>().ok()?)
    };
    let own = std::env::var("FREDHOLM_FAMILY").ok().and_then(of);
    match own.or(is_long().then_some(0..400)) {
        Some(own) => own.collect(),
        // Of one dimension and of three, none of which takes seconds.
        None => vec![0, 3, 15, 16],
    }
}

/// One of 20 intervals of 95 % does not hold, and values are off by five halves of one in 2.2 of 1,000 cases at most: those of Student's t with
/// two degrees of freedom. Four standard deviations more are allowed.
#[test]
fn a_random_family_is_solved_or_refused_for_a_reason() {
    let (mut solved, mut outside, mut far, mut worst) = (0, 0, 0, 0.0_f64);
    let (mut late, mut refused, mut failures) = (0, 0, Vec::new());
    let seeds = std::env::var("FREDHOLM_SEEDS").ok();
    let seeds: u64 = seeds.and_then(|text| text.parse().ok()).unwrap_or(1);
    let has_ladder = std::env::var_os("FREDHOLM_LADDER").is_some();
    let mut ratios = Vec::new();
    for number in members() {
        let member = Member::new(number);
        let mut outcome = member.solve(LIMIT, 1);
        println!(
            "{number:>4} {:?} on a length of {:.3}, times {:.3e}: {outcome}",
            member.factors, member.length, member.scale
        );
        if matches!(&outcome, Outcome::Refused { why, .. } if why.contains("the time limit")) {
            late += 1;
            if is_long() && member.factors.len() <= 2 {
                outcome = member.solve(LONGER, 1);
                println!("     with a longer time limit: {outcome}");
            }
        }
        for seed in 2..=seeds {
            println!("     seed {seed}: {}", member.solve(LIMIT, seed));
        }
        if let (
            Outcome::Solved {
                seconds,
                is_reached: true,
                ..
            },
            true,
        ) = (&outcome, has_ladder)
            && let Some(best) = member.best_of_ladder(LIMIT)
        {
            println!("     {seconds:.3} s, {best:.3} s by the best of the ladder");
            ratios.push(seconds / best);
        }
        match outcome {
            Outcome::Refused { why, .. } => {
                refused += 1;
                let has_reason = why.contains("the spectral radius of (1 + |R|)|K - K_n| is")
                    || why.contains("the condition number of the equation is");
                if !has_reason {
                    failures.push(format!("{number}: {why}"));
                }
            }
            Outcome::Solved { off, .. } => {
                for off in off {
                    solved += 1;
                    outside += u32::from(off.abs() > 1.0);
                    far += u32::from(off.abs() > 5.0);
                    worst = worst.max(off.abs());
                }
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    if let [.., most] = ratios[..] {
        let middle = ratios[ratios.len() / 2];
        let many = ratios.iter().filter(|ratio| **ratio > 4.0).count();
        println!(
            "times over the best of the ladder: {middle:.2} in the middle, {most:.2} at most, {many} of {} above 4",
            ratios.len()
        );
    }
    println!(
        "{solved} intervals, {outside} do not hold, {far} by far, the worst off by {worst:.2} halves; {refused} members refused, {late} took longer than {LIMIT:?}"
    );
    assert!(failures.is_empty(), "{failures:#?}");
    for (name, count, share) in [("outside", outside, 0.05), ("far", far, 0.0022)] {
        let mean = share * f64::from(solved);
        assert!(
            f64::from(count) <= mean + 4.0 * mean.sqrt(),
            "{name}: {count} of {solved}"
        );
    }
}
