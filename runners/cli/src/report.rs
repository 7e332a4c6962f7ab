//! The answer of `solve`, as a table, as JSON and as CSV.

use fredholm::PairCounts;
use fredholm::choice::ChoiceReport;
use fredholm_core::{Estimate, Statistics};
use fredholm_plot::{Axis, BandPlot, Curve, Style};
use serde::Serialize;

use crate::failure::Failure;
use crate::numbers::{aligned, short, with_error};

/// Everything that `solve --json` prints. Names are a promise; fields may be added.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) problem: &'static str,
    /// d, of cubes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) dimension: Option<usize>,
    /// As the file counts them: of a cube, per axis.
    pub(crate) cells: usize,
    /// Unknowns in all: cells, where they are of degree 0.
    pub(crate) unknowns: usize,
    pub(crate) degree: usize,
    pub(crate) pairs: &'static str,
    /// With `pairs = "theory"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) pair_counts: Option<PairCounts>,
    pub(crate) absorption: f64,
    pub(crate) estimator: &'static str,
    pub(crate) scalar: &'static str,
    pub(crate) generator: &'static str,
    pub(crate) batch: u64,
    pub(crate) seed: u64,
    /// Why the walks ended: "done", "error_not_reached", "time_limit" or "cancelled".
    pub(crate) stop: &'static str,
    /// Gauss–Seidel sweeps of the Galerkin system, and the largest residual that the last one met.
    pub(crate) sweeps: u32,
    pub(crate) residual: f64,
    /// Visited states, starts included, over all targets.
    pub(crate) states: u64,
    pub(crate) setup_seconds: f64,
    pub(crate) walk_seconds: f64,
    pub(crate) targets: Vec<TargetReport>,
    /// What was chosen, where the file gives the error alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) split: Option<ChoiceReport>,
    /// The same in words.
    #[serde(skip)]
    pub(crate) choice: String,
    /// Of rooms with temperatures.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub(crate) energy: Option<EnergyReport>,
}

/// What every surface of a room gains and loses.
#[derive(Debug, Serialize)]
pub(crate) struct EnergyReport {
    /// The net flux out of every surface, in W per metre of depth; none where its material changes.
    surfaces: Vec<SurfaceReport>,
    /// Their sum: 0 in a closed room.
    energy_balance: Option<EstimateReport>,
}

#[derive(Debug, Serialize)]
struct SurfaceReport {
    name: String,
    net_flux: Option<EstimateReport>,
}

impl EnergyReport {
    /// Of these fluxes, if there are some.
    pub(crate) fn new(fluxes: Vec<(String, Option<Estimate>)>) -> Option<Self> {
        if fluxes.is_empty() {
            return None;
        }
        // Every surface has walks of its own: errors are independent.
        let known: Option<Vec<Estimate>> = fluxes.iter().map(|(_, flux)| *flux).collect();
        let square = |x: Option<f64>| x.map(|x| x * x);
        let energy_balance = known.map(|known| {
            let squares: Option<f64> = known.iter().map(|e| square(e.std_error)).sum();
            EstimateReport {
                estimate: Some(known.iter().map(|e| e.estimate).sum()),
                std_error: squares.map(f64::sqrt),
                std_dev: None,
            }
        });
        let surface = |(name, flux): (String, Option<Estimate>)| SurfaceReport {
            name,
            net_flux: flux.map(|flux| EstimateReport {
                estimate: Some(flux.estimate),
                std_error: flux.std_error,
                std_dev: flux.std_dev,
            }),
        };
        Some(Self {
            surfaces: fluxes.into_iter().map(surface).collect(),
            energy_balance,
        })
    }

    fn text(&self) -> String {
        let flux = |report: &Option<EstimateReport>| match report {
            Some(report) => report.text(0.0),
            None => "its material changes".to_owned(),
        };
        let mut rows = vec![
            ["net flux out of", "W per metre"]
                .map(str::to_owned)
                .to_vec(),
        ];
        for surface in &self.surfaces {
            rows.push(vec![surface.name.clone(), flux(&surface.net_flux)]);
        }
        if let Some(balance) = &self.energy_balance {
            rows.push(vec!["all".to_owned(), balance.text(0.0)]);
        }
        format!("\n{}", aligned(&rows))
    }
}

/// One target's answer; a grid has one for every point.
#[derive(Debug, Serialize)]
pub(crate) struct TargetReport {
    pub(crate) name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) at: Option<Coordinates>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) over: Option<Over>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) weight: Option<String>,
    pub(crate) exact: Option<f64>,
    pub(crate) galerkin: f64,
    pub(crate) walks: u64,
    pub(crate) rounding_floor: f64,
    pub(crate) endings: EndingsReport,
    pub(crate) plain: EstimateReport,
    pub(crate) preconditioned: EstimateReport,
    /// Of rooms: ∫ of the arriving u, and with temperatures the net flux out of the wall, of a surface in
    /// W per metre of depth, at a point in W/m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) irradiance: Option<EstimateReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) net_flux: Option<EstimateReport>,
}

