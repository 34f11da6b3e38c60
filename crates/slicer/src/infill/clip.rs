//! Lines of any shape, cut to an area.
//!
//! The sides of the area's rings are sorted into square cells, so that each piece of a line meets
//! only the few that are near it. Rings have the material on their left: a line that crosses a side
//! from right to left comes in, one that crosses from left to right goes out.

use geom::grid::mm;
use geom::region::{Region, ring_sides};
use nalgebra::Point2;

use super::{Chord, RimPoint};

/// A line before it is cut.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course {
    /// Points, mm.
    pub(super) points: Vec<Point2<f64>>,
    /// Whether it ends where it begins; the first point is not repeated.
    pub(super) closed: bool,
}

/// The parts of lines inside an area.
#[derive(Debug, Clone, Default)]
pub(super) struct Clipped {
    /// Parts that go from rim to rim.
    pub(super) chords: Vec<Chord>,
    /// Closed lines that lie inside as a whole.
    pub(super) loops: Vec<Vec<Point2<f64>>>,
}

/// Cuts lines to an area; open ones must begin and end outside.
pub(super) fn clipped(area: &Region, courses: &[Course]) -> Clipped {
    let mut clipped = Clipped::default();
    let Some(sides) = Sides::of(area) else { return clipped };
    for course in courses {
        let mut crossings = sides.crossings(&course.points, course.closed);
        if crossings.is_empty() {
            let is_inside = || course.points.first().is_some_and(|p| area.contains(p));
            if course.closed && is_inside() {
                clipped.loops.push(course.points.clone());
            }
            continue;
        }
        if course.closed {
            // Begun where it comes in, a closed line is an open one.
            let first = crossings.iter().position(|c| c.enters).unwrap_or(0);
            crossings.rotate_left(first);
        }
        let mut entry: Option<&Crossing> = None;
        for crossing in &crossings {
            if crossing.enters {
                entry = Some(crossing);
            } else if let Some(from) = entry.take() {
                clipped.chords.push(chord(course, from, crossing));
            }
        }
    }
    clipped
}

/// The part of a course between two crossings.
fn chord(course: &Course, from: &Crossing, to: &Crossing) -> Chord {
    let count = course.points.len();
    let wraps = (to.piece, to.along) < (from.piece, from.along);
    let pieces = to.piece + if wraps { count } else { 0 } - from.piece;
    let mut points = vec![from.at];
    points.extend((1..=pieces).map(|k| course.points[(from.piece + k) % count]));
    points.push(to.at);
    Chord { points, ends: [Some(from.rim), Some(to.rim)] }
}

/// A place where a line crosses a ring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crossing {
    /// The piece of the line: piece `i` begins at point `i`.
    pub(crate) piece: usize,
    /// Share of the piece before it.
    pub(crate) along: f64,
    /// The place, mm.
    pub(crate) at: Point2<f64>,
    rim: RimPoint,
    /// Whether the line comes in there, and does not go out.
    pub(crate) enters: bool,
}

/// A side of a ring.
#[derive(Clone)]
struct Side {
    ring: usize,
    side: usize,
    ends: [Point2<f64>; 2],
}

/// The sides of an area, by the cells that they run through.
#[derive(Clone)]
pub(crate) struct Sides {
    sides: Vec<Side>,
    /// The sides of all cells, one cell after the other.
    by_cell: Vec<u32>,
    /// Where the sides of each cell begin in that list, and its end.
    begins: Vec<u32>,
    low: Point2<f64>,
    size: f64,
    columns: usize,
    rows: usize,
}

/// Cells are not made smaller than this, mm: a few sides of a finely drawn outline.
const LEAST_CELL_MM: f64 = 0.5;

/// Nor are there more than so many of them along an axis.
const MOST_CELLS: f64 = 256.0;

