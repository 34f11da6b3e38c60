//! The hostile corpus through the command line: every case ends as its list of expectations says, with
//! a class, a status, its facts and nothing left behind, within limits of memory and time.
//!
//! `corpus/make.py` writes the cases and the list; it needs Python and no more. With `RHUMB_CORPUS=all`
//! the slow ones are run too, with `RHUMB_CORPUS=slow` these alone (1 GB of disk, minutes).
//! `RHUMB_BINARY` names another build to run, a release: the limits of time are then as they stand.

mod environment;
mod meshes;
mod programs;
mod settings;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

use crate::run::{Ran, Scratch, root, say};

/// The machine that the expectations are written for.
const MACHINE: [&str; 8] = [
    "--set",
    "rail_max_mm=100",
    "--set",
    "rail_min_mm=-100",
    "--set",
    "home_rail_mm=100",
    "--set",
    "z_max_mm=150",
];

/// A build for tests is this much slower than a release, which the limits of time are meant for.
const SLOWER: u64 = 8;

/// Cases for a release build: thousands of parts too small for a bead, hundreds of shells within each
/// other, and files of up to a gigabyte.
const SLOW: [&str; 6] = [
    "stl/shells_10k",
    "stl/concentric_250",
    "stl/big_1M",
    "stl/sparse_1GiB",
    "gcode/single_line_100MB",
    "gcode/big_3M_lines",
];

/// Which cases `RHUMB_CORPUS` asks for.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    Quick,
    Slow,
    All,
}

impl Wanted {
    fn get() -> Self {
        match std::env::var("RHUMB_CORPUS").as_deref() {
            Err(_) => Self::Quick,
            Ok("slow") => Self::Slow,
            Ok("all") => Self::All,
            Ok(other) => panic!("RHUMB_CORPUS={other} is neither slow nor all"),
        }
    }

    fn has(self, id: &str) -> bool {
        self == Self::All || SLOW.contains(&id) == (self == Self::Slow)
    }
}

/// A release build to run, if one is named.
fn release() -> Option<PathBuf> {
    std::env::var_os("RHUMB_BINARY").map(|binary| root().join(binary))
}

/// The corpus: where its files lie, and what is expected of them.
struct Corpus {
    folder: PathBuf,
    expectations: Value,
}

impl Corpus {
    /// Writes it, once for all tests; `None` where there is no Python.
    fn get() -> Option<&'static Self> {
        static MADE: OnceLock<Option<Corpus>> = OnceLock::new();
        let made = MADE.get_or_init(Self::make).as_ref();
        if made.is_none() {
            say("skipped: there is no python3 to write the corpus");
        }
        made
    }

    fn make() -> Option<Self> {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("corpus");
        std::fs::create_dir_all(&folder).unwrap();
        let mut make = Command::new("python3");
        make.arg(root().join("tests/corpus/make.py")).arg(&folder);
        if Wanted::get() != Wanted::Quick {
            make.arg("--big");
        }
        let output = make.output().ok()?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(folder.join("expectations.json")).unwrap();
        Some(Self { folder, expectations: serde_json::from_str(&text).unwrap() })
    }

    /// The cases of some kinds that are wanted.
    fn cases<'a>(&'a self, kinds: &'a [&str]) -> impl Iterator<Item = &'a Value> {
        let wanted = Wanted::get();
        let cases = self.expectations["cases"].as_array().unwrap().iter();
        cases.filter(move |case| {
            kinds.contains(&case["kind"].as_str().unwrap())
                && wanted.has(case["id"].as_str().unwrap())
        })
    }

    /// The name of a case and its file.
    fn file<'a>(&self, case: &'a Value) -> (&'a str, PathBuf) {
        (case["id"].as_str().unwrap(), self.folder.join(case["file"].as_str().unwrap()))
    }
}

/// Cases that end otherwise, on purpose. `docs/corpus.md` says why, under the same names.
const OTHERWISE: [(&str, &str); 11] = [
    ("stl/hole_two_sides", "1"),
    ("stl/one_floating", "1"),
    ("gcode/g92_xy", "0"),
    ("gcode/cold_extrude", "1"),
    ("gcode/home_midfile", "0"),
    ("config/layer_nan", "ConfigRange"),
    ("config/temp_float_overflow", "ConfigRange"),
    ("config/type_date", "ConfigSyntax"),
    ("config/url_secret", "ConfigUnknownKey"),
    ("config/start_gcode_hot", "SelfCheckFailed"),
    ("config/start_gcode_oob", "SelfCheckFailed"),
];

