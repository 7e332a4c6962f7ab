//! `solve --sensitivities` against closed forms and differences, and what has no derivatives.

use crate::common;

use std::collections::HashMap;

use common::{Folder, list, number, refused};
use serde_json::Value;

/// A bound of |z| over all derivatives of a test, of some twenty.
const SIGMAS: f64 = 4.9;

/// The derivatives of a report, by target and quantity.
fn derivatives(json: &Value) -> HashMap<(String, String), [f64; 2]> {
    let all = list(&json["sensitivities"], "derivatives").iter();
    let text = |own: &Value, key: &str| own[key].as_str().unwrap().to_owned();
    let of = |own: &Value| {
        let names = (text(own, "target"), text(own, "quantity"));
        // Where no walk comes by the quantity there is none.
        let error = own["std_error"].as_f64().unwrap_or(0.0);
        (names, [number(own, "derivative"), error])
    };
    all.map(of).collect()
}

/// All targets' estimates and errors.
fn values(folder: &Folder, problem: &str) -> Vec<(String, [f64; 2])> {
    let json = folder.solve(problem, &["--json"]).quietly(0).json();
    let of = |target: &Value| {
        let found = &target["preconditioned"];
        let name = target["name"].as_str().unwrap().to_owned();
        (
            name,
            [number(found, "estimate"), number(found, "std_error")],
        )
    };
    list(&json, "targets").iter().map(of).collect()
}

/// Compares all derivatives by a quantity with central differences of runs in which a text of the problem has other numbers.
fn check(
    folder: &Folder,
    problem: &str,
    found: &HashMap<(String, String), [f64; 2]>,
    (quantity, text, step): (&str, &str, f64),
) -> f64 {
    let (key, base) = text.rsplit_once(' ').unwrap();
    let at = |sign: f64| {
        let moved = base.parse::<f64>().unwrap() + sign * step;
        assert!(problem.contains(text), "{text}");
        values(folder, &problem.replace(text, &format!("{key} {moved}")))
    };
    let (low, high) = (at(-1.0), at(1.0));
    let mut worst = 0.0_f64;
    for ((target, [low, a]), (_, [high, b])) in low.iter().zip(&high) {
        let difference = (high - low) / (2.0 * step);
        let [own, error] = found[&(target.clone(), quantity.to_owned())];
        let error = error.hypot(a.hypot(*b) / (2.0 * step));
        // Where both are exact, there is what the step leaves out.
        let z = (own - difference) / error.max(1e-5 * difference.abs());
        println!("{target} {quantity}: {own} ± {error}, {difference}, {z:.1}");
        worst = worst.max(z.abs());
    }
    worst
}

const HEAT: &str = "[problem]\nkind = 'room'\n\
    [[problem.surface]]\nname = 'floor'\npoints = [[0, 0], [4, 0]]\nemissivity = 0.9\ntemperature = 310\n\
    [[problem.surface]]\nname = 'window'\npoints = [[4, 0], [4, 2.5]]\nemissivity = 0.84\ntemperature = 278\n\
    [[problem.surface]]\nname = 'ceiling'\npoints = [[4, 2.5], [0, 2.5]]\nnet_flux = 5\n\
    [[problem.surface]]\nname = 'wall'\npoints = [[0, 2.5], [0, 0]]\nemissivity = 0.7\ntemperature = 293\n\
    [[target]]\nname = 'ceiling'\nover = 'ceiling'\n[[target]]\nname = 'air'\nat = [1, 1.2]\n\
    [walk]\nwalks = 100000\n[galerkin]\ncells = 60\ndegree = 1\npairs = 'rays'\n";

