//! Where walks are, for a choice of pairs: the adjoints of the equations of the variance.

use alloc::vec::Vec;

use fredholm_core::galerkin::{buffer, reserve};
use fredholm_core::{Estimator, Form};

use crate::matrix::Matrix;
use crate::row::Place;
use crate::{Analysis, Moments, Node, Prediction, Row, Run, VarianceError, Wanted};

/// What walks do, by sites: in the mean over the functionals.
pub(crate) struct Flow {
    /// a, each functional relative to its variance.
    pub(crate) occupation: Vec<f64>,
    /// Where walks that start in one point do: its site, the node, and its share.
    pub(crate) starts: Vec<(usize, Node, f64, Vec<Moments>)>,
    /// Expected scores of G, by cells.
    pub(crate) scorings: Vec<f64>,
    /// Visited states of a walk.
    pub(crate) states: f64,
}

impl Analysis<'_> {
    /// Where walks are, and how often they score.
    pub(crate) fn flow(
        &self,
        predictions: &[Prediction],
        cells: usize,
    ) -> Result<Flow, VarianceError> {
        let sites = &self.sites;
        let n = sites.len();
        let (mut first, mut visits) = (buffer(n)?, buffer(n)?);
        let mut own: Vec<f64> = buffer(n)?;
        let mut scorings: Vec<f64> = buffer(cells)?;
        let mut starts = Vec::new();
        let mut states = 0.0;
        // Scores in a point: one where it is absorbed, or one at every visit.
        let score = |node: &Node| match self.estimator {
            Estimator::Absorption => node.absorption,
            Estimator::Collision => 1.0,
        };
        let share = 1.0 / predictions.len().max(1) as f64;
        let mut step_mass: Vec<f64> = buffer(n)?;
        for prediction in predictions {
            let variance = prediction.preconditioned.ok_or(VarianceError::Infinite)?;
            // A functional without variance has no wishes.
            let weight = if variance > 0.0 {
                share / variance
            } else {
                0.0
            };
            for (first, of) in first.iter_mut().zip(&prediction.first) {
                *first += weight * of;
            }
            for (own, of) in own.iter_mut().zip(&prediction.own) {
                *own += weight * of;
            }
            for (initial, site) in prediction.initial.iter().zip(sites) {
                for (mass, moments) in step_mass.iter_mut().zip(&site.row) {
                    *mass += share * initial * moments.mass;
                }
            }
            for (visits, initial) in visits.iter_mut().zip(&prediction.initial) {
                *visits += share * initial;
            }
            if let Some((own, site)) = &prediction.start
                && let Some(node) = site.nodes.first()
            {
                states += share;
                if let Some(of_cell) = scorings.get_mut(node.cell) {
                    *of_cell += share * score(node);
                }
                for (mass, moments) in step_mass.iter_mut().zip(&site.row) {
                    *mass += share * moments.mass;
                }
                let mut row = reserve(site.row.len())?;
                row.extend_from_slice(&site.row);
                starts.push((*own, *node, weight, row));
            }
        }
        let matrix = Matrix::adjoint(sites, |m: &Moments| m.kk);
        let mut occupation = matrix.resolve(&first)?;
        for (occupation, own) in occupation.iter_mut().zip(&own) {
            *occupation += own;
        }
        let matrix = Matrix::adjoint(sites, |m: &Moments| m.mass);
        for (visits, later) in visits.iter_mut().zip(matrix.resolve(&step_mass)?) {
            *visits += later;
        }
        for (site, visits) in sites.iter().zip(&visits) {
            states += visits;
            for node in &site.nodes {
                if let Some(of_cell) = scorings.get_mut(node.cell) {
                    *of_cell += visits * node.weight / site.measure * score(node);
                }
            }
        }
        Ok(Flow {
            occupation,
            starts,
            scorings,
            states,
        })
    }

    /// All nodes by cells, with a and b, and the points in which walks start.
    pub(crate) fn places(
        &self,
        flow: &Flow,
        cells: usize,
        run: &Run<'_, Row>,
    ) -> Result<Vec<Vec<Place>>, VarianceError> {
        let sites = &self.sites;
        // In the residual form no later h multiplies a score, and b is 0.
        let is_product = self.form == Form::Product;
        // What b has by sites.
        let mut source: Vec<f64> = buffer(sites.len())?;
        let visited = flow.occupation.iter().filter(|_| is_product);
        for (site, occupation) in sites.iter().zip(visited) {
            for (source, m) in source.iter_mut().zip(&site.row) {
                *source += occupation * 2.0 * (m.kk - m.kh);
            }
        }
        for (_, _, weight, row) in flow.starts.iter().filter(|_| is_product) {
            for (source, m) in source.iter_mut().zip(row) {
                *source += weight * 2.0 * (m.kk - m.kh);
            }
        }
        let mixed = Matrix::adjoint(sites, |m: &Moments| m.kh).resolve(&source)?;
        // From where steps come: b is even over a site there.
        let mut from = Vec::new();
        for ((site, occupation), mixed) in sites.iter().zip(&flow.occupation).zip(&mixed) {
            for node in &site.nodes {
                let part = node.weight / site.measure;
                from.push(Place::new(node, part * occupation, part * mixed));
            }
        }
        for (_, node, weight, _) in &flow.starts {
            from.push(Place::new(node, *weight, 0.0));
        }
        let mut rows: Vec<Row> = reserve(sites.len())?;
        rows.resize_with(sites.len(), Row::default);
        for (row, site) in rows.iter_mut().zip(sites) {
            row.mixed = buffer(site.nodes.len())?;
        }
        if is_product {
            run(&mut rows, &|j, row| {
                self.gather(j, &from, &mut row.mixed);
            });
        }
        let mut places: Vec<Vec<Place>> = buffer(cells)?;
        let mut put = |place: Place| {
            if let Some(of_cell) = places.get_mut(place.cell) {
                of_cell.push(place);
            }
        };
        for ((site, occupation), row) in sites.iter().zip(&flow.occupation).zip(&rows) {
            for (node, mixed) in site.nodes.iter().zip(&row.mixed) {
                let part = node.weight / site.measure;
                put(Place::new(node, part * occupation, *mixed));
            }
        }
        for (_, node, weight, _) in &flow.starts {
            put(Place::new(node, *weight, 0.0));
        }
        match places.iter().position(Vec::is_empty) {
            Some(cell) => Err(VarianceError::Coarse { cell }),
            None => Ok(places),
        }
    }

    /// b in the nodes of a site: T_kDp^* a and T_khp^* b.
    fn gather(&self, j: usize, from: &[Place], mixed: &mut [f64]) {
        let mut spread = 0.0;
        for place in from {
            self.model
                .steps(place.point, j, Wanted::Neighbour, &mut |step| {
                    let (k, h) = (step.kernel, step.neighbour);
                    let part = 2.0 * place.occupation * k * (k - h) + place.mixed * k * h;
                    match step.node.and_then(|node| mixed.get_mut(node)) {
                        Some(mixed) => *mixed += step.weight * part,
                        None => spread += step.weight * part,
                    }
                });
        }
        if let Some(site) = self.sites.get(j) {
            for (mixed, node) in mixed.iter_mut().zip(&site.nodes) {
                *mixed += spread * node.weight / site.measure;
            }
        }
    }
}
