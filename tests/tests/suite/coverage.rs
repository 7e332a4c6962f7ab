//! Error bars are honest: how many of the program's 95 % intervals, estimate ± 1.96 standard errors, contain the exact
//! value.

use core::fmt;

use fredholm_circle::{MeanOver, Point};
use fredholm_core::{
    At, Batch, Equation, Estimate, Functional, Goal, Job, Neighbour, Statistics, WalkOptions,
};
use fredholm_cube::{Mean, ScalarField, model};
use fredholm_room::Grading;
use fredholm_tests::check::long;
use fredholm_tests::circle::{DEFAULT, LIGHT, RHO, with_piecewise};
use fredholm_tests::cube::with_degree;
use fredholm_tests::outcome::Sum;
use fredholm_tests::room::{Drawing, Setup, Way, block, glowing};
use fredholm_tests::{AnyNeighbour, Objects, all_ways, check, on_all_cores};

/// What the walks are called.
const WAYS: [&str; 3] = ["Absorption", "Collision", "Roulette"];

/// Half the width of an interval in standard errors, as the program draws its bands.
const HALF_WIDTH: f64 = 1.96;
/// Batches of the moments of one walk.
const GROUP: u64 = 1 << 14;

/// Seeds and numbers of walks: with `FREDHOLM_LONG` those of the table, else what takes seconds.
fn sizes() -> (u64, &'static [u64]) {
    if long() {
        (2000, &[1000, 10_000])
    } else {
        (500, &[1000])
    }
}

/// How often intervals of one estimate contain the exact value.
struct Row {
    scene: &'static str,
    target: &'static str,
    way: &'static str,
    preconditioned: bool,
    walks: u64,
    seeds: u64,
    covered: u64,
    /// Intervals all of which is below the exact value.
    below: u64,
    /// The root mean square of the error over the mean standard error.
    error: f64,
    skewness: f64,
    kurtosis: f64,
}

impl Row {
    fn share(&self) -> f64 {
        self.covered as f64 / self.seeds as f64
    }

    /// The second order of the share that intervals by a normal quantile z cover (Hall 1992, section 2.5):
    /// 2Φ(z) − 1 + 2φ(z) z/N (κ(z² − 3)/12 − γ²(z⁴ + 2z² − 3)/18 − (z² + 3)/4), γ the skewness and κ the excess
    /// kurtosis of a score.
    fn predicted(&self) -> f64 {
        let (n, z2) = (self.walks as f64, HALF_WIDTH * HALF_WIDTH);
        let density = (-0.5 * z2).exp() / core::f64::consts::TAU.sqrt();
        let gamma2 = self.skewness * self.skewness;
        let bracket = (self.kurtosis - 3.0) * (z2 - 3.0) / 12.0
            - gamma2 * (z2 * z2 + 2.0 * z2 - 3.0) / 18.0
            - (z2 + 3.0) / 4.0;
        0.95 + 2.0 * density * HALF_WIDTH / n * bracket
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let estimate = if self.preconditioned {
            "preconditioned"
        } else {
            "plain"
        };
        let [low, high] = band(self.seeds);
        let verdict = match self.covered {
            covered if covered < low => "too few",
            covered if covered > high => "too many",
            _ => "",
        };
        write!(
            f,
            "{:14} {:5} {:10} {estimate:14} {:6} {:6.1} % {:5.1} % {:5.1} % {:5.2} {:8.1} {:9.0} {:6.1} %  {verdict}",
            self.scene,
            self.target,
            self.way,
            self.walks,
            100.0 * self.share(),
            100.0 * self.below as f64 / self.seeds as f64,
            100.0 * (self.seeds - self.covered - self.below) as f64 / self.seeds as f64,
            self.error,
            self.skewness,
            self.kurtosis,
            100.0 * self.predicted().max(0.0),
        )
    }
}

const HEADER: &str = "scene          at    walks by   estimate        walks  covers    below   above error     skew   \
                      kurtosis  2nd order";

/// Of so many intervals that each contain the exact value with probability 0.95, the fewest and the most that do
/// but for a probability of 0.0005 each: 99.9 % of the binomial.
fn band(seeds: u64) -> [u64; 2] {
    let n = seeds as f64;
    // Misses: P(0) = 0.95ⁿ, P(m + 1) = P(m) (n − m)/(m + 1) · 0.05/0.95.
    let mut probability = 0.95_f64.powf(n);
    let mut below = 0.0;
    let (mut fewest, mut most) = (0, seeds);
    for misses in 0..seeds {
        if below <= 0.0005 {
            fewest = misses;
        }
        below += probability;
        if 1.0 - below <= 0.0005 {
            most = misses;
            break;
        }
        let m = misses as f64;
        probability *= (n - m) / (m + 1.0) * (0.05 / 0.95);
    }
    [seeds - most, seeds - fewest]
}

