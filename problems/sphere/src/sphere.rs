//! The equation, its chain and its cells.

use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Basis, Partition, TransitionMoments};
use fredholm_core::whole::Starts;
use fredholm_core::{
    Functional, Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

use crate::{Mean, SphereError};

/// A point of the sphere: a unit vector up to rounding.
pub type Point<F> = [F; 3];

/// The point of this colatitude, from the north pole, and this azimuth, from the axis x₁.
///
/// ```
/// let equator = fredholm_sphere::point(core::f64::consts::FRAC_PI_2, 0.0);
/// assert!((equator[0] - 1.0).abs() < 1e-15 && equator[2].abs() < 1e-15);
/// ```
#[must_use]
pub fn point<F: Real>(colatitude: F, azimuth: F) -> Point<F> {
    let radius = colatitude.sin();
    [
        radius * azimuth.cos(),
        radius * azimuth.sin(),
        colatitude.cos(),
    ]
}

/// The parameters of an equation and its chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// a, in (0, 1).
    pub albedo: f64,
    /// g, in [0, ½); 0 scatters evenly.
    pub asymmetry: f64,
    /// e: F(x) = e₀ + e₁x₁ + e₂x₂ + e₃x₃.
    pub emission: [f64; 4],
    /// q, in (0, 1).
    pub absorption: f64,
    /// b, in [0, ½]: how much rather the chain jumps forward.
    pub forward: f64,
}

/// The equation, its chain and its cells.
#[derive(Clone, Copy, Debug)]
pub struct Sphere<F> {
    bands: u32,
    sectors: u32,
    /// 2π/sectors.
    sector: F,
    /// The mean of cos over a sector that lies symmetrically to 0.
    sector_mean: F,
    #[cfg_attr(
        not(feature = "alloc"),
        expect(dead_code, reason = "set-ups ask for it")
    )]
    albedo: F,
    asymmetry: F,
    /// 4πK times the power of the distance.
    strength: F,
    emission: [F; 4],
    absorption: F,
    forward: F,
}

impl Parameters {
    /// u(x), the solution.
    #[must_use]
    pub fn solution(&self, x: &Point<f64>) -> f64 {
        let [e0, e1, e2, e3] = self.emission;
        e0 / (1.0 - self.albedo) + dot(&[e1, e2, e3], x) / (1.0 - self.albedo * self.asymmetry)
    }

    /// The mean of the solution over the sphere.
    #[must_use]
    pub fn mean(&self) -> f64 {
        let [e0, ..] = self.emission;
        e0 / (1.0 - self.albedo)
    }
}

impl<F: Real> Sphere<F> {
    /// The sphere with `bands` times `sectors` cells.
    ///
    /// # Errors
    /// [`SphereError`].
    pub fn new(bands: u32, sectors: u32, parameters: &Parameters) -> Result<Self, SphereError> {
        if !(1..=1 << 24).contains(&(u64::from(bands) * u64::from(sectors))) {
            return Err(SphereError::Cells);
        }
        let (zero, one, half) = (F::zero(), F::one(), F::from_f64(0.5));
        let a = F::from_f64(parameters.albedo);
        if !(a > zero && a < one) {
            return Err(SphereError::Albedo);
        }
        let g = F::from_f64(parameters.asymmetry);
        if !(g >= zero && g < half) {
            return Err(SphereError::Asymmetry);
        }
        let emission = parameters.emission.each(F::from_f64);
        if !emission.iter().all(|e| e.is_finite()) {
            return Err(SphereError::Emission);
        }
        let q = F::from_f64(parameters.absorption);
        if !(q > zero && q < one) {
            return Err(SphereError::Absorption);
        }
        let b = F::from_f64(parameters.forward);
        if !(b >= zero && b <= half) {
            return Err(SphereError::Forward);
        }
        let half_sector = F::PI / F::from_u32(sectors);
        Ok(Self {
            bands,
            sectors,
            sector: half_sector + half_sector,
            sector_mean: half_sector.sin() / half_sector,
            albedo: a,
            asymmetry: g,
            strength: a * (one - g) * (one + g),
            emission,
            absorption: q,
            forward: b,
        })
    }

