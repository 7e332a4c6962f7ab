//! Where the walks of goals start, and what v gives there.

use fredholm_core::array::from_fn;
use fredholm_core::{Equation, Functional, Goal, Located, Real, Start, StartOf, Uniforms};
use fredholm_cube::{ScalarField, Weighted};
use fredholm_model::{Error, Region, Request, WithStarts};
use fredholm_variance::Density;

use super::domain::Domain;
use super::functions::WatchedFunction;
use super::system::Boxed;

/// A weighted mean with a neighbour equation of any degree.
pub(super) struct WeightedStart<'a, F, const D: usize> {
    pub(super) weight: WatchedFunction<'a, F>,
    /// What is known of v; nothing for plain walks, whose v is 0.
    pub(super) weighted: Option<Weighted<'a, F, D, WatchedFunction<'a, F>>>,
}

impl<F: Real, const D: usize> WeightedStart<'_, F, D> {
    /// Σ_ia v_ia w_ia/n.
    pub(super) fn of_means(&self) -> f64 {
        self.weighted.as_ref().map_or(0.0, Weighted::of_means)
    }

    /// The estimate of (v, Φ) from φ(x0) and v(x0) at a start.
    pub(super) fn control(&self, x0: &Located<[F; D]>, phi: F, v: F) -> f64 {
        let weighted = self.weighted.as_ref();
        weighted.map_or(0.0, |weighted| weighted.control(x0, phi, v))
    }
}

/// The goals of walks, and (v, Φ) of each.
pub(super) type GoalsOf<'a, F, const D: usize> = (Vec<Goal<Begin<'a, F, D>, f64>>, Vec<f64>);

/// The goals of walks that follow this neighbour equation.
pub(super) fn goals_of<'a, F: Real, const D: usize>(
    domain: &Domain<F>,
    neighbour: &Boxed<'_, F, D>,
    request: &Request<'_>,
    weighted: &'a [WeightedStart<'a, F, D>],
    mean: f64,
) -> Result<GoalsOf<'a, F, D>, Error> {
    let mut weighted = weighted.iter();
    let (mut goals, mut values) = (Vec::new(), Vec::new());
    for goal in request.goals {
        let (functional, galerkin) = match &goal.region {
            Region::Point(x) => {
                let x = domain.unit(x);
                let value = neighbour.value(&neighbour.locate(x)).to_f64();
                (Begin::Point(x), value)
            }
            Region::Weight(_) | Region::Function(_) => {
                let weighted = weighted.next();
                let weighted = weighted.ok_or(Error::Internal("a weight has no means"))?;
                (Begin::Weighted(weighted), weighted.of_means())
            }
            _ => (Begin::Mean, mean),
        };
        values.push(galerkin);
        let is_known = !matches!(functional, Begin::Weighted(_));
        goals.push(Goal::new(functional, is_known.then_some(galerkin)));
    }
    Ok((goals, values))
}

/// Where the walks of a goal start.
pub(super) enum Begin<'a, F, const D: usize> {
    Point([F; D]),
    Mean,
    Weighted(&'a WeightedStart<'a, F, D>),
}

impl<E, F, const D: usize> Functional<E> for Begin<'_, F, D>
where
    E: Equation<Scalar = F, Point = [F; D], Value = F>,
    F: Real,
{
    // Always: a call here would keep the walk's generator in memory, whose steps then wait for it.
    #[inline(always)]
    fn start<U: Uniforms<F>>(&self, equation: &E, uniforms: &mut U) -> StartOf<E> {
        if let Self::Point(x) = self {
            return Start::of(equation, *x, F::one());
        }
        let x = from_fn(|_| uniforms.uniform());
        let phi = match self {
            Self::Weighted(weighted) => weighted.weight.value(&x),
            _ => F::one(),
        };
        Start::of(equation, x, phi)
    }

    fn control_estimate(&self, x0: &Located<[F; D]>, phi: F, v: &F) -> f64 {
        match self {
            Self::Weighted(weighted) => weighted.control(x0, phi, *v),
            // These are known.
            Self::Point(_) | Self::Mean => (phi * *v).to_f64(),
        }
    }
}

/// Calls `then` with the starts of the walks of all goals, as an analysis sees it.
pub(super) fn with_starts<const D: usize>(
    request: &Request<'_>,
    domain: &Domain<f64>,
    neighbour: &Boxed<'_, f64, D>,
    weighted: &[WeightedStart<'_, f64, D>],
    then: &mut WithStarts<'_, [f64; D]>,
) -> Result<(), Error> {
    let mean = |_: &[f64; D]| Density::uniform(1.0);
    let densities: Vec<_> = weighted
        .iter()
        .map(|weighted| {
            move |x: &[f64; D]| {
                let phi = weighted.weight.value(x);
                let x = neighbour.locate(*x);
                let value = weighted.control(&x, phi, neighbour.value(&x));
                Density {
                    functional: phi,
                    square: phi * phi,
                    initial: 1.0,
                    fluctuation: value - weighted.of_means(),
                    known: 0.0,
                }
            }
        })
        .collect();
    let mut densities = densities.iter();
    let mut starts: Vec<fredholm_variance::Start<'_, [f64; D]>> = Vec::new();
    for goal in request.goals {
        starts.push(match &goal.region {
            Region::Point(x) => fredholm_variance::Start::At(domain.unit(x)),
            Region::Weight(_) | Region::Function(_) => match densities.next() {
                Some(density) => fredholm_variance::Start::Density(density),
                None => return Err(Error::Internal("a weight has no means")),
            },
            _ => fredholm_variance::Start::Density(&mean),
        });
    }
    then(&starts)
}
