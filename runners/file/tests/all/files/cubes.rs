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
        let cube = file.problem.of::<kinds::Cube>().cloned();
        cube.unwrap_or_else(|| panic!("{:?}", file.problem))
    };
    let plain = of(&cube(
        "dimension = 1\nkernel = 'x * y1'\nsource = '1'",
        "",
        "at = 0.5",
    ));
    assert_eq!(plain.space.dimension.value, 1);
    assert!(matches!(plain.kernel, KernelText::General(text) if text.value == "x * y1"));
    assert!(plain.solution.is_none());
    let full = "dimension = 2\nkernel_factors = ['abs(x - y)', 'x < y ? x : y']\n\
                source = 'x1 + x2'\nsolution = 'pi'";
    let rest = "[galerkin]\ncells = 3\npairs = 'paper'\npoints = 5";
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
        &of("dimension = «7»\nkernel = '1'\nsource = '1'"),
        &["from 1 to 6"],
    );
    let kernel = |text: &str| of(&format!("dimension = 2\nkernel = {text}\nsource = '1'"));
    fails(
        &kernel("'x1 * (y1 + «z»)'"),
        &["unknown name `z`", "x1 to x2 and y1 to y2"],
    );
    fails(&kernel("'x1 * «y3»'"), &["unknown name `y3`"]);
    fails(&kernel("'x1 * + «'»"), &["unexpected end"]);
    fails(
        &kernel("'1 + «foo»(x1)'"),
        &["unknown function `foo`", "sqrt"],
    );
    fails(&kernel("'x1 «y1»'"), &["unexpected"]);
    // Where the file spells it with escapes, the whole string is shown.
    let escaped = r#"«"x1 \u002B z"»"#;
    fails(&kernel(escaped), &["unknown name `z`"]);
    fails(&kernel("«3»"), &["`kernel` must be a string"]);
    fails(
        &of("dimension = 2\nkernel = '1'\nsource = '«y1»'"),
        &["coordinates here are x1 to x2"],
    );
    fails(
        &of("dimension = 2\nkernel = '1'\n«kernel_factors» = ['1', '1']\nsource = '1'"),
        &["one of `kernel` and `kernel_factors`"],
    );
    let none = of("dimension = 2\nsource = '1'").replace("[problem]", "«[problem]»");
    fails(&none, &["`kernel`", "missing"]);
    fails(
        &of("dimension = 2\nkernel_factors = «['x * y']»\nsource = '1'"),
        &["2 formulas", "not 1"],
    );
    fails(
        &of("dimension = 2\nkernel_factors = ['x * y', '«x2»']\nsource = '1'"),
        &["unknown name `x2`", "x and y"],
    );
    fails(
        &cube(problem, "[galerkin]\npairs = «'pointwise'»", all),
        &["a cube has none"],
    );
    fails(
        &cube(problem, "[galerkin]\npoints = «6»", all),
        &["from 1 to 5"],
    );
    let target = |what: &str| cube(problem, "", what);
    fails(&target("at = «0.5»"), &["2 coordinates"]);
    fails(&target("at = [0.5, «1.5»]"), &["from 0 to 1"]);
    fails(&target("over = [«0», 1]"), &["weight"]);
    fails(&target("grid = «3»"), &["[3, 3]"]);
    fails(&target("grid = [3, «0»]"), &["from 1 to"]);
    fails(&target("grid = «[3]»"), &["2 numbers of points", "not 1"]);
    fails(&target("grid = «[500, 500]»"), &["100000 points in all"]);
    fails(&target("at = «'none.csv'»"), &["cannot read none.csv"]);
    fails(&target("weight = '«x»'"), &["unknown name `x`"]);
    // And what circles do not have.
    let text = small(PROBLEM, "points = «2»", "", TARGET);
    fails(&text, &["`points` belongs to cubes"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nweight = «'x'»");
    fails(&text, &["`weight` belongs to cubes"]);
    let text = small(PROBLEM, "", "", "name = 'a'\nat = «[1, 2]»");
    fails(&text, &["one angle"]);
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
    let domain = file
        .problem
        .of::<kinds::Cube>()
        .and_then(|cube| cube.space.domain.clone());
    assert!(domain.is_some_and(|domain| domain.value[1].value == [0.0, 3.5]));
    fails(&of("«[-1, 1]»", all), &["2 intervals", "not 1"]);
    fails(&of("[[0, 1], «[0]»]", all), &["two numbers"]);
    fails(&of("[[0, 1], «[2, 1]»]", all), &["the lower end first"]);
    fails(&of("[[0, 1], «[2, 2]»]", all), &["the lower end first"]);
    fails(&of("[[0, 1], «'a'»]", all), &["`domain[1]` must be"]);
    let outside = of("[[-1, 1], [0, 3.5]]", "at = [-1, «4»]");
    fails(&outside, &["from 0 to 3.5"]);
}

/// Messages of formulas with their places in the file; the others are tested where they are made.
#[test]
fn formulas_show_what_is_wrong_in_the_file() {
    let kernel = |text: &str| {
        let problem = format!("dimension = 1\nkernel = '{text}'\nsource = '1'");
        cube(&problem, "", "at = 0.5")
    };
    for (text, words) in [
        ("0.5*«sin» x", "write sin(x)"),
        ("0.5*exp«(»-(x-y)", "not closed"),
        ("«if» x<y then 1 else 0", "`condition ? a : b`"),
        ("|x|² + «Exp»(y)", "write exp"),
    ] {
        fails(&kernel(text), &[words]);
    }
    for text in ["(x-y)²", "|x-y|", "0.3·|x − y|³"] {
        good(&kernel(text));
    }
}

#[test]
fn parameters_are_numbers_with_names() {
    let of = |parameters: &str, target: &str| {
        let problem = "dimension = 1\ndomain = [['-L', 'L']]\nkernel = 'a * exp(-k*|x - y|)'\n\
                       source = 'a'\nsolution = 'k*x'";
        cube(
            &format!("{problem}\n[problem.parameters]\n{parameters}"),
            "",
            target,
        )
    };
    let all = "tau = 2\na = 0.25\nk = 'pi/tau'\nL = '2*k'";
    let weight = "weight = 'x < tau ? k*x : 0'";
    let file = good(&of(all, weight));
    let cube = file.problem.of::<kinds::Cube>().cloned().unwrap();
    let values: Vec<f64> = cube
        .space
        .parameters
        .value
        .iter()
        .map(|own| own.value)
        .collect();
    let pi = core::f64::consts::PI;
    assert_eq!(values, [2.0, 0.25, pi / 2.0, pi]);
    assert_eq!(cube.space.domain.unwrap().value[0].value, [-pi, pi]);
    assert!(file.remarks().is_empty(), "{:?}", file.remarks());
    let unused = good(&of(&all.replace("k = ", "kk = 1\nk = "), weight));
    assert!(unused.remarks()[0].contains("no formula has the parameter `kk`"));
    let bad = |from: &str, to: &str, words: &str| {
        fails(&of(&all.replacen(from, to, 1), weight), &[words]);
    };
    bad("tau", "«sin»", "`sin` is a function of formulas");
    bad("tau", "«E1»", "`E1` is a function of formulas");
    bad("tau", "«x2»", "`x2` is a coordinate");
    bad("tau", "«pi»", "`pi` is a constant");
    bad("tau", "«1a»", "no digit first");
    bad("tau = 2", "tau = «[2]»", "`tau` must be a number");
    bad("tau = 2", "tau = «nan»", "finite");
    bad("tau = 2", "tau = '«1/0»'", "this is inf");
    let words = "unknown name `k`; there are no coordinates here";
    bad("tau = 2", "tau = '2*«k»'", words);
    let unknown = of(&all.replace("a = 0.25", "b = 1"), weight).replacen("'a *", "'«a» *", 1);
    fails(&unknown, &["the parameters tau, b, k, L"]);
    let wrong = of(all, "at = «4»");
    fails(&wrong, &["from -3.14159"]);
}

#[test]
fn domains_have_infinite_ends() {
    let of = |domain: &str, target: &str| {
        let problem =
            format!("dimension = 2\ndomain = {domain}\nkernel = 'exp(-x1*x1 - y2)'\nsource = 'x1'");
        cube(&problem, "", target)
    };
    let weight = "weight = 'exp(-x1*x1 - x2)'";
    for domain in ["[[-inf, inf], [0, inf]]", "[[-inf, 3], ['2-1', +inf]]"] {
        good(&of(domain, weight));
        good(&of(domain, "at = [-1e6, 2]"));
    }
    let half = "[[0, 1], [0, inf]]";
    for second in ["[inf, 0]", "[inf, inf]", "[-inf, -inf]"] {
        let domain = format!("[[0, 1], «{second}»]");
        fails(&of(&domain, weight), &["the lower end first"]);
    }
    fails(&of("[[0, 1], [0, «nan»]]", weight), &["finite"]);
    fails(&of("[[0, 1], [0, '«a»']]", weight), &["unknown name `a`"]);
    fails(&of(half, "at = [0.5, «-1»]"), &["from 0 to inf"]);
    fails(&of(half, "at = [0.5, «inf»]"), &["finite"]);
    fails(&of(half, "grid = [3, «4»]"), &["no equally spaced points"]);
    let single = of("[[0, 1], «[-1e300, inf]»]", weight) + "[walk]\nscalar = 'f32'\n";
    fails(&single, &["too long for the scalar"]);
    let mean = file_error(&of(half, "over = 'all'"));
    assert!(mean.contains("an infinite domain has no mean"), "{mean}");
}

/// What the model says to the targets of a good file.
fn file_error(text: &str) -> String {
    let resolved = good(text).resolve().unwrap();
    let model = resolved.model.model();
    let goals = fredholm::goals(model, &resolved.targets).unwrap();
    model.check_goals(&goals).unwrap_err().to_string()
}

/// Edges are in coordinates, one list for each axis, and for resolvent walks alone.
#[test]
fn edges_end_cells() {
    let file = |edges: &str, method: &str| {
        format!(
            "[problem]\nkind = 'cube'\ndimension = 1\ndomain = [[0, 2]]\nedges = {edges}\nkernel = '0'\n\
             source = 'x < 0.002 ? 3 : 1'\n[walk]\n{method}\n[[target]]\nname = 'mean'\nover = 'all'\n"
        )
    };
    for edges in ["[0.002]", "[[0.002]]"] {
        let resolved = good(&file(edges, "walks = 1000")).resolve().unwrap();
        let model = resolved.model.model();
        let report = fredholm::Solver::with(model, resolved.settings.clone(), Vec::new()).mean();
        let value = report.solve().unwrap()[0].value();
        assert!((value - 1.002).abs() < 1e-12, "{value}");
    }
    fails(&file("[«2»]", ""), &["between 0 and 2"]);
    fails(&file("«[[1], [1]]»", ""), &["1 lists"]);
    fails(&file("['«a»']", ""), &["unknown name"]);
    fails(&file("[1]", "method = «'walks'»"), &["`edges`"]);
}
