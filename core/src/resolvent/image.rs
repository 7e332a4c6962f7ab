//! T_K of what is known, at a point: by rules that look for kinks and jumps, and by samples of what these leave.

use alloc::vec;
use alloc::vec::Vec;

use super::setup::{AxisNode, CubeNodes};
use super::walk::{drawn_near, power_of, towards_ends};
use super::{CellPoint, MOST_SCORED, Regular, Resolvent};
use crate::galerkin::{GalerkinError, MOST_DIMENSIONS, fill_products, reserve};
use crate::{Real, Uniforms};

/// The part of its largest that |g| has at least where rules are compared: coefficients that walks find count, too, where g is 0.
const LEAST_VALUE: f64 = 0.05;
/// The part of the error of an [`Image`] that rules may be off.
pub const BY_RULES: f64 = 0.01;
/// The part that is the standard error of samples.
const BY_SAMPLES: f64 = 0.3;
/// The fewest parts that are sampled if there is time for others: an error bar is then no matter of a few.
const LEAST_SAMPLED: usize = 32;
/// Halvings from which on a part is small: where a kink or a jump is, rules of a high order are no better than others.
const SMALL: i32 = 5;
/// Halvings of a cell, at most: beyond them numbers tell no points apart.
const MOST_HALVINGS: i32 = 44;
/// Roundings by which rules differ that agree: one may have nodes near its ends for nodes in them.
const ROUNDING: f64 = 256.0;
/// Points of a part of a cell that is sampled.
const SAMPLES: usize = 2;

/// How exact an image is to be, and how much it may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageBounds {
    /// The error of the value.
    pub error: f64,
    /// The most values of K, about.
    pub most: u64,
}

/// What is known of u, under T_K at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Image {
    /// (T_K g)(x), unbiased where parts of cells were sampled.
    pub value: f64,
    /// The variance of that.
    pub variance: f64,
    /// The sum of the squares of the variances of parts, each over its degrees of freedom.
    pub squares: f64,
    /// What rules that were compared differ by in all other parts: about how far they may be off.
    pub error: f64,
    /// The number of values of K.
    pub evaluations: u64,
}

/// The total degrees of the functions on a cell, in their order. Those of degree p or less are in the order of a basis of degree p.
///
/// ```
/// use fredholm_core::resolvent::total_degrees;
///
/// assert_eq!(total_degrees(2, 2), [0, 1, 2, 1, 2, 2]);
/// ```
#[must_use]
pub fn total_degrees(dimension: usize, degree: usize) -> Vec<usize> {
    match dimension {
        0 => vec![0],
        _ => {
            let first = 0..=degree;
            let more = first.flat_map(|own| {
                let rest = total_degrees(dimension - 1, degree - own);
                rest.into_iter().map(move |rest| own + rest)
            });
            more.collect()
        }
    }
}

/// Images of points: ∫ K(x, y) g(y) and ∫ K(x, y) ψ(y) over every cell.
///
/// A cell is cut in two along every axis where two rules of different orders disagree; that of x is cut at x first, and has rules that draw
/// near where K is singular there, and so have cells with [ends](super::ResolventTables::ends). Where so many cuts would take too long, as
/// along a jump in two dimensions, what is left is sampled, and no bias is.
#[derive(Debug)]
pub struct Images<'a, E: Regular> {
    resolvent: Resolvent<'a, E>,
    scored: usize,
    rules: [CubeNodes; 2],
    /// Rules of small parts, with polynomials of degree 1.
    small: [CubeNodes; 2],
    /// The points of either rule on all cells, with g there.
    known: [Vec<(E::Point, f64)>; 2],
    largest: f64,
}

/// Part of a cell: a cube of parameters, or of numbers whose powers are distances from a point of the cell.
#[derive(Clone, Copy, Debug)]
struct Part {
    cell: usize,
    anchor: Option<Anchor>,
    low: [f64; MOST_DIMENSIONS],
    halvings: i32,
    error: f64,
}

/// Where a part begins that draws near to a point.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    /// The parameters of the point.
    at: [f64; MOST_DIMENSIONS],
    /// The sides of the point along the axes, as bits.
    sides: u32,
    power: i32,
}

impl Anchor {
    /// How far the part reaches along an axis, and where.
    fn reach(&self, axis: usize) -> (f64, f64) {
        let at = self.at.get(axis).copied().unwrap_or(f64::NAN);
        match self.sides >> axis & 1 {
            0 => (at, -1.0),
            _ => (1.0 - at, 1.0),
        }
    }
}

