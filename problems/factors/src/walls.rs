//! Form factors between the surfaces of a room.

use alloc::vec::Vec;

use fredholm_core::galerkin::buffer;
use fredholm_room::{RoomError, Scene, exchanges};

/// The form factors F_IJ between all surfaces of a room, row by row: of the energy that leaves surface I, the share that arrives
/// at J; behind those of all surfaces come, in every row, those of the parts of the sky that the room [has](Scene::outside). The rows of a
/// closed room sum to 1; nothing is normalised.
///
/// Exact up to rounding, with occlusion: see [`exchanges`].
///
/// # Errors
/// [`RoomError::Memory`].
///
/// ```
/// use fredholm_factors::room_factors;
/// use fredholm_room::{Enclosure, Material, Scene, Surface};
///
/// let walls = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
/// let surface = |points| Surface { points, materials: &[Material::BLACK] };
/// let square: Vec<Surface> = walls.windows(2).map(surface).collect();
/// let factors = room_factors(&Scene::new::<f64>(&square, Enclosure::Closed)?)?;
/// // From wall 0 to the one that faces it: √2 − 1.
/// assert!((factors[2] - (2_f64.sqrt() - 1.0)).abs() < 1e-15);
/// # Ok::<(), fredholm_room::RoomError>(())
/// ```
pub fn room_factors(scene: &Scene) -> Result<Vec<f64>, RoomError> {
    let surfaces = scene.surfaces();
    let width = surfaces + scene.outside().len();
    let entries = surfaces.checked_mul(width);
    let entries = entries.ok_or(RoomError::Memory { bytes: None })?;
    let mut out: Vec<f64> = buffer(entries)?;
    let walls = scene.geometry().walls().len();
    let surface = |seen: u32| match (seen as usize).checked_sub(walls) {
        Some(part_of_sky) => surfaces + part_of_sky,
        None => scene.place(seen as usize).map_or(0, |place| place.surface),
    };
    let all: Vec<u32> = (0..walls as u32).collect();
    exchanges(scene, &all, |wall, seen, exchange| {
        let row = surface(wall);
        let entry = out.get_mut(row * width + surface(seen));
        if let (Some(entry), Ok(length)) = (entry, scene.length(row)) {
            *entry += exchange * (1.0 / length);
        }
    });
    Ok(out)
}
