//! Heat in bands of wavelengths.

use fredholm::heat::part_below;
use serde_json::Value;

use crate::common::{self, Folder, estimate};

const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;
/// In micrometres.
const EDGES: [f64; 2] = [4.0, 9.0];
const NAMES: [&str; 3] = ["below 4 um", "4 to 9 um", "above 9 um"];
/// The emissivities of the surfaces in every band.
const WALLS: [f64; 3] = [0.2, 0.5, 0.9];
const STOVE: [f64; 3] = [0.9, 0.7, 0.3];

/// The parts of the heat of a black body in every band.
fn parts(kelvin: f64) -> [f64; 3] {
    let [first, second] = EDGES.map(|edge| part_below(edge, kelvin));
    [first, second - first, 1.0 - second]
}

/// What is said of a surface: of a band alone its reflectance and emission, else emissivities and a temperature.
fn material(emissivities: [f64; 3], kelvin: f64, band: Option<usize>) -> String {
    match band {
        Some(band) => {
            let emissivity = emissivities[band];
            let black = STEFAN_BOLTZMANN * kelvin.powi(4) * parts(kelvin)[band];
            let (reflectance, emission) = (1.0 - emissivity, emissivity * black);
            format!("reflectance = {reflectance}\nemission = {emission}")
        }
        None => format!("emissivity = {emissivities:?}\ntemperature = {kelvin}"),
    }
}

fn wavelengths(band: Option<usize>) -> String {
    match band {
        Some(_) => String::new(),
        None => format!("wavelengths = {EDGES:?}\n"),
    }
}

/// A box with a stove in it.
fn scene(stove: f64, band: Option<usize>) -> String {
    format!(
        r#"[problem]
kind = "scene"
{}[[problem.surface]]
name = "walls"
box = [[0, 0, 0], [2, 1, 1]]
inward = true
{}
[[problem.surface]]
name = "stove"
box = [[0.8, 0.4, 0.3], [1.2, 0.6, 0.6]]
{}
[galerkin]
cells = 30
degree = 1
[walk]
walks = 2048
absorption = 0.3
[[target]]
name = "corner"
at = [0, 0, 0]
[[target]]
name = "walls"
over = "walls"
"#,
        wavelengths(band),
        material(WALLS, 290.0, band),
        material(STOVE, stove, band)
    )
}

/// The same seen from above.
fn room(stove: f64, band: Option<usize>) -> String {
    format!(
        r#"[problem]
kind = "room"
{}[[problem.surface]]
name = "walls"
points = [[0, 0], [2, 0], [2, 1], [0, 1], [0, 0]]
{}
[[problem.surface]]
name = "stove"
points = [[0.8, 0.4], [0.8, 0.6], [1.2, 0.6], [1.2, 0.4], [0.8, 0.4]]
{}
[galerkin]
cells = 30
degree = 1
[walk]
walks = 2048
absorption = 0.3
[[target]]
name = "corner"
at = {{ surface = "walls", t = 0.1 }}
[[target]]
name = "walls"
over = "walls"
"#,
        wavelengths(band),
        material(WALLS, 290.0, band),
        material(STOVE, stove, band)
    )
}

fn solve(text: &str, seed: &str) -> Value {
    let folder = Folder::new();
    let file = folder.file("heat.toml", text);
    let ran = common::fredholm(&["solve", &file, "--seed", seed, "--json"]);
    ran.quietly(0).json()
}

/// Where all has one temperature, every band has that of a black body, whatever the emissivities.
#[test]
fn a_furnace_is_black_in_every_band() {
    for deck in [scene, room] {
        let report = solve(&deck(290.0, None), "1");
        let black = parts(290.0).map(|part| part * STEFAN_BOLTZMANN * 290.0_f64.powi(4));
        for targets in common::list(&report, "targets").chunks(4) {
            let all = black.iter().sum();
            for (target, exact) in targets.iter().zip(black.into_iter().chain([all])) {
                let name = &target["name"];
                assert_eq!(target["plain"]["unit"], "W/m2");
                let [u, error] = estimate(target, "plain");
                let z = (u - exact) / error;
                assert!(z.abs() < 4.9, "{name}: {u} ± {error}, {exact}");
                // v is u here, but for the rays that fit it.
                let close = |kind: &str, exact: f64| {
                    let [x, error] = estimate(target, kind);
                    let off = (x - exact).abs();
                    assert!(
                        off < 4.9 * error + 1e-9 * u && error < 2e-2 * u,
                        "{name}, {kind}: {x} ± {error}, {exact}"
                    );
                };
                close("preconditioned", exact);
                if target["channel"] != "sum" {
                    close("irradiance", exact);
                    close("net_flux", 0.0);
                }
            }
        }
    }
}

