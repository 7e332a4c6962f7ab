//! The quantities of sections 3 and 4 of the paper, as a report has them.

use fredholm_variance::{PairQuantities, Power, Quantities};
use serde::Serialize;

use fredholm_model::numbers::{aligned, short};

/// A power of an operator whose norm is below 1.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PowerReport {
    /// The smallest m with ‖A^m‖ < 1.
    pub exponent: u32,
    /// The norm of this power in L∞.
    pub norm: f64,
}

impl From<Power> for PowerReport {
    fn from(power: Power) -> Self {
        Self {
            exponent: power.exponent,
            norm: power.norm,
        }
    }
}

/// The quantities of sections 3 and 4 of the paper, by their names.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct QuantitiesReport {
    /// α ≥ |k|, |h|: (12).
    pub alpha: f64,
    /// θ ≥ f²q, g²q: (14).
    pub theta: f64,
    /// δ(k,h): (20).
    pub delta: f64,
    /// ε(k,h): (21).
    pub epsilon: f64,
    /// ρ(f,g): (22).
    pub rho: f64,
    /// σ(k,h).
    pub sigma: f64,
    /// τ(f,g).
    pub tau: f64,
    /// c_p: (31).
    pub c_p: f64,
    /// n0: (13).
    pub n0: Option<u32>,
    /// γ: (13).
    pub gamma: Option<f64>,
    /// β0: Lemma 1.
    pub beta_0: Option<f64>,
    /// β1: Lemma 1.
    pub beta_1: Option<f64>,
    /// β: the norm of (I − T_k²p)⁻¹ in L1.
    pub beta: Option<f64>,
    /// q0: (47).
    pub q0: f64,
    /// The bound of τ by Proposition 7.
    pub proposition_7: f64,
    /// The quantities of pairs of cells, for degree 0.
    pub pairs: Option<PairsReport>,
}

/// The extremes over the pairs in S, and the bound of σ by Proposition 6.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PairsReport {
    /// Pairs in S.
    pub in_s: usize,
    /// All other pairs.
    pub others: usize,
    /// The largest κ in S.
    pub kappa: f64,
    /// The smallest r in S.
    pub r: f64,
    /// The largest λ in S.
    pub lambda: f64,
    /// The largest error of a coefficient in S.
    pub coefficient_error: f64,
    /// The bound of σ by Proposition 6.
    pub proposition_6: f64,
}

impl PairsReport {
    pub(super) fn add(&mut self, pair: &PairQuantities, alpha: f64) {
        self.proposition_6 += pair.proposition_6(alpha);
        if !pair.in_s {
            self.others += 1;
            return;
        }
        let error = (pair.mean_kernel - pair.coefficient).abs();
        self.r = if self.in_s == 0 {
            pair.r
        } else {
            self.r.min(pair.r)
        };
        self.in_s += 1;
        self.kappa = self.kappa.max(pair.kappa);
        self.lambda = self.lambda.max(pair.lambda);
        self.coefficient_error = self.coefficient_error.max(error);
    }
}

impl QuantitiesReport {
    pub(super) fn new(of: &Quantities, mut pairs: Option<PairsReport>) -> Self {
        if let Some(pairs) = &mut pairs {
            // The proposition is of the square.
            pairs.proposition_6 = pairs.proposition_6.sqrt();
        }
        Self {
            alpha: of.alpha,
            theta: of.theta,
            delta: of.delta,
            epsilon: of.epsilon,
            rho: of.rho,
            sigma: of.sigma,
            tau: of.tau,
            c_p: of.c_p,
            n0: of.power.map(|power| power.exponent),
            gamma: of.power.map(|power| power.norm),
            beta_0: of.beta_0,
            beta_1: of.beta_1,
            beta: of.beta,
            q0: of.absorption,
            proposition_7: of.proposition_7().sqrt(),
            pairs,
        }
    }
}

impl QuantitiesReport {
    /// The quantities for people.
    #[must_use]
    pub fn text(&self) -> String {
        let number = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), short);
        let mut rows: Vec<Vec<String>> = Vec::new();
        let mut add = |name: &str, value: String, what: &str| {
            rows.push(vec![format!("  {name}"), value, what.to_owned()]);
        };
        add("α", short(self.alpha), "largest |k|, |h|");
        add("θ", short(self.theta), "largest f²q, g²q");
        add("δ(k,h)", short(self.delta), "sup ∫|k − h| p");
        add("ε(k,h)", short(self.epsilon), "(sup ∫(k − h)² p)^½");
        add("ρ(f,g)", short(self.rho), "(sup (f − g)² q)^½");
        add("σ(k,h)", short(self.sigma), "(∫∫(k − h)² p)^½");
        add("τ(f,g)", short(self.tau), "(∫(f − g)² q)^½");
        add("τ ≤", short(self.proposition_7), "Proposition 7");
        add(
            "n0",
            self.n0.map_or_else(|| "-".to_owned(), |n| n.to_string()),
            "power of the bounds",
        );
        add("γ", number(self.gamma), "‖T_k²p^n0‖, ‖T_h²p^n0‖ at most");
        add("β0", number(self.beta_0), "Lemma 1");
        add("β", number(self.beta), "‖(I − T_k²p)⁻¹‖ in L1");
        add("c_p", short(self.c_p), "sup ∫p(x,y) dx");
        if let Some(pairs) = &self.pairs {
            add("σ ≤", short(pairs.proposition_6), "Proposition 6");
            add("κ", short(pairs.kappa), "largest in S");
            add("r", short(pairs.r), "smallest in S");
            add("λ", short(pairs.lambda), "largest in S");
            add("|k̄ − k̄'|", short(pairs.coefficient_error), "largest in S");
        }
        format!("\nquantities of the paper\n{}", aligned(&rows))
    }
}
