#![doc = include_str!("../README.md")]

mod chapters;
mod equations;
mod rooms;

pub use chapters::chapters;

/// Numbers of one source.
#[derive(Clone, Debug)]
pub struct Chapter {
    /// The source: authors and year, or how the numbers follow.
    pub source: &'static str,
    /// The numbers, and what they are of.
    pub checks: Vec<Check>,
}

/// What is computed, and the numbers that must come out.
#[derive(Clone, Debug)]
pub enum Check {
    /// u at the targets of a problem.
    Walks(Walks),
    /// Form factors of a room.
    Factors(Factors),
    /// The experiment of Heinrich 1995, section 5.
    Experiment(Vec<Size>),
    /// The rates of Heinrich and Mathé 1993 in so many dimensions.
    Exponents(usize),
}

/// A problem file without its targets, and the targets.
#[derive(Clone, Debug)]
pub struct Walks {
    /// The name of the case.
    pub name: String,
    /// The text of the file, in TOML.
    pub file: String,
    /// The targets.
    pub targets: Vec<Known>,
}

/// A target, its place in the words of a problem file, and (u, Φ).
#[derive(Clone, Debug)]
pub struct Known {
    /// The name of the target.
    pub name: String,
    /// Where it is: the line of a `[[target]]`.
    pub place: String,
    /// (u, Φ).
    pub expected: f64,
}

/// A room as a problem file or a View2D deck, and form factors from a surface to another.
#[derive(Clone, Debug)]
pub struct Factors {
    /// The name of the case.
    pub name: String,
    /// Whether the text is a View2D deck.
    pub deck: bool,
    /// The text of the file.
    pub text: String,
    /// Two surfaces, and the form factor from the first to the second.
    pub pairs: Vec<(String, String, f64)>,
    /// The error of the numbers as they were printed.
    pub precision: f64,
}

/// √Var^mc and √Var^pmc on n cells.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// n.
    pub cells: usize,
    /// √Var^mc, of plain walks.
    pub plain: f64,
    /// √Var^pmc, of preconditioned walks.
    pub preconditioned: f64,
}
