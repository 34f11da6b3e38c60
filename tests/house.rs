//! The rules of the house: who may use whom, and what must not stand anywhere.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use toml::{Table, Value};

use crate::run::root;

/// Which crate may use which. ARCHITECTURE says why.
const MAY_USE: [(&str, &[&str]); 7] = [
    ("geom", &[]),
    ("mesh", &["geom"]),
    ("slicer", &["geom", "mesh"]),
    ("machine", &["geom"]),
    ("plan", &["geom", "machine", "slicer"]),
    ("twin", &["geom", "machine", "mesh"]),
    ("rhumb", &["geom", "machine", "mesh", "plan", "slicer", "twin"]),
];

/// Libraries that one crate alone may name: polygons, and what deals with users and the system.
const OWNERS: [(&str, &str); 6] = [
    ("i_overlay", "geom"),
    ("clap", "rhumb"),
    ("indicatif", "rhumb"),
    ("serde", "rhumb"),
    ("signal-hook", "rhumb"),
    ("toml", "rhumb"),
];

fn manifest(path: &Path) -> Table {
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

/// The manifests of the members, by name.
fn members() -> BTreeMap<String, Table> {
    let folders = std::fs::read_dir(root().join("crates")).unwrap();
    folders
        .map(|folder| manifest(&folder.unwrap().path().join("Cargo.toml")))
        .map(|table| (table["package"]["name"].as_str().unwrap().to_owned(), table))
        .collect()
}

/// All that a crate depends on, whatever for and on whatever system.
fn dependencies(table: &Table) -> BTreeSet<String> {
    let targets = table.get("target").and_then(Value::as_table);
    let tables = std::iter::once(table)
        .chain(targets.into_iter().flat_map(|t| t.values().filter_map(Value::as_table)));
    let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
    tables
        .flat_map(|table| kinds.iter().filter_map(|kind| table.get(*kind)?.as_table()))
        .flat_map(|table| table.iter().map(|(name, value)| real_name(name, value)))
        .collect()
}

/// A dependency can go by another name.
fn real_name(name: &str, value: &Value) -> String {
    value.get("package").and_then(Value::as_str).unwrap_or(name).to_owned()
}

#[test]
fn crates_use_only_whom_they_may() {
    let members = members();
    let names: Vec<&str> = members.keys().map(String::as_str).collect();
    let mut known = MAY_USE.map(|(name, _)| name);
    known.sort_unstable();
    assert_eq!(names, known, "the crates of the workspace");
    for (name, may_use) in MAY_USE {
        let uses: Vec<String> = dependencies(&members[name])
            .into_iter()
            .filter(|used| members.contains_key(used))
            .collect();
        assert_eq!(uses, may_use, "what {name} uses");
    }
}

#[test]
fn libraries_with_an_owner_are_named_by_nobody_else() {
    let workspace = manifest(&root().join("Cargo.toml"));
    for (library, owner) in OWNERS {
        assert!(workspace["workspace"]["dependencies"].get(library).is_some(), "{library}");
        for (name, table) in members() {
            let names_it = dependencies(&table).contains(library);
            assert_eq!(names_it, name == owner, "{library} in {name}");
        }
    }
}

#[test]
fn unsafe_code_is_forbidden_everywhere() {
    let workspace = manifest(&root().join("Cargo.toml"));
    assert_eq!(workspace["workspace"]["lints"]["rust"]["unsafe_code"].as_str(), Some("forbid"));
    for (name, table) in members() {
        assert_eq!(table["lints"]["workspace"].as_bool(), Some(true), "{name}");
    }
}

/// Files under version control; in an unpacked archive, all files but those that are built.
fn tracked() -> Vec<PathBuf> {
    let listed = Command::new("git").current_dir(root()).args(["ls-files", "-z"]).output();
    if let Ok(output) = listed
        && output.status.success()
    {
        let names = String::from_utf8(output.stdout).unwrap();
        return names.split_terminator('\0').map(|name| root().join(name)).collect();
    }
    files_below(root())
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_file() {
            files.push(path);
        } else if name != "target" && name != ".git" && path.is_dir() {
            files.extend(files_below(&path));
        }
    }
    files
}

#[test]
fn no_file_knows_the_machine_it_was_made_on() {
    // In two pieces, or this file would be found.
    let paths = [("/wo", "rk/"), ("/tmp", "/wt"), ("/ro", "ot/")].map(|(a, b)| format!("{a}{b}"));
    let files = tracked();
    assert!(files.len() > 50, "{} files are not the repository", files.len());
    for file in files {
        // A file that was just removed is still listed.
        let Ok(bytes) = std::fs::read(&file) else { continue };
        for path in &paths {
            let found = bytes.windows(path.len()).any(|window| window == path.as_bytes());
            assert!(!found, "{} names {path}", file.display());
        }
    }
}

/// Whether `phrase` (lower case) stands in a text as words of its own.
fn says(text: &str, phrase: &str) -> bool {
    let words: Vec<String> = text
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    let wanted: Vec<&str> = phrase.split(' ').collect();
    words.windows(wanted.len()).any(|window| window == wanted)
}

#[test]
fn the_slicer_knows_no_machine() {
    assert!(says("the Bed  turn's", "bed turn") && !says("feedback", "feed"));
    let sources = files_below(&root().join("crates/slicer/src"));
    assert!(sources.len() > 5);
    for source in sources {
        let text = std::fs::read_to_string(&source).unwrap();
        for phrase in ["feed", "bed turn", "gcode"] {
            for (line, words) in (1..).zip(text.lines()) {
                assert!(!says(words, phrase), "{}:{line} says {phrase}", source.display());
            }
        }
    }
}

/// A model, a setting or a program is data. Only tests start processes.
#[test]
fn nothing_is_run_because_a_file_says_so() {
    let crates = std::fs::read_dir(root().join("crates")).unwrap();
    let sources: Vec<PathBuf> =
        crates.flat_map(|folder| files_below(&folder.unwrap().path().join("src"))).collect();
    assert!(sources.len() > 100, "{} files are not the program", sources.len());
    for source in sources.iter().filter(|path| path.extension().is_some_and(|end| end == "rs")) {
        let text = std::fs::read_to_string(source).unwrap();
        assert!(!text.contains("process::Command"), "{} starts processes", source.display());
    }
}
