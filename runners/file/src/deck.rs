//! View2D decks (`.vs2`): vertices and straight surfaces, one a line.
//!
//! `V id x y`; `S id v1 v2 obs bas cmb emit name`, its active side on the left of v1 → v2; `T` a title,
//! `C encl …` control, `G 2` the dimension; `!` and `/` begin a comment; `End of data` ends it (Walton,
//! NISTIR 6925, 2002).

mod parts;

pub use parts::DeckParts;

use core::fmt::Display;
use core::ops::Range;
use std::collections::HashMap;
use std::path::Path;

use crate::words::{Words, Wrong, lines};
use crate::{InputError, Source, load};

/// Surfaces that a deck may have at most.
const MAX_SURFACES: usize = 1_000_000;
/// The most bytes of a deck: so many surfaces and their vertices, on long lines.
const MAX_BYTES: u64 = 256 << 20;

/// The content of a View2D deck. Two are equal that say the same, wherever it stands.
#[derive(Clone, Debug)]
pub struct Deck {
    /// The surfaces of the deck, in its order.
    pub surfaces: Vec<DeckSurface>,
    /// Whether it says that it is no enclosure.
    pub open: bool,
    /// The name and text of the deck, for errors.
    source: Source,
}

/// A surface of a deck. Two are equal that are the same, wherever they stand.
#[derive(Clone, Debug)]
pub struct DeckSurface {
    /// The name of the surface in targets and results.
    pub name: String,
    /// The two ends of the surface, its active side on the left.
    pub ends: [[f64; 2]; 2],
    /// More than 0 and at most 1.
    pub emissivity: f64,
    /// The number, among the surfaces of the deck, of the one on which it lies (`bas`).
    pub base: Option<usize>,
    /// The number of the one with which it is combined in results (`cmb`).
    pub combined: Option<usize>,
    /// The line of the surface, as bytes of the deck.
    place: Range<usize>,
}

impl PartialEq for Deck {
    fn eq(&self, other: &Self) -> bool {
        (&self.surfaces, self.open) == (&other.surfaces, other.open)
    }
}

impl PartialEq for DeckSurface {
    fn eq(&self, other: &Self) -> bool {
        let parts = |of: &Self| (of.ends, of.emissivity, of.base, of.combined);
        self.name == other.name && parts(self) == parts(other)
    }
}

impl Deck {
    /// An error about the surface of this number, at its line.
    #[must_use]
    pub fn error(&self, surface: usize, message: impl Display) -> InputError {
        match self.surfaces.get(surface) {
            Some(own) => self.source.error(own.place.clone(), message),
            None => InputError::new(format_args!("{}: {message}", self.source.name)),
        }
    }
}

/// Reads a deck.
pub fn read(path: &Path) -> Result<Deck, InputError> {
    let name = path.display().to_string();
    let bytes = load(path, MAX_BYTES)?;
    // Titles and names of old decks may be in any encoding; numbers are not.
    parse_named(&name, String::from_utf8_lossy(&bytes).into_owned())
}

/// Reads the deck `name` with the content `text`.
pub fn parse_named(name: &str, text: String) -> Result<Deck, InputError> {
    let name = name.to_owned();
    let source = Source { name, text };
    match parse(&source.text) {
        Ok((surfaces, open)) => Ok(Deck {
            surfaces,
            open,
            source,
        }),
        Err(wrong) => Err(wrong.at(&source)),
    }
}

/// The numbers of surfaces in a deck, with their lines and their places among its surfaces.
type Numbers = HashMap<u64, (u32, usize)>;

/// What is said of a deck without an end.
pub(crate) const CUT_SHORT: &str =
    "the deck is cut short: `End of data` is missing after this line";

/// The number of a surface above this line; 0 is none.
fn above(words: &mut Words<'_>, what: &str, known: &Numbers) -> Result<Option<usize>, Wrong> {
    let word = words.clone().next();
    match words.parsed::<u64>(what)? {
        0 => Ok(None),
        id => match known.get(&id) {
            Some(&(_, index)) => Ok(Some(index)),
            None => {
                let message = format_args!("there is no surface {id} above this line");
                Err(words.wrong(word, message))
            }
        },
    }
}

/// The surfaces, and whether the deck is no enclosure.
fn parse(text: &str) -> Result<(Vec<DeckSurface>, bool), Wrong> {
    let mut vertices: HashMap<u64, [f64; 2]> = HashMap::new();
    let mut names: HashMap<String, u32> = HashMap::new();
    let mut numbers = Numbers::new();
    let mut surfaces = Vec::new();
    let mut open = false;
    for mut words in lines(text, &['!', '/']) {
        let length = words.rest.trim_start().len();
        let key = words.next();
        match key.to_ascii_uppercase().as_str() {
            "T" => {}
            "C" => {
                // Positional, or `encl=1`; the rest of it concerns View2D's own accuracy.
                let first = words.next();
                let value = first.strip_prefix("encl=").unwrap_or(first);
                open = value == "0";
            }
            "G" => {
                let word = words.clone().next();
                if words.parsed::<u32>("the dimension")? != 2 {
                    return Err(words.wrong(word, "only two-dimensional decks are read: `G 2`"));
                }
            }
            "V" => {
                let word = words.clone().next();
                let id = words.parsed("the number of a vertex")?;
                let point = [
                    words.number("the coordinate x")?,
                    words.number("the coordinate y")?,
                ];
                if vertices.insert(id, point).is_some() {
                    return Err(words.wrong(word, format_args!("a second vertex {id}")));
                }
            }
            "S" => {
                if surfaces.len() == MAX_SURFACES {
                    let message = format_args!("more than {MAX_SURFACES} surfaces");
                    return Err(words.wrong(key, message));
                }
                let mut surface = surface(&mut words, &vertices, &mut numbers, surfaces.len())?;
                let start = words.wrong(key, "").place.start;
                surface.place = start..start + length;
                if let Some(first) = names.insert(surface.name.clone(), words.line) {
                    let message = format_args!(
                        "a second surface named {:?}; the first is on line {first}",
                        surface.name
                    );
                    return Err(words.wrong(key, message));
                }
                surfaces.push(surface);
            }
            "END" if surfaces.is_empty() => {
                return Err(words.wrong(key, "the deck has no surface"));
            }
            "END" => return Ok((surfaces, open)),
            _ => {
                let message = format_args!(
                    "unknown key {key:?}; known: T, C, G, V, S, `End of data`, and `!` or `/` for \
                     comments"
                );
                return Err(words.wrong(key, message));
            }
        }
    }
    Err(Wrong::cut_short(text, CUT_SHORT))
}

