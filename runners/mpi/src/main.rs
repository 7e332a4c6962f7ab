//! `mpirun -n R fredholm-mpi solve FILE …`: the command `solve` of `fredholm` on many nodes, with the bits of one machine.
//!
//! Every rank reads the file and sets up by itself, as it would alone; one rank for each node, with all threads of it, sets up
//! once for each node. They share the walks: rank 0 deals batches out to whoever is free, and sends all ranks the statistics
//! of every stage, which each of them merges in batch order. So every rank knows what one machine would know, decides what it
//! would decide, and only rank 0 prints and writes.

mod dealing;
mod message;

use core::sync::atomic::{AtomicBool, Ordering};
use std::process::ExitCode;

use fredholm_cli::{END, Team};
use fredholm_rayon::Crew;
use mpi::Threading;
use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};

use dealing::{Dealing, world};

/// The status of a program that panicked.
const PANICKED: i32 = 101;

/// All ranks.
struct Ranks {
    dealing: Dealing,
    /// Whether ranks go their own ways.
    ended: AtomicBool,
}

fn main() -> ExitCode {
    // One thread at a time calls MPI, but not always the same.
    let Some((universe, threading)) = mpi::initialize_with_threading(Threading::Serialized) else {
        eprintln!("error: MPI is running already");
        return ExitCode::from(1);
    };
    if threading < Threading::Serialized {
        eprintln!(
            "error: this MPI lets one thread only call it; one that allows several, one at a time, is needed"
        );
        return ExitCode::from(1);
    }
    let rank = world().rank();
    let of_panics = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        eprint!("rank {rank}: ");
        of_panics(info);
        // Others would wait for it for ever.
        world().abort(PANICKED);
    }));
    let ranks = Ranks {
        dealing: Dealing,
        ended: AtomicBool::new(false),
    };
    let status = fredholm_cli::program(&ranks);
    drop(universe);
    status
}

impl Team for Ranks {
    fn leads(&self) -> bool {
        world().rank() == 0
    }

    fn is_alone(&self) -> bool {
        world().size() == 1
    }

    fn crew(&self) -> &dyn Crew {
        &self.dealing
    }

    fn meet(&self, state: Result<u64, &str>) -> Result<(), String> {
        if self.ended.load(Ordering::Relaxed) {
            return state.map(|_| ()).map_err(str::to_owned);
        }
        let met = meet_all(state);
        let ends = met.is_err() || state == Ok(END);
        self.ended.store(ends, Ordering::Relaxed);
        met
    }
}

/// Waits for all ranks, and compares.
fn meet_all(state: Result<u64, &str>) -> Result<(), String> {
    let world = world();
    let size = world.size();
    let own = if state.is_err() { world.rank() } else { size };
    let mut failed = size;
    world.all_reduce_into(&own, &mut failed, SystemOperation::min());
    if failed < size {
        let mut text = state.err().unwrap_or("").as_bytes().to_vec();
        let root = world.process_at_rank(failed);
        let mut length = text.len() as u64;
        root.broadcast_into(&mut length);
        text.resize(length as usize, 0);
        root.broadcast_into(&mut text[..]);
        let text = String::from_utf8_lossy(&text);
        return Err(format!("rank {failed}: {text}"));
    }
    let own = state.unwrap_or(END);
    let (mut least, mut most) = (own, own);
    world.all_reduce_into(&own, &mut least, SystemOperation::min());
    world.all_reduce_into(&own, &mut most, SystemOperation::max());
    if least == most || own == END {
        Ok(())
    } else if most == END {
        Err("other ranks have ended".to_owned())
    } else {
        Err(
            "ranks differ in the problem file, or in the program: all nodes must have the same of both"
                .to_owned(),
        )
    }
}
