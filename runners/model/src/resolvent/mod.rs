//! Resolvent walks of equations that are given by kernel and source: the choice of cells, and rounds until an error is reached.
//!
//! [`fredholm_core::resolvent`] has the mathematics. The standard deviation of a point is known before the first one, so that cells and
//! degree are chosen without pilots.

mod blocks;
mod choose;
mod cut;
mod images;
mod inverse;
mod regular;
mod replicates;
mod walks;

use web_time::Instant;

use fredholm_core::{StopReason, Tolerance};

use crate::numbers::{short, widening};
pub use crate::question::{
    FoundField, ResolventAnswer, ResolventEstimate, ResolventFigures, ResolventFound,
    ResolventQuestion, RunReplicates,
};
use crate::{Error, GlobalQuantity, IMAGE_HEAD, MOST_SECONDS, Region, Settings};
use choose::Chosen;

pub use cut::{ByImages, ResolventCut, ResolventWalks, cut_of};
pub use fredholm_core::resolvent::{Grid, edges};
pub use regular::{AnyPoint, AnyRegular, PointWeight};

/// The largest spectral radius of (1 + |R_n|)|K − K_n| that is walked with: error bars keep their coverage there.
pub const MOST_RADIUS: f64 = 0.3;
/// The most unknowns, of which a table has all pairs: those of degree 2 in 8³ cells.
pub const MOST_UNKNOWNS: usize = 5120;
/// The fewest degrees of freedom of an error bar that ends the walks.
const LEAST_FREEDOM: f64 = 2.0;
/// Points of the first round, about, if no error is asked for that takes more.
const FIRST: f64 = 4096.0;
/// The part of the points that are predicted that the first round has.
const FIRST_SHARE: f64 = 1.0 / 16.0;
/// Seconds of the first round at most.
const FIRST_SECONDS: f64 = 1.0;
/// Seconds of a round at most.
const MOST_ROUND_SECONDS: f64 = 8.0;
/// Every round has at most so many times the points of the one before, and at least so many times those of all before: longer nets gain more.
const GROWTH: f64 = 4.0;
const LEAST_GROWTH: f64 = 1.0;
/// Times the predicted points, or those of some seconds of one thread if these are more, after which walks end that nothing else ends.
const MOST_OVER: f64 = 4.0;
const LEAST_PREDICTED: f64 = 10.0;

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

/// The numbers of cells of an axis to choose from.
const LEVELS: [usize; 20] = [
    1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024,
];

impl ResolventSizes {
    /// The sizes of [grids](Grid) between the inner edges of every axis in so many images of a cube: so many cells of an axis, if that is
    /// given, or else as many as the edges ask for, and more. `seconds`: of a value of K, and of F.
    #[must_use]
    pub fn of_grid(
        edges: &[Vec<f64>],
        images: usize,
        cells: Option<usize>,
        seconds: [f64; 2],
    ) -> Self {
        let least = edges.iter().map(|inner| inner.len() + 1).max().unwrap_or(1);
        let more = LEVELS.into_iter().filter(|&cells| cells > least);
        let all = || core::iter::once(least).chain(more).collect();
        let axes = cells.map_or_else(all, |cells| vec![cells]);
        let dimension = edges.len();
        let level = |cells: usize| {
            let of_image = cells.saturating_pow(dimension as u32);
            [cells, images.saturating_mul(of_image)]
        };
        Self {
            levels: axes.into_iter().map(level).collect(),
            dimension,
            seconds,
        }
    }
}

/// Whether an error is asked for that rounding alone is above: no points reach it.
fn is_below_rounding(estimates: &[ResolventEstimate], tolerance: Option<Tolerance>) -> bool {
    tolerance.is_some_and(|tolerance| {
        let mut all = estimates.iter();
        all.any(|own| own.floor > tolerance.error_at(own.value))
    })
}

/// Cells as they are asked for, and the degree of polynomials on them.
pub type CellsAndDegree = [usize; 2];

