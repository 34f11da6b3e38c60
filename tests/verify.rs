//! `rhumb verify` on real programs: sound ones are sound, and damage is found by the check that
//! watches over it.

use crate::run::{Scratch, model};

/// A sliced model, ready to be damaged.
struct Printed {
    scratch: Scratch,
    lines: Vec<String>,
}

/// What `verify --json` says.
struct Verdict {
    code: Option<i32>,
    checks: Vec<String>,
    all: serde_json::Value,
}

impl Printed {
    fn new(name: &str, arguments: &[&str]) -> Self {
        let scratch = Scratch::new();
        let file = model(name);
        let mut all = vec!["slice", file.to_str().unwrap(), "-q", "--no-verify"];
        all.extend(["-o", "made.gcode", "--export-placed", "placed.stl"]);
        all.extend(arguments);
        scratch.run(&all).expect(0);
        let text = std::fs::read_to_string(scratch.path("made.gcode")).unwrap();
        Self { scratch, lines: text.lines().map(str::to_owned).collect() }
    }

    fn judged(&self, lines: &[String], arguments: &[&str]) -> Verdict {
        self.scratch.file("judged.gcode", lines.join("\n") + "\n");
        let mut all = vec!["verify", "judged.gcode", "--model", "placed.stl", "--json"];
        all.extend(arguments);
        let ran = self.scratch.run(&all);
        let all: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
        let findings = all["verify"]["findings"].as_array().unwrap();
        let mut checks: Vec<String> =
            findings.iter().map(|found| found["check"].as_str().unwrap().to_owned()).collect();
        checks.dedup();
        Verdict { code: ran.code, checks, all }
    }

    fn sound(&self) -> Verdict {
        self.judged(&self.lines, &[])
    }
}

#[test]
fn programs_of_models_without_overhang_are_sound_planar_and_conical() {
    for name in ["cone", "cube", "dome", "gear", "lens", "vase"] {
        for layers in ["--layers=planar", "--layers=conical"] {
            let verdict = Printed::new(name, &[layers]).sound();
            let findings = &verdict.all["verify"];
            assert_eq!(verdict.code, Some(0), "{name} {layers}: {findings}");
            let support = &verdict.all["support"];
            assert_eq!(support["hanging_mm"], 0.0, "{name} {layers}: {support}");
            let residual = verdict.all["surface_residual_mm"].as_f64().unwrap();
            assert!(residual < 0.010, "{name} {layers}: {residual}");
        }
    }
}

#[test]
fn the_mushroom_hangs_in_planes_and_is_carried_on_cones() {
    let planar = Printed::new("mushroom", &[]).sound();
    assert_eq!((planar.code, &*planar.checks), (Some(1), &["support".to_owned()][..]));
    assert!(planar.all["support"]["hanging_mm"].as_f64().unwrap() > 4000.0);
    assert!(planar.all["support"]["mid_air_beads"].as_u64().unwrap() > 0);
    for angle in ["--cone-angle=40", "--cone-angle=45"] {
        let conical = Printed::new("mushroom", &["--layers=conical", angle]).sound();
        let support = &conical.all["support"];
        assert_eq!((&support["hanging_mm"], &support["hanging_beads"]), (&0.0.into(), &0.into()));
        assert!(!conical.checks.iter().any(|check| check == "support"), "{:?}", conical.checks);
    }
}

#[test]
fn a_cone_too_steep_for_the_hot_end_is_told() {
    let steep = Printed::new("mushroom", &["--layers=conical", "--cone-angle=45"]);
    // The rim of a face of 1 mm lies 0.5 mm uphill, where the layer below is 0.22 mm above the tip;
    // that of the face of 0.6 mm that the printer has by default is clear of it.
    let first = |arguments: &[&str]| {
        let verdict = steep.judged(&steep.lines, arguments);
        let findings = verdict.all["verify"]["findings"].as_array().unwrap().clone();
        findings.iter().find(|found| found["check"] == "clearance").map(|f| f["line"].clone())
    };
    let blunt = first(&["--set", "nozzle_flat_radius_mm=0.5"]).unwrap().as_u64().unwrap();
    let slender = first(&[]);
    assert!(slender.is_none_or(|line| line.as_u64().unwrap() > 10 * blunt));
}

