//! A solved equation.

use fredholm_core::galerkin::{buffer, functions};
use fredholm_core::resolvent::{
    AxisNode, CellPoint, GalerkinRows, Plan, Regular, Resolvent, ResolventLooks, ResolventTables,
    grading, singularity,
};
use fredholm_core::{Located, Real};
use fredholm_rayon::{Observer, fill_rows};
use fredholm_variance::gauss;

use super::inverse::inverse;
use super::walks::{Sums, Walks};
use super::{Functional, RegularKind, ResolventEstimate};
use crate::{Error, Goal};

/// The exponent of |x − y| over d from which on a kernel is taken to have no integral.
const LEAST_INFINITE: f64 = 0.995;

/// What is known of a solved equation before any walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutFigures {
    /// N.
    pub unknowns: usize,
    /// The spectral radius of (1 + |R_n|)|K − K_n|.
    pub radius: f64,
    /// The condition number of I − K' in the maximum norm.
    pub condition: f64,
    /// The part of a value that rounding leaves unknown.
    pub rounding: f64,
}

/// A solved equation of any type.
pub trait ResolventCut: Sync {
    /// What is known before any walk.
    fn figures(&self) -> CutFigures;

    /// The walks of these goals.
    ///
    /// # Errors
    /// [`Error::Region`].
    fn walks<'c>(&'c self, goals: &[Goal]) -> Result<Box<dyn ResolventWalks + 'c>, Error>;
}

/// Walks of some goals.
pub trait ResolventWalks {
    /// The standard deviation of a point of what all goals share, and those of what every goal has for itself.
    fn std_devs(&self) -> (f64, Vec<f64>);

    /// The part of every goal that takes no walks.
    fn known(&self) -> Vec<f64>;

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

    /// The estimates so far.
    fn estimates(&self) -> Vec<ResolventEstimate>;

    /// The numbers of points and of steps beyond the first.
    fn counts(&self) -> [u64; 2];
}

/// A solved equation.
pub(super) struct Cut<'k, E: Regular, K> {
    pub(super) equation: E,
    pub(super) kind: &'k K,
    pub(super) functions: usize,
    pub(super) measures: Vec<f64>,
    pub(super) kernel: Vec<f64>,
    pub(super) resolvent: Vec<f64>,
    pub(super) source: Vec<f64>,
    pub(super) correction: Vec<f64>,
    pub(super) looks: ResolventLooks,
    pub(super) condition: f64,
    pub(super) near: Vec<i32>,
    pub(super) rules: [Vec<AxisNode>; 2],
}

/// Solves an equation with polynomials of a degree.
///
/// # Errors
/// [`Error::NotFinite`], [`Error::Regular`]: I − K' is singular. [`Error::Galerkin`]: memory.
pub fn cut_of<'k, E, K>(
    equation: E,
    kind: &'k K,
    degree: usize,
) -> Result<Box<dyn ResolventCut + 'k>, Error>
where
    E: Regular<Point: Send + Sync> + Sync + 'k,
    K: RegularKind<E>,
{
    let (cells, own) = (equation.cells(), functions(E::DIMENSION, degree));
    let rule = |points: usize| -> Result<Vec<AxisNode>, Error> {
        let nodes = gauss(points)?.into_iter();
        let node = |(t, weight)| AxisNode {
            at: 0.5 * (1.0 + t),
            share: 0.5 * weight,
        };
        Ok(nodes.map(node).collect())
    };
    // Of one node more on the right: no two of them are the same.
    let rules = [rule(degree + 1)?, rule(degree + 2)?];
    let exponent = singularity(&equation);
    if exponent >= LEAST_INFINITE * E::DIMENSION as f64 {
        return Err(Error::Regular {
            message: format!(
                "the kernel has no integral: it grows like |x - y|^-{exponent:.2} at x = y"
            ),
        });
    }
    let near = grading(exponent, E::DIMENSION);
    let rows = GalerkinRows::new(&equation, own, [&rules[0], &rules[1]])?.with_grading(near);
    let width = cells * own;
    let mut kernel: Vec<f64> = buffer(width.saturating_mul(width))?;
    fill_rows(&mut kernel, own * width, |cell, row| {
        match rows.fill(cell, row) {
            true => Ok(()),
            false => Err(Error::NotFinite {
                what: "the kernel".to_owned(),
            }),
        }
    })?;
    let source: Vec<f64> = (0..cells).flat_map(|cell| rows.source(cell)).collect();
    if !source.iter().all(|x| x.is_finite()) {
        return Err(Error::NotFinite {
            what: "the source".to_owned(),
        });
    }
    drop(rows);
    let measures: Vec<f64> = (0..cells).map(|cell| equation.measure(cell)).collect();
    let (mut resolvent, condition) = inverse(&kernel, width)?;
    let mut correction: Vec<f64> = buffer(width)?;
    fill_rows(&mut correction, 1, |row, out| {
        // (I − K')⁻¹ − I.
        if let Some(own) = resolvent.get(row * width..(row + 1) * width) {
            let all: f64 = own.iter().zip(&source).map(|(r, f)| r * f).sum();
            out.fill(all - source[row]);
        }
        Ok::<(), Error>(())
    })?;
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
        kind,
        functions: own,
        measures,
        kernel,
        resolvent,
        source,
        correction,
        looks: nothing,
        condition,
        near: vec![near; cells],
        rules,
    };
    (cut.looks, cut.near) = cut.look()?;
    Ok(Box::new(cut))
}