/// Makes a solved equation with these cells, by whose resolvent walks go on or by that of fewer ones.
pub type MakeCut<'f, 'a> = dyn Fn(CellsAndDegree, Option<CellsAndDegree>) -> Result<Box<dyn ResolventCut + 'a>, Error>
    + 'f;

/// The points that are walked at most: `walks` for every goal, or for all of them if values are images.
fn most_points(question: &ResolventQuestion<'_>, are_images: bool) -> f64 {
    let settings = question.settings;
    // Where none are wanted cells are those of some.
    let asked = settings.walks.filter(|walks| *walks > 0);
    let each = asked.unwrap_or(match settings.tolerance {
        Some(_) => u64::MAX,
        None => Settings::WALKS,
    });
    let starts = if are_images { 1 } else { question.goals.len() };
    each as f64 * starts as f64
}

/// Answers all goals: by rows, or by images of one function, unless these turn out to lose too much.
///
/// # Errors
/// [`Error::Regular`]: no cells that serve are found. [`Error::Cancelled`]: before there was a result. Those of the equation.
pub fn answer<'a>(
    question: &ResolventQuestion<'_>,
    sizes: &ResolventSizes,
    make: &MakeCut<'_, 'a>,
) -> Result<ResolventFound<'a>, Error> {
    let start = Instant::now();
    let chosen = choose::choose(question, sizes, make)?;
    if let Some(found) = walk(question, sizes.dimension, chosen, start)? {
        return Ok(found);
    }
    let settings = Settings {
        global: Some(false),
        ..question.settings.clone()
    };
    let by_rows = ResolventQuestion {
        settings: &settings,
        ..*question
    };
    let mut found = answer(&by_rows, sizes, make)?;
    found.answer.setup_seconds = start.elapsed().as_secs_f64() - found.answer.walk_seconds;
    Ok(found)
}