/// A kind of damage: the check that must find it, and what is done to the lines of a program.
type Damage = (&'static str, fn(&mut Vec<String>));

/// Lines that lay material on the outermost wall in the upper half of the program.
fn walls(lines: &[String]) -> Vec<usize> {
    let mut is_wall = false;
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        if let Some(role) = line.strip_prefix(";TYPE:") {
            is_wall = role == "External perimeter";
        }
        if is_wall && line.starts_with("G1 R") && line.contains(" E") && at > lines.len() / 2 {
            found.push(at);
        }
    }
    found
}

fn middle_wall(lines: &[String]) -> usize {
    let walls = walls(lines);
    walls[walls.len() / 2]
}

/// Changes the number of a word of a line.
fn word(line: &mut String, letter: char, change: impl Fn(f64) -> f64) {
    let words: Vec<String> = line
        .split(' ')
        .map(|word| match word.strip_prefix(letter).and_then(|number| number.parse().ok()) {
            Some(value) => {
                format!("{letter}{}", (change(value) * 1e5).round() / 1e5)
            }
            None => word.to_owned(),
        })
        .collect();
    *line = words.join(" ");
}

const DAMAGES: [Damage; 9] = [
    ("flow", |lines| {
        let at = middle_wall(lines);
        lines.remove(at);
    }),
    ("flow", |lines| {
        let at = middle_wall(lines);
        lines.swap(at, at + 2);
    }),
    ("surface", |lines| {
        // All of one layer 50 µm too high.
        let starts: Vec<usize> =
            (0..lines.len()).filter(|&at| lines[at] == ";LAYER_CHANGE").collect();
        let middle = starts.len() / 2;
        let mut height = String::new();
        for line in &mut lines[starts[middle]..starts[middle + 1]] {
            if let Some(top) = line.strip_prefix(";Z:") {
                height = format!("Z{top}");
            }
            if line.split(' ').any(|word| word == height) {
                word(line, 'Z', |z| z + 0.05);
            }
        }
    }),
    ("speed", |lines| {
        let at = middle_wall(lines);
        let without: Vec<&str> = lines[at].split(' ').filter(|w| !w.starts_with('F')).collect();
        lines[at] = without.join(" ") + " F60000";
    }),
    ("continuity", |lines| {
        let at = lines.iter().position(|line| line.starts_with("G1 E-")).unwrap();
        lines.remove(at);
    }),
    ("continuity", |lines| {
        let at = middle_wall(lines);
        word(&mut lines[at], 'T', |turn| turn - 360.0);
    }),
    ("flow", |lines| {
        let mut is_wall = false;
        for line in lines.iter_mut() {
            if let Some(role) = line.strip_prefix(";TYPE:") {
                is_wall = role == "External perimeter";
            }
            if is_wall && line.starts_with("G1 R") {
                word(line, 'E', |filament| filament * 1.05);
            }
        }
    }),
    ("surface", |lines| {
        let at = middle_wall(lines);
        lines[at].push_str(" Z0.5");
    }),
    ("volume", |lines| {
        let is_wall = |line: &String| line.starts_with("G1 R") && line.contains(" E");
        for line in lines.iter_mut().filter(|line| is_wall(line)) {
            word(line, 'E', |filament| filament * 1.05);
        }
    }),
];

#[test]
fn every_damage_is_found_by_its_check() {
    let printed = Printed::new("cube", &["--set", "fill_density=1"]);
    assert_eq!(printed.sound().code, Some(0));
    for (number, (check, damage)) in DAMAGES.iter().enumerate() {
        let mut lines = printed.lines.clone();
        damage(&mut lines);
        assert!(lines != printed.lines, "damage {number} changes nothing");
        let verdict = printed.judged(&lines, &[]);
        assert!(
            verdict.checks.iter().any(|found| found == check),
            "damage {number} is not found by {check}: {:?}",
            verdict.checks
        );
        assert_eq!(verdict.code, Some(1));
    }
}

