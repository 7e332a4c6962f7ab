//! Chains that say of themselves what is not so, for the list of broken problems.

use fredholm_core::whole::Starts;
use fredholm_core::{Real, Sampler, StateSpace, Uniforms};
use fredholm_cube::model;
use fredholm_room::{Room, WallStarts};
use fredholm_tests::circle::{LIGHT, RHO, described};
use fredholm_tests::cube;
use fredholm_tests::room::{self, Drawing, square};
use fredholm_tests::toy::Toy;
use fredholm_tests::{Description, Report, check};

/// What is claimed of the chain of an equation.
struct Claimed<'a, E: StateSpace> {
    density: f64,
    survival: f64,
    start: &'a dyn Fn(E::Scalar) -> E::Point,
}

impl<E: StateSpace> Starts<E> for Claimed<'_, E> {
    fn start<U: Uniforms<E::Scalar>>(&self, uniforms: &mut U) -> E::Point {
        (self.start)(uniforms.uniform())
    }
    fn start_density(&self, _: &E::Point) -> f64 {
        self.density
    }
    fn survival(&self) -> Option<f64> {
        Some(self.survival)
    }
}

fn examined<D: Description>(
    description: &D,
    chain: &Claimed<'_, D::Equation>,
    seed: u64,
) -> Report {
    let mut report = Report::default();
    let preserved = check::preserved(description, chain, seed);
    report.push("preserved density", "chain", preserved);
    report.push(
        "suffix starts",
        "chain",
        check::states(description, chain, seed),
    );
    report
}

/// The toy, whose absorption and density vary from place to place, with uniform starts and the mean of its 1 − q.
pub(crate) fn crowding(seed: u64) -> Report {
    let toy = Toy::<f64>::new(10);
    let chain = Claimed {
        density: 1.0,
        survival: 0.75,
        start: &|xi| xi,
    };
    examined::<Toy<f64>>(&toy, &chain, seed)
}

/// The toy with uniform starts and the density of all its states: that of the l-th is a + b (x − ½), from which that of the
/// next follows by the integrals of 1 − q = 0.8 − x/10 times polynomials.
struct KnownStates {
    /// What b is multiplied by: 1, or an error.
    fault: f64,
}

impl Starts<Toy<f64>> for KnownStates {
    fn start<U: Uniforms<f64>>(&self, uniforms: &mut U) -> f64 {
        uniforms.uniform()
    }
    fn start_density(&self, _: &f64) -> f64 {
        1.0
    }
    fn survival(&self) -> Option<f64> {
        None
    }
    fn density_of_states(&self, x: &f64, most: usize) -> Option<f64> {
        let ([mut a, mut b], mut sum) = ([1.0, 0.0], 0.0);
        for _ in 0..most {
            sum += a + self.fault * b * (x - 0.5);
            [a, b] = [0.75 * a - b / 120.0, 11.0 / 30.0 * a + 7.0 / 120.0 * b];
        }
        Some(sum)
    }
}

/// A density of states that is known passes.
#[test]
fn known_states_pass() {
    let states = check::states::<_, _, 1>(&Toy::<f64>::new(10), &KnownStates { fault: 1.0 }, 1);
    assert!(states.passed(), "{states:?}");
}

/// The same with states that crowd by half more than they do.
pub(crate) fn wrong_states(seed: u64) -> Report {
    let mut report = Report::default();
    let chain = KnownStates { fault: 1.5 };
    let states = check::states::<_, _, 1>(&Toy::<f64>::new(10), &chain, seed);
    report.push("suffix starts", "chain", states);
    report
}

/// A circle whose starts are nearer to 0 than they should be, which no quadrature sees.
pub(crate) fn crowded_starts(seed: u64) -> Report {
    described::<f64, _>(&RHO, 10, LIGHT, |circle| {
        let equation = Description::<1>::equation(circle);
        let chain = Claimed {
            density: equation.start_density(&equation.point(0.0)),
            survival: equation
                .survival()
                .expect("a chain that preserves its density"),
            start: &|xi: f64| equation.point(core::f64::consts::TAU * xi.pow(1.02)),
        };
        examined(circle, &chain, seed)
    })
}

/// The length of all walls of a room.
fn length(room: &Room<'_, f64>) -> f64 {
    room.geometry().walls().iter().map(|wall| wall.length).sum()
}

/// A square without its last side, whose walks leave more often near the gap than elsewhere.
fn open_square() -> Drawing {
    let mut drawing = square();
    drawing.surfaces.pop();
    drawing.open = true;
    drawing
}

/// An open room that claims what a closed one does.
pub(crate) fn leaking_room(seed: u64) -> Report {
    room::described::<f64, _>(&open_square(), 20, 1.0, |described| {
        let room = described.equation();
        let walls = room.geometry().walls().len();
        let start = |xi: f64| {
            let place = xi * walls as f64;
            let wall = (place as usize).min(walls - 1);
            room.point(wall, place - wall as f64).expect("a wall")
        };
        let chain = Claimed {
            density: 1.0 / length(room),
            survival: 1.0 - room.absorption(&start(0.5)),
            start: &start,
        };
        examined(described, &chain, seed)
    })
}

/// Starts in rooms: closed ones say that they preserve a density, and do; of an open one the starts are as they say.
#[test]
fn rooms_have_uniform_starts() {
    fn of<F: Real>(drawing: &Drawing, claims: bool, report: &mut Report) {
        room::described::<F, _>(drawing, 24, 1.0, |described| {
            let room = described.equation();
            let lengths = described.lengths();
            let starts = WallStarts::new(room, lengths).expect("lengths of walls");
            assert_eq!(starts.survival().is_some(), claims, "{}", drawing.name);
            let preserved = check::preserved(described, &starts, 2);
            report.push("preserved density", drawing.name, preserved);
            let states = check::states(described, &starts, 2);
            report.push("suffix starts", drawing.name, states);
        });
    }
    let mut report = Report::default();
    let closed = [
        square(),
        room::l_room(),
        room::furnace(),
        room::block(),
        room::doorway(),
        room::facet(),
    ];
    for drawing in closed.into_iter().chain([open_square(), room::yard()]) {
        of::<f32>(&drawing, !drawing.open, &mut report);
        of::<f64>(&drawing, !drawing.open, &mut report);
    }
    report.assert_passed("starts in rooms");
}

/// What circle and cube say of themselves, in both scalars; the matrix has more of them.
#[test]
fn circle_and_cube_preserve_uniform_densities() {
    fn circle<F: Real>(cells: usize, report: &mut Report) {
        described::<F, _>(&RHO, cells, LIGHT, |circle| {
            let chain = Description::<1>::equation(circle);
            let preserved = check::preserved(circle, chain, 1);
            report.push("preserved density", "circle", preserved);
            report.push("suffix starts", "circle", check::states(circle, chain, 1));
        });
    }
    let mut report = Report::default();
    for cells in [5, 35] {
        circle::<f32>(cells, &mut report);
        circle::<f64>(cells, &mut report);
    }
    report.extend(cube::examined_furnace::<1>(model::quadratic(0.6), 5, 4, 1));
    report.extend(cube::examined_furnace::<2>(model::quadratic(0.6), 2, 4, 1));
    for check in ["preserved density", "suffix starts"] {
        let rows = report.rows().iter().filter(|row| row.check == check);
        assert_eq!(rows.count(), 8);
    }
    report.assert_passed("chains of circles and cubes");
}
