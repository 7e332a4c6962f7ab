//! What suffixes score, against walks that start there, and bands, against what they promise.

use std::vec::Vec;

use super::*;
use crate::galerkin::{Basis, Cells};
use crate::walk::{Course, Followed};
use crate::*;

mod known;

/// u(x) = ∫ K u dy + F on [0, 1) with K = ½ + ¼x y, in two cells, and as its neighbour equation another of the same kind
/// in place of a Galerkin one: h = 0.4, G = 1, v = 1/(1 − 0.4).
#[derive(Clone, Copy)]
struct Toy {
    /// Whether steps from below ½ leave with probability 0.4, which preserves no uniform density.
    uneven: bool,
    /// Whether it says that it preserves one.
    preserves: bool,
    /// What F is multiplied by.
    brightness: f64,
}

const TOY: Toy = Toy {
    uneven: false,
    preserves: true,
    brightness: 1.0,
};

impl Toy {
    /// The integral of p(x, ·).
    fn stays(&self, x: f64) -> f64 {
        if self.uneven && x < 0.5 { 0.6 } else { 1.0 }
    }
}

impl Space for Toy {
    type Scalar = f64;
    type Point = f64;
}
impl Chain for Toy {
    fn step<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> Option<f64> {
        let xi = uniforms.uniform() / self.stays(*x);
        (xi < 1.0).then_some(xi)
    }
}
impl Equation for Toy {
    type Value = f64;
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        (0.5 + 0.25 * x * y) / self.stays(*x)
    }
    fn source<U: Uniforms<f64>>(&self, x: &f64, _: &mut U) -> f64 {
        self.brightness * (1.0 + x)
    }
}
impl Stationary for Toy {
    fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
        uniforms.uniform()
    }
    fn start_density(&self, _: &f64) -> f64 {
        1.0
    }
    fn is_preserved(&self) -> bool {
        self.preserves
    }
}
impl Cells for Toy {
    const DIMENSION: usize = 1;
    fn cells(&self) -> usize {
        2
    }
    fn locate(&self, x: &f64) -> usize {
        usize::from(*x >= 0.5)
    }
    fn measure(&self, _: usize) -> f64 {
        0.5
    }
    fn point(&self, cell: usize, t: &[f64]) -> f64 {
        0.5 * (cell as f64 + t[0])
    }
    fn parameters(&self, x: &Located<f64>, t: &mut [f64]) {
        t[0] = 2.0 * x.point - x.cell as f64;
    }
    fn at(&self, x: &[f64]) -> Option<f64> {
        x.first().copied()
    }
}
impl Basis<3> for Toy {}

/// v = 0.4 ∫ v + 1.
struct Constant(Toy);
impl Space for Constant {
    type Scalar = f64;
    type Point = f64;
}
impl Neighbour for Constant {
    type Value = f64;
    fn locate(&self, x: f64) -> Located<f64> {
        Located {
            point: x,
            cell: TOY.locate(&x),
        }
    }
    fn kernel(&self, x: &Located<f64>, _: &Located<f64>, _: &f64) -> f64 {
        0.4 / self.0.stays(x.point)
    }
    fn source(&self, _: &Located<f64>, _: &mut dyn Uniforms<f64>) -> f64 {
        1.0
    }
    fn value(&self, _: &Located<f64>) -> f64 {
        1.0 / 0.6
    }
}

/// u = 1 + x + ½ a + ¼ x b with a = ∫ u and b = ∫ x u: a = 3/2 + a/2 + b/8, b = 5/6 + a/4 + b/12.
fn solution(x: f64) -> f64 {
    let determinant = 0.5 * (11.0 / 12.0) - 0.125 * 0.25;
    let a = (1.5 * 11.0 / 12.0 + 0.125 * 5.0 / 6.0) / determinant;
    let b = (0.5 * 5.0 / 6.0 + 0.25 * 1.5) / determinant;
    1.0 + x + 0.5 * a + 0.25 * x * b
}

type ToyTask<'a, const KEPT: usize, G = Independent> =
    GlobalTask<'a, Toy, Toy, Constant, BasisScores<'a, Toy, 3>, G, KEPT>;

const EVEN: Constant = Constant(TOY);
const SCORES: BasisScores<'_, Toy, 3> = BasisScores(&TOY);

