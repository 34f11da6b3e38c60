//! `rhumb curve` against the equations of its source, and `rhumb completions`.

use std::f64::consts::PI;

use crate::run::Scratch;

fn numbers(text: &str, separator: char) -> Vec<Vec<f64>> {
    text.lines().map(|line| line.split(separator).map(|n| n.parse().unwrap()).collect()).collect()
}

/// The listing behind eq. 2.4, step by step as it runs.
fn listing(radius: f64, turns: f64, step: f64, leaning: f64) -> Vec<[f64; 3]> {
    let (v, g) = (PI / radius / 2.0, PI / radius * turns * step);
    let (s, c) = leaning.sin_cos();
    let (mut i, mut total, mut lines) = (-radius, 0.0_f64, Vec::new());
    while i <= radius + 1e-9 {
        let (x, y) = (radius * (i * v).cos(), radius * (i * v).sin());
        let [p0, p1, p2] = [x * total.cos(), y, x * total.sin()];
        let [q0, q1, q2] = [p0, p1 * c - p2 * s, p2 * c + p1 * s];
        lines.push([q2, q1, q0]);
        total += g;
        i += step;
    }
    lines
}

#[test]
fn the_listing_is_reproduced_to_the_third_decimal() {
    let scratch = Scratch::new();
    for (arguments, radius, turns, step, leaning) in [
        (&["--radius", "70", "--turns", "17", "--step", "0.25"][..], 70.0, 17.0, 0.25, 0.0_f64),
        (&[], 70.0, 17.0, 0.25, 0.0),
        (
            &["--leaning", "30", "--radius", "20", "--turns", "9.5", "--step", "0.1"],
            20.0,
            9.5,
            0.1,
            30.0,
        ),
        (
            &["--leaning=-75", "--radius", "33", "--turns", "4", "--step", "0.7"],
            33.0,
            4.0,
            0.7,
            -75.0,
        ),
    ] {
        let mut all = vec!["curve", "archimedes", "-o", "line.sldcrv"];
        all.extend(arguments);
        scratch.run(&all).expect(0);
        let text = std::fs::read_to_string(scratch.path("line.sldcrv")).unwrap();
        let expected = listing(radius, turns, step, leaning.to_radians());
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), expected.len(), "{all:?}");
        for (line, expected) in lines.iter().zip(&expected) {
            let found: Vec<f64> = line.split(' ').map(|n| n.parse().unwrap()).collect();
            assert_eq!(found.len(), 3, "{line}");
            for (found, expected) in found.iter().zip(expected) {
                // Half of the last decimal, and what sums of floats drift.
                assert!((found - expected).abs() <= 0.000_501, "{line}: {expected:?}");
            }
            assert!(
                line.split(' ')
                    .all(|n| n.split_once('.').is_some_and(|(_, d)| !d.is_empty() && d.len() <= 3))
            );
        }
    }
    // Its usual name.
    scratch.run(&["curve", "archimedes", "-q"]).expect(0);
    assert!(scratch.names().contains(&"line-70-17.sldcrv".to_owned()));
}

#[test]
fn turns_follow_from_the_width_of_a_bead_and_the_example_is_called_wrong() {
    let scratch = Scratch::new();
    let wanted = ["curve", "archimedes", "--radius", "20", "--bead-width", "0.2", "-o", "c.csv"];
    let words = scratch.run(&wanted).expect(0).out;
    assert!(words.contains("314.16") && words.contains("0.628"), "{words}");
    let json = scratch.run(&[&wanted[..], &["--json"]].concat()).expect(0).out;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!((json["turns"].as_f64().unwrap() - 314.159_265).abs() < 1e-5);
    assert!((json["spacing_mm"]["most"].as_f64().unwrap() - 0.2).abs() < 1e-12);
    let text = std::fs::read_to_string(scratch.path("c.csv")).unwrap();
    let (head, rows) = text.split_once('\n').unwrap();
    assert_eq!(head, "x_mm,y_mm,z_mm,length_mm,turn,latitude_deg,spacing_mm");
    let rows = numbers(rows, ',');
    // The area of the sphere over the distance of the turns is about the length of the curve.
    let length = rows.last().unwrap()[3];
    assert!((length * 0.2 / (4.0 * PI * 400.0) - 1.0).abs() < 1e-4, "{length}");
    assert!((json["length_mm"].as_f64().unwrap() - length).abs() < 1e-5);
    for row in &rows {
        let [x, y, z] = row[..3] else { panic!("{row:?}") };
        assert!((x.hypot(y).hypot(z) - 20.0).abs() < 2e-6, "{row:?}");
        assert!((z - 20.0 * (row[4] / 314.159_265_359 - 0.5).mul_add(PI, 0.0).sin()).abs() < 1e-4);
    }
}

