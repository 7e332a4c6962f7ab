//! `fredholm check`, `solve` and `render` of scenes in space.

use crate::common;

use common::{Folder, ended, fredholm, refused};

/// A room with a screen in it, of these materials.
fn room_with_screen(materials: [&str; 3]) -> String {
    let [room, screen, back] = materials;
    format!(
        r#"[problem]
kind = "scene"
[[problem.surface]]
name = "room"
box = [[0, 0, 0], [2, 1, 1]]
inward = true
{room}
[[problem.surface]]
name = "screen"
polygon = [[1, 0.2, 0], [1, 0.8, 0], [1, 0.8, 0.7], [1, 0.2, 0.7]]
{screen}
[[problem.surface]]
name = "back"
polygon = [[1, 0.2, 0.7], [1, 0.8, 0.7], [1, 0.8, 0], [1, 0.2, 0]]
{back}
[walk]
walks = 2000
[galerkin]
cells = 60
degree = 1
[[target]]
name = "corner"
at = [0, 0, 0]
[[target]]
name = "screen"
at = {{ surface = "back", point = [1, 0.5, 0.5] }}
[[target]]
name = "some"
over = ["screen", "back"]
[[target]]
name = "all"
over = "all"
"#
    )
}

/// F = 1 - rho gives u = 1, whatever hides what: in every degree, scalar and estimator; by day each scalar has an estimator of its own.
#[test]
fn a_furnace_in_space() {
    let folder = Folder::new();
    let materials = [0.7, 0.2, 0.5].map(|rho: f64| {
        let emission = 1.0 - rho;
        format!("reflectance = {rho}\nemission = {emission}")
    });
    let file = folder.file(
        "furnace.toml",
        room_with_screen([&materials[0], &materials[1], &materials[2]]),
    );
    for degree in ["0", "1", "2"] {
        for (scalar, rounding) in [("f64", 1e-12), ("f32", 1e-4)] {
            for estimator in ["absorption", "collision"] {
                let is_own = (scalar == "f64") == (estimator == "absorption");
                if !is_own && !common::is_long() {
                    continue;
                }
                let options = [
                    "--degree",
                    degree,
                    "--scalar",
                    scalar,
                    "--estimator",
                    estimator,
                ];
                let args = [
                    &["solve", &file, "--json", "--cells", "30"],
                    options.as_slice(),
                ];
                let json = ended(0, &args.concat()).json();
                for target in common::list(&json, "targets") {
                    for kind in ["plain", "preconditioned"] {
                        let off = common::number(&target[kind], "estimate") - 1.0;
                        // Nothing but the number of walks decides whether there is an error bar.
                        let error = target[kind]["std_error"].as_f64().unwrap_or(0.0);
                        assert!(off.abs() <= 4.9 * error + rounding, "{options:?}: {target}");
                    }
                }
            }
        }
    }
}

/// All at one temperature: nothing flows, also through a surface that gives no heat, and all have that temperature.
#[test]
fn an_isothermal_room() {
    let folder = Folder::new();
    let text = room_with_screen([
        "emissivity = 0.8\ntemperature = \"26.85 C\"",
        "temperature = 300",
        "net_flux = 0\nemissivity = 0.5",
    ]);
    let air = "[[target]]\nname = \"air\"\nat = [1.5, 0.5, 0.5]\n\
               [[target]]\nname = \"meter\"\nat = { point = [1.5, 0.5, 0.5], facing = [-1, 0.2, 0] }\n";
    let file = folder.file("isothermal.toml", format!("{text}{air}"));
    let black = 5.670_374_419e-8 * 300_f64.powi(4);
    let close = |of: &serde_json::Value, expected: f64| {
        let off = (common::number(of, "estimate") - expected).abs();
        let allowed = 4.9 * of["std_error"].as_f64().unwrap_or(0.0) + 1e-9 * black;
        assert!(off <= allowed, "{of} for {expected}");
        assert!(allowed < 0.25 * black, "{of}");
    };
    for estimator in ["absorption", "collision"] {
        let args = [
            "solve",
            &file,
            "--estimator",
            estimator,
            "--json",
            "--cells",
            "40",
        ];
        let json = ended(0, &args).json();
        let [corner, screen, some, all, air, meter] = common::list(&json, "targets") else {
            panic!("{json}")
        };
        for target in [corner, screen, all, air, meter] {
            for kind in ["plain", "preconditioned"] {
                close(&target[kind], black);
            }
        }
        close(&corner["irradiance"], black);
        close(&corner["net_flux"], 0.0);
        close(&screen["temperature"], 300.0);
        assert_eq!(screen["net_flux"]["estimate"], 0.0);
        // Two materials have no net flux in common, but an irradiance.
        assert!(some["net_flux"].is_null());
        close(&some["irradiance"], black);
        close(&air["radiant_temperature"], 300.0);
        close(&meter["radiant_temperature"], 300.0);
        close(&meter["irradiance"], black);
        assert!(meter["net_flux"].is_null() && meter["temperature"].is_null());
        for surface in common::list(&json, "surfaces") {
            assert_eq!(surface["net_flux"]["unit"], "W");
            close(&surface["net_flux"], 0.0);
        }
    }
}

