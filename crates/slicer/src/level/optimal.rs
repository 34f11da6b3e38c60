//! The schedule that misses the flat faces by the least.
//!
//! Heights are whole increments `h` with `least ≤ h ≤ greatest`, so bounds of layers are integers.
//! The cost of a schedule is compared in this order:
//!
//! 1. over all flat faces, weight × (distance of the nearest bound + a constant where that is more
//!    than half an increment),
//! 2. for [`Aim::Fewest`] the number of layers, then the sum of the squared heights: of so many
//!    layers with one sum, the most even have the least;
//!    for [`Aim::Nominal`] the sum of the squared differences from the wanted height, then the
//!    number of layers.
//!
//! All of it adds up over layers: a face lies in exactly one, and its nearest bound is one of that
//! layer's two. So the best schedule to a bound is the best to the bound before and one more layer
//! (R. Bellman (1957), "Dynamic Programming"), and all bounds are found in
//! `O(top × (greatest − least))` steps with memory for one row of costs.
//!
//! A gap of `g` increments between two faces can be filled without an error when
//! `⌈g / greatest⌉ ≤ ⌊g / least⌋` ([`fills`]); where all gaps can, the cost of the faces is nothing
//! but what lies off the increments.

/// Lengths are in increments, or in thousandths of one where that is said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Problem<'a> {
    /// Where the last layer should end.
    pub top: u32,
    /// How far from there it may end without being worse.
    pub end_slack: u32,
    /// The first layer, when it has a height of its own, whatever the limits.
    pub first: Option<u32>,
    /// The thinnest layer, at least 1.
    pub least: u32,
    /// The thickest.
    pub greatest: u32,
    /// What is wanted besides the faces.
    pub aim: Aim,
    /// The faces, in ascending order.
    pub faces: &'a [Face],
    /// What a miss costs besides its distance, in thousandths of an increment.
    pub miss_milli: u64,
    /// The thickest layer by cell: a layer over the cells `a..b` is no thicker than any of
    /// `caps[a..b]`, nor thinner than `least`. Cells beyond the end have no cap.
    pub caps: &'a [u32],
}

/// What is wanted of a schedule besides that it meets the faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aim {
    /// As few layers as can be, and those as even as can be.
    Fewest,
    /// Layers of this height.
    Nominal {
        /// Thousandths of an increment.
        height_milli: u64,
        /// What a layer costs besides the square of its difference from that height, in squared
        /// thousandths of an increment. The more, the fewer layers; the longest stretches lose
        /// them first, where it is seen least.
        layer_cost: u64,
    },
}

/// A flat face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Where it lies, in thousandths of an increment.
    pub at_milli: i64,
    /// What an increment of error costs.
    pub weight: u64,
}

/// A miss that costs this much more leaves the least total error as it is, and decides between
/// schedules of the same error: rather one face missed by two increments than two by one each.
pub const TIE_BREAK_MILLI: u64 = 1;

/// A sum that ends here is not reached.
const UNREACHED: [u64; 3] = [u64::MAX; 3];

/// Returns whether `gap` increments can be filled with layers within the limits.
#[must_use]
pub fn fills(gap: u32, least: u32, greatest: u32) -> bool {
    gap.div_ceil(greatest.max(1)) <= gap / least.max(1)
}

/// Returns the heights of the best schedule, from the bottom up; at least one.
///
/// It ends within the slack of the top where it can, otherwise as near as it can. Of schedules
/// with equal costs it is always the same one.
#[must_use]
pub fn plan(problem: &Problem<'_>) -> Vec<u32> {
    let table = Table::fill(problem);
    let mut at = table.best_end(problem);
    let mut heights = Vec::new();
    while at > 0 {
        heights.push(table.last[at]);
        at -= table.last[at] as usize;
    }
    heights.reverse();
    heights
}

/// The best schedule to every bound.
struct Table {
    cost: Vec<[u64; 3]>,
    /// Height of the last layer of that schedule.
    last: Vec<u32>,
    /// By bound, how many faces lie on it or below.
    faces_below: Vec<u32>,
}

impl Table {
    fn fill(problem: &Problem<'_>) -> Self {
        let farthest = problem.top + problem.end_slack.max(problem.greatest);
        let n = farthest.max(problem.first.unwrap_or(0)) as usize + 1;
        let mut table = Self {
            cost: vec![UNREACHED; n],
            last: vec![0; n],
            faces_below: faces_below(problem, n),
        };
        table.cost[0] = [0; 3];
        if let Some(first) = problem.first {
            table.try_layer(problem, 0, first as usize);
            // Nothing else may begin on the bed.
            table.cost[0] = UNREACHED;
        }
        for to in problem.least as usize..n {
            let mut cap = usize::MAX;
            let thickest = to.min(problem.greatest as usize);
            for height in 1..=thickest {
                let from = to - height;
                if let Some(&here) = problem.caps.get(from) {
                    cap = cap.min(here.max(problem.least) as usize);
                }
                if height > cap {
                    break;
                }
                if height >= problem.least as usize {
                    table.try_layer(problem, from, to);
                }
            }
        }
        table
    }

