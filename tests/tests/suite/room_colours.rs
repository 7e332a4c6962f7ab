//! Rooms in several channels: furnaces, the neighbour equations from one ray, and what their variances are beside those of walks of
//! one channel.

use fredholm_core::channels::{ChannelFunctional, ChannelGoal, ChannelGoals, ChannelNeighbours};
use fredholm_core::galerkin::Partition as _;
use fredholm_core::{
    Batch, Estimator, Functional, Job, Located, NoNeighbour, Real, RngUniforms, Statistics,
    Uniforms, WalkOptions, WalkSeeds,
};
use fredholm_room::{
    ChannelControl, ChannelRaySetup, ChannelRayTables, ColouredRays, ColouredRoom, DirectLight,
    Grading, Material, Matrix, MeanOver, Mesh, Point, Room, RoomError, Scene, Tables, WallColours,
};
use fredholm_tests::check::long;
use fredholm_tests::room::{Drawing, random};

const CHANNELS: usize = 3;
/// The absorption probability q0.
const ABSORPTION: f64 = 0.3;
/// u of furnaces in every channel.
const U: [f64; CHANNELS] = [1.0, 2.0, 0.5];
const WEIGHTS: [f64; CHANNELS] = [0.2126, 0.7152, 0.0722];
/// Standard errors that are allowed: hardly one of all tests of all time is beyond.
const STANDARD_ERRORS: f64 = 4.9;

/// A room in colours.
struct Colours {
    scene: Scene,
    reflectances: Vec<f64>,
    emissions: Vec<f64>,
}

/// Reflectances and emissions of a surface.
type OfSurface = [[f64; CHANNELS]; 2];

impl Colours {
    fn new<F: Real>(drawing: Drawing, mut of: impl FnMut(usize) -> OfSurface) -> Self {
        let own: Vec<OfSurface> = (0..drawing.surfaces.len()).map(&mut of).collect();
        let largest = |all: [f64; CHANNELS]| all.into_iter().fold(0.0, f64::max);
        let drawing = drawing.with(|s| Material {
            reflectance: largest(own[s][0]),
            emission: largest(own[s][1]),
        });
        let scene = drawing.scene::<F>().unwrap();
        let walls = 0..scene.geometry().walls().len();
        let surfaces: Vec<usize> = walls
            .map(|wall| scene.place(wall).unwrap().surface)
            .collect();
        let of = |k: usize| surfaces.iter().flat_map(|&s| own[s][k]).collect();
        Self {
            reflectances: of(0),
            emissions: of(1),
            scene,
        }
    }

    /// A random room, whose surfaces reflect each channel differently and emit what makes u_c = U_c.
    fn furnace<F: Real>(seed: u64) -> Self {
        let mut draws = RngUniforms(<WalkSeeds>::new(seed, 77).generator(0));
        Self::new::<F>(random(seed), |_| {
            let rho: [f64; CHANNELS] =
                core::array::from_fn(|_| 0.9 * Uniforms::<f64>::uniform(&mut draws));
            [rho, core::array::from_fn(|c| (1.0 - rho[c]) * U[c])]
        })
    }

    /// A random room with saturated colours: every surface reflects one channel well and the others little, and the lamp, and every
    /// fifth surface, emits a colour of its own.
    fn saturated(seed: u64) -> Self {
        let mut draws = RngUniforms(<WalkSeeds>::new(seed, 78).generator(0));
        let drawing = random(seed);
        let lamps: Vec<bool> = drawing
            .surfaces
            .iter()
            .map(|(_, m)| m[0].emission > 0.0)
            .collect();
        Self::new::<f64>(drawing, |surface| {
            let mut uniform = || Uniforms::<f64>::uniform(&mut draws);
            let bright = (3.0 * uniform()) as usize;
            let rho = core::array::from_fn(|c| if c == bright { 0.8 } else { 0.05 });
            let emits = if lamps[surface] || surface % 5 == 4 {
                1.0
            } else {
                0.0
            };
            [rho, core::array::from_fn(|_| emits * uniform() * uniform())]
        })
    }

