//! The last step of a walk, to the light.

#[cfg(feature = "alloc")]
use fredholm_core::galerkin::CellMap;
use fredholm_core::galerkin::Partition;
use fredholm_core::{Real, SourceSampler, Uniforms};
use num_traits::{one, zero};

use crate::geometry::Face;
use crate::lambert::form_factor_from_origin as from_origin;
use crate::radiosity::{Point, Radiosity};
use crate::ray::Backs;
use crate::skylight::SKY;
use crate::vector::{Vector, along, cross, dot, norm, sub};

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

/// What a last step to the light takes.
#[derive(Clone, Copy, Debug)]
pub struct LastStepWork {
    /// The number of lights that shine towards the point, whatever is between: it looks at all of them.
    pub lights: f64,
    /// The number of rays to the one that it chooses: several in half-shadow.
    pub rays: f64,
}

/// Rays to a light of which the cell sees this share.
fn rays_of<F: Real>(share: F) -> u32 {
    let is_partial = share > zero() && share < one();
    if is_partial { PARTIAL } else { 1 }
}

/// Whether a light shines towards a point, whatever is between.
#[inline]
fn shines<F: Real>(light: &Face<F>, x: &Receiver<'_, F>) -> bool {
    let is_in_front = dot(light.normal, sub(x.position, light.corners[0])) > zero();
    is_in_front && x.on.is_none_or(|(_, plane)| plane != light.plane)
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

impl<F: Real> Radiosity<'_, F> {
    /// The shares of each light that each cell sees, times 255, from so many rays for each: row by row, one number for
    /// every light. With them the last step to the light varies less; whether they are right makes no other difference.
    #[cfg(feature = "alloc")]
    #[must_use]
    pub fn visible_shares(&self, rays: u32) -> alloc::vec::Vec<u8> {
        let seeds = fredholm_core::WalkSeeds::<fredholm_core::DefaultGenerator>::new(1, u64::MAX);
        let mut shares = alloc::vec::Vec::new();
        for cell in 0..self.cells_of_faces() {
            let mut draws = fredholm_core::RngUniforms(seeds.generator(cell as u64));
            for place in 0..self.lights.len() {
                let (mut seen, mut aimed) = (0.0, 0.0);
                for _ in 0..rays {
                    let t: [f64; 2] = [draws.uniform(), draws.uniform()];
                    let x = self.point(cell, &t);
                    let numbers = [draws.uniform(), draws.uniform(), draws.uniform()];
                    if let Some(x) = self.receiver(&x)
                        && let Some(light) = self.light(&x, place)
                        && let Some(aim) = self.aim(&x, &light, numbers)
                    {
                        aimed += 1.0;
                        seen += if self.sees(&x, light.face, &aim) {
                            1.0
                        } else {
                            0.0
                        };
                    }
                }
                let share: f64 = if aimed > 0.0 { seen / aimed } else { 1.0 };
                // Rounded to the nearest.
                shares.push((255.0 * share + 0.5) as u8);
            }
        }
        shares
    }

    /// What a last step takes, in the mean over cells. Of more than 1,024 cells some are looked at.
    #[cfg(feature = "alloc")]
    #[must_use]
    pub fn last_step_work(&self) -> LastStepWork {
        let all = self.cells_of_faces();
        let (mut lights, mut rays, mut cells) = (0.0, 0.0, 0.0);
        for cell in (0..all).step_by(all.div_ceil(1024).max(1)) {
            let x = self.point(cell, &[0.5, 0.5]);
            let Some(x) = self.receiver(&x) else { continue };
            let (mut own, mut weights) = (0.0, 0.0);
            for place in 0..self.lights.len() {
                let face = self.lights.get(place).and_then(|&l| self.geometry.face(l));
                let Some(face) = face.filter(|face| shines(face, &x)) else {
                    continue;
                };
                lights += 1.0;
                let factor = self.light(&x, place).map_or(zero(), |light| light.factor);
                let weight = (face.emission * factor).to_f64().abs();
                own += weight * f64::from(rays_of(self.share(&x, place)));
                weights += weight;
            }
            rays += if weights > 0.0 { own / weights } else { 0.0 };
            cells += 1.0;
        }
        LastStepWork {
            lights: lights / cells,
            rays: rays / cells,
        }
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
    fn light(&self, x: &Receiver<'_, F>, place: usize) -> Option<Light<F>> {
        let face = *self.lights.get(place)?;
        let light = self.geometry.face(face)?;
        if !shines(light, x) {
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
                .nearest(None, x.position, aim.direction, self.backs()),
        };
        hit.is_some_and(|hit| hit.face == face)
    }

    /// The emission that walks score where they meet the face of x.
    #[inline]
    pub(crate) fn own_emission(&self, x: &Point<F>) -> F {
        let side = self.sides.get(x.face as usize);
        side.map_or(F::NAN, |side| side.emission)
    }

    /// What backs do to rays that start between the faces.
    pub(crate) const fn backs(&self) -> Backs {
        if self.geometry.is_open() {
            Backs::Block
        } else {
            Backs::Pass
        }
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
    pub(crate) fn sample_direct<U: Uniforms<F>>(&self, x: &Receiver<'_, F>, uniforms: &mut U) -> F {
        self.sample_light(x, uniforms)
            .map_or(zero(), |(_, direct)| direct)
    }

    /// The face of the light that is chosen, and the estimate that [`sample_direct`](Self::sample_direct) is. `None`: no light
    /// is above the horizon.
    pub(crate) fn sample_light<U: Uniforms<F>>(
        &self,
        x: &Receiver<'_, F>,
        uniforms: &mut U,
    ) -> Option<(u32, F)> {
        let mut choice = Choice {
            uniform: uniforms.uniform(),
            sum: zero(),
        };
        let point = [uniforms.uniform(), uniforms.uniform()];
        let mut chosen = None;
        for place in 0..self.lights.len() {
            let Some(light) = self.light(x, place) else {
                continue;
            };
            let emission = self
                .geometry
                .face(light.face)
                .map_or(zero(), |l| l.emission);
            // What takes light away has an emission below 0.
            let sign = one::<F>().copysign(emission);
            if choice.takes(sign * emission * light.factor) {
                chosen = Some((light, sign));
            }
        }
        let (light, sign) = chosen?;
        let [s, t] = point;
        let visible = self.sample_visible(x, &light, [choice.uniform, s, t]);
        Some((light.face, sign * choice.sum * visible))
    }

    /// The mean of a + r (V − a) over a ray to a light, or over several in half-shadow.
    fn sample_visible(&self, x: &Receiver<'_, F>, light: &Light<F>, mut numbers: [F; 3]) -> F {
        let share = self.share(x, light.place);
        let rays = rays_of(share);
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
            .get(self.locate(point) * self.lights.len() + place);
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
fn on_triangle<F: Real>([a, b, c]: [Vector<F>; 3], [s, t]: [F; 2]) -> (Vector<F>, F) {
    let (s, t) = if s + t > one() {
        (one::<F>() - s, one::<F>() - t)
    } else {
        (s, t)
    };
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

impl<F: Real> SourceSampler for Radiosity<'_, F> {
    #[inline]
    fn sample_last_step<U: Uniforms<F>>(&self, x: &Point<F>, uniforms: &mut U) -> F {
        if x.face == SKY {
            return zero();
        }
        let direct = self.receiver(x).map(|on| self.sample_direct(&on, uniforms));
        self.reflectance(x) * direct.unwrap_or(F::NAN)
    }

    #[inline]
    fn rest_of_source(&self, x: &Point<F>) -> F {
        if x.face == SKY {
            return self.sky_emission(x);
        }
        let own = self.own_emission(x);
        if self.beams.is_empty() {
            return own;
        }
        let of_beams = self.receiver(x).map(|on| self.irradiance_of_beams(&on));
        own + self.reflectance(x) * of_beams.unwrap_or(F::NAN)
    }
}
