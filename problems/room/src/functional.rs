//! Means, and irradiance, as functionals of u.

use core::ops::Range;
use fredholm_core::array::Each;

use fredholm_core::galerkin::{Partition, legendre};
use fredholm_core::{Functional, Real, Uniforms};
use num_traits::{one, zero};

use crate::moments::{MOST, Sight};
use crate::panels::Panels;
use crate::vector::{Vector, cross, dot, sub};
use crate::{Point, Room, RoomError};

/// The mean of u over consecutive walls, weighted by length: those of a surface, or all. Walks
/// start uniformly on them, φ = 1.
#[derive(Clone, Copy, Debug)]
pub struct MeanOver<'r, 'a, F> {
    room: &'r Room<'a, F>,
    /// The lengths of all walls before each, and of all.
    lengths: &'a [f64],
    from: usize,
    to: usize,
}

impl<'r, 'a, F: Real> MeanOver<'r, 'a, F> {
    /// Over the walls `walls`. `lengths` are those of all walls before each, and of all, as
    /// `Tables::lengths` gives them.
    ///
    /// # Errors
    /// [`RoomError::Length`] where `lengths` has not one entry more than there are walls,
    /// [`RoomError::Wall`] where there are no such walls.
    pub fn new(
        room: &'r Room<'a, F>,
        lengths: &'a [f64],
        walls: Range<usize>,
    ) -> Result<Self, RoomError> {
        let count = room.geometry().walls().len();
        if lengths.len() != count + 1 {
            return Err(RoomError::Length {
                expected: count + 1,
                found: lengths.len(),
            });
        }
        if walls.start >= walls.end || walls.end > count {
            return Err(RoomError::Wall { wall: walls.start });
        }
        Ok(Self {
            room,
            lengths,
            from: walls.start,
            to: walls.end,
        })
    }

    /// (v, Φ), exact up to rounding: the mean of the piecewise constant v; of piecewise
    /// polynomials, where v has a multiple of n entries.
    #[must_use]
    pub fn of(&self, v: &[F]) -> f64 {
        let cells = self.room.table();
        let range = cells.range(self.from as u32).start..cells.range(self.to as u32 - 1).end;
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

impl<'a, F: Real> Functional<Room<'a, F>> for MeanOver<'_, 'a, F> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        let xi: F = uniforms.uniform();
        let at = |w: usize| self.lengths.get(w).copied().unwrap_or(f64::NAN);
        let (begin, end) = (at(self.from), at(self.to));
        let place = begin + xi.to_f64() * (end - begin);
        let own = self.lengths.get(self.from + 1..self.to).unwrap_or(&[]);
        let w = self.from + own.partition_point(|&sum| sum <= place);
        let fraction = ((place - at(w)) / (at(w + 1) - at(w))).clamp(0.0, 1.0);
        let point = self.room.point_at(w, F::from_f64(fraction));
        (point, one())
    }
}

/// The irradiance H(x) = ∫ V cos θ_x cos θ_y/(2|x − y|) u(y) dy as a functional of u: where `of`
/// starts, one step of the cosine law is made first, and the walk starts where it leads. So it has
/// no ρ to be divided by, and serves black walls too. Light that leaves an open room brings nothing
/// back.
///
/// u = F + ρH, and the net flux out of a wall is F − (1 − ρ)H.
#[derive(Clone, Copy, Debug)]
pub struct Irradiance<'r, 'a, F, T> {
    /// The room.
    pub room: &'r Room<'a, F>,
    /// The place: [`At`](fredholm_core::At) a point, or [`MeanOver`] walls.
    pub of: T,
}

impl<'a, F: Real, T: Functional<Room<'a, F>>> Functional<Room<'a, F>> for Irradiance<'_, 'a, F, T> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        let (x, phi) = self.of.start(uniforms);
        match self.room.scatter(&x, uniforms.uniform()) {
            Some(y) => (y, phi),
            None => (x, zero()),
        }
    }
}

/// The radiosity that a point between the walls sees in the mean over all directions, (1/2π) ∫ u dω: times π the
/// fluence there, for a picture of the light in a room. Walks start where a ray of uniform
/// direction leads, φ = 1; directions in which it leaves, or meets a wall from behind, bring
/// nothing.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'r, 'a, F> {
    /// The room.
    pub room: &'r Room<'a, F>,
    /// The point.
    pub position: [F; 2],
}

