//! One walk, and what both equations score on it.
//!
//! # How walks end
//!
//! A walk x0, x1, … has the weights W_l = k(x0,x1) … k(x_(l−1),x_l), and φ(x0) Σ_l W_l F(x_l) has the mean (u, Φ). It may end
//! early without a bias if a state that it survives with probability s multiplies what follows by 1/s.
//!
//! With **constant** absorption, as in Heinrich 1995, s = 1 − q0. Its second moment is finite if the spectral radius of
//! T_(k²p)/(1 − q0) is below 1.
//!
//! With **roulette** s = min(1, |W_l| c(x_l)), where c(x) is the [size](crate::Equation::size) of k there: a walk goes on with the
//! probability of what its weight will have become. In light and heat k = ρ(x) = c(x), so that this is the analogue walk: it
//! goes on with probability ρ, its weight stays 1, and it ends on black walls. Its second moment is finite wherever |k| ≤ 1
//! and the mean exists; in general, if the radius of T_(k²p) is below 1. *Proof.* Let A(x) be the second moment of all that a walk
//! scores after a state x that it has reached with weight 1, and s = min(1, c(x)). Then
//!
//! ```text
//! A(x) ≤ s ∫ p(x,y) (w² f(y)² + max(|w|, w²) A(y)) dμ(y) up to mixed terms,   w = k(x,y)/s,
//! ```
//!
//! since a state that is reached with |w| < 1 goes on with probability |w| and weight 1, and one with |w| ≥ 1 for certain. A
//! weight that stays above 1 is multiplied by k in every step, which is the operator T_(k²p). ∎
//!
//! Where |W_l| c(x_l) is 0, nothing that follows is scored for the equation. Its neighbour may score there: a cell that is partly
//! black has h ≠ 0 on its black part, too. So the walk goes on with the probability of its neighbour's weight, unless h = k
//! everywhere ([`Neighbour::is_pointwise`](crate::Neighbour::is_pointwise)). What the equation scores does not depend on that.
//!
//! A walk goes on at least with the probability [`ROULETTE_FLOOR`]. Where |k| is small, in a black room or many dimensions, all that later
//! states score would come from one walk in a hundred, with a weight of 1, and no sample standard deviation of a few thousand walks
//! would know of it. With the floor no weight grows more than eightfold in a step, and walks are at most a seventh longer.
//!
//! Roulette is the best constant, too: scores of residuals hardly depend on each other, so that the variance is proportional
//! to 1/(1 − ρ²/s), the work to 1/(1 − s), and their product is least at s = ρ.

use num_traits::{one, zero};

use crate::{Equation, Located, NeighbourOf, Real, STEP_LIMIT, Uniforms, Value};

/// The estimator: what a walk with constant absorption scores.
///
/// ```
/// use fredholm_core::{Absorption, Estimator};
///
/// let paper = Absorption::Constant { probability: 0.2, estimator: Estimator::Absorption };
/// assert_ne!(paper, Absorption::default());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Estimator {
    /// η(k, f) = φ(x0) k(x0,x1) … k(x_{m−1},x_m) F(x_m)/q0, scored where the walk is absorbed: (7) of
    /// Heinrich 1995.
    Absorption,
    /// η_c(k, F) = φ(x0) Σ_l k(x0,x1) … k(x_{l−1},x_l) F(x_l), scored in every state.
    Collision,
}

/// How walks end: see the [module](crate::walk()) for what each costs.
///
/// ```
/// use fredholm_core::{Absorption, Estimator};
///
/// let as_in_the_paper = Absorption::Constant { probability: 0.2, estimator: Estimator::Absorption };
/// assert_eq!(as_in_the_paper.probability(), Some(0.2));
/// assert_eq!(Absorption::default(), Absorption::Roulette);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Absorption {
    /// A walk goes on with the probability of its weight, and scores in every state.
    #[default]
    Roulette,
    /// A walk ends in every state with the same probability, as in Heinrich 1995, section 5.
    Constant {
        /// q0, between 0 and 1.
        probability: f64,
        /// What it scores.
        estimator: Estimator,
    },
}

impl Absorption {
    /// q0; `None`: roulette.
    #[must_use]
    pub const fn probability(&self) -> Option<f64> {
        match self {
            Self::Roulette => None,
            Self::Constant { probability, .. } => Some(*probability),
        }
    }

