//! Rooms as people draw them: what is said of gaps and covered floors, units, temperatures, decks.

use crate::common;

use common::{Folder, csv_rows, diagnose, fredholm, list, number};

/// A surface of a grey room.
fn grey(name: &str, points: &str, temperature: &str) -> String {
    format!(
        "[[problem.surface]]\nname = '{name}'\npoints = {points}\nemissivity = 0.9\n\
         temperature = {temperature}\n"
    )
}

/// A box of 5 by 4 with a partition that stands on its floor.
fn with_partition(floor: &[String]) -> String {
    let mut room = vec!["[problem]\nkind = 'room'\n".to_owned()];
    room.extend_from_slice(floor);
    room.push(grey("rest", "[[5, 0], [5, 4], [0, 4], [0, 0]]", "292"));
    let feet = "[[1.5, 0], [1.5, 1.2], [1.6, 1.2], [1.6, 0]]";
    room.push(grey("partition", feet, "\"19 C\""));
    room.push("[galerkin]\ncells = 40\ndegree = 1\n[walk]\nwalks = 2000\n".to_owned());
    room.push("[[target]]\nname = 'floor'\nover = 'floor'\n".to_owned());
    room.push("[[target]]\nname = 'spot'\nat = { surface = 'floor', t = 0.5 }\n".to_owned());
    room.concat()
}

