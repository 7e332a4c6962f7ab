//! A solved equation.

use fredholm_core::galerkin::{Cells, buffer, functions};
use fredholm_core::resolvent::{
    AxisNode, CellEnd, CellPoint, Coarse, GalerkinRows, Grid, Plan, Regular, Resolvent,
    ResolventLooks, ResolventTables, ends, grading, is_rough, singularity,
};
use fredholm_core::{Real, Tolerance};
use fredholm_rayon::{Observer, fill_rows, gathered};
use fredholm_variance::gauss;

use super::blocks::Blocks;
use super::images::{ImageField, ImageMaker, scored};
use super::inverse::{Factors, factors, go_on, inverse};
use super::regular::{AnyPoint, AnyRegular, Functional, PointWeight};
use super::walks::{Imaging, Sums, Walks};
use super::{ResolventEstimate, ResolventFigures};
use crate::{Error, GlobalField, Goal, Region};

/// The most values that are looked at while walks go on, where they are images.
pub(super) const MOST_LOOKS: usize = 256;
/// The exponent of |x − y| over d, or of a distance from an end, from which on a kernel is taken to have no integral.
const LEAST_INFINITE: f64 = 0.995;

/// How values are told: by rows, each with points of its own besides those that all goals share, without any bias; or by
/// [images](fredholm_core::resolvent::Images) of what the latter tell of u, which may be off by so much, with draws of this seed.
pub type ByImages = Option<(f64, u64)>;

/// A solved equation of any type.
pub trait ResolventCut: Send + Sync {
    /// What is known before any walk.
    fn figures(&self) -> ResolventFigures;

    /// Whether values may be images: there are functions of a higher degree on which points score.
    fn has_images(&self) -> bool;

    /// The walks of these goals.
    ///
    /// # Errors
    /// [`Error::Region`].
    fn walks<'c>(
        &'c self,
        goals: &[Goal],
        by: ByImages,
    ) -> Result<Box<dyn ResolventWalks + 'c>, Error>;

    /// The function that walks have found.
    fn field<'f>(self: Box<Self>, blocks: Blocks, by: (f64, u64)) -> Box<dyn GlobalField + 'f>
    where
        Self: 'f;
}

/// Walks of some goals.
pub trait ResolventWalks: Sync {
    /// The standard deviation of a point of what all goals share, and those of what every goal has for itself.
    fn std_devs(&self) -> (f64, Vec<f64>);

    /// How many strata make these, about: points over it are those of one.
    fn strata(&self) -> f64;

    /// Sets by how much nets lower the standard deviation of a point.
    fn set_gain(&mut self, gain: f64);

    /// By how much they have lowered it so far.
    fn gain(&self) -> f64;

    /// The part of every goal that takes no walks, and the size of its terms; of many images some are looked at.
    fn known(&self) -> Vec<[f64; 2]>;

    /// The mean number of values of K of an image, and the largest standard error of one.
    fn image_costs(&self) -> [f64; 2];

    /// Adds a round of about so many points.
    ///
    /// # Errors
    /// [`Error::Cancelled`]: nothing was added.
    fn round(
        &mut self,
        round: u32,
        points: f64,
        seed: u64,
        watch: &dyn Observer,
    ) -> Result<(), Error>;

    /// The values of all goals by about so many points that are a sample of their own, and the number of their states: points, and steps
    /// beyond them.
    ///
    /// # Errors
    /// Of the equation.
    fn replicate(&self, number: u32, points: f64, seed: u64) -> Result<(Vec<f64>, u64), Error>;

    /// The estimates so far; of many images some are looked at.
    fn estimates(&self) -> Vec<ResolventEstimate>;

    /// Whether images lose more than a part of an error, or of their standard errors: then points of their own are better.
    fn is_biased(&self, tolerance: Option<Tolerance>) -> bool;

    /// The values that are looked at, if they are images, as [`GlobalField::images`] has them, and what their function is made of.
    fn into_found(self: Box<Self>) -> Option<(Vec<f64>, Blocks)>;

