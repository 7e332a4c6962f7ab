//! One walk, and what every suffix of it scores.

use num_traits::{one, zero};

use crate::{
    Equation, Estimator, Form, Length, Located, NeighbourOf, Real, Termination, Uniforms, Walk,
    walk,
};

/// A state that is kept, and what its suffix scores.
#[derive(Clone, Copy, Debug)]
struct State<P, F> {
    x: Located<P>,
    /// What scores of the next state are multiplied by, k and, in the product form, h; 0 where there is none.
    step: [F; 2],
    /// What both equations score in the state itself and, in the residual form, on the step from it.
    own: [F; 2],
    /// What F − G is multiplied by where the state scores it: 1/q where a walk is absorbed by the absorption estimator, 1 where
    /// every state scores, 0 where none does.
    share: F,
    /// D_l.
    difference: F,
}

/// A state that is kept, its D_l, and what F − G is multiplied by in it.
pub(super) type Scored<'t, P, F> = (&'t Located<P>, F, F);

/// The first states of a walk, N at most, and what their suffixes score.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trail<P, F, const N: usize> {
    states: [State<P, F>; N],
    /// The number that may be kept.
    most: usize,
    kept: usize,
    /// Whether either equation scored anything but 0 in a suffix.
    scored: bool,
}

impl<P: Copy, F: Real, const N: usize> Trail<P, F, N> {
    /// Room for N states, of which `most` are kept. `any` is any point: a place needs a value.
    pub(super) fn new(any: Located<P>, most: usize) -> Self {
        let none = State {
            x: any,
            step: [zero(); 2],
            own: [zero(); 2],
            share: zero(),
            difference: zero(),
        };
        Self {
            states: [none; N],
            most,
            kept: 0,
            scored: false,
        }
    }

    /// Whether either equation scored anything but 0 in a suffix of the last walk.
    pub(super) const fn has_scored(&self) -> bool {
        self.scored
    }

    /// The kept states, what their suffixes score, and what F − G is multiplied by in it.
    #[inline]
    pub(super) fn iter(&self) -> impl Iterator<Item = Scored<'_, P, F>> {
        let kept = self.states.iter().take(self.kept);
        kept.map(|state| (&state.x, state.difference, state.share))
    }

    /// Follows one walk from x0 and scores the suffixes of its first states. Returns its states, its end, and the
    /// scores of all of it.
    #[inline(always)]
    pub(super) fn follow<E, M, U>(
        &mut self,
        equation: &E,
        neighbour: &M,
        x0: Located<P>,
        (estimator, form): (Estimator, Form),
        length: &Length,
        (uniforms, control_draws): (&mut U, &mut dyn Uniforms<F>),
    ) -> Walk<F>
    where
        E: Equation<Scalar = F, Point = P>,
        M: NeighbourOf<E> + ?Sized,
        U: Uniforms<F>,
    {
        let mut x = x0;
        // What both score from the state on that comes behind the kept ones.
        let mut after = [zero::<F>(); 2];
        let mut states = 0;
        let mut termination = Termination::StepLimit;
        self.kept = 0;
        while states < length.step_limit {
            let place = self.states.iter_mut().take(self.most).nth(self.kept);
            let Some(state) = place else {
                let rest = (x, one());
                let left = Length {
                    survivals: length.survivals.saturating_sub(states),
                    step_limit: length.step_limit - states,
                };
                let scores = (estimator, form);
                let rest = walk(
                    equation,
                    neighbour,
                    rest,
                    scores,
                    &left,
                    uniforms,
                    control_draws,
                );
                after = [rest.plain, rest.control];
                states += rest.states;
                termination = rest.termination;
                break;
            };
            self.kept += 1;
            states += 1;
            state.x = x;
            state.step = [zero(); 2];
            state.own = [zero(); 2];
            state.share = zero();
            let survives = states <= length.survivals;
            if estimator == Estimator::Collision || survives {
                state.own = [
                    equation.sample_source(&x.point, uniforms),
                    neighbour.source(&x, control_draws),
                ];
                state.share = one();
            }
            let q = equation.absorption(&x.point);
            let mut survival = one::<F>();
            if survives {
                survival -= q;
                if !(survival > zero()) {
                    termination = Termination::Absorbed;
                    break;
                }
            } else if uniforms.uniform() < q {
                if estimator == Estimator::Absorption {
                    let per_absorption = one::<F>() / q;
                    state.share = per_absorption;
                    state.own = [
                        equation.sample_source(&x.point, uniforms) * per_absorption,
                        neighbour.source(&x, control_draws) * per_absorption,
                    ];
                }
                termination = Termination::Absorbed;
                break;
            }
            let Some(next) = equation.step(&x.point, uniforms) else {
                termination = Termination::Left;
                break;
            };
            let y = neighbour.locate(next);
            let k = equation.kernel(&x.point, &y.point);
            let h = survival * neighbour.kernel(&x, &y, k);
            let k = survival * k;
            state.step = match form {
                Form::Product => [k, h],
                Form::Residual => {
                    if h != k {
                        state.own[1] += (h - k) * neighbour.value(&y);
                    }
                    [k, k]
                }
            };
            x = y;
        }
        let [plain, control] = self.backwards(after);
        if !(plain - control).is_finite() {
            termination = Termination::NotFinite;
        }
        Walk {
            plain,
            control,
            states,
            termination,
        }
    }

    /// a_l = own_l + k_l a_(l+1) for both equations, and their difference. Returns a_0.
    ///
    /// Where a suffix is not finite, neither is the whole walk: an infinity or NaN stays one, as 0 · ∞ is NaN.
    #[inline(always)]
    fn backwards(&mut self, mut after: [F; 2]) -> [F; 2] {
        self.scored = false;
        for state in self.states.iter_mut().take(self.kept).rev() {
            let [[k, h], [plain, control]] = [state.step, state.own];
            after = [plain + k * after[0], control + h * after[1]];
            state.difference = after[0] - after[1];
            self.scored |= after != [zero(); 2];
        }
        after
    }
}
