//! The last step of a walk, to the light.

use fredholm_core::galerkin::Cells as _;
use fredholm_core::{Real, Uniforms, Value as _};
use num_traits::{one, zero};

use crate::cells::folded;
use crate::geometry::Face;
use crate::lambert::form_factor_from_origin as from_origin;
use crate::radiosity::{Point, Radiosity};
use crate::vector::{Vector, along, cross, dot, norm, sub};
use fredholm_surfaces::Tint;

/// From this many widths on a triangle is far: points that are uniform on it are nearly uniform in the solid angle.
const FAR: f64 = 4.0;

/// Rays to a light of which a cell sees a part, where others take one: in the half-shadows of a Cornell box with 1,000 cells
/// four lower the error at equal time by a third, and sixteen no further.
const PARTIAL: u32 = 4;

/// Powers of 1/φ, where φ⁴ = φ + 1 (Roberts 2018): from one point of an even sequence to the next.
const SPREAD: [f64; 3] = [
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_3,
    0.549_700_477_901_970_2,
];

/// A convex polygon of at most five vertices, as seen from a point: a quadrilateral, cut by a plane.
#[derive(Clone, Copy)]
pub(crate) struct Seen<F> {
    vertices: [Vector<F>; 5],
    count: usize,
}

impl<F: Real> Seen<F> {
    /// The part of a face above the horizon of a point with this normal, relative to the point.
    pub(crate) fn new(face: &Face<F>, from: Vector<F>, normal: Vector<F>) -> Self {
        let mut seen = Self {
            vertices: [[zero(); 3]; 5],
            count: 0,
        };
        let polygon = face.polygon();
        let Some(&last) = polygon.last() else {
            return seen;
        };
        let mut before = sub(last, from);
        let mut low = dot(normal, before);
        for &corner in polygon {
            let at = sub(corner, from);
            let high = dot(normal, at);
            if (low < zero() && high > zero()) || (low > zero() && high < zero()) {
                seen.push(along(before, low / (low - high), sub(at, before)));
            }
            if high >= zero() {
                seen.push(at);
            }
            (before, low) = (at, high);
        }
        seen
    }

    fn push(&mut self, vertex: Vector<F>) {
        if let Some(place) = self.vertices.get_mut(self.count) {
            *place = vertex;
            self.count += 1;
        }
    }

    pub(crate) fn polygon(&self) -> &[Vector<F>] {
        self.vertices.get(..self.count).unwrap_or(&[])
    }
}

/// A choice among things with weights, one after the other, by one uniform number that stays uniform.
struct Choice<F> {
    uniform: F,
    sum: F,
}

impl<F: Real> Choice<F> {
    /// Whether this one takes the place of all before.
    fn takes(&mut self, weight: F) -> bool {
        self.sum += weight;
        let share = weight / self.sum;
        let takes = self.uniform < share;
        self.uniform = if takes {
            self.uniform / share
        } else {
            (self.uniform - share) / (one::<F>() - share)
        };
        takes
    }
}

/// Where light falls: on a face, or on a surface between them that is too small to change anything.
pub(crate) struct Receiver<'p, F> {
    pub(crate) position: Vector<F>,
    pub(crate) normal: Vector<F>,
    /// The point of a face, if it is one, and the number of the face's plane.
    pub(crate) on: Option<(&'p Point<F>, u32)>,
}

/// A point of a light as seen from another point.
struct Aim<F> {
    direction: Vector<F>,
    /// r: what the point gives over what the whole light gives, over the density of the point. Its mean is 1.
    ratio: F,
}

/// A light, as a point sees it.
struct Light<F> {
    /// The number of its face.
    face: u32,
    /// The place in the list of lights.
    place: usize,
    seen: Seen<F>,
    /// The form factor of the part above the horizon, whatever hides it.
    factor: F,
}

