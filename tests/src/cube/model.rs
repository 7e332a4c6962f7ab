//! Model problems with exact solutions, on the cube of any dimension.
//!
//! Each is made of one factor: K(x,y) = Π_a K(x_a, y_a)/λ, u(x) = Π_a u(x_a) and
//! F = u − Π_a ∫K(x_a, t) u(t) dt/λ are again an equation and its solution. The first five factors
//! are those of Atkinson and Shampine 2008 (ACM TOMS 35, algorithm 876), written λu − ∫Ku there; λ
//! must be larger than the bound of ∫|K| in their documentation, or the walks have no mean.
//!
//! Values are computed in f64 and rounded, so that the equation is the same in every scalar.

use core::f64::consts::{FRAC_1_PI, LN_2, PI};
use fredholm_core::array::Each;

use fredholm_core::Real;

use fredholm_cube::{FactorIntegral, KernelFactors, Product, ScalarField};

/// A model problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// The formula of the kernel, for people.
    pub name: &'static str,
    /// K.
    pub kernel: Product<ModelKernel>,
    /// F.
    pub source: ModelSource,
    /// u.
    pub solution: ModelSolution,
}

/// The kernel of a model problem, with exact integrals over boxes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelKernel(Scaled);

/// The source of a model problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelSource(Scaled);

/// The solution of a model problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelSolution(Factor);

/// A factor over λ.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scaled {
    factor: Factor,
    per_lambda: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Factor {
    // K = s^a t^b, u = t^c.
    Powers { a: u32, b: u32, c: f64 },
    Rational,
    Distance { r: u32 },
    Green { c: f64 },
    Cosine,
}

/// K = s t², u = t²; smooth. ∫|K| ≤ 1/3 in one dimension.
#[must_use]
pub fn quadratic(lambda: f64) -> Model {
    powers("s t^2", [1, 2], 2.0, lambda)
}

/// K = 1/(1 + 2s + t), u = t; smooth. ∫|K| ≤ ln 2.
#[must_use]
pub fn rational(lambda: f64) -> Model {
    Model::new("1/(1 + 2s + t)", Factor::Rational, lambda)
}

/// K = s³t⁴, u = t^c with c > −1, whose smoothness is c where c is no integer. ∫|K| ≤ 1/5.
#[must_use]
pub fn quartic(c: f64, lambda: f64) -> Model {
    powers("s^3 t^4", [3, 4], c, lambda)
}

/// K = |s − t|^r, u = t: for odd r a family of smoothness r, whose r-th derivative jumps along the
/// diagonal (r = 1: a kink). ∫|K| ≤ 1/(r + 1).
#[must_use]
pub fn distance(r: u32, lambda: f64) -> Model {
    Model::new("|s - t|^r", Factor::Distance { r }, lambda)
}

/// K = −s(1 − t) for s < t and −t(1 − s) else, u = t^c (1 − t) with c > −1; a kink along the
/// diagonal: Green's function of the second derivative. ∫|K| ≤ 1/8.
#[must_use]
pub fn green(c: f64, lambda: f64) -> Model {
    Model::new("-min(s,t)(1 - max(s,t))", Factor::Green { c }, lambda)
}

/// K = cos π(s + t), u = 1 + cos πt; smooth, of either sign. ∫|K| = 2/π.
#[must_use]
pub fn cosine(lambda: f64) -> Model {
    Model::new("cos pi(s + t)", Factor::Cosine, lambda)
}

/// K = s t⁴, u = t; smooth. ∫|K| ≤ 1/5, so that with λ = ½ it has ‖K‖∞ = 2 and ∫|K| ≤ 2/5.
///
/// In one dimension the spectral radius of T_(k²p) is 1/(11 λ²). With λ = 1/3 and a constant absorption of q0 = 0.2 it
/// becomes 1/(11 λ²(1 − q0)) = 1.02: the means exist, the variances do not.
#[must_use]
pub fn steep(lambda: f64) -> Model {
    powers("s t^4", [1, 4], 1.0, lambda)
}