    /// The numbers of points and of steps beyond the first.
    fn counts(&self) -> [u64; 2];
}

/// Solved equation on fewer cells, by whose resolvent walks go on, with the factors by which that on the finer cells is solved.
pub(super) struct OnCoarse<'k> {
    cut: Box<Cut<'k>>,
    factors: Factors,
    /// [`Coarse::share`].
    share: f64,
}

/// A solved equation.
pub(super) struct Cut<'k> {
    pub(super) equation: Grid<AnyRegular<'k>>,
    pub(super) functions: usize,
    pub(super) measures: Vec<f64>,
    pub(super) kernel: Vec<f64>,
    /// R̂, or nothing where walks go on by a coarse resolvent.
    pub(super) resolvent: Vec<f64>,
    pub(super) coarse: Option<OnCoarse<'k>>,
    pub(super) source: Vec<f64>,
    pub(super) correction: Vec<f64>,
    pub(super) looks: ResolventLooks,
    pub(super) condition: f64,
    pub(super) near: Vec<i32>,
    pub(super) ends: Vec<CellEnd>,
    pub(super) rules: [Vec<AxisNode>; 2],
}

/// A rule on [−1, 1] as one on [0, 1].
pub(super) fn on_axis(rule: &[(f64, f64)]) -> Vec<AxisNode> {
    let node = |&(t, weight): &(f64, f64)| AxisNode {
        at: 0.5 * (1.0 + t),
        share: 0.5 * weight,
    };
    rule.iter().map(node).collect()
}

/// Solves an equation with polynomials of a degree; with fewer cells and their degree walks go on by the resolvent of these.
///
/// # Errors
/// [`Error::NotFinite`], [`Error::Regular`]: I − K' is singular. [`Error::Galerkin`]: memory. [`Error::Cancelled`].
pub fn cut_of<'k>(
    equation: Grid<AnyRegular<'k>>,
    degree: usize,
    coarse: Option<(Grid<AnyRegular<'k>>, usize)>,
    watch: &dyn Observer,
) -> Result<Box<dyn ResolventCut + 'k>, Error> {
    let coarse = coarse.map(|(equation, degree)| solved(equation, degree, None, watch));
    let coarse = coarse.transpose()?;
    Ok(Box::new(solved(equation, degree, coarse, watch)?))
}

