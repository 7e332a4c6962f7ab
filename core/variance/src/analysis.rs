//! The equations of the variance, filled and solved.

use alloc::vec::Vec;
use core::fmt;
use fredholm_core::array::Each;

use fredholm_core::galerkin::{buffer, reserve};
use fredholm_core::{Estimator, Form};

use crate::matrix::{Matrix, Nodal, against, check, collect};
use crate::passes::Passes;
use crate::sources::{plain_source, residual_seconds, second_sources, total_sources};
use crate::{Moments, Node, Power, Site, VarianceError, VarianceModel};

/// The solved equations of the variance, on the sites of a model.
#[derive(Clone)]
pub struct Analysis<'a> {
    /// The estimator whose variance is predicted.
    pub estimator: Estimator,
    /// The form of the control variate.
    pub form: Form,
    /// The sites.
    pub sites: Vec<Site>,
    /// ‖T_k²p^m‖ < 1 for this m, or none: plain walks have no variance then.
    pub kernel_power: Option<Power>,
    /// ‖T_h²p^m‖ < 1 for this m, or none: preconditioned walks have no variance then, in the product form.
    pub neighbour_power: Option<Power>,
    pub(crate) model: &'a dyn VarianceModel,
    pub(crate) means: Means,
}

impl fmt::Debug for Analysis<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Analysis")
            .field("estimator", &self.estimator)
            .field("form", &self.form)
            .field("sites", &self.sites)
            .field("kernel_power", &self.kernel_power)
            .field("neighbour_power", &self.neighbour_power)
            .finish_non_exhaustive()
    }
}

/// Means over sites.
#[derive(Clone, Debug, Default)]
pub(crate) struct Means {
    /// e.
    pub(crate) error: Vec<f64>,
    /// s and c.
    pub(crate) seconds: Vec<[f64; 2]>,
    /// E η(k,f)² and w.
    pub(crate) totals: Vec<[f64; 2]>,
}

/// A function that is applied to each of several things, usually sites, with its number.
pub type Pass<'a, T> = dyn Fn(usize, &mut T) + Sync + 'a;

/// Calls a pass for all of a number of things with their numbers, in any order and by as many threads as it likes:
/// they are independent, and so the bits do not depend on it. [`serially`] does it on this thread.
pub type Run<'a, T> = dyn Fn(&mut [T], &Pass<'_, T>) + 'a;

/// Calls `pass` for every one of them on this thread.
pub fn serially<T>(all: &mut [T], pass: &Pass<'_, T>) {
    for (i, one) in all.iter_mut().enumerate() {
        pass(i, one);
    }
}

impl<'a> Analysis<'a> {
    /// Takes all integrals and solves the equations, for one estimator and form.
    ///
    /// O(n²) evaluations of k five times and of h three times for n nodes, and 56 bytes for each pair of sites.
    ///
    /// # Errors
    /// [`VarianceError`].
    pub fn new(
        model: &'a dyn VarianceModel,
        estimator: Estimator,
        form: Form,
        run: &Run<'_, Site>,
    ) -> Result<Self, VarianceError> {
        let passes = Passes {
            model,
            estimator,
            form,
        };
        let sites = integrate(passes, run)?;
        let matrix = Matrix::new(&sites, |m: &Moments| m.kk);
        let kernel_power = matrix.contracting_power()?;
        let matrix = Matrix::new(&sites, |m: &Moments| m.hh);
        let neighbour_power = matrix.contracting_power()?;
        let mut analysis = Self {
            estimator,
            form,
            sites,
            kernel_power,
            neighbour_power,
            model,
            means: Means::default(),
        };
        analysis.means.error = analysis.errors()?;
        analysis.refine_errors(run)?;
        if kernel_power.is_some() {
            if analysis.is_finite() {
                analysis.square_sources(run)?;
            }
            analysis.resolve_totals(run)?;
        }
        Ok(analysis)
    }

