//! The cross-section of a printed line.
//!
//! A bead of width `w` and thickness `t` is a rectangle with two half-round flanks: its area is
//! `t·(w − t·(1 − π/4))`. Lines laid `spacing = w − t·(1 − π/4)` apart therefore fill a layer
//! exactly, each taking the place of a rectangle `spacing` wide.

use std::f64::consts::FRAC_PI_4;

/// Width and thickness of a printed line, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bead {
    /// From flank to flank.
    pub width: f64,
    /// From bottom to top.
    pub thickness: f64,
}

/// The share of its thickness by which a bead's round flanks make it narrower than a rectangle.
const ROUNDING: f64 = 1.0 - FRAC_PI_4;

impl Bead {
    /// Returns the bead that takes the place of a rectangle `spacing` wide.
    #[must_use]
    pub fn with_spacing(spacing: f64, thickness: f64) -> Self {
        Self { width: spacing + thickness * ROUNDING, thickness }
    }

    /// Returns the distance of neighbouring lines that fill a layer, mm.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        self.width - self.thickness * ROUNDING
    }

    /// Returns the bead of the same thickness with `flow` times the cross-section.
    #[must_use]
    pub fn with_flow(&self, flow: f64) -> Self {
        Self::with_spacing(flow * self.spacing(), self.thickness)
    }

    /// Returns the area of the cross-section, mm².
    #[must_use]
    pub fn area(&self) -> f64 {
        self.thickness * self.spacing()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_is_rectangle_and_two_half_discs() {
        let bead = Bead { width: 0.45, thickness: 0.2 };
        let expected = 0.2 * 0.25 + std::f64::consts::PI * 0.01;
        assert!((bead.area() - expected).abs() < 1e-15);
        let same = Bead::with_spacing(bead.spacing(), 0.2);
        assert!((same.width - 0.45).abs() < 1e-15);
    }
}
