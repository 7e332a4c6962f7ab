//! The global estimate of u from one set of walks.

mod coefficients;
mod looks;
mod means;
mod summary;
mod walks;

use web_time::Instant;

use fredholm_core::global::over_replicates;
use fredholm_model::resolvent::{FoundField, ResolventAnswer};
use fredholm_model::{
    GLOBAL_REPLICATES as REPLICATES, GlobalField, GlobalQuantity, IMAGE_HEAD, MeshCell,
};
use serde::Serialize;

use crate::chosen::ChoiceReport;
use crate::point::Point;
use crate::{Error, Goal, Model, Region, Settings};
pub use coefficients::GlobalCoefficients;
pub(crate) use looks::{Look, Looks};
pub use summary::GlobalSummary;
pub(crate) use walks::{Bound, Ready, Until, Whole, best_absorption};

/// The probability with which a band holds at all points together.
const BAND_LEVEL: f64 = GlobalEstimate::BAND_LEVEL;

/// Points, about, at which error bars are looked at for the band and for a tolerance.
pub(crate) const PROBES: f64 = 256.0;

/// The part of a standard error that quadrature may be off.
const QUADRATURE_SHARE: f64 = 0.01;
/// The part of a functional's standard error that quadrature at points may be off before finer rules are tried for it: a bias of
/// that size takes 0.1 % from a coverage of 95 %.
const ROUGH: f64 = 0.1;

/// A value of a [`GlobalEstimate`]: of u at a point, or of a functional.
///
/// ```
/// use fredholm::{CubeModel, Solver};
///
/// let u = CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0]);
/// let value = Solver::new(&u).cells(4).walks(5000).whole()?.at(0.5)?;
/// assert_eq!(value.interval().map(|[low, high]| low <= value.estimate && value.estimate <= high), Some(true));
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GlobalValue {
    /// The estimate ũ = F + T_K v + T_K ê, unbiased but for what the summary tells.
    pub estimate: f64,
    /// The standard error over replicates, in the unit of u. `None`: no walk has scored.
    pub std_error: Option<f64>,
    /// Half of the width of the band that holds at all points of the space together, in the unit of u; of a functional there
    /// is none.
    pub band: Option<f64>,
    /// The deterministic part F + T_K v, often better than affordable walks and without any error bar.
    pub iterate: f64,
    /// How far the iterate of a mean moved with the last finer rule in x, and that of a point in the air with the highest
    /// degree; 0 at a point of the space.
    pub quadrature_error: f64,
}

impl GlobalValue {
    /// The ends of the band. `None`: the value is of a functional, or no walk has scored.
    #[must_use]
    pub fn interval(&self) -> Option<[f64; 2]> {
        let band = self.band?;
        Some([self.estimate - band, self.estimate + band])
    }
}

/// The global estimate of u with an error band, from one set of walks: [`Solver::whole`](crate::Solver::whole) makes one.
///
/// ũ = F + T_K v + T_K ê, where v is the Galerkin solution and ê what the walks estimate of e = u − v: `core::global` has
/// the mathematics, and the manual's page `global.md` says when it is right.
///
/// ```
/// use fredholm::circle::{Emission, Harmonic};
/// use fredholm::{CircleModel, Solver};
///
/// let light = Harmonic { constant: 5.0, amplitude: 1.0, frequency: 5 };
/// let u = CircleModel::new(vec![0.3, 0.7], Emission::Harmonic(light));
/// let whole = Solver::new(&u).cells(100).walks(100_000).whole()?;
/// // Any point, after the walks: u(s) = 5 + sin 5s.
/// for i in 0..100 {
///     let s = 0.06 * f64::from(i);
///     let u = whole.at(s)?;
///     assert!((u.estimate - light.solution(s)).abs() < u.band.unwrap() && u.band.unwrap() < 2e-3);
/// }
/// # Ok::<(), fredholm::SolveError>(())
/// ```
#[derive(Debug)]
pub struct GlobalEstimate<'m> {
    model: &'m dyn Model,
    field: Box<dyn GlobalField + 'm>,
    summary: GlobalSummary,
}

impl<'m> GlobalEstimate<'m> {
    /// The function that resolvent walks have found, and its values at the goals, of whose points the band is.
    pub(crate) fn of_resolvent(
        (model, settings): (&'m dyn Model, &Settings),
        goals: &[Goal],
        found: FoundField<'m>,
        answer: &ResolventAnswer,
    ) -> (Self, Vec<GlobalValue>) {
        let start = Instant::now();
        let mut summary = GlobalSummary::of_resolvent((model, settings), &found, answer);
        let FoundField { field, images, .. } = found;
        let rows = field.rows();
        let images = images.chunks_exact(IMAGE_HEAD + rows).zip(goals);
        let is_point = |goal: &Goal| model.is_in_space(&goal.region);
        let points = images.clone().filter(|(_, goal)| is_point(goal));
        let points = points.flat_map(|(image, _)| image.iter().copied());
        summary.look_at(&points.collect::<Vec<f64>>(), rows);
        summary.band_seconds += start.elapsed().as_secs_f64();
        let function = Self {
            model,
            field,
            summary,
        };
        let values = images.map(|(image, goal)| function.value(image, is_point(goal)));
        let values = values.collect();
        (function, values)
    }
}

impl GlobalEstimate<'_> {
    /// The probability with which a band holds at all points together.
    pub const BAND_LEVEL: f64 = 0.95;

