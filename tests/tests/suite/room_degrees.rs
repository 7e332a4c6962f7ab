//! Rooms with polynomials: what a degree saves, and what walks do not tell.

use fredholm_core::galerkin::PairIntegral;
use fredholm_core::{Goal, Located, WalkOptions};
use fredholm_room::{Grading, MeanOver, Seen};
use fredholm_tests::check::long;
use fredholm_tests::room::{Drawing, Setup, Way, block, furnished, square};
use fredholm_tests::{fit, run};

/// By how much √Var of the mean over all walls is less than that of plain walks, and √Var itself; means agree.
fn reduced<const B: usize>(drawing: &Drawing, unknowns: usize) -> [f64; 2] {
    let grading = Grading::of_degree(B - 1);
    let setup = Setup::<B>::of_degree::<f64>(drawing, unknowns / B, grading).unwrap();
    setup.with::<f64, _>(Way::Rays, |room, neighbour, v| {
        let mean = MeanOver::everything(room);
        let goal = Goal::new(mean.clone(), Some(mean.of(v)));
        let all = run(room, neighbour, &goal, WalkOptions::default(), 20_000);
        let [plain, best] = [all.plain(), all.preconditioned()];
        let [a, b] = [plain, best].map(|e| e.std_error.unwrap());
        assert!((plain.estimate - best.estimate).abs() < 4.0 * (a * a + b * b).sqrt());
        println!(
            "{}, degree {}, {unknowns} unknowns: {:.0} times",
            drawing.name,
            B - 1,
            a / b
        );
        [a / b, best.std_dev.unwrap()]
    })
}

/// √Var of piecewise constants falls like n^−0.91 to n^−0.96. A standard deviation over 20,000 walks is uncertain by some per cent, and the slope over
/// a factor of 8 by 0.05. And with 1,000 unknowns in the furnished room, degrees 1 and 3 against 0, it is ten times less. Measured: 20 to 70 times.
/// Higher degrees leave what corners and shadows do.
#[test]
fn the_standard_deviation_falls_like_one_over_n_and_ten_times_with_a_degree() {
    let room = furnished();
    let flat = reduced::<1>(&room, 1000);
    for [found, _] in [reduced::<2>(&room, 1000), reduced::<4>(&room, 1000)] {
        assert!(found > 10.0 * flat[0], "{found} {flat:?}");
    }
    let cells = if long() { [500, 4000] } else { [125, 1000] };
    for drawing in [square(), room] {
        let points = cells.map(|cells| {
            let is_known = cells == 1000 && drawing.name != "square";
            let [_, deviation] = if is_known {
                flat
            } else {
                reduced::<1>(&drawing, cells)
            };
            ((cells as f64).ln(), deviation.ln())
        });
        let slope = fit::slope(&points);
        assert!((slope + 0.95).abs() < 0.15, "{}: {slope}", drawing.name);
    }
}

/// What a point sees of all cells at once is what it sees of each, in corners, too; and the first moment of every order is the form factor.
#[test]
fn cells_are_seen_at_once_as_one_by_one() {
    let setup = Setup::<5>::of_degree::<f64>(&block(), 40, Grading::default()).unwrap();
    setup.with::<f64, _>(Way::Exact, |room, _, _| {
        let n = room.partition().len();
        let mut all = vec![0.0; 5 * n];
        let mut seen = 0;
        for i in 0..n {
            for t in [0.0, 0.013, 0.37, 0.5, 0.999, 1.0] {
                let point = room.inside(i, t).unwrap();
                let x = Located { point, cell: i };
                room.all_form_factors::<5>(&point, &mut all);
                let sum: f64 = all.iter().step_by(5).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{i} {t}: {sum}");
                for (j, own) in all.chunks_exact(5).enumerate() {
                    let moments: [f64; 5] = room.form_factors(&point, j);
                    let reflected: [f64; 5] = room.pair_integral(&x, j);
                    seen += usize::from(own[0] > 0.0);
                    for ((own, moment), reflected) in own.iter().zip(moments).zip(reflected) {
                        // Where a cell is seen in part, places of shadows are wrong by ε.
                        assert!((own - moment).abs() < 1e-12, "{i} {t} {j}: {own} {moment}");
                        assert!(reflected.abs() <= 0.7 * moment.abs(), "{i} {j}");
                    }
                    let factor = room.form_factor(&point, j);
                    let is_inside = t > 0.0 && t < 1.0;
                    assert!(!is_inside || (moments[0] - factor).abs() < 1e-12 * (1.0 + factor));
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
    let setup = Setup::<2>::of_degree::<f64>(&square(), 4, Grading::of_degree(0)).unwrap();
    setup.with::<f64, _>(Way::Exact, |room, _, _| {
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
