//! The way from a report to a number.

use core::ops::Index;

use fredholm_model::numbers::{NORMAL, widening};

use super::{GoalReport, Report};

impl Report {
    /// Returns the report of the goal of this name, if there is one.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&GoalReport> {
        self.goals.iter().find(|goal| goal.name == name)
    }
}

/// The goal of this number, in the order in which goals were asked for.
impl Index<usize> for Report {
    type Output = GoalReport;

    fn index(&self, number: usize) -> &GoalReport {
        &self.goals[number]
    }
}

/// The goal of this name.
///
/// # Panics
/// There is none: [`Report::get`] asks.
impl Index<&str> for Report {
    type Output = GoalReport;

    fn index(&self, name: &str) -> &GoalReport {
        self.get(name)
            .unwrap_or_else(|| panic!("no goal {name:?} was asked for"))
    }
}

impl GoalReport {
    /// Returns the estimate, in the unit of u; NaN if no walk was made.
    ///
    /// ```
    /// use fredholm::{CubeModel, Solver};
    ///
    /// // u(x) = ∫₀¹ ½ x y u(y) dy + x, whose solution is 6x/5.
    /// let u = CubeModel::on_interval([0.0, 1.0], |x, y| 0.5 * x * y, |x| x);
    /// let report = Solver::new(&u).at(0.5).mean().solve_to(1e-6)?;
    /// assert!((report[0].value() - 0.6).abs() < 1e-5);
    /// assert!(report["mean"].std_error() <= 1e-6);
    /// let [low, high] = report["mean"].interval();
    /// assert!(low <= report["mean"].value() && report["mean"].value() <= high);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn value(&self) -> f64 {
        let [control, plain] = [self.preconditioned, self.plain].map(|own| own.estimate);
        control.or(plain).unwrap_or(f64::NAN)
    }

    /// Returns the standard error of the [`value`](Self::value), or the error that rounding leaves where that is larger; infinite if there were
    /// too few walks to know it.
    #[must_use]
    pub fn std_error(&self) -> f64 {
        let own = match self.preconditioned.estimate {
            Some(_) => self.preconditioned.std_error,
            None => self.plain.std_error,
        };
        own.map_or(f64::INFINITY, |own| own.max(self.rounding_floor))
    }

    /// Returns the ends of the interval that contains (u, Φ) in 95 of 100 runs.
    #[must_use]
    pub fn interval(&self) -> [f64; 2] {
        let freedom = self.replicates.map(|count| f64::from(count) - 1.0);
        let half = NORMAL * freedom.map_or(1.0, widening) * self.std_error();
        [self.value() - half, self.value() + half]
    }
}
