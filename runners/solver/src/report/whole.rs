//! The report of a global estimate at some regions.

use fredholm_core::Estimate;
use fredholm_model::numbers::{aligned, short, with_error};
use fredholm_model::{Flux, GlobalQuantity};
use serde::{Serialize, Serializer};

use super::csv::{COLUMNS_OF_GOALS, COLUMNS_OF_WHOLE, CsvTable, Entry, of_columns};
use super::text::{heads_of_heats, heats, named, with_unit};
use super::{Coordinates, EndingsReport, EnergyReport, EstimateReport, GoalReport, Over, Report};
use crate::choice::Chosen;
use crate::{
    Choices, Error, GlobalCoefficients, GlobalEstimate, GlobalSummary, GlobalValue, Goal, Method,
    Region, Settings,
};

/// The report of a global estimate: its summary, and its values at the regions that were asked for. The serialised names are
/// stable; fields may be added.
///
/// ```
/// use fredholm::{CubeModel, Goal, Region, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let whole = Solver::new(&u).cells(4).walks(5000).whole()?;
/// let report = whole.report(&[Goal::new("middle", Region::Point(vec![0.5]))])?;
/// assert!(report.table().contains("middle"));
/// assert!(report.csv()?.starts_with("name,at,"));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct GlobalReport {
    /// The function's summary.
    #[serde(flatten)]
    pub summary: GlobalSummary,
    /// Seconds of the values.
    pub value_seconds: f64,
    /// The unit of u, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// The values.
    #[serde(serialize_with = "written")]
    pub targets: Vec<GoalReport>,
    /// The net fluxes of a room with temperatures.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergyReport>,
    /// The means over all cells of a scene: its global estimate has no values at points.
    #[serde(serialize_with = "written", skip_serializing_if = "Vec::is_empty")]
    pub mesh: Vec<GoalReport>,
    /// Means over the cells that were asked for: in columns, and in no document.
    #[serde(skip)]
    pub means: Vec<GlobalValue>,
    /// The coefficients of the function; `None` unless somebody puts them here ([`GlobalEstimate::coefficients`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coefficients: Option<GlobalCoefficients>,
}

/// A goal as the document of a global estimate has it.
#[derive(Serialize)]
struct Written<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    at: &'a Option<Coordinates>,
    #[serde(skip_serializing_if = "Option::is_none")]
    position: &'a Option<Vec<f64>>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    corners: &'a [[f64; 3]],
    #[serde(skip_serializing_if = "Option::is_none")]
    over: &'a Option<Over>,
    #[serde(skip_serializing_if = "Option::is_none")]
    weight: &'a Option<String>,
    exact: Option<f64>,
    estimate: Option<f64>,
    std_error: Option<f64>,
    band: Option<f64>,
    iterate: Option<f64>,
    quadrature_error: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    z: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    irradiance: Option<EstimateReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    net_flux: Option<EstimateReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    temperature: Option<EstimateReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    radiant_temperature: Option<EstimateReport>,
}

/// Writes goals as the document of a global estimate has them.
fn written<S: Serializer>(goals: &[GoalReport], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(goals.iter().map(|goal| Written {
        name: &goal.name,
        at: &goal.at,
        position: &goal.position,
        corners: &goal.corners,
        over: &goal.over,
        weight: &goal.weight,
        exact: goal.exact,
        estimate: goal.preconditioned.estimate,
        std_error: goal.preconditioned.std_error,
        band: goal.band,
        iterate: goal.iterate,
        quadrature_error: goal.quadrature_error,
        error: goal.error,
        z: goal.z,
        irradiance: goal.irradiance,
        net_flux: goal.net_flux,
        temperature: goal.temperature,
        radiant_temperature: goal.radiant_temperature,
    }))
}

/// The value as an estimate of so many walks.
pub(super) fn estimate(value: &GlobalValue) -> Estimate {
    Estimate {
        estimate: value.estimate,
        std_error: value.std_error,
        std_dev: None,
    }
}

