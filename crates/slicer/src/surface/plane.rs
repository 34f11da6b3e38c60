use nalgebra::{Point2, Point3, Vector3};

use super::{Extent, Form, LayerSurface, SurfaceError};
use crate::chart::Chart;

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

    fn form(&self) -> Form {
        Form::plane()
    }

    fn chart(&self, _: f64) -> Chart {
        Chart::Plane
    }

    fn height(&self, level: f64, _: f64) -> f64 {
        level
    }

    fn carry(&self, s: f64, _: f64, _: f64) -> f64 {
        s
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
    fn the_plane_keeps_the_contract() {
        contract::check(&Plane, &contract::samples());
    }
}
