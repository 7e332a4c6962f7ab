//! A report as CSV.

use serde::Serialize;

use super::{Coordinates, EnergyReport, EstimateReport, GoalReport, Over, Report};
use crate::{Error, Sensitivities};

/// A row that cannot be written.
const FAILED: Error = Error::Internal("a report that is no CSV");

/// An entry of a row.
#[derive(Clone, Serialize)]
#[serde(untagged)]
pub(super) enum Entry {
    Text(String),
    Number(Option<f64>),
    Count(u64),
}

impl Entry {
    /// The entry with its number written out, without an exponent.
    pub(super) fn written_out(self) -> Self {
        match self {
            Self::Number(number) => Self::Text(number.map_or(String::new(), |x| x.to_string())),
            own => own,
        }
    }

    const EMPTY: Self = Self::Number(None);
}

/// A column: its name, and the entry of a goal.
pub(super) type CsvColumn = (&'static str, fn(&GoalReport) -> Entry);

/// The columns of every report: which goal it is.
pub(super) const COLUMNS_OF_GOALS: &[CsvColumn] = &[
    ("name", |t| text(&t.name)),
    ("at", |t| optional(t.at.as_ref().map(Coordinates::entry))),
    ("from", |t| Entry::Number(interval(t).map(|[from, _]| from))),
    ("to", |t| Entry::Number(interval(t).map(|[_, to]| to))),
    ("weight", |t| optional(t.weight.as_deref().map(harmless))),
    ("exact", |t| Entry::Number(t.exact)),
];

/// The columns of separate walks.
const COLUMNS_OF_WALKS: &[CsvColumn] = &[
    ("galerkin", |t| Entry::Number(Some(t.galerkin))),
    ("walks", |t| Entry::Count(t.walks)),
    ("plain", |t| value(t.plain)),
    ("plain_std_error", |t| error(t.plain)),
    ("plain_std_dev", |t| Entry::Number(t.plain.std_dev)),
    ("preconditioned", |t| value(t.preconditioned)),
    ("preconditioned_std_error", |t| error(t.preconditioned)),
    ("preconditioned_std_dev", |t| {
        Entry::Number(t.preconditioned.std_dev)
    }),
    ("irradiance", |t| value(t.irradiance)),
    ("irradiance_std_error", |t| error(t.irradiance)),
    ("net_flux", |t| value(t.net_flux)),
    ("net_flux_std_error", |t| error(t.net_flux)),
    ("rounding_floor", |t| Entry::Number(Some(t.rounding_floor))),
    ("absorbed", |t| Entry::Count(t.endings.absorbed)),
    ("step_limit", |t| Entry::Count(t.endings.step_limit)),
    ("error", |t| Entry::Number(t.error)),
    ("z", |t| Entry::Number(t.z)),
    ("radiant_temperature", |t| value(t.radiant_temperature)),
    ("radiant_temperature_std_error", |t| {
        error(t.radiant_temperature)
    }),
    ("temperature", |t| value(t.temperature)),
    ("temperature_std_error", |t| error(t.temperature)),
];

/// The columns of a global estimate.
pub(super) const COLUMNS_OF_WHOLE: &[CsvColumn] = &[
    ("iterate", |t| Entry::Number(t.iterate)),
    ("estimate", |t| value(t.preconditioned)),
    ("std_error", |t| error(t.preconditioned)),
    ("band", |t| Entry::Number(t.band)),
    ("error", |t| Entry::Number(t.error)),
    ("z", |t| Entry::Number(t.z)),
    ("irradiance", |t| value(t.irradiance)),
    ("irradiance_std_error", |t| error(t.irradiance)),
    ("net_flux", |t| value(t.net_flux)),
    ("net_flux_std_error", |t| error(t.net_flux)),
    ("temperature", |t| value(t.temperature)),
    ("temperature_std_error", |t| error(t.temperature)),
    ("radiant_temperature", |t| value(t.radiant_temperature)),
    ("radiant_temperature_std_error", |t| {
        error(t.radiant_temperature)
    }),
];

/// The columns of walks that turned out to be those of a global estimate.
const BAND_AND_ITERATE: &[CsvColumn] = &[
    ("band", |t| Entry::Number(t.band)),
    ("iterate", |t| Entry::Number(t.iterate)),
];

fn value(report: impl Into<Option<EstimateReport>>) -> Entry {
    Entry::Number(report.into().and_then(|own| own.estimate))
}

fn error(report: impl Into<Option<EstimateReport>>) -> Entry {
    Entry::Number(report.into().and_then(|own| own.std_error))
}

fn interval(goal: &GoalReport) -> Option<[f64; 2]> {
    match goal.over {
        Some(Over::Interval(interval)) => Some(interval),
        _ => None,
    }
}

fn text(text: &str) -> Entry {
    Entry::Text(harmless(text))
}

fn optional(text: Option<String>) -> Entry {
    text.map_or(Entry::EMPTY, Entry::Text)
}

impl Report {
    /// The report as CSV, a row for every goal, with columns of the problem's own coordinates.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        let table = CsvTable {
            columns: &[COLUMNS_OF_GOALS, COLUMNS_OF_WALKS].concat(),
            coordinates: of_columns(self.problem, self.dimension),
            more: if self.whole.is_some() {
                BAND_AND_ITERATE
            } else {
                &[]
            },
            energy: self.energy.as_ref(),
            sensitivities: self.sensitivities.as_ref(),
        };
        table.text(self.goals.iter(), |entry| entry)
    }
}

