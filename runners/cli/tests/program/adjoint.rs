//! Walks from the sources of a scene to its receivers.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;

use crate::common::{self, Folder, json};
use crate::parts;

/// A closed box with a lamp under its ceiling, one black wall and one of two materials; and the means over all of its surfaces.
pub(crate) fn room(walk: &str) -> String {
    let mut text = format!("[problem]\nkind = \"scene\"\n{SURFACES}[walk]\n{walk}");
    for name in ["floor", "ceiling", "left", "right", "others", "lamp"] {
        text.push_str(&format!(
            "[[target]]\nname = \"{name}\"\nover = \"{name}\"\n"
        ));
    }
    text.push_str("[[target]]\nname = \"some\"\nover = [\"left\", \"right\"]\n");
    text.push_str("[[target]]\nname = \"all\"\nover = \"all\"\n");
    text
}

const SURFACES: &str = r#"
[[problem.light]]
at = [1.6, 0.5, 0.8]
intensity = 0.05
[[problem.surface]]
name = "floor"
polygon = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]
reflectance = 0.4
emission = 0.01
[[problem.surface]]
name = "ceiling"
polygon = [[0, 0, 1], [0, 1, 1], [2, 1, 1], [2, 0, 1]]
reflectance = 0.8
[[problem.surface]]
name = "left"
polygon = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]
reflectance = 0.0
[[problem.surface]]
name = "right"
polygon = [[2, 0, 0], [2, 0, 1], [2, 1, 1], [2, 1, 0]]
reflectance = 0.6
[[problem.surface]]
name = "others"
polygons = [
    [[0, 0, 0], [0, 0, 1], [2, 0, 1], [2, 0, 0]],
    [[0, 1, 0], [2, 1, 0], [2, 1, 1], [0, 1, 1]],
]
reflectance = 0.5
[[problem.surface]]
name = "lamp"
polygon = [[0.9, 0.4, 0.95], [0.9, 0.6, 0.95], [1.1, 0.6, 0.95], [1.1, 0.4, 0.95]]
two_sided = true
reflectance = 0.2
emission = 10
"#;

fn estimate(of: &Value) -> Option<[f64; 2]> {
    let number = |name| of[name].as_f64();
    Some([number("estimate")?, number("std_error")?])
}

/// Both directions tell the same of u and of irradiances, plain and preconditioned, with both estimators; walks from the
/// sources serve all receivers at once, and all have the same bits on one thread and on two.
#[test]
fn both_directions_agree() {
    let folder = Folder::new();
    let walk = "walks = 4096\nbatch = 512\nabsorption = 0.3\n";
    let file = folder.file("room.toml", room(walk));
    let cells = ["--cells", "30", "--degree", "1"];
    for (estimator, scalar) in [("collision", "f64"), ("absorption", "f32")] {
        let options = ["--estimator", estimator, "--scalar", scalar];
        let of =
            |others: &[&str]| json(&[&["solve", &file], &cells[..], &options, others].concat());
        let (forward, back) = (of(&["--adjoint", "false"]), of(&["--adjoint", "true"]));
        assert_eq!(back["adjoint"], true);
        assert!(forward.get("adjoint").is_none());
        let ratio = forward["states"].as_f64().unwrap() / back["states"].as_f64().unwrap();
        assert!((ratio - 8.0).abs() < 0.5, "{ratio}");
        let pairs = common::list(&forward, "targets")
            .iter()
            .zip(common::list(&back, "targets"));
        let mut compared = 0;
        for (forward, back) in pairs {
            let name = &forward["name"];
            for kind in ["plain", "preconditioned", "irradiance"] {
                if let (Some([a, s]), Some([b, t])) =
                    (estimate(&forward[kind]), estimate(&back[kind]))
                {
                    let z = (a - b) / s.hypot(t).max(1e-12);
                    assert!(
                        z.abs() < 4.9,
                        "{name}, {kind}, {estimator}: {a} and {b}, z = {z}"
                    );
                    compared += 1;
                }
            }
        }
        // All but what plain walks score of u of the black wall, which is 0.
        assert_eq!(compared, 8 * 3 - 1);
    }
    let [one, two] = ["1", "2"].map(|threads| {
        let args = ["--adjoint", "true", "--walks", "2000", "--threads", threads];
        common::fredholm(&[&["solve", &file, "--json"], &args[..], &cells].concat()).timeless()
    });
    assert_eq!(one, two);
}

/// Parts of walks from the sources are one run, and say what they are.
#[test]
fn parts_go_the_same_way() {
    let folder = Folder::new();
    let room = room("walks = 2000\nbatch = 256\nabsorption = 0.3\n");
    let args = ["--cells", "20", "--degree", "0", "--adjoint", "true"];
    let paths = parts::parts(&folder, &room, 3, &args);
    let merged = parts::merge(&paths, &["--json"]);
    assert_eq!(merged.json()["adjoint"], true);
    assert_eq!(merged.timeless(), parts::whole(&room, &args));
}

