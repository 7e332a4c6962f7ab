//! Tables of the control variate of a neighbour equation with h = k.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::Source;
use fredholm_core::array::Each;
use fredholm_core::galerkin::{Basis, Partition, legendre};

use crate::panels::gauss;
use crate::rays::{
    GAUSS, Interval, PLACES, PRODUCTS, RayBox, Share, Stretch, TERMS, between, product, products,
};
use crate::shadows::Shadows;
use crate::views::{Edge, ShadowEnd, edges, parts};
use crate::{Point, PolynomialRoom, Room, RoomError};

/// Boxes are no wider than this part of all directions: a jump within one is not overlooked.
const WIDEST: f64 = 1.0 / 16.0;
/// The most boxes of a stretch: twice as many cost up to twice the set-up, and save less than a tenth of the standard deviation. What
/// is left then are jumps of v from cell to cell, which cross boxes as x moves.
const BOXES: usize = 128;
/// The standard deviation of G relative to the residual of v, which no ray can mend, at which boxes are narrow enough: a
/// variance of a quarter of its square.
const NOISE: f64 = 0.5;
/// The part of the probabilities that follows widths alone, so that no ray weighs more than five times the mean.
const EVEN: f64 = 0.2;
/// The least width for that part, relative to the mean: a box that is empty where it was looked at may be none elsewhere.
const LEAST: f64 = 0.01;
/// The points from which the residual of v is looked at.
const PROBES: usize = 128;
/// How often an interval of directions, in which v is looked at from there, is halved towards its ends: from near a corner
/// the next wall is seen from there to its far end within a small part of the angle.
const GRADES: i32 = 12;

/// The standard deviation that polynomials for integrals of c may add, as a part of that of a ray: a hundredth of the variance.
const FAR: f64 = 0.1;
/// The places of a stretch in which these polynomials are looked at.
const LOOKS: u32 = 16;

/// How far within a box its ends are looked at, as a part of it: far beyond rounding in ω, and so little that products of
/// polynomials stay orthogonal to ten digits.
const HAIR: f64 = 1.0 / (1_u64 << 33) as f64;

/// The set-up of a [`RayNeighbour`](crate::RayNeighbour), cell by cell.
///
/// ```
/// use fredholm_core::galerkin::Partition;
/// use fredholm_core::{At, Batch, Estimator, Form, Length, Task, WalkSeeds};
/// use fredholm_room::{
///     Enclosure, Grading, Material, Matrix, Mesh, RaySetup, RayTables, Room, Scene, Surface, Tables,
/// };
///
/// let grey = [Material { reflectance: 0.5, emission: 0.0 }];
/// let lamp = [Material { reflectance: 0.1, emission: 1.0 }];
/// let surfaces = [
///     Surface { points: &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], materials: &grey },
///     Surface { points: &[[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], materials: &lamp },
/// ];
/// let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
/// let mesh = Mesh::new::<f64>(&scene, 60, Grading::default())?;
/// let matrix = Matrix::with_functions(&scene, &mesh, 0.5, 2)?;
/// let v = matrix.solve(&scene, &mesh, 1e-14, 1000)?.v;
///
/// let tables = Tables::<f64>::new(&scene, &mesh);
/// let room = Room::new(tables.geometry(), tables.cells(), matrix.views(), 0.5)?;
/// let polynomials = room.with_functions::<2>();
/// let setup = RaySetup::new(&polynomials, &v)?;
/// let cells = (0..polynomials.cells()).map(|i| setup.cell(i)).collect::<Result<Vec<_>, _>>()?;
/// let rays = RayTables::new(cells)?;
/// let neighbour = rays.neighbour(&polynomials, &v)?;
///
/// // Radiosity in the middle of the floor by 10,000 walks.
/// let start = At(room.point(0, 0.5)?);
/// let task = Task {
///     equation: &room,
///     neighbour: &neighbour,
///     functional: &start,
///     control_mean: None,
///     estimator: Estimator::Absorption,
///     form: Form::Product,
///     seeds: <WalkSeeds>::new(1, 0),
///     length: Length::default(),
/// };
/// let mut batch = Batch::new(0, 10_000, 10_000);
/// batch.run(&task, u64::MAX)?;
/// let (plain, best) = (batch.statistics().plain(), batch.statistics().preconditioned());
/// assert!(best.std_error.unwrap() < plain.std_error.unwrap() / 100.0);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct RaySetup<'s, 'r, 'a, const B: usize> {
    polynomials: &'s PolynomialRoom<'r, 'a, f64, B>,
    v: &'s [f64],
    /// The standard deviation of a ray's estimate of T_k v/ρ that is small enough.
    noise: f64,
    /// Where boxes end besides at vertices.
    shadows: &'s [ShadowEnd],
}