/// What a light meter shows: next to a surface its irradiance, and below a lamp I/r² and what surfaces reflect.
#[test]
fn a_light_meter() {
    let folder = Folder::new();
    let lit = room_with_screen(["reflectance = 0.5", "emission = 3", "reflectance = 0.2"]);
    let targets = "[[target]]\nname = \"floor\"\nat = [0.4, 0.5, 0]\n\
                   [[target]]\nname = \"meter\"\nat = { point = [0.4, 0.5, 1e-6], facing = [0, 0, 2] }\n";
    folder.file("places.csv", "0.4,0.5,1e-6,0,0,1\n1.5,0.5,0.5\n");
    let listed = "[[target]]\nname = \"listed\"\nat = \"places.csv\"\n";
    let file = folder.file("lit.toml", format!("{lit}{targets}{listed}"));
    let options = ["--cells", "60", "--walks", "20000", "--json"];
    let json = ended(0, &[&["solve", &file], options.as_slice()].concat()).json();
    let all = common::list(&json, "targets");
    let [floor, meter, listed] = [4, 5, 6].map(|number| &all[number]);
    let of = |value: &serde_json::Value| {
        ["estimate", "std_error"].map(|number| common::number(value, number))
    };
    let [expected, first] = of(&floor["irradiance"]);
    for meter in [meter, listed] {
        let [found, second] = of(&meter["preconditioned"]);
        let error = first.hypot(second);
        assert!(
            (found - expected).abs() < 4.9 * error,
            "{meter} for {floor}"
        );
        assert!(error < 0.05 * expected, "{meter}");
        assert_eq!(of(&meter["irradiance"]), [found, second]);
    }
    let at: Vec<&serde_json::Value> = all.iter().map(|target| &target["position"]).collect();
    assert_eq!(*at[1], serde_json::json!([1.0, 0.5, 0.5]));
    assert_eq!(*at[5], serde_json::json!([0.4, 0.5, 1e-6]));
    // Nothing is reflected: 90/3² from the lamp, whose rays a plate hides from a meter below it.
    let dark = "[problem]\nkind = \"scene\"\nopen = true\n\
                [[problem.light]]\nat = [0, 0, 3]\nintensity = 90\n\
                [[problem.surface]]\nname = \"plate\"\ntwo_sided = true\nreflectance = 0\n\
                polygon = [[1, -1, 1], [2, -1, 1], [2, 1, 1], [1, 1, 1]]\n";
    let target = |name: &str, x: f64| {
        format!(
            "[[target]]\nname = \"{name}\"\nat = {{ point = [{x}, 0, 0], facing = [0, 0, 1] }}\n"
        )
    };
    let file = folder.file(
        "dark.toml",
        dark.to_owned() + &target("below", 0.0) + &target("hidden", 2.0),
    );
    let json = ended(0, &["solve", &file, "--walks", "1000", "--json"]).json();
    let all = common::list(&json, "targets");
    let seen =
        [0, 1].map(|number: usize| common::number(&all[number]["preconditioned"], "estimate"));
    assert!(
        (seen[0] - 10.0).abs() < 1e-12 && seen[1].abs() < 1e-12,
        "{seen:?}"
    );
    let refused = [
        (
            "facing = [0, 0, 1]",
            "facing = [0, 0, 0]",
            "is no direction",
        ),
        ("facing = [0, 0, 1]", "facing = [0, 1]", "three coordinates"),
        (
            "point = [0, 0, 0]",
            "point = [0, 0, 9e9]",
            "not between the surfaces",
        ),
    ];
    let text = dark.to_owned() + &target("below", 0.0);
    for (from, to, words) in refused {
        assert!(text.contains(from), "{text}");
        let ran = ended(
            2,
            &["solve", &folder.file("wrong.toml", text.replace(from, to))],
        );
        assert!(ran.stderr.contains(words), "{}", ran.stderr);
    }
}

