//! The Galerkin system of piecewise polynomials, in closed form.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;

use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Coefficients, GalerkinError, GalerkinMatrix, legendre};
#[cfg(feature = "alloc")]
use fredholm_core::galerkin::{Solution, buffer};
use fredholm_core::{Real, Value};

use crate::geometry::Geometry;
use crate::quadrature::nodes;
use crate::residual::Sum;
use crate::{Cell, Circle, Direction, Emission, MOST_FUNCTIONS, Moment, Point, Tables};

/// Pieces of every cell in a quadrature, of 16 Gauss points each: enough for light that varies on a circle of one cell.
const PIECES: usize = 16;

/// The system (41) of a circle with B polynomials on every cell, in one channel: source, coefficients and solution.
///
/// With A = π/2n, and f_b = √A √(2b + 1) j_b(A) of the spherical Bessel functions j_b,
///
/// ```text
/// K'_(ia)(jb) = ± ρ_i f_a f_b sin((m_j − m_i)/2 + (b − a)π/2)    i ≠ j, + for j behind i
/// ```
///
/// from ∫ P_b(t) sin(a + At) dt = 2 j_b(A) sin(a + bπ/2). Separable on either side of the diagonal, K'v costs O(nB). Of
/// piecewise constants K_ij = ρ_i (2n/π) sin² A |sin((m_j − m_i)/2)|, and K_ii = ρ_i (1 − sin(π/n)/(π/n)).
#[derive(Debug)]
pub struct GalerkinSystem<'c, T, E> {
    tables: &'c T,
    emission: &'c E,
    functions: usize,
    channel: usize,
}

impl<T: Tables, E> Circle<T, E> {
    /// The Galerkin system with B polynomials on every cell, of degree B − 1, in the first channel.
    #[must_use]
    pub const fn system<const B: usize>(&self) -> GalerkinSystem<'_, T, E> {
        const {
            assert!(
                B > 0 && B <= MOST_FUNCTIONS,
                "polynomials have degree 6 at most"
            );
        }
        GalerkinSystem::new(self.tables(), self.emission(), B)
    }
}

impl<'c, T: Tables, E> GalerkinSystem<'c, T, E> {
    pub(crate) const fn new(tables: &'c T, emission: &'c E, functions: usize) -> Self {
        Self {
            tables,
            emission,
            functions,
            channel: 0,
        }
    }

    /// The system in another channel.
    #[must_use]
    pub const fn channel(self, channel: usize) -> Self {
        Self { channel, ..self }
    }

    /// Fills the moments of the solution `v`, by which a [`Residual`](crate::Residual) sums T_K v.
    ///
    /// # Errors
    /// [`GalerkinError::Length`] unless `v` has n·B entries and `out` n.
    pub fn moments(
        &self,
        v: &[T::Scalar],
        out: &mut [Moment<T::Scalar>],
    ) -> Result<(), GalerkinError> {
        self.check(v.len(), self.functions)?;
        self.check(out.len(), 1)?;
        self.visit(v, |i, before, after| {
            if let Some(out) = out.get_mut(i) {
                *out = Moment::between(before, after);
            }
        });
        Ok(())
    }

    fn check(&self, found: usize, per_cell: usize) -> Result<(), GalerkinError> {
        let expected = self.cells().len() * per_cell;
        if found == expected {
            Ok(())
        } else {
            Err(GalerkinError::Length { expected, found })
        }
    }

    fn cells(&self) -> &[Cell<T::Scalar, T::Value>] {
        self.tables.cells()
    }

    fn reflectance(&self, i: usize) -> T::Scalar {
        self.tables.reflectance(i).get(self.channel)
    }

    /// B, as the compiler cannot know that it is not 0.
    fn per_cell(&self) -> usize {
        self.functions.max(1)
    }

    /// f_b for b < B.
    fn factors(&self) -> &[T::Scalar] {
        let factors = &self.tables.constants().factors;
        factors.get(..self.functions).unwrap_or(factors)
    }

    /// Shows every cell with the sums of what is sent by the cells before it and behind it.
    fn visit(
        &self,
        v: &[T::Scalar],
        mut visit: impl FnMut(usize, &Sum<T::Scalar>, &Sum<T::Scalar>),
    ) {
        let mut after = Sum::default();
        let sent = |v| amplitude(self.factors(), v);
        let all = || v.chunks_exact(self.per_cell()).zip(self.cells());
        for (v, cell) in all() {
            after.add(&cell.middle, sent(v));
        }
        let mut before = Sum::default();
        for (i, (v, cell)) in all().enumerate() {
            let sent = sent(v);
            after.add(&cell.middle, sent.each(|part| -part));
            visit(i, &before, &after);
            before.add(&cell.middle, sent);
        }
    }

