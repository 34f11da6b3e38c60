//! Curved layers, read back from the text: on their surface, with the part's volume, and planar where
//! the surface is.

use crate::program::{Motion, motions, stl_volume};
use crate::run::{Scratch, model, sliced};

/// How far a bead may lie from the surface of its layer, mm.
const OFF_SURFACE_MM: f64 = 0.01;

/// Nearer to the axis than this no bead can follow a cone, mm.
const TIP_MM: f64 = 0.1;

/// The planar layers that curved ones stand on, as they come by default.
const BASE_LAYERS: usize = 2;

/// Checks that every bead of every curved layer lies on one level of `level`.
#[track_caller]
fn lies_on_levels(name: &str, arguments: &[&str], level: impl Fn(f64, f64) -> f64) {
    let text = sliced(name, arguments);
    let motions = motions(&text);
    let mut curved_layers = 0;
    for layer in motions.chunk_by(|a, b| a.layer == b.layer) {
        let Some(index) = layer[0].layer.filter(|index| *index >= BASE_LAYERS) else { continue };
        let levels: Vec<f64> = layer
            .iter()
            .filter(|motion| motion.lays())
            .flat_map(|motion| [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| motion.at(share)))
            .map(|[x, y, z]| (x.hypot(y), z))
            // The nozzle goes round the very tip of a cone.
            .filter(|(r, _)| *r > TIP_MM)
            .map(|(r, z)| level(r, z))
            .collect();
        let (low, high) =
            levels.iter().fold((f64::MAX, f64::MIN), |(a, b), &l| (a.min(l), b.max(l)));
        assert!(
            high - low <= 2.0 * OFF_SURFACE_MM,
            "{name} {arguments:?}: layer {index} reaches from level {low:.4} to {high:.4}"
        );
        curved_layers += usize::from(!levels.is_empty());
    }
    assert!(curved_layers > 10, "{name} {arguments:?}: {curved_layers} curved layers");
}

#[test]
fn beads_lie_on_cones() {
    for (angle, name) in [("30", "mushroom"), ("45", "lens"), ("-20", "dome")] {
        let slope = angle.parse::<f64>().unwrap().to_radians().tan();
        let arguments = ["--layers", "conical", "--cone-angle", angle];
        lies_on_levels(name, &arguments, |r, z| z + r * slope);
    }
}

#[test]
fn beads_lie_on_spheres_and_caps() {
    let arguments = ["--layers", "spherical", "--sphere-centre", "-40"];
    lies_on_levels("dome", &arguments, |r, z| r.hypot(z + 40.0));
    let arguments = ["--layers", "caps", "--cap-radius", "60"];
    lies_on_levels("lens", &arguments, |r, z| z - (3600.0 - r * r).sqrt());
}

fn laid(text: &str) -> f64 {
    motions(text).iter().filter(|motion| motion.lays()).map(Motion::volume).sum()
}

#[track_caller]
fn holds_its_volume(name: &str, layers: &[&str]) {
    let wanted = stl_volume(&std::fs::read(model(name)).unwrap());
    let mut arguments = vec!["--set", "fill_density=100%", "--set", "skirts=0"];
    arguments.extend(layers);
    let error = laid(&sliced(name, &arguments)) / wanted - 1.0;
    assert!(error.abs() <= 0.015, "{name} {layers:?} gets {:+.2} % too much", error * 100.0);
}

#[test]
fn solid_cones_hold_the_volume() {
    for angle in ["0", "15", "30", "45"] {
        let layers = ["--layers", "conical", "--cone-angle", angle];
        for name in ["dome", "lens", "vase"] {
            holds_its_volume(name, &layers);
        }
    }
    holds_its_volume("mushroom", &["--layers", "conical", "--cone-angle", "30"]);
    holds_its_volume("dome", &["--layers", "conical", "--cone-angle", "-20"]);
}

#[test]
fn solid_spheres_hold_the_volume() {
    for name in ["dome", "lens", "mushroom"] {
        holds_its_volume(name, &["--layers", "spherical"]);
    }
    let steep = ["--layers=spherical", "--sphere-centre=-20"];
    for name in ["dome", "lens"] {
        holds_its_volume(name, &[&steep[..], &SLIM].concat());
    }
}

