//! Rounds of walks of some goals.

use fredholm_core::resolvent::{CellPoint, GroupScores, Known, Plan, RestDensity, RoundSum};
use fredholm_core::{Tolerance, WalkSeeds};
use fredholm_rayon::{Observer, fill_rows};

use super::ResolventEstimate;
use super::blocks::Blocks;
use super::cut::{Asked, Cut, ResolventCut, ResolventWalks};
use super::images::{ImageMaker, Imaged};
use super::regular::AnyPoint;
use crate::Error;

/// The number of the goal of draws that all goals share.
const SHARED: u64 = u32::MAX as u64;
/// The part of an error that no error bar sees, at most: what scores of one degree less would move, which is many times what is lost.
const UNSEEN: f64 = 0.5;
/// The part by which rules of images may be off.
const OFF: f64 = 0.1;

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

/// What is looked at where values are images.
pub(super) struct Imaging<'c, 'k> {
    pub(super) maker: ImageMaker<'c, 'k>,
    pub(super) looks: Vec<Imaged>,
    pub(super) blocks: Blocks,
}

/// Walks of some goals.
pub(super) struct Walks<'c, 'k> {
    pub(super) cut: &'c Cut<'k>,
    /// The goals that have walks of their own; none where values are images.
    pub(super) asked: Vec<Asked<'c>>,
    pub(super) images: Option<Imaging<'c, 'k>>,
    pub(super) shared: Plan<'c, AnyPoint>,
    /// The standard deviation of a point of what a goal has for itself.
    pub(super) own: Vec<f64>,
    /// The number of strata that count, of all plans together.
    pub(super) strata: f64,
    /// What nets gain, if somebody has told, and the points that rounds were asked for.
    pub(super) gain: Option<f64>,
    pub(super) asked_points: f64,
    /// What walks of a goal's own have seen of |D|.
    pub(super) seen: Vec<Vec<Known>>,
    pub(super) sums: Vec<Sums>,
    pub(super) points: u64,
    pub(super) steps: u64,
}

impl Walks<'_, '_> {
    /// The root of the number of goals, and the standard deviations of all of them together.
    fn all(&self) -> (f64, f64) {
        let many = (self.asked.len().max(1) as f64).sqrt();
        let own: f64 = self.own.iter().sum();
        (many, many * self.shared.std_dev() + own)
    }

