//! The global estimate of a solver's equation.

use super::{SolveError, Solver};
use fredholm_model::WholeValues;

use crate::choice::{Chosen, choose_global};
use crate::point::Point;
use crate::whole::{GlobalEstimate, GlobalValue, Looks, Until, Whole};
use crate::{Error, Goal, Region};

impl<'m> Solver<'m> {
    /// Sets the degree of the polynomials on whose coefficients the walks of a global estimate score: above that of v,
    /// by two otherwise.
    pub fn score_degree(mut self, degree: usize) -> Self {
        self.settings.score_degree = Some(degree);
        self
    }

    /// Sets the cells of which the report of a global estimate has the mean of u, if the goals are answered by one: of each the
    /// number of the goal in its corner, and those of its neighbours along the axes
    /// ([`GlobalEstimate::means_between`]).
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u = 6x/5.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let solver = Solver::new(&u).grid(3).cells(10).walks(20_000).together(true);
    /// let report = solver.means_between(vec![vec![0, 1], vec![1, 2]]).solve()?;
    /// let (name, means) = &report.columns().of_cells[0];
    /// assert!(*name == "mean" && (means[0] - 0.3).abs() < 1e-3 && (means[1] - 0.9).abs() < 1e-3);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn means_between(mut self, cells: Vec<Vec<usize>>) -> Self {
        self.means = cells;
        self
    }

    /// The global estimate of u with its error band, from one set of walks, for circles, spheres, cubes, rooms and
    /// scenes, of which it has means over cells and surfaces. What is asked for otherwise plays no part. Cells and a degree that are open are chosen
    /// by pilots: for a tolerance, or for the walks that are made without one. The number of walks is that of all, rounded up to equally many of
    /// each of 64 replicates. A tolerance is for every point; if no number of walks is given, they go on until it is reached, unless that is
    /// predicted to take more than an hour.
    ///
    /// If walks end before a tolerance is reached, at a time limit or because somebody cancels, the function is that of the
    /// walks so far, and its summary says so.
    ///
    /// ```
    /// use fredholm::{CubeModel, Model, Solver};
    ///
    /// // u = 6x/5.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let whole = Solver::new(&u).cells(10).walks(20_000).whole()?;
    /// for (x, value) in [(0.1, 0.12), (0.35, 0.42), (0.9, 1.08)] {
    ///     let u = whole.at(x)?;
    ///     assert!((u.estimate - value).abs() <= u.band.unwrap() && u.band.unwrap() < 1e-3);
    /// }
    /// let mean = whole.functional(&u.whole())?;
    /// assert!((mean.estimate - 0.6).abs() < 5.0 * mean.std_error.unwrap());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn whole(&self) -> Result<GlobalEstimate<'m>, SolveError> {
        self.chosen_whole().map(|(estimate, _)| estimate)
    }

    /// The global estimate, and what was chosen for it, if something was.
    pub(super) fn chosen_whole(
        &self,
    ) -> Result<(GlobalEstimate<'m>, Option<Chosen<'m>>), SolveError> {
        if let Some(global) = self.by_global() {
            return global.chosen_whole();
        }
        let run = || {
            self.check()?;
            self.check_direction()?;
            self.check_whole()?;
            if let Some(own) = self.on_kept_cells()? {
                return own.chosen_whole();
            }
            if let Some(estimate) = self.whole_by_resolvent()? {
                return Ok((estimate, None));
            }
            let mut whole = self.global();
            // A system that is kept is that of the settings as they are.
            let found = match self.systems.0 {
                Some(_) => None,
                None => choose_global(self.model, &self.settings, self.watch)?,
            };
            let (chosen, ready) = found.unzip();
            if let Some(chosen) = &chosen {
                self.watch.chosen(&chosen.settings, &chosen.report);
                whole.settings = &chosen.settings;
            }
            let ready = ready.map_or_else(|| whole.ready(), Ok)?;
            let walks = whole.settings.walk_options().walks;
            let until = Until::end(Looks::of_points(self.model), walks);
            let walked = whole.walk(&ready, &until)?;
            let mut estimate = whole.finished(ready, walked)?;
            estimate.set_choice(chosen.as_ref().map(|chosen| chosen.report.clone()));
            Ok((estimate, chosen))
        };
        self.explained(run())
    }

    /// The walks of a global estimate.
    const fn global(&self) -> Whole<'_, 'm> {
        Whole {
            model: self.model,
            settings: &self.settings,
            watch: self.watch,
            systems: self.systems,
        }
    }

    /// Refuses points that are asked for, where the global estimate has none.
    fn check_whole(&self) -> Result<(), Error> {
        let is_of_cells = self.model.about().whole == WholeValues::Means;
        if !is_of_cells || self.asked.is_empty() {
            return Ok(());
        }
        let goals = fredholm_model::goals(self.model, &self.targets()?)?;
        let is_point = |goal: &&Goal| self.model.place(&goal.region).is_some();
        match goals.iter().find(is_point) {
            None => Ok(()),
            Some(Goal { name, .. }) => Err(Error::Region {
                message: format!(
                    "{name:?} is a point, and the global estimate here has means over cells and parts alone: ask for it \
                     without the global estimate"
                ),
            }),
        }
    }

    /// u at some points from one set of walks without any projection, of circles and cubes: walks score K(x, ·) of every point x in
    /// place of polynomials, so that the values are unbiased whatever the cells, where the [`whole`](Self::whole) function
    /// loses what its scores do not see. A state takes a value of the kernel for every point. There is no band; tolerances play no
    /// part.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u = 6x/5, on a single cell.
    /// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
    /// let values = Solver::new(&u).cells(1).walks(20_000).values_at(&[0.25, 0.75])?;
    /// for (value, exact) in values.iter().zip([0.3, 0.9]) {
    ///     assert!((value.estimate - exact).abs() < 5.0 * value.std_error.unwrap());
    /// }
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn values_at<P: Into<Point> + Clone>(
        &self,
        points: &[P],
    ) -> Result<Vec<GlobalValue>, SolveError> {
        let run = || -> Result<Vec<GlobalValue>, SolveError> {
            self.check()?;
            let points = points.iter().cloned().map(Into::into);
            let points = points.map(|Point(at)| Region::Point(at));
            let goals = points.map(|region| Goal::new("u", region));
            let goals: Vec<Goal> = goals.collect();
            self.model.check_goals(&goals)?;
            if goals.is_empty() {
                return Ok(Vec::new());
            }
            let regions: Vec<Region> = goals.into_iter().map(|goal| goal.region).collect();
            Ok(self.global().values_at(&regions)?)
        };
        self.explained(run())
    }
}