/// What a heater gives arrives elsewhere: the energy balance.
#[test]
fn a_heater() {
    let folder = Folder::new();
    let text = room_with_screen([
        "emissivity = 0.8\ntemperature = 290",
        "emissivity = 0.9\ntemperature = 300",
        "net_flux = 500",
    ]);
    let file = folder.file("heater.toml", text);
    let options = ["--walks", "20000", "--cells", "60", "--degree", "1"];
    let json = ended(
        0,
        &[&["solve", &file, "--json"], options.as_slice()].concat(),
    )
    .json();
    let energy = &json;
    let balance = &energy["energy_balance"];
    let [off, error] = ["estimate", "std_error"].map(|of| common::number(balance, of));
    assert!(off.abs() <= 4.9 * error && error < 10.0, "{balance}");
    let back = &common::list(energy, "surfaces")[2];
    // 0.6 by 0.7.
    let given = common::number(&back["net_flux"], "estimate");
    assert!(
        (given - 210.0).abs() < 1e-9 && back["is_given"] == true,
        "{back}"
    );
    // Without its emissivity nobody knows its temperature.
    let screen = &common::list(&json, "targets")[1];
    assert!(screen["temperature"].is_null(), "{screen}");
    let csv = folder.at("heater.csv");
    ended(
        0,
        &[
            "solve", &file, "--walks", "500", "--cells", "30", "--out", &csv,
        ],
    );
    let csv = std::fs::read_to_string(csv).unwrap();
    assert!(
        csv.contains("net_flux_in_all") && csv.contains("net flux out of back"),
        "{csv}"
    );
}

/// A furnace looks the same from everywhere, and its picture has one grey; what a pixel says is what a target says.
#[test]
fn what_a_camera_sees() {
    let folder = Folder::new();
    let even = room_with_screen(["reflectance = 0.7\nemission = 0.3"; 3]);
    let file = folder.file("furnace.toml", even.replace("cells = 60", "cells = 20"));
    let at = |name: &str| folder.at(name);
    let small = ["--width", "24", "--height", "16", "--walks", "8"];
    let render = |status: i32, file: &str, out: &str, more: &[&str]| {
        let args = [&["render", file, "-o", out], small.as_slice(), more].concat();
        ended(status, &args)
    };
    let numbers = at("seen.csv");
    let inside = [
        "--from",
        "0.2,0.3,0.4",
        "--towards",
        "2,0.5,0.5",
        "--angle",
        "60",
    ];
    for threads in ["1", "2"] {
        let before = std::fs::read(&numbers).ok();
        let more = [inside.as_slice(), &["--threads", threads]].concat();
        let said = render(0, &file, &numbers, &more).stdout;
        assert!(
            said.contains("24 x 16 pixels, 384 that see something"),
            "{said}"
        );
        let after = std::fs::read(&numbers).unwrap();
        assert!(before.is_none_or(|before| before == after));
    }
    let text = std::fs::read_to_string(&numbers).unwrap();
    assert_eq!(text.lines().next(), Some("column,row,seen,std_error"));
    for line in text.lines().skip(1) {
        let fields: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        // v is 1 but for where its iteration ended, and few walks find the rest.
        assert!((fields[2] - 1.0).abs() <= 1e-5, "{line}");
    }
    // Light from a screen: a pixel far from edges has the radiosity of the point in its middle.
    let lit = room_with_screen(["reflectance = 0.5", "emission = 3", "reflectance = 0.2"]);
    let lit = lit.replace("at = [0, 0, 0]", "at = [0.4, 0.5, 0]");
    let lit = lit.replace("cells = 60", "cells = 20");
    let file = folder.file("lit.toml", lit);
    let above = [
        "--from",
        "0.4,0.5,0.9",
        "--towards",
        "0.4,0.5,0",
        "--angle",
        "0.5",
    ];
    let more = [
        above.as_slice(),
        &["--walks", if common::is_long() { "200" } else { "60" }],
    ]
    .concat();
    let args = [
        "render", &file, "-o", &numbers, "--width", "16", "--height", "16",
    ];
    ended(0, &[args.as_slice(), more.as_slice()].concat());
    let text = std::fs::read_to_string(&numbers).unwrap();
    let seen: Vec<f64> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(2).unwrap().parse().unwrap())
        .collect();
    let mean = seen.iter().sum::<f64>() / seen.len() as f64;
    let deviation = seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>().sqrt() / seen.len() as f64;
    let options = ["--estimator", "collision", "--walks", "20000", "--json"];
    let json = ended(0, &[&["solve", &file], options.as_slice()].concat()).json();
    let corner = &common::list(&json, "targets")[0]["preconditioned"];
    let error = common::number(corner, "std_error").hypot(deviation);
    let off = mean - common::number(corner, "estimate");
    // Over the picture, a hundredth of the room's height wide, u changes by less than its error.
    assert!(off.abs() <= 4.9 * error, "{mean} for {corner}");
    let pictures = [at("a.png"), at("a.svg"), at("errors.png")];
    let beside = ["--side-by-side", "--errors", &pictures[2]];
    let said = render(0, &file, &pictures[0], &beside).stdout;
    assert!(said.contains("plain: "), "{said}");
    render(0, &file, &pictures[1], &["--log"]);
    assert!(std::fs::read(&pictures[2]).unwrap().starts_with(b"\x89PNG"));
    let refused = [
        (["--profile", "--json"], "are for rooms"),
        (["--from", "1,2"], "three numbers"),
        (["--angle", "180"], "less than 180 degrees"),
        (
            ["--towards", "nan,0,0"],
            "looks from one point towards another",
        ),
    ];
    for (more, words) in refused {
        let ran = fredholm(&[&["render", &file, "-o", &pictures[0]], more.as_slice()].concat());
        assert_ne!(ran.status, Some(0));
        assert!(ran.stderr.contains(words), "{}", ran.stderr);
    }
}

