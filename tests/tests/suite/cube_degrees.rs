//! Polynomials of degree 0 to 4 on the cells of the cube.

use fredholm_core::galerkin::{
    Cells, Coefficients, Dense, GalerkinMatrix, functions, rounded, second_moment_radius,
};
use fredholm_core::{
    At, DefaultGenerator, Estimator, Neighbour, Real, RngUniforms, Uniforms, WalkOptions,
    WalkSeeds, rounding_floor,
};
use fredholm_cube::{
    Cube, CubeError, CubeRule, CubeScores, KernelFactors, Mean, Product, ScalarField, Weighted,
};
use fredholm_tests::check::{long, means, seeds};
use fredholm_tests::cube::{ALL, Gauss, Ramp, model, models, solved, walked, with_degree};
use fredholm_tests::{all_ways, fit, paper};

/// An expression for the number of functions in `$d` dimensions of every degree from 0 to 4.
macro_rules! of_degrees {
    ($d:expr, $functions:ident => $then:expr) => {
        of_degrees!($d, [0 1 2 3 4], $functions => $then)
    };
    ($d:expr, [$($p:literal)*], $functions:ident => $then:expr) => {
        [$({
            const $functions: usize = functions($d, $p);
            $then
        }),*]
    };
}

fn options(seed: u64) -> WalkOptions {
    paper(Estimator::Absorption, seed)
}

/// The coefficients of products and of tables are the same, block by block, in every way to ask for them.
#[test]
fn product_tables_are_dense_tables() {
    fn at<const D: usize, const B: usize>(cells: usize) {
        let cube = Cube::<f64, D, _, _>::new(Product(Gauss), Ramp, cells).unwrap();
        let cube = cube.with_functions::<B>();
        let rule = CubeRule::new(&cube, cube.degree(), (cube.degree() + 1).min(4)).unwrap();
        let entries = rule.table(&Product(Gauss)).unwrap();
        let unknowns = rule.unknowns();
        let dense = Dense::new(&entries, cube.cells(), B).unwrap();
        let product = rule.product_tables(&Gauss).unwrap();
        let close = |a: f64, b: f64| {
            assert!((a - b).abs() <= 1e-14, "D = {D}, B = {B}: {a:e} {b:e}");
        };
        let v: Vec<f64> = (0..unknowns)
            .map(|i| ((i * 37) % 11) as f64 / 11.0)
            .collect();
        let (mut left, mut right) = (vec![0.0; unknowns], vec![0.0; unknowns]);
        dense.apply(&v, &mut left);
        product.apply(&v, &mut right);
        left.iter().zip(&right).for_each(|(a, b)| close(*a, *b));
        dense.apply_absolute(&v[..cube.cells()], &mut left[..cube.cells()]);
        product.apply_absolute(&v[..cube.cells()], &mut right[..cube.cells()]);
        left.iter().zip(&right).for_each(|(a, b)| close(*a, *b));
        let weights: [f64; B] = core::array::from_fn(|a| 1.0 - 0.1 * a as f64);
        for i in 0..cube.cells() {
            close(product.row_sum(i), dense.row_sum(i));
            for j in 0..cube.cells() {
                let [mut a, mut b] = [(); 2].map(|()| vec![0.0; B * B]);
                dense.block(i, j, &mut a);
                product.block(i, j, &mut b);
                a.iter().zip(&b).for_each(|(a, b)| close(*a, *b));
                close(product.mean(i, j), a[0]);
                let by_dense = dense.left_times_block(i, j, &weights);
                let by_axes = product.left_times_block(i, j, &weights);
                by_dense.iter().zip(by_axes).for_each(|(a, b)| close(*a, b));
            }
        }
        let [by_dense, by_product] = [
            solved(&rule, &dense, &Ramp).v,
            solved(&rule, &product, &Ramp).v,
        ];
        let both = by_dense.iter().zip(&by_product);
        both.for_each(|(a, b)| close(*a, *b));
    }
    at::<1, 1>(7);
    at::<2, 1>(5);
    at::<4, 1>(1);
    at::<1, 5>(4);
    at::<2, 6>(3);
    at::<3, 4>(2);
    at::<5, 6>(2);
    // The highest degree.
    at::<1, 8>(2);
    #[cfg(feature = "long")]
    {
        at::<3, 1>(3);
        at::<2, 15>(2);
        at::<3, 35>(2);
        at::<4, 15>(2);
        at::<2, 36>(1);
    }
}

