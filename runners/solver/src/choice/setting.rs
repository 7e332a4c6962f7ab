//! What may be chosen.

use crate::chosen::PRECONDITIONED;
use crate::{Discretisation, Model, Pairs, Settings};
use fredholm_model::cost::{Cost, WalkCost};

/// The numbers of cells that may be chosen, from few to many: only the given one, if one is given.
pub(crate) fn cells_to_choose(
    model: &dyn Model,
    cut: &Discretisation,
    given: Option<usize>,
) -> Vec<usize> {
    if let Some(cells) = given {
        return vec![cells];
    }
    let mut all = model.coarse_levels(cut);
    all.extend(model.levels(cut));
    all
}

/// One value for everything that may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Setting {
    /// Whether walks follow no neighbour equation.
    pub(super) plain: bool,
    /// The number of cells as [`Settings`] count them: of a cube, per axis.
    pub(super) cells: usize,
    pub(super) degree: usize,
    pub(super) pairs: Pairs,
    /// Whether the last step of walks leads to the light.
    pub(super) last_step: bool,
}

impl Setting {
    /// The settings with this choice, in which nothing is open.
    pub(super) fn applied(&self, settings: &Settings) -> Settings {
        Settings {
            cells: Some(self.cells),
            degree: Some(self.degree),
            pairs: Some(self.pairs),
            // Elsewhere there is none to choose, and a refusal of it would have nowhere to point.
            last_step: self.last_step.then_some(true),
            ..settings.clone()
        }
    }

    /// The setting with this number of cells.
    pub(super) const fn on(self, cells: usize) -> Self {
        Self { cells, ..self }
    }

    /// Whether one solved system serves both settings.
    pub(super) fn shares_system(&self, other: &Self) -> bool {
        let of = |of: &Self| (of.plain, of.cells, of.degree);
        of(self) == of(other)
    }

    /// Whether the settings have the same kind of neighbour equation, or none.
    pub(super) fn shares_family(&self, other: &Self) -> bool {
        let of = |of: &Self| (of.plain, of.degree, of.pairs, of.last_step);
        of(self) == of(other)
    }

    /// Whether a refusal of another setting holds for this one: its walks are as short, and on as few cells h is no
    /// closer to k.
    pub(super) fn is_refused_with(&self, refused: &Self) -> bool {
        self.shares_family(refused) && self.cells <= refused.cells
    }

    /// Seconds of the set-up, of the part of it that is left once the system is solved, and of that which the first walks make.
    pub(super) const fn setup(&self, cost: &Cost) -> [f64; 3] {
        if self.plain {
            [0.0; 3]
        } else {
            [cost.setup, cost.source, cost.kept]
        }
    }

    /// The cost of a walk.
    pub(super) const fn walk(&self, cost: &Cost) -> WalkCost {
        let walk = if self.plain { cost.plain } else { cost.walk };
        WalkCost {
            score: walk.score + if self.last_step { cost.light } else { 0.0 },
            ..walk
        }
    }

    /// The method's name in the report.
    pub(super) const fn method(&self) -> &'static str {
        if self.plain { "plain" } else { PRECONDITIONED }
    }
}
