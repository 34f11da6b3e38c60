//! What `slice` and its companions hand over: program, report, placed mesh, verdict.

use serde_json::Value;

use crate::program::{Motion, motions, stl_volume};
use crate::run::{Scratch, model};

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_summary_for_people_goes_to_standard_output() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    let ran = scratch.run(&["slice", "cube.stl"]).expect(0);
    assert!(ran.err.is_empty(), "{}", ran.err);
    for word in ["5 x 5 x 5 mm", "25 of 0.2 mm", "cube.gcode"] {
        assert!(ran.out.contains(word), "{word}: {}", ran.out);
    }
    let quiet = scratch.run(&["slice", "cube.stl", "-q"]).expect(0);
    assert!(quiet.out.is_empty() && quiet.err.is_empty());
    assert_eq!(scratch.names(), ["cube.gcode", "cube.stl"]);
}

#[test]
fn the_program_on_standard_output_is_that_of_the_file() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    scratch.run(&["slice", "cube.stl"]).expect(0);
    let ran = scratch.run(&["slice", "cube.stl", "-o", "-"]).expect(0);
    assert!(ran.out == std::fs::read_to_string(scratch.path("cube.gcode")).unwrap());
    // The words for people are elsewhere, where they do not mix.
    assert!(ran.err.contains("5 x 5 x 5 mm"), "{}", ran.err);
}

#[test]
fn a_model_can_come_through_a_pipe() {
    let scratch = Scratch::new();
    let file = std::fs::File::open(scratch.cube("cube.stl", 5.0)).unwrap();
    let output = scratch.rhumb(&["slice", "-"]).stdin(file).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(scratch.names(), ["cube.stl", "model.gcode"]);
}

#[test]
fn the_report_tells_the_truth_about_the_program() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 10.0);
    let arguments = ["slice", "cube.stl", "--report", "r.json", "--json", "-o", "c.gcode"];
    let ran = scratch.run(&arguments).expect(0);
    let report = json(&std::fs::read_to_string(scratch.path("r.json")).unwrap());
    assert_eq!(json(&ran.out), report, "both ways say the same");
    let text = std::fs::read_to_string(scratch.path("c.gcode")).unwrap();
    let motions = motions(&text);
    assert_eq!(report["rhumb"], env!("CARGO_PKG_VERSION"));
    assert_eq!(report["model"]["file"], "cube.stl");
    assert_eq!(report["model"]["triangles"], 12);
    let number = |path: &str| report.pointer(path).unwrap().as_f64().unwrap();
    let close = |path: &str, wanted: f64, share: f64| {
        let found = number(path);
        assert!((found - wanted).abs() <= share * wanted.abs(), "{path}: {found}, not {wanted}");
    };
    close("/model/volume_mm3", 1000.0, 1e-6);
    assert_eq!(report["model"]["bounds_mm"][0], serde_json::json!([-5.0, -5.0, 0.0]));
    assert_eq!(report["mesh"]["shells"], 1);
    assert_eq!(report["layers"]["kind"], "planar");
    assert_eq!(report["layers"]["count"], 50);
    assert_eq!(report["layers"]["levels_mm"].as_array().unwrap().len(), 50);
    assert_eq!(report["orientation"]["normal_model"], serde_json::json!([0.0, 0.0, -1.0]));
    let laid = |m: &&Motion| m.lays();
    close("/print/extruded_mm3", motions.iter().filter(laid).map(Motion::volume).sum(), 1e-4);
    let travels = motions.iter().filter(|m| !m.lays() && m.path() > 0.0);
    close("/print/travel_mm", travels.map(Motion::path).sum(), 1e-3);
    let retractions = motions.iter().filter(|m| m.e < 0.0).count();
    // The last time, the filament stays where it is drawn back to.
    close("/print/retractions", retractions as f64, 1.0 / retractions as f64);
    assert_eq!(report["verify"]["findings"], serde_json::json!([]));
    for stage in ["read", "repair", "orient", "slice", "verify", "total"] {
        assert!(report["timings_ms"][stage].as_f64().unwrap() >= 0.0, "{stage}");
    }
}

#[test]
fn the_placed_mesh_is_the_one_that_was_sliced() {
    let scratch = Scratch::new();
    let run = ["slice", model("steps").to_str().unwrap(), "-o", "s.gcode", "--orient", "90,0,30"]
        .into_iter()
        .chain(["--place", "30,10", "--scale", "0.5", "--export-placed", "placed.stl"])
        .map(str::to_owned)
        .collect::<Vec<_>>();
    scratch.run(&run).expect(0);
    let placed = std::fs::read(scratch.path("placed.stl")).unwrap();
    let volume = stl_volume(&std::fs::read(model("steps")).unwrap()) / 8.0;
    assert!((stl_volume(&placed) / volume - 1.0).abs() < 1e-4);
    let inspected = scratch.run(&["inspect", "placed.stl", "--json"]).expect(0);
    let bounds = &json(&inspected.out)["bounds_mm"];
    assert!(bounds[0][2].as_f64().unwrap().abs() < 1e-6, "it stands on the bed: {bounds}");
    scratch.run(&["verify", "s.gcode", "--model", "placed.stl"]).expect(0);
}

