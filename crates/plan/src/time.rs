//! How long the print takes: speeds as the machine will really reach them.
//!
//! Every move accelerates from the speed at which it is entered to the commanded one and brakes to
//! the speed of the next, within what rail, bed and path allow; between two moves each axis may jump
//! by its jerk. Speeds at the joints are found by one pass backwards and one forwards, as firmwares
//! do.

use machine::profile::Printer;

use crate::resample::Leg;
use crate::speed::Travel;

/// Returns the time of a run of moves that begins and ends at rest, s.
#[must_use]
pub(crate) fn estimate(
    legs: &[Leg],
    travels: &[Travel],
    durations: &[f64],
    printer: &Printer,
) -> f64 {
    let moves: Vec<Ramp> = legs
        .iter()
        .zip(travels)
        .zip(durations)
        .map(|((leg, travel), &duration)| Ramp::new(leg, travel, duration, printer))
        .collect();
    // Square of the speed at which each move is entered; the last entry is the end.
    let mut entries = vec![0.0; moves.len() + 1];
    for i in (1..moves.len()).rev() {
        let junction = moves[i - 1].junction(&moves[i], printer);
        entries[i] = (junction * junction).min(moves[i].reachable(entries[i + 1]));
    }
    for i in 0..moves.len() {
        entries[i + 1] = entries[i + 1].min(moves[i].reachable(entries[i]));
    }
    moves.iter().zip(entries.windows(2)).map(|(ramp, ends)| ramp.time(ends[0], ends[1])).sum()
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
    fn new(leg: &Leg, travel: &Travel, duration: f64, printer: &Printer) -> Self {
        let per_mm = travel.axes.map(|d| if leg.path > 0.0 { d / leg.path } else { 0.0 });
        let lift = if leg.path > 0.0 { travel.lift / leg.path } else { 0.0 };
        let limited = |limit: f64, share: f64| {
            if share == 0.0 { f64::INFINITY } else { limit / share.abs() }
        };
        let acceleration = printer
            .path_acceleration
            .min(limited(printer.rail.acceleration, per_mm[0]))
            .min(limited(printer.bed.acceleration, per_mm[1]))
            .min(limited(printer.lift.acceleration, lift));
        Self { path: leg.path, cruise: leg.path / duration, acceleration, per_mm, duration }
    }

    /// The greatest speed at which the next move can be entered.
    fn junction(&self, next: &Self, printer: &Printer) -> f64 {
        let speed = self.cruise.min(next.cruise);
        let jerks = [printer.rail_jerk, printer.bed_jerk];
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
        estimate(&legs, &travels, &durations, &printer())
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
