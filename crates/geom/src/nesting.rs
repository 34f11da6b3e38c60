//! Booleans of rings that do not cross.
//!
//! Most offsets and most comparisons of neighbouring layers lay rings beside or inside each other
//! without a single crossing. Then nothing has to be cut: every ring is kept whole or dropped, by
//! the windings on its two sides, and which rings lie around it says what these are. Telling that
//! nothing crosses costs a small part of the sweep that would find where.

use crate::grid::GridPoint;
use crate::region::{Island, Ring, signed_area};

/// Whose ring it is in a boolean of two regions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// The region before the operator.
    Subject,
    /// The region behind it.
    Clip,
}

/// How often places are wound round by the rings of either side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Windings {
    pub(crate) subject: i32,
    pub(crate) clip: i32,
}

impl Windings {
    fn add(&mut self, side: Side, winding: i32) {
        match side {
            Side::Subject => self.subject += winding,
            Side::Clip => self.clip += winding,
        }
    }
}

/// Returns the islands of all places whose windings `is_inside` accepts; `None` when rings cross
/// or touch, others or themselves.
///
/// The result is the overlay engine's to the last point: outer rings in the order of their least
/// points (by x, then y), so are their holes, and no point lies on a straight line between its
/// neighbours.
pub(crate) fn resolved<'a>(
    rings: impl Iterator<Item = (&'a [GridPoint], Side)>,
    is_inside: impl Fn(Windings) -> bool,
) -> Option<Vec<Island>> {
    let mut placed = Vec::new();
    for (ring, side) in rings {
        if let Some(ring) = Simple::new(ring, side)? {
            placed.push(ring);
        }
    }
    if any_cross(&placed) {
        return None;
    }
    Some(islands(&placed, is_inside))
}

/// A ring without repeated points and straight corners.
struct Simple {
    /// From the least point on.
    points: Ring,
    side: Side,
    bounds: Bounds,
    /// mm², signed.
    area: f64,
}

impl Simple {
    /// `Some(None)` for a ring that encloses nothing, `None` for one that turns back on itself.
    fn new(ring: &[GridPoint], side: Side) -> Option<Option<Self>> {
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
        Some(Some(Self { points, side, bounds, area }))
    }

    fn winding(&self) -> i32 {
        if self.area > 0.0 { 1 } else { -1 }
    }

    /// Whether a point that is not on the ring lies inside.
    fn holds(&self, p: GridPoint) -> bool {
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
        |a: i32, b: i32, c: i32| (i128::from(b) - i128::from(a)) * (i128::from(c) - i128::from(b));
    if along(a.x, b.x, c.x) + along(a.y, b.y, c.y) > 0 { Turn::Straight } else { Turn::Back }
}

/// Twice the area of the triangle, positive when counter-clockwise.
fn cross(a: GridPoint, b: GridPoint, c: GridPoint) -> i128 {
    let from_a =
        |p: GridPoint| (i128::from(p.x) - i128::from(a.x), i128::from(p.y) - i128::from(a.y));
    let ((bx, by), (cx, cy)) = (from_a(b), from_a(c));
    bx * cy - by * cx
}

#[derive(Clone, Copy)]
struct Bounds {
    min: GridPoint,
    max: GridPoint,
}

impl Bounds {
    fn of(points: &[GridPoint]) -> Self {
        let mut bounds = Self { min: points[0], max: points[0] };
        for p in &points[1..] {
            bounds.min = GridPoint::new(bounds.min.x.min(p.x), bounds.min.y.min(p.y));
            bounds.max = GridPoint::new(bounds.max.x.max(p.x), bounds.max.y.max(p.y));
        }
        bounds
    }

