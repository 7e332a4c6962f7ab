#![doc = include_str!("../README.md")]

mod channels;
pub mod deck;
pub mod formula;
mod given;
pub mod kinds;
mod load;
mod model;
pub mod npz;
mod output;
#[cfg(feature = "parts")]
pub mod parts;
mod place;
mod points;
mod quantities;
pub mod scene;
mod section;
mod validate;
mod words;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

pub use fredholm::{Choices, Estimator, Form, GlobalQuantity, Method, Pairs, Scalar, Sequence};

pub use given::{GivenTable, Solution, given_dimension, last_digit};
pub use kinds::{KINDS, Kind, KindEntry};
pub use load::{MAX_BYTES, load, load_from, read_from_memory, utf8};
pub use model::{Resolution, Resolved};
pub use place::{InputError, Place, Placed, SetByFlag, Source};
pub use quantities::{Given, Precision, Uncertain};
use section::{Field, Section};

/// The largest number of cells accepted.
pub const MAX_CELLS: usize = 100_000_000;
/// The largest number of walks in one batch.
const MAX_BATCH: u64 = 1_000_000_000;
/// The most first states in which walks are not absorbed: more are no walk.
const MAX_FORCED_STEPS: u32 = 1000;
/// The largest seed: TOML has no larger integers.
const MAX_SEED: u64 = i64::MAX.unsigned_abs();
/// The largest number of points of a grid target.
const MAX_GRID: usize = 100_000;

/// All that a problem file says.
#[derive(Clone, Debug)]
pub struct ProblemFile {
    /// The section `[problem]`: what is to be solved.
    pub problem: Arc<dyn Kind>,
    /// The section `[galerkin]`.
    pub galerkin: Galerkin,
    /// The section `[walk]`.
    pub walk: Walk,
    /// The `[[target]]` tables, in the order of the file.
    pub targets: Vec<Target>,
    /// How well quantities are known, by their names: `[uncertainties]`.
    pub uncertainties: Vec<Uncertain>,
    /// The quantities that are looked for: `quantities` of `[fit]`.
    pub fit: Vec<Placed<String>>,
    /// The files of results, beside this file: `files` of `[output]`.
    pub files: Vec<Placed<String>>,
    /// Where targets stand, or should stand.
    targets_place: Place,
    /// Name and text of the file, for errors.
    source: Source,
}

/// The Galerkin scheme: `[galerkin]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Galerkin {
    /// The number of cells, for a cube of cells per axis; without one, the problem chooses.
    pub cells: Option<Placed<usize>>,
    /// The degree of the polynomials on a cell.
    pub degree: Placed<usize>,
    /// How the neighbour equation treats pairs of cells.
    pub pairs: Placed<Pairs>,
    /// The degree of the projection of F + T_K v that walks follow with h = k.
    pub lift: Option<Placed<usize>>,
    /// Quadrature points of a cell and axis; only where coefficients come from quadrature.
    pub points: Option<Placed<usize>>,
    /// How cells shrink towards the corners of a room.
    pub grading: Option<Placed<f64>>,
    /// Whether the walls of a room are cut at the edges of shadows too.
    pub shadow_cuts: Option<Placed<bool>>,
}

/// The random walks: `[walk]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// The method; without one, walks of the chain.
    pub method: Option<Placed<Method>>,
    /// The number of walks for each target.
    pub walks: Placed<u64>,
    /// q0, the probability that a walk is absorbed in a state; without one, walks end by roulette.
    pub absorption: Option<Placed<f64>>,
    /// The estimator: what a walk with constant absorption scores.
    pub estimator: Placed<Estimator>,
    /// The form of the control variate.
    pub form: Placed<Form>,
    /// The numbers that walks draw.
    pub sequence: Placed<Sequence>,
    /// The number of first states in which walks are not absorbed.
    pub forced_steps: Placed<u32>,
    /// Whether the last step of walks leads to the light.
    pub last_step: Option<Placed<bool>>,
    /// Whether walks go from the sources to the receivers.
    pub adjoint: Option<Placed<bool>>,
    /// Whether the derivatives of the targets are wanted, too.
    pub sensitivities: Placed<bool>,
    /// The floating-point type of the walks.
    pub scalar: Placed<Scalar>,
    /// The seed of the random numbers.
    pub seed: Placed<u64>,
    /// The number of walks in one batch.
    pub batch: Placed<u64>,
    /// The error at which to stop early.
    pub target_error: Option<Placed<f64>>,
    /// Whether all targets are answered from one set of walks.
    pub global: Option<Placed<bool>>,
    /// Whether `target_error` is relative to the value.
    pub relative: Placed<bool>,
    /// Whether walks of infinite variance are wanted: a flag of the command line alone.
    pub allow_infinite_variance: bool,
}

