//! Sparse infill that stands only below tops (`lightning`): trees whose branches carry what closes the
//! part from above, merge on their way down, and end at the walls.
//!
//! Trees are followed from the top down. A place of a sparse area over which the next layer is not sparse
//! any more has to be carried: unless a wall or a branch is near, it becomes a tip, joined to the nearest
//! of them. From layer to layer tips then draw back and branches straighten by as much as the layer is
//! thick, an overhang of 45°, so that a branch shortens until the wall has it. Where a wall draws back
//! itself, branches reach after it; where it comes nearer, they are cut.
//!
//! Places come from layer to layer along the normals, as skins do, and lie in the chart of their layer,
//! mm. Distances are those of the chart: true along the meridian, at most too long across it, where
//! branches stand a little closer than they need to.

use geom::bands::Bands;
use geom::grid::mm;
use geom::polyline::{distance_to_segment, share_nearest};
use geom::region::{Region, ring_sides};
use nalgebra::{Point2, distance};

/// A layer as trees see it; regions are in its chart.
#[derive(Debug, Clone, Default)]
pub struct Stratum {
    /// Where the middles of sparse lines may lie.
    pub core: Region,
    /// What of it the layer above closes.
    pub closed: Region,
    /// How far branches may move within the layer, mm.
    pub reach: f64,
}

/// The branches of one layer, each from its tip to the wall, or to the branch that it leaves.
pub type Branches = Vec<Vec<Point2<f64>>>;

/// A place of a tree.
#[derive(Debug, Clone, Copy)]
struct Node {
    at: Point2<f64>,
    /// The next place towards the wall, before this one in the list; `None` at the wall.
    parent: Option<usize>,
}

/// Places that carry lie at most twice this share of the distance of sparse lines apart.
const RADIUS_SHARE: f64 = 0.5;

/// Steps of the grid of places that are asked whether they are carried, in a radius.
const STEPS_IN_RADIUS: f64 = 2.0;

/// How far places between tip and wall move aside, by what tips draw back: both together still lie on what
/// is below.
const STRAIGHTENING: f64 = 0.5;

/// Pieces of branches that are shorter are none, mm.
const SHORTEST_MM: f64 = 0.05;

/// Branches shorter than this many widths are not laid: the wall that they stand at carries what is above.
pub(crate) const STUB_IN_WIDTHS: f64 = 0.2;

/// A root within this of the wall stands at it, mm: nobody sees a gap a tenth as wide as the bead.
const AT_WALL_MM: f64 = 0.04;

/// A place of a branch that is this near to the straight way between its neighbours goes, mm.
const STRAIGHT_MM: f64 = 0.02;

/// Returns the branches of all layers, which come from the bottom up. `down` takes a place of a layer to
/// the one below, `spacing` is how far apart sparse lines of the wanted density lie, mm.
#[must_use]
pub fn grow(
    strata: &[Stratum],
    down: impl Fn(usize, &Point2<f64>) -> Point2<f64>,
    spacing: f64,
) -> Vec<Branches> {
    let radius = RADIUS_SHARE * spacing;
    let mut branches = vec![Branches::new(); strata.len()];
    let mut nodes: Vec<Node> = Vec::new();
    for (k, stratum) in strata.iter().enumerate().rev() {
        for node in &mut nodes {
            node.at = down(k + 1, &node.at);
        }
        let walls = Segments::of_region(&stratum.core, radius);
        let (Some(walls), false) = (walls, stratum.core.is_empty()) else {
            nodes.clear();
            continue;
        };
        nodes = straightened(pruned(nodes, stratum.reach), STRAIGHTENING * stratum.reach);
        nodes = grounded(&cut(&nodes, &stratum.core), &walls);
        carry(&mut nodes, stratum, &walls, radius);
        branches[k] = lines(&nodes);
    }
    branches
}

/// How many places follow each.
fn children(nodes: &[Node]) -> Vec<usize> {
    let mut count = vec![0; nodes.len()];
    for parent in nodes.iter().filter_map(|node| node.parent) {
        count[parent] += 1;
    }
    count
}