/// K = s³ t, u = t; smooth, of rank 1: T_K has the spectral radius 1/5, while ∫|K| grows to 1/2. With
/// λ = 0.45 ‖T_K‖∞ = 10/9, and the walks have means and variances all the same.
#[must_use]
pub fn cubic(lambda: f64) -> Model {
    powers("s^3 t", [3, 1], 1.0, lambda)
}

fn powers(name: &'static str, [a, b]: [u32; 2], c: f64, lambda: f64) -> Model {
    Model::new(name, Factor::Powers { a, b, c }, lambda)
}

impl Model {
    fn new(name: &'static str, factor: Factor, lambda: f64) -> Self {
        let scaled = Scaled {
            factor,
            per_lambda: 1.0 / lambda,
        };
        Self {
            name,
            kernel: Product(ModelKernel(scaled)),
            source: ModelSource(scaled),
            solution: ModelSolution(factor),
        }
    }

    /// ∫ u dx over [0, 1]^D.
    #[must_use]
    pub fn mean<const D: usize>(&self) -> f64 {
        power::<D>(self.solution.0.mean())
    }

    /// A bound of the spectral radius of T_|K| on [0, 1]^D. Where it is below 1 the walks have means.
    #[must_use]
    pub fn radius_bound<const D: usize>(&self) -> f64 {
        power::<D>(self.solution.0.bound()) * self.source.0.per_lambda.abs()
    }

    /// Whether the kernel is of finite smoothness where x_a = y_a.
    #[must_use]
    pub const fn has_kink(&self) -> bool {
        match self.solution.0 {
            Factor::Distance { r } => r % 2 == 1,
            Factor::Green { .. } => true,
            _ => false,
        }
    }
}

fn power<const D: usize>(x: f64) -> f64 {
    [x; D].into_iter().product()
}

impl Factor {
    fn kernel(self, s: f64, t: f64) -> f64 {
        match self {
            Self::Powers { a, b, .. } => power_of(s, a) * power_of(t, b),
            Self::Rational => 1.0 / (1.0 + 2.0 * s + t),
            Self::Distance { r } => power_of((s - t).abs(), r),
            Self::Green { .. } if s < t => -s * (1.0 - t),
            Self::Green { .. } => -t * (1.0 - s),
            Self::Cosine => Real::cos(PI * (s + t)),
        }
    }

    fn solution(self, t: f64) -> f64 {
        match self {
            Self::Powers { c, .. } => t.pow(c),
            Self::Rational | Self::Distance { .. } => t,
            Self::Green { c } => t.pow(c) * (1.0 - t),
            Self::Cosine => 1.0 + Real::cos(PI * t),
        }
    }

    /// ∫₀¹ K(s,t) u(t) dt.
    fn image(self, s: f64) -> f64 {
        match self {
            Self::Powers { a, b, c } => power_of(s, a) / (f64::from(b) + c + 1.0),
            Self::Rational => {
                let a = 1.0 + 2.0 * s;
                1.0 - a * Real::ln((1.0 + a) / a)
            }
            Self::Distance { r } => {
                let (p, rest) = (f64::from(r) + 1.0, 1.0 - s);
                power_of(s, r + 2) / (p * (p + 1.0))
                    + power_of(rest, r + 1) * (rest / (p + 1.0) + s / p)
            }
            Self::Green { c } => {
                s.pow(c + 2.0) / (c + 2.0) * (1.0 / (c + 1.0) - s / (c + 3.0))
                    - 2.0 * s / ((c + 1.0) * (c + 2.0) * (c + 3.0))
            }
            Self::Cosine => 0.5 * Real::cos(PI * s) - 2.0 * FRAC_1_PI * Real::sin(PI * s),
        }
    }

