//! `fredholm factors` of scenes in space.

use crate::common;

use common::{Folder, ended, fredholm, refused};

/// View3D's example: two unit squares with a square half-way between, which hides a quarter.
const DECK: &str = "T Two squares\nC encl=0 list=3\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\nV 5 0 0 1\nV 6 1 0 1\n\
V 7 1 1 1\nV 8 0 1 1\nV 9 0 0 .5\nV 10 .5 0 .5\nV 11 .5 .5 .5\nV 12 0 .5 .5\nS 1 1 2 3 4 0 0 0.5 low\nS 2 7 6 5 8 0 0 0.5 high\n\
S 3 9 10 11 12 0 0 0.5 between\nEnd of data\n";

/// Howell's C-11, of which the square takes a quarter.
const QUARTER_LESS: f64 = 0.75 * 0.199_824_895_698_387;

#[test]
fn factors_of_a_deck_in_every_form() {
    let folder = Folder::new();
    let deck = folder.file("squares.vs3", DECK);
    let printed = ended(0, &["factors", &deck]);
    assert!(printed.stdout.contains("0.149869"), "{}", printed.stdout);
    assert!(
        printed
            .stderr
            .contains("3 polygons, 2 pairs see each other"),
        "{}",
        printed.stderr
    );
    let json = ended(
        0,
        &[
            "factors",
            &deck,
            "--json",
            "--error",
            "1e-11",
            "--threads",
            "2",
        ],
    );
    let json = json.json();
    let f = json["factors"][0][1].as_f64().unwrap();
    assert!((f - QUARTER_LESS).abs() < 1e-11, "{f}");
    assert_eq!(json["surfaces"][2], "between");
    assert_eq!(json["areas"][2], 0.25);
    let csv = folder.at("factors.csv");
    ended(0, &["factors", &deck, "--out", &csv]);
    let csv = std::fs::read_to_string(csv).unwrap();
    assert!(
        csv.starts_with("from,to,factor,bound,area,mesh_crc32\nlow,high,0.14986867"),
        "{csv}"
    );
    assert_eq!(csv.lines().count(), 5);
    let arrays = folder.at("factors.npz");
    ended(0, &["factors", &deck, "--out", &arrays]);
    let arrays = std::fs::read(arrays).unwrap();
    let at = |words: &[u8]| arrays.windows(words.len()).position(|w| w == words);
    // The second number of the first array, behind its head of 128 bytes.
    let first = at(b"\x93NUMPY").unwrap() + 128 + 8;
    let number = f64::from_le_bytes(arrays[first..first + 8].try_into().unwrap());
    assert!((number - QUARTER_LESS).abs() < 1e-9, "{number}");
    for name in [
        "factors.npy",
        "surfaces.npy",
        "areas.npy",
        "emissivities.npy",
    ] {
        assert!(at(name.as_bytes()).is_some(), "{name}");
    }
    let text = folder.at("factors.txt");
    ended(0, &["factors", &deck, "--out", &text]);
    let text = std::fs::read_to_string(text).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[1], "1.0 1.0 0.25");
    assert_eq!((lines.len(), lines[5]), (6, "0.5 0.5 0.5"));
}

#[test]
fn the_template_has_factors_and_a_picture() {
    let folder = Folder::new();
    let template = ended(0, &["init", "scene"]).stdout;
    let file = folder.file("scene.toml", &template);
    let printed = ended(0, &["factors", &file, "--error", "1e-6"]);
    assert!(
        printed.stderr.contains("row sums: at most"),
        "{}",
        printed.stderr
    );
    let rough = ["factors", &file, "--error", "1e-2", "--close", "--json"];
    let closed = ended(0, &rough);
    assert!(closed.stderr.contains("rows closed"), "{}", closed.stderr);
    for row in closed.json()["factors"].as_array().unwrap() {
        let row = row.as_array().unwrap();
        let sum: f64 = row.iter().filter_map(|f| f.as_f64()).sum();
        assert!((sum - 1.0).abs() < 1e-14, "{sum}");
    }
    let open = ["factors", &file, "--open", "--close"];
    let refused = ended(2, &open);
    assert!(
        refused.stderr.contains("`--close`: the scene is open"),
        "{}",
        refused.stderr
    );
    // Black surfaces exchange what they send.
    let grey = ended(0, &["factors", &file, "--grey", "--error", "1e-6"]);
    assert!(grey.stdout.contains("0.700000"), "{}", grey.stdout);
    let svg = folder.at("scene.svg");
    let check = ended(0, &["check", &file, "--out", &svg]);
    assert!(check.stdout.contains("14"), "{}", check.stdout);
    let svg = std::fs::read_to_string(svg).unwrap();
    assert_eq!(svg.matches("<path").count(), 14);
    assert!(svg.contains(">table</text>"));
}

