//! `fredholm render`: pictures, and the numbers behind them.

use crate::common;

use std::path::Path;

use common::{Folder, Ran, assert_svg, fredholm, number, refused};

/// A room of 2 by 1 with an obstacle and a thin baffle. The lamp is the left wall: u = 1 on it and 0
/// elsewhere.
const BLACK: &str = "[problem]\nkind = 'room'\n\
    [[problem.surface]]\nname = 'walls'\npoints = [[0, 0], [2, 0], [2, 1], [0, 1]]\nreflectance = 0\n\
    [[problem.surface]]\nname = 'lamp'\npoints = [[0, 1], [0, 0]]\nreflectance = 0\nemission = 1\n\
    [[problem.surface]]\nname = 'a'\npoints = [[1, 0.5], [1, 0]]\nreflectance = 0\n\
    [[problem.surface]]\nname = 'b'\npoints = [[1, 0], [1, 0.5]]\nreflectance = 0\n\
    [[problem.surface]]\nname = 'block'\nreflectance = 0\n\
    points = [[1.6, 0.6], [1.6, 0.8], [1.8, 0.8], [1.8, 0.6], [1.6, 0.6]]\n\
    [galerkin]\ncells = 60\ndegree = 1\n\
    [[target]]\nname = 'mean'\nover = 'all'\n";

/// The same room as a furnace: u = 1 everywhere.
fn furnace() -> String {
    let mut text = BLACK.replace("reflectance = 0\nemission = 1\n", "reflectance = 0\n");
    for (i, rho) in [0.7, 0.2, 0.5, 0.9, 0.4].into_iter().enumerate() {
        let material = format!("reflectance = {rho}\nemission = {:.1}\n", 1.0 - rho);
        text = text.replacen("reflectance = 0\n", &material, 1);
        assert_eq!(text.matches("emission").count(), i + 1);
    }
    text
}

/// The rows of a table without its header.
fn rows(folder: &Folder, name: &str) -> Vec<Vec<f64>> {
    let mut reader = csv::Reader::from_path(folder.at(name)).unwrap();
    let rows = reader.records().map(|row| {
        let row = row.unwrap();
        row.iter().map(|x| x.parse().unwrap_or(f64::NAN)).collect()
    });
    rows.collect()
}

fn render(folder: &Folder, problem: &str, name: &str, args: &[&str]) -> Ran {
    let file = folder.file("problem.toml", problem);
    let out = folder.at(name);
    fredholm(&[&["render", &file, "-o", &out], args].concat())
}

/// Width, height, and red, green, blue of every pixel.
fn decode(path: &Path) -> (usize, usize, Vec<[u8; 3]>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    let pixels = bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    (info.width as usize, info.height as usize, pixels)
}

/// Where in a picture its first pixel over the room is.
fn origin(json: &serde_json::Value) -> [usize; 2] {
    [0, 1].map(|k| json["origin"][k].as_u64().unwrap() as usize)
}

