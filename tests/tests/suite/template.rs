//! The template builds as a copy outside the workspace, and the mistakes that its users make first
//! are answered as the guide shows.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A copy of the template outside the workspace, with the versions of the workspace.
struct Copy {
    folder: PathBuf,
}

impl Copy {
    /// With these files of the template, besides those that every copy has.
    fn new(name: &str, more: &[&str]) -> Self {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = here.parent().unwrap();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let files = ["Cargo.toml", "src/lib.rs", "tests/conformance.rs"];
        for file in files.iter().chain(more) {
            let to = folder.join(file);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::copy(here.join("template").join(file), to).unwrap();
        }
        let copy = Self { folder };
        // The empty table says that no workspace is around it, as the test's folder lies in one.
        copy.edit("Cargo.toml", |text| {
            text.replace("../../", &format!("{}/", root.display())) + "\n[workspace]\n"
        });
        if more.is_empty() {
            // Nothing solves the equation, and the library takes its time to compile.
            copy.edit("Cargo.toml", |text| {
                let lines = text.lines().filter(|line| !line.starts_with("fredholm ="));
                lines.map(|line| line.to_owned() + "\n").collect()
            });
        }
        fs::copy(root.join("Cargo.lock"), copy.folder.join("Cargo.lock")).unwrap();
        copy
    }

    /// Changes a file; returns what it held.
    fn edit(&self, file: &str, change: impl FnOnce(&str) -> String) -> String {
        let path = self.folder.join(file);
        let before = fs::read_to_string(&path).unwrap();
        let after = change(&before);
        assert_ne!(before, after, "{file} is not changed");
        fs::write(path, after).unwrap();
        before
    }

    /// What rustc says of it.
    fn check(&self) -> Result<(), String> {
        self.cargo(&["check", "--tests"])
    }

    /// What cargo says if it fails.
    fn cargo(&self, command: &[&str]) -> Result<(), String> {
        let output = Command::new(env!("CARGO"))
            .args(command)
            .args(["--quiet", "--offline", "--color=never"])
            .arg("--target-dir")
            .arg(self.folder.join("target"))
            .current_dir(&self.folder)
            .output()
            .unwrap();
        if output.status.success() {
            Ok(())
        } else {
            Err(String::from_utf8(output.stderr).unwrap())
        }
    }
}

/// The equation without this trait.
fn without(name: &str) -> impl Fn(&str) -> String {
    let start = format!("impl<F: Real> {name} for MyEquation<F> {{\n");
    move |text| {
        let (before, rest) = text.split_once(&start).unwrap();
        let (_, after) = rest.split_once("\n}\n").unwrap();
        // With its documentation.
        let (before, _) = before.rsplit_once("///").unwrap();
        format!("{before}{after}")
    }
}

/// The error of this code that the guide shows, as the lines that do not depend on where the copy
/// stands: the error, its label, and our notes.
fn shown(first: &str) -> Vec<&'static str> {
    let (_, rest) = include_str!("../../conformance/README.md")
        .split_once(first)
        .unwrap();
    let (block, _) = rest.split_once("```").unwrap();
    let lines = block.lines().map(str::trim);
    lines
        .filter(|line| line.contains("^^^") || line.contains("= note:"))
        .collect()
}

/// Whether the guide shows what rustc says of a mistake.
fn is_shown(said: &str, first: &str) {
    let expected = shown(first);
    assert!(!expected.is_empty(), "the guide shows nothing of {first}");
    for line in expected.into_iter().chain([first]) {
        let found = said.lines().any(|other| other.trim() == line);
        assert!(found, "the guide shows\n{line}\nbut rustc says\n{said}");
    }
}

/// All of it, with its tests and the program that solves the equation; with `FREDHOLM_LONG=1`.
#[test]
fn a_copy_passes_its_tests_and_solves() {
    if !fredholm_tests::check::long() {
        return;
    }
    let copy = Copy::new(
        "my-solved-equation",
        &["examples/solve.rs", "tests/solve.rs"],
    );
    for command in [&["test"][..], &["run", "--example", "solve"]] {
        copy.cargo(command).unwrap_or_else(|said| panic!("{said}"));
    }
}

/// Published packages, each with its version: without the paths a copy builds from the registry.
#[test]
fn the_template_depends_on_published_packages_alone() {
    let manifest = include_str!("../../template/Cargo.toml");
    let dependencies = manifest.lines().filter(|line| line.starts_with("fredholm"));
    for line in dependencies {
        let (name, _) = line.split_once(' ').unwrap();
        assert!(line.contains("version = "), "{line}");
        let release = include_str!("../../../.ci/release");
        let (_, packages) = release.split_once("packages=(fredholm fredholm-{").unwrap();
        let (packages, _) = packages.split_once('}').unwrap();
        let published = name == "fredholm"
            || packages
                .split(',')
                .any(|one| name == format!("fredholm-{one}"));
        assert!(published, "{name} is not published");
    }
}

#[test]
fn the_guide_shows_the_program_of_the_template() {
    let program = include_str!("../../template/examples/solve.rs");
    let (_, program) = program.split_once('\n').unwrap();
    assert!(include_str!("../../conformance/README.md").contains(program));
}

#[test]
fn a_copy_builds_and_likely_mistakes_are_answered_as_the_guide_shows() {
    let copy = Copy::new("my-equation", &[]);
    copy.check().unwrap_or_else(|said| panic!("{said}"));

    let equation = without("Equation");
    let moments = without("TransitionMoments");
    let integral = without("PairIntegral");
    let narrow = |text: &str| text.replace("&Described::<f32>", "&Described::<f64>");
    // One without which the crate itself is none, and three that its tests show, all at once.
    let right = copy.edit("src/lib.rs", equation);
    let said = copy.check().expect_err("a mistake");
    is_shown(
        &said,
        "error[E0277]: `MyEquation<F>` is a chain without an equation",
    );
    fs::write(copy.folder.join("src/lib.rs"), right).unwrap();
    copy.edit("src/lib.rs", |text| moments(&integral(text)));
    copy.edit("tests/conformance.rs", narrow);
    let said = copy.check().expect_err("three mistakes");
    for first in [
        "error[E0277]: `MyEquation<F>` does not say how probable a step into a cell is",
        "error[E0277]: `MyEquation<F>` has no exact integrals for pointwise pairs",
        "error[E0271]: type mismatch resolving `<MyEquation<f64> as Space>::Scalar == f32`",
    ] {
        is_shown(&said, first);
    }
}
