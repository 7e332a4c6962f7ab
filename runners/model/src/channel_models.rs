//! Equation in several channels, made of one equation for each.

use std::borrow::Cow;
use std::fmt;

use fredholm_core::galerkin::Solution;
use fredholm_core::{Batch, Job, NotFinite, StopReason, Tolerance};
use fredholm_embedded::TableBuilder;

use crate::channels::{ChannelNames, check_names, refuse_device_tables};
use crate::cost::{Cost, PointwisePairs};
use crate::resolvent::{ResolventAnswer, ResolventEstimate, ResolventFound, ResolventQuestion};
use crate::{
    About, Differentiated, Discretisation, Error, Examined, Goal, LastSteps, Model, NO_ITERATION,
    Pairs, Partitioned, Prepared, Quantity, Region, Request, SavedSystem, Settings, Subject,
    System, Then, WalkOptions, WholeValues,
};

/// Equation in several channels, each of which is an equation of its own on the same space: colours of a circle, several kernels or sources on
/// [0, 1], albedos of a cloud at several wavelengths.
///
/// Targets have a value in every channel, and one for their weighted sum. Channels have the same cells and the same number of walks, and
/// walks with draws of their own, so that the error of the sum follows from those of the channels. Their number is 1 to
/// [`MOST_CHANNELS`](fredholm_core::MOST_CHANNELS).
///
/// ```
/// use fredholm::channels::ChannelModels;
/// use fredholm::{CubeModel, Solver};
///
/// // u = ∫₀¹ ½ u dy + F has the mean 2 ∫ F.
/// let with = |source: f64| CubeModel::on_interval([0.0, 1.0], |_, _| 0.5, move |_| source);
/// let u = ChannelModels::new(["direct", "diffuse"], [with(1.0), with(0.25)])?;
/// let report = Solver::new(&u).mean().solve_to(1e-9)?;
/// let values: Vec<f64> = report.goals.iter().map(|goal| goal.preconditioned.estimate.unwrap()).collect();
/// assert!(values.iter().zip([2.0, 0.5, 2.5]).all(|(value, exact)| (value - exact).abs() < 1e-8));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct ChannelModels {
    names: ChannelNames,
    models: Vec<Box<dyn Model>>,
}

impl fmt::Debug for ChannelModels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ChannelModels")
            .field("names", &self.names)
            .finish_non_exhaustive()
    }
}

/// Numbers whose combinations with a channel are the seeds of channels (the golden ratio times 2⁶⁴): the first channel has the seed that is asked
/// for.
const SEEDS: u64 = 0x9E37_79B9_7F4A_7C15;

/// Points by which spaces are compared, about.
const LOOKS: f64 = 16.0;

/// The seed of a channel.
const fn seed_of(seed: u64, channel: usize) -> u64 {
    seed ^ SEEDS.wrapping_mul(channel as u64)
}

fn refuse<T>(message: &str) -> Result<T, Error> {
    Err(Error::Option {
        subject: Subject::Problem,
        message: message.to_owned(),
    })
}

impl ChannelModels {
    /// The equations of channels with these names, in their order.
    ///
    /// # Errors
    /// [`Error::Option`]: there are no channels, too many, or two of one name; a name or a model is missing; models are of different kinds or
    /// spaces, or have channels themselves: surfaces of rooms and scenes have a reflectance and an emission for each channel.
    pub fn new<N, M>(
        names: impl IntoIterator<Item = N>,
        models: impl IntoIterator<Item = M>,
    ) -> Result<Self, Error>
    where
        N: Into<String>,
        M: Model + 'static,
    {
        let boxed = |model| Box::new(model) as Box<dyn Model>;
        let names = names.into_iter().map(Into::into).collect();
        Self::from_boxed(names, models.into_iter().map(boxed).collect())
    }

