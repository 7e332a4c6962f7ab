//! The walk: what a point of a stratum scores.

use super::{MOST_FUNCTIONS, MOST_SCORED, Regular};
use crate::galerkin::{MOST_DIMENSIONS, fill_products};
use crate::{Located, Real, Uniforms};

/// The most steps of a walk: where the estimate has a mean one of so many has never been met.
const MOST_STEPS: u32 = 1 << 20;

/// The numbers of a solved equation, wherever they lie: n cells with B functions on each, N = nB.
#[derive(Clone, Copy, Debug)]
pub struct ResolventTables<'a> {
    /// B.
    pub functions: usize,
    /// μ(X_i).
    pub measures: &'a [f64],
    /// Â = K' M⁻¹, N × N numbers row by row.
    pub kernel: &'a [f64],
    /// R̂ = R' M⁻¹, N × N numbers.
    pub resolvent: &'a [f64],
    /// F', N numbers.
    pub source: &'a [f64],
    /// R' F', N numbers.
    pub correction: &'a [f64],
    /// For every cell of a step the probabilities of the cells into which it leads, each with all before it: n × n numbers.
    pub steps: &'a [f64],
    /// The importance ρ_j of staying in a cell.
    pub stays: &'a [f64],
    /// For every cell the importances of the cells to which the resolvent leads, each with all before it: n × n numbers.
    pub jumps: &'a [f64],
    /// For every cell how half of the points of a step within it draw near to its start, where K is singular or narrow at x = y: their
    /// distance is a uniform number to this power. 1: all are uniform on either side of the start, in one dimension, where K is not smooth
    /// at x = y; nets then see two smooth functions. 0: all are uniform in the cell.
    pub near: &'a [i32],
    /// Both ends of every axis of every cell, 2dn of them; or nothing: all points are uniform.
    pub ends: &'a [CellEnd],
}

/// How points of a cell draw near to an end of an axis, where K or F is singular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellEnd {
    /// The distance from the end is a uniform number to this power; 1: points are uniform.
    pub power: i32,
    /// The least distance that is told from 0, as a part of the cell.
    pub nearest: f64,
}

/// Point of a known cell, and the functions there.
#[derive(Clone, Copy, Debug)]
pub struct CellPoint<P> {
    /// The point.
    pub point: P,
    /// The number of its cell.
    pub cell: usize,
    /// The parameters of the point in its cell, and zeros.
    pub parameters: [f64; MOST_DIMENSIONS],
    /// ψ_0 … ψ_(B−1) in the point, and zeros.
    pub functions: [f64; MOST_FUNCTIONS],
}

/// Part of the integrals of one or of all targets.
#[derive(Clone, Copy, Debug)]
pub enum Stratum<'a, P> {
    /// ∫∫ ψ_a(z) D(z, y) u(y) over a pair of cells, for every function of the first.
    Pair {
        /// The cell of z.
        from: usize,
        /// The cell of y.
        into: usize,
        /// The size of the coefficients of cell `from`, with which roulette is played.
        size: f64,
    },
    /// ∫ ψ_a(z) r₀(z) over a cell, for every function.
    Source {
        /// The cell.
        cell: usize,
    },
    /// ∫ D(x, y) u(y) over a cell, from a point.
    FromPoint {
        /// The point x.
        point: &'a CellPoint<P>,
        /// The cell of y.
        into: usize,
    },
    /// ∫ (Φ(x) − ψ(x)ᵀΦ̂) u(x) over a cell.
    Rest {
        /// What polynomials leave of Φ.
        density: RestDensity<'a, P>,
        /// The cell.
        cell: usize,
    },
}

/// What polynomials leave of a functional, as a density with respect to μ.
#[derive(Clone, Copy)]
pub struct RestDensity<'a, P>(pub &'a (dyn Fn(&CellPoint<P>) -> f64 + Sync));

impl<P> core::fmt::Debug for RestDensity<'_, P> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("RestDensity").finish_non_exhaustive()
    }
}

