//! The candidates: what may be chosen at all, and what may be tried next.

use fredholm_core::Real;

use super::super::aim::Aim;
use super::super::family::{Family, FamilyWalks, Level, Prediction};
use super::super::setting::{Setting, cells_to_choose};
use super::{LONG_SECONDS, Search};
use fredholm_model::LastSteps;

use crate::answer::Solved;
use crate::whole::best_absorption;
use crate::{Discretisation, Error, Pairs};

/// The most bytes of a set-up that nobody asked for.
const MEMORY: usize = 1 << 30;
/// The largest ρ by which the length of walks is guessed.
const LONGEST: f64 = 0.999;
/// The most unknowns of a set-up that nobody asked for.
const UNKNOWNS: usize = 1 << 17;

fn open<T: Copy>(given: Option<T>, all: &[T]) -> Vec<T> {
    given.map_or_else(|| all.to_vec(), |given| vec![given])
}

impl<'m> Search<'m> {
    /// Refuses walks of infinite variance, before anything expensive is set up, and tells about how long walks are: with roulette
    /// 1/(1 − ρ) states, where ρ² is the radius of T_k²p; and how walks of a sequence end.
    ///
    /// # Errors
    /// [`Error::InfiniteVariance`].
    pub(super) fn look_at_variance(&mut self) -> Result<(), Error> {
        let mut cut = self.plain().applied(self.settings).discretisation();
        cut.cells = self.settings.cells;
        let cells = self.model.partition(&cut)?;
        if !self.settings.allow_infinite_variance {
            cells.check_variance(&self.settings.walk_options())?;
        }
        self.of_sequences = match self.settings.absorption {
            None => Some(best_absorption(cells.plain_radius()?)),
            said => said,
        };
        self.states = match self.settings.absorption().probability() {
            Some(q) => 1.0 / q,
            None => 1.0 / (1.0 - Real::sqrt(cells.plain_radius()?).min(LONGEST)),
        };
        Ok(())
    }

    /// Plain walks, and every degree with every choice of pairs, as far as they are open.
    pub(super) fn begin_families(&mut self) {
        let degrees: Vec<usize> = (0..=self.about.most_degree).collect();
        let pairs = open(self.settings.pairs, self.model.about().pairs_to_choose);
        let degrees = open(self.settings.degree, &degrees);
        let last_steps = self.last_steps();
        let mut all = Vec::new();
        for &last_step in &last_steps {
            all.push(Setting {
                last_step,
                ..self.plain()
            });
            for &degree in &degrees {
                for &pairs in &pairs {
                    all.push(Setting {
                        degree,
                        pairs,
                        last_step,
                        ..self.base()
                    });
                }
            }
        }
        // What h = k and G in closed form leave of v is the same with a last step and without.
        let gains = |of: &Setting| of.plain || !of.last_step || of.pairs != Pairs::Pointwise;
        if last_steps.len() > 1 {
            all.retain(gains);
        }
        for first in all {
            let levels = self.levels(&first, 1);
            let cut = first.applied(self.settings).discretisation();
            // On few cells the causes that limit the order in the end, as pairs next to corners do, are not yet dominant.
            let limit = self.model.order(&cut, first.pairs);
            let order = limit.midpoint(self.model.smooth_order(first.degree));
            let walks = FamilyWalks {
                batch: self.settings.batch(),
                given: self.aim.walks(),
                estimator: self.settings.absorption().estimator(),
                states: self.states,
            };
            self.families.push(Family::new(first, levels, order, walks));
        }
    }

    /// Takes the system on the cells and of the degree that the settings name, which is solved.
    pub(in super::super) fn keep(&mut self, solved: Solved<'m>) {
        let setting = Setting {
            cells: self.settings.cells.unwrap_or(1),
            ..self.base()
        };
        self.systems.keep(setting, solved);
    }

    /// Whether there are several settings that may be chosen.
    pub(in super::super) fn is_open(&self) -> bool {
        let may = |family: &&Family| self.may_answer(&family.first) && !family.levels.is_empty();
        self.settings.cells.is_none() || self.families.iter().filter(may).count() > 1
    }