    /// The equations of channels with these names, in their order, of whichever type.
    ///
    /// # Errors
    /// As [`ChannelModels::new`].
    pub fn from_boxed(names: Vec<String>, models: Vec<Box<dyn Model>>) -> Result<Self, Error> {
        check_names(&names)?;
        if names.len() != models.len() {
            return refuse("every channel has a name and an equation");
        }
        let [first, others @ ..] = &*models else {
            return Err(Error::Internal("no channels"));
        };
        let kind = |model: &dyn Model| {
            let about = model.about();
            (about.kind, about.dimension, model.spread(LOOKS))
        };
        let shared = kind(&**first);
        if others.iter().any(|other| kind(&**other) != shared) {
            return refuse("the equations of all channels are of one kind, and have one space");
        }
        if (models.iter()).any(|own| own.exchange().is_some() || !own.channels().is_empty()) {
            return refuse(
                "surfaces of rooms and scenes have a reflectance and an emission for each channel, in one equation",
            );
        }
        Ok(Self {
            names: ChannelNames::new(names),
            models,
        })
    }

    /// The equation of the first channel, which has all properties that they share.
    fn first(&self) -> &dyn Model {
        // There is one: see `from_boxed`.
        &*self.models[0]
    }

    /// The goals of a target in every channel, as goals of one equation.
    fn targets(&self, goals: &[Goal]) -> Result<Vec<Goal>, Error> {
        let targets = self.names.targets(goals)?;
        Ok(targets
            .map(|goal| Goal::new(&goal.name, goal.region.clone()))
            .collect())
    }

    /// The numbers of all goals, from those of each channel.
    fn in_order(&self, of_channels: &[&[f64]], targets: usize) -> Vec<f64> {
        let of = |target: usize| {
            let own = of_channels.iter().map(move |own| own[target]);
            self.names.with_sum(own)
        };
        (0..targets).flat_map(of).collect()
    }

