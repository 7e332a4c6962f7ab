//! README and manual do what they say: problem files are read, commands run, and printed results are what is printed.
//!
//! A block `sh` is run as it stands, a block `sh long` with `FREDHOLM_LONG=1`, and a block `sh hours` is not run, but its
//! options must exist. Commands of a page run one after the other in one folder, which has the examples, and every
//! problem file of the page whose first line is its name, as a comment. A block `text` that follows a block `sh` is a part of
//! what its last command prints, but for lines with times.
//! A block `bash` is a script, which is run as it stands; a block `bash file` is one that others call, by the name in its second
//! line. Of a block `bash mpi` the options must exist; `.ci/mpi` runs such commands.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::common;

use common::{Folder, Ran, command, fredholm, wait};

/// What other commands of the manual begin with: these are for people and for CI.
const OTHERS: [&str; 11] = [
    "cargo run --release -p fredholm --example",
    "cargo run --profile dist -p fredholm --features measure --example",
    "cargo test",
    "FREDHOLM_LONG=1 cargo test",
    "cargo bench",
    "cargo install",
    "cargo fuzz",
    "git clone",
    "cd ",
    "fuzz/seeds",
    "runners/web/site",
];

/// A block of code.
struct Block<'a> {
    /// The line of the page, from 1.
    line: usize,
    /// The words behind the fence.
    info: &'a str,
    text: String,
}

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// README, manual and the claims of the paper: path and text.
fn pages() -> Vec<(PathBuf, String)> {
    let entries = fs::read_dir(root().join("docs")).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "md"));
    paths.extend(["README.md", "paper/README.md"].map(|path| root().join(path)));
    paths.sort();
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).unwrap();
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

/// The blocks of a page, in order.
fn blocks(page: &str) -> Vec<Block<'_>> {
    let mut found: Vec<Block<'_>> = Vec::new();
    let mut is_open = false;
    for (number, line) in page.lines().enumerate() {
        match line.strip_prefix("```") {
            Some(_) if is_open => is_open = false,
            Some(info) => {
                is_open = true;
                found.push(Block {
                    line: number + 1,
                    info,
                    text: String::new(),
                });
            }
            None => {
                if let (true, Some(block)) = (is_open, found.last_mut()) {
                    block.text += line;
                    block.text.push('\n');
                }
            }
        }
    }
    assert!(!is_open, "a block has no end");
    found
}

/// The arguments of a command that calls the program.
fn arguments(command: &str) -> Option<&str> {
    let rest = command.strip_prefix("cargo run --release -- ");
    rest.or_else(|| command.strip_prefix("fredholm "))
}

/// Runs a command in a folder; `> FILE` is where its output goes.
fn run(folder: &Folder, line: &str) -> Ran {
    let (line, file) = match line.split_once(" > ") {
        Some((line, file)) => (line, Some(file)),
        None => (line, None),
    };
    let args: Vec<&str> = line.split_whitespace().collect();
    let ran = wait(command(&args).current_dir(folder.path()).spawn().unwrap());
    if let Some(file) = file {
        folder.file(file.trim(), &ran.stdout);
    }
    ran
}

/// Runs a script in a folder, with the program by its name. What fails within ends it.
fn run_script(folder: &Folder, text: &str) -> Ran {
    let program = Path::new(env!("CARGO_BIN_EXE_fredholm"));
    let mut path = program.parent().unwrap().as_os_str().to_owned();
    if let Some(others) = std::env::var_os("PATH") {
        path.push(":");
        path.push(others);
    }
    let child = Command::new("bash")
        .args(["-euc", text])
        .current_dir(folder.path())
        .env("PATH", path)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    wait(child.unwrap())
}

/// Asserts that the command and its options exist.
fn assert_known(line: &str, place: &str) {
    let mut words = line.split_whitespace();
    let name = words.next().unwrap_or_default();
    let help = fredholm(&[name, "--help"]);
    assert_eq!(help.status, Some(0), "{place}: {line}");
    for option in words.filter(|word| word.starts_with("--")) {
        let option = option.trim_end_matches(|c: char| !c.is_alphanumeric());
        assert!(
            help.stdout.contains(option),
            "{place}: no {option} in {line}"
        );
    }
}

/// Whether a line says how long something took.
fn has_time(line: &str) -> bool {
    line.contains("pilots in ") || line.ends_with(" s") || line.ends_with(" threads")
}

