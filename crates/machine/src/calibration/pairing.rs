//! The rail, from magnets seen from both sides of the axis.
//!
//! A magnet seen at `(s₊, theta₊)` and, from beyond the axis, at `(s₋, theta₋)` gives `a` and `b` in
//! closed form and without any knowledge of where it stands, so placement does not matter:
//!
//! ```text
//! a = −(s₊ + s₋)/2        U = (s₊ − s₋)/2
//! beta = −wrap(theta₊ − theta₋ − π)/2        b = U·tan(beta)
//! r = U/cos(beta)         azimuth = wrap(theta₋ + π − beta)
//! ```
//!
//! Which sightings belong together is not known. Pairs that no machine could make are left out; of
//! the others the largest set that agrees on `(a, b)` is kept, one pair a sighting.

use nalgebra::Vector2;

use super::{Sighting, wrap};
use std::f64::consts::PI;

/// A magnet seen from both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index of the sighting from the near side.
    pub near: usize,
    /// Index of the sighting from the far side.
    pub far: usize,
    /// True minus commanded position along the rail, mm.
    pub a: f64,
    /// How far the rail misses the axis, mm.
    pub b: f64,
    /// Distance of the magnet from the axis, mm.
    pub radius: f64,
    /// Its azimuth on the bed, radians.
    pub azimuth: f64,
}

/// No machine's rail is farther off, mm; beyond it two sightings are not of one magnet.
const GREATEST_A_MM: f64 = 5.0;
const GREATEST_B_MM: f64 = 3.0;

/// Pairs of one machine agree on `(a, b)` within this, mm: some thirty standard deviations, and far
/// less than what two different magnets would give.
const AGREEMENT_MM: f64 = 0.5;

/// Where Huber's function changes from square to line, in standard deviations: 95 % as efficient as
/// the mean on clean data.
pub(super) const HUBER: f64 = 1.345;

impl Pair {
    /// Returns what two sightings of one magnet say.
    #[must_use]
    pub fn new(near: (usize, &Sighting), far: (usize, &Sighting)) -> Self {
        let half = (near.1.s - far.1.s) / 2.0;
        let beta = -wrap(near.1.theta - far.1.theta - PI) / 2.0;
        Self {
            near: near.0,
            far: far.0,
            a: -(near.1.s + far.1.s) / 2.0,
            b: half * beta.tan(),
            radius: half / beta.cos(),
            azimuth: wrap(far.1.theta + PI - beta),
        }
    }

    /// Returns where on the bed the magnet lies, mm from the axis.
    #[must_use]
    pub fn over_bed(&self) -> Vector2<f64> {
        self.radius * Vector2::new(self.azimuth.cos(), self.azimuth.sin())
    }

    fn off(&self, other: &Self) -> f64 {
        (self.a - other.a).hypot(self.b - other.b)
    }
}

/// Returns the magnets that were seen from both sides, in the order of the near sightings.
#[must_use]
pub fn match_sides(sightings: &[Sighting]) -> Vec<Pair> {
    let mut candidates = Vec::new();
    for near in sightings.iter().enumerate().filter(|(_, seen)| seen.s > 0.0) {
        for far in sightings.iter().enumerate().filter(|(_, seen)| seen.s < 0.0) {
            let pair = Pair::new(near, far);
            let is_possible = pair.a.abs() < GREATEST_A_MM && pair.b.abs() < GREATEST_B_MM;
            let is_same_pole = near.1.is_reversed == far.1.is_reversed;
            if is_possible && is_same_pole {
                candidates.push(pair);
            }
        }
    }
    one_to_one(agreeing(&candidates))
}

