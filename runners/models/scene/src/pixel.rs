//! The walks of a pixel.

use fredholm_core::channels::{ChannelFunctional, ChannelGoal, ChannelGoals, MOST_CHANNELS};
use fredholm_core::{
    Batch, DefaultGenerator, Form, Functional, LastStep, Length, NotFinite, Real, Started,
    StateSpace, Task, Uniforms, WalkSeeds, WithKnown,
};
use fredholm_model::WalkOptions;
use fredholm_scene::{Coloured, Point, Radiosity};

use crate::channels::Boxed as ManyBoxed;
use crate::system::Boxed;

/// Where walks of a pixel start.
pub(crate) struct Pixel<'a, F> {
    pub(crate) radiosity: &'a Radiosity<'a, F>,
    pub(crate) from: [F; 3],
    /// The direction to the pixel's upper left corner, and the vectors from there to the corners beside it.
    pub(crate) corner: [F; 3],
    pub(crate) spans: [[F; 3]; 2],
    /// Whether walks start in the part of it that sees something, and nowhere else.
    pub(crate) is_partial: bool,
}

/// Points of a pixel among which one is sought that sees something.
const TRIES: u32 = 4096;

impl<F: Real> Pixel<'_, F> {
    /// What is seen through the point with these coordinates in the pixel.
    pub(crate) fn at(&self, [s, t]: [F; 2]) -> Option<(Started<Point<F>, F>, F)> {
        let [p, q] = self.spans;
        let to: [F; 3] = core::array::from_fn(|k| self.corner[k] + s * p[k] + t * q[k]);
        let length = (to[0] * to[0] + to[1] * to[1] + to[2] * to[2]).sqrt();
        self.radiosity
            .seen_through_backs(self.from, to.map(|x| x / length))
    }

    /// How many of its corners and its middle see something, of five.
    pub(crate) fn looks(&self) -> usize {
        let looks = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]];
        let seen = looks.map(|at| self.at(at.map(F::from_f64)).is_some());
        seen.into_iter().filter(|seen| *seen).count()
    }

    /// What is seen through a random point of it, or of its part that sees something.
    pub(crate) fn draw<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        for _ in 0..if self.is_partial { TRIES } else { 1 } {
            if let Some(seen) = self.at([uniforms.uniform(), uniforms.uniform()]) {
                return seen;
            }
        }
        self.radiosity.nowhere()
    }
}

/// A pixel in all channels.
struct InChannels<'p, 'a, F> {
    pixel: &'p Pixel<'a, F>,
    /// Whether the means of what is known of starts are told elsewhere.
    is_known: bool,
}

impl<'c, F: Real> ChannelFunctional<Coloured<'c, F>> for InChannels<'_, '_, F> {
    fn start<U: Uniforms<F>>(
        &self,
        coloured: &Coloured<'c, F>,
        uniforms: &mut U,
        known: &mut [F],
    ) -> (Point<F>, F) {
        let (start, phi) = self.pixel.draw(uniforms);
        if self.is_known {
            known.fill(F::from_f64(0.0));
        } else {
            coloured.known(&start.point, known);
        }
        (start.point, phi)
    }
}

impl<'e, F: Real, E> Functional<WithKnown<'e, E>> for Pixel<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Started<Point<F>, F>, F) {
        self.draw(uniforms)
    }
}

/// The walks of a pixel: of one equation, or of several channels and their sum.
pub(crate) trait PixelWalks<F>: Sync {
    /// The number of means over a pixel.
    fn means(&self) -> usize;

    /// Whether they follow no neighbour equation.
    fn is_plain(&self) -> bool;

    /// φ v of what a ray meets, and φ times what is known besides, of every mean.
    fn look(&self, seen: (Started<Point<F>, F>, F), looks: [&mut [f64]; 2]);

