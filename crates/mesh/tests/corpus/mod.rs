//! Every mesh case of the corpus, as far as reading and mending decide it.

use super::{say, shared};
use mesh::health::{Health, solid_from_soup};
use mesh::stl;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Codes and classes that only the printer's envelope or the layers can decide.
const LATER: [&str; 9] = [
    "OutOfEnvelope",
    "NothingToPrint",
    "UnitsSuspect",
    "Recentred",
    "ThinFeatures",
    "AtEnvelope",
    "FloatingPart",
    "SmallFirstLayer",
    "LimitExceeded",
];

/// Notes beyond the expected ones, which are true all the same.
const MORE_NOTES: [(&str, &str); 2] = [
    // Walls and lids of the file run against each other: 12 edges are used twice the same way.
    ("stl/bowtie_prism", "FacetsReoriented"),
    // The fin encloses nothing and cannot be printed.
    ("stl/nonmanifold_edge3", "OpenShellDropped"),
];

#[test]
fn every_mesh_case_is_as_expected() {
    let Some(make) = shared("corpus/make.py") else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("corpus");
    let made = Command::new("python3").arg(make).arg(&folder).output();
    if !made.is_ok_and(|output| output.status.success()) {
        say("skipped: python3 does not write the corpus");
        return;
    }
    let text = std::fs::read_to_string(folder.join("expectations.json")).unwrap();
    let expectations: Value = serde_json::from_str(&text).unwrap();
    let mut faults = Vec::new();
    let mut n_cases = 0;
    for case in expectations["cases"].as_array().unwrap() {
        let Some(file) = case["file"].as_str() else { continue };
        if case["kind"] == "mesh" {
            n_cases += 1;
            let bytes = std::fs::read(folder.join(file)).unwrap();
            let found = faults_of(case, &bytes);
            faults.extend(found.into_iter().map(|f| format!("{}: {f}", case["id"])));
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(n_cases > 150, "the corpus is empty");
    assert!(faults.is_empty(), "{} of {n_cases} cases:\n{}", faults.len(), faults.join("\n"));
}

fn strings(value: &Value) -> Vec<&str> {
    value.as_array().into_iter().flatten().filter_map(Value::as_str).collect()
}

/// What is not as expected.
fn faults_of(case: &Value, bytes: &[u8]) -> Vec<String> {
    let error = case["error"].as_str();
    let wanted = error.filter(|class| !LATER.contains(class));
    let (soup, report) = match stl::read(bytes) {
        Ok(read) => read,
        Err(error) => {
            let mut faults = class_faults(case, wanted, error.class());
            let text = format!("{error}; {}", error.hint().unwrap_or_default());
            if let Some(word) = case["message"].as_str().filter(|word| !text.contains(word)) {
                faults.push(format!("'{word}' is not in: {text}"));
            }
            let line = format!("line {}", case["line"]);
            if case["line"].is_u64() && !text.starts_with(&line) {
                faults.push(format!("{line} expected: {text}"));
            }
            return faults;
        }
    };
    match solid_from_soup(&soup) {
        // The envelope is looked at before the mesh: what it refuses may come out anyhow.
        Err(_) if error.is_some() && wanted.is_none() => Vec::new(),
        Err(error) => class_faults(case, wanted, error.class()),
        Ok((solid, health)) => {
            solid.check().unwrap();
            let mut faults = Vec::new();
            if let Some(class) = wanted {
                faults.push(format!("{class} expected, a solid found"));
            }
            let health = health.with_read(&report);
            faults.extend(note_faults(case, &health));
            faults.extend(fact_faults(&case["facts"], &health));
            faults
        }
    }
}

fn class_faults(case: &Value, wanted: Option<&str>, class: &str) -> Vec<String> {
    if wanted == Some(class) || strings(&case["also"]).contains(&class) {
        return Vec::new();
    }
    vec![format!("{} expected, {class} found", wanted.unwrap_or("a solid"))]
}

fn note_faults(case: &Value, health: &Health) -> Vec<String> {
    let codes: Vec<&str> = health.notes.iter().map(|n| n.code).collect();
    let wanted = strings(&case["warn"]);
    let missing = wanted.iter().filter(|c| !LATER.contains(c) && !codes.contains(c));
    let mut faults: Vec<String> = missing.map(|c| format!("no note {c}")).collect();
    if case["error"].is_null() {
        let id = case["id"].as_str().unwrap();
        let is_known = |code: &str| wanted.contains(&code) || MORE_NOTES.contains(&(id, code));
        let more = health.notes.iter().filter(|n| !is_known(n.code));
        faults.extend(more.map(|n| format!("unexpected note {}: {}", n.code, n.message)));
    }
    faults
}

fn fact_faults(facts: &Value, health: &Health) -> Vec<String> {
    let mut faults = Vec::new();
    let mut compare = |name: &str, found: f64, tolerance: f64| {
        if let Some(wanted) = facts[name].as_f64()
            && (found - wanted).abs() > tolerance * wanted.abs().max(1e-3)
        {
            faults.push(format!("{name} is {found}, expected {wanted}"));
        }
    };
    compare("triangles", health.facets as f64, 0.0);
    compare("volume_mm3", health.volume_before_mm3, 1e-4);
    compare("open_edges", health.open_edges as f64, 0.0);
    compare("nonmanifold_edges", health.nonmanifold_edges as f64, 0.0);
    compare("components", health.shells as f64, 0.0);
    if !health.overlaps {
        compare("volume_mm3_union", health.volume_mm3, 1e-6);
    }
    faults
}
