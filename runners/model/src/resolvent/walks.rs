//! Rounds of walks of some goals.

use fredholm_core::WalkSeeds;
use fredholm_core::resolvent::{
    CellPoint, GroupScores, Known, Plan, Regular, RestDensity, RoundSum,
};
use fredholm_rayon::{Observer, fill_rows};

use super::cut::{Asked, Cut, ResolventWalks};
use super::{RegularKind, ResolventEstimate};
use crate::Error;

/// The number of the goal of draws that all goals share.
const SHARED: u64 = u32::MAX as u64;

/// Rounds of one goal so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Σ of the rounds' weights.
    weights: f64,
    value: f64,
    variance: f64,
    squares: f64,
    points: u64,
}

/// Walks of some goals.
pub(super) struct Walks<'c, 'k, E: Regular, K> {
    pub(super) cut: &'c Cut<'k, E, K>,
    pub(super) asked: Vec<Asked<'c, E::Point>>,
    pub(super) shared: Plan<'c, E::Point>,
    /// The standard deviation of a point of what a goal has for itself.
    pub(super) own: Vec<f64>,
    /// What walks of a goal's own have seen of |D|.
    pub(super) seen: Vec<Vec<Known>>,
    pub(super) sums: Vec<Sums>,
    pub(super) points: u64,
    pub(super) steps: u64,
}

impl<'c, E, K> Walks<'c, '_, E, K>
where
    E: Regular<Point: Send + Sync> + Sync,
    K: RegularKind<E>,
{
    /// The plan of what a goal has for itself, if it has something.
    pub(super) fn with_plan<T>(
        &self,
        goal: usize,
        then: impl FnOnce(Option<Plan<'_, E::Point>>) -> T,
    ) -> Result<T, Error> {
        let (cut, asked) = (self.cut, &self.asked[goal]);
        let (looks, tables) = (&cut.looks, cut.tables());
        if let Some(point) = &asked.point {
            return Ok(then(Some(Plan::at(looks, &tables, point)?)));
        }
        let Some(rest) = &asked.rest else {
            return Ok(then(None));
        };
        let resolvent = cut.resolvent();
        let density = |x: &CellPoint<E::Point>| {
            (rest.weight)(&x.point) - resolvent.series(&rest.polynomial, x)
        };
        let sizes = (0..cut.measures.len()).map(|cell| resolvent.root_mean_square(cell, &density));
        let sizes: Vec<f64> = sizes.collect();
        Ok(then(Some(Plan::rest(
            looks,
            &tables,
            RestDensity(&density),
            &sizes,
        )?)))
    }

    /// The scores of all groups of a round, on all threads.
    fn scores(
        &self,
        plan: &Plan<'_, E::Point>,
        points: f64,
        seeds: WalkSeeds,
        watch: &dyn Observer,
    ) -> Result<Vec<GroupScores>, Error> {
        let round = plan.round(points, seeds)?;
        let resolvent = self.cut.resolvent();
        let mut groups = vec![GroupScores::default(); round.groups()];
        fill_rows(&mut groups, 1, |number, out| {
            if watch.cancelled() {
                return Err(Error::Cancelled);
            }
            let scores = round.scores(number, &resolvent);
            watch.walked(scores.points);
            out.fill(scores);
            Ok(())
        })?;
        Ok(groups)
    }
}

impl<E, K> ResolventWalks for Walks<'_, '_, E, K>
where
    E: Regular<Point: Send + Sync> + Sync,
    K: RegularKind<E>,
{
    fn std_devs(&self) -> (f64, Vec<f64>) {
        (self.shared.std_dev(), self.own.clone())
    }

    fn known(&self) -> Vec<f64> {
        self.asked.iter().map(|own| own.known).collect()
    }

    fn round(
        &mut self,
        round: u32,
        points: f64,
        seed: u64,
        watch: &dyn Observer,
    ) -> Result<(), Error> {
        let goals = self.asked.len();
        let many = (goals as f64).sqrt();
        let all = many * self.shared.std_dev() + self.own.iter().sum::<f64>();
        let share = |std_dev: f64| {
            if all > 0.0 {
                points * std_dev / all
            } else {
                0.0
            }
        };
        let seeds = |goal: u64| WalkSeeds::new(seed, u64::from(round) << 32 | goal);
        let of_all = share(many * self.shared.std_dev());
        let shared = self.scores(&self.shared, of_all, seeds(SHARED), watch)?;
        let mut own = Vec::with_capacity(goals);
        for (goal, std_dev) in (0_u64..).zip(&self.own) {
            let seen = &self.seen[goal as usize];
            let scores = self.with_plan(goal as usize, |plan| {
                let Some(mut plan) = plan else {
                    return Ok(Vec::new());
                };
                plan.learn((0..).zip(seen.iter().copied()));
                self.scores(&plan, share(*std_dev), seeds(goal), watch)
            })??;
            own.push(scores);
        }
        let functions = self.cut.functions;
        let weight = points * points;
        for (goal, groups) in own.iter().enumerate() {
            let mut sum = RoundSum::default();
            let weights = &self.asked[goal].weights;
            for group in shared.iter().chain(groups) {
                sum.add(group, functions, weights);
            }
            let to = &mut self.sums[goal];
            to.weights += weight;
            to.value += weight * sum.value;
            to.variance += weight.powi(2) * sum.variance;
            to.squares += weight.powi(4) * sum.squares;
            to.points += shared
                .iter()
                .chain(groups)
                .map(|group| group.points)
                .sum::<u64>();
            let seen = &mut self.seen[goal];
            for &(number, known) in groups.iter().flat_map(|group| &group.seen) {
                let number = number as usize;
                seen.resize(seen.len().max(number + 1), Known::default());
                seen[number] = seen[number].and(known);
            }
            self.points += groups.iter().map(|group| group.points).sum::<u64>();
            self.steps += groups.iter().map(|group| group.steps).sum::<u64>();
        }
        self.points += shared.iter().map(|group| group.points).sum::<u64>();
        self.steps += shared.iter().map(|group| group.steps).sum::<u64>();
        self.shared
            .learn(shared.into_iter().flat_map(|group| group.seen));
        Ok(())
    }

    fn estimates(&self) -> Vec<ResolventEstimate> {
        let all = self.asked.iter().zip(&self.sums);
        all.map(|(asked, sums)| ResolventEstimate {
            value: asked.known + sums.value / sums.weights,
            known: asked.known,
            std_error: sums.variance.sqrt() / sums.weights,
            freedom: match sums.squares > 0.0 {
                true => sums.variance.powi(2) / sums.squares,
                false => f64::INFINITY,
            },
            points: sums.points,
        })
        .collect()
    }

    fn counts(&self) -> [u64; 2] {
        [self.points, self.steps]
    }
}
