//! Tables and values of the TOML tree, read one by one with their places.
//!
//! Derived deserialisation forgets where a value stood, and its untagged enums swallow unknown keys. So the tree is
//! walked by hand: a [`Section`] gives out its keys one by one, and what nobody asked for is an error.

use core::fmt::Display;
use core::ops::Range;

use fredholm::Choices;
use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

use crate::place::{InputError, Placed, Source};

/// A table of the file, which gives out its keys one by one.
pub(crate) struct Section<'s, 'i> {
    /// The file, for errors.
    pub(crate) source: &'s Source,
    /// Where its keys stand, as errors say it: "in `[walk]`".
    label: &'static str,
    /// The header, or the whole table where it is written in one line.
    pub(crate) span: Range<usize>,
    /// The keys not yet given out.
    table: DeTable<'i>,
    /// The keys asked for so far, there or not.
    asked: Vec<&'static str>,
}

impl<'s, 'i> Section<'s, 'i> {
    /// The section of which nothing was asked yet.
    pub(crate) fn new(
        source: &'s Source,
        label: &'static str,
        span: Range<usize>,
        table: DeTable<'i>,
    ) -> Self {
        Self {
            source,
            label,
            span,
            table,
            asked: Vec::new(),
        }
    }

    /// The value of a key which may be absent.
    pub(crate) fn optional(&mut self, key: &'static str) -> Option<Field<'s, 'i>> {
        if !self.asked.contains(&key) {
            self.asked.push(key);
        }
        let (found, value) = self.table.remove_entry(key)?;
        Some(Field {
            source: self.source,
            name: key.to_owned(),
            key: found.span(),
            span: value.span(),
            value: value.into_inner(),
        })
    }

    /// The value of a key which must be there.
    pub(crate) fn required(&mut self, key: &'static str) -> Result<Field<'s, 'i>, InputError> {
        self.optional(key).ok_or_else(|| self.missing(key))
    }

    /// What `read` makes of the value of a key which may be absent.
    pub(crate) fn read<T>(
        &mut self,
        key: &'static str,
        read: impl FnOnce(&Field<'s, 'i>) -> Result<T, InputError>,
    ) -> Result<Option<T>, InputError> {
        self.optional(key).map(|field| read(&field)).transpose()
    }

    /// What `read` makes of the value of a key, or the default where there is none.
    pub(crate) fn read_or<T>(
        &mut self,
        key: &'static str,
        read: impl FnOnce(&Field<'s, 'i>) -> Result<Placed<T>, InputError>,
        default: T,
    ) -> Result<Placed<T>, InputError> {
        let value = self.read(key, read)?;
        Ok(value.unwrap_or_else(|| Placed::default(default)))
    }

    /// The table of a key, or an empty one where there is none.
    pub(crate) fn section(
        &mut self,
        key: &'static str,
        label: &'static str,
    ) -> Result<Self, InputError> {
        match self.optional(key) {
            Some(field) => field.section(label),
            None => Ok(Self::new(
                self.source,
                label,
                self.span.clone(),
                DeTable::new(),
            )),
        }
    }

    /// The tables in the table of a key, in their order, each with the names and values of this section that it does not give itself. `None`:
    /// there is no such key.
    pub(crate) fn variants(
        &mut self,
        key: &'static str,
    ) -> Result<Option<Vec<(String, Self)>>, InputError> {
        let Some(field) = self.optional(key) else {
            return Ok(None);
        };
        let (source, span) = (field.source, self.span.clone());
        let mut all: Vec<_> = field.section(self.label)?.table.into_iter().collect();
        // The tree is sorted by key.
        all.sort_by_key(|(name, _)| name.span().start);
        let variant = |(name, own): (Spanned<_>, Spanned<DeValue<'i>>)| {
            let name: std::borrow::Cow<'_, str> = name.into_inner();
            let own = match own.get_ref() {
                DeValue::Table(own) => own,
                _ => {
                    let message = format_args!(
                        "`{key}` is a table of tables, `{key}.{name} = {{ ... }}`, with what differs between them"
                    );
                    return Err(source.error(own.span(), message));
                }
            };
            let mut table = self.table.clone();
            overlay(&mut table, own);
            let section = Self {
                asked: self.asked.clone(),
                ..Self::new(source, self.label, span.clone(), table)
            };
            Ok((name.into_owned(), section))
        };
        all.into_iter()
            .map(variant)
            .collect::<Result<_, _>>()
            .map(Some)
    }

