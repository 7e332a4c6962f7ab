//! The partition of the circle into equal cells, with what a walk looks up about them.

#[cfg(feature = "alloc")]
use alloc::vec::Vec;

use fredholm_core::{Real, Value};

use crate::double::{Double, rotate};
use crate::{CircleError, Constants};

/// cos and sin of an angle, each as a number and its rounding error, so that the sine of the angle
/// between two nearly parallel directions keeps its digits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Direction<F> {
    /// The cosine.
    pub cos: F,
    /// The sine.
    pub sin: F,
    /// The rounding error of the cosine.
    pub cos_low: F,
    /// The rounding error of the sine.
    pub sin_low: F,
}

// Another direction is taken as its cosine and sine, which stay in registers.
impl<F: Real> Direction<F> {
    /// sin of the angle from another direction to this one, with an absolute error of ε.
    #[inline]
    pub(crate) fn rough_sine(&self, (cos, sin): (F, F)) -> F {
        self.sin * cos - self.cos * sin
    }

    /// |sin| of the angle between two directions, with a relative error of about 4 ε.
    ///
    /// The plain cross product has an absolute error of ε, which is a relative one of 4 ε while the
    /// sine is above ¼. Below, one pair of 30 on a fine partition, products and tables are taken
    /// to twice the precision.
    #[inline]
    pub(crate) fn sine(&self, other: (F, F)) -> F {
        let sine = self.rough_sine(other).abs();
        if sine >= F::from_f64(0.25) {
            return sine;
        }
        rarely();
        self.small_sine(other).abs()
    }

    /// sin of the angle from another direction to this one, with a relative error of about 4 ε however
    /// small it is.
    #[inline]
    pub(crate) fn small_sine(&self, (cos, sin): (F, F)) -> F {
        let (left, right) = (self.sin * cos, self.cos * sin);
        let (left_low, right_low) = (self.sin.product_error(cos), self.cos.product_error(sin));
        let low = self.sin_low * cos - self.cos_low * sin;
        (left - right) + ((left_low - right_low) + low)
    }

    /// cos of the angle between two directions, with an absolute error of ε.
    #[inline]
    pub(crate) fn cosine(&self, (cos, sin): (F, F)) -> F {
        self.cos * cos + self.sin * sin
    }

    /// The direction a quarter turn on.
    #[inline]
    pub(crate) fn turned(&self) -> Self {
        Self {
            cos: -self.sin,
            sin: self.cos,
            cos_low: -self.sin_low,
            sin_low: self.cos_low,
        }
    }
}

/// Tells the compiler that the code around the call is seldom reached. A call of the code itself,
/// out of line, would make the common path save its registers.
#[cold]
fn rarely() {}

/// The data of a cell that a walk looks up. Values have one number for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Cell<F, V = F> {
    /// The half angle of the cell's middle.
    pub middle: Direction<F>,
    /// ρ.
    pub reflectance: V,
}

/// One of equal parts of the pseudo-angle: the first cell that ends behind the beginning of the
/// part, and where that is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Slot<F> {
    /// The pseudo-angle at which the cell ends.
    pub end: F,
    /// The number of the cell.
    pub cell: u32,
}

/// The number of slots for `cells` cells.
#[must_use]
pub const fn slots(cells: usize) -> usize {
    // The derivative of the pseudo-angle is at least ¼, so a cell is at least π/4n of it wide, more
    // than a slot's 1/2n: at most one cell ends within a slot.
    2 * cells
}

/// The tables of a circle: n equal cells of [0, 2π), on which the reflectance is constant, and what finds the cell of a point.
///
/// [`BorrowedTables`] lie in the caller's buffers: in flash, on a stack or on a heap. `OwnedTables`, with the feature `alloc`, own
/// them.
pub trait Tables {
    /// The scalar.
    type Scalar: Real;
    /// The value of a reflectance: the scalar, or [`Channels`](fredholm_core::Channels).
    type Value: Value<Self::Scalar>;

    /// The cells.
    fn cells(&self) -> &[Cell<Self::Scalar, Self::Value>];

    /// The slots: [`slots`]`(n)` of them.
    fn slots(&self) -> &[Slot<Self::Scalar>];

    /// The constants of n cells.
    fn constants(&self) -> &Constants<Self::Scalar>;
}

impl<T: Tables + ?Sized> Tables for &T {
    type Scalar = T::Scalar;
    type Value = T::Value;

    #[inline(always)]
    fn cells(&self) -> &[Cell<T::Scalar, T::Value>] {
        (**self).cells()
    }
    #[inline(always)]
    fn slots(&self) -> &[Slot<T::Scalar>] {
        (**self).slots()
    }
    #[inline(always)]
    fn constants(&self) -> &Constants<T::Scalar> {
        (**self).constants()
    }
}

