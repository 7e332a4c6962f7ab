//! Walks side by side on the circle: eight of them make a step at once, with the bits of one alone.
//!
//! `fearless_simd` was chosen of the crates whose vectors need no `unsafe` where they are used: it has no dependencies,
//! compiles a function for several sets of instructions and asks the processor which to take, so that what everybody builds
//! has vectors of four and eight doubles where there are some. (`wide` takes what the compiler was told to build for: two
//! doubles on most machines. `pulp` has no vectors of a fixed width.) It fuses no multiplication with an addition unless
//! told to, so that a lane has the bits of the scalar step.

use fearless_simd::{Simd, f64x8, mask64x8, prelude::*};
use fredholm_core::array::{Each, from_fn};
use fredholm_core::galerkin::{DiagonalRule, NeighbourSource, PairKind, Piecewise};
use fredholm_core::lanes::{Arrival, Lanes, Start};
use fredholm_core::{
    Batch, DefaultGenerator, Form, Functional, Goals, Job, Located, Neighbour, NotFinite, Real,
    Task,
};

use crate::{Circle, ClosedForm, Emission, Point, Residual};

/// Walks at once: two vectors of AVX2, so that one fills the other's waits, or one of AVX-512.
pub(crate) const LANES: usize = 8;

const TWO_TO_52: f64 = 4_503_599_627_370_496.0;

/// The h of a neighbour equation as lanes follow it.
#[derive(Clone, Copy, Debug)]
pub enum LanePairs<'a, F> {
    /// h = k on all pairs.
    Same,
    /// All pairs of different cells in S, with the circle's own coefficients of degree 0, and the solution v.
    Different {
        /// Whether h = k on the diagonal, or 0.
        is_diagonal_pointwise: bool,
        /// v, one number a cell.
        solution: &'a [F],
    },
}

