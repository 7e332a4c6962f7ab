//! What walks know of a solved equation: coefficients by quadrature, and how large K − K_n is where.

use alloc::vec;
use alloc::vec::Vec;

use super::edges::kronecker_point;
use super::walk::{power_of, towards_ends};
use super::{CellEnd, CellPoint, Regular, Resolvent, ResolventTables};
use crate::galerkin::{GalerkinError, MOST_DIMENSIONS, buffer, fill_products, reserve};
use crate::{DefaultGenerator, Located, Real, RngUniforms, Uniforms, WalkSeeds};

/// Random points of a pair of cells by which |K − K_n| is known there, at least: with 4, or one node, the tail of scores is heavy.
pub const PAIR_DRAWS: u32 = 12;
/// How far within the corners of a pair K − K_n is looked at in one dimension, where a jump that cuts little off a pair has a corner in
/// it: K may have no value in a corner itself.
const INSET: f64 = 1.0 / 64.0;
/// Random points of all pairs together, and of all cells with themselves, at least: few cells are looked at as closely as many.
const ALL_DRAWS: usize = 1 << 14;
/// Random points of a cell with itself that are near to x = y, at least, and how near they are.
const RIDGE_DRAWS: u32 = 64;
const RIDGE_GRADING: i32 = 4;
/// How many times the root mean square by uniform points that by near ones is where points are drawn near.
const RIDGE: f64 = 2.0;
/// Random points of a cell by which g and r₀ are known there.
const CELL_DRAWS: u32 = 32;
/// The part of its largest that |g| has at least in a table of steps: where g is 0 the solution may not be.
const LEAST_VALUE: f64 = 0.05;
/// The probability that a step is uniform, whatever its table says.
const UNIFORM_STEPS: f64 = 0.1;
/// The least part of the largest importance that staying in a cell has.
const LEAST_STAY: f64 = 1e-3;
/// Powers of a matrix of cells by which its spectral radius is estimated.
const POWERS: u32 = 60;
/// Points from which one looks whether K is singular at x = y, and distances in bits at which that is done.
const GRADING_LOOKS: usize = 33;
const COARSE: i32 = 12;
const FINE: i32 = 24;
/// Points from and to which one looks whether K is singular at an end of a cell.
const END_LOOKS: usize = 3;
/// Bits of a distance from it, at most.
const MOST_BITS: i32 = 128;
/// How far from x = y, as a part of a cell, one looks whether K bends there like a smooth function, of whose bend a quarter is left at half the
/// distance; the part from which on it does not; and the part of K that rounding hides.
const ROUGH_DISTANCE: f64 = 1.0 / 64.0;
const ROUGH: f64 = 0.375;
const ROUGH_BEND: f64 = 1e-9;
/// The exponent of |x − y| from which on K is taken to be singular there: that of a logarithm between these distances.
const LEAST_EXPONENT: f64 = 0.05;
/// The largest power of a uniform number: beyond it points lie nearer than rounding tells.
const MOST_GRADING: i32 = 6;
/// The number of goals from which on draws are those of tables.
const LOOKS: u64 = u64::MAX - 8;

/// Node of a quadrature rule on [0, 1], with its share of the whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisNode {
    /// The place in [0, 1].
    pub at: f64,
    /// The weight; all sum to 1.
    pub share: f64,
}

/// Nodes of the cube [0, 1]^d, with the functions of a cell there.
#[derive(Clone, Debug)]
pub(super) struct CubeNodes {
    /// d numbers of each.
    pub(super) places: Vec<f64>,
    pub(super) shares: Vec<f64>,
    /// B numbers of each.
    functions: Vec<f64>,
}