#[test]
fn a_picture_is_as_wide_as_asked_and_says_what_is_where() {
    let folder = Folder::new();
    let tall = BLACK
        .replace("[2, 1]", "[2, 9]")
        .replace("[0, 1]", "[0, 9]");
    for (problem, width, more) in [
        (BLACK, 300, &[][..]),
        (BLACK, 431, &["--side-by-side"]),
        (&tall, 300, &[]),
    ] {
        let own = width.to_string();
        let args = [&["--width", &own, "--walks", "1", "--json"][..], more].concat();
        let json = render(&folder, problem, "a.png", &args).quietly(0).json();
        let (found, high, _) = decode(&folder.path().join("a.png"));
        assert_eq!(found, width);
        let [left, top] = origin(&json);
        let (across, along) = (number(&json, "width"), number(&json, "height"));
        assert!(left as f64 + across < width as f64, "{json}");
        assert!(
            top as f64 + along < high as f64 && along <= 2.0 * width as f64,
            "{json}"
        );
        // No part of the page is wasted on a room that is not tall.
        assert!(
            problem == tall || across * (1.0 + more.len() as f64) > 0.35 * width as f64,
            "{json}"
        );
    }
    let args = ["--width", "500", "--walks", "1"];
    let heat = furnace().replace(
        "reflectance = 0.7\nemission = 0.3",
        "emissivity = 0.3\ntemperature = 300",
    );
    render(&folder, &heat, "a.svg", &args).quietly(0);
    let svg = std::fs::read_to_string(folder.path().join("a.svg")).unwrap();
    assert!(svg.contains("width=\"500\""), "{}", &svg[..200]);
    // Names, metres along both axes, and a bar of a quarter of the width.
    for word in ["walls", "lamp", "block", "1.5", "0.2", "0.5 m"] {
        assert!(svg.contains(&format!(">{word}<")), "{word}");
    }
    refused(
        &render(&folder, BLACK, "a.png", &["--width", "100"]),
        &["--width 100", "at least 2", "pixels wide"],
    );
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let folder = Folder::new();
    for (name, width) in [("a.png", "250"), ("a.svg", "250"), ("a.csv", "60")] {
        let of = |threads: &str| {
            let args = ["--width", width, "--walks", "8", "--threads", threads];
            render(&folder, &furnace(), name, &args).quietly(0);
            std::fs::read(folder.path().join(name)).unwrap()
        };
        let one = of("1");
        assert!(one == of("2") && one == of("3"), "{name}");
    }
    let of = |threads: &str| {
        let args = ["--profile", "--walks", "50", "--threads", threads];
        render(&folder, &furnace(), "p.svg", &args).quietly(0);
        std::fs::read_to_string(folder.path().join("p.svg")).unwrap()
    };
    let one = of("1");
    assert_svg(&folder.path().join("p.svg"));
    assert_eq!(one, of("2"));
    for name in ["walls", "lamp", "block", "length along all surfaces"] {
        assert!(one.contains(name), "{name}");
    }
}

/// u = 1: every pixel is 1 up to what its few walks leave of 1 − v. Walks that find it are rare, so that a
/// pixel's own standard error from 50 of them says little; of the mean over all pixels, which are
/// independent and have 90,000 walks, it says all: 4 of them. And one colour: no pixel is off by more than
/// half a step of a scale of 256 colours that ends at 1.
#[test]
fn a_furnace_has_one_colour() {
    let folder = Folder::new();
    let args = ["--width", "60", "--walks", "50"];
    render(&folder, &furnace(), "a.csv", &args).quietly(0);
    let rows = rows(&folder, "a.csv");
    assert!(rows.len() > 1500, "{}", rows.len());
    let (mut sum, mut variance) = (0.0, 0.0);
    for row in &rows {
        let [x, y, seen, error] = row[..] else {
            panic!("{row:?}")
        };
        assert!((seen - 1.0).abs() < 0.5 / 256.0, "({x}, {y}): {seen}");
        sum += seen - 1.0;
        variance += if error.is_nan() { 0.0 } else { error * error };
    }
    // v may be 1 up to rounding, which is half a unit of the last place for a pixel and its twenty operations.
    let rounding = 10.0 * f64::EPSILON * rows.len() as f64;
    assert!(
        sum.abs() < 4.0 * variance.sqrt() + rounding,
        "{sum} {variance}"
    );
    let args = ["--width", "250", "--walks", "4", "--json"];
    let json = render(&folder, &furnace(), "a.png", &args)
        .quietly(0)
        .json();
    // In the room left of the baffle: the colours of 1 − 1/256 and above.
    let (width, _, pixels) = decode(&folder.path().join("a.png"));
    let [left, top] = origin(&json);
    for row in 5..25 {
        for column in 5..25 {
            let pixel = pixels[(top + row) * width + left + column];
            assert!(pixel[0] > 240 && pixel[1] > 240, "{row} {column} {pixel:?}");
        }
    }
}

