//! Quadrature on the circle, to predict variances with.

use alloc::vec::Vec;
use core::f64::consts::TAU;

use fredholm_core::galerkin::{GalerkinError, reserve};
use fredholm_core::{StateSpace, TransitionDensity};
use fredholm_variance::{AllowedKinds, Quadrature, Step, gauss};

use crate::{Circle, Emission, Point};

/// Sites of equal arcs: parts of cells where there are few cells, groups of them where there are many, of which the
/// one in the middle stands for all others, except for steps within the group.
///
/// ```
/// use fredholm_circle::{Circle, CircleQuadrature, Harmonic, Tables};
/// use fredholm_core::{Estimator, Form};
/// use fredholm_core::galerkin::{DiagonalRule, PairKind};
/// use fredholm_variance::{Analysis, Start, VarianceSetup, serially};
///
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// let tables = Tables::<f64>::new(&[0.3, 0.7], 100)?;
/// let circle = Circle::new(tables.cells(), light, 0.2)?;
/// let pairs = DiagonalRule { diagonal: PairKind::Pointwise };
/// let solution = circle.solve(1e-14, 1000)?;
/// let vectors = solution.for_walks(&circle, pairs)?;
/// let neighbour = vectors.with_pointwise(&circle, &circle)?;
///
/// // √Var of walks from s = 1, before there is one.
/// let quadrature = CircleQuadrature::new(&circle, 800, 0)?;
/// let starts = [Start::At(circle.point(1.0))];
/// let setup =
///     VarianceSetup { equation: &circle, neighbour: &neighbour, pairs, quadrature: &quadrature, galerkin: None };
/// let model = setup.with_starts(&starts)?;
/// let predicted = Analysis::new(&model, Estimator::Absorption, Form::Product, &serially)?.predict(0)?;
/// let [plain, best] = [predicted.plain, predicted.preconditioned].map(|v| v.unwrap().sqrt());
/// assert!(30.0 * best < plain && plain < 60.0 * best);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct CircleQuadrature<'c, 'a, E> {
    circle: &'c Circle<'a, f64, E>,
    sites: usize,
    rule: Vec<(f64, f64)>,
    /// The nodes of all sites: point and weight, which sum to the arc's length.
    nodes: Vec<(Point<f64>, f64)>,
}