/// How a walk that goes on from a point of a stratum ends.
#[derive(Clone, Copy, Debug)]
pub struct Ending {
    /// The share of all samples that this stratum has.
    pub share: f64,
    /// τ, the standard deviation of a score that walks which go on may add.
    pub scale: f64,
}

/// What a walk met besides its score.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trace {
    /// |D(z, y)| of the first step.
    pub difference: f64,
    /// The number of steps beyond the first.
    pub steps: u64,
}

/// Solved equation whose walks know the resolvent of a neighbour equation.
#[derive(Clone, Copy, Debug)]
pub struct Resolvent<'a, E> {
    /// The equation.
    pub equation: &'a E,
    /// The numbers of the solved equation.
    pub tables: ResolventTables<'a>,
    /// Fewer cells by whose resolvent walks go on: then `resolvent`, `steps`, `stays` and `jumps` of the tables may be empty.
    pub coarse: Option<Coarse<'a, E>>,
}

/// Solved equation on fewer cells, by whose resolvent walks go on.
#[derive(Clone, Copy, Debug)]
pub struct Coarse<'a, E> {
    /// The equation on these cells.
    pub equation: &'a E,
    /// The numbers of the solved equation.
    pub tables: ResolventTables<'a>,
    /// What the difference on the finer cells is about, over that on these.
    pub share: f64,
}

/// ψᵀ c over the functions of a point.
#[inline]
fn dot(functions: &[f64; MOST_FUNCTIONS], own: &[f64]) -> f64 {
    own.iter().zip(functions).map(|(c, psi)| c * psi).sum()
}

