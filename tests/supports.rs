//! Supports: under all that hangs over, nowhere else, apart from the part, and gone where the surface
//! of the layers carries the part itself.

use std::collections::BTreeMap;

use mesh::mesh::Mesh;
use mesh::shapes::{cube, extruded};
use nalgebra::{Isometry3, Vector3};
use serde_json::Value;

use crate::program::{FILAMENT_AREA, Motion, motions};
use crate::run::{Scratch, model};

const BODY: &str = "Support material";
const INTERFACE: &str = "Support material interface";

const ON: [&str; 2] = ["--set", "support_material=true"];

/// The stem of the table, half its width; its plate, half its length and from which height on; mm.
const STEM: f64 = 3.0;
const PLATE: f64 = 10.0;
const UNDERSIDE: f64 = 6.0;

/// A profile in the upright plane through x, 12 mm deep along y.
fn upright(profile: &[[f64; 2]]) -> Mesh {
    let flat = extruded(profile, &[], 12.0);
    let raised = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
    let centred = Isometry3::translation(0.0, 6.0, 0.0);
    flat.transformed(&(centred * raised))
}

/// A plate on a stem; on a foot as wide as itself, if wanted.
fn table(with_foot: bool) -> Mesh {
    let foot = [[-PLATE, 0.0], [PLATE, 0.0], [PLATE, 1.0], [STEM, 1.0]];
    let stem = [[STEM, UNDERSIDE], [PLATE, UNDERSIDE], [PLATE, 7.4], [-PLATE, 7.4]];
    let back = [[-PLATE, UNDERSIDE], [-STEM, UNDERSIDE]];
    let mut profile = Vec::new();
    profile.extend(if with_foot { foot.to_vec() } else { vec![[-STEM, 0.0], [STEM, 0.0]] });
    profile.extend(stem);
    profile.extend(back);
    profile.extend(with_foot.then_some([[-STEM, 1.0], [-PLATE, 1.0]]).into_iter().flatten());
    upright(&profile)
}

/// Slices a mesh where it stands, checked in full, and returns the program and the report.
fn sliced(mesh: &Mesh, more: &[&str]) -> (String, Value) {
    let scratch = Scratch::new();
    scratch.file("m.stl", mesh::stl::write(mesh));
    let mut all = vec!["slice", "m.stl", "-q", "-o", "x.gcode", "--orient", "keep"];
    all.extend(["--place", "0,0", "--verify", "full", "--report", "r.json"]);
    all.extend(more);
    // What hangs in the air is found, and sliced all the same.
    assert!(matches!(scratch.run(&all).code, Some(0 | 1)));
    let text = std::fs::read_to_string(scratch.path("x.gcode")).unwrap();
    let report = std::fs::read(scratch.path("r.json")).unwrap();
    (text, serde_json::from_slice(&report).unwrap())
}

fn of<'a, 'b>(motions: &'b [Motion<'a>], role: &'b str) -> impl Iterator<Item = &'b Motion<'a>> {
    motions.iter().filter(move |motion| motion.lays() && motion.role == role)
}

/// Places of a motion, no farther apart than half a bead.
fn places(motion: &Motion<'_>) -> Vec<[f64; 3]> {
    let count = (motion.path() / 0.2).ceil().max(1.0) as u32;
    (0..=count).map(|k| motion.at(f64::from(k) / f64::from(count))).collect()
}

#[test]
fn all_that_hangs_over_is_supported_with_a_gap() {
    let (text, report) = sliced(&table(false), &ON);
    let all = motions(&text);
    assert_eq!(report["verify"]["findings"], Value::Array(Vec::new()));
    // In whole layers, the least gap of 0.2 mm is the one below the plate.
    let top = UNDERSIDE - 0.2;
    let dense: Vec<[f64; 3]> = of(&all, INTERFACE).flat_map(places).collect();
    let highest: Vec<&[f64; 3]> = dense.iter().filter(|p| (p[2] - top).abs() < 0.01).collect();
    for i in -60..=60 {
        for j in -29..=29 {
            let (x, y) = (f64::from(i) * 0.16, f64::from(j) * 0.2);
            // Half a bead is as near to the stem as a line can come.
            if x.abs() < STEM + 0.25 + 0.4 {
                continue;
            }
            let near = highest.iter().any(|p| (p[0] - x).hypot(p[1] - y) < 0.4);
            assert!(near, "nothing carries the plate at {x:.2} {y:.2}");
        }
    }
    for p in dense.iter().copied().chain(of(&all, BODY).flat_map(places)) {
        assert!(p[2] <= top + 0.001, "{p:?} is too near to the plate");
        // The corners of the gap are round.
        let aside = (p[0].abs() - STEM).max(0.0).hypot((p[1].abs() - 6.0).max(0.0));
        assert!(aside >= 0.25 + 0.2 - 0.05, "{p:?} is too near to the stem");
        assert!(p[0].abs() < PLATE + 1.5 && p[1].abs() < 7.5, "{p:?} is under nothing");
    }
    let lowest = of(&all, BODY).map(|motion| motion.to[2]).fold(f64::INFINITY, f64::min);
    assert!((lowest - 0.2).abs() < 0.001, "columns stand on the bed");
    // The report says how much of the filament is broken away.
    let filament: f64 =
        all.iter().filter(|m| m.role == BODY || m.role == INTERFACE).map(|m| m.e).sum();
    let told = report["print"]["support_filament_mm"].as_f64().unwrap();
    // Filament is drawn back and pushed again between lines.
    assert!((told - filament).abs() < 3.0, "{told} mm of filament, laid {filament} mm");
    assert!(told * FILAMENT_AREA > 100.0);
}

