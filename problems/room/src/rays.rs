//! A neighbour equation with h = k whose G takes one ray.

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Basis, Partition, legendre};
use fredholm_core::{Kernel, Located, Neighbour, Real, StateSpace, Uniforms};
use num_traits::{one, zero};

use crate::vector::{Vector, dot, sub};
use crate::{Point, PolynomialRoom, Room, RoomError};

/// Functions of the place in a cell, and of that in a box of directions.
pub(crate) const TERMS: usize = 5;
/// Their products of a total degree of four at most: 1, s, s², …, then x, x s, …, then x², and so on.
pub(crate) const PRODUCTS: usize = TERMS * (TERMS + 1) / 2;
/// Functions of the place in a stretch of which integrals of c are combinations.
pub(crate) const PLACES: usize = 7;

/// A part of a cell from which the same walls are seen in the same order, or nearly so.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Stretch<F> {
    /// Where it begins, as a fraction of the cell. It ends where the next one of the cell begins, or the cell ends.
    pub from: F,
    /// The number of its first interval of directions.
    pub interval: u32,
    /// The number of its first box.
    pub ray_box: u32,
    /// A bit for every interval whose integral of c no polynomial is near to, from the lowest of the first word on.
    pub near: [u32; 2],
    /// The sum of [`Interval::integral`] over the other intervals. Where it is something else, there is a bias.
    pub integral: [F; PLACES],
}

/// Directions between two vertices, in which one wall is seen. The next interval begins where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Interval<F> {
    /// The vertex towards which it ends; the last interval of a stretch ends along the wall.
    pub end: [F; 2],
    /// The mean of c over the interval: the coefficients of the functions of the place in the stretch.
    pub mean: [F; TERMS],
    /// About the integral of c over the interval in ω, the mean times the width: coefficients of more of these functions.
    pub integral: [F; PLACES],
}

/// A box: a fraction of an interval of directions, where c is a polynomial.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct RayBox<F> {
    /// Where it begins, as a fraction of the interval.
    pub from: F,
    /// The width of the box, as a fraction of the interval.
    pub width: F,
    /// c: the coefficients of 1, s, s², …, x, x s, … up to a total degree of four, each product of normalised Legendre polynomials
    /// of the place x in the stretch and s in the box.
    pub control: [F; PRODUCTS],
}

/// What a box is drawn by. It stands apart from boxes, so that a box and its interval, which are seldom in a cache, come at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Share {
    /// The probability of the box and of those before it in its stretch: growing, and 1 at the last.
    pub sum: f32,
    /// The number of its interval within the stretch.
    pub interval: u32,
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
    /// What every box is drawn by.
    pub shares: &'a [Share],
}

/// Intervals, boxes and growing sums of probabilities of a stretch.
type Parts<'a, F> = (&'a [Interval<F>], &'a [RayBox<F>], &'a [Share]);

/// What is seen from a point.
pub(crate) struct View<'a, F> {
    /// ψ of the place in the stretch.
    pub(crate) psi: [F; PLACES],
    /// The number of the stretch.
    pub(crate) number: usize,
    pub(crate) stretch: &'a Stretch<F>,
    pub(crate) intervals: &'a [Interval<F>],
    pub(crate) boxes: &'a [RayBox<F>],
    pub(crate) shares: &'a [Share],
}

impl<'a, F: Real> RayControl<'a, F> {
    /// Refuses tables that are not those of so many cells, or lead elsewhere.
    pub(crate) fn check(&self, cells: usize) -> Result<(), RoomError> {
        let Self {
            first, stretches, ..
        } = self;
        let grow = first.iter().zip(first.iter().skip(1)).all(|(a, b)| a < b);
        let ends = first.first() == Some(&0)
            && first
                .last()
                .is_some_and(|&last| last as usize + 1 == stretches.len());
        let is_right = |number: usize| {
            let Some((intervals, _, shares)) = self.parts(number) else {
                return false;
            };
            let mut before = 0.0;
            let is_right = shares.iter().all(|share| {
                let grows = share.sum > before;
                before = share.sum;
                grows && (share.interval as usize) < intervals.len()
            });
            !intervals.is_empty() && is_right && before == 1.0
        };
        let is_whole = first.len() == cells + 1
            && grow
            && ends
            && (0..stretches.len().saturating_sub(1)).all(is_right);
        if is_whole {
            Ok(())
        } else {
            Err(RoomError::Tables)
        }
    }