impl<'c, 'a, E: Emission<f64>> CircleQuadrature<'c, 'a, E> {
    /// The quadrature with about `nodes` nodes at most, for a neighbour equation of this degree.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new(
        circle: &'c Circle<'a, f64, E>,
        nodes: usize,
        degree: usize,
    ) -> Result<Self, GalerkinError> {
        let cells = circle.table().len();
        let sites = nodes / (degree + 2);
        let sites = if sites >= cells {
            cells.saturating_mul(sites / cells)
        } else {
            // The number of cells in a site divides n.
            let least = cells.div_ceil(sites.max(1));
            cells
                / (least..=cells)
                    .find(|group| cells.is_multiple_of(*group))
                    .unwrap_or(cells)
        };
        let rule = gauss(degree + 2)?;
        let mut nodes = reserve(sites.saturating_mul(rule.len()))?;
        let width = TAU / sites as f64;
        let part = TAU / cells.max(sites) as f64;
        let group = (cells / sites).max(1);
        for site in 0..sites {
            let start = site as f64 * width + (group / 2) as f64 * part;
            nodes.extend(rule.iter().map(|&(t, weight)| {
                (
                    circle.point(start + part * 0.5 * (1.0 + t)),
                    width * 0.5 * weight,
                )
            }));
        }
        Ok(Self {
            circle,
            sites,
            rule,
            nodes,
        })
    }

    /// The kinds that a pair of cells may have: all. An exact integral costs 0.05 to 0.07 of a
    /// state at every degree (`cargo bench -p fredholm-benches --bench pairs`).
    ///
    /// ```
    /// # use fredholm_circle::{Circle, CircleQuadrature, Harmonic, Tables};
    /// # use fredholm_core::{Estimator, Form};
    /// # use fredholm_core::galerkin::{DiagonalRule, PairKind, PairTable};
    /// # use fredholm_variance::{Analysis, PairCosts, Start, VarianceSetup, serially};
    /// # let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
    /// # let tables = Tables::<f64>::new(&[0.3, 0.7], 20)?;
    /// # let circle = Circle::new(tables.cells(), light, 0.2)?;
    /// # let solution = circle.solve(1e-14, 1000)?;
    /// # let quadrature = CircleQuadrature::new(&circle, 160, 0)?;
    /// # let starts = [Start::At(circle.point(1.0))];
    /// // A neighbour equation on 20 cells with all pairs in S, and its variance from s = 1.
    /// let pairs = DiagonalRule { diagonal: PairKind::Galerkin };
    /// let vectors = solution.for_walks(&circle, pairs)?;
    /// let neighbour = vectors.piecewise(&circle, &circle)?;
    /// let setup = VarianceSetup {
    ///     equation: &circle,
    ///     neighbour: &neighbour,
    ///     pairs,
    ///     quadrature: &quadrature,
    ///     galerkin: Some(&neighbour),
    /// };
    /// let model = setup.with_starts(&starts)?;
    /// let analysis = Analysis::new(&model, Estimator::Absorption, Form::Product, &serially)?;
    /// let predictions = [analysis.predict(0)?];
    ///
    /// // Better pairs, for variance × work.
    /// let allowed = |_, _| quadrature.allowed_kinds();
    /// let terms = PairCosts { cells: 20, allowed: &allowed };
    /// let before = analysis.figure_of_merit(&predictions, &terms)?;
    /// let chosen = analysis.choose(&predictions, &terms, &serially)?;
    /// assert!(chosen.variance * chosen.work < 0.8 * before.work);
    ///
    /// // The neighbour equation with these.
    /// let pairs = PairTable::new(&chosen.table, 20)?;
    /// let vectors = solution.for_walks(&circle, pairs)?;
    /// let better = vectors.with_pointwise(&circle, &circle)?;
    /// # let setup = VarianceSetup { equation: &circle, neighbour: &better, pairs, quadrature: &quadrature, galerkin: None };
    /// # let model = setup.with_starts(&starts)?;
    /// # let analysis = Analysis::new(&model, Estimator::Absorption, Form::Product, &serially)?;
    /// # let predictions = [analysis.predict(0)?];
    /// # assert!(analysis.figure_of_merit(&predictions, &terms)?.relative_to(&before) < 0.8);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    #[must_use]
    pub const fn allowed_kinds(&self) -> AllowedKinds {
        AllowedKinds {
            galerkin: true,
            pointwise: Some(0.06),
            left_out: true,
        }
    }

    fn of_site(&self, site: usize) -> &[(Point<f64>, f64)] {
        let points = self.rule.len();
        self.nodes
            .get(site * points..(site + 1) * points)
            .unwrap_or(&[])
    }

    /// Steps from x into an arc, by the rule on it.
    fn arc(&self, x: &Point<f64>, from: f64, to: f64, visit: &mut impl FnMut(Step<Point<f64>>)) {
        let half = 0.5 * (to - from);
        for &(t, weight) in &self.rule {
            let point = self.circle.point(from + half * (1.0 + t));
            let weight = half * weight * self.circle.density(x, &point);
            visit(Step {
                point,
                weight,
                node: None,
            });
        }
    }
}

impl<E: Emission<f64>> StateSpace for CircleQuadrature<'_, '_, E> {
    type Scalar = f64;
    type Point = Point<f64>;
}

impl<E: Emission<f64>> Quadrature for CircleQuadrature<'_, '_, E> {
    fn sites(&self) -> usize {
        self.sites
    }

    fn locate(&self, x: &Point<f64>) -> usize {
        let cells = self.circle.table().len();
        if cells >= self.sites {
            return x.cell() / (cells / self.sites).max(1);
        }
        let parts = self.sites / cells;
        let part = x.angle() * self.sites as f64 / TAU - (x.cell() * parts) as f64;
        x.cell() * parts + (part.max(0.0) as usize).min(parts - 1)
    }

    fn nodes(&self, site: usize, mut visit: impl FnMut(Point<f64>, f64)) {
        for &(point, weight) in self.of_site(site) {
            visit(point, weight);
        }
    }

    /// The density has a kink in y = x, where arcs are divided.
    fn steps(&self, x: &Point<f64>, site: usize, mut visit: impl FnMut(Step<Point<f64>>)) {
        // The angle takes longer than many steps, and is not needed in other cells.
        let parts = (self.sites / self.circle.table().len()).max(1);
        let other = parts > 1 && site / parts != x.cell();
        if other || self.locate(x) != site {
            for (node, &(point, weight)) in self.of_site(site).iter().enumerate() {
                let weight = weight * self.circle.density(x, &point);
                visit(Step {
                    point,
                    weight,
                    node: Some(node),
                });
            }
            return;
        }
        let cells = self.circle.table().len();
        let part = TAU / cells.max(self.sites) as f64;
        let group = (cells / self.sites).max(1);
        let angle = x.angle();
        for arc in site * group..(site + 1) * group {
            let (from, to) = (arc as f64 * part, (arc + 1) as f64 * part);
            if from < angle && angle < to {
                self.arc(x, from, angle, &mut visit);
                self.arc(x, angle, to, &mut visit);
            } else {
                self.arc(x, from, to, &mut visit);
            }
        }
    }
}
