use super::{SceneFile, TEMPLATE, is_description, parse_description, parse_mesh, parse_outlines};

const CUBE: &str = "# a cube seen from inside\nmtllib x.mtl\no room\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\n\
v 1 1 1\nv 0 1 1\nusemtl floor\nf 1 2 3 4\nusemtl ceiling\nf 5/1/1 8/2/1 7/3/1 6/4/1\nusemtl walls\nf 1 5 6 2\nf 2 6 7 3\n\
f -6 -2 -1 -5 # from the end\nf 4 8 5 1\n";

const DECK: &str = "T Two squares\nC encl=0 list=3\nF 3\n! vertices\nV 1 0. 0. 0.\nV 2 1. 0. 0.\nV 3 1. 1. 0.\nV 4 0. 1. 0.\n\
V 5 0. 0. 1.\nV 6 1. 0. 1.\nV 7 1. 1. 1.\nV 8 0. 1. 1.\nS 1 1 2 3 4 0 0 0.50 lower\nS 2 7 6 5 0 0 0 0.90 upper\n\
S 3 7 5 8 0 0 2 0.90\nEnd of data\n";

fn mesh(name: &str, text: &str) -> Result<SceneFile, String> {
    parse_mesh(name, text.as_bytes().to_vec()).map_err(|error| error.to_string())
}

fn names(scene: &SceneFile) -> Vec<(&str, usize)> {
    let of = |s: &'_ super::SceneSurface| s.polygons.len();
    scene
        .surfaces
        .iter()
        .map(|s| (s.name.as_str(), of(s)))
        .collect()
}

/// Demands an error with these words that begins with this place.
fn refused_at(name: &str, text: &str, place: &str, words: &str) {
    let error = mesh(name, text).expect_err(words);
    assert!(error.starts_with(place), "{error}");
    assert!(error.contains(words), "{error}");
}

/// Demands an error with these words at what stands between « and ».
fn refused(name: &str, marked: &str, words: &str) {
    let (before, _) = marked.split_once('«').unwrap();
    let own = before.rsplit('\n').next().unwrap_or_default();
    let (line, column) = (before.matches('\n').count() + 1, own.chars().count() + 1);
    let place = format!("{name}:{line}:{column}:");
    refused_at(name, &marked.replace(['«', '»'], ""), &place, words);
}

#[test]
fn obj_files() {
    let cube = mesh("a.obj", CUBE).unwrap();
    assert_eq!(
        names(&cube),
        [("room/floor", 1), ("room/ceiling", 1), ("room/walls", 4)]
    );
    assert!(cube.scene::<f64>().is_ok());
    let one = mesh("a.obj", &CUBE.replace("usemtl", "s")).unwrap();
    assert_eq!(names(&one), [("room", 6)]);
    let change = |from: &str, to: &str| {
        assert!(CUBE.contains(from), "{from}");
        CUBE.replacen(from, to, 1)
    };
    let bad = |from: &str, to: &str, words: &str| refused("a.obj", &change(from, to), words);
    bad(
        "f 1 2 3 4",
        "f 1 2 3 «9»",
        "there is no vertex 9: 8 stand above",
    );
    bad("f 1 2 3 4", "f 1 2 «0» 4", "not the number of a vertex");
    bad("f 1 2 3 4", "«f» 1 2", "at least three vertices");
    bad("v 1 1 1", "v 1 «nan» 1", "finite");
    bad("v 1 1 1", "v 1 1«»", "ends before the coordinate z");
    bad("usemtl walls", "«curv» 1", "unknown key \"curv\"");
    refused_at("a.obj", "", "a.obj:", "no faces");
    // Left out: the error of the scene names the line of the face and its surface.
    let gap = mesh("a.obj", &change("f 4 8 5 1\n", "")).unwrap();
    let error = gap.scene::<f64>().unwrap_err().to_string();
    assert!(error.starts_with("a.obj:"), "{error}");
    assert!(error.contains("is \"room/"), "{error}");
}

#[test]
fn polygons_are_cut() {
    // A concave hexagon, an L, of area 3, and a quadrilateral that is bent.
    let l = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n";
    let scene = mesh("l.obj", l).unwrap();
    assert_eq!(names(&scene), [("surface", 4)]);
    let mut open = scene;
    open.open = true;
    let area = open.scene::<f64>().unwrap().area(0).unwrap();
    assert!((area - 3.0).abs() < 1e-15, "{area}");
    let bent = "v 0 0 0\nv 1 0 0\nv 1 1 0.1\nv 0 1 0\nf 1 2 3 4\n";
    assert_eq!(names(&mesh("b.obj", bent).unwrap()), [("surface", 2)]);
    let crossed = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\n«f» 1 2 3 4\n";
    refused("x.obj", crossed, "crosses itself");
}

#[test]
fn view3d_decks() {
    let deck = mesh("d.vs3", DECK).unwrap();
    assert!(deck.open);
    assert_eq!(names(&deck), [("lower", 1), ("upper", 2)]);
    assert_eq!(deck.surfaces[1].material.reflectance, 1.0 - 0.9);
    assert!(
        !mesh("d.vs3", &DECK.replace("encl=0", "encl=1"))
            .unwrap()
            .open
    );
    let bad = |from: &str, to: &str, words: &str| {
        assert!(DECK.contains(from), "{from}");
        refused("d.vs3", &DECK.replacen(from, to, 1), words);
    };
    bad("S 1 1 2 3 4", "S 1 1 2 3 «9»", "no vertex 9");
    bad("S 2 7", "«S» 1 7", "a second surface 1");
    bad("0 0 0.50", "«1» 0 0.50", "there is no other surface 1");
    // No character of control gets to a terminal.
    bad(
        "0 0 0.50",
        "«\u{1e}» 0 0.50",
        "there is no other surface \\u{1e}",
    );
    bad(
        "0 0 0.50",
        "«wall» 0 0.50",
        "there is no other surface wall",
    );
    bad("0 2 0.90", "0 «7» 0.90", "combine");
    bad("0.50", "«1.5»", "at most 1");
    bad("V 8 0. 1. 1.", "«V» 7 0. 1. 1.", "second vertex 7");
    bad("F 3", "F «2»", "three dimensions");
    bad("T Two", "«Q» Two", "unknown key");
}