    /// The estimator: by roulette, collision.
    #[must_use]
    pub const fn estimator(&self) -> Estimator {
        match self {
            Self::Roulette => Estimator::Collision,
            Self::Constant { estimator, .. } => *estimator,
        }
    }
}

/// The least probability with which [roulette](Absorption::Roulette) goes on where any weight is left.
pub const ROULETTE_FLOOR: f64 = 0.125;

/// The form of the control variate: how walks of the original equation score the neighbour equation.
///
/// A walk x0 … xm has the weights W_l = φ(x0) k(x0,x1) … k(x_{l−1},x_l) of the original equation, and
/// H_l = φ(x0) h(x0,x1) … h(x_{l−1},x_l) of its neighbour. Both forms have the mean (v, Φ).
///
/// ```
/// use fredholm_core::{Form, WalkOptions};
///
/// assert_eq!(WalkOptions::default().form, Form::Residual);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Form {
    /// η(h, g), as in (10) of Heinrich 1995: a score of G has the weight H_l. Where h ≠ k the difference multiplies what the
    /// walk scores at its end, and with it the noise of that.
    Product,
    /// A score of G has the weight W_l, and a step from x_l to x_{l+1} scores W_l (h − k)(x_l, x_{l+1}) v(x_{l+1}), since
    ///
    /// ```text
    /// v = T_kp v + G + T_hp v − T_kp v
    /// ```
    ///
    /// and a step is made with density p. Where h ≠ k the difference multiplies v(x_{l+1}), the mean of what the walk
    /// scores from there on, without the noise. Where plain walks have a finite variance, so has this form if
    /// ∫ (k − h)² p dμ(y) is bounded: nothing is asked of the spectral radius of T_h²p. Not in the paper.
    #[default]
    Residual,
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// Absorbed.
    Absorbed,
    /// Left the space: [`Chain::step`](crate::Chain::step) returned `None`.
    Left,
    /// Cut off at the step limit: what it would have scored is missing, a possible bias.
    StepLimit,
    /// A score is infinite or NaN.
    NotFinite,
}

/// One walk's scores. The preconditioned estimate is (v, Φ) + plain − control, (10) of Heinrich
/// 1995, from one and the same walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk<V> {
    /// η(k, f): the plain estimate.
    pub plain: V,
    /// η(h, g): the neighbour equation's estimate.
    pub control: V,
    /// Visited states, the start included.
    pub states: u32,
    /// How it ended.
    pub termination: Termination,
}

/// How long a walk is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Length {
    /// The number of first states in which it is not absorbed: see [`WalkOptions::forced_steps`](crate::WalkOptions::forced_steps).
    pub forced_steps: u32,
    /// Most states; a walk that is cut off there is counted.
    pub step_limit: u32,
}

impl Default for Length {
    /// Absorption from the first state on, and [`STEP_LIMIT`].
    fn default() -> Self {
        Self {
            forced_steps: 0,
            step_limit: STEP_LIMIT,
        }
    }
}

/// Two numbers of a walk: those of the equation, and of its neighbour equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Both<V> {
    /// The equation's.
    pub equation: V,
    /// The neighbour equation's.
    pub neighbour: V,
}

/// What is done with the states of a walk.
pub(crate) trait Visitor<P, F, V> {
    /// The walk has come to a state, with these weights.
    #[inline(always)]
    fn enter(&mut self, x: &Located<P>, weights: &Both<V>) {
        let _ = (x, weights);
    }

    /// Both equations score in the state that was entered last, which has these weights, times `share`.
    fn score(&mut self, weights: &Both<V>, scores: &Both<V>, share: F);

    /// The neighbour equation scores a step from that state: (h − k) v in the residual form.
    fn score_step(&mut self, weights: &Both<V>, difference: &V);

    /// What weights are multiplied by from that state to the next.
    #[inline(always)]
    fn step(&mut self, factors: &Both<V>) {
        let _ = factors;
    }
}

/// Looks at nothing.
impl<P, F, V> Visitor<P, F, V> for () {
    #[inline(always)]
    fn score(&mut self, _: &Both<V>, _: &Both<V>, _: F) {}

    #[inline(always)]
    fn score_step(&mut self, _: &Both<V>, _: &V) {}
}

