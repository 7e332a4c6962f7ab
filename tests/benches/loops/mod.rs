//! The loops that the engine is measured against, on the paper's circle at one point: absorption
//! estimator, the paper's pairs, f64, the same generator and draws.

// Each bench uses a part of this module.
#![allow(dead_code, missing_docs, unreachable_pub)]

use core::f64::consts::{PI, TAU};

use fredholm_circle::{Circle, Harmonic, OwnedTables};
use fredholm_core::galerkin::{DiagonalRule, GalerkinMatrix, PairKind, Piecewise};
use fredholm_core::{
    Absorption, At, Batch, DefaultGenerator, Estimator, Form, Goal, Goals, Job, Real, RngUniforms,
    Statistics, Uniforms, WalkOptions, WalkSeeds,
};

pub const RHO: [f64; 10] = [0.11, 0.52, 0.7, 0.03, 0.33, 0.61, 0.74, 0.25, 0.4, 0.18];
pub const LIGHT: Harmonic = Harmonic {
    constant: 5.0,
    amplitude: 1.0,
    frequency: 5,
};
pub const Q0: f64 = 0.2;
pub const START: f64 = 0.3;
const PAPER: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Dropped,
};

/// Everything that is set up before the walks.
pub struct Setup {
    tables: OwnedTables<f64>,
    pub v: Vec<f64>,
    pub g: Vec<f64>,
    n: usize,
}

impl Setup {
    pub fn new(n: usize) -> Self {
        let tables = OwnedTables::new(&RHO, n).unwrap();
        let circle = Circle::new(&tables, LIGHT).unwrap();
        let system = circle.system::<1>();
        let solution = system.solve(1e-14, 1000).unwrap();
        let (v, g) = (
            solution.rounded().unwrap(),
            solution.source(&system, &PAPER).unwrap(),
        );
        Self { tables, v, g, n }
    }

    /// The generic engine.
    // By itself, as in a program: what is around it does not change its code.
    #[inline(never)]
    pub fn engine(&self, walks: u64) -> Statistics {
        let circle = Circle::new(&self.tables, LIGHT).unwrap();
        let system = circle.system::<1>();
        let neighbour =
            Piecewise::<_, _, _, _, _, 1>::new(&circle, &system, PAPER, &self.v, &self.g);
        let neighbour = neighbour.unwrap();
        let start = At(circle.point(START));
        let goals = [Goal::new(start, Some(self.v[self.cell(START)]))];
        let options = WalkOptions {
            absorption: Absorption::Constant {
                probability: Q0,
                estimator: Estimator::Absorption,
            },
            form: Form::Product,
            ..WalkOptions::default()
        };
        let mut batches = [Batch::new(0, walks, walks)];
        let job = Goals::new(&circle, &neighbour, &goals, options);
        job.run(0, &mut batches, u64::MAX).unwrap();
        batches[0].statistics()
    }

    /// The dense table of K_ij, for the straightforward loop.
    pub fn dense(&self) -> Vec<f64> {
        let circle = Circle::new(&self.tables, LIGHT).unwrap();
        let system = circle.system::<1>();
        let mut table = Vec::new();
        for i in 0..self.n {
            for j in 0..self.n {
                table.push(system.mean(i, j));
            }
        }
        table
    }

    fn cell(&self, s: f64) -> usize {
        (s * self.n as f64 / TAU) as usize
    }

    /// What one writes first: angles, sin and acos at every step, a dense table of K_ij. Returns
    /// (mean of ζ, its variance, states).
    pub fn straightforward(&self, dense: &[f64], walks: u64) -> (f64, f64, u64) {
        let n = self.n;
        let seeds = WalkSeeds::<DefaultGenerator>::new(1, 0);
        let per_arc = n / RHO.len();
        let scale = (1.0 - Q0) * (PI / (2.0 * n as f64)).sin();
        let (mut sum, mut squares, mut states) = (0.0, 0.0, 0);
        for walk in 0..walks {
            let mut draws = RngUniforms(seeds.generator(walk));
            let mut uniform = || -> f64 { draws.uniform() };
            let mut s = START;
            let mut i = self.cell(s);
            let (mut weight_k, mut weight_h) = (1.0, 1.0);
            loop {
                states += 1;
                let rho = RHO[i / per_arc];
                if uniform() < Q0 {
                    let f = 5.0 * (1.0 - rho) + (1.0 + rho / 99.0) * (5.0 * s).sin();
                    let zeta =
                        self.v[self.cell(START)] + (weight_k * f - weight_h * self.g[i]) / Q0;
                    sum += zeta;
                    squares += zeta * zeta;
                    break;
                }
                let mut t = s + 2.0 * (1.0 - 2.0 * uniform()).acos();
                if t >= TAU {
                    t -= TAU;
                }
                let j = self.cell(t).min(n - 1);
                weight_k *= rho / (1.0 - Q0);
                weight_h *= if i == j {
                    0.0
                } else {
                    let middle = (j as f64 + 0.5) * TAU / n as f64;
                    dense[i * n + j] / (scale * (0.5 * (middle - s)).sin().abs())
                };
                (s, i) = (t, j);
            }
        }
        let n = walks as f64;
        (sum / n, squares / n - (sum / n) * (sum / n), states)
    }
}

/// What a cell needs, in one place.
struct Cell {
    cos: f64,
    sin: f64,
    cos_low: f64,
    sin_low: f64,
    rho: f64,
    g: f64,
}

