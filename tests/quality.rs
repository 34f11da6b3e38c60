//! What people look at in a print: bridges, overhangs, tops, infill.

use std::collections::BTreeMap;

use mesh::mesh::Mesh;
use mesh::shapes::extruded;
use nalgebra::{Isometry3, Vector3};

use crate::program::{Motion, beads, motions};
use crate::run::{Scratch, sliced_mesh as sliced};

/// A profile in the upright plane through x, `depth` mm deep along y.
fn upright(profile: &[[f64; 2]], depth: f64) -> Mesh {
    let flat = extruded(profile, &[], depth);
    let raised = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
    flat.transformed(&raised)
}

/// Two pillars and a beam over the gap of `gap` mm between them, 10 mm above the bed.
fn portal(gap: f64) -> Mesh {
    let (inner, outer) = (gap / 2.0, gap / 2.0 + 6.0);
    let profile = [
        [-outer, 0.0],
        [-inner, 0.0],
        [-inner, 10.0],
        [inner, 10.0],
        [inner, 0.0],
        [outer, 0.0],
        [outer, 13.0],
        [-outer, 13.0],
    ];
    upright(&profile, 14.0)
}

/// The piece of a motion in the part: its begin and its way.
fn way(motion: &Motion<'_>) -> [f64; 2] {
    let (from, to) = (motion.at(0.0), motion.at(1.0));
    [to[0] - from[0], to[1] - from[1]]
}

#[test]
fn a_bridge_spans_the_gap_from_pillar_to_pillar() {
    for gap in [8.0, 15.0] {
        // Wherever the part stands and however it is turned, lines go the short way over the gap.
        for place in ["0,0", "40,10"] {
            let text = sliced(&portal(gap), &["--place", place, "--set", "fill_angle_deg=30"]);
            let all = motions(&text);
            let bridges = beads(&all, "Bridge infill");
            assert!(!bridges.is_empty(), "gap {gap}");
            let (mut along, mut across) = (0.0, 0.0);
            for motion in bridges.iter().flat_map(|bead| bead.iter()) {
                let [x, y] = way(motion);
                along += x.abs();
                across += y.abs();
                assert!((motion.to[2] - 10.2).abs() < 0.11, "only the first layer over the gap");
                assert!(motion.speed <= 30.0 + 1e-6, "{} mm/s", motion.speed);
            }
            // Lines reach onto both pillars; at their ends the nozzle steps aside.
            assert!(along > 12.0 * across, "gap {gap} at {place}: {along} {across}");
            let lines = (along / (gap + 1.5)).round();
            assert!((20.0..40.0).contains(&lines), "gap {gap}: {lines} lines");
        }
    }
}

#[test]
fn the_fan_blows_at_bridges() {
    let text = sliced(&portal(8.0), &["--set", "fan_speed=50%"]);
    let lines: Vec<&str> = text.lines().collect();
    let fan_before = |k: usize| lines[..k].iter().rev().find(|line| line.starts_with("M106"));
    for (k, line) in lines.iter().enumerate() {
        match *line {
            ";TYPE:Bridge infill" => assert_eq!(fan_before(k), Some(&"M106 S255"), "line {k}"),
            ";TYPE:Internal infill" => assert_eq!(fan_before(k), Some(&"M106 S128"), "line {k}"),
            _ => {}
        }
    }
    assert!(text.contains(";TYPE:Bridge infill"));
}

/// A block two of whose sides lean out by `aside` mm a layer.
fn leaning(aside: f64) -> Mesh {
    let (layers, height) = (40.0, 8.0);
    let out = aside * layers;
    let profile = [[-6.0, 0.0], [6.0, 0.0], [6.0 + out, height], [-6.0 - out, height]];
    upright(&profile, 12.0)
}

