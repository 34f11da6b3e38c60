//! How long the print takes: speeds as the machine will really reach them.
//!
//! Every move accelerates from the speed at which it is entered to the commanded one and brakes to
//! the speed of the next, within what rail, bed and path allow; between two moves each axis may jump
//! by its jerk. Speeds at the joints are found by one pass backwards and one forwards, as firmwares
//! do. Where the words are part coordinates, the two straight axes of such a machine have the limits
//! of the rail.

use machine::gcode::dialect::Space;
use machine::profile::Printer;

use crate::resample::Leg;
use crate::speed::Travel;

/// Returns the time of a run of moves that begins and ends at rest, s; `accelerations` (mm/s²) are those
/// of the nozzle that are wanted in each leg, as far as there are any.
#[must_use]
pub(crate) fn estimate(
    legs: &[Leg],
    travels: &[Travel],
    durations: &[f64],
    printer: &Printer,
    space: Space,
    accelerations: &[f64],
) -> f64 {
    let limits = Limits::of(printer, space);
    let mut before: Option<&Leg> = None;
    let moves: Vec<Ramp> = legs
        .iter()
        .zip(travels)
        .zip(durations)
        .enumerate()
        .map(|(k, ((leg, travel), &duration))| {
            let from = before.replace(leg);
            let axes = match (space, from) {
                (Space::Part, Some(from)) => [leg.at.x - from.at.x, leg.at.y - from.at.y],
                (Space::Part, None) => [0.0; 2],
                (Space::Joints | Space::IdealPlane, _) => travel.axes,
            };
            let wanted = accelerations.get(k).copied().unwrap_or(f64::INFINITY);
            Ramp::new(leg, axes, travel.lift, duration, &limits.gentle(wanted))
        })
        .collect();
    // Square of the speed at which each move is entered; the last entry is the end.
    let mut entries = vec![0.0; moves.len() + 1];
    for i in (1..moves.len()).rev() {
        let junction = moves[i - 1].junction(&moves[i], &limits);
        entries[i] = (junction * junction).min(moves[i].reachable(entries[i + 1]));
    }
    for i in 0..moves.len() {
        entries[i + 1] = entries[i + 1].min(moves[i].reachable(entries[i]));
    }
    moves.iter().zip(entries.windows(2)).map(|(ramp, ends)| ramp.time(ends[0], ends[1])).sum()
}

/// What speeds may do.
struct Limits {
    path: f64,
    lift: f64,
    /// Accelerations of the two axes of the plane.
    axes: [f64; 2],
    /// How much their speeds may change at once.
    jerks: [f64; 2],
}

impl Limits {
    fn of(printer: &Printer, space: Space) -> Self {
        let rail = (printer.rail.acceleration, printer.rail_jerk);
        let other = match space {
            Space::Part => rail,
            Space::Joints | Space::IdealPlane => (printer.bed.acceleration, printer.bed_jerk),
        };
        Self {
            path: printer.path_acceleration,
            lift: printer.lift.acceleration,
            axes: [rail.0, other.0],
            jerks: [rail.1, other.1],
        }
    }
}

impl Limits {
    /// The same where the nozzle is sped up no faster than `path`, mm/s².
    fn gentle(&self, path: f64) -> Self {
        Self { path: self.path.min(path), ..*self }
    }
}

/// A move as one that can be sped up and braked.
struct Ramp {
    /// mm; zero for moves of the filament alone.
    path: f64,
    /// mm/s.
    cruise: f64,
    /// mm/s².
    acceleration: f64,
    /// Rail and bed per mm of path.
    per_mm: [f64; 2],
    duration: f64,
}

impl Ramp {
    fn new(leg: &Leg, axes: [f64; 2], lift: f64, duration: f64, limits: &Limits) -> Self {
        let per_mm = axes.map(|d| if leg.path > 0.0 { d / leg.path } else { 0.0 });
        let lift = if leg.path > 0.0 { lift / leg.path } else { 0.0 };
        let limited = |limit: f64, share: f64| {
            if share == 0.0 { f64::INFINITY } else { limit / share.abs() }
        };
        let acceleration = limits
            .path
            .min(limited(limits.axes[0], per_mm[0]))
            .min(limited(limits.axes[1], per_mm[1]))
            .min(limited(limits.lift, lift));
        Self { path: leg.path, cruise: leg.path / duration, acceleration, per_mm, duration }
    }

    /// The greatest speed at which the next move can be entered.
    fn junction(&self, next: &Self, limits: &Limits) -> f64 {
        let speed = self.cruise.min(next.cruise);
        let jerks = limits.jerks;
        (0..2).fold(speed, |speed, k| {
            let jump = (next.per_mm[k] - self.per_mm[k]).abs();
            if jump * speed > jerks[k] { jerks[k] / jump } else { speed }
        })
    }

    /// The greatest square of the speed at one end of the move, given that at the other.
    fn reachable(&self, square: f64) -> f64 {
        (square + 2.0 * self.acceleration * self.path).min(self.cruise * self.cruise)
    }

    /// Time from end to end, the squares of the speeds there given.
    fn time(&self, entry: f64, exit: f64) -> f64 {
        if self.path == 0.0 {
            return self.duration;
        }
        let (a, v) = (self.acceleration, self.cruise);
        let top = (a * self.path + f64::midpoint(entry, exit)).min(v * v).sqrt();
        let (v0, v1) = (entry.sqrt(), exit.sqrt());
        let ramps = ((top * top - entry) + (top * top - exit)) / (2.0 * a);
        let cruising = (self.path - ramps).max(0.0) / top;
        (top - v0).max(0.0) / a + (top - v1).max(0.0) / a + cruising
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::Kind;
    use crate::testing::printer;
    use machine::program::{BedTurn, Joints};
    use nalgebra::Point3;

    fn radial(lengths: &[f64], speed: f64) -> f64 {
        let (mut s, mut legs, mut travels) = (10.0, Vec::new(), Vec::new());
        for &length in lengths {
            s += length;
            let to = Joints { s, turn: BedTurn::default(), z: 1.0 };
            let at = Point3::new(s, 0.0, 1.0);
            legs.push(Leg { kind: Kind::Print, to, at, filament: 0.1, path: length.abs(), speed });
            travels.push(Travel { axes: [length, 0.0], lift: 0.0 });
        }
        let durations: Vec<f64> = lengths.iter().map(|l| l.abs() / speed).collect();
        estimate(&legs, &travels, &durations, &printer(), Space::Joints, &[])
    }

    #[test]
    fn a_trapezoid_from_rest_to_rest() {
        // 60 mm at 60 mm/s, 1500 mm/s²: 1 s and one ramp of 40 ms.
        assert!((radial(&[60.0], 60.0) - 1.04).abs() < 1e-9);
        // Cut in pieces it takes as long.
        assert!((radial(&[10.0, 20.0, 5.0, 25.0], 60.0) - 1.04).abs() < 1e-9);
    }

    #[test]
    fn a_reversal_costs_a_stop() {
        let there_and_back = radial(&[30.0, -30.0], 60.0);
        let twice = 2.0 * radial(&[30.0], 60.0);
        // All but the jump that the rail's jerk allows.
        assert!(
            there_and_back < twice && there_and_back > twice - 0.02,
            "{there_and_back} {twice}"
        );
    }
}
