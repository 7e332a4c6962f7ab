//! Tests of models of scenes, in one program.

mod coverage;
mod roads;
