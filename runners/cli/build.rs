//! Tells the program which commit it was built from, if that is known.

use std::path::Path;
use std::process::Command;

/// The commit in what `cargo package` writes into an archive.
fn of_archive() -> Option<String> {
    let text = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let (_, rest) = text.split_once("\"sha1\"")?;
    rest.split('"').nth(1).map(str::to_owned)
}

/// The commit of the repository in which this crate is a folder.
fn of_repository() -> Option<String> {
    let git = |arguments: &[&str]| {
        let ran = Command::new("git").args(arguments).output().ok()?;
        let text = String::from_utf8(ran.stdout).ok()?;
        ran.status.success().then(|| text.trim().to_owned())
    };
    // A crate among somebody else's files is in another repository.
    if git(&["ls-files", "build.rs"])?.is_empty() {
        return None;
    }
    let head = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&head).exists() {
        println!("cargo::rerun-if-changed={head}");
    }
    git(&["rev-parse", "HEAD"])
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Who works on it need not compile it after every commit.
    let is_release = std::env::var("PROFILE").is_ok_and(|profile| profile == "release");
    let commit = is_release.then(|| of_archive().or_else(of_repository));
    let commit = commit.flatten().unwrap_or_default();
    let short = commit.get(..10).unwrap_or_default();
    println!("cargo::rustc-env=FREDHOLM_COMMIT={short}");
}