/// What is seen at a node, times the size of its part.
#[derive(Clone, Copy, Debug)]
struct Node {
    kernel: f64,
    value: f64,
}

/// What an image is made of.
struct Sums<'s> {
    image: Image,
    integrals: &'s mut [f64],
    /// What was seen in the nodes of either rule on the last part.
    nodes: [Vec<Node>; 2],
}

impl<'a, E: Regular> Images<'a, E> {
    /// Images with integrals of so many functions on a cell, by two rules that are compared, of which the second one counts; and by two others
    /// on small parts. A rule has nodes for one axis, or for every axis its own: a jump along a diagonal then has none of them on it.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new(
        resolvent: Resolvent<'a, E>,
        scored: usize,
        [rules, small]: [&[Vec<Vec<AxisNode>>; 2]; 2],
    ) -> Result<Self, GalerkinError> {
        let dimension = resolvent.equation.dimension();
        let cube = |[one, other]: &[Vec<Vec<AxisNode>>; 2],
                    functions|
         -> Result<_, GalerkinError> {
            let [one, other] = [one, other].map(|axes| CubeNodes::new(axes, dimension, functions));
            Ok([one?, other?])
        };
        let mut images = Self {
            scored,
            rules: cube(rules, scored)?,
            small: cube(small, dimension + 1)?,
            known: [Vec::new(), Vec::new()],
            largest: 0.0,
            resolvent,
        };
        for (known, rule) in images.known.iter_mut().zip(&images.rules) {
            let cells = images.resolvent.tables.measures.len();
            *known = reserve(cells.saturating_mul(rule.shares.len()))?;
            for cell in 0..cells {
                for t in rule.places.chunks_exact(dimension) {
                    let y = images.resolvent.at(cell, t);
                    let value = images.resolvent.value(&y);
                    images.largest = images.largest.max(value.abs());
                    known.push((y.point, value));
                }
            }
        }
        Ok(images)
    }

    fn dimension(&self) -> usize {
        self.resolvent.equation.dimension()
    }

    /// Adds ∫ K(x, y) ψ(y) dμ(y) of every function of every cell to `integrals`, of zeros, and returns (T_K g)(x).
    pub fn image<U: Uniforms<f64>>(
        &self,
        x: &CellPoint<E::Point>,
        bounds: &ImageBounds,
        integrals: &mut [f64],
        draws: &mut U,
    ) -> Image {
        let cells = self.resolvent.tables.measures.len();
        let may = BY_RULES * bounds.error / cells as f64;
        let mut sums = Sums {
            image: Image::default(),
            integrals,
            nodes: [Vec::new(), Vec::new()],
        };
        let mut left = Vec::new();
        for cell in 0..cells {
            self.begin(x, cell, &mut |part| {
                left.extend(self.take(x, part, may, &mut sums));
            });
        }
        loop {
            left.sort_by(|a, b| b.error.total_cmp(&a.error));
            // The smallest ones may stay, if they are many.
            let (mut stay, mut squares) = (left.len(), 0.0);
            let most = BY_SAMPLES * bounds.error;
            while let Some(part) = left.get(stay.wrapping_sub(1)) {
                squares += part.error * part.error;
                if squares > most * most {
                    break;
                }
                stay -= 1;
            }
            if left.len() - stay < LEAST_SAMPLED {
                stay = left.len();
            }
            if stay == 0 || sums.image.evaluations >= bounds.most {
                break;
            }
            let mut after = left.split_off(stay);
            for part in left {
                if sums.image.evaluations >= bounds.most {
                    after.push(part);
                    continue;
                }
                for number in 0..1_u32 << self.dimension() {
                    let mut half = Part {
                        halvings: part.halvings + 1,
                        ..part
                    };
                    let width = power_of(0.5, half.halvings);
                    for (axis, low) in half.low.iter_mut().enumerate().take(self.dimension()) {
                        *low += f64::from(number >> axis & 1) * width;
                    }
                    after.extend(self.take(x, half, may, &mut sums));
                }
            }
            left = after;
        }
        for part in &left {
            self.sample(x, part, draws, &mut sums);
        }
        sums.image
    }

    /// Adds ∫ Φ(y) ψ(y) dμ(y) of every function of every cell to `integrals`, of zeros, and returns (g, Φ) by either rule, the finer one
    /// last.
    pub fn moments(
        &self,
        density: &dyn Fn(&CellPoint<E::Point>) -> f64,
        integrals: &mut [f64],
    ) -> [f64; 2] {
        let mut all = [0.0; 2];
        let rules = self.rules.iter().zip(&self.known);
        for (number, (all, (rule, known))) in all.iter_mut().zip(rules).enumerate() {
            for (cell, known) in known.chunks_exact(rule.shares.len()).enumerate() {
                let nodes = rule.iter(self.dimension(), self.scored).zip(known);
                for ((t, share, functions), (_, value)) in nodes {
                    let density = density(&self.resolvent.at(cell, t));
                    let weight = self.measure(cell) * share * density;
                    *all += weight * value;
                    let to = integrals.iter_mut().skip(cell * self.scored);
                    for (to, psi) in to.zip(functions).filter(|_| number > 0) {
                        *to += weight * psi;
                    }
                }
            }
        }
        all
    }

    /// The parts of a cell with which its integrals begin: those beside x, if it is at the same place.
    fn begin(&self, x: &CellPoint<E::Point>, cell: usize, visit: &mut dyn FnMut(Part)) {
        let near = self.resolvent.tables.near;
        let power = |cell: usize| near.get(cell).copied().unwrap_or(0).max(1);
        let whole = Part {
            cell,
            anchor: None,
            low: [0.0; MOST_DIMENSIONS],
            halvings: 0,
            error: 0.0,
        };
        let next = power(cell).max(power(x.cell));
        let [own, there] = [cell, x.cell].map(|cell| self.resolvent.equation.place(cell));
        if own != there {
            let is_next = self.dimension() == 1 && own.abs_diff(there) == 1 && next > 1;
            let is_after = own > there;
            let anchor = Anchor {
                at: [if is_after { 0.0 } else { 1.0 }; MOST_DIMENSIONS],
                sides: u32::from(is_after),
                power: next,
            };
            return visit(Part {
                anchor: is_next.then_some(anchor),
                ..whole
            });
        }
        for sides in 0..1 << self.dimension() {
            let anchor = Anchor {
                at: x.parameters,
                sides,
                power: next,
            };
            let has_room = (0..self.dimension()).all(|axis| anchor.reach(axis).0 > 0.0);
            if has_room {
                visit(Part {
                    anchor: Some(anchor),
                    ..whole
                });
            }
        }
    }

    /// Adds the integrals over a part, if both rules agree; else it is left.
    fn take(
        &self,
        x: &CellPoint<E::Point>,
        part: Part,
        may: f64,
        sums: &mut Sums<'_>,
    ) -> Option<Part> {
        self.look(x, &part, sums);
        let mut all = [[0.0; 2]; 2];
        let (rules, _) = self.rules_of(&part);
        for ((all, rule), nodes) in all.iter_mut().zip(rules).zip(&sums.nodes) {
            for (share, node) in rule.shares.iter().zip(nodes) {
                *all = [all[0] + share * node.value, all[1] + share * node.kernel];
            }
        }
        let [coarse, fine] = all;
        let [off, of_one] = [0, 1].map(|k| (coarse[k] - fine[k]).abs());
        let error = off.max(LEAST_VALUE * self.largest * of_one);
        // Values tell no less, and parts end somewhere.
        let epsilon = <E::Scalar as Real>::EPSILON.to_f64();
        let rounding = ROUNDING * epsilon * (fine[0].abs() + self.largest * fine[1].abs());
        let is_last = part.halvings >= MOST_HALVINGS;
        // As many parts lie along a jump.
        let may = may * power_of(0.5, (self.dimension() as i32 - 1) * part.halvings);
        // Written so that NaN is taken, and seen.
        if error > may.max(rounding) && !is_last {
            return Some(Part {
                error: self.fit(&part, &sums.nodes).1,
                ..part
            });
        }
        sums.image.value += fine[0];
        sums.image.error += error;
        self.integrate(&part, sums);
        None
    }

    /// Whether a part is all of a cell, where g is known in the nodes of its rules.
    fn is_whole(&self, part: &Part) -> bool {
        part.anchor.is_none() && part.halvings == 0 && !self.resolvent.has_ends(part.cell)
    }

    /// The rules of a part, and the number of functions of polynomials near K g there.
    fn rules_of(&self, part: &Part) -> (&[CubeNodes; 2], usize) {
        match part.halvings < SMALL {
            true => (&self.rules, self.scored),
            false => (&self.small, self.dimension() + 1),
        }
    }

    /// Looks at K and K g in the nodes of both rules on a part.
    fn look(&self, x: &CellPoint<E::Point>, part: &Part, sums: &mut Sums<'_>) {
        let measure = self.measure(part.cell);
        let equation = self.resolvent.equation;
        let (rules, _) = self.rules_of(part);
        let known = self.known.iter();
        for ((nodes, rule), known) in sums.nodes.iter_mut().zip(rules).zip(known) {
            let count = rule.shares.len();
            nodes.clear();
            sums.image.evaluations += count as u64;
            if !self.is_whole(part) {
                let places = rule.places.chunks_exact(self.dimension());
                nodes.extend(places.map(|at| self.node(x, part, at)));
                continue;
            }
            let own = known.get(part.cell * count..).unwrap_or(&[]);
            nodes.extend(own.iter().take(count).map(|(y, value)| {
                let kernel = measure * equation.kernel(&x.point, y).to_f64();
                Node {
                    kernel,
                    value: kernel * value,
                }
            }));
        }
    }

    /// K and K g where numbers in [0, 1]^d lie in a part, times its size.
    fn node(&self, x: &CellPoint<E::Point>, part: &Part, at: &[f64]) -> Node {
        let (t, share) = self.place(part, at);
        let t = t.get(..self.dimension()).unwrap_or(&[]);
        let y = self.resolvent.at(part.cell, t);
        let k = self.resolvent.equation.kernel(&x.point, &y.point);
        let kernel = self.measure(part.cell) * share * k.to_f64();
        Node {
            kernel,
            value: kernel * self.resolvent.value(&y),
        }
    }

    /// Adds the integrals of functions by what was seen in the nodes of the finer rule.
    fn integrate(&self, part: &Part, sums: &mut Sums<'_>) {
        let mut found = [0.0; MOST_SCORED];
        let own = found.get_mut(..self.scored).unwrap_or(&mut []);
        let ((rules, count), [_, nodes]) = (self.rules_of(part), &sums.nodes);
        let [_, rule] = rules;
        let mut there = [0.0; MOST_SCORED];
        for ((at, share, functions), node) in rule.iter(self.dimension(), count).zip(nodes) {
            let mut functions = functions;
            if !self.is_whole(part) {
                let (t, _) = self.place(part, at);
                let there = there.get_mut(..self.scored).unwrap_or(&mut []);
                fill_products(t.get(..self.dimension()).unwrap_or(&[]), there);
                functions = there;
            }
            for (integral, psi) in own.iter_mut().zip(functions) {
                *integral += share * node.kernel * psi;
            }
        }
        let to = sums.integrals.iter_mut().skip(part.cell * self.scored);
        to.zip(own).for_each(|(to, own)| *to += *own);
    }

    /// The coefficients of a polynomial near K g on a part, times its size, and the standard error of points that say what it leaves.
    fn fit(&self, part: &Part, nodes: &[Vec<Node>; 2]) -> ([f64; MOST_SCORED], f64) {
        let mut polynomial = [0.0; MOST_SCORED];
        let ((rules, count), [of_coarse, of_fine]) = (self.rules_of(part), nodes);
        let [coarse, fine] = rules;
        for ((_, share, functions), node) in fine.iter(self.dimension(), count).zip(of_fine) {
            for (to, psi) in polynomial.iter_mut().zip(functions) {
                *to += share * node.value * psi;
            }
        }
        // Where the polynomial has not been fitted.
        let all = coarse.iter(self.dimension(), count).zip(of_coarse);
        let squares = all.map(|((_, share, functions), node)| {
            let left = node.value - dot(functions, &polynomial);
            share * left * left
        });
        let squares = squares.sum::<f64>() / SAMPLES as f64;
        (polynomial, Real::sqrt(squares))
    }

    /// Adds the integrals over a part whose rules do not agree: that of K g is the rule's for a polynomial near it, and points say what
    /// this leaves, so that it is right in the mean.
    fn sample<U: Uniforms<f64>>(
        &self,
        x: &CellPoint<E::Point>,
        part: &Part,
        draws: &mut U,
        sums: &mut Sums<'_>,
    ) {
        self.look(x, part, sums);
        self.integrate(part, sums);
        let (polynomial, _) = self.fit(part, &sums.nodes);
        let mut scores = [0.0; SAMPLES];
        for score in &mut scores {
            let mut at = [0.0; MOST_DIMENSIONS];
            let at = at.get_mut(..self.dimension()).unwrap_or(&mut []);
            at.iter_mut().for_each(|at| *at = draws.uniform());
            let mut functions = [0.0; MOST_SCORED];
            let (_, count) = self.rules_of(part);
            let functions = functions.get_mut(..count).unwrap_or(&mut []);
            fill_products(at, functions);
            let left = self.node(x, part, at).value - dot(functions, &polynomial);
            *score = left / SAMPLES as f64;
        }
        let [one, other] = scores;
        let variance = (one - other) * (one - other);
        sums.image.value += polynomial.first().copied().unwrap_or(f64::NAN) + one + other;
        sums.image.variance += variance;
        sums.image.squares += variance * variance;
        sums.image.evaluations += SAMPLES as u64;
    }

    /// The parameters of a point of a part at numbers in [0, 1]^d, and the share of the cell for which it stands.
    fn place(&self, part: &Part, at: &[f64]) -> ([f64; MOST_DIMENSIONS], f64) {
        let (mut place, mut share) = ([0.0; MOST_DIMENSIONS], 1.0);
        let width = power_of(0.5, part.halvings);
        // Rounding tells points apart that are as far as that.
        let epsilon = <E::Scalar as Real>::EPSILON.to_f64();
        let nearest = 4.0 * epsilon * self.resolvent.tables.measures.len() as f64;
        let all_ends = self.resolvent.ends_of(part.cell);
        let axes = place.iter_mut().zip(at).zip(&part.low);
        for (axis, ((t, at), low)) in axes.enumerate().take(self.dimension()) {
            let own = low + width * at;
            share *= width;
            let ends = all_ends.get(2 * axis..2 * (axis + 1)).unwrap_or(&[]);
            let Some(anchor) = &part.anchor else {
                *t = own;
                share *= towards_ends(t, ends);
                continue;
            };
            let (length, side) = anchor.reach(axis);
            let end = if side > 0.0 {
                ends.last()
            } else {
                ends.first()
            };
            let power = end.map_or(1, |end| end.power);
            let (is_far, part, own) = drawn_near(own, [anchor.power, power]);
            let distance = length * part;
            share *= length * own;
            let from = anchor.at.get(axis).copied().unwrap_or(f64::NAN);
            *t = match (end, side > 0.0) {
                (Some(end), true) if is_far => 1.0 - distance.max(end.nearest),
                (Some(end), false) if is_far => distance.max(end.nearest),
                _ => (from + side * distance.max(nearest)).clamp(0.0, 1.0),
            };
        }
        (place, share)
    }

    fn measure(&self, cell: usize) -> f64 {
        let measures = self.resolvent.tables.measures;
        measures.get(cell).copied().unwrap_or(f64::NAN)
    }
}

