//! What is written as text and read again is the same program, but for the last decimal place.

use machine::gcode::dialect::{CARTESIAN, Dialect, POLAR, Space};
use machine::gcode::{Emitter, parse_line};
use machine::program::{BedTurn, Joints, Layer, Move, Role, Step};
use nalgebra::Point3;
use proptest::prelude::*;

/// Half a last place, with room for the last bit.
const HALF: f64 = 0.500_001;

fn motion() -> impl Strategy<Value = Step> {
    let place = (-120.0..120.0_f64, -40_000.0..40_000.0_f64, 0.0..200.0_f64);
    let near = (-2.0..2.0_f64, -400.0..400.0_f64, 0.0..1.0_f64);
    (prop_oneof![place, near], -0.8..0.5_f64, 0.001..200.0_f64, 0.002..9.0_f64).prop_map(
        |((s, degrees, z), filament, path, duration)| {
            let turn = BedTurn::accumulated(degrees.to_radians());
            let (sin, cos) = turn.radians().sin_cos();
            let at = Point3::new(s * cos, s * sin, z);
            Step::Move(Move { to: Joints { s, turn, z }, at, filament, path, duration })
        },
    )
}

fn filament_alone() -> impl Strategy<Value = f64> {
    prop_oneof![-5.0..-0.01_f64, 0.01..5.0_f64]
}

fn other() -> impl Strategy<Value = Step> {
    let role = (0..Role::ALL.len()).prop_map(|k| Role::ALL[k]);
    prop_oneof![
        (role, 0.05..2.0_f64).prop_map(|(role, width)| Step::Bead(role, width)),
        (0.0..=1.0_f64).prop_map(Step::Fan),
        (0..100_usize, 0.2..200.0_f64, 0.05..0.5_f64)
            .prop_map(|(index, top, height)| Step::Layer(Layer { index, top, height })),
        "[ -~]{0,40}".prop_map(Step::Remark),
    ]
}

/// Steps in which a move of the filament alone keeps the place.
fn program() -> impl Strategy<Value = Vec<Step>> {
    let any = prop_oneof![
        6 => motion().prop_map(|step| vec![step]),
        1 => (motion(), filament_alone()).prop_map(|(step, filament)| {
            let Step::Move(first) = step else { unreachable!("motions are moves") };
            let alone = Move { filament, path: 0.0, duration: 0.1, ..first };
            vec![Step::Move(first), Step::Move(alone)]
        }),
        1 => other().prop_map(|step| vec![step]),
    ];
    prop::collection::vec(any, 1..60).prop_map(|steps| steps.concat())
}

fn text(dialect: Dialect, steps: &[Step]) -> String {
    let mut emitter = Emitter::new(Vec::new(), dialect);
    for step in steps {
        emitter.step(step).unwrap();
    }
    String::from_utf8(emitter.finish().unwrap()).unwrap()
}

/// The numbers that a reader of the text keeps in mind: the plane's two words, z and F.
#[derive(Clone, Copy)]
struct Modal {
    plane: [f64; 2],
    z: f64,
    feed: f64,
}

/// A `G1` as it is read: where it ends, and its filament.
fn read(text: &str, dialect: &Dialect) -> Vec<(Modal, f64)> {
    let mut now = Modal { plane: [f64::NAN; 2], z: f64::NAN, feed: f64::NAN };
    let mut motions = Vec::new();
    for line in text.lines() {
        let Some(command) = parse_line(line).unwrap().command else { continue };
        if !command.is(b'G', 1) {
            continue;
        }
        for k in 0..2 {
            now.plane[k] = command.word(dialect.plane[k].letter).unwrap_or(now.plane[k]);
        }
        now.z = command.word(b'Z').unwrap_or(now.z);
        now.feed = command.word(b'F').unwrap_or(now.feed);
        motions.push((now, command.word(b'E').unwrap_or(0.0)));
    }
    motions
}

