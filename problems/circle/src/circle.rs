//! The equation (56), its chain, its partition and its Galerkin coefficients.

use fredholm_core::array::Each;
use fredholm_core::galerkin::{
    Basis, Coefficients, GalerkinMatrix, PairIntegral, Partition, TransitionMoments,
};
use fredholm_core::whole::Starts;
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

use crate::cells::{Cells, Direction};
use crate::residual::{ClosedForm, Sum, middles};
use crate::{CircleError, Emission};

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

impl<F> Point<F> {
    /// Puts together what a point keeps.
    #[cfg(feature = "lanes")]
    pub(crate) const fn new(cos: F, sin: F, cell: u32) -> Self {
        let cell = cell as usize;
        Self { cos, sin, cell }
    }
}

impl<F: Real> Point<F> {
    /// The angle s ∈ [0, 2π].
    #[must_use]
    pub fn angle(&self) -> F {
        F::from_f64(2.0) * self.sin.atan2(self.cos)
    }

    /// (cos s/2, sin s/2), whose length is 1 up to rounding.
    #[must_use]
    pub fn half_angle(&self) -> (F, F) {
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
/// with the chain p(s,t) = (1 − q0)/4 |sin((t − s)/2)|, q = q0, so that k(s,t) = ρ(s)/(1 − q0). The
/// measure is the angle in radians; u and F have one unit.
///
/// It is its own partition (n equal cells, section 5) and its own Galerkin coefficients, every one
/// of which has a closed form, so that no n×n matrix exists and n may be a million. With
/// Δ = 2π/n, middles m_j and A = Δ/4 = π/2n:
///
/// ```text
/// p_j(s) = (1 − q0) sin A |sin((m_j − s)/2)|                      s outside cell j
/// p_j(s) = (1 − q0) (1 − cos A cos((m_j − s)/2))                  s inside
/// K_ij   = ρ_i (2n/π) sin² A |sin((m_j − m_i)/2)|                 i ≠ j
/// K_ii   = ρ_i (1 − sin(π/n)/(π/n))
/// ```
///
/// p_j has a relative error of at most 8 ε as a function of the stored point, in f32 too: small
/// sines are taken to twice the precision, and the form for the inside is a sum of squares.
#[derive(Clone, Copy, Debug)]
pub struct Circle<'a, F, E> {
    cells: Cells<'a, F>,
    emission: E,
    constants: Constants<F>,
}

/// The constants that a circle of n cells computes once from n and q0, with A = π/2n. A device that keeps it beside
/// its tables needs no trigonometry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Constants<F> {
    /// q0.
    absorption: F,
    /// (1 − q0) sin A.
    mass: F,
    /// 1/(1 − q0).
    per_survival: F,
    /// 1 − q0.
    survival: F,
    /// cos A.
    cos_quarter: F,
    /// 1 − cos A.
    versine: F,
    /// (2n/π) sin² A.
    galerkin: F,
    /// 1 − sin(π/n)/(π/n).
    diagonal: F,
}

#[cfg(feature = "lanes")]
impl<F: Copy> Constants<F> {
    pub(crate) const fn per_survival(&self) -> F {
        self.per_survival
    }

    pub(crate) const fn galerkin(&self) -> F {
        self.galerkin
    }

    pub(crate) const fn mass(&self) -> F {
        self.mass
    }
}

impl<F: Real> Constants<F> {
    /// The constants of q0 and the number of cells.
    ///
    /// # Errors
    /// [`CircleError::Absorption`] for q0 outside (0, 1).
    fn compute(absorption: f64, cells: usize) -> Result<Self, CircleError> {
        let q = F::from_f64(absorption);
        if !(q > F::zero() && q < F::one()) {
            return Err(CircleError::Absorption);
        }
        let quarter = core::f64::consts::PI / (2.0 * cells as f64);
        let sine = Real::sin(quarter);
        let half_sine = Real::sin(0.5 * quarter);
        let survival = F::one() - q;
        Ok(Self {
            absorption: q,
            mass: F::from_f64(survival.to_f64() * sine),
            per_survival: F::one() / survival,
            survival,
            cos_quarter: F::from_f64(Real::cos(quarter)),
            versine: F::from_f64(2.0 * half_sine * half_sine),
            galerkin: F::from_f64(sine * sine / quarter),
            diagonal: F::from_f64(one_minus_sinc(2.0 * quarter)),
        })
    }

