//! What two polygons exchange that others hide from each other in part, as a sum of integrals along edges.

use crate::events;
use crate::partial::Amount;
use crate::rules::Rules;
use crate::silhouette::{Edge, View};
use crate::vector::norm;

/// How many times a piece of an edge may be halved.
const HALVINGS: u32 = 44;

/// The most points of one pair.
const POINTS: usize = 100_000;

/// What is hidden from Q's edges and seen past others', in the unit of area: A_P F_PQ less what it would be if nothing
/// were between. To `error` in the same unit.
pub(crate) fn difference(view: &mut View, error: f64, rules: &Rules) -> Amount {
    let edges = view.edges();
    let length: f64 = edges.iter().map(|edge| norm(edge.span)).sum();
    let scale = view.unit * view.unit / core::f64::consts::TAU;
    let mut work = Work {
        view,
        rules,
        density: error / (scale * length),
        points: 0,
        sum: Amount::default(),
    };
    for edge in &edges {
        let places = events::places(work.view, edge);
        for part in places.windows(2) {
            work.add(edge, [part[0], part[1]], HALVINGS);
        }
    }
    Amount {
        value: scale * work.sum.value,
        error: scale * work.sum.error,
    }
}

struct Work<'a> {
    view: &'a mut View,
    rules: &'a Rules,
    /// The error that is allowed, per length.
    density: f64,
    points: usize,
    sum: Amount,
}

impl Work<'_> {
    fn rule(&mut self, edge: &Edge, [from, to]: [f64; 2], points: usize) -> f64 {
        let mut sum = 0.0;
        let rules = self.rules;
        for &(t, weight) in rules.of(points) {
            sum += weight * self.view.value(edge, from + (to - from) * t);
        }
        self.points += points;
        (to - from) * norm(edge.span) * sum
    }

    /// Adds the integral over a part of an edge.
    fn add(&mut self, edge: &Edge, part: [f64; 2], halvings: u32) {
        let [from, to] = part;
        let allowed = self.density * (to - from) * norm(edge.span);
        let few = self.rule(edge, part, 4);
        let more = self.rule(edge, part, 7);
        let mut own = Amount {
            value: more,
            error: (more - few).abs(),
        };
        if own.error > allowed {
            let most = self.rule(edge, part, 11);
            let (before, last) = (own.error, (most - more).abs());
            // Where the function is analytic the changes fall ever faster; at a kink they do not.
            let ratio = last / before;
            own = Amount {
                value: most,
                error: if ratio < 0.05 { 2.0 * last * ratio } else { 4.0 * last },
            };
        }
        if own.error > allowed && halvings > 0 && self.points < POINTS {
            let middle = 0.5 * (from + to);
            self.add(edge, [from, middle], halvings - 1);
            self.add(edge, [middle, to], halvings - 1);
        } else {
            self.sum.value += own.value;
            self.sum.error += own.error;
        }
    }
}