    /// Hands on the walks of all channels.
    fn joined(
        &self,
        call: Call<'_>,
        request: &Request<'_>,
        then: &mut Then<'_>,
    ) -> Result<(), Error> {
        let targets = self.targets(request.goals)?;
        let seed = request.walk.seed;
        let seeds = (0..self.models.len()).map(|channel| seed_of(seed, channel));
        let walks: Vec<WalkOptions> = seeds
            .map(|seed| WalkOptions {
                seed,
                ..*request.walk
            })
            .collect();
        let requests: Vec<Request<'_>> = walks
            .iter()
            .map(|walk| Request {
                goals: &targets,
                walk,
                wanted: request.wanted,
            })
            .collect();
        nested(call, &requests, &[], &mut |all| {
            let jobs: Vec<&dyn Job> = all.iter().map(|own| own.job).collect();
            let galerkin: Vec<&[f64]> = all.iter().map(|own| own.galerkin).collect();
            if galerkin.iter().any(|own| own.len() != targets.len()) {
                return Err(Error::Internal("channels with other goals"));
            }
            let largest = |of: fn(&Prepared<'_>) -> f64| all.iter().map(of).fold(0.0, f64::max);
            let radii = all.iter().map(|own| own.neighbour_second_moment_radius);
            let convergence = all.iter().map(|own| own.convergence);
            then(&Prepared {
                job: &Joint {
                    jobs: &jobs,
                    quantities: jobs.first().map_or(0, |job| job.shared().saturating_sub(1)),
                    weights: self.names.weights(),
                },
                galerkin: &self.in_order(&galerkin, targets.len()),
                largest: largest(|own| own.largest),
                radius_bound: largest(|own| own.radius_bound),
                convergence: convergence
                    .max_by_key(|own| own.sweeps)
                    .unwrap_or(NO_ITERATION),
                pointwise: all
                    .first()
                    .map_or_else(PointwisePairs::default, |own| own.pointwise),
                neighbour_second_moment_radius: radii.flatten().reduce(f64::max),
            })
        })
    }

    /// The estimate of the weighted sum of channels.
    fn sum_of(&self, channels: &[ResolventEstimate]) -> ResolventEstimate {
        let weights = self.names.weights();
        let sum = |of: &dyn Fn(&ResolventEstimate, f64) -> f64| -> f64 {
            let terms = channels.iter().zip(weights);
            terms.map(|(own, weight)| of(own, *weight)).sum()
        };
        let variance = |own: &ResolventEstimate, weight: f64| (weight * own.std_error).powi(2);
        let of_all = sum(&variance);
        // Welch's and Satterthwaite's degrees of freedom of a sum of variances.
        let spread = sum(&|own, weight| variance(own, weight).powi(2) / own.freedom);
        let least = channels.iter().map(|own| own.freedom);
        ResolventEstimate {
            value: sum(&|own, weight| weight * own.value),
            known: sum(&|own, weight| weight * own.known),
            floor: sum(&|own, weight| weight.abs() * own.floor),
            std_error: of_all.sqrt(),
            freedom: match spread > 0.0 {
                true => of_all * of_all / spread,
                false => least.fold(f64::INFINITY, f64::min),
            },
            points: channels.iter().map(|own| own.points).sum(),
        }
    }

    /// The error that is asked for of a channel, so that the sum has that of the question: of an absolute one.
    fn tolerance(&self, asked: Option<Tolerance>) -> Option<Tolerance> {
        let weights = self.names.weights().iter();
        let size = weights.map(|weight| weight * weight).sum::<f64>().sqrt();
        match asked {
            Some(Tolerance::Absolute(error)) => Some(Tolerance::Absolute(error / size.max(1.0))),
            asked => asked,
        }
    }
}

/// What hands on the walks of the channel of this number.
type Call<'a> = &'a dyn Fn(&Request<'_>, usize, &mut Then<'_>) -> Result<(), Error>;

/// Hands on the walks of all channels: those of a channel are prepared while those of the ones before are held.
fn nested(
    call: Call<'_>,
    requests: &[Request<'_>],
    found: &[Prepared<'_>],
    then: &mut dyn FnMut(&[Prepared<'_>]) -> Result<(), Error>,
) -> Result<(), Error> {
    let Some(request) = requests.get(found.len()) else {
        return then(found);
    };
    call(request, found.len(), &mut |prepared| {
        let mut found: Vec<Prepared<'_>> = found.to_vec();
        found.push(*prepared);
        nested(call, requests, &found, then)
    })
}

/// The walks of all channels, each with draws of its own, and their weighted sums. Behind the statistics of a target come those of derivatives
/// by so many quantities: of each channel, and of the sum.
struct Joint<'a> {
    jobs: &'a [&'a dyn Job],
    quantities: usize,
    weights: &'a [f64],
}

impl Joint<'_> {
    /// Where the statistics of a channel, or of the sum, are among those of a target: that of u, and those of derivatives.
    fn places(&self, channel: usize) -> impl Iterator<Item = usize> + use<> {
        let first = self.decisive() + channel * self.quantities;
        [channel].into_iter().chain(first..first + self.quantities)
    }
}

impl Job for Joint<'_> {
    fn goals(&self) -> usize {
        let of_channel = self.jobs.first().map_or(0, |job| job.goals());
        of_channel * self.decisive()
    }

    fn shared(&self) -> usize {
        self.decisive() * (1 + self.quantities)
    }

    fn decisive(&self) -> usize {
        self.jobs.len() + 1
    }

    fn run(&self, first: usize, batches: &mut [Batch], at_most: u64) -> Result<(), NotFinite> {
        if batches.len() < self.shared() {
            return Ok(());
        }
        let target = first / self.decisive();
        let mut channels = Vec::with_capacity(self.jobs.len());
        for (channel, job) in self.jobs.iter().enumerate() {
            let mut own: Vec<Batch> = self.places(channel).map(|place| batches[place]).collect();
            job.run(target, &mut own, at_most)?;
            channels.push(own);
        }
        // No batch is ahead of another: all channels have run.
        for (channel, own) in channels.iter().enumerate() {
            for (place, own) in self.places(channel).zip(own) {
                batches[place] = *own;
            }
        }
        for (number, place) in self.places(self.jobs.len()).enumerate() {
            let parts: Vec<Batch> = channels.iter().map(|own| own[number]).collect();
            batches[place].become_sum(&parts, self.weights);
        }
        Ok(())
    }
}

impl Model for ChannelModels {
    crate::of_space!(first);