/// One number, or one curve, to compute: `[[target]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The name of the target in results.
    pub name: Placed<String>,
    /// The number of the unknown function, from 1, of a system.
    pub component: Option<Placed<usize>>,
    /// The quantity that is asked for there, if it is not u.
    pub ask: Option<Placed<GlobalQuantity>>,
    /// The surface by which molecules enter, of a transmission.
    pub from: Option<Placed<String>>,
    /// The functional that is computed.
    pub what: What,
    /// What it was measured as.
    pub measured: Option<Given>,
}

/// A quantity that a target computes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum What {
    /// The solution at this angle, or this point.
    At(Placed<Vec<Placed<f64>>>),
    /// The solution at the points of this CSV file.
    Listed(Placed<String>),
    /// The mean of the solution over the space.
    OverAll,
    /// The mean of the solution from one angle to another.
    Over(Placed<f64>, Placed<f64>),
    /// The solution at so many equally spaced angles, points of [0, 1], or points along a surface.
    Grid(Placed<usize>, Option<Placed<String>>),
    /// The solution at so many equally spaced points of every axis.
    Lattice(Placed<Vec<Placed<usize>>>),
    /// The solution on a surface, at this part of its length.
    On(Placed<String>, Placed<f64>),
    /// The solution on a surface, at this point of space.
    Spot(Placed<String>, Placed<Vec<Placed<f64>>>),
    /// The irradiance at this point of space of what faces in this direction.
    Facing(Placed<Vec<Placed<f64>>>, Placed<Vec<Placed<f64>>>),
    /// The mean of the solution over a surface.
    OverSurface(Placed<String>),
    /// The mean of the solution over several surfaces.
    OverSurfaces(Placed<Vec<Placed<String>>>),
    /// The integral of the solution times this formula.
    Weight(Placed<String>),
}

impl ProblemFile {
    /// Remarks on values that are allowed and hardly meant, one line each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        self.problem.remarks(self)
    }

    /// A path that stands in the file, which means it from the file's own folder.
    pub fn beside(&self, path: &Path) -> PathBuf {
        let folder = Path::new(&self.source.name).parent();
        folder.map_or_else(|| path.to_owned(), |folder| folder.join(path))
    }
}

/// Reads the problem file `name` with the content `text`.
///
/// Ranges are not looked at: call [`ProblemFile::validate`] once the flags of
/// the command line have replaced what they replace.
pub fn read(name: &str, text: &str) -> Result<ProblemFile, InputError> {
    let source = Source {
        name: name.to_owned(),
        text: text.to_owned(),
    };
    let tree = DeTable::parse(text).map_err(|error| {
        if name.to_lowercase().ends_with(".vs2") {
            return InputError::new(format_args!(
                "{name} is a View2D deck and no problem file: see `fredholm factors {name}`, or name it in a problem \
                 file with `kind = \"room\"`, `deck = …`"
            ));
        }
        if scene::is_mesh(Path::new(name)) {
            return InputError::new(format_args!(
                "{name} is a scene in space and no problem file: see `fredholm factors {name}`"
            ));
        }
        let span = error.span().unwrap_or(0..0);
        source.error(span, format_args!("not valid TOML: {}", error.message()))
    })?;
    let mut root = Section::new(&source, "at the top level", 0..0, tree.into_inner());
    let problem = root.required("problem")?;
    let galerkin = root.section("galerkin", "in `[galerkin]`")?;
    let walk = root.section("walk", "in `[walk]`")?;
    let targets = root.optional("target");
    let output = root.section("output", "in `[output]`")?;
    let uncertainties = root.read("uncertainties", quantities::read_uncertainties)?;
    let fit = root.section("fit", "in `[fit]`")?;
    root.finish()?;

    let targets_span = match &targets {
        Some(field) => field.span.clone(),
        None => text.len()..text.len(),
    };
    let problem = kinds::read(problem.section("in `[problem]`")?)?;
    let galerkin = read_galerkin(galerkin)?;
    let walk = read_walk(walk)?;
    let mut targets = match targets {
        Some(field) => field.tables("in `[[target]]`", read_target)?,
        None => Vec::new(),
    };
    let files = output::read(output, &mut targets)?;
    let fit = quantities::read_fit(fit)?;
    Ok(ProblemFile {
        problem,
        galerkin,
        walk,
        targets,
        uncertainties: uncertainties.unwrap_or_default(),
        fit,
        targets_place: Place::File(targets_span),
        files,
        source,
    })
}

