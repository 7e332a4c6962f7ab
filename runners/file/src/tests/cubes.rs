//! Files of cubes.

use super::*;

/// A file of a cube: its `[problem]`, what else it has before targets, and a target.
fn cube(problem: &str, rest: &str, target: &str) -> String {
    format!("[problem]\nkind = \"cube\"\n{problem}\n{rest}\n[[target]]\nname = \"a\"\n{target}\n")
}

#[test]
fn a_cube_in_every_spelling() {
    let of = |text: &str| {
        let file = good(text);
        let cube = file.problem.as_cube().cloned();
        cube.unwrap_or_else(|| panic!("{:?}", file.problem))
    };
    let plain = of(&cube(
        "dimension = 1\nkernel = 'x * y1'\nsource = '1'",
        "",
        "at = 0.5",
    ));
    assert_eq!(plain.dimension.value, 1);
    assert!(matches!(plain.kernel, KernelText::General(text) if text.value == "x * y1"));
    assert!(plain.integral.is_none() && plain.solution.is_none());
    let full = "dimension = 2\nkernel_factors = ['abs(x - y)', 'x < y ? x : y']\n\
                kernel_integral = ['0.5 * (y - x) * abs(y - x)', 'x < y ? x * y : y^2 / 2']\n\
                source = 'x1 + x2'\nsolution = 'pi'";
    let rest = "[galerkin]\ncells = 3\npairs = 'pointwise'\npoints = 5";
    for target in ["at = [0, 1]", "over = 'all'", "weight = 'x1 * exp(-x2)'"] {
        let full = of(&cube(full, rest, target));
        assert!(matches!(full.kernel, KernelText::Factors(texts) if texts.value.len() == 2));
    }
}