    fn about(&self) -> About {
        let all = || self.models.iter().map(|own| own.about().last_steps);
        let last_steps = match all().find(|own| *own == LastSteps::Never) {
            Some(never) => never,
            None => LastSteps::Open {
                pay: all().any(|own| own == LastSteps::Open { pay: true }),
            },
        };
        About {
            whole: WholeValues::None,
            last_steps,
            ..self.first().about()
        }
    }

    fn channels(&self) -> &[String] {
        self.names.shared()
    }

    /// The quantities that all channels name, if they name the same.
    fn quantities(&self) -> Vec<Quantity> {
        let mut shared = self.first().quantities();
        for model in &self.models {
            let own = model.quantities();
            if own.len() != shared.len() || own.iter().zip(&shared).any(|(a, b)| a.name != b.name) {
                return Vec::new();
            }
            for (shared, own) in shared.iter_mut().zip(own) {
                shared.value = shared.value.filter(|value| Some(*value) == own.value);
            }
        }
        shared
    }

    fn with_derivatives(&self, goals: &[Goal]) -> Result<Option<Differentiated>, Error> {
        let targets = self.targets(goals)?;
        let (mut models, mut derivatives) = (Vec::new(), Vec::new());
        for model in &self.models {
            let Some((model, goals)) = model.with_derivatives(&targets)? else {
                return Ok(None);
            };
            models.push(model);
            derivatives = goals;
        }
        let (_, names) = self
            .names
            .shared()
            .split_last()
            .ok_or(Error::Internal("no channels"))?;
        let all = Self::from_boxed(names.to_vec(), models)?;
        Ok(Some((Box::new(all), derivatives)))
    }

    fn notes(&self) -> Vec<String> {
        self.models.iter().flat_map(|own| own.notes()).collect()
    }

    fn check_goals(&self, goals: &[Goal]) -> Result<(), Error> {
        self.models
            .iter()
            .try_for_each(|model| model.check_goals(goals))
    }

    fn whole(&self) -> Region {
        self.first().whole()
    }

    fn by_resolvent(&self, question: &ResolventQuestion<'_>) -> Result<ResolventFound<'_>, Error> {
        let asked = question.settings;
        if question.run.is_some() {
            return match asked.method {
                None => Err(Error::NoSetting),
                Some(_) => refuse(
                    "resolvent walks in several channels are run by one process, with no `batch`: leave these or `method` out",
                ),
            };
        }
        let goals = self.targets(question.goals)?;
        let channels = self.models.len();
        let mut all: Vec<ResolventAnswer> = Vec::with_capacity(channels);
        for (channel, model) in self.models.iter().enumerate() {
            let settings = Settings {
                seed: seed_of(asked.seed, channel),
                tolerance: self.tolerance(asked.tolerance),
                time_limit: asked.time_limit.map(|limit| limit / channels as u32),
                // Values of one function are not told one by one.
                global: Some(false),
                ..asked.clone()
            };
            let of_channel = ResolventQuestion {
                goals: &goals,
                settings: &settings,
                ..*question
            };
            all.push(model.by_resolvent(&of_channel)?.answer);
        }
        let mut estimates = Vec::with_capacity(question.goals.len());
        let told = all.iter().map(|own| own.estimates.len()).min();
        for target in 0..told.unwrap_or(0) {
            let own: Vec<_> = all.iter().map(|own| own.estimates[target]).collect();
            estimates.extend(&own);
            estimates.push(self.sum_of(&own));
        }
        let largest = all.iter().max_by_key(|own| own.figures.unknowns);
        let Some(largest) = largest.cloned() else {
            return Err(Error::Internal("an equation without channels"));
        };
        let seconds = |of: fn(&ResolventAnswer) -> f64| all.iter().map(of).sum();
        let stopped = all.iter().find(|own| own.stop != StopReason::Done);
        let mut answer = ResolventAnswer {
            estimates,
            points: all.iter().map(|own| own.points).sum(),
            steps: all.iter().map(|own| own.steps).sum(),
            rounds: all.iter().map(|own| own.rounds).max().unwrap_or(0),
            stop: stopped.map_or(StopReason::Done, |own| own.stop),
            reason: all.iter().find_map(|own| own.reason.clone()),
            setup_seconds: seconds(|own| own.setup_seconds),
            walk_seconds: seconds(|own| own.walk_seconds),
            ..largest
        };
        let sums = answer.estimates.iter().skip(channels).step_by(channels + 1);
        let is_late = |sum: &ResolventEstimate| matches!(asked.tolerance, Some(Tolerance::Relative(share)) if sum.std_error > share * sum.value.abs());
        if answer.stop == StopReason::Done && !question.is_prediction && sums.clone().any(is_late) {
            answer.stop = StopReason::ToleranceNotReached;
            answer.reason = Some(
                "channels have the relative error, and cancel in their sum: give an absolute one"
                    .to_owned(),
            );
        }
        Ok(ResolventFound {
            answer,
            field: None,
        })
    }

    fn exact_of(&self, goal: &Goal) -> Result<Option<f64>, Error> {
        let exact = self.models.iter().map(|own| own.exact(&goal.region));
        let exact: Option<Vec<f64>> = exact.collect::<Result<_, Error>>()?;
        let all = exact.map(|own| self.names.with_sum(own));
        Ok(all.and_then(|all| all.get(goal.channel?).copied()))
    }

    fn check(&self, discretisation: &Discretisation, pairs: Pairs) -> Result<(), Error> {
        self.models
            .iter()
            .try_for_each(|model| model.check(discretisation, pairs))
    }

    fn partition<'m>(
        &'m self,
        discretisation: &Discretisation,
    ) -> Result<Box<dyn Partitioned<'m> + 'm>, Error> {
        let cuts = self.models.iter().map(|own| own.partition(discretisation));
        Ok(Box::new(ChannelCuts {
            model: self,
            cuts: cuts.collect::<Result<_, Error>>()?,
        }))
    }

