//! The circle with polynomials: how the standard deviation falls, by degree.

use core::f64::consts::TAU;

use fredholm_circle::MeanOver;
use fredholm_core::galerkin::{
    Cells, DiagonalRule, GalerkinMatrix, TransitionMoments, collatz_wielandt_bounds,
    second_moment_radius,
};
use fredholm_core::{
    At, Estimator, Goal, Located, Neighbour, RngUniforms, Statistics, Uniforms, WalkSeeds,
    rounding_floor,
};
use fredholm_tests::circle::{DEFAULT, LIGHT, PAPER, circle, with_polynomials};
use fredholm_tests::{fit, on_all_cores, paper, run};

/// Ten arcs up to the paper's ρ* = 0.75.
const RHO: [f64; 10] = [0.3, 0.7, 0.0, 0.55, 0.74, 0.1, 0.62, 0.25, 0.48, 0.4];
/// Walks for a point.
const WALKS: u64 = 2000;

/// The walks' statistics at so many random points, from draws that no walk uses, with n cells of
/// degree B − 1.
fn at_random_points<const B: usize>(cells: usize, points: usize) -> Vec<(f64, Statistics)> {
    let mut draws = RngUniforms(<WalkSeeds>::new(7, u64::MAX).generator(0));
    let angles: Vec<f64> = (0..points)
        .map(|_| TAU * Uniforms::<f64>::uniform(&mut draws))
        .collect();
    with_polynomials::<f64, _, _, _, B>(&RHO, cells, LIGHT, DEFAULT, |circle, neighbour, _| {
        let one = |number: usize| {
            let angle = angles[number];
            let x = circle.point(angle);
            let v = neighbour.value(&neighbour.locate(x));
            let options = paper(Estimator::Absorption, number as u64);
            let goal = Goal::new(At(x), Some(v));
            let statistics = run(circle, neighbour, &goal, options, WALKS);
            (LIGHT.solution(angle), statistics)
        };
        on_all_cores(angles.len(), &one)
    })
}

/// The root mean squares of the standard deviations, plain and preconditioned.
fn deviations(statistics: &[(f64, Statistics)]) -> [f64; 2] {
    [Statistics::plain, Statistics::preconditioned].map(|of| {
        let squares = statistics
            .iter()
            .map(|(_, s)| of(s).std_dev.unwrap().powi(2));
        (squares.sum::<f64>() / statistics.len() as f64).sqrt()
    })
}

fn slope_of_degree<const B: usize>(levels: [usize; 4]) {
    let deviations = levels.map(|n| deviations(&at_random_points::<B>(n, 50))[1]);
    let points: Vec<_> = levels
        .iter()
        .zip(deviations)
        .map(|(&n, d)| ((n as f64).ln(), d.ln()))
        .collect();
    let (slope, expected) = (fit::slope(&points), -(B as f64));
    println!(
        "degree {}: {levels:?} {deviations:?}, slope {slope:.3}",
        B - 1
    );
    assert!(
        (slope / expected - 1.0).abs() < 0.15,
        "degree {}: {slope}",
        B - 1
    );
}

/// √Var ~ n^−(degree + 1), as root mean square over 50 random points: the same points at each level, so that
/// a level's error is that of 100,000 walks.
#[test]
fn the_standard_deviation_falls_as_the_degree_says() {
    slope_of_degree::<1>([50, 100, 200, 400]);
    slope_of_degree::<2>([50, 100, 200, 400]);
    slope_of_degree::<3>([50, 100, 200, 400]);
    slope_of_degree::<4>([50, 100, 200, 400]);
    slope_of_degree::<5>([40, 60, 80, 120]);
}

fn reduction<const B: usize>() -> f64 {
    let statistics = at_random_points::<B>(1000 / B / 10 * 10, 100);
    let [plain, preconditioned] = deviations(&statistics);
    let mut worst: f64 = 0.0;
    for (exact, statistics) in &statistics {
        let estimate = statistics.preconditioned();
        let floor = rounding_floor::<f64>(6.0, 6.0, 0.74);
        let error = (estimate.estimate - exact).abs();
        worst = worst.max(error / (4.0 * estimate.std_error.unwrap()).max(floor));
    }
    println!(
        "degree {}: plain {plain:.3}, preconditioned {preconditioned:.3e}, reduced {:.3e} times; error at most \
         {worst:.2} times what is allowed",
        B - 1,
        plain / preconditioned
    );
    // 100 points: one of them beyond 4 standard errors has a probability of 0.6 %.
    assert!(worst <= 1.0, "degree {}: {worst}", B - 1);
    plain / preconditioned
}

