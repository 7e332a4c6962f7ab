//! The quantities of a variance analysis against their definitions, infinite variances, and weights.

use fredholm_core::galerkin::{Dense, PairKind, Pairs, Piecewise, neighbour_source};
use fredholm_core::{Absorption, Estimator, Form, Goal, Neighbour};
use fredholm_cube::{Cube, CubeRule, CubeScores, Weighted};
use fredholm_tests::cube::model;
use fredholm_tests::cube::{ALL, with_degree};
use fredholm_tests::{paper, run};
use fredholm_variance::{
    Analysis, Density, MeanCoefficients, Start, VarianceSetup, pair_quantities, serially,
};

/// K(x,y) = ½ exp(xy) on [0, 1] with two cells and F = 1 + x: every quantity of sections 3 and 4 against sums over 1000 points
/// of what the definitions say, with h written out by (44).
#[test]
fn quantities_are_those_of_their_definitions() {
    const N: usize = 1000;
    let q = 0.25;
    let kernel = |x: &[f64; 1], y: &[f64; 1]| 0.5 * (x[0] * y[0]).exp();
    let source = |x: &[f64; 1]| 1.0 + x[0];
    let cube = Cube::<f64, 1, _, _>::new(kernel, source, 2).unwrap();
    // Coefficients that are off, so that k̄ and k̄' differ.
    let entries = [0.27, 0.29, 0.31, 0.45];
    let dense = Dense::new(&entries, 2, 1).unwrap();
    // The pair (1, 0) is left out.
    let pairs = Without;
    let v = [2.6, 3.4];
    let mut g = [0.0; 2];
    neighbour_source(&dense, &pairs, &v, &mut g).unwrap();
    let neighbour = Piecewise::new(&cube, &dense, pairs, &v, &g).unwrap();
    let quadrature = CubeRule::sites(&cube, 0, 400).unwrap();
    let setting = VarianceSetup {
        equation: &cube,
        neighbour: &neighbour,
        pairs,
        quadrature: &quadrature,
        absorption: Absorption::Constant {
            probability: q,
            estimator: Estimator::Absorption,
        },
    };
    let density = |_: &_| Density::uniform(1.0);
    let starts = [Start::Density(&density)];
    let model = setting.with_starts(&starts).unwrap();
    let analysis = Analysis::new(&model, Estimator::Absorption, Form::Product, &serially).unwrap();
    let quantities = analysis.quantities().unwrap();

    let p = 1.0 - q;
    let at = |i: usize| (i as f64 + 0.5) / N as f64;
    let cell = |x: f64| usize::from(x >= 0.5);
    let k = |x: f64, y: f64| 0.5 * (x * y).exp() / p;
    let h = |x: f64, y: f64| match (cell(x), cell(y)) {
        (1, 0) => 0.0,
        (i, j) => entries[2 * i + j] / (p / 2.0),
    };
    let f = |x: f64| (1.0 + x) / q;
    let own_g = [
        v[0] - entries[0] * v[0] - entries[1] * v[1],
        v[1] - entries[3] * v[1],
    ];
    let dx = 1.0 / N as f64;
    let (mut delta, mut square, mut sigma, mut alpha, mut most) =
        (0.0_f64, 0.0_f64, 0.0, 0.0_f64, 0.0_f64);
    let (mut rho, mut tau, mut theta, mut residual) = (0.0_f64, 0.0, 0.0_f64, 0.0_f64);
    for i in 0..N {
        let x = at(i);
        let (mut one, mut two) = (0.0, 0.0);
        for j in 0..N {
            let (k, h) = (k(x, at(j)), h(x, at(j)));
            one += (k - h).abs() * p * dx;
            two += (k - h) * (k - h) * p * dx;
            alpha = alpha.max(k.abs()).max(h.abs());
            most = most.max((k - h).abs());
        }
        delta = delta.max(one);
        square = square.max(two);
        sigma += two * dx;
        let (f, g) = (f(x), own_g[cell(x)] / q);
        rho = rho.max((f - g) * (f - g) * q);
        tau += (f - g) * (f - g) * q * dx;
        theta = theta.max(f * f * q).max(g * g * q);
        residual = residual.max((f - g).abs());
    }
    // Suprema over points that lie 1/2000 or less from where they are taken.
    let close = |found: f64, expected: f64, what: &str| {
        assert!(
            (found / expected - 1.0).abs() < 5e-3,
            "{what}: {found}, {expected} by quadrature"
        );
    };
    close(quantities.delta, delta, "delta");
    close(quantities.epsilon, square.sqrt(), "epsilon");
    close(quantities.sigma, sigma.sqrt(), "sigma");
    close(quantities.rho, rho.sqrt(), "rho");
    close(quantities.tau, tau.sqrt(), "tau");
    close(quantities.theta, theta, "theta");
    close(quantities.alpha, alpha, "alpha");
    close(quantities.suprema[0], most, "sup |k - h|");
    close(quantities.suprema[1], residual, "sup |f - g|");
    // ∫ p dx = p, for a density that is constant.
    close(quantities.c_p, p, "c_p");

    // T_k²p and T_h²p as matrices on 400 points: their powers and resolvents by hand.
    let m = 400;
    let at = |i: usize| (i as f64 + 0.5) / m as f64;
    let apply = |kernel: &dyn Fn(f64, f64) -> f64, w: &[f64]| -> Vec<f64> {
        (0..m)
            .map(|i| {
                (0..m)
                    .map(|j| kernel(at(i), at(j)) * p * w[j] / m as f64)
                    .sum()
            })
            .collect()
    };
    let kk = |x: f64, y: f64| k(x, y) * k(x, y);
    let hh = |x: f64, y: f64| h(x, y) * h(x, y);
    let sup = |w: &[f64]| w.iter().copied().fold(0.0, f64::max);
    let (mut a, mut b) = (vec![1.0; m], vec![1.0; m]);
    let (mut best, mut sum, mut power) = (f64::INFINITY, 0.0, 1.0);
    for n0 in 1..30 {
        (a, b) = (apply(&kk, &a), apply(&hh, &b));
        sum += power;
        power *= alpha * alpha;
        let gamma = sup(&a).max(sup(&b));
        if gamma < 1.0 && sum / (1.0 - gamma) < best {
            best = sum / (1.0 - gamma);
            assert!(quantities.power.unwrap().exponent >= n0);
        }
    }
    // Σ α^2j/(1 − γ) is more sensitive than what it is made of.
    assert!(
        (quantities.beta_0.unwrap() / best - 1.0).abs() < 0.02,
        "beta_0"
    );
    // Σ of the powers of the adjoint of 1.
    let resolvent = |kernel: &dyn Fn(f64, f64) -> f64| {
        let (mut term, mut sum) = (vec![1.0; m], vec![0.0; m]);
        for _ in 0..200 {
            sum.iter_mut()
                .zip(&term)
                .for_each(|(sum, term)| *sum += term);
            term = apply(&|y, x| kernel(x, y), &term);
        }
        sup(&sum)
    };
    close(
        quantities.beta.unwrap(),
        resolvent(&kk).max(resolvent(&hh)),
        "beta",
    );

    // Section 4.
    let mut all = Vec::new();
    let coefficients = MeanCoefficients {
        cells: 2,
        mean: &|i, j| entries[2 * i + j],
    };
    pair_quantities(&model, coefficients, &mut |pair| all.push(pair)).unwrap();
    assert_eq!(all.len(), 4);
    let mut bound = 0.0;
    for pair in all {
        let [i, j] = pair.cells;
        let points =
            |c: usize| (0..200).map(move |l| 0.5 * (c as f64 + (f64::from(l) + 0.5) / 200.0));
        let values = || points(i).flat_map(|x| points(j).map(move |y| k(x, y)));
        let mean = values().sum::<f64>() / 40_000.0;
        let far = values().fold(0.0, |m: f64, k| m.max((k - mean).abs()));
        assert_eq!(pair.in_s, (i, j) != (1, 0));
        close(pair.mean_mass, p / 2.0, "the mean of p_j");
        close(pair.total_mass, p / 4.0, "pi");
        close(pair.mean_kernel, mean, "the mean of k");
        close(pair.coefficient, entries[2 * i + j] / (p / 2.0), "K'/p");
        // At the corners of cells, between the outermost nodes and which k varies by 0.3 % of κ.
        assert!(
            (pair.kappa / far - 1.0).abs() < 0.02,
            "kappa {} {far}",
            pair.kappa
        );
        // p_j is constant.
        assert!((pair.r - 1.0).abs() < 1e-12 && pair.lambda < 1e-12);
        let off = mean - pair.coefficient;
        let expected = if pair.in_s {
            3.0 * (far * far + off * off) * p / 4.0
        } else {
            quantities.alpha * quantities.alpha * p / 4.0
        };
        bound += pair.proposition_6(quantities.alpha);
        assert!((pair.proposition_6(quantities.alpha) / expected - 1.0).abs() < 0.03);
        assert!(pair.supremum() >= far * 0.98);
    }
    assert!(bound > quantities.sigma * quantities.sigma);

    // The bounds of a mean, by the formulas of the proofs.
    let prediction = analysis.predict(0).unwrap();
    let bounds = quantities.bounds(&prediction);
    // β0 stands in them up to the third power.
    let (a, t) = (alpha, theta);
    let three =
        2.0 * (best * best * t * (square + 2.0 * a * a * best * delta * delta) + best * rho);
    let near = |found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
    };
    near(bounds.theorem_3.unwrap(), three);
    let beta = quantities.beta.unwrap();
    let first = beta * best * t * (1.0 + 2.0 * a * a * (p * beta * best).sqrt()) * sigma;
    near(bounds.theorem_5.unwrap(), 2.0 * (first + beta * tau));
    let f = 2.0 / q;
    let four =
        best * best * f * f * most * most * (1.0 + 2.0 * a * a * best) + best * residual * residual;
    near(bounds.corollary_4.unwrap(), 2.0 * four);
}

