//! The variance of one functional.

use alloc::vec::Vec;
use fredholm_core::Estimator;
use fredholm_core::array::Each;

use fredholm_core::galerkin::{buffer, reserve};

use crate::matrix::{Matrix, along};
use crate::site::Moments;
use crate::sources::totals;
use crate::{Analysis, Node, Origin, Site, VarianceError};

/// The start of walks: a point or a density.
#[derive(Clone, Copy)]
pub enum Start<'a, P> {
    /// All in one point, with φ = 1.
    At(P),
    /// Walks start with a density.
    Density(&'a (dyn Fn(&P) -> Density + Sync)),
}

/// A functional in a point x, where walks start with a density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// Φ(x).
    pub functional: f64,
    /// φ(x)² p0(x).
    pub square: f64,
    /// p0(x).
    pub initial: f64,
    /// [`control_estimate`](fredholm_core::Functional::control_estimate) minus (v,Φ): 0 where runs know (v,Φ).
    pub fluctuation: f64,
    /// What a start in x knows of the score by itself: see [`Start`](fredholm_core::Start). 0 where that is nothing.
    pub known: f64,
}

impl Density {
    /// The density of a mean over a set of this measure, at its points.
    #[must_use]
    pub fn uniform(measure: f64) -> Self {
        let one = 1.0 / measure;
        Self {
            functional: one,
            square: one,
            initial: one,
            fluctuation: 0.0,
            known: 0.0,
        }
    }

    /// The density at a point where no walk starts.
    #[must_use]
    pub const fn nothing() -> Self {
        Self {
            functional: 0.0,
            square: 0.0,
            initial: 0.0,
            fluctuation: 0.0,
            known: 0.0,
        }
    }
}

impl<P> core::fmt::Debug for Start<'_, P> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::At(_) => "At",
            Self::Density(_) => "Density",
        })
    }
}

/// The parts of Var ζ: parts of E (η(k,f) − η(h,g))², which sum to it, the square of its mean, which is taken
/// off, and what comes of (v,Φ) not being known. A part may be negative, as differences of kernels and of sources may make up for each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// The sources differ: F ≠ G.
    pub sources: f64,
    /// The kernels differ on pairs in S.
    pub kernel: f64,
    /// Pairs left out of the neighbour equation.
    pub left_out: f64,
    /// ((u,Φ) − (v,Φ))².
    pub mean: f64,
    /// The part of the start: what stands for (v,Φ) depends on it.
    pub start: f64,
}

/// How much the steps between two sites, or the difference of the sources on one, add to Var ζ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// The site from which the steps start.
    pub from: usize,
    /// Into this site; `None` for the difference of the sources.
    pub into: Option<usize>,
    /// How much.
    pub variance: f64,
}

/// The predicted means and variances of a functional.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// (u,Φ), on the quadrature.
    pub solution: f64,
    /// (u,Φ) − (v,Φ): the error of the Galerkin solution.
    pub error: f64,
    /// Var η(k,f); `None` where it is infinite.
    pub plain: Option<f64>,
    /// Var ζ; `None` where it is infinite.
    pub preconditioned: Option<f64>,
    /// ‖φ²p0‖ in L1, and in L∞ where it is a function.
    pub norms: (f64, Option<f64>),
    sums: Sums,
    /// φ²p0 by sites, of starts with a density.
    pub(crate) own: Vec<f64>,
    /// The start, where it is one point, and the site in which it lies.
    pub(crate) start: Option<(usize, Site)>,
}

/// The sources of Var ζ, by kind and by place.
#[derive(Clone, Debug)]
pub struct Attribution {
    /// The parts of the variance.
    pub parts: Parts,
    /// The contribution of every pair of sites and of every site, the largest first; in sum Var ζ +
    /// ((u,Φ) − (v,Φ))², up to what comes of (v,Φ) not being known.
    pub contributions: Vec<Contribution>,
}

/// The expected sum of the squares of weights over the visits of every site: by what states, and by what steps from them add to
/// second moments. By roulette they differ.
struct Visits {
    states: Vec<f64>,
    steps: Vec<f64>,
}

impl Prediction {
    /// Says where Var ζ comes from, by the adjoint equation; `None` where it is infinite. O(n²) for n sites.
    ///
    /// # Errors
    /// [`VarianceError`]: no memory.
    pub fn attribute(&self, analysis: &Analysis<'_>) -> Result<Option<Attribution>, VarianceError> {
        if self.preconditioned.is_none() {
            return Ok(None);
        }
        let mut visits = self.visits(&analysis.sites)?;
        let [mut sources, mut kernel, mut left_out] = self.sums.parts;
        let Visits { states, steps } = &visits;
        for ((site, states), steps) in analysis.sites.iter().zip(states).zip(steps) {
            sources += states * site.mean(|x| x.parts[0]);
            kernel += steps * site.mean(|x| x.parts[1]);
            left_out += steps * site.mean(|x| x.parts[2]);
        }
        for visits in [&mut visits.states, &mut visits.steps] {
            for (visits, own) in visits.iter_mut().zip(&self.own) {
                *visits += own;
            }
        }
        // The adjoint sees means over sites, the variance itself what is in the nodes.
        let sum = sources + kernel + left_out;
        let scale = if sum > 0.0 {
            self.sums.squared / sum
        } else {
            1.0
        };
        let [sources, kernel, left_out] = [sources, kernel, left_out].each(|part| scale * part);
        Ok(Some(Attribution {
            parts: Parts {
                sources,
                kernel,
                left_out,
                mean: self.error * self.error,
                start: self.sums.start,
            },
            contributions: self.contributions(analysis, &visits, scale)?,
        }))
    }

