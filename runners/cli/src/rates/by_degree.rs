//! StoppingRule of several degrees side by side, by the clock: which degree pays.

use fredholm::numbers::{aligned, short};
use fredholm::sweep::{Rates, Row, exponent};
use fredholm_plot::{Curve, LogLogPlot, Style};
use serde::Serialize;

use super::figures::what;

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
        let with = |first: String, rest: [String; 11]| [vec![first], rest.to_vec()].concat();
        let columns = Row::columns("seconds").map(str::to_owned);
        let mut lines = vec![with("degree".to_owned(), columns)];
        for row in self.sweeps.iter().flat_map(|sweep| &sweep.rows) {
            lines.push(with(row.degree.to_string(), row.texts()));
        }
        aligned(&lines)
    }

    fn at_equal_time(&self) -> String {
        let line =
            |first: &str, rest: [String; 4]| [vec![first.to_owned()], rest.to_vec()].concat();
        let mut lines = vec![line(
            "degree",
            SECONDS.map(|seconds| format!("{seconds} s")),
        )];
        if let Some(first) = self.sweeps.iter().find_map(|sweep| sweep.rows.first()) {
            let [_, work, error] = first.work();
            let plain = SECONDS.map(|seconds| short(error * (work / seconds).sqrt()));
            lines.push(line("plain", plain));
        }
        for sweep in &self.sweeps {
            let mut line = vec![sweep.degree.to_string()];
            for seconds in SECONDS {
                let mut all = self.equal_time.iter();
                let least = all.find(|l| (l.degree, l.seconds) == (sweep.degree, seconds));
                let text = least.map(|l| format!("{} (n = {})", short(l.error), l.unknowns));
                line.push(text.unwrap_or("-".to_owned()));
            }
            lines.push(line);
        }
        aligned(&lines)
    }

    fn exponents(&self) -> String {
        let columns = [
            "degree",
            "√Var ~ n^",
            "theory",
            "error ~ seconds^",
            "theory",
        ];
        let mut lines = vec![columns.map(str::to_owned).to_vec()];
        for sweep in &self.sweeps {
            let fits = &sweep.fits;
            lines.push(vec![
                sweep.degree.to_string(),
                exponent(fits.std_dev),
                format!("{:.3}", fits.std_dev_theory),
                exponent(fits.error_in_seconds),
                format!("{:.3}", fits.error_theory),
            ]);
        }
        aligned(&lines)
    }

    /// A curve of every degree. Levels whose deviation is one of rounding are left out.
    fn curves(&self, at: impl Fn(&Row) -> (f64, f64)) -> Vec<Curve> {
        let curve = |sweep: &Rates| {
            let rows = sweep.rows.iter().filter(|row| row.is_above_rounding());
            Curve {
                name: format!("degree {}", sweep.degree),
                points: rows.map(&at).collect(),
                style: Style {
                    colour: sweep.degree + 1,
                    marker: Some(sweep.degree),
                    dashed: false,
                },
            }
        };
        self.sweeps.iter().map(curve).collect()
    }

    /// With the line of plain walks through the point that the first level has, as far as `x` goes.
    fn figure(
        &self,
        titles: [&str; 3],
        exponent: f64,
        plain: impl Fn(&Row) -> f64,
        at: impl Fn(&Row) -> (f64, f64),
    ) -> LogLogPlot {
        let rows = || self.sweeps.iter().flat_map(|sweep| &sweep.rows);
        let ends = rows().map(|row| at(row).0);
        let (low, high) = ends.fold((f64::INFINITY, 0.0_f64), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let mut curves = Vec::new();
        if let Some(first) = rows().next() {
            let from = plain(first) * (low / at(first).0).powf(exponent);
            curves.push(Curve::power_law(
                "plain Monte Carlo",
                exponent,
                (low, from),
                high,
            ));
        }
        curves.extend(self.curves(at));
        let [title, x_label, y_label] = titles;
        let what = self.sweeps.last().map_or(String::new(), what);
        LogLogPlot {
            title: format!("{title} ({what})"),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            curves,
        }
    }

    /// Errors against time, none below what rounding leaves.
    pub(super) fn work_figure(&self) -> LogLogPlot {
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
    pub(super) fn deviation_figure(&self) -> LogLogPlot {
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
