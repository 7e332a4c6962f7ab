//! Settings of walks that not every equation takes.

use super::Solver;
use fredholm_model::LastSteps;

use crate::{Error, Sequence, Subject};

impl Solver<'_> {
    /// Sets the degree of a lift: walks follow v', the projection of F + T_K v on polynomials of this degree, with h = k and
    /// G = v' − T_K v' exactly. A matrix of a low degree gives a control of a high one. For circles, and equations of one's own that are smooth on cells.
    ///
    /// ```
    /// use fredholm::circle::{Emission, Harmonic};
    /// use fredholm::{CircleModel, Solver};
    ///
    /// let wave = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
    /// let u = CircleModel::new(vec![0.5], Emission::Harmonic(wave));
    /// let solver = Solver::new(&u).mean().cells(32).degree(0).walks(5000);
    /// let (before, after) = (solver.clone().solve()?, solver.lift(4).solve()?);
    /// assert!(after[0].std_error() < 0.1 * before[0].std_error());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn lift(mut self, degree: usize) -> Self {
        self.settings.lift = Some(degree);
        self
    }

    /// Sets the numbers that walks draw. With Sobol' points every batch is one sample, and error bars come from the means of
    /// batches.
    ///
    /// ```
    /// use fredholm::{CubeModel, Method, Sequence, Solver};
    ///
    /// let u = CubeModel::from_fn::<2>(|x, y| 0.5 * (-(x[0] - y[0]).powi(2) - x[1] * y[1]).exp(), |x| 1.0 + x[0]);
    /// let solver = Solver::new(&u).method(Method::Walks).mean().cells(4).degree(2).walks(1 << 15);
    /// let random = solver.clone().solve()?;
    /// let sobol = solver.sequence(Sequence::Sobol).forced_steps(8).solve()?;
    /// assert_eq!(sobol.goals[0].replicates, Some(32));
    /// let errors = [random, sobol].map(|report| report.goals[0].preconditioned.std_error.unwrap());
    /// assert!(errors[1] < errors[0] / 2.0);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn sequence(mut self, sequence: Sequence) -> Self {
        self.settings.sequence = Some(sequence);
        self
    }

    /// Sets the number of first states in which walks are not absorbed; it is 0 otherwise. A walk is as many states longer,
    /// scores in all of them, and its scores depend on its draws without the jumps of absorption.
    pub fn forced_steps(mut self, states: u32) -> Self {
        self.settings.forced_steps = Some(states);
        self
    }

    /// Sets whether the last step of walks leads to the light, in rooms and on circles: they are then for u less the emission of
    /// what is small and bright, and every score has what the light gives directly, in closed form. It is
    /// chosen where nothing is said.
    ///
    /// ```
    /// use fredholm::room::{Material, Surfaces};
    /// use fredholm::{Estimator, RoomModel, Scalar, Solver};
    ///
    /// let [lamp, walls] = [1.0, 0.0].map(|emission| Material { reflectance: 0.5, emission });
    /// let square = Surfaces::default()
    ///     .with("lamp", &[[0.5, 0.0], [0.51, 0.0]], lamp)
    ///     .with("walls", &[[0.51, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [0.5, 0.0]], walls);
    /// let room = RoomModel::new(square, Scalar::F64)?;
    /// let solver = Solver::new(&room).mean().cells(100).estimator(Estimator::Collision).walks(20_000);
    /// let [before, after] = [false, true].map(|last| solver.clone().last_step(last).solve().unwrap());
    /// let errors = |report: &fredholm::Report| report.goals[0].plain.std_error.unwrap();
    /// assert!(errors(&after) < errors(&before) / 10.0);
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    pub fn last_step(mut self, to_the_light: bool) -> Self {
        self.settings.last_step = Some(to_the_light);
        self
    }

    fn check_last_step(&self) -> Result<(), Error> {
        let message = match (self.settings.last_step, self.model.about().last_steps) {
            (Some(true), LastSteps::Never) => {
                "the last step of walks leads to the light in rooms, and on circles whose `emission` is a list of arcs: leave \
                 `last_step` out"
            }
            (Some(false), LastSteps::Always) => {
                "in a scene the last step leads to the light wherever that pays: leave `last_step` out"
            }
            _ => return Ok(()),
        };
        Err(Error::Option {
            subject: Subject::LastStep,
            message: message.to_owned(),
        })
    }

    /// Refuses settings that the equation does not take.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.settings.check()?;
        let (cut, walk) = (self.settings.discretisation(), self.settings.walk_options());
        if walk.sequence != Sequence::Random && !self.model.about().has_sequences {
            return Err(Error::Option {
                subject: Subject::Sequence,
                message: "Sobol' points are for circles and cubes: elsewhere walks draw pseudo-random numbers"
                    .to_owned(),
            });
        }
        self.check_last_step()?;
        // What is the highest may ask for values of the kernel.
        let too_high = |lift: &usize| *lift > self.model.about().most_lift;
        if let Some(lift) = self.settings.lift.filter(too_high) {
            let most = self.model.about().most_lift;
            return Err(Error::Option {
                subject: Subject::Lift,
                message: match most {
                    0 => "a lift is for kernels that are smooth on cells, not for rooms and scenes: leave `lift` out"
                        .to_owned(),
                    most => format!("a lift to degree {lift}: {most} is the highest here"),
                },
            });
        }
        self.model.check(&cut, walk.pairs)
    }
}
