//! The quantities of sections 3 and 4 of the paper, as a report has them.

use fredholm_variance::{PairQuantities, Power, Quantities};
use serde::Serialize;

use crate::numbers::{aligned, short};

#[derive(Debug, Serialize)]
pub(crate) struct PowerReport {
    pub(super) exponent: u32,
    pub(super) norm: f64,
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
#[derive(Debug, Serialize)]
pub(crate) struct QuantitiesReport {
    alpha: f64,
    theta: f64,
    delta: f64,
    epsilon: f64,
    rho: f64,
    sigma: f64,
    tau: f64,
    c_p: f64,
    n0: Option<u32>,
    gamma: Option<f64>,
    beta_0: Option<f64>,
    beta_1: Option<f64>,
    beta: Option<f64>,
    q0: f64,
    /// The bound of τ by Proposition 7.
    proposition_7: f64,
    /// Of pairs of cells, for degree 0.
    pairs: Option<PairsReport>,
}

/// The extremes over the pairs in S, and the bound of σ by Proposition 6.
#[derive(Debug, Default, Serialize)]
pub(crate) struct PairsReport {
    in_s: usize,
    others: usize,
    kappa: f64,
    r: f64,
    lambda: f64,
    coefficient_error: f64,
    proposition_6: f64,
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
    pub(super) fn text(&self) -> String {
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
