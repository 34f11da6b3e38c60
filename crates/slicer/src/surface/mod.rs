//! The surfaces that layers follow.
//!
//! A surface is a height field over the part whose level sets are the layers: layer `h` is the set
//! of points `p` with `level(p) = h`. All are surfaces of revolution about the part's z axis, and
//! the level of a point on that axis is its z. The rest of the slicer knows a layer only through
//! its *chart*, a flat map of it in geodesic polar coordinates about the axis (arc length along the
//! meridian, azimuth).
//!
//! | family | level | layer | chart radius s |
//! | --- | --- | --- | --- |
//! | [`Plane`] | z | horizontal planes | r |
//! | [`Cone`], angle a > 0 (outside lower) or < 0 (a bowl) | z + r·tan a | cones, all alike | r / cos a |
//! | [`Spheres`], centre on the axis at `centre_z` | \|p − centre\| + `centre_z` | concentric spheres | R·psi |
//! | [`Caps`], radius R | z + R − √(R² − r²) | one cap, lifted | R·psi |
//!
//! How a family meets lines and facets is said once for all by its convex [`Form`].

mod caps;
mod cone;
mod form;
mod plane;
mod spheres;

pub use caps::Caps;
pub use cone::Cone;
pub use form::{Form, Quadratic};
pub use plane::Plane;
pub use spheres::Spheres;

use nalgebra::{Point2, Point3, Vector3};

use crate::chart::Chart;

/// A family of layers. See the [module](self).
pub trait LayerSurface: Send + Sync {
    /// Returns the level of `p`, mm; it grows upwards and is z on the axis.
    fn level(&self, p: &Point3<f64>) -> f64;

    /// Returns the gradient of the level, never zero; on the axis, where that of a cone has no
    /// direction, the vertical. Its inverse length is the thickness of the material between two
    /// layers per mm of level between them.
    fn gradient(&self, p: &Point3<f64>) -> Vector3<f64>;

    /// Returns the place of `p` in the chart of its own layer, mm.
    fn flatten(&self, p: &Point3<f64>) -> Point2<f64>;

    /// Returns the point of layer `level` that the chart shows at `uv`:
    /// `lift(level(p), flatten(p)) = p`.
    fn lift(&self, level: f64, uv: &Point2<f64>) -> Point3<f64>;

    /// Returns how the layers meet lines and facets.
    fn form(&self) -> Form;

    /// Returns the metric of the chart of layer `level`.
    fn chart(&self, level: f64) -> Chart;

    /// Returns the unit normal of the layer through `p`, upwards.
    fn normal(&self, p: &Point3<f64>) -> Vector3<f64> {
        self.gradient(p).normalize()
    }

    /// Returns the cosine of the slope of the layer through `p`: the vertical part of its unit
    /// normal. On the axis it is that of the places beside it.
    fn slope_cos(&self, p: &Point3<f64>) -> f64 {
        self.normal(p).z
    }

    /// Returns the thickness of the material at `p` per mm of level: the inverse length of the
    /// gradient, and on the axis that of the places beside it.
    fn thickness_per_level(&self, p: &Point3<f64>) -> f64 {
        1.0 / self.gradient(p).norm()
    }

    /// Returns the height of layer `level` at distance `r` from the axis, mm; not a number where
    /// the layer does not reach.
    fn height(&self, level: f64, r: f64) -> f64;

    /// Returns how far levels lie apart, mm, whose layers are `thickness` (mm) thick along the
    /// normal; for [`Caps`], whose layers thin outwards, on the axis.
    fn level_step(&self, thickness: f64) -> f64 {
        thickness
    }

    /// Returns at which chart radius the normal that leaves layer `from` at chart radius `s` meets
    /// layer `to`, mm; the azimuth stays.
    ///
    /// Exact for plane, cone and concentric spheres, for [`Caps`] to first order in the difference
    /// of the levels. Normals that meet the axis on their way end there.
    fn carry(&self, s: f64, from: f64, to: f64) -> f64;

    /// Checks that a part lies where the family is defined.
    ///
    /// # Errors
    ///
    /// [`SurfaceError`] when it does not.
    fn fits(&self, extent: &Extent) -> Result<(), SurfaceError>;
}

/// What a surface must know of a part, part frame, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// The least z of the part.
    pub lowest: f64,
    /// The greatest distance of the part from the z axis.
    pub radius: f64,
}

/// Why a family of layers cannot be, or cannot be laid in a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfaceError {
    /// The angle of a cone must be less than a right angle either way.
    Angle {
        /// The angle given, radians.
        angle: f64,
    },
    /// Slopes and the centre of spheres must be numbers, and radii more than zero.
    NotFinite,
    /// The centre of spheres must not lie above the lowest point of the part.
    CentreInPart {
        /// Height of the centre, mm.
        centre_z: f64,
        /// The lowest point of the part, mm.
        lowest: f64,
    },
    /// A cap must reach over the whole part.
    CapTooSmall {
        /// Radius of the cap, mm.
        radius: f64,
        /// Radius of the part about the axis, mm.
        part: f64,
    },
}

impl std::fmt::Display for SurfaceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Angle { angle } => {
                write!(f, "a cone of {}° has no layers: give less than 90°", angle.to_degrees())
            }
            Self::NotFinite => {
                write!(f, "the slope, centre or radius of the layers is not a number")
            }
            Self::CentreInPart { centre_z, lowest } => write!(
                f,
                "the centre of the spheres at {centre_z} mm lies above the lowest point of the \
                 part at {lowest} mm"
            ),
            Self::CapTooSmall { radius, part } => write!(
                f,
                "a cap of radius {radius} mm does not reach over a part of radius {part} mm"
            ),
        }
    }
}

impl std::error::Error for SurfaceError {}

/// What every surface must satisfy; tests run it on each.
#[cfg(test)]
pub(crate) mod contract;
