//! Walks side by side: several walks of a batch make their steps at once, with the bits that each has alone.

use num_traits::{one, zero};
use rand_core::{Rng, SeedableRng};

use crate::array::from_fn;
use crate::{
    Equation, Functional, Located, NeighbourOf, NoDraws, Real, RngUniforms, StateSpace, Task,
    Termination, Uniforms, Walk,
};

/// The walks that are drawn before the first of them steps: enough of each length that lanes end together.
pub(crate) const BLOCK: usize = 512;

/// How many numbers they draw for their steps, at most.
pub(crate) const NUMBERS: usize = 8 * BLOCK;

/// Walks of so many steps and of more are sorted as if they were of one length.
const LENGTHS: usize = 64;

/// Steps `L` walks of an equation at once, from their starts to where they are absorbed.
///
/// Whoever implements it promises the bits of [`walk`](crate::walk()): every operation on the numbers of one walk is that of
/// [`Sampler::step`](crate::Sampler::step), [`Kernel::kernel`](crate::Kernel::kernel) and
/// [`Neighbour::kernel`](crate::Neighbour::kernel), in this order; and that the equation absorbs with the same probability
/// everywhere, that each of its steps draws one number and none leaves the space, and that neither F nor G draws.
pub trait Lanes<E: Equation, const L: usize> {
    /// Follows L walks: `steps` says how many steps each makes, and `draw(s)` gives what they draw in step s: anything where a
    /// walk has ended. With the collision estimator `sources` gives F and G in L states, and every walk scores both in each of its
    /// own, the last included; there is none with the absorption estimator.
    fn follow(
        &self,
        starts: &[Start<E>; L],
        steps: &[u32; L],
        draw: impl Fn(usize) -> [E::Scalar; L],
        sources: Option<impl Fn(&[Located<E::Point>; L]) -> [[E::Scalar; L]; 2]>,
    ) -> [Arrival<E>; L];
}

/// Where a walk starts.
#[derive(Debug)]
pub struct Start<E: StateSpace> {
    /// x0.
    pub x: Located<E::Point>,
    /// φ(x0).
    pub phi: E::Scalar,
}

/// Where a walk is absorbed.
#[derive(Debug)]
pub struct Arrival<E: StateSpace> {
    /// x_m.
    pub x: Located<E::Point>,
    /// φ(x0) k(x0,x1) … k(x_{m−1},x_m).
    pub weight_k: E::Scalar,
    /// What a score of G is multiplied by.
    pub weight_h: E::Scalar,
    /// What the equation has scored before.
    pub plain: E::Scalar,
    /// What the neighbour equation has scored before.
    pub control: E::Scalar,
}

// By hand: a derive would ask the equation to be `Clone` and `Copy`.
impl<E: StateSpace> Clone for Start<E> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E: StateSpace> Copy for Start<E> {}
impl<E: StateSpace> Clone for Arrival<E> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<E: StateSpace> Copy for Arrival<E> {}

/// The numbers of a walk before its steps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Drawn {
    /// Where they begin.
    pub(crate) first: u32,
    pub(crate) steps: u32,
}

/// What the walks of a block keep from their draws to their scores.
pub(crate) struct Block<E: StateSpace> {
    /// What the steps draw, walk after walk.
    numbers: [E::Scalar; NUMBERS],
    drawn: [Drawn; BLOCK],
    starts: [Start<E>; BLOCK],
    /// (v, Φ).
    values: [f64; BLOCK],
    scores: [Walk<E::Scalar>; BLOCK],
}