/// Volume and length of what is laid in each layer.
fn layers(text: &str) -> Vec<(f64, f64)> {
    motions(text)
        .chunk_by(|a, b| a.layer == b.layer)
        .filter(|layer| layer[0].layer.is_some())
        .map(|layer| {
            let lays = layer.iter().filter(|motion| motion.lays());
            lays.fold((0.0, 0.0), |(v, l), m| (v + m.volume(), l + m.path()))
        })
        .collect()
}

#[test]
fn cones_without_slope_and_endless_spheres_are_planes() {
    let common = ["--set", "snap=off", "--set", "solid_fill_pattern=archimedeanchords"];
    let with = |more: &[&str]| {
        let arguments: Vec<&str> = common.iter().chain(more).copied().collect();
        layers(&sliced("gear", &arguments))
    };
    let planar = with(&[]);
    for (curved, share) in [
        (["--layers", "conical", "--cone-angle", "0"], 0.005),
        (["--layers", "conical", "--cone-angle", "0.0001"], 0.005),
        // Over 26 mm this cap falls by 3 µm, which its first layer lacks at the rim.
        (["--layers", "caps", "--cap-radius", "100000"], 0.01),
        (["--layers", "spherical", "--sphere-centre", "-100000"], 0.01),
    ] {
        let curved_layers = with(&curved);
        assert_eq!(planar.len(), curved_layers.len(), "{curved:?}");
        for (k, (a, b)) in planar.iter().zip(&curved_layers).enumerate() {
            let same = |a: f64, b: f64| (a - b).abs() <= share * a;
            assert!(same(a.0, b.0) && same(a.1, b.1), "{curved:?}, layer {k}: {a:?} {b:?}");
        }
    }
}

/// A nozzle that clears steep layers.
const SLIM: [&str; 6] = [
    "--set",
    "nozzle_flat_radius_mm=0.2",
    "--set",
    "nozzle_half_angle_deg=10",
    "--set",
    "nozzle_block_height_mm=60",
];

#[test]
fn flat_tops_are_finished_by_planar_layers() {
    for (name, top, layers) in [
        ("cube", 20.0, ["--layers", "conical", "--cone-angle", "30"]),
        ("gear", 8.0, ["--layers", "conical", "--cone-angle", "-20"]),
        ("steps", 15.0, ["--layers", "spherical", "--sphere-centre", "-50"]),
    ] {
        let mut arguments = vec!["--set", "top=planar", "--set", "fill_density=100%"];
        arguments.extend(["--set", "skirts=0"]);
        arguments.extend(layers);
        arguments.extend(SLIM);
        let text = sliced(name, &arguments);
        let motions = motions(&text);
        let last = motions.iter().filter_map(|motion| motion.layer).max().unwrap();
        // 0.2 mm apart, the last on the face.
        for (below, layer) in (0..3).map(|k| (k, last - k)) {
            let beads = motions.iter().filter(|m| m.lays() && m.layer == Some(layer));
            let heights: Vec<f64> = beads.map(|motion| motion.to[2]).collect();
            let wanted = top - 0.2 * below as f64;
            assert!(!heights.is_empty());
            assert!(heights.iter().all(|z| (z - wanted).abs() < 1e-3), "{name}: {wanted}");
        }
        let highest = motions.iter().filter(|m| m.lays()).map(|m| m.to[2]).fold(0.0, f64::max);
        assert!((highest - top).abs() < 1e-3, "{name}: {highest}");
        let wanted = stl_volume(&std::fs::read(model(name)).unwrap());
        let error = laid(&text) / wanted - 1.0;
        assert!(error.abs() <= 0.015, "{name}: {:+.2} %", error * 100.0);
        // Beads of the first planar layer fill the wedges below: half a layer thick at least, and
        // at most half a layer more than a curved layer is upright; where the edges of curved layers
        // lie near each other, as much as the ground under them is deep on the mean.
        let surface = text.rfind("; layer surface = planar").unwrap();
        let first = text[surface..].lines().find_map(|line| line.strip_prefix(";LAYER:"));
        let first: usize = first.unwrap().parse().unwrap();
        let (mut thinnest, mut thickest) = (f64::MAX, 0.0_f64);
        for bead in motions.iter().filter(|m| m.lays() && m.layer == Some(first)) {
            if bead.path() < 0.2 || bead.role != "Perimeter" {
                continue;
            }
            // A bead laid w − t(1 − π/4) apart from its neighbours.
            let spacing = 0.45 - 0.2 * (1.0 - std::f64::consts::FRAC_PI_4);
            let thickness = bead.volume() / bead.path() / spacing;
            thinnest = thinnest.min(thickness);
            thickest = thickest.max(thickness);
        }
        assert!(thinnest > 0.09 && thickest < 0.36, "{name}: {thinnest} to {thickest}");
    }
}

