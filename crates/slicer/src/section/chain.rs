//! Outlines from the ways through single facets.

use std::ops::Range;

use geom::grid::{GridPoint, mm};
use geom::region::Ring;

use super::{LARGEST_GAP_MM, Tears};

/// The outline's way through a facet, from the crossing where it enters to that where it leaves.
///
/// A crossing is a number that the two facets of a side agree on; for planes that of the side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) enter: u32,
    pub(super) leave: u32,
    pub(super) facet: u32,
}

/// Steps in the order of the outlines that they make.
pub(super) struct Trails {
    /// The steps, outline by outline.
    pub(super) steps: Vec<Step>,
    /// Where each outline begins and ends in `steps`, and whether it closes.
    pub(super) outlines: Vec<(Range<usize>, bool)>,
}

/// Puts the steps of a cut in the order of its outlines.
pub(super) fn trails(mut steps: Vec<Step>) -> Trails {
    steps.sort_unstable_by_key(|step| step.enter);
    let mut used = vec![false; steps.len()];
    let mut trails = Trails { steps: Vec::with_capacity(steps.len()), outlines: Vec::new() };
    // What nothing leads into is the begin of an open chain; closed outlines are what remains.
    let mut led_into: Vec<u32> = steps.iter().map(|step| step.leave).collect();
    led_into.sort_unstable();
    for start in 0..steps.len() {
        if led_into.binary_search(&steps[start].enter).is_err() {
            follow(start, &steps, &mut used, &mut trails);
        }
    }
    for start in 0..steps.len() {
        if !used[start] {
            follow(start, &steps, &mut used, &mut trails);
        }
    }
    trails
}

fn follow(start: usize, steps: &[Step], used: &mut [bool], trails: &mut Trails) {
    let begin = trails.steps.len();
    let mut at = start;
    loop {
        used[at] = true;
        trails.steps.push(steps[at]);
        let leave = steps[at].leave;
        let first = steps.partition_point(|step| step.enter < leave);
        // A side of more than two facets that no pairing could part leads on more than once.
        let next = (first..steps.len())
            .take_while(|&next| steps[next].enter == leave)
            .find(|&next| !used[next] || next == start);
        match next {
            Some(next) if next != start => at = next,
            closing => {
                trails.outlines.push((begin..trails.steps.len(), closing.is_some()));
                return;
            }
        }
    }
}

/// An outline in the chart.
pub(super) struct Chain {
    pub(super) points: Ring,
    pub(super) closed: bool,
}

/// Joins open chains end to nearest begin, shortest gap first.
pub(super) fn close_chains(chains: Vec<Chain>, rings: &mut Vec<Ring>) -> Tears {
    let mut tears = Tears::default();
    let (closed, mut open): (Vec<Chain>, Vec<Chain>) =
        chains.into_iter().partition(|chain| chain.closed);
    rings.extend(closed.into_iter().map(|chain| chain.points));
    while !open.is_empty() {
        let mut best: Option<(f64, usize, usize)> = None;
        for (i, from) in open.iter().enumerate() {
            for (j, to) in open.iter().enumerate() {
                let (Some(&end), Some(&begin)) = (from.points.last(), to.points.first()) else {
                    continue;
                };
                let gap = gap_mm(end, begin);
                if best.is_none_or(|(least, _, _)| gap < least) {
                    best = Some((gap, i, j));
                }
            }
        }
        let Some((gap, i, j)) = best.filter(|(gap, _, _)| *gap <= LARGEST_GAP_MM) else { break };
        tears.closed += 1;
        tears.widest = tears.widest.max(gap);
        if i == j {
            rings.push(open.swap_remove(i).points);
        } else {
            let tail = std::mem::take(&mut open[j].points);
            open[i].points.extend(tail);
            open.swap_remove(j);
        }
    }
    for chain in open {
        tears.dropped += 1;
        tears.dropped_length += chain.points.windows(2).map(|w| gap_mm(w[0], w[1])).sum::<f64>();
    }
    tears
}

fn gap_mm(a: GridPoint, b: GridPoint) -> f64 {
    (mm(b) - mm(a)).norm()
}
