//! Which pairs go where: for the least variance times work.
//!
//! # Formulas
//!
//! v, and so e = u − v and r = F + T_kp v − v, do not depend on the kinds of pairs. What depends on them is
//! h, G = v − T_hp v, and through them s, c and w of the [module](super). In row i, for x ∈ X_i, the kind of the
//! pair (i, j) stands in
//!
//! ```text
//! α_j = ∫_Xj (D² s + 2 k D c) p,   γ_j = ∫_Xj (k h c + h D s) p,   t_j = ∫_Xj D v p,   F − G = r − Σ_j t_j
//! ```
//!
//! where D = k − h: with h = 0 outside, D = 0 on pointwise pairs. Let a = (I − T_k²p)^−* φ²p0 and
//! b = (I − T_khp)^−* 2 T_kDp^* a be the adjoints of w and c. The first variation of Var ζ = (w, φ²p0) − (e, φp0)²
//! by the kinds in row i is that of
//!
//! ```text
//! ∫_Xi (a [Σ_j α_j + (F − G)²/q] + b [Σ_j γ_j + (F − G) G/q]) dμ
//! ```
//!
//! (with the collision estimator the sources are (F − G)(2e − (F − G)) and (F − G) v + G (e − (F − G))). The term
//! ∫∫ D² s a p is that of (26) of Heinrich 1995; the others are as large, and of either sign. For changes in one row what is left
//! out is of third order in D: how s changes with them. Rows act on each other through b and c, which are taken as they were: of second
//! order, and mended by choosing again from what was chosen. Pairs of a row are not independent: Σ t_j is squared,
//! and a pair with h = 0 that does not matter by itself does where many like it are left out.
//!
//! The work of a walk is that of its visited states, and of an exact integral for every pointwise pair of row i
//! wherever G is scored in X_i: where it is absorbed, or with the collision estimator at every visit.
//!
//! V × C has its least value where V + λC has its own, for λ = V/C; and for a given λ rows are independent.
//! So every row is solved for a sequence of λ, pair by pair until no single pair changes, and the λ of the least V × C is taken.

use alloc::vec::Vec;

use super::analysis::{Matrix, Nodal, Pass, Seconds, seconds_of};
use super::{Analysis, Level, Moments, Node, Prediction, Setting, VarianceError};
use crate::galerkin::{GalerkinError, PairKind, Pairs, buffer, reserve};
use crate::{Estimator, Kernel, Located, Neighbour, Real, Sampler, Source};

/// λ are V/C of what is there times 4^this, and a fourth of it, and so on.
const LARGEST: i32 = 2;
/// So many of them: down to 4^−6. V × C is flat where it is least, and whoever chooses again begins near it.
const MULTIPLIERS: usize = 9;
/// Passes over a row, at most.
const PASSES: usize = 30;
/// No variance that is predicted is taken for less than this part of the one that was there: the prediction is of
/// first order.
const TRUSTED: f64 = 1e-3;

/// What a pair may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Possible {
    /// In S: the transition mass is positive on all of X_i.
    pub galerkin: bool,
    /// Pointwise, if there is an exact integral: its time over that of a visited state.
    pub pointwise: Option<f64>,
    /// Left out even if it may be something else: the level sees how much that costs.
    pub left_out: bool,
}

/// What there is to choose from.
pub struct Terms<'a, H: ?Sized> {
    /// n.
    pub cells: usize,
    /// A neighbour equation with all pairs in S that may be: for its h.
    pub galerkin: &'a H,
    /// What the pair (i, j) may be.
    pub possible: &'a (dyn Fn(usize, usize) -> Possible + Sync),
}

impl<H: ?Sized> core::fmt::Debug for Terms<'_, H> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Terms")
            .field("cells", &self.cells)
            .finish_non_exhaustive()
    }
}

/// What walks with a choice of pairs are worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Worth {
    /// Var ζ of every functional.
    pub variances: Vec<f64>,
    /// The mean work of a walk, in visited states.
    pub work: f64,
}