/// The same arithmetic as the engine's, written by hand for this one case.
pub struct Specialised {
    cells: Vec<Cell>,
    slots: Vec<(f64, u32)>,
    value: f64,
}

fn pseudo_angle(cos: f64, sin: f64) -> f64 {
    0.5 - 0.5 * cos / (cos.abs() + sin)
}

/// With products to twice the precision.
fn small_sine(to: &Cell, cos: f64, sin: f64) -> f64 {
    let low = to.sin.product_error(cos) - to.cos.product_error(sin);
    let low = low + (to.sin_low * cos - to.cos_low * sin);
    ((to.sin * cos - to.cos * sin) + low).abs()
}

impl Specialised {
    pub fn new(setup: &Setup) -> Self {
        let n = setup.n;
        let end = |i: usize| {
            let half = PI * ((i + 1) as f64 / n as f64);
            if i + 1 == n {
                2.0
            } else {
                pseudo_angle(half.cos(), half.sin())
            }
        };
        let cells: Vec<Cell> = (0..n)
            .map(|i| {
                let middle = PI * (i as f64 + 0.5) / n as f64;
                Cell {
                    cos: middle.cos(),
                    sin: middle.sin(),
                    cos_low: 0.0,
                    sin_low: 0.0,
                    rho: RHO[i / (n / RHO.len())],
                    g: setup.g[i],
                }
            })
            .collect();
        let slots = (0..2 * n)
            .map(|slot| {
                let start = slot as f64 / (2 * n) as f64;
                let cell = (0..n).position(|i| end(i) > start).unwrap();
                (end(cell), cell as u32)
            })
            .collect();
        let value = setup.v[setup.cell(START)];
        Self {
            cells,
            slots,
            value,
        }
    }

    /// Returns (mean of ζ, its variance, states).
    // As the engine.
    #[inline(never)]
    pub fn run(&self, walks: u64) -> (f64, f64, u64) {
        let (cells, slots) = (&self.cells[..], &self.slots[..]);
        let n = cells.len() as f64;
        let seeds = WalkSeeds::<DefaultGenerator>::new(1, 0);
        let quarter = PI / (2.0 * n);
        let mass = (1.0 - Q0) * quarter.sin();
        let galerkin = quarter.sin() * quarter.sin() / quarter;
        let per_survival = 1.0 / (1.0 - Q0);
        let start = ((0.5 * START).cos(), (0.5 * START).sin());
        let first = (START * n / TAU) as usize;
        let (mut states, mut scored) = (0, 0);
        let mut means = [0.0_f64; 3];
        let mut squares = [0.0_f64; 3];
        let mut cross = 0.0;
        for walk in 0..walks {
            let mut draws = RngUniforms(seeds.generator(walk));
            let mut uniform = || -> f64 { draws.uniform() };
            let (mut cos, mut sin) = start;
            let mut i = first;
            let (mut weight_k, mut weight_h) = (1.0, 1.0);
            loop {
                states += 1;
                let from = &cells[i];
                if uniform() < Q0 {
                    let (c1, s1) = ((cos - sin) * (cos + sin), (cos + cos) * sin);
                    let (c2, s2) = ((c1 - s1) * (c1 + s1), (c1 + c1) * s1);
                    let (c4, s4) = ((c2 - s2) * (c2 + s2), (c2 + c2) * s2);
                    let sine = c1 * s4 + s1 * c4;
                    let f = 5.0 * (1.0 - from.rho) + (1.0 + from.rho / 99.0) * sine;
                    let plain = weight_k * f * (1.0 / Q0);
                    let eta = weight_h * from.g * (1.0 / Q0);
                    scored += u64::from((plain.to_bits() | eta.to_bits()) << 1 != 0);
                    let control = eta - self.value;
                    assert!((plain - control).is_finite());
                    let per_walk = 1.0 / (walk + 1) as f64;
                    let mut push = |k: usize, x: f64| {
                        let before = x - means[k];
                        means[k] += before * per_walk;
                        let after = x - means[k];
                        squares[k] += before * after;
                        (before, after)
                    };
                    let (before, _) = push(0, plain);
                    let (_, after) = push(1, control);
                    push(2, plain - control);
                    cross += before * after;
                    break;
                }
                let xi = uniform();
                let turn = 1.0 - (xi + xi);
                let root = (xi * (1.0 - xi)).sqrt();
                let turn_sin = root + root;
                let (c, s) = (cos * turn - sin * turn_sin, sin * turn + cos * turn_sin);
                let scale = (1.5 - 0.5 * (c * c + s * s)).copysign(s);
                let (c, s) = (c * scale, s * scale);
                let angle = pseudo_angle(c, s);
                let (end, guess) = slots[(angle * slots.len() as f64) as u32 as usize];
                let j = guess as usize + usize::from(angle >= end);
                let to = &cells[j];
                weight_k *= from.rho * per_survival;
                weight_h *= if i == j {
                    0.0
                } else {
                    let coefficient = (to.sin * from.cos - to.cos * from.sin).abs();
                    let mut sine = (to.sin * cos - to.cos * sin).abs();
                    if sine < 0.25 {
                        sine = small_sine(to, cos, sin);
                    }
                    from.rho * galerkin * coefficient / (mass * sine)
                };
                (cos, sin, i) = (c, s, j);
            }
        }
        core::hint::black_box((cross, scored));
        (means[2], squares[2] / (walks - 1) as f64, states)
    }
}
