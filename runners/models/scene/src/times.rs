//! What a scene receives under the suns and skies of many times, from one set of walks.
//!
//! u is linear in F, and walks know nothing of F: where they go is the same under every sun. Every state asks for each time whether it sees
//! the sun of that time, and a walk that ends in the sky brings what the sky has there times the factor of each time.

use web_time::Instant;

use fredholm_core::{
    At, Chain as _, Equation as _, Functional as _, Generators as _, LastStep, Real, RngUniforms,
    STEP_LIMIT, Sequence, SobolPoint, Start, Uniforms, WalkNumber, WalkSeeds,
};
use fredholm_model::heat::Asked;
use fredholm_model::{
    Discretisation, Error, GlobalQuantity, Goal, Model as _, Spot, Subject, WalkOptions, in_scalar,
    picture_is_biased,
};
use fredholm_rayon::{Observer, fill_rows};
use fredholm_scene::{Beam, Irradiance, Material, Point, Radiosity, SceneError, Sources};

use crate::partition::{ScenePartition, Walked};
use crate::places::{Origin, Place};
use crate::{Light, SceneModel};

/// The sun and the sky at one time.
///
/// ```
/// use fredholm::scene::SunAndSky;
///
/// // At 30° in the south, and a sky that is half as bright as that of the scene.
/// let noon = SunAndSky { towards: [0.0, -0.866, 0.5], irradiance: 800.0, sky: 0.5 };
/// assert!(noon.irradiance > 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunAndSky {
    /// The direction towards the sun, of any length above 0.
    pub towards: [f64; 3],
    /// The irradiance of a surface that faces the sun, in the unit of u; 0: there is no sun.
    pub irradiance: f64,
    /// What the sky of the scene gives is multiplied by this.
    pub sky: f64,
}

/// What is wanted of many times.
///
/// ```
/// use fredholm::scene::{Enclosure, Material, NamedSurface, SunAndSky, TimesRequest, shapes};
/// use fredholm::{GlobalQuantity, Goal, Region, Scalar, SceneModel, Settings};
///
/// // A ground that nothing hides, under a sun of 800 at 30°, and at 90°.
/// let polygons = shapes::room([0.0; 3], [1.0; 3]).surfaces.swap_remove(0);
/// let material = Material { reflectance: 0.25, emission: 0.0 };
/// let ground = NamedSurface { name: "ground".to_owned(), polygons, material };
/// let scene = SceneModel::new(vec![ground], Enclosure::Open, Scalar::F64)?;
/// let sun = |towards| SunAndSky { towards, irradiance: 800.0, sky: 0.0 };
/// let settings = Settings::default();
/// let request = TimesRequest {
///     goals: &[Goal::new("lux", GlobalQuantity::Irradiance.of(Region::Whole)), Goal::new("u", Region::Whole)],
///     times: &[sun([0.75_f64.sqrt(), 0.0, 0.5]), sun([0.0, 0.0, 2.0])],
///     walk: &settings.walk_options(),
/// };
/// let found = scene.at_times(&settings.discretisation(), &request, &())?;
/// let [lux, u] = [&found.goals[0].values, &found.goals[1].values];
/// assert!((lux[0].value - 400.0).abs() < 1e-9 && (lux[1].value - 800.0).abs() < 1e-9);
/// assert!((u[0].value - 100.0).abs() < 1e-9 && u[0].error < 1e-9);
/// # Ok::<(), fredholm::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct TimesRequest<'a> {
    /// The goals: of which quantity and where; see [`GlobalQuantity`].
    pub goals: &'a [Goal],
    /// The times.
    pub times: &'a [SunAndSky],
    /// How walks are made: `walks` of them for a goal; with a tolerance that is the number of the first ones, which tell how many each goal
    /// takes until no time has a larger error.
    pub walk: &'a WalkOptions,
}

/// What a goal has at all times.
#[derive(Clone, Debug)]
pub struct GoalAtTimes {
    /// The value at each time, with its standard error.
    pub values: Vec<Spot>,
    /// The mean over all times, with its standard error.
    pub mean: Spot,
    /// The number of walks.
    pub walks: u64,
}

