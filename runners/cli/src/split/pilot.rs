//! Settings, what few walks find of them, and what many will take.

use fredholm_core::{MIN_SCORED_WALKS, Statistics, Tolerance, next_stage};

use crate::file::{self, Estimator, Pairs, Placed, ProblemFile, What};
use crate::problem::{Answer, Cost, PointwisePairs, Problem, WalkCost};

/// Targets that a pilot looks at.
const TARGETS: usize = 8;
/// How many times as often as everywhere walks come where few walks miss something, squared: by `diagnose` 3.6 to 7.1 times in a
/// square room and 4.3 to 6.4 times in one with a doorway, with 50 to 200 cells of degree 2 to 4.
const RARE: f64 = 4.0;
/// Batches of which rounds need not be counted.
const MANY: f64 = 1e6;

/// Everything that may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Setting {
    /// Walks without a neighbour equation.
    pub(super) plain: bool,
    /// As the file counts them: of a cube, per axis.
    pub(super) cells: usize,
    pub(super) degree: usize,
    pub(super) pairs: Pairs,
    pub(super) absorption: f64,
    pub(super) estimator: Estimator,
}

impl Setting {
    /// The file with it.
    pub(super) fn applied(&self, file: &ProblemFile) -> ProblemFile {
        let mut file = file.clone();
        let (galerkin, walk) = (&mut file.galerkin, &mut file.walk);
        galerkin.cells = Some(Placed::chosen(self.cells));
        galerkin.degree = Placed::chosen(self.degree);
        galerkin.pairs = Placed::chosen(self.pairs);
        walk.absorption = Placed::chosen(self.absorption);
        walk.estimator = Placed::chosen(self.estimator);
        file
    }

    /// Whether one solved system serves both.
    pub(super) fn shares_system(&self, other: &Self) -> bool {
        let of = |setting: &Self| (setting.plain, setting.cells, setting.degree);
        of(self) == of(other)
    }

    /// Seconds of its set-up, and of what is left of it where the system is solved.
    pub(super) const fn setup(&self, cost: &Cost) -> [f64; 2] {
        if self.plain {
            [0.0; 2]
        } else {
            [cost.setup, cost.source]
        }
    }

    /// What its walks take.
    pub(super) const fn walk(&self, cost: &Cost) -> WalkCost {
        if self.plain { cost.plain } else { cost.walk }
    }

    /// The word of the report.
    pub(super) fn method(&self) -> &'static str {
        if self.plain {
            "plain"
        } else {
            "preconditioned"
        }
    }
}

/// A file with few of its targets, and how many each of these stands for.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    pub(super) file: ProblemFile,
    weights: Vec<f64>,
}

impl Sample {
    /// At most [`TARGETS`] targets and points of grids, evenly chosen.
    pub(super) fn new(file: &ProblemFile) -> Self {
        let mut sample = file.clone();
        if let file::Problem::Cube(cube) = &mut sample.problem {
            // Its means are integrals that no pilot needs.
            cube.solution = None;
        }
        let count = file.targets.len();
        let kept = count.min(TARGETS);
        sample.targets = (0..kept)
            .filter_map(|i| file.targets.get(i * count / kept).cloned())
            .collect();
        let share = count as f64 / kept as f64;
        let mut weights = Vec::new();
        for target in &mut sample.targets {
            let What::Grid(points, _) = &mut target.what else {
                weights.push(share);
                continue;
            };
            let few = points.value.min((TARGETS / kept).max(1));
            weights.extend(vec![share * points.value as f64 / few as f64; few]);
            points.value = few;
        }
        Self {
            file: sample,
            weights,
        }
    }

    /// The number of the file's targets.
    pub(super) fn weight(&self) -> f64 {
        self.weights.iter().sum()
    }

    /// The number of its targets.
    pub(super) fn targets(&self) -> usize {
        self.weights.len()
    }
}

/// A target of a pilot.
#[derive(Clone, Copy, Debug)]
struct Asked {
    /// How many it stands for.
    weight: f64,
    /// Var/E²: the walks that it takes, by what was seen.
    needed: f64,
    /// The same of what few walks miss, over the rare variance of cells.
    rare: f64,
    /// Walks that scored: no other tells of the variance.
    scored: f64,
    /// Walks until so many have scored that an error is believed.
    believed: f64,
}

