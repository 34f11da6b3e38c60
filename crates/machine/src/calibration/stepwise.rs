//! The source's search, for comparison: step by step, one side, to the largest reading.
//!
//! Centring of a cylindrical-coordinate printer (thesis, Kharkiv National University of Radio
//! Electronics): carriage to its end-stop; a step inwards; the bed stepwise through a pitch or until
//! the sensor fires; nothing found, another step inwards; else carriage and bed in turn to the
//! largest reading, which is recorded; so on for all magnets. It takes tens of thousands of moves,
//! the top of the field is flat, so its places are off by up to millimetres, and from one side it
//! cannot see by how much the rail misses the axis.

use super::Sighting;
use super::rig::{Rig, RigError};
use super::scan::{Plan, ScanError, Stage, Watch};
use std::f64::consts::TAU;

/// Steps of the procedure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Of the carriage, mm.
    pub rail: f64,
    /// Of the bed, radians.
    pub bed: f64,
    /// Reading at which the sensor fires.
    pub fires_at: f64,
}

/// How far outside and inside of the drawn ring the search goes, mm.
const SEARCH_MARGIN_MM: f64 = 15.0;

/// Searches, and parks the machine however it ends. Returns one sighting a magnet.
///
/// # Errors
///
/// [`ScanError`]
pub fn search(
    rig: &mut dyn Rig,
    plan: &Plan,
    steps: &Steps,
    watch: Watch<'_>,
) -> Result<Vec<Sighting>, ScanError> {
    let found = run(rig, plan, steps, watch);
    let parked = rig.park();
    let found = found?;
    parked?;
    Ok(found)
}

fn run(
    rig: &mut dyn Rig,
    plan: &Plan,
    steps: &Steps,
    watch: Watch<'_>,
) -> Result<Vec<Sighting>, ScanError> {
    let (Some(radius), Some(count)) = (plan.known.ring_radius, plan.known.magnets) else {
        return Err(ScanError::NoDrawing);
    };
    rig.home()?;
    let pitch = TAU / f64::from(count);
    let (from, to) = (radius + SEARCH_MARGIN_MM, radius - SEARCH_MARGIN_MM);
    let from = from.min(plan.rail[1]);
    let mut at = Sighting::new(from, 0.0);
    let mut found = Vec::new();
    while found.len() < count as usize {
        if !watch(Stage::Search, found.len() as f64 / f64::from(count)) {
            return Err(RigError::Stopped.into());
        }
        let end = at.theta + pitch;
        if fires(rig, &mut at, end, steps)? {
            climb(rig, &mut at, steps)?;
            found.push(at);
            // Past this magnet, where the next one begins.
            at.theta += pitch / 2.0;
            rig.turn_to(at.theta)?;
        } else if at.s - steps.rail >= to {
            at.s -= steps.rail;
            rig.carriage_to(at.s)?;
        } else if found.is_empty() {
            return Err(ScanError::NoMagnet { from, to });
        } else {
            // A missing magnet: on to the next place, from outside.
            at.s = from;
            rig.carriage_to(at.s)?;
            if at.theta > 2.0 * TAU {
                break;
            }
        }
    }
    Ok(found)
}

/// Turns stepwise until the sensor fires, to `end` at most.
fn fires(rig: &mut dyn Rig, at: &mut Sighting, end: f64, steps: &Steps) -> Result<bool, RigError> {
    rig.carriage_to(at.s)?;
    while at.theta < end {
        rig.turn_to(at.theta)?;
        if rig.level()? >= steps.fires_at {
            return Ok(true);
        }
        at.theta += steps.bed;
    }
    Ok(false)
}

/// Carriage and bed in turn, each until the reading grows no more.
fn climb(rig: &mut dyn Rig, at: &mut Sighting, steps: &Steps) -> Result<(), RigError> {
    let mut best = rig.level()?;
    for _ in 0..2 {
        for (ds, dtheta) in
            [(-steps.rail, 0.0), (steps.rail, 0.0), (0.0, steps.bed), (0.0, -steps.bed)]
        {
            loop {
                rig.carriage_to(at.s + ds)?;
                rig.turn_to(at.theta + dtheta)?;
                let level = rig.level()?;
                if level <= best {
                    break;
                }
                best = level;
                at.s += ds;
                at.theta += dtheta;
            }
        }
    }
    rig.carriage_to(at.s)?;
    rig.turn_to(at.theta)
}
