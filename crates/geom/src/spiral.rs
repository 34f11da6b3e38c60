//! The Archimedean spiral and its exact crossings with straight segments.
//!
//! The spiral runs from the origin outwards; at parameter `tau` (radians turned, 0 at the origin)
//! it lies at radius `pitch·tau/2π` and azimuth `±tau + phase`. Turns are exactly `pitch` apart
//! along every ray, which makes it the natural infill of a turning bed.
//!
//! Crossings: with `b = pitch/2π`, a point `(rho, phi)` lies on the spiral exactly where
//! `G = (rho/b − chi·(phi − phase))/2π` is an integer (`chi` = +1 counter-clockwise, −1
//! clockwise). Along a straight line at distance `d` from the origin `G` has one extremum, at
//! `u² = (√(d⁴ + 4b²d²) − d²)/2` from the foot of the origin; between extremum and ends `G` is
//! monotone, so the crossings are the integers between the values there. Values at shared ends
//! are computed once and counted half-open, so that a closed ring is crossed an even number of
//! times (odd where it goes round the origin).

use nalgebra::{Point2, Vector2};
use std::f64::consts::TAU;

/// Which way the azimuth grows along the spiral, from the origin outwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turning {
    /// Counter-clockwise seen from above.
    CounterClockwise,
    /// Clockwise seen from above.
    Clockwise,
}

/// An Archimedean spiral about the origin. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spiral {
    /// Distance between neighbouring turns along a ray, mm, positive.
    pub pitch: f64,
    /// Azimuth at which it leaves the origin, radians.
    pub phase: f64,
    /// Which way it turns.
    pub turning: Turning,
}

/// A place where a segment crosses a spiral.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The spiral's parameter, radians turned from the origin.
    pub tau: f64,
    /// The share of the segment before the crossing, 0 to 1.
    pub share: f64,
}

/// Steps after which a root search stops in any case; 60 halvings exhaust an `f64`.
const MOST_STEPS: usize = 64;

/// Largest turn between two points of a flattened spiral, radians: 20 degrees, so that a tolerance
/// as wide as the first turn still leaves a round curve.
const LARGEST_STEP: f64 = 0.35;

impl Spiral {
    /// Radius gained per radian.
    fn growth(&self) -> f64 {
        self.pitch / TAU
    }

    fn chi(&self) -> f64 {
        match self.turning {
            Turning::CounterClockwise => 1.0,
            Turning::Clockwise => -1.0,
        }
    }

    /// Returns the point at parameter `tau`.
    #[must_use]
    pub fn at(&self, tau: f64) -> Point2<f64> {
        let (sin, cos) = (self.chi() * tau + self.phase).sin_cos();
        Point2::new(cos, sin) * (self.growth() * tau)
    }

    /// Returns the parameter at radius `rho` (mm).
    #[must_use]
    pub fn tau_at(&self, rho: f64) -> f64 {
        rho / self.growth()
    }

    /// Returns the parameter at which the spiral passes nearest to a place on the ray through it: less
    /// than half a pitch away, except inside the first turn.
    #[must_use]
    pub fn nearest_turn(&self, p: &Point2<f64>) -> f64 {
        let (turns, rho) = (self.value(p), p.coords.norm());
        self.tau_at(rho) - TAU * (turns - turns.round())
    }

    /// Returns points along the spiral from `tau0` to `tau1` (either may be larger), both ends
    /// included, so that no chord lies farther than `tolerance` (mm) from the curve.
    #[must_use]
    pub fn flatten(&self, tau0: f64, tau1: f64, tolerance: f64) -> Vec<Point2<f64>> {
        let (low, high) = (tau0.min(tau1), tau0.max(tau1));
        let mut points = vec![self.at(low)];
        let mut tau = low;
        while tau < high {
            // The radius of curvature grows along the curve, so the inner end of a step decides:
            // b·(1 + tau²)^(3/2)/(2 + tau²); an arc of length ds is ds/(b·√(1 + tau²)) of tau.
            let square = tau * tau;
            let radius = self.growth() * (1.0 + square).powf(1.5) / (2.0 + square);
            let arc = 2.0 * (1.0 - tolerance / radius).max(0.0).acos();
            let step = (arc * (1.0 + square) / (2.0 + square)).min(LARGEST_STEP);
            tau = if tau + 1.5 * step < high { tau + step } else { high };
            points.push(self.at(tau));
        }
        if tau0 > tau1 {
            points.reverse();
        }
        points
    }

