//! Which pairs go where: for the least variance times work.
//!
//! # Formulas
//!
//! v, and so e = u − v and r = F + T_kp v − v, do not depend on the kinds of pairs. What depends on them is
//! h, G = v − T_hp v, and through them s, c and w of the [crate](crate). In row i, for x ∈ X_i, the kind of the
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
use core::fmt;

use fredholm_core::galerkin::{GalerkinError, PairKind, buffer, reserve};
use fredholm_core::{Estimator, Real};

use crate::analysis::seconds_of;
use crate::flow::Flow;
use crate::matrix::{Nodal, Seconds};
use crate::row::{Parts, Place, Problem, State};
use crate::{Analysis, Prediction, Run, VarianceError, Wanted};

/// λ are V/C of what is there times 4^this, and a fourth of it, and so on.
const LARGEST: i32 = 2;
/// The number of multipliers: down to 4^−6. V × C is flat where it is least, and whoever chooses again begins near it.
const MULTIPLIERS: usize = 9;
/// No variance that is predicted is taken for less than this part of the one that was there: the prediction is of
/// first order.
const TRUSTED: f64 = 1e-3;

/// The kinds that a pair of cells may have, and what they cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AllowedKinds {
    /// In S: the transition mass is positive on all of X_i.
    pub galerkin: bool,
    /// Pointwise, if there is an exact integral: its time over that of a visited state.
    pub pointwise: Option<f64>,
    /// Left out even if it may be something else: the quadrature sees how much that costs.
    pub left_out: bool,
}

/// The kinds and costs among which pairs of cells are chosen.
#[derive(Clone, Copy)]
pub struct PairCosts<'a> {
    /// n.
    pub cells: usize,
    /// The kinds that the pair (i, j) may have.
    pub allowed: &'a (dyn Fn(usize, usize) -> AllowedKinds + Sync),
}

impl fmt::Debug for PairCosts<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PairCosts")
            .field("cells", &self.cells)
            .finish_non_exhaustive()
    }
}

/// Variance and work of walks with a choice of pairs.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureOfMerit {
    /// Var ζ of every functional.
    pub variances: Vec<f64>,
    /// The mean work of a walk, in visited states.
    pub work: f64,
}

impl FigureOfMerit {
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

/// The chosen kinds of all pairs, with the variance and work that are expected of them.
#[derive(Clone, Debug)]
pub struct PairSelection {
    /// The kinds of all pairs, for [`PairTable::new`](fredholm_core::galerkin::PairTable::new).
    pub table: Vec<u8>,
    /// Var ζ over what it was, in the mean over the functionals: predicted, of first order.
    pub variance: f64,
    /// The mean work of a walk, in visited states.
    pub work: f64,
}

/// A row of pairs while it is worked on.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// The kinds of the pairs for every λ, and those that are there.
    kinds: Vec<u8>,
    /// Variance and price of each.
    outcomes: Vec<[f64; 2]>,
    /// b of the nodes of a site.
    pub(crate) mixed: Vec<f64>,
    failed: Option<GalerkinError>,
}

