//! Travel that stays inside the part, where it leaves no mark.
//!
//! A straight way out of an island is led along the rim of the island instead: at each outline that it
//! crosses, from where it leaves to where it comes back, the shorter way round; then it is pulled tight.
//! The rim lies a little inside the outlines, so that what oozes meets a wall and not the air. Islands
//! are connected, so there is such a way wherever the rim is; in places narrower than that, there is none.
//!
//! All points are seen from above, mm.

use geom::bands::Bands;
use geom::grid::mm;
use geom::region::{Region, ring_sides};
use nalgebra::{Point2, distance};

/// How finely the rim is followed, mm: travel need not be exact, and fewer points are quicker pulled
/// tight.
const RIM_TOLERANCE_MM: f64 = 0.05;

/// Ways with more corners than this are not pulled tight, which takes time with their square.
const MOST_CORNERS: usize = 400;

/// The inside of an island, for travel.
#[derive(Debug, Clone)]
pub(crate) struct Comb {
    /// Outlines, drawn in by what travel keeps from them.
    rim: Region,
    /// What travel may not leave; half as far in.
    within: Bands,
}

/// Where a straight way crosses the rim.
struct Crossing {
    share: f64,
    ring: usize,
    side: usize,
    at: Point2<f64>,
}

impl Comb {
    /// Returns the comb of an island whose travel keeps `keep` mm from its outlines.
    pub(crate) fn new(outline: &Region, keep: f64) -> Self {
        let tolerance = RIM_TOLERANCE_MM.min(keep / 4.0);
        let within = Bands::of(&outline.inset(keep / 2.0));
        Self { rim: outline.inset(keep).simplified(tolerance), within }
    }

    /// Returns a way from `a` to `b` inside the island, without `a`; `None` where there is none.
    pub(crate) fn way(&self, a: &Point2<f64>, b: &Point2<f64>) -> Option<Vec<Point2<f64>>> {
        if self.within.contains_segment(a, b) {
            return Some(vec![*b]);
        }
        let way = self.along_rim(a, b)?;
        if way.len() > MOST_CORNERS {
            return None;
        }
        self.pulled_tight(&way)
    }

    /// The way along the rim, with both ends.
    fn along_rim(&self, a: &Point2<f64>, b: &Point2<f64>) -> Option<Vec<Point2<f64>>> {
        let rings: Vec<Vec<Point2<f64>>> =
            self.rim.rings().map(|ring| ring.iter().map(|&p| mm(p)).collect()).collect();
        let crossings = self.crossings(a, b);
        let mut way = vec![*a];
        let mut next = 0;
        while let Some(leaves) = crossings.get(next) {
            let back = crossings.iter().rposition(|crossing| crossing.ring == leaves.ring)?;
            if back == next {
                // An end lies between the rim and the outline: there it comes back, or never left.
                next += 1;
                continue;
            }
            round(&rings[leaves.ring], leaves, &crossings[back], &mut way);
            next = back + 1;
        }
        way.push(*b);
        Some(way)
    }

    fn crossings(&self, a: &Point2<f64>, b: &Point2<f64>) -> Vec<Crossing> {
        let along = b - a;
        let mut all = Vec::new();
        for (ring, points) in self.rim.rings().enumerate() {
            for (side, (c, d)) in ring_sides(points).enumerate() {
                let (c, d) = (mm(c), mm(d));
                let (c_side, d_side) = (along.perp(&(c - a)), along.perp(&(d - a)));
                if (c_side > 0.0) == (d_side > 0.0) {
                    continue;
                }
                let at = c + (d - c) * (c_side / (c_side - d_side));
                let share = (at - a).dot(&along) / along.norm_squared();
                if 0.0 < share && share < 1.0 {
                    all.push(Crossing { share, ring, side, at });
                }
            }
        }
        all.sort_by(|x, y| x.share.total_cmp(&y.share).then(x.ring.cmp(&y.ring)));
        all
    }

    /// Leaves out all corners that can be cut.
    fn pulled_tight(&self, way: &[Point2<f64>]) -> Option<Vec<Point2<f64>>> {
        let mut tight = Vec::new();
        let mut here = 0;
        while here + 1 < way.len() {
            let sees = |k: &usize| self.within.contains_segment(&way[here], &way[*k]);
            let farthest = (here + 1..way.len()).rev().find(sees)?;
            tight.push(way[farthest]);
            here = farthest;
        }
        Some(tight)
    }
}

