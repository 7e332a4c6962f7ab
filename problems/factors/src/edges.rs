//! What two polygons exchange that others hide from each other in part, as a sum of integrals along edges.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_surfaces::space::norm;

use crate::clear::Amount;
use crate::events;
use crate::rules::{Rules, radius};
use crate::silhouette::{Edge, View};

/// How many times a piece of an edge may be halved.
const HALVINGS: u32 = 44;

/// The numbers of points that are tried first and then.
const FEW: usize = 5;
const MOST: usize = 10;

/// A piece whose middle is nearer to a logarithm than ¾ of its length has one next to it, of which its points may see nothing:
/// the integral is off by this much of the square of its length, in units of the pair's size.
const NEAR: f64 = 0.02;

/// How many of such pieces share the error: the ends of some edges.
const ENDS: f64 = 16.0;

/// What rounding adds to the integrand, whose terms are about P's width: halving does not help against it.
const ROUNDING: f64 = 1e-15;

/// The most points of one pair.
const POINTS: usize = 100_000;

/// What is hidden from Q's edges and seen past others', in the unit of area: A_P F_PQ less what it would be if nothing
/// were between. To `error` in the same unit.
pub(crate) fn difference(view: &mut View, error: f64, rules: &Rules) -> Amount {
    let edges = view.edges();
    let length: f64 = edges.iter().map(|edge| norm(edge.span)).sum();
    let scale = view.unit * view.unit / core::f64::consts::TAU;
    let width = radius(&view.outer, [0.0; 3]);
    let rounding = ROUNDING * width.min(1.0);
    let mut work = Work {
        view,
        rules,
        density: Real::max(error / (scale * length), rounding),
        least: 0.0,
        near: Real::max(error / (scale * ENDS), rounding),
        is_smooth: true,
        points: 0,
        sum: Amount::default(),
    };
    let places = edges.iter().map(|edge| events::places(work.view, edge));
    let places: Vec<events::Places> = places.collect();
    let parts: usize = places.iter().map(|own| own.at.len() - 1).sum();
    work.least = work.density * length / parts.max(1) as f64;
    for (edge, places) in edges.iter().zip(&places) {
        work.is_smooth = places.is_whole;
        for part in places.at.windows(2) {
            work.add(edge, [part[0], part[1]], HALVINGS);
        }
    }
    Amount {
        value: scale * work.sum.value,
        error: scale * (work.sum.error + rounding * length),
    }
}

struct Work<'a> {
    view: &'a mut View,
    rules: &'a Rules,
    /// The error that is allowed, per length.
    density: f64,
    /// The error that is allowed for any part: an equal share, for the shortest have no digits.
    least: f64,
    /// The error that is allowed for a piece close to a logarithm.
    near: f64,
    /// Whether there are no kinks within the parts of the edge.
    is_smooth: bool,
    points: usize,
    sum: Amount,
}

impl Work<'_> {
    /// The integral over a part of an edge by a Gauss rule, and what it is off by.
    ///
    /// Where the function is analytic the coefficients of Legendre's polynomials fall by a factor from each degree to the
    /// next, and n points leave out those from degree 2n on. The last are extrapolated by half of n only: next to a
    /// singularity they fall ever slower. Two of each are taken, because one may be small by chance.
    fn rule(&mut self, edge: &Edge, [from, to]: [f64; 2], points: usize) -> Amount {
        let length = (to - from) * norm(edge.span);
        let mut sums = [0.0; MOST];
        let rules = self.rules;
        for &(t, weight) in rules.of(points) {
            let value = length * weight * self.view.value(edge, from + (to - from) * t);
            if value == 0.0 {
                continue;
            }
            let x = 2.0 * t - 1.0;
            let (mut before, mut at) = (0.0, 1.0);
            for (k, sum) in (0..points).zip(&mut sums) {
                *sum += value * at;
                let k = k as f64;
                (before, at) = (at, ((2.0 * k + 1.0) * x * at - k * before) / (k + 1.0));
            }
        }
        self.points += points;
        let size = |k: usize| sums[k].abs() * Real::sqrt(2.0 * k as f64 + 1.0);
        let largest = |k: usize| Real::max(size(k), size(k + 1));
        let (middle, last) = (largest(points / 2 - 1), largest(points - 2));
        let fall = if last < middle { last / middle } else { 1.0 };
        Amount {
            value: sums[0],
            error: last * fall,
        }
    }

    /// Adds the integral over a part of an edge.
    fn add(&mut self, edge: &Edge, part: [f64; 2], halvings: u32) {
        let [from, to] = part;
        let length = (to - from) * norm(edge.span);
        let allowed = Real::max(self.density * length, self.least);
        let middle = 0.5 * (from + to);
        let near = if self.view.distance(edge, edge.at(middle)) < 0.75 * length {
            NEAR * length * length
        } else {
            0.0
        };
        let mut own = self.rule(edge, part, FEW);
        // More points do not help if they gain too little.
        if own.error > allowed && own.error < 1e6 * allowed {
            own = self.rule(edge, part, MOST);
        }
        // Coefficients do not tell of a kink that was not looked for: both halves do.
        if !self.is_smooth && own.error <= allowed {
            let halves = [[from, middle], [middle, to]].map(|half| self.rule(edge, half, FEW));
            let sum = halves[0].value + halves[1].value;
            own.error = Real::max(own.error, (sum - own.value).abs());
            own.value = sum;
        }
        let is_coarse = own.error > allowed || near > self.near;
        if is_coarse && halvings > 0 && self.points < POINTS {
            self.add(edge, [from, middle], halvings - 1);
            self.add(edge, [middle, to], halvings - 1);
        } else {
            self.sum.value += own.value;
            self.sum.error += Real::max(own.error, near);
        }
    }
}
