//! Any settings with any model: random ones by a fixed rule, through the slice and its check. 40 of
//! them, or as many as `RHUMB_SWEEP` says, from `RHUMB_SWEEP_FROM` on.

use std::collections::BTreeMap;

use mesh::mesh::Mesh;
use mesh::shapes;
use serde_json::Value;

use crate::run::{Scratch, say};

/// A sequence of numbers that look random (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[(self.next() % of.len() as u64) as usize]
    }
}

fn a_model(random: &mut Random) -> Mesh {
    let size = random.within(3.0, 12.0);
    match random.next() % 8 {
        0 => shapes::cube(size),
        1 => shapes::block(size, random.within(0.3, 8.0), random.within(0.5, 6.0)),
        2 => shapes::cross(size),
        3 => shapes::tetrahedron(size),
        4 => shapes::cone(size / 2.0, random.within(1.0, 8.0), 24),
        5 => shapes::dome(size / 2.0, 24),
        6 => shapes::torus(size, random.within(0.4, 2.0), 24, 12),
        _ => shapes::icosphere(2, size / 2.0),
    }
}

fn settings(random: &mut Random) -> Vec<String> {
    let mut set = Vec::new();
    let height = random.within(0.12, 0.32);
    let mut may = |random: &mut Random, name: &str, value: String| {
        if random.next().is_multiple_of(2) {
            set.push(format!("{name}={value}"));
        }
    };
    let number = |random: &mut Random, low, high| format!("{:.3}", random.within(low, high));
    let count = |random: &mut Random, most: u64| (random.next() % (most + 1)).to_string();
    may(random, "layer_height_mm", format!("{height:.3}"));
    let value = number(random, 0.15, 0.32);
    may(random, "first_layer_height_mm", value);
    for (name, most) in [
        ("perimeters", 4),
        ("top_solid_layers", 4),
        ("bottom_solid_layers", 4),
        ("skirts", 2),
        ("base_layers", 5),
    ] {
        let value = count(random, most);
        may(random, name, value);
    }
    for (name, low, high) in [
        ("fill_density", 0.0, 1.0),
        ("fill_angle_deg", 0.0, 180.0),
        ("brim_width_mm", 0.0, 3.0),
        ("retract_length_mm", 0.0, 2.0),
        ("retract_lift_mm", 0.0, 0.5),
        ("wipe_mm", 0.0, 2.0),
        ("extrusion_multiplier", 0.9, 1.1),
        ("external_perimeter_extrusion_width_mm", 0.36, 0.6),
        ("perimeter_extrusion_width_mm", 0.36, 0.6),
        ("infill_extrusion_width_mm", 0.36, 0.6),
        ("bed_speed_deg_per_s", 90.0, 720.0),
        ("rail_speed_mm_per_s", 20.0, 300.0),
        ("perimeter_speed_mm_per_s", 5.0, 150.0),
    ] {
        let value = number(random, low, high);
        may(random, name, value);
    }
    let patterns = [
        "rectilinear",
        "grid",
        "triangles",
        "stars",
        "cubic",
        "gyroid",
        "honeycomb",
        "concentric",
        "archimedeanchords",
    ];
    let value = random.one(&patterns).to_owned();
    may(random, "fill_pattern", value);
    let value = random.one(&["rectilinear", "concentric"]).to_owned();
    may(random, "solid_fill_pattern", value);
    let value = random.one(&["true", "false"]).to_owned();
    may(random, "adaptive", value);
    set
}

fn arguments(random: &mut Random) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    let dialects = ["polar", "klipper-polar", "rrf-polar", "marlin-polar", "grblhal-polar"];
    let place = format!("{:.2},{:.2}", random.within(-40.0, 40.0), random.within(-40.0, 40.0));
    let pose = random.one(&["flat", "keep", "30,40,50", "1"]);
    match random.next() % 4 {
        0 => all.extend(["--layers".into(), "conical".into()]),
        1 => all.extend(["--layers".into(), "spherical".into()]),
        _ => {}
    }
    if random.next().is_multiple_of(2) {
        all.extend(["--place".into(), place]);
    }
    all.extend(["--orient".into(), pose.into()]);
    all.extend(["--dialect".into(), random.one(&dialects).into()]);
    for pair in settings(random) {
        all.extend(["--set".into(), pair]);
    }
    all
}

/// Whether a run ended well; what is wrong otherwise. What the check finds must have been told before,
/// by a warning; a program that it refuses is a fault of the planner.
fn fault(code: Option<i32>, out: &str, err: &str) -> Option<String> {
    match code {
        // Refused for a reason: model and machine, settings that do not go together, or a budget.
        Some(5 | 6 | 8) if err.starts_with("error[") => None,
        Some(0 | 1) => {
            let report: Value = serde_json::from_str(out).ok()?;
            let findings = report["verify"]["findings"].as_array()?;
            let is_explained = report["warnings"].as_array().is_some_and(|all| !all.is_empty());
            let is_fine = if code == Some(0) { findings.is_empty() } else { is_explained };
            (!is_fine).then(|| format!("{findings:?} {:?}", report["warnings"]))
        }
        _ => Some(format!("{code:?} {err}")),
    }
}

/// The class of a refusal.
fn class(err: &str) -> String {
    let class = err.strip_prefix("error[").and_then(|rest| rest.split(']').next());
    class.unwrap_or("none").to_owned()
}

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

#[test]
fn any_settings_with_any_model_give_a_sound_program_or_a_reason() {
    let from = number("RHUMB_SWEEP_FROM", 0);
    let (mut faults, mut n_printed) = (Vec::new(), 0);
    let mut refused = BTreeMap::<String, Vec<u64>>::new();
    let count = number("RHUMB_SWEEP", 40);
    for seed in from..from + count {
        let mut random = Random(seed);
        let scratch = Scratch::new();
        scratch.file("m.stl", mesh::stl::write(&a_model(&mut random)));
        let more = arguments(&mut random);
        let mut all: Vec<String> =
            ["slice", "m.stl", "-o", "x.gcode", "--json"].map(String::from).to_vec();
        all.extend(more.iter().cloned());
        let ran = scratch.run(&all);
        match ran.code {
            Some(0 | 1) => n_printed += 1,
            _ => refused.entry(class(&ran.err)).or_default().push(seed),
        }
        if let Some(fault) = fault(ran.code, &ran.out, &ran.err) {
            let kept = format!("{}/sweep-{seed}.stl", env!("CARGO_TARGET_TMPDIR"));
            std::fs::copy(scratch.path("m.stl"), &kept).unwrap();
            faults.push(format!("seed {seed}: {fault}\n  {kept} {}", more.join(" ")));
        }
    }
    say(&format!("{n_printed} of {count} are printed; refused are {refused:?}"));
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
    assert!(n_printed * 2 > count, "only {n_printed} of {count} are printed: {refused:?}");
}
