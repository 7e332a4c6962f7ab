//! Fredholm integral equations of the second kind, solved by random walks with an error bar.

mod options;

pub use fredholm_core::Estimator;
pub use options::{Choice, Choices, Pairs, Scalar};