/// Tables in buffers of the caller.
#[derive(Clone, Copy, Debug)]
pub struct BorrowedTables<'a, F, V = F> {
    cells: &'a [Cell<F, V>],
    slots: &'a [Slot<F>],
    constants: &'a Constants<F>,
}

impl<'a, F: Real, V: Value<F>> BorrowedTables<'a, F, V> {
    /// Fills the buffers: as many cells as `cells` has entries, `reflectance` on equal arcs of
    /// [0, 2π), and [`slots`]`(cells.len())` slots.
    ///
    /// # Errors
    /// [`CircleError`] where a reflectance is outside [0, 1), the number of cells is no multiple of
    /// that of the arcs, or a buffer has the wrong length.
    pub fn fill(
        reflectance: &[V::Wide],
        cells: &'a mut [Cell<F, V>],
        slots: &'a mut [Slot<F>],
        constants: &'a mut Constants<F>,
    ) -> Result<Self, CircleError> {
        let n = cells.len();
        validate(reflectance, n)?;
        check_slots(n, slots)?;
        for (cell, filled) in cells.iter_mut().zip(all_cells(reflectance, n)) {
            *cell = filled;
        }
        for (slot, filled) in slots.iter_mut().zip(all_slots(n)) {
            *slot = filled;
        }
        *constants = Constants::new(n);
        Ok(Self {
            cells,
            slots,
            constants,
        })
    }

    /// Tables that [`fill`](Self::fill) has filled before, perhaps on another machine: constants in
    /// flash.
    ///
    /// What cannot be is refused; whether the numbers are right is not looked at.
    ///
    /// # Errors
    /// [`CircleError::Cells`], [`CircleError::Length`], [`CircleError::Channels`], [`CircleError::Reflectance`] (by cell),
    /// [`CircleError::Slot`].
    pub fn new(
        cells: &'a [Cell<F, V>],
        slots: &'a [Slot<F>],
        constants: &'a Constants<F>,
    ) -> Result<Self, CircleError> {
        let n = cells.len();
        if n == 0 || n > 1 << 31 {
            return Err(CircleError::Cells);
        }
        check_slots(n, slots)?;
        check(cells.iter().map(|cell| cell.reflectance))?;
        // `locate` may add one, where the cell ends within the slot: never behind the last one.
        let last = (n - 1) as u32;
        let bad = |slot: &Slot<F>| {
            slot.cell > last || slot.cell == last && !(slot.end > F::one()) || slot.end.is_nan()
        };
        if let Some(slot) = slots.iter().position(bad) {
            return Err(CircleError::Slot { slot });
        }
        Ok(Self {
            cells,
            slots,
            constants,
        })
    }
}

impl<F: Real, V: Value<F>> Tables for BorrowedTables<'_, F, V> {
    type Scalar = F;
    type Value = V;

    #[inline(always)]
    fn cells(&self) -> &[Cell<F, V>] {
        self.cells
    }
    #[inline(always)]
    fn slots(&self) -> &[Slot<F>] {
        self.slots
    }
    #[inline(always)]
    fn constants(&self) -> &Constants<F> {
        self.constants
    }
}

/// Tables in buffers of their own.
#[cfg(feature = "alloc")]
#[derive(Clone, Debug)]
pub struct OwnedTables<F, V = F> {
    cells: Vec<Cell<F, V>>,
    slots: Vec<Slot<F>>,
    constants: Constants<F>,
}

#[cfg(feature = "alloc")]
impl<F: Real, V: Value<F>> OwnedTables<F, V> {
    /// The tables of a circle with `reflectance` on equal arcs and `cells` cells: of one channel, 72 bytes a
    /// cell in f64, 36 in f32.
    ///
    /// # Errors
    /// As [`BorrowedTables::fill`], and [`CircleError::Memory`].
    ///
    /// ```
    /// use fredholm_circle::{CircleError, OwnedTables};
    /// use fredholm_core::{Channels, Value};
    ///
    /// let grey = OwnedTables::<f64>::new(&[0.3, 0.7], 1000)?;
    /// // Three colours.
    /// let red = Channels::from_fn(3, |c| [0.7, 0.2, 0.1][c]);
    /// let coloured = OwnedTables::<f64, Channels<f64, 3>>::new(&[red, Channels::splat(3, 0.5)], 1000)?;
    /// # Ok::<(), CircleError>(())
    /// ```
    pub fn new(reflectance: &[V::Wide], cells: usize) -> Result<Self, CircleError> {
        validate(reflectance, cells)?;
        let mut tables = Self {
            cells: Vec::new(),
            slots: Vec::new(),
            constants: Constants::new(cells),
        };
        let reserved = tables.cells.try_reserve_exact(cells);
        reserved
            .and_then(|()| tables.slots.try_reserve_exact(slots(cells)))
            .map_err(|_| CircleError::Memory { cells })?;
        tables.cells.extend(all_cells(reflectance, cells));
        tables.slots.extend(all_slots(cells));
        Ok(tables)
    }
}

