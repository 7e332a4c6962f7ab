//! Rooms with polynomials: what a degree saves, and what walks do not tell.

use fredholm_core::galerkin::{PairIntegral, TransitionMoments};
use fredholm_core::{
    At, Estimate, Functional, Goal, Located, Neighbour, RngUniforms, Statistics, WalkOptions,
    WalkSeeds,
};
use fredholm_room::{Choice, Grading, MeanOver, Seen};
use fredholm_tests::check::long;
use fredholm_tests::room::{Drawing, Setup, block, doorway, facet, furnace, furnished, square};
use fredholm_tests::{fit, on_all_cores, run, seeded};

/// A set-up of degree B − 1 with at most so many unknowns, as near to them as cells go.
fn setup<const B: usize>(drawing: &Drawing, unknowns: usize, grading: Grading) -> Setup<B> {
    let mut cells = unknowns / B;
    loop {
        let setup = Setup::of_degree::<f64>(drawing, cells, grading).unwrap();
        let most = unknowns / B;
        if setup.mesh.len() <= most {
            return setup;
        }
        cells -= (setup.mesh.len() - most).min(cells - 1);
    }
}

/// √Var of plain and preconditioned walks of the mean over all walls, and as root mean square over
/// so many random points; means agree.
fn deviations<const B: usize>(
    setup: &Setup<B>,
    choice: Choice,
    walks: u64,
    points: usize,
) -> [[f64; 2]; 2] {
    setup.with::<f64, _>(choice, |room, neighbour, v| {
        let mean = MeanOver::everything(room);
        let goal = Goal::new(mean.clone(), Some(mean.of(v)));
        let all = run(room, neighbour, &goal, WalkOptions::default(), walks);
        let mut draws = RngUniforms(<WalkSeeds>::new(1, u64::MAX).generator(0));
        let starts: Vec<_> = (0..points)
            .map(|_| mean.start(room, &mut draws).point)
            .collect();
        let at = |number: usize| {
            let x = starts[number];
            let goal = Goal::new(At(x), Some(neighbour.value(&neighbour.locate(x))));
            run(room, neighbour, &goal, seeded(number as u64 + 1), 2000)
        };
        let each: Vec<Statistics> = on_all_cores(starts.len(), &at);
        for (number, statistics) in core::iter::once(&all).chain(&each).enumerate() {
            let [plain, best] = [statistics.plain(), statistics.preconditioned()];
            let [a, b] = [plain, best].map(|e| e.std_error.unwrap());
            // With fixed seeds: of 101 differences of normal distribution one is beyond 4 standard errors with
            // a probability of 0.6 %.
            assert!(
                (plain.estimate - best.estimate).abs() < 4.0 * (a * a + b * b).sqrt(),
                "{number}: {plain:?} {best:?}"
            );
        }
        let mean_square = |of: fn(&Statistics) -> Estimate| {
            let squares = each.iter().map(|s| of(s).std_dev.unwrap().powi(2));
            (squares.sum::<f64>() / points as f64).sqrt()
        };
        [
            [all.plain(), all.preconditioned()].map(|e| e.std_dev.unwrap()),
            [Statistics::plain, Statistics::preconditioned].map(mean_square),
        ]
    })
}

fn ratios<const B: usize>(drawing: &Drawing, unknowns: usize, walks: u64) -> [f64; 2] {
    let setup = setup::<B>(drawing, unknowns, Grading::of_degree(B - 1));
    let both = deviations(&setup, Choice::Default, walks, 100);
    let [mean, points] = both.map(|[plain, best]| plain / best);
    let found = setup.mesh.len() * B;
    println!(
        "{}, degree {}, {found} unknowns: reduced {mean:.0} times, {points:.0} at random points",
        drawing.name,
        B - 1
    );
    [mean, points]
}