    /// Returns where the segment from `a` to `b` crosses the spiral, in no particular order.
    #[must_use]
    pub fn crossings(&self, a: &Point2<f64>, b: &Point2<f64>) -> Vec<Crossing> {
        let along = b - a;
        let length = along.norm();
        if length == 0.0 {
            return Vec::new();
        }
        let line = Line::new(self, a, b, &(along / length));
        let mut found = Vec::new();
        if line.distance == 0.0 && line.start <= 0.0 && line.end >= 0.0 {
            // Through the origin: the azimuth jumps there, the two halves are separate rays.
            let ray = |p: &Point2<f64>, from: f64, to: f64| Line {
                from: (from, self.value_at(from.abs(), p.y.atan2(p.x))),
                to: (to, self.value_at(to.abs(), p.y.atan2(p.x))),
                ..line
            };
            ray(a, line.start, 0.0).roots(&mut found);
            ray(b, 0.0, line.end).roots(&mut found);
            return found;
        }
        let extremum = line.extremum().filter(|u| line.start < *u && *u < line.end);
        let Some(u) = extremum else {
            line.roots(&mut found);
            return found;
        };
        let split = (u, line.value(u));
        Line { to: split, ..line }.roots(&mut found);
        Line { from: split, ..line }.roots(&mut found);
        found
    }

    /// `G` at a point, with the azimuth in (−π, π].
    fn value(&self, p: &Point2<f64>) -> f64 {
        self.value_at(p.coords.norm(), p.y.atan2(p.x))
    }

    fn value_at(&self, rho: f64, azimuth: f64) -> f64 {
        (rho / self.growth() - self.chi() * (azimuth - self.phase)) / TAU
    }
}

/// A segment in the coordinates of its own line, `u` measured from the foot of the origin, and a
/// piece of it from which the values of `G` are continued.
#[derive(Clone, Copy)]
struct Line<'a> {
    spiral: &'a Spiral,
    /// Distance of the line from the origin, positive when the segment turns counter-clockwise
    /// about it.
    distance: f64,
    /// The segment's ends.
    start: f64,
    end: f64,
    /// `u` and `G` at the ends of the piece. The azimuth is walked from there, so that no branch
    /// cut can fall between.
    from: (f64, f64),
    to: (f64, f64),
}

impl<'a> Line<'a> {
    fn new(spiral: &'a Spiral, a: &Point2<f64>, b: &Point2<f64>, unit: &Vector2<f64>) -> Self {
        let (start, end) = (a.coords.dot(unit), b.coords.dot(unit));
        // The azimuth at b in (−π, π] and the one reached by walking there from a differ by whole
        // turns, which shift G by whole numbers and keep the value at b the same from both sides.
        let walked = a.y.atan2(a.x) + a.coords.perp(&b.coords).atan2(a.coords.dot(&b.coords));
        let whole_turns = ((walked - b.y.atan2(b.x)) / TAU).round();
        Self {
            spiral,
            distance: a.coords.perp(unit),
            start,
            end,
            from: (start, spiral.value(a)),
            to: (end, spiral.value(b) - spiral.chi() * whole_turns),
        }
    }

    /// `G` at `u`, continued from the start of the piece.
    fn value(&self, u: f64) -> f64 {
        let (b, chi) = (self.spiral.growth(), self.spiral.chi());
        let (u0, g0) = self.from;
        let turned = if self.distance == 0.0 {
            0.0
        } else {
            (u / self.distance).atan() - (u0 / self.distance).atan()
        };
        g0 + ((u.hypot(self.distance) - u0.hypot(self.distance)) / b - chi * turned) / TAU
    }

    /// Where `G` is least; none on a line through the origin.
    fn extremum(&self) -> Option<f64> {
        let (b, d) = (self.spiral.growth(), self.distance);
        if d == 0.0 {
            return None;
        }
        let d2 = d * d;
        // (√(d⁴ + 4b²d²) − d²)/2 without the cancellation.
        let u2 = 2.0 * b * b * d2 / ((d2 * d2 + 4.0 * b * b * d2).sqrt() + d2);
        Some(u2.sqrt().copysign(self.spiral.chi() * d))
    }

    /// Appends the crossings on the piece, along which `G` must be monotone.
    fn roots(&self, found: &mut Vec<Crossing>) {
        let (g0, g1) = (self.from.1, self.to.1);
        let mut whole = g0.min(g1).floor() + 1.0;
        while whole <= g0.max(g1).floor() {
            let u = self.root(whole);
            found.push(Crossing {
                tau: u.hypot(self.distance) / self.spiral.growth(),
                share: ((u - self.start) / (self.end - self.start)).clamp(0.0, 1.0),
            });
            whole += 1.0;
        }
    }

