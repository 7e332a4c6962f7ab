//! The equations of the variance, filled and solved.

use alloc::vec::Vec;
use core::fmt;

use super::{Level, Moments, Node, Site};
use crate::galerkin::{
    GalerkinError, GalerkinMatrix, PairKind, Pairs, Sweeps, buffer, gauss_seidel, reserve,
};
use crate::{Estimator, Kernel, Located, Neighbour, Real, Sampler, Source};

/// The largest power of an operator that is looked at.
pub(super) const POWERS: u32 = 1000;
/// The equations of the variance are solved to this share of their largest source.
const TOLERANCE: f64 = 1e-12;
const SWEEPS: u32 = 10_000;

/// Why there is no prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VarianceError {
    /// The level has no sites.
    Empty,
    /// A coefficient that involves this site is infinite or NaN.
    NotFinite {
        /// The number of the site.
        site: usize,
    },
    /// No memory, or an iteration that diverges: the mean of the walks does not exist.
    Galerkin(GalerkinError),
    /// Pairs of cells cannot be told apart: a site is more than one cell.
    Coarse {
        /// The number of a cell that has no site.
        cell: usize,
    },
    /// The variance is infinite.
    Infinite,
}

impl fmt::Display for VarianceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(
                f,
                "a level without sites predicts nothing; it needs at least one"
            ),
            Self::NotFinite { site } => write!(
                f,
                "kernel, source or neighbour equation is not finite at a node of site {site} or in a step from it"
            ),
            Self::Galerkin(error) => error.fmt(f),
            Self::Coarse { cell } => write!(
                f,
                "cell {cell} has no site of its own: pairs of cells cannot be told apart; more nodes are needed"
            ),
            Self::Infinite => f.write_str(
                "the variance of the walks is infinite: there is nothing to choose pairs by",
            ),
        }
    }
}

impl core::error::Error for VarianceError {}

impl From<GalerkinError> for VarianceError {
    fn from(error: GalerkinError) -> Self {
        Self::Galerkin(error)
    }
}

/// What the variance is of: an equation, its neighbour, and where integrals are taken.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a, E, N: ?Sized, S, L> {
    /// The equation with its chain.
    pub equation: &'a E,
    /// The neighbour equation.
    pub neighbour: &'a N,
    /// The pairs of the neighbour equation, to tell what is in S.
    pub pairs: S,
    /// The sites.
    pub level: &'a L,
}

/// A power whose norm is below 1, as (13) of Heinrich 1995 asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// n0: the smallest one.
    pub exponent: u32,
    /// γ: the norm of that power in L∞.
    pub norm: f64,
}

/// The solved equations of the variance, on the sites of a level.
#[derive(Clone, Debug)]
pub struct Analysis<P> {
    /// Of which estimator.
    pub estimator: Estimator,
    /// The sites.
    pub sites: Vec<Site<P>>,
    /// ‖T_k²p^m‖ < 1 for this m, or none: plain walks have no variance then.
    pub kernel_power: Option<Power>,
    /// ‖T_h²p^m‖ < 1 for this m, or none: preconditioned walks have no variance then.
    pub neighbour_power: Option<Power>,
    pub(super) means: Means,
}

/// Means over sites.
#[derive(Clone, Debug, Default)]
pub(super) struct Means {
    /// e.
    pub(super) error: Vec<f64>,
    /// s and c.
    pub(super) seconds: Vec<[f64; 2]>,
    /// E η(k,f)² and w.
    pub(super) totals: Vec<[f64; 2]>,
}

/// What is done to every one of a number of things, sites above all, by its number.
pub type Pass<'a, T> = dyn Fn(usize, &mut T) + Sync + 'a;

/// Values in all nodes, and in the mean over sites.
pub(super) struct Nodal<'a, T> {
    means: &'a [T],
    first: Vec<usize>,
    nodes: Vec<T>,
}

