//! Walks of a whole function side by side on the circle, with the bits of one alone.

use fearless_simd::{Simd, f64x8, prelude::*};
use fredholm_core::array::from_fn;
use fredholm_core::galerkin::legendre_factors;
use fredholm_core::whole::{
    Followed, Normalisation, Replicate, Scores, Starts, StateScores, SuffixLanes, WholeJob,
    WholeTask,
};
use fredholm_core::{Neighbour, NotFinite, Real, Sampler};

use crate::lanes::{CircleLanes, LANES, LanePairs, Places};
use crate::series::{COSINE, SINE};
use crate::{Circle, Emission, Point, PolynomialCircle};

/// The walks of a whole function on a circle, of a neighbour equation with h = k.
type CircleTask<'a, 'c, F, E, N> =
    WholeTask<'a, Circle<'c, F, E>, Circle<'c, F, E>, N, dyn Scores<Point<F>> + Sync + 'a>;

/// The walks of a whole function with scores on B polynomials a cell, which in f64 go side by side where the processor has
/// vectors of four doubles or more, if the estimator is absorption; otherwise one by one. The bits are the same.
///
/// ```
/// use fredholm_circle::{Circle, CircleScores, Harmonic, Residual, Tables, WholeSideBySide, residual_moments};
/// use fredholm_core::WalkOptions;
/// use fredholm_core::whole::{Replicate, ReplicateCounts, WholeJob, WholeTask};
///
/// let tables = Tables::new(&[0.5, 0.7], 100)?;
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// let circle = Circle::new(tables.cells(), light, 0.2)?;
/// let solution = circle.solve(1e-14, 1000)?;
/// let moments = residual_moments(&circle, &solution)?;
/// let neighbour: Residual<_, _> = Residual::new(&circle, &solution.v, &moments)?;
/// let polynomials = circle.with_functions::<3>();
/// let scores = CircleScores(&polynomials);
/// let one_by_one = WholeTask::new(&circle, &circle, &neighbour, &scores as _, WalkOptions::default());
/// let side_by_side = WholeSideBySide::with_same_kernel(&one_by_one, &polynomials);
/// let [mut left, mut right] = [[0.0; 300]; 2];
/// let none = ReplicateCounts::default();
/// one_by_one.run(&mut Replicate::new(0, 64, none, &mut left), 1000)?;
/// side_by_side.run(&mut Replicate::new(0, 64, none, &mut right), 1000)?;
/// assert!(left == right && left.iter().any(|sum| *sum != 0.0));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct WholeSideBySide<'a, 'c, 'p, F, E, N: ?Sized, const B: usize> {
    task: &'a CircleTask<'a, 'c, F, E, N>,
    polynomials: &'a PolynomialCircle<'p, 'c, F, E, B>,
}

impl<F, E, N: ?Sized, const B: usize> core::fmt::Debug for WholeSideBySide<'_, '_, '_, F, E, N, B> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("WholeSideBySide").finish_non_exhaustive()
    }
}

impl<'a, 'c, 'p, F, E, N: ?Sized, const B: usize> WholeSideBySide<'a, 'c, 'p, F, E, N, B> {
    /// These walks, of whose neighbour equation the caller promises that h = k everywhere, and of whose scores that they are
    /// those on these polynomials.
    #[must_use]
    pub const fn with_same_kernel(
        task: &'a CircleTask<'a, 'c, F, E, N>,
        polynomials: &'a PolynomialCircle<'p, 'c, F, E, B>,
    ) -> Self {
        Self { task, polynomials }
    }
}

impl<F, E, N, const B: usize> WholeJob for WholeSideBySide<'_, '_, '_, F, E, N, B>
where
    F: WholeLaneReal,
    E: Emission<F> + Sync,
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync + ?Sized,
{
    fn unknowns(&self) -> usize {
        self.task.unknowns()
    }

    fn normalisation(&self) -> Normalisation {
        self.task.normalisation()
    }

    fn run(&self, replicate: &mut Replicate<'_>, at_most: u64) -> Result<(), NotFinite> {
        F::run(self, replicate, at_most)
    }
}

