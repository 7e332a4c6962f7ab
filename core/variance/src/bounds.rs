//! The quantities of sections 3 and 4 of Heinrich 1995, and the bounds of Var ζ that they give.

use alloc::vec::Vec;
use fredholm_core::array::Each;

use fredholm_core::Real;
use fredholm_core::galerkin::{GalerkinMatrix, buffer};

use crate::matrix::{Matrix, POWERS};
use crate::site::Moments;
use crate::sources::scored;
use crate::{Analysis, Node, Power, Prediction, VarianceError};

/// The quantities that bound Var ζ of the absorption estimator. Suprema are taken over the nodes and sites of the quadrature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantities {
    /// α ≥ |k|, |h|: (12).
    pub alpha: f64,
    /// θ ≥ f²q, g²q: (14).
    pub theta: f64,
    /// ‖f‖∞, ‖g‖∞ at most.
    pub score: f64,
    /// δ(k,h) = ‖T_kp − T_hp‖ = sup_x ∫ |k − h| p dμ(y): (20).
    pub delta: f64,
    /// ε(k,h) = (sup_x ∫ (k − h)² p dμ(y))^½: (21).
    pub epsilon: f64,
    /// ρ(f,g) = (sup_x (f − g)² q)^½: (22).
    pub rho: f64,
    /// σ(k,h) = (∫∫ (k − h)² p dμ(x) dμ(y))^½.
    pub sigma: f64,
    /// τ(f,g) = (∫ (f − g)² q dμ(x))^½.
    pub tau: f64,
    /// ‖k − h‖∞ and ‖f − g‖∞.
    pub suprema: [f64; 2],
    /// c_p = sup_y ∫ p(x,y) dμ(x): (31).
    pub c_p: f64,
    /// n0 and γ with ‖T_k²p^n0‖, ‖T_h²p^n0‖ ≤ γ < 1, (13): those with the smallest β0, or none within a thousand
    /// powers.
    pub power: Option<Power>,
    /// β0 = (1 − γ)⁻¹ Σ_{j<n0} α^2j: Lemma 1 (i), (v).
    pub beta_0: Option<f64>,
    /// β1 = (1 − γ)⁻¹ Σ_{j<n0} α^j: Lemma 1 (iv).
    pub beta_1: Option<f64>,
    /// β ≥ ‖(I − T_k²p)⁻¹‖ and ‖(I − T_h²p)⁻¹‖ in L1: the norms themselves.
    pub beta: Option<f64>,
    /// μ(X).
    pub measure: f64,
    /// q0 = inf q: (47).
    pub absorption: f64,
    /// ‖u − v‖∞.
    pub error: f64,
    /// ‖v‖∞.
    pub value: f64,
}

/// Bounds of Var ζ. `None`: an assumption does not hold, or the bound is not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Theorem 3 as its proof has it, (23), (29) and (30):
    /// 2 (β0² θ (ε² + 2 α² β0 δ²) + β0 ρ²) ‖φ²p0‖₁.
    pub theorem_3: Option<f64>,
    /// Corollary 4: the same with ‖k − h‖∞ for δ and ε, ‖f − g‖∞ for ρ, and the square of ‖f‖∞ for θ.
    pub corollary_4: Option<f64>,
    /// Theorem 5 as its proof has it, (33) to (37):
    /// 2 (β β0 θ (1 + 2 α² (c_p β β0)^½) σ² + β τ²) ‖φ²p0‖∞; not for a start in a point, where φ²p0 is no function.
    pub theorem_5: Option<f64>,
}

impl Quantities {
    /// Proposition 7: τ² ≤ 2 q0⁻¹ ((1 + α)² μ(X) ‖u − v‖∞² + σ² ‖v‖∞²).
    #[must_use]
    pub fn proposition_7(&self) -> f64 {
        let [of_error, of_kernel] = [(1.0 + self.alpha) * self.error, self.sigma * self.value];
        2.0 / self.absorption * (self.measure * of_error * of_error + of_kernel * of_kernel)
    }

    /// The bounds for a functional with ‖φ²p0‖₁ and, where it is a function, ‖φ²p0‖∞.
    #[must_use]
    pub fn bounds(&self, prediction: &Prediction) -> Bounds {
        let (one, supremum) = prediction.norms;
        let finite = |x: f64| x.is_finite().then_some(x);
        let by_norms = |beta_0: f64, theta: f64, [delta, epsilon, rho]: [f64; 3]| {
            let alpha_delta = self.alpha * delta;
            let kernels = epsilon * epsilon + 2.0 * beta_0 * alpha_delta * alpha_delta;
            2.0 * (beta_0 * beta_0 * theta * kernels + beta_0 * rho * rho) * one
        };
        let [kernels, sources] = self.suprema;
        let theorem_5 = |beta_0: f64| {
            let (beta, supremum) = (self.beta?, supremum?);
            let root = Real::sqrt(self.c_p * beta * beta_0);
            let kernels = 1.0 + 2.0 * self.alpha * self.alpha * root;
            let first = beta * beta_0 * self.theta * kernels * self.sigma * self.sigma;
            finite(2.0 * (first + beta * self.tau * self.tau) * supremum)
        };
        Bounds {
            theorem_3: self.beta_0.and_then(|beta_0| {
                finite(by_norms(
                    beta_0,
                    self.theta,
                    [self.delta, self.epsilon, self.rho],
                ))
            }),
            corollary_4: self.beta_0.and_then(|beta_0| {
                finite(by_norms(
                    beta_0,
                    self.score * self.score,
                    [kernels, kernels, sources],
                ))
            }),
            theorem_5: self.beta_0.and_then(theorem_5),
        }
    }
}

