//! How a command can end, and what the shell is told.

use core::fmt::{self, Display};
use core::sync::atomic::{AtomicBool, Ordering};
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use fredholm_file::parts::FileError;

use crate::file::{InputError, ProblemFile};

/// Whether another process says what there is to say.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Leaves what there is to say to another process.
pub(crate) fn be_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

/// Says a line on stderr. `eprintln!` would panic where nobody reads it any more.
pub(crate) fn say(line: impl Display) {
    if QUIET.load(Ordering::Relaxed) {
        return;
    }
    let _ = writeln!(io::stderr(), "{line}");
}

/// Prints a result on stdout.
pub(crate) fn print(text: impl AsRef<[u8]>) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_ref())?;
    Ok(stdout.flush()?)
}

/// Why a command did not do its work.
#[derive(Debug)]
pub enum Failure {
    /// Bad usage or input: status 2.
    Input(String),
    /// Something failed on the way: status 1.
    Run(String),
    /// Nobody reads our output any more: no message, status 0.
    ClosedPipe,
}

impl Failure {
    /// Bad usage or input.
    pub(crate) fn input(message: impl Display) -> Self {
        Self::Input(message.to_string())
    }

    /// The path of `--out` does not do.
    pub(crate) fn of_out(path: &Path, message: impl Display) -> Self {
        Self::input(format_args!("`--out {}`: {message}", path.display()))
    }

    /// Something failed on the way.
    pub(crate) fn run(message: impl Display) -> Self {
        Self::Run(message.to_string())
    }

    /// An error of the solution, at its place in the file if it is one of the input.
    pub(crate) fn of(file: &ProblemFile) -> impl Fn(fredholm::Error) -> Self + '_ {
        move |error| {
            if error.is_of_input() {
                Self::input(file.explain(&error))
            } else {
                Self::run(error)
            }
        }
    }

    /// The status.
    #[must_use]
    pub fn status(&self) -> u8 {
        match self {
            Self::ClosedPipe => 0,
            Self::Run(_) => 1,
            Self::Input(_) => 2,
        }
    }

    /// Says it on stderr, if there is something to say, and gives the status.
    pub(crate) fn report(&self) -> ExitCode {
        if !matches!(self, Self::ClosedPipe) {
            say(format_args!("error: {self}"));
        }
        ExitCode::from(self.status())
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(message) | Self::Run(message) => f.write_str(message),
            Self::ClosedPipe => f.write_str("the output was closed"),
        }
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::input(error)
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        if error.is_input {
            Self::input(error)
        } else {
            Self::run(error)
        }
    }
}

/// Writing to stdout.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::BrokenPipe {
            Self::ClosedPipe
        } else {
            Self::run(format_args!("cannot write the output: {error}"))
        }
    }
}

/// How a command that walks ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ended {
    /// Everything was done: status 0.
    Done,
    /// Not all numbers were found to agree: status 1.
    Disagrees,
    /// The requested error was not reached: status 3.
    ErrorNotReached,
    /// Interrupted: status 130.
    Interrupted,
}

impl Ended {
    /// The status.
    pub(crate) fn status(self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Disagrees => ExitCode::from(1),
            Self::ErrorNotReached => ExitCode::from(3),
            Self::Interrupted => ExitCode::from(130),
        }
    }
}
