//! A circle from its tables: everything is read where it lies.

use fredholm_circle::{BorrowedTables, Circle, Harmonic};
use fredholm_core::Real;
use fredholm_embedded::Tables;
use fredholm_embedded::zerocopy::{FromBytes, Immutable};

/// A circle in flash.
pub(crate) type FlashCircle<'a, F> = Circle<BorrowedTables<'a, F>, Harmonic>;

/// `None`: the tables are of another circle, or refused.
#[inline(never)]
pub(crate) fn circle<'a, F>(tables: &Tables<'a>) -> Option<FlashCircle<'a, F>>
where
    F: Real + FromBytes + Immutable,
{
    // The light is a formula: C, D and ℓ of (57).
    let [constant, amplitude, frequency] = *tables.get::<f64>("light").ok()? else {
        return None;
    };
    let light = Harmonic {
        constant,
        amplitude,
        frequency: frequency as u32,
    };
    let (cells, slots) = (tables.get("cells").ok()?, tables.get("slots").ok()?);
    let own = BorrowedTables::new(cells, slots, tables.one("circle").ok()?).ok()?;
    Circle::new(own, light).ok()
}
