//! `fredholm export`: the neighbour equation as tables for a device.

use fredholm::answer::Solved;
use fredholm::model::LastSteps;

use crate::args::ExportArgs;
use crate::failure::{Ended, Failure};
use crate::solve::{Problem, cut, read};
use fredholm_file::parts::output::Output;

/// Runs `export`.
pub(crate) fn export(args: &ExportArgs) -> Result<Ended, Failure> {
    let file = read(&args.file, |_| ())?;
    let problem = Problem::new(file, None)?;
    let file = &problem.file;
    let is_always = problem.model().about().last_steps == LastSteps::Always;
    file.refuse_directions(is_always)?;
    let fail = Failure::of(&problem.file);
    let settings = &problem.resolved.settings;
    let (model, walk) = (problem.model(), settings.walk_options());
    let cells = cut(&problem.file, model, settings, &problem.goals)?;
    cells.check_variance(&walk).map_err(&fail)?;
    if args.out.extension().is_none_or(|e| e != "bin") {
        let message = "the name must end in .bin, for a compact table";
        return Err(Failure::of_out(&args.out, message));
    }
    let output = Output::open("--out", &args.out)?;
    let solved = Solved::new(&*cells).map_err(&fail)?;
    let tables = solved.system.tables(walk.pairs).map_err(&fail)?;
    output.finish(tables.to_bytes())?;
    Ok(Ended::Done)
}
