//! Values of pictures.

use fredholm_core::{Batch, Equation, Estimate, Functional, Goal, Goals, NeighbourOf, WideOf};
use fredholm_rayon::{Observer, fill_rows};

use crate::{Error, WalkOptions};

/// A value of a picture and its standard error.
///
/// ```
/// use fredholm_model::{BLANK, Spot};
///
/// let lit = Spot { value: 2.0, error: 0.1 };
/// assert!(lit.value > 1.0 && BLANK.value.is_nan());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// The value; NaN where there is nothing.
    pub value: f64,
    /// The standard error; NaN where it is not known.
    pub error: f64,
}

/// A spot where nothing is.
pub const BLANK: Spot = Spot {
    value: f64::NAN,
    error: f64::NAN,
};

/// What is wanted beside a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beside {
    /// Nothing.
    Nothing,
    /// The picture by plain walks that take as long: their number depends on a clock.
    PlainAsLong,
    /// The picture by so many plain walks for each spot.
    Plain {
        /// The number.
        walks: u64,
    },
}

impl Beside {
    /// The plain walks for each spot beside a picture that took so many seconds; `one` says how many seconds one walk for each takes.
    ///
    /// # Errors
    /// Those of `one`.
    pub fn walks(
        self,
        seconds: f64,
        one: impl FnOnce() -> Result<f64, Error>,
    ) -> Result<Option<u64>, Error> {
        Ok(match self {
            Self::Nothing => None,
            Self::PlainAsLong => Some((seconds / one()?).round().max(1.0) as u64),
            Self::Plain { walks } => Some(walks),
        })
    }
}

impl From<Estimate> for Spot {
    fn from(estimate: Estimate) -> Self {
        Self {
            value: estimate.estimate,
            error: estimate.std_error.unwrap_or(f64::NAN),
        }
    }
}

/// A function that writes all means of a spot by its number.
pub type WriteSpot<'a> = dyn Fn(usize, &mut [Spot]) -> Result<(), Error> + Sync + 'a;

/// Spots whose estimates one thread makes in one go.
const ROW: usize = 64;

/// The last of so many means of all spots, and all others; blank where nothing is written.
///
/// # Errors
/// What `write` says.
pub fn spots(
    count: usize,
    means: usize,
    write: &WriteSpot<'_>,
) -> Result<(Vec<Spot>, Vec<Vec<Spot>>), Error> {
    let mut spots = vec![BLANK; count * means];
    fill_rows(&mut spots, ROW * means, |row, spots| {
        for (i, to) in spots.chunks_mut(means).enumerate() {
            write(row * ROW + i, to)?;
        }
        Ok::<(), Error>(())
    })?;
    let of = |mean: usize| spots.iter().skip(mean).step_by(means).copied().collect();
    // The sum of several channels comes last.
    Ok((of(means - 1), (0..means - 1).map(of).collect()))
}

/// The error of a picture whose walks met the step limit.
#[must_use]
pub fn picture_is_biased() -> Error {
    let why = "a walk met the step limit, so that a picture would be biased: too little is absorbed; leave `absorption` out, or use a \
               larger one";
    Error::Picture(why.to_owned())
}

/// The walks of a picture.
pub struct SpotWalks<'w, E, N: ?Sized> {
    /// The equation of the walks.
    pub equation: &'w E,
    /// The neighbour equation that they follow.
    pub neighbour: &'w N,
    /// How walks are made.
    pub walk: &'w WalkOptions,
    /// The weights of a sum of channels, if it is wanted.
    pub weights: &'w [f64],
    /// Whether walks are plain.
    pub is_plain: bool,
    /// Who may cancel.
    pub watch: &'w dyn Observer,
}

impl<E, N: ?Sized> core::fmt::Debug for SpotWalks<'_, E, N> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SpotWalks")
            .field("is_plain", &self.is_plain)
            .finish_non_exhaustive()
    }
}

impl<E: Equation, N: NeighbourOf<E> + ?Sized> SpotWalks<'_, E, N> {
    /// Writes all means of a spot of this number from a few walks.
    ///
    /// # Errors
    /// [`Error::Picture`], [`Error::Cancelled`].
    pub fn walk<T: Functional<E>>(
        &self,
        goal: &Goal<T, WideOf<E>>,
        number: u64,
        walks: u64,
        to: &mut [Spot],
    ) -> Result<(), Error> {
        if self.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let mut batches = vec![Batch::new(0, walks, walks); to.len()];
        let none: &[Goal<T, WideOf<E>>] = &[];
        Goals::new(self.equation, self.neighbour, none, self.walk.for_core())
            .with_sum(self.weights)
            .run_goal(goal, number, &mut batches, u64::MAX)
            .map_err(|error| Error::Picture(format!("pixel or piece {number}: {error}")))?;
        for (batch, to) in batches.iter().zip(to) {
            let statistics = batch.statistics();
            if statistics.terminations().step_limit > 0 {
                return Err(picture_is_biased());
            }
            *to = match self.is_plain {
                true => statistics.plain().into(),
                false => statistics.preconditioned().into(),
            };
        }
        Ok(())
    }
}
