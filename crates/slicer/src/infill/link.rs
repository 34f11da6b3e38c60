//! Lines joined along the rim of their area, into as few as possible.
//!
//! Neighbouring line ends on a ring can be joined by the piece of rim between them, on which no
//! other line ends. A line is grown from its free end, always over the shorter of the two joins
//! there that lead to a line not used yet; for parallel lines this yields the familiar zigzag, for
//! pieces of a spiral its counterpart, with no special case for either. What is left over is joined shortest
//! first, except where that would close a loop.
//!
//! Of the rim, joins take every other piece. An end that stays free can be given its share of the
//! two pieces beside it, so that a solid area is filled to its corners.

use geom::grid::mm;
use geom::region::Region;
use nalgebra::{Point2, distance};

use super::{Chord, RimPoint};

/// One end of a chord: the chord's index and 0 for its begin, 1 for its end.
pub(super) type End = (usize, usize);

/// A piece of rim between two ends, in the direction of the ring.
#[derive(Clone, Copy)]
struct Join {
    length: f64,
    from: End,
    to: End,
}

impl Join {
    /// The end that is not `end`.
    fn other(&self, end: End) -> End {
        if self.from == end { self.to } else { self.from }
    }
}

/// The joins that were made, by the ends that they join.
struct Made {
    by_end: Vec<[Option<Join>; 2]>,
    groups: Groups,
}

impl Made {
    fn is_free(&self, end: End) -> bool {
        self.by_end[end.0][end.1].is_none()
    }

    /// Makes a join, unless an end is taken or a loop would close.
    fn make(&mut self, join: &Join) -> bool {
        let (a, b) = (join.from, join.to);
        let possible = self.is_free(a) && self.is_free(b) && self.groups.merge(a.0, b.0);
        if possible {
            self.by_end[a.0][a.1] = Some(*join);
            self.by_end[b.0][b.1] = Some(*join);
        }
        possible
    }
}

/// How lines may be joined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct JoinParams {
    /// The longest piece of rim that joins two ends, mm.
    pub(super) longest: f64,
    /// Whether free ends take their share of the rim.
    pub(super) fill_rim: bool,
}

/// Returns the chords joined along the rim of `core`.
pub(super) fn joined(
    core: &Region,
    chords: &[Chord],
    params: &JoinParams,
) -> Vec<Vec<Point2<f64>>> {
    joined_pieces(core, chords, params).iter().map(|line| line.concat()).collect()
}

/// Returns the same lines in pieces: of the rim, a chord, of the rim, another chord and so on, with the rim
/// of a free end at either end. Pieces of rim lack the ends of the chords beside them, and may be empty.
pub(super) fn joined_pieces(
    core: &Region,
    chords: &[Chord],
    params: &JoinParams,
) -> Vec<Vec<Vec<Point2<f64>>>> {
    let rings: Vec<Vec<Point2<f64>>> =
        core.rings().map(|ring| ring.iter().map(|&p| mm(p)).collect()).collect();
    let mut joins = possible_joins(&rings, chords);
    joins.retain(|join| join.length <= params.longest);
    let at_end = by_end(&joins, chords.len());
    let mut made =
        Made { by_end: vec![[None; 2]; chords.len()], groups: Groups::new(chords.len()) };
    let mut used = vec![false; chords.len()];
    for start in 0..chords.len() {
        if used[start] {
            continue;
        }
        used[start] = true;
        for side in [1, 0] {
            grow((start, side), &joins, &at_end, &mut used, &mut made);
        }
    }
    let stub = |end: End| -> Vec<Point2<f64>> {
        let Some(rim) = chords[end.0].ends[end.1].filter(|_| params.fill_rim) else {
            return Vec::new();
        };
        let beside = at_end[end.0][end.1].iter().map(|&index| &joins[index]);
        let ring = &rings[rim.ring];
        if at_end[end.0][end.1].is_empty() {
            return only_end_share(ring, &rim, &chords[end.0], end.1);
        }
        free_end_share(ring, &rim, end, beside)
    };
    // Ties go by the order of the chords, which comes from the geometry alone.
    let mut by_length = joins.clone();
    by_length.sort_unstable_by(|a, b| {
        a.length.total_cmp(&b.length).then((a.from, a.to).cmp(&(b.from, b.to)))
    });
    for join in &by_length {
        made.make(join);
    }
    chains(&rings, chords, &made.by_end, stub)
}

/// Joins chosen one by one, for lines whose order is given.
pub(super) struct Walk<'a> {
    rings: Vec<Vec<Point2<f64>>>,
    chords: &'a [Chord],
    joins: Vec<Join>,
    at_end: Vec<[Vec<usize>; 2]>,
    params: JoinParams,
}

impl<'a> Walk<'a> {
    pub(super) fn new(core: &Region, chords: &'a [Chord], params: &JoinParams) -> Self {
        let rings: Vec<Vec<Point2<f64>>> =
            core.rings().map(|ring| ring.iter().map(|&p| mm(p)).collect()).collect();
        let joins = possible_joins(&rings, chords);
        let at_end = by_end(&joins, chords.len());
        Self { rings, chords, joins, at_end, params: *params }
    }

