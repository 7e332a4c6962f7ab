#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod array;
mod batch;
mod draws;
mod equation;
pub mod galerkin;
mod job;
mod neighbour;
mod real;
mod schedule;
mod statistics;
mod walk;

pub use batch::{Batch, NotFinite, STEP_LIMIT, Task};
pub use draws::{DEFAULT_GENERATOR, DefaultGenerator, Draws, Stream, Uniforms};
pub use equation::{
    At, Equation, Functional, Kernel, Sampler, Source, StateSpace, TransitionDensity,
};
pub use job::{Goal, Goals, Job, WalkOptions};
pub use neighbour::{Located, Neighbour, NeighbourOf, NoNeighbour};
pub use real::Real;
pub use schedule::{
    MIN_BATCHES, MIN_SCORED_WALKS, Plan, PlanError, Schedule, StopReason, Tolerance, next_stage,
};
pub use statistics::{Endings, Estimate, Statistics, rounding_floor};
pub use walk::{Ending, Estimator, Walk, walk};

/// The generator traits that [`Stream`] and [`Task`] ask for.
pub use rand_core;
