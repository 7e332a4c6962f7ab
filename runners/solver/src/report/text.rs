//! A report as a table for people, and remarks on its numbers.

use super::{ChainReport, Coordinates, EnergyReport, EstimateReport, GoalReport, Report};
use fredholm_model::numbers::{aligned, by_power, short, with_decimals, with_error};

/// The standard errors by which a solution of the equation is off once in two million times.
const MOST_ERRORS: f64 = 5.0;
/// How many times its error bar a temperature must be, so that it is no more than a tenth of that too low: 3 ΔT²/2T.
const STRAIGHT: f64 = 15.0;

impl Report {
    /// The report as a table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let derivatives = self.sensitivities.as_ref();
        let derivatives = derivatives.map(|own| format!("\n{}", own.table()));
        self.table_of_goals() + &derivatives.unwrap_or_default()
    }

    fn table_of_goals(&self) -> String {
        if let Some(whole) = &self.whole {
            return format!("{}{}", self.choice_text, whole.table());
        }
        if let Some(found) = &self.resolvent {
            return self.resolvent_table(found);
        }
        format!(
            "{}{}\n\n{}{}\n{}, {} states{}, set-up {} s, walks {} s\n",
            self.choice_text,
            self.heading(),
            aligned(&self.rows()),
            self.energy
                .as_ref()
                .map_or(String::new(), EnergyReport::text),
            walks(self.walks()),
            self.states,
            match self.other_walks {
                0 => String::new(),
                other => format!(
                    " (and {}, {} states, for irradiances and net fluxes)",
                    walks(other),
                    self.other_states
                ),
            },
            short(self.setup_seconds),
            short(self.walk_seconds),
        )
    }

    /// The line of the settings.
    fn heading(&self) -> String {
        let cells = self
            .cells
            .saturating_pow(self.dimension.unwrap_or(1) as u32);
        let chain = self.chain.as_ref();
        format!(
            "{}, {} cell{}{}{}, {}, {}, seed {}",
            named(self.problem, self.dimension),
            cells,
            if cells == 1 { "" } else { "s" },
            if self.degree == 0 {
                String::new()
            } else {
                format!(" of degree {} ({} unknowns)", self.degree, self.unknowns)
            },
            chain.map_or(String::new(), ChainReport::lifted),
            chain.map_or(String::new(), ToString::to_string),
            self.scalar,
            self.seed,
        )
    }

    /// The head of the table, and a row for every goal.
    fn rows(&self) -> Vec<Vec<String>> {
        let any = |of: fn(&GoalReport) -> bool| self.goals.iter().any(of);
        // Points of a grid are told by their place.
        let places = any(|t| t.name.ends_with(']') && t.place().is_some());
        let errors = any(|t| t.error.is_some());
        // What is asked for in place of u has its unit beside its name.
        let mut of_u = self.goals.iter().filter(|t| t.ask.is_none());
        let unit = of_u.find_map(|t| t.plain.unit);
        let own = |name: &str| with_unit(name, unit);
        let mut head = vec!["target".to_owned()];
        if places {
            head.push("at".to_owned());
        }
        head.extend(["exact", "Galerkin", "plain", "preconditioned"].map(own));
        head.push("gain".to_owned());
        if errors {
            head.extend([own("error"), "z".to_owned()]);
        }
        let heats = heats(&self.goals);
        head.extend(heads_of_heats(&self.goals));
        let mut rows = vec![head];
        rows.extend(
            self.goals
                .iter()
                .map(|goal| goal.row(places, errors, heats)),
        );
        rows
    }

    /// Remarks that a reader of the numbers needs.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = match &self.whole {
            Some(whole) => whole.summary.remarks(),
            None => Vec::new(),
        };
        let mut remark = |found: usize, text: &str| {
            if found > 0 {
                let targets = if found == 1 { "target" } else { "targets" };
                remarks.push(format!("{found} {targets}: {text}"));
            }
        };
        let count = |condition: &dyn Fn(&GoalReport) -> bool| {
            self.goals.iter().filter(|&t| condition(t)).count()
        };
        // The last digits of f64 are no news.
        let matters = |t: &GoalReport| {
            let size = t.preconditioned.estimate.unwrap_or(0.0).abs();
            t.rounding_floor > 1e-11 * size
        };
        remark(
            count(&|t| {
                let error = t.preconditioned.std_error;
                matters(t) && error.is_some_and(|error| 0.0 < error && error < t.rounding_floor)
            }),
            "the standard error is below the rounding floor, which more walks do not lower; \
             use scalar = \"f64\" or believe the floor",
        );
        remark(
            count(&|t| t.endings.step_limit > 0),
            "walks were cut off at the step limit: a possible bias; use a constant `absorption`",
        );
        remark(
            count(&|t| t.walks > 1 && t.preconditioned.std_error.is_none()),
            "no walk scored anything, so there is no error bar",
        );
        remark(
            count(&|t| t.doubtful_share.is_some()),
            "most of the variance comes from one batch of walks, or the variance seems to be infinite: do not trust the error \
             bar; look for places where the kernel is large",
        );
        let kurtoses = self.goals.iter().filter_map(|t| t.excess_kurtosis);
        let largest = kurtoses.fold(0.0, f64::max);
        remark(
            count(&|t| t.excess_kurtosis.is_some()),
            &format!(
                "large scores are rare (excess kurtosis up to {}): the error bar is rough, and may be too small; use more \
                 walks, or more cells",
                short(largest)
            ),
        );
        remark(
            count(&|t| t.few_scores.is_some_and(|scored| scored > 0)),
            "so few walks scored that the error bar means little; use more walks",
        );
        remark(
            count(&|t| t.has_bent_temperature()),
            "the error bar is more than a fifteenth of a temperature T, which follows from σT⁴: T is too low by more than a tenth of \
             its error, 3 ΔT²/2T; use more walks",
        );
        let furthest = self.goals.iter().filter_map(|t| t.z).map(f64::abs);
        let furthest = furthest.fold(0.0, f64::max);
        remark(
            count(&|t| t.z.is_some_and(|z| z.abs() > MOST_ERRORS)),
            &format!(
                "the given solution is up to {} standard errors off: it is no solution of this equation, it seems",
                short(furthest)
            ),
        );
        remarks
    }
}

