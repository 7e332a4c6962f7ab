//! Galerkin coefficients of piecewise polynomials in closed form.

use fredholm_core::Real;
use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{Coefficients, GalerkinMatrix};

use crate::cells::Direction;
use crate::residual::Sum;
use crate::{ClosedForm, Emission, PolynomialCircle};

impl<F: Real, E: Emission<F>, const B: usize> PolynomialCircle<'_, '_, F, E, B> {
    /// (K'v)_ia of the cells off the diagonal from their sums before and behind cell i.
    #[inline]
    fn others(&self, i: usize, [before, after]: [&Sum<F>; 2], middle: &Direction<F>) -> [F; B] {
        let turned = middle.turned();
        // Σ_{j>i} − Σ_{j<i} of Im and Re of what they send.
        let im = before.turn_to(middle) - after.turn_to(middle);
        let re = after.turn_to(&turned) - before.turn_to(&turned);
        let reflectance = self.circle.reflectance(i);
        let mut a = 0;
        self.factors.each(|f| {
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
        self.diagonal.each(|row| {
            let products = row.iter().zip(v).map(|(&k, &v)| k * v);
            reflectance * products.fold(F::zero(), |sum, x| sum + x)
        })
    }
}

impl<F: Real, E: Emission<F>, const B: usize> Coefficients<B>
    for PolynomialCircle<'_, '_, F, E, B>
{
    /// Takes the product of two vectors: a block has rank one or two.
    #[inline]
    fn left_times_block(&self, i: usize, j: usize, left: &[F; B]) -> [F; B] {
        let cells = self.circle.table();
        let (Some(from), Some(to)) = (cells.get(i), cells.get(j)) else {
            return [F::NAN; B];
        };
        if i == j {
            return from_fn(|b| {
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
        self.factors.each(|f| {
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

impl<F: Real, E: Emission<F>, const B: usize> GalerkinMatrix for PolynomialCircle<'_, '_, F, E, B> {
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
    from_fn(|_| v.next().map_or(F::NAN, |&v| -v))
}
