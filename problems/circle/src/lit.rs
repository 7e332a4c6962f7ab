//! The last step of a walk, to bright arcs.

use alloc::vec::Vec;

use fredholm_core::galerkin::{GalerkinError, buffer};
use fredholm_core::{Lights, Located, Real, Uniforms, Value};

use crate::geometry::Geometry;
use crate::system::GalerkinSystem;
use crate::{Arcs, Circle, CircleError, Emission, Harmonic, Moment, Point, Residual, Tables};

/// Emission on arcs to which the last step of a walk leads: see [`LastStep`](fredholm_core::LastStep). A small light is met by
/// few walks.
///
/// On the circle nothing has to be drawn for it: T_K F is known in every point, as F is constant on every cell.
///
/// ```
/// use fredholm_circle::{Arcs, Circle, LitArcs, OwnedTables};
/// use fredholm_core::{Equation, LastStep, NoDraws};
///
/// let tables = OwnedTables::<f64>::new(&[0.5], 4)?;
/// let lights = LitArcs::new(Arcs::new([2.0, 0.0, 0.0, 0.0], 4)?, &tables)?;
/// let circle = Circle::new(tables, lights)?;
/// // From the point opposite the middle of a quarter: ½ · 2 · sin(π/8).
/// let opposite = circle.point(1.25 * core::f64::consts::PI);
/// let score = LastStep(&circle).source(&opposite, &mut NoDraws);
/// assert!((score - (core::f64::consts::PI / 8.0).sin()).abs() < 1e-15);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct LitArcs<A, W, F> {
    arcs: Arcs<A, W>,
    /// F in every cell, of the first channel first, and its moments.
    values: Vec<F>,
    moments: Vec<Moment<F>>,
}

impl<A: AsRef<[W]>, W: Value<f64>, F: Real> LitArcs<A, W, F> {
    /// The lights of a circle with these tables.
    ///
    /// # Errors
    /// [`GalerkinError::Memory`].
    pub fn new<T>(arcs: Arcs<A, W>, tables: &T) -> Result<Self, GalerkinError>
    where
        T: Tables<Scalar = F>,
        T::Value: Value<F, Wide = W>,
    {
        let (cells, channels) = (tables.cells().len(), tables.reflectance(0).channels());
        let mut values = buffer(cells * channels)?;
        let mut moments = buffer(cells * channels)?;
        let of_channels = values
            .chunks_exact_mut(cells)
            .zip(moments.chunks_exact_mut(cells));
        for (channel, (values, moments)) in of_channels.enumerate() {
            for (i, value) in values.iter_mut().enumerate() {
                *value = arcs.value::<F, T::Value>(i).get(channel);
            }
            GalerkinSystem::new(tables, &(), 1).moments(values, moments)?;
        }
        Ok(Self {
            arcs,
            values,
            moments,
        })
    }

    /// T_K F.
    #[inline]
    fn reflected<T: Tables<Scalar = F>>(&self, tables: &T, x: &Point<F>) -> T::Value {
        let x = Located {
            point: *x,
            cell: x.cell(),
        };
        Residual::<T, 1>::unchecked(tables, &self.values, &self.moments).reflected(&x)
    }
}

impl<F, V, A> Emission<F, V> for LitArcs<A, V::Wide, F>
where
    F: Real,
    V: Value<F>,
    A: AsRef<[V::Wide]>,
{
    #[inline]
    fn emission(&self, x: &Point<F>, _: &V) -> V {
        self.arcs.value(x.cell())
    }

    fn validate(&self, cells: usize, channels: usize) -> Result<(), CircleError> {
        Emission::<F, V>::validate(&self.arcs, cells, channels)
    }
}

impl<T, A, W> Lights for Circle<T, LitArcs<A, W, T::Scalar>>
where
    T: Tables,
    T::Value: Value<T::Scalar, Wide = W>,
    W: Value<f64>,
    A: AsRef<[W]>,
{
    /// T_K F.
    #[inline]
    fn light<U: Uniforms<T::Scalar>>(&self, x: &Point<T::Scalar>, _: &mut U) -> T::Value {
        self.emission().reflected(self.tables(), x)
    }

    /// F.
    #[inline]
    fn known(&self, x: &Point<T::Scalar>) -> T::Value {
        self.emission().arcs.value(x.cell())
    }

    #[inline]
    fn rest(&self, x: &Point<T::Scalar>) -> T::Value {
        let channels = self.tables().reflectance(x.cell()).channels();
        T::Value::splat(channels, T::Scalar::default())
    }
}

/// The emission of a circle in one type: of one channel, with arcs to which last steps may lead.
#[derive(Clone, Debug)]
pub enum Light<F> {
    /// The emission (57), whose solution is known.
    Harmonic(Harmonic),
    /// Piecewise constant.
    Arcs(LitArcs<Vec<f64>, f64, F>),
}

impl<F: Real> Emission<F> for Light<F> {
    #[inline]
    fn emission(&self, x: &Point<F>, reflectance: &F) -> F {
        match self {
            Self::Harmonic(light) => light.emission(x, reflectance),
            Self::Arcs(light) => light.emission(x, reflectance),
        }
    }

    fn validate(&self, cells: usize, channels: usize) -> Result<(), CircleError> {
        match self {
            Self::Harmonic(light) => Emission::<F>::validate(light, cells, channels),
            Self::Arcs(light) => Emission::<F>::validate(light, cells, channels),
        }
    }
}

/// Arcs are lights, and the emission (57) is none.
impl<T: Tables<Value = <T as Tables>::Scalar>> Lights for Circle<T, Light<T::Scalar>> {
    #[inline]
    fn light<U: Uniforms<T::Scalar>>(&self, x: &Point<T::Scalar>, _: &mut U) -> T::Scalar {
        match self.emission() {
            Light::Harmonic(_) => T::Scalar::default(),
            Light::Arcs(lights) => lights.reflected(self.tables(), x),
        }
    }

    #[inline]
    fn known(&self, x: &Point<T::Scalar>) -> T::Scalar {
        match self.emission() {
            Light::Harmonic(_) => T::Scalar::default(),
            Light::Arcs(lights) => lights.arcs.value(x.cell()),
        }
    }
}

impl<T: Tables<Value = <T as Tables>::Scalar>> Circle<T, Light<T::Scalar>> {
    /// The circle with the emission (57).
    ///
    /// # Errors
    /// [`CircleError`].
    pub fn harmonic(tables: T, light: Harmonic) -> Result<Self, CircleError> {
        Self::new(tables, Light::Harmonic(light))
    }

    /// The circle with an emission on equal arcs, to which last steps may lead.
    ///
    /// # Errors
    /// [`CircleError`]: the arcs do not fit the cells.
    pub fn with_arcs(tables: T, values: Vec<f64>) -> Result<Self, CircleError> {
        let arcs = Arcs::new(values, tables.cells().len())?;
        let cells = tables.cells().len();
        let lights = LitArcs::new(arcs, &tables).map_err(|_| CircleError::Memory { cells })?;
        Self::new(tables, Light::Arcs(lights))
    }
}