    /// Puts together the numbers of [`parts`](Self::parts): for constants that were computed before.
    #[must_use]
    pub const fn new(parts: [F; 8]) -> Self {
        let [
            absorption,
            mass,
            per_survival,
            survival,
            cos_quarter,
            versine,
            galerkin,
            diagonal,
        ] = parts;
        Self {
            absorption,
            mass,
            per_survival,
            survival,
            cos_quarter,
            versine,
            galerkin,
            diagonal,
        }
    }

    /// q0, (1 − q0) sin A, 1/(1 − q0), 1 − q0, cos A, 1 − cos A, (2n/π) sin² A, and
    /// 1 − sin(π/n)/(π/n).
    #[must_use]
    pub const fn parts(&self) -> [F; 8] {
        [
            self.absorption,
            self.mass,
            self.per_survival,
            self.survival,
            self.cos_quarter,
            self.versine,
            self.galerkin,
            self.diagonal,
        ]
    }
}

impl<'a, F: Real, E: Emission<F>> Circle<'a, F, E> {
    /// The circle with these cells, this emission and absorption probability q0.
    ///
    /// # Errors
    /// [`CircleError::Absorption`] for q0 outside (0, 1), and what [`Emission::validate`] says.
    pub fn new(cells: Cells<'a, F>, emission: E, absorption: f64) -> Result<Self, CircleError> {
        let constants = Constants::compute(absorption, cells.len())?;
        Self::with_constants(cells, emission, constants)
    }

    /// A circle from constants that were computed before, perhaps on another machine. What
    /// cannot be is refused; whether they belong to this number of cells is not checked.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_constants(
        cells: Cells<'a, F>,
        emission: E,
        constants: Constants<F>,
    ) -> Result<Self, CircleError> {
        let q = constants.absorption;
        if !(q > F::zero() && q < F::one()) {
            return Err(CircleError::Absorption);
        }
        emission.validate(cells.len())?;
        Ok(Self {
            cells,
            emission,
            constants,
        })
    }

    /// The constants that were computed from q0 and the number of cells.
    #[must_use]
    pub const fn constants(&self) -> Constants<F> {
        self.constants
    }

    /// The point at the angle `s` ∈ [0, 2π], rounded to the scalar.
    #[must_use]
    pub fn point(&self, s: f64) -> Point<F> {
        let half = 0.5 * s;
        self.point_at(F::from_f64(Real::cos(half)), F::from_f64(Real::sin(half)))
    }

    /// The emission.
    #[must_use]
    pub const fn emission(&self) -> &E {
        &self.emission
    }

    /// The table of its cells.
    #[must_use]
    pub const fn table(&self) -> Cells<'a, F> {
        self.cells
    }

    /// F'_i for every cell, (40).
    ///
    /// # Errors
    /// [`CircleError::Length`].
    pub fn source_means(&self, out: &mut [F]) -> Result<(), CircleError> {
        let cells = self.cells.len();
        if out.len() != cells {
            return Err(CircleError::Length {
                expected: cells,
                found: out.len(),
            });
        }
        for (i, (out, cell)) in out.iter_mut().zip(self.cells.iter()).enumerate() {
            let mean = self.emission.cell_mean(i, cells, cell.reflectance.to_f64());
            *out = F::from_f64(mean);
        }
        Ok(())
    }

    /// The point whose half angle s/2 has this cosine and this sine: [`point`](Self::point) without
    /// trigonometry. The length of (cos, sin) is 1 up to rounding; (−cos, −sin) is the same point.
    #[inline]
    #[must_use]
    pub fn point_at(&self, cos: F, sin: F) -> Point<F> {
        // e^{is} has two half angles; the one with sin ≥ 0 is kept. A Newton step towards length 1
        // keeps rounding errors from adding up over a walk.
        let half = F::from_f64(0.5);
        let length = F::from_f64(1.5) - half * (cos * cos + sin * sin);
        let scale = length.copysign(sin);
        let (cos, sin) = (cos * scale, sin * scale);
        Point {
            cos,
            sin,
            cell: self.cells.locate(cos, sin) as usize,
        }
    }

    #[inline]
    pub(crate) fn reflectance(&self, i: usize) -> F {
        self.cells.get(i).map_or(F::NAN, |c| c.reflectance)
    }

    /// k on cell `i`: ρ_i/(1 − q0).
    #[inline]
    pub(crate) fn weight(&self, i: usize) -> F {
        self.reflectance(i) * self.constants.per_survival
    }

    /// ∫_Xj ¼|sin((t − s)/2)| dt up to the factor sin A: |sin((m_j − s)/2)|, x outside cell j.
    #[inline]
    pub(crate) fn sine(&self, x: &Point<F>, j: usize) -> F {
        self.cells
            .get(j)
            .map_or(F::NAN, |c| c.middle.sine(&x.direction()))
    }

    /// The form factor from `x` to its own cell: 1 − cos A cos B with B = (m_j − s)/2, as
    /// (1 − cos A) + cos A (1 − cos B), where 1 − cos B = sin² B/(1 + cos B).
    #[inline]
    pub(crate) fn own_cell(&self, x: &Point<F>, j: usize) -> F {
        let sine = self.sine(x, j);
        let square = sine * sine;
        let cosine = (F::one() - square).max(F::zero()).sqrt();
        self.constants.versine + self.constants.cos_quarter * (square / (F::one() + cosine))
    }

    /// 1 − q0.
    pub(crate) const fn survival(&self) -> F {
        self.constants.survival
    }

    /// sin A.
    pub(crate) fn form_factor_scale(&self) -> F {
        self.constants.mass * self.constants.per_survival
    }
}

