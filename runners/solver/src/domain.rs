//! From [0, 1]^d, where walks live, to the domain of an equation.
//!
//! An interval between two numbers is the image of [0, 1] by x = (1 − t) low + t high. Infinite ends are reached by rational maps,
//!
//! | interval | x(t) | dx/dt | t(x) |
//! |---|---|---|---|
//! | [a, ∞) | a + t/(1 − t) | 1/(1 − t)² | s/(1 + s), s = x − a |
//! | (−∞, b] | b − (1 − t)/t | 1/t² | 1/(1 + s), s = b − x |
//! | (−∞, ∞) | ½/(1 − t) − ½/t | ½/(1 − t)² + ½/t² | ½ + ½ x/(1 + √(1 + x²)) |
//!
//! These grow like 1/(1 − t), and no slower or faster, so that what falls like 1/x² has a smooth product with dx/dt up to the end: it tends
//! to a number there. The product of the Lorentzian 1/(1 + x²) on the line is 4/(1 + s²) with s = 2t − 1. With x = s/√(1 − s²) it would
//! have a root's singularity, and with exponential maps cells would have to be fine where 1/x² is, far out. What falls exponentially has a
//! product all of whose derivatives tend to 0. The tangent of πs/2 does the same as the map of the line, at the price of a tangent; that map
//! is tan(2 arctan s). Boyd (Chebyshev and Fourier Spectral Methods, 2nd ed. 2001, ch. 17) compares such maps and advises algebraic ones.
//!
//! The unit of length is the equation's: half of [0, 1] is the part from a to a + 1, or that from −⅔ to ⅔.

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_core::galerkin::MOST_DIMENSIONS;

use crate::Error;

/// The interval of an axis.
#[derive(Clone, Copy, Debug)]
enum Interval<F> {
    Between(F, F),
    From(F),
    UpTo(F),
    Line,
}

impl<F: Real> Interval<F> {
    fn new([low, high]: [f64; 2]) -> Self {
        match [low, high].map(f64::is_finite) {
            [true, true] => Self::Between(F::from_f64(low), F::from_f64(high)),
            [true, false] => Self::From(F::from_f64(low)),
            [false, true] => Self::UpTo(F::from_f64(high)),
            [false, false] => Self::Line,
        }
    }
}

/// Where a point lies in its coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Position {
    /// The coordinates.
    pub(crate) coordinates: [f64; MOST_DIMENSIONS],
    /// The volume in coordinates over the measure μ.
    pub(crate) volume: f64,
}

/// Whether every pair is of the ends of an interval.
pub(crate) fn are_intervals(ends: &[[f64; 2]]) -> bool {
    // The length of two finite ends may be infinite in numbers.
    let is_right = |&[low, high]: &[f64; 2]| {
        low < high && ((high - low).is_finite() || !(low.is_finite() && high.is_finite()))
    };
    ends.iter().all(is_right)
}

/// Refuses what is no point of the product of these intervals.
pub(crate) fn check_point(x: &[f64], intervals: &[[f64; 2]]) -> Result<(), Error> {
    let message = if x.len() == intervals.len() {
        let outside =
            |(x, [low, high]): &(&f64, &[f64; 2])| !(low <= *x && *x <= high && x.is_finite());
        match x.iter().zip(intervals).find(outside) {
            None => return Ok(()),
            Some((x, [low, high])) => {
                format!("a coordinate is {x}, and it must be from {low} to {high}")
            }
        }
    } else {
        format!("a point has {} coordinates", intervals.len())
    };
    Err(Error::Region { message })
}

/// Refuses a mean over intervals of infinite length.
pub(crate) fn check_mean(ends: &[[f64; 2]]) -> Result<(), Error> {
    if ends.iter().flatten().all(|end| end.is_finite()) {
        return Ok(());
    }
    let message =
        "an infinite domain has no mean: ask for a weight, the integral of u times a function";
    Err(Error::Region {
        message: message.to_owned(),
    })
}

/// The map from [0, 1]^d to a product of intervals.
#[derive(Clone, Debug)]
pub(crate) struct Domain<F> {
    /// The interval of every axis. There are none for [0, 1]^d itself, whose numbers stay as they are, bit by bit.
    intervals: Vec<Interval<F>>,
    /// Π (high_a − low_a) of the axes of finite length.
    volume: F,
    /// Whether an axis is infinite.
    is_infinite: bool,
}

impl<F: Real> Domain<F> {
    /// The domain between these ends of every axis; without any, [0, 1]^d.
    pub(crate) fn new(ends: &[[f64; 2]]) -> Self {
        let lengths = ends.iter().map(|[low, high]| high - low);
        let volume: f64 = lengths
            .clone()
            .filter(|length| length.is_finite())
            .product();
        Self {
            intervals: ends.iter().map(|&ends| Interval::new(ends)).collect(),
            volume: F::from_f64(volume),
            is_infinite: lengths.into_iter().any(f64::is_infinite),
        }
    }

