//! `rhumb steps`: the pulses of a whole print lead every motor to where the text wants it.

use std::collections::BTreeMap;

use crate::run::{Scratch, model};

/// A file of pulses, read by the words of its format.
struct Pulses {
    /// What a pulse moves, and where the motor stands at first, by axis.
    axes: Vec<(String, f64, i64)>,
    /// The line of the program, when the interval begins, how long it takes, and the pulses.
    rows: Vec<(usize, f64, f64, Vec<i64>)>,
}

fn read(text: &str) -> Pulses {
    let mut pulses = Pulses { axes: Vec::new(), rows: Vec::new() };
    for line in text.lines() {
        if let Some(axis) = line.strip_prefix("# axis ") {
            let words: Vec<&str> = axis.split_whitespace().collect();
            let name = words[0].trim_end_matches(':').to_owned();
            pulses.axes.push((name, words[1].parse().unwrap(), words[7].parse().unwrap()));
        } else if line.starts_with(|c: char| c.is_ascii_digit()) {
            let words: Vec<&str> = line.split(',').collect();
            let counts = words[3..].iter().map(|n| n.parse().unwrap()).collect();
            let time = |k: usize| words[k].parse().unwrap();
            pulses.rows.push((words[0].parse().unwrap(), time(1), time(2), counts));
        }
    }
    pulses
}

/// Where a program in words R, T, Z and E wants its axes at the end of each line that names one.
fn wanted(program: &str) -> BTreeMap<usize, [f64; 4]> {
    let mut at = [120.0, 0.0, 0.0, 0.0];
    let mut wanted = BTreeMap::new();
    for (number, line) in program.lines().enumerate() {
        let Some(words) = line.strip_prefix("G1 ") else { continue };
        for word in words.split(';').next().unwrap().split_whitespace() {
            let value: f64 = word[1..].parse().unwrap();
            match &word[..1] {
                "R" => at[0] = value,
                "T" => at[1] = value,
                "Z" => at[2] = value,
                "E" => at[3] += value,
                _ => {}
            }
        }
        wanted.insert(number + 1, at);
    }
    wanted
}

#[test]
fn no_motor_is_ever_off_by_more_than_half_a_step() {
    let scratch = Scratch::new();
    for (name, layers) in [("gear", "--layers=planar"), ("dome", "--layers=conical")] {
        let file = model(name);
        let slice = ["slice", file.to_str().unwrap(), "-q", "-o", "a.gcode", layers];
        scratch.run(&slice).expect(0);
        scratch.run(&["steps", "a.gcode", "-o", "a.csv", "--picture", "a.svg"]).expect(0);
        let program = std::fs::read_to_string(scratch.path("a.gcode")).unwrap();
        let pulses = read(&std::fs::read_to_string(scratch.path("a.csv")).unwrap());
        let names: Vec<&str> = pulses.axes.iter().map(|axis| axis.0.as_str()).collect();
        assert_eq!(names, ["R", "theta", "Z", "E"]);
        let wanted = wanted(&program);
        let mut counts: Vec<i64> = pulses.axes.iter().map(|axis| axis.2).collect();
        let (mut worst, mut turned, mut clock) = ([0.0_f64; 4], 0.0_f64, 0.0);
        for (line, start, duration, row) in &pulses.rows {
            for axis in 0..4 {
                counts[axis] += row[axis];
                let step = pulses.axes[axis].1;
                // What pulses forwards and backwards have summed up to is where the motor is.
                let off = (counts[axis] as f64 * step - wanted[line][axis]).abs() / step;
                worst[axis] = worst[axis].max(off);
            }
            turned += pulses.axes[1].1 * row[1].abs() as f64;
            assert!((start - clock).abs() < 1e-4, "line {line} begins at {start}, not {clock}");
            clock = start + duration;
        }
        assert!(worst.iter().all(|off| *off <= 0.5 + 1e-6), "{name}: {worst:?}");
        assert!(worst[0] > 0.4 && worst[1] > 0.4, "{name}: {worst:?}");
        assert!(turned > 40.0 * 360.0, "{name} turns the bed by {turned}° only");
        assert!(pulses.rows.len() > 5000, "{}", pulses.rows.len());
        assert!(std::fs::read_to_string(scratch.path("a.svg")).unwrap().starts_with("<svg"));
    }
}

#[test]
fn forty_turns_and_back_are_closed() {
    let scratch = Scratch::new();
    let mut program = String::from("G28\nG90\nM83\nG1 R50 T0 Z0.2 F6000\n");
    // Pieces of 7.3137° are no whole number of steps.
    let (pieces, piece) = (1969_u32, 7.3137);
    for k in (1..=pieces).chain((0..pieces).rev()) {
        program += &format!("G1 R50 T{:.4} E0.01\n", f64::from(k) * piece);
    }
    scratch.file("a.gcode", &program);
    scratch.run(&["steps", "a.gcode", "-o", "a.csv"]).expect(0);
    let pulses = read(&std::fs::read_to_string(scratch.path("a.csv")).unwrap());
    let bed: Vec<i64> = pulses.rows.iter().map(|row| row.3[1]).collect();
    let there: i64 = bed[..=pieces as usize].iter().sum();
    assert_eq!(there, (f64::from(pieces) * piece / pulses.axes[1].1).round() as i64);
    assert_eq!(bed.iter().sum::<i64>(), 0);
}

