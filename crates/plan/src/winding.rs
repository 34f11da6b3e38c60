//! Wires to the bed: how far it may turn from home.
//!
//! The bed takes the shortest way to each line, and loops add up. Before a run of lines that is
//! laid without a break the turn over the whole run is known; where it would pass the bound, the
//! nozzle, drawn back and lifted, lets the bed unwind by whole turns first.

use machine::kinematics::Unreachable;
use std::f64::consts::{PI, TAU};

/// How far a run of lines turns the bed from its begin, radians.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Extent {
    least: f64,
    greatest: f64,
}

/// Returns how far the bed turns along lines between places that have these azimuths, each in the
/// count of the bed, by the shorter way.
pub(crate) fn extent(azimuths: impl Iterator<Item = f64>) -> Extent {
    let mut extent = Extent::default();
    let (mut last, mut turned) = (None, 0.0_f64);
    for azimuth in azimuths {
        let change: f64 = azimuth - last.unwrap_or(azimuth);
        turned += change - (change / TAU).round() * TAU;
        last = Some(azimuth);
        extent.least = extent.least.min(turned);
        extent.greatest = extent.greatest.max(turned);
    }
    extent
}

/// A line past the axis may turn the bed by the other way round; so much is kept in reserve.
const RESERVE: f64 = PI;

/// Returns by how much the bed must turn before the run, a whole number of turns; 0 mostly.
///
/// # Errors
///
/// [`Unreachable::WoundUp`] when the run alone is too long.
pub(crate) fn unwinding(turn: f64, run: &Extent, most: f64) -> Result<f64, Unreachable> {
    let (low, high) = (turn + run.least - RESERVE, turn + run.greatest + RESERVE);
    if -most <= low && high <= most {
        return Ok(0.0);
    }
    // The middle of the run as near to home as whole turns allow.
    let back = -(f64::midpoint(low, high) / TAU).round() * TAU;
    let worst = (low + back).abs().max((high + back).abs());
    if worst > most {
        return Err(Unreachable::WoundUp { turns: worst / TAU, most: most / TAU });
    }
    Ok(back)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_are_unwound_before_the_bound() {
        let most = 3.0 * TAU;
        let loops = |count: i32| extent((0..=8 * count).map(|k| f64::from(k) * TAU / 8.0));
        let mut turn: f64 = 0.0;
        for _ in 0..50 {
            turn += unwinding(turn, &loops(1), most).unwrap() + TAU;
            assert!(turn.abs() <= most, "{turn}");
        }
        assert!(unwinding(0.0, &loops(4), most).is_ok(), "begun two turns back");
        assert!(matches!(
            unwinding(0.0, &loops(7), most),
            Err(Unreachable::WoundUp { most: bound, .. }) if bound == 3.0
        ));
    }

    #[test]
    fn the_extent_counts_both_ways() {
        let there_and_back = [0.0, 1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 0.0, -1.0];
        let extent = extent(there_and_back.into_iter());
        assert_eq!(extent, Extent { least: -1.0, greatest: 4.0 });
    }
}
