//! From [0, 1]^d, where walks live, to the domain of an equation.

use fredholm_core::Real;
use fredholm_core::array::from_fn;

/// The map from [0, 1]^d to a product of intervals, x_a = (1 − t_a) low_a + t_a high_a.
#[derive(Clone, Debug)]
pub(super) struct Domain<F> {
    /// The ends of every axis. There are none for [0, 1]^d itself, whose numbers stay as they are, bit by bit.
    ends: Vec<[F; 2]>,
    /// Π (high_a − low_a).
    volume: F,
}

impl<F: Real> Domain<F> {
    /// The domain between these ends of every axis; without any, [0, 1]^d.
    pub(super) fn new(ends: &[[f64; 2]]) -> Self {
        let volume: f64 = ends.iter().map(|[low, high]| high - low).product();
        Self {
            ends: ends.iter().map(|ends| ends.map(F::from_f64)).collect(),
            volume: F::from_f64(volume),
        }
    }

    /// The coordinate on an axis.
    #[inline]
    pub(super) fn coordinate(&self, axis: usize, t: F) -> F {
        match self.ends.get(axis) {
            Some(&[low, high]) => (F::one() - t) * low + t * high,
            None => t,
        }
    }

    /// The point of the domain.
    #[inline]
    pub(super) fn point<const D: usize>(&self, t: &[F; D]) -> [F; D] {
        if self.ends.is_empty() {
            return *t;
        }
        from_fn(|a| self.coordinate(a, t[a]))
    }

    /// The point of [0, 1]^d of a point of the domain.
    pub(super) fn unit<const D: usize>(&self, x: &[f64]) -> [F; D] {
        from_fn(|a| {
            let x = F::from_f64(x.get(a).copied().unwrap_or(0.0));
            match self.ends.get(a) {
                Some(&[low, high]) => (x - low) / (high - low),
                None => x,
            }
        })
    }

    /// A density on the domain as one on [0, 1]^d.
    #[inline]
    pub(super) fn times_volume(&self, density: F) -> F {
        if self.ends.is_empty() {
            density
        } else {
            density * self.volume
        }
    }

    /// Multiplies a function of one axis by the length of the axis.
    #[inline]
    pub(super) fn times_length(&self, axis: usize, density: F) -> F {
        match self.ends.get(axis) {
            Some(&[low, high]) => density * (high - low),
            None => density,
        }
    }
}