/// Decks as converters write them: no end, triangles of three numbers, equal names, white surfaces, obstructions.
#[test]
fn view3d_decks_of_converters() {
    let read = |from: &str, to: &str| {
        assert!(DECK.contains(from), "{from}");
        mesh("d.vs3", &DECK.replacen(from, to, 1)).unwrap()
    };
    let without_end = read("\nEnd of data", "\n");
    assert_eq!(names(&without_end), [("lower", 1), ("upper", 2)]);
    let remark = "the deck has no `End of data`: see that it is whole; 3 surfaces were read";
    assert_eq!(without_end.remarks, [remark]);
    let three = read("S 3 7 5 8 0 0 2 0.90", "S 3 7 5 8 0 2 0.90");
    assert_eq!(three.surfaces, mesh("d.vs3", DECK).unwrap().surfaces);
    let equal = read("0.90 upper", "0.90 lower");
    assert_eq!(names(&equal), [("lower", 1), ("lower 2", 2)]);
    assert!(
        equal.remarks[0].contains("1 surfaces have the names of others"),
        "{:?}",
        equal.remarks
    );
    let white = read("0.50", "0");
    assert_eq!(white.surfaces[0].material.reflectance, 1.0);
    let hidden = read("S 1 1", "O 1 1");
    assert!(hidden.surfaces[0].is_obstruction && !hidden.surfaces[1].is_obstruction);
}

/// A wall of 4 × 3 with two windows, of which one touches the wall's edge.
const WINDOWS: &str = "F 3\nV 1 0 0 0\nV 2 4 0 0\nV 3 4 0 3\nV 4 0 0 3\nV 5 1 0 1\nV 6 2 0 1\nV 7 2 0 2\nV 8 1 0 2\n\
    V 9 3 0 1\nV 10 4 0 1\nV 11 4 0 2\nV 12 3 0 2\nS 1 1 2 3 4 0 0 0.9 wall\nS 2 5 6 7 8 1 0 0.8 window\n\
    S 3 9 10 11 12 1 0 0.8 door\nEnd of data\n";

#[test]
fn windows_are_cut_out_of_walls() {
    let deck = mesh("w.vs3", WINDOWS).unwrap();
    let scene = deck.scene::<f64>().unwrap();
    for (surface, area) in [(0, 10.0), (1, 1.0), (2, 1.0)] {
        let found = scene.area(surface).unwrap();
        assert!((found - area).abs() < 1e-12, "{surface}: {found}");
    }
    // One that is 20 µm before the wall is still its window; one at 2 cm is not.
    let moved = |y: &str| WINDOWS.replace("V 5 1 0 1", &format!("V 5 1 {y} 1"));
    assert!(mesh("w.vs3", &moved("4e-6")).is_ok());
    let error = mesh("w.vs3", &moved("0.02")).unwrap_err().to_string();
    assert!(error.contains("2.000e-2 off its plane"), "{error}");
    // The same in a description.
    let text = "[problem]\nkind = \"scene\"\nopen = true\n[[problem.surface]]\nname = \"wall\"\npolygon = [[0, 0, 0], [4, 0, 0], \
                [4, 0, 3], [0, 0, 3]]\nholes = [[[1, 0, 1], [2, 0, 1], [2, 0, 2], [1, 0, 2]], [[2.5, 0, 1], [3, 0, 1], [3, 0, 2]]]\n";
    let own = parse_description("a.toml", text).unwrap();
    let area = own.scene::<f64>().unwrap().area(0).unwrap();
    assert!((area - 10.75).abs() < 1e-12, "{area}");
    let error = parse_description("a.toml", &text.replace("[2.5, 0, 1]", "[2.5, 1, 1]"));
    let error = error.unwrap_err().to_string();
    assert!(
        error.starts_with("a.toml:6:") && error.contains("off its plane"),
        "{error}"
    );
}

#[test]
fn obj_lines_go_on_behind_a_backslash() {
    let text = "v 0 0 0\nv 1 0 \\\n  0\nv 1 1 0\nv 0 1 0\nf 1 2\\\r\n 3 \\\n4\nf 1 2 «9»\n";
    let (good, _) = text.split_once("f 1 2 «").unwrap();
    assert_eq!(names(&mesh("a.obj", good).unwrap()), [("surface", 1)]);
    refused("a.obj", text, "no vertex 9");
    let error = mesh("a.obj", &text.replace(['«', '»'], ""))
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("a.obj:9:7:"), "{error}");
}

/// A cube of 10 m at map coordinates, in single precision.
#[test]
fn a_coarse_stl_file_says_so() {
    let far = |shift: [f64; 3]| {
        let mut bytes = vec![0; 80];
        bytes.extend(4_u32.to_le_bytes());
        for face in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
            bytes.extend([0; 12]);
            for corner in face {
                let p = [
                    [0.0, 0.0, 0.0],
                    [10.0, 0.0, 0.0],
                    [0.0, 10.0, 0.0],
                    [0.0, 0.0, 10.0],
                ][corner];
                for k in 0..3 {
                    bytes.extend(((p[k] + shift[k]) as f32).to_le_bytes());
                }
            }
            bytes.extend([0; 2]);
        }
        parse_mesh("t.stl", bytes).unwrap().remarks
    };
    assert!(far([0.0; 3]).is_empty());
    let remarks = far([512_345.678, 5_403_210.987, 251.2]);
    assert!(
        remarks[0].contains("whose step at y = 5403221 is 0.5"),
        "{remarks:?}"
    );
}

