//! Walls from which the net flux is given, adiabatic ones among them.

use crate::common;

use common::{Folder, csv_rows, ended, fredholm, list, number, refused};

/// Stefan and Boltzmann's constant.
const SIGMA: f64 = 5.670374419e-8;

/// A surface with these lines on its material.
fn surface(name: &str, points: &str, material: &str) -> String {
    format!("[[problem.surface]]\nname = '{name}'\npoints = {points}\n{material}\n")
}

/// A right triangle of sides 4 (hot), 5 (cold) and 3, of which the last gives `flux`.
fn triangle(flux: &str) -> String {
    [
        "[problem]\nkind = 'room'\n".to_owned(),
        surface(
            "hot",
            "[[0, 0], [4, 0]]",
            "emissivity = 1\ntemperature = 400",
        ),
        surface(
            "cold",
            "[[4, 0], [0, 3]]",
            "emissivity = 1\ntemperature = 300",
        ),
        surface("side", "[[0, 3], [0, 0]]", flux),
        "[galerkin]\ncells = 60\ndegree = 1\n[walk]\nwalks = 10000\n".to_owned(),
        "[[target]]\nname = 'side'\nover = 'side'\n".to_owned(),
        "[[target]]\nname = 'spot'\nat = { surface = 'side', t = 0.25 }\n".to_owned(),
    ]
    .concat()
}

/// Asserts that an estimate is within 4.5 standard errors of a value: 1 in 150,000 are not.
fn assert_is(found: &serde_json::Value, value: f64) {
    let allowed = 4.5 * number(found, "std_error") + 1e-9 * value.abs();
    let estimate = number(found, "estimate");
    assert!((estimate - value).abs() <= allowed, "{found} for {value}");
}

#[test]
fn a_wall_between_a_hot_and_a_cold_one() {
    let folder = Folder::new();
    let [hot, cold] = [400.0_f64, 300.0].map(|t| SIGMA * t.powi(4));
    // What the wall sees of the hot one: by crossed strings (Hottel 1954) all of it, by angles the place at 2.25 from it.
    let mean = (3.0 + 4.0 - 5.0) / (2.0 * 3.0);
    let spot = 0.5 * (1.0 - 2.25 / f64::hypot(2.25, 4.0));
    for (flux, q, emissivity) in [
        ("net_flux = 0", 0.0, 0.3),
        ("net_flux = 50\nemissivity = 0.5", 50.0, 0.5),
        ("net_flux = -80.5\nemissivity = [0.9]", -80.5, 0.9),
    ] {
        let csv = folder.at("out.csv");
        let ran = folder.solve(&triangle(flux), &["--json", "--out", &csv]);
        let json = ran.quietly(0).json();
        for (target, share) in list(&json, "targets").iter().zip([mean, spot]) {
            // It does not see itself, and the others are black: u = q + H in closed form.
            let irradiance = share * hot + (1.0 - share) * cold;
            for key in ["plain", "preconditioned"] {
                assert_is(&target[key], q + irradiance);
            }
            assert_is(&target["irradiance"], irradiance);
            let fourth = (q + irradiance + (1.0 / emissivity - 1.0) * q) / SIGMA;
            assert_is(&target["temperature"], fourth.powf(0.25));
            assert_eq!(target["temperature"]["unit"], "K");
            assert_eq!(number(&target["net_flux"], "estimate"), q);
            assert_eq!(number(&target["net_flux"], "std_error"), 0.0);
        }
        let [_, _, side] = list(&json, "surfaces") else {
            panic!("{json}");
        };
        assert_eq!(side["walks"], 0);
        assert_eq!(side["is_given"], true);
        assert_eq!(number(&side["net_flux"], "estimate"), 3.0 * q);
        assert_is(&json["energy_balance"], 0.0);
        let rows = csv_rows(csv.as_ref());
        let column = rows[0].iter().position(|key| key == "temperature").unwrap();
        let written: f64 = rows[1][column].parse().unwrap();
        let told = number(&list(&json, "targets")[0]["temperature"], "estimate");
        assert_eq!(written, told);
    }
    let table = folder
        .solve(&triangle("net_flux = 50"), &[])
        .quietly(0)
        .stdout;
    assert!(
        table.contains("50 (given)") && table.contains("150 (given)"),
        "{table}"
    );
    // Without its emissivity the temperature of a heated wall is not known.
    assert!(!table.contains("temperature, K"), "{table}");
}

