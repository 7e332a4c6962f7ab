//! Resolvent walks of equations that are given by kernel and source: the choice of cells, and rounds until an error is reached.
//!
//! [`fredholm_core::resolvent`] has the mathematics. The standard deviation of a point is known before the first one, so that cells and
//! degree are chosen without pilots.

mod choose;
mod cut;
mod inverse;
mod regular;
mod walks;

use std::time::Instant;

use fredholm_core::{StopReason, Tolerance};

pub use crate::question::{ResolventAnswer, ResolventEstimate, ResolventQuestion};
use crate::{Error, MOST_SECONDS, Settings};

pub use cut::{CutFigures, ResolventCut, ResolventWalks, cut_of};
pub use fredholm_core::resolvent::{Grid, edges};
pub use regular::{ByDensity, Functional, RegularKind};

/// The largest spectral radius of (1 + |R_n|)|K − K_n| that is walked with: error bars keep their coverage there.
pub const MOST_RADIUS: f64 = 0.3;
/// The most unknowns, of which a table of all pairs is inverted.
pub const MOST_UNKNOWNS: usize = 2000;
/// The fewest degrees of freedom of an error bar that ends the walks.
const LEAST_FREEDOM: f64 = 2.0;
/// The normal distribution's quantile of 95 % on both sides.
const NORMAL: f64 = 1.959_964;
/// Points of the first round, about, if no error is asked for that takes more.
const FIRST: f64 = 4096.0;
/// The part of the points that the tables predict that the first round has: nets gain on it.
const FIRST_SHARE: f64 = 1.0 / 64.0;
/// Seconds of the first round at most.
const FIRST_SECONDS: f64 = 1.0;
/// Seconds of a round at most.
const MOST_ROUND_SECONDS: f64 = 8.0;
/// Every round has so many times the points of the one before.
const GROWTH: f64 = 4.0;

/// How large a cut equation may be, and what its functions take.
#[derive(Clone, Debug)]
pub struct ResolventSizes {
    /// Cells as they are asked for, from few to many, with their number n.
    pub levels: Vec<[usize; 2]>,
    /// d.
    pub dimension: usize,
    /// Seconds of a value of K, and of F.
    pub seconds: [f64; 2],
}

/// Student's quantile of 95 % with so many degrees of freedom, over that of the normal distribution: an error bar of few counts for as
/// much as its interval is wider. The expansion of Cornish and Fisher, 3 % too small at 2.
fn widening(freedom: f64) -> f64 {
    let z = NORMAL;
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    1.0 + (first + (second + third / freedom) / freedom) / freedom / z
}

/// Whether an error is asked for that rounding alone is above: no points reach it.
fn is_below_rounding(
    estimates: &[ResolventEstimate],
    tolerance: &Option<Tolerance>,
    rounding: f64,
) -> bool {
    let floor = |own: &ResolventEstimate| rounding * own.value.abs();
    match *tolerance {
        Some(Tolerance::Absolute(error)) => estimates.iter().any(|own| floor(own) > error),
        Some(Tolerance::Relative(share)) => rounding > share,
        None => false,
    }
}

/// Makes a solved equation with so many cells, and polynomials of this degree.
pub type MakeCut<'a> = dyn Fn(usize, usize) -> Result<Box<dyn ResolventCut + 'a>, Error> + 'a;

