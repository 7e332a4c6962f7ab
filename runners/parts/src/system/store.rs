//! The file of a solved system, as a run uses it.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use filebuffer::FileBuffer;
use fredholm::systems::{SavedSystem, SystemOf, SystemStore};
use fredholm::{Choices, Error, System};

use crate::error::PartError;
use crate::identity::{Header, checksum_of, difference};
use crate::output::{Output, OutputError};
use crate::system::content::{SystemContent, check_whole};
use crate::team::Team;

/// The option of a file that is made if it is not there.
const MAKE: &str = "--save-system";

/// A file with a solved system that a run follows, or makes for others. The file is mapped: processes of one node share one
/// copy of its tables.
///
/// It is never written in place, so that whoever has it mapped keeps what was there.
///
/// ```
/// use fredholm::{CubeModel, Solver};
/// use fredholm_parts::{Alone, Header, SystemFile};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let problem = vec![("problem".to_owned(), "½ x y, x".to_owned())];
/// let header = Header::new(problem, String::new(), String::new(), String::new());
/// let path = std::env::temp_dir().join(format!("fredholm-doc-{}.system", std::process::id()));
/// let solve = |systems: &SystemFile| Solver::new(&u).mean().cells(4).walks(5000).systems(systems).solve();
/// let first = solve(&SystemFile::make(&path, &header, &Alone)?)?;
/// // It is there.
/// let second = solve(&SystemFile::open(&path, &header, &Alone)?)?;
/// assert_eq!(first.goals[0].preconditioned, second.goals[0].preconditioned);
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SystemFile<'a> {
    path: PathBuf,
    /// The equation, by named values.
    equation: Vec<(String, String)>,
    team: &'a dyn Team,
    /// The file that is to be made, of whoever makes it.
    output: Mutex<Option<Output>>,
    /// Whether a file that is not there is made.
    makes: bool,
    /// The file, and its bytes before the checksum.
    map: OnceLock<(FileBuffer, usize)>,
}

impl core::fmt::Debug for SystemFile<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SystemFile")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

impl<'a> SystemFile<'a> {
    /// A file that is there.
    ///
    /// # Errors
    /// [`PartError`]: it is not there, no system, damaged, or of another equation.
    pub fn open(path: &Path, header: &Header, team: &'a dyn Team) -> Result<Self, PartError> {
        let file = Self::new(path, header, team, false);
        file.check()?;
        Ok(file)
    }

    /// A file that is made, unless it is there. Of a team the leader makes it.
    ///
    /// # Errors
    /// As [`open`](Self::open), if it is there; [`PartError`]: it cannot be written.
    pub fn make(path: &Path, header: &Header, team: &'a dyn Team) -> Result<Self, PartError> {
        let file = Self::new(path, header, team, true);
        if !team.leads() {
            return Ok(file);
        }
        if path.exists() {
            file.check()?;
        } else {
            let output = Output::open(MAKE, path).map_err(|error| file.not_written(error))?;
            *file.output() = Some(output);
        }
        Ok(file)
    }

    fn new(path: &Path, header: &Header, team: &'a dyn Team, makes: bool) -> Self {
        Self {
            path: path.to_owned(),
            equation: header.equation(),
            team,
            output: Mutex::new(None),
            makes,
            map: OnceLock::new(),
        }
    }

    fn output(&self) -> std::sync::MutexGuard<'_, Option<Output>> {
        self.output.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn not_written(&self, error: OutputError) -> PartError {
        PartError {
            is_input: error.is_input,
            ..PartError::refused(&self.path, format_args!("cannot write it: {}", error.why))
        }
    }

    /// The content of the file, which is mapped and looked at as a whole once.
    fn content(&self) -> Result<SystemContent<'_>, PartError> {
        if let Some((map, length)) = self.map.get() {
            return SystemContent::of_whole(&self.path, &map[..*length]);
        }
        let map = FileBuffer::open(&self.path).map_err(|error| {
            let message = format_args!("cannot open it: {error}");
            PartError::refused(&self.path, message)
        })?;
        let length = check_whole(&self.path, &map)?.len();
        let (map, length) = self.map.get_or_init(|| (map, length));
        SystemContent::of_whole(&self.path, &map[..*length])
    }

    /// Refuses a file of another equation, before anything is set up.
    fn check(&self) -> Result<(), PartError> {
        let mut of = self.content()?.of;
        of.truncate(self.equation.len());
        self.refuse(difference(&self.equation, &of))
    }

    fn refuse(&self, what: Option<String>) -> Result<(), PartError> {
        what.map_or(Ok(()), |what| {
            let message = format_args!(
                "it is the system of another problem: {what}; give another file to `{}`",
                if self.makes { MAKE } else { "--system" }
            );
            Err(PartError::refused(&self.path, message))
        })
    }

    /// The system of the file, which must be this one.
    fn system(&self, of: &SystemOf) -> Result<SavedSystem<'_>, PartError> {
        let content = self.content()?;
        self.refuse(difference(&self.named(of), &content.of))?;
        Ok(content.saved)
    }

    /// All that a system depends on. The seed, walks, targets, pairs and estimators are no part of it.
    fn named(&self, of: &SystemOf) -> Vec<(String, String)> {
        let SystemOf {
            cut,
            cells,
            unknowns,
            absorption,
        } = of;
        let own = [
            ("scalar", cut.scalar.word().to_owned()),
            ("cells", cells.to_string()),
            ("degree", cut.degree.to_string()),
            ("unknowns", unknowns.to_string()),
            ("points", format!("{:?}", cut.points)),
            (
                "grading",
                format!("{:?}, {:?}", cut.grading, cut.shadow_cuts),
            ),
            ("absorption", absorption.to_string()),
        ];
        let own = own.map(|(name, value)| (name.to_owned(), value));
        [&self.equation[..], &own].concat()
    }

    /// Writes the system, whole or not at all.
    fn write(&self, of: &SystemOf, system: &dyn System, output: Output) -> Result<(), PartError> {
        let saved = system.saved().ok_or_else(|| {
            PartError::refused(&self.path, "systems of this kind of problem are not saved")
        })?;
        let content = SystemContent {
            of: self.named(of),
            saved,
        };
        let written = output.finish_with(|file| content.write(file));
        written.map_err(|error| self.not_written(error))
    }

    /// Waits for all others of the team, the leader having the file.
    fn meet(&self, of: &SystemOf) -> Result<(), Error> {
        if !self.makes || self.team.is_alone() {
            return Ok(());
        }
        let met = self.team.meet(Ok(checksum_of(&self.named(of))));
        met.map_err(|message| Error::Kept {
            message,
            is_input: false,
        })
    }
}

impl SystemStore for SystemFile<'_> {
    fn find(&self, of: &SystemOf) -> Result<Option<SavedSystem<'_>>, Error> {
        if self.output().is_some() {
            return Ok(None);
        }
        if self.team.leads() {
            let system = self.system(of)?;
            self.meet(of)?;
            return Ok(Some(system));
        }
        self.meet(of)?;
        Ok(Some(self.system(of)?))
    }

    fn keep(&self, of: &SystemOf, system: &dyn System) -> Result<Option<SavedSystem<'_>>, Error> {
        let Some(output) = self.output().take() else {
            return Ok(None);
        };
        self.write(of, system, output)?;
        self.meet(of)?;
        Ok(Some(self.system(of)?))
    }
}
