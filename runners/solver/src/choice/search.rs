//! From cheap pilots to what they promise.

use fredholm_core::{Estimator, MIN_BATCHES, Tolerance};

use super::family::Family;
use super::pilot::{self, Doubt, Level, Pilot, Prediction, Sample, Scales, Setting};
use super::rare::RareVariances;
use super::systems::Systems;
use fredholm_rayon::Observer;

use crate::answer::{Answer, Walks, Watch};
use crate::cost::{Cost, PointwisePairs};
use crate::goal::Target;
use crate::model::{About, Request};
use crate::{Discretisation, Error, Model, Pairs, Partitioned, Settings};

/// Seconds of a pilot besides its walks and its set-up.
const PILOT: f64 = 0.1e-3;
/// Walks of a pilot, and what it may take.
#[derive(Clone, Copy, Debug)]
struct Allowance {
    /// Of each of its targets.
    walks: u64,
    /// The share of the best prediction so far that it may take.
    one: f64,
    /// The same of all pilots until then, and it.
    all: f64,
    /// Whether its set-up counts: one that the answer may go on with is judged by what it may save.
    setup: bool,
}

/// Of pilots that look around.
const LOOK: Allowance = Allowance {
    walks: 256,
    one: 0.03,
    all: 0.2,
    setup: true,
};
/// Of those that look at finer cells of the best.
const CLIMB: Allowance = Allowance {
    walks: 512,
    one: 0.15,
    all: 0.35,
    setup: false,
};
/// Of those that look at finer cells of others.
const AGAIN: Allowance = Allowance {
    setup: true,
    ..CLIMB
};
/// Of those that look at the same cells with other walks.
const VARY: Allowance = Allowance { one: 0.01, ..AGAIN };
/// Of those that look at others closely.
const CONFIRM: Allowance = Allowance {
    walks: 2048,
    all: 0.5,
    ..AGAIN
};
/// Of those that confirm the best.
const CONFIRM_BEST: Allowance = Allowance {
    setup: false,
    ..CONFIRM
};
/// Walks that scored from which on they tell how rare scores are.
const TOLD: f64 = 64.0;
/// The part of a round which, if it is enough, is enough even if pilots missed scores that are very rare.
const SURELY: f64 = 1.0 / 16.0;
/// What cells next to corners take of a set-up.
const CORNERS: f64 = 0.1;
/// The spectral radius of T_k²p from which on a variance is close to infinite: few walks do not show it.
const FAR: f64 = 0.85;
/// How rare large scores are with bounded kernels, and with others.
const BOUNDED: f64 = 3.0;
const SINGULAR: f64 = 14.0;
/// The spectral radius of T_k²p where it is not known, and the least of 1 less it.
const RADIUS: f64 = 0.55;
const LEAST: f64 = 0.01;
/// The part of the rare variance that is counted on where that of η is close to infinite: weights are rare then, too. With
/// 100 cells of degree 3 and 200 of degree 4 of a square room 2²² walks show 14 % and 3 % of it, 2¹⁸ walks 4 % and ½ %.
const MET: f64 = 0.125;
/// How many times slower plain walks may be for a second look at them.
const HOPELESS: f64 = 10.0;
/// The part of 1/q0 that walks are at least long.
const SHORTER: f64 = 0.9;
/// Levels to begin with, and how many more there are where the finest is the best.
const LEVELS: usize = 5;
/// Bytes that a set-up may take which nobody asked for, and unknowns.
const MEMORY: usize = 1 << 30;
const UNKNOWNS: usize = 1 << 17;
/// Walks of pilots are others than those of the answer, which they must not be able to prefer.
const SEED: u64 = 0x0070_696c_6f74;
/// q0 to choose from: large where the Galerkin solution is so good that only the time of a walk matters,
/// small where long walks tell more. The cheapest pilots come first.
const ABSORPTIONS: [f64; 5] = [0.7, 0.5, 0.35, 0.2, 0.1];

