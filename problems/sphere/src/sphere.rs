//! The equation, its chain and its cells.

use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Basis, Cells, TransitionMoments};
use fredholm_core::global::Stationary;
use fredholm_core::{Chain, Density, Equation, Located, Real, Space, Uniforms};

use crate::SphereError;

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
    asymmetry: F,
    /// 4πK times the power of the distance.
    strength: F,
    emission: [F; 4],
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
            asymmetry: g,
            strength: a * (one - g) * (one + g),
            emission,
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

    /// The depth of a point below the north pole in bands, and its azimuth in sectors.
    fn depth_and_turn(&self, x: &Point<F>) -> [F; 2] {
        [
            (F::one() - x[2]) * F::from_f64(0.5) * F::from_u32(self.bands),
            (x[1].atan2(x[0]) + F::PI) / self.sector,
        ]
    }

    /// Band and sector of cell `j`.
    fn band_and_sector(&self, j: usize) -> (u32, u32) {
        let j = j as u32;
        (j / self.sectors, j % self.sectors)
    }

    /// 4πK(x, y) of x·y.
    fn phase(&self, cosine: F) -> F {
        let g = self.asymmetry;
        let square = F::one() + g * g - (g + g) * cosine;
        self.strength / (square * square.sqrt())
    }

    /// The mean height over a band: that of its middle.
    fn mean_height(&self, band: u32) -> F {
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

fn dot<F: Real>(x: &Point<F>, y: &Point<F>) -> F {
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

impl<F: Real> Space for Sphere<F> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real> Chain for Sphere<F> {
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

impl<F: Real> Density for Sphere<F> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        (F::one() + self.forward * dot(x, y)) / (F::from_f64(4.0) * F::PI)
    }
}

/// Starts evenly on the sphere: p is symmetric.
impl<F: Real> Stationary for Sphere<F> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        let (one, two) = (F::one(), F::from_f64(2.0));
        let height = one - two * uniforms.uniform();
        let angle = two * F::PI * uniforms.uniform();
        let radius = ((one - height) * (one + height)).max(F::zero()).sqrt();
        [radius * angle.cos(), radius * angle.sin(), height]
    }

    #[inline]
    fn start_density(&self, _: &Point<F>) -> f64 {
        0.25 * core::f64::consts::FRAC_1_PI
    }

    fn is_preserved(&self) -> bool {
        true
    }
}

impl<F: Real> Equation for Sphere<F> {
    type Value = F;

    fn kernel(&self, x: &Point<F>, y: &Point<F>) -> F {
        let cosine = dot(x, y);
        self.phase(cosine) / (F::one() + self.forward * cosine)
    }

    fn source<U: Uniforms<F>>(&self, x: &Point<F>, _: &mut U) -> F {
        let [e0, e1, e2, e3] = self.emission;
        e0 + dot(&[e1, e2, e3], x)
    }
}

/// Parameters of a cell are the depth in its band, downwards, and the azimuth in its sector.
impl<F: Real> Cells for Sphere<F> {
    const DIMENSION: usize = 2;

    fn cells(&self) -> usize {
        (self.bands * self.sectors) as usize
    }

    fn locate(&self, x: &Point<F>) -> usize {
        let [depth, turned] = self.depth_and_turn(x);
        let band = depth.to_u32().min(self.bands - 1);
        // The azimuth π is also −π; rounding must not lead beyond the last sector.
        let sector = turned.to_u32().min(self.sectors - 1);
        (band * self.sectors + sector) as usize
    }

    fn measure(&self, _: usize) -> f64 {
        4.0 * core::f64::consts::PI / self.cells() as f64
    }

    fn point(&self, cell: usize, t: &[f64]) -> Point<F> {
        let (band, sector) = self.band_and_sector(cell);
        let [depth, turn] = [0, 1].map(|k| t.get(k).copied().unwrap_or(f64::NAN));
        let down = 2.0 * (f64::from(band) + depth) / f64::from(self.bands);
        let azimuth = self.sector.to_f64() * (f64::from(sector) + turn) - core::f64::consts::PI;
        let radius = Real::sqrt(Real::max(down * (2.0 - down), 0.0));
        [
            radius * Real::cos(azimuth),
            radius * Real::sin(azimuth),
            1.0 - down,
        ]
        .map(F::from_f64)
    }

    fn parameters(&self, x: &Located<Point<F>>, t: &mut [F]) {
        let (band, sector) = self.band_and_sector(x.cell);
        let places = self.depth_and_turn(&x.point);
        for ((t, place), first) in t.iter_mut().zip(places).zip([band, sector]) {
            let inside = (place - F::from_u32(first)).max(F::zero());
            *t = if inside > F::one() { F::one() } else { inside };
        }
    }

    /// The point of this colatitude, from 0 to π, and this azimuth, from −π to 2π.
    fn at(&self, coordinates: &[f64]) -> Option<Point<F>> {
        use core::f64::consts::PI;
        let &[colatitude, azimuth] = coordinates else {
            return None;
        };
        let is_there = (0.0..=PI).contains(&colatitude) && (-PI..=2.0 * PI).contains(&azimuth);
        // In f64, as a rounded angle moves a point further than a rounded coordinate.
        is_there.then(|| point(colatitude, azimuth).each(F::from_f64))
    }
}

impl<F: Real, const B: usize> Basis<B> for Sphere<F> {}

impl<F: Real> TransitionMoments for Sphere<F> {
    fn moments(&self, x: &Located<Point<F>>, j: usize) -> [[F; 1]; 1] {
        let preference = F::one() + self.forward * dot(&x.point, &self.centroid(j));
        [[preference / F::from_u32(self.bands * self.sectors)]]
    }
}