/// A plate on the ground beside a wall that is as long as it: what it does not send to the wall leaves.
const COURT: &str = "[problem]\nkind = \"scene\"\nsky = { altitudes = [0, 40, 90], sectors = [4, 2] }\n\
[[problem.surface]]\nname = \"plate\"\npolygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nemissivity = 0.7\n\
[[problem.surface]]\nname = \"wall\"\npolygon = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]\nemissivity = 0.9\n";

#[test]
fn factors_to_the_sky_in_every_form() {
    let folder = Folder::new();
    let file = folder.file("court.toml", COURT);
    let printed = ended(0, &["factors", &file]);
    let head = printed.stdout.lines().next().unwrap();
    let head: Vec<&str> = head.split_whitespace().collect();
    assert_eq!(head[3..], ["plate", "wall", "sky", "below", "sum"]);
    // What the plate does not send to the wall goes to the sky: 1 less Howell's C-14.
    let c_14 = 0.200_043_776_075_403;
    assert!(printed.stdout.contains("0.799956"), "{}", printed.stdout);
    assert!(
        printed.stderr.contains("row sums: at most"),
        "{}",
        printed.stderr
    );
    let sum = |row: &serde_json::Value| -> f64 {
        let row = row.as_array().unwrap().iter();
        row.filter_map(serde_json::Value::as_f64).sum()
    };
    let json = ended(0, &["factors", &file, "--json"]).json();
    let sky = &json["sky"];
    assert!((sum(&sky["factors"][0]) - (1.0 - c_14)).abs() < 1e-9);
    let below = sky["below"][1].as_f64().unwrap();
    let wall = sum(&sky["factors"][1]);
    assert!((below + wall + c_14 - 1.0).abs() < 1e-9, "{below} {wall}");
    assert_eq!(sky["patches"][4]["name"], "sky 2.1");
    assert_eq!(sky["patches"][3]["azimuths"][0], 270.0);
    // The wall looks to the east.
    assert!(sky["factors"][1][2].as_f64() == Some(0.0), "{sky}");
    let grey = ended(0, &["factors", &file, "--grey", "--json"]).json();
    let own = sum(&grey["factors"][1]) + sum(&grey["sky"]["factors"][1]);
    let own = own + grey["sky"]["below"][1].as_f64().unwrap();
    assert!((own - 0.9).abs() < 1e-9, "{own}");
    let csv = folder.at("factors.csv");
    ended(0, &["factors", &file, "--out", &csv]);
    let csv = std::fs::read_to_string(csv).unwrap();
    assert!(
        csv.contains("plate,sky 2.2,0.") && csv.contains("wall,below,0."),
        "{csv}"
    );
    let arrays = folder.at("factors.npz");
    ended(0, &["factors", &file, "--out", &arrays]);
    let arrays = std::fs::read(arrays).unwrap();
    for name in ["sky.npy", "below.npy", "patches.npy"] {
        let found = arrays.windows(name.len()).any(|w| w == name.as_bytes());
        assert!(found, "{name}");
    }
    let text = folder.at("factors.txt");
    let refused = ended(2, &["factors", &file, "--out", &text]);
    assert!(refused.stderr.contains("has no sky"), "{}", refused.stderr);
    assert!(!std::path::Path::new(&text).exists());
    let check = ended(0, &["check", &file]);
    assert!(check.stdout.contains("6 patches"), "{}", check.stdout);
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let folder = Folder::new();
    let open = folder.file("open.vs3", DECK.replace("encl=0", "encl=1"));
    let refused = ended(2, &["factors", &open]);
    assert!(refused.stderr.contains("open.vs3:"), "{}", refused.stderr);
    assert!(refused.stderr.contains("not closed"), "{}", refused.stderr);
    ended(0, &["factors", &open, "--open"]);
    let deck = folder.file("squares.vs3", DECK);
    ended(2, &["factors", &deck, "--error", "1"]);
    ended(2, &["factors", &deck, "--out", "factors.doc"]);
    let refused = ended(2, &["solve", &deck]);
    assert!(
        refused.stderr.contains("fredholm factors"),
        "{}",
        refused.stderr
    );
    let room = folder.file("room.toml", &ended(0, &["init", "room"]).stdout);
    let refused = ended(2, &["factors", &room, "--grey"]);
    assert!(
        refused.stderr.contains("`--grey` belongs to scenes"),
        "{}",
        refused.stderr
    );
}

