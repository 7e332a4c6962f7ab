//! What a run is of: whatever its bits depend on, with a name for each, so that a refusal says what differs.

use core::fmt::Display;

use fredholm::choice::ChoiceReport;
use fredholm::execute::{CellCount, SetUp, Walking};
use fredholm::{Choices, Settings, VALUE_VERSION};
use fredholm_core::DEFAULT_GENERATOR;
use serde::{Deserialize, Serialize};

use crate::frames::checksum;

/// Longer values are kept as their checksum.
const LONG: usize = 500;
/// Characters around the first difference of two values that are shown.
const SHOWN: usize = 30;

/// The parts of a problem on which no solved system depends.
const NOT_OF_THE_EQUATION: [&str; 2] = ["targets", "weights"];

/// The problem of a run: all that its walks depend on before settings are chosen, and its text to read it again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// The version of the program that began the file.
    pub program: String,
    /// The version of results ([`VALUE_VERSION`]).
    pub values: u32,
    /// The name of the random number generator.
    pub generator: String,
    /// What the problem and its targets are, resolved, each with a name.
    pub problem: Vec<(String, String)>,
    /// The path of the problem file.
    pub name: String,
    /// The text of the problem file.
    pub text: String,
    /// The options of the command line in place of the file's, as one would type them.
    pub options: String,
}

impl Header {
    /// The header of this program for a resolved problem, whose long values are kept as checksums.
    #[must_use]
    pub fn new(
        problem: Vec<(String, String)>,
        name: String,
        text: String,
        options: String,
    ) -> Self {
        let short = |(name, value): (String, String)| {
            let value = match value.len() {
                0..=LONG => value,
                length => {
                    let sum = checksum(value.as_bytes());
                    format!("checksum {sum:016x} of {length} characters")
                }
            };
            (name, value)
        };
        Self {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            values: VALUE_VERSION,
            generator: DEFAULT_GENERATOR.to_owned(),
            problem: problem.into_iter().map(short).collect(),
            name,
            text,
            options,
        }
    }

    /// A checksum of the problem.
    #[must_use]
    pub fn digest(&self) -> u64 {
        checksum(format!("{}{}{:?}", self.values, self.generator, self.problem).as_bytes())
    }

    /// The equation alone: what its solved systems depend on, each with a name.
    #[must_use]
    pub fn equation(&self) -> Vec<(String, String)> {
        let version = ("version of results".to_owned(), self.values.to_string());
        let problem = self.problem.iter();
        let equation = problem.filter(|(name, _)| !NOT_OF_THE_EQUATION.contains(&name.as_str()));
        [version].into_iter().chain(equation.cloned()).collect()
    }

    /// What differs from another problem; `None`: nothing that matters.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        let named = |header: &Self| {
            let mut all = vec![
                ("version of results".to_owned(), header.values.to_string()),
                ("generator".to_owned(), header.generator.clone()),
            ];
            all.extend(header.problem.iter().cloned());
            all
        };
        difference(&named(self), &named(other))
    }
}

/// The walks of a run: settings, in which what is chosen is not open, and the numbers of the set-up.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct JobRecord {
    /// The settings.
    pub settings: Settings,
    /// Whether walks follow no neighbour equation.
    pub plain: bool,
    /// The cells.
    pub cells: CellCount,
    /// The choice, if settings were chosen.
    pub choice: Option<ChoiceReport>,
    /// The numbers of the set-up; without its seconds, which differ from machine to machine.
    pub set_up: SetUp,
}

impl JobRecord {
    /// The record of these walks.
    #[must_use]
    pub fn new(walking: &Walking<'_>) -> Self {
        let choice = walking.choice.cloned().map(|choice| ChoiceReport {
            pilot_seconds: 0.0,
            ..choice
        });
        Self {
            settings: walking.settings.clone(),
            plain: walking.plain,
            cells: walking.cells.clone(),
            choice,
            set_up: SetUp {
                seconds: 0.0,
                ..walking.set_up.clone()
            },
        }
    }

