//! The library `fredholm` in a web page: names of files in memory go in, reports come out as JSON. Pages, pictures and the worker
//! are JavaScript's, in `page`.

mod residual;
mod scene;
mod watch;

use core::fmt::Display;
use std::path::Path;

use fredholm::report::Columns;
use fredholm::room::FieldRequest;
use fredholm::scene::Beside;
use fredholm::{Pairs, SolveError, Solver, StopReason, WalkOptions};
use fredholm_file::{MAX_BYTES, ProblemFile, Resolution, Resolved};
use js_sys::{Function, Uint8Array};
use serde::Serialize;
use serde_json::{Value, json};
use wasm_bindgen::prelude::*;

use watch::Watch;

pub use residual::residual;
pub use scene::{faces, factors};

/// An error of JavaScript with the words of one of ours.
fn wrong(error: impl Display) -> JsError {
    JsError::new(&error.to_string())
}

/// What JavaScript parses.
fn json_of(value: &impl Serialize) -> Result<String, JsError> {
    serde_json::to_string(value).map_err(wrong)
}

/// Lets the library read these files, by their names, and no others.
#[wasm_bindgen]
pub fn put_files(names: Vec<String>, contents: Vec<Uint8Array>) {
    let files = names.into_iter().zip(contents);
    let files = files.map(|(name, content)| (name.into(), content.to_vec()));
    fredholm_file::read_from_memory(files.collect());
}

/// The content of a TOML file as JSON.
///
/// # Errors
/// It is no TOML.
#[wasm_bindgen]
pub fn tree(text: &str) -> Result<String, JsError> {
    let tree: Value = toml::from_str(text).map_err(wrong)?;
    json_of(&tree)
}

/// The text of a file in memory.
fn text_of(name: &str) -> Result<String, JsError> {
    let bytes = fredholm_file::load(Path::new(name), MAX_BYTES).map_err(wrong)?;
    fredholm_file::utf8(name, bytes).map_err(wrong)
}

/// A problem file in memory, and what it comes to.
struct Opened {
    file: ProblemFile,
    resolved: Resolved,
}

impl Opened {
    fn new(name: &str) -> Result<Self, JsError> {
        let file = fredholm_file::read(name, &text_of(name)?).map_err(wrong)?;
        file.validate().map_err(wrong)?;
        let resolved = file.resolve().map_err(wrong)?;
        Ok(Self { file, resolved })
    }

    /// What the program says on stderr before it walks.
    fn said(&self) -> Vec<String> {
        let (remarks, notes) = (self.file.remarks(), self.resolved.model.model().notes());
        let remarks = remarks.iter().map(|remark| format!("warning: {remark}"));
        let notes = notes.iter().map(|note| format!("note: {note}"));
        remarks.chain(notes).collect()
    }

    fn explained(&self, error: &fredholm::Error) -> JsError {
        wrong(self.file.explain(error))
    }
}

/// What the program prints as JSON.
fn pretty(report: &impl Serialize) -> Result<String, JsError> {
    let text = serde_json::to_string_pretty(report).map_err(wrong)?;
    Ok(text + "\n")
}

/// An answer: how it ended, what the program prints, and the numbers behind that.
fn answer(
    outcome: StopReason,
    [json, table]: [String; 2],
    said: Vec<String>,
    columns: Columns,
) -> Result<String, JsError> {
    let of_targets = columns.of_targets.into_iter();
    let of_targets: serde_json::Map<_, _> = of_targets
        .map(|(name, numbers)| (name.to_owned(), json!(numbers)))
        .collect();
    json_of(&json!({
        "stop": format!("{outcome:?}"),
        "json": json,
        "table": table,
        "said": said,
        "columns": {
            "names": columns.names,
            "coordinates": columns.coordinates,
            "mesh": columns.mesh,
            "of_targets": of_targets,
        },
    }))
}

/// Solves a problem file. `progress` is called with the walks so far and those expected, and ends the walks by returning true. What comes is
/// JSON; nothing if it was ended before the walks.
///
/// # Errors
/// What the program would say.
#[wasm_bindgen]
pub fn solve(name: &str, progress: Function) -> Result<Option<String>, JsError> {
    let opened = Opened::new(name)?;
    let Resolved {
        model,
        targets,
        settings,
    } = &opened.resolved;
    let watch = Watch::new(progress);
    if settings.tolerance.is_none() {
        let walks = settings.walk_options().walks;
        watch.expect(walks.saturating_mul(targets.len() as u64));
    }
    let model = model.model();
    let solver = Solver::with(model, settings.clone(), targets.clone()).observer(&watch);
    let mut said = opened.said();
    let mut remark = |remarks: Vec<String>| {
        said.extend(remarks.iter().map(|remark| format!("warning: {remark}")));
    };
    if settings.global == Some(true) {
        let whole = match solver.whole() {
            Ok(whole) => whole,
            Err(SolveError::Cancelled(_)) => return Ok(None),
            Err(SolveError::Failed(error)) => return Err(opened.explained(&error)),
            Err(error) => return Err(wrong(error)),
        };
        let goals = fredholm::goals(model, targets).map_err(|e| opened.explained(&e))?;
        let report = whole.report(&goals).map_err(|e| opened.explained(&e))?;
        remark(report.summary.remarks());
        let printed = [pretty(&report)?, report.table()];
        return answer(report.summary.stop, printed, said, report.columns()).map(Some);
    }
    let report = match solver.solve() {
        Ok(report) => report,
        Err(SolveError::NotReached(report) | SolveError::Cancelled(Some(report))) => *report,
        Err(SolveError::Cancelled(None)) => return Ok(None),
        Err(SolveError::Failed(error)) => return Err(opened.explained(&error)),
        Err(error) => return Err(wrong(error)),
    };
    remark(report.remarks());
    let printed = [pretty(&report)?, report.table()];
    answer(report.stop, printed, said, report.columns()).map(Some)
}

/// The mean radiosity in view at positions between the walls of a room, x and y of one after the other, from so many walks for each: value and
/// standard error of one after the other, which are no numbers outside of the room. Nothing comes if it was ended.
///
/// # Errors
/// What the program would say.
#[wasm_bindgen]
pub fn field(
    name: &str,
    positions: &[f64],
    walks: u32,
    progress: Function,
) -> Result<Option<Vec<f64>>, JsError> {
    let opened = Opened::new(name)?;
    let Resolution::Room(room) = &opened.resolved.model else {
        return Err(JsError::new("this picture is of rooms: `kind = \"room\"`"));
    };
    let settings = &opened.resolved.settings;
    let walk = WalkOptions {
        walks: u64::from(walks),
        // As in the program's pictures: no rare large scores, which would be dots.
        pairs: Pairs::Pointwise,
        ..settings.walk_options()
    };
    let (positions, _) = positions.as_chunks::<2>();
    let request = FieldRequest {
        positions,
        stretches: &[],
        walk: &walk,
        beside: Beside::Nothing,
    };
    let watch = Watch::new(progress);
    watch.expect(walk.walks.saturating_mul(positions.len() as u64));
    match room.field(&settings.discretisation(), &request, &watch, &|| ()) {
        Ok((field, _)) => {
            let all = field.air.iter();
            Ok(Some(
                all.flat_map(|spot| [spot.value, spot.error]).collect(),
            ))
        }
        Err(fredholm::Error::Cancelled) => Ok(None),
        Err(error) => Err(opened.explained(&error)),
    }
}