impl CubeNodes {
    /// The tensor product of rules, one for each axis, from the first one on again where these are more.
    pub(super) fn new(
        rules: &[impl AsRef<[AxisNode]>],
        dimension: usize,
        functions: usize,
    ) -> Result<Self, GalerkinError> {
        let axes = || rules.iter().map(AsRef::as_ref).cycle().take(dimension);
        let count = axes().map(<[_]>::len).fold(1, usize::saturating_mul);
        let (mut places, mut shares) = (reserve(count.saturating_mul(dimension))?, reserve(count)?);
        let mut all = buffer(count.saturating_mul(functions))?;
        for (number, own) in all.chunks_exact_mut(functions.max(1)).enumerate() {
            let (mut rest, mut share) = (number, 1.0);
            let first = places.len();
            for axis in axes() {
                if let Some(node) = axis.get(rest % axis.len()) {
                    places.push(node.at);
                    share *= node.share;
                }
                rest /= axis.len();
            }
            shares.push(share);
            fill_products(places.get(first..).unwrap_or(&[]), own);
        }
        Ok(Self {
            places,
            shares,
            functions: all,
        })
    }

    /// These nodes on a cell with ends.
    fn towards(&self, ends: &[CellEnd]) -> Self {
        let mut all = self.clone();
        let dimension = ends.len() / 2;
        let functions = all.functions.len() / all.shares.len().max(1);
        let nodes = all.places.chunks_exact_mut(dimension.max(1));
        let nodes = nodes.zip(&mut all.shares);
        let own = all.functions.chunks_exact_mut(functions.max(1));
        for ((places, share), own) in nodes.zip(own) {
            for (t, ends) in places.iter_mut().zip(ends.chunks_exact(2)) {
                *share *= towards_ends(t, ends);
            }
            fill_products(places, own);
        }
        all
    }

    /// Parameters, share and functions of every node.
    pub(super) fn iter(
        &self,
        dimension: usize,
        functions: usize,
    ) -> impl Iterator<Item = (&[f64], f64, &[f64])> {
        let places = self.places.chunks_exact(dimension);
        let own = self.functions.chunks_exact(functions);
        places
            .zip(&self.shares)
            .zip(own)
            .map(|((t, &share), psi)| (t, share, psi))
    }
}

/// Coefficients of an equation by quadrature: any rule serves, and a better one leaves less to walks.
///
/// ```
/// use fredholm_core::galerkin::Cells;
/// use fredholm_core::resolvent::{AxisNode, GalerkinRows, Regular};
/// use fredholm_core::{Located, Space};
/// # struct Unit;
/// # impl Space for Unit { type Scalar = f64; type Point = f64; }
/// # impl Cells for Unit {
/// #     const DIMENSION: usize = 1;
/// #     fn cells(&self) -> usize { 1 }
/// #     fn locate(&self, _: &f64) -> usize { 0 }
/// #     fn measure(&self, _: usize) -> f64 { 1.0 }
/// #     fn point(&self, _: usize, t: &[f64]) -> f64 { t[0] }
/// #     fn parameters(&self, x: &Located<f64>, t: &mut [f64]) { t[0] = x.point }
/// #     fn at(&self, x: &[f64]) -> Option<f64> { x.first().copied() }
/// # }
/// # impl Regular for Unit {
/// #     fn kernel(&self, x: &f64, y: &f64) -> f64 { x * y }
/// #     fn source(&self, x: &f64) -> f64 { *x }
/// # }
///
/// // K(x, y) = x y on [0, 1] as one cell: its mean is 1/4, that of F = x is 1/2.
/// let middle = [AxisNode { at: 0.5, share: 1.0 }];
/// let rows = GalerkinRows::new(&Unit, 1, [&middle, &middle])?;
/// let mut row = [0.0];
/// assert!(rows.fill(0, &mut row));
/// assert_eq!((row, rows.source(0)), ([0.25], vec![0.5]));
/// # Ok::<(), fredholm_core::galerkin::GalerkinError>(())
/// ```
#[derive(Debug)]
pub struct GalerkinRows<'a, E: Regular> {
    equation: &'a E,
    functions: usize,
    left: CubeNodes,
    right: CubeNodes,
    /// Both rules of every cell that has ends; or nothing.
    of_ends: Vec<Option<[CubeNodes; 2]>>,
    /// The rule on the right.
    axis: Vec<AxisNode>,
    /// The points of all cells by the rule on the right.
    points: Vec<E::Point>,
    grading: i32,
}

