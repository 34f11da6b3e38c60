//! The contract of the text: what firmwares, viewers and print servers read.

use std::collections::BTreeSet;

use crate::program::motions;
use crate::run::{Scratch, sliced};

/// Words of a motion in each dialect, with the most decimal places that each may have.
const POLAR: &[(char, usize)] = &[('R', 5), ('T', 4), ('Z', 3), ('E', 5), ('F', 1)];
const CARTESIAN: &[(char, usize)] = &[('X', 5), ('Y', 5), ('Z', 3), ('E', 5), ('F', 1)];

/// Whether a number is in its shortest decimal form with at most so many places.
fn is_shortest(text: &str, places: usize) -> bool {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let (whole, part) = digits.split_once('.').unwrap_or((digits, "1"));
    let all_digits = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
    all_digits(whole)
        && all_digits(part)
        && (whole == "0" || !whole.starts_with('0'))
        && !part.ends_with('0')
        && part.len() <= places
        && text != "-0"
}

#[test]
fn the_form_of_numbers_is_judged_rightly() {
    for good in ["0", "-0.5", "12", "12.345", "-3", "100"] {
        assert!(is_shortest(good, 3), "{good}");
    }
    for bad in ["-0", "1.50", "1.2345", "01", ".5", "1.", "1e3", "nan", "", "+1"] {
        assert!(!is_shortest(bad, 3), "{bad}");
    }
}

fn is_well_formed(text: &str, words: &[(char, usize)]) {
    assert!(text.ends_with('\n'));
    let mut has_feed = false;
    for (line, command) in (1..).zip(text.lines()) {
        let fits =
            command.len() <= 90 && command.bytes().all(|c| c == b' ' || c.is_ascii_graphic());
        assert!(fits && !command.ends_with(' '), "line {line}: {command:?}");
        // The last lift is marked, so that print servers do not take it for the part's height.
        let Some(motion) = command.trim_end_matches(" ;E").strip_prefix("G1") else {
            // No curve in any coordinates, no second way to move.
            let is_other_motion = ["G0", "G2 ", "G3 ", "G02", "G03", "G5"];
            assert!(
                !is_other_motion.iter().any(|g| command.starts_with(g)),
                "line {line}: {command}"
            );
            continue;
        };
        let given: Vec<(char, &str)> = motion
            .split(' ')
            .skip(1)
            .map(|word| (word.chars().next().unwrap(), &word[1..]))
            .collect();
        for (letter, number) in &given {
            let places = words.iter().find(|(known, _)| known == letter).map(|(_, places)| *places);
            assert!(places.is_some_and(|p| is_shortest(number, p)), "line {line}: {command}");
        }
        let has = |letter| given.iter().any(|(word, _)| *word == letter);
        assert_eq!(has(words[0].0), has(words[1].0), "line {line}: half a place: {command}");
        has_feed |= has('F');
        assert!(has_feed, "line {line}: no speed yet: {command}");
        let value = |letter| given.iter().find(|(word, _)| *word == letter).map(|(_, n)| *n);
        let number = |letter| value(letter).map_or(0.0, |n| n.parse::<f64>().unwrap());
        assert!(value('F').is_none() || number('F') > 0.0, "line {line}: {command}");
        assert!(number('E').abs() <= 50.0, "line {line}: {command}");
        let letters: BTreeSet<char> = given.iter().map(|(letter, _)| *letter).collect();
        assert_eq!(letters.len(), given.len(), "line {line}: a word stands twice: {command}");
    }
}

#[test]
fn every_line_keeps_the_contract() {
    is_well_formed(&sliced("steps", &[]), POLAR);
    is_well_formed(&sliced("gear", &["--dialect", "cartesian"]), CARTESIAN);
    is_well_formed(&sliced("cube", &["--place", "9.9,0", "--material", "petg"]), POLAR);
}

#[test]
fn layers_are_announced_as_viewers_read_them() {
    // 15.3 mm tall: a first layer of 0.3 mm and 75 of 0.2 mm.
    let text = sliced("cube", &["--scale", "0.765", "--set", "first_layer_height_mm=0.3"]);
    let lines: Vec<&str> = text.lines().collect();
    let starts: Vec<usize> = (0..lines.len()).filter(|&i| lines[i] == ";LAYER_CHANGE").collect();
    for (number, &start) in starts.iter().enumerate() {
        let height = if number == 0 { 0.3 } else { 0.2 };
        let z = (0.3 + 0.2 * number as f64) as f32;
        let wanted = [
            format!(";Z:{z}"),
            format!(";HEIGHT:{height}"),
            format!(";LAYER:{number}"),
            ";BEFORE_LAYER_CHANGE".into(),
            format!(";{z}"),
            ";AFTER_LAYER_CHANGE".into(),
            format!(";{z}"),
        ];
        assert_eq!(&lines[start + 1..start + 8], wanted);
    }
    assert_eq!(starts.len(), 76);
    assert!(lines.contains(&"; num_layers = 76") && lines.contains(&"; total layers count = 76"));
    // What is laid lies on the level that was announced.
    for motion in motions(&text).iter().filter(|motion| motion.lays()) {
        let z = 0.3 + 0.2 * motion.layer.unwrap() as f64;
        assert!((motion.to[2] - z).abs() < 1e-3, "line {}", motion.line);
    }
}

