//! Which line comes after which.
//!
//! Islands, and the walls and fills in each, are visited by nearest neighbour: walls first, from
//! the inside out (or the outside in), then infill. Fills can be run either way; their order is
//! then improved by reversing stretches of it while that shortens the travel (2-opt).
//!
//! On curved layers lines go from low to high ([`OrderParams::uphill`]): the flat end of the nozzle
//! reaches uphill, and must find nothing there but the layer below.

use geom::polyline::{distance_to_segment, nearest_on_ring};
use nalgebra::{Point2, Point3, distance};
use slicer::bead::Bead;
use slicer::toolpath::{IslandPaths, LayerPaths, Role, Station, Toolpath, WallGroup};

use crate::seam::{Begin, SeamMemory, SeamPosition, nearest};

/// How lines are put in order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderParams {
    /// Where walls begin.
    pub seam: SeamPosition,
    /// Whether infill comes before walls, where layers are flat.
    pub infill_first: bool,
    /// In which order the walls along an outline come, where layers are flat.
    pub walls: WallOrder,
    /// Whether lower lines come before higher ones: on curved layers.
    pub uphill: bool,
}

/// In which order the walls along one outline are laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WallOrder {
    /// The external wall last, on the flanks of those behind it.
    InsideOut,
    /// The external wall first, so that nothing pushes it outwards.
    OutsideIn,
    /// The external wall after those far inside and before the one behind it: nothing pushes it, and the
    /// travel to it ends on the part. Of two walls the external one comes first. As in OrcaSlicer.
    InnerOuterInner,
}

/// A line in the order and direction in which it is laid; closed ones end where they begin.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderedLine {
    /// What it is for.
    pub role: Role,
    /// Its stations; the first and the last of a closed line coincide.
    pub stations: Vec<Station>,
    /// The island it belongs to, by index in the layer; `None` for skirt and brim.
    pub island: Option<usize>,
    /// Whether it begins and ends in a slope (see [`scarf`](crate::scarf)).
    pub slopes: bool,
}

/// Puts the lines of a layer in order, beginning at `nozzle`.
#[must_use]
pub fn order(
    layer: &LayerPaths,
    nozzle: Point2<f64>,
    seams: &mut SeamMemory,
    params: &OrderParams,
) -> Vec<OrderedLine> {
    seams.next_layer();
    let mut ordering = Ordering { nozzle, seams, params, lines: Vec::new(), island: None };
    for path in &layer.adhesion {
        ordering.closed_from_nearest(path);
    }
    if params.uphill && !layer.supports.is_empty() {
        ordering.all_uphill(layer);
        return ordering.lines;
    }
    let supports: Vec<&Toolpath> = layer.supports.iter().collect();
    for (path, reversed) in tour(&supports, ordering.nozzle) {
        ordering.fill(path, reversed);
    }
    let boxes: Vec<PlaneBox> = layer.islands.iter().map(PlaneBox::around).collect();
    let mut left: Vec<usize> = (0..layer.islands.len()).collect();
    while let Some(k) = nearest_island(layer, &boxes, &left, &ordering.nozzle) {
        let index = left.remove(k);
        ordering.island = Some(index);
        if params.uphill {
            ordering.island_uphill(&layer.islands[index]);
        } else {
            ordering.island(&layer.islands[index]);
        }
    }
    ordering.lines
}

/// The place in `left` of the island that is nearest, the first of some that are equally near; `None` where
/// none is left.
fn nearest_island(
    layer: &LayerPaths,
    boxes: &[PlaneBox],
    left: &[usize],
    from: &Point2<f64>,
) -> Option<usize> {
    let mut nearest: Option<(usize, f64)> = None;
    for (k, &island) in left.iter().enumerate() {
        // Of thousands few are near enough to be looked at.
        if nearest.is_some_and(|(_, least)| boxes[island].squared_distance(from) > least * least) {
            continue;
        }
        let distance = distance_to_island(&layer.islands[island], from);
        if nearest.is_none_or(|(_, least)| distance < least) {
            nearest = Some((k, distance));
        }
    }
    nearest.map(|(k, _)| k)
}

