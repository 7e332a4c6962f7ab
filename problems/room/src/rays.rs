//! A neighbour equation with h = k whose G takes one ray.

use core::ops::Range;

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Basis, Cells, legendre};
use fredholm_core::{
    Equation as _, Lights as _, Located, Neighbour, NoDraws, Real, Space, Uniforms, Value,
};
use fredholm_surfaces::{Tint, Wide};
use num_traits::{one, zero};

use crate::vector::{Vector, dot, sub};
use crate::{Point, Room, RoomError};

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
}

/// What a box is drawn by.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Share {
    /// The probability of the box and of those before it in its stretch: growing, and 1 at the last.
    pub sum: f32,
    /// The number of its interval within the stretch.
    pub interval: u32,
}

/// The tables of the control variate of a [`RayNeighbour`], borrowed, of C channels.
///
/// Numbers of a stretch, an interval or a box stand in one row, those of all channels side by side, so that what is seldom in a
/// cache comes at once.
#[derive(Clone, Copy, Debug)]
pub struct RayControl<'a, F> {
    /// The number of the first stretch of every cell, and of all stretches.
    pub first: &'a [u32],
    /// The stretches, and one more that begins where the tables end.
    pub stretches: &'a [Stretch<F>],
    /// The sums of what the intervals of every stretch have, of each channel, but for those that are near. Where it is something else,
    /// there is a bias.
    pub integrals: &'a [F],
    /// The intervals of all stretches, directions between two vertices, in which one wall is seen. The next one begins where one ends.
    /// Of each the two coordinates of the vertex towards which it ends, but for the last one of a stretch, which ends along the wall;
    /// then of every channel
    ///
    /// - the mean of c over the interval, 5 coefficients of functions of the place in the stretch, and
    /// - about the integral of c over the interval in ω, the mean times the width: 7 coefficients of such functions.
    pub intervals: &'a [F],
    /// The boxes of all stretches, each with those of an interval one after the other: fractions of an interval, where c is a
    /// polynomial. Of each where it begins and its width, as fractions of the interval; then of every channel c, the coefficients of
    /// 1, s, s², …, x, x s, … up to a total degree of four, each product of normalised Legendre polynomials of the place x in the
    /// stretch and s in the box.
    pub boxes: &'a [F],
    /// What every box is drawn by.
    pub shares: &'a [Share],
}

/// Numbers of a row that are of no channel.
pub(crate) const OWN: usize = 2;
/// Numbers of an interval in a channel.
pub(crate) const OF_INTERVAL: usize = TERMS + PLACES;

/// Rows of as many numbers.
#[derive(Clone, Copy, Debug)]
struct Rows<'a, F> {
    numbers: &'a [F],
    length: usize,
}

impl<'a, F: Real> Rows<'a, F> {
    /// The rows from one number to another, with so many numbers in each of so many channels.
    #[inline]
    fn new(numbers: &'a [F], rows: Range<u32>, channels: usize, of_channel: usize) -> Option<Self> {
        let length = OWN + channels * of_channel;
        let numbers = numbers.get(rows.start as usize * length..rows.end as usize * length)?;
        Some(Self { numbers, length })
    }

    /// The two first numbers of a row, and those of its channels.
    #[inline]
    fn row(&self, number: usize) -> Option<([F; OWN], &'a [F])> {
        let from = number * self.length;
        let row = self.numbers.get(from..from + self.length)?;
        let (own, of_channels) = row.split_first_chunk()?;
        Some((*own, of_channels))
    }
}

/// The tables of a stretch.
struct Parts<'a, F> {
    /// A bit for every interval whose integral is exact.
    near: u64,
    integral: &'a [F],
    intervals: Rows<'a, F>,
    /// The number of intervals.
    count: usize,
    boxes: Rows<'a, F>,
    shares: &'a [Share],
}

/// What is seen from a point.
struct View<'a, F> {
    /// ψ of the place in the stretch.
    psi: [F; PLACES],
    position: Vector<F>,
    tangent: Vector<F>,
    parts: Parts<'a, F>,
}

