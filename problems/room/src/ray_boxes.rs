//! Boxes of directions, and what c is in them: tables of a cell, whatever v is of.

use alloc::vec;
use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::legendre;

use crate::panels::gauss;
use crate::rays::{
    OF_INTERVAL, OWN, PLACES, PRODUCTS, Share, Stretch, TERMS, add_mean, between, combined,
    products,
};
use crate::vector::Vector;
use crate::views::{ShadowEnd, edges, parts};
use crate::{Point, Room};

/// Boxes are no wider than this part of all directions: a jump within one is not overlooked.
const WIDEST: f64 = 1.0 / 16.0;
/// The most boxes of a stretch: twice as many cost up to twice the set-up, and save less than a tenth of the standard deviation. What
/// is left then are jumps of v from cell to cell, which cross boxes as x moves.
const BOXES: usize = 128;
/// The part of the probabilities that follows widths alone, so that no ray weighs more than five times the mean.
const EVEN: f64 = 0.2;
/// The least width for that part, relative to the mean: a box that is empty where it was looked at may be none elsewhere.
const LEAST: f64 = 0.01;

/// The standard deviation that polynomials for integrals of c may add, as a part of that of a ray: a hundredth of the variance.
const FAR: f64 = 0.1;
/// The places of a stretch in which these polynomials are looked at.
const LOOKS: u32 = 16;

/// How far within a box its ends are looked at, as a part of it: far beyond rounding in ω, and so little that products of
/// polynomials stay orthogonal to ten digits.
const HAIR: f64 = 1.0 / (1_u64 << 33) as f64;

/// The tables of one cell: see [`RayControl`](crate::RayControl).
#[derive(Clone, Debug, Default)]
pub struct CellRays {
    pub(crate) channels: usize,
    /// Stretches, whose numbers of intervals and boxes begin at 0.
    pub(crate) stretches: Vec<Stretch<f64>>,
    pub(crate) integrals: Vec<f64>,
    pub(crate) intervals: Vec<f64>,
    pub(crate) boxes: Vec<f64>,
    pub(crate) shares: Vec<Share>,
}

/// A box, and what was learned of it.
#[derive(Clone, Debug)]
struct Fitted {
    /// Where it begins, and its width, as fractions of the interval.
    place: [f64; 2],
    /// The number of its interval within the stretch.
    interval: u32,
    /// The box's mean width as seen from the stretch, in ω.
    width: f64,
    /// c: the coefficients of every channel.
    control: Vec<f64>,
    /// The width times the root mean square of v − c, in every channel.
    shares: Vec<f64>,
    /// The largest of these, each times the weight of its channel.
    share: f64,
}

/// A function that writes what a ray from a point sees, by its ω.
pub(crate) type WriteSeen<'s> = dyn Fn(&Point<f64>, f64, &mut [f64]) + 's;

/// What makes tables, whatever the number of functions on a cell: compiled once.
pub(crate) struct Builder<'s> {
    pub(crate) room: &'s Room<'s, f64>,
    /// Writes v of every channel where a ray from a point leads, by its ω; 0 where it leaves.
    pub(crate) seen: &'s WriteSeen<'s>,
    /// The standard deviation of a ray's estimate of T_k v/ρ that is small enough, in every channel.
    pub(crate) noise: &'s [f64],
    pub(crate) shadows: &'s [ShadowEnd],
}

/// A node of a stretch: where it is, and what it sees.
struct Viewpoint {
    x: Point<f64>,
    psi: [f64; TERMS],
    weight: f64,
    /// Where intervals begin, and their widths.
    intervals: Vec<[f64; 2]>,
}

/// A part of a cell, and the vertices between the intervals of directions that are seen from there.
struct Part {
    cell: usize,
    from: f64,
    to: f64,
    ends: Vec<Vector<f64>>,
}

impl Part {
    /// The point at a fraction of the part.
    fn point(&self, room: &Room<'_, f64>, t: f64) -> Option<Point<f64>> {
        room.inside(self.cell, self.from + t * (self.to - self.from))
    }