/// 1 − sin(x)/x for 0 ≤ x ≤ π.
fn one_minus_sinc(x: f64) -> f64 {
    if x > 0.5 {
        return 1.0 - Real::sin(x) / x;
    }
    // x²/3! − x⁴/5! + …: nine terms are exact below ½.
    let square = x * x;
    let mut sum = 0.0;
    for k in (1..10_u32).rev() {
        let factor = f64::from(2 * k) * f64::from(2 * k + 1);
        sum = square / factor * (1.0 - sum);
    }
    sum
}

impl<F: Real, E> StateSpace for Circle<'_, F, E> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, E: Emission<F>> Sampler for Circle<'_, F, E> {
    #[inline]
    fn absorption(&self, _: &Point<F>) -> F {
        self.constants.absorption
    }

    /// The turn φ = t − s ∈ [0, 2π] has density ¼ sin(φ/2), hence cos(φ/2) = 1 − 2ξ.
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        let xi: F = uniforms.uniform();
        let cos = F::one() - (xi + xi);
        let root = (xi * (F::one() - xi)).sqrt();
        let sin = root + root;
        Some(self.point_at(x.cos * cos - x.sin * sin, x.sin * cos + x.cos * sin))
    }
}

impl<F: Real, E: Emission<F>> TransitionDensity for Circle<'_, F, E> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        F::from_f64(0.25) * self.constants.survival * x.direction().sine(&y.direction())
    }
}

/// Uniform starts: p is symmetric and q constant.
impl<F: Real, E: Emission<F>> Starts for Circle<'_, F, E> {
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        let xi: F = uniforms.uniform();
        // Half of the angle is k quarter turns and at most an eighth of a turn, where power series are short.
        let half = xi.to_f64();
        let quarters = (2.0 * half + 0.5) as u32;
        let (cos, sin) =
            crate::series::eighth_turn(core::f64::consts::PI * (half - 0.5 * f64::from(quarters)));
        let (cos, sin) = (F::from_f64(cos), F::from_f64(sin));
        match quarters {
            0 => self.point_at(cos, sin),
            1 => self.point_at(-sin, cos),
            _ => self.point_at(-cos, -sin),
        }
    }

    #[inline]
    fn start_density(&self, _: &Point<F>) -> f64 {
        0.5 * core::f64::consts::FRAC_1_PI
    }

    fn survival(&self) -> Option<f64> {
        Some(self.constants.survival.to_f64())
    }
}

impl<F: Real, E: Emission<F>> Kernel for Circle<'_, F, E> {
    #[inline]
    fn kernel(&self, x: &Point<F>, _: &Point<F>) -> F {
        self.weight(x.cell)
    }
}

impl<F: Real, E: Emission<F>> Source for Circle<'_, F, E> {
    #[inline]
    fn source(&self, x: &Point<F>) -> F {
        self.emission.emission(x, self.reflectance(x.cell))
    }
}

impl<F: Real, E: Emission<F>> Partition for Circle<'_, F, E> {
    fn cells(&self) -> usize {
        self.cells.len()
    }
    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        x.cell
    }
}

impl<F: Real, E: Emission<F>> Basis for Circle<'_, F, E> {
    #[inline]
    fn basis(&self, _: &Located<Point<F>>) -> [F; 1] {
        [F::one()]
    }
}

