//! Bare curves on a sphere: the Archimedean spherical spiral and the loxodrome.
//!
//! Both are the curves that a thesis on six-coordinate control for rapid prototyping (ITMO University,
//! 2015) tried for layers that are spherical shells: the loxodrome is its eq. 2.2, the spiral its
//! eq. 2.4 with the increments of its listing, turns from the width of a bead its eq. 2.5. Points are in
//! millimetres about the centre of the sphere, z along the axis through the poles; azimuth grows from x
//! towards y, latitude from the equator up. The thesis calls the axis of the spiral Y: its `(X, Y, Z)`
//! are `(x, z, y)` here.

use nalgebra::Point3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The Archimedean spherical spiral: latitude and azimuth grow at the same rate all the way from the
/// lower to the upper pole, so that neighbouring turns are equally far apart everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Archimedean {
    /// Radius of the sphere, mm, positive.
    pub radius: f64,
    /// Turns from pole to pole, positive.
    pub turns: f64,
    /// How far the axis leans about x, from z towards y, radians.
    pub leaning: f64,
}

/// The loxodrome, which crosses all meridians at the same angle. It comes near the poles and never
/// there, and its turns come closer to each other on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loxodrome {
    /// Radius of the sphere, mm, positive.
    pub radius: f64,
    /// Slope against the parallels, `m` of eq. 2.2: climb over length along the parallel.
    pub slope: f64,
    /// Azimuth at which it crosses the equator, radians, λ0 of eq. 2.2.
    pub meridian: f64,
}

/// Returns the turns from pole to pole whose distance on a sphere is `width`: `n = πR/h`, eq. 2.5.
///
/// The example beside the equation, 100 turns for R = 20 mm and h = 0.2 mm, is `R/h`: with those the
/// turns would be π times as far apart. The equation is right.
#[must_use]
pub fn turns_for(radius: f64, width: f64) -> f64 {
    PI * radius / width
}

impl Archimedean {
    /// Distance of neighbouring turns along a meridian, mm.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        PI * self.radius / self.turns
    }

    /// Returns the latitude (radians) at a share of the way, 0 at the lower and 1 at the upper pole.
    #[must_use]
    pub fn latitude(&self, share: f64) -> f64 {
        PI * (share - 0.5)
    }

    /// Returns the point at a share of the way, eq. 2.4.
    #[must_use]
    pub fn at(&self, share: f64) -> Point3<f64> {
        let (height, out) = self.latitude(share).sin_cos();
        let (sin, cos) = (TAU * self.turns * share).sin_cos();
        let (y, z) = (self.radius * out * sin, self.radius * height);
        let (s, c) = self.leaning.sin_cos();
        Point3::new(self.radius * out * cos, y * c + z * s, z * c - y * s)
    }

    /// Returns the length up to a share of the way, mm.
    #[must_use]
    pub fn length(&self, share: f64) -> f64 {
        let turned = PI * self.turns;
        let chart = |share: f64| {
            let radius = |rho: f64| self.radius * (rho / self.radius).sin();
            spiral_length(self.spacing(), share * 2.0 * turned, radius)
        };
        // The halves mirror each other; measured from the nearer pole, sin has no cancellation.
        if share <= 0.5 { chart(share) } else { 2.0 * chart(0.5) - chart(1.0 - share) }
    }
}

impl Loxodrome {
    /// Returns the latitude (radians) at an azimuth, counted on over whole turns.
    #[must_use]
    pub fn latitude(&self, azimuth: f64) -> f64 {
        (self.slope * (azimuth - self.meridian)).sinh().atan()
    }

    /// Returns the point at an azimuth (radians), eq. 2.2.
    #[must_use]
    pub fn at(&self, azimuth: f64) -> Point3<f64> {
        let climb = self.slope * (azimuth - self.meridian);
        let out = self.radius / climb.cosh();
        let (sin, cos) = azimuth.sin_cos();
        Point3::new(out * cos, out * sin, self.radius * climb.tanh())
    }

    /// Returns how far along the meridian the turn above lies from the one at an azimuth, mm. It is
    /// near 2πmR at the equator and falls with the cosine of the latitude.
    #[must_use]
    pub fn spacing(&self, azimuth: f64) -> f64 {
        self.radius * (self.latitude(azimuth + TAU) - self.latitude(azimuth)).abs()
    }

    /// Returns the length between two azimuths, mm: the climb over the sine of its slope.
    #[must_use]
    pub fn length(&self, from: f64, to: f64) -> f64 {
        let rate = |azimuth: f64| self.radius / (self.slope * (azimuth - self.meridian)).cosh();
        integral(|azimuth| rate(azimuth) * self.slope.hypot(1.0), from, to)
    }
}

/// Returns the length (mm) of the spiral that gains `pitch` (mm) along the meridian with each turn,
/// from the axis to `turned` (radians), on the surface of revolution with this radius (mm) at the
/// distance from the axis along the meridian (mm).
#[must_use]
pub fn spiral_length(pitch: f64, turned: f64, radius: impl Fn(f64) -> f64) -> f64 {
    let growth = pitch / TAU;
    integral(|theta| growth.hypot(radius(growth * theta)), 0.0, turned)
}

