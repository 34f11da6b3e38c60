//! Settings files, under the names of their keys here.

use serde_json::Value;

use super::{Corpus, faults, leftovers, limited, none};
use crate::run::Scratch;

/// Keys of the corpus, ours, and the section they belong to.
const KEYS: [(&str, &str, &str); 8] = [
    ("layer_height", "layer_height_mm", "--print"),
    ("nozzle_diameter", "nozzle_diameter_mm", "--printer"),
    ("nozzle_temperature", "temperature_c", "--material"),
    ("bed_radius", "rail_max_mm", "--printer"),
    ("infill_density", "fill_density", "--print"),
    ("printer_name", "printer_model", "--printer"),
    ("start_gcode", "start_gcode", "--printer"),
    ("seam_gap", "seam_gap", "--print"),
];

/// Takes a file of the corpus apart into files of our sections, each in its place: what is no line with
/// a known key goes with the settings of the print.
fn sections(text: &[u8]) -> Vec<(&'static str, Vec<u8>)> {
    let mut parts = ["--print", "--printer", "--material"].map(|section| (section, Vec::new()));
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        let word = String::from_utf8_lossy(line);
        let key = word.trim_start_matches('\u{feff}').split([' ', '=']).next().unwrap_or_default();
        let known = KEYS.iter().find(|(theirs, ..)| *theirs == key);
        let (section, ours) =
            known.map_or(("--print", key), |(_, ours, section)| (*section, *ours));
        let mark = word.len() - word.trim_start_matches('\u{feff}').len();
        let line = match known {
            Some(_) => [&line[..mark], ours.as_bytes(), &line[mark + key.len()..]].concat(),
            None => line.to_vec(),
        };
        for (name, part) in &mut parts {
            // Lines keep their numbers.
            part.extend(if *name == section { line.clone() } else { b"\n".to_vec() });
        }
    }
    parts.into_iter().filter(|(_, part)| !part.iter().all(|byte| *byte == b'\n')).collect()
}

fn is_text_of_ours(text: &[u8]) -> bool {
    text.len() < 10_000 && std::str::from_utf8(text).is_ok()
}

#[test]
fn every_settings_file_ends_as_expected() {
    let Some(corpus) = Corpus::get() else { return };
    let (mut found, mut n_cases) = (Vec::new(), 0);
    for case in corpus.cases(&["config"]) {
        let (id, file) = corpus.file(case);
        n_cases += 1;
        let scratch = Scratch::new();
        let text = std::fs::read(file).unwrap();
        let files = if is_text_of_ours(&text) { sections(&text) } else { vec![("--print", text)] };
        let outside = Scratch::new();
        outside.cube("cube.stl", 6.0);
        let path = |name: &str| outside.path(name).to_str().unwrap().to_owned();
        let mut arguments = vec!["slice".to_owned(), path("cube.stl"), "-q".into()];
        arguments.extend(["-o".into(), "out.gcode".into()]);
        // The bed of the corpus is smaller than ours.
        arguments.extend(["--set".into(), "home_rail_mm=100".into()]);
        for (section, part) in files {
            let name = format!("{}.toml", &section[2..]);
            outside.file(&name, part);
            arguments.extend([section.to_owned(), path(&name)]);
        }
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let ran = limited(&scratch, case, &arguments);
        found.extend(faults(case, &ran));
        found.extend(leftovers(id, &ran, &scratch));
        found.extend(told(id, case, &scratch));
    }
    assert_eq!(n_cases, 49);
    none(&found, n_cases);
}

/// What must not stand in a program: commands out of names, and keys.
fn told(id: &str, case: &Value, scratch: &Scratch) -> Option<String> {
    let text = std::fs::read_to_string(scratch.path("out.gcode")).ok()?;
    case["forbid_in_output"].as_str()?;
    let bad = |line: &&str| {
        ["M104 S999", "M140 S99", "M105"].iter().any(|start| line.starts_with(start))
            || line.contains("hunter2")
            || line.contains("S3CRET")
    };
    text.lines().find(bad).map(|line| format!("{id} emits {line}"))
}
