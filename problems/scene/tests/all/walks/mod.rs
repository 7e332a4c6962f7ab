//! Walks on scenes, plain and with a neighbour equation from steps, against exact answers.

use core::num::NonZeroU32;

use fredholm_core::galerkin::{Basis, Cells as _};
use fredholm_core::sampled::{SampledSetup, SampledTables, SetupOptions};
use fredholm_core::{
    Absorption, At, Batch, DefaultGenerator, Equation, Estimate, Estimator, Functional, Goal,
    Goals, Job, LastStep, Lights, Located, NeighbourOf, NoNeighbour, Real, RngUniforms, Statistics,
    Value, WalkOptions, WalkSeeds, WideOf,
};
use fredholm_scene::{
    Air, Beam, CellTables, Cells, Enclosure, Facing, Irradiance, Material, Mean, Point, Polygon,
    Radiosity, Scene, SceneError, Tables, Tint, areas, form_factor_of_point, shapes,
};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

mod coloured;
mod mirrors;
mod periods;
mod skylight;
mod solutions;
mod starts;
use crate::common::{Surfaces, closed_scenes, is_long, scene_with};

/// Most standard errors that any of the thousand estimates of this file may be off.
const STANDARD_ERRORS: f64 = 4.9;

/// How walks end.
const ENDS: [Absorption; 3] = [
    Absorption::Constant {
        probability: 0.3,
        estimator: Estimator::Absorption,
    },
    Absorption::Constant {
        probability: 0.3,
        estimator: Estimator::Collision,
    },
    Absorption::Roulette,
];

/// The steps of a score.
const TWO: NonZeroU32 = NonZeroU32::MIN.saturating_add(1);

const GREY: Material = Material {
    reflectance: 0.5,
    emission: 0.0,
};

/// A scene, with a material for every surface.
fn scene<F: Real>(surfaces: &Surfaces, material: impl Fn(usize) -> Material) -> Scene {
    scene_with::<F>(surfaces, material, Enclosure::Closed).unwrap()
}

/// What walks in a scene need, and the faces over which means are taken.
struct Place<F> {
    tables: Tables<F>,
    cells: Cells<F>,
    faces: Vec<u32>,
    ends: Vec<F>,
}

impl<F: Real> Place<F> {
    /// A scene in about so many cells.
    fn new(scene: &Scene, cells: usize) -> Self {
        Self::of(scene, cells, (0..scene.faces().len() as u32).collect())
    }

    /// The scene with means over one surface.
    fn over(scene: &Scene, cells: usize, surface: usize) -> Self {
        let is_its = |face: &u32| scene.place(*face as usize).unwrap().surface == surface;
        let faces = 0..scene.faces().len() as u32;
        Self::of(scene, cells, faces.filter(is_its).collect())
    }

    fn of(scene: &Scene, cells: usize, faces: Vec<u32>) -> Self {
        let (tables, cells) = (Tables::new(scene), Cells::new(scene, cells).unwrap());
        let ends = areas(tables.geometry(), &faces).unwrap();
        Self {
            tables,
            cells,
            faces,
            ends,
        }
    }

    fn radiosity(&self) -> Radiosity<'_, F> {
        Radiosity::new(self.tables.geometry(), &self.cells).unwrap()
    }

    fn mean(&self) -> Mean<'_, F> {
        Mean::new(self.tables.geometry(), &self.faces, &self.ends).unwrap()
    }
}

/// The statistics of every channel of a goal and of their weighted sum, if there are weights.
fn walk_all<E, N, T>(
    equation: &E,
    neighbour: &N,
    goal: Goal<T, WideOf<E>>,
    weights: &[f64],
    (absorption, walks): (Absorption, u64),
) -> Vec<Statistics>
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Sync,
{
    let options = WalkOptions {
        absorption,
        ..WalkOptions::default()
    };
    let goals = [goal];
    let job = Goals::new(equation, neighbour, &goals, options).with_sum(weights);
    let mut batches = vec![Batch::new(0, walks, walks); job.shared()];
    job.run(0, &mut batches, u64::MAX).unwrap();
    batches.iter().map(|batch| batch.statistics()).collect()
}

/// Walks of one functional. (v, Φ) is computed walk by walk.
fn walk<E, N, T>(
    equation: &E,
    neighbour: &N,
    functional: &T,
    absorption: Absorption,
    walks: u64,
) -> Statistics
where
    E: Equation + Sync,
    N: NeighbourOf<E> + Sync,
    T: Functional<E> + Copy + Sync,
{
    let goal = Goal {
        functional: *functional,
        control_mean: None,
        known: WideOf::<E>::splat(1, 0.0),
    };
    walk_all(equation, neighbour, goal, &[], (absorption, walks))[0]
}

