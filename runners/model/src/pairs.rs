//! Pairs of cells as models make them, and their choice by the theory (`Pairs::Theory`): every pair in S, pointwise or left
//! out, for the least predicted variance × time.

use fredholm_core::galerkin::{DiagonalRule, PairKind, PairTable, Pairs as PairsTrait};
use fredholm_core::{Estimator, Form};
use fredholm_room::RoomPairs;
use fredholm_variance::{Analysis, FigureOfMerit, PairCosts, PairSelection, VarianceModel};
use serde::{Deserialize, Serialize};

use crate::error::Subject;
use crate::examined::in_parallel;
use crate::{Error, Pairs};

/// The most nodes, whose pairs are gone through some thirty times.
const MOST_NODES: usize = 6200;
/// Bytes of a pair of sites: moments, contributions, an entry of a matrix, and kinds by price.
const PAIR: usize = 48 + 8 + 8 + 10;
/// Nodes where cells are few.
const NODES: usize = 400;
/// A choice that promises less than this improvement is not tried.
const WORTH_TRYING: f64 = 0.95;
/// Choices that are tried.
const ROUNDS: usize = 3;

/// Cells in a row that are near to each other pointwise, all other pairs in S: for a kernel with a singularity at x = y,
/// near which no piecewise polynomial is close to it.
#[derive(Clone, Copy, Debug)]
pub struct Band {
    /// The number of neighbours on each side.
    pub width: usize,
}

impl PairsTrait for Band {
    #[inline]
    fn kind(&self, i: usize, j: usize) -> PairKind {
        if i.abs_diff(j) <= self.width {
            PairKind::Pointwise
        } else {
            PairKind::Galerkin
        }
    }

    #[inline]
    fn pointwise(&self, i: usize, cells: usize) -> impl Iterator<Item = usize> {
        i.saturating_sub(self.width)..(i + self.width + 1).min(cells)
    }

    fn outside(&self, i: usize, cells: usize, visit: &mut dyn FnMut(usize)) {
        self.pointwise(i, cells).for_each(visit);
    }
}

/// Pairs of any kind, for an analysis.
#[derive(Clone, Copy, Debug)]
pub enum AnyPairs<'a> {
    /// All pointwise.
    AllPointwise,
    /// A rule for the diagonal, all others in S.
    Diagonal(DiagonalRule),
    /// A band of pointwise pairs.
    Band(Band),
    /// Pairs of a room, by what cells see of each other.
    Views(RoomPairs<'a>),
    /// A table of all pairs.
    Table(PairTable<'a>),
}

impl PairsTrait for AnyPairs<'_> {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match self {
            Self::AllPointwise => PairKind::Pointwise,
            Self::Diagonal(pairs) => pairs.kind(i, j),
            Self::Band(pairs) => pairs.kind(i, j),
            Self::Views(pairs) => pairs.kind(i, j),
            Self::Table(pairs) => pairs.kind(i, j),
        }
    }
}

/// The figure of merit of a choice of pairs, and the next choice unless it is the last.
#[derive(Debug)]
pub struct Evaluated {
    merit: FigureOfMerit,
    chosen: Option<PairSelection>,
}

/// Analyses a choice of pairs by its predicted variance, and chooses from there unless it is the last.
///
/// # Errors
/// [`Error::Variance`].
pub fn evaluate(
    model: &dyn VarianceModel,
    (estimator, form): (Estimator, Form),
    goals: usize,
    terms: &PairCosts<'_>,
    last: bool,
) -> Result<Evaluated, Error> {
    let analysis = Analysis::new(model, estimator, form, &in_parallel)?;
    let predictions = (0..goals).map(|goal| analysis.predict(goal));
    let predictions = predictions.collect::<Result<Vec<_>, _>>()?;
    let choose = || analysis.choose(&predictions, terms, &in_parallel);
    Ok(Evaluated {
        merit: analysis.figure_of_merit(&predictions, terms)?,
        chosen: (!last).then(choose).transpose()?,
    })
}

/// Chooses pairs from a first choice on: what the theory chooses is tried, and kept if it is better.
///
/// # Errors
/// What `evaluate` says.
pub fn choose(
    start: Vec<u8>,
    mut evaluate: impl FnMut(&[u8], bool) -> Result<Evaluated, Error>,
) -> Result<Vec<u8>, Error> {
    let mut best = start;
    let mut found = evaluate(&best, false)?;
    for round in 2..=ROUNDS {
        let Some(next) = found.chosen.take() else {
            break;
        };
        if !(next.variance * next.work < WORTH_TRYING * found.merit.work) {
            break;
        }
        let evaluated = evaluate(&next.table, round == ROUNDS)?;
        if !(evaluated.merit.relative_to(&found.merit) < 1.0) {
            break;
        }
        (best, found) = (next.table, evaluated);
    }
    Ok(best)
}

/// The number of nodes of an analysis that chooses pairs, for `cells` cells with `each` nodes in each.
///
/// # Errors
/// [`Error::Option`] for more nodes than the choice can go through.
pub fn nodes(cells: usize, each: usize) -> Result<usize, Error> {
    let nodes = cells.saturating_mul(each);
    if nodes <= MOST_NODES {
        return Ok(nodes.max(NODES));
    }
    let message = format!(
        "\"theory\" looks at all pairs of {cells} cells in {nodes} points, and more than {MOST_NODES} take too long: \
         use at most {} cells, or \"default\"",
        MOST_NODES / each
    );
    Err(Error::Option {
        subject: Subject::Pairs,
        message,
    })
}

/// The bytes that the choice of pairs takes for `cells` cells with `each` nodes in each; 0 for other pairs.
#[must_use]
pub fn memory(pairs: Pairs, cells: usize, each: usize) -> usize {
    if pairs != Pairs::Theory {
        return 0;
    }
    let sites = cells.max(NODES / each);
    sites.saturating_mul(sites).saturating_mul(PAIR)
}

/// The numbers of pairs of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PairCounts {
    /// Pairs in S.
    pub in_s: usize,
    /// Pointwise pairs.
    pub pointwise: usize,
    /// Pairs left out; in a room also those that do not see each other.
    pub neither: usize,
}

impl PairCounts {
    /// Counts the pairs of a table of kinds.
    #[must_use]
    pub fn of(table: &[u8]) -> Self {
        let count = |kind: PairKind| table.iter().filter(|&&of| of == kind as u8).count();
        Self {
            in_s: count(PairKind::Galerkin),
            pointwise: count(PairKind::Pointwise),
            neither: count(PairKind::Dropped),
        }
    }

    /// The counts for people: " (10 in S, 2 pointwise, 4 neither)".
    #[must_use]
    pub fn text(&self) -> String {
        format!(
            " ({} in S, {} pointwise, {} neither)",
            self.in_s, self.pointwise, self.neither
        )
    }
}

/// The kinds of all pairs of `cells` cells, as a table of rows.
#[must_use]
pub fn table_of(pairs: &impl PairsTrait, cells: usize) -> Vec<u8> {
    (0..cells)
        .flat_map(|i| (0..cells).map(move |j| (i, j)))
        .map(|(i, j)| pairs.kind(i, j) as u8)
        .collect()
}
