//! The checks. Each compares what a problem says with what theory or another computation says, and
//! returns the worst of its comparisons.
//!
//! Rounding is counted in units of ε times the size of what is added up. All sums of the checks are
//! compensated, so that the number of terms does not matter: a term is a product of some five
//! rounded factors, each of which the problem may compute with an error of a few ε.

mod chain;
mod neighbour;
mod walks;

pub(crate) use neighbour::vectors_agree;

pub use chain::{
    basis, cells, density, distribution, masses, moments, sampler, sampler_points, solution,
};
pub use neighbour::{
    coefficients, collapse, constant, neighbour_equation, pair_integrals, pair_lists, source_means,
};
pub use walks::{Among, Trace, coverage, error_bar, means, run, scalars, statistics, trace};

use fredholm_core::galerkin::Partition;
use fredholm_core::{DefaultGenerator, Draws, Located, Stream, Uniforms};

use crate::description::{Description, PointOf};

/// Rounding units that may lie between what a problem computes and what it should be: some five
/// factors with an error of 2 to 4 ε each.
pub const ROUNDING: f64 = 16.0;

/// Standard errors that a statistic may be off. For three seeds the matrix makes up to 2·10⁴
/// comparisons of this kind; if all is well one of them is beyond 5.5 with probability 8·10⁻⁴
/// (Šidák).
pub const STANDARD_ERRORS: f64 = 5.5;

/// Rounding units as a unit.
const UNITS: &str = "rounding units";

/// Uniform numbers that belong to a seed and a purpose.
fn draws(seed: u64, purpose: u64) -> Draws<DefaultGenerator> {
    Draws(Stream::new(seed, purpose).generator(0))
}

/// So many parameters in [0, 1).
fn parameters<D: Description<B>, const B: usize>(draws: &mut Draws<DefaultGenerator>) -> Vec<f64> {
    (0..D::DIMENSION).map(|_| draws.uniform()).collect()
}

/// Random points of random cells, the first and the last cell among them.
fn samples<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
    count: usize,
) -> Vec<Located<PointOf<D, B>>> {
    let mut draws = draws(seed, 1);
    let random_cells = cells_of::<D, B>(description, seed, count);
    let located = random_cells.into_iter().map(|cell| Located {
        point: description.point(cell, &parameters::<D, B>(&mut draws)),
        cell,
    });
    located.collect()
}

/// Sixteen random points to start walks from.
pub(crate) fn random_points<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
) -> Vec<PointOf<D, B>> {
    let located = samples(description, seed, 16).into_iter();
    located.map(|x| x.point).collect()
}

/// The first cell, the last one and random ones; all of them where there are not more than `count`,
/// over and over.
fn cells_of<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
    count: usize,
) -> Vec<usize> {
    let cells = description.equation().cells();
    let mut draws = draws(seed, 2);
    let cell = |i| match i {
        _ if cells <= count => i % cells,
        0 => 0,
        1 => cells - 1,
        _ => {
            let uniform: f64 = draws.uniform();
            (uniform * cells as f64) as usize
        }
    };
    (0..count).map(cell).collect()
}

/// All corners of the parameter cube.
fn corners<D: Description<B>, const B: usize>() -> impl Iterator<Item = Vec<f64>> {
    grid::<D, B>(&[0.0, 1.0])
}

/// All parameters made of these.
fn grid<D: Description<B>, const B: usize>(values: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    let base = values.len();
    (0..base.pow(D::DIMENSION as u32)).map(move |number| {
        let digit = |a| values[number / base.pow(a) % base];
        (0..D::DIMENSION as u32).map(digit).collect()
    })
}