    /// The plan of what a goal has for itself, if it has something.
    pub(super) fn with_plan<T>(
        &self,
        goal: usize,
        then: impl FnOnce(Option<Plan<'_, AnyPoint>>) -> T,
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
        let density = |x: &CellPoint<AnyPoint>| {
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
        plan: &Plan<'_, AnyPoint>,
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

    /// The scores of about so many points of all goals.
    fn draw(
        &self,
        round: u32,
        points: f64,
        seed: u64,
        watch: &dyn Observer,
    ) -> Result<Drawn, Error> {
        let (many, all) = self.all();
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
        let goals = self.own.iter().zip(&self.seen).enumerate();
        let own = goals.map(|(goal, (std_dev, seen))| {
            self.with_plan(goal, |plan| {
                let Some(mut plan) = plan else {
                    return Ok(Vec::new());
                };
                plan.learn((0..).zip(seen.iter().copied()));
                if let Some(gain) = self.gain {
                    plan.set_gain(gain);
                }
                self.scores(&plan, share(*std_dev), seeds(goal as u64), watch)
            })?
        });
        let own = own.collect::<Result<Vec<_>, Error>>()?;
        Ok(Drawn { shared, own })
    }

    /// What such scores give for a goal.
    fn sum(&self, goal: usize, shared: &[GroupScores], own: &[GroupScores]) -> RoundSum {
        let mut sum = RoundSum::default();
        for group in shared.iter().chain(own) {
            sum.add(group, self.cut.functions, &self.asked[goal].weights);
        }
        sum
    }
}

/// The scores of points that all goals share, and those of every goal's own.
struct Drawn {
    shared: Vec<GroupScores>,
    own: Vec<Vec<GroupScores>>,
}

impl ResolventWalks for Walks<'_, '_> {
    fn std_devs(&self) -> (f64, Vec<f64>) {
        (self.shared.std_dev(), self.own.clone())
    }

    fn strata(&self) -> f64 {
        self.strata
    }

    fn set_gain(&mut self, gain: f64) {
        self.gain = Some(gain);
        self.shared.set_gain(gain);
    }

    fn gain(&self) -> f64 {
        let (many, all) = self.all();
        let share = all / self.asked_points;
        let variance = |sums: &Sums| sums.variance / sums.weights.powi(2);
        let [mut found, mut predicted] = [0.0; 2];
        for (sums, own) in self.sums.iter().zip(&self.own) {
            found += variance(sums);
            predicted += share * (self.shared.std_dev() / many + own);
        }
        if let Some(images) = &self.images {
            // An image may have a variance of its own, which no points lower.
            let sums = images
                .looks
                .iter()
                .map(|own| images.blocks.sum(&own.weights));
            found += sums.map(|sum| sum.variance).sum::<f64>();
            predicted += images.looks.len() as f64 * share * self.shared.std_dev();
        }
        match predicted > 0.0 && found.is_finite() {
            true => (found / predicted).sqrt(),
            false => 1.0,
        }
    }

    fn known(&self) -> Vec<[f64; 2]> {
        let looks = self.images.iter().flat_map(|images| &images.looks);
        let looks = looks.map(|own| [own.known, own.size]);
        self.asked
            .iter()
            .map(|own| [own.known, own.size])
            .chain(looks)
            .collect()
    }

    fn image_costs(&self) -> [f64; 2] {
        let looks = self.images.iter().flat_map(|images| &images.looks);
        let (mut evaluations, mut variance, mut count) = (0.0, 0.0_f64, 0.0);
        for own in looks {
            evaluations += own.image.evaluations as f64;
            variance = variance.max(own.image.variance);
            count += 1.0;
        }
        [evaluations / count, variance.sqrt()]
    }

    fn round(
        &mut self,
        round: u32,
        points: f64,
        seed: u64,
        watch: &dyn Observer,
    ) -> Result<(), Error> {
        let Drawn { shared, own } = self.draw(round, points, seed, watch)?;
        let weight = points * points;
        self.asked_points += points;
        if let Some(images) = &mut self.images {
            images.blocks.add(&shared, weight);
        }
        for (goal, groups) in own.iter().enumerate() {
            let sum = self.sum(goal, &shared, groups);
            let to = &mut self.sums[goal];
            to.weights += weight;
            to.value += weight * sum.value;
            to.variance += weight.powi(2) * sum.variance;
            to.squares += weight.powi(4) * sum.squares;
            let all = shared.iter().chain(groups);
            to.points += all.map(|group| group.points).sum::<u64>();
            let seen = &mut self.seen[goal];
            for &(number, known) in groups.iter().flat_map(|group| &group.seen) {
                let number = number as usize;
                seen.resize(seen.len().max(number + 1), Known::default());
                seen[number] = seen[number].and(known);
            }
        }
        for group in shared.iter().chain(own.iter().flatten()) {
            self.points += group.points;
            self.steps += group.steps;
        }
        self.shared
            .learn(shared.into_iter().flat_map(|group| group.seen));
        Ok(())
    }

    fn replicate(&self, number: u32, points: f64, seed: u64) -> Result<(Vec<f64>, u64), Error> {
        let Drawn { shared, own } = self.draw(number, points, seed, &())?;
        let goals = self.asked.iter().zip(&own).enumerate();
        let values =
            goals.map(|(goal, (asked, own))| asked.known + self.sum(goal, &shared, own).value);
        let all = shared.iter().chain(own.iter().flatten());
        let states = all.map(|group| group.points + group.steps).sum();
        Ok((values.collect(), states))
    }

    fn estimates(&self) -> Vec<ResolventEstimate> {
        let figures = self.cut.figures();
        let all = self.asked.iter().zip(&self.sums);
        let rows = all.map(|(asked, sums)| ResolventEstimate {
            // Without walks their share is 0.
            value: asked.known + sums.value / sums.weights.max(f64::MIN_POSITIVE),
            known: asked.known,
            floor: figures.floor(asked.size),
            std_error: match sums.weights > 0.0 {
                true => sums.variance.sqrt() / sums.weights,
                false => f64::INFINITY,
            },
            freedom: match sums.squares > 0.0 {
                true => sums.variance.powi(2) / sums.squares,
                false => f64::INFINITY,
            },
            points: sums.points,
        });
        let looks = self.images.iter().flat_map(|images| {
            images.looks.iter().map(|own| {
                let sum = images.maker.sum(own, &images.blocks);
                ResolventEstimate {
                    value: own.known + sum.value,
                    known: own.known,
                    floor: figures.floor(own.size),
                    std_error: sum.std_error(),
                    freedom: f64::INFINITY,
                    points: self.points,
                }
            })
        });
        rows.chain(looks).collect()
    }

    fn is_biased(&self, tolerance: Option<Tolerance>) -> bool {
        let Some(Imaging {
            maker,
            looks,
            blocks,
        }) = &self.images
        else {
            return false;
        };
        looks.iter().any(|own| {
            let (sum, highest) = (maker.sum(own, blocks), maker.highest(own, blocks));
            let error = sum.std_error();
            let bound = tolerance.map(|tolerance| tolerance.error_at(own.known + sum.value));
            let bound = bound.unwrap_or(error);
            highest.significant() > UNSEEN * bound.max(0.5 * error)
                || own.image.error > OFF * bound.max(error)
        })
    }

    fn into_found(self: Box<Self>) -> Option<(Vec<f64>, Blocks)> {
        let images = self.images?;
        let rows = images.maker.rows(&images.looks, &images.blocks);
        Some((rows, images.blocks))
    }

    fn counts(&self) -> [u64; 2] {
        [self.points, self.steps]
    }
}
