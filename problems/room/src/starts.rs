//! Starts of the walks of a whole function.

use fredholm_core::whole::Starts;
use fredholm_core::{Functional, Real, Uniforms};

use crate::{MeanOver, Point, Room, RoomError};

/// Starts that are uniform over the length of all walls, p0 = 1/L.
///
/// p is symmetric, as light goes both ways, and q constant: a closed room preserves p0, with s = 1 − q0. Of an open one,
/// which walks leave more often in some places than in others, starts alone have it.
#[derive(Clone, Copy, Debug)]
pub struct WallStarts<'r, 'a, F> {
    everywhere: MeanOver<'r, 'a, F>,
    density: f64,
    survival: Option<f64>,
}

impl<'r, 'a, F: Real> WallStarts<'r, 'a, F> {
    /// The starts in a room. `lengths` are those of all walls before each, and of all, as `Tables::lengths` gives them.
    ///
    /// # Errors
    /// [`RoomError::Length`]: `lengths` has not one entry more than there are walls.
    pub fn new(room: &'r Room<'a, F>, lengths: &'a [f64]) -> Result<Self, RoomError> {
        let geometry = room.geometry();
        let everywhere = MeanOver::new(room, lengths, 0..geometry.walls().len())?;
        let survival = (!geometry.is_open()).then_some(room.survival().to_f64());
        Ok(Self {
            everywhere,
            density: 1.0 / lengths.last().copied().unwrap_or(f64::NAN),
            survival,
        })
    }
}

impl<'a, F: Real> Starts<Room<'a, F>> for WallStarts<'_, 'a, F> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> Point<F> {
        Functional::start(&self.everywhere, uniforms).0
    }

    #[inline]
    fn start_density(&self, _: &Point<F>) -> f64 {
        self.density
    }

    fn survival(&self) -> Option<f64> {
        self.survival
    }
}
