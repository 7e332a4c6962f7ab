//! The documentation of the published crates: sentences that stand alone, examples, links that lead somewhere.

use std::fs;
use std::path::{Path, PathBuf};

/// The sources of the crates that others build on.
const PUBLISHED: [&str; 19] = [
    "core/src",
    "core/variance/src",
    "problems/circle/src",
    "problems/cube/src",
    "problems/factors/src",
    "problems/room/src",
    "problems/scene/src",
    "problems/sphere/src",
    "problems/surfaces/src",
    "problems/tube/src",
    "runners/embedded/src",
    "runners/file/src",
    "runners/model/src",
    "runners/models/room/src",
    "runners/models/scene/src",
    "runners/plot/src",
    "runners/rayon/src",
    "runners/solver/src",
    "tests/conformance/src",
];

/// First words of a sentence that leans on another one.
const LEANING: [&str; 12] = [
    "The same",
    "Of",
    "That",
    "Those",
    "Its",
    "As",
    "Another",
    "So many",
    "Everything",
    "It",
    "They",
    "With",
];

/// The root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All files below a folder with this ending, in order.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() && !name.starts_with('.') && name != "target" {
            found.extend(files(&path, ending));
        } else if name.ends_with(ending) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// A doc comment, and the first line of the item below it.
struct Documented {
    line: usize,
    doc: Vec<String>,
    item: String,
}

/// The doc comments of a source, up to its unit tests.
fn documented(source: &str) -> Vec<Documented> {
    let mut found: Vec<Documented> = Vec::new();
    let mut doc = Vec::new();
    let mut brackets = 0;
    for (number, line) in source.lines().enumerate() {
        let line = line.trim();
        if let Some(text) = line.strip_prefix("///") {
            doc.push(text.trim().to_owned());
        } else if brackets > 0 || line.starts_with("#[") {
            if line == "#[cfg(test)]" {
                break;
            }
            let count = |bracket| line.matches(bracket).count() as i32;
            brackets += count('[') - count(']');
        } else if !line.starts_with("//") && !doc.is_empty() {
            found.push(Documented {
                line: number + 1 - doc.len(),
                doc: core::mem::take(&mut doc),
                item: line.to_owned(),
            });
        }
    }
    found
}

/// Whether a sentence begins with a word that leans on another sentence.
fn leans(sentence: &str) -> bool {
    LEANING.iter().any(|word| {
        let rest = sentence.strip_prefix(word);
        rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-'))
    })
}