/// Answers all goals.
///
/// # Errors
/// [`Error::Regular`]: no cells that serve are found. [`Error::Cancelled`]: before there was a result. Those of the equation.
pub fn answer(
    question: &ResolventQuestion<'_>,
    sizes: &ResolventSizes,
    make: &MakeCut<'_>,
) -> Result<ResolventAnswer, Error> {
    let start = Instant::now();
    let settings = question.settings;
    let chosen = choose::choose(question, sizes, make)?;
    let mut walks = chosen.cut.walks(question.goals)?;
    let setup_seconds = start.elapsed().as_secs_f64();
    let walking = Instant::now();
    let most = settings.walks.unwrap_or(match settings.tolerance {
        Some(_) => u64::MAX,
        None => Settings::WALKS,
    });
    let most = most as f64 * question.goals.len() as f64;
    let needed = |estimates: &[ResolventEstimate]| {
        let tolerance = settings.tolerance?;
        let off = estimates.iter().map(|own| {
            let error = match tolerance {
                Tolerance::Absolute(error) => error,
                Tolerance::Relative(share) => share * own.value.abs(),
            };
            own.std_error * widening(own.freedom) / error
        });
        Some(off.fold(0.0, f64::max))
    };
    let mut next = match settings.tolerance {
        Some(_) => {
            let most = FIRST_SECONDS / chosen.seconds;
            (FIRST_SHARE * chosen.points).clamp(FIRST, most.max(FIRST))
        }
        None => FIRST,
    };
    if question.is_prediction {
        let figures = chosen.cut.figures();
        let points = if settings.tolerance.is_some() {
            chosen.points
        } else {
            most
        };
        let known = walks.known().into_iter().map(|known| ResolventEstimate {
            value: known,
            known,
            std_error: f64::INFINITY,
            freedom: 0.0,
            points: 0,
        });
        return Ok(ResolventAnswer {
            estimates: known.collect(),
            cells: chosen.cells,
            degree: chosen.degree,
            unknowns: figures.unknowns,
            radius: figures.radius,
            condition: figures.condition,
            rounding: figures.rounding,
            points: points as u64,
            steps: 0,
            rounds: 0,
            stop: StopReason::Done,
            setup_seconds,
            walk_seconds: points * chosen.seconds,
        });
    }
    let has_end = settings.walks.is_some() || settings.time_limit.is_some();
    let (mut points, mut rounds) = (0.0, 0);
    let (cells, degree) = (chosen.cells, chosen.degree);
    let mut stop = StopReason::Done;
    while points < most {
        let own = next.min(most - points);
        match walks.round(rounds, own, settings.seed, question.watch) {
            Ok(()) => {}
            Err(Error::Cancelled) if rounds > 0 => {
                stop = StopReason::Cancelled;
                break;
            }
            Err(error) => return Err(error),
        }
        points += own;
        rounds += 1;
        let estimates = walks.estimates();
        if !estimates.iter().all(|own| own.value.is_finite()) {
            return Err(Error::NotFinite {
                what: "the kernel or the source".to_owned(),
            });
        }
        let is_known = estimates.iter().all(|own| own.freedom >= LEAST_FREEDOM);
        let off = needed(&estimates).unwrap_or(f64::INFINITY);
        if is_below_rounding(
            &estimates,
            &settings.tolerance,
            chosen.cut.figures().rounding,
        ) {
            stop = StopReason::ToleranceNotReached;
            break;
        }
        if off <= 1.0 && is_known {
            break;
        }
        // Errors of nets fall about like the number of points.
        let left = points * off * chosen.seconds;
        if settings.tolerance.is_some() && !has_end && left > MOST_SECONDS {
            stop = StopReason::ToleranceNotReached;
            break;
        }
        let passed = walking.elapsed();
        if let Some(limit) = settings.time_limit
            && passed.as_secs_f64() * (1.0 + GROWTH) > limit.as_secs_f64()
        {
            stop = StopReason::TimeLimit;
            break;
        }
        if settings.tolerance.is_some() && points >= most {
            stop = StopReason::ToleranceNotReached;
        }
        // Whoever interrupts waits for a part of a round.
        next = (next * GROWTH).min((MOST_ROUND_SECONDS / chosen.seconds).max(next));
    }
    let [points, steps] = walks.counts();
    let figures = chosen.cut.figures();
    Ok(ResolventAnswer {
        estimates: walks.estimates(),
        cells,
        degree,
        unknowns: figures.unknowns,
        radius: figures.radius,
        condition: figures.condition,
        rounding: figures.rounding,
        points,
        steps,
        rounds,
        stop,
        setup_seconds,
        walk_seconds: walking.elapsed().as_secs_f64(),
    })
}
