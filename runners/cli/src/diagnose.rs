//! `fredholm diagnose`: the variance before the walks, and what limits it.

mod report;

use fredholm::diagnosis::{Diagnosis, Picture, diagnose as predict};
use fredholm::{Choices, Error, Pairs, Settings, SolveError, Solver};
use fredholm_file::{Resolution, Resolved};
use fredholm_plot::ShareTable;

use crate::args::DiagnoseArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::progress::{Sites, bar};
use crate::solve::{Problem, cut, read};
use crate::threads::with_threads;
use crate::{render, table};
use fredholm_file::parts::output::open_all;
use report::Report;

/// Runs `diagnose`.
pub(crate) fn diagnose(args: &DiagnoseArgs) -> Result<Ended, Failure> {
    let file = read(&args.file, |file| {
        args.method.replace(file);
        // What is infinite is said, and not refused.
        file.walk.allow_infinite_variance = true;
    })?;
    let problem = Problem::new(file, None)?;
    let (model, goals) = (problem.model(), &problem.goals);
    let nodes = usize::from(args.nodes);
    let own = &problem.resolved.settings;
    // The choice of the rest takes long on many cells, too.
    let is_long = own.cells.is_some() && takes_long(&problem, own, nodes)?;
    let output = match &args.out {
        Some(dir) => Some(open_all("--out", dir, ["diagnosis.json", "where.svg"])?),
        None => None,
    };
    let sites = Sites(bar(
        0,
        "{bar:30} {human_pos} of {human_len} sites, {elapsed}",
        |style| style,
    ));
    let fail = Failure::of(&problem.file);
    let choose = || chosen(&problem, nodes, &sites);
    let settings = &with_threads(args.common.threads, choose)?.map_err(&fail)?;
    let cells = cut(&problem.file, model, settings, goals)?;
    if !is_long {
        takes_long(&problem, settings, nodes)?;
    }
    let work = || predict(model, goals, settings, nodes, &sites);
    let diagnosis = with_threads(args.common.threads, work)?;
    let diagnosis = diagnosis.map_err(&fail)?;
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

/// Whether integrals take many more points than these, which is said.
fn takes_long(problem: &Problem, settings: &Settings, nodes: usize) -> Result<bool, Failure> {
    let cells = problem.model().partition(&settings.discretisation());
    let least = cells.and_then(|cells| cells.examined_points());
    let least = least.map_err(Failure::of(&problem.file))?;
    let is_long = least > 2 * nodes;
    if is_long {
        say(format_args!(
            "warning: so many cells take integrals in {least} points instead of {nodes}, and the work grows with their \
             square, to minutes: fewer `--cells` show the same"
        ));
    }
    Ok(is_long)
}

/// The settings with what `solve` would choose, if walks with a neighbour equation pay.
fn chosen(problem: &Problem, nodes: usize, watch: &Sites) -> Result<Settings, Error> {
    let Resolved {
        targets, settings, ..
    } = &problem.resolved;
    let solver = Solver::with(problem.model(), settings.clone(), targets.clone());
    match solver.observer(watch).choose_to_diagnose(nodes) {
        Ok(settings) => Ok(settings),
        Err(SolveError::Failed(error)) => Err(error),
        Err(_) => Err(Error::Cancelled),
    }
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
