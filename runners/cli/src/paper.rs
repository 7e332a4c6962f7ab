//! `fredholm paper`: the experiment of Heinrich 1995, section 5, beside its printed numbers.

use core::f64::consts::TAU;
use std::time::Instant;

use fredholm::answer::{Solved, Walks};
use fredholm::circle::{CircleModel, Emission};
use fredholm::model::{Request, Wanted};
use fredholm::{Discretisation, Estimator, Form, Goal, Model, Pairs, Region, Settings};
use fredholm_circle::Harmonic;
use fredholm_core::{RngUniforms, StopReason, Uniforms, WalkSeeds};
use fredholm_plot::{Curve, LogLogPlot, Style};
use serde::Serialize;

use crate::args::PaperArgs;
use crate::failure::{Ended, Failure, print, say};
use crate::numbers::{aligned, short, slope};
use crate::progress::{Progress, Signals};
use crate::table;
use crate::threads::with_threads;
use fredholm_file::parts::output::{Output, open_all};

/// C = 5, D = 1, ℓ = 5.
const LIGHT: Harmonic = Harmonic {
    constant: 5.0,
    amplitude: 1.0,
    frequency: 5,
};
/// ρ*, the largest reflectance.
const LARGEST_REFLECTANCE: f64 = 0.75;
/// q0.
const ABSORPTION: f64 = 0.2;
/// The numbers n of cells.
const SIZES: [usize; 3] = [10, 100, 1000];
/// n0 arcs and m0 points.
const ARCS: usize = 10;
const POINTS: usize = 10;

/// The paper's table: n, N, e^rad, e^mc, e^pmc, √Var^mc, √Var^pmc.
#[rustfmt::skip]
const PRINTED: [(usize, u64, [f64; 5]); 16] = [
    (10, 10, [0.286, 1.26, 0.139, 7.76, 0.621]),
    (10, 100, [0.286, 0.644, 0.0398, 7.14, 0.659]),
    (10, 1000, [0.286, 0.251, 0.0298, 7.77, 0.717]),
    (10, 10_000, [0.286, 0.0655, 0.0208, 7.70, 0.693]),
    (10, 100_000, [0.286, 0.0233, 0.0183, 7.67, 0.693]),
    (100, 10, [0.0364, 1.26, 0.0150, 7.76, 0.0764]),
    (100, 100, [0.0364, 0.644, 0.004_42, 7.14, 0.0891]),
    (100, 1000, [0.0364, 0.251, 0.002_84, 7.77, 0.0955]),
    (100, 10_000, [0.0364, 0.0655, 0.000_502, 7.70, 0.0983]),
    (100, 100_000, [0.0364, 0.0233, 0.000_371, 7.67, 0.0980]),
    (1000, 10, [0.003_44, 1.26, 0.000_973, 7.76, 0.007_04]),
    (1000, 100, [0.003_44, 0.644, 0.000_349, 7.14, 0.008_03]),
    (1000, 1000, [0.003_44, 0.251, 0.000_286, 7.77, 0.008_44]),
    (1000, 10_000, [0.003_44, 0.0655, 0.000_078_1, 7.70, 0.009_06]),
    (1000, 100_000, [0.003_44, 0.0233, 0.000_019_0, 7.67, 0.008_74]),
    (1000, 1_000_000, [0.003_44, 0.007_20, 0.000_006_60, 7.68, 0.008_80]),
];

/// Errors of the Galerkin solution, of plain and of preconditioned walks, and standard deviations of both walks.
#[derive(Clone, Copy, Debug, Serialize)]
struct Numbers {
    e_rad: f64,
    e_mc: f64,
    e_pmc: f64,
    sd_mc: f64,
    sd_pmc: f64,
}

impl Numbers {
    const fn new([e_rad, e_mc, e_pmc, sd_mc, sd_pmc]: [f64; 5]) -> Self {
        Self {
            e_rad,
            e_mc,
            e_pmc,
            sd_mc,
            sd_pmc,
        }
    }

    const fn all(&self) -> [f64; 5] {
        [self.e_rad, self.e_mc, self.e_pmc, self.sd_mc, self.sd_pmc]
    }
}

/// A row of the table, averaged over the points.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Row {
    pub(crate) n: usize,
    pub(crate) walks: u64,
    #[serde(flatten)]
    ours: Numbers,
    se_mc: f64,
    se_pmc: f64,
    paper: Option<Numbers>,
}

impl Row {
    /// √Var of plain and of preconditioned walks.
    pub(crate) const fn deviations(&self) -> [f64; 2] {
        [self.ours.sd_mc, self.ours.sd_pmc]
    }
}

