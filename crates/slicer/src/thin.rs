//! Single beads in places too thin for two.
//!
//! A bead runs along the middle of the place and is as wide as the place is there. The middle is
//! the chordal axis: the place is filled with a constrained Delaunay triangulation of its densified
//! rings, and the midpoints of the triangle sides that cross from rim to rim are joined.
//!
//! Source: L. Prasad (1997), "Morphological analysis of shapes", CNLS Newsletter 139. Differences:
//! the width at a point of the axis is twice its true distance from the rim and not the length of
//! the side, which overstates it between staggered points; branches shorter than the place is wide
//! are corners and are dropped.

mod rim;

use geom::grid::mm;
use geom::polyline::share_nearest;
use geom::region::{Island, Region, ring_sides};
use geom::simplify::mark_kept;
use geom::triangulate::{Triangulation, triangulate};
use nalgebra::{Point2, center, distance};

use self::rim::Rim;
use crate::chart::Chart;
use crate::toolpath::LostArea;

/// The widths that a single bead may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinParams {
    /// Outer places thinner than this stay empty, mm.
    pub least_width: f64,
    /// Gaps between beads thinner than this stay empty, mm. Neighbours hold such a bead in place,
    /// so it may be thinner than one that stands alone.
    pub least_gap: f64,
    /// The widest bead that is laid, mm.
    pub greatest_width: f64,
}

/// A point of the axis and the width of the place there, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AxisPoint {
    pub(crate) at: Point2<f64>,
    pub(crate) width: f64,
}

/// Distance of points on the densified rings in mean widths of the place. Farther apart than the
/// place is wide, and sides of the triangulation run along the rim instead of across; much closer
/// only costs time.
const RIM_STEP_IN_WIDTHS: f64 = 0.6;

/// Limits of that distance, mm: about the width of the thinnest bead, and half of a wide one.
const RIM_STEP_MM: [f64; 2] = [0.12, 0.3];

/// Rims with more points than this are those of long places, which change slowly along their way: there
/// points may lie farther apart, up to [`LONG_STEP`] times. In small places much changes from one to the
/// next, and a taper that is followed coarsely gets more than it holds.
const MANY_RIM_POINTS: f64 = 400.0;

/// How many times farther apart points on the rims of the longest places may lie.
const LONG_STEP: f64 = 2.0;

/// How much an axis may be simplified, mm, in place and in half its width alike.
const AXIS_TOLERANCE_MM: f64 = 0.01;

/// The same on curved layers, where beads taper at every shallow face that a layer meets.
const CURVED_AXIS_TOLERANCE_MM: f64 = 0.004;

/// A branch shorter than this many widths of the place at its hub leads into a corner: half a width
/// is what the hub's own disc covers, and the bead that ends at the hub covers as much again.
const SHORT_BRANCH_IN_WIDTHS: f64 = 1.5;

/// Beads shorter than this many widths are blobs.
const LEAST_LENGTH_IN_WIDTHS: f64 = 1.0;

/// Returns the axes of the thin places of `region` where a bead from `least` to `greatest` mm wide
/// fits, and counts what none fits in.
pub(crate) fn axes(
    region: &Region,
    chart: &Chart,
    least: f64,
    greatest: f64,
    lost: &mut LostArea,
) -> Vec<Vec<AxisPoint>> {
    // Corners beside walls taper to nothing: an opening of the least width removes them, and with
    // them the triangles that would cost most.
    let wide_enough = chart.opened(region, least / 2.0);
    lost.add(&region.difference(&chart.outset(&wide_enough, least / 2.0)));
    let mut found = Vec::new();
    for island in wide_enough.islands() {
        let axes = axes_of_island(island, chart, least, greatest);
        if axes.is_empty() {
            lost.add(&Region::from_island(island.clone()));
        }
        found.extend(axes);
    }
    found
}