/// The rest of an `S` line.
fn surface(
    words: &mut Words<'_>,
    vertices: &HashMap<u64, [f64; 2]>,
    numbers: &mut Numbers,
    index: usize,
) -> Result<DeckSurface, Wrong> {
    let word = words.clone().next();
    let id: u64 = words.parsed("the number of a surface")?;
    if let Some((first, _)) = numbers.get(&id) {
        let message = format_args!("a second surface {id}; the first is on line {first}");
        return Err(words.wrong(word, message));
    }
    let mut end = || {
        let word = words.clone().next();
        let id: u64 = words.parsed("the number of a vertex")?;
        let found = vertices.get(&id).copied();
        let message = format_args!("there is no vertex {id} above this line");
        found.ok_or_else(|| words.wrong(word, message))
    };
    let ends = [end()?, end()?];
    // Whether a surface may hide others is found from the geometry.
    words.parsed::<i64>("the flag `obs`")?;
    let base = above(words, "the number `bas`", numbers)?;
    let combined = above(words, "the number `cmb`", numbers)?;
    numbers.insert(id, (words.line, index));
    Ok(DeckSurface {
        ends,
        emissivity: words.emissivity()?,
        name: words.name_of(id),
        base,
        combined,
        place: 0..0,
    })
}

#[cfg(test)]
mod tests {
    use super::parse;

    const SQUARE: &str = "T a square\nC 1 0 1e-4 8 0 1\nG 2\n! corners\nV 1 0 0\nV 2 1 0\nV 3 1 1\n\
                          V 4 0 1 / the last\nS 1 1 2 0 0 0 0.9 floor\nS 2 2 3 0 0 0 0.5 right wall\n\
                          S 3 3 4 0 0 0 0.9\ns 4 4 1 0 0 0 1.0 left\nEnd of data\nanything\n";

    #[test]
    fn a_deck_is_read() {
        let (surfaces, open) = parse(SQUARE).unwrap();
        let names: Vec<_> = surfaces.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["floor", "right wall", "S3", "left"]);
        assert_eq!(surfaces[1].ends, [[1.0, 0.0], [1.0, 1.0]]);
        assert_eq!(surfaces[1].emissivity, 0.5);
        assert!(!open);
        assert!(parse(&SQUARE.replace("C 1", "C 0")).unwrap().1);
        assert!(
            parse(&SQUARE.replace("C 1 0", "C encl=0 list=0"))
                .unwrap()
                .1
        );
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        // What is wrong stands between « and ».
        let bad = |from: &str, to: &str, words: &str| {
            assert_eq!(SQUARE.matches(from).count(), 1, "{from}");
            let marked = SQUARE.replace(from, to);
            let place = marked.find('«').unwrap();
            let text = marked.replace(['«', '»'], "");
            let wrong = parse(&text).unwrap_err();
            assert_eq!(wrong.place.start, place, "{}", wrong.message);
            assert!(wrong.message.contains(words), "{}", wrong.message);
        };
        bad("V 2 1 0", "V 2 1 «NaN»", "finite");
        bad("V 2 1 0", "V 2 «one» 0", "finite number, not \"one\"");
        bad("V 2 1 0", "V 2 1«»", "ends before the coordinate y");
        bad("V 2 1 0", "V «1» 1 0", "second vertex 1");
        bad("S 2 2 3", "S 2 2 «9»", "no vertex 9");
        let second = "second surface 1; the first is on line 9";
        bad("S 2 2 3", "S «1» 2 3", second);
        bad("0.5 right wall", "«1.5» right wall", "at most 1");
        let same = "«S» 2 2 3 0 0 0 0.5 floor";
        let first = "named \"floor\"; the first is on line 9";
        bad("S 2 2 3 0 0 0 0.5 right wall", same, first);
        // Only what stands above can be a base, or combined with.
        bad("0 0 0 0.5", "0 0 «4» 0.5", "no surface 4 above");
        bad("0 0 0 0.5", "0 «2» 0 0.5", "no surface 2 above");
        bad("G 2", "G «3»", "two-dimensional");
        bad("V 3 1 1", "«W» 3 1 1", "unknown key");
        let last = "s 4 4 1 0 0 0 1.0 left\nEnd of data\nanything\n";
        bad(last, "«s» 4 4 1 0 0 0 1.0 left\n", "cut short");
        assert!(parse("").unwrap_err().message.contains("cut short"));
        assert!(
            parse("End of data")
                .unwrap_err()
                .message
                .contains("no surface")
        );
    }
}
