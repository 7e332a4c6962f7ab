//! A ladder of fixed settings: what a user would try who knows nothing of a problem.
//!
//! Times are those that the library predicts of what was counted: set-ups, states, scores. They are a function of the
//! problem alone, as the choice is, and no machine's load is in them.

use fredholm::answer::{Answer, Solved, Walks};
use fredholm::cost::Cost;
use fredholm::model::{Model, Partitioned, Request};
use fredholm::{Choices, Estimator, Goal, Pairs, Settings, Tolerance, WalkOptions};
use fredholm_core::{MIN_BATCHES, Statistics, next_stage};
use fredholm_file::Resolved;

/// The walks of a rung. The standard deviation that they tell is off by some per cent, where large scores are not rare.
const WALKS: u64 = 16_384;
/// The degrees of the ladder.
const DEGREES: [usize; 3] = [0, 2, 4];
/// The values of q0 of the ladder. Those below 0.2 are for what has no finite variance with shorter walks.
const ABSORPTIONS: [f64; 4] = [0.5, 0.2, 0.05, 0.01];
/// How many times the predicted walks a rung has before it is given up.
const MOST_TIMES: f64 = 4.0;

/// A fixed setting, and what few walks tell of it.
#[derive(Clone, Debug)]
pub(crate) struct Rung {
    plain: bool,
    cells: usize,
    degree: usize,
    pairs: Pairs,
    absorption: f64,
    /// Seconds of the set-up.
    set_up: f64,
    /// Seconds of a walk.
    walk: f64,
    /// The standard deviation and the estimate of every target.
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
        if self.plain {
            return format!("plain {absorption}");
        }
        format!("{cells} {degree} {} {absorption}", pairs.word())
    }

    /// The number of walks of every target to a tolerance, in whole stages.
    fn walks(&self, tolerance: Tolerance) -> impl Iterator<Item = f64> {
        self.targets.iter().map(move |[std_dev, estimate]| {
            let bound = match tolerance {
                Tolerance::Absolute(bound) => bound,
                Tolerance::Relative(bound) => bound * estimate.abs(),
            };
            in_stages((std_dev / bound).powi(2))
        })
    }

    /// Seconds to a tolerance.
    pub(crate) fn seconds(&self, tolerance: Tolerance) -> f64 {
        self.set_up + self.walk * self.walks(tolerance).sum::<f64>()
    }

    /// Seconds of these walks.
    pub(crate) fn seconds_of(&self, all: &[Statistics]) -> f64 {
        let walks: u64 = all.iter().map(Statistics::walks).sum();
        self.set_up + self.walk * walks as f64
    }

    fn settings(&self, settings: &Settings) -> Settings {
        Settings {
            cells: Some(self.cells),
            degree: Some(self.degree),
            pairs: Some(self.pairs),
            absorption: Some(self.absorption),
            estimator: Some(Estimator::Absorption),
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
            problem.solved(&Solved::new(&*cells, self.absorption).ok()?, &walk)
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
            only_u: false,
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

    /// All rungs that the problem takes.
    pub(crate) fn ladder(&self, cells: &[usize]) -> Vec<Rung> {
        let mut rungs = Vec::new();
        for &cells in cells {
            for degree in DEGREES {
                self.climb(cells, degree, &mut rungs);
            }
        }
        rungs
    }

    /// What a user takes who knows nothing: so many cells of degree 4, and everything else as it is by default.
    pub(crate) fn plain_default(&self, cells: usize) -> Option<Rung> {
        let mut settings = self.settings.clone();
        settings.cells = Some(cells);
        settings.degree = Some(4);
        let cut = self.model.partition(&settings.discretisation()).ok()?;
        let mut walk = settings.walk_options();
        walk.walks = WALKS;
        walk.tolerance = None;
        let answer = self.solved(&Solved::new(&*cut, walk.absorption).ok()?, &walk)?;
        Some(rung(&answer, &cut.cost(walk.pairs), cells, 4, &walk, false))
    }

    /// The rungs on these cells with this degree.
    fn climb(&self, cells: usize, degree: usize, rungs: &mut Vec<Rung>) {
        let mut settings = self.settings.clone();
        settings.cells = Some(cells);
        settings.degree = Some(degree);
        let Ok(cut) = self.model.partition(&settings.discretisation()) else {
            return;
        };
        let solved = Solved::new(&*cut, 0.5).ok();
        let mut found = false;
        for absorption in ABSORPTIONS {
            if found && absorption < 0.2 {
                return;
            }
            let mut walk = settings.walk_options();
            walk.absorption = absorption;
            walk.walks = WALKS;
            walk.tolerance = None;
            // Plain walks are the same on all cells.
            if degree == 0
                && let Some(answer) = self.plain(&*cut, &walk)
            {
                rungs.push(rung(
                    &answer,
                    &cut.cost(walk.pairs),
                    cells,
                    degree,
                    &walk,
                    true,
                ));
                found = true;
            }
            for pairs in [Pairs::Default, Pairs::Pointwise] {
                walk.pairs = pairs;
                if self.model.check(&settings.discretisation(), pairs).is_err() {
                    continue;
                }
                let answer = solved
                    .as_ref()
                    .and_then(|solved| self.solved(solved, &walk));
                if let Some(answer) = answer {
                    rungs.push(rung(&answer, &cut.cost(pairs), cells, degree, &walk, false));
                    found = true;
                }
            }
        }
    }
}

/// The rung of this answer.
fn rung(
    answer: &Answer,
    cost: &Cost,
    cells: usize,
    degree: usize,
    walk: &WalkOptions,
    plain: bool,
) -> Rung {
    let all = &answer.outcome.statistics;
    let of = |count: fn(&Statistics) -> u64| all.iter().map(count).sum::<u64>() as f64;
    let states = of(Statistics::states) / of(Statistics::walks);
    let found = |statistics: &Statistics| {
        let found = statistics.preconditioned();
        [found.std_dev.unwrap_or(f64::INFINITY), found.estimate]
    };
    let of_walk = if plain { cost.plain } else { cost.walk };
    Rung {
        plain,
        cells,
        degree,
        pairs: walk.pairs,
        absorption: walk.absorption,
        set_up: if plain { 0.0 } else { cost.setup },
        walk: of_walk.seconds(walk.estimator, states, answer.pointwise),
        targets: all.iter().map(found).collect(),
    }
}
