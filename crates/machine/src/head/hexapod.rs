//! Six legs between a base and a platform that carries the nozzle (Gough–Stewart).
//!
//! Base joints `B_i` in the frame of the base, which stands in the machine at `place`; platform joints
//! `P_i` in the frame of the platform, whose origin is what the nozzle is turned about; `(T, R)` is where
//! the platform stands in the frame of the base.
//!
//! ```text
//! legs      L_i = |T + R·P_i − B_i|
//! rods      of fixed length l on slides along d:  q_i = d·w − √((d·w)² − w² + l²),  w = T + R·P_i − B_i
//! rates     row i of the Jacobian: [n_i, (R·P_i) × n_i],  n_i along the leg; for rods divided by n_i·d
//! forward   Newton on (T, R) with it
//! ```
//!
//! The nozzle's axis is brought along a direction by the shortest turn from the vertical: spin about it
//! is left at none. Real joint coordinates come from the drawing of the machine; the layouts here are
//! the regular ones, with base pairs at 0°, 120° and 240° and platform pairs at 60°, 180° and 300°.

use nalgebra::{Matrix6, Point3, Rotation2, Rotation3, UnitVector3, Vector2, Vector3, Vector6};

use super::{HEAD_AXES, HeadAxis, Pose, Stance, in_part, over_rail, shortest_turn};
use crate::kinematics::{Alignment, Branch, Unreachable};
use crate::profile::Axis;
use crate::program::{BedTurn, Joints};

/// Six legs.
pub const LEGS: usize = 6;

/// The letters of the legs in programs: with `C` for the bed the nine axes of `LinuxCNC` less `A` and `B`.
pub const LETTERS: [u8; LEGS] = *b"XYZUVW";

const NAMES: [&str; LEGS] = ["leg X", "leg Y", "leg Z", "leg U", "leg V", "leg W"];

/// See the [module](self).
#[derive(Debug, Clone, PartialEq)]
pub struct Hexapod {
    /// Where the legs are fixed to the base, mm.
    pub base: [Vector3<f64>; LEGS],
    /// Where they are fixed to the platform, mm.
    pub platform: [Vector3<f64>; LEGS],
    /// Where the origin of the base stands in the machine, mm.
    pub place: Vector3<f64>,
    /// From the origin of the platform down to the tip, mm.
    pub pivot_length: f64,
    /// Whether the bed turns under it, or stands.
    pub turns_bed: bool,
    /// Rods on slides, where the legs have a fixed length.
    pub rods: Option<Rods>,
    /// What the joints allow.
    pub joints: JointLimits,
    /// The legs, or the slides of the rods.
    pub axes: [HeadAxis; LEGS],
}

/// Legs of fixed length whose base joints slide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rods {
    /// mm.
    pub length: f64,
    /// The way of the slides, from where they count.
    pub direction: UnitVector3<f64>,
}

/// What joints and legs allow besides the legs' ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// How far a leg may lean at either joint from where it points with the platform at home, radians.
    pub cone: f64,
    /// Where the platform stands then, in the frame of the base.
    pub home: Vector3<f64>,
    /// Least distance between the middles of two legs that share no joint, mm.
    pub apart: f64,
    /// Greatest condition number of the Jacobian, its turns scaled by the platform's radius.
    pub condition: f64,
    /// How far the nozzle is ever tilted, radians.
    pub tilt: f64,
}

/// Where a platform stands in the frame of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Platform {
    /// Its origin, mm.
    pub origin: Vector3<f64>,
    /// From its frame to that of the base.
    pub turn: Rotation3<f64>,
}

/// Joints of a regular layout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// Radius of the base joints, mm.
    pub base_radius: f64,
    /// Radius of the platform joints, mm.
    pub platform_radius: f64,
    /// Half the angle between the two base joints of a pair, radians; 0 joins them.
    pub base_half_angle: f64,
    /// The same of the platform.
    pub platform_half_angle: f64,
}