impl<F: Real, E: Emission<F>> TransitionMoments for Circle<'_, F, E> {
    #[inline]
    fn moments(&self, x: &Located<Point<F>>, j: usize) -> [[F; 1]; 1] {
        [[if j == x.cell {
            self.constants.survival * self.own_cell(&x.point, j)
        } else {
            self.constants.mass * self.sine(&x.point, j)
        }]]
    }
}

impl<F: Real, E: Emission<F>> PairIntegral for Circle<'_, F, E> {
    #[inline]
    fn pair_integral(&self, x: &Located<Point<F>>, j: usize) -> [F; 1] {
        let [[mass]] = self.moments(x, j);
        [self.weight(x.cell) * mass]
    }
}

impl<F: Real, E: Emission<F>> Coefficients for Circle<'_, F, E> {
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; 1]) -> [F; 1] {
        let (Some(from), Some(to)) = (self.cells.get(i), self.cells.get(j)) else {
            return [F::NAN];
        };
        let entry = if i == j {
            from.reflectance * self.constants.diagonal
        } else {
            from.reflectance * self.constants.galerkin * to.middle.rough_sine(&from.middle)
        };
        left.each(|left| left * entry)
    }
}

impl<F: Real, E: Emission<F>> GalerkinMatrix for Circle<'_, F, E> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.cells.len()
    }

    fn functions(&self) -> usize {
        1
    }

    #[inline]
    fn entry(&self, [i, _]: [usize; 2], [j, _]: [usize; 2]) -> F {
        let [entry] = self.left_times_block(i, j, &[F::one()]);
        entry
    }

    /// Σ_j K_ij = ρ_i: the circle is closed.
    fn row_sum(&self, i: usize) -> F {
        self.reflectance(i)
    }

    /// O(n): |sin((m_j − m_i)/2)| is separable on either side of the diagonal, so that running sums
    /// of v_j cos(m_j/2) and v_j sin(m_j/2) serve every row.
    fn apply(&self, v: &[F], out: &mut [F]) {
        let mut before = Sum::default();
        for ((out, &v), cell) in out.iter_mut().zip(v).zip(self.cells.iter()) {
            *out = before.turn_to(&cell.middle);
            before.add(&cell.middle, v);
        }
        let mut after = Sum::default();
        for ((out, &v), cell) in out.iter_mut().zip(v).zip(self.cells.iter()).rev() {
            let diagonal_rule = *out - after.turn_to(&cell.middle);
            *out = cell.reflectance
                * (self.constants.galerkin * diagonal_rule + self.constants.diagonal * v);
            after.add(&cell.middle, v);
        }
    }

    fn scratch(&self) -> usize {
        0
    }

    fn sweep(&self, source: &[F], v: &mut [F], _: &mut [F]) -> F {
        let mut after = Sum::default();
        for (&v, middle) in v.iter().zip(middles(&self.cells)) {
            after.add(middle, v);
        }
        let mut before = Sum::default();
        let mut largest = F::zero();
        for ((v, &source), cell) in v.iter_mut().zip(source).zip(self.cells.iter()) {
            after.add(&cell.middle, -*v);
            let diagonal_rule = before.turn_to(&cell.middle) - after.turn_to(&cell.middle);
            let own = cell.reflectance * self.constants.diagonal;
            let residual =
                source + cell.reflectance * self.constants.galerkin * diagonal_rule + own * *v - *v;
            // Written so that NaN stays.
            if !(residual.abs() <= largest) && !largest.is_nan() {
                largest = residual.abs();
            }
            *v += residual / (F::one() - own);
            before.add(&cell.middle, *v);
        }
        largest
    }
}

impl<F: Real, E: Emission<F>> ClosedForm<F> for Circle<'_, F, E> {
    fn table(&self) -> Cells<'_, F> {
        self.cells
    }

    #[inline]
    fn reflectance(&self, cell: usize) -> F {
        Circle::reflectance(self, cell)
    }

    fn amplitude(&self, v: &[F]) -> [F; 2] {
        [v.first().copied().unwrap_or(F::NAN), F::zero()]
    }

    #[inline]
    fn scale(&self) -> F {
        self.form_factor_scale()
    }

    #[inline]
    fn local(&self, x: &Located<Point<F>>) -> [[F; 1]; 2] {
        [[F::one()], [self.own_cell(&x.point, x.cell)]]
    }
}
