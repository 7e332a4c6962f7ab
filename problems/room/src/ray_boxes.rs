//! Boxes of directions, and what c is in them: tables of a cell, whatever v is of.

use alloc::vec;
use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::galerkin::legendre;

use crate::panels::gauss;
use crate::rays::{
    Interval, PLACES, PRODUCTS, RayBox, Share, Stretch, TERMS, add_means, between, product,
    products,
};
use crate::views::{Edge, ShadowEnd, edges, parts};
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

/// The tables of one cell.
#[derive(Clone, Debug, Default)]
pub struct CellRays {
    /// Stretches, whose numbers of intervals and boxes begin at 0.
    pub(crate) stretches: Vec<Stretch<f64>>,
    pub(crate) intervals: Vec<Interval<f64>>,
    pub(crate) boxes: Vec<RayBox<f64>>,
    pub(crate) shares: Vec<Share>,
}

/// The tables of one cell in all channels: a number for each of them stands side by side for the first function, then for the next.
#[derive(Clone, Debug, Default)]
pub struct CellChannelRays {
    /// The tables without any channel, whose c is 0.
    pub(crate) rays: CellRays,
    /// The sums of integrals of every stretch.
    pub(crate) integrals: Vec<f64>,
    /// Means and integrals of every interval.
    pub(crate) means: Vec<f64>,
    pub(crate) of_intervals: Vec<f64>,
    /// c of every box.
    pub(crate) controls: Vec<f64>,
}

impl CellChannelRays {
    /// The tables of the only channel.
    pub(crate) fn alone(self) -> CellRays {
        let mut rays = self.rays;
        for (stretch, own) in rays.stretches.iter_mut().zip(rows(&self.integrals)) {
            stretch.integral = own;
        }
        let numbers = rows(&self.means).zip(rows(&self.of_intervals));
        for (interval, (mean, integral)) in rays.intervals.iter_mut().zip(numbers) {
            (interval.mean, interval.integral) = (mean, integral);
        }
        for (ray_box, control) in rays.boxes.iter_mut().zip(rows(&self.controls)) {
            ray_box.control = control;
        }
        rays
    }
}