impl Sides {
    /// `None` where there are none.
    pub(crate) fn of(area: &Region) -> Option<Self> {
        let bounds = area.bounds()?;
        let (low, high) = (mm(bounds.min), mm(bounds.max));
        let extent = high - low;
        let size = (extent.x.max(extent.y) / MOST_CELLS).max(LEAST_CELL_MM);
        let cells_along = |length: f64| (length / size).floor() as usize + 1;
        let (columns, rows) = (cells_along(extent.x), cells_along(extent.y));
        let mut sides = Vec::with_capacity(area.point_count());
        for (ring, points) in area.rings().enumerate() {
            for (side, (a, b)) in ring_sides(points).enumerate() {
                sides.push(Side { ring, side, ends: [mm(a), mm(b)] });
            }
        }
        let mut grid = Self {
            sides,
            by_cell: Vec::new(),
            begins: vec![0; columns * rows + 1],
            low,
            size,
            columns,
            rows,
        };
        grid.sort_into_cells();
        Some(grid)
    }

    /// Counts the sides of each cell, and then puts them there.
    fn sort_into_cells(&mut self) {
        let mut visits: Vec<(u32, u32)> = Vec::with_capacity(2 * self.sides.len());
        for (index, side) in self.sides.iter().enumerate() {
            self.on_the_way(&side.ends, |cell| visits.push((cell as u32, index as u32)));
        }
        for &(cell, _) in &visits {
            self.begins[cell as usize + 1] += 1;
        }
        for cell in 1..self.begins.len() {
            self.begins[cell] += self.begins[cell - 1];
        }
        let mut next = self.begins.clone();
        self.by_cell = vec![0; visits.len()];
        for (cell, index) in visits {
            let place = &mut next[cell as usize];
            self.by_cell[*place as usize] = index;
            *place += 1;
        }
    }

    fn in_cell(&self, cell: usize) -> &[u32] {
        &self.by_cell[self.begins[cell] as usize..self.begins[cell + 1] as usize]
    }

    /// Calls `visit` with every cell that a segment runs through or past the corner of.
    fn on_the_way(&self, [a, b]: &[Point2<f64>; 2], mut visit: impl FnMut(usize)) {
        let (a, b) = (a - self.low, b - self.low);
        let (low_y, high_y) = (a.y.min(b.y) / self.size, a.y.max(b.y) / self.size);
        if high_y < 0.0 || low_y >= self.rows as f64 {
            return;
        }
        let row_of = |y: f64| (y.floor().max(0.0) as usize).min(self.rows - 1);
        for row in row_of(low_y)..=row_of(high_y) {
            // The part of the segment in this row of cells.
            let at = |y: f64| {
                let share =
                    if a.y == b.y { 0.0 } else { ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0) };
                a.x + (b.x - a.x) * share
            };
            let ends = if a.y == b.y {
                [a.x, b.x]
            } else {
                [at(row as f64 * self.size), at((row + 1) as f64 * self.size)]
            };
            let (left, right) =
                (ends[0].min(ends[1]) / self.size, ends[0].max(ends[1]) / self.size);
            if right < 0.0 || left >= self.columns as f64 {
                continue;
            }
            // A shade wider, for the rounding of the division above.
            let column_of = |x: f64| (x.floor().max(0.0) as usize).min(self.columns - 1);
            for column in column_of(left - ROUNDING)..=column_of(right + ROUNDING) {
                visit(row * self.columns + column);
            }
        }
    }

    /// All crossings of a closed line with the rings, in its order.
    pub(crate) fn crossings_of_ring(&self, points: &[Point2<f64>]) -> Vec<Crossing> {
        self.crossings(points, true)
    }

    fn crossings(&self, points: &[Point2<f64>], closed: bool) -> Vec<Crossing> {
        let count = points.len();
        let pieces = if closed { count } else { count.saturating_sub(1) };
        let mut crossings = Vec::new();
        let mut near: Vec<u32> = Vec::new();
        for piece in 0..pieces {
            let ends = [points[piece], points[(piece + 1) % count]];
            near.clear();
            self.on_the_way(&ends, |cell| near.extend(self.in_cell(cell)));
            near.sort_unstable();
            near.dedup();
            let first = crossings.len();
            crossings.extend(
                near.iter()
                    .filter_map(|&index| crossing(piece, &ends, &self.sides[index as usize])),
            );
            crossings[first..].sort_by(|a, b| a.along.total_cmp(&b.along));
        }
        crossings
    }
}

/// Rounding of places in cells, in cells.
const ROUNDING: f64 = 1e-6;

