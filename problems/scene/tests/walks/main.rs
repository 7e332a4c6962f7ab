//! Walks on scenes, plain and with a neighbour equation from steps, against exact answers.

use core::num::NonZeroU32;

use fredholm_core::galerkin::{Basis, CellMap, Partition};
use fredholm_core::sampled::{SampledSolution, SampledTables, SetupOptions};
use fredholm_core::{
    At, Batch, DefaultGenerator, Equation, Estimate, Estimator, Form, Functional, LastStep, Length,
    Located, NeighbourOf, NoNeighbour, Real, RngUniforms, SourceSampler, StateSpace, Statistics,
    Task, Uniforms, WalkSeeds, WithKnown,
};
use fredholm_scene::{
    Air, Beam, Cells, Enclosure, Facing, Irradiance, Material, Mean, Point, Polygon, Radiosity,
    Scene, SceneError, Tables, areas, form_factor_of_point, shapes,
};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

mod coloured;
#[path = "../common/mod.rs"]
mod common;
mod skylight;
mod solutions;
mod starts;
use common::{Surfaces, closed, closed_scenes, open, scene_with};

/// Most standard errors that any of the few hundred estimates of this file may be off.
const STANDARD_ERRORS: f64 = 4.9;

const ESTIMATORS: [Estimator; 2] = [Estimator::Absorption, Estimator::Collision];

/// A closed scene, with a material for every surface.
fn scene<F: Real>(surfaces: &Surfaces, material: impl Fn(usize) -> Material) -> Scene {
    scene_with::<F>(surfaces, material, Enclosure::Closed).unwrap()
}

/// A material of everything.
fn grey<const N: usize>(reflectances: [f64; N], emissions: [f64; N]) -> impl Fn(usize) -> Material {
    move |s| Material {
        reflectance: reflectances[s % N],
        emission: emissions[s % N],
    }
}

/// Walks of one functional. (v, Φ) is computed walk by walk.
fn walk<E, N, T>(
    equation: &E,
    neighbour: &N,
    functional: &T,
    estimator: Estimator,
    walks: u64,
) -> Statistics
where
    E: Equation,
    N: NeighbourOf<E>,
    T: Functional<E>,
{
    let task = Task {
        equation,
        neighbour,
        functional,
        control_mean: None,
        estimator,
        form: Form::Product,
        seeds: WalkSeeds::<DefaultGenerator>::new(1, 0),
        length: Length::default(),
    };
    let mut batch = Batch::new(0, walks, walks);
    batch.run(&task, u64::MAX).unwrap();
    *batch.statistics()
}

/// Whether an estimate plus what is known is `expected`, in standard errors and but for rounding.
fn check(what: &str, estimate: Estimate, known: f64, expected: f64, rounding: f64) {
    let off = (estimate.estimate + known - expected).abs();
    let allowed = STANDARD_ERRORS * estimate.std_error.unwrap_or(0.0) + rounding * expected.abs();
    assert!(
        off <= allowed,
        "{what}: {} + {known} for {expected}, off by {off:e} of {allowed:e}",
        estimate.estimate
    );
}

/// Both estimates of walks.
fn check_both(what: &str, all: &Statistics, known: f64, expected: f64, rounding: f64) {
    check(what, all.plain(), known, expected, rounding);
    check(what, all.preconditioned(), known, expected, rounding);
}

/// v and c from the steps of a scene in f64.
fn tables<F: Real, const B: usize>(
    scene: &Scene,
    cells: usize,
    last_step: bool,
) -> SampledTables<F> {
    let (geometry, cells) = (Tables::new(scene), Cells::new(scene, cells).unwrap());
    let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
    let options = SetupOptions {
        samples: 256,
        ..SetupOptions::default()
    };
    let of = (&radiosity, &radiosity);
    let solution = if last_step {
        SampledSolution::with_events::<_, _, _, 2, B>(of, &LastStep(&radiosity), &options)
    } else {
        SampledSolution::with_events::<_, _, _, 2, B>(of, &radiosity, &options)
    };
    solution.unwrap().for_walks().unwrap()
}

