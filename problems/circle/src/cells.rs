//! The partition of the circle into equal cells, with what a walk looks up about them.

use fredholm_core::Real;

use crate::CircleError;
use crate::double::{Double, rotate};

/// cos and sin of an angle, each as a number and its rounding error, so that the sine of the angle
/// between two nearly parallel directions keeps its digits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Direction<F> {
    pub(crate) cos: F,
    pub(crate) sin: F,
    pub(crate) cos_low: F,
    pub(crate) sin_low: F,
}

impl<F: Real> Direction<F> {
    /// |sin| of the angle between two directions, with a relative error of about 5 ε.
    ///
    /// The plain cross product has an absolute error of ε, which is a relative one of 4 ε while the
    /// sine is above ¼. Below, one pair of 30 on a fine partition, products and tables are taken
    /// to twice the precision.
    #[inline]
    pub(crate) fn sine(&self, other: &Self) -> F {
        let sine = (self.sin * other.cos - self.cos * other.sin).abs();
        if sine >= F::from_f64(0.25) {
            return sine;
        }
        self.small_sine(other)
    }

    #[cold]
    #[inline(never)]
    fn small_sine(&self, other: &Self) -> F {
        let (a, b) = (self.sin * other.cos, self.cos * other.sin);
        let a_low = self.sin.mul_add(other.cos, -a);
        let b_low = self.cos.mul_add(other.sin, -b);
        let low = (self.sin_low * other.cos - self.cos_low * other.sin)
            + (self.sin * other.cos_low - self.cos * other.sin_low);
        ((a - b) + ((a_low - b_low) + low)).abs()
    }
}

/// What a walk looks up about a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell<F> {
    /// The half angle of the cell's middle.
    pub(crate) middle: Direction<F>,
    /// The pseudo-angle at which the next cell begins.
    pub(crate) end: F,
    /// ρ.
    pub(crate) reflectance: F,
}

/// The length of the table of guesses for `cells` cells.
#[must_use]
pub const fn guesses(cells: usize) -> usize {
    // The pseudo-angle is at most π/2 times as dense as the angle: about every other guess is
    // exact, and the search that follows takes at most two steps.
    2 * cells
}

/// n equal cells of [0, 2π), on which the reflectance is constant.
///
/// The buffers are the caller's: tables in flash, on a stack or on a heap. With the feature
/// `alloc`, [`Tables`](crate::Tables) owns them.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a, F> {
    cells: &'a [Cell<F>],
    guesses: &'a [u32],
}

impl<'a, F: Real> Cells<'a, F> {
    /// Fills the buffers: as many cells as `cells` has entries, `reflectance` on equal arcs of
    /// [0, 2π), and [`guesses`]`(cells.len())` guesses.
    ///
    /// # Errors
    /// [`CircleError`] where a reflectance is outside [0, 1), the number of cells is no multiple of
    /// that of the arcs, or a buffer has the wrong length.
    pub fn fill(
        reflectance: &[f64],
        cells: &'a mut [Cell<F>],
        guesses: &'a mut [u32],
    ) -> Result<Self, CircleError> {
        let n = cells.len();
        validate(reflectance, n)?;
        let expected = crate::guesses(n);
        if guesses.len() != expected {
            return Err(CircleError::Length {
                expected,
                found: guesses.len(),
            });
        }
        let n_float = n as f64;
        let per_arc = n / reflectance.len();
        let step = Double::turn(n_float);
        let mut middle = Double::turn(2.0 * n_float);
        let mut values = reflectance
            .iter()
            .flat_map(|r| core::iter::repeat_n(*r, per_arc));
        for (i, cell) in cells.iter_mut().enumerate() {
            let end = core::f64::consts::PI * ((i + 1) as f64 / n_float);
            let end = pseudo_angle(Real::cos(end), Real::sin(end));
            let [cos, sin] = middle;
            *cell = Cell {
                middle: Direction {
                    cos: F::from_f64(cos.hi),
                    sin: F::from_f64(sin.hi),
                    cos_low: low(cos),
                    sin_low: low(sin),
                },
                end: F::from_f64(if i + 1 == n { 2.0 } else { end }),
                reflectance: F::from_f64(values.next().unwrap_or(0.0)),
            };
            middle = rotate(middle, step);
        }
        fill_guesses(cells, guesses);
        Ok(Self { cells, guesses })
    }

    /// Buffers that [`fill`](Self::fill) has filled.
    #[cfg(feature = "alloc")]
    pub(crate) const fn filled(cells: &'a [Cell<F>], guesses: &'a [u32]) -> Self {
        Self { cells, guesses }
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
        let slot = (angle * F::from_u32(self.guesses.len() as u32)).to_u32() as usize;
        let last = self.cells.len() as u32 - 1;
        // Half angle π is half angle 0: the end of the last cell belongs to it.
        let mut cell = self.guesses.get(slot).copied().unwrap_or(last);
        while self.get(cell as usize).is_some_and(|c| angle >= c.end) {
            cell += 1;
        }
        cell
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

/// guess g is the first cell that ends after g/guesses.
fn fill_guesses<F: Real>(cells: &[Cell<F>], guesses: &mut [u32]) {
    let count = F::from_u32(guesses.len() as u32);
    let mut cell = 0;
    for (g, guess) in guesses.iter_mut().enumerate() {
        let start = F::from_u32(g as u32) / count;
        while cells.get(cell).is_some_and(|c| c.end <= start) {
            cell += 1;
        }
        *guess = cell as u32;
    }
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