#[test]
fn first_sentences_stand_alone() {
    assert!(leans("Of a table.") && leans("The same, in f64.") && !leans("Offers a table."));
    let mut count = 0;
    let mut wrong = Vec::new();
    for folder in PUBLISHED {
        for path in files(&root().join(folder), ".rs") {
            for Documented { line, doc, item } in documented(&fs::read_to_string(&path).unwrap()) {
                count += 1;
                if leans(&doc[0]) {
                    wrong.push(format!("{}:{line}: {} [{item}]", path.display(), doc[0]));
                }
            }
        }
    }
    assert!(count > 3000, "{count} comments were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The names of types and traits that the root of `fredholm` exports: not modules, not functions.
fn exported() -> Vec<String> {
    let source = fs::read_to_string(root().join("runners/solver/src/lib.rs")).unwrap();
    let uses = source.split("\npub use ").skip(1);
    let names = uses
        .filter_map(|rest| rest.split(';').next())
        .flat_map(|path| {
            let list = path.rsplit("::").next().unwrap_or(path);
            list.trim_matches(['{', '}']).split(',')
        });
    let names = names.map(|name| name.trim().to_owned());
    names
        .filter(|name| name.starts_with(char::is_uppercase))
        .collect()
}

#[test]
fn every_type_of_the_facade_has_an_example() {
    let mut all = Vec::new();
    for folder in PUBLISHED {
        for path in files(&root().join(folder), ".rs") {
            all.extend(documented(&fs::read_to_string(&path).unwrap()));
        }
    }
    let names = exported();
    assert!(names.len() > 20, "{names:?}");
    for name in names {
        let is_it = |item: &str| {
            ["struct", "enum", "trait", "type"].iter().any(|word| {
                let rest = item.strip_prefix(&format!("pub {word} {name}"));
                rest.is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
            })
        };
        let has_example = |of: &&Documented| of.doc.iter().any(|line| line.starts_with("```"));
        let own: Vec<&Documented> = all.iter().filter(|of| is_it(&of.item)).collect();
        assert!(!own.is_empty(), "{name} is not found");
        assert!(
            own.iter().any(has_example),
            "fredholm::{name} has no example in its documentation"
        );
    }
}

#[test]
fn links_between_files_lead_somewhere() {
    let mut count = 0;
    for path in files(&root(), ".md") {
        let text = fs::read_to_string(&path).unwrap();
        let folder = path.parent().unwrap();
        for link in text.split("](").skip(1) {
            let link = link.split(')').next().unwrap_or_default();
            let target = link.split('#').next().unwrap_or_default();
            let is_file = !target.is_empty()
                && !target.contains("://")
                && (target.contains('/') || target.contains('.'))
                && !target.contains("::");
            if is_file {
                count += 1;
                let file = folder.join(target);
                assert!(file.exists(), "{}: no {target}", path.display());
            }
        }
    }
    assert!(count > 40, "{count} links were found");
}

/// Whole programs, as what is copied must compile: nothing is hidden from whoever reads them on the web.
#[test]
fn every_example_of_the_manual_is_run_and_whole() {
    let listed = include_str!("../../../runners/solver/src/manual.rs");
    let mut pages = files(&root().join("docs"), ".md");
    pages.push(root().join("README.md"));
    for path in pages {
        let name = path.file_name().unwrap().to_str().unwrap();
        let text = fs::read_to_string(&path).unwrap();
        for example in text.split("```rust\n").skip(1) {
            let example = example.split("```").next().unwrap();
            assert!(
                listed.contains(name),
                "{name} is not in runners/solver/src/manual.rs"
            );
            assert!(example.contains("fn main()"), "{name}: {example}");
            assert!(
                !example.lines().any(|l| l.starts_with("# ")),
                "{name}: {example}"
            );
        }
    }
}

#[test]
fn every_package_says_what_it_is_for_and_shows_it() {
    // The example of the kit is a crate: tests/template.
    let kit = "tests/conformance/src";
    for folder in PUBLISHED.into_iter().filter(|folder| *folder != kit) {
        let source = root().join(folder);
        let readme = fs::read_to_string(source.join("../README.md")).unwrap();
        assert!(readme.contains("```rust\n"), "{folder}: no example");
        // So it is compiled and run.
        let library = fs::read_to_string(source.join("lib.rs")).unwrap();
        let included = library.contains("include_str!(\"../README.md\")");
        assert!(included, "{folder}: its README is not its documentation");
    }
}

#[test]
fn the_paper_cites_what_it_lists() {
    let read = |name| fs::read_to_string(root().join("paper").join(name)).unwrap();
    let (paper, list) = (read("paper.md"), read("paper.bib"));
    let word =
        |text: &str| -> String { text.chars().take_while(|c| c.is_alphanumeric()).collect() };
    let cited = paper.split('[').skip(1).filter_map(|rest| {
        let key = rest.strip_prefix("-@").or_else(|| rest.strip_prefix('@'));
        key.map(word)
    });
    let listed = list.split('{').zip(list.split('{').skip(1));
    let listed =
        listed.filter(|(before, _)| before.lines().last().is_some_and(|l| l.starts_with('@')));
    let mut both = [
        cited.collect::<Vec<_>>(),
        listed.map(|(_, key)| word(key)).collect(),
    ];
    for keys in &mut both {
        keys.sort();
        keys.dedup();
    }
    assert_eq!(both[0], both[1]);
    assert!(both[0].len() > 5, "{both:?}");
    // Two pages.
    assert!(paper.split_whitespace().count() <= 1000);
}