/// Where a piece of a line crosses a side. Points on a line count as lying on its right, so that a
/// line through a corner crosses one of the two sides there.
fn crossing(piece: usize, [a, b]: &[Point2<f64>; 2], side: &Side) -> Option<Crossing> {
    let [c, d] = &side.ends;
    let (along, edge) = (b - a, d - c);
    let (c_side, d_side) = (along.perp(&(c - a)), along.perp(&(d - a)));
    let (a_side, b_side) = (edge.perp(&(a - c)), edge.perp(&(b - c)));
    if (c_side > 0.0) == (d_side > 0.0) || (a_side > 0.0) == (b_side > 0.0) {
        return None;
    }
    let share = (c_side / (c_side - d_side)).clamp(0.0, 1.0);
    Some(Crossing {
        piece,
        along: (a_side / (a_side - b_side)).clamp(0.0, 1.0),
        at: c + edge * share,
        rim: RimPoint { ring: side.ring, side: side.side, share },
        enters: b_side > 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use std::f64::consts::TAU;

    fn circle(radius: f64, count: u32) -> Vec<Point2<f64>> {
        let point = |k| {
            let angle = TAU * f64::from(k) / f64::from(count);
            Point2::new(radius * angle.cos(), radius * angle.sin())
        };
        (0..count).map(point).collect()
    }

    fn ring_of(outer: f64, inner: f64) -> Region {
        let [outer, inner] =
            [outer, inner].map(|r| Region::from_rings([circle(r, 180).as_slice()], Fill::NonZero));
        outer.difference(&inner)
    }

    #[test]
    fn a_line_through_a_ring_is_in_two_parts() {
        let area = ring_of(10.0, 4.0);
        let points = vec![Point2::new(-20.0, 0.3), Point2::new(1.0, 0.5), Point2::new(20.0, 0.3)];
        let found = clipped(&area, &[Course { points, closed: false }]);
        assert_eq!((found.chords.len(), found.loops.len()), (2, 0));
        for chord in &found.chords {
            assert!((geom::polyline::length(&chord.points) - 6.0).abs() < 0.05);
            let middle = nalgebra::center(&chord.points[0], &chord.points[1]);
            assert!(area.contains(&middle));
        }
    }

    #[test]
    fn closed_lines_are_kept_whole_or_cut() {
        let area = ring_of(10.0, 4.0);
        let whole = Course { points: circle(7.0, 50), closed: true };
        let outside = Course { points: circle(3.0, 50), closed: true };
        let moved = circle(7.0, 50).iter().map(|p| p + nalgebra::Vector2::new(9.0, 0.0)).collect();
        let cut = Course { points: moved, closed: true };
        let found = clipped(&area, &[whole, outside, cut]);
        assert_eq!(found.loops.len(), 1);
        // The third circle passes through the hole.
        assert_eq!(found.chords.len(), 2);
        let length: f64 = found.chords.iter().map(|c| geom::polyline::length(&c.points)).sum();
        let inside = (0..100_000)
            .map(|k| f64::from(k) * TAU / 100_000.0)
            .map(|a| Point2::new(9.0 + 7.0 * a.cos(), 7.0 * a.sin()).coords.norm())
            .filter(|r| (4.0..10.0).contains(r))
            .count() as f64;
        assert!((length - inside / 100_000.0 * TAU * 7.0).abs() < 0.1, "{length}");
    }

    #[test]
    fn parts_of_many_lines_add_up() {
        // Against the plain cut of each segment.
        let area = ring_of(9.0, 2.5);
        let mut expected = 0.0;
        let mut courses = Vec::new();
        for k in 0..60 {
            let y = -12.0 + 0.41 * f64::from(k);
            let points: Vec<Point2<f64>> = (0..=120)
                .map(|i| Point2::new(-12.0 + 0.2 * f64::from(i), y + (f64::from(i) * 0.3).sin()))
                .collect();
            expected += points
                .windows(2)
                .flat_map(|w| area.parts(&w[0], &w[1]))
                .filter(|part| part.inside)
                .map(|part| part.length())
                .sum::<f64>();
            courses.push(Course { points, closed: false });
        }
        let found = clipped(&area, &courses);
        let length: f64 = found.chords.iter().map(|c| geom::polyline::length(&c.points)).sum();
        assert!((length - expected).abs() < 1e-6 * expected, "{length} {expected}");
    }
}