    /// (K'v)_ia for all a < B, from what the other cells send and the unknowns of its own.
    fn row(
        &self,
        i: usize,
        [before, after]: [&Sum<T::Scalar>; 2],
        v: &[T::Scalar],
    ) -> impl Iterator<Item = T::Scalar> {
        let middle = self
            .tables
            .cell(i)
            .map_or_else(Direction::default, |cell| cell.middle);
        let reflectance = self.reflectance(i);
        // Σ_{j>i} − Σ_{j<i} of Im and Re of what they send.
        let im = before.turn_to(&middle) - after.turn_to(&middle);
        let re = if self.functions > 1 {
            let turned = middle.turned();
            after.turn_to(&turned) - before.turn_to(&turned)
        } else {
            im
        };
        let rows = self.tables.constants().diagonal.iter();
        self.factors()
            .iter()
            .zip(rows)
            .enumerate()
            .map(move |(a, (&f, row))| {
                let part = rotated(a, [im, -re]);
                let own = row.iter().zip(v).map(|(&k, &v)| k * v);
                reflectance * own.fold(f * part, |sum, product| sum + product)
            })
    }
}

/// The entry of an even number k of quarter turns, or of an odd one, with its sign: x, y, −x, −y of k = 0, 1, 2, 3.
#[inline(always)]
fn rotated<F: Real>(quarters: usize, [even, odd]: [F; 2]) -> F {
    match quarters % 4 {
        0 => even,
        1 => odd,
        2 => -even,
        _ => -odd,
    }
}

/// What a cell with these unknowns sends, Σ_b f_b i^b v_b, as real and imaginary part of a multiple of exp(i m_j/2).
#[inline(always)]
fn amplitude<F: Real>(factors: &[F], v: &[F]) -> [F; 2] {
    let mut sums = [F::zero(); 2];
    for (b, (&f, &v)) in factors.iter().zip(v).enumerate() {
        let term = rotated(b - b % 2, [f * v; 2]);
        sums[b % 2] += term;
    }
    sums
}

impl<T: Tables, E: Emission<T::Scalar, T::Value>> GalerkinSystem<'_, T, E> {
    /// F'_ia for every cell and a < B, (40), n·B numbers, by Gauss points.
    ///
    /// # Errors
    /// [`GalerkinError::Length`].
    pub fn source_means(&self, out: &mut [T::Scalar]) -> Result<(), GalerkinError> {
        self.check(out.len(), self.functions)?;
        out.fill(T::Scalar::default());
        let quarter = self.tables.constants().quarter.to_f64();
        let pieces = PIECES.div_ceil(self.cells().len());
        for (t, weight) in (0..pieces).flat_map(|piece| nodes(piece, pieces)) {
            let [cos, sin] =
                [Real::cos(quarter * t), Real::sin(quarter * t)].each(T::Scalar::from_f64);
            let psi: [f64; MOST_FUNCTIONS] = legendre(t);
            let psi = psi.each(|psi| T::Scalar::from_f64(0.5 * weight * psi));
            let rows = out.chunks_exact_mut(self.per_cell());
            for (i, (out, cell)) in rows.zip(self.cells()).enumerate() {
                let Direction { cos: c, sin: s, .. } = cell.middle;
                let x = Point::new(c * cos - s * sin, s * cos + c * sin, i);
                let source = self.emission.emission(&x, &cell.reflectance);
                for (out, psi) in out.iter_mut().zip(psi) {
                    *out += psi * source.get(self.channel);
                }
            }
        }
        Ok(())
    }
}

#[cfg(feature = "alloc")]
impl<T: Tables<Scalar = f64>, E: Emission<f64, T::Value>> GalerkinSystem<'_, T, E> {
    /// The Galerkin solution: solves (41) by Gauss–Seidel sweeps until no residual is above `tolerance`
    /// times the largest |F'_ia|, at most `at_most` sweeps.
    ///
    /// # Errors
    /// As [`Solution::new`].
    pub fn solve(&self, tolerance: f64, at_most: u32) -> Result<Solution, GalerkinError> {
        let mut source = buffer(self.cells().len() * self.functions)?;
        self.source_means(&mut source)?;
        Solution::new(self, source, tolerance, at_most)
    }

    /// The moments for a [`Residual`](crate::Residual) in the walk's scalar, from v as rounded to it.
    ///
    /// # Errors
    /// [`GalerkinError::Length`]: the solution has another number of unknowns; [`GalerkinError::Memory`].
    pub fn residual_moments<F: Real>(
        &self,
        solution: &Solution,
    ) -> Result<Vec<Moment<F>>, GalerkinError> {
        let mut wide = buffer(self.cells().len())?;
        self.moments(&solution.rounded_through::<F>()?, &mut wide)?;
        let mut out = buffer(wide.len())?;
        for (out, wide) in out.iter_mut().zip(&wide) {
            *out = wide.cast();
        }
        Ok(out)
    }
}

