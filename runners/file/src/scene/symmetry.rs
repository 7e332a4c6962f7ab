//! Symmetry planes: a scene of which one half is given, or a quarter, or an eighth.

use core::array::from_fn;

use fredholm_scene::{Polygon, shapes};

use super::{MAX_POLYGONS, SceneFile};
use crate::place::InputError;
use crate::section::{Field, Section};

/// A plane on which one coordinate has one value.
pub(super) struct Plane<'s, 't> {
    axis: usize,
    at: f64,
    field: Field<'s, 't>,
}

impl Plane<'_, '_> {
    /// Lights are where they are given, and nowhere else.
    pub(super) fn refuse_lights(&self) -> InputError {
        self.field
            .error("`symmetry` mirrors surfaces, and no `light`: give the whole scene")
    }
}

/// What `symmetry` says: `{ x = 0, y = 1.5 }`.
pub(super) fn read<'s, 't>(
    section: &mut Section<'s, 't>,
) -> Result<Vec<Plane<'s, 't>>, InputError> {
    let Some(field) = section.optional("symmetry") else {
        return Ok(Vec::new());
    };
    let mut planes = Vec::new();
    let mut own = field.section("in `symmetry`")?;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        if let Some(field) = own.optional(name) {
            let at = field.number()?.value;
            planes.push(Plane { axis, at, field });
        }
    }
    own.finish()?;
    Ok(planes)
}

/// Adds to every surface its mirror image, so that the scene is whole.
pub(super) fn complete(scene: &mut SceneFile, planes: &[Plane<'_, '_>]) -> Result<(), InputError> {
    for plane in planes {
        let all = scene.surfaces.iter().flat_map(|s| &s.polygons);
        let mut sides = all
            .flat_map(|p| p.points())
            .map(|p| p[plane.axis] - plane.at);
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        sides
            .by_ref()
            .for_each(|s| (low, high) = (low.min(s), high.max(s)));
        // What was turned is on the plane but for rounding.
        let rounding = 1e-12 * (high - low);
        if low < -rounding && high > rounding {
            let axis = &plane.field.name;
            let message = format!(
                "the scene must be on one side of the plane {axis} = {}, and reaches from {} to {}",
                plane.at,
                plane.at + low,
                plane.at + high
            );
            return Err(plane.field.error(message));
        }
        let polygons: usize = scene.surfaces.iter().map(|s| s.polygons.len()).sum();
        if polygons > MAX_POLYGONS / 2 {
            return Err(plane
                .field
                .error(format_args!("more than {MAX_POLYGONS} polygons")));
        }
        for surface in &mut scene.surfaces {
            let images: Vec<Polygon> = surface.polygons.iter().map(|p| plane.image(p)).collect();
            surface.polygons.extend(images);
            surface.places.extend_from_within(..);
        }
    }
    Ok(())
}

impl Plane<'_, '_> {
    fn image(&self, polygon: &Polygon) -> Polygon {
        let point = |p: [f64; 3]| {
            from_fn(|k| {
                if k == self.axis {
                    2.0 * self.at - p[k]
                } else {
                    p[k]
                }
            })
        };
        shapes::reversed(&match polygon {
            Polygon::Triangle(p) => Polygon::Triangle(p.map(point)),
            Polygon::Quad(p) => Polygon::Quad(p.map(point)),
        })
    }
}
