//! What kernel and source have in a point: one number, or one for each of several channels.

use core::fmt::Debug;

use crate::Real;
use crate::array::from_fn;

/// A value of kernel, source or solution: one number for each of C channels, which share chain and walks.
///
/// A scalar is the value of one channel. [`Channels`] has several: colours of light, bands of wavelengths, receivers.
///
/// ```
/// use fredholm_core::{Channels, Value};
///
/// // The same code for one channel and for three.
/// fn doubled<V: Value<f64>>(value: &V) -> V {
///     value.plus(value)
/// }
/// assert_eq!(doubled(&1.5), 3.0);
/// let colours = Channels::<f64, 4>::from_fn(3, |c| c as f64);
/// assert_eq!(doubled(&colours).get(2), 4.0);
/// ```
pub trait Value<F: Real>: Copy + Debug + PartialEq + Send + Sync {
    /// The value in f64.
    type Wide: Value<f64>;

    /// The value of so many channels, from the number of each. Channels beyond the most that the type holds are left out.
    fn from_fn(channels: usize, of: impl FnMut(usize) -> F) -> Self;

    /// C.
    fn channels(&self) -> usize;

    /// The number of a channel; NaN of one that there is not.
    fn get(&self, channel: usize) -> F;

    /// A value with one number in every channel.
    #[inline(always)]
    fn splat(channels: usize, x: F) -> Self {
        Self::from_fn(channels, |_| x)
    }

    /// The value in f64.
    #[inline(always)]
    fn wide(&self) -> Self::Wide {
        Self::Wide::from_fn(self.channels(), |c| self.get(c).to_f64())
    }

    /// Times another value, channel by channel.
    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        Self::from_fn(self.channels(), |c| self.get(c) * other.get(c))
    }

    /// Times one number in all channels.
    #[inline(always)]
    fn scaled(&self, by: F) -> Self {
        Self::from_fn(self.channels(), |c| self.get(c) * by)
    }

    /// Plus another value, channel by channel.
    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        Self::from_fn(self.channels(), |c| self.get(c) + other.get(c))
    }

    /// Minus another value, channel by channel.
    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        Self::from_fn(self.channels(), |c| self.get(c) - other.get(c))
    }

    /// The largest absolute number of all channels.
    #[inline(always)]
    fn largest(&self) -> F {
        let channels = 1..self.channels();
        channels.fold(self.get(0).abs(), |most, c| {
            Real::max(most, self.get(c).abs())
        })
    }

    /// Whether no channel is infinite or NaN.
    #[inline(always)]
    fn is_finite(&self) -> bool {
        (0..self.channels()).all(|c| self.get(c).is_finite())
    }
}

impl<F: Real> Value<F> for F {
    type Wide = f64;

    #[inline(always)]
    fn from_fn(_: usize, mut of: impl FnMut(usize) -> F) -> Self {
        of(0)
    }

    #[inline(always)]
    fn channels(&self) -> usize {
        1
    }

    #[inline(always)]
    fn get(&self, _: usize) -> F {
        *self
    }
}

/// The most channels of a walk.
pub const MOST_CHANNELS: usize = 128;

/// Up to M channels.
///
/// ```
/// use fredholm_core::{Channels, Value};
///
/// let bands = Channels::<f32, 8>::splat(5, 0.5);
/// assert_eq!((bands.channels(), bands.largest()), (5, 0.5));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channels<F, const M: usize> {
    values: [F; M],
    channels: u16,
}

impl<F: Real, const M: usize> Channels<F, M> {
    /// The numbers of all channels.
    #[inline]
    #[must_use]
    pub fn as_slice(&self) -> &[F] {
        self.values.get(..self.channels()).unwrap_or(&self.values)
    }

    /// A value from two of as many channels.
    #[inline(always)]
    fn zip(&self, other: &Self, of: impl Fn(F, F) -> F) -> Self {
        let mut value = *self;
        let own = value.values.iter_mut().take(self.channels());
        for (own, &other) in own.zip(&other.values) {
            *own = of(*own, other);
        }
        value
    }
}

impl<F: Real, const M: usize> Value<F> for Channels<F, M> {
    type Wide = Channels<f64, M>;

    #[inline(always)]
    fn from_fn(channels: usize, mut of: impl FnMut(usize) -> F) -> Self {
        let channels = channels.min(M);
        let mut values: [F; M] = from_fn(|_| F::zero());
        for (c, value) in values.iter_mut().take(channels).enumerate() {
            *value = of(c);
        }
        Self {
            values,
            channels: channels as u16,
        }
    }

    #[inline(always)]
    fn channels(&self) -> usize {
        usize::from(self.channels)
    }

    #[inline(always)]
    fn get(&self, channel: usize) -> F {
        self.as_slice().get(channel).copied().unwrap_or(F::NAN)
    }

    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    fn scaled(&self, by: F) -> Self {
        self.zip(self, |a, _| a * by)
    }
}
