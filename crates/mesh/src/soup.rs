//! Loose triangles, exactly as an STL file holds them.
//!
//! Corners are in file order and in file units, which are taken for millimetres unless the user
//! says otherwise; the frame is Model. Nothing is shared and nothing is checked but that every
//! number is finite (`stl::read` sees to it).

use geom::bounding::Bounds;
use nalgebra::Point3;

/// The three corners of a facet, counter-clockwise seen from outside.
pub type Facet = [[f32; 3]; 3];

/// Triangles without topology.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Soup {
    /// The facets, in file order.
    pub facets: Vec<Facet>,
}

impl Soup {
    /// Returns the smallest box around all corners, file units.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for corner in self.facets.iter().flatten() {
            for (k, c) in corner.iter().enumerate() {
                min[k] = min[k].min(*c);
                max[k] = max[k].max(*c);
            }
        }
        let point = |corner: [f32; 3]| Point3::from(corner.map(f64::from));
        Bounds { min: point(min), max: point(max) }
    }

    /// Returns the soup with every coordinate multiplied by `factor`, rounded to `f32` once.
    ///
    /// Coordinates that would leave the range of `f32` stop at its end, so the result is finite.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let limit = f64::from(f32::MAX);
        let scale = |c: f32| (f64::from(c) * factor).clamp(-limit, limit) as f32;
        let facets = self.facets.iter().map(|f| f.map(|corner| corner.map(scale))).collect();
        Self { facets }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_and_scale() {
        let soup = Soup { facets: vec![[[0.0, 0.0, 0.0], [1.0, 0.0, -2.0], [0.0, 3.0, 0.0]]] };
        let bounds = soup.scaled(25.4).bounds();
        assert_eq!(bounds.min, Point3::new(0.0, 0.0, f64::from(-50.8_f32)));
        assert_eq!(bounds.max.x, f64::from(25.4_f32));
        assert!(Soup::default().bounds().is_empty());
        let far = soup.scaled(1e39).facets;
        assert!(far.iter().flatten().flatten().all(|c| c.is_finite()));
    }
}
