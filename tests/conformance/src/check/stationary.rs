//! Checks of a chain that says it preserves a density.

use fredholm_core::galerkin::Partition;
use fredholm_core::whole::Starts;
use fredholm_core::{Sampler, TransitionDensity, Uniforms};

use super::chain::chi_squared;
use super::{ROUNDING, STANDARD_ERRORS, UNITS, draws, samples};
use crate::description::{Description, PointOf, ScalarOf, epsilon};
use crate::outcome::{Outcome, Sum, Worst};

/// How many points the first check looks at.
const POINTS: usize = 24;
/// Walks of the second one.
const WALKS: u32 = 200_000;
/// States of each that it looks at: the start and two more, as p² need not preserve what p does.
const STATES: usize = 3;

/// **The chain preserves its density**: ∫ p0(x) p(x,y) dμ(x) = s p0(y) at random y, and ∫ p0 dμ = 1, by quadrature. The
/// rule is that of [`Description::nodes`] for y, which has the kinks of p(·, y) if p is as smooth in x as in y. Of starts that
/// say nothing of the chain the second is looked at alone.
#[must_use]
pub fn preserved<D, C, const B: usize>(description: &D, chain: &C, seed: u64) -> Outcome
where
    D: Description<B>,
    C: Starts<D::Equation>,
{
    use fredholm_core::Real;
    let equation = description.equation();
    let mut worst = Worst::new(UNITS, ROUNDING);
    for y in samples(description, seed, POINTS) {
        let (mut all, mut mass, mut size) = (Sum::default(), Sum::default(), 1.0);
        for j in 0..equation.cells() {
            size += description.sensitivity(&y.point, j);
            for (x, weight) in description.nodes(&y.point, j) {
                let p0 = weight * chain.start_density(&x);
                mass.add(p0);
                all.add(p0 * equation.density(&x, &y.point).to_f64());
            }
        }
        let unit = epsilon::<D, B>() * size;
        worst.compare(1.0, mass.value(), unit, || "the integral of p0".to_owned());
        let Some(survival) = chain.survival() else {
            continue;
        };
        let expected = survival * chain.start_density(&y.point);
        worst.compare(expected, all.value(), unit * all.size(), || {
            format!("the integral of p0(x) p(x, .) at y = {:?}", y.point)
        });
    }
    worst.outcome()
}

/// **States have the density of starts**: χ² of the cells of the first states of 200,000 walks, and of the walks that have
/// ended, against s^l ∫ p0 dμ. If the density of all states together is known instead, their cells against that; of starts
/// that say nothing of the chain, the starts alone.
#[must_use]
pub fn states<D, C, const B: usize>(description: &D, chain: &C, seed: u64) -> Outcome
where
    D: Description<B>,
    C: Starts<D::Equation>,
{
    let equation = description.equation();
    let cells = equation.cells();
    // The kinks of p matter nowhere: any point will do.
    let anywhere = description.point(0, &vec![0.5; D::DIMENSION]);
    let knows_all = chain.density_of_states(&anywhere, STATES).is_some();
    let states = if chain.survival().is_some() || knows_all {
        STATES
    } else {
        1
    };
    let mut counts = vec![vec![0_u64; cells + 1]; states];
    let mut uniforms = draws(seed, 30);
    for _ in 0..WALKS {
        let mut x = Some(chain.start(&mut uniforms));
        for counts in &mut counts {
            // A point in no cell counts as an end.
            let cell = x.map_or(cells, |x| equation.locate(&x));
            counts[cell.min(cells)] += 1;
            x = x.and_then(|x| {
                let xi: ScalarOf<D, B> = uniforms.uniform();
                if xi < equation.absorption(&x) {
                    None
                } else {
                    equation.step(&x, &mut uniforms)
                }
            });
        }
    }
    // Of the l-th state.
    let density = |x: &PointOf<D, B>, l: usize| {
        let up_to = |most| chain.density_of_states(x, most).unwrap_or(f64::NAN);
        match chain.survival() {
            None if knows_all && l > 0 => up_to(l + 1) - up_to(l),
            None if knows_all => up_to(1),
            survival => chain.start_density(x) * survival.unwrap_or(0.0).powi(l as i32),
        }
    };
    let mut worst = Worst::new("standard deviations", STANDARD_ERRORS);
    for (l, counts) in counts.into_iter().enumerate() {
        let mass = |j| {
            let nodes = description.nodes(&anywhere, j).into_iter();
            nodes.map(|(x, weight)| weight * density(&x, l)).sum()
        };
        let masses: Vec<f64> = (0..cells).map(mass).collect();
        let ended = 1.0 - masses.iter().sum::<f64>();
        let probabilities = masses.into_iter().chain([ended]);
        let expected = probabilities.map(|probability| f64::from(WALKS) * probability);
        if let Some([degrees, chi, normal]) = chi_squared(expected.zip(counts)) {
            worst.add(degrees, chi, normal, || {
                format!("chi^2 of state {l} of {WALKS} walks, {degrees} degrees of freedom")
            });
        }
    }
    worst.outcome()
}
