//! Where resolvent walks answer, and where walks of the chain do.

use fredholm_model::resolvent::{ResolventAnswer, ResolventQuestion};

use std::sync::Once;

use fredholm_rayon::Observer;

use super::Solver;
use crate::{Error, Goal, Method, SolveError, SolveObserver, Subject};

/// Says that walks are under way as soon as some are.
struct Walking<'a> {
    watch: &'a dyn SolveObserver,
    begun: Once,
}

impl Observer for Walking<'_> {
    fn walked(&self, walks: u64) {
        self.begun.call_once(|| self.watch.walking());
        self.watch.walked(walks);
    }

    fn cancelled(&self) -> bool {
        self.watch.cancelled()
    }
}

/// What resolvent walks say to a question.
#[derive(Debug)]
pub(crate) enum ByResolvent {
    /// Their answer.
    Answered(ResolventAnswer),
    /// No cells serve, or none are few enough: walks of the chain may answer.
    Refused(Error),
    /// The question is for walks of the chain.
    NotAsked,
}

/// The error of walks of the chain, or why resolvent walks were refused before, where the chain has no finite variance: they ask for less.
pub(super) fn reason(error: SolveError, refused: Option<Error>) -> SolveError {
    match (error, refused) {
        (
            SolveError::Failed(Error::InfiniteVariance { .. } | Error::InfiniteNeighbour { .. }),
            Some(refused @ Error::Regular { .. }),
        ) => refused.into(),
        (error, _) => error,
    }
}

impl Solver<'_> {
    /// What resolvent walks would choose, without walking: cells, degree, and how many points they expect to take. `None` where walks
    /// of the chain answer.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// let u = CubeModel::from_fn::<1>(|x, y| 2.0 * (-(x[0] - y[0]).powi(2)).exp(), |_| 1.0);
    /// let chosen = Solver::new(&u).at(0.3).predict_resolvent()?.unwrap();
    /// assert!(chosen.radius < 0.3 && chosen.points == 100_000 && chosen.rounds == 0);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn predict_resolvent(&self) -> Result<Option<ResolventAnswer>, SolveError> {
        self.check()?;
        let targets = self.targets()?;
        let goals = self.goals(&targets)?;
        Ok(match self.by_resolvent(&goals, true)? {
            ByResolvent::Answered(answer) => Some(answer),
            _ => None,
        })
    }

    /// Asks resolvent walks, if the method is theirs: where it is open, that of equations which take them, unless something is asked for
    /// that they have not.
    pub(crate) fn by_resolvent(
        &self,
        goals: &[Goal],
        is_prediction: bool,
    ) -> Result<ByResolvent, SolveError> {
        let has_threads = self.execute.takes_whole();
        let is_asked = self.settings.method == Some(Method::Resolvent);
        let is_meant = self.settings.method.is_none()
            && self.model.about().takes_resolvent
            && self.settings.of_chain().is_none()
            && has_threads
            && self.systems.0.is_none();
        if !(is_asked || is_meant) {
            return Ok(ByResolvent::NotAsked);
        }
        if !has_threads {
            return Err(SolveError::Failed(Error::Option {
                subject: Subject::Problem,
                message: "resolvent walks are those of one process: leave parts of a run out, or use another `method`"
                    .to_owned(),
            }));
        }
        let question = ResolventQuestion {
            goals,
            settings: &self.settings,
            is_prediction,
            watch: &Walking {
                watch: self.watch,
                begun: Once::new(),
            },
        };
        match self.model.by_resolvent(&question) {
            Ok(answer) => Ok(ByResolvent::Answered(answer)),
            Err(refused @ (Error::Regular { .. } | Error::NoSetting)) if is_meant => {
                Ok(ByResolvent::Refused(refused))
            }
            Err(error) => Err(error.into()),
        }
    }
}
