//! The equations of the variance, filled and solved.

use alloc::vec::Vec;
use core::fmt;

use fredholm_core::galerkin::{buffer, reserve};
use fredholm_core::{Estimator, Form};

use crate::matrix::{Matrix, Nodal, against, check, collect, means};
use crate::passes::Passes;
use crate::site::Moments;
use crate::sources::{own_squares, residual_seconds, second_sources};
use crate::{Node, Power, Site, VarianceError, VarianceModel};

/// The solved equations of the variance, on the sites of a model.
#[derive(Clone)]
pub struct Analysis<'a> {
    /// The estimator whose variance is predicted.
    pub estimator: Estimator,
    /// The form of the control variate.
    pub form: Form,
    /// The sites.
    pub sites: Vec<Site>,
    /// ‖T_k²p^m‖ < 1 for this m, or none: plain walks have no variance then. By roulette λ stands for k², with which
    /// later states count.
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
    /// What a state itself adds to E η(k,f)² and w.
    pub(crate) own: Vec<[f64; 2]>,
    /// What the step from it adds, with the next state.
    pub(crate) next: Vec<[f64; 2]>,
    /// What all later states add.
    pub(crate) later: Vec<[f64; 2]>,
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
    /// O(n²) evaluations of k five times and of h three times for n nodes, and 72 bytes for each pair of sites.
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
        let matrix = Matrix::new(&sites, |m: &Moments| m.later);
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
            analysis.square_sources(run)?;
            analysis.resolve_later(run)?;
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

    /// What later states add to E η(k,f)² and w: in the mean over sites, and then in the nodes by the operators' application to
    /// what is known there. The latter is NaN where it is infinite.
    fn resolve_later(&mut self, run: &Run<'_, Site>) -> Result<(), VarianceError> {
        let passes = self.passes();
        let matrix = Matrix::new(&self.sites, |m: &Moments| m.later);
        let mut rough: Vec<[f64; 2]> = buffer(self.sites.len())?;
        rough.fill([f64::NAN; 2]);
        for k in 0..if self.is_finite() { 2 } else { 1 } {
            let mut source = buffer(self.sites.len())?;
            for (source, site) in source.iter_mut().zip(&self.sites) {
                let next = site.row.iter().zip(&self.means.next);
                *source = next.map(|(m, next)| m.next * next[k]).sum();
            }
            for (rough, later) in rough.iter_mut().zip(matrix.resolve(&source)?) {
                rough[k] = later;
            }
        }
        let nexts = Nodal::new(&self.sites, &self.means.next, |node| node.next)?;
        run(&mut self.sites, &|_, site| {
            for node in &mut site.nodes {
                node.later = passes.later(node, &nexts, &rough);
            }
        });
        self.means.later = means(&self.sites, |node| node.later)?;
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

    /// s, c, and what states and the steps from them add to E η(k,f)² and w. s and c stay NaN where they are infinite.
    fn square_sources(&mut self, run: &Run<'_, Site>) -> Result<(), VarianceError> {
        let passes = self.passes();
        let own_of = |node: &Node| own_squares(passes.estimator, node);
        let mut of_sites = buffer(self.sites.len())?;
        of_sites.fill([f64::NAN; 2]);
        if self.is_finite() {
            of_sites = self.seconds()?;
            run(&mut self.sites, &|_, site| {
                for node in &mut site.nodes {
                    passes.second(&of_sites, node);
                }
            });
        }
        self.means.seconds = of_sites;
        self.means.own = means(&self.sites, own_of)?;
        let seconds = Nodal::new(&self.sites, &self.means.seconds, seconds_of)?;
        let own = Nodal::new(&self.sites, &self.means.own, own_of)?;
        run(&mut self.sites, &|_, site| {
            passes.square(&seconds, &own, site);
        });
        self.means.next = means(&self.sites, |node| node.next)?;
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
        }
        site.nodes.push(node);
        if self.kernel_power.is_some() {
            let own_of = |node: &Node| own_squares(passes.estimator, node);
            let seconds = Nodal::new(&self.sites, &means.seconds, seconds_of)?;
            let own = Nodal::new(&self.sites, &means.own, own_of)?;
            passes.square(&seconds, &own, &mut site);
            let nexts = Nodal::new(&self.sites, &means.next, |node| node.next)?;
            for node in &mut site.nodes {
                node.later = passes.later(node, &nexts, &means.later);
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

    /// s and c in the mean over sites.
    fn seconds(&self) -> Result<Vec<[f64; 2]>, VarianceError> {
        if self.form == Form::Residual {
            return Ok(means(&self.sites, residual_seconds)?);
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
