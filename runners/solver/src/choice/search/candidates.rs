//! The candidates: what may be chosen at all, and what may be tried next.

use fredholm_core::{Estimator, Real};

use super::super::family::{Family, Level, Prediction};
use super::super::setting::Setting;
use super::{CONFIRM, OTHER_WALKS, Search};
use fredholm_model::LastSteps;

use crate::{Discretisation, Error, Pairs, Settings};

/// The values of q0 to choose from. A large one is best if the Galerkin solution is so good that only the time of a walk
/// matters, a small one if long walks tell more. The variance of bright scenes is finite for those below 0.1 alone: with
/// reflectance r, for those below 1 − r², of which 1 − r leaves every weight as it is.
const ABSORPTIONS: [f64; 11] = [
    0.7, 0.5, 0.35, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001,
];
/// How much larger ρ is taken than few cells tell, so that the largest absorption is safe for the true one, too: they told half a
/// thousandth less of a Gaussian on a square.
const ROUGH_RADIUS: f64 = 1.001;
/// The most bytes of a set-up that nobody asked for.
const MEMORY: usize = 1 << 30;
/// The most unknowns of a set-up that nobody asked for.
const UNKNOWNS: usize = 1 << 17;

/// The values of q0 to choose from: the given one, if there is one.
pub(super) fn absorptions(settings: &Settings) -> Vec<f64> {
    open(settings.absorption, &ABSORPTIONS)
}

/// A number below 1, rounded down to two digits.
fn two_digits(number: f64) -> f64 {
    let powers = core::iter::successors(Some(100.0), |power| Some(10.0 * power));
    let mut powers = powers.take(9);
    let power = powers.find(|power| number * power >= 10.0);
    power.map_or(0.0, |power| (number * power).floor() / power)
}

fn open<T: Copy>(given: Option<T>, all: &[T]) -> Vec<T> {
    given.map_or_else(|| all.to_vec(), |given| vec![given])
}