impl<E: Regular> Resolvent<'_, E> {
    /// A point of whatever cell.
    pub fn locate(&self, point: E::Point) -> CellPoint<E::Point> {
        let cell = self.equation.locate(&point);
        let mut t = [E::Scalar::from_f64(0.0); MOST_DIMENSIONS];
        let own = t.get_mut(..self.equation.dimension()).unwrap_or(&mut []);
        self.equation.parameters(&Located { point, cell }, own);
        let t = t.map(Real::to_f64);
        self.located(
            cell,
            point,
            t.get(..self.equation.dimension()).unwrap_or(&[]),
        )
    }

    /// The point of a cell at these parameters.
    #[inline]
    pub fn at(&self, cell: usize, t: &[f64]) -> CellPoint<E::Point> {
        self.located(cell, self.equation.point(cell, t), t)
    }

    /// A point of a cell that has these parameters.
    #[inline]
    pub fn located(&self, cell: usize, point: E::Point, t: &[f64]) -> CellPoint<E::Point> {
        let mut functions = [0.0; MOST_FUNCTIONS];
        if self.tables.functions == 1 {
            functions[0] = 1.0;
        } else if let Some(own) = functions.get_mut(..self.tables.functions) {
            fill_products(t, own);
        }
        let mut parameters = [0.0; MOST_DIMENSIONS];
        parameters.iter_mut().zip(t).for_each(|(to, t)| *to = *t);
        CellPoint {
            point,
            cell,
            parameters,
            functions,
        }
    }

    /// Σ_a c_ia ψ_ia in a point.
    #[inline]
    pub fn series(&self, coefficients: &[f64], x: &CellPoint<E::Point>) -> f64 {
        let own = coefficients.chunks_exact(self.tables.functions).nth(x.cell);
        dot(&x.functions, own.unwrap_or(&[]))
    }

    /// ψ(x)ᵀ T ψ(y) of a table of N × N numbers.
    #[inline]
    fn form(&self, table: &[f64], x: &CellPoint<E::Point>, y: &CellPoint<E::Point>) -> f64 {
        let functions = self.tables.functions;
        let width = self.tables.source.len();
        let rows = table.get(x.cell * functions * width..).unwrap_or(&[]);
        let rows = rows.chunks_exact(width).zip(&x.functions).take(functions);
        let from = y.cell * functions;
        let terms = rows.map(|(row, psi)| {
            let own = row.get(from..from + functions).unwrap_or(&[]);
            psi * dot(&y.functions, own)
        });
        terms.sum()
    }

    /// D = K − K_n.
    #[inline]
    pub fn difference(&self, x: &CellPoint<E::Point>, y: &CellPoint<E::Point>) -> f64 {
        let k = self.equation.kernel(&x.point, &y.point).to_f64();
        k - self.form(self.tables.kernel, x, y)
    }

    /// g = F + ψᵀ R' F'.
    #[inline]
    pub fn value(&self, x: &CellPoint<E::Point>) -> f64 {
        let source = self.equation.source(&x.point).to_f64();
        source + self.series(self.tables.correction, x)
    }

    /// r₀ = F − ψᵀ F'.
    #[inline]
    pub fn rest_of_source(&self, x: &CellPoint<E::Point>) -> f64 {
        let source = self.equation.source(&x.point).to_f64();
        source - self.series(self.tables.source, x)
    }

    fn measure(&self, cell: usize) -> f64 {
        self.tables.measures.get(cell).copied().unwrap_or(f64::NAN)
    }

    /// Adds a factor times the score of one point of a stratum, whose coordinates are drawn first: the mean over the stratum is
    /// the integral. `scores` has a number for every function of the first cell, which may be of a higher degree than those of the tables, or
    /// one.
    #[inline]
    pub fn score<U: Uniforms<f64>>(
        &self,
        stratum: &Stratum<'_, E::Point>,
        (ending, factor): (&Ending, f64),
        draws: &mut U,
        scores: &mut [f64],
    ) -> Trace {
        let mut trace = Trace::default();
        let one = |score: f64, scores: &mut [f64]| {
            scores
                .iter_mut()
                .take(1)
                .for_each(|to| *to += factor * score);
        };
        match *stratum {
            Stratum::Source { cell } => {
                let (z, share) = self.draw(cell, draws);
                let score = factor * self.measure(cell) * share * self.rest_of_source(&z);
                self.add(&z, score, scores);
            }
            Stratum::Rest { density, cell } => {
                let (x, share) = self.draw(cell, draws);
                let weight = self.measure(cell) * share * density.0(&x);
                let value = weight * self.value(&x);
                one(
                    value + self.go_on(weight, x, ending, draws, &mut trace.steps),
                    scores,
                );
            }
            Stratum::FromPoint { point, into } => {
                let score = self.step(1.0, point, into, ending, draws, &mut trace);
                one(score, scores);
            }
            Stratum::Pair { from, into, size } => {
                let (z, share) = self.draw(from, draws);
                let weight = size * self.measure(from) * share;
                let score = self.step(weight, &z, into, ending, draws, &mut trace);
                trace.difference *= share;
                self.add(&z, factor * score / size, scores);
            }
        }
        trace
    }

    /// Adds a score times every function in a point.
    #[inline]
    fn add(&self, z: &CellPoint<E::Point>, score: f64, scores: &mut [f64]) {
        if scores.len() == self.tables.functions {
            for (to, psi) in scores.iter_mut().zip(&z.functions) {
                *to += score * psi;
            }
            return;
        }
        let mut functions = [0.0; MOST_SCORED];
        let own = functions.get_mut(..scores.len()).unwrap_or(&mut []);
        let t = z.parameters.get(..self.equation.dimension()).unwrap_or(&[]);
        fill_products(t, own);
        for (to, psi) in scores.iter_mut().zip(own) {
            *to += score * *psi;
        }
    }

    /// An estimate of W (T_D u)(z) over a cell.
    #[inline]
    fn step<U: Uniforms<f64>>(
        &self,
        weight: f64,
        z: &CellPoint<E::Point>,
        into: usize,
        ending: &Ending,
        draws: &mut U,
        trace: &mut Trace,
    ) -> f64 {
        let (y, share) = self.draw_from(z, into, draws);
        let difference = self.difference(z, &y);
        trace.difference = difference.abs() * share;
        let weight = weight * self.measure(into) * share * difference;
        let value = weight * self.value(&y);
        value + self.go_on(weight, y, ending, draws, &mut trace.steps)
    }

    /// A point of a cell, uniform but for its [ends](ResolventTables::ends), and the share of the cell that it stands for over that of a uniform one.
    #[inline]
    pub(super) fn draw<U: Uniforms<f64>>(
        &self,
        cell: usize,
        draws: &mut U,
    ) -> (CellPoint<E::Point>, f64) {
        let mut t = [0.0; MOST_DIMENSIONS];
        let own = t.get_mut(..self.equation.dimension()).unwrap_or(&mut []);
        for t in own.iter_mut() {
            *t = draws.uniform();
        }
        let mut share = 1.0;
        for (t, ends) in own.iter_mut().zip(self.ends_of(cell).chunks_exact(2)) {
            share *= towards_ends(t, ends);
        }
        (self.at(cell, own), share)
    }

    /// Whether points of a cell draw near to one of its ends.
    pub(super) fn has_ends(&self, cell: usize) -> bool {
        self.ends_of(cell).iter().any(|end| end.power > 1)
    }

    /// The ends of a cell, or nothing.
    pub(super) fn ends_of(&self, cell: usize) -> &[CellEnd] {
        let width = 2 * self.equation.dimension();
        let own = self.tables.ends.get(cell * width..(cell + 1) * width);
        own.unwrap_or(&[])
    }

    /// A point of a cell to which a step leads from z, and the share of the cell that it stands for over that of a uniform one.
    #[inline]
    pub(super) fn draw_from<U: Uniforms<f64>>(
        &self,
        z: &CellPoint<E::Point>,
        into: usize,
        draws: &mut U,
    ) -> (CellPoint<E::Point>, f64) {
        let power = |cell: usize| self.tables.near.get(cell).copied().unwrap_or(0);
        let [from, to] = [z.cell, into].map(|cell| self.equation.place(cell));
        let is_next = self.equation.dimension() == 1 && from.abs_diff(to) == 1;
        let power = match from == to || is_next {
            true => power(into).max(power(z.cell)),
            false => 0,
        };
        if power < if is_next || self.has_ends(into) { 2 } else { 1 } {
            return self.draw(into, draws);
        }
        self.draw_near(z, into, power, draws)
    }

    /// A point of a cell at the place of z, or, in one dimension, at the next one, with its share: half of them are uniform, and the distance of the
    /// others from z, or from the common end, is a uniform number to a power. Cells of one dimension that are next to each other
    /// have numbers that are; where they have others, half of the points are uniform nevertheless.
    pub(super) fn draw_near<U: Uniforms<f64>>(
        &self,
        z: &CellPoint<E::Point>,
        into: usize,
        power: i32,
        draws: &mut U,
    ) -> (CellPoint<E::Point>, f64) {
        // Rounding tells points apart that are as far as that.
        let epsilon = <E::Scalar as Real>::EPSILON.to_f64();
        let nearest = 4.0 * epsilon * self.tables.measures.len() as f64;
        let [from, to] = [z.cell, into].map(|cell| self.equation.place(cell));
        let mut t = match to.cmp(&from) {
            core::cmp::Ordering::Less => [1.0; MOST_DIMENSIONS],
            core::cmp::Ordering::Equal => z.parameters,
            core::cmp::Ordering::Greater => [0.0; MOST_DIMENSIONS],
        };
        // From an end there is one side.
        let is_inner = nearest < t[0] && t[0] < 1.0 - nearest;
        let is_sided = self.equation.dimension() == 1 && to == from && is_inner;
        let (mut share, mut density, mut is_near) = (1.0, 1.0, None);
        let own = t.get_mut(..self.equation.dimension()).unwrap_or(&mut []);
        for t in own.iter_mut() {
            let mut uniform: f64 = draws.uniform();
            // The first coordinate tells which half it is.
            let is_near = *is_near.get_or_insert_with(|| {
                let is_near = power > 1 && uniform < 0.5;
                if power > 1 {
                    uniform = 2.0 * uniform - if is_near { 0.0 } else { 1.0 };
                }
                is_near
            });
            // Below the start or above it: as often as not, which nets know, or by their lengths.
            let is_below = uniform < if is_sided { 0.5 } else { *t };
            let (from, length) = match is_below {
                true => (-1.0, *t),
                false => (1.0, 1.0 - *t),
            };
            let at = match (is_sided, is_below) {
                (true, true) => 2.0 * uniform,
                (true, false) => 2.0 * uniform - 1.0,
                (false, true) => (*t - uniform) / *t,
                (false, false) => (uniform - *t) / (1.0 - *t),
            };
            if is_sided {
                share *= 2.0 * length;
            }
            // What a uniform number is whose power gives the distance.
            let root = if is_near { at } else { root_of(at, power) };
            density /= f64::from(power) * power_of(root, power - 1);
            let distance = match is_near {
                true => (length * power_of(at, power)).max(nearest),
                false => length * at,
            };
            *t = (*t + from * distance).clamp(0.0, 1.0);
        }
        (self.at(into, own), 2.0 * share / (1.0 + density))
    }

    /// An estimate of W (u − g)(y): by roulette the walk goes on, or the estimate is 0.
    #[inline]
    fn go_on<U: Uniforms<f64>>(
        &self,
        mut weight: f64,
        mut y: CellPoint<E::Point>,
        ending: &Ending,
        draws: &mut U,
        steps: &mut u64,
    ) -> f64 {
        let coarse = self.coarse.as_ref().map(|coarse| Resolvent {
            equation: coarse.equation,
            tables: coarse.tables,
            coarse: None,
        });
        let own = coarse.as_ref().unwrap_or(self);
        let mut scale = ending.scale;
        if let Some(coarse) = &self.coarse {
            scale /= coarse.share;
            y = own.locate(y.point);
        }
        let cells = own.tables.measures.len();
        let row = |table: &'_ [f64], cell: usize| -> Option<(usize, usize)> {
            let from = cell.checked_mul(cells)?;
            (from + cells <= table.len()).then_some((from, from + cells))
        };
        let (mut sum, mut own_steps) = (0.0, 0_u32);
        loop {
            let Some((from, to)) = row(own.tables.jumps, y.cell) else {
                return f64::NAN;
            };
            let jumps = own.tables.jumps.get(from..to).unwrap_or(&[]);
            let stay = own.tables.stays.get(y.cell).copied().unwrap_or(f64::NAN);
            let end = stay + jumps.last().copied().unwrap_or(0.0);
            let survival = (weight.abs() / ending.share * end / scale).min(1.0);
            let roulette: f64 = draws.uniform();
            if !weight.is_finite() || own_steps > MOST_STEPS {
                return f64::NAN;
            }
            if weight == 0.0 || roulette >= survival {
                return sum;
            }
            *steps += 1;
            own_steps += 1;
            weight /= survival;
            let pick: f64 = draws.uniform();
            let pick = pick * end;
            let mut z = y;
            if pick < stay {
                weight *= end / stay;
            } else {
                let (cell, importance) = chosen(jumps, pick - stay);
                let share;
                (z, share) = own.draw(cell, draws);
                let resolvent = own.form(own.tables.resolvent, &y, &z);
                weight *= own.measure(cell) * share * resolvent * end / importance;
                if self.coarse.is_none() {
                    sum += weight * self.rest_of_source(&z);
                }
            }
            let Some((from, to)) = row(own.tables.steps, z.cell) else {
                return f64::NAN;
            };
            let leads = own.tables.steps.get(from..to).unwrap_or(&[]);
            let all = leads.last().copied().unwrap_or(f64::NAN);
            let pick: f64 = draws.uniform();
            let (cell, importance) = chosen(leads, pick * all);
            let share;
            (y, share) = own.draw_from(&z, cell, draws);
            let of = |kernel: f64| own.measure(cell) * (share * kernel) * all / importance;
            if self.coarse.is_some() {
                let [z, y] = [&z, &y].map(|x| self.locate(x.point));
                let of_source = self.form(self.tables.kernel, &z, &y) * self.rest_of_source(&y);
                sum += weight * of(self.difference(&z, &y) * self.value(&y) + of_source);
            }
            weight *= of(own.difference(&z, &y));
            if self.coarse.is_none() {
                sum += weight * self.value(&y);
            }
        }
    }
}