impl<E, K> Cut<'_, E, K>
where
    E: Regular<Point: Send + Sync> + Sync,
    K: RegularKind<E>,
{
    pub(super) fn resolvent(&self) -> Resolvent<'_, E> {
        Resolvent {
            equation: &self.equation,
            tables: self.tables(),
        }
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
        }
    }

    /// How large K − K_n is, and how points draw near within cells.
    fn look(&self) -> Result<(ResolventLooks, Vec<i32>), Error> {
        let resolvent = self.resolvent();
        let cells = self.measures.len();
        let mut rows = vec![(1, vec![0.0; cells]); cells];
        fill_rows(&mut rows, 1, |cell, rows| {
            for (near, row) in rows {
                *near = resolvent.look_at_pairs(cell, row);
            }
            Ok::<(), Error>(())
        })?;
        let (near, differences): (Vec<i32>, Vec<Vec<f64>>) = rows.into_iter().unzip();
        Ok((resolvent.looks(differences.concat())?, near))
    }

    /// What a goal asks for, with its coefficients (ψ, Φ).
    fn ask(&self, goal: &Goal) -> Result<Asked<'_, E::Point>, Error> {
        let resolvent = self.resolvent();
        let (width, own) = (self.source.len(), self.functions);
        let functional = self.kind.functional(&self.equation, &goal.region)?;
        let mut moments = vec![0.0; width];
        let mut asked = Asked {
            weights: vec![0.0; width],
            known: 0.0,
            point: None,
            rest: None,
        };
        let mut rest = None;
        let all: f64 = self.measures.iter().sum();
        match functional {
            Functional::Point(point) => {
                let cell = self.equation.locate(&point);
                let mut t = vec![<E::Scalar as Real>::from_f64(0.0); E::DIMENSION];
                self.equation.parameters(&Located { point, cell }, &mut t);
                let t: Vec<f64> = t.into_iter().map(Real::to_f64).collect();
                let x = resolvent.located(cell, point, &t);
                let to = moments.iter_mut().skip(cell * own).take(own);
                to.zip(x.functions).for_each(|(to, psi)| *to = psi);
                asked.known = self.equation.source(&point).to_f64();
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
        if asked.point.is_none() {
            for (unknown, (w, moment)) in asked.weights.iter_mut().zip(&moments).enumerate() {
                *w += moment / measure(unknown);
            }
        }
        let terms = self.source.iter().zip(&asked.weights).enumerate();
        asked.known += terms
            .map(|(unknown, (f, w))| measure(unknown) * f * w)
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
pub(super) struct Asked<'c, P> {
    /// w, and the coefficients of the functional itself unless it is a point.
    pub(super) weights: Vec<f64>,
    /// The part that takes no walks.
    pub(super) known: f64,
    pub(super) point: Option<CellPoint<P>>,
    pub(super) rest: Option<Rest<'c, P>>,
}

/// A weight, and its polynomials.
pub(super) struct Rest<'c, P> {
    pub(super) weight: Box<dyn Fn(&P) -> f64 + Sync + 'c>,
    pub(super) polynomial: Vec<f64>,
}

impl<E, K> ResolventCut for Cut<'_, E, K>
where
    E: Regular<Point: Send + Sync> + Sync,
    K: RegularKind<E>,
{
    fn figures(&self) -> CutFigures {
        CutFigures {
            unknowns: self.source.len(),
            radius: self.looks.radius,
            condition: self.condition,
            rounding: self.condition * <E::Scalar as Real>::EPSILON.to_f64(),
        }
    }

    fn walks<'c>(&'c self, goals: &[Goal]) -> Result<Box<dyn ResolventWalks + 'c>, Error> {
        let asked = goals.iter().map(|goal| self.ask(goal));
        let asked = asked.collect::<Result<Vec<_>, Error>>()?;
        let mut sizes = vec![0.0_f64; self.measures.len()];
        for own in &asked {
            let cells = own.weights.chunks_exact(self.functions);
            for (size, w) in sizes.iter_mut().zip(cells) {
                *size = size.max(w.iter().map(|w| w * w).sum::<f64>().sqrt());
            }
        }
        let shared = Plan::shared(&self.looks, &self.tables(), sizes)?;
        let count = asked.len();
        let mut walks = Walks {
            cut: self,
            asked,
            shared,
            own: vec![0.0; count],
            seen: vec![Vec::new(); count],
            sums: vec![Sums::default(); count],
            points: 0,
            steps: 0,
        };
        for goal in 0..count {
            walks.own[goal] =
                walks.with_plan(goal, |plan| plan.map_or(0.0, |plan| plan.std_dev()))?;
        }
        Ok(Box::new(walks))
    }
}
