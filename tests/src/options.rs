//! Options of walks.

use fredholm_core::{Absorption, Estimator, Form, WalkOptions};

/// Walks by default, with this seed.
#[must_use]
pub fn seeded(seed: u64) -> WalkOptions {
    WalkOptions {
        seed,
        ..WalkOptions::default()
    }
}

/// Walks with the constant absorption q0 = 0.2, in the residual form.
#[must_use]
pub fn absorbed(estimator: Estimator, seed: u64) -> WalkOptions {
    WalkOptions {
        absorption: Absorption::Constant {
            probability: 0.2,
            estimator,
        },
        ..seeded(seed)
    }
}

/// Walks with the constant absorption q0 = 0.2 in the product form, as in the paper.
#[must_use]
pub fn paper(estimator: Estimator, seed: u64) -> WalkOptions {
    WalkOptions {
        form: Form::Product,
        ..absorbed(estimator, seed)
    }
}

/// Both estimators as in the paper, and walks by default.
#[must_use]
pub fn all_ways(seed: u64) -> [WalkOptions; 3] {
    let [absorption, collision] = [Estimator::Absorption, Estimator::Collision];
    [
        paper(absorption, seed),
        paper(collision, seed),
        seeded(seed),
    ]
}
