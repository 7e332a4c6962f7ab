//! The neighbour equation of any v, with an exact source.

use fredholm_core::galerkin::Cells;
use fredholm_core::{Equation as _, Located, Neighbour, Real, Space, Uniforms, Value};
use fredholm_surfaces::{Tint, Wide};

use crate::rays::polynomials;
use crate::{Point, Room, RoomError};

/// The neighbour equation of a piecewise polynomial v with h = k and G = v − T_k v, exactly: by what a point sees of all cells. A score
/// takes time like their number; those of a [`RayNeighbour`](crate::RayNeighbour) take one ray.
#[derive(Debug)]
pub struct ExactNeighbour<'n, E, F, const B: usize> {
    equation: &'n E,
    v: &'n [F],
}

impl<'n, 'a, C: Tint<F>, F: Real, const B: usize> ExactNeighbour<'n, Room<'a, F, C>, F, B> {
    /// The neighbour equation of v, which has B numbers of every channel, cell by cell.
    ///
    /// # Errors
    /// [`RoomError::Length`].
    pub fn new(equation: &'n Room<'a, F, C>, v: &'n [F]) -> Result<Self, RoomError> {
        let cells = equation.partition().len();
        let (expected, found) = (cells * equation.channels() * B, v.len());
        if expected != found {
            return Err(RoomError::Length { expected, found });
        }
        Ok(Self { equation, v })
    }
}

impl<E, F: Real, const B: usize> Space for ExactNeighbour<'_, E, F, B> {
    type Scalar = F;
    type Point = Point<F>;
}

impl<C: Tint<F>, F: Real, const B: usize> Neighbour for ExactNeighbour<'_, Room<'_, F, C>, F, B> {
    type Value = C::Value;

    #[inline]
    fn locate(&self, x: Point<F>) -> Located<Point<F>> {
        let cell = self.equation.locate(&x);
        Located { point: x, cell }
    }

    /// h = k.
    #[inline]
    fn kernel(&self, _: &Located<Point<F>>, _: &Located<Point<F>>, k: &C::Value) -> C::Value {
        *k
    }

    fn is_pointwise(&self) -> bool {
        true
    }

    fn source(&self, x: &Located<Point<F>>, _: &mut dyn Uniforms<F>) -> C::Value {
        let seen: Wide<F, C> = self.equation.irradiance_of::<_, B>(&x.point, self.v);
        let seen = C::Value::from_fn(self.equation.channels(), |channel| {
            F::from_f64(seen.get(channel))
        });
        let reflectance = self.equation.kernel(&x.point, &x.point);
        self.value(x).minus(&reflectance.times(&seen))
    }

    #[inline]
    fn value(&self, x: &Located<Point<F>>) -> C::Value {
        polynomials::<C, F, B>(self.equation, self.v, x)
    }
}
