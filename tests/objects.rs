//! Several models in one program: who is who, so that a print server can leave one out; and what a
//! program says of its own progress.

use crate::run::{Scratch, model};

/// An L of two bars of 10 x 30 mm, as OBJ, which another of its kind fits into when it is turned.
fn ell(scratch: &Scratch, name: &str) {
    let corners = [[0, 0], [30, 0], [30, 10], [10, 10], [10, 30], [0, 30]];
    let mut text = String::new();
    for z in [0, 4] {
        for [x, y] in corners {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    // The bottom, seen from below, the top, and the sides.
    text += "f 1 4 3\nf 1 3 2\nf 1 6 5\nf 1 5 4\nf 7 9 10\nf 7 8 9\nf 7 11 12\nf 7 10 11\n";
    for k in 0..6 {
        let next = (k + 1) % 6;
        text += &format!("f {} {} {} {}\n", k + 1, next + 1, next + 7, k + 7);
    }
    scratch.file(name, text);
}

/// Where lines with X and Y lay material between the begin and the end of an object: both ends of each.
fn laid(program: &str, begin: &str, end: &str) -> Vec<[f64; 2]> {
    let (mut inside, mut at, mut places) = (false, [f64::NAN; 2], Vec::new());
    for line in program.lines() {
        inside |= line == begin;
        inside &= line != end;
        let Some(words) = line.strip_prefix("G1 ") else { continue };
        let word = |letter: char| -> Option<f64> {
            words.split(' ').find_map(|word| word.strip_prefix(letter)?.parse().ok())
        };
        let from = at;
        at = [word('X').unwrap_or(at[0]), word('Y').unwrap_or(at[1])];
        if inside && at != from && word('E').is_some_and(|fed| fed > 0.0) {
            places.extend([from, at]);
        }
    }
    places
}

#[test]
fn lines_of_several_models_are_labelled_as_each_firmware_wants_it() {
    let scratch = Scratch::new();
    scratch.cube("left.stl", 8.0);
    scratch.cube("right.stl", 8.0);
    let both = ["left.stl", "right.stl", "--at=-20,0", "--at=20,0", "-q", "-o", "p.gcode"];
    let said = |dialect: &str| {
        let all = [&["slice"], &both[..], &["--dialect", dialect]].concat();
        scratch.run(&all).expect(0);
        std::fs::read_to_string(scratch.path("p.gcode")).unwrap()
    };
    let klipper = said("klipper-polar");
    for name in ["left_1", "right_2"] {
        let define = format!("EXCLUDE_OBJECT_DEFINE NAME={name} CENTER=");
        let defined = klipper.find(&define).expect(name);
        let (begin, end) = (
            format!("EXCLUDE_OBJECT_START NAME={name}"),
            format!("EXCLUDE_OBJECT_END NAME={name}"),
        );
        let count = |what: &str| klipper.lines().filter(|line| *line == what).count();
        assert_eq!(count(&begin), count(&end));
        assert!(count(&begin) >= 40, "{} layers have it", count(&begin));
        assert!(defined < klipper.find(&begin).unwrap());
        let side = if name == "left_1" { -1.0 } else { 1.0 };
        let places = laid(&klipper, &begin, &end);
        assert!(places.len() > 300);
        for [x, _] in places {
            assert!((x * side - 20.0).abs() < 4.5, "{name}: {x}");
        }
    }
    let marlin = said("marlin-polar");
    assert!(marlin.contains("\nM486 T2\n") && marlin.contains("\nM486 S1\n"));
    assert!(marlin.contains("\nM486 S-1\n"));
    let comments = said("cartesian");
    assert!(comments.contains("\n; printing object left_1 id:0 copy 0\n"));
    assert!(comments.contains("\n; stop printing object right_2 id:1 copy 0\n"));
    // The twin and a second machine read past all of them.
    scratch.run(&["verify", "p.gcode"]).expect(0);
    let again = ["convert", "p.gcode", "-o", "again.gcode", "--printer", "klipper-polar"];
    scratch.run(&again).expect(0);
    let off = [&["slice"], &both[..], &["--set", "gcode_label_objects=disabled"]].concat();
    scratch.run(&off).expect(0);
    let plain = std::fs::read_to_string(scratch.path("p.gcode")).unwrap();
    assert!(!plain.contains("object left") && !plain.contains("M486"));
    // A single model needs no name.
    scratch
        .run(&["slice", "left.stl", "-q", "-o", "one.gcode", "--dialect", "klipper-polar"])
        .expect(0);
    let one = std::fs::read_to_string(scratch.path("one.gcode")).unwrap();
    assert!(!one.contains("EXCLUDE_OBJECT"));
}

#[test]
fn models_that_reach_into_each_other_s_boxes_are_no_overlap_and_keep_apart() {
    let scratch = Scratch::new();
    ell(&scratch, "a.obj");
    let slice = |at: &[&str]| {
        let mut all = vec!["slice", "a.obj", "--copies", "2", "--orient", "keep", "-o", "p.gcode"];
        all.extend(at);
        all.extend(["--dialect", "klipper-polar"]);
        scratch.run(&all).expect(0).out
    };
    // The second stands 12 mm to the right of and above the first: in its arms.
    let nested = slice(&["--at=-6,-6", "--at=6,6"]);
    assert!(!nested.contains("overlap"), "{nested}");
    assert!(nested.contains("2 models, in the pose that was asked for"), "{nested}");
    let program = std::fs::read_to_string(scratch.path("p.gcode")).unwrap();
    let first = laid(&program, "EXCLUDE_OBJECT_START NAME=a_1", "EXCLUDE_OBJECT_END NAME=a_1");
    assert!(!first.is_empty());
    for [x, y] in first {
        // In the frame of the first, whose box has its corner here.
        let (u, v) = (x + 6.0 + 15.0, y + 6.0 + 15.0);
        assert!(u < 10.5 || v < 10.5, "{u} {v} is not of the first");
    }
    let crossed = slice(&["--at=-3,-3", "--at=3,3"]);
    assert!(crossed.contains("overlap"), "{crossed}");
}

#[test]
fn each_model_is_said_to_lie_on_its_own_face() {
    let scratch = Scratch::new();
    scratch.cube("a.stl", 8.0);
    let words = scratch.run(&["slice", "a.stl", "--copies", "2", "-o", "p.gcode"]).expect(0).out;
    assert!(words.contains("2 models, each resting on its largest flat face"), "{words}");
}

#[test]
fn progress_counts_up_to_all_and_minutes_down_to_none() {
    let scratch = Scratch::new();
    let gear = model("gear");
    let all = [
        "slice",
        gear.to_str().unwrap(),
        "-o",
        "p.gcode",
        "--printer",
        "klipper-polar",
        "--json",
        "--set",
        "layer_height_mm=0.3",
        "--set",
        "first_layer_height_mm=0.3",
    ];
    let json: serde_json::Value = serde_json::from_str(&scratch.run(&all).expect(0).out).unwrap();
    let total = json["print"]["time_s"].as_f64().unwrap();
    let program = std::fs::read_to_string(scratch.path("p.gcode")).unwrap();
    let told: Vec<[u64; 2]> = program
        .lines()
        .filter_map(|line| line.strip_prefix("M73 P")?.split_once(" R"))
        .map(|(percent, minutes)| [percent.parse().unwrap(), minutes.parse().unwrap()])
        .collect();
    assert_eq!(told[0], [0, (total / 60.0).round() as u64]);
    assert!(told.windows(2).all(|pair| pair[0][0] <= pair[1][0] && pair[0][1] >= pair[1][1]));
    assert!(told.len() > 50 && told[told.len() - 1][0] >= 95, "{told:?}");
    for [percent, minutes] in &told {
        let left = total / 60.0 * (1.0 - *percent as f64 / 100.0);
        assert!((left - *minutes as f64).abs() < 1.0 + total / 6000.0, "{percent} % {minutes} min");
    }
    // Off where it is not wanted.
    scratch.run(&["slice", gear.to_str().unwrap(), "-q", "-o", "q.gcode"]).expect(0);
    let plain = std::fs::read_to_string(scratch.path("q.gcode")).unwrap();
    assert!(!plain.contains("M73") && !plain.contains("TIME_ELAPSED"));
}

#[test]
fn the_fan_follows_the_time_of_layers() {
    let scratch = Scratch::new();
    scratch.file("wide.stl", mesh::stl::write(&mesh::shapes::block(50.0, 50.0, 2.0)));
    scratch.cube("small.stl", 6.0);
    let fans = |file: &str, more: &[&str]| -> Vec<u32> {
        let mut all = vec!["slice", file, "-q", "-o", "-", "--set", "min_fan_speed=30%"];
        all.extend(more);
        let program = scratch.run(&all).expect(0).out;
        let fan = |line: &str| line.strip_prefix("M106 S").map(|s| s.parse().unwrap());
        program.lines().filter_map(fan).collect()
    };
    // So slow that every layer of the little one counts as short.
    let short = ["--set", "slowdown_below_layer_time_s=60", "--set", "fan_below_layer_time_s=90"];
    assert!(fans("small.stl", &short).contains(&255), "a short layer has all of it");
    let long = ["--set", "fan_below_layer_time_s=15", "--set", "bridge_fan_speed=0"];
    let long = fans("wide.stl", &long);
    assert!(long.iter().all(|fan| (76..=77).contains(fan)) && !long.is_empty(), "{long:?}");
    let between = ["--set", "fan_below_layer_time_s=1000", "--set", "bridge_fan_speed=0"];
    let between = fans("wide.stl", &between);
    assert!(between.iter().all(|fan| (77..255).contains(fan)), "{between:?}");
    let rising = fans("small.stl", &[&short[..], &["--set", "full_fan_speed_layer=6"]].concat());
    assert_eq!(rising[..5], [51, 102, 153, 204, 255], "{rising:?}");
}

#[test]
fn a_program_in_part_coordinates_is_written_beside_any_other() {
    let scratch = Scratch::new();
    scratch.cube("a.stl", 5.0);
    let all = ["slice", "a.stl", "-q", "-o", "p.gcode", "--preview-gcode", "seen.gcode"];
    scratch.run(&all).expect(0);
    scratch.run(&["slice", "a.stl", "-q", "-o", "c.gcode", "--dialect", "cartesian"]).expect(0);
    let read = |name: &str| std::fs::read(scratch.path(name)).unwrap();
    assert!(read("seen.gcode") == read("c.gcode") && read("seen.gcode") != read("p.gcode"));
    let twice = ["slice", "a.stl", "-o", "p.gcode", "--preview-gcode", "p.gcode"];
    scratch.run(&twice).refused("OutputTwice", 7);
}

#[test]
fn models_may_have_walls_and_infill_of_their_own() {
    let scratch = Scratch::new();
    scratch.file("a.stl", mesh::stl::write(&mesh::shapes::block(16.0, 16.0, 6.0)));
    let slice = |more: &[&str]| {
        let mut all =
            vec!["slice", "a.stl", "a.stl", "--at=-20,0", "--at=20,0", "-q", "-o", "p.gcode"];
        all.extend(["--dialect", "klipper-polar", "--set", "fill_density=10%"]);
        all.extend(more);
        scratch.run(&all).expect(0);
        let text = std::fs::read_to_string(scratch.path("p.gcode")).unwrap();
        [1, 2].map(|k| {
            let [begin, end] =
                ["START", "END"].map(|word| format!("EXCLUDE_OBJECT_{word} NAME=a_{k}"));
            (filament(&text, &begin, &end, None), filament(&text, &begin, &end, Some("Perimeter")))
        })
    };
    let [(left, left_walls), (right, right_walls)] = slice(&[]);
    assert!((left / right - 1.0).abs() < 0.02, "{left} {right}");
    let own = ["--object", "2:fill_density=60%", "--object", "2:perimeters=4"];
    let [(same, same_walls), (full, more_walls)] = slice(&own);
    assert!((same / left - 1.0).abs() < 0.01 && (same_walls / left_walls - 1.0).abs() < 0.01);
    assert!(full > 1.3 * right && more_walls > 2.5 * right_walls, "{full} {right}");
    // All have one skirt, and the twin finds nothing.
    let text = std::fs::read_to_string(scratch.path("p.gcode")).unwrap();
    assert!(text.contains("\n; model 2: fill_density=60%\n"));
    let skirts = |text: &str| text.matches(";TYPE:Skirt/Brim").count();
    assert_eq!(skirts(&text), 1);
    for curved in [&["--layers", "conical", "--cone-angle", "15"][..], &["--copies", "2"]] {
        let mut all =
            vec!["slice", "a.stl", "a.stl", "-q", "-o", "c.gcode", "--object", "1:perimeters=1"];
        all.extend(curved);
        scratch.run(&all).expect(0);
    }
    for wrong in ["2", "0:perimeters=3", "3:perimeters=3", "x:perimeters=3"] {
        scratch.run(&["slice", "a.stl", "a.stl", "--object", wrong]).refused("Usage", 2);
    }
    let whole = ["slice", "a.stl", "--object", "1:layer_height_mm=0.1"];
    scratch.run(&whole).refused("ConfigConflict", 6);
    scratch.run(&["slice", "a.stl", "--object", "1:no=1"]).refused("ConfigUnknownKey", 6);
}

/// Filament laid between the begin and the end of an object, of one role or of all.
fn filament(program: &str, begin: &str, end: &str, role: Option<&str>) -> f64 {
    let (mut inside, mut is_role, mut fed) = (false, false, 0.0);
    for line in program.lines() {
        inside |= line == begin;
        inside &= line != end;
        if let Some(label) = line.strip_prefix(";TYPE:") {
            is_role = role == Some(label);
        }
        let moves = line.starts_with("G1 X");
        if inside && moves && (is_role || role.is_none()) {
            let word = line.split(' ').find_map(|word| word.strip_prefix('E')?.parse::<f64>().ok());
            fed += word.filter(|fed| *fed > 0.0).unwrap_or(0.0);
        }
    }
    fed
}
