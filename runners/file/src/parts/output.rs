//! Files that are written whole or not at all.

use core::fmt::Display;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf, is_separator};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use super::error::FileError;

/// What an abrupt end must not leave behind: temporary files, and folders that were made for them.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Held while something is made, so that an abrupt end waits until it knows of it.
fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what an abrupt end would leave behind. Files that got their names are no longer found
/// under the old ones, and folders that are not empty stay.
pub fn remove_unfinished() {
    remove(&mut unfinished());
}

/// Removes what an abrupt end would leave behind, and lets nothing new be made as long as what it returns is held: for the end
/// of the program.
pub fn give_up() -> MutexGuard<'static, Vec<PathBuf>> {
    let mut unfinished = unfinished();
    remove(&mut unfinished);
    unfinished
}

fn remove(unfinished: &mut Vec<PathBuf>) {
    for path in unfinished.drain(..).rev() {
        let _ = fs::remove_file(&path).or_else(|_| fs::remove_dir(&path));
    }
}

/// A file that exists under its name only once it is complete. Opened before the work starts, so
/// that a place that cannot be written to is an error at once.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    file: NamedTempFile,
}

impl Output {
    /// Makes sure that the path of an option, `--out` for instance, can be written.
    ///
    /// # Errors
    /// [`FileError`]: it is a folder, or nothing can be written there.
    pub fn open(option: &str, path: &Path) -> Result<Self, FileError> {
        let mut unfinished = unfinished();
        let refuse = |why: &dyn Display| FileError::of_option(option, path, why);
        // A file's name does not end in a separator, though `Path` does not see it.
        let bytes = path.as_os_str().as_encoded_bytes();
        let separated = bytes.last().is_some_and(|&b| is_separator(char::from(b)));
        if path.is_dir() || separated {
            return Err(refuse(&"this is a folder; a file is needed"));
        }
        // Behind a link is the file that is meant.
        let linked = fs::canonicalize(path);
        let path = linked.as_deref().unwrap_or(path);
        if path.exists() && !path.is_file() {
            return Err(refuse(&"this is no regular file"));
        }
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            return Err(refuse(&format_args!(
                "there is no folder {}",
                folder.display()
            )));
        }
        let file = tempfile::Builder::new()
            .prefix(".fredholm-")
            .tempfile_in(folder)
            .map_err(|error| refuse(&format_args!("cannot write there: {error}")))?;
        unfinished.push(file.path().to_owned());
        Ok(Self {
            path: path.to_owned(),
            file,
        })
    }

    /// Writes the content and gives the file its name.
    ///
    /// # Errors
    /// [`FileError`]: it cannot be written.
    pub fn finish(self, content: impl AsRef<[u8]>) -> Result<(), FileError> {
        self.finish_with(|file| file.write_all(content.as_ref()))?;
        Ok(())
    }

    /// This file, locked for other processes as long as it is open. Where a file system has no such thing, it has none.
    pub(crate) fn locked(self) -> Self {
        let _ = self.file.as_file().try_lock();
        self
    }

    /// Writes piece by piece what is too large to be kept, and gives the file its name.
    ///
    /// # Errors
    /// [`FileError`]: it cannot be written.
    pub fn finish_with(
        mut self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<File, FileError> {
        let temporary = self.file.path().to_owned();
        let path = self.path;
        let finished = write(&mut self.file)
            .and_then(|()| self.file.as_file().sync_all())
            .and_then(|()| open_to_others(&self.file))
            .and_then(|()| Ok(self.file.persist(&path)?))
            .map_err(|error| FileError::not_written(&path, error));
        unfinished().retain(|path| *path != temporary);
        finished
    }
}

/// Temporary files are private; results are as other files.
fn open_to_others(file: &NamedTempFile) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.as_file()
            .set_permissions(fs::Permissions::from_mode(0o644))?;
    }
    let _ = file;
    Ok(())
}

/// The files of the folder of an option, which is made if it is not there.
///
/// # Errors
/// [`FileError`]: nothing can be written there.
pub fn open_all<const N: usize>(
    option: &str,
    folder: &Path,
    names: [&str; N],
) -> Result<[Output; N], FileError> {
    let mut unfinished = unfinished();
    // Folders around it too, the outermost first.
    let new = folder
        .ancestors()
        .take_while(|a| !a.as_os_str().is_empty() && !a.exists());
    let mut new: Vec<PathBuf> = new.map(Path::to_owned).collect();
    new.reverse();
    // Before they are made: of several, one may be there when another cannot be.
    unfinished.extend(new);
    fs::create_dir_all(folder).map_err(|error| {
        FileError::of_option(
            option,
            folder,
            format_args!("cannot make this folder: {error}"),
        )
    })?;
    drop(unfinished);
    let mut outputs = Vec::with_capacity(N);
    for name in names {
        outputs.push(Output::open(option, &folder.join(name))?);
    }
    outputs
        .try_into()
        .map_err(|_| FileError::not_written(folder, "as many files as names"))
}
