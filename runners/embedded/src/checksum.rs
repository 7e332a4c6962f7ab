//! CRC-32 as in Ethernet and zip (ISO 3309), computed bit by bit: no table in flash.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};

static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// A checksum in the making.
pub(crate) struct Checksum(Digest<'static, u32, NoTable>);

impl Checksum {
    pub(crate) fn new() -> Self {
        Self(CRC.digest())
    }

    pub(crate) fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.update(bytes);
        self
    }

    pub(crate) fn word(self, word: u64) -> Self {
        self.bytes(&word.to_le_bytes())
    }

    pub(crate) fn finish(self) -> u32 {
        self.0.finalize()
    }
}
