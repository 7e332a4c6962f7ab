//! A file that grows by whole records, held by one process at a time.

use core::time::Duration;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use fs4::{FileExt, TryLockError};
use serde::Serialize;

use crate::content::{Content, Record, Run, Seconds};
use crate::error::PartError;
use crate::frames::{self, Kind, MAGIC};
use crate::identity::{Header, JobRecord};
use crate::share::Share;

/// How often records are made safe from a power failure: as seldom as takes no time. A process that is killed loses none.
const SYNC: Duration = Duration::from_secs(1);

/// A file of batches that this process holds, and nobody else.
#[derive(Debug)]
pub struct PartFile {
    path: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    file: File,
    /// Bytes that are whole records.
    length: u64,
    jobs: u32,
    synced: Instant,
    /// Why the last record could not be written.
    failure: Option<PartError>,
}

impl PartFile {
    /// Opens a file to go on with, or begins it; also what is there of its runs. What was being written when a process was
    /// killed is cut off.
    ///
    /// # Errors
    /// [`PartError`]: another process holds the file, it is of another problem or share, is no part, or cannot be written.
    pub fn open(
        path: &Path,
        header: &Header,
        share: Option<Share>,
    ) -> Result<(Self, Vec<Run>), PartError> {
        let cannot =
            |error: io::Error| PartError::refused(path, format_args!("cannot open it: {error}"));
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(path).map_err(cannot)?;
        // By its trait: the standard library has it only since Rust 1.89.
        match FileExt::try_lock(&file) {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(PartError::refused(
                    path,
                    "another process is writing it: wait for that one, or give another file",
                ));
            }
            Err(TryLockError::Error(error)) => return Err(cannot(error)),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(cannot)?;
        let found = Content::begun(path, &bytes)?;
        let state = |length, jobs| State {
            file,
            length,
            jobs,
            synced: Instant::now(),
            failure: None,
        };
        let Some(content) = found else {
            let part = Self {
                path: path.to_owned(),
                state: Mutex::new(state(0, 0)),
            };
            // What was begun of another beginning.
            part.lock().cut_off(path)?;
            part.begin(header, share)?;
            return Ok((part, Vec::new()));
        };
        check(path, &content, header, share)?;
        let part = Self {
            path: path.to_owned(),
            state: Mutex::new(state(content.length as u64, content.jobs.len() as u32)),
        };
        part.lock().cut_off(path)?;
        Ok((part, content.runs))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked has ended the walks already.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes the beginning.
    fn begin(&self, header: &Header, share: Option<Share>) -> Result<(), PartError> {
        let mut bytes = MAGIC.to_vec();
        frames::write(Kind::Header, &self.json(header)?, &mut bytes);
        if let Some(share) = share {
            frames::write(Kind::Share, &self.json(&share)?, &mut bytes);
        }
        self.lock().append(&self.path, &bytes)
    }

    fn json<T: Serialize>(&self, value: &T) -> Result<Vec<u8>, PartError> {
        let bytes =
            serde_json::to_vec(value).map_err(|error| PartError::failed(&self.path, error))?;
        if bytes.len() > u32::MAX as usize {
            return Err(PartError::refused(
                &self.path,
                "the problem file is too long to be kept",
            ));
        }
        Ok(bytes)
    }

    /// Appends a job, whose number is returned: batches that are written from now on are its walks.
    ///
    /// # Errors
    /// [`PartError`]: it cannot be written.
    pub fn begin_job(&self, job: &JobRecord) -> Result<u32, PartError> {
        let mut bytes = Vec::new();
        frames::write(Kind::Job, &self.json(job)?, &mut bytes);
        let mut state = self.lock();
        state.append(&self.path, &bytes)?;
        state.jobs += 1;
        Ok(state.jobs - 1)
    }

    /// Appends a batch, whole or not at all. An error is kept: see [`failure`](Self::failure).
    pub fn append(&self, record: &Record) {
        let mut bytes = Vec::with_capacity(16 + Record::BYTES);
        frames::write(Kind::Batch, &record.to_bytes(), &mut bytes);
        let mut state = self.lock();
        if state.failure.is_some() {
            return;
        }
        if let Err(error) = state.append(&self.path, &bytes) {
            state.failure = Some(error);
        } else if state.synced.elapsed() >= SYNC {
            state.sync();
        }
    }

    /// Appends how long this process took.
    ///
    /// # Errors
    /// [`PartError`]: it cannot be written.
    pub fn finish(&self, seconds: Seconds) -> Result<(), PartError> {
        let mut bytes = Vec::new();
        frames::write(Kind::Seconds, &self.json(&seconds)?, &mut bytes);
        let mut state = self.lock();
        state.append(&self.path, &bytes)?;
        state.sync();
        Ok(())
    }

    /// Why a record could not be written, if one could not.
    #[must_use]
    pub fn failure(&self) -> Option<PartError> {
        self.lock().failure.clone()
    }
}

impl State {
    /// Writes behind the last whole record; if that fails, it is as if nothing had been written.
    fn append(&mut self, path: &Path, bytes: &[u8]) -> Result<(), PartError> {
        let written = self
            .file
            .seek(SeekFrom::Start(self.length))
            .and_then(|_| self.file.write_all(bytes));
        match written {
            Ok(()) => {
                self.length += bytes.len() as u64;
                Ok(())
            }
            Err(error) => {
                // What is left there is no record, and is cut off the next time at the latest.
                let _ = self.file.set_len(self.length);
                Err(PartError::failed(
                    path,
                    format_args!(
                        "cannot write to it: {error}; what was written before is kept: make room, and give the same \
                         command again"
                    ),
                ))
            }
        }
    }

    fn cut_off(&mut self, path: &Path) -> Result<(), PartError> {
        let cut = self.file.set_len(self.length);
        cut.map_err(|error| PartError::refused(path, format_args!("cannot write to it: {error}")))
    }

    /// Where a file system has no such thing, there is nothing to be done.
    fn sync(&mut self) {
        let _ = self.file.sync_data();
        self.synced = Instant::now();
    }
}

/// Refuses a file of another problem or share.
fn check(
    path: &Path,
    content: &Content,
    header: &Header,
    share: Option<Share>,
) -> Result<(), PartError> {
    if let Some(what) = header.difference(&content.header) {
        return Err(PartError::refused(
            path,
            format_args!("it is of another problem: {what}; give another file to `--save`"),
        ));
    }
    if content.share == share {
        return Ok(());
    }
    let name = |share: Option<Share>| match share {
        None => "a whole run".to_owned(),
        Some(share) if share.after > 0 => format!("part {share} behind {} walks", share.after),
        Some(share) => format!("part {share}"),
    };
    Err(PartError::refused(
        path,
        format_args!(
            "it is {}, and not {}; give another file to `--save`",
            name(content.share),
            name(share)
        ),
    ))
}