/// The bits do not depend on threads or parts, and walks with the neighbour equation agree with plain ones at a smaller error.
#[test]
fn light_behind_a_screen() {
    let folder = Folder::new();
    let materials = [
        "reflectance = 0.6",
        "reflectance = 0.5\nemission = 3",
        "reflectance = 0.4",
    ];
    let file = folder.file("screen.toml", room_with_screen(materials));
    let options = ["--cells", "240", "--degree", "1", "--json"];
    let run = |more: &[&str]| ended(0, &[&["solve", &file], options.as_slice(), more].concat());
    let one = run(&["--threads", "1"]);
    assert_eq!(one.timeless(), run(&["--threads", "2"]).timeless());
    for target in common::list(&one.json(), "targets") {
        let [plain, own] = ["plain", "preconditioned"].map(|kind| &target[kind]);
        let difference = common::number(plain, "estimate") - common::number(own, "estimate");
        let [plain, own] = [plain, own].map(|of| common::number(of, "std_error"));
        assert!(difference.abs() < 4.9 * plain.hypot(own), "{target}");
        assert!(own < 0.3 * plain, "{target}");
    }
    // Sixteen batches are the least.
    let text = room_with_screen(materials).replace("[walk]\n", "[walk]\nbatch = 512\n");
    let file = folder.file("batches.toml", text);
    let chosen = ended(
        0,
        &[
            "solve",
            &file,
            "--target-error",
            "0.01",
            "--walks",
            "1000000",
            "--json",
        ],
    )
    .json();
    for target in common::list(&chosen, "targets") {
        assert!(common::number(&target["preconditioned"], "std_error") <= 0.01);
    }
}

