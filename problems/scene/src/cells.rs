//! Cells of faces, and polynomials on them.

use fredholm_core::Real;
use num_traits::{one, zero};

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
            (before + 1, [one::<F>() - s, one::<F>() - t])
        } else {
            (before, [s, t])
        }
    }

    /// The coordinates of the point of a cell, counted from its first, that has these coordinates there.
    pub(crate) fn within(&self, cell: u32, [s, t]: [F; 2]) -> [F; 2] {
        let [m, n] = self.intervals;
        let share = |i: u32, s: F, m: u32| (F::from_u32(i) + s) / F::from_u32(m);
        if self.triangle == 0 {
            return [share(cell / n, s, m), share(cell % n, t, n)];
        }
        let mut i = 0;
        while (i + 1) * (2 * m - i - 1) <= cell {
            i += 1;
        }
        let place = cell - i * (2 * m - i);
        let (s, t) = if place % 2 == 1 {
            (one::<F>() - s, one::<F>() - t)
        } else {
            (s, t)
        };
        [share(i, s, m), share(place / 2, t, m)]
    }

    /// The point with these coordinates.
    pub(crate) fn point(&self, [a, b]: [F; 2]) -> Vector<F> {
        along(along(self.origin, a, self.spans[0]), b, self.spans[1])
    }

    /// Whether a point with these coordinates is on the second patch of its face, if this is the first one.
    pub(crate) fn is_beyond(&self, [a, _]: [F; 2]) -> bool {
        a < zero()
    }

    /// The first B orthonormal polynomials at a point with these coordinates in a cell: by total degree, 1 of degree 0, 3 up
    /// to degree 1, 6 up to degree 2.
    #[inline]
    pub(crate) fn polynomials<const B: usize>(&self, [s, t]: [F; 2]) -> [F; B] {
        let number = F::from_f64;
        if self.triangle == 0 {
            return square_polynomials([s, t]);
        }
        // Of Gram and Schmidt, on the triangle (0, 0), (1, 0), (0, 1).
        let r = s + t + t - one();
        first([
            one(),
            number(core::f64::consts::SQRT_2) * (number(3.0) * s - one()),
            number(2.449_489_742_783_178) * r,
            number(1.732_050_807_568_877_2) * (s * (number(10.0) * s - number(8.0)) + one()),
            number(3.0) * (number(5.0) * s - one()) * r,
            number(3.872_983_346_207_417)
                * (s * (s + number(6.0) * t - number(2.0)) + number(6.0) * t * (t - one()) + one()),
        ])
    }
}

/// The first B of six values.
#[inline(always)]
fn first<F: Real, const B: usize>(values: [F; 6]) -> [F; B] {
    let mut all = [zero::<F>(); B];
    for (to, value) in all.iter_mut().zip(values) {
        *to = value;
    }
    all
}

/// The first B orthonormal polynomials on the unit square.
#[inline]
pub(crate) fn square_polynomials<F: Real, const B: usize>([s, t]: [F; 2]) -> [F; B] {
    let number = F::from_f64;
    let (s, t) = (s + s - one(), t + t - one());
    let linear = number(1.732_050_807_568_877_2);
    let square = |x: F| number(2.236_067_977_499_79) * (number(1.5) * x * x - number(0.5));
    first([
        one(),
        linear * s,
        linear * t,
        square(s),
        number(3.0) * s * t,
        square(t),
    ])
}
