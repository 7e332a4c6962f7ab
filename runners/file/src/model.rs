//! From what a file says to a model, its targets and its settings; and from an error to its place.

use core::fmt::{self, Debug};

use fredholm::heat::tolerance_of;
use fredholm::room::RoomModel;
use fredholm::scene::SceneModel;
use fredholm::{
    Ask, Error, GlobalQuantity, Goal, Model, Region, Settings, Subject, Target, Tolerance,
};

use crate::{InputError, Place, Placed, ProblemFile, What, kinds};

/// The content of a problem file: a model, its targets and the settings.
#[derive(Debug)]
pub struct Resolved {
    /// The equation.
    pub model: Resolution,
    /// The targets.
    pub targets: Vec<Target>,
    /// How it is solved.
    pub settings: Settings,
}

/// The model of a file.
pub enum Resolution {
    /// Light or heat in a room, of which there are pictures too.
    Room(Box<RoomModel>),
    /// Light or heat in space, of which a camera takes pictures.
    Scene(Box<SceneModel>),
    /// Any other model.
    Other(Box<dyn Model>),
}

impl Resolution {
    /// The model, of whichever kind.
    #[must_use]
    pub fn model(&self) -> &dyn Model {
        match self {
            Self::Room(model) => &**model,
            Self::Scene(model) => &**model,
            Self::Other(model) => &**model,
        }
    }

    /// The model alone.
    pub(crate) fn into_model(self) -> Box<dyn Model> {
        match self {
            Self::Room(model) => model,
            Self::Scene(model) => model,
            Self::Other(model) => model,
        }
    }
}

impl Debug for Resolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Resolution")
            .field(&self.model().about())
            .finish()
    }
}

impl ProblemFile {
    /// The model, the targets and the settings of the file, which validation has passed.
    ///
    /// # Errors
    /// What the model does not take, at its place.
    pub fn resolve(&self) -> Result<Resolved, InputError> {
        let (model, targets) = self.problem.resolve(self)?;
        self.check_asked(model.model(), &targets)?;
        let mut settings = self.settings().for_model(model.model());
        settings.uncertainties = self.uncertainties(model.model())?;
        settings.tolerance = self.tolerance(settings.tolerance)?;
        let (cut, pairs) = (settings.discretisation(), settings.walk_options().pairs);
        let checked = model.model().check(&cut, pairs);
        checked.map_err(|error| self.explain(&error))?;
        Ok(Resolved {
            model,
            targets,
            settings,
        })
    }

    /// The tolerance of walks of which this error is asked for: that of temperatures is in kelvin.
    pub(crate) fn tolerance(
        &self,
        asked: Option<Tolerance>,
    ) -> Result<Option<Tolerance>, InputError> {
        let goal = |target: &crate::Target| {
            let quantity = target
                .ask
                .as_ref()
                .map_or(GlobalQuantity::U, |ask| ask.value);
            Goal::new(&target.name.value, quantity.of(Region::Whole))
        };
        let goals: Vec<Goal> = self.targets.iter().map(goal).collect();
        tolerance_of(asked, &goals).map_err(|error| self.explain(&error))
    }

    /// The model and the targets, for walks that were run already with these settings, whatever the file says of them.
    ///
    /// # Errors
    /// What the model does not take, at its place.
    pub fn resolve_for(&mut self, settings: Settings) -> Result<Resolved, InputError> {
        self.walk.scalar = Placed::default(settings.scalar);
        let (model, targets) = self.problem.resolve(self)?;
        Ok(Resolved {
            model,
            targets,
            settings,
        })
    }

    /// What is solved and asked for, in full, each with a name: whatever results follow from besides the settings. Two files
    /// have the same if they say the same.
    ///
    /// # Errors
    /// A file that this one names cannot be read.
    pub fn identity(&self, resolved: &Resolved) -> Result<Vec<(String, String)>, InputError> {
        let targets = format!("{:?}", resolved.targets);
        let model = resolved.model.model();
        let weights: Vec<&str> = (0..).map_while(|number| model.weight(number)).collect();
        let all = [
            ("kind", model.about().kind.to_owned()),
            ("problem", self.problem.identity(self)?),
            ("targets", targets),
            ("weights", format!("{weights:?}")),
        ];
        let all = all.into_iter();
        Ok(all.map(|(name, value)| (name.to_owned(), value)).collect())
    }

    /// What the file, and flags in its place, say of the solution.
    pub(crate) fn settings(&self) -> Settings {
        /// What nobody gave is open.
        fn given<T: Copy>(placed: &Placed<T>) -> Option<T> {
            (placed.place != Place::Default).then_some(placed.value)
        }
        let (galerkin, walk) = (&self.galerkin, &self.walk);
        let value = |placed: &Option<Placed<usize>>| placed.as_ref().map(|placed| placed.value);
        Settings {
            method: walk.method.as_ref().map(|method| method.value),
            cells: value(&galerkin.cells),
            degree: given(&galerkin.degree),
            pairs: given(&galerkin.pairs),
            lift: value(&galerkin.lift),
            score_degree: None,
            global: walk.global.as_ref().map(|global| global.value),
            points: value(&galerkin.points),
            grading: galerkin.grading.as_ref().map(|grading| grading.value),
            shadow_cuts: galerkin.shadow_cuts.as_ref().map(|cuts| cuts.value),
            walks: given(&walk.walks),
            absorption: walk.absorption.as_ref().map(|absorption| absorption.value),
            estimator: given(&walk.estimator),
            form: given(&walk.form),
            sequence: given(&walk.sequence),
            forced_steps: given(&walk.forced_steps),
            last_step: walk.last_step.as_ref().map(|last| last.value),
            adjoint: walk.adjoint.as_ref().map(|adjoint| adjoint.value),
            scalar: walk.scalar.value,
            seed: walk.seed.value,
            batch: given(&walk.batch),
            tolerance: walk.target_error.as_ref().map(|error| {
                if walk.relative.value {
                    Tolerance::Relative(error.value)
                } else {
                    Tolerance::Absolute(error.value)
                }
            }),
            time_limit: None,
            allow_infinite_variance: walk.allow_infinite_variance,
            sensitivities: self.asks_sensitivities(),
            uncertainties: Vec::new(),
        }
    }