    /// Where intervals begin, as seen from a point, and their widths.
    fn intervals(&self, room: &Room<'_, f64>, x: &Point<f64>) -> Option<Vec<[f64; 2]>> {
        let tangent = room.geometry().wall(x.wall() as u32)?.tangent;
        let end = |k: usize| self.ends.get(k).copied();
        let all = (0..=self.ends.len()).map(|k| between(end, k, x.position(), tangent));
        Some(all.collect())
    }
}

impl Builder<'_> {
    /// The tables of a cell.
    pub(crate) fn cell(&self, cell: usize) -> CellRays {
        let mut rays = CellRays {
            channels: self.noise.len(),
            ..CellRays::default()
        };
        for [from, to] in parts(self.room, cell, self.shadows) {
            let edges = edges(self.room, cell, 0.5 * (from + to), self.shadows);
            let part = Part {
                cell,
                from,
                to,
                ends: edges.iter().map(|edge| edge.position).collect(),
            };
            self.stretch(&part, &mut rays);
        }
        rays
    }

    /// What a channel's noise counts beside that of the others: over what is small enough.
    fn weight(&self, channel: usize) -> f64 {
        match self.noise.get(channel) {
            Some(&noise) if noise > 0.0 => 1.0 / noise,
            _ => 0.0,
        }
    }

    /// Adds a part of a cell to its tables.
    fn stretch(&self, part: &Part, all: &mut CellRays) {
        let boxes = self.boxes(part);
        let shares = shares(&boxes);
        let row = OWN + self.noise.len() * OF_INTERVAL;
        let stretch = Stretch {
            from: part.from,
            interval: (all.intervals.len() / row) as u32,
            ray_box: all.shares.len() as u32,
            near: [0; 2],
        };
        for fitted in &boxes {
            all.boxes.extend(fitted.place);
            all.boxes.extend(&fitted.control);
        }
        let near = self.integrate(part, &boxes, &shares, all);
        all.stretches.push(Stretch { near, ..stretch });
        all.shares.extend(shares);
    }

    /// Halves boxes until the noise of every channel is small.
    fn boxes(&self, part: &Part) -> Vec<Fitted> {
        let channels = self.noise.len();
        let nodes = self.viewpoints(part);
        let fit = |place, interval| self.fitted(place, interval, &nodes);
        let intervals = 0..=part.ends.len() as u32;
        let mut boxes: Vec<Fitted> = intervals.map(|number| fit([0.0, 1.0], number)).collect();
        // The channel that was noisy last is the first to be looked at.
        let mut noisy = 0;
        while boxes.len() < BOXES {
            let is_wide = |fitted: &Fitted| fitted.width > WIDEST;
            let worst = boxes.iter().position(is_wide).or_else(|| {
                let mut order = (0..channels).map(|k| (noisy + k) % channels);
                noisy = order.find(|&channel| noise_of(&boxes, channel) > self.noise[channel])?;
                let numbers = boxes.iter().enumerate();
                let share = |fitted: &Fitted| fitted.shares[noisy];
                let worst = numbers.max_by(|a, b| share(a.1).total_cmp(&share(b.1)));
                worst.map(|(number, _)| number)
            });
            let Some(worst) = worst else {
                break;
            };
            let Fitted {
                place: [from, width],
                interval,
                ..
            } = boxes[worst];
            // Halves, whose places are exact in every scalar.
            let half = 0.5 * width;
            let halves = [from, from + half].map(|from| fit([from, half], interval));
            boxes.splice(worst..=worst, halves);
        }
        boxes
    }

    /// Adds the intervals of a part to the tables, with the polynomials that integrals of c over them are near to; returns bits of those
    /// that have none in some channel.
    fn integrate(
        &self,
        part: &Part,
        boxes: &[Fitted],
        shares: &[Share],
        all: &mut CellRays,
    ) -> [u32; 2] {
        let channels = self.noise.len();
        let at = |(t, weight): (f64, f64)| {
            let widths = part.intervals(self.room, &part.point(self.room, t)?)?;
            let psi: [f64; PLACES] = legendre(t + t - 1.0);
            Some((widths, psi, weight))
        };
        // Those with a weight make the polynomials, the others look at them.
        let nodes = gauss::<f64>(3).map(|(t, weight)| (0.5 + 0.5 * t, 0.5 * weight));
        let looks = (0..LOOKS).map(|look| ((f64::from(look) + 0.5) / f64::from(LOOKS), 0.0));
        let places: Vec<_> = nodes.chain(looks).filter_map(at).collect();
        let noise: Vec<f64> = (0..channels)
            .map(|channel| FAR * Real::max(noise_of(boxes, channel), self.noise[channel]))
            .collect();
        let mut sums = vec![0.0; PLACES * channels];
        let mut bits = [0; 2];
        for k in 0..=part.ends.len() {
            let mut means = vec![[0.0; TERMS]; channels];
            // The probability of a ray in the interval, and the mean square of what a box's part of it weighs.
            let (mut before, mut probability, mut weights) = (0.0, 0.0, 0.0);
            for (fitted, share) in boxes.iter().zip(shares) {
                let sum = f64::from(share.sum);
                if share.interval as usize == k {
                    let [_, width] = fitted.place;
                    for (mean, own) in means.iter_mut().zip(fitted.control.chunks(PRODUCTS)) {
                        add_mean(mean, width, own);
                    }
                    probability += sum - before;
                    weights += width * width / (sum - before);
                }
                before = sum;
            }
            let widths: Vec<_> = places
                .iter()
                .map(|(intervals, psi, weight)| (intervals[k][1], *psi, *weight))
                .collect();
            let found: Vec<_> = means.iter().map(|mean| polynomial(mean, &widths)).collect();
            let is_near = found.iter().zip(&noise).any(|(found, noise)| {
                let is_far = found.worst * found.worst * weights <= noise * noise * probability
                    || found.worst <= 16.0 * f64::EPSILON * found.largest;
                !is_far
            });
            if is_near {
                bits[k / 32 % 2] |= 1 << (k % 32);
            }
            all.intervals
                .extend(part.ends.get(k).copied().unwrap_or_default());
            for (channel, (mean, found)) in means.iter().zip(&found).enumerate() {
                let integral = if is_near {
                    [0.0; PLACES]
                } else {
                    found.integral
                };
                let sums = sums[channel * PLACES..].iter_mut();
                sums.zip(integral).for_each(|(sum, own)| *sum += own);
                all.intervals.extend(mean);
                all.intervals.extend(integral);
            }
        }
        all.integrals.extend(sums);
        bits
    }

    /// The nodes of a part of a cell.
    fn viewpoints(&self, part: &Part) -> Vec<Viewpoint> {
        let at = |(t, weight): (f64, f64)| {
            let x = part.point(self.room, t)?;
            Some(Viewpoint {
                x,
                psi: legendre(t + t - 1.0),
                weight,
                intervals: part.intervals(self.room, &x)?,
            })
        };
        fit().filter_map(at).collect()
    }

    /// A box with its c: the projection of v(y(x, ω)) by Gauss points in x and Gauss–Lobatto points in ω.
    fn fitted(&self, place: [f64; 2], interval: u32, nodes: &[Viewpoint]) -> Fitted {
        let channels = self.noise.len();
        let mut samples: Vec<(f64, [f64; PRODUCTS])> = Vec::with_capacity(42);
        let mut values: Vec<f64> = Vec::with_capacity(42 * channels);
        let mut control = vec![0.0; PRODUCTS * channels];
        let mut mean_width = 0.0;
        let [box_from, box_width] = place;
        for node in nodes {
            let seen = node.intervals.get(interval as usize);
            let &[from, width] = seen.unwrap_or(&[0.0; 2]);
            mean_width += node.weight * width.abs() * box_width;
            for (place, weight) in to_the_ends() {
                let omega = from + width * (box_from + box_width * place);
                let first = values.len();
                values.resize(first + channels, 0.0);
                (self.seen)(&node.x, omega, &mut values[first..]);
                let terms = products(&node.psi, place);
                let weight = node.weight * weight;
                for (control, value) in control.chunks_exact_mut(PRODUCTS).zip(&values[first..]) {
                    for (c, term) in control.iter_mut().zip(terms) {
                        *c += weight * value * term;
                    }
                }
                samples.push((weight, terms));
            }
        }
        let mut shares = vec![0.0; channels];
        for ((weight, terms), values) in samples.iter().zip(values.chunks_exact(channels)) {
            let controls = control.chunks_exact(PRODUCTS);
            for ((square, value), control) in shares.iter_mut().zip(values).zip(controls) {
                let off = value - combined::<f64, PRODUCTS>(control, terms);
                *square += weight * off * off;
            }
        }
        let mut largest = 0.0;
        for (channel, share) in shares.iter_mut().enumerate() {
            *share = mean_width * Real::sqrt(*share);
            largest = Real::max(largest, self.weight(channel) * *share);
        }
        Fitted {
            place,
            interval,
            width: mean_width,
            control,
            shares,
            share: largest,
        }
    }
}

