//! Where the points go: strata, their shares, and sums over them.

use alloc::vec;
use alloc::vec::Vec;

use super::setup::step_value;
use super::{
    CellPoint, Ending, Regular, Resolvent, ResolventLooks, ResolventTables, RestDensity, Stratum,
};
use crate::galerkin::{GalerkinError, reserve};
use crate::sobol::Net;
use crate::{DefaultGenerator, Real, RngUniforms, Uniforms, WalkSeeds};

/// The part of the mean importance that every stratum has at least: what no table has seen may be there.
const LEAST: f64 = 0.02;
/// The part of the mean |D| of all pairs of its first cell that |D| is taken to be on every pair at least, until points tell more: where none met
/// a jump there may be one. It costs that part of all points.
const USUAL: f64 = 0.3;
/// Randomisations of a stratum: fewer tell no error, and longer nets gain more.
const REPLICATES: u32 = 2;
/// The most randomisations of one.
const MOST_REPLICATES: u32 = 16;
/// The share of a stratum from which on it has more of them, so that the error bar is no matter of one number.
const LARGE: f64 = 1.0 / 32.0;
/// The fewest points of a net in a group of strata.
const LEAST_POINTS: f64 = 4.0;
/// τ over the predicted standard deviation, before anybody tells what nets gain.
const SCALE: f64 = 0.1;

/// Which stratum of a plan it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Pair { from: u32, into: u32 },
    Source { cell: u32 },
    FromPoint { into: u32 },
    Rest { cell: u32 },
}

/// Stratum of a plan.
#[derive(Clone, Copy, Debug)]
struct Planned {
    kind: Kind,
    /// The importance for |D| = 1.
    scale: f64,
    /// Points at which |D| is known, and the sum of its squares.
    known: Known,
    /// About the standard deviation of its integral by one point.
    importance: f64,
}

/// What is known of |D| on a stratum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Known {
    /// The number of points.
    pub points: f64,
    /// The sum of the squares.
    pub squares: f64,
}

impl Known {
    /// Adds what other points tell.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            squares: self.squares + other.squares,
        }
    }

    fn root_mean_square(self) -> f64 {
        Real::sqrt(self.squares / self.points)
    }
}

impl Planned {
    /// A stratum of which nothing is to be learned.
    const fn of(kind: Kind, importance: f64) -> Self {
        let known = Known {
            points: 1.0,
            squares: 1.0,
        };
        Self {
            kind,
            scale: importance,
            known,
            importance,
        }
    }
}

/// Strata of the integrals that all targets share, or of those that one has to itself. The same plan and seeds give the same numbers
/// wherever groups are summed.
#[derive(Clone, Debug)]
pub struct Plan<'a, P> {
    strata: Vec<Planned>,
    all: f64,
    std_dev: f64,
    /// The number of strata that make the standard deviation, about.
    effective: f64,
    /// τ over the standard deviation.
    scale: f64,
    /// The sizes of the coefficients of cells, of strata that all targets share.
    sizes: Vec<f64>,
    /// The number of functions on a cell that these score on.
    scored: usize,
    point: Option<&'a CellPoint<P>>,
    rest: Option<RestDensity<'a, P>>,
}

/// Strata that share a net: one, or several of small importance.
#[derive(Clone, Debug)]
struct Group {
    /// Their numbers in the plan.
    strata: Vec<u32>,
    importance: f64,
    replicates: u32,
    log2: u32,
    /// The number of the first randomisation.
    first: u64,
}

/// Points of one round, in groups that may be summed anywhere.
#[derive(Clone, Debug)]
pub struct Round<'p, 'a, P> {
    plan: &'p Plan<'a, P>,
    groups: Vec<Group>,
    seeds: WalkSeeds<DefaultGenerator>,
}

/// Scores of the points of a group.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupScores {
    /// The cell to whose functions the scores belong, if all targets share them.
    pub cell: Option<usize>,
    /// Whether they are scores of r₀.
    pub is_source: bool,
    /// The mean score of every function, or of one, in every randomisation.
    pub means: Vec<f64>,
    /// The number of randomisations.
    pub replicates: u32,
    /// The number of points.
    pub points: u64,
    /// The number of steps beyond the first.
    pub steps: u64,
    /// What was seen of |D| on strata, by their numbers in the plan.
    pub seen: Vec<(u32, Known)>,
}