/// Whether an estimate is `expected`, in standard errors and but for rounding.
fn check(what: &str, estimate: Estimate, expected: f64, rounding: f64) {
    let off = (estimate.estimate - expected).abs();
    let allowed = STANDARD_ERRORS * estimate.std_error.unwrap_or(0.0) + rounding * expected.abs();
    assert!(
        off <= allowed,
        "{what}: {} for {expected}, off by {off:e} of {allowed:e}",
        estimate.estimate
    );
}

/// Whether both estimates are.
fn check_both(what: &str, statistics: &Statistics, expected: f64, rounding: f64) {
    check(what, statistics.plain(), expected, rounding);
    check(what, statistics.preconditioned(), expected, rounding);
}

/// v and c from the steps of an equation in f64, that of a scene or its last step.
fn tables<F, E, C, const B: usize>(
    equation: &E,
    radiosity: &Radiosity<'_, f64, C>,
    samples: usize,
) -> SampledTables<F>
where
    F: Real,
    E: Equation<Scalar = f64, Point = Point<f64>> + Basis<B>,
    C: Tint<f64>,
{
    let setup = SampledSetup::<_, 2, B, _> {
        equation,
        events: radiosity,
        options: SetupOptions {
            samples,
            ..SetupOptions::default()
        },
    };
    setup.solve_all().unwrap().for_walks().unwrap()
}

/// What u is in the mean over some faces in every channel and in their weighted sum, if there are weights.
struct Expected<'a, F> {
    what: &'a str,
    mean: Mean<'a, F>,
    weights: &'a [f64],
    values: &'a [f64],
}

/// All estimates of a mean: plain and preconditioned, with and without the last step to the light, however walks end.
fn check_all<F, C, W, const B: usize>(
    expected: &Expected<'_, F>,
    radiosity: &Radiosity<'_, F, C>,
    wide: &Radiosity<'_, f64, W>,
) where
    F: Real,
    C: Tint<F>,
    W: Tint<f64>,
{
    let Expected {
        what,
        mean,
        weights,
        values,
    } = *expected;
    let (last, rounding) = (LastStep(radiosity), 1e3 * F::EPSILON.to_f64());
    let own = tables::<F, _, _, B>(wide, wide, 256);
    let own_last = tables::<F, _, _, B>(&LastStep(wide), wide, 256);
    let neighbour = own.neighbour::<_, _, 2, B>(radiosity, radiosity, TWO);
    let neighbour_last = own_last.neighbour::<_, _, 2, B>(&last, radiosity, TWO);
    let (neighbour, neighbour_last) = (neighbour.unwrap(), neighbour_last.unwrap());
    let nothing = mean.known(radiosity).scaled(0.0);
    let goal = |known| Goal {
        functional: mean,
        control_mean: None,
        known,
    };
    for absorption in ENDS {
        let by = (absorption, 1000);
        let all = walk_all(radiosity, &neighbour, goal(nothing), weights, by);
        // The neighbour equation changes nothing of what plain walks score.
        let none = NoNeighbour::new(radiosity);
        let alone = walk_all(radiosity, &none, goal(nothing), weights, by);
        let known = mean.known(radiosity);
        let to_light = walk_all(&last, &neighbour_last, goal(known), weights, by);
        assert_eq!(to_light.len(), values.len());
        for (k, &value) in values.iter().enumerate() {
            check_both(what, &all[k], value, rounding);
            check_both(what, &to_light[k], value, rounding);
            check(what, to_light[k].control(), 0.0, 0.0);
            assert_eq!(alone[k].plain(), all[k].plain());
        }
    }
}

/// All estimates of the mean over all of a grey scene where u is a constant.
fn check_constant<F: Real, const B: usize>(what: &str, scene: &Scene, value: f64) {
    let (place, wide) = (Place::<F>::new(scene, 40), Place::new(scene, 40));
    let radiosity = place.radiosity();
    let shares = radiosity.visible_shares(8);
    let radiosity = radiosity.with_visible_shares(&shares).unwrap();
    let expected = Expected {
        what,
        mean: place.mean(),
        weights: &[],
        values: &[value],
    };
    check_all::<F, _, _, B>(&expected, &radiosity, &wide.radiosity());
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
        check_constant::<F, B>(&name, &scene, 1.0);
    }
    // The fifth has needles that are none in f32.
    for (number, which) in [0, 1, 2, 3, 5, 6].into_iter().enumerate() {
        if by_turns(number, 0) {
            check_in::<f64, 3>(which);
        }
        if by_turns(number, 1) {
            check_in::<f32, 6>(which);
        }
        if by_turns(number, 2) {
            check_in::<f64, 1>(which);
        }
    }
}

/// Whether a scene with this number is looked at in a way: by day in one of three.
fn by_turns(number: usize, way: usize) -> bool {
    is_long() || number % 3 == way
}

