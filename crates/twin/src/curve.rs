//! The path of the nozzle over the part during one move.
//!
//! A firmware runs its words linearly from one line to the next. In joints the nozzle stands at
//! `w(t) = w0 + t·w'` in the frame of the rail, `w = (s + a + a1·z, b + b1·z)`, while the bed turns
//! by `θ(t) = θ0 + t·θ'`; over the bed it is at `q(t) = Rz(θ(t))·w(t)`, a piece of a spiral. In
//! part coordinates `θ' = 0` and the same formula is a straight line. Shape and size are those of
//! the path over the part, which lies on the bed by a rigid move. mm, radians, `t` from 0 to 1.
//!
//! * Length. `|dq/dt|² = |w' + θ'·ŵ|²` (ŵ: w turned by a right angle) is a polynomial of degree 2
//!   in `t`, the lift adds a constant, and the integral of its square root has a closed form.
//! * Nearest approach to the axis. `|q| = |w|`, and `w` runs straight: the foot of a
//!   perpendicular.
//! * Distance from the chord. `q'' = Rz(θ)·(2θ'·ŵ' − θ'²·w)` bounds it by `max|q''|/8`; only where
//!   the bound matters the curve is sampled.
//!
//! Source: own derivation. The rate of the nozzle in rail axes is the polar printer's
//! `u' = t_x + v·t_y/u`, `θ' = t_y/u` read backwards.

use nalgebra::{Point3, Vector2};

use machine::kinematics::Alignment;
use machine::program::Joints;

/// One move's path over the bed. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// Where the nozzle starts, in the frame of the rail, mm.
    from: Vector2<f64>,
    /// How far it runs in that frame, mm.
    by: Vector2<f64>,
    /// The turn of the bed at the start, radians.
    turn_from: f64,
    /// How far the bed turns, radians.
    turn_by: f64,
    /// How far the nozzle rises, mm.
    lift: f64,
}

/// Parts into which a curve is divided where its distance from the chord is sampled. For turns of
/// up to half a turn the greatest of the seven samples is within 1 % of the greatest distance.
const SAMPLED_PARTS: u32 = 8;

/// Up to this ratio between the greatest and the least squared speed of the nozzle along a curve
/// five points of Gauss and Legendre give the length to 3e-8 of it; the closed form, which would
/// lose digits where the speed hardly changes, takes the rest.
const EVEN_SPEED: f64 = 1.25;

impl Curve {
    /// Returns the path between two positions of the joints.
    #[must_use]
    pub fn between_joints(from: &Joints, to: &Joints, alignment: &Alignment) -> Self {
        let start = nozzle_over_rail(from, alignment);
        let turn_from = alignment.bed.azimuth(from.turn);
        Self {
            from: start,
            by: nozzle_over_rail(to, alignment) - start,
            turn_from,
            turn_by: alignment.bed.azimuth(to.turn) - turn_from,
            lift: to.z - from.z,
        }
    }

    /// Returns the straight path between two places of the part.
    #[must_use]
    pub fn between_points(from: &Point3<f64>, to: &Point3<f64>, alignment: &Alignment) -> Self {
        let start = alignment.over_bed(&from.xy());
        Self {
            from: start,
            by: alignment.over_bed(&to.xy()) - start,
            turn_from: 0.0,
            turn_by: 0.0,
            lift: to.z - from.z,
        }
    }

    /// Returns where the nozzle is over the bed, seen from the axis, when a share `t` of the move
    /// is done, mm.
    #[must_use]
    pub fn over_bed(&self, t: f64) -> Vector2<f64> {
        turned(self.from + self.by * t, (self.turn_from + self.turn_by * t).sin_cos())
    }

    /// Returns how far the bed turns, radians.
    #[must_use]
    pub fn turn(&self) -> f64 {
        self.turn_by
    }

    /// Returns the distance from the axis when a share `t` of the move is done, mm.
    #[must_use]
    pub fn radius(&self, t: f64) -> f64 {
        (self.from + self.by * t).norm()
    }

    /// Returns the least distance from the axis on the way, mm.
    #[must_use]
    pub fn nearest_to_axis(&self) -> f64 {
        let square = self.by.norm_squared();
        if square == 0.0 {
            return self.from.norm();
        }
        self.radius((-self.from.dot(&self.by) / square).clamp(0.0, 1.0))
    }

    /// Returns the length of the path over the part, mm.
    #[must_use]
    pub fn length(&self) -> f64 {
        if self.turn_by == 0.0 {
            return (self.by.norm_squared() + self.lift * self.lift).sqrt();
        }
        let start = self.by + right_angle(&self.from) * self.turn_by;
        let change = right_angle(&self.by) * self.turn_by;
        let speed = Quadratic {
            square: change.norm_squared(),
            linear: 2.0 * start.dot(&change),
            constant: start.norm_squared() + self.lift * self.lift,
        };
        speed.integral_of_root()
    }

    /// Returns a bound of the distance between the path and its chord, mm.
    #[must_use]
    pub fn deviation_bound(&self) -> f64 {
        let turn = self.turn_by.abs();
        if turn == 0.0 {
            return 0.0;
        }
        let reach = self.radius(0.0).max(self.radius(1.0));
        (2.0 * turn * self.by.norm() + turn * turn * reach) / 8.0
    }

