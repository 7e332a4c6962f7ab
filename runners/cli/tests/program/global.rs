//! `fredholm solve --global`: its numbers, its files, and what is refused.

use crate::common;

use common::{CIRCLE, Folder, csv_rows, fredholm, keys, list, number, refused};

use crate::systems::SCENE;

/// A cube in two dimensions whose solution is known: ∫ ½xy u = x (1/8 + 1/6), of u = 1 + x₁ + x₂ times ½x₁y₂.
const CUBE: &str = "[problem]\nkind = 'cube'\ndimension = 2\nkernel = '0.5 * x1 * y2'\n\
     source = '1 + x1 + x2 - x1 * (1/4 + 1/8 + 1/6)'\nsolution = '1 + x1 + x2'\n\
     [galerkin]\ncells = 4\n[walk]\nwalks = 20000\n\
     [[target]]\nname = 'lattice'\ngrid = [3, 3]\n[[target]]\nname = 'mean'\nover = 'all'\n\
     [[target]]\nname = 'moment'\nweight = 'x1 * x2'\n";

#[test]
fn all_targets_come_from_one_set_of_walks() {
    let folder = Folder::new();
    for (file, targets) in [(CIRCLE, 6), (CUBE, 11)] {
        let report = folder
            .solve(
                file,
                &["--global", "--method", "walks", "--degree", "0", "--json"],
            )
            .quietly(0)
            .json();
        let all = list(&report, "targets");
        assert_eq!(all.len(), targets);
        // 64 replicates of equally many.
        assert_eq!(number(&report, "walks"), 20032.0);
        assert!(number(&report, "states") < 6.0 * 20032.0);
        assert_eq!(report["stop"], "done");
        // Of a function of one shape, as all images of ½x₁y₂ are, that of a single number, which 64 replicates know to a tenth.
        let factor = number(&report, "band_factor");
        assert!(factor > 1.8 && factor < 4.0, "{factor}");
        for target in all {
            let error = number(target, "std_error");
            let is_point = target.get("at").is_some();
            match target["band"].as_f64() {
                // Where T_K has no kernel, at x₁ = 0 of the cube, F is u and there is no error.
                Some(band) => assert!(is_point && (band - factor * error).abs() <= 1e-12 * band),
                None => assert!(!is_point, "{target}"),
            }
            // Not one of 17 in 1,000 choices of seeds is beyond 4.4 standard errors.
            if let Some(exact) = target["exact"].as_f64() {
                assert!(
                    (number(target, "estimate") - exact).abs() <= 4.4 * error.max(1e-14),
                    "{target}"
                );
            }
        }
    }
}

/// Cells and a degree that are open are chosen, and `check` tells them beforehand.
#[test]
fn what_is_open_is_chosen_and_told_beforehand() {
    let folder = Folder::new();
    let open = "[problem]\nkind = 'circle'\nreflectance = [0.3, 0.7]\n\
        emission = { constant = 5.0, amplitude = 1.0, frequency = 5 }\n\
        [walk]\nglobal = true\nwalks = 20000\n[[target]]\nname = 'point'\nat = 0.3\n";
    let json = folder.solve(open, &["--json"]).quietly(0).json();
    let (degree, unknowns) = (number(&json, "degree"), number(&json, "unknowns"));
    assert!(degree > 0.0);
    let choice = &json["split"];
    assert_eq!(number(choice, "walks"), 20000.0);
    let pilots = number(choice, "pilots");
    assert!(pilots > 5.0, "{json}");
    let error = number(&list(&json, "targets")[0], "std_error");
    assert!(error < 1e-9, "{error}");
    let told = fredholm(&["check", &folder.at("problem.toml")]).quietly(0);
    for words in [
        "chosen for 20000 walks".to_owned(),
        format!("degree     {degree}\n"),
        format!("unknowns   {unknowns}\n"),
    ] {
        assert!(told.stdout.contains(&words), "{words}: {}", told.stdout);
    }
}