    fn walls(&self) -> WallColours<'_, f64> {
        WallColours::new(CHANNELS, (&self.reflectances, &self.emissions)).unwrap()
    }

    /// The walls that emit, if the last step leads there.
    fn lights(&self, last_step: bool) -> Vec<u32> {
        let walls = (0..).zip(self.scene.geometry().walls());
        let emitting = walls.filter(|(_, wall)| last_step && wall.emission > 0.0);
        emitting.map(|(number, _)| number).collect()
    }

    /// Tables of rays and v of about so many cells with B functions.
    fn solved<const B: usize>(&self, cells: usize, last_step: bool) -> Solved<'_> {
        let mesh = Mesh::new::<f64>(&self.scene, cells, Grading::default()).unwrap();
        let matrix = Matrix::with_functions(&self.scene, &mesh, 0.5, B).unwrap();
        let solutions = matrix
            .solve_channels(&self.scene, &mesh, &self.walls(), 1e-14, 1000)
            .unwrap();
        let mut v: Vec<f64> = (0..mesh.len())
            .flat_map(|cell| {
                solutions
                    .iter()
                    .map(move |own| &own.v[B * cell..B * (cell + 1)])
            })
            .flatten()
            .copied()
            .collect();
        let lights = self.lights(last_step);
        let tables = Tables::<f64>::new(&self.scene, &mesh);
        let room = Room::new(
            tables.geometry(),
            tables.cells(),
            matrix.views(),
            ABSORPTION,
        )
        .unwrap();
        let room = room.with_lights(&lights).unwrap();
        let coloured = ColouredRoom::new(&room, self.walls()).unwrap();
        if last_step {
            let polynomials = room.with_functions::<B>();
            for (cell, own) in v.chunks_exact_mut(CHANNELS * B).enumerate() {
                let mut emission = [0.0; CHANNELS];
                coloured.emission_of_light(room.table().wall(cell).unwrap(), &mut emission);
                for (first, emission) in own.iter_mut().step_by(B).zip(emission) {
                    *first -= emission;
                }
                polynomials.subtract_light(&coloured, cell, own);
            }
        }
        let setup = ChannelRaySetup::<B>::new(&coloured, &v).unwrap();
        let cells = (0..mesh.len()).map(|cell| setup.cell(cell));
        let rays =
            ChannelRayTables::new(cells.collect::<Result<_, _>>().unwrap(), CHANNELS).unwrap();
        let direct = match lights.as_slice() {
            [] => Vec::new(),
            lights => DirectLight::of_channels(&self.scene, lights, &self.walls()).unwrap(),
        };
        Solved {
            colours: self,
            mesh,
            matrix,
            v,
            lights,
            rays,
            direct,
        }
    }
}

/// Everything deterministic about a room in colours.
struct Solved<'c> {
    colours: &'c Colours,
    mesh: Mesh,
    matrix: Matrix<'static>,
    v: Vec<f64>,
    lights: Vec<u32>,
    rays: ChannelRayTables<f64>,
    direct: Vec<DirectLight>,
}