    /// Returns the greatest distance from the chord of the points of the path that are farther
    /// than `beyond` from the axis, mm. Sampled: up to 1 % too small.
    #[must_use]
    pub fn deviation(&self, beyond: f64) -> f64 {
        let step = 1.0 / f64::from(SAMPLED_PARTS);
        // The turn at the start shifts nothing, so one pair of sine and cosine serves all samples.
        let by_one = (self.turn_by * step).sin_cos();
        let end = turned(self.from + self.by, self.turn_by.sin_cos());
        let mut turn = by_one;
        let mut worst: f64 = 0.0;
        for k in 1..SAMPLED_PARTS {
            let nozzle = self.from + self.by * (f64::from(k) * step);
            if nozzle.norm() > beyond {
                worst = worst.max(distance_to_chord(&self.from, &end, &turned(nozzle, turn)));
            }
            turn = (turn.0 * by_one.1 + turn.1 * by_one.0, turn.1 * by_one.1 - turn.0 * by_one.0);
        }
        worst
    }
}

/// Returns where the nozzle stands in the frame of the rail, which does not turn, mm.
fn nozzle_over_rail(joints: &Joints, alignment: &Alignment) -> Vector2<f64> {
    Vector2::new(
        joints.s + alignment.a + alignment.a1 * joints.z,
        alignment.b + alignment.b1 * joints.z,
    )
}

fn right_angle(v: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}