    /// ∫ K(s,t) dt over low ≤ t ≤ high.
    fn integral(self, s: f64, low: f64, high: f64) -> f64 {
        let width = high - low;
        // The parts of the interval on both sides of s.
        let kink = s.max(low).min(high);
        match self {
            Self::Powers { a, b, .. } => power_of(s, a) * integral_of_power(b, low, high),
            Self::Rational => {
                // ln(1 + x) as ln(u) x/(u − 1) with u = fl(1 + x) (Kahan), so that small cells keep
                // their digits.
                let x = width / (1.0 + 2.0 * s + low);
                let u = 1.0 + x;
                if u == 1.0 {
                    x
                } else {
                    Real::ln(u) * (x / (u - 1.0))
                }
            }
            Self::Distance { r } => {
                integral_of_power(r, s - kink, s - low) + integral_of_power(r, kink - s, high - s)
            }
            Self::Green { .. } => {
                let below = (kink - low) * 0.5 * (low + kink) * (1.0 - s);
                let above = (high - kink) * (1.0 - 0.5 * (kink + high)) * s;
                -(below + above)
            }
            Self::Cosine => {
                // sin π(s + high) − sin π(s + low)
                let middle = PI * (s + 0.5 * (low + high));
                2.0 * FRAC_1_PI * Real::cos(middle) * Real::sin(0.5 * PI * width)
            }
        }
    }

    /// ∫₀¹ u.
    fn mean(self) -> f64 {
        match self {
            Self::Powers { c, .. } => 1.0 / (c + 1.0),
            Self::Rational | Self::Distance { .. } => 0.5,
            Self::Green { c } => 1.0 / ((c + 1.0) * (c + 2.0)),
            Self::Cosine => 1.0,
        }
    }

    /// sup_s ∫₀¹ |K(s,t)| dt; for products of powers the spectral radius.
    fn bound(self) -> f64 {
        match self {
            Self::Powers { a, b, .. } => 1.0 / f64::from(a + b + 1),
            Self::Rational => LN_2,
            Self::Distance { r } => 1.0 / (f64::from(r) + 1.0),
            Self::Green { .. } => 0.125,
            Self::Cosine => 2.0 * FRAC_1_PI,
        }
    }
}

/// ∫ t^r dt from a to b as a product with the width, so that nothing cancels in small cells.
fn integral_of_power(r: u32, a: f64, b: f64) -> f64 {
    let sum: f64 = (0..=r).map(|l| power_of(a, l) * power_of(b, r - l)).sum();
    (b - a) * sum / (f64::from(r) + 1.0)
}

/// x^n, the same bits on every machine.
fn power_of(x: f64, n: u32) -> f64 {
    (0..n).fold(1.0, |power, _| power * x)
}

impl<F: Real> KernelFactors<F> for ModelKernel {
    #[inline]
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let k = self.0.factor.kernel(x.to_f64(), y.to_f64());
        F::from_f64(self.0.scale(axis) * k)
    }
}

impl<F: Real> FactorIntegral<F> for ModelKernel {
    #[inline]
    fn factor_integral(&self, axis: usize, x: F, low: F, high: F) -> F {
        let [x, low, high] = [x, low, high].each(Real::to_f64);
        F::from_f64(self.0.scale(axis) * self.0.factor.integral(x, low, high))
    }
}

impl Scaled {
    /// 1/λ belongs to the first factor.
    fn scale(&self, axis: usize) -> f64 {
        if axis == 0 { self.per_lambda } else { 1.0 }
    }
}

impl<F: Real, const D: usize> ScalarField<F, D> for ModelSource {
    fn value(&self, x: &[F; D]) -> F {
        let (mut u, mut image) = (1.0, self.0.per_lambda);
        for x in x {
            u *= self.0.factor.solution(x.to_f64());
            image *= self.0.factor.image(x.to_f64());
        }
        F::from_f64(u - image)
    }
}

impl<F: Real, const D: usize> ScalarField<F, D> for ModelSolution {
    fn value(&self, x: &[F; D]) -> F {
        let u = x.iter().map(|x| self.0.solution(x.to_f64()));
        F::from_f64(u.product())
    }
}