/// Σ a b.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use alloc::vec;
    use alloc::vec::Vec;

    use super::{ImageBounds, Images};
    use crate::galerkin::Cells;
    use crate::resolvent::{AxisNode, Regular, Resolvent, ResolventTables};
    use crate::{DefaultGenerator, Located, RngUniforms, Space, WalkSeeds};

    /// One cell [0, 1]^D, F = 1, and K = f(x − y).
    struct Unit<const D: usize>(fn(&[f64; D]) -> f64);

    impl<const D: usize> Space for Unit<D> {
        type Scalar = f64;
        type Point = [f64; D];
    }

    impl<const D: usize> Cells for Unit<D> {
        const DIMENSION: usize = D;

        fn cells(&self) -> usize {
            1
        }

        fn locate(&self, _: &[f64; D]) -> usize {
            0
        }

        fn measure(&self, _: usize) -> f64 {
            1.0
        }

        fn point(&self, _: usize, t: &[f64]) -> [f64; D] {
            core::array::from_fn(|k| t[k])
        }

        fn parameters(&self, x: &Located<[f64; D]>, t: &mut [f64]) {
            t.copy_from_slice(&x.point);
        }

        fn at(&self, coordinates: &[f64]) -> Option<[f64; D]> {
            coordinates.try_into().ok()
        }
    }

    impl<const D: usize> Regular for Unit<D> {
        fn kernel(&self, x: &[f64; D], y: &[f64; D]) -> f64 {
            (self.0)(&core::array::from_fn(|k| x[k] - y[k]))
        }

        fn source(&self, _: &[f64; D]) -> f64 {
            1.0
        }
    }

    /// The images of T_K 1 at some points that may be off by so much, with what is right there.
    fn images<const D: usize>(
        kernel: fn(&[f64; D]) -> f64,
        right: fn(&[f64; D]) -> f64,
        (error, near): (f64, i32),
    ) -> Vec<(super::Image, f64)> {
        let node = |at, share| AxisNode { at, share };
        let closed = vec![
            node(0.0, 1.0 / 6.0),
            node(0.5, 2.0 / 3.0),
            node(1.0, 1.0 / 6.0),
        ];
        let gauss = [0.5 - 0.75_f64.sqrt() / 3.0, 0.5 + 0.75_f64.sqrt() / 3.0];
        let rules = [closed, gauss.map(|at| node(at, 0.5)).to_vec()].map(|axis| vec![axis]);
        let zeros = [0.0];
        let tables = ResolventTables {
            functions: 1,
            measures: &[1.0],
            kernel: &zeros,
            resolvent: &zeros,
            source: &zeros,
            correction: &zeros,
            steps: &zeros,
            stays: &zeros,
            jumps: &zeros,
            near: &[near],
            ends: &[],
        };
        let equation = Unit(kernel);
        let resolvent = Resolvent {
            equation: &equation,
            tables,
            coarse: None,
        };
        let images = Images::new(resolvent, D + 1, [&rules, &rules]).unwrap();
        let bounds = ImageBounds {
            error,
            most: 1 << 17,
        };
        let seeds = WalkSeeds::<DefaultGenerator>::new(1, 0);
        let all = (0..200).map(|number| {
            let step = [0.618_034, 0.754_878];
            let at = |axis: usize| ((number as f64 + 0.5) * step[axis]).fract();
            let x = images.resolvent.at(0, &core::array::from_fn::<_, D, _>(at));
            let mut integrals = vec![0.0; D + 1];
            let mut draws = RngUniforms(seeds.generator(number));
            let image = images.image(&x, &bounds, &mut integrals, &mut draws);
            (image, right(&x.point))
        });
        all.collect()
    }

    fn width(x: f64) -> f64 {
        (x + 0.3).min(1.0) - (x - 0.3).max(0.0)
    }

    #[test]
    fn kinks_jumps_and_singularities_are_within_the_error() {
        let kink = |x: &[f64; 1]| (-(x[0] - 0.1).abs()).exp();
        let of_kink = |x: &[f64; 1]| {
            let middle = x[0] - 0.1;
            match middle > 0.0 {
                true => 2.0 - (-middle).exp() - (middle - 1.0).exp(),
                false => middle.exp() - (middle - 1.0).exp(),
            }
        };
        let jump = |x: &[f64; 1]| f64::from(u8::from(x[0].abs() < 0.3));
        let singular = |x: &[f64; 1]| x[0].abs().powf(-0.5);
        let of_singular = |x: &[f64; 1]| 2.0 * (x[0].sqrt() + (1.0 - x[0]).sqrt());
        let all = [
            images(kink, of_kink, (1e-8, 0)),
            images(jump, |x| width(x[0]), (1e-8, 0)),
            images(singular, of_singular, (1e-8, 4)),
        ];
        for (number, images) in all.iter().enumerate() {
            for (image, right) in images {
                let off = (image.value - right).abs();
                assert!(
                    image.variance == 0.0 && image.error < 1e-8,
                    "{number} {image:?}"
                );
                assert!(off < 1e-8, "{number} {off} {image:?}");
            }
        }
    }

    /// Where 200 numbers z have about the variance 1, the sum of the squares is between 100 and 400 but once in 10⁴ times, and the mean within 4/√200 ·
    /// √2, even where variances are those of two points.
    #[test]
    fn jumps_in_the_plane_are_sampled() {
        let jump = |x: &[f64; 2]| f64::from(u8::from(x[0].abs() < 0.3 && x[1].abs() < 0.3));
        let images = images(jump, |x| width(x[0]) * width(x[1]), (1e-4, 0));
        let z = |(image, right): &(super::Image, f64)| {
            assert!(
                image.variance.sqrt() < 1e-4 && image.error < 1e-5,
                "{image:?}"
            );
            (image.value - right) / image.variance.sqrt()
        };
        let all: Vec<f64> = images.iter().map(z).collect();
        let mean = all.iter().sum::<f64>() / 200.0;
        let squares: f64 = all.iter().map(|z| z * z).sum();
        assert!(mean.abs() < 0.4, "{mean}");
        assert!((100.0..400.0).contains(&squares), "{squares}");
    }
}