/// A solved equation, with a coarse one or none.
fn solved<'k>(
    equation: Grid<AnyRegular<'k>>,
    degree: usize,
    coarse: Option<Cut<'k>>,
    watch: &dyn Observer,
) -> Result<Cut<'k>, Error> {
    let dimension = equation.dimension();
    let (cells, own) = (equation.cells(), functions(dimension, degree));
    // Of one node more on the right: no two of them are the same.
    let rules = [gauss(degree + 1)?, gauss(degree + 2)?].map(|rule| on_axis(&rule));
    let exponent = gathered(|| singularity(&equation));
    if exponent >= LEAST_INFINITE * dimension as f64 {
        return Err(Error::Regular {
            message: format!(
                "the kernel has no integral: it grows like |x - y|^-{exponent:.2} at x = y"
            ),
        });
    }
    let (ends, at_ends) = gathered(|| ends(&equation))?;
    if at_ends >= LEAST_INFINITE {
        return Err(Error::Regular {
            message: format!(
                "the kernel has no integral: it grows like t^-{at_ends:.2}, where t is the distance of y from an end of its cell"
            ),
        });
    }
    let near = grading(exponent, dimension);
    let rows = GalerkinRows::new(&equation, own, [&rules[0], &rules[1]])?;
    let rows = rows.with_ends(&ends)?.with_grading(near);
    let width = cells * own;
    let mut kernel: Vec<f64> = buffer(width.saturating_mul(width))?;
    fill_rows(&mut kernel, own * width, |cell, row| {
        go_on(watch)?;
        match rows.fill(cell, row) {
            true => Ok(()),
            false => Err(Error::NotFinite {
                what: "the kernel".to_owned(),
            }),
        }
    })?;
    let source = || (0..cells).flat_map(|cell| rows.source(cell)).collect();
    let source: Vec<f64> = gathered(source);
    if !source.iter().all(|x| x.is_finite()) {
        return Err(Error::NotFinite {
            what: "the source".to_owned(),
        });
    }
    drop(rows);
    let near = match near > 1 {
        true => near,
        false => i32::from(gathered(|| is_rough(&equation))),
    };
    let measures: Vec<f64> = (0..cells).map(|cell| equation.measure(cell)).collect();
    let mut resolvent = Vec::new();
    let (correction, coarse, condition) = match coarse {
        Some(cut) => {
            let (factors, condition) = factors(&kernel, width, watch)?;
            let mut correction = factors.direct(source.clone());
            let values = correction.iter_mut().zip(&source);
            values.for_each(|(g, f)| *g -= f);
            let coarse = OnCoarse {
                cut: Box::new(cut),
                factors,
                share: 1.0,
            };
            (correction, Some(coarse), condition)
        }
        None => {
            let condition;
            (resolvent, condition) = inverse(&kernel, width, watch)?;
            let mut correction: Vec<f64> = buffer(width)?;
            fill_rows(&mut correction, 1, |row, out| {
                // (I − K')⁻¹ − I.
                if let Some(own) = resolvent.get(row * width..(row + 1) * width) {
                    let all: f64 = own.iter().zip(&source).map(|(r, f)| r * f).sum();
                    out.fill(all - source[row]);
                }
                Ok::<(), Error>(())
            })?;
            (correction, None, condition)
        }
    };
    for (row, numbers) in resolvent.chunks_exact_mut(width).enumerate() {
        numbers[row] -= 1.0;
        for (block, measure) in numbers.chunks_exact_mut(own).zip(&measures) {
            block.iter_mut().for_each(|r| *r /= measure);
        }
    }
    for numbers in kernel.chunks_exact_mut(width) {
        for (block, measure) in numbers.chunks_exact_mut(own).zip(&measures) {
            block.iter_mut().for_each(|k| *k /= measure);
        }
    }
    let nothing = ResolventLooks::default();
    let mut cut = Cut {
        equation,
        functions: own,
        measures,
        kernel,
        resolvent,
        coarse,
        source,
        correction,
        looks: nothing,
        condition,
        near: vec![near; cells],
        ends,
        rules,
    };
    (cut.looks, cut.near) = cut.look(watch)?;
    let all = cut.difference();
    if let Some(coarse) = &mut cut.coarse {
        let share = all / coarse.cut.difference();
        // Written so that NaN is 1.
        coarse.share = match share < 1.0 {
            true => share.max(f64::EPSILON),
            false => 1.0,
        };
        cut.looks.radius = coarse.cut.looks.radius;
    }
    Ok(cut)
}

impl<'k> Cut<'k> {
    pub(super) fn resolvent(&self) -> Resolvent<'_, Grid<AnyRegular<'k>>> {
        Resolvent {
            equation: &self.equation,
            tables: self.tables(),
            coarse: self.coarse.as_ref().map(|coarse| Coarse {
                equation: &coarse.cut.equation,
                tables: coarse.cut.tables(),
                share: coarse.share,
            }),
        }
    }

    /// ∫∫ |D(x, y) g(y)| over all pairs, about.
    fn difference(&self) -> f64 {
        let all = self.looks.stays.iter().zip(&self.measures);
        all.map(|(stay, measure)| stay * measure).sum()
    }