    /// An error if a key is left which nobody asked for.
    pub(crate) fn finish(&self) -> Result<(), InputError> {
        // The tree is sorted by key; the first in the file is meant.
        match self.table.keys().min_by_key(|key| key.span().start) {
            Some(key) => Err(self.unknown(key.get_ref(), key.span())),
            None => Ok(()),
        }
    }

    /// The error for a key which is not there.
    pub(crate) fn missing(&self, key: &str) -> InputError {
        // A mistyped key is the likelier reason, and there is a place to show.
        let typo = self
            .table
            .keys()
            .filter(|other| distance_if_near(other.get_ref(), key).is_some())
            .min_by_key(|other| other.span().start);
        match typo {
            Some(other) => self.unknown(other.get_ref(), other.span()),
            None => self.error(format_args!("`{key}` is missing {}", self.label)),
        }
    }

    /// The error for a key which does not exist.
    pub(crate) fn unknown(&self, key: &str, span: Range<usize>) -> InputError {
        let hint = match nearest(key, &self.asked) {
            Some(known) => format!("did you mean `{known}`?"),
            None => format!("known here: {}", listed(&self.asked, '`', "and")),
        };
        let key = key.escape_debug();
        let label = self.label;
        self.source
            .error(span, format_args!("unknown key `{key}` {label}; {hint}"))
    }

    /// An error about the whole section.
    pub(crate) fn error(&self, message: impl Display) -> InputError {
        self.source.error(self.span.clone(), message)
    }
}

/// Puts the values of a table in the place of those of another one; in tables of both, one by one.
fn overlay<'i>(table: &mut DeTable<'i>, own: &DeTable<'i>) {
    for (key, value) in own {
        let below = table.get_mut(key.get_ref().as_ref());
        if let (Some(DeValue::Table(below)), DeValue::Table(own)) =
            (below.map(Spanned::get_mut), value.get_ref())
        {
            overlay(below, own);
            continue;
        }
        // So that the key stands where this one does.
        table.remove(key.get_ref().as_ref());
        table.insert(key.clone(), value.clone());
    }
}

/// A value of the file, not yet read as the type it must have.
pub(crate) struct Field<'s, 'i> {
    /// The file, for errors.
    pub(crate) source: &'s Source,
    /// What errors call it: its key, or `key[index]` for an element.
    pub(crate) name: String,
    /// Where its key stands.
    pub(crate) key: Range<usize>,
    /// Where it stands.
    pub(crate) span: Range<usize>,
    /// What the parser read.
    pub(crate) value: DeValue<'i>,
}

impl<'s, 'i> Field<'s, 'i> {
    /// The elements of the array here, one after the other: there may be millions.
    pub(crate) fn items(&self, wanted: &str) -> Result<impl Iterator<Item = Self>, InputError> {
        let DeValue::Array(array) = &self.value else {
            return Err(self.mistyped(wanted));
        };
        let item = |(index, element): (usize, &Spanned<DeValue<'i>>)| Self {
            source: self.source,
            name: format!("{}[{index}]", self.name),
            key: self.key.clone(),
            span: element.span(),
            value: element.get_ref().clone(),
        };
        Ok(array.iter().enumerate().map(item))
    }

    /// What `read` makes of the elements of the array here.
    pub(crate) fn elements<T>(
        &self,
        wanted: &str,
        read: impl Fn(&Self) -> Result<T, InputError>,
    ) -> Result<Placed<Vec<T>>, InputError> {
        let values = self.items(wanted)?.map(|item| read(&item));
        let values = values.collect::<Result<_, _>>()?;
        Ok(Placed::file(self.span.clone(), values))
    }

    /// Whether the value here is an array with an array in it.
    pub(crate) fn is_nested(&self) -> bool {
        let array = self.value.as_array();
        array.is_some_and(|array| array.iter().any(|item| item.get_ref().is_array()))
    }

