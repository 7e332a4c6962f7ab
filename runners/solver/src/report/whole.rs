//! The report of a global estimate at some regions.

use fredholm_core::Estimate;
use fredholm_model::numbers::{aligned, short, with_error};
use fredholm_model::{Flux, GlobalQuantity, Heat};
use serde::Serialize;

use super::csv::{CsvPlace, flux_columns, fluxes, of_columns, places, record, text};
use super::text::with_unit;
use super::{Coordinates, EndingsReport, EnergyReport, EstimateReport, GoalReport, Over, Report};
use crate::choice::Chosen;
use crate::{
    Choices, Error, GlobalCoefficients, GlobalEstimate, GlobalSummary, GlobalValue, Goal, Method,
    Model, Region, Settings,
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
    pub targets: Vec<GlobalGoalReport>,
    /// The net fluxes of a room with temperatures.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergyReport>,
    /// The means over all cells of a scene: its global estimate has no values at points.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mesh: Vec<GlobalGoalReport>,
    /// Means over the cells that were asked for: in columns, and in no document.
    #[serde(skip)]
    pub means: Vec<GlobalValue>,
    /// The coefficients of the function; `None` unless somebody puts them here ([`GlobalEstimate::coefficients`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coefficients: Option<GlobalCoefficients>,
}

/// The value of a global estimate at one region.
#[derive(Clone, Debug, Serialize)]
pub struct GlobalGoalReport {
    /// The goal's name.
    pub name: String,
    /// The point, if the goal is u at a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Coordinates>,
    /// The place of the point in the drawing, of a room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<Vec<f64>>,
    /// The corners of a cell of a scene, in their order around it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub corners: Vec<[f64; 3]>,
    /// The region, if the goal is a mean over one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<Over>,
    /// The formula of the weight, if the goal is a weighted integral.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<String>,
    /// The exact value, if it is known.
    pub exact: Option<f64>,
    /// Estimate, standard error, band, and the deterministic part.
    #[serde(flatten)]
    pub value: GlobalValue,
    /// The estimate minus the exact value, if that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// The error in standard errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// The irradiance, in rooms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub irradiance: Option<EstimateReport>,
    /// The net flux out of the wall in W/m², of a surface in the mean, in rooms with temperatures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub net_flux: Option<EstimateReport>,
    /// Whether that is given, and no result.
    #[serde(skip)]
    pub is_flux_given: bool,
    /// The temperature in kelvin of a wall from which the net flux is given; of a mean, that of the mean of T⁴.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<EstimateReport>,
    /// The mean radiant temperature in kelvin at a point in the air, in rooms with temperatures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radiant_temperature: Option<EstimateReport>,
}

impl GlobalGoalReport {
    pub(crate) fn new(
        model: &dyn Model,
        goal: &Goal,
        exact: Option<f64>,
        value: GlobalValue,
    ) -> Self {
        let error = exact.map(|exact| value.estimate - exact);
        let bar = value.std_error.filter(|bar| *bar > 0.0);
        Self {
            name: goal.name.clone(),
            at: Coordinates::new(model, &goal.region),
            position: model.position(&goal.region),
            corners: Vec::new(),
            over: Over::new(model, &goal.region),
            weight: match goal.region {
                Region::Weight(number) => model.weight(number).map(str::to_owned),
                _ => None,
            },
            exact,
            value,
            error,
            z: error.zip(bar).map(|(error, bar)| error / bar),
            irradiance: None,
            net_flux: None,
            is_flux_given: false,
            temperature: None,
            radiant_temperature: None,
        }
    }

    /// Adds what follows from u and from the irradiance.
    pub(super) fn add(&mut self, heat: &Heat, model: &dyn Model) {
        // An estimate is there however few walks there were.
        let estimate = |estimate, unit| EstimateReport::new(estimate, 1, unit);
        self.irradiance = heat
            .irradiance
            .map(|h| estimate(h, model.irradiance_unit()));
        self.net_flux = heat.net_flux.map(|q| estimate(q, model.unit()));
        self.is_flux_given = heat.is_flux_given;
        self.temperature = heat.temperature.map(|t| estimate(t, Some("K")));
        self.radiant_temperature = heat.radiant_temperature.map(|t| estimate(t, Some("K")));
    }

    /// The point, in a room the place in the drawing.
    fn place(&self) -> Option<String> {
        match &self.position {
            Some(position) => Some(Coordinates::Many(position.clone()).text()),
            None => self.at.as_ref().map(Coordinates::text),
        }
    }

    /// Estimates that only rooms have.
    const fn of_rooms(&self) -> [&Option<EstimateReport>; 4] {
        [
            &self.irradiance,
            &self.net_flux,
            &self.temperature,
            &self.radiant_temperature,
        ]
    }
}

/// The value as an estimate of so many walks.
pub(super) fn estimate(value: &GlobalValue) -> Estimate {
    Estimate {
        estimate: value.estimate,
        std_error: value.std_error,
        std_dev: None,
    }
}

