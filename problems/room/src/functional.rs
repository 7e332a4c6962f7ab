//! Means, and irradiance, as functionals of u.

use core::ops::Range;

use fredholm_core::array::Each;
use fredholm_core::galerkin::{Cells, legendre};
use fredholm_core::{Equation, Functional, Real, Start, StartOf, Uniforms, Value as _};
use fredholm_surfaces::Grey;
use num_traits::{one, zero};

use crate::moments::{MOST, Sight};
use crate::vector::{Vector, cross, dot, sub};
use crate::{Point, Room, RoomError};

/// The mean of u over consecutive walls, weighted by length: those of a surface, or all. Walks
/// start uniformly on them, φ = 1.
#[derive(Clone, Debug)]
pub struct MeanOver<'r, 'a, F, C = Grey> {
    room: &'r Room<'a, F, C>,
    walls: Range<usize>,
}

impl<'r, 'a, F: Real, C> MeanOver<'r, 'a, F, C> {
    /// Over the walls `walls`.
    ///
    /// # Errors
    /// [`RoomError::Wall`] where there are no such walls.
    pub fn new(room: &'r Room<'a, F, C>, walls: Range<usize>) -> Result<Self, RoomError> {
        if walls.is_empty() || walls.end > room.geometry().walls().len() {
            return Err(RoomError::Wall { wall: walls.start });
        }
        Ok(Self { room, walls })
    }

    /// Over all walls of a room.
    #[must_use]
    pub fn everything(room: &'r Room<'a, F, C>) -> Self {
        let walls = 0..room.geometry().walls().len();
        Self { room, walls }
    }

    /// (v, Φ), exact up to rounding: the mean of the piecewise constant v; of piecewise
    /// polynomials, where v has a multiple of n entries.
    #[must_use]
    pub fn of(&self, v: &[F]) -> f64 {
        let cells = self.room.partition();
        let [first, last] = [self.walls.start, self.walls.end - 1].map(|w| cells.range(w as u32));
        let range = first.start..last.end;
        let (mut sum, mut length) = (0.0, 0.0);
        // All functions but the first have the mean 0.
        let functions = (v.len() / cells.len().max(1)).max(1);
        let own = v.get(range.start * functions..range.end * functions);
        for (cell, v) in range.zip(own.unwrap_or(&[]).iter().step_by(functions)) {
            let own = cells.length(cell).to_f64();
            sum += own * v.to_f64();
            length += own;
        }
        sum / length
    }
}

impl<F, C, E> Functional<E> for MeanOver<'_, '_, F, C>
where
    F: Real,
    E: Equation<Scalar = F, Point = Point<F>> + ?Sized,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        let x = self.room.uniform_on(&self.walls, uniforms.uniform());
        Start::of(equation, x, one())
    }
}

/// The irradiance H(x) = ∫ V cos θ_x cos θ_y/(2|x − y|) u(y) dy as a functional of u: where another
/// one starts, [`At`](fredholm_core::At) a point or [`MeanOver`] walls, one step of the cosine law is made first, and the walk
/// starts where it leads. So it has no ρ to be divided by, and serves black walls too. Light that leaves an open room brings nothing
/// back; what comes from outside is known where the walk starts.
///
/// u = F + ρH, and the net flux out of a wall is F − (1 − ρ)H.
#[derive(Clone, Copy, Debug)]
pub struct Irradiance<'r, 'a, F, T, C = Grey> {
    /// The room.
    pub room: &'r Room<'a, F, C>,
    /// Where: a functional of u.
    pub of: T,
}

impl<F, T, C, E> Functional<E> for Irradiance<'_, '_, F, T, C>
where
    F: Real,
    T: Functional<E>,
    E: Equation<Scalar = F, Point = Point<F>> + ?Sized,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        let Start { point, phi, .. } = self.of.start(equation, uniforms);
        let start = match equation.step(&point, uniforms) {
            Some(y) => Start::of(equation, y, phi),
            None => Start::of(equation, point, zero()),
        };
        if self.room.outside.is_empty() {
            return start;
        }
        let known = E::Value::splat(equation.channels(), phi * self.room.from_outside(&point));
        Start { known, ..start }
    }
}

/// The radiosity that a point between the walls sees in the mean over all directions, (1/2π) ∫ u dω: times π the
/// fluence there, for a picture of the light in a room. Walks start where a ray of uniform
/// direction leads, φ = 1; directions in which it leaves, or meets a wall from behind, bring
/// nothing.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'r, 'a, F, C = Grey> {
    /// The room.
    pub room: &'r Room<'a, F, C>,
    /// The point.
    pub position: [F; 2],
}

