//! `fredholm times`.

use crate::common;

use common::{Folder, ended, fredholm, refused};

/// A ground of 4 m² that nothing hides, with a reflectance of a quarter.
const GROUND: &str = "[problem]\nkind = \"scene\"\nsky = { emission = 1 }\nphotometric = true\n[[problem.surface]]\nname = \"ground\"\n\
    polygon = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]\nreflectance = 0.25\n[[target]]\nname = \"lux\"\nover = \"ground\"\n\
    ask = \"irradiance\"\n[[target]]\nname = \"=u\"\nat = [1, 1, 0]\n";

const TIMES: &str = "time,altitude,azimuth,beam,diffuse\nnight,-20,0,0,0\nmorning,30,90,40000,10000\nnoon,90,0,80000,12000\n";

/// Numbers of a line.
fn numbers(line: &str) -> Vec<f64> {
    line.split(',')
        .skip(1)
        .map(|field| field.parse().unwrap())
        .collect()
}

#[test]
fn suns_and_skies_of_a_file() {
    let folder = Folder::new();
    let scene = folder.file("ground.toml", GROUND);
    let times = folder.file("times.csv", TIMES);
    let out = folder.at("lux.csv");
    let ran = ended(
        0,
        &["times", &scene, &times, "--out", &out, "--threads", "1"],
    );
    for words in [
        "scene at 3 times",
        "92000",
        "noon",
        "lx",
        "8192 walks, which all times share",
    ] {
        assert!(ran.stdout.contains(words), "{words}: {}", ran.stdout);
    }
    let csv = std::fs::read_to_string(&out).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines[0], "time,lux,lux std_error,'=u,'=u std_error");
    // Half of a beam of 40,000 and a sky of 10,000: nothing is left to chance but for rays that a ground without surroundings sends out.
    for (line, lux) in [(1, 0.0), (2, 30_000.0), (3, 92_000.0)] {
        let own = numbers(lines[line]);
        for (found, exact) in [(own[0], lux), (own[2], 0.25 * lux)] {
            assert!((found - exact).abs() <= 1e-9 * exact, "{}", lines[line]);
        }
    }
    let json = |threads: &str| {
        let ran = ended(
            0,
            &["times", &scene, &times, "--json", "--threads", threads],
        );
        ran.json()["targets"].clone()
    };
    assert_eq!(json("1"), json("3"));
    assert_eq!(json("1")[0]["ask"], "irradiance");
}

#[test]
fn what_has_no_times_is_refused() {
    let folder = Folder::new();
    let scene = folder.file("ground.toml", GROUND);
    let times = folder.file("times.csv", TIMES);
    let refuses = |scene: &str, times: &str, words: &str| {
        refused(&fredholm(&["times", scene, times]), &[words]);
    };
    let other = |from: &str, to: &str| {
        assert!(GROUND.contains(from), "{from}");
        folder.file("other.toml", GROUND.replace(from, to))
    };
    let own_sun = other(
        "[[target]]\nname = \"lux\"",
        "[[problem.light]]\ntowards = [0, 0, 1]\nirradiance = 1\n[[target]]\nname = \"lux\"",
    );
    refuses(&own_sun, &times, "the scene has one of its own");
    let no_sky = other("sky = { emission = 1 }", "open = true");
    refuses(
        &no_sky,
        &times,
        "times.csv:1:1: the column `diffuse` is the light of a sky",
    );
    let cube = folder.file("cube.toml", "[problem]\nkind = \"cube\"\ndimension = 1\nkernel = \"0.5\"\nsource = \"1\"\n[[target]]\nname = \"a\"\nat = 0.5\n");
    refuses(&cube, &times, "shine on scenes");
    refuses(&scene, &folder.at("none.csv"), "none.csv");
    let wrong = fredholm(&["times", &scene, &times, "--out", &folder.at("a.txt")]);
    refused(&wrong, &["must end in .csv or .json"]);
}
