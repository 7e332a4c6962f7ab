//! Equations of crates of their own, by one adaptor.

#[path = "../common/mod.rs"]
mod common;
mod crowded;
mod interval;
mod sphere;