/// How a run ended: its class, or its status.
fn end(ran: &Ran) -> String {
    match ran.err.strip_prefix("error[").and_then(|rest| rest.split(']').next()) {
        Some(class) => class.to_owned(),
        None => ran.code.map_or("killed".to_owned(), |code| code.to_string()),
    }
}

/// The texts that a case lists under a name.
fn texts(case: &Value, name: &str) -> Vec<String> {
    let all = case[name].as_array().into_iter().flatten();
    all.filter_map(Value::as_str).map(str::to_owned).collect()
}

/// What is wrong with the end of a run, as far as every kind of case is judged alike.
fn faults(case: &Value, ran: &Ran) -> Vec<String> {
    let id = case["id"].as_str().unwrap();
    let end = end(ran);
    let wanted = case["error"].as_str().unwrap_or("0");
    let mut faults = Vec::new();
    let is_otherwise = OTHERWISE.contains(&(id, end.as_str()));
    let is_as_good = texts(case, "also").contains(&end);
    if end != wanted && !is_otherwise && !is_as_good {
        faults.push(format!("{id} ends with {end} and not {wanted}: {:?} {}", ran.code, ran.err));
    }
    if end == wanted && ran.code.map(i64::from) != case["exit"].as_i64() {
        faults.push(format!("{id} has status {:?}: {}", ran.code, ran.err));
    }
    // Where two files together are wrong, the key is named and no line.
    let names_key = id == "config/layer_over_nozzle" && ran.err.contains("layer_height_mm = 0.5");
    if let Some(line) = case["line"].as_i64()
        && end == wanted
        && !names_key
        && !ran.err.contains(&format!("line {line}"))
    {
        faults.push(format!("{id} does not name line {line}: {}", ran.err));
    }
    if ran.err.contains("panicked") || ran.err.len() > 4096 {
        faults.push(format!("{id} says {}", ran.err));
    }
    if case["forbid_in_stderr"].as_str().is_some_and(|all| mentions(&ran.err, all)) {
        faults.push(format!("{id} tells {}", ran.err));
    }
    faults
}

/// Whether a text holds one of the words between the bars.
fn mentions(text: &str, words: &str) -> bool {
    let escape = "\u{1b}[2J";
    words.split('|').any(|word| text.contains(&word.replace("\\x1b\\[2J", escape)))
}

/// Runs rhumb within the limits of a case, on its address space and its time.
fn limited(scratch: &Scratch, case: &Value, arguments: &[&str]) -> Ran {
    let limit = |name: &str| case["limits"][name].as_u64().unwrap();
    // Addresses are no memory: mapped files take more of them, and threads, of which each would have a
    // share of 64 MB for itself alone.
    let kb = 2 * limit("rss_mb") * 1024;
    let binary = release();
    let seconds = if binary.is_some() { 1 } else { SLOWER } * limit("seconds");
    let mut shell = Command::new("sh");
    shell
        .current_dir(scratch.path(""))
        .env("SOURCE_DATE_EPOCH", "1700000000")
        .env("MALLOC_ARENA_MAX", "1")
        // The shell outlives what it runs, and tells a signal by a status over 128.
        .args(["-c", &format!("ulimit -v {kb}; ulimit -t {seconds}; \"$0\" \"$@\"; exit $?")])
        .arg(binary.as_deref().unwrap_or(Path::new(env!("CARGO_BIN_EXE_rhumb"))))
        .args(arguments)
        .stdin(std::process::Stdio::null());
    let output = if cfg!(target_os = "linux") {
        shell.output().unwrap()
    } else {
        scratch.rhumb(arguments).output().unwrap()
    };
    Ran::from(output)
}

/// What stays in the folder must be the program alone, or nothing.
fn leftovers(id: &str, ran: &Ran, scratch: &Scratch) -> Option<String> {
    let names = scratch.names();
    let wanted: &[&str] = if matches!(ran.code, Some(0 | 1)) { &["out.gcode"] } else { &[] };
    (names != wanted).then(|| format!("{id} leaves {names:?}"))
}

#[track_caller]
fn none(faults: &[String], n_cases: usize) {
    assert!(faults.is_empty(), "{} of {n_cases}:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn what_ends_otherwise_is_explained() {
    let page = std::fs::read_to_string(root().join("docs/corpus.md")).unwrap();
    for (id, end) in OTHERWISE {
        let row = page.lines().find(|line| line.contains(&format!("`{id}`")));
        assert!(row.is_some_and(|row| row.contains(end)), "docs/corpus.md on {id}, {end}");
    }
}
