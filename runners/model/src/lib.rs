#![doc = include_str!("../README.md")]

mod about;
mod bands;
mod channel_models;
pub mod channels;
mod colours;
pub mod cost;
mod derived;
pub mod device;
pub mod drawn;
mod error;
mod examined;
pub mod finite;
mod global;
mod goal;
pub mod heat;
mod last_step;
mod looks;
pub mod memory;
mod model;
pub mod numbers;
mod options;
pub mod pairs;
mod quantity;
mod question;
pub mod resolvent;
mod saved;
mod settings;
mod spot;
mod written;

pub use about::{About, WholeValues};
pub use derived::{Derived, Flux, Heat};
pub use error::{EquationError, Error, MOST_SECONDS, Subject};
pub use examined::{Examined, in_parallel};
pub use global::{
    CellNodes, First, GLOBAL_REPLICATES, GlobalField, GlobalQuantity, GlobalRequest, GlobalSystem,
    IMAGE_HEAD, MeanRule, MeshCell, WithGlobalJob, known_first, only_points, only_u, refined_mean,
    v_of_walks,
};
pub use goal::{Ask, Field, Goal, Region, Target, WeightFn, goals};
pub use last_step::LastSteps;
pub use looks::seen_from;
pub use model::{
    Deterministic, Differentiated, Model, NO_ITERATION, Partitioned, Prepared, Request, System,
    Then, Wanted, WithJob,
};
pub use options::{Choice, Choices, Method, Pairs, Scalar};
pub use quantity::{Quantity, SurfaceQuantities, Uncertainty};
pub use saved::{SavedSystem, SystemOf};
pub use settings::{Discretisation, Settings, WalkOptions};
pub use spot::{BLANK, Beside, Spot, SpotWalks, WriteSpot, picture_is_biased, spots};
