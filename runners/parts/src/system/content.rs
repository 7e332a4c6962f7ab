//! The content of a file with a solved system.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use fredholm::systems::SavedSystem;
use fredholm_core::galerkin::{Convergence, Solution};
use serde::{Deserialize, Serialize};

use crate::error::PartError;
use crate::frames::{checksum, digest};

/// The first bytes of a file, which say the version of its format.
const MAGIC: &[u8; 24] = b"fredholm system 1      \n";
/// Characters of [`MAGIC`] before the version.
const NAMED: usize = 16;
/// Bytes before the head: [`MAGIC`] and the head's length.
const START: usize = MAGIC.len() + 8;
/// Bytes of the checksum at the end.
const SUM: usize = 8;
/// All parts begin at a multiple of this, so that numbers are read where they lie.
const ALIGNMENT: usize = 8;
/// Numbers that are written at a time.
const CHUNK: usize = 1 << 13;

/// What stands before the numbers.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    /// The version of the program that wrote the file.
    program: String,
    /// What the system depends on, each with a name.
    of: Vec<(String, String)>,
    /// How the iteration for v went.
    sweeps: u32,
    residual: f64,
    radius_bound: f64,
    /// The lengths of v, of the coefficients and of the views.
    lengths: [u64; 3],
}

/// A solved system, and what it is of.
///
/// ```
/// use std::borrow::Cow;
///
/// use fredholm::systems::SavedSystem;
/// use fredholm_core::galerkin::{Convergence, Solution};
/// use fredholm_parts::SystemContent;
///
/// let solution = Solution {
///     v: vec![1.5, 2.5],
///     convergence: Convergence { sweeps: 3, residual: 1e-15 },
///     radius_bound: 0.5,
/// };
/// let of = vec![("cells".to_owned(), "2".to_owned())];
/// let written = SystemContent { of, saved: SavedSystem::new(&solution, &[0.1, 0.2, 0.3, 0.4]) };
/// let mut bytes = Vec::new();
/// written.write(&mut bytes)?;
/// let read = SystemContent::read("a".as_ref(), &bytes)?;
/// assert_eq!((&read.of, &read.saved.solution.v), (&written.of, &solution.v));
/// assert_eq!(read.saved.coefficients[3], 0.4);
/// bytes[60] ^= 1;
/// assert!(SystemContent::read("a".as_ref(), &bytes).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SystemContent<'a> {
    /// What the system depends on, each with a name.
    pub of: Vec<(String, String)>,
    /// The numbers of the system.
    pub saved: SavedSystem<'a>,
}

impl<'a> SystemContent<'a> {
    /// Reads the bytes of a file. Large tables are borrowed where they lie, if the bytes begin at a multiple of 8.
    ///
    /// # Errors
    /// [`PartError`]: it is no system, or of another version, or damaged.
    pub fn read(path: &Path, bytes: &'a [u8]) -> Result<Self, PartError> {
        Self::of_whole(path, check_whole(path, bytes)?)
    }

    /// Reads bytes that [`check_whole`] let pass.
    pub(crate) fn of_whole(path: &Path, summed: &'a [u8]) -> Result<Self, PartError> {
        let refuse = |message: &str| PartError::refused(path, message);
        let contradiction = || refuse("its lengths contradict each other: make it again");
        let head = summed
            .get(MAGIC.len()..START)
            .and_then(|bytes| bytes.first_chunk());
        let length = head.and_then(|length| usize::try_from(u64::from_le_bytes(*length)).ok());
        let (text, rest) = length
            .and_then(|length| summed[START..].split_at_checked(length))
            .ok_or_else(contradiction)?;
        let head: Head = serde_json::from_slice(text).map_err(|error| {
            PartError::refused(
                path,
                format_args!("it was written by another version of the program, which this one does not read: {error}"),
            )
        })?;
        let start = START + text.len();
        Self::of_parts(head, start.next_multiple_of(ALIGNMENT) - start, rest)
            .ok_or_else(contradiction)
    }

    /// The system of this head, whose numbers stand in the rest behind so many bytes.
    fn of_parts(head: Head, skipped: usize, rest: &'a [u8]) -> Option<Self> {
        let [v, coefficients, views] = head.lengths;
        let mut rest = rest.get(skipped..)?;
        let mut take = |count: u64, size: usize| {
            let length = usize::try_from(count).ok()?.checked_mul(size)?;
            let (taken, behind) = rest.split_at_checked(length)?;
            rest = behind.get(length.wrapping_neg() % ALIGNMENT..)?;
            Some(taken)
        };
        let (v, coefficients, views) = (take(v, 8)?, take(coefficients, 8)?, take(views, 1)?);
        let solution = Solution {
            v: numbers(v).into_owned(),
            convergence: Convergence {
                sweeps: head.sweeps,
                residual: head.residual,
            },
            radius_bound: head.radius_bound,
        };
        rest.is_empty().then(|| Self {
            of: head.of,
            saved: SavedSystem {
                solution: Cow::Owned(solution),
                coefficients: numbers(coefficients),
                views: Cow::Borrowed(views),
            },
        })
    }

