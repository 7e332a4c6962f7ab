//! `Pairs::Theory`: every pair in S, pointwise or left out, for the least predicted variance × time.

use fredholm_core::Estimator;
use fredholm_core::galerkin::{OffDiagonal, PairKind, PairTable, Pairs as PairsTrait};
use fredholm_room::RoomPairs;
use fredholm_variance::{Analysis, Chosen, Terms, VarianceModel, Worth};
use serde::Serialize;

use crate::error::Subject;
use crate::examined::in_parallel;
use crate::{Error, Pairs};

/// The most nodes, whose pairs are gone through some thirty times.
const MOST_NODES: usize = 6200;
/// Bytes of a pair of sites: moments, contributions and a kind.
const PAIR: usize = 48 + 8 + 1;
/// Nodes where cells are few.
const NODES: usize = 400;
/// A choice that promises less than this improvement is not tried.
const WORTH_TRYING: f64 = 0.95;
/// Choices that are tried.
const ROUNDS: usize = 3;

/// Cells in a row that are near to each other pointwise, all other pairs in S: for a kernel with a singularity at x = y,
/// near which no piecewise polynomial is close to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    /// The number of neighbours on each side.
    pub(crate) width: usize,
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
pub(crate) enum AnyPairs<'a> {
    Diagonal(OffDiagonal),
    Band(Band),
    Views(RoomPairs<'a>),
    Table(PairTable<'a>),
}

impl PairsTrait for AnyPairs<'_> {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match self {
            Self::Diagonal(pairs) => pairs.kind(i, j),
            Self::Band(pairs) => pairs.kind(i, j),
            Self::Views(pairs) => pairs.kind(i, j),
            Self::Table(pairs) => pairs.kind(i, j),
        }
    }
}

/// What is known of a choice, and the next one unless it is the last.
pub(crate) struct Evaluated {
    worth: Worth,
    chosen: Option<Chosen>,
}

/// Analyses a choice, and chooses from there unless it is the last.
pub(crate) fn evaluate(
    model: &dyn VarianceModel,
    estimator: Estimator,
    goals: usize,
    terms: &Terms<'_>,
    last: bool,
) -> Result<Evaluated, Error> {
    let analysis = Analysis::new(model, estimator, &in_parallel)?;
    let predictions = (0..goals).map(|goal| analysis.predict(goal));
    let predictions = predictions.collect::<Result<Vec<_>, _>>()?;
    let choose = || analysis.choose(&predictions, terms, &in_parallel);
    Ok(Evaluated {
        worth: analysis.worth(&predictions, terms)?,
        chosen: (!last).then(choose).transpose()?,
    })
}

/// From this choice on: what is chosen is tried, and kept if it is better.
pub(crate) fn choose(
    start: Vec<u8>,
    mut evaluate: impl FnMut(&[u8], bool) -> Result<Evaluated, Error>,
) -> Result<Vec<u8>, Error> {
    let mut best = start;
    let mut found = evaluate(&best, false)?;
    for round in 2..=ROUNDS {
        let Some(next) = found.chosen.take() else {
            break;
        };
        if !(next.variance * next.work < WORTH_TRYING * found.worth.work) {
            break;
        }
        let evaluated = evaluate(&next.table, round == ROUNDS)?;
        if !(evaluated.worth.relative_to(&found.worth) < 1.0) {
            break;
        }
        (best, found) = (next.table, evaluated);
    }
    Ok(best)
}

/// The nodes for so many cells, each with so many nodes.
pub(crate) fn nodes(cells: usize, each: usize) -> Result<usize, Error> {
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

/// Bytes that it takes for so many cells, each with so many nodes; 0 for other pairs.
pub(crate) fn memory(pairs: Pairs, cells: usize, each: usize) -> usize {
    if pairs != Pairs::Theory {
        return 0;
    }
    let sites = cells.max(NODES / each);
    sites.saturating_mul(sites).saturating_mul(PAIR)
}

/// How many pairs are what.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PairCounts {
    /// Pairs in S.
    pub in_s: usize,
    /// Pointwise pairs.
    pub pointwise: usize,
    /// Pairs left out; in a room also those that do not see each other.
    pub neither: usize,
}

impl PairCounts {
    pub(crate) fn of(table: &[u8]) -> Self {
        let count = |kind: PairKind| table.iter().filter(|&&of| of == kind as u8).count();
        Self {
            in_s: count(PairKind::Galerkin),
            pointwise: count(PairKind::Pointwise),
            neither: count(PairKind::None),
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

/// The kinds of all pairs, as a table.
pub(crate) fn table_of(pairs: &impl PairsTrait, cells: usize) -> Vec<u8> {
    (0..cells)
        .flat_map(|i| (0..cells).map(move |j| (i, j)))
        .map(|(i, j)| pairs.kind(i, j) as u8)
        .collect()
}
