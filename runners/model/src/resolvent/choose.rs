//! The choice of cells and degree, from standard deviations that are known before the first walk.

use fredholm_core::Tolerance;
use fredholm_core::galerkin::functions;
use fredholm_core::resolvent::{MOST_FUNCTIONS, PAIR_DRAWS};

use super::{MOST_RADIUS, MOST_UNKNOWNS, MakeCut, ResolventCut, ResolventQuestion, ResolventSizes};
use crate::{Error, Method, Settings};

/// The degrees that are looked at.
const DEGREES: [usize; 4] = [0, 1, 2, 4];
/// Unknowns, about, with which the choice begins.
const FIRST_UNKNOWNS: usize = 24;
/// Cells are doubled, about, from look to look.
const DOUBLE: f64 = 1.9;
/// More cells are looked at where they are predicted to take this part of the best time so far.
const PAYS: f64 = 0.7;
/// Seconds of a point, but for values of functions; of a product of two polynomials; and of a number of a matrix that is inverted.
const POINT: f64 = 100e-9;
const PRODUCT: f64 = 1e-9;
const INVERSE: f64 = 0.25e-9;

/// What was chosen.
pub(super) struct Chosen<'a> {
    pub(super) cut: Box<dyn ResolventCut + 'a>,
    pub(super) cells: usize,
    pub(super) degree: usize,
    /// The points that the tables predict for the tolerance.
    pub(super) points: f64,
    /// Seconds of a point.
    pub(super) seconds: f64,
}

/// What is known of one degree on some cells, or predicted.
#[derive(Clone, Copy)]
struct Look {
    level: usize,
    degree: usize,
    unknowns: f64,
    /// Seconds of the set-up.
    setup: f64,
    /// The variance of a point for all goals: the points that an error takes are this over its square.
    work: f64,
    radius: f64,
    condition: f64,
    /// Seconds of a point.
    point: f64,
}

/// The looks so far.
struct Search<'q, 'a> {
    question: &'q ResolventQuestion<'q>,
    sizes: &'q ResolventSizes,
    make: &'q MakeCut<'a>,
    /// The smallest error that is asked for, if one is.
    error: Option<f64>,
    looks: Vec<Look>,
    best: Option<(Chosen<'a>, f64)>,
}

/// The cells and the degree of least time, and their solved system.
pub(super) fn choose<'a>(
    question: &ResolventQuestion<'_>,
    sizes: &ResolventSizes,
    make: &MakeCut<'a>,
) -> Result<Chosen<'a>, Error> {
    let degrees = match question.settings.degree {
        Some(degree) => vec![degree],
        None => DEGREES.to_vec(),
    };
    let mut search = Search {
        question,
        sizes,
        make,
        error: None,
        looks: Vec::new(),
        best: None,
    };
    for &degree in &degrees {
        let levels = 0..sizes.levels.len();
        let first = levels
            .clone()
            .find(|&level| search.unknowns(level, degree) >= FIRST_UNKNOWNS);
        let first = first.or(levels.last());
        if let Some(first) = first.filter(|&first| search.fits(first, degree)) {
            search.look(first, degree)?;
        }
    }
    loop {
        let least = search
            .best
            .as_ref()
            .map_or(f64::INFINITY, |(_, least)| *least);
        let is_found = search.best.is_some();
        let next = degrees.iter().filter_map(|&degree| search.next(degree));
        // Before anything serves, what brings the radius down most.
        let order = |look: &Look| match is_found {
            true => search.price(look),
            false => look.radius,
        };
        let Some(next) = next.min_by(|a, b| order(a).total_cmp(&order(b))) else {
            break;
        };
        let is_short = search.error.is_none() || next.setup < least;
        if is_found && !(search.price(&next) < PAYS * least && is_short) {
            break;
        }
        search.look(next.level, next.degree)?;
    }
    match search.best {
        Some((chosen, _)) => Ok(chosen),
        None => Err(refused(&search.looks)),
    }
}

/// Nothing serves.
fn refused(looks: &[Look]) -> Error {
    let Some(best) = looks.iter().min_by(|a, b| a.radius.total_cmp(&b.radius)) else {
        return Error::NoSetting;
    };
    let most = looks.iter().map(|look| look.unknowns).fold(0.0, f64::max);
    let Look {
        radius, condition, ..
    } = best;
    Error::Regular {
        message: format!(
            "the kernel is not known well enough on up to {most} unknowns: the spectral radius of (1 + |R|)|K - K_n| is {radius:.2} at \
             best, and it must be below {MOST_RADIUS} (the condition number of the equation is {condition:.1e}); give more `cells` or \
             another `degree`"
        ),
    }
}