/// A zone of EnergyPlus, 4 × 3 × 2.5, turned and moved, with a window in its south wall.
fn model(direction: &str) -> String {
    let vertex = |[x, y, z]: [f64; 3]| {
        format!(
            "{{\"vertex_x_coordinate\": {x}, \"vertex_y_coordinate\": {y}, \"vertex_z_coordinate\": {z}}}"
        )
    };
    let [a, b, c] = [4.0, 3.0, 2.5];
    let corner = |i: usize| {
        [
            if i & 1 > 0 { a } else { 0.0 },
            if i & 2 > 0 { b } else { 0.0 },
            if i & 4 > 0 { c } else { 0.0 },
        ]
    };
    // Anticlockwise seen from outside.
    let faces = [
        ("Floor", [0, 2, 3, 1]),
        ("Roof", [4, 5, 7, 6]),
        ("South", [0, 1, 5, 4]),
        ("North", [2, 6, 7, 3]),
        ("West", [0, 4, 6, 2]),
        ("East", [1, 3, 7, 5]),
    ];
    let is_back = direction == "Clockwise";
    let surfaces = faces.map(|(name, mut corners)| {
        if is_back {
            corners.reverse();
        }
        let points: Vec<String> = corners.iter().map(|&i| vertex(corner(i))).collect();
        format!("\"{name}\": {{\"zone_name\": \"ZONE one\", \"construction_name\": \"Wall\", \"vertices\": [{}]}}", points.join(", "))
    });
    let mut pane = [
        [1.0, 0.0, 1.0],
        [2.0, 0.0, 1.0],
        [2.0, 0.0, 2.0],
        [1.0, 0.0, 2.0],
    ];
    if is_back {
        pane.reverse();
    }
    let pane = (1..).zip(pane).map(|(i, [x, y, z])| {
        format!("\"vertex_{i}_x_coordinate\": {x}, \"vertex_{i}_y_coordinate\": {y}, \"vertex_{i}_z_coordinate\": {z}")
    });
    let pane: Vec<String> = pane.collect();
    format!(
        "{{\"GlobalGeometryRules\": {{\"r\": {{\"vertex_entry_direction\": \"{direction}\", \"coordinate_system\": \"Relative\"}}}}, \
         \"Zone\": {{\"Zone One\": {{\"x_origin\": 10, \"y_origin\": 20, \"direction_of_relative_north\": 30}}}}, \
         \"Construction\": {{\"wall\": {{\"outside_layer\": \"Brick\", \"layer_2\": \"Paint\"}}}}, \
         \"Material\": {{\"PAINT\": {{\"thermal_absorptance\": 0.7}}}}, \"Shading:Site:Detailed\": {{\"tree\": {{}}}}, \
         \"FenestrationSurface:Detailed\": {{\"Pane\": {{\"building_surface_name\": \"south\", {}}}}}, \
         \"BuildingSurface:Detailed\": {{{}}}}}",
        pane.join(", "),
        surfaces.join(", ")
    )
}

#[test]
fn models_of_energyplus() {
    for direction in ["Counterclockwise", "Clockwise"] {
        let zone = mesh("z.epJSON", &model(direction)).unwrap();
        assert_eq!(
            zone.remarks,
            ["1 shading surfaces are outside of the zones, and left out"]
        );
        let scene = zone.scene::<f64>().unwrap();
        let at = |name: &str| {
            zone.surfaces
                .iter()
                .position(|own| own.name == name)
                .unwrap()
        };
        assert!((zone.surfaces[at("Floor")].material.reflectance - 0.3).abs() < 1e-15);
        assert!((scene.area(at("South")).unwrap() - 9.0).abs() < 1e-12);
        let all = fredholm_factors::scene_factors(&scene, 1e-9)
            .unwrap()
            .of_surfaces(&scene)
            .unwrap();
        // The same box without a window: parallel rectangles (Howell's C-11).
        assert!((all.factor(at("Floor"), at("Roof")) - 0.292_074_000).abs() < 1e-8);
        let zones = &zone.surfaces[at("Floor")].polygons[0];
        let middle = [0, 1].map(|k| zones.points().iter().map(|p| p[k]).sum::<f64>() / 4.0);
        let (sine, cosine) = 30_f64.to_radians().sin_cos();
        let exact = [
            10.0 + 2.0 * cosine + 1.5 * sine,
            20.0 - 2.0 * sine + 1.5 * cosine,
        ];
        assert!(
            (0..2).all(|k| (middle[k] - exact[k]).abs() < 1e-12),
            "{middle:?}"
        );
    }
    let text = model("Counterclockwise");
    // Places are told by the names of objects.
    let raised = mesh(
        "z.epJSON",
        &text.replacen("_z_coordinate\": 2.5", "_z_coordinate\": 2.6", 1),
    );
    let error = raised.unwrap().scene::<f64>().unwrap_err().to_string();
    assert!(error.starts_with("z.epJSON: \"Roof\": "), "{error}");
    refused_at(
        "z.epJSON",
        &text.replace("\"south\"", "\"sud\""),
        "z.epJSON: ",
        "that of no surface",
    );
    refused_at(
        "z.epJSON",
        &text.replace("\"vertex_y_coordinate\": 3", "\"y\": 3"),
        "z.epJSON: ",
        "must be a list of objects",
    );
    refused_at("z.epJSON", "{", "z.epJSON: ", "not valid JSON");
    refused_at("z.epJSON", "[]", "z.epJSON: ", "an object of types");
    refused_at("z.epJSON", "{}", "z.epJSON: ", "no faces");
}