impl Layout {
    /// Returns base and platform joints: leg 2k from base k to platform pair k, leg 2k + 1 from base k to
    /// platform pair k − 1.
    #[must_use]
    pub fn joints(&self) -> [[Vector3<f64>; LEGS]; 2] {
        let at = |radius: f64, degrees: f64, angle: f64| {
            let azimuth = degrees.to_radians() + angle;
            Vector3::new(radius * azimuth.cos(), radius * azimuth.sin(), 0.0)
        };
        let pair = |leg: usize| (leg / 2) as f64 * 120.0;
        let side = |leg: usize| if leg.is_multiple_of(2) { 1.0 } else { -1.0 };
        let base = |leg| at(self.base_radius, pair(leg), side(leg) * self.base_half_angle);
        let platform = |leg| {
            let azimuth = pair(leg) + side(leg) * 60.0;
            at(self.platform_radius, azimuth, -side(leg) * self.platform_half_angle)
        };
        [std::array::from_fn(base), std::array::from_fn(platform)]
    }

    /// Returns the height over the base at which the legs lean by 45° when the platform is level and in
    /// the middle: as high as a leg runs sideways, mm.
    #[must_use]
    pub fn height_at_45(&self) -> f64 {
        let angle = std::f64::consts::FRAC_PI_3 - self.base_half_angle - self.platform_half_angle;
        let (rb, rp) = (self.base_radius, self.platform_radius);
        (rb * rb + rp * rp - 2.0 * rb * rp * angle.cos()).sqrt()
    }
}

/// Passes of Newton's method; from home five or six do.
const MOST_PASSES: usize = 50;

/// Residual of the legs at which the pose is found, mm.
const FOUND_MM: f64 = 1e-11;

/// Residual that is good enough where rounding allows no less, mm.
const GOOD_MM: f64 = 1e-8;

/// Joints nearer than this are one, mm.
const SHARED_MM: f64 = 1e-6;

impl Hexapod {
    /// Returns a hexapod of these joints, whose legs (or slides) all have this range, over a bed that
    /// turns.
    #[must_use]
    pub fn new(
        [base, platform]: [[Vector3<f64>; LEGS]; 2],
        pivot_length: f64,
        leg: Axis,
        joints: JointLimits,
    ) -> Self {
        let axes = std::array::from_fn(|k| HeadAxis {
            letter: LETTERS[k],
            name: NAMES[k],
            is_angle: false,
            axis: leg,
        });
        let place = Vector3::zeros();
        Self { base, platform, place, pivot_length, turns_bed: true, rods: None, joints, axes }
    }

    /// Returns the lengths of the legs, or the places of the slides, mm.
    ///
    /// # Errors
    ///
    /// [`Unreachable::Head`] where a rod is too short.
    pub fn legs(&self, platform: &Platform) -> Result<[f64; LEGS], Unreachable> {
        let mut legs = [0.0; LEGS];
        for (k, leg) in legs.iter_mut().enumerate() {
            let way = self.way(platform, k);
            *leg = match &self.rods {
                None => way.norm(),
                Some(rods) => {
                    let along = rods.direction.dot(&way);
                    let square = along * along - way.norm_squared() + rods.length * rods.length;
                    if square < 0.0 {
                        let across = (way.norm_squared() - along * along).sqrt();
                        let (what, unit) = ("distance that a rod spans", " mm");
                        return Err(Unreachable::Head {
                            what,
                            value: across,
                            limit: rods.length,
                            unit,
                        });
                    }
                    along - square.sqrt()
                }
            };
        }
        Ok(legs)
    }

    /// Returns the rates of the legs: row i times the rates of the origin and of the turn (in the frame of
    /// the base) is that of leg i.
    #[must_use]
    pub fn jacobian(&self, platform: &Platform, legs: &[f64; LEGS]) -> Matrix6<f64> {
        let mut jacobian = Matrix6::zeros();
        for k in 0..LEGS {
            let leg = self.leg(platform, legs, k);
            let unit = leg.normalize();
            let arm = (platform.turn * self.platform[k]).cross(&unit);
            let scale = self.rods.as_ref().map_or(1.0, |rods| 1.0 / unit.dot(&rods.direction));
            jacobian.fixed_view_mut::<1, 3>(k, 0).copy_from(&(unit * scale).transpose());
            jacobian.fixed_view_mut::<1, 3>(k, 3).copy_from(&(arm * scale).transpose());
        }
        jacobian
    }

    /// Returns the condition number of the Jacobian, its turns scaled by the greatest distance of a
    /// platform joint from the platform's origin; infinite where legs hold no pose.
    #[must_use]
    pub fn condition(&self, platform: &Platform, legs: &[f64; LEGS]) -> f64 {
        let radius = self.platform.iter().map(|p| p.norm()).fold(0.0, f64::max);
        let mut jacobian = self.jacobian(platform, legs);
        for column in 3..6 {
            jacobian.column_mut(column).scale_mut(1.0 / radius);
        }
        let values = jacobian.singular_values();
        if values.min() > 0.0 { values.max() / values.min() } else { f64::INFINITY }
    }

