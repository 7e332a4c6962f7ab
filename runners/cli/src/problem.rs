//! What the commands need of a problem, whatever its kind.

use core::any::Any;
use core::fmt::Display;
use core::time::Duration;
use std::time::Instant;

use fredholm_core::galerkin::Solve;
use fredholm_core::{Estimate, Real, Statistics, rounding_floor};
use fredholm_embedded::TableBuilder;
use fredholm_rayon::Outcome;

use crate::circle::CircleFile;
use crate::cube::CubeFile;
use crate::diagnose::{Diagnosis, Request};
use crate::failure::Failure;
use crate::file::{self, ProblemFile};
use crate::progress::Progress;
use crate::rates::Deterministic;
use crate::room::RoomFile;
use crate::theory::PairCounts;
use crate::walks::Plan;

/// A problem of a file, ready to be set up.
pub(crate) trait Problem: Sync {
    /// The word of the file.
    fn kind(&self) -> &'static str;

    /// d, of cubes.
    fn dimension(&self) -> Option<usize> {
        None
    }

    /// Cells as the file counts them: of a cube, per axis.
    fn cells(&self) -> usize;

    /// The number of unknowns in all: of cells, where they are of degree 0.
    fn unknowns(&self) -> usize {
        self.cells()
    }

    /// "100", "10 per axis, 1000 in all".
    fn cells_text(&self) -> String {
        match self.dimension() {
            Some(d @ 2..) => {
                let all = self.cells().saturating_pow(d as u32);
                format!("{} per axis, {all} in all", self.cells())
            }
            _ => self.cells().to_string(),
        }
    }

    /// What is asked for, in the order of the file.
    fn asked(&self) -> &[Asked];

    /// The name of a surface.
    fn surface(&self, number: usize) -> Option<&str> {
        let _ = number;
        None
    }

    /// Bytes of the tables at their largest.
    fn memory(&self) -> usize;

    /// What the work will take.
    fn cost(&self) -> Cost;

    /// Pointwise pairs of a row; where that takes a set-up, estimated on few cells.
    fn pointwise_pairs(&self) -> Result<PointwisePairs, Failure> {
        Ok(PointwisePairs::default())
    }

    /// From how many places walks start: the targets, and what the problem needs besides.
    fn starts(&self) -> usize {
        self.asked().len()
    }

    /// Refuses walks whose error bars would mean nothing.
    fn refuse_infinite_variance(&self) -> Result<(), Failure>;

    /// The same where the system is solved.
    fn refuse_infinite_variance_of(&self, solved: &Solved) -> Result<(), Failure> {
        let _ = solved;
        self.refuse_infinite_variance()
    }

    /// The spectral radius of T_k²p, estimated: below 1 if walks have a finite variance.
    fn second_moment(&self) -> Result<f64, Failure>;

    /// q0.
    fn absorption(&self) -> f64;

    /// The same problem on so many cells (as the file counts them), asked for the mean of u.
    fn mean_on(&self, cells: usize) -> Result<Box<dyn Problem + '_>, Failure>;

    /// Cells for a sweep, from few to as many as take a second or so.
    fn levels(&self) -> Vec<usize>;

    /// Fewer cells than those, which are too few for a sweep and cheap to try.
    fn coarse(&self) -> Vec<usize> {
        Vec::new()
    }

    /// The exponent r of √Var ~ n^−r that theory has for polynomials of a degree.
    fn order(&self, degree: usize) -> f64 {
        self.smooth_order(degree)
    }

    /// The same where nothing but the degree limits it.
    fn smooth_order(&self, degree: usize) -> f64 {
        (degree + 1) as f64 / self.dimension().unwrap_or(1) as f64
    }

    /// Kernel evaluations of a set-up whose iteration took so many sweeps.
    fn evaluations(&self, sweeps: u32) -> f64;

    /// Whether kernel evaluations tell the work at a given degree; otherwise the clock does, as most of it is
    /// no evaluation of the kernel.
    fn counts_evaluations(&self) -> bool {
        false
    }

    /// Deterministic solutions to compare with, where there are some.
    fn nystrom(&self) -> Result<Vec<Deterministic>, Failure> {
        Ok(Vec::new())
    }