impl<'a, E: Regular> GalerkinRows<'a, E> {
    /// The coefficients of so many functions on a cell by the rule of x and that of y on every axis. Rules without a common node
    /// meet no singularity at x = y.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new(
        equation: &'a E,
        functions: usize,
        [left, axis]: [&[AxisNode]; 2],
    ) -> Result<Self, GalerkinError> {
        let mut rows = Self {
            equation,
            functions,
            left: CubeNodes::new(&[left], equation.dimension(), functions)?,
            right: CubeNodes::new(&[axis], equation.dimension(), functions)?,
            of_ends: Vec::new(),
            axis: axis.to_vec(),
            points: Vec::new(),
            grading: 1,
        };
        rows.set_points()?;
        Ok(rows)
    }

    fn set_points(&mut self) -> Result<(), GalerkinError> {
        let cells = self.equation.cells();
        let mut points = reserve(cells.saturating_mul(self.right.shares.len()))?;
        for cell in 0..cells {
            let [_, right] = self.rules(cell);
            let places = right.places.chunks_exact(self.equation.dimension());
            points.extend(places.map(|t| self.equation.point(cell, t)));
        }
        self.points = points;
        Ok(())
    }

    /// The rules of x and of y on a cell.
    fn rules(&self, cell: usize) -> [&CubeNodes; 2] {
        match self.of_ends.get(cell) {
            Some(Some([left, right])) => [left, right],
            _ => [&self.left, &self.right],
        }
    }

    /// These coefficients with nodes that draw near to the [ends](ResolventTables::ends) of cells.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn with_ends(mut self, ends: &[CellEnd]) -> Result<Self, GalerkinError> {
        let cells = ends.chunks_exact(2 * self.equation.dimension());
        let own = cells.map(|ends| {
            let is_one = ends.iter().any(|end| end.power > 1);
            is_one.then(|| [&self.left, &self.right].map(|rule| rule.towards(ends)))
        });
        self.of_ends = own.collect();
        self.set_points()?;
        Ok(self)
    }

    /// These coefficients with nodes within a cell that draw near to x ([`grading`]).
    #[must_use]
    pub const fn with_grading(mut self, grading: i32) -> Self {
        self.grading = grading;
        self
    }

    /// Fills ∫ K(x, y) ψ_b(y) over a cell at the place of x by a rule that is graded towards x on every axis; whether all values were finite.
    fn near(&self, x: &E::Point, at: &[f64], cell: usize, integrals: &mut [f64]) -> bool {
        let sides = 2 * self.axis.len();
        let count = sides.saturating_pow(self.equation.dimension() as u32);
        let mut functions = vec![0.0; self.functions];
        let mut is_finite = true;
        for number in 0..count {
            let (mut rest, mut share) = (number, 1.0);
            let mut t = [0.0; MOST_DIMENSIONS];
            let own = t.get_mut(..self.equation.dimension()).unwrap_or(&mut []);
            for (t, at) in own.iter_mut().zip(at) {
                let Some(node) = self.axis.get(rest % sides / 2) else {
                    continue;
                };
                let (length, from) = match rest % 2 {
                    0 => (*at, -1.0),
                    _ => (1.0 - at, 1.0),
                };
                let near = power_of(node.at, self.grading - 1);
                *t = at + from * length * near * node.at;
                share *= length * node.share * f64::from(self.grading) * near;
                rest /= sides;
            }
            fill_products(own, &mut functions);
            let y = self.equation.point(cell, own);
            let value = share * self.equation.kernel(x, &y).to_f64();
            is_finite &= value.is_finite();
            for (integral, psi) in integrals.iter_mut().zip(&functions) {
                *integral += value * psi;
            }
        }
        is_finite
    }

    /// Fills the B rows of K' of a cell, N numbers each; whether all values of the kernel were finite.
    pub fn fill(&self, cell: usize, rows: &mut [f64]) -> bool {
        let (functions, dimension) = (self.functions, self.equation.dimension());
        let width = self.equation.cells() * functions;
        let nodes = self.right.shares.len();
        let mut integrals = vec![0.0; functions];
        let mut is_finite = true;
        let place = |cell: usize| self.equation.place(cell);
        rows.fill(0.0);
        let [left, _] = self.rules(cell);
        for (t, share, psi) in left.iter(dimension, functions) {
            let x = self.equation.point(cell, t);
            for (into, points) in self.points.chunks_exact(nodes).enumerate() {
                integrals.fill(0.0);
                let is_near = self.grading > 1 && place(into) == place(cell);
                if is_near {
                    is_finite &= self.near(&x, t, into, &mut integrals);
                }
                let far = if is_near { &[][..] } else { points };
                let [_, right] = self.rules(into);
                let own = far.iter().zip(right.iter(dimension, functions));
                for (y, (_, share, psi)) in own {
                    let value = share * self.equation.kernel(&x, y).to_f64();
                    is_finite &= value.is_finite();
                    for (integral, psi) in integrals.iter_mut().zip(psi) {
                        *integral += value * psi;
                    }
                }
                let scale = share * self.equation.measure(into);
                for (row, psi) in rows.chunks_exact_mut(width).zip(psi) {
                    let own = row.iter_mut().skip(into * functions);
                    for (entry, integral) in own.zip(&integrals) {
                        *entry += scale * psi * integral;
                    }
                }
            }
        }
        is_finite
    }

    /// F' of a cell: the means of F times each function.
    pub fn source(&self, cell: usize) -> Vec<f64> {
        self.means(cell, &|x| self.equation.source(x).to_f64())
    }

    /// The means over a cell of a function times each function on it.
    pub fn means(&self, cell: usize, function: &dyn Fn(&E::Point) -> f64) -> Vec<f64> {
        let mut means = vec![0.0; self.functions];
        let [_, right] = self.rules(cell);
        for (t, share, psi) in right.iter(self.equation.dimension(), self.functions) {
            let value = share * function(&self.equation.point(cell, t));
            for (mean, psi) in means.iter_mut().zip(psi) {
                *mean += value * psi;
            }
        }
        means
    }
}

