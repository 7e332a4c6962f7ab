//! The kinds of the pairs of one row, for given λ.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Estimator;
use fredholm_core::galerkin::{GalerkinError, PairKind, buffer, reserve};

use crate::{AllowedKinds, Node};

/// Passes over a row, at most.
const PASSES: usize = 30;

/// A point from which steps are taken, with what is known there.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) point: usize,
    pub(crate) cell: usize,
    /// a and b, times the weight of the node.
    pub(crate) occupation: f64,
    pub(crate) mixed: f64,
    pub(crate) source: f64,
    pub(crate) residual: f64,
    pub(crate) error: f64,
    pub(crate) value: f64,
    /// 1/q; 0 where walks are not absorbed.
    pub(crate) per_absorption: f64,
}

impl Place {
    pub(crate) fn new(node: &Node, occupation: f64, mixed: f64) -> Self {
        Self {
            point: node.point,
            cell: node.cell,
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
                [difference, g].each(|by| difference * by * self.per_absorption)
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
pub(crate) struct Part {
    pub(crate) fixed: f64,
    pub(crate) t: f64,
}

/// The parts of a pair in S, pointwise and left out: in the order of the kinds.
pub(crate) type Parts = [Part; 3];

const KINDS: [PairKind; 3] = [PairKind::Galerkin, PairKind::Pointwise, PairKind::Dropped];

/// A row with all that its kinds decide.
pub(crate) struct Problem<'a> {
    pub(crate) estimator: Estimator,
    pub(crate) places: &'a [Place],
    /// For every cell and every place.
    pub(crate) parts: &'a [Parts],
    pub(crate) allowed: &'a [AllowedKinds],
    /// The pairs that may be anything at all.
    pub(crate) free: &'a [usize],
    /// How often G is scored in the row.
    pub(crate) scorings: f64,
}

/// Kinds of a row, with F − G in its places.
#[derive(Clone)]
pub(crate) struct State {
    pub(crate) kinds: Vec<u8>,
    pub(crate) differences: Vec<f64>,
}

impl Problem<'_> {
    fn parts(&self, j: usize) -> &[Parts] {
        let count = self.places.len();
        self.parts.get(j * count..(j + 1) * count).unwrap_or(&[])
    }

    fn price(&self, j: usize, kind: u8) -> f64 {
        let price = self.allowed.get(j).and_then(|of| of.pointwise);
        match (kind, price) {
            (1, Some(price)) => self.scorings * price,
            _ => 0.0,
        }
    }

    fn allows(&self, j: usize, kind: PairKind) -> bool {
        let of = self.allowed.get(j).copied().unwrap_or_default();
        match kind {
            PairKind::Galerkin => of.galerkin,
            PairKind::Pointwise => of.pointwise.is_some(),
            PairKind::Dropped => of.left_out || !(of.galerkin || of.pointwise.is_some()),
        }
    }

    pub(crate) fn state(&self, kinds: Vec<u8>) -> Result<State, GalerkinError> {
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
        let mut kinds = buffer(self.allowed.len())?;
        for (j, kind) in kinds.iter_mut().enumerate() {
            let first = order.into_iter().find(|&kind| self.allows(j, kind));
            *kind = first.unwrap_or_default() as u8;
        }
        self.state(kinds)
    }

    /// Variance and price of a state.
    pub(crate) fn outcome(&self, state: &State) -> [f64; 2] {
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

    /// Calls `visit` with the best that is found for every λ: from cheap pairs on for falling ones, and from pointwise pairs
    /// on for rising ones.
    pub(crate) fn solve(
        &self,
        lambdas: &[f64],
        mut visit: impl FnMut(usize, &State, [f64; 2]),
    ) -> Result<(), GalerkinError> {
        use PairKind::{Dropped, Galerkin, Pointwise};
        let mut rising = self.all([Pointwise, Galerkin, Dropped])?;
        let mut of_rising: Vec<(State, [f64; 2])> = reserve(lambdas.len())?;
        for &lambda in lambdas.iter().rev() {
            self.descend(&mut rising, lambda);
            of_rising.push((rising.clone(), self.outcome(&rising)));
        }
        let mut falling = self.all([Galerkin, Dropped, Pointwise])?;
        for (number, &lambda) in lambdas.iter().enumerate() {
            self.descend(&mut falling, lambda);
            let own = self.outcome(&falling);
            let value = |[variance, price]: [f64; 2]| variance + lambda * price;
            match of_rising.pop() {
                Some((other, of_other)) if value(of_other) < value(own) => {
                    visit(number, &other, of_other);
                }
                _ => visit(number, &falling, own),
            }
        }
        Ok(())
    }
}

fn part(parts: &Parts, kind: u8) -> Part {
    parts.get(usize::from(kind)).copied().unwrap_or_default()
}
