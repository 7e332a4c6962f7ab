//! Equations of crates of their own, by one adaptor.

mod crowded;
mod interval;
mod sphere;