/// The largest set of candidates about one of them; of equally large ones the tightest.
fn agreeing(candidates: &[Pair]) -> Vec<Pair> {
    let mut best = (0, f64::INFINITY, 0);
    for (index, middle) in candidates.iter().enumerate() {
        let offs = candidates.iter().map(|pair| pair.off(middle)).filter(|&off| off < AGREEMENT_MM);
        let (count, spread) = offs.fold((0, 0.0), |(count, sum), off| (count + 1, sum + off));
        if count > best.0 || (count == best.0 && spread < best.1) {
            best = (count, spread, index);
        }
    }
    let Some(middle) = candidates.get(best.2) else { return Vec::new() };
    let mut set: Vec<Pair> =
        candidates.iter().filter(|pair| pair.off(middle) < AGREEMENT_MM).copied().collect();
    set.sort_by(|p, q| p.off(middle).total_cmp(&q.off(middle)));
    set
}

/// Each sighting in one pair at most; earlier pairs win.
fn one_to_one(pairs: Vec<Pair>) -> Vec<Pair> {
    let mut kept: Vec<Pair> = Vec::new();
    for pair in pairs {
        if !kept.iter().any(|other| other.near == pair.near || other.far == pair.far) {
            kept.push(pair);
        }
    }
    kept.sort_by_key(|pair| pair.near);
    kept
}

/// Returns the mean on which few values that are far off have little influence: Huber's, for a
/// known standard deviation; `None` of nothing.
#[must_use]
pub fn huber_mean(values: &[f64], sd: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut mean = *sorted.get(sorted.len() / 2)?;
    // Reweighting converges from anywhere: the function is convex.
    for _ in 0..200 {
        let weight = |value: &f64| (HUBER * sd / (value - mean).abs()).min(1.0);
        let sum: f64 = values.iter().map(|v| weight(v) * v).sum();
        let next = sum / values.iter().map(weight).sum::<f64>();
        if next == mean {
            break;
        }
        mean = next;
    }
    Some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::{Alignment, Branch};
    use crate::program::BedTurn;
    use nalgebra::Point3;

    fn seen(alignment: &Alignment, x: f64, y: f64, branch: Branch) -> Sighting {
        let at = Point3::new(x, y, 0.0);
        let joints = alignment.joints_from_part(&at, branch, BedTurn::default()).unwrap();
        Sighting::new(joints.s, joints.turn.radians())
    }

    #[test]
    fn one_magnet_from_both_sides_gives_the_rail_exactly() {
        let alignment = Alignment { a: 0.7, b: -0.4, ..Alignment::IDEAL };
        for (x, y) in [(10.0, 3.0), (-60.0, 80.0), (0.5, -25.0)] {
            let near = seen(&alignment, x, y, Branch::Near);
            let far = seen(&alignment, x, y, Branch::Far);
            let pair = Pair::new((0, &near), (1, &far));
            assert!((pair.a - 0.7).abs() < 1e-12 && (pair.b + 0.4).abs() < 1e-12, "{pair:?}");
            assert!((pair.over_bed() - Vector2::new(x, y)).norm() < 1e-12);
        }
    }

    #[test]
    fn what_belongs_together_is_found_among_strangers() {
        let alignment = Alignment { a: 0.2, b: 0.9, ..Alignment::IDEAL };
        let mut all = vec![Sighting::new(77.0, 1.0)];
        for (x, y) in [(20.0, 0.0), (0.0, 20.0), (-70.0, 3.0)] {
            all.push(seen(&alignment, x, y, Branch::Near));
            all.push(seen(&alignment, x, y, Branch::Far));
        }
        all.push(Sighting::new(-78.0, 1.0 + PI));
        let pairs = match_sides(&all);
        let indices: Vec<_> = pairs.iter().map(|pair| (pair.near, pair.far)).collect();
        assert_eq!(indices, [(1, 2), (3, 4), (5, 6)]);
    }

    #[test]
    fn a_far_value_hardly_moves_the_robust_mean() {
        assert_eq!(huber_mean(&[], 1.0), None);
        assert_eq!(huber_mean(&[3.0], 1.0), Some(3.0));
        let mean = huber_mean(&[-0.01, 0.0, 0.01, 500.0], 0.01).unwrap();
        assert!(mean.abs() < 0.01, "{mean}");
    }
}
