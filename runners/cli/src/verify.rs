//! `fredholm verify`: numbers that others published or derived, beside what this program finds.
//!
//! The numbers are data: `verify/*.toml`. Each goes the way of a user's: a problem file is read, validated, set up and
//! walked. What comes of walks must lie within four standard errors (and the rounding floor), of the preconditioned and of
//! the plain estimate; what is computed exactly must have every digit that was printed; rates and sizes that depend on
//! choices which nobody printed have a stated latitude.

use core::f64::consts::TAU;
use std::time::Instant;

use fredholm::report::EstimateReport;
use serde::{Deserialize, Serialize};

use crate::args::{Common, PaperArgs};
use crate::failure::{Ended, Failure, print, say};
use crate::file::{self, ProblemFile};
use crate::numbers::{aligned, short, with_error};
use crate::progress::{Progress, Signals};
use crate::solve::{self, Problem};
use crate::threads::with_threads;
use crate::{deck, factors, paper, rates, table};

/// The numbers, in the order of the page.
const PUBLISHED: &str = concat!(
    include_str!("../verify/circle.toml"),
    include_str!("../verify/cube.toml"),
    include_str!("../verify/equations.toml"),
    include_str!("../verify/factors.toml"),
    include_str!("../verify/rooms.toml"),
    include_str!("../verify/rates.toml"),
);

#[derive(Deserialize)]
struct Published {
    case: Vec<Case>,
}

/// A problem, and numbers that are known of it.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Case {
    /// Authors and year, or how the numbers follow; empty if that is as in the case before.
    source: String,
    name: String,
    /// The number of sides of a regular polygon, which stands before the file.
    polygon: Option<u32>,
    file: String,
    run: Run,
    allowed: Allowed,
    numbers: Vec<Number>,
}

/// A number's name, the number, and how far off it may be, if that is not what the case says.
#[derive(Deserialize)]
struct Number(String, f64, #[serde(default)] Option<Allowed>);

/// What finds the numbers.
#[derive(Default, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Run {
    /// Walks: u at the targets of the file.
    #[default]
    Walks,
    /// The form factors from surface to surface.
    Factors,
    /// The same of a View2D deck.
    Deck,
    /// Walks on every one of these cells: exponents of √Var in n and of the error in cost.
    Rates(Vec<usize>),
    /// The experiment of Heinrich 1995, section 5.
    Experiment,
}

/// How far off a number may be.
#[derive(Clone, Copy, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
enum Allowed {
    StandardErrors(f64),
    Difference(f64),
    /// So many times larger or smaller.
    Factor(f64),
}

impl Default for Allowed {
    /// By chance a right estimate is further off once in 16,000 seeds; the seeds are fixed.
    fn default() -> Self {
        Self::StandardErrors(4.0)
    }
}

/// One number beside ours. Names are a promise; fields may be added.
#[derive(Clone, Default, Serialize)]
struct Row {
    source: String,
    case: String,
    expected: f64,
    #[serde(flatten)]
    ours: Ours,
    /// What plain walks say.
    plain: Option<Ours>,
    allowed: Allowed,
    agrees: bool,
}

/// A number of ours, and of walks the standard error and (got − expected)/std_error.
#[derive(Clone, Default, Serialize)]
struct Ours {
    got: Option<f64>,
    std_error: Option<f64>,
    z: Option<f64>,
    #[serde(skip)]
    rounding_floor: f64,
}

/// Everything that `verify --json` prints.
#[derive(Serialize)]
struct Report {
    agree: bool,
    seconds: f64,
    rows: Vec<Row>,
}

/// Runs `verify`.
pub(crate) fn verify(args: &Common, signals: &Signals) -> Result<Ended, Failure> {
    let start = Instant::now();
    let rows = match with_threads(args.threads, || run(args, signals))? {
        // Nobody has seen all numbers agree.
        Err(Failure::ClosedPipe) => return Ok(Ended::Disagrees),
        rows => rows?,
    };
    let (all, agreeing) = (rows.len(), rows.iter().filter(|row| row.agrees).count());
    let report = Report {
        agree: agreeing == all && !signals.interrupted(),
        seconds: start.elapsed().as_secs_f64(),
        rows,
    };
    print(match args.json {
        true => table::json(&report)?,
        false => format!("{agreeing} of {all} numbers agree\n"),
    })?;
    if signals.interrupted() {
        say("warning: interrupted; the numbers that were finished are printed");
        return Ok(Ended::Interrupted);
    }
    Ok(match report.agree {
        true => Ended::Done,
        false => Ended::Disagrees,
    })
}