/// Pilots so far, and what they promise.
pub(super) struct Search<'m> {
    model: &'m dyn Model,
    about: About,
    settings: &'m Settings,
    tolerance: Tolerance,
    watch: &'m dyn Watch,
    /// The values of q0 that are tried, and that from which to start.
    absorptions: Vec<f64>,
    shortest: Option<f64>,
    /// The spectral radius of T_k²p without absorption, where it is known.
    second_moment: Option<f64>,
    sample: Sample,
    families: Vec<Family>,
    /// Those of which no pilot was made, as it would not have paid.
    waiting: Vec<Family>,
    found: Vec<Prediction>,
    pub(super) systems: Systems<'m>,
    rare: RareVariances,
    /// E η² of walks with an absorption and an estimator.
    squares: Vec<((f64, Estimator), Vec<f64>)>,
    /// Settings that the problem has refused.
    refused: Vec<Setting>,
    /// The first that a setting met: what there is to say where none is taken.
    refusal: Option<Error>,
    /// Predicted seconds of the pilots so far.
    spent: f64,
    pub(super) pilots: usize,
    pub(super) walks: u64,
}

/// The values to choose from: the one that is given, if there is one.
fn open<T: Copy>(given: Option<T>, all: &[T]) -> Vec<T> {
    given.map_or_else(|| all.to_vec(), |given| vec![given])
}

/// Whether one of these is the same but for longer walks or more cells.
fn is_refused(refused: &[Setting], setting: &Setting) -> bool {
    let like = |refused: &Setting| {
        let same = Setting {
            cells: setting.cells,
            absorption: setting.absorption,
            estimator: setting.estimator,
            ..*refused
        };
        same == *setting
            && setting.absorption >= refused.absorption
            && setting.cells <= refused.cells
    };
    refused.iter().any(like)
}

/// Seconds of a walk that ends as it does on average.
fn walk_seconds(setting: &Setting, cost: &Cost, pairs: PointwisePairs) -> f64 {
    let walk = setting.walk(cost);
    walk.seconds(setting.estimator, 1.0 / setting.absorption, pairs)
}

impl<'m> Search<'m> {
    /// With an absorption of at most this, where the file leaves it open.
    ///
    /// # Errors
    /// [`Error::TwoGoals`].
    pub(super) fn new(
        model: &'m dyn Model,
        targets: &[Target],
        settings: &'m Settings,
        (tolerance, most): (Tolerance, f64),
        watch: &'m dyn Watch,
    ) -> Result<Self, Error> {
        let mut absorptions = open(settings.absorption, &ABSORPTIONS);
        absorptions.retain(|&absorption| absorption <= most);
        let about = model.about();
        Ok(Self {
            model,
            about,
            settings,
            tolerance,
            watch,
            shortest: absorptions.first().copied(),
            absorptions,
            second_moment: None,
            sample: Sample::new(model, targets)?,
            families: Vec::new(),
            waiting: Vec::new(),
            found: Vec::new(),
            systems: Systems::default(),
            rare: RareVariances::new(about.has_rare_scores),
            squares: Vec::new(),
            refused: Vec::new(),
            refusal: None,
            spent: 0.0,
            pilots: 0,
            walks: 0,
        })
    }

    /// Everything.
    pub(super) fn run(&mut self) {
        self.drop_infinite_variances();
        self.plain();
        self.families();
        self.shorten();
        self.settle();
        self.vary_plain();
        self.settle();
    }

    /// Looks at what is best until it stays the best.
    pub(super) fn settle(&mut self) {
        while self.begin_others()
            || self.look_at_others()
            || self.vary()
            || self.climb()
            || self.hope()
            || self.confirm()
        {}
    }

    /// The largest absorption below those that were looked at first, if there is one.
    pub(super) fn lower(&self) -> Option<f64> {
        self.absorptions.get(1).copied()
    }

    /// Whether what [`drop_infinite_variances`](Self::drop_infinite_variances) does would take longer than
    /// pilots in vain: it integrates a formula.
    pub(super) const fn checks_late(&self) -> bool {
        self.about.has_slow_radius
    }

    /// Forgets a setting that the problem refuses, shorter walks, and fewer cells, on which h is farther from k.
    pub(super) fn forget(&mut self, setting: Setting) {
        self.refused.push(setting);
        let refused = &self.refused;
        self.found
            .retain(|found| !is_refused(refused, &found.setting));
    }

    /// What there is to say where no setting is taken.
    pub(super) fn take_refusal(&mut self) -> Option<Error> {
        self.refusal.take()
    }

    /// Seconds of a set-up that are still to come.
    fn due(&self, setting: &Setting, [setup, source]: [f64; 2]) -> f64 {
        match self.systems.of(setting) {
            Some(_) => source,
            None => setup,
        }
    }

