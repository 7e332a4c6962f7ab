//! The choice of cells and degree, from standard deviations that are known before the first walk.

use fredholm_core::galerkin::functions;
use fredholm_core::resolvent::{MOST_FUNCTIONS, PAIR_DRAWS};
use fredholm_rayon::Observer;

use super::cut::{ByImages, MOST_LOOKS, ResolventWalks};
use super::images::scored;
use super::{
    CellsAndDegree, MOST_RADIUS, MOST_UNKNOWNS, MakeCut, ResolventCut, ResolventQuestion,
    ResolventSizes, most_points,
};
use crate::{Error, Goal, Method, Region};

/// The degrees that are looked at.
const DEGREES: [usize; 4] = [0, 1, 2, 4];
/// Unknowns, about, with which the choice begins.
const FIRST_UNKNOWNS: usize = 24;
/// Unknowns beyond which equations take seconds: more are looked at where nothing else serves, or where they pay.
const FEW: f64 = 2000.0;
/// Cells are doubled, about, from look to look.
const DOUBLE: f64 = 1.9;
/// More cells are looked at where they are predicted to take this part of the best time so far.
const PAYS: f64 = 0.7;
/// Seconds of a set-up at most where neither an error nor a time is asked for, unless walks take longer.
const MOST_UNASKED: f64 = 1.0;
/// Seconds of a point, but for values of functions; of a product of two polynomials; of N³ where a matrix is inverted, and where only factors are
/// made, which take a third of the products; and of N² where a system is solved by these.
const POINT: f64 = 100e-9;
const PRODUCT: f64 = 1e-9;
const INVERSE: f64 = 0.25e-9;
const FACTORS: f64 = INVERSE / 3.0;
const SOLVE: f64 = 3e-9;
/// Systems that are solved by factors besides those of every goal, for a condition number and for pilots; and how many a goal has.
const SOLVES: usize = 30;
const SOLVES_OF_GOAL: usize = 2;

/// The number of points from which on images are looked at, unless they are asked for; and how many make a prediction.
const MANY: usize = 9;
const PREDICTED: usize = 6;
/// Points of a stratum by which it is known what nets gain, and what follows for more.
const PILOTS: [f64; 3] = [8.0, 64.0, 512.0];
/// The part of a set-up's time that they may take, and seconds that they may take in any case.
const PILOT_SHARE: f64 = 0.1;
const PILOT_SECONDS: f64 = 2e-3;
/// The mask of their seed.
const PILOT_SEED: u64 = 0x6e65_7473;
/// The part of the power that they show that is believed for more points, and the highest one: that of smooth functions.
const TRUST: f64 = 0.75;
const MOST_FALLS: f64 = 0.75;
/// The standard deviation of what walks that go on add, over that of a point, as a part of the radius: 0.7 to 2.6 were measured.
const REST: f64 = 1.5;
/// The bounds of the gain for which these points are roulette's.
const GAINS: [f64; 2] = [1e-3, 0.1];
/// The part of an error that images may have: no walks lower it.
const MOST_OF_IMAGE: f64 = 0.5;
/// Seconds of a value in the resamples of a band.
const BAND: f64 = 1.3e-4;
/// Products that a function on which points score takes, with its replicates.
const SCORED: f64 = 3.0;

/// What was chosen.
pub(super) struct Chosen<'a> {
    pub(super) cut: Box<dyn ResolventCut + 'a>,
    pub(super) by: ByImages,
    pub(super) cells: usize,
    pub(super) degree: usize,
    /// The points that are predicted for the tolerance, or are asked for, and what nets gain on them.
    pub(super) points: f64,
    pub(super) gain: f64,
    /// Seconds of a point.
    pub(super) seconds: f64,
}

/// What nets gain: the standard deviation of a point is so many times what tables predict where a stratum has so many of them, and falls like
/// a power of that. Walks that go on have no nets, and add the rest.
#[derive(Clone, Copy, Debug)]
struct Nets {
    gain: f64,
    at: f64,
    falls: f64,
    rest: f64,
}

impl Nets {
    /// Nets gain nothing, as far as is known.
    const NONE: Self = Self {
        gain: 1.0,
        at: 1.0,
        falls: 0.0,
        rest: 0.0,
    };

