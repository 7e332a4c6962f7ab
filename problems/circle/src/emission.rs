//! The light sources F.

use core::marker::PhantomData;

use fredholm_core::{Real, Value};

use crate::tables::narrow;
use crate::{CircleError, Point};

/// The emission F of the circle. It may depend on the reflectance, as (57) does.
pub trait Emission<F: Real, V: Value<F> = F> {
    /// F(x), where ρ(x) = `reflectance`.
    fn emission(&self, x: &Point<F>, reflectance: &V) -> V;

    /// Whether it is one of a circle of `cells` cells and so many channels, and finite.
    ///
    /// # Errors
    /// What is wrong otherwise.
    fn validate(&self, cells: usize, channels: usize) -> Result<(), CircleError>;
}

/// The emission (57), for which the solution (58) is known:
///
/// ```text
/// F(s) = C (1 − ρ(s)) + D (1 + ρ(s)/((2ℓ − 1)(2ℓ + 1))) sin ℓs,    u(s) = C + D sin ℓs.
/// ```
///
/// Heinrich 1995. F and u have one unit; sin ℓs is an eigenfunction of u ↦ ∫ ¼|sin((t−s)/2)| u(t) dt
/// with eigenvalue −1/(4ℓ² − 1). In several channels the solution is the same, whatever ρ is in each.
///
/// ```
/// use fredholm_circle::Harmonic;
///
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// assert!((light.solution(0.3) - (5.0 + 1.5_f64.sin())).abs() < 1e-15);
/// // The mean over the whole circle is C.
/// assert!((light.mean(0.0, core::f64::consts::TAU) - 5.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// C.
    pub constant: f64,
    /// D.
    pub amplitude: f64,
    /// ℓ ≥ 1.
    pub frequency: u32,
}

impl Harmonic {
    /// The solution (58) at the angle `s`.
    #[must_use]
    pub fn solution(&self, s: f64) -> f64 {
        self.constant + self.amplitude * Real::sin(f64::from(self.frequency) * s)
    }

    /// The mean of the solution over [`from`, `to`].
    #[must_use]
    pub fn mean(&self, from: f64, to: f64) -> f64 {
        let half = f64::from(self.frequency) * 0.5;
        // (cos ℓa − cos ℓb)/(ℓ(b − a)) without cancellation.
        let wave = Real::sin(half * (from + to)) * sinc(half * (to - from));
        self.constant + self.amplitude * wave
    }

    /// 1/((2ℓ − 1)(2ℓ + 1)).
    fn eigenvalue(&self) -> f64 {
        let l = f64::from(self.frequency);
        1.0 / ((2.0 * l - 1.0) * (2.0 * l + 1.0))
    }
}

impl<F: Real, V: Value<F>> Emission<F, V> for Harmonic {
    #[inline]
    fn emission(&self, x: &Point<F>, reflectance: &V) -> V {
        let [constant, amplitude] = [self.constant, self.amplitude].map(F::from_f64);
        let eigenvalue = F::from_f64(self.eigenvalue());
        let wave = x.sine_of_multiple(self.frequency);
        V::from_fn(reflectance.channels(), |c| {
            let reflectance = reflectance.get(c);
            let factor = F::one() + reflectance * eigenvalue;
            constant * (F::one() - reflectance) + amplitude * factor * wave
        })
    }

    fn validate(&self, _: usize, _: usize) -> Result<(), CircleError> {
        if self.constant.is_finite() && self.amplitude.is_finite() && self.frequency > 0 {
            Ok(())
        } else {
            Err(CircleError::Emission)
        }
    }
}

/// sin x/x.
fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { Real::sin(x) / x }
}

/// Piecewise constant emission on equal arcs of [0, 2π): values in f64 of one channel or of several, in a slice, an array or a
/// vector.
///
/// ```
/// use fredholm_circle::{Arcs, CircleError};
///
/// assert!(Arcs::new([1.0, 0.0, 0.0], 300).is_ok());
/// let error = Arcs::new([1.0, 0.0, 0.0], 100).unwrap_err();
/// assert_eq!(error, CircleError::NotAMultiple { cells: 100, arcs: 3 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arcs<A, W = f64> {
    values: A,
    cells_per_arc: usize,
    value: PhantomData<W>,
}

impl<A: AsRef<[W]>, W: Value<f64>> Arcs<A, W> {
    /// `values` on as many equal arcs of a circle with `cells` cells.
    ///
    /// # Errors
    /// [`CircleError::Emission`] for a value that is not finite or none at all,
    /// [`CircleError::NotAMultiple`].
    pub fn new(values: A, cells: usize) -> Result<Self, CircleError> {
        let arcs = values.as_ref().len();
        if arcs == 0 || !values.as_ref().iter().all(W::is_finite) {
            return Err(CircleError::Emission);
        }
        let cells_per_arc = cells / arcs;
        if cells_per_arc == 0 || !cells.is_multiple_of(arcs) {
            return Err(CircleError::NotAMultiple { cells, arcs });
        }
        Ok(Self {
            values,
            cells_per_arc,
            value: PhantomData,
        })
    }

    /// The values, one for each arc.
    #[must_use]
    pub fn values(&self) -> &[W] {
        self.values.as_ref()
    }

    /// The value on the arc of a cell.
    #[inline]
    pub(crate) fn value<F: Real, V: Value<F, Wide = W>>(&self, cell: usize) -> V {
        let arc = cell.checked_div(self.cells_per_arc).unwrap_or(0);
        let value = self.values().get(arc);
        value.map_or_else(|| V::splat(1, F::NAN), narrow)
    }
}

impl<F: Real, V: Value<F>, A: AsRef<[V::Wide]>> Emission<F, V> for Arcs<A, V::Wide> {
    #[inline]
    fn emission(&self, x: &Point<F>, _: &V) -> V {
        self.value(x.cell())
    }

    fn validate(&self, cells: usize, channels: usize) -> Result<(), CircleError> {
        let arcs = self.values().len();
        if self
            .values()
            .iter()
            .any(|value| value.channels() != channels)
        {
            return Err(CircleError::Channels);
        }
        if arcs * self.cells_per_arc != cells {
            return Err(CircleError::NotAMultiple { cells, arcs });
        }
        Ok(())
    }
}