/// All estimates of the mean over all: plain and preconditioned, with and without the last step to the light, both estimators.
fn check_all<F: Real, const B: usize>(
    what: &str,
    scene: &Scene,
    functional: &Everywhere<F>,
    expected: f64,
    walks: u64,
) {
    let (geometry, cells) = (Tables::<F>::new(scene), Cells::new(scene, 40).unwrap());
    let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
    let shares = radiosity.visible_shares(8);
    let radiosity = radiosity.with_visible_shares(&shares).unwrap();
    let last = LastStep(&radiosity);
    let emission = of_lights(&radiosity);
    let [own, own_last] = [false, true].map(|last| tables::<F, B>(scene, 40, last));
    let two = NonZeroU32::MIN.saturating_add(1);
    let rounding = 1e3 * F::EPSILON.to_f64();
    let of = (&radiosity, &radiosity);
    for estimator in ESTIMATORS {
        let neighbour = own.neighbour_with_events::<_, _, 2, B>(of, two).unwrap();
        let all = walk(&radiosity, &neighbour, functional, estimator, walks);
        check_both(what, &all, 0.0, expected, rounding);
        // The neighbour equation changes nothing of what plain walks score.
        let none = NoNeighbour::<Radiosity<'_, F>>::new();
        let alone = walk(&radiosity, &none, functional, estimator, walks);
        assert_eq!(alone.plain(), all.plain());

        let neighbour = own_last
            .neighbour_with_events::<_, _, 2, B>(of, two)
            .unwrap();
        let all = walk(&last, &neighbour, functional, estimator, walks);
        check_both(what, &all, emission, expected, rounding);
    }
}

/// The mean of the emission of lights over all.
fn of_lights<F: Real>(radiosity: &Radiosity<'_, F>) -> f64 {
    let (mut sum, mut areas) = (0.0, 0.0);
    for (face, number) in radiosity.geometry().faces().iter().zip(0..) {
        let area = face.area.to_f64();
        sum += area * radiosity.emission_of_light(number).to_f64();
        areas += area;
    }
    sum / areas
}

/// F = 1 − ρ gives u = 1 in any closed scene, whatever hides what.
#[test]
fn furnaces() {
    fn check_in<F: Real, const B: usize>(which: usize) {
        let mut rng = ChaCha8Rng::seed_from_u64(which as u64);
        let (name, surfaces) = closed_scenes().swap_remove(which);
        let rho: Vec<f64> = surfaces.iter().map(|_| 0.9 * rng.random::<f64>()).collect();
        let scene = scene::<F>(&surfaces, |s| Material {
            reflectance: rho[s],
            emission: 1.0 - rho[s],
        });
        check_all::<F, B>(&name, &scene, &Everywhere::new(&scene), 1.0, 1000);
    }
    // The fifth has needles that are none in f32.
    for which in [0, 1, 2, 3, 5, 6] {
        check_in::<f64, 1>(which);
        check_in::<f64, 3>(which);
        check_in::<f32, 6>(which);
    }
}

/// The mean over faces, without borrowing an equation.
struct Everywhere<F> {
    tables: Tables<F>,
    faces: Vec<u32>,
    ends: Vec<F>,
}

impl<F: Real> Everywhere<F> {
    fn new(scene: &Scene) -> Self {
        Self::of(scene, (0..scene.faces().len() as u32).collect())
    }

    /// The mean over one surface.
    fn over(scene: &Scene, surface: usize) -> Self {
        let is_its = |face: &u32| scene.place(*face as usize).unwrap().surface == surface;
        let faces = 0..scene.faces().len() as u32;
        Self::of(scene, faces.filter(is_its).collect())
    }