/// The exponent a with which a size grows like distance^−a, from its values at two distances in bits; 0 where it does not.
fn exponent(size: impl Fn(f64) -> f64) -> f64 {
    let [fine, coarse] = [FINE, COARSE].map(|bits| size(power_of(0.5, bits)).abs());
    let exponent = Real::ln(fine / coarse) / core::f64::consts::LN_2 / f64::from(FINE - COARSE);
    match exponent.is_finite() && exponent > LEAST_EXPONENT {
        true => exponent,
        false => 0.0,
    }
}

/// The cells at the place of one, of all copies of the space.
fn beside<E: Regular>(equation: &E, cell: usize) -> impl Iterator<Item = usize> {
    let (copies, place) = (equation.copies(), equation.place(cell));
    let each = equation.cells() / copies.max(1);
    (0..copies).map(move |copy| copy * each + place)
}

/// The exponent a with which K grows like |x − y|^−a towards x = y, as some points tell; 0 where it does not grow. That of a logarithm is
/// about 0.1.
pub fn singularity<E: Regular>(equation: &E) -> f64 {
    let seeds = WalkSeeds::<DefaultGenerator>::new(0, LOOKS + 2);
    let mut draws: RngUniforms<DefaultGenerator> = RngUniforms(seeds.generator(0));
    let mut exponents = [0.0; GRADING_LOOKS];
    for (number, found) in exponents.iter_mut().enumerate() {
        let cell = number * equation.cells() / GRADING_LOOKS;
        let mut t = [0.0; MOST_DIMENSIONS];
        let own = t.get_mut(..equation.dimension()).unwrap_or(&mut []);
        own.iter_mut().for_each(|t| *t = draws.uniform());
        let x = equation.point(cell, own);
        *found = beside(equation, cell)
            .map(|into| {
                exponent(|distance| {
                    let mut t = t;
                    let own = t.get_mut(..equation.dimension()).unwrap_or(&mut []);
                    for t in own.iter_mut() {
                        // Towards the middle.
                        *t += if *t < 0.5 { distance } else { -distance };
                    }
                    equation.kernel(&x, &equation.point(into, own)).to_f64()
                })
            })
            .fold(0.0, f64::max);
    }
    exponents.sort_unstable_by(f64::total_cmp);
    exponents.get(GRADING_LOOKS / 2).copied().unwrap_or(0.0)
}