/// Takes `reach` off all tips.
fn pruned(mut nodes: Vec<Node>, reach: f64) -> Vec<Node> {
    let mut pending = children(&nodes);
    // What is still to be taken off at each place, once it is a tip; nothing where a branch stays.
    let mut left: Vec<f64> =
        pending.iter().map(|&count| if count == 0 { reach } else { f64::INFINITY }).collect();
    let mut keep = vec![true; nodes.len()];
    for k in (0..nodes.len()).rev() {
        let is_tip = pending[k] == 0 && left[k] > 0.0;
        let Some(parent) = nodes[k].parent else {
            keep[k] = !is_tip;
            continue;
        };
        let way = nodes[parent].at - nodes[k].at;
        let more = if is_tip { left[k] } else { 0.0 };
        keep[k] = way.norm() > more;
        if keep[k] {
            nodes[k].at += way * (more / way.norm());
            left[parent] = 0.0;
        } else {
            left[parent] = left[parent].min(more - way.norm());
        }
        pending[parent] -= 1;
    }
    compact(&nodes, &keep)
}

/// The places that are kept; no kept one has a parent that is not.
fn compact(nodes: &[Node], keep: &[bool]) -> Vec<Node> {
    let mut moved = vec![None; nodes.len()];
    let mut kept: Vec<Node> = Vec::new();
    for (k, node) in nodes.iter().enumerate().filter(|(k, _)| keep[*k]) {
        moved[k] = Some(kept.len());
        kept.push(Node { at: node.at, parent: node.parent.and_then(|parent| moved[parent]) });
    }
    kept
}

/// Moves the places between tip and wall towards the straight way, by `reach` at most.
fn straightened(mut nodes: Vec<Node>, reach: f64) -> Vec<Node> {
    let count = children(&nodes);
    let mut only_child = vec![None; nodes.len()];
    for (k, node) in nodes.iter().enumerate() {
        if let Some(parent) = node.parent.filter(|&parent| count[parent] == 1) {
            only_child[parent] = Some(k);
        }
    }
    let mut parent_of: Vec<Option<usize>> = nodes.iter().map(|node| node.parent).collect();
    let mut keep = vec![true; nodes.len()];
    for k in 0..nodes.len() {
        let (Some(parent), Some(child)) = (parent_of[k], only_child[k]) else { continue };
        let (a, b) = (nodes[parent].at, nodes[child].at);
        let to = a + (b - a) * share_nearest(&a, &b, &nodes[k].at);
        let way = to - nodes[k].at;
        let length = way.norm();
        if length > STRAIGHT_MM {
            nodes[k].at += way * (reach / length).min(1.0);
        } else {
            keep[k] = false;
            parent_of[child] = Some(parent);
            if count[parent] == 1 {
                only_child[parent] = Some(child);
            }
        }
    }
    for (node, parent) in nodes.iter_mut().zip(parent_of) {
        node.parent = parent;
    }
    compact(&nodes, &keep)
}

/// Cuts trees to the area: what is left beyond a cut stands on its own.
fn cut(nodes: &[Node], core: &Region) -> Vec<Node> {
    if nodes.is_empty() {
        return Vec::new();
    }
    let core = Bands::of(core);
    let mut cut: Vec<Node> = Vec::new();
    // Where each place is now, if it lies inside.
    let mut moved: Vec<Option<usize>> = vec![None; nodes.len()];
    for (k, node) in nodes.iter().enumerate() {
        let Some(parent) = node.parent else {
            if core.contains(&node.at) {
                moved[k] = Some(cut.len());
                cut.push(*node);
            }
            continue;
        };
        let from = nodes[parent].at;
        let parts: Vec<_> = core.parts(&from, &node.at).into_iter().filter(|p| p.inside).collect();
        for part in parts {
            let begins = part.from == from;
            let ends = part.to == node.at;
            if !ends && distance(&part.from, &part.to) < SHORTEST_MM {
                continue;
            }
            let parent = moved[parent].filter(|_| begins).unwrap_or_else(|| {
                cut.push(Node { at: part.from, parent: None });
                cut.len() - 1
            });
            if ends {
                moved[k] = Some(cut.len());
            }
            cut.push(Node { at: part.to, parent: Some(parent) });
        }
    }
    cut
}

