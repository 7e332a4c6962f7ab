//! The choice of cells and degree, from standard deviations that are known before the first walk.

use fredholm_core::Tolerance;
use fredholm_core::galerkin::functions;
use fredholm_core::resolvent::MOST_FUNCTIONS;

use super::{MOST_RADIUS, MOST_UNKNOWNS, MakeCut, ResolventCut, ResolventQuestion, ResolventSizes};
use crate::{Error, Settings};

/// The degrees that are looked at.
const DEGREES: [usize; 4] = [0, 1, 2, 4];
/// Unknowns, about, with which the choice begins.
const FIRST_UNKNOWNS: usize = 24;
/// More cells are looked at where they are predicted to take this part of the best time so far.
const PAYS: f64 = 0.7;
/// Seconds of a point, but for values of functions; of a product of two polynomials; and of a number of a matrix that is inverted.
const POINT: f64 = 100e-9;
const PRODUCT: f64 = 1e-9;
const INVERSE: f64 = 1.5e-9;
/// Random points of a pair of cells in tables.
const LOOKS: f64 = 12.0;

/// What was chosen.
pub(super) struct Chosen<'a> {
    pub(super) cut: Box<dyn ResolventCut + 'a>,
    pub(super) cells: usize,
    pub(super) degree: usize,
    /// The points that the tables predict for the tolerance.
    pub(super) points: f64,
}

/// What is known of one degree with some cells.
#[derive(Clone, Copy)]
struct Known {
    level: usize,
    unknowns: f64,
    /// Seconds of the set-up.
    setup: f64,
    /// The variance of a point for all goals, where what they share is one: points are this over the square of an error.
    work: f64,
    radius: f64,
    /// Seconds of a point.
    point: f64,
}

/// Seconds of all as the question has an end.
struct Price<'q> {
    settings: &'q Settings,
    goals: f64,
}

impl Price<'_> {
    /// What is to be small: seconds, or, without an error that is asked for, variance times seconds.
    fn of(&self, known: &Known, error: Option<f64>) -> f64 {
        match (error, self.settings.time_limit) {
            (Some(error), _) => known.setup + known.work / (error * error) * known.point,
            (None, Some(limit)) => {
                let left = limit.as_secs_f64() - known.setup;
                known.work * known.point / left.max(f64::MIN_POSITIVE)
            }
            (None, None) => {
                let walks = self.settings.walks.unwrap_or(Settings::WALKS) as f64;
                known.work * (known.setup + self.goals * walks * known.point)
            }
        }
    }
}

