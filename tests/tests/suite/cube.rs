//! What is special to the cube: exact solutions up to five dimensions, tables, rates, refusals.

use fredholm_core::galerkin::{
    Cells, Dense, GalerkinError, GalerkinMatrix, Solution, collatz_wielandt_bounds, rounded,
};
use fredholm_core::{
    At, DefaultGenerator, Estimator, Functional, LastStep, Lights, Neighbour, NoNeighbour, Real,
    Statistics, WalkOptions, WalkSeeds, rounding_floor,
};
use fredholm_cube::model::{self, Model};
use fredholm_cube::{
    Cube, CubeError, CubeRule, CubeScores, Mean, Product, ProductTables, ScalarField, Weighted,
};
use fredholm_tests::check::{long, means, seeds};
use fredholm_tests::cube::{
    ALL, Gauss, OUTSIDE, POINTWISE, Ramp, paper, walked, with_pointwise, with_product, with_smooth,
};
use fredholm_tests::fit;
use fredholm_tests::quadrature::gauss_legendre;

/// Every model problem, with walks of finite variance in one dimension, also at q0 = 0.2.
fn models() -> [Model; 10] {
    [
        model::quadratic(0.6),
        model::rational(0.9),
        model::quartic(2.5, 0.5),
        model::distance(1, 0.75),
        model::green(1.5, 0.25),
        model::cosine(1.0),
        model::steep(0.5),
        model::quadratic(-0.7),
        model::distance(3, -0.4),
        model::cubic(0.45),
    ]
}

/// The point, the mean and a weighted mean of every model problem; both estimators of the paper, and roulette.
fn check_means<F: Real, const D: usize>(cells: usize, walks: u64) {
    let x0 = core::array::from_fn(|a| F::from_f64(0.9 - 0.13 * a as f64));
    // w = Π (1 + x_a), so that (u, w) is the D-th power of ∫ (1 + t) u(t) dt.
    let weight = |x: &[F; D]| x.iter().fold(F::one(), |w, &x| w * (F::one() + x));
    let w = |x: &[f64; D]| x.iter().fold(1.0, |w, &x| w * (1.0 + x));
    let rule = gauss_legendre(64);
    for model in models() {
        let u = |x: &[F; D]| ScalarField::value(&model.solution, x).to_f64();
        let weighted: f64 = rule
            .iter()
            .map(|&(t, w)| w * (1.0 + t) * ScalarField::value(&model.solution, &[t]))
            .sum();
        with_product::<F, D, _, _, _, _>(
            (model.kernel.0, model.source),
            cells,
            ALL,
            |cube, neighbour, v| {
                let largest = v.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()));
                let check = |statistics: Statistics, exact: f64, what: &str| {
                    let floor = rounding_floor::<F>(largest, exact, model.radius_bound::<D>());
                    means(&statistics, Some(exact), floor)
                        .ok()
                        .unwrap_or_else(|e| {
                            panic!("{}, D = {D}, {what}, eps {:e}: {e}", model.name, F::EPSILON)
                        });
                };
                let at = neighbour.value(&neighbour.locate(x0)).to_f64();
                let by_rule = CubeRule::new(cube, 0, 1).unwrap().means(&w).unwrap();
                let near = rounded::<F>(&by_rule).unwrap();
                let scores = CubeScores::new(cube, 0).unwrap();
                let both = (cube, neighbour);
                for &seed in seeds() {
                    let roulette = WalkOptions {
                        seed,
                        ..WalkOptions::default()
                    };
                    // In many dimensions |K| is so small that few walks go on by roulette, too few for an error bar.
                    let estimators = [Estimator::Absorption, Estimator::Collision].into_iter();
                    let all = estimators.map(|estimator| paper(estimator, seed));
                    for options in all.chain((D == 1).then_some(roulette)) {
                        let point = walked(both, At(x0), Some(at), options, walks);
                        check(point, u(&x0), "point");
                        let mean = walked(both, Mean, Some(Mean::of(v, 1)), options, walks);
                        check(mean, model.mean::<D>(), "mean");
                        let weighted_mean = Weighted::new(weight, scores, &near, v).unwrap();
                        let part = walked(both, weighted_mean, None, options, walks);
                        check(part, weighted.powi(D as i32), "weighted mean");
                    }
                }
            },
        );
    }
}

