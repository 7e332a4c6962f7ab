//! The last step of a walk, to the light.

use fredholm_core::Real;

use crate::{Arcs, CircleError, Emission, Point};

/// An arc that is a light: one of the equal arcs of an emission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcLight {
    arc: usize,
    emission: f64,
    /// Cosine and sine of half the angle of its middle.
    middle: [f64; 2],
}

impl ArcLight {
    /// The light of an arc of these, counted from 0. `None`: there is no such arc.
    #[must_use]
    pub fn new(arcs: &[f64], arc: usize) -> Option<Self> {
        let emission = *arcs.get(arc)?;
        let half = core::f64::consts::PI * (arc as f64 + 0.5) / arcs.len() as f64;
        Some(Self {
            arc,
            emission,
            middle: [Real::cos(half), Real::sin(half)],
        })
    }

    /// The number of the arc.
    #[must_use]
    pub const fn arc(&self) -> usize {
        self.arc
    }

    /// F_s on it.
    #[must_use]
    pub const fn emission(&self) -> f64 {
        self.emission
    }
}

/// The source of the equation of w = u − F_s, where F_s is the emission of some arcs: T_K F_s + F − F_s. A small light is met by
/// few walks, and a last step to it is made in every state that scores: see [`LastStep`](fredholm_core::LastStep).
///
/// On the circle nothing has to be drawn for it. With A = π/2m for m arcs and a_l the middle of light l,
///
/// ```text
/// (T_K F_s)(s) = ρ(s) Σ_l F_l sin A |sin((a_l − s)/2)|,    1 − cos A cos((a_l − s)/2) in place of the product in l itself.
/// ```
///
/// ```
/// use fredholm_circle::{ArcLight, Arcs, Circle, DirectLight, Tables};
/// use fredholm_core::Source;
///
/// let values = [2.0, 0.0, 0.0, 0.0];
/// let tables = Tables::<f64>::new(&[0.5], 4)?;
/// let lights: Vec<ArcLight> = ArcLight::new(&values, 0).into_iter().collect();
/// let direct = DirectLight::new(Arcs::new(&values, 4)?, &lights);
/// let circle = Circle::new(tables.cells(), direct, 0.5)?;
/// // From the point opposite the middle of a quarter: ½ · 2 · sin(π/8).
/// let opposite = circle.point(1.25 * core::f64::consts::PI);
/// assert!((circle.source(&opposite) - (core::f64::consts::PI / 8.0).sin()).abs() < 1e-15);
/// # Ok::<(), fredholm_circle::CircleError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DirectLight<'a> {
    arcs: Arcs<'a>,
    lights: &'a [ArcLight],
    /// sin A, cos A and 1 − cos A.
    quarter: [f64; 3],
}

impl<'a> DirectLight<'a> {
    /// The source for lights among these arcs.
    #[must_use]
    pub fn new(arcs: Arcs<'a>, lights: &'a [ArcLight]) -> Self {
        let quarter = 0.5 * core::f64::consts::PI / arcs.values().len() as f64;
        let half_sine = Real::sin(0.5 * quarter);
        Self {
            arcs,
            lights,
            quarter: [
                Real::sin(quarter),
                Real::cos(quarter),
                2.0 * half_sine * half_sine,
            ],
        }
    }

    /// Σ_l F_l times the form factor from a point, by half its angle, to light l; and F − F_s there.
    fn seen(&self, [cos, sin]: [f64; 2], arc: usize) -> [f64; 2] {
        let [scale, cosine_of_quarter, versine] = self.quarter;
        let (mut sum, mut rest) = (
            0.0,
            self.arcs.values().get(arc).copied().unwrap_or(f64::NAN),
        );
        for light in self.lights {
            let [a, b] = light.middle;
            let sine = (b * cos - a * sin).abs();
            let factor = if light.arc == arc {
                rest = 0.0;
                let square = sine * sine;
                let cosine = Real::sqrt(f64::max(1.0 - square, 0.0));
                versine + cosine_of_quarter * (square / (1.0 + cosine))
            } else {
                scale * sine
            };
            sum += light.emission * factor;
        }
        [sum, rest]
    }
}

impl<F: Real> Emission<F> for DirectLight<'_> {
    #[inline]
    fn emission(&self, x: &Point<F>, reflectance: F) -> F {
        let (cos, sin) = x.half_angle();
        let arc = self.arcs.arc(x.cell());
        let [direct, rest] = self.seen([cos.to_f64(), sin.to_f64()], arc);
        F::from_f64(rest) + reflectance * F::from_f64(direct)
    }

    /// The value in the middle of the cell.
    fn cell_mean(&self, i: usize, cells: usize, reflectance: f64) -> f64 {
        let half = core::f64::consts::PI * (i as f64 + 0.5) / cells as f64;
        let [direct, rest] = self.seen([Real::cos(half), Real::sin(half)], self.arcs.arc(i));
        rest + reflectance * direct
    }

    fn validate(&self, cells: usize) -> Result<(), CircleError> {
        Emission::<F>::validate(&self.arcs, cells)
    }
}
