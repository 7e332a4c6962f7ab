//! The sky: patches of directions.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use core::f64::consts::FRAC_PI_2;

use fredholm_core::Real;
use fredholm_scene::{SceneError, SkyLight};
use fredholm_surfaces::space::{Vector, cross, dot, ring};

/// A patch of a sky: the azimuths and altitudes between which it lies, and its solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The altitudes in degrees from the horizon, 0, to the zenith, 90.
    pub altitudes: [f64; 2],
    /// The azimuths in degrees from north, the axis y, over east, the axis x.
    pub azimuths: [f64; 2],
    /// The solid angle in steradian.
    pub solid_angle: f64,
}

/// A convex cone of directions, a part of a patch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Piece {
    /// The patch; that below the horizon comes after all patches.
    pub(crate) patch: usize,
    /// One over the number of pieces of the patch.
    pub(crate) share: f64,
    /// Unit vectors, counter-clockwise as seen from the scene.
    pub(crate) corners: Vec<Vector<f64>>,
}

/// A sky: a surface at infinity around an open scene, above the horizon z = 0, in patches between altitudes and azimuths;
/// what is below the horizon is one patch more.
///
/// Patches are spherical polygons, whose edges are arcs of great circles. So a patch is cut out by planes through whatever
/// point it is seen from, as a polygon is, and what a face sees of it behind obstacles has the same closed forms; patches meet
/// without gaps and overlaps. Their corners lie on the circles of constant altitude, at all azimuths at which any band is
/// cut and at least every 15°, so that an arc is above its circle by 0.25° at most (at 45°).
///
/// ```
/// use fredholm_factors::Sky;
///
/// // 145 patches in eight bands, as Tregenza (1987) has them.
/// let sky = Sky::bands(
///     &[0.0, 12.0, 24.0, 36.0, 48.0, 60.0, 72.0, 84.0, 90.0],
///     &[30, 30, 24, 24, 18, 12, 6, 1],
/// )?;
/// assert_eq!(sky.patches().len(), 145);
/// let all: f64 = sky.patches().iter().map(|p| p.solid_angle).sum();
/// assert!((all - core::f64::consts::TAU).abs() < 1e-13);
/// # Ok::<(), fredholm_scene::SceneError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    patches: Vec<Patch>,
    pieces: Vec<Piece>,
}

impl Sky {
    /// One patch, the whole sky.
    #[must_use]
    pub fn uniform() -> Self {
        Self::cut(&[0.0, 90.0], &[1])
    }

    /// Bands between ascending `altitudes` in degrees, from 0 to 90, and in each of them as many patches of equal width as
    /// `sectors` says, from north over east. Patches are numbered band by band.
    ///
    /// # Errors
    /// As [`SkyLight::check`].
    pub fn bands(altitudes: &[f64], sectors: &[u32]) -> Result<Self, SceneError> {
        SkyLight::check(altitudes, sectors)?;
        Ok(Self::cut(altitudes, sectors))
    }

    fn cut(altitudes: &[f64], sectors: &[u32]) -> Self {
        // From the horizon to the zenith there are no circles to follow.
        let least = if sectors.len() == 1 { 4 } else { 24 };
        let mut cuts: Vec<f64> = (0..=least).map(|k| azimuth(k, least)).collect();
        for &n in sectors.iter().collect::<BTreeSet<_>>() {
            cuts.extend((1..n).map(|k| azimuth(k, n)));
        }
        cuts.sort_unstable_by(f64::total_cmp);
        // The same azimuth as another fraction.
        cuts.dedup_by(|b, a| *b - *a <= 1e-9);
        let mut sky = Self {
            patches: Vec::new(),
            pieces: Vec::new(),
        };
        for (band, &n) in altitudes.windows(2).zip(sectors) {
            for k in 0..n {
                sky.patch(
                    [band[0], band[1]],
                    [azimuth(k, n), azimuth(k + 1, n)],
                    &cuts,
                );
            }
        }
        let below = sky.patches.len();
        for quarter in 0..4 {
            let [from, to] = [quarter, quarter + 1].map(|k| 90.0 * f64::from(k));
            sky.pieces.push(Piece {
                patch: below,
                share: 0.25,
                corners: Vec::from([direction(to, 0.0), direction(from, 0.0), [0.0, 0.0, -1.0]]),
            });
        }
        sky
    }

