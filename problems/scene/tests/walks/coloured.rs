//! Walks in several channels against exact answers.

use fredholm_core::channels::{
    ChannelGoal, ChannelGoals, ChannelNeighbours, Channels as _, NothingKnown,
};
use fredholm_core::sampled::{ChannelTables, SampledChannels, SampledSetup, SampledTables};
use fredholm_core::{Job, RandomSource, WalkOptions};
use fredholm_scene::Coloured;

use super::*;

const CHANNELS: usize = 3;
/// u in every channel.
const U: [f64; CHANNELS] = [1.0, 2.0, 0.5];
const WEIGHTS: [f64; CHANNELS] = [0.2126, 0.7152, 0.0722];

/// No source at all.
struct Dark;

impl StateSpace for Dark {
    type Scalar = f64;
    type Point = Point<f64>;
}

impl RandomSource for Dark {
    fn sample_source<D: Uniforms<f64>>(&self, _: &Point<f64>, _: &mut D) -> f64 {
        0.0
    }
}

/// A closed scene in which every surface reflects each channel differently and emits F_c = (1 − ρ_c) U_c, so that u_c = U_c.
struct Furnace {
    scene: Scene,
    factors: Vec<f64>,
    shares: Vec<f64>,
}

impl Furnace {
    fn new<F: Real>(which: usize) -> (String, Self) {
        let mut rng = ChaCha8Rng::seed_from_u64(100 + which as u64);
        let (name, surfaces) = closed_scenes().swap_remove(which);
        let rho: Vec<[f64; CHANNELS]> = surfaces
            .iter()
            .map(|_| core::array::from_fn(|_| 0.9 * rng.random::<f64>()))
            .collect();
        let emission = |s: usize| core::array::from_fn(|c| (1.0 - rho[s][c]) * U[c]);
        let largest = |all: [f64; CHANNELS]| all.into_iter().fold(0.0, f64::max);
        let scene = scene::<F>(&surfaces, |s| Material {
            reflectance: largest(rho[s]),
            emission: largest(emission(s)),
        });
        let (mut factors, mut shares) = (Vec::new(), Vec::new());
        for face in 0..scene.faces().len() {
            let s = scene.place(face).unwrap().surface;
            let emission: [f64; CHANNELS] = emission(s);
            factors.extend(rho[s].map(|own| own / largest(rho[s])));
            shares.extend(emission.map(|own| own / largest(emission)));
        }
        let furnace = Self {
            scene,
            factors,
            shares,
        };
        (name, furnace)
    }

    /// The tables of all channels from one set-up.
    fn tables<F: Real, const B: usize>(&self, cells: usize) -> ChannelTables<F> {
        let scene = &self.scene;
        let (geometry, cells) = (Tables::new(scene), Cells::new(scene, cells).unwrap());
        let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
        let coloured = Coloured::new(radiosity, CHANNELS, (&self.factors, &self.shares)).unwrap();
        let setup = SampledSetup::<_, _, 2, B, _> {
            problem: &radiosity,
            source: &Dark,
            events: &radiosity,
            options: SetupOptions {
                samples: 256,
                ..SetupOptions::default()
            },
        };
        let solutions = setup.of_channels(&coloured).unwrap();
        let tables: Vec<SampledTables<F>> = solutions
            .iter()
            .map(|own| own.for_walks().unwrap())
            .collect();
        ChannelTables::new(&tables, B, 2).unwrap()
    }
}

/// The mean over all faces of every channel, and of their weighted sum, by walks that share their steps.
fn walk_all<F: Real, N>(
    coloured: &Coloured<'_, F>,
    neighbours: &N,
    (functional, known): (&Everywhere<F>, &[f64]),
    estimator: Estimator,
) -> Vec<Statistics>
where
    N: ChannelNeighbours<Scalar = F, Point = Point<F>> + Sync,
{
    let job = ChannelGoals {
        equations: coloured,
        neighbours,
        goals: &[ChannelGoal {
            functional: NothingKnown(Shared(functional)),
            control_means: None,
            known,
        }],
        weights: &WEIGHTS,
        options: WalkOptions {
            estimator,
            ..WalkOptions::default()
        },
    };
    let mut batches = vec![Batch::new(0, 1000, 1000); job.shared()];
    job.run_shared(0, &mut batches, u64::MAX).unwrap();
    batches.iter().map(|batch| *batch.statistics()).collect()
}

struct Shared<'a, F>(&'a Everywhere<F>);

impl<F: Real, E> Functional<E> for Shared<'_, F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    fn start<D: Uniforms<F>>(&self, uniforms: &mut D) -> (Point<F>, F) {
        Functional::<E>::start(self.0, uniforms)
    }
}

