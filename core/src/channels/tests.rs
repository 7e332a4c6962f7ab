//! Several equations on one chain against exact answers.

use super::{
    ChannelFunctional, ChannelGoal, ChannelGoals, ChannelNeighbours, Channels, NothingKnown,
};
use crate::{
    At, Batch, Estimator, Job, Kernel, Located, Sampler, StateSpace, Uniforms, WalkOptions,
};

/// u_c(x) = r_c x ∫ u_c dy + F_c on [0, 1], with r = (1, ½) and F_c = (2, 3): u_c = F_c (1 + r_c x/(1 − r_c/2)).
struct Two {
    absorption: f64,
}

const R: [f64; 2] = [1.0, 0.5];
const F: [f64; 2] = [2.0, 3.0];

fn exact(x: f64) -> [f64; 2] {
    [0, 1].map(|c| F[c] * (1.0 + R[c] * x / (1.0 - 0.5 * R[c])))
}

impl StateSpace for Two {
    type Scalar = f64;
    type Point = f64;
}
impl Sampler for Two {
    fn absorption(&self, _: &f64) -> f64 {
        self.absorption
    }
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        Some(uniforms.uniform())
    }
}
impl Kernel for Two {
    fn kernel(&self, x: &f64, _: &f64) -> f64 {
        x / (1.0 - self.absorption)
    }
}
impl Channels for Two {
    fn channels(&self) -> usize {
        2
    }
    fn factors(&self, _: &f64, factors: &mut [f64]) {
        factors.copy_from_slice(&R);
    }
    /// Not F itself: a number twice as large, or 0.
    fn sample_sources<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U, sources: &mut [f64]) {
        let twice = if uniforms.uniform() < 0.5 { 2.0 } else { 0.0 };
        sources.copy_from_slice(&F.map(|f| twice * (f - 0.5)));
    }
}

/// The value in a point, of which every second start knows 1: ½ in the mean.
struct Half(f64);
impl ChannelFunctional<Two> for Half {
    fn start<U: Uniforms<f64>>(&self, _: &Two, uniforms: &mut U, known: &mut [f64]) -> (f64, f64) {
        known.fill(if uniforms.uniform() < 0.5 { 1.0 } else { 0.0 });
        (self.0, 1.0)
    }
}

/// v_c = 2: G_c = 2 − T_kc 2 = 2 − 2 r_c x.
struct Flat;
impl StateSpace for Flat {
    type Scalar = f64;
    type Point = f64;
}
impl ChannelNeighbours for Flat {
    fn locate(&self, x: f64) -> Located<f64> {
        Located { point: x, cell: 0 }
    }
    fn sources(&self, x: &Located<f64>, _: &mut dyn Uniforms<f64>, sources: &mut [f64]) {
        sources.copy_from_slice(&R.map(|r| 2.0 - 2.0 * r * x.point));
    }
    fn values(&self, _: &Located<f64>, values: &mut [f64]) {
        values.fill(2.0);
    }
}

const WALKS: u64 = 100_000;

fn options(estimator: Estimator, survivals: u32) -> WalkOptions {
    WalkOptions {
        estimator,
        survivals,
        ..WalkOptions::default()
    }
}

/// Means of both channels and of their sum, plain and preconditioned, are within 4.9 standard errors of what is exact,
/// and what the neighbour equations score has the mean (v, Φ).
#[test]
fn one_walk_estimates_all_channels_and_their_sum() {
    let two = Two { absorption: 0.3 };
    // Sources are F − ½, whose solution is u of F − ½. Starts add ½, and 1 and 3 are known.
    let share = |f: f64| (f - 0.5) / f;
    let x = 0.8;
    for estimator in [Estimator::Absorption, Estimator::Collision] {
        for (survivals, means) in [(0, None), (3, Some(&[2.0, 2.0][..]))] {
            let weights = [0.25, 2.0];
            let job = ChannelGoals {
                equations: &two,
                neighbours: &Flat,
                goals: &[ChannelGoal {
                    functional: Half(x),
                    control_means: means,
                    known: &[1.0, 3.0],
                }],
                weights: &weights,
                options: options(estimator, survivals),
            };
            assert_eq!((job.goals(), job.shared()), (3, 3));
            let mut batches = [Batch::new(0, WALKS, WALKS); 3];
            job.run_shared(0, &mut batches, u64::MAX).unwrap();
            let [a, b] = exact(x);
            let [a, b] = [1.5 + share(F[0]) * a, 3.5 + share(F[1]) * b];
            for (batch, exact) in batches.iter().zip([a, b, 0.25 * a + 2.0 * b]) {
                let statistics = batch.statistics();
                let all = [
                    (statistics.plain(), exact),
                    (statistics.preconditioned(), exact),
                    (statistics.control(), 0.0),
                ];
                for (of, exact) in all {
                    let z = (of.estimate - exact) / of.std_error.unwrap();
                    assert!(z.abs() < 4.9, "{estimator:?} {survivals} {exact}: {z}");
                }
            }
            // Alone, a channel has the same bits.
            let mut alone = Batch::new(0, WALKS, WALKS);
            job.run(1, &mut alone, 70).unwrap();
            job.run(1, &mut alone, u64::MAX).unwrap();
            assert_eq!(alone, batches[1]);
        }
    }
}

/// A walk that scores an infinity in one channel is in no batch.
#[test]
fn a_score_that_is_not_finite_leaves_all_batches_before_it() {
    struct Wild;
    impl StateSpace for Wild {
        type Scalar = f64;
        type Point = f64;
    }
    impl ChannelNeighbours for Wild {
        fn locate(&self, x: f64) -> Located<f64> {
            Located { point: x, cell: 0 }
        }
        fn sources(&self, x: &Located<f64>, _: &mut dyn Uniforms<f64>, sources: &mut [f64]) {
            sources.fill(0.0);
            if x.point > 0.99 {
                sources[1] = f64::INFINITY;
            }
        }
        fn values(&self, _: &Located<f64>, values: &mut [f64]) {
            values.fill(0.0);
        }
    }
    let job = ChannelGoals {
        equations: &Two { absorption: 0.3 },
        neighbours: &Wild,
        goals: &[ChannelGoal {
            functional: NothingKnown(At(0.5)),
            control_means: None,
            known: &[],
        }],
        weights: &[],
        options: options(Estimator::Collision, 0),
    };
    let mut batches = [Batch::new(0, 10_000, 10_000); 2];
    let wrong = job.run_shared(0, &mut batches, u64::MAX).unwrap_err();
    assert!(wrong.walk > 0);
    for batch in &batches {
        assert_eq!(batch.statistics().walks(), wrong.walk);
    }
}