/// A point: an angle, or coordinates.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum Coordinates {
    One(f64),
    Many(Vec<f64>),
    On { surface: String, t: f64 },
}

impl Coordinates {
    /// The abscissa of a grid's point.
    fn first(&self) -> Option<f64> {
        match self {
            Self::One(s) => Some(*s),
            Self::Many(x) => x.first().copied(),
            Self::On { t, .. } => Some(*t),
        }
    }

    /// As one entry of a table.
    fn text(&self) -> String {
        match self {
            Self::One(s) => s.to_string(),
            Self::Many(x) => {
                let texts: Vec<String> = x.iter().map(f64::to_string).collect();
                texts.join(" ")
            }
            Self::On { surface, t } => format!("{surface} {t}"),
        }
    }
}

/// Of what a mean is taken.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(crate) enum Over {
    Interval([f64; 2]),
    Word(String),
}

/// How walks ended.
#[derive(Debug, Serialize)]
pub(crate) struct EndingsReport {
    pub(crate) absorbed: u64,
    pub(crate) step_limit: u64,
}

/// An estimate; `None` where there is nothing to tell.
#[derive(Debug, Serialize)]
pub(crate) struct EstimateReport {
    pub(crate) estimate: Option<f64>,
    pub(crate) std_error: Option<f64>,
    pub(crate) std_dev: Option<f64>,
}

impl EstimateReport {
    /// Of so many walks.
    pub(crate) fn new(estimate: Estimate, walks: u64) -> Self {
        Self {
            estimate: (walks > 0).then_some(estimate.estimate),
            std_error: estimate.std_error,
            std_dev: estimate.std_dev,
        }
    }

    /// With its standard error or, where that is larger, what rounding leaves.
    fn text(&self, floor: f64) -> String {
        match (self.estimate, self.std_error) {
            (None, _) => "no walks".to_owned(),
            (Some(estimate), None) if self.std_dev.is_none() => format!("{estimate:.6}, one walk"),
            (Some(estimate), Some(error)) if error < floor => {
                format!("{} (rounding)", with_error(estimate, Some(floor)))
            }
            (Some(estimate), error) => with_error(estimate, error),
        }
    }
}

impl EndingsReport {
    /// Of these walks.
    pub(crate) fn new(statistics: &Statistics) -> Self {
        let endings = statistics.endings();
        Self {
            absorbed: endings.absorbed,
            step_limit: endings.step_limit,
        }
    }
}

impl Report {
    /// The table for people.
    pub(crate) fn table(&self) -> String {
        let mut rows = vec![
            [
                "target",
                "exact",
                "Galerkin",
                "plain",
                "preconditioned",
                "gain",
            ]
            .map(str::to_owned)
            .to_vec(),
        ];
        for target in &self.targets {
            let gain = match (target.plain.std_dev, target.preconditioned.std_dev) {
                (Some(plain), Some(preconditioned)) if preconditioned > 0.0 && plain > 0.0 => {
                    short(plain / preconditioned)
                }
                _ => "-".to_owned(),
            };
            let mut row = vec![
                target.name.clone(),
                target.exact.map_or("-".to_owned(), |u| format!("{u:.9}")),
                number_or_dash(target.galerkin),
                target.plain.text(target.rounding_floor),
                target.preconditioned.text(target.rounding_floor),
                gain,
            ];
            let besides = [&target.irradiance, &target.net_flux];
            for report in besides.into_iter().flatten() {
                row.push(report.text(target.rounding_floor));
            }
            rows.push(row);
        }
        let any = |of: fn(&TargetReport) -> bool| self.targets.iter().any(of);
        if any(|t| t.irradiance.is_some()) {
            rows[0].push("irradiance".to_owned());
        }
        if any(|t| t.net_flux.is_some()) {
            rows[0].push("net flux".to_owned());
        }
        let cells = self
            .cells
            .saturating_pow(self.dimension.unwrap_or(1) as u32);
        format!(
            "{}{}{}, {} cell{}{}, {} pairs{}, {} estimator, {}, seed {}\n\n{}{}\n\
             {} walks, {} states, set-up {} s, walks {} s\n",
            self.choice,
            self.problem,
            self.dimension
                .map_or(String::new(), |d| format!(" of dimension {d}")),
            cells,
            if cells == 1 { "" } else { "s" },
            if self.degree == 0 {
                String::new()
            } else {
                format!(" of degree {} ({} unknowns)", self.degree, self.unknowns)
            },
            self.pairs,
            self.pair_counts
                .map_or(String::new(), |counts| counts.text()),
            self.estimator,
            self.scalar,
            self.seed,
            aligned(&rows),
            self.energy
                .as_ref()
                .map_or(String::new(), EnergyReport::text),
            self.targets.iter().map(|t| t.walks).sum::<u64>(),
            self.states,
            short(self.setup_seconds),
            short(self.walk_seconds),
        )
    }