/// A table of goals, and of net fluxes behind them.
pub(super) struct CsvTable<'a> {
    pub(super) columns: &'a [CsvColumn],
    /// The names of the problem's own coordinates.
    pub(super) coordinates: Vec<String>,
    /// The columns behind those.
    pub(super) more: &'a [CsvColumn],
    pub(super) energy: Option<&'a EnergyReport>,
    pub(super) sensitivities: Option<&'a Sensitivities>,
}

impl CsvTable<'_> {
    /// The table as CSV, with all entries written so.
    pub(super) fn text<'g>(
        &self,
        goals: impl Iterator<Item = &'g GoalReport>,
        write: fn(Entry) -> Entry,
    ) -> Result<String, Error> {
        let mut builder = csv::WriterBuilder::new();
        let mut writer = builder.has_headers(false).from_writer(Vec::new());
        let of_fluxes = self.energy.map(flux_columns);
        let names = |columns: &[CsvColumn]| columns.iter().map(|(name, _)| *name).collect();
        let [own, more]: [Vec<&str>; 2] = [self.columns, self.more].map(names);
        let coordinates = self.coordinates.iter().map(String::as_str);
        let head = own.iter().copied().chain(coordinates).chain(more);
        let head: Vec<&str> = head.chain(of_fluxes.into_iter().flatten()).collect();
        let quantities = self.sensitivities.map_or(Vec::new(), quantities);
        let names = quantities.iter().flat_map(|name| {
            let name = harmless(name);
            [format!("by {name}"), format!("by {name} std_error")]
        });
        let names: Vec<String> = names.collect();
        let all = head.iter().copied().chain(names.iter().map(String::as_str));
        writer.write_record(all).map_err(|_| FAILED)?;
        for goal in goals {
            let entries = |columns: &[CsvColumn]| -> Vec<Entry> {
                columns.iter().map(|(_, of)| write(of(goal))).collect()
            };
            let mut row = entries(self.columns);
            let places = places(goal, self.coordinates.len());
            row.extend(places.into_iter().map(Entry::Text));
            row.extend(entries(self.more));
            row.resize(head.len(), Entry::EMPTY);
            let derivatives = self.sensitivities.iter().flat_map(|all| &all.derivatives);
            let of_goal: Vec<_> = derivatives.filter(|own| own.target == goal.name).collect();
            for quantity in &quantities {
                let own = of_goal.iter().find(|own| own.quantity == *quantity);
                row.push(Entry::Number(own.map(|own| own.derivative)));
                row.push(Entry::Number(own.and_then(|own| own.std_error)));
            }
            writer.serialize(row).map_err(|_| FAILED)?;
        }
        for (name, walks, flux) in self.energy.into_iter().flat_map(fluxes) {
            let mut row = vec![Entry::EMPTY; head.len() - 2];
            row[0] = Entry::Text(name);
            if let Some(column) = own.iter().position(|name| *name == "walks") {
                row[column] = walks.map_or(Entry::EMPTY, Entry::Count);
            }
            row.extend([flux.estimate, flux.std_error].map(|x| Entry::Number(x).written_out()));
            row.resize(head.len() + names.len(), Entry::EMPTY);
            writer.serialize(row).map_err(|_| FAILED)?;
        }
        let bytes = writer.into_inner().map_err(|_| FAILED)?;
        String::from_utf8(bytes).map_err(|_| FAILED)
    }
}

/// The names of all quantities, in the order of the first target's derivatives.
fn quantities(all: &Sensitivities) -> Vec<&str> {
    let first = all.derivatives.chunk_by(|a, b| a.target == b.target);
    let first = first.take(1).flatten();
    first.map(|own| own.quantity.as_str()).collect()
}

/// The columns of the net fluxes of whole surfaces, which have rows of their own.
fn flux_columns(energy: &EnergyReport) -> [&'static str; 2] {
    match energy.unit {
        "W/m" => ["net_flux_per_metre", "net_flux_per_metre_std_error"],
        _ => ["net_flux_in_all", "net_flux_in_all_std_error"],
    }
}

/// The rows of net fluxes: name, walks and flux of every surface, and of all together.
fn fluxes(energy: &EnergyReport) -> impl Iterator<Item = (String, Option<u64>, EstimateReport)> {
    let surfaces = energy.surfaces.iter().filter_map(|surface| {
        let name = format!("net flux out of {}", surface.name);
        Some((name, Some(surface.walks), surface.net_flux?))
    });
    let all = energy.energy_balance;
    surfaces.chain(all.map(|all| ("net flux out of all".to_owned(), None, all)))
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
fn places(goal: &GoalReport, columns: usize) -> Vec<String> {
    let numbers = |x: &[f64]| x.iter().map(f64::to_string).collect::<Vec<_>>();
    let mut places = match &goal.at {
        None => Vec::new(),
        // Of a room: a point in the air is on no surface.
        Some(Coordinates::Many(x)) => {
            let mut places = vec![String::new(); columns.saturating_sub(x.len())];
            places.extend(numbers(x));
            places
        }
        Some(Coordinates::On { surface, t }) => vec![harmless(surface), t.to_string()],
    };
    places.extend(numbers(goal.position.as_deref().unwrap_or_default()));
    places.resize(columns, String::new());
    places
}

/// A text that no spreadsheet takes for a formula: behind an apostrophe if it begins as one.
pub(super) fn harmless(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        format!("'{text}")
    } else {
        text.to_owned()
    }
}

impl Coordinates {
    /// The point as one entry of a table.
    fn entry(&self) -> String {
        match self {
            Self::Many(x) => {
                let texts: Vec<String> = x.iter().map(f64::to_string).collect();
                texts.join(" ")
            }
            Self::On { surface, t } => format!("{} {t}", harmless(surface)),
        }
    }
}
