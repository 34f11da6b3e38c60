//! The named tolerances of a slice, checked against each other in one place.
//!
//! Three kinds of tolerance never mix: exact decisions (sidedness, winding) have none; regions
//! have the [grid](crate::grid); the rest are the user's, below, each with one meaning.

use crate::grid::STEPS_PER_MM;

/// User tolerances, mm. [`Tolerances::new`] is the only way to make them, so they always satisfy
/// `grid < simplify_mm < chord_mm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    simplify_mm: f64,
    chord_mm: f64,
}

/// Why a pair of tolerances makes no sense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ToleranceError {
    /// `simplify_mm` must be larger than a grid step (mm).
    BelowGrid {
        /// The value given, mm.
        simplify_mm: f64,
        /// One grid step, mm.
        grid_mm: f64,
    },
    /// `chord_mm` must be larger than `simplify_mm`: a path cannot be followed more closely than
    /// it is known.
    ChordBelowSimplify {
        /// The value given, mm.
        chord_mm: f64,
        /// What it is compared with, mm.
        simplify_mm: f64,
    },
}

impl std::fmt::Display for ToleranceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::BelowGrid { simplify_mm, grid_mm } => {
                write!(f, "simplify_mm = {simplify_mm} is not above the grid step of {grid_mm} mm")
            }
            Self::ChordBelowSimplify { chord_mm, simplify_mm } => write!(
                f,
                "chord_mm = {chord_mm} is not above simplify_mm = {simplify_mm}: \
                 a path cannot be followed more closely than it is known"
            ),
        }
    }
}

impl std::error::Error for ToleranceError {}

impl Tolerances {
    /// Returns the tolerances, if they fit together.
    ///
    /// # Errors
    ///
    /// [`ToleranceError`] names the relation that does not hold.
    pub fn new(simplify_mm: f64, chord_mm: f64) -> Result<Self, ToleranceError> {
        let grid_mm = 1.0 / STEPS_PER_MM;
        if simplify_mm.is_nan() || simplify_mm <= grid_mm {
            return Err(ToleranceError::BelowGrid { simplify_mm, grid_mm });
        }
        if chord_mm.is_nan() || chord_mm <= simplify_mm {
            return Err(ToleranceError::ChordBelowSimplify { chord_mm, simplify_mm });
        }
        Ok(Self { simplify_mm, chord_mm })
    }

    /// How far a simplified outline may lie from the section of the mesh. Larger, and outer walls
    /// lose accuracy one to one; smaller, and every later stage handles points that no printer
    /// can show. Slicing time grows about as its inverse square root.
    #[must_use]
    pub fn simplify_mm(&self) -> f64 {
        self.simplify_mm
    }

    /// How far the nozzle may lie from its path between two points of the program.
    #[must_use]
    pub fn chord_mm(&self) -> f64 {
        self.chord_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relations_are_enforced() {
        assert!(Tolerances::new(0.002, 0.005).is_ok());
        assert!(matches!(Tolerances::new(1e-6, 0.005), Err(ToleranceError::BelowGrid { .. })));
        assert!(matches!(
            Tolerances::new(0.005, 0.005),
            Err(ToleranceError::ChordBelowSimplify { .. })
        ));
        assert!(Tolerances::new(f64::NAN, 0.005).is_err());
        assert!(Tolerances::new(0.002, f64::NAN).is_err());
    }
}