#[test]
fn what_cubes_refuse() {
    let problem = "dimension = 2\nkernel = 'x1 * y2'\nsource = 'x1'";
    let all = "over = 'all'";
    let of = |problem: &str| cube(problem, "", all);
    // Line 3 is the dimension, 4 the kernel, 5 the source.
    fails(
        &of("dimension = 7\nkernel = '1'\nsource = '1'"),
        3,
        13,
        "7",
        &["from 1 to 6"],
    );
    let kernel = |text: &str| of(&format!("dimension = 2\nkernel = {text}\nsource = '1'"));
    fails(
        &kernel("'x1 * (y1 + z)'"),
        4,
        22,
        "z",
        &["unknown name `z`", "x1 to x2 and y1 to y2"],
    );
    fails(&kernel("'x1 * y3'"), 4, 16, "y3", &["unknown name `y3`"]);
    fails(&kernel("'x1 * + '"), 4, 18, "'", &["unexpected end"]);
    fails(
        &kernel("'1 + foo(x1)'"),
        4,
        15,
        "foo",
        &["unknown function `foo`", "sqrt"],
    );
    fails(&kernel("'x1 y1'"), 4, 14, "y1", &["unexpected"]);
    // Where the file spells it with escapes, the whole string is shown.
    let escaped = r#""x1 \u002B z""#;
    fails(&kernel(escaped), 4, 10, escaped, &["unknown name `z`"]);
    fails(&kernel("3"), 4, 10, "3", &["`kernel` must be a string"]);
    fails(
        &of("dimension = 2\nkernel = '1'\nsource = 'y1'"),
        5,
        11,
        "y1",
        &["coordinates here are x1 to x2"],
    );
    fails(
        &of("dimension = 2\nkernel = '1'\nkernel_factors = ['1', '1']\nsource = '1'"),
        5,
        1,
        "kernel_factors",
        &["one of `kernel` and `kernel_factors`"],
    );
    fails(
        &of("dimension = 2\nsource = '1'"),
        1,
        1,
        "[problem]",
        &["`kernel`", "missing"],
    );
    fails(
        &of("dimension = 2\nkernel_factors = ['x * y']\nsource = '1'"),
        4,
        18,
        "['x * y']",
        &["2 formulas", "not 1"],
    );
    fails(
        &of("dimension = 2\nkernel_factors = ['x * y', 'x2']\nsource = '1'"),
        4,
        29,
        "x2",
        &["unknown name `x2`", "x and y"],
    );
    fails(
        &of(&format!("{problem}\nkernel_integral = 'x1'")),
        6,
        19,
        "'x1'",
        &["`kernel_factors`"],
    );
    fails(
        &of("dimension = 1\nkernel = '1'\nkernel_integral = ['y']\nsource = '1'"),
        5,
        19,
        "['y']",
        &["must be one formula"],
    );
    fails(
        &cube(problem, "[galerkin]\npairs = 'pointwise'", all),
        7,
        9,
        "'pointwise'",
        &["`kernel_integral`"],
    );
    fails(
        &cube(problem, "[galerkin]\npoints = 6", all),
        7,
        10,
        "6",
        &["from 1 to 5"],
    );
    let target = |what: &str| cube(problem, "", what);
    fails(&target("at = 0.5"), 9, 6, "0.5", &["2 coordinates"]);
    fails(&target("at = [0.5, 1.5]"), 9, 12, "1.5", &["from 0 to 1"]);
    fails(&target("over = [0, 1]"), 9, 9, "0", &["weight"]);
    fails(&target("grid = 3"), 9, 8, "3", &["[3, 3]"]);
    fails(&target("grid = [3, 0]"), 9, 12, "0", &["from 1 to"]);
    fails(
        &target("grid = [3]"),
        9,
        8,
        "[3]",
        &["2 numbers of points", "not 1"],
    );
    fails(
        &target("grid = [500, 500]"),
        9,
        8,
        "[500, 500]",
        &["100000 points in all"],
    );
    fails(
        &target("at = 'none.csv'"),
        9,
        6,
        "'none.csv'",
        &["cannot read none.csv"],
    );
    fails(&target("weight = 'x'"), 9, 11, "x", &["unknown name `x`"]);
    // And what circles do not have.
    let text = small(PROBLEM, "points = 2", "", TARGET);
    fails(&text, 6, 10, "2", &["`points` belongs to cubes"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nweight = 'x'");
    fails(&text, 11, 10, "'x'", &["`weight` belongs to cubes"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nat = [1, 2]");
    fails(&text, 11, 6, "[1, 2]", &["one angle"]);
}

#[test]
fn what_domains_refuse() {
    let of = |domain: &str, target: &str| {
        let problem =
            format!("dimension = 2\ndomain = {domain}\nkernel = 'x1 * y2'\nsource = 'x1'");
        cube(&problem, "", target)
    };
    let all = "over = 'all'";
    let file = good(&of("[[-1, 1], [0, 3.5]]", "at = [-1, 3.5]"));
    let domain = file.problem.as_cube().and_then(|cube| cube.domain.clone());
    assert!(domain.is_some_and(|domain| domain.value[1].value == [0.0, 3.5]));
    fails(
        &of("[-1, 1]", all),
        4,
        10,
        "[-1, 1]",
        &["2 intervals", "not 1"],
    );
    fails(&of("[[0, 1], [0]]", all), 4, 19, "[0]", &["two numbers"]);
    fails(
        &of("[[0, 1], [2, 1]]", all),
        4,
        19,
        "[2, 1]",
        &["the lower end first"],
    );
    fails(
        &of("[[0, 1], [2, 2]]", all),
        4,
        19,
        "[2, 2]",
        &["the lower end first"],
    );
    fails(
        &of("[[0, 1], 'a']", all),
        4,
        19,
        "'a'",
        &["`domain[1]` must be"],
    );
    let outside = of("[[-1, 1], [0, 3.5]]", "at = [-1, 4]");
    fails(&outside, 10, 11, "4", &["from 0 to 3.5"]);
}