/// An exact solution of degree p is found, and the walks' scores have no variance left but rounding's.
#[test]
fn polynomial_solutions_are_exact() {
    // K = s t² /λ, u = Π t²: of degree 2 along each axis, 2D in all.
    fn at<const D: usize, const B: usize>(exact: bool) {
        let model = model::quadratic(0.6);
        with_degree::<f64, D, _, _, _, B>((model.kernel.0, model.source), 2, |cube, nb, v| {
            let value = Some(Mean::of(v, B));
            let statistics = walked((cube, nb), Mean, value, options(1), 1000);
            let deviation = statistics.preconditioned().std_dev.unwrap();
            assert_eq!(deviation < 1e-13, exact, "D = {D}, B = {B}: {deviation:e}");
        });
    }
    at::<1, 2>(false);
    at::<1, 3>(true);
    at::<1, 5>(true);
    at::<2, 10>(false);
    at::<2, 15>(true);
    at::<3, 35>(false);
}

/// A point, the mean and a weighted mean of model problems: of constants all of them, however walks end.
fn check_means<F: Real, const D: usize, const B: usize>(cells: usize, walks: u64) {
    let x0: [F; D] = core::array::from_fn(|a| F::from_f64(0.9 - 0.13 * a as f64));
    // w = Π (1 + x_a), so that (u, w) is the D-th power of ∫ (1 + t) u(t) dt.
    let weight = |x: &[F; D]| x.iter().fold(F::one(), |w, &x| w * (F::one() + x));
    let w = |x: &[f64; D]| x.iter().fold(1.0, |w, &x| w * (1.0 + x));
    let nodes = fredholm_tests::quadrature::gauss_legendre(64);
    // In five dimensions an error bar takes 15 γ² walks, γ the skewness of what a step brings: 14,000 to 178,000 for the others of the
    // list, and 2,000 at most for these.
    let all = models();
    let numbers = match (B, D) {
        (1, 5) => &[1, 3, 4, 5, 9][..],
        (1, _) => &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9],
        (_, 5) => &[3, 9],
        _ => &[0, 3, 6, 9],
    };
    for &number in numbers {
        let model = all[number];
        let u = |t: f64| ScalarField::value(&model.solution, &[t]);
        let weighted: f64 = nodes.iter().map(|&(t, w)| w * (1.0 + t) * u(t)).sum();
        let equation = (model.kernel.0, model.source);
        with_degree::<F, D, _, _, _, B>(equation, cells, |cube, neighbour, v| {
            let exact_at: F = ScalarField::value(&model.solution, &x0);
            // |v| of a cell is at most Σ_b |v_ib| (2p + 1)^(D/2).
            let largest = v.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()));
            let at = neighbour.value(&neighbour.locate(x0)).to_f64();
            // Fewer points than the degree asks for: the means are only near.
            let rule = CubeRule::new(cube, cube.degree(), 1).unwrap();
            let near = rounded::<F>(&rule.means(&w).unwrap()).unwrap();
            let (both, scores) = (
                (cube, neighbour),
                CubeScores::new(cube, cube.degree()).unwrap(),
            );
            let ways = |&seed| {
                let ways = all_ways(seed).into_iter();
                ways.skip(if B == 1 { 0 } else { 2 })
            };
            for options in seeds().iter().flat_map(ways) {
                let check = |statistics: fredholm_core::Statistics, exact: f64, what: &str| {
                    let floor = rounding_floor::<F>(largest, exact, model.radius_bound::<D>());
                    let outcome = means(&statistics, Some(exact), floor);
                    outcome.ok().unwrap_or_else(|e| {
                        panic!(
                            "{}, D = {D}, B = {B}, {what}, {:e}, {options:?}: {e}",
                            model.name,
                            F::EPSILON
                        )
                    });
                };
                let point = walked(both, At(x0), Some(at), options, walks);
                check(point, exact_at.to_f64(), "point");
                let mean = walked(both, Mean, Some(Mean::of(v, B)), options, walks);
                check(mean, model.mean::<D>(), "mean");
                let part = Weighted::new(weight, scores, &near, v).unwrap();
                let part = walked(both, part, None, options, walks);
                check(part, weighted.powi(D as i32), "weighted mean");
            }
        });
    }
}