impl<E: Equation> Block<E> {
    #[inline(always)]
    pub(crate) fn new<N, T, G>(task: &Task<'_, E, N, T, G>) -> Self
    where
        N: NeighbourOf<E> + ?Sized,
        T: Functional<E>,
        G: Rng + SeedableRng,
    {
        // Any start, where there are no walks yet.
        let (x, phi, value) = task.start(&mut RngUniforms(task.seeds.generator(0)));
        let nothing = Walk {
            plain: zero(),
            control: zero(),
            states: 0,
            termination: Termination::Absorbed,
        };
        Self {
            numbers: [zero(); NUMBERS],
            drawn: [Drawn::default(); BLOCK],
            starts: [Start { x, phi }; BLOCK],
            values: [value; BLOCK],
            scores: [nothing; BLOCK],
        }
    }

    /// Runs at most `walks` walks from number `first` on, by the collision or the absorption estimator, and calls `push` with the scores and
    /// (v, Φ) of each in their order, until it says no. At least one is run.
    #[inline(always)]
    pub(crate) fn run<N, T, G, W, const L: usize, const IS_COLLISION: bool>(
        &mut self,
        task: &Task<'_, E, N, T, G>,
        lanes: &W,
        first: u64,
        walks: u64,
        mut push: impl FnMut(&Walk<E::Scalar>, f64) -> bool,
    ) where
        N: NeighbourOf<E> + ?Sized,
        T: Functional<E>,
        G: Rng + SeedableRng,
        W: Lanes<E, L>,
    {
        let Self {
            numbers,
            drawn,
            starts,
            values,
            scores,
        } = self;
        let (mut used, mut count) = (0, 0);
        let places = starts.iter_mut().zip(values.iter_mut()).zip(&mut *drawn);
        for (number, ((start, own), slot)) in (first..first.saturating_add(walks)).zip(places) {
            let mut uniforms = RngUniforms(task.seeds.generator(number));
            let (x, phi, value) = task.start(&mut uniforms);
            (*start, *own) = (Start { x, phi }, value);
            let q = task.equation.absorption(&x.point);
            let most = task.length.step_limit;
            let Some(walk) = draw(q, most, (&mut *numbers, &mut used), uniforms) else {
                break;
            };
            *slot = walk;
            count += 1;
        }
        if count == 0 {
            // Longer than there is room for.
            let (walk, value) = task.alone(first);
            push(&walk, value);
            return;
        }
        let order = by_length(drawn, count);
        for group in order.get(..count).unwrap_or(&[]).chunks(L) {
            // The last group may have fewer: its last walk fills the lanes.
            let last = group.last().copied().unwrap_or(0);
            let places: [usize; L] =
                from_fn(|l| usize::from(group.get(l).copied().unwrap_or(last)) % BLOCK);
            let starts = from_fn(|l| starts[places[l]]);
            let steps = from_fn(|l| drawn[places[l]].steps);
            let at: [usize; L] = from_fn(|l| drawn[places[l]].first as usize);
            // Never behind the end: a walk that goes on has drawn as many.
            let draw = |s| from_fn(|l| numbers[(at[l] + s) % NUMBERS]);
            let sources = |x: &[Located<E::Point>; L]| {
                [
                    from_fn(|l| task.equation.sample_source(&x[l].point, &mut NoDraws)),
                    from_fn(|l| task.neighbour.source(&x[l], &mut NoDraws)),
                ]
            };
            let arrivals = lanes.follow(&starts, &steps, draw, IS_COLLISION.then_some(sources));
            for l in 0..L {
                scores[places[l]] = if IS_COLLISION {
                    scored(arrivals[l].plain, arrivals[l].control, steps[l])
                } else {
                    absorbed(task, &arrivals[l], steps[l])
                };
            }
        }
        for (walk, value) in scores.iter().zip(&*values).take(count) {
            if !push(walk, *value) {
                break;
            }
        }
    }
}

/// Draws the steps of a walk of `most` states at most up to its absorption, of the probability q everywhere. `None`: it is longer than
/// there is room, or than it may be.
#[inline(always)]
pub(crate) fn draw<F: Real>(
    q: F,
    most: u32,
    (numbers, used): (&mut [F; NUMBERS], &mut usize),
    mut uniforms: impl Uniforms<F>,
) -> Option<Drawn> {
    let first = *used;
    let mut at = first;
    loop {
        let steps = (at - first) as u32;
        if steps >= most {
            return None;
        }
        let absorption: F = uniforms.uniform();
        if absorption < q {
            *used = at;
            return Some(Drawn {
                first: first as u32,
                steps,
            });
        }
        *numbers.get_mut(at)? = uniforms.uniform();
        at += 1;
    }
}

/// The places of the first `count` walks, the longest first.
#[inline(always)]
pub(crate) fn by_length(drawn: &[Drawn; BLOCK], count: usize) -> [u16; BLOCK] {
    let length = |walk: &Drawn| LENGTHS - 1 - (walk.steps as usize).min(LENGTHS - 1);
    let mut begin = [0_u16; LENGTHS];
    for walk in drawn.iter().take(count) {
        if let Some(begin) = begin.get_mut(length(walk) + 1) {
            *begin += 1;
        }
    }
    let mut sum = 0;
    for begin in &mut begin {
        sum += *begin;
        *begin = sum;
    }
    let mut order = [0; BLOCK];
    for (place, walk) in (0_u16..).zip(drawn.iter().take(count)) {
        if let Some(begin) = begin.get_mut(length(walk)) {
            if let Some(order) = order.get_mut(usize::from(*begin)) {
                *order = place;
            }
            *begin += 1;
        }
    }
    order
}

/// What a walk scores that was absorbed there after so many steps: as [`walk`](crate::walk()) does.
#[inline(always)]
fn absorbed<E, N, T, G>(
    task: &Task<'_, E, N, T, G>,
    arrival: &Arrival<E>,
    steps: u32,
) -> Walk<E::Scalar>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
{
    let Arrival {
        x,
        weight_k,
        weight_h,
        plain,
        control,
    } = *arrival;
    let per_absorption = one::<E::Scalar>() / task.equation.absorption(&x.point);
    let f = task.equation.sample_source(&x.point, &mut NoDraws);
    let g = task.neighbour.source(&x, &mut NoDraws);
    let plain = plain + weight_k * f * per_absorption;
    let control = control + weight_h * g * per_absorption;
    scored(plain, control, steps)
}

/// A walk of so many steps that was absorbed with these scores.
#[inline(always)]
fn scored<F: Real>(plain: F, control: F, steps: u32) -> Walk<F> {
    let is_finite = (plain - control).is_finite();
    Walk {
        plain,
        control,
        states: steps + 1,
        termination: if is_finite {
            Termination::Absorbed
        } else {
            Termination::NotFinite
        },
    }
}

impl<E, N, T, G> Task<'_, E, N, T, G>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
{
    /// Whether its walks are such as lanes follow.
    pub(crate) fn fits_lanes(&self) -> bool {
        self.length.survivals == 0
    }
}