impl GoalReport {
    /// Whether the error bar of a temperature is so large that it bends over it.
    fn has_bent_temperature(&self) -> bool {
        let own = Some(self.preconditioned).filter(|own| own.unit == Some("K"));
        let mut all = [own, self.temperature, self.radiant_temperature]
            .into_iter()
            .flatten();
        let is_bent = |own: EstimateReport| match (own.estimate, own.std_error) {
            (Some(estimate), error) => error > Some(estimate / STRAIGHT),
            (None, _) => true,
        };
        self.walks > 1 && all.any(is_bent)
    }

    /// The point, in a room the place in the drawing.
    pub(super) fn place(&self) -> Option<String> {
        match &self.position {
            Some(position) => Some(Coordinates::Many(position.clone()).text()),
            None => self.at.as_ref().map(Coordinates::text),
        }
    }

    /// The name for people, with what is asked for if it is not u.
    pub(super) fn title(&self) -> String {
        match self.ask {
            Some(ask) => with_unit(
                &format!(
                    "{}: {}",
                    self.name,
                    word_of(ask, self.plain.unit).replace('_', " ")
                ),
                self.preconditioned.unit,
            ),
            None => self.name.clone(),
        }
    }

    /// The row of the table, with the place, the error and what there is of heat if other rows have them.
    fn row(&self, places: bool, errors: bool, heats: [bool; 4]) -> Vec<String> {
        // An error of (v, Φ) counts, too.
        let gain = match (self.plain.std_error, self.preconditioned.std_error) {
            (Some(plain), Some(preconditioned))
                if preconditioned > 0.0 && plain > 0.0 && !self.no_difference =>
            {
                short(plain / preconditioned)
            }
            _ => "-".to_owned(),
        };
        let doubt = match self.doubtful_share {
            Some(_) => " (of few walks)",
            None => "",
        };
        let mut row = vec![self.title()];
        if places {
            row.push(self.place().unwrap_or_default());
        }
        row.extend([
            self.exact.map_or("-".to_owned(), |u| format!("{u:.9}")),
            number_or_dash(self.galerkin),
            self.plain.text(self.rounding_floor),
            match self.preconditioned.estimate {
                Some(estimate) if self.no_difference => {
                    let digits = with_error(estimate, Some(self.rounding_floor));
                    format!("{digits} (no difference in {} walks)", self.walks)
                }
                _ => self.preconditioned.text(self.rounding_floor) + doubt,
            },
            gain,
        ]);
        if errors {
            row.push(
                self.error
                    .map_or("-".to_owned(), |error| format!("{error:.1e}")),
            );
            row.push(self.z.map_or("-".to_owned(), |z| format!("{z:.1}")));
        }
        row.extend(self.texts_of_heat(heats, |report| report.text(self.rounding_floor)));
        row
    }

