//! Sweeps of several degrees side by side, by the clock: which degree pays.

use fredholm::numbers::{aligned, short};
use fredholm::sweep::{Rates, Row, exponent};
use fredholm_plot::{Curve, LogLogPlot, Style};
use serde::Serialize;

use super::figures::figure;

/// The seconds of which the least errors are told.
const SECONDS: [f64; 4] = [0.1, 1.0, 10.0, 100.0];

/// A sweep at every degree, of the same file.
#[derive(Debug, Serialize)]
pub(super) struct ByDegree {
    sweeps: Vec<Rates>,
    equal_time: Vec<Least>,
}

/// The least error that a time gives at a degree, over the levels that were measured.
#[derive(Clone, Copy, Debug, Serialize)]
struct Least {
    degree: usize,
    /// All that may be spent, the set-up counted.
    seconds: f64,
    /// The level: of a cube, cells an axis.
    cells: usize,
    unknowns: usize,
    error: f64,
}

impl ByDegree {
    /// Of at least one sweep.
    pub(super) fn new(sweeps: Vec<Rates>) -> Self {
        let mut equal_time = Vec::new();
        for sweep in &sweeps {
            for seconds in SECONDS {
                let errors = sweep.rows.iter().filter_map(|row| {
                    Some(Least {
                        degree: row.degree,
                        seconds,
                        cells: row.cells,
                        unknowns: row.unknowns,
                        error: row.error_in(seconds)?,
                    })
                });
                equal_time.extend(errors.min_by(|a, b| a.error.total_cmp(&b.error)));
            }
        }
        Self { sweeps, equal_time }
    }

    pub(super) fn sweeps(&self) -> &[Rates] {
        &self.sweeps
    }

    /// The tables for people.
    pub(super) fn text(&self) -> String {
        let Some(last) = self.sweeps.last() else {
            return String::new();
        };
        format!(
            "{}, {} pairs: {}\n\n{}\nerrors are those of the mean: of walks √(Var/N), of the Galerkin \
             solution the distance from {}\nplain: as many seconds spent on plain walks alone; gain: how \
             many times larger that is\n\nthe least error of all levels in so many seconds, set-up counted, \
             and its unknowns n\n{}\nfitted exponents\n{}",
            last.named(),
            last.pairs,
            last.mean_text(),
            self.levels(),
            last.reference(),
            self.at_equal_time(),
            self.exponents(),
        )
    }

    /// All levels of all degrees.
    fn levels(&self) -> String {
        let mut lines = vec![line("degree", Row::columns("seconds").map(str::to_owned))];
        for row in self.sweeps.iter().flat_map(|sweep| &sweep.rows) {
            lines.push(line(row.degree, row.texts()));
        }
        aligned(&lines)
    }

    fn at_equal_time(&self) -> String {
        let heads = SECONDS.map(|seconds| format!("{seconds} s"));
        let mut lines = vec![line("degree", heads)];
        if let Some(first) = self.sweeps.iter().find_map(|sweep| sweep.rows.first()) {
            let [_, work, error] = first.work();
            let plain = SECONDS.map(|seconds| short(error * (work / seconds).sqrt()));
            lines.push(line("plain", plain));
        }
        for sweep in &self.sweeps {
            let least = SECONDS.map(|seconds| {
                let mut all = self.equal_time.iter();
                let least = all.find(|l| (l.degree, l.seconds) == (sweep.degree, seconds));
                let text = least.map(|l| format!("{} (n = {})", short(l.error), l.unknowns));
                text.unwrap_or("-".to_owned())
            });
            lines.push(line(sweep.degree, least));
        }
        aligned(&lines)
    }

    fn exponents(&self) -> String {
        let heads = ["√Var ~ n^", "theory", "error ~ seconds^", "theory"];
        let mut lines = vec![line("degree", heads.map(str::to_owned))];
        for Rates { degree, fits, .. } in &self.sweeps {
            let theory = [fits.std_dev_theory, fits.error_theory].map(|x| format!("{x:.3}"));
            let [of_deviation, of_error] = theory;
            let found = [fits.std_dev, fits.error_in_seconds].map(exponent);
            let [deviation, error] = found;
            lines.push(line(degree, [deviation, of_deviation, error, of_error]));
        }
        aligned(&lines)
    }

    /// A curve of every degree, but for levels whose deviation is one of rounding, and before them the line of plain walks
    /// through the point that the first level has, as far as `x` goes.
    fn figure(
        &self,
        titles: [&str; 3],
        exponent: f64,
        plain: fn(&Row) -> f64,
        at: fn(&Row) -> (f64, f64),
    ) -> Option<LogLogPlot> {
        let rows = || self.sweeps.iter().flat_map(|sweep| &sweep.rows);
        let low = rows().map(|row| at(row).0).fold(f64::INFINITY, f64::min);
        let high = rows().map(|row| at(row).0).fold(0.0, f64::max);
        let line = |first: &Row| {
            let from = plain(first) * (low / at(first).0).powf(exponent);
            Curve::power_law("plain Monte Carlo", exponent, (low, from), high)
        };
        let curve = |sweep: &Rates| {
            let rows = sweep.rows.iter().filter(|row| row.is_above_rounding());
            let style = Style::marked(sweep.degree + 1, sweep.degree);
            Curve::new(format!("degree {}", sweep.degree), style, rows.map(at))
        };
        let curves = rows().next().map(line).into_iter();
        let curves = curves.chain(self.sweeps.iter().map(curve));
        Some(figure(self.sweeps.last()?, titles, curves.collect()))
    }

    /// Errors against time, none below what rounding leaves.
    pub(super) fn work_figure(&self) -> Option<LogLogPlot> {
        self.figure(
            [
                "Error of the mean against time, by degree",
                "seconds, set-up included",
                "error",
            ],
            -0.5,
            |row| row.work()[2],
            |row| (row.work()[1], row.error.max(row.rounding_floor)),
        )
    }

    /// √Var against the number of unknowns.
    pub(super) fn deviation_figure(&self) -> Option<LogLogPlot> {
        self.figure(
            [
                "Standard deviation against unknowns, by degree",
                "unknowns n",
                "√Var of the mean",
            ],
            0.0,
            |row| row.std_dev_plain,
            |row| (row.unknowns as f64, row.std_dev),
        )
    }
}

/// A line of a table.
fn line<const N: usize>(first: impl ToString, rest: [String; N]) -> Vec<String> {
    [vec![first.to_string()], rest.to_vec()].concat()
}