/// Numbers that seem random, from 0 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// The deck of a zone as a converter writes it: an L-shaped plan, floors in two rectangles and a ceiling in one, windows in some walls, every
/// surface with corners of its own, which are off by `noise`.
fn zone(numbers: &mut Numbers, noise: f64) -> String {
    let [a, b] = [numbers.between(4.0, 12.0), numbers.between(4.0, 12.0)];
    let [c, d] = [numbers.between(0.3, 0.7) * a, numbers.between(0.3, 0.7) * b];
    let height = numbers.between(2.4, 4.0);
    let plan = [[0.0, 0.0], [a, 0.0], [a, d], [c, d], [c, b], [0.0, b]];
    let up = |[x, y]: [f64; 2], z: f64| [x, y, z];
    let mut faces: Vec<(String, Vec<[f64; 3]>, usize)> = Vec::new();
    let rectangle = |p: [f64; 2], q: [f64; 2]| {
        vec![
            [p[0], p[1], 0.0],
            [q[0], p[1], 0.0],
            [q[0], q[1], 0.0],
            [p[0], q[1], 0.0],
        ]
    };
    faces.push(("floor".to_owned(), rectangle([0.0, 0.0], [a, d]), 0));
    faces.push(("floor back".to_owned(), rectangle([0.0, d], [c, b]), 0));
    let down = |points: Vec<[f64; 3]>| {
        points
            .into_iter()
            .rev()
            .map(|[x, y, _]| [x, y, height])
            .collect::<Vec<_>>()
    };
    // Cut the other way.
    faces.push(("ceiling".to_owned(), down(rectangle([0.0, 0.0], [c, b])), 0));
    faces.push((
        "ceiling right".to_owned(),
        down(rectangle([c, 0.0], [a, d])),
        0,
    ));
    for k in 0..6 {
        let (p, q) = (plan[k], plan[(k + 1) % 6]);
        // Seen from inside.
        let wall = vec![up(q, 0.0), up(p, 0.0), up(p, height), up(q, height)];
        faces.push((format!("wall {k}"), wall.clone(), 0));
        if numbers.next() < 0.6 {
            let base = faces.len();
            let at = |s: f64, t: f64| {
                [0, 1, 2].map(|i| {
                    wall[0][i] + s * (wall[1][i] - wall[0][i]) + t * (wall[3][i] - wall[0][i])
                })
            };
            let [s, t] = [numbers.between(0.1, 0.4), numbers.between(0.1, 0.4)];
            let [u, v] = [numbers.between(0.5, 0.9), numbers.between(0.5, 0.9)];
            faces.push((
                format!("window {k}"),
                vec![at(s, t), at(u, t), at(u, v), at(s, v)],
                base,
            ));
        }
    }
    let (mut vertices, mut surfaces, mut count) = (String::new(), String::new(), 0);
    for (number, (name, points, base)) in faces.iter().enumerate() {
        let first = count;
        for p in points {
            count += 1;
            let p = p.map(|x| x + noise * numbers.between(-1.0, 1.0));
            vertices += &format!("V {count} {} {} {}\n", p[0], p[1], p[2]);
        }
        let own: Vec<String> = (first + 1..=count).map(|v| v.to_string()).collect();
        surfaces += &format!("S {} {} {base} 0 0.9 {name}\n", number + 1, own.join(" "));
    }
    format!("T zone\nC encl=1\nF 3\n{vertices}{surfaces}")
}

/// Buildings as a converter writes them are read with a weld of 1 mm: closed, rows of 1, and the factors of the clean model to the noise.
#[test]
fn zones_of_converters_are_welded() {
    let count = if std::env::var_os("FREDHOLM_LONG").is_some() {
        200
    } else {
        3
    };
    let factors = |deck: &SceneFile| {
        let scene = deck
            .scene::<f64>()
            .unwrap_or_else(|error| panic!("{error}"));
        let mut all = fredholm_factors::scene_factors(&scene, 1e-7).unwrap();
        // A hundred errors of 1e-7: vertices of one plane are in it again.
        let off = all.close().unwrap();
        assert!(off < 1e-5, "rows are off by {off:e}");
        let groups = all.of_surfaces(&scene).unwrap();
        let n = groups.len();
        let rows: Vec<f64> = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .map(|(i, j)| groups.factor(i, j))
            .collect();
        (n, rows)
    };
    for seed in 0..count {
        let read = |noise: f64| {
            let mut deck = parse_outlines(
                "z.vs3",
                zone(&mut Numbers(seed), noise).into_bytes(),
                Some(1e-3),
            )
            .unwrap();
            deck.finish("z.vs3").unwrap();
            deck
        };
        let noise = 2e-5;
        let (clean, noisy) = (read(0.0), read(noise));
        assert!(
            noisy
                .remarks
                .iter()
                .any(|remark| remark.starts_with("weld: ") && remark.contains("vertices moved"))
        );
        let ((n, clean), (m, noisy)) = (factors(&clean), factors(&noisy));
        assert_eq!(n, m);
        for (row, own) in noisy.chunks(n).enumerate() {
            let sum: f64 = own.iter().sum();
            assert!((sum - 1.0).abs() < 1e-9, "zone {seed}, row {row}: {sum}");
        }
        // Corners are off by 20 µm times √3 of some metres, of which edges are a few.
        let off = clean
            .iter()
            .zip(&noisy)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(off < 2e-4, "zone {seed}: {off:e}");
    }
}

