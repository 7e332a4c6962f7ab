//! `fredholm certify --factors`: form factors of others beside exact ones.

use std::collections::HashMap;
use std::path::Path;

use fredholm::numbers::{aligned, short};
use fredholm_file::last_digit;
use serde::Serialize;

use super::arrays;
use crate::args::{CertifyArgs, FactorsArgs};
use crate::factors::{Factors, found};
use crate::failure::{Ended, Failure, print};
use crate::{file, table};

/// What rounding leaves of an exact factor, where no obstacle has an error of its own.
const ROUNDING: f64 = 1e-12;

/// Pairs that are printed.
const FEW: usize = 10;

/// Given form factors beside exact ones.
#[derive(Serialize)]
struct Compared {
    /// The number of pairs of surfaces.
    pairs: usize,
    /// The number of pairs that are wrong for certain.
    wrong: usize,
    /// The error that an exact factor may have.
    exact_to: f64,
    /// By how much rounding may have moved the given ones.
    rounding: f64,
    /// The largest error, given minus exact.
    largest: Option<Pair>,
    /// The root of the mean square error.
    root_mean_square: f64,
    /// The largest difference of a given row's sum from the exact one.
    row_sum: f64,
    /// The largest |A_I F_IJ − A_J F_JI| over A_I, if areas are known.
    reciprocity: Option<f64>,
    /// All pairs whose errors are not 0, the worst first.
    worst: Vec<Pair>,
}

/// A pair of surfaces.
#[derive(Clone, Debug, Serialize)]
struct Pair {
    from: String,
    to: String,
    given: f64,
    exact: f64,
    error: f64,
}

/// Compares.
pub(super) fn certify(args: &CertifyArgs, given: &Path) -> Result<Ended, Failure> {
    let exact = found(&FactorsArgs::of_file(&args.file, args.common.threads))?;
    let given = Given::read(given, &exact.surfaces)?;
    let compared = Compared::new(&exact, &given);
    if let Some(path) = &args.out {
        let output = fredholm_file::parts::output::Output::open("--out", path)?;
        output.finish(table::json(&compared)?)?;
    }
    print(if args.common.json {
        table::json(&compared)?
    } else {
        compared.text()
    })?;
    Ok(match compared.wrong {
        0 => Ended::Done,
        _ => Ended::Disagrees,
    })
}

impl Compared {
    fn new(
        exact: &Factors,
        Given {
            rows: given,
            rounding,
        }: &Given,
    ) -> Self {
        let n = exact.surfaces.len();
        let space = exact.space.as_ref();
        let exact_to = space
            .map_or(0.0, |space| space.estimated_error)
            .max(ROUNDING);
        let rows: Vec<Vec<f64>> = (0..n).map(|i| exact.factors.whole_row(i)).collect();
        let pair = |i: usize, j: usize| Pair {
            from: exact.surfaces[i].clone(),
            to: exact.surfaces[j].clone(),
            given: given[i][j],
            exact: rows[i][j],
            error: given[i][j] - rows[i][j],
        };
        let all = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let mut worst: Vec<Pair> = all
            .map(|(i, j)| pair(i, j))
            .filter(|own| own.error != 0.0)
            .collect();
        worst.sort_by(|a, b| b.error.abs().total_cmp(&a.error.abs()));
        let squares: f64 = worst.iter().map(|own| own.error * own.error).sum();
        let sum = |row: &[f64]| row.iter().sum::<f64>();
        let off = rows.iter().zip(given).map(|(a, b)| (sum(b) - sum(a)).abs());
        let reciprocity = space.map(|space| {
            let areas = &space.areas;
            let all = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
            let off = all.map(|(i, j)| {
                let difference = areas[i] * given[i][j] - areas[j] * given[j][i];
                difference.abs() / areas[i].min(areas[j])
            });
            off.fold(0.0, f64::max)
        });
        Self {
            pairs: n * n,
            wrong: worst
                .iter()
                .filter(|own| own.error.abs() > exact_to + rounding)
                .count(),
            exact_to,
            rounding: *rounding,
            largest: worst.first().cloned(),
            root_mean_square: (squares / (n * n).max(1) as f64).sqrt(),
            row_sum: off.fold(0.0, f64::max),
            reciprocity,
            worst,
        }
    }

