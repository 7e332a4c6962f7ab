//! A case's results as a line of text that is the same everywhere.

use core::fmt::{self, Write};

use fredholm_core::{Absorption, Estimate, Estimator, Real, Statistics};

/// Name, scalar, how walks end; walks and states; then estimate and standard error of plain and
/// preconditioned Monte Carlo, and all statistics, as hexadecimal bits.
pub fn line<F: Real>(
    out: &mut impl Write,
    name: &str,
    absorption: Absorption,
    statistics: &Statistics,
) -> fmt::Result {
    let scalar = if F::EPSILON.to_f64() == f64::EPSILON {
        "f64"
    } else {
        "f32"
    };
    let ends = match (absorption, absorption.estimator()) {
        (Absorption::Roulette, _) => "roulette",
        (_, Estimator::Absorption) => "absorption",
        (_, Estimator::Collision) => "collision",
    };
    write!(
        out,
        "{name} {scalar} {ends} walks {} states {} plain ",
        statistics.walks(),
        statistics.states()
    )?;
    estimate(out, statistics.plain())?;
    write!(out, " preconditioned ")?;
    estimate(out, statistics.preconditioned())?;
    write!(out, " all ")?;
    for byte in statistics.to_bytes() {
        write!(out, "{byte:02x}")?;
    }
    writeln!(out)
}

fn estimate(out: &mut impl Write, estimate: Estimate) -> fmt::Result {
    write!(out, "{:016x} ", estimate.estimate.to_bits())?;
    match estimate.std_error {
        Some(error) => write!(out, "{:016x}", error.to_bits()),
        None => write!(out, "none"),
    }
}