/// How points of a cell draw near to its ends ([`ResolventTables::ends`]), and the largest exponent a with which K(x, y) grows like t^−a, where t
/// is the distance of y from an end; as some points tell. No ends: all points are uniform.
///
/// # Errors
/// [`GalerkinError::Memory`].
pub fn ends<E: Regular>(equation: &E) -> Result<(Vec<CellEnd>, f64), GalerkinError> {
    let cells = equation.cells();
    let (mut all, mut largest) = (reserve(2 * equation.dimension() * cells)?, 0.0_f64);
    let at = |cell: usize, look: u32| {
        let place = kronecker_point(look);
        equation.point(cell, place.get(..equation.dimension()).unwrap_or(&[]))
    };
    for cell in 0..cells {
        for (axis, is_high) in
            (0..equation.dimension()).flat_map(|axis| [(axis, false), (axis, true)])
        {
            let beside = |look: usize, distance: f64| {
                let mut t = kronecker_point((1 + END_LOOKS + look) as u32);
                if let Some(t) = t.get_mut(axis) {
                    *t = if is_high { 1.0 - distance } else { distance };
                }
                equation.point(cell, t.get(..equation.dimension()).unwrap_or(&[]))
            };
            let looks: [[f64; 3]; END_LOOKS] = core::array::from_fn(|look| {
                let other = at(look * cells / END_LOOKS, 1 + look as u32);
                let own = |distance: f64| beside(look, distance);
                [
                    exponent(|t| equation.kernel(&other, &own(t)).to_f64()),
                    exponent(|t| equation.kernel(&own(t), &other).to_f64()),
                    exponent(|t| equation.source(&own(t)).to_f64()),
                ]
            });
            let found: [f64; 3] = core::array::from_fn(|k| {
                let mut all = looks.map(|own| own.get(k).copied().unwrap_or(0.0));
                all.sort_unstable_by(f64::total_cmp);
                all.get(END_LOOKS / 2).copied().unwrap_or(0.0)
            });
            largest = largest.max(found[0]);
            let is_told = |distance: f64| {
                let mut t = [E::Scalar::from_f64(0.0); MOST_DIMENSIONS];
                let own = t.get_mut(..equation.dimension()).unwrap_or(&mut []);
                let point = beside(0, distance);
                equation.parameters(&Located { point, cell }, own);
                let t = own.get(axis).map_or(0.0, |t| t.to_f64());
                t > 0.0 && t < 1.0
            };
            let power = grading(found.into_iter().fold(0.0, f64::max), 1);
            let mut distances = (0..MOST_BITS).map(|bits| power_of(0.5, MOST_BITS - bits));
            let nearest = match power > 1 {
                true => distances.find(|&distance| is_told(distance)),
                false => None,
            };
            all.push(CellEnd {
                power,
                nearest: 4.0 * nearest.unwrap_or(0.0),
            });
        }
    }
    if all.iter().all(|end| end.power == 1) {
        all.clear();
    }
    Ok((all, largest))
}

