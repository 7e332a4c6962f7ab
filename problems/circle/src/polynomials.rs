//! Piecewise polynomials of any degree on the circle.

use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Basis, PairIntegral, Partition, TransitionMoments, legendre};
use fredholm_core::whole::{Scores, sum_of};
use fredholm_core::{
    Kernel, Located, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

use crate::cells::{Cell, Direction};
use crate::quadrature::{bessel, integrate, integrate_from};
use crate::residual::ClosedForm;
use crate::series::{TERMS, arcsine, arcsine_terms, own_integrals, series, terms};
use crate::{Cells, Circle, CircleError, Emission, Point};

/// The circle with B = degree + 1 Legendre polynomials on every cell, normalised: in the coordinate
/// t ∈ [−1, 1] of a cell with s = m_j + 2At, A = π/2n, ψ_b = √(2b + 1) P_b(t).
///
/// It is the same equation and chain as its [`Circle`], and gives a neighbour equation of the degree
/// through [`Piecewise`](fredholm_core::galerkin::Piecewise). All cells are equal, so that constant
/// matrices serve them all: with a = (m_j − s)/2 and j_b the spherical Bessel functions,
///
/// ```text
/// M_j(s)          = |sin a| C ± cos a D                     s outside cell j, + for j behind s
/// C_bc            = (1 − q0) (A/2) ∫ ψ_b ψ_c cos At dt,     D the same with sin At
/// K'_(ia)(jb)     = ± ρ_i f_a f_b sin((m_j − m_i)/2 + (b − a)π/2)    i ≠ j,   f_b = √A √(2b+1) j_b(A)
/// ```
///
/// from ∫ P_b(t) sin(a + At) dt = 2 j_b(A) sin(a + bπ/2). K' and K'v cost O(1) and O(nB), as with
/// piecewise constants. p(s, ·) has a kink at s, so that in S the diagonal holds every degree at n⁻¹: it
/// is best pointwise. Its integrals are power series in t without cancellation. Left out, as in the paper, it
/// is worse: steps within a cell have a probability of 1/n² and scores of the size of u, so that a sample without
/// one shows no variance where there is some.
///
/// ```
/// # #[cfg(feature = "alloc")] {
/// use fredholm_circle::{Circle, Harmonic, Tables};
/// use fredholm_core::galerkin::{DiagonalRule, PairKind};
/// use fredholm_core::{At, Batch, Estimator, Form, Neighbour, Length, Task, WalkSeeds};
///
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// let tables = Tables::<f64>::new(&[0.3, 0.7], 250)?;
/// let circle = Circle::new(tables.cells(), light, 0.2)?;
///
/// // Degree 3: 1,000 unknowns.
/// let cubic = circle.with_functions::<4>();
/// let pairs = DiagonalRule { diagonal: PairKind::Pointwise };
/// let solution = cubic.solve(1e-15, 1000)?;
/// let vectors = solution.for_walks(&cubic, pairs)?;
/// let neighbour = vectors.with_pointwise(&cubic, &cubic)?;
///
/// let start = circle.point(0.3);
/// let task = Task {
///     equation: &circle,
///     neighbour: &neighbour,
///     functional: &At(start),
///     control_mean: Some(neighbour.value(&neighbour.locate(start))),
///     estimator: Estimator::Absorption,
///     form: Form::Product,
///     seeds: <WalkSeeds>::new(1, 0),
///     length: Length::default(),
/// };
/// let mut batch = Batch::new(0, 1000, 1000);
/// batch.run(&task, u64::MAX)?;
/// let error = batch.statistics().preconditioned().std_error.unwrap();
/// assert!(error < 1e-8); // plain: 0.2
/// # }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PolynomialCircle<'c, 'a, F, E, const B: usize> {
    pub(crate) circle: &'c Circle<'a, F, E>,
    /// 1/A times the series of the arcsine, in odd powers; none where A is too large for it.
    coordinate: Option<[F; TERMS]>,
    /// The number of its terms that count.
    coordinate_terms: usize,
    /// A.
    quarter: F,
    /// √A.
    root: F,
    /// C.
    even: [[F; B]; B],
    /// D.
    odd: [[F; B]; B],
    /// f.
    pub(crate) factors: [F; B],
    /// K'_(ia)(ib)/ρ_i.
    pub(crate) diagonal: [[F; B]; B],
    /// (A/2) ∫ ψ_b(t) |sin A(t − τ)| dt in even powers of τ for even b, in odd ones for odd b.
    own: [[F; TERMS]; B],
    /// The number of these terms that count.
    terms: usize,
}

