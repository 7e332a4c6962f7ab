//! What is said of merged parts: what is missing, and what would help.

use core::ops::Range;
use std::path::Path;

use crate::identity::Header;
use crate::merge::{Behind, Merged};

/// The most parts that are named.
const NAMED: usize = 20;

impl Merged {
    /// The batches that are missing, in words; `None`: none is.
    #[must_use]
    pub fn missing_text(&self) -> Option<String> {
        if self.missing.is_empty() {
            return None;
        }
        let all = self.job.walks().div_ceil(self.job.settings.batch().max(1));
        let one = |range: &Range<u64>| match range.end - range.start {
            1 => format!("{}", range.start + 1),
            _ => format!("{} to {}", range.start + 1, range.end),
        };
        let named: Vec<String> = self.missing.iter().take(NAMED).map(one).collect();
        let more = if self.missing.len() > NAMED {
            ", …"
        } else {
            ""
        };
        Some(format!(
            "batches {}{more} of {all} are missing",
            named.join(", ")
        ))
    }

    /// The commands that make the missing parts, and one for as many walks more as the tolerance takes, each with a word on it.
    #[must_use]
    pub fn advice(&self) -> Vec<String> {
        let mut advice: Vec<String> = self
            .behind
            .iter()
            .take(NAMED)
            .map(|behind| self.command(behind))
            .collect();
        if self.behind.len() > NAMED {
            advice.push(format!("and {} more parts", self.behind.len() - NAMED));
        }
        advice.extend(self.needed().map(|needed| self.more(needed)));
        advice
    }

    /// The problem file and the options as one types them.
    fn problem(&self) -> String {
        let Header { name, options, .. } = &self.header;
        let blank = if options.is_empty() { "" } else { " " };
        format!("fredholm solve {}{blank}{options}", quoted(name))
    }

    fn command(&self, Behind { share, path }: &Behind) -> String {
        let (state, path) = match path {
            Some(path) => ("not finished", quoted(&path.display().to_string())),
            None => ("not there", format!("part-{}", share.part)),
        };
        let after = match share.after {
            0 => String::new(),
            after => format!(" --after {after}"),
        };
        format!(
            "part {share} is {state}: {} --walks {}{after} --part {share} --save {path}",
            self.problem(),
            self.job.walks(),
        )
    }

    fn more(&self, needed: u64) -> String {
        let batch = self.job.settings.batch().max(1);
        let (whole, parts) = (self.job.walks() / batch * batch, self.parts);
        let stem = Path::new(&self.header.name).file_stem();
        let stem = stem.map_or("more".into(), |stem| stem.to_string_lossy());
        format!(
            "the target error takes about {needed} walks of each target; in {parts} parts: for k in $(seq {parts}); do {} \
             --walks {needed} --after {whole} --part $k/{parts} --save {}-{needed}-$k; done",
            self.problem(),
            quoted(&stem),
        )
    }
}

/// Options of `solve` that say how much is done, where, and what becomes of it, with a value each.
const NOT_OF_THE_PROBLEM: [&str; 9] = [
    "--walks",
    "--part",
    "--after",
    "--save",
    "--save-system",
    "--system",
    "--out",
    "--threads",
    "--time-limit",
];

/// The options of a command line of `solve` that stand in place of the problem file's values, as one would type them: without
/// those that say how many walks are made, where, and what becomes of them.
///
/// ```
/// use fredholm_parts::options_of_the_problem;
///
/// let args = ["--cells=9", "--walks", "100", "--save=x", "--seed", "2", "--json"];
/// assert_eq!(options_of_the_problem(args.map(str::to_owned)), "--cells=9 --seed 2");
/// ```
#[must_use]
pub fn options_of_the_problem(args: impl IntoIterator<Item = String>) -> String {
    let mut args = args.into_iter();
    let mut options = Vec::new();
    while let Some(arg) = args.next() {
        let name = arg.split('=').next().unwrap_or(&arg);
        if !NOT_OF_THE_PROBLEM.contains(&name) {
            options.extend(Some(quoted(&arg)).filter(|_| arg != "--json"));
        } else if name == arg {
            args.next();
        }
    }
    options.join(" ")
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=+:,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn a_shell_takes_any_path_for_one_word() {
        assert_eq!(quoted("/a/b-1.toml"), "/a/b-1.toml");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
