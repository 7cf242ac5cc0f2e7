//! The tests that the documents name exist.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The text of every Rust source under a folder.
fn sources(folder: &Path, text: &mut String) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() {
            if path.file_name().is_some_and(|name| name != "target") {
                sources(&path, text);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            text.push_str(&fs::read_to_string(path).unwrap());
        }
    }
}

#[test]
fn the_tests_that_guard_against_faults_exist() {
    let mut text = String::new();
    for folder in ["src", "host", "host-tests"] {
        sources(&root().join(folder), &mut text);
    }
    let page = fs::read_to_string(root().join("docs/faults.md")).unwrap();
    let section = page.split("\n## ").find(|section| section.starts_with("What happens")).unwrap();
    let rows: Vec<&str> = section.lines().filter(|line| line.starts_with("| ")).skip(1).collect();
    assert!(rows.len() >= 25, "the table has {} rows", rows.len());
    for row in rows {
        let guards = row.trim_end_matches(" |").rsplit(" | ").next().unwrap();
        let names: Vec<&str> = guards.split('`').skip(1).step_by(2).collect();
        assert!(!names.is_empty(), "no test guards this promise: {row}");
        for name in names {
            assert!(text.contains(&format!("fn {name}(")), "there is no test {name}");
        }
    }
}
