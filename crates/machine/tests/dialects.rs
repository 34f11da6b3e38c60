//! Programs in every dialect: what is written is read back as the same moves.

use machine::gcode::dialect::{ALL, Dialect, RRF_DIRECT, Space};
use machine::gcode::speed_word::{SpeedWord, Way};
use machine::gcode::{Emitter, MOST_COLUMNS, parse_line};
use machine::program::{BedTurn, Joints, Layer, Move, Step};
use nalgebra::Point3;
use proptest::prelude::*;

fn some_joints() -> impl Strategy<Value = Joints> {
    let rail = prop_oneof![2.5..120.0_f64, 0.05..1.9_f64];
    (rail, -3.0..3.0_f64, 0.0..150.0_f64).prop_map(|(s, turn, z)| Joints {
        s,
        turn: BedTurn::accumulated(turn),
        z,
    })
}

/// Moves to these joints, each a short way round, some in `duration` s.
fn steps(dialect: &Dialect, places: &[(Joints, f64, f64)]) -> Vec<Move> {
    let mut last = BedTurn::default();
    places
        .iter()
        .map(|&(to, filament, duration)| {
            let turn = last.nearest(to.turn.radians());
            last = turn;
            let to = dialect.rounded_joints(&Joints { turn, ..to });
            let (sin, cos) = turn.radians().sin_cos();
            let at = Point3::new(to.s * cos, to.s * sin, to.z);
            Move { to, at, filament, path: 10.0, duration }
        })
        .collect()
}

fn text(dialect: Dialect, moves: &[Move]) -> String {
    let mut emitter = Emitter::new(Vec::new(), dialect);
    for motion in moves {
        emitter.step(&Step::Move(*motion)).expect("memory takes everything");
    }
    String::from_utf8(emitter.finish().expect("memory")).expect("ASCII")
}

proptest! {
    #[test]
    fn moves_are_read_back(
        places in prop::collection::vec((some_joints(), -1.0..1.0_f64, 0.01..20.0_f64), 2..20),
        which in 0..ALL.len(),
    ) {
        let dialect = ALL[which];
        let moves = steps(&dialect, &places);
        let text = text(dialect, &moves);
        let mut lines = text.lines().filter(|line| *line != "G93");
        let (mut plane, mut z, mut speed) = ([0.0; 2], 0.0, 0.0);
        let mut from: Option<(Joints, [f64; 2])> = None;
        for motion in &moves {
            let line = lines.next().expect("one line a move");
            prop_assert!(line.len() <= MOST_COLUMNS);
            let command = parse_line(line).expect("it is a command").command.expect("a motion");
            prop_assert!(command.is(b'G', 1));
            for (word, value) in dialect.plane.iter().zip(&mut plane) {
                *value = command.word(word.letter).unwrap_or(*value);
            }
            z = command.word(b'Z').unwrap_or(z);
            speed = command.word(b'F').unwrap_or(speed);
            let near = from.map_or(motion.to.turn, |(joints, _)| joints.turn);
            let Some(joints) = dialect.joints(plane, z, near) else {
                prop_assert!((plane[0] - motion.at.x).abs() < 5.1e-4, "{line}");
                prop_assert!((plane[1] - motion.at.y).abs() < 5.1e-4, "{line}");
                continue;
            };
            // Positions are those of the text already.
            prop_assert!((joints.s - motion.to.s).abs() < 1e-9, "{line} {:?}", motion.to);
            let off = joints.turn.radians() - motion.to.turn.radians();
            prop_assert!(off.abs() * motion.to.s < 1e-9, "{line} {:?}", motion.to);
            if let Some((last, old)) = from {
                let [x, y] = [plane[0] - old[0], plane[1] - old[1]];
                let way = Way {
                    path: motion.path,
                    words: x.hypot(y).hypot(z - last.z),
                    filament: motion.filament,
                    turn: joints.turn.radians() - last.turn.radians(),
                    ends: [old, plane],
                    rise: z - last.z,
                };
                if dialect.speed.sets_the_pace(&way) {
                    from = Some((joints, plane));
                    continue;
                }
                let took = dialect.speed.duration(&way, speed);
                // Rounded down to a tenth of mm/min, a thousandth of that apart, never to nothing.
                let coarse = 1.0 / (1.0 - (0.1 / speed).min(0.5));
                // Marlin has no word for each duration of a line of few pieces: then it is slower.
                let is_exact = !matches!(dialect.speed, SpeedWord::MarlinPolar(_));
                let is_kept = took >= motion.duration * (1.0 - 1e-5 - 1e-4 / speed)
                    && (took <= motion.duration * coarse * (1.0 + 1e-5) || !is_exact);
                prop_assert!(is_kept || speed <= 0.1, "{line}: {took} s, not {}", motion.duration);
            }
            from = Some((joints, plane));
        }
        prop_assert_eq!(lines.next(), None);
    }

    #[test]
    fn the_way_between_begins_and_ends_where_the_move_does(
        (a, b) in (some_joints(), some_joints()),
        which in 0..ALL.len(),
    ) {
        let dialect = ALL[which];
        let b = Joints { turn: a.turn.nearest(b.turn.radians()), ..b };
        for (share, end) in [(0.0, a), (1.0, b)] {
            let joints = dialect.between(&a, &b, share);
            prop_assert!((joints.s - end.s).abs() < 1e-9);
            // A half turn may be taken either way.
            let off = joints.turn.radians() - end.turn.radians();
            prop_assert!(off.sin().abs() * end.s < 1e-6, "{joints:?} {end:?}");
        }
    }
}

