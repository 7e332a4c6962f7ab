//! How walks of a chain were made.

use core::fmt::{self, Display};

use serde::Serialize;

use super::is_zero;
use crate::chosen::{draws, ending};
use crate::{Choices, Pairs, WalkOptions};

/// How walks of a chain were made. The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::{CubeModel, Method, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let solver = Solver::new(&u).mean().cells(4).method(Method::Walks);
/// let chain = solver.absorption(0.2).walks(5000).solve()?.chain.unwrap();
/// assert_eq!((chain.absorption, chain.estimator), (Some(0.2), "collision"));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ChainReport {
    /// The degree of the lift, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lift: Option<usize>,
    /// The name of the choice of pairs; "no" for plain walks.
    pub pairs: &'static str,
    /// q0; null: walks end by roulette.
    pub absorption: Option<f64>,
    /// The name of the estimator.
    pub estimator: &'static str,
    /// The name of the form of the control variate.
    pub form: &'static str,
    /// The name of the sequence that walks draw from, if they draw no pseudo-random numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sequence: Option<&'static str>,
    /// The number of first states in which walks are not absorbed.
    #[serde(skip_serializing_if = "is_zero")]
    pub forced_steps: u32,
    /// Whether the last step of walks leads to the light, where that is asked for or chosen.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub last_step: bool,
    /// Whether walks go from the sources to the receivers.
    #[serde(skip_serializing_if = "core::ops::Not::not")]
    pub adjoint: bool,
}

impl ChainReport {
    /// Walks from the receivers to the sources, with a neighbour equation of this lift.
    pub(crate) fn new(walk: &WalkOptions, lift: Option<usize>) -> Self {
        Self {
            lift,
            pairs: lift.map_or(walk.pairs, |_| Pairs::Pointwise).word(),
            absorption: walk.absorption.probability(),
            estimator: walk.absorption.estimator().word(),
            form: walk.form.word(),
            sequence: walk.sequence_word(),
            forced_steps: walk.forced_steps,
            last_step: walk.last_step,
            adjoint: false,
        }
    }

    /// Walks that follow no neighbour equation.
    pub(crate) fn plain(walk: &WalkOptions) -> Self {
        Self {
            pairs: "no",
            ..Self::new(walk, None)
        }
    }

    /// The lift in words, or nothing.
    pub(crate) fn lifted(&self) -> String {
        self.lift
            .map_or(String::new(), |lift| format!(" lifted to {lift}"))
    }
}

impl Display for ChainReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} pairs, {}{}",
            self.pairs,
            ending(self.absorption, self.estimator),
            draws(
                self.sequence,
                self.forced_steps,
                self.last_step,
                self.adjoint
            )
        )
    }
}