/// All pairs in S but (1, 0).
#[derive(Clone, Copy)]
struct Without;

impl Pairs for Without {
    fn kind(&self, i: usize, j: usize) -> PairKind {
        if (i, j) == (1, 0) {
            PairKind::Dropped
        } else {
            PairKind::Galerkin
        }
    }
}

/// K(x,y) = s t⁴/λ with λ = 1/3: the means exist, the variances do not.
#[test]
fn infinite_variances_are_none() {
    let model = model::steep(1.0 / 3.0);
    with_degree::<f64, 1, _, _, _, 1>((model.kernel.0, model.source), 20, |cube, neighbour, _| {
        let quadrature = CubeRule::sites(cube, 0, 200).unwrap();
        let setting = VarianceSetup {
            equation: cube,
            neighbour,
            pairs: ALL,
            quadrature: &quadrature,
            absorption: paper(Estimator::Absorption, 1).absorption,
        };
        let starts = [Start::At([0.5])];
        let model = setting.with_starts(&starts).unwrap();
        let analysis =
            Analysis::new(&model, Estimator::Absorption, Form::Product, &serially).unwrap();
        assert_eq!(analysis.kernel_power, None);
        let prediction = analysis.predict(0).unwrap();
        assert_eq!((prediction.plain, prediction.preconditioned), (None, None));
        // u = t is known all the same.
        assert!(
            (prediction.solution - 0.5).abs() < 1e-3,
            "{}",
            prediction.solution
        );
        assert!(prediction.attribute(&analysis).unwrap().is_none());
        let quantities = analysis.quantities().unwrap();
        assert_eq!(quantities.bounds(&prediction).theorem_3, None);
    });
}

