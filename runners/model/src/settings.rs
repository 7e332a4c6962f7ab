//! All that may be said of a solution besides the equation: what is open is chosen.

use core::time::Duration;

use fredholm_core::{Absorption, Estimator, Form, Sequence, Tolerance};
use serde::{Deserialize, Serialize};

use crate::Uncertainty;
use crate::question::ResolventAnswer;
use crate::written::{choice, open_choice, tolerance};
use crate::{Choices as _, Error, Method, Model, Pairs, Scalar, Subject, WholeValues};

/// Replicates of a sequence: a standard error of 32 is itself uncertain by 13 %, and Student's quantile of 95 % is 2.04.
const REPLICATES: u64 = 32;
/// The fewest points of a replicate of resolvent walks that are chosen: its set-up takes as long as some.
const LEAST_REPLICATE: u64 = 256;
/// The most walks of a replicate: batches are what is waited for when somebody cancels.
const LONGEST: u64 = 1 << 24;

/// The settings of a solution. `None` is open: it is chosen, or has a default where nothing is to be chosen.
///
/// ```
/// use fredholm::{CubeModel, Settings, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let settings = Settings { cells: Some(4), degree: Some(1), seed: 7, ..Settings::default() };
/// let report = Solver::with(&u, settings, Vec::new()).mean().walks(5000).solve()?;
/// assert_eq!((report.cells, report.degree, report.seed), (4, 1, 7));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The method; walks of the chain if it is open.
    #[serde(default, with = "open_choice")]
    pub method: Option<Method>,
    /// Cells; of a cube per axis.
    pub cells: Option<usize>,
    /// Degree of the polynomials on a cell.
    pub degree: Option<usize>,
    /// How the neighbour equation treats pairs of cells.
    #[serde(with = "open_choice")]
    pub pairs: Option<Pairs>,
    /// Degree of the polynomials on which F + T_K v is projected, for walks with h = k: higher than that of v.
    /// 0: there is no lift.
    #[serde(default)]
    pub lift: Option<usize>,
    /// Degree of the polynomials on whose coefficients the walks of a global estimate score.
    pub score_degree: Option<usize>,
    /// Whether all targets are answered from one set of walks, by a global estimate. If it is open, so are they where that
    /// is predicted to take less time than walks of every target.
    #[serde(skip)]
    pub global: Option<bool>,
    /// Quadrature points of a cell and axis, where coefficients come from quadrature.
    pub points: Option<usize>,
    /// How cells shrink towards the corners of a room; 1 makes them equal.
    pub grading: Option<f64>,
    /// Whether the walls of a room are cut at the edges of shadows.
    pub shadow_cuts: Option<bool>,
    /// Walks for each goal; with a tolerance the most.
    pub walks: Option<u64>,
    /// q0, the probability that a walk is absorbed in a state. If it is open, [`absorption`](Self::absorption()) says how walks end;
    /// those of a global estimate, and those of a sequence that is chosen, have the q0 that is best for them.
    pub absorption: Option<f64>,
    /// The estimator: what a walk with constant absorption scores.
    #[serde(with = "open_choice")]
    pub estimator: Option<Estimator>,
    /// The form of the control variate.
    #[serde(with = "open_choice")]
    pub form: Option<Form>,
    /// The numbers that walks draw.
    #[serde(default, with = "open_choice")]
    pub sequence: Option<Sequence>,
    /// The number of first states in which walks are not absorbed.
    #[serde(default)]
    pub forced_steps: Option<u32>,
    /// Whether the last step of walks leads to the light: they are for u less the emission of some parts of the space, which
    /// every score looks at directly.
    #[serde(default)]
    pub last_step: Option<bool>,
    /// Whether walks go from the sources to the receivers: the way back.
    #[serde(default)]
    pub adjoint: Option<bool>,
    /// The floating-point type of walks.
    #[serde(with = "choice")]
    pub scalar: Scalar,
    /// The seed of all draws.
    pub seed: u64,
    /// Walks of a batch.
    pub batch: Option<u64>,
    /// The standard error at which a goal is done.
    #[serde(with = "tolerance")]
    pub tolerance: Option<Tolerance>,
    /// The time after which walks end.
    #[serde(skip)]
    pub time_limit: Option<Duration>,
    /// Whether walks of infinite variance are wanted.
    pub allow_infinite_variance: bool,
    /// Whether the derivatives of all targets are wanted, too.
    #[serde(default)]
    pub sensitivities: bool,
    /// How well quantities are known, for what follows for the targets.
    #[serde(default)]
    pub uncertainties: Vec<Uncertainty>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: None,
            cells: None,
            degree: None,
            pairs: None,
            lift: None,
            score_degree: None,
            global: None,
            points: None,
            grading: None,
            shadow_cuts: None,
            walks: None,
            absorption: None,
            estimator: None,
            form: None,
            sequence: None,
            forced_steps: None,
            last_step: None,
            adjoint: None,
            scalar: Scalar::F64,
            seed: 1,
            batch: None,
            tolerance: None,
            time_limit: None,
            allow_infinite_variance: false,
            sensitivities: false,
            uncertainties: Vec::new(),
        }
    }
}