/// Lets roots that the wall has left reach it again.
fn grounded(nodes: &[Node], walls: &Segments) -> Vec<Node> {
    let mut grounded: Vec<Node> = Vec::with_capacity(nodes.len());
    let mut moved = Vec::with_capacity(nodes.len());
    for node in nodes {
        let mut parent = node.parent.map(|parent: usize| moved[parent]);
        let wall = || walls.nearest(&node.at, f64::INFINITY);
        if node.parent.is_none()
            && let Some((at, off, _)) = wall()
            && off > AT_WALL_MM
        {
            parent = Some(grounded.len());
            grounded.push(Node { at, parent: None });
        }
        moved.push(grounded.len());
        grounded.push(Node { at: node.at, parent });
    }
    grounded
}

/// Adds tips where the layer above closes the part and nothing is near.
fn carry(nodes: &mut Vec<Node>, stratum: &Stratum, walls: &Segments, radius: f64) {
    let Some(bounds) = stratum.closed.bounds() else { return };
    let closed = Bands::of(&stratum.closed);
    let step = radius / STEPS_IN_RADIUS;
    let (low, high) = (mm(bounds.min), mm(bounds.max));
    let steps = |from: f64, to: f64| (from / step).ceil() as i64..=(to / step).floor() as i64;
    let mut tips: Vec<(f64, Point2<f64>, Point2<f64>)> = Vec::new();
    for x in steps(low.x, high.x).map(|column| column as f64 * step) {
        // A whole column at once: asking for each place would look at all sides again.
        let [from, to] = [low.y - step, high.y + step].map(|y| Point2::new(x, y));
        for part in closed.parts(&from, &to).into_iter().filter(|part| part.inside) {
            for y in steps(part.from.y, part.to.y).map(|row| row as f64 * step) {
                let at = Point2::new(x, y);
                if let Some((wall, off, _)) = walls.nearest(&at, f64::INFINITY)
                    && off > radius
                {
                    tips.push((off, at, wall));
                }
            }
        }
    }
    if tips.is_empty() {
        return;
    }
    tips.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut trees = Segments::new(walls.low, walls.high, radius);
    for (k, node) in nodes.iter().enumerate() {
        if let Some(parent) = node.parent {
            trees.add([nodes[parent].at, node.at], k);
        }
    }
    for (off, at, wall) in tips {
        let near = trees.nearest(&at, off);
        if near.is_some_and(|(_, off, _)| off <= radius) {
            continue;
        }
        let parent = match near {
            Some((joint, _, child)) => branch_off(nodes, &mut trees, joint, child),
            None => {
                nodes.push(Node { at: wall, parent: None });
                nodes.len() - 1
            }
        };
        trees.add([nodes[parent].at, at], nodes.len());
        nodes.push(Node { at, parent: Some(parent) });
    }
    sort(nodes);
}

/// A place at `joint` on the piece that ends at `child`; one of its ends where that is near.
fn branch_off(
    nodes: &mut Vec<Node>,
    trees: &mut Segments,
    joint: Point2<f64>,
    child: usize,
) -> usize {
    let (mut child, mut parent) = (child, nodes[child].parent);
    // The piece found may have been parted since.
    while let Some(end) = parent {
        if distance_to_segment(&nodes[end].at, &nodes[child].at, &joint) < SHORTEST_MM {
            break;
        }
        (child, parent) = (end, nodes[end].parent);
    }
    let Some(parent) = parent else { return child };
    if let Some(end) =
        [child, parent].into_iter().find(|&k| distance(&nodes[k].at, &joint) < SHORTEST_MM)
    {
        return end;
    }
    let middle = nodes.len();
    nodes.push(Node { at: joint, parent: Some(parent) });
    nodes[child].parent = Some(middle);
    // The piece found stays in the index as it was: its other half is the new place's.
    trees.add([nodes[parent].at, joint], middle);
    middle
}

/// Puts parents before children.
fn sort(nodes: &mut Vec<Node>) {
    let mut moved: Vec<Option<usize>> = vec![None; nodes.len()];
    let mut sorted: Vec<Node> = Vec::with_capacity(nodes.len());
    let mut way = Vec::new();
    for k in 0..nodes.len() {
        let mut next = Some(k);
        while let Some(node) = next.filter(|&node| moved[node].is_none()) {
            way.push(node);
            next = nodes[node].parent;
        }
        while let Some(node) = way.pop() {
            let Node { at, parent } = nodes[node];
            moved[node] = Some(sorted.len());
            sorted.push(Node { at, parent: parent.and_then(|parent| moved[parent]) });
        }
    }
    *nodes = sorted;
}

