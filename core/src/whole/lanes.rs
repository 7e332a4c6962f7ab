//! Walks of a whole function side by side.

use num_traits::zero;
use rand_core::{Rng, SeedableRng};

use super::task::WholeTask;
use super::{Replicate, Scores, Starts};
use crate::array::from_fn;
use crate::lanes::{BLOCK, Drawn, NUMBERS, by_length, draw};
use crate::{Equation, Estimator, NeighbourOf, NoDraws, NotFinite, RngUniforms, Uniforms};

/// Steps `L` walks at once and scores their suffixes on B functions, of an equation with h = k.
///
/// Whoever implements it promises the bits of a [`WholeTask`]: every operation on the numbers of one walk is that of
/// [`Sampler::step`](crate::Sampler::step), [`Kernel::kernel`](crate::Kernel::kernel), [`Starts`] and [`Scores`], in this order;
/// what [`Lanes`](crate::lanes::Lanes) asks of an equation; and that a start draws one number.
pub trait SuffixLanes<E: Equation, const L: usize, const B: usize> {
    /// Follows L walks: `steps` says how many steps each makes, and `draw(s)` gives what they draw for their s-th state, the start
    /// being the first; anything where a walk has ended. `sources` gives (F, G), by which they score in every state or, by the absorption
    /// estimator, where they are absorbed; `known` are the [coefficients that are known](super::WholeJob::known). Calls `keep` with a
    /// lane, the number of a state, below `KEPT`, and what is scored there.
    fn follow<const KEPT: usize, const IS_COLLISION: bool>(
        &self,
        steps: &[u32; L],
        draw: impl Fn(usize) -> [E::Scalar; L],
        known: &[f64],
        sources: impl Fn(&E::Point) -> [E::Scalar; 2],
        keep: impl FnMut(usize, usize, StateScores<B>),
    ) -> [Followed; L];
}

/// What one state of a walk scores.
#[derive(Clone, Copy, Debug)]
pub struct StateScores<const B: usize> {
    /// The number of its cell.
    pub cell: u32,
    /// D ψ_b/p0 of every function.
    pub scores: [f64; B],
}

/// What is told of a walk besides its scores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// Whether the scores of all of it are finite.
    pub is_finite: bool,
    /// Whether either equation scored anything but 0 in a suffix.
    pub has_scored: bool,
}

impl<E, T, M, S, G, const KEPT: usize> WholeTask<'_, E, T, M, S, G, KEPT>
where
    E: Equation,
    T: Starts<E>,
    M: NeighbourOf<E> + ?Sized,
    S: Scores<E::Point> + ?Sized,
    G: Rng + SeedableRng,
{
    /// Whether its walks are such as lanes follow: absorbed from the first state on, with a density that the chain preserves.
    fn fits_lanes(&self) -> bool {
        self.preserved().is_some()
    }

    /// Runs at most `at_most` further walks of a replicate as [`WholeJob::run`](super::WholeJob::run) does, with the same bits,
    /// several of them side by side if they are such as lanes follow. The scores must be those on `B` functions of the lanes.
    ///
    /// # Errors
    /// As [`WholeJob::run`](super::WholeJob::run).
    // Into code for the instructions that lanes are compiled for.
    #[inline(always)]
    pub fn run_in_lanes<W, const L: usize, const B: usize>(
        &self,
        lanes: &W,
        replicate: &mut Replicate<'_>,
        at_most: u64,
    ) -> Result<(), NotFinite>
    where
        W: SuffixLanes<E, L, B>,
    {
        let end = replicate.counts.walks.saturating_add(at_most);
        let mut block = self.fits_lanes().then(|| Block::new(self));
        while replicate.counts.walks < end {
            let left = end - replicate.counts.walks;
            let is_longer =
                match &mut block {
                    Some(block) => !match self.estimator {
                        Estimator::Absorption => block
                            .run::<_, _, _, _, _, L, KEPT, false>(self, lanes, replicate, left)?,
                        Estimator::Collision => block
                            .run::<_, _, _, _, _, L, KEPT, true>(self, lanes, replicate, left)?,
                    },
                    None => true,
                };
            if is_longer {
                self.run_walks(
                    self.estimator,
                    replicate,
                    if block.is_some() { 1 } else { left },
                )?;
            }
        }
        Ok(())
    }
}

/// What the walks of a block keep from their draws to their scores.
struct Block<E: Equation, const B: usize> {
    /// q.
    absorption: E::Scalar,
    /// What states draw, walk after walk, and what they score.
    numbers: [E::Scalar; NUMBERS],
    scores: [StateScores<B>; NUMBERS],
    drawn: [Drawn; BLOCK],
    followed: [Followed; BLOCK],
}

