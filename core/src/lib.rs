#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod array;
mod batch;
mod equation;
pub mod galerkin;
mod job;
mod neighbour;
mod real;
mod schedule;
mod statistics;
mod uniforms;
mod walk;

pub use batch::{Batch, NotFinite, STEP_LIMIT, Task};
pub use equation::{
    At, Equation, Functional, Kernel, Sampler, Source, StateSpace, TransitionDensity,
};
pub use job::{Goal, Goals, Job, UncertainControl, WalkOptions};
pub use neighbour::{Located, Neighbour, NeighbourOf, NoNeighbour};
pub use real::Real;
pub use schedule::{
    MIN_BATCHES, MIN_SCORED_WALKS, RunOptions, RunOptionsError, Schedule, StopReason, Tolerance,
    next_stage,
};
pub use statistics::{Estimate, Statistics, Terminations, rounding_floor};
pub use uniforms::{DEFAULT_GENERATOR, DefaultGenerator, RngUniforms, Uniforms, WalkSeeds};
pub use walk::{Estimator, Termination, Walk, walk};

/// The generator traits that [`WalkSeeds`] and [`Task`] ask for.
pub use rand_core;
