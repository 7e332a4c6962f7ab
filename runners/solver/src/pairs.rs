//! `Pairs::Theory`: every pair in S, pointwise or left out, for the least predicted variance × time.

use fredholm_core::galerkin::{OffDiagonal, PairKind, PairTable, Pairs as PairsTrait};
use fredholm_core::Estimator;
use fredholm_room::RoomPairs;
use fredholm_variance::{Analysis, Chosen, Terms, VarianceModel, Worth};
use serde::Serialize;

use crate::diagnosis::in_parallel;
use crate::error::Subject;
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

/// Pairs of any kind, for an analysis.
#[derive(Clone, Copy, Debug)]
pub(crate) enum AnyPairs<'a> {
    Diagonal(OffDiagonal),
    Views(RoomPairs<'a>),
    Table(PairTable<'a>),
}

impl PairsTrait for AnyPairs<'_> {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match self {
            Self::Diagonal(pairs) => pairs.kind(i, j),
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