/// The stations of an island that are seen when the nearest is sought.
fn places(island: &IslandPaths) -> impl Iterator<Item = Point2<f64>> {
    let external = island.walls.iter().filter_map(|group| group.loops.first());
    let paths = external.chain(island.all_fills());
    paths.flat_map(|path| &path.stations).map(|station| station.at.xy())
}

fn distance_to_island(island: &IslandPaths, from: &Point2<f64>) -> f64 {
    places(island).map(|at| distance(&at, from)).fold(f64::INFINITY, f64::min)
}

/// The box around the places of an island, mm.
struct PlaneBox {
    min: Point2<f64>,
    max: Point2<f64>,
}

impl PlaneBox {
    fn around(island: &IslandPaths) -> Self {
        let none = [f64::INFINITY, f64::NEG_INFINITY].map(|c| Point2::new(c, c));
        let [min, max] = places(island).fold(none, |[min, max], p| [min.inf(&p), max.sup(&p)]);
        Self { min, max }
    }

    /// The square of how far it is at least to any of them, mm²; infinite where there is none.
    fn squared_distance(&self, from: &Point2<f64>) -> f64 {
        let beyond = |k: usize| (self.min[k] - from[k]).max(from[k] - self.max[k]).max(0.0);
        beyond(0).powi(2) + beyond(1).powi(2)
    }
}

struct Ordering<'a> {
    nozzle: Point2<f64>,
    seams: &'a mut SeamMemory,
    params: &'a OrderParams,
    lines: Vec<OrderedLine>,
    island: Option<usize>,
}

