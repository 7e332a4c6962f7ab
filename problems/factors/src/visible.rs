//! What a point sees of a polygon behind others, by convex clipping of directions.

use alloc::vec::Vec;

use fredholm_scene::form_factor_from_origin;
use fredholm_surfaces::space::{Vector, cross, dot, norm, ring};

use crate::clip::Rest;

/// The form factor from the origin to the part of a convex polygon, or cone of directions, that no screen hides. All of them are
/// above the origin's horizon, and the screens are before the polygon. Each comes with the height of the origin above its plane,
/// which is not 0.
pub(crate) fn factor(
    rest: &mut Rest<3>,
    normal: Vector<f64>,
    polygon: &[Vector<f64>],
    screens: &[(Vec<Vector<f64>>, f64)],
) -> f64 {
    rest.begin(polygon);
    for (screen, height) in screens {
        // Inwards, if it is seen from its back.
        let inward = |[a, b]: [Vector<f64>; 2]| {
            let normal = cross(a, b);
            if *height < 0.0 {
                normal
            } else {
                normal.map(|x| -x)
            }
        };
        let halves: Vec<Vector<f64>> = ring(screen).map(inward).collect();
        rest.take(&halves, dot, norm, |_| {});
    }
    rest.each()
        .map(|cone| form_factor_from_origin(normal, cone))
        .sum()
}
