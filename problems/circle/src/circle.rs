//! The equation (56), its chain, and its cells.

use core::f64::consts::{FRAC_1_PI, PI, TAU};

use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Basis, Cells, PairIntegral, TransitionMoments, legendre};
use fredholm_core::global::Stationary;
use fredholm_core::{Chain, Density, Equation, Located, Real, Space, Uniforms, Value};

use crate::geometry::Geometry;
use crate::quadrature::integrate_from;
use crate::series::eighth_turn;
use crate::{CircleError, Direction, Emission, MOST_FUNCTIONS, Tables};

/// The point e^{is} of the circle, kept as cos and sin of s/2 ∈ [0, π) with the number of its cell.
///
/// A step turns s/2 by an angle whose cosine is uniform, so a walk needs no trigonometry, and every
/// quantity of the equation is a sine of a difference of half angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<F> {
    cos: F,
    sin: F,
    // As wide as `Located::cell`, so that the compiler sees one number in both and not two.
    cell: usize,
}

impl<F: Real> Point<F> {
    #[inline]
    pub(crate) const fn new(cos: F, sin: F, cell: usize) -> Self {
        Self { cos, sin, cell }
    }

    /// The angle s ∈ [0, 2π].
    #[must_use]
    pub fn angle(&self) -> F {
        F::from_f64(2.0) * self.sin.atan2(self.cos)
    }

    /// (cos s/2, sin s/2), whose length is 1 up to rounding.
    #[inline]
    #[must_use]
    pub const fn half_angle(&self) -> (F, F) {
        (self.cos, self.sin)
    }

    /// The number of its cell.
    #[inline]
    #[must_use]
    pub const fn cell(&self) -> usize {
        self.cell
    }

    /// sin ms: the imaginary part of (e^{is/2})^{2m}, by squaring.
    #[inline]
    pub(crate) fn sine_of_multiple(&self, m: u32) -> F {
        if m == 0 {
            return F::zero();
        }
        // (cos, sin) of s, 2s, 4s, …; the multiple begins with the lowest bit that is set.
        let (mut cos, mut sin) = double_angle(self.cos, self.sin);
        let mut bits = m;
        while bits & 1 == 0 {
            (cos, sin) = double_angle(cos, sin);
            bits >>= 1;
        }
        let (mut re, mut im) = (cos, sin);
        bits >>= 1;
        while bits > 0 {
            (cos, sin) = double_angle(cos, sin);
            if bits & 1 == 1 {
                (re, im) = (re * cos - im * sin, re * sin + im * cos);
            }
            bits >>= 1;
        }
        im
    }

    #[inline]
    pub(crate) fn direction(&self) -> Direction<F> {
        Direction {
            cos: self.cos,
            sin: self.sin,
            cos_low: F::zero(),
            sin_low: F::zero(),
        }
    }
}

#[inline]
fn double_angle<F: Real>(cos: F, sin: F) -> (F, F) {
    let twice = cos + cos;
    ((cos - sin) * (cos + sin), twice * sin)
}

/// Flatland radiosity on the unit circle, (56) of Heinrich 1995:
///
/// ```text
/// u(s) = F(s) + ρ(s)/4 ∫₀^{2π} |sin((t − s)/2)| u(t) dt,
/// ```
///
/// with the chain p(s,t) = ¼ |sin((t − s)/2)|, so that k(s,t) = ρ(s). The measure is the angle in radians; u and F have one
/// unit. ρ and F are numbers, or have one for each of several [`Channels`](fredholm_core::Channels).
///
/// It is its own partition, n equal cells as in section 5, with Legendre polynomials of any degree up to 6 on them, of which
/// every integral has a closed form, so that no n×n matrix exists and n may be a million. With Δ = 2π/n, middles m_j and
/// A = Δ/4 = π/2n the transition masses are
///
/// ```text
/// p_j(s) = sin A |sin((m_j − s)/2)|             s outside cell j
/// p_j(s) = 1 − cos A cos((m_j − s)/2)           s inside
/// ```
///
/// with a relative error of at most 8 ε as a function of the stored point, in f32 too: small sines are taken to twice the
/// precision, and the form for the inside is a sum of squares. In the coordinate t ∈ [−1, 1] of a cell, where s = m_j + 2At,
/// with a = (m_j − s)/2:
///
/// ```text
/// M_j(s) = |sin a| C ± cos a D                  s outside cell j, + for j behind s
/// C_bc   = (A/2) ∫ ψ_b ψ_c cos At dt,           D the same with sin At
/// ```
///
/// p(s, ·) has a kink at s, so that in S the diagonal holds every degree at n⁻¹: it is best pointwise. Its integrals are power
/// series in t without cancellation. Left out, as in the paper, it is worse from degree 1 on: steps within a cell have a
/// probability of 1/n² and scores of the size of u, so that a sample without one shows no variance where there is some.
///
/// The coefficients K' are those of its [`system`](Self::system).
#[derive(Clone, Copy, Debug)]
pub struct Circle<T, E> {
    tables: T,
    emission: E,
}

