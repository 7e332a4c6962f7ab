//! How fast the error falls with cells: what the `rates` of a model are made of.

mod rates;

use web_time::Instant;

use fredholm_core::{Statistics, StopReason};

use crate::answer::{SolveObserver, Solved, Walks};
use crate::{Discretisation, Error, Goal, Model, Pairs, Partitioned, Scalar, WalkOptions};
use fredholm_model::{Request, Wanted};

pub use fredholm_model::Deterministic;
pub use rates::{Fits, Rates, Row, exponent, squared};

/// The most plain walks that are timed.
pub const PLAIN_WALKS: u64 = 1 << 18;

/// Walks on one level of cells, for the mean of u.
#[derive(Clone, Debug)]
pub struct Level {
    /// Cells as they are counted in [`Discretisation::cells`].
    pub cells: usize,
    /// Unknowns in all.
    pub unknowns: usize,
    /// The statistics of the walks.
    pub statistics: Statistics,
    /// The mean of u, if it is known.
    pub exact: Option<f64>,
    /// The mean of v.
    pub galerkin: f64,
    /// The error by rounding, which more walks do not lower.
    pub rounding_floor: f64,
    /// Kernel evaluations of the set-up.
    pub evaluations: f64,
    /// Measured seconds, if they are wanted.
    pub clock: Option<Clock>,
}

/// Seconds of a set-up and of walks.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Seconds of the set-up.
    pub setup: f64,
    /// Seconds of a walk that both equations follow.
    pub walk: f64,
    /// Seconds of a plain walk.
    pub plain: f64,
}

/// How levels are measured.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// The equation.
    pub model: &'a dyn Model,
    /// How space is cut, but for the number of cells.
    pub discretisation: Discretisation,
    /// How walks are made, but for their number.
    pub walk: WalkOptions,
    /// The degree of the lift that walks follow, if there is one.
    pub lift: Option<usize>,
    /// The most plain walks that are timed; `None` if the clock is not wanted.
    pub timed: Option<u64>,
}

impl<'a> Sweep<'a> {
    /// Cuts the space into so many cells.
    ///
    /// # Errors
    /// [`Error`].
    pub fn cut(&self, cells: usize) -> Result<Box<dyn Partitioned<'a> + 'a>, Error> {
        self.model.partition(&self.discretisation.on(cells))
    }

    /// Makes so many walks on so many cells. `None`: the watch cancelled them.
    ///
    /// # Errors
    /// [`Error`].
    pub fn level(
        &self,
        cells: usize,
        walks: u64,
        watch: &dyn SolveObserver,
    ) -> Result<Option<Level>, Error> {
        // Of several channels the last one counts, their sum.
        let goals = Goal::new("mean", self.model.whole()).in_channels(self.model);
        let walk = WalkOptions {
            walks,
            tolerance: None,
            time_limit: None,
            ..self.walk
        };
        let request = Request {
            goals: &goals,
            walk: &walk,
            wanted: Wanted::U,
        };
        let maker = Walks {
            model: self.model,
            scalar: self.scalar(),
            execution: None,
        };
        let start = Instant::now();
        let cut = self.cut(cells)?;
        let cutting = start.elapsed().as_secs_f64();
        let exact = goals.last().map(|goal| self.model.exact_of(goal));
        let exact = exact.transpose()?.flatten();
        let solved = Solved::new(&*cut)?.lifted(self.lift)?;
        let answer = solved.walk(&maker, &request, watch)?;
        if answer.outcome.stop == StopReason::Cancelled {
            return Ok(None);
        }
        let (Some(&statistics), Some(&galerkin), Some(&rounding_floor)) = (
            answer.outcome.statistics.last(),
            answer.galerkin.last(),
            answer.floors.last(),
        ) else {
            return Err(Error::Internal("a level has no result"));
        };
        let mut clock = None;
        if let Some(most) = self.timed {
            let walk = WalkOptions {
                walks: walks.min(most),
                ..walk
            };
            let request = Request {
                walk: &walk,
                ..request
            };
            let plain = maker.plain(&*cut, &request, &())?;
            clock = Some(Clock {
                setup: cutting + answer.setup_seconds,
                walk: answer.walk_seconds / statistics.walks() as f64,
                plain: plain.walk_seconds / walk.walks as f64,
            });
        }
        Ok(Some(Level {
            cells: cut.cells(),
            unknowns: cut.unknowns(),
            statistics,
            exact,
            galerkin,
            rounding_floor,
            evaluations: cut.evaluations(answer.convergence.sweeps),
            clock,
        }))
    }

    /// The order of √Var in n. A lift to degree p' is as good as polynomials of degree p', or as F + T_K v, whose error falls twice
    /// as fast as that of v: whichever is the lower order.
    fn order(&self) -> f64 {
        let (cut, pairs) = (self.discretisation, self.walk.pairs);
        let own = self.model.order(&cut, pairs);
        let Some(degree) = self.lift else {
            return own;
        };
        let of_lift = Discretisation { degree, ..cut };
        self.model.order(&of_lift, Pairs::Pointwise).min(2.0 * own)
    }

    const fn scalar(&self) -> Scalar {
        self.discretisation.scalar
    }
}