    /// Whether last steps lead to the light: both, where that is open and may pay.
    fn last_steps(&self) -> Vec<bool> {
        match (self.settings.last_step, self.model.about().last_steps) {
            (Some(given), LastSteps::Open { .. }) => vec![given],
            (None, LastSteps::Open { pay: true }) => vec![false, true],
            _ => vec![false],
        }
    }

    /// The setting from which others start.
    fn base(&self) -> Setting {
        let walk = self.settings.walk_options();
        Setting {
            plain: false,
            cells: 1,
            degree: self.settings.discretisation().degree,
            pairs: walk.pairs,
            last_step: false,
        }
    }

    /// The base setting without a neighbour equation.
    fn plain(&self) -> Setting {
        Setting {
            plain: true,
            degree: 0,
            pairs: Pairs::Default,
            ..self.base()
        }
    }

    /// The discretisation of a setting, but with a number of cells that the model takes.
    fn with_valid_cells(&self, setting: &Setting) -> Discretisation {
        let mut cut = setting.applied(self.settings).discretisation();
        // If the model takes any number, few cells are cut faster than the default.
        if !self.about.takes_any_cells {
            cut.cells = None;
        }
        cut
    }

    /// At most this number of levels from few cells to many, as far as they may pay. There are none if the problem refuses
    /// the setting.
    pub(super) fn levels(&mut self, setting: &Setting, most: usize) -> Vec<Level> {
        self.try_levels(setting, most).unwrap_or_else(|refusal| {
            self.unfit.get_or_insert(refusal);
            Vec::new()
        })
    }

    fn try_levels(&self, setting: &Setting, most: usize) -> Result<Vec<Level>, Error> {
        let cut = self.with_valid_cells(setting);
        self.model.check(&cut, setting.pairs)?;
        let finer = |&cells: &usize| match self.about.dimension {
            Some(2..) => cells + cells.div_ceil(3),
            _ => 2 * cells,
        };
        let given = self.settings.cells;
        let known = cells_to_choose(self.model, &cut, given);
        let beyond = core::iter::successors(known.last().map(finer), |cells| Some(finer(cells)));
        let most = given.map_or(most, |_| 1);
        let best = self.best();
        let most_seconds = best.map_or(f64::INFINITY, |best| match self.aim {
            Aim::Error(_) => self.price(&best),
            Aim::Walks(_) => self.may_take().min(LONG_SECONDS),
        });
        let mut levels: Vec<Level> = Vec::new();
        for cells in known.iter().copied().chain(beyond).take(most) {
            let level = match self.model.partition(&cut.on(cells)) {
                // An equation of a crate of its own may refuse numbers of cells that it has not named.
                Err(_) if !levels.is_empty() => break,
                level => level?,
            };
            let (cost, unknowns) = (level.cost(setting.pairs), level.unknowns());
            let is_large = level.memory(&[], setting.pairs) > MEMORY || unknowns > UNKNOWNS;
            if is_large && given.is_none() || (!levels.is_empty() && cost.setup > most_seconds) {
                break;
            }
            levels.push(Level {
                cells,
                unknowns: unknowns as f64,
                cost,
            });
        }
        Ok(levels)
    }

    /// Whatever a pilot may show to be the best, with what is known of it.
    pub(super) fn candidates(&self, best: Option<&Prediction>) -> Vec<Prediction> {
        // The best is confirmed last of all, and finer cells are no better where nothing scores.
        let is_open = |found: &&Prediction| match found.pilot_walks {
            0 => found.scored > 0,
            walks => {
                walks < self.confirming() && best.is_none_or(|best| best.setting != found.setting)
            }
        };
        let mut all = Vec::new();
        for family in &self.families {
            if family.pilots.is_empty() {
                let on = |level: &Level| family.first.on(level.cells);
                let mut levels = family.levels.iter();
                let first = levels.find(|level| !self.refuses(&on(level)));
                all.extend(first.map(|level| family.unknown(level, &self.sample.weights)));
            } else {
                all.extend(family.found.iter().filter(is_open));
            }
        }
        all.retain(|found| !self.refuses(&found.setting) && !self.is_long(found));
        all
    }
}