/// A neighbour equation whose h lanes may know.
pub trait LaneNeighbour<F: Real, E>: Neighbour<Scalar = F, Point = Point<F>> {
    /// The h of the neighbour equation, if it is that of this circle and lanes know it.
    fn lane_pairs(&self, circle: &Circle<'_, F, E>) -> Option<LanePairs<'_, F>>;
}

impl<F: Real, E, P, const B: usize> LaneNeighbour<F, E> for Residual<'_, F, P, B>
where
    P: ClosedForm<F, B>,
{
    fn lane_pairs(&self, _: &Circle<'_, F, E>) -> Option<LanePairs<'_, F>> {
        Some(LanePairs::Same)
    }
}

impl<'c, F: Real, E: Emission<F>, G> LaneNeighbour<F, E>
    for Piecewise<'_, F, Circle<'c, F, E>, Circle<'c, F, E>, DiagonalRule, G>
where
    G: NeighbourSource<Scalar = F, Point = Point<F>>,
{
    fn lane_pairs(&self, circle: &Circle<'_, F, E>) -> Option<LanePairs<'_, F>> {
        let (problem, coefficients, pairs, solution) = self.parts();
        let is_own =
            |other: &Circle<'c, F, E>| core::ptr::addr_eq(&raw const *other, &raw const *circle);
        let is_known = pairs.diagonal != PairKind::Galerkin;
        (is_known && is_own(problem) && is_own(coefficients)).then_some(LanePairs::Different {
            is_diagonal_pointwise: pairs.diagonal == PairKind::Pointwise,
            solution,
        })
    }
}

/// [`Goals`] on a circle, whose walks in f64 go side by side where the processor has vectors of four doubles or more;
/// otherwise one by one. The bits are the same.
///
/// ```
/// use fredholm_circle::{Circle, Harmonic, Residual, SideBySide, Tables, residual_moments};
/// use fredholm_core::{At, Batch, Goal, Goals, Job, WalkOptions};
///
/// let tables = Tables::new(&[0.5, 0.7], 100)?;
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// let circle = Circle::new(tables.cells(), light, 0.2)?;
/// let solution = circle.solve(1e-14, 1000)?;
/// let moments = residual_moments(&circle, &solution)?;
/// let neighbour: Residual<_, _> = Residual::new(&circle, &solution.v, &moments)?;
/// let goals = [Goal { functional: At(circle.point(0.3)), control_mean: Some(solution.v[4]) }];
/// let goals = Goals::new(&circle, &neighbour, &goals, WalkOptions::default());
/// let [mut one_by_one, mut side_by_side] = [Batch::new(0, 1000, 1000); 2];
/// goals.run(0, &mut one_by_one, 1000)?;
/// SideBySide::new(goals).run(0, &mut side_by_side, 1000)?;
/// assert_eq!(side_by_side, one_by_one);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SideBySide<'a, 'c, F, E, N: ?Sized, T> {
    goals: Goals<'a, Circle<'c, F, E>, N, T>,
    pairs: Option<LanePairs<'a, F>>,
}

impl<'a, 'c, F: Real, E, N, T> SideBySide<'a, 'c, F, E, N, T>
where
    N: LaneNeighbour<F, E>,
{
    /// This job, side by side if lanes know its h.
    pub fn new(goals: Goals<'a, Circle<'c, F, E>, N, T>) -> Self {
        let pairs = goals.neighbour.lane_pairs(goals.equation);
        Self { goals, pairs }
    }
}

impl<'a, 'c, F: Real, E, N: ?Sized, T> SideBySide<'a, 'c, F, E, N, T> {
    /// This job, of whose neighbour equation the caller promises that h = k everywhere.
    #[must_use]
    pub const fn with_same_kernel(goals: Goals<'a, Circle<'c, F, E>, N, T>) -> Self {
        Self {
            goals,
            pairs: Some(LanePairs::Same),
        }
    }
}

impl<F, E, N, T> Job for SideBySide<'_, '_, F, E, N, T>
where
    F: LaneReal,
    E: Emission<F> + Sync,
    N: Neighbour<Scalar = F, Point = Point<F>> + Sync + ?Sized,
    T: for<'x> Functional<Circle<'x, F, E>> + Sync,
{
    fn goals(&self) -> usize {
        self.goals.goals()
    }

    fn run(&self, goal: usize, batch: &mut Batch, at_most: u64) -> Result<(), NotFinite> {
        if let Some(task) = self.goals.task(goal) {
            match self.pairs {
                Some(pairs) => F::run(&task, pairs, batch, at_most)?,
                None => batch.run(&task, at_most)?,
            }
        }
        Ok(())
    }
}

/// A scalar of walks side by side.
pub trait LaneReal: Real {
    /// Runs walks of a batch side by side, or as [`Batch::run`] does where the processor has nothing for it.
    ///
    /// # Errors
    /// As [`Batch::run`].
    fn run<E, N, T>(
        task: &Task<'_, Circle<'_, Self, E>, N, T, DefaultGenerator>,
        pairs: LanePairs<'_, Self>,
        batch: &mut Batch,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        E: Emission<Self>,
        N: Neighbour<Scalar = Self, Point = Point<Self>> + ?Sized,
        T: for<'x> Functional<Circle<'x, Self, E>>;
}

/// One by one: there are no lanes of f32.
impl LaneReal for f32 {
    fn run<E, N, T>(
        task: &Task<'_, Circle<'_, Self, E>, N, T, DefaultGenerator>,
        _: LanePairs<'_, Self>,
        batch: &mut Batch,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        E: Emission<Self>,
        N: Neighbour<Scalar = Self, Point = Point<Self>> + ?Sized,
        T: for<'x> Functional<Circle<'x, Self, E>>,
    {
        batch.run(task, at_most)
    }
}

impl LaneReal for f64 {
    fn run<E, N, T>(
        task: &Task<'_, Circle<'_, Self, E>, N, T, DefaultGenerator>,
        pairs: LanePairs<'_, Self>,
        batch: &mut Batch,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        E: Emission<Self>,
        N: Neighbour<Scalar = Self, Point = Point<Self>> + ?Sized,
        T: for<'x> Functional<Circle<'x, Self, E>>,
    {
        // Vectors of two doubles gain nothing.
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            let level = fearless_simd::Level::new();
            if let Some(simd) = level.as_avx512() {
                return vectorize(simd, task, pairs, batch, at_most);
            }
            if let Some(simd) = level.as_avx2() {
                return vectorize(simd, task, pairs, batch, at_most);
            }
        }
        batch.run(task, at_most)
    }
}

/// Runs walks of a batch with the instructions of `simd`.
fn vectorize<S, E, N, T>(
    simd: S,
    task: &Task<'_, Circle<'_, f64, E>, N, T, DefaultGenerator>,
    pairs: LanePairs<'_, f64>,
    batch: &mut Batch,
    at_most: u64,
) -> Result<(), NotFinite>
where
    S: Simd,
    E: Emission<f64>,
    N: Neighbour<Scalar = f64, Point = Point<f64>> + ?Sized,
    T: for<'x> Functional<Circle<'x, f64, E>>,
{
    // A closure: a function that it calls has the instructions that all machines have, unless it is inlined.
    simd.vectorize(
        #[inline(always)]
        || {
            let lanes = CircleLanes {
                simd,
                circle: task.equation,
                pairs,
                is_residual: task.form == Form::Residual,
            };
            batch.run_in_lanes(task, &lanes, at_most)
        },
    )
}

/// Eight walks on a circle.
pub(crate) struct CircleLanes<'a, 'c, S, E> {
    pub(crate) simd: S,
    pub(crate) circle: &'a Circle<'c, f64, E>,
    pub(crate) pairs: LanePairs<'a, f64>,
    pub(crate) is_residual: bool,
}

/// Where eight walks are, and what their scores are multiplied by.
#[derive(Clone, Copy)]
struct Walkers<S: Simd> {
    at: Places<S>,
    weight_k: f64x8<S>,
    weight_h: f64x8<S>,
    plain: f64x8<S>,
    control: f64x8<S>,
}

/// Eight points with what their cells look up.
#[derive(Clone, Copy)]
pub(crate) struct Places<S: Simd> {
    pub(crate) cos: f64x8<S>,
    pub(crate) sin: f64x8<S>,
    pub(crate) cell: [u32; LANES],
    pub(crate) middle_cos: f64x8<S>,
    pub(crate) middle_sin: f64x8<S>,
    pub(crate) reflectance: f64x8<S>,
}

impl<S: Simd, E: Emission<f64>> CircleLanes<'_, '_, S, E> {
    #[inline(always)]
    pub(crate) fn all(&self, x: f64) -> f64x8<S> {
        f64x8::splat(self.simd, x)
    }

    #[inline(always)]
    pub(crate) fn vector(&self, each: impl FnMut(usize) -> f64) -> f64x8<S> {
        let array: [f64; LANES] = from_fn(each);
        array.simd_into(self.simd)
    }

    /// The points with these half angles and cells.
    #[inline(always)]
    pub(crate) fn places(&self, cos: f64x8<S>, sin: f64x8<S>, cell: [u32; LANES]) -> Places<S> {
        let looked_up: [[f64; 3]; LANES] = cell.each(|cell| {
            let cell = self.circle.table().get(cell as usize);
            cell.map_or([f64::NAN; 3], |cell| {
                [cell.middle.cos, cell.middle.sin, cell.reflectance]
            })
        });
        Places {
            cos,
            sin,
            cell,
            middle_cos: self.vector(|l| looked_up[l][0]),
            middle_sin: self.vector(|l| looked_up[l][1]),
            reflectance: self.vector(|l| looked_up[l][2]),
        }
    }

    /// The points that a step leads to, computed as [`Circle::step`](fredholm_core::Sampler::step) does.
    #[inline(always)]
    pub(crate) fn step(&self, x: &Places<S>, xi: f64x8<S>) -> Places<S> {
        let one = self.all(1.0);
        let turn_cos = one - (xi + xi);
        let root = (xi * (one - xi)).sqrt();
        let turn_sin = root + root;
        self.places_at(
            x.cos * turn_cos - x.sin * turn_sin,
            x.sin * turn_cos + x.cos * turn_sin,
        )
    }

    /// The points with half angles of this cosine and this sine, computed as [`Circle::point_at`] does.
    #[inline(always)]
    pub(crate) fn places_at(&self, cos: f64x8<S>, sin: f64x8<S>) -> Places<S> {
        let half = self.all(0.5);
        let length = self.all(1.5) - half * (cos * cos + sin * sin);
        let scale = length.copysign(sin);
        let (cos, sin) = (cos * scale, sin * scale);
        let angle = half - half * cos / (cos.abs() + sin);
        let (cells, slots) = self.circle.table().tables();
        // The integer part is what the lowest bits of 2⁵² + its value hold.
        let number = (angle * self.all(slots.len() as f64)).floor() + self.all(TWO_TO_52);
        let cell = from_fn(|l| match slots.get(number[l].to_bits() as u32 as usize) {
            Some(slot) => {
                let (end, cell) = slot.parts();
                cell + u32::from(angle[l] >= end)
            }
            None => cells.len() as u32 - 1,
        });
        self.places(cos, sin, cell)
    }

    /// |sin| of half the angle from x to the middle of the cells of y: as `Direction::sine`.
    #[inline(always)]
    fn sine(&self, x: &Places<S>, y: &Places<S>) -> f64x8<S> {
        let rough = (y.middle_sin * x.cos - y.middle_cos * x.sin).abs();
        let is_small = rough.simd_lt(self.all(0.25));
        // A third to a quarter of all times.
        if is_small.any_true() {
            is_small.select(self.small_sine(x, y).abs(), rough)
        } else {
            rough
        }
    }

    /// The sine of small angles from x to the middles, computed as `Direction::small_sine` does.
    #[inline(always)]
    fn small_sine(&self, x: &Places<S>, y: &Places<S>) -> f64x8<S> {
        let low: [[f64; 2]; LANES] = y.cell.each(|cell| {
            let cell = self.circle.table().get(cell as usize);
            cell.map_or([f64::NAN; 2], |cell| {
                [cell.middle.cos_low, cell.middle.sin_low]
            })
        });
        let cos_low = self.vector(|l| low[l][0]);
        let sin_low = self.vector(|l| low[l][1]);
        let (left, right) = (y.middle_sin * x.cos, y.middle_cos * x.sin);
        let left_low = self.product_error(y.middle_sin, x.cos);
        let right_low = self.product_error(y.middle_cos, x.sin);
        // A point has no rounding errors that are known; nothing is added for them.
        let low = sin_low * x.cos - cos_low * x.sin;
        (left - right) + ((left_low - right_low) + low)
    }

    /// The rounding error of a product, computed as [`Real::product_error`](fredholm_core::Real::product_error) does.
    #[inline(always)]
    fn product_error(&self, a: f64x8<S>, b: f64x8<S>) -> f64x8<S> {
        let halves = |x: f64x8<S>| {
            let shifted = self.all(134_217_729.0) * x;
            let high = shifted - (shifted - x);
            [high, x - high]
        };
        let [a_high, a_low] = halves(a);
        let [b_high, b_low] = halves(b);
        (((a_high * b_high - a * b) + a_high * b_low) + a_low * b_high) + a_low * b_low
    }

    /// These, with what they score where they are if they score in every state.
    #[inline(always)]
    fn scored(
        &self,
        walkers: &Walkers<S>,
        sources: Option<&impl Fn(&[Located<Point<f64>>; LANES]) -> [[f64; LANES]; 2]>,
    ) -> Walkers<S> {
        let Some(sources) = sources else {
            return *walkers;
        };
        let [f, g] = sources(&walkers.located());
        let [f, g]: [f64x8<S>; 2] = [f.simd_into(self.simd), g.simd_into(self.simd)];
        Walkers {
            plain: walkers.plain + walkers.weight_k * f,
            control: walkers.control + walkers.weight_h * g,
            ..*walkers
        }
    }

    /// The next state of all walks.
    #[inline(always)]
    fn advance(&self, from: &Walkers<S>, xi: f64x8<S>) -> Walkers<S> {
        let x = &from.at;
        let y = self.step(x, xi);
        let constants = &self.circle.constants();
        let k = x.reflectance * self.all(constants.per_survival());
        let mut next = Walkers {
            at: y,
            weight_k: from.weight_k * k,
            weight_h: from.weight_h * k,
            plain: from.plain,
            control: from.control,
        };
        if let LanePairs::Different {
            is_diagonal_pointwise,
            solution,
        } = self.pairs
        {
            let coefficient = x.reflectance
                * self.all(constants.galerkin())
                * (y.middle_sin * x.middle_cos - y.middle_cos * x.middle_sin).abs();
            let h = coefficient / (self.all(constants.mass()) * self.sine(x, &y));
            // Cells have different middles.
            let is_diagonal =
                y.middle_cos.simd_eq(x.middle_cos) & y.middle_sin.simd_eq(x.middle_sin);
            let on_diagonal = if is_diagonal_pointwise {
                k
            } else {
                self.all(0.0)
            };
            let h = is_diagonal.select(on_diagonal, h);
            if self.is_residual {
                let v = self.vector(|l| {
                    let v = solution.get(y.cell[l] as usize);
                    v.copied().unwrap_or(f64::NAN)
                });
                let difference = h - k;
                let score = from.weight_h * difference * v;
                let is_any = difference.simd_eq(self.all(0.0));
                next.control = is_any.select(from.control, from.control + score);
            } else {
                next.weight_h = from.weight_h * h;
            }
        }
        next
    }
}

impl<S: Simd> Walkers<S> {
    /// These where `is_new`, the others elsewhere.
    #[inline(always)]
    fn or(self, is_new: mask64x8<S>, goes_on: [bool; LANES], old: &Self) -> Self {
        Self {
            at: Places {
                cos: is_new.select(self.at.cos, old.at.cos),
                sin: is_new.select(self.at.sin, old.at.sin),
                cell: from_fn(|l| {
                    if goes_on[l] {
                        self.at.cell[l]
                    } else {
                        old.at.cell[l]
                    }
                }),
                // Where a walk has ended nothing is looked up.
                ..self.at
            },
            weight_k: is_new.select(self.weight_k, old.weight_k),
            weight_h: is_new.select(self.weight_h, old.weight_h),
            plain: is_new.select(self.plain, old.plain),
            control: is_new.select(self.control, old.control),
        }
    }

    /// The points.
    #[inline(always)]
    fn located(&self) -> [Located<Point<f64>>; LANES] {
        from_fn(|l| {
            let point = Point::new(self.at.cos[l], self.at.sin[l], self.at.cell[l]);
            Located {
                point,
                cell: point.cell(),
            }
        })
    }
}

impl<'c, S: Simd, E: Emission<f64>> Lanes<Circle<'c, f64, E>, LANES> for CircleLanes<'_, 'c, S, E> {
    #[inline(always)]
    fn follow(
        &self,
        starts: &[Start<Circle<'c, f64, E>>; LANES],
        steps: &[u32; LANES],
        draw: impl Fn(usize) -> [f64; LANES],
        sources: Option<impl Fn(&[Located<Point<f64>>; LANES]) -> [[f64; LANES]; 2]>,
    ) -> [Arrival<Circle<'c, f64, E>>; LANES] {
        let cells = from_fn(|l| starts[l].x.cell as u32);
        let cos = self.vector(|l| starts[l].x.point.half_angle().0);
        let sin = self.vector(|l| starts[l].x.point.half_angle().1);
        let phi = self.vector(|l| starts[l].phi);
        let mut walkers = Walkers {
            at: self.places(cos, sin, cells),
            weight_k: phi,
            weight_h: phi,
            plain: self.all(0.0),
            control: self.all(0.0),
        };
        let least = steps
            .iter()
            .fold(u32::MAX, |least, &steps| least.min(steps));
        let most = steps.iter().fold(0, |most, &steps| most.max(steps));
        let ends = self.vector(|l| f64::from(steps[l]));
        for s in 0..most {
            let next = self.advance(
                &self.scored(&walkers, sources.as_ref()),
                draw(s as usize).simd_into(self.simd),
            );
            walkers = if s < least {
                next
            } else {
                let is_new = ends.simd_gt(self.all(f64::from(s)));
                next.or(is_new, steps.each(|steps| s < steps), &walkers)
            };
        }
        let walkers = self.scored(&walkers, sources.as_ref());
        let located = walkers.located();
        from_fn(|l| Arrival {
            x: located[l],
            weight_k: walkers.weight_k[l],
            weight_h: walkers.weight_h[l],
            plain: walkers.plain[l],
            control: walkers.control[l],
        })
    }
}