    /// Returns where the platform stands on legs of these lengths, near `guess`.
    ///
    /// # Errors
    ///
    /// [`Unreachable::Head`] where Newton's method finds nothing from there.
    pub fn forward(&self, legs: &[f64; LEGS], guess: &Platform) -> Result<Platform, Unreachable> {
        let mut platform = *guess;
        let mut miss = self.miss(&platform, legs);
        for _ in 0..MOST_PASSES {
            let Some(residual) = miss else { break };
            if residual.amax() < FOUND_MM {
                return Ok(platform);
            }
            let Some(step) = self.jacobian_of(&platform).and_then(|j| j.lu().solve(&residual))
            else {
                break;
            };
            let Some((next, left)) = self.stepped(&platform, &step, legs, residual.norm()) else {
                break;
            };
            (platform, miss) = (next, Some(left));
        }
        match miss {
            Some(residual) if residual.amax() < GOOD_MM => Ok(platform),
            _ => {
                let value = miss.map_or(f64::INFINITY, |residual| residual.amax());
                let what = "gap between legs and platform";
                Err(Unreachable::Head { what, value, limit: GOOD_MM, unit: " mm" })
            }
        }
    }

    /// The platform after a step of Newton's, shortened until it is nearer; `None` where none is.
    fn stepped(
        &self,
        platform: &Platform,
        step: &Vector6<f64>,
        legs: &[f64; LEGS],
        before: f64,
    ) -> Option<(Platform, Vector6<f64>)> {
        const HALVINGS: i32 = 12;
        (0..HALVINGS).find_map(|k| {
            let step = step * 0.5_f64.powi(k);
            let next = Platform {
                origin: platform.origin + step.fixed_rows::<3>(0),
                turn: Rotation3::new(step.fixed_rows::<3>(3).into_owned()) * platform.turn,
            };
            let left = self.miss(&next, legs)?;
            (left.norm() < before).then_some((next, left))
        })
    }

    fn jacobian_of(&self, platform: &Platform) -> Option<Matrix6<f64>> {
        self.legs(platform).ok().map(|legs| self.jacobian(platform, &legs))
    }

    /// What the legs are to grow by, mm.
    fn miss(&self, platform: &Platform, legs: &[f64; LEGS]) -> Option<Vector6<f64>> {
        let now = self.legs(platform).ok()?;
        Some(Vector6::from_fn(|k, _| legs[k] - now[k]))
    }

    /// From base joint to platform joint.
    fn way(&self, platform: &Platform, k: usize) -> Vector3<f64> {
        platform.origin + platform.turn * self.platform[k] - self.base[k]
    }

    /// Along leg k, from its base joint, wherever that slid to.
    fn leg(&self, platform: &Platform, legs: &[f64; LEGS], k: usize) -> Vector3<f64> {
        let way = self.way(platform, k);
        self.rods.as_ref().map_or(way, |rods| way - rods.direction.into_inner() * legs[k])
    }

    /// Returns where the platform must stand for a nozzle in this place of the machine and direction.
    #[must_use]
    pub fn platform_of(&self, tip: &Vector3<f64>, axis: &UnitVector3<f64>) -> Platform {
        let origin = tip + axis.into_inner() * self.pivot_length - self.place;
        Platform { origin, turn: shortest_turn(axis) }
    }

    pub(super) fn stance(
        &self,
        pose: &Pose,
        near: BedTurn,
        alignment: &Alignment,
    ) -> Result<Stance, Unreachable> {
        let turn = self.bed_turn(pose, near, alignment)?;
        let platform = self.platform_at(pose, turn, alignment);
        let head = self.legs(&platform)?;
        Ok(Stance { base: Joints { s: 0.0, turn, z: 0.0 }, head })
    }

    /// How the bed stands: with the tip in the plane of the machine's x axis, where it turns at all.
    fn bed_turn(
        &self,
        pose: &Pose,
        near: BedTurn,
        alignment: &Alignment,
    ) -> Result<BedTurn, Unreachable> {
        if !self.turns_bed {
            return Ok(BedTurn::default());
        }
        let bed = alignment.over_bed(&pose.at.xy());
        Ok(alignment.joints_over_bed(&bed, pose.at.z, Branch::Near, near)?.turn)
    }

