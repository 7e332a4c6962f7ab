//! The whole report.

use fredholm::diagnosis::{DETAILED, Diagnosis, PowerReport};
use fredholm::numbers::{aligned, short};
use serde::Serialize;

/// The whole report.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    pub(super) problem: &'a str,
    pub(super) cells: usize,
    pub(super) unknowns: usize,
    pub(super) degree: usize,
    pub(super) pairs: &'static str,
    /// q0; null: walks end by roulette.
    pub(super) absorption: Option<f64>,
    pub(super) estimator: &'static str,
    pub(super) form: &'static str,
    #[serde(flatten)]
    pub(super) diagnosis: &'a Diagnosis,
}

impl Report<'_> {
    pub(super) fn text(&self, cells: &str) -> String {
        let Diagnosis {
            sites,
            nodes,
            kernel_power,
            neighbour_power,
            quantities,
            lift,
            targets,
            ..
        } = self.diagnosis;
        let mut text = format!(
            "{}, {} cells, degree {}{}, {} pairs, {}, {} form; {sites} sites with {nodes} nodes\n\n",
            self.problem,
            cells,
            self.degree,
            lift.map_or(String::new(), |lift| format!(" lifted to {lift}")),
            self.pairs,
            match self.absorption {
                Some(q) => format!("absorption {q}, {} estimator", self.estimator),
                None => "roulette".to_owned(),
            },
            self.form
        );
        let number = |x: Option<f64>| x.map_or_else(|| "infinite".to_owned(), short);
        let header = [
            "target",
            "u",
            "Galerkin",
            "√Var plain",
            "preconditioned",
            "gain",
        ];
        let mut rows = vec![header.map(str::to_owned).to_vec()];
        let others = &self.diagnosis.other_pairs;
        rows[0].extend(others.iter().map(|other| format!("{} pairs", other.pairs)));
        for (place, target) in targets.iter().enumerate() {
            let mut row = vec![
                target.name.clone(),
                format!("{:.6}", target.solution),
                format!("{:.6}", target.galerkin),
                number(target.plain),
                number(target.preconditioned),
                target.gain.map_or_else(|| "-".to_owned(), short),
            ];
            row.extend(
                others
                    .iter()
                    .map(|other| number(other.preconditioned.get(place).copied().flatten())),
            );
            rows.push(row);
        }
        text += &aligned(&rows);
        for target in targets.iter().take(DETAILED) {
            text += &target.text();
        }
        if targets.len() > DETAILED {
            text += &format!(
                "\n{} more targets are not looked at in detail: those that come first in the file are\n",
                targets.len() - DETAILED
            );
        }
        text += "\nfinite variance\n";
        for (name, power) in [("T_k²p", kernel_power), ("T_h²p", neighbour_power)] {
            text += &match power {
                Some(PowerReport { exponent, norm }) => {
                    format!("  ‖({name})^{exponent}‖ = {} < 1\n", short(*norm))
                }
                None => format!("  no power of {name} below 1000 is seen to be a contraction\n"),
            };
        }
        if let Some(quantities) = quantities {
            text += &quantities.text();
        }
        text
    }
}
