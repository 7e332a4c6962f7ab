//! Values of pictures.

use fredholm_core::Estimate;

use crate::Error;

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
