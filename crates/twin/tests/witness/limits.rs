//! Programs that keep a limit exactly before their numbers are rounded are never called faulty.
//!
//! Random paths are given random durations; the limits of the printer are then set to the greatest
//! speeds and accelerations that come of it, so that the worst place is exactly at its limit.

use machine::gcode::Emitter;
use machine::gcode::dialect::POLAR;
use machine::kinematics::Alignment;
use machine::profile::Printer;
use machine::program::{BedTurn, Joints, Move, Step};
use nalgebra::Point2;
use proptest::prelude::*;
use twin::curve::Curve;
use twin::verify::{Setup, Verifier};

use crate::program::{FILAMENT_AREA, printer};

const HEAD: &str = "G28\nG90\nM83\nM109 S210\n";

/// Moves with their durations, s.
struct Run {
    start: Joints,
    moves: Vec<(Joints, f64)>,
}

/// A wandering line from `at`, in steps of these lengths (mm), turns (radians) and speeds (mm/s).
fn run(at: Point2<f64>, steps: &[(f64, f64, f64)]) -> Run {
    let joints = |p: &Point2<f64>, near: BedTurn| Joints {
        s: p.coords.norm(),
        turn: near.nearest(p.y.atan2(p.x)),
        z: 1.0,
    };
    let start = joints(&at, BedTurn::default());
    let (mut place, mut heading, mut near) = (at, 0.3, start.turn);
    let mut moves = Vec::new();
    for &(length, turn, speed) in steps {
        heading += turn;
        place.x += length * f64::cos(heading);
        place.y += length * f64::sin(heading);
        let to = joints(&place, near);
        near = to.turn;
        moves.push((to, length / speed));
    }
    Run { start, moves }
}

/// The greatest mean speed of a joint and the greatest change of it over the time between middles.
fn greatest(run: &Run, joint: impl Fn(&Joints) -> f64) -> (f64, f64) {
    let (mut last, mut half, mut from) = (0.0, 0.0, run.start);
    let (mut speed, mut acceleration) = (0.0_f64, 0.0_f64);
    for (to, duration) in &run.moves {
        let mean = (joint(to) - joint(&from)) / duration;
        speed = speed.max(mean.abs());
        acceleration = acceleration.max((mean - last).abs() / (half + duration / 2.0));
        (last, half, from) = (mean, duration / 2.0, *to);
    }
    (speed, acceleration.max(last.abs() / half))
}

fn text(run: &Run) -> String {
    let ideal = Alignment::default();
    let mut emitter = Emitter::new(Vec::new(), POLAR);
    let mut from = run.start;
    for (to, duration) in &run.moves {
        let path = Curve::between_joints(&from, to, &ideal).length();
        let at = ideal.part_from_joints(to);
        let step = Move { to: *to, at, filament: 0.0, path, duration: *duration };
        emitter.step(&Step::Move(step)).expect("memory takes everything");
        from = *to;
    }
    let bytes = emitter.finish().expect("memory takes everything");
    HEAD.to_string() + &String::from_utf8(bytes).expect("ASCII") + "M104 S0\n"
}

fn findings(run: &Run, printer: &Printer) -> Vec<String> {
    let dialect = POLAR;
    let setup = Setup {
        printer,
        dialect,
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
    for line in text(run).lines() {
        verifier.line(line);
    }
    verifier.finish().findings.iter().map(ToString::to_string).collect()
}

fn at_its_limits(run: &Run, share: f64) -> Printer {
    let mut printer = printer();
    printer.home = run.start;
    printer.rail.min = -1.0;
    let (speed, acceleration) = greatest(run, |joints| joints.turn.radians());
    (printer.bed.speed, printer.bed.acceleration) = (speed * share, acceleration * share);
    let (speed, acceleration) = greatest(run, |joints| joints.s);
    (printer.rail.speed, printer.rail.acceleration) = (speed * share, acceleration * share);
    printer
}

fn steps(least: f64) -> impl Strategy<Value = Vec<(f64, f64, f64)>> {
    // Speeds change slowly as planned ones do, or the limits would forgive everything.
    let step = (0.0..1.0, -0.4..0.4, 20.0..24.0);
    prop::collection::vec(step, 5..60).prop_map(move |steps| {
        let log = |share: f64| least * (2.0 / least).powf(share);
        steps.into_iter().map(|(length, turn, speed)| (log(length), turn, speed)).collect()
    })
}

proptest! {
    #[test]
    fn what_keeps_the_limits_exactly_is_sound(
        x in prop_oneof![0.6..3.0, 3.0..90.0], y in -20.0..20.0, steps in steps(0.005)
    ) {
        let run = run(Point2::new(x, y), &steps);
        prop_assert_eq!(findings(&run, &at_its_limits(&run, 1.0)), Vec::<String>::new());
    }

    #[test]
    fn what_breaks_them_by_a_tenth_is_found(
        x in 20.0..90.0, y in -20.0..20.0, steps in steps(0.5)
    ) {
        let run = run(Point2::new(x, y), &steps);
        let found = findings(&run, &at_its_limits(&run, 0.9));
        // Of bed and carriage the one that hardly moves is uncertain; the other one is not.
        for check in ["speed: the", "acceleration: the"] {
            let is_found = found.iter().any(|text| text.starts_with(check));
            prop_assert!(is_found, "{}: {:?}", check, found);
        }
    }
}
