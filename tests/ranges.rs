//! Layers by ranges of heights: planar, curved, and what leads from the one to the other.

use serde_json::Value;

use crate::program::{Motion, motions, stl_volume};
use crate::run::{Scratch, model};

/// A nozzle that clears steep layers.
const SLIM: [&str; 6] = [
    "--set",
    "nozzle_flat_radius_mm=0.2",
    "--set",
    "nozzle_half_angle_deg=10",
    "--set",
    "nozzle_block_height_mm=60",
];

/// How thin and how thick layers of a blend may be, mm: half to one and a half layers.
const LIMITS_MM: [f64; 2] = [0.1, 0.3];

/// The report of a model with ranges, proved in full, and its program.
#[track_caller]
fn proved(name: &str, arguments: &[&str]) -> (Value, String) {
    let scratch = Scratch::new();
    let file = model(name);
    let mut all = vec!["slice", file.to_str().unwrap(), "-o", "out.gcode", "--json"];
    all.extend(["--verify", "full", "--set", "fill_density=100%", "--set", "skirts=0"]);
    all.extend(SLIM);
    all.extend(arguments);
    let ran = scratch.run(&all);
    assert_eq!(ran.code, Some(0), "{name} {arguments:?}: {}{}", ran.err, ran.out);
    let report = serde_json::from_str(&ran.out).unwrap();
    (report, std::fs::read_to_string(scratch.path("out.gcode")).unwrap())
}

#[test]
fn ranges_are_laid_as_told_and_the_proof_is_clean() {
    for (name, ranges, more) in [
        ("cube", "planar:0-8,blend:8-14,conical:14-", "--cone-angle=12"),
        ("cube", "planar:0-3,blend:3-8,conical:8-10,blend:10-15,planar", "--cone-angle=12"),
        ("dome", "planar:0-5,blend:5-10,caps:10-", "--cap-radius=70"),
        ("dome", "planar:0-5,blend:5-10,conical:10-", "--cone-angle=-10"),
        ("dome", "planar:-5,blend,spherical", "--sphere-centre=-60"),
        ("lens", "planar:0-1,spherical:1-", "--sphere-centre=-55.5685"),
    ] {
        let (report, text) = proved(name, &["--layers", ranges, more]);
        let laid = report["layers"]["ranges"].as_array().unwrap();
        let kinds: Vec<&str> = laid.iter().map(|range| range["kind"].as_str().unwrap()).collect();
        let words = ranges.split(',').map(|range| range.split(':').next().unwrap());
        assert_eq!(kinds, words.collect::<Vec<_>>(), "{name} {ranges}");
        // Each begins where the one below ends; blends keep to the limits.
        let number = |range: &Value, key: &str| range[key].as_f64().unwrap();
        for pair in laid.windows(2) {
            let gap = number(&pair[1], "from_mm") - number(&pair[0], "to_mm");
            assert!(gap.abs() < 1e-6, "{name} {ranges}: {laid:?}");
        }
        for range in laid.iter().filter(|range| range["kind"] == "blend") {
            let [thin, thick] = [number(range, "thinnest_mm"), number(range, "thickest_mm")];
            assert!(thin >= LIMITS_MM[0] - 1e-6 && thick <= LIMITS_MM[1] + 1e-6, "{range}");
        }
        let wanted = stl_volume(&std::fs::read(model(name)).unwrap());
        let volume: f64 =
            motions(&text).iter().filter(|motion| motion.lays()).map(Motion::volume).sum();
        let error = volume / wanted - 1.0;
        assert!(error.abs() <= 0.015, "{name} {ranges}: {:+.2} %", error * 100.0);
        // No layer is left out.
        let layers = text.lines().filter(|line| line.starts_with(";LAYER:")).count();
        let with_beads: std::collections::BTreeSet<usize> =
            motions(&text).iter().filter(|m| m.lays()).filter_map(|m| m.layer).collect();
        assert_eq!(with_beads.len(), layers, "{name} {ranges}");
    }
}

#[test]
fn beads_of_a_blend_are_as_thick_as_what_lies_between_its_layers() {
    let layers = "planar:0-8,blend:8-14,conical:14-";
    let (_, text) = proved("cube", &["--layers", layers, "--cone-angle=12"]);
    let spacing = 0.45 - 0.2 * (1.0 - std::f64::consts::FRAC_PI_4);
    let mut thicknesses = Vec::new();
    for bead in motions(&text).iter().filter(|m| m.lays() && m.role == "Perimeter") {
        if bead.path() > 0.3 && bead.layer.is_some_and(|layer| (41..60).contains(&layer)) {
            thicknesses.push(bead.volume() / bead.path() / spacing);
        }
    }
    assert!(thicknesses.len() > 100);
    let least = thicknesses.iter().copied().fold(f64::MAX, f64::min);
    let most = thicknesses.iter().copied().fold(0.0, f64::max);
    assert!(least > LIMITS_MM[0] - 0.005 && most < LIMITS_MM[1] + 0.005, "{least} to {most}");
    assert!(most - least > 0.03, "they change from the axis to the rim: {least} to {most}");
}

#[test]
fn ranges_that_cannot_be_are_refused_with_what_is_wrong() {
    let dome = model("dome");
    for (layers, class, code, said) in [
        ("planar:0-8,conical:9-", "Usage", 2, "nothing is printed from 8 to 9 mm"),
        ("planar:0-8,conical:7-", "Usage", 2, "overlap from 7 to 8 mm"),
        ("planar:0-8in,conical", "Usage", 2, "mm above the bed"),
        ("planar:0-8,blend:8-9,conical", "OutOfEnvelope", 5, "let the blend end at"),
        ("planar:0-3,conical:3-6", "OutOfEnvelope", 5, "the part is 15 mm high"),
    ] {
        let scratch = Scratch::new();
        let mut arguments = vec!["slice", dome.to_str().unwrap(), "-o", "out.gcode"];
        arguments.extend(["--layers", layers, "--cone-angle=15"]);
        let ran = scratch.run(&arguments);
        assert!(ran.err.contains(said), "{layers}: {}", ran.err);
        assert!(ran.err.starts_with(&format!("error[{class}]: ")), "{layers}: {}", ran.err);
        assert_eq!(ran.code, Some(code), "{layers}");
    }
    let scratch = Scratch::new();
    let setting = "layers=planar:0-8,conical:9-";
    let ran = scratch.run(&["slice", dome.to_str().unwrap(), "-o", "x.gcode", "--set", setting]);
    assert!(ran.err.contains("nothing is printed"), "{}", ran.err);
    ran.refused("ConfigRange", 6);
}