    /// Ends a layer at `to` if that is better than what is known.
    fn try_layer(&mut self, problem: &Problem<'_>, from: usize, to: usize) {
        let before = self.cost[from];
        if before == UNREACHED {
            return;
        }
        let height = (to - from) as u64;
        let [second, third] = match problem.aim {
            Aim::Fewest => [1, height * height],
            Aim::Nominal { height_milli, layer_cost } => {
                let off = (1000 * height).abs_diff(height_milli);
                [off.saturating_mul(off).saturating_add(layer_cost), 1]
            }
        };
        let cost = [
            before[0].saturating_add(self.faces(problem, from, to)),
            before[1].saturating_add(second),
            before[2].saturating_add(third),
        ];
        if cost < self.cost[to] {
            self.cost[to] = cost;
            self.last[to] = (to - from) as u32;
        }
    }

    /// What the faces in a layer cost.
    fn faces(&self, problem: &Problem<'_>, from: usize, to: usize) -> u64 {
        let inside = self.faces_below[from] as usize..self.faces_below[to] as usize;
        let (lower, upper) = (milli(from), milli(to));
        let miss = |face: &Face| {
            face_cost(problem, face, (face.at_milli - lower).min(upper - face.at_milli))
        };
        problem.faces[inside].iter().map(miss).fold(0, u64::saturating_add)
    }

    /// The bound to end on. Flat faces above it pay for their distance to it.
    fn best_end(&self, problem: &Problem<'_>) -> usize {
        let above = |at: usize| {
            let faces = &problem.faces[self.faces_below[at] as usize..];
            let miss = |face: &Face| face_cost(problem, face, face.at_milli - milli(at));
            faces.iter().map(miss).fold(0, u64::saturating_add)
        };
        let rank = |&at: &usize| {
            let off = at.abs_diff(problem.top as usize) as u64;
            let beyond = off.saturating_sub(u64::from(problem.end_slack));
            let [faces, second, third] = self.cost[at];
            let faces = faces.saturating_add(above(at));
            match problem.aim {
                // Otherwise the last layer would be left out whenever it may.
                Aim::Fewest => [beyond, faces, off, second, third],
                Aim::Nominal { .. } => [beyond, faces, second, off, third],
            }
        };
        let reached = (1..self.cost.len()).filter(|&at| self.cost[at] != UNREACHED);
        let near = reached.clone().filter(|at| {
            at.abs_diff(problem.top as usize) <= problem.end_slack.max(problem.greatest) as usize
        });
        // A first layer that is thicker than the part ends far from its top.
        near.min_by_key(rank).or_else(|| reached.min_by_key(rank)).unwrap_or(0)
    }
}

/// A bound in thousandths of an increment.
fn milli(bound: usize) -> i64 {
    1000 * bound as i64
}

fn face_cost(problem: &Problem<'_>, face: &Face, distance_milli: i64) -> u64 {
    let distance = distance_milli.unsigned_abs();
    let missed = if distance > 500 { problem.miss_milli } else { 0 };
    face.weight.saturating_mul(distance + missed)
}

fn faces_below(problem: &Problem<'_>, n: usize) -> Vec<u32> {
    let mut below = 0;
    (0..n)
        .map(|bound| {
            while problem.faces.get(below).is_some_and(|face| face.at_milli <= milli(bound)) {
                below += 1;
            }
            below as u32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(top: u32, faces: &[Face]) -> Problem<'_> {
        Problem {
            top,
            end_slack: 0,
            first: None,
            least: 10,
            greatest: 30,
            aim: Aim::Fewest,
            faces,
            miss_milli: TIE_BREAK_MILLI,
            caps: &[],
        }
    }

    fn face(at: i64, weight: u64) -> Face {
        Face { at_milli: 1000 * at, weight }
    }

    #[test]
    fn fewest_and_most_even() {
        assert_eq!(plan(&problem(100, &[])), [25; 4]);
        assert_eq!(plan(&problem(5, &[])), [10], "the nearest that can be reached");
    }

    #[test]
    fn of_two_faces_too_close_the_larger_is_met() {
        let bounds = |faces: &[Face]| {
            let mut at = 0;
            let mut bounds = Vec::new();
            for height in plan(&problem(300, faces)) {
                at += height;
                bounds.push(at);
            }
            bounds
        };
        let met = bounds(&[face(100, 5), face(105, 1)]);
        assert!(met.contains(&100) && !met.contains(&105));
        let met = bounds(&[face(100, 1), face(105, 5)]);
        assert!(met.contains(&105) && !met.contains(&100));
    }

    #[test]
    fn caps_hold_and_never_ask_for_less_than_the_thinnest() {
        let mut caps = vec![30; 60];
        caps.extend([12; 60]);
        caps.extend([3; 60]);
        let heights = plan(&Problem { caps: &caps, ..problem(180, &[]) });
        assert_eq!(heights.iter().sum::<u32>(), 180);
        let mut from = 0;
        for height in heights {
            let cap = caps[from..from + height as usize].iter().min().unwrap();
            assert!(height <= *cap.max(&10), "{height} at {from}");
            from += height as usize;
        }
    }

    #[test]
    fn a_hundred_millimetres_of_faces_on_every_increment_stay_finite() {
        let faces: Vec<Face> = (1..10_000).map(|at| face(at, u64::MAX / 2)).collect();
        let heights = plan(&problem(10_000, &faces));
        assert_eq!(heights.iter().sum::<u32>(), 10_000);
    }
}