impl<'a, F: Real> RayControl<'a, F> {
    /// Refuses tables that are not those of so many cells and channels, or lead elsewhere.
    fn check(&self, cells: usize, channels: usize) -> Result<(), RoomError> {
        let (first, count) = (self.first, self.stretches.len().saturating_sub(1));
        let last = self.stretches.last().ok_or(RoomError::Tables)?;
        let [intervals, boxes] = [last.interval, last.ray_box].each(|n| n as usize);
        let rows = |rows: usize, of_channel: usize| rows * (OWN + channels * of_channel);
        for (expected, found) in [
            (count * channels * PLACES, self.integrals.len()),
            (rows(intervals, OF_INTERVAL), self.intervals.len()),
            (rows(boxes, PRODUCTS), self.boxes.len()),
            (boxes, self.shares.len()),
        ] {
            if expected != found {
                return Err(RoomError::Length { expected, found });
            }
        }
        let ends = first.first() == Some(&0) && first.last().is_some_and(|&n| n as usize == count);
        let is_right = |number: usize| {
            let Some(parts) = self.parts(number, channels) else {
                return false;
            };
            let mut before = 0.0;
            let grow = parts.shares.iter().all(|share| {
                let grows = share.sum > before && (share.interval as usize) < parts.count;
                before = share.sum;
                grows
            });
            parts.count > 0 && grow && before == 1.0
        };
        let is_whole = first.len() == cells + 1
            && first.is_sorted_by(|a, b| a < b)
            && ends
            && (0..count).all(is_right);
        if is_whole {
            Ok(())
        } else {
            Err(RoomError::Tables)
        }
    }

    /// The tables of a stretch.
    #[inline]
    fn parts(&self, number: usize, channels: usize) -> Option<Parts<'a, F>> {
        let [own, next, ..] = self.stretches.get(number..)? else {
            return None;
        };
        let (intervals, boxes) = (own.interval..next.interval, own.ray_box..next.ray_box);
        let row = channels * PLACES;
        let [low, high] = own.near.each(u64::from);
        Some(Parts {
            near: low | high << 32,
            integral: self.integrals.get(number * row..(number + 1) * row)?,
            count: intervals.len(),
            intervals: Rows::new(self.intervals, intervals, channels, OF_INTERVAL)?,
            shares: self.shares.get(boxes.start as usize..boxes.end as usize)?,
            boxes: Rows::new(self.boxes, boxes, channels, PRODUCTS)?,
        })
    }

    /// What is seen from a point.
    #[inline]
    fn view<C>(
        &self,
        room: &Room<'_, F, C>,
        x: &Located<Point<F>>,
        channels: usize,
    ) -> Option<View<'a, F>> {
        let [from, to, ..] = *self.first.get(x.cell..)? else {
            return None;
        };
        let own = self.stretches.get(from as usize..to as usize)?;
        let mut t = [zero()];
        room.parameters(x, &mut t);
        let [t] = t;
        // The first begins where the cell does.
        let later = own.get(1..).unwrap_or(&[]);
        let number = later.partition_point(|stretch| stretch.from <= t);
        let start = own.get(number)?.from;
        let end = own.get(number + 1).map_or(one(), |next| next.from);
        let place = (t - start) / (end - start);
        Some(View {
            psi: legendre(place + place - one()),
            position: x.point.position(),
            tangent: room.geometry().wall(x.point.wall() as u32)?.tangent,
            parts: self.parts(from as usize + number, channels)?,
        })
    }
}

