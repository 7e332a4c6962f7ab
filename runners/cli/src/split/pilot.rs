//! Settings, what few walks find of them, and what many will take.

use fredholm_core::{Statistics, next_round};
use fredholm_rayon::TargetError;

use crate::file::{self, Estimator, Pairs, Placed, ProblemFile, What};
use crate::problem::{Answer, Cost, WalkCost};

/// Targets that a pilot looks at.
const TARGETS: usize = 8;
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
    /// Var/E²: the walks that it takes.
    needed: f64,
}

/// How far the variance of N walks may be from the true one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    /// c where that may be 1 + c/√N times as much, for which a choice is prepared: all large scores may be missing.
    pub(super) more: f64,
    /// c where it may be 1 + c/√N times as little: there may be too many of them.
    pub(super) less: f64,
}

/// What few walks found.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    pub(super) setting: Setting,
    targets: Vec<Asked>,
    pub(super) walks: u64,
    /// Of a walk, in the mean.
    states: f64,
    /// Pointwise pairs of a row, in the mean.
    pub(super) pointwise: f64,
    pub(super) unknowns: f64,
    doubt: Doubt,
}

impl Pilot {
    pub(super) fn new(
        setting: Setting,
        sample: &Sample,
        error: TargetError,
        unknowns: usize,
        answer: &Answer,
        doubt: Doubt,
    ) -> Self {
        // What a room needs besides stands in no target, and is all there.
        let all = || answer.outcome.statistics.iter().chain(&answer.others);
        let weights = sample.weights.iter().copied();
        let targets = all().zip(weights.chain(core::iter::repeat(1.0)));
        let of = |(statistics, weight): (&Statistics, f64)| {
            // Of plain walks both estimates are the same.
            let estimate = statistics.preconditioned();
            let bound = match error {
                TargetError::Absolute(bound) => bound,
                TargetError::Relative(bound) => bound * estimate.estimate.abs(),
            };
            Asked {
                weight,
                needed: (estimate.std_dev.unwrap_or(0.0) / bound).powi(2),
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
            unknowns: unknowns as f64,
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

    /// Walks that all targets take.
    pub(super) fn needed(&self) -> f64 {
        let targets = self.targets.iter();
        targets.map(|asked| asked.weight * asked.needed).sum()
    }

    /// Seconds of its walks.
    pub(super) fn seconds(&self, cost: &Cost) -> f64 {
        self.walks as f64 * self.walk(cost, self.pointwise)
    }

    /// What its setting takes on these cells, on which the variance is so many times that of the pilot if cells help
    /// most, as they are seen to, or less.
    pub(super) fn predict(
        &self,
        level: &Level,
        [fast, scale, slow]: [f64; 3],
        batch: u64,
    ) -> Prediction {
        let batch = batch as f64;
        let walks = |scale: f64| -> f64 {
            let of = |asked: &Asked| asked.weight * batch * batches(scale * asked.needed / batch);
            self.targets.iter().map(of).sum()
        };
        let each = self.walk(&level.cost, self.pairs(level.unknowns));
        let [setup, source] = self.setting.setup(&level.cost);
        let of = self.walks / self.targets.len().max(1) as u64;
        let times = |doubt: f64| 1.0 + doubt / (of as f64).sqrt();
        let least = fast / times(self.doubt.less);
        let most = slow * times(self.doubt.more);
        let [luckily, walks, rarely] = [least, scale, most].map(walks);
        Prediction {
            setting: Setting {
                cells: level.cells,
                ..self.setting
            },
            setup,
            source,
            each,
            walking: walks * each,
            prepared: 0.5 * (walks + rarely) * each,
            hoped: luckily * each,
            of: if level.cells == self.setting.cells {
                of
            } else {
                0
            },
            walks,
            states: walks * self.states,
        }
    }

    /// Pointwise pairs of a row where there are so many unknowns.
    pub(super) fn pairs(&self, unknowns: f64) -> f64 {
        // By default a row has as many on finer cells: those next to a corner or an edge.
        match self.setting.pairs {
            Pairs::Pointwise => self.pointwise * unknowns / self.unknowns,
            _ => self.pointwise,
        }
    }

    /// Seconds of a walk.
    fn walk(&self, cost: &Cost, pairs: f64) -> f64 {
        let walk = self.setting.walk(cost);
        walk.seconds(self.setting.estimator, self.states, pairs)
    }
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
    /// The same if there were rare large scores in the pilot, and cells help as they do by theory.
    pub(super) hoped: f64,
    /// Walks of a target that a pilot of this very setting had; 0 if there was none.
    pub(super) of: u64,
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
        done += next_round(done, u64::MAX);
        if done as f64 >= needed {
            return done as f64;
        }
    }
}