    /// The number of bands.
    #[must_use]
    pub const fn bands(&self) -> u32 {
        self.bands
    }

    /// The number of sectors of a band.
    #[must_use]
    pub const fn sectors(&self) -> u32 {
        self.sectors
    }

    pub(crate) fn survival(&self) -> F {
        F::one() - self.absorption
    }

    /// This equation with other cells.
    #[cfg(feature = "alloc")]
    pub(crate) fn with_cells(&self, bands: u32, sectors: u32) -> Self {
        let half_sector = F::PI / F::from_u32(sectors);
        Self {
            bands,
            sectors,
            sector: half_sector + half_sector,
            sector_mean: half_sector.sin() / half_sector,
            ..*self
        }
    }

    /// a and b.
    #[cfg(feature = "alloc")]
    pub(crate) const fn albedo_and_forward(&self) -> [F; 2] {
        [self.albedo, self.forward]
    }

    /// The mean of F over cell `j`.
    #[cfg(feature = "alloc")]
    pub(crate) fn source_mean(&self, j: usize) -> F {
        self.source(&self.centroid(j))
    }

    /// Band and sector of cell `j`.
    pub(crate) fn band_and_sector(&self, j: usize) -> (u32, u32) {
        let j = j as u32;
        (j / self.sectors, j % self.sectors)
    }

    /// 4πK(x, y) of x·y.
    pub(crate) fn phase(&self, cosine: F) -> F {
        let g = self.asymmetry;
        let square = F::one() + g * g - (g + g) * cosine;
        self.strength / (square * square.sqrt())
    }

    /// The mean height over a band: that of its middle.
    pub(crate) fn mean_height(&self, band: u32) -> F {
        let bands = F::from_u32(self.bands);
        (bands - F::from_u32(2 * band + 1)) / bands
    }

    /// The mean over a band of the distance from the axis, √(1 − z²).
    ///
    /// The meridian's arc is a chord and a segment of a circle: nothing cancels.
    fn mean_radius(&self, band: u32) -> F {
        let two = F::from_f64(2.0);
        let bands = F::from_u32(self.bands);
        let edge = |i: u32| {
            let (above, below) = (F::from_u32(i), F::from_u32(self.bands - i));
            two * (above * below).sqrt() / bands
        };
        let (height, radii) = (two / bands, edge(band) + edge(band + 1));
        // The difference of radii over that of heights; 0 for the only band of all.
        let slope = if self.bands == 1 {
            F::zero()
        } else {
            two * self.mean_height(band) / radii
        };
        let half_chord = height / two * (F::one() + slope * slope).sqrt();
        let half_angle =
            half_chord.atan2((F::one() - half_chord * half_chord).max(F::zero()).sqrt());
        radii / two + minus_sine(two * half_angle) / (two * height)
    }

    /// Sine and cosine of the middle of a sector.
    fn middle_azimuth(&self, sector: u32) -> (F, F) {
        let angle = (F::from_u32(sector) + F::from_f64(0.5)) * self.sector - F::PI;
        (angle.sin(), angle.cos())
    }

    /// (∫_Xj y dσ)/σ(X_j).
    fn centroid(&self, j: usize) -> Point<F> {
        let (band, sector) = self.band_and_sector(j);
        let radius = self.mean_radius(band) * self.sector_mean;
        let (sin, cos) = self.middle_azimuth(sector);
        [radius * cos, radius * sin, self.mean_height(band)]
    }
}