    fn platform_at(&self, pose: &Pose, turn: BedTurn, alignment: &Alignment) -> Platform {
        let azimuth = alignment.bed.azimuth(turn);
        let over = Rotation2::new(-azimuth) * alignment.over_bed(&pose.at.xy());
        let tip = over - off_axis(alignment, pose.at.z);
        let axis = UnitVector3::new_normalize(over_rail(&pose.axis, azimuth, alignment));
        self.platform_of(&Vector3::new(tip.x, tip.y, pose.at.z), &axis)
    }

    pub(super) fn pose(
        &self,
        stance: &Stance,
        near: &Pose,
        alignment: &Alignment,
    ) -> Result<Pose, Unreachable> {
        let turn = stance.base.turn;
        let guess = self.platform_at(near, turn, alignment);
        let home = Platform { origin: self.joints.home, turn: Rotation3::identity() };
        let platform =
            self.forward(&stance.head, &guess).or_else(|_| self.forward(&stance.head, &home))?;
        let axis = platform.turn * Vector3::z_axis();
        let tip = platform.origin + self.place - axis.into_inner() * self.pivot_length;
        let azimuth = alignment.bed.azimuth(turn);
        let over = Rotation2::new(azimuth) * (tip.xy() + off_axis(alignment, tip.z));
        let place = alignment.part_from_bed(&over);
        let at = Point3::new(place.x, place.y, tip.z);
        Ok(Pose { at, axis: in_part(&axis, azimuth, alignment) })
    }

    pub(super) fn check(
        &self,
        stance: &Stance,
        pose: &Pose,
        alignment: &Alignment,
    ) -> Result<(), Unreachable> {
        let platform = self.platform_at(pose, stance.base.turn, alignment);
        let legs = &stance.head;
        let condition = self.condition(&platform, legs);
        let limits = &self.joints;
        if condition > limits.condition {
            let what = "condition number of the legs";
            let (value, limit) = (condition, limits.condition);
            return Err(Unreachable::Head { what, value, limit, unit: "" });
        }
        let lean = self.greatest_lean(&platform, legs);
        if lean > limits.cone {
            let what = "lean of a leg in its joint";
            let (value, limit) = (lean.to_degrees(), limits.cone.to_degrees());
            return Err(Unreachable::Head { what, value, limit, unit: "°" });
        }
        let apart = self.least_distance(&platform, legs);
        if apart < limits.apart {
            let what = "distance between two legs";
            return Err(Unreachable::Head { what, value: apart, limit: limits.apart, unit: " mm" });
        }
        Ok(())
    }

    /// Returns the greatest angle between a leg and where it points with the platform at home, at either
    /// joint: the base's does not turn, the platform's turns with it. Radians.
    #[must_use]
    pub fn greatest_lean(&self, platform: &Platform, legs: &[f64; LEGS]) -> f64 {
        let home = Platform { origin: self.joints.home, turn: Rotation3::identity() };
        let Ok(home_legs) = self.legs(&home) else { return std::f64::consts::PI };
        let mut greatest: f64 = 0.0;
        for k in 0..LEGS {
            let leg = self.leg(platform, legs, k);
            let home = self.leg(&home, &home_legs, k);
            let turned = platform.turn.inverse() * leg;
            greatest = greatest.max(leg.angle(&home)).max(turned.angle(&home));
        }
        greatest
    }

    /// Returns the least distance between two legs that share no joint, mm; infinite where all do.
    #[must_use]
    pub fn least_distance(&self, platform: &Platform, legs: &[f64; LEGS]) -> f64 {
        let ends: [[Vector3<f64>; 2]; LEGS] = std::array::from_fn(|k| {
            let top = platform.origin + platform.turn * self.platform[k];
            [top - self.leg(platform, legs, k), top]
        });
        let mut least = f64::INFINITY;
        for i in 0..LEGS {
            for j in 0..i {
                let joined = (0..2).any(|e| (ends[i][e] - ends[j][e]).norm() < SHARED_MM);
                if !joined {
                    least = least.min(between_segments(&ends[i], &ends[j]));
                }
            }
        }
        least
    }
}

/// Where the origin of the machine's drives lies beside the axis at a height, mm.
fn off_axis(alignment: &Alignment, z: f64) -> Vector2<f64> {
    Vector2::new(alignment.a + alignment.a1 * z, alignment.miss(z))
}

