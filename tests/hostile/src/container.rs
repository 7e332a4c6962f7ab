//! The container of parts and of solved systems.

use crc::{CRC_64_XZ, Crc, Table};

static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_XZ);

/// Bytes of the checksum at the end, and of what stands before the head.
const SUM: usize = 8;
const START: usize = 32;

/// The bytes with these first ones, the length of the head that ends with two bytes at the place that `end` finds, and a right
/// checksum. `None`: they are too few.
pub(crate) fn mended(
    bytes: &[u8],
    magic: &[u8; 24],
    end: impl Fn(&[u8]) -> Option<usize>,
) -> Option<Vec<u8>> {
    let mut mended = bytes.to_vec();
    let summed = mended.len().checked_sub(SUM).filter(|&end| end >= START)?;
    mended[..24].copy_from_slice(magic);
    if let Some(place) = end(&mended[START..summed]) {
        let length = (place as u64 + 2).next_multiple_of(8);
        mended[24..START].copy_from_slice(&length.to_le_bytes());
    }
    let sum = CRC.checksum(&mended[..summed]);
    mended[summed..].copy_from_slice(&sum.to_le_bytes());
    Some(mended)
}
