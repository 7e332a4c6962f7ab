//! Where values stand, and errors that show it.

use core::fmt::{self, Display};
use core::ops::Range;

/// The longest part of a source line shown in an error, in characters.
pub(crate) const SHOWN: usize = 100;

/// The origin of a value.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// These bytes of the file.
    File(Range<usize>),
    /// The command-line flag of this name, dashes included.
    Flag(&'static str),
    /// Nobody gave the value.
    Default,
}

/// A value and where it comes from. Its `Debug` is that of the value: two files that say the same look the same.
#[derive(Clone, PartialEq)]
pub struct Placed<T> {
    /// The value.
    pub value: T,
    /// The origin of the value.
    pub place: Place,
}

impl<T: fmt::Debug> fmt::Debug for Placed<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.value.fmt(f)
    }
}

impl<T> Placed<T> {
    /// A value given by the command-line flag `flag` (such as `--walks`).
    pub fn flag(flag: &'static str, value: T) -> Self {
        let place = Place::Flag(flag);
        Self { value, place }
    }

    /// A value which stands in the file.
    pub(crate) fn file(span: Range<usize>, value: T) -> Self {
        let place = Place::File(span);
        Self { value, place }
    }

    /// A value which nobody gave.
    pub(crate) fn default(value: T) -> Self {
        let place = Place::Default;
        Self { value, place }
    }
}

/// A value of a file that a flag may replace.
pub trait SetByFlag<T> {
    /// Puts the value of the command-line flag `flag` in the place of this one, if the flag was given.
    fn set_by(&mut self, flag: &'static str, given: Option<T>);
}

impl<T> SetByFlag<T> for Placed<T> {
    fn set_by(&mut self, flag: &'static str, given: Option<T>) {
        if let Some(value) = given {
            *self = Self::flag(flag, value);
        }
    }
}

impl<T> SetByFlag<T> for Option<Placed<T>> {
    fn set_by(&mut self, flag: &'static str, given: Option<T>) {
        if let Some(value) = given {
            *self = Some(Placed::flag(flag, value));
        }
    }
}

/// An error of the input, rendered with the place in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// The whole message; may have several lines, without a last line break.
    pub(crate) rendered: String,
}

impl InputError {
    /// An error that no place shows.
    pub fn new(message: impl Display) -> Self {
        Self {
            rendered: message.to_string(),
        }
    }

    /// The error with the name of the surface that it concerns, behind what is wrong.
    pub(crate) fn of_surface(self, name: &str) -> Self {
        let (message, shown) = match self.rendered.split_once('\n') {
            Some((message, shown)) => (message, format!("\n{shown}")),
            None => (&*self.rendered, String::new()),
        };
        Self {
            rendered: format!("{message} (surface {name:?}){shown}"),
        }
    }
}

impl Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.rendered)
    }
}

impl core::error::Error for InputError {}

/// Name and text of a file.
#[derive(Clone, Debug)]
pub struct Source {
    /// The name of the file in errors.
    pub name: String,
    /// The text of the source.
    pub text: String,
}

/// A place as people count.
#[derive(Debug)]
pub struct Position<'t> {
    /// The line, from 1.
    pub line: usize,
    /// The number of characters before the place in its line.
    pub before: usize,
    /// Where the place is, in bytes: on a character, in the line or at its end.
    start: usize,
    /// The line, without its end.
    content: &'t str,
}

impl Source {
    /// Renders an error at some bytes of the text.
    pub fn error(&self, span: Range<usize>, message: impl Display) -> InputError {
        let Position {
            line,
            before,
            start,
            content,
        } = self.locate(span.start);
        let marked = self
            .text
            .get(start..self.floor(span.end))
            .map_or(0, |text| text.chars().take_while(|c| *c != '\n').count());

        // An array may be a very long line: show the part around the place.
        let length = content.chars().count();
        let skipped = if length > SHOWN {
            before.saturating_sub(SHOWN / 2)
        } else {
            0
        };
        let shown = content
            .chars()
            .skip(skipped)
            .take(SHOWN)
            .map(printable)
            .collect::<String>();
        let left = if skipped > 0 { "…" } else { "" };
        let right = if length - skipped > SHOWN { "…" } else { "" };
        // Tabs stay tabs, so that the mark is under its character.
        let indent = left
            .chars()
            .chain(shown.chars())
            .take(left.chars().count() + before - skipped)
            .map(|c| if c == '\t' { '\t' } else { ' ' })
            .collect::<String>();
        let room = shown.chars().count().saturating_sub(before - skipped);
        let mark = "^".repeat(marked.min(room).max(1));

        let name = &self.name;
        let column = before + 1;
        let number = line.to_string();
        let gutter = " ".repeat(number.len());
        InputError {
            rendered: format!(
                "{name}:{line}:{column}: {message}\n\
                 {gutter} |\n\
                 {number} | {left}{shown}{right}\n\
                 {gutter} | {indent}{mark}"
            ),
        }
    }

    /// Renders an error at a part of the string value that stands at `span`. Where the file spells the
    /// value differently (with escapes), the whole string is shown.
    pub(crate) fn error_within(
        &self,
        span: &Range<usize>,
        value: &str,
        part: Range<usize>,
        message: impl Display,
    ) -> InputError {
        let written = self.text.get(span.clone()).unwrap_or("");
        match written.find(value) {
            Some(start) if !value.is_empty() => {
                let start = span.start + start;
                self.error(start + part.start..start + part.end, message)
            }
            _ => self.error(span.clone(), message),
        }
    }

    /// The line and column of a byte of the text.
    pub fn locate(&self, byte: usize) -> Position<'_> {
        let text = self.text.as_str();
        // An editor does not show a byte order mark.
        let first = if text.starts_with('\u{feff}') { 3 } else { 0 };
        let byte = self.floor(byte).max(first);
        let line_start = text[first..byte]
            .rfind('\n')
            .map_or(first, |i| first + i + 1);
        let rest = &text[line_start..];
        let content = rest.split('\n').next().unwrap_or(rest);
        let content = content.strip_suffix('\r').unwrap_or(content);
        let start = byte.min(line_start + content.len());
        Position {
            line: text[..line_start].matches('\n').count() + 1,
            before: text[line_start..start].chars().count(),
            start,
            content,
        }
    }

    /// The last start of a character, or end of the text, not after a byte.
    fn floor(&self, byte: usize) -> usize {
        let byte = byte.min(self.text.len());
        (0..=byte)
            .rev()
            .find(|&i| self.text.is_char_boundary(i))
            .unwrap_or(0)
    }
}

/// A character that a terminal may be given: control characters could move the
/// caret or worse.
fn printable(c: char) -> char {
    if c.is_control() && c != '\t' {
        '\u{fffd}'
    } else {
        c
    }
}
