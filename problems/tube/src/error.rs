//! What constructors refuse.

/// Why there is no such equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TubeError {
    /// There must be one cell, or at least three and 2²⁴ at most.
    Cells,
    /// L/R must be positive and finite.
    Length,
    /// ρ must lie in [0, 1].
    Reflectance,
    /// Emissions must be finite.
    Emission,
}

impl core::fmt::Display for TubeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Cells => {
                "the number of cells must be 1, or from 3 to 2^24: two of them are the ends"
            }
            Self::Length => "the length must be positive and finite",
            Self::Reflectance => "the reflectance must lie from 0 to 1",
            Self::Emission => "the emissions must be finite",
        })
    }
}

impl core::error::Error for TubeError {}
