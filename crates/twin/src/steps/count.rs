//! The count of one motor, and of all of a machine.

use super::{Axes, Interval, MOST_AXES};

/// Where motors stand, and where they should.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counts {
    axes: Axes,
    at: [f64; MOST_AXES],
    count: [i64; MOST_AXES],
    time: f64,
}

impl Counts {
    /// Returns motors that stand as near to `at` as their steps allow.
    #[must_use]
    pub fn new(axes: Axes, at: [f64; MOST_AXES]) -> Self {
        let mut counts = Self { axes, at, count: [0; MOST_AXES], time: 0.0 };
        counts.stand(at);
        counts
    }

    /// The motors stand at `at` without having been moved there by pulses that count: homing.
    pub fn stand(&mut self, at: [f64; MOST_AXES]) {
        self.at = at;
        self.count = std::array::from_fn(|k| nearest(at[k], self.axes.steps[k]));
    }

    /// Moves to `to` within `duration` s.
    pub fn go(&mut self, line: usize, to: [f64; MOST_AXES], duration: f64) -> Interval {
        let count = std::array::from_fn(|k| nearest(to[k], self.axes.steps[k]));
        let interval = Interval {
            line,
            start: self.time,
            duration,
            from: self.at,
            to,
            count: self.count,
            pulses: std::array::from_fn(|k| count[k] - self.count[k]),
        };
        (self.at, self.count) = (to, count);
        self.time += duration;
        interval
    }

    /// Returns where the axes should be.
    #[must_use]
    pub fn at(&self) -> [f64; MOST_AXES] {
        self.at
    }

    /// Returns where the motors are, in pulses from zero.
    #[must_use]
    pub fn count(&self) -> [i64; MOST_AXES] {
        self.count
    }
}

/// The number of steps that is nearest to a position. What is too far for a number of steps stays at
/// the end of its range.
fn nearest(position: f64, step: f64) -> i64 {
    (position / step).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(step: f64) -> Axes {
        Axes { names: &["X"], steps: [step, 1.0, 1.0, 1.0], turns: [false; MOST_AXES] }
    }

    #[test]
    fn the_error_never_grows_beyond_half_a_step() {
        let axes = axes(1.6);
        let mut counts = Counts::new(axes, [0.0; MOST_AXES]);
        let mut by_differences = 0_i64;
        let mut worst: f64 = 0.0;
        for k in 1..=1000 {
            let x = 0.7 * f64::from(k);
            let interval = counts.go(k as usize, [x, 0.0, 0.0, 0.0], 0.1);
            worst = worst.max(interval.error(&axes, 0).abs());
            by_differences += nearest(0.7, 1.6);
        }
        assert!(worst <= 0.8 + 1e-9 && worst > 0.7, "{worst}");
        // What the rounding of differences comes to: the motor never moves.
        assert_eq!(by_differences, 0);
        assert_eq!(counts.count()[0], 438);
    }

    #[test]
    fn it_is_closed_over_forty_turns() {
        let step = std::f64::consts::TAU / 16_000.0;
        let mut counts = Counts::new(axes(step), [0.0; MOST_AXES]);
        let mut sum = 0;
        for k in 1..=40 * 7 {
            let turn = f64::from(k) * std::f64::consts::TAU / 7.0;
            sum += counts.go(1, [turn, 0.0, 0.0, 0.0], 1.0).pulses[0];
        }
        assert_eq!(sum, 640_000);
        for k in (0..40 * 7).rev() {
            let turn = f64::from(k) * std::f64::consts::TAU / 7.0;
            sum += counts.go(1, [turn, 0.0, 0.0, 0.0], 1.0).pulses[0];
        }
        assert_eq!((sum, counts.count()[0]), (0, 0));
    }
}