impl<F: Real, C: Tint<F>> Radiosity<'_, F, C> {
    /// The shares of each light that each cell sees, times 255, from so many rays for each: row by row, one number for
    /// every light. With them the last step to the light varies less; whether they are right makes no other difference.
    #[cfg(feature = "alloc")]
    #[must_use]
    pub fn visible_shares(&self, rays: u32) -> alloc::vec::Vec<u8> {
        use fredholm_core::{DefaultGenerator, RngUniforms, WalkSeeds};
        let seeds = WalkSeeds::<DefaultGenerator>::new(1, u64::MAX);
        let mut shares = alloc::vec::Vec::new();
        for cell in 0..self.cells_of_faces() {
            let mut draws = RngUniforms(seeds.generator(cell as u64));
            for place in 0..self.tables.lights.len() {
                let (mut seen, mut aimed) = (0_u32, 0_u32);
                for _ in 0..rays {
                    let t: [f64; 2] = [draws.uniform(), draws.uniform()];
                    let x = self.point(cell, &t);
                    let numbers = [draws.uniform(), draws.uniform(), draws.uniform()];
                    if let Some(x) = self.receiver(&x)
                        && let Some(light) = self.light_from(&x, place)
                        && let Some(aim) = self.aim(&x, &light, numbers)
                    {
                        aimed += 1;
                        seen += u32::from(self.sees(&x, light.face, &aim));
                    }
                }
                let share = if aimed > 0 {
                    f64::from(seen) / f64::from(aimed)
                } else {
                    1.0
                };
                // Rounded to the nearest.
                shares.push((255.0 * share + 0.5) as u8);
            }
        }
        shares
    }

    /// The point of a face as one on which light falls.
    #[inline]
    pub(crate) fn receiver<'p>(&self, x: &'p Point<F>) -> Option<Receiver<'p, F>> {
        let own = self.face(x)?;
        Some(Receiver {
            position: x.position,
            normal: own.normal,
            on: Some((x, own.plane)),
        })
    }

    /// A light as x sees it, if there is nothing between; `None`: it is behind x or x behind it.
    #[inline]
    fn light_from(&self, x: &Receiver<'_, F>, place: usize) -> Option<Light<F>> {
        let face = *self.tables.lights.get(place)?;
        let light = self.geometry.face(face)?;
        let is_behind = dot(light.normal, sub(x.position, light.corners[0])) <= zero();
        if is_behind || x.on.is_some_and(|(_, plane)| plane == light.plane) {
            return None;
        }
        let seen = Seen::new(light, x.position, x.normal);
        let factor = from_origin(x.normal, seen.polygon());
        (factor > zero()).then_some(Light {
            face,
            place,
            seen,
            factor,
        })
    }

    /// A random point of a light. `None`: there is none, from an edge of the light itself.
    #[inline]
    fn aim(
        &self,
        x: &Receiver<'_, F>,
        light: &Light<F>,
        [uniform, s, t]: [F; 3],
    ) -> Option<Aim<F>> {
        let (direction, solid_angle) = to_polygon(&light.seen, uniform, [s, t])?;
        let ratio = dot(x.normal, direction) * solid_angle / (F::PI * light.factor);
        ratio.is_finite().then_some(Aim { direction, ratio })
    }

    fn sees(&self, x: &Receiver<'_, F>, face: u32, aim: &Aim<F>) -> bool {
        let hit = match x.on {
            Some((point, _)) => self
                .geometry
                .cast(point.face, point.position, aim.direction),
            None => self
                .geometry
                .nearest(None, x.position, aim.direction, self.geometry.backs()),
        };
        hit.is_some_and(|hit| hit.face == face)
    }

    /// An unbiased estimate of the light that reaches a point directly, ∫ F(y) cos θ_x cos θ_y V(x, y)/(π |x − y|²) dA(y),
    /// by a ray, or several in half-shadow.
    ///
    /// What reached it if nothing were hidden is known, Σ_l F_l F_x→l of the parts of lights above the horizon. One light is
    /// chosen by |F_l| F_x→l, with the sign of its F_l, and a point y on it, and with any number a,
    ///
    /// ```text
    /// Σ_l F_l F_x→l (a + r (V(x, y) − a)),    r = (cos θ_x cos θ_y/(π |x − y|²))/(l(x, y) F_x→l),
    /// ```
    ///
    /// has the right mean, since r has the mean 1, where l is the density of y. a is the share of the light that the cell
    /// sees: where that is all or nothing, there is no variance. y is uniform in the solid angle of a triangle that is
    /// near (Arvo 1995), and on the polygon if it is far.
    pub(crate) fn direct<U: Uniforms<F>>(&self, x: &Receiver<'_, F>, uniforms: &mut U) -> C::Value {
        let mut choice = Choice {
            uniform: uniforms.uniform(),
            sum: zero(),
        };
        let [s, t] = [uniforms.uniform(), uniforms.uniform()];
        let mut chosen = None;
        for place in 0..self.tables.lights.len() {
            let Some(light) = self.light_from(x, place) else {
                continue;
            };
            let face = self.geometry.face(light.face);
            let emission = face.map_or(zero(), |face| face.emission);
            // What takes light away has an emission below 0.
            let sign = one::<F>().copysign(emission);
            if choice.takes(sign * emission * light.factor) {
                chosen = Some((light, sign));
            }
        }
        let Some((light, sign)) = chosen else {
            return self.white(zero());
        };
        let visible = self.sample_visible(x, &light, [choice.uniform, s, t]);
        let arriving = sign * choice.sum * visible;
        self.tint.emission(light.face).scaled(arriving)
    }

    /// An estimate of all that reaches a point directly: from lights, from lamps at points and from the sun.
    pub(crate) fn irradiance<U: Uniforms<F>>(
        &self,
        x: &Receiver<'_, F>,
        uniforms: &mut U,
    ) -> C::Value {
        let of_lights = self.direct(x, uniforms);
        of_lights.plus(&self.white(self.irradiance_of_beams(x)))
    }

    /// The mean of a + r (V − a) over a ray to a light, or over several in half-shadow.
    fn sample_visible(&self, x: &Receiver<'_, F>, light: &Light<F>, mut numbers: [F; 3]) -> F {
        let share = self.share(x, light.place);
        let is_partial = share > zero() && share < one();
        let rays = if is_partial { PARTIAL } else { 1 };
        let mut sum = zero::<F>();
        for ray in 0..rays {
            if ray > 0 {
                for (number, by) in numbers.iter_mut().zip(SPREAD) {
                    *number += F::from_f64(by);
                    if *number >= one() {
                        *number -= one();
                    }
                }
            }
            // From an edge of the light itself nothing hides it.
            sum += self.aim(x, light, numbers).map_or(one(), |aim| {
                let is_seen = self.sees(x, light.face, &aim);
                let visible = if is_seen { one() } else { zero::<F>() };
                share + aim.ratio * (visible - share)
            });
        }
        sum / F::from_u32(rays)
    }

    /// a.
    #[inline]
    fn share(&self, x: &Receiver<'_, F>, place: usize) -> F {
        let Some((point, _)) = x.on.filter(|_| !self.shares.is_empty()) else {
            return one();
        };
        let share = self
            .shares
            .get(self.locate(point) * self.tables.lights.len() + place);
        F::from_u32(u32::from(share.copied().unwrap_or(255))) / F::from_f64(255.0)
    }
}

