//! Rough outer walls, for grip and for looks.
//!
//! The outermost wall is followed in steps of about the given distance, and each point is moved
//! inwards by a random amount. The part does not grow, and the same print comes out every time:
//! the amounts depend on the layer and the place in it alone.

use nalgebra::{Point2, Vector2};

use crate::bead::Bead;

/// How rough outer walls are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FuzzyParams {
    /// The greatest way inwards, mm; 0 for smooth walls.
    pub depth: f64,
    /// Mean distance of the points, mm.
    pub step: f64,
}

/// How far the two sides of a thin place stay apart at least, as a share of the depth: walls of 1.2 mm
/// are rough, too, and tips that taper to nothing are not.
pub(crate) const APART_SHARE: f64 = 0.4;

/// Roughens a closed line with the material on its left. It stays where it is where `room`, the places
/// between the sides of the line, does not have the one twice as deep as it may go: there the other side
/// is too near.
#[must_use]
pub fn roughened(
    line: &[(Point2<f64>, Bead)],
    layer: usize,
    params: &FuzzyParams,
    room: impl Fn(&Point2<f64>) -> bool,
) -> Vec<(Point2<f64>, Bead)> {
    let Some(&(first, _)) = line.first() else { return Vec::new() };
    let seed = (layer as u64) << 40 ^ (first.x * 1e3).to_bits() ^ (first.y * 1e3).to_bits() << 7;
    let mut random = Random(seed);
    let mut rough = Vec::new();
    // The way left to the next point, and how deep the last one lies.
    let mut left = params.step * random.next();
    let mut depth = 0.0;
    for (k, (from, bead)) in line.iter().enumerate() {
        let (to, to_bead) = &line[(k + 1) % line.len()];
        let side = to - from;
        let length = side.norm();
        if length == 0.0 {
            continue;
        }
        let inwards = Vector2::new(-side.y, side.x) / length;
        let mut along = left;
        while along < length {
            let share = along / length;
            let bead = Bead {
                width: bead.width + (to_bead.width - bead.width) * share,
                thickness: bead.thickness + (to_bead.thickness - bead.thickness) * share,
            };
            depth = params.depth * random.next();
            let at = from + side * share;
            if !room(&(at + inwards * (2.0 * params.depth))) {
                depth = 0.0;
            }
            rough.push(Rough { at: at + inwards * depth, bead, is_tip: false });
            // Half to one and a half steps.
            along += params.step * (0.5 + random.next());
        }
        left = along - length;
        // A side of the wall would cut a hollow corner, outside of the part.
        let next = line[(k + 2) % line.len()].0;
        let is_narrow = || {
            let ahead = side / length;
            !room(&(to + (inwards * 2.0 - ahead * 0.5) * params.depth))
        };
        if side.perp(&(next - to)) < 0.0 {
            let is_free = room(&(to + inwards * (2.0 * params.depth)));
            let at = to + inwards * if is_free { depth } else { 0.0 };
            rough.push(Rough { at, bead: *to_bead, is_tip: false });
        } else if is_narrow() {
            // A tip that is cut off would have its sides lie on each other.
            rough.push(Rough { at: *to, bead: *to_bead, is_tip: true });
        }
    }
    leave_out_spikes(&mut rough, params.depth);
    // A line too short for it stays as it is.
    if rough.len() < 3 {
        return line.to_vec();
    }
    rough.into_iter().map(|point| (point.at, point.bead)).collect()
}

/// A point of a rough line.
struct Rough {
    at: Point2<f64>,
    bead: Bead,
    /// Whether it is the end of a slender tip, where a sharp turn is the part's own.
    is_tip: bool,
}

/// A closed line that turns by more than this runs back over itself, radians: 175°.
const SPIKE: f64 = 175.0 * std::f64::consts::PI / 180.0;

/// The same where a side is so short (mm) that the last places of a program can make it point elsewhere.
const SHORT_SPIKE: f64 = 140.0 * std::f64::consts::PI / 180.0;
const SHORT_MM: f64 = 0.1;

/// Leaves out points from which a closed line runs back over the way it came: where a side is short, or at a
/// corner, the next point may lie behind the one before. No such spike is longer than `depth` by much.
fn leave_out_spikes(line: &mut Vec<Rough>, depth: f64) {
    let mut k = 0;
    // How many points in a row are known to be none; without one, its neighbours may be some.
    let mut sound = 0;
    while line.len() > 3 && sound < line.len() {
        let n = line.len();
        k %= n;
        let [before, at, after] = [k + n - 1, k, k + 1].map(|k| line[k % n].at);
        let (into, out) = (at - before, after - at);
        let shorter = into.norm().min(out.norm());
        let is_doubtful = shorter < SHORT_MM && !line[k].is_tip;
        let most = if is_doubtful { SHORT_SPIKE } else { SPIKE };
        if shorter <= 2.0 * depth && into.angle(&out) > most {
            line.remove(k);
            sound = 0;
            k = (k + n - 2) % (n - 1);
        } else {
            k += 1;
            sound += 1;
        }
    }
}

