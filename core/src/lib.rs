#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

mod batch;
mod draws;
mod equation;
pub mod galerkin;
mod neighbour;
mod real;
mod rounds;
mod statistics;
mod walk;

pub use batch::{Batch, NotFinite, STEP_LIMIT, Task};
pub use draws::{DEFAULT_GENERATOR, DefaultGenerator, Draws, Stream, Uniforms};
pub use equation::{At, Functional, Kernel, Sampler, Source, StateSpace, TransitionDensity};
pub use neighbour::{Located, Neighbour, NoNeighbour};
pub use real::Real;
pub use rounds::{ENOUGH_BATCHES, ENOUGH_SCORES, TargetError, next_round};
pub use statistics::{Endings, Estimate, Statistics, rounding_floor};
pub use walk::{Ending, Estimator, Walk, walk};

/// The generator traits that [`Stream`] and [`Task`] ask for.
pub use rand_core;
