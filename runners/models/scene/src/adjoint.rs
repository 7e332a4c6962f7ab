//! The way back: walks from the sources of a scene to receivers.
//!
//! Light goes both ways, so that the radiosity s of the same scene in which receivers send out ρ φ, and nothing else does, tells
//! what the sources give them: see [`Sources`]. Receivers are channels of one scene, and one set of walks from the sources
//! serves all.

use std::sync::Arc;

use fredholm_core::channels::{ChannelGoal, ChannelGoals, ChannelNeighbours, MOST_CHANNELS};
use fredholm_core::{Estimator, NoNeighbour, Real};
use fredholm_embedded::TableBuilder;
use fredholm_model::cost::Cost;
use fredholm_model::heat::RadiativeExchange;
use fredholm_model::{
    About, Discretisation, Error, Examined, Goal, LastSteps, Model, Pairs, Partitioned, Prepared,
    Region, Request, Subject, System, Then, WalkOptions, in_scalar,
};
use fredholm_scene::{Coloured, Point, Sources};

use crate::SceneModel;
use crate::channels::{FaceTables, PerFace, Solved, with_neighbours};
use crate::partition::{Cut, NO_PAIRS, RAY, ScenePartition, WalkTables, no_prediction};
use crate::radius::{check_plain_variance, radius};
use crate::regions::Place;

/// The model of the way back of a scene, for goals that are means over surfaces.
pub(crate) struct BackModel<'a> {
    forward: &'a SceneModel,
    /// The scene in which the receivers send out light, and nothing else.
    receivers: SceneModel,
    per_face: PerFace,
    /// (F, Φ) of every receiver, which takes no walks.
    known: Vec<f64>,
    goals: Vec<Goal>,
}

impl<'a> BackModel<'a> {
    pub(crate) fn new(forward: &'a SceneModel, goals: &[Goal]) -> Result<Self, Error> {
        let refuse = |message: String| {
            Err(Error::Option {
                subject: Subject::Adjoint,
                message,
            })
        };
        let scene = &forward.scene;
        if forward.colours.is_some() {
            return refuse(
                "walks from the sources serve many receivers in one channel: leave `adjoint` out"
                    .to_owned(),
            );
        }
        if Sources::<f64>::new(scene).is_none() {
            return refuse(
                "walks from the sources start on surfaces that emit and at lamps, and there must be one: not in the sun or the \
                 sky, nor where light is taken away; leave `adjoint` out"
                    .to_owned(),
            );
        }
        let regions = forward.regions(goals, false);
        let walked = regions
            .iter()
            .filter(|region| forward.takes_walks(region, false));
        // What is not reflected has an irradiance of its own.
        let own: Vec<&Region> = walked.collect();
        let channels = regions.len() + own.len();
        if channels > MOST_CHANNELS {
            return refuse(format!(
                "walks from the sources serve {MOST_CHANNELS} receivers at most, not {channels}: leave `adjoint` out"
            ));
        }
        let mut emissions = vec![vec![0.0; scene.faces().len()]; channels];
        let mut known = Vec::with_capacity(channels);
        let all = regions.iter().map(|region| (region, true));
        let all = all.chain(own.into_iter().map(|region| (region, false)));
        for ((region, is_radiosity), emissions) in all.zip(&mut emissions) {
            let Place::Faces(faces) = Place::new(scene, region)? else {
                return refuse(
                    "walks from the sources serve means over surfaces, which they may meet: leave `adjoint` out, or the points"
                        .to_owned(),
                );
            };
            let own = || {
                faces
                    .iter()
                    .filter_map(|&face| scene.faces().get(face as usize))
            };
            let area: f64 = own().map(|face| face.area).sum();
            for (&number, face) in faces.iter().zip(own()) {
                let density = if is_radiosity { face.reflectance } else { 1.0 };
                if let Some(emission) = emissions.get_mut(number as usize) {
                    *emission = density / area;
                }
            }
            let emitted: f64 = own().map(|face| face.area * face.emission).sum();
            known.push(if is_radiosity { emitted / area } else { 0.0 });
        }
        let largest: Vec<f64> = (0..scene.faces().len())
            .map(|face| emissions.iter().map(|own| own[face]).fold(0.0, f64::max))
            .collect();
        let shares = (0..scene.faces().len()).flat_map(|face| {
            let largest = largest[face];
            let share = move |own: &Vec<f64>| {
                if largest > 0.0 {
                    own[face] / largest
                } else {
                    0.0
                }
            };
            emissions.iter().map(share)
        });
        let per_face = PerFace {
            channels,
            factors: vec![1.0; scene.faces().len() * channels],
            shares: shares.collect(),
            weights: vec![1.0; channels],
        };
        let receivers = scene.clone().with_emissions(&largest)?;
        Ok(Self {
            forward,
            receivers: SceneModel::of_scene(forward.names.clone(), receivers),
            per_face,
            known,
            goals: goals.to_vec(),
        })
    }
}

