//! How walks go on, and what that makes of second moments.

use fredholm_core::{Absorption, Equation, NeighbourOf, ROULETTE_FLOOR, Real};

/// The chain of an equation with what ends its walks.
///
/// Let s(x,W) be the probability with which a walk goes on in x with the weight W, and B(x,W) the second moment of all that it
/// scores from there on. A step from a weight of 1 leads to w = k/s(x,1), and
///
/// ```text
/// B(y,w) = w² S(y) + ν X(y) + λ Y(y)
/// ```
///
/// where S, X and Y are the parts of B(y,1) that y itself, the step from it with what the state after it scores, and all later
/// states make. With constant absorption ν = λ = w². By roulette ν = w² s(y,1)/s(y,w), and λ = |w| as long as both these s are
/// |W| c(y): then the weight after the step is the same, and only its probability is |w| times as large. S, which is no
/// gamble, has the square of w: to count all of B by |w| makes √Var 1/√|k| times too large and more where |k| is small against c.
///
/// Beyond the ends of that range, 1 and [`ROULETTE_FLOOR`], λ is no number. The weight after the step is then
/// t = |w| s(y,1)/s(y,w) times as large, what follows between t and t² times, and so λ = max(|w|, ν) is an upper estimate, up to
/// mixed terms, and for t < 1 ν is a lower one. Below the floor |w| − ν is |w| (1 − |w| c(y)/FLOOR), at most FLOOR/(4 c(y)) =
/// 1/(32 c(y)): so much of Y is too much, for every step.
pub(crate) struct Survival<'a, E> {
    equation: &'a E,
    absorption: Absorption,
    is_pointwise: bool,
}

/// A step as the equations of the variance have it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Survived {
    /// s, by which the step's probability is multiplied, and k and h divided.
    pub(crate) probability: f64,
    /// w.
    pub(crate) kernel: f64,
    /// ν.
    pub(crate) next: f64,
    /// λ.
    pub(crate) later: f64,
}

impl<'a, E: Equation<Scalar = f64, Value = f64>> Survival<'a, E> {
    /// Walks of an equation beside this neighbour.
    pub(crate) fn new<N: NeighbourOf<E> + ?Sized>(
        equation: &'a E,
        neighbour: &N,
        absorption: Absorption,
    ) -> Self {
        Self {
            equation,
            absorption,
            is_pointwise: neighbour.is_pointwise(),
        }
    }

    /// s(x,W).
    pub(crate) fn probability(&self, x: &E::Point, weight: f64) -> f64 {
        if let Some(q) = self.absorption.probability() {
            return 1.0 - q;
        }
        let mut size = self.equation.size(x);
        if size == 0.0 && !self.is_pointwise {
            // The walk goes on for its neighbour, whose weight is the same.
            size = 1.0;
        }
        let goes_on = weight.abs() * size;
        // NaN stays NaN.
        if goes_on > 1.0 {
            1.0
        } else if goes_on > 0.0 && goes_on < ROULETTE_FLOOR {
            ROULETTE_FLOOR
        } else {
            goes_on
        }
    }

    /// A step to y with this k, of walks that have gone on with the probability s. Where s is 0 there is none.
    pub(crate) fn step(&self, probability: f64, y: &E::Point, k: f64) -> Survived {
        if probability == 0.0 {
            return Survived::default();
        }
        let kernel = k / probability;
        let square = kernel * kernel;
        let [mut next, mut later] = [square; 2];
        if self.absorption == Absorption::Roulette {
            let reached = self.probability(y, kernel);
            if reached > 0.0 {
                next *= self.probability(y, 1.0) / reached;
                later = Real::max(kernel.abs(), next);
            }
        }
        Survived {
            probability,
            kernel,
            next,
            later,
        }
    }
}
