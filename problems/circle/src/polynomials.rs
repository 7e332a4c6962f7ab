//! Piecewise polynomials of any degree on the circle.

use fredholm_core::galerkin::{
    Basis, Coefficients, GalerkinMatrix, PairIntegral, Partition, TransitionMoments, legendre,
};
use fredholm_core::{
    Kernel, Located, Neighbour, Real, Sampler, Source, StateSpace, TransitionDensity, Uniforms,
};

use crate::cells::Direction;
use crate::quadrature::{bessel, integrate, integrate_from};
use crate::residual::Sum;
use crate::{Circle, CircleError, Emission, Moment, Point};

/// Terms of a series in even or in odd powers of an angle in units of A ≤ π/2: (π/2)²⁴/24! < 10⁻¹⁸.
const TERMS: usize = 12;

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
/// use fredholm_circle::{Circle, Harmonic, Polynomials, Tables};
/// use fredholm_core::galerkin::{OffDiagonal, PairKind};
/// use fredholm_core::{At, Batch, Estimator, Neighbour, STEP_LIMIT, Stream, Task};
///
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// let tables = Tables::<f64>::new(&[0.3, 0.7], 250)?;
/// let circle = Circle::new(tables.cells(), light, 0.2)?;
///
/// // Degree 3: 1,000 unknowns.
/// let cubic = Polynomials::<_, _, 4>::new(&circle);
/// let pairs = OffDiagonal { diagonal: PairKind::Pointwise };
/// let solution = cubic.solve(1e-15, 1000)?;
/// let vectors = solution.for_walks(&cubic, pairs)?;
/// let neighbour = vectors.with_pointwise(&cubic, &cubic)?;
///
/// let start = circle.point(0.3);
/// let task = Task {
///     equation: &circle,
///     neighbour: &neighbour,
///     functional: &At(start),
///     neighbour_value: Some(neighbour.value(&neighbour.locate(start))),
///     estimator: Estimator::Absorption,
///     stream: <Stream>::new(1, 0),
///     step_limit: STEP_LIMIT,
/// };
/// let mut batch = Batch::new(0, 1000, 1000);
/// batch.run(&task, u64::MAX)?;
/// let error = batch.statistics().preconditioned().std_error.unwrap();
/// assert!(error < 1e-8); // plain: 0.2
/// # }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Polynomials<'c, 'a, F, E, const B: usize> {
    circle: &'c Circle<'a, F, E>,
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
    factors: [F; B],
    /// K'_(ia)(ib)/ρ_i.
    diagonal: [[F; B]; B],
    /// (A/2) ∫ ψ_b(t) |sin A(t − τ)| dt in even powers of τ for even b, in odd ones for odd b.
    own: [[F; TERMS]; B],
    /// The number of these terms that count.
    terms: usize,
}