/// At most 1,000 unknowns, root mean square over 100 random points; the paper: 870.
#[test]
fn a_thousand_unknowns_reduce_it_by_eight_digits() {
    assert!(reduction::<1>() > 300.0);
    assert!(reduction::<2>() > 1e4);
    assert!(reduction::<3>() > 1e6);
    assert!(reduction::<4>() > 5e7);
    assert!(reduction::<5>() > 1e8);
}

/// (v, Φ) of a mean against a sum over v at many points, for ends within cells, at cells' ends, and within one
/// cell.
#[test]
fn means_of_polynomials_are_those_of_v() {
    with_polynomials::<f64, _, _, _, 5>(&RHO, 20, LIGHT, DEFAULT, |circle, neighbour, v| {
        let cell = TAU / 20.0;
        for (from, to) in [
            (0.0, TAU),
            (0.1, 0.2),
            (0.5 * cell, 7.3 * cell),
            (cell, 2.0 * cell),
        ] {
            let mean = MeanOver::new(from, to).unwrap().of(20, v);
            // Simpson's rule between the cells' ends and the interval's.
            let mut ends: Vec<f64> = (0..=20).map(|i| f64::from(i) * cell).collect();
            ends.extend([from, to]);
            ends.retain(|s| (from..=to).contains(s));
            ends.sort_by(f64::total_cmp);
            let value = |s: f64, i: usize| {
                let point = circle.point(s);
                neighbour.value(&Located { point, cell: i })
            };
            let mut sum = 0.0;
            for ends in ends.windows(2) {
                let (left, width) = (ends[0], (ends[1] - ends[0]) / 64.0);
                let i = ((0.5 * (ends[0] + ends[1]) / cell) as usize).min(19);
                for part in 0..64 {
                    let at = |t: f64| value(left + (f64::from(part) + t) * width, i);
                    sum += width / 6.0 * (at(0.0) + 4.0 * at(0.5) + at(1.0));
                }
            }
            let expected = sum / (to - from);
            assert!(
                (mean - expected).abs() < 1e-10,
                "{from} {to}: {mean} {expected}"
            );
        }
    });
}

/// The spectral radius of T_h²p.
fn radius<const B: usize>(reflectance: &[f64], cells: usize, pairs: DiagonalRule) -> f64 {
    let circle = circle::<f64, f64, _>(reflectance, cells, LIGHT);
    second_moment_radius::<_, _, _, B>(
        &circle,
        &circle.system::<B>(),
        &pairs,
        // Within the cell: at its very ends a point belongs to the next.
        |i| [1e-6, 0.5, 1.0 - 1e-6].map(|t| Cells::point(&circle, i, &[t])),
        |x, j| {
            let [[mass]] = circle.moments(x, j);
            reflectance[x.cell * reflectance.len() / cells].powi(2) * mass
        },
    )
    .unwrap()
}

/// On a fine partition h is near k = ρ, so that T_h²p has nearly the radius of T_k²p; with the diagonal
/// left out it has less.
#[test]
fn the_second_moment_of_h_is_near_that_of_k() {
    let circle = circle::<f64, f64, _>(&RHO, 100, LIGHT);
    let (mut w, mut next) = ([1.0; 100], [0.0; 100]);
    let mut apply = |w: &[f64], out: &mut [f64]| {
        circle.system::<1>().apply(w, out);
        for (i, out) in out.iter_mut().enumerate() {
            *out *= RHO[i / 10];
        }
    };
    let [_, of_k] = collatz_wielandt_bounds(&mut apply, &mut w, &mut next, 100);
    let of_h = radius::<4>(&RHO, 100, DEFAULT);
    let without = radius::<4>(&RHO, 100, PAPER);
    println!("k: {of_k}, h: {of_h}, without the diagonal {without}");
    // The supremum over a cell in place of its mean is off by O(1/n).
    assert!((of_h / of_k - 1.0).abs() < 0.03);
    assert!(without < of_h);
    // Two cells are too few for anything, and it is finite all the same.
    let of_h = radius::<5>(&[0.74, 0.74], 2, PAPER);
    assert!(of_h > 0.0 && of_h.is_finite(), "{of_h}");
}