    /// The same of what is promised.
    fn due_of(&self, found: &Prediction) -> f64 {
        self.due(&found.setting, [found.setup, found.source])
    }

    /// What is minimised.
    fn price(&self, found: &Prediction) -> f64 {
        self.due_of(found) + found.prepared
    }

    /// The least that it may be.
    fn hoped(&self, found: &Prediction) -> f64 {
        self.due_of(found) + found.hoped
    }

    fn estimators(&self) -> Vec<Estimator> {
        let all = [Estimator::Absorption, Estimator::Collision];
        open(self.settings.estimator, &all)
    }

    /// All q0 and estimators that are open.
    fn kinds_of_walks(&self) -> Vec<(f64, Estimator)> {
        let of = |estimator: Estimator| {
            let absorptions = self.absorptions.iter();
            absorptions.map(move |&absorption| (absorption, estimator))
        };
        self.estimators().into_iter().flat_map(of).collect()
    }

    /// The setting from which others start: with the shortest walks.
    fn base(&self) -> Setting {
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

    /// The same without a neighbour equation.
    fn plain_base(&self) -> Setting {
        Setting {
            plain: true,
            degree: 0,
            pairs: Pairs::Default,
            ..self.base()
        }
    }

    /// Forgets values of q0 for which plain walks have no finite variance, as long as one is left, and starts from
    /// one for which it is far from infinite.
    fn drop_infinite_variances(&mut self) {
        if self.settings.allow_infinite_variance || self.checks_late() {
            return;
        }
        let base = self.plain_base();
        // What is wrong is said by whoever looks at it.
        let cells = self.model.partition(&self.opened(&base));
        let Ok(radius) = cells.and_then(|cells| cells.plain_radius(base.absorption)) else {
            return;
        };
        // k² p is K²/p, and p has the factor 1 − q0.
        let without = radius * (1.0 - base.absorption);
        self.second_moment = Some(without);
        let least = self.absorptions.last().copied();
        let finite = |absorption: f64| without / (1.0 - absorption) < 1.0;
        self.absorptions
            .retain(|&absorption| finite(absorption) || Some(absorption) == least);
        let mut far = self.absorptions.iter().copied();
        self.shortest = far.find(|&absorption| self.is_far(absorption)).or(least);
    }

    /// The spectral radius of T_k²p, or what it is taken for.
    fn radius(&self, absorption: f64) -> f64 {
        let radius = self.second_moment.map(|radius| radius / (1.0 - absorption));
        radius.unwrap_or(RADIUS)
    }

    /// Whether the variance is far from infinite.
    fn is_far(&self, absorption: f64) -> bool {
        self.radius(absorption) < FAR
    }

    const fn batch(&self) -> u64 {
        self.settings.batch
    }

    /// The best prediction so far.
    pub(super) fn best(&self) -> Option<Prediction> {
        self.best_of(|_| true)
    }

    /// The best of those.
    fn best_of(&self, of: impl Fn(&Prediction) -> bool) -> Option<Prediction> {
        let found = self.found.iter().filter(|found| of(found));
        found
            .min_by(|a, b| self.price(a).total_cmp(&self.price(b)))
            .copied()
    }

    /// The same of plain walks.
    pub(super) fn best_plain(&self) -> Option<Prediction> {
        self.best_of(|found| found.setting.plain)
    }

    /// Takes the family of a setting out of its list.
    fn take_family(&mut self, setting: &Setting) -> Option<Family> {
        let at = self.families.iter().position(|f| f.has(setting))?;
        Some(self.families.swap_remove(at))
    }

    /// Its seconds.
    fn least(&self) -> f64 {
        self.best().map_or(f64::INFINITY, |best| best.seconds())
    }

    /// Whether a pilot of so many walks is worth its time: whether it is cheap, and whether its setting is the best or
    /// one round of it would be faster.
    fn affords(
        &self,
        setting: &Setting,
        cost: &Cost,
        pairs: PointwisePairs,
        allowance: Allowance,
    ) -> bool {
        if is_refused(&self.refused, setting) {
            return false;
        }
        let Some(best) = self.best() else {
            return true;
        };
        let setup = self.due(setting, setting.setup(cost));
        let round = (self.batch() * MIN_BATCHES) as f64 * self.sample.weight();
        let round = round * walk_seconds(setting, cost, pairs);
        let seconds = self.seconds(setting, cost, pairs, allowance);
        (best.setting == *setting || setup + SHORTER * round <= self.price(&best))
            && seconds <= allowance.one * best.seconds()
            && self.spent + seconds <= allowance.all * best.seconds()
    }

    /// What counts of a pilot's time.
    fn seconds(
        &self,
        setting: &Setting,
        cost: &Cost,
        pairs: PointwisePairs,
        allowance: Allowance,
    ) -> f64 {
        let setup = self.due(setting, setting.setup(cost));
        let setup = if allowance.setup { setup } else { 0.0 };
        let walks = (allowance.walks * self.sample.targets() as u64) as f64;
        PILOT + setup + walks * walk_seconds(setting, cost, pairs)
    }

    /// Walks; `None` where the problem does not take the setting.
    fn pilot(&mut self, setting: Setting, allowance: Allowance) -> Option<Pilot> {
        if self.watch.cancelled() {
            return None;
        }
        let pilot = self.try_pilot(setting, allowance);
        let refused = |refusal| {
            self.refuse(refusal);
            self.forget(setting);
        };
        pilot.map_err(refused).ok()
    }

    /// Whether large scores may be so rare that a pilot which looks around misses them all.
    const fn has_rare_scores(&self, setting: &Setting) -> bool {
        // Steps next to corners are the smallest part of plain walks.
        self.is_singular() || self.about.has_rare_scores && !setting.plain
    }

    /// Whether the kernel may have a singularity that no walk has shown: one whose integral is given may.
    const fn is_singular(&self) -> bool {
        self.about.is_singular
    }

    /// How far few walks may be from the true variance, the farther the nearer it is to infinite.
    fn doubt(&self, absorption: f64) -> Doubt {
        let most = if self.is_singular() {
            SINGULAR
        } else {
            BOUNDED
        };
        let left = (1.0 - self.radius(absorption)).max(LEAST);
        let more = most / left.powf(1.25);
        // Close to infinite all few walks show too little.
        let is_far = self.is_far(absorption);
        let less = if is_far { more } else { 0.0 };
        let met = if is_far { 1.0 } else { MET };
        Doubt { more, less, met }
    }

    fn refuse(&mut self, refusal: Error) {
        self.refusal.get_or_insert(refusal);
    }

    fn try_pilot(&mut self, setting: Setting, allowance: Allowance) -> Result<Pilot, Error> {
        let settings = setting.applied(self.settings);
        let cells = self.cells(&setting)?;
        let mut walk = settings.walk_options();
        walk.walks = allowance.walks;
        walk.tolerance = None;
        walk.time_limit = None;
        walk.seed ^= SEED;
        let walks = Walks {
            model: self.model,
            scalar: self.settings.scalar,
        };
        let request = Request {
            goals: &self.sample.goals,
            walk: &walk,
            only_u: false,
        };
        let watch = Quiet(self.watch);
        let cost = cells.cost(setting.pairs);
        let answer = if setting.plain {
            walks.plain(&*cells, &request, &watch)?
        } else {
            if allowance.setup {
                self.spent += self.due(&setting, setting.setup(&cost));
            }
            let solved = self.systems.solve(&*cells, &setting, &self.sample.goals)?;
            self.rare.ask(&*cells, &setting, Some(solved))?;
            solved.walk(&walks, &request, &watch)?
        };
        let without = |radius: f64| radius * (1.0 - setting.absorption);
        self.second_moment = self.second_moment.or(answer.neighbour_radius.map(without));
        let squares = self.squares(&setting, &answer);
        let pilot = Pilot::new(
            setting,
            &self.sample,
            self.tolerance,
            (self.model, cells.unknowns()),
            &answer,
            &squares,
            self.doubt(setting.absorption),
        );
        self.pilots += 1;
        self.walks += pilot.walks;
        self.spent += PILOT + pilot.seconds(&cost);
        Ok(pilot)
    }

    /// E η² of the first pilot with these walks: it does not depend on cells.
    fn squares(&mut self, setting: &Setting, answer: &Answer) -> Vec<f64> {
        let walks = (setting.absorption, setting.estimator);
        let seen = self.squares.iter().find(|(of, _)| *of == walks);
        if let Some((_, squares)) = seen {
            return squares.clone();
        }
        let squares = pilot::squares(answer);
        if squares.iter().all(|&square| square > 0.0) {
            self.squares.push((walks, squares.clone()));
        }
        squares
    }

    /// The level on which plain walks are looked at: cells are those of no neighbour equation.
    fn plain_level(&mut self) -> Option<Level> {
        let base = self.plain_base();
        self.levels(&base, 1).0.first().copied()
    }

    /// Plain walks: the shortest, and those of every default.
    fn plain(&mut self) {
        let base = self.plain_base();
        let absorption = self.settings.walk_options().absorption;
        let default = Setting {
            absorption,
            estimator: Estimator::Collision,
            ..base
        };
        let Some(level) = self.plain_level() else {
            return;
        };
        let open = self.kinds_of_walks();
        for setting in [base, default] {
            if open.contains(&(setting.absorption, setting.estimator)) {
                self.pilot_plain(setting, &level, LOOK);
            }
        }
    }

    /// All other plain walks, unless they are hopeless.
    fn vary_plain(&mut self) {
        let plain: Vec<Prediction> = self
            .found
            .iter()
            .filter(|f| f.setting.plain)
            .copied()
            .collect();
        let fastest = plain.iter().map(Prediction::seconds).min_by(f64::total_cmp);
        if fastest.is_none_or(|fastest| fastest > HOPELESS * self.least()) {
            return;
        }
        let Some(level) = self.plain_level() else {
            return;
        };
        for (absorption, estimator) in self.kinds_of_walks() {
            let known = |f: &Prediction| (f.setting.absorption, f.setting.estimator);
            if plain.iter().all(|f| known(f) != (absorption, estimator)) {
                let setting = Setting {
                    absorption,
                    estimator,
                    ..self.plain_base()
                };
                self.pilot_plain(setting, &level, LOOK);
            }
        }
    }

    /// Whether there is a pilot more.
    fn pilot_plain(&mut self, setting: Setting, level: &Level, allowance: Allowance) -> bool {
        let setting = Setting {
            cells: level.cells,
            ..setting
        };
        let none = PointwisePairs::default();
        if !self.affords(&setting, &level.cost, none, allowance) {
            return false;
        }
        let Some(pilot) = self.pilot(setting, allowance) else {
            return false;
        };
        if pilot.scored() == 0.0 && allowance.walks < CONFIRM.walks {
            return self.pilot_plain(setting, level, CONFIRM);
        }
        self.found.retain(|found| found.setting != setting);
        self.found
            .push(pilot.predict(level, &Scales::PLAIN, self.batch()));
        true
    }

    /// Cells from few to many, so many levels and as far as they may pay, and how √Var falls with them, and what few
    /// walks miss of it; none where the problem does not take the setting.
    fn levels(&mut self, setting: &Setting, most: usize) -> (Vec<Level>, [f64; 2]) {
        let levels = self.try_levels(setting, most);
        let levels = levels.map_err(|refusal| self.refuse(refusal));
        levels.unwrap_or_default()
    }

    /// The cells of a setting.
    fn cells(&self, setting: &Setting) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let cut = setting.applied(self.settings).discretisation();
        self.model.check(&cut, setting.pairs)?;
        self.model.partition(&cut)
    }

