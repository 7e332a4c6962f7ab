//! Derivatives with respect to reflectances, emissions and temperatures against closed forms and differences.

use fredholm::circle::{Emission, Harmonic};
use fredholm::room::{Material, Surfaces};
use fredholm::scene::{Enclosure, Material as Finish, NamedSurface, shapes};
use fredholm::{
    CircleModel, CubeModel, Model, Pairs, RoomModel, Scalar, SceneModel, Sequence, Solver,
    SphereModel, TubeModel, sphere, tube,
};

use crate::common::is_long;

/// A bound of |z| over all derivatives of a test: of some 60 normal numbers the largest exceeds it once in a hundred thousand times, about.
const SIGMAS: f64 = 4.9;

/// The reflectance and emission of floor, walls, ceiling and lamp.
type Materials = [[f64; 2]; 4];

const NAMES: [&str; 4] = ["floor", "walls", "ceiling", "block"];

fn room(all: Materials) -> RoomModel {
    let points: [&[[f64; 2]]; 4] = [
        &[[0.0, 0.0], [2.0, 0.0]],
        &[[2.0, 0.0], [2.0, 1.0]],
        &[[2.0, 1.0], [0.0, 1.0], [0.0, 0.0]],
        &[[0.8, 0.3], [0.8, 0.6], [1.1, 0.6], [1.1, 0.3], [0.8, 0.3]],
    ];
    let mut surfaces = Surfaces::default();
    for ((name, points), [reflectance, emission]) in NAMES.iter().zip(points).zip(all) {
        let material = Material {
            reflectance,
            emission,
        };
        surfaces = surfaces.with(name, points, material);
    }
    RoomModel::new(surfaces, Scalar::F64).unwrap()
}

fn asked(model: &dyn Model) -> Solver<'_> {
    let solver = Solver::new(model).seed(3);
    solver.over("floor").on("ceiling", 0.3).over("block")
}

/// Solver by which nothing is chosen.
fn fixed(model: &dyn Model) -> Solver<'_> {
    asked(model).cells(30).degree(2).pairs(Pairs::Default)
}

const TARGETS: [&str; 3] = ["floor", "u(ceiling, 0.3)", "block"];

#[test]
fn derivatives_of_a_room_are_those_of_differences() {
    // Central differences are off by its square times a third derivative over 6.
    const STEP: f64 = 1e-2;
    let walks = if is_long() { 40_000 } else { 10_000 };
    let materials: Materials = [[0.6, 0.0], [0.4, 0.0], [0.8, 0.2], [0.3, 1.0]];
    let model = room(materials);
    let solver = fixed(&model).walks(walks);
    let found = solver.sensitivities().unwrap();
    let mut worst = 0.0_f64;
    for (surface, name) in NAMES.iter().enumerate() {
        // u is linear in emissions: a step of 1 has no error but that of its ends.
        for (which, word, ends) in [
            (0, "reflectance", [-STEP, STEP]),
            (1, "emission", [0.0, 1.0]),
        ] {
            let at = |step: f64| {
                let mut changed = materials;
                changed[surface][which] += step;
                let model = room(changed);
                fixed(&model).walks(walks / 2).solve().unwrap()
            };
            let [low, high] = ends.map(at);
            let step = ends[1] - ends[0];
            for target in TARGETS {
                let difference = (high[target].value() - low[target].value()) / step;
                let own = found.get(target, &format!("{name} {word}")).unwrap();
                let own_error = own.std_error.unwrap();
                let error = low[target].std_error().hypot(high[target].std_error()) / step;
                assert!(error < own_error, "{target} {name} {word}: {error} {own:?}");
                let z = (own.derivative - difference) / own_error.hypot(error);
                println!("{target:16} {name} {word:12} {difference:8.5} {own:?} {z:.1}");
                worst = worst.max(z.abs());
            }
        }
    }
    assert!(worst < SIGMAS, "{worst}");
}

/// In a closed scene of equal surfaces with u = F/(1 − ρ) all derivatives together are those of that.
#[test]
fn derivatives_of_a_furnace_sum_to_its_own() {
    let names = ["a", "b", "c", "d", "e", "f"];
    let walls = shapes::room([0.0; 3], [1.0, 1.5, 0.7]).surfaces;
    let surfaces = names
        .iter()
        .zip(walls)
        .map(|(name, polygons)| NamedSurface {
            name: (*name).to_owned(),
            polygons,
            material: Finish {
                reflectance: 0.7,
                emission: 0.3,
            },
        });
    let scene = SceneModel::new(surfaces.collect(), Enclosure::Closed, Scalar::F64).unwrap();
    let solver = Solver::new(&scene).over("a");
    let found = solver.walks(40_000).sensitivities().unwrap();
    for word in ["reflectance", "emission"] {
        let own = names.map(|name| found.get("a", &format!("{name} {word}")).unwrap());
        let sum: f64 = own.iter().map(|own| own.derivative).sum();
        // Correlated errors add at most.
        let error: f64 = own.iter().map(|own| own.std_error.unwrap()).sum();
        assert!(
            (sum - 1.0 / 0.3).abs() < SIGMAS * error,
            "{word}: {sum} ± {error}"
        );
        assert!(error < 0.15, "{error}");
    }
}