impl<'a, F: Real, E: Emission<F>> Circle<'a, F, E> {
    /// This circle with B functions on every cell, the polynomials of degree B − 1.
    #[must_use]
    pub fn with_functions<const B: usize>(&self) -> PolynomialCircle<'_, 'a, F, E, B> {
        PolynomialCircle::new(self)
    }
}

impl<'c, 'a, F: Real, E: Emission<F>, const B: usize> PolynomialCircle<'c, 'a, F, E, B> {
    fn new(circle: &'c Circle<'a, F, E>) -> Self {
        let quarter = core::f64::consts::PI / (2.0 * circle.table().len() as f64);
        let scale = 0.5 * quarter * circle.survival().to_f64();
        let moments = |phase: fn(f64) -> f64| {
            matrix(|b, c| {
                let product = |t| {
                    let psi: [f64; B] = legendre(t);
                    psi[b] * psi[c] * phase(quarter * t)
                };
                F::from_f64(scale * integrate(-1.0, 1.0, product))
            })
        };
        let mut factors = bessel(quarter).each(|j| Real::sqrt(quarter) * j);
        for (f, root) in factors.iter_mut().zip(legendre::<f64, B>(1.0)) {
            *f *= root;
        }
        let own = own_integrals::<B>(quarter);
        Self {
            circle,
            // sin² A < 0.04 to the power 12 is no more than a rounding error.
            coordinate: (quarter < 0.2).then(|| arcsine(quarter).each(F::from_f64)),
            coordinate_terms: arcsine_terms(quarter),
            quarter: F::from_f64(quarter),
            root: F::from_f64(Real::sqrt(quarter)),
            even: moments(Real::cos),
            odd: moments(Real::sin),
            factors: factors.each(F::from_f64),
            diagonal: matrix(|a, b| {
                // |sin| in both of its arguments: the mean over τ of what y brings.
                let product = |tau| {
                    let psi: [f64; B] = legendre(tau);
                    psi[a] * series(&own[b], TERMS, b, tau)
                };
                F::from_f64(0.5 * integrate(-1.0, 1.0, product))
            }),
            terms: terms(&own),
            own: own.each(|row| row.each(F::from_f64)),
        }
    }

    /// The circle.
    #[must_use]
    pub const fn circle(&self) -> &'c Circle<'a, F, E> {
        self.circle
    }

    /// F'_ia for every cell and a < B, (40), n·B numbers, by 16 Gauss points a cell.
    ///
    /// # Errors
    /// [`CircleError::Length`].
    pub fn source_means(&self, out: &mut [F]) -> Result<(), CircleError> {
        let n = self.circle.table().len();
        if out.len() != n * B {
            return Err(CircleError::Length {
                expected: n * B,
                found: out.len(),
            });
        }
        let width = core::f64::consts::PI / n as f64;
        for (i, out) in out.chunks_exact_mut(B).enumerate() {
            let middle = width * (2 * i + 1) as f64;
            let reflectance = self.circle.reflectance(i);
            for (a, out) in out.iter_mut().enumerate() {
                let product = |t: f64| {
                    let x = self.circle.point(middle + width * t);
                    let source = self.circle.emission().emission(&x, reflectance);
                    0.5 * legendre::<f64, B>(t)[a] * source.to_f64()
                };
                *out = F::from_f64(integrate(-1.0, 1.0, product));
            }
        }
        Ok(())
    }

    /// What a sine from the middle of a cell is the argument of, in its odd powers, to be t. `None`: the cells are too large for it.
    #[cfg(feature = "lanes")]
    pub(crate) fn arcsine(&self) -> Option<&[F]> {
        self.coordinate.as_ref()?.get(..self.coordinate_terms)
    }