#[test]
fn means_are_the_solutions_of_the_model_problems() {
    check_means::<f64, 1>(32, 20_000);
    check_means::<f64, 2>(8, 20_000);
    check_means::<f64, 3>(4, 20_000);
    let [half, quarter] = if long() { [20_000; 2] } else { [10_000, 5_000] };
    check_means::<f64, 5>(3, half);
    check_means::<f32, 1>(32, 20_000);
    check_means::<f32, 2>(8, 20_000);
    check_means::<f32, 3>(4, quarter);
    check_means::<f32, 5>(3, quarter);
}

#[test]
fn a_kink_on_the_diagonal_wants_it_pointwise() {
    let model = model::distance(1, 0.75);
    let equation = (model.kernel, model.source);
    let deviation = |s: Statistics| {
        means(&s, Some(model.mean::<1>()), 1e-14).ok().unwrap();
        s.preconditioned().std_dev.unwrap()
    };
    let options = paper(Estimator::Collision, 1);
    let with = with_pointwise::<f64, 1, _, _, _, _>(equation, 10, POINTWISE, 0.0, |cube, nb, v| {
        let value = Some(Mean::of(v, 1));
        deviation(walked((cube, nb), Mean, value, options, 50_000))
    });
    let without = with_smooth::<f64, 1, _, _, _, _>(equation, 10, OUTSIDE, 0.0, |cube, nb, v| {
        let value = Some(Mean::of(v, 1));
        deviation(walked((cube, nb), Mean, value, options, 50_000))
    });
    assert!(with < without, "{with} {without}");
}

/// Rules of g points are exact for degree 2g − 1, and not for 2g.
#[test]
fn quadrature_is_exact_for_polynomials() {
    for points in 1..=5_usize {
        for (degree, exact) in [(2 * points - 1, true), (2 * points, false)] {
            let power = degree as i32;
            let kernel =
                move |x: &[f64; 2], y: &[f64; 2]| x[0].powi(power) * y[1].powi(power) + x[1] * y[0];
            let source = move |x: &[f64; 2]| x[1].powi(power);
            let cube = Cube::new(kernel, source, 2).unwrap();
            let rule = CubeRule::new(&cube, 0, points).unwrap();
            let entries = rule.table(&kernel).unwrap();
            // Means of t^degree and of t over the two halves of [0, 1].
            let p = f64::from(power) + 1.0;
            let half = 0.5_f64.powf(p);
            let high = [2.0 * half / p, 2.0 * (1.0 - half) / p];
            let low = [0.25, 0.75];
            let mut worst = 0.0_f64;
            for (e, k) in entries.iter().enumerate() {
                let (i, j) = (e / 4, e % 4);
                let expected = 0.25 * (high[i / 2] * high[j % 2] + low[i % 2] * low[j / 2]);
                worst = worst.max((k - expected).abs());
            }
            for (i, mean) in rule.means(&source).unwrap().iter().enumerate() {
                worst = worst.max((mean - high[i % 2]).abs());
            }
            assert_eq!(
                worst < 1e-15,
                exact,
                "{points} points, degree {degree}: {worst:e}"
            );
        }
    }
}

