//! `--arcs`: runs of short lines on a circle as `G2` and `G3`.

use std::f64::consts::PI;

use crate::run::{Scratch, model};

/// A tube as OBJ: radii and height in mm, so many sides that its outline is a circle to 2 µm.
fn tube(outer: f64, inner: f64, height: f64) -> String {
    let n = 240;
    let mut text = String::new();
    for (radius, z) in [(outer, 0.0), (outer, height), (inner, 0.0), (inner, height)] {
        for k in 0..n {
            let angle = 2.0 * PI * f64::from(k) / f64::from(n);
            text += &format!("v {:.6} {:.6} {z}\n", radius * angle.cos(), radius * angle.sin());
        }
    }
    for k in 0..n {
        let next = (k + 1) % n;
        let [a, b] = [k + 1, next + 1];
        let ring = |r: i32, c: i32| c + r * n;
        text += &format!("f {} {} {} {}\n", ring(0, a), ring(0, b), ring(1, b), ring(1, a));
        text += &format!("f {} {} {} {}\n", ring(2, b), ring(2, a), ring(3, a), ring(3, b));
        text += &format!("f {} {} {} {}\n", ring(0, b), ring(0, a), ring(2, a), ring(2, b));
        text += &format!("f {} {} {} {}\n", ring(1, a), ring(1, b), ring(3, b), ring(3, a));
    }
    text
}

fn word(line: &str, letter: char) -> Option<f64> {
    line.split(' ').skip(1).find_map(|word| word.strip_prefix(letter)?.parse().ok())
}

/// Filament that is fed, and drawn back, in a program.
fn fed(program: &str) -> f64 {
    let moves = program.lines().filter(|l| ["G1 ", "G2 ", "G3 "].iter().any(|g| l.starts_with(g)));
    moves.filter_map(|line| word(line, 'E')).sum()
}

#[test]
fn a_tube_is_printed_in_arcs_that_follow_its_circles_with_the_same_filament() {
    let scratch = Scratch::new();
    scratch.file("tube.obj", tube(14.0, 9.0, 3.0));
    let slice = |more: &[&str]| {
        let all = ["slice", "tube.obj", "-q", "-o", "p.gcode", "--dialect", "cartesian"];
        scratch.run(&[&all, more].concat()).expect(0);
        std::fs::read_to_string(scratch.path("p.gcode")).unwrap()
    };
    let lines = slice(&[]);
    let arcs = slice(&["--arcs", "--place", "31,-7"]);
    let lines_there = slice(&["--place", "31,-7"]);
    assert!(!lines.contains("\nG2 ") && !lines.contains("\nG3 "));
    let motions = |text: &str| text.lines().filter(|line| line.starts_with('G')).count();
    assert!(2 * motions(&arcs) < motions(&lines_there), "{} arcs", motions(&arcs));
    assert!((fed(&arcs) / fed(&lines_there) - 1.0).abs() < 1e-5);
    // Every wall is a circle about the middle of the tube, and ends where its words say.
    let (mut at, mut role, mut walls) = ([f64::NAN; 2], "", 0);
    for line in arcs.lines() {
        role = line.strip_prefix(";TYPE:").unwrap_or(role);
        let from = at;
        at = [word(line, 'X').unwrap_or(at[0]), word(line, 'Y').unwrap_or(at[1])];
        if !line.starts_with("G2 ") && !line.starts_with("G3 ") {
            continue;
        }
        let [i, j] = ['I', 'J'].map(|letter| word(line, letter).unwrap());
        let centre = [from[0] + i, from[1] + j];
        let off = (at[0] - centre[0]).hypot(at[1] - centre[1]) - i.hypot(j);
        assert!(off.abs() < 0.003, "{line}: {off}");
        if role == "External perimeter" {
            walls += 1;
            // Half-way along it, too, it lies on the outer or the inner wall.
            let [a, b] = [from, at].map(|p| (p[1] - centre[1]).atan2(p[0] - centre[0]));
            let turn = (b - a).rem_euclid(2.0 * PI);
            let turn = if line.starts_with("G2") { turn - 2.0 * PI } else { turn };
            let (sin, cos) = (a + turn / 2.0).sin_cos();
            let radius = i.hypot(j);
            let middle = [centre[0] + radius * cos - 31.0, centre[1] + radius * sin + 7.0];
            let out = middle[0].hypot(middle[1]);
            let near = [14.0 - 0.225, 9.0 + 0.225].map(|r| (out - r).abs());
            assert!(near[0].min(near[1]) < 0.02, "{line}: {out}");
        }
    }
    assert!(walls >= 2 * 15, "{walls}");
    // The twin draws the arcs; the converter makes a program of another machine of them.
    scratch.file("a.gcode", &arcs);
    let found = |name: &str| {
        let said = scratch.run(&["verify", name]).out;
        said.lines().filter(|line| !line.contains("mid-air")).map(str::to_owned).collect::<Vec<_>>()
    };
    let about = |lines: &[String]| {
        let notes = |line: &&String| line.contains(": ") && !line.starts_with("note");
        lines.iter().filter(notes).count()
    };
    let (straight, drawn) = (found("p.gcode"), found("a.gcode"));
    assert_eq!(about(&straight), about(&drawn), "{straight:?} {drawn:?}");
    let picture = ["preview", "a.gcode", "-o", "a.svg", "--layer", "3"];
    scratch.run(&picture).expect(0);
    let convert = ["convert", "a.gcode", "-o", "b.gcode", "--printer", "generic-polar"];
    scratch.run(&convert).expect(0);
    let again = std::fs::read_to_string(scratch.path("b.gcode")).unwrap();
    assert!((fed(&again) / fed(&arcs) - 1.0).abs() < 1e-4, "{} {}", fed(&again), fed(&arcs));
}

#[test]
fn what_is_no_circle_stays_straight_and_polar_words_need_no_arcs() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 10.0);
    let straight = ["slice", "cube.stl", "-q", "-o", "-", "--dialect", "cartesian"];
    let without = scratch.run(&straight).expect(0).out;
    let with = scratch.run(&[&straight[..], &["--arcs"]].concat()).expect(0).out;
    let mut role = "";
    for line in with.lines() {
        role = line.strip_prefix(";TYPE:").unwrap_or(role);
        let is_arc = line.starts_with("G2 ") || line.starts_with("G3 ");
        assert!(!(is_arc && role.ends_with("erimeter")), "{line} in a {role}");
    }
    let gear = model("gear");
    for dialect in ["polar", "klipper-polar"] {
        let all = ["slice", gear.to_str().unwrap(), "--arcs", "--dialect", dialect];
        scratch.run(&all).refused("ConfigConflict", 6);
    }
    // An arc that does not end on its circle is found.
    let (head, layer) = without.split_once(";TYPE:External perimeter\n").unwrap();
    let bent = layer.replacen(" Y", " I5 J0 Y", 2).replacen("G1 X", "G3 X", 2);
    let program = format!("{head};TYPE:External perimeter\n{bent}");
    scratch.file("bad.gcode", program);
    let found = scratch.run(&["verify", "bad.gcode"]);
    assert!(found.out.contains("off its circle"), "{}", found.out);
}
