//! Walks of a whole function side by side on the circle, with the bits of one alone.

use fearless_simd::{Simd, f64x8, prelude::*};
use fredholm_core::array::{Each, from_fn};
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
/// vectors of four doubles or more; otherwise one by one. The bits are the same.
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

    fn known(&self) -> &[f64] {
        self.task.known()
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
    /// What every state scores, F and G, or 0.
    own: [f64x8<S>; 2],
}

impl<S: Simd, E: Emission<f64>, const B: usize> SuffixesOfLanes<'_, '_, S, E, B> {
    #[inline(always)]
    fn kept(&self, x: &Places<S>, own: [f64x8<S>; 2]) -> Kept<S> {
        let per_survival = self.steps.circle.constants().per_survival();
        Kept {
            sine: x.sin * x.middle_cos - x.cos * x.middle_sin,
            cell: x.cell,
            k: x.reflectance * self.steps.all(per_survival),
            own,
        }
    }

    /// All functions at states, computed as [`CircleScores`](crate::CircleScores) does.
    #[inline(always)]
    fn functions(&self, sine: f64x8<S>) -> [f64x8<S>; B] {
        let square = sine * sine;
        let t = sine * self.series(self.series.iter().rev(), square);
        let (mut before, mut now) = (self.steps.all(0.0), self.steps.all(1.0));
        let mut all = [before; B];
        // Loops: closures are compiled without these instructions unless they are inlined.
        for (value, [root, forward, back]) in all.iter_mut().zip(&self.factors) {
            *value = now * self.steps.all(*root);
            let next = self.steps.all(*forward) * t * now - self.steps.all(*back) * before;
            (before, now) = (now, next);
        }
        all
    }

    /// The sum of all functions times their coefficients, as `sum_of` of the core takes it.
    #[inline(always)]
    fn value(&self, cell: &[u32; LANES], psi: &[f64x8<S>; B], coefficients: &[f64]) -> f64x8<S> {
        let starts = cell.each(|cell| cell as usize * B);
        let mut sum = self.steps.all(0.0);
        for (b, psi) in psi.iter().enumerate() {
            let at = |l: usize| coefficients.get(starts[l] + b).copied().unwrap_or(f64::NAN);
            sum += self.steps.vector(at) * *psi;
        }
        sum
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
    fn follow<const KEPT: usize, const IS_COLLISION: bool>(
        &self,
        steps: &[u32; LANES],
        draw: impl Fn(usize) -> [f64; LANES],
        known: &[f64],
        sources: impl Fn(&Point<f64>) -> [f64; 2],
        mut keep: impl FnMut(usize, usize, StateScores<B>),
    ) -> [Followed; LANES] {
        let lanes = &self.steps;
        let zero = lanes.all(0.0);
        let mut at = self.start(draw(0).simd_into(lanes.simd));
        let mut kept = [self.kept(&at, [zero; 2]); KEPT];
        let start = Point::new(at.cos[0], at.sin[0], at.cell[0]);
        let per_absorption = lanes.all(1.0 / lanes.circle.absorption(&start));
        // k…k of the steps from the last kept state on, and what is scored there: as by a walk that starts there.
        let (mut rest, mut after) = (lanes.all(1.0), [zero; 2]);
        // What is scored where walks are absorbed.
        let mut ends = [[0.0; 2]; LANES];
        let most = steps.iter().fold(0, |most, &steps| most.max(steps));
        let lengths = lanes.vector(|l| f64::from(steps[l]));
        for s in 0..=most {
            let mut here = [[0.0; 2]; LANES];
            for l in 0..LANES {
                if steps[l] == s || IS_COLLISION && steps[l] > s {
                    here[l] = sources(&Point::new(at.cos[l], at.sin[l], at.cell[l]));
                }
                if steps[l] == s {
                    ends[l] = here[l];
                }
            }
            let own = if IS_COLLISION {
                [lanes.vector(|l| here[l][0]), lanes.vector(|l| here[l][1])]
            } else {
                [zero; 2]
            };
            let x = self.kept(&at, own);
            if let Some(slot) = kept.get_mut(s as usize) {
                *slot = x;
            } else {
                let place = lanes.all(f64::from(s));
                if IS_COLLISION {
                    let is_there = lengths.simd_ge(place);
                    after = [
                        is_there.select(after[0] + rest * own[0], after[0]),
                        is_there.select(after[1] + rest * own[1], after[1]),
                    ];
                }
                rest = lengths.simd_gt(place).select(rest * x.k, rest);
            }
            if s < most {
                at = lanes.step(&at, draw(s as usize + 1).simd_into(lanes.simd));
            }
        }
        // What is scored at the end, by a kept state and behind all of them.
        let mut last = [zero; 2];
        if !IS_COLLISION {
            let is_long = lengths.simd_ge(lanes.all(KEPT as f64));
            for (e, (last, after)) in last.iter_mut().zip(&mut after).enumerate() {
                let own = lanes.vector(|l| ends[l][e]);
                *last = own * per_absorption;
                *after = is_long.select(zero + rest * own * per_absorption, zero);
            }
        }
        let density = lanes.all(lanes.circle.start_density(&start));
        let mut has_scored = [false; LANES];
        for s in (0..(most as usize + 1).min(KEPT)).rev() {
            let x = &kept[s];
            let place = lanes.all(s as f64);
            let (goes_on, is_end) = (lengths.simd_gt(place), lengths.simd_eq(place));
            for ((after, own), last) in after.iter_mut().zip(x.own).zip(last) {
                let ended = if IS_COLLISION { own } else { last } + zero;
                *after = goes_on.select(own + x.k * *after, ended);
            }
            let mut difference = after[0] - after[1];
            let psi = self.functions(x.sine);
            if !known.is_empty() && (IS_COLLISION || is_end.any_true()) {
                let value = self.value(&x.cell, &psi, known);
                difference = if IS_COLLISION {
                    difference - value
                } else {
                    is_end.select(difference - per_absorption * value, difference)
                };
            }
            let score = difference / density;
            for l in 0..LANES {
                if s <= steps[l] as usize {
                    let mut scores = [0.0; B];
                    for (b, slot) in scores.iter_mut().enumerate() {
                        *slot = (score * psi[b])[l];
                    }
                    let cell = x.cell[l];
                    keep(l, s, StateScores { cell, scores });
                    has_scored[l] |= after[0][l] != 0.0 || after[1][l] != 0.0;
                }
            }
        }
        let difference = after[0] - after[1];
        from_fn(|l| Followed {
            is_finite: Real::is_finite(difference[l]),
            has_scored: has_scored[l],
        })
    }
}
