//! A quantity on every face of a scene, with an error bar each.

use web_time::Instant;

use fredholm_core::{Equation as _, LastStep, Tolerance};
use fredholm_model::heat::Asked;
use fredholm_model::numbers::simultaneous;
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
    /// How walks are made: `walks` of them for a face; with a tolerance that is the number of the first ones, which tell how many others each
    /// face takes.
    pub walk: &'a WalkOptions,
    /// Whether walks follow no neighbour equation.
    pub is_plain: bool,
}

/// A quantity on every face.
#[derive(Clone, Debug)]
pub struct FaceValues {
    /// The mean over each face, in the order of the scene's, with its standard error.
    pub values: Vec<Spot>,
    /// Half the width of a band that holds the values of all faces at once with probability 95 %, in standard errors; NaN of fewer than 32 walks.
    pub band_factor: f64,
    /// What was asked for: the largest standard error that a face may have. `None` without a tolerance.
    pub bound: Option<f64>,
    /// The number of all walks.
    pub walks: u64,
    /// Seconds that it took, set-up included.
    pub seconds: f64,
}

/// The most walks of a face where an error is asked for.
const MOST_WALKS: u64 = 1 << 24;

/// How many times as many walks are made as those before told: their own error would leave half of all faces above what is asked for.
const MORE: f64 = 1.2;

/// The fewest walks of a face that tell an error to rely on: first ones where one is asked for, and those of a band.
const FIRST: u64 = 32;

/// The probability of the band.
const LEVEL: f64 = 0.95;

/// The square of an error; 0 of NaN, where nothing scored.
fn square_of(error: f64) -> f64 {
    if error > 0.0 { error * error } else { 0.0 }
}

/// What the variances of walks from all faces say together of one more walk.
///
/// A face from which hardly a walk has found the sun may have an error that its own walks do not tell. So a variance is that of its walks
/// and of one more that scored as far off as scores of two values would lie apart, whose standard deviation is that of all faces in the root mean
/// square: n walks of variance s² leave the error √(s²/n + D²/n²), but for terms of order n⁻³.
#[derive(Clone, Copy, Debug)]
struct OneMore {
    /// D².
    square: f64,
}

impl OneMore {
    fn new(values: &[Spot], walks: u64) -> Self {
        let sum: f64 = values.iter().map(|own| square_of(own.error)).sum();
        let square = 4.0 * walks as f64 * sum / values.len().max(1) as f64;
        Self { square }
    }

    /// The standard error of so many walks whose own one is `error`; NaN where no walk from any face tells one.
    fn error(self, error: f64, walks: u64) -> f64 {
        if self.square == 0.0 {
            return error;
        }
        (square_of(error) + self.square / (walks as f64).powi(2)).sqrt()
    }

    /// The number of walks that leave the error `bound`, and some more, if so many left `error`.
    fn walks(self, error: f64, walks: u64, bound: f64) -> u64 {
        let own = walks as f64 * square_of(error);
        let square = bound * bound;
        let root = (own * own + 4.0 * square * self.square).sqrt();
        (MORE * (own + root) / (2.0 * square)).ceil() as u64
    }
}

impl SceneModel {
    /// Estimates the mean of a quantity over every face. Where an error is asked for, first walks tell how many others each face takes; a face
    /// whose own error is above it then has others again, of which there are more.
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
            let asked = |number: usize| {
                let material = faces[number].material();
                // Plain walks for u may end where they start.
                let through = (material.reflectance > 0.0 && !request.is_plain).then_some(material);
                Asked::new(request.quantity, Some(material), through)
            };
            let is_u = request.quantity == GlobalQuantity::U;
            // The value of a face of which nothing is left to walks.
            let known = |number: usize| {
                let (material, asked) = (faces[number].material(), asked(number));
                let is_dark = asked.is_arriving && !others && self.is_dark(&[number as u32]);
                match is_u {
                    true => (material.reflectance == 0.0).then_some(material.emission),
                    false => (asked.factor == 0.0 || is_dark).then_some(asked.constant),
                }
            };
            // The values of these faces, of so many walks each, from numbers of walks of their own.
            let walked = |open: &[usize], round: usize, counts: &[u64]| {
                spots(open.len(), 1, &|place, to| {
                    let number = open[place];
                    let own = [number as u32];
                    let ends = areas(geometry, &own)?;
                    let mean = Origin::Mean(Mean::new(geometry, &own, &ends)?);
                    let goal = cut.goal(&equation, v, (&mean, &own), &asked(number));
                    let seed = (round * faces.len() + number) as u64;
                    walker.walk(&goal, seed, counts[number], to)?;
                    watch.walked(counts[number]);
                    Ok(())
                })
            };
            let tolerance = request.walk.tolerance;
            let count = tolerance.map_or(request.walk.walks, |_| request.walk.walks.max(FIRST));
            let mut counts = vec![count; faces.len()];
            let known: Vec<Option<f64>> = (0..faces.len()).map(known).collect();
            let mut open: Vec<usize> = (0..faces.len()).filter(|&i| known[i].is_none()).collect();
            let mut values: Vec<Spot> = known.iter().map(|known| Spot { value: known.unwrap_or(0.0), error: 0.0 }).collect();
            let put = |values: &mut [Spot], open: &[usize], found: Vec<Spot>| {
                open.iter().zip(found).for_each(|(&number, own)| values[number] = own);
            };
            let first = walked(&open, 0, &counts)?.0;
            let more = OneMore::new(&first, count);
            put(&mut values, &open, first);
            let mut walks = count.saturating_mul(open.len() as u64);
            let largest = values.iter().map(|own| own.value.abs()).fold(0.0, f64::max);
            let bound = tolerance.map(|tolerance| match tolerance {
                Tolerance::Absolute(bound) => bound,
                Tolerance::Relative(share) => share * largest,
            });
            for round in 1.. {
                let Some(bound) = bound else { break };
                open.retain(|&number| {
                    let (error, done) = (values[number].error, counts[number]);
                    more.error(error, done) > bound && done < MOST_WALKS
                });
                if open.is_empty() {
                    break;
                }
                for &number in &open {
                    let needed = more.walks(values[number].error, counts[number], bound);
                    counts[number] = needed.clamp(counts[number], MOST_WALKS);
                    walks = walks.saturating_add(counts[number]);
                }
                let found = walked(&open, round, &counts)?.0;
                put(&mut values, &open, found);
            }
            let of_walks = values.iter_mut().zip(&counts).zip(&known);
            for ((own, &walks), _) in of_walks.filter(|(_, known)| known.is_none()) {
                own.error = more.error(own.error, walks);
            }
            let fewest = counts.iter().copied().min().unwrap_or(count);
            let band_factor = match fewest < FIRST {
                true => f64::NAN,
                false => simultaneous(LEVEL, faces.len(), Some((fewest - 1) as f64)),
            };
            let seconds = start.elapsed().as_secs_f64();
            Ok(FaceValues { values, band_factor, bound, walks, seconds })
        })
    }
}
