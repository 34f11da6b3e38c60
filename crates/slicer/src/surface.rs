//! The surfaces that layers follow.
//!
//! A surface is a height field over the part whose level sets are the layers: layer `h` is the set
//! of points `p` with `level(p) = h`. All are surfaces of revolution about the part's z axis. The
//! rest of the slicer knows a layer only through its *chart*, a flat map of it in geodesic polar
//! coordinates about the axis (arc length along the meridian, azimuth).

use nalgebra::{Point2, Point3, Vector3};

/// A family of layers. See the [module](self).
pub trait LayerSurface: Send + Sync {
    /// Returns the level of `p`, mm; it grows upwards.
    fn level(&self, p: &Point3<f64>) -> f64;

    /// Returns the gradient of the level, never zero. Its inverse length is the thickness of the
    /// material between two layers per mm of level between them.
    fn gradient(&self, p: &Point3<f64>) -> Vector3<f64>;

    /// Returns the place of `p` in the chart of its own layer, mm.
    fn flatten(&self, p: &Point3<f64>) -> Point2<f64>;

    /// Returns the point of layer `level` that the chart shows at `uv`:
    /// `lift(level(p), flatten(p)) = p`.
    fn lift(&self, level: f64, uv: &Point2<f64>) -> Point3<f64>;
}

/// Horizontal planes: the level is z, the chart is the plane itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Plane;

impl LayerSurface for Plane {
    fn level(&self, p: &Point3<f64>) -> f64 {
        p.z
    }

    fn gradient(&self, _: &Point3<f64>) -> Vector3<f64> {
        Vector3::z()
    }

    fn flatten(&self, p: &Point3<f64>) -> Point2<f64> {
        p.xy()
    }

    fn lift(&self, level: f64, uv: &Point2<f64>) -> Point3<f64> {
        Point3::new(uv.x, uv.y, level)
    }
}

/// What every surface must satisfy; tests run it on each.
#[cfg(test)]
pub(crate) mod contract {
    use super::*;

    /// Checks round trip, gradient and monotony at `samples`.
    pub(crate) fn check(surface: &dyn LayerSurface, samples: &[Point3<f64>]) {
        const STEP: f64 = 1e-4;
        for p in samples {
            let level = surface.level(p);
            let back = surface.lift(level, &surface.flatten(p));
            assert!((back - p).norm() < 1e-9, "{p} came back as {back}");
            let difference = Vector3::from_fn(|k, _| {
                let step = Vector3::ith(k, STEP);
                (surface.level(&(p + step)) - surface.level(&(p - step))) / (2.0 * STEP)
            });
            let gradient = surface.gradient(p);
            assert!((gradient - difference).norm() < 1e-5, "{gradient} is not {difference} at {p}");
            assert!(gradient.z > 0.0, "the level grows upwards at {p}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plane_keeps_the_contract() {
        let samples: Vec<Point3<f64>> = (0..100)
            .map(|i| {
                let t = f64::from(i);
                Point3::new(40.0 * (t * 0.7).sin(), 30.0 * (t * 1.3).cos(), t * 0.5)
            })
            .collect();
        contract::check(&Plane, &samples);
    }
}