impl Asked {
    /// Walks that it takes on cells with so many times the variance that was seen, and with this rare variance; not known
    /// before one has scored.
    fn walks(&self, seen: f64, rare: f64) -> f64 {
        if self.scored > 0.0 {
            (seen * self.needed)
                .max(rare * self.rare)
                .max(self.believed)
        } else {
            f64::INFINITY
        }
    }

    /// How many times the true variance may be off.
    fn times(&self, doubt: f64) -> f64 {
        1.0 + doubt / self.scored.sqrt()
    }
}

/// E η² of every target and of what a room needs besides, as few walks see it: rare steps hardly ever meet weights that
/// are rare themselves.
pub(super) fn squares(answer: &Answer) -> Vec<f64> {
    let all = answer.outcome.statistics.iter().chain(&answer.others);
    let square = |statistics: &Statistics| {
        let plain = statistics.plain();
        plain.estimate.powi(2) + plain.std_dev.unwrap_or(0.0).powi(2)
    };
    all.map(square).collect()
}

/// How far the variance of N walks that scored may be from the true one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    /// c where that may be 1 + c/√N times as much, for which a choice is prepared: all large scores may be missing.
    pub(super) more: f64,
    /// c where it may be 1 + c/√N times as little: there may be too many of them.
    pub(super) less: f64,
    /// The part of the rare variance that walks meet.
    pub(super) met: f64,
}

/// What few walks found.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    pub(super) setting: Setting,
    targets: Vec<Asked>,
    pub(super) walks: u64,
    /// Of a walk, in the mean.
    states: f64,
    pub(super) pointwise: PointwisePairs,
    pub(super) unknowns: f64,
    doubt: Doubt,
}

impl Pilot {
    pub(super) fn new(
        setting: Setting,
        sample: &Sample,
        error: Tolerance,
        problem: &dyn Problem,
        answer: &Answer,
        squares: &[f64],
        doubt: Doubt,
    ) -> Self {
        // What a room needs besides stands in no target, and is all there.
        let all = || answer.outcome.statistics.iter().chain(&answer.others);
        let weights = sample.weights.iter().copied();
        let weights = weights.chain(core::iter::repeat(1.0));
        let targets = all().zip(weights).zip(squares);
        let Setting { absorption, .. } = setting;
        // A score is F/q where a walk is absorbed, and F in every state otherwise.
        let score = match setting.estimator {
            Estimator::Absorption => absorption,
            Estimator::Collision => 1.0,
        };
        let rare = RARE * doubt.met * score / (1.0 - absorption);
        // Of walks from anywhere E η² may be larger than of those from a target that little light reaches.
        let from_anywhere = problem.mean_square_of_source() / score;
        let of = |((statistics, weight), square): ((&Statistics, f64), &f64)| {
            // Of plain walks both estimates are the same.
            let estimate = statistics.preconditioned();
            let bound = match error {
                Tolerance::Absolute(bound) => bound,
                Tolerance::Relative(bound) => bound * estimate.estimate.abs(),
            };
            let scored = statistics.scored() as f64;
            let each = statistics.walks() as f64 / scored;
            Asked {
                weight,
                needed: (estimate.std_dev.unwrap_or(0.0) / bound).powi(2),
                rare: rare * square * square.max(from_anywhere) / bound.powi(2),
                scored,
                believed: MIN_SCORED_WALKS as f64 * each,
            }
        };
        let walks: u64 = all().map(Statistics::walks).sum();
        let states: u64 = all().map(Statistics::states).sum();
        Self {
            setting,
            targets: targets.map(of).collect(),
            walks,
            states: states as f64 / walks as f64,
            pointwise: answer.pointwise,
            unknowns: problem.unknowns() as f64,
            doubt,
        }
    }

    /// As if the walks of another setting had its variance.
    pub(super) fn shortened(&self, setting: Setting, doubt: Doubt) -> Self {
        Self {
            states: self.states * self.setting.absorption / setting.absorption,
            setting,
            doubt,
            ..self.clone()
        }
    }

    /// The fewest walks of a target that scored.
    pub(super) fn scored(&self) -> f64 {
        let scored = self.targets.iter().map(|asked| asked.scored);
        scored.fold(f64::INFINITY, f64::min)
    }

    /// Walks that all targets take.
    pub(super) fn needed(&self) -> f64 {
        let targets = self.targets.iter();
        targets.map(|asked| asked.weight * asked.needed).sum()
    }

    /// Seconds of its walks.
    pub(super) fn seconds(&self, cost: &Cost) -> f64 {
        self.walks as f64 * self.walk(cost, self.pointwise)
    }

