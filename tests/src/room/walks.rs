//! Walks in a room, and what is asserted of them.

use fredholm_core::{DefaultGenerator, Estimator, Form, Length, Real, Task, WalkSeeds};
use fredholm_room::Room;

use super::{Drawing, RoomNeighbour};
use crate::outcome::Outcome;

/// Panics unless a check of a drawing has passed.
///
/// # Panics
/// If the check has failed.
pub fn assert_ok(drawing: &Drawing, what: &str, outcome: Outcome) {
    if let Err(e) = outcome.ok() {
        panic!("{}, {what}: {e}", drawing.name);
    }
}

/// The walks of a room, with the step limit of the library.
pub fn task<'a, F: Real, T>(
    (room, neighbour): (&'a Room<'a, F>, &'a RoomNeighbour<'a, F>),
    functional: &'a T,
    control_mean: Option<f64>,
    estimator: Estimator,
    seeds: WalkSeeds,
) -> Task<'a, Room<'a, F>, RoomNeighbour<'a, F>, T, DefaultGenerator> {
    Task {
        equation: room,
        neighbour,
        functional,
        control_mean,
        estimator,
        form: Form::Product,
        seeds,
        length: Length::default(),
    }
}
