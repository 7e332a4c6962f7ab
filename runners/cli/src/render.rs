//! `fredholm render`: a picture of a room with its light, or of a scene as a camera sees it.

mod output;
mod profile;
mod room;
mod view;

use std::path::Path;

use fredholm::choice::choose;
use fredholm::scene::Beside;
use fredholm::{Error, Settings, WalkOptions};
use fredholm_file::Resolution;
use fredholm_file::parts::output::Output;
use fredholm_plot::Figure;

use crate::args::RenderArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::progress::{Progress, Signals};
use crate::solve::{self, Problem};
use crate::threads::with_threads;

pub(crate) use room::shares;

/// Walks of a global estimate, for all pixels together.
const WHOLE_WALKS: u64 = 8192;

/// What is wanted beside a picture.
const fn beside(args: &RenderArgs) -> Beside {
    match args.side_by_side {
        true => Beside::PlainAsLong,
        false => Beside::Nothing,
    }
}

/// The formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Png,
    Svg,
    Csv,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        let known = [("png", Self::Png), ("svg", Self::Svg), ("csv", Self::Csv)];
        let extension = path.extension().unwrap_or_default();
        let mut all = known.into_iter();
        let found = all.find(|(name, _)| extension.eq_ignore_ascii_case(name));
        found.map(|(_, format)| format).ok_or_else(|| {
            let message =
                "the name must end in .png or .svg for a picture, or in .csv for its numbers";
            Failure::of_out(path, message)
        })
    }

    /// The bytes of the file.
    fn encoded(self, drawn: Drawn) -> Result<Vec<u8>, Failure> {
        match drawn {
            Drawn::Table(table) => Ok(table),
            Drawn::Figure(figure) if self == Self::Svg => {
                figure.svg().map(String::into_bytes).map_err(Failure::run)
            }
            Drawn::Figure(figure) => figure.png().map_err(Failure::run),
        }
    }
}

/// Runs `render`.
pub(crate) fn render(args: &RenderArgs, signals: &Signals) -> Result<Ended, Failure> {
    let format = Format::of(&args.out)?;
    if format == Format::Csv && (args.side_by_side || args.log || args.range.is_some()) {
        return Err(Failure::input(
            "`--log`, `--range` and `--side-by-side` are for pictures: write a .png or .svg",
        ));
    }
    if let Some([low, _]) = args.range.filter(|[low, _]| args.log && *low <= 0.0) {
        return Err(Failure::input(format_args!(
            "`--range`: with `--log` colours must begin above 0, not at {low}"
        )));
    }
    let file = solve::read(&args.file, |_| ())?;
    file.refuse_adjoint()?;
    let mut problem = Problem::new(file, None)?;
    refuse(args, &problem.resolved.model)?;
    if args.global {
        choose_cells(args, &mut problem, signals)?;
    }
    let settings = &problem.resolved.settings;
    let cells = solve::cut(&problem.file, problem.model(), settings, &problem.goals)?;
    let walk = settings.walk_options();
    cells
        .check_variance(&walk)
        .map_err(Failure::of(&problem.file))?;
    let output = Output::open("--out", &args.out)?;
    let errors = match &args.errors {
        Some(path) => Some((Format::of(path)?, Output::open("--out", path)?)),
        None => None,
    };
    if matches!(errors, Some((Format::Csv, _))) {
        return Err(Failure::input(
            "`--errors` is a picture: write a .png or .svg",
        ));
    }
    let picturing = Picturing {
        args,
        problem: &problem,
        signals,
        format,
    };
    let work = || match &problem.resolved.model {
        Resolution::Room(room) if args.profile => profile::content(&picturing, room, &*cells),
        Resolution::Room(room) => room::content(&picturing, room, &*cells),
        Resolution::Scene(scene) => view::content(&picturing, scene, &*cells),
        Resolution::Other(_) => Err(Failure::input("pictures are of rooms and scenes").into()),
    };
    let content = match with_threads(args.common.threads, work)? {
        Ok(content) => content,
        Err(Cut::Interrupted) => {
            say("warning: interrupted; no picture was written");
            return Ok(Ended::Interrupted);
        }
        Err(Cut::Failed(failure)) => return Err(failure),
    };
    output.finish(format.encoded(content.drawn)?)?;
    if let Some(((format, output), figure)) = errors.zip(content.errors) {
        output.finish(format.encoded(Drawn::Figure(Box::new(figure)))?)?;
    }
    print(content.text)?;
    Ok(Ended::Done)
}