/// (v,Φ) of a weighted mean is not known: what stands for it varies with the start, and counts.
#[test]
fn weights_have_a_variance_of_their_own() {
    let model = model::rational(1.1);
    with_degree::<f64, 1, _, _, _, 1>((model.kernel.0, model.source), 10, |cube, neighbour, v| {
        let weight = |x: &[f64; 1]| 1.0 + 3.0 * x[0] * x[0];
        let means = CubeRule::new(cube, 0, 3).unwrap().means(&weight).unwrap();
        let scores = CubeScores::new(cube, 0).unwrap();
        let weighted = Weighted::new(weight, scores, &means, v).unwrap();
        let quadrature = CubeRule::sites(cube, 0, 400).unwrap();
        let density = |x: &[f64; 1]| {
            let phi = weight(x);
            let x = neighbour.locate(*x);
            let known = weighted.control(&x, phi, neighbour.value(&x));
            Density {
                functional: phi,
                square: phi * phi,
                initial: 1.0,
                fluctuation: known - weighted.of_means(),
                known: 0.0,
            }
        };
        let starts = [Start::Density(&density)];
        for estimator in [Estimator::Absorption, Estimator::Collision] {
            let options = paper(estimator, 1);
            let setting = VarianceSetup {
                equation: cube,
                neighbour,
                pairs: ALL,
                quadrature: &quadrature,
                absorption: options.absorption,
            };
            let model = setting.with_starts(&starts).unwrap();
            let analysis = Analysis::new(&model, estimator, options.form, &serially).unwrap();
            let prediction = analysis.predict(0).unwrap();
            let statistics = run(
                cube,
                neighbour,
                &Goal::new(weighted, None),
                options,
                1 << 18,
            );
            let sd = statistics.preconditioned().std_dev.unwrap();
            let predicted = prediction.preconditioned.unwrap().sqrt();
            assert!((predicted / sd - 1.0).abs() < 0.02, "{predicted} {sd}");
            let attribution = prediction.attribute(&analysis).unwrap().unwrap();
            let start = attribution.parts.start;
            assert!(start > 0.05 * predicted * predicted, "{start}");
        }
    });
}