/// In a box that is white but for one black wall, roulette has walks that end there alone, and a finite variance.
#[test]
fn white_walls() {
    let scene = scene::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces, |s| Material {
        reflectance: if s == 3 { 0.0 } else { 1.0 },
        emission: if s == 3 { 1.0 } else { 0.0 },
    });
    let place = Place::<f64>::over(&scene, 24, 0);
    let (radiosity, floor) = (place.radiosity(), place.mean());
    let own = tables::<f64, _, _, 3>(&radiosity, &radiosity, 256);
    let neighbour = own
        .neighbour::<_, _, 2, 3>(&radiosity, &radiosity, TWO)
        .unwrap();
    let all = walk(&radiosity, &neighbour, &floor, Absorption::Roulette, 4000);
    check_both("white", &all, 1.0, 1e-9);
    // Every walk comes to the lamp, with weight 1.
    assert_eq!(all.plain().std_dev, Some(0.0));
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
    let scene = scene::<f64>(&room.surfaces, |_| Material {
        reflectance: 2.0 / 3.0,
        emission: 0.0,
    });
    let light = Beam::Point {
        at: [5.0; 3],
        intensity: 50_000.0 / core::f64::consts::PI,
    };
    let place = Place::<f64>::new(&scene.with_beams(vec![light]).unwrap(), 150);
    let cube = place.radiosity();
    let own = tables::<f64, _, _, 6>(&cube, &cube, 1024);
    let steps = NonZeroU32::new(4).unwrap();
    let neighbour = own.neighbour::<_, _, 2, 6>(&cube, &cube, steps).unwrap();
    for ([x, y], expected) in EXPECTED {
        let start = At(cube.at(0, [x, y, 0.0]).unwrap());
        for absorption in ENDS {
            let all = walk(&cube, &neighbour, &start, absorption, 4000);
            // The reference is known to 0.1.
            check_both("CUBE", &all, expected, 0.1 / expected);
            let [plain, own] = [all.plain(), all.preconditioned()];
            let ratio = own.std_dev.unwrap() / plain.std_dev.unwrap();
            // Absorption scores what is left over q0; collision lowers it eight times here.
            let most = match absorption.estimator() {
                Estimator::Absorption => 0.5,
                Estimator::Collision => 0.2,
            };
            assert!(ratio < most, "{absorption:?}: {ratio}");
        }
    }
    // The mean luminance by conservation of energy: Φ ρ/(π A (1 − ρ)) with Φ = 4πI and A = 600.
    let all = walk(&cube, &neighbour, &place.mean(), ENDS[1], 20_000);
    check("CUBE", all.preconditioned(), 2000.0 / 3.0, 1e-12);
}

/// Every point of a cell lies in it where its parameters say, whatever its shape, and the means of products of polynomials are
/// those of an orthonormal basis.
#[test]
fn cells_and_polynomials() {
    // A triangle, a parallelogram and a quadrilateral that is neither, in a prism with a bent top.
    for (name, surfaces) in closed_scenes().into_iter().take(6) {
        let scene = scene::<f64>(&surfaces, |_| Material::BLACK);
        let place = Place::<f64>::new(&scene, 60);
        let radiosity = place.radiosity();
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

/// Whether the parameters of the point of a cell at t lead to it, and are t but for triangles, which are folded.
fn check_parameters(radiosity: &Radiosity<'_, f64>, cell: usize, t: [f64; 2]) {
    let point = radiosity.point(cell, &t);
    let mut found = [0.0; 2];
    radiosity.parameters(&Located { point, cell }, &mut found);
    let again = radiosity.point(cell, &found);
    let size = radiosity.measure(cell).sqrt();
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-9);
    assert!(!off(&point.position, &again.position) && size > 0.0);
    let opposite = t.map(|t| 1.0 - t);
    assert!(
        !off(&found, &t) || !off(&found, &opposite),
        "{t:?} {found:?}"
    );
}

fn check_cell(name: &str, radiosity: &Radiosity<'_, f64>, cell: usize) {
    for t in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.25, 0.75]] {
        check_parameters(radiosity, cell, t);
    }
    let n = 12;
    let mut gram = [[0.0; 6]; 6];
    for a in 0..n {
        for b in 0..n {
            // Near the middles of squares, off their diagonals, on which triangles meet.
            let t = [f64::from(a) + 0.47, f64::from(b) + 0.5].map(|t| t / f64::from(n));
            let x = radiosity.point(cell, &t);
            assert_eq!(radiosity.locate(&x), cell, "{name}: {t:?}");
            check_parameters(radiosity, cell, t);
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
    let scene = scene::<f64>(&room, |s| Material {
        reflectance: 0.0,
        emission: emission[s],
    });
    let place = Place::<f64>::new(&scene, 24);
    let radiosity = place.radiosity();
    let x = [0.3, 0.6, 0.0];
    let faces = scene.faces();
    let seen = |face: usize| form_factor_of_point(x, [0.0, 0.0, 1.0], faces[face].polygon());
    let at_floor: f64 = (1..6).map(|face| emission[face] * seen(face)).sum();
    let floor = Irradiance(At(radiosity.at(0, x).unwrap()));
    let middle = Air { position: [0.5; 3] };
    // Upwards nothing below the meter is seen. In any direction Lambert's sums over whole polygons, also over what is behind, are what
    // arrives in front less what arrives from behind.
    let meter = [0.3, 0.6, 0.7];
    let facing = |n: [f64; 3]| Facing::<f64>::new(meter, n).unwrap();
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
    let own = tables::<f64, _, _, 3>(&last, &radiosity, 256);
    let one = NonZeroU32::MIN;
    let neighbour = own.neighbour::<_, _, 2, 3>(&last, &radiosity, one).unwrap();
    for direction in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
        let refused = Facing::<f64>::new(meter, direction);
        assert!(matches!(refused, Err(SceneError::Direction)));
    }
    for absorption in ENDS {
        let up = facing([0.0, 0.0, 3.0]);
        let up = walk(&last, &neighbour, &up, absorption, 8000);
        check_both("up", &up, from_above, 1e-9);
        let [front, back] = [tilted, tilted.map(|c| -c)]
            .map(|n| walk(&last, &neighbour, &facing(n), absorption, 8000).plain());
        let error = front.std_error.unwrap().hypot(back.std_error.unwrap());
        let off = front.estimate - back.estimate - difference;
        assert!(off.abs() < 4.9 * error && error < 0.05, "{off} ± {error}");
        let floor = walk(&last, &neighbour, &floor, absorption, 8000);
        check_both("floor", &floor, at_floor, 1e-9);
        // A sixth of all directions leads to every side.
        let in_air = walk(&last, &neighbour, &middle, absorption, 8000);
        check_both("air", &in_air, 1.5 / 6.0, 1e-9);
    }
}