#[test]
fn nothing_is_supported_that_stands_by_itself() {
    let (text, report) = sliced(&cube(10.0), &ON);
    assert!(!text.contains(";TYPE:Support"));
    assert!(report["print"].get("support_filament_mm").is_none());
    // Nor is anything unless it is asked for; then the plate hangs in the air.
    let (text, report) = sliced(&table(false), &[]);
    assert!(!text.contains(";TYPE:Support"));
    assert_ne!(report["verify"]["findings"], Value::Array(Vec::new()));
    let (text, _) = sliced(
        &table(false),
        &["--set", "support_material=true", "--set", "support_material_auto=false"],
    );
    assert!(!text.contains(";TYPE:Support"));
}

#[test]
fn supports_stand_on_the_part_unless_only_the_bed_may_carry_them() {
    let lowest = |text: &str| {
        let all = motions(text);
        let heights = of(&all, BODY).chain(of(&all, INTERFACE)).map(|m| m.to[2]);
        heights.fold(f64::INFINITY, f64::min)
    };
    // The foot ends at 1 mm; one layer stays free above it.
    let (text, report) = sliced(&table(true), &ON);
    assert_eq!(report["verify"]["findings"], Value::Array(Vec::new()));
    let on_margin = motions(&text)
        .iter()
        .filter(|m| m.lays() && m.role == BODY)
        .flat_map(places)
        .filter(|p| p[0].abs() < PLATE && p[1].abs() < 6.0)
        .map(|p| p[2])
        .fold(f64::INFINITY, f64::min);
    assert!(on_margin > 1.0 + 0.2, "{on_margin}");
    assert!(lowest(&text) < UNDERSIDE);
    let bed_only =
        ["--set", "support_material=true", "--set", "support_material_buildplate_only=true"];
    let (text, _) = sliced(&table(true), &bed_only);
    for p in motions(&text).iter().filter(|m| m.role.starts_with(BODY) && m.lays()).flat_map(places)
    {
        let beside = p[0].abs() > PLATE || p[1].abs() > 6.0;
        assert!(beside, "{p:?} stands on the part");
    }
    let (text, _) = sliced(&table(false), &bed_only);
    assert!((lowest(&text) - 0.2).abs() < 0.001);
}

#[test]
fn a_gap_that_a_bridge_spans_needs_no_supports() {
    let profile = [
        [-8.0, 0.0],
        [-4.0, 0.0],
        [-4.0, 4.0],
        [4.0, 4.0],
        [4.0, 0.0],
        [8.0, 0.0],
        [8.0, 6.0],
        [-8.0, 6.0],
    ];
    let portal = upright(&profile);
    let (text, _) = sliced(&portal, &ON);
    assert!(!text.contains(";TYPE:Support"));
    let (text, _) =
        sliced(&portal, &["--set", "support_material=true", "--set", "dont_support_bridges=false"]);
    assert!(text.contains(";TYPE:Support"));
    let (text, _) =
        sliced(&portal, &["--set", "support_material=true", "--set", "max_bridge_length_mm=6"]);
    assert!(text.contains(";TYPE:Support"));
}

/// The underside of the mushroom's cap rises from cones of 40° by 40°, from planes not at all.
#[test]
fn the_threshold_is_measured_against_the_surface_of_the_layers() {
    let file = model("mushroom");
    let has_supports = |layers: &[&str], threshold: &str| {
        let scratch = Scratch::new();
        let set = format!("support_material_threshold_deg={threshold}");
        let mut all = vec!["slice", file.to_str().unwrap(), "-q", "-o", "-", "--scale", "0.4"];
        all.extend(["--orient", "keep", "--set", "support_material=true", "--set", &set]);
        all.extend(layers);
        scratch.run(&all).expect(0).out.contains(";TYPE:Support")
    };
    let cones = ["--layers=conical", "--cone-angle=40"];
    assert!(has_supports(&[], "30"));
    assert!(!has_supports(&cones, "30"));
    assert!(has_supports(&cones, "55"));
}