    /// Sets up in f64, and predicts the variance of every target.
    fn diagnose(&self, request: &Request<'_>) -> Result<Diagnosis, Failure>;

    /// Sets up, and gives what a device needs.
    fn tables(&self) -> Result<TableBuilder, Failure>;

    /// Walks that follow no neighbour equation, and need no set-up.
    fn plain(&self, plan: &Plan, progress: &Progress) -> Result<Answer, Failure>;

    /// Solves the Galerkin system of these cells and this degree.
    fn solve(&self) -> Result<Solved, Failure>;

    /// (1 − q0) ∫∫ (k − h)² p over those pairs in S which walks seldom meet, over ∫ F²: the same for every absorption.
    /// Over 1 − q0, and times q0 where walks score F/q, it is ∫∫ (k − h)² p/∫ f² q, which times (E η²)² is about the
    /// variance that few walks miss: the first term of (26) of Heinrich 1995 as if walks came everywhere as often. A
    /// solved system makes it cheaper; without one it takes a small part of the set-up.
    fn rare_variance(&self, solved: Option<&Solved>) -> Result<f64, Failure> {
        let _ = solved;
        Ok(0.0)
    }

    /// ∫ F² over ∫ 1, where there is a rare variance: over q0, where walks score F/q, E η² of walks from anywhere is at
    /// least that.
    fn mean_square_of_source(&self) -> f64 {
        0.0
    }

    /// Walks, where that is done: whatever the pairs, the absorption and the estimator are.
    fn walk(&self, solved: &Solved, plan: &Plan, progress: &Progress) -> Result<Answer, Failure>;

    /// Sets up, and walks.
    fn answer(&self, plan: &Plan, progress: &Progress) -> Result<Answer, Failure> {
        self.walk(&self.solve()?, plan, progress)
    }
}

/// A solved Galerkin system: its coefficients and its solution, as its kind of problem knows them.
#[derive(Debug)]
pub(crate) struct Solved {
    system: Box<dyn Any + Send + Sync>,
    /// How long it took.
    pub(crate) seconds: f64,
}

impl Solved {
    /// With what this gives, and its time.
    pub(crate) fn new<T: Any + Send + Sync>(
        solve: impl FnOnce() -> Result<T, Failure>,
    ) -> Result<Self, Failure> {
        let start = Instant::now();
        let system = Box::new(solve()?);
        let seconds = start.elapsed().as_secs_f64();
        Ok(Self { system, seconds })
    }

    /// The system, which is of the type that its own problem made.
    pub(crate) fn system<T: Any>(&self) -> Result<&T, Failure> {
        let system = self.system.downcast_ref();
        system.ok_or_else(|| Failure::run("a Galerkin system of another problem"))
    }
}

/// The problem that a file describes.
pub(crate) fn of_file(file: &ProblemFile) -> Result<Box<dyn Problem + '_>, Failure> {
    Ok(match &file.problem {
        file::Problem::Circle(circle) => Box::new(CircleFile::new(file, circle)?),
        file::Problem::Cube(cube) => Box::new(CubeFile::new(file, cube)?),
        file::Problem::Room(room) => Box::new(RoomFile::new(file, room)?),
    })
}

/// A target, or a point of a grid.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    /// What results call it.
    pub(crate) name: String,
    /// Where it is.
    pub(crate) place: Where,
}

/// Where a target is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Where {
    /// u at an angle.
    Angle(f64),
    /// The mean of u over an interval of angles.
    Arc(f64, f64),
    /// u at a point of the cube.
    Point(Vec<f64>),
    /// The mean of u.
    All,
    /// (u, w) with this formula for w.
    Weight(String),
    /// u on the surface of this number, at this part of its length.
    On(usize, f64),
    /// The mean of u over the surface of this number.
    Surface(usize),
}

/// Every target of a file, a grid as one for each of its points; refuses names that are there twice.
pub(crate) fn asked(
    file: &ProblemFile,
    mut ask: impl FnMut(&file::What) -> Vec<Where>,
) -> Result<Vec<Asked>, Failure> {
    let mut all = Vec::new();
    for target in &file.targets {
        let name = &target.name.value;
        let grid = matches!(target.what, file::What::Grid(..));
        let places = ask(&target.what).into_iter().enumerate();
        all.extend(places.map(|(i, place)| Asked {
            name: if grid {
                format!("{name}[{i}]")
            } else {
                name.clone()
            },
            place,
        }));
    }
    let mut names: Vec<&str> = all.iter().map(|asked| asked.name.as_str()).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Failure::input(format_args!(
            "two targets are named {:?}, one of them a point of a grid: rename one",
            pair[0]
        )));
    }
    Ok(all)
}

/// What work takes, on one thread, by constants that were measured once: what is chosen by it must not
/// depend on the machine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// Seconds of the set-up.
    pub(crate) setup: f64,
    /// The part of it that is left where the system is solved: G.
    pub(crate) source: f64,
    /// Of walks that both equations follow.
    pub(crate) walk: WalkCost,
    /// Of plain walks.
    pub(crate) plain: WalkCost,
}

/// What walks take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WalkCost {
    /// Seconds of the state where a walk starts.
    pub(crate) start: f64,
    /// Of every further one.
    pub(crate) step: f64,
    /// Seconds of a score besides: once a walk, or in every state.
    pub(crate) score: f64,
    /// Seconds of a pointwise pair in a score, and of one that is partly hidden.
    pub(crate) pair: f64,
    pub(crate) hidden_pair: f64,
}

