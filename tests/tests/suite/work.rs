//! What a walk costs and how much it varies, as a table that is compared exactly: `snapshots/work.txt`. One evaluation
//! more in a state, or an order of convergence lost, changes a number. After a change that is meant to change them
//! `UPDATE_EXPECT=1 cargo test -p fredholm-tests --test suite work` writes the table again, and the difference is for the
//! reviewer to read.

use core::f64::consts::TAU;
use core::fmt::Write;

use expect_test::expect_file;
use fredholm_circle::{Circle, Tables};
use fredholm_core::galerkin::{
    AllPointwise, Coefficients, PairIntegral, Pairs, Piecewise, TransitionMoments,
};
use fredholm_core::{
    Batch, Equation, Estimator, Form, Length, Neighbour, NeighbourOf, NoNeighbour, RngUniforms,
    Source, Task, Uniforms, WalkSeeds,
};
use fredholm_cube::{Cube, ProductTables, Rule, functions, model};
use fredholm_room::{Grading, RoomPairs};
use fredholm_tests::check::Among;
use fredholm_tests::circle::{DEFAULT, IN_S, LIGHT, PAPER, RHO};
use fredholm_tests::counted::{COLUMNS, Counted, CountedCoefficients, CountedNeighbour, Counts};
use fredholm_tests::cube::{ABSORPTION, ALL, OUTSIDE, POINTWISE};
use fredholm_tests::room::{CHOICES, Drawing, Setup, block, square, yard};
use fredholm_tests::with_objects;

const WALKS: u64 = 1000;
const ESTIMATORS: [Estimator; 2] = [Estimator::Absorption, Estimator::Collision];

/// 64 uniform numbers that no walk uses.
fn numbers() -> Vec<f64> {
    let mut draws = RngUniforms(<WalkSeeds>::new(64, u64::MAX).generator(0));
    (0..64).map(|_| draws.uniform()).collect()
}

/// Adds the lines of both estimators. `counts` are those of `equation` and of `neighbour`.
fn lines<E, N>(
    table: &mut String,
    names: [&str; 2],
    counts: &Counts,
    equation: &E,
    neighbour: &N,
    points: &[E::Point],
) where
    E: Equation<Scalar = f64>,
    N: NeighbourOf<E>,
{
    let neighbour = CountedNeighbour::new(neighbour, counts);
    let values = points
        .iter()
        .map(|&x| neighbour.value(&neighbour.locate(x)));
    let value = values.sum::<f64>() / points.len() as f64;
    for estimator in ESTIMATORS {
        counts.reset();
        let task = Task {
            equation,
            neighbour: &neighbour,
            functional: &Among(points.to_vec()),
            control_mean: Some(value),
            estimator,
            form: Form::Product,
            seeds: <WalkSeeds>::new(1, 0),
            length: Length::default(),
        };
        let mut batch = Batch::new(0, WALKS, WALKS);
        with_objects(&task, |task| batch.run(task, u64::MAX)).unwrap();
        let statistics = batch.statistics();
        let [scene, pairs] = names;
        writeln!(
            table,
            "{scene:22} {pairs:10} {:10} {:9.3e} {:>8}{counts}",
            format!("{estimator:?}"),
            statistics.preconditioned().std_dev.unwrap(),
            statistics.states(),
        )
        .unwrap();
    }
}

fn plain<P: Equation<Scalar = f64> + Source>(
    table: &mut String,
    scene: &str,
    problem: &P,
    points: &[P::Point],
) {
    let counts = Counts::default();
    let counted = Counted::new(problem, &counts);
    let none = NoNeighbour::<Counted<'_, P>>::new();
    lines(table, [scene, "plain"], &counts, &counted, &none, points);
}

/// With pairs of any kind.
fn preconditioned<P, C, S, const B: usize>(
    table: &mut String,
    names: [&str; 2],
    (problem, coefficients): (&P, &C),
    pairs: S,
    [v, g]: [&[f64]; 2],
    points: &[P::Point],
) where
    P: Equation<Scalar = f64> + Source + TransitionMoments<B> + PairIntegral<B>,
    C: Coefficients<B, Scalar = f64>,
    S: Pairs + Copy,
{
    let counts = Counts::default();
    let counted = Counted::new(problem, &counts);
    let coefficients = CountedCoefficients::new(coefficients, &counts);
    let neighbour = Piecewise::with_pointwise(&counted, &coefficients, pairs, v, g).unwrap();
    lines(table, names, &counts, &counted, &neighbour, points);
}

