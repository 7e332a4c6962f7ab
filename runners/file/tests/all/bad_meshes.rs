//! Meshes that are none, by kind: each is refused with its place and what is wrong with it.

use fredholm_file::scene::{parse_description, parse_mesh};

/// A cube seen from inside: floor, ceiling and four walls, on lines 9 to 14.
const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";

const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
endfacet\nendsolid\n";

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

const DECK: &str =
    "T a\nC encl=0\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 0 1 0\nS 1 1 2 3 0 0 0 0.5 a\nEnd of data\n";

const TOML: &str = "[problem]\nkind = \"scene\"\nopen = true\n[[problem.surface]]\nname = \"a\"\n\
polygon = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n";

/// A good text with a part replaced.
fn with(text: &str, from: &str, to: &str) -> Vec<u8> {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

/// The cube with more lines.
fn and(more: &str) -> Vec<u8> {
    format!("{CUBE}{more}").into_bytes()
}

/// An STL file of bytes that says it has so many triangles, and one with these numbers.
fn binary(count: u32, numbers: [f32; 12]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(count.to_le_bytes());
    bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend([0, 0]);
    bytes
}

const ONE: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// What is refused while it is read, or when a scene is made of it.
fn refusal(name: &str, bytes: Vec<u8>) -> String {
    let read = if name.ends_with("toml") {
        parse_description(name, &String::from_utf8(bytes).expect("text"))
    } else {
        parse_mesh(name, bytes)
    };
    match read.and_then(|scene| scene.scene::<f64>()) {
        Ok(_) => "nothing is wrong".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// What is wrong, the file, its bytes, how the message begins, and what it says.
type Case = (
    &'static str,
    &'static str,
    Vec<u8>,
    &'static str,
    &'static str,
);

fn geometry() -> Vec<Case> {
    let obj = |what, bytes, place, words| (what, "a.obj", bytes, place, words);
    vec![
        obj(
            "a face is missing",
            with(CUBE, "f 5 8 7 6\n", ""),
            "a.obj:10:",
            "the scene is not closed",
        ),
        obj(
            "a triangle of a mesh is missing",
            with(CUBE, "f 5 8 7 6", "f 5 8 7"),
            "a.obj:10:",
            "the scene is not closed",
        ),
        obj(
            "a wall is too short",
            with(CUBE, "f 5 8 7 6", "v 0.9 0 1\nv 0.9 1 1\nf 5 8 10 9"),
            "a.obj:12:",
            "the scene is not closed",
        ),
        obj(
            "a vertex misses an edge",
            with(CUBE, "f 1 2 3 4", "v 0.5 1e-6 0\nf 1 9 4\nf 9 3 4\nf 9 2 3"),
            "a.obj:14:",
            "1e-6 away from an edge",
        ),
        obj(
            "a face is moved outwards",
            with(
                CUBE,
                "f 5 8 7 6",
                "v 0 0 1.1\nv 0 1 1.1\nv 1 1 1.1\nv 1 0 1.1\nf 9 10 11 12",
            ),
            "a.obj:14:",
            "the scene is not closed",
        ),
        obj(
            "a normal is flipped",
            with(CUBE, "f 1 5 6 2", "f 1 2 6 5"),
            "a.obj:11:",
            "face different sides at their common edge",
        ),
        obj(
            "all normals are flipped",
            with(
                CUBE,
                CUBE,
                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 4 3 2 1\nf 6 7 8 5\nf 2 6 5 1\nf 3 7 6 2\nf 4 8 7 3\nf 1 5 8 4\n",
            ),
            "a.obj:9:",
            "meets a polygon from behind",
        ),
        obj(
            "a plate has one side",
            and("v 0.2 0.2 0.5\nv 0.4 0.2 0.5\nv 0.4 0.4 0.5\nf 9 10 11\n"),
            "a.obj:18:",
            "meets a polygon from behind",
        ),
        obj(
            "two vertices of a face are one",
            and("v 0.2 0.2 0.5\nv 0.4 0.2 0.5\nf 9 10 10\n"),
            "a.obj:17:",
            "the polygon has no area",
        ),
        obj(
            "vertices are on a line",
            and("v 0.2 0.2 0.5\nv 0.4 0.2 0.5\nv 0.6 0.2 0.5\nf 9 10 11\n"),
            "a.obj:18:",
            "the polygon has no area",
        ),
        obj(
            "a sliver is thinner than rounding",
            and("v 0.2 0.2 0.5\nv 0.4 0.2 0.5\nv 0.3 0.2000000000001 0.5\nf 9 10 11\n"),
            "a.obj:18:",
            "the polygon has no area",
        ),
        obj(
            "all vertices are in one place",
            and("v 0.2 0.2 0.5\nf 9 9 9\n"),
            "a.obj:16:",
            "the polygon has no area",
        ),
        obj(
            "an outline crosses itself",
            and("v 0.2 0.2 0.5\nv 0.4 0.4 0.5\nv 0.4 0.2 0.5\nv 0.2 0.4 0.5\nf 9 10 11 12\n"),
            "a.obj:19:1:",
            "crosses itself",
        ),
        obj(
            "a face is there twice",
            and("f 5 8 7 6\n"),
            "a.obj:15:",
            "once more: remove one",
        ),
        obj(
            "a face is there twice, begun elsewhere",
            and("f 7 6 5 8\n"),
            "a.obj:15:",
            "once more: remove one",
        ),
        obj(
            "faces of one plane overlap",
            and("v 0.2 0.2 1\nv 0.4 0.2 1\nv 0.2 0.4 1\nf 11 10 9\nf 9 11 10\n"),
            "a.obj:18:",
            "overlap in one plane",
        ),
        obj(
            "it is 10⁶⁰ wide",
            with(CUBE, "v 1 1 1", "v 1e61 1e61 1e61"),
            "a.obj:10:",
            "1e-60 and 1e60 in f64",
        ),
        obj(
            "a room in a room",
            and(
                "v 0.2 0.2 0.2\nv 0.4 0.2 0.2\nv 0.2 0.4 0.2\nv 0.2 0.2 0.4\nf 9 10 11\nf 9 12 10\nf 10 12 11\nf 11 12 9\n",
            ),
            "a.obj:9:",
            "the scene is not closed",
        ),
    ]
}

fn files() -> Vec<Case> {
    let cut = |text: &str, bytes: usize| text.as_bytes()[..bytes].to_vec();
    let many = (0..1001)
        .map(|k| format!(" {}", 1 + k % 8))
        .collect::<String>();
    let with_nan = {
        let mut numbers = ONE;
        numbers[4] = f32::NAN;
        numbers
    };
    let words = PLY.replace("ascii", "binary_little_endian");
    vec![
        (
            "a coordinate is no number",
            "a.obj",
            with(CUBE, "v 1 1 1", "v 1 x 1"),
            "a.obj:7:5:",
            "must be a finite number, not \"x\"",
        ),
        (
            "a coordinate is NaN",
            "a.obj",
            with(CUBE, "v 1 1 1", "v 1 nan 1"),
            "a.obj:7:5:",
            "must be a finite number",
        ),
        (
            "a coordinate is too large for f64",
            "a.obj",
            with(CUBE, "v 1 1 1", "v 1 1e999 1"),
            "a.obj:7:5:",
            "must be a finite number",
        ),
        (
            "a coordinate is missing",
            "a.obj",
            with(CUBE, "v 1 1 1", "v 1 1"),
            "a.obj:7:6:",
            "ends before the coordinate z",
        ),
        (
            "a vertex has number 0",
            "a.obj",
            with(CUBE, "f 1 2 3 4", "f 0 1 2 3"),
            "a.obj:9:3:",
            "not the number of a vertex",
        ),
        (
            "a vertex stands nowhere",
            "a.obj",
            with(CUBE, "f 1 2 3 4", "f 1 2 3 9"),
            "a.obj:9:9:",
            "there is no vertex 9",
        ),
        (
            "a vertex counted from the end stands nowhere",
            "a.obj",
            with(CUBE, "f 1 2 3 4", "f 1 2 3 -9"),
            "a.obj:9:9:",
            "there is no vertex",
        ),
        (
            "a face has two vertices",
            "a.obj",
            with(CUBE, "f 1 2 3 4", "f 1 2"),
            "a.obj:9:1:",
            "at least three vertices",
        ),
        (
            "a face has a thousand vertices",
            "a.obj",
            and(&format!("f{many}\n")),
            "a.obj:15:1:",
            "at most 1000 vertices",
        ),
        (
            "a key is not known",
            "a.obj",
            and("curv 1 2\n"),
            "a.obj:15:1:",
            "unknown key \"curv\"",
        ),
        (
            "there is nothing",
            "a.obj",
            Vec::new(),
            "a.obj:",
            "no faces",
        ),
        (
            "there are vertices only",
            "a.obj",
            cut(CUBE, 64),
            "a.obj:",
            "no faces",
        ),
        (
            "an STL file is cut short",
            "a.stl",
            cut(STL, 60),
            "a.stl:5:9:",
            "ends before the coordinate y",
        ),
        (
            "a facet has four vertices",
            "a.stl",
            with(STL, "endloop", "vertex 1 1 0\nendloop"),
            "a.stl:7:1:",
            "three vertices",
        ),
        (
            "a facet stands outside",
            "a.stl",
            with(
                STL,
                "endfacet\nendsolid",
                "endfacet\nendsolid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nsolid",
            ),
            "a.stl:14:1:",
            "outside of a `solid`",
        ),
        (
            "an STL file of bytes lies about its size",
            "a.stl",
            binary(1000, ONE),
            "a.stl:",
            "1000 triangles, 50084 bytes, and has 134",
        ),
        (
            "an STL file of bytes is shorter than its head",
            "a.stl",
            vec![0; 40],
            "a.stl:",
            "at least 84",
        ),
        (
            "an STL file of bytes has NaN",
            "a.stl",
            binary(1, with_nan),
            "a.stl: triangle 1 ",
            "no finite number",
        ),
        (
            "a PLY file is cut short",
            "a.ply",
            cut(PLY, PLY.len() - 10),
            "a.ply: vertex 2:",
            "cut short",
        ),
        (
            "a PLY file of bytes is cut short",
            "a.ply",
            words.clone().into_bytes(),
            "a.ply: vertex 2:",
            "cut short",
        ),
        (
            "a PLY file lies about its vertices",
            "a.ply",
            with(PLY, "vertex 3", "vertex 4000000000"),
            "a.ply: vertex 4:",
            "cut short",
        ),
        (
            "a face lies about its vertices",
            "a.ply",
            with(PLY, "3 0 1 2", "4000000000 0 1 2"),
            "a.ply: face 0:",
            "cut short",
        ),
        (
            "a PLY face has a vertex that is not there",
            "a.ply",
            with(PLY, "3 0 1 2", "3 0 1 3"),
            "a.ply: face 0:",
            "only 3 vertices",
        ),
        (
            "a PLY file has another version",
            "a.ply",
            with(PLY, "ascii 1.0", "ascii 2.0"),
            "a.ply:2:",
            "no line of a PLY header",
        ),
        (
            "a PLY header has no end",
            "a.ply",
            with(PLY, "end_header\n", ""),
            "a.ply:9:",
            "no line of a PLY header",
        ),
        (
            "a PLY vertex has no z",
            "a.ply",
            with(PLY, "property float z\n", ""),
            "a.ply: vertex 0:",
            "x, y and z",
        ),
        (
            "a PLY file is none",
            "a.ply",
            b"hello".to_vec(),
            "a.ply:1:",
            "`end_header`",
        ),
        (
            "a deck is cut short",
            "a.vs3",
            with(DECK, " 0.5 a\nEnd of data\n", ""),
            "a.vs3:7:",
            "the line ends before the emissivity",
        ),
        (
            "a deck has two dimensions",
            "a.vs3",
            with(DECK, "F 3", "F 2"),
            "a.vs3:3:3:",
            "three dimensions",
        ),
        (
            "a deck has a vertex twice",
            "a.vs3",
            with(DECK, "V 2 1", "V 1 1"),
            "a.vs3:5:1:",
            "a second vertex 1",
        ),
        (
            "a deck's vertex stands nowhere",
            "a.vs3",
            with(DECK, "S 1 1 2 3", "S 1 1 2 4"),
            "a.vs3:7:9:",
            "there is no vertex 4",
        ),
        (
            "a deck's emissivity is too large",
            "a.vs3",
            with(DECK, "0.5 a", "1.5 a"),
            "a.vs3:7:17:",
            "at most 1",
        ),
        (
            "a description has a flat box",
            "a.toml",
            with(
                TOML,
                "polygon = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
                "box = [[0, 0, 0], [1, 0, 1]]",
            ),
            "a.toml:6:7:",
            "the lower one first",
        ),
        (
            "a description names a mesh that is not there",
            "a.toml",
            with(
                TOML,
                "polygon = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
                "mesh = \"none.obj\"",
            ),
            "a.toml:6:8:",
            "cannot read none.obj",
        ),
        (
            "a description has a polygon of two points",
            "a.toml",
            with(TOML, ", [0, 1, 0]", ""),
            "a.toml:6:11:",
            "at least three points",
        ),
        (
            "a description has an infinite number",
            "a.toml",
            with(TOML, "[0, 1, 0]", "[0, inf, 0]"),
            "a.toml:6:38:",
            "finite number",
        ),
        (
            "a format is not known",
            "a.dxf",
            Vec::new(),
            "a.dxf:",
            "an .obj, .stl, .ply, .vs3 or .epJSON file",
        ),
    ]
}

#[test]
fn bad_meshes_are_refused_at_their_place() {
    let all: Vec<Case> = geometry().into_iter().chain(files()).collect();
    assert!(all.len() >= 40);
    for (what, name, bytes, place, words) in all {
        let message = refusal(name, bytes);
        assert!(
            message.starts_with(place) && message.contains(words),
            "{what}: {message}"
        );
    }
}

/// What touches, stands on the floor or goes through is cut: all rows of form factors still sum to 1 in a closed cube.
#[test]
fn solids_that_touch_or_cross_are_solved() {
    for more in [
        "v 0.2 0.2 0\nv 0.4 0.2 0\nv 0.2 0.4 0\nv 0.2 0.2 0.3\nf 9 10 12\nf 10 11 12\nf 11 9 12\n",
        "v 0.5 0.2 0.5\nv 0.5 0.4 0.5\nv 0.5 0.3 1.5\nf 9 10 11\nf 11 10 9\n",
        "v 0.5 0.2 0.2\nv 0.5 0.4 0.2\nv 0.5 0.3 0.8\nv 0.2 0.3 0.5\nv 0.8 0.3 0.5\nv 0.5 0.35 0.5\nf 9 10 11\nf 11 10 9\nf 12 13 14\nf 14 13 12\n",
    ] {
        let scene = parse_mesh("a.obj", and(more)).and_then(|file| file.scene::<f64>());
        let scene = scene.unwrap();
        let all = fredholm_factors::scene_factors(&scene, 1e-9).unwrap();
        for (i, area) in all.areas().iter().enumerate() {
            let sum: f64 = (0..all.areas().len()).map(|j| all.factor(i, j)).sum();
            assert!(
                (sum - 1.0).abs() < 1e-7,
                "{more}: polygon {i} of area {area}: {sum}"
            );
        }
    }
}