    /// Intervals, boxes and probabilities of a stretch.
    #[inline]
    fn parts(&self, number: usize) -> Option<Parts<'a, F>> {
        let [own, next, ..] = self.stretches.get(number..)? else {
            return None;
        };
        let intervals = own.interval as usize..next.interval as usize;
        let boxes = own.ray_box as usize..next.ray_box as usize;
        Some((
            self.intervals.get(intervals)?,
            self.boxes.get(boxes.clone())?,
            self.shares.get(boxes)?,
        ))
    }

    /// What is seen from a point.
    #[inline]
    pub(crate) fn view(&self, room: &Room<'_, F>, x: &Located<Point<F>>) -> Option<View<'a, F>> {
        let [from, to, ..] = *self.first.get(x.cell..)? else {
            return None;
        };
        let own = self.stretches.get(from as usize..to as usize)?;
        let half = F::from_f64(0.5);
        let t = half + half * room.coordinate(&x.point, x.cell);
        // The first begins where the cell does.
        let later = own.get(1..).unwrap_or(&[]);
        let number = later.partition_point(|stretch| stretch.from <= t);
        let start = own.get(number)?.from;
        let end = own.get(number + 1).map_or(one(), |next| next.from);
        let place = (t - start) / (end - start);
        let stretch = own.get(number)?;
        let number = from as usize + number;
        let (intervals, boxes, shares) = self.parts(number)?;
        Some(View {
            psi: legendre(place + place - one()),
            number,
            stretch,
            intervals,
            boxes,
            shares,
        })
    }
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
/// two of them c(x, ω) is a polynomial of x and of the place between the two, in boxes, so that its integral I_e(x) over ω is a
/// table times w_e(x) = ω_(e+1)(x) − ω_e(x). Nearly it is a polynomial P_e(x), too. A box is drawn by the part that v − c has in
/// it, and a ray into the box gives what c lacks:
///
/// ```text
/// G(x) ≈ v(x) − ρ (Σ_e P_e(x) + ((v(y(x, ω)) − c(x, ω)) w_e + I_e(x) − P_e(x)) × (the box's share of w_e)/(its probability)).
/// ```
///
/// The mean is G(x) for any v, c and P, and of all vertices two are looked at. Those that are as near as the cell is long have no
/// such polynomial, and I_e in place of P_e. There are no pairs of cells: no form factors, no moments, and a score takes as long
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
        control.check(cells)?;
        Ok(Self {
            polynomials,
            v,
            control,
        })
    }

    #[inline]
    fn view(&self, x: &Located<Point<F>>) -> Option<View<'n, F>> {
        self.control.view(self.polynomials.room(), x)
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
        let (number, probability) = view.chosen(chosen)?;
        let share = view.shares.get(number)?;
        let ray_box = view.boxes.get(number)?;
        let room = self.polynomials.room();
        let tangent = room.geometry().wall(x.point.wall() as u32)?.tangent;
        let position = x.point.position();
        let psi: &[F; TERMS] = view.psi.first_chunk()?;
        let mut sum = product(&view.stretch.integral, &view.psi);
        let mut near = view.near();
        while near != 0 {
            let k = near.trailing_zeros() as usize;
            near &= near - 1;
            let [_, width] = between(view.intervals, k, position, tangent);
            sum += width * product(&view.intervals.get(k)?.mean, psi);
        }
        let k = share.interval as usize;
        let [from, width] = between(view.intervals, k, position, tangent);
        let omega = from + width * (ray_box.from + ray_box.width * place);
        let lacks = self.seen(&x.point, omega) - control(&ray_box.control, psi, place);
        let own = lacks * width + view.left_out(k, width)?;
        sum += own * ray_box.width / probability;
        Some(self.value(x) - room.reflectance(&x.point) * sum)
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
        let psi: &[F; TERMS] = view.psi.first_chunk()?;
        let [mut squares, mut drawn, mut mean, mut known] = [zero::<F>(); 4];
        let mut boxes = view.boxes.iter().zip(view.shares).peekable();
        let mut before = zero::<F>();
        for (k, interval) in view.intervals.iter().enumerate() {
            let [from, width] = between(view.intervals, k, x.point.position(), wall.tangent);
            known += width * product(&interval.mean, psi);
            let left_out = view.left_out(k, width)?;
            while let Some((ray_box, share)) =
                boxes.next_if(|(_, share)| share.interval as usize == k)
            {
                let probability = share.to::<F>() - before;
                before = share.to();
                for (place, weight) in PARTS.into_iter().flat_map(in_part) {
                    let [place, weight] = [place, weight].map(F::from_f64);
                    let omega = from + width * (ray_box.from + ray_box.width * place);
                    let lacks = self.seen(&x.point, omega) - control(&ray_box.control, psi, place);
                    mean += weight * width * ray_box.width * lacks;
                    let own = (lacks * width + left_out) * ray_box.width;
                    squares += weight * own * own / probability;
                    drawn += weight * own;
                }
            }
        }
        let reflectance = wall.reflectance;
        let variance = reflectance * reflectance * (squares - drawn * drawn).max(zero());
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

