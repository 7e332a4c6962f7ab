//! The light of the sky: walks that leave an open scene upwards end in it.

use fredholm_core::Real;
use num_traits::{one, zero};

use crate::radiosity::{Point, Radiosity};
use crate::vector::Vector;

/// In place of a face's number, of a point of the sky: its position is the direction, a unit vector.
pub(crate) const SKY: u32 = u32::MAX - 1;

/// The most pieces of a sky. One of 145 patches has 480.
#[cfg(feature = "alloc")]
const MOST_PIECES: usize = 100_000;

/// A band of the sky, as walks look for it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct SkyBand<F> {
    /// The sines of its altitudes: a direction's third coordinate is between them.
    pub sines: [F; 2],
    /// The number of its patches, of equal width, from north, the axis y, over east, the axis x.
    pub sectors: u32,
    /// The number of its first patch.
    pub first: u32,
}

impl<F: Real> SkyBand<F> {
    /// The share of the band's height of a direction, and the number of sectors that are before it.
    fn coordinates(&self, direction: Vector<F>) -> [F; 2] {
        let [low, high] = self.sines;
        let turn = direction[0].atan2(direction[1]) / (F::PI + F::PI);
        let turn = if turn < zero() { turn + one() } else { turn };
        let along = turn * F::from_u32(self.sectors);
        [(direction[2] - low) / (high - low), along]
    }
}

/// The light of the sky above an open scene: u = L in the directions of a patch, so that a horizontal surface that sees nothing
/// but a sky of one L has the irradiance L. L has the unit of u, and is π times the radiance.
///
/// Patches lie between altitudes and azimuths, and are bounded by the circles of constant altitude; a form factor's patch has arcs
/// of great circles in their place, 0.25° apart at most.
///
/// ```
/// use fredholm_scene::SkyLight;
///
/// // 100 at the horizon and 300 at the zenith.
/// let sky = SkyLight::bands(&[0.0, 45.0, 90.0], &[1, 1], vec![100.0, 300.0])?;
/// assert_eq!(sky.emissions(), [100.0, 300.0]);
/// assert!(SkyLight::uniform(-1.0).is_err());
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[cfg(feature = "alloc")]
#[derive(Clone, Debug, PartialEq)]
pub struct SkyLight {
    pub(crate) bands: alloc::vec::Vec<SkyBand<f64>>,
    pub(crate) emissions: alloc::vec::Vec<f64>,
}

#[cfg(feature = "alloc")]
impl SkyLight {
    /// A sky of one L.
    ///
    /// # Errors
    /// As [`bands`](Self::bands).
    pub fn uniform(emission: f64) -> Result<Self, crate::SceneError> {
        Self::bands(&[0.0, 90.0], &[1], alloc::vec![emission])
    }

    /// Bands between ascending `altitudes` in degrees, from 0 to 90, in each of them as many patches as `sectors` says, and L of
    /// every patch, band by band.
    ///
    /// # Errors
    /// As [`check`](Self::check); [`SceneError::Length`](crate::SceneError::Length): not one L for every patch;
    /// [`SceneError::SkyLight`](crate::SceneError::SkyLight): an L is negative or not finite.
    pub fn bands(
        altitudes: &[f64],
        sectors: &[u32],
        emissions: alloc::vec::Vec<f64>,
    ) -> Result<Self, crate::SceneError> {
        Self::check(altitudes, sectors)?;
        let sine = |altitude: f64| {
            // The zenith has no rounding.
            if altitude < 90.0 {
                Real::sin(altitude.to_radians())
            } else {
                1.0
            }
        };
        let mut first = 0;
        let bands = altitudes.windows(2).zip(sectors).map(|(ends, &sectors)| {
            let band = SkyBand {
                sines: [sine(ends[0]), sine(ends[1])],
                sectors,
                first,
            };
            first += sectors;
            band
        });
        let bands = bands.collect();
        let (expected, found) = (first as usize, emissions.len());
        if expected != found {
            return Err(crate::SceneError::Length { expected, found });
        }
        let is_wrong = |l: &f64| !(*l >= 0.0 && l.is_finite());
        match emissions.iter().position(is_wrong) {
            Some(patch) => Err(crate::SceneError::SkyLight { patch }),
            None => Ok(Self { bands, emissions }),
        }
    }

