//! How walks end, and that whatever ends them leaves the mean.

use crate::array::from_fn;
use crate::{
    Absorption, At, Batch, Chain, Channels, Equation, Estimator, Form, Functional, Goal, Goals,
    Job, Located, Neighbour, NeighbourOf, NoNeighbour, Space, Start, StartOf, Termination,
    Uniforms, Value, WalkOptions, WideOf,
};

/// u(x) = ρ(x) ∫ w(y) u(y) p dy + 1 on [0, 1], where steps leave with probability `open` and are uniform otherwise; the C
/// channels have the multiples `colours` of ρ.
#[derive(Clone, Copy)]
struct Slab<const C: usize> {
    /// ρ below ½, and above.
    rho: [f64; 2],
    /// w(y) = 1 + `slope` (y − ½).
    slope: f64,
    open: f64,
    colours: [f64; C],
    /// Whether the size of k is told.
    sized: bool,
}

const SLAB: Slab<1> = Slab {
    rho: [0.0, 0.9],
    slope: 0.0,
    open: 0.0,
    colours: [1.0],
    sized: true,
};

impl<const C: usize> Slab<C> {
    fn rho(&self, x: f64) -> f64 {
        self.rho[usize::from(x >= 0.5)]
    }

    /// u(x) in a channel: m = ∫ w u p = (1 − open) (1 + m colour ∫ w ρ).
    fn solution(&self, channel: usize, x: f64) -> f64 {
        let (stays, colour) = (1.0 - self.open, self.colours[channel]);
        let [low, high] = self.rho;
        let of_rho = 0.5 * (low + high) + 0.125 * self.slope * (high - low);
        let m = stays / (1.0 - stays * colour * of_rho);
        1.0 + colour * self.rho(x) * m
    }
}

impl<const C: usize> Space for Slab<C> {
    type Scalar = f64;
    type Point = f64;
}
impl<const C: usize> Chain for Slab<C> {
    fn step<U: Uniforms<f64>>(&self, _: &f64, uniforms: &mut U) -> Option<f64> {
        let xi = uniforms.uniform();
        (xi >= self.open).then(|| (xi - self.open) / (1.0 - self.open))
    }
}
impl<const C: usize> Equation for Slab<C> {
    type Value = Channels<f64, C>;
    fn kernel(&self, x: &f64, y: &f64) -> Self::Value {
        let k = self.rho(*x) * (1.0 + self.slope * (y - 0.5));
        Channels::from_fn(C, |c| self.colours[c] * k)
    }
    fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> Self::Value {
        Channels::splat(C, 1.0)
    }
    fn channels(&self) -> usize {
        C
    }
    fn size(&self, x: &f64) -> f64 {
        if self.sized { self.rho(*x) } else { 1.0 }
    }
}

/// The slab with numbers for values.
struct Scalars(Slab<1>);
impl Space for Scalars {
    type Scalar = f64;
    type Point = f64;
}
impl Chain for Scalars {
    fn step<U: Uniforms<f64>>(&self, x: &f64, uniforms: &mut U) -> Option<f64> {
        self.0.step(x, uniforms)
    }
}
impl Equation for Scalars {
    type Value = f64;
    fn kernel(&self, x: &f64, y: &f64) -> f64 {
        self.0.kernel(x, y).get(0)
    }
    fn source<U: Uniforms<f64>>(&self, _: &f64, _: &mut U) -> f64 {
        1.0
    }
    fn size(&self, x: &f64) -> f64 {
        self.0.size(x)
    }
}

/// v = 2 in every channel, with h = 0.4: where walls are black, too, and k is 0.
struct Flat {
    channels: usize,
    open: f64,
    /// What G is instead where x ≥ 0.99.
    wild: f64,
}

const FLAT: Flat = Flat {
    channels: 1,
    open: 0.0,
    wild: 0.0,
};

impl Flat {
    fn splat<V: Value<f64>>(&self, x: f64) -> V {
        V::splat(self.channels, x)
    }
}

/// The neighbour equation of values V.
struct FlatOf<'a, V>(&'a Flat, core::marker::PhantomData<fn() -> V>);
impl<V> Space for FlatOf<'_, V> {
    type Scalar = f64;
    type Point = f64;
}
impl<V: Value<f64>> Neighbour for FlatOf<'_, V> {
    type Value = V;
    fn locate(&self, x: f64) -> Located<f64> {
        Located { point: x, cell: 0 }
    }
    fn kernel(&self, _: &Located<f64>, _: &Located<f64>, _: &V) -> V {
        self.0.splat(0.4)
    }
    fn source(&self, x: &Located<f64>, _: &mut dyn Uniforms<f64>) -> V {
        let g = 2.0 - 0.8 * (1.0 - self.0.open);
        self.0
            .splat(if x.point >= 0.99 { g + self.0.wild } else { g })
    }
    fn value(&self, _: &Located<f64>) -> V {
        self.0.splat(2.0)
    }
}