/// All rows, or those before an interruption. For people, a source's numbers are printed as soon as they are there.
fn run(args: &Common, signals: &Signals) -> Result<Vec<Row>, Failure> {
    let published: Published = toml::from_str(PUBLISHED).map_err(Failure::run)?;
    let mut rows = Vec::new();
    let chapters = published.case.chunk_by(|_, next| next.source.is_empty());
    for chapter in chapters {
        let (source, begin) = (&chapter[0].source, rows.len());
        for case in chapter.iter().take_while(|_| !signals.interrupted()) {
            let found = case.found(args, signals)?;
            // Of what was interrupted there may be nothing.
            let numbers = case.numbers.iter().filter(|_| !signals.interrupted());
            rows.extend(numbers.map(|number| case.row(source, number, &found)));
        }
        if !args.json && begin < rows.len() {
            let header = ["", "expected", "here", "z", "plain z", "allowed", ""];
            let mut lines = vec![header.map(str::to_owned).to_vec()];
            lines.extend(rows[begin..].iter().map(Row::texts));
            print(format!("{source}\n\n{}\n", aligned(&lines)))?;
        }
    }
    Ok(rows)
}

impl Case {
    fn problem(&self) -> Result<ProblemFile, Failure> {
        let text = self.polygon.map_or_else(String::new, polygon) + &self.file;
        let file = file::read(&self.name, &text)?;
        file.validate()?;
        Ok(file)
    }

    /// What there is under the names.
    fn found(&self, args: &Common, signals: &Signals) -> Result<Vec<Row>, Failure> {
        let factors = match &self.run {
            Run::Walks => return walked(&Problem::new(self.problem()?, None)?, signals),
            Run::Rates(cells) => {
                let found = rates::exponents(self.problem()?, cells, signals)?;
                let names = ["√Var ~ n^", "error ~ cost^"].into_iter();
                return Ok(names.zip(found).map(Row::exact).collect());
            }
            Run::Experiment => return experiment(args, signals),
            Run::Deck => factors::of_deck(&deck::parse_named(&self.name, self.file.clone())?)?,
            Run::Factors => factors::of_file(&self.name, &self.problem()?, false)?,
        };
        let names = || factors.surfaces.iter().enumerate();
        let pairs = names().flat_map(|from| names().map(move |to| (from, to)));
        let pair = |((i, from), (j, to)): ((usize, &String), (usize, &String))| {
            let factor = factors.factors.whole_row(i)[j];
            Row::exact((format!("{from} -> {to}"), Some(factor)))
        };
        Ok(pairs.map(pair).collect())
    }

    fn row(&self, source: &str, Number(name, expected, allowed): &Number, found: &[Row]) -> Row {
        let found = found.iter().find(|row| row.case == *name);
        let mut row = found.cloned().unwrap_or_default();
        row.source = source.to_owned();
        row.case = match self.name.as_str() {
            "" => name.clone(),
            case => format!("{case}: {name}"),
        };
        (row.expected, row.allowed) = (*expected, allowed.unwrap_or(self.allowed));
        let both = [Some(&mut row.ours), row.plain.as_mut()];
        row.agrees = both.into_iter().flatten().all(|ours| {
            let error = ours.std_error.filter(|&error| error > 0.0);
            ours.z = ours
                .got
                .zip(error)
                .map(|(got, error)| (got - expected) / error);
            row.allowed.contains(*expected, ours)
        });
        row
    }
}

/// u at the targets of a problem.
fn walked(problem: &Problem, signals: &Signals) -> Result<Vec<Row>, Failure> {
    let walks = problem.resolved.settings.walk_options().walks;
    let progress = Progress::new(walks.saturating_mul(problem.goals.len() as u64), signals);
    let report = solve::report(problem, &progress);
    progress.done();
    // What was interrupted has no rows, and its case says why there are none.
    let Some(report) = report? else {
        return Ok(Vec::new());
    };
    let rows = report.goals.iter().map(|goal| {
        let ours = |found: &EstimateReport| Ours {
            got: found.estimate,
            std_error: found.std_error,
            z: None,
            rounding_floor: goal.rounding_floor,
        };
        // Resolvent walks have no plain ones beside them.
        let plain = goal.plain.estimate.map(|_| ours(&goal.plain));
        Row {
            case: goal.name.clone(),
            ours: ours(&goal.preconditioned),
            plain,
            ..Row::default()
        }
    });
    Ok(rows.collect())
}

