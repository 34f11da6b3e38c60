//! How far the last places of the text can bend what is measured.
//!
//! A program's numbers are rounded: lengths to 0.001 mm, to 0.00001 mm within 2 mm of the axis,
//! bed angles to 0.0001°, the speed word `F` to 0.1 mm/min. A move of 0.02 mm read back is up to
//! 5 % longer or shorter than it was meant, hence done in another time, hence at other speeds. A
//! limit that was kept exactly must not be called broken for that, so every check of a speed or an
//! acceleration allows what rounding alone can do, and no more.
//!
//! Each end of a move is off by at most half a last place; a difference by one. The length follows
//! to first order through its derivatives, plus a quadratic remainder for moves about as short as
//! the last place itself. mm, radians, seconds.

use crate::segment::Segment;

/// The last place of a length, mm.
pub const LENGTH: f64 = 1e-3;

/// The last place of a length near the axis, mm.
pub const LENGTH_NEAR_AXIS: f64 = 1e-5;

/// Nearer to the axis than this lengths have the finer last place, mm.
pub const NEAR_AXIS: f64 = 2.0;

/// The last place of a bed angle, 0.0001° in radians.
pub const TURN: f64 = 1e-4 * std::f64::consts::PI / 180.0;

/// The last place of a speed word, 0.1 mm/min in mm/s.
pub const FEED: f64 = 0.1 / 60.0;

/// A nozzle no farther than this from its layer's height is in the layer's plane, mm: both are
/// rounded, each by half a last place, and may be rounded apart by one more.
pub const IN_PLANE: f64 = 1.5 * LENGTH;

/// What the arithmetic of the witness itself can be off by, as a share. Measured: 1e-12.
const ARITHMETIC: f64 = 1e-9;

/// How far off the numbers of one segment can be for rounding alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    /// The turn of the bed, radians.
    pub turn: f64,
    /// The way of the carriage, mm.
    pub rail: f64,
    /// The rise of the nozzle, mm.
    pub lift: f64,
    /// The duration, as a share of it.
    pub duration: f64,
}

impl Doubt {
    /// Returns what rounding can have done to a segment.
    #[must_use]
    pub fn of(segment: &Segment) -> Self {
        let rail = match segment.joints {
            Some([from, to]) => (last_place(from.s) + last_place(to.s)) / 2.0,
            None => last_place(segment.curve.radius(0.0).min(segment.curve.radius(1.0))),
        };
        let turn = if segment.joints.is_some() { TURN } else { 0.0 };
        let feed = segment.feed.in_mm_per_s();
        let of_feed = if feed > 0.0 { FEED / feed } else { 0.0 };
        let of_path =
            if segment.path > 0.0 { path_doubt(segment, rail, turn) / segment.path } else { 0.0 };
        Self { turn, rail, lift: LENGTH, duration: of_path + of_feed + ARITHMETIC }
    }

    /// Returns how far a mean speed `change / duration` can be off, when `change` itself is off by
    /// up to `last_place`.
    #[must_use]
    pub fn of_speed(&self, change: f64, last_place: f64, duration: f64) -> f64 {
        (change.abs() * self.duration + last_place) / duration
    }
}

/// Returns the last place of a length at this distance from the axis, mm.
#[must_use]
pub fn last_place(distance_from_axis: f64) -> f64 {
    if distance_from_axis.abs() < NEAR_AXIS { LENGTH_NEAR_AXIS } else { LENGTH }
}

/// Returns how far the length of the path can be off, mm.
fn path_doubt(segment: &Segment, rail: f64, turn: f64) -> f64 {
    if segment.joints.is_none() {
        return 2.0 * rail + LENGTH * (segment.lift_change() / segment.path).abs();
    }
    let radius = segment.curve.radius(0.0).max(segment.curve.radius(1.0));
    let arc = (radius * segment.bed_change()).abs();
    let share = |way: f64| (way.abs() / segment.path).min(1.0);
    let directed = rail * share(segment.rail_change())
        + turn * radius * share(arc)
        + LENGTH * share(segment.lift_change());
    let radial = rail / 2.0 * segment.bed_change().abs();
    let whole = rail + turn * radius + LENGTH * share(segment.lift_change());
    directed + radial + whole * whole / (2.0 * segment.path.max(whole))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{polar_segment, rounded};

    #[test]
    fn the_length_of_rounded_moves_stays_within_the_doubt() {
        let mut tightest: f64 = 0.0;
        for i in 0..20_000_u32 {
            let t = f64::from(i);
            let part = |share: f64| (t * share).fract();
            let s = 0.6 + 90.0 * part(0.618) * part(0.31);
            let size = 10.0_f64.powf(part(0.23) * 4.0 - 3.0);
            let angle = part(0.71) * 6.3;
            let exact = [[s, part(0.11) * 9.0], [s + size * angle.cos(), size * angle.sin() / s]];
            let exact = [exact[0], [exact[1][0], exact[1][1] + exact[0][1]]];
            let truth = polar_segment(exact[0], exact[1], 30.0);
            let read = polar_segment(rounded(exact[0]), rounded(exact[1]), 30.0);
            if read.path == 0.0 {
                continue;
            }
            let off = (read.duration - truth.duration).abs() / read.duration;
            let doubt = Doubt::of(&read).duration;
            assert!(off <= doubt * (1.0 + 1e-9), "{exact:?}: {off} {doubt}");
            tightest = tightest.max(off / doubt);
        }
        assert!(tightest > 0.5, "too much is forgiven: {tightest}");
    }

    #[test]
    fn a_long_move_has_little_doubt() {
        let segment = polar_segment([20.0, 0.0], [20.0, 0.5], 20.0);
        let doubt = Doubt::of(&segment);
        assert!(doubt.duration < 3e-4, "{doubt:?}");
        let speed = doubt.of_speed(segment.bed_change(), doubt.turn, segment.duration);
        assert!(speed < 3e-4, "{speed}");
    }
}