impl Ordering<'_> {
    fn island(&mut self, island: &IslandPaths) {
        if self.params.infill_first {
            self.fills(island);
            self.wall_groups(island);
        } else {
            self.wall_groups(island);
            self.fills(island);
        }
        self.ironing(island);
    }

    /// Runs over all else of an island, in their own order.
    fn ironing(&mut self, island: &IslandPaths) {
        for path in &island.ironing {
            self.fill(path, false);
        }
    }

    fn wall_groups(&mut self, island: &IslandPaths) {
        let mut groups: Vec<&WallGroup> =
            island.walls.iter().filter(|group| !group.loops.is_empty()).collect();
        while !groups.is_empty() {
            let k = groups
                .iter()
                .map(|group| nearest(&plane(&group.loops[0]), &self.nozzle).1)
                .enumerate()
                .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
                .map_or(0, |(k, _)| k);
            self.walls(groups.remove(k));
        }
    }

    fn fills(&mut self, island: &IslandPaths) {
        let fills: Vec<&Toolpath> = island.fills.iter().collect();
        for (fill, reversed) in tour(&fills, self.nozzle) {
            self.fill(fill, reversed);
        }
        let mut runs: Vec<&Vec<Toolpath>> = island.in_order.iter().collect();
        while !runs.is_empty() {
            let begins = runs.iter().map(|run| run[0].stations[0].at.xy()).enumerate();
            let k = begins
                .min_by(|a, b| {
                    let from = |at| distance(at, &self.nozzle);
                    from(&a.1).total_cmp(&from(&b.1)).then(a.0.cmp(&b.0))
                })
                .map_or(0, |(k, _)| k);
            for path in runs.remove(k) {
                self.fill(path, false);
            }
        }
    }

    fn island_uphill(&mut self, island: &IslandPaths) {
        self.uphill(rising(island).map(|path| (self.island, path)).collect());
        self.ironing(island);
    }

    /// A layer whose supports stand close to the islands: a band of height holds lines of all.
    fn all_uphill(&mut self, layer: &LayerPaths) {
        let of_islands = layer.islands.iter().enumerate();
        let of_islands =
            of_islands.flat_map(|(k, island)| rising(island).map(move |p| (Some(k), p)));
        self.uphill(layer.supports.iter().map(|path| (None, path)).chain(of_islands).collect());
        for (k, island) in layer.islands.iter().enumerate() {
            self.island = Some(k);
            self.ironing(island);
        }
    }

    /// Lines by height, in bands, each band by nearest neighbour.
    fn uphill(&mut self, paths: Vec<(Option<usize>, &Toolpath)>) {
        let with_height = paths.into_iter().map(|(island, path)| (mean_height(path), island, path));
        let mut lines: Vec<(f64, Option<usize>, &Toolpath)> = with_height.collect();
        lines.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut rest = &lines[..];
        while let Some(&(lowest, ..)) = rest.first() {
            let (band, above) =
                rest.split_at(rest.partition_point(|(height, ..)| *height <= lowest + BAND_MM));
            rest = above;
            let paths: Vec<&Toolpath> = band.iter().map(|(.., path)| *path).collect();
            for (index, reversed) in tour_by_index(&paths, self.nozzle) {
                let path = paths[index];
                self.island = band[index].1;
                match path.role {
                    Role::ExternalPerimeter if path.closed => {
                        let line = plane(path);
                        let seam = self.seams.choose(&line, &self.nozzle, self.params.seam);
                        self.push(begun_at(path, seam));
                    }
                    _ => self.fill(path, uphill(path).unwrap_or(reversed)),
                }
            }
        }
    }

    /// The walls along one outline, all begun next to the seam of the external one.
    fn walls(&mut self, group: &WallGroup) {
        let external = &group.loops[0];
        let line = plane(external);
        let seam = self.seams.choose(&line, &self.nozzle, self.params.seam);
        let seam_at = seam.on(&line);
        let behind = group.loops[1..].iter().map(|path| begun_near(path, &seam_at));
        let mut lines: Vec<OrderedLine> =
            std::iter::once(begun_at(external, seam)).chain(behind).collect();
        match self.params.walls {
            WallOrder::OutsideIn => {}
            WallOrder::InsideOut => lines.reverse(),
            WallOrder::InnerOuterInner => {
                let mut last_two: Vec<OrderedLine> = lines.drain(..lines.len().min(2)).collect();
                lines.reverse();
                lines.append(&mut last_two);
            }
        }
        for line in lines {
            self.push(line);
        }
    }

    fn fill(&mut self, fill: &Toolpath, reversed: bool) {
        if fill.closed {
            self.closed_from_nearest(fill);
            return;
        }
        let mut stations = fill.stations.clone();
        if reversed {
            stations.reverse();
        }
        self.push(OrderedLine { role: fill.role, stations, island: None, slopes: false });
    }

    fn closed_from_nearest(&mut self, path: &Toolpath) {
        let (start, _) = nearest(&plane(path), &self.nozzle);
        self.push(begun_at(path, Begin::at(start)));
    }

    fn push(&mut self, mut line: OrderedLine) {
        let may_move = match line.role {
            Role::ExternalPerimeter | Role::Perimeter => SHORT_PIECE_TOLERANCE_MM,
            // On a slope whatever moves leaves its surface.
            _ if self.params.uphill => SHORT_PIECE_TOLERANCE_MM,
            _ => SHORTEST_PIECE_MM,
        };
        leave_out_short(&mut line.stations, may_move);
        if let Some(last) = line.stations.last() {
            self.nozzle = last.at.xy();
        }
        self.lines.push(OrderedLine { island: self.island, ..line });
    }
}

/// The lines of an island but those over all else.
fn rising(island: &IslandPaths) -> impl Iterator<Item = &Toolpath> {
    island.walls.iter().flat_map(|group| &group.loops).chain(island.all_fills())
}

/// Height over which lines of a curved layer may come in any order, mm: two beads side by side on a
/// slope of 30° differ by about as much.
const BAND_MM: f64 = 0.25;

/// Mean height of a line, by length.
fn mean_height(path: &Toolpath) -> f64 {
    let (mut length, mut moment) = (0.0, 0.0);
    for (a, b) in path.sides() {
        let side = (b.at - a.at).norm();
        length += side;
        moment += side * f64::midpoint(a.at.z, b.at.z);
    }
    if length > 0.0 { moment / length } else { path.stations[0].at.z }
}

