//! A circular tube with black ends.

use fredholm_core::{Dependence, Equation as _, NoDraws, Real};
use fredholm_tube::Tube;

pub use fredholm_tube::Parameters;

use fredholm_model::resolvent::{ResolventFound, ResolventQuestion};
use fredholm_model::{About, Quantity};

use super::{ANY, PART, Told, numbered};
use crate::{CustomModel, Discretisation, Error, Goal, Model, Pairs, Partitioned, Region};

/// Seconds of a value of k and of p.
const KERNEL: f64 = 8e-9;

/// The model of a circular tube with black ends, whose radius is the unit of length; a point has one coordinate, along the axis.
///
/// u is what a ring of the wall sends out. Three weights have names: "wall" is the mean of u over the wall, "left" and "right" are what comes
/// to the ends at 0 and at L.
///
/// ```
/// use fredholm::tube::Parameters;
/// use fredholm::{Solver, TubeModel};
///
/// // A white tube as long as its radius: 0.671983901919 of what one end sends in comes to the other (Clausing 1932).
/// let u = TubeModel::new(Parameters { length: 1.0, reflectance: 1.0, emission: 0.0, ends: [0.0, 1.0] });
/// let report = Solver::new(&u).weighted("left").solve_to(1e-6)?;
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 0.671_983_901_919).abs() < 5e-6);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Debug)]
pub struct TubeModel(CustomModel<Tube<f64>>);

impl Model for TubeModel {
    delegated!(inner);
    delegated_checks!(inner);
}

impl TubeModel {
    const fn inner(&self) -> &CustomModel<Tube<f64>> {
        &self.0
    }

    /// The tube with these parameters.
    #[must_use]
    pub fn new(parameters: Parameters) -> Self {
        let length = parameters.length;
        let model = of_scalar::<f64>(parameters)
            .with_f32(of_scalar::<f32>(parameters))
            .named("tube")
            .with_levels([1, 2, 4, 8, 16, 32, 64, 128, 256, 512].map(|rings| rings + 2))
            .with_coordinates(vec![[0.0, length]])
            .with_kernel_seconds(KERNEL);
        Self(model)
    }
}

/// The tube in one scalar.
fn of_scalar<F: Real>(parameters: Parameters) -> CustomModel<Tube<F>> {
    let length = parameters.length;
    let end = Tube::<f64>::new(1, &parameters).map_or(f64::NAN, |tube| tube.end());
    let (quantities, dependences) = quantities::<F>(parameters);
    CustomModel::from_cells(move |cells| Tube::new(cells, &parameters))
        .with_quantities(quantities, dependences)
        .with_pair_integrals::<1>()
        .weight("wall", move |x: &F| match x.to_f64() {
            x if (0.0..=length).contains(&x) => 1.0 / length,
            _ => 0.0,
        })
        .weight(
            "left",
            move |x| if x.to_f64() < 0.0 { 1.0 / end } else { 0.0 },
        )
        .weight(
            "right",
            move |x| if x.to_f64() > length { 1.0 / end } else { 0.0 },
        )
}

/// The quantities of a tube, and what points have to do with them.
fn quantities<F: Real>(parameters: Parameters) -> Told<F> {
    let Parameters {
        length,
        reflectance,
        emission,
        ends,
    } = parameters;
    let all = [
        numbered("emission", &[emission], ANY),
        numbered("ends", &ends, ANY),
        numbered("reflectance", &[reflectance], PART),
    ]
    .concat();
    // F is linear in what is emitted.
    let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let units = units.map(|[emission, left, right]| {
        let one = Parameters {
            emission,
            ends: [left, right],
            ..parameters
        };
        Tube::<F>::new(1, &one)
    });
    // What the ends give to the wall directly is in F, too, and u tells it unless the wall is black.
    let white = Parameters {
        emission: 0.0,
        reflectance: 1.0,
        ..parameters
    };
    let direct = Tube::<F>::new(1, &white).ok();
    let direct = direct.filter(|_| reflectance == 0.0);
    let dependences = move |_: Option<&F>, x: &F, each: &mut dyn FnMut(Dependence)| {
        for (quantity, unit) in units.iter().enumerate() {
            if let Ok(unit) = unit {
                let source = unit.source(x, &mut NoDraws).to_f64();
                each(Dependence {
                    source,
                    ..Dependence::on(quantity)
                });
            }
        }
        if (0.0..=length).contains(&x.to_f64()) {
            let on = Dependence::on_factor(units.len(), emission, reflectance);
            let source = direct
                .as_ref()
                .map(|own| own.source(x, &mut NoDraws).to_f64());
            each(Dependence {
                source: on.source + source.unwrap_or(0.0),
                ..on
            });
        }
    };
    (all, Box::new(dependences))
}
