//! `fredholm export`: the neighbour equation as tables for a device.

use std::path::Path;

use fredholm_circle::{Constants, Harmonic};
use fredholm_core::Real;
use fredholm_core::galerkin::{OffDiagonal, PairKind};
use fredholm_embedded::{Number, TableBuilder};

use crate::args::ExportArgs;
use crate::circle::{Light, NeighbourSource, Setup};
use crate::cube::Table;
use crate::failure::{Ended, Failure};
use crate::output::Output;
use crate::problem;
use crate::solve::{read, refuse_beyond_memory};

/// Runs `export`.
pub(crate) fn export(args: &ExportArgs) -> Result<Ended, Failure> {
    let file = read(&args.file, |_| ())?;
    let problem = problem::of_file(&file)?;
    refuse_beyond_memory(&file, &*problem)?;
    problem.refuse_infinite_variance()?;
    let source = match args.out.extension().and_then(|e| e.to_str()) {
        Some("rs") => true,
        Some("bin") => false,
        _ => {
            return Err(Failure::input(format_args!(
                "`--out {}`: the name must end in .rs, for constants in Rust, or .bin, for a compact \
                 table",
                args.out.display()
            )));
        }
    };
    let output = Output::open(&args.out)?;
    let tables = problem.tables()?;
    if source {
        output.finish(head(&args.file, problem.kind()) + &tables.to_source())?;
    } else {
        output.finish(tables.to_bytes())?;
    }
    Ok(Ended::Done)
}

/// What a reader of the constants is told.
fn head(file: &Path, kind: &str) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str());
    format!(
        "// Written by `fredholm export` from {} (a {kind}). Include it within a module of its own:\n\
         // mod tables {{ include!(\"…\"); }}\n",
        // A line break in the name must not end the comment.
        name.to_string_lossy().escape_debug()
    )
}

/// Which pairs are treated how: 0, all in S; 1, the diagonal pointwise; 2, the diagonal left out; 3, all
/// pointwise.
fn pairs(pairs: Option<OffDiagonal>) -> [u32; 1] {
    [match pairs.map(|pairs| pairs.diagonal) {
        Some(PairKind::Galerkin) => 0,
        Some(PairKind::Pointwise) => 1,
        Some(PairKind::None) => 2,
        None => 3,
    }]
}

/// The tables of a circle.
pub(crate) fn circle<F: Real + Number>(
    setup: &Setup<'_, F>,
    constants: Constants<F>,
) -> TableBuilder {
    let mut tables = TableBuilder::new("circle");
    let (cells, slots) = setup.tables.cells().tables();
    let name = F::NAME;
    let bytes = |numbers: &[F]| numbers.iter().flat_map(|x| x.bytes()).collect::<Vec<u8>>();
    let list = |numbers: &[F]| {
        let texts: Vec<String> = numbers.iter().map(|x| x.literal()).collect();
        texts.join(", ")
    };
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
    match setup.scene.light {
        Light::Harmonic(Harmonic {
            constant,
            amplitude,
            frequency,
        }) => tables.numbers("harmonic", &[constant, amplitude, f64::from(frequency)]),
        Light::Arcs(arcs) => tables.numbers("arcs", arcs.values()),
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
    tables.numbers("v", &setup.v);
    match &setup.source {
        NeighbourSource::Table(off_diagonal, g) => {
            tables.numbers("source", g);
            tables.numbers("pairs", &pairs(Some(*off_diagonal)));
        }
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
            tables.numbers("pairs", &pairs(None));
        }
    }
    tables
}

/// The tables of a cube: its kernel and source are for the device to know.
pub(crate) fn cube<F: Real + Number, const D: usize>(
    per_axis: usize,
    absorption: f64,
    coefficients: &Table<D>,
    off_diagonal: Option<OffDiagonal>,
    [v, g]: [&[F]; 2],
) -> TableBuilder {
    let mut tables = TableBuilder::new("cube");
    tables.numbers("absorb", &[absorption]);
    tables.numbers("axes", &[D as u32, per_axis as u32]);
    match coefficients {
        Table::Dense(entries) => {
            let entries: Vec<F> = entries.iter().map(|&k| F::from_f64(k)).collect();
            tables.numbers("coeffs", &entries);
        }
        // Products are rounded, not factors, so that the walks are the program's own.
        Table::Product(factors) => tables.numbers("factors", factors.entries()),
    }
    tables.numbers("v", v);
    tables.numbers("source", g);
    tables.numbers("pairs", &pairs(off_diagonal));
    tables
}
