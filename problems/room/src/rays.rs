//! A neighbour equation with h = k whose G takes one ray.

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Basis, Partition, legendre};
use fredholm_core::{Kernel, Located, Neighbour, Real, StateSpace, Uniforms};
use num_traits::{one, zero};

use crate::vector::{Vector, dot, sub};
use crate::{Point, PolynomialRoom, RoomError};

/// Functions of the place in a cell, and of that in a box of directions.
pub(crate) const TERMS: usize = 5;
/// Their products of a total degree of four at most: 1, s, s², …, then x, x s, …, then x², and so on.
pub(crate) const PRODUCTS: usize = TERMS * (TERMS + 1) / 2;

/// A part of a cell from which the same walls are seen in the same order, or nearly so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch<F> {
    /// Where it begins, as a fraction of the cell. It ends where the next one of the cell begins, or the cell ends.
    pub from: F,
    /// The number of its first interval of directions.
    pub interval: u32,
    /// The number of its first box.
    pub ray_box: u32,
}

/// Directions between two vertices, in which one wall is seen. The next interval begins where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval<F> {
    /// The vertex towards which it ends; the last interval of a stretch ends along the wall.
    pub end: [F; 2],
    /// The mean of c over the interval: the coefficients of the functions of the place in the stretch.
    pub mean: [F; TERMS],
}

/// A box: a fraction of an interval of directions, where c is a polynomial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayBox<F> {
    /// The number of its interval within the stretch.
    pub interval: u32,
    /// Where it begins, as a fraction of the interval.
    pub from: F,
    /// The width of the box, as a fraction of the interval.
    pub width: F,
    /// c: the coefficients of 1, s, s², …, x, x s, … up to a total degree of four, each product of normalised Legendre polynomials
    /// of the place x in the stretch and s in the box.
    pub control: [F; PRODUCTS],
}

/// The tables of the control variate of a [`RayNeighbour`], borrowed.
#[derive(Clone, Copy, Debug)]
pub struct RayControl<'a, F> {
    /// The number of the first stretch of every cell, and of all stretches.
    pub first: &'a [u32],
    /// The stretches, and one more that begins where the tables end.
    pub stretches: &'a [Stretch<F>],
    /// The intervals of all stretches.
    pub intervals: &'a [Interval<F>],
    /// The boxes of all stretches, each with those of an interval one after the other.
    pub boxes: &'a [RayBox<F>],
    /// For every box the probability of it and of those before it in its stretch: growing, and 1 at the last.
    pub cumulative: &'a [F],
}

/// Intervals, boxes and growing sums of probabilities of a stretch.
type Parts<'a, F> = (&'a [Interval<F>], &'a [RayBox<F>], &'a [F]);

/// What is seen from a point.
struct View<'a, F> {
    /// ψ of the place in the stretch.
    psi: [F; TERMS],
    intervals: &'a [Interval<F>],
    boxes: &'a [RayBox<F>],
    cumulative: &'a [F],
}

/// The neighbour equation v = T_k v + G of any v in a room, with an unbiased estimate of G from **one** ray.
///
/// A ray that leaves x by the cosine law is a function of one uniform number ω, sin φ = 2ω − 1, so that
///
/// ```text
/// G(x) = v(x) − (T_k v)(x),    (T_k v)(x) = ρ ∫_0^1 v(y(x, ω)) dω.
/// ```
///
/// v(y(x, ω)) jumps in the directions of vertices alone, and these are known: ω_e(x) of every vertex is a formula. Between
/// two of them c(x, ω) is a polynomial of x and of the place between the two, in boxes, so that its integral over ω is a
/// table times ω_(e+1)(x) − ω_e(x). A box is drawn by the part that v − c has in it, and a ray into the box gives what c
/// lacks:
///
/// ```text
/// G(x) ≈ v(x) − ρ (∫ c(x, ω) dω + (v(y(x, ω)) − c(x, ω)) × (the box's width at x)/(its probability)).
/// ```
///
/// The mean is G(x) for any v and any c. There are no pairs of cells: no form factors, no moments, and a score takes as long
/// for 10,000 cells as for 100. It is the control variate of [`fredholm_core::sampled`] with boxes that move with x.
///
/// In a room [with lights](crate::Room::with_lights) the equation is that of w = u − F_s, and the v of all this is T_K F_s, which is
/// known in every point, plus the polynomials: where they are near what was reflected twice or more, neither a small light nor
/// the edge of its shadow leaves any variance.
///
/// Tables come from a [`RaySetup`](crate::RaySetup), with an example.
#[derive(Clone, Copy, Debug)]
pub struct RayNeighbour<'n, 'r, 'a, F, const B: usize> {
    polynomials: &'n PolynomialRoom<'r, 'a, F, B>,
    v: &'n [F],
    control: RayControl<'n, F>,
}