/// Every band has what a run of its own with this reflectance and emission has, and all together their sum.
#[test]
fn bands_agree_with_runs_of_their_own() {
    for deck in [scene, room] {
        let all = solve(&deck(800.0, None), "1");
        let own = [0, 1, 2].map(|band| solve(&deck(800.0, Some(band)), "2"));
        for (place, shared) in common::list(&all, "targets").chunks(4).enumerate() {
            let mut sum = 0.0;
            for (band, name) in NAMES.into_iter().enumerate() {
                assert_eq!(shared[band]["channel"], name);
                let one = &common::list(&own[band], "targets")[place];
                let [[a, s], [b, t]] =
                    [&shared[band], one].map(|target| estimate(target, "preconditioned"));
                let z = (a - b) / s.hypot(t);
                assert!(z.abs() < 4.9, "{name}: {a} ± {s} and {b} ± {t}");
                // H = (u − F)/ρ, so that it is as far off as u.
                let [[g, p], [h, q]] =
                    [&shared[band], one].map(|target| estimate(target, "irradiance"));
                let of_h = (g - h) / p.hypot(q);
                assert!((of_h - z).abs() < 1e-6, "{name}: {g} ± {p} and {h} ± {q}");
                let emissivity = WALLS[band];
                let black = STEFAN_BOLTZMANN * 290.0_f64.powi(4) * parts(290.0)[band];
                let [flux, _] = estimate(&shared[band], "net_flux");
                assert!(
                    (flux / (emissivity * (black - g)) - 1.0).abs() < 1e-9,
                    "{flux}"
                );
                sum += a;
            }
            assert_eq!(shared[3]["channel"], "sum");
            let [u, _] = estimate(&shared[3], "preconditioned");
            assert!((u / sum - 1.0).abs() < 1e-12, "{u} {sum}");
        }
    }
}

/// What does not go with bands is refused with what would be right.
#[test]
fn what_bands_refuse() {
    let folder = Folder::new();
    for deck in [scene, room] {
        let text = deck(800.0, None);
        let stove = material(STOVE, 800.0, None);
        for (from, to, words) in [
            (
                "[4.0, 9.0]",
                "[9.0, 4.0]",
                "wavelengths are in micrometres, more than 0 and in ascending order",
            ),
            ("[4.0, 9.0]", "[]", "there are 2 to 128 bands"),
            (
                "[4.0, 9.0]",
                "[4.0]",
                "`emissivity` has one number, or one for each of the channels, of which there are 2, not 3",
            ),
            (
                "wavelengths",
                "channels = [\"a\", \"b\", \"c\"]\nwavelengths",
                "give either the names of `channels` or the `wavelengths` of bands",
            ),
            (
                &stove,
                "reflectance = 0.5\nemission = 2",
                "with `wavelengths` surfaces have `emissivity` and `temperature`",
            ),
            (
                "temperature = 800",
                "net_flux = 10",
                "a net flux does not say in which band it leaves",
            ),
            ("[0.9, 0.7, 0.3]", "[0.9, 0.7, 1.3]", "at most 1"),
            (
                "temperature = 800",
                "temperature = -8",
                "a temperature must be from 0 to a million kelvin",
            ),
        ] {
            assert!(text.contains(from), "{from}");
            let file = folder.file("wrong.toml", text.replacen(from, to, 1));
            common::refused(&common::fredholm(&["solve", &file]), &[words]);
        }
    }
    let lamp = "[[problem.light]]\nat = [1, 0.5, 0.9]\nintensity = 1\n[[problem.surface]]\nname = \"stove\"";
    let lit = scene(800.0, None).replacen("[[problem.surface]]\nname = \"stove\"", lamp, 1);
    let file = folder.file("lit.toml", lit);
    let ran = common::fredholm(&["solve", &file]);
    let words = "the light of a sky and of lamps does not say in which bands it is";
    assert!(
        ran.status == Some(2) && ran.stderr.contains(words),
        "{ran:?}"
    );
}
