//! The partition of the circle into equal cells, with what a walk looks up about them.

use fredholm_core::Real;

use crate::CircleError;
use crate::double::{Double, rotate};

/// cos and sin of an angle, each as a number and its rounding error, so that the sine of the angle
/// between two nearly parallel directions keeps its digits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Direction<F> {
    pub(crate) cos: F,
    pub(crate) sin: F,
    pub(crate) cos_low: F,
    pub(crate) sin_low: F,
}

impl<F: Real> Direction<F> {
    /// |sin| of the angle between two directions, with an absolute error of ε.
    #[inline]
    pub(crate) fn rough_sine(&self, other: &Self) -> F {
        (self.sin * other.cos - self.cos * other.sin).abs()
    }

    /// |sin| of the angle between two directions, with a relative error of about 4 ε.
    ///
    /// The plain cross product has an absolute error of ε, which is a relative one of 4 ε while the
    /// sine is above ¼. Below, one pair of 30 on a fine partition, products and tables are taken
    /// to twice the precision.
    #[inline]
    pub(crate) fn sine(&self, other: &Self) -> F {
        let sine = self.rough_sine(other);
        if sine >= F::from_f64(0.25) {
            return sine;
        }
        rarely();
        self.small_sine(other).abs()
    }

    /// sin of the angle from another direction to this one, with a relative error of about 4 ε however
    /// small it is.
    #[inline]
    pub(crate) fn small_sine(&self, other: &Self) -> F {
        let (left, right) = (self.sin * other.cos, self.cos * other.sin);
        let left_low = self.sin.product_error(other.cos);
        let right_low = self.cos.product_error(other.sin);
        let low = (self.sin_low * other.cos - self.cos_low * other.sin)
            + (self.sin * other.cos_low - self.cos * other.sin_low);
        (left - right) + ((left_low - right_low) + low)
    }

    /// cos of the angle between two directions, with an absolute error of ε.
    #[inline]
    pub(crate) fn cosine(&self, other: &Self) -> F {
        self.cos * other.cos + self.sin * other.sin
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

/// The data of a cell that a walk looks up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Cell<F> {
    /// The half angle of the cell's middle.
    pub(crate) middle: Direction<F>,
    /// ρ.
    pub(crate) reflectance: F,
}

impl<F: Copy> Cell<F> {
    /// Puts together the numbers of [`parts`](Self::parts): for constants that were computed before.
    #[must_use]
    pub const fn new(parts: [F; 5]) -> Self {
        let [cos, sin, cos_low, sin_low, reflectance] = parts;
        Self {
            middle: Direction {
                cos,
                sin,
                cos_low,
                sin_low,
            },
            reflectance,
        }
    }

    /// cos and sin of the half angle of the cell's middle, their rounding errors, and ρ.
    #[must_use]
    pub const fn parts(&self) -> [F; 5] {
        let Direction {
            cos,
            sin,
            cos_low,
            sin_low,
        } = self.middle;
        [cos, sin, cos_low, sin_low, self.reflectance]
    }
}

/// One of equal parts of the pseudo-angle: the first cell that ends behind the beginning of the
/// part, and where that is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Slot<F> {
    end: F,
    cell: u32,
}

impl<F: Copy> Slot<F> {
    /// Puts together the numbers of [`parts`](Self::parts): for constants that were computed before.
    #[must_use]
    pub const fn new(end: F, cell: u32) -> Self {
        Self { end, cell }
    }

    /// The pseudo-angle at which the cell ends, and the number of the cell.
    #[must_use]
    pub const fn parts(&self) -> (F, u32) {
        (self.end, self.cell)
    }
}

/// The number of slots for `cells` cells.
#[must_use]
pub const fn slots(cells: usize) -> usize {
    // The derivative of the pseudo-angle is at least ¼, so a cell is at least π/4n of it wide, more
    // than a slot's 1/2n: at most one cell ends within a slot.
    2 * cells
}

/// n equal cells of [0, 2π), on which the reflectance is constant.
///
/// The buffers are the caller's: tables in flash, on a stack or on a heap. With the feature
/// `alloc`, [`Tables`](crate::Tables) owns them.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a, F> {
    cells: &'a [Cell<F>],
    slots: &'a [Slot<F>],
}

impl<'a, F: Real> Cells<'a, F> {
    /// Fills the buffers: as many cells as `cells` has entries, `reflectance` on equal arcs of
    /// [0, 2π), and [`slots`]`(cells.len())` slots.
    ///
    /// # Errors
    /// [`CircleError`] where a reflectance is outside [0, 1), the number of cells is no multiple of
    /// that of the arcs, or a buffer has the wrong length.
    pub fn fill(
        reflectance: &[f64],
        cells: &'a mut [Cell<F>],
        slots: &'a mut [Slot<F>],
    ) -> Result<Self, CircleError> {
        let n = cells.len();
        validate(reflectance, n)?;
        let expected = crate::slots(n);
        if slots.len() != expected {
            return Err(CircleError::Length {
                expected,
                found: slots.len(),
            });
        }
        let n_float = n as f64;
        let per_arc = n / reflectance.len();
        let step = Double::turn(n_float);
        let mut middle = Double::turn(2.0 * n_float);
        let mut values = reflectance
            .iter()
            .flat_map(|r| core::iter::repeat_n(*r, per_arc));
        for cell in cells.iter_mut() {
            let [cos, sin] = middle;
            *cell = Cell {
                middle: Direction {
                    cos: F::from_f64(cos.hi),
                    sin: F::from_f64(sin.hi),
                    cos_low: low::<F>(cos),
                    sin_low: low::<F>(sin),
                },
                reflectance: F::from_f64(values.next().unwrap_or(0.0)),
            };
            middle = rotate(middle, step);
        }
        fill_slots(n, slots);
        Ok(Self { cells, slots })
    }