    /// Refuses bands that are none.
    ///
    /// # Errors
    /// [`SceneError::Sky`](crate::SceneError::Sky): altitudes do not ascend from 0 to 90, there are not as many sectors as bands, a
    /// band has none, or all together may have more than 100,000 pieces, which the patches of form factors are cut into.
    pub fn check(altitudes: &[f64], sectors: &[u32]) -> Result<(), crate::SceneError> {
        // Written so that NaN fails.
        let ascending = altitudes.windows(2).all(|w| w[0] < w[1]);
        let whole = altitudes.first() == Some(&0.0) && altitudes.last() == Some(&90.0);
        let matching = sectors.len() + 1 == altitudes.len() && !sectors.contains(&0);
        // At 15° and where any band is cut.
        let kinds = sectors.iter().collect::<alloc::collections::BTreeSet<_>>();
        let cuts = kinds
            .into_iter()
            .fold(24, |sum: usize, &n| sum.saturating_add(n as usize));
        if ascending && whole && matching && cuts.saturating_mul(sectors.len()) <= MOST_PIECES {
            Ok(())
        } else {
            Err(crate::SceneError::Sky)
        }
    }

    /// L of every patch.
    #[must_use]
    pub fn emissions(&self) -> &[f64] {
        &self.emissions
    }
}

impl<F: Real, C> Radiosity<'_, F, C> {
    /// The point of the sky to which a ray leads that meets no surface. `None`: there is no sky, or the ray goes down.
    #[inline]
    pub(crate) fn sky_at(&self, direction: Vector<F>) -> Option<Point<F>> {
        let is_seen = !self.tables.sky_bands.is_empty() && direction[2] > zero();
        is_seen.then_some(Point {
            face: SKY,
            position: direction,
        })
    }

    /// The patch of a direction, and its coordinates there: the height, which is uniform in the solid angle, and the azimuth.
    pub(crate) fn sky_patch(&self, direction: Vector<F>) -> Option<(u32, [F; 2])> {
        let bands = self.tables.sky_bands;
        let after = bands.partition_point(|band| band.sines[0] <= direction[2]);
        let band = bands.get(after.max(1) - 1)?;
        let [height, along] = band.coordinates(direction);
        let sector = along.to_u32().min(band.sectors - 1);
        Some((band.first + sector, [height, along - F::from_u32(sector)]))
    }

    /// The band of a patch.
    fn band_of(&self, patch: u32) -> Option<&SkyBand<F>> {
        let bands = self.tables.sky_bands;
        let after = bands.partition_point(|band| band.first <= patch);
        bands.get(after.checked_sub(1)?)
    }

    /// The coordinates of a direction in a patch.
    pub(crate) fn sky_parameters(&self, patch: u32, direction: Vector<F>) -> Option<[F; 2]> {
        let band = self.band_of(patch)?;
        let [height, along] = band.coordinates(direction);
        let place = along - F::from_u32(patch - band.first);
        // The last sector ends where the first one begins.
        let is_end = place < -F::from_f64(0.5);
        let turn = if is_end {
            F::from_u32(band.sectors)
        } else {
            zero()
        };
        Some([height, place + turn])
    }

    /// The direction with these coordinates in a patch.
    pub(crate) fn sky_direction(&self, patch: u32, [s, t]: [F; 2]) -> Option<Vector<F>> {
        let band = self.band_of(patch)?;
        let [low, high] = band.sines;
        let height = low + s * (high - low);
        let turn = (F::from_u32(patch - band.first) + t) / F::from_u32(band.sectors);
        let angle = turn * (F::PI + F::PI);
        let wide = (one::<F>() - height * height).max(zero()).sqrt();
        Some([wide * angle.sin(), wide * angle.cos(), height])
    }

    /// L in a point of the sky.
    pub(crate) fn sky_emission(&self, x: &Point<F>) -> F {
        let patch = self.sky_patch(x.position);
        let own = patch.and_then(|(patch, _)| self.tables.sky_emissions.get(patch as usize));
        own.copied().unwrap_or(F::NAN)
    }
}