impl GlobalReport {
    /// Adds the means of u between goals of these numbers: of each cell a corner, and its neighbours.
    ///
    /// # Errors
    /// As [`GlobalEstimate::means_between`].
    pub fn add_means(
        &mut self,
        function: &GlobalEstimate<'_>,
        goals: &[Goal],
        cells: &[Vec<usize>],
    ) -> Result<(), Error> {
        let start = web_time::Instant::now();
        let corner = |&i: &usize| goals.get(i).map(|goal| goal.region.clone());
        let cell = |cell: &Vec<usize>| cell.iter().map(corner).collect::<Option<Vec<_>>>();
        let cells = cells.iter().map(cell).collect::<Option<Vec<_>>>();
        let cells = cells.ok_or_else(|| Error::Region {
            message: "a cell lies between targets that are asked for".to_owned(),
        })?;
        self.means = function.means_between(&cells)?;
        self.value_seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// The targets, and then the cells of a mesh.
    pub(super) fn rows(&self) -> impl Iterator<Item = &GoalReport> {
        self.targets.iter().chain(&self.mesh)
    }

    /// The report as CSV, a row for every target and every cell of a mesh, with columns of the problem's own coordinates.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        let table = CsvTable {
            columns: &[COLUMNS_OF_GOALS, COLUMNS_OF_WHOLE].concat(),
            coordinates: of_columns(self.summary.problem, self.summary.dimension),
            more: &[],
            energy: self.energy.as_ref(),
            sensitivities: None,
        };
        table.text(self.rows(), Entry::written_out)
    }

    /// The report as a table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let has_errors = self.targets.iter().any(|target| target.error.is_some());
        let unit = self.unit;
        let own = |name: &str| with_unit(name, unit);
        let mut head: Vec<String> = ["target", "at"].map(str::to_owned).to_vec();
        let iterate = match (&self.summary.resolvent, self.mesh.is_empty()) {
            (Some(_), _) => "without walks",
            (_, true) => "F + T_K v",
            _ => "v",
        };
        head.extend(["exact", iterate, "global estimate", "band ±"].map(own));
        if has_errors {
            head.extend([own("error"), "z".to_owned()]);
        }
        let there = heats(&self.targets);
        head.extend(heads_of_heats(&self.targets));
        let mut rows = vec![head];
        let targets = self.targets.iter();
        rows.extend(targets.map(|target| target.row_of_whole(has_errors, there)));
        let summary = &self.summary;
        let mut about = vec![summary.to_string()];
        if let (Some(factor), Some(error)) = (summary.band_factor, summary.largest_std_error) {
            let [place, among] = match (self.mesh.len(), summary.is_of_targets) {
                (0, true) => ["at all of these points", "of these"],
                (0, _) => ["at all points", "among some 256 points"],
                _ => ["on all cells", "of a cell"],
            };
            about.push(format!(
                "band: {} % {place} together, {} standard errors; the largest {among} is {}",
                short(100.0 * summary.band_level),
                short(factor),
                short(error)
            ));
        }
        about.push(format!(
            "set-up {} s, walks {} s, band {} s, values {} s",
            short(summary.setup_seconds),
            short(summary.walk_seconds),
            short(summary.band_seconds),
            short(self.value_seconds)
        ));
        let how = match &summary.chain {
            None => format!(
                "{} cells of degree {} ({} unknowns), resolvent walks",
                summary
                    .cells
                    .saturating_pow(summary.dimension.unwrap_or(1) as u32),
                summary.degree,
                summary.unknowns
            ),
            Some(chain) => chain.to_string(),
        };
        format!(
            "{}, {how}, {}, seed {}\n\n{}{}\n{}\n",
            named(summary.problem, summary.dimension),
            summary.scalar,
            summary.seed,
            aligned(&rows),
            self.energy
                .as_ref()
                .map_or(String::new(), EnergyReport::text),
            about.join("\n")
        )
    }
}

