//! Heat of surfaces with an `absorptance` of their own for sunlight: temperatures and net fluxes against closed forms and against scenes of heat
//! and of light alone.

use crate::common::{Folder, asked, refused};

const SIGMA: f64 = 5.670_374_419e-8;

/// A plate faces the sun, and another one the ground of a planet that reflects three tenths of it.
#[test]
fn plates_have_the_temperatures_of_closed_forms() {
    let folder = Folder::new();
    let text = "[problem]\nkind = 'scene'\nopen = true\n[[problem.light]]\ntowards = [0, 0, 1]\nirradiance = 1361\n\
        [[problem.surface]]\nname = 'ground'\npolygon = [[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]]\n\
        emissivity = 1\ntemperature = 255\nabsorptance = 0.7\n\
        [[problem.surface]]\nname = 'up'\npolygon = [[-0.005, -0.005, 1], [0.005, -0.005, 1], [0.005, 0.005, 1], [-0.005, 0.005, 1]]\n\
        net_flux = 40\nemissivity = 0.8\nabsorptance = 0.3\n\
        [[problem.surface]]\nname = 'down'\npolygon = [[-0.005, -0.005, 1], [-0.005, 0.005, 1], [0.005, 0.005, 1], [0.005, -0.005, 1]]\n\
        net_flux = 0\nemissivity = 0.8\nabsorptance = 0.3\n\
        [walk]\nwalks = 40000\n\
        [[target]]\nover = 'up'\nask = 'temperature'\n[[target]]\nover = 'down'\nask = 'temperature'\n";
    let found = asked(&folder, text, &[]);
    // A square of half width 5 below at distance 1: of four quarters, by two edges each.
    let edge = 5.0 / 26_f64.sqrt();
    let factor = 4.0 / core::f64::consts::TAU * 2.0 * edge * edge.atan();
    let ground = SIGMA * 255_f64.powi(4);
    let up = (0.3 / 0.8 * 1361.0 + 40.0 / 0.8) / SIGMA;
    let down = factor * (ground + 0.3 / 0.8 * 0.3 * 1361.0) / SIGMA;
    for (own, fourth) in found.iter().zip([up, down]) {
        let exact = fourth.powf(0.25);
        // The plate's own shadow is a ten thousandth of the ground below it.
        assert!(
            (own[0] - exact).abs() < 4.0 * own[1] + 0.01,
            "{found:?} {exact}"
        );
        assert!(own[1] < 0.5, "{found:?}");
    }
}

/// A yard in the sun, whose surfaces have temperatures.
const YARD: &str = "[problem]\nkind = 'scene'\nopen = true\nSKY\n[[problem.light]]\ntowards = [1, 2, 3]\nirradiance = 900\n\
    [[problem.surface]]\nname = 'ground'\npolygon = [[0, 0, 0], [3, 0, 0], [3, 2, 0], [0, 2, 0]]\nGROUND\n\
    [[problem.surface]]\nname = 'wall'\npolygon = [[0, 2, 0], [3, 2, 0], [3, 2, 2], [0, 2, 2]]\nWALL\n\
    [[problem.surface]]\nname = 'side'\npolygon = [[0, 0, 0], [0, 2, 0], [0, 2, 1], [0, 0, 1]]\nSIDE\n\
    [walk]\nwalks = 40000\n";

fn yard(of: [&str; 4], targets: &str) -> String {
    let names = ["SKY", "GROUND", "WALL", "SIDE"];
    let named = names.iter().zip(of);
    named.fold(YARD.to_owned(), |text, (name, own)| text.replace(name, own)) + targets
}

/// Where all temperatures are given heat and sunlight know nothing of each other: two scenes of one each have the same net fluxes together.
#[test]
fn net_fluxes_are_those_of_heat_less_those_of_light() {
    let folder = Folder::new();
    let ask = |what: &str| {
        format!(
            "[[target]]\nover = 'ground'\nask = '{what}'\n[[target]]\nover = 'wall'\nask = '{what}'\n\
             [[target]]\nname = 'point'\nat = {{ surface = 'side', point = [0, 1, 0.5] }}\nask = '{what}'\n"
        )
    };
    let heat = [
        "emissivity = 0.9\ntemperature = 300\n",
        "emissivity = 0.6\ntemperature = 310\n",
        "temperature = 290\n",
    ];
    let absorbed = [0.6, 0.2, 0.85];
    let sky = "sky = { emission = 120 }";
    let both: Vec<String> = heat
        .iter()
        .zip(absorbed)
        .map(|(own, a)| format!("{own}absorptance = {a}\n"))
        .collect();
    let both = yard([sky, &both[0], &both[1], &both[2]], &ask("net_flux"));
    let alone = yard(["", heat[0], heat[1], heat[2]], &ask("net_flux"));
    let alone = alone.replace("irradiance = 900", "irradiance = 0");
    let light: Vec<String> = absorbed
        .iter()
        .map(|a| format!("reflectance = {}\n", 1.0 - a))
        .collect();
    let light = yard([sky, &light[0], &light[1], &light[2]], &ask("irradiance"));
    let [both, heat, light] = [both, alone, light].map(|text| asked(&folder, &text, &[]));
    for (k, own) in both.iter().enumerate() {
        let expected = heat[k][0] - absorbed[k] * light[k][0];
        let error = own[1].hypot(heat[k][1]).hypot(absorbed[k] * light[k][1]);
        assert!(
            (own[0] - expected).abs() < 4.5 * error,
            "{k}: {own:?} {expected} ± {error}"
        );
        assert!(error < 10.0, "{error}");
    }
}