impl<F: Real, C> Seen<'_, '_, F, C> {
    /// Calls `each` with a cell and the angle under which the point sees it: exact, by visible
    /// intervals. A cell that is seen in several pieces comes several times. In a closed room the
    /// angles of a point sum to 2π, and to 0 for one that is in no room.
    ///
    /// O(w) visits of the hierarchy for w walls, and O(1) for every cell that is seen.
    pub fn cells(&self, mut each: impl FnMut(usize, F)) {
        self.pieces(|_, cell, right, left| each(cell, angle(right, left)));
    }

    /// Calls `each` with a wall or a copy, a cell there, and the directions between which it is seen, from right to left.
    fn pieces(&self, mut each: impl FnMut(u32, usize, Vector<F>, Vector<F>)) {
        let (geometry, x) = (self.room.geometry(), self.position);
        for w in 0..geometry.all().len() as u32 {
            geometry.seen_pieces(x, w, |right, left| {
                self.room
                    .cells_between(x, w, [right, left], |cell, [from, to], _| {
                        each(w, cell, from, to);
                    });
            });
        }
    }

    /// What the point sees of the sky in the mean over all directions, (1/2π) ∫ L dω, exact: of that walks know nothing.
    #[must_use]
    pub fn sky(&self) -> F {
        self.room.sky_around(self.position)
    }

    /// (v, Φ) and (1, Φ), exact up to rounding: Σ_j ∫ v dω/2π over the directions ω in which the
    /// point sees the cells, and the share of all directions in which it sees any. v is piecewise
    /// constant, or of piecewise polynomials where it has a multiple of n entries, at most 5 n.
    #[must_use]
    pub fn of(&self, v: &[F]) -> [f64; 2] {
        let functions = v.len() / self.room.cells().max(1);
        let mut sum = 0.0;
        let share = self.integrate(functions, |cell, share, psi| {
            let own = v.get(cell * functions..).unwrap_or(&[]);
            let terms = own
                .iter()
                .zip(psi)
                .map(|(v, psi)| v.to_f64() * psi.to_f64());
            sum += share * terms.sum::<f64>();
        });
        [sum, share]
    }

    /// Writes the moments ∫ ψ_jb dω/2π over the directions ω in which the point sees cell j, of `functions` functions on
    /// every cell, at most 5: Σ_jb v_jb times them is (v, Φ), as in [`of`](Self::of). NaN if `out` has not as many entries as
    /// there are functions on all cells.
    pub fn moments(&self, functions: usize, out: &mut [f64]) {
        if !(1..=MOST).contains(&functions) || out.len() != functions * self.room.cells() {
            out.fill(f64::NAN);
            return;
        }
        out.fill(0.0);
        self.integrate(functions, |cell, share, psi| {
            let own = out.get_mut(cell * functions..).unwrap_or_default();
            for (own, psi) in own.iter_mut().zip(psi) {
                *own += share * psi.to_f64();
            }
        });
    }

    /// Calls `each` with cells, shares of all directions in which a place of them is seen, and their functions there. Returns the
    /// share of all directions in which any is seen.
    fn integrate(&self, functions: usize, mut each: impl FnMut(usize, f64, &[F])) -> f64 {
        let panels = self.room.panels(functions);
        let mut all = 0.0;
        self.pieces(|w, cell, right, left| {
            let angle = angle(right, left).to_f64() / core::f64::consts::TAU;
            all += angle;
            if functions == 1 {
                return each(cell, angle, &[one()]);
            }
            let part = self.room.part_on(cell, w);
            let wall = part.and_then(|part| self.room.geometry().wall(part.wall));
            let (Some(part), Some(wall), 2..=MOST) = (part, wall, functions) else {
                return each(cell, f64::NAN, &[one()]);
            };
            let sight = Sight::new([zero(); 2], self.position, &part, wall);
            let ends = [right, left].each(|a| sight.meets(a, wall));
            let d = sight.distance();
            // dω = d ds/(s² + d²) at the place s along the wall from the foot of the perpendicular of length d.
            panels.points(ends, d, |s, ds| {
                let [before, behind] = sight.fractions(s);
                let psi: [F; MOST] = legendre(before - behind);
                let share = (d * ds / (s * s + d * d)).to_f64() / core::f64::consts::TAU;
                each(cell, share, psi.get(..functions).unwrap_or(&[]));
            });
        });
        all
    }

