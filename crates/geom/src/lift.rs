//! How far must a tool be raised to clear what lies under it?
//!
//! A tool that comes straight from above meets a bead at one height exactly. It is found from there
//! downwards: the distance of two convex bodies, which parry3d (f64 build) answers for any that can
//! say which of their points lies farthest in a direction, is a convex function of the height of one of
//! them, so Newton's steps from where they are apart come down to the touch and never pass it.
//!
//! Bodies are exact, without facets: a frustum is the hull of two discs, a bead the points within a
//! radius of a flat core. mm.

use nalgebra::{Point3, Rotation3, Vector2, Vector3};
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::details::contact_support_map_support_map;
use parry3d_f64::shape::SupportMap;

/// A height is found when what is left is less than this, mm: a hundredth of the last place of a
/// program, far above what distances are off by.
const FOUND: f64 = 1e-5;

/// More steps than this are never taken: each step from afar meets the body's edge or its slope, and
/// near the touch the error is squared by each.
const MOST_STEPS: usize = 40;

/// A body of a tool, upright, its place counted from the tip. mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tool {
    /// Turned about the tool's axis: a cylinder, or a cone without its end.
    Frustum {
        /// Radius below and above.
        radii: [f64; 2],
        /// Height of the lower and the upper face above the tip.
        heights: [f64; 2],
    },
    /// A box through the tool's axis.
    Beam {
        /// Where its length lies, seen from above; of length 1.
        along: Vector2<f64>,
        /// Half its length and half its width.
        half: [f64; 2],
        /// Height of the lower and the upper face above the tip.
        heights: [f64; 2],
    },
}

impl Tool {
    /// Returns the height of its lower face above the tip.
    #[must_use]
    pub fn lowest(&self) -> f64 {
        let (Self::Frustum { heights, .. } | Self::Beam { heights, .. }) = self;
        heights[0]
    }
}

/// A straight piece of a bead: a rectangle that is round by half the bead's thickness. mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bead {
    centre: Point3<f64>,
    /// Half the sides of the flat core.
    half: [Vector3<f64>; 2],
    radius: f64,
}

impl Bead {
    /// Returns the bead whose upper side is left by a tip between `ends`, `width` wide and as thick as
    /// `down` is long, which leads from the upper to the lower side.
    #[must_use]
    pub fn new(ends: [Point3<f64>; 2], width: f64, down: &Vector3<f64>) -> Self {
        let along = (ends[1] - ends[0]) / 2.0;
        let across = along.cross(down).try_normalize(f64::MIN_POSITIVE);
        let radius = down.norm().min(width) / 2.0;
        // A dot is as wide any way.
        let (half_width, any) = (width / 2.0 - radius, Vector3::x());
        Self {
            centre: nalgebra::center(&ends[0], &ends[1]) + down / 2.0,
            half: [along, across.unwrap_or(any) * half_width],
            radius,
        }
    }

    /// Returns the bead turned about a point.
    #[must_use]
    pub fn turned_about(&self, point: &Point3<f64>, by: &Rotation3<f64>) -> Self {
        let centre = point + by * (self.centre - point);
        Self { centre, half: self.half.map(|half| by * half), radius: self.radius }
    }

    fn top(&self) -> f64 {
        self.centre.z + self.half[0].z.abs() + self.half[1].z.abs() + self.radius
    }
}

/// Returns how far a tool whose tip stands at `tip` must be raised until it only touches the bead, when
/// that is more than `least`; `None` otherwise. Accurate to 0.01 µm.
#[must_use]
pub fn lift(tool: &Tool, tip: &Point3<f64>, bead: &Bead, least: f64) -> Option<f64> {
    let core = Core { half: bead.half };
    let from_tip = bead.centre - tip;
    // There the two are surely apart.
    let mut raised = bead.top() - tip.z - tool.lowest() + bead.radius.max(FOUND);
    for _ in 0..MOST_STEPS {
        if raised <= least {
            return None;
        }
        let place = Pose::translation(from_tip.x, from_tip.y, from_tip.z - raised);
        let contact = contact_support_map_support_map(&place, tool, &core, f64::MAX)?;
        let apart = contact.dist - bead.radius;
        if apart <= FOUND {
            return Some(raised);
        }
        let down = -contact.normal1.z;
        if down <= 0.0 {
            // Side by side: they pass each other.
            return None;
        }
        raised -= apart / down;
    }
    (raised > least).then_some(raised)
}

/// The flat inside of a bead.
struct Core {
    half: [Vector3<f64>; 2],
}