    /// How many times more points are believed to gain more: as many times as have been seen to. Where a function has a kink nets fall less in the end
    /// than they begin to.
    fn falls_for(&self) -> f64 {
        (self.at / PILOTS[0]).max(1.0)
    }
}

/// How values may be told.
#[derive(Clone, Copy)]
struct Way {
    by: ByImages,
    nets: Nets,
    /// The variance of a point for all goals, but for what nets gain.
    work: f64,
    /// The number of strata that count.
    strata: f64,
    /// Points, if no error is asked for.
    points: f64,
    /// Seconds of a point, and of images.
    point: f64,
    images: f64,
}

impl Way {
    /// What nets gain on so many points.
    fn gain(&self, points: f64) -> f64 {
        let nets = &self.nets;
        let more = (points / self.strata / nets.at).min(nets.falls_for());
        (nets.gain * more.powf(-nets.falls)).hypot(nets.rest)
    }

    /// The points that an error takes, or that are asked for.
    fn points_for(&self, error: Option<f64>) -> f64 {
        let Some(error) = error else {
            return self.points;
        };
        let nets = &self.nets;
        // (points/at)^(-½ - falls), and no more than that where nets do not fall further.
        let at = self.strata * nets.at;
        let of_at = (self.work / at).sqrt() * nets.gain / error;
        let most = nets.falls_for();
        let more = of_at.powf(1.0 / (0.5 + nets.falls));
        let more = match more <= most {
            true => more,
            false => (of_at * most.powf(-nets.falls)).powi(2),
        };
        at * more + self.work * (nets.rest / error).powi(2)
    }

    /// Seconds until an error is reached, or of the points that are asked for, but for the set-up.
    fn seconds(&self, error: Option<f64>) -> f64 {
        self.images + self.points_for(error) * self.point
    }

    /// The variance that so many points leave.
    fn variance(&self, points: f64) -> f64 {
        self.work / points * self.gain(points).powi(2)
    }
}

/// What is known of one degree on some cells, or predicted.
#[derive(Clone, Copy)]
struct Look {
    level: usize,
    degree: usize,
    unknowns: f64,
    /// Seconds of the set-up.
    setup: f64,
    /// The cells by whose resolvent walks go on, if they are others.
    coarse: Option<CellsAndDegree>,
    rows: Way,
    images: Option<Way>,
    radius: f64,
    condition: f64,
    /// The error that rounding leaves of the largest value: no variance below its square is worth anything.
    floor: f64,
}

impl Look {
    /// Whether the matrix has an inverse.
    const fn is_solved(&self) -> bool {
        self.radius != f64::INFINITY
    }

    /// Cells whose matrix has none, as 1 is an eigenvalue of K' as far as numbers tell: it need not be one of K.
    const fn singular(level: usize, degree: usize, unknowns: f64, setup: f64) -> Self {
        let rows = Way {
            by: None,
            nets: Nets::NONE,
            work: 1.0,
            strata: 1.0,
            points: 1.0,
            point: 1.0,
            images: 0.0,
        };
        Self {
            level,
            degree,
            unknowns,
            setup,
            coarse: None,
            rows,
            images: None,
            radius: f64::INFINITY,
            condition: f64::INFINITY,
            floor: f64::INFINITY,
        }
    }
}

/// The looks so far.
struct Search<'q, 'a> {
    question: &'q ResolventQuestion<'q>,
    sizes: &'q ResolventSizes,
    make: &'q MakeCut<'q, 'a>,
    /// The smallest error that is asked for, if one is.
    error: Option<f64>,
    looks: Vec<Look>,
    best: Option<(Chosen<'a>, f64)>,
    /// Why the last cells were refused whose matrix has no inverse.
    singular: Option<Error>,
    /// Whether more cells would have taken longer than the time limit.
    is_late: bool,
}

/// Observer of pilots, which are not counted and may be cancelled.
struct Pilots<'a>(&'a dyn Observer);

