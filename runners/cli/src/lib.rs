//! What the program `fredholm` reads: problem files, View2D decks and formulas, and errors that show
//! where they are wrong.
//!
//! This is the part of the program that is built in seconds and meets whatever people feed it, so that
//! tests, benches and fuzz targets can do without the walks, which are compiled for every dimension,
//! degree and scalar. It is for the program alone: versions promise nothing about it.

pub mod deck;
pub mod failure;
pub mod file;
pub mod formula;
pub mod numbers;