impl Analysis<'_> {
    /// Variances and work with the pairs of this setting. Of [`PairCosts::allowed`] the prices count.
    ///
    /// # Errors
    /// [`VarianceError::Infinite`], or no memory.
    pub fn figure_of_merit(
        &self,
        predictions: &[Prediction],
        terms: &PairCosts<'_>,
    ) -> Result<FigureOfMerit, VarianceError> {
        let mut variances = reserve(predictions.len())?;
        for prediction in predictions {
            variances.push(prediction.preconditioned.ok_or(VarianceError::Infinite)?);
        }
        let flow = self.flow(predictions, terms.cells)?;
        let work = self.work(&flow, terms);
        Ok(FigureOfMerit { variances, work })
    }

    /// The mean work of a walk with the pairs of this setting.
    fn work(&self, flow: &Flow, terms: &PairCosts<'_>) -> f64 {
        let rows = flow.scorings.iter().enumerate();
        let prices = rows.map(|(i, scorings)| {
            let mut price = 0.0;
            self.model.pointwise(i, terms.cells, &mut |j| {
                price += (terms.allowed)(i, j).pointwise.unwrap_or(0.0);
            });
            scorings * price
        });
        flow.states + prices.sum::<f64>()
    }

    /// The kinds of all pairs for the least variance × work, as far as the first variation of what was analysed
    /// tells: the better the nearer its pairs are to those that are chosen, so that choosing again from what
    /// was chosen, and looking at its [`figure_of_merit`](Self::figure_of_merit), is worth while.
    ///
    /// Sites must be cells or parts of them. `run` is as in [`new`](Self::new), for rows of pairs. O(n²)
    /// evaluations of k and h for n nodes, twice, and 10 n² bytes for n cells.
    ///
    /// # Errors
    /// [`VarianceError`].
    pub fn choose(
        &self,
        predictions: &[Prediction],
        terms: &PairCosts<'_>,
        run: &Run<'_, Row>,
    ) -> Result<PairSelection, VarianceError> {
        if !self.model.has_galerkin() {
            return Err(VarianceError::NoGalerkin);
        }
        let n = terms.cells;
        let flow = self.flow(predictions, n)?;
        let work = self.work(&flow, terms);
        let places = self.places(&flow, n, run)?;
        let seconds = Nodal::new(&self.sites, &self.means.seconds, seconds_of)?;
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
        let mut rows: Vec<Row> = reserve(n)?;
        rows.resize_with(n, Row::default);
        for row in &mut rows {
            row.outcomes = buffer(MULTIPLIERS + 1)?;
            row.kinds = buffer(n.saturating_mul(MULTIPLIERS + 1))?;
        }
        let scorings = |i: usize| flow.scorings.get(i).copied().unwrap_or(0.0);
        let solve = |i: usize, row: &mut Row| {
            let of = Of {
                estimator: self.estimator,
                seconds: &seconds,
                places: places.get(i).map_or(&[][..], |places| places),
                scorings: scorings(i),
                cell: i,
            };
            if let Err(error) = self.solve_row(&of, terms, &lambdas, row) {
                row.failed = Some(error);
            }
        };
        run(&mut rows, &|i, row| solve(i, row));
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
        // Unless what is there is no worse.
        let keep = !(variance * least < work);
        let chosen = if keep { MULTIPLIERS } else { best };
        let mut table = reserve(
            n.checked_mul(n)
                .ok_or(GalerkinError::Memory { bytes: None })?,
        )?;
        for row in &rows {
            table.extend(row.kinds.iter().skip(chosen * n).take(n));
        }
        let [variance, work] = if keep { [1.0, work] } else { [variance, least] };
        Ok(PairSelection {
            table,
            variance,
            work,
        })
    }

    /// The integrals of a row, and its best kinds for all λ with what they come to; and what comes of the pairs that are
    /// there.
    fn solve_row(
        &self,
        of: &Of<'_>,
        terms: &PairCosts<'_>,
        lambdas: &[f64],
        row: &mut Row,
    ) -> Result<(), GalerkinError> {
        let n = terms.cells;
        let count = of.places.len();
        let mut allowed: Vec<AllowedKinds> = buffer(n)?;
        for (j, allowed) in allowed.iter_mut().enumerate() {
            *allowed = (terms.allowed)(of.cell, j);
        }
        let mut parts: Vec<Parts> = buffer(n.saturating_mul(count))?;
        for (number, place) in of.places.iter().enumerate() {
            for site in 0..self.model.sites() {
                self.model
                    .steps(place.point, site, Wanted::Choice, &mut |step| {
                        let (k, v) = (step.kernel, step.value);
                        let [s, c] = of.seconds.at(site, step.node).unwrap_or([f64::NAN; 2]);
                        let in_s = allowed.get(step.cell).is_some_and(|of| of.galerkin);
                        let Some(parts) = parts.get_mut(step.cell * count + number) else {
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
                        add(PairKind::Dropped, 0.0);
                        if in_s {
                            add(PairKind::Galerkin, step.neighbour);
                        }
                    });
            }
        }
        let mut free = reserve(n)?;
        free.extend((0..n).filter(|&j| {
            let of = allowed.get(j);
            of.is_some_and(|of| of.galerkin || of.pointwise.is_some())
        }));
        let problem = Problem {
            estimator: of.estimator,
            places: of.places,
            parts: &parts,
            allowed: &allowed,
            free: &free,
            scorings: of.scorings,
        };
        let mut note = |number: usize, state: &State, outcome| {
            if let Some(place) = row.outcomes.get_mut(number) {
                *place = outcome;
            }
            let kinds = row.kinds.iter_mut().skip(number * n);
            for (to, &kind) in kinds.zip(&state.kinds) {
                *to = kind;
            }
        };
        let mut kinds = buffer(n)?;
        for (j, kind) in kinds.iter_mut().enumerate() {
            *kind = self.model.kind(of.cell, j) as u8;
        }
        let now = problem.state(kinds)?;
        note(lambdas.len(), &now, problem.outcome(&now));
        problem.solve(lambdas, note)
    }
}

/// What a row is solved with.
struct Of<'a> {
    estimator: Estimator,
    seconds: &'a Seconds<'a>,
    places: &'a [Place],
    scorings: f64,
    cell: usize,
}