impl<F: Real> View<'_, F> {
    /// The number of the box that a uniform number chooses, and its probability.
    #[inline]
    fn chosen(&self, chosen: F) -> Option<(usize, F)> {
        let shares = self.parts.shares;
        let last = shares.len().checked_sub(1)?;
        let number = shares.partition_point(|share| share.to::<F>() <= chosen);
        let number = if number < last { number } else { last };
        let before = number
            .checked_sub(1)
            .and_then(|before| shares.get(before))
            .map_or_else(zero, Share::to);
        Some((number, shares.get(number)?.to::<F>() - before))
    }

    /// The ω at which an interval begins, and its width.
    #[inline]
    fn between(&self, k: usize) -> [F; 2] {
        let Parts {
            intervals, count, ..
        } = &self.parts;
        let end = |k: usize| {
            intervals
                .row(k)
                .filter(|_| k + 1 < *count)
                .map(|(end, _)| end)
        };
        between(end, k, self.position, self.tangent)
    }

    /// What the polynomial lacks of the integral of c over an interval of this width; 0 where there is none.
    #[inline]
    fn left_out<V: Value<F>>(&self, k: usize, width: F, channels: usize) -> Option<V> {
        if self.parts.near >> k & 1 == 1 {
            return Some(V::splat(channels, zero()));
        }
        let (_, own) = self.parts.intervals.row(k)?;
        Some(V::from_fn(channels, |channel| {
            let own = own.get(channel * OF_INTERVAL..).unwrap_or(&[]);
            let integral = own.get(TERMS..).unwrap_or(&[]);
            width * combined::<F, TERMS>(own, &self.psi)
                - combined::<F, PLACES>(integral, &self.psi)
        }))
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
/// Of several channels each has its own v, c and P, with the same stretches, intervals and boxes, and one ray serves all. Boxes
/// are drawn by the largest of the shares that the channels would give them, each relative to what its own v lacks, so that the
/// ray of no channel weighs more than with its own.
///
/// In a room [with lights](crate::Room::with_lights) the equation is the [`LastStep`](fredholm_core::LastStep), that of
/// w = u − F_s, and the v of all this is T_K F_s, which is known in every point, plus the polynomials: where they are near what was
/// reflected twice or more, neither a small light nor the edge of its shadow leaves any variance.
///
/// Tables come from a [`RaySetup`](crate::RaySetup), with an example.
#[derive(Debug)]
pub struct RayNeighbour<'n, E, F, const B: usize> {
    equation: &'n E,
    v: &'n [F],
    control: RayControl<'n, F>,
}

// By hand: a derive would ask the equation to be `Clone` and `Copy`.
impl<E, F: Real, const B: usize> Clone for RayNeighbour<'_, E, F, B> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E, F: Real, const B: usize> Copy for RayNeighbour<'_, E, F, B> {}

impl<'n, 'a, C: Tint<F>, F: Real, const B: usize> RayNeighbour<'n, Room<'a, F, C>, F, B> {
    /// The neighbour equation of v, which has B numbers of every channel, cell by cell.
    ///
    /// # Errors
    /// [`RoomError::Length`]: v or a table has another length. [`RoomError::Tables`]: a number in the tables leads nowhere, a
    /// stretch has no interval or no box, or probabilities do not grow to 1.
    pub fn new(
        equation: &'n Room<'a, F, C>,
        v: &'n [F],
        control: RayControl<'n, F>,
    ) -> Result<Self, RoomError> {
        let (cells, channels) = (equation.cells(), equation.channels());
        let (expected, found) = (cells * channels * B, v.len());
        if found != expected {
            return Err(RoomError::Length { expected, found });
        }
        control.check(cells, channels)?;
        Ok(Self {
            equation,
            v,
            control,
        })
    }

    /// v(y) where a ray from x leads; 0 where it leaves.
    #[inline]
    fn seen(&self, x: &Point<F>, omega: F) -> C::Value {
        match self.equation.ray(x, omega) {
            Some(y) => self.value(&self.locate(y)),
            None => self.nothing(),
        }
    }

    fn nothing(&self) -> C::Value {
        C::Value::splat(self.equation.channels(), zero())
    }

    /// What v has beyond c in a box, times the width of the interval, and what is left out of the integral of c over the interval:
    /// both times the width of the box.
    #[inline]
    fn lacks(
        &self,
        x: &Point<F>,
        view: &View<'_, F>,
        left_out: &C::Value,
        [from, width]: [F; 2],
        (number, place): (usize, F),
    ) -> Option<[C::Value; 2]> {
        let ([box_from, box_width], own) = view.parts.boxes.row(number)?;
        let seen = self.seen(x, from + width * (box_from + box_width * place));
        let terms = products(view.psi.first_chunk()?, place);
        let beyond = C::Value::from_fn(self.equation.channels(), |channel| {
            let own = own.get(channel * PRODUCTS..).unwrap_or(&[]);
            seen.get(channel) - combined::<F, PRODUCTS>(own, &terms)
        });
        Some([
            beyond.scaled(width * box_width),
            beyond.scaled(width).plus(left_out).scaled(box_width),
        ])
    }