impl Settings {
    /// Walks of each goal where nothing is said of them.
    pub const WALKS: u64 = 100_000;
    /// q0 where an estimator, a form or a sequence is asked for that needs one and nothing is said of it: that of Heinrich 1995.
    pub const ABSORPTION: f64 = 0.2;
    /// Walks of a batch where nothing is said of it, and they are pseudo-random.
    pub const BATCH: u64 = 4096;
    /// The form of the control variate where nothing is said of it.
    pub const FORM: Form = Form::Residual;

    /// These settings for a model: where the way back is a global estimate they ask for that.
    ///
    /// ```
    /// use fredholm::{CubeModel, Settings};
    ///
    /// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
    /// let asked = Settings { adjoint: Some(true), ..Settings::default() };
    /// assert_eq!(asked.for_model(&u).global, Some(true));
    /// ```
    #[must_use]
    pub fn for_model(self, model: &dyn Model) -> Self {
        let is_open = self.adjoint == Some(true) && self.global.is_none();
        let is_global = !model.about().has_adjoint && model.about().whole != WholeValues::None;
        match is_open && is_global && !model.about().is_adjoint {
            true => Self {
                adjoint: None,
                global: Some(true),
                ..self
            },
            false => self,
        }
    }

    /// Refuses numbers that cannot be, whatever the equation.
    ///
    /// # Errors
    /// [`Error::Option`].
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |subject, message: String| Err(Error::Option { subject, message });
        if let Some(q) = self.absorption.filter(|q| !(*q > 0.0 && *q < 1.0)) {
            let message = format!("an absorption of {q}: it must be between 0 and 1");
            return refuse(Subject::Absorption, message);
        }
        if let (Some(Method::Resolvent), Some(name)) = (self.method, self.of_chain()) {
            let message = format!(
                "`{name}` is for walks of a chain, and the method is \"resolvent\": leave one of the two out"
            );
            return refuse(Subject::Problem, message);
        }
        if let Some(lift) = self.lifted() {
            self.check_lift(lift)?;
        }
        let Some(error) = self.tolerance.as_ref().map(Tolerance::bound) else {
            return Ok(());
        };
        if error > 0.0 && error.is_finite() {
            return Ok(());
        }
        let message = format!("an error of {error}: it must be a number above 0");
        refuse(Subject::Tolerance, message)
    }

    /// Walks of a batch: with pseudo-random numbers [`BATCH`](Self::BATCH) unless it is given. Batches that are replicates of a
    /// sequence, or of resolvent walks, have the largest power of 2 of which 32 are not more than all walks, as longer ones gain more; with a
    /// tolerance, which fewer walks may reach, no more than `BATCH`.
    #[must_use]
    pub fn batch(&self) -> u64 {
        let is_random = self.sequence != Some(Sequence::Sobol);
        let is_random = is_random && self.method != Some(Method::Resolvent);
        self.batch.unwrap_or_else(|| match is_random {
            true => Self::BATCH,
            false => {
                let share = (self.walks.unwrap_or(Self::WALKS) / REPLICATES).max(1);
                let longest = self.tolerance.map_or(LONGEST, |_| Self::BATCH);
                (1 << share.ilog2()).min(longest)
            }
        })
    }

    /// The settings of resolvent walks whose batches are samples of their own, with what was chosen. Batches are shorter than nets of one process,
    /// and gain less: more of them are walked than are predicted, if an error is asked for.
    #[must_use]
    pub(crate) fn divided(&self, chosen: &ResolventAnswer) -> Self {
        let predicted = chosen.points.max(REPLICATES * LEAST_REPLICATE);
        let walks = self.walks.unwrap_or(match self.tolerance {
            Some(_) => predicted.saturating_mul(REPLICATES),
            None => Self::WALKS,
        });
        let own = Self {
            method: Some(Method::Resolvent),
            cells: Some(chosen.cells),
            degree: Some(chosen.degree),
            walks: Some(walks),
            ..self.clone()
        };
        let of_error = Self {
            walks: Some(predicted.min(walks)),
            tolerance: None,
            ..own.clone()
        };
        Self {
            batch: Some(of_error.batch()),
            ..own
        }
    }

    /// The name of a setting that is given and that walks of the equation's chain have alone, if there is one: resolvent walks know nothing
    /// of it.
    #[must_use]
    pub fn of_chain(&self) -> Option<&'static str> {
        let all = [
            ("pairs", self.pairs.is_some()),
            ("lift", self.lift.is_some()),
            ("score_degree", self.score_degree.is_some()),
            ("points", self.points.is_some()),
            ("absorption", self.absorption.is_some()),
            ("estimator", self.estimator.is_some()),
            ("form", self.form.is_some()),
            ("sequence", self.sequence.is_some()),
            ("forced_steps", self.forced_steps.is_some()),
            ("last_step", self.last_step.is_some()),
            ("adjoint", self.adjoint.is_some()),
            ("scalar", self.scalar == Scalar::F32),
            ("allow_infinite_variance", self.allow_infinite_variance),
        ];
        all.into_iter()
            .find_map(|(name, is_given)| is_given.then_some(name))
    }

    /// The degree to which v is lifted, if it is: 0 says that it is not, and is not by the choice either.
    #[must_use]
    pub fn lifted(&self) -> Option<usize> {
        self.lift.filter(|lift| *lift > 0)
    }

    /// Refuses what does not go with a lift.
    fn check_lift(&self, lift: usize) -> Result<(), Error> {
        let refuse = |subject, message: String| Err(Error::Option { subject, message });
        let own = self.degree.unwrap_or(0);
        if lift <= own {
            let message = format!(
                "a lift to degree {lift}: it must be of a higher degree than v, which has {own}"
            );
            return refuse(Subject::Lift, message);
        }
        if self.pairs.is_some() {
            let message = "with a `lift` all pairs are pointwise: leave `pairs` out".to_owned();
            return refuse(Subject::Pairs, message);
        }
        Ok(())
    }

    /// How space is cut, with a default for what is open; the problem chooses cells.
    #[must_use]
    pub fn discretisation(&self) -> Discretisation {
        Discretisation {
            cells: self.cells,
            degree: self.degree.unwrap_or(0),
            points: self.points,
            grading: self.grading,
            shadow_cuts: self.shadow_cuts,
            scalar: self.scalar,
        }
    }

    /// How walks end: by roulette, unless q0, the paper's method, the absorption estimator, the product form or a sequence is asked for. Weights of the
    /// product form are those of h, and roulette by those of k may leave it no finite variance. Where walks draw from a sequence,
    /// roulette makes jumps of what they score, all over the cube, and a constant q0 in planes along its sides.
    #[must_use]
    pub fn absorption(&self) -> Absorption {
        let is_constant = self.method == Some(Method::Paper)
            || self.estimator == Some(Estimator::Absorption)
            || self.form == Some(Form::Product)
            || self.sequence == Some(Sequence::Sobol);
        let probability = match self.absorption {
            None if is_constant => Some(Self::ABSORPTION),
            said => said,
        };
        probability.map_or(Absorption::Roulette, |probability| Absorption::Constant {
            probability,
            estimator: self.estimator.unwrap_or(Estimator::Collision),
        })
    }

    /// The walks, with a default for what is open.
    #[must_use]
    pub fn walk_options(&self) -> WalkOptions {
        let (pairs, form) = match self.method {
            Some(Method::Paper) => (Pairs::Paper, Form::Product),
            _ => (Pairs::Default, Self::FORM),
        };
        WalkOptions {
            pairs: self.pairs.unwrap_or(pairs),
            walks: self.walks.unwrap_or(Self::WALKS),
            absorption: self.absorption(),
            form: self.form.unwrap_or(form),
            seed: self.seed,
            sequence: self.sequence.unwrap_or(Sequence::Random),
            forced_steps: self.forced_steps.unwrap_or(0),
            last_step: self.last_step.unwrap_or(false),
            batch: self.batch(),
            tolerance: self.tolerance,
            time_limit: self.time_limit,
            allow_infinite_variance: self.allow_infinite_variance,
        }
    }
}