/// What all goals have at all times.
#[derive(Clone, Debug)]
pub struct AtTimes {
    /// The values of each goal.
    pub goals: Vec<GoalAtTimes>,
    /// Seconds that it took.
    pub seconds: f64,
}

/// The independent samples that error bars come from; a power of 2, so that walks divide evenly.
const REPLICATES: u64 = 32;

/// The most walks of a goal where an error is asked for.
const MOST_WALKS: u64 = 1 << 24;

/// How many times as many walks are made as first ones told: their own error would leave half of all goals above what is asked for.
const MORE: f64 = 1.2;

/// The suns that shine, and the factors of the sky.
struct Lit<F> {
    /// The number of the time, the direction as a unit vector, and the irradiance.
    suns: Vec<(usize, [F; 3], f64)>,
    skies: Vec<f64>,
}

impl<F: Real> Lit<F> {
    fn new(times: &[SunAndSky]) -> Result<Self, Error> {
        let wrong = |number: usize, what: &str| {
            Err(Error::Option {
                subject: Subject::Problem,
                message: format!("time {number}, counted from 0: {what}"),
            })
        };
        let is_good = |strength: f64| (0.0..f64::INFINITY).contains(&strength);
        let mut suns = Vec::new();
        for (number, own) in times.iter().enumerate() {
            if !is_good(own.irradiance) || !is_good(own.sky) {
                return wrong(number, "what the sun and the sky give must be 0 or more");
            }
            if own.irradiance == 0.0 {
                continue;
            }
            let length = own.towards.iter().map(|c| c * c).sum::<f64>().sqrt();
            if !(length > 0.0 && length.is_finite()) {
                return wrong(number, "the direction towards the sun has no length");
            }
            let towards = own.towards.map(|c| F::from_f64(c / length));
            suns.push((number, towards, own.irradiance));
        }
        Ok(Self {
            suns,
            skies: times.iter().map(|own| own.sky).collect(),
        })
    }

    /// Adds what the suns give where each has a cosine.
    fn add(&self, weight: f64, cosine: impl Fn([F; 3]) -> F, to: &mut [f64]) {
        for &(time, towards, irradiance) in &self.suns {
            to[time] += weight * irradiance * cosine(towards).to_f64();
        }
    }
}

/// The walks of a goal.
struct Walker<'w, 'r, F> {
    model: &'w SceneModel,
    equation: &'w Walked<'r, F, fredholm_scene::Grey>,
    origin: &'w Origin<'w, F>,
    quantity: GlobalQuantity,
    lit: &'w Lit<F>,
    seeds: WalkSeeds,
}

impl<F: Real> Walker<'_, '_, F> {
    /// What is asked for at a point: a number times the irradiance, and another number.
    fn terms(&self, x: &Point<F>) -> Asked {
        let faces = self.model.scene.faces();
        let own = faces.get(x.face as usize);
        let material = own.map_or(Material::BLACK, |own| own.material());
        match self.quantity {
            GlobalQuantity::U => Asked {
                is_arriving: true,
                factor: material.reflectance,
                constant: material.emission,
                ..Asked::U
            },
            GlobalQuantity::NetFlux => {
                let share = 1.0 - self.model.scene.specular(x.face as usize);
                Asked::new(GlobalQuantity::NetFlux, Some(material), None).times(share)
            }
            quantity => Asked::new(quantity, Some(material), None),
        }
    }

    /// What suns give directly to where all walks start.
    fn direct(&self, to: &mut [f64]) {
        let radiosity = self.equation.0;
        match self.origin {
            Origin::Point(At(x)) => {
                let factor = self.terms(x).factor;
                self.lit.add(factor, |sun| radiosity.of_sun(x, sun), to);
            }
            Origin::Facing(facing) => self.lit.add(1.0, |sun| facing.of_sun(radiosity, sun), to),
            _ => {}
        }
    }