impl<T: Tables, E: Emission<T::Scalar, T::Value>> Circle<T, E> {
    /// The circle with these cells and this emission.
    ///
    /// # Errors
    /// What [`Emission::validate`] says.
    pub fn new(tables: T, emission: E) -> Result<Self, CircleError> {
        let cells = tables.cells();
        let channels = cells.first().map_or(1, |c| c.reflectance.channels());
        emission.validate(cells.len(), channels)?;
        Ok(Self { tables, emission })
    }
}

impl<T: Tables, E> Circle<T, E> {
    /// The point at the angle `s` ∈ [0, 2π], rounded to the scalar.
    #[must_use]
    pub fn point(&self, s: f64) -> Point<T::Scalar> {
        let [cos, sin] = [Real::cos(0.5 * s), Real::sin(0.5 * s)].each(T::Scalar::from_f64);
        self.tables.point_at(cos, sin)
    }

    /// The point whose half angle s/2 has this cosine and this sine: [`point`](Self::point) without
    /// trigonometry. The length of (cos, sin) is 1 up to rounding; (−cos, −sin) is the same point.
    #[inline]
    #[must_use]
    pub fn point_at(&self, cos: T::Scalar, sin: T::Scalar) -> Point<T::Scalar> {
        self.tables.point_at(cos, sin)
    }

    /// The emission.
    #[must_use]
    pub const fn emission(&self) -> &E {
        &self.emission
    }

    /// The tables of its cells.
    #[must_use]
    pub const fn tables(&self) -> &T {
        &self.tables
    }

    /// ∫_Xj ¼|sin((t − s)/2)| ψ_b(t) dt for all b < B.
    #[inline]
    fn integrals<const B: usize>(&self, x: &Located<Point<T::Scalar>>, j: usize) -> [T::Scalar; B] {
        if const { B == 1 } {
            return [self.mass(x, j); B];
        }
        if j == x.cell {
            return self.tables.local(x).integrals;
        }
        let [even, odd] = self.phases(x, j);
        let [first, ..] = &self.tables.constants().moments;
        from_fn(|b| first[b] * if b % 2 == 0 { even } else { odd })
    }

    /// p_j(x).
    #[inline]
    fn mass(&self, x: &Located<Point<T::Scalar>>, j: usize) -> T::Scalar {
        let sine = self.tables.sine(&x.point, j);
        if j == x.cell {
            return self.own_mass(sine);
        }
        let [[mass, ..], ..] = self.tables.constants().moments;
        mass * sine
    }

    /// p_i(x) for x in cell i, to which one step in n leads.
    #[cold]
    #[inline(never)]
    fn own_mass(&self, sine: T::Scalar) -> T::Scalar {
        self.tables.own_mass(sine)
    }

    /// |sin a| and ± cos a, what moments outside the cell of x are made of.
    #[inline]
    fn phases(&self, x: &Located<Point<T::Scalar>>, j: usize) -> [T::Scalar; 2] {
        [
            self.tables.sine(&x.point, j),
            self.tables.signed_cosine(x, j),
        ]
    }

    /// M_i(x) for x in cell i, where p(x, ·) has its kink.
    fn own_moments<const B: usize>(&self, x: &Located<Point<T::Scalar>>) -> [[T::Scalar; B]; B] {
        let tau = self.tables.coordinate(x).to_f64().clamp(-1.0, 1.0);
        let quarter = self.tables.constants().quarter.to_f64();
        matrix(|b, c| {
            let product = |t: f64, distance: f64| {
                let psi: [f64; B] = legendre(t);
                psi[b] * psi[c] * Real::sin(quarter * distance)
            };
            let sides = integrate_from(tau, -1.0, product) + integrate_from(tau, 1.0, product);
            T::Scalar::from_f64(0.5 * quarter * sides)
        })
    }
}

/// The matrix with these entries.
#[inline(always)]
fn matrix<F: Copy, const B: usize>(entry: impl Fn(usize, usize) -> F) -> [[F; B]; B] {
    from_fn(|b| from_fn(|c| entry(b, c)))
}

impl<T: Tables, E> Space for Circle<T, E> {
    type Scalar = T::Scalar;
    type Point = Point<T::Scalar>;
}

impl<T: Tables, E> Chain for Circle<T, E> {
    /// The turn φ = t − s ∈ [0, 2π] has density ¼ sin(φ/2), hence cos(φ/2) = 1 − 2ξ.
    #[inline]
    fn step<U: Uniforms<T::Scalar>>(
        &self,
        x: &Point<T::Scalar>,
        uniforms: &mut U,
    ) -> Option<Point<T::Scalar>> {
        let (xi, one) = (uniforms.uniform(), T::Scalar::from_u32(1));
        let cos = one - (xi + xi);
        let root = (xi * (one - xi)).sqrt();
        let sin = root + root;
        Some(self.point_at(x.cos * cos - x.sin * sin, x.sin * cos + x.cos * sin))
    }
}

