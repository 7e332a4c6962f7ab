//! Scenes with `specular` surfaces: heat is kept, light goes both ways, derivatives are those of differences, and what is refused.

use serde_json::Value;

use crate::common::{Folder, asked, ended, fredholm, is_long, list, pair, refused};

/// A closed box of temperatures, given net fluxes and mirrors.
const HEAT: &str = "[problem]\nkind = 'scene'\n\
    [[problem.surface]]\nname = 'floor'\npolygon = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]\nemissivity = 0.8\ntemperature = 300\n\
    [[problem.surface]]\nname = 'ceiling'\npolygon = [[0, 0, 1], [0, 1, 1], [2, 1, 1], [2, 0, 1]]\nemissivity = 0.3\nspecular = 0.4\ntemperature = 350\n\
    [[problem.surface]]\nname = 'west'\npolygon = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]\nspecular = 0.5\ntemperature = 400\n\
    [[problem.surface]]\nname = 'east'\npolygon = [[2, 0, 0], [2, 0, 1], [2, 1, 1], [2, 1, 0]]\nnet_flux = 30\nspecular = 0.3\nemissivity = 0.25\n\
    [[problem.surface]]\nname = 'south'\npolygon = [[0, 0, 0], [0, 0, 1], [2, 0, 1], [2, 0, 0]]\nnet_flux = 0\n\
    [[problem.surface]]\nname = 'north'\npolygon = [[0, 1, 0], [2, 1, 0], [2, 1, 1], [0, 1, 1]]\nnet_flux = 0\nspecular = 0.9\n";

fn apart([a, e]: [f64; 2], [b, f]: [f64; 2]) -> f64 {
    (a - b).abs() / e.hypot(f)
}

#[test]
fn heat_is_kept_in_mirrors() {
    let folder = Folder::new();
    let text = format!(
        "{HEAT}[[target]]\nname = 'air'\nat = [1, 0.5, 0.5]\n[walk]\nwalks = 4000\n[galerkin]\ncells = 24\ndegree = 1\n"
    );
    let json = folder.solve(&text, &["--json"]).quietly(0).json();
    let fluxes = |json: &Value| -> Vec<[f64; 2]> {
        let all = list(json, "surfaces").iter();
        all.map(|own| pair(&own["net_flux"])).collect()
    };
    let found = fluxes(&json);
    let sum: f64 = found.iter().map(|own| own[0]).sum();
    let error = found.iter().map(|own| own[1]).fold(0.0, f64::hypot);
    assert!(sum.abs() < 4.0 * error && error < 10.0, "{sum} ± {error}");
    // 30 W/m² from a square metre.
    assert!(
        found.iter().any(|own| (own[0] - 30.0).abs() < 1e-9),
        "{found:?}"
    );
    // At one temperature nothing flows, whatever is mirrored.
    let same = text
        .replace("350", "300")
        .replace("400", "300")
        .replace("= 30\n", "= 0\n");
    let json = folder.solve(&same, &["--json"]).quietly(0).json();
    for [flux, error] in fluxes(&json) {
        assert!(flux.abs() <= 4.0 * error + 1e-6, "{flux} ± {error}");
    }
}

/// Of a gap between wide plates, one of which is a mirror in part, the classical exchange σ(T⁴ − T'⁴)/(1/ε + 1/ε' − 1) holds for diffuse and
/// for specular surfaces alike: what is lost at the sides is left out by mirrors there, which show the plates without end.
#[test]
fn plates_without_end_exchange_as_the_closed_form_says() {
    const SIGMA: f64 = 5.670_374_419e-8;
    let folder = Folder::new();
    let sides = "[[problem.surface]]\nname = 'sides'\npolygons = [[[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], \
        [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]], [[1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 1, 0]], \
        [[0, 1, 0], [0, 1, 1], [0, 0, 1], [0, 0, 0]]]\nnet_flux = 0\nspecular = 0.999999\n";
    let cases = [[0.0, 0.0], [0.5, 0.35], [0.3, 0.0]];
    // Rays go to and fro between the sides: to look at the variance of walks takes as long as these do, and by day there is no look.
    let (cases, walk, look): (_, _, &[&str]) = match is_long() {
        true => (&cases[..], "walks = 20000", &[]),
        false => (
            &cases[..2],
            "walks = 2000\nabsorption = 0.3",
            &["--allow-infinite-variance"],
        ),
    };
    for [specular, more] in cases {
        let text = format!(
            "[problem]\nkind = 'scene'\n\
             [[problem.surface]]\nname = 'low'\npolygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nemissivity = 0.5\nspecular = {specular}\ntemperature = 400\n\
             [[problem.surface]]\nname = 'high'\npolygon = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]\nemissivity = 0.6\nspecular = {more}\ntemperature = 300\n\
             {sides}[[target]]\nover = 'low'\nask = 'net_flux'\n[[target]]\nname = 'a point'\nat = [0.2, 0.7, 1]\nask = 'net_flux'\n[walk]\n{walk}\n[galerkin]\ncells = 24\ndegree = 1\n"
        );
        let exact = SIGMA * (400_f64.powi(4) - 300_f64.powi(4)) / (1.0 / 0.5 + 1.0 / 0.6 - 1.0);
        let found = asked(&folder, &text, look);
        for (own, exact) in found.iter().zip([exact, -exact]) {
            // 1 in 10⁶ of what meets the sides is scattered.
            assert!(
                (own[0] - exact).abs() < 4.0 * own[1] + 1e-4 * exact.abs(),
                "{found:?} {exact}"
            );
            assert!(own[1] < 0.02 * exact.abs());
        }
    }
}

