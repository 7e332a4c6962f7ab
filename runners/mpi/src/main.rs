//! `mpirun -n R fredholm-mpi solve FILE …`: the command `solve` of `fredholm` on many nodes, with the bits of one machine.
//!
//! Every rank reads the file and sets up by itself, as it would alone; one rank for each node, with all threads of it, sets up
//! once for each node. They share the walks: the batches of a stage are dealt out in turn, and every rank gets the statistics of
//! all of them, which it merges in batch order. So every rank knows what one machine would know, decides what it would decide,
//! and only rank 0 prints and writes. A rank that fails ends the job.

mod ranks;

use core::time::Duration;
use std::process::ExitCode;
use std::thread::sleep;

use fredholm_cli::{Failure, Process, program, program_of};
use mpi::Threading;
use mpi::traits::Communicator;

use ranks::{Ranks, world};

/// The status of a program that panicked.
const PANICKED: i32 = 101;
/// How long another rank waits before it ends the job: what all ranks meet, rank 0 says.
const PATIENCE: Duration = Duration::from_secs(1);

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
    let (rank, size) = (world().rank(), world().size());
    let of_panics = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        eprint!("rank {rank}: ");
        of_panics(info);
        // Others would wait for it for ever.
        world().abort(PANICKED);
    }));
    let status = if size == 1 {
        program()
    } else {
        let process = Process {
            crew: &Ranks,
            leads: rank == 0,
        };
        program_of(process).unwrap_or_else(|failure| end_all(rank, &failure))
    };
    drop(universe);
    status
}

/// Says why this rank failed, and ends all others, which would wait for it for ever.
fn end_all(rank: i32, failure: &Failure) -> ExitCode {
    let status = failure.status();
    if status == 0 {
        return ExitCode::SUCCESS;
    }
    if rank == 0 {
        eprintln!("error: {failure}");
    } else {
        sleep(PATIENCE);
        eprintln!("rank {rank}: error: {failure}");
    }
    world().abort(status.into())
}
