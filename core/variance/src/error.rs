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
    /// Pairs of cells cannot be told apart: a site is more than one cell.
    Coarse {
        /// The number of a cell that has no site.
        cell: usize,
    },
    /// The variance is infinite.
    Infinite,
    /// The model has no start of this number.
    NoStart {
        /// The number that was asked for.
        start: usize,
    },
    /// The model has no neighbour equation to take h of pairs in S from.
    NoGalerkin,
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
            Self::Coarse { cell } => write!(
                f,
                "cell {cell} has no site of its own: pairs of cells cannot be told apart; more nodes are needed"
            ),
            Self::Infinite => f.write_str(
                "the variance of the walks is infinite: there is nothing to choose pairs by",
            ),
            Self::NoStart { start } => write!(
                f,
                "there is no start of number {start}: starts are those that the model was made with, from 0"
            ),
            Self::NoGalerkin => f.write_str(
                "a choice of pairs requires a neighbour equation with all pairs in S that may be: give it as `galerkin`",
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
