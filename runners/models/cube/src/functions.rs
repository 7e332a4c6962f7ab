//! The functions of a cube whose dimension is chosen at run time, and who watches their values.

use core::fmt::{self, Debug, Display};
use std::sync::OnceLock;

use fredholm_core::Real;
use fredholm_cube::{Cube, CubeError, KernelFactors, KernelFn, KernelIntegral, ScalarField};

use super::CubeModel;
use super::closures::in_double;
use super::compiled::CompiledWalks;
use super::degree::{AnyDegree, Degree};
use super::domain::Domain;
use fredholm_model::{Error, Region, WeightFn};

/// Kernel, source and what else is known of an equation on [0, 1]^d or another product of intervals, for walks in both
/// scalars.
pub trait CubeFunctions: Send + Sync {
    /// d, from 1 to 6.
    fn dimension(&self) -> usize;

    /// The ends of every axis' interval, the lower first; none for [0, 1]^d. All points are points of this domain, and
    /// the measure is dy on it.
    fn domain(&self) -> &[[f64; 2]] {
        &[]
    }

    /// Whether the kernel is a product of one factor for each axis.
    fn is_product(&self) -> bool {
        false
    }

    /// Whether the integral of the kernel, or of its factors, is known.
    fn has_integral(&self) -> bool {
        false
    }

    /// Whether the solution is known.
    fn has_solution(&self) -> bool {
        false
    }

    /// The number of weights.
    fn weights(&self) -> usize {
        0
    }

    /// The text of the weight of this number.
    fn weight_text(&self, number: usize) -> Option<&str> {
        let _ = number;
        None
    }

    /// Seconds of a value of the kernel, of its integral and of the source.
    fn seconds(&self) -> [f64; 3];

    /// Hands out the functions in f64.
    fn with_f64(&self, then: &mut dyn FnMut(&dyn CubeValues<f64>));

    /// Hands out the functions in f32.
    fn with_f32(&self, then: &mut dyn FnMut(&dyn CubeValues<f32>));
}

/// The values of a cube's functions in one scalar; x and y have d coordinates.
pub trait CubeValues<F: Real>: Sync {
    /// K(x, y), if it is no product.
    fn kernel(&self, x: &[F], y: &[F]) -> F;

    /// F(x).
    fn source(&self, x: &[F]) -> F;

    /// The factor of the kernel on an axis; NaN if it is no product.
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let _ = (axis, x, y);
        F::NAN
    }

    /// ∫ K(x, t) dt up to y, of the kernel or of its factor on an axis, from wherever it begins; NaN if it is not known.
    fn integral(&self, axis: usize, x: F, y: F) -> F {
        let _ = (axis, x, y);
        F::NAN
    }

    /// u(x); NaN if it is not known.
    fn solution(&self, x: &[F]) -> F {
        let _ = x;
        F::NAN
    }

    /// The weight of this number in x; NaN if there is none.
    fn weight(&self, number: usize, x: &[F]) -> F {
        let _ = (number, x);
        F::NAN
    }
}

/// A scalar of walks on a cube.
pub(super) trait CubeScalar: Real {
    /// Hands out the functions in this scalar.
    fn with(functions: &dyn CubeFunctions, then: &mut dyn FnMut(&dyn CubeValues<Self>));

    /// Functions on a cell for walks in this scalar.
    fn degree<const D: usize>(any: &dyn AnyDegree<D>) -> &dyn Degree<Self, D>;

    /// Walks in this scalar that are compiled for an equation, if there are some.
    fn compiled<const D: usize>(model: &CubeModel) -> Option<&dyn CompiledWalks<Self, D>>;
}

impl CubeScalar for f64 {
    fn with(functions: &dyn CubeFunctions, then: &mut dyn FnMut(&dyn CubeValues<Self>)) {
        functions.with_f64(then);
    }

    fn degree<const D: usize>(any: &dyn AnyDegree<D>) -> &dyn Degree<Self, D> {
        any
    }

    fn compiled<const D: usize>(model: &CubeModel) -> Option<&dyn CompiledWalks<Self, D>> {
        model.compiled()
    }
}

impl CubeScalar for f32 {
    fn with(functions: &dyn CubeFunctions, then: &mut dyn FnMut(&dyn CubeValues<Self>)) {
        functions.with_f32(then);
    }

    fn degree<const D: usize>(any: &dyn AnyDegree<D>) -> &dyn Degree<Self, D> {
        any
    }

    fn compiled<const D: usize>(_: &CubeModel) -> Option<&dyn CompiledWalks<Self, D>> {
        None
    }
}