/// What is done with a room, its neighbour equations, and the mean over all its walls.
type Then<'t, F, const B: usize> =
    dyn FnMut(&ColouredRoom<'_, '_, F>, &ColouredRays<'_, '_, '_, F, B>, &MeanOver<'_, '_, F>) + 't;

impl Solved<'_> {
    fn with<F: Real, const B: usize>(&self, then: &mut Then<'_, F, B>) {
        let tables = Tables::<F>::new(&self.colours.scene, &self.mesh);
        let (geometry, cells) = (tables.geometry(), tables.cells());
        let room = Room::new(geometry, cells, self.matrix.views(), ABSORPTION).unwrap();
        let room = room.with_lights(&self.lights).unwrap();
        let rounded = |all: &[f64]| all.iter().map(|&x| F::from_f64(x)).collect::<Vec<F>>();
        let (reflectances, emissions) = (
            rounded(&self.colours.reflectances),
            rounded(&self.colours.emissions),
        );
        let walls = WallColours::new(CHANNELS, (&reflectances, &emissions)).unwrap();
        let coloured = ColouredRoom::new(&room, walls).unwrap();
        let v = rounded(&self.v);
        let rays = self.rays.rounded::<F>().unwrap();
        let all = 0..geometry.walls().len();
        let mean = MeanOver::new(&room, tables.lengths(), all).unwrap();
        then(
            &coloured,
            &rays.neighbours::<B>(&coloured, &v).unwrap(),
            &mean,
        );
    }

    /// (F_s,c, Φ) and (v_c, Φ) of the mean over all walls in every channel.
    fn means<const B: usize>(&self, mean: &dyn Fn(&[f64]) -> f64) -> [Vec<f64>; 2] {
        let walls = 0..self.colours.scene.geometry().walls().len();
        let known = match &*self.direct {
            [] => vec![0.0; CHANNELS],
            all => all.iter().map(|own| own.emission(walls.clone())).collect(),
        };
        let of = |channel: usize| {
            let own = self.v.chunks_exact(B).skip(channel).step_by(CHANNELS);
            let own: Vec<f64> = own.flatten().copied().collect();
            let reflected = self.direct.get(channel);
            mean(&own) + reflected.map_or(0.0, |own| own.reflected(walls.clone()))
        };
        [known, (0..CHANNELS).map(of).collect()]
    }
}

/// The mean over all walls as a functional of all channels.
struct InColours<'m, 'r, 'a, F>(&'m MeanOver<'r, 'a, F>);

impl<'r, 'a, F: Real> ChannelFunctional<ColouredRoom<'r, 'a, F>> for InColours<'_, '_, 'a, F> {
    fn start<D: Uniforms<F>>(
        &self,
        _: &ColouredRoom<'r, 'a, F>,
        uniforms: &mut D,
        known: &mut [F],
    ) -> (Point<F>, F) {
        known.fill(F::from_f64(0.0));
        Functional::<Room<'a, F>>::start(self.0, uniforms)
    }
}

/// All channels and their weighted sum, by walks that share their steps.
fn walk_all<F: Real, N>(
    coloured: &ColouredRoom<'_, '_, F>,
    neighbours: &N,
    (mean, [known, means]): (&MeanOver<'_, '_, F>, &[Vec<f64>; 2]),
    (estimator, walks): (Estimator, u64),
) -> Vec<Statistics>
where
    N: ChannelNeighbours<Scalar = F, Point = Point<F>> + Sync,
{
    let job = ChannelGoals {
        equations: coloured,
        neighbours,
        goals: &[ChannelGoal {
            functional: InColours(mean),
            control_means: Some(means),
            known,
        }],
        weights: &WEIGHTS,
        options: WalkOptions {
            estimator,
            ..WalkOptions::default()
        },
    };
    let mut batches = vec![Batch::new(0, walks, walks); job.shared()];
    job.run_shared(0, &mut batches, u64::MAX).unwrap();
    batches.iter().map(|batch| *batch.statistics()).collect()
}

fn seeds() -> core::ops::Range<u64> {
    0..if long() { 40 } else { 4 }
}

const ESTIMATORS: [Estimator; 2] = [Estimator::Absorption, Estimator::Collision];