/// 2,000 unknowns in the furnished room: degrees 1 to 4 against 0, for the mean over all walls and
/// as root mean square over 100 random points. Measured: 20 to 200 times. A standard deviation of
/// 20,000 walks, most of whose scores are small, is uncertain by a few tens of per cent. Degree 1 by day.
#[test]
fn a_furnished_room_is_ten_times_better_with_a_degree() {
    let drawing = furnished();
    let flat = ratios::<1>(&drawing, 2000, 20_000);
    let better = |found: [f64; 2]| [0, 1].map(|k| found[k] / flat[k]);
    let linear = better(ratios::<2>(&drawing, 2000, 20_000));
    assert!(linear.iter().all(|&times| times > 5.0), "{linear:?}");
    let mut higher = Vec::new();
    if long() {
        higher.push(better(ratios::<5>(&drawing, 2000, 20_000)));
        higher.push(better(ratios::<3>(&drawing, 2000, 20_000)));
        higher.push(better(ratios::<4>(&drawing, 2000, 20_000)));
    }
    println!("{linear:?} {higher:?}");
    for found in higher {
        assert!(found.iter().all(|&times| times > 10.0), "{found:?}");
    }
}

/// The slope of ln √Var over ln n, the mean over all walls, in cells graded by this exponent, and by how much √Var is less on the
/// finest of them.
fn slope<const B: usize>(
    drawing: &Drawing,
    unknowns: &[usize],
    exponent: f64,
    choice: Choice,
) -> [f64; 2] {
    let (mut points, mut reduced) = (Vec::new(), f64::NAN);
    for &unknowns in unknowns {
        let grading = Grading {
            exponent,
            ..Grading::of_degree(B - 1)
        };
        let setup = setup::<B>(drawing, unknowns, grading);
        let [[plain, best], _] = deviations(&setup, choice, 50_000, 1);
        points.push(((setup.mesh.len() as f64).ln(), best.ln()));
        reduced = plain / best;
    }
    let slope = fit::slope(&points);
    println!(
        "{}, {choice:?}, degree {}, g = {exponent}: slope {slope:.2}, reduced {reduced:.0} times",
        drawing.name,
        B - 1
    );
    [slope, reduced]
}

/// In a square without shadows √Var ~ n^−min(degree + 1, g/2). Pairs next to a corner look alike at
/// every size, so that h is wrong there by something that does not shrink with the cells: what
/// shrinks is the i-th cell's length, like n^−g, and with it the square of the deviation. g =
/// 2(degree + 1) leaves the degree's order.
#[test]
fn in_an_empty_square_the_order_is_that_of_the_degree() {
    const UNKNOWNS: [usize; 3] = [400, 1000, 2400];
    let (drawing, pairs) = (square(), Choice::Default);
    let [linear, _] = slope::<2>(&drawing, &UNKNOWNS, 4.0, pairs);
    let [quadratic, _] = slope::<3>(&drawing, &UNKNOWNS, 6.0, pairs);
    // Within 15 %: half a logarithm comes besides, 1/(2 ln n).
    assert!((linear + 2.0).abs() < 0.3, "{linear}");
    assert!((quadratic + 3.0).abs() < 0.45, "{quadratic}");
    // Equal cells have n^−½ in the end, whatever the degree; on the way more, but nothing like
    // n^−5.
    if long() {
        let [equal, _] = slope::<5>(&drawing, &UNKNOWNS, 1.0, pairs);
        assert!(equal > -1.5, "{equal}");
    }
}

/// Graded cells and default pairs: √Var ~ 1/n. A standard deviation over 50,000 walks is uncertain
/// by some per cent (the kurtosis of ζ is high), the slope over a factor of 10 by 0.05. The corners alone keep equal cells at n^−½ in
/// an empty square, and the paper's two kinds of pairs do no better in a room with shadows. Two rooms by day, on half as many cells.
#[test]
fn with_graded_cells_the_standard_deviation_falls_like_one_over_n() {
    let half = if long() { 1 } else { 2 };
    let cells = [500, 1000, 2000, 5000].map(|cells| cells / half);
    let rooms = [square(), furnished(), doorway(), furnace(), facet()];
    for drawing in rooms.iter().take(if long() { 5 } else { 2 }) {
        let [slope, reduced] = slope::<1>(drawing, &cells, 3.0, Choice::Default);
        assert!((slope + 1.0).abs() < 0.2, "{}: {slope}", drawing.name);
        assert!(reduced > 100.0, "{}: {reduced}", drawing.name);
    }
    let cells = [100, 400, 1600];
    let [equal, _] = slope::<1>(&square(), &cells, 1.0, Choice::Default);
    let [paper, _] = slope::<1>(&furnished(), &cells, 3.0, Choice::Paper);
    assert!(equal > -0.75 && paper > -0.75, "{equal} {paper}");
}

