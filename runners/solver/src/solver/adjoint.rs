//! The way back: walks from the sources.

use super::Solver;
use crate::systems::Systems;
use crate::{Error, Goal, Model, Settings, Subject};

/// The model of the direction that settings ask for: that of the way back of these goals; `None`: the model itself.
///
/// # Errors
/// [`Error::Option`]: there is no way back, and why.
pub fn asked_way_back<'a>(
    model: &'a dyn Model,
    settings: &Settings,
    goals: &[Goal],
) -> Result<Option<Box<dyn Model + 'a>>, Error> {
    let is_asked = settings.adjoint == Some(true) && !model.about().is_adjoint;
    is_asked.then(|| model.adjoint(goals)).transpose()
}

/// The direction of walks.
impl Solver<'_> {
    /// Sets whether walks go from the sources to the receivers: one set of walks for all that is asked for. In scenes they start where light does,
    /// for means; elsewhere they are those of the global estimate. What
    /// nothing is said of is chosen with a target error, and otherwise walks go from the receivers.
    ///
    /// ```
    /// use fredholm::scene::{Enclosure, Material, NamedSurface, shapes};
    /// use fredholm::{Scalar, SceneModel, Solver};
    ///
    /// let names = ["floor", "ceiling", "front", "back", "left", "right"];
    /// let room = shapes::room([0.0; 3], [1.0; 3]).surfaces.into_iter().zip(names);
    /// let surfaces = room.map(|(polygons, name)| NamedSurface {
    ///     name: name.to_owned(),
    ///     polygons,
    ///     material: Material { reflectance: 0.5, emission: f64::from(u8::from(name == "ceiling")) },
    /// });
    /// let cube = SceneModel::new(surfaces.collect(), Enclosure::Closed, Scalar::F64)?;
    /// let solver = names.iter().fold(Solver::new(&cube), |solver, name| solver.over(*name));
    /// let report = solver.cells(24).walks(20_000).adjoint(true).solve()?;
    /// // 1 = ½ · the sum of all means of u, as all light that is emitted is absorbed.
    /// let sum: f64 = report.goals.iter().filter_map(|goal| goal.preconditioned.estimate).sum();
    /// assert!((sum - 2.0).abs() < 0.02);
    /// assert_eq!(report.walks(), 20_000);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn adjoint(mut self, from_the_sources: bool) -> Self {
        self.settings.adjoint = Some(from_the_sources);
        self
    }

    /// The solver whose global estimate is the way back, if that is asked for and is one.
    pub(crate) fn by_global(&self) -> Option<Self> {
        let settings = self.settings.clone().for_model(self.model);
        (settings != self.settings).then(|| Self {
            settings,
            ..self.clone()
        })
    }

    /// The model of the way back, if the choice may take it.
    pub(crate) fn way_back(&self, goals: &[Goal]) -> Option<Box<dyn Model + '_>> {
        let settings = &self.settings;
        let is_chosen = settings.tolerance.is_some() && self.systems.0.is_none();
        let is_open = settings.adjoint.is_none() && settings.global.is_none();
        // The derivatives are those of walks from the receivers.
        let is_open = is_open && !settings.sensitivities;
        // Every process of a team must take the same way.
        let is_alone = self.execute.takes_whole();
        let may = is_chosen && is_open && is_alone && !self.model.about().is_adjoint;
        may.then(|| self.model.adjoint(goals).ok()).flatten()
    }

    /// The solver of the same question to another model of the same equation.
    pub(crate) fn of_model<'a>(&'a self, model: &'a dyn Model) -> Solver<'a> {
        Solver {
            model,
            systems: Systems(None),
            ..self.clone()
        }
    }

    /// Refuses the way back where nothing follows it.
    pub(crate) fn check_direction(&self) -> Result<(), Error> {
        if self.settings.adjoint != Some(true) {
            return Ok(());
        }
        Err(Error::Option {
            subject: Subject::Adjoint,
            message: "walks from the sources answer targets, and neither tell a global estimate nor are swept or predicted: \
                      leave `adjoint` out"
                .to_owned(),
        })
    }
}
