//! Lengths as whole increments of the machine.

use super::ScheduleParams;

/// How many heights there may be between the limits of a layer: guards the arithmetic against
/// nonsense; real machines have some hundred.
const MOST_HEIGHTS: f64 = 1e6;

/// The increment and the limits of heights in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Increments {
    /// One increment, mm.
    pub size: f64,
    /// Thinnest layer, in increments; at least 1.
    pub least: u32,
    /// Thickest layer, in increments; at least the thinnest.
    pub greatest: u32,
}

impl Increments {
    /// Returns the heights that lie within the limits.
    #[must_use]
    pub fn of(params: &ScheduleParams) -> Self {
        // 0.3 / 0.01 is 29.999999999999996: a limit that is a whole number of increments but for
        // rounding is one.
        const NOISE: f64 = 1e-6;
        let size = params.increment;
        let least = (params.least_height / size - NOISE).ceil().clamp(1.0, MOST_HEIGHTS) as u32;
        let greatest = (params.greatest_height / size + NOISE).floor().clamp(0.0, MOST_HEIGHTS);
        Self { size, least, greatest: (greatest as u32).max(least) }
    }

    /// Returns the whole number of increments nearest to a length.
    #[must_use]
    pub fn nearest(&self, length: f64) -> u32 {
        (length / self.size).round().clamp(0.0, f64::from(u32::MAX / 4)) as u32
    }

    /// Returns a length in thousandths of an increment.
    #[must_use]
    pub fn milli(&self, length: f64) -> i64 {
        (length / self.size * 1000.0).round() as i64
    }
}