/// The first moment of every order 0 is the form factor, whatever is seen of a cell, and so is M_00.
#[test]
fn the_first_moment_is_the_form_factor() {
    let setup = Setup::<5>::of_degree::<f64>(&block(), 40, Grading::default()).unwrap();
    setup.with::<f64, _>(Choice::Default, |room, _, _| {
        let n = room.partition().len();
        let mut seen = 0;
        for i in 0..n {
            for t in [0.013, 0.37, 0.5, 0.999] {
                let point = room.inside(i, t).unwrap();
                let x = Located { point, cell: i };
                for j in 0..n {
                    let factor = room.form_factor(&point, j);
                    let [first, ..]: [f64; 5] = room.form_factors(&point, j);
                    let moments: [[f64; 5]; 5] = room.moments(&x, j);
                    let mass = moments[0][0];
                    let reflected: [f64; 5] = room.pair_integral(&x, j);
                    seen += usize::from(factor > 0.0);
                    // Where a cell is seen in part, places of shadows are wrong by ε.
                    let off = 1e-14 + 1e-12 * factor;
                    assert!(
                        (first - factor).abs() < off,
                        "{i} {t} {j}: {first} {factor}"
                    );
                    assert!((mass - factor).abs() < off, "{i} {t} {j}: {mass} {factor}");
                    assert!(reflected[0] <= 0.7 * first, "{i} {j}");
                }
            }
        }
        assert!(seen > 1000, "{seen}");
    });
}

/// What a point sees of a lamp whose radiosity is linear: with s along it from the foot of a
/// perpendicular of length d, ∫ s dω = (d/2) ln((s_1² + d²)/(s_0² + d²)); and what falls on a wall,
/// ∫ s cos cos/(2r) ds, which for parallel walls is ½ [−d²/r].
#[test]
fn linear_light_has_closed_forms() {
    let setup = Setup::<2>::of_degree::<f64>(&square(), 4, Grading::default()).unwrap();
    setup.with::<f64, _>(Choice::Default, |room, _, _| {
        // 1 on the floor at x = 0, 3 at x = 1, nothing else.
        let mut v = vec![0.0; 8];
        v[0] = 2.0;
        v[1] = 1.0 / 3.0_f64.sqrt();
        for [x, d] in [[0.3, 0.2], [0.9, 0.999], [0.5, 1e-6], [0.01, 1e-3]] {
            let position = [x, d];
            let [value, share] = Seen { room, position }.of(&v);
            let [from, to] = [-x, 1.0 - x];
            let angle = (to / d).atan() - (from / d).atan();
            let first = 0.5 * d * ((to * to + d * d) / (from * from + d * d)).ln();
            let expected = ((1.0 + 2.0 * x) * angle + 2.0 * first) / core::f64::consts::TAU;
            assert!((value - expected).abs() < 1e-14, "{value} {expected}");
            assert!((share - 1.0).abs() < 1e-14);
        }
        // On the ceiling, d = 1: wall 2 runs to the left.
        let x = room.on_wall(2, 0.25).unwrap();
        let [from, to] = [-0.75_f64, 0.25];
        let r = |s: f64| (s * s + 1.0).sqrt();
        let factor = 0.5 * (to / r(to) - from / r(from));
        let first = 0.5 * (1.0 / r(from) - 1.0 / r(to));
        let expected = (1.0 + 2.0 * 0.75) * factor + 2.0 * first;
        let found = room.irradiance_of::<f64, 2>(&x, &v);
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        let all = MeanOver::everything(room);
        assert_eq!(all.of(&v), 0.5);
    });
}