    /// The integral of c over the intervals whose integrals are exact.
    #[inline]
    fn near(&self, view: &View<'_, F>) -> Option<C::Value> {
        let mut sum = self.nothing();
        let mut near = view.parts.near;
        while near != 0 {
            let k = near.trailing_zeros() as usize;
            near &= near - 1;
            sum = sum.plus(&self.mean(view, k)?);
        }
        Some(sum)
    }

    /// The integral of c over an interval.
    #[inline]
    fn mean(&self, view: &View<'_, F>, k: usize) -> Option<C::Value> {
        let [_, width] = view.between(k);
        let (_, own) = view.parts.intervals.row(k)?;
        Some(C::Value::from_fn(self.equation.channels(), |channel| {
            let own = own.get(channel * OF_INTERVAL..).unwrap_or(&[]);
            width * combined::<F, TERMS>(own, &view.psi)
        }))
    }

    /// The estimate of G, of a box by its number and a place in it.
    #[inline]
    fn draw(&self, x: &Located<Point<F>>, chosen: F, place: F) -> Option<C::Value> {
        let channels = self.equation.channels();
        let view = self.control.view(self.equation, x, channels)?;
        let (number, probability) = view.chosen(chosen)?;
        let k = view.parts.shares.get(number)?.interval as usize;
        let interval = view.between(k);
        let left_out = view.left_out(k, interval[1], channels)?;
        let [_, own] = self.lacks(&x.point, &view, &left_out, interval, (number, place))?;
        let per_probability = one::<F>() / probability;
        let integral = C::Value::from_fn(channels, |channel| {
            let own = view.parts.integral.get(channel * PLACES..);
            combined::<F, PLACES>(own.unwrap_or(&[]), &view.psi)
        });
        let sum = self
            .near(&view)?
            .plus(&integral)
            .plus(&own.scaled(per_probability));
        let reflectance = self.equation.kernel(&x.point, &x.point);
        Some(self.value(x).minus(&reflectance.times(&sum)))
    }