/// The largest |z| of derivatives of targets with these exact values, by one set of walks.
fn worst(solver: &Solver<'_>, targets: &[(&str, &[(&str, f64)])]) -> f64 {
    let found = solver.sensitivities().unwrap();
    let all = targets
        .iter()
        .flat_map(|(target, exact)| exact.iter().map(move |own| (target, own)));
    let z = all.map(|(target, (quantity, exact))| {
        let own = found.get(target, quantity);
        let own = own.unwrap_or_else(|| panic!("{quantity} of {target}: {found:?}"));
        println!("{target} {quantity} {exact} {own:?}");
        let error = own.std_error.unwrap();
        assert!(error < 0.4 * (1.0 + exact.abs()), "{quantity}: {own:?}");
        // Rounding, where walks leave no error.
        (own.derivative - exact).abs() / error.max(1e-12)
    });
    z.fold(0.0, f64::max)
}

/// In double and in single precision, of draws and of points of low discrepancy.
#[test]
fn derivatives_on_a_sphere_have_their_closed_forms() {
    for (a, g, e) in [
        (0.8, 0.4, [1.0, 0.5, -0.7, 0.4]),
        (0.3, 0.1, [0.2, -1.0, 0.0, 2.0]),
        (0.9, 0.0, [1.0, 0.0, 0.0, 0.5]),
    ] {
        let parameters = sphere::Parameters {
            albedo: a,
            asymmetry: g,
            emission: e,
            forward: 0.4,
        };
        let u = SphereModel::new(parameters);
        let [theta, phi] = [1.1, 0.6_f64];
        let x = [
            theta.sin() * phi.cos(),
            theta.sin() * phi.sin(),
            theta.cos(),
        ];
        let product: f64 = e[1..].iter().zip(x).map(|(e, x)| e * x).sum();
        let (even, odd) = (1.0 / (1.0 - a), 1.0 / (1.0 - a * g));
        let at = [
            ("albedo", e[0] * even * even + g * product * odd * odd),
            ("asymmetry", a * product * odd * odd),
            ("emission 1", even),
            ("emission 2", x[0] * odd),
            ("emission 4", x[2] * odd),
        ];
        let mean = [
            ("albedo", e[0] * even * even),
            ("asymmetry", 0.0),
            ("emission 1", even),
            ("emission 3", 0.0),
        ];
        let solver = || {
            let solver = Solver::new(&u).at([theta, phi]).mean();
            solver.walks(25_000).seed(5)
        };
        let point = format!("u({theta}, {phi})");
        let mut solvers = vec![solver(), solver().scalar(Scalar::F32)];
        // Points of low discrepancy go with a constant absorption, by which walks of much scattering have an infinite variance.
        if a < 0.5 {
            solvers.push(solver().sequence(Sequence::Sobol));
        }
        for solver in &solvers {
            let z = worst(solver, &[(&point, &at), ("mean", &mean)]);
            assert!(z < SIGMAS, "{a} {g}: {z}");
        }
    }
}

/// The light is found by walks and, where there is a last step, in one.
#[test]
fn derivatives_on_a_circle_are_those_of_differences() {
    const STEP: f64 = 1e-3;
    let harmonic = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 3,
    };
    let u = CircleModel::new(vec![0.5, 0.8], Emission::Harmonic(harmonic));
    let exact = [("constant", 1.0), ("amplitude", 0.9_f64.sin())];
    let solver = Solver::new(&u).at(0.3).walks(20_000);
    let z = worst(&solver, &[("u(0.3)", &exact)]);
    assert!(z < SIGMAS, "{z}");

    let (rho, lamps) = (vec![0.3, 0.9], vec![1.0, 0.0, 0.0, 0.5]);
    let model =
        |rho: &[f64], lamps: &[f64]| CircleModel::new(rho.to_vec(), Emission::Arcs(lamps.to_vec()));
    let u = model(&rho, &lamps);
    let value = |rho: &[f64], lamps: &[f64]| {
        let report = Solver::new(&model(rho, lamps))
            .at(0.4)
            .solve_to(1e-7)
            .unwrap();
        report.goals[0].value()
    };
    let changed = |values: &[f64], i: usize, step: f64| {
        let mut values = values.to_vec();
        values[i] += step;
        values
    };
    let of_lamp = |i| value(&rho, &changed(&lamps, i, 1.0)) - value(&rho, &lamps);
    let of_rho = |i| {
        let at = |step| value(&changed(&rho, i, step), &lamps);
        (at(STEP) - at(-STEP)) / (2.0 * STEP)
    };
    let exact = [
        ("emission 1", of_lamp(0)),
        ("emission 3", of_lamp(2)),
        ("reflectance 1", of_rho(0)),
        ("reflectance 2", of_rho(1)),
    ];
    for last_step in [false, true] {
        let solver = Solver::new(&u).at(0.4).walks(40_000).last_step(last_step);
        let z = worst(&solver, &[("u(0.4)", &exact)]);
        assert!(z < SIGMAS, "{last_step}: {z}");
    }
}

