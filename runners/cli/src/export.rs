//! `fredholm export`: the neighbour equation as tables for a device.

use std::path::Path;

use fredholm::Pairs;
use fredholm::answer::Solved;
use fredholm::model::LastSteps;

use crate::args::ExportArgs;
use crate::failure::{Ended, Failure};
use crate::solve::{Problem, cut, read};
use fredholm_parts::output::Output;

/// Runs `export`.
pub(crate) fn export(args: &ExportArgs) -> Result<Ended, Failure> {
    let file = read(&args.file, |_| ())?;
    let pairs = &file.galerkin.pairs;
    if pairs.value == Pairs::Theory {
        let message = "a device knows pairs by a rule, not one by one: export with \"default\", \"pointwise\", \"paper\" or, \
                       of a room, \"rays\"";
        return Err(file.refuse(pairs, message).into());
    }
    let problem = Problem::new(file, None)?;
    let file = &problem.file;
    let is_always = problem.model().last_steps() == LastSteps::Always;
    file.refuse_directions(is_always)?;
    let fail = Failure::of(&problem.file);
    let mut settings = problem.resolved.settings.clone();
    // Where nothing is said of pairs, and others walk by rays.
    settings.pairs.get_or_insert(Pairs::Default);
    let (model, walk, settings) = (problem.model(), settings.walk_options(), &settings);
    let cells = cut(&problem.file, model, settings, &problem.goals)?;
    cells.check_variance(&walk).map_err(&fail)?;
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
    let output = Output::open("--out", &args.out)?;
    let solved = Solved::new(&*cells, walk.absorption).map_err(&fail)?;
    let tables = solved
        .system
        .tables(walk.pairs, walk.absorption)
        .map_err(&fail)?;
    if source {
        output.finish(head(&args.file, model.about().kind) + &tables.to_source())?;
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
