//! The batches of a stage, dealt out to all ranks in turn, and gathered on each of them.

use core::sync::atomic::AtomicUsize;
use std::collections::BTreeSet;

use fredholm_core::{NotFinite, Statistics};
use fredholm_rayon::{Crew, Finished, Piece, Work, threads};
use mpi::Count;
use mpi::collective::SystemOperation;
use mpi::datatype::PartitionMut;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};
use serde::{Deserialize, Serialize};

/// Batches of a thread between two meetings of all ranks: few wait for the last one, and what was done is soon kept.
const EACH: usize = 8;

/// All ranks. A communicator is a pointer, which threads do not share: each asks for its own.
pub(crate) fn world() -> SimpleCommunicator {
    SimpleCommunicator::world()
}

/// The processes of an MPI job as one crew.
pub(crate) struct Ranks;

/// A finished batch as it crosses the network: no type of a problem is in it.
#[derive(Serialize, Deserialize)]
struct Message {
    goal: usize,
    batch: u64,
    is_whole: bool,
    not_finite: Option<u64>,
    statistics: Statistics,
}

impl Crew for Ranks {
    fn stage(&self, known: Vec<Finished>, work: &Work<'_>) -> Vec<Finished> {
        let world = world();
        let (rank, size) = (world.rank() as usize, world.size() as usize);
        // Rank 0 alone knows what a file has.
        let mut finished = from_first(&known);
        let known: BTreeSet<Piece> = finished.iter().map(|one| one.piece).collect();
        let open = work.pieces.iter().filter(|piece| !known.contains(piece));
        let open: Vec<Piece> = open.copied().collect();
        let most = most(threads() as u64) as usize;
        for pieces in open.chunks(size * EACH * most) {
            let own: Vec<Piece> = pieces.iter().copied().skip(rank).step_by(size).collect();
            let own = Work {
                pieces: &own,
                ..*work
            };
            let own = own.on_threads(&AtomicUsize::new(0));
            for (other, came) in (0..).zip(gathered(&own)) {
                if other != rank {
                    came.iter().for_each(work.came);
                }
                finished.extend(came);
            }
            // All of them or none.
            if is_any((work.stopped)()) {
                break;
            }
        }
        finished
    }

    fn agree(&self, digest: u64) -> Result<(), String> {
        let mut least = digest;
        world().all_reduce_into(&digest, &mut least, SystemOperation::min());
        if least == most(digest) {
            return Ok(());
        }
        Err(
            "ranks differ in the problem file, or in the program: all nodes must have the same of both"
                .to_owned(),
        )
    }
}

/// The largest of the numbers of all ranks.
fn most(own: u64) -> u64 {
    let mut most = own;
    world().all_reduce_into(&own, &mut most, SystemOperation::max());
    most
}

/// Whether it is so on any rank.
fn is_any(own: bool) -> bool {
    most(u64::from(own)) > 0
}

/// What rank 0 has, on all ranks.
fn from_first(own: &[Finished]) -> Vec<Finished> {
    let world = world();
    let root = world.process_at_rank(0);
    let mut bytes = to_bytes(own);
    let mut length = bytes.len() as u64;
    root.broadcast_into(&mut length);
    bytes.resize(length as usize, 0);
    root.broadcast_into(&mut bytes[..]);
    from_bytes(&bytes)
}

/// What every rank has, on all ranks, in their order.
fn gathered(own: &[Finished]) -> Vec<Vec<Finished>> {
    let world = world();
    let own = to_bytes(own);
    let mut counts: Vec<Count> = vec![0; world.size() as usize];
    world.all_gather_into(&(own.len() as Count), &mut counts[..]);
    let starts: Vec<Count> = counts
        .iter()
        .scan(0, |end, count| {
            *end += count;
            Some(*end - count)
        })
        .collect();
    let mut bytes = vec![0_u8; counts.iter().sum::<Count>() as usize];
    let mut all = PartitionMut::new(&mut bytes[..], &counts[..], &starts[..]);
    world.all_gather_varcount_into(&own[..], &mut all);
    let places = starts.iter().zip(&counts);
    places
        .map(|(&start, &count)| from_bytes(&bytes[start as usize..][..count as usize]))
        .collect()
}

fn to_bytes(finished: &[Finished]) -> Vec<u8> {
    let message = |one: &Finished| Message {
        goal: one.piece.goal,
        batch: one.piece.batch,
        is_whole: one.is_whole,
        not_finite: one.not_finite.map(|NotFinite { walk }| walk),
        statistics: one.statistics,
    };
    let messages: Vec<Message> = finished.iter().map(message).collect();
    postcard::to_allocvec(&messages).expect("numbers are written")
}

fn from_bytes(bytes: &[u8]) -> Vec<Finished> {
    let messages: Vec<Message> = postcard::from_bytes(bytes).expect("all ranks run one program");
    let finished = |message: Message| Finished {
        piece: Piece {
            batch: message.batch,
            goal: message.goal,
        },
        statistics: message.statistics,
        is_whole: message.is_whole,
        not_finite: message.not_finite.map(|walk| NotFinite { walk }),
    };
    messages.into_iter().map(finished).collect()
}