    /// A setting's discretisation, but with cells that the model takes.
    fn opened(&self, setting: &Setting) -> Discretisation {
        let mut cut = setting.applied(self.settings).discretisation();
        // Few cells are cut faster than the default, if any number of them will do.
        if !self.about.takes_any_cells {
            cut.cells = None;
        }
        cut
    }

    fn try_levels(&self, setting: &Setting, most: usize) -> Result<(Vec<Level>, [f64; 2]), Error> {
        let open = self.opened(setting);
        self.model.check(&open, setting.pairs)?;
        let finer = |&cells: &usize| match self.about.dimension {
            Some(2..) => cells + cells.div_ceil(3),
            _ => 2 * cells,
        };
        let mut known = self.model.coarse_levels(&open);
        known.extend(self.model.levels(&open));
        let beyond = core::iter::successors(known.last().map(finer), |cells| Some(finer(cells)));
        let mut levels: Vec<Level> = Vec::new();
        for cells in known.iter().copied().chain(beyond).take(most) {
            let level = self.model.partition(&open.on(cells))?;
            let (cost, unknowns) = (level.cost(setting.pairs), level.unknowns());
            let large = level.memory(&[], setting.pairs) > MEMORY || unknowns > UNKNOWNS;
            if large || (levels.len() > 1 && cost.setup > self.least()) {
                break;
            }
            levels.push(Level {
                cells,
                unknowns: unknowns as f64,
                cost,
            });
        }
        // On few cells what limits the order in the end, as pairs next to corners do, is not all yet.
        let rare = self.model.order(&open, setting.pairs);
        let order = rare.midpoint(self.model.smooth_order(setting.degree));
        Ok((levels, [order, rare]))
    }

