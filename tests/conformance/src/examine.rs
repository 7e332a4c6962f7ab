//! All checks of a problem in one call.

use fredholm_core::galerkin::TransitionMoments;
use fredholm_core::{Density, Space};

use crate::check;
use crate::description::{Description, ScalarOf, scalar_name};
use crate::galerkin::System;
use crate::offers::{Neighbours, Offers};
use crate::outcome::Outcome;
use crate::report::{Report, SCALARS};

/// Runs every check that applies to a problem. `seed` decides at which points and by which walks.
#[must_use]
pub fn examine<D, const B: usize>(description: &D, seed: u64) -> Report
where
    D: Neighbours<B, Equation: Density + TransitionMoments<B>>,
{
    let scalar = scalar_name::<D, B>();
    let mut report = of_cells(description, seed);
    for (name, outcome) in [
        ("uniform points", check::uniform_points(description, seed)),
        ("density", check::density(description, seed)),
        ("moments", check::moments(description, seed)),
    ] {
        report.push(name, scalar, outcome);
    }
    for (name, outcome) in [
        ("masses", check::masses(description, seed)),
        ("chi-squared", check::sampler(description, seed)),
        ("distribution", check::distribution(description, seed)),
        ("solution", check::solution(description, seed)),
    ] {
        if let Some(outcome) = outcome {
            report.push(name, scalar, outcome);
        }
    }
    let system = match System::<ScalarOf<D, B>>::new(description) {
        Ok(system) => system,
        Err(error) => {
            let outcome = Outcome::refused(format!("the Galerkin system: {error}"));
            report.push("neighbour equation", scalar, outcome);
            return report;
        }
    };
    if let Some(outcome) = check::constant(description, &system) {
        report.push("constant", scalar, outcome);
    }
    let mut offers = Offers::new(description, seed, system, report);
    offers.plain();
    description.offers(&mut offers);
    offers.into_report()
}

/// Report as of [`examine`], but only what asks for no table of all pairs of cells: where cells are found,
/// and the accuracy of masses relative to their own size. For very many cells.
#[must_use]
pub fn examine_masses<D, const B: usize>(description: &D, seed: u64) -> Report
where
    D: Description<B, Equation: TransitionMoments<B>>,
{
    let mut report = found_in_cells(description, seed);
    if let Some(outcome) = check::masses(description, seed) {
        report.push("masses", scalar_name::<D, B>(), outcome);
    }
    report
}

/// Runs every check that applies to an equation of which nothing is known but how to step.
#[must_use]
pub fn examine_steps<D: Neighbours<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let mut report = of_cells(description, seed);
    if let Some(outcome) = check::sampler_by_masses(description, seed) {
        report.push("chi-squared", scalar_name::<D, B>(), outcome);
    }
    let mut offers = Offers::by_steps(description, seed, report);
    offers.plain();
    description.offers(&mut offers);
    offers.into_report()
}

/// Where cells are found.
fn found_in_cells<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let scalar = scalar_name::<D, B>();
    let mut report = Report::default();
    report.push("cells", scalar, check::cells(description, seed));
    let of_steps = check::sampler_points(description, seed);
    report.push("steps' cells", scalar, of_steps);
    report
}

/// The cells and the functions on them.
fn of_cells<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let scalar = scalar_name::<D, B>();
    let mut report = found_in_cells(description, seed);
    report.push("measures", scalar, check::measures(description, seed));
    report.push("parameters", scalar, check::inverse(description, seed));
    report.push("basis", scalar, check::basis(description, seed));
    report
}

/// [`examine`] of a problem in f32 and in f64, and whether their walks agree.
#[must_use]
pub fn examine_both<N, W, const B: usize>(narrow: &N, wide: &W, seed: u64) -> Report
where
    N: Neighbours<B, Equation: Density + TransitionMoments<B> + Space<Scalar = f32>>,
    W: Neighbours<B, Equation: Density + TransitionMoments<B> + Space<Scalar = f64>>,
{
    both(examine(narrow, seed), examine(wide, seed))
}

/// [`examine_steps`] of an equation in f32 and in f64, and whether their walks agree.
#[must_use]
pub fn examine_steps_both<N, W, const B: usize>(narrow: &N, wide: &W, seed: u64) -> Report
where
    N: Neighbours<B, Equation: Space<Scalar = f32>>,
    W: Neighbours<B, Equation: Space<Scalar = f64>>,
{
    both(examine_steps(narrow, seed), examine_steps(wide, seed))
}

/// The reports of f32 and f64, and whether their walks agree.
fn both(narrow: Report, wide: Report) -> Report {
    let (mut report, other) = (wide, narrow);
    let pairs = other.traces.iter().zip(&report.traces);
    let agreement: Vec<_> = pairs
        .filter(|(narrow, wide)| narrow.name == wide.name)
        .map(|(narrow, wide)| (narrow.name.clone(), check::scalars(narrow, wide)))
        .collect();
    for (name, outcome) in agreement {
        report.push(SCALARS, name, outcome);
    }
    report.extend(other);
    report
}
