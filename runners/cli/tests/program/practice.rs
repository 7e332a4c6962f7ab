//! Cases of people who compute radiation between surfaces, with their right values.

use core::fmt::Write as _;

use crate::common;

use common::{Folder, ended, fredholm, refused};

/// A polygon, and its surface's name.
type Named<'a> = (&'a str, Vec<[f64; 3]>);

/// The form factors of a View3D deck of these polygons as converters write it, without `End of data`.
struct Deck {
    names: Vec<String>,
    factors: serde_json::Value,
}

impl Deck {
    fn new(polygons: &[Named<'_>], is_closed: bool) -> Self {
        let mut text = format!("T case\nC encl={}\nF 3\n", i32::from(is_closed));
        let (mut surfaces, mut count) = (String::new(), 0);
        for (number, (name, points)) in polygons.iter().enumerate() {
            let mut own = Vec::new();
            for [x, y, z] in points {
                count += 1;
                own.push(count.to_string());
                writeln!(text, "V {count} {x:?} {y:?} {z:?}").unwrap();
            }
            let own = own.join(" ");
            writeln!(surfaces, "S {} {own} 0 0 0.9 {name}", number + 1).unwrap();
        }
        let folder = Folder::new();
        let path = folder.file("case.vs3", text + &surfaces);
        let json = ended(0, &["factors", &path, "--json"]).json();
        let name = |name: &serde_json::Value| name.as_str().unwrap().to_owned();
        Self {
            names: common::list(&json, "surfaces").iter().map(name).collect(),
            factors: json["factors"].clone(),
        }
    }

    #[track_caller]
    fn is(&self, from: &str, to: &str, right: f64, within: f64) {
        let number = |name| self.names.iter().position(|own| own == name).unwrap();
        let found = self.factors[number(from)][number(to)].as_f64().unwrap();
        assert!(
            (found - right).abs() < within,
            "{from} to {to}: {found}, {right}"
        );
    }
}

/// EnergyPlus' L-shaped zone in units of 10 feet, with a roof and a floor of two rectangles.
#[test]
fn an_l_shaped_zone() {
    const UNIT: f64 = 3.048;
    let plan = [[0, 0], [4, 0], [4, 4], [2, 4], [2, 2], [0, 2]];
    let up = |[x, y]: [i32; 2], z: i32| [x, y, z].map(|x| UNIT * f64::from(x));
    let rectangle = |[a, b]: [[i32; 2]; 2]| [a, [b[0], a[1]], b, [a[0], b[1]]];
    let mut polygons: Vec<Named<'_>> = Vec::new();
    for (floor, roof, at) in [
        ("Floor-1", "Roof-1", [[0, 0], [4, 2]]),
        ("Floor-2", "Roof-2", [[2, 2], [4, 4]]),
    ] {
        polygons.push((floor, rectangle(at).map(|p| up(p, 0)).to_vec()));
        polygons.push((
            roof,
            rectangle(at).map(|p| up(p, 1)).into_iter().rev().collect(),
        ));
    }
    let walls = ["South", "East", "North-2", "West-2", "North-1", "West-1"];
    for (k, name) in walls.into_iter().enumerate() {
        let (p, q) = (plan[k], plan[(k + 1) % 6]);
        polygons.push((name, vec![up(q, 0), up(p, 0), up(p, 1), up(q, 1)]));
    }
    let deck = Deck::new(&polygons, true);
    for (from, to, right) in [
        ("Roof-1", "Floor-1", 0.508_988_669_041),
        ("Roof-2", "Floor-2", 0.415_253_283_577),
        ("South", "East", 0.101_358_700_2),
        ("North-1", "West-1", 0.149_299_795_9),
    ] {
        deck.is(from, to, right, 1e-10);
    }
}

/// A unit square at the plane x = 0, and its neighbour behind a gap, turned by an angle about their edge.
fn squares(angle: f64, gap: f64) -> Deck {
    let (sine, cosine) = angle.to_radians().sin_cos();
    let low = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let turned = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let turned = turned.map(|[r, y]| [r * cosine - gap, y, r * sine]);
    Deck::new(&[("low", low), ("turned", turned.to_vec())], false)
}

/// Howell's C-11, C-14 and C-16, and squares that do not quite meet.
#[test]
fn rectangles() {
    let up = |z: f64| vec![[0.0, 0.0, z], [5.0, 0.0, z], [5.0, 4.0, z], [0.0, 4.0, z]];
    let ceiling = up(0.5).into_iter().rev().collect();
    let deck = Deck::new(&[("floor", up(0.0)), ("ceiling", ceiling)], false);
    deck.is("floor", "ceiling", 0.808_106_225_794_4, 1e-12);
    for (angle, gap, right) in [
        (30.0, 0.0, 0.619_028_323_090_7),
        (60.0, 0.0, 0.370_905_321_150_1),
        (120.0, 0.0, 0.086_615_001_118_3),
        (90.0, 1e-3, 0.199_610_808_935_9),
        (90.0, 1e-9, 0.200_043_775_641_1),
    ] {
        squares(angle, gap).is("low", "turned", right, 1e-12);
    }
}

/// A cube of 10 m where maps have it, in metres and in millimetres, where a step of f64 is 1e-9 of a metre.
#[test]
fn a_cube_far_from_the_origin() {
    for (unit, origin) in [
        (1.0, [512_345.678, 5_403_210.987, 251.2]),
        (1e3, [512_345_678.0, 5_403_210_987.0, 251_200.0]),
        (1.0, [10_000_001.0, 10_000_003.0, 5.0]),
    ] {
        let corner = |i: usize| [0, 1, 2].map(|k| origin[k] + 10.0 * unit * ((i >> k) & 1) as f64);
        let faces = [
            ("floor", [0, 1, 3, 2]),
            ("top", [4, 6, 7, 5]),
            ("south", [0, 4, 5, 1]),
            ("east", [1, 5, 7, 3]),
            ("north", [3, 7, 6, 2]),
            ("west", [2, 6, 4, 0]),
        ];
        let polygons = faces.map(|(name, corners)| (name, corners.map(corner).to_vec()));
        let deck = Deck::new(&polygons, true);
        deck.is("floor", "top", 0.199_824_895_698_387, 1e-8);
        deck.is("floor", "east", 0.200_043_776_075_403, 1e-8);
    }
}

/// A plate that is tilted by 30° under a uniform sky: (1 + cos 30°)/2 of it.
#[test]
fn a_tilted_plate_under_a_sky() {
    let folder = Folder::new();
    let file = "[problem]\nkind = 'scene'\nsky = { emission = 1 }\n[[problem.surface]]\nname = 'plate'\n\
                polygon = [[0, 0, 0], [0.8660254037844386, 0, 0.5], [0.8660254037844386, 1, 0.5], [0, 1, 0]]\n\
                two_sided = true\nreflectance = 0\n[[target]]\nover = 'plate'\nask = 'irradiance'\n";
    let path = folder.file("plate.toml", file);
    let json = ended(0, &["factors", &path, "--json"]).json();
    let sky = json["sky"]["factors"][0][0]
        .as_f64()
        .unwrap_or_else(|| panic!("{json}"));
    assert!((sky - 0.933_012_701_892_2).abs() < 1e-12, "{sky}");
    let json = ended(0, &["solve", &path, "--json", "--walks", "20000"]).json();
    let own = &json["targets"][0]["preconditioned"];
    let [value, error] = ["estimate", "std_error"].map(|key| own[key].as_f64().unwrap());
    assert!(
        (value - 0.933_012_701_892_2).abs() < 4.0 * error && error < 3e-3,
        "{value} ± {error}"
    );
}

/// A crater that is a part of a sphere, five times as wide as deep, of reflectance 0.3 under a sun at 20°: scattered light is as strong
/// everywhere in it, ρ f (1 − f) sin 20°/(1 − ρ f) with the part f of the sphere (Ingersoll, Svitek and Murray 1992).
#[test]
fn the_shadow_in_a_crater() {
    const RINGS: usize = 16;
    const SECTORS: usize = 32;
    const RADIUS: f64 = 3.625;
    let wide = (2.5 / RADIUS).asin();
    let mut points = vec![[0.0, 0.0, -1.0]];
    for ring in 1..=RINGS {
        let (sine, cosine) = (wide * ring as f64 / RINGS as f64).sin_cos();
        for sector in 0..SECTORS {
            let (y, x) =
                (core::f64::consts::TAU * (sector as f64 + 0.5) / SECTORS as f64).sin_cos();
            points.push([
                RADIUS * sine * x,
                RADIUS * sine * y,
                RADIUS - 1.0 - RADIUS * cosine,
            ]);
        }
    }
    let at = |ring: usize, sector: usize| (ring - 1) * SECTORS + sector % SECTORS + 1;
    let mut faces = Vec::new();
    for sector in 0..SECTORS {
        faces.push([0, at(1, sector), at(1, sector + 1)]);
        for ring in 1..RINGS {
            let [a, b] = [at(ring, sector), at(ring + 1, sector)];
            let [c, d] = [at(ring + 1, sector + 1), at(ring, sector + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let folder = Folder::new();
    let mut mesh = "o crater\n".to_owned();
    for [x, y, z] in &points {
        writeln!(mesh, "v {x:?} {y:?} {z:?}").unwrap();
    }
    for [a, b, c] in &faces {
        writeln!(mesh, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    folder.file("crater.obj", mesh);
    // The sun stands towards x; what is below the rim there lies in the shadow.
    let [a, b, c] = [at(14, SECTORS - 1), at(15, SECTORS - 1), at(15, 0)].map(|k| points[k]);
    let [x, y, z] = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
    let (height, ahead) = 20.0_f64.to_radians().sin_cos();
    let file = format!(
        "[problem]\nkind = 'scene'\nmesh = 'crater.obj'\nopen = true\n[[problem.surface]]\nname = 'crater'\nreflectance = 0.3\n\
         [[problem.light]]\ntowards = [{ahead}, 0, {height}]\nirradiance = 1\n\
         [[target]]\nname = 'shadow'\nat = {{ surface = 'crater', point = [{x}, {y}, {z}] }}\nask = 'irradiance'\n\
         [walk]\nwalks = 300000\n"
    );
    let path = folder.file("crater.toml", file);
    let json = ended(0, &["solve", &path, "--json"]).json();
    let own = &json["targets"][0]["preconditioned"];
    let [value, error] = ["estimate", "std_error"].map(|key| own[key].as_f64().unwrap());
    // Flat faces are off by the square of a ring's part of the radius.
    let flat = 0.5 * (wide / RINGS as f64).powi(2);
    let off = (value - 0.012_727_120_193_2).abs();
    assert!(
        off < 4.0 * error + 0.0127 * flat && error < 1e-4,
        "{value} ± {error}"
    );
    // Its ground has the temperature at which it gives away all that it absorbs, α = 0.7 of sunlight and ε = 0.95 of heat: of all that arrives in
    // the shadow, f sin 20°, sunlight counts α/ε times.
    let text = std::fs::read_to_string(&path).unwrap();
    let ground = text
        .replace(
            "reflectance = 0.3",
            "net_flux = 0\nemissivity = 0.95\nabsorptance = 0.7",
        )
        .replace("irradiance = 1\n", "irradiance = 1361\n")
        .replace("ask = 'irradiance'", "ask = 'temperature'");
    let path = folder.file("ground.toml", ground);
    let json = ended(0, &["solve", &path, "--json"]).json();
    let own = &json["targets"][0]["preconditioned"];
    let [value, error] = ["estimate", "std_error"].map(|key| own[key].as_f64().unwrap());
    let part = 0.137_931_034_5 * height - (1.0 - 0.7 / 0.95) * 0.012_727_120_193_2;
    let exact = (1361.0 * part / 5.670_374_419e-8_f64).powf(0.25);
    let off = (value - exact).abs();
    assert!(
        off < 4.0 * error + exact * flat && error < 0.5,
        "{value} ± {error}, {exact}"
    );
}

/// The description of a prism of so many sides in a tube of radius 1, and of what passes from one end to the other.
fn prism(sides: usize, length: f64) -> String {
    let at = |k: usize, z: f64| {
        let (sine, cosine) = (core::f64::consts::TAU * (k % sides) as f64 / sides as f64).sin_cos();
        [cosine, sine, z]
    };
    let wall = |k| [at(k, 0.0), at(k, length), at(k + 1, length), at(k + 1, 0.0)];
    let walls: Vec<[[f64; 3]; 4]> = (0..sides).map(wall).collect();
    let inlet: Vec<[f64; 3]> = (0..sides).map(|k| at(k, 0.0)).collect();
    let outlet: Vec<[f64; 3]> = (0..sides).rev().map(|k| at(k, length)).collect();
    format!(
        "[problem]\nkind = 'vacuum'\n[[problem.surface]]\nname = 'wall'\npolygons = {walls:?}\n\
         [[problem.surface]]\nname = 'inlet'\npolygon = {inlet:?}\n\
         [[problem.surface]]\nname = 'outlet'\npolygon = {outlet:?}\n\
         [[target]]\nname = 'tube'\nask = 'transmission'\nfrom = 'inlet'\nover = 'outlet'\n"
    )
}

/// Molecules through a tube: the share that passes, and the conductance.
#[test]
fn molecules_pass_a_tube() {
    let folder = Folder::new();
    let path = folder.file("tube.toml", prism(40, 1.0));
    let ran = ended(0, &["solve", &path, "--json", "--walks", "20000"]);
    let target = &ran.json()["targets"][0];
    assert_eq!(target["ask"], "transmission");
    let of = |key: &str, unit: Option<&str>| {
        assert_eq!(target[key]["unit"].as_str(), unit, "{target}");
        ["estimate", "std_error"].map(|of| target[key][of].as_f64().unwrap())
    };
    // Clausing's tube, of which 40 sides lack some 1e-4.
    for own in ["plain", "preconditioned"] {
        let [passed, error] = of(own, None);
        let off = (passed - 0.671_984).abs();
        assert!(
            off < 4.0 * error + 1e-4 && error < 5e-3,
            "{passed} ± {error}"
        );
    }
    // A quarter of the mean speed of nitrogen at 20 °C, 470.70 m/s, times the inlet's area in litres.
    let opening = 250.0 * 470.703 * 20.0 * (core::f64::consts::TAU / 40.0).sin();
    let numbers = of("preconditioned", None)
        .into_iter()
        .zip(of("net_flux", Some("l/s")));
    for (passed, conductance) in numbers {
        assert!(
            (conductance / (opening * passed) - 1.0).abs() < 1e-5,
            "{conductance}"
        );
    }
    let table = ended(0, &["solve", &path, "--walks", "100"]).stdout;
    assert!(
        table.contains("tube: transmission") && table.contains("conductance, l/s"),
        "{table}"
    );
    assert!(!table.contains("throughput"), "{table}");
    // What takes some molecules on the way, and an end of another size.
    let changed = |from: &str, to: &str| {
        let text = prism(40, 1.0).replace(from, to);
        fredholm(&["solve", &folder.file("other.toml", text)])
    };
    let other = "[[target]]\nname = 'p'\nover = 'wall'\n[[target]]\nname = 'tube'";
    for (from, to, why) in [
        (
            "from = 'inlet'\n",
            "",
            "a transmission is from one surface to another",
        ),
        (
            "ask = 'transmission'\n",
            "",
            "`from` names where molecules enter",
        ),
        ("from = 'inlet'", "from = 'inlets'", "did you mean"),
        (
            "over = 'outlet'",
            "over = 'inlet'",
            "molecules enter by this surface",
        ),
        (
            "over = 'outlet'",
            "over = 'all'",
            "a transmission is to surfaces",
        ),
        (
            "[[target]]\nname = 'tube'",
            other,
            "ask for pressures in another file",
        ),
        (
            "name = 'wall'\n",
            "name = 'wall'\noutgassing = 1\n",
            "leave out the outgassing",
        ),
        (
            "name = 'outlet'\n",
            "name = 'outlet'\npump = 100\n",
            "leave out `sticking` and `pump`",
        ),
        (
            "[[target]]",
            "[walk]\nsensitivities = true\n[[target]]",
            "derivatives of transmissions",
        ),
        (
            "kind = 'vacuum'",
            "kind = 'scene'",
            "a transmission is of molecules",
        ),
    ] {
        refused(&changed(from, to), &[why]);
    }
    let path = folder.file("tube.toml", prism(4, 1.0));
    let few = ["--cells", "6", "--degree", "0", "--walks", "100"];
    for option in [&["--global"][..], &["--adjoint", "true"]] {
        let ran = fredholm(&[&["solve", &path], &few[..], option].concat());
        refused(&ran, &["leave `"]);
    }
}

/// A duct as Molflow writes it, in centimetres, is the one that is described in metres.
#[test]
fn a_geometry_of_molflow_is_read() {
    let folder = Folder::new();
    let corners = [
        [0, 0, 0],
        [10, 0, 0],
        [10, 10, 0],
        [0, 10, 0],
        [0, 0, 50],
        [10, 0, 50],
        [10, 10, 50],
        [0, 10, 50],
    ];
    let mut text = "version:15\ntotalHit:0\nmaxDes:0\nnbVertex:8\nnbFacet:7\nnbSuper:1\nnbFormula:1\ngasMass: 2.8E+01\nuserMoments {\n nb:0\n}\n\
        formulas {\n  \"a } facet {\" \"P1\"\n}\nstructures {\n  \"duct\"\n}\nvertices {\n"
        .to_owned();
    for (k, corner) in corners.iter().enumerate() {
        let [x, y, z] = corner.map(f64::from);
        writeln!(text, "  {}  {x:.14E}  {y:.14E}  {z:.14E}", k + 1).unwrap();
    }
    text += "}\nleaks {\n nbLeak:0\n}\n";
    // Corners, sticking, opacity, desorption, sides and outgassing.
    let facets = [
        ([1, 2, 3, 4], 1, 1, 2, 0, "3E-01"),
        ([5, 8, 7, 6], 1, 1, 0, 0, "5"),
        ([1, 5, 6, 2], 0, 1, 0, 0, "0"),
        ([2, 6, 7, 3], 0, 1, 0, 0, "0"),
        ([3, 7, 8, 4], 0, 1, 0, 0, "0"),
        ([4, 8, 5, 1], 0, 1, 2, 0, "2E-01"),
        ([1, 2, 7, 8], 0, 0, 0, 1, "0"),
    ];
    for (k, (corners, sticking, opacity, desorption, sides, given)) in facets.iter().enumerate() {
        writeln!(text, "facet {} {{\n  nbIndex:4\n  indices:", k + 1).unwrap();
        for corner in corners {
            writeln!(text, "    {corner}").unwrap();
        }
        writeln!(
            text,
            "  sticking: {sticking}\n  opacity: {opacity}\n  desorbType:{desorption}\n  desorbTypeN: 0\n  reflectType:0\n  profileType:0\n  superDest:0\n  \
             superIdx:0\n  is2sided:{sides}\n  mesh:0\n  outgassing: {given}\n  temperature: 2.9315E+02\n  teleportDest:0\n}}"
        )
        .unwrap();
    }
    let file = |mesh: &str| {
        format!("[problem]\nkind = 'vacuum'\n{mesh}[[target]]\nname = 'p'\nover = 'facet 6'\n")
    };
    folder.file("duct.geo", &text);
    let molflow = folder.file("molflow.toml", file("mesh = 'duct.geo'\n"));
    let polygon = |facet: usize| {
        facets[facet]
            .0
            .map(|k| corners[k - 1].map(|x| 0.01 * f64::from(x)))
    };
    let surface = |name: &str, facet: usize, words: &str| {
        format!(
            "[[problem.surface]]\nname = '{name}'\npolygon = {:?}\n{words}\n",
            polygon(facet)
        )
    };
    let walls = [2, 3, 4].map(polygon);
    let own = [
        surface("facet 1", 0, "sticking = 1\noutgassing = 0.3"),
        surface("facet 2", 1, "sticking = 1"),
        format!("[[problem.surface]]\nname = 'walls'\npolygons = {walls:?}\n"),
        surface("facet 6", 5, "outgassing = 0.2"),
    ];
    let described = folder.file("described.toml", file(&own.concat()));
    let [found, wanted] = [molflow, described].map(|path| {
        let ran = ended(
            0,
            &[
                "solve", &path, "--json", "--walks", "2000", "--cells", "60", "--degree", "0",
            ],
        );
        let json = ran.json();
        (
            ran.stderr,
            json["targets"][0]["preconditioned"].clone(),
            json["surfaces"].clone(),
        )
    });
    assert_eq!((&found.1, &found.2), (&wanted.1, &wanted.2));
    assert!(found.1["estimate"].as_f64().unwrap() > 0.0);
    for words in ["left out: 1 of them", "28 g/mol at 293.15 K"] {
        assert!(found.0.contains(words), "{}", found.0);
    }
    for (from, to, line, why) in [
        (
            "opacity: 1\n",
            "opacity: 5E-01\n",
            31,
            "facet 1: it is opaque in part",
        ),
        (
            "reflectType:0",
            "reflectType:1",
            73,
            "facet 3: molecules leave it other than evenly",
        ),
        (
            "desorbType:2",
            "desorbType:3",
            31,
            "facet 1: molecules leave it other than evenly",
        ),
        (
            "teleportDest:0",
            "teleportDest:4",
            31,
            "facet 1: it leads to another",
        ),
        ("outgassing: 3E-01\n", "", 31, "facet 1: it gives off gas"),
        (
            "sticking: 1\n",
            "sticking: 2\n",
            31,
            "a sticking factor is from 0 to 1",
        ),
        ("nbSuper:1", "nbSuper:2", 6, "several structures"),
        ("    8\n", "    9\n", 56, "there is no vertex 9"),
        ("1.00000000000000E1 ", "ten ", 20, "\"ten\" is not a number"),
    ] {
        let changed = text.replacen(from, to, if from.starts_with("refl") { 9 } else { 1 });
        assert_ne!(changed, text, "{from}");
        folder.file("duct.geo", changed);
        let ran = fredholm(&["solve", &folder.at("molflow.toml")]);
        refused(&ran, &[why, &format!("duct.geo:{line}")]);
    }
    // A word is missing, or a facet.
    for kept in [text.len() - 60, text.rfind("facet 7").unwrap()] {
        folder.file("duct.geo", &text[..kept]);
        let ran = fredholm(&["solve", &folder.at("molflow.toml")]);
        refused(&ran, &["the file ends"]);
    }
}

/// The manual's probabilities of transmission are those that the program computes.
#[test]
fn tubes_of_the_manual() {
    let page = std::fs::read_to_string(crate::manual::root().join("docs/vacuum.md")).unwrap();
    let rows = page
        .lines()
        .skip_while(|line| !line.starts_with("| L/R | W |"))
        .skip(2);
    let rows = rows.take_while(|line| line.starts_with('|'));
    let numbers: Vec<&str> = rows
        .flat_map(|row| row.split('|').map(str::trim))
        .filter(|cell| !cell.is_empty())
        .collect();
    assert_eq!(numbers.len(), 28);
    let longest = if std::env::var_os("FREDHOLM_LONG").is_some() {
        100.0
    } else {
        10.0
    };
    let folder = Folder::new();
    for pair in numbers.chunks(2) {
        let (length, told) = (
            pair[0].parse::<f64>().unwrap(),
            pair[1].parse::<f64>().unwrap(),
        );
        if length > longest {
            continue;
        }
        let file = format!(
            "[problem]\nkind = 'tube'\nlength = {length:?}\nreflectance = 1.0\nends = [1.0, 0.0]\n[walk]\ntarget_error = 1e-4\nrelative = true\n\
             [[target]]\nname = 'W'\nover = 'right'\n"
        );
        let path = folder.file("tube.toml", file);
        let json = ended(0, &["solve", &path, "--json"]).json();
        let own = &json["targets"][0]["preconditioned"];
        let [value, error] = ["estimate", "std_error"].map(|key| own[key].as_f64().unwrap());
        let digits = pair[1].split('.').nth(1).map_or(0, str::len) as i32;
        assert!(
            (value - told).abs() < 4.0 * error + 0.5 * 0.1_f64.powi(digits),
            "{length}: {value} ± {error}, {told}"
        );
    }
}
