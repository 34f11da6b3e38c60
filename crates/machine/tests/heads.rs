//! Tilting heads and hexapods against published numbers, where the folder with the vectors is at hand.

use machine::head::hexapod::{Hexapod, JointLimits, Layout, Platform, Rods};
use machine::head::tilting::Tilting;
use machine::head::{Head, Pose, shortest_turn};
use machine::kinematics::Alignment;
use machine::profile::Axis;
use machine::program::BedTurn;
use nalgebra::{Point3, Rotation3, UnitVector3, Vector2, Vector3};
use serde_json::Value;

fn vectors() -> Option<Value> {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = manifest.ancestors().nth(3)?.join("shared/vectors/calibration.json");
    Some(serde_json::from_str(&std::fs::read_to_string(path).ok()?).expect("the vectors are JSON"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number in {value}"))
}

fn three(value: &Value) -> Vector3<f64> {
    let list = value.as_array().expect("a list");
    Vector3::from_fn(|k, _| list[k].as_f64().expect("a number"))
}

fn cases<'a>(all: &'a Value, key: &str) -> &'a [Value] {
    let list = all[key].as_array().expect("a list");
    assert!(!list.is_empty());
    list
}

const ANY: Axis = Axis { min: -1e9, max: 1e9, speed: 1.0, acceleration: 1.0 };

const TOLERANCE: f64 = 1e-9;

#[track_caller]
fn same(found: f64, expected: f64) {
    assert!((found - expected).abs() < TOLERANCE, "{found} is not {expected}");
}

fn tip(case: &Value) -> (Pose, Alignment) {
    let at = Point3::from(three(&case["p"]));
    let pose = Pose { at, axis: UnitVector3::new_normalize(three(&case["n"])) };
    let alignment = Alignment { a: number(case, "a"), b: number(case, "b"), ..Alignment::IDEAL };
    (pose, alignment)
}

#[test]
fn turns_from_normals() {
    let Some(all) = vectors() else { return };
    for case in cases(&all, "rotation_from_normal") {
        let turn = shortest_turn(&UnitVector3::new_normalize(three(&case["n"])));
        for row in 0..3 {
            let expected = three(&case["R"][row]);
            assert!((turn.matrix().row(row).transpose() - expected).norm() < TOLERANCE, "{case}");
        }
    }
}

#[test]
fn one_tilt() {
    let Some(all) = vectors() else { return };
    for case in cases(&all, "polar4") {
        let (pose, alignment) = tip(case);
        let length = number(case, "Lp");
        let head = Head::Tilting(Tilting::one_axis(length, ANY));
        let reached = head.stance(&pose, BedTurn::default(), &alignment).unwrap();
        same(reached.stance.base.s, number(case, "s"));
        same(reached.stance.base.turn.radians(), number(case, "theta"));
        same(reached.stance.base.z + length, number(case, "z_pivot"));
        same(reached.stance.head[0], number(case, "B"));
        same(reached.residual, number(case, "residual_angle"));
    }
}

#[test]
fn two_tilts_with_and_without_a_nozzle_beside_the_pivot() {
    let Some(all) = vectors() else { return };
    let beside = std::slice::from_ref(&all["polar5_tool_offset"]);
    for case in cases(&all, "polar5").iter().chain(beside) {
        let (pose, alignment) = tip(case);
        let length = number(case, "Lp");
        let offset = case["offset_xy"]
            .as_array()
            .map_or(Vector2::zeros(), |list| Vector2::from_fn(|k, _| list[k].as_f64().unwrap()));
        let head = Head::Tilting(Tilting { offset, ..Tilting::two_axes(length, ANY, ANY) });
        // Published with the rail's alignment at the pivot; here it is that of the upright tip.
        let [a, b] = [alignment.a + offset.x, alignment.b + offset.y];
        let alignment = Alignment { a, b, ..alignment };
        let stance = head.stance(&pose, BedTurn::default(), &alignment).unwrap().stance;
        same(stance.base.s, number(case, "s"));
        same(stance.base.turn.radians(), number(case, "theta"));
        same(stance.base.z + length, number(case, "z_pivot"));
        same(stance.head[0], number(case, "A"));
        same(stance.head[1], number(case, "B"));
    }
}

fn platform(case: &Value) -> Platform {
    let [roll, pitch, yaw] = three(&case["roll_pitch_yaw"]).into();
    Platform { origin: three(&case["T"]), turn: Rotation3::from_euler_angles(roll, pitch, yaw) }
}

fn hexapod(case: &Value, base_half: f64, platform_half: f64) -> (Hexapod, Layout) {
    let layout = Layout {
        base_radius: number(case, "rb"),
        platform_radius: number(case, "rp"),
        base_half_angle: base_half,
        platform_half_angle: platform_half,
    };
    let home = Vector3::new(0.0, 0.0, layout.height_at_45());
    let limits = JointLimits { cone: 1.0, home, apart: 0.0, condition: 1e3, tilt: 0.7 };
    (Hexapod::new(layout.joints(), 0.0, ANY, limits), layout)
}

#[test]
fn hexapods() {
    let Some(all) = vectors() else { return };
    for case in cases(&all, "hexapod") {
        let half = |key| number(case, key);
        let (hexapod, layout) = hexapod(case, half("base_half_angle"), half("platform_half_angle"));
        same(layout.height_at_45(), number(case, "z45"));
        for leg in 0..6 {
            assert!((hexapod.base[leg] - three(&case["base"][leg])).norm() < TOLERANCE);
            assert!((hexapod.platform[leg] - three(&case["platform"][leg])).norm() < TOLERANCE);
        }
        let home = Platform { origin: hexapod.joints.home, turn: Rotation3::identity() };
        for pose in cases(case, "poses") {
            let wanted = platform(pose);
            let legs = hexapod.legs(&wanted).unwrap();
            let jacobian = hexapod.jacobian(&wanted, &legs);
            for k in 0..6 {
                same(legs[k], pose["legs"][k].as_f64().unwrap());
                same(jacobian[(0, k)], pose["J_row0"][k].as_f64().unwrap());
            }
            let found = hexapod.forward(&legs, &home).unwrap();
            assert!((found.origin - wanted.origin).norm() < TOLERANCE);
            assert!((found.turn.matrix() - wanted.turn.matrix()).norm() < TOLERANCE);
        }
    }
}

#[test]
fn rods_on_slides() {
    let Some(all) = vectors() else { return };
    let case = &all["hexapod_sliders"];
    let half = number(case, "half");
    // The published case has pairs on base and platform alike.
    let (plain, _) = hexapod(case, half, half);
    let direction = UnitVector3::new_normalize(three(&case["axis"]));
    let rods = Some(Rods { length: number(case, "rod"), direction });
    let hexapod = Hexapod { rods, ..plain };
    let wanted = platform(case);
    let slides = hexapod.legs(&wanted).unwrap();
    for (k, slide) in slides.iter().enumerate() {
        same(*slide, case["q_lower"][k].as_f64().unwrap());
    }
    let guess = Platform { origin: Vector3::new(0.0, 0.0, 140.0), turn: Rotation3::identity() };
    let found = hexapod.forward(&slides, &guess).unwrap();
    assert!((found.origin - wanted.origin).norm() < TOLERANCE);
}
