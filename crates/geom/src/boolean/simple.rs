//! One ring of a boolean.

use crate::grid::GridPoint;
use crate::region::{Ring, signed_area};

use super::Windings;
use super::crossing::Passage;

/// A ring without repeated points and straight corners.
pub(super) struct Simple {
    /// From the least point on.
    pub(super) points: Ring,
    /// What it adds to the places that it winds round once.
    pub(super) weight: Windings,
    pub(super) bounds: Bounds,
    /// mm², signed.
    pub(super) area: f64,
}

impl Simple {
    /// `Some(None)` for a ring that encloses nothing, `None` for one that turns back on itself.
    pub(super) fn new(ring: &[GridPoint], weight: Windings) -> Option<Option<Self>> {
        let mut points: Ring = Vec::with_capacity(ring.len());
        let Some(least) = (0..ring.len()).min_by_key(|&i| (ring[i].x, ring[i].y)) else {
            return Some(None);
        };
        // The least point is a corner whatever lies around it, unless the ring turns back there.
        for &p in ring[least..].iter().chain(&ring[..least]) {
            append(&mut points, p)?;
        }
        append(&mut points, ring[least])?;
        points.pop();
        if points.is_empty() {
            return Some(None);
        }
        if points.len() < 3 || turn(points[points.len() - 1], points[0], points[1]) == Turn::Back {
            return None;
        }
        let bounds = Bounds::of(&points);
        let area = signed_area(&points);
        Some(Some(Self { points, weight, bounds, area }))
    }

    pub(super) fn winding(&self) -> i32 {
        if self.area > 0.0 { 1 } else { -1 }
    }

    /// The side that begins at point `i`.
    pub(super) fn side(&self, i: usize) -> (GridPoint, GridPoint) {
        let next = if i + 1 == self.points.len() { 0 } else { i + 1 };
        (self.points[i], self.points[next])
    }

    /// Whether it is the other ring the other way round.
    fn reverses(&self, other: &Self) -> bool {
        self.points[1..].iter().rev().eq(&other.points[1..])
    }

    /// Whether the ring turns left in its least point.
    pub(super) fn turns_left_at_start(&self) -> bool {
        cross(self.points[self.points.len() - 1], self.points[0], self.points[1]) > 0
    }

    /// How often the ring winds round a point that is not on it.
    pub(super) fn windings_about(&self, p: GridPoint) -> i32 {
        if !self.bounds.holds(&Bounds { min: p, max: p }) {
            return 0;
        }
        let mut windings = 0;
        let mut a = self.points[self.points.len() - 1];
        for &b in &self.points {
            if (a.y > p.y) != (b.y > p.y) {
                let upwards = b.y > a.y;
                if (cross(a, b, p) > 0) == upwards {
                    windings += if upwards { 1 } else { -1 };
                }
            }
            a = b;
        }
        windings
    }

    /// The corners that the ring has from one passage to the next.
    pub(super) fn points_between(&self, from: &Passage, to: &Passage) -> Ring {
        let count = self.points.len();
        let is_ahead = (to.side, to.along) > (from.side, from.along);
        let sides = to.side + if is_ahead { 0 } else { count } - from.side;
        (1..=sides).map(|k| self.points[(from.side + k) % count]).collect()
    }

    /// Whether a point that is not on the ring lies inside.
    pub(super) fn holds(&self, p: GridPoint) -> bool {
        let mut inside = false;
        let mut a = self.points[self.points.len() - 1];
        for &b in &self.points {
            if (a.y > p.y) != (b.y > p.y) {
                let left = cross(a, b, p) > 0;
                inside ^= left == (b.y > a.y);
            }
            a = b;
        }
        inside
    }
}