#[test]
fn what_a_weld_leaves_out_is_told() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0 0\nv 0.5 1e-4 0\nf 1 2 3 4\nf 1 2 5\nf 1 2 6\n";
    assert!(mesh("a.obj", text).unwrap().scene::<f64>().is_err());
    let mut welded = parse_outlines("a.obj", text.into(), Some(1e-3)).unwrap();
    welded.finish("a.obj").unwrap();
    assert_eq!(names(&welded), [("surface", 3)]);
    assert_eq!(
        welded.remarks[1],
        "weld: 2 polygons that are thinner than 0.001 left out; the first is that of \"surface\", a.obj:8"
    );
    welded.open = true;
    assert!(welded.scene::<f64>().is_ok());
    let mut nothing = parse_outlines("a.obj", text.into(), Some(5.0)).unwrap();
    let error = nothing.finish("a.obj").unwrap_err().to_string();
    assert!(
        error.contains("no polygon is wider than the weld, 5"),
        "{error}"
    );
}

/// A tetrahedron in both kinds of STL.
#[test]
fn stl_files() {
    let p = [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
    let mut text = "solid four\n".to_owned();
    let mut bytes = b"solid that is none".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4_u32.to_le_bytes());
    for face in faces {
        text += "facet normal 0 0 0\nouter loop\n";
        bytes.extend([0; 12]);
        for v in face {
            text += &format!("vertex {} {} {}\n", p[v][0], p[v][1], p[v][2]);
            bytes.extend(p[v].iter().flat_map(|x| x.to_le_bytes()));
        }
        text += "endloop\nendfacet\n";
        bytes.extend([0; 2]);
    }
    text += "endsolid four\n";
    let ascii = mesh("t.stl", &text).unwrap();
    assert_eq!(names(&ascii), [("four", 4)]);
    let binary = parse_mesh("t.STL", bytes.clone()).unwrap();
    assert_eq!(names(&binary), [("solid", 4)]);
    assert_eq!(binary.surfaces[0].polygons, ascii.surfaces[0].polygons);
    assert!(binary.scene::<f32>().is_ok());
    // Cut short, or lying about its length.
    let error = parse_mesh("t.stl", bytes[..bytes.len() - 1].to_vec())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("4 triangles, 284 bytes, and has 283"),
        "{error}"
    );
    bytes[80] = 9;
    let error = parse_mesh("t.stl", bytes.clone()).unwrap_err().to_string();
    assert!(
        error.contains("says that it has 9 triangles, 534 bytes, and has 284"),
        "{error}"
    );
    bytes[80] = 4;
    bytes[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = parse_mesh("t.stl", bytes).unwrap_err().to_string();
    assert!(
        error.contains("triangle 1 has a coordinate that is no finite number"),
        "{error}"
    );
    refused(
        "t.stl",
        &text.replace("endfacet\nendsolid four\n", "«endfacet»\n"),
        "cut short",
    );
    refused(
        "t.stl",
        &text.replacen("vertex 0 0 0", "vertex 0 0 «x»", 1),
        "finite number",
    );
    refused(
        "t.stl",
        &text
            .replacen("vertex 0 0 0\n", "", 1)
            .replacen("endfacet", "«endfacet»", 1),
        "at least three",
    );
    refused_at("t.stl", "hello", "t.stl:", "begins with `solid`");
}

#[test]
fn ply_files() {
    let head = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment none\nelement vertex 4\nproperty double x\nproperty float y\nproperty \
             double z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nproperty list uchar \
             float other\nend_header\n"
        )
    };
    let text = head("ascii") + "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3 2 0.5 0.5\n";
    let ascii = mesh("a.ply", &text).unwrap();
    assert_eq!(names(&ascii), [("surface", 1)]);
    for little in [true, false] {
        let name = if little {
            "binary_little_endian"
        } else {
            "binary_big_endian"
        };
        let mut bytes = head(name).into_bytes();
        let mut put = |b: &[u8]| {
            let mut b = b.to_vec();
            if !little {
                b.reverse();
            }
            bytes.extend(b);
        };
        for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0_f64]] {
            put(&x.to_le_bytes());
            put(&(y as f32).to_le_bytes());
            put(&0.0_f64.to_le_bytes());
            put(&[9]);
        }
        put(&[4]);
        for v in 0..4_i32 {
            put(&v.to_le_bytes());
        }
        put(&[0]);
        let binary = parse_mesh("a.ply", bytes.clone()).unwrap();
        assert_eq!(binary.surfaces[0].polygons, ascii.surfaces[0].polygons);
        bytes.truncate(bytes.len() - 3);
        let error = parse_mesh("a.ply", bytes).unwrap_err().to_string();
        assert!(error.contains("face 0: the file is cut short"), "{error}");
    }
    let bad = |from: &str, to: &str, place: &str, words: &str| {
        refused_at("a.ply", &text.replace(from, to), place, words);
    };
    bad("4 0 1 2 3", "4 0 1 2 4", "a.ply: face 0", "only 4 vertices");
    bad("4 0 1 2 3", "4 0 1 2 -1", "a.ply: face 0", "-1 is not");
    bad("1 1 0 9", "1 inf 0 9", "a.ply: vertex 2", "finite");
    bad(
        "element face 1",
        "element face 99999999999",
        "a.ply: face 1",
        "cut short",
    );
    bad(
        "ply\nformat",
        "plx\nformat",
        "a.ply:1:",
        "begins with `ply`",
    );
    bad(
        "end_header",
        "end_heads",
        "a.ply:12:",
        "no line of a PLY header",
    );
    bad("format ascii 1.0\n", "", "a.ply:11:", "no `format`");
}