impl GoalReport {
    /// The report of a value of this function.
    pub(super) fn of_whole(
        function: &GlobalEstimate<'_>,
        goal: &Goal,
        exact: Option<f64>,
        value: &GlobalValue,
    ) -> Self {
        let (model, summary) = (function.model(), function.summary());
        let own = Self::of_value(model, goal, exact, (Some(value.estimate), value.std_error));
        Self {
            walks: summary.walks,
            replicates: Some(summary.replicates as u32),
            rounding_floor: summary.rounding_floor,
            no_difference: value.std_error == Some(0.0),
            endings: EndingsReport {
                absorbed: summary.walks - summary.step_limit - summary.left,
                step_limit: summary.step_limit,
            },
            preconditioned: EstimateReport {
                estimate: Some(value.estimate),
                std_error: value.std_error,
                ..own.preconditioned
            },
            band: value.band,
            iterate: Some(value.iterate),
            quadrature_error: value.quadrature_error,
            ..own
        }
    }

    fn row_of_whole(&self, has_errors: bool, there: [bool; 4]) -> Vec<String> {
        let optional = |x: Option<f64>| x.map_or(String::new(), short);
        let found = &self.preconditioned;
        let mut row = vec![
            self.title(),
            self.place().unwrap_or_default(),
            self.exact
                .map_or("-".to_owned(), |exact| format!("{exact:.7}")),
            format!("{:.7}", self.iterate.unwrap_or(f64::NAN)),
            with_error(found.estimate.unwrap_or(f64::NAN), found.std_error),
            optional(self.band),
        ];
        if has_errors {
            row.extend([optional(self.error), optional(self.z)]);
        }
        row.extend(self.texts_of_heat(there, |report| {
            with_error(report.estimate.unwrap_or(f64::NAN), report.std_error)
        }));
        row
    }
}