    /// What there is of heat, as far as other rows have it.
    pub(super) fn texts_of_heat(
        &self,
        heats: [bool; 4],
        text: impl Fn(&EstimateReport) -> String,
    ) -> impl Iterator<Item = String> {
        let own = self.heat().into_iter().zip(heats);
        let own = own.filter(|(_, is_there)| *is_there);
        own.map(move |(report, _)| match report {
            (Some(report), true) => report.given(),
            (Some(report), false) => text(&report),
            (None, _) => "-".to_owned(),
        })
    }
}

/// What any of these goals has of heat.
pub(super) fn heats(goals: &[GoalReport]) -> [bool; 4] {
    core::array::from_fn(|i| goals.iter().any(|goal| goal.heat()[i].0.is_some()))
}

/// The heads of what these goals have of heat.
pub(super) fn heads_of_heats(goals: &[GoalReport]) -> impl Iterator<Item = String> {
    let arriving = goals.iter().find_map(|goal| goal.irradiance?.unit);
    let leaving = goals.iter().find_map(|goal| goal.net_flux?.unit);
    let names = [
        with_unit(word_of("irradiance", arriving), arriving),
        with_unit(word_of("net flux", leaving), leaving),
        "temperature, K".to_owned(),
        "mean radiant temperature, K".to_owned(),
    ];
    let names = names.into_iter().zip(heats(goals));
    names.filter_map(|(name, is_there)| is_there.then_some(name))
}

/// What people call a quantity in its unit: the irradiance of molecules is a pressure, their net flux a throughput, and by pressure a conductance.
fn word_of<'w>(quantity: &'w str, unit: Option<&str>) -> &'w str {
    match (quantity, unit) {
        ("irradiance", Some("mbar")) => "pressure",
        ("net flux", Some("l/s")) => "conductance",
        ("net flux out of", Some("mbar l/s")) => "net throughput of",
        _ => quantity,
    }
}

impl EstimateReport {
    /// A number that is given.
    pub(super) fn given(&self) -> String {
        let number = self.estimate.map_or("-".to_owned(), |x| {
            by_power(x).unwrap_or_else(|| with_decimals(x, 9))
        });
        format!("{number} (given)")
    }

    /// The estimate with its standard error, or with what rounding leaves if that is larger.
    fn text(&self, floor: f64) -> String {
        match (self.estimate, self.std_error) {
            // Of a σT⁴ that is no more than 0.
            (None, _) if self.unit == Some("K") => "no temperature".to_owned(),
            (None, _) => "no walks".to_owned(),
            // One score is no result.
            (Some(_), None) if self.std_dev.is_none() => "- (one walk)".to_owned(),
            (Some(estimate), Some(error)) if error < floor => {
                format!("{} (rounding)", with_error(estimate, Some(floor)))
            }
            (Some(estimate), error) => with_error(estimate, error),
        }
    }
}

impl EnergyReport {
    /// The table of net fluxes.
    pub(super) fn text(&self) -> String {
        let flux = |surface: &super::SurfaceReport| match &surface.net_flux {
            Some(report) if surface.is_given => report.given(),
            Some(report) => report.text(0.0),
            None => "its material changes".to_owned(),
        };
        let mut rows = vec![
            [
                word_of("net flux out of", Some(self.unit)),
                match self.unit {
                    "W/m" => "W per metre",
                    unit => unit,
                },
            ]
            .map(str::to_owned)
            .to_vec(),
        ];
        for surface in &self.surfaces {
            rows.push(vec![surface.name.clone(), flux(surface)]);
        }
        if let Some(balance) = &self.energy_balance {
            rows.push(vec!["all".to_owned(), balance.text(0.0)]);
        }
        format!("\n{}", aligned(&rows))
    }
}

/// "1 walk", "2 walks".
fn walks(count: u64) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} walk{plural}")
}

/// A number with six decimals, or a dash for NaN.
fn number_or_dash(x: f64) -> String {
    if x.is_nan() {
        "-".to_owned()
    } else {
        by_power(x).unwrap_or_else(|| format!("{x:.6}"))
    }
}

/// The table, and the remarks under it.
impl core::fmt::Display for Report {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(&self.table())?;
        for remark in self.remarks() {
            writeln!(f, "warning: {remark}")?;
        }
        Ok(())
    }
}

/// The name of a problem: "cube of dimension 2".
pub(crate) fn named(problem: &str, dimension: Option<usize>) -> String {
    match dimension {
        Some(dimension) => format!("{problem} of dimension {dimension}"),
        None => problem.to_owned(),
    }
}

/// The head of a column of numbers in this unit.
pub(super) fn with_unit(name: &str, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{name}, {unit}"),
        None => name.to_owned(),
    }
}
