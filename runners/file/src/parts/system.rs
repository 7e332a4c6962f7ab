//! Solved systems in files: one set-up for all parts of a run, and for all processes of a node.

use core::ops::Range;
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use filebuffer::FileBuffer;
use fredholm::systems::{KeptCut, SavedSystem, SystemOf, SystemStore};
use fredholm::{Discretisation, Error, System};
use fredholm_core::galerkin::{Convergence, Solution};
use serde::{Deserialize, Serialize};

use super::container::Kind;
use super::error::FileError;
use super::identity::{Header, Named, difference};
use super::output::Output;

/// The option of a file that is made if it is not there.
const MAKE: &str = "--save-system";

/// The names of the number of cells and of the degree.
const CELLS: &str = "cells of the system";
const DEGREE: &str = "degree of the system";

const KIND: Kind = Kind {
    magic: b"fredholm system 3      \n",
    named: 16,
    name: "solved system",
    help: "remove it, and make it again with `--save-system`",
};

/// What stands before the numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Head {
    /// What the system depends on.
    of: Vec<Named>,
    /// How the iteration for v went.
    sweeps: u32,
    residual: f64,
    radius_bound: f64,
    /// The lengths of v and of the coefficients.
    lengths: [usize; 2],
}

/// A solved system, and what it is of.
#[derive(Clone, Debug)]
pub struct SystemContent<'a> {
    /// What the system depends on, each with a name.
    pub of: Vec<Named>,
    /// The numbers of the system.
    pub saved: SavedSystem<'a>,
}

impl<'a> SystemContent<'a> {
    /// Reads the bytes of a file. Large tables are borrowed where they lie, if the bytes begin at a multiple of 8.
    ///
    /// # Errors
    /// [`FileError`]: it is no system, of another version, cut off or damaged.
    pub fn read(path: &Path, bytes: &'a [u8]) -> Result<Self, FileError> {
        let (head, body) = KIND.read(path, bytes)?;
        Self::of_parts(path, head, &bytes[body])
    }

    /// The system of a head and the numbers behind it.
    fn of_parts(path: &Path, head: Head, body: &'a [u8]) -> Result<Self, FileError> {
        let [v, coefficients] = head.lengths;
        let tables = v.checked_mul(8).and_then(|length| {
            let (v, rest) = body.split_at_checked(length)?;
            (Some(rest.len()) == coefficients.checked_mul(8)).then_some([v, rest])
        });
        let [v, coefficients] = tables.ok_or_else(|| {
            FileError::refused(path, "its lengths contradict each other: make it again")
        })?;
        let solution = Solution {
            v: numbers(v).into_owned(),
            convergence: Convergence {
                sweeps: head.sweeps,
                residual: head.residual,
            },
            radius_bound: head.radius_bound,
        };
        Ok(Self {
            of: head.of,
            saved: SavedSystem {
                solution: Cow::Owned(solution),
                coefficients: numbers(coefficients),
            },
        })
    }

    /// Writes what [`read`](Self::read) reads.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        let SavedSystem {
            solution,
            coefficients,
        } = &self.saved;
        let head = Head {
            of: self.of.clone(),
            sweeps: solution.convergence.sweeps,
            residual: solution.convergence.residual,
            radius_bound: solution.radius_bound,
            lengths: [solution.v.len(), coefficients.len()],
        };
        let body: [&[u8]; 2] = [&bytes_of(&solution.v), &bytes_of(coefficients)];
        KIND.write(&head, &body, to)
    }
}

/// The numbers of these bytes, where they lie if they can be read there.
fn numbers(bytes: &[u8]) -> Cow<'_, [f64]> {
    if cfg!(target_endian = "little")
        && let Ok(numbers) = bytemuck::try_cast_slice(bytes)
    {
        return Cow::Borrowed(numbers);
    }
    let (each, _) = bytes.as_chunks::<8>();
    Cow::Owned(each.iter().map(|x| f64::from_le_bytes(*x)).collect())
}

/// The bytes of these numbers, the lowest first.
fn bytes_of(numbers: &[f64]) -> Cow<'_, [u8]> {
    if cfg!(target_endian = "little") {
        return Cow::Borrowed(bytemuck::cast_slice(numbers));
    }
    Cow::Owned(numbers.iter().flat_map(|x| x.to_le_bytes()).collect())
}