/// The tables of one cell.
#[derive(Clone, Debug, Default)]
pub struct CellRays {
    /// Stretches, whose numbers of intervals and boxes begin at 0.
    pub(crate) stretches: Vec<Stretch<f64>>,
    pub(crate) intervals: Vec<Interval<f64>>,
    pub(crate) boxes: Vec<RayBox<f64>>,
    pub(crate) shares: Vec<Share>,
}

/// A box, and what was learned of it.
#[derive(Clone, Copy, Debug)]
struct Fitted {
    ray_box: RayBox<f64>,
    /// The number of its interval within the stretch.
    interval: u32,
    /// The box's mean width as seen from the stretch, in ω.
    width: f64,
    /// The width times the root mean square of v − c.
    share: f64,
}

/// What makes tables, whatever the number of functions on a cell: compiled once.
struct Builder<'s> {
    room: &'s Room<'s, f64>,
    /// v where a ray from a point leads, by its ω; 0 where it leaves.
    seen: &'s dyn Fn(&Point<f64>, f64) -> f64,
    noise: f64,
    shadows: &'s [ShadowEnd],
}

/// A node of a stretch: where it is, and what it sees.
struct Viewpoint {
    x: Point<f64>,
    psi: [f64; TERMS],
    weight: f64,
    /// Where intervals begin, and their widths.
    intervals: Vec<[f64; 2]>,
}

impl<'s, 'r, 'a, const B: usize> RaySetup<'s, 'r, 'a, B> {
    /// A set-up for v, which has B numbers for every cell. Looks from a few points at how good it is.
    ///
    /// # Errors
    /// [`RoomError::Length`].
    pub fn new(
        polynomials: &'s PolynomialRoom<'r, 'a, f64, B>,
        v: &'s [f64],
    ) -> Result<Self, RoomError> {
        let (expected, found) = (polynomials.cells() * B, v.len());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        let mut setup = Self {
            polynomials,
            v,
            noise: 0.0,
            shadows: &[],
        };
        setup.noise = NOISE * setup.residual();
        Ok(setup)
    }

    /// Lets boxes end at the ends of shadows, too, where v has kinks: with 100 to 400 cells of degree 4 around a corner that leaves a
    /// fifth of the standard deviation.
    #[must_use]
    pub fn with_shadows(mut self, shadows: &'s Shadows) -> Self {
        self.shadows = shadows.all();
        self
    }

    /// The root mean square of v − T_k v − F over ρ, over the walls.
    fn residual(&self) -> f64 {
        let room = self.polynomials.room();
        let cells = self.polynomials.cells();
        let (mut sum, mut all) = (0.0, 0.0);
        let seen = |x: &Point<f64>, omega| self.seen(x, omega);
        let builder = self.builder(&seen);
        for probe in 0..PROBES.min(cells) {
            let cell = probe * cells / PROBES.min(cells);
            // One of the zeros of no low Legendre polynomial, another from probe to probe.
            let t = 0.06 + 0.88 * ((probe as f64 * 0.618_033_988_749_894_9) % 1.0);
            let Some(x) = room.inside(cell, t) else {
                continue;
            };
            let Some(wall) = room.geometry().wall(x.wall() as u32) else {
                continue;
            };
            if wall.reflectance > 0.0 {
                let emitted = (self.value(&x) - room.source(&x)) / wall.reflectance;
                let seen = self.polynomials.irradiance_of(&x, self.v);
                let residual = emitted - seen - builder.irradiance_of_light(&x, cell, t);
                let length = room.table().length(cell);
                sum += length * residual * residual;
                all += length;
            }
        }
        if all > 0.0 {
            Real::sqrt(sum / all)
        } else {
            0.0
        }
    }