/// √Var of both estimates, predicted and measured, within 15 %; the same bits on any number of threads. The family of scenes that tells
/// how good predictions are is in `fredholm`, test `scene_predictions`.
#[test]
fn predictions_are_what_solve_measures() {
    let folder = Folder::new();
    let materials = [
        "reflectance = 0.6",
        "reflectance = 0.5\nemission = 3",
        "reflectance = 0.4",
    ];
    let text = room_with_screen(materials);
    let file = folder.file("screen.toml", &text);
    let options = ["--cells", "60", "--degree", "1", "--json"];
    let run = |command: &[&str]| ended(0, &[command, &[&file], options.as_slice()].concat());
    let predict = |threads: &str| run(&["diagnose", "--nodes", "400", "--threads", threads]);
    let mut all = ["1", "2"].map(|threads| predict(threads).json());
    all.iter_mut()
        .for_each(|json| json["seconds"] = serde_json::Value::Null);
    let [predicted, again] = all;
    assert_eq!(predicted, again);
    assert_eq!(common::list(&predicted, "other_pairs").len(), 0);
    let measured = run(&["solve", "--walks", "20000"]).json();
    let measured = common::list(&measured, "targets");
    for (predicted, measured) in common::list(&predicted, "targets")
        .iter()
        .zip(measured.iter())
    {
        for kind in ["plain", "preconditioned"] {
            let found = common::number(&measured[kind], "std_dev");
            let ratio = common::number(predicted, kind) / found;
            assert!((ratio - 1.0).abs() < 0.15, "{kind} {ratio} {predicted}");
        }
    }
    let refused = |text: String, words: &str| {
        let file = folder.file("refused.toml", text);
        let ran = ended(2, &["diagnose", &file, "--cells", "20"]);
        assert!(ran.stderr.contains(words), "{}", ran.stderr);
    };
    refused(
        text.replace("at = [0, 0, 0]", "at = [0.5, 0.5, 0.5]"),
        "start between the surfaces are not predicted",
    );
    refused(
        text.replace("emission = 3", "emission = [3, 2, 1]"),
        "in several channels, or on the way back, are not predicted",
    );
}

#[test]
fn what_a_scene_is_not_asked() {
    let folder = Folder::new();
    let whole = room_with_screen(["reflectance = 0.5"; 3]);
    let refused = |from: &str, to: &str, words: &str| {
        assert!(whole.contains(from));
        let file = folder.file("wrong.toml", whole.replace(from, to));
        let ran = ended(2, &["solve", &file]);
        assert!(ran.stderr.contains(words), "{}", ran.stderr);
    };
    refused(
        "at = [0, 0, 0]",
        "at = [0.5, 0.5, 1.5]",
        "is neither on a surface nor between them",
    );
    refused("at = [0, 0, 0]", "at = [0, 0]", "three coordinates");
    refused("at = [0, 0, 0]", "grid = 10", "a `grid` is along a line");
    refused(
        "point = [1, 0.5, 0.5]",
        "point = [1, 0.5, 0.9]",
        "is not on its surface",
    );
    refused("point = [1, 0.5, 0.5]", "t = 0.5", "point = [x, y, z]");
    refused(
        "surface = \"back\"",
        "surface = \"bakc\"",
        "did you mean \"back\"?",
    );
    refused("[\"screen\", \"back\"]", "[0, 1]", "`over` must be");
    refused("cells = 60", "pairs = \"paper\"", "leave `pairs` out");
    refused("cells = 60", "pairs = \"rays\"", "leave `pairs` out");
    refused("cells = 60", "degree = 3", "degree");
    refused("cells = 60", "points = 3", "`points` belongs to cubes");
    let file = folder.file("right.toml", &whole);
    // Everything is dark and nobody waits: both estimates are 0.
    let dark = ended(0, &["solve", &file, "--cells", "20", "--json"]).json();
    assert_eq!(dark["targets"][0]["plain"]["estimate"], 0.0);
}