impl Analysis<'_> {
    /// The quantities that bound Var ζ.
    ///
    /// # Errors
    /// [`VarianceError`].
    pub fn quantities(&self) -> Result<Quantities, VarianceError> {
        let nodes = || self.sites.iter().flat_map(|site| &site.nodes);
        let supremum =
            |of: &dyn Fn(&Node) -> f64| nodes().map(of).fold(0.0, |m: f64, x| Real::max(m, x));
        let integral = |of: &dyn Fn(&Node) -> f64| nodes().map(|x| x.weight * of(x)).sum::<f64>();
        let difference = |x: &Node| {
            let difference = x.source - x.neighbour_source;
            scored(difference * difference + x.noise, x.absorption)
        };
        let squares = |x: &Node| x.squares.iter().sum::<f64>();
        let scores = |x: &Node| [x.source, x.neighbour_source].each(f64::abs);
        let largest = |x: &Node| scores(x).into_iter().fold(0.0, |m: f64, f| Real::max(m, f));
        let of_kernel = |which: usize| {
            let all = self.sites.iter().map(|site| site.largest[which]);
            all.fold(0.0, |m: f64, x| Real::max(m, x))
        };
        let alpha = Real::max(of_kernel(0), of_kernel(1));
        let best = self.best_power(alpha)?;
        let power = best.map(|(power, _)| power);
        Ok(Quantities {
            alpha,
            theta: supremum(&|x| scored(largest(x) * largest(x), x.absorption)),
            score: supremum(&|x| scored(largest(x), x.absorption)),
            delta: supremum(&|x| x.delta),
            epsilon: Real::sqrt(supremum(&squares)),
            rho: Real::sqrt(supremum(&difference)),
            sigma: Real::sqrt(integral(&squares)),
            tau: Real::sqrt(integral(&difference)),
            suprema: [
                of_kernel(2),
                supremum(&|x| scored((x.source - x.neighbour_source).abs(), x.absorption)),
            ],
            c_p: self.columns(&|m| m.mass)?,
            power,
            beta_0: best.map(|(_, [beta_0, _])| beta_0),
            beta_1: best.map(|(_, [_, beta_1])| beta_1),
            beta: match power {
                Some(_) => Some(Real::max(
                    self.resolvent_in_l1(|m| m.kk)?,
                    self.resolvent_in_l1(|m| m.hh)?,
                )),
                None => None,
            },
            measure: self.sites.iter().map(|site| site.measure).sum(),
            absorption: nodes()
                .map(|x| x.absorption)
                .fold(1.0, |m: f64, q| if q < m { q } else { m }),
            error: supremum(&|x| x.error.abs()),
            value: supremum(&|x| x.value.abs()),
        })
    }

    /// sup_y ∫ of a moment dμ(x).
    fn columns(&self, moment: &dyn Fn(&Moments) -> f64) -> Result<f64, VarianceError> {
        let mut columns: Vec<f64> = buffer(self.sites.len())?;
        for site in &self.sites {
            for (column, moments) in columns.iter_mut().zip(&site.row) {
                *column += site.measure * moment(moments);
            }
        }
        Ok(self.densest(&columns))
    }

    /// ‖(I − T)⁻¹‖ in L1: sup_y of ∫ of the resolvent's kernel dμ(x), by the adjoint equation with the source 1.
    fn resolvent_in_l1(&self, moment: fn(&Moments) -> f64) -> Result<f64, VarianceError> {
        let mut source = buffer(self.sites.len())?;
        for (source, site) in source.iter_mut().zip(&self.sites) {
            *source = site.measure;
        }
        let matrix = Matrix::adjoint(&self.sites, moment);
        Ok(self.densest(&matrix.resolve(&source)?))
    }

    fn densest(&self, masses: &[f64]) -> f64 {
        let densities = masses
            .iter()
            .zip(&self.sites)
            .map(|(mass, site)| mass / site.measure);
        densities.fold(0.0, |m: f64, x| Real::max(m, x))
    }

    /// n0 and γ with the smallest β0, and β0 and β1.
    fn best_power(&self, alpha: f64) -> Result<Option<(Power, [f64; 2])>, VarianceError> {
        let n = self.sites.len();
        let of = |moment: fn(&Moments) -> f64| Matrix::new(&self.sites, moment);
        let matrices = [of(|m| m.kk), of(|m| m.hh)];
        let (mut w, mut next) = ([buffer::<f64>(n)?, buffer(n)?], buffer(n)?);
        w.iter_mut().for_each(|w| w.fill(1.0));
        let (mut sums, mut powers) = ([0.0; 2], [1.0; 2]);
        let mut best: Option<(Power, [f64; 2])> = None;
        for exponent in 1..=POWERS {
            let mut norm: f64 = 0.0;
            for (w, matrix) in w.iter_mut().zip(&matrices) {
                matrix.apply(w, &mut next);
                w.copy_from_slice(&next);
                norm = w.iter().fold(norm, |m: f64, x| Real::max(m, *x));
            }
            for ((sum, power), factor) in
                sums.iter_mut().zip(&mut powers).zip([alpha * alpha, alpha])
            {
                *sum += *power;
                *power *= factor;
            }
            if !(norm < 1e100) {
                break;
            }
            let betas = sums.each(|sum| sum / (1.0 - norm));
            let before = best.map_or(f64::INFINITY, |(_, [beta_0, _])| beta_0);
            if norm < 1.0 && betas[0] < before {
                best = Some((Power { exponent, norm }, betas));
            }
            // β0 ≥ Σ α^2j: a higher power cannot do better.
            if sums[0] > before {
                break;
            }
        }
        Ok(best)
    }
}
