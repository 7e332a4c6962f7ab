//! `fredholm init`: problem files to begin with.

use fredholm_file::KINDS;

use crate::failure::{Ended, Failure, print, say};

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../examples/", $name)))),*]
    };
}

/// The names and contents of the examples, and of what they read.
const EXAMPLES: &[(&str, &str)] = files![
    "circle.toml",
    "coloured-room.toml",
    "colours.toml",
    "cornell.toml",
    "doorway.toml",
    "facet.toml",
    "facet.vs2",
    "furnace.toml",
    "furnished.toml",
    "gauss.toml",
    "living-room-daylight.toml",
    "living-room.obj",
    "living-room.toml",
    "reheating.toml",
    "satellite.toml",
    "scattering.toml",
    "sphere.toml",
    "tube.toml",
];

/// The names that there are, those of kinds first.
pub(crate) fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    let kinds = KINDS.iter().map(|entry| (entry.word, entry.about));
    // The beginning of the first sentence.
    let title = |text: &'static str| {
        let first = text.lines().next().unwrap_or_default();
        let Some(first) = first.strip_prefix("# ") else {
            return "What another one reads";
        };
        let ends = [". ", ": ", "; ", " (", ", from"];
        let end = ends.iter().filter_map(|end| first.find(end)).min();
        let title = first.get(..end.unwrap_or(first.len())).unwrap_or(first);
        title.trim_end_matches(['.', ':', ','])
    };
    kinds.chain(
        EXAMPLES
            .iter()
            .map(move |(name, text)| (*name, title(text))),
    )
}

/// Runs `init`.
pub(crate) fn init(name: &str) -> Result<Ended, Failure> {
    let kinds = KINDS.iter().map(|entry| (entry.word, entry.template));
    let all = || kinds.clone().chain(EXAMPLES.iter().copied());
    // The command line lets no other name pass.
    let text = all().find(|(known, _)| *known == name);
    let text = text.map_or("", |(_, text)| text);
    print(text)?;
    // What stands behind # is only said.
    let meant = |other: &str| {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        lines.any(|line| line.contains(&format!("\"{other}\"")))
    };
    let read = EXAMPLES.iter().filter(|(other, _)| meant(other));
    for (other, _) in read {
        say(format_args!(
            "note: this file reads {other}, which `fredholm init {other}` prints"
        ));
    }
    Ok(Ended::Done)
}

#[cfg(test)]
mod tests {
    /// None is forgotten.
    #[test]
    fn every_example_is_there() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
        let all = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = all.map(|file| file.unwrap().file_name()).collect();
        names.sort();
        let known: Vec<&str> = super::EXAMPLES.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, known);
    }
}