    fn coarse_levels(&self, discretisation: &Discretisation) -> Vec<usize> {
        self.first().coarse_levels(discretisation)
    }

    fn order(&self, discretisation: &Discretisation, pairs: Pairs) -> f64 {
        self.first().order(discretisation, pairs)
    }

    fn explain(&self, error: Error) -> Error {
        let models = self.models.iter();
        models.fold(error, |error, model| model.explain(error))
    }
}

/// The cells of all channels.
struct ChannelCuts<'m> {
    model: &'m ChannelModels,
    cuts: Vec<Box<dyn Partitioned<'m> + 'm>>,
}

impl<'m> ChannelCuts<'m> {
    fn first(&self) -> &(dyn Partitioned<'m> + 'm) {
        // There is one: see `ChannelModels::from_boxed`.
        &*self.cuts[0]
    }

    fn system(&self, systems: Vec<Box<dyn System + 'm>>) -> Box<dyn System + 'm> {
        Box::new(ChannelSystems {
            model: self.model,
            systems,
        })
    }
}

impl<'m> Partitioned<'m> for ChannelCuts<'m> {
    fn cells(&self) -> usize {
        self.first().cells()
    }

    fn unknowns(&self) -> usize {
        self.first().unknowns()
    }

    fn cells_text(&self) -> String {
        self.first().cells_text()
    }

    fn memory(&self, goals: &[Goal], pairs: Pairs) -> usize {
        let each = self.cuts.iter().map(|own| own.memory(goals, pairs));
        each.fold(0, usize::saturating_add)
    }

    fn cost(&self, pairs: Pairs) -> Cost {
        self.first().cost(pairs).of_each(self.cuts.len())
    }

    fn lift_cost(&self, degree: usize) -> Option<Cost> {
        let cost = self.first().lift_cost(degree)?;
        Some(cost.of_each(self.cuts.len()))
    }

    fn pointwise_pairs(&self, pairs: Pairs) -> Result<PointwisePairs, Error> {
        self.first().pointwise_pairs(pairs)
    }

