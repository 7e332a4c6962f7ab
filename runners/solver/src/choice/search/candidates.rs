//! The candidates: kinds of walks, cells, and the values from which the search starts.

use fredholm_core::Estimator;

use super::super::prediction::Level;
use super::super::setting::Setting;
use super::Search;
use crate::{Discretisation, Error, Pairs, Partitioned};

/// The values of q0 to choose from, the cheapest pilots first. A large one is best if the Galerkin solution is so good
/// that only the time of a walk matters, a small one if long walks tell more. The variance of bright scenes is finite for
/// those below 0.1 alone: with reflectance r, for those below 1 − r², of which 1 − r leaves every weight as it is.
pub(super) const ABSORPTIONS: [f64; 11] = [
    0.7, 0.5, 0.35, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001,
];
/// The most bytes of a set-up that nobody asked for.
const MEMORY: usize = 1 << 30;
/// The most unknowns of a set-up that nobody asked for.
const UNKNOWNS: usize = 1 << 17;

/// The values to choose from: the given one, if there is one.
pub(super) fn open<T: Copy>(given: Option<T>, all: &[T]) -> Vec<T> {
    given.map_or_else(|| all.to_vec(), |given| vec![given])
}

impl<'m> Search<'m> {
    /// All values of q0 and all estimators that are open.
    pub(super) fn kinds_of_walks(&self) -> Vec<(f64, Estimator)> {
        let of = |estimator: Estimator| {
            let absorptions = self.absorptions.iter();
            absorptions.map(move |&absorption| (absorption, estimator))
        };
        self.estimators().into_iter().flat_map(of).collect()
    }

    fn estimators(&self) -> Vec<Estimator> {
        let all = [Estimator::Absorption, Estimator::Collision];
        open(self.settings.estimator, &all)
    }

    /// The setting from which others start, with the shortest walks.
    pub(super) fn base(&self) -> Setting {
        let walk = self.settings.walk_options();
        Setting {
            plain: false,
            cells: 1,
            degree: self.settings.discretisation().degree,
            pairs: walk.pairs,
            absorption: self.shortest.unwrap_or(walk.absorption),
            estimator: walk.estimator,
        }
    }

    /// The base setting without a neighbour equation.
    pub(super) fn plain_base(&self) -> Setting {
        Setting {
            plain: true,
            degree: 0,
            pairs: Pairs::Default,
            ..self.base()
        }
    }

    /// The cells of a setting.
    pub(super) fn cells(&self, setting: &Setting) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let cut = setting.applied(self.settings).discretisation();
        self.model.check(&cut, setting.pairs)?;
        self.model.partition(&cut)
    }

    /// The discretisation of a setting, but with a number of cells that the model takes.
    pub(super) fn with_valid_cells(&self, setting: &Setting) -> Discretisation {
        let mut cut = setting.applied(self.settings).discretisation();
        // If the model takes any number, few cells are cut faster than the default.
        if !self.about.takes_any_cells {
            cut.cells = None;
        }
        cut
    }

    /// At most this number of levels from few cells to many, as far as they may pay, and two orders: that of √Var, and
    /// that of what few walks miss of it. There are none if the problem refuses the setting.
    pub(super) fn levels(&mut self, setting: &Setting, most: usize) -> (Vec<Level>, [f64; 2]) {
        let levels = self.try_levels(setting, most);
        let levels = levels.map_err(|refusal| self.refuse(refusal));
        levels.unwrap_or_default()
    }

    fn try_levels(&self, setting: &Setting, most: usize) -> Result<(Vec<Level>, [f64; 2]), Error> {
        let cut = self.with_valid_cells(setting);
        self.model.check(&cut, setting.pairs)?;
        let finer = |&cells: &usize| match self.about.dimension {
            Some(2..) => cells + cells.div_ceil(3),
            _ => 2 * cells,
        };
        let mut known = self.model.coarse_levels(&cut);
        known.extend(self.model.levels(&cut));
        let beyond = core::iter::successors(known.last().map(finer), |cells| Some(finer(cells)));
        let mut levels: Vec<Level> = Vec::new();
        for cells in known.iter().copied().chain(beyond).take(most) {
            let level = match self.model.partition(&cut.on(cells)) {
                // An equation of a crate of its own may refuse numbers of cells that it has not named.
                Err(_) if !levels.is_empty() => break,
                level => level?,
            };
            let (cost, unknowns) = (level.cost(setting.pairs), level.unknowns());
            let large = level.memory(&[], setting.pairs) > MEMORY || unknowns > UNKNOWNS;
            if large || (levels.len() > 1 && cost.setup > self.least_seconds()) {
                break;
            }
            levels.push(Level {
                cells,
                unknowns: unknowns as f64,
                cost,
            });
        }
        // On few cells the causes that limit the order in the end, as pairs next to corners do, are not yet dominant.
        let rare = self.model.order(&cut, setting.pairs);
        let order = rare.midpoint(self.model.smooth_order(setting.degree));
        Ok((levels, [order, rare]))
    }
}