    fn text(&self) -> String {
        let verdict = match (&self.largest, self.wrong) {
            (Some(pair), 1..) => format!(
                "wrong by {} ± {:.0e} from {} to {}\n\n",
                short(pair.error.abs()),
                self.exact_to,
                pair.from,
                pair.to
            ),
            _ => format!("right to within {:.0e}\n\n", self.exact_to),
        };
        let mut rows = vec![
            vec![
                "wrong for certain".to_owned(),
                format!("{} of {} pairs", self.wrong, self.pairs),
            ],
            vec!["root mean square".to_owned(), short(self.root_mean_square)],
            vec!["row sums off by".to_owned(), short(self.row_sum)],
        ];
        if let Some(off) = self.reciprocity {
            rows.push(vec!["reciprocity off by".to_owned(), short(off)]);
        }
        if self.rounding > 0.0 {
            rows.push(vec![
                "given to".to_owned(),
                (2.0 * self.rounding).to_string(),
            ]);
        }
        let mut text = verdict + &aligned(&rows);
        let wrong = self.worst.iter().take(self.wrong.min(FEW));
        let line = |pair: &Pair| {
            let numbers = [pair.given, pair.exact].map(|own| format!("{own:.9}"));
            let [given, exact] = numbers;
            vec![
                pair.from.clone(),
                pair.to.clone(),
                given,
                exact,
                format!("{:.2e}", pair.error),
            ]
        };
        let head = ["from", "to", "given", "exact", "error"]
            .map(str::to_owned)
            .to_vec();
        let lines: Vec<Vec<String>> = wrong.map(line).collect();
        if !lines.is_empty() {
            text += "\n";
            text += &aligned(&[vec![head], lines].concat());
        }
        text
    }
}

/// Factors that somebody gives.
struct Given {
    /// Row I: of the energy that leaves surface I, the share that arrives at each.
    rows: Vec<Vec<f64>>,
    /// By how much rounding may have moved them.
    rounding: f64,
}

impl Given {
    /// The factors of a file: CSV of from, to and factor, in which zeros may be left out, a matrix of NumPy's, or View3D's text.
    fn read(path: &Path, surfaces: &[String]) -> Result<Self, Failure> {
        if arrays::is_read(path) {
            let rows = arrays::matrix(path, surfaces.len())?;
            return Ok(Self {
                rows,
                rounding: 0.0,
            });
        }
        let name = path.display().to_string();
        let text = file::utf8(&name, file::load(path, file::MAX_BYTES)?)?;
        let is_csv = |ending: &std::ffi::OsStr| ending.eq_ignore_ascii_case("csv");
        if path.extension().is_some_and(is_csv) {
            Self::of_csv(&name, &text, surfaces)
        } else {
            Self::of_view3d(&name, &text, surfaces.len())
        }
    }

    fn of_csv(name: &str, text: &str, surfaces: &[String]) -> Result<Self, Failure> {
        let n = surfaces.len();
        let number: HashMap<&str, usize> = surfaces.iter().map(String::as_str).zip(0..).collect();
        let (mut rows, mut rounding) = (vec![vec![0.0; n]; n], f64::INFINITY);
        let mut reader = csv::ReaderBuilder::new();
        let mut reader = reader.trim(csv::Trim::All).from_reader(text.as_bytes());
        for record in reader.records() {
            let record = record.map_err(|error| Failure::input(format_args!("{name}: {error}")))?;
            let line = record.position().map_or(0, csv::Position::line);
            let wrong = |message: &str| Failure::input(format_args!("{name}:{line}: {message}"));
            let surface = |field: usize| {
                let field = record.get(field).unwrap_or_default();
                let known = number.get(field).copied();
                known.ok_or_else(|| wrong(&format!("there is no surface {field:?}")))
            };
            let (from, to) = (surface(0)?, surface(1)?);
            let field = record.get(2).unwrap_or_default();
            let factor = field.parse().ok().filter(|own: &f64| own.is_finite());
            rows[from][to] =
                factor.ok_or_else(|| wrong("a factor is a number: from, to, factor"))?;
            rounding = rounding.min(last_digit(field));
        }
        let rounding = if rounding.is_finite() { rounding } else { 0.0 };
        Ok(Self { rows, rounding })
    }

    /// View3D's text: a line that says what follows, areas, rows of factors, emissivities.
    fn of_view3d(name: &str, text: &str, n: usize) -> Result<Self, Failure> {
        let words = text.lines().skip(1).flat_map(str::split_whitespace);
        let words: Vec<&str> = words.skip(n).take(n * n).collect();
        let numbers: Vec<f64> = words.iter().map_while(|word| word.parse().ok()).collect();
        if numbers.len() < n * n {
            return Err(Failure::input(format_args!(
                "{name}: {n} areas and {n} rows of {n} factors are wanted behind the first line, as View3D writes \
                 them, or a .csv file of from, to, factor"
            )));
        }
        let rounding = words.iter().map(|word| last_digit(word));
        Ok(Self {
            rounding: rounding.reduce(f64::min).unwrap_or(0.0),
            rows: numbers
                .chunks_exact(n.max(1))
                .map(<[f64]>::to_vec)
                .collect(),
        })
    }
}