/// The distance of two segments, mm: least over the feet of their common normal and of their ends.
fn between_segments(p: &[Vector3<f64>; 2], q: &[Vector3<f64>; 2]) -> f64 {
    let (u, v, w) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let to_segment = |a: &Vector3<f64>, s: &[Vector3<f64>; 2]| {
        let along = s[1] - s[0];
        let square = along.norm_squared();
        let t = if square > 0.0 { ((a - s[0]).dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
        (a - s[0] - along * t).norm()
    };
    let ends = p.iter().map(|a| to_segment(a, q)).chain(q.iter().map(|b| to_segment(b, p)));
    let mut least = ends.fold(f64::INFINITY, f64::min);
    let (a, b, c) = (u.norm_squared(), u.dot(&v), v.norm_squared());
    let determinant = a * c - b * b;
    if determinant > 0.0 {
        let (d, e) = (u.dot(&w), v.dot(&w));
        let (s, t) = ((b * e - c * d) / determinant, (a * e - b * d) / determinant);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            least = least.min((w + u * s - v * t).norm());
        }
    }
    least
}

const _: () = assert!(LEGS <= HEAD_AXES);

#[cfg(test)]
mod tests {
    use super::super::Head;
    use super::*;

    const LEG: Axis = Axis { min: 80.0, max: 400.0, speed: 100.0, acceleration: 1000.0 };

    const TWELVE_DEG: f64 = 12.0 * std::f64::consts::PI / 180.0;

    fn layouts() -> [Layout; 3] {
        let layout = |base_radius, platform_radius, base_half_angle, platform_half_angle| Layout {
            base_radius,
            platform_radius,
            base_half_angle,
            platform_half_angle,
        };
        [
            layout(150.0, 110.0, TWELVE_DEG, TWELVE_DEG),
            layout(150.0, 110.0, TWELVE_DEG, 0.0),
            layout(120.0, 120.0, 0.0, 0.0),
        ]
    }

    fn hexapod(layout: &Layout) -> Hexapod {
        let home = Vector3::new(0.0, 0.0, layout.height_at_45());
        let joints = JointLimits { cone: 1.0, home, apart: 5.0, condition: 20.0, tilt: 0.7 };
        Hexapod::new(layout.joints(), 45.0, LEG, joints)
    }

    fn platform(height: f64, k: u32) -> Platform {
        let t = f64::from(k);
        let spread = |by: f64, size: f64| ((t * by).fract() - 0.5) * size;
        let origin =
            Vector3::new(spread(0.618, 60.0), spread(0.37, 60.0), height + spread(0.73, 40.0));
        let turn =
            Rotation3::from_euler_angles(spread(0.29, 0.6), spread(0.41, 0.6), spread(0.53, 0.6));
        Platform { origin, turn }
    }

    #[test]
    fn forward_undoes_inverse_in_all_layouts_from_home() {
        for layout in layouts() {
            let slides = Rods { length: 260.0, direction: Vector3::z_axis() };
            for rods in [None, Some(slides)] {
                let hexapod = Hexapod { rods, ..hexapod(&layout) };
                let height = layout.height_at_45();
                let home = Platform {
                    origin: Vector3::new(0.0, 0.0, height),
                    turn: Rotation3::identity(),
                };
                for k in 0..300 {
                    let wanted = platform(height, k);
                    let found = hexapod.forward(&hexapod.legs(&wanted).unwrap(), &home).unwrap();
                    assert!((found.origin - wanted.origin).norm() < 1e-8, "{layout:?} {k}");
                    assert!(
                        (found.turn.matrix() - wanted.turn.matrix()).norm() < 1e-9,
                        "{layout:?} {k}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_jacobian_is_the_rate_of_the_legs() {
        let slides = Rods { length: 260.0, direction: Vector3::z_axis() };
        for rods in [None, Some(slides)] {
            let hexapod = Hexapod { rods, ..hexapod(&layouts()[1]) };
            let at = platform(110.0, 7);
            let legs = hexapod.legs(&at).unwrap();
            let jacobian = hexapod.jacobian(&at, &legs);
            for k in 0..6 {
                let step = 1e-6;
                let mut rate = Vector6::zeros();
                rate[k] = step;
                let moved = Platform {
                    origin: at.origin + rate.fixed_rows::<3>(0),
                    turn: Rotation3::new(rate.fixed_rows::<3>(3).into_owned()) * at.turn,
                };
                let after = hexapod.legs(&moved).unwrap();
                for leg in 0..6 {
                    let slope = (after[leg] - legs[leg]) / step;
                    assert!((slope - jacobian[(leg, k)]).abs() < 1e-4, "{k} {leg} {slope}");
                }
            }
        }
    }

    #[test]
    fn conditions_are_the_published_ones_and_a_quarter_turn_holds_nothing() {
        for (layout, published) in layouts().iter().zip([1.51, 1.48, 2.0]) {
            let hexapod = hexapod(layout);
            let mut at = Platform { origin: hexapod.joints.home, turn: Rotation3::identity() };
            let condition = |at: &Platform| hexapod.condition(at, &hexapod.legs(at).unwrap());
            assert!((condition(&at) - published).abs() < 0.005, "{}", condition(&at));
            at.turn = Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
            assert!(condition(&at) > 1e12);
        }
    }

    #[test]
    fn poses_over_a_turning_and_a_standing_bed_come_back() {
        let ideal = Alignment { a: 0.2, b: 0.35, a1: 0.001, b1: -0.002, ..Alignment::IDEAL };
        for turns_bed in [true, false] {
            let base = hexapod(&layouts()[1]);
            let head = Head::Hexapod(Box::new(Hexapod { turns_bed, ..base }));
            for k in 0..400 {
                let t = f64::from(k);
                let (radius, azimuth) = (1.0 + 40.0 * (t * 0.618).fract(), t * 2.4);
                let (x, y) = (radius * azimuth.cos(), radius * azimuth.sin());
                let at = Point3::new(x, y, 50.0 + 40.0 * (t * 0.37).fract());
                let lean = 0.4 * (t * 0.71).fract();
                let axis = Vector3::new(lean.sin() * t.cos(), lean.sin() * t.sin(), lean.cos());
                let wanted = Pose { at, axis: UnitVector3::new_normalize(axis) };
                let near = BedTurn::accumulated(t);
                let stance = head.stance(&wanted, near, &ideal).unwrap().stance;
                let back = head.pose(&stance, &Pose::upright(at), &ideal).unwrap();
                assert!((back.at - at).norm() < 1e-8, "{k} {}", back.at - at);
                assert!((back.axis.into_inner() - axis).norm() < 1e-9);
                assert!(turns_bed || stance.base.turn == BedTurn::default());
            }
        }
    }

    #[test]
    fn joints_are_held_to_their_bounds() {
        let ideal = Alignment::IDEAL;
        let high = |lean: f64| Pose {
            at: Point3::new(5.0, 0.0, 70.0),
            axis: UnitVector3::new_normalize(Vector3::new(lean.sin(), 0.0, lean.cos())),
        };
        let tight = hexapod(&layouts()[1]);
        let check = |hexapod: &Hexapod, pose: &Pose| {
            let head = Head::Hexapod(Box::new(hexapod.clone()));
            let stance = head.stance(pose, BedTurn::default(), &ideal).unwrap().stance;
            head.check(&stance, pose, &ideal).err().map(|error| error.to_string())
        };
        assert_eq!(check(&tight, &high(0.1)), None);
        let limits = tight.joints;
        let with = |joints| Hexapod { joints, ..tight.clone() };
        let says = |found: Option<String>, what: &str| {
            assert!(found.as_ref().is_some_and(|text| text.contains(what)), "{found:?}");
        };
        says(check(&with(JointLimits { cone: 0.05, ..limits }), &high(0.3)), "lean of a leg");
        says(check(&with(JointLimits { condition: 1.2, ..limits }), &high(0.1)), "condition");
        says(check(&with(JointLimits { apart: 90.0, ..limits }), &high(0.1)), "between two legs");
        says(check(&tight, &Pose::upright(Point3::new(0.0, 0.0, 600.0))), "leg X");
    }

    #[test]
    fn segments_are_as_far_apart_as_their_nearest_points() {
        let v = Vector3::new;
        let along = [v(0.0, 0.0, 0.0), v(10.0, 0.0, 0.0)];
        assert_eq!(between_segments(&along, &[v(5.0, -3.0, 2.0), v(5.0, 3.0, 2.0)]), 2.0);
        assert_eq!(between_segments(&along, &[v(13.0, 0.0, 4.0), v(20.0, 0.0, 4.0)]), 5.0);
        assert_eq!(between_segments(&along, &[v(0.0, 1.0, 0.0), v(10.0, 1.0, 0.0)]), 1.0);
    }
}
