//! Certificates for people, and as CSV.

use fredholm_model::numbers::{aligned, short, with_error};
use serde::Serialize;

use super::{Certificate, CertifiedValue};
use crate::Error;

/// Rows of which all are in the table; of more the worst ones are.
const ROWS: usize = 20;

impl Certificate {
    /// The certificate as a table for people: the verdict, what it rests on, and values, of many the worst.
    #[must_use]
    pub fn table(&self) -> String {
        let unit = self.unit.map_or(String::new(), |unit| format!(" {unit}"));
        let mut text = format!(
            "{self}\n\nwrong for certain: {} of {} values; no error is larger than {}{unit}; root mean square {}, mean {}\n\
             band: {} % for all values together, {} standard errors\n",
            self.wrong,
            self.compared,
            short(self.bound),
            short(self.root_mean_square),
            short(self.mean),
            short(100.0 * self.level),
            short(self.band_factor)
        );
        if self.rounding > 0.0 {
            text += &format!(
                "given values are rounded to {}, which is no error\n",
                short(2.0 * self.rounding)
            );
        }
        let (targets, others) = self.values.split_at(self.targets);
        let all: Vec<&CertifiedValue> = if targets.len() <= ROWS {
            targets.iter().collect()
        } else {
            worst(targets)
        };
        let all: Vec<_> = all.into_iter().chain(worst(others)).collect();
        let mut rows = vec![
            ["value", "at", "given", "u", "error", "band ±", ""]
                .map(str::to_owned)
                .to_vec(),
        ];
        rows.extend(all.into_iter().map(row));
        text += "\n";
        text + &aligned(&rows)
    }

    /// All values as CSV.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        const FAILED: Error = Error::Internal("a certificate that is no CSV");
        let mut writer = csv::Writer::from_writer(Vec::new());
        for value in &self.values {
            let line = Line {
                name: &value.name,
                at: value.place(),
                given: value.given,
                estimate: value.estimate,
                error: value.error,
                std_error: value.std_error,
                band: value.band,
                is_wrong: value.is_wrong,
            };
            writer.serialize(line).map_err(|_| FAILED)?;
        }
        let bytes = writer.into_inner().map_err(|_| FAILED)?;
        String::from_utf8(bytes).map_err(|_| FAILED)
    }
}

/// The values whose errors are largest, in their order.
fn worst(values: &[CertifiedValue]) -> Vec<&CertifiedValue> {
    const FEW: usize = 10;
    let size = |value: &CertifiedValue| value.error.map_or(-1.0, f64::abs);
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| size(&values[b]).total_cmp(&size(&values[a])));
    order.truncate(FEW);
    order.sort_unstable();
    order.into_iter().map(|i| &values[i]).collect()
}

/// A line of a table.
fn row(value: &CertifiedValue) -> Vec<String> {
    let number = |own: Option<f64>| own.map_or("unknown".to_owned(), |own| format!("{own:.10}"));
    let mark = if value.is_wrong { "wrong" } else { "" };
    vec![
        value.name.clone(),
        value.place(),
        number(value.given),
        with_error(value.estimate.unwrap_or(f64::NAN), value.std_error),
        value
            .error
            .map_or(String::new(), |error| format!("{error:.2e}")),
        value
            .band
            .map_or(String::new(), |band| format!("{band:.1e}")),
        mark.to_owned(),
    ]
}

/// A line of a file.
#[derive(Serialize)]
struct Line<'a> {
    name: &'a str,
    at: String,
    given: Option<f64>,
    estimate: Option<f64>,
    error: Option<f64>,
    std_error: Option<f64>,
    band: Option<f64>,
    is_wrong: bool,
}