const WALKS: u64 = 100_000;
const X: f64 = 0.8;

/// How walks end, and in which form they score.
fn all_options() -> impl Iterator<Item = WalkOptions> {
    let constant = |estimator| Absorption::Constant {
        probability: 0.3,
        estimator,
    };
    let ends = [
        Absorption::Roulette,
        constant(Estimator::Absorption),
        constant(Estimator::Collision),
    ];
    ends.into_iter().flat_map(|absorption| {
        let forms = [(Form::Product, 0), (Form::Residual, 0), (Form::Residual, 3)];
        forms.map(|(form, forced_steps)| WalkOptions {
            absorption,
            form,
            forced_steps,
            ..WalkOptions::default()
        })
    })
}

/// Batches of the channels of u(X), and of a sum if there are weights.
fn run<E, N, T, const S: usize>(
    equation: &E,
    neighbour: &N,
    goal: Goal<T, WideOf<E>>,
    options: WalkOptions,
    weights: &[f64],
) -> [Batch; S]
where
    E: Equation<Scalar = f64, Point = f64> + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
    WideOf<E>: Sync,
{
    let goals = [goal];
    let job = Goals::new(equation, neighbour, &goals, options).with_sum(weights);
    assert_eq!((job.goals(), job.shared()), (S, S));
    let mut batches = [Batch::new(0, WALKS, WALKS); S];
    // In pieces, which change nothing.
    job.run(0, &mut batches, 70).unwrap();
    job.run(0, &mut batches, u64::MAX).unwrap();
    batches
}

/// Both means are within 4.9 standard errors of what is exact, and what the neighbour equation scores is of (v, Φ).
fn assert_means(batch: &Batch, exact: f64, what: &dyn core::fmt::Debug) {
    let statistics = batch.statistics();
    let all = [
        (statistics.plain(), exact),
        (statistics.preconditioned(), exact),
        (statistics.control(), 0.0),
    ];
    for (of, exact) in all {
        let off = (of.estimate - exact).abs();
        let error = of.std_error.unwrap();
        assert!(off < 4.9 * error + 1e-12, "{what:?}: {of:?} {exact}");
    }
}

/// Black walls, white ones with an open end, and weights that grow and change their sign: no end is a bias.
#[test]
fn whatever_ends_walks_leaves_the_mean() {
    let open = Slab {
        rho: [1.0, 1.0],
        open: 0.3,
        ..SLAB
    };
    let large = Slab {
        rho: [0.1, 1.3],
        ..SLAB
    };
    // From −0.2 to 1.2 at ρ = 0.7.
    let signed = Slab {
        rho: [0.3, 0.5],
        slope: 4.0,
        ..SLAB
    };
    for slab in [SLAB, open, large, signed] {
        for (options, sized) in all_options().flat_map(|o| [(o, true), (o, false)]) {
            let slab = Slab { sized, ..slab };
            let flat = Flat {
                open: slab.open,
                ..FLAT
            };
            let flat = FlatOf(&flat, core::marker::PhantomData);
            let goal = Goal::new(At(X), Some(2.0));
            let [batch] = run(&Scalars(slab), &flat, goal, options, &[]);
            let what = (slab.rho, slab.slope, sized, options);
            assert_means(&batch, slab.solution(0, X), &what);
        }
    }
}

/// If k depends on x alone, roulette by its size is the analogue walk: every state scores with weight 1, and a black wall is the
/// end.
#[test]
fn roulette_is_the_analogue_walk() {
    let white = Slab {
        rho: [0.0, 1.0],
        ..SLAB
    };
    let open = Slab {
        rho: [1.0, 1.0],
        open: 0.3,
        ..SLAB
    };
    for slab in [SLAB, white, open] {
        let (equation, goals) = (Scalars(slab), [Goal::new(At(X), Some(0.0))]);
        let none = NoNeighbour::new(&equation);
        let job = Goals::new(&equation, &none, &goals, WalkOptions::default());
        let mut states = 0;
        for number in 0..1000 {
            let walk = job.replay(0, number).unwrap();
            assert_eq!(walk.plain, f64::from(walk.states));
            let end = if slab.open > 0.0 {
                Termination::Left
            } else {
                Termination::Absorbed
            };
            assert_eq!(walk.termination, end);
            states += walk.states;
        }
        // Their number is u, from whose mean this is four standard deviations or more.
        let mean = f64::from(states) / 1000.0;
        assert!((mean - slab.solution(0, X)).abs() < 0.35, "{mean}");
    }
}