    /// An error of the solution, at its place in the file if it has one.
    #[must_use]
    pub fn explain(&self, error: &Error) -> InputError {
        if let Some(error) = self.problem.explain(self, error) {
            return error;
        }
        /// An error about a value that may be absent.
        fn at<T: Debug>(
            file: &ProblemFile,
            placed: &Option<Placed<T>>,
            error: &Error,
        ) -> Option<InputError> {
            Some(file.refuse(placed.as_ref()?, error))
        }
        let (galerkin, walk) = (&self.galerkin, &self.walk);
        let placed = error.subject().and_then(|subject| match subject {
            Subject::Cells => at(self, &galerkin.cells, error),
            Subject::Degree => Some(self.refuse(&galerkin.degree, error)),
            Subject::Pairs => Some(self.refuse(&galerkin.pairs, error)),
            Subject::Absorption => at(self, &walk.absorption, error),
            Subject::Lift => at(self, &galerkin.lift, error),
            Subject::Sequence => Some(self.refuse(&walk.sequence, error)),
            Subject::LastStep => at(self, &walk.last_step, error),
            Subject::Adjoint => at(self, &walk.adjoint, error),
            Subject::Sensitivities => Some(self.refuse(&walk.sensitivities, error)),
            Subject::Tolerance => at(self, &walk.target_error, error),
            subject => match (self.problem.place(subject), subject) {
                (Some(place), _) => Some(self.error(&place, error)),
                (None, Subject::Vertex(_) | Subject::Problem) => {
                    Some(self.error(&Place::Default, error))
                }
                (None, _) => None,
            },
        });
        placed.unwrap_or_else(|| InputError::new(error))
    }

    /// All targets, by what each asks: a list of points asks many things, which are numbered.
    ///
    /// # Errors
    /// What `ask` says.
    pub(crate) fn ask(
        &self,
        mut ask: impl FnMut(&crate::Target) -> Result<Vec<Ask>, InputError>,
    ) -> Result<Vec<Target>, InputError> {
        let mut targets = Vec::new();
        for target in &self.targets {
            let name = &target.name.value;
            let all = ask(target)?;
            // The points of `Ask::Grid` are named by the model.
            let has_points = all.iter().all(|ask| matches!(ask, Ask::One(_)));
            let all = all.into_iter().map(|own| match &target.ask {
                Some(asked) if asked.value != GlobalQuantity::U => {
                    Ask::Of(asked.value, Box::new(own))
                }
                _ => own,
            });
            let is_list = match target.what {
                What::Listed(_) | What::Lattice(_) => true,
                What::Grid(..) => has_points,
                _ => false,
            };
            targets.extend(all.enumerate().map(|(i, ask)| Target {
                name: if is_list {
                    format!("{name}[{i}]")
                } else {
                    name.clone()
                },
                ask,
            }));
        }
        Ok(targets)
    }

    /// Checks that there is what targets ask for in place of u.
    fn check_asked(&self, model: &dyn Model, targets: &[Target]) -> Result<(), InputError> {
        for own in &self.targets {
            let Some(ask) = own
                .ask
                .as_ref()
                .filter(|ask| ask.value != GlobalQuantity::U)
            else {
                continue;
            };
            if !self.problem.has_walls() && self.problem.of::<kinds::Scene>().is_none() {
                let message = "`ask` belongs to rooms and scenes: elsewhere a target asks for u";
                return Err(self.refuse(ask, message));
            }
            let name = &own.name.value;
            let is_own = |target: &&Target| {
                let rest = target.name.strip_prefix(name.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
            };
            let targets: Vec<Target> = targets.iter().filter(is_own).cloned().collect();
            let goals = fredholm::goals(model, &targets);
            let checked = goals.and_then(|goals| model.check_goals(&goals));
            checked.map_err(|error| self.refuse(ask, error))?;
        }
        Ok(())
    }

    /// Checks a point of a target, whose numbers `check` refuses by their index, or altogether.
    pub(crate) fn validate_point(
        &self,
        at: &Placed<Vec<Placed<f64>>>,
        check: impl FnOnce(&[f64]) -> Result<(), (Option<usize>, String)>,
    ) -> Result<(), InputError> {
        let x: Vec<f64> = at.value.iter().map(|x| x.value).collect();
        check(&x).map_err(|(index, message)| {
            let x = index.and_then(|index| at.value.get(index));
            self.error(x.map_or(&at.place, |x| &x.place), message)
        })
    }
}

/// A number of points, over the space or along the part of this number.
pub(crate) fn grid(points: &Placed<usize>, part: Option<usize>) -> Vec<Ask> {
    vec![Ask::Grid {
        points: points.value,
        part,
    }]
}

/// What validation has refused: it asks for nothing.
pub(crate) const NOTHING: Vec<Ask> = Vec::new();
