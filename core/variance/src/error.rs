//! Why there is no prediction.

use core::fmt;

use fredholm_core::galerkin::GalerkinError;

/// Why there is no prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum VarianceError {
    /// The quadrature has no sites.
    Empty,
    /// A coefficient that involves this site is infinite or NaN.
    NotFinite {
        /// The number of the site.
        site: usize,
    },
    /// No memory, or an iteration that diverges: the mean of the walks does not exist.
    Galerkin(GalerkinError),
    /// The model has no start of this number.
    NoStart {
        /// The number that was asked for.
        start: usize,
    },
}

impl fmt::Display for VarianceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(
                f,
                "a quadrature without sites predicts nothing; it needs at least one"
            ),
            Self::NotFinite { site } => write!(
                f,
                "kernel, source or neighbour equation is not finite at a node of site {site} or in a step from it"
            ),
            Self::Galerkin(error) => error.fmt(f),
            Self::NoStart { start } => write!(
                f,
                "there is no start of number {start}: starts are those that the model was made with, from 0"
            ),
        }
    }
}

impl core::error::Error for VarianceError {}

impl From<GalerkinError> for VarianceError {
    fn from(error: GalerkinError) -> Self {
        Self::Galerkin(error)
    }
}
