//! Where the sides of rings cross.

use crate::grid::GridPoint;

use super::simple::{Bounds, Simple, cross};

/// Where two sides cross.
pub(super) struct Crossing {
    /// On the grid.
    pub(super) at: GridPoint,
    /// The way of either side through it.
    pub(super) passages: [Passage; 2],
}

impl Crossing {
    /// The way of the other side.
    pub(super) fn other(&self, passage: &Passage) -> &Passage {
        let [one, other] = &self.passages;
        if (one.ring, one.side) == (passage.ring, passage.side) { other } else { one }
    }
}

/// The way of a ring's side through a crossing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Passage {
    pub(super) ring: usize,
    /// By the number of its first point.
    pub(super) side: usize,
    /// How far along the side, 0 to 1.
    pub(super) along: f64,
    /// Whether it leads from the left of the other side to its right.
    pub(super) to_the_right: bool,
}

/// Returns where sides cross; `None` when any touch, neighbours in their common corner excepted.
pub(super) fn crossings(rings: &[Simple]) -> Option<Vec<Crossing>> {
    let mut chunks = chunks(rings);
    chunks.sort_unstable_by_key(|chunk| chunk.bounds.min.x);
    let mut found = Vec::new();
    for (i, chunk) in chunks.iter().enumerate() {
        for other in &chunks[i..] {
            if other.bounds.min.x > chunk.bounds.max.x {
                break;
            }
            if chunk.bounds.meets(&other.bounds) && !chunk.runs_on_in(other) {
                add_crossings(rings, chunk, other, &mut found)?;
            }
        }
    }
    Some(found)
}

/// Sides that share a box: few enough that comparing each with each is cheap, enough that there
/// are few boxes.
const SIDES_PER_CHUNK: usize = 8;

/// Consecutive sides of a ring.
struct Chunk {
    bounds: Bounds,
    ring: usize,
    first: usize,
    end: usize,
    way: Way,
}

impl Chunk {
    /// Whether it and `other`, the same or one that follows it, are parts of a line that runs one way:
    /// such a line meets itself nowhere.
    fn runs_on_in(&self, other: &Self) -> bool {
        let is_next = self.end == other.first || other.end == self.first;
        self.ring == other.ring
            && self.way == other.way
            && self.way != Way::Both
            && (self.first == other.first || is_next)
    }
}

/// Which way along x sides run.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Up,
    Down,
    Both,
}

impl Way {
    fn of(points: &[GridPoint], last: GridPoint) -> Self {
        let ends = points[1..].iter().chain([&last]);
        let (mut up, mut down) = (true, true);
        for (a, b) in points.iter().zip(ends) {
            up &= a.x <= b.x;
            down &= a.x >= b.x;
        }
        match (up, down) {
            (true, false) => Self::Up,
            (false, true) => Self::Down,
            _ => Self::Both,
        }
    }
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
            let way = Way::of(&points[first..end], last);
            chunks.push(Chunk { bounds, ring, first, end, way });
        }
    }
    chunks
}

/// A side of a ring, by the number of its first point, and the box around it.
#[derive(Clone, Copy)]
struct Side {
    index: usize,
    ends: [GridPoint; 2],
    bounds: Bounds,
}

/// The sides of a chunk that reach into a box.
struct Reaching {
    sides: [Side; SIDES_PER_CHUNK],
    count: usize,
}

impl Reaching {
    fn of(ring: &Simple, chunk: &Chunk, into: &Bounds) -> Self {
        let (mut index, mut a) = (chunk.first, ring.points[chunk.first]);
        let none = Side { index, ends: [a, a], bounds: Bounds::of_side(a, a) };
        let mut reaching = Self { sides: [none; SIDES_PER_CHUNK], count: 0 };
        let closing = (chunk.end == ring.points.len()).then_some(&ring.points[0]);
        let last = chunk.end.min(ring.points.len() - 1);
        for &b in ring.points[chunk.first + 1..=last].iter().chain(closing) {
            let bounds = Bounds::of_side(a, b);
            if bounds.meets(into) {
                reaching.sides[reaching.count] = Side { index, ends: [a, b], bounds };
                reaching.count += 1;
            }
            (index, a) = (index + 1, b);
        }
        reaching
    }

    fn sides(&self) -> &[Side] {
        &self.sides[..self.count]
    }
}

fn add_crossings(
    rings: &[Simple],
    one: &Chunk,
    other: &Chunk,
    found: &mut Vec<Crossing>,
) -> Option<()> {
    let (p, q) = (&rings[one.ring], &rings[other.ring]);
    let is_same_ring = one.ring == other.ring;
    let is_same_chunk = is_same_ring && one.first == other.first;
    let count = p.points.len();
    let common = one.bounds.common(&other.bounds);
    let ours = Reaching::of(p, one, &common);
    let theirs = if is_same_chunk { None } else { Some(Reaching::of(q, other, &common)) };
    for (k, side) in ours.sides().iter().enumerate() {
        let against = match &theirs {
            Some(theirs) => theirs.sides(),
            None => &ours.sides()[k + 1..],
        };
        for with in against {
            if !side.bounds.meets(&with.bounds) {
                continue;
            }
            let (i, j) = (side.index, with.index);
            // Neighbours meet in their corner and, since none turns back, nowhere else.
            if is_same_ring && (i.abs_diff(j) == 1 || i.abs_diff(j) == count - 1) {
                continue;
            }
            match meeting(side.ends, with.ends) {
                Meeting::Apart => {}
                Meeting::Touch => return None,
                Meeting::Cross { at, along, to_the_right } => {
                    let passages = [
                        Passage { ring: one.ring, side: i, along: along[0], to_the_right },
                        Passage {
                            ring: other.ring,
                            side: j,
                            along: along[1],
                            to_the_right: !to_the_right,
                        },
                    ];
                    found.push(Crossing { at, passages });
                }
            }
        }
    }
    Some(())
}

enum Meeting {
    Apart,
    /// An end of one side lies on the other.
    Touch,
    /// Each side's ends lie on different sides of the other.
    Cross {
        at: GridPoint,
        /// How far along either side, 0 to 1.
        along: [f64; 2],
        /// Whether the first leads from the left of the second to its right.
        to_the_right: bool,
    },
}

/// How two sides meet whose boxes do.
fn meeting([a, b]: [GridPoint; 2], [c, d]: [GridPoint; 2]) -> Meeting {
    let apart = |p: i64, q: i64| (p > 0 && q > 0) || (p < 0 && q < 0);
    let (of_c, of_d) = (cross(a, b, c), cross(a, b, d));
    if apart(of_c, of_d) {
        return Meeting::Apart;
    }
    let (of_a, of_b) = (cross(c, d, a), cross(c, d, b));
    if apart(of_a, of_b) {
        return Meeting::Apart;
    }
    if [of_a, of_b, of_c, of_d].contains(&0) {
        return Meeting::Touch;
    }
    let share = |p: i64, q: i64| p as f64 / (p as f64 - q as f64);
    let along = [share(of_a, of_b), share(of_c, of_d)];
    let between = |p: i32, q: i32| {
        let (p, q) = (f64::from(p), f64::from(q));
        (p + (q - p) * along[0]).round() as i32
    };
    let at = GridPoint::new(between(a.x, b.x), between(a.y, b.y));
    Meeting::Cross { at, along, to_the_right: of_a > 0 }
}