impl Observer for Pilots<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// The cells and the degree of least time, and their solved system.
pub(super) fn choose<'a>(
    question: &ResolventQuestion<'_>,
    sizes: &ResolventSizes,
    make: &MakeCut<'_, 'a>,
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
        singular: None,
        is_late: false,
    };
    for &degree in &degrees {
        let levels = 0..sizes.levels.len();
        let first = levels
            .clone()
            .find(|&level| search.unknowns(level, degree) >= FIRST_UNKNOWNS);
        let first = first.or(levels.last());
        if let Some(first) = first.filter(|&first| search.fits(first, degree))
            && search.may_pay(search.setup(first, degree).0)
        {
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
        let next: Vec<Look> = next.collect();
        // Before anything serves, what brings the radius down most, and then, as that is no more than a guess, what takes least.
        let order = |look: &Look| match (is_found, look.unknowns > FEW) {
            (true, _) => (false, search.price(look).0),
            (_, false) => (false, look.radius),
            (_, true) => (true, look.setup),
        };
        let first = |a: &Look, b: &Look| {
            let ((a_is_late, a), (b_is_late, b)) = (order(a), order(b));
            a_is_late.cmp(&b_is_late).then(a.total_cmp(&b))
        };
        let left = search.seconds_left();
        let in_time = next.iter().filter(|look| is_found || look.setup <= left);
        let Some(next) = in_time.min_by(|a, b| first(a, b)) else {
            search.is_late = !next.is_empty();
            break;
        };
        let pays = search.price(next).0 < PAYS * least && search.may_pay(next.setup);
        if is_found && !pays {
            break;
        }
        search.look(next.level, next.degree)?;
    }
    match search.best {
        Some((chosen, _)) => Ok(chosen),
        None => Err(refused(search)),
    }
}

