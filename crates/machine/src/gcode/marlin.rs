//! What Marlin makes of `F` on a polar machine.
//!
//! Its kinematics cuts a line into pieces of equal length, 180 in a second and none shorter than
//! 0.5 mm. Its planner then changes the speed of every piece that turns the bed:
//!
//! * A piece that ends within `POLAR_FAST_RADIUS` (3 mm) of the axis runs as fast as the axes can,
//!   whatever `F` says: the bed's greatest speed, degrees taken for millimetres, is its speed, and no
//!   axis may exceed its own.
//! * Of all others the speed is multiplied by `1 + n·R/r`. `R` is `PRINTABLE_RADIUS`, `r` where the
//!   piece ends, and `n = 1 − |atan2(dr, |dr|·dθ)|/90°`, that is `n = 2/π·atan(dθ)`, and `n = 1`
//!   where `r` does not change at all, in single precision.
//!
//! Acceleration and sudden changes are kept by the firmware itself, in carriage and bed; so it is
//! safe, but not to be slowed, within the fast radius.
//!
//! Source: `polar.cpp`, `motion.cpp` and `planner.cpp` of Marlin 2.1.3, `FEEDRATE_SCALING`.

use std::f64::consts::FRAC_2_PI;

use super::speed_word::Way;
use crate::profile::Printer;

/// How a build of Marlin is set up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marlin {
    /// `PRINTABLE_RADIUS`, mm.
    pub printable_radius: f64,
    /// `DEFAULT_MAX_FEEDRATE` of the bed, rad/s.
    pub bed_speed: f64,
    /// Of the carriage, mm/s.
    pub rail_speed: f64,
    /// Of the lift, mm/s.
    pub lift_speed: f64,
    /// Of the filament, mm/s.
    pub extruder_speed: f64,
}

/// `POLAR_FAST_RADIUS`, mm.
const FAST_RADIUS_MM: f64 = 3.0;

/// `POLAR_MIN_SEGMENT_LENGTH`, mm.
const LEAST_PIECE_MM: f64 = 0.5;

/// `DEFAULT_SEGMENTS_PER_SECOND`.
const PIECES_PER_SECOND: f64 = 180.0;

/// How much lower a speed is written that must not be exceeded, as a share: what rounding to a tenth of
/// mm/min and single precision may do to fast ones.
const ROUNDING: f64 = 1e-5;

/// How long a line takes: `words / F`, and what is beyond the reach of `F`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Law {
    /// Way of the pieces that obey `F`, each divided by its factor, mm.
    words: f64,
    /// How many of all pieces that are, as a share.
    obeying: f64,
    /// Time of the others, s.
    fixed: f64,
}

impl Marlin {
    /// The machine of its example configuration.
    pub(super) const EXAMPLE: Self = Self {
        printable_radius: 82.0,
        bed_speed: 2.0 * std::f64::consts::FRAC_PI_3,
        rail_speed: 150.0,
        lift_speed: 15.0,
        extruder_speed: 120.0,
    };

    /// Returns the firmware as it is set up for a printer.
    pub(super) fn of(printer: &Printer) -> Self {
        Self {
            printable_radius: printer.rail.max,
            bed_speed: printer.bed.speed,
            rail_speed: printer.rail.speed,
            lift_speed: printer.lift.speed,
            extruder_speed: printer.extruder_speed,
        }
    }

    /// Returns the speed to be written for a line that should last `duration` s, mm/s. Of a line
    /// within the fast radius it is the speed that is wanted, for what that is worth.
    pub(super) fn speed(&self, way: &Way, duration: f64) -> f64 {
        let most = most_pieces(way);
        // Factors only slow down, so that at least this many pieces are made.
        let fewest = pieces(way, way.words / duration);
        for count in fewest..=most {
            let law = self.law(way, count);
            if law.obeying == 0.0 {
                break;
            }
            // No faster than lines that have so many pieces.
            let highest = match count {
                1 => f64::INFINITY,
                _ => PIECES_PER_SECOND * way.words / f64::from(count) * (1.0 - ROUNDING),
            };
            let speed = (law.words / (duration * law.obeying)).min(highest);
            if pieces(way, speed) == count {
                return speed;
            }
        }
        way.words / duration
    }

    /// Returns how long a line at this speed (mm/s) takes, s.
    pub(super) fn duration(&self, way: &Way, speed: f64) -> f64 {
        let law = self.law(way, pieces(way, speed));
        law.words / speed + law.fixed
    }

    /// Returns whether some of a line runs at a speed that is not in its words.
    pub(super) fn sets_the_pace(&self, way: &Way) -> bool {
        let near = |[x, y]: [f64; 2]| x.hypot(y) <= FAST_RADIUS_MM;
        // The ends of pieces lie on the line.
        let [from, to] = way.ends;
        let foot = geom::polyline::distance_to_segment(
            &from.into(),
            &to.into(),
            &nalgebra::Point2::origin(),
        );
        way.turn != 0.0
            && foot <= FAST_RADIUS_MM
            && (near(to) || self.law(way, most_pieces(way)).obeying < 1.0)
    }

    fn law(&self, way: &Way, count: u32) -> Law {
        let share = 1.0 / f64::from(count);
        let [from, to] = way.ends;
        let at = |k: u32| {
            let done = f64::from(k) * share;
            [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * done)
        };
        let mut law = Law::default();
        for k in 0..count {
            let piece = Piece::between(at(k), at(k + 1));
            let length = way.words * share;
            if piece.turn == 0.0 {
                law.words += length;
                law.obeying += share;
            } else if piece.radius <= FAST_RADIUS_MM {
                law.fixed += self.fastest(&piece, way, share);
            } else {
                law.words += length / self.factor(&piece);
                law.obeying += share;
            }
        }
        law
    }