#[test]
fn files_have_the_numbers_of_the_document() {
    let folder = Folder::new();
    let [json, csv, svg] = ["a.json", "a.csv", "a.svg"].map(|name| folder.at(name));
    let printed = folder
        .solve(CIRCLE, &["--global", "--out", &json])
        .quietly(0);
    assert!(
        printed.stdout.contains("F + T_K v") && printed.stdout.contains("at all points together")
    );
    let document: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    folder
        .solve(CIRCLE, &["--global", "--out", &csv, "--threads", "1"])
        .quietly(0);
    let text = std::fs::read_to_string(&csv).unwrap();
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = rows.next().unwrap();
    assert_eq!(head.last(), Some(&"s"));
    let column = |name: &str| head.iter().position(|column| *column == name).unwrap();
    for (row, target) in rows.zip(list(&document, "targets")) {
        for name in ["estimate", "std_error", "iterate"] {
            let found: f64 = row[column(name)].parse().unwrap();
            assert_eq!(found.to_bits(), number(target, name).to_bits(), "{name}");
        }
    }
    folder
        .solve(CIRCLE, &["--global", "--out", &svg])
        .quietly(0);
    let picture = std::fs::read_to_string(&svg).unwrap();
    assert!(picture.contains("band of all points together"));
    let keys = keys(&document);
    for key in [
        "truncation",
        "quadrature_error",
        "rounding_floor",
        "score_degree",
        "replicates",
    ] {
        assert!(keys.contains(&key), "{key}");
    }
}

/// u of a file by hand: F + Σ ∫_Xj K(x, y) (v + ê)(y) dy, with Simpson's rule on equal cells of the domain. The functions on a cell
/// are products of √(2b + 1) P_b(t), of total degree p or less, the degree along the last axis running fastest.
#[test]
fn the_coefficients_are_the_function() {
    const P: [fn(f64) -> f64; 3] = [
        |_| 1.0,
        |t| 3.0_f64.sqrt() * t,
        |t| 5.0_f64.sqrt() * (1.5 * t * t - 0.5),
    ];
    /// Nodes from −1 to 1 and their weights, whose sum is 1.
    fn simpson(parts: u32) -> Vec<(f64, f64)> {
        let weight = |i: u32| match i {
            0 => 1.0,
            i if i == parts => 1.0,
            i => 2.0 + 2.0 * f64::from(i % 2),
        };
        let of = |i: u32| {
            let t = -1.0 + 2.0 * f64::from(i) / f64::from(parts);
            (t, weight(i) / f64::from(3 * parts))
        };
        (0..=parts).map(of).collect()
    }
    let folder = Folder::new();
    let out = folder.at("wf.json");
    let solved = |file: &str| {
        let args = ["--global", "--method", "walks", "--out", &out];
        folder.solve(file, &args).quietly(0);
        let text = std::fs::read_to_string(&out).unwrap();
        let document: serde_json::Value = serde_json::from_str(&text).unwrap();
        let all = &document["coefficients"];
        assert_eq!(
            (all["basis"].as_str(), all["degree"].as_u64()),
            (Some("legendre"), Some(2))
        );
        let numbers = |key: &str| list(all, key).iter().map(|x| x.as_f64().unwrap()).collect();
        let [v, e]: [Vec<f64>; 2] = ["v", "e"].map(numbers);
        assert!(v.len() == e.len() && e.iter().any(|e| *e != 0.0), "{all}");
        let w: Vec<f64> = v.iter().zip(&e).map(|(v, e)| v + e).collect();
        (document, w)
    };
    let is_that = |document: &serde_json::Value, u: &dyn Fn(&[f64]) -> f64| {
        for target in list(document, "targets") {
            let at: Vec<f64> = list(target, "at")
                .iter()
                .map(|x| x.as_f64().unwrap())
                .collect();
            let estimate = number(target, "estimate");
            // The program's rule of T_K is as fine as error bars ask for: to a hundredth of them.
            let allowed = 0.05 * number(target, "std_error") + 1e-12;
            let off = (u(&at) - estimate).abs();
            assert!(off < allowed, "{at:?} {off} {allowed}");
        }
    };
    // Six cells of [-1, 2].
    let file = "[problem]\nkind = 'cube'\ndimension = 1\ndomain = [-1, 2]\nkernel = '0.2 * exp(-(x - y)^2 / 4)'\n\
        source = '1 + x'\n[galerkin]\ncells = 6\ndegree = 0\n[walk]\nwalks = 2000\n[[target]]\nname = 'u'\ngrid = 7\n";
    let (document, w) = solved(file);
    assert_eq!(w.len(), 6 * 3);
    is_that(&document, &|x| {
        let cell = |j: usize| {
            let node = |(t, weight): (f64, f64)| {
                let y = -1.0 + 0.5 * (j as f64 + 0.5 * (1.0 + t));
                let w: f64 = (0..3).map(|b| w[3 * j + b] * P[b](t)).sum();
                0.5 * weight * 0.2 * (-(x[0] - y).powi(2) / 4.0).exp() * w
            };
            simpson(100).into_iter().map(node).sum::<f64>()
        };
        1.0 + x[0] + (0..6).map(cell).sum::<f64>()
    });
    // Three by three cells of the square; nothing is the same along both axes.
    let file = "[problem]\nkind = 'cube'\ndimension = 2\nkernel = '0.4 * exp(x1 * y1 - 2 * y2)'\nsource = '1 + x2'\n\
        [galerkin]\ncells = 3\ndegree = 0\n[walk]\nwalks = 2000\n[[target]]\nname = 'u'\ngrid = [2, 3]\n";
    let (document, w) = solved(file);
    assert_eq!(w.len(), 9 * 6);
    let degrees = [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [2, 0]];
    is_that(&document, &|x| {
        let rule = simpson(40);
        let mut sum = 1.0 + x[1];
        for (j, own) in w.chunks(6).enumerate() {
            let [first, last] = [j / 3, j % 3].map(|place| place as f64);
            for (s, a) in &rule {
                for (t, b) in &rule {
                    let y = [
                        (first + 0.5 * (1.0 + s)) / 3.0,
                        (last + 0.5 * (1.0 + t)) / 3.0,
                    ];
                    let all = own.iter().zip(degrees);
                    let w: f64 = all.map(|(w, [c, d])| w * P[c](*s) * P[d](*t)).sum();
                    sum += a * b / 9.0 * 0.4 * (x[0] * y[0] - 2.0 * y[1]).exp() * w;
                }
            }
        }
        sum
    });
}