    /// Adds a patch in pieces from cut to cut.
    fn patch(&mut self, altitudes: [f64; 2], azimuths: [f64; 2], cuts: &[f64]) {
        let patch = self.patches.len();
        let mut solid_angle = 0.0;
        let is_own =
            |cut: &&[f64]| (azimuths[0]..=azimuths[1]).contains(&(0.5 * (cut[0] + cut[1])));
        let share = 1.0 / cuts.windows(2).filter(is_own).count() as f64;
        for cut in cuts.windows(2).filter(is_own) {
            let [low, high] = altitudes;
            let mut corners = Vec::from([direction(cut[0], low), direction(cut[1], low)]);
            if high < 90.0 {
                corners.extend([direction(cut[1], high), direction(cut[0], high)]);
            } else {
                corners.push([0.0, 0.0, 1.0]);
            }
            solid_angle += solid_angle_of(&corners);
            self.pieces.push(Piece {
                patch,
                share,
                corners,
            });
        }
        self.patches.push(Patch {
            altitudes,
            azimuths,
            solid_angle,
        });
    }

    /// The patches above the horizon, from band to band.
    #[must_use]
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// The number of the patch in which a direction is; that of all patches below the horizon.
    pub(crate) fn patch_of(&self, direction: Vector<f64>) -> usize {
        let depth = |piece: &Piece| {
            let inward = |[a, b]: [Vector<f64>; 2]| -dot(cross(a, b), direction);
            ring(&piece.corners)
                .map(inward)
                .fold(f64::INFINITY, |least: f64, d| least.min(d))
        };
        // On an edge, but for rounding, the nearest one.
        let inside = self.pieces.iter().find(|piece| depth(piece) >= 0.0);
        let nearest = || {
            let all = self.pieces.iter();
            all.max_by(|a, b| depth(a).total_cmp(&depth(b)))
        };
        inside
            .or_else(nearest)
            .map_or(self.patches.len(), |piece| piece.patch)
    }

    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }
}

fn azimuth(k: u32, of: u32) -> f64 {
    360.0 * f64::from(k) / f64::from(of)
}

/// Sine and cosine of an angle in degrees; those of quarters are exact.
fn turn(degrees: f64) -> [f64; 2] {
    let quarters = degrees / 90.0;
    for (k, exact) in [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0], [0.0, 1.0]]
        .into_iter()
        .enumerate()
    {
        if quarters == k as f64 {
            return exact;
        }
    }
    let angle = quarters * FRAC_PI_2;
    [Real::sin(angle), Real::cos(angle)]
}

/// The unit vector of an azimuth and an altitude.
fn direction(azimuth: f64, altitude: f64) -> Vector<f64> {
    let ([s, c], [up, flat]) = (turn(azimuth), turn(altitude));
    [flat * s, flat * c, up]
}

/// The solid angle of a convex cone: of triangles around its first corner (van Oosterom and Strackee 1983).
fn solid_angle_of(corners: &[Vector<f64>]) -> f64 {
    let Some((&a, rest)) = corners.split_first() else {
        return 0.0;
    };
    let triangle = |w: &[Vector<f64>]| {
        let (b, c) = (w[0], w[1]);
        let volume = dot(a, cross(b, c)).abs();
        2.0 * Real::atan2(volume, 1.0 + dot(a, b) + dot(b, c) + dot(c, a))
    };
    rest.windows(2).map(triangle).sum()
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::{Sky, cross, dot, solid_angle_of};

    #[test]
    fn pieces_are_convex_and_cover_the_sphere_once() {
        let sky = Sky::bands(&[0.0, 10.0, 45.0, 80.0, 90.0], &[7, 5, 3, 1]).unwrap();
        let mut all = 0.0;
        for piece in sky.pieces() {
            let n = piece.corners.len();
            for k in 0..n {
                let m = cross(piece.corners[k], piece.corners[(k + 1) % n]);
                for corner in &piece.corners {
                    // Outwards.
                    assert!(dot(m, *corner) <= 1e-15, "{piece:?}");
                }
            }
            all += solid_angle_of(&piece.corners);
        }
        assert!((all - 2.0 * TAU).abs() < 1e-12, "{all}");
    }
}