    fn of(scene: &Scene, faces: Vec<u32>) -> Self {
        let tables = Tables::new(scene);
        let ends = areas(tables.geometry(), &faces).unwrap();
        Self {
            tables,
            faces,
            ends,
        }
    }
}

impl<F: Real, E> Functional<E> for Everywhere<F>
where
    E: StateSpace<Scalar = F, Point = Point<F>>,
{
    fn start<U: Uniforms<F>>(&self, uniforms: &mut U) -> (Point<F>, F) {
        let mean = Mean::new(self.tables.geometry(), &self.faces, &self.ends).unwrap();
        mean.draw(uniforms)
    }
}

/// The test CUBE of Khodulev and Kopylov (1996): side 10, ρ = ⅔, a point light of I = 50,000 cd in the middle, which gives
/// u = F + ρ H as a luminance if it is divided by π. Luminance in nit at the centre of a face, half-way to the middle of an edge, half-way to a corner, at the edge's middle,
/// and at the corner, by deterministic radiosity with exact point-to-rectangle factors, within 0.1.
#[test]
fn five_points_of_the_cube() {
    const EXPECTED: [([f64; 2], f64); 5] = [
        ([5.0, 5.0], 892.8),
        ([5.0, 2.5], 768.7),
        ([2.5, 2.5], 686.7),
        ([5.0, 1e-9], 565.1),
        ([1e-9, 1e-9], 388.5),
    ];
    let room = shapes::room([0.0; 3], [10.0; 3]);
    let scene = scene::<f64>(&room.surfaces, grey([2.0 / 3.0], [0.0]));
    let light = Beam::Point {
        at: [5.0; 3],
        intensity: 50_000.0 / core::f64::consts::PI,
    };
    let scene = scene.with_beams(vec![light]).unwrap();
    let (geometry, cells) = (Tables::new(&scene), Cells::new(&scene, 150).unwrap());
    let cube = Radiosity::new(geometry.geometry(), &cells, 0.2).unwrap();
    let options = SetupOptions {
        samples: 1024,
        ..SetupOptions::default()
    };
    let of = (&cube, &cube);
    let solution = SampledSolution::with_events::<_, _, _, 2, 6>(of, &cube, &options).unwrap();
    let tables = solution.for_walks::<f64>().unwrap();
    let steps = NonZeroU32::new(4).unwrap();
    let neighbour = tables
        .neighbour_with_events::<_, _, 2, 6>(of, steps)
        .unwrap();
    for ([x, y], expected) in EXPECTED {
        let start = At(cube.at(0, [x, y, 0.0]).unwrap());
        for estimator in ESTIMATORS {
            let all = walk(&cube, &neighbour, &start, estimator, 4000);
            // The reference is known to 0.1.
            check_both("CUBE", &all, 0.0, expected, 0.1 / expected);
            let [plain, own] = [all.plain(), all.preconditioned()];
            let ratio = own.std_dev.unwrap() / plain.std_dev.unwrap();
            // Absorption scores what is left over q0; collision lowers it eight times here.
            let is_collision = estimator == Estimator::Collision;
            assert!(ratio < if is_collision { 0.2 } else { 0.5 });
        }
    }
    // The mean luminance by conservation of energy: Φ ρ/(π A (1 − ρ)) with Φ = 4πI and A = 600.
    let everywhere = Everywhere::<f64>::new(&scene);
    let all = walk(&cube, &neighbour, &everywhere, Estimator::Collision, 20_000);
    check("CUBE", all.preconditioned(), 0.0, 2000.0 / 3.0, 1e-12);
}

