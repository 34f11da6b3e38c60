//! Subdivision against published numbers, where the folder with the vectors is at hand.

use machine::gcode::dialect::POLAR;
use machine::gcode::speed_word::{SpeedWord, Way};
use machine::kinematics::{Alignment, Branch};
use machine::profile::{Axis, Printer, Turntable};
use machine::program::{BedTurn, Joints, Move};
use nalgebra::{Point3, Vector2};
use plan::follow::Follower;
use plan::resample::{ResampleParams, Resampler};
use plan::route::{Kind, Stroke};
use serde_json::Value;

/// The vectors, from a `shared/vectors` folder beside the repository; `None` in a plain clone.
fn vectors() -> Option<Value> {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = manifest.ancestors().nth(3)?.join("shared/vectors/calibration.json");
    let text = std::fs::read_to_string(path).ok()?;
    Some(serde_json::from_str(&text).expect("the vectors are JSON"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number in {value}"))
}

fn alignment(model: &Value) -> Alignment {
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

/// A printer that stands at a place already.
fn printer(alignment: Alignment, at: Point3<f64>) -> Printer {
    let home =
        alignment.joints_from_part(&at, Branch::Near, BedTurn::default()).expect("within reach");
    Printer {
        name: "vectors".into(),
        rail: Axis { min: 0.0, max: 120.0, speed: 150.0, acceleration: 1500.0 },
        lift: Axis { min: 0.0, max: 0.1, speed: 15.0, acceleration: 300.0 },
        bed: Turntable { speed: 6.0, acceleration: 50.0 },
        path_acceleration: 1500.0,
        rail_jerk: 8.0,
        bed_jerk: 0.5,
        extruder_speed: 120.0,
        nozzle_diameter: 0.4,
        nozzle: machine::profile::NozzleShape::COMMON,
        axis_clearance: 0.02,
        moves_per_second: 500.0,
        home: POLAR.rounded_joints(&home),
        nozzle_temperature_max: 280.0,
        nozzle_temperature_min_extrude: 170.0,
        bed_temperature_max: 110.0,
        alignment,
        bed_map: machine::height_map::HeightMap::default(),
        most_turn: f64::INFINITY,
        head: None,
    }
}

#[test]
fn lines_are_cut_no_more_often_than_by_halving() {
    let Some(all) = vectors() else { return };
    for case in all["segments_bisection"]["cases"].as_array().unwrap() {
        let model = &all["models"][case["model"].as_str().unwrap()];
        let point = |key: &str| {
            let end = &case[key];
            Point3::new(end[0].as_f64().unwrap(), end[1].as_f64().unwrap(), 0.0)
        };
        let eps = number(case, "eps");
        let params = ResampleParams { chord: eps, travel_chord: eps, dialect: POLAR, azimuth: 0.0 };
        let mut resampler = Resampler::new(&printer(alignment(model), point("p0")), params);
        let stroke = Stroke {
            kind: Kind::Print,
            to: point("p1"),
            filament: 1.0,
            speed: 50.0,
            continues: false,
        };
        let legs = resampler.legs(&[stroke]).unwrap();
        let (count, published) = (legs[0].len() as f64, number(case, "count"));
        // The published numbers are those of halving; lines are cut better than that.
        assert!(count <= published && count >= 0.5 * published, "{count} {published}");
    }
}

/// The line `x = d` between two `y`, as moves; and where the joints stood before each.
fn past_the_axis(printer: &Printer, ends: [f64; 2], d: f64, eps: f64) -> Vec<(Joints, Move)> {
    let params = ResampleParams { chord: eps, travel_chord: eps, dialect: POLAR, azimuth: 0.0 };
    let to = Point3::new(d, ends[1], 0.0);
    let stroke = Stroke { kind: Kind::Print, to, filament: 1.0, speed: 60.0, continues: false };
    let followed = Follower::new(printer, params).follow(&[stroke]).expect("within reach");
    let mut from = printer.home;
    followed.moves().map(|motion| (std::mem::replace(&mut from, motion.to), motion)).collect()
}

#[test]
fn lines_past_the_axis_need_hardly_more_moves_than_the_least() {
    let Some(all) = vectors() else { return };
    let mut seen = 0;
    for key in ["segments_closed_form_b0", "segments_integral_b"] {
        for case in all[key].as_array().unwrap() {
            let (d, eps) = (number(case, "d"), number(case, "eps"));
            let ends = [number(case, "y0"), number(case, "y1")];
            let b = case["b"].as_f64().unwrap_or(0.0);
            let alignment = Alignment { b, ..Alignment::IDEAL };
            let printer = printer(alignment, Point3::new(d, ends[0], 0.0));
            let moves = past_the_axis(&printer, ends, d, eps);
            let (count, least) = (moves.len() as f64, number(case, "I"));
            // The formula itself may be 5 % below what is needed.
            assert!(
                count >= 0.95 * least && count <= 1.1 * least + 1.0,
                "{key} {d}: {count} {least}"
            );
            for (from, motion) in &moves {
                for share in [0.2, 0.4, 0.5, 0.6, 0.8] {
                    let at = alignment.part_from_joints(&POLAR.between(from, &motion.to, share));
                    // Rounding to a thousandth on top.
                    assert!((at.x - d).abs() <= eps + 1e-3, "{key} {d}: {at}");
                }
            }
            seen += 1;
        }
    }
    assert!(seen >= 8);
}

#[test]
fn past_the_axis_the_bed_runs_as_fast_as_it_may() {
    let Some(all) = vectors() else { return };
    for case in all["feed_limits"].as_array().unwrap() {
        let (d, most) = (number(case, "d"), number(case, "omega_max"));
        let mut printer = printer(Alignment::IDEAL, Point3::new(d, -20.0, 0.0));
        printer.bed = Turntable { speed: most, acceleration: number(case, "alpha_max") };
        printer.rail.speed = number(case, "v_rail");
        printer.rail.acceleration = number(case, "a_rail");
        let moves = past_the_axis(&printer, [-20.0, 20.0], d, 0.005);
        let middle = moves.iter().find(|(_, motion)| motion.at.y > 0.0).unwrap();
        let (from, motion) = middle;
        let turned = motion.to.turn.radians() - from.turn.radians();
        let (speed, wanted) = (turned.abs() / motion.duration, number(case, "v") / d);
        assert!(speed <= wanted * (1.0 + 1e-9) && speed >= 0.9 * wanted, "{d}: {speed} {wanted}");
    }
}

#[test]
fn a_line_past_the_axis_takes_hardly_longer_than_the_least_time() {
    let Some(all) = vectors() else { return };
    let case = &all["topp"];
    let list = |key: &str| [0, 1].map(|k| case[key][k].as_f64().unwrap());
    let ([rail_speed, bed_speed], [rail_acceleration, bed_acceleration]) =
        (list("v_lim"), list("a_lim"));
    let mut printer = printer(Alignment::IDEAL, Point3::new(2.0, -20.0, 0.0));
    printer.bed = Turntable { speed: bed_speed, acceleration: bed_acceleration };
    printer.rail = Axis { speed: rail_speed, acceleration: rail_acceleration, ..printer.rail };
    printer.path_acceleration = number(case, "a_tool");
    let commanded: f64 =
        past_the_axis(&printer, [-20.0, 20.0], 2.0, 0.005).iter().map(|(_, m)| m.duration).sum();
    let least = number(case, "T");
    assert!(commanded > 0.95 * least && commanded < 1.15 * least, "{commanded} {least}");
}

#[test]
fn words_over_all_axes_mean_the_duration() {
    let Some(all) = vectors() else { return };
    for case in all["F_words"].as_array().unwrap() {
        let words = number(case, "ds").hypot(number(case, "dC_deg")).hypot(number(case, "dz"));
        let ends = [[0.0; 2]; 2];
        let way = Way { path: 1.0, words, filament: 0.0, turn: 0.0, ends, rise: 0.0 };
        let duration = number(case, "T");
        let mixed = SpeedWord::Words.word(&way, duration);
        assert!((mixed - number(case, "F_mixed")).abs() < 1e-6, "{mixed}");
        let inverse = SpeedWord::InverseTime.word(&way, duration);
        assert!((inverse - number(case, "F_G93")).abs() < 1e-9, "{inverse}");
    }
}