#[test]
fn a_floor_under_a_partition_is_left_out() {
    let folder = Folder::new();
    let parts = [
        grey("floor", "[[0, 0], [1.5, 0]]", "291"),
        grey("floor 2", "[[1.6, 0], [5, 0]]", "291"),
    ];
    let by_hand = with_partition(&parts).replace("over = 'floor'", "over = ['floor', 'floor 2']");
    let by_hand = folder.solve(&by_hand, &["--json"]).quietly(0).json();
    let flux = |json: &serde_json::Value, name: &str| {
        let surfaces = list(json, "surfaces").iter();
        let own = surfaces.filter(|surface| surface["name"].as_str().unwrap().starts_with(name));
        let fluxes = own.map(|surface| &surface["net_flux"]);
        let errors: f64 = fluxes
            .clone()
            .map(|flux| number(flux, "std_error").powi(2))
            .sum();
        (
            fluxes.map(|flux| number(flux, "estimate")).sum::<f64>(),
            errors,
        )
    };
    let told = "\"floor\" from (1.5, 0) to (1.6, 0) is covered by \"partition\" and left out";
    let floor = [grey("floor", "[[0, 0], [5, 0]]", "291")];
    let whole = with_partition(&floor);
    // With and without its underside, and where light might leave: heat vanished in the partition once.
    let closed = whole.replace("[1.6, 0]]", "[1.6, 0], [1.5, 0]]");
    let open = whole.replace("kind = 'room'", "kind = 'room'\nopen = true");
    let both = closed.replace("kind = 'room'", "kind = 'room'\nopen = true");
    assert!(whole != closed && closed != both);
    for problem in [&whole, &closed, &open, &both] {
        let ran = folder.solve(problem, &["--json"]);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        assert!(ran.stderr.contains(told), "{ran:?}");
        let lines = ran.stderr.lines().count();
        let underside = "\"partition\" from (1.6, 0) to (1.5, 0) is covered by \"floor\"";
        assert_eq!(ran.stderr.contains(underside), lines == 2, "{ran:?}");
        assert!(lines <= 2, "{ran:?}");
        let json = ran.json();
        for name in ["floor", "rest", "partition"] {
            let ((one, a), (other, b)) = (flux(&json, name), flux(&by_hand, name));
            assert!((one - other).abs() < 4.5 * (a + b).sqrt(), "{name}: {json}");
        }
        let [one, other] =
            [&json, &by_hand].map(|json| number(&list(json, "targets")[0], "galerkin"));
        assert!((one - other).abs() < 1e-9 * other, "{json}");
        let balance = &json["energy_balance"];
        let allowed = 4.5 * number(balance, "std_error");
        assert!(number(balance, "estimate").abs() < allowed, "{json}");
    }
    // The picture, form factors and the prediction say it, too.
    let path = folder.file("whole.toml", &whole);
    for command in [
        &["check"][..],
        &["factors"],
        &["diagnose", "--nodes", "100"],
    ] {
        let ran = fredholm(&[command, &[&path]].concat());
        assert!(ran.stderr.contains(told), "{ran:?}");
    }
    // A part of the floor of its own, which is covered wholly, has no u, and no flux.
    let parts = [
        grey("floor", "[[0, 0], [1.5, 0]]", "291"),
        grey("under", "[[1.5, 0], [1.6, 0]]", "291"),
        grey("floor 2", "[[1.6, 0], [5, 0]]", "291"),
    ];
    let ran = folder.solve(&with_partition(&parts), &["--json"]);
    assert_eq!(ran.status, Some(0), "{ran:?}");
    assert_eq!(list(&ran.json(), "surfaces").len(), 4);
    let of_it = with_partition(&parts).replace("over = 'floor'", "over = ['floor', 'under']");
    let ran = folder.solve(&of_it, &[]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    assert!(
        ran.stderr.contains("surface \"under\" is covered wholly"),
        "{ran:?}"
    );
}

#[test]
fn a_gap_is_told_by_its_ends() {
    let folder = Folder::new();
    let room = |corner: &str| {
        [
            "[problem]\nkind = 'room'\n".to_owned(),
            grey("floor", "[[0, 0], [5, 0]]", "291"),
            grey(
                "rest",
                &format!("[[5, 0], [5, 4], [0, 4], {corner}]"),
                "292",
            ),
            "[galerkin]\ncells = 40\ndegree = 0\n".to_owned(),
            "[[target]]\nname = 'a'\nover = 'all'\n".to_owned(),
        ]
        .concat()
    };
    for (corner, words) in [
        (
            "[0, 0.001]",
            [
                "gap of 1.000e-3",
                "(0, 0) of \"floor\" and (0, 0.001) of \"rest\"",
            ],
        ),
        (
            "[-0.001, 0]",
            [
                "gap of 1.000e-3",
                "(0, 0) of \"floor\" and (-0.001, 0) of \"rest\"",
            ],
        ),
    ] {
        let ran = folder.solve(&room(corner), &[]);
        assert_eq!(ran.status, Some(2), "{ran:?}");
        for word in words {
            assert!(ran.stderr.contains(word), "{word}: {ran:?}");
        }
        assert!(!ran.stderr.contains("-0.000"), "{ran:?}");
    }
    // One segment has no gap between its ends. Drawn there and back it has two sides.
    for (points, status) in [("[[1, 1], [2, 1]]", 2), ("[[1, 1], [2, 1], [1, 1]]", 0)] {
        let plate =
            room("[0, 0]").replace("[[target]]", &(grey("plate", points, "292") + "[[target]]"));
        let ran = fredholm(&["check", &folder.file("plate.toml", plate)]);
        assert_eq!(ran.status, Some(status), "{ran:?}");
        let is_told = ran
            .stderr
            .contains("\"plate\" touches no other, and its back is met: let its points go on");
        assert_eq!(is_told, status == 2, "{ran:?}");
        assert!(!ran.stderr.contains("gap of"), "{ran:?}");
    }
    // Nor have two of them between them, unless they all but meet.
    let two = |from: &str| {
        let [a, b] = ["[[1, 1], [2, 1]]", &format!("[[{from}, 1], [3, 2]]")]
            .map(|points| grey(&format!("plate {}", &points[2..5]), points, "292"));
        let text = room("[0, 0]").replace("[[target]]", &(a + &b + "[[target]]"));
        fredholm(&["check", &folder.file("two.toml", text)]).stderr
    };
    let said = two("2.4");
    let words = "\"plate 1, \", \"plate 2.4\" touch no others, and their backs are met: let the points of each";
    assert!(said.contains(words) && !said.contains("gap of"), "{said}");
    assert!(two("2.001").contains("gap of 1.000e-3"), "{}", two("2.001"));
    let ran = folder.solve(&room("[1e200, 0]"), &[]);
    assert!(
        ran.stderr.contains("between 1e-100 and 1e100 wide"),
        "{ran:?}"
    );
}

#[test]
fn heat_has_one_unit_in_a_column() {
    let folder = Folder::new();
    let parts = [
        grey("floor", "[[0, 0], [1.5, 0]]", "[\"17.85 C\"]"),
        grey("floor 2", "[[1.6, 0], [5, 0]]", "291"),
    ];
    let csv = folder.at("out.csv");
    let text = with_partition(&parts);
    let ran = folder.solve(&text, &["--json", "--out", &csv]).quietly(0);
    let json = ran.json();
    let targets = list(&json, "targets");
    for target in targets {
        for key in ["plain", "preconditioned", "irradiance", "net_flux"] {
            assert_eq!(target[key]["unit"], "W/m2", "{target}");
        }
    }
    let surfaces = list(&json, "surfaces");
    assert_eq!(surfaces[0]["net_flux"]["unit"], "W/m");
    assert_eq!(surfaces[0]["walks"], 2000);
    assert_eq!(json["energy_balance"]["unit"], "W/m");
    assert_eq!(json["other_walks"], 8000);
    // 1.5 m of floor give 1.5 times as many W/m as W/m2.
    let [of_target, of_surface] = [&targets[0], &surfaces[0]].map(|from| &from["net_flux"]);
    let error = 1.5 * number(of_target, "std_error") + number(of_surface, "std_error");
    let apart = 1.5 * number(of_target, "estimate") - number(of_surface, "estimate");
    assert!(apart.abs() < 4.9 * error, "{json}");
    let rows = csv_rows(csv.as_ref());
    assert_eq!(rows.len(), 1 + 2 + 4 + 1);
    assert_eq!(rows[3][0], "net flux out of floor");
    let last = rows[0].len() - 2;
    assert_eq!(rows[0][last], "net_flux_per_metre");
    assert_eq!(rows[3][last].parse().ok(), of_surface["estimate"].as_f64());
    assert_eq!(rows[1][last], "");
    let table = folder.solve(&text, &[]).quietly(0).stdout;
    for word in [
        "plain, W/m2",
        "net flux, W/m2",
        "W per metre",
        "4000 walks",
        "(and 8000 walks",
    ] {
        assert!(table.contains(word), "{word}: {table}");
    }
    // One walk is no result.
    let table = folder.solve(&text, &["--walks", "1"]).stdout;
    assert!(
        table.contains("- (one walk)") && !table.contains("0.000000, one"),
        "{table}"
    );
}

#[test]
fn temperatures_have_units() {
    let folder = Folder::new();
    let of = |floor: &str| {
        let parts = [
            grey("floor", "[[0, 0], [1.5, 0]]", floor),
            grey("floor 2", "[[1.6, 0], [5, 0]]", "291"),
        ];
        with_partition(&parts)
    };
    let run = |floor: &str| folder.solve(&of(floor), &["--json"]);
    let [kelvin, celsius, worded] =
        ["293.15", "'20 C'", "['293.15 K']"].map(|floor| run(floor).quietly(0).timeless());
    assert_eq!(kelvin, celsius);
    assert_eq!(kelvin, worded);
    assert_eq!(kelvin, run("'20 °C'").quietly(0).timeless());
    let ran = run("'20 F'");
    assert!(ran.stderr.contains("\"19 C\""), "{ran:?}");
    let ran = run("'-280 C'");
    assert!(ran.stderr.contains("from 0 to a million kelvin"), "{ran:?}");
    run("20").warning(0, &["problem.toml:7: ", "write \"20 C\""]);
    let light = of("291").replacen(
        "emissivity = 0.9\ntemperature = 291",
        "reflectance = 0.1\nemission = -1",
        1,
    );
    folder
        .solve(&light, &[])
        .warning(0, &["this emission is negative"]);
}

/// What is said of many surfaces is said once.
#[test]
fn a_remark_is_made_once() {
    let side = |from: [f64; 2], to: [f64; 2]| {
        format!(
            "[[problem.surface]]\nname = '{from:?}'\npoints = [{from:?}, {to:?}]\nreflectance = 0.5\nemission = -1\n"
        )
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let sides: String = (0..4)
        .map(|k| side(corners[k], corners[(k + 1) % 4]))
        .collect();
    let file = format!("[problem]\nkind = 'room'\n{sides}[[target]]\nover = 'all'\n");
    let few = ["--cells", "20", "--degree", "0"];
    let ran = Folder::new().solve(&file, &few);
    let ran = ran.warning(
        0,
        &[
            "problem.toml:7: this emission is negative",
            "the first of 4 such surfaces",
        ],
    );
    assert_eq!(ran.stderr.matches("negative").count(), 1, "{ran:?}");
}

#[test]
fn a_refused_room_can_be_looked_at() {
    let folder = Folder::new();
    // Its other side is drawn.
    let text = with_partition(&[grey("floor", "[[5, 0], [0, 0]]", "291")]);
    let (path, svg) = (folder.file("a.toml", &text), folder.at("room.svg"));
    let ran = fredholm(&["check", &path, "--out", &svg]);
    assert_eq!(ran.status, Some(2), "{ran:?}");
    let drawn = std::fs::read_to_string(&svg).unwrap();
    for word in ["partition", "light leaves here", ">1 m<"] {
        assert!(drawn.contains(word), "{word}: {drawn}");
    }
    let closed = with_partition(&[
        grey("floor", "[[0, 0], [1.5, 0]]", "291"),
        grey("floor 2", "[[1.6, 0], [5, 0]]", "291"),
    ]);
    let path = folder.file("b.toml", &closed);
    fredholm(&["check", &path, "--out", &svg]).quietly(0);
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(
        drawn.contains("floor 2") && !drawn.contains("light leaves"),
        "{drawn}"
    );
    // What the partition covers of a floor in one piece is not drawn: but for a name it is the same picture.
    let whole = with_partition(&[grey("floor", "[[0, 0], [5, 0]]", "291")]);
    let (covered, other) = (folder.file("d.toml", &whole), folder.at("other.svg"));
    let ran = fredholm(&["check", &covered, "--out", &other]);
    assert_eq!(ran.status, Some(0), "{ran:?}");
    let lines = |drawn: &str| -> Vec<String> {
        let all = drawn.split('<').filter(|tag| tag.starts_with("line "));
        let mut all: Vec<String> = all.map(str::to_owned).collect();
        all.sort();
        all
    };
    let other = std::fs::read_to_string(&other).unwrap();
    assert!(lines(&drawn).len() > 10, "{drawn}");
    assert_eq!(lines(&drawn), lines(&other));
    let ran = fredholm(&["check", &path, "--out", &folder.at("room.png")]);
    assert!(ran.stderr.contains("must end in .svg"), "{ran:?}");
    let circle = folder.file("c.toml", common::CIRCLE);
    let ran = fredholm(&["check", &circle, "--out", &svg]);
    assert!(ran.stderr.contains("drawings are of rooms"), "{ran:?}");
}

#[test]
fn net_fluxes_can_be_left_out() {
    let folder = Folder::new();
    let text = with_partition(&[
        grey("floor", "[[0, 0], [1.5, 0]]", "291"),
        grey("floor 2", "[[1.6, 0], [5, 0]]", "291"),
    ]);
    let without = text.replacen("kind = 'room'", "kind = 'room'\nnet_fluxes = false", 1);
    let [with, without] =
        [text, without].map(|text| folder.solve(&text, &["--json"]).quietly(0).json());
    // The targets have the same bits, and their own net fluxes.
    assert_eq!(with["targets"], without["targets"]);
    assert!(number(&without["targets"][0]["net_flux"], "std_error") > 0.0);
    assert_eq!(without.get("surfaces"), None);
    assert_eq!(without.get("other_walks"), None);
}

#[test]
fn a_picture_has_the_range_that_is_asked_for() {
    let folder = Folder::new();
    let text = with_partition(&[
        grey("floor", "[[0, 0], [1.5, 0]]", "291"),
        grey("floor 2", "[[1.6, 0], [5, 0]]", "291"),
    ]);
    let (path, svg) = (folder.file("a.toml", &text), folder.at("a.svg"));
    let render = |more: &[&str]| {
        let args = [
            "render", &path, "-o", &svg, "--width", "250", "--walks", "1",
        ];
        fredholm(&[&args[..], more].concat())
    };
    render(&["--range", "400:420"]).quietly(0);
    let narrow = std::fs::read_to_string(&svg).unwrap();
    // From 400 to 420, where the default is of what is seen.
    assert!(
        narrow.contains(">405<") && !narrow.contains(">100<") && narrow.contains("asked for"),
        "{narrow}"
    );
    render(&[]).quietly(0);
    let whole = std::fs::read_to_string(&svg).unwrap();
    assert!(
        !whole.contains(">405<") && whole.contains(">K<") && !whole.contains("asked for"),
        "{whole}"
    );
    for (more, words) in [
        (&["--range", "5:2"][..], "the smaller first"),
        (&["--range", "5"], "the smaller first"),
        (&["--range", "-1:2", "--log"], "must begin above 0"),
    ] {
        common::refused(&render(more), &[words]);
    }
}

#[test]
fn points_in_the_air_have_a_radiant_temperature() {
    let folder = Folder::new();
    let of = |right: &str, targets: &str| {
        [
            "[problem]\nkind = 'room'\nnet_fluxes = false\n".to_owned(),
            grey("floor", "[[0, 0], [4, 0]]", "300"),
            grey("right", "[[4, 0], [4, 3]]", right),
            grey("rest", "[[4, 3], [0, 3], [0, 0]]", "300"),
            grey("block", "[[1, 1], [1, 2], [2, 2], [2, 1], [1, 1]]", "300"),
            format!("[galerkin]\ncells = 60\ndegree = 1\n[walk]\nwalks = 20000\n{targets}"),
        ]
        .concat()
    };
    let target = |name: &str, at: &str| format!("[[target]]\nname = '{name}'\nat = {at}\n");
    folder.file("points.csv", "0.5, 0.5\n\"right\", 0.5\n3.5, 2.5\n");
    let targets = target("a", "[3.0, 1.5]") + &target("p", "'points.csv'");
    let csv = folder.at("out.csv");
    // Where all is 300 K, so is what is seen.
    let ran = folder
        .solve(&of("300", &targets), &["--json", "--out", &csv])
        .quietly(0);
    let json = ran.json();
    for i in [0, 1, 3] {
        let found = &list(&json, "targets")[i]["radiant_temperature"];
        let allowed = 4.9 * number(found, "std_error") + 1e-9;
        assert!(
            (number(found, "estimate") - 300.0).abs() < allowed,
            "{found}"
        );
        assert_eq!(found["unit"], "K");
    }
    let rows = csv_rows(csv.as_ref());
    let column = |name: &str| rows[0].iter().position(|key| key == name).unwrap();
    let place =
        |row: usize| ["surface", "t", "x", "y"].map(|name| rows[row][column(name)].as_str());
    assert_eq!(place(1), ["", "", "3", "1.5"]);
    assert_eq!(place(3), ["right", "0.5", "4", "1.5"]);
    // A warm wall is felt near it, and both estimates agree.
    let warm = folder
        .solve(&of("340", &targets), &["--json"])
        .quietly(0)
        .json();
    let targets = list(&warm, "targets");
    let temperature = |i: usize| number(&targets[i]["radiant_temperature"], "estimate");
    assert!(temperature(0) > temperature(1) + 5.0, "{warm}");
    for i in [0, 1, 3] {
        let (plain, best) = (&targets[i]["plain"], &targets[i]["preconditioned"]);
        let [one, other] = [plain, best].map(|from| number(from, "estimate"));
        let error = number(plain, "std_error") + number(best, "std_error");
        assert!((one - other).abs() < 4.9 * error, "{warm}");
        let galerkin = number(&targets[i], "galerkin");
        assert!((galerkin - other).abs() < 0.05 * other, "{warm}");
    }
    let table = folder
        .solve(&of("340", &target("a", "[3.0, 1.5]")), &[])
        .quietly(0)
        .stdout;
    assert!(table.contains("mean radiant temperature, K"), "{table}");
    for (at, words) in [
        ("[1.5, 1.5]", "not between the walls"),
        ("[5, 1]", "not between the walls"),
        ("[1]", "or a point in the air, [x, y]"),
    ] {
        common::refused(&folder.solve(&of("300", &target("a", at)), &[]), &[words]);
    }
    folder.file("points.csv", "0.5, 0.5\n1.5, 1.5\n");
    let ran = folder.solve(&of("300", &target("p", "'points.csv'")), &[]);
    assert!(
        ran.stderr.contains("points.csv:2:1: this point is not"),
        "{ran:?}"
    );
}

#[test]
fn variances_in_the_air_are_predicted() {
    let folder = Folder::new();
    let problem = [
        "[problem]\nkind = 'room'\nnet_fluxes = false\n".to_owned(),
        grey("floor", "[[0, 0], [4, 0]]", "290"),
        grey("right", "[[4, 0], [4, 3]]", "350"),
        grey("rest", "[[4, 3], [0, 3], [0, 0]]", "300").replace("0.9", "0.3"),
        grey("block", "[[1, 1], [1, 2], [2, 2], [2, 1], [1, 1]]", "280").replace("0.9", "0.4"),
        "[galerkin]\ncells = 40\ndegree = 0\n[walk]\nwalks = 100000\n".to_owned(),
        "[[target]]\nname = 'open'\nat = [3.0, 1.5]\n".to_owned(),
        "[[target]]\nname = 'hidden'\nat = [0.4, 1.6]\n".to_owned(),
    ]
    .concat();
    let path = folder.file("air.toml", &problem);
    for pairs in ["default", "rays"] {
        let text = problem.replace("cells = 40", &format!("cells = 40\npairs = '{pairs}'"));
        let path = folder.file("air.toml", &text);
        let solved = folder.solve(&text, &["--json"]).quietly(0).json();
        let ran = fredholm(&[diagnose(), &[&path, "--json"]].concat());
        assert_eq!(ran.status, Some(0), "{ran:?}");
        let predicted = ran.json();
        for (target, diagnosed) in list(&solved, "targets")
            .iter()
            .zip(list(&predicted, "targets"))
        {
            for key in ["plain", "preconditioned"] {
                let measured = number(&target[key], "std_dev");
                let ratio = number(diagnosed, key) / measured;
                // The quadrature has a percent or two; a large score in 10^4 walks leaves a few of the measured one.
                assert!(
                    (0.9..1.1).contains(&ratio),
                    "{pairs}, {key}: {ratio}\n{diagnosed}"
                );
            }
        }
    }
    let ran = fredholm(&[diagnose(), &[&path]].concat());
    assert_eq!(ran.status, Some(0), "{ran:?}");
}

/// A room around a corner, lit from its left end, by degree 4: √Var relative to the largest radiosity. Behind the corner, with 400
/// cells, a v from coefficients of pairs would leave 2e-7, as those of cells that see a part of each other are not exact. On the
/// floor, with 100 cells, boxes of rays whose ends nobody looks at would leave 1.7e-7, and those that do not end where shadows do 5e-7.
#[test]
fn around_a_corner_neither_pairs_nor_shadows_nor_ends_of_boxes_leave_much() {
    let room = [
        ("floor", "[[0, 0], [2.8033, 0]]", 0.3716, 0),
        ("right", "[[2.8033, 0], [2.8033, 1.2886]]", 0.1511, 0),
        ("top", "[[2.8033, 1.2886], [1.4016, 1.2886]]", 0.0427, 0),
        ("behind", "[[1.4016, 1.2886], [1.4016, 0.7732]]", 0.2889, 0),
        ("low", "[[1.4016, 0.7732], [0, 0.7732]]", 0.2703, 0),
        ("lamp", "[[0, 0.7732], [0, 0]]", 0.0268, 1),
    ];
    let surface = |(name, points, reflectance, emission)| {
        format!(
            "[[problem.surface]]\nname = '{name}'\npoints = {points}\nreflectance = {reflectance}\n\
             emission = {emission}\n"
        )
    };
    let walls = room.map(surface).concat();
    for (cells, surface, most) in [(400, "behind", 2e-8), (100, "floor", 1.2e-7)] {
        let place = |t: f64| {
            format!("[[target]]\nname = '{t}'\nat = {{ surface = '{surface}', t = {t} }}\n")
        };
        let places = [0.086, 0.191, 0.403, 0.861].map(place).concat();
        let problem = format!(
            "[problem]\nkind = 'room'\n{walls}{places}[galerkin]\ncells = {cells}\ndegree = 4\n\
             [walk]\nwalks = 32768\n"
        );
        let solved = Folder::new().solve(&problem, &["--json", "--no-global"]);
        for target in list(&solved.quietly(0).json(), "targets") {
            let deviation = number(&target["preconditioned"], "std_dev");
            assert!(deviation < most, "{cells} cells, {surface}: {deviation:e}");
        }
    }
}
