//! The coefficients of a global estimate, for those who evaluate it elsewhere.

use fredholm_core::global::over_replicates;
use serde::Serialize;

use super::GlobalEstimate;

/// The coefficients of v and ê of a global estimate ũ = F + T_K (v + ê): for those who evaluate it elsewhere. The serialised names are stable; fields may be added.
///
/// With t from −1 to 1 along every axis of a cell, its functions are products of √(2b + 1) P_b(t) of total degree `degree` or
/// less, P_b the Legendre polynomials, the degree along the last axis running fastest. Those of a cube are equal and follow each other along
/// the last axis first.
///
/// ```
/// use fredholm::{CubeModel, Method, Solver};
///
/// let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
/// let whole = Solver::new(&u).method(Method::Walks).cells(4).walks(5000).whole()?;
/// let all = whole.coefficients().unwrap();
/// assert_eq!((all.degree, all.v.len(), all.e.len()), (2, 4 * 3, 4 * 3));
/// // u = 2 = 1 + ∫ ½ (v + ê): only the means of cells count.
/// let means = all.v.iter().zip(&all.e).step_by(3);
/// let mean: f64 = means.map(|(v, e)| (v + e) / 4.0).sum();
/// assert!((1.0 + 0.5 * mean - whole.at(0.3)?.estimate).abs() < 1e-12);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GlobalCoefficients {
    /// The name of the functions on a cell: "legendre".
    pub basis: &'static str,
    /// Their largest total degree.
    pub degree: usize,
    /// The coefficients of v, cell by cell. It has a lower degree itself: the others are 0.
    pub v: Vec<f64>,
    /// The coefficients of ê, what the walks estimate of u − v, in the mean of all replicates.
    pub e: Vec<f64>,
}

impl GlobalEstimate<'_> {
    /// The coefficients of v and ê. `None`: the problem is a room or a scene.
    #[must_use]
    pub fn coefficients(&self) -> Option<GlobalCoefficients> {
        let (rows, replicates) = (self.field.coefficients()?, self.summary.replicates);
        let unknowns = rows.len() / (1 + self.field.rows()).max(1);
        let row = |k: usize| rows.get(k * unknowns..(k + 1) * unknowns);
        let all: Vec<&[f64]> = (1..=replicates).filter_map(row).collect();
        let mean = |i: usize| {
            let values = all.iter().filter_map(|row| row.get(i).copied());
            over_replicates(&values.collect::<Vec<_>>()).mean
        };
        Some(GlobalCoefficients {
            basis: "legendre",
            degree: self.summary.score_degree,
            v: row(0)?.to_vec(),
            e: (0..unknowns).map(mean).collect(),
        })
    }
}