/// Whether K is not smooth at x = y, in one dimension, as some points tell.
pub fn is_rough<E: Regular>(equation: &E) -> bool {
    if equation.dimension() != 1 {
        return false;
    }
    let mut rough = 0;
    for number in 0..GRADING_LOOKS {
        let cell = number * equation.cells() / GRADING_LOOKS;
        let t = 0.25 + 0.5 * (number as f64 + 0.5) / GRADING_LOOKS as f64;
        let x = equation.point(cell, &[t]);
        let is_rough = |into: usize| {
            let at = |t: f64| equation.kernel(&x, &equation.point(into, &[t])).to_f64();
            let middle = at(t);
            let bend = |distance: f64| (at(t - distance) + at(t + distance) - 2.0 * middle).abs();
            let [wide, narrow] = [bend(ROUGH_DISTANCE), bend(0.5 * ROUGH_DISTANCE)];
            let is_seen = narrow > ROUGH_BEND * middle.abs().max(wide);
            is_seen && narrow > ROUGH * wide
        };
        rough += usize::from(beside(equation, cell).any(is_rough));
    }
    rough > GRADING_LOOKS / 4
}

/// How points of a step within a cell draw near to its start ([`ResolventTables::near`]): such that K times the share of a point is
/// bounded where K grows like |x − y|^−a. 1: they are uniform.
#[must_use]
pub fn grading(exponent: f64, dimension: usize) -> i32 {
    if !(exponent > 0.0) {
        return 1;
    }
    let share = 1.0 - exponent / dimension as f64;
    match share > 0.0 {
        true => (1.0 / share + 1.0).min(f64::from(MOST_GRADING)) as i32,
        false => MOST_GRADING,
    }
}

/// How large K − K_n, g and r₀ are on cells, and the tables by which walks go on.
#[derive(Clone, Debug, Default)]
pub struct ResolventLooks {
    /// The root mean square of D over every pair of cells, n × n numbers.
    pub differences: Vec<f64>,
    /// The number of points of a pair that have told it.
    pub points: f64,
    /// The root mean square of g over every cell.
    pub values: Vec<f64>,
    /// The root mean square of r₀ over every cell.
    pub rests: Vec<f64>,
    /// [`ResolventTables::steps`].
    pub steps: Vec<f64>,
    /// [`ResolventTables::stays`].
    pub stays: Vec<f64>,
    /// [`ResolventTables::jumps`].
    pub jumps: Vec<f64>,
    /// The spectral radius of (1 + |R_n|)|D| by root mean squares over pairs of cells: below 1 walks have a mean.
    pub radius: f64,
}

