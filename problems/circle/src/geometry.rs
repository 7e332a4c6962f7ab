//! What follows from the tables: points, sines, and integrals over cells.

use fredholm_core::galerkin::legendre;
use fredholm_core::{Located, Real, Value};

use crate::tables::{Tables, pseudo_angle};
use crate::{Cell, Point};

/// ψ_b(x), and ∫ ¼ |sin((t − s)/2)| ψ_b(t) dt over the cell of x, for all b < B.
pub(crate) struct Local<F, const B: usize> {
    pub(crate) psi: [F; B],
    pub(crate) integrals: [F; B],
}

pub(crate) trait Geometry: Tables {
    /// The point whose half angle has this cosine and this sine, of length 1 up to rounding.
    #[inline]
    fn point_at(&self, cos: Self::Scalar, sin: Self::Scalar) -> Point<Self::Scalar> {
        // e^{is} has two half angles; the one with sin ≥ 0 is kept. A Newton step towards length 1
        // keeps rounding errors from adding up over a walk.
        let half = Self::Scalar::from_f64(0.5);
        let length = Self::Scalar::from_f64(1.5) - half * (cos * cos + sin * sin);
        let scale = length.copysign(sin);
        let (cos, sin) = (cos * scale, sin * scale);
        Point::new(cos, sin, self.locate(cos, sin) as usize)
    }

    /// The cell of the half angle with this cosine and (non-negative) sine.
    #[inline]
    fn locate(&self, cos: Self::Scalar, sin: Self::Scalar) -> u32 {
        let (angle, slots) = (pseudo_angle(cos, sin), self.slots());
        let number = (angle * Self::Scalar::from_u32(slots.len() as u32)).to_u32();
        // Half angle π, which is half angle 0, is the end of the last cell and belongs to it.
        let Some(slot) = slots.get(number as usize) else {
            return self.cells().len() as u32 - 1;
        };
        // An addition and no branch: half of all branches would be predicted wrong.
        slot.cell + u32::from(angle >= slot.end)
    }

    #[inline]
    fn cell(&self, i: usize) -> Option<&Cell<Self::Scalar, Self::Value>> {
        self.cells().get(i)
    }

    /// ρ of a cell.
    #[inline]
    fn reflectance(&self, i: usize) -> Self::Value {
        let nan = || Self::Value::splat(1, Self::Scalar::NAN);
        self.cell(i).map_or_else(nan, |cell| cell.reflectance)
    }

    /// |sin((m_j − s)/2)|, to a few rounding errors however small it is.
    #[inline]
    fn sine(&self, x: &Point<Self::Scalar>, j: usize) -> Self::Scalar {
        self.cell(j)
            .map_or(Self::Scalar::NAN, |cell| cell.middle.sine(x.half_angle()))
    }

    /// ± cos((m_j − s)/2), + where cell `j` is behind that of `x`.
    #[inline]
    fn signed_cosine(&self, x: &Located<Point<Self::Scalar>>, j: usize) -> Self::Scalar {
        let half = x.point.half_angle();
        let cosine = self.cell(j).map(|cell| cell.middle.cosine(half));
        let cosine = cosine.unwrap_or(Self::Scalar::NAN);
        if j > x.cell { cosine } else { -cosine }
    }

    /// The coordinate τ ∈ [−1, 1] of a point in its cell.
    #[inline]
    fn coordinate(&self, x: &Located<Point<Self::Scalar>>) -> Self::Scalar {
        let Some(cell) = self.cell(x.cell) else {
            return Self::Scalar::NAN;
        };
        let (constants, half) = (self.constants(), x.point.half_angle());
        let sine = -cell.middle.small_sine(half);
        if constants.arcsine_terms == 0 {
            return sine.atan2(cell.middle.cosine(half)) / constants.quarter;
        }
        let square = sine * sine;
        let terms = constants
            .arcsine
            .iter()
            .take(constants.arcsine_terms as usize);
        let sum = |sum, &c| sum * square + c;
        sine * terms.rev().fold(Self::Scalar::default(), sum)
    }

    /// The form factor from a point to its own cell, by sin B with B = (m_j − s)/2: 1 − cos A cos B, as
    /// (1 − cos A) + cos A (1 − cos B), where 1 − cos B = sin² B/(1 + cos B).
    #[inline]
    fn own_mass(&self, sine: Self::Scalar) -> Self::Scalar {
        let constants = self.constants();
        let (square, one) = (sine * sine, Self::Scalar::from_u32(1));
        let cosine = (one - square).max(Self::Scalar::default()).sqrt();
        constants.versine + constants.cosine * (square / (one + cosine))
    }

    /// The functions at a point, and their integrals over its cell.
    #[inline]
    fn local<const B: usize>(&self, x: &Located<Point<Self::Scalar>>) -> Local<Self::Scalar, B> {
        if const { B == 1 } {
            return Local {
                psi: [Self::Scalar::from_u32(1); B],
                integrals: [self.own_mass(self.sine(&x.point, x.cell)); B],
            };
        }
        let tau = self.coordinate(x);
        Local {
            psi: legendre(tau),
            integrals: self.constants().own_integrals(tau),
        }
    }
}

impl<T: Tables + ?Sized> Geometry for T {}