impl<'n, 'r, 'a, F: Real, const B: usize> RayNeighbour<'n, 'r, 'a, F, B> {
    /// The neighbour equation of v, which has B numbers for every cell.
    ///
    /// # Errors
    /// [`RoomError::Length`]: v has another length than n B. [`RoomError::Tables`]: a number in the tables leads nowhere, a
    /// stretch has no interval or no box, or probabilities do not grow to 1.
    pub fn new(
        polynomials: &'n PolynomialRoom<'r, 'a, F, B>,
        v: &'n [F],
        control: RayControl<'n, F>,
    ) -> Result<Self, RoomError> {
        let cells = polynomials.cells();
        let (expected, found) = (cells * B, v.len());
        if found != expected {
            return Err(RoomError::Length { expected, found });
        }
        let neighbour = Self {
            polynomials,
            v,
            control,
        };
        if neighbour.is_whole(cells) {
            Ok(neighbour)
        } else {
            Err(RoomError::Tables)
        }
    }

    /// Whether the tables are those of so many cells, and lead nowhere else.
    fn is_whole(&self, cells: usize) -> bool {
        let RayControl {
            first, stretches, ..
        } = self.control;
        let grow = first.iter().zip(first.iter().skip(1)).all(|(a, b)| a < b);
        let ends = first.first() == Some(&0)
            && first
                .last()
                .is_some_and(|&last| last as usize + 1 == stretches.len());
        let is_right = |number: usize| {
            let Some((intervals, boxes, cumulative)) = self.stretch(number) else {
                return false;
            };
            let of_intervals = boxes
                .iter()
                .all(|b| (b.interval as usize) < intervals.len());
            let mut before = zero::<F>();
            let grows = cumulative.iter().all(|&now| {
                let grows = now > before;
                before = now;
                grows
            });
            !intervals.is_empty() && of_intervals && grows && before == one()
        };
        first.len() == cells + 1
            && grow
            && ends
            && (0..stretches.len().saturating_sub(1)).all(is_right)
    }