    /// What `read` makes of the arrays in the array here, or of the value here alone if that has none in it.
    pub(crate) fn one_or_more<T>(
        &self,
        read: impl Fn(&Self) -> Result<T, InputError>,
    ) -> Result<Placed<Vec<T>>, InputError> {
        match self.is_nested() {
            true => self.elements("an array", read),
            false => Ok(Placed::file(self.span.clone(), vec![read(self)?])),
        }
    }

    /// What `read` makes of the tables here, of which each has the header that the label names: "in `[[target]]`".
    pub(crate) fn tables<T>(
        &self,
        label: &'static str,
        mut read: impl FnMut(Section<'s, 'i>) -> Result<T, InputError>,
    ) -> Result<Vec<T>, InputError> {
        let header = label.trim_start_matches("in ");
        let wanted = format!("a list of tables: write {header}");
        let items = self.items(&wanted)?;
        items.map(|item| read(item.section(label)?)).collect()
    }

    /// The table here.
    pub(crate) fn section(self, label: &'static str) -> Result<Section<'s, 'i>, InputError> {
        match self.value {
            DeValue::Table(table) => Ok(Section::new(self.source, label, self.span, table)),
            _ => Err(self.mistyped("a table")),
        }
    }

    /// The finite number here; an integer is one.
    pub(crate) fn number(&self) -> Result<Placed<f64>, InputError> {
        let number = match &self.value {
            DeValue::Float(float) => float.as_str().parse().unwrap_or(f64::NAN),
            // Rounds beyond 2^53, as decimals are rounded.
            DeValue::Integer(integer) => parse_integer(integer).map_or(f64::INFINITY, |n| n as f64),
            _ => return Err(self.mistyped("a number")),
        };
        if number.is_finite() {
            Ok(Placed::file(self.span.clone(), number))
        } else {
            Err(self.error(format_args!("`{}` must be a finite number", self.name)))
        }
    }

    /// The numbers here: an array, or a single number as an array of one.
    pub(crate) fn numbers(&self) -> Result<Placed<Vec<Placed<f64>>>, InputError> {
        match &self.value {
            DeValue::Integer(_) | DeValue::Float(_) => {
                Ok(Placed::file(self.span.clone(), vec![self.number()?]))
            }
            _ => self.elements("a number or an array of numbers", Self::number),
        }
    }

    /// The integer here.
    pub(crate) fn integer<T: TryFrom<i128>>(&self) -> Result<Placed<T>, InputError> {
        let integer = match &self.value {
            DeValue::Integer(integer) => integer,
            DeValue::Float(float) => {
                return Err(self.error(format_args!(
                    "`{}` must be an integer, found {}{}",
                    self.name,
                    float.as_str(),
                    as_integer(float.as_str())
                )));
            }
            _ => return Err(self.mistyped("an integer")),
        };
        match parse_integer(integer).and_then(|value| T::try_from(value).ok()) {
            Some(value) => Ok(Placed::file(self.span.clone(), value)),
            None if integer.as_str().starts_with('-') => {
                Err(self.error(format_args!("`{}` must not be negative", self.name)))
            }
            None => Err(self.error(format_args!("`{}` is too large", self.name))),
        }
    }

    /// The integers here: an array.
    pub(crate) fn integers(&self) -> Result<Placed<Vec<Placed<usize>>>, InputError> {
        self.elements("an array of integers", Self::integer)
    }

    /// The string here.
    pub(crate) fn text(&self) -> Result<&str, InputError> {
        self.value.as_str().ok_or_else(|| self.mistyped("a string"))
    }

    /// The string here, to keep.
    pub(crate) fn string(&self) -> Result<Placed<String>, InputError> {
        Ok(Placed::file(self.span.clone(), self.text()?.to_owned()))
    }

    /// The key and the value as they are written, on one line.
    pub(crate) fn written(&self) -> Placed<String> {
        let whole = self.key.start..self.span.end;
        let words = self.source.text.get(whole.clone()).unwrap_or(&self.name);
        let words: Vec<&str> = words.split_whitespace().collect();
        Placed::file(whole, words.join(" "))
    }

    /// The strings here: an array.
    pub(crate) fn strings(&self) -> Result<Placed<Vec<Placed<String>>>, InputError> {
        self.elements("an array of strings", Self::string)
    }

