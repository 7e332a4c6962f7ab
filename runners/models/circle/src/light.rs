//! The emission of a circle, in one type.

use fredholm_circle::{Arcs, CircleError, Emission, Harmonic, Point};
use fredholm_core::Real;

/// No light.
pub(super) const DARK: Light<'static> = Light::Harmonic(Harmonic {
    constant: 0.0,
    amplitude: 0.0,
    frequency: 1,
});

/// The emission of a circle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Light<'a> {
    /// The emission (57), whose solution is known.
    Harmonic(Harmonic),
    /// Piecewise constant.
    Arcs(Arcs<'a>),
}

impl<F: Real> Emission<F> for Light<'_> {
    #[inline]
    fn emission(&self, x: &Point<F>, reflectance: F) -> F {
        match self {
            Self::Harmonic(light) => light.emission(x, reflectance),
            Self::Arcs(light) => light.emission(x, reflectance),
        }
    }

    fn cell_mean(&self, i: usize, cells: usize, reflectance: f64) -> f64 {
        match self {
            Self::Harmonic(light) => Emission::<F>::cell_mean(light, i, cells, reflectance),
            Self::Arcs(light) => Emission::<F>::cell_mean(light, i, cells, reflectance),
        }
    }

    fn validate(&self, cells: usize) -> Result<(), CircleError> {
        match self {
            Self::Harmonic(light) => Emission::<F>::validate(light, cells),
            Self::Arcs(light) => Emission::<F>::validate(light, cells),
        }
    }
}
