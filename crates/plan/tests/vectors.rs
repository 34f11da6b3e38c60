//! Subdivision against published numbers, where the folder with the vectors is at hand.

use machine::gcode::dialect::POLAR;
use machine::kinematics::{Alignment, Branch};
use machine::profile::{Axis, Printer, Turntable};
use machine::program::BedTurn;
use nalgebra::{Point3, Vector2};
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
        filament_speed: 50.0,
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
    }
}

#[test]
fn lines_are_cut_as_often_as_published() {
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
        // Positions are rounded to a thousandth, a tenth of some tolerances here: a piece that is
        // just near enough may be halved once more, or not.
        assert!((count - published).abs() <= 0.05 * published, "{count} {published}");
    }
}