#[test]
fn inverse_time_is_said_before_the_first_move_and_taken_back_for_the_owners_lines() {
    let moves = steps(
        &RRF_DIRECT,
        &[
            (Joints { s: 10.0, turn: BedTurn::accumulated(0.5), z: 0.2 }, 0.0, 0.5),
            (Joints { s: 12.0, turn: BedTurn::accumulated(0.6), z: 0.2 }, 0.1, 100.0),
        ],
    );
    let mut emitter = Emitter::new(Vec::new(), RRF_DIRECT);
    for step in [
        Step::Move(moves[0]),
        Step::Custom("M104 S0".into()),
        Step::Move(moves[1]),
        Step::Custom("G1 X100 F3000".into()),
    ] {
        emitter.step(&step).unwrap();
    }
    assert_eq!(
        String::from_utf8(emitter.finish().unwrap()).unwrap(),
        "G93\nG1 X10 C28.6479 Z0.2 F120\nM104 S0\nG1 X12 C34.3775 E0.1 F0.6\nG94\nG1 X100 F3000\n"
    );
}

#[test]
fn the_bed_is_counted_again_before_single_precision_loses_it() {
    let at = |turns: f64| {
        let turn = BedTurn::accumulated(turns * std::f64::consts::TAU);
        let to = Joints { s: 10.0, turn, z: 0.2 };
        Step::Move(Move {
            to,
            at: Point3::new(10.0, 0.0, 0.2),
            filament: 0.0,
            path: 1.0,
            duration: 1.0,
        })
    };
    let layer = Step::Layer(Layer { index: 1, top: 0.4, height: 0.2 });
    let mut emitter = Emitter::new(Vec::new(), RRF_DIRECT);
    for step in [at(91.0), layer.clone(), at(91.25), layer, at(91.5)] {
        emitter.step(&step).unwrap();
    }
    let text = String::from_utf8(emitter.finish().unwrap()).unwrap();
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('G')).collect();
    assert_eq!(
        lines,
        ["G93", "G1 X10 C32760 Z0.2 F60", "G1 X10 C32850 F60", "G92 C90", "G1 X10 C180 F60"]
    );
}

#[test]
fn the_last_lift_is_hidden_from_those_who_look_for_the_height() {
    let mut emitter = Emitter::new(Vec::new(), machine::gcode::dialect::POLAR);
    let to = |z: f64| {
        let to = Joints { s: 10.0, turn: BedTurn::default(), z };
        Step::Move(Move {
            to,
            at: Point3::new(10.0, 0.0, z),
            filament: 0.0,
            path: 1.0,
            duration: 1.0,
        })
    };
    emitter.step(&to(4.0)).unwrap();
    emitter.leave_part();
    emitter.step(&to(9.0)).unwrap();
    let text = String::from_utf8(emitter.finish().unwrap()).unwrap();
    assert_eq!(text, "G1 R10 T0 Z4 F60\nG1 Z9 ;E\n");
}

#[test]
fn only_words_of_joints_reach_the_far_side() {
    for dialect in ALL {
        assert_eq!(Dialect::by_name(dialect.name), Some(dialect));
        assert_eq!(dialect.reaches_far_side(), dialect.space == Space::Joints);
    }
}