/// Nothing serves, or nothing that could be looked at in the time limit.
fn refused(search: Search<'_, '_>) -> Error {
    let Search {
        looks,
        singular,
        question,
        is_late,
        ..
    } = search;
    // Where the finest cells have no inverse none serve, whatever coarser ones seemed to say.
    let finest = looks
        .iter()
        .max_by(|a, b| a.unknowns.total_cmp(&b.unknowns));
    let is_singular = finest.is_some_and(|finest| !finest.is_solved());
    let solved = looks.iter().filter(|look| look.is_solved() && !is_singular);
    let Some(best) = solved.min_by(|a, b| a.radius.total_cmp(&b.radius)) else {
        return singular.unwrap_or(Error::NoSetting);
    };
    let most = looks.iter().map(|look| look.unknowns).fold(0.0, f64::max);
    let Look {
        radius, condition, ..
    } = best;
    let limit = question.settings.time_limit.filter(|_| is_late);
    let (within, more) = match limit {
        Some(limit) => (
            format!(", and more take longer than the time limit of {limit:?}"),
            "a longer time limit, ",
        ),
        None => (String::new(), ""),
    };
    Error::Regular {
        message: format!(
            "the kernel is not known well enough on up to {most} unknowns{within}: the spectral radius of (1 + |R|)|K - K_n| is \
             {radius:.2} at best, and it must be below {MOST_RADIUS} (the condition number of the equation is {condition:.1e}); give \
             {more}more `cells` or another `degree`"
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

    /// Seconds of a set-up, and the cells by whose resolvent walks go on, if that takes less than an inverse.
    fn setup(&self, level: usize, degree: usize) -> (f64, Option<CellsAndDegree>) {
        let unknowns = self.unknowns(level, degree) as f64;
        let common = self.sizes.setup(self.sizes.levels[level][1], degree);
        let by_inverse = common + INVERSE * unknowns.powi(3);
        let solves = SOLVES + SOLVES_OF_GOAL * self.question.goals.len();
        let factors = FACTORS * unknowns.powi(3) + solves as f64 * SOLVE * unknowns.powi(2);
        let serve = self.looks.iter().filter(|look| {
            look.coarse.is_none() && look.radius < MOST_RADIUS && look.degree <= degree
        });
        match serve.min_by(|a, b| a.setup.total_cmp(&b.setup)) {
            // Images ask for all of an inverse.
            Some(look) if common + factors + look.setup < by_inverse && !self.may_be_images() => {
                let [cells, _] = self.sizes.levels[look.level];
                (common + factors + look.setup, Some([cells, look.degree]))
            }
            _ => (by_inverse, None),
        }
    }

    /// Whether values may be images, if that is quicker, or must be.
    fn may_be_images(&self) -> bool {
        let goals = self.question.goals;
        let is_point = |goal: &&Goal| matches!(goal.region, Region::Point(_));
        let is_weight = |goal: &Goal| matches!(goal.region, Region::Weight(_));
        let has_many = goals.iter().filter(is_point).count() >= MANY;
        // Rules for weights have a bias of their own.
        let is_meant = has_many && !goals.iter().any(is_weight);
        let settings = self.question.settings;
        settings.walks != Some(0) && settings.global.unwrap_or(is_meant)
    }

    /// Whether a set-up of so many seconds can be worth it: nothing serves yet, or what does takes longer.
    fn may_pay(&self, setup: f64) -> bool {
        let Some((best, least)) = &self.best else {
            return true;
        };
        let left = self.seconds_left();
        match self.error {
            Some(_) => setup < least.min(left),
            None if left.is_finite() => setup < left,
            None => setup < MOST_UNASKED.max(best.points * best.seconds),
        }
    }

    /// Seconds of the time limit that set-ups have left, as they are predicted: the clock would choose other cells from run to run.
    fn seconds_left(&self) -> f64 {
        let limit = self.question.settings.time_limit;
        let limit = limit.map_or(f64::INFINITY, |limit| limit.as_secs_f64());
        limit - self.looks.iter().map(|look| look.setup).sum::<f64>()
    }

    /// What is to be small: seconds, or, without an error that is asked for, variance times seconds; and the way for which it is.
    fn price(&self, look: &Look) -> (f64, Way) {
        let settings = self.question.settings;
        let of = |way: &Way| {
            let fixed = look.setup + way.images;
            match (self.error, settings.time_limit) {
                (Some(_), _) => look.setup + way.seconds(self.error),
                (None, Some(limit)) => {
                    let left = (limit.as_secs_f64() - fixed).max(f64::MIN_POSITIVE);
                    way.variance(left / way.point) + look.floor.powi(2)
                }
                (None, None) => {
                    let variance = way.variance(way.points) + look.floor.powi(2);
                    variance * (fixed + way.points * way.point)
                }
            }
        };
        let rows = (of(&look.rows), look.rows);
        let Some(images) = look.images else {
            return rows;
        };
        let [one, all] = [images, look.rows].map(|way| way.seconds(self.error));
        match settings.global == Some(true) || one < all {
            true => (of(&images), images),
            false => rows,
        }
    }

    /// The next cells of a degree, with what is predicted of them.
    fn next(&self, degree: usize) -> Option<Look> {
        let mut own = self.looks.iter().rev().filter(|look| look.degree == degree);
        let (last, before) = (own.next()?, own.next());
        if !last.is_solved() && before.is_some_and(|before| !before.is_solved()) {
            return None;
        }
        let before = before.filter(|before| before.is_solved());
        let count = self.sizes.levels.len();
        let doubled =
            |&level: &usize| self.unknowns(level, degree) as f64 >= DOUBLE * last.unknowns;
        let mut finer = (last.level + 1..count).filter(|&level| self.fits(level, degree));
        let level = finer.clone().find(doubled).or(finer.next_back())?;
        let order = (degree + 1) as f64 / self.sizes.dimension as f64;
        let unknowns = self.unknowns(level, degree) as f64;
        let more = unknowns / last.unknowns;
        // As fast as errors are ever taken to fall, here the radius would not fall enough.
        if unknowns > FEW && !(last.radius * more.powf(-2.0 * order) < MOST_RADIUS) {
            return None;
        }
        let way = |of: fn(&Look) -> Option<Way>| {
            let (last_way, before_way) = (of(last)?, before.and_then(of));
            // A power of the unknowns is how a number grows.
            let grows = |number: fn(&Way) -> f64, usual: f64, [least, most]: [f64; 2]| {
                let power = before.zip(before_way).map(|(before, way)| {
                    let grown = number(&last_way) / number(&way);
                    grown.ln() / (last.unknowns / before.unknowns).ln()
                });
                let power = power.filter(|power| power.is_finite());
                more.powf(power.unwrap_or(usual).clamp(least, most))
            };
            Some(Way {
                work: last_way.work * grows(|way| way.work, -2.0 * order, [-4.0 * order, 0.0]),
                strata: last_way.strata * grows(|way| way.strata, 1.0, [0.0, 2.0]),
                images: last_way.images * grows(|way| way.images, 1.0, [0.0, 1.0]),
                ..last_way
            })
        };
        let rows = way(|look| Some(look.rows))?;
        let (setup, coarse) = self.setup(level, degree);
        Some(Look {
            level,
            unknowns,
            setup,
            coarse,
            rows,
            images: way(|look| look.images),
            radius: last.radius * (rows.work / last.rows.work).sqrt(),
            ..*last
        })
    }

    /// Solves the equation on these cells, and keeps it if it is the best so far.
    fn look(&mut self, level: usize, degree: usize) -> Result<(), Error> {
        if self.question.watch.cancelled() {
            return Err(Error::Cancelled);
        }
        let [cells, _] = self.sizes.levels[level];
        let goals = self.question.goals;
        let (setup, coarse) = self.setup(level, degree);
        let cut = match (self.make)([cells, degree], coarse) {
            Err(error @ Error::Regular { .. }) => {
                let unknowns = self.unknowns(level, degree) as f64;
                self.looks
                    .push(Look::singular(level, degree, unknowns, setup));
                self.singular = Some(error);
                return Ok(());
            }
            made => made?,
        };
        let walks = cut.walks(goals, None)?;
        let known = walks.known();
        let largest = known.iter().fold(0.0, |all: f64, own| all.max(own[1]));
        let least = |all: f64, own: &[f64; 2]| all.min(own[0].abs());
        let least = known.iter().fold(f64::INFINITY, least);
        let tolerance = self.question.settings.tolerance.as_ref();
        self.error = tolerance.map(|asked| asked.error_at(least));
        let nets = self.nets(&*cut, degree, setup)?;
        let rows = self.way(&*walks, (None, nets), degree);
        drop(walks);
        let is_asked = self.question.settings.global == Some(true);
        let is_short = !is_asked && rows.seconds(self.error) < BAND * goals.len() as f64;
        let images = match cut.has_images() && self.may_be_images() && !is_short {
            true => Some(self.by_images(&*cut, &rows, degree)?),
            false => None,
        };
        let figures = cut.figures();
        let look = Look {
            level,
            degree,
            unknowns: figures.unknowns as f64,
            setup,
            coarse,
            rows,
            images,
            radius: figures.radius,
            condition: figures.condition,
            floor: figures.floor(largest),
        };
        self.looks.push(look);
        let (price, way) = self.price(&look);
        let is_best = self.best.as_ref().is_none_or(|(_, least)| price < *least);
        if figures.radius < MOST_RADIUS && is_best {
            let points = way.points_for(self.error);
            let chosen = Chosen {
                cut,
                by: way.by,
                cells,
                degree,
                points,
                gain: way.gain(points),
                seconds: way.point,
            };
            self.best = Some((chosen, price));
        }
        Ok(())
    }

    /// A way whose points have the standard deviations of these walks: what all goals share, and what each has for itself.
    fn way(&self, of: &dyn ResolventWalks, (by, nets): (ByImages, Nets), degree: usize) -> Way {
        let (shared, own) = of.std_devs();
        let many = (own.len().max(1) as f64).sqrt();
        let largest = own.iter().copied().fold(0.0, f64::max);
        Way {
            by,
            nets,
            work: (many * shared + own.iter().sum::<f64>()) * (shared / many + largest),
            strata: of.strata(),
            points: most_points(self.question, by.is_some()),
            point: self.sizes.point(degree, by),
            images: 0.0,
        }
    }

    /// What nets gain on some goals, by a few points that are not used otherwise; where even these would take too long, as on fewer cells.
    fn nets(&self, cut: &dyn ResolventCut, degree: usize, setup: f64) -> Result<Nets, Error> {
        let goals = self.question.goals;
        let some = goals.iter().step_by(goals.len().div_ceil(PREDICTED).max(1));
        let some: Vec<Goal> = some.cloned().collect();
        let before = self.looks.iter().rev().find(|look| look.degree == degree);
        let figures = cut.figures();
        let rest = REST * figures.first_radius;
        let most = (PILOT_SHARE * setup).max(PILOT_SECONDS) / self.sizes.point(degree, None);
        let mut found: Option<Nets> = None;
        // Where walks have no mean they may not end.
        let pilots = PILOTS.iter().filter(|_| figures.radius < 1.0);
        for &at in pilots {
            let mut walks = cut.walks(&some, None)?;
            let points = at * walks.strata();
            if points > most {
                break;
            }
            // What walks that go on add is to be small, and is counted for itself.
            walks.set_gain(rest.clamp(GAINS[0], GAINS[1]));
            let seed = self.question.settings.seed ^ PILOT_SEED;
            walks.round(0, points, seed, &Pilots(self.question.watch))?;
            let gain = walks.gain();
            if !(gain > 0.0) {
                break;
            }
            // Above 1 there are rare scores, and no nets that gain.
            let falls = found.map_or(0.0, |before: Nets| {
                (before.gain.min(1.0) / gain.min(1.0)).ln() / (at / before.at).ln()
            });
            let falls = (TRUST * falls).clamp(0.0, MOST_FALLS);
            found = Some(Nets {
                gain,
                at,
                falls,
                rest,
            });
        }
        let found = found.filter(|found| found.at > PILOTS[0]);
        let before = before.map_or(Nets::NONE, |look| look.rows.nets);
        Ok(found.unwrap_or(Nets { rest, ..before }))
    }

    /// What images of some of the points tell of all.
    fn by_images(&self, cut: &dyn ResolventCut, rows: &Way, degree: usize) -> Result<Way, Error> {
        let goals = self.question.goals;
        let points = most_points(self.question, true);
        let error = self.error.unwrap_or(rows.variance(points).sqrt());
        let by = (error, self.question.settings.seed);
        let every = goals.len().div_ceil(PREDICTED);
        let some = goals.iter().skip(every / 2).step_by(every);
        let some: Vec<Goal> = some.cloned().collect();
        let walks = cut.walks(&some, Some(by))?;
        let [evaluations, off] = walks.image_costs();
        let is_exact = self.error.is_none() || off < MOST_OF_IMAGE * error;
        // By the resolvent go the integrals of every point.
        let each = BAND
            + evaluations * self.sizes.evaluation(degree)
            + PRODUCT * (cut.figures().unknowns as f64).powi(2);
        // Of more points than are looked at those that are have images twice.
        let twice = if goals.len() > MOST_LOOKS {
            MOST_LOOKS
        } else {
            0
        };
        let way = self.way(&*walks, (Some(by), rows.nets), degree);
        Ok(Way {
            work: if is_exact { way.work } else { f64::INFINITY },
            images: (goals.len() + twice) as f64 * each,
            ..way
        })
    }
}

impl ResolventSizes {
    /// Seconds of the set-up with so many cells, but for the solution.
    fn setup(&self, cells: usize, degree: usize) -> f64 {
        let [kernel, _] = self.seconds;
        let d = self.dimension as i32;
        let own = functions(self.dimension, degree) as f64;
        let nodes = ((degree + 1) as f64).powi(d) * ((degree + 2) as f64).powi(d);
        let quadrature = nodes * (kernel + PRODUCT * own);
        let looks = f64::from(PAIR_DRAWS) * (POINT + kernel + PRODUCT * own * own);
        (cells as f64).powi(2) * (quadrature + looks)
    }

    /// Seconds of a point.
    fn point(&self, degree: usize, by: ByImages) -> f64 {
        let [kernel, source] = self.seconds;
        let own = functions(self.dimension, degree);
        let more = by.and_then(|_| scored(self.dimension, own)).unwrap_or(0);
        POINT + kernel + source + PRODUCT * ((own * own) as f64 + SCORED * more as f64)
    }

    /// Seconds of a value of K in an image.
    fn evaluation(&self, degree: usize) -> f64 {
        let [kernel, source] = self.seconds;
        let own = functions(self.dimension, degree);
        let all = own + scored(self.dimension, own).unwrap_or(0);
        0.5 * POINT + kernel + source + PRODUCT * all as f64
    }
}
