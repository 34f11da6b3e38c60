//! The surfaces that layers lie on, as a program announces them.
//!
//! Before the first layer of a stage a program may say `; layer surface = conical, angle 30`; until
//! it says anything, layers are planar. A family is a height field over the part, about its z axis:
//!
//! | family | level of a point |
//! | --- | --- |
//! | planar | `z` |
//! | conical, angle α | `z + r·tan α`; α > 0 falls outwards |
//! | spherical, centre c | `c + √(r² + (z − c)²)` |
//! | caps, radius R | `z + R − √(R² − r²)` |
//!
//! The level of a point on the axis is its z in all of them. Part frame, mm.

use nalgebra::{Point3, Vector3};

/// A family of layers. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Family {
    /// Horizontal planes.
    #[default]
    Planar,
    /// Cones about the axis.
    Conical {
        /// How much they fall per mm outwards.
        slope: f64,
    },
    /// Spheres about a point of the axis.
    Spherical {
        /// The height of that point, mm.
        centre: f64,
    },
    /// One cap of a sphere, shifted along the axis.
    Caps {
        /// The radius of the sphere, mm.
        radius: f64,
    },
}

/// How a comment begins that names the family.
const REMARK: &str = " layer surface = ";

impl Family {
    /// Reads what follows the `;` of a comment; `None` when it names no family that is known.
    #[must_use]
    pub fn from_comment(comment: &str) -> Option<Self> {
        let named = comment.strip_prefix(REMARK)?;
        let (kind, parameter) = named.split_once(", ").unwrap_or((named, ""));
        let number = |name: &str| {
            let value = parameter.strip_prefix(name)?.strip_prefix(' ')?.parse().ok();
            value.filter(|value: &f64| value.is_finite())
        };
        Some(match kind {
            "planar" => Self::Planar,
            "conical" => Self::Conical { slope: number("angle")?.to_radians().tan() },
            "spherical" => Self::Spherical { centre: number("centre")? },
            "caps" => Self::Caps { radius: number("radius")? },
            _ => return None,
        })
    }

    /// Returns the level of a point, mm; not a number where the family has none.
    #[must_use]
    pub fn level(&self, p: &Point3<f64>) -> f64 {
        let r = p.x.hypot(p.y);
        match *self {
            Self::Planar => p.z,
            Self::Conical { slope } => p.z + slope * r,
            Self::Spherical { centre } => centre + r.hypot(p.z - centre),
            // r² / (R + √(R² − r²)) is R − √(R² − r²) without its cancellation.
            Self::Caps { radius } => p.z + r * r / (radius + (radius * radius - r * r).sqrt()),
        }
    }

    /// Returns the height of the layer with this level at distance `r` from the axis, mm; not a
    /// number where the layer does not reach.
    #[must_use]
    pub fn height(&self, level: f64, r: f64) -> f64 {
        match *self {
            Self::Planar => level,
            Self::Conical { slope } => level - slope * r,
            Self::Spherical { centre } => {
                let radius = level - centre;
                centre + (radius * radius - r * r).sqrt()
            }
            Self::Caps { radius } => level - r * r / (radius + (radius * radius - r * r).sqrt()),
        }
    }

    /// Returns the upward unit normal of the layer through a point.
    #[must_use]
    pub fn normal(&self, p: &Point3<f64>) -> Vector3<f64> {
        let r = p.x.hypot(p.y);
        let outward = if r > 0.0 { Vector3::new(p.x, p.y, 0.0) / r } else { Vector3::zeros() };
        let rise = match *self {
            Self::Planar => 0.0,
            Self::Conical { slope } => slope,
            Self::Spherical { centre } => r / (p.z - centre),
            Self::Caps { radius } => r / (radius * radius - r * r).sqrt(),
        };
        (Vector3::z() + outward * rise).normalize()
    }

    /// Returns the place `distance` mm from `p` along its layer, on the geodesic that leaves it along
    /// `direction`, a unit vector in the layer; on spheres straight on, which a bead's width away is
    /// the same.
    #[must_use]
    pub(crate) fn walk(
        &self,
        p: &Point3<f64>,
        direction: &Vector3<f64>,
        distance: f64,
    ) -> Point3<f64> {
        let r = p.x.hypot(p.y);
        let Self::Conical { slope } = *self else { return p + direction * distance };
        if r == 0.0 {
            return p + direction * distance;
        }
        // On the unrolled cone the way is straight.
        let cos = 1.0 / slope.hypot(1.0);
        let outward = Vector3::new(p.x, p.y, 0.0) / r;
        let across = Vector3::new(-outward.y, outward.x, 0.0);
        let ruling = (outward - Vector3::z() * slope) * cos;
        let x = r / cos + distance * direction.dot(&ruling);
        let y = distance * direction.dot(&across);
        let (sin, cosine) = (y.atan2(x) / cos).sin_cos();
        let to = x.hypot(y) * cos;
        let at = (outward * cosine + across * sin) * to;
        Point3::new(at.x, at.y, p.z - slope * (to - r))
    }

