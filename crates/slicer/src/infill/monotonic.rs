//! Parallel lines laid from one side of an area to the other.
//!
//! A line is laid only when those beside it on the near side are there. Where an area forks, one
//! branch is followed as far as that allows, then the nozzle goes back for the other.

use geom::region::Region;
use nalgebra::Point2;

use super::link::{JoinParams, Walk};
use super::rectilinear::Even;

/// The lines of an area, in the order and direction in which they are to be laid.
pub(super) fn lines(even: &Even, joins: &JoinParams) -> Vec<Vec<Point2<f64>>> {
    let beside = Beside::of(&even.rows);
    in_order(&even.core, even, &beside, joins)
}

/// Which lines lie side by side.
struct Beside {
    /// For each line those of the next row that lie along it.
    after: Vec<Vec<usize>>,
    /// How many of the row before lie along it.
    before: Vec<usize>,
}

impl Beside {
    fn of(rows: &[(i64, [f64; 2])]) -> Self {
        let mut beside = Self { after: vec![Vec::new(); rows.len()], before: vec![0; rows.len()] };
        for (index, (row, [from, to])) in rows.iter().enumerate() {
            let next = rows.partition_point(|(other, _)| other <= row);
            let along = rows[next..].iter().enumerate().take_while(|(_, (r, _))| *r == row + 1);
            for (k, (_, [other_from, other_to])) in along {
                if other_from < to && from < other_to {
                    beside.after[index].push(next + k);
                    beside.before[next + k] += 1;
                }
            }
        }
        beside
    }
}

fn in_order(
    core: &Region,
    even: &Even,
    beside: &Beside,
    joins: &JoinParams,
) -> Vec<Vec<Point2<f64>>> {
    let walk = Walk::new(core, &even.chords, joins);
    let mut missing = beside.before.clone();
    let mut ready: Vec<usize> = (0..missing.len()).filter(|&k| missing[k] == 0).collect();
    let mut lines: Vec<Vec<(usize, usize)>> = Vec::new();
    // Where the last line ended: the chord and its end.
    let mut at: Option<(usize, usize)> = None;
    while !ready.is_empty() {
        // Along the rim to a line that is ready, or else to the nearest end of one.
        let joined = at.and_then(|end| {
            let nearby = walk.neighbours(end);
            nearby.into_iter().find(|(chord, _)| ready.contains(chord))
        });
        let entry = joined.unwrap_or_else(|| nearest(&ready, even, at));
        ready.retain(|&chord| chord != entry.0);
        match lines.last_mut().filter(|_| joined.is_some()) {
            Some(line) => line.push(entry),
            None => lines.push(vec![entry]),
        }
        at = Some((entry.0, 1 - entry.1));
        for &next in &beside.after[entry.0] {
            missing[next] -= 1;
            if missing[next] == 0 {
                ready.push(next);
            }
        }
    }
    lines.iter().map(|line| walk.line(line)).collect()
}

/// The ready chord of the lowest row, begun at the end nearest to where the nozzle is.
fn nearest(ready: &[usize], even: &Even, at: Option<(usize, usize)>) -> (usize, usize) {
    let from = at.map(|(chord, end)| end_of(even, chord, end));
    let distance = |&(chord, end): &(usize, usize)| {
        from.map_or(0.0, |from| (end_of(even, chord, end) - from).norm())
    };
    let lowest = ready.iter().map(|&chord| even.rows[chord].0).min();
    ready
        .iter()
        .filter(|&&chord| Some(even.rows[chord].0) == lowest)
        .flat_map(|&chord| [(chord, 0), (chord, 1)])
        .min_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)))
        .unwrap_or((0, 0))
}

fn end_of(even: &Even, chord: usize, end: usize) -> Point2<f64> {
    let points = &even.chords[chord].points;
    points[if end == 0 { 0 } else { points.len() - 1 }]
}