#[test]
fn descriptions() {
    assert!(is_description(TEMPLATE));
    assert!(!is_description("[problem]\nkind = \"room\""));
    let scene = parse_description("a.toml", TEMPLATE).unwrap();
    let without_lamp = [("floor", 1), ("ceiling", 1), ("walls", 4), ("table", 6)];
    let lamp = [("lamp", 1), ("lamp's back", 1)];
    assert_eq!(names(&scene), [&without_lamp[..], &lamp].concat());
    assert_eq!(scene.surfaces[3].material.reflectance, 0.4);
    assert!(scene.scene::<f64>().is_ok());
    let plate = "[problem]\nkind = \"scene\"\nopen = true\n[[problem.surface]]\nname = \"plate\"\nscale = 2\nrotate = [90, 0, \
                 0]\ntranslate = [0, 0, 1]\ntwo_sided = true\nemissivity = 0.5\npolygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]\n";
    let two = parse_description("a.toml", plate).unwrap();
    assert_eq!(names(&two), [("plate", 1), ("plate (back)", 1)]);
    assert_eq!(
        two.surfaces[0].polygons[0].points(),
        [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 0.0, 3.0]]
    );
    let wrong = |from: &str, to: &str, line: usize, words: &str| {
        assert!(plate.contains(from), "{from}");
        let error = parse_description("a.toml", &plate.replacen(from, to, 1))
            .expect_err(words)
            .to_string();
        assert!(error.starts_with(&format!("a.toml:{line}:")), "{error}");
        assert!(error.contains(words), "{error}");
    };
    wrong("[1, 1, 0]]", "[1, 1]]", 11, "three numbers");
    wrong(", [1, 1, 0]]", "]", 11, "at least three points");
    wrong("scale = 2", "scale = 0", 6, "more than 0");
    wrong(
        "open = true",
        "open = true\nscale = 2",
        4,
        "places the `mesh` of `[problem]`",
    );
    wrong(
        "open = true",
        "open = true\nweld = \"1 mile\"",
        4,
        "a length is a number",
    );
    wrong(
        "open = true",
        "open = true\nweld = 0",
        4,
        "a length is a number",
    );
    wrong(
        "two_sided",
        "inward = true\ntwo_sided",
        9,
        "turns a `box` or a `mesh`",
    );
    wrong("emissivity = 0.5", "emissivity = 1.5", 10, "at most 1");
    wrong(
        "emissivity = 0.5",
        "emissivity = 0.5\nreflectance = 0.5",
        10,
        "give either",
    );
    wrong("two_sided", "two_side", 9, "two_side");
    wrong("polygon", "box", 11, "two corners");
    wrong(
        "polygon = ",
        "mesh = \"a.obj\"\npolygons = ",
        11,
        "give one of",
    );
    wrong(
        "polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]\n",
        "",
        5,
        "has no `polygon`",
    );
    wrong(
        "polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]",
        "mesh = \"no.obj\"",
        11,
        "cannot read",
    );
    wrong("\"plate\"", "\"all\"", 5, "must not be");
    wrong("kind = \"scene\"", "kind = \"room\"", 2, "no scene");
}