/// Trees as lines: each from a tip down to the wall or to a place that a line before it passes.
fn lines(nodes: &[Node]) -> Branches {
    let count = children(nodes);
    let mut passed = vec![false; nodes.len()];
    let mut lines = Branches::new();
    for tip in (0..nodes.len()).rev().filter(|&k| count[k] == 0) {
        let mut line = vec![nodes[tip].at];
        let mut next = nodes[tip].parent;
        while let Some(k) = next {
            line.push(nodes[k].at);
            next = nodes[k].parent.filter(|_| !passed[k]);
            passed[k] = true;
        }
        if line.len() > 1 {
            lines.push(line);
        }
    }
    lines
}

/// Straight pieces by the square cells that they run through, to find the nearest.
struct Segments {
    pieces: Vec<([Point2<f64>; 2], usize)>,
    cells: Vec<Vec<u32>>,
    low: Point2<f64>,
    high: Point2<f64>,
    size: f64,
    columns: usize,
    rows: usize,
}

/// Cells along an axis, at most.
const MOST_CELLS: f64 = 256.0;

impl Segments {
    fn new(low: Point2<f64>, high: Point2<f64>, size: f64) -> Self {
        let extent = high - low;
        let size = size.max(extent.x.max(extent.y) / MOST_CELLS).max(SHORTEST_MM);
        let [columns, rows] = [extent.x, extent.y].map(|length| (length / size) as usize + 1);
        let cells = vec![Vec::new(); columns * rows];
        Self { pieces: Vec::new(), cells, low, high, size, columns, rows }
    }

    /// The border of a region; `None` where it is empty.
    fn of_region(region: &Region, size: f64) -> Option<Self> {
        let bounds = region.bounds()?;
        let mut all = Self::new(mm(bounds.min), mm(bounds.max), size);
        for (a, b) in region.rings().flat_map(|ring| ring_sides(ring)) {
            all.add([mm(a), mm(b)], 0);
        }
        Some(all)
    }

    fn cell(&self, p: &Point2<f64>) -> [usize; 2] {
        let along = |value: f64, low: f64, count: usize| {
            (((value - low) / self.size).max(0.0) as usize).min(count - 1)
        };
        [along(p.x, self.low.x, self.columns), along(p.y, self.low.y, self.rows)]
    }

    fn add(&mut self, ends: [Point2<f64>; 2], owner: usize) {
        let [a, b] = ends.map(|p| self.cell(&p));
        let index = self.pieces.len() as u32;
        self.pieces.push((ends, owner));
        for row in a[1].min(b[1])..=a[1].max(b[1]) {
            for column in a[0].min(b[0])..=a[0].max(b[0]) {
                self.cells[row * self.columns + column].push(index);
            }
        }
    }

    /// The nearest place, how far it is, and whose it is; `None` where none is within `most`.
    fn nearest(&self, p: &Point2<f64>, most: f64) -> Option<(Point2<f64>, f64, usize)> {
        let [column, row] = self.cell(p);
        let mut best: Option<(f64, u32)> = None;
        for ring in 0..self.columns.max(self.rows) {
            // What lies in cells farther out is farther than the cells between.
            let beyond = (ring as f64 - 1.0) * self.size;
            if best.is_some_and(|(off, _)| off <= beyond) || beyond > most {
                break;
            }
            let [left, right] =
                [column.saturating_sub(ring), (column + ring).min(self.columns - 1)];
            let [low, high] = [row.saturating_sub(ring), (row + ring).min(self.rows - 1)];
            for y in low..=high {
                let is_edge = y + ring == row || y == row + ring;
                for x in left..=right {
                    if !is_edge && x + ring != column && x != column + ring {
                        continue;
                    }
                    for &index in &self.cells[y * self.columns + x] {
                        let [a, b] = self.pieces[index as usize].0;
                        let off = distance_to_segment(&a, &b, p);
                        if best.is_none_or(|(least, at)| (off, index) < (least, at)) {
                            best = Some((off, index));
                        }
                    }
                }
            }
        }
        let (off, index) = best.filter(|(off, _)| *off <= most)?;
        let ([a, b], owner) = self.pieces[index as usize];
        Some((a + (b - a) * share_nearest(&a, &b, p), off, owner))
    }
}