/// How space is cut into cells, and what is solved on them.
///
/// ```
/// use fredholm::Settings;
///
/// let coarse = Settings { cells: Some(10), ..Settings::default() }.discretisation();
/// assert_eq!(coarse.on(20).cells, Some(20));
/// assert_eq!(coarse.degree, 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discretisation {
    /// Cells, of a cube per axis; without a number the problem chooses.
    pub cells: Option<usize>,
    /// Degree of the polynomials on a cell.
    pub degree: usize,
    /// Quadrature points of a cell and axis.
    pub points: Option<usize>,
    /// How cells shrink towards the corners of a room; without a number as serves the degree where h = k.
    pub grading: Option<f64>,
    /// Whether the walls of a room are cut at the edges of shadows.
    pub shadow_cuts: Option<bool>,
    /// The floating-point type in which walks meet the cells.
    pub scalar: Scalar,
}

impl Discretisation {
    /// This discretisation with another number of cells.
    #[must_use]
    pub const fn on(self, cells: usize) -> Self {
        Self {
            cells: Some(cells),
            ..self
        }
    }
}

/// How walks are made, and the neighbour equation that they follow.
///
/// ```
/// use fredholm::{Absorption, Pairs, Settings};
///
/// let walk = Settings::default().walk_options();
/// assert_eq!((walk.walks, walk.absorption, walk.pairs), (100_000, Absorption::Roulette, Pairs::Default));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkOptions {
    /// How the neighbour equation treats pairs of cells.
    pub pairs: Pairs,
    /// Walks for each goal; with a tolerance the most.
    pub walks: u64,
    /// How walks end, and what they score.
    pub absorption: Absorption,
    /// The form of the control variate.
    pub form: Form,
    /// The numbers that walks draw.
    pub sequence: Sequence,
    /// The number of first states in which walks are not absorbed.
    pub forced_steps: u32,
    /// Whether the last step of walks leads to the light.
    pub last_step: bool,
    /// The seed of all draws.
    pub seed: u64,
    /// Walks of a batch.
    pub batch: u64,
    /// The standard error at which a goal is done.
    pub tolerance: Option<Tolerance>,
    /// The time after which walks end.
    pub time_limit: Option<Duration>,
    /// Whether walks of infinite variance are wanted.
    pub allow_infinite_variance: bool,
}

impl WalkOptions {
    /// The name of the sequence that walks draw from, if they draw no pseudo-random numbers.
    #[must_use]
    pub fn sequence_word(&self) -> Option<&'static str> {
        (self.sequence != Sequence::Random).then(|| self.sequence.word())
    }

    /// What a job of the core takes of them.
    pub fn for_core(&self) -> fredholm_core::WalkOptions {
        fredholm_core::WalkOptions {
            seed: self.seed,
            absorption: self.absorption,
            form: self.form,
            forced_steps: self.forced_steps,
            ..fredholm_core::WalkOptions::default()
        }
    }
}