/// Whether an open line must be reversed to run uphill; `None` where its ends are equally high.
fn uphill(path: &Toolpath) -> Option<bool> {
    let (first, last) = (path.stations.first()?.at.z, path.stations.last()?.at.z);
    (!path.closed && (first - last).abs() > BAND_MM).then_some(first > last)
}

fn plane(path: &Toolpath) -> Vec<Point2<f64>> {
    path.stations.iter().map(|station| station.at.xy()).collect()
}

/// A closed line begun at one of its stations.
fn begun_at(path: &Toolpath, begin: Begin) -> OrderedLine {
    let Begin { after, share } = begin;
    let all = &path.stations;
    let mut stations: Vec<Station> = Vec::with_capacity(all.len() + 2);
    if share > 0.0 {
        let between = between(&all[after], &all[(after + 1) % all.len()], share);
        stations.push(between);
        stations.extend(all[after + 1..].iter().chain(&all[..=after]));
        stations.push(between);
    } else {
        stations.extend(all[after..].iter().chain(&all[..=after]));
    }
    stations.dedup_by(|a, b| a.at == b.at && a.bead == b.bead && a.overhang == b.overhang);
    OrderedLine { role: path.role, stations, island: None, slopes: false }
}

/// The station at a share of the way from one to the next.
fn between(a: &Station, b: &Station, share: f64) -> Station {
    let blend = |from: f64, to: f64| from + (to - from) * share;
    Station {
        at: Point3::from(a.at.coords.lerp(&b.at.coords, share)),
        bead: Bead {
            width: blend(a.bead.width, b.bead.width),
            thickness: blend(a.bead.thickness, b.bead.thickness),
        },
        overhang: a.overhang,
    }
}

/// Pieces shorter than this strain firmwares and show nothing, mm.
const SHORTEST_PIECE_MM: f64 = 0.02;

/// How far a wall may move for the sake of a short piece, mm; as much as it may be off between two
/// points of the program anyway. Infill may move as far as the piece is long.
const SHORT_PIECE_TOLERANCE_MM: f64 = 0.005;

/// Leaves out one end of each piece too short to matter, where the line hardly moves for it and the
/// bead stays the same.
fn leave_out_short(stations: &mut Vec<Station>, tolerance: f64) {
    let can_go = |before: &Station, station: &Station, after: &Station| {
        let (a, p, b) = (before.at.xy(), station.at.xy(), after.at.xy());
        distance_to_segment(&a, &b, &p) < tolerance
            && before.bead == station.bead
            && before.overhang == station.overhang
    };
    let mut kept: Vec<Station> = Vec::with_capacity(stations.len());
    for (i, station) in stations.iter().enumerate() {
        let is_short = kept
            .last()
            .is_some_and(|last| distance(&last.at.xy(), &station.at.xy()) < SHORTEST_PIECE_MM);
        match (kept.as_slice(), stations.get(i + 1)) {
            ([.., last], Some(next)) if is_short && can_go(last, station, next) => continue,
            ([.., before, last], _) if is_short && can_go(before, last, station) => {
                kept.pop();
            }
            _ => (),
        }
        kept.push(*station);
    }
    *stations = kept;
}

/// A closed line begun at the place on it nearest to `target`, on a side if need be.
pub(crate) fn begun_near(path: &Toolpath, target: &Point2<f64>) -> OrderedLine {
    let points = plane(path);
    let place = nearest_on_ring(&points, target).expect("lines have points");
    for corner in [place.side, (place.side + 1) % points.len()] {
        // A begin this near to a corner moves into it.
        if distance(&points[corner], &place.at) < SHORTEST_PIECE_MM {
            return begun_at(path, Begin::at(corner));
        }
    }
    begun_at(path, Begin { after: place.side, share: place.share })
}

/// Above this many fills the improvement, which is quadratic, is left out.
const MOST_IMPROVED: usize = 400;

/// A gain smaller than this is rounding, mm; without a floor the improvement could go in circles.
const LEAST_GAIN_MM: f64 = 1e-6;