#[test]
fn the_band_is_that_of_the_binomial() {
    // In fractions of integers: for n = 2000 P(X < 1867) = 0.000498, P(X < 1868) = 0.000692, P(X > 1931) = 0.000334,
    // P(X > 1930) = 0.000506; for n = 500 P(X < 458) = 0.000471 and P(X > 489) = 0.000460.
    assert_eq!(band(2000), [1867, 1931]);
    assert_eq!(band(500), [458, 489]);
}

/// Skewness and kurtosis of both scores, of four million walks, or 2¹⁴.
fn moments<E, T>(case: &Case<'_, E, T>, options: WalkOptions) -> [[f64; 2]; 2]
where
    E: Equation<Scalar = f64, Value = f64> + Sync,
    T: Functional<E> + Sync,
{
    let groups = if long() { 256 } else { 1 };
    let objects = || Objects::new(case.equation, case.neighbour, &case.goal);
    let all = check::run(&objects().job(options), GROUP)[0];
    let centres = [all.plain(), all.preconditioned()].map(|e| e.estimate);
    let value = case.goal.control_mean.unwrap();
    let sums: Vec<[[Sum; 4]; 2]> = on_all_cores(groups as usize, &|group| {
        let group = group as u64;
        let mut sums = [[Sum::default(); 4]; 2];
        let objects = objects();
        for walk in group * GROUP..(group + 1) * GROUP {
            let walk = objects.job(options).replay(0, walk).unwrap();
            let scores = [walk.plain, walk.plain - walk.control + value];
            for ((sums, score), centre) in sums.iter_mut().zip(scores).zip(centres) {
                let mut power = 1.0;
                for sum in sums {
                    power *= score - centre;
                    sum.add(power);
                }
            }
        }
        sums
    });
    [0, 1].map(|which| {
        let n = (groups * GROUP) as f64;
        let raw = [0, 1, 2, 3].map(|power| {
            let parts = sums.iter().map(|s| s[which][power].value());
            parts.collect::<Sum>().value() / n
        });
        let [a, b, c, d] = raw;
        let variance = b - a * a;
        let third = c - 3.0 * a * b + 2.0 * a * a * a;
        let fourth = d - 4.0 * a * c + 6.0 * a * a * b - 3.0 * a * a * a * a;
        [third / variance.powf(1.5), fourth / (variance * variance)]
    })
}

/// A target of a scene, and what is exact.
struct Case<'a, E: Equation, T> {
    scene: &'static str,
    target: &'static str,
    equation: &'a E,
    neighbour: &'a AnyNeighbour<'a, E::Scalar, E::Point, E::Value>,
    goal: Goal<T, f64>,
    exact: f64,
}

impl<E, T> Case<'_, E, T>
where
    E: Equation<Scalar = f64, Value = f64> + Sync,
    T: Functional<E> + Sync,
{
    fn rows(&self, seeds: u64, walks: &[u64]) -> Vec<Row> {
        (0..3).flat_map(|way| self.of(way, seeds, walks)).collect()
    }

    fn of(&self, way: usize, seeds: u64, walks: &[u64]) -> Vec<Row> {
        let options = |seed| all_ways(seed)[way];
        let most = *walks.last().unwrap();
        let run = |seed: usize| -> Vec<Statistics> {
            let objects = Objects::new(self.equation, self.neighbour, &self.goal);
            let job = objects.job(options(seed as u64 + 1));
            let mut batch = [Batch::new(0, most, most)];
            let to = |&walks: &u64| {
                let more = walks - batch[0].statistics().walks();
                job.run(0, &mut batch, more).unwrap();
                *batch[0].statistics()
            };
            walks.iter().map(to).collect()
        };
        let runs: Vec<Vec<Statistics>> = on_all_cores(seeds as usize, &run);
        let moments = moments(self, options(u64::MAX));
        let estimates: [fn(&Statistics) -> Estimate; 2] =
            [Statistics::plain, Statistics::preconditioned];
        let mut rows = Vec::new();
        for (number, &walks) in walks.iter().enumerate() {
            for (which, of) in estimates.iter().enumerate() {
                let [skewness, kurtosis] = moments[which];
                let mut row = Row {
                    scene: self.scene,
                    target: self.target,
                    way: WAYS[way],
                    preconditioned: which == 1,
                    walks,
                    seeds,
                    covered: 0,
                    below: 0,
                    error: 0.0,
                    skewness,
                    kurtosis,
                };
                let (mut squares, mut bars) = (0.0, 0.0);
                for run in &runs {
                    let found = of(&run[number]);
                    let error = found.estimate - self.exact;
                    // Nothing scored: no interval, which contains nothing.
                    let half = HALF_WIDTH * found.std_error.unwrap_or(f64::NAN);
                    row.covered += u64::from(error.abs() <= half);
                    row.below += u64::from(error < -half);
                    squares += error * error;
                    bars += found.std_error.unwrap_or(0.0);
                }
                row.error = (squares * seeds as f64).sqrt() / bars;
                rows.push(row);
            }
        }
        rows
    }
}