    /// The `u` on the piece at which `G` is `target`: Newton's method, kept inside a bracket that
    /// every step shrinks.
    fn root(&self, target: f64) -> f64 {
        let (b, chi, d) = (self.spiral.growth(), self.spiral.chi(), self.distance);
        let ((u0, g0), (u1, g1)) = (self.from, self.to);
        let (mut below, mut above) = if g0 < g1 { (u0, u1) } else { (u1, u0) };
        let mut u = u0 + (u1 - u0) * ((target - g0) / (g1 - g0)).clamp(0.0, 1.0);
        for _ in 0..MOST_STEPS {
            let excess = self.value(u) - target;
            if excess == 0.0 {
                break;
            }
            if excess < 0.0 {
                below = u;
            } else {
                above = u;
            }
            let rho = u.hypot(d);
            let slope = (u / (rho * b) - chi * d / (rho * rho)) / TAU;
            let newton = u - excess / slope;
            let inside = (newton - below) * (newton - above) < 0.0;
            let next = if inside { newton } else { f64::midpoint(below, above) };
            if next == u {
                break;
            }
            u = next;
        }
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [Turning; 2] = [Turning::CounterClockwise, Turning::Clockwise];

    #[test]
    fn turns_are_a_pitch_apart_on_every_ray() {
        let spiral = Spiral { pitch: 0.4, phase: 0.7, turning: Turning::Clockwise };
        for tau in [1.0, 9.0, 200.0] {
            let (p, q) = (spiral.at(tau), spiral.at(tau + TAU));
            assert!((q.coords.norm() - p.coords.norm() - 0.4).abs() < 1e-12);
            assert!(p.coords.perp(&q.coords).abs() < 1e-9);
        }
    }

    #[test]
    fn the_nearest_turn_lies_on_the_ray() {
        for turning in BOTH {
            let spiral = Spiral { pitch: 0.4, phase: 0.7, turning };
            for (k, off) in [-0.19, -0.1, 0.0, 0.15].into_iter().enumerate() {
                let tau = 20.0 + 9.1 * k as f64;
                let at = spiral.at(tau);
                let beside = at + at.coords.normalize() * off;
                assert!((spiral.nearest_turn(&beside) - tau).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn crossings_lie_on_segment_and_spiral() {
        for turning in BOTH {
            let spiral = Spiral { pitch: 0.9, phase: -2.1, turning };
            for (a, b) in [
                ([-7.0, 3.0], [9.0, 2.0]),
                ([0.2, 0.1], [0.3, -0.4]),
                ([-5.0, 0.01], [6.0, -0.01]),
                ([-5.0, 0.0], [4.0, 0.0]),
                ([0.0, 0.0], [3.0, 4.0]),
                ([-3.0, 1.0], [-3.0, -1.0]),
            ] {
                let (a, b) = (Point2::from(a), Point2::from(b));
                let found = spiral.crossings(&a, &b);
                for c in &found {
                    let on_segment = a + (b - a) * c.share;
                    assert!((on_segment - spiral.at(c.tau)).norm() < 1e-9, "{a} {b} {c:?}");
                }
                // Counting sign changes along a fine walk finds as many.
                let mut count = 0;
                let steps = 400_000_u32;
                let wrapped = |p: Point2<f64>| spiral.value(&p).rem_euclid(1.0);
                let mut last = wrapped(a);
                for i in 1..=steps {
                    let next = wrapped(a + (b - a) * (f64::from(i) / f64::from(steps)));
                    if (next - last).abs() > 0.5 {
                        count += 1;
                    }
                    last = next;
                }
                assert!(found.len().abs_diff(count) <= 1, "{} not {count}", found.len());
            }
        }
    }

    #[test]
    fn rings_are_crossed_evenly_unless_they_hold_the_origin() {
        for turning in BOTH {
            for centre in [[0.0, 0.0], [3.0, 1.0], [0.9, 0.0], [-0.3, 0.2], [-1.3, 0.0]] {
                let spiral = Spiral { pitch: 0.37, phase: 0.4, turning };
                let ring: Vec<Point2<f64>> = (0..50)
                    .map(|i| {
                        let angle = f64::from(i) * TAU / 50.0;
                        Point2::new(centre[0] + angle.cos(), centre[1] + angle.sin())
                    })
                    .collect();
                let count: usize =
                    (0..50).map(|i| spiral.crossings(&ring[i], &ring[(i + 1) % 50]).len()).sum();
                let holds_origin = centre[0].hypot(centre[1]) < 0.99;
                assert_eq!(count % 2 == 1, holds_origin, "{centre:?}: {count}");
            }
        }
    }

    #[test]
    fn flattening_keeps_to_the_tolerance() {
        let spiral = Spiral { pitch: 0.45, phase: 0.0, turning: Turning::CounterClockwise };
        let points = spiral.flatten(0.0, 60.0, 0.002);
        let backwards = spiral.flatten(60.0, 0.0, 0.002);
        assert!(points.iter().eq(backwards.iter().rev()));
        for pair in points.windows(2) {
            let middle = nalgebra::center(&pair[0], &pair[1]);
            // Along the ray, which on the innermost turn is longer than the true distance.
            let off = (spiral.value(&middle) - spiral.value(&middle).round()) * spiral.pitch;
            let slope = (1.0 + (spiral.growth() / middle.coords.norm()).powi(2)).sqrt();
            assert!(off.abs() / slope < 0.0021, "{off} at {middle}");
        }
    }
}