/// How walks end, and the form in which they score.
type Scored = (Absorption, Form);

const fn constant(estimator: Estimator) -> Absorption {
    Absorption::Constant {
        probability: 0.3,
        estimator,
    }
}
const ABSORBED: Absorption = constant(Estimator::Absorption);
const COLLIDED: Absorption = constant(Estimator::Collision);

/// How walks of constant absorption score, which are scored in every state; the last ones score in their starts alone.
const ALL_SCORES: [Scored; 6] = [
    (ABSORBED, Form::Product),
    (ABSORBED, Form::Residual),
    (COLLIDED, Form::Product),
    (COLLIDED, Form::Residual),
    (Absorption::Roulette, Form::Product),
    (Absorption::Roulette, Form::Residual),
];

fn task<const KEPT: usize>(neighbour: &Constant, (absorption, form): Scored) -> ToyTask<'_, KEPT> {
    GlobalTask {
        equation: &neighbour.0,
        starts: &neighbour.0,
        neighbour,
        scores: &SCORES,
        known: &[],
        options: WalkOptions {
            absorption,
            form,
            seed: 5,
            ..WalkOptions::default()
        },
        generators: Independent::NEW,
    }
}

/// The coefficients of R replicates of so many walks.
fn coefficients<const KEPT: usize, G: Generators>(
    task: &ToyTask<'_, KEPT, G>,
    walks: u64,
) -> Vec<[f64; 6]> {
    let replicate = |r| {
        let (mut sums, mut out) = ([0.0; 6], [0.0; 6]);
        let mut replicate = Replicate::new(r, 32, ReplicateCounts::default(), &mut sums);
        task.run(&mut replicate, walks).unwrap();
        task.normalisation().fill(&sums, walks, |_| 0.5, &mut out);
        out
    };
    (0..32).map(replicate).collect()
}

/// Largest |z| of the coefficients against those of u − v, which is of degree 1.
fn largest_z<const KEPT: usize>(toy: Toy, scores: Scored) -> f64 {
    largest_z_of(&coefficients::<KEPT, _>(
        &task(&Constant(toy), scores),
        4000,
    ))
}

fn largest_z_of(all: &[[f64; 6]]) -> f64 {
    let root = 3.0_f64.sqrt();
    let mut largest = 0.0_f64;
    for (jb, value) in (0..6).map(|jb| (jb, all.iter().map(|c| c[jb]).collect::<Vec<_>>())) {
        let (from, middle) = [(0.0, 0.25), (0.5, 0.75)][jb / 3];
        let slope = (solution(from + 0.5) - solution(from)) / 2.0;
        let exact = [solution(middle) - 1.0 / 0.6, slope / root, 0.0][jb % 3];
        let found = over_replicates(&value);
        assert!(found.std_error > 0.0);
        largest = largest.max((found.mean - exact).abs() / found.std_error);
    }
    largest
}

/// Bound of 108 values of t with 31 degrees of freedom: none is beyond it but with probability 108 · 0.9·10⁻⁴ = 1 %.
const T: f64 = 4.5;

#[test]
fn coefficients_are_those_of_the_error_however_many_states_are_kept() {
    for scores in ALL_SCORES {
        for z in [
            largest_z::<1>(TOY, scores),
            largest_z::<3>(TOY, scores),
            largest_z::<32>(TOY, scores),
        ] {
            assert!(z < T, "{scores:?} {z}");
        }
    }
}

/// The mean of the squared standard errors of all coefficients.
fn squares(all: &[[f64; 6]]) -> f64 {
    let error = |jb: usize| {
        let values: Vec<f64> = all.iter().map(|c| c[jb]).collect();
        over_replicates(&values).std_error.powi(2)
    };
    (0..6).map(error).sum::<f64>() / 6.0
}