/// The numbers of an array of a `.vtu` file, eight bytes each, behind their number of bytes.
pub(crate) fn array(vtu: &str, name: &str) -> Vec<[u8; 8]> {
    let (_, rest) = vtu.split_once(&format!("Name=\"{name}\"")).expect(name);
    let (_, rest) = rest.split_once('>').unwrap();
    let (text, _) = rest.split_once('<').unwrap();
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let groups = text.trim_end_matches('=').as_bytes().chunks(4);
    let bytes = groups.flat_map(|group| {
        let bits = group
            .iter()
            .fold(0_u32, |bits, c| bits << 6 | u32::from(digit(*c)));
        let unused = 4 - group.len();
        let [_, bytes @ ..] = (bits << (6 * unused)).to_be_bytes();
        bytes.into_iter().take(3 - unused)
    });
    let bytes: Vec<u8> = bytes.collect();
    bytes[8..]
        .chunks(8)
        .map(|x| x.try_into().unwrap())
        .collect()
}

/// The means over the four squares of the grid are exact up to their error bars, and together the mean over all.
fn means_are_those_of_squares(mesh: &str, all: f64) {
    let [means, errors, iterates, off] = [
        "mean",
        "mean_std_error",
        "mean_iterate",
        "mean_quadrature_error",
    ]
    .map(|name| {
        array(mesh, name)
            .into_iter()
            .map(f64::from_le_bytes)
            .collect::<Vec<_>>()
    });
    assert_eq!(means.len(), 4);
    for (i, exact) in [1.5, 2.0, 2.0, 2.5].into_iter().enumerate() {
        let z = (means[i] - exact) / errors[i];
        assert!(z.abs() < 5.0 && errors[i] < 2e-3, "{z}");
        assert!((iterates[i] - exact).abs() < 0.05);
        assert!(off[i] < 1e-12);
    }
    let mean = means.iter().sum::<f64>() / 4.0;
    assert!((mean - all).abs() < 1e-12, "{mean} {all}");
}