    /// The ends that can be reached from an end along the rim, the nearest first.
    pub(super) fn neighbours(&self, end: End) -> Vec<End> {
        let mut reached: Vec<(f64, End)> = self.at_end[end.0][end.1]
            .iter()
            .map(|&index| (self.joins[index].length, self.joins[index].other(end)))
            .filter(|(length, other)| *length <= self.params.longest && other.0 != end.0)
            .collect();
        reached.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        reached.into_iter().map(|(_, end)| end).collect()
    }

    /// The line through chords that are each begun at the given end, joined along the rim.
    pub(super) fn line(&self, entries: &[End]) -> Vec<Point2<f64>> {
        let Some((&first, &last)) = entries.first().zip(entries.last()) else { return Vec::new() };
        let mut points = self.share(first);
        points.reverse();
        for (k, &(chord, entry)) in entries.iter().enumerate() {
            if let Some(&(before, entry_before)) = k.checked_sub(1).and_then(|k| entries.get(k)) {
                self.join((before, 1 - entry_before), (chord, entry), &mut points);
            }
            let along = &self.chords[chord].points;
            if entry == 0 {
                points.extend(along);
            } else {
                points.extend(along.iter().rev());
            }
        }
        points.extend(self.share((last.0, 1 - last.1)));
        points
    }

    fn join(&self, from: End, to: End, points: &mut Vec<Point2<f64>>) {
        let joins = self.at_end[from.0][from.1].iter().map(|&index| &self.joins[index]);
        let shortest = joins
            .filter(|join| join.other(from) == to)
            .min_by(|a, b| a.length.total_cmp(&b.length));
        if let Some(join) = shortest {
            append_rim(&self.rings, self.chords, join, join.from == from, points);
        }
    }

    /// The rim that belongs to a free end.
    fn share(&self, end: End) -> Vec<Point2<f64>> {
        let Some(rim) = self.chords[end.0].ends[end.1].filter(|_| self.params.fill_rim) else {
            return Vec::new();
        };
        let beside = self.at_end[end.0][end.1].iter().map(|&index| &self.joins[index]);
        free_end_share(&self.rings[rim.ring], &rim, end, beside)
    }
}

/// The joins at each end.
fn by_end(joins: &[Join], chords: usize) -> Vec<[Vec<usize>; 2]> {
    let mut at_end: Vec<[Vec<usize>; 2]> = vec![[Vec::new(), Vec::new()]; chords];
    for (index, join) in joins.iter().enumerate() {
        for end in [join.from, join.to] {
            at_end[end.0][end.1].push(index);
        }
    }
    at_end
}

/// Grows a line from its free end over chords that are not used yet.
fn grow(
    mut end: End,
    joins: &[Join],
    at_end: &[[Vec<usize>; 2]],
    used: &mut [bool],
    made: &mut Made,
) {
    loop {
        let shortest = at_end[end.0][end.1]
            .iter()
            .map(|&index| &joins[index])
            .filter(|join| !used[join.other(end).0])
            .min_by(|a, b| a.length.total_cmp(&b.length));
        let Some(join) = shortest else { return };
        let next = join.other(end);
        if !made.make(join) {
            return;
        }
        used[next.0] = true;
        end = (next.0, 1 - next.1);
    }
}

/// All pieces of rim between neighbouring ends.
fn possible_joins(rings: &[Vec<Point2<f64>>], chords: &[Chord]) -> Vec<Join> {
    let mut on_ring: Vec<Vec<(RimPoint, End)>> = vec![Vec::new(); rings.len()];
    for (index, chord) in chords.iter().enumerate() {
        for (k, rim) in chord.ends.iter().enumerate() {
            if let Some(rim) = rim {
                on_ring[rim.ring].push((*rim, (index, k)));
            }
        }
    }
    let mut joins = Vec::new();
    for (ring, mut ends) in rings.iter().zip(on_ring) {
        if ends.len() < 2 {
            continue;
        }
        ends.sort_unstable_by(|(a, a_end), (b, b_end)| {
            a.side.cmp(&b.side).then(a.share.total_cmp(&b.share)).then(a_end.cmp(b_end))
        });
        let mut start_of_side = vec![0.0];
        for side in 0..ring.len() {
            let length = distance(&ring[side], &ring[(side + 1) % ring.len()]);
            start_of_side.push(start_of_side[side] + length);
        }
        let position = |rim: &RimPoint| {
            let (start, end) = (start_of_side[rim.side], start_of_side[rim.side + 1]);
            start + (end - start) * rim.share
        };
        let around = start_of_side[ring.len()];
        for k in 0..ends.len() {
            let (rim, from) = &ends[k];
            let (next_rim, to) = &ends[(k + 1) % ends.len()];
            let ahead = position(next_rim) - position(rim);
            let length = if k + 1 == ends.len() { ahead + around } else { ahead };
            joins.push(Join { length, from: *from, to: *to });
        }
    }
    joins
}