/// What a program announces as the surface of each layer, with the layer's number.
fn surfaces(text: &str) -> Vec<(usize, String)> {
    let mut surface = String::new();
    let mut found = Vec::new();
    for line in text.lines() {
        if let Some(named) = line.strip_prefix("; layer surface = ") {
            surface = named.to_owned();
        } else if let Some(layer) = line.strip_prefix(";LAYER:") {
            found.push((layer.parse().unwrap(), surface.clone()));
        }
    }
    found
}

#[test]
fn cones_grow_out_of_planes() {
    for (name, angle) in [("dome", 30.0), ("gear", -20.0_f64)] {
        let cone = angle.to_string();
        let mut arguments = vec!["--layers=conical", "--cone-angle", &cone, "--set=blend=morph"];
        arguments.extend(["--set", "fill_density=100%", "--set", "skirts=0"]);
        arguments.extend(SLIM);
        let (report, code) = proved(name, &arguments);
        assert_eq!(code, 0, "{name}: {}", report["verify"]);
        let text = sliced(name, &arguments);
        let motions = motions(&text);
        let surfaces = surfaces(&text);
        let mut angles = Vec::new();
        for (layer, surface) in &surfaces[BASE_LAYERS..] {
            let angle: f64 = surface.strip_prefix("conical, angle ").unwrap().parse().unwrap();
            let slope = angle.to_radians().tan();
            let beads = motions.iter().filter(|m| m.lays() && m.layer == Some(*layer));
            let levels = beads.flat_map(|m| [m.at(0.0), m.at(0.5), m.at(1.0)]);
            let levels = levels.filter(|[x, y, _]| x.hypot(*y) > TIP_MM);
            let levels: Vec<f64> = levels.map(|[x, y, z]| z + slope * x.hypot(y)).collect();
            let (low, high) =
                levels.iter().fold((f64::MAX, f64::MIN), |(a, b), &l| (a.min(l), b.max(l)));
            assert!(high - low < 2.0 * OFF_SURFACE_MM, "{name}, layer {layer}: {low} to {high}");
            angles.push(angle.abs());
        }
        // From flat to the cone without a step, then on and on; and as many layers as it takes when
        // beads are half to one and a half layers thick.
        let last = angle.abs();
        let laid_at = motions.iter().filter(|m| m.lays()).map(|m| m.to[0].abs());
        let reach = laid_at.fold(0.0, f64::max);
        let least = reach * last.to_radians().tan().asinh() / 0.2;
        let blended = angles.iter().take_while(|angle| **angle < last - 0.01).count() + 1;
        assert!((blended as f64 - least).abs() < 2.5, "{name}: {blended} layers, {least}");
        assert!(angles.len() > blended + 3, "{name}: {} layers", angles.len());
        assert!(angles.is_sorted() && angles[0] < 2.0 && angles.last() == Some(&last));
        let wanted = stl_volume(&std::fs::read(model(name)).unwrap());
        let error = laid(&text) / wanted - 1.0;
        assert!(error.abs() <= 0.015, "{name}: {:+.2} %", error * 100.0);
        let spacing = 0.45 - 0.2 * (1.0 - std::f64::consts::FRAC_PI_4);
        let beads = motions.iter().filter(|m| m.lays() && m.role == "Perimeter");
        for bead in beads.filter(|m| m.path() > 0.3 && m.layer < Some(BASE_LAYERS + blended)) {
            let thickness = bead.volume() / bead.path() / spacing;
            assert!((0.095..0.305).contains(&thickness), "{name}: a bead {thickness} thick");
        }
    }
}

#[test]
fn blends_that_cannot_be_are_refused() {
    let scratch = Scratch::new();
    let dome = model("dome");
    let mut arguments = vec!["slice", dome.to_str().unwrap(), "-o", "out.gcode"];
    arguments.extend(["--layers=conical", "--cone-angle=10", "--set=blend=morph"]);
    arguments.extend(["--set=min_layer_height_mm=0.2", "--set=max_layer_height_mm=0.2"]);
    scratch.run(&arguments).refused("OutOfEnvelope", 5);
}