fn circle(scene: &'static str, cells: usize, seeds: u64, walks: &[u64]) -> Vec<Row> {
    with_piecewise::<f64, _, _, _>(&RHO, cells, LIGHT, DEFAULT, |circle, neighbour, v| {
        let x: Point<f64> = circle.point(0.3);
        let point = Case {
            scene,
            target: "point",
            equation: circle,
            neighbour,
            goal: Goal::new(At(x), Some(neighbour.value(&neighbour.locate(x)))),
            exact: LIGHT.solution(0.3),
        };
        let mean = MeanOver::new(0.0, core::f64::consts::TAU).unwrap();
        let mean = Case {
            scene,
            target: "mean",
            equation: circle,
            neighbour,
            goal: Goal::new(mean, Some(mean.of(cells, v))),
            exact: LIGHT.constant,
        };
        let mut rows = point.rows(seeds, walks);
        rows.extend(mean.rows(seeds, walks));
        rows
    })
}

fn cube(seeds: u64, walks: &[u64]) -> Vec<Row> {
    let model = model::rational(0.9);
    let equation = (model.kernel.0, model.source);
    with_degree::<f64, 2, _, _, _, 1>(equation, 10, |cube, neighbour, v| {
        let x = [0.77, 0.31];
        let point = Case {
            scene: "cube, d = 2",
            target: "point",
            equation: cube,
            neighbour,
            goal: Goal::new(At(x), Some(neighbour.value(&neighbour.locate(x)))),
            exact: ScalarField::value(&model.solution, &x),
        };
        let mean = Case {
            scene: "cube, d = 2",
            target: "mean",
            equation: cube,
            neighbour,
            goal: Goal::new(Mean, Some(Mean::of(v, 1))),
            exact: model.mean::<2>(),
        };
        let mut rows = point.rows(seeds, walks);
        rows.extend(mean.rows(seeds, walks));
        rows
    })
}

/// A room with a block whose solution is 1, on few cells: with pairs of cells that a shadow falls between, and so
/// pointwise, a state costs as many integrals as there are.
fn room(scene: &'static str, drawing: &Drawing, seeds: u64, walks: &[u64]) -> Vec<Row> {
    let setup = Setup::new::<f64>(drawing, 40, Grading::default()).unwrap();
    setup.with::<f64, _>(Way::Rays, |room, neighbour, v| {
        let x = room.on_wall(0, 0.37).unwrap();
        let point = Case {
            scene,
            target: "point",
            equation: room,
            neighbour,
            goal: Goal::new(At(x), Some(neighbour.value(&neighbour.locate(x)))),
            exact: 1.0,
        };
        let mean = fredholm_room::MeanOver::everything(room);
        let value = mean.of(v);
        let mean = Case {
            scene,
            target: "mean",
            equation: room,
            neighbour,
            goal: Goal::new(mean, Some(value)),
            exact: 1.0,
        };
        let mut rows = point.rows(seeds, walks);
        rows.extend(mean.rows(seeds, walks));
        rows
    })
}

#[test]
fn intervals_contain_the_exact_value_as_often_as_they_say() {
    let (seeds, walks) = sizes();
    let [low, high] = band(seeds);
    println!(
        "{seeds} seeds; 99.9 % of the binomial: {low} to {high}, {:.1} to {:.1} %\n{HEADER}",
        100.0 * low as f64 / seeds as f64,
        100.0 * high as f64 / seeds as f64
    );
    let glowing = glowing(&block());
    let scenes: [&dyn Fn() -> Vec<Row>; 4] = [
        &|| circle("circle 100", 100, seeds, walks),
        &|| circle("circle 1000", 1000, seeds, walks),
        &|| cube(seeds, walks),
        &|| room("block, u = 1", &glowing, seeds, walks),
    ];
    let mut dishonest = Vec::new();
    // Every second scene by day.
    for scene in scenes.into_iter().step_by(if long() { 1 } else { 2 }) {
        for row in scene() {
            println!("{row}");
            if !(low..=high).contains(&row.covered) {
                dishonest.push(row.to_string());
            }
        }
    }
    assert!(dishonest.is_empty(), "\n{HEADER}\n{}", dishonest.join("\n"));
}