/// Appends the shorter way along a ring between two crossings.
fn round(ring: &[Point2<f64>], from: &Crossing, to: &Crossing, way: &mut Vec<Point2<f64>>) {
    let count = ring.len();
    // Corners after the side of the first crossing, up to the begin of the side of the second.
    let forward: Vec<Point2<f64>> = (0..(to.side + count - from.side) % count)
        .map(|k| ring[(from.side + 1 + k) % count])
        .collect();
    let backward: Vec<Point2<f64>> = (0..(from.side + count - to.side) % count)
        .map(|k| ring[(from.side + count - k) % count])
        .collect();
    let length = |corners: &[Point2<f64>]| {
        let mut last = from.at;
        let mut sum = 0.0;
        for corner in corners.iter().chain([&to.at]) {
            sum += distance(&last, corner);
            last = *corner;
        }
        sum
    };
    let shorter = if length(&forward) <= length(&backward) { forward } else { backward };
    way.push(from.at);
    way.extend(shorter);
    way.push(to.at);
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;

    /// An outline, and holes in it.
    fn region(rings: &[&[[f64; 2]]]) -> Region {
        let ring = |ring: &&[[f64; 2]]| -> Region {
            let points: Vec<Point2<f64>> = ring.iter().map(|&p| Point2::from(p)).collect();
            Region::from_rings([points.as_slice()], Fill::NonZero)
        };
        rings[1..].iter().fold(ring(&rings[0]), |outline, hole| outline.difference(&ring(hole)))
    }

    fn length(a: Point2<f64>, way: &[Point2<f64>]) -> f64 {
        let points: Vec<Point2<f64>> = std::iter::once(a).chain(way.iter().copied()).collect();
        points.windows(2).map(|ends| distance(&ends[0], &ends[1])).sum()
    }

    /// No piece leaves the outline, looked at every hundredth.
    #[track_caller]
    fn stays_inside(outline: &Region, a: Point2<f64>, way: &[Point2<f64>]) {
        let mut from = a;
        for to in way {
            for k in 0..=100 {
                let p = from + (to - from) * (f64::from(k) / 100.0);
                assert!(outline.contains(&p), "{p}");
            }
            from = *to;
        }
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]];
    const HOLE: [[f64; 2]; 4] = [[6.0, 6.0], [14.0, 6.0], [14.0, 14.0], [6.0, 14.0]];

    #[test]
    fn a_hole_is_gone_round_by_the_shorter_side() {
        let outline = region(&[&SQUARE, &HOLE]);
        let comb = Comb::new(&outline, 0.2);
        let (a, b) = (Point2::new(2.0, 11.0), Point2::new(18.0, 12.0));
        let way = comb.way(&a, &b).unwrap();
        stays_inside(&outline, a, &way);
        let least =
            distance(&a, &Point2::new(6.0, 14.0)) + 8.0 + distance(&Point2::new(14.0, 14.0), &b);
        let found = length(a, &way);
        assert!(found > least && found < least + 1.0, "{found} {least}: {way:?}");
        assert_eq!(*way.last().unwrap(), b);
    }

    #[test]
    fn a_notch_and_holes_behind_each_other() {
        let horseshoe = [
            [0.0, 0.0],
            [20.0, 0.0],
            [20.0, 20.0],
            [12.0, 20.0],
            [12.0, 5.0],
            [8.0, 5.0],
            [8.0, 20.0],
            [0.0, 20.0],
        ];
        let small = [[3.0, 14.0], [5.0, 14.0], [5.0, 16.0], [3.0, 16.0]];
        let outline = region(&[&horseshoe, &small]);
        let comb = Comb::new(&outline, 0.2);
        let (a, b) = (Point2::new(1.0, 15.0), Point2::new(19.0, 15.0));
        let way = comb.way(&a, &b).unwrap();
        stays_inside(&outline, a, &way);
        assert!(length(a, &way) < 40.0, "{}", length(a, &way));
    }

    #[test]
    fn straight_ways_stay_straight_and_what_is_apart_has_none() {
        let outline = region(&[&SQUARE, &HOLE]);
        let comb = Comb::new(&outline, 0.2);
        let (a, b) = (Point2::new(1.0, 1.0), Point2::new(19.0, 2.0));
        assert_eq!(comb.way(&a, &b), Some(vec![b]));
        assert_eq!(comb.way(&a, &Point2::new(10.0, 10.0)), None, "in the hole");
        assert_eq!(comb.way(&a, &Point2::new(30.0, 30.0)), None, "beside the part");
    }

    #[test]
    fn random_ways_in_a_comb_of_many_teeth_never_leave_it() {
        let mut ring = vec![[0.0, 0.0], [40.0, 0.0]];
        for k in (0..10).rev() {
            let x = 4.0 * f64::from(k);
            ring.extend([[x + 4.0, 15.0], [x + 2.0, 15.0], [x + 2.0, 3.0], [x, 3.0]]);
        }
        let outline = region(&[&ring]);
        let comb = Comb::new(&outline, 0.2);
        let mut seen = 0;
        for k in 0..300_u32 {
            let t = f64::from(k);
            let place =
                |s: f64, u: f64| Point2::new(40.0 * (t * s).fract(), 15.0 * (t * u).fract());
            let (a, b) = (place(0.618, 0.37), place(0.271, 0.83));
            if let Some(way) = comb.way(&a, &b) {
                stays_inside(&outline, a, &way);
                seen += 1;
            }
        }
        assert!(seen > 60, "{seen}");
    }
}