/// A direction to a point of the polygon, and one over its density in solid angles. `None`: there is no polygon.
fn to_polygon<F: Real>(seen: &Seen<F>, uniform: F, point: [F; 2]) -> Option<(Vector<F>, F)> {
    let (&hub, rest) = seen.polygon().split_first()?;
    let is_far = is_far(seen.polygon());
    let mut choice = Choice {
        uniform,
        sum: zero(),
    };
    let mut chosen = None;
    for pair in rest.windows(2) {
        let &[b, c] = pair else { continue };
        let size = if is_far {
            norm(cross(sub(b, hub), sub(c, hub)))
        } else {
            solid_angle([hub, b, c])
        };
        if size > zero() && choice.takes(size) {
            chosen = Some(([hub, b, c], size));
        }
    }
    let (triangle, size) = chosen?;
    let (direction, per_density) = if is_far {
        on_triangle(triangle, point)
    } else {
        (in_solid_angle(triangle, size, point), size)
    };
    Some((direction, per_density * choice.sum / size))
}

/// Whether the origin is many widths away.
fn is_far<F: Real>(polygon: &[Vector<F>]) -> bool {
    let Some(&first) = polygon.first() else {
        return false;
    };
    let (mut width, mut distance) = (zero::<F>(), dot(first, first));
    for &at in polygon {
        let across = sub(at, first);
        width = width.max(dot(across, across));
        distance = smaller(distance, dot(at, at));
    }
    distance > F::from_f64(FAR * FAR) * width
}

