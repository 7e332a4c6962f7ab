//! Tests of scenes, in one program.

mod common;
mod rays;
mod scenes;
mod walks;
