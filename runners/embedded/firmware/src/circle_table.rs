//! A circle from a table that `fredholm export -o FILE.bin` wrote: everything is read where it lies.

use fredholm_circle::{Cells, Circle, Harmonic};
use fredholm_core::Real;
use fredholm_embedded::Table;
use fredholm_embedded::zerocopy::{FromBytes, Immutable};

/// The emission (57), of its three numbers.
pub(crate) fn harmonic(numbers: &[f64]) -> Option<Harmonic> {
    let [constant, amplitude, frequency] = *numbers else {
        return None;
    };
    let frequency = frequency as u32;
    Some(Harmonic {
        constant,
        amplitude,
        frequency,
    })
}

/// `None`: the table is of another circle, or refused.
pub(crate) fn circle<'a, F: Real + FromBytes + Immutable>(
    table: &Table<'a>,
) -> Option<Circle<'a, F, Harmonic>> {
    let light = harmonic(table.slice("harmonic").ok()?)?;
    let cells = Cells::new(table.slice("cells").ok()?, table.slice("slots").ok()?).ok()?;
    Circle::with_constants(cells, light, table.one("circle").ok()?).ok()
}