    pub(super) fn tables(&self) -> ResolventTables<'_> {
        ResolventTables {
            functions: self.functions,
            measures: &self.measures,
            kernel: &self.kernel,
            resolvent: &self.resolvent,
            source: &self.source,
            correction: &self.correction,
            steps: &self.looks.steps,
            stays: &self.looks.stays,
            jumps: &self.looks.jumps,
            near: &self.near,
            ends: &self.ends,
        }
    }

    /// How large K − K_n is, and how points draw near within cells.
    fn look(&self, watch: &dyn Observer) -> Result<(ResolventLooks, Vec<i32>), Error> {
        let resolvent = self.resolvent();
        let cells = self.measures.len();
        let mut rows = vec![(1, vec![0.0; cells]); cells];
        fill_rows(&mut rows, 1, |cell, rows| {
            go_on(watch)?;
            for (near, row) in rows {
                *near = resolvent.look_at_pairs(cell, row);
            }
            Ok::<(), Error>(())
        })?;
        let (near, differences): (Vec<i32>, Vec<Vec<f64>>) = rows.into_iter().unzip();
        let differences = differences.concat();
        let looks = gathered(|| resolvent.looks(differences.clone()))?;
        Ok((looks, near))
    }

    /// What a goal asks for, with its coefficients (ψ, Φ).
    pub(super) fn ask(&self, region: &Region) -> Result<Asked<'_>, Error> {
        let resolvent = self.resolvent();
        let (width, own) = (self.source.len(), self.functions);
        let functional = self.equation.equation().functional(region)?;
        let mut moments = vec![0.0; width];
        let mut asked = Asked {
            weights: vec![0.0; width],
            known: 0.0,
            size: 0.0,
            point: None,
            rest: None,
        };
        let mut rest = None;
        let all: f64 = self.measures.iter().sum();
        match functional {
            Functional::Point(point) => {
                let x = resolvent.locate(point);
                let to = moments.iter_mut().skip(x.cell * own).take(own);
                to.zip(x.functions).for_each(|(to, psi)| *to = psi);
                asked.known = self.equation.source(&point).to_f64();
                asked.size = asked.known.abs();
                asked.point = Some(x);
            }
            Functional::Mean => {
                let first = moments.iter_mut().step_by(own);
                first
                    .zip(&self.measures)
                    .for_each(|(to, measure)| *to = measure / all);
            }
            Functional::Weight(weight) => {
                let [left, right] = &self.rules;
                let rows = GalerkinRows::new(&self.equation, own, [left, right])?;
                let rows = rows.with_ends(&self.ends)?;
                let cells = moments.chunks_exact_mut(own).zip(&self.measures);
                for (cell, (to, measure)) in cells.enumerate() {
                    let means = rows.means(cell, &*weight);
                    to.iter_mut()
                        .zip(means)
                        .for_each(|(to, mean)| *to = measure * mean);
                }
                rest = Some(weight);
            }
        }
        for (row, moment) in self.resolvent.chunks_exact(width).zip(&moments) {
            if *moment != 0.0 {
                let to = asked.weights.iter_mut().zip(row);
                to.for_each(|(w, r)| *w += moment * r);
            }
        }
        let measure = |unknown: usize| self.measures[unknown / own];
        if let Some(coarse) = &self.coarse {
            asked.weights = coarse.factors.transposed(moments.clone());
            for (unknown, (w, moment)) in asked.weights.iter_mut().zip(&moments).enumerate() {
                *w = (*w - moment) / measure(unknown);
            }
        }
        if asked.point.is_none() {
            for (unknown, (w, moment)) in asked.weights.iter_mut().zip(&moments).enumerate() {
                *w += moment / measure(unknown);
            }
        }
        let terms = self.source.iter().zip(&asked.weights).enumerate();
        asked.known += terms
            .map(|(unknown, (f, w))| measure(unknown) * f * w)
            .sum::<f64>();
        let solution = self.correction.iter().zip(&self.source);
        asked.size += moments
            .iter()
            .zip(solution)
            .map(|(moment, (g, f))| moment.abs() * (g.abs() + f.abs()))
            .sum::<f64>();
        asked.rest = rest.map(|weight| {
            let coefficients = moments.iter().enumerate();
            Rest {
                weight,
                polynomial: coefficients
                    .map(|(unknown, m)| m / measure(unknown))
                    .collect(),
            }
        });
        Ok(asked)
    }
}