    fn of_side(a: GridPoint, b: GridPoint) -> Self {
        Self {
            min: GridPoint::new(a.x.min(b.x), a.y.min(b.y)),
            max: GridPoint::new(a.x.max(b.x), a.y.max(b.y)),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
    }

    fn holds(&self, other: &Self) -> bool {
        self.min.x <= other.min.x
            && other.max.x <= self.max.x
            && self.min.y <= other.min.y
            && other.max.y <= self.max.y
    }
}

/// Sides that share a box: few enough that comparing each with each is cheap, enough that there
/// are few boxes.
const SIDES_PER_CHUNK: usize = 12;

/// Consecutive sides of a ring.
struct Chunk {
    bounds: Bounds,
    ring: usize,
    first: usize,
    end: usize,
}

/// Whether any two sides cross or touch, neighbours in their common corner excepted.
fn any_cross(rings: &[Simple]) -> bool {
    let mut chunks = chunks(rings);
    chunks.sort_unstable_by_key(|chunk| chunk.bounds.min.x);
    chunks.iter().enumerate().any(|(i, chunk)| {
        chunks[i..]
            .iter()
            .take_while(|other| other.bounds.min.x <= chunk.bounds.max.x)
            .any(|other| chunk.bounds.meets(&other.bounds) && chunks_cross(rings, chunk, other))
    })
}

fn chunks(rings: &[Simple]) -> Vec<Chunk> {
    let mut chunks = Vec::new();
    for (ring, simple) in rings.iter().enumerate() {
        let points = &simple.points;
        for first in (0..points.len()).step_by(SIDES_PER_CHUNK) {
            let end = (first + SIDES_PER_CHUNK).min(points.len());
            let mut bounds = Bounds::of(&points[first..end]);
            let last = points[end % points.len()];
            bounds.min = GridPoint::new(bounds.min.x.min(last.x), bounds.min.y.min(last.y));
            bounds.max = GridPoint::new(bounds.max.x.max(last.x), bounds.max.y.max(last.y));
            chunks.push(Chunk { bounds, ring, first, end });
        }
    }
    chunks
}

fn chunks_cross(rings: &[Simple], one: &Chunk, other: &Chunk) -> bool {
    let (p, q) = (&rings[one.ring].points, &rings[other.ring].points);
    let is_same_ring = one.ring == other.ring;
    (one.first..one.end).any(|i| {
        let (a, b) = (p[i], p[(i + 1) % p.len()]);
        let side = Bounds::of_side(a, b);
        if !side.meets(&other.bounds) {
            return false;
        }
        let from = if is_same_ring && one.first == other.first { i + 1 } else { other.first };
        (from..other.end).any(|j| {
            let (c, d) = (q[j], q[(j + 1) % q.len()]);
            if !side.meets(&Bounds::of_side(c, d)) {
                return false;
            }
            // Neighbours meet in their corner and, since none turns back, nowhere else.
            let are_neighbours = is_same_ring && ((i + 1) % p.len() == j || (j + 1) % p.len() == i);
            !are_neighbours && sides_meet(a, b, c, d)
        })
    })
}

/// Whether two sides whose boxes meet have a point in common.
fn sides_meet(a: GridPoint, b: GridPoint, c: GridPoint, d: GridPoint) -> bool {
    let apart = |p: i128, q: i128| (p > 0 && q > 0) || (p < 0 && q < 0);
    !apart(cross(a, b, c), cross(a, b, d)) && !apart(cross(c, d, a), cross(c, d, b))
}

/// A ring that bounds what is kept.
struct Kept {
    ring: usize,
    is_outer: bool,
    /// The rings around it.
    around: Vec<usize>,
}

fn islands(rings: &[Simple], is_inside: impl Fn(Windings) -> bool) -> Vec<Island> {
    let mut kept: Vec<Kept> = Vec::new();
    for (index, ring) in rings.iter().enumerate() {
        let around: Vec<usize> = (0..rings.len())
            .filter(|&other| {
                other != index
                    && rings[other].bounds.holds(&ring.bounds)
                    && rings[other].holds(ring.points[0])
            })
            .collect();
        let mut windings = Windings::default();
        for &other in &around {
            windings.add(rings[other].side, rings[other].winding());
        }
        let outside = is_inside(windings);
        windings.add(ring.side, ring.winding());
        let inside = is_inside(windings);
        if inside != outside {
            kept.push(Kept { ring: index, is_outer: inside, around });
        }
    }
    kept.sort_unstable_by_key(|kept| {
        let least = rings[kept.ring].points[0];
        (least.x, least.y)
    });
    let mut islands: Vec<Island> = Vec::new();
    let mut island_of = vec![usize::MAX; rings.len()];
    for outer in kept.iter().filter(|kept| kept.is_outer) {
        island_of[outer.ring] = islands.len();
        islands.push(vec![oriented(&rings[outer.ring], true)]);
    }
    for hole in kept.iter().filter(|kept| !kept.is_outer) {
        let smallest = hole
            .around
            .iter()
            .filter(|&&ring| island_of[ring] != usize::MAX)
            .min_by(|&&a, &&b| rings[a].area.abs().total_cmp(&rings[b].area.abs()));
        if let Some(&outer) = smallest {
            islands[island_of[outer]].push(oriented(&rings[hole.ring], false));
        }
    }
    islands
}

/// The ring's points as the overlay engine lists them: outer rings counter-clockwise with the least
/// point second, holes clockwise with the least point first.
fn oriented(ring: &Simple, is_outer: bool) -> Ring {
    let mut points = ring.points.clone();
    if (ring.area > 0.0) != is_outer {
        points[1..].reverse();
    }
    if is_outer {
        points.rotate_right(1);
    }
    points
}