fn axes_of_island(
    island: &Island,
    chart: &Chart,
    least: f64,
    greatest: f64,
) -> Vec<Vec<AxisPoint>> {
    let step = rim_step(island);
    let rings: Vec<Vec<Point2<f64>>> = island.iter().map(|ring| densified(ring, step)).collect();
    // Rings of a region never cross, so this fails only on rings that touch along a side within a
    // grid step; such a sliver has no axis worth laying.
    let Ok(triangles) = triangulate(&rings) else { return Vec::new() };
    let rim = Rim::new(&rings);
    let points: Vec<Point2<f64>> = rings.into_iter().flatten().collect();
    let tolerance = if chart.is_flat() { AXIS_TOLERANCE_MM } else { CURVED_AXIS_TOLERANCE_MM };
    let graph = AxisGraph::new(&triangles, &points, &rim, chart);
    graph
        .branches()
        .into_iter()
        .flat_map(|branch| printable_pieces(&branch, least, greatest))
        .map(|piece| simplified(&piece, tolerance))
        .filter(|piece| {
            let length: f64 = piece.windows(2).map(|w| distance(&w[0].at, &w[1].at)).sum();
            length >= LEAST_LENGTH_IN_WIDTHS * piece[0].width
        })
        .collect()
}

/// The distance of points on the rim that suits a place.
fn rim_step(island: &Island) -> f64 {
    let region = Region::from_island(island.clone());
    let perimeter = region.perimeter();
    // A strip has two long sides.
    let mean_width = 2.0 * region.area() / perimeter;
    let step = (RIM_STEP_IN_WIDTHS * mean_width).clamp(RIM_STEP_MM[0], RIM_STEP_MM[1]);
    let points = perimeter / step;
    step * (points / MANY_RIM_POINTS).clamp(1.0, LONG_STEP)
}

/// The ring in mm, with points no farther apart than `step`.
fn densified(ring: &[geom::grid::GridPoint], step: f64) -> Vec<Point2<f64>> {
    let mut points = Vec::new();
    for (a, b) in ring_sides(ring) {
        let (a, b) = (mm(a), mm(b));
        let pieces = (distance(&a, &b) / step).ceil().max(1.0);
        for k in 0..pieces as u32 {
            points.push(a + (b - a) * (f64::from(k) / pieces));
        }
    }
    points
}

/// The chordal axis: nodes joined by links.
struct AxisGraph {
    nodes: Vec<AxisPoint>,
    /// Links of each node, ascending.
    links: Vec<Vec<usize>>,
}

impl AxisGraph {
    fn new(triangles: &Triangulation, points: &[Point2<f64>], rim: &Rim, chart: &Chart) -> Self {
        let mut graph = Self { nodes: Vec::new(), links: Vec::new() };
        // One node for each side between two triangles, made when its first triangle is met.
        let mut side_node = vec![[None; 3]; triangles.triangles.len()];
        for (t, (corners, neighbours)) in
            triangles.triangles.iter().zip(&triangles.neighbours).enumerate()
        {
            let mut inner_sides = Vec::new();
            for k in 0..3 {
                let Some(other) = neighbours[k] else { continue };
                let node = *side_node[t][k].get_or_insert_with(|| {
                    let ends = [corners[k], corners[(k + 1) % 3]].map(|c| points[c as usize]);
                    graph.add(center(&ends[0], &ends[1]), &ends, rim, chart)
                });
                let back = triangles.neighbours[other as usize]
                    .iter()
                    .position(|&n| n == Some(t as u32))
                    .expect("neighbours are mutual");
                side_node[other as usize][back] = Some(node);
                inner_sides.push(node);
            }
            match inner_sides[..] {
                [a, b] => graph.link(a, b),
                [a, b, c] => {
                    let middle = (graph.nodes[a].at.coords
                        + graph.nodes[b].at.coords
                        + graph.nodes[c].at.coords)
                        / 3.0;
                    let ends = [corners[0], corners[1]].map(|c| points[c as usize]);
                    let hub = graph.add(middle.into(), &ends, rim, chart);
                    for side in [a, b, c] {
                        graph.link(hub, side);
                    }
                }
                _ => {}
            }
        }
        graph
    }

    /// Adds a node; `across` is a line from rim to rim near it.
    fn add(
        &mut self,
        at: Point2<f64>,
        across: &[Point2<f64>; 2],
        rim: &Rim,
        chart: &Chart,
    ) -> usize {
        let width = 2.0 * rim.distance(&at, distance(&at, &across[0]), chart);
        self.nodes.push(AxisPoint { at, width });
        self.links.push(Vec::new());
        self.nodes.len() - 1
    }