/// The order in which to lay fills, and whether each is reversed.
fn tour<'a>(fills: &[&'a Toolpath], start: Point2<f64>) -> Vec<(&'a Toolpath, bool)> {
    let by_index = tour_by_index(fills, start);
    by_index.into_iter().map(|(fill, reversed)| (fills[fill], reversed)).collect()
}

/// The same, with fills by their index.
fn tour_by_index(fills: &[&Toolpath], start: Point2<f64>) -> Vec<(usize, bool)> {
    let ends: Vec<[Point2<f64>; 2]> = fills
        .iter()
        .map(|fill| {
            let first = fill.stations[0].at.xy();
            let last = fill.stations[fill.stations.len() - 1].at.xy();
            if fill.closed { [first, first] } else { [first, last] }
        })
        .collect();
    let mut tour = by_nearest_neighbour(&ends, start);
    if tour.len() <= MOST_IMPROVED {
        improve(&mut tour, &ends, start);
    }
    tour.into_iter().map(|stop| (stop.fill, stop.reversed)).collect()
}

#[derive(Clone, Copy)]
struct Stop {
    fill: usize,
    reversed: bool,
}

impl Stop {
    fn entry(&self, ends: &[[Point2<f64>; 2]]) -> Point2<f64> {
        ends[self.fill][usize::from(self.reversed)]
    }

    fn exit(&self, ends: &[[Point2<f64>; 2]]) -> Point2<f64> {
        ends[self.fill][usize::from(!self.reversed)]
    }
}

fn by_nearest_neighbour(ends: &[[Point2<f64>; 2]], start: Point2<f64>) -> Vec<Stop> {
    let mut left: Vec<usize> = (0..ends.len()).collect();
    let mut at = start;
    let mut tour = Vec::with_capacity(ends.len());
    while !left.is_empty() {
        let mut best = (f64::INFINITY, 0, false);
        for (k, &fill) in left.iter().enumerate() {
            for reversed in [false, true] {
                let gap = distance(&at, &ends[fill][usize::from(reversed)]);
                if gap < best.0 {
                    best = (gap, k, reversed);
                }
            }
        }
        // `remove` and not `swap_remove`: equal gaps are decided by the order of the fills.
        let stop = Stop { fill: left.remove(best.1), reversed: best.2 };
        at = stop.exit(ends);
        tour.push(stop);
    }
    tour
}

