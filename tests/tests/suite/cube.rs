//! What is special to the cube: quadrature, model problems, the edges of cells, refusals.

use fredholm_core::galerkin::{
    Cells, Dense, GalerkinError, GalerkinMatrix, Solution, collatz_wielandt_bounds,
};
use fredholm_core::{
    At, DefaultGenerator, Estimator, Functional, LastStep, Lights, NoNeighbour, Real, Statistics,
    WalkOptions, WalkSeeds,
};
use fredholm_cube::{
    Cube, CubeError, CubeRule, CubeScores, Mean, Product, ProductTables, ScalarField, Weighted,
};
use fredholm_tests::check::means;
use fredholm_tests::cube::{
    Gauss, OUTSIDE, POINTWISE, Ramp, model, models, walked, with_pointwise, with_smooth,
};
use fredholm_tests::paper;
use fredholm_tests::quadrature::gauss_legendre;

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
