//! What a ray meets first.

use fredholm_core::Real;
pub(crate) use fredholm_surfaces::Backs;
use fredholm_surfaces::{DEPTH, Trace, trace};
use num_traits::{one, zero};

use crate::geometry::{Face, Geometry, Node, Period, Triangle};
use crate::vector::{Vector, along, dot, norm, sub};

/// A ray that has passed so many periods has left.
const MOST_PERIODS: u32 = 1_000_000;

/// The face and the place that a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<F> {
    /// The number of the face.
    pub face: u32,
    /// The point of the face.
    pub point: [F; 3],
    /// The distance from the ray's origin.
    pub distance: F,
    /// Whether it came from behind.
    pub back: bool,
}

/// A ray, and the frame in which it is the third axis: a shear of the axes, of which the longest of
/// the direction is the last (Woop, Benthin and Wald 2013).
struct Ray<'a, F> {
    triangles: &'a [Triangle<F>],
    emitter: Option<&'a Face<F>>,
    /// The number of the emitter's plane.
    plane: u32,
    origin: Vector<F>,
    direction: Vector<F>,
    per_direction: Vector<F>,
    axes: [usize; 3],
    shear: Vector<F>,
    backs: Backs,
    /// Distances below this share of the triangle's own are too near to be trusted.
    near: F,
    /// So are those below this.
    floor: F,
    /// The distance of what it met.
    limit: F,
    best: Option<Met<F>>,
}

/// A triangle that a ray meets.
struct Met<F> {
    triangle: u32,
    plane: u32,
    weights: [F; 3],
    distance: F,
    back: bool,
}

impl<'a, F: Real> Ray<'a, F> {
    fn new(
        triangles: &'a [Triangle<F>],
        emitter: Option<&'a Face<F>>,
        origin: Vector<F>,
        direction: Vector<F>,
        backs: Backs,
    ) -> Self {
        let size = [direction[0].abs(), direction[1].abs(), direction[2].abs()];
        let z = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        let [mut x, mut y] = [(z + 1) % 3, (z + 2) % 3];
        let at = |k: usize| direction.get(k).copied().unwrap_or(zero());
        if at(z) < zero() {
            // The sense of rotation stays.
            (x, y) = (y, x);
        }
        let per_z = one::<F>() / at(z);
        // No box is as far away, and 0 times it is no NaN.
        let huge = one::<F>() / (F::EPSILON * F::EPSILON * F::EPSILON * F::EPSILON);
        let inverse = |d: F| {
            if d.abs() * huge > one() {
                one::<F>() / d
            } else {
                huge.copysign(d)
            }
        };
        Self {
            triangles,
            emitter,
            plane: emitter.map_or(u32::MAX, |face| face.plane),
            origin,
            direction,
            per_direction: [
                inverse(direction[0]),
                inverse(direction[1]),
                inverse(direction[2]),
            ],
            axes: [x, y, z],
            shear: [at(x) * per_z, at(y) * per_z, per_z],
            backs,
            near: F::from_f64(16.0) * F::EPSILON.sqrt(),
            floor: F::from_f64(1024.0)
                * F::EPSILON
                * origin[0].abs().max(origin[1].abs()).max(origin[2].abs()),
            limit: F::from_f64(1e30),
            best: None,
        }
    }

    /// Where the ray meets a triangle: see [`Geometry::cast`].
    #[inline(always)]
    fn meets(&self, triangle: &Triangle<F>) -> Option<([F; 3], F, bool)> {
        if triangle.plane == self.plane {
            return None;
        }
        let none = [F::NAN; 3];
        let axis = |k: usize| {
            let p = triangle.axes.get(k).copied().unwrap_or(none);
            let o = self.origin.get(k).copied().unwrap_or(F::NAN);
            [p[0] - o, p[1] - o, p[2] - o]
        };
        let z = axis(self.axes[2]);
        let flat = |p: [F; 3], s: F| [p[0] - s * z[0], p[1] - s * z[1], p[2] - s * z[2]];
        let x = flat(axis(self.axes[0]), self.shear[0]);
        let y = flat(axis(self.axes[1]), self.shear[1]);
        let u = determinant(x[2], y[1], y[2], x[1]);
        let v = determinant(x[0], y[2], y[0], x[2]);
        let w = determinant(x[1], y[0], y[1], x[0]);
        let front = u >= zero() && v >= zero() && w >= zero();
        let back = u <= zero() && v <= zero() && w <= zero();
        if !(front || (back && self.backs == Backs::Block)) {
            return None;
        }
        let sum = u + v + w;
        if sum == zero() {
            return None;
        }
        let per = one::<F>() / sum;
        let weights = [u * per, v * per, w * per];
        let mut distance =
            self.shear[2] * (weights[0] * z[0] + weights[1] * z[1] + weights[2] * z[2]);
        let reach = z[0].abs().max(z[1].abs()).max(z[2].abs()) * self.shear[2].abs();
        if distance.abs() <= self.near * reach + self.floor {
            distance = self.distance_by_heights(triangle, weights, distance)?;
        } else if !(distance > zero()) {
            return None;
        }
        Some((weights, distance, !front))
    }