impl<'a, T: Copy + Default> Nodal<'a, T> {
    pub(super) fn new<P>(
        sites: &[Site<P>],
        means: &'a [T],
        value: impl Fn(&Node<P>) -> T,
    ) -> Result<Self, GalerkinError> {
        let count = sites.iter().map(|site| site.nodes.len()).sum();
        let (mut first, mut nodes) = (buffer(sites.len())?, reserve(count)?);
        for (first, site) in first.iter_mut().zip(sites) {
            *first = nodes.len();
            nodes.extend(site.nodes.iter().map(&value));
        }
        Ok(Self {
            means,
            first,
            nodes,
        })
    }

    #[inline]
    pub(super) fn at(&self, site: usize, node: Option<usize>) -> Option<T> {
        let of_node = node.and_then(|node| self.nodes.get(self.first.get(site)? + node));
        of_node.or_else(|| self.means.get(site)).copied()
    }
}

/// s and c.
pub(super) type Seconds<'a> = Nodal<'a, [f64; 2]>;

/// One of the moments between sites as a matrix.
pub(super) struct Matrix<'a, P> {
    sites: &'a [Site<P>],
    // A pointer: one matrix, and one solver, for all moments.
    moment: fn(&Moments) -> f64,
    transposed: bool,
}

impl<P> GalerkinMatrix for Matrix<'_, P> {
    type Scalar = f64;

    fn cells(&self) -> usize {
        self.sites.len()
    }

    fn functions(&self) -> usize {
        1
    }

    #[inline]
    fn entry(&self, [i, _]: [usize; 2], [j, _]: [usize; 2]) -> f64 {
        let (i, j) = if self.transposed { (j, i) } else { (i, j) };
        let moments = self.sites.get(i).and_then(|site| site.row.get(j));
        moments.map_or(f64::NAN, self.moment)
    }
}

impl<'a, P> Matrix<'a, P> {
    pub(super) const fn new(sites: &'a [Site<P>], moment: fn(&Moments) -> f64) -> Self {
        Self {
            sites,
            moment,
            transposed: false,
        }
    }

    /// Of the adjoint operator, acting on masses of sites.
    pub(super) const fn adjoint(sites: &'a [Site<P>], moment: fn(&Moments) -> f64) -> Self {
        Self {
            sites,
            moment,
            transposed: true,
        }
    }

    /// The solution of x = Ax + b.
    pub(super) fn resolve(&self, source: &[f64]) -> Result<Vec<f64>, GalerkinError> {
        let largest = source.iter().fold(0.0, |m: f64, b| Real::max(m, b.abs()));
        let mut x = buffer(source.len())?;
        x.copy_from_slice(source);
        let sweeps = Sweeps::UntilResidual {
            residual: TOLERANCE * largest,
            at_most: SWEEPS,
        };
        gauss_seidel(self, source, &mut x, &mut [0.0; 2], sweeps)?;
        Ok(x)
    }

    /// The smallest power whose norm is below 1: ‖A^m‖ = max A^m 1, where A has no negative entries.
    fn contracting_power(&self) -> Result<Option<Power>, GalerkinError> {
        let (mut w, mut next) = (buffer(self.sites.len())?, buffer(self.sites.len())?);
        w.fill(1.0);
        for exponent in 1..=POWERS {
            self.apply(&w, &mut next);
            let norm = next.iter().fold(0.0, |m: f64, x| Real::max(m, *x));
            if norm < 1.0 {
                return Ok(Some(Power { exponent, norm }));
            }
            if !(norm < 1e100) {
                break;
            }
            core::mem::swap(&mut w, &mut next);
        }
        Ok(None)
    }
}