/// Chooses the cells and the degree of a global estimate that the file leaves open, as `solve --global` does.
fn choose_cells(
    args: &RenderArgs,
    problem: &mut Problem,
    signals: &Signals,
) -> Result<(), Failure> {
    let own = &problem.resolved.settings;
    let settings = Settings {
        global: Some(true),
        walks: Some(args.walks.unwrap_or(WHOLE_WALKS)),
        tolerance: None,
        ..own.clone()
    };
    let progress = Progress::new(u64::MAX, signals);
    let chosen = choose(problem.model(), &[], &settings, &progress);
    let chosen = chosen.map(|chosen| chosen.map(|chosen| chosen.settings));
    if let Some(chosen) = chosen.map_err(Failure::of(&problem.file))? {
        problem.resolved.settings = Settings {
            cells: chosen.cells,
            degree: chosen.degree,
            ..own.clone()
        };
    }
    Ok(())
}

/// Refuses options of the other kind, and models of which there are no pictures.
fn refuse(args: &RenderArgs, model: &Resolution) -> Result<(), Failure> {
    let of_scenes = args.height.is_some() || args.angle.is_some();
    let message = match model {
        Resolution::Room(_) if of_scenes || args.from.or(args.towards).is_some() => {
            "`--height`, `--from`, `--towards` and `--angle` are for cameras: a room in the plane is seen from above"
        }
        Resolution::Scene(_)
            if args.global || args.profile || args.targets || args.radiant_temperature =>
        {
            "`--global`, `--profile`, `--targets` and `--radiant-temperature` are for rooms in the plane: `kind = \"room\"`"
        }
        Resolution::Room(room) if args.profile && room.colours().is_some() => {
            "`--profile` has one channel: ask for targets along a surface, a `grid`, which have all"
        }
        Resolution::Other(_) => {
            "pictures are of rooms and scenes; the profile of a circle or of a cube is a target with a `grid`, and \
             `solve --out` draws it"
        }
        _ => return Ok(()),
    };
    Err(Failure::input(format_args!(
        "{}: {message}",
        args.file.display()
    )))
}

/// Why there is no picture.
#[derive(Debug)]
enum Cut {
    /// Ctrl-C.
    Interrupted,
    /// Something failed.
    Failed(Failure),
}

impl From<Failure> for Cut {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// What goes into a file.
enum Drawn {
    Figure(Box<Figure>),
    Table(Vec<u8>),
}

/// What goes into the files, and what is said of them.
struct Content {
    drawn: Drawn,
    /// The standard errors.
    errors: Option<Figure>,
    text: String,
}

/// What is asked for.
struct Picturing<'a> {
    args: &'a RenderArgs,
    problem: &'a Problem,
    signals: &'a Signals,
    format: Format,
}

impl Picturing<'_> {
    /// The settings of so many walks for each place, if nothing else is asked for, or of a global estimate.
    fn walk(&self, each: u64) -> WalkOptions {
        let default = if self.args.global { WHOLE_WALKS } else { each };
        WalkOptions {
            walks: self.args.walks.unwrap_or(default),
            ..self.problem.resolved.settings.walk_options()
        }
    }

    /// The progress of these walks for each of so many places.
    fn progress(&self, walk: &WalkOptions, places: u64) -> Progress<'_> {
        let places = if self.args.global { 1 } else { places };
        Progress::new(walk.walks.saturating_mul(places), self.signals)
    }

    /// What was wrong, unless it was interrupted.
    fn cut(&self, error: Error) -> Cut {
        match error {
            Error::Cancelled => Cut::Interrupted,
            error => Cut::Failed(Failure::of(&self.problem.file)(error)),
        }
    }
}