/// Sum over a round: one unbiased estimate with its error bar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoundSum {
    /// The estimate of all integrals.
    pub value: f64,
    /// The variance of the estimate.
    pub variance: f64,
    /// The sum of the squares of the strata's variances, each over its degrees of freedom (Satterthwaite 1946).
    pub squares: f64,
}

impl<'a, P: Copy> Plan<'a, P> {
    /// The strata that all targets share, with the largest size of their coefficients w on every cell, and the number of functions on a
    /// cell that points score on: those of the tables, or of a higher degree.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn shared(
        looks: &ResolventLooks,
        tables: &ResolventTables<'_>,
        (sizes, scored): (Vec<f64>, usize),
    ) -> Result<Self, GalerkinError> {
        let cells = looks.values.len();
        let mut strata = reserve(cells.saturating_add(1).saturating_mul(cells))?;
        for ((from, size), measure) in (0_u32..).zip(&sizes).zip(tables.measures) {
            let left = measure * size;
            let rest = looks.rests.get(from as usize).copied();
            let source = Kind::Source { cell: from };
            strata.push(Planned::of(source, left * rest.unwrap_or(f64::NAN)));
            let pair = |into| Kind::Pair { from, into };
            plan_pairs(&mut strata, looks, tables, (from as usize, left), pair);
        }
        Ok(Self {
            sizes,
            scored,
            ..Self::of(strata, None, None)
        })
    }

    /// The strata of the value at a point.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn at(
        looks: &ResolventLooks,
        tables: &ResolventTables<'_>,
        point: &'a CellPoint<P>,
    ) -> Result<Self, GalerkinError> {
        let mut strata = reserve(looks.values.len())?;
        let to_cell = |into| Kind::FromPoint { into };
        plan_pairs(&mut strata, looks, tables, (point.cell, 1.0), to_cell);
        Ok(Self::of(strata, Some(point), None))
    }

    /// The strata of what polynomials leave of a functional, with its root mean square on every cell.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn rest(
        looks: &ResolventLooks,
        tables: &ResolventTables<'_>,
        rest: RestDensity<'a, P>,
        sizes: &[f64],
    ) -> Result<Self, GalerkinError> {
        let mut strata = reserve(sizes.len())?;
        let own = sizes.iter().zip(looks.values.iter().zip(tables.measures));
        strata.extend((0_u32..).zip(own).map(|(cell, (size, (value, measure)))| {
            Planned::of(Kind::Rest { cell }, size * value * measure)
        }));
        Ok(Self::of(strata, None, Some(rest)))
    }

    fn of(
        strata: Vec<Planned>,
        point: Option<&'a CellPoint<P>>,
        rest: Option<RestDensity<'a, P>>,
    ) -> Self {
        let mut plan = Self {
            strata,
            all: 0.0,
            std_dev: 0.0,
            effective: 0.0,
            scale: SCALE,
            sizes: Vec::new(),
            scored: 1,
            point,
            rest,
        };
        plan.set_importance();
        plan
    }

    fn set_importance(&mut self) {
        let importance = |own: &Planned| own.scale * own.known.root_mean_square();
        let sum: f64 = self.strata.iter().map(importance).sum();
        // Where tables are 0 everywhere one stratum is as good as another.
        let count = self.strata.len().max(1) as f64;
        let least = if sum > 0.0 { LEAST * sum / count } else { 1.0 };
        self.strata
            .iter_mut()
            .for_each(|own| own.importance = importance(own) + least);
        let square = |own: &Planned| importance(own) * importance(own);
        let squares = self.strata.iter().map(square);
        self.effective = sum * sum / squares.sum::<f64>().max(f64::MIN_POSITIVE);
        self.std_dev = sum;
        self.all = sum + least * count;
    }

    /// The standard deviation of a point, as the tables predict it: without what nets gain.
    #[must_use]
    pub const fn std_dev(&self) -> f64 {
        self.std_dev
    }

    /// How many strata make that, about: (Σ s)²/Σ s² of their standard deviations s.
    #[must_use]
    pub const fn strata(&self) -> f64 {
        self.effective
    }

    /// Sets by how much nets lower the standard deviation of a point. Walks that go on have no nets: with τ the score of one counts for as
    /// much as it is where it is above τ, and for τ times its probability where not. The variance V₁ + κqτ times the time t₁ + cq/τ, where
    /// q is the mean of |W| E, is least at τ = √(V₁c/(κt₁)): the standard deviation √V₁ that nets leave, as a step takes about
    /// the time of a point, and E is about what it finds.
    pub const fn set_gain(&mut self, gain: f64) {
        self.scale = gain;
    }

    /// Takes what was seen of |D| into its tables: a round that follows is as unbiased with them.
    pub fn learn(&mut self, seen: impl IntoIterator<Item = (u32, Known)>) {
        for (stratum, known) in seen {
            if let Some(own) = self.strata.get_mut(stratum as usize) {
                own.known = own.known.and(known);
            }
        }
        self.set_importance();
    }

    /// About so many points, with these draws.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn round(
        &self,
        points: f64,
        seeds: WalkSeeds<DefaultGenerator>,
    ) -> Result<Round<'_, 'a, P>, GalerkinError> {
        let mut round = Round {
            plan: self,
            groups: Vec::new(),
            seeds,
        };
        let (mut group, mut importance) = (Vec::new(), 0.0);
        let mut before: Option<Kind> = None;
        let share = |importance: f64| points * importance / self.all;
        let enough = f64::from(REPLICATES) * LEAST_POINTS;
        for (number, own) in (0_u32..).zip(&self.strata) {
            // The scores of a group belong to the functions of one cell, and those of a source need no second one.
            let follows = before.is_none_or(|before| before.goes_with(own.kind));
            let is_large = share(own.importance) >= enough;
            if !group.is_empty() && (!follows || share(importance) >= enough) {
                round.push(core::mem::take(&mut group), importance, points);
                importance = 0.0;
            }
            if is_large {
                round.push(vec![number], own.importance, points);
            } else {
                group.push(number);
                importance += own.importance;
            }
            before = Some(own.kind);
        }
        if !group.is_empty() {
            round.push(group, importance, points);
        }
        Ok(round)
    }
}