/// The upper half is missing, and so is the line that says how much filament all of it takes.
#[test]
fn half_a_print_is_found_whatever_its_text_says() {
    let printed = Printed::new("cube", &[]);
    let starts: Vec<usize> =
        (0..printed.lines.len()).filter(|&at| printed.lines[at] == ";LAYER_CHANGE").collect();
    let laid = |line: &String| line.starts_with("G1") && line.contains(" E");
    let end = printed.lines.iter().rposition(laid).unwrap() + 1;
    let mut lines = printed.lines[..starts[starts.len() / 2]].to_vec();
    lines.extend_from_slice(&printed.lines[end..]);
    lines.retain(|line| !line.contains("filament used"));
    let verdict = printed.judged(&lines, &[]);
    assert!(verdict.checks.iter().any(|found| found == "height"), "{:?}", verdict.checks);
    assert_eq!(verdict.code, Some(1));
}

/// What a download leaves that went wrong.
#[test]
fn a_program_of_nothing_proves_nothing() {
    let scratch = Scratch::new();
    scratch.file("empty.gcode", "");
    scratch.file("blank.gcode", "\n\n");
    scratch.cube("cube.stl", 5.0);
    for command in [
        &["verify", "empty.gcode"][..],
        &["steps", "empty.gcode", "-o", "x.csv"],
        &["preview", "empty.gcode", "-o", "x.svg"],
    ] {
        scratch.run(command).refused("EmptyFile", 4);
    }
    let ran = scratch.run(&["verify", "blank.gcode", "--model", "cube.stl"]).expect(1);
    assert!(ran.out.starts_with("height: "), "{}", ran.out);
}

#[test]
fn holes_and_lines_laid_twice_are_found() {
    let printed = Printed::new("cube", &["--set", "fill_density=1"]);
    let starts: Vec<usize> =
        (0..printed.lines.len()).filter(|&at| printed.lines[at] == ";LAYER_CHANGE").collect();
    let layer = starts[30]..starts[31];
    // The fill of one layer is left out.
    let mut lines = printed.lines.clone();
    let mut is_fill = false;
    for line in &mut lines[layer.clone()] {
        if let Some(role) = line.strip_prefix(";TYPE:") {
            is_fill = role.ends_with("infill");
        }
        if is_fill && line.starts_with("G1 R") && line.contains(" E") {
            *line =
                line.split(' ').filter(|word| !word.starts_with('E')).collect::<Vec<_>>().join(" ");
        }
    }
    let verdict = printed.judged(&lines, &[]);
    assert!(verdict.checks.iter().any(|found| found == "coverage"), "{:?}", verdict.checks);
    // A layer is laid once more; its own text again, on the same heights.
    let mut lines = printed.lines.clone();
    let again: Vec<String> = lines[layer.start + 8..layer.end].to_vec();
    lines.splice(layer.end..layer.end, again);
    let verdict = printed.judged(&lines, &[]);
    assert!(verdict.checks.iter().any(|found| found == "overlap"), "{:?}", verdict.checks);
    assert!(verdict.checks.iter().any(|found| found == "volume"), "{:?}", verdict.checks);
}

#[test]
fn a_misaligned_machine_makes_another_part_and_a_calibrated_one_does_not() {
    let printed = Printed::new("cube", &[]);
    printed.scratch.file("off.toml", "[rail]\na_mm = 0.2\nb_mm = 0.3\n");
    let form = |arguments: &[&str], key: &str| {
        printed.judged(&printed.lines, arguments).all["form_error"][key].as_f64().unwrap()
    };
    // No place is farther off than the nozzle is, and a turn mends a part of it.
    let off = 0.2_f64.hypot(0.3);
    let found = form(&["--machine-error", "off.toml"], "greatest_mm");
    assert!((found - off).abs() < 0.01, "{found}");
    let fitted = form(&["--machine-error", "off.toml"], "rms_fitted_mm");
    assert!(fitted > 0.05 && fitted < found, "{fitted}");
    let same = ["--machine-error", "off.toml", "--calibration", "off.toml"];
    assert_eq!(form(&same, "greatest_mm"), 0.0);
}

#[test]
fn slice_proves_as_far_as_it_is_asked() {
    let scratch = Scratch::new();
    let mushroom = model("mushroom");
    let slice = ["slice", mushroom.to_str().unwrap(), "-q", "-o", "a.gcode"];
    scratch.run(&slice).expect(0);
    scratch.run(&[&slice[..], &["--verify", "full"]].concat()).expect(1);
    scratch.run(&[&slice[..], &["--verify", "full", "--no-verify"]].concat()).expect(2);
}
