//! Checks of equations of which nothing is known but how to step: integrals over steps are means over draws.

use fredholm_core::{Kernel, Located, Neighbour, Real, Sampler};

use super::chain::follows;
use super::neighbour::mean_source;
use super::{ROUNDING, STANDARD_ERRORS, draws, samples};
use crate::description::{StepDescription, StepPointOf, StepScalarOf, epsilon};
use crate::outcome::{Outcome, Worst};

/// How many points a check looks at.
const POINTS: usize = 24;

/// Steps from each of them. Of a v that varies by its own size over them their mean shows an error of 1 % of T_k v.
const STEPS: u32 = 65_536;

/// Draws of G in each of them, which have less variance.
const SOURCES: u32 = 16_384;

/// **The neighbour equation holds pointwise**: v(x) = (T_hp v)(x) + G(x), (50) of Heinrich 1995, at random x and in the mean
/// over these, where T_hp v is the mean over plain steps from x and G the mean of what is drawn for it. This is what makes the
/// estimate unbiased.
#[must_use]
pub fn neighbour_equation_by_steps<D: StepDescription<B>, N, const B: usize>(
    description: &D,
    neighbour: &N,
    seed: u64,
) -> Outcome
where
    N: Neighbour<Scalar = StepScalarOf<D, B>, Point = StepPointOf<D, B>> + ?Sized,
{
    let mut worst = Worst::new("standard errors", STANDARD_ERRORS);
    // Of v, of T_hp v + G, of the squares of standard errors, and of rounding.
    let mut sums = [0.0; 4];
    let points = samples(description, seed, POINTS);
    let count = points.len() as f64;
    for (number, x) in points.into_iter().enumerate() {
        let number = number as u64;
        let x = neighbour.locate(x.point);
        let value = neighbour.value(&x).to_f64();
        let source = mean_source(neighbour, &x, seed + number, SOURCES);
        let [steps, std_error] = mean_step(description, neighbour, &x, [seed, number]);
        let size = value.abs() + source.mean.abs() + steps.abs();
        let rounding = ROUNDING * epsilon::<D, B>() * size;
        let found = steps + source.mean;
        let error = source.std_error.hypot(std_error);
        worst.compare(value, found, error + rounding, || {
            format!("(T_hp v + gq)(x) at x = {:?} in cell {}", x.point, x.cell)
        });
        let terms = [value, found, error * error, rounding];
        sums.iter_mut()
            .zip(terms)
            .for_each(|(sum, term)| *sum += term);
    }
    // What is wrong everywhere is seen at once.
    let [value, found, square, rounding] = sums;
    let error = (square.sqrt() + rounding) / count;
    worst.compare(value / count, found / count, error, || {
        format!("T_hp v + gq in the mean over {count} points")
    });
    worst.outcome()
}

/// (T_hp v)(x) as the mean of h(x,y) v(y) over steps that survive, and its standard error.
fn mean_step<D: StepDescription<B>, N, const B: usize>(
    description: &D,
    neighbour: &N,
    x: &Located<StepPointOf<D, B>>,
    [seed, number]: [u64; 2],
) -> [f64; 2]
where
    N: Neighbour<Scalar = StepScalarOf<D, B>, Point = StepPointOf<D, B>> + ?Sized,
{
    let equation = description.equation();
    let survival = 1.0 - equation.absorption(&x.point).to_f64();
    let mut uniforms = draws(seed, 40 + number);
    // Welford's sums.
    let (mut mean, mut squares) = (0.0, 0.0);
    for n in 1..=STEPS {
        let brought = equation.step(&x.point, &mut uniforms).map_or(0.0, |y| {
            let y = neighbour.locate(y);
            let k = equation.kernel(&x.point, &y.point);
            survival * (neighbour.kernel(x, &y, k) * neighbour.value(&y)).to_f64()
        });
        let from = brought - mean;
        mean += from / f64::from(n);
        squares += from * (brought - mean);
    }
    let n = f64::from(STEPS);
    [mean, (squares / (n - 1.0) / n).sqrt()]
}

/// **The sampler follows p** as [`sampler`](super::sampler) has it, against the masses that the description knows. `None`
/// where it knows none.
#[must_use]
pub fn sampler_by_masses<D: StepDescription<B>, const B: usize>(
    description: &D,
    seed: u64,
) -> Option<Outcome> {
    follows(description, seed, &|x, j| description.mass(x, j))
}

/// The largest ∫|K(x,y)|dμ(y) at these points, by a thousand steps from each.
pub(crate) fn norm_by_steps<D: StepDescription<B>, const B: usize>(
    description: &D,
    points: &[StepPointOf<D, B>],
    seed: u64,
) -> f64 {
    const STEPS: u32 = 1000;
    let equation = description.equation();
    let mut uniforms = draws(seed, 4);
    let mut norm = |x: &StepPointOf<D, B>| {
        let survival = 1.0 - equation.absorption(x).to_f64();
        let steps = (0..STEPS).filter_map(|_| equation.step(x, &mut uniforms));
        let sizes = steps.map(|y| survival * equation.kernel(x, &y).to_f64().abs());
        sizes.sum::<f64>() / f64::from(STEPS)
    };
    points.iter().fold(0.0, |most: f64, x| most.max(norm(x)))
}