    /// Adds the mean over the walks of a replicate.
    fn replicate(&self, replicate: u64, walks: u64, to: &mut [f64]) -> Result<(), Error> {
        let mut memory = SobolPoint::default();
        let (mut constant, mut sky) = (0.0, 0.0);
        for index in 0..walks {
            let number = WalkNumber {
                walk: replicate * walks + index,
                replicate,
                index,
            };
            let mut draws =
                RngUniforms(Sequence::Sobol.generator(&self.seeds, number, &mut memory));
            let [own, of_sky] = self.walk(&mut draws, to)?;
            constant += own;
            sky += of_sky;
        }
        let per_walk = 1.0 / walks as f64;
        for (to, factor) in to.iter_mut().zip(&self.lit.skies) {
            *to = (*to + constant + sky * factor) * per_walk;
        }
        Ok(())
    }

    /// What a walk brings from lights that are the same at all times, and from the sky; adds what it brings from each sun.
    fn walk<U: Uniforms<F>>(&self, draws: &mut U, to: &mut [f64]) -> Result<[f64; 2], Error> {
        let (equation, radiosity) = (self.equation, self.equation.0);
        let (mut constant, mut sky) = (0.0, 0.0);
        let (start, weight) = match self.origin {
            Origin::Point(_) | Origin::Mean(_) => {
                let x = self.origin.start(equation, draws).point;
                let terms = self.terms(&x);
                constant += terms.constant;
                if matches!(self.origin, Origin::Mean(_)) {
                    self.lit
                        .add(terms.factor, |sun| radiosity.of_sun(&x, sun), to);
                }
                (Irradiance(At(x)).start(equation, draws), terms.factor)
            }
            other => (other.start(equation, draws), 1.0),
        };
        let Start {
            point: mut x,
            phi,
            known,
        } = start;
        constant += weight * known.to_f64();
        // A walk of the weight 0 meets nothing.
        let weight = weight * phi.to_f64();
        for _ in 0..STEP_LIMIT {
            if weight == 0.0 {
                return Ok([constant, sky]);
            }
            let source = equation.source(&x, draws).to_f64();
            let face = self.model.scene.faces().get(x.face as usize);
            let Some(face) = face else {
                sky += weight * source;
                return Ok([constant, sky]);
            };
            constant += weight * source;
            let reflectance = face.reflectance;
            if reflectance > 0.0 {
                self.lit
                    .add(weight * reflectance, |sun| radiosity.of_sun(&x, sun), to);
            }
            // Of those that go on all have the same weight.
            if draws.uniform().to_f64() >= reflectance {
                return Ok([constant, sky]);
            }
            match equation.step(&x, draws) {
                Some(y) => x = y,
                None => return Ok([constant, sky]),
            }
        }
        Err(picture_is_biased())
    }
}

/// The mean of independent samples, and its standard error.
fn mean(samples: impl Iterator<Item = f64> + Clone) -> Spot {
    let count = REPLICATES as f64;
    let value = samples.clone().sum::<f64>() / count;
    let square: f64 = samples.map(|own| (own - value).powi(2)).sum();
    Spot {
        value,
        error: (square / (count * (count - 1.0))).sqrt(),
    }
}

