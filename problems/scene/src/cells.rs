//! Cells of faces, and polynomials on them.

use fredholm_core::Real;
use num_traits::{one, zero};

use crate::SceneError;
use crate::beam::Beam;
use crate::skylight::SkyBand;
use crate::vector::{Vector, along, dot, sub};

/// A part of a face that is an affine image of the unit square or of the triangle (0, 0), (1, 0), (0, 1), with its cells:
/// a parallelogram or triangle is one patch, any other quadrilateral two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct FacePatch<F> {
    /// The image of (0, 0).
    pub origin: [F; 3],
    /// The vectors to the images of (1, 0) and (0, 1).
    pub spans: [[F; 3]; 2],
    /// The vectors whose products with x − origin are the coordinates of x.
    pub duals: [[F; 3]; 2],
    /// Intervals along both spans. Of a triangle both are m, and it has m² cells.
    pub intervals: [u32; 2],
    /// The number of its first cell.
    pub first: u32,
    /// Whether it is a triangle: 0 or 1.
    pub triangle: u32,
}

/// What a face has besides its polygon: a frame for directions, and its patches.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Side<F> {
    /// Two unit vectors, perpendicular to each other and to the normal.
    pub tangents: [[F; 3]; 2],
    /// The number of its first patch.
    pub patch: u32,
    /// The number of its patches, 1 or 2.
    pub patches: u32,
    /// The emission that walks score where they meet the face: of a light 0, as the last step leads to it.
    pub emission: F,
}

/// The cells of a scene and its light, borrowed from [`Cells`](crate::Cells) or from the tables of a device.
#[derive(Clone, Copy, Debug)]
pub struct CellTables<'a, F> {
    /// A frame and the emission that walks meet, one of every face.
    pub sides: &'a [Side<F>],
    /// The cells of faces.
    pub patches: &'a [FacePatch<F>],
    /// The numbers of the faces to which the last step leads.
    pub lights: &'a [u32],
    /// Light that no surface emits; directions have the length 1.
    pub beams: &'a [Beam<F>],
    /// The bands of the sky: with them, rays that leave upwards end in the sky, of which every patch is one cell more, behind
    /// those of faces.
    pub sky_bands: &'a [SkyBand<F>],
    /// L of every patch of the sky.
    pub sky_emissions: &'a [F],
}

impl<F> CellTables<'_, F> {
    /// The number of cells of faces, if all numbers lead somewhere in a geometry with so many faces.
    pub(crate) fn check(&self, faces: usize) -> Result<u32, SceneError> {
        let mut cells = 0_u32;
        let patches_follow = self.patches.iter().all(|patch| {
            let first = cells;
            let [m, n] = patch.intervals;
            let next = m.checked_mul(n).and_then(|own| cells.checked_add(own));
            cells = next.unwrap_or(0);
            next.is_some()
                && patch.first == first
                && m > 0
                && n > 0
                && (patch.triangle == 0 || (patch.triangle == 1 && m == n))
        });
        let sides_lead = self.sides.iter().all(|side| {
            let last = side.patch.checked_add(side.patches);
            matches!(side.patches, 1 | 2)
                && last.is_some_and(|last| last as usize <= self.patches.len())
        });
        let lights_lead = self.lights.iter().all(|&light| (light as usize) < faces);
        let mut patches = 0_u32;
        let bands_follow = self.sky_bands.iter().all(|band| {
            let first = patches;
            patches = first.saturating_add(band.sectors);
            band.first == first && band.sectors > 0
        });
        let is_sky = bands_follow && self.sky_emissions.len() == patches as usize;
        if patches_follow && sides_lead && lights_lead && is_sky && self.sides.len() == faces {
            Ok(cells)
        } else {
            Err(SceneError::Tables)
        }
    }
}

impl<F: Real> FacePatch<F> {
    /// The coordinates of a point of its plane.
    #[inline]
    pub(crate) fn coordinates(&self, point: Vector<F>) -> [F; 2] {
        let to = sub(point, self.origin);
        [dot(self.duals[0], to), dot(self.duals[1], to)]
    }

    /// The number of its cells.
    pub(crate) const fn cells(&self) -> u32 {
        // m² of a triangle.
        self.intervals[0] * self.intervals[1]
    }