impl<E, N, S, L> Setting<'_, E, N, S, L>
where
    E: Sampler<Scalar = f64, Point = L::Point> + Kernel + Source,
    N: Neighbour<Scalar = f64, Point = L::Point> + ?Sized,
    S: Pairs,
    L: Level,
{
    /// Takes all integrals and solves the equations, for one estimator.
    ///
    /// `run` calls the function that it is given for every site with its number, in any order and by as many threads as it
    /// likes: sites are independent, and so the bits do not depend on it. [`serially`] does it on this thread.
    ///
    /// O(n²) evaluations of k five times and of h three times for n nodes, and 56 bytes for each pair of sites.
    ///
    /// # Errors
    /// [`VarianceError`].
    pub fn analyse(
        &self,
        estimator: Estimator,
        run: impl Fn(&mut [Site<L::Point>], &Pass<'_, Site<L::Point>>),
    ) -> Result<Analysis<L::Point>, VarianceError>
    where
        Self: Sync,
    {
        let count = self.level.sites();
        if count == 0 {
            return Err(VarianceError::Empty);
        }
        let mut sites: Vec<Site<L::Point>> = reserve(count)?;
        sites.resize_with(count, Site::default);
        for site in &mut sites {
            site.row = buffer(count)?;
            site.pairs = buffer(count)?;
        }
        run(&mut sites, &|i, site| self.integrate(i, site));
        check(&sites, |site| {
            site.row
                .iter()
                .all(|m| (m.k + m.kk + m.kh + m.hh + m.hd).is_finite())
                && site
                    .nodes
                    .iter()
                    .all(|x| (x.residual + x.value).is_finite())
        })?;
        let matrix = Matrix::new(&sites, |m: &Moments| m.kk);
        let kernel_power = matrix.contracting_power()?;
        let matrix = Matrix::new(&sites, |m: &Moments| m.hh);
        let neighbour_power = matrix.contracting_power()?;
        let mut analysis = Analysis {
            estimator,
            sites,
            kernel_power,
            neighbour_power,
            means: Means::default(),
        };
        analysis.means.error = analysis.errors()?;
        self.refine_errors(&mut analysis, &run)?;
        if kernel_power.is_some() {
            if neighbour_power.is_some() {
                self.square_sources(&mut analysis, &run)?;
            }
            self.resolve_totals(&mut analysis, &run)?;
        }
        Ok(analysis)
    }

    /// E η(k,f)² and w: in the mean over sites, and then in the nodes by T_k²p of what is known there.
    fn resolve_totals(
        &self,
        analysis: &mut Analysis<L::Point>,
        run: &impl Fn(&mut [Site<L::Point>], &Pass<'_, Site<L::Point>>),
    ) -> Result<(), VarianceError>
    where
        Self: Sync,
    {
        let estimator = analysis.estimator;
        let rough = analysis.rough_totals()?;
        for site in &mut analysis.sites {
            let reflected = [0, 1].map(|k| {
                let of = site.row.iter().zip(&rough);
                of.map(|(m, totals)| m.kk * totals[k]).sum::<f64>()
            });
            for node in &mut site.nodes {
                let [plain, squared] = total_sources(estimator, node);
                node.totals = [plain + reflected[0], squared + reflected[1]];
            }
        }
        let means = analysis.mean_totals()?;
        let totals = Nodal::new(&analysis.sites, &means, |node| node.totals)?;
        run(&mut analysis.sites, &|_, site| {
            for node in &mut site.nodes {
                node.totals = self.totals(estimator, node, &totals);
            }
        });
        analysis.means.totals = analysis.mean_totals()?;
        Ok(())
    }

    /// The sources of E η(k,f)² and of w, and T_k²p of both, in a node.
    fn totals(
        &self,
        estimator: Estimator,
        node: &Node<L::Point>,
        totals: &Nodal<'_, [f64; 2]>,
    ) -> [f64; 2] {
        let [mut plain, mut squared] = total_sources(estimator, node);
        for j in 0..self.level.sites() {
            self.level.steps(&node.x.point, j, |step| {
                let k = self.equation.kernel(&node.x.point, &step.point);
                let of_y = totals.at(j, step.node).unwrap_or([f64::NAN; 2]);
                plain += step.weight * k * k * of_y[0];
                squared += step.weight * k * k * of_y[1];
            });
        }
        [plain, squared]
    }

    /// e once more, by T_kp of what is known of it in the nodes: its mean over a site is of second order in the size of a
    /// site, and so is what its first order makes of the variation of k.
    fn refine_errors(
        &self,
        analysis: &mut Analysis<L::Point>,
        run: &impl Fn(&mut [Site<L::Point>], &Pass<'_, Site<L::Point>>),
    ) -> Result<(), VarianceError>
    where
        Self: Sync,
    {
        let means = core::mem::take(&mut analysis.means.error);
        let errors = Nodal::new(&analysis.sites, &means, |node| node.error)?;
        run(&mut analysis.sites, &|_, site| {
            for node in &mut site.nodes {
                node.error = self.error(node, &errors);
            }
        });
        analysis.means.error = collect(&analysis.sites, |site| site.mean(|x| x.error))?;
        Ok(())
    }

    /// r + T_kp e in a node.
    fn error(&self, node: &Node<L::Point>, errors: &Nodal<'_, f64>) -> f64 {
        let mut error = node.residual;
        for j in 0..errors.means.len() {
            self.level.steps(&node.x.point, j, |step| {
                let k = self.equation.kernel(&node.x.point, &step.point);
                error += step.weight * k * errors.at(j, step.node).unwrap_or(f64::NAN);
            });
        }
        error
    }

    /// s, c and the source of w.
    fn square_sources(
        &self,
        analysis: &mut Analysis<L::Point>,
        run: &impl Fn(&mut [Site<L::Point>], &Pass<'_, Site<L::Point>>),
    ) -> Result<(), VarianceError>
    where
        Self: Sync,
    {
        analysis.means.seconds = analysis.seconds()?;
        let means = core::mem::take(&mut analysis.means);
        let estimator = analysis.estimator;
        run(&mut analysis.sites, &|_, site| {
            for node in &mut site.nodes {
                self.second(estimator, &means, node);
            }
        });
        let seconds = Nodal::new(&analysis.sites, &means.seconds, seconds_of)?;
        run(&mut analysis.sites, &|_, site| {
            self.square(estimator, &seconds, site);
        });
        analysis.means = means;
        Ok(())
    }

    /// Nodes and integrals of a site.
    fn integrate(&self, i: usize, site: &mut Site<L::Point>) {
        self.level.nodes(i, |x, weight| {
            let node = self.meet(x, weight, &mut site.row, &mut site.largest);
            site.nodes.push(node);
            site.measure += weight;
        });
        for moments in &mut site.row {
            *moments = moments.scaled(1.0 / site.measure);
        }
    }

    /// What is to be known of a point, and its steps into every site, times the weight.
    fn meet(
        &self,
        point: L::Point,
        weight: f64,
        row: &mut [Moments],
        largest: &mut [f64; 3],
    ) -> Node<L::Point> {
        let x = self.neighbour.locate(point);
        let mut node = Node {
            x,
            weight,
            absorption: self.equation.absorption(&x.point),
            source: self.equation.source(&x.point),
            neighbour_source: self.neighbour.source(&x),
            value: self.neighbour.value(&x),
            residual: 0.0,
            delta: 0.0,
            squares: [0.0; 2],
            error: 0.0,
            second: 0.0,
            mixed: 0.0,
            parts: [0.0; 3],
            totals: [f64::NAN; 2],
        };
        let mut step_residual = 0.0;
        for (j, moments) in row.iter_mut().enumerate() {
            self.level.steps(&x.point, j, |step| {
                let (y, k, h) = self.step(&x, step.point);
                let d = k - h;
                *moments += Moments::of(weight * step.weight, k, h);
                step_residual += step.weight * d * self.neighbour.value(&y);
                node.delta += step.weight * d.abs();
                node.squares[self.outside(x.cell, y.cell)] += step.weight * d * d;
                for (largest, now) in largest.iter_mut().zip([k, h, d]) {
                    *largest = Real::max(*largest, now.abs());
                }
            });
        }
        node.residual = node.difference() + step_residual;
        node
    }

    /// y, k and h.
    #[inline]
    pub(super) fn step(&self, x: &Located<L::Point>, y: L::Point) -> (Located<L::Point>, f64, f64) {
        let y = self.neighbour.locate(y);
        let k = self.equation.kernel(&x.point, &y.point);
        (y, k, self.neighbour.kernel(x, &y, k))
    }

    #[inline]
    fn outside(&self, i: usize, j: usize) -> usize {
        usize::from(self.pairs.kind(i, j) == PairKind::None)
    }

    /// s and c of a node.
    fn second(&self, estimator: Estimator, means: &Means, node: &mut Node<L::Point>) {
        let [mut second, mut mixed] = second_sources(estimator, node);
        for (j, &[s, c]) in means.seconds.iter().enumerate() {
            self.level.steps(&node.x.point, j, |step| {
                let (_, k, h) = self.step(&node.x, step.point);
                second += step.weight * h * h * s;
                mixed += step.weight * h * (k * c + (k - h) * s);
            });
        }
        (node.second, node.mixed) = (second, mixed);
    }

    /// The source of w in all nodes of a site, and what each pair of sites adds to it.
    fn square(&self, estimator: Estimator, seconds: &Seconds<'_>, site: &mut Site<L::Point>) {
        for node in &mut site.nodes {
            let share = node.weight / site.measure;
            node.parts = [square_source(estimator, node), 0.0, 0.0];
            for (j, pair) in site.pairs.iter_mut().enumerate() {
                self.level.steps(&node.x.point, j, |step| {
                    let (y, k, h) = self.step(&node.x, step.point);
                    let d = k - h;
                    let [s, c] = seconds.at(j, step.node).unwrap_or([f64::NAN; 2]);
                    let part = step.weight * d * (d * s + 2.0 * k * c);
                    node.parts[1 + self.outside(node.x.cell, y.cell)] += part;
                    *pair += share * part;
                });
            }
        }
    }

    /// A site that is a point, for a walk that starts there.
    pub(super) fn start(
        &self,
        analysis: &Analysis<L::Point>,
        point: L::Point,
    ) -> Result<Site<L::Point>, VarianceError> {
        let mut site = Site {
            measure: 1.0,
            ..Site::default()
        };
        site.row = buffer(analysis.sites.len())?;
        site.pairs = buffer(analysis.sites.len())?;
        let mut node = self.meet(point, 1.0, &mut site.row, &mut site.largest);
        let means = &analysis.means;
        let errors = Nodal::new(&analysis.sites, &means.error, |node| node.error)?;
        node.error = self.error(&node, &errors);
        if analysis.is_finite() {
            self.second(analysis.estimator, means, &mut node);
            site.nodes.push(node);
            let seconds = Nodal::new(&analysis.sites, &means.seconds, seconds_of)?;
            self.square(analysis.estimator, &seconds, &mut site);
        } else {
            site.nodes.push(node);
        }
        if analysis.kernel_power.is_some() {
            let totals = Nodal::new(&analysis.sites, &means.totals, |node| node.totals)?;
            for node in &mut site.nodes {
                node.totals = self.totals(analysis.estimator, node, &totals);
            }
        }
        Ok(site)
    }
}

impl<P> Analysis<P> {
    /// e in the mean over sites, and in their nodes.
    fn errors(&mut self) -> Result<Vec<f64>, VarianceError> {
        let matrix = Matrix::new(&self.sites, |m: &Moments| m.k);
        let residual = collect(&self.sites, |site| site.mean(|x| x.residual))?;
        let error = matrix.resolve(&residual)?;
        for site in &mut self.sites {
            let reflected = against(&site.row, |m| m.k, &error);
            for node in &mut site.nodes {
                node.error = node.residual + reflected;
            }
        }
        Ok(error)
    }

    /// Whether preconditioned walks have a variance.
    pub(super) fn is_finite(&self) -> bool {
        self.kernel_power.is_some() && self.neighbour_power.is_some()
    }

    /// E η(k,f)² and w in the mean over sites, from what they are in the nodes.
    fn mean_totals(&self) -> Result<Vec<[f64; 2]>, VarianceError> {
        let mut means = reserve(self.sites.len())?;
        let of = |site: &Site<P>| [0, 1].map(|k| site.mean(|x| x.totals[k]));
        means.extend(self.sites.iter().map(of));
        Ok(means)
    }

    /// E η(k,f)² and w in the mean over sites, as if they were constant there; w is NaN where it is infinite.
    fn rough_totals(&self) -> Result<Vec<[f64; 2]>, VarianceError> {
        let matrix = Matrix::new(&self.sites, |m: &Moments| m.kk);
        let plain = collect(&self.sites, |site| {
            site.mean(|x| plain_source(self.estimator, x))
        })?;
        let mut squared = collect(&self.sites, |site| site.mean(Node::squared))?;
        let plain = matrix.resolve(&plain)?;
        if self.is_finite() {
            squared = matrix.resolve(&squared)?;
        } else {
            squared.fill(f64::NAN);
        }
        let mut totals = buffer(plain.len())?;
        for (place, (plain, squared)) in totals.iter_mut().zip(plain.into_iter().zip(squared)) {
            *place = [plain, squared];
        }
        Ok(totals)
    }

    /// s and c in the mean over sites.
    fn seconds(&self) -> Result<Vec<[f64; 2]>, VarianceError> {
        let of = |which: usize| {
            collect(&self.sites, |site| {
                site.mean(|x| second_sources(self.estimator, x)[which])
            })
        };
        let matrix = Matrix::new(&self.sites, |m: &Moments| m.hh);
        let second = matrix.resolve(&of(0)?)?;
        let mut source = of(1)?;
        for (source, site) in source.iter_mut().zip(&self.sites) {
            *source += against(&site.row, |m| m.hd, &second);
        }
        let matrix = Matrix::new(&self.sites, |m: &Moments| m.kh);
        let mixed = matrix.resolve(&source)?;
        let mut seconds = buffer(second.len())?;
        for (place, pair) in seconds.iter_mut().zip(second.into_iter().zip(mixed)) {
            *place = [pair.0, pair.1];
        }
        Ok(seconds)
    }
}

pub(super) fn seconds_of<P>(node: &Node<P>) -> [f64; 2] {
    [node.second, node.mixed]
}

/// Calls `pass` for every one of them on this thread.
pub fn serially<T>(all: &mut [T], pass: &Pass<'_, T>) {
    for (i, one) in all.iter_mut().enumerate() {
        pass(i, one);
    }
}

/// Σ_j of a moment times a vector.
pub(super) fn against(row: &[Moments], moment: impl Fn(&Moments) -> f64, x: &[f64]) -> f64 {
    row.iter().zip(x).map(|(m, x)| moment(m) * x).sum()
}

/// Of every site.
fn collect<P>(sites: &[Site<P>], of: impl Fn(&Site<P>) -> f64) -> Result<Vec<f64>, VarianceError> {
    let mut out = buffer(sites.len())?;
    for (i, (out, site)) in out.iter_mut().zip(sites).enumerate() {
        *out = of(site);
        if !out.is_finite() {
            return Err(VarianceError::NotFinite { site: i });
        }
    }
    Ok(out)
}

fn check<P>(sites: &[Site<P>], sound: impl Fn(&Site<P>) -> bool) -> Result<(), VarianceError> {
    match sites.iter().position(|site| !sound(site)) {
        Some(site) => Err(VarianceError::NotFinite { site }),
        None => Ok(()),
    }
}

/// A product that a walk scores where it is absorbed, over q; 0 where there is nothing to score.
pub(super) fn scored(product: f64, q: f64) -> f64 {
    if product == 0.0 { 0.0 } else { product / q }
}

/// The source of E η(k,f)².
fn plain_source<P>(estimator: Estimator, x: &Node<P>) -> f64 {
    let f = x.source;
    match estimator {
        Estimator::Absorption => scored(f * f, x.absorption),
        Estimator::Collision => f * (2.0 * (x.value + x.error) - f),
    }
}

/// The sources of E η(k,f)² and of w.
fn total_sources<P>(estimator: Estimator, x: &Node<P>) -> [f64; 2] {
    [plain_source(estimator, x), x.squared()]
}

/// The sources of s and c.
fn second_sources<P>(estimator: Estimator, x: &Node<P>) -> [f64; 2] {
    let (g, difference) = (x.neighbour_source, x.difference());
    match estimator {
        Estimator::Absorption => [g * g, difference * g].map(|s| scored(s, x.absorption)),
        Estimator::Collision => [
            g * (2.0 * x.value - g),
            difference * x.value + g * (x.error - difference),
        ],
    }
}

/// The source of w that is the sources' difference.
fn square_source<P>(estimator: Estimator, x: &Node<P>) -> f64 {
    let difference = x.difference();
    match estimator {
        Estimator::Absorption => scored(difference * difference, x.absorption),
        Estimator::Collision => difference * (2.0 * x.error - difference),
    }
}