/// Returns the rings with those that are equal, this way or the other way round, in one.
pub(super) fn merged(mut rings: Vec<Simple>) -> Vec<Simple> {
    let mut order: Vec<u32> = (0..rings.len() as u32).collect();
    let place = |ring: &Simple| (ring.points[0].x, ring.points[0].y, ring.points.len());
    order.sort_unstable_by_key(|&k| (place(&rings[k as usize]), k));
    let mut is_any = false;
    for pair in order.windows(2) {
        let [one, other] = [pair[0], pair[1]].map(|k| k as usize);
        if place(&rings[one]) != place(&rings[other]) {
            continue;
        }
        let times =
            match (rings[one].points == rings[other].points, rings[one].reverses(&rings[other])) {
                (true, _) => 1,
                (_, true) => -1,
                _ => continue,
            };
        // The last of them speaks for all.
        let weight = std::mem::take(&mut rings[one].weight);
        rings[other].weight.add(weight, times);
        is_any = true;
    }
    if is_any {
        rings.retain(|ring| ring.weight != Windings::default());
    }
    rings
}

/// Appends a point that differs from the last; one straight behind the last two replaces the last.
/// `None` when the line turns back on itself.
fn append(points: &mut Ring, p: GridPoint) -> Option<()> {
    if points.last() == Some(&p) {
        return Some(());
    }
    if let [.., a, b] = points[..] {
        match turn(a, b, p) {
            Turn::Corner => {}
            Turn::Straight => {
                points.pop();
            }
            Turn::Back => return None,
        }
    }
    points.push(p);
    Some(())
}

#[derive(PartialEq, Eq)]
enum Turn {
    Corner,
    Straight,
    Back,
}

fn turn(a: GridPoint, b: GridPoint, c: GridPoint) -> Turn {
    if cross(a, b, c) != 0 {
        return Turn::Corner;
    }
    let along =
        |a: i32, b: i32, c: i32| (i64::from(b) - i64::from(a)) * (i64::from(c) - i64::from(b));
    if along(a.x, b.x, c.x) + along(a.y, b.y, c.y) > 0 { Turn::Straight } else { Turn::Back }
}

/// Twice the area of the triangle, positive when counter-clockwise. Points of the grid reach to
/// 2³⁰ steps, so that nothing overflows.
pub(super) fn cross(a: GridPoint, b: GridPoint, c: GridPoint) -> i64 {
    let from_a = |p: GridPoint| (i64::from(p.x) - i64::from(a.x), i64::from(p.y) - i64::from(a.y));
    let ((bx, by), (cx, cy)) = (from_a(b), from_a(c));
    bx * cy - by * cx
}

#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub(super) min: GridPoint,
    pub(super) max: GridPoint,
}

impl Bounds {
    pub(super) fn of(points: &[GridPoint]) -> Self {
        let mut bounds = Self { min: points[0], max: points[0] };
        for p in &points[1..] {
            bounds.min = GridPoint::new(bounds.min.x.min(p.x), bounds.min.y.min(p.y));
            bounds.max = GridPoint::new(bounds.max.x.max(p.x), bounds.max.y.max(p.y));
        }
        bounds
    }

    pub(super) fn of_side(a: GridPoint, b: GridPoint) -> Self {
        Self {
            min: GridPoint::new(a.x.min(b.x), a.y.min(b.y)),
            max: GridPoint::new(a.x.max(b.x), a.y.max(b.y)),
        }
    }

    /// What two boxes that meet have in common.
    pub(super) fn common(&self, other: &Self) -> Self {
        let (a, b) = (self, other);
        Self {
            min: GridPoint::new(a.min.x.max(b.min.x), a.min.y.max(b.min.y)),
            max: GridPoint::new(a.max.x.min(b.max.x), a.max.y.min(b.max.y)),
        }
    }

    pub(super) fn meets(&self, other: &Self) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
    }

    pub(super) fn holds(&self, other: &Self) -> bool {
        self.min.x <= other.min.x
            && other.max.x <= self.max.x
            && self.min.y <= other.min.y
            && other.max.y <= self.max.y
    }
}
