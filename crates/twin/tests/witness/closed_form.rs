//! A straight line past the axis at distance `d` and constant speed `v`: the bed turns at most at
//! `v/d`, and accelerates at most at `(3√3/8)·(v/d)²`, at `d/√3` either side of the foot.

use machine::profile::Printer;
use std::fmt::Write;
use twin::verify::{Setup, Verdict, Verifier};

use crate::program::{FILAMENT_AREA, printer};

const DISTANCE: f64 = 1.0;
const SPEED: f64 = 10.0;

fn line_past_the_axis() -> String {
    let mut text = String::from("G28\nG90\nM83\nG1 Z19 F600\n");
    let feed = SPEED * 60.0;
    let mut at = -60.0_f64;
    let start = (DISTANCE.hypot(at), at.atan2(DISTANCE).to_degrees());
    // Not slower than a carriage that the test lets do anything.
    let _ = writeln!(text, "G1 R{:.3} T{:.4} F600\nG4 P100\nG1 F{feed}", start.0, start.1);
    while at < 60.0 {
        at += if at.abs() < 1.7 { 0.05 } else { 0.5 };
        let radius = DISTANCE.hypot(at);
        let decimals = if radius < 2.0 { 5 } else { 3 };
        let turn = at.atan2(DISTANCE).to_degrees();
        let _ = writeln!(text, "G1 R{radius:.decimals$} T{turn:.4}");
    }
    text
}

fn judged(printer: &Printer) -> Verdict {
    let setup = Setup {
        printer,
        dialect: machine::gcode::dialect::POLAR,
        filament_area: FILAMENT_AREA,
        multiplier: 1.0,
        restart_extra: 0.0,
        coarse: 0.0,
        volume_per_second: f64::INFINITY,
        mesh: None,
        solid: false,
        moved: 0.0,
        thorough: false,
    };
    let mut verifier = Verifier::new(setup);
    for line in line_past_the_axis().lines() {
        verifier.line(line);
    }
    verifier.finish()
}

fn machine(bed_speed: f64, bed_acceleration: f64) -> Printer {
    let mut printer = printer();
    printer.rail.acceleration = 1e6;
    printer.bed.speed = bed_speed;
    printer.bed.acceleration = bed_acceleration;
    printer
}

#[test]
fn speed_and_acceleration_of_the_bed_equal_the_closed_form() {
    let rate = SPEED / DISTANCE;
    let acceleration = 3.0 * 3.0_f64.sqrt() / 8.0 * rate * rate;
    let totals = judged(&machine(1e3, acceleration)).totals;
    assert!((totals.bed_speed / rate - 1.0).abs() < 2e-3, "{} {rate}", totals.bed_speed);
    let found = totals.bed_acceleration;
    assert!((found / acceleration - 1.0).abs() < 0.03, "{found} {acceleration}");
    assert!((totals.nearest_to_axis - DISTANCE).abs() < 1e-3);
}

#[test]
fn the_limits_bite_where_the_closed_form_says() {
    let rate = SPEED / DISTANCE;
    let acceleration = 3.0 * 3.0_f64.sqrt() / 8.0 * rate * rate;
    let checks = |speed: f64, acceleration: f64| {
        let verdict = judged(&machine(speed, acceleration));
        let mut checks: Vec<&str> = verdict.findings.iter().map(|found| found.check).collect();
        checks.dedup();
        checks
    };
    assert_eq!(checks(1.01 * rate, 1.03 * acceleration), [] as [&str; 0]);
    assert_eq!(checks(0.99 * rate, 1.03 * acceleration), ["speed"]);
    assert_eq!(checks(1.01 * rate, 0.95 * acceleration), ["acceleration"]);
}
