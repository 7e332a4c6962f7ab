//! What a global estimate is made of, and how good it is.

use core::fmt::{self, Display};

use fredholm_model::numbers::short;
use serde::Serialize;

use fredholm_core::{DEFAULT_GENERATOR, StopReason};
use fredholm_model::resolvent::{FoundField, ResolventAnswer};
use fredholm_model::{GLOBAL_REPLICATES, IMAGE_HEAD};

use super::GlobalEstimate;
use crate::chosen::ChoiceReport;
use crate::report::{ChainReport, ResolventReport};
use crate::{Choices, Model, Settings};

/// What a global estimate is made of, and how good it is. The serialised names are stable; fields may be added.
///
/// ```
/// use fredholm::{CubeModel, Method, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let whole = Solver::new(&u).method(Method::Walks).cells(4).degree(0).walks(5000).whole()?;
/// assert_eq!((whole.summary().degree, whole.summary().score_degree), (0, 2));
/// assert!(whole.summary().walks >= 5000);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GlobalSummary {
    /// The kind of the problem.
    pub problem: &'static str,
    /// The dimension d of a cube.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dimension: Option<usize>,
    /// What resolvent walks knew and found, if the estimate is theirs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolvent: Option<ResolventReport>,
    /// Whether the band and the largest standard error are those of the targets, and not of points all over the space.
    #[serde(skip)]
    pub is_of_targets: bool,
    /// The number of cells as the settings count them: of a cube, per axis.
    pub cells: usize,
    /// The number of unknowns of v.
    pub unknowns: usize,
    /// The degree of v.
    pub degree: usize,
    /// How walks of a chain were made, if the estimate is theirs.
    #[serde(flatten)]
    pub chain: Option<ChainReport>,
    /// The degree of the polynomials on whose coefficients walks score.
    pub score_degree: usize,
    /// The name of the walks' floating-point type.
    pub scalar: &'static str,
    /// The name of the random number generator.
    pub generator: &'static str,
    /// The seed of the walks.
    pub seed: u64,
    /// How the cells and the degree were chosen, if they were open.
    #[serde(rename = "split", skip_serializing_if = "Option::is_none")]
    pub choice: Option<Box<ChoiceReport>>,
    /// Why the walks ended: in JSON "done", "error_not_reached", "time_limit" or "cancelled".
    #[serde(serialize_with = "crate::report::word_of")]
    pub stop: StopReason,
    /// The number of replicates.
    pub replicates: usize,
    /// The number of walks of all replicates together.
    pub walks: u64,
    /// The number of states that they visited, starts included.
    pub states: u64,
    /// The number of walks that left an open space.
    pub left: u64,
    /// The number of walks that the step limit cut off: a possible bias.
    pub step_limit: u64,
    /// The largest standard error among some 256 points, in the unit of u. `None`: no walk has scored.
    pub largest_std_error: Option<f64>,
    /// The number of standard errors that the band is wide on each side.
    pub band_factor: Option<f64>,
    /// The probability with which the band holds at all points together.
    pub band_level: f64,
    /// How far u would move with scores of one degree less, at most: many times what the projection of e loses, which no
    /// error bar sees.
    pub truncation: f64,
    /// How far F + T_K v moves with quadrature of a higher order, at most; 0 where T_K has a closed form. `None`: a
    /// higher order takes too long.
    pub quadrature_error: Option<f64>,
    /// The error that rounding leaves in a walk's scores, which more walks do not lower.
    pub rounding_floor: f64,
    /// Seconds of the set-up.
    pub setup_seconds: f64,
    /// Seconds of the walks.
    pub walk_seconds: f64,
    /// Seconds of what follows them once: the band, and the order of quadrature.
    pub band_seconds: f64,
}