/// Uses the functions in one scalar; what was not finite is the reason of the error that it caused.
pub(super) fn with_values<F: CubeScalar, R>(
    functions: &dyn CubeFunctions,
    then: impl FnOnce(&Watched<'_, F>) -> Result<R, Error>,
) -> Result<R, Error> {
    let (mut then, mut result) = (Some(then), None);
    explained::<F>(functions, &mut |watched| {
        if let Some(then) = then.take() {
            result = Some(then(watched)?);
        }
        Ok(())
    })?;
    result.ok_or(Error::Internal("functions without values"))
}

/// What [`with_values`] does but for the type of the result.
fn explained<F: CubeScalar>(
    functions: &dyn CubeFunctions,
    then: &mut dyn FnMut(&Watched<'_, F>) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut result = Ok(());
    watch(functions, &mut |watched| {
        result = then(watched).map_err(|error| watched.explain(error));
    });
    result
}

/// Hands out the functions in one scalar, watched.
pub(super) fn watch<F: CubeScalar>(
    functions: &dyn CubeFunctions,
    then: &mut dyn FnMut(&Watched<'_, F>),
) {
    F::with(functions, &mut |values| {
        then(&Watched {
            values,
            domain: Domain::new(functions.domain()),
            product: functions.is_product(),
            has_integral: functions.has_integral(),
            watch: Watch::new(),
        });
    });
}

/// The first value that was not finite.
type Watch = OnceLock<String>;

/// The functions, with the first value that was not finite.
pub(super) struct Watched<'a, F> {
    values: &'a dyn CubeValues<F>,
    domain: Domain<F>,
    product: bool,
    has_integral: bool,
    watch: Watch,
}

impl<F> Debug for Watched<'_, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watched")
            .field("product", &self.product)
            .field("watch", &self.watch)
            .finish_non_exhaustive()
    }
}

/// What helps where the kernel is not finite at x = y, if its integral can be given.
const AT_X_EQUALS_Y: &str = ", where x = y (give the exact integral of an integrable singularity as `kernel_integral`; \
     if the kernel has a limit there, write `x == y ? limit : …`)";
/// The advice in several dimensions, where no integral can be given.
const AT_X_EQUALS_Y_OF_MANY: &str = ", where x = y (if the kernel has a limit there, write it as a case, \
     `condition ? limit : …`; a singularity must be one of factors, `kernel_factors` with their `kernel_integral`)";

/// A value, watched.
#[inline]
fn finite<F: Real>(watch: &Watch, value: F, what: impl FnOnce() -> String) -> F {
    if !value.is_finite() {
        watch.get_or_init(what);
    }
    value
}

/// "0.5" or "[0.5, 0.25]".
fn point<F: Display>(x: &[F]) -> String {
    let texts: Vec<String> = x.iter().map(F::to_string).collect();
    match texts.as_slice() {
        [one] => one.clone(),
        _ => format!("[{}]", texts.join(", ")),
    }
}

impl<'a, F: Real> Watched<'a, F> {
    /// The kernel.
    pub(super) const fn kernel(&self) -> WatchedKernel<'_, F> {
        WatchedKernel(self)
    }

    /// One of the functions of one point.
    pub(super) const fn function<'s>(&'s self, which: Which<'s>) -> WatchedFunction<'s, F> {
        WatchedFunction {
            functions: self,
            which,
        }
    }

    /// The values, not watched.
    pub(super) const fn values(&self) -> &'a dyn CubeValues<F> {
        self.values
    }

    /// The map from [0, 1]^d.
    pub(super) const fn domain(&self) -> &Domain<F> {
        &self.domain
    }

    /// A value of the kernel or of a factor of it, watched. x = y is met by no walk and no pointwise pair: with the
    /// exact integral at hand a singularity there needs no value.
    #[inline]
    fn of_kernel(&self, value: F, x: &[F], y: &[F], name: impl FnOnce() -> String) -> F {
        if value.is_finite() {
            return value;
        }
        let same = x == y;
        if same && self.has_integral {
            return F::zero();
        }
        finite(&self.watch, value, || {
            let name = name();
            let advice = match (same, self.product || x.len() == 1) {
                (false, _) => "",
                (true, true) => AT_X_EQUALS_Y,
                (true, false) => AT_X_EQUALS_Y_OF_MANY,
            };
            format!(
                "`{name}` is {value} at x = {}, y = {}{advice}",
                point(x),
                point(y)
            )
        })
    }

    /// The equation on [0, 1]^D with so many cells of an axis.
    pub(super) fn cube<const D: usize>(
        &self,
        per_axis: usize,
    ) -> Result<ModelCube<'_, F, D>, CubeError> {
        Cube::new(self.kernel(), self.function(Which::Source), per_axis)
    }

    /// A value of the kernel, watched.
    #[inline]
    pub(super) fn watched_kernel(&self, value: F, x: &[F], y: &[F]) -> F {
        self.of_kernel(value, x, y, || "kernel".to_owned())
    }

    /// A value of a function of one point, watched.
    #[inline]
    pub(super) fn watched(&self, which: Which<'_>, value: F, x: &[F]) -> F {
        finite(&self.watch, value, || {
            let name = match which {
                Which::Source => "source",
                Which::Solution => "solution",
                Which::Weight(_) => "weight",
            };
            format!("`{name}` is {value} at x = {}", point(x))
        })
    }

    /// What was not finite, if something was.
    pub(super) fn check(&self) -> Result<(), Error> {
        match self.watch.get() {
            Some(what) => Err(Error::NotFinite { what: what.clone() }),
            None => Ok(()),
        }
    }

    /// The error, or what was not finite if that caused it.
    fn explain(&self, error: Error) -> Error {
        let caused = matches!(
            error,
            Error::Cube(CubeError::Kernel { .. } | CubeError::Source { .. })
                | Error::Run(
                    fredholm_rayon::RunError::NotFinite { .. }
                        | fredholm_rayon::RunError::Replicate { .. }
                )
                | Error::Variance(_)
                | Error::NotFinite { .. }
        );
        match self.watch.get() {
            Some(what) if caused => Error::NotFinite { what: what.clone() },
            _ => error,
        }
    }
}

