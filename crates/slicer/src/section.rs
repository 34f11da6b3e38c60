//! The mesh cut along a level: closed outlines of the material.
//!
//! Every vertex is either below the level or not; one exactly on it counts as above, so a cut
//! through a vertex, a side or a whole facet is the cut just underneath, and no case is special.
//! A facet with vertices on both sides is crossed by exactly two of its sides, and the outline
//! enters through one and leaves through the other, material to the left seen from above. Each side
//! belongs to two facets that run it in opposite directions: what leaves one enters the next, so on
//! a closed mesh every outline closes, whatever the rounding.
//!
//! The point on a side is computed from its lower-numbered vertex to the other, so both facets get
//! the same bits. Overlapping shells are merged by the nonzero rule when outlines become regions.
//!
//! On an open mesh chains are left over. They are joined end to nearest begin while the gap is at
//! most [`LARGEST_GAP_MM`]; the rest is dropped and reported.

use geom::grid::{GridPoint, snap};
use geom::region::{Fill, Region, Ring};
use geom::simplify::simplify_ring;
use mesh::topology::Solid;
use nalgebra::{Point2, Point3};
use rayon::prelude::*;

use crate::level::Level;
use crate::surface::LayerSurface;

/// The widest gap in an outline that is closed by a straight line, mm. Holes of a mesh are closed
/// long before; what is left are tears. Wider, and unrelated outlines would be joined.
pub const LARGEST_GAP_MM: f64 = 2.0;

/// The material of one layer.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// The material, in the chart of the layer.
    pub region: Region,
    /// What was wrong with its outlines.
    pub tears: Tears,
}

/// Outlines that did not close by themselves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tears {
    /// Number of gaps that were closed by a straight line.
    pub closed: usize,
    /// The widest of them, mm.
    pub widest: f64,
    /// Number of chains that were dropped.
    pub dropped: usize,
    /// Their length together, mm.
    pub dropped_length: f64,
}

/// A solid made ready to be cut at many levels.
pub struct Cutter<'a> {
    solid: &'a Solid,
    surface: &'a dyn LayerSurface,
    cuts: Vec<f64>,
    /// Level of every vertex, computed once: two expressions for it could disagree in a last bit.
    vertex_levels: Vec<f64>,
    /// Facets by cut: those of cut `k` are `facets[starts[k]..starts[k + 1]]`, ascending.
    starts: Vec<usize>,
    facets: Vec<u32>,
}

