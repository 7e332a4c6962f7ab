//! The light sources F.

use fredholm_core::Real;

use crate::{CircleError, Point};

/// The emission F of the circle. It may depend on the reflectance, as (57) does.
pub trait Emission<F> {
    /// F(x), where ρ(x) = `reflectance`.
    fn emission(&self, x: &Point<F>, reflectance: F) -> F;

    /// F'_i: the mean of F over cell `i` of `cells`, on which ρ = `reflectance`; (40), or an
    /// approximation, which costs variance and not correctness.
    fn cell_mean(&self, i: usize, cells: usize, reflectance: f64) -> f64;

    /// Whether F is piecewise constant on cells when the circle has `cells` of them, and finite.
    ///
    /// # Errors
    /// What is wrong otherwise.
    fn validate(&self, cells: usize) -> Result<(), CircleError>;
}

/// The emission (57), for which the solution (58) is known:
///
/// ```text
/// F(s) = C (1 − ρ(s)) + D (1 + ρ(s)/((2ℓ − 1)(2ℓ + 1))) sin ℓs,    u(s) = C + D sin ℓs.
/// ```
///
/// Heinrich 1995. F and u have one unit; sin ℓs is an eigenfunction of u ↦ ∫ ¼|sin((t−s)/2)| u(t) dt
/// with eigenvalue −1/(4ℓ² − 1).
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

impl<F: Real> Emission<F> for Harmonic {
    #[inline]
    fn emission(&self, x: &Point<F>, reflectance: F) -> F {
        let constant = F::from_f64(self.constant) * (F::one() - reflectance);
        let factor = F::one() + reflectance * F::from_f64(self.eigenvalue());
        constant + F::from_f64(self.amplitude) * factor * x.sine_of_multiple(self.frequency)
    }

    fn cell_mean(&self, i: usize, cells: usize, reflectance: f64) -> f64 {
        let n = cells as f64;
        let l = f64::from(self.frequency);
        let middle = core::f64::consts::TAU * ((i as f64 + 0.5) / n);
        let wave = Real::sin(l * middle) * sinc(l * core::f64::consts::PI / n);
        self.constant * (1.0 - reflectance)
            + self.amplitude * (1.0 + reflectance * self.eigenvalue()) * wave
    }

    fn validate(&self, _: usize) -> Result<(), CircleError> {
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

/// Piecewise constant emission on equal arcs of [0, 2π).
///
/// ```
/// use fredholm_circle::{Arcs, CircleError};
///
/// assert!(Arcs::new(&[1.0, 0.0, 0.0], 300).is_ok());
/// let error = Arcs::new(&[1.0, 0.0, 0.0], 100).unwrap_err();
/// assert_eq!(error, CircleError::NotAMultiple { cells: 100, arcs: 3 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arcs<'a> {
    values: &'a [f64],
    cells_per_arc: usize,
}

impl<'a> Arcs<'a> {
    /// `values` on as many equal arcs of a circle with `cells` cells.
    ///
    /// # Errors
    /// [`CircleError::Emission`] for a value that is not finite or none at all,
    /// [`CircleError::NotAMultiple`].
    pub fn new(values: &'a [f64], cells: usize) -> Result<Self, CircleError> {
        let arcs = values.len();
        if arcs == 0 || !values.iter().all(|v| v.is_finite()) {
            return Err(CircleError::Emission);
        }
        let cells_per_arc = cells / arcs;
        if cells_per_arc == 0 || !cells.is_multiple_of(arcs) {
            return Err(CircleError::NotAMultiple { cells, arcs });
        }
        Ok(Self {
            values,
            cells_per_arc,
        })
    }

    /// The values, one for each arc.
    #[must_use]
    pub const fn values(&self) -> &'a [f64] {
        self.values
    }

    /// The arc of a cell.
    pub(crate) fn arc(&self, cell: usize) -> usize {
        cell.checked_div(self.cells_per_arc).unwrap_or(0)
    }

    fn value(&self, cell: usize) -> f64 {
        self.values.get(self.arc(cell)).copied().unwrap_or(f64::NAN)
    }
}

impl<F: Real> Emission<F> for Arcs<'_> {
    #[inline]
    fn emission(&self, x: &Point<F>, _: F) -> F {
        F::from_f64(self.value(x.cell()))
    }

    fn cell_mean(&self, i: usize, _: usize, _: f64) -> f64 {
        self.value(i)
    }

    fn validate(&self, cells: usize) -> Result<(), CircleError> {
        Self::new(self.values, cells).map(|_| ())
    }
}