    /// Runs the walks of a pixel in a batch for each mean. Given are the means of what [`look`](Self::look) tells.
    fn run(
        &self,
        pixel: &Pixel<'_, F>,
        number: u64,
        looks: Option<&[Vec<f64>; 2]>,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite>;
}

/// Walks of one equation.
pub(crate) struct OneChannel<'w, F> {
    pub(crate) last: &'w LastStep<'w, Radiosity<'w, F>>,
    pub(crate) neighbour: &'w Boxed<'w, F>,
    pub(crate) walk: &'w WalkOptions,
    pub(crate) is_plain: bool,
}

impl<F: Real> PixelWalks<F> for OneChannel<'_, F> {
    fn means(&self) -> usize {
        1
    }

    fn is_plain(&self) -> bool {
        self.is_plain
    }

    fn look(&self, (start, phi): (Started<Point<F>, F>, F), [v, known]: [&mut [f64]; 2]) {
        let value = self.neighbour.value(&self.neighbour.locate(start));
        v.fill((phi * value).to_f64());
        known.fill(0.0);
    }

    fn run(
        &self,
        pixel: &Pixel<'_, F>,
        number: u64,
        looks: Option<&[Vec<f64>; 2]>,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let equation = WithKnown(self.last);
        let mean = looks.and_then(|[v, _]| v.first());
        let task = Task {
            equation: &equation,
            neighbour: self.neighbour,
            functional: pixel,
            control_mean: Some(mean.copied().unwrap_or(0.0)),
            estimator: self.walk.estimator,
            form: Form::Product,
            seeds: WalkSeeds::<DefaultGenerator>::new(self.walk.seed, number),
            length: Length::default(),
        };
        batches
            .iter_mut()
            .try_for_each(|batch| batch.run(&task, u64::MAX))
    }
}

/// Walks of several channels.
pub(crate) struct AllChannels<'w, F> {
    pub(crate) coloured: &'w Coloured<'w, F>,
    pub(crate) weights: &'w [f64],
    pub(crate) neighbours: &'w ManyBoxed<'w, F>,
    pub(crate) walk: &'w WalkOptions,
    pub(crate) is_plain: bool,
}

impl<F: Real> PixelWalks<F> for AllChannels<'_, F> {
    fn means(&self) -> usize {
        self.weights.len() + 1
    }

    fn is_plain(&self) -> bool {
        self.is_plain
    }

    fn look(&self, (start, phi): (Started<Point<F>, F>, F), [v, known]: [&mut [f64]; 2]) {
        let mut own = [F::from_f64(0.0); MOST_CHANNELS];
        let own = own.get_mut(..self.weights.len()).unwrap_or(&mut []);
        let at = self.neighbours.locate(start.point);
        self.neighbours.values(&at, own);
        self.write(phi, own, v);
        self.coloured.known(&start.point, own);
        self.write(phi, own, known);
    }

    fn run(
        &self,
        pixel: &Pixel<'_, F>,
        number: u64,
        looks: Option<&[Vec<f64>; 2]>,
        batches: &mut [Batch],
    ) -> Result<(), NotFinite> {
        let nothing = [0.0; MOST_CHANNELS];
        let goal = ChannelGoal {
            functional: InChannels {
                pixel,
                is_known: looks.is_some(),
            },
            control_means: Some(looks.map_or(&nothing[..], |[v, _]| v)),
            known: looks.map_or(&[], |[_, known]| known),
        };
        let goals = ChannelGoals {
            equations: self.coloured,
            neighbours: self.neighbours,
            goals: &[],
            weights: self.weights,
            options: self.walk.for_core(),
        };
        goals.run_goal(&goal, number, batches, u64::MAX)
    }
}

impl<F: Real> AllChannels<'_, F> {
    /// Writes φ times the numbers of all channels, and their weighted sum.
    fn write(&self, phi: F, own: &[F], to: &mut [f64]) {
        let mut sum = 0.0;
        for ((to, &own), weight) in to.iter_mut().zip(own).zip(self.weights) {
            *to = (phi * own).to_f64();
            sum += weight * *to;
        }
        to.iter_mut().skip(own.len()).for_each(|to| *to = sum);
    }
}
