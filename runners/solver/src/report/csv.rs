//! A report as CSV.

use std::borrow::Cow;

use serde::Serialize;

use super::{Coordinates, EnergyReport, EstimateReport, GoalReport, Over, Report};
use crate::Error;

/// A row that cannot be written.
const FAILED: Error = Error::Internal("a report that is no CSV");

impl Report {
    /// The report as CSV, a row for every goal, with columns of the problem's own coordinates.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        let mut writer = writer();
        let coordinates = of_columns(self.problem, self.dimension);
        let columns = COLUMNS.iter().copied();
        let columns = columns.chain(coordinates.iter().map(String::as_str));
        let of_whole = self.whole.iter().flat_map(|_| ["band", "iterate"]);
        let columns = columns.chain(of_whole);
        let columns: Vec<&str> = match &self.energy {
            Some(energy) => columns.chain(flux_columns(energy)).collect(),
            None => columns.collect(),
        };
        writer.write_record(&columns).map_err(|_| FAILED)?;
        for target in &self.goals {
            let place = CsvPlace {
                at: target.at.as_ref(),
                position: target.position.as_deref().unwrap_or(&[]),
            };
            let places = places(place, coordinates.len());
            let none = self.energy.as_ref().map(|_| [None::<f64>; 2]);
            let none = none.iter().flatten().collect::<Vec<_>>();
            let whole = self.whole.as_ref().map(|_| [target.band, target.iterate]);
            let whole = whole.iter().flatten().collect::<Vec<_>>();
            let row = (CsvRow::new(target), places, whole, none);
            writer.serialize(row).map_err(|_| FAILED)?;
        }
        for (name, walks, flux) in self.energy.iter().flat_map(fluxes) {
            let mut row = vec![String::new(); columns.len()];
            row[0] = name;
            row[WALKS] = walks;
            let last = columns.len() - 2;
            let numbers = [flux.estimate, flux.std_error];
            for (to, number) in row[last..].iter_mut().zip(numbers) {
                *to = number.map_or(String::new(), |x| x.to_string());
            }
            writer.write_record(row).map_err(|_| FAILED)?;
        }
        finished(writer)
    }
}

/// What writes rows of any columns.
fn writer() -> csv::Writer<Vec<u8>> {
    let mut builder = csv::WriterBuilder::new();
    builder.has_headers(false).from_writer(Vec::new())
}

/// What was written.
fn finished(writer: csv::Writer<Vec<u8>>) -> Result<String, Error> {
    let bytes = writer.into_inner().map_err(|_| FAILED)?;
    String::from_utf8(bytes).map_err(|_| FAILED)
}

/// Rows of entries as CSV.
///
/// # Errors
/// [`Error::Internal`].
pub(super) fn record(rows: &[Vec<String>]) -> Result<String, Error> {
    let mut writer = writer();
    for row in rows {
        writer.write_record(row).map_err(|_| FAILED)?;
    }
    finished(writer)
}

/// A text as an entry of its own.
pub(super) fn text(text: &str) -> String {
    harmless(text).into_owned()
}

/// Where a target is.
#[derive(Clone, Copy)]
pub(super) struct CsvPlace<'a> {
    pub(super) at: Option<&'a Coordinates>,
    pub(super) position: &'a [f64],
}

/// The columns of the net fluxes of whole surfaces, which have rows of their own.
pub(super) fn flux_columns(energy: &EnergyReport) -> [&'static str; 2] {
    match energy.unit {
        "W/m" => ["net_flux_per_metre", "net_flux_per_metre_std_error"],
        _ => ["net_flux_in_all", "net_flux_in_all_std_error"],
    }
}
/// The number of the column of walks.
const WALKS: usize = 7;

/// The rows of net fluxes: name, walks and flux of every surface, and of all together.
pub(super) fn fluxes(
    energy: &EnergyReport,
) -> impl Iterator<Item = (String, String, EstimateReport)> {
    let surfaces = energy.surfaces.iter().filter_map(|surface| {
        let name = format!("net flux out of {}", surface.name);
        Some((name, surface.walks.to_string(), surface.net_flux?))
    });
    let all = energy.energy_balance;
    surfaces.chain(all.map(|all| ("net flux out of all".to_owned(), String::new(), all)))
}

/// The columns of a problem's coordinates, one each.
pub(super) fn of_columns(problem: &str, dimension: Option<usize>) -> Vec<String> {
    let names: &[&str] = match (problem, dimension) {
        ("circle", _) => &["s"],
        ("sphere", _) => &["theta", "phi"],
        ("room", _) => &["surface", "t", "x", "y"],
        ("scene", _) => &["x", "y", "z"],
        (_, Some(d)) if d > 1 => return (1..=d).map(|a| format!("x{a}")).collect(),
        _ => &["x"],
    };
    names.iter().map(|&name| name.to_owned()).collect()
}