/// Reverses stretches of the tour as long as that shortens it.
fn improve(tour: &mut [Stop], ends: &[[Point2<f64>; 2]], start: Point2<f64>) {
    let mut improved = true;
    while improved {
        improved = false;
        for from in 0..tour.len() {
            let before = if from == 0 { start } else { tour[from - 1].exit(ends) };
            for to in from..tour.len() {
                let gap = |a: Point2<f64>, b: Point2<f64>| distance(&a, &b);
                let (first, last) = (tour[from], tour[to]);
                let mut gain = gap(before, first.entry(ends)) - gap(before, last.exit(ends));
                if let Some(after) = tour.get(to + 1) {
                    gain += gap(last.exit(ends), after.entry(ends))
                        - gap(first.entry(ends), after.entry(ends));
                }
                if gain > LEAST_GAIN_MM {
                    tour[from..=to].reverse();
                    for stop in &mut tour[from..=to] {
                        stop.reversed = !stop.reversed;
                    }
                    improved = true;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slicer::toolpath::Overhang;

    const BEAD: Bead = Bead { width: 0.45, thickness: 0.2 };

    fn line(points: &[[f64; 2]], role: Role, closed: bool) -> Toolpath {
        let stations = points
            .iter()
            .map(|p| Station {
                at: Point3::new(p[0], p[1], 0.2),
                bead: BEAD,
                overhang: Overhang::None,
            })
            .collect();
        Toolpath { role, closed, stations }
    }

    fn square(x: f64, y: f64, half: f64, role: Role) -> Toolpath {
        let corners = [
            [x - half, y - half],
            [x + half, y - half],
            [x + half, y + half],
            [x - half, y + half],
        ];
        line(&corners, role, true)
    }

    fn ordered(layer: &LayerPaths, walls: WallOrder) -> Vec<OrderedLine> {
        let params =
            OrderParams { seam: SeamPosition::Nearest, infill_first: false, walls, uphill: false };
        order(layer, Point2::origin(), &mut SeamMemory::default(), &params)
    }

    #[test]
    fn short_pieces_go_unless_the_line_would_move() {
        let stations = |points: &[[f64; 2]]| line(points, Role::Perimeter, false).stations;
        let mut straight = stations(&[[0.0, 0.0], [0.01, 0.001], [5.0, 0.0]]);
        leave_out_short(&mut straight, SHORT_PIECE_TOLERANCE_MM);
        assert_eq!(straight.len(), 2);
        let mut notch = stations(&[[0.0, 0.0], [0.0, 0.015], [5.0, 0.0]]);
        leave_out_short(&mut notch, SHORT_PIECE_TOLERANCE_MM);
        assert_eq!(notch.len(), 3);
        leave_out_short(&mut notch, SHORTEST_PIECE_MM);
        assert_eq!(notch.len(), 2);
    }

    #[test]
    fn walls_from_the_inside_out_then_infill() {
        let walls = WallGroup {
            loops: vec![
                square(0.0, 0.0, 5.0, Role::ExternalPerimeter),
                square(0.0, 0.0, 4.6, Role::Perimeter),
            ],
        };
        let fills = vec![line(&[[-3.0, 0.0], [3.0, 0.0]], Role::InternalInfill, false)];
        let island = IslandPaths { walls: vec![walls], fills, ..IslandPaths::default() };
        let layer = LayerPaths { islands: vec![island], ..LayerPaths::default() };
        let roles = |walls| ordered(&layer, walls).iter().map(|l| l.role).collect::<Vec<_>>();
        let [outer, inner, infill] =
            [Role::ExternalPerimeter, Role::Perimeter, Role::InternalInfill];
        assert_eq!(roles(WallOrder::InsideOut), [inner, outer, infill]);
        assert_eq!(roles(WallOrder::OutsideIn), [outer, inner, infill]);
        assert_eq!(roles(WallOrder::InnerOuterInner), [outer, inner, infill]);
        for line in &ordered(&layer, WallOrder::InsideOut)[..2] {
            assert_eq!(line.stations.first().unwrap().at, line.stations.last().unwrap().at);
        }
    }

    #[test]
    fn the_external_wall_may_come_between_the_others() {
        let sizes = [5.0, 4.6, 4.2, 3.8];
        let role = |k| if k == 0 { Role::ExternalPerimeter } else { Role::Perimeter };
        let orders = |n: usize, walls| {
            let loops = (0..n).map(|k| square(0.0, 0.0, sizes[k], role(k))).collect();
            let walls_of = vec![WallGroup { loops }];
            let island = IslandPaths { walls: walls_of, ..IslandPaths::default() };
            let layer = LayerPaths { islands: vec![island], ..LayerPaths::default() };
            let reach =
                |line: &OrderedLine| line.stations.iter().map(|s| s.at.x).fold(f64::MIN, f64::max);
            ordered(&layer, walls).iter().map(reach).collect::<Vec<f64>>()
        };
        assert_eq!(orders(4, WallOrder::InnerOuterInner), [3.8, 4.2, 5.0, 4.6]);
        assert_eq!(orders(3, WallOrder::InnerOuterInner), [4.2, 5.0, 4.6]);
        assert_eq!(orders(1, WallOrder::InnerOuterInner), [5.0]);
        assert_eq!(orders(4, WallOrder::InsideOut), [3.8, 4.2, 4.6, 5.0]);
    }

    #[test]
    fn on_a_slope_lower_lines_come_first_and_open_ones_run_uphill() {
        let raised = |mut path: Toolpath, heights: &[f64]| {
            for (station, z) in path.stations.iter_mut().zip(heights.iter().cycle()) {
                station.at.z = *z;
            }
            path
        };
        let walls = WallGroup {
            loops: vec![
                raised(square(0.0, 0.0, 5.0, Role::ExternalPerimeter), &[1.0]),
                raised(square(0.0, 0.0, 4.6, Role::Perimeter), &[1.4]),
            ],
        };
        let slope = line(&[[0.0, 0.0], [3.0, 0.0]], Role::SolidInfill, false);
        let fills = vec![raised(slope, &[4.0, 2.0])];
        let island = IslandPaths { walls: vec![walls], fills, ..IslandPaths::default() };
        let layer = LayerPaths { islands: vec![island], ..LayerPaths::default() };
        let params = OrderParams {
            seam: SeamPosition::Nearest,
            infill_first: false,
            walls: WallOrder::InsideOut,
            uphill: true,
        };
        let lines = order(&layer, Point2::origin(), &mut SeamMemory::default(), &params);
        let roles: Vec<Role> = lines.iter().map(|line| line.role).collect();
        assert_eq!(roles, [Role::ExternalPerimeter, Role::Perimeter, Role::SolidInfill]);
        let heights: Vec<f64> = lines[2].stations.iter().map(|s| s.at.z).collect();
        assert_eq!(heights, [2.0, 4.0]);
    }

    #[test]
    fn inner_walls_begin_beside_the_seam() {
        let walls = WallGroup {
            loops: vec![
                square(0.0, 0.0, 5.0, Role::ExternalPerimeter),
                square(0.0, 0.0, 4.6, Role::Perimeter),
            ],
        };
        let island = IslandPaths { walls: vec![walls], ..IslandPaths::default() };
        let layer = LayerPaths { islands: vec![island], ..LayerPaths::default() };
        let lines = ordered(&layer, WallOrder::InsideOut);
        let gap = lines[1].stations[0].at - lines[0].stations.last().unwrap().at;
        assert!(gap.norm() < 0.6, "{gap}");
    }

    #[test]
    fn islands_are_visited_nearest_first() {
        let island = |x: f64| IslandPaths {
            fills: vec![line(&[[x, 0.0], [x + 1.0, 0.0]], Role::SolidInfill, false)],
            ..IslandPaths::default()
        };
        let layer = LayerPaths {
            islands: vec![island(50.0), island(10.0), island(30.0)],
            ..Default::default()
        };
        let islands: Vec<_> =
            ordered(&layer, WallOrder::InsideOut).iter().map(|l| l.island).collect();
        assert_eq!(islands, [Some(1), Some(2), Some(0)]);
    }

    #[test]
    fn fills_are_run_in_either_direction_to_save_travel() {
        let rows: Vec<Toolpath> = (0..6)
            .map(|i| line(&[[0.0, f64::from(i)], [20.0, f64::from(i)]], Role::SolidInfill, false))
            .collect();
        let rows: Vec<&Toolpath> = rows.iter().collect();
        let tour = tour(&rows, Point2::origin());
        let reversed: Vec<bool> = tour.iter().map(|(_, reversed)| *reversed).collect();
        assert_eq!(reversed, [false, true, false, true, false, true]);
    }

    #[test]
    fn improvement_never_lengthens_the_travel() {
        let mut state = 5_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) * 40.0
        };
        for _ in 0..20 {
            let ends: Vec<[Point2<f64>; 2]> = (0..30)
                .map(|_| [Point2::new(next(), next()), Point2::new(next(), next())])
                .collect();
            let travel = |tour: &[Stop]| {
                let mut at = Point2::origin();
                tour.iter()
                    .map(|stop| {
                        let gap = distance(&at, &stop.entry(&ends));
                        at = stop.exit(&ends);
                        gap
                    })
                    .sum::<f64>()
            };
            let greedy = by_nearest_neighbour(&ends, Point2::origin());
            let mut better = greedy.clone();
            improve(&mut better, &ends, Point2::origin());
            assert!(travel(&better) <= travel(&greedy) + 1e-9);
            let mut visited: Vec<usize> = better.iter().map(|stop| stop.fill).collect();
            visited.sort_unstable();
            assert_eq!(visited, (0..30).collect::<Vec<_>>());
        }
    }
}