/// F_c = (1 − ρ_c) U_c gives u_c = U_c in every room, plain and preconditioned, with and without a last step to the light.
#[test]
fn furnaces_in_colours() {
    fn check_in<F: Real, const B: usize>(seed: u64) {
        let furnace = Colours::furnace::<F>(seed);
        let sum: f64 = U.iter().zip(WEIGHTS).map(|(u, weight)| u * weight).sum();
        for last_step in [false, true] {
            let solved = furnace.solved::<B>(60, last_step);
            solved.with::<F, B>(&mut |coloured, rays, mean| {
                let rounded = |v: &[f64]| v.iter().map(|&v| F::from_f64(v)).collect::<Vec<F>>();
                let means = solved.means::<B>(&|v| mean.of(&rounded(v)));
                let dark = [means[0].clone(), vec![0.0; CHANNELS]];
                let none = NoNeighbour::<ColouredRoom<'_, '_, F>>::new();
                for estimator in ESTIMATORS {
                    let all = walk_all(coloured, rays, (mean, &means), (estimator, 2000));
                    let alone = walk_all(coloured, &none, (mean, &dark), (estimator, 2000));
                    for ((all, alone), u) in all.iter().zip(&alone).zip(U.into_iter().chain([sum]))
                    {
                        // The neighbour equation changes no walk.
                        assert_eq!(alone.plain(), all.plain());
                        let rounding = 3e2 * F::EPSILON.to_f64();
                        for of in [all.plain(), all.preconditioned()] {
                            let allowed = STANDARD_ERRORS * of.std_error.unwrap() + rounding;
                            assert!(
                                (of.estimate - u).abs() < allowed,
                                "seed {seed}: {of:?} for {u}"
                            );
                        }
                    }
                }
            });
        }
    }
    for seed in seeds() {
        check_in::<f64, 1>(seed);
        check_in::<f64, 3>(seed);
        check_in::<f32, 2>(seed);
    }
}

/// The means of what one ray tells of all G_c are those by form factors; tables of which one number is wrong are found.
#[test]
fn what_is_drawn_has_the_mean_that_it_should() {
    const DRAWS: u32 = 20_000;
    /// The largest difference from the mean over what is allowed, in six points.
    fn largest<N>(
        solved: &Solved<'_>,
        coloured: &ColouredRoom<'_, '_, f64>,
        rays: &N,
        seed: u64,
    ) -> f64
    where
        N: ChannelNeighbours<Scalar = f64, Point = Point<f64>>,
    {
        let room = coloured.room();
        let polynomials = room.with_functions::<2>();
        let mut draws = RngUniforms(<WalkSeeds>::new(seed, 0).generator(0));
        let mut worst: f64 = 0.0;
        for place in 0..6 {
            let cell = place * (solved.mesh.len() - 1) / 5;
            let point = room.inside(cell, draws.uniform()).unwrap();
            let x = Located { point, cell };
            let mut values = [0.0; CHANNELS];
            rays.values(&x, &mut values);
            let reflectances = coloured.colours().reflectances(point.wall());
            let exact: Vec<f64> = (0..CHANNELS)
                .map(|channel| {
                    let own = solved.v.chunks_exact(2).skip(channel).step_by(CHANNELS);
                    let own: Vec<f64> = own.flatten().copied().collect();
                    values[channel]
                        - reflectances[channel] * polynomials.irradiance_of(&point, &own)
                })
                .collect();
            let (mut sums, mut squares) = ([0.0; CHANNELS], [0.0; CHANNELS]);
            for _ in 0..DRAWS {
                let mut drawn = [0.0; CHANNELS];
                rays.sources(&x, &mut draws, &mut drawn);
                let off = drawn.iter().zip(&exact).map(|(drawn, exact)| drawn - exact);
                for ((sum, square), off) in sums.iter_mut().zip(&mut squares).zip(off) {
                    *sum += off;
                    *square += off * off;
                }
            }
            let n = f64::from(DRAWS);
            for (sum, square) in sums.iter().zip(squares) {
                let allowed = STANDARD_ERRORS * (square / n / n).sqrt() + 1e-12;
                worst = worst.max((sum / n).abs() / allowed);
            }
        }
        worst
    }
    for seed in seeds() {
        let colours = Colours::saturated(seed);
        let solved = colours.solved::<2>(60, false);
        solved.with::<f64, 2>(&mut |coloured, rays, _| {
            let off = largest(&solved, coloured, rays, seed);
            assert!(off < 1.0, "seed {seed}: {off}");
            // Each table is needed, in every channel.
            let control = solved.rays.control();
            let wrong = |integrals: f64, controls: f64| {
                let scaled =
                    |all: &[f64], by: f64| all.iter().map(|x| by * x).collect::<Vec<f64>>();
                let integrals = scaled(control.integrals, integrals);
                let controls = scaled(control.controls, controls);
                let spoiled = ChannelControl {
                    integrals: &integrals,
                    controls: &controls,
                    ..control
                };
                let rays = ColouredRays::<f64, 2>::new(coloured, &solved.v, spoiled).unwrap();
                largest(&solved, coloured, &rays, seed)
            };
            assert!(wrong(1.0, 1.0) < 1.0);
            for (integrals, controls) in [(1.05, 1.0), (1.0, 0.95)] {
                let off = wrong(integrals, controls);
                assert!(off > 1.0, "seed {seed}: {off}");
            }
        });
    }
}

