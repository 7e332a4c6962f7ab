//! The batches of a stage, dealt out by rank 0 to whoever is free.

use core::sync::atomic::{AtomicUsize, Ordering};
use core::time::Duration;
use std::sync::{Mutex, PoisonError};
use std::thread;

use fredholm_rayon::{Crew, Finished, Piece, Work};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination, Root, Source};

use crate::message;

/// A worker is free; with what it finished.
const FREE: i32 = 1;
/// Pieces for a worker: goal and batch of each, or none if the stage has no more.
const PIECES: i32 = 2;

/// How many times over the pieces that are left are divided among all threads: those who are slower than others get fewer.
const DIVIDED: usize = 4;
/// How long rank 0 waits before it looks again for a message: its threads walk meanwhile.
const PAUSE: Duration = Duration::from_micros(50);

/// All ranks. A communicator is a pointer, which threads do not share: each asks for its own.
pub(crate) fn world() -> SimpleCommunicator {
    SimpleCommunicator::world()
}

/// The processes of an MPI job as one crew.
pub(crate) struct Dealing;

impl Crew for Dealing {
    fn stage(&self, known: Vec<Finished>, work: &Work<'_>) -> Vec<Finished> {
        if world().rank() == 0 {
            let finished = self.deal(known, work);
            self.share(message::to_bytes(&finished));
            return finished;
        }
        self.serve(work);
        message::from_bytes(&self.share(Vec::new()))
    }
}

impl Dealing {
    /// The bytes of rank 0, on all ranks.
    fn share(&self, mut bytes: Vec<u8>) -> Vec<u8> {
        let world = world();
        let root = world.process_at_rank(0);
        let mut length = bytes.len() as u64;
        root.broadcast_into(&mut length);
        bytes.resize(length as usize, 0);
        root.broadcast_into(&mut bytes[..]);
        bytes
    }

    /// Rank 0: its threads walk, and one more deals out.
    fn deal(&self, mut finished: Vec<Finished>, work: &Work<'_>) -> Vec<Finished> {
        let next = AtomicUsize::new(0);
        let came = Mutex::new(Vec::new());
        thread::scope(|scope| {
            if world().size() > 1 {
                scope.spawn(|| self.deal_out(work, &next, &came));
            }
            finished.extend(work.on_threads(&next));
        });
        finished.extend(came.into_inner().unwrap_or_else(PoisonError::into_inner));
        finished
    }

    /// Answers every worker that is free until all of them were told that nothing is left.
    fn deal_out(&self, work: &Work<'_>, next: &AtomicUsize, came: &Mutex<Vec<Finished>>) {
        let world = world();
        let mut working = world.size() - 1;
        let any = world.any_process();
        while working > 0 {
            let Some(status) = any.immediate_probe_with_tag(FREE) else {
                thread::sleep(PAUSE);
                continue;
            };
            let worker = world.process_at_rank(status.source_rank());
            let (bytes, _) = worker.receive_vec_with_tag::<u8>(FREE);
            let (threads, bytes) = bytes
                .split_first_chunk::<8>()
                .map_or((1, &[][..]), |(threads, rest)| {
                    (u64::from_le_bytes(*threads) as usize, rest)
                });
            let finished = message::from_bytes(bytes);
            finished.iter().for_each(work.came);
            came.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .extend(finished);
            let hand = if (work.stopped)() {
                &[]
            } else {
                self.hand(work.pieces, next, threads)
            };
            let words: Vec<u64> = hand
                .iter()
                .flat_map(|piece| [piece.goal as u64, piece.batch])
                .collect();
            worker.send_with_tag(&words[..], PIECES);
            working -= i32::from(hand.is_empty());
        }
    }

    /// The next pieces for so many threads: the fewer are left, the fewer.
    fn hand<'p>(&self, pieces: &'p [Piece], next: &AtomicUsize, threads: usize) -> &'p [Piece] {
        let left = pieces.len().saturating_sub(next.load(Ordering::Relaxed));
        let fair = left / (DIVIDED * world().size() as usize);
        let count = fair.max(threads);
        let start = next.fetch_add(count, Ordering::Relaxed).min(pieces.len());
        let end = start.saturating_add(count).min(pieces.len());
        &pieces[start..end]
    }

    /// Walks, on any other rank, what it is given until nothing is left.
    fn serve(&self, work: &Work<'_>) {
        let world = world();
        let leader = world.process_at_rank(0);
        let threads = fredholm_rayon::threads();
        let mut finished = Vec::new();
        loop {
            let mut bytes = (threads as u64).to_le_bytes().to_vec();
            bytes.extend(message::to_bytes(&finished));
            leader.send_with_tag(&bytes[..], FREE);
            let (words, _) = leader.receive_vec_with_tag::<u64>(PIECES);
            if words.is_empty() {
                return;
            }
            let (pairs, _) = words.as_chunks::<2>();
            let pieces: Vec<Piece> = pairs
                .iter()
                .map(|&[goal, batch]| Piece {
                    batch,
                    goal: goal as usize,
                })
                .collect();
            // What it was given it finishes: a piece that is left out would be a gap.
            let work = Work {
                pieces: &pieces,
                stopped: &|| false,
                ..*work
            };
            finished = work.on_threads(&AtomicUsize::new(0));
        }
    }
}
