use nalgebra::{Point2, Point3, Vector3};

use super::spheres::lift_to_sphere;
use super::{Extent, Form, LayerSurface, SurfaceError};
use crate::chart::Chart;

/// The upper cap of one sphere, lifted along the z axis: the level is `z + R − √(R² − r²)`.
///
/// Defined within the radius of the sphere. Layers are as thick as their levels are apart on the
/// axis and thinner by the cosine of the slope elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Caps {
    radius: f64,
}

impl Caps {
    /// Returns the caps of a sphere of `radius` mm.
    ///
    /// # Errors
    ///
    /// [`SurfaceError::NotFinite`] when that is not a radius.
    pub fn new(radius: f64) -> Result<Self, SurfaceError> {
        if radius.is_finite() && radius > 0.0 {
            Ok(Self { radius })
        } else {
            Err(SurfaceError::NotFinite)
        }
    }

    /// Returns the radius of the sphere, mm.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Height of a cap's point at radius `r` above the centre of its sphere, mm.
    fn rise(&self, r: f64) -> f64 {
        ((self.radius - r) * (self.radius + r)).max(0.0).sqrt()
    }
}

impl LayerSurface for Caps {
    fn level(&self, p: &Point3<f64>) -> f64 {
        self.form().value(p)
    }

    fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        let rise = self.rise(p.x.hypot(p.y));
        Vector3::new(p.x / rise, p.y / rise, 1.0)
    }

    fn flatten(&self, p: &Point3<f64>) -> Point2<f64> {
        let r = p.x.hypot(p.y);
        if r == 0.0 {
            return Point2::origin();
        }
        p.xy() * (self.radius * r.atan2(self.rise(r)) / r)
    }

    fn lift(&self, level: f64, uv: &Point2<f64>) -> Point3<f64> {
        lift_to_sphere(self.radius, level, uv)
    }

    fn form(&self) -> Form {
        Form::caps(self.radius)
    }

    fn chart(&self, _: f64) -> Chart {
        Chart::Sphere { radius: self.radius }
    }

    fn height(&self, level: f64, r: f64) -> f64 {
        let Self { radius } = *self;
        level - r * r / (radius + ((radius - r) * (radius + r)).sqrt())
    }

    fn carry(&self, s: f64, from: f64, to: f64) -> f64 {
        // At the slope psi the step along the normal is (to − from)·cos psi; it leads that times
        // sin psi outwards, and the meridian grows by 1/cos psi faster than the radius.
        s + (to - from) * (s / self.radius).sin()
    }

    fn fits(&self, extent: &Extent) -> Result<(), SurfaceError> {
        if extent.radius >= self.radius {
            return Err(SurfaceError::CapTooSmall { radius: self.radius, part: extent.radius });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::contract;
    use super::*;

    #[test]
    fn caps_keep_the_contract() {
        for radius in [45.0, 60.0, 500.0] {
            contract::check(&Caps::new(radius).unwrap(), &contract::samples());
        }
    }

    #[test]
    fn a_large_radius_is_the_plane() {
        let flat = Caps::new(1e12).unwrap();
        for p in contract::samples() {
            assert!((flat.level(&p) - p.z).abs() < 1e-8);
            assert!((flat.flatten(&p) - p.xy()).norm() < 1e-8);
        }
    }

    #[test]
    fn a_cap_reaches_over_the_part() {
        assert!(Caps::new(10.0).unwrap().fits(&Extent { lowest: 0.0, radius: 10.0 }).is_err());
        assert!(Caps::new(0.0).is_err());
    }
}
