//! Rooms in several channels: furnaces, the neighbour equation from one ray, and what its variances are beside those of walks of
//! one channel.

use fredholm_core::{
    Channels, Equation, Estimator, Goal, Goals, LastStep, Located, Neighbour, NeighbourOf,
    NoNeighbour, Real, RngUniforms, Space, Statistics, Uniforms, Value, WalkOptions, WalkSeeds,
};
use fredholm_room::{
    CoarseSolution, ColourTables, Colours as Tints, DirectLight, Grading, Material, MeanOver, Mesh,
    Point, RayControl, RayNeighbour, RaySetup, RayTables, Room, RoomError, Scene, Tables,
    subtract_lights,
};
use fredholm_tests::check::{self, long};
use fredholm_tests::room::{Drawing, random};
use fredholm_tests::{absorbed, all_ways};

const CHANNELS: usize = 3;
/// u of furnaces in every channel.
const U: [f64; CHANNELS] = [1.0, 2.0, 0.5];
const WEIGHTS: [f64; CHANNELS] = [0.2126, 0.7152, 0.0722];
/// Standard errors that are allowed: hardly one of all tests of all time is beyond.
const STANDARD_ERRORS: f64 = 4.9;

/// Numbers of the channels: there is room for one more.
type Numbers<F> = Channels<F, 4>;
/// A room in colours.
type Coloured<'a, F> = Room<'a, F, Tints<'a, F, 4>>;
/// Its means.
type Means<'r, 'a, F> = MeanOver<'r, 'a, F, Tints<'a, F, 4>>;
/// Its neighbour equation.
type Rays<'n, 'a, F, const B: usize> = RayNeighbour<'n, Coloured<'a, F>, F, B>;

