//! Machines whose head turns the nozzle: what their programs say, read by kinematics of this file's own.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use crate::run::{Scratch, model};

const MACHINES: [&str; 4] = ["tilt-core-r-theta", "polar-two-axis", "hexapod", "hexapod-fixed"];

/// The words of the moves that lay material on curved layers, in force at their ends.
fn beads(text: &str) -> Vec<BTreeMap<char, f64>> {
    let curved = text.split("; layer surface = ").nth(2).expect("curved layers follow planar ones");
    let mut now = BTreeMap::new();
    let mut beads = Vec::new();
    for line in curved.lines().filter(|line| line.starts_with("G1 ")) {
        now.remove(&'E');
        for word in line.split(';').next().unwrap().split_whitespace().skip(1) {
            let letter = word.chars().next().unwrap();
            now.insert(letter, word[1..].parse::<f64>().unwrap());
        }
        if now.get(&'E').is_some_and(|e| *e > 0.0) && line.len() > 20 {
            beads.push(now.clone());
        }
    }
    assert!(beads.len() > 500);
    beads
}

fn sliced(printer: &str, arguments: &[&str]) -> String {
    let dome = model("dome");
    let mut all = vec!["slice", dome.to_str().unwrap(), "-q", "--scale=0.5", "-o", "-"];
    all.extend(["--printer", printer]);
    all.extend(arguments);
    Scratch::new().run(&all).expect(0).out
}

const SPHERES: [&str; 4] = ["--layers=spherical", "--sphere-centre=-12", "--set", "tilt=normal"];

/// Tip and direction in the frame of the rail, from words in mm and degrees.
fn forward(words: &BTreeMap<char, f64>, rail: char, pivot: f64) -> ([f64; 3], [f64; 3]) {
    let angle = |letter| words.get(&letter).copied().unwrap_or(0.0) * PI / 180.0;
    let ((sin_a, cos_a), (sin_b, cos_b)) = (angle('A').sin_cos(), angle('B').sin_cos());
    let axis = [sin_b * cos_a, -sin_a, cos_b * cos_a];
    let stand = [words[&rail], 0.0, words[&'Z'] + pivot];
    ([0, 1, 2].map(|k| stand[k] - pivot * axis[k]), axis)
}

#[test]
fn tips_lie_on_spheres_and_nozzles_along_their_normals() {
    for (printer, rail, pivot) in [("tilt-core-r-theta", 'X', 43.0), ("polar-two-axis", 'R', 45.0)]
    {
        let text = sliced(printer, &SPHERES);
        let mut steepest: f64 = 0.0;
        // Beads of one layer have one radius about the centre; all radii are a layer apart.
        for words in beads(&text) {
            let (tip, axis) = forward(&words, rail, pivot);
            let out = [tip[0], tip[1], tip[2] + 12.0];
            let radius = out.iter().map(|c| c * c).sum::<f64>().sqrt();
            let cosine = (0..3).map(|k| out[k] * axis[k]).sum::<f64>() / radius;
            steepest = steepest.max(axis[2].acos());
            let bounded = axis[2].acos() > 0.52;
            assert!(bounded || cosine > (0.6 * PI / 180.0).cos(), "{printer}: {cosine} {words:?}");
            // A tenth of a layer of 0.2 mm is told from rounding.
            let level = (radius - 12.0 - 0.4) / 0.2;
            assert!((level - level.round()).abs() < 0.03, "{printer}: level {level}");
        }
        assert!(steepest > 0.3, "{steepest}");
    }
}

