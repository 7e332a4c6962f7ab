//! Checks of a chain that says it preserves a density.

use fredholm_core::galerkin::Cells;
use fredholm_core::global::Stationary;
use fredholm_core::{Chain, Density, Real};

use super::chain::chi_squared;
use super::{ROUNDING, STANDARD_ERRORS, UNITS, draws, samples};
use crate::description::{Description, cell_nodes, epsilon};
use crate::outcome::{Outcome, Sum, Worst};

/// How many points the first check looks at.
const POINTS: usize = 24;
/// Walks of the second one.
const WALKS: u32 = 200_000;
/// States of each that it looks at: the start and two more, as p² need not preserve what p does.
const STATES: usize = 3;

/// **The chain preserves its density**: ∫ p0(x) p(x,y) dμ(x) = p0(y) at random y, and ∫ p0 dμ = 1, by quadrature. The
/// rule is that of [`Description::nodes`] for y, which has the kinks of p(·, y) if p is as smooth in x as in y. Of starts that
/// say nothing of the chain the second is looked at alone.
#[must_use]
pub fn preserved<D, C, const B: usize>(description: &D, chain: &C, seed: u64) -> Outcome
where
    D: Description<B, Equation: Density>,
    C: Stationary<D::Equation>,
{
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
        if chain.is_preserved() {
            let expected = chain.start_density(&y.point);
            worst.compare(expected, all.value(), unit * all.size(), || {
                format!("the integral of p0(x) p(x, .) at y = {:?}", y.point)
            });
        }
    }
    worst.outcome()
}

/// **States have the density of starts**: χ² of the cells of the first states of 200,000 walks, and of the walks that have
/// left, against ∫ p0 dμ. Of starts that say nothing of the chain, the starts alone.
#[must_use]
pub fn states<D, C, const B: usize>(description: &D, chain: &C, seed: u64) -> Outcome
where
    D: Description<B>,
    C: Stationary<D::Equation>,
{
    let equation = description.equation();
    let cells = equation.cells();
    let states = if chain.is_preserved() { STATES } else { 1 };
    let mut counts = vec![vec![0_u64; cells + 1]; states];
    let mut uniforms = draws(seed, 30);
    for _ in 0..WALKS {
        let mut x = Some(chain.start(&mut uniforms));
        for counts in &mut counts {
            // A point in no cell counts as an end.
            let cell = x.map_or(cells, |x| equation.locate(&x));
            counts[cell.min(cells)] += 1;
            x = x.and_then(|x| equation.step(&x, &mut uniforms));
        }
    }
    // The kinks of p matter nowhere.
    let mass = |j| {
        let nodes = cell_nodes(description, j).into_iter();
        let masses = nodes.map(|(x, weight)| weight * chain.start_density(&x));
        masses.sum::<f64>()
    };
    let masses: Vec<f64> = (0..cells).map(mass).collect();
    let left = 1.0 - masses.iter().sum::<f64>();
    let mut worst = Worst::new("standard deviations", STANDARD_ERRORS);
    for (l, counts) in counts.into_iter().enumerate() {
        let probabilities = masses.iter().copied().chain([left]);
        let expected = probabilities.map(|probability| f64::from(WALKS) * probability);
        if let Some(fit) = chi_squared(expected.zip(counts)) {
            worst.add(fit.degrees, fit.chi, fit.normal, || {
                format!(
                    "chi^2 of state {l} of {WALKS} walks, {} degrees of freedom",
                    fit.degrees
                )
            });
        }
    }
    worst.outcome()
}