    /// The function's summary.
    #[must_use]
    pub const fn summary(&self) -> &GlobalSummary {
        &self.summary
    }

    pub(crate) fn set_choice(&mut self, choice: Option<ChoiceReport>) {
        self.summary.choice = choice.map(Box::new);
    }

    pub(crate) fn model(&self) -> &dyn Model {
        self.model
    }

    /// u at a point: see [`Point`]. To ask for many points, [`values`](Self::values) is faster.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such point.
    pub fn at(&self, point: impl Into<Point>) -> Result<GlobalValue, Error> {
        self.functional(&Region::Point(point.into().0))
    }

    /// (u, Φ) for a region: the mean over the whole space ([`Model::whole`]) or over a part, an integral with a weight, a
    /// point.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region.
    pub fn functional(&self, region: &Region) -> Result<GlobalValue, Error> {
        self.one(GlobalQuantity::U, region)
    }

    /// A quantity of a region.
    fn one(&self, quantity: GlobalQuantity, region: &Region) -> Result<GlobalValue, Error> {
        let values = self.quantities(quantity, core::slice::from_ref(region))?;
        let value = values.first().copied();
        value.ok_or(Error::Internal("a region without a value"))
    }

    /// The values of several regions, on all threads.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region.
    pub fn values(&self, regions: &[Region]) -> Result<Vec<GlobalValue>, Error> {
        self.quantities(GlobalQuantity::U, regions)
    }

    /// The irradiance of a point of a wall, or of walls in the mean, in rooms.
    ///
    /// # Errors
    /// [`Error::Region`]: the space has no such region, or no light falls on it.
    pub fn irradiance(&self, region: &Region) -> Result<GlobalValue, Error> {
        self.heat(GlobalQuantity::Irradiance, region)
    }

    /// The net flux out of a wall at a point, in the unit of u, or out of walls, in that times a length, in rooms: what they
    /// emit minus what they absorb. Over all walls of a closed room it is 0 up to its error.
    ///
    /// ```
    /// use fredholm::room::{Material, Surfaces};
    /// use fredholm::{Region, RoomModel, Scalar, Solver};
    ///
    /// let floor = Material { reflectance: 0.5, emission: 1.0 };
    /// let walls = Material { reflectance: 0.5, emission: 0.0 };
    /// let square = Surfaces::default()
    ///     .with("floor", &[[0.0, 0.0], [1.0, 0.0]], floor)
    ///     .with("walls", &[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]], walls);
    /// let room = RoomModel::new(square, Scalar::F64)?;
    /// let whole = Solver::new(&room).cells(40).walks(20_000).whole()?;
    /// let (floor, all) = (whole.net_flux(&Region::Part(0))?, whole.net_flux(&Region::Whole)?);
    /// assert!(floor.estimate > 0.5);
    /// assert!(all.estimate.abs() < 5.0 * all.std_error.unwrap());
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    ///
    /// # Errors
    /// As [`irradiance`](Self::irradiance).
    pub fn net_flux(&self, region: &Region) -> Result<GlobalValue, Error> {
        self.heat(GlobalQuantity::NetFlux, region)
    }

    fn heat(&self, quantity: GlobalQuantity, region: &Region) -> Result<GlobalValue, Error> {
        let surfaces = self.model.exchange();
        if surfaces.is_none_or(|surfaces| surfaces.is_in_air(region)) {
            return Err(Error::Region {
                message: "irradiances and net fluxes are those of walls of a room".to_owned(),
            });
        }
        self.one(quantity, region)
    }

    /// A quantity of several regions, on all threads.
    pub(crate) fn quantities(
        &self,
        quantity: GlobalQuantity,
        regions: &[Region],
    ) -> Result<Vec<GlobalValue>, Error> {
        let goal = |region: &Region| Goal::new("u", region.clone());
        let goals: Vec<Goal> = regions.iter().map(goal).collect();
        self.model.check_goals(&goals)?;
        if regions.is_empty() {
            return Ok(Vec::new());
        }
        let images = self.field.images(quantity, regions)?;
        let width = IMAGE_HEAD + self.field.rows();
        let all = images.chunks_exact(width).zip(regions);
        let values = all.map(|(image, region)| {
            let has_band = quantity == GlobalQuantity::U && self.model.is_in_space(region);
            let value = self.value(image, has_band);
            if !has_band && self.is_rough(&value) {
                return self.refined(quantity, region, value);
            }
            Ok(value)
        });
        values.collect()
    }

