//! Scenes and rooms in several channels.

use crate::common::{self, Folder, estimate, json};
use crate::parts;

const WEIGHTS: [f64; 3] = [0.2126, 0.7152, 0.0722];
const WALKS: &str = "4096";

/// A problem in all channels, or in one of them alone.
type Problem = fn(Option<usize>) -> String;

/// A box with walls of two colours, a lamp under its ceiling, and targets: channel `Some(c)` of it alone, or all.
pub(crate) fn room(channel: Option<usize>) -> String {
    let of = |all: [f64; 3]| match channel {
        Some(channel) => all[channel].to_string(),
        None => format!("{all:?}"),
    };
    format!(
        r#"[problem]
kind = "scene"
[[problem.surface]]
name = "walls"
box = [[0, 0, 0], [2, 1, 1]]
inward = true
reflectance = {}
[[problem.surface]]
name = "lamp"
polygon = [[0.8, 0.4, 0.9], [0.8, 0.6, 0.9], [1.2, 0.6, 0.9], [1.2, 0.4, 0.9]]
two_sided = true
reflectance = 0.2
emission = {}
[galerkin]
cells = 60
degree = 1
[walk]
walks = {WALKS}
absorption = 0.3
[[target]]
name = "corner"
at = [0, 0, 0]
[[target]]
name = "air"
at = [1, 0.5, 0.5]
[[target]]
name = "meter"
at = {{ point = [1, 0.5, 0.2], facing = [0, 0, 1] }}
[[target]]
name = "all"
over = "all"
"#,
        of([0.7, 0.3, 0.05]),
        of([10.0, 20.0, 40.0])
    )
}

/// A room with walls of two colours, a table, a lamp, and the same targets and one along a wall.
pub(crate) fn flat(channel: Option<usize>) -> String {
    let of = |all: [f64; 3]| match channel {
        Some(channel) => all[channel].to_string(),
        None => format!("{all:?}"),
    };
    let channels = match channel {
        Some(_) => "",
        None => "channels = [\"red\", \"green\", \"blue\"]\n",
    };
    format!(
        r#"[problem]
kind = "room"
{channels}[[problem.surface]]
name = "walls"
points = [[1.2, 2], [0, 2], [0, 0], [3, 0]]
reflectance = [{}, {}, {}]
[[problem.surface]]
name = "others"
points = [[3, 0], [3, 2], [1.8, 2]]
reflectance = 0.6
[[problem.surface]]
name = "lamp"
points = [[1.8, 2], [1.2, 2]]
reflectance = 0.2
emission = {}
[[problem.surface]]
name = "table"
points = [[0.8, 0.7], [0.8, 0.8], [1.7, 0.8], [1.7, 0.7], [0.8, 0.7]]
reflectance = {}
[galerkin]
cells = 40
degree = 2
[walk]
walks = {WALKS}
absorption = 0.3
[[target]]
name = "corner"
at = {{ surface = "walls", t = 0.7 }}
[[target]]
name = "air"
at = [1, 0.3]
[[target]]
name = "all"
over = "all"
"#,
        of([0.7, 0.3, 0.05]),
        of([0.05, 0.5, 0.7]),
        of([0.4, 0.4, 0.3]),
        of([10.0, 20.0, 40.0]),
        of([0.1, 0.1, 0.6]),
    )
}

/// One walk tells in every channel what walks of this channel alone tell, and the luminance of all. By day each way goes with one
/// estimator.
#[test]
fn channels_agree_with_runs_of_their_own() {
    let ways: [(Problem, &[&str], f64); 4] = [
        (room, &[], 0.1),
        (flat, &[], 1e-9),
        (flat, &["--pairs", "pointwise"], 1e-9),
        (flat, &["--last-step", "true"], 1e-9),
    ];
    for (number, (room, options, of_v)) in ways.into_iter().enumerate() {
        for (other, estimator) in ["collision", "absorption"].into_iter().enumerate() {
            if common::is_long() || number % 2 == other {
                agree(room, &[options, &["--estimator", estimator]].concat(), of_v);
            }
        }
    }
}

