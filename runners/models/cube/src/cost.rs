//! What set-ups and walks on a cube take.

use fredholm_core::galerkin::functions;

use super::{CubePartition, lift, singular};
use fredholm_model::cost::{Cost, WalkCost};

/// Seconds of a function on a cell at a point, of a product of two, or of a number of a table times a vector.
const VALUE: f64 = 1e-9;
/// Numbers of a table that caches hold.
const CACHED: f64 = 1e5;
/// Gauss points of a cell and axis by which a lift takes T_K v, about.
const LIFT_POINTS: usize = 8;

impl CubePartition<'_> {
    /// All seconds.
    pub(super) fn seconds(&self) -> Cost {
        let d = self.model.dimension as f64;
        let [kernel, integral, source] = self.functions().seconds();
        let n = self.all_cells() as f64;
        let b = match self.degree {
            0 => 0.0,
            _ => self.functions_on_cell() as f64,
        };
        let (axis, contraction) = match self.functions().is_product() {
            false if n * n * b * b > CACHED => (10e-9, 1.5e-9 * b * b),
            false => (10e-9, 0.3e-9 * b * b),
            true => (17e-9, 0.3e-9 * d * b * b),
        };
        let step = axis * d + kernel;
        let plain = WalkCost {
            start: step,
            step,
            score: 10e-9 + source,
            pair: 0.0,
            hidden_pair: 0.0,
        };
        let [galerkin, rest] = self.galerkin_seconds();
        Cost {
            setup: galerkin,
            source: rest,
            kept: 0.0,
            walk: WalkCost {
                start: step + contraction,
                step: step + contraction,
                pair: 2.0 * integral,
                ..plain
            },
            plain,
            light: 0.0,
        }
    }

    /// All seconds of a lift to this degree, but for G, which is part of its set-up. `None`: it takes too many values of the kernel.
    pub(super) fn lift_seconds(&self, degree: usize) -> Option<Cost> {
        let Cost { setup, plain, .. } = self.seconds();
        let d = self.model.dimension;
        let [kernel, ..] = self.functions().seconds();
        let values = lift::values(self, degree, LIFT_POINTS);
        let per_axis = VALUE * LIFT_POINTS as f64;
        let highest = functions(d, lift::HIGHEST) as f64;
        (values <= lift::MOST_WORK).then_some(Cost {
            setup: setup + values * (kernel + per_axis),
            source: 0.0,
            kept: 0.0,
            walk: WalkCost {
                score: plain.score
                    + 2.0 * VALUE * highest
                    + lift::CORRECTIONS * (kernel + per_axis),
                ..plain
            },
            plain,
            light: 0.0,
        })
    }

    /// Seconds of the coefficients and the Galerkin solution, and of G.
    fn galerkin_seconds(&self) -> [f64; 2] {
        let d = self.model.dimension;
        let [kernel, integral, _] = self.functions().seconds();
        let points = self.points().pow(d as u32) as f64;
        let (n, b) = (self.all_cells() as f64, self.functions_on_cell() as f64);
        let values = if self.degree == 0 { 0.0 } else { VALUE * b };
        if self.functions().is_product() {
            let (m, functions) = (self.per_axis as f64, (self.degree + 1) as f64);
            let axes = m * m * (self.points().pow(2) as f64) * (kernel + values);
            let sweeps = n * functions.powi(d as i32) * m * functions * d as f64;
            return [axes + 12e-9 * sweeps, 0.7e-9 * sweeps];
        }
        let integrals = if self.has_integrals() {
            let given = self.functions().has_integral();
            let each = if given { 2.0 * integral } else { 4.0 * kernel };
            singular::POINTS as f64 * each
        } else {
            points * points * (kernel + values) + points * VALUE * b * b
        };
        [n * n * (integrals + 20e-9 * b * b), 3e-9 * (n * b).powi(2)]
    }
}