/// The report of a model sliced with the full proof, and how it ended.
fn proved(name: &str, layers: &[&str]) -> (serde_json::Value, i32) {
    proved_file(&model(name), layers)
}

fn proved_file(model: &std::path::Path, layers: &[&str]) -> (serde_json::Value, i32) {
    let scratch = Scratch::new();
    let mut arguments = vec!["slice", model.to_str().unwrap(), "-o", "out.gcode", "--json"];
    arguments.extend(["--verify", "full"]);
    arguments.extend(layers);
    arguments.extend(SLIM);
    let ran = scratch.run(&arguments);
    (serde_json::from_str(&ran.out).unwrap_or_else(|_| panic!("{}", ran.err)), ran.code.unwrap())
}

#[test]
fn beads_stay_within_the_part_at_the_axis_and_at_shallow_faces() {
    for (name, layers) in [
        ("cone", ["--layers=conical", "--cone-angle=-15"]),
        ("dome", ["--layers=conical", "--cone-angle=-30"]),
        ("lens", ["--layers=conical", "--cone-angle=-45"]),
        ("wall-0.6", ["--layers=conical", "--cone-angle=45"]),
        ("wall-0.6", ["--layers=conical", "--cone-angle=-30"]),
        ("gear", ["--layers=conical", "--cone-angle=45"]),
        ("gear", ["--layers=caps", "--cap-radius=80"]),
        // A side of a column passes the axis; caps far out; beads on steep spheres.
        ("steps", ["--layers=conical", "--cone-angle=30"]),
        ("vase", ["--layers=caps", "--cap-radius=50"]),
        ("lens", ["--layers=spherical", "--sphere-centre=-10"]),
    ] {
        let (report, code) = proved(name, &layers);
        assert_eq!(code, 0, "{name} {layers:?}: {}", report["verify"]);
    }
}

#[test]
fn a_wedge_that_holds_no_bead_is_filled_by_the_layer_above() {
    // At the rim of the dome the first layer of the bowl is 0.2 mm wide on the base.
    let layers = ["--layers=conical", "--cone-angle=-45", "--scale=0.5"];
    let solid = ["--set=fill_density=100%", "--set=skirts=0"];
    let (report, code) = proved("dome", &[&layers[..], &solid].concat());
    assert_eq!(code, 0, "{}", report["verify"]);
    let text = sliced("dome", &[&layers[..], &solid, &SLIM].concat());
    let told = text.lines().filter_map(|line| line.strip_prefix(";HEIGHT:"));
    let thickest = told.map(|height| height.parse::<f64>().unwrap()).fold(0.0, f64::max);
    assert!((0.23..0.4).contains(&thickest), "{thickest}");
}

/// The beads that hang in the air by the proof of the program.
fn hanging(report: &serde_json::Value) -> usize {
    let findings = report["verify"]["findings"].as_array().unwrap();
    findings.iter().filter(|finding| finding["check"] == "support").count()
}

#[test]
fn cones_carry_what_hangs_over_on_planes() {
    let (planar, code) = proved("mushroom", &[]);
    assert!(hanging(&planar) > 0 && code == 1, "{}", planar["verify"]);
    let (conical, code) = proved("mushroom", &["--layers=conical", "--cone-angle=46"]);
    assert_eq!((hanging(&conical), code), (0, 0), "{}", conical["verify"]);
    let area = |key: &str| conical["layers"][key].as_f64().unwrap();
    // A ring of 25 and 5 mm, facing straight down.
    let ring = std::f64::consts::PI * (25.0 * 25.0 - 5.0 * 5.0);
    assert!((area("overhang_planar_mm2") / ring - 1.0).abs() < 0.01, "{}", conical["layers"]);
    assert!(area("overhang_mm2") < 0.01 * ring, "{}", conical["layers"]);
}

