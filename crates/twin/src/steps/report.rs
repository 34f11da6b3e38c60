//! What the pulses of a program come to.

use super::{Axes, Interval, MOST_AXES};

/// The sums of one motor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motor {
    /// Pulses in either direction.
    pub pulses: u64,
    /// Pulses forwards less those backwards.
    pub net: i64,
    /// Most pulses a second in any interval, as its speed asks for.
    pub rate: f64,
    /// The line with that interval.
    pub rate_line: usize,
    /// Greatest distance from where the axis should be at the end of an interval, in pulses.
    pub error: f64,
}

/// The sums of a program.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Report {
    /// By axis.
    pub motors: [Motor; MOST_AXES],
    /// Intervals.
    pub intervals: usize,
    /// How long they take, s.
    pub time: f64,
}

impl Report {
    /// Adds an interval.
    pub fn add(&mut self, interval: &Interval, axes: &Axes) {
        self.intervals += 1;
        self.time = interval.start + interval.duration;
        for (k, motor) in self.motors.iter_mut().enumerate().take(axes.names.len()) {
            motor.pulses += interval.pulses[k].unsigned_abs();
            motor.net += interval.pulses[k];
            motor.error = motor.error.max(interval.error(axes, k).abs() / axes.steps[k]);
            let rate = interval.rate(axes, k);
            if rate > motor.rate {
                (motor.rate, motor.rate_line) = (rate, interval.line);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steps::count::Counts;

    #[test]
    fn sums_and_peaks() {
        let axes = Axes { names: &["X"], steps: [0.1, 1.0, 1.0, 1.0], turns: [false; MOST_AXES] };
        let mut counts = Counts::new(axes, [0.0; 4]);
        let mut report = Report::default();
        for (line, x, duration) in [(1, 1.04, 0.5), (2, 0.5, 0.01), (3, 0.5, 0.0)] {
            report.add(&counts.go(line, [x, 0.0, 0.0, 0.0], duration), &axes);
        }
        let motor = report.motors[0];
        assert_eq!((motor.pulses, motor.net, motor.rate_line), (15, 5, 2));
        assert!((motor.rate - 540.0).abs() < 1e-9 && (motor.error - 0.4).abs() < 1e-9, "{motor:?}");
        assert!((report.time - 0.51).abs() < 1e-12);
        assert_eq!(report.intervals, 3);
    }
}
