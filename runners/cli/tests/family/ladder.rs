//! A ladder of fixed settings: what a user would try who knows nothing of a problem.
//!
//! Times are those that the library predicts of what was counted: set-ups, states, scores. They are a function of the
//! problem alone, as the choice is, and no machine's load is in them.
//!
//! A rung is not walked to its end: few walks tell its variance, more walks those of rungs that may be the best, and a rung
//! whose set-up alone takes longer than another one is not climbed. Then the best is walked to its end.

use std::collections::VecDeque;

use fredholm::answer::{Answer, Solved, Walks};
use fredholm::cost::WalkCost;
use fredholm::model::{Model, Partitioned, Request, Wanted};
use fredholm::{Choices, Estimator, Goal, Pairs, Settings, Tolerance, WalkOptions};
use fredholm_core::{MIN_BATCHES, Statistics, next_stage};
use fredholm_file::Resolved;

/// The walks of every rung at first, and those of rungs that may be the best. Variances from N scores are believed to
/// 4/√N, two standard deviations for a kurtosis of 17: to 12 %, and to 3 %.
const WALKS: [u64; 2] = [1024, 16_384];
/// The degrees of the ladder.
const DEGREES: [usize; 3] = [0, 2, 4];
/// How walks of the ladder end: by roulette, or with a constant q0. Values below 0.2 are for what has no finite variance with
/// shorter walks.
const ABSORPTIONS: [Option<f64>; 5] = [None, Some(0.5), Some(0.2), Some(0.05), Some(0.01)];
/// How many times the predicted walks a rung has before it is given up.
pub(crate) const MOST_TIMES: f64 = 4.0;

/// Seconds of a set-up, the cells and the degree.
type Step = (f64, usize, usize);

/// How far the time of so many walks may be off.
fn doubt(walks: u64) -> f64 {
    4.0 / (walks as f64).sqrt()
}

/// A fixed setting, and what few walks tell of it.
#[derive(Clone, Debug)]
pub(crate) struct Rung {
    plain: bool,
    cells: usize,
    degree: usize,
    pairs: Pairs,
    /// q0; `None`: roulette.
    absorption: Option<f64>,
    /// Seconds of the set-up.
    set_up: f64,
    /// Seconds of a walk.
    walk: f64,
    /// The walks of a target that tell this.
    told: u64,
    /// The standard deviation and the estimate of every target: where u is close to 0, a part of it takes most.
    targets: Vec<[f64; 2]>,
}

impl Rung {
    /// For people.
    pub(crate) fn name(&self) -> String {
        let Self {
            cells,
            degree,
            pairs,
            absorption,
            ..
        } = self;
        let ending = absorption.map_or("roulette".to_owned(), |q| q.to_string());
        if self.plain {
            return format!("plain {ending}");
        }
        format!("{cells} {degree} {} {ending}", pairs.word())
    }

    /// The number of walks of every target to a tolerance, in whole stages.
    fn walks(&self, tolerance: Tolerance) -> impl Iterator<Item = f64> {
        self.targets.iter().map(move |[std_dev, estimate]| {
            in_stages((std_dev / tolerance.error_at(*estimate)).powi(2))
        })
    }

    /// Seconds to a tolerance.
    pub(crate) fn seconds(&self, tolerance: Tolerance) -> f64 {
        self.set_up + self.walk * self.walks(tolerance).sum::<f64>()
    }

    /// Seconds if targets have these walks.
    pub(crate) fn seconds_of(&self, all: &[Statistics]) -> f64 {
        let walks: u64 = all.iter().map(Statistics::walks).sum();
        self.set_up + self.walk * walks as f64
    }

    /// Seconds to a tolerance, if they are less than walks tell by as much as they may be wrong.
    fn hopeful(&self, tolerance: Tolerance) -> f64 {
        self.seconds(tolerance) * (1.0 - doubt(self.told))
    }

    /// Whether it ends walks as the choice does where no error is asked for, and so many of each target take so many seconds with their set-up
    /// at most.
    pub(crate) fn is_within(&self, walks: u64, seconds: f64) -> bool {
        self.absorption.is_none() && self.seconds_for(walks) <= seconds
    }

    /// Seconds of plain walks by roulette.
    pub(crate) fn plain_seconds(&self, walks: u64) -> Option<f64> {
        (self.plain && self.absorption.is_none()).then(|| self.seconds_for(walks))
    }

    /// Seconds of so many walks of each target, and of the set-up.
    fn seconds_for(&self, walks: u64) -> f64 {
        self.set_up + self.walk * walks as f64 * self.targets.len() as f64
    }

