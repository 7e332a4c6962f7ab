//! `fredholm faces`: a quantity on every face of a scene.

use fredholm::report::{Columns, FacesReport};
use fredholm::scene::FacesRequest;
use fredholm::{Error, SceneModel};
use fredholm_file::{Place, Placed, SetByFlag as _, Target, What};
use fredholm_plot::Figure;

use crate::args::FacesArgs;
use crate::failure::{Ended, Failure, print};
use crate::file::Resolution;
use crate::progress::{Progress, Signals};
use crate::results::{self, Format, Results};
use crate::solve::{Problem, read};
use crate::table;
use crate::threads::with_threads;

/// Walks of a face where nothing is said, and the first ones where an error is asked for.
const WALKS: [u64; 2] = [256, 32];

/// Runs `faces`.
pub(crate) fn faces(args: &FacesArgs, signals: &Signals) -> Result<Ended, Failure> {
    let file = read(&args.file, |file| {
        args.walks.set(&mut file.walk);
        file.galerkin.cells.set_by("--cells", args.cells);
        // Every face is asked for, whatever the file asks for.
        file.targets = vec![Target {
            name: Placed {
                value: "all".to_owned(),
                place: Place::Default,
            },
            component: None,
            ask: None,
            from: None,
            what: What::OverAll,
            measured: None,
        }];
    })?;
    let mut problem = Problem::new(file, None)?;
    let settings = &mut problem.resolved.settings;
    let is_asked = settings.tolerance.is_some();
    settings.walks = settings.walks.or(Some(WALKS[usize::from(is_asked)]));
    let Resolution::Scene(model) = &problem.resolved.model else {
        return Err(Failure::input(format_args!(
            "{}: faces are those of scenes, `kind = \"scene\"` or `\"vacuum\"`",
            args.file.display()
        )));
    };
    let outs = args.out.iter();
    let outs = outs.map(|path| Format::open_of(path, &problem, true));
    let outs = outs.collect::<Result<Vec<_>, _>>()?;
    let found = with_threads(args.common.threads, || {
        on_faces(args, &problem, model, signals)
    })?;
    let Some(report) = problem.unless_interrupted(found)? else {
        return Ok(Ended::Interrupted);
    };
    results::finish(outs, &report)?;
    print(match args.common.json {
        true => table::json(&report)?,
        false => report.table(),
    })?;
    let errors = report.std_errors.iter().copied().fold(0.0, f64::max);
    Ok(match report.target_error {
        Some(bound) if errors > bound => Ended::ErrorNotReached,
        _ => Ended::Done,
    })
}

fn on_faces(
    args: &FacesArgs,
    problem: &Problem,
    model: &SceneModel,
    signals: &Signals,
) -> Result<FacesReport, Error> {
    let settings = &problem.resolved.settings;
    let walk = settings.walk_options();
    let progress = Progress::of_each(model.scene().faces().len(), &walk, signals);
    let request = FacesRequest {
        quantity: args.ask,
        walk: &walk,
        is_plain: settings.cells.is_none(),
    };
    let found = model.on_faces(&settings.discretisation(), &request, &progress);
    progress.done();
    Ok(FacesReport::new(model, args.ask, &found?))
}

impl Results for FacesReport {
    fn csv(&self) -> Result<String, Error> {
        Self::csv(self)
    }

    fn svg(&self, _: &str) -> Result<Figure, Failure> {
        Err(Failure::run("faces are no grid"))
    }

    fn columns(&self) -> Columns {
        Self::columns(self)
    }

    fn table(&self) -> String {
        Self::table(self)
    }

    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}
