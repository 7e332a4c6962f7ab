//! Error bars are honest: how many of the program's 95 % intervals, estimate ± 1.96 standard errors, contain the exact
//! value.

use core::fmt;

use fredholm_circle::MeanOver;
use fredholm_core::{At, Batch, Equation, Estimate, Functional, Goal, Job, Statistics};
use fredholm_cube::{Mean, ScalarField};
use fredholm_room::Grading;
use fredholm_tests::check::long;
use fredholm_tests::circle::{DEFAULT, LIGHT, RHO, with_piecewise};
use fredholm_tests::cube::model;
use fredholm_tests::cube::with_degree;
use fredholm_tests::room::{Setup, Way, block, glowing};
use fredholm_tests::{AnyNeighbour, Objects, all_ways, on_all_cores};

/// What the walks are called.
const WAYS: [&str; 3] = ["Absorption", "Collision", "Roulette"];

/// Half the width of an interval in standard errors, as the program draws its bands.
const HALF_WIDTH: f64 = 1.96;

/// Seeds and numbers of walks: with `FREDHOLM_LONG` those of the table, else what takes seconds.
fn sizes() -> (u64, &'static [u64]) {
    if long() {
        (2000, &[1000, 10_000])
    } else {
        (250, &[1000])
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
}

impl Row {
    fn share(&self) -> f64 {
        self.covered as f64 / self.seeds as f64
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
            "{:14} {:5} {:10} {estimate:14} {:6} {:6.1} % {:5.1} % {:5.1} % {:5.2}  {verdict}",
            self.scene,
            self.target,
            self.way,
            self.walks,
            100.0 * self.share(),
            100.0 * self.below as f64 / self.seeds as f64,
            100.0 * (self.seeds - self.covered - self.below) as f64 / self.seeds as f64,
            self.error,
        )
    }
}

const HEADER: &str =
    "scene          at    walks by   estimate        walks  covers    below   above error";

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

/// A scene: the equation and its neighbour equation.
struct Case<'a, E: Equation> {
    scene: &'static str,
    equation: &'a E,
    neighbour: &'a AnyNeighbour<'a, E::Scalar, E::Point, E::Value>,
}

impl<E: Equation<Scalar = f64, Value = f64> + Sync> Case<'_, E> {
    /// The rows of u at a point and of its mean, by all ways.
    fn rows<T>(&self, x: E::Point, mean: &Goal<T, f64>, exact: [f64; 2]) -> Vec<Row>
    where
        E::Point: Sync,
        T: Functional<E> + Sync,
    {
        let value = self.neighbour.value(&self.neighbour.locate(x));
        let point = Goal::new(At(x), Some(value));
        let mut rows = Vec::new();
        for way in 0..WAYS.len() {
            rows.extend(self.of("point", &point, exact[0], way));
        }
        for way in 0..WAYS.len() {
            rows.extend(self.of("mean", mean, exact[1], way));
        }
        rows
    }

    /// The rows of a target by one way.
    fn of<T: Functional<E> + Sync>(
        &self,
        target: &'static str,
        goal: &Goal<T, f64>,
        exact: f64,
        way: usize,
    ) -> Vec<Row> {
        let (seeds, walks) = sizes();
        let most = *walks.last().unwrap();
        let run = |seed: usize| -> Vec<Statistics> {
            let objects = Objects::new(self.equation, self.neighbour, goal);
            let job = objects.job(all_ways(seed as u64 + 1)[way]);
            let mut batch = [Batch::new(0, most, most)];
            let to = |&walks: &u64| {
                let more = walks - batch[0].statistics().walks();
                job.run(0, &mut batch, more).unwrap();
                batch[0].statistics()
            };
            walks.iter().map(to).collect()
        };
        let runs: Vec<Vec<Statistics>> = on_all_cores(seeds as usize, &run);
        let estimates: [fn(&Statistics) -> Estimate; 2] =
            [Statistics::plain, Statistics::preconditioned];
        let mut rows = Vec::new();
        for (number, &walks) in walks.iter().enumerate() {
            for (which, of) in estimates.iter().enumerate() {
                let mut row = Row {
                    scene: self.scene,
                    target,
                    way: WAYS[way],
                    preconditioned: which == 1,
                    walks,
                    seeds,
                    covered: 0,
                    below: 0,
                    error: 0.0,
                };
                let (mut squares, mut bars) = (0.0, 0.0);
                for run in &runs {
                    let found = of(&run[number]);
                    let error = found.estimate - exact;
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

fn circle(scene: &'static str, cells: usize) -> Vec<Row> {
    with_piecewise::<f64, _, _, _>(&RHO, cells, LIGHT, DEFAULT, |equation, neighbour, v| {
        let mean = MeanOver::new(0.0, core::f64::consts::TAU).unwrap();
        let mean = Goal::new(mean, Some(mean.of(cells, v)));
        let exact = [LIGHT.solution(0.3), LIGHT.constant];
        let case = Case {
            scene,
            equation,
            neighbour,
        };
        case.rows(equation.point(0.3), &mean, exact)
    })
}

fn cube() -> Vec<Row> {
    let model = model::rational(0.9);
    let parts = (model.kernel.0, model.source);
    with_degree::<f64, 2, _, _, _, 1>(parts, 10, |equation, neighbour, v| {
        let x = [0.77, 0.31];
        let exact = [ScalarField::value(&model.solution, &x), model.mean::<2>()];
        let case = Case {
            scene: "cube, d = 2",
            equation,
            neighbour,
        };
        case.rows(x, &Goal::new(Mean, Some(Mean::of(v, 1))), exact)
    })
}

/// A room with a block whose solution is 1, on few cells: with pairs of cells that a shadow falls between, and so
/// pointwise, a state costs as many integrals as there are.
fn room() -> Vec<Row> {
    let setup = Setup::new::<f64>(&glowing(&block()), 40, Grading::default()).unwrap();
    setup.with::<f64, _>(Way::Rays, |equation, neighbour, v| {
        let mean = fredholm_room::MeanOver::everything(equation);
        let value = mean.of(v);
        let case = Case {
            scene: "block, u = 1",
            equation,
            neighbour,
        };
        let x = equation.on_wall(0, 0.37).unwrap();
        case.rows(x, &Goal::new(mean, Some(value)), [1.0; 2])
    })
}

#[test]
fn intervals_contain_the_exact_value_as_often_as_they_say() {
    let (seeds, _) = sizes();
    let [low, high] = band(seeds);
    println!(
        "{seeds} seeds; 99.9 % of the binomial: {low} to {high}, {:.1} to {:.1} %\n{HEADER}",
        100.0 * low as f64 / seeds as f64,
        100.0 * high as f64 / seeds as f64
    );
    let scenes: [&dyn Fn() -> Vec<Row>; 4] = [
        &|| circle("circle 100", 100),
        &|| circle("circle 1000", 1000),
        &cube,
        &room,
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