impl<F: Real> Seen<'_, '_, F> {
    /// Calls `each` with a cell and the angle under which the point sees it: exact, by visible
    /// intervals. A cell that is seen in several pieces comes several times. In a closed room the
    /// angles of a point sum to 2π, and to 0 for one that is in no room.
    ///
    /// O(w) visits of the hierarchy for w walls, and O(1) for every cell that is seen.
    pub fn cells(&self, mut each: impl FnMut(usize, F)) {
        self.pieces(|cell, right, left| each(cell, angle(right, left)));
    }

    /// Calls `each` with a cell and the directions between which it is seen, from right to left.
    fn pieces(&self, mut each: impl FnMut(usize, Vector<F>, Vector<F>)) {
        let (geometry, cells, x) = (self.room.geometry(), self.room.table(), self.position);
        for (w, wall) in (0..).zip(geometry.walls()) {
            geometry.seen_pieces(x, w, |right, left| {
                // Where the first direction meets the wall.
                let [a, b] = wall.ends.each(|end| cross(right, sub(end, x)).abs());
                let sum = a + b;
                let fraction = if sum > zero() { a / sum } else { zero() };
                let first = cells.find(w, fraction * wall.length);
                let skip = (first as usize).saturating_sub(cells.range(w).start) + 1;
                let ends = cells.of_wall(w).get(skip..).unwrap_or(&[]);
                let mut from = right;
                for (cell, end) in (first as usize..).zip(ends) {
                    let to = sub(end.position, x);
                    if !(cross(to, left) > zero()) {
                        each(cell, from, left);
                        break;
                    }
                    if cross(from, to) > zero() {
                        each(cell, from, to);
                        from = to;
                    }
                }
            });
        }
    }

    /// (v, Φ) and (1, Φ), exact up to rounding: Σ_j ∫ v dω/2π over the directions ω in which the
    /// point sees the cells, and the share of all directions in which it sees any. v is piecewise
    /// constant, or of piecewise polynomials where it has a multiple of n entries, at most 5 n.
    #[must_use]
    pub fn of(&self, v: &[F]) -> [f64; 2] {
        let functions = v.len() / self.room.table().len().max(1);
        let panels = Panels::new(functions);
        let [mut sum, mut share] = [0.0; 2];
        self.pieces(|cell, right, left| {
            let angle = angle(right, left).to_f64();
            share += angle;
            sum += match v.get(cell * functions..(cell + 1) * functions) {
                Some(&[constant]) => constant.to_f64() * angle,
                Some(own) if (2..=MOST).contains(&functions) => {
                    self.polynomial(&panels, cell, [right, left], own)
                }
                _ => f64::NAN,
            };
        });
        [sum, share].each(|x| x / core::f64::consts::TAU)
    }

    /// Writes the moments ∫ ψ_jb dω/2π over the directions ω in which the point sees cell j, of `functions` functions on
    /// every cell, at most 5: Σ_jb v_jb times them is (v, Φ), as in [`of`](Self::of). NaN if `out` has not as many entries as
    /// there are functions on all cells.
    pub fn moments(&self, functions: usize, out: &mut [f64]) {
        if !(1..=MOST).contains(&functions) || out.len() != functions * self.room.table().len() {
            out.fill(f64::NAN);
            return;
        }
        let panels = Panels::new(functions);
        out.fill(0.0);
        self.pieces(|cell, right, left| {
            let place = cell * functions;
            let own = out.get_mut(place..place + functions).unwrap_or_default();
            let mut add = |share: f64, psi: &[F]| {
                for (own, psi) in own.iter_mut().zip(psi) {
                    *own += share / core::f64::consts::TAU * psi.to_f64();
                }
            };
            if functions == 1 {
                add(angle(right, left).to_f64(), &[one()]);
            } else {
                self.places(&panels, cell, [right, left], |[d, ds, square], psi| {
                    add((d * ds / square).to_f64(), psi);
                });
            }
        });
    }

