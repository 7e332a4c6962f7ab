//! The kinds of problems: one table. A further kind is a file here, and a line in [`KINDS`].

mod channels;
mod circle;
mod cube;
mod functions;
pub(crate) mod material;
mod parameters;
mod room;
mod scene;
mod space;
mod sphere;
mod surface;
mod system;
mod tube;

use core::any::Any;
use core::fmt::Debug;
use std::sync::Arc;

use fredholm::{Error, Subject, Target};

use crate::section::{Section, unknown_word};
use crate::{InputError, Place, ProblemFile, Resolution, What};

pub use circle::{Circle, Emission};
pub use cube::{Cube, KernelText};
pub use room::{Lists, Material, Numbers, Room, Surface};
pub use scene::Scene;
pub use space::Space;
pub use sphere::Sphere;
pub use system::{System, SystemEquation};
pub use tube::Tube;

/// All kinds of problems, in the order in which they are listed.
pub static KINDS: &[KindEntry] = &[
    circle::ENTRY,
    cube::ENTRY,
    room::ENTRY,
    sphere::ENTRY,
    scene::ENTRY,
    scene::VACUUM,
    system::ENTRY,
    tube::ENTRY,
];

/// A kind of problem as files and `fredholm init` know it.
#[derive(Debug)]
pub struct KindEntry {
    /// The word of the key `kind`.
    pub word: &'static str,
    /// The description of the kind, in a few words.
    pub about: &'static str,
    /// A commented problem file.
    pub template: &'static str,
    /// Whether its `channels` are names, and lists of numbers for them: those of others are tables.
    has_channels: bool,
    /// Reads the rest of `[problem]`.
    read: ReadKind,
}

/// What reads the keys of a kind.
type ReadKind = fn(Section<'_, '_>) -> Result<Arc<dyn Kind>, InputError>;

/// `[problem]` as a file has it, of one kind.
pub trait Kind: Any + Debug + Send + Sync {
    /// Checks `[problem]`, and what it asks of the rest of the file.
    ///
    /// # Errors
    /// What is wrong, at its place.
    fn validate(&self, file: &ProblemFile) -> Result<(), InputError>;

    /// Checks what a target asks for.
    ///
    /// # Errors
    /// What is wrong, at its place.
    fn validate_target(&self, file: &ProblemFile, what: &What) -> Result<(), InputError>;

    /// The largest degree, and for what: every degree and dimension has code of its own.
    fn most_degree(&self) -> (usize, &'static str);

    /// The model, and what is asked of it. Validation has passed.
    ///
    /// # Errors
    /// What the model does not take, at its place.
    fn resolve(&self, file: &ProblemFile) -> Result<(Resolution, Vec<Target>), InputError>;

    /// Where the file speaks of what an error is about, if it is a part of `[problem]`.
    fn place(&self, subject: Subject) -> Option<Place> {
        let _ = subject;
        None
    }

    /// An error of the solution at a place that only the kind knows, perhaps outside of the problem file.
    fn explain(&self, file: &ProblemFile, error: &Error) -> Option<InputError> {
        let _ = (file, error);
        None
    }

    /// What is allowed and hardly meant, for people.
    fn remarks(&self, file: &ProblemFile) -> Vec<String> {
        let _ = file;
        Vec::new()
    }

    /// The problem in full: every number and formula, defaults and other files included, without blanks. Two files have the
    /// same if they say the same, however they are written.
    ///
    /// # Errors
    /// A file that it names cannot be read.
    fn identity(&self, file: &ProblemFile) -> Result<String, InputError> {
        let _ = file;
        Ok(compact(self))
    }

    /// The domain of the equation's formulas and the numbers that they know by name, if it has some.
    fn space(&self) -> Option<&Space> {
        None
    }

    /// Whether there are several unknown functions, of which targets name one.
    fn has_components(&self) -> bool {
        false
    }

    /// Whether there are walls, whose cells may be graded and cut at shadows.
    fn has_walls(&self) -> bool {
        false
    }
}

impl dyn Kind {
    /// The section as that of one kind, if it is of this kind: drawings and form factors are of a [`Room`].
    pub fn of<K: Kind>(&self) -> Option<&K> {
        (self as &dyn Any).downcast_ref()
    }
}

/// All fields, without blanks: formulas may have more or fewer of them.
fn compact(fields: impl Debug) -> String {
    format!("{fields:?}").split_whitespace().collect()
}

/// Reads `[problem]`, whose other keys depend on its `kind`.
pub(crate) fn read(mut section: Section<'_, '_>) -> Result<Arc<dyn Kind>, InputError> {
    let kind = section.required("kind")?;
    let word = kind.text()?;
    let Some(entry) = KINDS.iter().find(|entry| entry.word == word) else {
        let known: Vec<String> = KINDS.iter().map(|entry| entry.word.to_owned()).collect();
        return Err(kind.error(unknown_word("kind", word, &known)));
    };
    match entry.has_channels {
        true => (entry.read)(section),
        false => channels::read(section, entry.read),
    }
}

/// What was read, of whichever kind.
fn shared<K: Kind + 'static>(read: Result<K, InputError>) -> Result<Arc<dyn Kind>, InputError> {
    Ok(Arc::new(read?))
}