/// Uniform on the triangle: a direction, and one over its density in solid angles.
fn on_triangle<F: Real>([a, b, c]: [Vector<F>; 3], numbers: [F; 2]) -> (Vector<F>, F) {
    let [s, t] = folded(numbers);
    let spans = [sub(b, a), sub(c, a)];
    let y = along(along(a, s, spans[0]), t, spans[1]);
    let double = cross(spans[0], spans[1]);
    let square = dot(y, y);
    let per_length = one::<F>() / square.sqrt();
    // The area times the cosine at y over the square of the distance.
    let per_density = F::from_f64(0.5) * dot(double, y).abs() * per_length / square;
    (y.map(|y| y * per_length), per_density)
}

/// The solid angle of a triangle as seen from the origin (van Oosterom and Strackee 1983): no sum of angles less π, which
/// cancels.
fn solid_angle<F: Real>(triangle: [Vector<F>; 3]) -> F {
    let [a, b, c] = triangle.map(unit);
    let volume = dot(a, cross(b, c)).abs();
    let denominator = one::<F>() + dot(a, b) + dot(b, c) + dot(c, a);
    F::from_f64(2.0) * volume.atan2(denominator)
}

fn smaller<F: Real>(a: F, b: F) -> F {
    if a <= b { a } else { b }
}

fn unit<F: Real>(a: Vector<F>) -> Vector<F> {
    let per_length = one::<F>() / norm(a);
    a.map(|x| x * per_length)
}

/// a b times the unit vector from a towards b, perpendicular to a: the tangent of their arc.
fn tangent<F: Real>(a: Vector<F>, b: Vector<F>) -> Vector<F> {
    unit(along(b, -dot(a, b), a))
}

/// Uniform in the solid angle of a triangle, which is `area` (Arvo 1995, "Stratified sampling of spherical triangles").
fn in_solid_angle<F: Real>(triangle: [Vector<F>; 3], area: F, [s, t]: [F; 2]) -> Vector<F> {
    let [a, b, c] = triangle.map(unit);
    let volume = dot(a, cross(b, c)).abs();
    // The angle at a, and the cosine of the arc from a to b.
    let cosine_c = dot(a, b);
    let angle = volume.atan2(dot(cross(a, b), cross(a, c)));
    let (sine, cosine) = (angle.sin(), angle.cos());
    let part = s * area;
    let (p, q) = ((part - angle).sin(), (part - angle).cos());
    let (u, v) = (q - cosine, p + sine * cosine_c);
    let above = (v * q - u * p) * cosine - v;
    let below = (v * p + u * q) * sine;
    let w = if below == zero() {
        one()
    } else {
        smaller(above / below, one()).max(-one::<F>())
    };
    // On the arc from a to c, and then from b to there.
    let on_arc = mixed(a, w, tangent(a, c));
    let z = one::<F>() - t * (one::<F>() - dot(on_arc, b));
    mixed(b, z, tangent(b, on_arc))
}

/// The unit vector at the angle with this cosine from a, towards the perpendicular b.
fn mixed<F: Real>(a: Vector<F>, cosine: F, b: Vector<F>) -> Vector<F> {
    let sine = (one::<F>() - cosine * cosine).max(zero()).sqrt();
    let sum = [
        cosine * a[0] + sine * b[0],
        cosine * a[1] + sine * b[1],
        cosine * a[2] + sine * b[2],
    ];
    // 0 times a tangent that is none, where both vectors are one.
    if sum[0].is_finite() && sum[1].is_finite() && sum[2].is_finite() {
        sum
    } else {
        a
    }
}