impl Model for BackModel<'_> {
    fn about(&self) -> About {
        self.forward.about()
    }
    fn estimator(&self) -> Estimator {
        self.forward.estimator()
    }
    fn last_steps(&self) -> LastSteps {
        self.forward.last_steps()
    }
    fn is_adjoint(&self) -> bool {
        true
    }
    fn shared(&self) -> usize {
        self.per_face.channels
    }
    fn part(&self, number: usize) -> Option<&str> {
        self.forward.part(number)
    }
    fn unit(&self) -> Option<&'static str> {
        self.forward.unit()
    }
    fn irradiance_unit(&self) -> Option<&'static str> {
        self.forward.irradiance_unit()
    }
    fn flux_unit(&self) -> &'static str {
        self.forward.flux_unit()
    }
    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        self.forward.check_goals(goals)
    }
    fn grid(&self, points: usize, part: Option<usize>) -> Vec<Region> {
        self.forward.grid(points, part)
    }
    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        self.forward.check(discretisation, pairs)
    }
    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        Ok(Box::new(BackPartition {
            model: self,
            cells: ScenePartition::new(&self.receivers, discretisation)?,
        }))
    }
    fn levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        self.forward.levels(discretisation)
    }
    fn position(&self, region: &Region) -> Option<Vec<f64>> {
        self.forward.position(region)
    }
    fn is_in_space(&self, region: &Region) -> bool {
        self.forward.is_in_space(region)
    }
    fn exchange(&self) -> Option<&dyn RadiativeExchange> {
        self.forward.exchange()
    }
    fn smooth_order(&self, degree: usize) -> f64 {
        self.forward.smooth_order(degree)
    }
}

/// The cells of the way back: those of the scene.
struct BackPartition<'m> {
    model: &'m BackModel<'m>,
    cells: ScenePartition<'m>,
}

impl<'m> Partitioned<'m> for BackPartition<'m> {
    fn cells(&self) -> usize {
        self.cells.cells()
    }
    fn unknowns(&self) -> usize {
        self.cells.unknowns()
    }
    fn memory(&self, goals: &[Goal], pairs: Pairs) -> usize {
        let channels = self.model.per_face.channels;
        let own = self.cells.memory(goals, pairs);
        own.saturating_add(self.cells.channel_memory().saturating_mul(channels))
    }
    fn cost(&self, pairs: Pairs) -> Cost {
        let mut cost = self.cells.cost(pairs);
        // What a source gives to receivers directly is a score, and its first ray a step.
        let first = cost.plain.score + cost.plain.step;
        cost.plain.start += first;
        cost.walk.start += first + f64::from(Sources::<f64>::LOOKS) * RAY;
        cost.shared(self.model.goals.len(), self.model.per_face.channels)
    }
    fn evaluations(&self, sweeps: u32) -> f64 {
        self.cells.evaluations(sweeps)
    }
    fn plain_radius(&self, absorption: f64) -> Result<f64, Error> {
        self.cells.plain_radius(absorption)
    }
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cells.check_variance(walk)
    }
    fn check_examination(&self) -> Result<(), Error> {
        Err(no_prediction())
    }
    fn solve(&self, absorption: f64) -> Result<Box<dyn System + 'm>, Error> {
        Ok(Box::new(BackSystem {
            model: self.model,
            cut: Arc::clone(&self.cells.cut),
            solved: self
                .cells
                .solve_channels(&self.model.per_face, absorption)?,
            radius_bound: radius(self.model.forward.scene())?,
        }))
    }
    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let zeros = vec![0.0; request.goals.len()];
        in_scalar!(self.cells.cut.scalar, F => {
            let none = NoNeighbour::<Coloured<'_, F>>::new();
            self.model.with_job::<F>(&self.cells.cut, request, &mut |walks| {
                let nothing = vec![0.0; self.model.per_face.channels];
                let goals = [walks.goal(Some(&nothing))];
                then(&Prepared::plain(&walks.job(&none, &goals), &zeros))
            })
        })
    }
}

/// v and c of s for every receiver.
struct BackSystem<'m> {
    model: &'m BackModel<'m>,
    cut: Arc<Cut>,
    solved: Solved,
    radius_bound: f64,
}

