//! `fredholm rates` against theory.

use crate::common;

use common::{Folder, assert_svg, csv_rows, example, fredholm, is_long, list, number};

/// The product of |x_a − y_a| over d axes, of smoothness r = 1: ∫|K| ≤ 2^-d, u = Π x_a.
fn distance(dimension: usize, scale: f64) -> String {
    let product = |factor: &dyn Fn(&str) -> String| {
        let axes = 1..=dimension;
        let factors: Vec<String> = axes.map(|a| factor(&a.to_string())).collect();
        factors.join(" * ")
    };
    let kernel = product(&|a| format!("abs(x{a} - y{a})"));
    let solution = product(&|a| format!("x{a}"));
    let image = product(&|a| format!("(x{a}^3 / 3 - x{a} / 2 + 1 / 3)"));
    format!(
        "[problem]\nkind = 'cube'\ndimension = {dimension}\nkernel = '{kernel} / {scale}'\n\
         source = '{solution} - {image} / {scale}'\nsolution = '{solution}'\n\
         [[target]]\nname = 'mean'\nover = 'all'\n"
    )
}

/// Along N = n² with smoothness r = 1 the error falls like cost^(−1/(2d) − 1/2), and √Var like
/// n^(−1/d) (Heinrich and Mathé 1993): within 15 %. By day from 16,384 walks on every level, which know √Var to two per cent; with
/// `FREDHOLM_LONG=1` from as many as are made unasked, millions on the finest.
#[test]
fn the_error_falls_as_theory_says() {
    let walks: &[&str] = if is_long() {
        &[]
    } else {
        &["--walks", "16384"]
    };
    for (dimension, scale) in [(1, 0.75), (2, 0.4), (3, 0.2)] {
        let folder = Folder::new();
        let file = folder.file("rates.toml", distance(dimension, scale));
        let out = folder.at("out");
        let options = ["rates", &file, "--json", "--out", &out];
        let ran = fredholm(&[&options, walks].concat()).quietly(0);
        let json = ran.json();
        let fits = &json["fits"];
        let d = dimension as f64;
        for (key, theory) in [("std_dev", -1.0 / d), ("error", -0.5 / d - 0.5)] {
            let fitted = number(fits, key);
            println!("d = {dimension}, {key}: {fitted:.3}, theory {theory:.3}");
            assert_eq!(number(fits, &format!("{key}_theory")), theory);
            assert!(
                (fitted / theory - 1.0).abs() < 0.15,
                "d = {dimension}: {fits}"
            );
        }
        assert!((number(&json, "mean") - 0.5_f64.powi(dimension as i32)).abs() < 1e-12);
        // What the picture shows: plain walks lose everywhere but at the start; deterministic methods win
        // in one dimension and lose in three.
        let rows = list(&json, "rows");
        let last = rows.last().unwrap();
        assert!(number(last, "error") < 0.2 * number(last, "error_plain"));
        let nystrom = list(&json, "nystrom").last().unwrap();
        assert!(number(nystrom, "evaluations") < number(last, "evaluations"));
        let better = number(nystrom, "error") < number(last, "error");
        assert_eq!(better, dimension == 1, "{nystrom} {last}");
        assert_eq!(
            common::names(out.as_ref()),
            ["deviation.svg", "rates.csv", "rates.json", "work-error.svg"]
        );
        for picture in ["deviation.svg", "work-error.svg"] {
            assert_svg(format!("{out}/{picture}").as_ref());
        }
        let table = csv_rows(format!("{out}/rates.csv").as_ref());
        assert_eq!(table.len(), rows.len() + 1);
        assert_eq!(
            std::fs::read_to_string(format!("{out}/rates.json")).unwrap(),
            ran.stdout
        );
    }
}

#[test]
fn a_product_kernel_pays_nothing_for_its_set_up() {
    let problem = "[problem]\nkind = 'cube'\ndimension = 2\n\
                   kernel_factors = ['0.5 * exp(-(x - y)^2)', 'exp(-(x - y)^2)']\nsource = '1'\n\
                   [[target]]\nname = 'mean'\nover = 'all'\n";
    let folder = Folder::new();
    let file = folder.file("rates.toml", problem);
    let on = |threads| {
        let args = ["rates", &file, "--json", "--walks", "20000"];
        fredholm(&[&args[..], &["--threads", threads]].concat()).quietly(0)
    };
    let one = on("1");
    let json = one.json();
    let last = list(&json, "rows").last().unwrap();
    assert_eq!(number(last, "setup_evaluations"), 1024.0);
    // No solution is given: the finest level is the reference, and has an error bar.
    assert!(number(&json, "mean_std_error") > 0.0);
    assert!(last["error_galerkin"].is_null() || number(last, "error_galerkin") > 0.0);
    assert_eq!(one.stdout, on("2").stdout);
}