    fn value(&self, x: &Point<f64>) -> f64 {
        let cell = self.polynomials.locate(x);
        let psi = self
            .polynomials
            .basis(&fredholm_core::Located { point: *x, cell });
        let own = self.v.get(cell * B..).unwrap_or(&[]);
        let light = self.polynomials.room().reflected_light(x);
        light + own.iter().zip(psi).map(|(v, psi)| v * psi).sum::<f64>()
    }

    /// v where a ray leads; 0 where it leaves.
    fn seen(&self, x: &Point<f64>, omega: f64) -> f64 {
        let y = self.polynomials.room().ray(x, omega);
        y.map_or(0.0, |y| self.value(&y))
    }

    const fn builder<'b>(&'b self, seen: &'b dyn Fn(&Point<f64>, f64) -> f64) -> Builder<'b> {
        Builder {
            room: self.polynomials.room(),
            seen,
            noise: self.noise,
            shadows: self.shadows,
        }
    }

    /// The tables of a cell.
    ///
    /// # Errors
    /// [`RoomError::Galerkin`]: no memory.
    pub fn cell(&self, cell: usize) -> Result<CellRays, RoomError> {
        let seen = |x: &Point<f64>, omega| self.seen(x, omega);
        Ok(self.builder(&seen).cell(cell))
    }
}

