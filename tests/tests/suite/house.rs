//! The rules of the architecture: small traits, short signatures, who imports whom, and no circle of imports between folders.
//! `cargo test -p fredholm-tests --test suite house -- --nocapture` prints the tables.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The most methods of a trait, and the traits that have more: how many, which may not grow.
const METHODS: usize = 12;
const MORE_METHODS: [(&str, usize); 4] = [
    ("Model", 40),
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

/// A module: its file, its names, and what its code names.
#[derive(Default)]
struct Module {
    file: PathBuf,
    /// The last names of what `use` brings here, and their paths.
    names: BTreeMap<String, Vec<String>>,
    /// The paths that the code names.
    paths: BTreeSet<Vec<String>>,
}

/// The text without comments, strings and what is compiled for tests.
fn bare(text: &str) -> String {
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// The paths that begin here, with all that braces hold.
fn paths(text: &str) -> (Vec<Vec<String>>, &str) {
    let mut rest = text.trim_start();
    if let Some(inside) = rest.strip_prefix('{') {
        let mut all = Vec::new();
        rest = inside;
        loop {
            rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix('}') {
                return (all, after);
            }
            if rest.is_empty() {
                return (all, rest);
            }
            let (found, after) = paths(rest);
            all.extend(found);
            let after = after.trim_start();
            rest = after.strip_prefix(',').unwrap_or(after);
            if rest.len() == text.len() {
                return (all, rest);
            }
        }
    }
    let is_name = |c: char| c.is_alphanumeric() || c == '_' || c == '*';
    let end = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
    let (name, mut after) = rest.split_at(end);
    if let Some(further) = after.strip_prefix("::") {
        let (mut found, after) = paths(further);
        for path in &mut found {
            path.insert(0, name.to_owned());
        }
        return (found, after);
    }
    let mut path = vec![name.to_owned()];
    if let Some(renamed) = after.trim_start().strip_prefix("as ") {
        let renamed = renamed.trim_start();
        let end = renamed.find(|c| !is_name(c)).unwrap_or(renamed.len());
        path.push(format!("as {}", &renamed[..end]));
        after = &renamed[end..];
    }
    if name.is_empty() {
        after = after.get(1..).unwrap_or_default();
    }
    (vec![path], after)
}

/// The modules of a package by their paths from its root.
fn modules(package: &Path) -> BTreeMap<Vec<String>, Module> {
    let src = package.join("src");
    let mut all = BTreeMap::new();
    for file in sources(&src) {
        let relative = file.strip_prefix(&src).unwrap_or(&file).with_extension("");
        let mut path: Vec<String> = relative
            .iter()
            .map(|part| part.to_string_lossy().into_owned())
            .collect();
        if ["lib", "main", "mod"].contains(&path.last().map_or("", String::as_str)) {
            path.pop();
        }
        let text = bare(&text(&file));
        let mut module = Module {
            file,
            ..Module::default()
        };
        let starts = ["crate::", "super::", "self::"];
        for (at, _) in text.match_indices("::") {
            let begin = text[..at].rfind(|c: char| !c.is_alphanumeric() && c != '_');
            let begin = begin.map_or(0, |begin| begin + 1);
            let is_first = !text[..begin].ends_with("::") && !text[..begin].ends_with('$');
            if is_first && starts.iter().any(|start| text[begin..].starts_with(start)) {
                for mut found in paths(&text[begin..]).0 {
                    let renamed = found.last().and_then(|last| last.strip_prefix("as "));
                    let name = renamed.map(str::to_owned);
                    if name.is_some() {
                        found.pop();
                    }
                    let base = match found[0].as_str() {
                        "crate" => Vec::new(),
                        _ => path.clone(),
                    };
                    let mut full = base;
                    for part in found {
                        match part.as_str() {
                            "crate" | "self" => {}
                            "super" => drop(full.pop()),
                            _ => full.push(part),
                        }
                    }
                    if let Some(last) = name.or_else(|| full.last().cloned()) {
                        module.names.insert(last, full.clone());
                    }
                    module.paths.insert(full);
                }
            }
        }
        // `use child::Name` of a module's own children.
        for line in text.split(';') {
            let line = line.trim();
            let Some((_, used)) = line.rsplit_once("use ") else {
                continue;
            };
            for found in paths(used).0 {
                let mut full = path.clone();
                full.extend(found);
                if let Some(last) = full.last().cloned() {
                    module.names.entry(last).or_insert(full);
                }
            }
        }
        all.insert(path, module);
    }
    all
}

/// The module in which a path ends, through what other modules bring in.
fn home(all: &BTreeMap<Vec<String>, Module>, path: &[String], depth: usize) -> Option<Vec<String>> {
    let mut here = Vec::new();
    for (at, part) in path.iter().enumerate() {
        here.push(part.clone());
        if all.contains_key(&here) {
            continue;
        }
        here.pop();
        let target = all.get(&here)?.names.get(part);
        return match target {
            Some(target) if depth < 8 && target.as_slice() != &path[..=at] => {
                let mut further = target.clone();
                further.extend_from_slice(&path[at + 1..]);
                home(all, &further, depth + 1).or(Some(here))
            }
            _ => Some(here),
        };
    }
    Some(here)
}

/// Which module imports which.
fn imports(all: &BTreeMap<Vec<String>, Module>) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let of = |(path, module): (&Vec<String>, &Module)| {
        let homes = module.paths.iter().filter_map(|to| home(all, to, 0));
        // A root names what its package offers; that is no import.
        let homes = homes.filter(|to| to != path && !path.is_empty());
        (path.clone(), homes.collect())
    };
    all.iter().map(of).collect()
}

/// All that can be reached from a module.
fn reached(
    graph: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>,
    from: &[String],
) -> BTreeSet<Vec<String>> {
    let mut found = BTreeSet::new();
    let mut open = vec![from.to_vec()];
    while let Some(at) = open.pop() {
        for next in graph.get(&at).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    found
}

/// The folder of a module: a file beside a folder of its name belongs to it.
fn folder(all: &BTreeMap<Vec<String>, Module>, path: &[String]) -> Vec<String> {
    let is_parent = all
        .keys()
        .any(|other| other.len() > path.len() && other.starts_with(path));
    match path.split_last() {
        Some((_, parents)) if !is_parent => parents.to_vec(),
        _ => path.to_vec(),
    }
}

/// Circles of imports within one folder, and between it and those in it, are a matter of its files; between others there is none.
#[test]
fn no_circle_of_imports_leaves_its_folder() {
    let mut circles = Vec::new();
    let mut looked = 0;
    for package in packages() {
        let all = modules(&package);
        let graph = imports(&all);
        looked += graph.values().map(BTreeSet::len).sum::<usize>();
        let reach: BTreeMap<_, _> = graph
            .keys()
            .map(|path| (path.clone(), reached(&graph, path)))
            .collect();
        for (from, to) in graph
            .iter()
            .flat_map(|(from, to)| to.iter().map(move |to| (from, to)))
        {
            let back = reach.get(to).is_some_and(|reached| reached.contains(from));
            let [one, other] = [folder(&all, from), folder(&all, to)];
            if back && !one.starts_with(&other) && !other.starts_with(&one) {
                let name = |path: &Vec<String>| shown(&all[path].file);
                circles.push(format!("{} -> {}", name(from), name(to)));
            }
        }
    }
    assert!(looked > 500, "{looked} imports are too few to be all");
    assert!(circles.is_empty(), "{circles:#?}");
}