/// Walks on chosen cells. `None`: images lose too much.
fn walk<'a>(
    question: &ResolventQuestion<'_>,
    dimension: usize,
    chosen: Chosen<'a>,
    start: Instant,
) -> Result<Option<ResolventFound<'a>>, Error> {
    let settings = question.settings;
    let mut walks = chosen.cut.walks(question.goals, chosen.by)?;
    let setup_seconds = start.elapsed().as_secs_f64();
    let walking = Instant::now();
    let most = match settings.walks {
        Some(0) => 0.0,
        _ => most_points(question, chosen.by.is_some()),
    };
    let figures = chosen.cut.figures();
    let answer =
        |estimates, [points, steps]: [u64; 2], (rounds, stop), walk_seconds| ResolventAnswer {
            reason: None,
            estimates,
            cells: chosen.cells,
            degree: chosen.degree,
            figures,
            points,
            steps,
            rounds,
            stop,
            setup_seconds,
            walk_seconds,
        };
    // What a point takes is not known of functions of somebody else's: with a time limit the clock is looked at from early on.
    let first = match settings.tolerance {
        Some(_) if settings.time_limit.is_none() => {
            let most = FIRST_SECONDS / chosen.seconds;
            (FIRST_SHARE * chosen.points).clamp(FIRST, most.max(FIRST))
        }
        _ => FIRST,
    };
    if question.is_prediction {
        let known = walks.known().into_iter();
        let known = known.map(|[known, size]| ResolventEstimate {
            value: known,
            known,
            floor: figures.floor(size),
            std_error: f64::INFINITY,
            freedom: 0.0,
            points: 0,
        });
        // The first round has some in any case.
        let points = match settings.tolerance {
            Some(_) => chosen.points.max(first).min(most),
            None => most,
        };
        let counts = [points as u64, 0];
        let seconds = points * chosen.seconds;
        let answer = answer(known.collect(), counts, (0, StopReason::Done), seconds);
        return Ok(Some(ResolventFound {
            answer,
            field: None,
        }));
    }
    if let Some(run) = question.run {
        let predicted = answer(
            Vec::new(),
            [chosen.points as u64, 0],
            (0, StopReason::Done),
            0.0,
        );
        replicates::run(question, &*walks, &predicted, run)?;
        return Ok(Some(ResolventFound {
            answer: predicted,
            field: None,
        }));
    }
    let needed = |estimates: &[ResolventEstimate]| {
        let tolerance = settings.tolerance?;
        let off = estimates
            .iter()
            .map(|own| own.std_error * widening(own.freedom) / tolerance.error_at(own.value));
        Some(off.fold(0.0, f64::max))
    };
    let has_end = settings.walks.is_some() || settings.time_limit.is_some();
    let (mut points, mut rounds, mut next) = (0.0, 0, first);
    walks.set_gain(chosen.gain);
    let (mut stop, mut reason) = (StopReason::Done, None);
    let predicted = chosen.points.max(LEAST_PREDICTED / chosen.seconds);
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
        if settings.global != Some(true) && walks.is_biased(settings.tolerance) {
            return Ok(None);
        }
        let is_known = estimates.iter().all(|own| own.freedom >= LEAST_FREEDOM);
        let off = needed(&estimates).unwrap_or(f64::INFINITY);
        if is_below_rounding(&estimates, settings.tolerance) {
            stop = StopReason::ToleranceNotReached;
            reason = Some("rounding alone leaves more".to_owned());
            break;
        }
        if off <= 1.0 && is_known {
            break;
        }
        // Where points for one goal leave nothing but rounding to any, more tell nothing, unless they are asked for. Images are of points that
        // nobody has asked for yet, too.
        let is_exact = estimates.iter().all(|own| own.std_error <= own.floor);
        let is_open = settings.walks.is_none() && settings.tolerance.is_none();
        let are_enough = points >= Settings::WALKS as f64 && chosen.by.is_none();
        if is_open && are_enough && is_exact && is_known {
            break;
        }
        // Errors of nets fall about like the number of points.
        let all = points * off;
        let seconds = all * chosen.seconds;
        let is_long = all > MOST_OVER * predicted || seconds > MOST_SECONDS;
        if settings.tolerance.is_some() && !has_end && is_long {
            stop = StopReason::ToleranceNotReached;
            reason = Some(format!(
                "{} points were predicted to do; by now {} are, which take {} s on one thread; give `walks` or a time limit to go on \
                 until then",
                short(chosen.points),
                short(all),
                short(seconds)
            ));
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
        walks.set_gain(walks.gain());
        // Whoever interrupts waits for a part of a round.
        let more = match settings.tolerance {
            Some(_) => points * (off - 1.0).clamp(LEAST_GROWTH, GROWTH),
            None => next * GROWTH,
        };
        next = more.min((MOST_ROUND_SECONDS / chosen.seconds).max(next));
    }
    let (estimates, counts) = (walks.estimates(), walks.counts());
    let seconds = walking.elapsed().as_secs_f64();
    let answer = ResolventAnswer {
        reason,
        ..answer(estimates, counts, (rounds, stop), seconds)
    };
    let imaging = Instant::now();
    let field = walks.into_found().zip(chosen.by);
    let field = field.map(|((looks, blocks), by)| {
        let score_degree = blocks.degree(dimension);
        let field = chosen.cut.field(blocks, by);
        let regions = question.goals.iter().map(|goal| goal.region.clone());
        let regions: Vec<Region> = regions.collect();
        let is_looked_at = looks.len() == regions.len() * (IMAGE_HEAD + field.rows());
        let images = match is_looked_at {
            true => looks,
            false => field.images(GlobalQuantity::U, &regions)?,
        };
        Ok::<_, Error>(FoundField {
            images,
            score_degree,
            seconds: imaging.elapsed().as_secs_f64(),
            field,
        })
    });
    Ok(Some(ResolventFound {
        answer,
        field: field.transpose()?,
    }))
}
