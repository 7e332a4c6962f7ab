//! Scattering on the unit sphere.

use core::f64::consts::PI;

use fredholm_core::{Dependence, Real};
use fredholm_sphere::{Sphere, SphereError, point};

pub use fredholm_sphere::Parameters;

use fredholm_model::resolvent::{ResolventFound, ResolventQuestion};
use fredholm_model::{About, Quantity};

use super::{ANY, PART, numbered};
use crate::{CustomModel, Discretisation, Error, Goal, Model, Pairs, Partitioned, Region};

/// Seconds of a value of k and of p.
const KERNEL: f64 = 10e-9;

/// The model of scattering on the unit sphere; a point has two coordinates, its colatitude and its azimuth.
///
/// ```
/// use fredholm::sphere::Parameters;
/// use fredholm::{Solver, SphereModel};
///
/// let parameters = Parameters { albedo: 0.6, asymmetry: 0.3, emission: [1.0, 0.5, -0.7, 0.4], forward: 0.5 };
/// let u = SphereModel::new(parameters);
/// let report = Solver::new(&u).mean().at([1.0, 2.0]).solve_to(1e-3)?;
/// // The mean is e₀/(1 − a).
/// assert!((report.goals[0].preconditioned.estimate.unwrap() - 2.5).abs() < 5e-3);
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Debug)]
pub struct SphereModel(CustomModel<Sphere<f64>>);

impl Model for SphereModel {
    delegated!(inner);
    delegated_checks!(inner);
}

impl SphereModel {
    const fn inner(&self) -> &CustomModel<Sphere<f64>> {
        &self.0
    }

    /// The sphere with these parameters.
    #[must_use]
    pub fn new(parameters: Parameters) -> Self {
        let bands = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];
        let model = of_scalar::<f64>(parameters)
            .with_f32(of_scalar::<f32>(parameters))
            .named("sphere")
            .by_its_chain()
            .with_levels(bands.map(|bands| 2 * bands * bands))
            .with_coordinates(vec![[0.0, PI], [0.0, 2.0 * PI]])
            .with_place(|angles| match *angles {
                [colatitude, azimuth] => point(colatitude, azimuth),
                _ => [f64::NAN; 3],
            })
            .with_solution(move |x| parameters.solution(x))
            .with_kernel_seconds(KERNEL);
        Self(model)
    }
}

/// The sphere in one scalar.
fn of_scalar<F: Real>(parameters: Parameters) -> CustomModel<Sphere<F>> {
    let build = move |cells: usize| {
        let [bands, sectors] = shape(cells).map(u32::try_from);
        match (bands, sectors) {
            (Ok(bands), Ok(sectors)) => Sphere::new(bands, sectors, &parameters),
            _ => Err(SphereError::Cells),
        }
    };
    let Parameters {
        albedo: a,
        asymmetry: g,
        emission,
        ..
    } = parameters;
    let quantities = [
        numbered("albedo", &[a], PART),
        numbered("asymmetry", &[g], [0.0, 0.5]),
        numbered("emission", &emission, ANY),
    ];
    CustomModel::with_own_starts(move |cells| Ok(build(cells)?)).with_quantities(
        quantities.concat(),
        move |before, x, each| {
            let x = x.map(F::to_f64);
            let terms = [1.0, x[0], x[1], x[2]];
            let source: f64 = emission.iter().zip(terms).map(|(e, term)| e * term).sum();
            each(Dependence::on_factor(0, source, a));
            if let Some(before) = before {
                let products = before.iter().zip(x).map(|(y, x)| y.to_f64() * x);
                each(Dependence {
                    of_u: slope_of_phase(g, products.sum()),
                    ..Dependence::on(1)
                });
            }
            for (axis, source) in terms.into_iter().enumerate() {
                each(Dependence {
                    source,
                    ..Dependence::on(2 + axis)
                });
            }
        },
    )
}

/// (∂K/∂g)/K of x·y, where K is (1 − g²)/(1 + g² − 2g x·y)^(3/2) times what does not depend on g.
fn slope_of_phase(g: f64, cosine: f64) -> f64 {
    3.0 * (cosine - g) / (1.0 + g * g - 2.0 * g * cosine) - 2.0 * g / (1.0 - g * g)
}

/// Bands and sectors whose product is the number of cells: about twice as many sectors as bands.
fn shape(cells: usize) -> [usize; 2] {
    let ratio = |bands: usize| {
        let wanted = (2 * bands * bands) as f64 / cells as f64;
        wanted.max(1.0 / wanted)
    };
    let bands = (1..=cells.isqrt()).filter(|bands| cells.is_multiple_of(*bands));
    let bands = bands.min_by(|a, b| ratio(*a).total_cmp(&ratio(*b)));
    let bands = bands.unwrap_or(1);
    [bands, cells / bands]
}