/// With an error and nothing said of the direction, the choice takes the way back where a lamp gives light to many receivers.
#[test]
fn the_choice_takes_the_faster_direction() {
    let folder = Folder::new();
    let file = folder.file("room.toml", room("target_error = 0.003\n"));
    let chosen = json(&["solve", &file]);
    assert_eq!(chosen["adjoint"], true, "{chosen:#}");
    for target in common::list(&chosen, "targets") {
        let error = target["preconditioned"]["std_error"].as_f64();
        assert!(error.is_some_and(|error| error <= 0.003), "{target}");
    }
}

/// Reciprocity: A_j times the irradiance of j by i, over A_i times that of i by j, is 1, from both directions.
#[test]
fn exchange_is_reciprocal() {
    let folder = Folder::new();
    let power = |from: &str, to: &str| {
        let text = room("walks = 4096\nabsorption = 0.3\n");
        let (problem, _) = text.split_once("[[target]]").unwrap();
        let dark = problem
            .replace(
                "[[problem.light]]\nat = [1.6, 0.5, 0.8]\nintensity = 0.05\n",
                "",
            )
            .replace("emission = 0.01\n", "")
            .replace("emission = 10\n", "");
        let lit = dark.replace(
            &format!("name = \"{from}\"\n"),
            &format!("name = \"{from}\"\nemission = 1\n"),
        );
        let file = folder.file(
            "lit.toml",
            format!("{lit}[[target]]\nname = \"to\"\nover = \"{to}\"\n"),
        );
        ["false", "true"].map(|adjoint| {
            let cells = ["--cells", "30", "--degree", "0", "--adjoint", adjoint];
            let of = json(&[&["solve", &file], &cells[..]].concat());
            estimate(&common::list(&of, "targets")[0]["irradiance"]).unwrap()
        })
    };
    // Of 1 and 2 square metres.
    let [there, back] = [power("right", "floor"), power("floor", "right")];
    for [a, s] in there.map(|[h, e]| [2.0 * h, 2.0 * e]) {
        for [b, t] in back {
            let z = (a - b) / s.hypot(t);
            assert!(z.abs() < 4.9, "{a} {b} {z}");
        }
    }
}

#[test]
fn what_the_way_back_refuses() {
    let folder = Folder::new();
    let point = room("") + "[[target]]\nname = \"point\"\nat = [0.5, 0.5, 0]\n";
    let sun = room("").replace(
        "at = [1.6, 0.5, 0.8]\nintensity = 0.05",
        "towards = [0, 0, 1]\nirradiance = 3",
    );
    let dark = room("")
        .replace("emission = 0.01\n", "")
        .replace("emission = 10\n", "")
        .replace(
            "[[problem.light]]\nat = [1.6, 0.5, 0.8]\nintensity = 0.05\n",
            "",
        );
    let start = "walks from the sources start on surfaces that emit and at lamps";
    for (text, words) in [
        (point, "walks from the sources serve means over surfaces"),
        (sun, start),
        (dark, start),
        (crate::colours::room(None), "in one channel"),
    ] {
        let file = folder.file("wrong.toml", text);
        common::refused(
            &common::fredholm(&["solve", &file, "--adjoint", "true"]),
            &[words],
        );
    }
    let file = folder.file("room.toml", room("adjoint = true\nwalks = 1000\n"));
    let (png, bin) = (folder.at("a.png"), folder.at("a.bin"));
    let answers = "walks from the sources answer the targets of `solve`, and nothing else";
    for (args, words) in [
        (
            &["solve", &file, "--global", "--cells", "20"][..],
            "neither tell a global estimate",
        ),
        (&["rates", &file], answers),
        (&["render", &file, "--out", &png], answers),
        (&["export", &file, "--out", &bin], answers),
    ] {
        common::refused(&common::fredholm(args), &[words]);
    }
    // `check` tells the walks that `solve` makes: one set for all.
    let ran = common::fredholm(&["check", &file]);
    assert!(
        ran.status == Some(0) && ran.stdout.contains("walks      1000\n"),
        "{ran:?}"
    );
    // Walks of other kinds do not start at lamps: their way back is the global estimate.
    let circle = folder.file("circle.toml", common::CIRCLE);
    let [back, global] = [&["--adjoint", "true"][..], &["--global"]]
        .map(|args| common::fredholm(&[&["solve", &circle, "--json"], args].concat()).timeless());
    assert_eq!(back, global);
}

