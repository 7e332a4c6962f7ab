//! What walks score, as sources of the equations.

use fredholm_core::Estimator;
use fredholm_core::array::Each;

use crate::Node;

/// A product that a walk scores where it is absorbed, over q; 0 where there is nothing to score.
pub(crate) fn scored(product: f64, q: f64) -> f64 {
    if product == 0.0 { 0.0 } else { product / q }
}

/// The source of E η(k,f)².
fn plain_source(estimator: Estimator, x: &Node) -> f64 {
    // Of an F that is drawn it is the mean square of what is drawn.
    let (f, noise) = (x.source, x.source_noise);
    match estimator {
        Estimator::Absorption => scored(f * f + noise, x.absorption),
        Estimator::Collision => f * (2.0 * (x.value + x.error) - f) + noise,
    }
}

/// The parts of E η(k,f)² and of w that x itself scores.
pub(crate) fn own_squares(estimator: Estimator, x: &Node) -> [f64; 2] {
    [plain_source(estimator, x), square_source(estimator, x)]
}

/// E η(k,f)² and w.
pub(crate) fn totals(estimator: Estimator, x: &Node) -> [f64; 2] {
    let own = own_squares(estimator, x);
    [0, 1].each(|i| own[i] + x.next[i] + x.later[i])
}

/// The sources of s and c.
pub(crate) fn second_sources(estimator: Estimator, x: &Node) -> [f64; 2] {
    // Of a G that is drawn it is the mean square of what is drawn, and of its difference from F, from which it is drawn apart.
    let (g, difference) = (x.neighbour_source, x.difference());
    let noise = x.noise - x.source_noise;
    match estimator {
        Estimator::Absorption => {
            [g * g + noise, difference * g - noise].each(|s| scored(s, x.absorption))
        }
        Estimator::Collision => [
            g * (2.0 * x.value - g) + noise,
            difference * x.value + g * (x.error - difference) - noise,
        ],
    }
}

/// What stands for s and c in the residual form: there a difference of kernels multiplies v(y), which no walk makes noisy, and
/// so E (v Δ) = v e.
pub(crate) fn residual_seconds(x: &Node) -> [f64; 2] {
    [x.value * x.value, x.value * x.error]
}

/// The source of w that is the sources' difference.
fn square_source(estimator: Estimator, x: &Node) -> f64 {
    let difference = x.difference();
    match estimator {
        Estimator::Absorption => scored(difference * difference + x.noise, x.absorption),
        Estimator::Collision => difference * (2.0 * x.error - difference) + x.noise,
    }
}