impl GlobalEstimate<'_> {
    /// The report of this function at these regions.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region.
    pub fn report(&self, goals: &[Goal]) -> Result<GlobalReport, Error> {
        let start = web_time::Instant::now();
        let regions: Vec<Region> = goals.iter().map(|goal| goal.region.clone()).collect();
        let mut report = self.report_of(goals, self.values(&regions)?)?;
        report.value_seconds = start.elapsed().as_secs_f64();
        Ok(report)
    }

    /// The report of these values.
    pub(crate) fn report_of(
        &self,
        goals: &[Goal],
        values: Vec<GlobalValue>,
    ) -> Result<GlobalReport, Error> {
        let model = self.model();
        let all = goals.iter().zip(values);
        let targets = all.map(|(goal, value)| {
            let exact = model.exact_of(goal)?;
            Ok(GoalReport::of_whole(self, goal, exact, &value))
        });
        let mut targets = targets.collect::<Result<Vec<_>, Error>>()?;
        self.add_heat(goals, &mut targets)?;
        targets.iter_mut().for_each(GoalReport::show_temperature);
        let mesh = self.mesh_report();
        Ok(GlobalReport {
            summary: self.summary().clone(),
            unit: model.about().unit,
            targets,
            energy: self.energy()?,
            value_seconds: 0.0,
            mesh,
            means: Vec::new(),
            coefficients: None,
        })
    }

    /// Adds irradiances, and what follows from them.
    fn add_heat(&self, goals: &[Goal], targets: &mut [GoalReport]) -> Result<(), Error> {
        let model = self.model();
        let Some(surfaces) = model.exchange() else {
            return Ok(());
        };
        let lit = |goal: &&Goal| surfaces.takes_walks(&goal.region, false);
        let regions: Vec<Region> = goals.iter().filter(lit).map(|g| g.region.clone()).collect();
        let irradiances = self.quantities(GlobalQuantity::Irradiance, &regions)?;
        let mut irradiances = irradiances.iter().map(estimate);
        for (goal, target) in goals.iter().zip(targets) {
            let own = match lit(&goal) {
                true => irradiances.next().filter(|h| !h.estimate.is_nan()),
                false => None,
            };
            let u = Estimate {
                estimate: target.preconditioned.estimate.unwrap_or(f64::NAN),
                std_error: target.preconditioned.std_error,
                std_dev: None,
            };
            // An estimate is there however few walks there were.
            target.add(&surfaces.heat_of(&goal.region, u, own), model, 1);
        }
        Ok(())
    }

    /// The net fluxes out of all parts, and their sum, if the model has them.
    fn energy(&self) -> Result<Option<EnergyReport>, Error> {
        let Some(surfaces) = self.model().exchange() else {
            return Ok(None);
        };
        let parts = surfaces.flux_surfaces();
        if parts.is_empty() {
            return Ok(None);
        }
        let mut regions: Vec<Region> = parts.iter().copied().map(Region::Part).collect();
        regions.push(Region::Parts(parts.clone()));
        let values = self.quantities(GlobalQuantity::NetFlux, &regions)?;
        let scale = surfaces.carried().flux_scale();
        let values = values.iter().map(estimate);
        let values: Vec<Estimate> =
            (values.map(|own| own.derived(scale * own.estimate, |x| scale * x))).collect();
        // The walks are those of all.
        let walks = self.summary().walks;
        let fluxes = parts.into_iter().zip(&values).map(|(part, value)| {
            let is_given = surfaces.is_flux_given(part);
            Flux {
                name: self.model().part(part).unwrap_or_default().to_owned(),
                walks: if is_given { 0 } else { walks },
                net_flux: Some(*value).filter(|flux| !flux.estimate.is_nan()),
                is_given,
            }
        });
        let all = values.last().copied();
        let all = all.filter(|all| !all.estimate.is_nan());
        let unit = self.model().about().flux_unit;
        Ok(
            EnergyReport::new(fluxes.collect(), unit).map(|energy| EnergyReport {
                // Errors of one set of walks depend on each other.
                energy_balance: all.map(|all| EstimateReport::new(all, walks, Some(unit))),
                ..energy
            }),
        )
    }
}

/// The summary of a global estimate, in the report of all goals.
pub(super) fn summary<S: Serializer>(
    whole: &Option<Box<GlobalReport>>,
    to: S,
) -> Result<S::Ok, S::Error> {
    whole.as_ref().map(|whole| &whole.summary).serialize(to)
}

impl Report {
    /// The report of a global estimate in the form of that of separate walks: all goals have the same walks.
    pub(crate) fn of_whole(
        (function, mut whole): (&GlobalEstimate<'_>, GlobalReport),
        goals: &[Goal],
        settings: &Settings,
        (chosen, means): (Option<&Chosen<'_>>, &[Vec<usize>]),
    ) -> Result<Self, Error> {
        whole.add_means(function, goals, means)?;
        let summary = &whole.summary;
        Ok(Self {
            method: summary
                .resolvent
                .map_or("global", |_| Method::Resolvent.word()),
            cells: summary.cells,
            unknowns: summary.unknowns,
            degree: summary.degree,
            chain: summary.chain,
            batch: settings.walk_options().batch,
            stop: summary.stop,
            residual: f64::NAN,
            states: summary.states,
            setup_seconds: summary.setup_seconds,
            walk_seconds: summary.walk_seconds + summary.band_seconds + whole.value_seconds,
            goals: whole.targets.clone(),
            choice: chosen.map(|chosen| chosen.report.clone()),
            choice_text: chosen.map_or(String::new(), |chosen| {
                chosen.report.text(&chosen.settings, &chosen.cells.text)
            }),
            energy: whole.energy.clone(),
            resolvent: summary.resolvent,
            whole: Some(Box::new(whole)),
            ..Self::empty(function.model(), settings)
        })
    }
}