    fn link(&mut self, a: usize, b: usize) {
        self.links[a].push(b);
        self.links[b].push(a);
    }

    /// Takes the graph apart into lines between hubs and ends, without the short branches that
    /// lead into corners.
    fn branches(mut self) -> Vec<Vec<AxisPoint>> {
        self.prune();
        let mut used: Vec<Vec<bool>> = self.links.iter().map(|l| vec![false; l.len()]).collect();
        let mut lines = Vec::new();
        let is_through = |links: &[Vec<usize>], node: usize| links[node].len() == 2;
        // Lines from ends and hubs first; what is left are closed loops, begun anywhere.
        for closed_pass in [false, true] {
            for start in 0..self.nodes.len() {
                if !closed_pass && is_through(&self.links, start) {
                    continue;
                }
                for first in 0..self.links[start].len() {
                    if used[start][first] {
                        continue;
                    }
                    lines.push(self.walk(start, first, &mut used));
                }
            }
        }
        lines
    }

    /// Follows a line from `start` along its link number `first` to the next hub, end, or back.
    fn walk(&self, start: usize, first: usize, used: &mut [Vec<bool>]) -> Vec<AxisPoint> {
        let mut line = vec![self.nodes[start]];
        let (mut from, mut slot) = (start, first);
        loop {
            used[from][slot] = true;
            let to = self.links[from][slot];
            let back = (0..self.links[to].len())
                .find(|&k| self.links[to][k] == from && !used[to][k])
                .expect("links are mutual");
            used[to][back] = true;
            line.push(self.nodes[to]);
            let onward = (0..self.links[to].len()).find(|&k| !used[to][k]);
            match onward {
                Some(next) if self.links[to].len() == 2 && to != start => {
                    (from, slot) = (to, next);
                }
                _ => return line,
            }
        }
    }

    /// Cuts off branches from a hub to an end that only lead into a corner.
    fn prune(&mut self) {
        for end in 0..self.nodes.len() {
            if self.links[end].len() != 1 {
                continue;
            }
            let mut path = vec![end];
            let mut length = 0.0;
            let mut at = end;
            while self.links[at].len() < 3 {
                let previous = path.len().checked_sub(2).map(|k| path[k]);
                let Some(&next) = self.links[at].iter().find(|&&n| Some(n) != previous) else {
                    break;
                };
                length += distance(&self.nodes[at].at, &self.nodes[next].at);
                path.push(next);
                at = next;
            }
            if self.links[at].len() >= 3 && length < SHORT_BRANCH_IN_WIDTHS * self.nodes[at].width {
                for pair in path.windows(2) {
                    self.links[pair[0]].retain(|&n| n != pair[1]);
                    self.links[pair[1]].retain(|&n| n != pair[0]);
                }
            }
        }
    }
}

/// The pieces of an axis where the place is wide enough for a bead, widths capped.
fn printable_pieces(line: &[AxisPoint], least: f64, greatest: f64) -> Vec<Vec<AxisPoint>> {
    // A shade below the least width: an opening leaves places of just that width.
    let least = least * 0.99;
    line.chunk_by(|a, b| (a.width >= least) == (b.width >= least))
        .filter(|piece| piece[0].width >= least && piece.len() >= 2)
        .map(|piece| {
            let cap = |p: &AxisPoint| AxisPoint { width: p.width.min(greatest), ..*p };
            piece.iter().map(cap).collect()
        })
        .collect()
}

