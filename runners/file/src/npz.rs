//! Arrays in NumPy's format: an uncompressed ZIP archive with a `.npy` file for each.

use std::io::{Cursor, Write as _};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::InputError;

/// The arrays of an archive.
pub struct Archive(ZipWriter<Cursor<Vec<u8>>>);

impl Default for Archive {
    fn default() -> Self {
        Self(ZipWriter::new(Cursor::default()))
    }
}

impl core::fmt::Debug for Archive {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Archive").finish_non_exhaustive()
    }
}

impl Archive {
    /// Adds numbers, in the order of the last index.
    pub fn numbers<'a>(
        &mut self,
        name: &str,
        shape: &[usize],
        numbers: impl Iterator<Item = &'a f64>,
    ) -> Result<(), InputError> {
        let bytes = numbers.flat_map(|x| x.to_le_bytes()).collect();
        self.add(name, "<f8", shape, bytes)
    }

    /// Adds whole numbers.
    pub fn integers(
        &mut self,
        name: &str,
        integers: impl Iterator<Item = i64>,
    ) -> Result<(), InputError> {
        let bytes: Vec<u8> = integers.flat_map(i64::to_le_bytes).collect();
        self.add(name, "<i8", &[bytes.len() / 8], bytes)
    }

    /// Adds whole numbers below 2³¹.
    pub fn small_integers(&mut self, name: &str, numbers: &[u32]) -> Result<(), InputError> {
        let bytes = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.add(name, "<i4", &[numbers.len()], bytes)
    }

    /// Adds one word, as bytes without a dimension.
    pub fn word(&mut self, name: &str, word: &str) -> Result<(), InputError> {
        self.add(name, &format!("|S{}", word.len()), &[], word.into())
    }

    /// Adds texts, all as long as the longest.
    pub fn texts(&mut self, name: &str, texts: &[String]) -> Result<(), InputError> {
        let longest = texts.iter().map(|t| t.chars().count()).max().unwrap_or(0);
        let padded = |t: &String| {
            let characters = t.chars().map(u32::from).chain(core::iter::repeat(0));
            let all: Vec<u32> = characters.take(longest.max(1)).collect();
            all
        };
        let bytes = texts.iter().flat_map(padded).flat_map(u32::to_le_bytes);
        let kind = format!("<U{}", longest.max(1));
        self.add(name, &kind, &[texts.len()], bytes.collect())
    }

    /// Adds a `.npy` file: what is in it, padded so that numbers begin at a multiple of 64 bytes, and the numbers.
    fn add(
        &mut self,
        name: &str,
        kind: &str,
        shape: &[usize],
        content: Vec<u8>,
    ) -> Result<(), InputError> {
        let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
        let about = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        let length = (about.len() + 11).next_multiple_of(64) - 10;
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((length as u16).to_le_bytes());
        file.extend(format!("{about:<0$}\n", length - 1).bytes());
        file.extend(content);
        let too_large = |_| {
            InputError::new("an .npz file has less than 4 GiB: write the factors to a .csv file")
        };
        // Results do not depend on the clock.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default());
        let begun = self.0.start_file(format!("{name}.npy"), options);
        begun.map_err(InputError::new)?;
        self.0.write_all(&file).map_err(too_large)
    }

    /// The archive.
    pub fn finish(self) -> Result<Vec<u8>, InputError> {
        Ok(self.0.finish().map_err(InputError::new)?.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read as _};

    use super::Archive;

    /// Numbers begin where the head of an array says, at a multiple of 64.
    #[test]
    fn arrays_are_as_the_format_says() {
        let mut archive = Archive::default();
        let numbers = [1.0, -2.5, 3.0, 0.0, 1e-300, 6.0];
        archive.numbers("a", &[2, 3], numbers.iter()).unwrap();
        let texts = ["x".to_owned(), "äöü".to_owned()];
        archive.texts("b", &texts).unwrap();
        let bytes = archive.finish().unwrap();
        let mut read = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut file = |name: &str, about: &str| {
            let mut file = Vec::new();
            read.by_name(name).unwrap().read_to_end(&mut file).unwrap();
            assert_eq!(&file[..8], b"\x93NUMPY\x01\x00");
            let head = 10 + usize::from(u16::from_le_bytes([file[8], file[9]]));
            assert_eq!((head % 64, file[head - 1]), (0, b'\n'));
            let text = core::str::from_utf8(&file[10..head]).unwrap();
            assert_eq!(text.trim_end(), about);
            file.split_off(head)
        };
        let about = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, ), }";
        let all: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        assert_eq!(file("a.npy", about), all);
        let about = "{'descr': '<U3', 'fortran_order': False, 'shape': (2, ), }";
        assert_eq!(file("b.npy", about).len(), 24);
    }
}