/// A file with a solved system that a run follows, or makes for others. The file is mapped: processes of one node share one
/// copy of its tables.
///
/// It is never written in place, so that whoever has it mapped keeps what was there.
pub struct SystemFile {
    path: PathBuf,
    /// The option that gave the path.
    option: &'static str,
    /// The equation, by named values.
    equation: Vec<Named>,
    /// The file that is to be made.
    output: Mutex<Option<Output>>,
    /// The file.
    map: OnceLock<Mapped>,
}

/// A mapped file: its head, and where its numbers are.
struct Mapped {
    bytes: FileBuffer,
    head: Head,
    body: Range<usize>,
}

impl core::fmt::Debug for SystemFile {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SystemFile")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

impl SystemFile {
    /// A file that is there. It is looked at when a system is needed.
    #[must_use]
    pub fn open(path: &Path, header: &Header) -> Self {
        Self {
            path: path.to_owned(),
            option: "--system",
            equation: header.equation(),
            output: Mutex::default(),
            map: OnceLock::new(),
        }
    }

    /// A file that is made, unless it is there.
    ///
    /// # Errors
    /// [`FileError`]: it cannot be written.
    pub fn make(path: &Path, header: &Header) -> Result<Self, FileError> {
        let output = match path.exists() {
            true => None,
            false => Some(Output::open(MAKE, path)?),
        };
        Ok(Self {
            option: MAKE,
            output: Mutex::new(output),
            ..Self::open(path, header)
        })
    }

    fn output(&self) -> MutexGuard<'_, Option<Output>> {
        self.output.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The content of the file, which is mapped and looked at as a whole once.
    fn content(&self) -> Result<SystemContent<'_>, FileError> {
        let mapped = match self.map.get() {
            Some(mapped) => mapped,
            None => {
                let bytes = FileBuffer::open(&self.path)
                    .map_err(|error| FileError::not_opened(&self.path, error))?;
                let (head, body) = KIND.read(&self.path, &bytes)?;
                self.map.get_or_init(|| Mapped { bytes, head, body })
            }
        };
        let body = &mapped.bytes[mapped.body.clone()];
        SystemContent::of_parts(&self.path, mapped.head.clone(), body)
    }

    /// The system of the file, which must be this one.
    fn system(&self, of: &SystemOf) -> Result<SavedSystem<'_>, Error> {
        let content = self.content()?;
        let Some(what) = difference(&self.named(of), &content.of) else {
            return Ok(content.saved);
        };
        let option = self.option;
        let message =
            format!("it is the system of another problem: {what}; give another file to `{option}`");
        Err(FileError::refused(&self.path, message).into())
    }

    /// All that a system depends on. The seed, walks, targets, pairs and estimators are no part of it.
    fn named(&self, of: &SystemOf) -> Vec<Named> {
        let cut = Discretisation {
            cells: None,
            ..of.cut
        };
        let system = SystemOf { cut, ..*of };
        let own = [
            ("system".to_owned(), format!("{system:?}")),
            (CELLS.to_owned(), of.cells.to_string()),
            (DEGREE.to_owned(), of.cut.degree.to_string()),
        ];
        [&self.equation[..], &own].concat()
    }
}

impl SystemStore for SystemFile {
    fn cut(&self) -> Result<Option<KeptCut>, Error> {
        if self.output().is_some() {
            return Ok(None);
        }
        let content = self.content()?;
        let number = |name: &str| {
            let found = content.of.iter().find(|(own, _)| own == name)?;
            found.1.parse().ok()
        };
        Ok(number(CELLS)
            .zip(number(DEGREE))
            .map(|(cells, degree)| KeptCut { cells, degree }))
    }

    fn find(&self, of: &SystemOf) -> Result<Option<SavedSystem<'_>>, Error> {
        if self.output().is_some() {
            return Ok(None);
        }
        Ok(Some(self.system(of)?))
    }

    fn keep(&self, of: &SystemOf, system: &dyn System) -> Result<Option<SavedSystem<'_>>, Error> {
        let Some(output) = self.output().take() else {
            return Ok(None);
        };
        let saved = system.saved().ok_or_else(|| {
            FileError::refused(&self.path, "systems of this kind of problem are not saved")
        })?;
        let content = SystemContent {
            of: self.named(of),
            saved,
        };
        output.finish_with(|file| content.write(file))?;
        Ok(Some(self.system(of)?))
    }
}