    /// Whether the rule of T_K, which is as fine as error bars of points ask for, may be too rough for this functional: T_K
    /// lets little or nothing through to those of far smaller error bars, and what a rule is off does not cancel there.
    fn is_rough(&self, value: &GlobalValue) -> bool {
        let summary = &self.summary;
        let off = summary.quadrature_error.unwrap_or(0.0);
        let largest = summary.largest_std_error.unwrap_or(0.0);
        let may = |error| ROUGH * error < off || error < QUADRATURE_SHARE * largest;
        value.std_error.is_some_and(may)
    }

    /// A functional by finer rules of T_K until it moves by a small part of its error bar or by rounding, or none is taken.
    fn refined(
        &self,
        quantity: GlobalQuantity,
        region: &Region,
        mut value: GlobalValue,
    ) -> Result<GlobalValue, Error> {
        for more in (2..).step_by(2) {
            let Some(image) = self.field.finer(quantity, region, more)? else {
                break;
            };
            let finer = self.value(&image, false);
            let moved = (finer.estimate - value.estimate).abs();
            value = finer;
            let may = QUADRATURE_SHARE * value.std_error.unwrap_or(f64::INFINITY);
            if moved <= may.max(self.summary.rounding_floor) {
                break;
            }
        }
        Ok(value)
    }

    /// The cells over which it tells means, of a scene, whose function has no values at points; otherwise there are none.
    #[must_use]
    pub fn mesh(&self) -> &[MeshCell] {
        self.field.mesh()
    }

    /// The mean of u over every cell of the [`mesh`](Self::mesh). Bands hold on all of them together.
    ///
    /// ```
    /// use fredholm::scene::{Enclosure, Material, NamedSurface, shapes};
    /// use fredholm::{Scalar, SceneModel, Solver};
    ///
    /// // u = 1 in a furnace.
    /// let walls = NamedSurface {
    ///     name: "walls".to_owned(),
    ///     polygons: shapes::room([0.0; 3], [1.0; 3]).surfaces.concat(),
    ///     material: Material { reflectance: 0.5, emission: 0.5 },
    /// };
    /// let furnace = SceneModel::new(vec![walls], Enclosure::Closed, Scalar::F64)?;
    /// let whole = Solver::new(&furnace).cells(24).walks(5000).whole()?;
    /// for (cell, mean) in whole.mesh().iter().zip(whole.mesh_values()) {
    ///     assert_eq!(cell.corners.len(), 4);
    ///     assert!((mean.estimate - 1.0).abs() < 1e-5);
    /// }
    /// # Ok::<(), fredholm::SolveError>(())
    /// ```
    #[must_use]
    pub fn mesh_values(&self) -> Vec<GlobalValue> {
        let images = self.field.mesh_images();
        let all = images.chunks_exact(IMAGE_HEAD + self.field.rows());
        all.map(|image| self.value(image, true)).collect()
    }

    /// u at so many equally spaced points of the space, of a cube per axis, and where they are.
    ///
    /// # Errors
    /// [`Error`].
    pub fn grid(&self, points: usize) -> Result<Vec<(Region, GlobalValue)>, Error> {
        let regions = self.model.grid(points, None);
        let values = self.values(&regions)?;
        Ok(regions.into_iter().zip(values).collect())
    }

    fn value(&self, image: &[f64], has_band: bool) -> GlobalValue {
        let ([iterate, quadrature_error], replicates) = split(image, self.summary.replicates);
        let correction = over_replicates(replicates);
        let has_scored = self.summary.largest_std_error.is_some();
        // Resolvent walks may know u better than numbers do.
        let floor = self
            .summary
            .resolvent
            .map_or(0.0, |_| self.summary.rounding_floor);
        let std_error = has_scored.then_some(correction.std_error.max(floor));
        let factor = self.summary.band_factor.filter(|_| has_band);
        GlobalValue {
            estimate: iterate + correction.mean,
            std_error,
            band: factor.zip(std_error).map(|(factor, error)| factor * error),
            iterate,
            quadrature_error,
        }
    }
}

/// F + T_K v and its error by quadrature in x, and T_K ê of every replicate.
fn split(image: &[f64], replicates: usize) -> ([f64; IMAGE_HEAD], &[f64]) {
    match image.split_first_chunk() {
        Some((head, rest)) => (*head, rest.get(..replicates).unwrap_or_default()),
        None => ([f64::NAN; IMAGE_HEAD], &[]),
    }
}