pub(crate) fn dot<F: Real>(x: &Point<F>, y: &Point<F>) -> F {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

/// x − sin x for x ≥ 0: by its series where the difference would cancel.
fn minus_sine<F: Real>(x: F) -> F {
    if x > F::from_f64(1.5) {
        return x - x.sin();
    }
    let mut sum = F::one();
    for k in (1..=9).rev() {
        sum = F::one() - x * x / F::from_u32((2 * k + 2) * (2 * k + 3)) * sum;
    }
    x * x * x / F::from_f64(6.0) * sum
}

impl<F: Real> StateSpace for Sphere<F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Sampler for Sphere<F> {
    fn absorption(&self, _: &Point<F>) -> F {
        self.absorption
    }

    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        let (one, two) = (F::one(), F::from_f64(2.0));
        let b = self.forward;
        // x·y has the density (1 + b c)/2 on [−1, 1]; the root is written for b = 0, too.
        let four = two * two * uniforms.uniform();
        let root = ((one - b) * (one - b) + b * four).sqrt();
        let cosine = (four - two + b) / (one + root);
        let sine = ((one - cosine) * (one + cosine)).max(F::zero()).sqrt();
        let angle = two * F::PI * uniforms.uniform();
        let (along, across) = (sine * angle.cos(), sine * angle.sin());
        // A frame of x (Duff et al. 2017).
        let sign = one.copysign(x[2]);
        let s = -one / (sign + x[2]);
        let t = x[0] * x[1] * s;
        let e1 = [one + sign * x[0] * x[0] * s, sign * t, -sign * x[0]];
        let e2 = [t, sign + x[1] * x[1] * s, -x[1]];
        let y: Point<F> = from_fn(|d| cosine * x[d] + along * e1[d] + across * e2[d]);
        // Or rounding would add up along a walk.
        let norm = dot(&y, &y).sqrt();
        Some(y.each(|y| y / norm))
    }
}

impl<F: Real> TransitionDensity for Sphere<F> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.survival() * (F::one() + self.forward * dot(x, y)) / (F::from_f64(4.0) * F::PI)
    }
}

/// Starts evenly on the sphere: p is symmetric and q constant.
impl<F: Real> Starts for Sphere<F> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        Functional::<Self>::start(&Mean, uniforms).0
    }

    #[inline]
    fn start_density(&self, _: &Point<F>) -> f64 {
        0.25 * core::f64::consts::FRAC_1_PI
    }

    fn survival(&self) -> Option<f64> {
        Some(Self::survival(self).to_f64())
    }
}

impl<F: Real> Kernel for Sphere<F> {
    fn kernel(&self, x: &Point<F>, y: &Point<F>) -> F {
        let cosine = dot(x, y);
        self.phase(cosine) / (self.survival() * (F::one() + self.forward * cosine))
    }
}

impl<F: Real> Source for Sphere<F> {
    fn source(&self, x: &Point<F>) -> F {
        let [e0, e1, e2, e3] = self.emission;
        e0 + dot(&[e1, e2, e3], x)
    }
}

impl<F: Real> Partition for Sphere<F> {
    fn cells(&self) -> usize {
        (self.bands * self.sectors) as usize
    }

    fn locate(&self, x: &Point<F>) -> usize {
        let depth = (F::one() - x[2]) * F::from_f64(0.5) * F::from_u32(self.bands);
        let band = depth.to_u32().min(self.bands - 1);
        // The azimuth π is also −π; rounding must not lead beyond the last sector.
        let turned = (x[1].atan2(x[0]) + F::PI) / self.sector;
        let sector = turned.to_u32().min(self.sectors - 1);
        (band * self.sectors + sector) as usize
    }
}

impl<F: Real> Basis for Sphere<F> {
    fn basis(&self, _: &Located<Point<F>>) -> [F; 1] {
        [F::one()]
    }
}

impl<F: Real> TransitionMoments for Sphere<F> {
    fn moments(&self, x: &Located<Point<F>>, j: usize) -> [[F; 1]; 1] {
        let preference = F::one() + self.forward * dot(&x.point, &self.centroid(j));
        [[self.survival() * preference / F::from_u32(self.bands * self.sectors)]]
    }
}