impl<T: Tables, E> Density for Circle<T, E> {
    fn density(&self, x: &Point<T::Scalar>, y: &Point<T::Scalar>) -> T::Scalar {
        T::Scalar::from_f64(0.25) * x.direction().sine(y.half_angle())
    }
}

impl<T: Tables, E: Emission<T::Scalar, T::Value>> Equation for Circle<T, E> {
    type Value = T::Value;

    #[inline]
    fn kernel(&self, x: &Point<T::Scalar>, _: &Point<T::Scalar>) -> T::Value {
        self.tables.reflectance(x.cell)
    }

    #[inline]
    fn source<U: Uniforms<T::Scalar>>(&self, x: &Point<T::Scalar>, _: &mut U) -> T::Value {
        self.emission.emission(x, &self.tables.reflectance(x.cell))
    }

    #[inline]
    fn channels(&self) -> usize {
        let first = self.tables.cells().first();
        first.map_or(1, |cell| cell.reflectance.channels())
    }

    /// ρ.
    #[inline]
    fn size(&self, x: &Point<T::Scalar>) -> T::Scalar {
        self.tables.reflectance(x.cell).largest()
    }
}

/// Uniform starts: p is symmetric.
impl<T: Tables, E> Stationary for Circle<T, E> {
    fn start<U: Uniforms<T::Scalar>>(&self, uniforms: &mut U) -> Point<T::Scalar> {
        // Half of the angle is k quarter turns and at most an eighth of a turn, where power series are short.
        let half = uniforms.uniform().to_f64();
        let quarters = (2.0 * half + 0.5) as u32;
        let (cos, sin) = eighth_turn(PI * (half - 0.5 * f64::from(quarters)));
        let [cos, sin] = [cos, sin].each(T::Scalar::from_f64);
        match quarters {
            0 => self.point_at(cos, sin),
            1 => self.point_at(-sin, cos),
            _ => self.point_at(-cos, -sin),
        }
    }

    #[inline]
    fn start_density(&self, _: &Point<T::Scalar>) -> f64 {
        0.5 * FRAC_1_PI
    }

    fn is_preserved(&self) -> bool {
        true
    }
}

impl<T: Tables, E> Cells for Circle<T, E> {
    const DIMENSION: usize = 1;

    fn cells(&self) -> usize {
        self.tables.cells().len()
    }

    #[inline]
    fn locate(&self, x: &Point<T::Scalar>) -> usize {
        x.cell
    }

    fn measure(&self, _: usize) -> f64 {
        TAU / self.tables.cells().len() as f64
    }

    fn point(&self, cell: usize, t: &[f64]) -> Point<T::Scalar> {
        let place = cell as f64 + t.first().copied().unwrap_or(f64::NAN);
        self.point(TAU * (place / self.tables.cells().len() as f64))
    }

    #[inline]
    fn parameters(&self, x: &Located<Point<T::Scalar>>, t: &mut [T::Scalar]) {
        let half = T::Scalar::from_f64(0.5);
        t.fill(half + half * self.tables.coordinate(x));
    }

    /// The point at an angle from 0 to 2π.
    fn at(&self, coordinates: &[f64]) -> Option<Point<T::Scalar>> {
        match *coordinates {
            [s] if (0.0..=TAU).contains(&s) => Some(self.point(s)),
            _ => None,
        }
    }
}

impl<T: Tables, E, const B: usize> Basis<B> for Circle<T, E> {}

impl<T: Tables, E, const B: usize> TransitionMoments<B> for Circle<T, E> {
    #[inline]
    fn moments(&self, x: &Located<Point<T::Scalar>>, j: usize) -> [[T::Scalar; B]; B] {
        const { assert!(B <= MOST_FUNCTIONS, "polynomials have degree 6 at most") }
        if const { B == 1 } {
            return [[self.mass(x, j); B]; B];
        }
        if j == x.cell {
            return self.own_moments(x);
        }
        let [even, odd] = self.phases(x, j);
        let moments = &self.tables.constants().moments;
        matrix(|b, c| moments[b][c] * if (b + c) % 2 == 0 { even } else { odd })
    }
}

impl<T: Tables, E: Emission<T::Scalar, T::Value>, const B: usize> PairIntegral<B> for Circle<T, E> {
    #[inline]
    fn pair_integral(&self, x: &Located<Point<T::Scalar>>, j: usize) -> [T::Value; B] {
        let reflectance = self.tables.reflectance(x.cell);
        let integrals = self.integrals::<B>(x, j);
        integrals.each(|integral| reflectance.scaled(integral))
    }
}