#[test]
fn every_machine_has_its_words_and_proves_its_program() {
    let scratch = Scratch::new();
    for (printer, letters) in MACHINES.iter().zip(["BCEFXZ", "ABEFRTZ", "EFTUVWXYZ", "EFUVWXYZ"]) {
        // The check of the finished program would refuse it.
        let text = sliced(printer, &SPHERES);
        let mut seen: Vec<char> = text
            .lines()
            .filter(|line| line.starts_with("G1 "))
            .flat_map(|line| line.split(';').next().unwrap().split_whitespace().skip(1))
            .map(|word| word.chars().next().unwrap())
            .collect();
        seen.sort_unstable();
        seen.dedup();
        let seen: String =
            seen.into_iter().filter(|c| printer != &"polar-two-axis" || *c != 'A').collect();
        assert_eq!(seen, letters.replace('A', ""), "{printer}");
        // A bead in the middle is told to stand elsewhere.
        let lines: Vec<&str> = text.lines().collect();
        let own = if printer.contains("hexapod") { " U" } else { " B" };
        let hit = (lines.len() / 2..)
            .find(|&k| lines[k].contains(own) && lines[k].contains(" E"))
            .unwrap();
        let wrong = lines.iter().enumerate().map(|(k, line)| {
            if k != hit {
                return format!("{line}\n");
            }
            let at = line.find(own).unwrap() + own.len();
            let end = line[at..].find(' ').map_or(line.len(), |end| at + end);
            let number = line[at..end].parse::<f64>().unwrap() + 3.0;
            format!("{}{number:.3}{}\n", &line[..at], &line[end..])
        });
        scratch.file("wrong.gcode", wrong.collect::<String>());
        let told = scratch.run(&["verify", "wrong.gcode", "--printer", printer]).expect(1).out;
        assert!(told.contains("head: "), "{printer}: {told}");
    }
}

#[test]
fn heads_that_tilt_lay_layers_that_upright_nozzles_refuse() {
    let steep = ["--layers=conical", "--cone-angle=58"];
    let scratch = Scratch::new();
    let dome = model("dome");
    let slice = ["slice", dome.to_str().unwrap(), "-q", "--scale=0.5", "-o", "a.gcode"];
    scratch.run(&[&slice[..], &steep].concat()).refused("OutOfEnvelope", 5);
    let none = [&slice[..], &steep, &["--printer=tilt-core-r-theta", "--set=tilt=none"]].concat();
    scratch.run(&none).refused("OutOfEnvelope", 5);
    let needed = sliced("tilt-core-r-theta", &steep);
    let normal = sliced("tilt-core-r-theta", &[&steep[..], &["--set", "tilt=normal"]].concat());
    let least = |text: &str| beads(text).iter().map(|words| words[&'B']).fold(0.0, f64::max);
    let (needed, normal) = (least(&needed), least(&normal));
    assert!(needed > 5.0 && needed < 35.0 && normal > needed + 5.0, "{needed} {normal}");
}

#[test]
fn firmwares_that_turn_coordinates_themselves_are_no_match_for_a_tilt() {
    let scratch = Scratch::new();
    let dome = model("dome");
    let slice = ["slice", dome.to_str().unwrap(), "--printer=polar-two-axis", "-o", "a.gcode"];
    let wrong = [&slice[..], &["--dialect=klipper-polar"]].concat();
    scratch.run(&wrong).refused("ConfigConflict", 6);
    let joints = ["--set=head=hexapod", "--set=hexapod_layout=joints"];
    scratch.run(&[&slice[..], &joints].concat()).refused("ConfigConflict", 6);
}

#[test]
fn programs_of_other_slicers_are_converted_for_heads_that_stay_upright() {
    let scratch = Scratch::new();
    scratch.cube("c.stl", 8.0);
    let other = ["--dialect", "cartesian", "--set", "head=fixed", "--printer", "tilt-core-r-theta"];
    let slice = ["slice", "c.stl", "-q", "-o", "c.gcode"];
    scratch.run(&[&slice[..], &other[..]].concat()).expect(0);
    for printer in MACHINES {
        let ran = scratch.run(&["convert", "c.gcode", "-q", "-o", "p.gcode", "--printer", printer]);
        if printer.starts_with("hexapod") {
            ran.refused("ConfigConflict", 6);
            continue;
        }
        ran.expect(0);
        scratch.run(&["verify", "p.gcode", "-q", "--printer", printer]).expect(0);
    }
}