/// By day some degrees of every dimension, as the compiler takes longer for each than its walks do; the others with the feature
/// `long`.
#[test]
fn means_are_the_solutions_of_the_model_problems() {
    let few = if long() { 20_000 } else { 5000 };
    check_means::<f64, 1, 1>(32, few);
    check_means::<f64, 2, 1>(8, few);
    check_means::<f64, 3, 1>(4, few);
    check_means::<f64, 5, 1>(3, few);
    check_means::<f32, 1, 1>(32, few);
    check_means::<f32, 3, 1>(4, few);
    check_means::<f32, 5, 1>(3, few);
    of_degrees!(1, [2 4], B => check_means::<f64, 1, B>(8, 5000));
    of_degrees!(1, [2], B => check_means::<f32, 1, B>(8, 5000));
    of_degrees!(2, [1 3], B => check_means::<f64, 2, B>(3, 5000));
    of_degrees!(3, [4], B => check_means::<f64, 3, B>(2, 5000));
    of_degrees!(3, [1], B => check_means::<f32, 3, B>(2, 5000));
    of_degrees!(5, [1], B => check_means::<f64, 5, B>(1, 5000));
    #[cfg(feature = "long")]
    {
        of_degrees!(1, [1 3], B => check_means::<f64, 1, B>(8, 5000));
        of_degrees!(1, [1 3 4], B => check_means::<f32, 1, B>(8, 5000));
        of_degrees!(2, [2 4], B => check_means::<f64, 2, B>(3, 5000));
        of_degrees!(3, [1 2 3], B => check_means::<f64, 3, B>(2, 5000));
        of_degrees!(3, [4], B => check_means::<f32, 3, B>(2, 5000));
        of_degrees!(5, [2], B => check_means::<f64, 5, B>(1, 5000));
    }
}

/// With the means of w ψ_ia the score of a weighted mean varies as little as that of a mean; with zeros it
/// varies like w v.
#[test]
fn a_weighted_mean_varies_no_more_than_a_mean() {
    const B: usize = functions(2, 3);
    let weight = |x: &[f64; 2]| Real::exp(x[0] + x[1]);
    with_degree::<f64, 2, _, _, _, B>((Gauss, Ramp), 6, |cube, neighbour, v| {
        let scores = CubeScores::new(cube, 3).unwrap();
        let deviation = |near: &[f64]| {
            let weighted = Weighted::new(weight, scores, near, v).unwrap();
            let statistics = walked((cube, neighbour), weighted, None, options(1), 5000);
            statistics.preconditioned().std_dev.unwrap()
        };
        let walk_by_walk = deviation(&vec![0.0; v.len()]);
        let near = CubeRule::new(cube, 3, 4).unwrap().means(&weight).unwrap();
        let controlled = deviation(&near);
        println!("{walk_by_walk:.2e} {controlled:.2e}");
        // Order 4 of h = 1/6 is 8e-4, and less with the coefficients of the expansion.
        assert!(
            controlled < 1e-4 * walk_by_walk,
            "{controlled:e} {walk_by_walk:e}"
        );
        let short = Weighted::new(weight, scores, &near[1..], v).err();
        let length = CubeError::Length {
            expected: 360,
            found: 359,
        };
        assert_eq!(short, Some(length));
    });
}

/// ½ exp(−|x − y|²), as the issue has it, λ = ½.
fn plain_and_best<const D: usize, const B: usize>(cells: usize, walks: u64) -> [f64; 2] {
    with_degree::<f64, D, _, _, _, B>((Gauss, Ramp), cells, |cube, neighbour, v| {
        let value = Some(Mean::of(v, B));
        let statistics = walked((cube, neighbour), Mean, value, options(1), walks);
        [statistics.plain(), statistics.preconditioned()].map(|e| e.std_dev.unwrap())
    })
}

/// The slope of the logarithms, of what is above rounding.
fn slope<const D: usize, const B: usize>(per_axis: &[usize], walks: u64) -> f64 {
    let mut points = Vec::new();
    for &m in per_axis {
        let [plain, best] = plain_and_best::<D, B>(m, walks);
        println!("D = {D}, B = {B}, m = {m}: {plain:.3} {best:.3e}");
        points.push(((m.pow(D as u32) as f64).ln(), best.ln()));
    }
    fit::slope(&points)
}

