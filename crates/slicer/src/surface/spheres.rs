use nalgebra::{Point2, Point3, Vector3};

use super::{Extent, Form, LayerSurface, SurfaceError};
use crate::chart::Chart;

/// Concentric spheres about a point of the z axis at or below the part.
///
/// The level is the height at which the sphere through a point meets the axis: its radius and the
/// height of the centre. Layers are as thick as their levels are apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spheres {
    centre_z: f64,
}

impl Spheres {
    /// Returns the spheres about the point of the axis at height `centre_z` (mm).
    ///
    /// # Errors
    ///
    /// [`SurfaceError::NotFinite`] when that is not a height.
    pub fn new(centre_z: f64) -> Result<Self, SurfaceError> {
        if centre_z.is_finite() { Ok(Self { centre_z }) } else { Err(SurfaceError::NotFinite) }
    }

    /// Returns the height of the centre, mm.
    #[must_use]
    pub fn centre_z(&self) -> f64 {
        self.centre_z
    }

    /// Returns the radius of the sphere of a level, mm.
    #[must_use]
    pub fn radius(&self, level: f64) -> f64 {
        level - self.centre_z
    }
}

impl LayerSurface for Spheres {
    fn level(&self, p: &Point3<f64>) -> f64 {
        self.form().value(p)
    }

    fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        let from_centre = Vector3::new(p.x, p.y, p.z - self.centre_z);
        from_centre.try_normalize(0.0).unwrap_or_else(Vector3::z)
    }

    fn flatten(&self, p: &Point3<f64>) -> Point2<f64> {
        let (r, up) = (p.x.hypot(p.y), p.z - self.centre_z);
        if r == 0.0 {
            return Point2::origin();
        }
        p.xy() * (r.hypot(up) * r.atan2(up) / r)
    }

    fn lift(&self, level: f64, uv: &Point2<f64>) -> Point3<f64> {
        lift_to_sphere(self.radius(level), level, uv)
    }

    fn form(&self) -> Form {
        Form::spheres(self.centre_z)
    }

    fn chart(&self, level: f64) -> Chart {
        Chart::Sphere { radius: self.radius(level) }
    }

    fn height(&self, level: f64, r: f64) -> f64 {
        let radius = self.radius(level);
        level - r * r / (radius + ((radius - r) * (radius + r)).sqrt())
    }

    fn carry(&self, s: f64, from: f64, to: f64) -> f64 {
        s * (self.radius(to) / self.radius(from))
    }

    fn fits(&self, extent: &Extent) -> Result<(), SurfaceError> {
        let Self { centre_z } = *self;
        if centre_z > extent.lowest {
            return Err(SurfaceError::CentreInPart { centre_z, lowest: extent.lowest });
        }
        Ok(())
    }
}

/// The point that the chart shows at `uv`, of the sphere whose top on the axis is at `top`.
pub(super) fn lift_to_sphere(radius: f64, top: f64, uv: &Point2<f64>) -> Point3<f64> {
    let s = uv.coords.norm();
    if s == 0.0 {
        return Point3::new(0.0, 0.0, top);
    }
    let angle = s / radius;
    let at = uv * (radius * angle.sin() / s);
    // 1 − cos without the cancellation that flat caps would suffer from.
    let below_top = 2.0 * radius * (angle / 2.0).sin().powi(2);
    Point3::new(at.x, at.y, top - below_top)
}

#[cfg(test)]
mod tests {
    use super::super::contract;
    use super::*;

    #[test]
    fn spheres_keep_the_contract() {
        for centre_z in [-1.0, -20.0, -50.0, -1000.0] {
            contract::check(&Spheres::new(centre_z).unwrap(), &contract::samples());
        }
    }

    #[test]
    fn a_centre_far_away_is_the_plane() {
        let flat = Spheres::new(-1e12).unwrap();
        for p in contract::samples() {
            assert!((flat.level(&p) - p.z).abs() < 1e-8);
            assert!((flat.flatten(&p) - p.xy()).norm() < 1e-8);
        }
    }

    #[test]
    fn the_centre_stays_out_of_the_part() {
        let spheres = Spheres::new(1.0).unwrap();
        assert!(spheres.fits(&Extent { lowest: 0.0, radius: 5.0 }).is_err());
        assert!(spheres.fits(&Extent { lowest: 1.0, radius: 5.0 }).is_ok());
        assert!(Spheres::new(f64::INFINITY).is_err());
    }
}