#[test]
fn a_circle_has_rates_too() {
    let folder = Folder::new();
    let file = folder.file("circle.toml", common::CIRCLE);
    let rates = ["rates", &file, "--walks", "20000"];
    let ran = fredholm(&rates).quietly(0);
    for word in [
        "circle, degree 0",
        "(exact)",
        "fitted exponents",
        "theory -1.000",
    ] {
        assert!(ran.stdout.contains(word), "{word}: {}", ran.stdout);
    }
    let other = fredholm(&[&rates[..], &["--json", "--seed", "2"]].concat());
    let json = other.quietly(0).json();
    let fitted = number(&json["fits"], "std_dev");
    assert!((fitted + 1.0).abs() < 0.15, "{fitted}");
    assert_eq!(number(&json, "seed"), 2.0);
    assert!(list(&json, "nystrom").is_empty());
}

/// The table of rooms: levels, pairs and grading are what is asked for, work is in seconds. What needs no slope is asked of fewer
/// levels by day.
#[test]
fn rooms_have_rates_by_the_clock() {
    let folder = Folder::new();
    let example = example("facet.toml");
    let (all, few) = if is_long() {
        ("400,100,200,100", "400,100,200,100")
    } else {
        ("200,50,100,50", "50,100")
    };
    let rates = |levels: &str, args: &[&str]| {
        let command = ["rates", &example, "--cells", levels, "--walks", "20000"];
        fredholm(&[&command, args].concat())
    };
    let out = folder.at("out");
    let ran = rates(all, &["--json", "--out", &out]).quietly(0);
    let json = ran.json();
    let rows = list(&json, "rows");
    let cells: Vec<f64> = rows.iter().map(|row| number(row, "cells")).collect();
    let least = if is_long() { 100.0 } else { 50.0 };
    assert_eq!(cells, [least, 2.0 * least, 4.0 * least]);
    for row in rows {
        let n = number(row, "unknowns");
        assert_eq!(number(row, "walks"), n * n);
        let error = number(row, "error");
        assert!((error / (number(row, "std_dev") / n) - 1.0).abs() < 1e-12);
        assert!(row["evaluations"].is_null() && row["error_plain"].is_null());
        assert!(number(row, "seconds") > number(row, "setup_seconds"));
        assert!(number(row, "error_plain_in_seconds") > error);
    }
    // n⁻¹, within what 20,000 walks and a factor of four leave.
    let slope = number(&json["fits"], "std_dev");
    assert!((slope + 1.0).abs() < 0.2, "{slope}");
    let work = std::fs::read_to_string(format!("{out}/work-error.svg")).unwrap();
    assert!(work.contains("seconds, set-up included"));
    let on = |threads| rates(few, &["--json", "--threads", threads]).quietly(0);
    assert_eq!(on("1").timeless(), on("2").timeless());
    // Cells are what is asked for.
    let equal = rates(few, &["--grading", "1", "--json"]).quietly(0).json();
    let first = |json: &serde_json::Value| number(&list(json, "rows")[0], "std_dev");
    assert_ne!(first(&equal), first(&on("1").json()), "{equal}");
    let text = rates(few, &["--pairs", "pointwise"]).quietly(0).stdout;
    for word in [
        "pointwise pairs",
        "seconds^",
        "ratio",
        "gain",
        "from a tenth",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    for (args, word) in [
        (["--cells", "0"], "`--cells 0`"),
        (["--cells", "100000000"], "GB of memory"),
        (["--grading", "0.5"], "`--grading 0.5`"),
        (["--walks", "1"], "--walks"),
    ] {
        common::refused(
            &fredholm(&[&["rates", example.as_str()], &args[..]].concat()),
            &[word],
        );
    }
    let circle = folder.file("circle.toml", common::CIRCLE);
    common::refused(
        &fredholm(&["rates", &circle, "--shadow-cuts"]),
        &["`shadow_cuts` belongs to rooms"],
    );
}

/// Several degrees go into one table and one figure, and the clock compares them.
#[test]
fn degrees_side_by_side() {
    let folder = Folder::new();
    let file = example("circle.toml");
    let out = folder.at("out");
    let rates = |args: &[&str]| {
        let command = ["rates", &file, "--cells", "40,80,160", "--walks", "20000"];
        fredholm(&[&command, args].concat())
    };
    let ran = rates(&["--degree", "2,0,1,0", "--json", "--out", &out]).quietly(0);
    let json = ran.json();
    let sweeps = list(&json, "sweeps");
    let degrees: Vec<f64> = sweeps.iter().map(|s| number(s, "degree")).collect();
    assert_eq!(degrees, [0.0, 1.0, 2.0]);
    let mut before = f64::INFINITY;
    for (sweep, degree) in sweeps.iter().zip(degrees) {
        let slope = number(&sweep["fits"], "std_dev");
        assert!(
            (slope / -(degree + 1.0) - 1.0).abs() < 0.15,
            "{degree}: {slope}"
        );
        let rows = list(sweep, "rows");
        for row in rows {
            assert_eq!(number(row, "degree"), degree);
            assert_eq!(
                number(row, "unknowns"),
                number(row, "cells") * (degree + 1.0)
            );
            assert!(row["evaluations"].is_null());
            assert!(number(row, "seconds") > number(row, "setup_seconds"));
            assert!(number(row, "rounding_floor") > 0.0);
        }
        // The least error of 10 s is that of the best level, and the best level is the finest: its
        // deviation is half that of the next at most, while its walks take hardly longer.
        let all = list(&json, "equal_time").iter();
        let mut of_degree = all.filter(|l| number(l, "degree") == degree);
        let least = of_degree.find(|l| number(l, "seconds") == 10.0).unwrap();
        let finest = rows.last().unwrap();
        assert_eq!(number(least, "unknowns"), number(finest, "unknowns"));
        let setup = number(finest, "setup_seconds");
        let walk = (number(finest, "seconds") - setup) / number(finest, "walks");
        let expected = number(finest, "std_dev") * (walk / (10.0 - setup)).sqrt();
        let error = number(least, "error");
        assert!((error / expected - 1.0).abs() < 1e-12, "{error} {expected}");
        // On 160 cells a degree more reduces the deviation 20 times and more, and triples the time of a
        // walk at most.
        assert!(error < 0.2 * before, "{degree}: {error} {before}");
        before = error;
    }
    let table = csv_rows(format!("{out}/rates.csv").as_ref());
    assert_eq!(table.len(), 1 + 9);
    for (picture, words) in [
        ("work-error.svg", "seconds, set-up included"),
        ("deviation.svg", "unknowns n"),
    ] {
        let picture = format!("{out}/{picture}");
        assert_svg(picture.as_ref());
        let text = std::fs::read_to_string(picture).unwrap();
        for word in [words, "degree 0", "degree 1", "degree 2", "plain"] {
            assert!(text.contains(word), "{word}");
        }
    }
    let text = rates(&["--degree", "0,1"]).quietly(0).stdout;
    for word in ["the least error", "10 s", "(n = 320)", "error ~ seconds^"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    // One degree is one sweep, whose work is in evaluations; no degree is left out in silence.
    let one = rates(&["--degree", "1", "--json"]).quietly(0).json();
    assert_eq!(number(&one, "degree"), 1.0);
    assert!(number(&list(&one, "rows")[0], "evaluations") > 0.0);
    common::refused(&rates(&["--degree", "0,5"]), &["--degree 5"]);
    // A cube, whose own mean is not known.
    let gauss = example("gauss.toml");
    let command = ["rates", &gauss, "--cells", "1,2,4", "--walks", "20000"];
    let ran = fredholm(&[&command[..], &["--degree", "0,2", "--json"]].concat());
    let json = ran.quietly(0).json();
    let fine = |sweep: &serde_json::Value| number(list(sweep, "rows").last().unwrap(), "std_dev");
    let [constant, quadratic] = list(&json, "sweeps") else {
        panic!("two degrees: {json}")
    };
    // (p + 1)/2 halvings for each of two steps to half the width, and what a smooth kernel gives besides.
    assert!(fine(quadratic) < fine(constant) / 16.0);
    assert!(list(quadratic, "nystrom").is_empty());
}