#[test]
fn walls_slow_down_by_what_hangs_over() {
    // 0.05 mm of a bead of 0.45 mm, a third of it, two thirds, and all.
    for (aside, wanted) in [(0.05, 30.0), (0.16, 30.0), (0.28, 20.0), (0.5, 12.0)] {
        let speeds = ["overhang_speed_0_mm_per_s=12", "overhang_speed_1_mm_per_s=16"];
        let speeds = speeds.iter().chain(&["overhang_speed_2_mm_per_s=20"]);
        let mut arguments = vec!["--set", "slowdown_below_layer_time_s=0"];
        for speed in speeds {
            arguments.extend(["--set", speed]);
        }
        arguments.extend(["--set", "rail_acceleration_mm_per_s2=90000"]);
        arguments.extend(["--set", "path_acceleration_mm_per_s2=90000"]);
        arguments.extend(["--set", "bed_acceleration_deg_per_s2=900000"]);
        arguments.extend(["--set", "bed_speed_deg_per_s=9000"]);
        let text = sliced(&leaning(aside), &arguments);
        let all = motions(&text);
        // The outermost wall of one layer on the leaning side.
        let outer = |m: &&Motion<'_>| {
            let [from, to] = [m.at(0.0), m.at(1.0)];
            let edge = 6.0 + aside * 20.0 - 0.225;
            let is_there = |p: [f64; 3]| (p[0].abs() - edge).abs() < 0.06 + aside;
            m.lays()
                && (m.to[2] - 4.1).abs() < 0.11
                && is_there(from)
                && is_there(to)
                && m.path() > 0.05
                && (from[0] - to[0]).abs() < 0.1 * (from[1] - to[1]).abs()
                && m.role != "Solid infill"
        };
        let walls: Vec<&Motion<'_>> = all.iter().filter(outer).collect();
        assert!(!walls.is_empty());
        let fastest = walls.iter().filter(|w| w.role == "External perimeter").map(|w| w.speed);
        let fastest = fastest.fold(0.0, f64::max);
        assert!((fastest - wanted).abs() < 0.5, "{aside} mm a layer: {fastest} mm/s");
    }
}

#[test]
fn a_single_wall_on_top_and_more_on_overhangs() {
    let count = |text: &str, z: f64| {
        let all = motions(text);
        let walls = all.iter().filter(|m| (m.to[2] - z).abs() < 0.05 && m.lays());
        let length =
            |role: &str| walls.clone().filter(|m| m.role == role).map(Motion::path).sum::<f64>();
        (length("External perimeter") + length("Overhang perimeter"), length("Perimeter"))
    };
    let cube = mesh::shapes::cube(12.0);
    let text = sliced(&cube, &["--set", "only_one_perimeter_top=true"]);
    assert_eq!(count(&text, 12.0).1, 0.0);
    assert!(count(&text, 11.8).1 > 30.0);
    // A funnel that widens by 1.2 mm a layer all around.
    let steep = mesh::shapes::revolved(&[[0.0, 0.0], [6.0, 0.0], [18.0, 2.0], [0.0, 2.0]], 90);
    let plain = count(&sliced(&steep, &[]), 1.2);
    let more = count(&sliced(&steep, &["--set", "extra_perimeters=true"]), 1.2);
    let sum = |(outer, inner): (f64, f64)| outer + inner;
    assert!(sum(more) > 1.3 * sum(plain), "{plain:?} {more:?}");
}

/// Extent of what a role lays in x at a height: least and greatest, bead included.
fn reach(text: &str, role: &str, z: f64) -> [f64; 2] {
    let all = motions(text);
    let there = all.iter().filter(|m| m.lays() && m.role == role && (m.to[2] - z).abs() < 0.05);
    there.fold([f64::MAX, f64::MIN], |[low, high], m| {
        let half = m.width / 2.0;
        let ends = [m.at(0.0)[0], m.at(1.0)[0]];
        let (a, b) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        [low.min(a - half), high.max(b + half)]
    })
}

#[test]
fn outlines_move_as_told() {
    let cube = mesh::shapes::cube(12.0);
    let width = |more: &[&str], z: f64| {
        let text = sliced(&cube, more);
        let [low, high] = reach(&text, "External perimeter", z);
        high - low
    };
    let close = |a: f64, b: f64| assert!((a - b).abs() < 0.012, "{a} instead of {b}");
    close(width(&[], 4.0), 12.0);
    close(width(&["--set", "xy_size_compensation_mm=-0.1"], 4.0), 11.8);
    close(width(&["--set", "xy_size_compensation_mm=0.1"], 4.0), 12.2);
    close(width(&["--set", "elefant_foot_compensation_mm=0.15"], 0.2), 11.7);
    close(width(&["--set", "elefant_foot_compensation_mm=0.15"], 0.4), 12.0);
}

