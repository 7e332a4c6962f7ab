//! The tables of a circle for a device.

use fredholm_circle::{Constants, Harmonic};
use fredholm_core::Real;
use fredholm_embedded::{Number, TableBuilder};

use super::light::Light;
use super::system::{NeighbourSource, Setup};
use fredholm_model::device::{PairRule, bytes, list};

/// The tables of a circle.
pub(super) fn circle<F: Real + Number>(
    setup: &Setup<'_, F>,
    constants: Constants<F>,
    light: Light<'_>,
) -> TableBuilder {
    let mut tables = TableBuilder::new("circle");
    let (cells, slots) = setup.tables.cells().tables();
    let name = F::NAME;
    let record = |kind: &str, parts: &[F]| {
        let text = format!("fredholm_circle::{kind}::new([{}])", list(parts));
        (bytes(parts), text)
    };
    tables.records(
        "circle",
        &format!("fredholm_circle::Constants<{name}>"),
        size_of::<Constants<F>>(),
        [record("Constants", &constants.parts())],
    );
    match light {
        Light::Harmonic(Harmonic {
            constant,
            amplitude,
            frequency,
        }) => tables.numbers("harmonic", &[constant, amplitude, f64::from(frequency)]),
        Light::Arcs(arcs) => tables.numbers("arcs", arcs.values()),
        // Tables are of u.
        Light::Direct(_) => {}
    }
    tables.records(
        "cells",
        &format!("fredholm_circle::Cell<{name}>"),
        size_of::<fredholm_circle::Cell<F>>(),
        cells.iter().map(|cell| record("Cell", &cell.parts())),
    );
    tables.records(
        "slots",
        &format!("fredholm_circle::Slot<{name}>"),
        size_of::<fredholm_circle::Slot<F>>(),
        slots.iter().map(|slot| {
            let (end, cell) = slot.parts();
            let text = format!("fredholm_circle::Slot::new({}, {cell})", end.literal());
            (end.bytes().chain(cell.bytes()).collect(), text)
        }),
    );
    tables.numbers("degree", &[setup.system.degree() as u32]);
    tables.numbers("v", &setup.v);
    match &setup.source {
        NeighbourSource::Table(diagonal_rule, g) => {
            tables.numbers("source", g);
            PairRule::of(Some(*diagonal_rule)).add_to(&mut tables);
        }
        // A device knows no such pairs: whoever asks for tables refuses them.
        NeighbourSource::Kinds(..) => {}
        NeighbourSource::ClosedForm(moments) => {
            tables.records(
                "moments",
                &format!("fredholm_circle::Moment<{name}>"),
                size_of::<fredholm_circle::Moment<F>>(),
                moments.iter().map(|moment| {
                    let (cos, sin) = moment.parts();
                    let text = format!("fredholm_circle::Moment::new({})", list(&[cos, sin]));
                    (bytes(&[cos, sin]), text)
                }),
            );
            PairRule::of(None).add_to(&mut tables);
        }
    }
    tables
}