/// The mean of the last step over a face is the light that arrives there from all others, ρ Σ_j F_ij F_j by form factors,
/// behind obstacles, too.
#[test]
fn last_steps_have_the_mean_of_form_factors() {
    let (_, surfaces) = closed_scenes().swap_remove(2);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    // Of few that emit each is a light, one of which takes light away.
    let materials: Vec<Material> = (0..surfaces.len())
        .map(|s| Material {
            reflectance: 0.3 * rng.random::<f64>(),
            emission: match s % 3 {
                0 => 1.0 + rng.random::<f64>(),
                1 if s == 1 => -1.0,
                _ => 0.0,
            },
        })
        .collect();
    let scene = scene::<f64>(&surfaces, |s| materials[s]);
    let (geometry, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 40).unwrap());
    let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
    let shares = radiosity.visible_shares(16);
    let radiosity = radiosity.with_visible_shares(&shares).unwrap();
    let direct = direct_light(&scene, &radiosity);
    for (face, expected) in direct.into_iter().enumerate() {
        let score = |x: &Point<f64>, draws: &mut Draws| [radiosity.sample_last_step(x, draws)];
        check_means(&geometry, face as u32, 4000, score, [expected]);
    }
}

/// Uniform numbers.
type Draws = RngUniforms<DefaultGenerator>;

/// Whether scores of points of a face have these means.
fn check_means<const N: usize>(
    geometry: &Tables<f64>,
    face: u32,
    draws: u32,
    score: impl Fn(&Point<f64>, &mut Draws) -> [f64; N],
    expected: [f64; N],
) {
    let ends = areas(geometry.geometry(), &[face]).unwrap();
    let faces = [face];
    let mean = Mean::new(geometry.geometry(), &faces, &ends).unwrap();
    let seeds = WalkSeeds::<DefaultGenerator>::new(3, u64::from(face));
    let n = f64::from(draws);
    let (mut sums, mut squares) = ([0.0; N], [0.0; N]);
    for number in 0..draws {
        let mut draws = RngUniforms(seeds.generator(u64::from(number)));
        let (x, _) = mean.draw(&mut draws);
        let scores = score(&x, &mut draws);
        for ((sum, square), score) in sums.iter_mut().zip(&mut squares).zip(scores) {
            *sum += score / n;
            *square += score * score / n;
        }
    }
    for ((mean, square), expected) in sums.into_iter().zip(squares).zip(expected) {
        let error = ((square - mean * mean).max(0.0) / n).sqrt();
        let off = (mean - expected).abs();
        let allowed = STANDARD_ERRORS * error + 1e-9;
        assert!(off <= allowed, "face {face}: {mean} for {expected}");
    }
}

/// ρ_i Σ_j F_ij F_j of every face over all lights, by form factors.
fn direct_light(scene: &Scene, radiosity: &Radiosity<'_, f64>) -> Vec<f64> {
    let factors = fredholm_factors::scene_factors(scene, 1e-9).unwrap();
    let faces = 0..scene.faces().len();
    let of_lights: Vec<f64> = faces
        .map(|face| radiosity.emission_of_light(face as u32))
        .collect();
    assert!(
        of_lights
            .iter()
            .filter(|&&emission| emission != 0.0)
            .count()
            > 1
    );
    let light = |i: usize| {
        let terms = of_lights.iter().enumerate();
        terms
            .map(|(j, light)| factors.factor(i, j) * light)
            .sum::<f64>()
    };
    let faces = scene.faces().iter().enumerate();
    faces.map(|(i, face)| face.reflectance * light(i)).collect()
}

/// Every point of a cell lies in it, whatever its shape, and the means of products of polynomials are those of an
/// orthonormal basis.
#[test]
fn cells_and_polynomials() {
    // A triangle, a parallelogram and a quadrilateral that is neither, in a prism with a bent top.
    for (name, surfaces) in closed_scenes().into_iter().take(6) {
        let scene = closed(&surfaces);
        let (geometry, cells) = (Tables::new(&scene), Cells::new(&scene, 60).unwrap());
        let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
        let area: f64 = scene.faces().iter().map(|face| face.area).sum();
        let measures = (0..radiosity.cells()).map(|cell| radiosity.measure(cell));
        let whole = measures.sum::<f64>();
        assert!(
            (whole - area).abs() < 1e-10 * area,
            "{name}: {whole} for {area}"
        );
        for cell in 0..radiosity.cells() {
            check_cell(&name, &radiosity, cell);
        }
    }
}

