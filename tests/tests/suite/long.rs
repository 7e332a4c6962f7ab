//! Long runs, with `FREDHOLM_LONG` in the environment; without it the same for some seconds:
//!
//! ```sh
//! FREDHOLM_LONG=1 cargo test --release -p fredholm-tests --test suite long -- --nocapture --test-threads 1
//! ```

use core::marker::PhantomData;
use std::time::Instant;

use fredholm_core::rand_core::{Rng, SeedableRng};
use fredholm_core::{
    Chain, DEFAULT_GENERATOR, DefaultGenerator, Equation, Functional, Goal, Goals, Located,
    Neighbour, Real, RunOptions, Space, Start, StartOf, Statistics, Uniforms, WalkOptions,
    WalkSeeds,
};
use fredholm_rayon::run;
use fredholm_tests::check::long;
use fredholm_tests::on_all_cores;
use rand::rngs::{ChaCha8Rng, Xoshiro256PlusPlus};

/// Walks of one state, which leave from where they start, one of 4096 points x. Scores are η(k,f) = 1000 + x/4096 and
/// η(h,g) = 1000 + y(x)/4096, which f32 holds exactly: their mean is 10³ and their variance 1/12.
struct Exact<F>(PhantomData<F>);

const POINTS: u32 = 4096;
const OFFSET: u32 = 1000;

/// A permutation of the points, so that η(h,g) is another score and not independent of η(k,f).
const fn other(x: u32) -> u32 {
    x ^ (x >> 2)
}

fn score<F: Real>(x: u32) -> F {
    F::from_u32(OFFSET) + F::from_u32(x) / F::from_u32(POINTS)
}

impl<F: Real> Space for Exact<F> {
    type Scalar = F;
    type Point = u32;
}
impl<F: Real> Chain for Exact<F> {
    fn step<U: Uniforms<F>>(&self, _: &u32, _: &mut U) -> Option<u32> {
        None
    }
}
impl<F: Real> Equation for Exact<F> {
    type Value = F;
    fn kernel(&self, _: &u32, _: &u32) -> F {
        F::zero()
    }
    fn source<U: Uniforms<F>>(&self, x: &u32, _: &mut U) -> F {
        score(*x)
    }
}
impl<F: Real> Neighbour for Exact<F> {
    type Value = F;
    fn locate(&self, point: u32) -> Located<u32> {
        Located { point, cell: 0 }
    }
    fn kernel(&self, _: &Located<u32>, _: &Located<u32>, _: &F) -> F {
        F::zero()
    }
    fn source(&self, x: &Located<u32>, _: &mut dyn Uniforms<F>) -> F {
        score(other(x.point))
    }
    fn value(&self, _: &Located<u32>) -> F {
        F::from_u32(OFFSET)
    }
}

#[derive(Clone, Copy)]
struct Anywhere;

impl<F: Real> Functional<Exact<F>> for Anywhere {
    fn start<U: Uniforms<F>>(&self, equation: &Exact<F>, uniforms: &mut U) -> StartOf<Exact<F>> {
        let uniform = uniforms.uniform() * F::from_u32(POINTS);
        Start::of(equation, uniform.to_u32(), F::one())
    }
}

/// Σ x, Σ x², Σ y, Σ y², Σ x y of integers.
type Sums = [u128; 5];

/// From the words themselves, without a float.
fn exact(seed: u64, walks: u64) -> Sums {
    let seeds = WalkSeeds::<DefaultGenerator>::new(seed, 0);
    let chunk = 1 << 16;
    let of_chunk = |index: usize| -> Sums {
        let index = index as u64;
        let mut sums = [0_u64; 5];
        for walk in index * chunk..((index + 1) * chunk).min(walks) {
            let x = (seeds.generator(walk).next_u64() >> 52) as u32;
            let [x, y] = [x, other(x)].map(u64::from);
            for (sum, term) in sums.iter_mut().zip([x, x * x, y, y * y, x * y]) {
                *sum += term;
            }
        }
        sums.map(u128::from)
    };
    let chunks = on_all_cores(walks.div_ceil(chunk) as usize, &of_chunk);
    let add = |a: Sums, b: Sums| core::array::from_fn(|i| a[i] + b[i]);
    chunks.into_iter().fold([0; 5], add)
}

