//! Other slicers' programs: what `convert` makes of them.

use serde_json::Value;

use super::{Corpus, MACHINE, Wanted, end, faults, leftovers, limited, none};
use crate::program::{Motion, motions};
use crate::run::{Ran, Scratch};

/// Where the machine stands before the first motion.
const HOME: [f64; 3] = [100.0, 0.0, 5.0];

/// The warnings that a run tells.
fn warnings(report: &Value) -> Vec<&str> {
    let all = report["warnings"].as_array().unwrap().iter();
    all.map(|warning| warning["code"].as_str().unwrap()).collect()
}

/// Compares the program written with what is true of the source.
fn untrue(id: &str, case: &Value, text: &str) -> Vec<String> {
    let facts = &case["facts"];
    let mut found = Vec::new();
    let all = motions(text);
    let tolerance = case["tol_mm"].as_f64().unwrap_or(0.001).max(0.001);
    let mut wrong = |what: &str, is: f64, wanted: f64, off: f64| {
        if (is - wanted).abs() > off {
            found.push(format!("{id}: {what} {is} and not {wanted}"));
        }
    };
    if let Some(end) = facts["end_xyz"].as_array() {
        let last = all.last().map_or(HOME, |motion| motion.at(1.0));
        for (k, wanted) in end.iter().enumerate() {
            wrong(["x", "y", "z"][k], last[k], wanted.as_f64().unwrap(), tolerance);
        }
    }
    if let Some(wanted) = facts["extruded_mm"].as_f64() {
        let fed: f64 = all.iter().map(|motion| motion.e).sum();
        wrong("filament", fed, wanted, 1e-3 + 1e-5 * wanted * all.len() as f64);
    }
    let laid: Vec<&Motion<'_>> = all.iter().filter(|motion| motion.lays()).collect();
    if let Some(wanted) = facts["path_len_mm"].as_f64() {
        let path: f64 = laid.iter().map(|motion| motion.path()).sum();
        wrong("path", path, wanted, 0.002 * wanted);
    }
    if let Some(range) = facts["r_range_mm"].as_array() {
        let [low, high] = [0, 1].map(|k| range[k].as_f64().unwrap());
        for motion in &laid {
            let [x, y, _] = motion.at(0.5);
            let radius = x.hypot(y);
            wrong("radius", radius, radius.clamp(low, high), 0.0);
        }
    }
    if facts["moves"].as_u64() == Some(0) {
        wrong("moves", all.len() as f64, 0.0, 0.0);
    }
    if let Some(most) = facts["theta_step_max_deg"].as_f64() {
        for motion in &laid {
            let step = (motion.to[1] - motion.from[1]).abs();
            wrong("turn of a step", step, step.min(most), 0.0);
        }
    }
    if let Some(most) = facts["theta_travel_max_deg"].as_f64() {
        let turned: f64 = laid.iter().map(|motion| (motion.to[1] - motion.from[1]).abs()).sum();
        wrong("turn", turned, turned.min(most), 0.0);
    }
    found
}

fn convert(file: &str, case: &Value, more: &[&str]) -> (Scratch, Ran) {
    let scratch = Scratch::new();
    let mut arguments = vec!["convert", file, "-o", "out.gcode", "--json", "--threads", "2"];
    arguments.extend(MACHINE);
    arguments.extend(more);
    let ran = limited(&scratch, case, &arguments);
    (scratch, ran)
}

#[test]
fn every_program_ends_as_expected() {
    let Some(corpus) = Corpus::get() else { return };
    let (mut found, mut n_cases) = (Vec::new(), 0);
    for case in corpus.cases(&["gcode"]) {
        let (id, file) = corpus.file(case);
        n_cases += 1;
        let (scratch, ran) = convert(file.to_str().unwrap(), case, &[]);
        // What the proof finds in the source's own orders is told by status 1.
        let is_warned = case["outcome"] == "ok_warn" && ran.code == Some(1);
        if !is_warned {
            found.extend(faults(case, &ran));
        }
        found.extend(leftovers(id, &ran, &scratch));
        let Some(0 | 1) = ran.code else { continue };
        let report: Value = serde_json::from_str(&ran.out).unwrap();
        let said = warnings(&report);
        for wanted in case["warn"].as_array().into_iter().flatten() {
            if !said.contains(&wanted.as_str().unwrap()) {
                found.push(format!("{id} warns of {said:?} and not of {wanted}"));
            }
        }
        if case["outcome"] == "ok" && !said.is_empty() {
            found.push(format!("{id} warns of {said:?}"));
        }
        let text = std::fs::read_to_string(scratch.path("out.gcode")).unwrap();
        found.extend(untrue(id, case, &text));
    }
    let least = match Wanted::get() {
        Wanted::Quick => 80,
        Wanted::Slow => 2,
        Wanted::All => 82,
    };
    assert!(n_cases >= least, "{n_cases} are not the corpus");
    none(&found, n_cases);
}

#[test]
fn dangerous_commands_go_over_when_they_are_allowed() {
    let Some(corpus) = Corpus::get() else { return };
    let is_it = |case: &&Value| case["id"] == "gcode/temp_disable_safety";
    let case = corpus.cases(&["gcode"]).find(is_it).unwrap();
    let (_, file) = corpus.file(case);
    for (more, goes_over) in [(&[][..], false), (&["--allow-dangerous"], true)] {
        let (scratch, ran) = convert(file.to_str().unwrap(), case, more);
        assert_eq!(end(&ran), "0", "{}", ran.err);
        let text = std::fs::read_to_string(scratch.path("out.gcode")).unwrap();
        for command in ["M302 P1", "M500", "M92 E1000"] {
            assert_eq!(text.lines().any(|line| line == command), goes_over, "{command}");
        }
    }
}
