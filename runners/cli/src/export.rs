//! `fredholm export`: the neighbour equation as tables for a device.

use core::fmt::Debug;
use std::path::Path;

use fredholm_circle::{Constants, Harmonic};
use fredholm_core::Real;
use fredholm_core::galerkin::{OffDiagonal, PairKind};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_room::{Choice, Scene};

use crate::args::ExportArgs;
use crate::circle::{Light, NeighbourSource, Setup};
use crate::cube::{FileCube, Table};
use crate::failure::{Ended, Failure};
use crate::file::Pairs;
use crate::output::Output;
use crate::problem;
use crate::room;
use crate::solve::{read, refuse_beyond_memory};

/// Runs `export`.
pub(crate) fn export(args: &ExportArgs) -> Result<Ended, Failure> {
    let file = read(&args.file, |_| ())?;
    let pairs = &file.galerkin.pairs;
    if pairs.value == Pairs::Theory {
        let message = "a device knows pairs by a rule, not one by one: export with \"default\", \"pointwise\" \
                       or \"paper\"";
        return Err(file.refuse(pairs, message).into());
    }
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

/// Which pairs are treated how.
#[derive(Clone, Copy)]
enum Kinds {
    /// All in S.
    Galerkin = 0,
    /// The rest, on a circle and a cube the diagonal, pointwise.
    RestPointwise = 1,
    /// The rest left out.
    RestOut = 2,
    /// All pointwise.
    Pointwise = 3,
}

impl Kinds {
    fn add_to(self, tables: &mut TableBuilder) {
        tables.numbers("pairs", &[self as u32]);
    }
}

/// `None`: all pairs are pointwise.
fn kinds(pairs: Option<OffDiagonal>) -> Kinds {
    match pairs.map(|pairs| pairs.diagonal) {
        Some(PairKind::Galerkin) => Kinds::Galerkin,
        Some(PairKind::Pointwise) => Kinds::RestPointwise,
        Some(PairKind::None) => Kinds::RestOut,
        None => Kinds::Pointwise,
    }
}

/// Numbers as bytes.
fn bytes<T: Number>(numbers: &[T]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.bytes()).collect()
}

/// Numbers as literals with commas between them.
fn list<T: Number>(numbers: &[T]) -> String {
    let texts: Vec<String> = numbers.iter().map(|x| x.literal()).collect();
    texts.join(", ")
}

/// The tables of a circle.
pub(crate) fn circle<F: Real + Number>(
    setup: &Setup<'_, F>,
    constants: Constants<F>,
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
    tables.numbers("degree", &[setup.scene.degree as u32]);
    tables.numbers("v", &setup.v);
    match &setup.source {
        NeighbourSource::Table(off_diagonal, g) => {
            tables.numbers("source", g);
            kinds(Some(*off_diagonal)).add_to(&mut tables);
        }
        // Refused before.
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
            kinds(None).add_to(&mut tables);
        }
    }
    tables
}

/// The tables of a cube: its kernel and source are for the device to know.
pub(crate) fn cube<F: Real + Number, const D: usize, const B: usize>(
    cube: &FileCube<'_, f64, D, B>,
    absorption: f64,
    coefficients: &Table<D>,
    off_diagonal: Option<OffDiagonal>,
    [v, g]: [&[F]; 2],
) -> TableBuilder {
    let mut tables = TableBuilder::new("cube");
    tables.numbers("absorb", &[absorption]);
    tables.numbers("axes", &[D as u32, cube.per_axis() as u32]);
    tables.numbers("degree", &[cube.degree() as u32]);
    match coefficients {
        Table::Dense { entries, .. } => dense::<F, B>(&mut tables, entries),
        // Products are rounded, not factors, so that the walks are the program's own.
        Table::Product(factors) => tables.numbers("factors", factors.entries()),
    }
    tables.numbers("v", v);
    tables.numbers("source", g);
    kinds(off_diagonal).add_to(&mut tables);
    tables
}

/// Coefficients in a dense table. As walks in f32 see them, contractions are rounded, not
/// coefficients: of one function on a cell these are the same.
fn dense<F: Real + Number, const B: usize>(tables: &mut TableBuilder, entries: &[f64]) {
    if B > 1 {
        tables.numbers("coeffs", entries);
    } else {
        let entries: Vec<F> = entries.iter().map(|&k| F::from_f64(k)).collect();
        tables.numbers("coeffs", &entries);
    }
}

/// The tables of a room.
pub(crate) fn room<F: Real + Number, const B: usize>(
    setup: &room::SetUp<F, B>,
    scene: &Scene,
) -> Result<TableBuilder, Failure> {
    let mut tables = TableBuilder::new("room");
    let geometry = setup.tables.geometry();
    tables.numbers("absorb", &[setup.absorption]);
    tables.numbers("open", &[u32::from(geometry.is_open())]);
    add::<F, _>(&mut tables, ["walls", "Wall"], geometry.walls(), |wall| {
        [
            bytes(wall.ends.as_flattened()),
            bytes(&wall.vertices),
            bytes(&wall.tangent),
            bytes(&[wall.length, wall.reflectance, wall.emission]),
        ]
        .concat()
    });
    add::<F, _>(
        &mut tables,
        ["segments", "Segment"],
        geometry.segments(),
        |segment| {
            [
                bytes(segment.ends.as_flattened()),
                bytes(&segment.vertices),
                bytes(&[segment.wall]),
            ]
            .concat()
        },
    );
    add::<F, _>(&mut tables, ["nodes", "Node"], geometry.nodes(), |node| {
        let numbers = [node.first, node.count];
        [bytes(&node.centre), bytes(&node.half), bytes(&numbers)].concat()
    });
    let (edges, walls, first) = setup.tables.cells().tables();
    add::<F, _>(&mut tables, ["edges", "Edge"], edges, |edge| {
        [bytes(&[edge.along]), bytes(&edge.position)].concat()
    });
    tables.numbers("cells", walls);
    tables.numbers("first", first);
    tables.numbers("lengths", setup.tables.lengths());
    let mut surfaces = vec![0];
    for surface in 0..scene.surfaces() {
        let walls = scene.walls_of(surface).map_err(Failure::run)?;
        surfaces.push(walls.end as u32);
    }
    tables.numbers("surfaces", &surfaces);
    tables.numbers("views", setup.system.matrix.views().table());
    tables.numbers("degree", &[B as u32 - 1]);
    dense::<F, B>(&mut tables, setup.system.matrix.entries());
    tables.numbers("v", &setup.v);
    tables.numbers("source", &setup.g);
    let kinds = match setup.choice {
        Choice::Paper => Kinds::RestOut,
        Choice::Default => Kinds::RestPointwise,
        Choice::Pointwise => Kinds::Pointwise,
    };
    kinds.add_to(&mut tables);
    Ok(tables)
}

/// Records of a room, whose fields are public: what `Debug` writes is Rust.
fn add<F: Number, R: Debug>(
    tables: &mut TableBuilder,
    [name, kind]: [&'static str; 2],
    records: &[R],
    bytes: impl Fn(&R) -> Vec<u8>,
) {
    tables.records(
        name,
        &format!("fredholm_room::{kind}<{}>", F::NAME),
        size_of::<R>(),
        records
            .iter()
            .map(|record| (bytes(record), format!("fredholm_room::{record:?}"))),
    );
}