impl Kind {
    /// Whether two strata may share a net.
    fn goes_with(self, other: Self) -> bool {
        match (self, other) {
            (Self::Pair { from, .. }, Self::Pair { from: other, .. }) => from == other,
            (Self::Source { .. }, _) | (_, Self::Source { .. }) => false,
            _ => true,
        }
    }
}

impl<P: Copy> Round<'_, '_, P> {
    fn push(&mut self, strata: Vec<u32>, importance: f64, points: f64) {
        let share = importance / self.plan.all;
        let mut replicates = REPLICATES;
        while share > LARGE && replicates < MOST_REPLICATES {
            replicates *= 2;
        }
        let own = (points * share / f64::from(replicates)).max(1.0) as u64;
        let last = self.groups.last();
        self.groups.push(Group {
            strata,
            importance,
            replicates,
            log2: own.ilog2().min(31),
            first: last.map_or(0, |last| last.first + u64::from(last.replicates)),
        });
    }

    /// The number of groups.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.groups.len()
    }

    /// The scores of the points of a group.
    pub fn scores<E: Regular<Point = P>>(
        &self,
        number: usize,
        resolvent: &Resolvent<'_, E>,
    ) -> GroupScores {
        let Some(group) = self.groups.get(number) else {
            return GroupScores::default();
        };
        let planned = |number: &u32| self.plan.strata.get(*number as usize);
        let mut up_to = Vec::with_capacity(group.strata.len());
        let mut before = 0.0;
        for own in group.strata.iter().filter_map(planned) {
            before += own.importance;
            up_to.push(before);
        }
        let kind = group.strata.first().and_then(planned).map(|own| own.kind);
        let cell = kind.and_then(Kind::cell);
        let width = cell.map_or(1, |_| self.plan.scored);
        let is_one = group.strata.len() == 1;
        let coordinates = 2 * resolvent.equation.dimension() + usize::from(!is_one);
        let points = 1_u64 << group.log2;
        let mut all = GroupScores {
            cell,
            is_source: matches!(kind, Some(Kind::Source { .. })),
            means: vec![0.0; width * group.replicates as usize],
            replicates: group.replicates,
            points: points * u64::from(group.replicates),
            steps: 0,
            seen: Vec::new(),
        };
        let mut seen = vec![Known::default(); group.strata.len()];
        for (replicate, means) in (0..).zip(all.means.chunks_exact_mut(width)) {
            let mut net = Net::new(&self.seeds, group.first + replicate, coordinates);
            for _ in 0..points {
                let mut draws = RngUniforms(net.next());
                let mut place = 0;
                if !is_one {
                    let pick: f64 = draws.uniform();
                    let after = up_to.partition_point(|&up_to| up_to <= pick * before);
                    place = after.min(up_to.len().saturating_sub(1));
                }
                let number = group.strata.get(place).copied().unwrap_or(u32::MAX);
                let (Some(own), Some(stratum)) = (planned(&number), self.stratum(number)) else {
                    continue;
                };
                let ending = Ending {
                    share: own.importance / self.plan.all,
                    scale: self.plan.scale * self.plan.all,
                };
                let factor = group.importance / own.importance / points as f64;
                let trace = resolvent.score(&stratum, (&ending, factor), &mut draws, means);
                all.steps += trace.steps;
                if let (Some(to), true) = (seen.get_mut(place), trace.difference.is_finite()) {
                    to.points += 1.0;
                    to.squares += trace.difference * trace.difference;
                }
            }
        }
        let seen = group.strata.iter().copied().zip(seen);
        all.seen = seen
            .filter(|&(number, known)| {
                let has_pair = |own: &Planned| own.kind.has_pair();
                known.points > 0.0 && planned(&number).is_some_and(has_pair)
            })
            .collect();
        all
    }

    /// The stratum of this number.
    fn stratum(&self, number: u32) -> Option<Stratum<'_, P>> {
        let plan = self.plan;
        Some(match plan.strata.get(number as usize)?.kind {
            Kind::Pair { from, into } => Stratum::Pair {
                from: from as usize,
                into: into as usize,
                size: plan.sizes.get(from as usize)?.max(f64::MIN_POSITIVE),
            },
            Kind::Source { cell } => Stratum::Source {
                cell: cell as usize,
            },
            Kind::FromPoint { into } => Stratum::FromPoint {
                point: plan.point?,
                into: into as usize,
            },
            Kind::Rest { cell } => Stratum::Rest {
                density: plan.rest?,
                cell: cell as usize,
            },
        })
    }
}

