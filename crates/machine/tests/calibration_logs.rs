//! Logs of analogue and digital sensors, from text to a calibration.

use machine::calibration::fit::{Fit, FitError, Undetermined, fit_log};
use machine::calibration::log::parse;
use nalgebra::{Rotation2, Vector2};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

const A: f64 = 0.4;
const B: f64 = -0.7;

/// Where the ring of eight magnets of 60 mm radius stands.
fn magnet(place: u32) -> Vector2<f64> {
    let angle = 0.1 + TAU * f64::from(place) / 8.0;
    Vector2::new(0.3, 0.6) + 60.0 * Vector2::new(angle.cos(), angle.sin())
}

/// The field under the sensor, 100 above each magnet; the one at place 3 is turned over.
fn field(s: f64, theta: f64) -> f64 {
    let at = Rotation2::new(theta) * Vector2::new(s + A, B);
    (0..8)
        .map(|place| {
            let bell = 100.0 * (-(at - magnet(place)).norm_squared() / 8.0).exp();
            if place == 3 { -bell } else { bell }
        })
        .sum()
}

/// Joints at which the sensor is over a magnet, roughly: as a search would have found it.
fn roughly(place: u32, side: f64) -> [f64; 2] {
    let at = magnet(place);
    let theta = at.y.atan2(at.x) + if side < 0.0 { PI } else { 0.0 };
    [side * at.norm(), theta]
}

/// Readings on a line in the joints, there and back.
fn scan(text: &mut String, from: [f64; 2], to: [f64; 2]) {
    const STEPS: u32 = 80;
    for k in (0..=STEPS).chain((0..=STEPS).rev()) {
        let share = f64::from(k) / f64::from(STEPS);
        let [s, theta] = [0, 1].map(|m| from[m] + share * (to[m] - from[m]));
        let level = 512.0 + field(s, theta);
        writeln!(text, "{s:.6},{:.7},{level:.4}", theta.to_degrees()).expect("strings take all");
    }
}

fn is_right(fit: &Fit) {
    let (a, b) = (fit.a.expect("a").value, fit.b.expect("b").value);
    assert!((a - A).abs() < 0.004 && (b - B).abs() < 0.004, "{a} {b}");
    let [ex, ey] = fit.centre.expect("a ring");
    assert!((ex.value - 0.3).abs() < 0.005 && (ey.value - 0.6).abs() < 0.005, "{ex:?} {ey:?}");
    assert_eq!((fit.n_pairs, fit.unresolved, fit.one_way), (8, 0, 0));
}

const HEADER: &str = "# magnets = 8\n# ring_radius_mm = 60\ns_mm,theta_deg,level\n";

#[test]
fn cross_scans_of_an_analogue_sensor() {
    let mut text = HEADER.to_owned();
    for place in 0..8 {
        for side in [1.0, -1.0] {
            let [s, theta] = roughly(place, side);
            let arc = 12.0 / s.abs();
            scan(&mut text, [s, theta - arc], [s, theta + arc]);
            scan(&mut text, [s - 12.0, theta], [s + 12.0, theta]);
        }
    }
    let fit = fit_log(&parse(&text).expect("a log")).expect("magnets");
    is_right(&fit);
    // The magnet that is turned over is the index: place 3 of those counted from azimuth 0.1.
    assert_eq!(fit.undetermined, []);
    let angle = fit.angle.expect("an angle").value;
    assert!((angle - (0.1 + TAU * 3.0 / 8.0)).abs() < 1e-4, "{angle}");
}

#[test]
fn turns_of_an_analogue_sensor_at_several_carriage_positions() {
    let mut text = HEADER.to_owned();
    for place in 0..8 {
        for side in [1.0, -1.0] {
            for level in -8..=8 {
                let [s, theta] = roughly(place, side);
                let (s, arc) = (s + f64::from(level), 12.0 / s.abs());
                scan(&mut text, [s, theta - arc], [s, theta + arc]);
            }
        }
    }
    is_right(&fit_log(&parse(&text).expect("a log")).expect("magnets"));
}

/// Edges of a sensor that switches on a circle of 3 mm; the bed turns both ways, or one.
fn edges(ways: &[f64]) -> String {
    let mut text =
        "# magnets = 8\n# ring_radius_mm = 60\ns_mm,theta_deg,edge,direction\n".to_owned();
    for place in 0..8 {
        for side in [1.0, -1.0] {
            for level in -2..=2 {
                let s = side * (60.5 + f64::from(level)) - A;
                let r = (s + A).hypot(B);
                let at = magnet(place);
                let cos = (r * r + at.norm_squared() - 9.0) / (2.0 * r * at.norm());
                if cos >= 1.0 {
                    continue;
                }
                let middle = at.y.atan2(at.x) - B.atan2(s + A);
                for way in ways {
                    // What the sensor lags behind, 0.05 mm.
                    let lag = way * 0.05 / 60.0;
                    let word = if *way > 0.0 { "cw" } else { "ccw" };
                    for (edge, turn) in [("on", -way), ("off", *way)] {
                        let theta = middle + lag + turn * cos.acos();
                        writeln!(text, "{s:.6},{:.7},{edge},{word}", theta.to_degrees())
                            .expect("strings take all");
                    }
                }
            }
        }
    }
    text
}

#[test]
fn edges_from_both_directions() {
    let fit = fit_log(&parse(&edges(&[1.0, -1.0])).expect("a log")).expect("magnets");
    is_right(&fit);
    assert_eq!(fit.undetermined, [Undetermined::IndexMagnet { count: 8 }]);
}

#[test]
fn edges_from_one_direction_are_told_to_be_off() {
    let fit = fit_log(&parse(&edges(&[1.0])).expect("a log")).expect("magnets");
    assert_eq!(fit.one_way, 16);
}

#[test]
fn readings_of_nothing_are_no_magnets() {
    let mut text = HEADER.to_owned();
    for k in 0..500 {
        writeln!(text, "100,{k},512").expect("strings take all");
    }
    assert!(fit_log(&parse(&text).expect("a log")).is_err());
    let mut chatter = "s_mm,theta_deg,edge,direction\n".to_owned();
    for k in 0..50_000 {
        writeln!(chatter, "50,{k},on,cw\n50,{k}.5,off,cw").expect("strings take all");
    }
    let error = fit_log(&parse(&chatter).expect("a log")).expect_err("no calibration");
    assert!(matches!(error, FitError::TooManyPasses { .. }), "{error}");
    let one = "s_mm,theta_deg,edge,direction\n100,1,off,cw\n100,2,on,cw\n100,9,off,ccw\n";
    assert!(fit_log(&parse(one).expect("a log")).is_err());
}