    /// What a reader of the numbers should know besides.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let mut remark = |found: usize, text: &str| {
            if found > 0 {
                let targets = if found == 1 { "target" } else { "targets" };
                remarks.push(format!("{found} {targets}: {text}"));
            }
        };
        let count = |condition: &dyn Fn(&TargetReport) -> bool| {
            self.targets.iter().filter(|&t| condition(t)).count()
        };
        // The last digits of f64 are no news.
        let matters = |t: &TargetReport| {
            let size = t.preconditioned.estimate.unwrap_or(0.0).abs();
            t.rounding_floor > 1e-11 * size
        };
        remark(
            count(&|t| {
                let error = t.preconditioned.std_error;
                matters(t) && error.is_some_and(|error| error < t.rounding_floor)
            }),
            "the standard error is below the rounding floor, which more walks do not lower; \
             use scalar = \"f64\" or believe the floor",
        );
        remark(
            count(&|t| t.endings.step_limit > 0),
            "walks were cut off at the step limit: a possible bias; raise `absorption`",
        );
        remark(
            count(&|t| t.walks > 1 && t.preconditioned.std_error.is_none()),
            "no walk scored anything, so there is no error bar",
        );
        remarks
    }

    /// One JSON document.
    pub(crate) fn json(&self) -> Result<String, Failure> {
        let mut text = serde_json::to_string_pretty(self).map_err(Failure::run)?;
        text.push('\n');
        Ok(text)
    }

    /// One row a target.
    pub(crate) fn csv(&self) -> Result<String, Failure> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for target in &self.targets {
            writer
                .serialize(CsvRow::new(target))
                .map_err(Failure::run)?;
        }
        let bytes = writer.into_inner().map_err(Failure::run)?;
        String::from_utf8(bytes).map_err(Failure::run)
    }

    /// A picture of the grid target whose points are called `name[0]`, `name[1]`, …
    pub(crate) fn svg(&self, name: &str) -> Result<String, Failure> {
        let on_grid = |target: &&TargetReport| {
            let rest = target.name.strip_prefix(name);
            rest.is_some_and(|rest| rest.starts_with('['))
        };
        let points: Vec<&TargetReport> = self.targets.iter().filter(on_grid).collect();
        let exact: Vec<_> = points
            .iter()
            .filter_map(|t| Some((t.at.as_ref()?.first()?, t.exact?)))
            .collect();
        let mut curves = Vec::new();
        if !exact.is_empty() {
            let style = Style {
                colour: 0,
                marker: None,
                dashed: true,
            };
            curves.push(Curve {
                name: "exact solution".to_owned(),
                points: exact,
                style,
            });
        }
        let band = BandPlot {
            title: format!("{name}: the solution with its 95 % error band"),
            axis: match self.problem {
                "circle" => Axis::Angle,
                "room" => Axis::Surface,
                _ => Axis::Unit,
            },
            name: "preconditioned walks".to_owned(),
            points: points
                .iter()
                .filter_map(|t| {
                    let estimate = &t.preconditioned;
                    let at = t.at.as_ref()?.first()?;
                    Some((at, estimate.estimate?, estimate.std_error.unwrap_or(0.0)))
                })
                .collect(),
            curves,
        };
        band.svg().map_err(Failure::run)
    }
}

/// With six decimals, where it is one.
fn number_or_dash(x: f64) -> String {
    if x.is_nan() {
        "-".to_owned()
    } else {
        format!("{x:.6}")
    }
}

/// A target in one line.
#[derive(Serialize)]
struct CsvRow<'a> {
    name: &'a str,
    at: Option<String>,
    from: Option<f64>,
    to: Option<f64>,
    weight: Option<&'a str>,
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
}

impl<'a> CsvRow<'a> {
    fn new(target: &'a TargetReport) -> Self {
        let interval = match target.over {
            Some(Over::Interval(interval)) => Some(interval),
            _ => None,
        };
        Self {
            name: &target.name,
            at: target.at.as_ref().map(Coordinates::text),
            from: interval.map(|over| over[0]),
            to: interval.map(|over| over[1]),
            weight: target.weight.as_deref(),
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
        }
    }
}
