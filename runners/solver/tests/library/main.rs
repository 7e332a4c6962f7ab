//! Tests of the library, in one program: what they have in common is compiled and linked once.

mod asked;
mod capabilities;
mod certify;
mod channels;
mod closures;
mod common;
mod custom;
mod error_bars;
mod family;
mod fit;
mod last_step;
mod resolvent;
mod resolvent_global;
mod scene_predictions;
mod sensitivities;
mod solver;
mod tails;
mod whole;
