//! A quantity on every face of a scene, with an error bar each.

use web_time::Instant;

use fredholm_core::{Equation as _, LastStep};
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
    /// Half the width of a band that holds the values of all faces at once with probability 95 %, at every face; NaN of fewer than 32 walks a face.
    /// Few walks may have missed what a face sees, so that no variance counts as less than that of a face in the mean.
    pub bands: Vec<f64>,
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

/// The share of the walks before by which there are more at least.
const LEAST: f64 = 0.25;

/// The fewest walks of a face that tell an error to rely on: first ones where one is asked for, and those of a band.
const FIRST: u64 = 32;

/// The probability of the band.
const LEVEL: f64 = 0.95;

/// A face as walks go on.
#[derive(Clone, Copy, Debug)]
struct Face {
    /// What was found so far.
    found: Spot,
    walks: u64,
}

impl Face {
    /// The sum of squared deviations of scores; 0 where nothing scored.
    fn squares(&self) -> f64 {
        let walks = self.walks as f64;
        let square = self.found.error * self.found.error;
        if square > 0.0 {
            square * walks * (walks - 1.0)
        } else {
            0.0
        }
    }

    /// Adds further walks.
    fn add(&mut self, other: &Self) {
        let [own, more] = [self.walks, other.walks].map(|walks| walks as f64);
        let (all, apart) = (own + more, other.found.value - self.found.value);
        let squares = self.squares() + other.squares() + own * more / all * apart * apart;
        // Where nothing has scored yet no error is known.
        let has_scored = !(self.found.error.is_nan() && other.found.error.is_nan());
        *self = Self {
            found: Spot {
                value: self.found.value + more / all * apart,
                error: if has_scored {
                    (squares / (all * (all - 1.0))).sqrt()
                } else {
                    f64::NAN
                },
            },
            walks: self.walks + other.walks,
        };
    }

    /// The number of further walks that an error takes, and some more. Few walks may have missed what a face sees: no variance counts as less
    /// than that of a face in the mean.
    fn further(&self, mean: f64, bound: f64) -> u64 {
        let walks = self.walks as f64;
        let own = self.squares() / (walks - 1.0);
        let needed = if own > mean { own } else { mean } / (bound * bound);
        // NaN where all is dark.
        if !(needed > walks) {
            return 0;
        }
        let further = (MORE * needed - walks).max(LEAST * walks);
        (further.ceil() as u64).min(MOST_WALKS.saturating_sub(self.walks))
    }
}

/// The variance of a walk in the mean over all faces from which there are some.
fn mean_variance(all: &[Face]) -> f64 {
    let freedom: u64 = all.iter().map(|own| own.walks.saturating_sub(1)).sum();
    all.iter().map(Face::squares).sum::<f64>() / freedom.max(1) as f64
}

impl SceneModel {
    /// Estimates the mean of a quantity over every face. Where an error is asked for, first walks tell how many more each face takes, and walks
    /// go on until it is reached.
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
        if matches!(
            request.quantity,
            GlobalQuantity::Temperature | GlobalQuantity::Transmission
        ) {
            return refuse(
                "values of all faces are radiosities, irradiances or net fluxes: ask for other quantities at targets",
            );
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
                let own = self.element(number as u32);
                let material = faces[number].material();
                let knows_sunlight = own.is_some_and(|own| own.knows_sunlight());
                // Plain walks for u may end where they start.
                let is_through = !request.is_plain && !knows_sunlight;
                let through = (material.reflectance > 0.0 && is_through).then_some(material);
                let asked = Asked::new(request.quantity, Some(material), through);
                let asked = match request.quantity {
                    GlobalQuantity::Irradiance => asked,
                    // What leaves a mirror diffusely.
                    _ => asked.times(1.0 - self.scene.specular(number)),
                };
                Asked {
                    sunlight: own.map_or(0.0, |own| own.sunlight(request.quantity)),
                    ..asked
                }
            };
            let is_u = request.quantity == GlobalQuantity::U;
            // The value of a face of which nothing is left to walks.
            let known = |number: usize| {
                let (material, asked) = (faces[number].material(), asked(number));
                let is_dark = asked.is_arriving && !others && self.is_dark(&[number as u32]);
                let share = 1.0 - self.scene.specular(number);
                let own = self.element(number as u32);
                let knows_sunlight = own.is_some_and(|own| own.knows_sunlight());
                let is_certain = material.reflectance == 0.0 && !knows_sunlight;
                match is_u {
                    true => is_certain.then_some(share * material.emission),
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
            let first = tolerance.map_or(request.walk.walks, |_| request.walk.walks.max(FIRST));
            let known: Vec<Option<f64>> = (0..faces.len()).map(known).collect();
            let mut open: Vec<usize> = (0..faces.len()).filter(|&i| known[i].is_none()).collect();
            let mut all: Vec<Face> = known.iter().map(|known| Face {
                found: Spot { value: known.unwrap_or(0.0), error: 0.0 },
                walks: 0,
            }).collect();
            let mut counts = vec![first; faces.len()];
            for (&number, found) in open.iter().zip(walked(&open, 0, &counts)?.0) {
                all[number] = Face { found, walks: first };
            }
            let largest = all.iter().map(|own| own.found.value.abs()).fold(0.0, f64::max);
            let bound = tolerance.map(|tolerance| tolerance.error_at(largest));
            let mean = mean_variance(&all);
            for round in 1.. {
                let Some(bound) = bound else { break };
                open.retain(|&number| {
                    counts[number] = all[number].further(mean, bound);
                    counts[number] > 0
                });
                if open.is_empty() {
                    break;
                }
                for (&number, found) in open.iter().zip(walked(&open, round, &counts)?.0) {
                    all[number].add(&Face { found, walks: counts[number] });
                }
            }
            let walks = all.iter().map(|own| own.walks).sum();
            let values = all.iter().map(|own| own.found).collect();
            let seen = all.iter().map(|own| own.walks).filter(|&walks| walks > 0);
            let fewest = seen.min().unwrap_or(first);
            let mean = mean_variance(&all);
            let factor = match fewest < FIRST {
                true => f64::NAN,
                false => simultaneous(LEVEL, faces.len(), Some((fewest - 1) as f64)),
            };
            let band = |own: &Face| match own.walks {
                0 => 0.0,
                walks => factor * (mean / walks as f64).sqrt().max(own.found.error),
            };
            let bands = all.iter().map(band).collect();
            let seconds = start.elapsed().as_secs_f64();
            Ok(FaceValues { values, bands, bound, walks, seconds })
        })
    }
}