    /// How often states are visited after the start.
    fn visits(&self, sites: &[Site]) -> Result<Visits, VarianceError> {
        // The masses after a step from the start, of which a point is no site.
        let first = |moment: fn(&Moments) -> f64| {
            let mut first = along(sites, &self.own, moment)?;
            if let Some((_, start)) = &self.start {
                for (first, moments) in first.iter_mut().zip(&start.row) {
                    *first += moment(moments);
                }
            }
            Ok::<_, VarianceError>(first)
        };
        // And after one from there, too.
        let with = |mut first: Vec<f64>, masses: &[f64], moment: fn(&Moments) -> f64| {
            for (first, mass) in first.iter_mut().zip(along(sites, masses, moment)?) {
                *first += mass;
            }
            Ok::<_, VarianceError>(first)
        };
        let later = Matrix::adjoint(sites, |m: &Moments| m.later).resolve(&first(|m| m.later)?)?;
        let steps = with(first(|m| m.next)?, &later, |m| m.next)?;
        let states = with(first(|m| m.kk)?, &steps, |m| m.kk)?;
        Ok(Visits { states, steps })
    }

    fn contributions(
        &self,
        analysis: &Analysis<'_>,
        visits: &Visits,
        scale: f64,
    ) -> Result<Vec<Contribution>, VarianceError> {
        let n = analysis.sites.len();
        let mut all = reserve(n.saturating_mul(n + 1))?;
        let visits = visits.states.iter().zip(&visits.steps);
        for (from, (site, (states, steps))) in analysis.sites.iter().zip(visits).enumerate() {
            let start = self.start.as_ref().filter(|(own, _)| *own == from);
            let start = start.map(|(_, start)| start);
            let of_start = start.map_or(0.0, |s| s.mean(|x| x.parts[0]));
            all.push(Contribution {
                from,
                into: None,
                variance: scale * (states * site.mean(|x| x.parts[0]) + of_start),
            });
            for (into, pair) in site.pairs.iter().enumerate() {
                let of_start = start.and_then(|s| s.pairs.get(into)).copied();
                all.push(Contribution {
                    from,
                    into: Some(into),
                    variance: scale * (steps * pair + of_start.unwrap_or(0.0)),
                });
            }
        }
        all.sort_unstable_by(|a, b| b.variance.total_cmp(&a.variance));
        Ok(all)
    }
}

impl Analysis<'_> {
    /// The variances of both estimates of a functional, by the number of its start in the model. (v,Φ) is taken as known,
    /// as runs have it for points, means and weights.
    ///
    /// # Errors
    /// [`VarianceError`].
    pub fn predict(&self, start: usize) -> Result<Prediction, VarianceError> {
        let origin = self.model.start(start);
        let origin = origin.ok_or(VarianceError::NoStart { start })?;
        let n = self.sites.len();
        let mut sums = Sums::default();
        let mut own = buffer(n)?;
        let (mut point, mut largest) = (None, None);
        match origin {
            Origin::Point { point: x, site } => {
                let begin = self.start(x)?;
                sums.add(self.estimator, &begin, &|_| Density::uniform(1.0));
                point = Some((site, begin));
            }
            Origin::Density => {
                let density = |node: &Node| self.model.density(start, node.point);
                let mut supremum = 0.0;
                for (site, own) in self.sites.iter().zip(&mut own) {
                    *own = sums.add(self.estimator, site, &density);
                    for node in &site.nodes {
                        supremum = f64::max(density(node).square, supremum);
                    }
                }
                largest = Some(supremum);
            }
        }
        let solution = sums.value + sums.error;
        Ok(Prediction {
            solution,
            error: sums.error,
            plain: self.kernel_power.map(|_| sums.plain - solution * solution),
            preconditioned: self
                .is_finite()
                .then_some(sums.squared + sums.start - sums.error * sums.error),
            norms: (sums.mass, largest),
            sums,
            own,
            start: point,
        })
    }
}

/// Integrals over the start.
#[derive(Clone, Debug, Default)]
struct Sums {
    /// (v,Φ), with what is known.
    value: f64,
    /// (e,Φ).
    error: f64,
    /// (w,φ²p0).
    squared: f64,
    /// E d² + 2 E φ d Δ, where d is the fluctuation.
    start: f64,
    /// (E η², φ²p0).
    plain: f64,
    /// The parts of the source of w.
    parts: [f64; 3],
    /// ∫ φ²p0.
    mass: f64,
}

impl Sums {
    /// Adds a site; ∫ φ²p0 over it.
    fn add(
        &mut self,
        estimator: Estimator,
        site: &Site,
        density: &dyn Fn(&Node) -> Density,
    ) -> f64 {
        let mut mass = 0.0;
        for node in &site.nodes {
            let at = density(node);
            let [functional, square] = [at.functional, at.square].each(|phi| node.weight * phi);
            let twice = node.weight * at.initial * at.fluctuation + 2.0 * functional * node.error;
            self.start += at.fluctuation * twice;
            self.value += functional * node.value;
            self.error += functional * node.error;
            let [plain, squared] = totals(estimator, node);
            self.squared += square * squared;
            self.plain += square * plain;
            let initial = node.weight * at.initial;
            let known = at.known;
            self.value += initial * known;
            // E (φ η + what is known)² beyond E (φ η)².
            self.plain += known * (2.0 * functional * (node.value + node.error) + initial * known);
            for (sum, part) in self.parts.iter_mut().zip(node.parts) {
                *sum += square * part;
            }
            mass += square;
        }
        self.mass += mass;
        mass
    }
}