fn check_cell(name: &str, radiosity: &Radiosity<'_, f64>, cell: usize) {
    let n = 12;
    let mut gram = [[0.0; 6]; 6];
    for a in 0..n {
        for b in 0..n {
            // Near the middles of squares, off their diagonals, on which triangles meet.
            let t = [f64::from(a) + 0.47, f64::from(b) + 0.5].map(|t| t / f64::from(n));
            let x = radiosity.point(cell, &t);
            assert_eq!(radiosity.locate(&x), cell, "{name}: {t:?}");
            let psi: [f64; 6] = radiosity.basis(&Located { point: x, cell });
            for (row, p) in gram.iter_mut().zip(psi) {
                for (entry, q) in row.iter_mut().zip(psi) {
                    *entry += p * q / f64::from(n * n);
                }
            }
        }
    }
    for (i, row) in gram.iter().enumerate() {
        for (j, &entry) in row.iter().enumerate() {
            let expected = f64::from(u8::from(i == j));
            // The rule's error; products of quadratics have the fourth degree.
            assert!(
                (entry - expected).abs() < 0.1,
                "{name}, cell {cell}: {gram:?}"
            );
        }
    }
}

/// What arrives at black surfaces, and what a point in the air sees, for every light: one, that which is far, none.
#[test]
fn irradiances_and_points_in_the_air() {
    let room = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    // Black but for the ceiling's light, which is 2 of the sky's colour, and a wall that takes light away.
    let emission = [0.0, 2.0, 0.0, -0.5, 0.0, 0.0];
    let scene = scene::<f64>(&room, grey([0.0; 6], emission));
    let (geometry, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 24).unwrap());
    let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
    let x = [0.3, 0.6, 0.0];
    let faces = scene.faces();
    let seen = |face: usize| form_factor_of_point(x, [0.0, 0.0, 1.0], faces[face].polygon());
    let expected: f64 = (1..6).map(|face| emission[face] * seen(face)).sum();
    let start = Irradiance {
        radiosity: &radiosity,
        of: At(radiosity.at(0, x).unwrap()),
    };
    let middle = Air {
        radiosity: &radiosity,
        position: [0.5; 3],
    };
    // Upwards nothing below the meter is seen. In any direction Lambert's sums over whole polygons, also over what is behind, are what
    // arrives in front less what arrives from behind.
    let meter = [0.3, 0.6, 0.7];
    let facing = |n: [f64; 3]| Facing::new(&radiosity, meter, n).unwrap();
    let upper = |face: usize| {
        let corners = faces[face].polygon().iter();
        let upper: Vec<_> = corners.map(|&[x, y, z]| [x, y, z.max(0.7)]).collect();
        form_factor_of_point(meter, [0.0, 0.0, 1.0], &upper)
    };
    let from_above: f64 = (1..6).map(|face| emission[face] * upper(face)).sum();
    let tilted = [1.0, 2.0, -0.5];
    let unit = tilted.map(|c| c / 5.25_f64.sqrt());
    let factor = |face: usize| form_factor_of_point(meter, unit, faces[face].polygon());
    let difference: f64 = (0..6).map(|face| emission[face] * factor(face)).sum();
    let last = LastStep(&radiosity);
    let own = tables::<f64, 3>(&scene, 24, true);
    let sampled = own
        .neighbour::<_, 2, 3>(&radiosity, NonZeroU32::MIN)
        .unwrap();
    let (equation, neighbour) = (WithKnown(&last), WithKnown(&sampled));
    for direction in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
        let refused = Facing::new(&radiosity, meter, direction);
        assert!(matches!(refused, Err(SceneError::Direction)));
    }
    for estimator in ESTIMATORS {
        let up = facing([0.0, 0.0, 3.0]);
        let up = walk(&equation, &neighbour, &up, estimator, 20_000);
        check_both("up", &up, 0.0, from_above, 1e-9);
        let [front, back] = [tilted, tilted.map(|c| -c)]
            .map(|n| walk(&equation, &neighbour, &facing(n), estimator, 20_000).plain());
        let error = front.std_error.unwrap().hypot(back.std_error.unwrap());
        let off = front.estimate - back.estimate - difference;
        assert!(off.abs() < 4.9 * error && error < 0.05, "{off} ± {error}");
        let at_floor = walk(&equation, &neighbour, &start, estimator, 20_000);
        // A sixth of all directions leads to every side.
        let in_air = walk(&equation, &neighbour, &middle, estimator, 20_000);
        check_both("floor", &at_floor, 0.0, expected, 1e-9);
        check_both("air", &in_air, 0.0, 1.5 / 6.0, 1e-9);
    }
}