impl<'a> Search<'_, 'a> {
    fn unknowns(&self, level: usize, degree: usize) -> usize {
        let own = functions(self.sizes.dimension, degree);
        self.sizes.levels[level][1].saturating_mul(own)
    }

    /// Whether there is room for so many unknowns, or they are asked for.
    fn fits(&self, level: usize, degree: usize) -> bool {
        functions(self.sizes.dimension, degree) <= MOST_FUNCTIONS
            && (self.unknowns(level, degree) <= MOST_UNKNOWNS || self.is_asked(degree))
    }

    /// Whether resolvent walks with these cells are asked for, and there is no lower degree.
    fn is_asked(&self, degree: usize) -> bool {
        let settings = self.question.settings;
        let is_lowest = degree == settings.degree.unwrap_or(DEGREES[0]);
        settings.method == Some(Method::Resolvent) && settings.cells.is_some() && is_lowest
    }

    /// What is to be small: seconds, or, without an error that is asked for, variance times seconds.
    fn price(&self, look: &Look) -> f64 {
        let settings = self.question.settings;
        if let Some(error) = self.error {
            return look.setup + look.work / (error * error) * look.point;
        }
        match settings.time_limit {
            Some(limit) => {
                let left = limit.as_secs_f64() - look.setup;
                look.work * look.point / left.max(f64::MIN_POSITIVE)
            }
            None => {
                let walks = settings.walks.unwrap_or(Settings::WALKS) as f64;
                let goals = self.question.goals.len() as f64;
                look.work * (look.setup + goals * walks * look.point)
            }
        }
    }

    /// The next cells of a degree, with what is predicted of them.
    fn next(&self, degree: usize) -> Option<Look> {
        let mut own = self.looks.iter().rev().filter(|look| look.degree == degree);
        let (last, before) = (own.next()?, own.next());
        let count = self.sizes.levels.len();
        let doubled =
            |&level: &usize| self.unknowns(level, degree) as f64 >= DOUBLE * last.unknowns;
        let level = (last.level + 1..count).find(doubled);
        let level = level.or((last.level + 1 < count).then_some(count - 1))?;
        if !self.fits(level, degree) {
            return None;
        }
        let order = (degree + 1) as f64 / self.sizes.dimension as f64;
        let falls = before.map_or(order, |before| {
            let falls =
                0.5 * (before.work / last.work).ln() / (last.unknowns / before.unknowns).ln();
            match falls.is_finite() {
                true => falls.clamp(0.0, 2.0 * order),
                false => order,
            }
        });
        let unknowns = self.unknowns(level, degree) as f64;
        let more = unknowns / last.unknowns;
        Some(Look {
            level,
            unknowns,
            setup: self.sizes.setup(self.sizes.levels[level][1], degree),
            work: last.work * more.powf(-2.0 * falls),
            radius: last.radius * more.powf(-falls),
            ..*last
        })
    }

    /// Solves the equation on these cells, and keeps it if it is the best so far.
    fn look(&mut self, level: usize, degree: usize) -> Result<(), Error> {
        if self.question.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let [cells, all_cells] = self.sizes.levels[level];
        let goals = self.question.goals;
        let cut = (self.make)(cells, degree)?;
        let walks = cut.walks(goals)?;
        let known = walks.known().into_iter().map(f64::abs);
        self.error = match self.question.settings.tolerance {
            Some(Tolerance::Absolute(error)) => Some(error),
            Some(Tolerance::Relative(share)) => Some(share * known.fold(f64::INFINITY, f64::min)),
            None => None,
        };
        let (shared, own) = walks.std_devs();
        let many = (goals.len() as f64).sqrt();
        let largest = own.iter().copied().fold(0.0, f64::max);
        drop(walks);
        let figures = cut.figures();
        let look = Look {
            level,
            degree,
            unknowns: figures.unknowns as f64,
            setup: self.sizes.setup(all_cells, degree),
            work: (many * shared + own.iter().sum::<f64>()) * (shared / many + largest),
            radius: figures.radius,
            condition: figures.condition,
            point: self.sizes.point(degree),
        };
        self.looks.push(look);
        let price = self.price(&look);
        let is_best = self.best.as_ref().is_none_or(|(_, least)| price < *least);
        if figures.radius < MOST_RADIUS && is_best {
            let points = self.error.map_or(0.0, |error| look.work / (error * error));
            let chosen = Chosen {
                cut,
                cells,
                degree,
                points,
                seconds: look.point,
            };
            self.best = Some((chosen, price));
        }
        Ok(())
    }
}

impl ResolventSizes {
    /// Seconds of the set-up with so many cells.
    fn setup(&self, cells: usize, degree: usize) -> f64 {
        let [kernel, _] = self.seconds;
        let d = self.dimension as i32;
        let own = functions(self.dimension, degree) as f64;
        let nodes = ((degree + 1) as f64).powi(d) * ((degree + 2) as f64).powi(d);
        let quadrature = nodes * (kernel + PRODUCT * own);
        let looks = f64::from(PAIR_DRAWS) * (POINT + kernel + PRODUCT * own * own);
        (cells as f64).powi(2) * (quadrature + looks) + INVERSE * (cells as f64 * own).powi(3)
    }

    /// Seconds of a point.
    fn point(&self, degree: usize) -> f64 {
        let [kernel, source] = self.seconds;
        let own = functions(self.dimension, degree) as f64;
        POINT + kernel + source + PRODUCT * own * own
    }
}
