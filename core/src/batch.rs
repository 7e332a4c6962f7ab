//! Batches: the unit of work that runners hand out.

use core::fmt;

use rand_core::{Rng, SeedableRng};

use crate::lanes::{Block, Lanes};
use crate::{
    Equation, Estimator, Form, Functional, Generators, Length, Located, NeighbourOf, Real,
    RngUniforms, Statistics, Termination, Uniforms, Walk, WalkNumber, WalkSeeds,
    uniforms::ControlDraws, walk,
};

/// The equations, goal, estimator and seeds of one goal: everything that a walk of it depends on. A
/// batch's statistics follow from a task and from walk numbers, and from nothing else.
#[derive(Debug)]
pub struct Task<'a, E, N: ?Sized, T, G> {
    /// The equation and its chain.
    pub equation: &'a E,
    /// The neighbour equation.
    pub neighbour: &'a N,
    /// The functional: where walks start, and what is estimated.
    pub functional: &'a T,
    /// (v, Φ), exact. `None`: [`Functional::control_estimate`] walk by walk, which is unbiased too; but
    /// for a spread-out start its own variance stays in that of ζ.
    pub control_mean: Option<f64>,
    /// The estimator: what a walk scores.
    pub estimator: Estimator,
    /// The form of the control variate.
    pub form: Form,
    /// The seeds of the walks' generators.
    pub seeds: WalkSeeds<G>,
    /// How long walks are followed.
    pub length: Length,
}

/// The default of [`Length::step_limit`]: with absorption probability q ≥ 10⁻³ in every state a walk
/// in 10⁴³⁰ gets there.
pub const STEP_LIMIT: u32 = 1_000_000;

/// A walk scored an infinity or NaN. The walk can be run again alone by [`Task::replay`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotFinite {
    /// The number of the walk.
    pub walk: u64,
}

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "walk {} scored a value that is not finite", self.walk)
    }
}

impl core::error::Error for NotFinite {}

impl<E, N, T, G> Task<'_, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Rng + SeedableRng,
{
    /// Runs walk number `walk` alone: the same scores as within its batch.
    #[inline]
    #[must_use]
    pub fn replay(&self, walk: u64) -> Walk<E::Scalar> {
        self.alone(walk).0
    }

    /// A walk, and (v, Φ) or its own part of it.
    #[inline]
    pub(crate) fn alone(&self, walk: u64) -> (Walk<E::Scalar>, f64) {
        let alone = WalkNumber {
            walk,
            replicate: walk,
            index: 0,
        };
        self.follow(self.estimator, alone, &mut ())
    }
}

impl<E, N, T, G> Task<'_, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
    G: Generators,
{
    /// A walk, and (v, Φ) or its own part of it.
    #[inline(always)]
    fn follow(
        &self,
        estimator: Estimator,
        number: WalkNumber,
        memory: &mut G::Memory,
    ) -> (Walk<E::Scalar>, f64) {
        let mut draws = RngUniforms(G::generator(&self.seeds, number, memory));
        let (x0, phi, value) = self.start(&mut draws);
        let walk = walk(
            self.equation,
            self.neighbour,
            (x0, phi),
            (estimator, self.form),
            &self.length,
            &mut draws,
            &mut ControlDraws::<G::Random>::new(&self.seeds, number.walk),
        );
        (walk, value)
    }
}

impl<E, N, T, G> Task<'_, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    T: Functional<E>,
{
    /// A start x0, φ(x0), and (v, Φ) or the start's own part of it.
    #[inline(always)]
    pub(crate) fn start<U: Uniforms<E::Scalar>>(
        &self,
        draws: &mut U,
    ) -> (Located<E::Point>, E::Scalar, f64) {
        let (x0, phi) = self.functional.start(draws);
        let x0 = self.neighbour.locate(x0);
        let value = match self.control_mean {
            Some(value) => value,
            None => {
                let v = self.neighbour.value(&x0);
                self.functional.control_estimate(&x0, phi, v)
            }
        };
        (x0, phi, value)
    }
}

/// Consecutive walks of a task and their statistics so far. Work on it may stop after any walk and
/// go on later with the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Batch {
    next: u64,
    end: u64,
    statistics: Statistics,
}

impl Batch {
    /// Batch number `index` of batches of `size` walks, the last of which ends at `walks` walks.
    #[must_use]
    pub fn new(index: u64, size: u64, walks: u64) -> Self {
        let next = index.saturating_mul(size).min(walks);
        Self {
            next,
            end: next.saturating_add(size).min(walks),
            statistics: Statistics::default(),
        }
    }