/// Between polygons what is not 0 is written, and what is read with its zeros is the same.
#[test]
fn sparse_factors_between_polygons() {
    let folder = Folder::new();
    let file = folder.file("scene.toml", &ended(0, &["init", "scene"]).stdout);
    let command = |out: &str| {
        ended(
            0,
            &["factors", &file, "--faces", "--error", "1e-6", "--out", out],
        )
    };
    let [json, csv, arrays] = ["f.json", "f.csv", "f.npz"].map(|name| folder.at(name));
    for out in [&json, &csv, &arrays] {
        command(out);
    }
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let whole: Vec<Vec<f64>> = serde_json::from_value(json["factors"].clone()).unwrap();
    assert_eq!(whole.len(), 14);
    for row in &whole {
        let sum: f64 = row.iter().sum();
        assert!((sum - 1.0).abs() < 1e-5, "{row:?}");
    }
    let found: Vec<(usize, usize, f64)> = (0..14)
        .flat_map(|i| (0..14).map(move |j| (i, j)))
        .map(|(i, j)| (i, j, whole[i][j]))
        .filter(|entry| entry.2 != 0.0)
        .collect();
    // Neither the ceiling nor the lid sees itself, and half of the sides of a box look away from a wall.
    assert!(found.len() < 130, "{}", found.len());
    let csv = std::fs::read_to_string(csv).unwrap();
    let name = |k: usize| json["surfaces"][k].as_str().unwrap().to_owned();
    let lines = csv.lines().skip(1).zip(&found);
    assert_eq!(csv.lines().count(), found.len() + 1);
    for (line, (i, j, f)) in lines {
        let own = format!("{},{},{f:?},", name(*i), name(*j));
        assert!(line.starts_with(&own), "{line}");
    }
    let arrays = std::fs::read(arrays).unwrap();
    // The content of an array, whose head says how long it is.
    let content = |name: &str, bytes: usize| -> Vec<u8> {
        let word = format!("{name}.npy");
        let at = arrays
            .windows(word.len())
            .position(|w| w == word.as_bytes());
        let at = at.unwrap() + word.len() + 8;
        let head = usize::from(u16::from_le_bytes([arrays[at], arrays[at + 1]]));
        arrays[at + 2 + head..at + 2 + head + bytes].to_vec()
    };
    assert_eq!(content("format", 3), b"csr");
    let long = |bytes: Vec<u8>| -> Vec<u64> {
        let words = bytes.chunks_exact(8);
        words
            .map(|w| u64::from_le_bytes(w.try_into().unwrap()))
            .collect()
    };
    assert_eq!(long(content("shape", 16)), [14, 14]);
    let first = long(content("indptr", 8 * 15));
    let columns = content("indices", 4 * found.len());
    let data = long(content("data", 8 * found.len()));
    assert_eq!(first[14], found.len() as u64);
    for (k, (i, j, f)) in found.iter().enumerate() {
        assert!((first[*i]..first[*i + 1]).contains(&(k as u64)));
        assert_eq!(
            u32::from_le_bytes(columns[4 * k..4 * k + 4].try_into().unwrap()),
            *j as u32
        );
        assert_eq!(f64::from_bits(data[k]), *f);
    }
}

/// A unit cube as a deck, whose ceiling is an obstruction, without its end, and with a corner that is 30 µm off.
const CUBE_DECK: &str = "T cube\nC encl=1\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\nV 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\nV 8 0 1 1\n\
    V 9 1.00003 1 1\nS 1 1 2 3 4 0 0 0.9 floor\nO 2 5 8 7 6 0 0 0.9 ceiling\nS 3 1 5 6 2 0 0 0.9 front\nS 4 2 6 9 3 0 0 0.9 right\n\
    S 5 3 7 8 4 0 0 0.9 back\nS 6 4 8 5 1 0 0 0.9 left\n";

