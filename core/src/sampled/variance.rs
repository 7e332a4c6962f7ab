//! What a score of a neighbour equation from steps varies by, and how many steps are best for it.

use core::num::NonZeroU32;

use num_traits::zero;

use crate::galerkin::Cells;
use crate::{
    DefaultGenerator, Equation, Located, NeighbourOf, Real, RngUniforms, Value, WalkSeeds,
};

/// Mean squares over X of what a score varies by, in the square of u's unit.
///
/// With s steps a score of the difference F − G has the mean square `residual` + `source` + `step`/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScoreVariance {
    /// The mean square of F + T_k v − v, which no number of steps makes smaller: its estimate and a standard error, since one that is
    /// by luck near 0 would ask for many steps in vain.
    pub residual: f64,
    /// The variance of F as it is drawn.
    pub source: f64,
    /// The variance of a G from one step.
    pub step: f64,
}

/// Most cells from which scores are drawn.
const CELLS: usize = 1024;
/// Most steps of a score.
const MOST: f64 = 64.0;
/// The number in place of a goal's that these draws have.
const NUMBER: u64 = u64::MAX - 2;

impl ScoreVariance {
    /// Estimates from two scores in a point of each of at most 1024 cells, evenly among all, of a neighbour equation that
    /// takes so many steps. The seeds are fixed: for the same equation it is the same number.
    ///
    /// Of several channels they are sums over all.
    pub fn estimate<E, N>(equation: &E, neighbour: &N, steps: NonZeroU32) -> Self
    where
        E: Equation + Cells,
        N: NeighbourOf<E> + ?Sized,
    {
        let cells = equation.cells();
        let count = cells.min(CELLS);
        let seeds = WalkSeeds::<DefaultGenerator>::new(1, NUMBER);
        let (mut sums, mut area) = ([0.0; 3], 0.0);
        let mut squares = 0.0;
        for i in 0..count {
            let cell = i * cells / count;
            let mut draws = RngUniforms(seeds.generator(cell as u64));
            let mut t = [0.5; 8];
            for t in t.iter_mut().take(E::DIMENSION) {
                *t = crate::Uniforms::<f64>::uniform(&mut draws);
            }
            let x = Located {
                point: equation.point(cell, &t),
                cell,
            };
            let [a, b] = [(); 2].map(|()| {
                let f = equation.source(&x.point, &mut draws);
                [f, neighbour.source(&x, &mut draws)]
            });
            let measure = equation.measure(cell);
            let mut own = 0.0;
            for channel in 0..equation.channels() {
                let [a, b] = [a, b].map(|both| both.map(|value| value.get(channel).to_f64()));
                let halves = |k: usize| 0.5 * (a[k] - b[k]) * (a[k] - b[k]);
                let terms = [(a[0] - a[1]) * (b[0] - b[1]), halves(0), halves(1)];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += measure * term;
                }
                own += measure * terms[0];
            }
            squares += own * own;
            area += measure;
        }
        let spread = squares - sums[0] * sums[0] / count.max(1) as f64;
        sums[0] = sums[0].max(0.0) + Real::sqrt(spread.max(0.0));
        let [residual, source, step] = sums.map(|sum| if area > zero() { sum / area } else { 0.0 });
        Self {
            residual,
            source,
            step: step * f64::from(steps.get()),
        }
    }

    /// The number of steps of a score with the least product of variance and time, where the rest of a walk takes `rest`
    /// times as long as one step of each score: √(rest · step/(residual + source)), from 1 to 64.
    ///
    /// ```
    /// use fredholm_core::sampled::ScoreVariance;
    ///
    /// let score = ScoreVariance { residual: 0.5, source: 0.5, step: 12.0 };
    /// assert_eq!(score.best_steps(3.0).get(), 6);
    /// ```
    #[must_use]
    pub fn best_steps(&self, rest: f64) -> NonZeroU32 {
        let best = Real::sqrt(rest * self.step / (self.residual + self.source));
        // 0/0, where nothing varies, is 1.
        let best = if best > 1.0 { best.min(MOST) } else { 1.0 };
        NonZeroU32::new((best + 0.5) as u32).unwrap_or(NonZeroU32::MIN)
    }
}