#[test]
fn ironing_runs_over_the_top_and_nothing_else() {
    let text = sliced(&mesh::shapes::cube(12.0), &["--set", "ironing=true"]);
    let all = motions(&text);
    let ironing: Vec<&Motion<'_>> =
        all.iter().filter(|m| m.lays() && m.role == "Ironing").collect();
    assert!(ironing.iter().all(|m| (m.to[2] - 12.0).abs() < 1e-3));
    // Lines 0.15 mm apart over the inside, a fifth of the material.
    let length: f64 = ironing.iter().map(|m| m.path()).sum();
    let volume: f64 = ironing.iter().map(|m| m.volume()).sum();
    assert!((length * 0.15 / 100.0 - 1.0).abs() < 0.15, "{length} mm");
    assert!((volume / length - 0.2 * 0.15 * 0.2).abs() < 0.001, "{}", volume / length);
    // After the top itself.
    let first = ironing[0].line;
    let tops = all.iter().filter(|m| m.lays() && m.role == "Top solid infill");
    assert!(tops.clone().count() > 0 && tops.clone().all(|m| m.line < first));
}

#[test]
fn infill_first_and_rough_walls() {
    let cube = mesh::shapes::cube(12.0);
    let order = |text: &str| {
        let all = motions(text);
        let of = |role: &str| {
            all.iter().find(|m| m.lays() && m.role == role && m.layer == Some(20)).unwrap().line
        };
        of("Internal infill") < of("External perimeter")
    };
    assert!(!order(&sliced(&cube, &[])));
    assert!(order(&sliced(&cube, &["--set", "infill_first=true"])));
    let text = sliced(&cube, &["--set", "fuzzy_skin=true"]);
    let all = motions(&text);
    let walls = all.iter().filter(|m| m.lays() && m.role == "External perimeter");
    let depths: Vec<f64> = walls
        .filter(|m| m.layer > Some(0))
        .map(|m| m.at(1.0))
        .map(|[x, y, _]| 6.0 - 0.225 - x.abs().max(y.abs()))
        .collect();
    let deepest = depths.iter().fold(0.0, |a: f64, b| a.max(*b));
    assert!(depths.iter().all(|d| *d > -0.01), "nothing sticks out");
    // A side of the wall that cuts a corner lies deeper there.
    assert!((0.25..0.6).contains(&deepest), "{deepest}");
}

/// The report of a slice in which the surface is left to rhumb.
fn weighed(mesh: &Mesh) -> serde_json::Value {
    let scratch = Scratch::new();
    scratch.file("m.stl", mesh::stl::write(mesh));
    let arguments = ["slice", "m.stl", "-o", "x.gcode", "--json", "--layers", "auto"];
    let slim = ["--orient", "keep", "--set", "nozzle_flat_radius_mm=0.2"];
    let ran = scratch.run(&[&arguments[..], &slim[..]].concat()).expect(0);
    serde_json::from_str(&ran.out).unwrap()
}

#[test]
fn layers_are_chosen_by_what_hangs_over() {
    let cube = weighed(&mesh::shapes::cube(10.0));
    assert_eq!(cube["layers"]["kind"], "planar");
    assert_eq!(cube["layers"]["weighed"]["chosen"], "planar");
    assert_eq!(cube["layers"]["weighed"]["candidates"].as_array().unwrap().len(), 3);
    // A hat that leans out by 60° from the vertical: cones along it carry what planes do not.
    let hat =
        [[0.0, 0.0], [3.0, 0.0], [3.0, 6.0], [10.0, 2.0], [10.0, 3.0], [3.0, 8.0], [0.0, 8.0]];
    let hat = weighed(&mesh::shapes::revolved(&hat, 60));
    let layers = &hat["layers"];
    assert_eq!(layers["kind"], "conical", "{}", layers["weighed"]);
    let area = |k: usize| layers["weighed"]["candidates"][k]["unsupported_mm2"].as_f64().unwrap();
    assert!(area(1) < 0.2 * area(0), "{}", layers["weighed"]);
    assert!(layers["weighed"]["why"].as_str().unwrap().contains("unsupported"));
}