    /// Seconds of so many walks of each target times their variances, of which rounding leaves the second of these deviations, over that of the
    /// first, in the mean.
    pub(crate) fn variance_time(&self, walks: u64, deviations: &[[f64; 2]]) -> f64 {
        let own = self.targets.iter().zip(deviations);
        let of = own.map(|(own, [other, floor])| (own[0].max(*floor) / other).powi(2));
        self.seconds_for(walks) * of.sum::<f64>() / deviations.len() as f64
    }

    /// Whether more walks tell more of it.
    pub(crate) const fn is_told_by_few(&self) -> bool {
        self.told < WALKS[1]
    }

    fn settings(&self, settings: &Settings) -> Settings {
        Settings {
            cells: Some(self.cells),
            degree: Some(self.degree),
            pairs: Some(self.pairs),
            absorption: self.absorption,
            estimator: self.absorption.map(|_| Estimator::Absorption),
            ..settings.clone()
        }
    }

    /// Walks of this setting until the tolerance is reached; `None` if it is not, after some times the predicted walks.
    pub(crate) fn run(
        &self,
        problem: &Opened<'_>,
        tolerance: Tolerance,
    ) -> Option<Vec<Statistics>> {
        let mut settings = self.settings(problem.settings);
        let most = self.walks(tolerance).fold(0.0, f64::max);
        settings.walks = Some((MOST_TIMES * most) as u64);
        settings.tolerance = Some(tolerance);
        settings.seed = 2;
        let cells = problem.model.partition(&settings.discretisation()).ok()?;
        let walk = settings.walk_options();
        let answer = if self.plain {
            problem.plain(&*cells, &walk)
        } else {
            problem.solved(&Solved::new(&*cells).ok()?, &walk)
        };
        let all = answer?.outcome.statistics;
        let mut each = all.iter();
        let reached = each.all(|statistics| tolerance.reached(statistics, MIN_BATCHES));
        reached.then_some(all)
    }
}

/// So many walks at least, in whole stages of batches of 4,096.
fn in_stages(walks: f64) -> f64 {
    let (mut batches, needed) = (0_u64, walks / 4096.0);
    if !(needed < 1e6) {
        return walks;
    }
    while batches == 0 || (batches as f64) < needed {
        batches += next_stage(batches, u64::MAX);
    }
    4096.0 * batches as f64
}

/// A problem that is read.
pub(crate) struct Opened<'p> {
    pub(crate) model: &'p dyn Model,
    pub(crate) settings: &'p Settings,
    pub(crate) goals: Vec<Goal>,
}

impl<'p> Opened<'p> {
    /// The goals of a problem.
    pub(crate) fn new(resolved: &'p Resolved) -> Self {
        let model = resolved.model.model();
        Self {
            model,
            settings: &resolved.settings,
            goals: fredholm::goals(model, &resolved.targets).unwrap(),
        }
    }

    /// Looks at the variance of plain walks, as every solve does once: in three dimensions by three million values of the kernel, a third
    /// of a second. What the ladder takes does not contain it, and where that was kept nobody has looked yet.
    pub(crate) fn look_at_variance(&self) {
        if let Ok(cut) = self.model.partition(&self.settings.discretisation()) {
            let _ = cut.plain_radius();
        }
    }