impl<E: Regular> Resolvent<'_, E> {
    /// Fills the root mean squares of D over the pairs of a cell with all others, from draws of its own, and returns
    /// [`ResolventTables::near`] of the cell.
    pub fn look_at_pairs(&self, cell: usize, row: &mut [f64]) -> i32 {
        let seeds = WalkSeeds::<DefaultGenerator>::new(0, LOOKS);
        let mut draws = RngUniforms(seeds.generator(cell as u64));
        let cells = row.len();
        let count = pair_draws(cells);
        let near = RIDGE_DRAWS.max((ALL_DRAWS / cells.max(1)) as u32);
        for (into, out) in row.iter_mut().enumerate() {
            let mut sum = 0.0;
            for _ in 0..count {
                let (x, own) = self.draw(cell, &mut draws);
                let (y, share) = self.draw_from(&x, into, &mut draws);
                let difference = own * share * self.difference(&x, &y);
                sum += difference * difference;
            }
            let mut points = f64::from(count);
            if self.equation.dimension() == 1 {
                let square = |x: f64, y: f64| {
                    let [x, y] = [self.at(cell, &[x]), self.at(into, &[y])];
                    let difference = self.difference(&x, &y);
                    difference * difference
                };
                // Of two points of one cell neither is the other.
                let [left, right] = [INSET, 0.5 * INSET].map(|inset| [inset, 1.0 - inset]);
                let corners = left.into_iter().flat_map(|x| right.map(|y| square(x, y)));
                // All corners tell as much as one point.
                sum += 0.25 * corners.filter(|square| square.is_finite()).sum::<f64>();
                points += 1.0;
            }
            *out = Real::sqrt(sum / points);
        }
        let own = self.tables.near.get(cell).copied().unwrap_or(0);
        let found = row.get(cell).copied().unwrap_or(0.0);
        // What is singular at an end seems to have a ridge.
        if own > 1 || self.has_ends(cell) {
            return own;
        }
        let [ridge, of_scores] = self.ridge([cell, cell], near, &mut draws);
        if !(ridge > RIDGE * found) {
            if let Some(out) = row.get_mut(cell) {
                *out = found.max(ridge);
            }
            return own;
        }
        for into in cell.saturating_sub(1)..(cell + 2).min(cells) {
            let is_next = into != cell;
            if is_next && self.equation.dimension() > 1 {
                continue;
            }
            let [_, of_next] = match is_next {
                true => self.ridge([cell, into], RIDGE_DRAWS, &mut draws),
                false => [ridge, of_scores],
            };
            if let Some(out) = row.get_mut(into) {
                *out = of_next;
            }
        }
        RIDGE_GRADING
    }

    /// The root mean square of D over a pair of cells, and that of what draws score which are dense near x = y: a narrow ridge there is
    /// what kernels have most, and few uniform points meet it.
    fn ridge(
        &self,
        [cell, into]: [usize; 2],
        count: u32,
        draws: &mut RngUniforms<DefaultGenerator>,
    ) -> [f64; 2] {
        let (mut squares, mut scores) = (0.0, 0.0);
        for _ in 0..count {
            let (x, own) = self.draw(cell, draws);
            let (y, share) = self.draw_near(&x, into, RIDGE_GRADING, draws);
            let difference = own * self.difference(&x, &y);
            squares += share * difference * difference;
            scores += share * share * difference * difference;
        }
        [squares, scores].map(|sum| Real::sqrt(sum / f64::from(count)))
    }

    /// The root mean square of what draws of the cell's own score of a function over it.
    pub fn root_mean_square(&self, cell: usize, of: &dyn Fn(&CellPoint<E::Point>) -> f64) -> f64 {
        let seeds = WalkSeeds::<DefaultGenerator>::new(0, LOOKS + 1);
        let mut draws = RngUniforms(seeds.generator(cell as u64));
        let squares = (0..CELL_DRAWS).map(|_| {
            let (x, share) = self.draw(cell, &mut draws);
            let value = share * of(&x);
            value * value
        });
        Real::sqrt(squares.sum::<f64>() / f64::from(CELL_DRAWS))
    }

    /// The looks, and tables of walks that follow from them, with what [`look_at_pairs`](Self::look_at_pairs) has found. Where walks go on by a
    /// coarse resolvent there are no tables, and no radius.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn looks(&self, differences: Vec<f64>) -> Result<ResolventLooks, GalerkinError> {
        let measures = self.tables.measures;
        let cells = measures.len();
        let (mut values, mut rests) = (buffer(cells)?, buffer(cells)?);
        for (cell, (value, rest)) in values.iter_mut().zip(&mut rests).enumerate() {
            *value = self.root_mean_square(cell, &|x| self.value(x));
            *rest = self.root_mean_square(cell, &|x| self.rest_of_source(x));
        }
        let largest = values.iter().copied().fold(0.0, f64::max);
        let (mut steps, mut stays) = (buffer(cells * cells)?, buffer(cells)?);
        let all: f64 = measures.iter().sum();
        for ((row, stay), own) in steps
            .chunks_exact_mut(cells)
            .zip(&mut stays)
            .zip(differences.chunks_exact(cells))
        {
            let leads = row.iter_mut().zip(own).zip(values.iter().zip(measures));
            for ((to, difference), (value, measure)) in leads {
                *to = difference * step_value(*value, largest) * measure;
                *stay += *to;
            }
            let mut up_to = 0.0;
            for (to, measure) in row.iter_mut().zip(measures) {
                let uniform = measure / all;
                up_to += match *stay > 0.0 {
                    true => (1.0 - UNIFORM_STEPS) * *to / *stay + UNIFORM_STEPS * uniform,
                    false => uniform,
                };
                *to = up_to;
            }
        }
        let points = f64::from(pair_draws(cells));
        if self.coarse.is_some() {
            return Ok(ResolventLooks {
                differences,
                points,
                values,
                rests,
                stays,
                ..ResolventLooks::default()
            });
        }
        let sizes = norms(&self.tables)?;
        let most = stays.iter().copied().fold(0.0, f64::max);
        stays
            .iter_mut()
            .for_each(|stay: &mut f64| *stay = stay.max(LEAST_STAY * most));
        let mut jumps = buffer(cells * cells)?;
        let rows = jumps.chunks_exact_mut(cells).zip(sizes.chunks_exact(cells));
        for ((row, sizes), from) in rows.zip(measures) {
            let mut up_to = 0.0;
            for (((to, size), stay), measure) in row.iter_mut().zip(sizes).zip(&stays).zip(measures)
            {
                up_to += size * Real::sqrt(measure / from) * stay;
                *to = up_to;
            }
        }
        Ok(ResolventLooks {
            radius: radius(&differences, &sizes, measures)?,
            differences,
            points,
            values,
            rests,
            steps,
            stays,
            jumps,
        })
    }
}

