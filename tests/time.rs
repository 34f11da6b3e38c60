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
    // Findings are for others to judge; the surface of the layers is in the program.
    let mut again = vec!["verify", "made.gcode", "--json"];
    for pair in arguments.chunks(2).filter(|pair| pair[0] != "--layers") {
        again.extend(pair);
    }
    let ran = scratch.run(&again);
    let taken: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    (told["print"]["time_s"].as_f64().unwrap(), taken["time_s"].as_f64().unwrap())
}

#[test]
fn estimates_are_those_of_the_twin_within_5_percent() {
    for name in [
        "cone", "cross", "cube", "dome", "gear", "lens", "mushroom", "steps", "umbrella", "vase",
        "wall-0.6",
    ] {
        let (told, taken) = times(name, &[]);
        assert!((told / taken - 1.0).abs() < 0.01, "{name}: {told} s told, {taken} s taken");
    }
    for layers in ["conical", "spherical"] {
        for name in ["lens", "steps", "wall-0.6"] {
            let (told, taken) = times(name, &["--layers", layers]);
            assert!((told / taken - 1.0).abs() < 0.01, "{name} {layers}: {told} s, {taken} s");
        }
    }
}

#[test]
fn and_on_the_printers_of_every_firmware() {
    for printer in [
        "klipper-polar",
        "rrf-polar",
        "marlin-polar",
        "grblhal-polar",
        "core-r-theta",
        "linuxcnc-rotary",
    ] {
        let (told, taken) = times("wall-0.6", &["--printer", printer]);
        assert!((told / taken - 1.0).abs() < 0.01, "{printer}: {told} s told, {taken} s taken");
        let (told, taken) = times("lens", &["--printer", printer, "--layers", "conical"]);
        assert!((told / taken - 1.0).abs() < 0.01, "{printer}: {told} s told, {taken} s taken");
    }
    let (told, taken) = times("cube", &["--dialect", "cartesian"]);
    assert!((told / taken - 1.0).abs() < 0.05, "cartesian: {told} s told, {taken} s taken");
}
