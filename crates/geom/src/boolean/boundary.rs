//! Booleans of rings that cross.
//!
//! Every crossing is a node in which two sides meet. The rings are cut there into arcs, the
//! windings left and right of an arc say whether it bounds what is kept, and the kept arcs are
//! joined at the nodes. Windings are counted once a ring, at its least point, and then carried
//! along: who passes a side from its left to its right leaves one winding behind (the *boundary
//! walk* of K. Weiler, P. Atherton 1977, with winding numbers in place of entry and exit points).
//!
//! Differences from the source, and from a sweep: only proper crossings are taken, one at a place;
//! rings that touch, overlap or meet in one point three at a time are not decided here. Rounding a
//! crossing to the grid bends its sides, so what is joined is checked for crossings once more. In
//! return nothing is sorted or searched but the few crossings that there are.

use crate::region::Ring;

use super::Windings;
use super::crossing::{Crossing, Passage};
use super::simple::Simple;

/// Returns the rings around all places whose windings `is_inside` accepts, material to their left;
/// `None` where that takes more than proper crossings.
pub(super) fn uncrossed(
    rings: &[Simple],
    crossings: &[Crossing],
    is_inside: impl Fn(Windings) -> bool,
) -> Option<Vec<Ring>> {
    let mut passages = passages(rings, crossings)?.into_iter().peekable();
    let mut kept = Vec::new();
    let mut arcs = Arcs { from: vec![None; crossings.len()], to: vec![0; crossings.len()] };
    for (index, ring) in rings.iter().enumerate() {
        let mut own = Vec::new();
        while let Some(passage) = passages.next_if(|(way, _)| way.ring == index) {
            own.push(passage);
        }
        let start = windings_at_start(rings, index);
        if own.is_empty() {
            match bounds_kept(start, ring, &is_inside) {
                Some(true) => kept.push(ring.points.clone()),
                Some(false) => kept.push(ring.points.iter().rev().copied().collect()),
                None => {}
            }
        } else {
            cut(rings, crossings, index, &own, start, &is_inside, &mut arcs)?;
        }
    }
    arcs.join(crossings, &mut kept)?;
    Some(kept)
}

/// A passage, and the number of its crossing.
type Numbered = (Passage, usize);

/// All passages of rings through crossings, ring by ring in the order in which a ring meets them;
/// `None` when two lie in the same place, or one at the end of its side.
fn passages(rings: &[Simple], crossings: &[Crossing]) -> Option<Vec<Numbered>> {
    let numbered = crossings.iter().enumerate();
    let mut passages: Vec<Numbered> =
        numbered.flat_map(|(node, crossing)| crossing.passages.map(|way| (way, node))).collect();
    passages.sort_unstable_by(|(a, _), (b, _)| {
        (a.ring, a.side).cmp(&(b.ring, b.side)).then(a.along.total_cmp(&b.along))
    });
    let are_apart = passages.windows(2).all(|pair| {
        let [(a, one), (b, other)] = [pair[0], pair[1]];
        (a.ring, a.side) != (b.ring, b.side) || crossings[one].at != crossings[other].at
    });
    let are_off_corners = passages.iter().all(|(way, node)| {
        let (a, b) = rings[way.ring].side(way.side);
        ![a, b].contains(&crossings[*node].at)
    });
    (are_apart && are_off_corners).then_some(passages)
}

/// The windings left of the side that begins at a ring's least point.
fn windings_at_start(rings: &[Simple], index: usize) -> Windings {
    let ring = &rings[index];
    let mut left = Windings::default();
    for (other, around) in rings.iter().enumerate() {
        if other != index {
            left.add(around.weight, around.windings_about(ring.points[0]));
        }
    }
    // Nothing of the ring itself lies beyond its least point: that is its outside.
    if ring.turns_left_at_start() {
        left.add(ring.weight, 1);
    }
    left
}

/// Whether a line with these windings on its left bounds what is kept: with it on its left
/// (`Some(true)`), on its right, or not at all.
fn bounds_kept(
    left: Windings,
    ring: &Simple,
    is_inside: impl Fn(Windings) -> bool,
) -> Option<bool> {
    let mut right = left;
    right.add(ring.weight, -1);
    let is_left = is_inside(left);
    (is_left != is_inside(right)).then_some(is_left)
}

/// Arcs that bound what is kept, by the node in which they begin.
struct Arcs {
    /// The arc's points behind the node.
    from: Vec<Option<Ring>>,
    /// The node in which it ends.
    to: Vec<usize>,
}

/// Cuts a ring at its passages and keeps the arcs that bound something.
fn cut(
    rings: &[Simple],
    crossings: &[Crossing],
    index: usize,
    own: &[Numbered],
    start: Windings,
    is_inside: &impl Fn(Windings) -> bool,
    arcs: &mut Arcs,
) -> Option<()> {
    let ring = &rings[index];
    let mut left = start;
    for (i, (way, node)) in own.iter().enumerate() {
        let met = rings[crossings[*node].other(way).ring].weight;
        left.add(met, if way.to_the_right { -1 } else { 1 });
        let (next, next_node) = &own[(i + 1) % own.len()];
        if let Some(forwards) = bounds_kept(left, ring, is_inside) {
            let mut between = ring.points_between(way, next);
            if forwards {
                arcs.add(*node, *next_node, between)?;
            } else {
                between.reverse();
                arcs.add(*next_node, *node, between)?;
            }
        }
    }
    // Whoever comes round finds what was left there, or something was counted wrong.
    (left == start).then_some(())
}

impl Arcs {
    /// `None` when another arc begins at the same node: kept places meet there in a point.
    fn add(&mut self, from: usize, to: usize, between: Ring) -> Option<()> {
        self.to[from] = to;
        self.from[from].replace(between).is_none().then_some(())
    }

    /// Adds the closed rings that the arcs make.
    fn join(mut self, crossings: &[Crossing], kept: &mut Vec<Ring>) -> Option<()> {
        for start in 0..crossings.len() {
            if self.from[start].is_none() {
                continue;
            }
            let mut ring: Ring = Vec::new();
            let mut node = start;
            // A node whose arc is gone before the ring is closed had one come in and none go out.
            loop {
                let between = self.from[node].take()?;
                ring.push(crossings[node].at);
                ring.extend(between);
                node = self.to[node];
                if node == start {
                    break;
                }
            }
            kept.push(ring);
        }
        Some(())
    }
}
