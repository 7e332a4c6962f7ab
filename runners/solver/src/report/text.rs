//! A report as a table for people, and remarks on its numbers.

use super::{EnergyReport, EstimateReport, GoalReport, Report};
use crate::numbers::{aligned, short, with_error};

impl Report {
    /// The report as a table for people.
    #[must_use]
    pub fn table(&self) -> String {
        format!(
            "{}{}\n\n{}{}\n{} walks, {} states, set-up {} s, walks {} s\n",
            self.choice_text,
            self.heading(),
            aligned(&self.rows()),
            self.energy
                .as_ref()
                .map_or(String::new(), EnergyReport::text),
            self.goals.iter().map(|t| t.walks).sum::<u64>(),
            self.states,
            short(self.setup_seconds),
            short(self.walk_seconds),
        )
    }

    /// The line of the settings.
    fn heading(&self) -> String {
        let cells = self
            .cells
            .saturating_pow(self.dimension.unwrap_or(1) as u32);
        format!(
            "{}{}, {} cell{}{}, {} pairs{}, {} estimator, {}, seed {}",
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
        )
    }

    /// The head of the table, and a row for every goal.
    fn rows(&self) -> Vec<Vec<String>> {
        let any = |of: fn(&GoalReport) -> bool| self.goals.iter().any(of);
        let mut head = vec![
            "target",
            "exact",
            "Galerkin",
            "plain",
            "preconditioned",
            "gain",
        ];
        if any(|t| t.irradiance.is_some()) {
            head.push("irradiance");
        }
        if any(|t| t.net_flux.is_some()) {
            head.push("net flux");
        }
        let mut rows = vec![head.into_iter().map(str::to_owned).collect()];
        rows.extend(self.goals.iter().map(GoalReport::row));
        rows
    }

    /// Remarks that a reader of the numbers needs.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
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
}

impl GoalReport {
    /// The row of the table.
    fn row(&self) -> Vec<String> {
        let gain = match (self.plain.std_dev, self.preconditioned.std_dev) {
            (Some(plain), Some(preconditioned)) if preconditioned > 0.0 && plain > 0.0 => {
                short(plain / preconditioned)
            }
            _ => "-".to_owned(),
        };
        let doubt = match self.doubtful_share {
            Some(_) => " (of few walks)",
            None => "",
        };
        let mut row = vec![
            self.name.clone(),
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
        ];
        let heat = [&self.irradiance, &self.net_flux];
        for report in heat.into_iter().flatten() {
            row.push(report.text(self.rounding_floor));
        }
        row
    }
}

impl EstimateReport {
    /// The estimate with its standard error, or with what rounding leaves if that is larger.
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

impl EnergyReport {
    /// The table of net fluxes.
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

/// A number with six decimals, or a dash for NaN.
fn number_or_dash(x: f64) -> String {
    if x.is_nan() {
        "-".to_owned()
    } else {
        format!("{x:.6}")
    }
}
