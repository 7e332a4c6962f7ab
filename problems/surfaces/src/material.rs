//! What surfaces are made of.

use fredholm_core::{Estimate, Real, Value};
use num_traits::{one, zero};

use crate::Tint;

/// The Stefan–Boltzmann constant in W m⁻² K⁻⁴, exact since the SI of 2019 (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// The reflectance and emission of a surface: u = F + ρ H, where H is the irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// The reflectance ρ ∈ [0, 1]; with 1 everywhere nothing absorbs, and nothing of that is accepted that is closed.
    pub reflectance: f64,
    /// The emission F, in the unit of u.
    pub emission: f64,
}

/// What is wrong with a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialFault {
    /// The reflectance is NaN or outside [0, 1].
    Reflectance,
    /// The emission is infinite or NaN.
    Emission,
}

impl Material {
    /// A black body that emits nothing: for form factors, to which materials are nothing.
    pub const BLACK: Self = Self {
        reflectance: 0.0,
        emission: 0.0,
    };

    /// A grey body of emissivity ε at T kelvin: ρ = 1 − ε, F = ε σ T⁴ in W m⁻².
    ///
    /// ```
    /// let wall = fredholm_surfaces::Material::grey(0.9, 300.0);
    /// assert!((wall.emission - 413.37).abs() < 0.01);
    /// // Above the cold of space it loses what it emits, and gains what it absorbs.
    /// assert_eq!(wall.net_flux(0.0), wall.emission);
    /// ```
    #[must_use]
    pub const fn grey(emissivity: f64, temperature: f64) -> Self {
        let square = temperature * temperature;
        Self {
            reflectance: 1.0 - emissivity,
            // Written so that a temperature below 0 is refused: see `check`.
            emission: if temperature >= 0.0 {
                emissivity * STEFAN_BOLTZMANN * square * square
            } else {
                f64::NAN
            },
        }
    }

    /// A surface from which the net flux q is given, in the unit of u: u = q + H, so ρ = 1 and F = q, whatever its
    /// emissivity. With q = 0 it is adiabatic.
    ///
    /// ```
    /// let heater = fredholm_surfaces::Material::flux(100.0);
    /// assert_eq!(heater.net_flux(250.0), 100.0);
    /// ```
    #[must_use]
    pub const fn flux(net_flux: f64) -> Self {
        Self {
            reflectance: 1.0,
            emission: net_flux,
        }
    }

    /// The net flux out of the surface: F − (1 − ρ)H, which for a grey body is ε(σT⁴ − H). Of a wall in the plane, times a
    /// length: W per metre of depth.
    #[must_use]
    pub const fn net_flux(&self, irradiance: f64) -> f64 {
        self.emission - (1.0 - self.reflectance) * irradiance
    }

    /// The net flux out of the surface, by an estimate of the irradiance.
    #[must_use]
    pub fn net_flux_of(&self, irradiance: Estimate) -> Estimate {
        let net_flux = self.net_flux(irradiance.estimate);
        irradiance.derived(net_flux, |error| (1.0 - self.reflectance) * error)
    }

    /// The irradiance H = (u − F)/ρ, by an estimate of u.
    #[must_use]
    pub fn irradiance_of(&self, u: Estimate) -> Estimate {
        let irradiance = (u.estimate - self.emission) / self.reflectance;
        u.derived(irradiance, |error| error / self.reflectance)
    }

    /// The largest reflectance and the largest emission of some materials: of one surface in several channels.
    #[must_use]
    pub fn largest(all: &[Self]) -> Self {
        let of = |own: fn(&Self) -> f64| all.iter().map(own).fold(0.0, Real::max);
        Self {
            reflectance: of(|own| own.reflectance),
            emission: of(|own| own.emission),
        }
    }

    /// The material in a channel of a face, of which this has the largest numbers.
    #[must_use]
    pub fn in_channel(&self, tint: &impl Tint<f64>, [face, channel]: [usize; 2]) -> Self {
        Self {
            reflectance: self.reflectance * tint.reflectance(face as u32).get(channel),
            emission: self.emission * tint.emission(face as u32).get(channel),
        }
    }

    /// Refuses what is no material in the scalar of walks.
    ///
    /// # Errors
    /// [`MaterialFault`].
    pub fn check<F: Real>(&self) -> Result<(), MaterialFault> {
        let possible = zero::<F>()..=one::<F>();
        if !possible.contains(&F::from_f64(self.reflectance)) {
            Err(MaterialFault::Reflectance)
        } else if F::from_f64(self.emission).is_finite() {
            Ok(())
        } else {
            Err(MaterialFault::Emission)
        }
    }
}