/// Howell's C-11: between opposite sides of a cube.
const OPPOSITE: f64 = 0.199_824_895_698_387;

#[test]
fn a_deck_of_a_converter_is_welded() {
    let folder = Folder::new();
    let deck = folder.file("cube.vs3", CUBE_DECK);
    let open = fredholm(&["factors", &deck]);
    refused(&open, &["`weld = \"1 mm\"` joins vertices"]);
    refused(
        &fredholm(&["factors", &deck, "--weld", "1 mile"]),
        &["a length is a number more than 0"],
    );
    let ran = fredholm(&["factors", &deck, "--weld", "1 mm", "--json"]);
    assert_eq!(ran.status, Some(0), "{ran:?}");
    for words in [
        "the deck has no `End of data`",
        "weld: 1 of 9 vertices moved, by 3.0e-5 at most",
        "obstructions have no rows: 1 of them",
    ] {
        assert!(ran.stderr.contains(words), "{words}: {}", ran.stderr);
    }
    let found = ran.json();
    assert_eq!(found["surfaces"][1], "ceiling");
    assert_eq!(found["rows"].as_array().unwrap().len(), 5);
    let factor = found["factors"][0][1].as_f64().unwrap();
    assert!((factor - OPPOSITE).abs() < 1e-12, "{factor}");
    let room = folder.file("room.toml", ROOM_OF_TWO);
    refused(
        &fredholm(&["factors", &room, "--weld", "1 mm"]),
        &["in a problem file write `weld"],
    );
}

/// Two squares.
const ROOM_OF_TWO: &str = "[problem]\nkind = \"scene\"\nopen = true\n[[problem.surface]]\nname = \"a\"\n\
    polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n[[problem.surface]]\nname = \"b, c\"\n\
    polygon = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]\n";