/// A scalar of the walks of a whole function side by side.
pub trait WholeLaneReal: Real {
    /// Runs walks side by side, or one by one where the processor has nothing for it.
    ///
    /// # Errors
    /// As [`WholeJob::run`].
    fn run<E, N, const B: usize>(
        job: &WholeSideBySide<'_, '_, '_, Self, E, N, B>,
        replicate: &mut Replicate<'_>,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        E: Emission<Self> + Sync,
        N: Neighbour<Scalar = Self, Point = Point<Self>> + Sync + ?Sized,
    {
        job.task.run(replicate, at_most)
    }
}

/// One by one: there are no lanes of f32.
impl WholeLaneReal for f32 {}

impl WholeLaneReal for f64 {
    fn run<E, N, const B: usize>(
        job: &WholeSideBySide<'_, '_, '_, Self, E, N, B>,
        replicate: &mut Replicate<'_>,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        E: Emission<Self> + Sync,
        N: Neighbour<Scalar = Self, Point = Point<Self>> + Sync + ?Sized,
    {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some(series) = job.polynomials.arcsine() {
            let level = fearless_simd::Level::new();
            if let Some(simd) = level.as_avx512() {
                return vectorize(simd, job, series, replicate, at_most);
            }
            if let Some(simd) = level.as_avx2() {
                return vectorize(simd, job, series, replicate, at_most);
            }
        }
        job.task.run(replicate, at_most)
    }
}

/// Runs walks with the instructions of `simd`.
fn vectorize<S, E, N, const B: usize>(
    simd: S,
    job: &WholeSideBySide<'_, '_, '_, f64, E, N, B>,
    series: &[f64],
    replicate: &mut Replicate<'_>,
    at_most: u64,
) -> Result<(), NotFinite>
where
    S: Simd,
    E: Emission<f64> + Sync,
    N: Neighbour<Scalar = f64, Point = Point<f64>> + Sync + ?Sized,
{
    // A closure, as for other walks.
    simd.vectorize(
        #[inline(always)]
        || {
            let circle = job.task.equation;
            let steps = CircleLanes {
                simd,
                circle,
                pairs: LanePairs::Same,
                is_residual: false,
            };
            let lanes: SuffixesOfLanes<'_, '_, _, _, B> = SuffixesOfLanes {
                steps,
                series,
                factors: legendre_factors(),
            };
            job.task.run_in_lanes(&lanes, replicate, at_most)
        },
    )
}

/// Eight walks of a whole function on a circle.
struct SuffixesOfLanes<'a, 'c, S, E, const B: usize> {
    steps: CircleLanes<'a, 'c, S, E>,
    /// The coefficients of t in odd powers of the sine from the middle of a cell.
    series: &'a [f64],
    factors: [[f64; 3]; B],
}

/// A state of eight walks that is kept.
#[derive(Clone, Copy)]
struct Kept<S: Simd> {
    /// The sine of half the angle from the middle of the cell.
    sine: f64x8<S>,
    cell: [u32; LANES],
    /// What scores of the next state are multiplied by.
    k: f64x8<S>,
}

impl<S: Simd, E: Emission<f64>, const B: usize> SuffixesOfLanes<'_, '_, S, E, B> {
    #[inline(always)]
    fn kept(&self, x: &Places<S>) -> Kept<S> {
        let per_survival = self.steps.circle.constants().per_survival();
        Kept {
            sine: x.sin * x.middle_cos - x.cos * x.middle_sin,
            cell: x.cell,
            k: x.reflectance * self.steps.all(per_survival),
        }
    }

    /// D ψ_b of all functions, computed as [`CircleScores`](crate::CircleScores) does.
    #[inline(always)]
    fn scores(&self, sine: f64x8<S>, score: f64x8<S>) -> [f64x8<S>; B] {
        let square = sine * sine;
        let t = sine * self.series(self.series.iter().rev(), square);
        let (mut before, mut now) = (self.steps.all(0.0), self.steps.all(1.0));
        let mut all = [before; B];
        // Loops: closures are compiled without these instructions unless they are inlined.
        for (value, [root, forward, back]) in all.iter_mut().zip(&self.factors) {
            *value = score * (now * self.steps.all(*root));
            let next = self.steps.all(*forward) * t * now - self.steps.all(*back) * before;
            (before, now) = (now, next);
        }
        all
    }

    /// The sum of a series, the last term first.
    #[inline(always)]
    fn series<'t>(&self, terms: impl Iterator<Item = &'t f64>, square: f64x8<S>) -> f64x8<S> {
        let mut sum = self.steps.all(0.0);
        for &c in terms {
            sum = sum * square + self.steps.all(c);
        }
        sum
    }