#[test]
fn cones_carry_an_umbrella() {
    let (planar, code) = proved("umbrella", &[]);
    assert!(hanging(&planar) > 0 && code == 1, "{}", planar["verify"]);
    let (conical, code) = proved("umbrella", &["--layers=conical", "--cone-angle=35"]);
    assert_eq!((hanging(&conical), code), (0, 0), "{}", conical["verify"]);
    let area = |key: &str| conical["layers"][key].as_f64().unwrap();
    // The underside, between radii of 25 and 4 mm.
    let ring = std::f64::consts::PI * (25.0 * 25.0 - 4.0 * 4.0) / 15.0_f64.to_radians().cos();
    assert!((area("overhang_planar_mm2") / ring - 1.0).abs() < 0.01, "{}", conical["layers"]);
    assert_eq!(area("overhang_mm2"), 0.0);
}

/// Of an umbrella whose cover falls outwards by 20° bowls carry all but its rim, which nothing can: it is
/// the lowest of the cover, and begins in mid-air. That is told before printing and found in the program.
#[test]
fn bowls_carry_an_umbrella_but_for_its_rim() {
    let Some(folder) = crate::run::shared("models/gen") else { return };
    let umbrella = folder.join("umbrella.stl");
    let (bowls, code) = proved_file(&umbrella, &["--layers=conical", "--cone-angle=-30"]);
    assert!(bowls["layers"]["overhang_planar_mm2"].as_f64().unwrap() > 2000.0);
    assert_eq!(bowls["layers"]["overhang_mm2"], 0.0);
    let warnings = bowls["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|warning| warning["code"] == "FloatingPart"), "{warnings:?}");
    assert_eq!((hanging(&bowls), code), (1, 1), "{}", bowls["verify"]);
    let found = &bowls["verify"]["findings"][0];
    let around = std::f64::consts::TAU * 29.75;
    assert!((found["measured"].as_f64().unwrap() / around - 1.0).abs() < 0.01, "{found}");
}

/// The heights, below the highest, at which a layer covers more than this area, mm², with planar beads.
fn planar_tops(text: &str, least: f64) -> Vec<f64> {
    let mut tops: Vec<f64> = Vec::new();
    let surfaces = surfaces(text);
    let planar = |layer: usize| surfaces.iter().any(|(k, s)| *k == layer && s == "planar");
    let motions = motions(text);
    for layer in motions.chunk_by(|a, b| a.layer == b.layer) {
        let Some(index) = layer[0].layer.filter(|k| *k >= BASE_LAYERS && planar(*k)) else {
            continue;
        };
        let top = layer.iter().filter(|m| m.lays() && m.role == "Top solid infill");
        let (area, z) = top.fold((0.0, 0.0), |(a, _), m| (a + m.path() * m.width, m.to[2]));
        if area > least {
            assert!(index > BASE_LAYERS);
            tops.push(z);
        }
    }
    tops
}

/// Four columns side by side with tops at different heights: every one is met and finished flat, on
/// whatever surface the layers between follow.
#[test]
fn every_flat_top_is_finished_by_planar_layers() {
    for layers in [
        ["--layers=conical", "--cone-angle=30"],
        ["--layers=conical", "--cone-angle=-30"],
        ["--layers=spherical", "--sphere-centre=-40"],
        ["--layers=caps", "--cap-radius=50"],
    ] {
        let mut arguments = vec!["--set", "top=planar", "--set", "fill_density=100%"];
        arguments.extend(["--set", "skirts=0"]);
        arguments.extend(layers);
        let (report, code) = proved("steps", &arguments);
        assert_eq!(code, 0, "{layers:?}: {}", report["verify"]);
        let faces = report["layers"]["flats"].as_array().unwrap();
        assert_eq!(faces.len(), 4, "{faces:?}");
        assert!(faces.iter().all(|face| face["error_mm"] == 0.0));
        assert_eq!(report["layers"]["kind"], layers[0].split_once('=').unwrap().1);
        arguments.extend(SLIM);
        let text = sliced("steps", &arguments);
        // Each column is 12 by 24 mm; walls take some of its top.
        let tops = planar_tops(&text, 150.0);
        let wanted = [3.07, 7.33, 11.9, 15.0];
        assert_eq!(tops.len(), wanted.len(), "{layers:?}: {tops:?}");
        assert!(tops.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-3), "{tops:?}");
        let volume = stl_volume(&std::fs::read(model("steps")).unwrap());
        let error = laid(&text) / volume - 1.0;
        assert!(error.abs() <= 0.015, "{layers:?}: {:+.2} %", error * 100.0);
    }
}

