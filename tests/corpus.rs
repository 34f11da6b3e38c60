//! The hostile corpus of the folder `shared` beside the repository, through the command line: every
//! mesh ends as its list of expectations says, with a class, a status and nothing left behind.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::run::{Ran, Scratch, say, shared};

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

/// Whether a run ended as the case allows: its class of error, one that is as good, or a program,
/// where a guessed repair is status 1.
fn is_as_expected(case: &Value, ran: &Ran) -> bool {
    let class = ran.err.strip_prefix("error[").and_then(|rest| rest.split(']').next());
    let also: Vec<&str> =
        case["also"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    match (case["error"].as_str(), class) {
        (Some(wanted), Some(class)) if class == wanted => {
            ran.code.map(i64::from) == case["exit"].as_i64()
        }
        (_, Some(class)) => also.contains(&class),
        (None, None) => {
            let has_warnings = case["outcome"] != "ok";
            ran.code == Some(0) || has_warnings && ran.code == Some(1)
        }
        (Some(_), None) => false,
    }
}

fn run(file: &Path) -> (Ran, Vec<String>) {
    let scratch = Scratch::new();
    let mut arguments =
        vec!["slice", file.to_str().unwrap(), "-q", "-o", "out.gcode", "--orient", "keep"];
    arguments.extend(MACHINE);
    let ran = scratch.run(&arguments);
    let names = scratch.names();
    (ran, names)
}

#[test]
fn every_mesh_ends_as_expected() {
    let Some(make) = shared("corpus/make.py") else { return };
    let scratch = Scratch::new();
    let folder = scratch.path("corpus");
    let made = Command::new("python3").arg(make).arg(&folder).output();
    if !made.is_ok_and(|output| output.status.success()) {
        return say("skipped: python3 does not write the corpus");
    }
    let text = std::fs::read_to_string(folder.join("expectations.json")).unwrap();
    let expectations: Value = serde_json::from_str(&text).unwrap();
    let cases = expectations["cases"].as_array().unwrap();
    let (mut faults, mut n_cases) = (Vec::new(), 0);
    let is_model = |case: &&Value| case["kind"] == "mesh" || case["kind"] == "extra";
    for case in cases.iter().filter(is_model) {
        let (Some(file), Some(id)) = (case["file"].as_str(), case["id"].as_str()) else { continue };
        n_cases += 1;
        let (ran, names) = run(&folder.join(file));
        if !is_as_expected(case, &ran) {
            faults.push(format!("{id}: {:?} {}", ran.code, ran.err));
        }
        let left: &[&str] = if ran.err.is_empty() { &["out.gcode"] } else { &[] };
        if names != left {
            faults.push(format!("{id} leaves {names:?}"));
        }
    }
    assert!(n_cases > 140, "{n_cases} cases are not the corpus");
    assert!(faults.is_empty(), "{} of {n_cases}:\n{}", faults.len(), faults.join("\n"));
}