/// Coefficients are those of the error with Sobol' points, too, and with absorption from the fourth state on. Of 108 values of t none is beyond 4.8 but with
/// probability 108 · 3.8·10⁻⁵ = 0.4 %.
#[test]
fn coefficients_are_those_of_the_error_whatever_walks_draw() {
    for scores in ALL_SCORES {
        let mut long = task::<32>(&EVEN, scores);
        long.options.forced_steps = 3;
        let sobol = task::<32>(&EVEN, scores).with_generators(Sequence::Sobol);
        let both = long.with_generators(Sequence::Sobol);
        let plain = coefficients(&task::<1>(&EVEN, scores), 4096);
        let all = [
            coefficients(&long, 4096),
            coefficients(&sobol, 4096),
            coefficients(&both, 4096),
        ];
        for (number, all) in all.iter().enumerate() {
            let z = largest_z_of(all);
            assert!(z < 4.8, "{scores:?} {number} {z}");
        }
        let gain = squares(&plain) / squares(&all[2]);
        // Roulette makes the draws matter by jumps.
        let least = if scores.0 == Absorption::Roulette {
            20.0
        } else {
            100.0
        };
        assert!(gain > least, "{scores:?} {gain}");
    }
}

/// Functionals by the images of their adjoint: u(0.3), u(0.9) and the mean of u, of pseudo-random walks and of a sequence.
#[test]
fn functionals_are_exact_by_their_adjoint_images() {
    let kernel = |x: f64, y: &Located<f64>| 0.5 + 0.25 * x * y.point;
    let images: [&AdjointImage<'_, f64>; 3] = [&|y| kernel(0.3, y), &|y| kernel(0.9, y), &|y| {
        kernel(0.5, y)
    }];
    let scores = AdjointScores(&images);
    // F + T_K v, with v = 1/0.6.
    let iterate = |x: f64| 1.0 + x + kernel(x, &EVEN.locate(0.5)) / 0.6;
    for (absorption, form) in ALL_SCORES {
        let options = WalkOptions {
            absorption,
            form,
            ..WalkOptions::default()
        };
        let task: GlobalTask<'_, _, _, _, _> = GlobalTask::new(&TOY, &TOY, &EVEN, &scores, options);
        let sobol = task.with_generators(Sequence::Sobol);
        for (name, job) in [("random", &task as &dyn GlobalJob), ("sobol", &sobol)] {
            let mut all = [[0.0; 32]; 3];
            for r in 0..32 {
                let (mut sums, mut out) = ([0.0; 3], [0.0; 3]);
                let mut replicate = Replicate::new(r, 32, ReplicateCounts::default(), &mut sums);
                job.run(&mut replicate, 2048).unwrap();
                job.normalisation().fill(&sums, 2048, |_| 1.0, &mut out);
                for (all, out) in all.iter_mut().zip(out) {
                    all[r as usize] = out;
                }
            }
            for (x, values) in [0.3, 0.9, 0.5].into_iter().zip(&all) {
                let found = over_replicates(values);
                let off = iterate(x) + found.mean - solution(x);
                // u is of degree 1, so that its mean is u(½). Of 36 values of t: 0.3 %.
                assert!(
                    off.abs() < T * found.std_error,
                    "{name} {x} {off} {found:?}"
                );
                assert!(found.std_error < 1e-2);
            }
        }
    }
}

/// Batches are replicates: the standard error at a point is that of their means, and covers as Student's t says.
#[test]
fn the_error_bar_of_replicates_covers() {
    // Student's quantile of 95 % on both sides, of 15 degrees of freedom.
    const T15: f64 = 2.131;
    const SEEDS: u32 = 2000;
    let (mut covered, mut errors) = (0, [0.0; 2]);
    for seed in 0..u64::from(SEEDS) {
        let options = WalkOptions {
            seed,
            absorption: COLLIDED,
            forced_steps: 4,
            ..WalkOptions::default()
        };
        let goals = [Goal::new(At(0.3), Some(1.0 / 0.6))];
        let random = Goals::new(&TOY, &EVEN, &goals, options);
        let sobol = random.with_generators(Sequence::Sobol);
        let [mut all, mut others] = [Statistics::default(); 2];
        for index in 0..16 {
            let run = |job: &dyn Job, pieces: &[u64]| {
                let mut batch = [Batch::new(index, 64, 1024)];
                for &piece in pieces {
                    job.run(0, &mut batch, piece).unwrap();
                }
                batch[0].statistics()
            };
            let batch = run(&sobol, &[17, 1000]);
            if seed == 0 {
                // In one piece the bits are the same.
                assert_eq!(run(&sobol, &[1000]), batch);
            }
            all.merge(&batch);
            others.merge(&run(&random, &[1000]));
        }
        assert_eq!((all.replicates(), all.walks()), (16, 1024));
        let found = all.preconditioned();
        let error = found.std_error.unwrap();
        covered += u32::from((found.estimate - solution(0.3)).abs() < T15 * error);
        errors[0] += error * error;
        errors[1] += others.preconditioned().std_error.unwrap().powi(2);
    }
    // Four standard deviations of a binomial variable, and what the means of 64 points are from normal: less than 1 %.
    let share = f64::from(covered) / f64::from(SEEDS);
    let band = 4.0 * (0.95 * 0.05 / f64::from(SEEDS)).sqrt();
    assert!((share - 0.95).abs() < band + 0.01, "{share}");
    assert!(errors[0] < errors[1] / 20.0, "{errors:?}");
}