#[test]
fn a_loxodrome_crosses_all_meridians_alike_and_its_turns_come_closer() {
    let scratch = Scratch::new();
    let wanted = [
        "curve",
        "loxodrome",
        "--radius",
        "20",
        "--slope",
        "0.05",
        "--turns",
        "12",
        "--meridian",
        "30",
        "-o",
        "l.csv",
        "--json",
    ];
    let json: serde_json::Value =
        serde_json::from_str(&scratch.run(&wanted).expect(0).out).unwrap();
    let text = std::fs::read_to_string(scratch.path("l.csv")).unwrap();
    let rows = numbers(text.split_once('\n').unwrap().1, ',');
    assert_eq!(rows.len(), 12 * 72 + 1);
    let start = (30.0_f64 - 12.0 * 180.0).to_radians();
    for (k, row) in rows.iter().enumerate() {
        // Eq. 2.2, every five degrees.
        let lambda = start + k as f64 * PI / 36.0;
        assert!((row[4] - k as f64 / 72.0).abs() < 1e-6);
        let climb = 0.05 * (lambda - 30.0_f64.to_radians());
        let expected = [
            20.0 * lambda.cos() / climb.cosh(),
            20.0 * lambda.sin() / climb.cosh(),
            20.0 * climb.tanh(),
        ];
        for (found, expected) in row.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-5, "{row:?}");
        }
        // The same place a turn later, along the meridian.
        let latitude = |climb: f64| climb.sinh().atan();
        let apart = 20.0 * (latitude(climb + 0.1 * PI) - latitude(climb));
        assert!((row[6] - apart).abs() < 2e-6, "{row:?}");
    }
    let [least, most] = ["least", "most"].map(|key| json["spacing_mm"][key].as_f64().unwrap());
    assert!(least < most / 2.5 && most < 20.0 * 0.1 * PI, "{json}");
    let end = rows.last().unwrap();
    assert!((end[5] - (0.05 * 12.0 * PI).sinh().atan().to_degrees()).abs() < 1e-5);

    let wide =
        ["curve", "loxodrome", "--bead-width", "2", "--radius", "20", "-o", "w.csv", "--json"];
    let json: serde_json::Value = serde_json::from_str(&scratch.run(&wide).expect(0).out).unwrap();
    assert!((json["spacing_mm"]["most"].as_f64().unwrap() - 2.0).abs() < 1e-9, "{json}");
}

#[test]
fn curves_are_drawn_and_nonsense_is_refused() {
    let scratch = Scratch::new();
    for kind in ["archimedes", "loxodrome"] {
        scratch.run(&["curve", kind, "-o", "c.svg"]).expect(0);
        let picture = std::fs::read_to_string(scratch.path("c.svg")).unwrap();
        assert!(picture.starts_with("<svg") && picture.contains("17 turns"), "{kind}");
        assert!(scratch.run(&["curve", kind, "-o", "-"]).expect(0).out.lines().count() > 500);
        for wrong in [&["--radius", "0"][..], &["--turns", "nan"], &["--step=-1"], &["-o", "c.png"]]
        {
            scratch.run(&[&["curve", kind], wrong].concat()).refused("Usage", 2);
        }
        let endless = ["curve", kind, "--step", "1e-9"];
        scratch.run(&endless).refused("LimitExceeded", 8);
    }
    scratch.run(&["curve", "loxodrome", "--slope", "0"]).refused("Usage", 2);
}

#[test]
fn shells_complete_every_command() {
    let scratch = Scratch::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = scratch.run(&["completions", shell]).expect(0).out;
        for word in
            ["slice", "convert", "calibrate", "curve", "archimedes", "completions", "layers"]
        {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    assert_eq!(scratch.run(&["completions", "tcsh"]).code, Some(2));
}
