//! What a walk costs and how much it varies, as a table that is compared exactly: `snapshots/work.txt`. One evaluation
//! more in a state, or an order of convergence lost, changes a number. After a change that is meant to change them
//! `UPDATE_EXPECT=1 cargo test -p fredholm-tests --test suite work` writes the table again, and the difference is for the
//! reviewer to read.

use core::f64::consts::TAU;
use core::fmt::Write;

use expect_test::expect_file;
use fredholm_core::galerkin::PairTable;
use fredholm_core::galerkin::{
    AllPointwise, Coefficients, PairIntegral, Pairs, Piecewise, Solution, TransitionMoments,
    degree_of, functions,
};
use fredholm_core::{
    Batch, Equation, Goal, Job, Neighbour, NeighbourOf, NoNeighbour, RngUniforms, Uniforms,
    WalkSeeds,
};
use fredholm_cube::{Cube, CubeRule, model};
use fredholm_room::{Grading, paper_pairs};
use fredholm_tests::check::Among;
use fredholm_tests::circle::{DEFAULT, IN_S, LIGHT, PAPER, RHO};
use fredholm_tests::counted::{COLUMNS, Counted, Counts};
use fredholm_tests::cube::{ALL, OUTSIDE, POINTWISE, solved};
use fredholm_tests::room::{Drawing, Setup, block, square, yard};
use fredholm_tests::{Objects, all_ways};

const WALKS: u64 = 1000;
/// What the walks are called.
const WAYS: [&str; 3] = ["Absorption", "Collision", "Roulette"];

/// 64 uniform numbers that no walk uses.
fn numbers() -> Vec<f64> {
    let mut draws = RngUniforms(<WalkSeeds>::new(64, u64::MAX).generator(0));
    (0..64).map(|_| draws.uniform()).collect()
}

/// A scene of the table, and the points in which walks start.
struct Lines<'t, P> {
    table: &'t mut String,
    scene: String,
    points: Vec<P>,
}

impl<P: Copy + Send + Sync> Lines<'_, P> {
    /// Adds the lines of all ways. `counts` are those of `equation` and of `neighbour`.
    fn add<E, N>(&mut self, pairs: &str, counts: &Counts, equation: &E, neighbour: &N)
    where
        E: Equation<Scalar = f64, Point = P, Value = f64> + Sync,
        N: NeighbourOf<E> + Sync,
    {
        let neighbour = Counted::new(neighbour, counts);
        let values = self.points.iter();
        let values = values.map(|&x| neighbour.value(&neighbour.locate(x)));
        let value = values.sum::<f64>() / self.points.len() as f64;
        let goal = Goal::new(Among(&self.points), Some(value));
        let objects = Objects::new(equation, &neighbour, &goal);
        for (way, options) in WAYS.into_iter().zip(all_ways(1)) {
            counts.reset();
            let mut batch = [Batch::new(0, WALKS, WALKS)];
            objects.job(options).run(0, &mut batch, u64::MAX).unwrap();
            let statistics = batch[0].statistics();
            writeln!(
                self.table,
                "{:22} {pairs:10} {way:10} {:9.3e} {:>8}{counts}",
                self.scene,
                statistics.preconditioned().std_dev.unwrap(),
                statistics.states(),
            )
            .unwrap();
        }
    }

    fn plain<E>(&mut self, problem: &E)
    where
        E: Equation<Scalar = f64, Point = P, Value = f64> + Sync,
    {
        let counts = Counts::default();
        let counted = Counted::new(problem, &counts);
        let none = NoNeighbour::new(&counted);
        self.add("plain", &counts, &counted, &none);
    }

    /// With pairs of any kind.
    fn with_pointwise<E, C, S, const B: usize>(
        &mut self,
        name: &str,
        (problem, coefficients): (&E, &C),
        pairs: S,
        solution: &Solution,
    ) where
        E: Equation<Scalar = f64, Point = P, Value = f64>,
        E: TransitionMoments<B> + PairIntegral<B> + Sync,
        C: Coefficients<B, Scalar = f64> + Sync,
        S: Pairs + Copy + Sync,
    {
        let counts = Counts::default();
        let g = solution.source(coefficients, &pairs).unwrap();
        let counted = Counted::new(problem, &counts);
        let coefficients = Counted::new(coefficients, &counts);
        let neighbour =
            Piecewise::with_pointwise(&counted, &coefficients, pairs, &solution.v, &g).unwrap();
        self.add(name, &counts, &counted, &neighbour);
    }

    /// With pairs in S or left out.
    fn without_pointwise<E, C, S, const B: usize>(
        &mut self,
        name: &str,
        (problem, coefficients): (&E, &C),
        pairs: S,
        solution: &Solution,
    ) where
        S: Pairs + Copy + Sync,
        E: Equation<Scalar = f64, Point = P, Value = f64> + TransitionMoments<B> + Sync,
        C: Coefficients<B, Scalar = f64> + Sync,
    {
        let counts = Counts::default();
        let g = solution.source(coefficients, &pairs).unwrap();
        let counted = Counted::new(problem, &counts);
        let coefficients = Counted::new(coefficients, &counts);
        let neighbour = Piecewise::new(&counted, &coefficients, pairs, &solution.v, &g).unwrap();
        self.add(name, &counts, &counted, &neighbour);
    }
}