impl Builder<'_> {
    /// The tables of a cell.
    fn cell(&self, cell: usize) -> CellRays {
        let mut rays = CellRays::default();
        for part in parts(self.room, cell, self.shadows) {
            self.stretch(cell, part, &mut rays);
        }
        rays
    }

    /// What walls throw on x that lights throw on them, by Gauss points between the directions of vertices: it has no closed
    /// integral. That of the polynomials has one, and their jumps from cell to cell would be lost between such points.
    fn irradiance_of_light(&self, x: &Point<f64>, cell: usize, t: f64) -> f64 {
        let room = self.room;
        if room.lights().is_empty() {
            return 0.0;
        }
        let Some(wall) = room.geometry().wall(x.wall() as u32) else {
            return f64::NAN;
        };
        let intervals = intervals(&edges(self.room, cell, t, &[]));
        let mut sum = 0.0;
        for k in 0..intervals.len() {
            let [from, width] = between(&intervals, k, x.position(), wall.tangent);
            // ω = (1 − cos θ)/2: in θ there is no root at the horizon.
            let angle = |omega: f64| {
                let square = Real::max(omega * (1.0 - omega), 0.0);
                Real::atan2(2.0 * Real::sqrt(square), 1.0 - 2.0 * omega)
            };
            let (begin, end) = (angle(from), angle(from + width));
            for (part, size) in panels() {
                for (place, weight) in GAUSS {
                    let theta = begin + (end - begin) * (part + size * place);
                    let share = 0.5 * Real::sin(theta) * (end - begin) * size * weight;
                    let y = room.scatter(x, 0.5 - 0.5 * Real::cos(theta));
                    sum += share * y.map_or(0.0, |y| room.reflected_light(&y));
                }
            }
        }
        sum
    }

    /// Adds a part of a cell to its tables.
    fn stretch(&self, cell: usize, [from, to]: [f64; 2], rays: &mut CellRays) {
        let mut intervals = intervals(&edges(self.room, cell, 0.5 * (from + to), self.shadows));
        let nodes: Vec<Viewpoint> = self.viewpoints(cell, [from, to], &intervals);
        let mut boxes: Vec<Fitted> = Vec::new();
        for number in 0..intervals.len() as u32 {
            let whole = RayBox {
                from: 0.0,
                width: 1.0,
                control: [0.0; PRODUCTS],
            };
            boxes.push(self.fitted((whole, number), &nodes));
        }
        loop {
            let noise: f64 = boxes.iter().map(|fitted| fitted.share).sum();
            let is_wide = |fitted: &Fitted| fitted.width > WIDEST;
            let worst = match boxes.iter().position(is_wide) {
                Some(wide) => Some(wide),
                None if noise > self.noise => {
                    let numbers = boxes.iter().enumerate();
                    let worst = numbers.max_by(|a, b| a.1.share.total_cmp(&b.1.share));
                    worst.map(|(number, _)| number)
                }
                None => None,
            };
            let Some(worst) = worst.filter(|_| boxes.len() < BOXES) else {
                break;
            };
            let Fitted {
                ray_box, interval, ..
            } = boxes[worst];
            let halves = ray_box.halves();
            let halves = halves.map(|half| self.fitted((half, interval), &nodes));
            boxes.splice(worst..=worst, halves);
        }
        for Fitted {
            ray_box, interval, ..
        } in &boxes
        {
            if let Some(interval) = intervals.get_mut(*interval as usize) {
                interval.add(ray_box);
            }
        }
        let shares = shares(&boxes);
        let mut stretch = Stretch {
            from,
            interval: rays.intervals.len() as u32,
            ray_box: rays.boxes.len() as u32,
            near: [0; 2],
            integral: [0.0; PLACES],
        };
        self.integrate((cell, to), &mut stretch, &mut intervals, (&boxes, &shares));
        rays.stretches.push(stretch);
        rays.shares.extend(shares);
        rays.intervals.extend(intervals);
        rays.boxes.extend(boxes.iter().map(|fitted| fitted.ray_box));
    }

    /// Finds the polynomials that integrals of c over intervals are near to, and the intervals that have none.
    fn integrate(
        &self,
        (cell, to): (usize, f64),
        stretch: &mut Stretch<f64>,
        intervals: &mut [Interval<f64>],
        (boxes, shares): (&[Fitted], &[Share]),
    ) {
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
        let noise: f64 = boxes.iter().map(|fitted| fitted.share).sum();
        let noise = FAR * Real::max(noise, self.noise);
        for k in 0..intervals.len() {
            let mean = intervals[k].mean;
            let exact = |&(position, tangent, psi, weight): &(_, _, [f64; PLACES], f64)| {
                let [_, width] = between(intervals, k, position, tangent);
                let terms = mean.iter().zip(psi).map(|(mean, psi)| mean * psi);
                (width * terms.sum::<f64>(), psi, weight)
            };
            let values: Vec<_> = places.iter().map(exact).collect();
            let mut integral = [0.0; PLACES];
            for (value, psi, weight) in &values {
                for (integral, psi) in integral.iter_mut().zip(psi) {
                    *integral += weight * value * psi;
                }
            }
            let (mut worst, mut largest) = (0.0, 0.0);
            for (value, psi, _) in &values {
                worst = Real::max(worst, (value - product(&integral, psi)).abs());
                largest = Real::max(largest, value.abs());
            }
            let (mut before, mut probability, mut variance) = (0.0, 0.0, 0.0);
            for (fitted, share) in boxes.iter().zip(shares) {
                let sum = f64::from(share.sum);
                if share.interval as usize == k {
                    probability += sum - before;
                    let added = worst * fitted.ray_box.width;
                    variance += added * added / (sum - before);
                }
                before = sum;
            }
            if variance <= noise * noise * probability || worst <= 16.0 * f64::EPSILON * largest {
                intervals[k].integral = integral;
                for (sum, own) in stretch.integral.iter_mut().zip(integral) {
                    *sum += own;
                }
            } else {
                stretch.near[k / 32 % 2] |= 1 << (k % 32);
            }
        }
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
    fn fitted(&self, (mut ray_box, interval): (RayBox<f64>, u32), nodes: &[Viewpoint]) -> Fitted {
        let mut samples: Vec<(f64, [f64; PRODUCTS], f64)> = Vec::with_capacity(42);
        let (mut mean_width, mut squares) = (0.0, 0.0);
        ray_box.control = [0.0; PRODUCTS];
        for node in nodes {
            let own = node.intervals.get(interval as usize);
            let &[from, width] = own.unwrap_or(&[0.0; 2]);
            mean_width += node.weight * width.abs() * ray_box.width;
            for (place, weight) in to_the_ends() {
                let omega = from + width * (ray_box.from + ray_box.width * place);
                let (value, terms) = ((self.seen)(&node.x, omega), products(&node.psi, place));
                let weight = node.weight * weight;
                for (c, term) in ray_box.control.iter_mut().zip(terms) {
                    *c += weight * value * term;
                }
                samples.push((weight, terms, value));
            }
        }
        for (weight, terms, value) in samples {
            let fit: f64 = ray_box.control.iter().zip(terms).map(|(c, t)| c * t).sum();
            squares += weight * (value - fit) * (value - fit);
        }
        Fitted {
            ray_box,
            interval,
            width: mean_width,
            share: mean_width * Real::sqrt(squares),
        }
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

/// Where parts of the unit interval begin, and their widths: halves of halves towards both ends, each in two parts.
fn panels() -> impl Iterator<Item = (f64, f64)> {
    let half = |grade: i32| {
        let to = 0.5 / f64::from(1 << grade);
        let from = if grade == GRADES { 0.0 } else { 0.5 * to };
        (from, 0.5 * (to - from))
    };
    let halves = (0..=GRADES).map(half);
    halves.flat_map(|(from, size)| {
        let first = [(from, size), (from + size, size)];
        let last = first.each(|(from, size)| (1.0 - from - size, size));
        first.into_iter().chain(last)
    })
}

/// The intervals between vertices, with a c of 0.
fn intervals(edges: &[Edge]) -> Vec<Interval<f64>> {
    let ends = edges.iter().map(|edge| edge.position).chain([[0.0; 2]]);
    let interval = |end| Interval {
        end,
        mean: [0.0; TERMS],
        integral: [0.0; PLACES],
    };
    ends.map(interval).collect()
}

impl RayBox<f64> {
    /// The two halves of the box, whose places are exact in every scalar.
    fn halves(&self) -> [Self; 2] {
        let width = 0.5 * self.width;
        [self.from, self.from + width].each(|from| Self {
            from,
            width,
            ..*self
        })
    }
}

impl<F: Real> Interval<F> {
    /// Adds a box's part of the mean of c: the functions of s have none but the first.
    pub(crate) fn add(&mut self, ray_box: &RayBox<F>) {
        let mut first = 0;
        for (degree, mean) in self.mean.iter_mut().enumerate() {
            if let Some(&term) = ray_box.control.get(first) {
                *mean += ray_box.width * term;
            }
            first += TERMS - degree;
        }
    }
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

#[cfg(test)]
mod tests {
    use alloc::boxed::Box;

    use crate::{
        Enclosure, Grading, Material, Matrix, Mesh, RaySetup, Room, Scene, Surface, Tables,
    };

    /// It is 8.2e-6 on 60 cells and 1.0e-6 on 240. Gauss points alone, between which jumps from cell to cell are lost, told of
    /// 4.4e-6 on these, and of no less on more.
    #[test]
    fn the_residual_falls_with_the_cells() -> Result<(), Box<dyn core::error::Error>> {
        let [grey, lamp] = [(0.5, 0.0), (0.1, 1.0)].map(|(reflectance, emission)| {
            [Material {
                reflectance,
                emission,
            }]
        });
        // Around a corner.
        let surfaces = [
            Surface {
                points: &[[0.0, 0.0], [2.4, 0.0], [2.4, 1.2], [1.2, 1.2]],
                materials: &grey,
            },
            Surface {
                points: &[[1.2, 1.2], [1.2, 0.75]],
                materials: &lamp,
            },
            Surface {
                points: &[[1.2, 0.75], [0.0, 0.75], [0.0, 0.0]],
                materials: &grey,
            },
        ];
        let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed)?;
        let residual = |cells: usize| -> Result<f64, Box<dyn core::error::Error>> {
            let mesh = Mesh::new::<f64>(&scene, cells, Grading::default())?;
            let matrix = Matrix::with_functions(&scene, &mesh, 0.5, 5)?;
            let v = matrix.solve(&scene, &mesh, 1e-14, 1000)?.v;
            let tables = Tables::<f64>::new(&scene, &mesh);
            let room = Room::new(tables.geometry(), tables.cells(), matrix.views(), 0.5)?;
            let polynomials = room.with_functions::<5>();
            Ok(RaySetup::new(&polynomials, &v)?.residual())
        };
        let [few, many] = [residual(60)?, residual(240)?];
        assert!(4.0 * many < few, "{few:e}, {many:e}");
        Ok(())
    }
}