/// Walks from the sources.
struct BackWalks<'w, F> {
    model: &'w BackModel<'w>,
    coloured: &'w Coloured<'w, F>,
    sources: &'w Sources<F>,
    walk: &'w WalkOptions,
}

impl<'w, F: Real> BackWalks<'w, F> {
    fn goal<'g>(&'g self, control_means: Option<&'g [f64]>) -> ChannelGoal<'g, &'g Sources<F>> {
        ChannelGoal {
            functional: self.sources,
            control_means,
            known: &self.model.known,
        }
    }

    fn job<'g, N: ?Sized>(
        &'g self,
        neighbours: &'g N,
        goals: &'g [ChannelGoal<'g, &'g Sources<F>>],
    ) -> ChannelGoals<'g, Coloured<'w, F>, N, &'g Sources<F>> {
        ChannelGoals {
            equations: self.coloured,
            neighbours,
            goals,
            weights: &[],
            options: self.walk.for_core(),
        }
    }
}

impl BackModel<'_> {
    fn with_job<F: Real>(
        &self,
        cut: &Cut,
        request: &Request<'_>,
        then: &mut dyn FnMut(&BackWalks<'_, F>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if request.goals != self.goals {
            return Err(Error::Internal("walks back for other receivers"));
        }
        let tables = WalkTables::<F>::new(self.receivers.scene(), cut)?;
        let faces = FaceTables::new(&self.per_face);
        let coloured = faces.of(tables.radiosity(cut, request.walk.absorption)?)?;
        let sources = Sources::new(self.forward.scene());
        then(&BackWalks {
            model: self,
            coloured: &coloured,
            sources: &sources.ok_or(Error::Internal("a scene without a source"))?,
            walk: request.walk,
        })
    }
}

/// Rays from the sources by which (v, Φ) is told to people.
const LOOKS: u64 = 4096;

impl BackSystem<'_> {
    fn job_in<F: Real>(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let of_channels = self.solved.tables::<F>(self.cut.degree)?;
        let largest = self.solved.v::<F>();
        let largest = largest.iter().map(|v| fredholm_model::numbers::largest(v));
        let largest = largest.fold(0.0, f64::max);
        self.model.with_job::<F>(&self.cut, request, &mut |walks| {
            let to = (walks.coloured, &*self.model.per_face.weights);
            with_neighbours(self.cut.degree, &of_channels, to, &mut |neighbours| {
                let goals = [walks.goal(None)];
                let mut galerkin = self.galerkin(walks, neighbours);
                galerkin.truncate(request.goals.len());
                then(&Prepared {
                    job: &walks.job(neighbours, &goals),
                    galerkin: &galerkin,
                    largest: largest * walks.sources.power().to_f64(),
                    radius_bound: self.radius_bound,
                    convergence: self.solved.convergence,
                    pointwise: NO_PAIRS,
                    neighbour_second_moment_radius: None,
                    pair_counts: None,
                })
            })
        })
    }

    /// (v, Φ) of every receiver, about: by starts of walks.
    fn galerkin<F: Real>(
        &self,
        walks: &BackWalks<'_, F>,
        neighbours: &(impl ChannelNeighbours<Scalar = F, Point = Point<F>> + ?Sized),
    ) -> Vec<f64> {
        use fredholm_core::channels::ChannelFunctional as _;
        let channels = self.model.per_face.channels;
        let seeds = fredholm_core::WalkSeeds::<fredholm_core::DefaultGenerator>::new(0, 0);
        let mut draws = fredholm_core::RngUniforms(seeds.generator(0));
        let mut sums = self.model.known.clone();
        let (mut own, mut known) = (
            vec![F::from_f64(0.0); channels],
            vec![F::from_f64(0.0); channels],
        );
        for _ in 0..LOOKS {
            let (x, phi) = walks.sources.start(walks.coloured, &mut draws, &mut known);
            neighbours.values(&neighbours.locate(x), &mut own);
            for ((sum, &v), &known) in sums.iter_mut().zip(&own).zip(&known) {
                *sum += (phi * (v + known)).to_f64() / LOOKS as f64;
            }
        }
        sums
    }
}

impl System for BackSystem<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        check_plain_variance(self.model.forward.scene(), walk.absorption)
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        in_scalar!(self.cut.scalar, F => self.job_in::<F>(request, then))
    }

    fn examine(
        &self,
        _: &Request<'_>,
        _: usize,
        _: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        Err(no_prediction())
    }

    fn tables(&self, _: Pairs, _: f64) -> Result<TableBuilder, Error> {
        Err(Error::Option {
            subject: Subject::Problem,
            message: "there are no device tables of the way back".to_owned(),
        })
    }
}