#[test]
fn images_and_integrals_of_the_models_are_those_of_their_kernels() {
    use fredholm_cube::{FactorIntegral, KernelFactors};
    let rule = gauss_legendre(64);
    for model in models() {
        for s in [0.0_f64, 0.2, 0.5, 0.93, 1.0] {
            let integral = |low: f64, high: f64, u: &dyn Fn(f64) -> f64| -> f64 {
                let kink = s.clamp(low, high);
                let part = |from: f64, to: f64| -> f64 {
                    rule.iter()
                        .map(|&(t, w)| {
                            let t = from + t * (to - from);
                            w * (to - from) * model.kernel.0.factor(0, s, t) * u(t)
                        })
                        .sum()
                };
                part(low, kink) + part(kink, high)
            };
            let u = |t: f64| model.solution.value(&[t]);
            let residual = u(s) - integral(0.0, 1.0, &u) - model.source.value(&[s]);
            assert!(residual.abs() < 1e-8, "{}: {residual:e}", model.name);
            for (low, high) in [(0.0, 1.0), (0.1, 0.3), (0.5, 0.6), (0.9, 1.0)] {
                let found = model.kernel.0.factor_integral(0, s, low, high);
                let expected = integral(low, high, &|_| 1.0);
                assert!(
                    (found - expected).abs() < 1e-15,
                    "{}: {found} {expected}",
                    model.name
                );
            }
        }
    }
}

#[test]
fn cells_are_found_at_their_edges() {
    fn at<F: Real, const D: usize>(cells: usize) {
        let cube = Cube::<F, D, _, _>::new(Product(Gauss), Ramp, cells).unwrap();
        for cell in 0..cube.cells() {
            let (low, high) = cube.cell_box(cell);
            // x m is wrong by ε m, an edge by ε: beyond 2 ε a point is inside.
            let nudge = F::from_f64(2.0 * F::EPSILON.to_f64());
            assert_eq!(cube.locate(&low.map(|x| x + nudge)), cell);
            assert_eq!(cube.locate(&high.map(|x| x - nudge)), cell);
        }
        let last = cube.cells() - 1;
        assert_eq!(cube.locate(&[F::one(); D]), last);
        assert_eq!(cube.locate(&[F::from_f64(1e30); D]), last);
        assert_eq!(cube.locate(&[F::zero(); D]), 0);
        assert_eq!(cube.locate(&[F::from_f64(-1.0); D]), 0);
        assert_eq!(cube.locate(&[F::NAN; D]), 0);
    }
    at::<f64, 1>(1);
    at::<f64, 1>(1000);
    at::<f64, 2>(7);
    at::<f32, 2>(10);
    at::<f64, 3>(5);
    at::<f32, 5>(3);
    // Row-major, the last axis fastest.
    let cube = Cube::<f64, 3, _, _>::new(Product(Gauss), Ramp, 10).unwrap();
    assert_eq!(cube.locate(&[0.15, 0.25, 0.35]), 123);
}

/// √Var of the mean over X with a smooth kernel falls like n^(−1/d).
#[test]
fn the_standard_deviation_falls_like_n_to_the_minus_one_over_d() {
    fn slope<const D: usize>(per_axis: &[usize]) -> f64 {
        let points: Vec<(f64, f64)> = per_axis
            .iter()
            .map(|&m| {
                let equation = (Gauss, Ramp);
                with_product::<f64, D, _, _, _, _>(equation, m, ALL, |cube, neighbour, v| {
                    let value = Some(Mean::of(v, 1));
                    let options = paper(Estimator::Absorption, 1);
                    let statistics = walked((cube, neighbour), Mean, value, options, 100_000);
                    let [plain, best] = [statistics.plain(), statistics.preconditioned()]
                        .map(|e| e.std_dev.unwrap());
                    println!("D = {D}, m = {m}: {plain:.3} {best:.3e}");
                    ((v.len() as f64).ln(), best.ln())
                })
            })
            .collect();
        fit::slope(&points)
    }
    let slopes = [
        slope::<1>(&[10, 20, 40, 80, 160]),
        slope::<2>(&[5, 10, 20, 40]),
        slope::<3>(&[4, 6, 10, 16]),
    ];
    println!("slopes {slopes:.3?}");
    for (d, slope) in slopes.iter().enumerate() {
        let theory = -1.0 / (d as f64 + 1.0);
        assert!(
            (slope / theory - 1.0).abs() <= 0.15,
            "d = {}: {slope}",
            d + 1
        );
    }
}

