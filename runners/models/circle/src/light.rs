//! The emission of a circle, in one type.

use fredholm_circle::{ArcLight, Arcs, CircleError, DirectLight, Emission, Harmonic, Point};
use fredholm_core::{Real, SourcePart, best_lights};
use fredholm_model::LastSteps;

use super::Emission as Given;

/// Time of the light of an arc in a last step, over that of a step.
const TIME_OF_LIGHT: f64 = 0.5;

/// The arcs to which last steps lead, and whether they pay: otherwise they are all arcs that emit. The emission (57) is no
/// light of arcs.
pub(super) fn lights(emission: &Given, reflectance: &[f64]) -> (Vec<ArcLight>, LastSteps) {
    let Given::Arcs(values) = emission else {
        return (Vec::new(), LastSteps::Never);
    };
    let mean = reflectance.iter().sum::<f64>() / reflectance.len().max(1) as f64;
    let part = |&source: &f64| SourcePart {
        measure: 1.0,
        source,
        reflectance: mean,
    };
    let best = best_lights(&values.iter().map(part).collect::<Vec<_>>(), TIME_OF_LIGHT);
    let emitting = (0..values.len()).filter(|&arc| values.get(arc).is_some_and(|f| *f != 0.0));
    let pay = !best.is_empty();
    let arcs: Vec<usize> = if pay {
        best.into_iter().map(|arc| arc as usize).collect()
    } else {
        emitting.collect()
    };
    let lights = arcs
        .into_iter()
        .filter_map(|arc| ArcLight::new(values, arc));
    (lights.collect(), LastSteps::Open { pay })
}

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
    /// The source of walks whose last step leads to some arcs.
    Direct(DirectLight<'a>),
}

impl<F: Real> Emission<F> for Light<'_> {
    #[inline]
    fn emission(&self, x: &Point<F>, reflectance: F) -> F {
        match self {
            Self::Harmonic(light) => light.emission(x, reflectance),
            Self::Arcs(light) => light.emission(x, reflectance),
            Self::Direct(light) => light.emission(x, reflectance),
        }
    }

    fn cell_mean(&self, i: usize, cells: usize, reflectance: f64) -> f64 {
        match self {
            Self::Harmonic(light) => Emission::<F>::cell_mean(light, i, cells, reflectance),
            Self::Arcs(light) => Emission::<F>::cell_mean(light, i, cells, reflectance),
            Self::Direct(light) => Emission::<F>::cell_mean(light, i, cells, reflectance),
        }
    }

    fn validate(&self, cells: usize) -> Result<(), CircleError> {
        match self {
            Self::Harmonic(light) => Emission::<F>::validate(light, cells),
            Self::Arcs(light) => Emission::<F>::validate(light, cells),
            Self::Direct(light) => Emission::<F>::validate(light, cells),
        }
    }
}