    /// Writes what [`read`](Self::read) reads.
    ///
    /// # Errors
    /// What the writer says; a head that is no JSON.
    pub fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        let SavedSystem {
            solution,
            coefficients,
            views,
        } = &self.saved;
        let lengths = [solution.v.len(), coefficients.len(), views.len()];
        let head = serde_json::to_vec(&Head {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            of: self.of.clone(),
            sweeps: solution.convergence.sweeps,
            residual: solution.convergence.residual,
            radius_bound: solution.radius_bound,
            lengths: lengths.map(|length| length as u64),
        })?;
        let mut to = Summed {
            to,
            sum: digest(),
            length: 0,
        };
        to.write(MAGIC)?;
        to.write(&(head.len() as u64).to_le_bytes())?;
        to.write(&head)?;
        to.fill_up()?;
        for numbers in [&solution.v[..], coefficients] {
            for chunk in numbers.chunks(CHUNK) {
                let bytes: Vec<u8> = chunk.iter().flat_map(|x| x.to_le_bytes()).collect();
                to.write(&bytes)?;
            }
        }
        to.write(views)?;
        to.fill_up()?;
        let sum = to.sum.finalize();
        to.to.write_all(&sum.to_le_bytes())
    }
}

/// A writer, with the checksum and the number of what was written.
struct Summed<'a> {
    to: &'a mut dyn Write,
    sum: crc::Digest<'static, u64, crc::Table<16>>,
    length: usize,
}

impl Summed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sum.update(bytes);
        self.length += bytes.len();
        self.to.write_all(bytes)
    }

    /// Writes zeros up to where the next part may begin.
    fn fill_up(&mut self) -> io::Result<()> {
        self.write(&[0; ALIGNMENT][..self.length.wrapping_neg() % ALIGNMENT])
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

/// The bytes before the checksum, if that is right: looked at once, as it takes every byte.
///
/// # Errors
/// [`PartError`]: it is no system, of another version, or damaged.
pub(crate) fn check_whole<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a [u8], PartError> {
    check_magic(path, bytes)?;
    match bytes.split_last_chunk::<SUM>() {
        Some((summed, sum)) if checksum(summed) == u64::from_le_bytes(*sum) => Ok(summed),
        _ => Err(PartError::refused(
            path,
            "it is damaged: its checksum is wrong, so that a byte was lost or changed; remove it, and make it again with \
             `--save-system`",
        )),
    }
}

/// Refuses what does not begin as a system does.
fn check_magic(path: &Path, bytes: &[u8]) -> Result<(), PartError> {
    if bytes.starts_with(MAGIC) {
        return Ok(());
    }
    Err(PartError::refused(
        path,
        if bytes.starts_with(&MAGIC[..NAMED]) {
            "it is a system of another version of the format: use it with the program that wrote it, or remove it and make \
             it again with `--save-system`"
        } else {
            "this is no solved system: its first bytes are others"
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::{Cow, SavedSystem, Solution, SystemContent};
    use fredholm_core::galerkin::Convergence;
    use std::path::Path;

    fn file() -> Vec<u8> {
        let solution = Solution {
            v: vec![1.0, -2.5, 1e-300],
            convergence: Convergence {
                sweeps: 7,
                residual: 1e-17,
            },
            radius_bound: 0.7,
        };
        let content = SystemContent {
            of: vec![("kind".to_owned(), "room".to_owned())],
            saved: SavedSystem {
                views: Cow::Borrowed(&[0, 1, 2, 3, 3, 2, 1, 0, 1]),
                ..SavedSystem::new(&solution, &[0.25; 9])
            },
        };
        let mut bytes = Vec::new();
        content.write(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn what_is_written_is_read() {
        let bytes = file();
        let SystemContent { of, saved } = SystemContent::read(Path::new("a"), &bytes).unwrap();
        assert_eq!(of, [("kind".to_owned(), "room".to_owned())]);
        assert_eq!(saved.solution.v, [1.0, -2.5, 1e-300]);
        let Solution {
            convergence,
            radius_bound,
            ..
        } = *saved.solution;
        assert_eq!(
            (convergence.sweeps, convergence.residual, radius_bound),
            (7, 1e-17, 0.7)
        );
        assert_eq!(
            (&saved.coefficients[..], &saved.views[..2]),
            (&[0.25; 9][..], &[0, 1][..])
        );
    }

    #[test]
    fn numbers_are_read_where_they_lie() {
        let bytes = file();
        // At every place of the memory, one of which is a multiple of 8.
        let borrowed = (0..8).filter(|&offset| {
            let moved = [&vec![0; offset][..], &bytes].concat();
            let read = SystemContent::read(Path::new("a"), &moved[offset..]).unwrap();
            assert_eq!(&read.saved.coefficients[..], &[0.25; 9][..]);
            let is_borrowed = matches!(read.saved.coefficients, Cow::Borrowed(_));
            assert_eq!(is_borrowed, moved[offset..].as_ptr().addr() % 8 == 0);
            is_borrowed
        });
        assert_eq!(borrowed.count(), 1);
    }

    #[test]
    fn a_changed_or_lost_byte_is_refused() {
        let whole = file();
        for place in 0..whole.len() {
            for change in [1, 0x80, 0xff] {
                let mut spoilt = whole.clone();
                spoilt[place] ^= change;
                let error = SystemContent::read(Path::new("a"), &spoilt).unwrap_err();
                let words = ["damaged", "another version", "no solved system"];
                let expected = match place {
                    0..16 => words[2],
                    16..24 => words[1],
                    _ => words[0],
                };
                assert!(error.message.contains(expected), "{place}: {error}");
            }
            assert!(SystemContent::read(Path::new("a"), &whole[..place]).is_err());
        }
        assert!(SystemContent::read(Path::new("a"), &[&whole[..], &[0]].concat()).is_err());
    }
}