/// The equation of a cube's functions.
pub(super) type ModelCube<'a, F, const D: usize, const B: usize = 1> =
    Cube<F, D, WatchedKernel<'a, F>, WatchedFunction<'a, F>, B>;

/// The kernel of a cube.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedKernel<'a, F>(&'a Watched<'a, F>);

impl<F: Real, const D: usize> KernelFn<F, D> for WatchedKernel<'_, F> {
    #[inline]
    fn kernel(&self, x: &[F; D], y: &[F; D]) -> F {
        if self.0.product {
            let factor = |a: usize| self.factor(a, x[a], y[a]);
            return (0..D).map(factor).fold(F::one(), |k, factor| k * factor);
        }
        let [x, y] = [x, y].map(|t| self.0.domain.point(t));
        let value = self.0.values.kernel(&x, &y);
        let value = self.0.watched_kernel(value, &x, &y);
        self.0.domain.times_volume(value)
    }
}

impl<F: Real> KernelFactors<F> for WatchedKernel<'_, F> {
    #[inline]
    fn factor(&self, axis: usize, x: F, y: F) -> F {
        let [x, y] = [x, y].map(|t| self.0.domain.coordinate(axis, t));
        let value = self.0.values.factor(axis, x, y);
        let value = self
            .0
            .of_kernel(value, &[x], &[y], || format!("kernel_factors[{axis}]"));
        self.0.domain.times_length(axis, value)
    }
}

impl<F: Real, const D: usize> KernelIntegral<F, D> for WatchedKernel<'_, F> {
    #[inline]
    fn integral(&self, x: &[F; D], low: &[F; D], high: &[F; D]) -> F {
        let axes = x.iter().zip(low.iter().zip(high)).enumerate();
        axes.fold(F::one(), |product, (axis, (&x, (&low, &high)))| {
            let [x, low, high] = [x, low, high].map(|t| self.0.domain.coordinate(axis, t));
            let at = |y: F| {
                let value = self.0.values.integral(axis, x, y);
                finite(&self.0.watch, value, || {
                    format!("`kernel_integral` is {value} at x = {x}, y = {y}")
                })
            };
            product * (at(high) - at(low))
        })
    }
}

/// A function of one point.
#[derive(Clone, Copy, Debug)]
pub(super) enum Which<'a> {
    Source,
    Solution,
    Weight(WeightOf<'a>),
}

/// A weight that is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum WeightOf<'a> {
    /// The equation's own, by its number.
    Own(usize),
    /// One of whoever asks.
    Given(&'a WeightFn),
}

impl<'a> WeightOf<'a> {
    /// The weight of a region, if it is that of one.
    pub(super) const fn region(region: &'a Region) -> Option<Self> {
        match region {
            Region::Weight(number) => Some(Self::Own(*number)),
            Region::Function(weight) => Some(Self::Given(weight)),
            _ => None,
        }
    }
}

/// A function of a cube.
#[derive(Clone, Copy, Debug)]
pub(super) struct WatchedFunction<'a, F> {
    functions: &'a Watched<'a, F>,
    which: Which<'a>,
}

impl<F: Real, const D: usize> ScalarField<F, D> for WatchedFunction<'_, F> {
    #[inline]
    fn value(&self, x: &[F; D]) -> F {
        let (values, domain) = (self.functions.values, &self.functions.domain);
        let x = &domain.point(x);
        let value = match self.which {
            Which::Source => values.source(x),
            Which::Solution => values.solution(x),
            Which::Weight(WeightOf::Own(number)) => domain.times_volume(values.weight(number, x)),
            Which::Weight(WeightOf::Given(weight)) => {
                let value = in_double(x, |x| weight.value(x));
                domain.times_volume(F::from_f64(value))
            }
        };
        self.functions.watched(self.which, value, x)
    }
}
