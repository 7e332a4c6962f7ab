//! What a run is of: whatever its bits depend on, with a name for each, so that a refusal says what differs.

use fredholm::choice::ChoiceReport;
use fredholm::execute::{CellCount, SetUp, Walking};
use fredholm::{Discretisation, Settings, VALUE_VERSION, WalkOptions};
use fredholm_core::DEFAULT_GENERATOR;
use serde::{Deserialize, Serialize};

use super::container::checksum;

/// Longer values are kept as their checksum.
const LONG: usize = 500;
/// The most characters of a difference that are shown.
const SHOWN: usize = 60;

/// The named values on which no solved system depends.
const NOT_OF_THE_EQUATION: [&str; 3] = ["generator", "targets", "weights"];

/// A value with its name.
pub type Named = (String, String);

/// The problem of a run: all that its walks depend on before settings are chosen, and its text to read it again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// The version of results ([`VALUE_VERSION`]), the generator, and what the problem and its targets are, resolved.
    pub problem: Vec<Named>,
    /// The path of the problem file.
    pub name: String,
    /// The text of the problem file.
    pub text: String,
}

impl Header {
    /// The header of this program for a resolved problem, whose long values are kept as checksums.
    #[must_use]
    pub fn new(problem: Vec<Named>, name: String, text: String) -> Self {
        let short = |(name, value): Named| {
            let sum = || checksum(value.as_bytes());
            match value.len() {
                0..=LONG => (name, value),
                length => (
                    name,
                    format!("checksum {:016x} of {length} characters", sum()),
                ),
            }
        };
        let program = [
            ("version of results".to_owned(), VALUE_VERSION.to_string()),
            ("generator".to_owned(), DEFAULT_GENERATOR.to_owned()),
        ];
        Self {
            problem: program.into_iter().chain(problem).map(short).collect(),
            name,
            text,
        }
    }

    /// The equation alone: what its solved systems depend on.
    #[must_use]
    pub fn equation(&self) -> Vec<Named> {
        let is_of_it = |(name, _): &&Named| !NOT_OF_THE_EQUATION.contains(&name.as_str());
        self.problem.iter().filter(is_of_it).cloned().collect()
    }

    /// What differs from another problem; `None`: nothing that matters.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        difference(&self.problem, &other.problem)
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

    /// What differs from other walks; `None`: nothing that the bits of a batch depend on.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        difference(&self.named(), &other.named())
    }

    /// All that the bits of a batch depend on. The number of walks, the tolerance and the time limit are no part of it.
    pub(crate) fn named(&self) -> Vec<Named> {
        let cut = Discretisation {
            cells: None,
            ..self.settings.discretisation()
        };
        let walk = WalkOptions {
            walks: 0,
            tolerance: None,
            time_limit: None,
            allow_infinite_variance: false,
            ..self.settings.walk_options()
        };
        // The radius may be infinite, which JSON does not keep, and no bit depends on it.
        let set_up = SetUp {
            neighbour_second_moment_radius: None,
            seconds: 0.0,
            ..self.set_up.clone()
        };
        let named = [
            ("walks", format!("{walk:?}")),
            ("plain", self.plain.to_string()),
            ("cells", format!("{:?}", self.cells)),
            ("cut", format!("{cut:?}")),
            ("lift", format!("{:?}", self.settings.lift)),
            ("set-up", format!("{set_up:?}")),
        ];
        named.map(|(name, value)| (name.to_owned(), value)).into()
    }
}

/// A checksum of named values.
pub(crate) fn digest(named: &[Named]) -> u64 {
    checksum(format!("{named:?}").as_bytes())
}

/// The first of these values that differs, and how.
pub(crate) fn difference(here: &[Named], there: &[Named]) -> Option<String> {
    let of = |all: &[Named], name: &str| {
        let found = all.iter().find(|(known, _)| known == name);
        found.map_or(String::new(), |(_, value)| value.clone())
    };
    here.iter().chain(there).find_map(|(name, _)| {
        let (here, there) = (of(here, name), of(there, name));
        // Lists of things with a name each are long: what differs is one of them.
        let (mut one, mut two) = (here.split(", "), there.split(", "));
        let shown = |text: &str| {
            let inner = text.rsplit("{ ").next().unwrap_or(text);
            let shown: String = inner.trim_end_matches(" }").chars().take(SHOWN).collect();
            if shown.is_empty() {
                "nothing".to_owned()
            } else {
                shown
            }
        };
        loop {
            match (one.next(), two.next()) {
                (None, None) => return None,
                (one, two) if one == two => {}
                (one, two) => {
                    let [one, two] = [one, two].map(|text| shown(text.unwrap_or("")));
                    return Some(format!("`{name}` has {one} here and {two} there"));
                }
            }
        }
    })
}