/// The columns that all problems have.
const COLUMNS: [&str; 20] = [
    "name",
    "at",
    "from",
    "to",
    "weight",
    "exact",
    "iterate",
    "estimate",
    "std_error",
    "band",
    "error",
    "z",
    "irradiance",
    "irradiance_std_error",
    "net_flux",
    "net_flux_std_error",
    "temperature",
    "temperature_std_error",
    "radiant_temperature",
    "radiant_temperature_std_error",
];

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
        let start = std::time::Instant::now();
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
    pub(super) fn rows(&self) -> impl Iterator<Item = &GlobalGoalReport> {
        self.targets.iter().chain(&self.mesh)
    }

    /// The report as CSV, a row for every target and every cell of a mesh, with columns of the problem's own coordinates.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn csv(&self) -> Result<String, Error> {
        let coordinates = of_columns(self.summary.problem, self.summary.dimension);
        let columns = COLUMNS.iter().map(|&name| name.to_owned());
        let fluxes: Vec<_> = self.energy.iter().flat_map(fluxes).collect();
        let more = self.energy.as_ref().map(flux_columns);
        let more = more.as_ref().map_or(&[][..], |more| more.as_slice());
        let mut head: Vec<String> = columns.chain(coordinates.iter().cloned()).collect();
        let width = head.len();
        head.extend(more.iter().map(|&name| name.to_owned()));
        let mut rows = vec![head];
        for target in self.rows() {
            let number = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
            let over = match target.over {
                Some(Over::Interval([from, to])) => [Some(from), Some(to)],
                _ => [None; 2],
            };
            let mut row = vec![
                text(&target.name),
                target.at.as_ref().map_or(String::new(), Coordinates::entry),
            ];
            row.extend(over.map(number));
            row.push(target.weight.as_deref().map_or(String::new(), text));
            let value = &target.value;
            row.extend([
                number(target.exact),
                value.iterate.to_string(),
                value.estimate.to_string(),
            ]);
            let rest = [value.std_error, value.band, target.error, target.z];
            row.extend(rest.map(number));
            for report in target.of_rooms() {
                let numbers = report.map_or([None; 2], |r| [r.estimate, r.std_error]);
                row.extend(numbers.map(number));
            }
            let place = CsvPlace {
                at: target.at.as_ref(),
                position: target.position.as_deref().unwrap_or_default(),
            };
            row.extend(places(place, coordinates.len()));
            row.resize(width + more.len(), String::new());
            rows.push(row);
        }
        for (name, _, flux) in fluxes {
            let mut row = vec![text(&name)];
            row.resize(width, String::new());
            let numbers = [flux.estimate, flux.std_error];
            row.extend(numbers.map(|x| x.map_or(String::new(), |x| x.to_string())));
            rows.push(row);
        }
        record(&rows)
    }

    /// The report as a table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let has_errors = self.targets.iter().any(|target| target.error.is_some());
        let unit = self.unit;
        let own = |name: &str| with_unit(name, unit);
        let irradiances = self.targets.iter().map(|t| t.irradiance.as_ref());
        let arriving = irradiances.flatten().find_map(|h| h.unit);
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
        let any = |i: usize| self.targets.iter().any(|t| t.of_rooms()[i].is_some());
        let there: [bool; 4] = core::array::from_fn(any);
        let names = [
            with_unit("irradiance", arriving),
            own("net flux"),
            "temperature, K".to_owned(),
            "mean radiant temperature, K".to_owned(),
        ];
        let names = names.into_iter().zip(there);
        head.extend(names.filter_map(|(name, is_there)| is_there.then_some(name)));
        let mut rows = vec![head];
        let targets = self.targets.iter();
        rows.extend(targets.map(|target| target.row(has_errors, there)));
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
            match summary.dimension {
                Some(d) => format!("{} of dimension {d}", summary.problem),
                None => summary.problem.to_owned(),
            },
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

impl GlobalGoalReport {
    fn row(&self, has_errors: bool, there: [bool; 4]) -> Vec<String> {
        let value = &self.value;
        let optional = |x: Option<f64>| x.map_or(String::new(), short);
        let mut row = vec![
            self.name.clone(),
            self.place().unwrap_or_default(),
            self.exact
                .map_or("-".to_owned(), |exact| format!("{exact:.7}")),
            format!("{:.7}", value.iterate),
            with_error(value.estimate, value.std_error),
            optional(value.band),
        ];
        if has_errors {
            row.extend([optional(self.error), optional(self.z)]);
        }
        for (i, report) in self.of_rooms().into_iter().enumerate() {
            if there[i] {
                row.push(match report {
                    Some(report) if i == 1 && self.is_flux_given => report.given(),
                    Some(report) => {
                        with_error(report.estimate.unwrap_or(f64::NAN), report.std_error)
                    }
                    None => "-".to_owned(),
                });
            }
        }
        row
    }
}