    /// The distance of a triangle that is met close to the origin, from the heights of its vertices
    /// above the emitter's plane, on which the origin lies. The emitter's own vertices have height 0,
    /// whatever rounding says, so that a neighbour at an edge is met if it rises on the active side.
    #[cold]
    fn distance_by_heights(
        &self,
        triangle: &Triangle<F>,
        weights: [F; 3],
        distance: F,
    ) -> Option<F> {
        let Some(face) = self.emitter else {
            return (distance > zero()).then_some(distance);
        };
        let [xs, ys, zs] = triangle.axes;
        let span = |k: usize| sub(face.corners[k], face.corners[0]);
        let largest = |v: Vector<F>| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let width = largest(span(1)).max(largest(span(2)));
        let coordinate = largest(face.corners[0]).max(largest(face.corners[2]));
        let (mut sum, mut noise) = (zero::<F>(), zero::<F>());
        let (mut highest, mut lowest) = (zero::<F>(), zero::<F>());
        for k in 0..3 {
            let corner = [xs[k], ys[k], zs[k]];
            if face.corners.contains(&corner) {
                continue;
            }
            let to = sub(corner, face.corners[0]);
            let height = dot(face.normal, to);
            // A normal is as good as the face is wide and thick.
            let tilt = largest(to) * (one::<F>() + coordinate * width / face.area);
            noise = noise.max(F::from_f64(8.0) * F::EPSILON * (coordinate + tilt));
            sum += weights[k] * height;
            highest = highest.max(height);
            lowest = lowest.max(-height);
        }
        // Where rounding decides, a triangle counts that rises more than it sinks.
        if !(sum > zero() || (sum >= -noise && highest > lowest)) {
            return None;
        }
        let sum = sum.max(zero());
        let rise = dot(face.normal, self.direction);
        Some(if rise > zero() {
            sum / rise
        } else {
            distance.max(zero())
        })
    }
}

impl<F: Real> Trace<Node<F>> for Ray<'_, F> {
    type Distance = F;

    #[inline(always)]
    fn entry(&self, node: &Node<F>) -> Option<F> {
        let (mut enter, mut leave) = (zero::<F>(), self.limit);
        let mut k = 0;
        while k < 3 {
            let a = (node.low[k] - self.origin[k]) * self.per_direction[k];
            let b = (node.high[k] - self.origin[k]) * self.per_direction[k];
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            enter = if near > enter { near } else { enter };
            leave = if far < leave { far } else { leave };
            k += 1;
        }
        (enter <= leave).then_some(enter)
    }

    /// Meets the triangles of a leaf.
    #[inline(always)]
    fn meet(&mut self, node: &Node<F>) {
        let first = node.first as usize;
        let leaf = self.triangles.get(first..first + node.count as usize);
        for (triangle, number) in leaf.unwrap_or(&[]).iter().zip(node.first..) {
            if let Some((weights, distance, back)) = self.meets(triangle) {
                // Twins back to back are met at one distance, but for rounding: the active
                // side counts.
                let twin = self.best.as_ref().filter(|b| b.plane == triangle.plane);
                let first = match twin {
                    Some(twin) if twin.back != back => twin.back,
                    _ => distance < self.limit,
                };
                if first {
                    self.limit = distance;
                    self.best = Some(Met {
                        triangle: number,
                        plane: triangle.plane,
                        weights,
                        distance,
                        back,
                    });
                }
            }
        }
    }
}