#[test]
fn supports_of_curved_layers_begin_on_the_bed_and_carry_the_part() {
    let file = model("mushroom");
    for layers in [
        ["--layers=conical", "--cone-angle=15"],
        ["--layers=conical", "--cone-angle=-15"],
        ["--layers=conical", "--cone-angle=-20"],
        ["--layers=caps", "--cap-radius=30"],
        ["--layers=spherical", "--sphere-centre=-40"],
    ] {
        let scratch = Scratch::new();
        let mut all =
            vec!["slice", file.to_str().unwrap(), "-q", "-o", "x.gcode", "--scale", "0.5"];
        all.extend(["--orient", "keep", "--verify", "full", "--report", "r.json"]);
        all.extend(ON);
        all.extend(layers);
        assert!(matches!(scratch.run(&all).code, Some(0 | 1)));
        let report = std::fs::read(scratch.path("r.json")).unwrap();
        let report: Value = serde_json::from_slice(&report).unwrap();
        let findings = report["verify"]["findings"].as_array().unwrap();
        assert!(findings.is_empty(), "{layers:?}: {findings:?}");
        let text = std::fs::read_to_string(scratch.path("x.gcode")).unwrap();
        let all = motions(&text);
        let lowest = of(&all, BODY).map(|m| m.to[2]).fold(f64::INFINITY, f64::min);
        assert!((lowest - 0.2).abs() < 0.001, "{layers:?}: columns begin at {lowest}");
        // The cap begins at 10 mm, and columns end a layer below.
        let under_cap = of(&all, INTERFACE).flat_map(places).filter(|p| p[0].hypot(p[1]) < 12.5);
        let highest = under_cap.map(|p| p[2]).fold(0.0, f64::max);
        assert!((9.4..9.9).contains(&highest), "{layers:?}: columns end at {highest}");
    }
}

/// Columns of a bowl begin where it meets its planar layers, and their dense layers climb with it: none of
/// their lines runs over the gap around the stem, or ends between two lines below.
#[test]
fn lines_of_supports_lie_on_those_of_the_layer_below() {
    let scratch = Scratch::new();
    let file = model("umbrella");
    let mut all = vec!["slice", file.to_str().unwrap(), "-q", "-o", "x.gcode", "--scale", "0.6"];
    all.extend(["--layers=conical", "--cone-angle=-10", "--orient", "keep"]);
    all.extend(["--verify", "full", "--report", "r.json"]);
    all.extend(ON);
    assert!(matches!(scratch.run(&all).code, Some(0 | 1)));
    let report = std::fs::read(scratch.path("r.json")).unwrap();
    let report: Value = serde_json::from_slice(&report).unwrap();
    assert_eq!(report["verify"]["findings"], Value::Array(Vec::new()));
}

/// Without a loop around the column, too, no line runs along the edge of a wedge, where hardly any of its
/// width has room.
#[test]
fn columns_without_a_sheath_pass_the_proof_on_curved_layers() {
    let file = model("umbrella");
    let mut all = vec!["slice", file.to_str().unwrap(), "-q", "-o", "x.gcode", "--scale", "0.6"];
    all.extend(["--layers=caps", "--cap-radius=40"]);
    all.extend(["--set", "support_material_with_sheath=false"]);
    all.extend(ON);
    Scratch::new().run(&all).expect(0);
}

/// A part that is turned is supported the same.
#[test]
fn turning_a_part_turns_its_supports() {
    let profile =
        [[-4.0, 0.0], [2.0, 0.0], [2.0, 5.0], [9.0, 5.0], [9.0, 6.4], [-7.0, 6.4], [-4.0, 4.0]];
    let mesh = upright(&profile);
    let sums = |angle: f64| {
        let turn = Isometry3::rotation(Vector3::z() * angle.to_radians());
        let (text, _) = sliced(&mesh.transformed(&turn), &ON);
        let mut sums: BTreeMap<(usize, String), f64> = BTreeMap::new();
        for motion in motions(&text).iter().filter(|motion| motion.lays()) {
            *sums.entry((motion.layer.unwrap(), motion.role.to_owned())).or_default() +=
                motion.volume();
        }
        sums
    };
    let straight = sums(0.0);
    assert!(straight.keys().any(|(_, role)| role == INTERFACE));
    let turned = sums(41.7);
    assert!(straight.keys().eq(turned.keys()), "as many layers with the same roles");
    for (key, sum) in &straight {
        assert!((sum - turned[key]).abs() <= 0.02 + 0.01 * sum, "{key:?}: {sum} {}", turned[key]);
    }
}