#[test]
fn two_adiabatic_walls_face_each_other() {
    let folder = Folder::new();
    // By symmetry u is half of both together half way up, and in the mean over the sides.
    let problem = [
        "[problem]\nkind = 'room'\n".to_owned(),
        surface(
            "floor",
            "[[0, 0], [2, 0]]",
            "emissivity = 0.8\ntemperature = 350",
        ),
        surface("right", "[[2, 0], [2, 3]]", "net_flux = 0"),
        surface(
            "ceiling",
            "[[2, 3], [0, 3]]",
            "emissivity = 0.8\ntemperature = 280",
        ),
        surface("left", "[[0, 3], [0, 0]]", "net_flux = 0"),
        "[galerkin]\ncells = 60\ndegree = 1\n[walk]\nwalks = 10000\n".to_owned(),
        "[[target]]\nname = 'sides'\nover = ['left', 'right']\n".to_owned(),
        "[[target]]\nname = 'half way'\nat = { surface = 'right', t = 0.5 }\n".to_owned(),
        "[[target]]\nname = 'air'\nat = [1, 1.5]\n".to_owned(),
    ]
    .concat();
    let half = 0.5 * SIGMA * (350.0_f64.powi(4) + 280.0_f64.powi(4));
    for settings in [
        &[][..],
        &["--pairs", "pointwise"],
        &["--degree", "2"],
        &["--degree", "0", "--scalar", "f32"],
    ] {
        let json = folder.solve(&problem, &[&["--json"], settings].concat());
        let json = json.quietly(0).json();
        for target in list(&json, "targets") {
            assert_is(&target["plain"], half);
            assert_is(&target["preconditioned"], half);
        }
        for target in &list(&json, "targets")[..2] {
            assert_is(&target["temperature"], (half / SIGMA).powf(0.25));
        }
        let fluxes = list(&json, "surfaces");
        let [floor, ceiling] = [0, 2].map(|i| &fluxes[i]["net_flux"]);
        let error = number(floor, "std_error").hypot(number(ceiling, "std_error"));
        let sum = number(floor, "estimate") + number(ceiling, "estimate");
        assert!(
            sum.abs() < 4.5 * error && number(floor, "estimate") > 100.0,
            "{json}"
        );
    }
}

#[test]
fn fluxes_that_cannot_be() {
    let folder = Folder::new();
    let refused = |problem: &str, words: &str| {
        refused(&folder.solve(problem, &[]), &[words]);
    };
    refused(
        &triangle("net_flux = 1\ntemperature = 300"),
        "one follows from the other",
    );
    refused(
        &triangle("net_flux = 1\nreflectance = 0.5"),
        "give either `reflectance`",
    );
    refused(&triangle("net_flux = nan"), "finite");
    refused(
        &triangle("net_flux = [1, 2]"),
        "one for each of its segments",
    );
    refused(
        &triangle("net_flux = 0\nemissivity = [0.5, 0.5]"),
        "one for each of its segments",
    );
    refused(
        &triangle("emissivity = 0\ntemperature = 300"),
        "has `net_flux = 0`",
    );
    refused(
        &triangle("emissivity = 0.5"),
        "no `temperature` or `net_flux`",
    );
    let black = [
        "emissivity = 1\ntemperature = 400",
        "emissivity = 1\ntemperature = 300",
    ];
    let none = triangle("net_flux = 0")
        .replace(black[0], "net_flux = 10")
        .replace(black[1], "net_flux = -10");
    refused(&none, "give one surface at least a `temperature`");
    let path = folder.file("none.toml", &none);
    let ran = fredholm(&["check", &path]);
    assert!(
        ran.stderr.contains("no wall of this part of the room"),
        "{ran:?}"
    );
    // Of light: perfectly white walls are walls.
    let light = |material: &str| {
        none.replace("net_flux = 10", material)
            .replace("net_flux = -10", "reflectance = 1")
    };
    let white = light("reflectance = 1").replace("net_flux = 0", "reflectance = 1.0");
    refused(&white, "needs a reflectance below 1");
    let white =
        light("reflectance = 0.5\nemission = 1").replace("net_flux = 0", "reflectance = 1.0");
    folder.solve(&white, &[]).quietly(0);
}

/// The rows of `factors --watts`.
fn watts(folder: &Folder, text: &str) -> Vec<Vec<f64>> {
    let file = folder.file("watts.toml", text);
    let json = fredholm(&["factors", &file, "--watts", "--json"])
        .quietly(0)
        .json();
    assert_eq!(json["unit"], "W per metre");
    let row = |row: &serde_json::Value| -> Vec<f64> {
        let row = row.as_array().unwrap();
        row.iter().map(|watts| watts.as_f64().unwrap()).collect()
    };
    list(&json, "factors").iter().map(row).collect()
}

