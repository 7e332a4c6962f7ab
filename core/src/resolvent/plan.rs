//! Where the points go: strata, their shares, and sums over them.

use alloc::vec;
use alloc::vec::Vec;

use super::{
    CellPoint, Ending, Regular, Resolvent, ResolventLooks, ResolventTables, RestDensity, Stratum,
};
use crate::galerkin::{GalerkinError, reserve};
use crate::sobol::Net;
use crate::{DefaultGenerator, RngUniforms, Uniforms, WalkSeeds};

/// The part of the mean importance that every stratum has at least: what no table has seen may be there.
const LEAST: f64 = 0.02;
/// Randomisations of a stratum: fewer tell no error, and longer nets gain more.
const REPLICATES: u32 = 2;
/// The most randomisations of one.
const MOST_REPLICATES: u32 = 16;
/// The share of a stratum from which on it has more of them, so that the error bar is no matter of one number.
const LARGE: f64 = 1.0 / 32.0;
/// The fewest points of a net in a group of strata.
const LEAST_POINTS: f64 = 4.0;
/// τ over the predicted standard deviation: what walks that go on add is then small beside what nets leave.
const SCALE: f64 = 0.1;
/// How many times the value of a table a sample may be before the table is raised.
const PEAK: f64 = 5.0;

/// Which stratum of a plan it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Pair { from: u32, into: u32 },
    Source { cell: u32 },
    FromPoint { into: u32 },
    Rest { cell: u32 },
}

/// Stratum of a plan with its importance, about the standard deviation of its integral by one point.
#[derive(Clone, Copy, Debug)]
struct Planned {
    kind: Kind,
    importance: f64,
    /// How many times the value of its table |D| is taken to be.
    raised: f64,
}

/// Strata of the integrals that all targets share, or of those that one has to itself. The same plan and seeds give the same numbers
/// wherever groups are summed.
#[derive(Clone, Debug)]
pub struct Plan<'a, P> {
    strata: Vec<Planned>,
    /// The importance that every stratum has at least.
    least: f64,
    all: f64,
    std_dev: f64,
    /// The sizes of the coefficients of cells, of strata that all targets share.
    sizes: Vec<f64>,
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
    /// The mean score of every function, or of one, in every randomisation.
    pub means: Vec<f64>,
    /// The number of randomisations.
    pub replicates: u32,
    /// The number of points.
    pub points: u64,
    /// The number of steps beyond the first.
    pub steps: u64,
    /// Where |D| was larger than it should be.
    pub peak: Option<Peak>,
}

/// Stratum in which |D| was much larger than its table has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    stratum: u32,
    /// How many times the value of the table it was.
    times: f64,
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
    /// The strata that all targets share, with the largest size of their coefficients w on every cell.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn shared(
        looks: &ResolventLooks,
        tables: &ResolventTables<'_>,
        sizes: Vec<f64>,
    ) -> Result<Self, GalerkinError> {
        let cells = looks.values.len();
        let mut strata = reserve(cells.saturating_add(1).saturating_mul(cells))?;
        for ((from, size), measure) in (0_u32..).zip(&sizes).zip(tables.measures) {
            let left = measure * size;
            let rest = looks.rests.get(from as usize).copied();
            strata.push(Planned {
                kind: Kind::Source { cell: from },
                importance: left * rest.unwrap_or(f64::NAN),
                raised: 1.0,
            });
            strata.extend((0..cells).map(|into| Planned {
                kind: Kind::Pair {
                    from,
                    into: into as u32,
                },
                importance: left * looks.importance(from as usize, into, tables.measures),
                raised: 1.0,
            }));
        }
        let plan = Self {
            strata,
            least: 0.0,
            all: 0.0,
            std_dev: 0.0,
            sizes,
            point: None,
            rest: None,
        };
        Ok(plan.with_least())
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
        strata.extend((0..looks.values.len()).map(|into| Planned {
            kind: Kind::FromPoint { into: into as u32 },
            importance: looks.importance(point.cell, into, tables.measures),
            raised: 1.0,
        }));
        let plan = Self {
            strata,
            least: 0.0,
            all: 0.0,
            std_dev: 0.0,
            sizes: Vec::new(),
            point: Some(point),
            rest: None,
        };
        Ok(plan.with_least())
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
        strata.extend(
            (0_u32..)
                .zip(own)
                .map(|(cell, (size, (value, measure)))| Planned {
                    kind: Kind::Rest { cell },
                    importance: size * value * measure,
                    raised: 1.0,
                }),
        );
        let plan = Self {
            strata,
            least: 0.0,
            all: 0.0,
            std_dev: 0.0,
            sizes: Vec::new(),
            point: None,
            rest: Some(rest),
        };
        Ok(plan.with_least())
    }

    fn with_least(mut self) -> Self {
        let sum: f64 = self.strata.iter().map(|own| own.importance).sum();
        // Where tables are 0 everywhere one stratum is as good as another.
        let count = self.strata.len().max(1) as f64;
        let least = if sum > 0.0 { LEAST * sum / count } else { 1.0 };
        self.strata
            .iter_mut()
            .for_each(|own| own.importance += least);
        self.least = least;
        self.std_dev = sum;
        self.all = sum + least * count;
        self
    }

    /// The standard deviation of a point, as the tables predict it: without what nets gain.
    #[must_use]
    pub const fn std_dev(&self) -> f64 {
        self.std_dev
    }

    /// Raises the importance of strata in which |D| was much larger than their tables have it.
    pub fn raise(&mut self, peaks: impl Iterator<Item = Peak>) {
        for Peak { stratum, times } in peaks {
            if let Some(own) = self.strata.get_mut(stratum as usize) {
                own.importance = self.least + (own.importance - self.least) * times / own.raised;
                own.raised = times;
            }
        }
        self.all = self.strata.iter().map(|own| own.importance).sum();
        self.std_dev = self.all;
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
        looks: &ResolventLooks,
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
        let cell = group
            .strata
            .first()
            .and_then(planned)
            .and_then(|own| own.kind.cell());
        let width = cell.map_or(1, |_| resolvent.tables.functions);
        let is_one = group.strata.len() == 1;
        let coordinates = 2 * E::DIMENSION + usize::from(!is_one);
        let points = 1_u64 << group.log2;
        let mut all = GroupScores {
            cell,
            means: vec![0.0; width * group.replicates as usize],
            replicates: group.replicates,
            points: points * u64::from(group.replicates),
            steps: 0,
            peak: None,
        };
        let mut worst = PEAK;
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
                    scale: SCALE * self.plan.all,
                };
                let factor = group.importance / own.importance / points as f64;
                let trace = resolvent.score(&stratum, (&ending, factor), &mut draws, means);
                all.steps += trace.steps;
                let Some(known) = self.known(own.kind, looks) else {
                    continue;
                };
                let times = trace.difference / known;
                if times > worst * own.raised && times.is_finite() {
                    worst = times / own.raised;
                    all.peak = Some(Peak {
                        stratum: number,
                        times,
                    });
                }
            }
        }
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

    /// The value of the table of |D| that a stratum has.
    fn known(&self, kind: Kind, looks: &ResolventLooks) -> Option<f64> {
        let (from, into) = match kind {
            Kind::Pair { from, into } => (from as usize, into),
            Kind::FromPoint { into } => (self.plan.point?.cell, into),
            _ => return None,
        };
        let pair = from * looks.values.len() + into as usize;
        looks.differences.get(pair).copied()
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