/// Channels of several colours, of which starts know a part, and their sum.
#[test]
fn one_walk_estimates_all_channels_and_their_sum() {
    /// The value in a point, of which every second start knows 1: ½ in the mean.
    struct Half(f64);
    impl Functional<Slab<3>> for Half {
        fn start<U: Uniforms<f64>>(&self, _: &Slab<3>, uniforms: &mut U) -> StartOf<Slab<3>> {
            let known = if uniforms.uniform() < 0.5 { 1.0 } else { 0.0 };
            Start {
                point: self.0,
                phi: 1.0,
                known: Channels::splat(3, known),
            }
        }
    }
    let slab = Slab {
        rho: [0.3, 0.9],
        slope: 0.5,
        open: 0.1,
        colours: [0.4, 1.1, 0.0],
        sized: true,
    };
    let flat = Flat {
        channels: 3,
        open: slab.open,
        ..FLAT
    };
    let flat = FlatOf(&flat, core::marker::PhantomData);
    for options in all_options() {
        for control_mean in [None, Some(Channels::splat(3, 2.0))] {
            let goal = Goal {
                functional: Half(X),
                control_mean,
                known: Channels::from_fn(3, |c| c as f64),
            };
            let weights = [0.25, 2.0, -1.0];
            let batches: [Batch; 4] = run(&slab, &flat, goal, options, &weights);
            let exact: [f64; 3] = from_fn(|c| slab.solution(c, X) + 0.5 + c as f64);
            let sum = exact
                .iter()
                .zip(weights)
                .map(|(u, weight)| u * weight)
                .sum();
            for (batch, exact) in batches.iter().zip(exact.into_iter().chain([sum])) {
                assert_means(batch, exact, &options);
            }
        }
    }
}

/// If all channels are equal, each has the bits of a walk of numbers, and so has a sum of one of them.
#[test]
fn equal_channels_have_the_bits_of_a_number() {
    let slab = Slab { slope: 0.5, ..SLAB };
    let colours = Slab {
        rho: slab.rho,
        slope: slab.slope,
        open: slab.open,
        colours: [1.0; 5],
        sized: slab.sized,
    };
    let many = Flat {
        channels: 5,
        ..FLAT
    };
    for options in all_options() {
        let flat = FlatOf(&FLAT, core::marker::PhantomData);
        let alone: [Batch; 1] = run(
            &Scalars(slab),
            &flat,
            Goal::new(At(X), Some(2.0)),
            options,
            &[],
        );
        let goal = Goal {
            functional: At(X),
            control_mean: Some(Channels::splat(5, 2.0)),
            known: Channels::splat(5, 0.0),
        };
        let weights = [0.0, 1.0, 0.0, 0.0, 0.0];
        let flat = FlatOf(&many, core::marker::PhantomData);
        let all: [Batch; 6] = run(&colours, &flat, goal, options, &weights);
        assert_eq!(all, [alone[0]; 6], "{options:?}");
    }
}

/// A walk that scores an infinity is in no batch.
#[test]
fn a_score_that_is_not_finite_leaves_all_batches_before_it() {
    let wild = Flat {
        channels: 1,
        wild: f64::INFINITY,
        ..FLAT
    };
    let slab = Slab {
        rho: [0.5, 0.5],
        ..SLAB
    };
    let flat = FlatOf(&wild, core::marker::PhantomData);
    let goals = [Goal {
        functional: At(0.5),
        control_mean: None,
        known: Channels::splat(1, 0.0),
    }];
    let job = Goals::new(&slab, &flat, &goals, WalkOptions::default()).with_sum(&[1.0]);
    let mut batches = [Batch::new(0, 10_000, 10_000); 2];
    let wrong = job.run(0, &mut batches, u64::MAX).unwrap_err();
    assert!(wrong.walk > 0);
    let walk = job.replay(0, wrong.walk).unwrap();
    assert_eq!(walk.termination, Termination::NotFinite);
    for batch in &batches {
        assert_eq!(batch.statistics().walks(), wrong.walk);
    }
}
