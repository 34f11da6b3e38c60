//! The kinematics against published numbers, where the folder with the vectors is at hand.

use machine::kinematics::{Alignment, Branch};
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
