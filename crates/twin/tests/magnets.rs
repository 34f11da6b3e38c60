//! The search for the centre, end to end on simulated machines.

use machine::calibration::fit::fit;
use machine::calibration::known::Known;
use machine::calibration::scan::{Found, Plan, ScanError, scan};
use machine::calibration::stepwise::{Steps, search};
use nalgebra::Vector2;
use std::f64::consts::FRAC_PI_2;
use twin::magnets::{Chance, Cylinder, Layout, Machine, SimulatedRig};

const TWO_SIDED: Plan = plan([-120.0, 120.0], None);
const INNER: Plan = plan([-40.0, 120.0], Some(20.0));

const fn plan(rail: [f64; 2], inner_radius: Option<f64>) -> Plan {
    let known = Known {
        ring_radius: Some(100.0),
        ring_radius_sd: None,
        magnets: Some(16),
        inner_radius,
        inner_magnets: None,
        inner_angle: None,
        plate_angle: None,
        plate_angle_sd: None,
        index_theta: None,
        bed_is_reversed: false,
        rail_sd: 0.015,
        cross_sd: 0.020,
        placement_sd: 0.050,
    };
    Plan { rail, known }
}

fn random_machine(seed: u64, has_inner: bool, is_spoilt: bool) -> (Machine, Layout) {
    let mut chance = Chance::new(seed);
    let mut one = || chance.uniform(-1.0, 1.0);
    let (a, b, centre, angle) = (one(), one(), Vector2::new(one(), one()), 0.1 * one());
    let inner = if has_inner { vec![[20.0, 0.3], [20.0, 0.3 + FRAC_PI_2]] } else { Vec::new() };
    let mut layout = Layout {
        count: 16,
        radius: 100.0,
        centre,
        angle,
        missing: Vec::new(),
        others: inner,
        placement: 0.05,
    };
    if is_spoilt {
        layout.missing = vec![(seed % 16) as u32, (seed * 7 % 16) as u32];
        layout.others.push([95.0, chance.uniform(0.0, 6.0)]);
    }
    let magnets = layout.magnets(&mut chance);
    (Machine { a, b, magnets, ..Machine::default() }, layout)
}

fn run(machine: &Machine, plan: &Plan, seed: u64) -> (Result<Found, ScanError>, SimulatedRig) {
    let mut rig = SimulatedRig::new(machine.clone(), seed);
    let found = scan(&mut rig, plan, &mut |_, _| true);
    (found, rig)
}

/// Published values, mT, exact to 1e-6.
#[test]
fn the_field_of_a_magnet() {
    let flat = Cylinder { radius: 2.5, length: 3.0, remanence: 1300.0 };
    for (cylinder, distance, field) in [
        (flat, 0.0, 132.118_802_579_437),
        (flat, 1.0, 120.562_894_554_145),
        (flat, 3.0, 50.121_737_355_920),
        (Cylinder::SMALL, 0.0, 80.007_037_487_946),
        (Cylinder::SMALL, 2.0, 43.216_254_562_935),
    ] {
        let off = cylinder.field(2.5, distance) - field;
        assert!(off.abs() < 1e-6, "{cylinder:?} at {distance}: off by {off}");
    }
    // Nothing happens above the rim.
    let [inside, at, outside] =
        [1.5 - 1e-6, 1.5, 1.5 + 1e-6].map(|d| Cylinder::SMALL.field(2.5, d));
    assert!(outside < at && at < inside && inside - outside < 1e-4, "{inside} {at} {outside}");
}

#[test]
fn forty_random_machines_are_calibrated() {
    let mut times = Vec::new();
    for seed in 0..40 {
        let (has_inner, is_spoilt) = (seed % 2 == 1, seed % 4 >= 2);
        let (machine, layout) = random_machine(seed, has_inner, is_spoilt);
        let plan = if has_inner { INNER } else { TWO_SIDED };
        let (found, rig) = run(&machine, &plan, seed);
        let found = found.unwrap_or_else(|error| panic!("machine {seed}: {error}"));
        let (a, b) = (found.fit.a.expect("a").value, found.fit.b.expect("b").value);
        // A carriage that comes from outside stands half its play farther out.
        let a_true = machine.a + machine.rail_play / 2.0;
        assert!((a - a_true).abs() < 0.015, "machine {seed}: a {a}, not {a_true}");
        assert!((b - machine.b).abs() < 0.015, "machine {seed}: b {b}, not {}", machine.b);
        let [ex, ey] = found.fit.centre.expect("a ring");
        let off = (Vector2::new(ex.value, ey.value) - layout.centre).norm();
        assert!(off < 0.08, "machine {seed}: the centre is off by {off}");
        assert!(rig.is_parked());
        times.push(rig.time());
    }
    let longest = times.iter().copied().fold(0.0, f64::max);
    assert!(longest < 900.0, "{longest} s");
}

