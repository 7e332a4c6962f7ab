//! How fast the standard deviation falls with the number of cells.

use fredholm_core::{Goal, WalkOptions};
use fredholm_room::{Choice, Grading, MeanOver};
use fredholm_tests::check::long;
use fredholm_tests::room::{Drawing, Setup, doorway, facet, furnace, furnished, square};
use fredholm_tests::{fit, run};

/// √Var of the mean over all walls: plain, preconditioned, and the cells that there are.
fn deviations(
    drawing: &Drawing,
    cells: usize,
    exponent: f64,
    choice: Choice,
    walks: u64,
) -> [f64; 3] {
    let grading = Grading {
        exponent,
        shadows: false,
    };
    let start = std::time::Instant::now();
    let setup = Setup::new::<f64>(drawing, cells, grading).unwrap();
    let built = start.elapsed().as_secs_f64();
    setup.with::<f64, _>(choice, |room, neighbour, v| {
        let mean = MeanOver::everything(room);
        let value = mean.of(v);
        let goal = Goal::new(mean, Some(value));
        let start = std::time::Instant::now();
        let statistics = run(room, neighbour, &goal, WalkOptions::default(), walks);
        let walked = start.elapsed().as_secs_f64();
        let estimates = [statistics.plain(), statistics.preconditioned()];
        let [plain, best] = estimates.map(|e| e.std_dev.unwrap());
        print!(
            "{:16} {choice:9?} g = {exponent} n = {:5}: ",
            drawing.name,
            v.len()
        );
        print!("{plain:8.2e} {best:8.2e} ratio {:7.1}, ", plain / best);
        println!(
            "set-up {built:.2} s, a walk {:.2} µs",
            walked / walks as f64 * 1e6
        );
        [plain, best, v.len() as f64]
    })
}

/// The slope of ln √Var over ln n, by least squares.
fn slope(points: &[[f64; 3]]) -> f64 {
    let points: Vec<_> = points
        .iter()
        .map(|[_, best, n]| (n.ln(), best.ln()))
        .collect();
    fit::slope(&points)
}

/// Graded cells and default pairs: √Var ~ 1/n. A standard deviation over 20,000 walks is uncertain
/// by some per cent (the kurtosis of ζ is high), the slope over a factor of 10 by 0.05. For the other
/// choices, equal cells and the clock see `fredholm rates` and the README of the crate. Two rooms by day, on half as many cells.
#[test]
fn with_graded_cells_the_standard_deviation_falls_like_one_over_n() {
    let rooms = [square(), furnished(), doorway(), furnace(), facet()];
    for drawing in rooms.iter().take(if long() { 5 } else { 2 }) {
        let points = [500, 1000, 2000, 5000].map(|cells| {
            let cells = if long() { cells } else { cells / 2 };
            deviations(drawing, cells, 3.0, Choice::Default, 20_000)
        });
        let slope = slope(&points);
        println!("{}: slope {slope:.3}", drawing.name);
        assert!((slope + 1.0).abs() < 0.2, "{}: {slope}", drawing.name);
        let [plain, best, _] = points[3];
        assert!(plain / best > 100.0, "{}: {}", drawing.name, plain / best);
    }
}

/// The corners alone keep equal cells at n^−½ in an empty square, and the paper's two kinds of
/// pairs do no better in a room with shadows.
#[test]
fn neither_equal_cells_nor_the_papers_pairs_do_so_well() {
    let table = |drawing: &Drawing, exponent, choice| {
        [100, 400, 1600].map(|cells| deviations(drawing, cells, exponent, choice, 50_000))
    };
    let equal = slope(&table(&square(), 1.0, Choice::Default));
    let paper = slope(&table(&furnished(), 3.0, Choice::Paper));
    println!("slopes {equal:.3} and {paper:.3}");
    assert!(equal > -0.75 && paper > -0.75, "{equal} {paper}");
}