/// The cells and the degree of least time, and their solved system.
pub(super) fn choose<'a>(
    question: &ResolventQuestion<'_>,
    sizes: &ResolventSizes,
    make: &MakeCut<'a>,
) -> Result<Chosen<'a>, Error> {
    let settings = question.settings;
    let price = Price {
        settings,
        goals: question.goals.len() as f64,
    };
    let levels: Vec<[usize; 2]> = match settings.cells {
        Some(cells) => sizes
            .levels
            .iter()
            .copied()
            .filter(|[own, _]| *own == cells)
            .collect(),
        None => sizes.levels.clone(),
    };
    let degrees: Vec<usize> = match settings.degree {
        Some(degree) => vec![degree],
        None => DEGREES.to_vec(),
    };
    let own = |degree: usize| functions(sizes.dimension, degree);
    let unknowns = |level: usize, degree: usize| levels[level][1].saturating_mul(own(degree));
    let fits = |level: usize, degree: usize| {
        own(degree) <= MOST_FUNCTIONS
            && (unknowns(level, degree) <= MOST_UNKNOWNS || settings.cells.is_some())
    };
    let mut found: Vec<(usize, Known)> = Vec::new();
    let mut best: Option<(Chosen<'a>, f64)> = None;
    let mut spent = 0.0;
    let mut worst: Option<(f64, f64)> = None;
    let mut error = None;
    let mut look = |level: usize,
                    degree: usize,
                    found: &mut Vec<(usize, Known)>,
                    best: &mut Option<(Chosen<'a>, f64)>,
                    error: &mut Option<f64>|
     -> Result<(), Error> {
        if question.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let cut = make(levels[level][0], degree)?;
        let walks = cut.walks(question.goals)?;
        let (shared, each) = walks.std_devs();
        let many = price.goals.sqrt();
        let largest = each.iter().copied().fold(0.0, f64::max);
        let all = many * shared + each.iter().sum::<f64>();
        *error = match settings.tolerance {
            Some(Tolerance::Absolute(error)) => Some(error),
            Some(Tolerance::Relative(share)) => {
                let least = walks
                    .known()
                    .into_iter()
                    .map(f64::abs)
                    .fold(f64::INFINITY, f64::min);
                Some(share * least)
            }
            None => None,
        };
        drop(walks);
        let figures = cut.figures();
        let known = Known {
            level,
            unknowns: figures.unknowns as f64,
            setup: sizes.setup(levels[level][1], degree),
            work: all * (shared / many + largest),
            radius: figures.radius,
            point: sizes.point(degree),
        };
        spent += known.setup;
        found.push((degree, known));
        let radius = worst.map_or(f64::INFINITY, |(radius, _)| radius);
        if !(figures.radius >= radius) {
            worst = Some((figures.radius, figures.condition));
        }
        let own = price.of(&known, *error);
        let is_valid = figures.radius < MOST_RADIUS;
        if is_valid && best.as_ref().is_none_or(|(_, least)| own < *least) {
            let points = error.map_or(0.0, |error| known.work / (error * error));
            let chosen = Chosen {
                cut,
                cells: levels[level][0],
                degree,
                points,
            };
            *best = Some((chosen, own));
        }
        Ok(())
    };
    for &degree in &degrees {
        let first = (0..levels.len()).find(|&level| unknowns(level, degree) >= FIRST_UNKNOWNS);
        let first = first.unwrap_or(levels.len().saturating_sub(1));
        if first < levels.len() && fits(first, degree) {
            look(first, degree, &mut found, &mut best, &mut error)?;
        }
    }
    loop {
        let least = best.as_ref().map_or(f64::INFINITY, |(_, least)| *least);
        // The next cells of every degree, and what they are predicted to take.
        let next = degrees.iter().filter_map(|&degree| {
            let mut own = found
                .iter()
                .filter(|(other, _)| *other == degree)
                .map(|(_, known)| *known);
            let last = own.by_ref().last()?;
            let mut before = found
                .iter()
                .filter(|(other, known)| *other == degree && known.level < last.level);
            let level = (last.level + 1..levels.len())
                .find(|&level| unknowns(level, degree) as f64 >= 1.9 * last.unknowns)
                .or((last.level + 1 < levels.len()).then_some(levels.len() - 1))?;
            if !fits(level, degree) {
                return None;
            }
            let order = (degree + 1) as f64 / sizes.dimension as f64;
            let falls = before.next_back().map_or(order, |(_, before)| {
                let falls =
                    0.5 * (before.work / last.work).ln() / (last.unknowns / before.unknowns).ln();
                if falls.is_finite() {
                    falls.clamp(0.0, 2.0 * order)
                } else {
                    order
                }
            });
            let more = unknowns(level, degree) as f64 / last.unknowns;
            let predicted = Known {
                setup: sizes.setup(levels[level][1], degree),
                work: last.work * more.powf(-2.0 * falls),
                radius: last.radius * more.powf(-falls),
                ..last
            };
            let price = price.of(&predicted, error);
            Some((level, degree, price, predicted))
        });
        let next = next.min_by(|a, b| match best.is_some() {
            true => a.2.total_cmp(&b.2),
            false => a.3.radius.total_cmp(&b.3.radius),
        });
        let Some((level, degree, predicted, known)) = next else {
            break;
        };
        let pays = predicted < PAYS * least && (error.is_none() || known.setup < least);
        if best.is_some() && !pays {
            break;
        }
        look(level, degree, &mut found, &mut best, &mut error)?;
    }
    let _ = spent;
    match (best, worst) {
        (Some((chosen, _)), _) => Ok(chosen),
        (None, Some((radius, condition))) => {
            let most = found.iter().map(|(_, known)| known.unknowns);
            let most = most.fold(0.0, f64::max);
            Err(Error::Regular {
                message: format!(
                    "the kernel is not known well enough on {most} unknowns: the spectral radius of (1 + |R|)|K - K_n| is \
                 {radius:.2}, and it must be below {MOST_RADIUS} (the condition number of the equation is {condition:.1e}); give more \
                 `cells` or another `degree`"
                ),
            })
        }
        (None, None) => Err(Error::NoSetting),
    }
}

impl ResolventSizes {
    /// Seconds of the set-up with so many cells.
    fn setup(&self, cells: usize, degree: usize) -> f64 {
        let [kernel, _] = self.seconds;
        let d = self.dimension as i32;
        let own = functions(self.dimension, degree) as f64;
        let nodes = ((degree + 1) as f64).powi(d) * ((degree + 2) as f64).powi(d);
        let pairs = (cells as f64).powi(2);
        let values =
            nodes * (kernel + PRODUCT * own) + LOOKS * (POINT + kernel + PRODUCT * own * own);
        pairs * values + INVERSE * (cells as f64 * own).powi(3)
    }

    /// Seconds of a point.
    fn point(&self, degree: usize) -> f64 {
        let [kernel, source] = self.seconds;
        let own = functions(self.dimension, degree) as f64;
        POINT + kernel + source + PRODUCT * own * own
    }
}