fn turned(v: Vector2<f64>, (sin, cos): (f64, f64)) -> Vector2<f64> {
    Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

fn distance_to_chord(from: &Vector2<f64>, to: &Vector2<f64>, p: &Vector2<f64>) -> f64 {
    geom::polyline::distance_to_segment(&(*from).into(), &(*to).into(), &(*p).into())
}

/// `square·t² + linear·t + constant`, nowhere negative.
struct Quadratic {
    square: f64,
    linear: f64,
    constant: f64,
}

impl Quadratic {
    fn at(&self, t: f64) -> f64 {
        ((self.square * t + self.linear) * t + self.constant).max(0.0)
    }

    /// Returns the integral of the root from 0 to 1.
    fn integral_of_root(&self) -> f64 {
        let (first, last) = (self.at(0.0), self.at(1.0));
        let most = first.max(last);
        let mut least = first.min(last);
        if self.square > 0.0 {
            least = least.min(self.at((-self.linear / (2.0 * self.square)).clamp(0.0, 1.0)));
        }
        if most <= EVEN_SPEED * least || self.square == 0.0 {
            return self.by_gauss();
        }
        self.by_primitive()
    }

    fn by_primitive(&self) -> f64 {
        // square·((t + p)² + k²), whose root has the primitive below in τ = t + p.
        let p = self.linear / (2.0 * self.square);
        let k_square = (self.constant / self.square - p * p).max(0.0);
        let k = k_square.sqrt();
        let primitive = |tau: f64| {
            let bend = if k > 0.0 { k_square * (tau / k).asinh() } else { 0.0 };
            0.5 * (tau * (tau * tau + k_square).sqrt() + bend)
        };
        self.square.sqrt() * (primitive(1.0 + p) - primitive(p))
    }

    fn by_gauss(&self) -> f64 {
        // Nodes and weights of degree 5 on (−1, 1), Abramowitz and Stegun, table 25.4.
        const NODES: [(f64, f64); 2] = [
            (0.538_469_310_105_683, 0.478_628_670_499_366),
            (0.906_179_845_938_664, 0.236_926_885_056_189),
        ];
        const MIDDLE: f64 = 0.568_888_888_888_889;
        let root = |t: f64| self.at(t).sqrt();
        let outer: f64 = NODES
            .iter()
            .map(|(x, weight)| weight * (root(0.5 - 0.5 * x) + root(0.5 + 0.5 * x)))
            .sum();
        0.5 * (MIDDLE * root(0.5) + outer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::program::BedTurn;
    use std::f64::consts::PI;

    const LEANING: Alignment = Alignment {
        a: 0.2,
        b: 0.35,
        a1: 0.0015,
        b1: -0.002,
        plate_offset: Vector2::new(0.3, -0.4),
        plate_angle: 0.05,
        ..Alignment::IDEAL
    };

    fn joints(s: f64, turn: f64, z: f64) -> Joints {
        Joints { s, turn: BedTurn::accumulated(turn), z }
    }

    fn some_moves() -> impl Iterator<Item = (Joints, Joints)> {
        (0..400_u32).map(|i| {
            let t = f64::from(i);
            let part = |share: f64, span: f64| (t * share).fract() * span;
            let from = joints(part(0.618, 60.0) - 10.0, part(0.37, 90.0), part(0.11, 50.0));
            let size = 10.0_f64.powf(part(0.23, 5.0) - 4.0);
            let by = [part(0.71, 2.0) - 1.0, part(0.53, 2.0) - 1.0, part(0.29, 1.0) - 0.5];
            let turn = from.turn.radians() + by[1] * (size * 0.3).min(PI);
            (from, joints(from.s + by[0] * size, turn, from.z + by[2] * size))
        })
    }

    /// Where the shared forward kinematics puts the nozzle.
    fn by_kinematics(from: &Joints, to: &Joints, t: f64) -> Point3<f64> {
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let turn = mix(from.turn.radians(), to.turn.radians());
        LEANING.part_from_joints(&joints(mix(from.s, to.s), turn, mix(from.z, to.z)))
    }

    #[test]
    fn length_equals_a_fine_polyline() {
        for (from, to) in some_moves() {
            let count = 4000;
            let point = |k: i32| by_kinematics(&from, &to, f64::from(k) / f64::from(count));
            let expected: f64 = (0..count).map(|k| (point(k + 1) - point(k)).norm()).sum();
            let length = Curve::between_joints(&from, &to, &LEANING).length();
            let allowed = 1e-7 * expected + 1e-10;
            assert!((length - expected).abs() < allowed, "{from:?} {to:?} {length} {expected}");
        }
    }

    #[test]
    fn both_ways_to_the_length_agree_where_they_meet() {
        for (p, k) in
            [(-0.5, 1.0), (-0.5, 1.001), (0.0, 2.0), (8.0, 4.0), (-12.0, 0.5), (30.0, 9.0)]
        {
            let quadratic =
                Quadratic { square: 7.0, linear: 14.0 * p, constant: 7.0 * (p * p + k * k) };
            let ratio = quadratic.at(1.0).max(quadratic.at(0.0))
                / quadratic
                    .at(0.0)
                    .min(quadratic.at(1.0))
                    .min(quadratic.at(f64::clamp(-p, 0.0, 1.0)));
            assert!(ratio < EVEN_SPEED * 1.01, "{ratio}");
            let off = quadratic.by_gauss() / quadratic.by_primitive() - 1.0;
            assert!(off.abs() < 3e-8, "{p} {k}: {off}");
        }
    }

    #[test]
    fn a_pure_turn_is_an_arc() {
        let ideal = Alignment::default();
        let curve = Curve::between_joints(&joints(20.0, 1.0, 3.0), &joints(20.0, 1.5, 3.0), &ideal);
        assert!((curve.length() - 10.0).abs() < 1e-12);
        assert_eq!(curve.nearest_to_axis(), 20.0);
        let sagitta = 20.0 * (1.0 - 0.25_f64.cos());
        assert!((curve.deviation(1.0) - sagitta).abs() < 1e-12);
        assert!(curve.deviation_bound() >= sagitta);
        assert_eq!(curve.deviation(25.0), 0.0);
    }

    #[test]
    fn through_the_axis_the_length_is_that_of_the_rail() {
        let ideal = Alignment::default();
        let curve = Curve::between_joints(&joints(5.0, 0.0, 0.0), &joints(-3.0, 0.0, 0.0), &ideal);
        assert_eq!((curve.length(), curve.nearest_to_axis()), (8.0, 0.0));
        // A turn on the way: the length of an Archimedean spiral, twice from its pole.
        let curve = Curve::between_joints(&joints(4.0, 0.0, 0.0), &joints(-4.0, PI, 0.0), &ideal);
        let half_turn = PI / 2.0;
        let pitch = 4.0 / half_turn;
        let spiral = pitch / 2.0 * (half_turn * half_turn.hypot(1.0) + half_turn.asinh());
        assert!((curve.length() - 2.0 * spiral).abs() < 1e-12);
    }

    #[test]
    fn deviation_equals_a_fine_search_and_keeps_its_bound() {
        for (from, to) in some_moves() {
            let curve = Curve::between_joints(&from, &to, &LEANING);
            let (a, b) = (curve.over_bed(0.0), curve.over_bed(1.0));
            let far = |t: f64| distance_to_chord(&a, &b, &curve.over_bed(t));
            let expected = (0..=512).map(|k| far(f64::from(k) / 512.0)).fold(0.0, f64::max);
            let found = curve.deviation(0.0);
            assert!(found <= expected + 1e-12, "{from:?} {to:?}");
            assert!(expected <= found * 1.01 + 1e-9, "{from:?} {to:?} {found} {expected}");
            assert!(expected <= curve.deviation_bound() + 1e-12);
        }
    }

    #[test]
    fn the_bed_frame_is_that_of_the_kinematics() {
        for (from, to) in some_moves().take(40) {
            let curve = Curve::between_joints(&from, &to, &LEANING);
            for t in [0.0, 0.3, 1.0] {
                let part = LEANING.part_from_bed(&curve.over_bed(t));
                assert!((part - by_kinematics(&from, &to, t).xy()).norm() < 1e-9);
            }
        }
        let points = [Point3::new(3.0, 4.0, 1.0), Point3::new(-3.0, 4.0, 1.0)];
        let straight = Curve::between_points(&points[0], &points[1], &Alignment::default());
        assert_eq!((straight.length(), straight.nearest_to_axis()), (6.0, 4.0));
        assert_eq!((straight.deviation(0.0), straight.turn()), (0.0, 0.0));
    }
}