/// Means, standard deviations and the covariance, from integers: n² Var = n Σ x² − (Σ x)².
fn expected(sums: &Sums, walks: u64) -> [f64; 6] {
    let n = i128::from(walks);
    let [x, xx, y, yy, xy] = sums.map(|sum| sum as i128);
    let points = f64::from(POINTS);
    // n Σ a b − Σ a Σ b is below 2¹²⁷ for 10⁹ walks.
    let covariance = |ab: i128, a: i128, b: i128| {
        (n * ab - a * b) as f64 / (n as f64 * (n - 1) as f64) / (points * points)
    };
    let mean = |sum: i128| sum as f64 / n as f64 / points;
    let offset = f64::from(OFFSET);
    let zeta = covariance(xx - 2 * xy + yy, x - y, x - y);
    [
        offset + mean(x),
        mean(y),
        offset + mean(x - y),
        covariance(xx, x, x).sqrt(),
        zeta.sqrt(),
        covariance(xy, x, y),
    ]
}

fn found(statistics: &Statistics) -> [f64; 6] {
    let [plain, zeta] = [statistics.plain(), statistics.preconditioned()];
    [
        plain.estimate,
        statistics.control().estimate,
        zeta.estimate,
        plain.std_dev.unwrap(),
        zeta.std_dev.unwrap(),
        statistics.covariance().unwrap(),
    ]
}

/// Statistics of 10⁹ walks against sums of integers. A walk's update, and a batch's merge, rounds a mean by ε/2 of it,
/// which no later one makes larger; a sum of squares by ε of it, and by twice what the mean was off, ε 10³/√(1/12) of
/// a deviation, which is ε 10⁴. Were all of these errors of one sign, n walks in batches of b came to (b + n/b) ε of a
/// mean and ε 10⁴ more of a variance; that much is allowed, and a thousandth of it is used.
fn statistics_are_exact<F: Real>(walks: u64, sums: &Sums) {
    let start = Instant::now();
    let equation = Exact::<F>(PhantomData);
    let run_options = RunOptions::new(walks);
    let goals = [Goal::new(Anywhere, Some(f64::from(OFFSET)))];
    let options = WalkOptions {
        seed: 9,
        ..WalkOptions::default()
    };
    let job = Goals::new(&equation, &equation, &goals, options);
    let outcome = run(&job, &run_options, None, &()).unwrap();
    let statistics = &outcome.statistics[0];
    assert_eq!(statistics.walks(), walks);
    assert_eq!(statistics.states(), walks);
    let roundings = (run_options.batch + walks / run_options.batch) as f64 * f64::EPSILON;
    let names = ["mean of eta(k,f)", "mean of eta(h,g)", "mean of zeta"];
    let names = names
        .into_iter()
        .chain(["std_dev of eta(k,f)", "std_dev of zeta", "covariance"]);
    for (number, (name, (found, expected))) in names
        .zip(found(statistics).into_iter().zip(expected(sums, walks)))
        .enumerate()
    {
        let (size, of_mean) = if number < 3 {
            (f64::from(OFFSET), 0.0)
        } else {
            (expected.abs(), 1e4 * f64::EPSILON)
        };
        let (apart, allowed) = ((found - expected).abs() / size, roundings + of_mean);
        println!(
            "{walks} walks, epsilon {:.0e}, {name}: {found:.17}, exact {expected:.17}, apart {apart:.1e}, allowed {allowed:.1e}",
            F::EPSILON
        );
        assert!(apart <= allowed, "{name}: {found} {expected}");
    }
    println!("{:.1} s", start.elapsed().as_secs_f64());
}

#[test]
fn statistics_of_a_billion_walks_are_those_of_exact_sums() {
    let walks = if long() { 1_000_000_000 } else { 4_000_001 };
    let sums = exact(9, walks);
    statistics_are_exact::<f64>(walks, &sums);
    statistics_are_exact::<f32>(walks, &sums);
}