/// With saturated colours a channel has at most 1.5 times the variance that the same walks have with boxes of its own, in nine cases of
/// ten, and never twice as much: the noise of rays is a quarter of the variance, and three channels that are noisy in different boxes
/// share the rays.
#[test]
fn a_shared_ray_costs_a_channel_little_variance() {
    const WALKS: u64 = 20_000;
    let mut ratios = Vec::new();
    for seed in seeds() {
        let colours = Colours::saturated(seed);
        for last_step in [false, true] {
            let variances = |colours: &Colours| -> Vec<f64> {
                let solved = colours.solved::<3>(80, last_step);
                let mut all = Vec::new();
                solved.with::<f64, 3>(&mut |coloured, rays, mean| {
                    let means = solved.means::<3>(&|v| mean.of(v));
                    let run = (Estimator::Collision, WALKS);
                    let walked = walk_all(coloured, rays, (mean, &means), run);
                    let of = |own: &Statistics| own.preconditioned().std_error.unwrap().powi(2);
                    all = walked.iter().map(of).collect();
                });
                all
            };
            let shared = variances(&colours);
            for channel in 0..CHANNELS {
                // The other channels are those of this one, so that boxes are its own.
                let copied = |all: &[f64]| -> Vec<f64> {
                    all.chunks_exact(CHANNELS)
                        .flat_map(|own| [own[channel]; CHANNELS])
                        .collect()
                };
                let alone = Colours {
                    scene: colours.scene.clone(),
                    reflectances: copied(&colours.reflectances),
                    emissions: copied(&colours.emissions),
                };
                ratios.push(shared[channel] / variances(&alone)[channel]);
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    let last = ratios.len() - 1;
    assert!(
        ratios[last * 9 / 10] < 1.5 && ratios[last] < 2.0,
        "{ratios:?}"
    );
}

/// Tables and colours of another room or of other channels are refused.
#[test]
fn what_does_not_belong_together_is_refused() {
    let numbers = [0.5; 8];
    let channels = |channels| WallColours::new(channels, (&numbers, &numbers));
    assert!(matches!(
        channels(0),
        Err(RoomError::Channels { channels: 0 })
    ));
    assert!(matches!(channels(129), Err(RoomError::Channels { .. })));
    assert!(matches!(channels(3), Err(RoomError::Length { .. })));
    let uneven = WallColours::new(2, (&numbers, &numbers[2..]));
    assert!(matches!(
        uneven,
        Err(RoomError::Length {
            expected: 8,
            found: 6
        })
    ));

    let colours = Colours::furnace::<f64>(1);
    let solved = colours.solved::<1>(30, false);
    solved.with::<f64, 1>(&mut |coloured, _, _| {
        let other = WallColours::new(2, (&numbers, &numbers)).unwrap();
        assert!(matches!(
            ColouredRoom::new(coloured.room(), other),
            Err(RoomError::Length { .. })
        ));
        let control = solved.rays.control();
        let short = ChannelControl {
            means: &control.means[1..],
            ..control
        };
        for refused in [
            ColouredRays::<f64, 1>::new(coloured, &solved.v[1..], control).map(drop),
            ColouredRays::<f64, 1>::new(coloured, &solved.v, short).map(drop),
            ChannelRaySetup::<1>::new(coloured, &solved.v[1..]).map(drop),
        ] {
            assert!(
                matches!(refused, Err(RoomError::Length { .. })),
                "{refused:?}"
            );
        }
        assert_eq!(coloured.room().cells(), solved.mesh.len());
    });
}