/// A room of 290 K with one wall of 300 K: u is between 401 and 459 W/m², and the colours are of that. With one
/// temperature there is one colour, and the scale begins at 0.
#[test]
fn colours_are_of_what_is_seen() {
    let folder = Folder::new();
    let of = |lamp: &str| {
        let heat = BLACK
            .replace(
                "reflectance = 0\nemission = 1",
                &format!("emissivity = 0.9\ntemperature = {lamp}"),
            )
            .replace("reflectance = 0\n", "emissivity = 0.9\ntemperature = 290\n");
        let args = ["--width", "300", "--json"];
        let json = render(&folder, &heat, "a.svg", &args).quietly(0).json();
        let ends = [0, 1].map(|k| json["scale"][k].as_f64().unwrap());
        (ends, number(&json, "least"), number(&json, "largest"))
    };
    let ([low, high], least, largest) = of("300");
    assert!(400.0 < least && largest < 460.0, "{least} {largest}");
    assert!(least <= low && low < least + 3.0, "{low} {least}");
    assert!(largest - 10.0 < high && high <= largest, "{high} {largest}");
    let svg = std::fs::read_to_string(folder.path().join("a.svg")).unwrap();
    // No wall is below 290 K; the warm one is above all that is seen.
    assert!(
        svg.contains("walls go from 40") && svg.contains(">410<"),
        "{svg}"
    );
    let ([low, high], least, _) = of("290");
    assert!(low == 0.0 && high > least, "{low} {high} {least}");
}

/// The lamp's angle from a point behind the baffle, which takes what is below the line over its top; what
/// is black sends nothing back, so that no noise is left.
#[test]
fn a_shadow_is_where_it_should_be() {
    let folder = Folder::new();
    let args = ["--width", "60", "--walks", "3"];
    render(&folder, BLACK, "a.csv", &args).quietly(0);
    let (mut dark, mut half, mut lit) = (0, 0, 0);
    for row in rows(&folder, "a.csv") {
        let [x, y, seen, _] = row[..] else {
            panic!("{row:?}")
        };
        // Left of the block, which hides nothing there, in pixels that no wall goes through.
        if x > 1.55 {
            continue;
        }
        let lowest = if x < 1.0 {
            0.0
        } else {
            (0.5 - (y - 0.5) / (x - 1.0)).clamp(0.0, 1.0)
        };
        let exact = (f64::atan2(1.0 - y, x) - f64::atan2(lowest - y, x)) / core::f64::consts::TAU;
        assert!((seen - exact).abs() < 1e-12, "({x}, {y}): {seen} {exact}");
        let count = if lowest == 0.0 {
            &mut lit
        } else if lowest == 1.0 {
            &mut dark
        } else {
            &mut half
        };
        *count += 1;
    }
    assert!(dark > 50 && half > 50 && lit > 500, "{dark} {half} {lit}");
}

#[test]
fn what_is_no_room_is_blank() {
    let folder = Folder::new();
    let ran = render(
        &folder,
        &furnace(),
        "a.csv",
        &["--width", "60", "--walks", "1", "--json"],
    )
    .quietly(0);
    let json = ran.json();
    let rows = rows(&folder, "a.csv");
    // 60 by 30 pixels less 6 by 6 of the block, which pixels fit exactly.
    assert_eq!(rows.len(), 60 * 30 - 6 * 6);
    assert_eq!(number(&json, "inside"), rows.len() as f64);
    for row in &rows {
        let (x, y) = (row[0], row[1]);
        let in_block = (1.6..=1.8).contains(&x) && (0.6..=0.8).contains(&y);
        assert!((0.0..2.0).contains(&x) && (0.0..1.0).contains(&y) && !in_block);
    }
    // White in the picture: in the block's middle, and in the corner of the page.
    let args = ["--width", "400", "--walks", "1", "--json"];
    let json = render(&folder, &furnace(), "a.png", &args)
        .quietly(0)
        .json();
    let (width, _, pixels) = decode(&folder.path().join("a.png"));
    let [left, top] = origin(&json);
    // The room is 2 wide, with two pixels on either side.
    let scale = (number(&json, "width") - 4.0) / 2.0;
    let at = |x: f64, y: f64| {
        let [column, row] = [x, 1.0 - y].map(|x| (scale * x) as usize + 2);
        pixels[(top + row) * width + left + column]
    };
    assert_eq!(at(1.7, 0.7), [255; 3]);
    assert_eq!(pixels[0], [255; 3]);
    assert_ne!(at(1.5, 0.7), [255; 3]);
    assert_ne!(at(1.9, 0.7), [255; 3]);
}

