#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod array;
mod batch;
pub mod channels;
mod equation;
pub mod galerkin;
mod job;
mod known;
pub mod lanes;
mod last_step;
#[cfg(feature = "alloc")]
mod lights;
mod neighbour;
mod real;
pub mod refused;
pub mod sampled;
mod schedule;
mod sobol;
mod statistics;
mod tail;
mod uniforms;
mod walk;
pub mod whole;

pub use batch::{Batch, NotFinite, STEP_LIMIT, Task};
pub use equation::{
    At, Equation, Functional, Kernel, RandomSource, Sampler, Source, StateSpace, TransitionDensity,
};
pub use job::{Goal, Goals, Job, UncertainControl, WalkOptions};
pub use known::{KnownPart, Shifted, Started, WithKnown};
pub use last_step::{LastStep, SourceSampler};
#[cfg(feature = "alloc")]
pub use lights::{SourcePart, best_lights};
pub use neighbour::{Located, Neighbour, NeighbourOf, NoDraws, NoNeighbour};
pub use real::Real;
pub use schedule::{
    MIN_BATCHES, MIN_REPLICATES, MIN_SCORED_WALKS, RunOptions, RunOptionsError, Schedule,
    StopReason, Tolerance, next_stage,
};
pub use sobol::{SOBOL_COORDINATES, Sobol, SobolPoint, SobolWalk};
pub use statistics::{Estimate, Statistics, Terminations, rounding_floor};
pub use tail::{MANY_BATCHES, Tail};
pub use uniforms::{
    DEFAULT_GENERATOR, DefaultGenerator, Generators, RngUniforms, Uniforms, WalkNumber, WalkSeeds,
};
pub use walk::{Estimator, Form, Length, Termination, Walk, walk};

/// The generator traits that [`WalkSeeds`] and [`Task`] ask for.
pub use rand_core;