    /// Tables that [`fill`](Self::fill) has filled before, perhaps on another machine: constants in
    /// flash.
    ///
    /// What cannot be is refused; whether the numbers are right is not looked at.
    ///
    /// # Errors
    /// [`CircleError::Cells`], [`CircleError::Length`], [`CircleError::Reflectance`] (by cell),
    /// [`CircleError::Slot`].
    pub fn new(cells: &'a [Cell<F>], slots: &'a [Slot<F>]) -> Result<Self, CircleError> {
        let n = cells.len();
        if n == 0 || n > 1 << 31 {
            return Err(CircleError::Cells);
        }
        let expected = crate::slots(n);
        if slots.len() != expected {
            return Err(CircleError::Length {
                expected,
                found: slots.len(),
            });
        }
        let possible = F::zero()..F::one();
        if let Some(arc) = cells
            .iter()
            .position(|c| !possible.contains(&c.reflectance))
        {
            return Err(CircleError::Reflectance { arc });
        }
        // `locate` may add one, where the cell ends within the slot: never behind the last one.
        let last = (n - 1) as u32;
        let bad = |slot: &Slot<F>| {
            slot.cell > last || slot.cell == last && !(slot.end > F::one()) || slot.end.is_nan()
        };
        if let Some(slot) = slots.iter().position(bad) {
            return Err(CircleError::Slot { slot });
        }
        Ok(Self { cells, slots })
    }

    /// The tables: what [`new`](Self::new) takes.
    #[must_use]
    pub const fn tables(&self) -> (&'a [Cell<F>], &'a [Slot<F>]) {
        (self.cells, self.slots)
    }

    /// Buffers that [`fill`](Self::fill) has filled.
    #[cfg(feature = "alloc")]
    pub(crate) const fn filled(cells: &'a [Cell<F>], slots: &'a [Slot<F>]) -> Self {
        Self { cells, slots }
    }

    /// The number n of cells.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.cells.len()
    }

    /// Never: a circle has at least one cell.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Cell `i`, where there is one.
    #[inline]
    pub(crate) fn get(&self, i: usize) -> Option<&'a Cell<F>> {
        self.cells.get(i)
    }

    /// All cells.
    pub(crate) fn iter(&self) -> core::slice::Iter<'a, Cell<F>> {
        self.cells.iter()
    }

    /// The cell of the half angle with this cosine and (non-negative) sine.
    #[inline]
    pub(crate) fn locate(&self, cos: F, sin: F) -> u32 {
        let angle = pseudo_angle(cos, sin);
        let number = (angle * F::from_u32(self.slots.len() as u32)).to_u32();
        // Half angle π, which is half angle 0, is the end of the last cell and belongs to it.
        let Some(slot) = self.slots.get(number as usize) else {
            return self.cells.len() as u32 - 1;
        };
        // An addition and no branch: half of all branches would be predicted wrong.
        slot.cell + u32::from(angle >= slot.end)
    }
}

/// What double precision left of a number of 106 bits.
fn low<F: Real>(x: Double) -> F {
    let high = F::from_f64(x.hi).to_f64();
    F::from_f64((x.hi - high) + x.lo)
}

/// Increases from 0 to 1 as the half angle goes from 0 to π.
#[inline]
fn pseudo_angle<F: Real>(cos: F, sin: F) -> F {
    let half = F::from_f64(0.5);
    half - half * cos / (cos.abs() + sin)
}

fn fill_slots<F: Real>(cells: usize, slots: &mut [Slot<F>]) {
    let count = F::from_u32(slots.len() as u32);
    let mut slot = Slot {
        end: F::zero(),
        cell: u32::MAX,
    };
    for (number, out) in slots.iter_mut().enumerate() {
        while slot.end <= F::from_u32(number as u32) / count {
            slot.cell = slot.cell.wrapping_add(1);
            slot.end = end(slot.cell as usize + 1, cells);
        }
        *out = slot;
    }
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

pub(crate) fn validate(reflectance: &[f64], cells: usize) -> Result<(), CircleError> {
    if reflectance.is_empty() {
        return Err(CircleError::NoReflectance);
    }
    if let Some(arc) = reflectance.iter().position(|r| !(0.0..1.0).contains(r)) {
        return Err(CircleError::Reflectance { arc });
    }
    if cells == 0 || cells > 1 << 31 {
        return Err(CircleError::Cells);
    }
    let arcs = reflectance.len();
    if !cells.is_multiple_of(arcs) {
        return Err(CircleError::NotAMultiple { cells, arcs });
    }
    Ok(())
}
