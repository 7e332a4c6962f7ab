//! Rooms with polynomials: what a degree saves, and what walks do not tell.

use fredholm_core::galerkin::{
    AllPointwise, PairIntegral, TransitionMoments, second_moment_radius,
};
use fredholm_core::{
    At, Equation, Estimate, Functional, Goal, Located, Neighbour, RngUniforms, Statistics,
    WalkOptions, WalkSeeds,
};
use fredholm_room::{Choice, Grading, MeanOver, RoomPairs, Seen};
use fredholm_tests::check::long;
use fredholm_tests::room::{Drawing, Setup, block, furnished, square};
use fredholm_tests::{fit, on_all_cores, run};

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
fn deviations<const B: usize>(setup: &Setup<B>, walks: u64, points: usize) -> [[f64; 2]; 2] {
    setup.with::<f64, _>(Choice::Default, |room, neighbour, v| {
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
            let options = WalkOptions {
                seed: number as u64 + 1,
                ..WalkOptions::default()
            };
            run(room, neighbour, &goal, options, 2000)
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
    let both = deviations(&setup, walks, 100);
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

/// The slope of ln √Var over ln n, the mean over all walls, in cells graded by this exponent.
fn slope<const B: usize>(drawing: &Drawing, exponent: f64) -> f64 {
    let points = [400, 1000, 2400].map(|unknowns| {
        let grading = Grading {
            exponent,
            ..Grading::of_degree(B - 1)
        };
        let setup = setup::<B>(drawing, unknowns, grading);
        let [[_, best], _] = deviations(&setup, 50_000, 1);
        ((setup.mesh.len() as f64).ln(), best.ln())
    });
    let slope = fit::slope(&points);
    println!(
        "{}, degree {}, g = {exponent}: slope {slope:.2}",
        drawing.name,
        B - 1
    );
    slope
}

/// In a square without shadows √Var ~ n^−min(degree + 1, g/2). Pairs next to a corner look alike at
/// every size, so that h is wrong there by something that does not shrink with the cells: what
/// shrinks is the i-th cell's length, like n^−g, and with it the square of the deviation. g =
/// 2(degree + 1) leaves the degree's order.
#[test]
fn in_an_empty_square_the_order_is_that_of_the_degree() {
    let drawing = square();
    let [linear, quadratic] = [slope::<2>(&drawing, 4.0), slope::<3>(&drawing, 6.0)];
    // Within 15 %: half a logarithm comes besides, 1/(2 ln n).
    assert!((linear + 2.0).abs() < 0.3, "{linear}");
    assert!((quadratic + 3.0).abs() < 0.45, "{quadratic}");
    // Equal cells have n^−½ in the end, whatever the degree; on the way more, but nothing like
    // n^−5.
    if long() {
        let equal = slope::<5>(&drawing, 1.0);
        assert!(equal > -1.5, "{equal}");
    }
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

/// On enough cells h is near k = ρ, so that T_h²p has nearly the radius of T_k²p; with the paper's pairs, of which some are left
/// out, it has less.
#[test]
fn the_second_moment_of_h_is_near_that_of_k() {
    let setup = Setup::<4>::of_degree::<f64>(&block(), 100, Grading::default()).unwrap();
    let (matrix, views) = (setup.matrix.coefficients(), setup.matrix.views());
    setup.with::<f64, _>(Choice::Default, |room, _, _| {
        // Three Gauss points of a cell.
        let points = |cell| {
            let places = [0.112_701_665_379_258_3, 0.5, 0.887_298_334_620_741_7];
            places.map(|t| room.inside(cell, t).unwrap())
        };
        let pointwise = |x: &Located<_>, j| {
            let [factor, ..]: [f64; 4] = room.pair_integral(x, j);
            let k = room.kernel(&x.point, &x.point);
            k * factor
        };
        let of_pairs = |choice| {
            let pairs = RoomPairs { views, choice };
            second_moment_radius::<_, _, _, 4>(room, &matrix, &pairs, points, pointwise).unwrap()
        };
        let of_k =
            second_moment_radius::<_, _, _, 4>(room, &matrix, &AllPointwise, points, pointwise);
        let (of_k, [default, paper]) = (
            of_k.unwrap(),
            [Choice::Default, Choice::Paper].map(of_pairs),
        );
        println!("k: {of_k}, h: {default}, paper's pairs {paper}");
        // The supremum over three points of a cell.
        assert!((default / of_k - 1.0).abs() < 0.15, "{default} {of_k}");
        assert!(paper < default);
    });
}