/// What |g| of a cell counts for where steps lead into it.
pub(super) fn step_value(value: f64, largest: f64) -> f64 {
    value + LEAST_VALUE * largest
}

/// Random points of a pair of cells by which |D| is known there.
fn pair_draws(cells: usize) -> u32 {
    PAIR_DRAWS.max((ALL_DRAWS / (cells * cells).max(1)) as u32)
}

/// ‖R_ij‖ = √(μ_i μ_j) |R̂_ij| of every pair of cells, by Frobenius' norm.
fn norms(tables: &ResolventTables<'_>) -> Result<Vec<f64>, GalerkinError> {
    let (cells, functions) = (tables.measures.len(), tables.functions);
    let mut squares = buffer(cells * cells)?;
    let rows = tables.resolvent.chunks_exact((cells * functions).max(1));
    for (row, numbers) in rows.enumerate() {
        let own = squares.iter_mut().skip(row / functions * cells);
        for (square, block) in own.zip(numbers.chunks_exact(functions)) {
            *square += block.iter().map(|r| r * r).sum::<f64>();
        }
    }
    let rows = squares.chunks_exact_mut(cells).zip(tables.measures);
    for (row, from) in rows {
        for (square, into) in row.iter_mut().zip(tables.measures) {
            let square: &mut f64 = square;
            *square = Real::sqrt(*square * from * into);
        }
    }
    Ok(squares)
}

/// The spectral radius of (1 + |R|)|D| by powers.
fn radius(differences: &[f64], sizes: &[f64], measures: &[f64]) -> Result<f64, GalerkinError> {
    let cells = measures.len();
    let (mut w, mut image) = (buffer(cells)?, buffer(cells)?);
    w.fill(1.0);
    let mut radius = 0.0;
    for _ in 0..POWERS {
        let rows = image
            .iter_mut()
            .zip(differences.chunks_exact(cells))
            .zip(measures);
        for ((out, row), from) in rows {
            let terms = row.iter().zip(measures).zip(&w);
            let sum: f64 = terms
                .map(|((d, into), w)| d * Real::sqrt(from * into) * w)
                .sum();
            *out = sum;
        }
        for ((out, own), row) in w.iter_mut().zip(&image).zip(sizes.chunks_exact(cells)) {
            *out = own + row.iter().zip(&image).map(|(r, d)| r * d).sum::<f64>();
        }
        radius = Real::sqrt(w.iter().map(|w| w * w).sum::<f64>());
        if !(radius > 0.0) {
            break;
        }
        w.iter_mut().for_each(|w| *w /= radius);
    }
    Ok(radius)
}