impl GlobalEstimate<'_> {
    /// The report of this function at these regions.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region.
    pub fn report(&self, goals: &[Goal]) -> Result<GlobalReport, Error> {
        let start = std::time::Instant::now();
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
            let exact = model.exact(&goal.region)?;
            Ok(GlobalGoalReport::new(model, goal, exact, value))
        });
        let mut targets = targets.collect::<Result<Vec<_>, Error>>()?;
        self.add_heat(goals, &mut targets)?;
        let mesh = self.mesh_report();
        Ok(GlobalReport {
            summary: self.summary().clone(),
            unit: model.unit(),
            targets,
            energy: self.energy()?,
            value_seconds: 0.0,
            mesh,
            means: Vec::new(),
            coefficients: None,
        })
    }

    /// Adds irradiances, and what follows from them.
    fn add_heat(&self, goals: &[Goal], targets: &mut [GlobalGoalReport]) -> Result<(), Error> {
        let model = self.model();
        let lit = |goal: &&Goal| model.has_own_irradiance(&goal.region);
        let regions: Vec<Region> = goals.iter().filter(lit).map(|g| g.region.clone()).collect();
        let irradiances = self.quantities(GlobalQuantity::Irradiance, &regions)?;
        let mut irradiances = irradiances.iter().map(estimate);
        for (goal, target) in goals.iter().zip(targets) {
            let own = match lit(&goal) {
                true => irradiances.next().filter(|h| !h.estimate.is_nan()),
                false => None,
            };
            let heat = model.heat(&goal.region, estimate(&target.value), own);
            target.add(&heat, model);
        }
        Ok(())
    }

    /// The net fluxes out of all parts, and their sum, if the model has them.
    fn energy(&self) -> Result<Option<EnergyReport>, Error> {
        let parts = self.model().flux_parts();
        if parts.is_empty() {
            return Ok(None);
        }
        let mut regions: Vec<Region> = parts.iter().map(|(part, _)| Region::Part(*part)).collect();
        regions.push(Region::Parts(parts.iter().map(|(part, _)| *part).collect()));
        let values = self.quantities(GlobalQuantity::NetFlux, &regions)?;
        // The walks are those of all.
        let walks = self.summary().walks;
        let fluxes = parts
            .iter()
            .zip(&values)
            .map(|(&(part, is_given), value)| Flux {
                name: self.model().part(part).unwrap_or_default().to_owned(),
                walks: if is_given { 0 } else { walks },
                net_flux: Some(estimate(value)).filter(|flux| !flux.estimate.is_nan()),
                is_given,
            });
        let all = values.last().map(estimate);
        let all = all.filter(|all| !all.estimate.is_nan());
        let unit = self.model().flux_unit();
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
pub(super) fn summary<S: serde::Serializer>(
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
        let goals = whole.targets.iter();
        Ok(Self {
            method: summary
                .resolvent
                .map_or("global", |_| Method::Resolvent.word()),
            problem: summary.problem,
            dimension: summary.dimension,
            cells: summary.cells,
            unknowns: summary.unknowns,
            degree: summary.degree,
            chain: summary.chain,
            scalar: summary.scalar,
            generator: summary.generator,
            shared: 1,
            batch: settings.walk_options().batch,
            seed: summary.seed,
            part: None,
            stop: summary.stop,
            reason: None,
            sweeps: 0,
            residual: f64::NAN,
            states: summary.states,
            other_walks: 0,
            other_states: 0,
            setup_seconds: summary.setup_seconds,
            walk_seconds: summary.walk_seconds + summary.band_seconds + whole.value_seconds,
            goals: goals.map(|goal| goal.as_separate(&whole)).collect(),
            choice: chosen.map(|chosen| chosen.report.clone()),
            choice_text: chosen.map_or(String::new(), |chosen| {
                chosen.report.text(&chosen.settings, &chosen.cells.text)
            }),
            energy: whole.energy.clone(),
            resolvent: whole.summary.resolvent,
            whole: Some(Box::new(whole)),
        })
    }
}

impl GlobalGoalReport {
    /// The report of the goal in the form of one by separate walks.
    fn as_separate(&self, of: &GlobalReport) -> GoalReport {
        let summary = &of.summary;
        let none = EstimateReport {
            estimate: None,
            std_error: None,
            std_dev: None,
            unit: of.unit,
        };
        GoalReport {
            name: self.name.clone(),
            // A global estimate has one.
            channel: None,
            at: self.at.clone(),
            position: self.position.clone(),
            over: self.over.clone(),
            weight: self.weight.clone(),
            exact: self.exact,
            galerkin: f64::NAN,
            walks: summary.walks,
            replicates: Some(summary.replicates as u32),
            rounding_floor: summary.rounding_floor,
            doubtful_share: None,
            tail_index: None,
            excess_kurtosis: None,
            few_scores: None,
            no_difference: self.value.std_error == Some(0.0),
            endings: EndingsReport {
                absorbed: summary.walks - summary.step_limit - summary.left,
                step_limit: summary.step_limit,
            },
            plain: none,
            preconditioned: EstimateReport {
                estimate: Some(self.value.estimate),
                std_error: self.value.std_error,
                ..none
            },
            band: self.value.band,
            iterate: Some(self.value.iterate),
            error: self.error,
            z: self.z,
            irradiance: self.irradiance,
            net_flux: self.net_flux,
            is_flux_given: self.is_flux_given,
            temperature: self.temperature,
            radiant_temperature: self.radiant_temperature,
        }
    }
}
