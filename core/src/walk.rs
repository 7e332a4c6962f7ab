//! One walk, and what both equations score on it.

use num_traits::{one, zero};

use crate::{Equation, Located, NeighbourOf, Real, STEP_LIMIT, Uniforms};

/// The estimator: what a walk scores.
///
/// ```
/// use fredholm_core::{Estimator, WalkOptions};
///
/// let options = WalkOptions { estimator: Estimator::Collision, ..WalkOptions::default() };
/// assert_ne!(options.estimator, WalkOptions::default().estimator);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Estimator {
    /// η(k, f) = φ(x0) k(x0,x1) … k(x_{m−1},x_m) f(x_m), scored where the walk is absorbed: (7) of
    /// Heinrich 1995. F may not vanish where q does not, or much of the work scores nothing.
    Absorption,
    /// η_c(k, F) = φ(x0) Σ_l k(x0,x1) … k(x_{l−1},x_l) F(x_l), scored in every state. q may vanish
    /// where F does not.
    Collision,
}

/// The form of the control variate: how walks of the original equation score the neighbour equation.
///
/// A walk x0 … xm has the weights W_l = φ(x0) k(x0,x1) … k(x_{l−1},x_l) of the original equation, and
/// H_l = φ(x0) h(x0,x1) … h(x_{l−1},x_l) of its neighbour. Both forms have the mean (v, Φ).
///
/// ```
/// use fredholm_core::{Form, WalkOptions};
///
/// assert_eq!(WalkOptions::default().form, Form::Product);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Form {
    /// η(h, g), as in (10) of Heinrich 1995: a score of G has the weight H_l. Where h ≠ k the difference multiplies what the
    /// walk scores at its end, and with it the noise of that.
    #[default]
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
    Residual,
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Termination {
    /// Absorbed, with probability q(x_m).
    Absorbed,
    /// Left the space: [`Sampler::step`](crate::Sampler::step) returned `None`.
    Left,
    /// Cut off at the step limit: what it would have scored is missing, a possible bias.
    StepLimit,
    /// A score is infinite or NaN.
    NotFinite,
}

/// One walk's scores. The preconditioned estimate is (v, Φ) + plain − control, (10) of Heinrich
/// 1995, from one and the same walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk<F> {
    /// η(k, f): the plain estimate.
    pub plain: F,
    /// η(h, g): the neighbour equation's estimate.
    pub control: F,
    /// Visited states, the start included.
    pub states: u32,
    /// How it ended.
    pub termination: Termination,
}

/// How long a walk is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Length {
    /// The number of first states in which it is not absorbed: see [`WalkOptions::survivals`](crate::WalkOptions::survivals).
    pub survivals: u32,
    /// Most states; a walk that is cut off there is counted.
    pub step_limit: u32,
}

impl Default for Length {
    /// Absorption from the first state on, and [`STEP_LIMIT`].
    fn default() -> Self {
        Self {
            survivals: 0,
            step_limit: STEP_LIMIT,
        }
    }
}

/// Follows one walk from x0 with weight φ(x0), and scores both equations on it. `control_draws` are what the neighbour equation draws from: the walk does not depend on them.
// Into each estimator's loop over walks, where `estimator` is a constant.
#[inline(always)]
pub fn walk<E, N, U>(
    equation: &E,
    neighbour: &N,
    (x0, phi): (Located<E::Point>, E::Scalar),
    (estimator, form): (Estimator, Form),
    length: &Length,
    uniforms: &mut U,
    control_draws: &mut dyn Uniforms<E::Scalar>,
) -> Walk<E::Scalar>
where
    E: Equation,
    N: NeighbourOf<E> + ?Sized,
    U: Uniforms<E::Scalar>,
{
    let mut x = x0;
    let mut walk = Walk::<E::Scalar> {
        plain: zero(),
        control: zero(),
        states: 0,
        termination: Termination::StepLimit,
    };
    // φ k…k of the states so far, and what scores of the neighbour equation are multiplied by: φ h…h, or the same.
    let (mut weight_k, mut weight_h) = (phi, phi);
    let is_residual = form == Form::Residual;
    while walk.states < length.step_limit {
        walk.states += 1;
        let survives = walk.states <= length.survivals;
        if estimator == Estimator::Collision || survives {
            walk.plain += weight_k * equation.sample_source(&x.point, uniforms);
            walk.control += weight_h * neighbour.source(&x, control_draws);
        }
        let q = equation.absorption(&x.point);
        if survives {
            let survival = one::<E::Scalar>() - q;
            if !(survival > zero()) {
                walk.termination = Termination::Absorbed;
                break;
            }
            weight_k *= survival;
            weight_h *= survival;
        } else if uniforms.uniform() < q {
            if estimator == Estimator::Absorption {
                let per_absorption = one::<E::Scalar>() / q;
                walk.plain +=
                    weight_k * equation.sample_source(&x.point, uniforms) * per_absorption;
                walk.control += weight_h * neighbour.source(&x, control_draws) * per_absorption;
            }
            walk.termination = Termination::Absorbed;
            break;
        }
        let Some(next) = equation.step(&x.point, uniforms) else {
            walk.termination = Termination::Left;
            break;
        };
        let y = neighbour.locate(next);
        let k = equation.kernel(&x.point, &y.point);
        let h = neighbour.kernel(&x, &y, k);
        if is_residual {
            let difference = h - k;
            // On pointwise pairs nobody asks for v.
            if difference != zero() {
                walk.control += weight_h * difference * neighbour.value(&y);
            }
            weight_h *= k;
        } else {
            weight_h *= h;
        }
        weight_k *= k;
        x = y;
    }
    // An infinity or NaN in either stays one in the difference.
    if !(walk.plain - walk.control).is_finite() {
        walk.termination = Termination::NotFinite;
    }
    walk
}