    /// Calls `each` with points of walls that the point sees, and weights that sum to the share of all directions in which
    /// it sees any: (1/2π) ∫ u dω by three Gauss points, in their order, in panels of directions that are `width` radians wide at most. Panels
    /// end where something else is seen, so that u is as smooth in them as along walls.
    pub fn points(&self, width: f64, mut each: impl FnMut(Point<F>, f64)) {
        let (geometry, x) = (self.room.geometry(), self.position);
        for (w, wall) in (0..).zip(geometry.all()) {
            geometry.seen_pieces(x, w, |right, left| {
                let whole = angle(right, left).to_f64();
                // One at least, and of a width that is none no more than this.
                let panels = (whole / width).clamp(0.0, 1e4) as u32 + 1;
                let panel = whole / f64::from(panels);
                let turn =
                    |angle: f64| [F::from_f64(Real::cos(angle)), F::from_f64(Real::sin(angle))];
                let turned =
                    |d: Vector<F>, [c, s]: [F; 2]| [c * d[0] - s * d[1], s * d[0] + c * d[1]];
                let nodes = GAUSS.each(|(t, _)| turn(t * panel));
                let next = turn(panel);
                let mut from = right;
                for _ in 0..panels {
                    for (node, (_, weight)) in nodes.iter().zip(GAUSS) {
                        let direction = turned(from, *node);
                        let [a, b] = wall.ends.each(|end| cross(direction, sub(end, x)).abs());
                        let fraction = a / (a + b);
                        each(
                            self.room.point_of(w, wall, fraction),
                            weight * panel / core::f64::consts::TAU,
                        );
                    }
                    from = turned(from, next);
                }
            });
        }
    }
}

/// Three Gauss points of the unit interval, and weights that sum to 1.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// The angle from `a` to `b`, to the left and below π.
#[inline]
fn angle<F: Real>(a: [F; 2], b: [F; 2]) -> F {
    let (sine, cosine) = (cross(a, b), dot(a, b));
    let t = sine / cosine;
    // Most cells are seen under small angles, where three terms have all digits.
    if cosine > zero() && t < F::from_f64(1.0 / 256.0) {
        let s = t * t;
        let [c3, c5] = [1.0 / 3.0, 1.0 / 5.0].each(F::from_f64);
        t * (one::<F>() - s * (c3 - s * c5))
    } else {
        sine.atan2(cosine)
    }
}

impl<F, C, E> Functional<E> for Seen<'_, '_, F, C>
where
    F: Real,
    E: Equation<Scalar = F, Point = Point<F>> + ?Sized,
{
    #[inline]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        let xi: F = uniforms.uniform();
        let angle = (xi + xi) * F::PI;
        match self.room.look(self.position, [angle.cos(), angle.sin()]) {
            Some(y) => Start::of(equation, y, one()),
            // Some point, and nothing of it.
            None => Start::of(equation, self.room.point(0, &[0.0]), zero()),
        }
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use super::Seen;
    use crate::{Enclosure, Grading, Material, Mesh, Scene, Surface, Tables};

    /// What a point sees, in three ways: of polynomials on cells at once and by their moments, exactly, and of any function
    /// by points, whose panels of directions make hardly a difference once they are narrow.
    #[test]
    fn what_is_seen_is_the_same_in_all_ways() {
        let wall = [Material {
            reflectance: 0.5,
            emission: 0.0,
        }];
        let outer = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let inner = [[0.9, 0.4], [0.9, 0.6], [1.1, 0.6], [1.1, 0.4], [0.9, 0.4]];
        let surface = |points| Surface {
            points,
            materials: &wall,
        };
        let surfaces = [surface(&outer[..]), surface(&inner[..])];
        let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed).unwrap();
        let mesh = Mesh::new::<f64>(&scene, 40, Grading::default()).unwrap();
        let tables = Tables::<f64>::new(&scene, &mesh);
        let room = tables.room();
        for position in [[0.3, 0.2], [1.0, 0.3], [1.95, 0.97]] {
            let seen = Seen {
                room: &room,
                position,
            };
            for functions in 1..=5 {
                let count = functions * mesh.len();
                let v: alloc::vec::Vec<f64> = (0..count).map(|i| f64::from(i as u32 % 7)).collect();
                let mut moments = alloc::vec![0.0; count];
                seen.moments(functions, &mut moments);
                let sum: f64 = moments.iter().zip(&v).map(|(m, v)| m * v).sum();
                assert!((sum - seen.of(&v)[0]).abs() < 1e-13 * sum, "{position:?}");
            }
            let by_points = |width: f64| {
                let (mut share, mut sum) = (0.0, 0.0);
                seen.points(width, |y, weight| {
                    let [y0, y1] = y.position();
                    share += weight;
                    sum += weight * (1.0 + y0 * y0 - y1);
                });
                assert!((share - 1.0).abs() < 1e-13, "{position:?} {share}");
                sum
            };
            // Along a wall that is seen at a grazing angle the integrand has a pole beyond the end of the last panel, no
            // farther than that is wide: 2·10⁻⁵ of the value are left there. Wrong weights leave ten times as much.
            let [wide, narrow] = [by_points(0.15), by_points(0.015)];
            assert!(
                (wide - narrow).abs() < 5e-5 * wide,
                "{position:?} {wide} {narrow}"
            );
        }
        let seen = Seen {
            room: &room,
            position: [0.3, 0.2],
        };
        let mut short = [0.0; 3];
        seen.moments(2, &mut short);
        assert!(short[0].is_nan());
    }
}