#[test]
fn plain_walks_take_as_long_and_are_noisier() {
    let folder = Folder::new();
    let problem = furnace();
    let args = [
        "--width",
        "400",
        "--side-by-side",
        "--walks",
        "20",
        "--json",
    ];
    let json = render(&folder, &problem, "a.svg", &args).quietly(0).json();
    let of = |name: &str, key: &str| number(&json[name], key);
    assert!(of("plain", "walks") >= 1.0 && of("plain", "seconds") > 0.0);
    assert!(of("plain", "std_error") > 3.0 * of("preconditioned", "std_error"));
    let svg = std::fs::read_to_string(folder.path().join("a.svg")).unwrap();
    assert_svg(&folder.path().join("a.svg"));
    for word in ["plain: ", "preconditioned: 20 walks a pixel", "<image "] {
        assert!(svg.contains(word), "{word}");
    }
}

/// The mean radiant temperature is (u/σ)^¼ of what the picture of radiosities shows, from the same walks, and targets have marks.
#[test]
fn temperatures_and_targets_can_be_shown() {
    let folder = Folder::new();
    let heat = furnace().replace(
        "reflectance = 0.7\nemission = 0.3",
        "emissivity = 0.3\ntemperature = 300",
    );
    let heat = [0.8, 0.5, 0.1, 0.6]
        .iter()
        .enumerate()
        .fold(heat, |text, (i, emissivity)| {
            let rho = 1.0 - emissivity;
            let old = format!("reflectance = {rho:.1}\nemission = {emissivity:.1}");
            assert_eq!(text.matches(&old).count(), 1, "{old}");
            let own = format!("emissivity = {emissivity}\ntemperature = {}", 310 + 5 * i);
            text.replace(&old, &own)
        });
    let small = ["--width", "30"];
    let warm = [&small[..], &["--radiant-temperature"]].concat();
    render(&folder, &heat, "u.csv", &small).quietly(0);
    render(&folder, &heat, "t.csv", &warm).quietly(0);
    let head = std::fs::read_to_string(folder.path().join("t.csv")).unwrap();
    assert!(head.starts_with("x,y,mean_radiant_temperature,"), "{head}");
    let (all, kelvin) = (rows(&folder, "u.csv"), rows(&folder, "t.csv"));
    assert!(all.len() > 300 && all.len() == kelvin.len());
    for (u, t) in all.iter().zip(&kelvin) {
        let black = 5.670374419e-8 * t[2].powi(4);
        assert!(
            (black / u[2] - 1.0).abs() < 1e-12 && (290.0..330.0).contains(&t[2]),
            "{u:?} {t:?}"
        );
        // Du/u = 4 DT/T.
        assert!(
            (4.0 * t[3] / t[2] - u[3] / u[2]).abs() <= 1e-12 * u[3].abs(),
            "{u:?} {t:?}"
        );
    }
    let marked = format!(
        "{heat}[[target]]\nname = 'chair'\nat = [0.5, 0.4]\n[[target]]\nname = 'spot'\nat = {{ surface = 'lamp', t = 0.3 }}\n\
         [[target]]\nname = 'row'\ngrid = 4\nsurface = 'walls'\n"
    );
    let drawn = |more: &[&str]| {
        let args = [&["--width", "400", "--walks", "1"], more].concat();
        render(&folder, &marked, "a.svg", &args).quietly(0);
        std::fs::read_to_string(folder.path().join("a.svg")).unwrap()
    };
    let plain = drawn(&[]);
    assert!(!plain.contains("<circle") && !plain.contains(">chair<"));
    let svg = drawn(&["--targets", "--radiant-temperature"]);
    assert_eq!(svg.matches("<circle").count(), 2 + 4, "{svg}");
    for word in [">chair<", ">spot<", ">K<", "mean radiant temperature"] {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains(">row") && !svg.contains("W/m²"), "{svg}");
    refused(
        &render(&folder, BLACK, "a.png", &["--radiant-temperature"]),
        &["--radiant-temperature", "by temperature"],
    );
}