#[test]
fn skies() {
    let text = "[problem]\nkind = \"scene\"\nsky = \"uniform\"\n[[problem.surface]]\nname = \"a\"\npolygon = [[0, 0, 0], [1, \
                0, 0], [0, 1, 0]]\n";
    let own = parse_description("a.toml", text).unwrap();
    assert!(own.open);
    assert_eq!(own.sky.unwrap().patches(), 1);
    let bands = "sky = { altitudes = [0, 30, 90], sectors = [6, 4] }";
    let with = |sky: &str| parse_description("a.toml", &text.replace("sky = \"uniform\"", sky));
    let own = with(bands).unwrap();
    assert_eq!(own.sky.unwrap().patches(), 10);
    assert!(with("open = true").unwrap().sky.is_none());
    let wrong = |sky: &str, words: &str| {
        let error = with(sky).expect_err(words).to_string();
        assert!(error.starts_with("a.toml:"), "{error}");
        assert!(error.contains(words), "{error}");
    };
    wrong("sky = \"blue\"", "must be \"uniform\"");
    wrong("sky = 1", "a string");
    wrong("open = false\nsky = \"uniform\"", "closed scene has no sky");
    wrong("sky = { altitudes = [0, 90] }", "sectors");
    wrong("sky = {}", "an `emission` or a `temperature`");
    wrong("sky = { emission = -1 }", "0 or more");
    wrong("sky = { emission = [1, 2] }", "1 patches");
    wrong("sky = { emission = 1, temperature = 250 }", "either");
    wrong("sky = { temperature = -1 }", "a million kelvin");
    let light = |sky: &str| with(sky).unwrap().sky.unwrap().light().unwrap();
    assert!(light("sky = \"uniform\"").is_none());
    let three = "sky = { altitudes = [0, 30, 90], sectors = [2, 1], emission = [1, 2, 3] }";
    assert_eq!(light(three).unwrap().emissions(), [1.0, 2.0, 3.0]);
    // The CIE's overcast sky: three times as bright at the zenith, and of a vertical plane 0.396 of the horizontal one.
    let overcast = light("sky = { cie = \"overcast\", emission = 10000 }").unwrap();
    let all = overcast.emissions();
    let lowest = 3.0 / 7.0 * 1e4 * (1.0 + 4.0 / 3.0 * 3_f64.to_radians().sin());
    assert!((all[0] - lowest).abs() < 1e-8 && (all[29] - 9.0 / 7.0 * 1e4).abs() < 20.0);
    let heights =
        (0..30).map(|band| [3.0 * f64::from(band), 3.0 * f64::from(band + 1)].map(f64::to_radians));
    let horizontal: f64 = heights
        .clone()
        .zip(all)
        .map(|([a, b], l)| l * (b.sin().powi(2) - a.sin().powi(2)))
        .sum();
    assert!((horizontal - 1e4).abs() < 1e-8, "{horizontal}");
    // ∫ L cos²γ cos φ dγ dφ/π over half of the sky.
    let part = |g: f64| (g + g.sin() * g.cos()) / core::f64::consts::PI;
    let vertical: f64 = heights
        .zip(all)
        .map(|([a, b], l)| l * (part(b) - part(a)))
        .sum();
    let exact = 1e4 * 3.0 / 7.0 * (0.5 + 4.0 / (3.0 * core::f64::consts::PI));
    // By the bands it is 1.45e-3 more.
    assert!((vertical / exact - 1.0).abs() < 2e-3, "{vertical} {exact}");
    wrong(
        "sky = { cie = \"clear\", emission = 1 }",
        "must be \"overcast\"",
    );
    wrong("sky = { cie = \"overcast\" }", "gives light");
    wrong(
        "sky = { cie = \"overcast\", temperature = 280 }",
        "an `emission` alone",
    );
    let night = with("sky = { temperature = \"-23.15 C\" }").unwrap();
    assert!(night.heat);
    let black = 5.670_374_419e-8 * 250.0_f64.powi(4);
    let found = night.sky.unwrap().emissions.unwrap();
    assert!(found.len() == 1 && (found[0] / black - 1.0).abs() < 1e-12);
    wrong(&bands.replace("[6, 4]", "[6]"), "2 bands between them");
    wrong(
        &bands.replace("[6, 4]", "[6, 0]"),
        "a number of sectors for each",
    );
    wrong(&bands.replace("[6, 4]", "[6, 50000]"), "100000 pieces");
    wrong(
        &bands.replace("[0, 30, 90]", "[5, 30, 90]"),
        "must ascend from 0",
    );
    wrong(
        &bands.replace("[0, 30, 90]", "[0, nan, 90]"),
        "finite number",
    );
    wrong(&bands.replace("[6, 4]", "[6, 4], colour = 1"), "colour");
}

/// The template's room is symmetrical in x and in y: a quarter of it has the whole's form factors.
#[test]
fn symmetry_planes() {
    // The quarter has no lamp.
    let lamp = TEMPLATE
        .find("[[problem.surface]]\nname = \"lamp\"")
        .unwrap();
    let whole = parse_description("a.toml", &TEMPLATE[..lamp]).unwrap();
    let quarter = "[problem]\nkind = \"scene\"\nsymmetry = { x = 2, y = 1.5 }\n\
                   [[problem.surface]]\nname = \"floor\"\npolygon = [[0, 0, 0], [2, 0, 0], [2, 1.5, 0], [0, 1.5, 0]]\n\
                   [[problem.surface]]\nname = \"ceiling\"\npolygon = [[0, 0, 2.5], [0, 1.5, 2.5], [2, 1.5, 2.5], [2, 0, 2.5]]\n\
                   [[problem.surface]]\nname = \"walls\"\npolygons = [[[0, 0, 0], [0, 0, 2.5], [2, 0, 2.5], [2, 0, 0]], \
                   [[0, 1.5, 0], [0, 1.5, 2.5], [0, 0, 2.5], [0, 0, 0]]]\n\
                   [[problem.surface]]\nname = \"table\"\npolygons = [[[1.5, 1, 0.7], [1.5, 1.5, 0.7], [2, 1.5, 0.7], [2, 1, 0.7]], \
                   [[1.5, 1, 0.75], [2, 1, 0.75], [2, 1.5, 0.75], [1.5, 1.5, 0.75]], \
                   [[1.5, 1, 0.7], [2, 1, 0.7], [2, 1, 0.75], [1.5, 1, 0.75]], \
                   [[1.5, 1.5, 0.7], [1.5, 1, 0.7], [1.5, 1, 0.75], [1.5, 1.5, 0.75]]]\n";
    let completed = parse_description("a.toml", quarter).unwrap();
    assert_eq!(
        names(&completed),
        [("floor", 4), ("ceiling", 4), ("walls", 8), ("table", 16)]
    );
    let table = |file: &SceneFile| {
        let scene = file.scene::<f64>().unwrap();
        let all = fredholm_factors::scene_factors(&scene, 1e-9).unwrap();
        all.of_surfaces(&scene).unwrap()
    };
    let (whole, completed) = (table(&whole), table(&completed));
    for i in 0..4 {
        assert!((whole.areas()[i] - completed.areas()[i]).abs() < 1e-12);
        for j in 0..4 {
            // A surface's quarters may be off by the error to each of four.
            let off = (whole.factor(i, j) - completed.factor(i, j)).abs();
            assert!(off < 5e-9, "{i} {j} {off:e}");
        }
    }
    let wrong = |from: &str, to: &str, place: &str, words: &str| {
        let error = parse_description("a.toml", &quarter.replacen(from, to, 1)).expect_err(words);
        let error = error.to_string();
        assert!(error.starts_with(place) && error.contains(words), "{error}");
    };
    wrong(
        "x = 2",
        "x = 1",
        "a.toml:3:18:",
        "on one side of the plane x = 1, and reaches from 0 to 2",
    );
    wrong("x = 2", "u = 2", "a.toml:3:14:", "unknown key `u`");
    wrong("x = 2", "x = \"a\"", "a.toml:3:18:", "number");
    wrong("{ x = 2, y = 1.5 }", "\"x\"", "a.toml:3:12:", "a table");
}