    /// Goes on with a batch after the walks of `statistics`. `None`: the batch has fewer walks.
    #[must_use]
    pub fn resume(index: u64, size: u64, walks: u64, statistics: Statistics) -> Option<Self> {
        let fresh = Self::new(index, size, walks);
        let next = fresh.next.checked_add(statistics.walks())?;
        (next <= fresh.end).then_some(Self {
            next,
            statistics,
            ..fresh
        })
    }

    /// Runs at most `at_most` further walks.
    ///
    /// # Errors
    /// [`NotFinite`]: a walk scored an infinity or NaN. It is not in the statistics; the batch
    /// stands before it.
    pub fn run<E, N, T, G>(
        &mut self,
        task: &Task<'_, E, N, T, G>,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        E: Equation,
        N: NeighbourOf<E> + ?Sized,
        T: Functional<E>,
        G: Generators,
    {
        let mut memory = G::Memory::default();
        let memory = &mut memory;
        let known = task.functional.known();
        // The estimator is a constant within each arm, so no walk asks for it.
        let outcome = match task.estimator {
            Estimator::Absorption => self.run_walks((at_most, known), |n| {
                task.follow(Estimator::Absorption, n, memory)
            }),
            Estimator::Collision => self.run_walks((at_most, known), |n| {
                task.follow(Estimator::Collision, n, memory)
            }),
        };
        if G::IS_SEQUENCE {
            self.statistics.become_replicate();
        }
        outcome
    }

    #[inline(always)]
    fn run_walks<F: Real>(
        &mut self,
        (at_most, known): (u64, f64),
        mut walk: impl FnMut(WalkNumber) -> (Walk<F>, f64),
    ) -> Result<(), NotFinite> {
        let end = self.end.min(self.next.saturating_add(at_most));
        let first = self.next.saturating_sub(self.statistics.walks());
        let mut outcome = Ok(());
        while self.next < end {
            let (scores, value) = walk(WalkNumber {
                walk: self.next,
                replicate: first,
                index: self.next.wrapping_sub(first),
            });
            outcome = self.push(&scores, value, known);
            if outcome.is_err() {
                break;
            }
        }
        outcome
    }

    /// Adds the next walk.
    #[inline(always)]
    pub(crate) fn push<F: Real>(
        &mut self,
        scores: &Walk<F>,
        value: f64,
        known: f64,
    ) -> Result<(), NotFinite> {
        if scores.termination == Termination::NotFinite || !value.is_finite() {
            return Err(self.not_finite());
        }
        self.statistics.push(scores, value, known);
        self.next += 1;
        Ok(())
    }

    /// Runs at most `at_most` further walks as [`run`](Self::run) does, with the same bits, several of them side by side if
    /// they are such as [`Lanes`] follow.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    // Into code for the instructions that lanes are compiled for.
    #[inline(always)]
    pub fn run_in_lanes<E, N, T, G, W, const L: usize>(
        &mut self,
        task: &Task<'_, E, N, T, G>,
        lanes: &W,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        E: Equation,
        N: NeighbourOf<E> + ?Sized,
        T: Functional<E>,
        G: Rng + SeedableRng,
        W: Lanes<E, L>,
    {
        if !task.fits_lanes() {
            return self.run(task, at_most);
        }
        let end = self.end.min(self.next.saturating_add(at_most));
        let mut outcome = Ok(());
        let known = task.functional.known();
        let mut block = Block::new(task);
        while self.next < end && outcome.is_ok() {
            let (first, walks) = (self.next, end - self.next);
            let push = |walk: &Walk<E::Scalar>, value| {
                outcome = self.push(walk, value, known);
                outcome.is_ok()
            };
            // The estimator is a constant within each arm.
            match task.estimator {
                Estimator::Absorption => {
                    block.run::<_, _, _, _, L, false>(task, lanes, first, walks, push);
                }
                Estimator::Collision => {
                    block.run::<_, _, _, _, L, true>(task, lanes, first, walks, push);
                }
            }
        }
        outcome
    }

    /// Says that (v, Φ) of the task is an estimate of its own with this standard error, which does not depend on the
    /// walks: it is part of the error bars of ζ from then on.
    pub const fn set_control_error(&mut self, error: f64) {
        self.statistics.set_control_error(error);
    }

    /// The number of the walk that is next; `None`: all have been run.
    pub(crate) fn next_walk(&self) -> Option<u64> {
        (!self.is_done()).then_some(self.next)
    }

    /// The error of the walk that is next.
    pub(crate) const fn not_finite(&self) -> NotFinite {
        NotFinite { walk: self.next }
    }

    /// Whether all its walks have been run.
    #[must_use]
    pub const fn is_done(&self) -> bool {
        self.next >= self.end
    }

    /// The statistics of the walks so far.
    #[must_use]
    pub const fn statistics(&self) -> &Statistics {
        &self.statistics
    }
}