fn experiment(args: &Common, signals: &Signals) -> Result<Vec<Row>, Failure> {
    let experiment = PaperArgs {
        max_walks: 100_000,
        degree: 0,
        seed: 1995,
        common: args.clone(),
        out: None,
    };
    let paper::Table { rows, rates, .. } = paper::compute(&experiment, signals)?;
    let mut found = vec![("√Var^pmc ~ n^".to_owned(), rates.sd_pmc_against_n)];
    for row in rows.iter().filter(|row| row.walks == experiment.max_walks) {
        let (n, [plain, ours]) = (row.n, row.deviations().map(Some));
        found.push((format!("√Var^mc, n = {n}"), plain));
        found.push((format!("√Var^pmc, n = {n}"), ours));
    }
    for rates in &rates.errors_against_walks {
        found.push((format!("e^mc ~ N^, n = {}", rates.n), rates.e_mc));
        found.push((format!("e^pmc ~ N^, n = {}", rates.n), rates.e_pmc));
    }
    Ok(found.into_iter().map(Row::exact).collect())
}

/// The regular polygon in the unit circle, with ρ = 1/2 and F on a side the cosine of the angle of its middle.
fn polygon(sides: u32) -> String {
    let angle = |k: f64| TAU * k / f64::from(sides);
    let vertex = |k: u32| {
        let angle = angle(f64::from(k % sides) - 0.5);
        [angle.cos(), angle.sin()]
    };
    let side = |k: u32| {
        let (points, emission) = ([vertex(k), vertex(k + 1)], angle(f64::from(k)).cos());
        format!(
            "{{ name = 'side {k}', points = {points:?}, reflectance = 0.5, emission = {emission:?} }},\n"
        )
    };
    let sides: String = (0..sides).map(side).collect();
    format!("[problem]\nkind = 'room'\nsurface = [\n{sides}]\n")
}

impl Allowed {
    /// Whether a number is as near as this says; what is not there, is not a number or lacks its error bar, is not.
    fn contains(self, expected: f64, ours: &Ours) -> bool {
        let got = ours.got.unwrap_or(f64::NAN);
        match self {
            Self::StandardErrors(most) => (ours.std_error)
                .is_some_and(|error| (got - expected).abs() <= most * error + ours.rounding_floor),
            Self::Difference(most) => (got - expected).abs() <= most,
            Self::Factor(most) => (1.0 / most..=most).contains(&(got / expected)),
        }
    }
}

impl Row {
    /// A number without an error bar.
    fn exact((name, got): (impl Into<String>, Option<f64>)) -> Self {
        let mut row = Self::default();
        (row.case, row.ours.got) = (name.into(), got);
        row
    }

    /// What stands in the columns of the table.
    fn texts(&self) -> Vec<String> {
        let z = |z: Option<f64>| z.map_or("-".to_owned(), |z| format!("{z:.1}"));
        let (digits, allowed) = match self.allowed {
            Allowed::StandardErrors(most) => (Some(9), format!("|z| <= {most}")),
            Allowed::Difference(most) if most < 1e-9 => (Some(12), format!("± {most:e}")),
            Allowed::Difference(most) => (Some(3), format!("± {most}")),
            Allowed::Factor(most) => (None, format!("factor {most}")),
        };
        let number = |x: f64| digits.map_or_else(|| short(x), |digits| format!("{x:.digits$}"));
        let ours = match (self.ours.got, self.ours.std_error) {
            (Some(got), Some(error)) => with_error(got, Some(error)),
            (Some(got), None) => number(got),
            (None, _) => "nothing".to_owned(),
        };
        let (case, expected) = (self.case.clone(), number(self.expected));
        let plain = z(self.plain.as_ref().and_then(|plain| plain.z));
        let verdict = if self.agrees { "agrees" } else { "DISAGREES" }.to_owned();
        vec![
            case,
            expected,
            ours,
            z(self.ours.z),
            plain,
            allowed,
            verdict,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::{Allowed, Ours};

    #[test]
    fn a_wrong_number_and_an_estimate_without_an_error_bar_disagree() {
        let agrees = |got, std_error, allowed: Allowed, expected| {
            let ours = Ours {
                got,
                std_error,
                rounding_floor: 0.002,
                ..Ours::default()
            };
            allowed.contains(expected, &ours)
        };
        let cases = [
            (
                Allowed::Difference(1e-12),
                0.3,
                vec![0.3 + 1e-13],
                vec![0.3 + 2e-12],
            ),
            (
                Allowed::Factor(3.0),
                7.7,
                vec![2.6, 23.0],
                vec![2.5, 23.2, -7.7, 0.0],
            ),
            (
                Allowed::default(),
                1.0,
                vec![1.041, 0.959],
                vec![1.043, 0.957],
            ),
        ];
        for (allowed, expected, right, wrong) in cases {
            let is_near = |got: &f64| agrees(Some(*got), Some(0.01), allowed, expected);
            assert!(right.iter().all(is_near), "{right:?}");
            assert!(!wrong.iter().chain(&[f64::NAN]).any(is_near), "{wrong:?}");
            assert!(!agrees(None, Some(0.01), allowed, expected));
        }
        assert!(!agrees(Some(1.0), None, Allowed::default(), 1.0));
    }
}