/// A room in colours.
struct Colours {
    scene: Scene,
    tables: ColourTables<f64>,
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
        let materials: Vec<[Material; CHANNELS]> = walls
            .map(|wall| {
                let [rho, f] = own[scene.place(wall).unwrap().surface];
                core::array::from_fn(|c| Material {
                    reflectance: rho[c],
                    emission: f[c],
                })
            })
            .collect();
        Self {
            tables: ColourTables::new(CHANNELS, materials.iter().map(|own| &own[..])),
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

    /// The walls that emit, if the last step leads there.
    fn lights(&self, last_step: bool) -> Vec<u32> {
        let walls = (0..).zip(self.scene.geometry().walls());
        let emitting = walls.filter(|(_, wall)| last_step && wall.emission > 0.0);
        emitting.map(|(number, _)| number).collect()
    }

    /// Tables of rays and v of about so many cells with B functions.
    fn solved<const B: usize>(&self, cells: usize, last_step: bool) -> Solved<'_> {
        let mesh = Mesh::new::<f64>(&self.scene, cells, Grading::default()).unwrap();
        let coarse = CoarseSolution::new(&self.scene, cells * B, &self.tables.tint::<4>()).unwrap();
        let lights = self.lights(last_step);
        let tables = Tables::<f64>::new(&self.scene, &mesh);
        let room = tables.room().with_lights(&lights).unwrap();
        let coloured = room.with_colours(self.tables.tint::<4>()).unwrap();
        let mut v = vec![0.0; mesh.len() * CHANNELS * B];
        for (cell, own) in v.chunks_exact_mut(CHANNELS * B).enumerate() {
            coarse.step::<_, B>(&coloured, cell, own);
            subtract_lights::<_, B>(&coloured, cell, own);
        }
        let rays = RaySetup::<_, B>::new(&coloured, &v)
            .unwrap()
            .tables()
            .unwrap();
        let direct = match lights.as_slice() {
            [] => Vec::new(),
            lights => DirectLight::new(&self.scene, lights, &self.tables.tint::<4>()).unwrap(),
        };
        Solved {
            colours: self,
            mesh,
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
    v: Vec<f64>,
    lights: Vec<u32>,
    rays: RayTables<f64>,
    direct: Vec<DirectLight>,
}

impl Solved<'_> {
    fn with<F: Real, R, const B: usize>(
        &self,
        then: impl FnOnce(&Coloured<'_, F>, &Rays<'_, '_, F, B>, &Means<'_, '_, F>) -> R,
    ) -> R {
        let tables = Tables::<F>::new(&self.colours.scene, &self.mesh);
        let room = tables.room();
        let room = room.with_lights(&self.lights).unwrap();
        let rounded = |all: &[f64]| all.iter().map(|&x| F::from_f64(x)).collect::<Vec<F>>();
        let colours = self.colours.tables.rounded::<F>();
        let coloured = room.with_colours(colours.tint()).unwrap();
        let (v, rays) = (rounded(&self.v), self.rays.rounded::<F>().unwrap());
        let neighbour = RayNeighbour::<_, _, B>::new(&coloured, &v, rays.control()).unwrap();
        then(&coloured, &neighbour, &MeanOver::everything(&coloured))
    }

    /// v of a channel.
    fn own<const B: usize>(&self, channel: usize) -> Vec<f64> {
        let own = self.v.chunks_exact(B).skip(channel).step_by(CHANNELS);
        own.flatten().copied().collect()
    }

    /// (F_s,c, Φ) and (v_c, Φ) of the mean over all walls in every channel.
    fn means<F: Real, const B: usize>(&self, mean: &Means<'_, '_, F>) -> [Numbers<f64>; 2] {
        let walls = 0..self.colours.scene.geometry().walls().len();
        let of = |channel: usize, of: &dyn Fn(&DirectLight) -> f64| {
            self.direct.get(channel).map_or(0.0, of)
        };
        [
            Numbers::from_fn(CHANNELS, |c| of(c, &|own| own.emission(walls.clone()))),
            Numbers::from_fn(CHANNELS, |c| {
                let own = self.own::<B>(c).into_iter().map(F::from_f64);
                let own: Vec<F> = own.collect();
                mean.of(&own) + of(c, &|own| own.reflected(walls.clone()))
            }),
        ]
    }

    /// All channels and their weighted sum, by walks that share their steps: with the neighbour equation, and with none.
    fn walk<F: Real, const B: usize>(
        &self,
        coloured: &Coloured<'_, F>,
        rays: &Rays<'_, '_, F, B>,
        mean: &Means<'_, '_, F>,
        options: WalkOptions,
        walks: u64,
    ) -> [Vec<Statistics>; 2] {
        let means = self.means::<F, B>(mean);
        if self.lights.is_empty() {
            walk_all(coloured, rays, (mean, means), options, walks)
        } else {
            walk_all(&LastStep(coloured), rays, (mean, means), options, walks)
        }
    }
}

fn walk_all<F, E, N>(
    equation: &E,
    neighbour: &N,
    (mean, [known, value]): (&Means<'_, '_, F>, [Numbers<f64>; 2]),
    options: WalkOptions,
    walks: u64,
) -> [Vec<Statistics>; 2]
where
    F: Real,
    E: Equation<Value = Numbers<F>> + Space<Scalar = F, Point = Point<F>> + Sync,
    N: NeighbourOf<E> + Sync,
{
    let goals = |value| {
        [Goal {
            functional: mean.clone(),
            control_mean: Some(value),
            known,
        }]
    };
    let own = goals(value);
    let job = Goals::new(equation, neighbour, &own, options).with_sum(&WEIGHTS);
    let (none, dark) = (
        NoNeighbour::new(equation),
        goals(Numbers::splat(CHANNELS, 0.0)),
    );
    let plain = Goals::new(equation, &none, &dark, options).with_sum(&WEIGHTS);
    [check::run(&job, walks), check::run(&plain, walks)]
}

fn seeds() -> core::ops::Range<u64> {
    0..if long() { 40 } else { 2 }
}

/// F_c = (1 − ρ_c) U_c gives u_c = U_c in every room, plain and preconditioned, with and without a last step to the light.
#[test]
fn furnaces_in_colours() {
    fn check_in<F: Real, const B: usize>(seed: u64) {
        let furnace = Colours::furnace::<F>(seed);
        let (cells, walks) = if long() { (60, 2000) } else { (30, 500) };
        let sum: f64 = U.iter().zip(WEIGHTS).map(|(u, weight)| u * weight).sum();
        for last_step in [false, true] {
            let solved = furnace.solved::<B>(cells, last_step);
            solved.with::<F, _, B>(|coloured, rays, mean| {
                for options in all_ways(1) {
                    let [all, alone] = solved.walk(coloured, rays, mean, options, walks);
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
        // By day every room in one of both.
        if long() || seed % 2 == 0 {
            check_in::<f64, 3>(seed);
        }
        if long() || seed % 2 == 1 {
            check_in::<f32, 2>(seed);
            check_in::<f64, 1>(seed);
        }
    }
}

/// The largest difference of what one ray tells of all G_c from their means by form factors, over what is allowed, in six points.
fn largest(
    solved: &Solved<'_>,
    coloured: &Coloured<'_, f64>,
    rays: &Rays<'_, '_, f64, 2>,
    seed: u64,
) -> f64 {
    const DRAWS: u32 = 20_000;
    let room = coloured;
    let mut draws = RngUniforms(<WalkSeeds>::new(seed, 0).generator(0));
    let mut worst: f64 = 0.0;
    for place in 0..6 {
        let cell = place * (solved.mesh.len() - 1) / 5;
        let point = room.inside(cell, draws.uniform()).unwrap();
        let x = Located { point, cell };
        let irradiance = room.irradiance_of::<Numbers<f64>, 2>(&point, &solved.v);
        let reflected = coloured.kernel(&point, &point).times(&irradiance);
        let exact = rays.value(&x).minus(&reflected);
        let nothing = Numbers::splat(CHANNELS, 0.0);
        let (mut sums, mut squares) = (nothing, nothing);
        for _ in 0..DRAWS {
            let off = rays.source(&x, &mut draws).minus(&exact);
            sums = sums.plus(&off);
            squares = squares.plus(&off.times(&off));
        }
        let n = f64::from(DRAWS);
        for (sum, square) in sums.as_slice().iter().zip(squares.as_slice()) {
            let allowed = STANDARD_ERRORS * (square / n / n).sqrt() + 1e-12;
            worst = worst.max((sum / n).abs() / allowed);
        }
    }
    worst
}

/// The means of what one ray tells of all G_c are those by form factors; tables of which one number is wrong are found.
#[test]
fn what_is_drawn_has_the_mean_that_it_should() {
    for seed in seeds() {
        let colours = Colours::saturated(seed);
        let solved = colours.solved::<2>(60, false);
        solved.with::<f64, _, 2>(|coloured, rays, _| {
            let off = largest(&solved, coloured, rays, seed);
            assert!(off < 1.0, "seed {seed}: {off}");
            // Each table is needed, in every channel.
            let control = solved.rays.control();
            let scaled = |all: &[f64], by: f64| all.iter().map(|x| by * x).collect::<Vec<f64>>();
            let wrong = |integrals: f64, boxes: f64| {
                let mut of_boxes = control.boxes.to_vec();
                for row in of_boxes.chunks_exact_mut(2 + 15 * CHANNELS) {
                    row[2..].iter_mut().for_each(|c| *c *= boxes);
                }
                let integrals = scaled(control.integrals, integrals);
                let spoiled = RayControl {
                    integrals: &integrals,
                    boxes: &of_boxes,
                    ..control
                };
                let rays = Rays::new(coloured, &solved.v, spoiled).unwrap();
                largest(&solved, coloured, &rays, seed)
            };
            assert!(wrong(1.0, 1.0) < 1.0);
            for (integrals, boxes) in [(1.05, 1.0), (1.0, 0.95)] {
                let off = wrong(integrals, boxes);
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
    let (cells, walks) = if long() { (80, 20_000) } else { (40, 5000) };
    let mut ratios = Vec::new();
    for seed in seeds() {
        let colours = Colours::saturated(seed);
        for last_step in [false, true] {
            let variances = |colours: &Colours| -> Vec<f64> {
                let solved = colours.solved::<3>(cells, last_step);
                let options = absorbed(Estimator::Collision, 1);
                let [all, _] = solved.with::<f64, _, 3>(|coloured, rays, mean| {
                    solved.walk(coloured, rays, mean, options, walks)
                });
                let of = |own: &Statistics| own.preconditioned().std_error.unwrap().powi(2);
                all.iter().map(of).collect()
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
                    tables: ColourTables {
                        channels: CHANNELS,
                        reflectances: copied(&colours.tables.reflectances),
                        emissions: copied(&colours.tables.emissions),
                    },
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
    let colours = Colours::furnace::<f64>(1);
    let solved = colours.solved::<1>(30, false);
    solved.with::<f64, _, 1>(|coloured, _, _| {
        let numbers = [0.5; 8];
        let of = |channels| Tints::<_, 4> {
            channels,
            reflectances: &numbers,
            emissions: &numbers,
        };
        // Of another room, of no channel, and of more than a value holds.
        for other in [of(2), of(0), of(5)] {
            let refused = coloured.grey().with_colours(other).map(drop);
            assert!(matches!(refused, Err(RoomError::Length { .. })));
        }
        let refused = coloured
            .grey()
            .with_colours(colours.tables.tint::<2>())
            .map(drop);
        assert!(matches!(
            refused,
            Err(RoomError::Length {
                expected: 2,
                found: 3
            })
        ));
        let control = solved.rays.control();
        let short = RayControl {
            intervals: &control.intervals[1..],
            ..control
        };
        for refused in [
            Rays::<f64, 1>::new(coloured, &solved.v[1..], control).map(drop),
            Rays::<f64, 1>::new(coloured, &solved.v, short).map(drop),
            RaySetup::<_, 1>::new(coloured, &solved.v[1..]).map(drop),
        ] {
            assert!(
                matches!(refused, Err(RoomError::Length { .. })),
                "{refused:?}"
            );
        }
    });
}