/// Of light that leaves, directly or after it was reflected, nothing comes back: two plates that face each other.
#[test]
fn irradiance_of_what_is_open() {
    let plates = shapes::room([0.0; 3], [1.0; 3]).surfaces[..2].to_vec();
    let material = grey([0.0; 2], [0.0, 1.0]);
    let scene = scene_with::<f64>(&plates, material, Enclosure::Open).unwrap();
    let (geometry, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 8).unwrap());
    let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.3).unwrap();
    let x = [0.2, 0.4, 0.0];
    let of = At(radiosity.at(0, x).unwrap());
    let expected = form_factor_of_point(x, [0.0, 0.0, 1.0], scene.faces()[1].polygon());
    let last = LastStep(&radiosity);
    let equation = WithKnown(&last);
    let none = NoNeighbour::<WithKnown<'_, LastStep<'_, Radiosity<'_, f64>>>>::new();
    let start = Irradiance {
        radiosity: &radiosity,
        of,
    };
    for estimator in ESTIMATORS {
        let statistics = walk(&equation, &none, &start, estimator, 10_000);
        check("open", statistics.plain(), 0.0, expected, 1e-9);
    }
    // From below the lower plate nothing but its back is seen; from the side a part of both.
    assert!(!scene.is_between([0.5, 0.5, -0.5]));
    assert!(scene.is_between([1.5, 0.5, 0.5]));
}

/// What cannot be is refused.
#[test]
fn refusals() {
    let scene = closed(&shapes::room([0.0; 3], [1.0; 3]).surfaces);
    let (geometry, cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 6).unwrap());
    for absorption in [0.0, 1.0, f64::NAN, -0.5] {
        assert!(Radiosity::new(geometry.geometry(), &cells, absorption).is_err());
    }
    let radiosity = Radiosity::new(geometry.geometry(), &cells, 0.5).unwrap();
    assert!(radiosity.at(0, [0.5, 0.5, 0.0]).is_ok());
    for (face, at) in [
        (0, [0.5, 0.5, 0.1]),
        (0, [1.5, 0.5, 0.0]),
        (6, [0.5, 0.5, 0.0]),
    ] {
        assert!(radiosity.at(face, at).is_err());
    }
    assert!(radiosity.at(0, [f64::NAN, 0.5, 0.0]).is_err());
    let triangle = Polygon::Triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let other = open(&vec![vec![triangle]]);
    let of_other = Cells::new(&other, 6).unwrap();
    assert!(Radiosity::new(geometry.geometry(), &of_other, 0.5).is_err());
    assert!(Cells::<f64>::new(&scene, usize::MAX).is_err());
    assert!(Mean::new(geometry.geometry(), &[], &[]).is_err());
    assert!(Mean::new(geometry.geometry(), &[6], &[1.0]).is_err());
    assert!(Mean::new(geometry.geometry(), &[5], &[]).is_err());
    assert!(areas(geometry.geometry(), &[6]).is_err());
}