/// One in so many windows is looked at, by its low bits.
const DISTINGUISHED: u64 = 32;

/// Windows of two words that begin with a distinguished one, of `draws` words of every generator.
fn windows<G: Rng>(count: usize, generator: &(dyn Fn(usize) -> G + Sync), draws: u64) -> Vec<u128> {
    let of = |number: usize| {
        let mut generator = generator(number);
        let mut found = Vec::new();
        let mut last = generator.next_u64();
        for _ in 1..draws {
            let next = generator.next_u64();
            if last.is_multiple_of(DISTINGUISHED) {
                found.push(u128::from(last) << 64 | u128::from(next));
            }
            last = next;
        }
        found
    };
    on_all_cores(count, &of).concat()
}

/// How many windows there are twice.
fn twice(mut windows: Vec<u128>) -> usize {
    windows.sort_unstable();
    windows.windows(2).filter(|pair| pair[0] == pair[1]).count()
}

/// The streams of the walks 0, 1, … of two targets and two seeds, in turn.
fn streams<G: SeedableRng>() -> impl Fn(usize) -> G {
    let by = |seed, target| WalkSeeds::<G>::new(seed, target);
    let four = [by(1, 0), by(1, 1), by(2, 0), by(2, 1)];
    move |n| four[n % 4].generator((n / 4) as u64)
}

/// Draws of a walk: far more than walks take.
const DRAWS: u64 = 1024;

/// No window twice. Of N windows of independent words two are equal with probability N²/2 · 32/2¹²⁸: for 2³⁰ draws
/// 5·10⁻²³. Two streams that overlap in m draws have no distinguished window in common with probability
/// (31/32)^(m−1): 4 % for m = 100, 10⁻¹⁴ for streams that are the same.
fn no_overlap<G: Rng + SeedableRng>(name: &str, count: u64) {
    let start = Instant::now();
    let windows = windows(count as usize, &streams::<G>(), DRAWS);
    let number = windows.len();
    let expected = (count * (DRAWS - 1) / DISTINGUISHED) as f64;
    let equal = twice(windows);
    println!(
        "{name}: {} draws of {count} walks, {number} windows (expected {expected:.0}), {equal} twice, {:.1} s",
        count * DRAWS,
        start.elapsed().as_secs_f64()
    );
    // Binomial; six standard deviations.
    assert!((number as f64 - expected).abs() < 6.0 * expected.sqrt());
    assert_eq!(equal, 0, "{name}");
}

#[test]
fn the_streams_of_walks_do_not_overlap() {
    let count = if long() { 1 << 20 } else { 1 << 14 };
    no_overlap::<DefaultGenerator>(DEFAULT_GENERATOR, count);
    no_overlap::<Xoshiro256PlusPlus>("xoshiro256++", count / 8);
    no_overlap::<ChaCha8Rng>("chacha8", count / 8);
}

/// What the test above is worth: a stream that begins within another, and walks that are numbered by 16 bits.
#[test]
fn planted_overlaps_are_found() {
    let count = 1 << 14;
    for shared in [DRAWS, 512, 256] {
        let mut within: DefaultGenerator = WalkSeeds::new(1, 0).generator(1000);
        for _ in 0..DRAWS - shared {
            within.next_u64();
        }
        let mut all = windows(count, &streams::<DefaultGenerator>(), DRAWS);
        all.extend(windows(1, &|_| within.clone(), DRAWS));
        let found = twice(all);
        println!("{shared} of {DRAWS} draws shared: {found} windows twice");
        // Binomial: (m − 1)/32 ± 6 standard deviations, at least one.
        let expected = (shared - 1) as f64 / DISTINGUISHED as f64;
        assert!(found > 0 && (found as f64 - expected).abs() < 6.0 * expected.sqrt());
    }
    let seeds = WalkSeeds::<DefaultGenerator>::new(1, 0);
    let narrow = |walk| seeds.generator(u64::from(walk as u16));
    let found = twice(windows((1 << 16) + 4, &narrow, 64));
    println!(
        "4 walks of {} with the number of another: {found} windows twice",
        (1 << 16) + 4
    );
    assert!(found > 0);
}