#[test]
fn roles_are_those_that_viewers_know() {
    const KNOWN: [&str; 11] = [
        "External perimeter",
        "Perimeter",
        "Overhang perimeter",
        "Internal infill",
        "Solid infill",
        "Top solid infill",
        "Bridge infill",
        "Gap fill",
        "Skirt/Brim",
        "Support material",
        "Custom",
    ];
    let text = sliced("cube", &["--set", "brim_width_mm=2"]);
    let motions = motions(&text);
    let said: BTreeSet<&str> =
        motions.iter().filter(|motion| motion.lays()).map(|motion| motion.role).collect();
    for role in &said {
        assert!(KNOWN.contains(role), "{role}");
    }
    for role in ["External perimeter", "Perimeter", "Internal infill", "Solid infill"] {
        assert!(said.contains(role), "{role} is missing: {said:?}");
    }
    assert!(said.contains("Top solid infill") && said.contains("Skirt/Brim"), "{said:?}");
}

/// The value of `; name = value`.
fn said(text: &str, name: &str) -> String {
    let start = format!("; {name} = ");
    let found: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix(&start)).collect();
    assert_eq!(found.len(), 1, "{name} stands {} times", found.len());
    found[0].to_owned()
}

#[test]
fn the_end_says_what_it_takes_and_how_it_was_made() {
    let text = sliced("cube", &["--set", "perimeters=3"]);
    let fed: f64 = motions(&text).iter().map(|motion| motion.e).sum();
    let mm: f64 = said(&text, "filament used [mm]").parse().unwrap();
    // What is drawn back at the end is in the nozzle all the same.
    assert!((mm - fed).abs() < 0.82, "{fed} mm are fed, {mm} said");
    let cm3: f64 = said(&text, "filament used [cm3]").parse().unwrap();
    let area = std::f64::consts::PI * 1.75 * 1.75 / 4.0;
    assert!((cm3 - mm * area / 1000.0).abs() < 0.006, "{cm3}");
    let grams: f64 = said(&text, "filament used [g]").parse().unwrap();
    assert!((grams - mm * area / 1000.0 * 1.24).abs() < 0.006, "{grams}");
    assert_eq!(said(&text, "total filament used [g]"), said(&text, "filament used [g]"));
    let duration: f64 = motions(&text).iter().map(crate::program::Motion::duration).sum();
    let time = said(&text, "estimated printing time (normal mode)");
    let seconds: f64 = time
        .split(' ')
        .map(|part| {
            let (number, unit) = part.split_at(part.len() - 1);
            let second = match unit {
                "d" => 86_400.0,
                "h" => 3600.0,
                "m" => 60.0,
                _ => 1.0,
            };
            number.parse::<f64>().unwrap() * second
        })
        .sum();
    // Starting and stopping takes time that no F tells.
    assert!((0.99..1.5).contains(&(seconds / duration)), "{time}, {duration:.0} s of motion");
    for (name, value) in [
        ("layer_height", "0.2"),
        ("perimeters", "3"),
        ("fill_density", "15%"),
        ("dialect", "polar"),
    ] {
        assert_eq!(said(&text, name), value, "{name}");
    }
}

#[test]
fn only_the_first_line_knows_the_time() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    let at = |seconds: &str| {
        let mut run = scratch.rhumb(&["slice", "cube.stl", "-q", "-o", "-"]);
        String::from_utf8(run.env("SOURCE_DATE_EPOCH", seconds).output().unwrap().stdout).unwrap()
    };
    let (one, other) = (at("0"), at("86400"));
    let (first, rest) = one.split_once('\n').unwrap();
    let (other_first, other_rest) = other.split_once('\n').unwrap();
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(first, format!("; generated by rhumb {version} on 1970-01-01 at 00:00:00"));
    assert_eq!(other_first, format!("; generated by rhumb {version} on 1970-01-02 at 00:00:00"));
    assert!(rest == other_rest);
}