/// A chain whose states crowd is what the claim of a preserved density is for.
#[test]
fn a_chain_that_does_not_keep_the_density_is_biased() {
    let uneven = Toy {
        uneven: true,
        ..TOY
    };
    assert!(largest_z::<1>(uneven, ALL_SCORES[2]) < 4.0);
    assert!(largest_z::<32>(uneven, ALL_SCORES[2]) > 10.0);
}

/// A chain that claims nothing has its starts scored alone, and so have walks that end by roulette: with the bits of as many walks
/// of which one state is kept.
#[test]
fn without_a_claim_starts_alone_are_scored() {
    let uneven = Toy {
        uneven: true,
        preserves: false,
        ..TOY
    };
    for scores in ALL_SCORES {
        let neighbour = match scores.0 {
            Absorption::Roulette => EVEN,
            Absorption::Constant { .. } => Constant(uneven),
        };
        assert!(largest_z::<32>(neighbour.0, scores) < T);
        let [one, many] = [
            coefficients(&task::<1>(&neighbour, scores), 100),
            coefficients(&task::<32>(&neighbour, scores), 100),
        ];
        assert_eq!(one, many);
        let scored = task::<32>(&neighbour, scores).normalisation();
        assert_eq!(scored.states_scored, 1.0);
    }
}

/// Numbers that are drawn again from a place.
struct From<'a>(&'a [f64]);
impl Uniforms<f64> for From<'_> {
    fn uniform(&mut self) -> f64 {
        let (first, rest) = self.0.split_first().unwrap();
        self.0 = rest;
        *first
    }
}

/// Every suffix scores what a walk scores that starts there with the same numbers, if absorption is constant.
#[test]
fn suffixes_are_walks() {
    let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(3, 0).generator(0));
    for (absorption, form) in ALL_SCORES.into_iter().take(4) {
        let options = WalkOptions {
            absorption,
            form,
            ..WalkOptions::default()
        };
        for _ in 0..200 {
            let numbers: Vec<f64> = (0..400).map(|_| draws.uniform()).collect();
            let x0 = EVEN.locate(numbers[0]);
            let mut trail = suffixes::Trail::<f64, f64, f64, 4>::new(x0, 1, 4);
            let followed = Followed {
                equation: &TOY,
                neighbour: &EVEN,
                form,
                length: options.length(),
            };
            let mut uniforms = From(&numbers[1..]);
            let course = Course::of(absorption);
            let (states, _) = followed.walk(x0, course, &mut uniforms, &mut NoDraws, &mut trail);
            assert!(trail.finish() && trail.has_scored());
            assert_eq!(trail.iter().count(), (states as usize).min(4));
            for (l, scored) in trail.iter().enumerate() {
                assert_eq!(scored.x.point, numbers[2 * l]);
                let mut rest = From(&numbers[2 * l + 1..]);
                let start = (*scored.x, 1.0);
                let alone = walk(&TOY, &EVEN, start, &options, &mut rest, &mut NoDraws);
                let expected = alone.plain - alone.control;
                assert!((scored.difference - expected).abs() < 1e-13 * alone.plain.abs());
                assert_eq!(alone.states, states - l as u32);
            }
        }
    }
}