    /// A pilot on the fewest cells of every degree and every choice of pairs that may pay; others wait until they may.
    fn families(&mut self) {
        let degrees: Vec<usize> = (0..=self.about.most_degree).collect();
        let all = [Pairs::Default, Pairs::Pointwise];
        for degree in open(self.settings.degree, &degrees) {
            for pairs in open(self.settings.pairs, &all) {
                let first = Setting {
                    degree,
                    pairs,
                    ..self.base()
                };
                let (coarsest, order) = self.levels(&first, 1);
                let family = Family::new(first, coarsest, order);
                if let Some(family) = self.begin(family) {
                    self.waiting.push(family);
                }
            }
        }
    }

    /// A pilot on the fewest cells of a family, if it may pay; the family otherwise.
    fn begin(&mut self, mut family: Family) -> Option<Family> {
        if !self.explore(&mut family, 0, LOOK) {
            return Some(family);
        }
        self.extend(&mut family);
        self.families.push(family);
        None
    }

    /// The same of those that wait, as the best may not be what it seemed to be; whether one of them has begun.
    fn begin_others(&mut self) -> bool {
        let waiting = core::mem::take(&mut self.waiting);
        let before = waiting.len();
        let left = waiting.into_iter().filter_map(|family| self.begin(family));
        let left: Vec<Family> = left.collect();
        self.waiting = left;
        self.waiting.len() < before
    }

