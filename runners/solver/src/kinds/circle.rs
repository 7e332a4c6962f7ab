//! Flatland radiosity on the unit circle.

use core::any::Any;
use core::f64::consts::TAU;

pub use fredholm_circle::Harmonic;
use fredholm_circle::{Circle, Emission as _, Light, OwnedTables, Point, Residual};
use fredholm_core::galerkin::{Cells as _, DiagonalRule, PairKind, Piecewise};
use fredholm_core::{Dependence, Real, SourcePart, best_lights};

use fredholm_model::resolvent::{ResolventFound, ResolventQuestion};
use fredholm_model::{About, Quantity};

use super::{ANY, PART, Told, numbered};
use crate::custom::{
    Closed, Degree, DegreePairs, Kinds, Nodes, Of, OnCells, Smooth, Use, squared_radius,
};
use crate::{CustomModel, Discretisation, Error, Goal, Model, Pairs, Partitioned, Region};

/// Time of the light of an arc in a last step, over that of a step.
const TIME_OF_LIGHT: f64 = 0.5;
/// Seconds of a step and a state.
const STEP: f64 = 5e-9;

/// The equation of light on the unit circle, in one scalar.
type LitCircle<F> = Circle<OwnedTables<F>, Light<F>>;

/// The model of light on the unit circle (Heinrich 1995, section 5).
///
/// ```
/// use fredholm::circle::Emission;
/// use fredholm::{CircleModel, Solver};
///
/// // Reflectance ½, a lamp on the upper half: the mean of u is ½/(1 − ½).
/// let u = CircleModel::new(vec![0.5], Emission::Arcs(vec![1.0, 0.0]));
/// let report = Solver::new(&u).mean().at(1.0).solve_to(1e-4)?;
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 1.0).abs() < 5e-4);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Debug)]
pub struct CircleModel(CustomModel<LitCircle<f64>>);

impl Model for CircleModel {
    delegated!(inner);
    delegated_checks!(inner);
}

/// The emission of a circle.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Emission {
    /// The emission for which a constant and a wave are the solution (Heinrich 1995, (57)–(58)).
    Harmonic(Harmonic),
    /// Constant on each of so many equal arcs of [0, 2π).
    Arcs(Vec<f64>),
}

impl CircleModel {
    const fn inner(&self) -> &CustomModel<LitCircle<f64>> {
        &self.0
    }

    /// A circle with `reflectance` on equal arcs of [0, 2π).
    #[must_use]
    pub fn new(reflectance: Vec<f64>, emission: Emission) -> Self {
        let unit = match &emission {
            Emission::Harmonic(_) => reflectance.len(),
            Emission::Arcs(values) => common_multiple(reflectance.len(), values.len()),
        };
        let levels: Vec<usize> = (3..=10)
            .map(|k| (1_usize << k).next_multiple_of(unit.max(1)))
            .collect();
        let mut single = of_scalar::<f32>(reflectance.clone(), emission.clone());
        if let Emission::Arcs(_) = emission {
            single = single.with_lights(false);
        }
        let model = of_scalar::<f64>(reflectance.clone(), emission.clone())
            .with_f32(single)
            .named("circle")
            .by_its_chain()
            .with_levels(levels)
            .with_coordinates(vec![[0.0, TAU]])
            .with_arcs()
            .with_place(|angle| match angle {
                [s, ..] => [s.cos(), s.sin(), 0.0],
                [] => [f64::NAN; 3],
            })
            .with_kernel_seconds(STEP);
        Self(match emission {
            Emission::Harmonic(light) => model.with_solution(move |x| light.solution(x.angle())),
            Emission::Arcs(values) => {
                let mean = reflectance.iter().sum::<f64>() / reflectance.len().max(1) as f64;
                let part = |&source: &f64| SourcePart {
                    measure: 1.0,
                    source,
                    reflectance: mean,
                };
                let parts: Vec<SourcePart> = values.iter().map(part).collect();
                model.with_lights(!best_lights(&parts, TIME_OF_LIGHT).is_empty())
            }
        })
    }
}

/// The least common multiple; at most `usize::MAX`.
#[must_use]
pub fn common_multiple(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    (a / x.max(1)).saturating_mul(b)
}

/// The circle in one scalar.
fn of_scalar<F: Real>(reflectance: Vec<f64>, emission: Emission) -> CustomModel<LitCircle<F>> {
    let own = reflectance.clone();
    let (quantities, dependences) = quantities::<F>(reflectance.clone(), emission.clone());
    let build = move |cells: usize| {
        let tables = OwnedTables::<F>::new(&own, cells)?;
        match &emission {
            Emission::Harmonic(light) => Circle::harmonic(tables, *light),
            Emission::Arcs(values) => Circle::with_arcs(tables, values.clone()),
        }
    };
    let closed = || reflectance.clone();
    CustomModel::with_own_starts(move |cells| Ok(build(cells)?))
        .with_quantities(quantities, dependences)
        .without_degrees()
        .with_degree(ClosedForms::<1>(closed()))
        .with_degree(ClosedForms::<2>(closed()))
        .with_degree(ClosedForms::<3>(closed()))
        .with_degree(ClosedForms::<4>(closed()))
        .with_degree(ClosedForms::<5>(closed()))
}

