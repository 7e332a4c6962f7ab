//! What constructors refuse.

/// Why there is no such equation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SphereError {
    /// There must be a band and a sector, and 2²⁴ cells at most.
    Cells,
    /// a must lie in (0, 1).
    Albedo,
    /// g must lie in [0, ½).
    Asymmetry,
    /// The emission must be finite.
    Emission,
    /// b must lie in [0, ½].
    Forward,
}

impl core::fmt::Display for SphereError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Cells => {
                "the numbers of bands and sectors must be positive, their product at most 2^24"
            }
            Self::Albedo => "the albedo must lie between 0 and 1",
            Self::Asymmetry => "the asymmetry must be at least 0 and less than 1/2",
            Self::Emission => "the emission must be finite",
            Self::Forward => "the forward preference must lie from 0 to 1/2",
        })
    }
}

impl core::error::Error for SphereError {}