/// The same numbers as in the document, in both forms of walks, and squares between the points of a grid.
#[test]
fn arrays_and_meshes_have_the_numbers_of_the_document() {
    let folder = Folder::new();
    let [npz, vtu] = ["u.npz", "u.vtu"].map(|name| folder.at(name));
    for (method, value) in [
        ("--global", "/estimate"),
        ("--seed=2", "/preconditioned/estimate"),
    ] {
        let solve = |out: &str| {
            folder
                .solve(CUBE, &[method, "--json", "--out", out])
                .quietly(0)
                .json()
        };
        let json = solve(&npz);
        let estimates = list(&json, "targets")
            .iter()
            .map(|t| t.pointer(value).unwrap());
        let estimates: Vec<[u8; 8]> = estimates
            .map(|x| x.as_f64().unwrap().to_le_bytes())
            .collect();
        assert_eq!(estimates.len(), 9 + 2);
        let archive = std::fs::read(&npz).unwrap();
        let whole = estimates.concat();
        assert!(
            archive.windows(whole.len()).any(|bytes| bytes == whole),
            "{method}"
        );
        solve(&vtu);
        let mesh = std::fs::read_to_string(&vtu).unwrap();
        assert_eq!(array(&mesh, "estimate"), estimates[..9]);
        assert_eq!(mesh.contains("Name=\"mean\""), method == "--global");
        if method == "--global" {
            means_are_those_of_squares(&mesh, number(&list(&json, "targets")[9], "estimate"));
        }
        // Four squares that turn left, and are a quarter each.
        let places: Vec<f64> = array(&mesh, "position")
            .into_iter()
            .map(f64::from_le_bytes)
            .collect();
        let corners = array(&mesh, "connectivity")
            .into_iter()
            .map(u64::from_le_bytes);
        let corners: Vec<&[f64]> = corners.map(|i| &places[3 * i as usize..][..2]).collect();
        assert_eq!(corners.len(), 16);
        for square in corners.chunks(4) {
            let twice = |i: usize| {
                let [a, b] = [square[i], square[(i + 1) % 4]];
                a[0] * b[1] - a[1] * b[0]
            };
            let area = 0.5 * (0..4).map(twice).sum::<f64>();
            assert!((area - 0.25).abs() < 1e-15, "{area}");
        }
    }
    let refused = |file: &str, words: &str| {
        refused(&folder.solve(file, &["--out", &vtu]), &[words]);
    };
    refused(
        &CUBE
            .replace("dimension = 2", "dimension = 4")
            .replace("[3, 3]", "[2, 2, 2, 2]"),
        "three dimensions",
    );
    let means = CUBE.replace(
        "name = 'lattice'\ngrid = [3, 3]",
        "name = 'all'\nover = 'all'",
    );
    refused(&means, "no target is a point");
}

#[test]
fn an_error_that_is_asked_for_holds_at_every_point() {
    let folder = Folder::new();
    let options = [
        "--global",
        "--json",
        "--target-error",
        "2e-3",
        "--walks",
        "10000000",
    ];
    let report = folder.solve(CIRCLE, &options).quietly(0).json();
    assert!(number(&report, "largest_std_error") <= 2e-3);
    assert!(number(&report, "walks") < 1e6);
    let never = ["--global", "--target-error", "1e-12", "--walks", "2000"];
    let ran = folder.solve(CIRCLE, &never);
    assert_eq!(ran.status, Some(3));
    assert!(
        ran.stderr
            .contains("not reached at every point within 2048 walks"),
        "{ran:?}"
    );
}

/// `[output]`: a grid of two axes without any target, and every kind of file from one solve; the flag's file in their place.
#[test]
fn a_file_says_where_results_go() {
    let folder = Folder::new();
    let problem = "[problem]\nkind = 'cube'\ndimension = 2\nkernel = '0.5*exp(-(x1-y1)^2-(x2-y2)^2)'\nsource = '1 + x1'\n\
                   [galerkin]\ncells = 4\ndegree = 1\n[walk]\nwalks = 2000\n[output]\ngrid = [5, 4]\n\
                   files = ['u.csv', 'u.json', 'u.npz', 'u.vtu', 'u.svg']\n";
    let read = |name: &str| std::fs::read_to_string(folder.at(name)).unwrap();
    let lines = |name: &str| read(name).lines().count();
    for options in [&["--global"][..], &[]] {
        let ran = folder.solve(problem, options);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        assert_eq!(lines("u.csv"), 21);
        // The last axis runs fastest, and has four points.
        let csv = read("u.csv");
        assert!(csv.contains("\nu[1],0 0.3333333333333333,"), "{csv}");
        assert!(read("u.json").contains("u[19]"));
        assert!(read("u.vtu").contains("NumberOfPoints=\"20\" NumberOfCells=\"12\""));
        let picture = read("u.svg");
        // A cube has no metres, and its picture no scale bar.
        assert!(!picture.contains("stroke-width=\"2\""));
        assert!(
            picture.contains("its standard error") && picture.matches("image/png").count() == 2
        );
        for name in ["u.csv", "u.json", "u.npz", "u.vtu", "u.svg"] {
            std::fs::remove_file(folder.at(name)).unwrap();
        }
    }
    let ran = folder.solve(problem, &["--out", &folder.at("other.csv")]);
    assert_eq!(ran.status, Some(0), "{ran:?}");
    assert_eq!(lines("other.csv"), 21);
    assert!(!folder.names().contains(&"u.csv".to_owned()));
    let refused = |from: &str, to: &str, words: &str| {
        refused(&folder.solve(&problem.replace(from, to), &[]), &[words]);
    };
    refused("'u.csv'", "'../u.csv'", "names without folders");
    refused("'u.csv'", "'u.txt'", "must end in .json");
    refused(
        "grid = [5, 4]",
        "grid = 5",
        "needs a number of points for each",
    );
    refused(
        "[output]",
        "[[target]]\nname = 'u'\nover = 'all'\n[output]",
        "give that another name",
    );
}

