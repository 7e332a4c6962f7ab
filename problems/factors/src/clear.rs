//! What two polygons exchange that see each other wholly.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_core::array::from_fn;
use fredholm_scene::form_factor_from_origin as from_origin;
use fredholm_surfaces::space::{Vector, centroid, dot, norm, sub};

use crate::contour;
use crate::rules::{Rules, area, radius};

/// The number of unit roundings that a rule is allowed to be off.
const ACCURATE: f64 = 3e-14;

/// Unit roundings of places in the integrals along contours.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// At this many radii the contours' differences begin to cost digits, and few points suffice.
const FAR: f64 = 4.0;

/// An amount and what it may be wrong by.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Amount {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

/// The sine of an angle below which a direction is along a plane.
pub(crate) const PARALLEL: f64 = 1.0 / (1_u64 << 40) as f64;

/// A polygon, and the unit vector to its active side; or one at infinity, whose points are unit vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheet<'a> {
    pub(crate) points: &'a [Vector<f64>],
    pub(crate) normal: Vector<f64>,
    pub(crate) far: bool,
}

impl Sheet<'_> {
    /// Directions that this sheet sees.
    pub(crate) const fn directions<'d>(&self, points: &'d [Vector<f64>]) -> Sheet<'d> {
        Sheet {
            points,
            normal: self.normal,
            far: true,
        }
    }

    /// Where a point of the sheet is as seen from another point.
    pub(crate) fn aim(&self, from: Vector<f64>, point: Vector<f64>) -> Vector<f64> {
        if self.far { point } else { sub(point, from) }
    }
}

/// A_1 F_12 of two polygons, each wholly on the active side of the other and seeing all of it, to
/// `error` in F; never below 0. If the second is at infinity all points of the first see the same of it. Otherwise by contours if they are near each other, else by points of which
/// there are as many as the distance asks for.
pub(crate) fn exchange(a: Sheet<'_>, b: Sheet<'_>, error: f64, rules: &Rules) -> Amount {
    if b.far {
        return Amount {
            value: Real::max(area(a.points) * from_origin(a.normal, b.points), 0.0),
            error: 0.0,
        };
    }
    let middles = [centroid(a.points), centroid(b.points)];
    let radii = [radius(a.points, middles[0]), radius(b.points, middles[1])];
    let apart = norm(sub(middles[0], middles[1]));
    let (large, small) = if radii[0] >= radii[1] { (0, 1) } else { (1, 0) };
    // The distance of the large one's points from the middle of the small one, in radii of this.
    let reach = (apart - radii[large]) / radii[small];
    let mut rounding = 0.0;
    let value = if reach < FAR {
        let size = radii[0] + radii[1];
        // Places are rounded to the size of both, which moves the edges of the smaller one.
        rounding = ROUNDING * size * radii[small];
        near(a, b, middles[0], size, rules)
    } else {
        let gain = reach + Real::sqrt(reach * reach - 1.0);
        let factor = radii[large] * radii[large] / (apart * apart);
        let digits = Real::ln(Real::max(factor.min(1.0) / Real::max(error, ACCURATE), 1.0));
        let points = |gain: f64| 1 + (0.5 * digits / Real::ln(gain)) as usize;
        let mutual = (apart - radii[small]) / radii[large];
        let both = if mutual > 2.0 {
            points(mutual + Real::sqrt(mutual * mutual - 1.0))
        } else {
            usize::MAX
        };
        if both <= 3 {
            double(a, b, both, rules)
        } else {
            let (outer, inner) = if small == 0 { (a, b) } else { (b, a) };
            single(outer, inner, points(gain), rules)
        }
    };
    Amount {
        value: Real::max(value, 0.0),
        error: rounding,
    }
}

/// By contours, in units of the polygons' own size.
fn near(a: Sheet<'_>, b: Sheet<'_>, origin: Vector<f64>, size: f64, rules: &Rules) -> f64 {
    let own = |sheet: Sheet<'_>| -> Vec<Vector<f64>> {
        let points = sheet.points.iter();
        points
            .map(|p| from_fn(|k| (p[k] - origin[k]) / size))
            .collect()
    };
    size * size * contour::exchange(&own(a), &own(b), rules.blur / size, rules)
}

/// By points of one polygon.
fn single(outer: Sheet<'_>, inner: Sheet<'_>, points: usize, rules: &Rules) -> f64 {
    let mut sum = 0.0;
    let mut relative = Vec::with_capacity(inner.points.len());
    for (x, weight) in rules.polygon(points, outer.points) {
        relative.clear();
        relative.extend(inner.points.iter().map(|&p| sub(p, x)));
        sum += weight * from_origin(outer.normal, &relative);
    }
    sum
}

/// By points of both: cos θ cos θ'/(π r²).
fn double(a: Sheet<'_>, b: Sheet<'_>, points: usize, rules: &Rules) -> f64 {
    let mut sum = 0.0;
    let others = rules.polygon(points, b.points);
    for (x, weight) in rules.polygon(points, a.points) {
        let mut inner = 0.0;
        for &(y, weight) in &others {
            let r = sub(y, x);
            let square = dot(r, r);
            inner -= weight * dot(a.normal, r) * dot(b.normal, r) / (square * square);
        }
        sum += weight * inner;
    }
    sum / core::f64::consts::PI
}