/// √Var of the mean over X falls like n^(−(p+1)/d). The levels are as fine as they must be for the
/// leading order to show, and as coarse as rounding asks: a standard deviation of N walks is within 1/√(2N)
/// of itself, more where scores have heavy tails. Some degrees by day, the others with the feature `long`.
#[test]
fn slopes_are_minus_the_degree_plus_one_over_d() {
    let walks = 4000;
    let check = |d: usize, functions_of_cell: usize, slope: f64| {
        let degree = (0..5).find(|&degree| functions(d, degree) == functions_of_cell);
        let theory = -(degree.unwrap() as f64 + 1.0) / d as f64;
        assert!(
            (slope / theory - 1.0).abs() <= 0.15,
            "d = {d}, degree {degree:?}: {slope} for {theory}"
        );
    };
    of_degrees!(1, [0 2 4], B => check(1, B, slope::<1, B>(&[6, 12, 24], walks)));
    of_degrees!(2, [1 3], B => check(2, B, slope::<2, B>(&[4, 6, 9], walks)));
    of_degrees!(3, [0 4], B => check(3, B, slope::<3, B>(&[2, 3, 5], walks)));
    #[cfg(feature = "long")]
    {
        of_degrees!(1, [1 3], B => check(1, B, slope::<1, B>(&[6, 12, 24], walks)));
        of_degrees!(2, [0 2 4], B => check(2, B, slope::<2, B>(&[4, 6, 9], walks)));
        of_degrees!(3, [1 2 3], B => check(3, B, slope::<3, B>(&[2, 3, 5], walks)));
    }
}

/// λ exp(−|x − y|²) with λ = ½ and F = 1 + Σ x_a: by how much the standard deviation is smaller, root mean
/// square over 100 random points; both estimates at each agree within their errors, and the mean over X
/// with one of another degree.
fn reduction<const D: usize, const B: usize>(cells: usize) -> f64 {
    const POINTS: usize = 100;
    const WALKS: u64 = 1000;
    with_degree::<f64, D, _, _, _, B>((Gauss, Ramp), cells, |cube, neighbour, v| {
        let mut draws = RngUniforms(WalkSeeds::<DefaultGenerator>::new(7, 0).generator(0));
        let largest = v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let mut sums = [0.0; 2];
        for target in 0..POINTS {
            let x: [f64; D] = core::array::from_fn(|_| draws.uniform());
            let value = neighbour.value(&neighbour.locate(x));
            let options = options(1 + target as u64);
            let statistics = walked((cube, neighbour), At(x), Some(value), options, WALKS);
            let floor = rounding_floor::<f64>(largest, value, 0.6);
            // Plain and preconditioned estimates of the same walks, and E η(h,g) = v(x).
            means(&statistics, None, floor).ok().unwrap();
            let both = [statistics.plain(), statistics.preconditioned()];
            for (sum, estimate) in sums.iter_mut().zip(both) {
                *sum += estimate.std_dev.unwrap().powi(2) / POINTS as f64;
            }
        }
        let [plain, best] = sums.map(f64::sqrt);
        println!(
            "d = {D}, degree {}, {} unknowns: plain {plain:.4}, {best:.3e}: {:.3e} times smaller",
            cube.degree(),
            v.len(),
            plain / best
        );
        plain / best
    })
}

#[test]
fn standard_deviations_are_reduced_as_much_as_they_must_be() {
    let two = [
        reduction::<2, { functions(2, 0) }>(31),
        reduction::<2, { functions(2, 3) }>(10),
        reduction::<2, { functions(2, 4) }>(8),
    ];
    let three = [
        reduction::<3, { functions(3, 0) }>(12),
        reduction::<3, { functions(3, 3) }>(4),
        reduction::<3, { functions(3, 4) }>(3),
    ];
    assert!(two[1].max(two[2]) >= 1e5 && two[0] < 1e2, "{two:?}");
    assert!(three[1].max(three[2]) >= 1e4 && three[0] < 1e2, "{three:?}");
}