    /// t of a point in cell `i`.
    #[inline]
    fn coordinate(&self, x: &Point<F>, i: usize) -> F {
        let Some(cell) = self.circle.table().get(i) else {
            return F::NAN;
        };
        let direction = x.direction();
        self.coordinate_of(direction.small_sine(&cell.middle), &direction, cell)
    }

    /// t of a direction in a cell, whose sine from the middle of it is this.
    #[inline]
    fn coordinate_of(&self, sine: F, direction: &Direction<F>, cell: &Cell<F>) -> F {
        match &self.coordinate {
            Some(series) => {
                let square = sine * sine;
                let sum = series.iter().take(self.coordinate_terms).rev();
                sine * sum.fold(F::zero(), |sum, &c| sum * square + c)
            }
            None => sine.atan2(direction.cosine(&cell.middle)) / self.quarter,
        }
    }

    /// ± cos a, + where cell `j` is behind that of `x`.
    #[inline]
    fn signed_cosine(&self, x: &Located<Point<F>>, j: usize) -> F {
        let cosine = self
            .circle
            .table()
            .get(j)
            .map_or(F::NAN, |cell| cell.middle.cosine(&x.point.direction()));
        if j > x.cell { cosine } else { -cosine }
    }

    /// (A/2) ∫ ψ_b(t) |sin A(t − τ)| dt for all b.
    #[inline]
    fn own_cell(&self, tau: F) -> [F; B] {
        let mut b = 0;
        self.own.each(|row| {
            let value = series(&row, self.terms, b, tau);
            b += 1;
            value
        })
    }

    /// M_i(x) for x in cell i, where p(x, ·) has its kink.
    fn own_moments(&self, x: &Located<Point<F>>) -> [[F; B]; B] {
        let tau = self.coordinate(&x.point, x.cell).to_f64().clamp(-1.0, 1.0);
        let quarter = self.quarter.to_f64();
        let scale = 0.5 * quarter * self.circle.survival().to_f64();
        matrix(|b, c| {
            let product = |t: f64, distance: f64| {
                let psi: [f64; B] = legendre(t);
                psi[b] * psi[c] * Real::sin(quarter * distance)
            };
            let sides = integrate_from(tau, -1.0, product) + integrate_from(tau, 1.0, product);
            F::from_f64(scale * sides)
        })
    }
}

/// The matrix with these entries.
fn matrix<F: Copy, const B: usize>(entry: impl Fn(usize, usize) -> F) -> [[F; B]; B] {
    from_fn(|b| from_fn(|c| entry(b, c)))
}