#[test]
fn a_lens_on_a_base_gets_layers_about_the_centre_of_its_face() {
    // A face of 30 mm radius on a cylinder 4 mm high.
    let arc = |k: u32| {
        let r = 12.0 * f64::from(k) / 24.0;
        [r, 4.0 + (900.0 - r * r).sqrt() - 756.0_f64.sqrt()]
    };
    let mut outline = vec![[0.0, 0.0], [12.0, 0.0]];
    outline.extend((0..=24).rev().map(arc));
    let report = weighed(&mesh::shapes::revolved(&outline, 96));
    let weighed = &report["layers"]["weighed"];
    let chosen = weighed["chosen"].as_str().unwrap();
    assert!(chosen.contains("spherical, centre -23.49"), "{weighed}");
    assert!(weighed["why"].as_str().unwrap().contains("steps"), "{weighed}");
    let all = weighed["candidates"].as_array().unwrap();
    let mixed = |c: &&serde_json::Value| {
        c["surface"].as_str().unwrap().starts_with("planar up to 4 mm, then spherical")
    };
    let mixed = all.iter().find(mixed).expect("a planar base is tried");
    assert!(mixed["steps"].as_f64().unwrap() < all[0]["steps"].as_f64().unwrap());
    let least = all.iter().map(|c| c["cost"].as_f64().unwrap()).fold(f64::MAX, f64::min);
    let of = |name: &str| all.iter().find(|c| c["surface"] == name).unwrap()["cost"].as_f64();
    assert_eq!(of(chosen), Some(least), "{weighed}");
}

#[test]
fn a_vase_is_one_line_that_climbs() {
    for layers in [&["--layers", "planar"][..], &["--layers", "conical", "--cone-angle=-15"]] {
        let mut arguments = vec!["--set", "spiral_vase=true", "--set", "skirts=0"];
        arguments.extend(["--set", "bottom_solid_layers=3", "--set", "nozzle_flat_radius_mm=0.2"]);
        arguments.extend(layers);
        let text = sliced(&mesh::shapes::vase(64), &arguments);
        let all = motions(&text);
        // From the first turn on material flows without a break and the bed turns one way.
        let first = text.lines().position(|line| line == "; spiral vase").unwrap();
        let begin = all.iter().position(|m| m.line > first && m.lays()).unwrap();
        let end = all.iter().rposition(Motion::lays).unwrap();
        let climbing = &all[begin..=end];
        let turns = climbing.last().unwrap().layer.unwrap() - climbing[0].layer.unwrap() + 1;
        assert!(turns > 50, "{layers:?}: {turns}");
        let idle: f64 = climbing.iter().filter(|m| !m.lays()).map(Motion::path).sum();
        assert!(idle < 0.02 * turns as f64, "{layers:?}: {idle} mm without material");
        assert!(climbing.iter().all(|m| m.e >= 0.0), "nothing is drawn back");
        let turned = (climbing.last().unwrap().to[1] - climbing[0].from[1]).abs() / 360.0;
        assert!((turned / turns as f64 - 1.0).abs() < 0.05, "{layers:?}: {turned} of {turns}");
        let sign = (climbing.last().unwrap().to[1] - climbing[0].from[1]).signum();
        let back = climbing.iter().filter(|m| sign * (m.to[1] - m.from[1]) < -0.5).count();
        assert_eq!(back, 0, "{layers:?}");
        if layers[1] == "planar" {
            let falls = climbing.iter().filter(|m| m.to[2] < m.from[2] - 1e-3).count();
            assert_eq!(falls, 0);
        }
    }
}

