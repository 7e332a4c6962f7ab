//! What is special to the cube: exact solutions up to five dimensions, tables, rates, refusals.

use fredholm_core::galerkin::{Dense, GalerkinError, GalerkinMatrix, Partition, Solution, rounded};
use fredholm_core::{
    At, DefaultGenerator, Estimator, Form, Functional, Length, Neighbour, Real, Task, WalkSeeds,
    rounding_floor,
};
use fredholm_cube::model::{self, Model};
use fredholm_cube::{
    Cube, CubeError, Mean, Product, ProductTables, Rule, Weighted, absolute_radius, table,
    table_bytes,
};
use fredholm_tests::check::{long, means, seeds};
use fredholm_tests::cube::{
    ABSORPTION, ALL, Gauss, OUTSIDE, POINTWISE, Ramp, with_pointwise, with_product, with_smooth,
};
use fredholm_tests::quadrature::gauss_legendre;
use fredholm_tests::{fit, run};

/// Every model problem, with walks of finite variance at q0 = 0.2 in one dimension.
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

fn task<'a, E, N, T>(
    equation: &'a E,
    neighbour: &'a N,
    functional: &'a T,
    control_mean: Option<f64>,
    estimator: Estimator,
    seeds: WalkSeeds,
) -> Task<'a, E, N, T, DefaultGenerator> {
    Task {
        equation,
        neighbour,
        functional,
        control_mean,
        estimator,
        form: Form::Product,
        seeds,
        length: Length::default(),
    }
}

