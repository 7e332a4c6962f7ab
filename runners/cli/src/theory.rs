//! `pairs = "theory"`: every pair in S, pointwise or left out, for the least predicted variance × time.

use fredholm_core::Estimator;
use fredholm_core::galerkin::{OffDiagonal, PairKind, PairTable, Pairs};
use fredholm_room::RoomPairs;
use fredholm_variance::{Analysis, Chosen, Terms, VarianceError, VarianceModel, Worth};
use serde::Serialize;

use crate::diagnose::in_parallel;
use crate::failure::Failure;
use crate::file::{self, ProblemFile};

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

/// Pairs of any kind, for an analysis.
#[derive(Clone, Copy, Debug)]
pub(crate) enum AnyPairs<'a> {
    Diagonal(OffDiagonal),
    Views(RoomPairs<'a>),
    Table(PairTable<'a>),
}

impl Pairs for AnyPairs<'_> {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match self {
            Self::Diagonal(pairs) => pairs.kind(i, j),
            Self::Views(pairs) => pairs.kind(i, j),
            Self::Table(pairs) => pairs.kind(i, j),
        }
    }
}

/// What there is to know of a choice.
pub(crate) struct Looked {
    worth: Worth,
    chosen: Option<Chosen>,
}

/// Analyses a choice, and chooses from there unless it is the last.
pub(crate) fn look(
    model: &dyn VarianceModel,
    estimator: Estimator,
    targets: usize,
    terms: &Terms<'_>,
    last: bool,
) -> Result<Looked, Failure> {
    let looked = || -> Result<Looked, VarianceError> {
        let analysis = Analysis::new(model, estimator, &in_parallel)?;
        let predictions = (0..targets).map(|target| analysis.predict(target));
        let predictions = predictions.collect::<Result<Vec<_>, _>>()?;
        let choose = || analysis.choose(&predictions, terms, &in_parallel);
        Ok(Looked {
            worth: analysis.worth(&predictions, terms)?,
            chosen: (!last).then(choose).transpose()?,
        })
    };
    looked().map_err(Failure::run)
}

/// From this choice on: what is chosen is tried, and kept if it is better.
pub(crate) fn choose(
    start: Vec<u8>,
    mut look: impl FnMut(&[u8], bool) -> Result<Looked, Failure>,
) -> Result<Vec<u8>, Failure> {
    let mut best = start;
    let mut found = look(&best, false)?;
    for round in 2..=ROUNDS {
        let Some(next) = found.chosen.take() else {
            break;
        };
        if !(next.variance * next.work < WORTH_TRYING * found.worth.work) {
            break;
        }
        let looked = look(&next.table, round == ROUNDS)?;
        if !(looked.worth.relative_to(&found.worth) < 1.0) {
            break;
        }
        (best, found) = (next.table, looked);
    }
    Ok(best)
}

/// The nodes for so many cells, each with so many nodes.
pub(crate) fn nodes(file: &ProblemFile, cells: usize, each: usize) -> Result<usize, Failure> {
    let nodes = cells.saturating_mul(each);
    if nodes <= MOST_NODES {
        return Ok(nodes.max(NODES));
    }
    let message = format!(
        "\"theory\" looks at all pairs of {cells} cells in {nodes} points, and more than {MOST_NODES} take too long: \
         use at most {} cells, or \"default\"",
        MOST_NODES / each
    );
    Err(file.refuse(&file.galerkin.pairs, message).into())
}

/// Bytes that it takes for so many cells, each with so many nodes; 0 for other pairs.
pub(crate) fn memory(file: &ProblemFile, cells: usize, each: usize) -> usize {
    if file.galerkin.pairs.value != file::Pairs::Theory {
        return 0;
    }
    let sites = cells.max(NODES / each);
    sites.saturating_mul(sites).saturating_mul(PAIR)
}

/// How many pairs are what.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct PairCounts {
    pub(crate) in_s: usize,
    pub(crate) pointwise: usize,
    /// Left out; in a room those too that do not see each other.
    pub(crate) neither: usize,
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

    /// "theory pairs (10 in S, 2 pointwise, 4 left out)".
    pub(crate) fn text(&self) -> String {
        format!(
            " ({} in S, {} pointwise, {} neither)",
            self.in_s, self.pointwise, self.neither
        )
    }
}

/// Of all pairs the kind that a choice gives them.
pub(crate) fn table_of(pairs: &impl Pairs, cells: usize) -> Vec<u8> {
    (0..cells)
        .flat_map(|i| (0..cells).map(move |j| (i, j)))
        .map(|(i, j)| pairs.kind(i, j) as u8)
        .collect()
}
