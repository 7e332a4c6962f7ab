//! Arrays in NumPy's format: an uncompressed ZIP archive with a `.npy` file for each.
//!
//! Crates that write archives bring in compression, encryption and macros, which take the compiler longer than all of
//! the program's own commands. What is not compressed needs a checksum and three records for each file.

use crc::{CRC_32_ISO_HDLC, Crc};

use crate::InputError;

const CHECKSUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The first day that the format has, 1 January 1980: results do not depend on the clock.
const DAY: u16 = 0x21;

/// The arrays of an archive.
#[derive(Debug, Default)]
pub struct Archive {
    /// Records and contents of the files.
    bytes: Vec<u8>,
    /// The records that end the archive.
    directory: Vec<u8>,
    files: u16,
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
        self.store(&format!("{name}.npy"), &file)
    }

    /// Adds a file (PKWARE's APPNOTE, sections 4.3.7 and 4.3.12).
    fn store(&mut self, name: &str, file: &[u8]) -> Result<(), InputError> {
        let too_large = |_| {
            InputError::new("an .npz file has less than 4 GiB: write the factors to a .csv file")
        };
        let size = u32::try_from(file.len()).map_err(too_large)?;
        let offset = u32::try_from(self.bytes.len()).map_err(too_large)?;
        // Version 2.0, no flags, not compressed, when, checksum, sizes, and the lengths of name and nothing else.
        let mut record = Vec::new();
        for number in [20, 0, 0, 0, DAY] {
            record.extend(number.to_le_bytes());
        }
        for number in [CHECKSUM.checksum(file), size, size] {
            record.extend(number.to_le_bytes());
        }
        record.extend((name.len() as u16).to_le_bytes());
        record.extend([0, 0]);
        self.bytes.extend(b"PK\x03\x04");
        self.bytes.extend(&record);
        self.bytes.extend(name.bytes());
        self.bytes.extend(file);
        self.directory.extend(b"PK\x01\x02\x14\x00");
        self.directory.extend(record);
        // No comment, on the first disk, no attributes.
        self.directory.extend([0; 10]);
        self.directory.extend(offset.to_le_bytes());
        self.directory.extend(name.bytes());
        self.files += 1;
        Ok(())
    }

    /// The archive, with its end (section 4.3.16).
    pub fn finish(mut self) -> Result<Vec<u8>, InputError> {
        let offset = u32::try_from(self.bytes.len()).map_err(InputError::new)?;
        let size = self.directory.len() as u32;
        self.bytes.append(&mut self.directory);
        self.bytes.extend(b"PK\x05\x06\0\0\0\0");
        for _ in 0..2 {
            self.bytes.extend(self.files.to_le_bytes());
        }
        self.bytes.extend(size.to_le_bytes());
        self.bytes.extend(offset.to_le_bytes());
        self.bytes.extend([0, 0]);
        Ok(self.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::Archive;

    /// The places of files are where the directory says, and numbers begin where the head of an array says.
    #[test]
    fn an_archive_is_read_as_the_format_says() {
        let mut archive = Archive::default();
        let numbers = [1.0, -2.5, 3.0, 0.0, 1e-300, 6.0];
        archive.numbers("a", &[2, 3], numbers.iter()).unwrap();
        archive
            .texts("b", &["x".to_owned(), "äöü".to_owned()])
            .unwrap();
        let bytes = archive.finish().unwrap();
        let u16_at = |k: usize| usize::from(u16::from_le_bytes([bytes[k], bytes[k + 1]]));
        let u32_at = |k: usize| u16_at(k) + 65_536 * u16_at(k + 2);
        let end = bytes.len() - 22;
        assert_eq!(&bytes[end..end + 4], b"PK\x05\x06");
        assert_eq!((u16_at(end + 8), u16_at(end + 10)), (2, 2));
        let mut at = u32_at(end + 16);
        assert_eq!(at + u32_at(end + 12), end);
        for (name, about, content) in [
            (
                "a.npy",
                "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, ), }",
                48,
            ),
            (
                "b.npy",
                "{'descr': '<U3', 'fortran_order': False, 'shape': (2, ), }",
                24,
            ),
        ] {
            assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
            let (size, place) = (u32_at(at + 20), u32_at(at + 42));
            assert_eq!(&bytes[at + 46..at + 46 + u16_at(at + 28)], name.as_bytes());
            assert_eq!(&bytes[place..place + 4], b"PK\x03\x04");
            assert_eq!(bytes[place + 4..place + 30], bytes[at + 6..at + 32]);
            let file = &bytes[place + 30 + name.len()..][..size];
            assert_eq!(&file[..8], b"\x93NUMPY\x01\x00");
            let head = 10 + usize::from(u16::from_le_bytes([file[8], file[9]]));
            assert_eq!(
                (head % 64, file[head - 1], file.len() - head),
                (0, b'\n', content)
            );
            let text = String::from_utf8(file[10..head].to_vec()).unwrap();
            assert_eq!(text.trim_end(), about);
            if name == "a.npy" {
                let first: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
                assert_eq!(&file[head..], first);
            }
            at += 46 + name.len();
        }
        // The check value of this checksum: "123456789".
        assert_eq!(super::CHECKSUM.checksum(b"123456789"), 0xcbf4_3926);
    }
}
