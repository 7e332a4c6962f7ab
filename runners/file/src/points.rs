//! Points in a CSV file, one a line: what `at = "points.csv"` asks for.

use core::ops::Range;
use std::path::Path;

use fredholm::{Ask, Region};

use crate::place::{InputError, Placed, Source};
use crate::{MAX_BYTES, MAX_GRID, ProblemFile, load, utf8};

/// Reads a point from the fields of its line, or says what is wrong with them.
pub(crate) type ReadPoint<'a> = dyn FnMut(&[&str]) -> Result<Region, String> + 'a;

impl ProblemFile {
    /// The points of a CSV file, whose path is relative to this file.
    ///
    /// # Errors
    /// A file that cannot be read, at its place in this file, or a wrong line of it, at the line.
    pub(crate) fn listed(
        &self,
        path: &Placed<String>,
        point: &mut ReadPoint<'_>,
    ) -> Result<Vec<Ask>, InputError> {
        let whole = self.beside(Path::new(&path.value));
        let name = whole.display().to_string();
        let bytes = load(&whole, MAX_BYTES).map_err(|error| self.error(&path.place, error))?;
        let source = Source {
            text: utf8(&name, bytes)?,
            name,
        };
        let regions = read(&source, point)?;
        if regions.is_empty() {
            let message = format!("{} has no points: one is wanted on each line", source.name);
            return Err(self.error(&path.place, message));
        }
        Ok(regions.into_iter().map(Ask::One).collect())
    }
}

/// The points of all lines. A head has none.
fn read(source: &Source, point: &mut ReadPoint<'_>) -> Result<Vec<Region>, InputError> {
    let mut regions = Vec::new();
    for row in rows(source).filter(|row| !row.is_head) {
        if regions.len() == MAX_GRID {
            let message = format!("more than {MAX_GRID} points");
            return Err(source.error(row.here, message));
        }
        let region = point(&row.fields).map_err(|message| source.error(row.here, message))?;
        regions.push(region);
    }
    Ok(regions)
}

/// A line of a CSV file.
pub(crate) struct Row<'t> {
    /// The bytes of the line.
    pub(crate) here: Range<usize>,
    pub(crate) fields: Vec<&'t str>,
    /// Whether it is the first line and has no number.
    pub(crate) is_head: bool,
}

/// All lines but for empty ones and those that begin with #.
pub(crate) fn rows(source: &Source) -> impl Iterator<Item = Row<'_>> {
    let (mut start, mut is_first) = (0, true);
    source.text.split_inclusive('\n').filter_map(move |line| {
        let here = start..start + line.trim_end().len();
        start += line.len();
        let line = line.trim_start_matches('\u{feff}').trim();
        if line.is_empty() || line.starts_with('#') {
            return None;
        }
        let fields = fields(line);
        let has_number = fields.iter().any(|field| field.parse::<f64>().is_ok());
        let is_head = core::mem::take(&mut is_first) && !has_number;
        Some(Row {
            here,
            fields,
            is_head,
        })
    })
}

/// The fields of a line, without blanks around them and the quotes around a field.
fn fields(line: &str) -> Vec<&str> {
    let mut quoted = false;
    line.split(|c| {
        quoted ^= c == '"';
        c == ',' && !quoted
    })
    .map(|field| {
        let field = field.trim();
        let inner = field.strip_prefix('"').and_then(|f| f.strip_suffix('"'));
        inner.unwrap_or(field)
    })
    .collect()
}

/// The finite numbers of a line.
pub(crate) fn numbers(fields: &[&str]) -> Result<Vec<f64>, String> {
    fields.iter().copied().map(number).collect()
}

/// A finite number.
pub(crate) fn number(field: &str) -> Result<f64, String> {
    let number = field.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("{field:?} is not a number; points are written as `0.25, 0.5`"))
}

#[cfg(test)]
mod tests {
    use super::{Region, Source, fields, numbers, read};

    fn points(text: &str) -> Result<Vec<Region>, String> {
        let source = Source {
            name: "p.csv".to_owned(),
            text: text.to_owned(),
        };
        let read = read(&source, &mut |fields| Ok(Region::Point(numbers(fields)?)));
        read.map_err(|error| error.to_string())
    }

    #[test]
    fn points_are_read_line_by_line() {
        let two = vec![
            Region::Point(vec![0.5, 1.0]),
            Region::Point(vec![-1e-3, 2.0]),
        ];
        for text in [
            "0.5,1\n-1e-3,2",
            "\u{feff}x1, x2\r\n# the middle\r\n0.5, 1\r\n\r\n \"-1e-3\",2\r\n",
        ] {
            assert_eq!(points(text), Ok(two.clone()), "{text:?}");
        }
        assert_eq!(points("x\n#"), Ok(vec![]));
        assert_eq!(fields("\"a, b\", 0.5"), ["a, b", "0.5"]);
    }

    #[test]
    fn a_wrong_line_is_shown() {
        let error = points("x, y\n0, 1\n0, one\n").unwrap_err();
        assert!(
            error.starts_with("p.csv:3:1: \"one\" is not a number"),
            "{error}"
        );
        assert!(error.contains("3 | 0, one"), "{error}");
        assert!(points("0, inf").unwrap_err().contains("not a number"));
        let many = "0\n".repeat(crate::MAX_GRID + 1);
        let error = points(&many).unwrap_err();
        assert!(error.contains("more than 100000 points"), "{error}");
    }
}
