//! Milliseconds between stages.

use std::time::Instant;

/// A watch that is read lap by lap.
#[derive(Debug, Clone, Copy)]
pub struct Stopwatch(Instant);

impl Stopwatch {
    /// Returns a running watch.
    #[must_use]
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// Returns the seconds since the last lap began.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }

    /// Returns the milliseconds since the last lap, and begins a new one.
    pub fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let milliseconds = (now - self.0).as_secs_f64() * 1000.0;
        self.0 = now;
        milliseconds
    }
}