impl Worth {
    /// Variance × work over that of another choice, the variance in the geometric mean over the functionals.
    #[must_use]
    pub fn relative_to(&self, other: &Self) -> f64 {
        let pairs = self.variances.iter().zip(&other.variances);
        let positive = pairs.filter(|(own, other)| **own > 0.0 && **other > 0.0);
        let (sum, count) = positive.fold((0.0, 0.0), |(sum, count), (own, other)| {
            (sum + Real::ln(own / other), count + 1.0)
        });
        Real::exp(sum / Real::max(count, 1.0)) * (self.work / other.work)
    }
}

/// A choice.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The kinds of all pairs, for [`PairTable::new`](crate::galerkin::PairTable::new).
    pub table: Vec<u8>,
    /// Var ζ over what it was, in the mean over the functionals: predicted, of first order.
    pub variance: f64,
    /// The mean work of a walk, in visited states.
    pub work: f64,
}

/// A row of pairs while it is worked on.
#[derive(Clone, Debug, Default)]
pub struct Row {
    kinds: Vec<u8>,
    /// Variance and price, for every λ.
    outcomes: Vec<[f64; 2]>,
    /// b of the nodes of a site.
    mixed: Vec<f64>,
    failed: Option<GalerkinError>,
}

/// A point from which steps are taken, with what is known there.
#[derive(Clone, Copy)]
struct Place<P> {
    x: Located<P>,
    /// a and b, times the weight of the node.
    occupation: f64,
    mixed: f64,
    source: f64,
    residual: f64,
    error: f64,
    value: f64,
    /// 1/q; 0 where walks are not absorbed.
    per_absorption: f64,
}

impl<P: Copy> Place<P> {
    fn new(node: &Node<P>, occupation: f64, mixed: f64) -> Self {
        Self {
            x: node.x,
            occupation,
            mixed,
            source: node.source,
            residual: node.residual,
            error: node.error,
            value: node.value,
            per_absorption: if node.absorption > 0.0 {
                1.0 / node.absorption
            } else {
                0.0
            },
        }
    }

    /// What F − G = `difference` adds.
    fn of_sources(&self, estimator: Estimator, difference: f64) -> f64 {
        let g = self.source - difference;
        let [squared, mixed] = match estimator {
            Estimator::Absorption => {
                [difference, g].map(|by| difference * by * self.per_absorption)
            }
            Estimator::Collision => [
                difference * (2.0 * self.error - difference),
                difference * self.value + g * (self.error - difference),
            ],
        };
        self.occupation * squared + self.mixed * mixed
    }
}

/// What a pair adds as one kind, by the point: a α + b γ, and t.
#[derive(Clone, Copy, Default)]
struct Part {
    fixed: f64,
    t: f64,
}

/// The parts of a pair in S, pointwise and left out: in the order of the kinds.
type Parts = [Part; 3];

const KINDS: [PairKind; 3] = [PairKind::Galerkin, PairKind::Pointwise, PairKind::None];

/// A row with all that its kinds decide.
struct Problem<'a, P> {
    estimator: Estimator,
    places: &'a [Place<P>],
    /// For every cell and every place.
    parts: &'a [Parts],
    possible: &'a [Possible],
    /// The pairs that may be anything at all.
    free: &'a [usize],
    /// How often G is scored in the row.
    scorings: f64,
}

/// Kinds of a row, with F − G in its places.
#[derive(Clone)]
struct State {
    kinds: Vec<u8>,
    differences: Vec<f64>,
}

