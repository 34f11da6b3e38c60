//! What a program comes to, as the witness counts it.

use machine::program::Role;

use crate::check::head::HeadTotals;
use crate::check::volume::LayerVolume;
use crate::segment::{Kind, Segment};
use crate::thorough::Thorough;

/// Moves shorter than this strain a firmware without changing the part, mm.
pub const SHORT: f64 = 0.02;

/// Moves over which the rate of moves is taken: about what a firmware has in its queue.
pub const BLOCK: usize = 32;

/// The sums of a program. mm, mm³, seconds, radians.
#[derive(Debug, Clone, PartialEq)]
pub struct Totals {
    /// Lines of text.
    pub lines: usize,
    /// How long all motion takes, speeding up and braking as the profile allows, s. Waiting comes on
    /// top.
    pub time: f64,
    /// The durations of all motion at the commanded speeds, s: what a firmware without ramps takes.
    pub commanded_time: f64,
    /// Filament fed, less what was drawn back, mm.
    pub filament: f64,
    /// The volume of that filament, mm³.
    pub volume: f64,
    /// Material laid for each role, mm³.
    pub by_role: [(Role, f64); Role::ALL.len()],
    /// The way of the nozzle over the part without laying material, mm.
    pub travel: f64,
    /// Motion lines.
    pub moves: usize,
    /// Motion lines with a path shorter than [`SHORT`].
    pub short_moves: usize,
    /// How often filament was drawn back.
    pub retractions: usize,
    /// Moves per second where they come fastest, over [`BLOCK`] moves at a time.
    pub moves_per_second: f64,
    /// Turns of the bed, in either direction.
    pub bed_turns: f64,
    /// What each layer holds.
    pub layers: Vec<LayerVolume>,
    /// Greatest mean speed of the bed over a segment, rad/s.
    pub bed_speed: f64,
    /// Greatest mean speed of the carriage over a segment, mm/s.
    pub rail_speed: f64,
    /// Greatest acceleration of the bed between neighbouring segments, less what rounding
    /// explains, rad/s².
    pub bed_acceleration: f64,
    /// The same of the carriage, mm/s².
    pub rail_acceleration: f64,
    /// Greatest distance between an extruding segment and its chord, farther than 1 mm from the
    /// axis, mm.
    pub deviation: f64,
    /// Least distance from the axis, mm; infinite without motion.
    pub nearest_to_axis: f64,
    /// Greatest distance of a bead from the surface of its layer, mm.
    pub surface_residual: f64,
    /// What a head that turns the nozzle did; `None` where it stands upright.
    pub head: Option<HeadTotals>,
    /// What only a thorough proof knows.
    pub thorough: Option<Thorough>,
}

impl Totals {
    /// Returns the share of moves that are shorter than [`SHORT`].
    #[must_use]
    pub fn short_share(&self) -> f64 {
        if self.moves == 0 { 0.0 } else { self.short_moves as f64 / self.moves as f64 }
    }
}

/// Sums that no check keeps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tally {
    pub(crate) time: f64,
    pub(crate) travel: f64,
    pub(crate) moves: usize,
    pub(crate) short_moves: usize,
    pub(crate) bed_turn: f64,
    pub(crate) nearest_to_axis: f64,
    pub(crate) moves_per_second: f64,
    /// When the present block of moves began, s.
    block_began: f64,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            time: 0.0,
            travel: 0.0,
            moves: 0,
            short_moves: 0,
            bed_turn: 0.0,
            nearest_to_axis: f64::INFINITY,
            moves_per_second: 0.0,
            block_began: 0.0,
        }
    }
}

impl Tally {
    pub(crate) fn segment(&mut self, segment: &Segment) {
        self.time += segment.duration;
        self.bed_turn += segment.bed_change().abs();
        match segment.kind() {
            Kind::Still => return,
            Kind::Travel | Kind::Wipe => self.travel += segment.path,
            Kind::Extrusion | Kind::Retraction | Kind::Prime => {}
        }
        self.moves += 1;
        if self.moves.is_multiple_of(BLOCK) {
            let rate = BLOCK as f64 / (self.time - self.block_began);
            self.moves_per_second = self.moves_per_second.max(rate);
            self.block_began = self.time;
        }
        if segment.path > 0.0 {
            self.short_moves += usize::from(segment.path < SHORT);
            self.nearest_to_axis = self.nearest_to_axis.min(segment.nearest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{filament_segment, polar_segment};

    #[test]
    fn moves_are_counted_by_what_they_do() {
        let mut tally = Tally::default();
        let mut line = polar_segment([20.0, 0.0], [20.0, 0.5], 20.0);
        tally.segment(&line);
        line.filament = 0.3;
        tally.segment(&line);
        tally.segment(&polar_segment([20.0, 0.0], [20.01, 0.0], 20.0));
        tally.segment(&filament_segment(-0.8, 8.0));
        tally.segment(&filament_segment(0.0, 8.0));
        assert_eq!((tally.moves, tally.short_moves), (4, 1));
        assert!((tally.travel - 10.01).abs() < 1e-9);
        assert!((tally.time - 1.1005).abs() < 1e-9);
        assert_eq!((tally.bed_turn, tally.nearest_to_axis), (1.0, 20.0));
    }

    #[test]
    fn the_rate_is_that_of_the_fastest_block() {
        let mut tally = Tally::default();
        for k in 0..4 * BLOCK {
            let feed = if k / BLOCK == 2 { 400.0 } else { 100.0 };
            tally.segment(&polar_segment([20.0, 0.0], [21.0, 0.0], feed));
        }
        assert!((tally.moves_per_second - 400.0).abs() < 1e-6);
    }
}