    /// Uniform starts, computed as those of [`Circle`].
    #[inline(always)]
    fn start(&self, half: f64x8<S>) -> Places<S> {
        let lanes = &self.steps;
        let quarters = (lanes.all(2.0) * half + lanes.all(0.5)).floor();
        let x = lanes.all(core::f64::consts::PI) * (half - lanes.all(0.5) * quarters);
        let square = x * x;
        let cos = self.series(COSINE.iter(), square);
        let sin = x * self.series(SINE.iter(), square);
        let (none, one) = (lanes.all(0.0), lanes.all(1.0));
        let (is_none, is_one) = (quarters.simd_eq(none), quarters.simd_eq(one));
        let turned_cos = is_one.select(-sin, -cos);
        let turned_sin = is_one.select(cos, -sin);
        lanes.places_at(
            is_none.select(cos, turned_cos),
            is_none.select(sin, turned_sin),
        )
    }
}

impl<'c, S: Simd, E: Emission<f64>, const B: usize> SuffixLanes<Circle<'c, f64, E>, LANES, B>
    for SuffixesOfLanes<'_, 'c, S, E, B>
{
    #[inline(always)]
    fn follow<const KEPT: usize>(
        &self,
        steps: &[u32; LANES],
        draw: impl Fn(usize) -> [f64; LANES],
        ends: impl Fn(&Point<f64>) -> [f64; 2],
        mut keep: impl FnMut(usize, usize, StateScores<B>),
    ) -> [Followed; LANES] {
        let lanes = &self.steps;
        let zero = lanes.all(0.0);
        let mut at = self.start(draw(0).simd_into(lanes.simd));
        let mut kept = [self.kept(&at); KEPT];
        // k…k of the steps from the last kept state on, and where walks end.
        let mut rest = lanes.all(1.0);
        let start: [_; LANES] = from_fn(|l| Point::new(at.cos[l], at.sin[l], at.cell[l]));
        let mut end = start;
        let most = steps.iter().fold(0, |most, &steps| most.max(steps));
        let lengths = lanes.vector(|l| f64::from(steps[l]));
        for s in 0..most {
            let x = self.kept(&at);
            match kept.get_mut(s as usize) {
                Some(slot) => *slot = x,
                None => {
                    let goes_on = lengths.simd_gt(lanes.all(f64::from(s)));
                    rest = goes_on.select(rest * x.k, rest);
                }
            }
            at = lanes.step(&at, draw(s as usize + 1).simd_into(lanes.simd));
            for l in 0..LANES {
                if steps[l] == s + 1 {
                    end[l] = Point::new(at.cos[l], at.sin[l], at.cell[l]);
                }
            }
        }
        if let Some(slot) = kept.get_mut(most as usize) {
            *slot = self.kept(&at);
        }
        let per_absorption = 1.0 / lanes.circle.absorption(&start[0]);
        let per_absorption = lanes.all(per_absorption);
        let ends: [[f64; 2]; LANES] = from_fn(|l| ends(&end[l]));
        // As a walk that starts behind the kept states scores, and as a kept state does.
        let is_long = lengths.simd_ge(lanes.all(KEPT as f64));
        let own = lanes.vector(|l| ends[l][0]);
        let plain = is_long.select(zero + rest * own * per_absorption, own * per_absorption);
        let own = lanes.vector(|l| ends[l][1]);
        let control = is_long.select(zero + rest * own * per_absorption, own * per_absorption);
        let density = lanes.all(lanes.circle.start_density(&start[0]));
        let (mut after_plain, mut after_control) = (plain, control);
        let mut has_scored = [false; LANES];
        for s in (0..(most as usize + 1).min(KEPT)).rev() {
            let x = &kept[s];
            let place = lanes.all(s as f64);
            let goes_on = lengths.simd_gt(place);
            after_plain = goes_on.select(zero + x.k * after_plain, plain + zero);
            after_control = goes_on.select(zero + x.k * after_control, control + zero);
            let difference = after_plain - after_control;
            let scores = self.scores(x.sine, difference / density);
            for l in 0..LANES {
                if s <= steps[l] as usize {
                    let scores = from_fn(|b| scores[b][l]);
                    let cell = x.cell[l];
                    keep(l, s, StateScores { cell, scores });
                    has_scored[l] |= after_plain[l] != 0.0 || after_control[l] != 0.0;
                }
            }
        }
        let difference = after_plain - after_control;
        from_fn(|l| Followed {
            is_finite: Real::is_finite(difference[l]),
            has_scored: has_scored[l],
        })
    }
}
