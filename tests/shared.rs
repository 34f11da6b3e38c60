//! The models of the folder `shared` beside the repository: what people print, and what is awkward.

use serde_json::Value;

use crate::run::{Scratch, shared};

/// What status 1 tells: a repair that is a guess, a flat face that no layer ends on.
const NEEDS_A_LOOK: [&str; 2] = ["ShapeGuessed", "FlatMissed"];

/// Thick layers: three fifths of the time of 0.2 mm, and all the same code.
const COARSE: [&str; 4] = ["--set", "layer_height_mm=0.32", "--set", "first_layer_height_mm=0.32"];

/// Slices all models of a folder; returns how many there were.
fn slice_all(folder: &str) -> usize {
    let Some(folder) = shared(folder) else { return usize::MAX };
    let mut models: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "stl"))
        .collect();
    models.sort();
    for model in &models {
        let name = model.file_stem().unwrap().to_str().unwrap();
        let scratch = Scratch::new();
        let mut arguments = vec!["slice", model.to_str().unwrap(), "-o", "out.gcode", "--json"];
        arguments.extend(COARSE);
        let ran = scratch.run(&arguments);
        assert!(ran.err.is_empty(), "{name}: {}", ran.err);
        let report: Value = serde_json::from_str(&ran.out).unwrap();
        let warnings = report["warnings"].as_array().unwrap();
        let look = warnings.iter().any(|w| NEEDS_A_LOOK.contains(&w["code"].as_str().unwrap()));
        assert_eq!(ran.code, Some(i32::from(look)), "{name}: {warnings:?}");
        assert_eq!(report["verify"]["findings"], serde_json::json!([]), "{name}");
        assert!(report["print"]["part_mm3"].as_f64().unwrap() > 100.0, "{name} is not printed");
        assert!(report["layers"]["count"].as_u64().unwrap() > 5, "{name}");
        assert_eq!(scratch.names(), ["out.gcode"], "{name}");
    }
    models.len()
}

#[test]
fn generated_models_are_sliced_without_a_finding() {
    assert!(slice_all("models/gen") >= 9);
}

#[test]
fn real_models_are_sliced_without_a_finding() {
    assert!(slice_all("models/real") >= 16);
}