/// Copies the examples into a folder.
fn copy_examples(folder: &Folder) {
    fs::create_dir(folder.path().join("examples")).unwrap();
    for entry in fs::read_dir(root().join("examples")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap();
        fs::copy(&path, folder.path().join("examples").join(name)).unwrap();
    }
}

#[test]
fn the_manual_does_what_it_says() {
    let is_long = std::env::var_os("FREDHOLM_LONG").is_some();
    let [mut files, mut commands, mut compared] = [0; 3];
    for (path, page) in pages() {
        let folder = Folder::new();
        copy_examples(&folder);
        // What the last command printed; nothing where it was not run.
        let mut printed: Option<String> = None;
        let blocks = blocks(&page);
        for Block { line, info, text } in &blocks {
            let place = format!("{}:{line}", path.display());
            match *info {
                "toml" if text.contains("[dependencies]") => {
                    for dependency in text.split("path = \"../fredholm/").skip(1) {
                        let crate_folder = dependency.split('"').next().unwrap();
                        let manifest = root().join(crate_folder).join("Cargo.toml");
                        assert!(manifest.exists(), "{place}: {crate_folder}");
                    }
                }
                "toml" => {
                    let name = text.lines().next().and_then(|line| {
                        let name = line.strip_prefix("# ")?.split(':').next()?;
                        name.ends_with(".toml").then_some(name)
                    });
                    let name = name.unwrap_or_else(|| panic!("{place}: a file without a name"));
                    let file = folder.file(name, text);
                    // Whatever a command of the page solves is read there.
                    let is_solved = |all: &Block<'_>| {
                        all.info == "sh" && all.text.contains(&format!("solve {name}"))
                    };
                    if is_long || !blocks.iter().any(is_solved) {
                        let ran = fredholm(&["check", &file]);
                        assert_eq!(ran.status, Some(0), "{place}: {ran:?}");
                    }
                    files += 1;
                }
                "sh" | "sh long" | "sh hours" => {
                    printed = None;
                    for line in text.replace("\\\n", " ").lines() {
                        let Some(line) = arguments(line) else {
                            let is_other = OTHERS.iter().any(|start| line.starts_with(start));
                            assert!(is_other, "{place}: what is {line:?}?");
                            continue;
                        };
                        if *info == "sh hours" || *info == "sh long" && !is_long {
                            assert_known(line, &place);
                            continue;
                        }
                        let ran = run(&folder, line);
                        assert_eq!(ran.status, Some(0), "{place}: {line}: {ran:?}");
                        printed = Some(ran.stdout);
                        commands += 1;
                    }
                }
                "bash file" => {
                    let name = text.lines().nth(1).and_then(|line| line.strip_prefix("# "));
                    let name = name.unwrap_or_else(|| panic!("{place}: a script without a name"));
                    folder.file(name, text);
                }
                "bash" => {
                    let ran = run_script(&folder, text);
                    assert_eq!(ran.status, Some(0), "{place}: {ran:?}");
                    printed = Some(ran.stdout);
                    commands += 1;
                }
                "bash mpi" => {
                    for line in text.lines() {
                        let command = line.split_once("fredholm-mpi ").map(|(_, command)| command);
                        assert_known(command.expect("a command of mpirun"), &place);
                    }
                }
                "text" => {
                    if let Some(printed) = &printed {
                        let real: Vec<&str> = printed.lines().map(str::trim_end).collect();
                        for line in text.lines().filter(|line| !has_time(line)) {
                            let line = line.trim_end();
                            assert!(real.contains(&line), "{place}: {line:?} of {printed}");
                            compared += 1;
                        }
                    }
                }
                "rust" | "math" | "svg" => {}
                _ => panic!("{place}: a block of {info:?}"),
            }
        }
    }
    assert!(
        files >= 8 && commands >= 20 && compared >= 60,
        "{files} {commands} {compared}"
    );
}

#[test]
fn commands_that_the_text_names_exist() {
    for (path, page) in pages() {
        let prose: String = page.split("```").step_by(2).collect();
        let spans = prose.split('`').skip(1).step_by(2);
        for span in spans {
            let span = span.replace('\n', " ");
            if let Some(line) = arguments(&span) {
                assert_known(line, &path.display().to_string());
            }
        }
    }
}