    /// More levels, if there are any, for all walks; whether there were.
    fn extend(&mut self, family: &mut Family) -> bool {
        let known = family.levels.len();
        let levels = self.levels(&family.first, known + LEVELS).0;
        let mut others = core::mem::take(&mut self.families);
        let own = (family.first.degree, family.first.pairs);
        let alike = others
            .iter_mut()
            .filter(|other| (other.first.degree, other.first.pairs) == own);
        for family in alike.chain([&mut *family]) {
            family.levels.clone_from(&levels);
            self.note(family);
        }
        self.families = others;
        levels.len() > known
    }

    /// A pilot on the level of this number, if that is cheap; whether it was.
    fn explore(&mut self, family: &mut Family, number: usize, allowance: Allowance) -> bool {
        let Some(&level) = family.levels.get(number) else {
            return false;
        };
        let setting = Setting {
            cells: level.cells,
            ..family.first
        };
        let pairs = match family.last() {
            Some(last) => last.pairs(level.unknowns),
            None => self.pairs_seen(&setting),
        };
        if !self.affords(&setting, &level.cost, pairs, allowance) {
            return false;
        }
        // The coarsest are solved in any case, and the best, too.
        let is_best = self.best().is_some_and(|best| best.setting == setting);
        let in_any_case = family.last().is_none() || is_best;
        if !in_any_case && self.look_at_corners(&setting, level.cost.setup) {
            self.note(family);
            return true;
        }
        let Some(pilot) = self.pilot(setting, allowance) else {
            return false;
        };
        family.add(number, pilot);
        self.note(family);
        self.note_others(&setting);
        true
    }

    /// Asks for the rare variance of a setting, if it is not known: a small part of a set-up which may be in vain.
    /// Whether it was asked for.
    fn look_at_corners(&mut self, setting: &Setting, setup: f64) -> bool {
        if self.rare.of(setting).is_some() {
            return false;
        }
        self.spent += CORNERS * setup;
        let cut = setting.applied(self.settings).discretisation();
        let cells = self.model.partition(&cut);
        let asked = cells.and_then(|cells| self.rare.ask(&*cells, setting, None));
        if let Err(refusal) = asked {
            self.refuse(refusal);
            self.forget(*setting);
        }
        self.note_others(setting);
        true
    }

