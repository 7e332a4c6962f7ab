//! One walk, and what every suffix of it scores.

use num_traits::{one, zero};

use crate::walk::{Sums, Visitor};
use crate::{Both, Located, Real, Value};

/// A state that is kept, and what its suffix scores.
#[derive(Clone, Copy, Debug)]
struct State<P, F, V> {
    x: Located<P>,
    /// What scores of the next state are multiplied by; 0 where there is none.
    step: Both<V>,
    /// What both equations score in the state itself and, in the residual form, on the step from it.
    own: Both<V>,
    /// What F − G is multiplied by where the state scores it: 1/q where a walk is absorbed by the absorption estimator, 1 where
    /// every state scores, 0 where none does.
    share: F,
    /// D_l.
    difference: V,
}

/// A state that is kept, its D_l, and what F − G is multiplied by in it.
pub(super) struct Scored<'t, P, F, V> {
    pub(super) x: &'t Located<P>,
    pub(super) difference: &'t V,
    pub(super) share: F,
}

/// The first states of a walk, N at most, and what their suffixes score.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trail<P, F, V, const N: usize> {
    states: [State<P, F, V>; N],
    /// The number that may be kept.
    most: usize,
    kept: usize,
    /// What the walk scores from the state on that comes behind the kept ones, and its weights there.
    after: Sums<V>,
    weights: Both<V>,
    is_after: bool,
    /// Nothing, and one, in every channel.
    nothing: Both<V>,
    ones: Both<V>,
    /// Whether either equation scored anything but 0 in a suffix.
    scored: bool,
}

impl<P: Copy, F: Real, V: Value<F>, const N: usize> Trail<P, F, V, N> {
    /// Room for N states, of which `most` are kept. `any` is any point: a place needs a value.
    pub(super) fn new(any: Located<P>, channels: usize, most: usize) -> Self {
        let both = |x: F| {
            let value = V::splat(channels, x);
            Both {
                equation: value,
                neighbour: value,
            }
        };
        let (nothing, ones) = (both(zero()), both(one()));
        let none = State {
            x: any,
            step: nothing,
            own: nothing,
            share: zero(),
            difference: nothing.equation,
        };
        Self {
            states: [none; N],
            most: most.min(N),
            kept: 0,
            after: Sums::new(channels),
            weights: ones,
            is_after: false,
            nothing,
            ones,
            scored: false,
        }
    }

    /// Forgets the last walk.
    #[inline(always)]
    pub(super) fn begin(&mut self) {
        self.kept = 0;
        self.after = Sums(self.nothing);
        self.weights = self.ones;
        self.is_after = false;
    }

    /// Whether either equation scored anything but 0 in a suffix of the last walk.
    pub(super) const fn has_scored(&self) -> bool {
        self.scored
    }

    /// The kept states, what their suffixes score, and what F − G is multiplied by in it.
    #[inline]
    pub(super) fn iter(&self) -> impl Iterator<Item = Scored<'_, P, F, V>> {
        let kept = self.states.iter().take(self.kept);
        kept.map(|state| Scored {
            x: &state.x,
            difference: &state.difference,
            share: state.share,
        })
    }

    #[inline(always)]
    fn last(&mut self) -> Option<&mut State<P, F, V>> {
        self.kept
            .checked_sub(1)
            .and_then(|last| self.states.get_mut(last))
    }

    /// a_l = own_l + k_l a_(l+1) for both equations, and their difference. Says whether all of it is finite.
    ///
    /// Where a suffix is not finite, neither is the whole walk: an infinity or NaN stays one, as 0 · ∞ is NaN.
    #[inline(always)]
    pub(super) fn finish(&mut self) -> bool {
        self.scored = false;
        let mut after = self.after.0;
        let mut is_finite = true;
        for state in self.states.iter_mut().take(self.kept).rev() {
            after = Both {
                equation: state
                    .own
                    .equation
                    .plus(&state.step.equation.times(&after.equation)),
                neighbour: state
                    .own
                    .neighbour
                    .plus(&state.step.neighbour.times(&after.neighbour)),
            };
            state.difference = after.equation.minus(&after.neighbour);
            is_finite = state.difference.is_finite();
            self.scored |= after != self.nothing;
        }
        is_finite
    }
}

impl<P: Copy, F: Real, V: Value<F>, const N: usize> Visitor<P, F, V> for Trail<P, F, V, N> {
    #[inline(always)]
    fn enter(&mut self, x: &Located<P>, _: &Both<V>) {
        if self.kept < self.most {
            if let Some(state) = self.states.get_mut(self.kept) {
                state.x = *x;
                state.step = self.nothing;
                state.own = self.nothing;
                state.share = zero();
                self.kept += 1;
            }
        } else {
            self.is_after = true;
        }
    }

    #[inline(always)]
    fn score(&mut self, _: &Both<V>, scores: &Both<V>, share: F) {
        if self.is_after {
            let weights = self.weights;
            Visitor::<P, F, V>::score(&mut self.after, &weights, scores, share);
        } else if let Some(state) = self.last() {
            state.share = share;
            state.own = Both {
                equation: scores.equation.scaled(share),
                neighbour: scores.neighbour.scaled(share),
            };
        }
    }

    #[inline(always)]
    fn score_step(&mut self, _: &Both<V>, difference: &V) {
        if self.is_after {
            let weights = self.weights;
            Visitor::<P, F, V>::score_step(&mut self.after, &weights, difference);
        } else if let Some(state) = self.last() {
            state.own.neighbour = state.own.neighbour.plus(difference);
        }
    }

    #[inline(always)]
    fn step(&mut self, factors: &Both<V>) {
        if self.is_after {
            self.weights = Both {
                equation: self.weights.equation.times(&factors.equation),
                neighbour: self.weights.neighbour.times(&factors.neighbour),
            };
        } else if let Some(state) = self.last() {
            state.step = *factors;
        }
    }
}
