//! One line of a sound program is changed; the check that watches over it must speak up.

use crate::program::{ANNOUNCED, judged, printer, square};

/// The check that must find it, and what it does.
type Mutation = (&'static str, fn(&mut Vec<String>));

/// A letter, and what becomes of its number.
type Change = (char, fn(f64) -> f64);

/// The position of the `n`th line that contains `what`.
fn nth(lines: &[String], what: &str, n: usize) -> usize {
    let found = lines.iter().enumerate().filter(|(_, line)| line.contains(what)).nth(n);
    found.unwrap_or_else(|| panic!("{what} is in the program")).0
}

fn replace(lines: &mut [String], what: &str, by: &str) {
    let at = nth(lines, what, 0);
    lines[at] = lines[at].replace(what, by);
}

fn remove(lines: &mut Vec<String>, what: &str) {
    let at = nth(lines, what, 0);
    lines.remove(at);
}

/// A line that lays material in the middle of a side of the second layer.
fn wall(lines: &[String]) -> usize {
    nth(lines, " T", 1 + 160 + 50)
}

/// Replaces the number of a word on that line by what `change` makes of it.
fn word(lines: &mut [String], at: usize, letter: char, change: impl Fn(f64) -> f64) {
    let words: Vec<String> = lines[at]
        .split(' ')
        .map(|word| match word.strip_prefix(letter) {
            Some(number) => {
                let value = change(number.parse().expect("the program has numbers"));
                format!("{letter}{}", (value * 1e5).round() / 1e5)
            }
            None => word.to_string(),
        })
        .collect();
    lines[at] = words.join(" ");
}

fn set(lines: &mut [String], text: &str) {
    let at = wall(lines);
    lines[at] = text.to_string();
}

fn append(lines: &mut [String], text: &str) {
    let at = wall(lines);
    lines[at].push_str(text);
}

fn insert(lines: &mut Vec<String>, text: &str) {
    let at = wall(lines);
    lines.insert(at, text.to_string());
}

const TEXT: [Mutation; 20] = [
    ("text", |lines| insert(lines, &format!("; {}", "x".repeat(90)))),
    ("text", |lines| insert(lines, "; caf\u{e9}")),
    ("text", |lines| insert(lines, "M117 a\rM104 S999")),
    ("text", |lines| append(lines, " ")),
    ("text", |lines| append(lines, " G1 E5")),
    ("text", |lines| set(lines, "G1 R2e1 T451.2 E0.03")),
    ("text", |lines| set(lines, "G1 RNaN T451.2 E0.03")),
    ("text", |lines| set(lines, "G1 R20 Tinf E0.03")),
    ("text", |lines| set(lines, "G1 R20 T-0 E0.03")),
    ("text", |lines| set(lines, "G1 R20 T451.2 E.03")),
    ("text", |lines| set(lines, "G1 R20 E0.03")),
    ("text", |lines| replace(lines, "F2400", "F-2400")),
    ("text", |lines| replace(lines, "F2400", "F0")),
    ("text", |lines| replace(lines, "E20", "E50")),
    ("text", |lines| replace(lines, "G1 R", "G0 R")),
    ("text", |lines| insert(lines, "G3 R20 T451.2 I1 J1")),
    ("text", |lines| insert(lines, "M82")),
    ("text", |lines| insert(lines, "M906 X2000")),
    ("text", |lines| insert(lines, "G92 R0")),
    ("text", |lines| insert(lines, "SAVE_CONFIG")),
];

const MACHINE: [Mutation; 22] = [
    ("modes", |lines| remove(lines, "G28")),
    ("modes", |lines| remove(lines, "G90")),
    ("modes", |lines| remove(lines, "M83")),
    ("modes", |lines| replace(lines, "G1 R19.775 T0 F6000", "G1 R19.775 T0")),
    ("reach", |lines| replace(lines, "R19.775", "R120.002")),
    ("reach", |lines| replace(lines, "R19.775", "R-0.002")),
    ("reach", |lines| replace(lines, "Z1.2", "Z150.002")),
    ("reach", |lines| replace(lines, "G1 Z0.2", "G1 Z-0.002")),
    ("axis", |lines| insert(lines, "G1 R0.49 T451.2")),
    ("speed", |lines| replace(lines, "F6000", "F9100")),
    ("speed", |lines| append(lines, " F9000")),
    ("speed", |lines| replace(lines, "G1 Z0.2 F600", "G1 Z0.2 F610")),
    ("acceleration", |lines| append(lines, " F6000")),
    ("acceleration", |lines| replace(lines, "R19.775 T0", "R99 T0")),
    ("acceleration", |lines| {
        let first_of_second_layer = nth(lines, "G1 E0.8", 0) + 1;
        lines[first_of_second_layer] = lines[first_of_second_layer].replace("F600", "F4000");
    }),
    ("heat", |lines| replace(lines, "M109 S210", "M109 S261")),
    ("heat", |lines| replace(lines, "M190 S60", "M190 S111")),
    ("heat", |lines| replace(lines, "M109 S210", "M109 S169")),
    ("heat", |lines| remove(lines, "M109 S210")),
    ("heat", |lines| insert(lines, "M104 S150")),
    ("heat", |lines| remove(lines, "M104 S0")),
    ("heat", |lines| remove(lines, "M140 S0")),
];

const PART: [Mutation; 22] = [
    ("continuity", |lines| {
        let at = wall(lines);
        word(lines, at, 'T', |t| t - 360.0);
    }),
    ("deposit", |lines| {
        let at = wall(lines);
        word(lines, at, 'R', |r| r + 1.5);
        word(lines, at, 'T', |t| t + 9.0);
    }),
    ("continuity", |lines| remove(lines, "G1 E0.8")),
    ("continuity", |lines| replace(lines, "E0.8", "E0.798")),
    ("continuity", |lines| replace(lines, "E0.8", "E0.802")),
    ("continuity", |lines| insert(lines, "G1 E-0.5")),
    ("continuity", |lines| {
        let second = nth(lines, "G1 E-0.8", 1);
        lines.remove(second);
    }),
    ("continuity", |lines| replace(lines, ";LAYER:1", ";LAYER:2")),
    ("continuity", |lines| replace(lines, ";LAYER:0", ";LAYER:1")),
    ("continuity", |lines| replace(lines, ";Z:0.6", ";Z:0.3")),
    ("continuity", |lines| remove(lines, ";Z:0.6")),
    ("continuity", |lines| {
        let last = nth(lines, "E-0.8", 2);
        lines[last] = lines[last].replace("E-0.8", "E-12");
    }),
    ("volume", |lines| {
        let at = wall(lines);
        word(lines, at, 'E', |e| e * 20.0);
    }),
    ("volume", |lines| replace(lines, ";HEIGHT:0.2", ";HEIGHT:0.15")),
    ("deposit", |lines| {
        let at = wall(lines);
        word(lines, at, 'R', |r| r + 0.08);
    }),
    ("flow", |lines| {
        let at = wall(lines);
        lines.remove(at);
    }),
    ("flow", |lines| {
        let at = wall(lines);
        lines.swap(at, at + 1);
    }),
    ("flow", |lines| {
        for at in 0..lines.len() {
            if lines[at].starts_with("G1 R") {
                word(lines, at, 'E', |e| e * 1.05);
            }
        }
    }),
    ("surface", |lines| append(lines, " Z0.35")),
    ("surface", |lines| {
        for text in lines.iter_mut() {
            *text = text.replace("Z0.4", "Z0.45").replace(";Z:0.4", ";Z:0.45");
        }
    }),
    ("deposit", |lines| {
        let at = wall(lines);
        word(lines, at, 'R', |r| r - 0.1);
    }),
    ("deposit", |lines| replace(lines, ANNOUNCED, ";WIDTH:0.56")),
];

#[test]
fn every_mutation_is_caught_by_its_check() {
    let mut missed = Vec::new();
    for (table, mutations) in [("text", &TEXT[..]), ("machine", &MACHINE), ("part", &PART)] {
        for (index, (check, mutate)) in mutations.iter().enumerate() {
            let mut lines = square();
            mutate(&mut lines);
            assert_ne!(lines, square(), "{table} {index} changes nothing");
            let verdict = judged(&lines, &printer());
            if !verdict.findings.iter().any(|finding| finding.check == *check) {
                missed.push(format!("{table} {index}: {check}: {:?}", verdict.findings));
            }
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn a_print_that_lacks_material_is_not_solid() {
    let mut lines = square();
    let walls: Vec<usize> = (0..lines.len())
        .filter(|&at| lines[at].contains(" T") && lines[at].contains('E'))
        .collect();
    for at in walls.into_iter().step_by(4) {
        let text = lines[at].clone();
        lines[at] = text.split(' ').filter(|w| !w.starts_with('E')).collect::<Vec<_>>().join(" ");
    }
    let verdict = judged(&lines, &printer());
    assert_eq!(verdict.findings.len(), 1);
    assert_eq!(verdict.findings[0].check, "volume");
}

#[test]
fn no_line_of_a_wall_can_be_changed_unseen() {
    let sound = square();
    let walls = (0..sound.len()).filter(|&at| sound[at].starts_with("G1 R"));
    let changes: [Change; 6] = [
        ('R', |r| r + 0.2),
        ('R', |r| r - 0.2),
        ('T', |t| t + 6.0),
        ('T', |t| t - 360.0),
        ('E', |e| e * 40.0),
        ('E', |e| -e),
    ];
    for at in walls.skip(2).step_by(7) {
        for (letter, change) in changes {
            let mut lines = sound.clone();
            word(&mut lines, at, letter, change);
            let verdict = judged(&lines, &printer());
            assert!(verdict.worst().is_some(), "{} is now {}", sound[at], lines[at]);
        }
    }
}

#[test]
fn messages_say_what_where_measured_and_limit() {
    let mut lines = square();
    replace(&mut lines, "R19.775", "R131.2");
    let verdict = judged(&lines, &printer());
    let message = &verdict.findings.iter().find(|f| f.check == "reach").unwrap().message;
    assert_eq!(
        message,
        "the carriage at 131.200 mm, the rail reaches from 0 to 120 mm \
         (line 11, x 131.200 y 0.000 z 20.000)"
    );
}
