//! The integer grid on which planar regions live.
//!
//! Points are snapped to the grid once, when they enter a [`Region`](crate::region::Region);
//! after that, equality is equality and booleans are exact up to the rounding of new crossings.
//!
//! One grid step is 10 nm. Coarser, and the rounding of crossings would show beside the 2 µm to
//! which outlines are simplified; finer, and `i32` would no longer hold the build plate: the
//! overlay engine takes coordinates up to 2³⁰ steps, which at 10 nm is ±10.7 m.

use nalgebra::Point2;

/// A point on the grid, in grid steps.
pub type GridPoint = i_overlay::i_float::int::point::IntPoint<i32>;

/// Grid steps in a millimetre.
pub const STEPS_PER_MM: f64 = 100_000.0;

/// The largest coordinate that [`snap`] takes, mm: 2³⁰ steps, less room for offsets to grow.
pub const REACH_MM: f64 = 10_000.0;

/// Returns the grid point nearest to `p` (mm).
///
/// # Panics
///
/// Debug builds panic when a coordinate is not finite or exceeds [`REACH_MM`]; the machine's
/// envelope is checked long before.
#[must_use]
pub fn snap(p: &Point2<f64>) -> GridPoint {
    debug_assert!(p.x.abs() <= REACH_MM && p.y.abs() <= REACH_MM, "{p} is off the grid");
    GridPoint::new(steps(p.x), steps(p.y))
}

/// Returns the position of a grid point, mm.
#[must_use]
pub fn mm(p: GridPoint) -> Point2<f64> {
    Point2::new(f64::from(p.x) / STEPS_PER_MM, f64::from(p.y) / STEPS_PER_MM)
}

/// Returns a length in whole grid steps.
#[must_use]
pub fn steps(length_mm: f64) -> i32 {
    // A float-to-int cast saturates; callers stay within REACH_MM.
    (length_mm * STEPS_PER_MM).round() as i32
}