#[test]
fn what_has_no_global_estimate_says_so() {
    let folder = Folder::new();
    let room = fredholm(&["init", "room"]).quietly(0).stdout;
    let room = room.replace("# degree = 0", "degree = 4");
    let refused = |file: &str, options: &[&str], words: &str| {
        refused(&folder.solve(file, options), &[words]);
    };
    refused(&room, &["--global"], "use a `degree` of at most 3");
    refused(CIRCLE, &["--score-degree", "2"], "--global");
    refused(
        CIRCLE,
        &["--global", "--score-degree", "0"],
        "of a higher degree than v",
    );
}

/// A furnace in section: what a global estimate says of heat, in JSON, as a table and as CSV.
#[test]
fn rooms_have_fluxes_from_the_same_walks() {
    const ROOM: &str = "[problem]\nkind = 'room'\n\
        [[problem.surface]]\nname = 'floor'\npoints = [[0, 0], [2, 0]]\nemissivity = 0.8\ntemperature = 400\n\
        [[problem.surface]]\nname = 'wall'\npoints = [[2, 0], [2, 1]]\nemissivity = 0.5\nnet_flux = 0\n\
        [[problem.surface]]\nname = 'roof'\npoints = [[2, 1], [0, 1], [0, 0]]\nemissivity = 1\ntemperature = 300\n\
        [galerkin]\ncells = 60\ndegree = 2\n[walk]\nwalks = 20000\n\
        [[target]]\nname = 'along'\nsurface = 'floor'\ngrid = 4\n\
        [[target]]\nname = 'roof'\nover = 'roof'\n\
        [[target]]\nname = 'air'\nat = [1, 0.5]\n";
    let folder = Folder::new();
    let csv = folder.at("u.csv");
    let ran = folder.solve(ROOM, &["--global", "--out", &csv]).quietly(0);
    for words in [
        "global estimate, W/m2",
        "net flux out of",
        "0 (given)",
        "mean radiant temperature, K",
    ] {
        assert!(ran.stdout.contains(words), "{}", ran.stdout);
    }
    let json = folder
        .solve(ROOM, &["--global", "--json"])
        .quietly(0)
        .json();
    let balance = &json["energy_balance"];
    assert!(
        number(balance, "estimate").abs() < 4.5 * number(balance, "std_error"),
        "{json}"
    );
    let apart = folder.solve(ROOM, &["--json"]).quietly(0).json();
    let pairs = |json: &serde_json::Value, list: &str| json[list].as_array().unwrap().clone();
    // Separate walks say the same of everything that both have.
    let (mine, theirs) = (pairs(&json, "surfaces"), pairs(&apart, "surfaces"));
    let mut compared = 0;
    let mut compare = |a: &serde_json::Value, b: &serde_json::Value| {
        let off = (number(a, "estimate") - number(b, "estimate")).abs();
        let bar = number(a, "std_error").hypot(number(b, "std_error"));
        assert!(off <= 5.0 * bar + 1e-9, "{a} {b}");
        compared += 1;
    };
    for (a, b) in mine.iter().zip(&theirs) {
        assert_eq!(a["name"], b["name"]);
        compare(&a["net_flux"], &b["net_flux"]);
    }
    for (a, b) in pairs(&json, "targets")
        .iter()
        .zip(&pairs(&apart, "targets"))
    {
        compare(a, &b["preconditioned"]);
        for heat in ["irradiance", "net_flux", "radiant_temperature"] {
            assert_eq!(a[heat].is_null(), b[heat].is_null(), "{heat} {a} {b}");
            if !a[heat].is_null() {
                compare(&a[heat], &b[heat]);
            }
        }
    }
    assert_eq!(compared, 3 + 6 + 2 * 5 + 1);
    let table = std::fs::read_to_string(csv).unwrap();
    let widths: Vec<usize> = table.lines().map(|line| line.split(',').count()).collect();
    assert!(widths.iter().all(|width| *width == widths[0]), "{table}");
    assert!(table.contains("net flux out of all,"), "{table}");
}

