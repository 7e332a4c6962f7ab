//! `fredholm certify`: how wrong a solution is that somebody else has found.

mod arrays;
mod factors;

use std::path::Path;

use fredholm::report::Coordinates;
use fredholm::{Certificate, CertifiedValue, Field, SolveError, Solver, StopReason, Verdict};
use fredholm_file::parts::output::Output;
use fredholm_file::{GivenTable, given_dimension};
use fredholm_plot::{Axis, GridCurve, GridPoint};

use crate::args::CertifyArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::progress::{Progress, Signals};
use crate::solve::{Problem, read};
use crate::table;
use crate::threads::with_threads;

/// The normal quantile that a picture multiplies standard errors by.
const QUANTILE: f64 = 1.96;

/// The kinds of result files.
#[derive(Clone, Copy, Debug)]
enum Format {
    Json,
    Csv,
    Svg,
}

impl Format {
    /// What to write where, known to be possible before any work is done.
    fn open(path: &Path) -> Result<(Self, Output), Failure> {
        let format = match path.extension().and_then(|e| e.to_str()) {
            Some("json") => Self::Json,
            Some("csv") => Self::Csv,
            Some("svg") => Self::Svg,
            _ => {
                return Err(Failure::of_out(
                    path,
                    "the name must end in .json, .csv or .svg",
                ));
            }
        };
        Ok((format, Output::open("--out", path)?))
    }

    fn content(self, certificate: &Certificate) -> Result<String, Failure> {
        match self {
            Self::Json => table::json(certificate),
            Self::Csv => certificate.csv().map_err(Failure::run),
            Self::Svg => svg(certificate),
        }
    }
}

/// Runs `certify`.
pub(crate) fn certify(args: &CertifyArgs, signals: &Signals) -> Result<Ended, Failure> {
    if let Some(given) = &args.factors {
        return factors::certify(args, given);
    }
    let mut file = read(&args.file, |file| {
        args.walk.replace(&mut file.walk);
    })?;
    let output = args.out.as_deref().map(Format::open).transpose()?;
    let limit = args.walk.limit()?;
    let is_table = |text: &String| {
        let path = Path::new(text);
        let is_csv = |ending: &std::ffi::OsStr| ending.eq_ignore_ascii_case("csv");
        path.exists() || arrays::is_read(path) || path.extension().is_some_and(is_csv)
    };
    let values = match args.with.as_slice() {
        [path] if is_table(path) => {
            let model = file.resolve()?.model;
            let (model, path) = (model.model(), Path::new(path));
            let given = match arrays::is_read(path) {
                true => {
                    let table = arrays::table(path, given_dimension(model))?;
                    let given = file.given_rows(model, &path.display().to_string(), table.text)?;
                    GivenTable {
                        rounding: table.rounding,
                        ..given
                    }
                }
                false => file.given_table(model, path)?,
            };
            file.targets = given.targets;
            file.validate()?;
            Some((given.values, given.rounding))
        }
        _ => None,
    };
    let problem = Problem::new(file, limit)?;
    let (model, settings) = (problem.model(), &problem.resolved.settings);
    let functions = match values {
        Some(_) => Vec::new(),
        None => problem.file.given_formulas(model, &args.with)?,
    };
    let functions: Vec<&Field> = functions.iter().map(|own| &**own).collect();
    let progress = Progress::new(settings.walk_options().walks, signals);
    progress.say("setting up".to_owned());
    let targets = problem.resolved.targets.clone();
    let solver = Solver::with(model, settings.clone(), targets).observer(&progress);
    let certified = with_threads(args.common.threads, || match &values {
        Some((values, rounding)) => solver.certify_values(values, *rounding),
        None => solver.certify_all(&functions),
    })?;
    progress.done();
    let certificate = match certified {
        Ok(certificate) => certificate,
        Err(SolveError::Cancelled(_)) => {
            say("warning: interrupted");
            return Ok(Ended::Interrupted);
        }
        Err(SolveError::Failed(error)) => return Err(Failure::of(&problem.file)(error)),
        Err(error) => return Err(Failure::run(error)),
    };
    let written = match output {
        Some((format, output)) => Ok(output.finish(format.content(&certificate)?)?),
        None => Ok(()),
    };
    print(if args.common.json {
        table::json(&certificate)?
    } else {
        certificate.table()
    })?;
    for remark in certificate.report.remarks() {
        say(format_args!("warning: {remark}"));
    }
    let stop = certificate.report.stop;
    crate::solve::say_stop(stop, ": the bands are wider");
    written.map(|()| match (certificate.verdict, stop) {
        (Verdict::Wrong, _) => Ended::Disagrees,
        (_, StopReason::ToleranceNotReached) => Ended::ErrorNotReached,
        _ => Ended::Done,
    })
}

/// The errors of points along the only coordinate with their band.
fn svg(certificate: &Certificate) -> Result<String, Failure> {
    let abscissa = |value: &CertifiedValue| match &value.at {
        Some(Coordinates::Many(x)) if x.len() == 1 => x.first().copied(),
        _ => None,
    };
    let point = |value: &CertifiedValue| {
        Some(GridPoint {
            at: abscissa(value)?,
            value: value.error?,
            std_error: value.band? / QUANTILE,
            known: f64::NAN,
            exact: None,
        })
    };
    let mut points: Vec<GridPoint> = certificate.values.iter().filter_map(point).collect();
    points.sort_by(|a, b| a.at.total_cmp(&b.at));
    if points.is_empty() {
        return Err(Failure::input(
            "`--out`: a picture shows errors along one coordinate: write .csv or .json",
        ));
    }
    let curve = GridCurve {
        name: "error of the given solution, with the band of all points",
        axis: match certificate.report.problem {
            "circle" => Axis::Angle,
            _ => Axis::Coordinate,
        },
        points,
        values: "given minus u",
        band: "band of all points together",
        known: "",
    };
    table::drawn(curve.draw_differences())
}