/// Of light that leaves, directly or after it was reflected, nothing comes back: two plates that face each other.
#[test]
fn irradiance_of_what_is_open() {
    let plates = shapes::room([0.0; 3], [1.0; 3]).surfaces;
    let light = |s: usize| Material {
        reflectance: 0.0,
        emission: [0.0, 1.0][s],
    };
    let scene = scene_with::<f64>(&plates[..2].to_vec(), light, Enclosure::Open).unwrap();
    let place = Place::<f64>::new(&scene, 8);
    let radiosity = place.radiosity();
    let x = [0.2, 0.4, 0.0];
    let expected = form_factor_of_point(x, [0.0, 0.0, 1.0], scene.faces()[1].polygon());
    let last = LastStep(&radiosity);
    let none = NoNeighbour::new(&last);
    let start = Irradiance(At(radiosity.at(0, x).unwrap()));
    for absorption in ENDS {
        let statistics = walk(&last, &none, &start, absorption, 10_000);
        check("open", statistics.plain(), expected, 1e-9);
    }
    // From below the lower plate nothing but its back is seen; from the side a part of both.
    assert!(!scene.is_between([0.5, 0.5, -0.5]));
    assert!(scene.is_between([1.5, 0.5, 0.5]));
}

/// What cannot be is refused.
#[test]
fn refusals() {
    let black = |_| Material::BLACK;
    let scene = scene::<f64>(&shapes::room([0.0; 3], [1.0; 3]).surfaces, black);
    let place = Place::<f64>::new(&scene, 6);
    let (geometry, radiosity) = (place.tables.geometry(), place.radiosity());
    assert!(radiosity.at(0, [0.5, 0.5, 0.0]).is_ok());
    for (face, at) in [
        (0, [0.5, 0.5, 0.1]),
        (0, [1.5, 0.5, 0.0]),
        (6, [0.5, 0.5, 0.0]),
        (0, [f64::NAN, 0.5, 0.0]),
    ] {
        assert!(radiosity.at(face, at).is_err());
    }
    let triangle = Polygon::Triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let other = scene_with::<f64>(&vec![vec![triangle]], black, Enclosure::Open).unwrap();
    let of_other = Cells::new(&other, 6).unwrap();
    assert!(Radiosity::new(geometry, &of_other).is_err());
    let no_sky = CellTables {
        sky_emissions: &[1.0],
        ..place.cells.tables()
    };
    assert!(Radiosity::of_tables(geometry, no_sky).is_err());
    assert!(Cells::<f64>::new(&scene, usize::MAX).is_err());
    assert!(Mean::new(geometry, &[], &[]).is_err());
    assert!(Mean::new(geometry, &[6], &[1.0]).is_err());
    assert!(Mean::new(geometry, &[5], &[]).is_err());
    assert!(areas(geometry, &[6]).is_err());
}