/// Fitted exponents; `None` where there are too few rows.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Rates {
    /// √Var^pmc ~ n^…, from the rows with the most walks that every n has.
    pub(crate) sd_pmc_against_n: Option<f64>,
    /// Errors ~ N^… for every n.
    pub(crate) errors_against_walks: Vec<ErrorRates>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct ErrorRates {
    pub(crate) n: usize,
    pub(crate) e_mc: Option<f64>,
    pub(crate) e_pmc: Option<f64>,
}

/// Everything that `paper --json` prints.
#[derive(Debug, Serialize)]
pub(crate) struct Table {
    degree: usize,
    seed: u64,
    reflectance: Vec<f64>,
    points: Vec<f64>,
    seconds: f64,
    pub(crate) rows: Vec<Row>,
    pub(crate) rates: Rates,
}

/// The random choices that the paper does not print: ρ_i on [0, ρ*] and the points on [0, 2π),
/// from draws that no walk uses.
fn choices(seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut draws = RngUniforms(<WalkSeeds>::new(seed, u64::MAX).generator(0));
    let mut uniform = |scale: f64| -> f64 {
        let xi: f64 = draws.uniform();
        xi * scale
    };
    let reflectance = (0..ARCS).map(|_| uniform(LARGEST_REFLECTANCE)).collect();
    let points = (0..POINTS).map(|_| uniform(TAU)).collect();
    (reflectance, points)
}

/// Runs `paper`.
pub(crate) fn paper(args: &PaperArgs, signals: &Signals) -> Result<Ended, Failure> {
    let names = ["table.csv", "table.json", "error.svg", "deviation.svg"];
    let outputs = match &args.out {
        Some(folder) => Some(open_all("--out", folder, names)?),
        None => None,
    };
    let table = with_threads(args.common.threads, || compute(args, signals))??;
    let json = table::json(&table)?;
    // An interrupted table may have no rows to draw: then there are no files either.
    let written = match outputs {
        Some(outputs) if !signals.interrupted() => table.write(outputs, &json),
        _ => Ok(()),
    };
    print(if args.common.json { json } else { table.text() })?;
    if signals.interrupted() {
        say("warning: interrupted; the rows that were finished are printed");
        return Ok(Ended::Interrupted);
    }
    written.map(|()| Ended::Done)
}

/// The rows of the table: 10, 100, … walks, up to 10⁵, at n = 1000 up to 10⁶.
fn rows(most: u64) -> Vec<(usize, u64)> {
    let mut rows = Vec::new();
    for n in SIZES {
        let most = if n == 1000 { most } else { most.min(100_000) };
        let powers = core::iter::successors(Some(10_u64), |walks| walks.checked_mul(10));
        rows.extend(powers.take_while(|&walks| walks <= most).map(|w| (n, w)));
    }
    rows
}

/// The table, or as much of it as was finished before an interruption.
pub(crate) fn compute(args: &PaperArgs, signals: &Signals) -> Result<Table, Failure> {
    let start = Instant::now();
    let (reflectance, points) = choices(args.seed);
    let goal = |&s: &f64| Goal::new(format!("{s}"), Region::Point(vec![s]));
    let goals: Vec<Goal> = points.iter().map(goal).collect();
    let model = CircleModel::new(reflectance.clone(), Emission::Harmonic(LIGHT));
    let settings = Settings {
        form: Some(Form::Product),
        degree: Some(args.degree),
        // At degree > 0 the kink of p on the diagonal would hold the deviation at 1/n.
        pairs: Some(if args.degree == 0 {
            Pairs::Paper
        } else {
            Pairs::Default
        }),
        absorption: Some(ABSORPTION),
        estimator: Some(Estimator::Absorption),
        seed: args.seed,
        ..Settings::default()
    };
    let cut: Discretisation = settings.discretisation();
    let maker = Walks {
        model: &model,
        scalar: settings.scalar,
        execution: None,
    };
    let wanted = rows(args.max_walks);
    let walks = wanted.iter().fold(0_u64, |sum, &(_, walks)| {
        sum.saturating_add(walks.saturating_mul(POINTS as u64))
    });
    let progress = Progress::new(walks, signals);
    let mut rows = Vec::new();
    'all: for n in SIZES {
        let cells = model.partition(&cut.on(n)).map_err(Failure::run)?;
        let solved = Solved::new(&*cells).map_err(Failure::run)?;
        for &(_, walks) in wanted.iter().filter(|row| row.0 == n) {
            let mut walk = settings.walk_options();
            walk.walks = walks;
            let request = Request {
                goals: &goals,
                walk: &walk,
                wanted: Wanted::U,
            };
            let answer = solved.walk(&maker, &request, &progress);
            let answer = answer.map_err(Failure::run)?;
            let outcome = answer.outcome;
            if outcome.stop != StopReason::Done {
                break 'all;
            }
            let mean =
                |value: &dyn Fn(usize) -> f64| (0..POINTS).map(value).sum::<f64>() / POINTS as f64;
            let off = |i: usize, u: f64| (u - LIGHT.solution(points[i])).abs();
            let plain = |i: usize| outcome.statistics[i].plain();
            let preconditioned = |i: usize| outcome.statistics[i].preconditioned();
            let or_nan = |number: Option<f64>| number.unwrap_or(f64::NAN);
            let mut printed = PRINTED.iter().filter(|_| args.degree == 0);
            let printed = printed.find(|row| (row.0, row.1) == (n, walks));
            rows.push(Row {
                n,
                walks,
                ours: Numbers::new([
                    mean(&|i| off(i, answer.galerkin[i])),
                    mean(&|i| off(i, plain(i).estimate)),
                    mean(&|i| off(i, preconditioned(i).estimate)),
                    mean(&|i| or_nan(plain(i).std_dev)),
                    mean(&|i| or_nan(preconditioned(i).std_dev)),
                ]),
                se_mc: mean(&|i| or_nan(plain(i).std_error)),
                se_pmc: mean(&|i| or_nan(preconditioned(i).std_error)),
                paper: printed.map(|row| Numbers::new(row.2)),
            });
        }
    }
    progress.done();
    Ok(Table {
        degree: args.degree,
        seed: args.seed,
        reflectance,
        points,
        seconds: start.elapsed().as_secs_f64(),
        rates: rates(&rows),
        rows,
    })
}