impl<T: Tables, E> GalerkinMatrix for GalerkinSystem<'_, T, E> {
    type Scalar = T::Scalar;

    fn cells(&self) -> usize {
        self.cells().len()
    }

    fn functions(&self) -> usize {
        self.functions
    }

    fn entry(&self, [i, a]: [usize; 2], [j, b]: [usize; 2]) -> T::Scalar {
        let constants = self.tables.constants();
        let (Some(from), Some(to)) = (self.cells().get(i), self.cells().get(j)) else {
            return T::Scalar::NAN;
        };
        let (Some(&left), Some(&right)) = (self.factors().get(a), self.factors().get(b)) else {
            return T::Scalar::NAN;
        };
        if i == j {
            let own = constants.diagonal.get(a).and_then(|row| row.get(b));
            return self.reflectance(i) * own.copied().unwrap_or(T::Scalar::NAN);
        }
        // ± sin((m_j − m_i)/2 + kπ/2) for k = b − a = b + 3a modulo 4.
        let phases = phases(from, to, j > i);
        self.reflectance(i) * left * right * rotated(b + 3 * a, phases)
    }

    /// Σ_j K'_(i0)(j0) = ρ_i: the circle is closed.
    fn row_sum(&self, i: usize) -> T::Scalar {
        self.reflectance(i)
    }

    /// O(nB): running sums serve every row.
    fn apply(&self, v: &[T::Scalar], out: &mut [T::Scalar]) {
        let mut rows = v
            .chunks_exact(self.per_cell())
            .zip(out.chunks_exact_mut(self.per_cell()));
        self.visit(v, |i, before, after| {
            if let Some((v, out)) = rows.next() {
                for (out, row) in out.iter_mut().zip(self.row(i, [before, after], v)) {
                    *out = row;
                }
            }
        });
    }

    fn scratch(&self) -> usize {
        0
    }

    /// Gauss–Seidel between cells and for the means of cells, a plain step for what else is within one.
    fn sweep(&self, source: &[T::Scalar], v: &mut [T::Scalar], _: &mut [T::Scalar]) -> T::Scalar {
        let mut after = Sum::default();
        let sent = |v: &[T::Scalar]| amplitude(self.factors(), v);
        for (v, cell) in v.chunks_exact(self.per_cell()).zip(self.cells()) {
            after.add(&cell.middle, sent(v));
        }
        let (mut before, mut largest) = (Sum::default(), T::Scalar::default());
        let [[first, ..], ..] = self.tables.constants().diagonal;
        let rows = v
            .chunks_exact_mut(self.per_cell())
            .zip(source.chunks_exact(self.per_cell()));
        for (i, ((v, source), cell)) in rows.zip(self.cells()).enumerate() {
            after.add(&cell.middle, sent(v).each(|part| -part));
            let mut residuals = [T::Scalar::default(); MOST_FUNCTIONS];
            let of_rows = self.row(i, [&before, &after], v).zip(source).zip(&*v);
            for (residual, ((row, &source), &v)) in residuals.iter_mut().zip(of_rows) {
                *residual = source + row - v;
                // Written so that NaN stays.
                if !(residual.abs() <= largest) && !largest.is_nan() {
                    largest = residual.abs();
                }
            }
            residuals[0] /= T::Scalar::from_u32(1) - self.reflectance(i) * first;
            for (v, residual) in v.iter_mut().zip(residuals) {
                *v += residual;
            }
            before.add(&cell.middle, sent(v));
        }
        largest
    }
}

/// sin((m_j − m_i)/2) and cos, both with the sign of j − i.
#[inline]
fn phases<F: Real, V>(from: &Cell<F, V>, to: &Cell<F, V>, is_behind: bool) -> [F; 2] {
    let from = (from.middle.cos, from.middle.sin);
    let (sine, cosine) = (to.middle.rough_sine(from).abs(), to.middle.cosine(from));
    [sine, if is_behind { cosine } else { -cosine }]
}

impl<T: Tables, E, const B: usize> Coefficients<B> for GalerkinSystem<'_, T, E> {
    /// Takes the product of two vectors: a block has rank one or two.
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[T::Scalar; B]) -> [T::Scalar; B] {
        const { assert!(B <= MOST_FUNCTIONS, "polynomials have degree 6 at most") }
        let constants = self.tables.constants();
        let (Some(from), Some(to)) = (self.cells().get(i), self.cells().get(j)) else {
            return [T::Scalar::NAN; B];
        };
        let reflectance = from.reflectance.get(self.channel);
        if const { B == 1 } {
            let ([f, ..], [[own, ..], ..]) = (constants.factors, constants.diagonal);
            let others = || {
                f * f
                    * to.middle
                        .rough_sine((from.middle.cos, from.middle.sin))
                        .abs()
            };
            let entry = if i == j { own } else { others() };
            return left.each(|left| left * (reflectance * entry));
        }
        if i == j {
            return from_fn(|b| {
                let rows = left.iter().zip(&constants.diagonal);
                let products = rows.map(|(&l, row)| l * (reflectance * row[b]));
                products.fold(T::Scalar::default(), |sum, x| sum + x)
            });
        }
        let [sine, cosine] = phases(from, to, j > i);
        // Σ_a left_a f_a sin(m − aπ/2) and its derivative: i^(−a) is the conjugate of i^a.
        let [re, im] = amplitude(&constants.factors, left);
        let value = reflectance * (re * sine - im * cosine);
        let slope = reflectance * (re * cosine + im * sine);
        from_fn(|b| constants.factors[b] * rotated(b, [value, slope]))
    }
}
