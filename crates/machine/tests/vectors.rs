//! The kinematics against published numbers, where the folder with the vectors is at hand.

use machine::backlash::Backlash;
use machine::drive::{Drive, Transmission};
use machine::gcode::speed_word::{SpeedWord, Way};
use machine::height_map::HeightMap;
use machine::kinematics::{Alignment, BedScale, Branch};
use machine::plate_shift::PlateShift;
use machine::program::{BedTurn, Joints};
use nalgebra::{Point3, Vector2};
use serde_json::Value;
use std::f64::consts::TAU;

/// The vectors, from a `shared/vectors` folder beside the repository; `None` in a plain clone.
fn vectors(name: &str) -> Option<Value> {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = manifest.ancestors().nth(3)?.join("shared/vectors").join(name);
    let text = std::fs::read_to_string(path).ok()?;
    Some(serde_json::from_str(&text).expect("the vectors are JSON"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number in {value}"))
}

fn alignment(models: &Value, name: &Value) -> Alignment {
    let model = &models[name.as_str().expect("models go by name")];
    Alignment {
        a: number(model, "a"),
        b: number(model, "b"),
        a1: number(model, "a1"),
        b1: number(model, "b1"),
        plate_offset: Vector2::new(number(model, "ex"), number(model, "ey")),
        plate_angle: number(model, "psi"),
        ..Alignment::IDEAL
    }
}

#[test]
fn forward_and_inverse() {
    let Some(all) = vectors("calibration.json") else { return };
    let forward = all["forward"].as_array().unwrap();
    assert!(forward.len() > 10);
    for case in forward {
        let turn = BedTurn::accumulated(number(case, "theta"));
        let joints = Joints { s: number(case, "s"), turn, z: number(case, "z") };
        let part = alignment(&all["models"], &case["model"]).part_from_joints(&joints);
        let expected = Point3::new(number(case, "x"), number(case, "y"), number(case, "z"));
        assert!((part - expected).norm() < 1e-9, "{case}: {part}");
    }
    let inverse = all["inverse"].as_array().unwrap();
    assert!(inverse.len() > 100);
    for case in inverse {
        let part = Point3::new(number(case, "x"), number(case, "y"), number(case, "z"));
        let branch = if number(case, "kappa") > 0.0 { Branch::Near } else { Branch::Far };
        let near = BedTurn::accumulated(case["theta_prev"].as_f64().unwrap_or(0.0));
        let alignment = alignment(&all["models"], &case["model"]);
        match alignment.joints_from_part(&part, branch, near) {
            Ok(joints) => {
                assert_eq!(case["reachable"], Value::Bool(true), "{case}");
                assert!((joints.s - number(case, "s")).abs() < 1e-9, "{case}: {joints:?}");
                let mut off = joints.turn.radians() - number(case, "theta");
                if case["theta_prev"].is_null() {
                    // Half a turn either way is the same place of the bed.
                    off -= (off / TAU).round() * TAU;
                }
                assert!(off.abs() < 1e-9, "{case}: {joints:?}");
            }
            Err(_) => assert_eq!(case["reachable"], Value::Bool(false), "{case}"),
        }
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list of numbers");
    list.iter().map(|n| n.as_f64().expect("a number")).collect()
}

#[test]
fn the_bed_is_unwrapped_along_a_path() {
    let Some(all) = vectors("calibration.json") else { return };
    let path = &all["unwrap_path"];
    let alignment = alignment(&all["models"], &path["model"]);
    let mut turn = BedTurn::accumulated(number(path, "theta_start"));
    for point in path["points_x_y_s_theta"].as_array().unwrap() {
        let [x, y, s, theta] = numbers(point)[..] else { panic!("{point}") };
        let part = Point3::new(x, y, 0.0);
        let joints = alignment.joints_from_part(&part, Branch::Near, turn).unwrap();
        assert!((joints.s - s).abs() < 1e-9, "{point}");
        assert!((joints.turn.radians() - theta).abs() < 1e-9, "{point}");
        turn = joints.turn;
    }
}

#[test]
fn the_words_of_a_bed_that_counts_its_own_way() {
    let Some(all) = vectors("calibration.json") else { return };
    for case in all["words"].as_array().unwrap() {
        let bed = BedScale {
            zero: number(case, "theta0"),
            is_reversed: number(case, "sigma") < 0.0,
            backlash: 0.0,
        };
        let theta = number(case, "theta");
        let turn = bed.turn(theta);
        assert!((turn.to_degrees() - number(case, "C_deg")).abs() < 1e-9, "{case}");
        assert!((bed.azimuth(BedTurn::accumulated(turn)) - theta).abs() < 1e-12, "{case}");
    }
}

#[test]
fn a_constant_shift_and_what_it_does_not_correct() {
    let Some(all) = vectors("calibration.json") else { return };
    let example = &all["thesis_example"];
    let by = Vector2::new(number(example, "dx"), number(example, "dy"));
    let (radius, angle) = PlateShift { by }.shifted(number(example, "R"), number(example, "phi"));
    assert!((radius - number(example, "R_new")).abs() < 1e-9);
    assert!((angle - number(example, "phi_new")).abs() < 1e-9);
    for case in all["thesis_error_offaxis"].as_array().unwrap() {
        let shift = numbers(&case["d"]);
        let shift = PlateShift { by: Vector2::new(shift[0], shift[1]) };
        let (x, y) = (number(case, "x"), number(case, "y"));
        let (s, theta) = shift.shifted(x.hypot(y), y.atan2(x));
        let real = Alignment { b: number(case, "b"), ..Alignment::IDEAL };
        let turn = BedTurn::accumulated(theta);
        let off = real.part_from_joints(&Joints { s, turn, z: 0.0 }) - Point3::new(x, y, 0.0);
        assert!((off.x - number(case, "err_x")).abs() < 1e-9, "{case}: {off}");
        assert!((off.y - number(case, "err_y")).abs() < 1e-9, "{case}: {off}");
    }
}

#[test]
fn the_drive_runs_ahead_by_half_its_play() {
    let Some(all) = vectors("calibration.json") else { return };
    let case = &all["backlash"];
    assert_eq!(number(case, "initial_direction"), 1.0);
    let theta = numbers(&case["theta"]);
    let mut backlash = Backlash::new(number(case, "B"), BedTurn::accumulated(theta[0]));
    for (theta, wanted) in theta.iter().zip(numbers(&case["theta_cmd"])) {
        let to = BedTurn::accumulated(*theta);
        backlash.take_up(to);
        assert!((backlash.follow(to).radians() - wanted).abs() < 1e-12, "{theta}");
    }
}

#[test]
fn the_height_map_fades_as_published() {
    let Some(all) = vectors("calibration.json") else { return };
    for case in all["z_model"].as_array().unwrap() {
        let q = numbers(&case["q"]);
        let (z, fade) = (number(case, "z"), number(case, "fade"));
        let plane =
            |x: f64, y: f64| number(case, "h0") + number(case, "tx") * x + number(case, "ty") * y;
        let corners =
            [[-100.0, -100.0], [100.0, -100.0], [100.0, 100.0], [-100.0, 100.0], [3.0, 8.0]];
        let probes = corners.map(|[x, y]| [x, y, plane(x, y)]);
        let map = HeightMap::new(&probes, fade).unwrap();
        // The slope of the rail itself is not part of a map of the bed.
        let of_rail = (1.0 - z / fade).max(0.0) * number(case, "g1") * number(case, "u");
        let lift = map.lift(&Vector2::new(q[0], q[1]), z) + of_rail;
        assert!((lift - number(case, "z_cmd")).abs() < 1e-9, "{case}: {lift}");
    }
}

#[test]
fn rates_along_a_line_are_those_of_the_theory() {
    let Some(all) = vectors("calibration.json") else { return };
    // Central differences of the inverse: 1e-3 mm is short against the 0.6 mm of the nearest line
    // and long against its last digits.
    let step = 1e-3;
    for case in all["line_derivatives"].as_array().unwrap() {
        let real = Alignment { b: number(case, "b"), ..Alignment::IDEAL };
        let joints = |y: f64| {
            let part = Point3::new(number(case, "d"), y, 0.0);
            real.joints_from_part(&part, Branch::Near, BedTurn::default()).unwrap()
        };
        let y = number(case, "y");
        if y.abs() < step && number(case, "du") == 0.0 && number(case, "b") != 0.0 {
            continue;
        }
        let [low, here, high] = [y - step, y, y + step].map(joints);
        let first = |f: fn(&Joints) -> f64| (f(&high) - f(&low)) / (2.0 * step);
        let second = |f: fn(&Joints) -> f64| (f(&high) - 2.0 * f(&here) + f(&low)) / (step * step);
        let rail = |joints: &Joints| joints.s;
        let bed = |joints: &Joints| joints.turn.radians();
        for (name, value) in [
            ("du", first(rail)),
            ("dtheta", first(bed)),
            ("d2u", second(rail)),
            ("d2theta", second(bed)),
        ] {
            let wanted = number(case, name);
            assert!((value - wanted).abs() < 1e-4 * (1.0 + wanted.abs()), "{name} {value} {case}");
        }
    }
}

#[test]
fn inverse_time_words() {
    let Some(all) = vectors("calibration.json") else { return };
    for case in all["F_words"].as_array().unwrap() {
        let turn = number(case, "dC_deg").to_radians();
        let length = number(case, "ds").hypot(number(case, "dz"));
        let ends = [[0.0; 2]; 2];
        let rise = number(case, "dz");
        let way = Way { path: length, words: length, filament: 0.0, turn, ends, rise };
        let word = SpeedWord::InverseTime.word(&way, number(case, "T"));
        assert!((word - number(case, "F_G93")).abs() < 1e-9, "{case}: {word}");
    }
}

#[test]
fn speeds_and_accelerations_past_the_axis_are_those_of_the_theory() {
    let Some(all) = vectors("calibration.json") else { return };
    // Central differences of the inverse over 1e-4 mm: short against the nearest line of 0.25 mm.
    let step = 1e-4;
    for case in all["line_dynamics"].as_array().unwrap() {
        let (d, speed) = (number(case, "d"), number(case, "v"));
        let joints = |y: f64| {
            let part = Point3::new(d, y, 0.0);
            Alignment::IDEAL.joints_from_part(&part, Branch::Near, BedTurn::default()).unwrap()
        };
        let rates = |y: f64| {
            let [low, here, high] = [y - step, y, y + step].map(joints);
            let of = |axis: fn(&Joints) -> f64| {
                let first = (axis(&high) - axis(&low)) / (2.0 * step) * speed;
                let second = axis(&high) - 2.0 * axis(&here) + axis(&low);
                [first, second / (step * step) * speed * speed]
            };
            [of(|joints| joints.turn.radians()), of(|joints| joints.s)]
        };
        let [[omega, alpha], [rail_v, rail_a]] = rates(number(case, "y"));
        let worst = rates(d / 3.0_f64.sqrt())[0][1].abs();
        for (name, value) in [
            ("omega", omega),
            ("alpha", alpha),
            ("rail_v", rail_v),
            ("rail_a", rail_a),
            ("alpha_max", worst),
        ] {
            let wanted = number(case, name);
            assert!((value - wanted).abs() < 1e-4 * (1.0 + wanted.abs()), "{name} {value} {case}");
        }
    }
}

#[test]
fn a_whole_step_is_off_by_what_the_gears_say() {
    let Some(all) = vectors("calibration.json") else { return };
    for case in all["quantisation"].as_array().unwrap() {
        let drive = Drive {
            motor_steps: number(case, "full_steps") as u32,
            microsteps: number(case, "microsteps") as u32,
            gear_ratio: number(case, "gear"),
            transmission: Transmission::Shaft,
        };
        assert!((drive.step() - number(case, "theta_step")).abs() < 1e-15, "{case}");
        let arc = drive.step() * number(case, "r");
        assert!((1e3 * arc - number(case, "arc_um")).abs() < 1e-9, "{case}");
        // Half a step of both axes at once.
        let worst = 0.5 * arc.hypot(number(case, "rail_step"));
        assert!((1e3 * worst - number(case, "worst_um")).abs() < 1e-9, "{case}");
    }
}