/// What absorbs as much of sunlight as of heat is grey: results are those of a scene that says nothing of sunlight, to the bit.
#[test]
fn grey_surfaces_are_those_without_an_absorptance() {
    let folder = Folder::new();
    let targets = "[[target]]\nover = 'ground'\nask = 'net_flux'\n[[target]]\nover = 'side'\nask = 'temperature'\n\
        [[target]]\nname = 'air'\nat = [1.5, 1, 1]\n";
    let own = [
        "emissivity = 0.9\ntemperature = 300\n",
        "net_flux = 0\nemissivity = 0.7\n",
        "net_flux = 20\nemissivity = 0.5\n",
    ];
    let with: Vec<String> = own
        .iter()
        .zip([0.9, 0.7, 0.5])
        .map(|(own, a)| format!("{own}absorptance = {a}\n"))
        .collect();
    let without = yard(["", own[0], own[1], own[2]], targets)
        .replace("open = true", "open = true\nnet_fluxes = false");
    let with = yard(["", &with[0], &with[1], &with[2]], targets);
    // 1 − 0.9 in floating point is 0.1 less a rounding error, so that the first is not quite grey.
    let cells = ["--cells", "30", "--degree", "1", "--walks", "10000"];
    let [a, b] = [with, without].map(|yard| asked(&folder, &yard, &cells));
    for (a, b) in a.iter().zip(&b) {
        assert!((a[0] - b[0]).abs() <= 1e-9 * b[0].abs(), "{a:?} {b:?}");
    }
    // In equilibrium what arrives does not depend on what is absorbed; the temperature does.
    let lit = yard(
        [
            "",
            "net_flux = 0\nemissivity = 0.9\nabsorptance = 0.2\n",
            "net_flux = 0\nabsorptance = 0.4\n",
            "net_flux = 0\nemissivity = 0.5\n",
        ],
        "[[target]]\nover = 'ground'\nask = 'irradiance'\n[[target]]\nname = 'warm'\nover = 'ground'\nask = 'temperature'\n",
    );
    let dark = lit.replace("absorptance = 0.2", "absorptance = 0.8");
    let [lit, dark] = [lit, dark].map(|yard| asked(&folder, &yard, &cells));
    assert_eq!(lit[0], dark[0]);
    assert!(dark[1][0] > lit[1][0] + 20.0, "{lit:?} {dark:?}");
}

#[test]
fn what_cannot_tell_sunlight_apart_is_refused() {
    let folder = Folder::new();
    let own = [
        "sky = { emission = 100 }",
        "emissivity = 0.9\ntemperature = 300\nabsorptance = 0.3\n",
        "net_flux = 0\n",
        "temperature = 290\n",
    ];
    let target = "[[target]]\nover = 'ground'\nask = 'net_flux'\n";
    let cases = [
        (
            yard(own, target),
            "surface \"wall\": where one surface has an `absorptance` this one needs it, too",
        ),
        (
            yard(own, target).replace("absorptance = 0.3", "absorptance = 1.3"),
            "an absorptance must be from 0 to 1",
        ),
        (
            yard(
                [
                    own[0],
                    "reflectance = 0.5\nabsorptance = 0.3\n",
                    own[2],
                    own[3],
                ],
                target,
            ),
            "`absorptance` is what a surface of temperature or net flux absorbs of sunlight",
        ),
        (
            yard(
                [own[0], own[1], "net_flux = 0\nabsorptance = 0.2\n", own[3]],
                "[[target]]\nover = 'wall'\nask = 'temperature'\n",
            ),
            "the temperature follows from the `absorptance` and the `emissivity`: give both",
        ),
    ];
    for (text, message) in cases {
        refused(&folder.solve(&text, &[]), &[message]);
    }
}