impl<'a> Cutter<'a> {
    /// Sorts the facets of a solid by the layers whose middle they cross.
    #[must_use]
    pub fn new(solid: &'a Solid, surface: &'a dyn LayerSurface, levels: &[Level]) -> Self {
        let cuts: Vec<f64> = levels.iter().map(Level::middle).collect();
        let vertex_levels: Vec<f64> =
            solid.mesh().vertices.par_iter().map(|p| surface.level(p)).collect();
        let ranges: Vec<(u32, u32)> = solid
            .mesh()
            .triangles
            .par_iter()
            .map(|corners| crossed(&cuts, corners.map(|v| vertex_levels[v as usize])))
            .collect();
        let mut starts = vec![0; cuts.len() + 1];
        for &(from, to) in &ranges {
            for cut in from..to {
                starts[cut as usize + 1] += 1;
            }
        }
        for k in 0..cuts.len() {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut facets = vec![0; starts[cuts.len()]];
        for (facet, &(from, to)) in (0_u32..).zip(&ranges) {
            for slot in &mut next[from as usize..to as usize] {
                facets[*slot] = facet;
                *slot += 1;
            }
        }
        Self { solid, surface, cuts, vertex_levels, starts, facets }
    }

    /// Cuts the solid along the middle of layer `k`; outlines are thinned out to within
    /// `tolerance` mm.
    #[must_use]
    pub fn section(&self, k: usize, tolerance: f64) -> Section {
        let (chains, tears) = self.outlines(k);
        let mut rings: Vec<Ring> = Vec::new();
        for chain in chains {
            // Points that fall on the same place of the grid would be corners without direction.
            let mut ring = chain;
            ring.dedup();
            while ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            let ring = simplify_ring(&ring, tolerance);
            if ring.len() >= 3 {
                rings.push(ring);
            }
        }
        Section { region: Region::from_grid_rings(&rings, Fill::NonZero), tears }
    }

    /// The outlines of one cut as rings on the grid of the chart.
    fn outlines(&self, k: usize) -> (Vec<Ring>, Tears) {
        let mut steps: Vec<Step> = self.facets[self.starts[k]..self.starts[k + 1]]
            .iter()
            .filter_map(|&facet| self.step(facet, self.cuts[k]))
            .collect();
        steps.sort_unstable_by_key(|step| step.enter);
        let mut used = vec![false; steps.len()];
        let mut rings = Vec::new();
        // What nothing leads into is the begin of an open chain; closed outlines are what remains.
        let mut led_into: Vec<u32> = steps.iter().map(|step| step.leave).collect();
        led_into.sort_unstable();
        let mut chains = Vec::new();
        for start in 0..steps.len() {
            if led_into.binary_search(&steps[start].enter).is_err() {
                chains.push(self.follow(start, &steps, &mut used, k));
            }
        }
        for start in 0..steps.len() {
            if !used[start] {
                rings.push(self.follow(start, &steps, &mut used, k).points);
            }
        }
        let tears = close_chains(chains, &mut rings);
        (rings, tears)
    }

    /// How the outline passes through a facet; `None` when it does not.
    fn step(&self, facet: u32, cut: f64) -> Option<Step> {
        let corners = self.solid.mesh().triangles[facet as usize];
        let below = corners.map(|v| self.vertex_levels[v as usize] < cut);
        let sides = self.solid.sides()[facet as usize];
        // Walking round the facet counter-clockwise seen from outside, the level is left behind
        // through `up` and met again through `down`. The outline runs the other way, which seen
        // from above keeps the material to its left.
        let up = (0..3).find(|&k| below[k] && !below[(k + 1) % 3])?;
        let down = (0..3).find(|&k| !below[k] && below[(k + 1) % 3])?;
        Some(Step { enter: sides[down], leave: sides[up] })
    }

    fn follow(&self, start: usize, steps: &[Step], used: &mut [bool], k: usize) -> Chain {
        let mut points = vec![self.point(steps[start].enter, k)];
        let mut at = start;
        loop {
            used[at] = true;
            let leave = steps[at].leave;
            let first = steps.partition_point(|step| step.enter < leave);
            // A side of more than two facets that no pairing could part leads on more than once.
            let next = (first..steps.len())
                .take_while(|&next| steps[next].enter == leave)
                .find(|&next| !used[next] || next == start);
            match next {
                Some(next) if next == start => return Chain { points, closed: true },
                Some(next) => {
                    points.push(self.point(leave, k));
                    at = next;
                }
                None => {
                    points.push(self.point(leave, k));
                    return Chain { points, closed: false };
                }
            }
        }
    }

    /// Where cut `k` crosses a side, in the chart.
    fn point(&self, side: u32, k: usize) -> GridPoint {
        let [low, high] = self.solid.ends(side);
        let (a, b) = (self.vertex_levels[low as usize], self.vertex_levels[high as usize]);
        let share = ((self.cuts[k] - a) / (b - a)).clamp(0.0, 1.0);
        let (p, q) =
            (self.solid.mesh().vertices[low as usize], self.solid.mesh().vertices[high as usize]);
        snap(&self.surface.flatten(&Point3::from(p.coords.lerp(&q.coords, share))))
    }
}

/// The outline's way through a facet, by sides.
#[derive(Debug, Clone, Copy)]
struct Step {
    enter: u32,
    leave: u32,
}

struct Chain {
    points: Ring,
    closed: bool,
}

/// The cuts that separate the vertices of a facet: from the first above the lowest vertex to the
/// last not above the highest.
fn crossed(cuts: &[f64], levels: [f64; 3]) -> (u32, u32) {
    let low = levels.into_iter().fold(f64::INFINITY, f64::min);
    let high = levels.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let from = cuts.partition_point(|&cut| cut <= low);
    let to = cuts.partition_point(|&cut| cut <= high);
    // Cuts are fewer than 2^32: the schedule is limited long before.
    (from as u32, to.max(from) as u32)
}

/// Joins open chains end to nearest begin, shortest gap first.
fn close_chains(chains: Vec<Chain>, rings: &mut Vec<Ring>) -> Tears {
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
    let (a, b): (Point2<f64>, Point2<f64>) = (geom::grid::mm(a), geom::grid::mm(b));
    (b - a).norm()
}