/// Of a warm plate that sees nothing but a cold sky the net flux is that of two bodies; of a pit whose walls are black the irradiances are
/// those of the form factors to the sky.
#[test]
fn light_of_the_sky() {
    let folder = Folder::new();
    let plate = "[[problem.surface]]\nname = \"plate\"\npolygon = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]\n";
    let night = |sky: &str| {
        format!(
            "[problem]\nkind = \"scene\"\nsky = {sky}\n{plate}emissivity = 0.9\ntemperature = 300\n[[target]]\nname = \"all\"\nover = \"all\"\n"
        )
    };
    let file = folder.file("night.toml", night("{ temperature = \"-23.15 C\" }"));
    let json = ended(
        0,
        &["solve", &file, "--cells", "4", "--walks", "100", "--json"],
    )
    .json();
    let flux = common::number(&common::list(&json, "targets")[0]["net_flux"], "estimate");
    let expected = 0.9 * 5.670_374_419e-8 * (300.0_f64.powi(4) - 250.0_f64.powi(4));
    assert!(
        (flux / expected - 1.0).abs() < 1e-9,
        "{flux} for {expected}"
    );

    let pit = "[problem]\nkind = \"scene\"\nsky = { emission = 100 }\n\
               [[problem.surface]]\nname = \"floor\"\npolygon = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]\nreflectance = 0\n\
               [[problem.surface]]\nname = \"walls\"\npolygons = [[[0, 0, 0], [0, 0, 1], [2, 0, 1], [2, 0, 0]], \
               [[2, 0, 0], [2, 0, 1], [2, 2, 1], [2, 2, 0]], [[2, 2, 0], [2, 2, 1], [0, 2, 1], [0, 2, 0]], \
               [[0, 2, 0], [0, 2, 1], [0, 0, 1], [0, 0, 0]]]\nreflectance = 0\n\
               [[target]]\nname = \"floor\"\nover = \"floor\"\n[[target]]\nname = \"walls\"\nover = \"walls\"\n";
    let file = folder.file("pit.toml", pit);
    let factors = ended(0, &["factors", &file, "--json"]).json();
    let of_sky = &common::list(&factors["sky"], "factors");
    for threads in ["1", "2"] {
        let args = [
            "solve",
            &file,
            "--cells",
            "50",
            "--walks",
            "20000",
            "--threads",
            threads,
            "--json",
        ];
        let json = ended(0, &args).json();
        for (target, row) in common::list(&json, "targets").iter().zip(of_sky.iter()) {
            let share = row[0].as_f64().unwrap();
            let [found, error] =
                ["estimate", "std_error"].map(|n| common::number(&target["irradiance"], n));
            assert!(
                (found - 100.0 * share).abs() < 4.9 * error,
                "{target} for {share}"
            );
            assert!(error < 1.0, "{target}");
        }
    }
    for (sky, words) in [
        ("\"uniform\"", "walks need its `emission` or `temperature`"),
        (
            "{ emission = [1, 2] }",
            "one number for all or one for each",
        ),
        ("{ emission = 1, temperature = 2 }", "either the `emission`"),
    ] {
        let file = folder.file("wrong.toml", night(sky));
        refused(&fredholm(&["solve", &file]), &[words]);
    }
}