    /// The cell in which a point with these coordinates lies, counted from its first, and the point's coordinates there.
    #[inline]
    pub(crate) fn cell(&self, [a, b]: [F; 2]) -> (u32, [F; 2]) {
        let [m, n] = self.intervals;
        let (p, q) = (a * F::from_u32(m), b * F::from_u32(n));
        if self.triangle == 0 {
            let (i, j) = (p.to_u32().min(m - 1), q.to_u32().min(n - 1));
            return (i * n + j, [p - F::from_u32(i), q - F::from_u32(j)]);
        }
        let i = p.to_u32().min(m - 1);
        let j = q.to_u32().min(m - 1 - i);
        let (s, t) = (p - F::from_u32(i), q - F::from_u32(j));
        let before = i * (2 * m - i) + 2 * j;
        // The last of a row has no neighbour that stands on its head.
        if s + t > one() && i + j + 1 < m {
            (before + 1, turned([s, t]))
        } else {
            (before, [s, t])
        }
    }

    /// The square of a cell, counted from its first, and whether it is the half of it that stands on its head.
    fn square(&self, cell: u32) -> ([F; 2], bool) {
        let [m, n] = self.intervals;
        if self.triangle == 0 {
            return ([cell / n, cell % n].map(F::from_u32), false);
        }
        let mut i = 0;
        while (i + 1) * (2 * m - i - 1) <= cell {
            i += 1;
        }
        let place = cell - i * (2 * m - i);
        ([i, place / 2].map(F::from_u32), place % 2 == 1)
    }

    /// The coordinates of the point of a cell, counted from its first, that has these coordinates there.
    pub(crate) fn within(&self, cell: u32, [s, t]: [F; 2]) -> [F; 2] {
        let ([i, j], is_turned) = self.square(cell);
        let [m, n] = self.intervals.map(F::from_u32);
        let [s, t] = if is_turned { turned([s, t]) } else { [s, t] };
        [(i + s) / m, (j + t) / n]
    }

    /// The coordinates in a cell, counted from its first, of the point with these coordinates.
    pub(crate) fn parameters(&self, cell: u32, [a, b]: [F; 2]) -> [F; 2] {
        let ([i, j], is_turned) = self.square(cell);
        let [m, n] = self.intervals.map(F::from_u32);
        let place = [a * m - i, b * n - j];
        let [s, t] = if is_turned { turned(place) } else { place };
        // Beyond the diagonal, as rounding may lead, the square is folded.
        let is_beyond = self.triangle == 1 && s + t > one();
        [s, if is_beyond { one::<F>() - s } else { t }]
    }

    /// The point with these coordinates.
    pub(crate) fn point(&self, [a, b]: [F; 2]) -> Vector<F> {
        along(along(self.origin, a, self.spans[0]), b, self.spans[1])
    }

    /// Whether a point with these coordinates is on the second patch of its face, if this is the first one.
    pub(crate) fn is_beyond(&self, [a, _]: [F; 2]) -> bool {
        a < zero()
    }
}

/// The point of a square opposite to one.
#[inline(always)]
fn turned<F: Real>([s, t]: [F; 2]) -> [F; 2] {
    [one::<F>() - s, one::<F>() - t]
}

/// A point of the unit square, or the one opposite to it: uniform on the triangle (0, 0), (1, 0), (0, 1) if it was on the square.
#[inline(always)]
pub(crate) fn folded<F: Real>([s, t]: [F; 2]) -> [F; 2] {
    if s + t > one() {
        turned([s, t])
    } else {
        [s, t]
    }
}

/// The first B orthonormal polynomials at a point of the unit square or of the triangle (0, 0), (1, 0), (0, 1), by total degree: 1
/// of degree 0, 3 up to degree 1, 6 up to degree 2.
#[inline]
pub(crate) fn polynomials<F: Real, const B: usize>([s, t]: [F; 2], is_triangle: bool) -> [F; B] {
    let number = F::from_f64;
    let values = if is_triangle {
        // Of Gram and Schmidt.
        let r = s + t + t - one();
        [
            one(),
            number(core::f64::consts::SQRT_2) * (number(3.0) * s - one()),
            number(2.449_489_742_783_178) * r,
            number(1.732_050_807_568_877_2) * (s * (number(10.0) * s - number(8.0)) + one()),
            number(3.0) * (number(5.0) * s - one()) * r,
            number(3.872_983_346_207_417)
                * (s * (s + number(6.0) * t - number(2.0)) + number(6.0) * t * (t - one()) + one()),
        ]
    } else {
        let (s, t) = (s + s - one(), t + t - one());
        let linear = number(1.732_050_807_568_877_2);
        let square = |x: F| number(2.236_067_977_499_79) * (number(1.5) * x * x - number(0.5));
        [
            one(),
            linear * s,
            linear * t,
            square(s),
            number(3.0) * s * t,
            square(t),
        ]
    };
    let mut first = [zero::<F>(); B];
    for (to, value) in first.iter_mut().zip(values) {
        *to = value;
    }
    first
}
