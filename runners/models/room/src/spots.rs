//! The walks of a position of a picture, or of a stretch of wall.

use fredholm_core::channels::{ChannelGoal, ChannelGoals};
use fredholm_core::{
    At, Batch, DefaultGenerator, Form, Functional, Length, NotFinite, Real, Shifted, Task,
    WalkSeeds,
};
use fredholm_model::WalkOptions;
use fredholm_room::{Point, Room, Seen};

use super::coloured::{ColouredWalks, InChannels};
use super::light::light_at;
use super::system::Boxed;

/// Walks of one equation, or of several channels and their sum.
pub(super) trait SpotWalks<'a, F>: Sync {
    /// The number of means of a spot.
    fn means(&self) -> usize;

    /// Whether they follow no neighbour equation.
    fn is_plain(&self) -> bool;

    /// (v, Φ) of every equation at a position between the walls by its number, or `None` where there is no room.
    fn inside(&self, seen: &Seen<'_, 'a, F>, number: usize) -> Option<Vec<f64>>;

    /// Runs the walks of a position, whose [`inside`](Self::inside) is given, in a batch for each mean.
    fn run_air(
        &self,
        spot: (Seen<'_, 'a, F>, &[f64]),
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite>;

    /// Runs the walks of a point of a wall.
    fn run_wall(
        &self,
        at: At<Point<F>>,
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite>;
}

/// What v gives at a position between the walls, or `None` where there is no room.
type Inside<'w, 'a, F, T> = dyn Fn(&Seen<'_, 'a, F>, usize) -> Option<T> + Sync + 'w;

/// Walks of one equation.
pub(super) struct OneChannel<'w, 'a, F> {
    pub(super) room: &'w Room<'a, F>,
    pub(super) neighbour: &'w Boxed<'w, F>,
    pub(super) walk: &'w WalkOptions,
    /// Whether the neighbour equation has what lights give to walls.
    pub(super) has_light: bool,
    pub(super) inside: &'w Inside<'w, 'a, F, f64>,
    pub(super) is_plain: bool,
}

impl<'a, F: Real> OneChannel<'_, 'a, F> {
    fn run<T: Functional<Room<'a, F>>>(
        &self,
        (functional, known): (T, f64),
        value: Option<f64>,
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let task = Task {
            equation: self.room,
            neighbour: self.neighbour,
            functional: &Shifted { functional, known },
            control_mean: value,
            estimator: self.walk.estimator,
            form: Form::Product,
            seeds: WalkSeeds::<DefaultGenerator>::new(self.walk.seed, seeds),
            length: Length::default(),
        };
        batches
            .iter_mut()
            .try_for_each(|batch| batch.run(&task, u64::MAX))
    }
}

impl<'a, F: Real> SpotWalks<'a, F> for OneChannel<'_, 'a, F> {
    fn means(&self) -> usize {
        1
    }

    fn is_plain(&self) -> bool {
        self.is_plain
    }

    fn inside(&self, seen: &Seen<'_, 'a, F>, number: usize) -> Option<Vec<f64>> {
        (self.inside)(seen, number).map(|value| vec![value])
    }

    fn run_air(
        &self,
        (seen, values): (Seen<'_, 'a, F>, &[f64]),
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let known = light_at(&seen);
        // What lights give to the walls that are seen has no closed integral.
        let value = values.first().copied().filter(|_| !self.has_light);
        self.run((seen, known), value, seeds, batches)
    }

    fn run_wall(
        &self,
        at: At<Point<F>>,
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let value = self.neighbour.value(&self.neighbour.locate(at.0)).to_f64();
        let known = self.room.emission_of_light(at.0.wall()).to_f64();
        self.run((at, known), Some(value), seeds, batches)
    }
}

/// Walks of several channels.
pub(super) struct AllChannels<'w, 'r, 'a, F> {
    pub(super) walks: &'w ColouredWalks<'w, 'r, 'a, F>,
    pub(super) walk: &'w WalkOptions,
    pub(super) inside: &'w Inside<'w, 'a, F, Vec<f64>>,
}

impl<'a, F: Real> AllChannels<'_, '_, 'a, F> {
    fn run<T: Functional<Room<'a, F>>>(
        &self,
        (functional, known): (T, &[f64]),
        means: Option<&[f64]>,
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let goal = ChannelGoal {
            functional: InChannels(functional),
            control_means: means,
            known,
        };
        let goals = ChannelGoals {
            equations: self.walks.coloured,
            neighbours: self.walks.neighbours,
            goals: &[],
            weights: self.walks.colours.names().weights(),
            options: self.walk.for_core(),
        };
        goals.run_goal(&goal, seeds, batches, u64::MAX)
    }
}

impl<'a, F: Real> SpotWalks<'a, F> for AllChannels<'_, '_, 'a, F> {
    fn means(&self) -> usize {
        self.walks.colours.names().shared().len()
    }

    fn is_plain(&self) -> bool {
        self.walks.v.is_none()
    }

    fn inside(&self, seen: &Seen<'_, 'a, F>, number: usize) -> Option<Vec<f64>> {
        (self.inside)(seen, number)
    }

    fn run_air(
        &self,
        (seen, values): (Seen<'_, 'a, F>, &[f64]),
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let known = self.walks.light_at(&seen);
        let is_exact = self.is_plain() || self.walks.direct.is_empty();
        self.run((seen, &known), is_exact.then_some(values), seeds, batches)
    }

    fn run_wall(
        &self,
        at: At<Point<F>>,
        seeds: u64,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let values = self.walks.values(at.0);
        let known = self.walks.emission_of_light(at.0.wall());
        self.run((at, &known), Some(&values), seeds, batches)
    }
}