#[test]
fn thin_walls_are_laid_and_the_share_is_told() {
    let report = |mesh: &Mesh| -> serde_json::Value {
        let scratch = Scratch::new();
        scratch.file("m.stl", mesh::stl::write(mesh));
        let arguments = ["slice", "m.stl", "-o", "x.gcode", "--json", "--orient", "keep"];
        let solid = ["--set", "fill_density=100%", "--set", "skirts=0"];
        let ran = scratch.run(&[&arguments[..], &solid[..]].concat());
        serde_json::from_str(&ran.out).unwrap_or_else(|_| panic!("{}", ran.err))
    };
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    // From the tip of a wedge all that is thinner than the thinnest bead is left out.
    let wedge = [[0.0, -0.05], [30.0, -0.6], [30.0, 0.6], [0.0, 0.05]];
    let wedge = report(&extruded(&wedge, &[], 2.0));
    let share = number(&wedge["layers"]["covered_share"]);
    assert!((0.95..0.995).contains(&share), "{share}");
    let laid = number(&wedge["print"]["part_mm3"]) / number(&wedge["model"]["volume_mm3"]);
    assert!((0.9..1.01).contains(&laid), "{laid}");
    // The teeth of a comb.
    let mut comb = vec![[0.0, -3.0], [21.0, -3.0], [21.0, 0.0]];
    for (k, width) in [1.2, 1.05, 0.9, 0.75, 0.6, 0.45, 0.3].into_iter().enumerate() {
        let (middle, half) = (19.5 - 3.0 * k as f64, width / 2.0);
        comb.extend([[middle + half, 0.0], [middle + half, 10.0]]);
        comb.extend([[middle - half, 10.0], [middle - half, 0.0]]);
    }
    comb.push([0.0, 0.0]);
    let comb = report(&extruded(&comb, &[], 2.0));
    assert!(number(&comb["layers"]["covered_share"]) > 0.995, "{}", comb["layers"]);
    let laid = number(&comb["print"]["part_mm3"]) / number(&comb["model"]["volume_mm3"]);
    assert!((0.96..1.01).contains(&laid), "{laid}");
}

/// Layers with sparse infill, and length (mm), volume (mm³) and greatest cross-section (mm²) of its lines.
fn sparse(text: &str) -> (Vec<usize>, [f64; 3]) {
    let all = motions(text);
    let lines = all.iter().filter(|m| m.lays() && m.role == "Internal infill");
    let (mut layers, mut sums) = (Vec::new(), [0.0; 3]);
    for motion in lines {
        layers.extend(motion.layer);
        sums[0] += motion.path();
        sums[1] += motion.volume();
        if motion.path() > 1.0 {
            sums[2] = sums[2].max(motion.volume() / motion.path());
        }
    }
    layers.dedup();
    (layers, sums)
}

#[test]
fn sparse_infill_is_laid_for_several_layers_at_once() {
    let block = mesh::shapes::cube(20.0);
    for layers in ["planar", "conical", "spherical"] {
        let common = [
            "--layers",
            layers,
            "--cone-angle",
            "20",
            "--verify",
            "full",
            "--set",
            "fill_density=0.4",
        ];
        let each = sliced(&block, &common);
        let wanted = |n| sliced(&block, &[&common[..], &["--set", n]].concat());
        let double = wanted("infill_every_layers=2");
        // A bore of 0.4 mm lays no more than two layers of 0.2 mm.
        assert_eq!(motions(&double).len(), motions(&wanted("infill_every_layers=3")).len());
        let (of_each, of_double) = (sparse(&each), sparse(&double));
        let share = of_double.0.len() as f64 / of_each.0.len() as f64;
        assert!(share < 0.6 || layers != "planar", "{layers}: in {share} of the layers");
        let [length, volume, area] = [0, 1, 2].map(|k| of_double.1[k] / of_each.1[k]);
        assert!(length < 0.72, "{layers}: {length} of the length");
        assert!((0.95..1.08).contains(&volume), "{layers}: {volume} of the volume");
        assert!((1.7..2.0).contains(&area), "{layers}: {area} of the cross-section");
        let thick = |height: &str| height.parse().is_ok_and(|h: f64| (h - 0.4).abs() < 0.005);
        let told = |text: &str| {
            text.lines()
                .filter_map(|line| line.strip_prefix(";HEIGHT:"))
                .filter(|h| thick(h))
                .count()
        };
        assert!(
            told(&double) > 10 && told(&each) == 0,
            "{layers}: {} {}",
            told(&double),
            told(&each)
        );
    }
}

#[test]
fn a_bead_thinner_than_announced_is_found() {
    let block = mesh::shapes::cube(12.0);
    let text = sliced(&block, &["--set", "infill_every_layers=2"]);
    let scratch = Scratch::new();
    scratch.file("x.gcode", text.replace(";HEIGHT:0.4", ";HEIGHT:0.3"));
    let ran = scratch.run(&["verify", "x.gcode"]).expect(1);
    assert!(ran.out.contains("flow"), "{}", ran.out);
}