    /// The same where it may save more than twice its time; whether there was something of the kind.
    fn look_at_others(&mut self) -> bool {
        let Some(best) = self.best() else {
            return false;
        };
        let gain = |found: &Prediction| {
            let seconds = CORNERS * found.setup;
            self.price(&best) - self.due_of(found) - found.luckily - 2.0 * seconds
        };
        let is_unknown = |found: &&Prediction| {
            found.setting != best.setting && self.rare.of(&found.setting).is_none()
        };
        let unknown = self.found.iter().filter(is_unknown);
        let most = unknown.max_by(|a, b| gain(a).total_cmp(&gain(b)));
        let most = most.filter(|found| gain(found) > 0.0).copied();
        most.is_some_and(|found| self.look_at_corners(&found.setting, found.setup))
    }

    /// What walks promise whose rare variance is known now.
    fn note_others(&mut self, setting: &Setting) {
        let families = core::mem::take(&mut self.families);
        let alike = |family: &&Family| {
            let own = (family.first.degree, family.first.pairs);
            own == (setting.degree, setting.pairs)
        };
        for family in families.iter().filter(alike) {
            self.note(family);
        }
        self.families = families;
    }

    /// Pointwise pairs of a row that were seen on these cells with another degree; none if there was no such pilot.
    fn pairs_seen(&self, setting: &Setting) -> PointwisePairs {
        let alike = |pilot: &&Pilot| {
            (pilot.setting.cells, pilot.setting.pairs) == (setting.cells, setting.pairs)
        };
        let seen = self.families.iter().filter_map(Family::last);
        let like = seen.rev().find(alike);
        like.map_or_else(PointwisePairs::default, |pilot| pilot.pointwise)
    }

    /// What a family promises, in place of what it has promised.
    fn note(&mut self, family: &Family) {
        self.found.retain(|found| !family.has(&found.setting));
        let mut promised = family.predictions(self.batch(), |setting| self.rare.of(setting));
        promised.retain(|found| !is_refused(&self.refused, &found.setting));
        self.found.extend(promised);
    }

    /// A pilot on a finer level, if what is promised is finer than what was seen; whether there was one.
    fn climb(&mut self) -> bool {
        let Some(best) = self.best() else {
            return false;
        };
        let Some(mut family) = self.take_family(&best.setting) else {
            return false;
        };
        let (cells, number) = (best.setting.cells, family.number(best.setting.cells));
        let more = family.is_last(cells) && self.extend(&mut family)
            || family.is_beyond(cells) && {
                let before = self.stopover(&family, &best);
                before.is_some_and(|before| self.explore(&mut family, before, CLIMB))
                    || self.explore(&mut family, number, CLIMB)
            };
        self.families.push(family);
        more
    }

    /// The level on the way to the best at which a look may save most.
    fn stopover(&self, family: &Family, best: &Prediction) -> Option<usize> {
        let before = |found: &Prediction| found.of == 0 && found.setting.cells < best.setting.cells;
        let (number, _) = self.promising(family, best, before)?;
        Some(number)
    }

    /// The level at which a look, or a closer one at another system, may save most, if it may save more than twice its
    /// time.
    fn promising(
        &self,
        family: &Family,
        best: &Prediction,
        of: impl Fn(&Prediction) -> bool,
    ) -> Option<(usize, Allowance)> {
        let look = |found: &Prediction| if found.of == 0 { AGAIN } else { CONFIRM };
        let gain = |found: &Prediction| {
            let walks = (look(found).walks * self.sample.targets() as u64) as f64;
            let seconds = self.due_of(found) + PILOT + walks * found.each;
            self.price(best) - self.hoped(found) - 2.0 * seconds
        };
        let own = self.found.iter().filter(|found| family.has(&found.setting));
        let other = |found: &Prediction| !found.setting.shares_system(&best.setting);
        let closer = |found: &Prediction| found.of < CONFIRM.walks && other(found);
        let open = own.filter(|found| of(found) && (found.of == 0 || closer(found)));
        let most = open.max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
        (gain(most) > 0.0).then(|| (family.number(most.setting.cells), look(most)))
    }