/// What is wrong with a scene is said with the line of its file.
#[test]
fn a_wrong_scene_is_placed() {
    let error = |text: &str| {
        let scene = parse_description("a.toml", text).unwrap();
        scene.scene::<f64>().unwrap_err().to_string()
    };
    // A table that reaches below the floor is cut there; a lamp without a back is seen from behind.
    let low = TEMPLATE.replace(
        "[[1.5, 1.0, 0.7], [2.5, 2.0, 0.75]]",
        "[[1.5, 1.0, -0.5], [2.5, 2.0, 0.75]]",
    );
    assert!(
        parse_description("a.toml", &low)
            .unwrap()
            .scene::<f64>()
            .is_ok()
    );
    let (start, back) = TEMPLATE
        .split_once("[[problem.surface]]\nname = \"lamp's back\"")
        .unwrap();
    let rest = back.split_once("[galerkin]").unwrap().1;
    let thin = format!("{start}[galerkin]{rest}");
    let line = thin
        .lines()
        .position(|l| l.starts_with("polygon = [[1.7"))
        .unwrap()
        + 1;
    let message = error(&thin);
    assert!(message.contains("from behind"), "{message}");
    assert!(
        message.contains(&format!("\"lamp\", a.toml:{line}")),
        "{message}"
    );
}

#[test]
fn lights() {
    let text = "[problem]\nkind = \"scene\"\nopen = true\n[[problem.surface]]\nname = \"a\"\npolygon = [[0, 0, 0], [1, 0, 0], \
                [0, 1, 0]]\n[[problem.light]]\nat = [0, 0, 2]\nintensity = 80\n[[problem.light]]\ntowards = [0, 3, 4]\nirradiance = 900\n";
    let own = parse_description("a.toml", text).unwrap();
    let sun = fredholm_scene::Beam::Parallel {
        towards: [0.0, 3.0, 4.0],
        irradiance: 900.0,
    };
    let scene = own.scene::<f64>().unwrap();
    assert_eq!((scene.beams().len(), scene.beams()[1]), (2, sun));
    let wrong = |from: &str, to: &str, line: usize, words: &str| {
        assert!(text.contains(from), "{from}");
        let error = parse_description("a.toml", &text.replacen(from, to, 1)).expect_err(words);
        let error = error.to_string();
        assert!(error.starts_with(&format!("a.toml:{line}:")), "{error}");
        assert!(error.contains(words), "{error}");
    };
    wrong("intensity = 80\n", "", 7, "`at` and `intensity`");
    wrong(
        "intensity = 80",
        "irradiance = 80",
        7,
        "`towards` and `irradiance`",
    );
    wrong("80", "-80", 9, "0 or more");
    wrong("900", "inf", 12, "finite");
    wrong("[0, 3, 4]", "[0, 0, 0]", 11, "a direction");
    wrong("[0, 0, 2]", "[0, 0]", 8, "three numbers");
    wrong(
        "open = true",
        "open = true\nsymmetry = { x = 0 }",
        4,
        "no `light`",
    );
}

/// What files of molecules say that is wrong.
#[test]
fn words_of_gases_are_checked() {
    let surface = "[[problem.surface]]\nname = \"pump\"\npolygon = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]\n";
    let read = |problem: &str, words: &str| {
        let text =
            format!("[problem]\nkind = \"vacuum\"\nopen = true\n{problem}\n{surface}{words}\n");
        parse_description("v.toml", &text).map_err(|error| error.to_string())
    };
    // 0.01 m² of hydrogen at 293.15 K pump a quarter of 1754.7 m/s.
    let scene = read("gas = \"h2\"", "pump = 438.67\noutgassing_rate = 1e-6").unwrap();
    let own = scene.surfaces[0].material;
    assert!((own.reflectance - 0.9).abs() < 1e-4, "{own:?}");
    assert!(
        (own.emission / (1e-4 / 4386.7) - 1.0).abs() < 1e-4,
        "{own:?}"
    );
    // Half of it is drawn: what is said is of the whole.
    let half = read(
        "gas = \"H2\"\nsymmetry = { x = 0.1 }",
        "pump = 877.34\noutgassing = 1e-4",
    );
    let own = half.unwrap().surfaces[0].material;
    assert!((own.reflectance - 0.9).abs() < 1e-4, "{own:?}");
    assert!(
        (own.emission / (1e-4 / 8773.4) - 1.0).abs() < 1e-4,
        "{own:?}"
    );
    // A wall of which nothing is said.
    let wall = read("gas = 28", "").unwrap().surfaces[0].material;
    assert_eq!((wall.reflectance, wall.emission), (1.0, 0.0));
    for (problem, words, message) in [
        ("gas = \"Hg2\"", "", "`gas` must be \"H2\", \"D2\""),
        ("photometric = true", "", "a vacuum has molecules alone"),
        ("gas = -1", "", "a molar mass in g/mol above 0"),
        ("temperature = 0", "", "temperature"),
        ("", "sticking = 1.5", "from 0 to 1"),
        ("", "sticking = 0.5\npump = 1", "give either `sticking`"),
        ("", "pump = 1178", "pumps at most 1176.7"),
        (
            "",
            "outgassing = 1\noutgassing_rate = 1",
            "give either the `outgassing`",
        ),
        ("", "reflectance = 0.5", "reflectance"),
    ] {
        let error = read(problem, words).unwrap_err();
        assert!(
            error.contains(message) && error.starts_with("v.toml:"),
            "{error}"
        );
    }
}