/// The coordinates of a target, or empty entries if it is no point.
pub(super) fn places(place: CsvPlace<'_>, columns: usize) -> Vec<String> {
    let numbers = |x: &[f64]| x.iter().map(f64::to_string).collect::<Vec<_>>();
    let mut places = match place.at {
        None => Vec::new(),
        // Of a room: a point in the air is on no surface.
        Some(Coordinates::Many(x)) => {
            let mut places = vec![String::new(); columns.saturating_sub(x.len())];
            places.extend(numbers(x));
            places
        }
        Some(Coordinates::On { surface, t }) => vec![harmless(surface).into_owned(), t.to_string()],
    };
    places.extend(numbers(place.position));
    places.resize(columns, String::new());
    places
}

/// The columns that all problems have, those of [`CsvRow`].
const COLUMNS: [&str; 27] = [
    "name",
    "at",
    "from",
    "to",
    "weight",
    "exact",
    "galerkin",
    "walks",
    "plain",
    "plain_std_error",
    "plain_std_dev",
    "preconditioned",
    "preconditioned_std_error",
    "preconditioned_std_dev",
    "irradiance",
    "irradiance_std_error",
    "net_flux",
    "net_flux_std_error",
    "rounding_floor",
    "absorbed",
    "step_limit",
    "error",
    "z",
    "radiant_temperature",
    "radiant_temperature_std_error",
    "temperature",
    "temperature_std_error",
];

/// A target in one line.
#[derive(Serialize)]
struct CsvRow<'a> {
    name: Cow<'a, str>,
    at: Option<String>,
    from: Option<f64>,
    to: Option<f64>,
    weight: Option<Cow<'a, str>>,
    exact: Option<f64>,
    galerkin: f64,
    walks: u64,
    plain: Option<f64>,
    plain_std_error: Option<f64>,
    plain_std_dev: Option<f64>,
    preconditioned: Option<f64>,
    preconditioned_std_error: Option<f64>,
    preconditioned_std_dev: Option<f64>,
    irradiance: Option<f64>,
    irradiance_std_error: Option<f64>,
    net_flux: Option<f64>,
    net_flux_std_error: Option<f64>,
    rounding_floor: f64,
    absorbed: u64,
    step_limit: u64,
    error: Option<f64>,
    z: Option<f64>,
    radiant_temperature: Option<f64>,
    radiant_temperature_std_error: Option<f64>,
    temperature: Option<f64>,
    temperature_std_error: Option<f64>,
}

impl<'a> CsvRow<'a> {
    fn new(target: &'a GoalReport) -> Self {
        let interval = match target.over {
            Some(Over::Interval(interval)) => Some(interval),
            _ => None,
        };
        Self {
            name: harmless(&target.name),
            at: target.at.as_ref().map(Coordinates::entry),
            from: interval.map(|over| over[0]),
            to: interval.map(|over| over[1]),
            weight: target.weight.as_deref().map(harmless),
            exact: target.exact,
            galerkin: target.galerkin,
            walks: target.walks,
            plain: target.plain.estimate,
            plain_std_error: target.plain.std_error,
            plain_std_dev: target.plain.std_dev,
            preconditioned: target.preconditioned.estimate,
            preconditioned_std_error: target.preconditioned.std_error,
            preconditioned_std_dev: target.preconditioned.std_dev,
            irradiance: target.irradiance.as_ref().and_then(|h| h.estimate),
            irradiance_std_error: target.irradiance.as_ref().and_then(|h| h.std_error),
            net_flux: target.net_flux.as_ref().and_then(|q| q.estimate),
            net_flux_std_error: target.net_flux.as_ref().and_then(|q| q.std_error),
            rounding_floor: target.rounding_floor,
            absorbed: target.endings.absorbed,
            step_limit: target.endings.step_limit,
            error: target.error,
            z: target.z,
            radiant_temperature: target.radiant_temperature.and_then(|t| t.estimate),
            radiant_temperature_std_error: target.radiant_temperature.and_then(|t| t.std_error),
            temperature: target.temperature.and_then(|t| t.estimate),
            temperature_std_error: target.temperature.and_then(|t| t.std_error),
        }
    }
}

/// A text that no spreadsheet takes for a formula: behind an apostrophe if it begins as one.
fn harmless(text: &str) -> Cow<'_, str> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        Cow::Owned(format!("'{text}"))
    } else {
        Cow::Borrowed(text)
    }
}

impl Coordinates {
    /// The point as one entry of a table.
    pub(super) fn entry(&self) -> String {
        match self {
            Self::Many(x) => {
                let texts: Vec<String> = x.iter().map(f64::to_string).collect();
                texts.join(" ")
            }
            Self::On { surface, t } => format!("{} {t}", harmless(surface)),
        }
    }
}