    /// What its setting takes on these cells.
    pub(super) fn predict(&self, level: &Level, scales: &Scales, batch: u64) -> Prediction {
        let batch = batch as f64;
        let walks = |seen: &dyn Fn(&Asked) -> f64, rare: f64| -> f64 {
            let whole = |walks: f64| batch * batches(walks / batch);
            let of = |asked: &Asked| asked.weight * whole(asked.walks(seen(asked), rare));
            self.targets.iter().map(of).sum()
        };
        let each = self.walk(&level.cost, self.pairs(level.unknowns));
        let [setup, source] = self.setting.setup(&level.cost);
        let of = self.walks / self.targets.len().max(1) as u64;
        let fast = |asked: &Asked| scales.fast / asked.times(self.doubt.less);
        let slow = |asked: &Asked| scales.slow * asked.times(self.doubt.more);
        let most = self
            .targets
            .iter()
            .map(|asked| asked.walks(slow(asked), scales.rare));
        let most = most.fold(0.0, f64::max);
        let prepared = |rare: f64| {
            let walks = walks(&|_| scales.observed, rare) + walks(&slow, rare);
            0.5 * walks * each
        };
        let hoped = walks(&fast, scales.rare_luckily) * each;
        let walks = walks(&|_| scales.observed, scales.rare);
        Prediction {
            setting: Setting {
                cells: level.cells,
                ..self.setting
            },
            setup,
            source,
            each,
            walking: walks * each,
            prepared: prepared(scales.rare),
            luckily: prepared(scales.rare_luckily),
            hoped,
            of: if level.cells == self.setting.cells {
                of
            } else {
                0
            },
            scored: self.scored(),
            most,
            walks,
            states: walks * self.states,
        }
    }

    /// Pointwise pairs of a row where there are so many unknowns.
    pub(super) fn pairs(&self, unknowns: f64) -> PointwisePairs {
        let times = unknowns / self.unknowns;
        self.pointwise.on(self.setting.pairs, times)
    }

    /// Seconds of a walk.
    fn walk(&self, cost: &Cost, pairs: PointwisePairs) -> f64 {
        let walk = self.setting.walk(cost);
        walk.seconds(self.setting.estimator, self.states, pairs)
    }
}

/// How many times the variance that a pilot saw other cells have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scales {
    /// If cells help most.
    pub(super) fast: f64,
    /// As they are seen to help.
    pub(super) observed: f64,
    /// If they help less.
    pub(super) slow: f64,
    /// Their own rare variance, and the least that it may be.
    pub(super) rare: f64,
    pub(super) rare_luckily: f64,
}

impl Scales {
    /// Of plain walks, whatever the cells are.
    pub(super) const PLAIN: Self = Self {
        fast: 1.0,
        observed: 1.0,
        slow: 1.0,
        rare: 0.0,
        rare_luckily: 0.0,
    };
}

/// Cells, with what they cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    /// As the file counts them.
    pub(super) cells: usize,
    pub(super) unknowns: f64,
    pub(super) cost: Cost,
}

/// What a setting will take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    pub(super) setting: Setting,
    /// Seconds on one thread: of the set-up, of what is left of it where the system is solved, of a walk, and of all.
    pub(super) setup: f64,
    pub(super) source: f64,
    pub(super) each: f64,
    pub(super) walking: f64,
    /// The mean of that and of what it is if there are rare large scores, and cells help less than hoped.
    pub(super) prepared: f64,
    /// The same if the rare variance that is not known is the least that it may be.
    pub(super) luckily: f64,
    /// The same if there were rare large scores in the pilot, and cells help as they do by theory.
    pub(super) hoped: f64,
    /// Walks of a target that a pilot of this very setting had; 0 if there was none.
    pub(super) of: u64,
    /// The fewest of a target that scored, in whatever pilot.
    pub(super) scored: f64,
    /// Walks of the target that takes most if there are rare large scores, in no whole rounds.
    pub(super) most: f64,
    pub(super) walks: f64,
    pub(super) states: f64,
}

impl Prediction {
    /// Of all.
    pub(super) fn seconds(&self) -> f64 {
        self.setup + self.walking
    }
}

/// Batches of the rounds that so many batches take: errors are looked at after whole rounds.
fn batches(needed: f64) -> f64 {
    if needed > MANY {
        return needed;
    }
    let mut done = 0;
    loop {
        done += next_stage(done, u64::MAX);
        if done as f64 >= needed {
            return done as f64;
        }
    }
}
