//! Derivatives with respect to reflectances, emissions and temperatures against closed forms and differences.

use fredholm::room::{Material, Surfaces};
use fredholm::scene::{Enclosure, Material as Finish, NamedSurface, shapes};
use fredholm::{CubeModel, Model, RoomModel, Scalar, SceneModel, Solver};

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

const TARGETS: [&str; 3] = ["floor", "u(ceiling, 0.3)", "block"];

#[test]
fn derivatives_of_a_room_are_those_of_differences() {
    const STEP: f64 = 1e-3;
    let materials: Materials = [[0.6, 0.0], [0.4, 0.0], [0.8, 0.2], [0.3, 1.0]];
    let model = room(materials);
    let found = asked(&model).walks(40_000).sensitivities().unwrap();
    let mut worst = 0.0_f64;
    for (surface, name) in NAMES.iter().enumerate() {
        for (which, word) in ["reflectance", "emission"].into_iter().enumerate() {
            let at = |step: f64| {
                let mut changed = materials;
                changed[surface][which] += step;
                asked(&room(changed)).solve_to(1e-7).unwrap()
            };
            let [low, high] = [-STEP, STEP].map(at);
            for target in TARGETS {
                let difference = (high[target].value() - low[target].value()) / (2.0 * STEP);
                let own = found.get(target, &format!("{name} {word}")).unwrap();
                let z = (own.derivative - difference) / own.std_error.unwrap();
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
        refused.contains("sensitivities are those of rooms, scenes and equations with parameters"),
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
        let solver = Solver::new(model).cells(24);
        names.iter().fold(solver, |solver, name| solver.over(name))
    }
    let forward = scene(None);
    let forward = asked(&forward, &names)
        .walks(40_000)
        .sensitivities()
        .unwrap();
    let mut worst = 0.0_f64;
    for (lit, source) in names.iter().enumerate() {
        let alone = scene(Some(lit));
        let back = asked(&alone, &names)
            .walks(40_000)
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
