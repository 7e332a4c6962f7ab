//! Where resolvent walks answer, and where walks of the chain do.

use fredholm_model::resolvent::{ResolventAnswer, ResolventFound, ResolventQuestion};

use std::sync::{Mutex, Once, PoisonError};
use web_time::Instant;

use fredholm_model::{Prepared, Request, Wanted};
use fredholm_rayon::Observer;

use super::Solver;
use crate::answer::Answer;
use crate::execute::{CellCount, Execution, SetUp};
use crate::report::Report;
use crate::whole::PROBES;
use crate::{Error, GlobalEstimate, Goal, Method, Settings, SolveError, SolveObserver};

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
pub(crate) enum ByResolvent<'m> {
    /// Their answer.
    Answered(Box<ResolventFound<'m>>),
    /// The answer of walks whose batches are samples of their own, with the settings that they had and their cells.
    Divided(Box<(Answer, Settings, CellCount)>),
    /// No cells serve, or none are few enough: walks of the chain may answer.
    Refused(Error),
    /// The question is for walks of the chain.
    NotAsked,
}

/// The error of walks of the chain, or why resolvent walks were refused before, where the chain has no finite variance: they ask for less.
pub(super) fn reason(error: SolveError, refused: Option<Error>) -> SolveError {
    match (error, refused) {
        (
            SolveError::Failed(Error::InfiniteVariance { .. }),
            Some(refused @ Error::Regular { .. }),
        ) => refused.into(),
        (error, _) => error,
    }
}

impl<'m> Solver<'m> {
    /// What resolvent walks would choose, without walking: cells, degree, and how many points they expect to take. `None` where walks
    /// of the chain answer.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// let u = CubeModel::from_fn::<1>(|x, y| 2.0 * (-(x[0] - y[0]).powi(2)).exp(), |_| 1.0);
    /// let chosen = Solver::new(&u).at(0.3).predict_resolvent()?.unwrap();
    /// assert!(chosen.figures.radius < 0.3 && chosen.points == 100_000 && chosen.rounds == 0);
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
            ByResolvent::Answered(found) => Some(found.answer),
            _ => None,
        })
    }

    /// The global estimate by resolvent walks, if the method is theirs and values may be those of a function: points all over the space stand
    /// for all.
    pub(super) fn whole_by_resolvent(&self) -> Result<Option<GlobalEstimate<'m>>, SolveError> {
        let settings = Settings {
            global: Some(true),
            ..self.settings.clone()
        };
        let solver = Self {
            settings,
            ..self.clone()
        };
        let points = self.model.spread(PROBES).into_iter();
        let goals: Vec<Goal> = points.map(|region| Goal::new("u", region)).collect();
        let ByResolvent::Answered(found) = solver.by_resolvent(&goals, false)? else {
            return Ok(None);
        };
        let ResolventFound { answer, field } = *found;
        let by = (self.model, &self.settings);
        let function = |field| GlobalEstimate::of_resolvent(by, &goals, field, &answer);
        let function = field.map(function);
        Ok(function.map(|(function, _)| function))
    }

    /// The report of what resolvent walks have found.
    pub(super) fn report_of_resolvent(
        &self,
        goals: &[Goal],
        exact: &[Option<f64>],
        found: ResolventFound<'_>,
    ) -> Result<Report, Error> {
        let ResolventFound { answer, field } = found;
        let (model, settings) = (self.model, &self.settings);
        let Some(field) = field else {
            return Ok(Report::of_resolvent(model, goals, exact, settings, &answer));
        };
        let by = (model, settings);
        let (function, values) = GlobalEstimate::of_resolvent(by, goals, field, &answer);
        let mut whole = function.report_of(goals, values)?;
        whole.summary.is_of_targets = true;
        Report::of_whole((&function, whole), goals, settings, (None, &self.means))
    }

    /// Has whoever runs walks run these.
    fn run_replicates(
        &self,
        goals: &[Goal],
        prepared: &Prepared<'_>,
        (settings, chosen): (&Settings, &ResolventAnswer),
        setup_seconds: f64,
    ) -> Result<Box<(Answer, Settings, CellCount)>, Error> {
        let cells = CellCount {
            cells: chosen.cells,
            unknowns: chosen.figures.unknowns,
            text: chosen.cells.to_string(),
        };
        let execution = Execution {
            execute: self.execute,
            settings,
            plain: false,
            cells: &cells,
            choice: None,
        };
        let set_up = SetUp {
            resolvent: Some(chosen.figures),
            ..SetUp::new(prepared, setup_seconds)
        };
        let request = Request {
            goals,
            walk: &settings.walk_options(),
            wanted: Wanted::U,
        };
        let walks = execution.walks(self.model);
        let answer = walks.run_as(&request, self.watch, prepared.job, &set_up)?;
        Ok(Box::new((answer, settings.clone(), cells)))
    }

    /// Asks resolvent walks, if the method is theirs: where it is open, that of equations which take them, unless something is asked for
    /// that they have not.
    pub(crate) fn by_resolvent(
        &self,
        goals: &[Goal],
        is_prediction: bool,
    ) -> Result<ByResolvent<'m>, SolveError> {
        let is_asked = self.settings.method == Some(Method::Resolvent);
        let is_meant = self.settings.method.is_none()
            && self.model.about().takes_resolvent
            && self.settings.of_chain().is_none()
            && self.systems.0.is_none()
            && !self.walks_tell_derivatives()?;
        if !(is_asked || is_meant) {
            return Ok(ByResolvent::NotAsked);
        }
        let of_one = Settings {
            global: Some(false),
            ..self.settings.clone()
        };
        let is_divided = self.settings.global != Some(true)
            && (self.settings.batch.is_some() || !self.execute.takes_whole());
        let divided = Mutex::new(None);
        let begun = Instant::now();
        let run = |prepared: &Prepared<'_>, settings: &Settings, chosen: &ResolventAnswer| {
            let setup_seconds = begun.elapsed().as_secs_f64();
            let found = self.run_replicates(goals, prepared, (settings, chosen), setup_seconds)?;
            *divided.lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
            Ok(())
        };
        let question = ResolventQuestion {
            goals,
            settings: if is_divided { &of_one } else { &self.settings },
            is_prediction,
            run: is_divided.then_some(&run),
            watch: &Walking {
                watch: self.watch,
                begun: Once::new(),
            },
        };
        let found = self.model.by_resolvent(&question);
        if let Some(found) = divided.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Ok(ByResolvent::Divided(found));
        }
        match found {
            Ok(found) => Ok(ByResolvent::Answered(Box::new(found))),
            Err(refused @ (Error::Regular { .. } | Error::NoSetting)) if is_meant => {
                Ok(ByResolvent::Refused(refused))
            }
            Err(error) => Err(error.into()),
        }
    }
}
