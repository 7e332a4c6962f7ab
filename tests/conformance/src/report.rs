//! What all checks of a problem found, as a table.

use core::fmt;

use crate::check::Trace;
use crate::outcome::Outcome;

/// Every check, in the order of the table: what to mend first stands first.
pub const CHECKS: [&str; 26] = [
    "cells",
    "steps' cells",
    "measures",
    "uniform points",
    "parameters",
    "basis",
    "density",
    "moments",
    "masses",
    "chi-squared",
    "distribution",
    "preserved density",
    "suffix starts",
    "solution",
    "constant",
    "coefficients",
    "source means",
    "Galerkin solution",
    "pair lists",
    "collapse",
    "pair integrals",
    "neighbour equation",
    "means",
    "runners",
    "statistics",
    "coverage",
];

/// The check that compares the reports of two scalars.
pub const SCALARS: &str = "f32 and f64";

/// What a check found, and of what.
#[derive(Clone, Debug)]
pub struct Row {
    /// The name of the check, one of [`CHECKS`] or [`SCALARS`].
    pub check: &'static str,
    /// The scalar and, where it matters, the neighbour equation.
    pub subject: String,
    /// The worst comparison of the check.
    pub outcome: Outcome,
}

/// What all checks of a problem found. It is displayed as a table (check, verdict, distance,
/// allowed).
#[derive(Clone, Debug, Default)]
pub struct Report {
    rows: Vec<Row>,
    pub(crate) traces: Vec<Trace>,
    pub(crate) plain: u64,
    pub(crate) preconditioned: u64,
}

impl Report {
    /// Adds what a check found.
    pub fn push(&mut self, check: &'static str, subject: impl Into<String>, outcome: Outcome) {
        self.rows.push(Row {
            check,
            subject: subject.into(),
            outcome,
        });
    }

    /// All rows.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// What failed.
    pub fn failures(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| !row.outcome.passed())
    }

    /// The row of a check that is nearest to failing or furthest beyond. `None`: the problem offers
    /// nothing to check.
    #[must_use]
    pub fn worst(&self, check: &str) -> Option<&Row> {
        let rows = self.rows.iter().filter(|row| row.check == check);
        let badness = |row: &Row| {
            let outcome = &row.outcome;
            if outcome.passed() {
                outcome.distance / outcome.allowed.max(f64::MIN_POSITIVE)
            } else {
                f64::INFINITY
            }
        };
        rows.max_by(|a, b| badness(a).total_cmp(&badness(b)))
    }

    /// How many cases of scalar, estimator and generator walked without a neighbour equation, and how many of
    /// scalar, neighbour equation, estimator and generator with one; each by every runner.
    #[must_use]
    pub const fn cases(&self) -> [u64; 2] {
        [self.plain, self.preconditioned]
    }

    /// Adds the rows and cases of another report; its walks are forgotten.
    pub fn extend(&mut self, other: Self) {
        self.rows.extend(other.rows);
        self.plain += other.plain;
        self.preconditioned += other.preconditioned;
    }

    /// Nothing, unless a check failed.
    ///
    /// # Panics
    /// With the table and every failure.
    pub fn assert_passed(&self, problem: &str) {
        let failures: Vec<String> = self
            .failures()
            .map(|row| format!("{} [{}]: {}", row.check, row.subject, row.outcome))
            .collect();
        assert!(
            failures.is_empty(),
            "{problem}\n{self}\n{}",
            failures.join("\n")
        );
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:20} {:11} {:>10} {:>8}  unit",
            "check", "verdict", "distance", "allowed"
        )?;
        for check in CHECKS.into_iter().chain([SCALARS]) {
            let Some(Row { outcome, .. }) = self.worst(check) else {
                writeln!(f, "{check:20} not offered")?;
                continue;
            };
            let verdict = if outcome.passed() { "passed" } else { "FAILED" };
            let (distance, allowed) = (outcome.distance, outcome.allowed);
            writeln!(
                f,
                "{check:20} {verdict:11} {distance:10.3e} {allowed:8}  {}",
                outcome.unit
            )?;
        }
        Ok(())
    }
}