impl WalkCost {
    /// Of a walk of so many states.
    pub(crate) fn seconds(
        &self,
        estimator: file::Estimator,
        states: f64,
        pairs: PointwisePairs,
    ) -> f64 {
        let scores = match estimator {
            file::Estimator::Absorption => 1.0,
            file::Estimator::Collision => states,
        };
        let score = self.score + pairs.seen * self.pair + pairs.hidden * self.hidden_pair;
        self.start + (states - 1.0) * self.step + scores * score
    }
}

/// Pointwise pairs of a row, in the mean over the space of states.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PointwisePairs {
    /// Those that nothing hides.
    pub(crate) seen: f64,
    /// Those that are partly hidden, in a room.
    pub(crate) hidden: f64,
}

impl PointwisePairs {
    /// On so many times as many cells. What is partly hidden lies along the edges of shadows, of which a row has as
    /// many on finer cells; as it has pairs next to a corner, which the default has pointwise.
    pub(crate) fn on(self, choice: file::Pairs, times: f64) -> Self {
        match choice {
            file::Pairs::Pointwise => Self {
                seen: times * self.seen,
                ..self
            },
            _ => self,
        }
    }
}

/// An answer's deterministic part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// (u, Φ), where it is known.
    pub(crate) exact: Option<f64>,
    /// (v, Φ), or what is known of it.
    pub(crate) galerkin: f64,
}

/// What came of a problem.
#[derive(Debug)]
pub(crate) struct Answer {
    /// The deterministic part, in the order of what was asked.
    pub(crate) known: Vec<Known>,
    /// What the walks gave.
    pub(crate) outcome: Outcome,
    /// What rounding leaves of every target.
    pub(crate) floors: Vec<f64>,
    /// How the iteration for v went.
    pub(crate) solve: Solve<f64>,
    /// How long the set-up took.
    pub(crate) setup_seconds: f64,
    /// How long the walks took.
    pub(crate) walk_seconds: f64,
    pub(crate) pointwise: PointwisePairs,
    /// The spectral radius of T_h²p, or a bound of it, where it was looked at.
    pub(crate) second_moment: Option<f64>,
    /// Of the walks that rooms make besides, for irradiances and net fluxes.
    pub(crate) others: Vec<Statistics>,
    /// How many pairs are what, where they were chosen one by one.
    pub(crate) pair_counts: Option<PairCounts>,
    /// What rooms say besides, in the order of what was asked; empty for others.
    pub(crate) besides: Vec<Besides>,
    /// The net flux out of every surface, where there are temperatures; `None` where its material changes.
    pub(crate) fluxes: Vec<(String, Option<Estimate>)>,
}

/// No iteration.
pub(crate) const NO_SOLVE: Solve<f64> = Solve {
    sweeps: 0,
    residual: 0.0,
};

impl Answer {
    /// Of walks that were not set up.
    pub(crate) fn plain<F: Real>(known: Vec<Known>, outcome: Outcome, walking: Duration) -> Self {
        Self {
            known,
            floors: floors::<F>(&[], 0.0, &outcome),
            outcome,
            solve: NO_SOLVE,
            setup_seconds: 0.0,
            walk_seconds: walking.as_secs_f64(),
            pointwise: PointwisePairs::default(),
            second_moment: None,
            pair_counts: None,
            others: Vec::new(),
            besides: Vec::new(),
            fluxes: Vec::new(),
        }
    }
}

/// What a room says of a target besides u.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Besides {
    /// The irradiance H.
    pub(crate) irradiance: Option<Estimate>,
    /// The net flux out of the wall, with temperatures.
    pub(crate) net_flux: Option<Estimate>,
}

/// What rounding leaves of every target in walks of scalar `F`.
pub(crate) fn floors<F: Real>(v: &[F], contraction: f64, outcome: &Outcome) -> Vec<f64> {
    let largest = v.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()));
    let of = |u| rounding_floor::<F>(largest, u, contraction);
    let statistics = outcome.statistics.iter();
    statistics
        .map(|s| of(s.preconditioned().estimate))
        .collect()
}

/// The refusal of walks of infinite variance: the radius is proportional to 1/(1 − q0).
pub(crate) fn infinite_variance(file: &ProblemFile, what: impl Display, radius: f64) -> Failure {
    let absorption = file.walk.absorption.value;
    let most = 1.0 - radius * (1.0 - absorption);
    let way_out = if most > 0.0 {
        format!("use an `absorption` below {most:.2e}")
    } else {
        "no `absorption` helps: it takes a chain of one's own, whose density resembles |K| (see the \
         library)"
            .to_owned()
    };
    let message = format!(
        "the variance of a walk is infinite with `absorption` = {absorption}: {what} has an estimated \
         spectral radius of {}, and it must be below 1; {way_out} (or --allow-infinite-variance: error \
         bars then mean nothing)",
        crate::numbers::short(radius)
    );
    file.refuse(&file.walk.absorption, message).into()
}
