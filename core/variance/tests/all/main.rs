//! Tests of predictions, in one program.

mod line;
mod model;