/// A cube without the two sides that share an edge: closing it is a guess.
fn without_two_sides() -> Vec<u8> {
    let bytes = std::fs::read(model("cube")).unwrap();
    let corner = |facet: &[u8], k: usize, axis: usize| {
        let at = 12 + 12 * k + 4 * axis;
        f32::from_le_bytes(facet[at..at + 4].try_into().unwrap())
    };
    let on =
        |facet: &[u8], axis: usize, value: f32| (0..3).all(|k| corner(facet, k, axis) == value);
    let kept: Vec<&[u8]> = bytes[84..]
        .chunks_exact(50)
        .filter(|facet| !on(facet, 0, 10.0) && !on(facet, 1, 10.0))
        .collect();
    let count = u32::try_from(kept.len()).unwrap();
    [&bytes[..80], &count.to_le_bytes(), &kept.concat()].concat()
}

#[test]
fn a_guessed_repair_is_printed_and_told_by_status_1() {
    let scratch = Scratch::new();
    scratch.file("open.stl", without_two_sides());
    let ran = scratch.run(&["slice", "open.stl", "--json"]).expect(1);
    let warnings = json(&ran.out)["warnings"].to_string();
    assert!(warnings.contains("ShapeGuessed"), "{warnings}");
    assert_eq!(scratch.names(), ["open.gcode", "open.stl"]);
    let people = scratch.run(&["slice", "open.stl"]).expect(1);
    assert!(people.out.contains("ShapeGuessed"), "{}", people.out);
}

#[test]
fn a_repair_without_doubt_is_told_and_is_status_0() {
    let scratch = Scratch::new();
    let mut bytes = std::fs::read(model("cube")).unwrap();
    // One facet the wrong way round.
    let (second, third) = (84 + 24, 84 + 36);
    for k in 0..12 {
        bytes.swap(second + k, third + k);
    }
    scratch.file("turned.stl", bytes);
    let ran = scratch.run(&["slice", "turned.stl", "--json"]).expect(0);
    let report = json(&ran.out);
    assert_eq!(report["mesh"]["flipped"], 1);
    assert_eq!(report["mesh"]["repairs"], serde_json::json!(["FacetsReoriented"]));
    assert!((report["model"]["volume_mm3"].as_f64().unwrap() - 8000.0).abs() < 1e-3);
}

#[test]
fn inspect_finds_what_is_wrong_and_changes_nothing() {
    let scratch = Scratch::new();
    let open = without_two_sides();
    scratch.file("open.stl", &open);
    let ran = scratch.run(&["inspect", "open.stl", "--json"]).expect(1);
    assert_eq!(json(&ran.out)["open_edges"], 6);
    assert_eq!(std::fs::read(scratch.path("open.stl")).unwrap(), open);
    assert_eq!(scratch.names(), ["open.stl"]);
    let sound = scratch.run(&["inspect", model("gear").to_str().unwrap(), "--json"]).expect(0);
    assert_eq!(json(&sound.out)["open_edges"], 0);
}

#[test]
fn orient_lays_a_part_on_its_largest_face() {
    let scratch = Scratch::new();
    scratch.file("plank.stl", mesh::stl::write(&mesh::shapes::block(5.0, 20.0, 40.0)));
    let ran = scratch.run(&["orient", "plank.stl", "--json", "-o", "laid.stl"]).expect(0);
    let best = &json(&ran.out)["candidates"][0];
    assert_eq!(best["height_mm"], 5.0);
    assert_eq!(best["bed_area_mm2"], 800.0);
    let laid = scratch.run(&["inspect", "laid.stl", "--json"]).expect(0);
    assert_eq!(json(&laid.out)["bounds_mm"][1][2], 5.0);
}

#[test]
fn verify_accepts_what_slice_writes_and_finds_what_was_broken() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 10.0);
    scratch.run(&["slice", "cube.stl"]).expect(0);
    scratch.run(&["verify", "cube.gcode", "--model", "cube.stl"]).expect(0);
    let text = std::fs::read_to_string(scratch.path("cube.gcode")).unwrap();
    let line = motions(&text).iter().rev().find(|motion| motion.lays()).unwrap().line;
    let broken: Vec<String> = (1..)
        .zip(text.lines())
        .map(|(number, words)| if number == line { "G1 R121 T0 E9".into() } else { words.into() })
        .collect();
    scratch.file("broken.gcode", broken.join("\n") + "\n");
    let ran = scratch.run(&["verify", "broken.gcode", "--json"]).expect(1);
    let found = &json(&ran.out)["verify"]["findings"];
    let found = found.as_array().unwrap();
    let reach = found.iter().find(|finding| finding["check"] == "reach").unwrap();
    assert_eq!(reach["line"], line);
    assert_eq!((&reach["measured"], &reach["limit"]), (&121.0.into(), &120.0.into()));
}

#[test]
fn preview_draws_a_program_and_one_layer() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    scratch.run(&["slice", "cube.stl"]).expect(0);
    scratch.run(&["preview", "cube.gcode", "-o", "all.svg"]).expect(0);
    scratch.run(&["preview", "cube.gcode", "-o", "one.svg", "--layer", "3"]).expect(0);
    let read = |name: &str| std::fs::read_to_string(scratch.path(name)).unwrap();
    for name in ["all.svg", "one.svg"] {
        assert!(read(name).starts_with("<svg") || read(name).starts_with("<?xml"), "{name}");
        assert!(read(name).trim_end().ends_with("</svg>"), "{name}");
    }
    assert_ne!(read("all.svg"), read("one.svg"));
    scratch.run(&["preview", "cube.gcode", "-o", "p.bmp"]).refused("Usage", 2);
}