#[test]
fn watts_from_surface_to_surface() {
    let folder = Folder::new();
    let black = triangle("emissivity = 1\ntemperature = 350");
    let rows = watts(&folder, &black);
    let exchanged =
        |share: f64, [own, other]: [f64; 2]| share * SIGMA * (own.powi(4) - other.powi(4));
    // By crossed strings: half of both sides less the third, of lengths 4, 5 and 3.
    let expected = exchanged(3.0, [400.0, 300.0]);
    assert!((rows[0][1] - expected).abs() < 1e-9 * expected, "{rows:?}");
    for (i, row) in rows.iter().enumerate() {
        for (j, watts) in row.iter().enumerate() {
            assert!((watts + rows[j][i]).abs() < 1e-9 * expected, "{rows:?}");
        }
    }
    // On black walls u is even, and walks find the same.
    let json = folder.solve(&black, &["--json"]).quietly(0).json();
    for (row, surface) in rows.iter().zip(list(&json, "surfaces")) {
        assert_is(&surface["net_flux"], row.iter().sum());
    }
    // Resistances in a row (Oppenheim 1956): 0.5 of a flat floor of 5 m, 0.8 of 9 m above it.
    let grey = [
        "[problem]\nkind = 'room'\n".to_owned(),
        surface(
            "floor",
            "[[0, 0], [5, 0]]",
            "emissivity = 0.5\ntemperature = 400",
        ),
        surface(
            "rest",
            "[[5, 0], [5, 2], [0, 2], [0, 0]]",
            "emissivity = 0.8\ntemperature = 300",
        ),
        "[[target]]\nname = 'floor'\nover = 'floor'\n".to_owned(),
    ];
    let rows = watts(&folder, &grey.concat());
    let resistance = 0.5 / (0.5 * 5.0) + 1.0 / 5.0 + 0.2 / (0.8 * 9.0);
    let expected = exchanged(1.0 / resistance, [400.0, 300.0]);
    assert!((rows[0][1] - expected).abs() < 1e-9 * expected, "{rows:?}");
    let table = fredholm(&["factors", &folder.at("watts.toml"), "--watts"]).quietly(0);
    assert!(
        table.stdout.contains("W per metre, from"),
        "{}",
        table.stdout
    );
    // No temperature, no watts.
    let file = folder.file("flux.toml", triangle("net_flux = 0"));
    let refused = fredholm(&["factors", &file, "--watts"]);
    assert!(refused.stderr.contains("`temperature`") && refused.stderr.contains("\"side\""));
}

/// An emissivity without a temperature is refused in both kinds, and serves form factors of grey surfaces.
#[test]
fn surfaces_without_a_temperature_are_refused() {
    let side = |name: &str, rest: &str, warm: &str| {
        format!("[[problem.surface]]\nname = '{name}'\n{rest}\nemissivity = 0.5\n{warm}")
    };
    let warm = "temperature = 300\n";
    let room = side("floor", "points = [[0, 0], [1, 0]]", "")
        + &side("rest", "points = [[1, 0], [0, 1], [0, 0]]", warm);
    let scene = side("plate", "polygon = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]", "")
        + &side("other", "polygon = [[0, 0, 1], [0, 1, 1], [1, 0, 1]]", warm);
    let target = |name: &str| {
        format!(
            "[[target]]\nover = '{name}'\n[galerkin]\ncells = 20\ndegree = 0\n[walk]\nwalks = 1000\n"
        )
    };
    let room = format!("[problem]\nkind = 'room'\n{room}{}", target("floor"));
    let scene = format!(
        "[problem]\nkind = 'scene'\nopen = true\n{scene}{}",
        target("plate")
    );
    let in_a_scene = "an emissivity is given of \"plate\", and no `temperature` or `net_flux`";
    let folder = Folder::new();
    for (problem, words) in [
        (&room, "no `temperature` or `net_flux`"),
        (&scene, in_a_scene),
    ] {
        refused(&folder.solve(problem, &[]), &[words]);
        let at_zero = problem.replacen(
            "emissivity = 0.5\n",
            "emissivity = 0.5\ntemperature = 0\n",
            1,
        );
        folder.solve(&at_zero, &[]).quietly(0);
    }
    let path = folder.file("scene.toml", scene);
    ended(0, &["factors", &path, "--grey"]);
}