impl<P: Copy> Problem<'_, P> {
    fn parts(&self, j: usize) -> &[Parts] {
        let count = self.places.len();
        self.parts.get(j * count..(j + 1) * count).unwrap_or(&[])
    }

    fn price(&self, j: usize, kind: u8) -> f64 {
        let price = self.possible.get(j).and_then(|of| of.pointwise);
        match (kind, price) {
            (1, Some(price)) => self.scorings * price,
            _ => 0.0,
        }
    }

    fn allows(&self, j: usize, kind: PairKind) -> bool {
        let of = self.possible.get(j).copied().unwrap_or_default();
        match kind {
            PairKind::Galerkin => of.galerkin,
            PairKind::Pointwise => of.pointwise.is_some(),
            PairKind::None => of.left_out || !(of.galerkin || of.pointwise.is_some()),
        }
    }

    fn state(&self, kinds: Vec<u8>) -> Result<State, GalerkinError> {
        let mut differences = buffer(self.places.len())?;
        for (difference, place) in differences.iter_mut().zip(self.places) {
            *difference = place.residual;
        }
        for (j, &kind) in kinds.iter().enumerate() {
            for (difference, parts) in differences.iter_mut().zip(self.parts(j)) {
                *difference -= part(parts, kind).t;
            }
        }
        Ok(State { kinds, differences })
    }

    /// All pairs of the first of these kinds that they may be.
    fn all(&self, order: [PairKind; 3]) -> Result<State, GalerkinError> {
        let mut kinds = buffer(self.possible.len())?;
        for (j, kind) in kinds.iter_mut().enumerate() {
            let first = order.into_iter().find(|&kind| self.allows(j, kind));
            *kind = first.unwrap_or_default() as u8;
        }
        self.state(kinds)
    }

    /// Variance and price of a state.
    fn outcome(&self, state: &State) -> [f64; 2] {
        let places = self.places.iter().zip(&state.differences);
        let mut variance: f64 = places
            .map(|(place, &difference)| place.of_sources(self.estimator, difference))
            .sum();
        let mut price = 0.0;
        for (j, &kind) in state.kinds.iter().enumerate() {
            let parts = self.parts(j).iter();
            variance += parts.map(|parts| part(parts, kind).fixed).sum::<f64>();
            price += self.price(j, kind);
        }
        [variance, price]
    }

    /// What the change of a pair adds to the variance.
    fn change(&self, state: &State, j: usize, [from, to]: [u8; 2]) -> f64 {
        let places = self.places.iter().zip(&state.differences);
        let changes = places.zip(self.parts(j));
        changes
            .map(|((place, &difference), parts)| {
                let (old, new) = (part(parts, from), part(parts, to));
                let then = difference + old.t - new.t;
                new.fixed - old.fixed + place.of_sources(self.estimator, then)
                    - place.of_sources(self.estimator, difference)
            })
            .sum()
    }

    /// Changes pairs one by one, until none is better changed.
    fn descend(&self, state: &mut State, lambda: f64) {
        for _ in 0..PASSES {
            let mut changed = false;
            for &j in self.free {
                let Some(&from) = state.kinds.get(j) else {
                    continue;
                };
                let mut best = (0.0, from);
                for kind in KINDS {
                    let to = kind as u8;
                    if to == from || !self.allows(j, kind) {
                        continue;
                    }
                    let price = self.price(j, to) - self.price(j, from);
                    let change = self.change(state, j, [from, to]) + lambda * price;
                    if change < best.0 {
                        best = (change, to);
                    }
                }
                let to = best.1;
                if to == from {
                    continue;
                }
                for (difference, parts) in state.differences.iter_mut().zip(self.parts(j)) {
                    *difference += part(parts, from).t - part(parts, to).t;
                }
                if let Some(kind) = state.kinds.get_mut(j) {
                    *kind = to;
                }
                changed = true;
            }
            if !changed {
                break;
            }
        }
    }

    /// Calls `visit` with the best that is found for every λ, or for that of one number: from cheap pairs on for falling
    /// ones, and from pointwise pairs on for rising ones.
    fn solve(
        &self,
        lambdas: &[f64],
        wanted: Option<usize>,
        mut visit: impl FnMut(usize, &State, [f64; 2]),
    ) -> Result<(), GalerkinError> {
        use PairKind::{Galerkin, None, Pointwise};
        let mut rising = self.all([Pointwise, Galerkin, None])?;
        let mut of_rising: Vec<(State, [f64; 2])> = reserve(lambdas.len())?;
        let first = wanted.unwrap_or(0);
        for &lambda in lambdas.iter().skip(first).rev() {
            self.descend(&mut rising, lambda);
            if wanted.is_none() {
                of_rising.push((rising.clone(), self.outcome(&rising)));
            }
        }
        if wanted.is_some() {
            let outcome = self.outcome(&rising);
            of_rising.push((rising, outcome));
        }
        let mut falling = self.all([Galerkin, None, Pointwise])?;
        for (number, &lambda) in lambdas.iter().enumerate() {
            self.descend(&mut falling, lambda);
            if number < first {
                continue;
            }
            let own = self.outcome(&falling);
            let value = |[variance, price]: [f64; 2]| variance + lambda * price;
            match of_rising.pop() {
                Some((other, of_other)) if value(of_other) < value(own) => {
                    visit(number, &other, of_other);
                }
                Some(_) => visit(number, &falling, own),
                // That of the wanted one was the last.
                Option::None => break,
            }
        }
        Ok(())
    }
}