/// The spectral radius of T_(k²p) over 1 − q0 is below 1 or not as the documentation of `steep` says.
#[test]
fn an_infinite_variance_is_seen_beforehand() {
    let radius = |lambda| {
        let model = model::steep(lambda);
        let square = |x: &[f64; 1], y: &[f64; 1]| {
            let k: f64 = fredholm_cube::KernelFn::kernel(&model.kernel, x, y);
            k * k
        };
        let cube = Cube::new(square, model.source, 50).unwrap();
        let squares = CubeRule::new(&cube, 0, 3).unwrap().table(&square).unwrap();
        let dense = Dense::new(&squares, 50, 1).unwrap();
        let (mut w, mut next) = (vec![1.0; 50], vec![0.0; 50]);
        let mut apply = |w: &[f64], out: &mut [f64]| dense.apply_absolute(w, out);
        collatz_wielandt_bounds(&mut apply, &mut w, &mut next, 100)[1]
    };
    // 1/(11 λ²).
    assert!((radius(1.0 / 3.0) - 9.0 / 11.0).abs() < 0.01);
    assert!(radius(1.0 / 3.0) / 0.8 > 1.0 && radius(1.0 / 3.0) / 0.9 < 1.0);
    assert!((radius(0.5) - 4.0 / 11.0).abs() < 0.01);
}

#[test]
fn refusals() {
    fn cube<F: Real, const D: usize>(cells: usize) -> Option<CubeError> {
        Cube::<F, D, _, _>::new(Product(Gauss), Ramp, cells).err()
    }
    assert_eq!(cube::<f64, 1>(0), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 2>(65_536), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 2>(65_535), None);
    assert_eq!(cube::<f64, 8>(17), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 1>(usize::MAX), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 1>((1 << 24) + 1), None);
    assert_eq!(cube::<f32, 1>((1 << 24) + 1), Some(CubeError::Cells));

    // A table that no machine has: an error before anything is evaluated.
    let large = Cube::<f64, 2, _, _>::new(Product(Gauss), Ramp, 65_535).unwrap();
    let rule = CubeRule::new(&large, 0, 1).unwrap();
    let error = rule.table(&Product(Gauss)).unwrap_err();
    let memory = CubeError::Galerkin(GalerkinError::Memory { bytes: None });
    assert_eq!(error, memory);
    let narrow = ProductTables::<&[f64], 2>::new(3, 0, &[0.0; 17]).unwrap_err();
    let length = |expected, found| CubeError::Length { expected, found };
    assert_eq!(narrow, length(18, 17));

    let hole = |x: &[f64; 1], y: &[f64; 1]| {
        if x[0] < 0.25 && y[0] > 0.75 {
            f64::NAN
        } else {
            0.1
        }
    };
    let source = |x: &[f64; 1]| 1.0 / (x[0] - 0.625).abs();
    let cube = Cube::new(hole, source, 4).unwrap();
    let of = |degree, points| CubeRule::new(&cube, degree, points);
    assert_eq!(of(0, 0).err(), Some(CubeError::Points));
    assert_eq!(of(8, 1).err(), Some(CubeError::Points));
    let rule = of(0, 1).unwrap();
    let nowhere = CubeError::Kernel { row: 0, column: 3 };
    assert_eq!(rule.table(&hole), Err(nowhere));
    assert_eq!(rule.means(&source), Err(CubeError::Source { row: 2 }));
    let mut out = [0.0; 4];
    let short = rule.fill_row(&hole, 0, &mut out[..3]);
    assert_eq!(short, Err(length(4, 3)));
    let beyond = rule.fill_row(&hole, 4, &mut out);
    assert_eq!(beyond, Err(CubeError::Cell { cell: 4 }));

    // ∫|K| grows to 5/3, and the spectral radius is 5/4.
    let model = model::quadratic(0.2);
    let cube = Cube::<f64, 1, _, _>::new(model.kernel, model.source, 10).unwrap();
    let rule = CubeRule::new(&cube, 0, 1).unwrap();
    let tables = rule.product_tables(&model.kernel.0).unwrap();
    let means = rule.means(&model.source).unwrap();
    let error = Solution::new(&tables, means, 1e-14, 100).unwrap_err();
    assert_eq!(error, GalerkinError::Radius);
}