/// A black plate under a black sky of its own: what is asked for is what is converged, and named.
#[test]
fn what_is_asked_for_in_place_of_u() {
    let folder = Folder::new();
    let text = |ask: &str| {
        format!(
            "[problem]\nkind = \"scene\"\nopen = true\n[[problem.surface]]\nname = \"a\"\ntemperature = 300\n\
             polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n[[problem.surface]]\nname = \"b\"\ntemperature = 400\n\
             polygon = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]\n[[target]]\nname = \"a\"\nover = \"a\"\n{ask}\n"
        )
    };
    let solve = |ask: &str, more: &[&str]| folder.solve(&text(ask), more);
    let irradiance = 0.199_824_895_698_387 * 5.670_374_419e-8 * 400_f64.powi(4);
    let ran = solve("ask = \"irradiance\"", &["--json", "--target-error", "1"]);
    assert_eq!(ran.status, Some(0), "{ran:?}");
    let report = ran.json();
    let own = &report["targets"][0];
    let number = |key: &str| own["preconditioned"][key].as_f64().unwrap();
    assert_eq!(own["ask"], "irradiance");
    assert!(number("std_error") <= 1.0);
    assert!(
        (number("estimate") - irradiance).abs() < 5.0 * number("std_error"),
        "{own}"
    );
    let ran = solve("ask = \"net_flux\"", &["--json", "--walks", "20000"]);
    let report = ran.json();
    let own = &report["targets"][0]["preconditioned"];
    let exact = 5.670_374_419e-8 * 300_f64.powi(4) - irradiance;
    let off = (own["estimate"].as_f64().unwrap() - exact).abs();
    assert!(
        off < 5.0 * own["std_error"].as_f64().unwrap() && own["unit"] == "W/m2",
        "{own}"
    );
    let table = solve("ask = \"net_flux\"", &["--walks", "2000"]).stdout;
    assert!(table.contains("a: net flux, W/m2"), "{table}");
    // In the middle between two black plates of the same size, open all round: by symmetry half of what comes from both plates.
    let middle = text("ask = \"temperature\"").replace("over = \"a\"", "at = [0.5, 0.5, 0.5]");
    let ran = folder.solve(&middle, &["--json", "--target-error", "0.2"]);
    assert_eq!(ran.status, Some(0), "{ran:?}");
    let own = &ran.json()["targets"][0];
    let number = |key: &str| own["preconditioned"][key].as_f64().unwrap();
    // Each plate is one of six sides of a cube.
    let exact = ((300_f64.powi(4) + 400_f64.powi(4)) / 6.0).powf(0.25);
    assert!(number("std_error") <= 0.2 && own["preconditioned"]["unit"] == "K");
    assert!(
        (number("estimate") - exact).abs() < 5.0 * number("std_error"),
        "{own}"
    );
    assert_eq!(
        own["radiant_temperature"]["estimate"],
        own["preconditioned"]["estimate"]
    );
    let table = folder.solve(&middle, &["--walks", "2000"]).stdout;
    assert!(table.contains("a: temperature, K"), "{table}");
    // So are the errors of parts that are merged.
    let batches = format!("{middle}[walk]\nbatch = 512\n");
    let (file, part) = (folder.file("part.toml", batches), folder.at("part"));
    let cut = ["--walks", "20000", "--cells", "60", "--part", "1/1"];
    let walked = fredholm(&[&["solve", &*file, "--save", &part], &cut[..]].concat());
    assert_eq!(walked.status, Some(0), "{walked:?}");
    let merged = |error: &str| fredholm(&["merge", &part, "--target-error", error]).status;
    assert_eq!([merged("1"), merged("0.1")], [Some(0), Some(3)]);
    let both =
        format!("{middle}\n[[target]]\nname = \"b\"\nover = \"b\"\n[walk]\ntarget_error = 1\n");
    refused(
        &folder.solve(&both, &[]),
        &["problem.toml:21:16", "whose error is in kelvin"],
    );
    refused(
        &solve("ask = \"temperature\"", &[]),
        &["problem.toml:15:7", "the temperature is given there"],
    );
    refused(
        &solve("ask = \"brightness\"", &[]),
        &["problem.toml:15:7", "brightness"],
    );
    let in_air = text("ask = \"irradiance\"").replace("over = \"a\"", "at = [0.5, 0.5, 0.5]");
    refused(
        &folder.solve(&in_air, &[]),
        &["problem.toml:15:7", "no light falls"],
    );
    let cube = "[problem]\nkind = \"cube\"\ndimension = 1\nkernel = \"0.5\"\nsource = \"1\"\n[[target]]\nname = \"a\"\nat = 0.5\nask = \"irradiance\"\n";
    refused(
        &folder.solve(cube, &[]),
        &["problem.toml:9:7", "belongs to rooms and scenes"],
    );
}