/// Draws a uniform number towards the ends of an axis, and returns its share.
#[inline]
pub(super) fn towards_ends(t: &mut f64, ends: &[CellEnd]) -> f64 {
    let &[low, high] = ends else {
        return 1.0;
    };
    if low.power.max(high.power) <= 1 {
        return 1.0;
    }
    let (is_high, distance, share) = drawn_near(*t, [low.power, high.power]);
    let nearest = if is_high { high } else { low }.nearest;
    let distance = distance.max(nearest);
    *t = if is_high { 1.0 - distance } else { distance };
    share
}

/// A uniform number drawn near to 0 and 1 with these powers, as a distance from 1 or from 0, and its share.
#[inline]
pub(super) fn drawn_near(t: f64, [low, high]: [i32; 2]) -> (bool, f64, f64) {
    // From one end all of the axis is drawn, from two ends half of it each.
    let has_both = low > 1 && high > 1;
    let length = if has_both { 0.5 } else { 1.0 };
    let is_high = high > 1 && (low <= 1 || t >= 0.5);
    let power = if is_high { high } else { low };
    let from = if is_high { 1.0 - t } else { t } / length;
    let near = power_of(from, power - 1);
    (is_high, length * near * from, f64::from(power) * near)
}

/// The number above 0 of which this is the power.
fn root_of(number: f64, power: i32) -> f64 {
    if power == 1 {
        return number;
    }
    Real::exp(Real::ln(number) / f64::from(power))
}