#[test]
fn all_formats_say_the_same() {
    let scratch = Scratch::new();
    let file = model("cube");
    scratch.run(&["slice", file.to_str().unwrap(), "-q", "-o", "a.gcode"]).expect(0);
    // Half steps of motors without gears, as the port has them.
    let coarse = ["rail", "bed", "z", "extruder"].map(|axis| format!("{axis}_microsteps=2"));
    let mut set = Vec::new();
    coarse.iter().for_each(|value| set.extend(["--set", value]));
    let steps = |name: &str| {
        scratch.run(&[&["steps", "a.gcode", "--json", "-o", name], &set[..]].concat()).expect(0)
    };
    let said: serde_json::Value = serde_json::from_str(&steps("a.csv").out).unwrap();
    steps("a.bin");
    steps("a.lpt");
    let csv = read(&std::fs::read_to_string(scratch.path("a.csv")).unwrap());
    let bytes = std::fs::read(scratch.path("a.bin")).unwrap();
    let binary = twin::steps::binary::decode(&bytes).unwrap();
    assert_eq!(binary.axes, csv.axes);
    let rows = csv.rows.iter().map(|row| &row.3);
    assert!(rows.eq(binary.intervals.iter().map(|interval| &interval.1)));
    assert!(bytes.len() < 12 * csv.rows.len(), "{} bytes", bytes.len());
    let time: f64 = binary.intervals.iter().map(|interval| interval.0).sum();
    assert!((time - said["time_s"].as_f64().unwrap()).abs() < 1e-5);
    // Every pulse is a word, and every motor has one more at the start.
    let pulses: u64 = csv.rows.iter().flat_map(|row| &row.3).map(|n| n.unsigned_abs()).sum();
    let words = std::fs::read_to_string(scratch.path("a.lpt")).unwrap();
    assert_eq!(words.lines().skip(3).count() as u64, pulses + 4);
    let told = said["axes"].as_array().unwrap().iter();
    assert_eq!(told.map(|axis| axis["pulses"].as_u64().unwrap()).sum::<u64>(), pulses);
    for axis in said["axes"].as_array().unwrap() {
        assert!(axis["worst_error_steps"].as_f64().unwrap() <= 0.5 + 1e-9, "{axis}");
        assert!(axis["peak_rate_hz"].as_f64().unwrap() > 0.0, "{axis}");
    }
    // Standard output is CSV and nothing else.
    let out = scratch.run(&[&["steps", "a.gcode", "-o", "-"], &set[..]].concat()).expect(0).out;
    assert_eq!(out, std::fs::read_to_string(scratch.path("a.csv")).unwrap());
}

#[test]
fn the_sources_example_and_tables_of_points() {
    let scratch = Scratch::new();
    let out = scratch.run(&["steps", "--example", "-o", "-"]).expect(0).out;
    let example = read(&out);
    assert_eq!(example.axes[0], ("X".to_owned(), 1.6, 0));
    assert_eq!(example.rows[0].3, [6, 0, 0]);
    scratch.file("t.csv", "t_s,x_mm,y_mm,z_mm\n0,0,0,0\n0.5,1,-2,0.02\n");
    let out = scratch.run(&["steps", "t.csv", "-o", "-"]).expect(0).out;
    assert_eq!(read(&out).rows, [(3, 0.0, 0.5, vec![80, -160, 8])]);
    for sequence in ["full", "half"] {
        let arguments = ["steps", "--example", "--sequence", sequence, "-o", "e.lpt"];
        scratch.run(&arguments).expect(0);
        let words = std::fs::read_to_string(scratch.path("e.lpt")).unwrap();
        assert!(words.contains(&format!("{sequence} steps")), "{words}");
    }
}

#[test]
fn what_has_no_steps_is_refused() {
    let scratch = Scratch::new();
    scratch.file("a.gcode", "G28\nG90\nM83\nG1 X10 Y10 F600\n; dialect = cartesian\n");
    scratch.file("t.csv", "x,y\n");
    scratch.run(&["steps", "a.gcode"]).refused("Usage", 2);
    scratch.run(&["steps", "a.gcode", "-o", "a.txt"]).refused("Usage", 2);
    scratch.run(&["steps", "t.csv"]).refused("LogSyntax", 4);
    scratch.run(&["steps", "absent.gcode"]).refused("NotFound", 3);
    scratch.run(&["steps", "--example", "--picture", "p.svg"]).refused("Usage", 2);
    let set = ["steps", "--example", "--set", "rail_transmission=rope"];
    scratch.run(&set).refused("ConfigRange", 6);
    assert_eq!(scratch.names(), ["a.gcode", "t.csv"]);
}