/// The noise of a channel: the sum of its shares of boxes.
fn noise_of(boxes: &[Fitted], channel: usize) -> f64 {
    boxes.iter().map(|fitted| fitted.shares[channel]).sum()
}

/// A polynomial of the place in a stretch that an integral is near to.
struct Polynomial {
    integral: [f64; PLACES],
    /// The largest difference between both.
    worst: f64,
    /// The largest value.
    largest: f64,
}

/// The polynomial that a mean times the width of an interval is near to, by the places that have a weight.
fn polynomial(mean: &[f64; TERMS], widths: &[(f64, [f64; PLACES], f64)]) -> Polynomial {
    let exact = |width: f64, psi: &[f64; PLACES]| width * combined::<f64, TERMS>(mean, psi);
    let mut integral = [0.0; PLACES];
    for (width, psi, weight) in widths {
        let value = exact(*width, psi);
        for (integral, psi) in integral.iter_mut().zip(psi) {
            *integral += weight * value * psi;
        }
    }
    let (mut worst, mut largest) = (0.0, 0.0);
    for (width, psi, _) in widths {
        let value = exact(*width, psi);
        let off = value - combined::<f64, PLACES>(&integral, psi);
        worst = Real::max(worst, off.abs());
        largest = Real::max(largest, value.abs());
    }
    Polynomial {
        integral,
        worst,
        largest,
    }
}

