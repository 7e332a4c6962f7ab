//! `fredholm diagnose`: the variance before the walks, and what limits it.

mod report;

use fredholm::diagnosis::{Diagnosis, Picture, diagnose as predict};
use fredholm::{Choices, Pairs, Settings};
use fredholm_file::Resolution;
use fredholm_plot::ShareTable;

use crate::args::DiagnoseArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::progress::{Sites, bar};
use crate::solve::{Problem, cut, read};
use crate::threads::with_threads;
use crate::{render, table};
use fredholm_file::parts::output::open_all;
use report::Report;

/// The points of the integrals on these cells of an axis of a cube, whatever `--nodes` says.
fn least_nodes(dimension: Option<usize>, per_axis: usize, settings: &Settings) -> Option<usize> {
    let of_axis = per_axis.saturating_mul(settings.discretisation().degree + 2);
    Some(of_axis.saturating_pow(u32::try_from(dimension?).ok()?))
}

/// Runs `diagnose`.
pub(crate) fn diagnose(args: &DiagnoseArgs) -> Result<Ended, Failure> {
    let file = read(&args.file, |file| {
        args.method.replace(file);
        // What is infinite is said, and not refused.
        file.walk.allow_infinite_variance = true;
    })?;
    let problem = Problem::new(file, None)?;
    let settings = &problem.resolved.settings;
    let (model, goals) = (problem.model(), &problem.goals);
    let cells = cut(&problem.file, model, settings, goals)?;
    let least = least_nodes(model.about().dimension, cells.cells(), settings);
    if let Some(least) = least.filter(|&least| least > 2 * usize::from(args.nodes)) {
        say(format_args!(
            "warning: so many cells take integrals in {least} points instead of {}, and the work grows with their \
             square, to minutes: fewer `--cells` show the same",
            args.nodes
        ));
    }
    let output = match &args.out {
        Some(dir) => Some(open_all("--out", dir, ["diagnosis.json", "where.svg"])?),
        None => None,
    };
    let sites = Sites(bar(
        0,
        "{bar:30} {human_pos} of {human_len} sites, {elapsed}",
        |style| style,
    ));
    let work = || predict(model, goals, settings, usize::from(args.nodes), &sites);
    let diagnosis = with_threads(args.common.threads, work)?;
    let diagnosis = diagnosis.map_err(Failure::of(&problem.file))?;
    sites.0.finish_and_clear();
    let walk = settings.walk_options();
    let report = Report {
        problem: model.about().kind,
        cells: cells.cells(),
        unknowns: cells.unknowns(),
        degree: settings.discretisation().degree,
        pairs: match settings.lifted() {
            Some(_) => Pairs::Pointwise,
            None => walk.pairs,
        }
        .word(),
        absorption: walk.absorption.probability(),
        estimator: walk.absorption.estimator().word(),
        form: walk.form.word(),
        diagnosis: &diagnosis,
    };
    if let Some([json, map]) = output {
        json.finish(table::json(&report)?)?;
        map.finish(picture(&diagnosis, &problem.resolved.model)?)?;
    }
    print(if args.common.json {
        table::json(&report)?
    } else {
        report.text(&cells.cells_text())
    })?;
    Ok(Ended::Done)
}

/// The picture of where the variance comes from, as SVG.
fn picture(diagnosis: &Diagnosis, model: &Resolution) -> Result<String, Failure> {
    match (&diagnosis.picture, model) {
        (Picture::Table(names, shares), _) => {
            let shares = ShareTable {
                title: "share of the variance, by steps",
                names,
                shares,
            };
            table::drawn(shares.draw())
        }
        (Picture::Walls(pieces), Resolution::Room(room)) => render::shares(room, pieces),
        _ => Err(Failure::run("there are no walls to draw")),
    }
}