    /// Intervals, boxes and probabilities of a stretch.
    #[inline]
    fn stretch(&self, number: usize) -> Option<Parts<'n, F>> {
        let control = &self.control;
        let [own, next, ..] = control.stretches.get(number..)? else {
            return None;
        };
        let intervals = own.interval as usize..next.interval as usize;
        let boxes = own.ray_box as usize..next.ray_box as usize;
        Some((
            control.intervals.get(intervals)?,
            control.boxes.get(boxes.clone())?,
            control.cumulative.get(boxes)?,
        ))
    }

    #[inline]
    fn view(&self, x: &Located<Point<F>>) -> Option<View<'n, F>> {
        let control = &self.control;
        let [from, to, ..] = *control.first.get(x.cell..)? else {
            return None;
        };
        let own = control.stretches.get(from as usize..to as usize)?;
        let half = F::from_f64(0.5);
        let t = half + half * self.polynomials.room().coordinate(&x.point, x.cell);
        // The first begins where the cell does.
        let later = own.get(1..).unwrap_or(&[]);
        let number = later.partition_point(|stretch| stretch.from <= t);
        let start = own.get(number)?.from;
        let end = own.get(number + 1).map_or(one(), |next| next.from);
        let place = (t - start) / (end - start);
        let (intervals, boxes, cumulative) = self.stretch(from as usize + number)?;
        Some(View {
            psi: legendre(place + place - one()),
            intervals,
            boxes,
            cumulative,
        })
    }

    /// v(y) where a ray from x leads; 0 where it leaves.
    #[inline]
    fn seen(&self, x: &Point<F>, omega: F) -> F {
        let y = self.polynomials.room().ray(x, omega);
        y.map_or(zero(), |y| self.value(&self.locate(y)))
    }

    /// The estimate of G, of a box by its number and a place in it.
    #[inline]
    fn draw(&self, x: &Located<Point<F>>, chosen: F, place: F) -> Option<F> {
        let view = self.view(x)?;
        let last = view.cumulative.len().checked_sub(1)?;
        let number = view.cumulative.partition_point(|&sum| sum <= chosen);
        let number = if number < last { number } else { last };
        let before = number.checked_sub(1);
        let before = before.and_then(|before| view.cumulative.get(before));
        let probability = *view.cumulative.get(number)? - before.copied().unwrap_or(zero());
        let ray_box = view.boxes.get(number)?;
        let (mut sum, mut own) = (zero::<F>(), [zero(); 2]);
        let tangent = self
            .polynomials
            .room()
            .geometry()
            .wall(x.point.wall() as u32)?
            .tangent;
        each_interval(
            view.intervals,
            x.point.position(),
            tangent,
            |k, from, width| {
                if let Some(interval) = view.intervals.get(k) {
                    sum += width * product(&interval.mean, &view.psi);
                }
                if k == ray_box.interval as usize {
                    own = [from, width];
                }
            },
        );
        let [from, width] = own;
        if width > zero() {
            let omega = from + width * (ray_box.from + ray_box.width * place);
            let lacks = self.seen(&x.point, omega) - control(&ray_box.control, &view.psi, place);
            sum += lacks * width * ray_box.width / probability;
        }
        Some(self.value(x) - self.polynomials.room().reflectance(&x.point) * sum)
    }

    /// The integral of v over all directions, and the variance of the estimate of G, by Gauss points in quarters of all boxes:
    /// of a jump in one they know the place to a sixteenth.
    fn moments(&self, x: &Located<Point<F>>) -> Option<[F; 2]> {
        let view = self.view(x)?;
        let wall = self
            .polynomials
            .room()
            .geometry()
            .wall(x.point.wall() as u32)?;
        let (mut squares, mut mean, mut known) = (zero::<F>(), zero::<F>(), zero::<F>());
        let mut boxes = view.boxes.iter().zip(view.cumulative).peekable();
        let mut before = zero::<F>();
        each_interval(
            view.intervals,
            x.point.position(),
            wall.tangent,
            |k, from, width| {
                if let Some(interval) = view.intervals.get(k) {
                    known += width * product(&interval.mean, &view.psi);
                }
                while let Some((ray_box, &sum)) =
                    boxes.next_if(|(ray_box, _)| ray_box.interval as usize == k)
                {
                    let probability = sum - before;
                    before = sum;
                    let area = width * ray_box.width;
                    for (place, weight) in PARTS.into_iter().flat_map(in_part) {
                        let [place, weight] = [place, weight].map(F::from_f64);
                        let omega = from + width * (ray_box.from + ray_box.width * place);
                        let lacks = self.seen(&x.point, omega)
                            - control(&ray_box.control, &view.psi, place);
                        mean += weight * area * lacks;
                        squares += weight * area * area * lacks * lacks / probability;
                    }
                }
            },
        );
        let reflectance = wall.reflectance;
        let variance = reflectance * reflectance * (squares - mean * mean).max(zero());
        Some([known + mean, variance])
    }
}

/// Where the quarters of a box begin.
const PARTS: [f64; 4] = [0.0, 0.25, 0.5, 0.75];

/// The Gauss points of a quarter, with their part of all weights.
fn in_part(from: f64) -> [(f64, f64); 4] {
    GAUSS.each(|(place, weight)| (from + 0.25 * place, 0.25 * weight))
}