/// The numbers of every function, of one channel.
fn rows<const N: usize>(all: &[f64]) -> impl Iterator<Item = [f64; N]> {
    all.chunks_exact(N)
        .filter_map(|own| own.first_chunk().copied())
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
    /// c: of every function a number for each channel.
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

impl Builder<'_> {
    /// The tables of a cell.
    pub(crate) fn cell(&self, cell: usize) -> CellChannelRays {
        let mut rays = CellChannelRays::default();
        for part in parts(self.room, cell, self.shadows) {
            self.stretch(cell, part, &mut rays);
        }
        rays
    }

    /// What a channel's noise counts beside that of the others: over what is small enough. One alone counts as it is.
    fn weight(&self, channel: usize) -> f64 {
        match *self.noise {
            [_] => 1.0,
            _ => match self.noise.get(channel) {
                Some(&noise) if noise > 0.0 => 1.0 / noise,
                _ => 0.0,
            },
        }
    }

    /// Adds a part of a cell to its tables.
    fn stretch(&self, cell: usize, [from, to]: [f64; 2], all: &mut CellChannelRays) {
        let channels = self.noise.len();
        let intervals = intervals(&edges(self.room, cell, 0.5 * (from + to), self.shadows));
        let nodes: Vec<Viewpoint> = self.viewpoints(cell, [from, to], &intervals);
        let mut boxes: Vec<Fitted> = Vec::new();
        for number in 0..intervals.len() as u32 {
            boxes.push(self.fitted([0.0, 1.0], number, &nodes));
        }
        // The channel that was noisy last is the first to be looked at.
        let mut noisy = 0;
        loop {
            let is_wide = |fitted: &Fitted| fitted.width > WIDEST;
            let worst = boxes.iter().position(is_wide).or_else(|| {
                let order = (0..channels).map(|k| (noisy + k) % channels);
                noisy = order
                    .into_iter()
                    .find(|&channel| noise_of(&boxes, channel) > self.noise[channel])?;
                let numbers = boxes.iter().enumerate();
                let share = |fitted: &Fitted| fitted.shares[noisy];
                let worst = numbers.max_by(|a, b| share(a.1).total_cmp(&share(b.1)));
                worst.map(|(number, _)| number)
            });
            let Some(worst) = worst.filter(|_| boxes.len() < BOXES) else {
                break;
            };
            let Fitted {
                place: [from, width],
                interval,
                ..
            } = boxes[worst];
            // Halves, whose places are exact in every scalar.
            let half = 0.5 * width;
            let halves =
                [from, from + half].map(|from| self.fitted([from, half], interval, &nodes));
            boxes.splice(worst..=worst, halves);
        }
        let shares = shares(&boxes);
        let rays = &mut all.rays;
        let mut stretch = Stretch {
            from,
            interval: rays.intervals.len() as u32,
            ray_box: rays.boxes.len() as u32,
            near: [0; 2],
            integral: [0.0; PLACES],
        };
        rays.boxes.extend(boxes.iter().map(|fitted| RayBox {
            from: fitted.place[0],
            width: fitted.place[1],
            control: [0.0; PRODUCTS],
        }));
        for fitted in &boxes {
            all.controls.extend(&fitted.control);
        }
        self.integrate((cell, to), &mut stretch, &intervals, (&boxes, &shares), all);
        let rays = &mut all.rays;
        rays.stretches.push(stretch);
        rays.shares.extend(shares);
        rays.intervals.extend(intervals);
    }

    /// Finds the polynomials that integrals of c over intervals are near to, and the intervals that have none in some channel.
    fn integrate(
        &self,
        (cell, to): (usize, f64),
        stretch: &mut Stretch<f64>,
        intervals: &[Interval<f64>],
        (boxes, shares): (&[Fitted], &[Share]),
        all: &mut CellChannelRays,
    ) {
        let channels = self.noise.len();
        let at = |(t, weight): (f64, f64)| {
            let x = self
                .room
                .inside(cell, stretch.from + t * (to - stretch.from))?;
            let tangent = self.room.geometry().wall(x.wall() as u32)?.tangent;
            let psi: [f64; PLACES] = legendre(t + t - 1.0);
            Some((x.position(), tangent, psi, weight))
        };
        // Those with a weight make the polynomials, the others look at them.
        let nodes = gauss::<f64>(3).map(|(t, weight)| (0.5 + 0.5 * t, 0.5 * weight));
        let looks = (0..LOOKS).map(|look| ((f64::from(look) + 0.5) / f64::from(LOOKS), 0.0));
        let places: Vec<_> = nodes.chain(looks).filter_map(at).collect();
        let noise: Vec<f64> = (0..channels)
            .map(|channel| FAR * Real::max(noise_of(boxes, channel), self.noise[channel]))
            .collect();
        let mut sums = vec![0.0; PLACES * channels];
        let mut own = vec![0.0; PLACES * channels];
        for k in 0..intervals.len() {
            let mut means = vec![0.0; TERMS * channels];
            // The probability of a ray in the interval, and the mean square of what a box's part of it weighs.
            let (mut before, mut probability, mut weights) = (0.0, 0.0, 0.0);
            for (fitted, share) in boxes.iter().zip(shares) {
                let sum = f64::from(share.sum);
                if share.interval as usize == k {
                    let [_, width] = fitted.place;
                    add_means(&mut means, width, &fitted.control, channels);
                    probability += sum - before;
                    weights += width * width / (sum - before);
                }
                before = sum;
            }
            let widths = places.iter().map(|&(position, tangent, psi, weight)| {
                let [_, width] = between(intervals, k, position, tangent);
                (width, psi, weight)
            });
            let widths: Vec<_> = widths.collect();
            let mut is_near = false;
            for (channel, noise) in noise.iter().enumerate() {
                let mut mean = [0.0; TERMS];
                let from = means.iter().skip(channel).step_by(channels);
                mean.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
                let (integral, worst, largest) = polynomial(&mean, &widths);
                let is_far = worst * worst * weights <= noise * noise * probability
                    || worst <= 16.0 * f64::EPSILON * largest;
                is_near |= !is_far;
                let to = own.iter_mut().skip(channel).step_by(channels);
                to.zip(integral).for_each(|(to, from)| *to = from);
            }
            if is_near {
                stretch.near[k / 32 % 2] |= 1 << (k % 32);
                own.fill(0.0);
            }
            for (sum, own) in sums.iter_mut().zip(&own) {
                *sum += own;
            }
            all.of_intervals.extend(&own);
            all.means.extend(means);
        }
        all.integrals.extend(sums);
    }

    /// The nodes of a part of a cell.
    fn viewpoints(
        &self,
        cell: usize,
        [from, to]: [f64; 2],
        intervals: &[Interval<f64>],
    ) -> Vec<Viewpoint> {
        let room = self.room;
        let at = |(t, weight): (f64, f64)| {
            let x = room.inside(cell, from + t * (to - from))?;
            let wall = room.geometry().wall(x.wall() as u32)?;
            let own = |k| between(intervals, k, x.position(), wall.tangent);
            Some(Viewpoint {
                x,
                psi: legendre(t + t - 1.0),
                weight,
                intervals: (0..intervals.len()).map(own).collect(),
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
        let mut weighted = vec![0.0; channels];
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
                for (weighted, value) in weighted.iter_mut().zip(&values[first..]) {
                    *weighted = weight * value;
                }
                for (control, term) in control.chunks_exact_mut(channels).zip(terms) {
                    for (c, value) in control.iter_mut().zip(&weighted) {
                        *c += value * term;
                    }
                }
                samples.push((weight, terms));
            }
        }
        let mut shares = vec![0.0; channels];
        let mut fit = weighted;
        for ((weight, terms), values) in samples.iter().zip(values.chunks_exact(channels)) {
            fit.fill(0.0);
            for (control, term) in control.chunks_exact(channels).zip(terms) {
                for (fit, c) in fit.iter_mut().zip(control) {
                    *fit += c * term;
                }
            }
            for ((square, value), fit) in shares.iter_mut().zip(values).zip(&fit) {
                *square += weight * (value - fit) * (value - fit);
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

/// The polynomial of the place that a mean times the width of an interval is near to, by the nodes that have a weight; the
/// largest difference between both; and the largest value.
fn polynomial(
    mean: &[f64; TERMS],
    widths: &[(f64, [f64; PLACES], f64)],
) -> ([f64; PLACES], f64, f64) {
    let exact = |width: f64, psi: &[f64; PLACES]| {
        let terms = mean.iter().zip(psi).map(|(mean, psi)| mean * psi);
        width * terms.sum::<f64>()
    };
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
        worst = Real::max(worst, (value - product(&integral, psi)).abs());
        largest = Real::max(largest, value.abs());
    }
    (integral, worst, largest)
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

/// The intervals between vertices, with a c of 0.
pub(crate) fn intervals(edges: &[Edge]) -> Vec<Interval<f64>> {
    let ends = edges.iter().map(|edge| edge.position).chain([[0.0; 2]]);
    let interval = |end| Interval {
        end,
        mean: [0.0; TERMS],
        integral: [0.0; PLACES],
    };
    ends.map(interval).collect()
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