/// Compares with runs of a channel each; their v are the same but for so much.
fn agree(room: Problem, options: &[&str], of_v: f64) {
    let folder = Folder::new();
    let file = folder.file("room.toml", room(None));
    let alone =
        [0, 1, 2].map(|channel| folder.file(&format!("{channel}.toml"), room(Some(channel))));
    {
        let all = json(&[&["solve", &*file], options].concat());
        let targets = common::list(&all, "targets");
        let places = targets.len() / 4;
        assert!(places >= 3, "{all}");
        let own = alone
            .each_ref()
            // Other walks.
            .map(|file| json(&[&["solve", file, "--seed", "2"], options].concat()));
        for (place, shared) in targets.chunks(4).enumerate() {
            for kind in ["plain", "preconditioned"] {
                let mut sum = 0.0;
                for (channel, name) in ["red", "green", "blue"].into_iter().enumerate() {
                    let one = &common::list(&own[channel], "targets")[place];
                    assert_eq!(shared[channel]["channel"], name);
                    let both = format!("{} {name}", one["name"].as_str().unwrap());
                    assert_eq!(shared[channel]["name"], both);
                    let ([a, s], [b, t]) = (estimate(&shared[channel], kind), estimate(one, kind));
                    let z = (a - b) / s.hypot(t);
                    assert!(
                        z.abs() < 4.9,
                        "{both}, {kind}, {options:?}: {a} and {b}, z = {z}"
                    );
                    // The means of v differ by how well rays fit it.
                    sum += WEIGHTS[channel] * a;
                    let [v, w] = [&shared[channel], one].map(|of| common::number(of, "galerkin"));
                    assert!((v / w - 1.0).abs() < of_v, "{both}: {v} and {w}");
                }
                assert_eq!(shared[3]["channel"], "luminance");
                let [luminance, _] = estimate(&shared[3], kind);
                assert!((luminance / sum - 1.0).abs() < 1e-12, "{luminance} {sum}");
            }
        }
        // Targets are walked for once, not once a channel.
        assert_eq!(all["states"].as_u64().unwrap() / (places as u64 * 4096), 3);
    }
}

/// The same bits on one thread, on two, and in parts; the scalar, plain walks and an error that is asked for work as for one
/// channel.
#[test]
fn channels_have_the_same_bits_everywhere() {
    same_bits(room);
    same_bits(flat);
}

fn same_bits(room: Problem) {
    let folder = Folder::new();
    let file = folder.file("room.toml", room(None));
    let [one, two] = ["1", "2"].map(|threads| {
        common::fredholm(&["solve", &file, "--json", "--threads", threads])
            .quietly(0)
            .timeless()
    });
    assert_eq!(one, two);
    let args = ["--walks", "5000"];
    let small = room(None).replace("[walk]\n", "[walk]\nbatch = 256\n");
    let paths = parts::parts(&folder, &small, 3, &args);
    let merged = parts::merge(&paths, &["--json"]).quietly(0).timeless();
    assert_eq!(merged, parts::whole(&small, &args));

    // All channels of a target end with the last of them, wherever that is decided. What is open is chosen for the error, in every part.
    let error = ["--target-error", "0.05", "--relative"];
    let asked = [&["--walks", "20000"], &error[..]].concat();
    let whole = parts::whole(&small, &asked);
    let others = Folder::new();
    let paths = parts::parts(&others, &small, 3, &asked);
    let merged = parts::merge(&paths, &[&error[..], &["--json"]].concat());
    assert_eq!(merged.timeless(), whole);

    // Neither cells nor walks are given: they are chosen.
    let open = room(None)
        .replace("cells = 60\ndegree = 1\n", "")
        .replace("cells = 40\ndegree = 2\n", "")
        .replace(&format!("walks = {WALKS}\n"), "");
    let open = folder.file("open.toml", open.replace("absorption = 0.3\n", ""));
    let error = ["--target-error", "0.02", "--relative"];
    let asked = [&["solve", &open, "--scalar", "f32", "--json"], &error[..]].concat();
    // What is chosen for a room leaves less than rounding in f32 does.
    let asked = common::fredholm(&asked).warning(0, &[]).json();
    assert_eq!(asked["stop"], "done");
    for target in common::list(&asked, "targets") {
        let [estimate, error] = estimate(target, "preconditioned");
        assert!(error <= 0.02 * estimate, "{target}");
    }
}