#[test]
fn means_start_uniformly() {
    // First moments are ½, within four standard errors.
    let cube = Cube::<f64, 3, _, _>::new(Product(Gauss), Ramp, 2).unwrap();
    let seeds = WalkSeeds::<DefaultGenerator>::new(4, 0);
    let mut sums = [0.0; 3];
    for walk in 0..10_000 {
        let mut draws = fredholm_core::RngUniforms(seeds.generator(walk));
        let start = Mean.start(&cube, &mut draws);
        assert_eq!((start.phi, start.known), (1.0, 0.0));
        assert!(cube.locate(&start.point) < 8);
        let moments = sums.iter_mut().zip(start.point);
        moments.for_each(|(sum, x)| *sum += x - 0.5);
    }
    assert!(
        sums.iter()
            .all(|sum| sum.abs() < 4.0 * (10_000.0_f64 / 12.0).sqrt())
    );
}

/// With a last step F is scored by none that meets it, and known to every start.
#[test]
fn a_last_step_finds_the_source() {
    // u = ½ x c + F with c = ∫ y u dy = c/6 + 0.045 for F = 1 below 0.3, so that c = 0.054 and the mean 0.3 + 0.0135.
    let kernel = |x: &[f64; 1], y: &[f64; 1]| 0.5 * x[0] * y[0];
    let source = |x: &[f64; 1]| f64::from(u8::from(x[0] < 0.3));
    let cube = Cube::<f64, 1, _, _>::new(kernel, source, 4).unwrap();
    let equation = LastStep(&cube);
    assert_eq!((cube.known(&[0.2]), cube.rest(&[0.2])), (1.0, 0.0));
    let none = NoNeighbour::new(&equation);
    let deviation = |statistics: Statistics, exact: f64| {
        means(&statistics, Some(exact), 1e-14).ok().unwrap();
        statistics.plain().std_dev.unwrap()
    };
    let options = WalkOptions::default();
    let mean = walked((&equation, &none), Mean, Some(0.0), options, 20_000);
    deviation(mean, 0.3135);
    // w = x: ∫ x F + ½ c ∫ x² = 0.045 + 0.009.
    let scores = CubeScores::new(&cube, 0).unwrap();
    let weighted = Weighted::new(|x: &[f64; 1]| x[0], scores, &[0.0; 4], &[0.0; 4]).unwrap();
    let weighted = walked((&equation, &none), weighted, None, options, 20_000);
    deviation(weighted, 0.054);
    // At x = 0.9, where F is 0, walks for u score where they meet F, and those with a last step everywhere.
    let last = walked((&equation, &none), At([0.9]), Some(0.0), options, 20_000);
    let none = NoNeighbour::new(&cube);
    let plain = walked((&cube, &none), At([0.9]), Some(0.0), options, 20_000);
    let [last, plain] = [last, plain].map(|statistics| deviation(statistics, 0.0243));
    assert!(last < plain, "{last} {plain}");
}

#[test]
fn a_weighted_mean_varies_no_more_than_a_mean() {
    let model = model::rational(0.9);
    let weight = |x: &[f64; 1]| 1.0 + x[0];
    let deviation = with_product::<f64, 1, _, _, _, _>(
        (model.kernel.0, model.source),
        32,
        ALL,
        |cube, neighbour, v| {
            // Without means φ v is scored walk by walk, and its variance stays.
            let of = |means: &[f64]| {
                let scores = CubeScores::new(cube, 0).unwrap();
                let weighted = Weighted::new(weight, scores, means, v).unwrap();
                let options = paper(Estimator::Collision, 1);
                let statistics = walked((cube, neighbour), weighted, None, options, 20_000);
                statistics.preconditioned().std_dev.unwrap()
            };
            let means = CubeRule::new(cube, 0, 1).unwrap().means(&weight).unwrap();
            [of(&means), of(&[0.0; 32])]
        },
    );
    // ∫ w u has a part of size h = 1/32 left, the walk-by-walk score one of size 1.
    assert!(deviation[0] < 0.1 * deviation[1], "{deviation:?}");
}