/// Numbers from 0 to 1 that look random (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hollow_corners_are_not_cut() {
        // The outline of a hole: the material is outside of it.
        let bead = Bead { width: 0.45, thickness: 0.2 };
        let corners = [[0.0, 0.0], [0.0, 6.0], [6.0, 6.0], [6.0, 0.0]];
        let line = corners.map(|p| (Point2::from(p), bead));
        for layer in 1..40 {
            let rough = roughened(&line, layer, &FuzzyParams { depth: 0.3, step: 0.8 }, |_| true);
            for (k, (a, _)) in rough.iter().enumerate() {
                let (b, _) = rough[(k + 1) % rough.len()];
                for share in [0.0, 0.25, 0.5, 0.75] {
                    let p = a + (b - a) * share;
                    let inside = p.x.min(p.y).min(6.0 - p.x).min(6.0 - p.y);
                    assert!(inside < 1e-9, "{p} is {inside} mm inside of the hole");
                }
            }
        }
    }

    #[test]
    fn a_wall_becomes_rough_within_its_depth() {
        let bead = Bead { width: 0.45, thickness: 0.2 };
        let corners = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]];
        let line = corners.map(|p| (Point2::from(p), bead));
        let params = FuzzyParams { depth: 0.3, step: 0.8 };
        let rough = roughened(&line, 7, &params, |_| true);
        assert!((85..115).contains(&rough.len()), "{} points", rough.len());
        let depths: Vec<f64> =
            rough.iter().map(|(p, _)| p.x.min(p.y).min(20.0 - p.x).min(20.0 - p.y)).collect();
        assert!(depths.iter().all(|d| (-1e-9..0.3 + 1e-9).contains(d)));
        let mean = depths.iter().sum::<f64>() / depths.len() as f64;
        assert!((0.1..0.2).contains(&mean), "{mean}");
        assert_eq!(roughened(&line, 7, &params, |_| true), rough);
        assert_ne!(roughened(&line, 8, &params, |_| true), rough);
    }

    #[test]
    fn no_line_runs_back_over_the_one_before() {
        // A plate with a narrow slot that ends in a tight arc, and with tight arcs beside its mouth.
        let bead = Bead { width: 0.45, thickness: 0.2 };
        let arc = |x: f64, y: f64, radius: f64, from: f64, turn: f64| {
            (0..=24).map(move |k| {
                let angle = (from + turn * f64::from(k) / 24.0).to_radians();
                Point2::new(x + radius * angle.cos(), y + radius * angle.sin())
            })
        };
        let mut line: Vec<Point2<f64>> =
            [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]].map(Point2::from).to_vec();
        line.extend(arc(10.4, 19.9, 0.1, 90.0, 90.0));
        line.extend(arc(10.0, 8.0, 0.3, 0.0, -180.0));
        line.extend(arc(9.6, 19.9, 0.1, 0.0, 90.0));
        line.push(Point2::new(0.0, 20.0));
        let line: Vec<(Point2<f64>, Bead)> = line.into_iter().map(|p| (p, bead)).collect();
        for layer in 1..300 {
            let rough = roughened(&line, layer, &FuzzyParams { depth: 0.3, step: 0.8 }, |_| true);
            let n = rough.len();
            for k in 0..n {
                let [a, b, c] = [k, k + 1, k + 2].map(|k| rough[k % n].0);
                let turn = (b - a).angle(&(c - b)).to_degrees();
                assert!(turn < 175.0, "layer {layer}: {turn}° at {b}");
            }
        }
    }

    #[test]
    fn slender_tips_stay_as_they_are() {
        // A wedge of 3 mm that ends in 20 mm, and its wall: what lies between its sides is material.
        let bead = Bead { width: 0.45, thickness: 0.2 };
        let corners = [[0.0, 0.0], [20.0, 1.5], [0.0, 3.0]];
        let line = corners.map(|p| (Point2::from(p), bead));
        let room = |p: &Point2<f64>| p.x > 0.0 && (p.y - 1.5).abs() < 1.5 * (1.0 - p.x / 20.0);
        for layer in 1..40 {
            let rough = roughened(&line, layer, &FuzzyParams { depth: 0.3, step: 0.8 }, room);
            assert!(rough.iter().any(|(p, _)| *p == Point2::new(20.0, 1.5)), "layer {layer}");
            for (p, _) in rough.iter().filter(|(p, _)| p.x > 16.5) {
                let off = 1.5 * (1.0 - p.x / 20.0) - (p.y - 1.5).abs();
                assert!(off.abs() < 1e-9, "layer {layer}: {p}");
            }
            assert!(rough.iter().any(|(p, _)| p.x < 8.0 && p.y > 0.1 && p.y < 2.9));
        }
    }
}