impl SceneModel {
    /// Estimates goals under the suns and skies of many times, without bias, from one set of walks for each goal: numbers of a Sobol' sequence,
    /// in 32 independent replicates.
    ///
    /// Lamps of the scene shine at all times. With a tolerance first walks tell how many each goal takes, and others are made: their
    /// number depends on nothing that they score.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Option`]: of several channels; the scene has a sun of its own; a strength is negative or not finite.
    pub fn at_times(
        &self,
        discretisation: &Discretisation,
        request: &TimesRequest<'_>,
        watch: &dyn Observer,
    ) -> Result<AtTimes, Error> {
        let refuse = |message: &str| {
            Err(Error::Option {
                subject: Subject::Problem,
                message: message.to_owned(),
            })
        };
        if self.colours().is_some() {
            return refuse("values at many times are those of one channel: leave `channels` out");
        }
        if self.scene.has_sunlight() {
            return refuse("values at many times are of light alone: leave `absorptance` out");
        }
        if matches!(self.light, Light::Gas(_)) {
            return refuse("suns and skies are of light, and a vacuum has molecules alone");
        }
        let is_sun = |beam: &Beam<f64>| matches!(beam, Beam::Parallel { .. });
        if self.scene.beams().iter().any(is_sun) {
            return refuse(
                "the times say where the sun is, and the scene has one of its own: leave its `towards` out",
            );
        }
        let has_sun = |time: &SunAndSky| time.irradiance != 0.0;
        if self.scene.has_mirrors() && request.times.iter().any(has_sun) {
            return Err(SceneError::MirroredBeam.into());
        }
        if request.times.is_empty() {
            return refuse("there is no time");
        }
        let is_temperature = |goal: &Goal| goal.region.asked().0 == GlobalQuantity::Temperature;
        if request.goals.iter().any(is_temperature) {
            return refuse(
                "values at many times are linear in the sources, and temperatures are not: leave `ask` out",
            );
        }
        self.check_goals(request.goals)?;
        let start = Instant::now();
        let partition = ScenePartition::new(self, discretisation)?;
        let cut = &partition.0;
        let goals = in_scalar!(discretisation.scalar, F => {
            let tables = cut.tables::<F>()?;
            let radiosity = tables.radiosity()?;
            self.each_at_times(&radiosity, request, watch)?
        });
        Ok(AtTimes {
            goals,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    fn each_at_times<F: Real>(
        &self,
        radiosity: &Radiosity<'_, F>,
        request: &TimesRequest<'_>,
        watch: &dyn Observer,
    ) -> Result<Vec<GoalAtTimes>, Error> {
        let (equation, count) = (LastStep(radiosity), request.goals.len() as u64);
        let lit = Lit::<F>::new(request.times)?;
        let times = request.times.len();
        let sources: Option<&Sources<F>> = None;
        let goal = |(number, goal): (u64, &Goal)| {
            let place = Place::new(&self.scene, &goal.region)?;
            let ends = place.ends(radiosity.geometry())?;
            let origin = place.origin(radiosity, &ends, sources)?;
            let mut walker = Walker {
                model: self,
                equation: &equation,
                origin: &origin,
                quantity: goal.region.asked().0,
                lit: &lit,
                seeds: WalkSeeds::new(request.walk.seed, number),
            };
            let first = request.walk.walks.div_ceil(REPLICATES);
            let mut found = walker.all(times, first, watch)?;
            if let Some(tolerance) = request.walk.tolerance {
                let largest =
                    |of: &dyn Fn(&Spot) -> f64| found.values.iter().map(of).fold(0.0, f64::max);
                let bound = tolerance.error_at(largest(&|own| own.value.abs()));
                let times_more = MORE * (largest(&|own| own.error) / bound).powi(2);
                let needed = (found.walks as f64 * times_more).min(MOST_WALKS as f64) as u64;
                if bound > 0.0 && needed > found.walks {
                    walker.seeds = WalkSeeds::new(request.walk.seed, count + number);
                    let needed = needed.div_ceil(REPLICATES).next_power_of_two();
                    found = walker.all(times, needed, watch)?;
                }
            }
            Ok(found)
        };
        (0..).zip(request.goals).map(goal).collect()
    }
}

impl<F: Real> Walker<'_, '_, F> {
    /// The values of all replicates together, of so many walks each.
    fn all(&self, times: usize, walks: u64, watch: &dyn Observer) -> Result<GoalAtTimes, Error> {
        let mut samples = vec![0.0; REPLICATES as usize * times];
        fill_rows(&mut samples, times, |number, to| {
            if watch.cancelled() {
                return Err(Error::Cancelled);
            }
            to.fill(0.0);
            self.replicate(number as u64, walks, to)?;
            watch.walked(walks);
            Ok(())
        })?;
        let mut direct = vec![0.0; times];
        self.direct(&mut direct);
        let at = |time: usize| {
            let own = mean(samples.iter().skip(time).step_by(times).copied());
            let value = own.value + direct[time];
            Spot { value, ..own }
        };
        let per_time = 1.0 / times as f64;
        let rows = samples.chunks_exact(times);
        let of_all = mean(rows.map(|row| row.iter().sum::<f64>() * per_time));
        let value = of_all.value + direct.iter().sum::<f64>() * per_time;
        Ok(GoalAtTimes {
            values: (0..times).map(at).collect(),
            mean: Spot { value, ..of_all },
            walks: walks * REPLICATES,
        })
    }
}