    /// The integral of v over all directions, and the variance of the estimate of G, by Gauss points in quarters of all boxes:
    /// of a jump in one they know the place to a sixteenth.
    fn moments(&self, x: &Located<Point<F>>) -> Option<[C::Value; 2]> {
        let channels = self.equation.channels();
        let view = self.control.view(self.equation, x, channels)?;
        let nothing = self.nothing();
        let (mut all, mut squares, mut drawn) = (nothing, nothing, nothing);
        let mut boxes = view.parts.shares.iter().enumerate().peekable();
        let mut before = zero::<F>();
        for k in 0..view.parts.count {
            let interval = view.between(k);
            all = all.plus(&self.mean(&view, k)?);
            let left_out = view.left_out(k, interval[1], channels)?;
            let of_interval = |share: &Share| share.interval as usize == k;
            while let Some((number, share)) = boxes.next_if(|(_, share)| of_interval(share)) {
                let per_probability = one::<F>() / (share.to::<F>() - before);
                before = share.to();
                for (place, weight) in PARTS.into_iter().flat_map(in_part) {
                    let [place, weight] = [place, weight].each(F::from_f64);
                    let [beyond, own] =
                        self.lacks(&x.point, &view, &left_out, interval, (number, place))?;
                    all = all.plus(&beyond.scaled(weight));
                    squares = squares.plus(&own.times(&own).scaled(weight * per_probability));
                    drawn = drawn.plus(&own.scaled(weight));
                }
            }
        }
        let reflectance = self.equation.kernel(&x.point, &x.point);
        let variance = squares.minus(&drawn.times(&drawn));
        let variance = C::Value::from_fn(channels, |channel| variance.get(channel).max(zero()));
        Some([all, reflectance.times(&reflectance).times(&variance)])
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

/// The ω at which interval k begins, as seen from a point of a wall, and its width there. `end` gives the vertex towards which an
/// interval ends; the last one has none. Together intervals are [0, 1], whatever the vertices are: where two change places, the
/// interval between them counts less than nothing.
#[inline]
pub(crate) fn between<F: Real>(
    end: impl Fn(usize) -> Option<Vector<F>>,
    k: usize,
    position: Vector<F>,
    tangent: Vector<F>,
) -> [F; 2] {
    let omega = |k: usize| match end(k) {
        Some(vertex) => {
            // NaN, in the vertex itself, is 0.
            let omega = omega_of(position, tangent, vertex).max(zero());
            if omega < one() { omega } else { one() }
        }
        None => one(),
    };
    let from = k.checked_sub(1).map_or_else(zero, omega);
    [from, omega(k) - from]
}

/// The ω of the ray from a point of a wall to a vertex: (1 + sin φ)/2.
#[inline]
pub(crate) fn omega_of<F: Real>(position: Vector<F>, tangent: Vector<F>, vertex: Vector<F>) -> F {
    let to = sub(vertex, position);
    let half = F::from_f64(0.5);
    half + half * dot(tangent, to) / dot(to, to).sqrt()
}

/// Adds a box's part, by its width as a fraction of the interval, to the mean of c over an interval: the functions of s have none
/// but the first.
#[cfg(feature = "alloc")]
pub(crate) fn add_mean<F: Real>(mean: &mut [F], width: F, control: &[F]) {
    let mut first = 0;
    for (degree, mean) in mean.iter_mut().enumerate() {
        *mean += width * control.get(first).copied().unwrap_or(F::NAN);
        first += TERMS - degree;
    }
}

/// The combination of functions with the first N numbers of a slice.
#[inline]
pub(crate) fn combined<F: Real, const N: usize>(own: &[F], psi: &[F]) -> F {
    match (own.first_chunk::<N>(), psi.first_chunk::<N>()) {
        (Some(own), Some(psi)) => own
            .iter()
            .zip(psi)
            .fold(zero(), |sum, (&a, &b)| sum + a * b),
        _ => F::NAN,
    }
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

impl<E, F: Real, const B: usize> Space for RayNeighbour<'_, E, F, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<C: Tint<F>, F: Real, const B: usize> Neighbour for RayNeighbour<'_, Room<'_, F, C>, F, B> {
    type Value = C::Value;

    #[inline]
    fn locate(&self, x: Point<F>) -> Located<Point<F>> {
        Located {
            point: x,
            cell: self.equation.locate(&x),
        }
    }

    /// h = k.
    #[inline]
    fn kernel(&self, _: &Located<Point<F>>, _: &Located<Point<F>>, k: &C::Value) -> C::Value {
        *k
    }

    fn is_pointwise(&self) -> bool {
        true
    }

    fn source(&self, x: &Located<Point<F>>, draws: &mut dyn Uniforms<F>) -> C::Value {
        let (chosen, place) = (draws.uniform(), draws.uniform());
        let missing = || C::Value::splat(self.equation.channels(), F::NAN);
        self.draw(x, chosen, place).unwrap_or_else(missing)
    }

    fn source_moments(&self, x: &Located<Point<F>>) -> [C::Value; 2] {
        let channels = self.equation.channels();
        let missing = C::Value::splat(channels, F::NAN);
        let [all, variance] = self.moments(x).unwrap_or([missing; 2]);
        // What lights give to other walls has no closed integral.
        let seen = if self.equation.lights().is_empty() {
            let exact: Wide<F, C> = self.equation.irradiance_of::<_, B>(&x.point, self.v);
            C::Value::from_fn(channels, |channel| F::from_f64(exact.get(channel)))
        } else {
            all
        };
        let reflectance = self.equation.kernel(&x.point, &x.point);
        [self.value(x).minus(&reflectance.times(&seen)), variance]
    }

    #[inline]
    fn value(&self, x: &Located<Point<F>>) -> C::Value {
        let polynomials = polynomials::<C, F, B>(self.equation, self.v, x);
        self.equation
            .light(&x.point, &mut NoDraws)
            .plus(&polynomials)
    }
}

/// What v has in a point beside the light that is known, of B numbers of every channel, cell by cell.
#[inline]
pub(crate) fn polynomials<C: Tint<F>, F: Real, const B: usize>(
    equation: &Room<'_, F, C>,
    v: &[F],
    x: &Located<Point<F>>,
) -> C::Value {
    let channels = equation.channels();
    let psi: [F; B] = equation.basis(x);
    let own = v.get(x.cell * channels * B..).unwrap_or(&[]);
    C::Value::from_fn(channels, |channel| {
        combined::<F, B>(own.get(channel * B..).unwrap_or(&[]), &psi)
    })
}
