//! The constant shift of a converter: `x' = x − dx`, `y' = y − dy`, then polar coordinates.
//!
//! It moves the whole print over the plate. That is the right correction for a plate, or a ring of
//! magnets, whose centre is not the axis of rotation, with `d` the place of the axis seen from the
//! plate's centre; there it equals the plate offset `−d` of an
//! [`Alignment`](crate::kinematics::Alignment). It is not a correction of a rail that misses the
//! axis: that error turns with the bed, and a constant shift by as much as the rail misses doubles
//! the worst of it.
//!
//! Source: centring of a cylindrical-coordinate printer, thesis, Kharkiv National University of
//! Radio Electronics (its example prints 2.97 for 2.964).

use nalgebra::Vector2;

/// A constant shift of the plate, mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlateShift {
    /// Where the axis of rotation lies, seen from the plate's centre.
    pub by: Vector2<f64>,
}

impl PlateShift {
    /// Returns the shifted polar coordinates, radius (mm) and angle (radians within ±π).
    #[must_use]
    pub fn shifted(&self, radius: f64, angle: f64) -> (f64, f64) {
        let p = Vector2::new(radius * angle.cos(), radius * angle.sin()) - self.by;
        (p.norm(), p.y.atan2(p.x))
    }

    /// Returns the plate offset of an alignment that does the same, mm.
    #[must_use]
    pub fn as_plate_offset(&self) -> Vector2<f64> {
        -self.by
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::{Alignment, Branch};
    use crate::program::BedTurn;
    use nalgebra::Point3;
    use std::f64::consts::FRAC_PI_4;

    #[test]
    fn the_worked_example() {
        let shift = PlateShift { by: Vector2::new(2.0, 1.0) };
        let (radius, angle) = shift.shifted(5.0, FRAC_PI_4);
        assert!((radius - 2.964_253_121).abs() < 1e-9, "{radius}");
        assert!((angle - 1.026_265_145).abs() < 1e-9, "{angle}");
    }

    #[test]
    fn it_is_the_exact_inverse_for_an_eccentric_plate() {
        let shift = PlateShift { by: Vector2::new(-0.3, 0.4) };
        let alignment = Alignment { plate_offset: shift.as_plate_offset(), ..Alignment::IDEAL };
        for k in 0..100 {
            let (radius, angle) = (1.0 + f64::from(k), f64::from(k) * 0.7);
            let part = Point3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
            let joints =
                alignment.joints_from_part(&part, Branch::Near, BedTurn::default()).unwrap();
            let (s, theta) = shift.shifted(radius, angle);
            assert!((joints.s - s).abs() < 1e-12);
            assert!((joints.turn.radians() - theta).sin().abs() < 1e-12);
        }
    }
}