    const fn passes(&self) -> Passes<'a> {
        Passes {
            model: self.model,
            estimator: self.estimator,
            form: self.form,
        }
    }

    /// E η(k,f)² and w: in the mean over sites, and then in the nodes by T_k²p of what is known there.
    fn resolve_totals(&mut self, run: &Run<'_, Site>) -> Result<(), VarianceError> {
        let passes = self.passes();
        let rough = self.rough_totals()?;
        for site in &mut self.sites {
            let reflected = [0, 1].each(|k| {
                let of = site.row.iter().zip(&rough);
                of.map(|(m, totals)| m.kk * totals[k]).sum::<f64>()
            });
            for node in &mut site.nodes {
                let [plain, squared] = total_sources(passes.estimator, node);
                node.totals = [plain + reflected[0], squared + reflected[1]];
            }
        }
        let means = self.mean_totals()?;
        let totals = Nodal::new(&self.sites, &means, |node| node.totals)?;
        run(&mut self.sites, &|_, site| {
            for node in &mut site.nodes {
                node.totals = passes.totals(node, &totals);
            }
        });
        self.means.totals = self.mean_totals()?;
        Ok(())
    }

    /// e once more, by T_kp of what is known of it in the nodes: its mean over a site is of second order in the size of a
    /// site, and so is what its first order makes of the variation of k.
    fn refine_errors(&mut self, run: &Run<'_, Site>) -> Result<(), VarianceError> {
        let passes = self.passes();
        let means = core::mem::take(&mut self.means.error);
        let errors = Nodal::new(&self.sites, &means, |node| node.error)?;
        run(&mut self.sites, &|_, site| {
            for node in &mut site.nodes {
                node.error = passes.error(node, &errors);
            }
        });
        self.means.error = collect(&self.sites, |site| site.mean(|x| x.error))?;
        Ok(())
    }

    /// s, c and the source of w.
    fn square_sources(&mut self, run: &Run<'_, Site>) -> Result<(), VarianceError> {
        let passes = self.passes();
        let means = self.seconds()?;
        run(&mut self.sites, &|_, site| {
            for node in &mut site.nodes {
                passes.second(&means, node);
            }
        });
        let seconds = Nodal::new(&self.sites, &means, seconds_of)?;
        run(&mut self.sites, &|_, site| passes.square(&seconds, site));
        self.means.seconds = means;
        Ok(())
    }

    /// A site that is a point, for a walk that starts there.
    pub(crate) fn start(&self, point: usize) -> Result<Site, VarianceError> {
        let passes = self.passes();
        let mut site = Site {
            measure: 1.0,
            ..Site::default()
        };
        site.row = buffer(self.sites.len())?;
        site.pairs = buffer(self.sites.len())?;
        let mut node = passes.meet(point, &mut site);
        let means = &self.means;
        let errors = Nodal::new(&self.sites, &means.error, |node| node.error)?;
        node.error = passes.error(&node, &errors);
        if self.is_finite() {
            passes.second(&means.seconds, &mut node);
            site.nodes.push(node);
            let seconds = Nodal::new(&self.sites, &means.seconds, seconds_of)?;
            passes.square(&seconds, &mut site);
        } else {
            site.nodes.push(node);
        }
        if self.kernel_power.is_some() {
            let totals = Nodal::new(&self.sites, &means.totals, |node| node.totals)?;
            for node in &mut site.nodes {
                node.totals = passes.totals(node, &totals);
            }
        }
        Ok(site)
    }

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
    pub(crate) fn is_finite(&self) -> bool {
        let is_neighbour = self.form == Form::Residual || self.neighbour_power.is_some();
        self.kernel_power.is_some() && is_neighbour
    }

    /// E η(k,f)² and w in the mean over sites, from what they are in the nodes.
    fn mean_totals(&self) -> Result<Vec<[f64; 2]>, VarianceError> {
        let mut means = reserve(self.sites.len())?;
        let of = |site: &Site| [0, 1].each(|k| site.mean(|x| x.totals[k]));
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
        if self.form == Form::Residual {
            let mut seconds = reserve(self.sites.len())?;
            let of = |site: &Site| [0, 1].each(|k| site.mean(|x| residual_seconds(x)[k]));
            seconds.extend(self.sites.iter().map(of));
            return Ok(seconds);
        }
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

/// All sites of a model, with their integrals.
fn integrate(passes: Passes<'_>, run: &Run<'_, Site>) -> Result<Vec<Site>, VarianceError> {
    let count = passes.model.sites();
    if count == 0 {
        return Err(VarianceError::Empty);
    }
    let mut sites: Vec<Site> = reserve(count)?;
    sites.resize_with(count, Site::default);
    for site in &mut sites {
        site.row = buffer(count)?;
        site.pairs = buffer(count)?;
    }
    run(&mut sites, &|i, site| passes.integrate(i, site));
    check(&sites, |site| {
        site.row
            .iter()
            .all(|m| (m.k + m.kk + m.kh + m.hh + m.hd).is_finite())
            && site
                .nodes
                .iter()
                .all(|x| (x.residual + x.value).is_finite())
    })?;
    Ok(sites)
}

pub(crate) fn seconds_of(node: &Node) -> [f64; 2] {
    [node.second, node.mixed]
}