/// One after the other.
impl<P, F: Copy, V, A: Visitor<P, F, V>, B: Visitor<P, F, V>> Visitor<P, F, V> for (A, &mut B) {
    #[inline(always)]
    fn enter(&mut self, x: &Located<P>, weights: &Both<V>) {
        self.0.enter(x, weights);
        self.1.enter(x, weights);
    }

    #[inline(always)]
    fn score(&mut self, weights: &Both<V>, scores: &Both<V>, share: F) {
        self.0.score(weights, scores, share);
        self.1.score(weights, scores, share);
    }

    #[inline(always)]
    fn score_step(&mut self, weights: &Both<V>, difference: &V) {
        self.0.score_step(weights, difference);
        self.1.score_step(weights, difference);
    }

    #[inline(always)]
    fn step(&mut self, factors: &Both<V>) {
        self.0.step(factors);
        self.1.step(factors);
    }
}

/// How walks end and score: a constant within each loop over walks, so that no walk asks for it, where [`Generators`](crate::Generators) say
/// so.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Course<F> {
    Roulette,
    Absorbed(F),
    Collided(F),
}

impl<F: Real> Course<F> {
    /// The course of an absorption.
    #[inline(always)]
    pub(crate) fn of(absorption: Absorption) -> Self {
        match absorption {
            Absorption::Roulette => Self::Roulette,
            Absorption::Constant {
                probability,
                estimator: Estimator::Absorption,
            } => Self::Absorbed(F::from_f64(probability)),
            Absorption::Constant { probability, .. } => Self::Collided(F::from_f64(probability)),
        }
    }
}

/// The equations, form and length of walks.
pub(crate) struct Followed<'a, E: Equation, N: ?Sized> {
    pub(crate) equation: &'a E,
    pub(crate) neighbour: &'a N,
    pub(crate) form: Form,
    pub(crate) length: Length,
}

impl<E: Equation, N: NeighbourOf<E> + ?Sized> Followed<'_, E, N> {
    /// Follows one walk from x0 with weight 1, and shows its states to a visitor. `control_draws` are what the neighbour equation
    /// draws from: the walk does not depend on them. Returns the number of states, and the end.
    // Into the loops over walks, where `course` may be a constant.
    #[inline(always)]
    pub(crate) fn walk<U, T>(
        &self,
        x0: Located<E::Point>,
        course: Course<E::Scalar>,
        uniforms: &mut U,
        control_draws: &mut dyn Uniforms<E::Scalar>,
        visitor: &mut T,
    ) -> (u32, Termination)
    where
        U: Uniforms<E::Scalar>,
        T: Visitor<E::Point, E::Scalar, E::Value>,
    {
        let (equation, neighbour) = (self.equation, self.neighbour);
        let unit = one::<E::Scalar>();
        let is_residual = self.form == Form::Residual;
        let ones = E::Value::splat(equation.channels(), unit);
        let mut weights = Both {
            equation: ones,
            neighbour: ones,
        };
        let mut x = x0;
        let mut states = 0;
        while states < self.length.step_limit {
            states += 1;
            visitor.enter(&x, &weights);
            let is_forced = states <= self.length.forced_steps;
            if is_forced || !matches!(course, Course::Absorbed(_)) {
                let scores = Both {
                    equation: equation.source(&x.point, uniforms),
                    neighbour: neighbour.source(&x, control_draws),
                };
                visitor.score(&weights, &scores, unit);
            }
            // What the weight is multiplied by for having survived.
            let mut gain = unit;
            if !is_forced {
                match course {
                    Course::Roulette => {
                        let mut goes_on = weights.equation.largest() * equation.size(&x.point);
                        if goes_on == zero() && !neighbour.is_pointwise() {
                            goes_on = weights.neighbour.largest();
                        }
                        // Written so that NaN ends, which has been scored.
                        if !(goes_on >= unit) {
                            if goes_on > zero() {
                                goes_on = Real::max(goes_on, E::Scalar::from_f64(ROULETTE_FLOOR));
                            }
                            if !(uniforms.uniform() < goes_on) {
                                return (states, Termination::Absorbed);
                            }
                            gain = unit / goes_on;
                        }
                    }
                    Course::Absorbed(q) | Course::Collided(q) => {
                        if uniforms.uniform() < q {
                            if matches!(course, Course::Absorbed(_)) {
                                let scores = Both {
                                    equation: equation.source(&x.point, uniforms),
                                    neighbour: neighbour.source(&x, control_draws),
                                };
                                visitor.score(&weights, &scores, unit / q);
                            }
                            return (states, Termination::Absorbed);
                        }
                        gain = unit / (unit - q);
                    }
                }
            }
            let Some(next) = equation.step(&x.point, uniforms) else {
                return (states, Termination::Left);
            };
            let y = neighbour.locate(next);
            let k = equation.kernel(&x.point, &y.point);
            let h = neighbour.kernel(&x, &y, &k);
            let k_gained = k.scaled(gain);
            let mut factors = Both {
                equation: k_gained,
                neighbour: k_gained,
            };
            if is_residual {
                // On pointwise pairs nothing asks for v.
                if h != k {
                    let difference = h.minus(&k).scaled(gain).times(&neighbour.value(&y));
                    visitor.score_step(&weights, &difference);
                }
            } else {
                factors.neighbour = h.scaled(gain);
            }
            visitor.step(&factors);
            weights.equation = weights.equation.times(&factors.equation);
            weights.neighbour = weights.neighbour.times(&factors.neighbour);
            x = y;
        }
        (states, Termination::StepLimit)
    }
}