    /// The boolean here.
    pub(crate) fn boolean(&self) -> Result<Placed<bool>, InputError> {
        match self.value {
            DeValue::Boolean(value) => Ok(Placed::file(self.span.clone(), value)),
            _ => Err(self.mistyped("true or false")),
        }
    }

    /// The choice whose word stands here.
    pub(crate) fn word<T: Choices>(&self) -> Result<Placed<T>, InputError> {
        let words = T::ALL.iter().map(|choice| choice.word.to_owned());
        let words = words.collect::<Vec<_>>();
        let DeValue::String(text) = &self.value else {
            return Err(self.mistyped(&listed(&words, '"', "or")));
        };
        match T::of_word(text) {
            Some(choice) => Ok(Placed::file(self.span.clone(), choice)),
            None => Err(self.error(unknown_word(&self.name, text, &words))),
        }
    }

    /// The error for a value of the wrong type.
    pub(crate) fn mistyped(&self, wanted: &str) -> InputError {
        let found = match &self.value {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) => "an integer",
            DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "a boolean",
            DeValue::Datetime(_) => "a date or time",
            DeValue::Array(_) => "an array",
            DeValue::Table(_) => "a table",
        };
        let name = &self.name;
        self.error(format_args!("`{name}` must be {wanted}, found {found}"))
    }

    /// An error about the key of this value, which does not belong here.
    pub(crate) fn unsuited(&self, message: impl Display) -> InputError {
        self.source.error(self.key.clone(), message)
    }

    /// An error about this value.
    pub(crate) fn error(&self, message: impl Display) -> InputError {
        self.source.error(self.span.clone(), message)
    }
}

/// The integer which the parser left as text, if it is not beyond all types.
pub(crate) fn parse_integer(integer: &DeInteger<'_>) -> Option<i128> {
    i128::from_str_radix(integer.as_str(), integer.radix()).ok()
}

/// How to write a float such as 1e5 as an integer, if it is one.
pub(crate) fn as_integer(float: &str) -> String {
    match float.parse::<f64>() {
        Ok(value) if value.fract() == 0.0 && value.abs() < 1e15 => format!(": write {value:.0}"),
        _ => String::new(),
    }
}

/// What is wrong with a word that is none of `words`.
pub(crate) fn unknown_word(name: &str, found: &str, words: &[String]) -> String {
    let hint = match nearest(found, words) {
        Some(word) => format!("; did you mean \"{word}\"?"),
        None => String::new(),
    };
    let words = listed(words, '"', "or");
    format!("`{name}` must be {words}, found {found:?}{hint}")
}

/// The words in quotes, with commas and a last `joint`.
pub(crate) fn listed(words: &[impl Display], quote: char, joint: &str) -> String {
    let mut list = String::new();
    for (index, word) in words.iter().enumerate() {
        if index > 0 && index + 1 == words.len() {
            list += &format!(" {joint} ");
        } else if index > 0 {
            list += ", ";
        }
        list += &format!("{quote}{word}{quote}");
    }
    list
}

/// The one of `known` which `word` was most likely meant to be, if any is near.
pub fn nearest<'a, S: AsRef<str>>(word: &str, known: &'a [S]) -> Option<&'a str> {
    known
        .iter()
        .filter_map(|known| Some((distance_if_near(word, known.as_ref())?, known.as_ref())))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}

/// Longer words, in bytes, are no slips of the pen.
const LONGEST_WORD: usize = 200;

/// How far a word is from a known one, if it may be meant: a few wrong letters,
/// an abbreviation or an ending too many.
pub(crate) fn distance_if_near(word: &str, known: &str) -> Option<usize> {
    // The distance takes time and memory like the product of the lengths.
    if word.len().max(known.len()) > LONGEST_WORD {
        return None;
    }
    let word = word.to_lowercase();
    let distance = strsim::damerau_levenshtein(&word, known);
    let extends = |long: &str, short: &str| short.len() >= 3 && long.starts_with(short);
    let near =
        distance <= known.len().div_ceil(3) || extends(known, &word) || extends(&word, known);
    near.then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn near_words() {
        let known = ["walks", "batch", "seed"];
        assert_eq!(nearest("Walk", &known), Some("walks"));
        assert_eq!(nearest("seeds", &known), Some("seed"));
        assert_eq!(nearest("temperature", &known), None);
    }
}