/// A random closed box with one to three lamps of random sizes, and perhaps small plates in it; the means over its walls, over some of
/// them, or over all surfaces, to a relative error.
fn random_room(rng: &mut ChaCha8Rng) -> String {
    let [w, d, h] = [(); 3].map(|()| rng.random_range(1.0..4.0));
    let rho = |rng: &mut ChaCha8Rng| rng.random_range(0.1..0.8);
    let walls = [
        (
            "floor",
            format!("[0, 0, 0], [{w}, 0, 0], [{w}, {d}, 0], [0, {d}, 0]"),
        ),
        (
            "ceiling",
            format!("[0, 0, {h}], [0, {d}, {h}], [{w}, {d}, {h}], [{w}, 0, {h}]"),
        ),
        (
            "left",
            format!("[0, 0, 0], [0, {d}, 0], [0, {d}, {h}], [0, 0, {h}]"),
        ),
        (
            "right",
            format!("[{w}, 0, 0], [{w}, 0, {h}], [{w}, {d}, {h}], [{w}, {d}, 0]"),
        ),
        (
            "front",
            format!("[0, 0, 0], [0, 0, {h}], [{w}, 0, {h}], [{w}, 0, 0]"),
        ),
        (
            "back",
            format!("[0, {d}, 0], [{w}, {d}, 0], [{w}, {d}, {h}], [0, {d}, {h}]"),
        ),
    ];
    let mut text = "[problem]\nkind = \"scene\"\n".to_owned();
    let mut surface = |name: &str, polygon: &str, rest: &str| {
        text.push_str(&format!(
            "[[problem.surface]]\nname = \"{name}\"\npolygon = [{polygon}]\n{rest}\n"
        ));
    };
    for (name, polygon) in &walls {
        surface(name, polygon, &format!("reflectance = {}", rho(rng)));
    }
    // A rectangle at this height, this share of the floor wide.
    let plate = |rng: &mut ChaCha8Rng, share: f64, z: f64| {
        let [x, y] = [w, d].map(|side| side * rng.random_range(0.1..0.5));
        let [u, v] = [x + share * w, y + share * d];
        format!("[{x}, {y}, {z}], [{u}, {y}, {z}], [{u}, {v}, {z}], [{x}, {v}, {z}]")
    };
    for lamp in 0..rng.random_range(1..4) {
        let share = [0.02, 0.1, 0.4][rng.random_range(0..3)];
        let polygon = plate(rng, share, h * (0.75 + 0.07 * f64::from(lamp)));
        let emission = rng.random_range(1.0..20.0) / share;
        let rest = format!(
            "two_sided = true\nreflectance = {}\nemission = {emission}",
            rho(rng)
        );
        surface(&format!("lamp {lamp}"), &polygon, &rest);
    }
    let plates = [0, 1, 5][rng.random_range(0..3)];
    for number in 0..plates {
        let polygon = plate(rng, 0.1, h * (0.05 + 0.1 * f64::from(number)));
        let rest = format!("two_sided = true\nreflectance = {}", rho(rng));
        surface(&format!("plate {number}"), &polygon, &rest);
    }
    let mut names: Vec<String> = walls.iter().map(|(name, _)| (*name).to_owned()).collect();
    match rng.random_range(0..3) {
        0 => names.truncate(2),
        1 => names.extend((0..plates).map(|number| format!("plate {number}"))),
        _ => {}
    }
    for name in names {
        text.push_str(&format!(
            "[[target]]\nname = \"{name}\"\nover = \"{name}\"\n"
        ));
    }
    let error = [0.02, 0.005, 0.002][rng.random_range(0..3)];
    text + &format!("[walk]\ntarget_error = {error}\nrelative = true\n")
}

/// In 20 random rooms both directions, and the one that is chosen, tell the same of every target.
///
/// Prints the seconds of both and of the choice on one thread, and in how many rooms it took the faster one, or one that takes at
/// most 1.3 times as long: of a release build, times mean something.
#[test]
fn both_directions_agree_in_random_rooms() {
    let folder = Folder::new();
    let mut rng = ChaCha8Rng::seed_from_u64(28);
    let rooms = if common::is_long() { 20 } else { 1 };
    let mut right = 0;
    for number in 0..rooms {
        let mut text = random_room(&mut rng);
        if !common::is_long() {
            // By day errors are large, and batches, of which a target has sixteen at least, small.
            text = text.replace("target_error = 0.00", "target_error = 0.05 # 0.00");
            text = text.replace("[walk]\n", "[walk]\nbatch = 256\n");
        }
        let file = folder.file("room.toml", text);
        let run = |direction: &[&str]| {
            let args = [&["solve", &file, "--json", "--threads", "1"], direction].concat();
            let ran = common::fredholm(&args);
            assert_eq!(ran.status, Some(0), "{number}: {ran:?}");
            (ran.time.as_secs_f64(), ran.json())
        };
        let [(forward, of_forward), (back, of_back)] =
            ["false", "true"].map(|way| run(&["--adjoint", way]));
        let (chosen, of_choice) = run(&[]);
        let all = [&of_forward, &of_back, &of_choice].map(|of| common::list(of, "targets"));
        for place in 0..all[0].len() {
            let [first, second, third] = all.map(|targets| {
                estimate(&targets[place]["preconditioned"]).expect("every target has an error bar")
            });
            for other in [second, third] {
                let z = (first[0] - other[0]) / first[1].hypot(other[1]).max(1e-12);
                assert!(z.abs() < 4.9, "room {number}, target {place}: z = {z}");
            }
        }
        let is_back = of_choice["adjoint"] == true;
        let own = if is_back { back } else { forward };
        let is_right = own <= 1.3 * forward.min(back);
        right += u32::from(is_right);
        println!(
            "{number}: forward {forward:.2} s, back {back:.2} s, choice {chosen:.2} s, {}{}",
            if is_back { "back" } else { "forward" },
            if is_right { "" } else { ", the slower" }
        );
    }
    println!("{right} of {rooms}");
}