impl<F: Real, E, const B: usize> StateSpace for PolynomialCircle<'_, '_, F, E, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, E: Emission<F>, const B: usize> Sampler for PolynomialCircle<'_, '_, F, E, B> {
    #[inline]
    fn absorption(&self, x: &Point<F>) -> F {
        self.circle.absorption(x)
    }
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.circle.step(x, uniforms)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> TransitionDensity
    for PolynomialCircle<'_, '_, F, E, B>
{
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.circle.density(x, y)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Kernel for PolynomialCircle<'_, '_, F, E, B> {
    #[inline]
    fn kernel(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.circle.kernel(x, y)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Source for PolynomialCircle<'_, '_, F, E, B> {
    #[inline]
    fn source(&self, x: &Point<F>) -> F {
        self.circle.source(x)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Partition for PolynomialCircle<'_, '_, F, E, B> {
    fn cells(&self) -> usize {
        self.circle.table().len()
    }
    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        x.cell()
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Basis<B> for PolynomialCircle<'_, '_, F, E, B> {
    #[inline]
    fn basis(&self, x: &Located<Point<F>>) -> [F; B] {
        legendre(self.coordinate(&x.point, x.cell))
    }
}

/// The B functions on every cell of a circle as functions on whose coefficients walks score.
///
/// Their argument t has an absolute error of n ε on n cells. Transition moments, which are small where t is close to ±1, take it
/// to twice the precision; a mean of scores does not tell these apart.
#[derive(Debug)]
pub struct CircleScores<'p, 'c, 'a, F, E, const B: usize>(
    pub &'p PolynomialCircle<'c, 'a, F, E, B>,
);

impl<F: Real, E: Emission<F>, const B: usize> Scores<Point<F>>
    for CircleScores<'_, '_, '_, F, E, B>
{
    fn unknowns(&self) -> usize {
        self.0.cells() * B
    }

    fn functions(&self) -> usize {
        B
    }

    #[inline]
    fn add(&self, x: &Located<Point<F>>, score: f64, sums: &mut [f64]) {
        let start = x.cell * B;
        let (Some(psi), Some(sums)) = (self.functions_at(x), sums.get_mut(start..start + B)) else {
            return;
        };
        for (sum, psi) in sums.iter_mut().zip(psi) {
            *sum += score * psi;
        }
    }

    #[inline]
    fn value(&self, x: &Located<Point<F>>, coefficients: &[f64]) -> f64 {
        let start = x.cell * B;
        let own = coefficients.get(start..start + B);
        match (self.functions_at(x), own) {
            (Some(psi), Some(own)) => sum_of(own, psi),
            _ => f64::NAN,
        }
    }
}

impl<F: Real, E: Emission<F>, const B: usize> CircleScores<'_, '_, '_, F, E, B> {
    /// The functions at a point.
    #[inline]
    fn functions_at(&self, x: &Located<Point<F>>) -> Option<[f64; B]> {
        let cell = self.0.circle.table().get(x.cell)?;
        let direction = x.point.direction();
        let sine = direction.sin * cell.middle.cos - direction.cos * cell.middle.sin;
        let psi: [F; B] = legendre(self.0.coordinate_of(sine, &direction, cell));
        Some(psi.each(Real::to_f64))
    }
}

impl<F: Real, E: Emission<F>, const B: usize> TransitionMoments<B>
    for PolynomialCircle<'_, '_, F, E, B>
{
    #[inline]
    fn moments(&self, x: &Located<Point<F>>, j: usize) -> [[F; B]; B] {
        if j == x.cell {
            return self.own_moments(x);
        }
        let (sine, cosine) = (self.circle.sine(&x.point, j), self.signed_cosine(x, j));
        let mut moments = self.even;
        for (row, odd) in moments.iter_mut().zip(&self.odd) {
            for (m, &odd) in row.iter_mut().zip(odd) {
                *m = sine * *m + cosine * odd;
            }
        }
        moments
    }
}

impl<F: Real, E: Emission<F>, const B: usize> PairIntegral<B>
    for PolynomialCircle<'_, '_, F, E, B>
{
    #[inline]
    fn pair_integral(&self, x: &Located<Point<F>>, j: usize) -> [F; B] {
        if j == x.cell {
            let reflectance = self.circle.reflectance(j);
            let own = self.own_cell(self.coordinate(&x.point, j));
            return own.each(|integral| reflectance * integral);
        }
        let (sine, cosine) = (self.circle.sine(&x.point, j), self.signed_cosine(x, j));
        let weight = self.circle.weight(x.cell);
        // Against ψ_0 = 1.
        let [even, odd] = [self.even, self.odd].each(|m| m.first().copied().unwrap_or([F::NAN; B]));
        from_fn(|b| weight * (sine * even[b] + cosine * odd[b]))
    }
}

impl<F: Real, E: Emission<F>, const B: usize> ClosedForm<F, B>
    for PolynomialCircle<'_, '_, F, E, B>
{
    fn table(&self) -> Cells<'_, F> {
        self.circle.table()
    }

    /// Σ_b f_b i^b v_b.
    #[inline]
    fn amplitude(&self, v: &[F]) -> [F; 2] {
        let mut sums = [F::zero(); 2];
        for (b, (&f, &v)) in self.factors.iter().zip(v).enumerate() {
            let term = if b % 4 < 2 { f * v } else { -(f * v) };
            if b.is_multiple_of(2) {
                sums[0] += term;
            } else {
                sums[1] += term;
            }
        }
        sums
    }

    #[inline]
    fn scale(&self) -> F {
        self.root
    }

    #[inline]
    fn reflectance(&self, cell: usize) -> F {
        self.circle.reflectance(cell)
    }

    #[inline]
    fn local(&self, x: &Located<Point<F>>) -> [[F; B]; 2] {
        let tau = self.coordinate(&x.point, x.cell);
        [legendre(tau), self.own_cell(tau)]
    }
}