/// Single precision has steps of half a metre there. What is moved by whole numbers has the same coordinates as at the origin, and so the same bits.
#[test]
fn a_scene_far_away_has_the_bits_of_one_at_the_origin() {
    let folder = Folder::new();
    let scene = |[a, b, c]: [i64; 3]| {
        format!(
            "[problem]\nkind = \"scene\"\n[[problem.surface]]\nname = \"floor\"\nreflectance = 0.4\n\
             polygon = [[{a}, {b}, {c}], [{x}, {b}, {c}], [{x}, {y}, {c}], [{a}, {y}, {c}]]\n\
             [[problem.surface]]\nname = \"rest\"\nreflectance = 0.6\nemission = 1\npolygons = [\
             [[{a}, {b}, {z}], [{a}, {y}, {z}], [{x}, {y}, {z}], [{x}, {b}, {z}]],\
             [[{a}, {b}, {c}], [{a}, {b}, {z}], [{x}, {b}, {z}], [{x}, {b}, {c}]],\
             [[{x}, {b}, {c}], [{x}, {b}, {z}], [{x}, {y}, {z}], [{x}, {y}, {c}]],\
             [[{x}, {y}, {c}], [{x}, {y}, {z}], [{a}, {y}, {z}], [{a}, {y}, {c}]],\
             [[{a}, {y}, {c}], [{a}, {y}, {z}], [{a}, {b}, {z}], [{a}, {b}, {c}]]]\n\
             [[problem.light]]\nat = [{d}, {e}, {e2}]\nintensity = 9\n\
             [walk]\nscalar = \"f32\"\n[[target]]\nname = \"point\"\nat = [{d}, {e}, {c}]\n\
             [[target]]\nname = \"spot\"\nat = {{ surface = \"floor\", point = [{x}, {y}, {c}] }}\n\
             [[target]]\nname = \"air\"\nat = [{d}, {e}, {f}]\n[[target]]\nname = \"meter\"\n\
             at = {{ point = [{d}, {e}, {f}], facing = [0, 0, 1] }}\n[[target]]\nname = \"floor\"\nover = \"floor\"\n",
            x = a + 10,
            y = b + 10,
            z = c + 10,
            d = a + 3,
            e = b + 2,
            e2 = c + 7,
            f = c + 4,
        )
    };
    let far = [512_340, 5_403_210, 250];
    let more = [
        "--json", "--cells", "24", "--degree", "0", "--walks", "3000",
    ];
    let [there, here] = [far, [0; 3]].map(|at| {
        let ran = folder.solve(&scene(at), &more);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        ran
    });
    let note = "walks are in the scene moved by (512340, 5403210, 250)";
    assert!(
        there.stderr.contains(note) && !here.stderr.contains("moved"),
        "{there:?}"
    );
    let [own, near] = [&there, &here].map(|ran| ran.json()["targets"].as_array().unwrap().clone());
    for (own, near) in own.iter().zip(&near) {
        assert_eq!(own["preconditioned"], near["preconditioned"], "{own}");
    }
    assert_eq!(
        (near.len(), own[2]["at"][1].as_f64()),
        (5, Some(5_403_212.0))
    );
    // Double precision needs no other place.
    let double = folder.solve(&scene(far).replace("f32", "f64"), &more);
    assert!(!double.stderr.contains("moved by"), "{double:?}");
    // Errors and cells are where the scene was given.
    let over = |at| {
        scene(at)
            .split("[[target]]\nname = \"point\"")
            .next()
            .unwrap()
            .to_owned()
    };
    let means = over(far) + "[[target]]\nname = \"all\"\nover = \"all\"\n";
    let whole = folder.solve(&means, &[&["--global"], &more[..]].concat());
    let mesh = &whole.json()["mesh"][0];
    let corner = mesh["corners"][0].as_array().unwrap();
    let corner: Vec<f64> = corner.iter().map(|x| x.as_f64().unwrap()).collect();
    let is_near = |k: usize| (0.0..=10.0).contains(&(corner[k] - far[k] as f64));
    assert!((0..3).all(is_near), "{mesh}");
    let gap = scene(far).replacen(", [512340, 5403220, 250]]", ", [512340, 5403219, 250]]", 1);
    refused(&folder.solve(&gap, &more), &["from (512350, 54032"]);
}

#[test]
fn millimetres_are_a_question() {
    let folder = Folder::new();
    let room = |[x, y, z]: [f64; 3]| {
        let text = format!(
            "[problem]\nkind = \"scene\"\n[[problem.surface]]\nname = \"floor\"\npolygon = [[0, 0, 0], [{x}, 0, 0], [{x}, {y}, 0], [0, {y}, 0]]\n\
             [[problem.surface]]\nname = \"rest\"\npolygons = [[[0, 0, {z}], [0, {y}, {z}], [{x}, {y}, {z}], [{x}, 0, {z}]],\
             [[0, 0, 0], [0, 0, {z}], [{x}, 0, {z}], [{x}, 0, 0]], [[{x}, 0, 0], [{x}, 0, {z}], [{x}, {y}, {z}], [{x}, {y}, 0]],\
             [[{x}, {y}, 0], [{x}, {y}, {z}], [0, {y}, {z}], [0, {y}, 0]], [[0, {y}, 0], [0, {y}, {z}], [0, 0, {z}], [0, 0, 0]]]\n"
        );
        folder.file("room.toml", text)
    };
    let asks = |sides: [f64; 3]| {
        let file = room(sides);
        let [factors, check] = ["factors", "check"].map(|command| fredholm(&[command, &file]));
        let said = [&factors, &check].map(|ran| ran.stderr.contains("is this in millimetres?"));
        assert_eq!(said[0], said[1], "{factors:?} {check:?}");
        (said[0], factors.stdout)
    };
    // A room, one in millimetres, a town 300 m high, and a crater.
    let (in_metres, table) = asks([4.0, 3.0, 2.5]);
    let (in_millimetres, same) = asks([4000.0, 3000.0, 2500.0]);
    assert!(!in_metres && in_millimetres);
    assert_eq!(table, same);
    assert!(!asks([5000.0, 4000.0, 300.0]).0 && !asks([9e5, 8e5, 4000.0]).0);
}