/// Six Gauss points of the unit interval, and weights that sum to 1: two more than c has degrees tell what it lacks.
fn fit() -> impl Iterator<Item = (f64, f64)> {
    gauss::<f64>(1).map(|(t, weight)| (0.5 + 0.5 * t, 0.5 * weight))
}

/// Seven Gauss–Lobatto points of the unit interval, as exact as six of Gauss, and weights that sum to 1. They look at the ends,
/// next to which a kink would be overlooked; a hair within, as a ray to a vertex may lead past it.
fn to_the_ends() -> impl Iterator<Item = (f64, f64)> {
    const HALF: [(f64, f64); 3] = [
        (1.0 - 2.0 * HAIR, 1.0 / 42.0),
        (0.830_223_896_278_567, 0.138_413_023_680_782_97),
        (0.468_848_793_470_714_2, 0.215_872_690_604_931_3),
    ];
    let ends = HALF
        .into_iter()
        .flat_map(|(t, weight)| [(t, weight), (-t, weight)]);
    let all = ends.chain([(0.0, 128.0 / 525.0)]);
    all.map(|(t, weight)| (0.5 + 0.5 * t, weight))
}

/// Probabilities of boxes, as growing sums: by what v − c is in them, and a part by their widths.
fn shares(boxes: &[Fitted]) -> Vec<Share> {
    let least = LEAST / boxes.len() as f64;
    let width = |fitted: &Fitted| fitted.width.max(least);
    let widths: f64 = boxes.iter().map(width).sum();
    let noise: f64 = boxes.iter().map(|fitted| fitted.share).sum();
    let even = if noise > 0.0 { EVEN } else { 1.0 };
    let mut sum = 0.0;
    let mut sums: Vec<Share> = Vec::with_capacity(boxes.len());
    for fitted in boxes {
        sum += even * width(fitted) / widths;
        if noise > 0.0 {
            sum += (1.0 - even) * fitted.share / noise;
        }
        // The least probability is far above what rounding takes from it.
        sums.push(Share {
            sum: sum as f32,
            interval: fitted.interval,
        });
    }
    if let Some(last) = sums.last_mut() {
        last.sum = 1.0;
    }
    sums
}
