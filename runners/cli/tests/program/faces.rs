//! `fredholm faces`.

use crate::common;

use common::{Folder, csv_rows, ended, fredholm, refused};

/// A black cube whose ceiling shines, in meshes of triangles.
const CUBE: &str = "[problem]\nkind = \"scene\"\nphotometric = true\n[[problem.surface]]\nname = \"sides\"\npolygons = [\
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]], [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]], \
    [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]]\nreflectance = 0\n\
    [[problem.surface]]\nname = \"ceiling\"\npolygon = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]\nreflectance = 0\nemission = 1\n";

/// Form factors from a side of the cube to the opposite one and to its neighbours (C-11 and C-14 of Howell's catalogue).
const FACTORS: [f64; 5] = [
    0.199_824_895_698,
    0.200_043_776_075,
    0.200_043_776_075,
    0.200_043_776_075,
    0.200_043_776_075,
];

#[test]
fn every_face_has_a_row() {
    let folder = Folder::new();
    let scene = folder.file("cube.toml", CUBE);
    let out = |name: &str| folder.at(name);
    let asked = ["faces", &scene, "--target-error", "2e-3", "--threads"];
    let ran = ended(0, &[&asked[..], &["1", "--out", &out("a.csv")]].concat());
    for words in [
        "scene of 6 faces",
        "irradiance, lx",
        "sides        5",
        "band: 95 % on all faces together",
    ] {
        assert!(ran.stdout.contains(words), "{words}: {}", ran.stdout);
    }
    let rows = csv_rows(out("a.csv").as_ref());
    assert_eq!(
        rows[0],
        ["surface", "area", "irradiance", "std_error", "band"]
    );
    for (row, exact) in rows[1..].iter().zip(FACTORS) {
        let [value, error] = [2, 3].map(|i| row[i].parse::<f64>().unwrap());
        assert!(
            error > 0.0 && error <= 2e-3 && (value - exact).abs() < 5.0 * error,
            "{row:?}"
        );
    }
    assert_eq!(rows[6][..3], ["ceiling", "1.0", "0.0"]);
    let json = |threads: &str| {
        let mut json = ended(0, &[&asked[..], &[threads, "--json"]].concat()).json();
        json["seconds"] = 0.into();
        json
    };
    let own = json("1");
    assert_eq!(own, json("3"));
    assert!(own["target_error"] == 2e-3 && own["surfaces"][0]["faces"] == 5);
    ended(
        0,
        &["faces", &scene, "--walks", "64", "--out", &out("a.vtu")],
    );
    let mesh = std::fs::read_to_string(out("a.vtu")).unwrap();
    assert!(mesh.contains("NumberOfCells=\"6\"") && mesh.contains("Name=\"irradiance\""));
    // What no walk has to find is known.
    let u = ended(0, &["faces", &scene, "--ask", "u", "--json"]).json();
    assert_eq!(
        u["values"],
        serde_json::json!([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    );
}

/// Where no light comes there is an end, too.
#[test]
fn all_is_dark() {
    let folder = Folder::new();
    let plate = "[problem]\nkind = \"scene\"\nopen = true\n[[problem.light]]\ntowards = [0, 0, 1]\nirradiance = 1\n[[problem.surface]]\n\
                 name = \"ceiling\"\npolygon = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]\nreflectance = 0.5\n";
    let scene = folder.file("dark.toml", plate);
    let asked = [
        "faces",
        &scene,
        "--target-error",
        "0.01",
        "--relative",
        "--json",
    ];
    let found = ended(0, &asked).json();
    assert!(found["values"] == serde_json::json!([0.0]) && found["walks"] == 32);
}

#[test]
fn what_has_no_faces_is_refused() {
    let folder = Folder::new();
    let scene = folder.file("cube.toml", CUBE);
    refused(
        &fredholm(&["faces", &scene, "--out", &folder.at("a.svg")]),
        &["must end in", ".vtu"],
    );
    refused(
        &fredholm(&["faces", &scene, "--ask", "net_flux"]),
        &["a net flux is one of heat"],
    );
    let circle = folder.file("circle.toml", common::CIRCLE);
    refused(
        &fredholm(&["faces", &circle]),
        &["faces are those of scenes"],
    );
}