#[test]
fn failures_are_never_called_success() {
    let (sound, _) = random_machine(1, false, false);
    let (inner, _) = random_machine(1, true, false);
    let fails = |machine: &Machine, plan: &Plan| {
        let (found, rig) = run(machine, plan, 5);
        assert!(rig.is_parked());
        found.expect_err("this machine cannot be calibrated")
    };
    let without = Machine::default();
    assert!(matches!(fails(&without, &TWO_SIDED), ScanError::NoMagnet { .. }));
    let stuck = Machine { is_stuck: true, ..sound.clone() };
    assert!(matches!(fails(&stuck, &TWO_SIDED), ScanError::StuckSensor { .. }));
    let few = Machine { magnets: sound.magnets[..4].to_vec(), ..sound.clone() };
    assert!(matches!(fails(&few, &TWO_SIDED), ScanError::TooFewOnRing { .. }));
    let bent = Machine { b: 2.0, ..sound.clone() };
    assert!(matches!(fails(&bent, &TWO_SIDED), ScanError::RailTooFar { .. }));
    let short = Plan { rail: [0.0, 120.0], ..TWO_SIDED };
    assert!(matches!(fails(&sound, &short), ScanError::OneSided));
    let no_inner = Machine { magnets: inner.magnets[..16].to_vec(), ..inner };
    assert!(matches!(fails(&no_inner, &INNER), ScanError::OneSided));
    let nameless = Plan { known: Known::default(), ..TWO_SIDED };
    assert!(matches!(fails(&sound, &nameless), ScanError::NoDrawing));
}

#[test]
fn lost_steps_are_noticed() {
    let mut n_noticed = 0;
    for after in [5, 12, 20, 30, 40] {
        let (sound, _) = random_machine(3, false, false);
        let slips = Some((after, 0.02));
        let (found, _) = run(&Machine { slips, ..sound.clone() }, &TWO_SIDED, 3);
        match found {
            Err(_) => n_noticed += 1,
            // Before the first magnet a slip is only another zero of the bed.
            Ok(found) => {
                let b = found.fit.b.expect("b").value;
                assert!((b - sound.b).abs() < 0.015, "after {after} sweeps: {b}");
            }
        }
    }
    assert!(n_noticed >= 2, "{n_noticed}");
}

#[test]
fn a_search_stops_on_request_and_parks() {
    let (machine, _) = random_machine(2, false, false);
    let mut rig = SimulatedRig::new(machine, 2);
    let mut calls = 0;
    let found = scan(&mut rig, &TWO_SIDED, &mut |_, _| {
        calls += 1;
        calls < 8
    });
    assert!(matches!(found, Err(ScanError::Rig(_))));
    assert!(rig.is_parked());
}

#[test]
fn the_stepwise_procedure_takes_longer_and_knows_less() {
    let (machine, layout) = random_machine(4, false, false);
    let mut rig = SimulatedRig::new(machine.clone(), 4);
    let steps = Steps { rail: 0.5, bed: 0.1_f64.to_radians(), fires_at: 20.0 };
    let seen = search(&mut rig, &TWO_SIDED, &steps, &mut |_, _| true).expect("magnets are there");
    assert!(seen.len() >= 12, "{}", seen.len());
    assert!(rig.is_parked());
    let known = Known { ring_radius: Some(100.0), magnets: Some(16), ..Known::default() };
    let fitted = fit(&seen, &known).expect("a ring");
    assert!(fitted.b.is_none());
    let [ex, ey] = fitted.centre.expect("a ring");
    let off = (Vector2::new(ex.value, ey.value) - layout.centre).norm();
    assert!(off < 1.0, "{off}");
    let (fast, quick) = run(&machine, &TWO_SIDED, 4);
    assert!(fast.is_ok());
    assert!(quick.n_moves() * 5 < rig.n_moves(), "{} {}", quick.n_moves(), rig.n_moves());
}

#[test]
fn the_field_of_a_magnet_is_that_of_the_published_numbers() {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let shared = manifest.ancestors().nth(3).map(|dir| dir.join("shared/vectors/calibration.json"));
    let Some(text) = shared.and_then(|path| std::fs::read_to_string(path).ok()) else { return };
    let all: serde_json::Value = serde_json::from_str(&text).expect("the vectors are JSON");
    let mut seen = 0;
    for case in all["hall_field"].as_array().expect("a list") {
        if case["kind"] != "cylinder" {
            continue;
        }
        let number = |key: &str| case[key].as_f64().expect("a number");
        let magnet = Cylinder {
            radius: number("radius"),
            length: number("length"),
            remanence: number("Br"),
        };
        let field = magnet.field(number("gap"), number("rho"));
        let wanted = number("Bz");
        assert!((field - wanted).abs() < 1e-4 * wanted, "{field} {case}");
        seen += 1;
    }
    assert!(seen >= 5);
}