/// Four Gauss points of the unit interval, and weights that sum to 1.
pub(crate) const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Calls `each` with the number of every interval, the ω at which it begins and its width there, as seen from a point of a
/// wall. Together they are [0, 1], whatever the vertices are: an interval whose end is not behind its beginning is empty.
#[inline]
pub(crate) fn each_interval<F: Real>(
    intervals: &[Interval<F>],
    position: Vector<F>,
    tangent: Vector<F>,
    mut each: impl FnMut(usize, F, F),
) {
    let mut from = zero::<F>();
    let last = intervals.len().saturating_sub(1);
    for (k, interval) in intervals.iter().enumerate() {
        let to = if k == last {
            one()
        } else {
            // NaN, in the vertex itself, is the beginning.
            let to = omega_of(position, tangent, interval.end).max(from);
            if to < one() { to } else { one() }
        };
        each(k, from, to - from);
        from = to;
    }
}

/// The ω of the ray from a point of a wall to a vertex: (1 + sin φ)/2.
#[inline]
pub(crate) fn omega_of<F: Real>(position: Vector<F>, tangent: Vector<F>, vertex: Vector<F>) -> F {
    let to = sub(vertex, position);
    let half = F::from_f64(0.5);
    half + half * dot(tangent, to) / dot(to, to).sqrt()
}

#[inline]
fn product<F: Real>(a: &[F; TERMS], b: &[F; TERMS]) -> F {
    a.iter().zip(b).fold(zero(), |sum, (&a, &b)| sum + a * b)
}

/// The products of which c is a combination, of ψ of a stretch and of a place in a box.
#[inline]
pub(crate) fn products<F: Real>(psi: &[F; TERMS], place: F) -> [F; PRODUCTS] {
    let s: [F; TERMS] = legendre(place + place - one());
    let mut products = [zero(); PRODUCTS];
    let mut out = products.iter_mut();
    for (degree, &psi) in psi.iter().enumerate() {
        for (&s, product) in s.iter().take(TERMS - degree).zip(&mut out) {
            *product = psi * s;
        }
    }
    products
}

/// c.
#[inline]
pub(crate) fn control<F: Real>(c: &[F; PRODUCTS], psi: &[F; TERMS], place: F) -> F {
    let terms = products(psi, place);
    let pairs = c.iter().zip(terms);
    pairs.fold(zero(), |sum, (&c, term)| sum + c * term)
}

impl<F: Real, const B: usize> StateSpace for RayNeighbour<'_, '_, '_, F, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<F: Real, const B: usize> Neighbour for RayNeighbour<'_, '_, '_, F, B> {
    #[inline]
    fn locate(&self, x: Point<F>) -> Located<Point<F>> {
        Located {
            point: x,
            cell: self.polynomials.locate(&x),
        }
    }

    /// h = k.
    #[inline]
    fn kernel(&self, _: &Located<Point<F>>, _: &Located<Point<F>>, k: F) -> F {
        k
    }

    fn source(&self, x: &Located<Point<F>>, draws: &mut dyn Uniforms<F>) -> F {
        let (chosen, place) = (draws.uniform(), draws.uniform());
        self.draw(x, chosen, place).unwrap_or(F::NAN)
    }

    fn source_moments(&self, x: &Located<Point<F>>) -> [F; 2] {
        let [all, variance] = self.moments(x).unwrap_or([F::NAN; 2]);
        // k does not depend on y: (1 − q0) k = ρ. What lights give to other walls has no closed integral.
        let seen = if self.polynomials.room().lights().is_empty() {
            F::from_f64(self.polynomials.irradiance_of(&x.point, self.v))
        } else {
            all
        };
        let kernel = self.polynomials.kernel(&x.point, &x.point);
        let mean = self.value(x) - kernel * self.polynomials.room().survival() * seen;
        [mean, variance]
    }

    #[inline]
    fn value(&self, x: &Located<Point<F>>) -> F {
        let own = self.v.get(x.cell * B..).and_then(<[F]>::first_chunk::<B>);
        let psi = self.polynomials.basis(x);
        let light = self.polynomials.room().reflected_light(&x.point);
        own.map_or(F::NAN, |own| {
            let terms = own.iter().zip(psi);
            terms.fold(light, |sum, (&v, psi)| sum + v * psi)
        })
    }
}