/// What a goal asks for.
pub(super) struct Asked<'c> {
    /// w, and the coefficients of the functional itself unless it is a point.
    pub(super) weights: Vec<f64>,
    /// The part that takes no walks.
    pub(super) known: f64,
    /// The sum of the sizes of its terms.
    pub(super) size: f64,
    pub(super) point: Option<CellPoint<AnyPoint>>,
    pub(super) rest: Option<Rest<'c>>,
}

/// A weight, and its polynomials.
pub(super) struct Rest<'c> {
    pub(super) weight: PointWeight<'c, AnyPoint>,
    pub(super) polynomial: Vec<f64>,
}

impl ResolventCut for Cut<'_> {
    fn figures(&self) -> ResolventFigures {
        let unknowns = self.source.len();
        ResolventFigures {
            unknowns,
            radius: self.looks.radius,
            first_radius: self.looks.radius * self.coarse.as_ref().map_or(1.0, |own| own.share),
            condition: self.condition,
            // Sums of so many terms round like the root of their number (Higham and Mary 2019).
            rounding: self.condition * f64::EPSILON * (unknowns as f64).sqrt(),
        }
    }

    fn has_images(&self) -> bool {
        self.coarse.is_none() && scored(self.equation.dimension(), self.functions).is_some()
    }

    fn walks<'c>(
        &'c self,
        goals: &[Goal],
        by: ByImages,
    ) -> Result<Box<dyn ResolventWalks + 'c>, Error> {
        let images = by.map(|by| -> Result<_, Error> {
            let maker = ImageMaker::new(self, by)?;
            let every = goals.len().div_ceil(MOST_LOOKS).max(1);
            let looks = goals.iter().step_by(every).map(|goal| &goal.region);
            Ok(Imaging {
                looks: maker.imaged(&looks.collect::<Vec<_>>())?,
                blocks: Blocks::new(self.measures.len(), maker.scored)?,
                maker,
            })
        });
        let images = images.transpose()?;
        let own = if images.is_some() { &[] } else { goals };
        let asked = own.iter().map(|goal| self.ask(&goal.region));
        let asked = asked.collect::<Result<Vec<_>, Error>>()?;
        let looks = images.iter().flat_map(|images| &images.looks);
        let scored = images
            .as_ref()
            .map_or(self.functions, |images| images.maker.scored);
        let weights = looks
            .map(|own| &own.weights)
            .chain(asked.iter().map(|own| &own.weights));
        let mut sizes = vec![0.0_f64; self.measures.len()];
        for own in weights {
            for (number, w) in own.chunks_exact(scored).enumerate() {
                let size = &mut sizes[number % self.measures.len()];
                *size = size.max(w.iter().map(|w| w * w).sum::<f64>().sqrt());
            }
        }
        let shared = Plan::shared(&self.looks, &self.tables(), (sizes, scored))?;
        let count = asked.len();
        let mut walks = Walks {
            cut: self,
            asked,
            images,
            strata: shared.strata(),
            shared,
            own: vec![0.0; count],
            gain: None,
            asked_points: 0.0,
            seen: vec![Vec::new(); count],
            sums: vec![Sums::default(); count],
            points: 0,
            steps: 0,
        };
        for goal in 0..count {
            let of_plan = |plan: Plan<'_, AnyPoint>| [plan.std_dev(), plan.strata()];
            let [std_dev, strata] = walks.with_plan(goal, |plan| plan.map_or([0.0; 2], of_plan))?;
            walks.own[goal] = std_dev;
            walks.strata += strata;
        }
        Ok(Box::new(walks))
    }

    fn field<'f>(self: Box<Self>, blocks: Blocks, by: (f64, u64)) -> Box<dyn GlobalField + 'f>
    where
        Self: 'f,
    {
        Box::new(ImageField {
            cut: self,
            blocks,
            by,
        })
    }
}
