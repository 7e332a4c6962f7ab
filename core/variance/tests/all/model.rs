//! A model that is written by hand, without points.

use core::ops::Range;

use fredholm_core::galerkin::PairKind;
use fredholm_core::{Estimator, Form};
use fredholm_variance::{
    Analysis, Density, MeanCoefficients, Origin, Position, Transition, Values, VarianceError,
    VarianceModel, Wanted, pair_quantities, serially,
};

/// A chain with two states, each a site with one node; start 0 and 1 are in the states, start 2 is even over both.
struct TwoStates;

const Q: f64 = 0.4;
/// The probability of every step.
const P: f64 = 0.5 * (1.0 - Q);
const K: [[f64; 2]; 2] = [[0.9, 0.5], [0.3, 1.1]];
const H: [[f64; 2]; 2] = [[0.8, 0.0], [0.4, 1.1]];
const F: [f64; 2] = [1.0, 2.0];
const V: [f64; 2] = [1.7, 3.1];

/// G = v − T_hp v.
fn g(i: usize) -> f64 {
    V[i] - (0..2).map(|j| P * H[i][j] * V[j]).sum::<f64>()
}

impl VarianceModel for TwoStates {
    fn sites(&self) -> usize {
        2
    }
    fn nodes(&self, site: usize) -> Range<usize> {
        site..site + 1
    }
    fn position(&self, point: usize) -> Position {
        let weight = if point < 2 { 0.5 } else { 1.0 };
        Position {
            cell: point % 2,
            weight,
        }
    }
    fn values(&self, point: usize) -> Values {
        let state = point % 2;
        Values {
            absorption: Q,
            source: Q * F[state],
            neighbour_source: g(state),
            source_noise: 0.0,
            noise: 0.0,
            value: V[state],
        }
    }
    fn steps(&self, point: usize, site: usize, wanted: Wanted, visit: &mut dyn FnMut(&Transition)) {
        // Only what is wanted, so that whoever relies on more is found out.
        let if_told = |least: Wanted, x: f64| if wanted >= least { x } else { f64::NAN };
        visit(&Transition {
            weight: P,
            node: Some(0),
            cell: if wanted >= Wanted::Cell { site } else { 7 },
            left_out: self.kind(point % 2, site) == PairKind::Dropped,
            kernel: K[point % 2][site],
            next: K[point % 2][site].powi(2),
            later: K[point % 2][site].powi(2),
            neighbour: if_told(Wanted::Neighbour, H[point % 2][site]),
            value: if_told(Wanted::Value, V[site]),
        });
    }
    fn kind(&self, i: usize, j: usize) -> PairKind {
        match (i, j) {
            (0, 1) => PairKind::Dropped,
            (1, 1) => PairKind::Pointwise,
            _ => PairKind::Galerkin,
        }
    }
    fn start(&self, start: usize) -> Option<Origin> {
        match start {
            0 | 1 => Some(Origin::Point {
                point: 2 + start,
                site: start,
            }),
            2 => Some(Origin::Density),
            _ => None,
        }
    }
    fn density(&self, _: usize, _: usize) -> Density {
        Density::uniform(1.0)
    }
}

/// x = Σ P a x + b.
fn solve(a: impl Fn(usize, usize) -> f64, b: [f64; 2]) -> [f64; 2] {
    let mut x = b;
    for _ in 0..500 {
        x = [0, 1].map(|i| b[i] + (0..2).map(|j| P * a(i, j) * x[j]).sum::<f64>());
    }
    x
}

/// E η(k,f)², E η(k,f) η(h,g) and E η(h,g)² by their own recursions, of which the variance is a difference.
#[test]
fn a_model_without_points_has_the_variances_of_its_chain() {
    let [f, g] = [F, [g(0) / Q, g(1) / Q]];
    let u = solve(|i, j| K[i][j], f.map(|f| Q * f));
    let kk = solve(|i, j| K[i][j] * K[i][j], [0, 1].map(|i| Q * f[i] * f[i]));
    let kh = solve(|i, j| K[i][j] * H[i][j], [0, 1].map(|i| Q * f[i] * g[i]));
    let hh = solve(|i, j| H[i][j] * H[i][j], [0, 1].map(|i| Q * g[i] * g[i]));
    let analysis =
        Analysis::new(&TwoStates, Estimator::Absorption, Form::Product, &serially).unwrap();
    let close = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    };
    let second = |i: usize| kk[i] - 2.0 * kh[i] + hh[i];
    for start in 0..2 {
        let found = analysis.predict(start).unwrap();
        close(found.solution, u[start]);
        close(found.error, u[start] - V[start]);
        close(found.plain.unwrap(), kk[start] - u[start] * u[start]);
        let mean = u[start] - V[start];
        close(found.preconditioned.unwrap(), second(start) - mean * mean);
    }
    let found = analysis.predict(2).unwrap();
    let mean = 0.5 * (u[0] + u[1] - V[0] - V[1]);
    let expected = 0.5 * (second(0) + second(1)) - mean * mean;
    close(found.preconditioned.unwrap(), expected);
    // One pair is left out, and it counts.
    let parts = found.attribute(&analysis).unwrap().unwrap().parts;
    assert!(parts.left_out.abs() > 0.01 * expected, "{parts:?}");

    assert_eq!(
        analysis.predict(3).err(),
        Some(VarianceError::NoStart { start: 3 })
    );
    let mut pairs = Vec::new();
    let coefficients = MeanCoefficients {
        cells: 2,
        mean: &|i, j| P * H[i][j],
    };
    pair_quantities(&TwoStates, coefficients, &mut |pair| pairs.push(pair)).unwrap();
    let of = |pair: usize| (pairs[pair].cells, pairs[pair].in_s, pairs[pair].mean_kernel);
    assert_eq!(of(1), ([0, 1], false, K[0][1]));
    assert_eq!(of(2), ([1, 0], true, K[1][0]));
}