    /// Returns how thick a layer is at a point, along its normal, per mm of level.
    #[must_use]
    pub fn thickness_per_level(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Planar | Self::Spherical { .. } => 1.0,
            Self::Conical { .. } | Self::Caps { .. } => self.normal(p).z,
        }
    }

    /// Returns the thickness that programs announce for a layer, per mm of level: along the normal,
    /// and of caps, which thin outwards, on the axis.
    #[must_use]
    pub fn announced_per_level(&self) -> f64 {
        match *self {
            Self::Planar | Self::Spherical { .. } | Self::Caps { .. } => 1.0,
            Self::Conical { slope } => 1.0 / slope.hypot(1.0),
        }
    }

    /// Returns what it is called.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Planar => "planar",
            Self::Conical { .. } => "conical",
            Self::Spherical { .. } => "spherical",
            Self::Caps { .. } => "cap-shaped",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn families() -> [Family; 5] {
        [
            Family::Planar,
            Family::Conical { slope: 0.6 },
            Family::Conical { slope: -0.4 },
            Family::Spherical { centre: -60.0 },
            Family::Caps { radius: 90.0 },
        ]
    }

    #[test]
    fn comments_name_families() {
        let read = Family::from_comment;
        assert_eq!(read(" layer surface = planar"), Some(Family::Planar));
        let Some(Family::Conical { slope }) = read(" layer surface = conical, angle -30") else {
            panic!()
        };
        assert!((slope + 1.0 / 3.0_f64.sqrt()).abs() < 1e-12);
        let spheres = Family::Spherical { centre: -60.5 };
        assert_eq!(read(" layer surface = spherical, centre -60.5"), Some(spheres));
        assert_eq!(read(" layer surface = caps, radius 100"), Some(Family::Caps { radius: 100.0 }));
        assert_eq!(read(" layer surface = wavy, angle 3"), None);
        assert_eq!(read(" layer surface = conical, angle x"), None);
        assert_eq!(read("TYPE:Perimeter"), None);
    }

    #[test]
    fn ways_stay_on_their_cone() {
        let cone = Family::Conical { slope: 0.8 };
        let p = Point3::new(0.2, 0.1, cone.height(5.0, 0.2_f64.hypot(0.1)));
        for turn in [0.0, 1.0, 2.5, 4.0_f64] {
            let normal = cone.normal(&p);
            let side = normal.cross(&Vector3::x()).normalize();
            let direction = side * turn.cos() + normal.cross(&side) * turn.sin();
            for distance in [-0.3, 0.05, 0.3] {
                let to = cone.walk(&p, &direction, distance);
                assert!((cone.level(&to) - 5.0).abs() < 1e-12);
                assert!((to - p).norm() <= distance.abs() + 1e-12);
            }
            let near = cone.walk(&p, &direction, 1e-6);
            assert!((near - p - direction * 1e-6).norm() < 1e-10);
        }
    }

    #[test]
    fn the_level_on_the_axis_is_z_and_heights_undo_levels() {
        for family in families() {
            assert!((family.level(&Point3::new(0.0, 0.0, 7.25)) - 7.25).abs() < 1e-12);
            for p in [[3.0, -4.0, 9.0], [0.0, 22.0, 1.0], [-31.0, 5.0, 40.0]] {
                let p: Point3<f64> = Point3::from(p);
                let r = p.x.hypot(p.y);
                let z = family.height(family.level(&p), r);
                assert!((z - p.z).abs() < 1e-12, "{family:?} {p} {z}");
            }
        }
    }

    #[test]
    fn normal_and_thickness_are_those_of_the_gradient() {
        const STEP: f64 = 1e-5;
        for family in families() {
            let p = Point3::new(12.0, -7.0, 15.0);
            let slope = |axis: Vector3<f64>| {
                (family.level(&(p + axis * STEP)) - family.level(&(p - axis * STEP))) / (2.0 * STEP)
            };
            let gradient =
                Vector3::new(slope(Vector3::x()), slope(Vector3::y()), slope(Vector3::z()));
            assert!((gradient.normalize() - family.normal(&p)).norm() < 1e-8, "{family:?}");
            let thickness = 1.0 / gradient.norm();
            assert!((thickness - family.thickness_per_level(&p)).abs() < 1e-8, "{family:?}");
            // Half a µm beside the axis, where cones have a direction.
            let near = Point3::new(5e-4, 0.0, 15.0);
            let announced = family.announced_per_level();
            assert!((announced - family.thickness_per_level(&near)).abs() < 1e-8, "{family:?}");
        }
    }
}
