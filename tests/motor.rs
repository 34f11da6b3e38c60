//! `rhumb motor`, and what a motor's load makes of a print.

use crate::run::{Scratch, model};

fn said(scratch: &Scratch, arguments: &[&str]) -> serde_json::Value {
    let ran = scratch.run(&[arguments, &["--json"]].concat()).expect(0);
    serde_json::from_str(&ran.out).unwrap()
}

#[test]
fn ten_degrees_end_within_two_hundredths() {
    let scratch = Scratch::new();
    let words = scratch.run(&["motor", "--angle", "10", "-o", "m.svg"]).expect(0).out;
    assert!(words.contains("final error"), "{words}");
    let picture = std::fs::read_to_string(scratch.path("m.svg")).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains("phase currents"));
    for angle in ["10", "-10", "0.5", "90"] {
        let all = said(&scratch, &["motor", "--angle", angle]);
        let error = all["final_error_deg"].as_f64().unwrap();
        assert!(error.abs() < 0.02, "{angle}: {all}");
        assert!(all["peak_current_a"].as_f64().unwrap() < 2.7, "{all}");
    }
    // Without feedback a load stays where its load angle puts it.
    let open = said(&scratch, &["motor", "--open-loop", "--load", "0.2"]);
    let error = open["final_error_deg"].as_f64().unwrap();
    let expected = open["load_angle_deg"].as_f64().unwrap();
    assert!((error + expected).abs() < 0.1, "{open}");
    assert!(
        said(&scratch, &["motor", "--load", "0.2"])["final_error_deg"].as_f64().unwrap() < 0.02
    );
}

#[test]
fn a_turn_that_makes_no_sense_is_refused() {
    let scratch = Scratch::new();
    for arguments in [
        &["motor", "--speed", "0"][..],
        &["motor", "--angle", "nan"],
        &["motor", "--inertia=-1"],
        &["motor", "-o", "m.png"],
    ] {
        scratch.run(arguments).refused("Usage", 2);
    }
    scratch.run(&["motor", "--speed", "1e-6"]).refused("LimitExceeded", 8);
    assert!(scratch.names().is_empty());
}

#[test]
fn a_heavy_bed_lags_more() {
    let scratch = Scratch::new();
    let file = model("cube");
    scratch.run(&["slice", file.to_str().unwrap(), "-q", "-o", "a.gcode"]).expect(0);
    let lag = |inertia: &str| {
        let set = format!("bed_inertia_kg_m2={inertia}");
        said(&scratch, &["verify", "a.gcode", "--proof", "quick", "--load-angle", "--set", &set])
            ["load_angle"]
            .clone()
    };
    let light = lag("0.001")["worst_mm"].as_f64().unwrap();
    let heavy = lag("0.004")["worst_mm"].as_f64().unwrap();
    assert!(light > 0.0 && heavy > 3.0 * light && heavy < 5.0 * light, "{light} {heavy}");
    assert_eq!(lag("0.004")["too_weak"], 0);
    assert!(lag("1")["too_weak"].as_u64().unwrap() > 0);
}
