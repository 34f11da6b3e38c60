//! The time that is told is the time that the machine takes.

use crate::run::{Scratch, model};

/// The estimate in the report, and what the twin makes of the finished text, s.
fn times(name: &str, arguments: &[&str]) -> (f64, f64) {
    let scratch = Scratch::new();
    let file = model(name);
    let mut all = vec!["slice", file.to_str().unwrap(), "-o", "made.gcode", "--json"];
    all.push("--no-verify");
    all.extend(arguments);
    let told: serde_json::Value = serde_json::from_str(&scratch.run(&all).out).unwrap();
    // Findings are for others to judge.
    let ran = scratch
        .run(&["verify", "made.gcode", "--json"].iter().chain(arguments).collect::<Vec<_>>());
    let taken: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    (told["print"]["time_s"].as_f64().unwrap(), taken["time_s"].as_f64().unwrap())
}

#[test]
fn estimates_are_those_of_the_twin_within_5_percent() {
    for name in ["cone", "cross", "cube", "dome", "gear", "lens", "mushroom", "steps", "vase"] {
        let (told, taken) = times(name, &[]);
        assert!((told / taken - 1.0).abs() < 0.05, "{name}: {told} s told, {taken} s taken");
    }
}

#[test]
fn and_on_the_printers_of_every_firmware() {
    for printer in ["klipper-polar", "rrf-polar", "marlin-polar", "grblhal-polar", "core-r-theta"] {
        let (told, taken) = times("cross", &["--printer", printer]);
        assert!((told / taken - 1.0).abs() < 0.05, "{printer}: {told} s told, {taken} s taken");
    }
    let (told, taken) = times("cube", &["--dialect", "cartesian"]);
    assert!((told / taken - 1.0).abs() < 0.05, "cartesian: {told} s told, {taken} s taken");
}
