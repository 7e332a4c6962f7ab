//! The words of a text, line by line, and errors that show one of them: for decks and meshes.

use core::fmt::Display;
use core::ops::Range;

use crate::{InputError, Source};

/// What is wrong, and the bytes where it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Wrong {
    pub(crate) place: Range<usize>,
    pub(crate) message: String,
}

impl Wrong {
    /// A text ends too early: its last line is shown.
    pub(crate) fn cut_short(text: &str, message: &str) -> Self {
        let text = text.trim_end();
        let start = text.rfind('\n').map_or(0, |end| end + 1);
        Self {
            place: start..text.len(),
            message: message.to_owned(),
        }
    }

    pub(crate) fn at(self, source: &Source) -> InputError {
        source.error(self.place, self.message)
    }
}

/// The words of a line, with what an error needs.
#[derive(Clone, Debug)]
pub(crate) struct Words<'t> {
    /// The whole text.
    text: &'t str,
    pub(crate) rest: &'t str,
    pub(crate) line: u32,
}

/// Stands for the end of a line that goes on: it is a blank, as long as what it stands for.
const GOES_ON: char = '\u{b}';

/// The text with lines that go on behind a backslash as one line; every byte keeps its place.
pub(crate) fn joined(text: &str) -> String {
    let text = text.replace("\\\r\n", " \r\u{b}");
    text.replace("\\\n", " \u{b}")
}

/// The lines of a text that say something; what follows one of `comments` does not.
pub(crate) fn lines<'t>(
    text: &'t str,
    comments: &'static [char],
) -> impl Iterator<Item = Words<'t>> {
    let mut next = 1;
    text.lines().filter_map(move |content| {
        let line = next;
        next += 1 + content.matches(GOES_ON).count() as u32;
        let rest = content.split(comments).next().unwrap_or("").trim_end();
        (!rest.trim_start().is_empty()).then_some(Words { text, rest, line })
    })
}

impl<'t> Words<'t> {
    /// The next word, perhaps empty.
    pub(crate) fn next(&mut self) -> &'t str {
        let rest = self.rest.trim_start();
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.rest = rest;
        word
    }

    /// An error about a word of the text.
    pub(crate) fn wrong(&self, word: &str, message: impl Display) -> Wrong {
        let start = word.as_ptr() as usize - self.text.as_ptr() as usize;
        Wrong {
            place: start..start + word.len(),
            message: message.to_string(),
        }
    }

    pub(crate) fn word(&mut self, what: &str) -> Result<&'t str, Wrong> {
        let word = self.next();
        if word.is_empty() {
            return Err(self.wrong(self.rest, format_args!("the line ends before {what}")));
        }
        Ok(word)
    }

    pub(crate) fn parsed<T: core::str::FromStr>(&mut self, what: &str) -> Result<T, Wrong> {
        let word = self.word(what)?;
        let wrong = |_| self.wrong(word, format_args!("{word:?} is not {what}"));
        word.parse().map_err(wrong)
    }

    pub(crate) fn number(&mut self, what: &str) -> Result<f64, Wrong> {
        let word = self.word(what)?;
        let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| {
            self.wrong(
                word,
                format_args!("{what} must be a finite number, not {word:?}"),
            )
        })
    }

    pub(crate) fn point(&mut self) -> Result<[f64; 3], Wrong> {
        Ok([
            self.number("the coordinate x")?,
            self.number("the coordinate y")?,
            self.number("the coordinate z")?,
        ])
    }

    /// The emissivity of a surface of a deck.
    pub(crate) fn emissivity(&mut self) -> Result<f64, Wrong> {
        let word = self.clone().next();
        let emissivity = self.number("the emissivity")?;
        if emissivity > 0.0 && emissivity <= 1.0 {
            Ok(emissivity)
        } else {
            Err(self.wrong(word, "an emissivity must be more than 0 and at most 1"))
        }
    }

    /// The name of the surface with this number of a deck, at the end of its line.
    pub(crate) fn name_of(&mut self, id: u64) -> String {
        let name = self.name();
        match name.is_empty() {
            true => format!("S{id}"),
            false => name,
        }
    }

    /// What is left of the line, as a name: what moves the caret of a terminal is no part of it.
    pub(crate) fn name(&mut self) -> String {
        let name = self.rest.replace(char::is_control, " ");
        self.rest = "";
        name.trim().to_owned()
    }
}