    /// The number of walks of each goal.
    #[must_use]
    pub fn walks(&self) -> u64 {
        self.settings.walk_options().walks
    }

    /// What differs from other walks; `None`: nothing that the bits of a batch depend on. The number of walks, the
    /// tolerance and the time limit are no part of it.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        difference(&self.named(), &other.named())
    }

    /// A checksum of all that the bits of a batch depend on.
    #[must_use]
    pub fn digest(&self) -> u64 {
        checksum_of(&self.named())
    }

    fn named(&self) -> Vec<(String, String)> {
        let (cut, walk) = (self.settings.discretisation(), self.settings.walk_options());
        let set_up = &self.set_up;
        // The radius may be infinite, which JSON does not keep, and no bit depends on it.
        let of_v = SetUp {
            neighbour_second_moment_radius: None,
            seconds: 0.0,
            ..set_up.clone()
        };
        let of_v = format!("{of_v:?}");
        let bits = |x: &f64| format!("{x:e}");
        let values: Vec<String> = set_up.galerkin.iter().map(bits).collect();
        let named: [(&str, &dyn Display); 20] = [
            ("seed", &walk.seed),
            ("batch", &walk.batch),
            ("scalar", &cut.scalar.word()),
            (
                "method",
                &if self.plain {
                    "plain"
                } else {
                    "preconditioned"
                },
            ),
            ("cells", &self.cells.cells),
            ("unknowns", &self.cells.unknowns),
            ("degree", &cut.degree),
            ("lift", &format!("{:?}", self.settings.lift)),
            ("pairs", &walk.pairs.word()),
            ("points", &format!("{:?}", cut.points)),
            (
                "grading",
                &format!("{:?}, {:?}", cut.grading, cut.shadow_cuts),
            ),
            ("exact_source", &format!("{:?}", cut.exact_source)),
            ("absorption", &walk.absorption),
            ("estimator", &walk.estimator.word()),
            ("form", &walk.form.word()),
            ("sequence", &walk.sequence.word()),
            ("survivals", &walk.survivals),
            ("last_step", &walk.last_step),
            ("(v, Φ)", &values.join(", ")),
            ("set-up", &of_v),
        ];
        let named = named.into_iter();
        named
            .map(|(name, value)| (name.to_owned(), value.to_string()))
            .collect()
    }
}

/// A checksum of named values.
pub(crate) fn checksum_of(named: &[(String, String)]) -> u64 {
    checksum(format!("{named:?}").as_bytes())
}

/// The first of these values that differs, and how.
pub(crate) fn difference(here: &[(String, String)], there: &[(String, String)]) -> Option<String> {
    let names = here.iter().map(|(name, _)| name);
    let other = there
        .iter()
        .map(|(name, _)| name)
        .filter(|name| !here.iter().any(|h| h.0 == **name));
    let of = |all: &[(String, String)], name: &str| {
        let found = all.iter().find(|(known, _)| known == name);
        found.map_or("not given".to_owned(), |(_, value)| value.clone())
    };
    names.chain(other).find_map(|name| {
        let (one, two) = (of(here, name), of(there, name));
        (one != two).then(|| {
            let (one, two) = around(&one, &two);
            format!("`{name}` is {one} here and {two} there")
        })
    })
}

/// Both texts, where they are long only around their first difference.
fn around(one: &str, two: &str) -> (String, String) {
    let same = one
        .chars()
        .zip(two.chars())
        .take_while(|(a, b)| a == b)
        .count();
    let start = same.saturating_sub(SHOWN);
    let part = |text: &str| {
        let shown: String = text.chars().skip(start).take(2 * SHOWN).collect();
        let (left, right) = (
            if start > 0 { "…" } else { "" },
            if text.chars().count() > start + 2 * SHOWN {
                "…"
            } else {
                ""
            },
        );
        format!("{left}{shown}{right}")
    };
    (part(one), part(two))
}
