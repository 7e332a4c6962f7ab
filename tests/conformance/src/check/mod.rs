//! The checks. Each compares what a problem says with what theory or another computation says, and
//! returns the worst of its comparisons.
//!
//! Rounding is counted in units of ε times the size of what is added up. All sums of the checks are
//! compensated, so that the number of terms does not matter: a term is a product of some five
//! rounded factors, each of which the problem may compute with an error of a few ε.
//!
//! **The tolerances**, all that there are:
//!
//! | what is compared | may be apart by |
//! |---|---|
//! | numbers that are equal but for rounding | [`ROUNDING`] units |
//! | statistics that are kept, and the same in two passes | [`ROUNDING_OF_STATISTICS`] units a walk |
//! | a statistic and what theory or another computation expects | [`STANDARD_ERRORS`] |
//! | distribution functions, times √draws | [`KOLMOGOROV`] |
//! | coefficients by quadrature and the integrals | what the problem claims (`Offers::coefficients`) |
//! | min_mass_ratio and the least mass of a pair in S over its mean | nothing, on the right side |
//! | cells, pair lists, runners' bits | nothing |

mod chain;
mod map;
mod neighbour;
mod stationary;
mod steps;
mod walks;

pub(crate) use neighbour::vectors_agree;

pub use chain::{
    basis, cells, density, distribution, masses, moments, sampler, sampler_points, solution,
};
pub use map::{inverse, measures, uniform_points};
pub use neighbour::{
    coefficients, collapse, constant, neighbour_equation, pair_integrals, pair_lists, source_means,
};
pub use stationary::{preserved, states};
pub(crate) use steps::norm_by_steps;
pub use steps::{neighbour_equation_by_steps, sampler_by_masses};
pub use walks::{
    Among, COVERAGE_SEEDS, Trace, coverage, error_bar, means, run, run_in_batches, scalars,
    statistics, trace, walk_all,
};

use fredholm_core::galerkin::Cells;
use fredholm_core::{DefaultGenerator, Located, RngUniforms, Uniforms, WalkSeeds};

use crate::description::{Description, PointOf};

/// Rounding units that may lie between what a problem computes and what it should be: some five
/// factors with an error of 2 to 4 ε each.
pub const ROUNDING: f64 = 16.0;

/// Rounding units, in statistics of n walks n of them, that may lie between kept means, standard deviations and
/// standard errors and those of two passes: a walk adds a few rounding errors to what is kept.
pub const ROUNDING_OF_STATISTICS: f64 = 4.0;

/// Standard errors that a statistic may be off. If all is well, the whole matrix fails by chance for one choice of
/// seeds in a thousand: its [`COMPARISONS`] statistics, were they independent, are all within z standard errors with
/// probability (1 − 2Q(z))^COMPARISONS (Šidák), and that is 1 − 10⁻³ at z = 5.6. Half of them see in f32 the walks that
/// the other half sees in f64, so that the true probability is smaller, although not every tail is the normal one: of
/// 1,000 intervals of 95 % so few cover with probability 2·10⁻⁷, and some 800 comparisons are of that kind.
pub const STANDARD_ERRORS: f64 = 5.6;

/// Largest √N sup|F_N − F| of a distribution function of N draws. It is above λ with probability 2 exp(−2λ²) at most, for
/// any N (Massart 1990): 3·10⁻⁸ for λ = 3, and for the thousand of the matrix together 3·10⁻⁵ of the 10⁻³.
pub const KOLMOGOROV: f64 = 3.0;

/// The number of comparisons for which [`STANDARD_ERRORS`] is derived: the matrix with all seeds does not make more.
pub const COMPARISONS: u64 = 45_000;

/// Walks of a mean: 20,000 with the default generator and 5,000 with another, with `FREDHOLM_LONG` in the
/// environment ten times as many.
#[must_use]
pub fn walks(default: bool) -> u64 {
    let walks = if default { 20_000 } else { 5000 };
    if long() { 10 * walks } else { walks }
}

/// Seeds of what takes seconds for each: the first alone by day, and all with `FREDHOLM_LONG` in the environment.
#[must_use]
pub fn seeds() -> &'static [u64] {
    if long() { &SEEDS } else { &SEEDS[..1] }
}

/// Whether `FREDHOLM_LONG` is in the environment.
#[must_use]
pub fn long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

/// The base seeds for which every problem must pass.
pub const SEEDS: [u64; 3] = [1, 2, 3];

/// Rounding units as a unit.
const UNITS: &str = "rounding units";

/// Uniform numbers that belong to a seed and a purpose.
fn draws(seed: u64, purpose: u64) -> RngUniforms<DefaultGenerator> {
    RngUniforms(WalkSeeds::new(seed, purpose).generator(0))
}

/// Uniform parameters in [0, 1), one for each dimension.
fn parameters<D: Description<B>, const B: usize>(
    draws: &mut RngUniforms<DefaultGenerator>,
) -> Vec<f64> {
    (0..D::Equation::DIMENSION)
        .map(|_| draws.uniform())
        .collect()
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
        point: description
            .equation()
            .point(cell, &parameters::<D, B>(&mut draws)),
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

/// Cells as of [`cells_of`], each once: what looks at fixed points of a cell sees nothing new a second time.
fn different_cells<D: Description<B>, const B: usize>(
    description: &D,
    seed: u64,
    count: usize,
) -> Vec<usize> {
    let mut cells = cells_of::<D, B>(description, seed, count);
    cells.sort_unstable();
    cells.dedup();
    cells
}

/// All corners of the parameter cube.
fn corners<D: Description<B>, const B: usize>() -> impl Iterator<Item = Vec<f64>> {
    grid::<D, B>(&[0.0, 1.0])
}

/// All parameters made of these.
fn grid<D: Description<B>, const B: usize>(values: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    let base = values.len();
    (0..base.pow(D::Equation::DIMENSION as u32)).map(move |number| {
        let digit = |a| values[number / base.pow(a) % base];
        (0..D::Equation::DIMENSION as u32).map(digit).collect()
    })
}