#[test]
fn flat_tops_that_stay_steps_are_named() {
    // A step as high as the underside of an arm on the other side, which bowls would carry.
    let outline = [
        [-15.0, 0.0],
        [5.0, 0.0],
        [5.0, 9.8],
        [15.0, 9.8],
        [15.0, 20.0],
        [-5.0, 20.0],
        [-5.0, 10.0],
        [-15.0, 10.0],
    ];
    let mut mesh = mesh::shapes::extruded(&outline, &[], 10.0);
    for p in &mut mesh.vertices {
        *p = nalgebra::Point3::new(p.x, 5.0 - p.z, p.y);
    }
    let scratch = Scratch::new();
    let arm = scratch.file("arm.stl", mesh::stl::write(&mesh));
    let named = |model: &std::path::Path, top: &str, angle: &str| {
        let layers = ["--set", top, "--layers=conical", angle, "--orient=keep"];
        let (report, _) = proved_file(model, &layers);
        let warnings = report["warnings"].as_array().unwrap();
        let stepped = warnings.iter().find(|warning| warning["code"] == "FlatTopsStepped");
        let message = stepped.map(|warning| warning["message"].as_str().unwrap().to_owned())?;
        Some((message, report["layers"]["flats_stepped"].clone()))
    };
    let (message, faces) = named(&arm, "top=planar", "--cone-angle=50").unwrap();
    assert!(message.contains("1 flat top is left") && message.contains("z = 10 mm"), "{message}");
    assert!(message.contains("100 mm² of the part look down there"), "{message}");
    assert_eq!(faces.as_array().unwrap().len(), 1, "{faces}");
    assert!((faces[0]["z_mm"].as_f64().unwrap() - 10.0).abs() < 1e-6, "{faces}");
    assert_eq!(named(&arm, "top=curved", "--cone-angle=50"), None);
    // Where the arm hangs anyway, the step is met.
    assert_eq!(named(&arm, "top=planar", "--cone-angle=20"), None);
    assert_eq!(named(&model("steps"), "top=planar", "--cone-angle=30"), None);
}

#[test]
fn islands_in_mid_air_are_reported_with_their_place() {
    // The arms of the cross begin at 20 mm, in bowls at their outer corners.
    let (report, _) = proved("cross", &["--layers=conical", "--cone-angle=-15"]);
    let floating = report["layers"]["floating"].as_array().unwrap();
    assert!(floating.len() >= 4, "{floating:?}");
    for island in floating {
        let at: Vec<f64> = (0..3).map(|k| island["at_mm"][k].as_f64().unwrap()).collect();
        assert!((at[2] - 20.0).abs() < 0.4, "{island}");
        assert!(at[0].abs().max(at[1].abs()) > 25.0, "{island}");
        assert!(island["area_mm2"].as_f64().unwrap() > 0.0);
        assert!(island["layer"].as_u64().unwrap() > 10);
    }
    let (whole, _) = proved("cube", &["--layers=conical", "--cone-angle=20"]);
    assert_eq!(whole["layers"]["floating"], serde_json::json!([]));
}

#[test]
fn layers_too_steep_for_the_nozzle_are_refused_or_lowered() {
    let scratch = Scratch::new();
    let dome = model("dome");
    let dome = dome.to_str().unwrap();
    let blunt = ["--set", "nozzle_flat_radius_mm=0.5", "--set", "nozzle_half_angle_deg=60"];
    let slice = |angle: &str| {
        let mut arguments = vec!["slice", dome, "-o", "out.gcode", "--layers", "conical"];
        arguments.extend(["--cone-angle", angle]);
        arguments.extend(blunt);
        scratch.run(&arguments)
    };
    let refused = slice("45").refused("OutOfEnvelope", 5);
    let most: f64 = refused
        .err
        .split("at most ")
        .nth(1)
        .and_then(|rest| rest.split('°').next())
        .and_then(|number| number.parse().ok())
        .unwrap();
    assert!((20.0..30.0).contains(&most), "{}", refused.err);
    slice(&format!("{:.1}", most - 0.1)).expect(0);
    slice("max").expect(0);
    let text = std::fs::read_to_string(scratch.path("out.gcode")).unwrap();
    assert!(text.contains(&format!("; layer surface = conical, angle {:.0}", most.floor())));
}