/// Walks through chords and joins from every free end, and returns them in pieces.
fn chains(
    rings: &[Vec<Point2<f64>>],
    chords: &[Chord],
    made: &[[Option<Join>; 2]],
    stub: impl Fn(End) -> Vec<Point2<f64>>,
) -> Vec<Vec<Vec<Point2<f64>>>> {
    let mut used = vec![false; chords.len()];
    let mut lines = Vec::new();
    for start in 0..chords.len() {
        let free = (0..2).find(|&k| made[start][k].is_none());
        let Some(mut entry) = free.filter(|_| !used[start]) else { continue };
        let mut at = start;
        let mut first = stub((start, entry));
        first.reverse();
        let mut line = vec![first];
        loop {
            used[at] = true;
            let mut along = chords[at].points.clone();
            if entry == 1 {
                along.reverse();
            }
            line.push(along);
            let exit = 1 - entry;
            let Some(join) = made[at][exit] else {
                line.push(stub((at, exit)));
                break;
            };
            let forwards = join.from == (at, exit);
            let mut corners = Vec::new();
            append_rim(rings, chords, &join, forwards, &mut corners);
            line.push(corners);
            (at, entry) = join.other((at, exit));
        }
        lines.push(line);
    }
    lines
}

/// Appends the corners of the ring between the two ends of a join.
fn append_rim(
    rings: &[Vec<Point2<f64>>],
    chords: &[Chord],
    join: &Join,
    forwards: bool,
    line: &mut Vec<Point2<f64>>,
) {
    let rim = |end: End| chords[end.0].ends[end.1].expect("joins end on the rim");
    let (from, to) = (rim(join.from), rim(join.to));
    let ring = &rings[from.ring];
    let wraps = (to.side, to.share) < (from.side, from.share) || join.from == join.to;
    let sides = to.side + if wraps { ring.len() } else { 0 } - from.side;
    let start = line.len();
    line.extend((1..=sides).map(|k| ring[(from.side + k) % ring.len()]));
    if !forwards {
        line[start..].reverse();
    }
}

/// The rim that belongs to a free end: a quarter of the two pieces beside it, taken from the longer.
fn free_end_share<'a>(
    ring: &[Point2<f64>],
    rim: &RimPoint,
    end: End,
    beside: impl Iterator<Item = &'a Join>,
) -> Vec<Point2<f64>> {
    let (mut ahead, mut behind) = (0.0, 0.0);
    // A piece of rim between the two ends of one line has that line running along it.
    for join in beside.filter(|join| join.from.0 != join.to.0) {
        if join.from == end {
            ahead = join.length;
        } else {
            behind = join.length;
        }
    }
    let share = ((ahead + behind) / 4.0).min(f64::max(ahead, behind) / 2.0);
    if share < LEAST_SHARE_MM {
        return Vec::new();
    }
    along_rim(ring, rim, share, ahead > behind)
}

/// The rim that belongs to the only end on a ring: a line that winds round it lies farther and farther
/// off, and after a turn a whole spacing. The second half of that turn is the rim's.
fn only_end_share(
    ring: &[Point2<f64>],
    rim: &RimPoint,
    chord: &Chord,
    end: usize,
) -> Vec<Point2<f64>> {
    let side = ring[(rim.side + 1) % ring.len()] - ring[rim.side];
    let beside = |k: usize| match end {
        0 => chord.points.get(k),
        _ => chord.points.len().checked_sub(k + 1).and_then(|k| chord.points.get(k)),
    };
    let (Some(at), Some(next)) = (beside(0), beside(1)) else { return Vec::new() };
    let around: f64 =
        (0..ring.len()).map(|k| distance(&ring[k], &ring[(k + 1) % ring.len()])).sum();
    along_rim(ring, rim, around / 2.0, side.dot(&(next - at)) < 0.0)
}

/// Pieces of rim shorter than this are not worth a move, mm.
const LEAST_SHARE_MM: f64 = 0.05;

/// The points of a ring from a place on it, `length` mm forwards or backwards.
fn along_rim(
    ring: &[Point2<f64>],
    from: &RimPoint,
    length: f64,
    forwards: bool,
) -> Vec<Point2<f64>> {
    let count = ring.len();
    let corner = |side: usize, k: usize| {
        if forwards {
            ring[(side + 1 + k) % count]
        } else {
            ring[(side + count - k % count) % count]
        }
    };
    let (a, b) = (ring[from.side], ring[(from.side + 1) % count]);
    let mut at = a + (b - a) * from.share;
    let mut left = length;
    let mut points = Vec::new();
    for k in 0..count {
        let next = corner(from.side, k);
        let step = distance(&at, &next);
        if step >= left {
            if left > 0.0 {
                points.push(at + (next - at) * (left / step));
            }
            break;
        }
        points.push(next);
        left -= step;
        at = next;
    }
    points
}

/// Which chords hang together already (union–find).
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn root(&mut self, mut item: usize) -> usize {
        while self.0[item] != item {
            self.0[item] = self.0[self.0[item]];
            item = self.0[item];
        }
        item
    }

    /// Joins two groups; false when they were one already.
    fn merge(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
        a != b
    }
}