impl Search<'_> {
    /// Drops values of q0 with an infinite variance of plain walks, before anything expensive is set up, and those for
    /// which an error bar may be far off: its own variance needs fourth moments, which are finite if the spectral radius of
    /// T_k⁴p is below 1. If K is a constant, that is ρ²/(1 − q0) with the spectral radius ρ of T_k²p.
    ///
    /// # Errors
    /// [`Error::InfiniteVariance`]: none is left.
    pub(super) fn drop_infinite_variances(&mut self) -> Result<(), Error> {
        if self.settings.allow_infinite_variance {
            return Ok(());
        }
        let base = self.plain();
        let cells = self.model.partition(&self.with_valid_cells(&base))?;
        // k² p is K²/p, and p has the factor 1 − q0.
        let squares = cells.plain_radius(base.absorption)? * (1.0 - base.absorption);
        let radius = |absorption: f64| squares / (1.0 - absorption);
        let least = self.absorptions.last().copied();
        self.absorptions
            .retain(|&absorption| radius(absorption) < 1.0);
        if self.absorptions.is_empty() {
            let base = Setting {
                absorption: least.unwrap_or(base.absorption),
                ..base
            };
            cells.check_variance(&base.applied(self.settings).walk_options())?;
        }
        let is_safe = |absorption: &f64| radius(*absorption).powi(2) < 1.0 - absorption;
        self.absorptions.retain(is_safe);
        // Walks as short as they may be: next to the largest constant they are several times as long on the next smaller value.
        let largest = two_digits(1.0 - Real::exp(2.0 / 3.0 * Real::ln(ROUGH_RADIUS * squares)));
        let largest = open(self.settings.absorption, &[largest.min(ABSORPTIONS[0])]);
        let is_larger = |of: &f64| *of > self.absorptions.first().copied().unwrap_or(0.0);
        let largest = largest.into_iter().find(|of| is_larger(of) && is_safe(of));
        self.absorptions.splice(0..0, largest);
        // The least of all has the least radius.
        if self.absorptions.is_empty() {
            self.absorptions.extend(least);
        }
        Ok(())
    }

    /// Plain walks, and every degree with every choice of pairs, as far as they are open.
    pub(super) fn begin_families(&mut self) {
        let degrees: Vec<usize> = (0..=self.about.most_degree).collect();
        let pairs = open(self.settings.pairs, self.model.pairs_to_choose());
        let degrees = open(self.settings.degree, &degrees);
        let sources: &[bool] = match self.model.exact_source_size().is_some() {
            true => &[false, true],
            false => &[false],
        };
        let sources = open(self.settings.exact_source, sources);
        let last_steps = self.last_steps();
        let mut all = Vec::new();
        for &last_step in &last_steps {
            all.push(Setting {
                last_step,
                ..self.plain()
            });
            for &degree in &degrees {
                for &pairs in &pairs {
                    all.extend(sources.iter().map(|&exact_source| Setting {
                        degree,
                        pairs,
                        exact_source,
                        last_step,
                        ..self.base()
                    }));
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
            let batch = self.settings.batch();
            self.families.push(Family::new(first, levels, order, batch));
        }
    }

    /// Whether last steps lead to the light: both, where that is open and may pay.
    fn last_steps(&self) -> Vec<bool> {
        match (self.settings.last_step, self.model.last_steps()) {
            (Some(given), LastSteps::Open { .. }) => vec![given],
            (None, LastSteps::Open { pay: true }) => vec![false, true],
            _ => vec![false],
        }
    }

    /// The setting from which others start, with the shortest walks.
    fn base(&self) -> Setting {
        let walk = self.settings.walk_options();
        Setting {
            plain: false,
            cells: 1,
            degree: self.settings.discretisation().degree,
            pairs: walk.pairs,
            exact_source: false,
            last_step: false,
            absorption: self.absorptions.first().copied().unwrap_or(walk.absorption),
            estimator: walk.estimator,
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
            self.refusal.get_or_insert(refusal);
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
        let mut known = self.model.coarse_levels(&cut);
        known.extend(self.model.levels(&cut));
        let beyond = core::iter::successors(known.last().map(finer), |cells| Some(finer(cells)));
        let price = self.best().map_or(f64::INFINITY, |best| self.price(&best));
        let mut levels: Vec<Level> = Vec::new();
        for cells in known.iter().copied().chain(beyond).take(most) {
            let level = match self.model.partition(&cut.on(cells)) {
                // An equation of a crate of its own may refuse numbers of cells that it has not named.
                Err(_) if !levels.is_empty() => break,
                level => level?,
            };
            let (cost, unknowns) = (level.cost(setting.pairs), level.unknowns());
            let is_large = level.memory(&[], setting.pairs) > MEMORY || unknowns > UNKNOWNS;
            if is_large || (!levels.is_empty() && cost.setup > price) {
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
                walks < self.sample.walks(CONFIRM)
                    && best.is_none_or(|best| best.setting != found.setting)
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
                all.extend(self.with_other_walks(family));
            }
        }
        all.retain(|found| !self.refuses(&found.setting));
        all
    }

    /// What a family may take at best with the walks next to its own, if they have the least variance that they may have; a
    /// pilot on the cells of the last one would tell.
    fn with_other_walks(&self, family: &Family) -> Vec<Prediction> {
        let of = |best: &Prediction| {
            let pilot = family.pilot_for(&best.setting)?;
            let level = |cells| family.level(cells);
            Some((
                pilot,
                level(pilot.setting.cells)?,
                level(best.setting.cells)?,
            ))
        };
        let best = self.best_of(family.found.iter());
        let Some((pilot, own, level)) = best.as_ref().and_then(of) else {
            return Vec::new();
        };
        let next = self.next_to(&pilot.setting).into_iter();
        let new = next.filter(|walks| !family.walks().contains(walks));
        let of = |walks| {
            let setting = pilot.setting.with_walks(walks);
            let other = pilot.with_walks(setting, OTHER_WALKS);
            let [here, there] = [own, level].map(|level| family.predict(&other, level));
            let more = self.remaining_setup(&there) - self.remaining_setup(&here);
            Prediction {
                hopeful: more + there.hopeful,
                pilot_walks: 0,
                ..here
            }
        };
        new.map(of).collect()
    }

    /// The walks next to those of a setting: a little longer, a little shorter, with the other estimator.
    fn next_to(&self, setting: &Setting) -> Vec<(f64, Estimator)> {
        let own = setting.walks();
        let at = self.absorptions.iter().position(|of| *of == own.0);
        let at = at.unwrap_or(0);
        let beside = [at.checked_sub(1), Some(at + 1)].into_iter().flatten();
        let beside = beside.filter_map(|at| Some((*self.absorptions.get(at)?, own.1)));
        let all = [Estimator::Absorption, Estimator::Collision];
        let estimators = open(self.settings.estimator, &all).into_iter();
        let other = estimators.filter(|other| *other != own.1);
        beside.chain(other.map(|other| (own.0, other))).collect()
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_are_rounded_down_to_two_digits() {
        let all = [0.7, 0.043_9, 0.001_23, 3.0e-11, -1.0, f64::NAN];
        let found = all.map(super::two_digits);
        assert_eq!(found, [0.7, 0.043, 0.001_2, 0.0, 0.0, 0.0]);
    }
}