#[cfg(feature = "alloc")]
impl<F: Real, V: Value<F>> Tables for OwnedTables<F, V> {
    type Scalar = F;
    type Value = V;

    #[inline(always)]
    fn cells(&self) -> &[Cell<F, V>] {
        &self.cells
    }
    #[inline(always)]
    fn slots(&self) -> &[Slot<F>] {
        &self.slots
    }
    #[inline(always)]
    fn constants(&self) -> &Constants<F> {
        &self.constants
    }
}

/// The cells of a circle with these reflectances on equal arcs.
fn all_cells<F: Real, V: Value<F>>(
    reflectance: &[V::Wide],
    cells: usize,
) -> impl Iterator<Item = Cell<F, V>> {
    let step = Double::turn(cells as f64);
    let mut middle = Double::turn(2.0 * cells as f64);
    let per_arc = cells / reflectance.len().max(1);
    let of_cells = reflectance
        .iter()
        .flat_map(move |r| core::iter::repeat_n(r, per_arc));
    of_cells.map(move |r| {
        let [cos, sin] = middle;
        middle = rotate(middle, step);
        Cell {
            middle: Direction {
                cos: F::from_f64(cos.hi),
                sin: F::from_f64(sin.hi),
                cos_low: low(cos),
                sin_low: low(sin),
            },
            reflectance: narrow(r),
        }
    })
}

/// A value in another scalar.
pub(crate) fn narrow<F: Real, V: Value<F>>(wide: &V::Wide) -> V {
    V::from_fn(wide.channels(), |c| F::from_f64(wide.get(c)))
}

/// What double precision left of a number of 106 bits.
fn low<F: Real>(x: Double) -> F {
    let high = F::from_f64(x.hi).to_f64();
    F::from_f64((x.hi - high) + x.lo)
}

/// Increases from 0 to 1 as the half angle goes from 0 to π.
#[inline]
pub(crate) fn pseudo_angle<F: Real>(cos: F, sin: F) -> F {
    let half = F::from_f64(0.5);
    half - half * cos / (cos.abs() + sin)
}

/// The slots of a circle of so many cells.
fn all_slots<F: Real>(cells: usize) -> impl Iterator<Item = Slot<F>> {
    let count = slots(cells) as u32;
    let mut slot = Slot {
        end: F::zero(),
        cell: u32::MAX,
    };
    (0..count).map(move |number| {
        while slot.end <= F::from_u32(number) / F::from_u32(count) {
            slot.cell = slot.cell.wrapping_add(1);
            slot.end = end(slot.cell as usize + 1, cells);
        }
        slot
    })
}

/// The pseudo-angle at which the first `cells` of `all` cells end: a function of their ratio, so
/// that arcs end at the same bits whatever the number of cells.
fn end<F: Real>(cells: usize, all: usize) -> F {
    if cells == all {
        // Nothing is behind the last cell.
        return F::from_f64(2.0);
    }
    let half_angle = core::f64::consts::PI * (cells as f64 / all as f64);
    F::from_f64(pseudo_angle(Real::cos(half_angle), Real::sin(half_angle)))
}

fn validate<V: Value<f64>>(reflectance: &[V], cells: usize) -> Result<(), CircleError> {
    if reflectance.is_empty() {
        return Err(CircleError::NoReflectance);
    }
    check(reflectance.iter().copied())?;
    if cells == 0 || cells > 1 << 31 {
        return Err(CircleError::Cells);
    }
    let arcs = reflectance.len();
    if !cells.is_multiple_of(arcs) {
        return Err(CircleError::NotAMultiple { cells, arcs });
    }
    Ok(())
}

/// Refuses reflectances outside [0, 1), and those with other channels than the first.
fn check<F: Real, V: Value<F>>(
    reflectance: impl Iterator<Item = V> + Clone,
) -> Result<(), CircleError> {
    let channels = reflectance
        .clone()
        .next()
        .map_or(0, |first| first.channels());
    for (arc, value) in reflectance.enumerate() {
        if value.channels() != channels || channels == 0 {
            return Err(CircleError::Channels);
        }
        let possible = F::zero()..F::one();
        if !(0..channels).all(|c| possible.contains(&value.get(c))) {
            return Err(CircleError::Reflectance { arc });
        }
    }
    Ok(())
}

fn check_slots<F>(cells: usize, slots: &[Slot<F>]) -> Result<(), CircleError> {
    let (expected, found) = (crate::slots(cells), slots.len());
    if expected == found {
        Ok(())
    } else {
        Err(CircleError::Length { expected, found })
    }
}