impl GlobalSummary {
    /// What is known of a function that resolvent walks have found, but for its band.
    pub(super) fn of_resolvent(
        (model, settings): (&dyn Model, &Settings),
        found: &FoundField<'_>,
        answer: &ResolventAnswer,
    ) -> Self {
        let images = found.images.chunks_exact(IMAGE_HEAD + found.field.rows());
        let heads = images.filter_map(|image| image.first_chunk::<IMAGE_HEAD>());
        let [mut largest, mut moved] = [0.0_f64; 2];
        for [known, own] in heads {
            (largest, moved) = (largest.max(known.abs()), moved.max(*own));
        }
        Self {
            resolvent: Some(ResolventReport::new(answer)),
            cells: answer.cells,
            unknowns: answer.figures.unknowns,
            degree: answer.degree,
            score_degree: found.score_degree,
            stop: answer.stop,
            walks: answer.points,
            states: answer.points + answer.steps,
            largest_std_error: Some(0.0),
            quadrature_error: Some(moved),
            rounding_floor: answer.figures.floor(largest),
            setup_seconds: answer.setup_seconds,
            walk_seconds: answer.walk_seconds,
            band_seconds: found.seconds,
            ..Self::empty(model, settings)
        }
    }

    /// The summary of a function of an equation before any walk.
    pub(super) fn empty(model: &dyn Model, settings: &Settings) -> Self {
        let about = model.about();
        Self {
            problem: about.kind,
            dimension: about.dimension,
            resolvent: None,
            choice: None,
            is_of_targets: false,
            cells: 0,
            unknowns: 0,
            degree: 0,
            chain: None,
            score_degree: 0,
            scalar: settings.scalar.word(),
            generator: DEFAULT_GENERATOR,
            seed: settings.seed,
            stop: StopReason::Done,
            replicates: GLOBAL_REPLICATES,
            walks: 0,
            states: 0,
            left: 0,
            step_limit: 0,
            largest_std_error: None,
            band_factor: None,
            band_level: GlobalEstimate::BAND_LEVEL,
            truncation: 0.0,
            quadrature_error: None,
            rounding_floor: 0.0,
            setup_seconds: 0.0,
            walk_seconds: 0.0,
            band_seconds: 0.0,
        }
    }

    /// What a reader must know besides the numbers: of biases that are not small beside the error bars.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let Some(error) = self.largest_std_error else {
            remarks.push("no walk has scored, so that there are no error bars".to_owned());
            return remarks;
        };
        if self.truncation > 0.5 * error {
            remarks.push(format!(
                "with scores of one degree less u would move by {}, more than half of the largest standard error {}: the \
                 projection of e may be a bias that the band does not see; use more cells or a higher degree of scores",
                short(self.truncation),
                short(error)
            ));
        }
        match self.quadrature_error {
            Some(moved) if moved > (0.1 * error).max(self.rounding_floor) => remarks.push(format!(
                "with a higher order of quadrature F + T_K v still moves by {}, beside a largest standard error of {}: the \
                 band does not see that; use more cells",
                short(moved),
                short(error)
            )),
            None => remarks.push(
                "the quadrature of T_K could not be compared with one of higher order: use fewer cells".to_owned(),
            ),
            Some(_) => {}
        }
        // Of resolvent walks the condition number says it.
        if self.rounding_floor > error && self.resolvent.is_none() {
            remarks.push(format!(
                "rounding leaves an error of about {}, which more walks do not lower",
                short(self.rounding_floor)
            ));
        }
        if self.step_limit > 0 {
            remarks.push(format!(
                "the step limit cut off {} walks: a possible bias",
                self.step_limit
            ));
        }
        remarks
    }
}

impl Display for GlobalSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(found) = &self.resolvent {
            return write!(f, "{found}; scores of degree {}", self.score_degree);
        }
        write!(
            f,
            "{} walks, {} states in {} replicates; v of degree {}{} on {} cells, scores of degree {}",
            self.walks,
            self.states,
            self.replicates,
            self.degree,
            self.chain.map_or(String::new(), |chain| chain.lifted()),
            self.cells,
            self.score_degree
        )
    }
}