/// The point, the mean and a weighted mean of every model problem; both estimators.
fn check_means<F: Real, const D: usize>(cells: usize, walks: u64) {
    let x0 = core::array::from_fn(|a| F::from_f64(0.9 - 0.13 * a as f64));
    // w = Π (1 + x_a), so that (u, w) is the D-th power of ∫ (1 + t) u(t) dt.
    let weight = |x: &[F; D]| x.iter().fold(F::one(), |w, &x| w * (F::one() + x));
    let w = |x: &[f64; D]| x.iter().fold(1.0, |w, &x| w * (1.0 + x));
    let rule = gauss_legendre(64);
    for model in models() {
        let u = |x: &[F; D]| fredholm_cube::ScalarField::value(&model.solution, x).to_f64();
        let weighted: f64 = rule
            .iter()
            .map(|&(t, w)| w * (1.0 + t) * fredholm_cube::ScalarField::value(&model.solution, &[t]))
            .sum();
        with_product::<F, D, _, _, _, _>(
            (model.kernel.0, model.source),
            cells,
            ALL,
            |cube, neighbour, v| {
                let largest = v.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()));
                let check = |statistics: fredholm_core::Statistics, exact: f64, what: &str| {
                    let floor = rounding_floor::<F>(largest, exact, model.radius_bound::<D>());
                    means(&statistics, Some(exact), floor)
                        .ok()
                        .unwrap_or_else(|e| {
                            panic!("{}, D = {D}, {what}, eps {:e}: {e}", model.name, F::EPSILON)
                        });
                };
                let at = neighbour.value(&neighbour.locate(x0)).to_f64();
                let wide =
                    Cube::<f64, D, _, _>::new(model.kernel, model.source, cells, 0.5).unwrap();
                let mut by_rule = vec![0.0; cells.pow(D as u32)];
                wide.means(&w, Rule::new(1).unwrap(), &mut by_rule).unwrap();
                let means_of_weight = rounded::<F>(&by_rule).unwrap();
                for estimator in [Estimator::Absorption, Estimator::Collision] {
                    for &seed in seeds() {
                        let seeds = |target| WalkSeeds::new(seed, target);
                        let start = At(x0);
                        let point = task(cube, neighbour, &start, Some(at), estimator, seeds(0));
                        check(run(&point, walks), u(&x0), "point");
                        let all = Some(Mean::of(v));
                        let mean = task(cube, neighbour, &Mean, all, estimator, seeds(1));
                        check(run(&mean, walks), model.mean::<D>(), "mean");
                        let weight = Weighted::new(cube, weight, &means_of_weight, v).unwrap();
                        let part = task(cube, neighbour, &weight, None, estimator, seeds(2));
                        check(run(&part, walks), weighted.powi(D as i32), "weighted mean");
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
    let walks = 50_000;
    let deviation = |s: fredholm_core::Statistics| {
        means(&s, Some(model.mean::<1>()), 1e-14).ok().unwrap();
        s.preconditioned().std_dev.unwrap()
    };
    let with = with_pointwise::<f64, 1, _, _, _, _>(equation, 10, POINTWISE, 0.0, |cube, nb, v| {
        let estimator = Estimator::Collision;
        let value = Some(Mean::of(v));
        deviation(run(
            &task(cube, nb, &Mean, value, estimator, WalkSeeds::new(1, 0)),
            walks,
        ))
    });
    let without = with_smooth::<f64, 1, _, _, _, _>(equation, 10, OUTSIDE, 0.0, |cube, nb, v| {
        let estimator = Estimator::Collision;
        let value = Some(Mean::of(v));
        deviation(run(
            &task(cube, nb, &Mean, value, estimator, WalkSeeds::new(1, 0)),
            walks,
        ))
    });
    assert!(with < without, "{with} {without}");
}

#[test]
fn product_tables_are_dense_tables() {
    fn at<const D: usize>(cells: usize) {
        let rule = Rule::new(3).unwrap();
        let cube = Cube::<f64, D, _, _>::new(Product(Gauss), Ramp, cells, ABSORPTION).unwrap();
        let entries = table(&cube, rule).unwrap();
        let n = cube.cells();
        assert_eq!(Some(8 * entries.len()), table_bytes(n));
        let dense = Dense::new(&entries, n, 1).unwrap();
        let product = ProductTables::new(&cube, rule).unwrap();
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-14 * b.abs().max(1e-3), "{a} {b}");
        let v: Vec<f64> = (0..n).map(|i| ((i * 37) % 11) as f64 / 11.0).collect();
        let (mut left, mut right) = (vec![0.0; n], vec![0.0; n]);
        dense.apply(&v, &mut left);
        product.apply(&v, &mut right);
        for i in 0..n {
            close(right[i], left[i]);
            close(product.row_sum(i), dense.row_sum(i));
            for j in 0..n {
                close(product.mean(i, j), dense.mean(i, j));
            }
        }
        let solve = |v: Solution| v.v;
        let by_dense = solve(cube.solve(&dense, rule, 1e-15, 1000).unwrap());
        let by_product = solve(cube.solve(&product, rule, 1e-15, 1000).unwrap());
        for (a, b) in by_dense.iter().zip(&by_product) {
            close(*a, *b);
        }
        let radius = absolute_radius(&dense).unwrap();
        let by_axes = product.absolute_radius().unwrap();
        assert!(
            (by_axes - radius).abs() <= 2e-6 * radius,
            "{by_axes} {radius}"
        );
        let of_all = absolute_radius(&product).unwrap();
        assert!(
            (of_all - radius).abs() <= 2e-6 * radius,
            "{of_all} {radius}"
        );
    }
    at::<1>(7);
    at::<2>(5);
    at::<3>(3);
    at::<4>(1);
}

/// Rules of g points are exact for degree 2g − 1, and not for 2g.
#[test]
fn quadrature_is_exact_for_polynomials() {
    for points in 1..=5_usize {
        let rule = Rule::new(points).unwrap();
        for (degree, exact) in [(2 * points - 1, true), (2 * points, false)] {
            let power = degree as i32;
            let kernel =
                move |x: &[f64; 2], y: &[f64; 2]| x[0].powi(power) * y[1].powi(power) + x[1] * y[0];
            let source = move |x: &[f64; 2]| x[1].powi(power);
            let cube = Cube::new(kernel, source, 2, ABSORPTION).unwrap();
            let entries = table(&cube, rule).unwrap();
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
            let mut means = [0.0; 4];
            cube.source_means(rule, &mut means).unwrap();
            for (i, mean) in means.iter().enumerate() {
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
    use fredholm_cube::{FactorIntegral, KernelFactors, ScalarField};
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
        let cube = Cube::<F, D, _, _>::new(Product(Gauss), Ramp, cells, ABSORPTION).unwrap();
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
    let cube = Cube::<f64, 3, _, _>::new(Product(Gauss), Ramp, 10, ABSORPTION).unwrap();
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
                    let value = Some(Mean::of(v));
                    let estimator = Estimator::Absorption;
                    let task = task(
                        cube,
                        neighbour,
                        &Mean,
                        value,
                        estimator,
                        WalkSeeds::new(1, 0),
                    );
                    let statistics = run(&task, 100_000);
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

#[test]
fn an_infinite_variance_is_seen_beforehand() {
    let rule = Rule::new(3).unwrap();
    let radius = |lambda, absorption| {
        let model = model::steep(lambda);
        let cube = Cube::<f64, 1, _, _>::new(model.kernel, model.source, 50, absorption).unwrap();
        let tables = ProductTables::new(&cube, rule).unwrap();
        cube.solve(&tables, rule, 1e-14, 1000).unwrap();
        let square = |x: &[f64; 1], y: &[f64; 1]| {
            let k: f64 = fredholm_cube::KernelFn::kernel(&model.kernel, x, y);
            k * k
        };
        let cube = Cube::new(square, model.source, 50, absorption).unwrap();
        let squares = table(&cube, rule).unwrap();
        let dense = Dense::new(&squares, 50, 1).unwrap();
        absolute_radius(&dense).unwrap() / (1.0 - absorption)
    };
    // 1/(11 λ² (1 − q0)).
    assert!((radius(1.0 / 3.0, 0.2) - 9.0 / 8.8).abs() < 0.01);
    assert!(radius(1.0 / 3.0, 0.2) > 1.0);
    assert!(radius(1.0 / 3.0, 0.1) < 1.0);
    assert!((radius(0.5, 0.2) - 4.0 / 8.8).abs() < 0.01);
}

#[test]
fn refusals() {
    fn cube<F: Real, const D: usize>(cells: usize, absorption: f64) -> Option<CubeError> {
        Cube::<F, D, _, _>::new(Product(Gauss), Ramp, cells, absorption).err()
    }
    for absorption in [0.0, 1.0, -0.1, f64::NAN, f64::INFINITY] {
        assert_eq!(cube::<f64, 1>(5, absorption), Some(CubeError::Absorption));
    }
    // What is no probability strictly between 0 and 1 in the walk's scalar.
    assert_eq!(cube::<f32, 1>(5, 1.0 - 1e-12), Some(CubeError::Absorption));
    assert_eq!(cube::<f64, 1>(0, 0.2), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 2>(65_536, 0.2), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 2>(65_535, 0.2), None);
    assert_eq!(cube::<f64, 8>(17, 0.2), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 1>(usize::MAX, 0.2), Some(CubeError::Cells));
    assert_eq!(cube::<f64, 1>((1 << 24) + 1, 0.2), None);
    assert_eq!(cube::<f32, 1>((1 << 24) + 1, 0.2), Some(CubeError::Cells));
    assert_eq!(Rule::new(0), Err(CubeError::Points));
    assert_eq!(Rule::new(6), Err(CubeError::Points));
    assert_eq!(table_bytes(1000), Some(8_000_000));
    assert_eq!(table_bytes(usize::MAX), None);

    // A table that no machine has: an error before anything is evaluated.
    let one = Rule::new(1).unwrap();
    let large = Cube::<f64, 2, _, _>::new(Product(Gauss), Ramp, 65_535, 0.2).unwrap();
    let error = table(&large, one).unwrap_err();
    assert!(matches!(error, CubeError::Memory { .. }), "{error}");

    let hole = |x: &[f64; 1], y: &[f64; 1]| {
        if x[0] < 0.25 && y[0] > 0.75 {
            f64::NAN
        } else {
            0.1
        }
    };
    let source = |x: &[f64; 1]| 1.0 / (x[0] - 0.625).abs();
    let cube = Cube::new(hole, source, 4, 0.2).unwrap();
    assert_eq!(
        table(&cube, one),
        Err(CubeError::Kernel { row: 0, column: 3 })
    );
    let mut out = [0.0; 4];
    assert_eq!(
        cube.source_means(one, &mut out),
        Err(CubeError::Source { row: 2 })
    );
    let length = CubeError::Length {
        expected: 4,
        found: 3,
    };
    assert_eq!(cube.source_means(one, &mut out[..3]), Err(length));
    assert_eq!(cube.fill_row(one, 0, &mut out[..3]), Err(length));
    assert_eq!(
        cube.fill_row(one, 4, &mut out),
        Err(CubeError::Cell { cell: 4 })
    );

    // ∫|K| grows to 5/3, and the spectral radius is 5/4.
    let model = model::quadratic(0.2);
    let cube = Cube::<f64, 1, _, _>::new(model.kernel, model.source, 10, 0.2).unwrap();
    let tables = ProductTables::new(&cube, one).unwrap();
    let error = cube.solve(&tables, one, 1e-14, 100).unwrap_err();
    assert_eq!(error, CubeError::Galerkin(GalerkinError::Radius));
}

#[test]
fn a_functional_needs_no_more_than_the_space() {
    // Starts are uniform: their first moments are ½, within four standard errors.
    let cube = Cube::<f64, 3, _, _>::new(Product(Gauss), Ramp, 2, 0.2).unwrap();
    let seeds = WalkSeeds::<DefaultGenerator>::new(4, 0);
    let mut sums = [0.0; 3];
    for walk in 0..10_000 {
        let mut draws = fredholm_core::RngUniforms(seeds.generator(walk));
        let (x, phi) = Functional::<Cube<f64, 3, Product<Gauss>, Ramp>>::start(&Mean, &mut draws);
        assert_eq!(phi, 1.0);
        assert!(cube.locate(&x) < 8);
        sums.iter_mut().zip(x).for_each(|(sum, x)| *sum += x - 0.5);
    }
    assert!(
        sums.iter()
            .all(|sum| sum.abs() < 4.0 * (10_000.0_f64 / 12.0).sqrt())
    );
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
            let mut means = vec![0.0; 32];
            // Without means φ v is scored walk by walk, and its variance stays.
            let of = |means: &[f64]| {
                let weighted = Weighted::new(cube, weight, means, v).unwrap();
                let seeds = WalkSeeds::new(1, 0);
                let task = task(
                    cube,
                    neighbour,
                    &weighted,
                    None,
                    Estimator::Collision,
                    seeds,
                );
                run(&task, 20_000).preconditioned().std_dev.unwrap()
            };
            let walk_by_walk = of(&means);
            cube.means(&weight, Rule::new(1).unwrap(), &mut means)
                .unwrap();
            [of(&means), walk_by_walk]
        },
    );
    // ∫ w u has a part of size h = 1/32 left, the walk-by-walk score one of size 1.
    assert!(deviation[0] < 0.1 * deviation[1], "{deviation:?}");
}
