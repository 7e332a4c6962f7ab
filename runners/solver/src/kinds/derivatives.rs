//! Equations of formulas together with those of their derivatives.
//!
//! With T' = ∂T_K/∂λ and F' = ∂F/∂λ the derivative u' of u solves u' = T u' + T' u + F'. Both are one system with the kernels
//! [[K, 0], [K', K]], so that all that solves systems gives derivatives, with error bars of their own.

use std::sync::Arc;

use fredholm_model::Quantity;

use super::system::{Components, Kernels, SystemModel};
use crate::{Error, Goal, Model, Region, Subject, WeightFn};

/// ∂K_ij/∂λ_q (x, y) by q, [i, j], x and y.
///
/// ```
/// let slopes: Box<fredholm::KernelSlopes> = Box::new(|_, _, x, y| x[0] * y[0]);
/// assert_eq!(slopes(0, [0, 0], &[2.0], &[3.0]), 6.0);
/// ```
pub type KernelSlopes = dyn Fn(usize, [usize; 2], &[f64], &[f64]) -> f64 + Send + Sync;
/// ∂F_i/∂λ_q (x) by q, i and x.
///
/// ```
/// let slopes: Box<fredholm::SourceSlopes> = Box::new(|_, i, x| x[i]);
/// assert_eq!(slopes(0, 1, &[2.0, 3.0]), 3.0);
/// ```
pub type SourceSlopes = dyn Fn(usize, usize, &[f64]) -> f64 + Send + Sync;

/// The quantities on which the functions of an equation depend, and the derivatives of these. Components are counted from 0, and so that of an
/// equation of one unknown function.
///
/// ```
/// use fredholm::{CubeModel, Derivatives, Quantity, Solver};
///
/// // u = a x ∫ y u dy + x: u = x/(1 − a/3), so that ∂u/∂a = ⅓ x/(1 − a/3)².
/// let derivatives = Derivatives {
///     quantities: vec![Quantity::number("a", 0.5)],
///     kernel: Box::new(|_, _, x, y| x[0] * y[0]),
///     source: Box::new(|_, _, _| 0.0),
/// };
/// let u = CubeModel::on_interval([0.0, 1.0], |x, y| 0.5 * x * y, |x| x).with_derivatives(derivatives);
/// let found = Solver::new(&u).at(0.5).sensitivities()?;
/// assert!((found.get("u(0.5)", "a").unwrap().derivative - 0.24).abs() < 1e-12);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
pub struct Derivatives {
    /// The quantities λ_q.
    pub quantities: Vec<Quantity>,
    /// ∂K/∂λ.
    pub kernel: Box<KernelSlopes>,
    /// ∂F/∂λ.
    pub source: Box<SourceSlopes>,
}

impl core::fmt::Debug for Derivatives {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Derivatives")
            .field("quantities", &self.quantities)
            .finish_non_exhaustive()
    }
}

/// An equation of so many components on a product of intervals.
pub(super) struct Given<'e> {
    pub(super) ends: Vec<[f64; 2]>,
    pub(super) edges: &'e [Vec<f64>],
    pub(super) components: usize,
    /// Whether the last coordinate of a point is the number of its component, from 1.
    pub(super) is_system: bool,
    pub(super) seconds: f64,
    pub(super) kernel: Arc<Kernels>,
    pub(super) source: Arc<Components>,
    pub(super) derivatives: &'e Arc<Derivatives>,
}

/// The weight of a region, and its component.
pub(super) type WeightOf<'w> = dyn Fn(&Region) -> Option<(usize, WeightFn)> + 'w;

impl Given<'_> {
    /// The system of the equation and of its derivatives, and the goals of the derivatives: of each goal those by all quantities. Component (1 + q) m + i
    /// is the derivative of component i by quantity q.
    pub(super) fn with_derivatives(
        self,
        goals: &[Goal],
        weight: &WeightOf<'_>,
    ) -> Result<(Box<dyn Model>, Vec<Goal>), Error> {
        self.check()?;
        let is_system = self.is_system;
        let (m, quantities) = (self.components, &self.derivatives.quantities);
        let (kernel, source) = (self.kernel, self.source);
        let [own, of_source] = [(); 2].map(|()| Arc::clone(self.derivatives));
        let mut model = SystemModel::new(
            self.ends,
            m * (1 + quantities.len()),
            move |[i, j], x, y| match (i / m, j / m) {
                (row, column) if row == column => kernel([i % m, j % m], x, y),
                (row, 0) => (own.kernel)(row - 1, [i % m, j], x, y),
                _ => 0.0,
            },
            move |i, x| match i / m {
                0 => source(i, x),
                row => (of_source.source)(row - 1, i % m, x),
            },
        )
        .with_edges(self.edges)
        .with_seconds(self.seconds);
        let (mut all, mut weights) = (Vec::new(), 0);
        for goal in goals {
            for (q, quantity) in quantities.iter().enumerate() {
                let copy = |component: usize| (1 + q) * m + component;
                let region = match &goal.region {
                    Region::Point(x) if !is_system => {
                        Region::Point([&**x, &[(copy(0) + 1) as f64]].concat())
                    }
                    Region::Point(x) => {
                        let (number, x) = x.split_last().unwrap_or((&1.0, &[]));
                        Region::Point([x, &[number + ((1 + q) * m) as f64]].concat())
                    }
                    Region::Whole => Region::Part(copy(0)),
                    Region::Part(component) => Region::Part(copy(*component)),
                    region => {
                        let own = weight(region);
                        let (component, own) =
                            own.ok_or(Error::Internal("a region without a derivative"))?;
                        let name = format!("weight {weights}");
                        model = model.weight(&name, copy(component), move |x| own.value(x));
                        weights += 1;
                        Region::Weight(weights - 1)
                    }
                };
                all.push(Goal::new(
                    format!("{} by {}", goal.name, quantity.name),
                    region,
                ));
            }
        }
        Ok((Box::new(model), all))
    }

    /// Refuses derivatives that are none at some points where the kernel and the source are finite.
    fn check(&self) -> Result<(), Error> {
        const POINTS: u32 = 7;
        let at = |shift: f64| (0..POINTS).map(move |i| (f64::from(i) + shift) / f64::from(POINTS));
        let domain = crate::domain::Domain::<f64>::new(&self.ends);
        let point = |t: f64| -> Vec<f64> {
            let axes = 0..self.ends.len();
            axes.map(|axis| domain.coordinate(axis, t)).collect()
        };
        for (q, quantity) in self.derivatives.quantities.iter().enumerate() {
            let is_none = |[value, slope]: [f64; 2]| value.is_finite() && !slope.is_finite();
            let of_points = |x: &[f64]| {
                let sources = (0..self.components)
                    .any(|i| is_none([(self.source)(i, x), (self.derivatives.source)(q, i, x)]));
                let pairs =
                    (0..self.components).flat_map(|i| (0..self.components).map(move |j| [i, j]));
                let mut ys = at(0.61).map(point);
                sources
                    || ys.any(|y| {
                        pairs.clone().any(|ij| {
                            is_none([
                                (self.kernel)(ij, x, &y),
                                (self.derivatives.kernel)(q, ij, x, &y),
                            ])
                        })
                    })
            };
            if at(0.37).map(point).any(|x| of_points(&x)) {
                return Err(Error::Option {
                    subject: Subject::Sensitivities,
                    message: format!(
                        "there is no derivative by `{}`: it moves a jump, in a condition, `floor`, `ceil` or `sign`, or is an argument of \
                         `gamma` or `lgamma`",
                        quantity.name
                    ),
                });
            }
        }
        Ok(())
    }
}