impl<'c, 'a, F: Real, E: Emission<F>, const B: usize> Polynomials<'c, 'a, F, E, B> {
    /// On the cells of this circle.
    #[must_use]
    pub fn new(circle: &'c Circle<'a, F, E>) -> Self {
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
        let mut factors = bessel(quarter).map(|j| Real::sqrt(quarter) * j);
        for (f, root) in factors.iter_mut().zip(legendre::<f64, B>(1.0)) {
            *f *= root;
        }
        let own = own_integrals::<B>(quarter);
        Self {
            circle,
            // sin² A < 0.04 to the power 12 is no more than a rounding error.
            coordinate: (quarter < 0.2).then(|| arcsine(quarter).map(F::from_f64)),
            coordinate_terms: arcsine_terms(quarter),
            quarter: F::from_f64(quarter),
            root: F::from_f64(Real::sqrt(quarter)),
            even: moments(Real::cos),
            odd: moments(Real::sin),
            factors: factors.map(F::from_f64),
            diagonal: matrix(|a, b| {
                // |sin| in both of its arguments: the mean over τ of what y brings.
                let product = |tau| {
                    let psi: [f64; B] = legendre(tau);
                    psi[a] * series(&own[b], TERMS, b, tau)
                };
                F::from_f64(0.5 * integrate(-1.0, 1.0, product))
            }),
            terms: terms(&own),
            own: own.map(|row| row.map(F::from_f64)),
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

    /// t of a point in cell `i`.
    #[inline]
    fn coordinate(&self, x: &Point<F>, i: usize) -> F {
        let Some(cell) = self.circle.table().get(i) else {
            return F::NAN;
        };
        let direction = x.direction();
        let sine = direction.small_sine(&cell.middle);
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
        self.own.map(|row| {
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

    /// Σ_b f_b i^b v_b as real and imaginary part.
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

    /// (K'v)_ia of the cells off the diagonal from their sums before and behind cell i.
    #[inline]
    fn others(&self, i: usize, [before, after]: [&Sum<F>; 2], middle: &Direction<F>) -> [F; B] {
        let turned = middle.turned();
        // Σ_{j>i} − Σ_{j<i} of Im and Re of what they send.
        let im = before.turn_to(middle) - after.turn_to(middle);
        let re = after.turn_to(&turned) - before.turn_to(&turned);
        let reflectance = self.circle.reflectance(i);
        let mut a = 0;
        self.factors.map(|f| {
            let part = match a % 4 {
                0 => im,
                1 => -re,
                2 => -im,
                _ => re,
            };
            a += 1;
            reflectance * f * part
        })
    }

    #[inline]
    fn add(&self, sum: &mut Sum<F>, middle: &Direction<F>, v: &[F]) {
        let [re, im] = self.amplitude(v);
        sum.add(middle, re);
        sum.add(&middle.turned(), im);
    }

    /// (K'_ii v)_a.
    #[inline]
    fn diagonal_times(&self, i: usize, v: &[F]) -> [F; B] {
        let reflectance = self.circle.reflectance(i);
        self.diagonal.map(|row| {
            let products = row.iter().zip(v).map(|(&k, &v)| k * v);
            reflectance * products.fold(F::zero(), |sum, x| sum + x)
        })
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Polynomials<'_, '_, F, E, B> {
    /// Fills what [`PolynomialResidual`] asks for from the solution `v`.
    ///
    /// # Errors
    /// [`CircleError::Length`] unless `v` has n·B entries and `out` n.
    pub fn residual_moments(&self, v: &[F], out: &mut [Moment<F>]) -> Result<(), CircleError> {
        let cells = self.circle.table();
        let n = cells.len();
        for (expected, found) in [(n * B, v.len()), (n, out.len())] {
            if expected != found {
                return Err(CircleError::Length { expected, found });
            }
        }
        let mut after = Sum::default();
        for (v, cell) in v.chunks_exact(B).zip(cells.iter()) {
            self.add(&mut after, &cell.middle, v);
        }
        let mut before = Sum::default();
        for ((out, v), cell) in out.iter_mut().zip(v.chunks_exact(B)).zip(cells.iter()) {
            self.add(&mut after, &cell.middle, &negated::<F, B>(v));
            *out = Moment::between(&before, &after);
            self.add(&mut before, &cell.middle, v);
        }
        Ok(())
    }
}

/// The neighbour equation with all pairs pointwise: h = k, and G = v − T_K v in closed form, O(B) at any n;
/// [`Residual`](crate::Residual) of any degree.
#[derive(Clone, Copy, Debug)]
pub struct PolynomialResidual<'p, 'c, 'a, F, E, const B: usize> {
    polynomials: &'p Polynomials<'c, 'a, F, E, B>,
    solution: &'p [F],
    moments: &'p [Moment<F>],
}

impl<'p, 'c, 'a, F: Real, E: Emission<F>, const B: usize> PolynomialResidual<'p, 'c, 'a, F, E, B> {
    /// Of the solution v and its [moments](Polynomials::residual_moments).
    ///
    /// # Errors
    /// [`CircleError::Length`].
    pub fn new(
        polynomials: &'p Polynomials<'c, 'a, F, E, B>,
        solution: &'p [F],
        moments: &'p [Moment<F>],
    ) -> Result<Self, CircleError> {
        let n = polynomials.circle.table().len();
        for (expected, found) in [(n * B, solution.len()), (n, moments.len())] {
            if expected != found {
                return Err(CircleError::Length { expected, found });
            }
        }
        Ok(Self {
            polynomials,
            solution,
            moments,
        })
    }

    #[inline]
    fn own(&self, cell: usize) -> [F; B] {
        let own = self.solution.get(cell * B..).and_then(<[F]>::first_chunk);
        own.copied().unwrap_or([F::NAN; B])
    }
}

impl<F: Real, E, const B: usize> StateSpace for PolynomialResidual<'_, '_, '_, F, E, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, E: Emission<F>, const B: usize> Neighbour
    for PolynomialResidual<'_, '_, '_, F, E, B>
{
    #[inline]
    fn locate(&self, x: Point<F>) -> Located<Point<F>> {
        Located {
            point: x,
            cell: x.cell(),
        }
    }
    #[inline]
    fn kernel(&self, _: &Located<Point<F>>, _: &Located<Point<F>>, k: F) -> F {
        k
    }
    fn source(&self, x: &Located<Point<F>>) -> F {
        let problem = self.polynomials;
        let Some(moment) = self.moments.get(x.cell) else {
            return F::NAN;
        };
        let v = self.own(x.cell);
        let tau = problem.coordinate(&x.point, x.cell);
        let others = problem.root * moment.turn_from(&x.point);
        let reflected =
            problem.circle.reflectance(x.cell) * (others + dot(&v, &problem.own_cell(tau)));
        dot(&v, &legendre(tau)) - reflected
    }
    #[inline]
    fn value(&self, x: &Located<Point<F>>) -> F {
        dot(&self.own(x.cell), &self.polynomials.basis(x))
    }
}

fn dot<F: Real, const B: usize>(a: &[F; B], b: &[F; B]) -> F {
    let products = a.iter().zip(b).map(|(&a, &b)| a * b);
    products.fold(F::zero(), |sum, x| sum + x)
}

/// The matrix with these entries.
fn matrix<F, const B: usize>(entry: impl Fn(usize, usize) -> F) -> [[F; B]; B] {
    core::array::from_fn(|b| core::array::from_fn(|c| entry(b, c)))
}

/// The series of asin(z)/A in z, z³, z⁵, …
fn arcsine(quarter: f64) -> [f64; TERMS] {
    let mut coefficient = 1.0;
    core::array::from_fn(|k| {
        let power = 2.0 * k as f64;
        let value = coefficient / ((power + 1.0) * quarter);
        coefficient *= (power + 1.0) / (power + 2.0);
        value
    })
}

/// The number of terms of the arcsine's series that are not below 10⁻¹⁷ of the first.
fn arcsine_terms(quarter: f64) -> usize {
    let mut terms = 1;
    let mut power = quarter * quarter;
    while terms < TERMS && power > 1e-17 {
        power *= quarter * quarter;
        terms += 1;
    }
    terms
}

/// (A/2) I_b(τ) with I_b(τ) = ∫ ψ_b(t) |sin A(t − τ)| dt as power series in τ, each in powers of its own
/// parity. They come from I'' = −A² I + 2A ψ_b(τ), and from I(0) or I'(0) by quadrature.
fn own_integrals<const B: usize>(quarter: f64) -> [[f64; TERMS]; B] {
    core::array::from_fn(|b| {
        let half = |weight: fn(f64) -> f64| {
            let product = |t| legendre::<f64, B>(t)[b] * weight(quarter * t);
            2.0 * integrate(0.0, 1.0, product)
        };
        let first = if b.is_multiple_of(2) {
            half(Real::sin)
        } else {
            -quarter * half(Real::cos)
        };
        let psi = powers(b);
        let mut next = 0.5 * quarter * first;
        core::array::from_fn(|k| {
            let value = next;
            let power = (2 * k + b % 2) as f64;
            let own = psi.get(k).copied().unwrap_or(0.0);
            next = (quarter * quarter * own - quarter * quarter * value)
                / ((power + 1.0) * (power + 2.0));
            value
        })
    })
}

/// ψ_b(t) in powers of t of its own parity.
fn powers(b: usize) -> [f64; TERMS] {
    let mut out = [0.0; TERMS];
    // (−1)^k (2b − 2k)!/(2^b k! (b − k)! (b − 2k)!) belongs to t^(b − 2k).
    let mut coefficient = Real::sqrt(2.0 * b as f64 + 1.0);
    for i in 0..b {
        coefficient *= (2 * i + 1) as f64 / (i + 1) as f64;
    }
    for k in 0..=b / 2 {
        if let Some(out) = out.get_mut(b / 2 - k) {
            *out = coefficient;
        }
        let (left, b, k) = ((b - 2 * k) as f64, b as f64, k as f64);
        coefficient *= -left * (left - 1.0) / (2.0 * (k + 1.0) * (2.0 * b - 2.0 * k - 1.0));
    }
    out
}

/// The number of terms without which the sums would not be the same to 10⁻¹⁸ of the first function's.
fn terms<const B: usize>(own: &[[f64; TERMS]; B]) -> usize {
    let largest = own.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
    let counts = |k: &usize| own.iter().any(|row| row[*k].abs() > 1e-18 * largest);
    (0..TERMS).rev().find(counts).map_or(TERMS, |k| k + 1)
}

/// Σ_k c_k τ^(2k), times τ for odd b.
#[inline]
fn series<F: Real>(coefficients: &[F; TERMS], terms: usize, b: usize, tau: F) -> F {
    let square = tau * tau;
    let sum = coefficients.iter().take(terms).rev();
    let sum = sum.fold(F::zero(), |sum, &c| sum * square + c);
    if b.is_multiple_of(2) { sum } else { tau * sum }
}

impl<F: Real, E, const B: usize> StateSpace for Polynomials<'_, '_, F, E, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, E: Emission<F>, const B: usize> Sampler for Polynomials<'_, '_, F, E, B> {
    #[inline]
    fn absorption(&self, x: &Point<F>) -> F {
        self.circle.absorption(x)
    }
    #[inline]
    fn step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> Option<Point<F>> {
        self.circle.step(x, uniforms)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> TransitionDensity for Polynomials<'_, '_, F, E, B> {
    fn density(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.circle.density(x, y)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Kernel for Polynomials<'_, '_, F, E, B> {
    #[inline]
    fn kernel(&self, x: &Point<F>, y: &Point<F>) -> F {
        self.circle.kernel(x, y)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Source for Polynomials<'_, '_, F, E, B> {
    #[inline]
    fn source(&self, x: &Point<F>) -> F {
        self.circle.source(x)
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Partition for Polynomials<'_, '_, F, E, B> {
    fn cells(&self) -> usize {
        self.circle.table().len()
    }
    #[inline]
    fn locate(&self, x: &Point<F>) -> usize {
        x.cell()
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Basis<B> for Polynomials<'_, '_, F, E, B> {
    #[inline]
    fn basis(&self, x: &Located<Point<F>>) -> [F; B] {
        legendre(self.coordinate(&x.point, x.cell))
    }
}

impl<F: Real, E: Emission<F>, const B: usize> TransitionMoments<B>
    for Polynomials<'_, '_, F, E, B>
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

impl<F: Real, E: Emission<F>, const B: usize> PairIntegral<B> for Polynomials<'_, '_, F, E, B> {
    #[inline]
    fn pair_integral(&self, x: &Located<Point<F>>, j: usize) -> [F; B] {
        if j == x.cell {
            let reflectance = self.circle.reflectance(j);
            let own = self.own_cell(self.coordinate(&x.point, j));
            return own.map(|integral| reflectance * integral);
        }
        let (sine, cosine) = (self.circle.sine(&x.point, j), self.signed_cosine(x, j));
        let weight = self.circle.weight(x.cell);
        // Against ψ_0 = 1.
        let [even, odd] = [self.even, self.odd].map(|m| m.first().copied().unwrap_or([F::NAN; B]));
        core::array::from_fn(|b| weight * (sine * even[b] + cosine * odd[b]))
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Coefficients<B> for Polynomials<'_, '_, F, E, B> {
    /// As a product of two vectors.
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let cells = self.circle.table();
        let (Some(from), Some(to)) = (cells.get(i), cells.get(j)) else {
            return [F::NAN; B];
        };
        if i == j {
            return core::array::from_fn(|b| {
                let rows = left.iter().zip(&self.diagonal);
                let products = rows.map(|(&l, row)| l * (from.reflectance * row[b]));
                products.fold(F::zero(), |sum, x| sum + x)
            });
        }
        let sine = to.middle.rough_sine(&from.middle);
        let cosine = to.middle.cosine(&from.middle);
        let cosine = if j > i { cosine } else { -cosine };
        // Σ_a left_a f_a sin(m − aπ/2) and its derivative: i^(−a) is the conjugate of i^a.
        let [re, im] = self.amplitude(left);
        let value = from.reflectance * (re * sine - im * cosine);
        let slope = from.reflectance * (re * cosine + im * sine);
        let mut b = 0;
        self.factors.map(|f| {
            let phase = match b % 4 {
                0 => value,
                1 => slope,
                2 => -value,
                _ => -slope,
            };
            b += 1;
            f * phase
        })
    }
}

impl<F: Real, E: Emission<F>, const B: usize> GalerkinMatrix for Polynomials<'_, '_, F, E, B> {
    type Scalar = F;

    fn cells(&self) -> usize {
        self.circle.table().len()
    }

    fn functions(&self) -> usize {
        B
    }

    fn entry(&self, [i, a]: [usize; 2], [j, b]: [usize; 2]) -> F {
        let cells = self.circle.table();
        let (Some(from), Some(to)) = (cells.get(i), cells.get(j)) else {
            return F::NAN;
        };
        let (Some(&left), Some(&right)) = (self.factors.get(a), self.factors.get(b)) else {
            return F::NAN;
        };
        if i == j {
            let own = self.diagonal.get(a).and_then(|row| row.get(b));
            return from.reflectance * own.copied().unwrap_or(F::NAN);
        }
        let sine = to.middle.rough_sine(&from.middle);
        let cosine = to.middle.cosine(&from.middle);
        let cosine = if j > i { cosine } else { -cosine };
        // ± sin((m_j − m_i)/2 + kπ/2) for k = b − a modulo 4.
        let phase = match (b + 4 * B - a) % 4 {
            0 => sine,
            1 => cosine,
            2 => -sine,
            _ => -cosine,
        };
        from.reflectance * left * right * phase
    }

    /// Σ_j K'_(i0)(j0) = ρ_i: the circle is closed.
    fn row_sum(&self, i: usize) -> F {
        self.circle.reflectance(i)
    }

    /// O(nB) by running sums, as with piecewise constants.
    fn apply(&self, v: &[F], out: &mut [F]) {
        let cells = self.circle.table();
        let mut after = Sum::default();
        for (v, cell) in v.chunks_exact(B).zip(cells.iter()) {
            self.add(&mut after, &cell.middle, v);
        }
        let mut before = Sum::default();
        let rows = out.chunks_exact_mut(B).zip(v.chunks_exact(B));
        for (i, ((out, v), cell)) in rows.zip(cells.iter()).enumerate() {
            self.add(&mut after, &cell.middle, &negated::<F, B>(v));
            let others = self.others(i, [&before, &after], &cell.middle);
            let own = self.diagonal_times(i, v);
            for ((out, other), own) in out.iter_mut().zip(others).zip(own) {
                *out = other + own;
            }
            self.add(&mut before, &cell.middle, v);
        }
    }

    /// Gauss–Seidel between cells, a plain step within one.
    fn scratch(&self) -> usize {
        0
    }

    fn sweep(&self, source: &[F], v: &mut [F], _: &mut [F]) -> F {
        let cells = self.circle.table();
        let mut after = Sum::default();
        for (v, cell) in v.chunks_exact(B).zip(cells.iter()) {
            self.add(&mut after, &cell.middle, v);
        }
        let mut before = Sum::default();
        let mut largest = F::zero();
        let rows = v.chunks_exact_mut(B).zip(source.chunks_exact(B));
        for (i, ((v, source), cell)) in rows.zip(cells.iter()).enumerate() {
            self.add(&mut after, &cell.middle, &negated::<F, B>(v));
            let others = self.others(i, [&before, &after], &cell.middle);
            let own = self.diagonal_times(i, v);
            for (((v, &source), other), own) in v.iter_mut().zip(source).zip(others).zip(own) {
                let residual = source + other + own - *v;
                // Written so that NaN stays.
                if !(residual.abs() <= largest) && !largest.is_nan() {
                    largest = residual.abs();
                }
                *v += residual;
            }
            self.add(&mut before, &cell.middle, v);
        }
        largest
    }
}

fn negated<F: Real, const B: usize>(v: &[F]) -> [F; B] {
    let mut v = v.iter();
    core::array::from_fn(|_| v.next().map_or(F::NAN, |&v| -v))
}