fn same_place(modal: &Modal, wanted: &Move, dialect: &Dialect) -> Result<(), TestCaseError> {
    prop_assert!((modal.z - wanted.to.z).abs() <= HALF * 1e-3);
    let from_axis = match dialect.space {
        Space::Joints | Space::IdealPlane => wanted.to.s.abs(),
        Space::Part => wanted.at.xy().coords.norm(),
    };
    let places = if from_axis < 2.0 { 1e-5 } else { 1e-3 };
    match dialect.joints(modal.plane, modal.z, wanted.to.turn) {
        Some(joints) => {
            prop_assert!((joints.s - wanted.to.s).abs() <= HALF * places);
            let turn = joints.turn.radians() - wanted.to.turn.radians();
            prop_assert!(turn.to_degrees().abs() <= HALF * 1e-4);
            // The planner times moves by what the text will say: that must be the very same.
            let rounded = dialect.rounded_joints(&wanted.to);
            prop_assert_eq!((rounded.s, rounded.z), (joints.s, joints.z));
            prop_assert!((rounded.turn.radians() - joints.turn.radians()).abs() < 1e-12);
        }
        None => {
            let [x, y] = modal.plane;
            prop_assert!((x - wanted.at.x).abs() <= HALF * places, "{x} {}", wanted.at.x);
            prop_assert!((y - wanted.at.y).abs() <= HALF * places, "{y} {}", wanted.at.y);
            let rounded = dialect.rounded_point(&wanted.at);
            prop_assert_eq!((rounded.x, rounded.y, rounded.z), (x, y, modal.z));
        }
    }
    Ok(())
}

fn is_read_as_written(steps: &[Step], dialect: &Dialect) -> Result<(), TestCaseError> {
    let moves: Vec<&Move> = steps
        .iter()
        .filter_map(|step| match step {
            Step::Move(motion) => Some(motion),
            _ => None,
        })
        .collect();
    let motions = read(&text(*dialect, steps), dialect);
    prop_assert_eq!(motions.len(), moves.len(), "random places are never twice the same");
    let (mut wanted_filament, mut filament) = (0.0, 0.0);
    for ((modal, e), wanted) in motions.iter().zip(&moves) {
        same_place(modal, wanted, dialect)?;
        wanted_filament += wanted.filament;
        filament += e;
        // What one move loses by rounding the next one makes good.
        prop_assert!((filament - wanted_filament).abs() <= HALF * 1e-5 + 1e-9);
        let feed = wanted.feed().word();
        // Rounded down, and never to nothing.
        let slowest = (feed - 0.1 - 1e-9).max(0.1);
        prop_assert!(slowest <= modal.feed && modal.feed <= feed.max(0.1) + 1e-3, "{feed}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn moves_are_read_as_they_were_written(steps in program()) {
        for dialect in &[POLAR, CARTESIAN] {
            is_read_as_written(&steps, dialect)?;
        }
    }

    #[test]
    fn roles_layers_and_fan_are_read_as_they_were_written(step in other()) {
        let text = text(POLAR, std::slice::from_ref(&step));
        let has = |line: &str| text.lines().any(|l| l == line);
        match step {
            Step::Bead(role, width) => {
                let said = text.lines().find_map(|line| line.strip_prefix(";TYPE:")).unwrap();
                prop_assert_eq!(Role::from_label(said), Some(role));
                let said = text.lines().find_map(|line| line.strip_prefix(";WIDTH:")).unwrap();
                prop_assert!((said.parse::<f64>().unwrap() - width).abs() <= HALF * 1e-2);
            }
            Step::Layer(layer) => {
                let layer_line = format!(";LAYER:{}", layer.index);
                prop_assert!(has(";LAYER_CHANGE") && has(&layer_line));
                let said = text.lines().find_map(|line| line.strip_prefix(";Z:")).unwrap();
                prop_assert!((said.parse::<f64>().unwrap() - layer.top).abs() <= HALF * 1e-3);
            }
            Step::Fan(share) => {
                let command = parse_line(text.trim_end()).unwrap().command.unwrap();
                let speed = if command.is(b'M', 107) { 0.0 } else { command.word(b'S').unwrap() };
                prop_assert!((speed / 255.0 - share).abs() <= HALF / 255.0);
            }
            _ => prop_assert!(text.lines().all(|line| line.starts_with(';'))),
        }
    }

    #[test]
    fn nothing_that_is_read_makes_it_panic(line in "\\PC{0,60}") {
        let _ = parse_line(&line);
    }
}