impl<E: Equation, const B: usize> Block<E, B> {
    #[inline(always)]
    fn new<T, M, S, G, const KEPT: usize>(task: &WholeTask<'_, E, T, M, S, G, KEPT>) -> Self
    where
        T: Starts<E>,
        M: NeighbourOf<E> + ?Sized,
        S: ?Sized,
        G: Rng + SeedableRng,
    {
        // Any state: the probability is the same everywhere.
        let any = task.starts.start(&mut RngUniforms(task.seeds.generator(0)));
        let nothing = StateScores {
            cell: 0,
            scores: [0.0; B],
        };
        Self {
            absorption: task.equation.absorption(&any),
            numbers: [zero(); NUMBERS],
            scores: [nothing; NUMBERS],
            drawn: [Drawn::default(); BLOCK],
            followed: [Followed::default(); BLOCK],
        }
    }

    /// Runs at most `walks` walks. Says whether it has run any: if not, the next one is longer than there is room, or than it may be.
    #[inline(always)]
    fn run<T, M, S, G, W, const L: usize, const KEPT: usize, const IS_COLLISION: bool>(
        &mut self,
        task: &WholeTask<'_, E, T, M, S, G, KEPT>,
        lanes: &W,
        replicate: &mut Replicate<'_>,
        walks: u64,
    ) -> Result<bool, NotFinite>
    where
        T: Starts<E>,
        M: NeighbourOf<E> + ?Sized,
        S: ?Sized,
        G: Rng + SeedableRng,
        W: SuffixLanes<E, L, B>,
    {
        let Self {
            absorption,
            numbers,
            scores,
            drawn,
            followed,
        } = self;
        let (mut used, mut count) = (0, 0);
        let numbered = (0..walks).map(|i| replicate.walk(i));
        for (number, slot) in numbered.zip(&mut *drawn) {
            let mut uniforms = RngUniforms(task.seeds.generator(number));
            let Some(start) = numbers.get_mut(used) else {
                break;
            };
            *start = uniforms.uniform();
            let (first, most) = (used, task.length.step_limit);
            used += 1;
            let Some(walk) = draw(*absorption, most, (&mut *numbers, &mut used), uniforms) else {
                break;
            };
            let first = first as u32;
            *slot = Drawn { first, ..walk };
            count += 1;
        }
        let order = by_length(drawn, count);
        for group in order.get(..count).unwrap_or(&[]).chunks(L) {
            // The last group may have fewer: its last walk fills the lanes.
            let last = group.last().copied().unwrap_or(0);
            let places: [usize; L] =
                from_fn(|l| usize::from(group.get(l).copied().unwrap_or(last)) % BLOCK);
            let steps = from_fn(|l| drawn[places[l]].steps);
            let at: [usize; L] = from_fn(|l| drawn[places[l]].first as usize);
            let all = lanes.follow::<KEPT, IS_COLLISION>(
                &steps,
                // Never behind the end: a walk that goes on has drawn as many.
                |s| from_fn(|l| numbers[(at[l] + s) % NUMBERS]),
                task.known,
                |x| {
                    let y = task.neighbour.locate(*x);
                    [
                        task.equation.sample_source(x, &mut NoDraws),
                        task.neighbour.source(&y, &mut NoDraws),
                    ]
                },
                |l, s, state| {
                    if let Some(slot) = scores.get_mut(at[l] + s) {
                        *slot = state;
                    }
                },
            );
            for l in 0..L {
                followed[places[l]] = all[l];
            }
        }
        let all = drawn.iter().zip(&*followed).take(count);
        for (walk, followed) in all {
            if !followed.is_finite {
                return Err(NotFinite {
                    walk: replicate.next_walk(),
                });
            }
            let states = walk.steps as usize + 1;
            let own = scores.iter().skip(walk.first as usize);
            let own = own.take(states.min(KEPT));
            for StateScores { cell, scores } in own {
                let start = *cell as usize * B;
                if let Some(sums) = replicate.sums.get_mut(start..start + B) {
                    for (sum, score) in sums.iter_mut().zip(scores) {
                        *sum += score;
                    }
                }
            }
            let counts = &mut replicate.counts;
            counts.walks += 1;
            counts.states += states as u64;
            counts.scored += u64::from(followed.has_scored);
        }
        Ok(count > 0)
    }
}