fn simplified(line: &[AxisPoint], tolerance: f64) -> Vec<AxisPoint> {
    let mut keep = vec![false; line.len()];
    keep[0] = true;
    keep[line.len() - 1] = true;
    let off = |a: usize, b: usize| {
        move |p: usize| {
            let (a, b, p) = (&line[a], &line[b], &line[p]);
            let share = share_nearest(&a.at, &b.at, &p.at);
            let at = a.at + (b.at - a.at) * share;
            let half_width = (a.width + (b.width - a.width) * share - p.width) / 2.0;
            (p.at - at).norm_squared() + half_width * half_width
        }
    };
    mark_kept(0, line.len() - 1, tolerance * tolerance, off, &mut keep);
    line.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use std::f64::consts::TAU;

    fn axes(region: &Region, lost: &mut LostArea) -> Vec<Vec<AxisPoint>> {
        super::axes(region, &Chart::Plane, 0.2, 0.8, lost)
    }

    fn polygon(points: &[[f64; 2]]) -> Region {
        let ring: Vec<Point2<f64>> = points.iter().map(|&p| Point2::from(p)).collect();
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    fn length(line: &[AxisPoint]) -> f64 {
        line.windows(2).map(|w| distance(&w[0].at, &w[1].at)).sum()
    }

    fn area(lines: &[Vec<AxisPoint>]) -> f64 {
        lines
            .iter()
            .flat_map(|line| line.windows(2))
            .map(|w| distance(&w[0].at, &w[1].at) * f64::midpoint(w[0].width, w[1].width))
            .sum()
    }

    #[test]
    fn a_strip_has_one_line_down_its_middle() {
        let strip = polygon(&[[0.0, 0.0], [12.0, 0.0], [12.0, 0.5], [0.0, 0.5]]);
        let lines = axes(&strip, &mut LostArea::default());
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() <= 12, "{} points on a straight line", lines[0].len());
        assert!(length(&lines[0]) > 11.3 && length(&lines[0]) <= 12.1, "{}", length(&lines[0]));
        for p in &lines[0] {
            let near_end = p.at.x.min(12.0 - p.at.x) < 0.3;
            assert!((p.at.y - 0.25).abs() < 0.02 || near_end, "{p:?}");
            assert!(p.width <= 0.5 + 1e-9, "{p:?}");
        }
    }

    #[test]
    fn a_wedge_is_filled_where_a_bead_fits() {
        let wedge = polygon(&[[0.0, 0.0], [20.0, -0.35], [20.0, 0.35]]);
        let mut lost = LostArea::default();
        let lines = axes(&wedge, &mut lost);
        assert_eq!(lines.len(), 1);
        let narrowest = lines[0].iter().map(|p| p.width).fold(f64::INFINITY, f64::min);
        assert!((0.19..0.25).contains(&narrowest), "{narrowest}");
        // Of 7 mm² the tip below the least width, 0.57 mm², is out of reach.
        let filled = area(&lines);
        assert!((5.8..6.5).contains(&filled), "{filled}");
        assert!(lost.area > 0.1, "{lost:?}");
    }

    #[test]
    fn a_ring_gives_a_closed_line() {
        let circle = |radius: f64| -> Vec<[f64; 2]> {
            (0..90)
                .map(|i| {
                    let angle = f64::from(i) * TAU / 90.0;
                    [radius * angle.cos(), radius * angle.sin()]
                })
                .collect()
        };
        let ring = polygon(&circle(5.2)).difference(&polygon(&circle(4.8)));
        let lines = axes(&ring, &mut LostArea::default());
        let total: f64 = lines.iter().map(|line| length(line)).sum();
        assert!((total - TAU * 5.0).abs() < 0.3, "{total}");
    }

    #[test]
    fn a_cross_of_strips_keeps_its_four_arms() {
        let across = polygon(&[[-6.0, -0.2], [6.0, -0.2], [6.0, 0.2], [-6.0, 0.2]]);
        let along = polygon(&[[-0.2, -6.0], [0.2, -6.0], [0.2, 6.0], [-0.2, 6.0]]);
        let lines = axes(&across.union(&along), &mut LostArea::default());
        let total: f64 = lines.iter().map(|line| length(line)).sum();
        assert!((total - 23.5).abs() < 1.0, "{total}");
    }

    #[test]
    fn what_no_bead_fits_in_is_counted() {
        let hair = polygon(&[[0.0, 0.0], [12.0, 0.0], [12.0, 0.1], [0.0, 0.1]]);
        let mut lost = LostArea::default();
        assert!(axes(&hair, &mut lost).is_empty());
        assert!((lost.area - 1.2).abs() < 1e-6);
        assert!(lost.worst.is_some());
    }
}