#[test]
fn light_goes_both_ways_in_mirrors() {
    let folder = Folder::new();
    let light = HEAT
        .replace(
            "emissivity = 0.8\ntemperature = 300",
            "reflectance = 0.5\nemission = 2",
        )
        .replace("emissivity = 0.3\n", "reflectance = 0.4\n")
        .replace("temperature = 350\n", "emission = 1\n")
        .replace("temperature = 400\n", "")
        .replace("net_flux = 30\n", "")
        .replace("emissivity = 0.25\n", "reflectance = 0.6\n")
        .replace("net_flux = 0", "reflectance = 0.1");
    let names = ["ceiling", "west", "east", "north"];
    let targets = names.map(|name| format!("[[target]]\nover = '{name}'\nask = 'irradiance'\n"));
    let text = format!(
        "{light}{}[[target]]\nover = 'floor'\n[walk]\nwalks = 8000\n[galerkin]\ncells = 24\ndegree = 1\n",
        targets.concat()
    );
    let forward = asked(&folder, &text, &[]);
    for options in [["--adjoint", "true"], ["--scalar", "f32"]] {
        let other = asked(&folder, &text, &options);
        for (own, other) in forward.iter().zip(&other) {
            assert!(
                apart(*own, *other) < 4.5,
                "{options:?}: {forward:?} {other:?}"
            );
            assert!(
                own[1] < 0.02 * own[0] && other[1] < 0.05 * other[0],
                "{other:?}"
            );
        }
    }
}

#[test]
fn what_has_no_mirrors_is_refused() {
    let folder = Folder::new();
    let with = |more: &str| format!("{HEAT}{more}");
    let cases = [
        (
            with("[[target]]\nover = 'west'\n"),
            "what leaves a mirror depends on the direction: `ask = \"irradiance\"`",
        ),
        (
            with(
                "[[problem.light]]\ntowards = [0, 0, 1]\nirradiance = 3\n[[target]]\nover = 'floor'\n",
            ),
            "the sun and lamps at points are seen in mirrors",
        ),
        (
            with("[[target]]\nover = 'floor'\n").replace("specular = 0.4", "specular = 0.8"),
            "`specular` and `reflectance`, or `emissivity`, must not be above 1 together",
        ),
        (
            with("[[target]]\nover = 'floor'\n").replace("specular = 0.4", "specular = 1"),
            "a specular reflectance must be at least 0 and below 1",
        ),
    ];
    for (text, message) in cases {
        refused(&folder.solve(&text, &[]), &[message]);
    }
}

/// Form factors are of one scene, and `check` says what there is of one that repeats.
#[test]
fn what_repeats_has_no_form_factors() {
    let folder = Folder::new();
    let text = "[problem]\nkind = 'scene'\nperiod = { x = 2 }\n[[problem.surface]]\nname = 'floor'\n\
        polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nreflectance = 0.5\nemission = 1\n";
    let path = folder.file("row.toml", text);
    for method in ["exact", "rays"] {
        let ran = fredholm(&["factors", &path, "--method", method]);
        refused(
            &ran,
            &["form factors are of one scene, and this one repeats"],
        );
    }
    assert!(ended(0, &["check", &path]).stdout.contains("floor"));
}