impl Kind {
    /// The cell to whose functions scores belong, if all targets share them.
    const fn cell(self) -> Option<usize> {
        match self {
            Self::Pair { from: cell, .. } | Self::Source { cell } => Some(cell as usize),
            _ => None,
        }
    }

    /// Whether |D| is met in it.
    const fn has_pair(self) -> bool {
        matches!(self, Self::Pair { .. } | Self::FromPoint { .. })
    }
}

/// Plans the pairs of one cell, or of a point there, with all others; `left` is what stands before ∫ |D| |g|.
fn plan_pairs(
    strata: &mut Vec<Planned>,
    looks: &ResolventLooks,
    tables: &ResolventTables<'_>,
    (from, left): (usize, f64),
    kind: impl Fn(u32) -> Kind,
) {
    let cells = looks.values.len();
    let largest = looks.values.iter().copied().fold(0.0, f64::max);
    let row = looks.differences.get(from * cells..(from + 1) * cells);
    let row = row.unwrap_or(&[]);
    let all: f64 = tables.measures.iter().sum();
    let sizes = row.iter().zip(tables.measures);
    let mean: f64 = sizes.map(|(d, measure)| d * measure / all).sum();
    let usual = USUAL * mean;
    let own = row.iter().zip(looks.values.iter().zip(tables.measures));
    let planned = (0_u32..)
        .zip(own)
        .map(|(into, (difference, (value, measure)))| Planned {
            kind: kind(into),
            scale: left * step_value(*value, largest) * measure,
            known: Known {
                points: looks.points,
                squares: looks.points * (difference * difference + usual * usual),
            },
            importance: 0.0,
        });
    strata.extend(planned);
}

impl RoundSum {
    /// Adds the scores of a group; those of functions are weighted with the coefficients of a target.
    pub fn add(&mut self, group: &GroupScores, functions: usize, weights: &[f64]) {
        let one = [1.0];
        let (width, weights) = match group.cell {
            Some(cell) => (functions, weights.get(cell * functions..).unwrap_or(&[])),
            None => (1, &one[..]),
        };
        // Welford's recurrence: differences are far smaller than values.
        let (mut mean, mut squares, mut count) = (0.0, 0.0, 0.0);
        for scores in group.means.chunks_exact(width) {
            let score: f64 = scores.iter().zip(weights).map(|(s, w)| s * w).sum();
            count += 1.0;
            let off = score - mean;
            mean += off / count;
            squares += off * off * (count - 1.0) / count;
        }
        let variance = squares / (count * (count - 1.0));
        self.value += mean;
        self.variance += variance;
        self.squares += variance * variance / (count - 1.0);
    }

    /// The degrees of freedom of the variance.
    #[must_use]
    pub fn freedom(&self) -> f64 {
        match self.squares > 0.0 {
            true => self.variance * self.variance / self.squares,
            false => f64::INFINITY,
        }
    }
}