    fn walks(&self) -> Walks<'_> {
        Walks {
            model: self.model,
            scalar: self.settings.scalar,
            execution: None,
        }
    }

    fn request<'a>(&'a self, walk: &'a WalkOptions) -> Request<'a> {
        Request {
            goals: &self.goals,
            walk,
            wanted: Wanted::All,
        }
    }

    fn plain(&self, cells: &dyn Partitioned<'_>, walk: &WalkOptions) -> Option<Answer> {
        cells.check_variance(walk).ok()?;
        let walked = self.walks().plain(cells, &self.request(walk), &());
        walked.ok()
    }

    fn solved(&self, solved: &Solved<'_>, walk: &WalkOptions) -> Option<Answer> {
        solved.system.check_variance(walk).ok()?;
        let walked = solved.walk(&self.walks(), &self.request(walk), &());
        walked.ok()
    }

    /// The cells and degrees of the ladder, from short set-ups to long ones.
    pub(crate) fn steps(&self, cells: &[usize]) -> VecDeque<Step> {
        let mut steps = Vec::new();
        for &cells in cells {
            for degree in DEGREES {
                let settings = self.on(cells, degree);
                if let Ok(cut) = self.model.partition(&settings.discretisation()) {
                    steps.push((cut.cost(Pairs::Default).setup, cells, degree));
                }
            }
        }
        steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        steps.into()
    }

    /// Adds rungs whose set-up alone takes no longer than the best, or than this many seconds, and has walks of the rungs that
    /// may be the best until they are known well.
    pub(crate) fn refine(
        &self,
        rungs: &mut Vec<Rung>,
        steps: &mut VecDeque<Step>,
        (tolerance, most): (Tolerance, f64),
    ) {
        loop {
            let seconds = |rung: &Rung| rung.seconds(tolerance);
            let best = rungs.iter().map(seconds).fold(f64::INFINITY, f64::min);
            let is_next = |step: &&Step| rungs.is_empty() || step.0 < best.min(most);
            if let Some(&(_, cells, degree)) = steps.front().filter(is_next) {
                steps.pop_front();
                self.climb(cells, degree, rungs);
                continue;
            }
            let may_be_best =
                |rung: &&mut Rung| rung.told < WALKS[1] && rung.hopeful(tolerance) < best;
            let Some(rung) = rungs.iter_mut().find(may_be_best) else {
                return;
            };
            let again = self.walk_again(rung);
            // A variance that more walks find infinite ends a rung.
            *rung = again.unwrap_or_else(|| Rung {
                told: WALKS[1],
                set_up: f64::INFINITY,
                ..rung.clone()
            });
        }
    }

    /// The rung as more walks tell it.
    pub(crate) fn walk_again(&self, rung: &Rung) -> Option<Rung> {
        let settings = rung.settings(self.settings);
        let cut = self.model.partition(&settings.discretisation()).ok()?;
        let walk = WalkOptions {
            walks: WALKS[1],
            tolerance: None,
            ..settings.walk_options()
        };
        if rung.plain {
            return self.plain_rung(&*cut, rung.cells, &walk);
        }
        let system = (rung.cells, rung.degree, &Solved::new(&*cut).ok()?);
        self.solved_rung(&*cut, system, &walk)
    }

    fn on(&self, cells: usize, degree: usize) -> Settings {
        Settings {
            cells: Some(cells),
            degree: Some(degree),
            ..self.settings.clone()
        }
    }

    /// The rungs on these cells with this degree.
    fn climb(&self, cells: usize, degree: usize, rungs: &mut Vec<Rung>) {
        let settings = self.on(cells, degree);
        let Ok(cut) = self.model.partition(&settings.discretisation()) else {
            return;
        };
        let solved = Solved::new(&*cut).ok();
        let mut found = false;
        for absorption in ABSORPTIONS {
            if found && absorption.is_some_and(|q| q < 0.2) {
                return;
            }
            let settings = Settings {
                absorption,
                estimator: absorption.map(|_| Estimator::Absorption),
                ..settings.clone()
            };
            let mut walk = settings.walk_options();
            walk.walks = WALKS[0];
            walk.tolerance = None;
            let before = rungs.len();
            // Plain walks are the same on all cells.
            if degree == 0 {
                rungs.extend(self.plain_rung(&*cut, cells, &walk));
            }
            for pairs in [Pairs::Default, Pairs::Pointwise, Pairs::Rays] {
                walk.pairs = pairs;
                if let Some(solved) = &solved
                    && self.model.check(&settings.discretisation(), pairs).is_ok()
                {
                    let system = (cells, degree, solved);
                    rungs.extend(self.solved_rung(&*cut, system, &walk));
                }
            }
            found |= rungs.len() > before;
        }
    }

    fn plain_rung(
        &self,
        cut: &dyn Partitioned<'_>,
        cells: usize,
        walk: &WalkOptions,
    ) -> Option<Rung> {
        let answer = self.plain(cut, walk)?;
        let each = (cut.cost(walk.pairs).plain, 0.0);
        Some(self.rung(&answer, (true, cells, 0, walk), each))
    }

    /// The rung of a system on cells of a degree.
    fn solved_rung(
        &self,
        cut: &dyn Partitioned<'_>,
        (cells, degree, solved): (usize, usize, &Solved<'_>),
        walk: &WalkOptions,
    ) -> Option<Rung> {
        let answer = self.solved(solved, walk)?;
        let cost = cut.cost(walk.pairs);
        let each = (cost.walk, cost.setup);
        Some(self.rung(&answer, (false, cells, degree, walk), each))
    }

    /// The rung of an answer.
    fn rung(
        &self,
        answer: &Answer,
        (plain, cells, degree, walk): (bool, usize, usize, &WalkOptions),
        (each, set_up): (WalkCost, f64),
    ) -> Rung {
        let all = &answer.outcome.statistics;
        let of = |count: fn(&Statistics) -> u64| all.iter().map(count).sum::<u64>() as f64;
        let walks = of(Statistics::walks);
        let states = of(Statistics::states) / walks;
        let found = |statistics: &Statistics| {
            let found = statistics.preconditioned();
            [found.std_dev.unwrap_or(f64::INFINITY), found.estimate]
        };
        Rung {
            plain,
            cells,
            degree,
            pairs: walk.pairs,
            absorption: walk.absorption.probability(),
            set_up,
            walk: each.seconds(walk.absorption.estimator(), states, answer.pointwise),
            told: walk.walks,
            targets: all.iter().map(found).collect(),
        }
    }
}