/// Returns where a spiral as in [`spiral_length`] has reached a length (mm), radians turned from the
/// axis, at most `most`.
#[must_use]
pub fn spiral_turned(pitch: f64, length: f64, most: f64, radius: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, most);
    let growth = pitch / TAU;
    let mut turned = most / 2.0;
    // Newton within a bracket that halves where it would leave: 60 halvings exhaust an f64.
    for _ in 0..MOST_STEPS {
        let over = spiral_length(pitch, turned, &radius) - length;
        if over > 0.0 {
            high = turned;
        } else {
            low = turned;
        }
        let next = turned - over / growth.hypot(radius(growth * turned));
        let next = if low < next && next < high { next } else { f64::midpoint(low, high) };
        if (next - turned).abs() <= f64::EPSILON * most {
            return next;
        }
        turned = next;
    }
    turned
}

const MOST_STEPS: usize = 64;

/// Longest piece of [`integral`], radians: five places of Gauss make the error of curves that change
/// over a radian less than 1e-12 of the whole.
const LONGEST_PIECE: f64 = 0.25;

/// Fewest and most pieces of [`integral`]; more turns than fit change so slowly that fewer do.
const PIECES: (f64, f64) = (64.0, 4e6);

/// Places and weights of Gauss' rule of five on (−1, 1), from the middle out.
const GAUSS: [(f64, f64); 3] = [
    (0.0, 128.0 / 225.0),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

fn integral(rate: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let pieces = ((to - from).abs() / LONGEST_PIECE).ceil().clamp(PIECES.0, PIECES.1);
    let half = (to - from) / pieces / 2.0;
    let piece = |k: usize| {
        let middle = from + (2.0 * k as f64 + 1.0) * half;
        let pair = |place: f64| rate(middle - place * half) + rate(middle + place * half);
        let [centre, inner, outer] = GAUSS;
        centre.1 * rate(middle) + inner.1 * pair(inner.0) + outer.1 * pair(outer.0)
    };
    half * (0..pieces as usize).map(piece).sum::<f64>()
}

/// Returns the latitude (radians) up to which a loxodrome of `turns` turns, half of them below the
/// equator, climbs with this slope.
#[must_use]
pub fn loxodrome_end(slope: f64, turns: f64) -> f64 {
    (PI * turns * slope).sinh().atan()
}

/// Returns the slope with which a loxodrome of `turns` turns, half of them below the equator, climbs up
/// to a latitude (radians, below the pole).
#[must_use]
pub fn loxodrome_slope(latitude: f64, turns: f64) -> f64 {
    latitude.min(FRAC_PI_2).tan().asinh() / (PI * turns)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The length of a polyline through points of a curve.
    fn polyline(points: impl Iterator<Item = Point3<f64>>) -> f64 {
        let points: Vec<_> = points.collect();
        points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }

    #[test]
    fn lengths_are_those_of_fine_polylines() {
        let n = 400_000;
        for (turns, leaning) in [(17.0, 0.0), (0.5, 0.4), (3.25, -1.0)] {
            let curve = Archimedean { radius: 70.0, turns, leaning };
            for share in [0.2, 0.5, 0.8, 1.0] {
                let chords = (0..=n).map(|k| curve.at(share * f64::from(k) / f64::from(n)));
                assert!((polyline(chords) / curve.length(share) - 1.0).abs() < 1e-8);
            }
        }
        let curve = Loxodrome { radius: 20.0, slope: 0.05, meridian: 0.3 };
        let (from, to) = (-40.0, 55.0);
        let chords = (0..=n).map(|k| curve.at(from + (to - from) * f64::from(k) / f64::from(n)));
        let length = curve.length(from, to);
        assert!((polyline(chords) / length - 1.0).abs() < 1e-8);
        // Climb over sine: a loxodrome is as steep everywhere.
        let climb = 20.0 * (curve.latitude(to) - curve.latitude(from));
        assert!((length - climb * 1.0_f64.hypot(0.05) / 0.05).abs() < 1e-9);
    }

    #[test]
    fn turns_of_the_spiral_are_equally_far_apart_and_those_of_the_loxodrome_are_not() {
        let spiral = Archimedean { radius: 20.0, turns: turns_for(20.0, 0.2), leaning: 0.3 };
        assert!((spiral.turns - 314.159_265).abs() < 1e-6);
        let share = 1.0 / spiral.turns;
        for start in [0.01, 0.3, 0.7] {
            let angle = spiral.at(start).coords.angle(&spiral.at(start + share).coords);
            assert!((20.0 * angle - 0.2).abs() < 1e-7, "{angle}");
        }
        let slope = loxodrome_slope(1.5, 17.0);
        assert!((loxodrome_end(slope, 17.0) - 1.5).abs() < 1e-12);
        let curve = Loxodrome { radius: 20.0, slope, meridian: 0.0 };
        let angle = curve.at(3.0).coords.angle(&curve.at(3.0 + TAU).coords);
        assert!((20.0 * angle - curve.spacing(3.0)).abs() < 1e-9);
        assert!(curve.spacing(0.0) > 5.0 * curve.spacing(15.0 * PI));
    }
}
