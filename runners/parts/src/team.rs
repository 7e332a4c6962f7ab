//! The processes that follow one command.

use core::fmt;

use fredholm::execute::{Execute, Walking};
use fredholm::{Error, Observer};
use fredholm_core::Tolerance;
use fredholm_rayon::{Crew, Outcome, Runner, Threads};

use crate::identity::JobRecord;
use crate::keep::Keeper;

/// Processes that follow the same command: each reads the file and sets up, and they share the walks.
pub trait Team: Sync {
    /// Whether this process prints and writes.
    fn leads(&self) -> bool;

    /// Whether there is no other process.
    fn is_alone(&self) -> bool;

    /// Whoever runs the batches of a stage.
    fn crew(&self) -> &dyn Crew;

    /// Waits until every process is here, and tells whether all are well and of the same digest. A process that has failed
    /// comes here with its message. After an error nobody waits for anybody any more: it is the answer of every further call.
    ///
    /// # Errors
    /// The message of the first process that failed, or what differs.
    fn meet(&self, state: Result<u64, &str>) -> Result<(), String>;
}

/// The digest with which a process ends: the leader has results, and others wait for nothing.
pub const END: u64 = u64::MAX;

/// This process alone.
#[derive(Clone, Copy, Debug)]
pub struct Alone;

impl Team for Alone {
    fn leads(&self) -> bool {
        true
    }

    fn is_alone(&self) -> bool {
        true
    }

    fn crew(&self) -> &dyn Crew {
        &Threads
    }

    fn meet(&self, state: Result<u64, &str>) -> Result<(), String> {
        state.map(|_| ()).map_err(str::to_owned)
    }
}

/// The walks of a team, whose leader may keep them.
#[derive(Clone, Copy)]
pub struct TeamWork<'a> {
    /// The processes.
    pub team: &'a dyn Team,
    /// What keeps the batches, of the leader.
    pub keeper: Option<&'a Keeper<'a>>,
}

impl fmt::Debug for TeamWork<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TeamWork")
            .field("keeper", &self.keeper)
            .finish_non_exhaustive()
    }
}

impl Execute for TeamWork<'_> {
    fn takes_whole(&self) -> bool {
        self.team.is_alone() && self.keeper.is_none()
    }

    fn run(&self, walking: &Walking<'_>, watch: &dyn Observer) -> Result<Outcome, Error> {
        let digest = JobRecord::new(walking).digest();
        let meet = |begun: Result<(), &Error>| {
            let met = match begun {
                Ok(()) => self.team.meet(Ok(digest)),
                Err(error) => self.team.meet(Err(&error.to_string())),
            };
            met.map_err(|message| Error::Kept {
                message,
                is_input: false,
            })
        };
        if let Some(keeper) = self.keeper {
            return keeper.run_when(walking, watch, &meet);
        }
        meet(Ok(()))?;
        let runner = Runner {
            crew: self.team.crew(),
            ..walking.runner()
        };
        Ok(runner.run(walking.job, watch)?)
    }

    fn tolerance(&self, asked: Option<Tolerance>) -> Option<Tolerance> {
        match self.keeper {
            Some(keeper) => keeper.tolerance(asked),
            None => asked,
        }
    }
}
