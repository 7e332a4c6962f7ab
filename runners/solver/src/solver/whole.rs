//! The whole function of a solver's equation.

use super::{SolveError, Solver};
use crate::whole::{Looks, Until, Whole, WholeFunction};

impl<'m> Solver<'m> {
    /// Sets the degree of the polynomials on whose coefficients the walks of a whole function score: above that of v,
    /// by two otherwise.
    pub fn score_degree(mut self, degree: usize) -> Self {
        self.settings.score_degree = Some(degree);
        self
    }

    /// The whole function u with its error band, from one set of walks, for circles, spheres, cubes and rooms. What is asked for otherwise
    /// plays no part. What is open has its default: nothing is chosen. The number of walks is that of all, rounded up to
    /// equally many of each of 64 replicates; a tolerance is for every point.
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
    pub fn whole(&self) -> Result<WholeFunction<'m>, SolveError> {
        self.check()?;
        let whole = Whole {
            model: self.model,
            settings: &self.settings,
            watch: self.watch,
            systems: self.systems,
        };
        let ready = whole.ready()?;
        let until = Until {
            looks: Looks::of_points(self.model),
            walks: self.settings.walk_options().walks,
            price: f64::INFINITY,
        };
        let walked = whole.walk(&ready, &until)?;
        whole.finished(ready, walked)
    }
}