/// With pairs in S or left out.
fn without_pointwise<P, C, S, const B: usize>(
    table: &mut String,
    names: [&str; 2],
    (problem, coefficients): (&P, &C),
    pairs: S,
    [v, g]: [&[f64]; 2],
    points: &[P::Point],
) where
    P: Equation<Scalar = f64> + Source + TransitionMoments<B>,
    C: Coefficients<B, Scalar = f64>,
    S: Pairs + Copy,
{
    let counts = Counts::default();
    let counted = Counted::new(problem, &counts);
    let coefficients = CountedCoefficients::new(coefficients, &counts);
    let neighbour = Piecewise::new(&counted, &coefficients, pairs, v, g).unwrap();
    lines(table, names, &counts, &counted, &neighbour, points);
}

fn circle<const B: usize>(table: &mut String, cells: usize) {
    let tables = Tables::<f64>::new(&RHO, cells).unwrap();
    let circle = Circle::new(tables.cells(), LIGHT, 0.2).unwrap();
    let points: Vec<_> = numbers().iter().map(|t| circle.point(TAU * t)).collect();
    let scene = &format!("circle {cells}, degree {}", B - 1);
    if B == 1 {
        plain(table, scene, &circle, &points);
        let solution = circle.solve(1e-15, 1000).unwrap();
        for (name, pairs) in [("paper", PAPER), ("default", DEFAULT), ("all in S", IN_S)] {
            let g = solution.source(&circle, &pairs).unwrap();
            let (names, vectors) = ([scene.as_str(), name], [&solution.v[..], &g]);
            preconditioned::<_, _, _, 1>(table, names, (&circle, &circle), pairs, vectors, &points);
        }
        let g = solution.source(&circle, &AllPointwise).unwrap();
        let (names, vectors) = ([scene.as_str(), "pointwise"], [&solution.v[..], &g]);
        let problem = (&circle, &circle);
        preconditioned::<_, _, _, 1>(table, names, problem, AllPointwise, vectors, &points);
        return;
    }
    let polynomials = circle.with_functions::<B>();
    let solution = polynomials.solve(1e-15, 1000).unwrap();
    for (name, pairs) in [("paper", PAPER), ("default", DEFAULT), ("all in S", IN_S)] {
        let g = solution.source(&polynomials, &pairs).unwrap();
        let (names, vectors) = ([scene.as_str(), name], [&solution.v[..], &g]);
        let problem = (&polynomials, &polynomials);
        preconditioned::<_, _, _, B>(table, names, problem, pairs, vectors, &points);
    }
}

fn cube<const D: usize, const B: usize>(table: &mut String, cells: usize) {
    let model = model::rational(0.9);
    let cube = Cube::<f64, D, _, _>::new(model.kernel, model.source, cells, ABSORPTION).unwrap();
    let random = numbers();
    let at = |n: usize| core::array::from_fn(|a| random[(n + 17 * a) % random.len()]);
    let points: Vec<[f64; D]> = (0..random.len()).map(at).collect();
    let scene = &format!("cube {D}, {cells}^{D}");
    if B == 1 {
        let scene = &format!("{scene}, degree 0");
        plain(table, scene, &cube, &points);
        let tables = ProductTables::new(&cube, Rule::new(2).unwrap()).unwrap();
        let solution = cube
            .solve(&tables, Rule::new(2).unwrap(), 1e-15, 1000)
            .unwrap();
        for (name, pairs) in [
            ("all in S", ALL),
            ("diag out", OUTSIDE),
            ("diag point", POINTWISE),
        ] {
            let g = solution.source(&tables, &pairs).unwrap();
            let (names, vectors) = ([scene.as_str(), name], [&solution.v[..], &g]);
            preconditioned::<_, _, _, 1>(table, names, (&cube, &tables), pairs, vectors, &points);
        }
        return;
    }
    let cube = cube.with_functions::<B>();
    let scene = &format!("{scene}, degree {}", cube.degree());
    let rule = Rule::new(cube.degree() + 1).unwrap();
    let tables = ProductTables::new(&cube, rule).unwrap();
    let solution = cube.solve(&tables, rule, 1e-15, 1000).unwrap();
    for (name, pairs) in [("all in S", ALL), ("diag out", OUTSIDE)] {
        let g = solution.source(&tables, &pairs).unwrap();
        let (names, vectors) = ([scene.as_str(), name], [&solution.v[..], &g]);
        without_pointwise::<_, _, _, B>(table, names, (&cube, &tables), pairs, vectors, &points);
    }
}

