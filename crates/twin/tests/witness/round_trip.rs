//! Joints through the emitter and back by the replay: the same places, within the last places.

use machine::gcode::Emitter;
use machine::gcode::dialect::{CARTESIAN, Dialect, POLAR};
use machine::kinematics::Alignment;
use machine::program::{BedTurn, Joints, Move, Step};
use nalgebra::{Point3, Vector2};
use proptest::prelude::*;
use twin::curve::Curve;
use twin::replay::{Event, Replay};
use twin::rounding::{TURN, last_place};
use twin::segment::Segment;

use crate::program::printer;

const LEANING: Alignment = Alignment {
    a: 0.2,
    b: 0.35,
    a1: 0.0015,
    b1: -0.002,
    plate_offset: Vector2::new(0.3, -0.4),
    plate_angle: 0.05,
    ..Alignment::IDEAL
};

fn some_joints() -> impl Strategy<Value = Joints> {
    let rail = prop_oneof![2.0..120.0, -2.5..2.5];
    (rail, -700.0..700.0, 0.0..150.0).prop_map(|(s, turn, z)| Joints {
        s,
        turn: BedTurn::accumulated(turn),
        z,
    })
}

fn replayed(dialect: Dialect, moves: &[(Joints, f64)]) -> Vec<(Joints, Point3<f64>, Segment)> {
    let mut printer = printer();
    printer.alignment = LEANING;
    let mut replay = Replay::new(&printer, dialect);
    let mut from = printer.home;
    let mut out = Vec::new();
    let mut emitter = Emitter::new(Vec::new(), dialect);
    for &(to, filament) in moves {
        let path = Curve::between_joints(&from, &to, &LEANING).length().max(1e-9);
        let at = LEANING.part_from_joints(&to);
        let duration = path / 30.0;
        emitter
            .step(&Step::Move(Move { to, at, filament, path, duration }))
            .expect("memory takes everything");
        from = to;
    }
    let text =
        emitter.finish().ok().and_then(|bytes| String::from_utf8(bytes).ok()).expect("ASCII");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), moves.len());
    for (line, (to, _)) in lines.iter().zip(moves) {
        let Ok(Event::Segment(segment)) = replay.line(line) else { panic!("{line}") };
        out.push((*to, LEANING.part_from_joints(to), segment));
    }
    out
}

proptest! {
    #[test]
    fn polar_words_give_the_joints_back(
        moves in prop::collection::vec((some_joints(), -1.0..1.0), 1..20)
    ) {
        let read = replayed(POLAR, &moves);
        for (to, part, segment) in &read {
            let joints = segment.joints.unwrap()[1];
            let place = last_place(to.s) / 2.0;
            prop_assert!((joints.s - to.s).abs() <= place * (1.0 + 1e-6));
            prop_assert!((joints.turn.radians() - to.turn.radians()).abs() <= TURN * 0.500_1);
            prop_assert!((joints.z - to.z).abs() <= 0.000_5 * (1.0 + 1e-6));
            let off = (segment.part[1] - part).norm();
            prop_assert!(off <= place + 0.000_5 + (to.s.abs() + 1.0) * TURN, "{off}");
        }
        let fed: f64 = read.iter().map(|(_, _, segment)| segment.filament).sum();
        let wanted: f64 = moves.iter().map(|(_, filament)| filament).sum();
        prop_assert!((fed - wanted).abs() < 0.51e-5, "{fed} {wanted}");
    }

    #[test]
    fn cartesian_words_give_the_places_back(
        moves in prop::collection::vec((some_joints(), 0.1..1.0), 1..20)
    ) {
        for (_, part, segment) in replayed(CARTESIAN, &moves) {
            let off = (segment.part[1] - part).abs().max();
            prop_assert!(off <= 0.000_5 * (1.0 + 1e-6), "{off}");
            prop_assert!(segment.joints.is_none());
        }
    }

    #[test]
    fn the_duration_is_that_of_the_program(a in some_joints(), b in some_joints()) {
        let turn = a.turn.nearest(b.turn.radians());
        let read = replayed(POLAR, &[(a, 0.0), (Joints { turn, ..b }, 0.5)]);
        let (_, _, segment) = &read[1];
        let off = (segment.duration * 30.0 / segment.path - 1.0).abs();
        prop_assert!(off < 1e-3, "{off}");
    }
}