#[test]
fn refusals() {
    let folder = Folder::new();
    refused(
        &render(&folder, common::CIRCLE, "a.png", &[]),
        &["pictures are of rooms", "grid"],
    );
    refused(
        &render(&folder, BLACK, "a.jpg", &[]),
        &["a.jpg", ".png", ".svg", ".csv"],
    );
    refused(
        &render(&folder, BLACK, "no/folder/a.png", &[]),
        &["there is no folder"],
    );
    refused(
        &render(&folder, BLACK, "a.csv", &["--log"]),
        &["--log", "pictures"],
    );
    refused(
        &render(&folder, BLACK, "a.svg", &["--profile", "--log"]),
        &["--profile"],
    );
    // ρ²/(1 − q0) > 1: as `solve` has it.
    let bright = furnace().replace("reflectance = 0.9", "reflectance = 0.99");
    let bright = bright.replace("reflectance = 0.4", "reflectance = 0.99");
    let bright = bright.replace("reflectance = 0.7", "reflectance = 0.99");
    let bright = bright.replace("reflectance = 0.2", "reflectance = 0.99");
    let bright = bright.replace("reflectance = 0.5", "reflectance = 0.99");
    let bright = format!("{bright}[walk]\nabsorption = 0.3\n");
    refused(
        &render(&folder, &bright, "a.png", &[]),
        &["variance of a walk is infinite", "absorption"],
    );
    // Nothing was left behind.
    assert_eq!(folder.names(), ["problem.toml"]);
}

/// The room with walls that reflect.
fn grey() -> String {
    BLACK.replace("reflectance = 0\n", "reflectance = 0.4\n")
}

/// Pixels of a global estimate are those of walks of their own, within the error bars of both, and so are profiles.
#[test]
fn a_global_estimate_serves_all_pixels() {
    let folder = Folder::new();
    let both = |args: &[&str], own: &str, columns: [usize; 2]| {
        let mine = [&["--global"], args].concat();
        render(&folder, &grey(), "whole.csv", &mine).quietly(0);
        let theirs = [&["--walks", own], args].concat();
        render(&folder, &grey(), "own.csv", &theirs).quietly(0);
        let (mine, theirs) = (rows(&folder, "whole.csv"), rows(&folder, "own.csv"));
        assert_eq!(mine.len(), theirs.len());
        let [value, error] = columns;
        for (a, b) in mine.iter().zip(&theirs) {
            // 6 standard errors of some hundred walks, and what quadrature leaves.
            let allowed = 6.0 * a[error].hypot(b[error]) + 1e-4;
            assert!((a[value] - b[value]).abs() < allowed, "{a:?} {b:?}");
        }
        mine.len()
    };
    assert!(both(&["--width", "40"], "400", [2, 3]) > 600);
    assert!(both(&["--profile"], "500", [4, 5]) > 500);
}

#[test]
fn the_errors_of_a_global_estimate_are_a_picture() {
    let folder = Folder::new();
    let errors = folder.at("errors.png");
    let args = ["--global", "--width", "300", "--errors", &errors, "--json"];
    let json = render(&folder, &grey(), "a.png", &args).quietly(0).json();
    assert_eq!(
        (&json["whole"], &json["preconditioned"]["walks"]),
        (&true.into(), &8192.into())
    );
    assert!(
        number(&json["preconditioned"], "std_error") < 1e-3,
        "{json}"
    );
    let [picture, errors] = ["a.png", "errors.png"].map(|name| decode(&folder.path().join(name)));
    assert_eq!(picture.0, errors.0);
    assert!(picture.2 != errors.2);
    // The same bits again, whatever the number of threads.
    let again = ["--global", "--width", "300", "--threads", "1"];
    render(&folder, &grey(), "b.png", &again).quietly(0);
    let [a, b] = ["a.png", "b.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert!(a == b);
    let refused_with = |args: &[&str], word: &str| {
        refused(&render(&folder, &grey(), "c.png", args), &[word]);
    };
    refused_with(&["--global", "--side-by-side"], "--side-by-side");
    // Pixels with walks of their own have errors, too.
    let own = folder.at("own.png");
    render(
        &folder,
        &grey(),
        "d.png",
        &["--width", "300", "--walks", "4", "--errors", &own],
    )
    .quietly(0);
    assert_eq!(decode(own.as_ref()).0, picture.0);
    refused_with(&["--global", "--errors", "e.csv"], ".png or .svg");
    refused_with(&["--global", "--errors", "e.txt"], ".png or .svg");
}
