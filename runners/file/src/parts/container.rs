//! The container of all files of this crate: first bytes that say what it is, a head in JSON, a body, and a checksum of all.

use core::ops::Range;
use std::io::{self, Write};
use std::path::Path;

use crc::{CRC_64_XZ, Crc, Table};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::error::FileError;

/// CRC-64 as in xz (ECMA-182): it sees every change of up to 64 bits in a row.
static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_XZ);

/// Bytes that say what a file is, and the version of its format.
const MAGIC: usize = 24;
/// Bytes before the head: these, and the length of the head.
const START: usize = MAGIC + 8;
/// The body begins at a multiple of this, so that numbers are read where they lie.
const ALIGNMENT: usize = 8;

/// A checksum of some bytes.
pub(crate) fn checksum(bytes: &[u8]) -> u64 {
    CRC.checksum(bytes)
}

/// A kind of files.
pub(crate) struct Kind {
    /// The first bytes.
    pub(crate) magic: &'static [u8; MAGIC],
    /// How many of them stand before the version.
    pub(crate) named: usize,
    /// The name of the kind, for people.
    pub(crate) name: &'static str,
    /// What helps if a file is damaged, or of another version.
    pub(crate) help: &'static str,
}

impl Kind {
    /// Writes a file.
    pub(crate) fn write(
        &self,
        head: &impl Serialize,
        body: &[&[u8]],
        to: &mut dyn Write,
    ) -> io::Result<()> {
        let mut head = serde_json::to_vec(head)?;
        head.resize(head.len().next_multiple_of(ALIGNMENT), b' ');
        let length = (head.len() as u64).to_le_bytes();
        let start: [&[u8]; 3] = [self.magic, &length, &head];
        let mut sum = CRC.digest();
        for bytes in start.iter().chain(body) {
            sum.update(bytes);
            to.write_all(bytes)?;
        }
        to.write_all(&sum.finalize().to_le_bytes())
    }

    /// The head of a file, and where its body is.
    pub(crate) fn read<H: DeserializeOwned>(
        &self,
        path: &Path,
        bytes: &[u8],
    ) -> Result<(H, Range<usize>), FileError> {
        let (name, help) = (self.name, self.help);
        if !bytes.starts_with(self.magic) {
            let message = if bytes.starts_with(&self.magic[..self.named]) {
                format!("it is a {name} of another version of the format: {help}")
            } else {
                format!("this is no {name}: its first bytes are others")
            };
            return Err(FileError::refused(path, message));
        }
        let damaged = || {
            let message = format!("it is cut off or damaged: its checksum is wrong; {help}");
            FileError::refused(path, message)
        };
        let (summed, sum) = bytes.split_last_chunk().ok_or_else(damaged)?;
        let rest = summed.get(MAGIC..).ok_or_else(damaged)?;
        let (length, rest) = rest.split_first_chunk().ok_or_else(damaged)?;
        let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
        let head = rest.get(..length).ok_or_else(damaged)?;
        if CRC.checksum(summed) != u64::from_le_bytes(*sum) {
            return Err(damaged());
        }
        let head = serde_json::from_slice(head).map_err(|error| {
            FileError::refused(
                path,
                format_args!("it was written by another version of the program, which this one does not read: {error}"),
            )
        })?;
        Ok((head, START + length..summed.len()))
    }
}
