//! The rules of the architecture: small traits, short signatures, who imports whom.
//! `cargo test -p fredholm-tests --test suite house -- --nocapture` prints the tables.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The most methods of a trait, and the traits that have more: how many, which may not grow.
const METHODS: usize = 12;
const MORE_METHODS: [(&str, usize); 4] = [
    ("Model", 31),
    ("Partitioned", 14),
    ("RadiativeExchange", 19),
    ("Real", 18),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The files of Rust below a folder of the project; tables that are written by a program are not read.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() && !["target", "tables", ".git", ".venv"].contains(&&*name) {
            found.extend(sources(&path));
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The folders of the packages of the workspace and beside it.
fn packages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root()];
    while let Some(folder) = open.pop() {
        let entries = fs::read_dir(&folder).into_iter().flatten().flatten();
        for path in entries.map(|entry| entry.path()) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() && !["target", "src", "docs", ".git", ".venv"].contains(&&*name) {
                if path.join("src/lib.rs").exists() || path.join("src/main.rs").exists() {
                    found.push(path.clone());
                }
                open.push(path);
            }
        }
    }
    found.sort();
    found
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn shown(path: &Path) -> String {
    let path = path.strip_prefix(root()).unwrap_or(path);
    path.display().to_string()
}

/// Lines that are neither empty nor comments.
fn code(text: &str) -> usize {
    let lines = text.lines().map(str::trim);
    lines
        .filter(|line| !line.is_empty() && !line.starts_with("//"))
        .count()
}

#[test]
fn packages_have_so_many_lines() {
    println!("lines of code of each package, without comments");
    for package in packages() {
        let all = sources(&package.join("src"));
        let lines: usize = all.iter().map(|path| code(&text(path))).sum();
        println!("{lines:7}  {}", shown(&package));
    }
}

/// The text of the part in brackets that begins here, without them.
fn within(text: &str, [open, close]: [char; 2]) -> &str {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        depth += i32::from(c == open) - i32::from(c == close);
        if depth == 0 && c == close {
            return &text[1..at];
        }
    }
    ""
}

/// What is declared as `start` name `…{`: the names, and the bodies.
fn declared<'t>(text: &'t str, start: &'t str) -> impl Iterator<Item = (&'t str, &'t str)> {
    text.match_indices(start).filter_map(move |(at, _)| {
        let rest = &text[at + start.len()..];
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        let body = rest.find('{').filter(|_| end > 0)?;
        Some((&rest[..end], within(&rest[body..], ['{', '}'])))
    })
}

/// The sources of the library and the program, as they are compiled.
fn compiled() -> Vec<String> {
    let folders = ["core", "problems", "runners"].map(|folder| root().join(folder));
    let files = folders.iter().flat_map(|folder| sources(folder));
    let own =
        files.filter(|path| path.iter().any(|part| part == "src") && !path.ends_with("tests.rs"));
    own.map(|path| bare(&text(&path))).collect()
}

#[test]
fn traits_are_small() {
    let mut wrong = Vec::new();
    for text in compiled() {
        for (name, body) in declared(&text, "trait ") {
            // Methods, and not what their bodies define.
            let mut depth = 0;
            let mut methods = 0;
            for line in body.lines() {
                methods += usize::from(depth == 0 && line.trim_start().starts_with("fn "));
                depth += line.matches('{').count() as i32 - line.matches('}').count() as i32;
            }
            let more = MORE_METHODS.iter().find(|(own, _)| *own == name);
            if methods > more.map_or(METHODS, |(_, most)| *most) {
                wrong.push(format!("{name}: {methods} methods"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Whether a signature has a tuple of more than two.
fn has_long_tuple(signature: &str) -> bool {
    signature.match_indices('(').skip(1).any(|(at, _)| {
        let is_call = signature[..at].ends_with(|c: char| c.is_alphanumeric() || c == '>');
        let inside = within(&signature[at..], ['(', ')']);
        let (mut depth, mut parts) = (0, 1);
        for (at, c) in inside.char_indices() {
            match c {
                '(' | '[' | '<' => depth += 1,
                '>' if inside[..at].ends_with('-') => {}
                ')' | ']' | '>' => depth -= 1,
                ',' if depth == 0 && !inside[at + 1..].trim().is_empty() => parts += 1,
                _ => {}
            }
        }
        !is_call && parts > 2
    })
}

#[test]
fn public_functions_take_and_return_no_tuple_of_more_than_two() {
    assert!(has_long_tuple("f(a: u8, b: (u8, [u8; 2], u8))"));
    assert!(!has_long_tuple(
        "f(a: u8, b: (u8, u8), c: &dyn Fn(u8, u8, u8))"
    ));
    let mut wrong = Vec::new();
    for text in compiled() {
        for (at, _) in text.match_indices("pub fn ") {
            let rest = &text[at + 7..];
            let signature = &rest[..rest.find(['{', ';']).unwrap_or(0)];
            if has_long_tuple(signature) {
                wrong.push(signature.to_owned());
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The dependencies on packages of ours that a manifest names, without those of tests.
fn needs(manifest: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut counts = false;
    for line in manifest.lines() {
        if line.starts_with('[') {
            counts = line.starts_with("[dependencies");
        }
        let name = line.split([' ', '.', '=']).next().unwrap_or_default();
        if counts && name.starts_with("fredholm") {
            found.insert(name.trim_start_matches("fredholm-").to_owned());
        }
    }
    found
}

#[test]
fn packages_import_what_they_may() {
    let allowed = |folder: &str, other: &str| {
        let below = ["core", "variance"].contains(&other);
        match folder {
            "core" => false,
            "core/variance" => other == "core",
            "problems/factors" => below || ["room", "scene", "surfaces"].contains(&other),
            _ if folder.starts_with("problems/") => below || other == "surfaces",
            "runners/embedded" | "runners/rayon" => below,
            "runners/plot" => false,
            // The library is below files, pictures and the program.
            _ if folder.starts_with("runners/model") || folder == "runners/solver" => {
                !["file", "plot", "cli"].contains(&other)
            }
            "runners/file" => !["plot", "cli"].contains(&other),
            _ => true,
        }
    };
    let mut wrong = Vec::new();
    for package in packages() {
        let folder = shown(&package);
        let needs = needs(&text(&package.join("Cargo.toml")));
        println!(
            "{folder}: {}",
            needs.iter().cloned().collect::<Vec<_>>().join(", ")
        );
        let refused = needs.iter().filter(|other| !allowed(&folder, other));
        wrong.extend(refused.map(|other| format!("{folder} -> {other}")));
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The text without comments, strings and what is compiled for tests.
fn bare(text: &str) -> String {
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}