impl SupportMap for Core {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let direction = Vector3::new(direction.x, direction.y, direction.z);
        let [a, b] = self.half.map(|half| half * half.dot(&direction).signum());
        Vector::new(a.x + b.x, a.y + b.y, a.z + b.z)
    }
}

impl SupportMap for Tool {
    fn local_support_point(&self, direction: Vector) -> Vector {
        match self {
            Self::Frustum { radii, heights } => {
                let flat = Vector2::new(direction.x, direction.y);
                let outwards = flat.try_normalize(f64::MIN_POSITIVE).unwrap_or(Vector2::x());
                let on = |k: usize| {
                    Vector::new(outwards.x * radii[k], outwards.y * radii[k], heights[k])
                };
                let (low, high) = (on(0), on(1));
                if direction.dot(low) > direction.dot(high) { low } else { high }
            }
            Self::Beam { along, half, heights } => {
                let across = Vector2::new(-along.y, along.x);
                let flat = Vector2::new(direction.x, direction.y);
                let side = |axis: &Vector2<f64>, half: f64| axis * half * axis.dot(&flat).signum();
                let corner = side(along, half[0]) + side(&across, half[1]);
                Vector::new(corner.x, corner.y, heights[usize::from(direction.z > 0.0)])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -0.2);

    /// A wall's last bead along x at a distance of y, its top at `top`.
    fn wall(y: f64, top: f64) -> Bead {
        Bead::new([Point3::new(-5.0, y, top), Point3::new(5.0, y, top)], 0.4, &DOWN)
    }

    fn assert_lift(tool: &Tool, bead: &Bead, expected: f64) {
        let found = lift(tool, &Point3::new(0.0, 0.0, 1.0), bead, f64::NEG_INFINITY).unwrap();
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    }

    #[test]
    fn a_cone_touches_the_round_side_of_a_bead() {
        for angle in [0.2, 0.5, 0.8, 1.2_f64] {
            let height = 12.0;
            let radii = [0.5, 0.5 + height * angle.tan()];
            let tool = Tool::Frustum { radii, heights: [0.0, height] };
            // The flank leaves the axis as r = 0.5 + z·tan α and touches the circle of 0.1 about the
            // end of the core, r = y − 0.1.
            let y = 0.5 + height * angle.tan() / 2.0;
            let centre = (y - 0.1 - 0.5) / angle.tan() - 0.1 / angle.sin();
            // The flank passes `centre` above the tip: the bead's middle is at 2.9.
            assert_lift(&tool, &wall(y, 3.0), 2.9 - 1.0 - centre);
        }
    }

    #[test]
    fn flat_faces_rest_on_what_is_highest() {
        let block = Tool::Frustum { radii: [20.0; 2], heights: [12.0, 40.0] };
        assert_lift(&block, &wall(7.0, 15.0), 2.0);
        assert_lift(&block, &wall(-19.0, 12.5), -0.5);
        let tip = Point3::new(0.0, 0.0, 1.0);
        assert_eq!(lift(&block, &tip, &wall(20.3, 15.0), f64::NEG_INFINITY), None);
        assert_eq!(lift(&block, &tip, &wall(7.0, 15.0), 2.1), None);
        let along = Vector2::new(0.6, 0.8);
        let beam = Tool::Beam { along, half: [100.0, 10.0], heights: [40.0, 60.0] };
        let dot = |x: f64, y: f64| Bead::new([Point3::new(x, y, 44.0); 2], 0.4, &DOWN);
        assert_lift(&beam, &dot(30.0, 40.0), 3.0);
        assert_lift(&beam, &dot(-60.0 + 7.6, -80.0 - 5.7), 3.0);
        assert_eq!(lift(&beam, &tip, &dot(-8.4, 6.3), f64::NEG_INFINITY), None);
    }

    #[test]
    fn a_sloped_bead_meets_the_rim_of_the_face() {
        // A layer that rises by 45° along x, the bead along the slope through the tip's own place.
        let slope = Vector3::new(1.0, 0.0, 1.0) / 2.0_f64.sqrt();
        let down = Vector3::new(0.1, 0.0, -0.1);
        let ends =
            [Point3::new(0.0, 0.0, 1.0) - slope * 5.0, Point3::new(0.0, 0.0, 1.0) + slope * 5.0];
        let face = Tool::Frustum { radii: [0.3; 2], heights: [0.0, 5.0] };
        // Its rim, 0.3 mm uphill, lies 0.3 mm lower than the bead's flat upper side.
        assert_lift(&face, &Bead::new(ends, 0.4, &down), 0.3);
    }
}
