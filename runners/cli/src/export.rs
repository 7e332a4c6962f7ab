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