#[test]
fn derivatives_of_heat_are_those_of_differences() {
    let folder = Folder::new();
    let json = folder
        .solve(HEAT, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    let found = derivatives(&json);
    assert_eq!(found.len(), 14);
    let moves = [
        ("floor temperature", "temperature = 310", 0.5),
        ("floor emissivity", "emissivity = 0.9", 0.01),
        ("window emissivity", "emissivity = 0.84", 0.01),
        ("wall temperature", "temperature = 293", 0.5),
        ("ceiling net flux", "net_flux = 5", 1.0),
    ];
    for moved in moves {
        let worst = check(&folder, HEAT, &found, moved);
        assert!(worst < SIGMAS, "{moved:?}: {worst}");
    }
}

/// A net flux depends on the material of its own surface besides by what arrives there.
#[test]
fn derivatives_of_net_fluxes_are_those_of_differences() {
    let folder = Folder::new();
    let rooms = HEAT
        .replace("over = 'ceiling'", "over = 'floor'\nask = 'net_flux'")
        .replace("100000", "10000");
    let room = rooms.replace(
        "name = 'air'\nat = [1, 1.2]",
        "name = 'given'\nover = 'ceiling'\nask = 'net_flux'",
    );
    let cube = "[problem]\nkind = 'scene'\n\
        [[problem.surface]]\nname = 'floor'\npolygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nemissivity = 0.6\ntemperature = 350\n\
        [[problem.surface]]\nname = 'rest'\npolygons = [[[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]],\
        [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]],\
        [[1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 1, 0]], [[0, 1, 0], [0, 1, 1], [0, 0, 1], [0, 0, 0]]]\nemissivity = 0.5\ntemperature = 280\n\
        [[target]]\nname = 'floor'\nover = 'floor'\nask = 'net_flux'\n[walk]\nwalks = 10000\n[galerkin]\ncells = 60\ndegree = 1\n";
    let moves = [
        ("floor temperature", "temperature = 310", 0.5),
        ("floor emissivity", "emissivity = 0.9", 0.01),
        ("wall temperature", "temperature = 293", 0.5),
        ("ceiling net flux", "net_flux = 5", 1.0),
    ];
    let in_space = [
        ("floor temperature", "temperature = 350", 0.5),
        ("floor emissivity", "emissivity = 0.6", 0.01),
        ("rest emissivity", "emissivity = 0.5", 0.01),
    ];
    let mirrored = cube.replace("emissivity = 0.6\n", "emissivity = 0.6\nspecular = 0.3\n");
    let cases = [
        (&*room, &moves[..]),
        (cube, &in_space),
        (&mirrored, &in_space),
    ];
    for (problem, moves) in cases {
        let options = ["--json", "--sensitivities"];
        let found = derivatives(&folder.solve(problem, &options).quietly(0).json());
        for &moved in moves {
            let worst = check(&folder, problem, &found, moved);
            assert!(worst < SIGMAS, "{moved:?}: {worst}");
        }
    }
    let both = cube.replace("over = 'floor'", "over = ['floor', 'rest']");
    let same = both.replace("0.5", "0.6").replace("280", "350");
    refused(
        &folder.solve(&same, &["--sensitivities"]),
        &["the net flux out of one surface: ask for each of them"],
    );
}

const VACUUM: &str = "[problem]\nkind = 'vacuum'\n\
    [[problem.surface]]\nname = 'floor'\npolygon = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\noutgassing = 1.5\n\
    [[problem.surface]]\nname = 'pump'\npolygon = [[0, 0, 1], [0, 1, 1], [1, 0, 1]]\nsticking = 0.4\n\
    [[problem.surface]]\nname = 'walls'\npolygons = [[[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]],\
    [[1, 0, 0], [1, 0, 1], [0, 1, 1], [0, 1, 0]], [[0, 1, 0], [0, 1, 1], [0, 0, 1], [0, 0, 0]]]\nsticking = 0.1\n\
    [[target]]\nname = 'floor'\nover = 'floor'\n[walk]\nwalks = 10000\n[galerkin]\ncells = 60\ndegree = 1\n";

/// Quantities of a vacuum are those of its words: the pressure by a sticking factor, and by what a surface gives off in all.
#[test]
fn a_vacuum_has_derivatives_by_its_own_words() {
    let folder = Folder::new();
    let options = ["--json", "--sensitivities"];
    let json = folder.solve(VACUUM, &options).quietly(0).json();
    let found = derivatives(&json);
    for moved in [
        ("pump sticking", "sticking = 0.4", 0.04),
        ("walls sticking", "sticking = 0.1", 0.01),
        ("floor outgassing", "outgassing = 1.5", 0.3),
    ] {
        let worst = check(&folder, VACUUM, &found, moved);
        assert!(worst < SIGMAS, "{moved:?}: {worst}");
    }
    let all = list(&json["sensitivities"], "derivatives").iter();
    let mut own = all.filter(|own| own["quantity"] == "floor outgassing");
    let own = own.next().unwrap();
    assert!((number(own, "value") - 1.5).abs() < 1e-12, "{own}");
    assert_eq!(own["unit"], "mbar l/s");
}

const SUN: &str = "[problem]\nkind = 'scene'\nopen = true\nsky = { emission = 100 }\n\
    [[problem.light]]\ntowards = [1, -1, 2]\nirradiance = 500\n\
    [[problem.surface]]\nname = 'ground'\npolygon = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]\nreflectance = 0.4\nemission = 2\n\
    [[problem.surface]]\nname = 'wall'\npolygon = [[0, 4, 0], [4, 4, 0], [4, 4, 3], [0, 4, 3]]\nreflectance = 0.6\n\
    [[problem.surface]]\nname = 'side'\npolygon = [[0, 0, 0], [0, 4, 0], [0, 4, 2], [0, 0, 2]]\nreflectance = 0.3\n\
    [[target]]\nname = 'ground'\nover = 'ground'\n[[target]]\nname = 'wall'\nat = { surface = 'wall', point = [2, 4, 1] }\n\
    [walk]\nwalks = 40000\n[galerkin]\ncells = 60\ndegree = 1\n";

/// A mesh of the faces has what their surfaces mean to every target, for viewers.
#[test]
fn faces_show_what_they_mean_to_a_target() {
    let folder = Folder::new();
    let [vtu, glb] = ["p.vtu", "p.glb"].map(|name| folder.at(name));
    let short = SUN.replace("40000", "4096");
    for out in [&vtu, &glb] {
        let ran = folder.solve(&short, &["--sensitivities", "--out", out]);
        assert_eq!(ran.status, Some(0), "{ran:?}");
    }
    let text = std::fs::read_to_string(&vtu).unwrap();
    assert!(text.contains("NumberOfCells=\"3\""), "{text}");
    for name in ["ground by reflectance", "wall by emission"] {
        assert!(text.contains(&format!("Name=\"{name}\"")), "{text}");
    }
    assert!(std::fs::read(&glb).unwrap().starts_with(b"glTF"));
}

#[test]
fn derivatives_in_the_sun_are_those_of_differences() {
    let folder = Folder::new();
    let json = folder
        .solve(SUN, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    let found = derivatives(&json);
    let moves = [
        ("ground reflectance", "reflectance = 0.4", 0.05),
        ("wall reflectance", "reflectance = 0.6", 0.05),
        ("side reflectance", "reflectance = 0.3", 0.05),
        ("ground emission", "emission = 2", 1.0),
    ];
    for moved in moves {
        let worst = check(&folder, SUN, &found, moved);
        assert!(worst < SIGMAS, "{moved:?}: {worst}");
    }
}

/// u is linear in what emits: its parts by emissions, sky and sun, λ ∂u/∂λ, are u together.
#[test]
fn parts_by_surfaces_sky_and_sun_are_all_of_u() {
    let folder = Folder::new();
    let facing =
        "[[target]]\nname = 'sensor'\nat = { point = [2, 2, 1], facing = [1, -1, 1] }\n[walk]";
    let lamp =
        "[[problem.light]]\nat = [1, 1, 2]\nintensity = 300\n[[problem.surface]]\nname = 'ground'";
    let problem = SUN.replace("[walk]", facing);
    let problem = problem.replace("[[problem.surface]]\nname = 'ground'", lamp);
    let json = folder
        .solve(&problem, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    let found = derivatives(&json);
    for target in list(&json, "targets") {
        let name = target["name"].as_str().unwrap().to_owned();
        let u = &target["preconditioned"];
        let (mut sum, mut error) = (-number(u, "estimate"), number(u, "std_error"));
        for (quantity, value) in [
            ("sky", 1.0),
            ("light 1", 1.0),
            ("light 2", 1.0),
            ("ground emission", 2.0),
        ] {
            let [own, own_error] = found[&(name.clone(), quantity.to_owned())];
            assert!(
                own > 10.0 * own_error,
                "{name} {quantity}: {own} {own_error}"
            );
            (sum, error) = (sum + value * own, error + value * own_error);
        }
        println!("{name}: {sum} ± {error}");
        assert!(sum.abs() < SIGMAS * error, "{name}: {sum} {error}");
    }
}

/// Every channel is an equation of its own: its derivatives are those of a grey room, and those of the sum are their sum.
#[test]
fn channels_have_their_own_derivatives() {
    let folder = Folder::new();
    let of = |materials: [&str; 4], head: &str| {
        let [floor, light, rest, dark] = materials;
        format!(
            "[problem]\nkind = 'room'\n{head}\
             [[problem.surface]]\nname = 'floor'\npoints = [[0, 0], [2, 0]]\nreflectance = {floor}\nemission = {light}\n\
             [[problem.surface]]\nname = 'rest'\npoints = [[2, 0], [2, 1], [0, 1], [0, 0]]\nreflectance = {rest}\nemission = {dark}\n\
             [[target]]\nname = 'rest'\nover = 'rest'\n[walk]\nwalks = 60000\n[galerkin]\ncells = 60\ndegree = 1\npairs = 'rays'\n"
        )
    };
    let solve = |problem: &str| {
        let ran = folder.solve(problem, &["--json", "--sensitivities"]);
        derivatives(&ran.quietly(0).json())
    };
    let head = "channels = ['red', 'blue']\n";
    let colours = solve(&of(["[0.6, 0.2]", "[1, 0.5]", "[0.3, 0.7]", "0"], head));
    let red = solve(&of(["0.6", "1", "0.3", "0"], ""));
    let blue = solve(&of(["0.2", "0.5", "0.7", "0"], ""));
    assert_eq!(colours.len(), 12, "{colours:?}");
    for quantity in [
        "floor reflectance",
        "floor emission",
        "rest reflectance",
        "rest emission",
    ] {
        let one = |all: &HashMap<_, _>, target: &str| -> [f64; 2] {
            all[&(target.to_owned(), quantity.to_owned())]
        };
        let [[r, r_error], [b, b_error]] = [one(&red, "rest"), one(&blue, "rest")];
        let expected = [("rest red", r, r_error), ("rest blue", b, b_error)];
        for (target, grey, grey_error) in expected {
            let [own, error] = one(&colours, target);
            let z = (own - grey) / error.hypot(grey_error);
            assert!(z.abs() < SIGMAS, "{target} {quantity}: {own} {grey} {z}");
        }
    }
}

/// Compares all derivatives by a quantity that is at an end of its range with differences of the second order to one side.
fn check_end(
    folder: &Folder,
    problem: &str,
    found: &HashMap<(String, String), [f64; 2]>,
    (quantity, text, step): (&str, &str, f64),
) -> f64 {
    let (key, end) = text.rsplit_once(' ').unwrap();
    let at = |steps: f64| {
        let moved = end.trim().parse::<f64>().unwrap() + steps * step;
        assert!(problem.contains(text), "{text}");
        values(folder, &problem.replace(text, &format!("{key} {moved}\n")))
    };
    let (zero, one, two) = (at(0.0), at(1.0), at(2.0));
    let mut worst = 0.0_f64;
    for (((target, [u, a]), (_, [v, b])), (_, [w, c])) in zero.iter().zip(&one).zip(&two) {
        let difference = (-3.0 * u + 4.0 * v - w) / (2.0 * step);
        let [own, error] = found[&(target.clone(), quantity.to_owned())];
        let noise = (3.0 * a).hypot(4.0 * b).hypot(*c) / (2.0 * step);
        // The step leaves out less than a thousandth.
        let z = (own - difference) / error.hypot(noise).max(1e-3 * difference.abs());
        println!("{target} {quantity}: {own} ± {error}, {difference} ± {noise}, {z:.1}");
        assert!(error < 0.05 * own.abs() + noise.abs(), "{target}: {error}");
        worst = worst.max(z.abs());
    }
    worst
}

/// Walks end on black surfaces, and others go on from there: of a room, of a scene under a sky and the sun, of a tube and a circle.
#[test]
fn black_surfaces_have_derivatives() {
    let folder = Folder::new();
    let floor = "[[target]]\nname = 'floor'\nover = 'floor'\n[walk]";
    let room = HEAT
        .replace("emissivity = 0.9\n", "emissivity = 1\n")
        .replace("[walk]", floor);
    let scene = SUN.replace("reflectance = 0.4\n", "reflectance = 0\n");
    let tube = "[problem]\nkind = 'tube'\nlength = 2\nreflectance = 0\nends = [1, 0]\nemission = 0.5\n\
        [walk]\nwalks = 80000\n[[target]]\nname = 'right'\nover = 'right'\n[[target]]\nname = 'u'\nat = 0.5\n";
    let circle = "[problem]\nkind = 'circle'\nreflectance = [0.5, 0\n]\nemission = [1, 2]\n\
        [walk]\nwalks = 20000\n[[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'there'\nat = 4\n";
    for (problem, moved) in [
        (room, ("floor emissivity", "emissivity = 1\n", -0.02)),
        (scene, ("ground reflectance", "reflectance = 0\n", 0.05)),
        (tube.to_owned(), ("reflectance", "reflectance = 0\n", 0.05)),
        (circle.to_owned(), ("reflectance 2", "0.5, 0\n", 0.02)),
    ] {
        let ran = folder.solve(&problem, &["--json", "--sensitivities"]);
        let found = derivatives(&ran.quietly(0).json());
        let worst = check_end(&folder, &problem, &found, moved);
        assert!(worst < SIGMAS, "{moved:?}: {worst}");
    }
}

/// By temperature, by Planck's law, and by emissivities of all bands at once.
#[test]
fn bands_have_derivatives() {
    let folder = Folder::new();
    let problem = "[problem]\nkind = 'room'\nwavelengths = [4, 9]\n\
        [[problem.surface]]\nname = 'stove'\npoints = [[0, 0], [2, 0]]\nemissivity = [1, 0.7, 0.4]\ntemperature = 600\n\
        [[problem.surface]]\nname = 'rest'\npoints = [[2, 0], [2, 1], [0, 1], [0, 0]]\nemissivity = 0.6\ntemperature = 290\n\
        [[target]]\nname = 'rest'\nover = 'rest'\n[[target]]\nname = 'spot'\nat = { surface = 'stove', t = 0.3 }\n\
        [walk]\nwalks = 60000\n[galerkin]\ncells = 60\ndegree = 1\npairs = 'rays'\n";
    let json = folder
        .solve(problem, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    let found = derivatives(&json);
    // Of both targets, in three bands and their sum, by two emissivities and two temperatures.
    assert_eq!(found.len(), 32);
    let moves = [
        ("stove temperature", "temperature = 600", 0.2),
        ("rest temperature", "temperature = 290", 0.2),
        ("rest emissivity", "emissivity = 0.6", 0.02),
    ];
    for moved in moves {
        let worst = check(&folder, problem, &found, moved);
        assert!(worst < SIGMAS, "{moved:?}: {worst}");
    }
    let alone: HashMap<_, _> = found
        .into_iter()
        .filter(|((target, _), _)| target.ends_with("below 4 um"))
        .collect();
    let [own, _] = alone[&("spot below 4 um".to_owned(), "stove emissivity".to_owned())];
    assert!(own > 0.0, "{own}");
}

/// Channels that are equations of their own have the derivatives of each, from walks and from formulas.
#[test]
fn equations_of_channels_have_their_own_derivatives() {
    let folder = Folder::new();
    let solve = |problem: &str| {
        let ran = folder.solve(problem, &["--json", "--sensitivities"]);
        derivatives(&ran.quietly(0).json())
    };
    let sphere = |own: &str| {
        format!(
            "[problem]\nkind = 'sphere'\nasymmetry = 0.2\nemission = [1, 0.5, 0, 0]\n{own}\
             [[target]]\nname = 'pole'\nat = [0, 0]\n[[target]]\nname = 'mean'\nover = 'all'\n[walk]\nwalks = 20000\n"
        )
    };
    let of_sphere = |albedo: f64| 1.0 / (1.0 - albedo).powi(2);
    let spheres = sphere("albedo = 0.5\n[problem.channels]\na = {}\nb = { albedo = 0.25 }\n");
    let line = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = 'p * x * y'\nsource = 'x'\n\
        [problem.parameters]\np = 0.5\n[problem.channels]\na = {}\nb = { parameters.p = 0.25 }\n\
        [[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'u'\nat = 0.5\n";
    // u = x/(1 − p/3): ½ at the middle and in the mean.
    let of_line = |p: f64| 1.0 / (6.0 * (1.0 - p / 3.0).powi(2));
    let [sphere, found] = [solve(&spheres), solve(line)];
    for (found, quantity, exact) in [
        (&sphere, "albedo", [of_sphere(0.5), of_sphere(0.25)]),
        (&found, "p", [of_line(0.5), of_line(0.25)]),
    ] {
        let [a, b] = exact;
        for (channel, exact) in [("a", a), ("b", b), ("sum", a + b)] {
            for (target, own) in [("mean", exact), ("u", exact)] {
                let name = (format!("{target} {channel}"), quantity.to_owned());
                let Some([value, error]) = found.get(&name) else {
                    assert_eq!(target, "u", "{found:?}");
                    continue;
                };
                assert!(
                    (value - own).abs() < SIGMAS * error,
                    "{name:?}: {value} ± {error}, {own}"
                );
                assert!(*error < 0.02 * own, "{name:?}: {error}");
            }
        }
    }
    assert_eq!((sphere.len(), found.len()), (2 * 3 * 6, 2 * 3));
    let other = line.replace("parameters.p = 0.25", "parameters.q = 0.25");
    refused(
        &folder.solve(&other, &["--sensitivities"]),
        &["are by quantities that all channels name"],
    );
}

const LINE: &str = "[problem]\nkind = 'cube'\ndimension = 1\nkernel = 'a * x * y'\nsource = 'b * x'\n\
    [problem.parameters]\na = 0.5\nb = '2 * c'\nc = 0.5\n\
    [[target]]\nname = 'u'\nat = 0.5\n[[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'moment'\nweight = 'x'\n";

/// u = b x/(1 − a/3).
#[test]
fn derivatives_by_parameters_have_a_closed_form() {
    let folder = Folder::new();
    // A parameter knows those before it.
    let line = LINE.replace(
        "a = 0.5\nb = '2 * c'\nc = 0.5",
        "a = 0.5\nc = 0.5\nb = '2 * c'",
    );
    let system = line
        .replace("'cube'", "'system'")
        .replace("kernel = 'a * x * y'\nsource = 'b * x'\n", "")
        .replace(
            "[[target]]\nname = 'u'",
            "[[problem.equation]]\nkernel = ['a * x * y']\nsource = 'b * x'\n[[target]]\nname = 'u'",
        )
        .replace("at = 0.5\n", "at = 0.5\ncomponent = 1\n")
        .replace("over = 'all'", "over = 'all'\ncomponent = 1")
        .replace("weight = 'x'", "weight = 'x'\ncomponent = 1");
    for problem in [line, system] {
        let json = folder
            .solve(&problem, &["--json", "--sensitivities"])
            .quietly(0)
            .json();
        let found = derivatives(&json);
        assert_eq!(found.len(), 6, "{found:?}");
        let whole = 1.0 / (1.0 - 0.5 / 3.0);
        for (target, size) in [("u", 0.5), ("mean", 0.5), ("moment", 1.0 / 3.0)] {
            let of = |quantity: &str| found[&(target.to_owned(), quantity.to_owned())];
            for (quantity, exact) in [("a", whole * whole / 3.0), ("c", 2.0 * whole)] {
                let [own, error] = of(quantity);
                let off = (own - size * exact).abs();
                assert!(
                    off < SIGMAS * error && error < 1e-6,
                    "{target} {quantity}: {own} {error}"
                );
            }
        }
    }
}

#[test]
fn walks_that_miss_their_error_or_their_time_have_derivatives() {
    let folder = Folder::new();
    let late = HEAT.replace(
        "walks = 100000",
        "walks = 2000\ntarget_error = 1e-9\nabsorption = 0.2",
    );
    let ran = folder.solve(&late, &["--json", "--sensitivities", "--no-global"]);
    assert_eq!(ran.status, Some(3), "{ran:?}");
    assert_eq!(derivatives(&ran.json()).len(), 14);
    // At a time limit they end with what there is.
    let long = HEAT.replace("100000", "1000000000");
    let args = ["--json", "--sensitivities", "--time-limit", "0.3"];
    let json = folder.solve(&long, &args).json();
    let walks = number(&json["sensitivities"], "walks");
    assert!((4096.0..1e9).contains(&walks), "{walks}");
}

/// A sphere tells derivatives in a table of numbers and in parts, and not by resolvent walks.
#[test]
fn a_sphere_tells_derivatives_by_its_numbers() {
    let problem = "[problem]\nkind = 'sphere'\nalbedo = 0.5\nasymmetry = 0.2\nemission = [1, 0.5, 0, 0]\n\
        [[target]]\nname = 'mean'\nover = 'all'\n[[target]]\nname = 'pole'\nat = [0, 0]\n\
        [walk]\nwalks = 20000\nsensitivities = true\n";
    let folder = Folder::new();
    let out = folder.at("found.csv");
    folder.solve(problem, &["--out", &out]).quietly(0);
    let text = std::fs::read_to_string(&out).unwrap();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let head = rows.headers().unwrap().clone();
    let column = |name: &str| head.iter().position(|own| own == name).unwrap();
    let exact = [
        ("albedo", [4.0, 4.0]),
        ("emission 1", [2.0, 2.0]),
        ("emission 2", [0.0, 0.0]),
    ];
    for (row, record) in rows.records().map(Result::unwrap).enumerate() {
        for (quantity, exact) in exact {
            let number = |name: &str| record[column(name)].parse::<f64>().unwrap();
            let [own, error] = [format!("by {quantity}"), format!("by {quantity} std_error")]
                .map(|name| number(&name));
            assert!(
                (own - exact[row]).abs() < SIGMAS * error.max(1e-12) && error < 0.1,
                "{quantity}: {own} ± {error}"
            );
        }
    }
    let whole = folder.solve(problem, &["--json"]).quietly(0).json();
    let parts = [1, 2].map(|part| {
        let file = folder.at(&format!("{part}.part"));
        let of = format!("{part}/2");
        let part = folder.solve(problem, &["--part", &of, "--save", &file]);
        assert_eq!(part.status, Some(0), "{part:?}");
        file
    });
    let merged = common::fredholm(&["merge", &parts[0], &parts[1], "--json"])
        .quietly(0)
        .json();
    assert_eq!(derivatives(&merged), derivatives(&whole));
    refused(
        &folder.solve(problem, &["--method", "resolvent"]),
        &["are told by walks of the equation's chain"],
    );
    let fit = problem.replace("[walk]", "measured = { value = 2.5, error = 0.01 }\n[walk]")
        + "[fit]\nquantities = ['emission 1']\n";
    let ran = common::fredholm(&["fit", &folder.file("f.toml", &fit), "--json"])
        .quietly(0)
        .json();
    // At the pole 1/(1 − a) times e₀.
    let found = number(&list(&ran, "quantities")[0], "value");
    assert!((found - 1.25).abs() < 0.05, "{found}");
}

#[test]
fn what_has_no_derivatives_says_so() {
    let folder = Folder::new();
    let refuse = |problem: &str, words: &[&str]| {
        refused(&folder.solve(problem, &["--sensitivities"]), words);
    };
    let (none, _) = LINE.split_once("[problem.parameters]").unwrap();
    refuse(
        &format!(
            "{}[[target]]\nat = 0.5\n",
            none.replace("a * x", "x").replace("b * x", "x")
        ),
        &["sensitivities are by quantities, and this equation names none"],
    );
    let line = LINE.replace("b = '2 * c'\nc = 0.5", "b = 1");
    let jump = line.replace("'b * x'", "'x < a ? b : 0'");
    refuse(&jump, &["there is no derivative by `a`", "moves a jump"]);
    let told = format!("{jump}[walk]\nsensitivities = true\n");
    refused(
        &folder.solve(&told, &[]),
        &["sensitivities = true", "there is no derivative by `a`"],
    );
    let end = line.replace("dimension = 1", "dimension = 1\ndomain = [0, 'b']");
    let json = folder
        .solve(&end, &["--json", "--sensitivities"])
        .quietly(0)
        .json();
    assert!(
        derivatives(&json)
            .keys()
            .all(|(_, quantity)| quantity == "a")
    );
    refused(
        &folder.solve(&line, &["--sensitivities", "--global"]),
        &["--global"],
    );
}