/// Squares of a grid and cells of a scene are triangles in glTF, with a colour at each corner; a profile is refused before it walks.
#[test]
fn meshes_have_colours_in_gltf() {
    let folder = Folder::new();
    let glb = folder.at("u.glb");
    let of_points = "[[target]]\nname = 'a'\nat = [0.5, 0.5, 1]\n";
    let scene = SCENE.replace(of_points, "");
    // Four squares, and four on each of six faces.
    for (file, cells) in [(CUBE, 4), (&scene, 24)] {
        let few = ["--walks", "2048", "--degree", "0"];
        let args = [&few[..], &["--global", "--out", &glb]].concat();
        folder.solve(file, &args).quietly(0);
        let bytes = std::fs::read(&glb).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        for count in [4 * cells, 6 * cells] {
            assert!(text.contains(&format!("\"count\":{count}")), "{text}");
        }
    }
    let profile = CUBE.replace("[3, 3]", "[9, 1]");
    assert_ne!(profile, CUBE);
    let words = ["glTF shows grids of two axes, and cells of scenes"];
    refused(&folder.solve(&profile, &["--out", &glb]), &words);
}

/// The means over the cells of a scene: in all formats the same, area by area those over the surfaces, and where light is
/// known, what it is. Points have none.
#[test]
fn a_scene_has_means_over_cells() {
    let folder = Folder::new();
    let of_points = "[[target]]\nname = 'a'\nat = [0.5, 0.5, 1]\n";
    let file = folder.file("scene.toml", SCENE.replace(of_points, ""));
    let out = |name: &str| folder.at(name);
    let few = ["--walks", "2048", "--degree", "0"];
    let solve = |args: &[&str]| {
        let all = [&["solve", &file, "--global"], &few[..], args];
        fredholm(&all.concat()).quietly(0)
    };
    for name in ["u.vtu", "u.csv", "u.npz"] {
        solve(&["--out", &out(name)]);
    }
    let json = solve(&["--json"]).json();
    let mesh = list(&json, "mesh");
    assert_eq!(mesh.len(), 24);
    let vtu = std::fs::read_to_string(out("u.vtu")).unwrap();
    let csv = csv_rows(out("u.csv").as_ref());
    assert_eq!(csv.len(), 1 + 1 + 24);
    for (column, key) in [(7, "estimate"), (8, "std_error"), (9, "band")] {
        assert_eq!(csv[0][column], key);
        let numbers = array(&vtu, key).into_iter().map(f64::from_le_bytes);
        assert_eq!(numbers.len(), 24);
        for ((cell, number), row) in mesh.iter().zip(numbers).zip(&csv[2..]) {
            assert_eq!(self::number(cell, key), number);
            assert_eq!(row[column].parse::<f64>().unwrap(), number);
        }
    }
    // Four squares of the same size on each of six faces; the lamp is the last, reflects nothing, and has u = 1.
    assert_eq!(mesh[20]["name"], "lamp[0]");
    assert!(mesh[20]["irradiance"].is_null());
    let [room, lamp] = [&mesh[..20], &mesh[20..]].map(|cells| {
        cells
            .iter()
            .map(|cell| number(cell, "estimate"))
            .sum::<f64>()
    });
    let over_room = number(&list(&json, "targets")[0], "estimate");
    assert!((room / 20.0 - over_room).abs() < 1e-12);
    assert!((lamp - 4.0).abs() < 1e-12);
    let corners = list(&mesh[0], "corners");
    let [u, h] = [
        number(&mesh[0], "estimate"),
        number(&mesh[0]["irradiance"], "estimate"),
    ];
    assert!(corners.len() == 4 && (u - 0.5 * h).abs() < 1e-14);

    let words = ["\"a\" is a point"];
    refused(&folder.solve(SCENE, &["--global"]), &words);
    let words = ["no target is a point: `--global` has all cells"];
    refused(&fredholm(&["solve", &file, "--out", &out("u.vtu")]), &words);
}