fn rates(rows: &[Row]) -> Rates {
    let log = |x: f64, y: f64| (x.ln(), y.ln());
    let of = |n: usize| rows.iter().filter(move |row| row.n == n);
    let most = |n: usize| of(n).map(|row| row.walks).max().unwrap_or(0);
    let common = SIZES.into_iter().map(most).min();
    let at_common = rows.iter().filter(|row| Some(row.walks) == common);
    let errors = |n: usize, error: fn(&Numbers) -> f64| {
        slope(of(n).map(|row| log(row.walks as f64, error(&row.ours))))
    };
    Rates {
        sd_pmc_against_n: slope(at_common.map(|row| log(row.n as f64, row.ours.sd_pmc))),
        errors_against_walks: SIZES
            .map(|n| ErrorRates {
                n,
                e_mc: errors(n, |ours| ours.e_mc),
                e_pmc: errors(n, |ours| ours.e_pmc),
            })
            .to_vec(),
    }
}

impl Table {
    /// The table for people.
    fn text(&self) -> String {
        let names = ["e^rad", "e^mc", "e^pmc", "√Var^mc", "√Var^pmc"];
        let line = |first: [String; 3], rest: [String; 5]| [first.to_vec(), rest.to_vec()].concat();
        let head = ["n", "N", ""].map(str::to_owned);
        let mut lines = vec![line(head, names.map(str::to_owned))];
        for row in &self.rows {
            let mut texts = row.ours.all().map(short);
            for (text, error) in texts[1..].iter_mut().zip([row.se_mc, row.se_pmc]) {
                *text += &format!(" ({})", short(error));
            }
            let head = [row.n.to_string(), row.walks.to_string(), "here".to_owned()];
            lines.push(line(head, texts));
            let paper = row.paper.map(|paper| paper.all().map(short));
            lines.extend(paper.map(|texts| line(["", "", "paper"].map(str::to_owned), texts)));
        }
        let rate = |rate: Option<f64>| rate.map_or("-".to_owned(), |rate| format!("{rate:.2}"));
        let mut text = format!(
            "Heinrich 1995, section 5: radiosity on the circle, averages over {POINTS} points, seed {}\n\
             e: absolute error of the Galerkin solution (rad), of plain (mc) and of preconditioned\n\
             Monte Carlo (pmc), in brackets the standard error; √Var: standard deviation of a walk.\n\
             {}\n\n{}\nfitted rates\n  √Var^pmc ~ n^{}\n",
            self.seed,
            match self.degree {
                0 => "The paper's reflectances and points are random and not printed: sizes agree within a\n\
                      factor of about 3, rates should agree."
                    .to_owned(),
                degree => format!(
                    "The paper's are piecewise constants; these are polynomials of degree {degree} on every \
                     cell,\nwith pairs of a cell with itself pointwise."
                ),
            },
            aligned(&lines),
            rate(self.rates.sd_pmc_against_n),
        );
        for rates in &self.rates.errors_against_walks {
            text += &format!(
                "  n = {:<4}  e^mc ~ N^{}   e^pmc ~ N^{}\n",
                rates.n,
                rate(rates.e_mc),
                rate(rates.e_pmc)
            );
        }
        text += &format!("\n{} s\n", short(self.seconds));
        text
    }

