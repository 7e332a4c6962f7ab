//! Buildings that cannot be, as converters and people write them: decks, models of EnergyPlus and problem files. Every refusal names the surface,
//! says where, and what would be right.

use core::fmt::Write as _;

use fredholm_file::scene::{SceneFile, parse_description, parse_mesh};

/// Corners of a room of 4 × 3 × 2.5 m, and of a window in its south.
const CORNERS: [[f64; 3]; 12] = [
    [0.0, 0.0, 0.0],
    [4.0, 0.0, 0.0],
    [4.0, 3.0, 0.0],
    [0.0, 3.0, 0.0],
    [0.0, 0.0, 2.5],
    [4.0, 0.0, 2.5],
    [4.0, 3.0, 2.5],
    [0.0, 3.0, 2.5],
    [1.0, 0.0, 0.8],
    [3.0, 0.0, 0.8],
    [3.0, 0.0, 2.2],
    [1.0, 0.0, 2.2],
];

/// The names, and the numbers of corners from 1, anticlockwise seen from inside.
const WALLS: [(&str, [usize; 4]); 7] = [
    ("floor", [1, 2, 3, 4]),
    ("ceiling", [5, 8, 7, 6]),
    ("south", [1, 5, 6, 2]),
    ("east", [2, 6, 7, 3]),
    ("north", [3, 7, 8, 4]),
    ("west", [4, 8, 5, 1]),
    ("window", [9, 12, 11, 10]),
];

/// The room as a View3D deck; the window's base is the south.
fn deck() -> String {
    let mut text = "T a room\nC encl=1\nF 3\n".to_owned();
    for (number, [x, y, z]) in (1..).zip(CORNERS) {
        writeln!(text, "V {number} {x} {y} {z}").unwrap();
    }
    for (number, (name, [a, b, c, d])) in (1..).zip(WALLS) {
        let base = if name == "window" { 3 } else { 0 };
        writeln!(text, "S {number} {a} {b} {c} {d} {base} 0 0.9 {name}").unwrap();
    }
    text + "End of data\n"
}

/// The room as a model of EnergyPlus, whose vertices go anticlockwise seen from outside.
fn model() -> String {
    let (mut walls, mut windows) = (Vec::new(), Vec::new());
    for (name, mut own) in WALLS {
        own.reverse();
        let points = own.map(|k| CORNERS[k - 1]);
        if name == "window" {
            let numbers = (1..).zip(points).map(|(k, [x, y, z])| {
                format!(
                    "\"vertex_{k}_x_coordinate\": {x}, \"vertex_{k}_y_coordinate\": {y}, \"vertex_{k}_z_coordinate\": {z}"
                )
            });
            let numbers: Vec<String> = numbers.collect();
            windows.push(format!(
                "\"{name}\": {{\"building_surface_name\": \"south\", {}}}",
                numbers.join(", ")
            ));
            continue;
        }
        let vertices = points.map(|[x, y, z]| {
            format!("{{\"vertex_x_coordinate\": {x}, \"vertex_y_coordinate\": {y}, \"vertex_z_coordinate\": {z}}}")
        });
        walls.push(format!(
            "\"{name}\": {{\"zone_name\": \"z\", \"vertices\": [{}]}}",
            vertices.join(", ")
        ));
    }
    format!(
        "{{\"GlobalGeometryRules\": {{\"r\": {{\"vertex_entry_direction\": \"Counterclockwise\", \"coordinate_system\": \"World\"}}}},\n\
         \"BuildingSurface:Detailed\": {{\n{}\n}},\n\"FenestrationSurface:Detailed\": {{\n{}\n}}}}\n",
        walls.join(",\n"),
        windows.join(",\n")
    )
}

/// The room as a problem file.
fn file() -> String {
    let mut text = "[problem]\nkind = \"scene\"\n".to_owned();
    for (name, own) in WALLS {
        let points = own.map(|k| CORNERS[k - 1]);
        writeln!(
            text,
            "[[problem.surface]]\nname = \"{name}\"\npolygon = {points:?}\nemissivity = 0.9\ntemperature = 300"
        )
        .unwrap();
    }
    text
}

/// A text without the line that has these words.
fn without(text: &str, words: &str) -> String {
    let left = text.lines().filter(|line| !line.contains(words));
    let left: Vec<&str> = left.collect();
    assert!(left.len() < text.lines().count(), "{words}");
    left.join("\n").replace("},\n}", "}\n}") + "\n"
}

fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

/// What is wrong, the text, the surface that is named, and what the message says of it.
type Case = (&'static str, String, &'static str, &'static str);

fn decks() -> Vec<Case> {
    let deck = deck();
    let own = |from: &str, to: &str| with(&deck, from, to);
    let turned = || {
        let lines = deck.lines().map(|line| match line.strip_prefix("S ") {
            Some(rest) => {
                let words: Vec<&str> = rest.split(' ').collect();
                let [n, a, b, c, d] = [words[0], words[1], words[2], words[3], words[4]];
                format!("S {n} {d} {c} {b} {a} {}", words[5..].join(" "))
            }
            None => line.to_owned(),
        });
        lines.collect::<Vec<_>>().join("\n") + "\n"
    };
    vec![
        (
            "a wall is missing",
            without(&deck, "east"),
            "floor",
            "is not closed",
        ),
        (
            "the floor is missing",
            without(&deck, "floor"),
            "south",
            "is not closed",
        ),
        (
            "a wall ends 5 cm before the next",
            own(
                "S 4 2 6 7 3",
                "V 13 4 2.95 0\nV 14 4 2.95 2.5\nS 4 2 6 14 13",
            ),
            "north",
            "gap of 5.000e-2 to surface 3",
        ),
        (
            "a wall is 30 cm too low",
            own("S 4 2 6 7 3", "V 13 4 0 2.2\nV 14 4 3 2.2\nS 4 2 13 14 3"),
            "ceiling",
            "gap of 3.000e-1 to surface 3",
        ),
        (
            "a wall is outwards",
            own(
                "S 4 2 6 7 3",
                "V 13 4.2 0 0\nV 14 4.2 0 2.5\nV 15 4.2 3 2.5\nV 16 4.2 3 0\nS 4 13 14 15 16",
            ),
            "floor",
            "is not closed",
        ),
        (
            "a window is outside of its wall",
            own(
                "V 9 1 0 0.8\nV 10 3 0 0.8\nV 11 3 0 2.2\nV 12 1 0 2.2",
                "V 9 5 0 0.8\nV 10 7 0 0.8\nV 11 7 0 2.2\nV 12 5 0 2.2",
            ),
            "window",
            "\"south\"",
        ),
        (
            "a window is larger than its wall",
            own(
                "V 9 1 0 0.8\nV 10 3 0 0.8\nV 11 3 0 2.2\nV 12 1 0 2.2",
                "V 9 -1 0 0.8\nV 10 5 0 0.8\nV 11 5 0 2.2\nV 12 -1 0 2.2",
            ),
            "window",
            "\"south\"",
        ),
        (
            "a window is higher than its wall",
            own("V 11 3 0 2.2\nV 12 1 0 2.2", "V 11 3 0 2.8\nV 12 1 0 2.8"),
            "window",
            "\"south\"",
        ),
        (
            "a window's base is not there",
            own("9 12 11 10 3", "9 12 11 10 33"),
            "window",
            "no other surface 33",
        ),
        (
            "a window's base is itself",
            own("9 12 11 10 3", "9 12 11 10 7"),
            "window",
            "no other surface 7",
        ),
        (
            "a window is 10 cm before its wall",
            own(
                "V 9 1 0 0.8\nV 10 3 0 0.8\nV 11 3 0 2.2\nV 12 1 0 2.2",
                "V 9 1 .1 0.8\nV 10 3 .1 0.8\nV 11 3 .1 2.2\nV 12 1 .1 2.2",
            ),
            "window",
            "\"south\"",
        ),
        (
            "a window is in another wall",
            own("9 12 11 10 3", "9 12 11 10 5"),
            "window",
            "\"north\"",
        ),
        (
            "a wall has no area",
            own("S 4 2 6 7 3", "S 4 2 6 6 2"),
            "east",
            "has no area",
        ),
        (
            "a wall is a line",
            own("S 4 2 6 7 3", "V 13 4 0 1\nS 4 2 13 6 0"),
            "east",
            "has no area",
        ),
        (
            "a wall is bent by 10 cm",
            own("S 4 2 6 7 3", "V 13 4.1 3 2.5\nS 4 2 6 13 3"),
            "north",
            "is not closed",
        ),
        ("a zone is inside out", turned(), "floor", "is not closed"),
        (
            "a wall is inside out",
            own("S 4 2 6 7 3", "S 4 3 7 6 2"),
            "east",
            "face different sides",
        ),
        (
            "two vertices have a number",
            own("V 7 4 3 2.5", "V 6 4 3 2.5"),
            "ceiling",
            "a second vertex 6",
        ),
        (
            "a vertex is not there",
            own("S 4 2 6 7 3", "S 4 2 6 77 3"),
            "east",
            "no vertex 77",
        ),
        (
            "a wall has two vertices",
            own("S 4 2 6 7 3", "S 4 2 6 0 0"),
            "east",
            "vertex",
        ),
        (
            "a wall crosses itself",
            own("S 4 2 6 7 3", "S 4 2 7 6 3"),
            "east",
            "crosses itself",
        ),
        (
            "a coordinate is NaN",
            own("V 7 4 3 2.5", "V 7 4 nan 2.5"),
            "ceiling",
            "finite number",
        ),
        (
            "a coordinate is missing",
            own("V 7 4 3 2.5", "V 7 4 3"),
            "ceiling",
            "before the coordinate z",
        ),
        (
            "an emissivity is missing",
            own("3 0 0 0.9 east", "3 0 0 east"),
            "east",
            "emissivity",
        ),
        (
            "an emissivity is in percent",
            own("0 0 0.9 east", "0 0 90 east"),
            "east",
            "at most 1",
        ),
        (
            "two surfaces have a number",
            own("S 4 2 6 7 3", "S 3 2 6 7 3"),
            "east",
            "a second surface 3",
        ),
        (
            "a surface is combined with none",
            own("3 0 0 0.9 east", "3 0 99 0.9 east"),
            "east",
            "no surface 99",
        ),
        (
            "a wall is there twice",
            own("End of data", "S 8 2 6 7 3 0 0 0.9 again\nEnd of data"),
            "again",
            "once more",
        ),
    ]
}

fn models() -> Vec<Case> {
    let model = model();
    let own = |from: &str, to: &str| with(&model, from, to);
    let vertex = |[x, y, z]: [&str; 3]| {
        format!(
            "{{\"vertex_x_coordinate\": {x}, \"vertex_y_coordinate\": {y}, \"vertex_z_coordinate\": {z}}}"
        )
    };
    let walls = |points: &[[&str; 3]]| {
        let line = model
            .lines()
            .find(|line| line.starts_with("\"east\""))
            .unwrap();
        let points: Vec<String> = points.iter().map(|&p| vertex(p)).collect();
        own(
            line,
            &format!(
                "\"east\": {{\"zone_name\": \"z\", \"vertices\": [{}]}},",
                points.join(", ")
            ),
        )
    };
    let shifted =
        |by: &str| model.replace("_x_coordinate\": 1,", &format!("_x_coordinate\": {by},"));
    vec![
        (
            "a wall is missing",
            without(&model, "\"east\""),
            "ceiling",
            "is not closed",
        ),
        (
            "a window is on no wall",
            own("\"south\", \"vertex_1", "\"sout\", \"vertex_1"),
            "window",
            "\"sout\"",
        ),
        (
            "a window has no wall",
            own("\"building_surface_name\": \"south\", ", ""),
            "window",
            "building_surface_name",
        ),
        (
            "a window is wider than its wall",
            shifted("-1"),
            "window",
            "\"south\"",
        ),
        (
            "a window has two vertices",
            own("\"vertex_3_x", "\"vertex_8_x"),
            "window",
            "at least three",
        ),
        (
            "a window is before its wall",
            model.replace(
                "\"vertex_1_y_coordinate\": 0",
                "\"vertex_1_y_coordinate\": 0.1",
            ),
            "window",
            "\"south\"",
        ),
        (
            "a zone is inside out",
            own("Counterclockwise", "Clockwise"),
            "ceiling",
            "is not closed",
        ),
        (
            "a wall has no vertices",
            own(
                "\"east\": {\"zone_name\": \"z\", \"vertices\"",
                "\"east\": {\"zone_name\": \"z\", \"points\"",
            ),
            "east",
            "`vertices`",
        ),
        (
            "a wall has two vertices",
            walls(&[["4", "0", "0"], ["4", "3", "0"]]),
            "east",
            "at least three",
        ),
        (
            "a coordinate is a text",
            walls(&[["4", "\"0\"", "0"], ["4", "3", "0"], ["4", "3", "2.5"]]),
            "east",
            "vertex 1",
        ),
        (
            "a wall is a line",
            walls(&[["4", "0", "0"], ["4", "1", "0"], ["4", "3", "0"]]),
            "east",
            "has no area",
        ),
        (
            "a wall crosses itself",
            walls(&[
                ["4", "3", "0"],
                ["4", "0", "2.5"],
                ["4", "3", "2.5"],
                ["4", "0", "0"],
            ]),
            "east",
            "crosses itself",
        ),
    ]
}

fn files() -> Vec<Case> {
    let file = file();
    let own = |from: &str, to: &str| with(&file, from, to);
    let east =
        "[[4.0, 0.0, 0.0], [4.0, 0.0, 2.5], [4.0, 3.0, 2.5], [4.0, 3.0, 0.0]]\nemissivity = 0.9";
    vec![
        (
            "a wall is missing",
            own(
                &format!(
                    "[[problem.surface]]\nname = \"east\"\npolygon = {east}\ntemperature = 300\n"
                ),
                "",
            ),
            "south",
            "is not closed",
        ),
        (
            "a word is misspelt",
            own(east, &east.replace("emissivity", "emisivity")),
            "east",
            "emissivity",
        ),
        (
            "an emissivity is above 1",
            own(east, &east.replace("0.9", "1.9")),
            "east",
            "emissivity",
        ),
        (
            "a temperature is below 0 K",
            own(
                &format!("{east}\ntemperature = 300"),
                &format!("{east}\ntemperature = \"-300 C\""),
            ),
            "east",
            "temperature",
        ),
        (
            "a polygon has two points",
            own(east, "[[4, 0, 0], [4, 3, 0]]"),
            "east",
            "at least three points",
        ),
        (
            "a point has two coordinates",
            own(east, "[[4, 0, 0], [4, 0, 2.5], [4, 3]]"),
            "east",
            "three numbers",
        ),
        (
            "a coordinate is NaN",
            own(east, "[[4, 0, 0], [4, 0, 2.5], [4, 3, nan]]"),
            "east",
            "finite number",
        ),
        (
            "a polygon crosses itself",
            own(east, "[[4, 0, 0], [4, 3, 2.5], [4, 0, 2.5], [4, 3, 0]]"),
            "east",
            "crosses itself",
        ),
        (
            "a name is there twice",
            own("name = \"east\"", "name = \"west\""),
            "west",
            "a second surface",
        ),
        (
            "a hole is before its wall",
            own(
                east,
                &format!(
                    "{}\nholes = [[[4.1, 1, 1], [4.1, 2, 1], [4.1, 2, 2]]]\nemissivity = 0.9",
                    east.lines().next().unwrap()
                ),
            ),
            "east",
            "off its plane",
        ),
        (
            "a surface has no shape",
            own(&format!("polygon = {east}"), "emissivity = 0.9"),
            "east",
            "`polygon`",
        ),
    ]
}

fn refusal(read: Result<SceneFile, impl ToString>) -> String {
    let scene = match read {
        Ok(file) => file
            .scene::<f64>()
            .map(|_| ())
            .map_err(|error| error.to_string()),
        Err(error) => Err(error.to_string()),
    };
    scene.err().unwrap_or_else(|| "nothing is wrong".to_owned())
}

#[test]
fn bad_buildings_are_refused_by_the_names_of_their_surfaces() {
    for good in [
        parse_mesh("good.vs3", deck().into_bytes()),
        parse_mesh("good.epJSON", model().into_bytes()),
        parse_description("good.toml", &file()),
    ] {
        assert_eq!(refusal(good), "nothing is wrong");
    }
    let mut wrong = Vec::new();
    let mesh = |name: &str, text: &str| refusal(parse_mesh(name, text.as_bytes().to_vec()));
    let kinds: [(&str, Vec<Case>); 3] = [
        ("a.vs3", decks()),
        ("a.epJSON", models()),
        ("a.toml", files()),
    ];
    let mut count = 0;
    for (name, cases) in kinds {
        for (what, text, surface, words) in cases {
            count += 1;
            let message = match name {
                "a.toml" => refusal(parse_description(name, &text)),
                _ => mesh(name, &text),
            };
            let is_right =
                message.starts_with(name) && message.contains(surface) && message.contains(words);
            if !is_right {
                wrong.push(format!("{name}, {what}: {surface}, {words}: {message}"));
            }
        }
    }
    assert!(count >= 40 && wrong.is_empty(), "{}", wrong.join("\n\n"));
}