fn circle<const B: usize>(table: &mut String, cells: usize) {
    let circle = fredholm_tests::circle::circle::<f64, f64, _>(&RHO, cells, LIGHT);
    let mut lines = Lines {
        table,
        scene: format!("circle {cells}, degree {}", B - 1),
        points: numbers().iter().map(|t| circle.point(TAU * t)).collect(),
    };
    if B == 1 {
        lines.plain(&circle);
    }
    let system = circle.system::<B>();
    let solution = system.solve(1e-15, 1000).unwrap();
    for (name, pairs) in [("paper", PAPER), ("default", DEFAULT), ("all in S", IN_S)] {
        lines.with_pointwise::<_, _, _, B>(name, (&circle, &system), pairs, &solution);
    }
    if B == 1 {
        let problem = (&circle, &system);
        lines.with_pointwise::<_, _, _, B>("pointwise", problem, AllPointwise, &solution);
    }
}

fn cube<const D: usize, const B: usize>(table: &mut String, cells: usize) {
    let model = model::rational(0.9);
    let cube = Cube::<f64, D, _, _>::new(model.kernel, model.source, cells).unwrap();
    let random = numbers();
    let at = |n: usize| core::array::from_fn(|a| random[(n + 17 * a) % random.len()]);
    let degree = degree_of(D, B);
    let mut lines = Lines {
        table,
        scene: format!("cube {D}, {cells}^{D}, degree {degree}"),
        points: (0..random.len()).map(at).collect(),
    };
    let rule = CubeRule::new(&cube, degree, (degree + 1).max(2)).unwrap();
    let tables = rule.product_tables(&model.kernel.0).unwrap();
    let solution = solved(&rule, &tables, &model.source);
    if B == 1 {
        lines.plain(&cube);
        let kinds = [
            ("all in S", ALL),
            ("diag out", OUTSIDE),
            ("diag point", POINTWISE),
        ];
        for (name, pairs) in kinds {
            lines.with_pointwise::<_, _, _, 1>(name, (&cube, &tables), pairs, &solution);
        }
        return;
    }
    let cube = cube.with_functions::<B>();
    for (name, pairs) in [("all in S", ALL), ("diag out", OUTSIDE)] {
        lines.without_pointwise::<_, _, _, B>(name, (&cube, &tables), pairs, &solution);
    }
}

fn room(table: &mut String, drawing: &Drawing, cells: usize) {
    let setup = Setup::new::<f64>(drawing, cells, Grading::default()).unwrap();
    let tables = fredholm_room::Tables::<f64>::new(&setup.scene, &setup.mesh);
    let room = tables.room();
    let walls = tables.geometry().walls().len();
    let at = |(n, &t): (usize, &f64)| room.on_wall(n % walls, t).unwrap();
    let mut lines = Lines {
        table,
        scene: format!("{} {cells}", drawing.name),
        points: numbers().iter().enumerate().map(at).collect(),
    };
    lines.plain(&room);
    let dense = setup.matrix.coefficients();
    let kinds = paper_pairs(&setup.scene, &room).unwrap();
    let pairs = PairTable::new(&kinds, setup.mesh.len()).unwrap();
    lines.without_pointwise::<_, _, _, 1>("paper", (&room, &dense), pairs, &setup.solution);
}

#[test]
fn walks_cost_and_vary_as_they_did() {
    let mut table = format!(
        "1000 walks from 64 points in f64. The standard deviation of a walk, the states, and how often something was \
         evaluated in all: uniform numbers in steps,\nsteps, k, F, cells that were looked for, h, G, blocks of K', moments M_j, \
         bases, integrals of K over a cell.\n\n{:22} {:10} {:10} {:>9} {:>8}",
        "scene", "pairs", "walks by", "std_dev", "states"
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
    room(all, &square(), 60);
    room(all, &block(), 100);
    room(all, &yard(), 30);
    // A table is for people: no blanks at the ends of lines.
    let table: String = table
        .lines()
        .map(|line| format!("{}\n", line.trim_end()))
        .collect();
    expect_file!["snapshots/work.txt"].assert_eq(&table);
}
