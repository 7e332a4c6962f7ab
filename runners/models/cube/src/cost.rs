//! What set-ups and walks on a cube take.

use fredholm_cube::REPLICATES;

use super::domain::Domain;
use super::exact::Enough;
use super::{CubeModel, CubePartition, lift, singular};
use fredholm_core::Tolerance;
use fredholm_model::Partitioned;
use fredholm_model::cost::{Cost, WalkCost};

/// Seconds of a function on a cell at a point, of a product of two, or of a number of a table times a vector.
const VALUE: f64 = 1e-9;
/// Numbers of a table that caches hold.
const CACHED: f64 = 1e5;
/// Gauss points of a cell and axis by which a lift takes T_K v, about.
const LIFT_POINTS: usize = 8;
/// The fewest and the most boxes of moments of F: as many as take some milliseconds, or some seconds.
const BOXES: [f64; 2] = [4096.0, 16_777_216.0];
/// Twice the error that N boxes leave in three dimensions, times N: 2 · 0.35 · 3.5, and a fifth for what the solution makes
/// of it.
const JUMP: f64 = 3.0;
/// How many times finer than a part of F moments may have to be for the same part of u: below a hundredth u is 0 for all that few moments tell.
const VANISHING: f64 = 100.0;
/// The number of all boxes over that at a jump: where F − F' is smooth there are some, too, and coarser ones come first.
const TIMES: f64 = 6.0;
/// Seconds of the draws and signs of a box.
const BOX: f64 = 50e-9;
/// The sweeps of a solution whose size alone matters.
const FEW_SWEEPS: f64 = 5.0;
/// The number of points in which the size of F is looked for.
const POINTS: u32 = 1000;
/// The steps between points of an axis, whose multiples are spread over [0, 1]: fractions of √2, √3, √5, √7, √11 and √13.
pub(super) const STEPS: [f64; 6] = [
    0.414_213_562,
    0.732_050_808,
    0.236_067_977,
    0.645_751_311,
    0.316_624_790,
    0.605_551_275,
];

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
            true => (17e-9, 10e-9 * d * b + 0.35e-9 * b * b),
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
        let (moments, exact) = match self.exact_source {
            Some(tolerance) => (self.moments_seconds(tolerance), source),
            None => (0.0, 0.0),
        };
        Cost {
            setup: galerkin,
            source: rest,
            kept: 0.0,
            moments,
            moments_power: self.moments_power(),
            walk: WalkCost {
                start: step + contraction,
                step: step + contraction,
                score: plain.score + exact,
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
        let highest = fredholm_cube::functions(d, lift::HIGHEST) as f64;
        (values <= lift::MOST_WORK).then_some(Cost {
            setup: setup + values * (kernel + per_axis),
            source: 0.0,
            kept: 0.0,
            moments: 0.0,
            moments_power: 0.0,
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

    /// When moments of F are fine enough: when they leave half of the tolerance, and have as many boxes as it takes for that at
    /// a jump of the size of F along a plane. Boxes of side s, of which 1.5 s^−(d−1) meet it, leave √1.5 s^((d+1)/2)/√12, since a
    /// part of a box that is uniform in [0, 1] has 1/12 for two draws; all boxes are about 3.5 s^−(d−1).
    pub(super) fn enough(&self, tolerance: Tolerance) -> Enough {
        let size = self.model.source_size();
        let error = match tolerance {
            Tolerance::Absolute(error) => error,
            Tolerance::Relative(error) => error * size,
        };
        let [fewest, most] = BOXES;
        let boxes = (JUMP * size / error).powf(self.moments_power());
        let boxes = boxes.clamp(fewest, most);
        Enough {
            error: 0.5 * error,
            boxes: boxes.max(self.all_cells() as f64),
            size,
        }
    }

    /// The power of one over the error with which the number of boxes grows.
    fn moments_power(&self) -> f64 {
        let d = self.model.dimension as f64;
        2.0 * (d - 1.0) / (d + 1.0)
    }

    /// Moments with so many times less of an error; nothing if these have as many boxes as any may have, or if nothing of u is left to
    /// take a part of.
    pub(super) fn finer(&self, enough: &Enough, times: f64) -> Option<Enough> {
        let [_, most] = BOXES;
        let boxes = enough.boxes * times.powf(self.moments_power()).max(2.0);
        (enough.boxes < most && times < VANISHING).then_some(Enough {
            error: enough.error / times,
            boxes: boxes.min(most),
            size: enough.size,
        })
    }

    /// Seconds of the boxes and of the errors' solutions.
    fn moments_seconds(&self, tolerance: Tolerance) -> f64 {
        let [_, rest] = self.galerkin_seconds();
        let [_, _, source] = self.functions().seconds();
        let functions = self.functions_on_cell() as f64;
        let corners = 2_u32.pow(self.model.dimension as u32);
        let values = (f64::from(corners) + 2.0) * (source + VALUE * functions);
        let each = values + BOX + REPLICATES as f64 * VALUE * functions;
        let sweep = if self.functions().is_product() {
            rest
        } else {
            VALUE * (self.unknowns() as f64).powi(2)
        };
        TIMES * self.enough(tolerance).boxes * each + REPLICATES as f64 * FEW_SWEEPS * sweep
    }
}

impl CubeModel {
    /// The largest |F| in some points, spread over the domain.
    pub(super) fn source_size(&self) -> f64 {
        *self.source_size.get_or_init(|| {
            let mut size = 0.0_f64;
            self.functions.with_f64(&mut |values| {
                let domain = Domain::<f64>::new(self.functions.domain());
                for point in 0..POINTS {
                    let of = |axis: usize| {
                        let t = (f64::from(point) + 0.5) * STEPS[axis];
                        domain.coordinate(axis, t.fract())
                    };
                    let x: Vec<f64> = (0..self.dimension).map(of).collect();
                    size = size.max(values.source(&x).abs());
                }
            });
            size
        })
    }
}
