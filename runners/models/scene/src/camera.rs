//! Where a picture of a scene is taken from.

use fredholm_model::Error;
use fredholm_scene::Scene;
use fredholm_surfaces::hull;
use fredholm_surfaces::space::{along, cross, dot, norm, scale, sub, unit};

/// A pinhole camera.
///
/// ```
/// use fredholm::scene::Camera;
///
/// let camera = Camera { from: [0.0, -4.0, 1.0], towards: [0.0, 0.0, 1.0], angle: 40.0, size: [640, 480] };
/// assert_eq!(camera.size[0] * camera.size[1], 307_200);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The place of the camera.
    pub from: [f64; 3],
    /// A point in the middle of the picture.
    pub towards: [f64; 3],
    /// The angle between the lower and the upper edge of the picture, in degrees.
    pub angle: f64,
    /// Pixels across the picture, and down.
    pub size: [usize; 2],
}

/// The angle of a camera of which nothing is said, in degrees.
const ANGLE: f64 = 40.0;
/// How much further away it stands than it must.
const MARGIN: f64 = 1.05;

impl Camera {
    /// A camera that looks at all of a scene from outside: along the axis y and a little down. Where it meets the backs of
    /// surfaces it sees through them.
    #[must_use]
    pub fn outside(scene: &Scene, size: [usize; 2]) -> Self {
        let corners = scene.faces().iter().flat_map(|face| face.corners);
        let [low, high] = hull(&corners.collect::<Vec<_>>());
        let towards: [f64; 3] = core::array::from_fn(|k| 0.5 * (low[k] + high[k]));
        let mut camera = Self {
            from: along(towards, 1.0, [0.24, -0.93, 0.28]),
            towards,
            angle: ANGLE,
            size,
        };
        let [ahead, right, above] = camera.frame();
        // So far away that every corner of the box around all is within the picture.
        let away = (0..8).fold(0.0, |away: f64, corner| {
            let from_middle: [f64; 3] = core::array::from_fn(|k| {
                let end = if corner >> k & 1 == 0 { low } else { high };
                end[k] - towards[k]
            });
            // The edges' vectors are as long as the tangents of the angles there.
            let aside = |axis| dot(axis, from_middle).abs() / dot(axis, axis);
            away.max(aside(right).max(aside(above)) - dot(ahead, from_middle))
        });
        camera.from = scene.moved_out(along(towards, -MARGIN * away, ahead));
        camera.towards = scene.moved_out(towards);
        camera
    }

    /// Refuses what is no camera.
    ///
    /// # Errors
    /// [`Error::Picture`].
    pub fn check(&self) -> Result<(), Error> {
        let wrong = |message: &str| Err(Error::Picture(message.to_owned()));
        let away = norm(sub(self.from, self.towards));
        if !(away > 0.0 && away.is_finite()) {
            return wrong("a camera looks from one point towards another");
        }
        if !(self.angle > 0.0 && self.angle < 180.0) {
            return wrong("the angle of a camera must be more than 0 and less than 180 degrees");
        }
        if self.size.contains(&0) {
            return wrong("a picture has at least one pixel");
        }
        Ok(())
    }

    /// The directions to the middle, to the right edge and to the upper edge, of which the last two are perpendicular to the
    /// first.
    pub(crate) fn frame(&self) -> [[f64; 3]; 3] {
        let ahead = unit(sub(self.towards, self.from));
        // Up is z; who looks along it has y above.
        let up = if ahead[2].abs() < 0.999 {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let right = unit(cross(ahead, up));
        let above = cross(right, ahead);
        let half = (0.5 * self.angle).to_radians().tan();
        let ratio = self.size[0] as f64 / self.size[1] as f64;
        [ahead, right.map(|x| x * half * ratio), scale(above, half)]
    }
}