/// Channels have the sums of each alone, one after the other.
#[test]
fn channels_have_the_sums_of_each() {
    /// The toy twice: with F, and with 3 F.
    struct Two;
    impl Space for Two {
        type Scalar = f64;
        type Point = f64;
    }
    impl Chain for Two {
        fn step<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> Option<f64> {
            TOY.step(x, uniforms)
        }
    }
    impl Equation for Two {
        type Value = Channels<f64, 2>;
        fn kernel(&self, x: &f64, y: &f64) -> Self::Value {
            Channels::splat(2, TOY.kernel(x, y))
        }
        fn source<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> Self::Value {
            let f = TOY.source(x, uniforms);
            Channels::from_fn(2, |c| [f, 3.0 * f][c])
        }
        fn channels(&self) -> usize {
            2
        }
    }
    impl Stationary<Two> for Toy {
        fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
            uniforms.uniform()
        }
        fn start_density(&self, _: &f64) -> f64 {
            1.0
        }
        fn is_preserved(&self) -> bool {
            true
        }
    }
    for (absorption, form) in ALL_SCORES {
        let options = WalkOptions {
            absorption,
            form,
            ..WalkOptions::default()
        };
        let none = NoNeighbour::new(&Two);
        let both: GlobalTask<'_, _, _, _, _> = GlobalTask::new(&Two, &TOY, &none, &SCORES, options);
        let sums = |job: &dyn GlobalJob| {
            let mut sums = [0.0; 12];
            let sums = &mut sums[..job.unknowns()];
            let mut replicate = Replicate::new(0, 1, ReplicateCounts::default(), sums);
            job.run(&mut replicate, 1000).unwrap();
            sums.to_vec()
        };
        let alone = [1.0, 3.0].map(|brightness| {
            let toy = Toy { brightness, ..TOY };
            let none = NoNeighbour::new(&toy);
            sums(&GlobalTask::<_, _, _, _>::new(
                &toy, &toy, &none, &SCORES, options,
            ))
        });
        assert_eq!(sums(&both), alone.concat());
    }
}

#[test]
fn pieces_of_work_and_buffers_of_others_change_no_bit() {
    let task = task::<32>(&EVEN, ALL_SCORES[0]);
    let whole = coefficients(&task, 1000);
    let (mut sums, mut out) = ([0.0; 6], [0.0; 6]);
    let mut counts = ReplicateCounts::default();
    for walks in [1, 0, 399, 600] {
        let mut replicate = Replicate::new(7, 32, counts, &mut sums);
        task.run(&mut replicate, walks).unwrap();
        counts = *replicate.counts();
    }
    assert_eq!(counts.walks, 1000);
    // No walk belongs to two replicates, or to one twice.
    let next = Replicate::new(7, 32, counts, &mut sums).next_walk();
    assert_eq!(next, 32 * 1000 + 7);
    task.normalisation().fill(&sums, 1000, |_| 0.5, &mut out);
    assert_eq!(out.map(f64::to_bits), whole[7].map(f64::to_bits));
}

/// A walk that is cut off is counted, and one that is not finite is named and not scored.
#[test]
fn walks_that_go_wrong_are_told() {
    let mut task = task::<2>(&EVEN, ALL_SCORES[2]);
    task.options.step_limit = 3;
    let mut sums = [0.0; 6];
    let mut replicate = Replicate::new(0, 1, ReplicateCounts::default(), &mut sums);
    task.run(&mut replicate, 1000).unwrap();
    let cut = replicate.counts().step_limit;
    // 0.7³ = 34 %.
    assert!((300..400).contains(&cut), "{cut}");

    task.options.step_limit = 0;
    assert_eq!(task.normalisation().states_scored, 0.0);
    let nan = Constant(Toy {
        brightness: f64::NAN,
        ..TOY
    });
    let task = self::task::<2>(&nan, ALL_SCORES[2]);
    let before = [1.0; 6];
    let mut sums = before;
    let mut replicate = Replicate::new(3, 8, ReplicateCounts::default(), &mut sums);
    assert_eq!(task.run(&mut replicate, 5), Err(NotFinite { walk: 3 }));
    assert_eq!((replicate.counts().walks, sums), (0, before));
}

/// Normal numbers: the sum of twelve uniform ones is near enough.
fn normal(draws: &mut RngUniforms<DefaultGenerator>) -> f64 {
    (0..12)
        .map(|_| Uniforms::<f64>::uniform(draws))
        .sum::<f64>()
        - 6.0
}

