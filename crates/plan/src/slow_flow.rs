//! Where material is laid so slowly that the nozzle oozes and the plastic in it cooks.
//!
//! Near the axis the bed cannot turn fast enough for the speed that is wanted: at a distance `d` a
//! line runs at `d` times the speed of the bed at most. Filament is tied to the way, so its flow falls
//! as well. Lines of infill keep off the axis for that reason; walls cannot. What is left is counted
//! here, and told.

use machine::program::Move;
use nalgebra::Point3;

/// A nozzle that lingers for less does no harm, s: at a tenth of a cubic millimetre a second that is
/// 0.005 mm³, 0.06 mm of a wall.
const SHORTEST_S: f64 = 0.05;

/// What was laid with less flow than is good.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SlowFlow {
    /// How long in all, s.
    pub time: f64,
    /// What length of beads, mm.
    pub length: f64,
    /// In how many places.
    pub places: usize,
    /// The least flow, mm³/s; 0 where there is none.
    pub least: f64,
    /// Where the nozzle was then, in the part, mm.
    pub at: Point3<f64>,
}

impl SlowFlow {
    fn add(&mut self, place: &Self) {
        if self.places == 0 || place.least < self.least {
            (self.least, self.at) = (place.least, place.at);
        }
        self.time += place.time;
        self.length += place.length;
        self.places += 1;
    }
}

/// Looks for slow flow, move after move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowWatch {
    /// mm³/s.
    least: f64,
    /// Cross-section of the filament, mm².
    area: f64,
    /// The place that the nozzle is in, if it is one.
    open: Option<SlowFlow>,
    found: SlowFlow,
}

impl FlowWatch {
    /// Returns a watch for flows below `least`, mm³/s, of filament with this cross-section, mm².
    #[must_use]
    pub fn new(least: f64, area: f64) -> Self {
        Self { least, area, open: None, found: SlowFlow::default() }
    }

    /// Looks at the next move.
    pub fn look(&mut self, motion: &Move) {
        let flow = self.area * motion.filament / motion.duration;
        let lays = motion.path > 0.0 && motion.filament > 0.0 && motion.duration > 0.0;
        if !lays || flow >= self.least {
            self.close();
            return;
        }
        let place =
            self.open.get_or_insert(SlowFlow { least: flow, at: motion.at, ..SlowFlow::default() });
        place.time += motion.duration;
        place.length += motion.path;
        if flow < place.least {
            (place.least, place.at) = (flow, motion.at);
        }
    }

    fn close(&mut self) {
        if let Some(place) = self.open.take().filter(|place| place.time >= SHORTEST_S) {
            self.found.add(&place);
        }
    }

    /// Returns what was found up to here.
    #[must_use]
    pub fn found(mut self) -> SlowFlow {
        self.close();
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::program::{BedTurn, Joints};

    /// A move of 1 mm that lasts so long and lays so much.
    fn motion(x: f64, volume: f64, duration: f64) -> Move {
        Move {
            to: Joints { s: x, turn: BedTurn::default(), z: 0.2 },
            at: Point3::new(x, 0.0, 0.2),
            filament: volume / 2.0,
            path: if volume > 0.0 { 1.0 } else { 0.0 },
            duration,
        }
    }

    #[test]
    fn places_are_stretches_without_a_pause() {
        let mut watch = FlowWatch::new(0.1, 2.0);
        for (x, volume, duration) in [
            (1.0, 0.08, 0.1),
            (2.0, 0.08, 1.0),
            (3.0, 0.08, 2.0),
            (4.0, 0.08, 0.1),
            // A retraction is not slow flow, and parts two places.
            (5.0, 0.08, 1.6),
            (5.0, -0.08, 5.0),
            (6.0, 0.08, 1.0),
            // Over before it matters.
            (7.0, 0.08, 0.1),
            (8.0, 0.0001, 0.04),
        ] {
            watch.look(&motion(x, volume, duration));
        }
        let found = watch.found();
        assert_eq!((found.places, found.length, found.at.x), (3, 4.0, 3.0));
        assert!((found.time - 5.6).abs() < 1e-12 && (found.least - 0.04).abs() < 1e-12);
    }

    #[test]
    fn without_a_bound_nothing_is_slow() {
        let mut watch = FlowWatch::new(0.0, 2.0);
        watch.look(&motion(1.0, 0.001, 100.0));
        assert_eq!(watch.found(), SlowFlow::default());
    }
}
