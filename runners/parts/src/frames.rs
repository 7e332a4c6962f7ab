//! Frames: records of any length, each with a checksum, one behind the other. What was being written when a process was
//! killed has no checksum, and is no frame.

use crc::{CRC_64_XZ, Crc, Digest, Table};

use crate::content::Record;

/// CRC-64 as in xz (ECMA-182): it sees every change of up to 64 bits in a row.
static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_XZ);

/// The first bytes of a file, which say the version of its format.
pub(crate) const MAGIC: &[u8; 16] = b"fredholm part 1\n";
/// Bytes of a frame before its payload: its kind, and the length of the payload.
const HEAD: usize = 8;
/// Bytes of a frame behind its payload: its checksum.
const TAIL: usize = 8;

/// The checksum of some bytes.
pub(crate) fn checksum(bytes: &[u8]) -> u64 {
    CRC.checksum(bytes)
}

/// A checksum of bytes that come one after the other.
pub(crate) fn digest() -> Digest<'static, u64, Table<16>> {
    CRC.digest()
}

/// What a frame holds. The numbers are those of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Header = 1,
    Share = 2,
    Job = 3,
    Batch = 4,
    Seconds = 5,
}

impl Kind {
    const ALL: [Self; 5] = [
        Self::Header,
        Self::Share,
        Self::Job,
        Self::Batch,
        Self::Seconds,
    ];
}

/// A frame of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frame<'a> {
    pub(crate) kind: Kind,
    pub(crate) payload: &'a [u8],
}

/// Appends a frame.
pub(crate) fn write(kind: Kind, payload: &[u8], to: &mut Vec<u8>) {
    let start = to.len();
    // A kind is below 256, and a payload of 4 GiB is refused where it is made.
    to.extend((kind as u32).to_le_bytes());
    to.extend((payload.len() as u32).to_le_bytes());
    to.extend(payload);
    let sum = checksum(&to[start..]);
    to.extend(sum.to_le_bytes());
}

/// The frames of a file behind its first bytes, and where the last good one ends.
#[derive(Debug)]
pub(crate) struct Frames<'a> {
    pub(crate) all: Vec<Frame<'a>>,
    /// Bytes from the beginning of the file to the end of the last good frame.
    pub(crate) end: usize,
}

/// Reads frames. What is no frame at the end was being written when the process ended, and is left out.
///
/// # Errors
/// The place of a frame that is damaged: batches follow it.
pub(crate) fn read(bytes: &[u8]) -> Result<Frames<'_>, usize> {
    let mut frames = Frames {
        all: Vec::new(),
        end: MAGIC.len().min(bytes.len()),
    };
    while let Some((frame, end)) = at(bytes, frames.end) {
        frames.all.push(frame);
        frames.end = end;
    }
    // All batches are as long, so that each byte is looked at so many times at most.
    let is_batch = |start: usize| {
        let whole = bytes.get(start..start + HEAD + Record::BYTES + TAIL);
        whole.is_some_and(|whole| at(whole, 0).is_some_and(|(frame, _)| frame.kind == Kind::Batch))
    };
    if (frames.end..bytes.len()).any(is_batch) {
        return Err(frames.end);
    }
    Ok(frames)
}

/// The frame that starts at this byte, and its end, if there is one.
fn at(bytes: &[u8], start: usize) -> Option<(Frame<'_>, usize)> {
    let rest = bytes.get(start..)?;
    let (head, behind) = rest.split_at_checked(HEAD)?;
    let word = |bytes: &[u8]| bytes.try_into().ok().map(u32::from_le_bytes);
    let (number, length) = (word(&head[..4])?, word(&head[4..])? as usize);
    let kind = Kind::ALL.into_iter().find(|kind| *kind as u32 == number)?;
    let (payload, behind) = behind.split_at_checked(length)?;
    let sum = u64::from_le_bytes(*behind.first_chunk::<TAIL>()?);
    let summed = rest.get(..HEAD + length)?;
    (checksum(summed) == sum).then(|| (Frame { kind, payload }, start + HEAD + length + TAIL))
}

#[cfg(test)]
mod tests {
    use super::{Kind, MAGIC, read, write};

    fn file() -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        write(Kind::Header, b"{}", &mut bytes);
        write(Kind::Batch, &[7; 120], &mut bytes);
        write(Kind::Batch, &[8; 120], &mut bytes);
        bytes
    }

    #[test]
    fn a_file_that_ends_anywhere_keeps_its_whole_frames() {
        let whole = file();
        let ends = [16, 16 + 18, 16 + 18 + 136, whole.len()];
        for length in 16..=whole.len() {
            let found = read(&whole[..length]).unwrap();
            let expected = ends.iter().filter(|&&end| end <= length).max().unwrap();
            assert_eq!(found.end, *expected, "{length}");
        }
    }

    #[test]
    fn a_changed_byte_is_refused_or_leaves_out_the_last_frame() {
        let whole = file();
        let last = whole.len() - 136;
        for place in 16..whole.len() {
            for change in [1, 0x80, 0xff] {
                let mut spoilt = whole.clone();
                spoilt[place] ^= change;
                match read(&spoilt) {
                    Err(at) => assert!(place < last && at <= place, "{place}"),
                    Ok(found) => assert!(place >= last && found.end == last, "{place}"),
                }
            }
        }
    }

    #[test]
    fn zeros_at_the_end_are_no_frames() {
        let mut bytes = file();
        let end = bytes.len();
        bytes.extend([0; 4096]);
        assert_eq!(read(&bytes).unwrap().end, end);
    }
}