    /// A look at every family that may well be faster than the best, or a closer one: where its first pilot happened to
    /// show much variance, or other pairs were looked at on finer cells. Whether there was one.
    fn hope(&mut self) -> bool {
        let mut families = core::mem::take(&mut self.families);
        let mut more = false;
        for family in &mut families {
            let Some(best) = self.best().filter(|best| !family.has(&best.setting)) else {
                continue;
            };
            if let Some((number, allowance)) = self.promising(family, &best, |_| true) {
                more |= self.explore(family, number, allowance);
            }
        }
        self.families = families;
        more
    }

    /// Absorptions and estimators that the best neighbour equation has not been seen with; whether there were some.
    fn vary(&mut self) -> bool {
        let Some(best) = self.best_of(|found| !found.setting.plain) else {
            return false;
        };
        let family = self.families.iter().find(|f| f.has(&best.setting));
        let Some(family) = family.cloned() else {
            return false;
        };
        let (Some(level), Some(last)) = (family.seen(), family.last()) else {
            return false;
        };
        let mut unseen = Vec::new();
        for (absorption, estimator) in self.kinds_of_walks() {
            let setting = Setting {
                absorption,
                estimator,
                ..last.setting
            };
            let known = self.families.iter().any(|family| family.has(&setting));
            if !known && self.affords(&setting, &level.cost, last.pointwise, VARY) {
                unseen.push(setting);
            }
        }
        let seconds = unseen
            .iter()
            .map(|setting| self.seconds(setting, &level.cost, last.pointwise, VARY));
        // On few cells only if finer ones take longer to set up.
        if best.of == 0 && seconds.sum::<f64>() > self.due_of(&best) {
            return false;
        }
        let mut more = false;
        for setting in unseen {
            more |= self.try_varied(&family, setting);
        }
        more
    }

    /// Shorter walks for those families that they may make the best.
    fn shorten(&mut self) {
        for family in self.families.clone() {
            let mut shorter = self.absorptions.clone();
            shorter.retain(|&absorption| absorption > family.first.absorption);
            for absorption in shorter {
                self.shorten_to(&family, absorption);
            }
        }
    }

    /// A pilot of a family with shorter walks, if they would be the best with the variance that longer ones have.
    fn shorten_to(&mut self, family: &Family, absorption: f64) {
        let Some((level, pilot)) = family.seen().zip(family.last()) else {
            return;
        };
        let setting = Setting {
            absorption,
            ..pilot.setting
        };
        let alike = family.varied(pilot.shortened(setting, self.doubt(absorption)));
        let promised = alike.predictions(self.batch(), |setting| self.rare.of(setting));
        let seconds = promised
            .iter()
            .map(|found| self.due_of(found) + found.walking);
        let best = self.best().map(|best| self.price(&best));
        if seconds.min_by(f64::total_cmp) < best
            && self.affords(&setting, &level.cost, pilot.pointwise, VARY)
        {
            self.try_varied(family, setting);
        }
    }

    /// Whether there is a pilot more.
    fn try_varied(&mut self, family: &Family, setting: Setting) -> bool {
        let Some(pilot) = self.pilot(setting, VARY) else {
            return false;
        };
        let varied = family.varied(pilot);
        self.note(&varied);
        self.families.push(varied);
        true
    }

    /// More walks of what would be chosen, if much may hang on it; whether there were some.
    fn confirm(&mut self) -> bool {
        let Some(best) = self.best().filter(|best| best.of < CONFIRM.walks) else {
            return false;
        };
        // Rare scores would take no round more, and by far not where they may be very rare.
        let round = (self.batch() * MIN_BATCHES) as f64;
        let sure = if self.has_rare_scores(&best.setting) {
            best.most <= SURELY * round
        } else {
            best.prepared <= best.walking
        };
        let told = best.of > 0 && best.scored >= TOLD;
        if told && sure && self.is_far(best.setting.absorption) {
            return false;
        }
        if best.setting.plain {
            let level = self.plain_level();
            return level.is_some_and(|level| self.pilot_plain(best.setting, &level, CONFIRM));
        }
        let Some(mut family) = self.take_family(&best.setting) else {
            return false;
        };
        let number = family.number(best.setting.cells);
        let more = self.explore(&mut family, number, CONFIRM_BEST);
        self.families.push(family);
        more
    }
}

/// A watch that sees nothing of pilots, and may end them.
struct Quiet<'a>(&'a dyn Watch);

impl Observer for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

impl Watch for Quiet<'_> {}