/// Reads `[galerkin]`.
fn read_galerkin(mut section: Section<'_, '_>) -> Result<Galerkin, InputError> {
    let galerkin = Galerkin {
        cells: section.read("cells", Field::integer)?,
        degree: section.read_or("degree", Field::integer, 0)?,
        pairs: section.read_or("pairs", Field::word, Pairs::Default)?,
        lift: section.read("lift", Field::integer)?,
        points: section.read("points", Field::integer)?,
        grading: section.read("grading", Field::number)?,
        shadow_cuts: section.read("shadow_cuts", Field::boolean)?,
    };
    section.finish()?;
    Ok(galerkin)
}

/// Reads `[walk]`.
fn read_walk(mut section: Section<'_, '_>) -> Result<Walk, InputError> {
    let walk = Walk {
        method: section.read("method", Field::word)?,
        walks: section.read_or("walks", Field::integer, 100_000)?,
        absorption: section.read("absorption", Field::number)?,
        estimator: section.read_or("estimator", Field::word, Estimator::Collision)?,
        form: section.read_or("form", Field::word, fredholm::Settings::FORM)?,
        sequence: section.read_or("sequence", Field::word, Sequence::Random)?,
        forced_steps: section.read_or("forced_steps", Field::integer, 0)?,
        last_step: section.read("last_step", Field::boolean)?,
        adjoint: section.read("adjoint", Field::boolean)?,
        sensitivities: section.read_or("sensitivities", Field::boolean, false)?,
        scalar: section.read_or("scalar", Field::word, Scalar::F64)?,
        seed: section.read_or("seed", Field::integer, 1)?,
        batch: section.read_or("batch", Field::integer, 4096)?,
        target_error: section.read("target_error", Field::number)?,
        relative: section.read_or("relative", Field::boolean, false)?,
        global: section.read("global", Field::boolean)?,
        allow_infinite_variance: false,
    };
    section.finish()?;
    Ok(walk)
}

