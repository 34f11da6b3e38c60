//! No move asks of an axis what it cannot do, whether the part lies on the axis or beside it.

use crate::program::{LIFT, Motion, RAIL, motions};
use crate::run::sliced;

/// What the axes can do: mm or degrees, and seconds.
struct Limits {
    rail_speed: f64,
    rail_acceleration: f64,
    bed_speed: f64,
    bed_acceleration: f64,
}

/// The printer `generic-polar`.
const GENERIC: Limits = Limits {
    rail_speed: 150.0,
    rail_acceleration: 1500.0,
    bed_speed: 360.0,
    bed_acceleration: 3000.0,
};

const LIFT_SPEED: f64 = 15.0;
const MOVES_PER_SECOND: f64 = 500.0;
const AXIS_CLEARANCE: f64 = 0.02;

/// Share that a figure may be over its limit: sums in floating point, nothing else.
const SLACK: f64 = 1e-6;

#[track_caller]
fn at_most(what: &str, motion: &Motion, value: f64, limit: f64) {
    assert!(value <= limit * (1.0 + SLACK), "line {}: {what} {value}, limit {limit}", motion.line);
}

fn keeps(text: &str, limits: &Limits) {
    let mut before: Option<([f64; 2], f64)> = None;
    let motions = motions(text);
    assert!(motions.len() > 1000, "{} motions are no print", motions.len());
    for motion in &motions {
        let ([s, _, z], duration) = (motion.to, motion.duration());
        assert!((RAIL[0]..=RAIL[1]).contains(&s), "line {}: carriage at {s}", motion.line);
        assert!((0.0..=LIFT).contains(&z), "line {}: lift at {z}", motion.line);
        assert!(duration > 0.0 && duration.is_finite(), "line {}: {duration} s", motion.line);
        let [rail, bed, lift] = [0, 1, 2].map(|k| (motion.to[k] - motion.from[k]) / duration);
        at_most("carriage speed", motion, rail.abs(), limits.rail_speed);
        at_most("bed speed", motion, bed.abs(), limits.bed_speed);
        at_most("lift speed", motion, lift.abs(), LIFT_SPEED);
        at_most("moves a second", motion, 1.0 / duration, MOVES_PER_SECOND);
        // Between the middles of two moves; before the first move everything rests.
        let ([last_rail, last_bed], last_duration) = before.unwrap_or(([0.0; 2], duration));
        let time = f64::midpoint(last_duration, duration);
        let (rail_change, bed_change) = (rail - last_rail, bed - last_bed);
        at_most(
            "carriage acceleration",
            motion,
            rail_change.abs() / time,
            limits.rail_acceleration,
        );
        at_most("bed acceleration", motion, bed_change.abs() / time, limits.bed_acceleration);
        before = Some(([rail, bed], duration));
        passes_the_axis_well(motion);
    }
}

/// Nearer to the axis than the clearance the nozzle only runs straight through it.
fn passes_the_axis_well(motion: &Motion) {
    let (a, b) = (motion.from[0], motion.to[0]);
    let nearest = if a * b <= 0.0 { 0.0 } else { a.abs().min(b.abs()) };
    let turns = (motion.to[1] - motion.from[1]).abs();
    assert!(
        nearest >= AXIS_CLEARANCE || turns == 0.0,
        "line {}: {nearest} mm from the axis the bed turns by {turns} deg",
        motion.line
    );
}

/// Moves shorter than this are noise, mm.
const SHORT_MM: f64 = 0.02;

fn has_few_short_moves(text: &str) {
    let motions = motions(text);
    let moves: Vec<f64> = motions.iter().map(Motion::path).filter(|path| *path > 0.0).collect();
    let short = moves.iter().filter(|path| **path < SHORT_MM).count();
    assert!(short as f64 <= 0.001 * moves.len() as f64, "{short} of {} moves", moves.len());
}

#[test]
fn parts_across_the_axis() {
    for name in ["cube", "gear", "steps", "lens", "wall-0.6"] {
        let text = sliced(name, &[]);
        keeps(&text, &GENERIC);
        has_few_short_moves(&text);
    }
}

#[test]
fn parts_beside_the_axis() {
    for (name, place) in
        [("cube", "60,-20"), ("dome", "16,0.5"), ("gear", "0,40"), ("wall-0.6", "-50,0")]
    {
        let text = sliced(name, &["--place", place]);
        keeps(&text, &GENERIC);
        has_few_short_moves(&text);
    }
}

#[test]
fn a_part_whose_wall_runs_through_the_axis() {
    for place in ["10,0", "9.775,3", "10,10"] {
        keeps(&sliced("cube", &["--place", place]), &GENERIC);
    }
}

#[test]
fn thin_curved_walls_and_overhangs() {
    let coarse = ["--set", "layer_height_mm=0.3"];
    for name in ["vase", "cross", "mushroom"] {
        let text = sliced(name, &coarse);
        keeps(&text, &GENERIC);
        has_few_short_moves(&text);
    }
}

#[test]
fn a_slow_heavy_bed() {
    let limits = Limits { bed_speed: 90.0, bed_acceleration: 400.0, ..GENERIC };
    let set = ["--set", "bed_speed_deg_per_s=90", "--set", "bed_acceleration_deg_per_s2=400"];
    keeps(&sliced("cube", &set), &limits);
}

#[test]
fn a_slow_carriage() {
    let limits = Limits { rail_speed: 20.0, rail_acceleration: 150.0, ..GENERIC };
    let set = ["--set", "rail_speed_mm_per_s=20", "--set", "rail_acceleration_mm_per_s2=150"];
    keeps(&sliced("cube", &set), &limits);
}

/// Far more than the axis needs: lines bend round it in moves as short as the curve asks for.
#[test]
fn a_wide_clearance_is_kept() {
    let text = sliced("cube", &["--set", "axis_clearance_mm=10", "--set", "fill_density=0.1"]);
    for motion in motions(&text).iter().filter(|motion| motion.lays()) {
        let [from, middle, to] = [0.0, 0.5, 1.0].map(|share| motion.at(share));
        let off = |k: usize| middle[k] - (from[k] + to[k]) / 2.0;
        let bow = off(0).hypot(off(1));
        assert!(bow <= 0.05, "line {}: bows by {bow} mm", motion.line);
    }
}