    /// The coordinate on an axis; at an infinite end, the farthest that is told from it.
    #[inline]
    pub(crate) fn coordinate(&self, axis: usize, t: F) -> F {
        let half = F::from_f64(0.5);
        match self.intervals.get(axis) {
            Some(&Interval::Between(low, high)) => (F::one() - t) * low + t * high,
            Some(&Interval::From(low)) => low + t / apart(F::one() - t),
            Some(&Interval::UpTo(high)) => high - (F::one() - t) / apart(t),
            Some(Interval::Line) => half / apart(F::one() - t) - half / apart(t),
            None => t,
        }
    }

    /// The point of the domain.
    #[inline]
    pub(crate) fn point<const D: usize>(&self, t: &[F; D]) -> [F; D] {
        if self.intervals.is_empty() {
            return *t;
        }
        from_fn(|a| self.coordinate(a, t[a]))
    }

    /// The coordinates of a point of [0, 1]^d in double precision, and its |dx/dt|.
    pub(crate) fn position<const D: usize>(&self, t: &[F; D]) -> Position {
        let x = self.point(t);
        Position {
            coordinates: from_fn(|a| x.get(a).map_or(0.0, |x| x.to_f64())),
            volume: self.times_volume(F::one(), t).to_f64(),
        }
    }

    /// The point of [0, 1]^d of a point of the domain; `None`: it has another number of coordinates.
    pub(crate) fn unit<const D: usize>(&self, x: &[f64]) -> Option<[f64; D]> {
        let x: &[f64; D] = x.try_into().ok()?;
        Some(from_fn(|a| self.parameter(a, x[a])))
    }

    /// The number in [0, 1] of a coordinate on an axis.
    pub(crate) fn parameter(&self, axis: usize, own: f64) -> f64 {
        let half = F::from_f64(0.5);
        let x = F::from_f64(own);
        let t = match self.intervals.get(axis) {
            Some(&Interval::Between(low, high)) => (x - low) / (high - low),
            Some(&Interval::From(low)) => (x - low) / (F::one() + (x - low)),
            Some(&Interval::UpTo(high)) => F::one() / (F::one() + (high - x)),
            Some(Interval::Line) => {
                let root = (F::one() + x * x).sqrt();
                // The nearer end's distance, without cancellation.
                let near = half * (F::one() + F::one() / (root + x.abs())) / (F::one() + root);
                if x < F::zero() { near } else { F::one() - near }
            }
            None => return own,
        };
        t.to_f64()
    }

    /// The numbers in [0, 1] of coordinates on every axis.
    pub(crate) fn parameters(&self, all: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let axes = all.iter().enumerate();
        let own = |(axis, own): (usize, &Vec<f64>)| {
            let own = own.iter();
            own.map(|x| self.parameter(axis, *x)).collect()
        };
        axes.map(own).collect()
    }

    /// A density on the domain as one on [0, 1]^d, at the point of [0, 1]^d: its product with |dx/dt|.
    #[inline]
    pub(crate) fn times_volume<const D: usize>(&self, density: F, t: &[F; D]) -> F {
        if self.intervals.is_empty() {
            return density;
        }
        let finite = density * self.volume;
        if !self.is_infinite {
            return finite;
        }
        let axes = self.intervals.iter().zip(t);
        axes.fold(finite, |product, (interval, &t)| match interval {
            Interval::Between(..) => product,
            _ => product * slope(interval, t),
        })
    }

    /// Multiplies a function of one axis by the axis' dx/dt at t.
    #[inline]
    pub(crate) fn times_length(&self, axis: usize, density: F, t: F) -> F {
        match self.intervals.get(axis) {
            Some(interval) => density * slope(interval, t),
            None => density,
        }
    }
}

/// The distance of t from an infinite end; that of the end itself is the least that stands for one, so that neither it nor the square of
/// its inverse is infinite, and 0 times it is 0.
#[inline]
fn apart<F: Real>(distance: F) -> F {
    distance.max(F::EPSILON)
}

/// dx/dt of an axis.
#[inline]
fn slope<F: Real>(interval: &Interval<F>, t: F) -> F {
    let [to_low, to_high] = [t, F::one() - t].map(|distance| F::one() / apart(distance));
    match *interval {
        Interval::Between(low, high) => high - low,
        Interval::From(_) => to_high * to_high,
        Interval::UpTo(_) => to_low * to_low,
        Interval::Line => F::from_f64(0.5) * (to_high * to_high + to_low * to_low),
    }
}