impl Share {
    /// The sum of probabilities.
    #[inline]
    fn to<F: Real>(&self) -> F {
        F::from_f64(f64::from(self.sum))
    }
}

impl<F: Real> View<'_, F> {
    /// The number of the box that a uniform number chooses, and its probability.
    #[inline]
    pub(crate) fn chosen(&self, chosen: F) -> Option<(usize, F)> {
        let last = self.shares.len().checked_sub(1)?;
        let number = self
            .shares
            .partition_point(|share| share.to::<F>() <= chosen);
        let number = if number < last { number } else { last };
        let before = number.checked_sub(1);
        let before = before.and_then(|before| self.shares.get(before));
        let share = self.shares.get(number)?;
        Some((
            number,
            share.to::<F>() - before.map_or_else(zero, Share::to),
        ))
    }

    /// A bit for every interval whose integral is exact.
    #[inline]
    pub(crate) fn near(&self) -> u64 {
        let [low, high] = self.stretch.near.each(u64::from);
        low | high << 32
    }

    /// What the polynomial lacks of the integral of c over an interval of this width; 0 where there is none.
    #[inline]
    fn left_out(&self, k: usize, width: F) -> Option<F> {
        if self.near() >> k & 1 == 1 {
            return Some(zero());
        }
        let interval = self.intervals.get(k)?;
        let mean = product(&interval.mean, self.psi.first_chunk()?);
        Some(width * mean - product(&interval.integral, &self.psi))
    }
}

/// The ω at which interval k begins, as seen from a point of a wall, and its width there. Together intervals are [0, 1], whatever the
/// vertices are: where two change places, the interval between them counts less than nothing.
#[inline]
pub(crate) fn between<F: Real>(
    intervals: &[Interval<F>],
    k: usize,
    position: Vector<F>,
    tangent: Vector<F>,
) -> [F; 2] {
    let end = |k: usize| match intervals.get(k) {
        Some(interval) if k + 1 < intervals.len() => {
            // NaN, in the vertex itself, is 0.
            let omega = omega_of(position, tangent, interval.end).max(zero());
            if omega < one() { omega } else { one() }
        }
        _ => one(),
    };
    let from = k.checked_sub(1).map_or_else(zero, end);
    [from, end(k) - from]
}

/// The ω of the ray from a point of a wall to a vertex: (1 + sin φ)/2.
#[inline]
pub(crate) fn omega_of<F: Real>(position: Vector<F>, tangent: Vector<F>, vertex: Vector<F>) -> F {
    let to = sub(vertex, position);
    let half = F::from_f64(0.5);
    half + half * dot(tangent, to) / dot(to, to).sqrt()
}

/// Adds a box's part, by its width as a fraction of the interval, to the means of c over an interval in all channels: the functions
/// of s have none but the first.
#[cfg(feature = "alloc")]
pub(crate) fn add_means<F: Real>(means: &mut [F], width: F, control: &[F], channels: usize) {
    let mut first = 0;
    for (degree, means) in means.chunks_exact_mut(channels).enumerate() {
        let terms = control.get(first * channels..).unwrap_or(&[]);
        for (mean, &term) in means.iter_mut().zip(terms) {
            *mean += width * term;
        }
        first += TERMS - degree;
    }
}

#[inline]
pub(crate) fn product<F: Real, const N: usize>(a: &[F; N], b: &[F; N]) -> F {
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