/// Reads one `[[target]]`.
fn read_target(mut section: Section<'_, '_>) -> Result<Target, InputError> {
    let name = section.optional("name");
    let mut chosen = ["at", "over", "weight", "grid"]
        .into_iter()
        .filter_map(|key| section.optional(key))
        .collect::<Vec<_>>();
    let surface = section.optional("surface");
    let measured = section.optional("measured");
    let component = section.read("component", Field::integer)?;
    let ask = section.read("ask", Field::word)?;
    let from = section.optional("from");
    section.finish()?;
    let is_passed = ask
        .as_ref()
        .filter(|own| own.value == GlobalQuantity::Transmission);
    match (&from, is_passed) {
        (Some(key), None) => {
            return Err(
                key.unsuited("`from` names where molecules enter, of `ask = \"transmission\"`")
            );
        }
        (None, Some(_)) => {
            return Err(section.error(
                "a transmission is from one surface to another: give `from` and `over`, their names",
            ));
        }
        _ => {}
    }
    let from = from.as_ref().map(Field::string).transpose()?;
    let name = name.as_ref().map(Field::string).transpose()?;
    let measured_key = measured.as_ref().map(|field| field.key.clone());
    let measured = measured.map(quantities::read_measured).transpose()?;

    // The tree is sorted by key; the reader of the file meets them in its order.
    chosen.sort_by_key(|field| field.key.start);
    let mut chosen = chosen.into_iter();
    let Some(first) = chosen.next() else {
        return Err(section.error(format_args!(
            "{} does not say what to compute: give one of \
             `at = …` (an angle, a point of the cube, a place on a surface, the name of a CSV file of these), \
             `over = \"all\"`, `over = [from, to]` (circle), `over = \"surface\"` (room, scene), \
             `weight = \"…\"` (cube), `grid = points`",
            name.map_or_else(|| "this target".to_owned(), |name| format!("target {:?}", name.value))
        )));
    };
    let name = name.unwrap_or_else(|| first.written());
    if let Some(second) = chosen.next() {
        return Err(section.source.error(
            second.key.clone(),
            format_args!(
                "target {:?} has both `{}` and `{}`: give one; \
                 a second question is a second `[[target]]`",
                name.value, first.name, second.name
            ),
        ));
    }
    let what = match first.name.as_str() {
        "at" => read_at(first)?,
        "over" => read_over(first)?,
        "weight" => What::Weight(first.string()?),
        _ if matches!(first.value, DeValue::Array(_)) => What::Lattice(first.integers()?),
        _ => {
            let surface = surface.as_ref().map(Field::string).transpose()?;
            What::Grid(first.integer()?, surface)
        }
    };
    if let Some(surface) = surface.filter(|_| !matches!(what, What::Grid(..))) {
        let message = "`surface` belongs to `grid`; elsewhere write `over = \"name\"`, \
                       or `at = { surface = \"name\", t = 0.5 }`";
        return Err(section.source.error(surface.key.clone(), message));
    }
    let is_one = !matches!(what, What::Listed(_) | What::Grid(..) | What::Lattice(_));
    if let Some(key) = measured_key.filter(|_| !is_one) {
        let message = "a measurement is of one number: give a `[[target]]` of its own for each";
        return Err(section.source.error(key, message));
    }
    Ok(Target {
        name,
        component,
        ask,
        from,
        what,
        measured,
    })
}

/// Reads `at`: an angle, a point, a place on a surface, or a file of points.
fn read_at(field: Field<'_, '_>) -> Result<What, InputError> {
    if matches!(field.value, DeValue::String(_)) {
        return Ok(What::Listed(field.string()?));
    }
    if !matches!(field.value, DeValue::Table(_)) {
        return Ok(What::At(field.numbers()?));
    }
    let mut section = field.section("in `at`")?;
    if let Some(facing) = section.optional("facing") {
        let point = section.required("point")?.numbers()?;
        let facing = facing.numbers()?;
        section.finish()?;
        return Ok(What::Facing(point, facing));
    }
    let surface = section.required("surface")?.string()?;
    let point = section.optional("point");
    if let Some(point) = point {
        section.finish()?;
        return Ok(What::Spot(surface, point.numbers()?));
    }
    let t = section.required("t")?.number()?;
    section.finish()?;
    Ok(What::On(surface, t))
}

/// Reads `over`: everything, or from one angle to another.
fn read_over(field: Field<'_, '_>) -> Result<What, InputError> {
    match &field.value {
        DeValue::String(word) if word == "all" => return Ok(What::OverAll),
        DeValue::String(_) => return Ok(What::OverSurface(field.string()?)),
        DeValue::Array(array) if array.iter().any(|item| item.get_ref().is_str()) => {
            return Ok(What::OverSurfaces(field.strings()?));
        }
        DeValue::Array(_) => {
            if let [from, to] = field.numbers()?.value.as_slice() {
                return Ok(What::Over(from.clone(), to.clone()));
            }
        }
        _ => {}
    }
    Err(field.error(
        "`over` must be \"all\", two angles `[from, to]` (circle), or the name of a surface, or an array of such \
         names (room)",
    ))
}