/// A picture has the colours of its light, and its table the numbers of all channels.
#[test]
fn a_view_in_colours() {
    let folder = Folder::new();
    let file = folder.file("room.toml", room(None));
    let size = ["--width", "24", "--height", "16", "--walks", "4"];
    let out = |name: &str, others: &[&str]| {
        let to = folder.at(name);
        let args = [&["render", &file, "--out", &to], &size[..], others].concat();
        common::fredholm(&args).quietly(0);
        to
    };
    let csv = out("view.csv", &[]);
    let rows = common::csv_rows(csv.as_ref());
    let head = [
        "column",
        "row",
        "red",
        "red_std_error",
        "green",
        "green_std_error",
        "blue",
        "blue_std_error",
        "luminance",
        "luminance_std_error",
    ];
    assert_eq!(rows[0], head);
    let mut seen = 0;
    for row in rows[1..].iter().filter(|row| !row[2].is_empty()) {
        let numbers: Vec<f64> = row.iter().map(|field| field.parse().unwrap()).collect();
        let sum = WEIGHTS[0] * numbers[2] + WEIGHTS[1] * numbers[4] + WEIGHTS[2] * numbers[6];
        assert!((numbers[8] - sum).abs() < 1e-9 * sum.abs(), "{row:?}");
        seen += 1;
    }
    assert!(seen > 100);
    for name in ["view.svg", "view.png"] {
        out(name, &["--side-by-side"]);
    }
    let png = std::fs::read(folder.at("view.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
}

/// A picture of a room has the colours of its light, between the walls and on them, and its table the numbers of all channels.
#[test]
fn a_room_in_colours() {
    let folder = Folder::new();
    let file = folder.file("room.toml", flat(None));
    let out = |name: &str, others: &[&str]| {
        let to = folder.at(name);
        let args = [&["render", &*file, "--out", &to], others].concat();
        common::fredholm(&args).quietly(0);
        to
    };
    let csv = out("air.csv", &["--width", "24"]);
    let rows = common::csv_rows(csv.as_ref());
    assert_eq!(rows[0][..4], ["x", "y", "red", "red_std_error"]);
    assert_eq!(rows[0][8..], ["luminance", "luminance_std_error"]);
    assert!(rows.len() > 200);
    for row in &rows[1..] {
        let numbers: Vec<f64> = row.iter().map(|field| field.parse().unwrap()).collect();
        let sum = WEIGHTS[0] * numbers[2] + WEIGHTS[1] * numbers[4] + WEIGHTS[2] * numbers[6];
        assert!((numbers[8] - sum).abs() < 1e-9 * sum.abs(), "{row:?}");
    }
    // Each channel is that of a room of this channel alone: few walks, and little is left to them.
    let alone = folder.file("alone.toml", flat(Some(2)));
    let to = folder.at("alone.csv");
    let args = ["render", &alone, "--out", &to, "--width", "24"];
    common::fredholm(&args).quietly(0);
    for (row, own) in rows.iter().zip(common::csv_rows(to.as_ref())).skip(1) {
        let [blue, one]: [f64; 2] = [&row[6], &own[2]].map(|field| field.parse().unwrap());
        assert!((blue / one - 1.0).abs() < 0.05, "{row:?} {own:?}");
    }
    let again = out("again.csv", &["--width", "24", "--threads", "1"]);
    assert_eq!(std::fs::read(csv).unwrap(), std::fs::read(again).unwrap());

    let svg = out("room.svg", &["--width", "300", "--walks", "1", "--targets"]);
    let text = std::fs::read_to_string(svg).unwrap();
    for words in [">luminance<", ">corner<", "colour of its light"] {
        assert!(text.contains(words), "{words}");
    }
    let lit = flat(None).replace("[walk]\n", "[walk]\nlast_step = true\n");
    let lit = folder.file("lit.toml", lit);
    for (file, option) in [
        (&file, "--side-by-side"),
        (&file, "--log"),
        (&lit, "--targets"),
    ] {
        let png = folder.at("room.png");
        let size = ["--width", "310", "--walks", "1"];
        common::fredholm(&[&["render", file, "--out", &png, option], &size[..]].concat())
            .quietly(0);
        assert!(std::fs::read(png).unwrap().starts_with(b"\x89PNG"));
    }
}

/// What is none of a scene in channels is refused with what would be right.
#[test]
fn what_channels_refuse() {
    let folder = Folder::new();
    let deck = |from: &str, to: &str| {
        let text = room(None);
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    for (text, words) in [
        (
            deck("reflectance = [0.7, 0.3, 0.05]", "reflectance = [0.7, 0.3]"),
            "`emission` has one number, or one for each of the channels, of which there are 2, not 3",
        ),
        (
            deck(
                "kind = \"scene\"",
                "kind = \"scene\"\nchannels = [\"a\", \"b\"]",
            ),
            "one for each of the channels, of which there are 2, not 3",
        ),
        (
            deck(
                "kind = \"scene\"",
                "kind = \"scene\"\nchannels = [\"a\", \"a\", \"b\"]",
            ),
            "the names of channels must differ",
        ),
        (
            deck("kind = \"scene\"", "kind = \"scene\"\nchannels = []"),
            "there are 1 to 128 channels",
        ),
        (
            deck("[10.0, 20.0, 40.0]", "[10.0, -20.0, 40.0]"),
            "an emission must be 0 or more",
        ),
        (
            deck("[0.7, 0.3, 0.05]", "[0.7, 1.3, 0.05]"),
            "a reflectance must be from 0 to 1",
        ),
        (
            deck(
                "reflectance = 0.2\nemission = [10.0, 20.0, 40.0]",
                "temperature = 300",
            ),
            "temperatures and net fluxes have one channel",
        ),
    ] {
        let file = folder.file("wrong.toml", &text);
        common::refused(&common::fredholm(&["solve", &file]), &[words]);
    }
    let file = folder.file("room.toml", room(None));
    let ran = common::fredholm(&["solve", &file, "--global"]);
    let words = "the global estimate from one set of walks has one channel";
    assert!(
        ran.status == Some(2) && ran.stderr.contains(words),
        "{ran:?}"
    );
}

/// What is none of a room in channels is refused with what would be right.
#[test]
fn what_channels_of_rooms_refuse() {
    let folder = Folder::new();
    let deck = |from: &str, to: &str| {
        let text = flat(None);
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    };
    for (text, words) in [
        (
            deck("emission = [10.0, 20.0, 40.0]", "emission = [10.0, 20.0]"),
            "`emission` has one number, or one for each of the channels, of which there are 3, not 2",
        ),
        (
            deck("[0.05, 0.5, 0.7]", "[0.5, 0.7]"),
            "`reflectance[1]` has one number, or one for each of the channels, of which there are 3, not 2",
        ),
        (
            deck("[[0.7, 0.3, 0.05], ", "["),
            "give one list for the surface, or one for each of its segments",
        ),
        (
            deck("channels = [\"red\", \"green\", \"blue\"]\n", ""),
            "name them, `channels = [\"red\", \"green\", \"blue\"]`, in `[problem]`",
        ),
        (
            deck("\"red\", \"green\"", "\"red\", \"red\""),
            "the names of channels must differ",
        ),
        (
            deck("[10.0, 20.0, 40.0]", "[10.0, -20.0, 40.0]"),
            "an emission must be 0 or more",
        ),
        (
            deck("[0.7, 0.3, 0.05]", "[0.7, 1.3, 0.05]"),
            "a reflectance must be at least 0 and at most 1",
        ),
        (
            deck(
                "reflectance = 0.2\nemission = [10.0, 20.0, 40.0]",
                "emissivity = 0.8\ntemperature = 300",
            ),
            "temperatures and net fluxes have one channel",
        ),
        (
            deck("degree = 2", "degree = 2\npairs = \"paper\""),
            "leave `pairs` and `method` out",
        ),
    ] {
        let file = folder.file("wrong.toml", &text);
        common::refused(&common::fredholm(&["solve", &file]), &[words]);
    }
    let file = folder.file("room.toml", flat(None));
    let (png, tables) = (folder.at("room.png"), folder.at("room.bin"));
    let whole = "the global estimate from one set of walks has one channel";
    for (args, words) in [
        (&["solve", &file, "--global"][..], whole),
        (&["render", &file, "--out", &png, "--global"], whole),
        (
            &["render", &file, "--out", &png, "--profile"],
            "`--profile` has one channel",
        ),
        (
            &["diagnose", &file],
            "there are no predictions of variances of a room in several channels",
        ),
        (
            &["export", &file, "--out", &tables],
            "there are no device tables of a room in several channels",
        ),
        (
            &["solve", &file, "--adjoint", "true"],
            "this equation has no walks from the sources to the receivers",
        ),
    ] {
        common::refused(&common::fredholm(args), &[words]);
    }
}

/// A channel in which nothing emits is 0 for certain, and keeps no other from its error.
#[test]
fn dark_channels_are_certain() {
    let folder = Folder::new();
    let flat = flat(None).replace(
        "emission = [10.0, 20.0, 40.0]",
        "emission = [10.0, 0.0, 40.0]",
    );
    let (problem, _) = flat.split_once("[walk]").unwrap_or((&flat, ""));
    let (problem, _) = problem.split_once("[[target]]").unwrap_or((problem, ""));
    let text = format!(
        "{problem}[walk]\ntarget_error = 0.01\n[[target]]\nname = \"all\"\nover = \"all\"\n"
    );
    let file = folder.file("dark.toml", text);
    let report = json(&["solve", &file]);
    let targets = common::list(&report, "targets");
    let of = |number: usize, what: &str| targets[number]["preconditioned"][what].as_f64().unwrap();
    assert_eq!([of(1, "estimate"), of(1, "std_error")], [0.0, 0.0]);
    assert!(of(0, "estimate") > 0.0 && of(3, "std_error") <= 0.01);
}
