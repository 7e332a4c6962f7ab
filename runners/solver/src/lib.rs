#![doc = include_str!("../README.md")]

/// The version of all bits of results. It grows with every change that CHANGELOG.md calls value-breaking: walks of different
/// versions are not merged.
pub const VALUE_VERSION: u32 = 10;

pub mod answer;
mod budget;
mod certify;
pub mod choice;
mod chosen;
mod custom;
pub mod diagnosis;
mod domain;
pub mod execute;
mod fit;
mod kinds;
#[cfg(doctest)]
mod manual;
mod point;
pub mod report;
mod sensitivities;
mod solver;
pub mod sweep;
pub mod systems;
mod whole;

/// What a model is made of.
pub mod model {
    pub use fredholm_model::{
        About, Derived, Examined, Flux, GlobalField, GlobalRequest, GlobalSystem, Heat, LastSteps,
        Model, Partitioned, Prepared, Request, System, Then, Wanted, WholeValues, WithGlobalJob,
    };
}

pub use fredholm_model::{channels, cost, heat, memory, numbers, resolvent};

pub use fredholm_room_model as room;
pub use fredholm_scene_model as scene;

pub use kinds::*;

pub use answer::SolveObserver;
pub use budget::Budget;
pub use certify::{Certificate, CertifiedValue, Verdict};
pub use custom::{CustomEquation, CustomModel, PointDependences, Uniformly};
pub use execute::Execute;
pub use fit::{Fit, FittedQuantity, FittedTarget, Fitting, Measured, Measurement, Unknown};
pub use fredholm_core::{Absorption, Estimator, Form, Sequence, StopReason, Tolerance};
pub use fredholm_model::{
    Ask, Choice, Choices, Discretisation, EquationError, Error, Field, GlobalQuantity, Goal,
    MeshCell, Method, Model, Pairs, Partitioned, Quantity, Region, Scalar, Settings, Subject,
    System, Target, Uncertainty, WalkOptions, WeightFn, goals,
};
pub use fredholm_rayon::Observer;
pub use point::Point;
pub use report::Report;
pub use room::RoomModel;
pub use scene::SceneModel;
pub use sensitivities::{Sensitivities, Sensitivity};
pub use solver::{SolveError, Solver, asked_way_back};
pub use whole::{GlobalCoefficients, GlobalEstimate, GlobalSummary, GlobalValue};
