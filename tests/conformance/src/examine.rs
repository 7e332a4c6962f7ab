//! All checks of a problem in one call.

use fredholm_core::StateSpace;

use crate::check;
use crate::description::{Description, ScalarOf, StepDescription, scalar_name};
use crate::galerkin::System;
use crate::offers::{Neighbours, Offers, StepNeighbours};
use crate::outcome::Outcome;
use crate::report::{Report, SCALARS};

/// Runs every check that applies to a problem. `seed` decides at which points and by which walks.
#[must_use]
pub fn examine<D: Neighbours<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let scalar = scalar_name::<D, B>();
    let mut report = found_in_cells(description, seed);
    for (name, outcome) in [
        ("measures", check::measures(description, seed)),
        ("uniform points", check::uniform_points(description, seed)),
        ("parameters", check::inverse(description, seed)),
    ] {
        if let Some(outcome) = outcome {
            report.push(name, scalar, outcome);
        }
    }
    report.push("basis", scalar, check::basis(description, seed));
    report.push("density", scalar, check::density(description, seed));
    report.push("moments", scalar, check::moments(description, seed));
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
    let constant = check::constant(description, &system.exact, system.radius_bound);
    if let Some(outcome) = constant {
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
pub fn examine_masses<D: Description<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let mut report = found_in_cells(description, seed);
    if let Some(outcome) = check::masses(description, seed) {
        report.push("masses", scalar_name::<D, B>(), outcome);
    }
    report
}

/// Where cells are found.
fn found_in_cells<D: StepDescription<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let scalar = scalar_name::<D, B>();
    let mut report = Report::default();
    report.push("cells", scalar, check::cells(description, seed));
    report.push(
        "steps' cells",
        scalar,
        check::sampler_points(description, seed),
    );
    report
}

/// Runs every check that applies to an equation of which nothing is known but how to step.
#[must_use]
pub fn examine_steps<D: StepNeighbours<B>, const B: usize>(description: &D, seed: u64) -> Report {
    let scalar = scalar_name::<D, B>();
    let mut report = found_in_cells(description, seed);
    for (name, outcome) in [
        ("measures", check::measures(description, seed)),
        ("parameters", check::inverse(description, seed)),
        ("basis", Some(check::basis(description, seed))),
        ("chi-squared", check::sampler_by_masses(description, seed)),
    ] {
        if let Some(outcome) = outcome {
            report.push(name, scalar, outcome);
        }
    }
    let mut offers = Offers::by_steps(description, seed, report);
    offers.plain();
    description.offers(&mut offers);
    offers.into_report()
}

/// [`examine`] of a problem in f32 and in f64, and whether their walks agree.
#[must_use]
pub fn examine_both<N, W, const B: usize>(narrow: &N, wide: &W, seed: u64) -> Report
where
    N: Neighbours<B, Equation: StateSpace<Scalar = f32>>,
    W: Neighbours<B, Equation: StateSpace<Scalar = f64>>,
{
    both(examine(narrow, seed), examine(wide, seed))
}

/// [`examine_steps`] of an equation in f32 and in f64, and whether their walks agree.
#[must_use]
pub fn examine_steps_both<N, W, const B: usize>(narrow: &N, wide: &W, seed: u64) -> Report
where
    N: StepNeighbours<B, Equation: StateSpace<Scalar = f32>>,
    W: StepNeighbours<B, Equation: StateSpace<Scalar = f64>>,
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