#[test]
fn derivatives_in_a_tube_are_those_of_differences() {
    const STEP: f64 = 1e-3;
    let base = tube::Parameters {
        length: 3.0,
        reflectance: 0.7,
        emission: 0.2,
        ends: [1.0, 0.5],
    };
    let value = |parameters: tube::Parameters| {
        let u = TubeModel::new(parameters);
        let report = Solver::new(&u)
            .at(1.0)
            .weighted("left")
            .solve_to(if is_long() { 1e-9 } else { 1e-7 })
            .unwrap();
        [report.goals[0].value(), report.goals[1].value()]
    };
    let slope = |change: &dyn Fn(f64) -> tube::Parameters| {
        let [low, high] = [-STEP, STEP].map(|step| value(change(step)));
        [0, 1].map(|k| (high[k] - low[k]) / (2.0 * STEP))
    };
    let slopes = [
        (
            "reflectance",
            slope(&|step| tube::Parameters {
                reflectance: 0.7 + step,
                ..base
            }),
        ),
        (
            "emission",
            slope(&|step| tube::Parameters {
                emission: 0.2 + step,
                ..base
            }),
        ),
        (
            "ends 1",
            slope(&|step| tube::Parameters {
                ends: [1.0 + step, 0.5],
                ..base
            }),
        ),
        (
            "ends 2",
            slope(&|step| tube::Parameters {
                ends: [1.0, 0.5 + step],
                ..base
            }),
        ),
    ];
    let u = TubeModel::new(base);
    let solver = Solver::new(&u).at(1.0).weighted("left").walks(30_000);
    let [at, left] = [0, 1].map(|k| slopes.map(|(name, own)| (name, own[k])));
    let z = worst(&solver, &[("u(1)", &at), ("left", &left)]);
    assert!(z < SIGMAS, "{z}");
}

#[test]
fn what_has_no_such_quantities_says_so() {
    let u = CubeModel::from_fn::<1>(|_, _| 0.5, |_| 1.0);
    let refused = Solver::new(&u)
        .mean()
        .sensitivities()
        .err()
        .unwrap()
        .to_string();
    assert!(
        refused.contains("sensitivities are by quantities, and this equation names none"),
        "{refused}"
    );
    assert!(u.quantities().is_empty());
}

/// u is linear in emissions: its derivative by one is u of that alone, which walks from there find, too.
#[test]
fn derivatives_by_emission_are_those_of_adjoint_walks() {
    let names = ["floor", "ceiling", "front", "back", "left", "right"];
    let scene = |lit: Option<usize>| {
        let walls = shapes::room([0.0; 3], [2.0, 1.0, 1.3]).surfaces;
        let surfaces = names.iter().zip(walls).enumerate();
        let surfaces = surfaces.map(|(number, (name, polygons))| NamedSurface {
            name: (*name).to_owned(),
            polygons,
            material: Finish {
                reflectance: 0.3 + 0.1 * number as f64,
                emission: match lit {
                    None => 0.2,
                    Some(lit) => f64::from(u8::from(lit == number)),
                },
            },
        });
        SceneModel::new(surfaces.collect(), Enclosure::Closed, Scalar::F64).unwrap()
    };
    fn asked<'m>(model: &'m dyn Model, names: &[&str]) -> Solver<'m> {
        let solver = Solver::new(model).cells(24).degree(1);
        let solver = solver.pairs(Pairs::Default);
        names.iter().fold(solver, |solver, name| solver.over(name))
    }
    let walks = if is_long() { 40_000 } else { 4000 };
    let forward = scene(None);
    let forward = asked(&forward, &names)
        .walks(walks)
        .sensitivities()
        .unwrap();
    let mut worst = 0.0_f64;
    for (lit, source) in names.iter().enumerate() {
        let alone = scene(Some(lit));
        let back = asked(&alone, &names)
            .walks(walks)
            .adjoint(true)
            .seed(7)
            .solve()
            .unwrap();
        for target in names {
            let own = forward.get(target, &format!("{source} emission")).unwrap();
            let error = own.std_error.unwrap().hypot(back[target].std_error());
            worst = worst.max((own.derivative - back[target].value()).abs() / error);
        }
    }
    println!("{worst}");
    assert!(worst < SIGMAS, "{worst}");
}