/// ab − cd, of the right sign: computed with the products' rounding errors where these matter.
#[inline(always)]
fn determinant<F: Real>(a: F, b: F, c: F, d: F) -> F {
    let (p, q) = (a * b, c * d);
    let difference = p - q;
    if difference.abs() <= F::from_f64(4.0) * F::EPSILON * p.abs() {
        difference + (a.product_error(b) - c.product_error(d))
    } else {
        difference
    }
}

impl<F: Real> Geometry<'_, F> {
    /// The first face that a ray from a point of face `from` to its active side meets; `direction`
    /// has length 1.
    ///
    /// **Rays, edges and vertices.** The vertices are sheared so that the ray is an axis, and the
    /// ray passes an edge on the side that the sign of a determinant of two vertices says (Woop,
    /// Benthin and Wald 2013), which here is that of the exact determinant; 0 is both sides. The
    /// number is the same for both triangles at the edge, so no gap is between them, and what the
    /// rounded vertices enclose is closed. Everything in the plane of the emitting face is left out
    /// by the plane's number. How far away a triangle is that comes close to the origin follows from
    /// the heights of its vertices above the emitter's plane: no distance is compared with an ε.
    ///
    /// In a closed scene faces are not met from behind: an active side comes first. In an open one
    /// they are, and a ray that meets a back first has left. A ray of a closed scene meets something;
    /// if the origin is outside of its face by a rounding error, the ray starts a little further
    /// inside.
    ///
    /// ```
    /// # #[cfg(feature = "alloc")] {
    /// use fredholm_scene::{Enclosure, Scene, shapes};
    ///
    /// let scene = Scene::new::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces(), Enclosure::Closed)?;
    /// // The floor is surface 0 and the ceiling surface 1: straight up, from near a corner.
    /// let hit = scene.geometry().cast(0, [0.25, 1e-300, 0.0], [0.0, 0.0, 1.0]).unwrap();
    /// assert_eq!((hit.face, hit.distance, hit.back), (1, 1.0, false));
    /// # }
    /// # Ok::<(), fredholm_scene::SceneError>(())
    /// ```
    #[inline]
    #[must_use]
    pub fn cast(&self, from: u32, origin: [F; 3], direction: [F; 3]) -> Option<Hit<F>> {
        let emitter = self.face(from)?;
        if self.is_open() {
            let hit = self.nearest(Some(emitter), origin, direction, Backs::Block)?;
            return (!hit.back).then_some(hit);
        }
        self.nearest(Some(emitter), origin, direction, Backs::Pass)
            .or_else(|| self.further_inside(emitter, origin, direction))
    }

    /// What a ray from a point of face `from` to its active side meets first, in an open scene perhaps from behind; `direction`
    /// has length 1.
    #[inline]
    #[must_use]
    pub fn meet(&self, from: u32, origin: [F; 3], direction: [F; 3]) -> Option<Hit<F>> {
        if self.is_open() {
            let emitter = self.face(from)?;
            return self.nearest(Some(emitter), origin, direction, Backs::Block);
        }
        self.cast(from, origin, direction)
    }

    /// Follows rays from points that are ever nearer to the middle of the face, and further above it: from above every
    /// face counts, as those in the emitter's plane may be a shallow bowl within rounding.
    #[cold]
    fn further_inside(
        &self,
        emitter: &Face<F>,
        origin: Vector<F>,
        direction: Vector<F>,
    ) -> Option<Hit<F>> {
        let to = sub(emitter.middle(), origin);
        let mut share = F::EPSILON * F::from_f64(64.0);
        // A direction in the face's plane meets nothing at all.
        let rise = dot(emitter.normal, direction);
        let least = F::EPSILON.sqrt();
        let up = along(direction, least, emitter.normal);
        let direction = if rise > least { direction } else { up };
        while share < one() {
            let from = along(origin, share, to);
            let own = self.nearest(Some(emitter), from, direction, Backs::Pass);
            let above = along(from, share * norm(to), emitter.normal);
            let hit = own.or_else(|| self.nearest(None, above, direction, Backs::Pass));
            if hit.is_some() {
                return hit;
            }
            share *= F::from_f64(32.0);
        }
        None
    }

    /// The first face that a ray meets; its point is that of the first period.
    #[inline]
    pub(crate) fn nearest(
        &self,
        emitter: Option<&Face<F>>,
        origin: Vector<F>,
        direction: Vector<F>,
        backs: Backs,
    ) -> Option<Hit<F>> {
        match &self.period {
            None => self.nearest_in_one(emitter, origin, direction, backs),
            Some(period) => self.nearest_in_all(period, emitter, (origin, direction), backs),
        }
    }

    /// The first face that a ray meets in a scene that repeats: period by period.
    #[inline(never)]
    fn nearest_in_all(
        &self,
        Period { lengths, low }: &Period<F>,
        emitter: Option<&Face<F>>,
        (origin, direction): (Vector<F>, Vector<F>),
        backs: Backs,
    ) -> Option<Hit<F>> {
        let all = self.nodes().first()?;
        // What the origin is moved by, to be where the ray is in the first period; and how far away the ray leaves them all.
        let (mut shift, mut leaves) = ([zero::<F>(); 3], F::from_f64(f64::INFINITY));
        for k in 0..3 {
            if lengths[k] > zero() {
                let periods = (origin[k] - low[k]) / lengths[k];
                let whole = F::from_u32(periods.abs().to_u32()).copysign(periods);
                let rest = if whole > periods { one() } else { zero::<F>() };
                shift[k] = (whole - rest) * lengths[k];
            } else if direction[k] != zero() {
                let side = if direction[k] > zero() {
                    all.high[k]
                } else {
                    all.low[k]
                };
                let at = (side - origin[k]) / direction[k];
                leaves = if at < leaves { at } else { leaves };
            }
        }
        for _ in 0..MOST_PERIODS {
            let from = sub(origin, shift);
            // Faces in the plane of one that goes on in all periods are not met.
            let along_plane = |face: &&Face<F>| {
                dot(face.normal, shift).abs() <= F::from_f64(16.0) * F::EPSILON * norm(shift)
            };
            let own = emitter.filter(along_plane);
            let met = self.nearest_in_one(own, from, direction, backs);
            if met.is_some() {
                return met;
            }
            let mut next = (F::from_f64(f64::INFINITY), 0);
            for k in 0..3 {
                if lengths[k] > zero() && direction[k] != zero() {
                    let end = if direction[k] > zero() {
                        lengths[k]
                    } else {
                        zero()
                    };
                    let at = (low[k] + end - from[k]) / direction[k];
                    next = if at < next.0 { (at, k) } else { next };
                }
            }
            let (at, k) = next;
            // Written so that NaN ends it.
            if !(at < leaves) {
                return None;
            }
            for axis in 0..3 {
                if axis == k {
                    shift[axis] += lengths[axis].copysign(direction[axis]);
                }
            }
        }
        None
    }

    /// The first face that a ray meets in the first period.
    #[inline]
    fn nearest_in_one(
        &self,
        emitter: Option<&Face<F>>,
        origin: Vector<F>,
        direction: Vector<F>,
        backs: Backs,
    ) -> Option<Hit<F>> {
        let ray = Ray::new(self.triangles(), emitter, origin, direction, backs);
        let met = self.trace(ray)?;
        let triangle = self.triangles().get(met.triangle as usize)?;
        let point = triangle.axes.map(|axis| dot(axis, met.weights));
        Some(Hit {
            face: triangle.face,
            point,
            distance: met.distance,
            back: met.back,
        })
    }

    /// The first triangle that a ray meets.
    fn trace(&self, mut ray: Ray<'_, F>) -> Option<Met<F>> {
        trace::<_, { DEPTH + 2 }>(self.nodes(), &mut ray);
        ray.best
    }
}

#[cfg(test)]
mod tests {
    use super::determinant;

    /// (1 + 2⁻³⁰)² = 1 + 2⁻²⁹ + 2⁻⁶⁰, of which the product of numbers loses the last.
    #[test]
    fn a_determinant_has_the_sign_of_the_exact_one() {
        let (a, c) = (1.0 + 2_f64.powi(-30), 1.0 + 2_f64.powi(-29));
        assert_eq!(a * a - c, 0.0);
        assert_eq!(determinant(a, a, c, 1.0), 2_f64.powi(-60));
        assert_eq!(determinant(c, 1.0, a, a), -(2_f64.powi(-60)));
        assert_eq!(determinant(3.0, 2.0, 1.0, 4.0), 2.0);
    }
}
