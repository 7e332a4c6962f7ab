//! Light in one channel, or in several.

use core::fmt::Debug;

use fredholm_core::{Channels, Real, Value};
use num_traits::one;

/// The channels of light, as ratios to an equation that has the largest ρ and F of all on every face or wall, which are constant there.
///
/// They share the walks.
pub trait Tint<F: Real>: Copy + Debug + Send + Sync {
    /// One number for each channel.
    type Value: Value<F>;

    /// C.
    fn channels(&self) -> usize;

    /// ρ_c/ρ of a face.
    fn reflectance(&self, face: u32) -> Self::Value;

    /// F_c/F of a face.
    fn emission(&self, face: u32) -> Self::Value;
}

/// The numbers of all channels in f64.
pub type Wide<F, C> = <<C as Tint<F>>::Value as Value<F>>::Wide;

/// One channel.
#[derive(Clone, Copy, Debug)]
pub struct Grey;

impl<F: Real> Tint<F> for Grey {
    type Value = F;

    #[inline(always)]
    fn channels(&self) -> usize {
        1
    }
    #[inline(always)]
    fn reflectance(&self, _: u32) -> F {
        one()
    }
    #[inline(always)]
    fn emission(&self, _: u32) -> F {
        one()
    }
}

/// Up to M channels: colours, bands of wavelengths, receivers.
#[derive(Clone, Copy, Debug)]
pub struct Colours<'a, F, const M: usize> {
    /// C.
    pub channels: usize,
    /// ρ_c/ρ from 0 to 1, for every face and there for every channel.
    pub reflectances: &'a [F],
    /// F_c/F from 0 to 1, for every face and there for every channel.
    pub emissions: &'a [F],
}

impl<F: Real, const M: usize> Colours<'_, F, M> {
    /// The first length that is not right for so many faces, if there is one: what is expected, and what there is.
    ///
    /// ```
    /// use fredholm_surfaces::Colours;
    ///
    /// let numbers = [1.0, 0.5, 0.25];
    /// let colours = Colours::<_, 4> { channels: 3, reflectances: &numbers, emissions: &numbers };
    /// assert_eq!((colours.misfit(1), colours.misfit(2)), (None, Some([6, 3])));
    /// ```
    #[must_use]
    pub fn misfit(&self, faces: usize) -> Option<[usize; 2]> {
        let numbers = faces.saturating_mul(self.channels);
        let lengths = [
            [self.channels.clamp(1, M), self.channels],
            [numbers, self.reflectances.len()],
            [numbers, self.emissions.len()],
        ];
        lengths
            .into_iter()
            .find(|[expected, found]| expected != found)
    }

    #[inline]
    fn of_face(&self, table: &[F], face: u32) -> Channels<F, M> {
        let own = table.get((face as usize).saturating_mul(self.channels)..);
        let own = own.unwrap_or(&[]);
        Channels::from_fn(self.channels, |c| own.get(c).copied().unwrap_or(F::NAN))
    }
}

impl<F: Real, const M: usize> Tint<F> for Colours<'_, F, M> {
    type Value = Channels<F, M>;

    #[inline(always)]
    fn channels(&self) -> usize {
        self.channels
    }
    #[inline]
    fn reflectance(&self, face: u32) -> Channels<F, M> {
        self.of_face(self.reflectances, face)
    }
    #[inline]
    fn emission(&self, face: u32) -> Channels<F, M> {
        self.of_face(self.emissions, face)
    }
}

/// Colours with tables of their own.
#[cfg(feature = "alloc")]
#[derive(Clone, Debug, PartialEq)]
pub struct ColourTables<F> {
    /// C.
    pub channels: usize,
    /// ρ_c/ρ, for every face and there for every channel.
    pub reflectances: alloc::vec::Vec<F>,
    /// F_c/F, for every face and there for every channel.
    pub emissions: alloc::vec::Vec<F>,
}

#[cfg(feature = "alloc")]
impl ColourTables<f64> {
    /// The tables of faces, each with its materials in so many channels: over the largest of them.
    ///
    /// ```
    /// use fredholm_surfaces::{ColourTables, Material};
    ///
    /// let of = |reflectance| Material { reflectance, emission: 0.0 };
    /// let tables = ColourTables::new(2, [&[of(0.5), of(0.1)][..]]);
    /// assert_eq!((tables.reflectances, tables.emissions), (vec![1.0, 0.2], vec![0.0; 2]));
    /// ```
    #[must_use]
    pub fn new<'m>(
        channels: usize,
        faces: impl IntoIterator<Item = &'m [crate::Material]>,
    ) -> Self {
        let mut all = Self {
            channels,
            reflectances: alloc::vec::Vec::new(),
            emissions: alloc::vec::Vec::new(),
        };
        for own in faces {
            let largest = crate::Material::largest(own);
            for one in own {
                all.reflectances
                    .push(share(one.reflectance, largest.reflectance));
                all.emissions.push(share(one.emission, largest.emission));
            }
        }
        all
    }

    /// The tables in the scalar of walks.
    #[must_use]
    pub fn rounded<F: Real>(&self) -> ColourTables<F> {
        let rounded = |table: &[f64]| table.iter().map(|&x| F::from_f64(x)).collect();
        ColourTables {
            channels: self.channels,
            reflectances: rounded(&self.reflectances),
            emissions: rounded(&self.emissions),
        }
    }
}

#[cfg(feature = "alloc")]
impl<F> ColourTables<F> {
    /// The colours, for walks of at most M channels.
    #[must_use]
    pub fn tint<const M: usize>(&self) -> Colours<'_, F, M> {
        Colours {
            channels: self.channels,
            reflectances: &self.reflectances,
            emissions: &self.emissions,
        }
    }
}

/// A number over the largest, or 0 of nothing.
#[must_use]
pub fn share(own: f64, largest: f64) -> f64 {
    if largest > 0.0 { own / largest } else { 0.0 }
}
