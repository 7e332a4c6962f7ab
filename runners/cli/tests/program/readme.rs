//! The problem files that the README shows run as they stand.

use crate::common;

use common::{Folder, list};

#[test]
fn the_files_of_the_readme_run() {
    let readme = concat!(env!("CARGO_MANIFEST_DIR"), "/../../README.md");
    let text = std::fs::read_to_string(readme).unwrap();
    let blocks = text.split("```toml\n").skip(1);
    let files: Vec<&str> = blocks
        .filter_map(|block| block.split("```").next())
        .filter(|block| block.contains("[problem]"))
        .collect();
    assert_eq!(files.len(), 3, "{files:?}");
    for file in files {
        let json = Folder::new().solve(file, &["--json"]).quietly(0).json();
        assert_eq!(json["stop"], "done", "{json}");
        assert_eq!(list(&json, "targets").len(), 2);
    }
}