    /// How long a piece takes within the fast radius, s.
    fn fastest(&self, piece: &Piece, way: &Way, share: f64) -> f64 {
        let degrees_as_mm = self.bed_speed.to_degrees();
        (way.words * share / degrees_as_mm)
            .max(piece.turn / self.bed_speed)
            .max(piece.run / self.rail_speed)
            .max(way.rise.abs() * share / self.lift_speed)
            .max(way.filament.abs() * share / self.extruder_speed)
    }

    fn factor(&self, piece: &Piece) -> f64 {
        let n = if piece.keeps_radius { 1.0 } else { FRAC_2_PI * piece.turn.atan() };
        1.0 + self.printable_radius / piece.radius * n
    }
}

/// A piece of a line as the planner sees it.
struct Piece {
    /// Distance of its end from the axis, mm.
    radius: f64,
    /// How far the carriage runs, mm.
    run: f64,
    /// How far the bed turns, radians.
    turn: f64,
    /// Whether both ends are equally far from the axis, to the firmware's precision.
    keeps_radius: bool,
}

impl Piece {
    fn between(from: [f64; 2], to: [f64; 2]) -> Self {
        let (cross, dot) = (from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
        let radius = to[0].hypot(to[1]);
        Self {
            radius,
            run: (radius - from[0].hypot(from[1])).abs(),
            turn: cross.atan2(dot).abs(),
            keeps_radius: single(from) == single(to),
        }
    }
}

/// The distance from the axis in single precision.
fn single([x, y]: [f64; 2]) -> f32 {
    let (x, y) = (x as f32, y as f32);
    (x * x + y * y).sqrt()
}

/// The pieces of a slow line.
fn most_pieces(way: &Way) -> u32 {
    (way.words / LEAST_PIECE_MM).clamp(1.0, f64::from(u16::MAX)) as u32
}

/// The pieces of a line at this speed, mm/s.
fn pieces(way: &Way, speed: f64) -> u32 {
    let in_time = (PIECES_PER_SECOND * way.words / speed).clamp(1.0, f64::from(u16::MAX)) as u32;
    most_pieces(way).min(in_time)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARLIN: Marlin = Marlin::EXAMPLE;

    fn way(from: [f64; 2], to: [f64; 2]) -> Way {
        let piece = Piece::between(from, to);
        let words = (to[0] - from[0]).hypot(to[1] - from[1]);
        Way { path: words, words, filament: 0.0, turn: piece.turn, ends: [from, to], rise: 0.0 }
    }

    #[test]
    fn the_word_means_the_duration_wherever_it_is_obeyed() {
        for (from, to) in [
            ([20.0, 0.0], [20.0, 0.4]),
            ([20.0, 0.0], [-8.0, 31.0]),
            ([3.5, 0.1], [9.0, 0.4]),
            ([60.0, -20.0], [60.0, 20.0]),
        ] {
            let way = way(from, to);
            for speed in [2.0, 30.0, 89.0, 150.0] {
                let wanted = way.words / speed;
                let took = MARLIN.duration(&way, MARLIN.speed(&way, wanted));
                // Fast lines have fewer pieces, and their number need not fit any word exactly.
                let room = if speed < 90.0 { 1e-9 } else { 0.05 };
                assert!((took / wanted - 1.0).abs() <= room, "{from:?} {to:?} {speed}: {took}");
            }
        }
    }

    #[test]
    fn no_word_makes_a_line_faster_than_wanted() {
        // 128 mm in a hundredth of a second: one piece would be too fast, and two are just not made.
        let way = way([75.216, 0.0], [-9.079, -96.523]);
        for wanted in [0.01, 0.02, 0.05, 0.3, 1.0, 10.0] {
            let word = (MARLIN.speed(&way, wanted) * 600.0).floor() / 600.0;
            let took = MARLIN.duration(&way, word);
            assert!(took >= wanted * (1.0 - 1e-5), "{took} s, not {wanted}");
        }
    }

    #[test]
    fn the_factor_is_that_of_the_source() {
        // One piece of 0.4 mm at 20 mm: dθ = 0.02 rad, n = 0.012 73, 1 + n·82/20 = 1.052 2.
        let one = way([20.0, 0.0], [20.0, 0.4]);
        assert!((30.0 / MARLIN.speed(&one, one.words / 30.0) - 1.0522).abs() < 1e-3);
        // Both ends at the same radius: n = 1, 1 + 82/20 = 5.1.
        let level = way([20.0, -0.2], [20.0, 0.2]);
        assert!((30.0 / MARLIN.speed(&level, level.words / 30.0) - 5.1).abs() < 1e-2);
    }

    #[test]
    fn near_the_axis_the_bed_runs_at_its_limit_whatever_is_written() {
        let near = way([2.0, 0.0], [2.0, 0.3]);
        assert!(MARLIN.sets_the_pace(&near));
        let turn = (0.3_f64 / 2.0).atan();
        for speed in [0.1, 5.0, 500.0] {
            assert!((MARLIN.duration(&near, speed) - turn / MARLIN.bed_speed).abs() < 1e-12);
        }
        // What is written is what is wanted, for those who take it at its word.
        assert_eq!(MARLIN.speed(&near, 0.1), near.words / 0.1);
        assert!(!MARLIN.sets_the_pace(&way([3.1, 0.0], [3.1, 0.3])));
        assert!(MARLIN.sets_the_pace(&way([-9.0, 1.0], [9.0, 1.0])));
        assert!(!MARLIN.sets_the_pace(&way([-9.0, 4.0], [9.0, 4.0])));
    }
}
