use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point2, Point3, Vector3};

use super::{Extent, Form, LayerSurface, SurfaceError};
use crate::chart::Chart;

/// Cones about the z axis, all alike: the level is `z + r·tan(angle)`.
///
/// With a positive angle layers slope down outwards and have their apex on top; with a negative
/// one they rise outwards, like bowls. Layers `h` thick are `h / cos(angle)` of level apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    angle: f64,
    /// Tangent of the angle, with its sign.
    slope: f64,
    /// Cosine of the angle: chart radius by radius, inverted.
    cos: f64,
}

impl Cone {
    /// Returns the cones that slope down outwards by `angle` (radians).
    ///
    /// # Errors
    ///
    /// [`SurfaceError::Angle`] from a right angle on.
    pub fn new(angle: f64) -> Result<Self, SurfaceError> {
        if angle.is_nan() || angle.abs() >= FRAC_PI_2 {
            return Err(SurfaceError::Angle { angle });
        }
        Ok(Self { angle, slope: angle.tan(), cos: angle.cos() })
    }

    /// Returns the cones whose layers fall by `slope` mm with every mm outwards.
    ///
    /// # Errors
    ///
    /// [`SurfaceError::NotFinite`] when that is not a slope.
    pub fn from_slope(slope: f64) -> Result<Self, SurfaceError> {
        if !slope.is_finite() {
            return Err(SurfaceError::NotFinite);
        }
        Ok(Self { angle: slope.atan(), slope, cos: 1.0 / slope.hypot(1.0) })
    }

    /// Returns the angle by which layers slope down outwards, radians.
    #[must_use]
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Returns its tangent.
    #[must_use]
    pub fn slope(&self) -> f64 {
        self.slope
    }
}

impl LayerSurface for Cone {
    fn level(&self, p: &Point3<f64>) -> f64 {
        let form = self.form();
        let value = form.value(&form.convex(p));
        if form.is_mirrored() { -value } else { value }
    }

    fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        let r = p.x.hypot(p.y);
        if r == 0.0 {
            return Vector3::z();
        }
        Vector3::new(self.slope * p.x / r, self.slope * p.y / r, 1.0)
    }

    fn flatten(&self, p: &Point3<f64>) -> Point2<f64> {
        p.xy() / self.cos
    }

    fn lift(&self, level: f64, uv: &Point2<f64>) -> Point3<f64> {
        let at = uv * self.cos;
        Point3::new(at.x, at.y, level - self.slope * at.x.hypot(at.y))
    }

    fn form(&self) -> Form {
        Form::cone(self.slope)
    }

    fn chart(&self, _: f64) -> Chart {
        Chart::cone(self.angle)
    }

    fn level_step(&self, thickness: f64) -> f64 {
        thickness / self.cos
    }

    fn slope_cos(&self, _: &Point3<f64>) -> f64 {
        self.cos
    }

    fn thickness_per_level(&self, _: &Point3<f64>) -> f64 {
        self.cos
    }

    fn height(&self, level: f64, r: f64) -> f64 {
        level - self.slope * r
    }

    fn carry(&self, s: f64, from: f64, to: f64) -> f64 {
        // A step h along the normal leads h·sin(angle) outwards, which the chart shows as
        // h·tan(angle); the step is the difference of the levels times cos(angle).
        (s + (to - from) * self.cos * self.slope).max(0.0)
    }

    fn fits(&self, _: &Extent) -> Result<(), SurfaceError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::contract;
    use super::*;

    #[test]
    fn cones_keep_the_contract() {
        for degrees in [-45.0, -30.0, -10.0, 0.0, 5.0, 15.0, 30.0, 45.0, 60.0_f64] {
            contract::check(&Cone::new(degrees.to_radians()).unwrap(), &contract::samples());
        }
    }

    #[test]
    fn no_slope_is_the_plane() {
        let flat = Cone::new(1e-12).unwrap();
        for p in contract::samples() {
            assert!((flat.level(&p) - p.z).abs() < 1e-9);
            assert!((flat.flatten(&p) - p.xy()).norm() < 1e-9);
        }
    }

    #[test]
    fn upright_cones_are_refused() {
        assert!(Cone::new(FRAC_PI_2).is_err());
        assert!(Cone::new(-2.0).is_err());
        assert!(Cone::new(f64::NAN).is_err());
    }
}