#[test]
fn factors_for_other_programs() {
    let folder = Folder::new();
    let file = folder.file("zone.toml", ROOM_OF_TWO);
    let written = |name: &str, more: &[&str]| {
        let out = folder.at(name);
        let ran = fredholm(&[&["factors", &file, "--out", &out], more].concat());
        assert_eq!(ran.status, Some(0), "{ran:?}");
        std::fs::read_to_string(out).unwrap()
    };
    let own = "ZoneProperty:UserViewFactors:BySurfaceName";
    let json: serde_json::Value = serde_json::from_str(&written("z.epJSON", &[])).unwrap();
    let object = &json[own]["View factors of zone"];
    assert_eq!(
        object["zone_or_zonelist_or_space_or_spacelist_name"],
        "zone"
    );
    let pairs = object["view_factors"].as_array().unwrap();
    assert_eq!(
        (pairs.len(), &pairs[1]["from_surface"]),
        (2, &serde_json::json!("b, c"))
    );
    assert!((pairs[0]["view_factor"].as_f64().unwrap() - OPPOSITE).abs() < 1e-12);
    // A name with a comma ends there in IDF.
    let out = folder.at("z.idf");
    let ran = fredholm(&["factors", &file, "--out", &out]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert!(ran.stderr.contains("\"b, c\" has a comma"), "{ran:?}");
    let file = folder.file("zone.toml", ROOM_OF_TWO.replace("b, c", "b"));
    let ran = fredholm(&["factors", &file, "--out", &out, "--zone", "Office"]);
    assert_eq!(ran.status, Some(0));
    let idf = std::fs::read_to_string(&out).unwrap();
    assert_eq!(
        idf,
        format!("{own},\n  Office,\n  a, b, {OPPOSITE:.9},\n  b, a, {OPPOSITE:.9};\n")
    );
    assert_eq!(
        written("vfsparse.inp.100", &["--faces"]),
        "1 2 0.199825\n2 1 0.199825\n"
    );
    assert_eq!(
        written("svf.inp.100", &["--faces"]),
        "# sky view factors\n0.800175\n0.800175\n"
    );
    let out = folder.at("z.xyz");
    refused(
        &fredholm(&["factors", &file, "--out", &out]),
        &[".idf or .epJSON"],
    );
}

/// What a CSV file says beside factors: bounds that hold, areas, and a checksum that others can compute.
#[test]
fn tables_have_bounds_areas_and_a_digest() {
    let folder = Folder::new();
    let deck = folder.file("squares.vs3", DECK);
    let out = folder.at("f.csv");
    let read = |more: &[&str]| -> Vec<Vec<String>> {
        let ran = fredholm(&[&["factors", &deck, "--out", &out], more].concat());
        assert_eq!(ran.status, Some(0), "{ran:?}");
        let text = std::fs::read_to_string(&out).unwrap();
        let line = |line: &str| line.split(',').map(str::to_owned).collect();
        text.lines().skip(1).map(line).collect()
    };
    let number = |text: &str| text.parse::<f64>().unwrap();
    let rough = read(&["--error", "1e-2"]);
    let [factor, bound] = [2, 3].map(|k| number(&rough[0][k]));
    let off = (factor - QUARTER_LESS).abs();
    assert!(off > 1e-9 && off <= bound && bound <= 1e-2, "{off} {bound}");
    // The square between has a quarter of the area, and the other square sees all of it: but for rounding exact.
    let between: Vec<f64> = rough.iter().map(|line| number(&line[4])).collect();
    assert_eq!(between, [1.0, 1.0, 1.0, 0.25]);
    // Dropped factors move the others of their row, which is in the bound.
    let whole = read(&["--error", "1e-2", "--drop", "0.14"]);
    assert!(whole.len() < rough.len());
    for line in &whole {
        let same = rough.iter().find(|own| own[..2] == line[..2]).unwrap();
        let moved = number(&line[2]) - number(&same[2]);
        let more = number(&line[3]) - number(&same[3]);
        assert!((more - moved).abs() < 1e-15, "{line:?}");
    }
    let fewer = read(&["--error", "1e-2", "--rows", "high"]);
    let of = |line: &Vec<String>| (line[0].clone(), line[4].clone());
    assert_eq!(
        fewer.iter().map(of).collect::<Vec<_>>(),
        [0, 1].map(|_| ("high".to_owned(), "1.0".to_owned()))
    );
    // CRC-32 by its definition, over the deck's polygons.
    let corners = |z: f64, w: f64| [[0.0, 0.0, z], [w, 0.0, z], [w, w, z], [0.0, w, z]];
    let mut high = corners(1.0, 1.0);
    high.swap(0, 2);
    let crc = |bytes: &[u8]| {
        let bits = |sum: u32| {
            (0..8).fold(sum, |sum, _| {
                (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg())
            })
        };
        !bytes
            .iter()
            .fold(u32::MAX, |sum, &byte| bits(sum ^ u32::from(byte)))
    };
    let mut bytes = Vec::new();
    for (name, polygon) in [
        ("low", corners(0.0, 1.0)),
        ("high", high),
        ("between", corners(0.5, 0.5)),
    ] {
        bytes.extend(name.bytes().chain([0, 4, 0, 0, 0]));
        bytes.extend(polygon.iter().flatten().flat_map(|x| x.to_le_bytes()));
    }
    let digest = format!("{:08x}", crc(&bytes));
    assert!(
        whole.iter().chain(&rough).all(|line| line[5] == digest),
        "{digest} {rough:?}"
    );
    let json = ended(0, &["factors", &deck, "--json"]).json();
    assert_eq!(json["mesh_crc32"], digest);
}

/// A list of OpenFOAM: a number, or the number of items and the items.
#[derive(Debug)]
enum Foam {
    Number(f64),
    List(Vec<Self>),
}

impl Foam {
    /// What stands behind the head of a file, of this class.
    fn read(text: &str, class: &str) -> Vec<Self> {
        let (head, body) = text.split_once('}').unwrap();
        assert!(
            head.starts_with("FoamFile\n{") && head.contains(&format!("class {class};")),
            "{head}"
        );
        let spaced = body.replace('(', " ( ").replace(')', " ) ");
        let mut words = spaced.split_whitespace().peekable();
        Self::items(&mut words)
    }

    fn items<'a>(words: &mut core::iter::Peekable<impl Iterator<Item = &'a str>>) -> Vec<Self> {
        let mut all = Vec::new();
        while let Some(word) = words.next_if(|word| *word != ")") {
            let number: f64 = word.parse().unwrap();
            all.push(match words.next_if_eq(&"(") {
                Some(_) => {
                    let own = Self::items(words);
                    assert_eq!(words.next(), Some(")"));
                    assert_eq!(own.len() as f64, number);
                    Self::List(own)
                }
                None => Self::Number(number),
            });
        }
        all
    }

    fn list(&self) -> &[Self] {
        match self {
            Self::List(own) => own,
            Self::Number(number) => panic!("{number}"),
        }
    }

    fn numbers(&self) -> Vec<f64> {
        let number = |own: &Self| match own {
            Self::Number(number) => *number,
            Self::List(own) => panic!("{own:?}"),
        };
        self.list().iter().map(number).collect()
    }
}

