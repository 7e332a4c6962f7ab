//! What is done in every point: integrals over the steps from it.

use fredholm_core::{Estimator, Form, Real};

use crate::matrix::Nodal;
use crate::site::Moments;
use crate::sources::{own_squares, residual_seconds, second_sources};
use crate::{Node, Site, VarianceModel, Wanted};

/// A model, an estimator and a form: what every pass over the sites needs.
#[derive(Clone, Copy)]
pub(crate) struct Passes<'a> {
    pub(crate) model: &'a dyn VarianceModel,
    pub(crate) estimator: Estimator,
    pub(crate) form: Form,
}

impl Passes<'_> {
    /// Nodes and integrals of a site.
    pub(crate) fn integrate(self, i: usize, site: &mut Site) {
        for point in self.model.nodes(i) {
            let node = self.meet(point, site);
            site.measure += node.weight;
            site.nodes.push(node);
        }
        for moments in &mut site.row {
            *moments = moments.scaled(1.0 / site.measure);
        }
    }

    /// What is to be known of a point; its steps into every site, times the weight, are added to the row of `own`.
    pub(crate) fn meet(self, point: usize, own: &mut Site) -> Node {
        let (position, values) = (self.model.position(point), self.model.values(point));
        let weight = position.weight;
        let mut node = Node {
            point,
            cell: position.cell,
            weight,
            absorption: values.absorption,
            source: values.source,
            neighbour_source: values.neighbour_source,
            source_noise: values.source_noise,
            noise: values.noise,
            value: values.value,
            residual: 0.0,
            delta: 0.0,
            squares: [0.0; 2],
            error: 0.0,
            second: f64::NAN,
            mixed: f64::NAN,
            parts: [0.0; 3],
            next: [f64::NAN; 2],
            later: [f64::NAN; 2],
        };
        let mut step_residual = 0.0;
        let largest = &mut own.largest;
        for (j, moments) in own.row.iter_mut().enumerate() {
            self.model.steps(point, j, Wanted::Value, &mut |step| {
                let (k, h) = (step.kernel, step.neighbour);
                let d = k - h;
                *moments += Moments::of(weight * step.weight, step);
                step_residual += step.weight * d * step.value;
                node.delta += step.weight * d.abs();
                node.squares[usize::from(step.left_out)] += step.weight * d * d;
                for (largest, now) in largest.iter_mut().zip([k, h, d]) {
                    *largest = Real::max(*largest, now.abs());
                }
            });
        }
        node.residual = node.difference() + step_residual;
        node
    }

    /// r + T_kp e in a node.
    pub(crate) fn error(self, node: &Node, errors: &Nodal<'_, f64>) -> f64 {
        let mut error = node.residual;
        for j in 0..errors.means.len() {
            self.model
                .steps(node.point, j, Wanted::Kernel, &mut |step| {
                    let of_y = errors.at(j, step.node).unwrap_or(f64::NAN);
                    error += step.weight * step.kernel * of_y;
                });
        }
        error
    }

    /// s and c of a node.
    pub(crate) fn second(self, seconds: &[[f64; 2]], node: &mut Node) {
        if self.form == Form::Residual {
            [node.second, node.mixed] = residual_seconds(node);
            return;
        }
        let [mut second, mut mixed] = second_sources(self.estimator, node);
        for (j, &[s, c]) in seconds.iter().enumerate() {
            self.model
                .steps(node.point, j, Wanted::Neighbour, &mut |step| {
                    let (k, h) = (step.kernel, step.neighbour);
                    let weight = step.weight * step.noisier();
                    second += weight * h * h * s;
                    mixed += weight * h * (k * c + (k - h) * s);
                });
        }
        (node.second, node.mixed) = (second, mixed);
    }

    /// What all nodes of a site and the steps from them add to E η(k,f)² and w, and what each pair of sites does.
    pub(crate) fn square(
        self,
        seconds: &Nodal<'_, [f64; 2]>,
        own: &Nodal<'_, [f64; 2]>,
        site: &mut Site,
    ) {
        for node in &mut site.nodes {
            let share = node.weight / site.measure;
            let [_, square] = own_squares(self.estimator, node);
            let (mut parts, mut next) = ([square, 0.0, 0.0], [0.0; 2]);
            for (j, pair) in site.pairs.iter_mut().enumerate() {
                self.model.steps(node.point, j, Wanted::Kind, &mut |step| {
                    let k = step.kernel;
                    let d = k - step.neighbour;
                    let [s, c] = seconds.at(j, step.node).unwrap_or([f64::NAN; 2]);
                    let mut part = step.weight * d * (d * s + 2.0 * k * c);
                    if self.form == Form::Product {
                        part *= step.noisier();
                    }
                    parts[1 + usize::from(step.left_out)] += part;
                    *pair += share * part;
                    let of_y = own.at(j, step.node).unwrap_or([f64::NAN; 2]);
                    for (next, of_y) in next.iter_mut().zip(of_y) {
                        *next += step.weight * k * k * of_y;
                    }
                });
            }
            next[1] += parts[1] + parts[2];
            (node.parts, node.next) = (parts, next);
        }
    }

    /// What all states after the next add to E η(k,f)² and w in a node.
    pub(crate) fn later(
        self,
        node: &Node,
        nexts: &Nodal<'_, [f64; 2]>,
        laters: &[[f64; 2]],
    ) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (j, later) in laters.iter().enumerate() {
            self.model
                .steps(node.point, j, Wanted::Kernel, &mut |step| {
                    let next = nexts.at(j, step.node).unwrap_or([f64::NAN; 2]);
                    for ((sum, next), later) in sums.iter_mut().zip(next).zip(later) {
                        *sum += step.weight * (step.next * next + step.later * later);
                    }
                });
        }
        sums
    }
}