/// Places on the beads of a program by layer and square cell, to find what is near.
struct Near(BTreeMap<(usize, i64, i64), Vec<[f64; 3]>>);

const CELL_MM: f64 = 3.0;

impl Near {
    fn new<'a>(all: impl Iterator<Item = &'a Motion<'a>>) -> Self {
        let mut cells: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for motion in all {
            for at in places(motion) {
                let [x, y] = [0, 1].map(|k| (at[k] / CELL_MM).floor() as i64);
                cells.entry((motion.layer.unwrap(), x, y)).or_default().push(at);
            }
        }
        Self(cells)
    }

    /// How far the nearest place of a layer is, if it is nearer than a cell.
    fn distance(&self, layer: usize, at: &[f64; 3]) -> f64 {
        let [x, y] = [0, 1].map(|k| (at[k] / CELL_MM).floor() as i64);
        let mut least = f64::INFINITY;
        for cell in (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (layer, x, y))) {
            for p in self.0.get(&cell).into_iter().flatten() {
                least = (0..3).map(|k| (p[k] - at[k]).powi(2)).sum::<f64>().sqrt().min(least);
            }
        }
        least
    }
}

/// Places along a motion, 0.2 mm apart.
fn places<'a>(motion: &'a Motion<'a>) -> impl Iterator<Item = [f64; 3]> + 'a {
    let steps = (motion.path() / 0.2).ceil().max(1.0);
    (0..=steps as u32).map(move |k| motion.at(f64::from(k) / steps))
}

#[test]
fn lightning_carries_tops_from_the_walls() {
    let block = mesh::shapes::cube(20.0);
    for layers in ["planar", "conical", "spherical"] {
        let common = ["--layers", layers, "--cone-angle", "25", "--verify", "full"];
        let of = |pattern| sliced(&block, &[&common[..], &["--set", pattern]].concat());
        let text = of("fill_pattern=lightning");
        let share = sparse(&text).1[1] / sparse(&of("fill_pattern=rectilinear")).1[1];
        assert!((0.02..0.5).contains(&share), "{layers}: {share} of the material of lines");
        let all = motions(&text);
        let laid = || all.iter().filter(|m| m.lays() && m.layer.is_some());
        let every = Near::new(laid());
        let walls = Near::new(laid().filter(|m| m.role != "Internal infill"));
        // A third of its width carries every branch, as it does an overhang of 56°: its middle lies within
        // 0.75 mm of that of a wall below.
        let mut tips = 0;
        for motion in laid().filter(|m| m.role == "Internal infill") {
            for at in places(motion) {
                let off = every.distance(motion.layer.unwrap() - 1, &at);
                assert!(off < 0.78, "{layers}: {at:?} hangs {off} mm from anything");
            }
            tips += 1;
        }
        assert!(tips > 100, "{layers}: {tips}");
        // All that closes the part has a wall or a branch near.
        let solid = laid().filter(|m| m.role == "Solid infill" && m.layer > Some(3));
        let mut judged = 0;
        for at in solid.flat_map(|m| places(m).map(|at| (m.layer.unwrap(), at))) {
            let off = every.distance(at.0 - 1, &at.1);
            assert!(off < 2.9, "{layers}: layer {} at {:?}: {off}", at.0, at.1);
            judged += 1;
        }
        assert!(judged > 1000, "{layers}: {judged}");
        // Every line has an end at a wall, at what is solid in its layer, or at another branch.
        for line in beads(&all, "Internal infill") {
            let layer = line[0].layer.unwrap();
            let ends = [line[0].at(0.0), line[line.len() - 1].at(1.0)];
            if ends.iter().any(|at| walls.distance(layer, at) < 1.0) {
                continue;
            }
            let first = line[0].line..=line[line.len() - 1].line;
            let others = laid().filter(|m| m.layer == Some(layer) && m.role == "Internal infill");
            let others = Near::new(others.filter(|m| !first.contains(&m.line)));
            let at_branch = ends.iter().any(|at| others.distance(layer, at) < 0.5);
            assert!(at_branch, "{layers}: layer {layer}, {ends:?}");
        }
    }
}
