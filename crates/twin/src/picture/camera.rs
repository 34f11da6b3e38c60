//! Where the eye is, and how places of the part come to lie on the screen.

use nalgebra::{Point3, Vector3};

/// A direction to look from, in the part frame; lines that are parallel stay so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaze {
    /// Azimuth of the eye about the part, radians from x towards y.
    pub azimuth: f64,
    /// Its elevation above the bed, radians.
    pub elevation: f64,
}

impl Default for Gaze {
    /// A little lower than isometric, so that walls are seen well, and off the diagonal, so that
    /// square parts show two unlike sides.
    fn default() -> Self {
        Self { azimuth: -1.05, elevation: 0.52 }
    }
}

/// The same as axes of the screen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    pub(super) right: Vector3<f64>,
    pub(super) up: Vector3<f64>,
    pub(super) towards_eye: Vector3<f64>,
    /// Where the light comes from: over the eye's left shoulder.
    light: Vector3<f64>,
}

/// How bright a face is that no light falls on.
const SHADOW: f64 = 0.26;

/// How much of the light comes from the whole sky, which upward faces see more of.
const SKY: f64 = 0.16;

impl Camera {
    pub(super) fn new(gaze: &Gaze) -> Self {
        let (sin, cos) = gaze.azimuth.sin_cos();
        let (high, flat) = gaze.elevation.sin_cos();
        let towards_eye = Vector3::new(cos * flat, sin * flat, high);
        let right = Vector3::new(-sin, cos, 0.0);
        let up = towards_eye.cross(&right);
        let light = (towards_eye + up * 0.75 - right * 1.15).normalize();
        Self { right, up, towards_eye, light }
    }

    /// Returns a place as the screen sees it: to the right, upwards, towards the eye, mm.
    pub(super) fn seen(&self, p: &Point3<f64>) -> [f64; 3] {
        [self.right, self.up, self.towards_eye].map(|axis| axis.dot(&p.coords))
    }

    /// Returns how bright a face with this normal is, from 0 to 1; the side that is seen counts.
    pub(super) fn brightness(&self, normal: &Vector3<f64>) -> f64 {
        let normal = normal / normal.norm();
        // Faces without area have no side.
        if !normal.x.is_finite() {
            return SHADOW;
        }
        let normal = if normal.dot(&self.towards_eye) < 0.0 { -normal } else { normal };
        let sky = SKY * (1.0 + normal.z) / 2.0;
        (SHADOW + sky + (1.0 - SHADOW - SKY) * normal.dot(&self.light).max(0.0)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn from_above_x_is_right_and_y_is_up() {
        let camera = Camera::new(&Gaze { azimuth: -FRAC_PI_2, elevation: FRAC_PI_2 });
        let seen = camera.seen(&Point3::new(1.0, 2.0, 3.0));
        for (a, b) in seen.iter().zip([1.0, 2.0, 3.0]) {
            assert!((a - b).abs() < 1e-12, "{seen:?}");
        }
    }

    #[test]
    fn from_the_front_left_faces_are_lighter_than_right_ones() {
        let camera = Camera::new(&Gaze::default());
        let left = camera.brightness(&(camera.towards_eye - camera.right));
        let right = camera.brightness(&(camera.towards_eye + camera.right));
        assert!(left > right + 0.2, "{left} {right}");
        assert_eq!(camera.brightness(&Vector3::zeros()), SHADOW);
        assert_eq!(camera.brightness(&Vector3::new(f64::NAN, 0.0, 0.0)), SHADOW);
    }
}