fn room<const B: usize>(table: &mut String, drawing: &Drawing, cells: usize) {
    let setup = Setup::<B>::of_degree::<f64>(drawing, cells, Grading::default()).unwrap();
    let tables = fredholm_room::Tables::<f64>::new(&setup.scene, &setup.mesh);
    let views = setup.matrix.views();
    let room = tables.room(views);
    let walls = tables.geometry().walls().len();
    let at = |(n, &t): (usize, &f64)| room.on_wall(n % walls, t).unwrap();
    let points: Vec<_> = numbers().iter().enumerate().map(at).collect();
    let scene = &format!("{} {cells}, degree {}", drawing.name, B - 1);
    if B == 1 {
        plain(table, scene, &room, &points);
    }
    let dense = setup.matrix.coefficients();
    for choice in CHOICES {
        let pairs = RoomPairs { views, choice };
        let g = setup.solution.source(&dense, &pairs).unwrap();
        let name = format!("{choice:?}").to_lowercase();
        let (names, vectors) = ([scene.as_str(), name.as_str()], [&setup.solution.v[..], &g]);
        preconditioned::<_, _, _, B>(table, names, (&room, &dense), pairs, vectors, &points);
    }
}

#[test]
fn walks_cost_and_vary_as_they_did() {
    let mut table = format!(
        "{WALKS} walks from 64 points in f64. The standard deviation of a walk, the states, and how often something was \
         evaluated in all: uniform numbers in steps,\nsteps, k, F, cells that were looked for, h, G, blocks of K', moments M_j, \
         bases, integrals of K over a cell.\n\n{:22} {:10} {:10} {:>9} {:>8}",
        "scene", "pairs", "estimator", "std_dev", "states"
    );
    for column in COLUMNS {
        write!(table, " {column:>8}").unwrap();
    }
    table.push('\n');
    let all = &mut table;
    circle::<1>(all, 50);
    circle::<1>(all, 1000);
    circle::<2>(all, 50);
    circle::<3>(all, 50);
    circle::<4>(all, 50);
    circle::<5>(all, 50);
    cube::<1, 1>(all, 40);
    cube::<1, { functions(1, 1) }>(all, 20);
    cube::<1, { functions(1, 2) }>(all, 20);
    cube::<1, { functions(1, 3) }>(all, 20);
    cube::<1, { functions(1, 4) }>(all, 20);
    cube::<2, 1>(all, 8);
    cube::<2, { functions(2, 2) }>(all, 4);
    cube::<2, { functions(2, 4) }>(all, 4);
    cube::<3, 1>(all, 4);
    cube::<3, { functions(3, 1) }>(all, 3);
    cube::<3, { functions(3, 3) }>(all, 2);
    cube::<5, 1>(all, 2);
    cube::<5, { functions(5, 1) }>(all, 2);
    room::<1>(all, &square(), 60);
    room::<1>(all, &block(), 100);
    room::<2>(all, &block(), 60);
    room::<3>(all, &block(), 60);
    room::<5>(all, &block(), 60);
    room::<1>(all, &yard(), 30);
    room::<4>(all, &yard(), 30);
    // A table is for people: no blanks at the ends of lines.
    let table: String = table
        .lines()
        .map(|line| format!("{}\n", line.trim_end()))
        .collect();
    expect_file!["snapshots/work.txt"].assert_eq(&table);
}
