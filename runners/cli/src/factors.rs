//! `fredholm factors`: form factors between the surfaces of a room.

use std::io::Write;

use fredholm::Scalar;
use fredholm_room::{Scene, factors as form_factors};
use serde::Serialize;

use crate::args::FactorsArgs;
use crate::deck::{self, Deck};
use crate::failure::{Ended, Failure};
use crate::file::{self, ProblemFile};
use crate::numbers::aligned;
use crate::solve;

/// Bytes of a form factor: twice as a number, and as text.
const PAIR: usize = 48;

/// Everything that `factors --json` prints.
#[derive(Debug, Serialize)]
pub(crate) struct Factors {
    pub(crate) surfaces: Vec<String>,
    /// Row I: of the energy that leaves surface I, the share that arrives at each.
    pub(crate) factors: Vec<Vec<f64>>,
}

/// Runs `factors`.
pub(crate) fn factors(args: &FactorsArgs) -> Result<Ended, Failure> {
    let is_deck = args
        .file
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("vs2"));
    let factors = if is_deck {
        of_deck(&deck::read(&args.file)?)?
    } else {
        let file = solve::read(&args.file, |_| ())?;
        of_file(&args.file.display().to_string(), &file)?
    };
    let text = if args.json {
        let mut text = serde_json::to_string_pretty(&factors).map_err(Failure::run)?;
        text.push('\n');
        text
    } else {
        factors.text()
    };
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes())?;
    stdout.flush()?;
    Ok(Ended::Done)
}

/// The form factors of a deck.
pub(crate) fn of_deck(deck: &Deck) -> Result<Factors, Failure> {
    let surfaces = deck.surfaces();
    refuse_beyond_memory(surfaces.names.len())?;
    let scene = surfaces.scene::<f64>().map_err(|error| match error {
        fredholm::Error::Scene {
            place: Some(at), ..
        } => Failure::input(deck.error(at.surface, error)),
        error => Failure::input(error),
    })?;
    Factors::new(surfaces.names, &scene)
}

/// The form factors of the problem file of this name, which must be a room.
pub(crate) fn of_file(name: &str, file: &ProblemFile) -> Result<Factors, Failure> {
    let Some(own) = file.problem_as::<file::kinds::Room>() else {
        return Err(Failure::input(format_args!(
            "{name}: form factors belong to rooms: `kind = \"room\"`, or a .vs2 deck"
        )));
    };
    let surfaces = own.all_surfaces(file)?;
    refuse_beyond_memory(surfaces.names.len())?;
    let scene = match file.walk.scalar.value {
        Scalar::F32 => surfaces.scene::<f32>(),
        Scalar::F64 => surfaces.scene::<f64>(),
    };
    Factors::new(surfaces.names, &scene.map_err(Failure::of(file))?)
}

/// Asked before a scene is made, which may take long.
fn refuse_beyond_memory(surfaces: usize) -> Result<(), Failure> {
    let needed = surfaces.saturating_mul(surfaces).saturating_mul(PAIR);
    let what = || format!("the form factors of {surfaces} surfaces");
    fredholm::refuse_beyond_memory(what, needed, "").map_err(Failure::input)
}

impl Factors {
    fn new(surfaces: Vec<String>, scene: &Scene) -> Result<Self, Failure> {
        let n = surfaces.len();
        let entries = form_factors(scene).map_err(Failure::run)?;
        let rows = entries.chunks_exact(n.max(1));
        Ok(Self {
            factors: rows.map(<[f64]>::to_vec).collect(),
            surfaces,
        })
    }

    /// A table, with the sum of every row: 1 in a closed room.
    fn text(&self) -> String {
        let mut header = vec!["from \\ to".to_owned()];
        header.extend(self.surfaces.iter().cloned());
        header.push("sum".to_owned());
        let mut rows = vec![header];
        for (name, row) in self.surfaces.iter().zip(&self.factors) {
            let mut cells = vec![name.clone()];
            cells.extend(row.iter().map(|f| {
                if *f == 0.0 {
                    "0".to_owned()
                } else {
                    format!("{f:.6}")
                }
            }));
            cells.push(format!("{:.6}", row.iter().sum::<f64>()));
            rows.push(cells);
        }
        aligned(&rows)
    }
}