/// With a fair reference from elsewhere: two degrees that share nothing but the equation agree.
#[test]
fn degrees_agree_with_one_another() {
    fn mean<const D: usize, const B: usize>(cells: usize, seed: u64) -> (f64, f64) {
        with_degree::<f64, D, _, _, _, B>((Gauss, Ramp), cells, |cube, neighbour, v| {
            let value = Some(Mean::of(v, B));
            let statistics = walked((cube, neighbour), Mean, value, options(seed), 20_000);
            let estimate = statistics.preconditioned();
            (estimate.estimate, estimate.std_error.unwrap())
        })
    }
    let all = of_degrees!(2, B => mean::<2, B>(6, B as u64));
    for pair in all.windows(2) {
        let [(a, error_a), (b, error_b)] = [pair[0], pair[1]];
        let allowed = 4.0 * error_a.hypot(error_b) + 1e-14;
        assert!((a - b).abs() <= allowed, "{a} {b}, {:e} {allowed:e}", a - b);
    }
}

/// The spectral radius of T_h²p of kernels of rank 1 by hand, and a K' on one cell that is larger than K.
#[test]
fn an_infinite_variance_of_the_neighbour_is_seen_beforehand() {
    fn radius<const B: usize>(
        factor: impl KernelFactors<f64> + Copy,
        cells: usize,
        points: usize,
    ) -> f64 {
        let cube = Cube::<f64, 1, _, _>::new(Product(factor), Ramp, cells).unwrap();
        let cube = cube.with_functions::<B>();
        let rule = CubeRule::new(&cube, cube.degree(), points).unwrap();
        let tables = rule.product_tables(&factor).unwrap();
        let points = |i| rule.points(i).map(|(x, _)| x);
        second_moment_radius::<_, _, _, B>(&cube, &tables, &ALL, points, |_, _| f64::NAN).unwrap()
    }
    // K = s t: K'_ij = s_i t_j/n in the middles, and the matrix of n K'_ij² has the radius Σ s_i² t_i²/n.
    let kernel = |_: usize, s: f64, t: f64| s * t;
    let expected: f64 = (0..5)
        .map(|i| (0.2 * f64::from(i) + 0.1).powi(4))
        .sum::<f64>()
        / 5.0;
    let found = radius::<1>(kernel, 5, 1);
    assert!(
        (found - expected).abs() < 1e-6 * expected,
        "{found} {expected}"
    );
    // Functions of degree 1 have all of K: s² ∫ t² dt over a cell, and the largest s of two Gauss points.
    let expected: f64 = (0..5)
        .map(|i| {
            let (a, b) = (0.2 * f64::from(i), 0.2 * f64::from(i) + 0.2);
            let s = a + 0.1 * (1.0 + 1.0 / 3.0_f64.sqrt());
            s * s * (b.powi(3) - a.powi(3)) / 3.0
        })
        .sum();
    let found = radius::<2>(kernel, 5, 2);
    assert!(
        (found - expected).abs() < 1e-6 * expected,
        "{found} {expected}"
    );

    // A bump in the middle: ∫K² is 0.03, and K'₁₁ in one middle 1.1.
    let bump = |_: usize, s: f64, t: f64| {
        1.1 * Real::exp(-100.0 * ((s - 0.5) * (s - 0.5) + (t - 0.5) * (t - 0.5)))
    };
    assert!((radius::<1>(bump, 1, 1) - 1.21).abs() < 1e-12);
    assert!(radius::<1>(bump, 1, 5) < 0.3 && radius::<1>(bump, 40, 1) < 0.3);
}

/// In lexicographic order of the degrees along the axes, the last running fastest.
#[test]
fn values_of_the_functions_are_those_of_the_cell() {
    use fredholm_core::Located;
    use fredholm_core::galerkin::Basis;
    let cube = Cube::<f64, 2, _, _>::new(Product(Gauss), Ramp, 4).unwrap();
    let cube = cube.with_functions::<{ functions(2, 2) }>();
    let x = Located {
        point: [0.3, 0.9],
        cell: cube.locate(&[0.3, 0.9]),
    };
    // t = 2 (4 x − i) − 1.
    let (s, t) = (-0.6, 0.2);
    let p2 = |t: f64| 5.0_f64.sqrt() * (1.5 * t * t - 0.5);
    let expected = [
        1.0,
        3.0_f64.sqrt() * t,
        p2(t),
        3.0_f64.sqrt() * s,
        3.0 * s * t,
        p2(s),
    ];
    for (found, expected) in cube.basis(&x).iter().zip(expected) {
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
    }
}
