//! Checks of equations of which nothing is known but how to step: integrals over steps are means over draws.

use fredholm_core::{Chain, Equation, Located, NeighbourOf, Real, Value};

use super::chain::follows;
use super::neighbour::{Mean, mean_source};
use super::{ROUNDING, STANDARD_ERRORS, draws, samples};
use crate::description::{Description, PointOf, epsilon};
use crate::outcome::{Outcome, Worst};

/// How many points a check looks at.
const POINTS: usize = 24;

/// Steps from each of them. Of a v that varies by its own size over them their mean shows an error of 1 % of T_k v.
const STEPS: u32 = 65_536;

/// Draws of G in each of them, which have less variance.
const SOURCES: u32 = 16_384;

/// **The neighbour equation holds pointwise**: v(x) = (T_hp v)(x) + G(x), (50) of Heinrich 1995, at random x and in the mean
/// over these, in every channel, where T_hp v is the mean over plain steps from x and G the mean of what is drawn for it. This is what
/// makes the estimate unbiased.
#[must_use]
pub fn neighbour_equation_by_steps<D, N, const B: usize>(
    description: &D,
    neighbour: &N,
    seed: u64,
) -> Outcome
where
    D: Description<B>,
    N: NeighbourOf<D::Equation> + ?Sized,
{
    /// Sums over points.
    #[derive(Clone, Copy, Default)]
    struct Sums {
        value: f64,
        found: f64,
        /// The squares of standard errors.
        squares: f64,
        rounding: f64,
    }
    let mut worst = Worst::new("standard errors", STANDARD_ERRORS);
    let channels = description.equation().channels();
    let mut sums = vec![Sums::default(); channels];
    let points = samples(description, seed, POINTS);
    let count = points.len() as f64;
    for (number, x) in points.into_iter().enumerate() {
        let x = neighbour.locate(x.point);
        let value = neighbour.value(&x);
        let sources = mean_source(neighbour, &x, seed + number as u64, SOURCES);
        let steps = mean_step(
            description,
            neighbour,
            &x,
            &mut draws(seed, 40 + number as u64),
        );
        for (channel, sums) in sums.iter_mut().enumerate() {
            let (source, step) = (&sources[channel], &steps[channel]);
            let value = value.get(channel).to_f64();
            let size = value.abs() + source.mean.abs() + step.mean.abs();
            let rounding = ROUNDING * epsilon::<D, B>() * size;
            let found = step.mean + source.mean;
            let error = source.std_error.hypot(step.std_error);
            worst.compare(value, found, error + rounding, || {
                let Located { point, cell } = &x;
                format!("(T_hp v + G)(x) at x = {point:?} in cell {cell}, channel {channel}")
            });
            sums.value += value;
            sums.found += found;
            sums.squares += error * error;
            sums.rounding += rounding;
        }
    }
    // What is wrong everywhere is seen at once.
    for (channel, sums) in sums.iter().enumerate() {
        let error = (sums.squares.sqrt() + sums.rounding) / count;
        worst.compare(sums.value / count, sums.found / count, error, || {
            format!("T_hp v + G in the mean over {count} points, channel {channel}")
        });
    }
    worst.outcome()
}

/// (T_hp v)(x) in every channel as the mean of h(x,y) v(y) over steps.
fn mean_step<D, N, const B: usize>(
    description: &D,
    neighbour: &N,
    x: &Located<PointOf<D, B>>,
    uniforms: &mut fredholm_core::RngUniforms<fredholm_core::DefaultGenerator>,
) -> Vec<Mean>
where
    D: Description<B>,
    N: NeighbourOf<D::Equation> + ?Sized,
{
    let equation = description.equation();
    let mut means = vec![Mean::default(); equation.channels()];
    let mut brought = vec![0.0; means.len()];
    for _ in 0..STEPS {
        brought.fill(0.0);
        if let Some(y) = equation.step(&x.point, uniforms) {
            let y = neighbour.locate(y);
            let k = equation.kernel(&x.point, &y.point);
            let hv = neighbour.kernel(x, &y, &k).times(&neighbour.value(&y));
            for (channel, brought) in brought.iter_mut().enumerate() {
                *brought = hv.get(channel).to_f64();
            }
        }
        Mean::add_to_all(&mut means, &brought);
    }
    means.iter_mut().for_each(Mean::finish);
    means
}

/// **The sampler follows p** as [`sampler`](super::sampler) has it, against the masses that the description knows. `None`
/// where it knows none.
#[must_use]
pub fn sampler_by_masses<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
) -> Option<Outcome> {
    follows(description, seed, &|x, j| description.mass(x, j))
}

/// The largest ∫|K(x,y)|dμ(y) at these points, by a thousand steps from each.
pub(crate) fn norm_by_steps<D: Description<B>, const B: usize>(
    description: &D,
    points: &[PointOf<D, B>],
    seed: u64,
) -> f64 {
    const STEPS: u32 = 1000;
    let equation = description.equation();
    let mut uniforms = draws(seed, 4);
    let mut norm = |x: &PointOf<D, B>| {
        let steps = (0..STEPS).filter_map(|_| equation.step(x, &mut uniforms));
        let sizes = steps.map(|y| equation.kernel(x, &y).largest().to_f64());
        sizes.sum::<f64>() / f64::from(STEPS)
    };
    points.iter().fold(0.0, |most: f64, x| most.max(norm(x)))
}
