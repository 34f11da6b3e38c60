//! Strokes that somebody else put in order become timed moves.
//!
//! The same subdivision, axis rules and speed law as for our own layers, for ways that come from
//! elsewhere, such as another slicer's program. Between two calls the machine comes to rest.

use machine::gcode::Dialect;
use machine::kinematics::Unreachable;
use machine::profile::Printer;
use machine::program::Move;

use crate::resample::{FlatLegs, Leg, ResampleParams, Resampler};
use crate::route::Stroke;
use crate::speed::{Limits, Pace, durations, taken, travels};
use crate::time;

/// Follows strokes; remembers where the machine stands. See the [module](self).
#[derive(Debug, Clone)]
pub struct Follower {
    printer: Printer,
    dialect: Dialect,
    resampler: Resampler,
    limits: Limits,
    pace: Pace,
    time: f64,
}

/// The moves of consecutive strokes.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    legs: Vec<Leg>,
    /// How long each takes, s.
    durations: Vec<f64>,
    /// How many moves each stroke has.
    pub counts: Vec<usize>,
}

impl Followed {
    /// Returns the moves in order.
    pub fn moves(&self) -> impl Iterator<Item = Move> {
        self.legs.iter().zip(&self.durations).map(|(leg, &duration)| Move {
            to: leg.to,
            at: leg.at,
            filament: leg.filament,
            path: leg.path,
            duration,
        })
    }
}

/// A stroke that cannot be followed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{source}")]
pub struct FollowError {
    /// Which one, counted from 0 in the call.
    pub stroke: usize,
    /// Why.
    #[source]
    pub source: Unreachable,
}

impl Follower {
    /// Returns a follower for a printer at its home position.
    #[must_use]
    pub fn new(printer: &Printer, params: ResampleParams) -> Self {
        Self {
            printer: printer.clone(),
            dialect: params.dialect.on(printer),
            resampler: Resampler::new(printer, params),
            limits: Limits::of(printer, params.dialect.space),
            pace: Pace::REST,
            time: 0.0,
        }
    }

    /// The machine has been homed by other means.
    pub fn homed(&mut self) {
        self.resampler = self.resampler.at_home(&self.printer);
        self.pace = Pace::REST;
    }

    /// Returns the moves of the strokes.
    ///
    /// # Errors
    ///
    /// [`FollowError`] for the first stroke out of reach.
    pub fn follow(&mut self, strokes: &[Stroke]) -> Result<Followed, FollowError> {
        let start = self.resampler.joints();
        let FlatLegs { legs, counts } = self
            .resampler
            .flat_legs(strokes)
            .map_err(|(stroke, source)| FollowError { stroke, source })?;
        let travels = travels(&legs, start);
        let (times, pace) = durations(&legs, &travels, self.pace, &self.limits);
        self.pace = pace;
        let taken = taken(&legs, start, &times, &self.dialect).times;
        self.time +=
            time::estimate(&legs, &travels, &taken, &self.printer, self.dialect.space, &[]);
        Ok(Followed { legs, durations: times, counts })
    }

    /// Returns the time estimated so far, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::Kind;
    use crate::testing::printer;
    use machine::gcode::dialect::POLAR;
    use nalgebra::Point3;

    const PARAMS: ResampleParams =
        ResampleParams { chord: 0.005, travel_chord: 0.1, dialect: POLAR, azimuth: 0.0 };

    fn print(x: f64, filament: f64) -> Stroke {
        let to = Point3::new(x, 5.0, 0.2);
        Stroke { kind: Kind::Print, to, filament, speed: 40.0, continues: false }
    }

    #[test]
    fn no_filament_is_lost_in_strokes_too_short_to_be_moves() {
        let mut follower = Follower::new(&printer(), PARAMS);
        let travel = Stroke { kind: Kind::Travel, ..print(0.0, 0.0) };
        follower.follow(&[travel]).unwrap();
        let strokes: Vec<Stroke> =
            (1..=1000).map(|k| print(f64::from(k) * 1e-4 + f64::from(k / 50), 0.01)).collect();
        let followed = follower.follow(&strokes).unwrap();
        let fed: f64 = followed.moves().map(|motion| motion.filament).sum();
        assert!((fed + follower.resampler.owed() - 10.0).abs() < 1e-9, "{fed}");
        assert!(followed.counts.contains(&0), "some are too short");
        assert!(follower.time() > 0.4);
    }

    #[test]
    fn what_is_out_of_reach_is_named() {
        let mut follower = Follower::new(&printer(), PARAMS);
        let error = follower.follow(&[print(50.0, 0.0), print(130.0, 1.0)]).unwrap_err();
        assert_eq!(error.stroke, 1);
        assert!(error.to_string().contains("carriage"), "{error}");
    }
}