fn part(parts: &Parts, kind: u8) -> Part {
    parts.get(usize::from(kind)).copied().unwrap_or_default()
}

/// What walks do, by sites: in the mean over the functionals.
struct Flow<P> {
    /// a, each functional relative to its variance.
    occupation: Vec<f64>,
    /// Where walks that start in one point do: its site, the node, and its share.
    starts: Vec<(usize, Node<P>, f64, Vec<Moments>)>,
    /// Expected scores of G, by cells.
    scorings: Vec<f64>,
    /// Visited states of a walk.
    states: f64,
}

impl<E, N, S, L> Setting<'_, E, N, S, L>
where
    E: Sampler<Scalar = f64, Point = L::Point> + Kernel + Source,
    N: Neighbour<Scalar = f64, Point = L::Point> + ?Sized,
    S: Pairs,
    L: Level,
{
    /// Variances and work with the pairs of this setting. Of [`Terms::possible`] the prices count.
    ///
    /// # Errors
    /// [`VarianceError::Infinite`], or no memory.
    pub fn worth<H: ?Sized>(
        &self,
        analysis: &Analysis<L::Point>,
        predictions: &[Prediction<L::Point>],
        terms: &Terms<'_, H>,
    ) -> Result<Worth, VarianceError> {
        let mut variances = reserve(predictions.len())?;
        for prediction in predictions {
            variances.push(prediction.preconditioned.ok_or(VarianceError::Infinite)?);
        }
        let flow = self.flow(analysis, predictions, terms.cells)?;
        let work = self.work(&flow, terms);
        Ok(Worth { variances, work })
    }

    /// The mean work of a walk with the pairs of this setting.
    fn work<H: ?Sized>(&self, flow: &Flow<L::Point>, terms: &Terms<'_, H>) -> f64 {
        let rows = flow.scorings.iter().enumerate();
        let prices = rows.map(|(i, scorings)| {
            let pairs = self.pairs.pointwise(i, terms.cells);
            let prices = pairs.filter_map(|j| (terms.possible)(i, j).pointwise);
            scorings * prices.sum::<f64>()
        });
        flow.states + prices.sum::<f64>()
    }

    /// The kinds of all pairs for the least variance × work, as far as the first variation of what was analysed
    /// tells: the better the nearer its pairs are to those that are chosen, so that choosing again from what
    /// was chosen, and looking at its [`worth`](Self::worth), is worth while.
    ///
    /// Sites must be cells or parts of them. `run` is as in [`analyse`](Self::analyse), for rows of pairs. O(n²)
    /// evaluations of k and h for n nodes, three times, and n² bytes for n cells.
    ///
    /// # Errors
    /// [`VarianceError`].
    pub fn choose<H>(
        &self,
        analysis: &Analysis<L::Point>,
        predictions: &[Prediction<L::Point>],
        terms: &Terms<'_, H>,
        run: impl Fn(&mut [Row], &Pass<'_, Row>),
    ) -> Result<Chosen, VarianceError>
    where
        H: Neighbour<Scalar = f64, Point = L::Point> + Sync + ?Sized,
        Self: Sync,
        L::Point: Send + Sync,
    {
        let n = terms.cells;
        let flow = self.flow(analysis, predictions, n)?;
        let work = self.work(&flow, terms);
        let places = self.places(analysis, &flow, n, &run)?;
        let seconds = Nodal::new(&analysis.sites, &analysis.means.seconds, seconds_of)?;
        let lambda = |number: usize| {
            let exponent = LARGEST - number as i32;
            let power = if exponent < 0 {
                1.0 / (1_u64 << (-2 * exponent)) as f64
            } else {
                (1_u64 << (2 * exponent)) as f64
            };
            power / work
        };
        let mut lambdas: Vec<f64> = buffer(MULTIPLIERS)?;
        for (number, place) in lambdas.iter_mut().enumerate() {
            *place = lambda(number);
        }
        // Once for all λ, and once for the best.
        let mut rows: Vec<Row> = reserve(n)?;
        rows.resize_with(n, Row::default);
        for row in &mut rows {
            row.outcomes = buffer(MULTIPLIERS + 1)?;
            row.kinds = buffer(n)?;
        }
        let scorings = |i: usize| flow.scorings.get(i).copied().unwrap_or(0.0);
        let solve = |i: usize, row: &mut Row, best: Option<usize>| {
            let of = Of {
                estimator: analysis.estimator,
                seconds: &seconds,
                places: places.get(i).map_or(&[][..], |places| places),
                scorings: scorings(i),
                cell: i,
            };
            if let Err(error) = self.solve_row(&of, terms, &lambdas, best, row) {
                row.failed = Some(error);
            }
        };
        run(&mut rows, &|i, row| solve(i, row, None));
        let mut sums: Vec<[f64; 2]> = buffer(MULTIPLIERS + 1)?;
        for row in &rows {
            if let Some(error) = row.failed {
                return Err(error.into());
            }
            for (sum, [variance, price]) in sums.iter_mut().zip(&row.outcomes) {
                sum[0] += variance;
                sum[1] += price;
            }
        }
        let [now, _] = sums.last().copied().unwrap_or_default();
        let predicted = |[variance, price]: [f64; 2]| {
            [
                Real::max(1.0 + variance - now, TRUSTED),
                flow.states + price,
            ]
        };
        let product = |number: usize| {
            let [variance, work] = sums.get(number).map_or([f64::NAN; 2], |&s| predicted(s));
            variance * work
        };
        // Of equals the first, which is the one with the largest λ.
        let best = (0..MULTIPLIERS).fold(0, |best, number| {
            if product(number) < product(best) {
                number
            } else {
                best
            }
        });
        let [variance, least] = sums.get(best).map_or([f64::NAN; 2], |&sum| predicted(sum));
        let keep = !(variance * least < work);
        if keep {
            // What is there is no worse.
            run(&mut rows, &|i, row| self.keep(i, row));
        } else {
            run(&mut rows, &|i, row| solve(i, row, Some(best)));
        }
        let mut table = reserve(
            n.checked_mul(n)
                .ok_or(GalerkinError::Memory { bytes: None })?,
        )?;
        for row in &rows {
            if let Some(error) = row.failed {
                return Err(error.into());
            }
            table.extend_from_slice(&row.kinds);
        }
        let [variance, work] = if keep { [1.0, work] } else { [variance, least] };
        Ok(Chosen {
            table,
            variance,
            work,
        })
    }

    fn keep(&self, i: usize, row: &mut Row) {
        for (j, kind) in row.kinds.iter_mut().enumerate() {
            *kind = self.pairs.kind(i, j) as u8;
        }
    }

    /// The integrals of a row, and its best kinds: for all λ what they come to, and what comes of the pairs that are
    /// there; or for one λ the kinds.
    fn solve_row<H>(
        &self,
        of: &Of<'_, L::Point>,
        terms: &Terms<'_, H>,
        lambdas: &[f64],
        best: Option<usize>,
        row: &mut Row,
    ) -> Result<(), GalerkinError>
    where
        H: Neighbour<Scalar = f64, Point = L::Point> + Sync + ?Sized,
    {
        let n = terms.cells;
        let count = of.places.len();
        let mut possible: Vec<Possible> = buffer(n)?;
        for (j, possible) in possible.iter_mut().enumerate() {
            *possible = (terms.possible)(of.cell, j);
        }
        let mut parts: Vec<Parts> = buffer(n.saturating_mul(count))?;
        for (number, place) in of.places.iter().enumerate() {
            for site in 0..self.level.sites() {
                self.level.steps(&place.x.point, site, |step| {
                    let y = self.neighbour.locate(step.point);
                    let k = self.equation.kernel(&place.x.point, &y.point);
                    let [s, c] = of.seconds.at(site, step.node).unwrap_or([f64::NAN; 2]);
                    let v = self.neighbour.value(&y);
                    let in_s = possible.get(y.cell).is_some_and(|of| of.galerkin);
                    let Some(parts) = parts.get_mut(y.cell * count + number) else {
                        return;
                    };
                    let mut add = |kind: PairKind, h: f64| {
                        let d = k - h;
                        let alpha = d * (d * s + 2.0 * k * c);
                        let gamma = h * (k * c + d * s);
                        if let Some(part) = parts.get_mut(kind as usize) {
                            part.fixed +=
                                step.weight * (place.occupation * alpha + place.mixed * gamma);
                            part.t += step.weight * d * v;
                        }
                    };
                    add(PairKind::Pointwise, k);
                    add(PairKind::None, 0.0);
                    if in_s {
                        add(PairKind::Galerkin, terms.galerkin.kernel(&place.x, &y, k));
                    }
                });
            }
        }
        let mut free = reserve(n)?;
        free.extend((0..n).filter(|&j| {
            let of = possible.get(j);
            of.is_some_and(|of| of.galerkin || of.pointwise.is_some())
        }));
        let problem = Problem {
            estimator: of.estimator,
            places: of.places,
            parts: &parts,
            possible: &possible,
            free: &free,
            scorings: of.scorings,
        };
        if best.is_none() {
            self.keep(of.cell, row);
            let now = problem.state(core::mem::take(&mut row.kinds))?;
            if let Some(last) = row.outcomes.last_mut() {
                *last = problem.outcome(&now);
            }
            row.kinds = now.kinds;
        }
        problem.solve(lambdas, best, |number, state, outcome| {
            if let Some(place) = row.outcomes.get_mut(number).filter(|_| best.is_none()) {
                *place = outcome;
            }
            if best == Some(number) {
                row.kinds.copy_from_slice(&state.kinds);
            }
        })
    }

    /// Where walks are, and how often they score.
    fn flow(
        &self,
        analysis: &Analysis<L::Point>,
        predictions: &[Prediction<L::Point>],
        cells: usize,
    ) -> Result<Flow<L::Point>, VarianceError> {
        let sites = &analysis.sites;
        let n = sites.len();
        let (mut first, mut visits) = (buffer(n)?, buffer(n)?);
        let mut own: Vec<f64> = buffer(n)?;
        let mut scorings: Vec<f64> = buffer(cells)?;
        let mut starts = Vec::new();
        let mut states = 0.0;
        // Scores in a point: one where it is absorbed, or one at every visit.
        let score = |node: &Node<L::Point>| match analysis.estimator {
            Estimator::Absorption => node.absorption,
            Estimator::Collision => 1.0,
        };
        let share = 1.0 / predictions.len().max(1) as f64;
        let mut step_mass: Vec<f64> = buffer(n)?;
        for prediction in predictions {
            let variance = prediction.preconditioned.ok_or(VarianceError::Infinite)?;
            // A functional without variance has no wishes.
            let weight = if variance > 0.0 {
                share / variance
            } else {
                0.0
            };
            for (first, of) in first.iter_mut().zip(&prediction.first) {
                *first += weight * of;
            }
            for (own, of) in own.iter_mut().zip(&prediction.own) {
                *own += weight * of;
            }
            for (initial, site) in prediction.initial.iter().zip(sites) {
                for (mass, moments) in step_mass.iter_mut().zip(&site.row) {
                    *mass += share * initial * moments.mass;
                }
            }
            for (visits, initial) in visits.iter_mut().zip(&prediction.initial) {
                *visits += share * initial;
            }
            if let Some((own, site)) = &prediction.start
                && let Some(node) = site.nodes.first()
            {
                states += share;
                if let Some(of_cell) = scorings.get_mut(node.x.cell) {
                    *of_cell += share * score(node);
                }
                for (mass, moments) in step_mass.iter_mut().zip(&site.row) {
                    *mass += share * moments.mass;
                }
                let mut row = reserve(site.row.len())?;
                row.extend_from_slice(&site.row);
                starts.push((*own, *node, weight, row));
            }
        }
        let matrix = Matrix::adjoint(sites, |m: &Moments| m.kk);
        let mut occupation = matrix.resolve(&first)?;
        for (occupation, own) in occupation.iter_mut().zip(&own) {
            *occupation += own;
        }
        let matrix = Matrix::adjoint(sites, |m: &Moments| m.mass);
        for (visits, later) in visits.iter_mut().zip(matrix.resolve(&step_mass)?) {
            *visits += later;
        }
        for (site, visits) in sites.iter().zip(&visits) {
            states += visits;
            for node in &site.nodes {
                if let Some(of_cell) = scorings.get_mut(node.x.cell) {
                    *of_cell += visits * node.weight / site.measure * score(node);
                }
            }
        }
        Ok(Flow {
            occupation,
            starts,
            scorings,
            states,
        })
    }

    /// All nodes by cells, with a and b, and the points in which walks start.
    fn places(
        &self,
        analysis: &Analysis<L::Point>,
        flow: &Flow<L::Point>,
        cells: usize,
        run: &impl Fn(&mut [Row], &Pass<'_, Row>),
    ) -> Result<Vec<Vec<Place<L::Point>>>, VarianceError>
    where
        Self: Sync,
        L::Point: Send + Sync,
    {
        let sites = &analysis.sites;
        // What b has by sites.
        let mut source: Vec<f64> = buffer(sites.len())?;
        for (site, occupation) in sites.iter().zip(&flow.occupation) {
            for (source, m) in source.iter_mut().zip(&site.row) {
                *source += occupation * 2.0 * (m.kk - m.kh);
            }
        }
        for (_, _, weight, row) in &flow.starts {
            for (source, m) in source.iter_mut().zip(row) {
                *source += weight * 2.0 * (m.kk - m.kh);
            }
        }
        let mixed = Matrix::adjoint(sites, |m: &Moments| m.kh).resolve(&source)?;
        // From where steps come: b is even over a site there.
        let mut from = Vec::new();
        for ((site, occupation), mixed) in sites.iter().zip(&flow.occupation).zip(&mixed) {
            for node in &site.nodes {
                let part = node.weight / site.measure;
                from.push(Place::new(node, part * occupation, part * mixed));
            }
        }
        for (_, node, weight, _) in &flow.starts {
            from.push(Place::new(node, *weight, 0.0));
        }
        let mut rows: Vec<Row> = reserve(sites.len())?;
        rows.resize_with(sites.len(), Row::default);
        for (row, site) in rows.iter_mut().zip(sites) {
            row.mixed = buffer(site.nodes.len())?;
        }
        run(&mut rows, &|j, row| {
            self.gather(j, &from, analysis, &mut row.mixed);
        });
        let mut places: Vec<Vec<Place<L::Point>>> = buffer(cells)?;
        let mut put = |place: Place<L::Point>| {
            if let Some(of_cell) = places.get_mut(place.x.cell) {
                of_cell.push(place);
            }
        };
        for ((site, occupation), row) in sites.iter().zip(&flow.occupation).zip(&rows) {
            for (node, mixed) in site.nodes.iter().zip(&row.mixed) {
                let part = node.weight / site.measure;
                put(Place::new(node, part * occupation, *mixed));
            }
        }
        for (_, node, weight, _) in &flow.starts {
            put(Place::new(node, *weight, 0.0));
        }
        match places.iter().position(Vec::is_empty) {
            Some(cell) => Err(VarianceError::Coarse { cell }),
            None => Ok(places),
        }
    }

    /// b in the nodes of a site: T_kDp^* a and T_khp^* b.
    fn gather(
        &self,
        j: usize,
        from: &[Place<L::Point>],
        analysis: &Analysis<L::Point>,
        mixed: &mut [f64],
    ) {
        let mut spread = 0.0;
        for place in from {
            self.level.steps(&place.x.point, j, |step| {
                let (_, k, h) = self.step(&place.x, step.point);
                let part = 2.0 * place.occupation * k * (k - h) + place.mixed * k * h;
                match step.node.and_then(|node| mixed.get_mut(node)) {
                    Some(mixed) => *mixed += step.weight * part,
                    None => spread += step.weight * part,
                }
            });
        }
        if let Some(site) = analysis.sites.get(j) {
            for (mixed, node) in mixed.iter_mut().zip(&site.nodes) {
                *mixed += spread * node.weight / site.measure;
            }
        }
    }
}

/// What a row is solved with.
struct Of<'a, P> {
    estimator: Estimator,
    seconds: &'a Seconds<'a>,
    places: &'a [Place<P>],
    scorings: f64,
    cell: usize,
}