/// A number to a power.
pub(super) fn power_of(number: f64, power: i32) -> f64 {
    (0..power).fold(1.0, |product, _| product * number)
}

/// The place in a row of sums to which a number leads, and its own importance.
#[inline]
fn chosen(row: &[f64], pick: f64) -> (usize, f64) {
    let after = row.partition_point(|&up_to| up_to <= pick);
    let place = after.min(row.len().saturating_sub(1));
    let up_to = row.get(place).copied().unwrap_or(f64::NAN);
    let before = match place.checked_sub(1) {
        Some(before) => row.get(before).copied().unwrap_or(f64::NAN),
        None => 0.0,
    };
    (place, up_to - before)
}

#[cfg(test)]
mod tests {
    use super::{CellEnd, towards_ends};

    /// ∫ t^−½ and ∫ (1 − t)^−½ are 2, and ∫ (t (1 − t))^−½ is π, by the middle rule of a smooth integrand; shares sum to 1.
    #[test]
    fn points_towards_ends_make_roots_smooth() {
        let of = |powers: [i32; 2], f: fn(f64) -> f64| {
            let ends = powers.map(|power| CellEnd {
                power,
                nearest: 0.0,
            });
            let terms = (0..10_000).map(|k| {
                let mut t = (f64::from(k) + 0.5) / 10_000.0;
                let share = towards_ends(&mut t, &ends);
                [share * f(t), share]
            });
            terms.fold([0.0; 2], |[a, b], [x, y]| [a + 1e-4 * x, b + 1e-4 * y])
        };
        let root = |t: f64| 1.0 / t.sqrt();
        for (powers, f, right) in [
            ([2, 1], root as fn(f64) -> f64, 2.0),
            ([1, 2], |t| 1.0 / (1.0 - t).sqrt(), 2.0),
            (
                [2, 2],
                |t| 1.0 / (t * (1.0 - t)).sqrt(),
                core::f64::consts::PI,
            ),
        ] {
            let [integral, one] = of(powers, f);
            assert!((integral - right).abs() < 1e-4, "{powers:?}: {integral}");
            assert!((one - 1.0).abs() < 1e-6, "{powers:?}: {one}");
        }
        let mut t = 0.3;
        let uniform = [CellEnd {
            power: 1,
            nearest: 0.0,
        }; 2];
        assert_eq!((towards_ends(&mut t, &uniform), t), (1.0, 0.3));
    }
}
