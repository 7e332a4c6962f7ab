//! Equations of crates of their own, by one adaptor.

mod interval;
mod sphere;