/// The sums of what both equations score on a walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sums<V>(pub(crate) Both<V>);

impl<V> Sums<V> {
    #[inline(always)]
    pub(crate) fn new<F: Real>(channels: usize) -> Self
    where
        V: Value<F>,
    {
        let nothing = V::splat(channels, zero());
        Self(Both {
            equation: nothing,
            neighbour: nothing,
        })
    }
}

impl<P, F: Real, V: Value<F>> Visitor<P, F, V> for Sums<V> {
    #[inline(always)]
    fn score(&mut self, weights: &Both<V>, scores: &Both<V>, share: F) {
        let scaled = |weight: &V, score: &V| {
            let product = weight.times(score);
            if share == one() {
                product
            } else {
                product.scaled(share)
            }
        };
        let own = scaled(&weights.equation, &scores.equation);
        self.0.equation = self.0.equation.plus(&own);
        let own = scaled(&weights.neighbour, &scores.neighbour);
        self.0.neighbour = self.0.neighbour.plus(&own);
    }

    #[inline(always)]
    fn score_step(&mut self, weights: &Both<V>, difference: &V) {
        let own = weights.neighbour.times(difference);
        self.0.neighbour = self.0.neighbour.plus(&own);
    }
}

/// Follows one walk from x0 with weight φ(x0), and scores both equations on it.
///
/// `control_draws` are what the neighbour equation draws from: the walk does not depend on them.
#[inline]
pub fn walk<E, N, U>(
    equation: &E,
    neighbour: &N,
    start: (Located<E::Point>, E::Scalar),
    options: &crate::WalkOptions,
    uniforms: &mut U,
    control_draws: &mut dyn Uniforms<E::Scalar>,
) -> Walk<E::Value>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    U: Uniforms<E::Scalar>,
{
    let followed = Followed {
        equation,
        neighbour,
        form: options.form,
        length: options.length(),
    };
    let course = Course::of(options.absorption);
    followed.scored(start, course, (uniforms, control_draws), &mut ())
}

impl<E: Equation, N: NeighbourOf<E> + ?Sized> Followed<'_, E, N> {
    /// A walk from x0 with weight φ(x0), and its scores. Its states are shown to another visitor, too, with weight 1 in x0.
    #[inline(always)]
    pub(crate) fn scored<U, T>(
        &self,
        (x0, phi): (Located<E::Point>, E::Scalar),
        course: Course<E::Scalar>,
        (uniforms, control_draws): (&mut U, &mut dyn Uniforms<E::Scalar>),
        beside: &mut T,
    ) -> Walk<E::Value>
    where
        U: Uniforms<E::Scalar>,
        T: Visitor<E::Point, E::Scalar, E::Value>,
    {
        let mut visitor = (Sums::new(self.equation.channels()), beside);
        let (states, mut termination) =
            self.walk(x0, course, uniforms, control_draws, &mut visitor);
        let Both {
            equation,
            neighbour,
        } = visitor.0.0;
        let (plain, control) = (equation.scaled(phi), neighbour.scaled(phi));
        // An infinity or NaN in either stays one in the difference.
        if !plain.minus(&control).is_finite() {
            termination = Termination::NotFinite;
        }
        Walk {
            plain,
            control,
            states,
            termination,
        }
    }
}

#[cfg(test)]
mod tests;