/// A unit cube whose floor is a pentagon and a triangle: faces of the file have factors, though the pentagon is cut.
#[test]
fn openfoam_gets_its_lists() {
    let folder = Folder::new();
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nv 1 .5 0\nv .5 1 0\n\
        g floor\nf 1 2 9 10 4\nf 9 3 10\ng ceiling\nf 5 8 7 6\ng walls\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    let cube = folder.file("cube.obj", cube);
    let out = folder.at("F");
    let refusal = fredholm(&["factors", &cube, "--out", &out]);
    refused(
        &refusal,
        &["OpenFOAM has form factors between polygons: add `--faces`"],
    );
    let some = [
        "factors", &cube, "--faces", "--rows", "floor", "--out", &out,
    ];
    refused(&fredholm(&some), &["OpenFOAM's format has all rows"]);
    ended(0, &["factors", &cube, "--faces", "--out", &out]);
    let read = |name: &str, class: &str| {
        let text = std::fs::read_to_string(folder.at(name)).unwrap();
        Foam::read(&text, class)
    };
    let factors = &read("F", "scalarListList")[0];
    let faces = &read("globalFaceFaces", "labelListList")[0];
    let areas = [0.875, 0.125, 1.0, 1.0, 1.0, 1.0, 1.0];
    let mut whole = vec![vec![0.0; 7]; 7];
    assert_eq!((factors.list().len(), faces.list().len()), (7, 7));
    for (i, (row, to)) in factors.list().iter().zip(faces.list()).enumerate() {
        let (row, to) = (row.numbers(), to.numbers());
        assert_eq!(row.len(), to.len());
        for (f, j) in row.iter().zip(&to) {
            whole[i][*j as usize] = *f;
        }
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{row:?}");
    }
    for i in 0..7 {
        for j in 0..7 {
            assert!((areas[i] * whole[i][j] - areas[j] * whole[j][i]).abs() < 1e-13);
        }
    }
    assert!(
        (whole[2][0] + whole[2][1] - OPPOSITE).abs() < 1e-12,
        "{whole:?}"
    );
    assert!(whole[0][1] == 0.0 && (whole[3][5] - OPPOSITE).abs() < 1e-12);
    let own: Vec<f64> = (0..7).map(f64::from).collect();
    let patches = &read("finalAgglom", "labelListList")[0];
    let patches: Vec<Vec<f64>> = patches.list().iter().map(Foam::numbers).collect();
    assert_eq!(patches, [&own[..2], &own[..1], &own[..4]]);
    let map = read("mapDist", "mapDistribute");
    for list in &map[1..3] {
        assert_eq!(list.list().len(), 1);
        assert_eq!(list.list()[0].numbers(), own);
    }
    let rest: Vec<String> = map[3..].iter().map(|own| format!("{own:?}")).collect();
    assert_eq!(
        rest,
        [
            "Number(0.0)",
            "Number(0.0)",
            "Number(0.0)",
            "List([])",
            "List([])"
        ]
    );
    assert!(matches!(map[0], Foam::Number(7.0)));
    for name in ["subMap", "constructMap"] {
        assert_eq!(read(name, "labelListList")[0].list()[0].numbers(), own);
    }
    assert_eq!(read("constructMapDim", "labelList")[0].numbers(), [7.0]);
}

#[test]
fn grey_factors_need_every_material() {
    let folder = Folder::new();
    let file = folder.file(
        "two.toml",
        ROOM_OF_TWO.replace("name = \"a\"", "name = \"a\"\nemissivity = 0.5"),
    );
    refused(
        &fredholm(&["factors", &file, "--grey"]),
        &["nothing is said of the material of \"b, c\""],
    );
    let ran = fredholm(&["check", &file]);
    assert!(ran.stderr.contains("black, and dark or at 0 K"), "{ran:?}");
}
