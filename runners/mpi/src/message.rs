//! Finished batches as bytes: no type of a problem crosses the network.

use fredholm_core::{Batch, NotFinite, Statistics};
use fredholm_rayon::{Finished, Piece};

/// Bytes of a finished batch: its number, its goal, how it ended, the walk that was not finite, the standard error of (v, Φ),
/// and [`Statistics::to_bytes`].
pub(crate) const BYTES: usize = 40 + Statistics::BYTES;

const WHOLE: u64 = 1;
const NOT_FINITE: u64 = 2;

/// The bytes of finished batches.
pub(crate) fn to_bytes(finished: &[Finished]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(finished.len() * BYTES);
    for one in finished {
        let whole = if one.is_whole { WHOLE } else { 0 };
        let (not_finite, walk) = match one.not_finite {
            Some(NotFinite { walk }) => (NOT_FINITE, walk),
            None => (0, 0),
        };
        let words = [
            one.piece.batch,
            one.piece.goal as u64,
            whole | not_finite,
            walk,
        ];
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        bytes.extend((one.statistics.control_error() as f32).to_le_bytes());
        bytes.extend(one.statistics.replicates().to_le_bytes());
        bytes.extend(one.statistics.to_bytes());
    }
    bytes
}

/// The finished batches that [`to_bytes`] wrote, by the same program on another rank.
pub(crate) fn from_bytes(bytes: &[u8]) -> Vec<Finished> {
    let (all, _) = bytes.as_chunks::<BYTES>();
    all.iter().filter_map(one_from_bytes).collect()
}

fn one_from_bytes(bytes: &[u8; BYTES]) -> Option<Finished> {
    let (words, _) = bytes.as_chunks::<8>();
    let word = |number: usize| words.get(number).copied().map(u64::from_le_bytes);
    let [batch, goal, state, walk] = [word(0)?, word(1)?, word(2)?, word(3)?];
    let statistics = Statistics::from_bytes(bytes.last_chunk()?)?;
    let mut walks = Batch::resume(0, statistics.walks(), statistics.walks(), statistics)?;
    let [error, replicates] = [word(4)? as u32, (word(4)? >> 32) as u32];
    walks.set_control_error(f64::from(f32::from_bits(error)));
    walks.set_replicates(replicates);
    Some(Finished {
        piece: Piece {
            batch,
            goal: goal as usize,
        },
        statistics: *walks.statistics(),
        is_whole: state & WHOLE != 0,
        not_finite: (state & NOT_FINITE != 0).then_some(NotFinite { walk }),
    })
}