/// Bands over 32 replicates hold at all of 40 points in 95 % of 1,000 cases: of the binomial distribution's mass all but
/// 10⁻⁴ is between 92.1 % and 97.4 %.
#[test]
fn bands_hold_everywhere_at_once() {
    const POINTS: usize = 40;
    const REPLICATES: usize = 32;
    let mut held = 0;
    for case in 0..1000 {
        let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(11, case).generator(0));
        let mut values = [0.0; POINTS * REPLICATES];
        // A function of three waves, of very different sizes from place to place.
        for r in 0..REPLICATES {
            let waves: [f64; 3] = core::array::from_fn(|_| normal(&mut draws));
            for (i, point) in values.chunks_exact_mut(REPLICATES).enumerate() {
                let x = i as f64 / POINTS as f64;
                let wave = waves[0] + waves[1] * (6.0 * x).sin() + waves[2] * (6.0 * x).cos();
                point[r] = 1e3 + (1e-6 + x * x) * wave;
            }
        }
        let errors: Vec<Replicated> = values
            .chunks_exact(REPLICATES)
            .map(over_replicates)
            .collect();
        let c = band_factor(&mut values, REPLICATES, 0.95, case, &mut [0.0; 500]);
        assert!(c > 2.0 && c < 4.5, "{c}");
        held += u32::from(
            errors
                .iter()
                .all(|u| (u.mean - 1e3).abs() <= c * u.std_error),
        );
    }
    assert!((921..=974).contains(&held), "{held}");
}

/// Blocks of points side by side have the bits of one point after the other, in four sums: with a block that is not full, and
/// replicates that are no multiple of four.
#[test]
fn a_band_has_the_bits_of_its_formula() {
    const POINTS: usize = 11;
    for replicates in [4, 10, 64] {
        let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(5, 0).generator(0));
        let mut values: Vec<f64> = (0..POINTS * replicates).map(|_| draws.uniform()).collect();
        let standardised: Vec<Vec<f64>> = values
            .chunks_exact(replicates)
            .map(|point| {
                let Replicated { mean, std_error } = over_replicates(point);
                let scale = 1.0 / (std_error * (replicates as f64).sqrt());
                point.iter().map(|value| (value - mean) * scale).collect()
            })
            .collect();
        let seeds = WalkSeeds::<DefaultGenerator>::new(3, u64::MAX - 1);
        let count = replicates as f64;
        let largest = |sample: u64| {
            let mut draws = RngUniforms(seeds.generator(sample));
            let mut times = [0.0; 64];
            for _ in 0..replicates {
                let uniform: f64 = draws.uniform();
                times[(uniform * count) as usize] += 1.0;
            }
            let of = |point: &Vec<f64>| {
                let (mut sums, mut squares) = ([0.0; 4], [0.0; 4]);
                for (i, (value, times)) in point.iter().zip(&times).enumerate() {
                    sums[i % 4] += times * value;
                    squares[i % 4] += times * value * value;
                }
                let total = |[a, b, c, d]: [f64; 4]| (a + b) + (c + d);
                let (sum, squares) = (total(sums), total(squares));
                let variance = (squares - sum * sum / count) / (count - 1.0);
                sum * sum / count / variance
            };
            standardised.iter().map(of).fold(0.0, f64::max).sqrt()
        };
        let mut all: Vec<f64> = (0..20).map(largest).collect();
        all.sort_by(f64::total_cmp);
        // 0.95 of 21 is 19.95: the 20th.
        let found = band_factor(&mut values, replicates, 0.95, 3, &mut [0.0; 20]);
        assert_eq!(found.to_bits(), all[19].to_bits(), "{replicates}");
    }
}

#[test]
fn a_band_of_nothing_is_nothing() {
    let mut largest = [0.0; 10];
    assert_eq!(band_factor(&mut [2.0; 32], 16, 0.95, 1, &mut largest), 0.0);
    assert!(band_factor(&mut [2.0; 3], 3, 0.95, 1, &mut largest).is_nan());
    assert!(band_factor(&mut [2.0; 16], 16, 0.95, 1, &mut []).is_nan());
    assert!(over_replicates(&[1.0]).std_error.is_nan());
}