    fn evaluations(&self, sweeps: u32) -> f64 {
        self.cuts.iter().map(|own| own.evaluations(sweeps)).sum()
    }

    fn plain_radius(&self) -> Result<f64, Error> {
        let radii = self.cuts.iter().map(|own| own.plain_radius());
        radii.reduce(|a, b| Ok(a?.max(b?))).unwrap_or(Ok(0.0))
    }

    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.cuts
            .iter()
            .try_for_each(|own| own.check_variance(walk))
    }

    fn examined_points(&self) -> Result<usize, Error> {
        self.first().examined_points()
    }

    fn solve(&self) -> Result<Box<dyn System + 'm>, Error> {
        let systems = self.cuts.iter().map(|own| own.solve());
        Ok(self.system(systems.collect::<Result<_, Error>>()?))
    }

    /// Saved systems have the numbers of one channel after the other.
    fn restore(&self, saved: SavedSystem<'m>) -> Result<Box<dyn System + 'm>, Error> {
        let channels = self.cuts.len();
        let Solution {
            v,
            convergence,
            radius_bound,
        } = saved.solution.into_owned();
        let part = |numbers: &[f64], channel: usize| {
            let each = numbers.len() / channels;
            numbers[channel * each..(channel + 1) * each].to_vec()
        };
        let systems = self.cuts.iter().enumerate().map(|(channel, cut)| {
            cut.restore(SavedSystem {
                solution: Cow::Owned(Solution {
                    v: part(&v, channel),
                    convergence,
                    radius_bound,
                }),
                coefficients: Cow::Owned(part(&saved.coefficients, channel)),
            })
        });
        Ok(self.system(systems.collect::<Result<_, Error>>()?))
    }

    fn plain_job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let call = |request: &Request<'_>, channel: usize, then: &mut Then<'_>| {
            self.cuts[channel].plain_job(request, then)
        };
        self.model.joined(&call, request, then)
    }
}

/// The solved systems of all channels.
struct ChannelSystems<'m> {
    model: &'m ChannelModels,
    systems: Vec<Box<dyn System + 'm>>,
}

impl System for ChannelSystems<'_> {
    fn check_variance(&self, walk: &WalkOptions) -> Result<(), Error> {
        self.systems
            .iter()
            .try_for_each(|own| own.check_variance(walk))
    }

    fn job(&self, request: &Request<'_>, then: &mut Then<'_>) -> Result<(), Error> {
        let call = |request: &Request<'_>, channel: usize, then: &mut Then<'_>| {
            self.systems[channel].job(request, then)
        };
        self.model.joined(&call, request, then)
    }

    fn examine(
        &self,
        _: &Request<'_>,
        _: usize,
        _: &mut dyn FnMut(&Examined<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        refuse("there are no predictions of variances in several channels: leave `channels` out")
    }

    fn tables(&self, _: Pairs) -> Result<TableBuilder, Error> {
        refuse_device_tables()
    }

    fn saved(&self) -> Option<SavedSystem<'_>> {
        let all: Option<Vec<_>> = self.systems.iter().map(|own| own.saved()).collect();
        let all = all?;
        let solutions = || all.iter().map(|own| &own.solution);
        let bounds = solutions().map(|own| own.radius_bound);
        let solution = Solution {
            v: solutions().flat_map(|own| own.v.iter().copied()).collect(),
            convergence: solutions()
                .map(|own| own.convergence)
                .max_by_key(|own| own.sweeps)?,
            radius_bound: bounds.fold(0.0, f64::max),
        };
        let coefficients = all.iter().flat_map(|own| own.coefficients.iter().copied());
        Some(SavedSystem {
            solution: Cow::Owned(solution),
            coefficients: Cow::Owned(coefficients.collect()),
        })
    }

    fn lift<'s>(self: Box<Self>, degree: usize) -> Result<Box<dyn System + 's>, Error>
    where
        Self: 's,
    {
        let lifted = self.systems.into_iter().map(|own| own.lift(degree));
        Ok(Box::new(ChannelSystems {
            model: self.model,
            systems: lifted.collect::<Result<_, Error>>()?,
        }))
    }
}