/// The quantities of a circle, and what points have to do with them. A harmonic emission goes with the reflectance, on which its solution does not
/// depend.
fn quantities<F: Real>(reflectance: Vec<f64>, emission: Emission) -> Told<Point<F>> {
    let all = match &emission {
        Emission::Harmonic(light) => [
            numbered("constant", &[light.constant], ANY),
            numbered("amplitude", &[light.amplitude], ANY),
        ],
        Emission::Arcs(values) => [
            numbered("emission", values, ANY),
            numbered("reflectance", &reflectance, PART),
        ],
    };
    let all = all.concat();
    let dependences =
        move |_: Option<&Point<F>>, x: &Point<F>, each: &mut dyn FnMut(Dependence)| {
            let turn = x.angle().to_f64() / TAU;
            let arc = |arcs: &[f64]| {
                let arc = ((turn * arcs.len() as f64) as usize).min(arcs.len().saturating_sub(1));
                (arc, arcs.get(arc).copied().unwrap_or_default())
            };
            let (own, rho) = arc(&reflectance);
            match &emission {
                Emission::Harmonic(light) => {
                    for (quantity, [constant, amplitude]) in
                        [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate()
                    {
                        let one = Harmonic {
                            constant,
                            amplitude,
                            ..*light
                        };
                        let source = one.emission(x, &F::from_f64(rho)).to_f64();
                        each(Dependence {
                            source,
                            ..Dependence::on(quantity)
                        });
                    }
                }
                Emission::Arcs(values) => {
                    let (arc, value) = arc(values);
                    each(Dependence {
                        source: 1.0,
                        ..Dependence::on(arc)
                    });
                    each(Dependence::on_factor(values.len() + own, value, rho));
                }
            }
        };
    (all, Box::new(dependences))
}

/// Steps within a cell are left out.
const PAPER: DiagonalRule = DiagonalRule {
    diagonal: PairKind::Dropped,
};

/// K', v and walks of the circle in closed form, with B functions on a cell and these reflectances.
struct ClosedForms<const B: usize>(Vec<f64>);

impl<const B: usize> ClosedForms<B> {
    /// The circle in f64, without light.
    fn wide(&self, cells: usize) -> Result<LitCircle<f64>, Error> {
        let dark = Harmonic {
            constant: 0.0,
            amplitude: 0.0,
            frequency: 1,
        };
        let tables = OwnedTables::new(&self.0, cells)?;
        Ok(Circle::harmonic(tables, dark)?)
    }
}

impl<F: Real, const B: usize> Degree<LitCircle<F>> for ClosedForms<B> {
    fn functions(&self) -> usize {
        B
    }

    fn pairs(&self) -> DegreePairs {
        DegreePairs {
            pointwise: true,
            paper: PAPER,
            default: Kinds::AllPointwise,
        }
    }

    fn stored(&self, _: usize) -> Option<usize> {
        Some(0)
    }

    fn entries(&self, _: &LitCircle<F>, _: usize) -> Result<Vec<f64>, Error> {
        Ok(Vec::new())
    }

    /// The coefficients of walks in f32 are those in f64.
    fn matrix<'e>(&self, circle: &'e LitCircle<F>, _: &'e [f64]) -> Result<Closed<'e>, Error> {
        let circle: &dyn Any = circle;
        match circle.downcast_ref::<LitCircle<f64>>() {
            Some(circle) => Ok(Box::new(circle.system::<B>())),
            None => Err(Error::Internal("coefficients of a circle are in f64")),
        }
    }

    fn on_cells(&self) -> &dyn OnCells<LitCircle<F>> {
        &Smooth::<B>
    }

    fn with_neighbour(
        &self,
        of: &Of<'_, LitCircle<F>>,
        kinds: Kinds,
        then: &mut Use<'_, LitCircle<F>>,
    ) -> Result<(), Error> {
        let circle = of.equation;
        let wide = self.wide(circle.cells())?;
        let system = wide.system::<B>();
        let diagonal = match kinds {
            Kinds::AllPointwise => {
                let v = of.solution.rounded::<F>()?;
                let moments = system.residual_moments::<F>(of.solution)?;
                return then(&Residual::<_, B>::new(circle.tables(), &v, &moments)?, &v);
            }
            Kinds::Paper => PAPER.diagonal,
            Kinds::DiagonalPointwise => PairKind::Pointwise,
            Kinds::AllInS => PairKind::Galerkin,
        };
        let vectors = of.solution.for_walks(&system, DiagonalRule { diagonal })?;
        let own = circle.system::<B>();
        let neighbour: Piecewise<'_, _, _, _, _, _, B> = vectors.with_pointwise(circle, &own)?;
        then(&neighbour, vectors.v())
    }

    fn neighbour_radius(
        &self,
        of: &Of<'_, LitCircle<F>>,
        nodes: &Nodes<Point<F>>,
        kinds: Kinds,
    ) -> Result<f64, Error> {
        let wide = self.wide(of.equation.cells())?;
        let pairs = kinds.any(PAPER);
        squared_radius::<_, _, B>(of.equation, &wide.system::<B>(), nodes, &pairs)
    }
}