    /// Calls `each` with points of walls that the point sees, and weights that sum to the share of all directions in which
    /// it sees any: (1/2π) ∫ u dω by three Gauss points, in their order, in panels of directions that are `width` radians wide at most. Panels
    /// end where something else is seen, so that u is as smooth in them as along walls.
    pub fn points(&self, width: f64, mut each: impl FnMut(Point<F>, f64)) {
        let (geometry, x) = (self.room.geometry(), self.position);
        for (w, wall) in (0..).zip(geometry.walls()) {
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
                            self.room.at(w, wall, fraction),
                            weight * panel / core::f64::consts::TAU,
                        );
                    }
                    from = turned(from, next);
                }
            });
        }
    }

    /// Which share of the angle of every cell the point sees, of 0 to 1: the rest is hidden. For [`Seen::density`].
    #[cfg(feature = "alloc")]
    #[must_use]
    pub fn visible_shares(&self) -> alloc::vec::Vec<F> {
        let cells = self.room.table();
        let mut shares = alloc::vec![zero::<F>(); cells.len()];
        self.cells(|cell, angle| {
            if let Some(share) = shares.get_mut(cell) {
                *share += angle;
            }
        });
        for (cell, share) in shares.iter_mut().enumerate() {
            let Some(part) = cells.part(cell) else {
                continue;
            };
            let [from, to] = part.ends.each(|end| sub(end, self.position));
            let whole = angle(from, to).abs();
            *share = if *share > zero() {
                *share / whole
            } else {
                zero()
            };
        }
        shares
    }

    /// The density with which walks start in `y`, cos θ_y/(2π|x − y|) per length, times the share of the cell of y that
    /// the point sees: over cells it integrates to what the point sees of them, exactly.
    #[must_use]
    pub fn density(&self, y: &Point<F>, visible_shares: &[F]) -> F {
        let wall = self.room.geometry().wall(y.wall() as u32);
        let (Some(wall), Some(&share)) = (wall, visible_shares.get(self.room.locate(y))) else {
            return F::NAN;
        };
        let (span, height) = (sub(y.position(), self.position), wall.height(self.position));
        if !(share > zero() && height > zero()) {
            return zero();
        }
        share * height / (dot(span, span) * (F::PI + F::PI))
    }

    /// ∫ v dω of a polynomial on a cell, between two directions: dω = d ds/(s² + d²) at the place s
    /// along the wall from the foot of the perpendicular of length d.
    fn polynomial(
        &self,
        panels: &Panels<F>,
        cell: usize,
        directions: [Vector<F>; 2],
        v: &[F],
    ) -> f64 {
        let mut sum = 0.0;
        self.places(panels, cell, directions, |[d, ds, square], psi| {
            let products = v.iter().zip(psi).map(|(&v, &psi)| v * psi);
            let value = products.fold(zero::<F>(), |sum, x| sum + x);
            sum += (value * d * ds / square).to_f64();
        });
        sum
    }

    /// Calls `each` with d, ds and s² + d² of places of a cell between two directions, and with its functions there.
    fn places(
        &self,
        panels: &Panels<F>,
        cell: usize,
        directions: [Vector<F>; 2],
        mut each: impl FnMut([F; 3], &[F; MOST]),
    ) {
        let part = self.room.table().part(cell);
        let wall = part.and_then(|part| self.room.geometry().wall(part.wall));
        let (Some(part), Some(wall)) = (part, wall) else {
            return each([F::NAN; 3], &[F::NAN; MOST]);
        };
        let sight = Sight::new([zero(); 2], self.position, &part, wall);
        let (ends, d) = (directions.each(|a| sight.meets(a, wall)), sight.distance());
        panels.points(ends, d, |s, ds| {
            let [before, behind] = sight.fractions(s);
            each([d, ds, s * s + d * d], &legendre(before - behind));
        });
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

impl<'a, F: Real> Functional<Room<'a, F>> for Seen<'_, 'a, F> {
    #[inline]
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        let xi: F = uniforms.uniform();
        let angle = (xi + xi) * F::PI;
        match self.room.look(self.position, [angle.cos(), angle.sin()]) {
            Some(y) => (y, one()),
            // Some point, and nothing of it.
            None => (self.room.point_at(0, zero()), zero()),
        }
    }
}

impl<'a, F: Real> Room<'a, F> {
    /// (v, Φ) of the irradiance at a point: Σ_j v_j times the form factor from x to cell j, v
    /// piecewise constant; for piecewise polynomials see
    /// [`PolynomialRoom`](crate::PolynomialRoom::irradiance_of).
    #[must_use]
    pub fn irradiance_of(&self, x: &Point<F>, v: &[F]) -> f64 {
        let terms = v.iter().enumerate();
        let terms = terms.map(|(j, v)| v.to_f64() * self.form_factor(x, j).to_f64());
        terms.sum()
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use super::Seen;
    use crate::{
        Enclosure, Grading, Material, Mesh, Room, Scene, Surface, Tables, VisibilityTable,
    };

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
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(geometry, cells, VisibilityTable::none(), 0.5).unwrap();
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
