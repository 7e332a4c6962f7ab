//! A quantity on every face of a scene, with an error bar each.

use web_time::Instant;

use fredholm_core::{Equation as _, LastStep, Tolerance};
use fredholm_model::heat::Asked;
use fredholm_model::{
    Discretisation, Error, GlobalQuantity, Partitioned, Spot, SpotWalks, Subject, WalkOptions,
    in_scalar, spots,
};
use fredholm_rayon::Observer;
use fredholm_scene::{Mean, areas};

use crate::SceneModel;
use crate::partition::ScenePartition;
use crate::places::Origin;

/// Which quantity of all faces is wanted, and how.
///
/// ```
/// use fredholm::scene::{Enclosure, FacesRequest, Material, NamedSurface, shapes};
/// use fredholm::{GlobalQuantity, Scalar, SceneModel, Settings};
///
/// // In a black cube whose sides emit 1 the irradiance is 1, of which no u tells.
/// let polygons = shapes::room([0.0; 3], [1.0; 3]).surfaces.concat();
/// let material = Material { reflectance: 0.0, emission: 1.0 };
/// let walls = NamedSurface { name: "walls".to_owned(), polygons, material };
/// let cube = SceneModel::new(vec![walls], Enclosure::Closed, Scalar::F64)?;
/// let settings = Settings { walks: Some(256), ..Settings::default() };
/// let request = FacesRequest {
///     quantity: GlobalQuantity::Irradiance,
///     walk: &settings.walk_options(),
///     is_plain: true,
/// };
/// let found = cube.on_faces(&settings.discretisation(), &request, &())?;
/// assert_eq!(found.values.len(), 6);
/// assert!(found.values.iter().all(|own| (own.value - 1.0).abs() <= 5.0 * own.error + 1e-12));
/// # Ok::<(), fredholm::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FacesRequest<'a> {
    /// The quantity.
    pub quantity: GlobalQuantity,
    /// How walks are made: `walks` of them for a face; with a tolerance that is the number of the first ones, which tell how many each face
    /// takes.
    pub walk: &'a WalkOptions,
    /// Whether walks follow no neighbour equation.
    pub is_plain: bool,
}

/// A quantity on every face.
#[derive(Clone, Debug)]
pub struct FaceValues {
    /// The mean over each face, in the order of the scene's, with its standard error.
    pub values: Vec<Spot>,
    /// The number of all walks.
    pub walks: u64,
    /// Seconds that it took, set-up included.
    pub seconds: f64,
}

/// The most walks of a face where an error is asked for.
const MOST_WALKS: u64 = 1 << 24;

/// How many times as many walks are made as first ones told: their own error would leave half of all faces above what is asked for.
const MORE: f64 = 1.2;

impl SceneModel {
    /// Estimates the mean of a quantity over every face, without bias. Where an error is asked for, first walks tell how many each face takes,
    /// and others are made: their number depends on nothing that they score.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Option`]: of several channels, and of net fluxes where there are no temperatures.
    pub fn on_faces(
        &self,
        discretisation: &Discretisation,
        request: &FacesRequest<'_>,
        watch: &dyn Observer,
    ) -> Result<FaceValues, Error> {
        let refuse = |message: &str| {
            Err(Error::Option {
                subject: Subject::Problem,
                message: message.to_owned(),
            })
        };
        if self.colours().is_some() {
            return refuse("values of all faces are those of one channel: leave `channels` out");
        }
        if request.quantity == GlobalQuantity::Transmission {
            return refuse("a transmission is one of surfaces: ask for irradiances");
        }
        if request.quantity == GlobalQuantity::NetFlux && self.heat().is_none() {
            return refuse("a net flux is one of heat, and this is light: ask for irradiances");
        }
        let start = Instant::now();
        let partition = ScenePartition::new(self, discretisation)?;
        partition.check_variance(request.walk)?;
        let system = (!request.is_plain)
            .then(|| partition.system())
            .transpose()?;
        let cut = &partition.0;
        let (faces, others) = (
            self.scene.faces(),
            self.scene.sky().is_some() || !self.scene.beams().is_empty(),
        );
        in_scalar!(discretisation.scalar, F => {
            let tables = cut.tables::<F>()?;
            let radiosity = tables.radiosity()?;
            let equation = LastStep(&radiosity);
            let vectors = system.as_ref().map(|system| system.solution.for_walks::<F>());
            let vectors = vectors.transpose()?;
            let neighbour = cut.neighbour(vectors.as_ref(), &equation)?;
            let v = vectors.as_ref().map(|vectors| (&*neighbour, vectors.v()));
            let walker = SpotWalks {
                equation: &equation,
                neighbour: &*neighbour,
                walk: request.walk,
                weights: &[],
                is_plain: request.is_plain,
                watch,
            };
            let geometry = equation.0.geometry();
            debug_assert_eq!(equation.channels(), 1);
            let walked = |first: u64, walks: &(dyn Fn(usize) -> u64 + Sync)| {
                spots(faces.len(), 1, &|number, to| {
                    let (material, own) = (faces[number].material(), [number as u32]);
                    // Plain walks for u may end where they start.
                    let through = Some(material);
                    let through = through.filter(|own| own.reflectance > 0.0 && !request.is_plain);
                    let asked = Asked::new(request.quantity, Some(material), through);
                    let is_u = request.quantity == GlobalQuantity::U;
                    let is_dark = asked.is_arriving && !others && self.is_dark(&own);
                    // Nothing is left to walks.
                    if asked.factor == 0.0 || is_dark || (is_u && material.reflectance == 0.0) {
                        let value = if is_u { material.emission } else { asked.constant };
                        to.fill(Spot { value, error: 0.0 });
                        return Ok(());
                    }
                    let ends = areas(geometry, &own)?;
                    let mean = Origin::Mean(Mean::new(geometry, &own, &ends)?);
                    let goal = cut.goal(&equation, v, (&mean, &own), &asked);
                    let walks = walks(number);
                    walker.walk(&goal, first + number as u64, walks, to)?;
                    watch.walked(walks);
                    Ok(())
                })
            };
            let count = request.walk.walks;
            let (mut values, _) = walked(0, &|_| count)?;
            let mut walks = count.saturating_mul(faces.len() as u64);
            if let Some(tolerance) = request.walk.tolerance {
                let largest = values.iter().map(|own| own.value.abs()).fold(0.0, f64::max);
                let bound = match tolerance {
                    Tolerance::Absolute(bound) => bound,
                    Tolerance::Relative(share) => share * largest,
                };
                // Few walks may have missed what a face sees: none has fewer than a face in the mean, nor does one where nothing scored.
                let known = || values.iter().map(|own| own.error).filter(|error| !error.is_nan());
                let square = known().map(|error| error * error).sum::<f64>() / known().count().max(1) as f64;
                let needed: Vec<u64> = values.iter().map(|own| {
                    let of_own = own.error * own.error;
                    let times = if of_own > square { of_own } else { square } / (bound * bound);
                    ((count as f64 * times * MORE).ceil() as u64).clamp(count, MOST_WALKS)
                }).collect();
                values = walked(faces.len() as u64, &|number| needed[number])?.0;
                walks += needed.iter().sum::<u64>();
            }
            Ok(FaceValues { values, walks, seconds: start.elapsed().as_secs_f64() })
        })
    }
}