    fn csv(&self) -> Result<Vec<u8>, Failure> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let header = "n walks e_rad e_mc e_pmc sd_mc sd_pmc se_mc se_pmc paper_e_rad paper_e_mc paper_e_pmc paper_sd_mc \
                      paper_sd_pmc";
        let header = header.split(' ');
        writer.write_record(header).map_err(Failure::run)?;
        for row in &self.rows {
            let paper = row.paper.map_or([None; 5], |paper| paper.all().map(Some));
            let record = (
                row.n,
                row.walks,
                row.ours.all(),
                row.se_mc,
                row.se_pmc,
                paper,
            );
            writer.serialize(record).map_err(Failure::run)?;
        }
        writer.into_inner().map_err(Failure::run)
    }

    /// Writes table.csv, table.json and the two figures.
    fn write(&self, outputs: [Output; 4], json: &str) -> Result<(), Failure> {
        let [csv, json_file, error, deviation] = outputs;
        csv.finish(self.csv()?)?;
        json_file.finish(json)?;
        error.finish(table::drawn(self.error_figure().draw())?)?;
        Ok(deviation.finish(table::drawn(self.deviation_figure().draw())?)?)
    }

    /// The cells for which there are rows, with the row of the most walks.
    fn last_rows(&self) -> Vec<Row> {
        let of_cells = self.rows.chunk_by(|a, b| a.n == b.n);
        of_cells.filter_map(|rows| rows.last().copied()).collect()
    }

    /// Errors against N.
    fn error_figure(&self) -> LogLogPlot {
        let last = self.last_rows();
        let curve = |name: String, n: usize, style: Style, y: fn(&Numbers) -> f64| {
            let rows = self.rows.iter().filter(|row| row.n == n);
            let points = rows.map(|row| (row.walks as f64, y(&row.ours)));
            Curve::new(name, style, points)
        };
        let mut curves = Vec::new();
        // Plain walks do not know of n: the longest curve is every other's continuation.
        if let Some(longest) = last.last() {
            let name = "plain Monte Carlo".to_owned();
            let plain = curve(name, longest.n, Style::marked(0, 1), |ours| ours.e_mc);
            curves.push(plain);
        }
        for (index, Row { n, .. }) in last.iter().enumerate() {
            let (name, style) = (format!("Galerkin, n = {n}"), Style::dashed(index + 1));
            curves.push(curve(name, *n, style, |ours| ours.e_rad));
            let marker = [0, 2, 3][index % 3];
            let (name, style) = (
                format!("preconditioned, n = {n}"),
                Style::marked(index + 1, marker),
            );
            curves.push(curve(name, *n, style, |ours| ours.e_pmc));
        }
        let plain = curves.first().map_or(&[][..], |plain| &plain.points[..]);
        if let [first, ..] = *plain {
            let (from, to) = ((first.0, 0.3 * first.1), plain[plain.len() - 1].0);
            curves.push(Curve::power_law("slope −1/2", -0.5, from, to));
        }
        LogLogPlot {
            title: "Error against the number of walks".to_owned(),
            x_label: "walks N for each point".to_owned(),
            y_label: "mean absolute error of u over ten points".to_owned(),
            curves,
        }
    }

    /// √Var against n.
    fn deviation_figure(&self) -> LogLogPlot {
        let last = self.last_rows();
        let curve = |name: &str, style: Style, y: fn(&Row) -> Option<f64>| {
            let points = last.iter().filter_map(|row| Some((row.n as f64, y(row)?)));
            Curve::new(name, style, points)
        };
        let plain = Style::marked(0, 1);
        let mut curves = vec![
            curve("plain Monte Carlo", plain, |row| Some(row.ours.sd_mc)),
            curve("preconditioned", Style::marked(1, 0), |row| {
                Some(row.ours.sd_pmc)
            }),
        ];
        if self.degree == 0 {
            let style = Style {
                dashed: true,
                ..Style::marked(5, 2)
            };
            let printed = |row: &Row| Some(row.paper?.sd_pmc);
            curves.push(curve("the paper's numbers", style, printed));
        }
        if let (Some(first), Some(end)) = (last.first(), last.last()) {
            let from = (first.n as f64, 2.0 * first.ours.sd_pmc);
            let slope = -(self.degree as f64 + 1.0);
            let name = format!("slope −{}", self.degree + 1);
            curves.push(Curve::power_law(&name, slope, from, end.n as f64));
        }
        LogLogPlot {
            title: "Standard deviation against cells".to_owned(),
            x_label: "cells n".to_owned(),
            y_label: "√Var, mean over ten points".to_owned(),
            curves,
        }
    }
}
