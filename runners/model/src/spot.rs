//! Values of pictures.

use fredholm_core::Estimate;

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

impl From<Estimate> for Spot {
    fn from(estimate: Estimate) -> Self {
        Self {
            value: estimate.estimate,
            error: estimate.std_error.unwrap_or(f64::NAN),
        }
    }
}