/// F_c = (1 − ρ_c) U_c gives u_c = U_c in any closed scene, plain and preconditioned, in every channel and in their sum.
#[test]
fn furnaces_in_colours() {
    fn check_in<F: Real, const B: usize>(which: usize) {
        let (name, furnace) = Furnace::new::<F>(which);
        let scene = &furnace.scene;
        let functional = Everywhere::<F>::new(scene);
        let (geometry, cells) = (Tables::<F>::new(scene), Cells::new(scene, 40).unwrap());
        let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
        let shares = radiosity.visible_shares(8);
        let radiosity = radiosity.with_visible_shares(&shares).unwrap();
        let rounded = |table: &[f64]| table.iter().map(|&x| F::from_f64(x)).collect::<Vec<F>>();
        let (factors, of_lights) = (rounded(&furnace.factors), rounded(&furnace.shares));
        let coloured = Coloured::new(radiosity, CHANNELS, (&factors, &of_lights)).unwrap();
        let known = known_means(&radiosity, &furnace.shares);
        let tables = furnace.tables::<F, B>(40);
        let two = NonZeroU32::MIN.saturating_add(1);
        let neighbours =
            SampledChannels::<_, _, _, 2, B>::new((&coloured, &radiosity), &tables, two).unwrap();
        let none = NoNeighbour::<Coloured<'_, F>>::new();
        let sum: f64 = U.iter().zip(WEIGHTS).map(|(u, weight)| u * weight).sum();
        let rounding = 1e3 * F::EPSILON.to_f64();
        for estimator in ESTIMATORS {
            let of = (&functional, &*known);
            let all = walk_all(&coloured, &neighbours, of, estimator);
            let alone = walk_all(&coloured, &none, of, estimator);
            for ((all, alone), expected) in all.iter().zip(&alone).zip(U.into_iter().chain([sum])) {
                check_both(&name, all, 0.0, expected, rounding);
                check(&name, all.control(), expected, expected, rounding);
                assert_eq!(alone.plain(), all.plain());
            }
        }
    }
    for which in [0, 2, 3, 6] {
        check_in::<f64, 1>(which);
        check_in::<f64, 3>(which);
        check_in::<f32, 6>(which);
    }
}

/// The mean over all faces of what lights emit in every channel.
fn known_means<F: Real>(radiosity: &Radiosity<'_, F>, shares: &[f64]) -> Vec<f64> {
    let (mut sums, mut areas) = (vec![0.0; CHANNELS], 0.0);
    for (number, face) in (0..).zip(radiosity.geometry().faces()) {
        let area = face.area.to_f64();
        let own = &shares[number as usize * CHANNELS..][..CHANNELS];
        for (sum, share) in sums.iter_mut().zip(own) {
            *sum += area * share * radiosity.emission_of_light(number).to_f64();
        }
        areas += area;
    }
    sums.into_iter().map(|sum| sum / areas).collect()
}

/// The mean over a face of what a state scores is F_c besides lights, and the light of each colour that arrives there from
/// lights by form factors, behind obstacles, too.
#[test]
fn last_steps_have_the_colours_of_lights() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (_, surfaces) = closed_scenes().swap_remove(2);
    let of = |_: usize| -> [f64; CHANNELS] { core::array::from_fn(|_| rng.random::<f64>()) };
    let colours: Vec<[f64; CHANNELS]> = (0..surfaces.len()).map(of).collect();
    let largest = |s: usize| colours[s].into_iter().fold(0.0, f64::max);
    // Every third surface emits, in the colours that it reflects.
    let size = |s: usize| if s.is_multiple_of(3) { 4.0 } else { 0.0 };
    let scene = scene::<f64>(&surfaces, |s| Material {
        reflectance: 0.3 * largest(s),
        emission: size(s) * largest(s),
    });
    let faces = 0..scene.faces().len();
    let surface: Vec<usize> = faces
        .clone()
        .map(|face| scene.place(face).unwrap().surface)
        .collect();
    let shares: Vec<f64> = surface
        .iter()
        .flat_map(|&s| colours[s].map(|own| own / largest(s)))
        .collect();
    let (geometry, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 40).unwrap());
    let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
    let visible = radiosity.visible_shares(16);
    let radiosity = radiosity.with_visible_shares(&visible).unwrap();
    let coloured = Coloured::new(radiosity, CHANNELS, (&shares, &shares)).unwrap();
    let factors = fredholm_factors::scene_factors(&scene, 1e-9).unwrap();
    let mut lights = 0;
    for face in faces.clone() {
        lights += usize::from(radiosity.emission_of_light(face as u32) > 0.0);
        let expected: [f64; CHANNELS] = core::array::from_fn(|channel| {
            let of_light = |from: usize| {
                let own = colours[surface[from]][channel] / largest(surface[from]);
                own * radiosity.emission_of_light(from as u32)
            };
            let arriving = faces
                .clone()
                .map(|from| factors.factor(face, from) * of_light(from));
            let own = colours[surface[face]][channel];
            0.3 * own * arriving.sum::<f64>() + size(surface[face]) * own - of_light(face)
        });
        let scores = |x: &Point<f64>, draws: &mut Draws| {
            let mut scores = [0.0; CHANNELS];
            coloured.sample_sources(x, draws, &mut scores);
            scores
        };
        check_means(&geometry, face as u32, 2000, scores, expected);
    }
    assert!(lights > 1, "{lights} lights");
}
