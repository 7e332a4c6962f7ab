#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod array;
mod batch;
pub mod galerkin;
pub mod global;
mod job;
mod last_step;
#[cfg(feature = "alloc")]
mod lights;
mod neighbour;
mod real;
pub mod refused;
pub mod resolvent;
pub mod sampled;
mod schedule;
mod sensitivity;
mod sobol;
mod space;
mod statistics;
mod tail;
mod uniforms;
mod value;
mod walk;

pub use batch::{Batch, NotFinite, STEP_LIMIT};
pub use job::{Goal, Goals, Job, WalkOptions};
pub use last_step::{LastStep, Lights};
#[cfg(feature = "alloc")]
pub use lights::{SourcePart, best_lights};
pub use neighbour::{Located, Neighbour, NeighbourOf, NoDraws, NoNeighbour};
pub use real::Real;
pub use schedule::{
    MIN_BATCHES, MIN_REPLICATES, MIN_SCORED_WALKS, RunOptions, RunOptionsError, Schedule,
    StopReason, Tolerance, next_stage,
};
pub use sensitivity::{Dependence, Dependences, Direct, Sensitivities};
pub use sobol::{SOBOL_COORDINATES, Sequence, SobolPoint, SobolWalk};
pub use space::{At, Chain, Density, Equation, Functional, Scaled, Space, Start, StartOf, WideOf};
pub use statistics::{Estimate, Statistics, Terminations, rounding_floor};
pub use tail::{MANY_BATCHES, Tail};
pub use uniforms::{
    DEFAULT_GENERATOR, DefaultGenerator, Generators, Independent, RngUniforms, Uniforms,
    WalkNumber, WalkSeeds,
};
pub use value::{Channels, MOST_CHANNELS, Value};
pub use walk::{
    Absorption, Both, Estimator, Form, Length, ROULETTE_FLOOR, Termination, Walk, walk,
};

/// The generator traits that [`WalkSeeds`] and [`Generators`] ask for.
pub use rand_core;
